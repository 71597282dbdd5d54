"""Solution of the blocks of all F.

Matrices are computed for all blocks of a group at once (`many_f`), or over the functions that the exchange of three nuclei allows
(`three_equivalent`). Blocks of one size are diagonalised and labelled together.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import accumulate

import numpy as np

from rotor.arrays import Floats, Ints, end_to_end
from rotor.quantum.levels import SolvedBlock
from rotor.quantum.spins.blocks import Members, Plan, SpinFunctions, States, blocks_of_f, diagonalised
from rotor.quantum.spins.many_f import Frame, Group, frame_of, groups_by_number, groups_of, hamiltonians
from rotor.quantum.spins.parts import labels_by_shares, names_of_parts, over_functions
from rotor.quantum.spins.pattern_tables import pattern_table
from rotor.quantum.spins.rotor import Exist

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
    if not members.allowed:
        over = over_functions(members.parts, states.numbers, states.vectors)
        labels, mixing = labels_by_shares(names, sizes, over)
    else:
        labels, mixing = labels_by_shares(names, sizes, states.vectors)
        products = (members.allowed[number].products for number in states.numbers)
        vectors = [of_block @ mixtures for of_block, mixtures in zip(products, states.vectors, strict=True)]
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
    if plan.state_by_state:
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
