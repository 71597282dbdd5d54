"""Elements of operators and tensors between Wang functions of many N at once, by the formulas of `tensors` and `operators`."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.basis.wang_functions import BetweenStates, WangFunctions
from rotor.quantum.operators.algebra import Operator, change_of
from rotor.quantum.operators.symmetric_top_elements import coupling_to, wang_coupling
from rotor.quantum.operators.tensors import BodyTensor, folded_places, overlap
from rotor.quantum.spins.scheme import (
    ByElements,
    BySpecies,
    Cosines,
    CosinesWithN,
    Fixed,
    Rotor,
    Scalar,
    axis_tensor,
    factors_with_n,
    tensor_of,
)
from rotor.quantum.wang.basis import SPECIES, Part, SpeciesFactors, WangBlock
from rotor.quantum.wang.wang_matrix import diagonal_elements, unit_diagonals

MOST_RANK = 2  # highest rank with closed forms for many N at once


class Section(NamedTuple):
    """The functions of one state v and one kind of Wang block in a stack: basis of the largest N, rows, and the parts of all N."""

    v: int
    basis: WangBlock
    rows: slice
    parts: tuple[Part, ...]

    def blocks(self, places: Ints) -> tuple[WangBlock, ...]:
        """The Wang blocks at some places of the stack."""
        return tuple([self.parts[place].basis for place in places.tolist()])


class Pairs(NamedTuple):
    """Pairs of blocks of two stacks: places in the stacks (pairs,), and N' and N as columns (pairs, 1).

    k: K' and K (pairs,) of functions |N K⟩, None for Wang functions.
    """

    up: Ints
    low: Ints
    m: Ints
    n: Ints
    k: tuple[Ints, Ints] | None = None

    @property
    def rise(self) -> int:
        """N' - N, equal for all pairs."""
        return int(self.m[0, 0] - self.n[0, 0])

    def turned(self) -> Pairs:
        """The pairs in the opposite order."""
        return Pairs(self.low, self.up, self.n, self.m, None if self.k is None else self.k[::-1])


def power_matrices(section: Section, units: Sequence[tuple[int, int]]) -> Floats:
    """½[Nz^2q, N₊^2n + N₋^2n]₊ over the functions of a section: (blocks, units, functions, functions)."""
    bases = [part.basis for part in section.parts if isinstance(part.basis, WangBlock)]
    matrices = np.zeros((len(bases), len(units), section.basis.size, section.basis.size))
    for d, diagonal in enumerate(unit_diagonals(bases, [basis.size for basis in bases], units) if units else ()):
        places = np.arange(max(diagonal.shape[1] - d, 0))
        values = diagonal[:, places].transpose(0, 2, 1)
        matrices[:, :, places + d, places] = matrices[:, :, places, places + d] = values
    return matrices


def rotor_elements(rotor: Rotor, left: Section, right: Section, pairs: Pairs, representation: str) -> Floats | None:
    """Elements (pairs, functions', functions) of an operator between two sections; None where it does not act.

    Between functions |N K⟩ they are those of one sign of K, in the phases of Wang functions; factors of species do not occur.
    """
    if isinstance(rotor, Cosines):
        tensor = tensor_of(rotor.components, rotor.rank, representation)
        elements = None if tensor is None else _tensor_elements(tensor, left.basis, right.basis, pairs)
        return -elements if elements is not None and rotor.rank == 1 else elements
    if isinstance(rotor, Fixed):
        return _tensor_elements(rotor.tensor, left.basis, right.basis, pairs)
    if isinstance(rotor, CosinesWithN):
        return _elements_with_n(rotor, left.basis, right.basis, pairs, representation)
    if isinstance(rotor, BySpecies):
        elements = rotor_elements(rotor.operator, left, right, pairs, representation)
        if elements is None or pairs.k is not None:
            return elements
        return elements * _factors_of_pairs(rotor.factors, left, right, pairs)
    if isinstance(rotor, Scalar):
        return _scalar_elements(rotor, left, right, pairs) if pairs.k is None else _axial_powers(rotor, pairs, *pairs.k)
    if pairs.k is not None:
        return _axial_elements_of_operator(rotor, pairs, *pairs.k)
    return _elements_of_operator(rotor, left, right, pairs)


def elements_of_pair(rotor: Rotor, up: WangBlock, low: WangBlock, representation: str) -> Floats | None:
    """Elements (functions', functions) of an operator between two Wang blocks; None where it does not act."""
    left, right = (Section(0, basis, slice(0, basis.size), (Part(0, basis, 0),)) for basis in (up, low))
    first = np.zeros(1, dtype=np.int64)
    pairs = Pairs(first, first, np.array([[up.j]]), np.array([[low.j]]))
    elements = rotor_elements(rotor, left, right, pairs, representation)
    return None if elements is None else elements[0]


def _factors_of_pairs(factors: SpeciesFactors, left: Section, right: Section, pairs: Pairs) -> Floats:
    """The factor of the species of each pair of blocks, (pairs, 1, 1)."""
    blocks = left.blocks(pairs.up), right.blocks(pairs.low)
    up, low = ([SPECIES.index(block.species) for block in each] for each in blocks)
    return np.asarray(np.array(factors)[up, low][:, None, None])


def _elements_of_operator(rotor: ByElements, left: Section, right: Section, pairs: Pairs) -> Floats | None:
    """Elements of any operator between two sections."""
    shifts = [each for each in rotor.operator.shifts if dict(each.change).get("J", 0) == pairs.rise]
    between = _between_functions(left.blocks(pairs.up), right.blocks(pairs.low))
    elements, _ = between.elements(Operator(tuple(shifts)))
    if not len(elements.rows):
        return None
    out = np.zeros((len(pairs.up), left.basis.size, right.basis.size))
    out[elements.up, elements.rows, elements.columns] = elements.values
    return out


@lru_cache(maxsize=64)
def _between_functions(up: tuple[WangBlock, ...], low: tuple[WangBlock, ...]) -> BetweenStates:
    """The writer of elements between functions, which several operators share."""
    return BetweenStates(WangFunctions(up), WangFunctions(low))


def _elements_with_n(
    rotor: CosinesWithN, up: WangBlock, low: WangBlock, pairs: Pairs, representation: str
) -> Floats | None:
    """Elements of `CosinesWithN` between two kinds of functions."""
    if abs(pairs.rise) > 1:
        return None
    m, n = pairs.m[:, :, None].astype(float), pairs.n[:, :, None].astype(float)
    stretch, change, length = factors_with_n(m, n)
    parts = [
        (stretch, tensor_of(rotor.components, 2, representation)),
        (change, axis_tensor(rotor.components, representation)),
    ]
    terms = [(factor, _tensor_elements(tensor, up, low, pairs)) for factor, tensor in parts if tensor is not None]
    acting = [factor * matrix for factor, matrix in terms if matrix is not None]
    scalar = float(np.trace(np.array(rotor.components))) / 3
    if scalar and not pairs.rise and (same := _same_functions(up, low, pairs)).any():
        acting.append(scalar * length * same)
    return np.asarray(sum(acting)) if acting else None


def _same_functions(up: WangBlock, low: WangBlock, pairs: Pairs) -> NDArray[np.bool_]:
    """Whether a function' is a function, (functions', functions), for one N; states may differ in their range of K."""
    if pairs.k is not None:
        return np.array([[(pairs.k[0] == pairs.k[1]).all()]])
    return np.asarray(np.equal.outer(up.k, low.k) & (up.sign == low.sign))


def _scalar_elements(rotor: Scalar, left: Section, right: Section, pairs: Pairs) -> Floats | None:
    """Elements of powers of N, which act between Wang functions of one kind, in states that may differ in their range of K."""
    up, low = left.basis, right.basis
    if pairs.rise or up.sign != low.sign or (up.first_k - low.first_k) % 2:
        return None
    units = sorted({(q, n) for (_, q, n), _ in rotor.operators})
    x, factors = pairs.n[:, 0] * (pairs.n[:, 0] + 1.0), np.zeros((len(pairs.n), len(units)))
    for (p, q, n), factor in rotor.operators:
        factors[:, units.index((q, n))] += factor * x**p
    whole = _with_k_of_both(left, right)
    matrices = np.einsum("bu,buij->bij", factors, power_matrices(whole, units)[pairs.up])
    first, other = ((basis.first_k - whole.basis.first_k) // 2 for basis in (up, low))
    return np.asarray(matrices[:, first : first + up.size, other : other + low.size])


def _with_k_of_both(left: Section, right: Section) -> Section:
    """The section `left` with the K of `right` beside its own."""
    first, last = min(left.basis.first_k, right.basis.first_k), max(left.basis.k[-1], right.basis.k[-1])

    def widened(basis: WangBlock) -> WangBlock:
        return basis._replace(first_k=first, size=(min(basis.j, last) - first) // 2 + 1)

    parts = tuple(part._replace(basis=widened(part.basis)) for part in left.parts)
    return left._replace(basis=left.basis._replace(first_k=first, size=(last - first) // 2 + 1), parts=parts)


def _tensor_elements(tensor: BodyTensor, up: WangBlock, low: WangBlock, pairs: Pairs) -> Floats | None:
    """`tensors.block_elements` for all pairs, (pairs, up.size, low.size); between functions |N K⟩ those of one sign of K."""
    rank, rise = tensor.rank, pairs.rise
    if rank > MOST_RANK:
        raise ValueError(f"a tensor of rank {rank}: expected at most {MOST_RANK} with spins")
    if pairs.k is not None:
        return _axial_tensor_elements(tensor, pairs, *pairs.k)
    steps, parts_of_n = _signed_parts(tensor, up, low, rise)
    if abs(rise) > rank or not steps:
        return None
    closes = (pairs.m + pairs.n >= rank)[:, 0]
    if not closes.any():
        return None
    m, n = (pairs.m, pairs.n) if closes.all() else (pairs.m[closes], pairs.n[closes])
    parts = parts_of_n[n[:, 0] % 4]
    elements, all_n = np.zeros((len(m), up.size, low.size)), tuple(n[:, 0].tolist())
    for step in steps:
        source, target = overlap(up, low, step)
        if source.start < source.stop:
            rows, columns = np.arange(target.start, target.stop), np.arange(source.start, source.stop)
            first, count = low.first_k + 2 * source.start, source.stop - source.start
            elements[:, rows, columns] = _couplings(all_n, rise, rank, step, first, count) * parts[:, rank + step, None]
    for row, column, k_up, k in folded_places(up.first_k, low.first_k, rank):
        if row < up.size and column < low.size:
            turned = _couplings(all_n, rise, rank, k_up + k, -k, 1)[:, 0]
            elements[:, row, column] += low.sign * turned * parts[:, rank + k_up + k]
    if closes.all():
        return elements
    out = np.zeros((len(closes), up.size, low.size))
    out[closes] = elements
    return out


@lru_cache(maxsize=1024)
def _signed_parts(tensor: BodyTensor, up: WangBlock, low: WangBlock, rise: int) -> tuple[tuple[int, ...], Floats]:
    """The steps of K of a tensor between two kinds of Wang blocks, and its components with their signs by N modulo 4, (4, 2K + 1)."""
    by_n = [tensor.signed_parts(up._replace(j=n + rise), low._replace(j=n)) for n in range(4)]
    return tuple(by_n[0][0]), np.array([signed for _, signed in by_n])


@lru_cache(maxsize=512)  # about 20 MB for N up to 100
def _couplings(all_n: tuple[int, ...], rise: int, rank: int, step: int, first_k: int, count: int) -> Floats:
    """`wang_coupling` from each N to N + rise, over K = first_k, first_k + 2, ...: (N, K), shared and read-only."""
    out = wang_coupling(np.array(all_n)[:, None], rise, rank, step, first_k + 2.0 * np.arange(count))
    out.flags.writeable = False
    return out


def _axial_powers(rotor: Scalar, pairs: Pairs, k_up: Ints, k: Ints) -> Floats | None:
    """Elements of powers of N within functions |N K⟩."""
    if pairs.rise or (k_up != k).any():
        return None
    return diagonal_elements(dict(rotor.operators), pairs.n[:, 0], k)[:, None, None]


def _axial_elements_of_operator(rotor: ByElements, pairs: Pairs, k_up: Ints, k: Ints) -> Floats | None:
    """Elements of any operator between functions with K = 0; ValueError for others, which stand for -K too."""
    if k.any() or k_up.any():
        raise ValueError(
            f"functions |N K⟩ with K = {max(*k, *k_up)}, which stand for -K too: Wang functions are needed"
        )
    labels, change = {"J": pairs.n[:, 0], "K": k}, change_of({"J": pairs.rise})
    alike = [np.broadcast_to(each.factor(labels), len(k)) for each in rotor.operator.shifts if each.change == change]
    total = np.sum(alike, axis=0)
    return np.asarray(total.real - total.imag)[:, None, None] if np.any(total) else None


def _axial_tensor_elements(tensor: BodyTensor, pairs: Pairs, k_up: Ints, k: Ints) -> Floats | None:
    """⟨N'K'‖T‖N K⟩ (pairs, 1, 1) of one sign of K; a component across the axis enters with its absolute value."""
    q = int(k_up[0] - k[0])
    if max(abs(q), abs(pairs.rise)) > tensor.rank or not (part := tensor.components[tensor.rank + q]):
        return None
    values = (abs(part) if q else part.real) * coupling_to(pairs.n[:, 0], pairs.rise, tensor.rank, q, k)
    return values[:, None, None] if (pairs.m + pairs.n).max() >= tensor.rank else None


def both_signs(pairs: Pairs) -> Floats:
    """√(number of components) of functions |N K⟩ (pairs, 1, 1), so that squares of elements count both signs of K."""
    assert pairs.k is not None
    return np.where(np.any(pairs.k, axis=0), np.sqrt(2.0), 1.0)[:, None, None]
