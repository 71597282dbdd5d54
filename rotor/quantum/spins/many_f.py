"""Blocks of many F whose functions differ only in F, in one array: matrices of operators are computed for all of them at once.

Blocks of different F (and, in axial tops, K) that contain the same kinds of rotational blocks, at the same N - F and with the same coupling
patterns, form a group. A function of a group has a column (a kind of block and a pattern, with the same number in all blocks) and a state
of that block: function = column · states + state. Where a block has fewer states, or its N is too low, elements are zero. Elements of the
rotation are tables with a row for each N (and K), coupling coefficients are tables by F.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints, runs_of_similar_size
from rotor.frozen import dataclass
from rotor.quantum.spins.contraction import Contracted, Stack
from rotor.quantum.spins.operators import AxialState
from rotor.quantum.spins.parts import SpinPart
from rotor.quantum.spins.pattern_tables import PatternTable

Tables = dict[tuple[int, int, int], Floats]
"""Elements (rows, states', states) by the kinds of both blocks and the distance of their rows; a row is that of the second block."""

NPattern = tuple[int, int]
"""2(N - F) and the class of coupling patterns."""
Layout = tuple[tuple[NPattern, int], ...]
"""Order of the columns of a block: 2(N - F), class of patterns and kind of the rotational block of each."""
Places = slice | Ints

# ratio of sizes of blocks in one array, sizes that all share one, most numbers in it
_LIKE, _SMALL, _MOST = 1.5, 24, 1 << 21
# rows of one K beyond those of the highest N or F, so that no operator of rank 2 reaches those of the next K
_SPARE = 5


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
    """Blocks of rising row (`Frame.twice_row`) that share arrays.

    heights: the largest number of states of a rotational block, for each block. functions: columns and states of the functions of each
    block, in the order of its parts. places: index of the block by its doubled row.
    """

    rotations: tuple[RotationColumns, ...]
    twice_f: Ints
    twice_rows: Ints
    heights: Ints
    functions: list[tuple[Ints, Ints]]
    places: dict[int, int]

    @property
    def columns(self) -> int:
        """Number of columns."""
        return int(self.rotations[-1].columns.stop)

    def runs(self) -> Iterator[slice]:
        """Runs of blocks of similar size, whose matrices share an array."""
        return runs_of_similar_size((self.columns * self.heights).tolist(), _LIKE, _SMALL, _MOST)


@dataclass(frozen=True, eq=False)
class Frame:
    """Data of all groups of a calculation.

    twice_f: doubled F. lowest: lowest N. count: rows of each K, one for each N and some to spare. kinds, rows, k, sizes: of rotational
    blocks by number: their kinds, rows in tables, K of axial functions and numbers of states. energies_mhz: (rows, states) by kind.
    patterns: by F, numbers of its patterns in `pattern_tables.PatternTable`. n_patterns: 2(N - F) and class of each pattern.
    """

    twice_f: list[int]
    lowest: int
    count: int
    kinds: list[int]
    rows: Ints
    k: list[int]
    energies_mhz: dict[int, Floats]
    sizes: list[int]
    patterns: dict[int, list[int]]
    n_patterns: list[NPattern]

    def twice_row(self, twice_f: int, number: int) -> int:
        """2F plus the rows of lower K: half the sum of this and 2(N - F), from the lowest N on, is the row of a rotational block."""
        return twice_f + 2 * self.count * self.k[number]

    @property
    def n_of_rows(self) -> Ints:
        """N of the rows of tables."""
        return self.lowest + np.arange(len(next(iter(self.energies_mhz.values())))) % self.count

    def rows_of_f(self, twice_f: Ints) -> Places:
        """Places of F in tables by F."""
        return consecutive((twice_f - self.twice_f[0]) // 2)

    def rows_of(self, twice_rows: Ints, rotation: RotationColumns) -> Places:
        """Rows of tables that columns have in blocks of these doubled rows; arbitrary where N is beyond the table."""
        last = len(self.energies_mhz[rotation.kind]) - 1
        return consecutive(np.clip((twice_rows + rotation.rise) // 2 - self.lowest, 0, last))


def consecutive(places: Ints) -> Places:
    """The places as a slice if they are consecutive."""
    alike = len(places) == 1 or (places[-1] - places[0] == len(places) - 1 and (np.diff(places) == 1).all())
    return slice(int(places[0]), int(places[-1]) + 1) if alike else places


def frame_of(stacks: Sequence[Stack], table: PatternTable) -> Frame:
    """The frame of all F of a table, rising without gaps, and all rotational blocks."""
    lowest, highest = min(int(stack.n.min()) for stack in stacks), max(int(stack.n.max()) for stack in stacks)
    total, twice_f = sum(len(stack.numbers) for stack in stacks), list(table.places)
    count = max(highest - lowest, (twice_f[-1] - twice_f[0]) // 2) + _SPARE
    kinds, k, sizes = [0] * total, [0] * total, [0] * total
    rows, most = np.zeros(total, dtype=np.int64), dict[int, int]()
    for stack in stacks:
        most[stack.kind] = max(most.get(stack.kind, 0), *stack.sizes)
        for number, block, size in zip(stack.numbers.tolist(), stack.blocks, stack.sizes, strict=True):
            basis = block.parts[0].basis
            k[number] = basis.axial_k if isinstance(basis, AxialState) else 0
            kinds[number], sizes[number], rows[number] = stack.kind, size, block.j - lowest + count * k[number]
    energies = {kind: np.zeros((count * (max(k) + 1), states)) for kind, states in most.items()}
    for stack in stacks:
        for number, block, size in zip(stack.numbers.tolist(), stack.blocks, stack.sizes, strict=True):
            energies[stack.kind][rows[number], :size] = block.energies_mhz
    patterns = {f: numbers.tolist() for f, numbers in table.places.items()}
    n_patterns = [(rise, symmetry_class) for rise, symmetry_class in table.distances[:, [0, -1]].tolist()]
    return Frame(twice_f, lowest, count, kinds, rows, k, energies, sizes, patterns, n_patterns)


def tables_of(contracted: Sequence[Contracted], frame: Frame) -> Tables:
    """Elements between rotational blocks as tables by row; where a pair occurs twice the last entry counts."""
    out: Tables = {}
    for up, low, pairs, matrices in contracted:
        rows = frame.rows[low.numbers[pairs.low]]
        key = (up.kind, low.kind, int(frame.rows[up.numbers[pairs.up[0]]] - rows[0]))
        if key not in out:
            count, right = frame.energies_mhz[low.kind].shape
            out[key] = np.zeros((count, frame.energies_mhz[up.kind].shape[1], right))
        out[key][rows, : matrices.shape[1], : matrices.shape[2]] = matrices
    return out


def groups_of(members: Sequence[tuple[int, Sequence[SpinPart]]], frame: Frame) -> list[tuple[Group, list[int]]]:
    """Group blocks (doubled F and parts); each group comes with the numbers of its blocks."""
    layouts = [_layout(frame.patterns[f], parts, frame) for f, parts in members]
    rows = [frame.twice_row(f, parts[0].number) for f, parts in members]
    columns = {layout: frozenset(layout) for layout in set(layouts)}
    layouts_and_members: list[tuple[Layout, dict[int, int]]] = []
    for number in sorted(range(len(members)), key=lambda number: -members[number][0]):
        row, layout = rows[number], layouts[number]
        for group_layout, by_row in layouts_and_members:
            if row not in by_row and columns[layout] <= columns[group_layout]:
                by_row[row] = number
                break
        else:
            layouts_and_members.append((layout, {row: number}))
    grouped = [(layout, [by_row[row] for row in sorted(by_row)]) for layout, by_row in layouts_and_members]
    return [
        (_group(layout, [(*members[i], rows[i], layouts[i]) for i in numbers], frame), numbers)
        for layout, numbers in grouped
    ]


def _group(layout: Layout, members: Sequence[tuple[int, Sequence[SpinPart], int, Layout]], frame: Frame) -> Group:
    """The group with a layout; members: doubled F, parts, doubled row (rising) and layout of each block."""
    rotations, start = list[RotationColumns](), 0
    for n_pattern, kind in layout:
        first, count = frame.n_patterns.index(n_pattern), frame.n_patterns.count(n_pattern)
        rotations.append(RotationColumns(n_pattern[0], kind, slice(first, first + count), slice(start, start + count)))
        start += count
    place_of = {n_pattern_and_kind: place for place, n_pattern_and_kind in enumerate(layout)}
    functions, heights = list[tuple[Ints, Ints]](), list[int]()
    known: dict[tuple[object, ...], tuple[Ints, Ints]] = {}  # of blocks with the same columns and sizes
    for f, parts, _, block_layout in members:
        numbers, sizes = frame.patterns[f], tuple(frame.sizes[part.number] for part in parts)
        order = list[int]()
        for part, n_pattern_and_kind in zip(parts, block_layout, strict=True):
            rotation = rotations[place_of[n_pattern_and_kind]]
            shift = rotation.columns.start - rotation.patterns.start
            order += [pattern + shift for pattern in numbers[part.patterns]]
        key = (sizes, *order)
        if key not in known:
            states = np.repeat(sizes, [part.repeats for part in parts])
            ends = np.cumsum(states)
            known[key] = np.repeat(order, states), np.arange(ends[-1]) - np.repeat(ends - states, states)
        functions.append(known[key])
        heights.append(max(sizes))
    twice_rows = [row for _, _, row, _ in members]
    places = {row: place for place, row in enumerate(twice_rows)}
    twice_f = np.array([f for f, *_ in members])
    return Group(tuple(rotations), twice_f, np.array(twice_rows), np.array(heights), functions, places)


def _layout(numbers: Sequence[int], parts: Sequence[SpinPart], frame: Frame) -> Layout:
    """The layout of a block from the numbers of its patterns."""
    return tuple((frame.n_patterns[numbers[part.patterns.start]], frame.kinds[part.number]) for part in parts)


def are_connected(up: Group, low: Group, step: int, tables: Tables) -> bool:
    """Whether there are elements between two groups whose doubled rows differ by `step`."""
    return any((a.kind, b.kind, (step + a.rise - b.rise) // 2) in tables for a in up.rotations for b in low.rotations)


def between(
    up: Group, low: Group, chosen: Ints, step: int, tables: Tables, coefficients: Floats, frame: Frame,
    out: Floats,
) -> Floats:  # fmt: skip
    """c(F) ⟨r'‖X‖r⟩ between blocks `chosen` of a group and those of another with doubled row + step, written to `out`.

    tables: elements of the rotation. coefficients: (F, patterns', patterns) for all F of the frame. out: (blocks, columns', states',
    columns, states).
    """
    out.fill(0.0)
    coefficients_of_f = coefficients[frame.rows_of_f(low.twice_f[chosen])]
    twice_rows = low.twice_rows[chosen]
    for right in low.rotations:
        places = frame.rows_of(twice_rows, right)
        for left in up.rotations:
            table = tables.get((left.kind, right.kind, (step + left.rise - right.rise) // 2))
            if table is not None:
                element = table[places, : out.shape[2], : out.shape[4]]
                _, rows, columns = element.shape
                np.multiply(
                    element[:, None, :, None, :],
                    coefficients_of_f[:, left.patterns, None, right.patterns, None],
                    out=out[:, left.columns, :rows, right.columns, :columns],
                )
    return out
