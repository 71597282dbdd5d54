"""Wang's symmetry-adapted basis of one J: states, their order and their symmetry.

|J K s⟩ = (|J K⟩ + s |J -K⟩)/√2 for K > 0 and |J 0⟩ for K = 0, s = ±1. States whose K have one parity and one s form
a Wang block: E+ (K = 0, 2, ...), E- (2, 4, ...), O+ and O- (1, 3, ...). Under the rotations by π about x, y, z of the
molecule a state of the block has the characters (Bunker and Jensen, Molecular Symmetry and Spectroscopy, table 12-1)

    C2x: s (-1)^J,    C2y: s (-1)^(J+K),    C2z: (-1)^K,

In any representation (-1)^Ka and (-1)^Kc are the characters under C2a and C2c, so that J and the parities of Ka and Kc identify a block.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import numbers_in_runs
from rotor.tops.constants.operators import REPRESENTATIONS as REPRESENTATIONS
from rotor.tops.constants.operators import axis_order

_WANG = ((0, 1), (2, -1), (1, 1), (1, -1))  # E+, E-, O+, O-: lowest K and s


class WangBlock(NamedTuple):
    """One block: its J, parities of (Ka, Kc), lowest K, sign s and number of states; K = first_k, first_k + 2, ..."""

    j: int
    species: str
    first_k: int
    sign: int
    size: int

    @property
    def k(self) -> NDArray[np.int64]:
        """K of the basis states, (size,)."""
        return self.first_k + 2 * np.arange(self.size)


NOTHING = 1e-13  # of an operator's largest element: what is smaller between two blocks is round-off of zero


class Part(NamedTuple):
    """The functions of one state v and one Wang block, or |N K⟩ of an axial top, from `start` on in a block.

    names: beside spins, v, Ka and Kc of the functions in order of energy, (size, 3); v, K and 0 of |N K⟩.
    """

    v: int
    basis: Any
    start: int
    names: Any = None

    @property
    def place(self) -> slice:
        """Places of the functions in the block."""
        return slice(self.start, self.start + self.basis.size)


def parts_of(members: Iterable[tuple[int, WangBlock]]) -> tuple[Part, ...]:
    """The parts of a block, one behind the other, from the state v and the Wang block of each."""
    parts, start = [], 0
    for v, basis in members:
        parts.append(Part(v, basis, start))
        start += basis.size
    return tuple(parts)


def _species(j: int, first_k: int, sign: int, axes: str) -> str:
    """Parities of Ka and Kc of a Wang block."""
    k_even, j_even = (-1) ** first_k, (-1) ** j
    character = {axes[0]: sign * j_even, axes[1]: sign * j_even * k_even, axes[2]: k_even}
    return "".join("e" if character[axis] > 0 else "o" for axis in "ac")


def character(species: str, axis: str) -> int:
    """Character, 1 or -1, of the blocks of a species under a half turn about a, b or c.

    >>> [character("eo", axis) for axis in "abc"]
    [1, -1, -1]
    """
    under_a, under_c = (1 if parity == "e" else -1 for parity in species)
    return {"a": under_a, "b": under_a * under_c, "c": under_c}[axis]


SPECIES = ("ee", "eo", "oe", "oo")
SpeciesFactors = tuple[tuple[float, ...], ...]  # by the species of the bra and of the ket, in the order of SPECIES


def factors_of_pairs(pairs: Collection[tuple[str, str]]) -> SpeciesFactors:
    """1 for pairs of species of bra and ket, 0 for others."""
    return tuple(tuple(float((up, low) in pairs) for low in SPECIES) for up in SPECIES)


def half_turn(axis: str, sign: float = 1.0) -> SpeciesFactors:
    """± the character of the bra under a half turn about a, b or c: what it multiplies an operator with from the left."""
    return tuple((sign * character(up, axis),) * len(SPECIES) for up in SPECIES)


def phase(block: WangBlock) -> complex:
    """The factor that makes a Wang function invariant under time reversal: 1, or i where s differs from (-1)^K.

    Over functions with this factor all Hermitian operators that are even under time reversal are real (their matrix over |J k⟩ obeys
    M(-k', -k) = (-1)^(k'-k) M(k', k)*).
    """
    return 1.0 if block.sign == (-1) ** block.first_k else 1j


def wang_blocks(j: int, representation: str) -> list[WangBlock]:
    """The non-empty blocks of `j`, in the order ee, eo, oe, oo.

    >>> [(b.species, b.size) for b in wang_blocks(1, "Ir")]
    [('eo', 1), ('oe', 1), ('oo', 1)]
    """
    kinds = _kinds_of_blocks(j % 2, representation)
    return [WangBlock(j, species, k, sign, (j - k) // 2 + 1) for species, k, sign in kinds if j >= k]


@lru_cache(maxsize=2 * len(REPRESENTATIONS))
def _kinds_of_blocks(parity_of_j: int, representation: str) -> list[tuple[str, int, int]]:
    """Species, lowest K and sign of the blocks of an even or odd J in the order of their species."""
    axes = axis_order(representation)
    return sorted((_species(parity_of_j, first, sign, axes), first, sign) for first, sign in _WANG)


def limited(block: WangBlock, kmin: int, kmax: int) -> WangBlock | None:
    """The part of a block with `kmin` ≤ K ≤ `kmax`; None if it is empty.

    >>> limited(WangBlock(5, "eo", 0, 1, 3), 1, 3)
    WangBlock(j=5, species='eo', first_k=2, sign=1, size=1)
    """
    skipped = max(0, -(-(kmin - block.first_k) // 2))
    first = block.first_k + 2 * skipped
    size = min(block.size - skipped, (kmax - first) // 2 + 1)
    return block._replace(first_k=first, size=size) if size > 0 else None


def blocks_within(j: int, representation: str, limits: tuple[int, int] | None) -> list[WangBlock]:
    """The blocks of `j`, or their parts within the least and the largest K."""
    whole = wang_blocks(j, representation)
    return whole if limits is None else [part for block in whole if (part := limited(block, *limits))]


def names_of(block: WangBlock, representation: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Ka and Kc of the states of a block in order of energy; some K may be left out of the block.

    >>> names_of(WangBlock(5, "eo", 2, 1, 1), "Ir")
    (array([2]), array([3]))
    """
    return names_of_blocks([block], [block.size], representation)


def names_of_blocks(
    blocks: Sequence[WangBlock], counts: Sequence[int], representation: str
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """`names_of` of the lowest states of each block, one block behind the other."""
    first, total = np.array([_first_of_part(block, representation) for block in blocks]).reshape(-1, 2).T
    number, place = numbers_in_runs(np.asarray(counts, dtype=np.int64))
    ka = first[number] + 2 * place
    return ka, total[number] - ka


def _first_of_part(block: WangBlock, representation: str) -> tuple[int, int]:
    """Ka of the lowest state of a block, of which some K may be left out, and Ka + Kc, J or J + 1; Ka rises by two in the block."""
    ka_odd, kc_odd = (parity == "o" for parity in block.species)
    at_j = (ka_odd + kc_odd) % 2 == block.j % 2
    first, total = 1 if ka_odd else (0 if at_j else 2), block.j if at_j else block.j + 1
    whole = (block.j - block.first_k % 2) // 2 + 1 - (block.first_k % 2 == 0 and block.sign < 0)
    if block.size == whole:
        return first, total
    axis = REPRESENTATIONS[representation][2]
    if axis == "b":
        raise ValueError(f"K limited in representation {representation}: its z is b, where K is neither Ka nor Kc")
    lowest = block.first_k % 2 if block.first_k % 2 or block.sign > 0 else 2
    skipped = (block.first_k - lowest) // 2
    return first + 2 * (skipped if axis == "a" else whole - skipped - block.size), total
