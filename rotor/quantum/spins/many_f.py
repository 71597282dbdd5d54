"""Blocks of many F whose functions differ only in F, in one array: matrices of operators are computed for all F at once.

Blocks of different F that contain the same kinds of rotational blocks, at the same N - F and with the same coupling patterns, form a group.
A function of a group has a column (a kind of block and a pattern, with the same number for all F) and a state of that block:
function = column · states + state. Where a block has fewer states, or its N is too low, elements are zero. Elements of the rotation are
tables by N, coupling coefficients are tables by F.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints, Workspace
from rotor.quantum.spins.contraction import Contracted, Stack
from rotor.quantum.spins.parts import SpinPart

MOST = 160  # blocks with more functions are solved one by one: their arithmetic outweighs the cost of a call
Tables = dict[tuple[int, int, int], Floats]
"""Elements (N, states', states) by the kinds of both blocks and N' - N; N of the second block counts from the lowest."""

NPattern = tuple[int, int]
"""2(N - F) and the class of coupling patterns."""
Layout = tuple[tuple[NPattern, int], ...]
"""Order of the columns of a block: 2(N - F), class of patterns and kind of the rotational block of each."""


class RotationColumns(NamedTuple):
    """Columns of a group for one kind of rotational block at one N.

    rise: 2(N - F). patterns: their places among the patterns of the calculation. columns: places in the group.
    """

    rise: int
    kind: int
    patterns: slice
    columns: slice


@dataclass(frozen=True, eq=False)
class Group:
    """Blocks of rising F that share arrays.

    functions: places of the functions of each block, in the order of its parts. states: the largest number of states of a rotational
    block; heights: this number for each block. places: index of the block by doubled F.
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
    """Data of all groups of a calculation.

    twice_f: doubled F. lowest: lowest N. kinds, sizes: of rotational blocks by number. energies_mhz: (N, states) by kind. patterns: by F,
    numbers of its patterns in `pattern_tables.PatternTable`. n_patterns: 2(N - F) and class of each pattern.
    """

    twice_f: list[int]
    lowest: int
    kinds: list[int]
    sizes: list[int]
    energies_mhz: dict[int, Floats]
    patterns: dict[int, list[int]]
    n_patterns: list[NPattern]

    @property
    def count_of_n(self) -> int:
        """Number of N in the tables by N."""
        return len(next(iter(self.energies_mhz.values())))

    def rows_of_f(self, twice_f: Sequence[int]) -> slice | list[int]:
        """Places of rising F in tables by F."""
        return _places((twice_f[0] - self.twice_f[0]) // 2, twice_f, len(self.twice_f))

    def rows_of_n(self, twice_f: Sequence[int], rotation: RotationColumns) -> slice | list[int]:
        """Places in tables by N of the N that columns have at rising F; arbitrary where N is beyond the table."""
        count = len(self.energies_mhz[rotation.kind])
        return _places((twice_f[0] + rotation.rise) // 2 - self.lowest, twice_f, count)


def _places(first: int, twice_f: Sequence[int], count: int) -> slice | list[int]:
    """Places of rising F in a table of `count` rows, beginning at `first`: a slice if no F is missing."""
    if first >= 0 and first + len(twice_f) <= count and twice_f[-1] - twice_f[0] == 2 * (len(twice_f) - 1):
        return slice(first, first + len(twice_f))
    return [min(max(first + (f - twice_f[0]) // 2, 0), count - 1) for f in twice_f]


def frame_of(stacks: Sequence[Stack], places: dict[int, Ints], distances: Ints) -> Frame:
    """The frame of all F, rising without gaps, and all rotational blocks; places, distances: see `pattern_tables.PatternTable`."""
    lowest, highest = min(int(stack.n[0]) for stack in stacks), max(int(stack.n[-1]) for stack in stacks)
    count = sum(len(stack.numbers) for stack in stacks)
    kinds, sizes = [0] * count, [0] * count
    energies: dict[int, Floats] = {}
    largest: dict[int, int] = {}
    for stack in stacks:
        largest[stack.kind] = max(largest.get(stack.kind, 0), *stack.sizes)
    for stack in stacks:
        energies_of_kind = energies.setdefault(stack.kind, np.zeros((highest - lowest + 1, largest[stack.kind])))
        for number, block in zip(stack.numbers.tolist(), stack.blocks, strict=True):
            kinds[number], sizes[number] = stack.kind, len(block.energies_mhz)
            energies_of_kind[block.j - lowest, : sizes[number]] = block.energies_mhz
    patterns = {f: numbers.tolist() for f, numbers in places.items()}
    n_patterns = [(rise, symmetry_class) for rise, symmetry_class in distances[:, [0, -1]].tolist()]
    return Frame(list(places), lowest, kinds, sizes, energies, patterns, n_patterns)


def tables_of(contracted: Sequence[Contracted], frame: Frame) -> Tables:
    """Elements between rotational blocks as tables by N; where a pair occurs twice the last entry counts."""
    out: Tables = {}
    for up, low, pairs, matrices in contracted:
        key = (up.kind, low.kind, pairs.rise)
        if key not in out:
            count, right = frame.energies_mhz[low.kind].shape
            out[key] = np.zeros((count, frame.energies_mhz[up.kind].shape[1], right))
        out[key][pairs.n[:, 0] - frame.lowest, : matrices.shape[1], : matrices.shape[2]] = matrices
    return out


def groups_of(members: Sequence[tuple[int, Sequence[SpinPart]]], frame: Frame) -> list[tuple[Group, list[int]]]:
    """Group blocks (doubled F and parts); each group comes with the numbers of its blocks."""
    layouts = [_layout(frame.patterns[f], parts, frame) for f, parts in members]
    layouts_and_members: list[tuple[Layout, dict[int, int]]] = []
    for number in sorted(range(len(members)), key=lambda number: -members[number][0]):
        f, layout = members[number][0], layouts[number]
        for group_layout, by_f in layouts_and_members:
            if f not in by_f and (layout == group_layout or set(layout) <= set(group_layout)):
                by_f[f] = number
                break
        else:
            layouts_and_members.append((layout, {f: number}))
    return [
        (
            _group(layout, [(f, members[by_f[f]][1], layouts[by_f[f]]) for f in sorted(by_f)], frame),
            [by_f[f] for f in sorted(by_f)],
        )
        for layout, by_f in layouts_and_members
    ]


def _group(layout: Layout, members: Sequence[tuple[int, Sequence[SpinPart], Layout]], frame: Frame) -> Group:
    """The group with a layout; members: doubled F (rising), parts and layout of each block."""
    rotations, start = list[RotationColumns](), 0
    for n_pattern, kind in layout:
        first, count = frame.n_patterns.index(n_pattern), frame.n_patterns.count(n_pattern)
        rotations.append(RotationColumns(n_pattern[0], kind, slice(first, first + count), slice(start, start + count)))
        start += count
    counts = [rotation.columns.stop - rotation.columns.start for rotation in rotations]
    columns, orders = np.zeros((len(members), start), dtype=np.int64), list[Any]()
    for place, (f, parts, block_layout) in enumerate(members):
        numbers, sizes = frame.patterns[f], [frame.sizes[part.number] for part in parts]
        if len(numbers) == len(frame.n_patterns) and block_layout == layout:
            columns[place] = np.repeat(sizes, counts)
            orders.append(slice(None))
            continue
        order = list[int]()
        for part, size, n_pattern_and_kind in zip(parts, sizes, block_layout, strict=True):
            rotation = rotations[layout.index(n_pattern_and_kind)]
            at = [pattern + rotation.columns.start - rotation.patterns.start for pattern in numbers[part.patterns]]
            columns[place, at] = size
            order += at
        orders.append(order)
    states, twice_f = int(columns.max()), [f for f, _, _ in members]
    function_numbers = np.arange(start * states).reshape(start, states)
    exists = np.arange(states) < columns[:, :, None]
    functions = [function_numbers[order][exists[place, order]] for place, order in enumerate(orders)]
    places = {f: place for place, f in enumerate(twice_f)}
    return Group(tuple(rotations), twice_f, states, columns.max(axis=1).tolist(), functions, places)


def _layout(numbers: Sequence[int], parts: Sequence[SpinPart], frame: Frame) -> Layout:
    """The layout of a block from the numbers of its patterns."""
    return tuple((frame.n_patterns[numbers[part.patterns.start]], frame.kinds[part.number]) for part in parts)


def are_connected(groups: tuple[Group, Group], step: int, tables: Tables) -> bool:
    """Whether there are elements between two groups whose doubled F differ by `step`."""
    up, low = groups
    return any((a.kind, b.kind, (step + a.rise - b.rise) // 2) in tables for a in up.rotations for b in low.rotations)


def between(
    up: Group, low: Group, twice_f: Sequence[int], step: int, tables: Tables, coefficients: Floats, frame: Frame,
    space: Workspace,
) -> Floats:  # fmt: skip
    """c(F) ⟨r'‖X‖r⟩ between two groups with F' = F + step (doubled), (F, columns', states', columns, states), in memory of `space`.

    tables: elements of the rotation. coefficients: (F, patterns', patterns) for all F of the frame.
    """
    out = space.array("elements", len(twice_f), up.columns, up.states, low.columns, low.states)
    out.fill(0.0)
    coefficients_of_f = coefficients[frame.rows_of_f(twice_f)]
    for right in low.rotations:
        places = frame.rows_of_n(twice_f, right)
        for left in up.rotations:
            table = tables.get((left.kind, right.kind, (step + left.rise - right.rise) // 2))
            if table is not None:
                element = table[places, : up.states, : low.states]
                _, rows, columns = element.shape
                np.multiply(
                    element[:, None, :, None, :],
                    coefficients_of_f[:, left.patterns, None, right.patterns, None],
                    out=out[:, left.columns, :rows, right.columns, :columns],
                )
    return out


def functions_of(elements: Floats) -> Floats:
    """Elements (F, columns', states', columns, states) as (F, functions', functions)."""
    count, columns_up, states_up, columns, states = elements.shape
    return elements.reshape(count, columns_up * states_up, columns * states)
