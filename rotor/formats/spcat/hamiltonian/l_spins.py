"""l-doubled states with spins: what a spin parameter stands for over the two real states x and y, and names of levels.

The table of `l_doubled` holds for the operators of N in spin terms too. i(O↑ - O↓) of a tensor with components q = ±1 or ±2 alone is
the tensor turned about z by 90° or 45°, so that xz becomes yz and xx - yy becomes xy + yx.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.formats.spcat.hamiltonian.l_doubled import Pair, functions_of_parts, over_real_states
from rotor.formats.spcat.hamiltonian.labels import renamed
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.spins.blocks import SpinBlock
from rotor.quantum.spins.operators import Cosines, CosinesWithN, Matrix, Rotor
from rotor.quantum.spins.parts import assigned
from rotor.quantum.spins.terms import SpinTerm


def spin_terms_with_pairs(
    term: SpinTerm, states: tuple[int, int], reversed_: bool, pairs: Sequence[Pair], axes: str
) -> list[SpinTerm]:
    """A spin term of a file over real states, where one of its states at least is l-doubled.

    Parameters
    ----------
    term : SpinTerm
        As it is for other states.
    states : (int, int)
        Lower number first.
    reversed_ : bool
        V2 > V1 in the code, Δk Δl < 0.
    pairs : sequence of Pair
        The l-doubled states of the file.
    axes : str
        Those at x, y, z: bca or bac.

    Returns
    -------
    list of SpinTerm
        As the table at the head of `l_doubled`.

    Raises
    ------
    ValueError
        For what this package does not compute between such states.
    """
    odd = term.rotor.odd
    if odd and states[0] == states[1] and axes[2] == "c":
        term = replace(
            term, factor=-term.factor
        )  # the sign of what is odd is another between states than within a pair there
    turned = turned_rotor(term.rotor, axes)
    return [
        replace(term, bra=part.bra, ket=part.ket, factor=term.factor * part.factor, rotor=rotor)
        for part in over_real_states(states, odd, reversed_, pairs, "spin operator")
        if (rotor := turned if part.turned else term.rotor) is not None
    ]


def turned_rotor(rotor: Rotor, axes: str) -> Rotor | None:
    """i(O↑ - O↓) of a tensor, None where it has neither.

    >>> turned_rotor(Cosines(((0, 0, 0), (0, 1.0, 0), (0, 0, -1.0))), "bca").components  # bb - cc becomes bc + cb
    ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    """
    if not isinstance(rotor, Cosines | CosinesWithN) or (rotor.rank == 1 and isinstance(rotor, Cosines)):
        return None
    x, y, z = ("abc".index(axis) for axis in axes)
    c, found = np.array(rotor.components, dtype=float), np.zeros((3, 3))
    stretched = (c[x, x] - c[y, y]) / 2
    found[x, y] = found[y, x] = stretched
    found[x, x], found[y, y] = -(c[x, y] + c[y, x]) / 2, (c[x, y] + c[y, x]) / 2
    found[y, z], found[z, y], found[x, z], found[z, x] = c[x, z], c[z, x], -c[y, z], -c[z, y]
    if not found.any():
        return None
    found += 0.0  # no minus zeros
    components: Matrix = tuple(tuple(float(value) for value in row) for row in found)  # type: ignore[assignment]
    return type(rotor)(components)


def named_by_l_with_spins(levels: Levels, pairs: Sequence[Pair], representation: str) -> Levels:
    """The same levels with v of a pair by the sign of K l, and names by the function |K, l⟩ ± |-K, -l⟩ with the largest share."""
    found = []
    known: dict[int, tuple[Floats, Ints]] = {}
    for block in levels.blocks:
        for part in block.parts:
            if part.number not in known:
                known[part.number] = _functions(part.rotor, pairs, representation)
        found.append(_names_of_block(block, known))
    return renamed(levels, *zip(*found, strict=True))


def functions_with_spins(block: SpinBlock, pairs: Sequence[Pair], representation: str) -> tuple[Floats, Ints]:
    """The functions (n, n), in rows over those of the basis, by which the states of a block are called, and their names (n, 3 + pattern).

    |K, l⟩ ± |-K, -l⟩ as in `l_doubled.functions_of_l`, with every coupling pattern; v, Ka, Kc and the doubled pattern.
    """
    functions = np.zeros((block.parts[-1].place.stop,) * 2)
    names = list[Ints]()
    for part in block.parts:
        own, called = _functions(part.rotor, pairs, representation)
        functions[part.place, part.place] = np.kron(np.eye(part.repeats), own)
        for pattern in block.patterns[part.patterns]:
            names.append(np.hstack([called, np.broadcast_to(pattern, (len(called), len(pattern)))]))
    return functions, np.concatenate(names)


def _names_of_block(block: SpinBlock, known: dict[int, tuple[Floats, Ints]]) -> tuple[Ints, Floats]:
    names, shares = list[Ints](), list[Floats]()
    for part in block.parts:
        functions, own = known[part.number]
        rows = block.vectors[part.place].reshape(part.repeats, len(part.rotor.energies_mhz), -1)
        inside = np.einsum("fr,prn->pfn", functions @ part.rotor.vectors, rows)
        for pattern, of_pattern in zip(block.patterns[part.patterns], inside, strict=True):
            names.append(np.hstack([own, np.broadcast_to(pattern, (len(own), len(pattern)))]))
            shares.append(of_pattern**2)
    table = np.concatenate(shares)
    of_state = assigned(table, np.ones(len(table), dtype=np.int64))
    return np.concatenate(names)[of_state], np.asarray(table[of_state, np.arange(len(of_state))])


def _functions(rotor: SolvedBlock, pairs: Sequence[Pair], representation: str) -> tuple[Floats, Ints]:
    places = [(part.v, part.basis, part.place.start) for part in rotor.parts]
    return functions_of_parts(places, len(rotor.vectors), pairs, representation)
