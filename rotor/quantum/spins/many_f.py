"""Blocks of many F whose functions differ in F alone, in one array: an operator between them is written for all F at once.

Blocks of different F that hold the same kinds of solved blocks of the rotation, at the same N - F and with the same coupling patterns,
make a group. A function of a group has a column (a kind of block and a pattern, the same number for all F) and a state of that
block: function = column · states + state. What a block lacks, since its N is low or its states are fewer, are zeros. Elements of
the rotation stand in tables by N, coefficients of coupling in tables by F.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints, Workspace
from rotor.quantum.spins.contraction import Contracted, Stack
from rotor.quantum.spins.parts import SpinPart

MOST = 160  # functions of a block up to which many F are done at once: of larger ones each has arithmetic enough for itself
Tables = dict[tuple[int, int, int], Floats]
"""Elements (N, states', states) by the kinds of both blocks and N' - N, by the N of the second from the lowest on."""

NPattern = tuple[int, int]
"""2(N - F) and the class of coupling patterns."""
Layout = tuple[tuple[NPattern, int], ...]
"""How the columns of a block follow one another: 2(N - F), class of patterns and kind of the rotation's blocks of each."""


class RotationColumns(NamedTuple):
    """Columns of a group that belong to one kind of block of the rotation at one N: 2(N - F), the kind, patterns among those of the
    calculation, columns."""

    rise: int
    kind: int
    patterns: slice
    columns: slice


@dataclass(frozen=True, eq=False)
class Group:
    """Blocks of rising F, doubled; functions: of every block where its functions stand, in the order of its parts.

    states: the largest number of states of a block of the rotation; heights: that of each block. places: of a doubled F among the blocks.
    """

    rotations: tuple[RotationColumns, ...]
    twice_f: list[int]
    states: int
    heights: list[int]
    functions: list[Ints]
    places: dict[int, int] = field(repr=False)

    @property
    def columns(self) -> int:
        """Number of columns."""
        return int(self.rotations[-1].columns.stop)


@dataclass(frozen=True, eq=False)
class Frame:
    """What all groups of a calculation share: the doubled F, the lowest N, kinds and sizes of blocks of the rotation by number, their
    energies (N, states) by kind, for each F the numbers of its patterns among those of the highest F, counted by their distances
    from F, and 2(N - F) with the class of each of these."""

    twice_f: list[int]
    lowest: int
    kinds: list[int]
    sizes: list[int]
    energies_mhz: dict[int, Floats]
    patterns: dict[int, list[int]]
    n_patterns: list[NPattern]

    @property
    def count_of_n(self) -> int:
        """N in the tables by N."""
        return len(next(iter(self.energies_mhz.values())))

    def of_f(self, twice_f: Sequence[int]) -> slice | list[int]:
        """The places of some rising F in tables by F."""
        return _places((twice_f[0] - self.twice_f[0]) // 2, twice_f, len(self.twice_f))

    def of_n(self, twice_f: Sequence[int], rotation: RotationColumns) -> slice | list[int]:
        """The places in tables by N of the N that some columns have at some rising F; any where that is beyond the table."""
        count = len(self.energies_mhz[rotation.kind])
        return _places((twice_f[0] + rotation.rise) // 2 - self.lowest, twice_f, count)


def _places(first: int, twice_f: Sequence[int], count: int) -> slice | list[int]:
    """Places that rise with F from the first on, among so many: a slice where all are there and no F is left out."""
    if first >= 0 and first + len(twice_f) <= count and twice_f[-1] - twice_f[0] == 2 * (len(twice_f) - 1):
        return slice(first, first + len(twice_f))
    return [min(max(first + (f - twice_f[0]) // 2, 0), count - 1) for f in twice_f]


def frame_of(stacks: Sequence[Stack], places: dict[int, Ints], every: Ints) -> Frame:
    """The frame of all F, rising without gaps, with all solved blocks of the rotation; places, every: see
    `pattern_tables.PatternTable`."""
    lowest, highest = min(int(stack.n[0]) for stack in stacks), max(int(stack.n[-1]) for stack in stacks)
    count = sum(len(stack.numbers) for stack in stacks)
    kinds, sizes = [0] * count, [0] * count
    energies: dict[int, Floats] = {}
    largest: dict[int, int] = {}
    for stack in stacks:
        largest[stack.kind] = max(largest.get(stack.kind, 0), *stack.sizes)
    for stack in stacks:
        of_kind = energies.setdefault(stack.kind, np.zeros((highest - lowest + 1, largest[stack.kind])))
        for number, block in zip(stack.numbers.tolist(), stack.blocks, strict=True):
            kinds[number], sizes[number] = stack.kind, len(block.energies_mhz)
            of_kind[block.n - lowest, : sizes[number]] = block.energies_mhz
    patterns = {f: own.tolist() for f, own in places.items()}
    n_patterns = [(rise, of) for rise, of in every[:, [0, -1]].tolist()]
    return Frame(list(places), lowest, kinds, sizes, energies, patterns, n_patterns)


def tables_of(found: Sequence[Contracted], frame: Frame) -> Tables:
    """Elements between blocks of the rotation as tables by N; of a pair that occurs twice the last counts."""
    out: Tables = {}
    for up, low, pairs, matrices in found:
        key = (up.kind, low.kind, pairs.rise)
        if key not in out:
            count, right = frame.energies_mhz[low.kind].shape
            out[key] = np.zeros((count, frame.energies_mhz[up.kind].shape[1], right))
        out[key][pairs.n[:, 0] - frame.lowest, : matrices.shape[1], : matrices.shape[2]] = matrices
    return out


def groups_of(members: Sequence[tuple[int, Sequence[SpinPart]]], frame: Frame) -> list[tuple[Group, list[int]]]:
    """Blocks, given by their doubled F and parts, in groups, each with the numbers of its blocks."""
    layouts = [_layout(frame.patterns[f], parts, frame) for f, parts in members]
    found: list[tuple[Layout, dict[int, int]]] = []
    for number in sorted(range(len(members)), key=lambda number: -members[number][0]):
        f, layout = members[number][0], layouts[number]
        for known, by_f in found:
            if f not in by_f and (layout == known or set(layout) <= set(known)):
                by_f[f] = number
                break
        else:
            found.append((layout, {f: number}))
    return [
        (
            _group(layout, [(f, members[by_f[f]][1], layouts[by_f[f]]) for f in sorted(by_f)], frame),
            [by_f[f] for f in sorted(by_f)],
        )
        for layout, by_f in found
    ]


def _group(layout: Layout, members: Sequence[tuple[int, Sequence[SpinPart], Layout]], frame: Frame) -> Group:
    """The group of a layout; members: doubled F, rising, parts and layouts of its blocks."""
    rotations, start = list[RotationColumns](), 0
    for n_pattern, kind in layout:
        first, count = frame.n_patterns.index(n_pattern), frame.n_patterns.count(n_pattern)
        rotations.append(RotationColumns(n_pattern[0], kind, slice(first, first + count), slice(start, start + count)))
        start += count
    counts = [rotation.columns.stop - rotation.columns.start for rotation in rotations]
    columns, orders = np.zeros((len(members), start), dtype=np.int64), list[Any]()
    for place, (f, parts, own_layout) in enumerate(members):
        own, sizes = frame.patterns[f], [frame.sizes[part.number] for part in parts]
        if len(own) == len(frame.n_patterns) and own_layout == layout:
            columns[place] = np.repeat(sizes, counts)
            orders.append(slice(None))
            continue
        order = list[int]()
        for part, size, of_columns in zip(parts, sizes, own_layout, strict=True):
            rotation = rotations[layout.index(of_columns)]
            at = [pattern + rotation.columns.start - rotation.patterns.start for pattern in own[part.patterns]]
            columns[place, at] = size
            order += at
        orders.append(order)
    states, twice_f = int(columns.max()), [f for f, _, _ in members]
    every = np.arange(start * states).reshape(start, states)
    there = np.arange(states) < columns[:, :, None]
    functions = [every[order][there[place, order]] for place, order in enumerate(orders)]
    places = {f: place for place, f in enumerate(twice_f)}
    return Group(tuple(rotations), twice_f, states, columns.max(axis=1).tolist(), functions, places)


def _layout(own: Sequence[int], parts: Sequence[SpinPart], frame: Frame) -> Layout:
    """The layout of one block."""
    return tuple((frame.n_patterns[own[part.patterns.start]], frame.kinds[part.number]) for part in parts)


def are_connected(of_both: tuple[Group, Group], step: int, tables: Tables) -> bool:
    """Whether there are elements between two groups whose F differ by `step`, doubled."""
    up, low = of_both
    return any((a.kind, b.kind, (step + a.rise - b.rise) // 2) in tables for a in up.rotations for b in low.rotations)


def between(
    up: Group, low: Group, twice_f: Sequence[int], step: int, tables: Tables, coefficients: Floats, frame: Frame,
    space: Workspace,
) -> Floats:  # fmt: skip
    """c(F) ⟨r'‖X‖r⟩ between two groups, with F' = F + step.

    Parameters
    ----------
    up, low : Group
        Of F' and F.
    twice_f : sequence of int
        Doubled F, rising.
    step : int
        F' - F, doubled.
    tables : Tables
        Elements of the rotation.
    coefficients : (F, patterns', patterns) array
        By all F of the frame.
    frame : Frame
        Of both groups.
    space : Workspace
        The array stands in it until the next one.

    Returns
    -------
    (F, columns', states', columns, states) array
    """
    out = space.array("elements", len(twice_f), up.columns, up.states, low.columns, low.states)
    out.fill(0.0)
    own = coefficients[frame.of_f(twice_f)]
    for right in low.rotations:
        places = frame.of_n(twice_f, right)
        for left in up.rotations:
            table = tables.get((left.kind, right.kind, (step + left.rise - right.rise) // 2))
            if table is not None:
                element = table[places, : up.states, : low.states]
                _, rows, columns = element.shape
                np.multiply(
                    element[:, None, :, None, :],
                    own[:, left.patterns, None, right.patterns, None],
                    out=out[:, left.columns, :rows, right.columns, :columns],
                )
    return out


def functions_of(elements: Floats) -> Floats:
    """Elements (F, columns', states', columns, states) as (F, functions', functions)."""
    count, columns_up, states_up, columns, states = elements.shape
    return elements.reshape(count, columns_up * states_up, columns * states)
