"""Levels with spins, F by F: the blocks of all F, solved and labelled together by size, and their table.

Matrices are computed for all blocks of a group at once (`many_f`), or over the functions that the exchange of three nuclei allows
(`three_equivalent`). Spins are treated

    exact           with all N and all rotational states that a tensor connects
    N-diagonal      without elements between different N
    first-order     without elements between different rotational states too; several spins are still coupled with each other

`neglected` bounds the shifts of levels. The error of a line is at most the sum for its two states.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import accumulate
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats, Ints, end_to_end, hold_freed_memory
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.hyperfine_method import EXACT, FIRST_ORDER, N_DIAGONAL, HyperfineMethod
from rotor.quantum.levels import Levels, SolvedBlock, Used, levels_of_blocks, placed
from rotor.quantum.spins.blocks import (
    Members,
    Plan,
    Shared,
    SpinFunctions,
    States,
    blocks_of_f,
    contracted_plan,
    diagonalised,
    functions_of_blocks,
)
from rotor.quantum.spins.contraction import Contracted
from rotor.quantum.spins.many_f import Frame, Group, frame_of, groups_by_number, groups_of, hamiltonians
from rotor.quantum.spins.parts import labels_by_shares, names_of_parts, over_functions
from rotor.quantum.spins.pattern_tables import pattern_table
from rotor.quantum.spins.rotor import Exist
from rotor.quantum.spins.scheme import AxialState, scheme_of

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.tops.top import Top


def spin_levels(
    top: Top, effects: tuple[QuantumEffect, ...], jmin: int, jmax: int, executor: Executor | None = None
) -> Levels:
    """All levels of a top with spins whose label has N from `jmin` to `jmax`, labelled by (v), n, k or ka and kc, j, f1, ... f.

    Each F that such an N reaches is solved with all its N, so that no block is truncated. Half-integer quantum numbers are doubled.
    """
    return levels_of_f(top, effects, scheme_of(top, effects).reached_f(jmin, jmax), (jmin, jmax), executor)


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
    plan = simplified(contracted_plan(top, effects, lowest, highest, executor, exist), effects)
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


def simplified(plan: Plan, effects: Sequence[QuantumEffect]) -> Plan:
    """The plan with the elements of the requested treatment; unchanged if none is requested."""
    requested = next((effect for effect in effects if isinstance(effect, HyperfineMethod)), None)
    if requested is None:
        return plan
    if plan.scheme.equivalent == 3 and requested.method not in (EXACT, "auto"):
        raise ValueError(
            f"method {requested.method} with a total spin of three nuclei: only the exact method computes them"
        )
    chosen, estimates = requested.method, {EXACT: 0.0}
    if chosen != EXACT and plan.scheme.equivalent < 3:
        from rotor.quantum.spins.neglected import largest_shifts

        other_n, same_n = largest_shifts(plan)
        estimates = {FIRST_ORDER: 2 * (other_n + same_n), N_DIAGONAL: 2 * other_n, EXACT: 0.0}
    if chosen == "auto":
        chosen = next(name for name, size in estimates.items() if size <= requested.tolerance_mhz)
    used = Used(chosen, estimates[chosen], requested.tolerance_mhz)
    operators = [(_without_neglected(contracted, chosen), channels) for contracted, channels in plan.contracted]
    return replace(plan, used=used, contracted=operators)


def _without_neglected(contracted: Sequence[Contracted], method: str) -> list[Contracted]:
    """Operators without elements that a treatment neglects."""
    if method == EXACT:
        return list(contracted)
    same_n = [entry for entry in contracted if not entry.pairs.rise]
    if method == N_DIAGONAL:
        return same_n
    diagonal = [entry for entry in same_n if entry.up is entry.low]
    return [entry._replace(matrices=entry.matrices * np.eye(entry.matrices.shape[1])) for entry in diagonal]


_LARGE = 100  # functions of blocks that are solved as their matrices are made, without those of other groups


def solved_blocks(plan: Plan, all_f: Sequence[int], exist: Exist | None = None) -> list[SolvedBlock]:
    """Solve the blocks of all doubled F in which a level exists (`levels.levels_of_f`): by F, then by the lowest member of each family."""
    table = pattern_table(plan.scheme, all_f[0], all_f[-1])
    patterns = {f: table.patterns[f] for f in all_f if f in table.patterns}
    shared = plan.shared(frame := frame_of(plan.stacks, table))
    solutions: Iterable[States]
    if plan.scheme.equivalent == 3:
        from rotor.quantum.spins.three_equivalent import allowed_states

        members, solutions = allowed_states(plan, frame, patterns, exist)
        grouped = groups_of(members.twice_f, members.parts, frame)
    else:
        members = _members(plan, patterns)
        members = members if exist is None or not len(members.twice_f) else members.existing(exist)
        grouped = groups_of(members.twice_f, members.parts, frame)
        solutions = _states(plan, members, frame, grouped)
    groups = groups_by_number(grouped)
    twice_f, starts = members.twice_f.tolist(), members.first_levels.tolist()
    out: list[SolvedBlock] = [None] * len(twice_f)  # type: ignore[list-item]
    for states in solutions:
        for i, energies, vectors, labels, mixing in _named(states, members):
            f, allowed = twice_f[i], members.allowed[i] if members.allowed else None
            spins = SpinFunctions(f, patterns[f], members.parts, i, shared, *groups[i], allowed)
            out[i] = SolvedBlock((), energies, vectors, starts[i], labels, mixing, spins=spins)
    return out


def _named(states: States, members: Members) -> Iterator[tuple[int, Floats, Floats, Ints, Floats]]:
    """Number, energies, vectors over parts, labels and mixing of each solved block of one size."""
    names, sizes = members.alike(states.numbers)
    vectors: Sequence[Floats] | Floats = states.vectors
    over = states.vectors
    if not members.allowed:
        over = over_functions(members.parts, states.numbers, states.vectors)
    else:
        products = (members.allowed[number].products for number in states.numbers)
        vectors = [of_block @ mixtures for of_block, mixtures in zip(products, states.vectors, strict=True)]
    labels, mixing = labels_by_shares(names, sizes, over)
    yield from zip(states.numbers, states.energies_mhz, vectors, labels, mixing, strict=True)


def _members(plan: Plan, patterns: dict[int, Ints]) -> Members:
    """The blocks of all F; none where N of the first K (KNMIN) is above every N of these F."""
    twice_f, parts = blocks_of_f(plan, patterns)
    first_rows = dict(zip(patterns, accumulate(map(len, patterns.values()), initial=0), strict=False))
    of_block = np.array([first_rows[f] for f in twice_f.tolist()], dtype=np.int64)
    table = end_to_end(list(patterns.values()))
    names, sizes, sub_blocks = names_of_parts(parts, table, np.repeat(of_block, parts.counts))
    levels, subs = (
        np.add.reduceat(counts, parts.begins) if len(twice_f) else np.zeros(0, dtype=np.int64)
        for counts in ((parts.last - parts.first) * np.array(plan.sizes)[parts.numbers], sub_blocks)
    )
    return Members(twice_f, parts, names, sizes, levels, subs)


def _states(plan: Plan, members: Members, frame: Frame, grouped: Sequence[tuple[Group, list[int]]]) -> Iterator[States]:
    """The states of blocks, those of one size together."""
    zeros = np.array([block.energies_mhz[0] for block in plan.blocks])[
        members.parts.lowest
    ]  # energy zero of each block
    kinds = _kinds(plan, members)
    alike: dict[tuple[int, ...], list[tuple[list[int], Floats]]] = {}
    for numbers, matrices in hamiltonians(plan.scheme, plan.contracted, frame, grouped, kinds, zeros):
        kind = kinds[numbers[0]]
        if kind[0] > _LARGE:
            yield _solved(numbers, matrices, kind[2], zeros)
        else:
            alike.setdefault(kind, []).append((numbers, matrices))
    for (_, _, repeats), pieces in alike.items():
        numbers = [number for piece, _ in pieces for number in piece]
        yield _solved(numbers, end_to_end([matrices for _, matrices in pieces]), repeats, zeros)


def _solved(numbers: list[int], matrices: Floats, repeats: int, zeros: Floats) -> States:
    """The states of blocks of one kind (`_kinds`) from their matrices."""
    if repeats > 1:
        return States(numbers, *_state_by_state(matrices, repeats, zeros[numbers]))
    return diagonalised(numbers, matrices, zeros[numbers])


def _kinds(plan: Plan, members: Members) -> list[tuple[int, int, int]]:
    """Functions and sub-blocks of each block, and the number of patterns where each rotational state is solved by itself, else 1."""
    parts, repeats = members.parts, np.ones(len(members.levels), dtype=np.int64)
    if plan.used is not None and plan.used.method == FIRST_ORDER:
        repeats = np.where(parts.counts == 1, (parts.last - parts.first)[parts.begins], 1)
    return list(zip(members.levels.tolist(), members.sub_blocks.tolist(), repeats.tolist(), strict=True))


def _state_by_state(matrices: Floats, repeats: int, zeros_mhz: Floats) -> tuple[Floats, Floats]:
    """Energies (rising) and vectors of first order: one small matrix over coupling patterns for each rotational state."""
    count, size, _ = matrices.shape
    states = np.arange(size // repeats)
    of_states = matrices.reshape(count, repeats, len(states), repeats, -1)[:, :, states, :, states]
    shifts, mixtures = np.linalg.eigh(of_states)  # (states, blocks, patterns) and (states, blocks, patterns, patterns)
    vectors = np.zeros((count, repeats, len(states), len(states), repeats))
    vectors[:, :, states, states] = mixtures.transpose(1, 2, 0, 3)
    energies = (shifts + zeros_mhz[:, None]).transpose(1, 0, 2).reshape(count, size)
    order = np.argsort(energies, axis=1, kind="stable")
    return (
        np.take_along_axis(energies, order, axis=1),
        np.take_along_axis(vectors.reshape(count, size, size), order[:, None], axis=2),
    )
