"""Linear blocks of Hamiltonians with spins: ∂H/∂c of every parameter over functions of the rotation times coupling patterns,

    ∂H/∂c = Σ_channels c(p', p) ⟨r'|X_c|r⟩.

Elements of the rotation alone are those of `basis.state_elements`, all others those of `contraction` with the functions of the basis in
place of eigenstates. Both are made once for all F. Fits, in large blocks too (`estimates.contracted`), take their matrices from here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.basis.state_elements import StateTerms, blocks_of_terms
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.linear_stacks import LinearBlock, WeightedElements, linear_block
from rotor.quantum.spins.axial import are_axial, contracted_operators, powers_of_axial
from rotor.quantum.spins.blocks import Shared, SpinBlock, couplings_of
from rotor.quantum.spins.contraction import Contracted, stacks_of
from rotor.quantum.spins.rotor import Channel, Channels, RotorBlock, parameter_channels

if TYPE_CHECKING:
    from rotor.tops.top import Top

_REACH = 2  # largest difference of N that the operators of a Hamiltonian connect


class Unit(NamedTuple):
    """Unit matrices of several parameters over a pair of blocks of the rotation: places of their elements and factors.

    factors : (elements, parameters). parameters : which ones. size : rows and columns
    """

    rows: Ints
    columns: Ints
    factors: Floats
    parameters: Ints
    size: tuple[int, int]

    def matrix(self, values_mhz: Floats) -> Floats:
        """Σ value times unit matrix."""
        out = np.zeros(self.size)
        out[self.rows, self.columns] = self.factors @ values_mhz[self.parameters]
        return out


class Units(NamedTuple):
    """Unit matrices over the functions of the rotation: those of the rotation alone by block, the others by pair (i ≥ k) and channel."""

    rotations: dict[int, Unit]
    couplings: dict[tuple[int, int], dict[Channel, Unit]]


def unit_matrices(
    top: Top, effects: Sequence[QuantumEffect], names: Sequence[str], shared: Shared, rotors: Mapping[int, RotorBlock]
) -> Units:
    """∂H/∂c of parameters over the functions of solved blocks of the rotation, by their numbers."""
    numbers = sorted(rotors)
    blocks = [replace(rotors[i], vectors=np.eye(len(rotors[i].energies_mhz))) for i in numbers]
    terms = StateTerms.of(top, effects, names, shared.representation)
    rotations = dict(zip(numbers, _rotations(terms, len(names), blocks, shared.representation), strict=True))
    couplings: dict[tuple[int, int], dict[Channel, Unit]] = {}
    for channel, columns, found in _by_channel(parameter_channels(top, effects, names, shared.scheme), blocks, shared):
        for pair, unit in _by_pairs(columns, found):
            couplings.setdefault((numbers[pair[0]], numbers[pair[1]]), {})[channel] = unit
    return Units(rotations, couplings)


def _rotations(terms: StateTerms, count: int, blocks: Sequence[RotorBlock], representation: str) -> list[Unit]:
    """The unit matrices of the rotation alone, both triangles, of every block."""
    if are_axial(blocks):
        one, every = np.zeros(1, dtype=np.int64), np.arange(count)
        return [Unit(one, one, row[None], every, (1, 1)) for row in powers_of_axial(terms, count, blocks)]
    return [_mirrored(block) for block in blocks_of_terms(terms, count, representation, blocks)]


def _mirrored(block: LinearBlock) -> Unit:
    """The unit matrices of a linear block with both triangles."""
    off = np.flatnonzero(block.rows != block.columns)
    rows, columns = np.append(block.rows, block.columns[off]), np.append(block.columns, block.rows[off])
    factors = block.factors @ block.mix
    return Unit(rows, columns, np.concatenate([factors, factors[off]]), block.parameters, (block.size, block.size))


def _by_channel(
    channels: Sequence[Channels], blocks: Sequence[RotorBlock], shared: Shared
) -> Iterator[tuple[Channel, list[int], list[list[Contracted]]]]:
    """Each channel with the parameters that act in it and what they have there between the functions of all blocks."""
    stacks = stacks_of(blocks)
    for channel in dict.fromkeys(channel for own in channels for channel in own):
        columns = [column for column, own in enumerate(channels) if channel in own]
        pieces = [channels[column][channel] for column in columns]
        yield channel, columns, contracted_operators(stacks, min(_REACH, channel.rank), pieces, shared.representation)


def _by_pairs(columns: Sequence[int], every: Sequence[Sequence[Contracted]]) -> Iterator[tuple[tuple[int, int], Unit]]:
    """The unit matrices of one channel by pairs of blocks; columns: the parameters of `every`."""
    alike: dict[tuple[int, int, int], list[tuple[int, Contracted]]] = {}
    for column, found in zip(columns, every, strict=True):
        for one in found:
            alike.setdefault((int(one.up.numbers[0]), int(one.low.numbers[0]), one.pairs.rise), []).append(
                (column, one)
            )
    for members in alike.values():
        (_, first), parameters = members[0], np.array([column for column, _ in members])
        table = np.stack([one.matrices for _, one in members], axis=3)  # (pairs, functions', functions, parameters)
        there = np.asarray(table.any(axis=3))
        for place in np.flatnonzero(there.any(axis=(1, 2))).tolist():
            a, b = int(first.pairs.up[place]), int(first.pairs.low[place])
            rows, places = np.nonzero(there[place])
            size = first.up.sizes[a], first.low.sizes[b]
            yield (
                (int(first.up.numbers[a]), int(first.low.numbers[b])),
                Unit(rows, places, table[place, rows, places], parameters, size),
            )


def linear_blocks_of_spins(
    top: Top, effects: Sequence[QuantumEffect], names: Sequence[str], blocks: Sequence[SpinBlock]
) -> list[LinearBlock]:
    """The linear blocks of solved blocks with spins, over the functions of the basis or those that exchange allows.

    Parameters
    ----------
    top : Top
    effects : sequence of QuantumEffect
        What the Hamiltonian consists of.
    names : sequence of str
        Parameters, in the order of their values.
    blocks : sequence of SpinBlock
        Of one calculation.

    Returns
    -------
    list of LinearBlock
        In the order of the blocks.
    """
    shared = blocks[0].shared
    units = unit_matrices(
        top, effects, names, shared, {part.number: part.rotor for block in blocks for part in block.parts}
    )
    channels = dict.fromkeys(channel for own in units.couplings.values() for channel in own)
    tables = {block.twice_f: block.patterns for block in blocks}
    known = {channel: couplings_of(shared.scheme, channel, tables) for channel in channels}
    out = []
    for block in blocks:
        linear = linear_block(block.parts[-1].place.stop, list(_pieces(block, units, known)))
        out.append(linear.turned(block.allowed.products.T) if block.allowed else linear)
    return out


def _pieces(
    block: SpinBlock, units: Units, known: Mapping[Channel, Mapping[int, Floats]]
) -> Iterator[WeightedElements]:
    """The lower triangle of a block, part by part and channel by channel."""
    size = block.parts[-1].place.stop
    for a, up in enumerate(block.parts):
        yield _product(np.eye(up.repeats), units.rotations[up.number], (up.place.start, up.place.start), size)
        for low in block.parts[: a + 1]:
            for channel, unit in units.couplings.get((up.number, low.number), {}).items():
                coefficients = known[channel][block.twice_f][up.patterns, low.patterns]
                yield _product(coefficients, unit, (up.place.start, low.place.start), size)


def _product(coefficients: Floats, unit: Unit, start: tuple[int, int], size: int) -> WeightedElements:
    """Coefficients of coupling times unit matrices, in a block of so many functions."""
    up, low = np.nonzero(coefficients)
    rows = (start[0] + up[:, None] * unit.size[0] + unit.rows).ravel()
    columns = (start[1] + low[:, None] * unit.size[1] + unit.columns).ravel()
    factors = (coefficients[up, low][:, None, None] * unit.factors).reshape(len(rows), unit.factors.shape[1])
    if start[0] == start[1]:
        lower = rows >= columns
        rows, columns, factors = rows[lower], columns[lower], factors[lower]
    return WeightedElements(rows * size + columns, factors, unit.parameters)
