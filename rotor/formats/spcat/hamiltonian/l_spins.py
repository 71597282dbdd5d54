"""l-doubled states with spins: spin terms over the two real states x and y, and labels of levels.

The table of `l_doubled` also holds for the operators of N in spin terms. For a tensor with components q = ±1 or ±2 only, i(O↑ - O↓) is the
tensor turned about z by 90° or 45°: xz becomes yz, and xx - yy becomes xy + yx.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.formats.spcat.hamiltonian.l_doubled import Pair, block_names, l_functions, over_real_states
from rotor.formats.spcat.hamiltonian.labels import renamed
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.spins.blocks import SpinBlock
from rotor.quantum.spins.operators import Cosines, CosinesWithN, Matrix, Rotor
from rotor.quantum.spins.parts import assigned
from rotor.quantum.spins.scheme import SpinTerm


def spin_terms_with_pairs(
    term: SpinTerm, states: tuple[int, int], reversed_: bool, pairs: Sequence[Pair], axes: str
) -> list[SpinTerm]:
    """A spin term of a file over real states, if at least one of its states is l-doubled (table of `l_doubled`).

    term: the term for states that are not l-doubled. states: numbers, the lower one first. reversed_: whether V2 > V1 in the code, Δk Δl
    < 0. pairs: the l-doubled states of the file. axes: the axes x, y, z: bca or bac.
    Returns: terms over x and y.
    Raises ValueError for terms that are not supported between such states.
    """
    odd = term.rotor.odd
    if odd and states[0] == states[1] and axes[2] == "c":
        # the sign of what is odd is another between states than within a pair there
        term = replace(term, factor=-term.factor)
    turned = turned_rotor(term.rotor, axes)
    return [
        replace(term, bra=part.bra, ket=part.ket, factor=term.factor * part.factor, rotor=rotor)
        for part in over_real_states(states, odd, reversed_, pairs, "spin operator")
        if (rotor := turned if part.turned else term.rotor) is not None
    ]


def turned_rotor(rotor: Rotor, axes: str) -> Rotor | None:
    """i(O↑ - O↓) of a tensor; None if it is zero.

    >>> turned_rotor(Cosines(((0, 0, 0), (0, 1.0, 0), (0, 0, -1.0))), "bca").components  # bb - cc becomes bc + cb
    ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    """
    if not isinstance(rotor, Cosines | CosinesWithN) or (rotor.rank == 1 and isinstance(rotor, Cosines)):
        return None
    x, y, z = ("abc".index(axis) for axis in axes)
    c, turned = np.array(rotor.components, dtype=float), np.zeros((3, 3))
    stretched = (c[x, x] - c[y, y]) / 2
    turned[x, y] = turned[y, x] = stretched
    turned[x, x], turned[y, y] = -(c[x, y] + c[y, x]) / 2, (c[x, y] + c[y, x]) / 2
    turned[y, z], turned[z, y], turned[x, z], turned[z, x] = c[x, z], c[z, x], -c[y, z], -c[z, y]
    if not turned.any():
        return None
    turned += 0.0  # no minus zeros
    components: Matrix = tuple(tuple(float(value) for value in row) for row in turned)  # type: ignore[assignment]
    return type(rotor)(components)


def named_by_l(levels: Levels, pairs: Sequence[Pair], representation: str) -> Levels:
    """Relabel levels: v of a pair by the sign of K l, and labels of the function |K, l⟩ ± |-K, -l⟩ with the largest weight."""
    labels_and_weights = list[tuple[Ints, Floats]]()
    functions_by_block: dict[int, tuple[Floats, Ints]] = {}
    for block in levels.blocks:
        if not isinstance(block, SpinBlock):
            labels_and_weights.append(block_names(block, pairs, representation))
            continue  # a block without spins has its labels at once
        for part in block.parts:
            if part.number not in functions_by_block:
                functions_by_block[part.number] = l_functions(part.rotor, pairs, representation)
        labels_and_weights.append(_names_with_spins(block, functions_by_block))
    return renamed(levels, *zip(*labels_and_weights, strict=True))


def functions_by_l(block: SolvedBlock | SpinBlock, pairs: Sequence[Pair], representation: str) -> tuple[Floats, Ints]:
    """The functions (n, n), in rows over the basis, that label the states of a block, and their labels.

    They are |K, l⟩ ± |-K, -l⟩ of `l_doubled.l_functions` with each coupling pattern; labels: v, Ka, Kc, doubled pattern if any.
    """
    if not isinstance(block, SpinBlock):
        return l_functions(block, pairs, representation)
    functions = np.zeros((block.parts[-1].place.stop,) * 2)
    names = list[Ints]()
    for part in block.parts:
        rotational, labels = l_functions(part.rotor, pairs, representation)
        functions[part.place, part.place] = np.kron(np.eye(part.repeats), rotational)
        for pattern in block.patterns[part.patterns]:
            names.append(np.hstack([labels, np.broadcast_to(pattern, (len(labels), len(pattern)))]))
    return functions, np.concatenate(names)


def _names_with_spins(block: SpinBlock, functions_by_block: dict[int, tuple[Floats, Ints]]) -> tuple[Ints, Floats]:
    """Labels and weights of the states of a block."""
    names, shares = list[Ints](), list[Floats]()
    for part in block.parts:
        functions, labels = functions_by_block[part.number]
        rows = block.vectors[part.place].reshape(part.repeats, len(part.rotor.energies_mhz), -1)
        inside = np.einsum("fr,prn->pfn", functions @ part.rotor.vectors, rows)
        for pattern, amplitudes in zip(block.patterns[part.patterns], inside, strict=True):
            names.append(np.hstack([labels, np.broadcast_to(pattern, (len(labels), len(pattern)))]))
            shares.append(amplitudes**2)
    table = np.concatenate(shares)
    function_of_state = assigned(table, np.ones(len(table), dtype=np.int64))
    return np.concatenate(names)[function_of_state], np.asarray(
        table[function_of_state, np.arange(len(function_of_state))]
    )
