"""Levels with spins, F by F: the table of levels with labels, degeneracies and weights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import hold_freed_memory
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.levels import Levels, SolvedBlock, levels_of_blocks, placed
from rotor.quantum.spins.blocks import Shared, contracted_plan, functions_of_blocks
from rotor.quantum.spins.operators import AxialState
from rotor.quantum.spins.rotor import Exist
from rotor.quantum.spins.scheme import scheme_of
from rotor.quantum.spins.simplify import simplified
from rotor.quantum.spins.solve import solved_blocks

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.tops.top import Top


def spin_levels(
    top: Top, effects: tuple[QuantumEffect, ...], jmin: int, jmax: int, executor: Executor | None = None
) -> Levels:
    """All levels of a top with spins whose label has N from `jmin` to `jmax`, labelled by (v), n, k or ka and kc, j, f1, ... f.

    Each F that such an N reaches is solved with all its N, so that no block is truncated. Half-integer quantum numbers are doubled.
    """
    total = scheme_of(top, effects).total
    first = max(2 * jmin - total, total % 2)
    return levels_of_f(top, effects, range(first, 2 * jmax + total + 1, 2), (jmin, jmax), executor)


def levels_of_f(
    top: Top,
    effects: tuple[QuantumEffect, ...],
    all_f: Sequence[int],
    n_range: tuple[int, int] | None = None,
    executor: Executor | None = None,
    exist: Exist | None = None,
) -> Levels:
    """The levels with vectors of all doubled F in `all_f` whose label has N within `n_range`, by default all.

    exist: takes labels (n, columns as `SolvedBlock.labels`) and returns whether each level exists, (n,) of bool. Blocks without an existing
    level are not solved. In an axial top v and K decide.
    """
    hold_freed_memory()
    lowest, highest = _range_of_n(top, effects, all_f)
    plan = simplified(contracted_plan(top, effects, lowest, highest, executor, exist), effects, all_f)
    solved = solved_blocks(plan, all_f, exist)
    if n_range:
        solved = [within_n(block, n_range) for block in solved]
    blocks = tuple(placed(solved))
    return _table(top, effects, blocks, highest if n_range is None else n_range[1])


def unmixed_levels(top: Top, effects: tuple[QuantumEffect, ...], all_f: Sequence[int]) -> Levels:
    """Basis functions of all F in `all_f`, rotational states times coupling patterns, as levels without spin splitting.

    They are labelled as solved levels are, without vectors.
    """
    lowest, highest = _range_of_n(top, effects, all_f)
    plan = contracted_plan(top, effects, lowest, highest, None)
    if plan.scheme.equivalent == 3:
        raise ValueError(
            "functions of three equivalent nuclei are not products of a rotational state and a coupling pattern"
        )
    blocks = tuple(placed(functions_of_blocks(plan, all_f)))
    return _table(top, effects, blocks, highest)


def _range_of_n(top: Top, effects: tuple[QuantumEffect, ...], all_f: Sequence[int]) -> tuple[int, int]:
    """The lowest and the highest N that couple with the spins to one of these F (doubled)."""
    total = scheme_of(top, effects).total
    return min(max(0, (f - total) // 2) for f in all_f), max((f + total) // 2 for f in all_f)


def within_n(block: SolvedBlock, n_range: tuple[int, int]) -> SolvedBlock:
    """The states of a block whose N lies in a range."""
    n = np.asarray(block.labels)[:, 3] // 2
    chosen = (n >= n_range[0]) & (n <= n_range[1])
    cut = {name: getattr(block, name)[chosen] for name in ("energies_mhz", "labels", "mixing")}
    return replace(block, vectors=block.vectors[:, chosen], **cut)


def _table(top: Top, effects: tuple[QuantumEffect, ...], blocks: tuple[SolvedBlock, ...], jmax: int) -> Levels:
    """The table of the levels of these blocks."""
    if not blocks:
        raise ValueError("no level with these spins exists in the range of F")
    labels = np.concatenate([block.labels for block in blocks])
    axial = isinstance(blocks[0].spins.parts[0].rotor.parts[0].basis, AxialState)
    quanta = {"v": labels[:, 0]} if any(effect.states(top) for effect in effects) else {}
    quanta |= {"n": labels[:, 3] // 2}
    if axial:
        quanta |= {"k": labels[:, 1]}
    elif top.kind != "linear":
        quanta |= {"ka": labels[:, 1], "kc": labels[:, 2]}
    shared: Shared = blocks[0].spins.shared
    scheme = shared.scheme
    quanta |= scheme.sums_of(labels)
    return levels_of_blocks(
        top,
        effects,
        blocks,
        quanta,
        jmax,
        shared.representation,
        multiplicity=labels[:, -1] + 1,
        components=np.where(labels[:, 1] > 0, 2, 1) if axial else np.ones(len(labels), dtype=np.int64),
        halves=scheme.halves,
    )
