"""Blocks of many F whose functions differ only in F, in one array: matrices of operators are computed for all of them at once.

Blocks of different F (and, in axial tops, K) that contain the same kinds of rotational blocks, at the same N - F and with the same coupling
patterns, form a group. A function of a group has a column (a kind of block and a pattern, with the same number in all blocks) and a state
of that block: function = column · states + state. Where a block has fewer states, or its N is too low, elements are zero. Elements of the
rotation are tables with a row for each N (and K), coupling coefficients are tables by F. The Hamiltonian is

    ⟨r' p'|H|r p⟩ = E_r δ + Σ_channels c(p', p) ⟨r'|X|r⟩.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints, Workspace, runs_of_similar_size
from rotor.frozen import dataclass
from rotor.quantum.spins.contraction import Contracted, Stack
from rotor.quantum.spins.parts import PartColumns
from rotor.quantum.spins.pattern_tables import PatternTable, couplings_by_f
from rotor.quantum.spins.rotor import Channel
from rotor.quantum.spins.scheme import Scheme

Tables = dict[tuple[int, int, int], NDArray[Any]]
"""Elements (rows, states', states) by the kinds of both blocks and the distance of their rows; a row is that of the second block."""

Coefficients = Callable[[Ints], Callable[[slice, slice], Floats]]
"""Coefficients (F, patterns', patterns) of doubled F, then of some patterns."""

NPattern = tuple[int, int]
"""2(N - F) and the class of coupling patterns."""
Layout = tuple[tuple[NPattern, int], ...]
"""Order of the columns of a block: 2(N - F), class of patterns and kind of the rotational block of each."""
Places = slice | Ints

# ratio of sizes of blocks in one array, sizes that all share one, most numbers in it
_LIKE, _SMALL, _MOST = 1.5, 64, 1 << 21
# rows of one K beyond those of the highest N, so that no operator of rank 2 reaches those of the next K
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
    """Blocks of rising doubled row (`Frame`) that share arrays.

    heights: the largest number of states of a rotational block, for each block. shapes: number of its shape; blocks of one shape have the
    same functions. functions: columns and states of the functions of a shape, in the order of the parts. places: index of the block by its
    doubled row.
    """

    rotations: tuple[RotationColumns, ...]
    twice_f: Ints
    twice_rows: Ints
    heights: Ints
    shapes: Ints
    functions: dict[int, tuple[Ints, Ints]]
    places: dict[int, int]

    @property
    def columns(self) -> int:
        """Number of columns."""
        return int(self.rotations[-1].columns.stop)

    def alike(self, places: Ints, kinds: Iterable[Hashable]) -> list[tuple[Ints, Ints, Ints]]:
        """Indices of `places`, blocks of one kind together, with columns and states of their functions, (1 or blocks, functions)."""
        by_kind: dict[Hashable, list[int]] = {}
        for index, kind in enumerate(kinds):
            by_kind.setdefault(kind, []).append(index)
        out, shapes = [], self.shapes[places].tolist()
        for indices in by_kind.values():
            of_blocks = [shapes[index] for index in indices]
            chosen = of_blocks[:1] if len(set(of_blocks)) == 1 else of_blocks
            columns, states = (np.array(pair) for pair in zip(*(self.functions[i] for i in chosen), strict=True))
            out.append((np.array(indices), columns, states))
        return out


@dataclass(frozen=True, eq=False)
class Frame:
    """Data of all groups of a calculation.

    The doubled row of a block is 2F plus twice the rows of lower K: half the sum of this and 2(N - F), from the lowest N on, is the row of
    a rotational block.

    twice_f: doubled F. lowest: lowest N of the tables, below 0 where a pattern of the lowest F needs such an N. count: rows of each K, one
    for each N and some to spare. kinds, rows, k, sizes: of rotational blocks by number: their kinds, rows in tables, K of axial functions
    and numbers of states. energies_mhz: (rows, states) by kind.
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

    @property
    def n_of_rows(self) -> Ints:
        """N of the rows of tables."""
        return self.lowest + np.arange(len(next(iter(self.energies_mhz.values())))) % self.count

    def rows_of_f(self, twice_f: Ints) -> Places:
        """Places of F in tables by F."""
        return consecutive((twice_f - self.twice_f[0]) // 2)

    def rows_of(self, twice_rows: Ints, rotation: RotationColumns) -> Places:
        """Rows of tables that columns have in blocks of these doubled rows, which rise; empty rows where no such N is solved."""
        least, most = ((int(row) + rotation.rise) // 2 - self.lowest for row in (twice_rows[0], twice_rows[-1]))
        if most - least == len(twice_rows) - 1:
            return slice(least, most + 1)
        return (twice_rows + rotation.rise) // 2 - self.lowest


def consecutive(places: Ints) -> Places:
    """The places as a slice if they are consecutive."""
    first, count = int(places[0]), len(places)
    alike = places[-1] - first == count - 1 and places.tolist() == list(range(first, first + count))
    return slice(first, first + count) if alike else places


def frame_of(stacks: Sequence[Stack], table: PatternTable) -> Frame:
    """The frame of all F of a table, rising without gaps, and all rotational blocks."""
    total, twice_f = sum(len(stack.numbers) for stack in stacks), list(table.places)
    rises = table.distances[:, 0].tolist()
    lowest = min((twice_f[0] + min(rises)) // 2, *(int(stack.n.min()) for stack in stacks))
    highest = max((twice_f[-1] + max(rises)) // 2, *(int(stack.n.max()) for stack in stacks))
    count = highest - lowest + _SPARE
    kinds, k, sizes, rows = np.zeros((4, total), dtype=np.int64)
    most = dict[int, int]()
    for stack in stacks:
        most[stack.kind] = max(most.get(stack.kind, 0), *stack.sizes)
        kinds[stack.numbers], sizes[stack.numbers] = stack.kind, stack.sizes
        k[stack.numbers] = 0 if stack.k is None else stack.k
        rows[stack.numbers] = stack.n - lowest + count * k[stack.numbers]
    energies = {kind: np.zeros((count * (int(k.max()) + 1), states)) for kind, states in most.items()}
    for stack in stacks:
        place, state = stack.places
        of_states = np.concatenate([block.energies_mhz for block in stack.blocks])
        energies[stack.kind][rows[stack.numbers][place], state] = of_states
    patterns = {f: numbers.tolist() for f, numbers in table.places.items()}
    n_patterns = [(rise, symmetry_class) for rise, symmetry_class in table.distances[:, [0, -1]].tolist()]
    return Frame(
        twice_f, lowest, count, kinds.tolist(), rows, k.tolist(), energies, sizes.tolist(), patterns, n_patterns
    )


def tables_of(contracted: Sequence[Contracted], frame: Frame) -> Tables:
    """Elements between rotational blocks as tables by row; where a pair occurs twice the last entry counts."""
    out: Tables = {}
    for up, low, pairs, matrices in contracted:
        rows = frame.rows[low.numbers[pairs.low]]
        key = (up.kind, low.kind, int(frame.rows[up.numbers[pairs.up[0]]] - rows[0]))
        if key not in out:
            count, right = frame.energies_mhz[low.kind].shape
            out[key] = np.zeros((count, frame.energies_mhz[up.kind].shape[1], right), dtype=matrices.dtype)
        out[key][rows, : matrices.shape[1], : matrices.shape[2]] = matrices
    return out


Shape = tuple[tuple[NPattern, int, tuple[int, ...], int], ...]
"""Of each part of a block 2(N - F) and class of patterns, kind, patterns and number of states: what blocks that differ in F and K share."""


def groups_of(twice_f: Ints, parts: PartColumns, frame: Frame) -> list[tuple[Group, list[int]]]:
    """Group blocks (doubled F and parts); each group comes with the numbers of its blocks."""
    shapes, shape_of = _shapes(twice_f, parts, frame)
    twice_rows = twice_f + 2 * frame.count * np.array(frame.k, dtype=np.int64)[parts.lowest]
    layouts = [tuple([(n_pattern, kind) for n_pattern, kind, _, _ in shape]) for shape in shapes]
    columns = [frozenset(layout) for layout in layouts]
    grouped: list[tuple[int, dict[int, int]]] = []
    falling, rows, shape_numbers = np.argsort(-twice_f, kind="stable"), twice_rows.tolist(), shape_of.tolist()
    for number in falling.tolist():
        row, shape = rows[number], shape_numbers[number]
        for first, by_row in grouped:
            if row not in by_row and columns[shape] <= columns[first]:
                by_row[row] = number
                break
        else:
            grouped.append((shape, {row: number}))
    out = list[tuple[Group, list[int]]]()
    for first, by_row in grouped:
        numbers = [by_row[row] for row in sorted(by_row)]
        group = _group(layouts[first], twice_f[numbers], twice_rows[numbers], shapes, shape_of[numbers], frame)
        out.append((group, numbers))
    return out


def groups_by_number(grouped: Sequence[tuple[Group, list[int]]]) -> dict[int, tuple[Group, int]]:
    """The group of each block, and its doubled row."""
    pairs = ((group, zip(numbers, group.twice_rows.tolist(), strict=True)) for group, numbers in grouped)
    return {number: (group, row) for group, numbers_and_rows in pairs for number, row in numbers_and_rows}


def _shapes(twice_f: Ints, parts: PartColumns, frame: Frame) -> tuple[list[Shape], Ints]:
    """The distinct shapes of blocks, and the number of the shape of each block."""
    known, shape_of = dict[Shape, int](), list[int]()
    columns = list(zip(*(column.tolist() for column in (parts.numbers, parts.first, parts.last)), strict=True))
    for f, begin, count in zip(twice_f.tolist(), parts.begins.tolist(), parts.counts.tolist(), strict=True):
        patterns = frame.patterns[f]
        shape = tuple(
            [
                (
                    frame.n_patterns[patterns[first]],
                    frame.kinds[number],
                    tuple(patterns[first:last]),
                    frame.sizes[number],
                )
                for number, first, last in columns[begin : begin + count]
            ]
        )
        shape_of.append(known.setdefault(shape, len(known)))
    return list(known), np.array(shape_of, dtype=np.int64)


def _group(
    layout: Layout, twice_f: Ints, twice_rows: Ints, shapes: Sequence[Shape], shape_of: Ints, frame: Frame
) -> Group:
    """The group with a layout; doubled F, doubled row (rising) and number of the shape of each block."""
    rotations, start = list[RotationColumns](), 0
    for n_pattern, kind in layout:
        first, count = frame.n_patterns.index(n_pattern), frame.n_patterns.count(n_pattern)
        rotations.append(RotationColumns(n_pattern[0], kind, slice(first, first + count), slice(start, start + count)))
        start += count
    place_of = {n_pattern_and_kind: place for place, n_pattern_and_kind in enumerate(layout)}
    functions, heights = dict[int, tuple[Ints, Ints]](), np.zeros(len(shapes), dtype=np.int64)
    for number in dict.fromkeys(shape_of.tolist()):
        columns, states = list[int](), list[int]()
        for n_pattern, kind, patterns, size in shapes[number]:
            rotation = rotations[place_of[n_pattern, kind]]
            shift = rotation.columns.start - rotation.patterns.start
            for pattern in patterns:
                columns += [pattern + shift] * size
                states += range(size)
        functions[number] = np.array(columns), np.array(states)
        heights[number] = max(size for *_, size in shapes[number])
    places = {row: place for place, row in enumerate(twice_rows.tolist())}
    return Group(tuple(rotations), twice_f, twice_rows, heights[shape_of], shape_of, functions, places)


def element_type(all_tables: Iterable[Tables]) -> Any:
    """The type of elements: complex if some of them are."""
    return np.result_type(np.float64, *{table.dtype for tables in all_tables for table in tables.values()})


def are_connected(up: Group, low: Group, step: int, tables: Tables) -> bool:
    """Whether there are elements between two groups whose doubled rows differ by `step`."""
    return any((a.kind, b.kind, (step + a.rise - b.rise) // 2) in tables for a in up.rotations for b in low.rotations)


def coefficients_by_f(coefficients: Floats, frame: Frame) -> Coefficients:
    """Coefficients from an array (F, patterns', patterns) for all F of the frame."""

    def coefficients_at(twice_f: Ints) -> Callable[[slice, slice], Floats]:
        chosen = coefficients[frame.rows_of_f(twice_f)]
        return lambda left, right: chosen[:, left, right]

    return coefficients_at


class Between(NamedTuple):
    """Elements between two kinds of columns: of the rotation (blocks, states', states), and coefficients (blocks, columns', columns)."""

    left: RotationColumns
    right: RotationColumns
    elements: NDArray[Any]
    coefficients: Floats

    def times(self, vectors: NDArray[Any]) -> NDArray[Any]:
        """Σ c X V (blocks, columns', states', n) of vectors (blocks, columns, states, n)."""
        (count, rows, states), n = self.elements.shape, vectors.shape[3]
        moved = np.matmul(self.elements[:, None], vectors[:, self.right.columns, :states])
        return np.asarray(self.coefficients @ moved.reshape(count, -1, rows * n)).reshape(count, -1, rows, n)


def between(
    up: Group, low: Group, chosen: Ints, step: int, tables: Tables, coefficients: Coefficients, frame: Frame,
    states: tuple[int, int],
) -> Iterator[Between]:  # fmt: skip
    """Elements c(F) ⟨r'‖X‖r⟩ between blocks `chosen` of a group and those of another with doubled row + step.

    tables: elements of the rotation. coefficients: between patterns (`coefficients_by_f`). states: most states' and states.
    """
    coefficients_of_f = coefficients(low.twice_f[chosen])
    twice_rows = low.twice_rows[chosen]
    for right in low.rotations:
        places: Places | None = None
        for left in up.rotations:
            key = left.kind, right.kind, (step + left.rise - right.rise) // 2
            if key in tables:
                places = frame.rows_of(twice_rows, right) if places is None else places
                of_columns = coefficients_of_f(left.patterns, right.patterns)
                yield Between(left, right, tables[key][places, : states[0], : states[1]], of_columns)


def write_between(all_elements: Iterable[Between], out: NDArray[Any]) -> None:
    """Write sums of elements to an array (blocks, columns', states', columns, states)."""
    out.fill(0.0)
    by_columns: dict[tuple[int, int], list[Between]] = {}
    for each in all_elements:
        by_columns.setdefault((each.left.columns.start, each.right.columns.start), []).append(each)
    for terms in by_columns.values():
        left, right, elements, coefficients = terms[0]
        (count, rows, columns), (_, up, low) = elements.shape, coefficients.shape
        target = out[:, left.columns, :rows, right.columns, :columns]
        if len(terms) == 1:
            np.multiply(elements[:, None, :, None, :], coefficients[:, :, None, :, None], out=target)
        else:  # Σ c X as a product of matrices
            c = np.stack([term.coefficients for term in terms], axis=-1).reshape(count, up * low, len(terms))
            x = np.stack([term.elements for term in terms], axis=1).reshape(count, len(terms), rows * columns)
            target[...] = np.matmul(c, x).reshape(count, up, low, rows, columns).transpose(0, 1, 3, 2, 4)


def hamiltonians(
    scheme: Scheme,
    operators: Iterable[tuple[Sequence[Contracted], Sequence[Channel]]],
    frame: Frame,
    grouped: Sequence[tuple[Group, list[int]]],
    kinds: Sequence[tuple[int, ...]],
    zeros: Floats,
) -> Iterator[tuple[list[int], NDArray[Any]]]:
    """Numbers of blocks of one kind in a group, and their matrices of H, (blocks, n, n).

    operators: contracted operators, each with the channels that share it. kinds: number of functions and further data of each block.
    Lower triangles count; their energies are relative to `zeros`.
    """
    acting = []
    for contracted, channels in operators:
        if contracted:
            each = [couplings_by_f(scheme, channel, frame.twice_f[0], frame.twice_f[-1]) for channel in channels]
            whole = each[0] if len(each) == 1 else np.add.reduce(each)
            acting.append((tables_of(contracted, frame), coefficients_by_f(whole, frame)))
    space = Workspace()
    for group, numbers in grouped:
        kinds_of_group = [kinds[number] for number in numbers]
        for places, matrices in _matrices_of_group(group, kinds_of_group, acting, frame, zeros[numbers], space):
            yield [numbers[place] for place in places], matrices


def _matrices_of_group(
    group: Group, kinds: Sequence[tuple[int, ...]], acting: Sequence[tuple[Tables, Coefficients]], frame: Frame, zeros: Floats,
    space: Workspace,
) -> Iterator[tuple[list[int], NDArray[Any]]]:  # fmt: skip
    """Places of blocks of one kind in a group, and their matrices."""
    for run in runs_of_similar_size((group.columns * group.heights).tolist(), _LIKE, _SMALL, _MOST):
        places, height = np.arange(run.start, run.stop), int(group.heights[run].max())
        shape = len(places), group.columns, height, group.columns, height
        whole = space.array("whole", *shape, dtype=element_type(tables for tables, _ in acting))
        each = (between(group, group, places, 0, *operator, frame, (height, height)) for operator in acting)
        write_between(_lower(group, chain.from_iterable(each)), whole)
        energies = np.zeros(shape[:3])
        for rotation in group.rotations:
            of_kind = frame.energies_mhz[rotation.kind][frame.rows_of(group.twice_rows[run], rotation), :height]
            energies[:, rotation.columns, : of_kind.shape[1]] = (of_kind - zeros[run, None])[:, None]
        by_function = whole.reshape(len(places), group.columns * height, -1)
        for at, columns, states in group.alike(places, kinds[run]):
            functions = columns * height + states
            if len(functions) == 1 and functions.shape[1] == by_function.shape[1] and (np.diff(functions) == 1).all():
                matrices = by_function[at]
            else:
                matrices = by_function[at[:, None, None], functions[:, :, None], functions[:, None]]
            diagonal = np.arange(functions.shape[1])
            matrices[:, diagonal, diagonal] += energies[at[:, None], columns, states]
            yield places[at].tolist(), matrices


def _lower(group: Group, elements: Iterable[Between]) -> Iterator[Between]:
    """The elements of lower triangles, if the functions of all blocks are in the order of the columns; else all elements."""
    in_order = all((np.diff(columns) >= 0).all() for columns, _ in group.functions.values())
    return (each for each in elements if not in_order or each.left.columns.start >= each.right.columns.start)
