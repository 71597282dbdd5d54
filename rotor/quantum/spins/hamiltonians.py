"""Matrices of H of the blocks of all F, ⟨r' p'|H|r p⟩ = E_r δ + Σ_channels c(p', p) ⟨r'|X|r⟩, many at once (`many_f`)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Workspace
from rotor.quantum.spins.blocks import Plan
from rotor.quantum.spins.many_f import (
    Between,
    Coefficients,
    Frame,
    Group,
    Tables,
    between,
    coefficients_by_f,
    element_type,
    tables_of,
    write_between,
)
from rotor.quantum.spins.pattern_tables import couplings_by_f


def hamiltonians(
    plan: Plan, grouped: Sequence[tuple[Group, list[int]]], kinds: Sequence[tuple[int, ...]], zeros: Floats
) -> Iterator[tuple[list[int], NDArray[Any]]]:
    """Numbers of blocks of one kind in a group, and their matrices (blocks, n, n).

    kinds: number of functions and further data of each block. Lower triangles count; their energies are relative to `zeros`.
    """
    scheme, frame = plan.shared.scheme, plan.shared.cache["frame"]
    acting = []
    for contracted, channels in plan.contracted:
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
    for run in group.runs():
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
