"""Levels of axial tops with spins, and their derivatives: all blocks of one size in one array (see `axial`)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import accumulate
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints, whole_of_lower
from rotor.quantum.basis.state_elements import StateTerms
from rotor.quantum.spins.axial import operators_of_axial_stacks, powers_of_axial
from rotor.quantum.spins.blocks import Member, Plan, SpinBlock, States, diagonalised
from rotor.quantum.spins.contraction import Contracted
from rotor.quantum.spins.parts import SpinPart
from rotor.quantum.spins.pattern_tables import PatternTable, couplings_by_f, pattern_table
from rotor.quantum.spins.rotor import Channel, parameter_channels
from rotor.quantum.spins.scheme import Scheme
from rotor.quantum.wang.basis import Part

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top

_REACH = 2  # largest difference of N that the operators of a Hamiltonian connect


class Functions(NamedTuple):
    """Functions of blocks of one size: index of each block's F, (blocks,), and numbers of solved blocks and of patterns, (blocks, size)."""

    f: Ints
    numbers: Ints
    patterns: Ints


def by_size(
    members: Sequence[tuple[int, Sequence[SpinPart]]], places: dict[int, Ints]
) -> Iterator[tuple[list[int], Functions]]:
    """Group blocks (doubled F, parts) by their number of functions: numbers of the blocks, and their functions."""
    offsets = dict(zip(places, accumulate(map(len, places.values()), initial=0), strict=False))
    pattern_numbers, first = np.concatenate(list(places.values())), min(places)
    number, start, repeats = np.array(
        [(part.number, offsets[f] + part.patterns.start, part.repeats) for f, parts in members for part in parts]
    ).T
    part = np.repeat(np.arange(len(number)), repeats)  # part of each function
    row = np.arange(len(part)) - np.repeat(np.cumsum(repeats) - repeats, repeats)
    numbers, patterns = number[part], pattern_numbers[start[part] + row]
    sizes = np.array([parts[-1].place.stop for _, parts in members])
    begins, f_index = np.cumsum(sizes) - sizes, (np.array([f for f, _ in members]) - first) // 2
    for size in dict.fromkeys(sizes.tolist()):
        which = np.flatnonzero(sizes == size)
        at = begins[which, None] + np.arange(size)
        yield which.tolist(), Functions(f_index[which], numbers[at], patterns[at])


class AxialTables:
    """Matrices of sums of channels over the functions of blocks: closed forms by pairs of solved blocks, coefficients by F."""

    def __init__(self, functions: Sequence[Part], scheme: Scheme, twice_f: tuple[int, int]) -> None:
        self._n = np.array([part.basis.j for part in functions])
        self._v = np.array([part.v for part in functions])
        self._scheme, self._range = scheme, twice_f

    def matrices(self, contracted: Sequence[Contracted], channels: Sequence[Channel], functions: Functions) -> Floats:
        """Σ_channels c(p', p) X(r', r), the lower triangles (blocks, size, size)."""
        table = np.zeros((int(self._v.max()) + 1, _REACH + 1, len(self._n)))
        for up, low, pairs, values in contracted:
            table[up.sections[0].v, pairs.rise, low.numbers[pairs.low]] = values[:, 0, 0]
        bra, ket = functions.numbers[:, :, None], functions.numbers[:, None, :]
        rise = self._n[bra] - self._n[ket]
        elements = np.where((rise >= 0) & (rise <= _REACH), table[self._v[bra], np.clip(rise, 0, _REACH), ket], 0.0)
        coefficients = sum(couplings_by_f(self._scheme, channel, *self._range) for channel in channels)
        by_function = np.asarray(coefficients)[
            functions.f[:, None, None], functions.patterns[:, :, None], functions.patterns[:, None, :]
        ]
        return np.tril(by_function * elements)


def axial_states(plan: Plan, members: Sequence[Member], table: PatternTable) -> Iterator[States]:
    """The states of blocks of |N K⟩ times patterns."""
    bounds = min(table.patterns), max(table.patterns)
    tables = AxialTables([block.parts[0] for block in plan.blocks], plan.shared.scheme, bounds)
    rotation = np.array([block.energies_mhz[0] for block in plan.blocks])
    for which, functions in by_size([member[:2] for member in members], table.places):
        diagonal = rotation[functions.numbers]
        zeros = diagonal[
            :, 0
        ]  # subtracted from the matrices, so that round-off is relative to splittings instead of energies
        matrices = (diagonal - zeros[:, None])[:, :, None] * np.eye(diagonal.shape[1])
        for contracted, channels in plan.contracted:
            matrices += tables.matrices(contracted, channels, functions)
        yield diagonalised(which, matrices, zeros)


def axial_derivatives(
    top: Top, effects: Sequence[QuantumEffect], names: Sequence[str], blocks: Sequence[SpinBlock], count: int
) -> Floats:
    """∂E/∂c (count, parameters) of the states of spin blocks, by rows of the levels."""
    shared, out = blocks[0].shared, np.zeros((count + 1, len(names)))  # the last row takes the padding
    twice_f = [block.twice_f for block in blocks]
    places = pattern_table(shared.scheme, min(twice_f), max(twice_f)).places
    stacks = shared.stacks
    by_number = {
        number: block for stack in stacks for number, block in zip(stack.numbers.tolist(), stack.blocks, strict=True)
    }
    rotors = [by_number[number] for number in range(len(by_number))]
    along = powers_of_axial(StateTerms.of(top, effects, names, shared.representation), len(names), rotors)
    tables = AxialTables([rotor.parts[0] for rotor in rotors], shared.scheme, (min(places), max(places)))
    channels = parameter_channels(top, effects, names, shared.scheme)
    acting = [(column, channel) for column, by_channel in enumerate(channels) for channel in by_channel]
    pieces = [channels[column][channel] for column, channel in acting]
    spins = operators_of_axial_stacks(stacks, _REACH, pieces, shared.representation)
    for which, functions in by_size([(block.twice_f, block.parts) for block in blocks], places):
        vectors = np.zeros((len(which), *2 * functions.numbers.shape[1:]))
        rows = np.full(functions.numbers.shape, count)
        for place, block in enumerate(
            blocks[i] for i in which
        ):  # some states only, where labels beyond a range of N are left out
            states = len(block.energies_mhz)
            vectors[place, :, :states] = block.vectors
            rows[place, :states] = block.start + np.arange(states)
        slopes = np.matmul((vectors**2).transpose(0, 2, 1), along[functions.numbers])
        for (column, channel), contracted in zip(acting, spins, strict=True):
            whole = whole_of_lower(tables.matrices(contracted, [channel], functions))
            slopes[:, :, column] += (np.matmul(whole, vectors) * vectors).sum(axis=1)
        out[rows] = slopes
    return out[:-1]
