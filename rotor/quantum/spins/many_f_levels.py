"""Levels of many F at once: the Hamiltonians of all blocks of a group in one array, see `many_f`.

Each block is then solved by itself, with the matrix that `blocks` makes of it, to the last bit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints, Workspace
from rotor.quantum.hyperfine_method import FIRST_ORDER
from rotor.quantum.spins.axial import Exist
from rotor.quantum.spins.blocks import Plan, SpinBlock, parts_of_f
from rotor.quantum.spins.many_f import MOST, Frame, Group, Tables, between, frame_of, functions_of, groups_of, tables_of
from rotor.quantum.spins.parts import SpinPart, labels_of_alike, names_of_tables
from rotor.quantum.spins.pattern_tables import couplings_by_f, pattern_table

_FEW = 100  # patterns of an F
Member = tuple[int, tuple[SpinPart, ...]]
"""A block before it is solved: doubled F, parts."""


class Solved(NamedTuple):
    """A block solved with others: energies in MHz, eigenvectors, labels and mixing as in `SpinBlock`."""

    group: Group
    energies_mhz: Floats
    vectors: Floats
    labels: Ints
    mixing: Floats


def solve_many_f(plan: Plan, every_f: Sequence[int], exist: Exist | None = None) -> list[SpinBlock] | None:
    """The blocks of all F as `blocks.solve_f` gives them one by one; None where that is the way to solve them.

    Parameters
    ----------
    plan : Plan
        The rotation and the operators.
    every_f : sequence of int
        Doubled F, rising by 2.
    exist : callable, optional
        See `levels.levels_of_f`.

    Returns
    -------
    list of SpinBlock or None
    """
    shared = plan.shared
    if shared.scheme.equivalent == 3:
        return None
    table = pattern_table(shared.scheme, every_f[0], every_f[-1])
    if not 0 < len(table.every) <= _FEW:
        return None
    members = [(f, parts) for f, own in table.patterns.items() for parts in parts_of_f(plan, own)]
    if not members or max(parts[-1].place.stop for _, parts in members) > MOST:
        return None
    alone = shared.used is not None and shared.used.method == FIRST_ORDER
    if alone and any(part.repeats > 1 for _, parts in members for part in parts):
        return None  # state by state the matrices are smaller
    members, names, sizes = existing_blocks(members, table.patterns, exist)
    frame = frame_of(shared.stacks, table.places, table.every)
    shared.cache.update(frame=frame, patterns=table.patterns)
    acting = []
    for contracted, channels in (found for found in plan.contracted if found[0]):
        each = [couplings_by_f(shared.scheme, channel, every_f[0], every_f[-1]) for channel in channels]
        acting.append((tables_of(contracted, frame), each[0] if len(each) == 1 else np.add.reduce(each)))
    out, start = [], 0
    for (f, parts), own in zip(members, _solved(members, names, sizes, acting, frame), strict=True):
        results = own.energies_mhz, own.vectors, own.labels, own.mixing
        out.append(SpinBlock(f, table.patterns[f], parts, *results, shared, start, group=own.group))
        start += len(own.energies_mhz)
    return out


def existing_blocks(
    members: list[Member], patterns: dict[int, Ints], exist: Exist | None
) -> tuple[list[Member], list[Ints], list[Ints]]:
    """The blocks in which a level exists, the names of their levels, and how many each sub-block names."""
    by_f: dict[int, list[SpinPart]] = {}
    for f, parts in members:
        by_f.setdefault(f, []).extend(parts)
    names, sizes = names_of_tables([(patterns[f], parts) for f, parts in by_f.items()])
    stops = np.cumsum([parts[-1].place.stop for _, parts in members])
    lasts = np.cumsum([sum(part.sub_blocks for part in parts) for _, parts in members])
    there = np.ones(len(members), dtype=bool)
    if exist is not None:
        there = np.logical_or.reduceat(exist(names), np.append(0, stops[:-1]))
    chosen = np.flatnonzero(there).tolist()
    of_names, of_sizes = ([0, *ends.tolist()] for ends in (stops, lasts))
    return (
        [members[i] for i in chosen],
        [names[of_names[i] : of_names[i + 1]] for i in chosen],
        [sizes[of_sizes[i] : of_sizes[i + 1]] for i in chosen],
    )


def _solved(
    members: Sequence[Member],
    names: Sequence[Ints],
    sizes: Sequence[Ints],
    acting: Sequence[tuple[Tables, Floats]],
    frame: Frame,
) -> list[Solved]:
    """Every block solved and named; those of one size are solved in one call."""
    matrices: dict[tuple[int, int], list[tuple[int, Floats]]] = {}
    groups: dict[int, Group] = {}
    zeros = [float(parts[0].rotor.energies_mhz[0]) for _, parts in members]  # taken out for the sake of digits
    spaces = [Workspace() for _ in acting]
    for group, numbers in groups_of(members, frame):
        own_zeros = np.array([zeros[number] for number in numbers])
        for number, matrix in zip(numbers, _hamiltonians(group, acting, frame, own_zeros, spaces), strict=True):
            groups[number] = group
            matrices.setdefault((len(matrix), len(sizes[number])), []).append((number, matrix))
    out: list[Solved] = [None] * len(members)  # type: ignore[list-item]
    for alike in matrices.values():
        every = np.stack([matrix for _, matrix in alike])
        if not np.isfinite(every).all():
            raise ValueError("a block of the Hamiltonian overflows: N max is too high for these constants")
        energies, vectors = np.linalg.eigh(every)  # reads the lower triangle
        numbers = [number for number, _ in alike]
        own_names, own_sizes = (np.stack([named[number] for number in numbers]) for named in (names, sizes))
        labels, mixing = labels_of_alike([members[number][1] for number in numbers], own_names, own_sizes, vectors)
        energies += np.array([zeros[number] for number in numbers])[:, None]
        for place, number in enumerate(numbers):
            out[number] = Solved(groups[number], energies[place], vectors[place], labels[place], mixing[place])
    return out


def _hamiltonians(
    group: Group, acting: Sequence[tuple[Tables, Floats]], frame: Frame, zeros: Floats, spaces: Sequence[Workspace]
) -> Iterator[Floats]:
    """The Hamiltonians of a group, (functions, functions) of each block, energies from `zeros` on, in the lower triangle.

    spaces: one for each of the operators.
    """
    every = [
        functions_of(between(group, group, group.twice_f, 0, tables, coefficients, frame, own))
        for (tables, coefficients), own in zip(acting, spaces, strict=True)
    ]
    diagonal = np.zeros((len(zeros), group.columns, group.states))
    for rotation in group.rotations:
        own = frame.energies_mhz[rotation.kind][frame.of_n(group.twice_f, rotation), : group.states]
        diagonal[:, rotation.columns, : own.shape[1]] = (own - zeros[:, None])[:, None]
    for place, functions in enumerate(group.functions):
        chosen = functions[:, None], functions
        matrix = every[0][place][chosen] if every else np.zeros((len(functions), len(functions)))
        matrix.flat[:: len(functions) + 1] += diagonal[place].ravel()[functions]
        for one in every[1:]:
            matrix += one[place][chosen]
        yield matrix
