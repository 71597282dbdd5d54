"""Matrices ∂H/∂c of each parameter over rotational functions times coupling patterns, of which H is a linear combination,

    ∂H/∂c = Σ_channels c(p', p) ⟨r'|X_c|r⟩.

Elements of the rotation alone come from `basis.state_elements`, all others from `contraction` with basis functions in place of eigenstates.
Both are computed once for all F. Fits use these matrices, for large blocks too (`estimates.contracted`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.basis.state_elements import StateTerms, blocks_of_terms
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.levels import SolvedBlock
from rotor.quantum.linear_stacks import LinearBlock, WeightedElements, linear_block
from rotor.quantum.spins.axial import are_axial, contracted_operators, powers_of_axial
from rotor.quantum.spins.blocks import Shared, SpinBlock
from rotor.quantum.spins.contraction import Contracted, stacks_of
from rotor.quantum.spins.pattern_tables import couplings_of
from rotor.quantum.spins.rotor import Channel, Channels, parameter_channels

if TYPE_CHECKING:
    from rotor.tops.top import Top

_REACH = 2  # largest difference of N that the operators of a Hamiltonian connect


class Unit(NamedTuple):
    """Unit matrices of several parameters between two rotational blocks, as sparse elements.

    factors: (elements, parameters). parameters: their numbers. size: rows and columns.
    """

    rows: Ints
    columns: Ints
    factors: Floats
    parameters: Ints
    size: tuple[int, int]

    def matrix(self, values_mhz: Floats) -> Floats:
        """Σ value · unit matrix."""
        out = np.zeros(self.size)
        out[self.rows, self.columns] = self.factors @ values_mhz[self.parameters]
        return out


class Units(NamedTuple):
    """Unit matrices over rotational functions: the rotation alone by block, the couplings by pair of blocks (i ≥ k) and channel."""

    rotations: dict[int, Unit]
    couplings: dict[tuple[int, int], dict[Channel, Unit]]


def unit_matrices(
    top: Top, effects: Sequence[QuantumEffect], names: Sequence[str], shared: Shared, rotors: Mapping[int, SolvedBlock]
) -> Units:
    """∂H/∂c of parameters over the functions of rotational blocks, by their numbers."""
    numbers = sorted(rotors)
    blocks = [replace(rotors[i], vectors=np.eye(len(rotors[i].energies_mhz))) for i in numbers]
    terms = StateTerms.from_effects(top, effects, names, shared.representation)
    rotations = dict(zip(numbers, _rotations(terms, len(names), blocks, shared.representation), strict=True))
    couplings: dict[tuple[int, int], dict[Channel, Unit]] = {}
    for channel, columns, contracted in _by_channel(
        parameter_channels(top, effects, names, shared.scheme), blocks, shared
    ):
        for pair, unit in _by_pairs(columns, contracted):
            couplings.setdefault((numbers[pair[0]], numbers[pair[1]]), {})[channel] = unit
    return Units(rotations, couplings)


def _rotations(terms: StateTerms, count: int, blocks: Sequence[SolvedBlock], representation: str) -> list[Unit]:
    """Unit matrices of the rotation alone for each block, with both triangles."""
    if are_axial(blocks):
        first, parameters = np.zeros(1, dtype=np.int64), np.arange(count)
        return [Unit(first, first, row[None], parameters, (1, 1)) for row in powers_of_axial(terms, count, blocks)]
    return [_mirrored(block) for block in blocks_of_terms(terms, count, representation, blocks)]


def _mirrored(block: LinearBlock) -> Unit:
    """Unit matrices of a linear block with both triangles."""
    off = np.flatnonzero(block.rows != block.columns)
    rows, columns = np.append(block.rows, block.columns[off]), np.append(block.columns, block.rows[off])
    factors = block.factors @ block.mix
    return Unit(rows, columns, np.concatenate([factors, factors[off]]), block.parameters, (block.size, block.size))


def _by_channel(
    channels: Sequence[Channels], blocks: Sequence[SolvedBlock], shared: Shared
) -> Iterator[tuple[Channel, list[int], list[list[Contracted]]]]:
    """Each channel with the parameters that act in it and their elements between the functions of all blocks."""
    stacks = stacks_of(blocks)
    for channel in dict.fromkeys(channel for by_channel in channels for channel in by_channel):
        columns = [column for column, by_channel in enumerate(channels) if channel in by_channel]
        pieces = [channels[column][channel] for column in columns]
        yield channel, columns, contracted_operators(stacks, min(_REACH, channel.rank), pieces, shared.representation)


def _by_pairs(
    columns: Sequence[int], by_parameter: Sequence[Sequence[Contracted]]
) -> Iterator[tuple[tuple[int, int], Unit]]:
    """Unit matrices of one channel by pairs of blocks; columns: the parameter of each list of elements."""
    alike: dict[tuple[int, int, int], list[tuple[int, Contracted]]] = {}
    for column, contracted in zip(columns, by_parameter, strict=True):
        for entry in contracted:
            alike.setdefault((int(entry.up.numbers[0]), int(entry.low.numbers[0]), entry.pairs.rise), []).append(
                (column, entry)
            )
    for members in alike.values():
        (_, first), parameters = members[0], np.array([column for column, _ in members])
        table = np.stack([entry.matrices for _, entry in members], axis=3)  # (pairs, functions', functions, parameters)
        nonzero = np.asarray(table.any(axis=3))
        for place in np.flatnonzero(nonzero.any(axis=(1, 2))).tolist():
            a, b = int(first.pairs.up[place]), int(first.pairs.low[place])
            rows, places = np.nonzero(nonzero[place])
            size = first.up.sizes[a], first.low.sizes[b]
            yield (
                (int(first.up.numbers[a]), int(first.low.numbers[b])),
                Unit(rows, places, table[place, rows, places], parameters, size),
            )


def linear_blocks_of_spins(
    top: Top, effects: Sequence[QuantumEffect], names: Sequence[str], blocks: Sequence[SpinBlock]
) -> list[LinearBlock]:
    """Linear blocks of the solved blocks of one calculation, over basis functions or the functions that exchange allows."""
    shared = blocks[0].shared
    units = unit_matrices(
        top, effects, names, shared, {part.number: part.rotor for block in blocks for part in block.parts}
    )
    channels = dict.fromkeys(channel for by_channel in units.couplings.values() for channel in by_channel)
    tables = {block.twice_f: block.patterns for block in blocks}
    coefficients = {channel: couplings_of(shared.scheme, channel, tables) for channel in channels}
    out = []
    for block in blocks:
        linear = linear_block(block.parts[-1].place.stop, list(_pieces(block, units, coefficients)))
        out.append(linear.turned(block.allowed.products.T) if block.allowed else linear)
    return out


def _pieces(
    block: SpinBlock, units: Units, coefficients_by_f: Mapping[Channel, Mapping[int, Floats]]
) -> Iterator[WeightedElements]:
    """Elements of the lower triangle of a block, part by part and channel by channel."""
    size = block.parts[-1].place.stop
    for a, up in enumerate(block.parts):
        yield _product(np.eye(up.repeats), units.rotations[up.number], (up.place.start, up.place.start), size)
        for low in block.parts[: a + 1]:
            for channel, unit in units.couplings.get((up.number, low.number), {}).items():
                coefficients = coefficients_by_f[channel][block.twice_f][up.patterns, low.patterns]
                yield _product(coefficients, unit, (up.place.start, low.place.start), size)


def _product(coefficients: Floats, unit: Unit, start: tuple[int, int], size: int) -> WeightedElements:
    """Coupling coefficients times unit matrices, at their places in a block of `size` functions."""
    up, low = np.nonzero(coefficients)
    rows = (start[0] + up[:, None] * unit.size[0] + unit.rows).ravel()
    columns = (start[1] + low[:, None] * unit.size[1] + unit.columns).ravel()
    factors = (coefficients[up, low][:, None, None] * unit.factors).reshape(len(rows), unit.factors.shape[1])
    if start[0] == start[1]:
        lower = rows >= columns
        rows, columns, factors = rows[lower], columns[lower], factors[lower]
    return WeightedElements(rows * size + columns, factors, unit.parameters)
