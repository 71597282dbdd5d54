"""Solution of the blocks of all F.

Matrices are computed for all blocks of a group at once (`many_f`), or over the functions that the exchange of three nuclei allows
(`three_equivalent`). Blocks of one size are diagonalised and labelled together.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import accumulate

import numpy as np

from rotor.arrays import Floats, Ints, end_to_end
from rotor.quantum.spins.blocks import Member, Plan, SpinBlock, States, blocks_of_f, diagonalised
from rotor.quantum.spins.hamiltonians import hamiltonians
from rotor.quantum.spins.many_f import Group, frame_of, groups_of
from rotor.quantum.spins.parts import labels_by_shares, names_of_parts, over_functions
from rotor.quantum.spins.pattern_tables import pattern_table
from rotor.quantum.spins.rotor import Exist


def solved_blocks(plan: Plan, all_f: Sequence[int], exist: Exist | None = None) -> list[SpinBlock]:
    """Solve the blocks of all doubled F in which a level exists (`levels.levels_of_f`): by F, then by the lowest member of each family."""
    shared = plan.shared
    table = pattern_table(shared.scheme, all_f[0], all_f[-1])
    patterns = {f: table.patterns[f] for f in all_f if f in table.patterns}
    frame = shared.cache["frame"] = frame_of(shared.stacks, table)
    if shared.scheme.equivalent == 3:
        from rotor.quantum.spins.three_equivalent import allowed_states

        members, solutions = allowed_states(plan, patterns, exist)
        grouped = groups_of([member[:2] for member in members], frame)
    else:
        members = _existing_members(plan, patterns, exist)
        grouped = groups_of([member[:2] for member in members], frame)
        solutions = _states(plan, members, grouped)
    groups = {number: group for group, numbers in grouped for number in numbers}
    starts = list(accumulate((len(member.names) for member in members), initial=0))
    out: list[SpinBlock] = [None] * len(members)  # type: ignore[list-item]
    for states in solutions:
        for i, energies, vectors, labels, mixing in _named(states, [members[i] for i in states.numbers]):
            f, parts, _, _, allowed = members[i]
            results = energies, vectors, labels, mixing
            out[i] = SpinBlock(f, patterns[f], parts, *results, shared, groups[i], starts[i], allowed)
    return out


def _named(states: States, members: Sequence[Member]) -> Iterator[tuple[int, Floats, Floats, Ints, Floats]]:
    """Number, energies, vectors over parts, labels and mixing of each solved block of one size."""
    names = np.concatenate([member.names for member in members]).reshape(len(members), *members[0].names.shape)
    sizes = np.concatenate([member.sizes for member in members]).reshape(len(members), -1)
    vectors: Sequence[Floats] | Floats = states.vectors
    if members[0].allowed is None:
        labels, mixing = labels_by_shares(names, sizes, over_functions([m.parts for m in members], states.vectors))
    else:
        labels, mixing = labels_by_shares(names, sizes, states.vectors)
        vectors = [
            m.allowed.products @ mixtures for m, mixtures in zip(members, states.vectors, strict=True) if m.allowed
        ]
    yield from zip(states.numbers, states.energies_mhz, vectors, labels, mixing, strict=True)


def _existing_members(plan: Plan, patterns: dict[int, Ints], exist: Exist | None) -> list[Member]:
    """The blocks in which a level exists."""
    candidates = blocks_of_f(plan, patterns)
    if not candidates:  # N of the first K (KNMIN) is above every N of these F
        return []
    table = end_to_end(list(patterns.values()))
    first_rows = dict(zip(patterns, accumulate(map(len, patterns.values()), initial=0), strict=False))
    parts = [part for _, parts_of_block in candidates for part in parts_of_block]
    counts: Ints = np.array([len(parts_of_block) for _, parts_of_block in candidates])
    names, sizes, sub_blocks = names_of_parts(parts, table, np.repeat([first_rows[f] for f, _ in candidates], counts))
    stops = np.cumsum([0, *(parts_of_block[-1].place.stop for _, parts_of_block in candidates)])
    lasts = np.append(0, np.cumsum(np.add.reduceat(sub_blocks, np.asarray(np.cumsum(counts) - counts))))
    exists = np.ones(len(candidates), dtype=bool)
    if exist is not None:
        exists = np.logical_or.reduceat(exist(names), stops[:-1])
    name_bounds, size_bounds = stops.tolist(), lasts.tolist()
    return [
        Member(*candidates[i], names[name_bounds[i] : name_bounds[i + 1]], sizes[size_bounds[i] : size_bounds[i + 1]])
        for i in np.flatnonzero(exists).tolist()
    ]


def _states(plan: Plan, members: Sequence[Member], grouped: Sequence[tuple[Group, list[int]]]) -> Iterator[States]:
    """The states of blocks, those of one size together."""
    zeros = np.array([member.parts[0].rotor.energies_mhz[0] for member in members])  # energy zero of each block
    kinds = [_kind(plan, member) for member in members]
    alike: dict[tuple[int, ...], list[tuple[list[int], Floats]]] = {}
    for numbers, matrices in hamiltonians(plan, grouped, kinds, zeros):
        alike.setdefault(kinds[numbers[0]], []).append((numbers, matrices))
    for (_, _, repeats), pieces in alike.items():
        numbers = [number for piece, _ in pieces for number in piece]
        matrices = np.concatenate([matrices for _, matrices in pieces])
        if repeats > 1:
            yield States(numbers, *_state_by_state(matrices, repeats, zeros[numbers]))
        else:
            yield diagonalised(numbers, matrices, zeros[numbers])


def _kind(plan: Plan, member: Member) -> tuple[int, int, int]:
    """Functions and sub-blocks of a block, and the number of patterns where each rotational state is solved by itself, else 1."""
    by_state = plan.shared.state_by_state and len(member.parts) == 1
    return len(member.names), len(member.sizes), member.parts[0].repeats if by_state else 1


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
