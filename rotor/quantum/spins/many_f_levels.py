"""Levels of many F at once: the Hamiltonians of all blocks of a group in one array, see `many_f`.

Each block is then solved by itself, with the matrix that `blocks` makes of it, to the last bit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.spins.blocks import Exist, Plan, SpinBlock, parts_of_f
from rotor.quantum.spins.many_f import MOST, Frame, Group, Tables, frame_of, groups_of, pieces_between, tables_of
from rotor.quantum.spins.method import FIRST_ORDER
from rotor.quantum.spins.parts import SpinPart, labels_of, names_of_tables
from rotor.quantum.spins.pattern_tables import couplings_by_f, pattern_table

_FEW = 100  # patterns of an F
Member = tuple[int, tuple[SpinPart, ...]]
"""A block before it is solved: doubled F, parts."""


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
    alone = shared.used is not None and shared.used.method == FIRST_ORDER
    if shared.stacks is None or plan.contracted is None or alone or shared.scheme.equivalent == 3:
        return None
    table = pattern_table(shared.scheme, every_f[0], every_f[-1])
    if not 0 < len(table.every) <= _FEW:
        return None
    members = [(f, parts) for f, own in table.patterns.items() for parts in parts_of_f(plan, own)]
    if not members or max(parts[-1].place.stop for _, parts in members) > MOST:
        return None
    members, names, sizes = _existing(members, table.patterns, exist)
    frame = frame_of(shared.stacks, table.places, table.every)
    shared.cache.update(frame=frame, patterns=table.patterns)
    acting = []
    for contracted, channels in (found for found in plan.contracted if found[0]):
        each = [couplings_by_f(shared.scheme, channel, every_f[0], every_f[-1]) for channel in channels]
        acting.append((tables_of(contracted, frame), each[0] if len(each) == 1 else np.add.reduce(each)))
    out, start = [], 0
    for (f, parts), own, of_names in zip(
        members, _solved(members, acting, frame), zip(names, sizes, strict=True), strict=True
    ):
        group, energies, vectors = own
        labels, mixing = labels_of(parts, of_names, vectors)
        out.append(
            SpinBlock(f, table.patterns[f], parts, energies, vectors, labels, mixing, shared, start, group=group)
        )
        start += len(energies)
    return out


def _existing(
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
    of_members, of_sizes = np.split(names, stops[:-1]), np.split(sizes, lasts[:-1])
    return [members[i] for i in chosen], [of_members[i] for i in chosen], [of_sizes[i] for i in chosen]


def _solved(
    members: Sequence[Member], acting: Sequence[tuple[Tables, Floats]], frame: Frame
) -> list[tuple[Group, Floats, Floats]]:
    """The group, energies and eigenvectors of every block; blocks of one size are solved in one call."""
    matrices: dict[int, list[tuple[int, Floats]]] = {}
    groups: dict[int, Group] = {}
    for group, numbers in groups_of(members, frame):
        zeros = np.array([members[number][1][0].rotor.energies_mhz[0] for number in numbers])
        every = _hamiltonians(group, acting, frame, zeros)
        if not np.isfinite(every).all():
            raise ValueError("a block of the Hamiltonian overflows: N max is too high for these constants")
        for matrix, own, number in zip(every, group.functions, numbers, strict=True):
            groups[number] = group
            matrices.setdefault(len(own), []).append((number, matrix[own[:, None], own]))
    out: list[tuple[Group, Floats, Floats]] = [None] * len(members)  # type: ignore[list-item]
    for alike in matrices.values():
        energies, vectors = np.linalg.eigh(np.stack([matrix for _, matrix in alike]))  # reads the lower triangle
        for (number, _), own, states in zip(alike, energies, vectors, strict=True):
            zero = float(members[number][1][0].rotor.energies_mhz[0])
            out[number] = groups[number], own + zero, states
    return out


def _hamiltonians(group: Group, acting: Sequence[tuple[Tables, Floats]], frame: Frame, zeros: Floats) -> Floats:
    """The Hamiltonians of a group, (F, functions, functions), energies from `zeros` on, in the lower triangle."""
    count, width = len(group.twice_f), group.states * group.columns
    out = np.zeros((count, width, width))
    diagonal = np.zeros((count, group.states, group.columns))
    for slot in group.slots:
        table = frame.energies_mhz[slot.kind]
        rows = min(group.states, table.shape[1])
        own = table[frame.of_n(group.twice_f, slot), :rows]
        diagonal[:, :rows, slot.columns] = (own - zeros[:, None])[:, :, None]
    every = np.arange(width)
    out[:, every, every] = diagonal.reshape(count, width)
    for tables, coefficients in acting:
        for piece in pieces_between(out, group, group, group.twice_f, 0, tables, coefficients, frame):
            np.add(piece.place, piece.elements * piece.coefficients, out=piece.place)
    return out
