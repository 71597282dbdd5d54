"""Solution of the blocks of many F.

The matrices are computed for all F of a group at once (`many_f`), by closed forms for axial tops (`axial_levels`), block by block where
they are large, or over the functions that the exchange of three nuclei allows (`three_equivalent`). All methods give the matrix of
`blocks` to the last bit. Blocks of one size are diagonalised and labelled together.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import accumulate

import numpy as np

from rotor.arrays import Floats, Ints, Workspace
from rotor.quantum.spins.axial_levels import axial_states
from rotor.quantum.spins.blocks import (
    Member,
    Plan,
    SpinBlock,
    States,
    coefficients_by_f,
    diagonalised,
    parts_of_f,
    product,
)
from rotor.quantum.spins.many_f import MOST, Frame, Group, Tables, between, frame_of, functions_of, groups_of, tables_of
from rotor.quantum.spins.parts import SpinPart, labels_by_shares, names_of_tables, over_functions
from rotor.quantum.spins.pattern_tables import PatternTable, couplings_by_f, pattern_table
from rotor.quantum.spins.rotor import Channel, Exist

FEW = 100  # with more patterns of an F, coefficients are computed one F at a time


def solved_blocks(plan: Plan, all_f: Sequence[int], exist: Exist | None = None) -> list[SpinBlock]:
    """Solve the blocks of all doubled F in which a level exists (`levels.levels_of_f`): by F, then by the lowest member of each family."""
    scheme = plan.shared.scheme
    if scheme.equivalent == 3:
        from rotor.quantum.spins.three_equivalent import allowed_states, in_wang_functions

        plan, patterns = in_wang_functions(plan), {f: scheme.patterns(f) for f in all_f}
        members, solutions = allowed_states(plan, patterns, exist)
    else:
        table = pattern_table(scheme, all_f[0], all_f[-1])
        patterns = {f: table.patterns[f] for f in all_f if f in table.patterns}
        members = _existing_members(plan, patterns, exist)
        solutions = _states(plan, members, table._replace(patterns=patterns))
    plan.shared.cache["patterns"] = patterns
    starts = list(accumulate((len(member.names) for member in members), initial=0))
    out: list[SpinBlock] = [None] * len(members)  # type: ignore[list-item]
    for states in solutions:
        for i, energies, vectors, labels, mixing in _named(states, [members[i] for i in states.numbers]):
            f, parts, _, _, allowed = members[i]
            results = energies, vectors, labels, mixing
            out[i] = SpinBlock(
                f, patterns[f], parts, *results, plan.shared, starts[i], allowed, states.groups.get(i)
            )  # fmt: skip
    return out


def _named(states: States, members: Sequence[Member]) -> Iterator[tuple[int, Floats, Floats, Ints, Floats]]:
    """Number, energies, vectors over parts, labels and mixing of each solved block of one size."""
    names, sizes = (np.stack(column) for column in zip(*((m.names, m.sizes) for m in members), strict=True))
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
    candidates = [(f, parts) for f, patterns_of_f in patterns.items() for parts in parts_of_f(plan, patterns_of_f)]
    if not candidates:  # N of the first K (KNMIN) is above every N of these F
        return []
    by_f: dict[int, list[SpinPart]] = {}
    for f, parts in candidates:
        by_f.setdefault(f, []).extend(parts)
    names, sizes = names_of_tables([(patterns[f], parts) for f, parts in by_f.items()])
    stops = np.cumsum([0, *(parts[-1].place.stop for _, parts in candidates)])
    lasts = np.cumsum([0, *(sum(part.sub_blocks for part in parts) for _, parts in candidates)])
    exists = np.ones(len(candidates), dtype=bool)
    if exist is not None:
        exists = np.logical_or.reduceat(exist(names), stops[:-1])
    name_bounds, size_bounds = stops.tolist(), lasts.tolist()
    return [
        Member(*candidates[i], names[name_bounds[i] : name_bounds[i + 1]], sizes[size_bounds[i] : size_bounds[i + 1]])
        for i in np.flatnonzero(exists).tolist()
    ]


def _states(plan: Plan, members: Sequence[Member], table: PatternTable) -> Iterator[States]:
    """The states of all blocks, by the method that is fastest for their shapes."""
    parts = [part for member in members for part in member.parts]
    if not members or len(table.distances) > FEW:
        return _block_by_block(plan, members, table.patterns)
    if plan.shared.axial:
        return axial_states(plan, members, table)
    by_state = plan.shared.state_by_state and any(part.repeats > 1 for part in parts)  # smaller matrices
    if by_state or max(len(member.names) for member in members) > MOST:
        return _block_by_block(plan, members, table.patterns)
    return _group_by_group(plan, members, table)


def _block_by_block(plan: Plan, members: Sequence[Member], patterns: dict[int, Ints]) -> Iterator[States]:
    """States of blocks whose matrices are computed one at a time."""
    few = not plan.shared.scheme.equivalent and max(map(len, patterns.values()), default=0) <= FEW
    coefficients = coefficients_by_f(plan, patterns) if few else {}
    for number, (f, parts, *_) in enumerate(members):
        if f not in coefficients:
            coefficients = coefficients_by_f(plan, {f: patterns[f]})
        if plan.shared.state_by_state and len(parts) == 1:
            energies, vectors = _state_by_state(plan, parts[0], coefficients[f])
            yield States([number], energies[None], vectors[None])
        else:
            zero = float(parts[0].rotor.energies_mhz[0])  # subtracted, so that round-off is relative to splittings
            yield diagonalised([number], _matrix(plan, parts, coefficients[f], zero)[None], np.array([zero]))


def _matrix(plan: Plan, parts: tuple[SpinPart, ...], coefficients: dict[Channel, Floats], zero: float) -> Floats:
    """The Hamiltonian of one block in the lower triangle, with energies relative to `zero`."""
    size = parts[-1].place.stop
    matrix = np.zeros((size, size))
    matrix.flat[:: size + 1] = np.concatenate([np.tile(p.rotor.energies_mhz - zero, p.repeats) for p in parts])
    single = all(part.repeats == 1 for part in parts)
    single_factors = {channel: table.tolist() for channel, table in coefficients.items()} if single else {}
    for a, up in enumerate(parts):
        for low in parts[: a + 1]:
            for operator, channels in plan.operators.get((up.number, low.number), ()):
                if single:
                    factors_of_channels = [
                        single_factors[channel][up.patterns.start][low.patterns.start] for channel in channels
                    ]
                    element = operator * sum(factors_of_channels)
                else:
                    factors = coefficients[channels[0]][up.patterns, low.patterns]
                    for channel in channels[1:]:
                        factors = factors + coefficients[channel][up.patterns, low.patterns]
                    element = product(factors, operator)
                matrix[up.place, low.place] += element
    return matrix


def _state_by_state(plan: Plan, part: SpinPart, coefficients: dict[Channel, Floats]) -> tuple[Floats, Floats]:
    """Energies (rising) and vectors of first order: one small matrix over coupling patterns for each rotational state."""
    states, repeats = len(part.rotor.energies_mhz), part.repeats
    matrices = np.zeros((states, repeats, repeats))
    for operator, channels in plan.operators.get((part.number, part.number), ()):
        for channel in channels:
            matrices += np.diag(operator)[:, None, None] * coefficients[channel][part.patterns, part.patterns]
    shifts, mixtures = np.linalg.eigh(matrices)
    energies = (part.rotor.energies_mhz[:, None] + shifts).ravel()
    vectors = np.zeros((repeats, states, states, repeats))
    state_numbers = np.arange(states)
    vectors[:, state_numbers, state_numbers, :] = mixtures.transpose(1, 0, 2)
    order = np.argsort(energies, kind="stable")
    return energies[order], vectors.reshape(repeats * states, -1)[:, order]


def _group_by_group(plan: Plan, members: Sequence[Member], table: PatternTable) -> Iterator[States]:
    """States of blocks whose functions differ only in F, with matrices of many F in one array."""
    shared, first, last = plan.shared, min(table.patterns), max(table.patterns)
    frame = frame_of(shared.stacks, table.places, table.distances)
    shared.cache["frame"] = frame
    acting = []
    for contracted, channels in plan.contracted:
        if not contracted:
            continue
        each = [couplings_by_f(shared.scheme, channel, first, last) for channel in channels]
        acting.append((tables_of(contracted, frame), each[0] if len(each) == 1 else np.add.reduce(each)))
    zeros = np.array([member.parts[0].rotor.energies_mhz[0] for member in members])  # energy zero of each block
    spaces = [Workspace() for _ in acting]
    matrices: dict[tuple[int, int], list[tuple[int, Floats]]] = {}
    groups: dict[int, Group] = {}
    for group, numbers in groups_of([member[:2] for member in members], frame):
        for number, matrix in zip(numbers, _hamiltonians(group, acting, frame, zeros[numbers], spaces), strict=True):
            groups[number] = group
            matrices.setdefault((len(matrix), len(members[number].sizes)), []).append((number, matrix))
    for alike in matrices.values():
        numbers = [number for number, _ in alike]
        yield diagonalised(numbers, np.stack([matrix for _, matrix in alike]), zeros[numbers], groups)


def _hamiltonians(
    group: Group, acting: Sequence[tuple[Tables, Floats]], frame: Frame, zeros: Floats, spaces: Sequence[Workspace]
) -> Iterator[Floats]:
    """The Hamiltonian (functions, functions) of each block of a group, with energies relative to `zeros`, in the lower triangle.

    spaces: memory for each operator.
    """
    terms = [
        functions_of(between(group, group, group.twice_f, 0, tables, coefficients, frame, space))
        for (tables, coefficients), space in zip(acting, spaces, strict=True)
    ]
    diagonal = np.zeros((len(zeros), group.columns, group.states))
    for rotation in group.rotations:
        energies = frame.energies_mhz[rotation.kind][frame.rows_of_n(group.twice_f, rotation), : group.states]
        diagonal[:, rotation.columns, : energies.shape[1]] = (energies - zeros[:, None])[:, None]
    for place, functions in enumerate(group.functions):
        chosen = functions[:, None], functions
        matrix = terms[0][place][chosen] if terms else np.zeros((len(functions), len(functions)))
        matrix.flat[:: len(functions) + 1] += diagonal[place].ravel()[functions]
        for term in terms[1:]:
            matrix += term[place][chosen]
        yield matrix
