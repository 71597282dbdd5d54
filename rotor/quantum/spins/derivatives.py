"""How levels with spins depend on the constants: ∂E_i/∂c = ⟨i|∂H/∂c|i⟩ (Hellmann and Feynman, see `estimates.derivatives`).

∂H/∂c is a sum over channels of coefficients of coupling times elements of the rotation, c(p', p) ⟨r'|X_c|r⟩. With a state as V_pr,

    ∂E_i/∂c = Σ_r'r X_c(r', r) D_i(r', r),     D_i(r', r) = Σ_p'p V_p'r' c(p', p) V_pr,

so that the density D of a channel is made once for all constants, and all of them are one contraction. Coefficients are made for all F,
elements for all blocks of the rotation at once.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats, Ints, distinct
from rotor.quantum.levels import Levels
from rotor.quantum.spins.blocks import Shared, SpinBlock
from rotor.quantum.spins.contraction import by_numbers, operators_of_stacks
from rotor.quantum.spins.lines import ALONE, ParameterOperator, parameter_operators
from rotor.quantum.spins.operators import AxialState, Scalar
from rotor.quantum.spins.parts import SpinPart
from rotor.quantum.spins.pattern_tables import couplings_by_f, pattern_table
from rotor.quantum.spins.rotor import Channel, Piece, RotorBlock
from rotor.quantum.spins.scheme import Scheme
from rotor.tops.operators import Operators

if TYPE_CHECKING:
    from rotor.tops.top import Top

Pair = tuple[int, int]  # numbers of two blocks of the rotation, the higher first
Elements = dict[Pair, list[tuple[int, Floats]]]  # by pairs: columns of parameters and their elements
_REACH = 2  # largest difference of N that the operators of a Hamiltonian connect


def derivatives(top: Top, levels: Levels, names: Sequence[str], rows: Ints) -> Floats:
    """∂E/∂c (rows, names) of levels with spins, MHz per MHz; ValueError for levels without vectors."""
    if not levels.blocks:
        raise ValueError("these levels have no vectors; solve them with their spins anew")
    shared, out = levels.blocks[0].shared, np.zeros((len(levels), len(names)))
    operators = parameter_operators(top, levels.effects, names, shared)
    every_f = distinct(np.array([block.twice_f for block in levels.blocks]))
    for channel, elements in _elements(operators, levels.blocks, shared):
        coefficients = _coefficients(shared.scheme, channel, int(every_f[0]), int(every_f[-1]))
        stacked = {pair: _stacked(found) for pair, found in elements.items()}
        for block in levels.blocks:
            states = slice(block.start, block.start + len(block.energies_mhz))
            _add(out[states], block, coefficients[block.twice_f], stacked)
    return np.asarray(out[rows])


def _coefficients(scheme: Scheme, channel: Channel, first: int, last: int) -> dict[int, Floats]:
    """c(p', p) of a channel by the doubled F, which levels of many F have made already."""
    table, found = pattern_table(scheme, first, last), couplings_by_f(scheme, channel, first, last)
    return {f: found[(f - min(table.patterns)) // 2][np.ix_(places, places)] for f, places in table.places.items()}


def _stacked(found: Sequence[tuple[int, Floats]]) -> tuple[list[int], Floats]:
    """The columns of parameters and their elements, (parameters, r' r)."""
    return [column for column, _ in found], np.stack([element.reshape(-1) for _, element in found])


def _add(
    out: Floats, block: SpinBlock, coefficients: Floats, elements: Mapping[Pair, tuple[list[int], Floats]]
) -> None:
    """Adds the derivatives (states, names) of one block by one channel."""
    vectors = [block.vectors[part.place].reshape(part.repeats, -1, len(block.energies_mhz)) for part in block.parts]
    for a, up in enumerate(block.parts):
        for b, low in enumerate(block.parts[: a + 1]):
            found = elements.get((up.number, low.number))
            if found is None:
                continue
            between = coefficients[up.patterns, low.patterns]
            if not between.any():
                continue
            columns, matrices = found
            moved = np.tensordot(between, vectors[b], 1)
            # (states, r', p') (states, p', r) -> (states, r' r)
            density = vectors[a].transpose(2, 1, 0) @ moved.transpose(2, 0, 1)
            out[:, columns] += (1.0 if a == b else 2.0) * (density.reshape(len(density), -1) @ matrices.T)


def _elements(
    operators: Sequence[ParameterOperator], blocks: Sequence[SpinBlock], shared: Shared
) -> Iterator[tuple[Channel, Elements]]:
    """The elements of all parameters by channel, one channel at a time."""
    if shared.stacks is None:
        yield from _pair_by_pair(operators, blocks)
        return
    rotors = {part.number: part.rotor for block in blocks for part in block.parts}
    for channel in dict.fromkeys([ALONE, *(channel for operator in operators for channel in operator.channels)]):
        elements: Elements = {}
        for column, operator in enumerate(operators):
            found = _of_stacks(shared, channel, operator)
            if channel == ALONE and operator.powers is None:
                _add_rotation(found, operator, rotors)
            for pair, element in found.items():
                elements.setdefault(pair, []).append((column, element))
        if elements:
            yield channel, elements


def _of_stacks(shared: Shared, channel: Channel, operator: ParameterOperator) -> dict[Pair, Floats]:
    """The elements of one parameter in one channel between all blocks of the rotation."""
    assert shared.stacks is not None
    pieces = list(operator.channels.get(channel, ()))
    if channel == ALONE:
        pieces += [Piece(1.0, Scalar(tuple(powers.items())), v, v, 0, 0) for v, powers in operator.powers or ()]
    if not pieces:
        return {}
    return by_numbers(operators_of_stacks(shared.stacks, min(_REACH, channel.rank), pieces, shared.representation))


def _add_rotation(found: dict[Pair, Floats], operator: ParameterOperator, rotors: Mapping[int, RotorBlock]) -> None:
    """Adds the elements of operators of N that no powers describe."""
    for number, rotor in rotors.items():
        own = operator.rotation(rotor)
        if own is not None:
            pair = (number, number)
            found[pair] = found[pair] + own if pair in found else own


def _pair_by_pair(
    operators: Sequence[ParameterOperator], blocks: Sequence[SpinBlock]
) -> Iterator[tuple[Channel, Elements]]:
    """The same of an axial top, whose blocks are not stacked."""
    parts: dict[Pair, tuple[SpinPart, SpinPart]] = {}
    for block in blocks:
        for a, up in enumerate(block.parts):
            parts |= {(up.number, low.number): (up, low) for low in block.parts[: a + 1]}
    by_channel: dict[Channel, Elements] = {}
    diagonal = [pair for pair in parts if pair[0] == pair[1]]
    for column, operator in enumerate(operators):
        if not operator.channels and operator.powers is not None:
            values = _of_powers(operator.powers, [parts[pair][0].rotor for pair in diagonal])
            if values is not None:
                alone = by_channel.setdefault(ALONE, {})
                for pair, value in zip(diagonal, values, strict=True):
                    alone.setdefault(pair, []).append((column, value))
                continue
        for pair, (up, low) in parts.items():
            if operator.connects(up, low):
                for channel, element in operator.elements(up, low).items():
                    by_channel.setdefault(channel, {}).setdefault(pair, []).append((column, element))
    yield from by_channel.items()


def _of_powers(powers: Sequence[tuple[int, Operators]], rotors: Sequence[RotorBlock]) -> Floats | None:
    """Powers of N over blocks of one axial function each, (blocks, 1, 1); None where a block has others.

    N^2p Nz^2q is (N (N + 1))^p K^2q; those that change K do not act.
    """
    if any(len(rotor.parts) != 1 or not isinstance(rotor.parts[0].basis, AxialState) for rotor in rotors):
        return None
    parts = [rotor.parts[0] for rotor in rotors]
    v, n, k = (
        np.array([float(value) for value in column])
        for column in zip(*((p.v, p.basis.j, p.basis.k[0]) for p in parts), strict=True)
    )
    total = np.zeros(len(parts))
    for state, operators in powers:
        for (p, q, order), factor in operators.items():
            if order == 0:
                total += np.where(v == state, factor * (n * (n + 1)) ** p * k ** (2 * q), 0.0)
    return total[:, None, None]
