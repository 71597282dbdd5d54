"""Levels of each F: rotational eigenstates coupled with the spins, one real symmetric matrix for each connected part.

The rotation, with all states v and their interactions, is solved first. Its eigenstates r of N from F - ΣS to F + ΣS, times the coupling
patterns p of each N, are the basis of an F,

    ⟨r' p'|H|r p⟩ = E_r δ + Σ_channels c(p', p) ⟨r'|X|r⟩,

a Kronecker product for each pair of solved blocks. Blocks that no channel connects are solved separately. `parts` labels the levels.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints, numbers_in_runs
from rotor.frozen import dataclass
from rotor.quantum.blocks.connected import part_numbers
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.levels import SolvedBlock, Used
from rotor.quantum.spins.contraction import (
    Contracted,
    Stack,
    operators_of_stacks,
    stacks_of,
    within_blocks,
)
from rotor.quantum.spins.coupling import Allowed
from rotor.quantum.spins.many_f import Frame, Group, frame_of, groups_by_number, groups_of
from rotor.quantum.spins.parts import PartColumns, SpinPart, named_states
from rotor.quantum.spins.pattern_tables import pattern_table
from rotor.quantum.spins.rotor import (
    ALONE,
    Channel,
    Channels,
    Exist,
    Terms,
    channels_of,
    in_wang_functions,
    solved_rotor,
    valued_terms,
)
from rotor.quantum.spins.scheme import Scheme, scheme_of
from rotor.tops.top import without_internal_rotation

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.tops.top import Top

InStacks = list[tuple[list[Contracted], list[Channel]]]


@dataclass(frozen=True)
class Shared:
    """Data of all blocks of a calculation: coupling scheme, representation, blocks of the rotation in stacks, and the frame of all F."""

    scheme: Scheme
    representation: str
    stacks: list[Stack] = field(repr=False, compare=False)
    frame: Frame = field(repr=False, compare=False)
    used: Used | None

    @property
    def axial(self) -> bool:
        """Whether the functions are |N K⟩ instead of Wang functions."""
        return self.stacks[0].k is not None


@dataclass(frozen=True, eq=False)
class SpinFunctions:
    """The functions of a block of one F.

    patterns: all coupling patterns of the F, doubled. columns, number: its parts among those of many blocks. group: blocks of other F
    solved in the same array. twice_row: its row in tables, doubled (`many_f.Frame`). allowed: functions that exchange allows.
    """

    twice_f: int
    patterns: Ints
    columns: PartColumns
    number: int
    shared: Shared
    group: Group
    twice_row: int
    allowed: Allowed | None = None

    @cached_property
    def parts(self) -> tuple[SpinPart, ...]:
        """The parts, made when they are read first."""
        return self.columns.block_parts(self.number)

    @property
    def rotor(self) -> SolvedBlock:
        """The first rotational block."""
        return self.parts[0].rotor

    @property
    def axial_k(self) -> int | None:
        """|K| where K is a good quantum number."""
        return getattr(self.rotor.basis, "axial_k", None)


@dataclass(frozen=True, eq=False)
class Members:
    """Blocks before they are solved.

    names: v, Ka, Kc and pattern of the levels of all blocks, sub-block after sub-block. sizes: number of levels of each sub-block.
    levels, sub_blocks: numbers of both in each block. allowed: functions that exchange of equivalent nuclei allows in each block; empty
    without.
    """

    twice_f: Ints
    parts: PartColumns
    names: Ints
    sizes: Ints
    levels: Ints
    sub_blocks: Ints
    allowed: Sequence[Allowed] = ()

    def alike(self, numbers: Sequence[int]) -> tuple[Ints, Ints]:
        """Names (blocks, levels, columns) and sizes (blocks, sub-blocks) of blocks that have as many of both."""
        blocks: Ints = np.array(numbers, dtype=np.int64)
        names = self.names[self.first_levels[blocks, None] + np.arange(self.levels[blocks[0]])]
        return names, self.sizes[self._first_sub_blocks[blocks, None] + np.arange(self.sub_blocks[blocks[0]])]

    @cached_property
    def first_levels(self) -> Ints:
        """The number of the first level of each block."""
        return np.asarray(np.cumsum(self.levels) - self.levels)

    @cached_property
    def _first_sub_blocks(self) -> Ints:
        """The number of the first sub-block of each block."""
        return np.asarray(np.cumsum(self.sub_blocks) - self.sub_blocks)

    def existing(self, exist: Exist) -> Members:
        """The blocks in which a level exists."""
        exists = np.logical_or.reduceat(exist(self.names), self.first_levels)
        names, sizes = (np.repeat(exists, counts) for counts in (self.levels, self.sub_blocks))
        columns = self.levels[exists], self.sub_blocks[exists], self.allowed
        parts = self.parts.chosen(np.flatnonzero(exists))
        return Members(self.twice_f[exists], parts, self.names[names], self.sizes[sizes], *columns)


class States(NamedTuple):
    """Solved blocks of one size: their numbers, energies (blocks, n), rising, and vectors (blocks, functions, n)."""

    numbers: Sequence[int]
    energies_mhz: Floats
    vectors: Floats


def diagonalised(numbers: Sequence[int], matrices: Floats, zeros_mhz: Floats) -> States:
    """States of blocks of one size from lower triangles (blocks, n, n), from whose diagonals `zeros_mhz` (blocks,) is subtracted."""
    if not np.isfinite(matrices).all():
        raise ValueError("a block of the Hamiltonian overflows: N max is too high for these constants")
    energies, vectors = np.linalg.eigh(matrices)  # reads the lower triangles
    return States(numbers, energies + zeros_mhz[:, None], vectors)


@dataclass(frozen=True)
class Plan:
    """Solved rotation and operators in stacks, each with the channels that share it."""

    scheme: Scheme
    representation: str
    stacks: list[Stack] = field(repr=False)
    blocks: list[SolvedBlock]
    contracted: InStacks = field(repr=False)
    used: Used | None = None

    def shared(self, frame: Frame) -> Shared:
        """The data of all blocks, with the frame of their F."""
        return Shared(self.scheme, self.representation, self.stacks, frame, self.used)

    @cached_property
    def sizes(self) -> list[int]:
        """The number of states of each rotational block."""
        return [len(block.energies_mhz) for block in self.blocks]

    @cached_property
    def families(self) -> list[list[tuple[int, int]]]:
        """Members (block, class) that operators connect; all blocks with three equivalent nuclei, whose exchange divides them later."""
        if self.scheme.equivalent == 3:
            return [[(number, 0) for number in range(len(self.blocks))]]
        return _families(len(self.blocks), _links(self.contracted), max(self.scheme.equivalent, 1))


def contracted_plan(
    top: Top,
    effects: tuple[QuantumEffect, ...],
    nmin: int,
    nmax: int,
    executor: Executor | None,
    exist: Exist | None = None,
) -> Plan:
    """Solve the rotation from N = `nmin` to `nmax` and contract each channel to its eigenstates.

    Functions |N K⟩ for which `exist` (see `levels.levels_of_f`) is false are left out.
    """
    without_internal_rotation(top, "levels with spins in a field")
    terms = valued_terms(top, effects)
    blocks, representation = solved_rotor(top, effects, terms, nmin, nmax, executor, exist)
    return rotor_plan(blocks, representation, scheme_of(top, effects), terms)


def rotor_plan(blocks: list[SolvedBlock], representation: str, scheme: Scheme, terms: Terms) -> Plan:
    """Contract each channel to the eigenstates of a solved rotation, whose N rise."""
    channels = channels_of(terms, scheme)
    hamiltonians = list[Floats]()
    if scheme.equivalent == 3:
        blocks, hamiltonians = in_wang_functions(blocks)
    firsts = _alike(channels)
    distinct = {first: channels[first] for first in firsts.values()}
    reach = 0 if "n" in scheme.conserved else 2
    stacks = stacks_of(blocks)
    by_channel: dict[Channel, list[Contracted]] = {}
    for rank in {channel.rank for channel in distinct}:
        same_rank = [channel for channel in distinct if channel.rank == rank]
        pieces = [distinct[channel] for channel in same_rank]
        by_channel |= zip(same_rank, operators_of_stacks(stacks, min(reach, rank), pieces, representation), strict=True)
    contracted = [(by_channel[c], [other for other, first in firsts.items() if first == c]) for c in distinct]
    if hamiltonians:
        contracted.append(([within_blocks(stack, hamiltonians) for stack in stacks], [ALONE]))
    return Plan(scheme, representation, stacks, blocks, contracted)


def _links(contracted: InStacks) -> Ints:
    """Links (links, 3) of operators in stacks, each with the channels that share it.

    A link is two blocks that an operator connects, and 1 if the operator changes sign with the exchange, else 0.
    """
    links = [np.zeros((0, 3), dtype=np.int64)]
    for operators, channels in contracted:
        changes = {int(channel.exchange < 0) for channel in channels}
        for up, low, pairs, matrices in operators:
            acting = matrices.any(axis=(1, 2))
            first, second = up.numbers[pairs.up][acting], low.numbers[pairs.low][acting]
            links += [np.column_stack([first, second, np.full(len(first), changed)]) for changed in changes]
    return np.concatenate(links)


def _families(count: int, links: Ints, classes: int) -> list[list[tuple[int, int]]]:
    """Families of members (block, class) that links connect, each once, by the lowest one of each.

    classes: number of equivalent spins, or 1. With two each block has functions that are symmetric (0) and antisymmetric (1) under their
    exchange, and an operator that changes sign with the exchange connects the two classes.
    """
    first, second, changed = links.T
    each = np.arange(classes)[:, None]
    numbers = part_numbers(
        count * classes, (first * classes + each).ravel(), (second * classes + (each ^ changed)).ravel()
    )
    families: list[list[tuple[int, int]]] = [[] for _ in range(int(numbers.max(initial=-1)) + 1)]
    for member, number in enumerate(numbers.tolist()):
        families[number].append(divmod(member, classes))
    return families


def _alike(channels: Channels) -> dict[Channel, Channel]:
    """The first channel with the same operators of N for each channel (such as another equivalent nucleus): they share matrices."""
    firsts: dict[Channel, Channel] = {}
    for channel, pieces in channels.items():
        alike = (other for other in firsts.values() if other.rank == channel.rank and channels[other] == pieces)
        firsts[channel] = next(alike, channel)
    return firsts


def blocks_of_f(plan: Plan, patterns: Mapping[int, Ints]) -> tuple[Ints, PartColumns]:
    """Doubled F and parts of each block, by F, then by family; an F whose patterns no rotational block has is left out."""
    f_of_runs, keys_of_runs, first_rows, last_rows = _runs_of_patterns(plan, patterns)
    keys, families, places, blocks = _members_by_n(plan)
    low, high = (np.searchsorted(keys, keys_of_runs, side) for side in ("left", "right"))
    run, member = numbers_in_runs(high - low, low)
    order = np.lexsort((first_rows[run], places[member], families[member], f_of_runs[run]))
    run, member = run[order], member[order]
    family, numbers = families[member], blocks[member]
    first, last, f = first_rows[run], last_rows[run], f_of_runs[run]
    starts_block = np.ones(len(run), dtype=bool)
    starts_block[1:] = (f[1:] != f[:-1]) | (family[1:] != family[:-1])
    begins = np.flatnonzero(starts_block)
    counts = np.diff(np.append(begins, len(run)))
    sizes = (last - first) * np.array(plan.sizes, dtype=np.int64)[numbers]
    stops = np.cumsum(sizes)
    stops -= np.repeat((stops - sizes)[begins], counts)
    return f[begins], PartColumns(plan.blocks, counts, numbers, first, last, stops)


def _members_by_n(plan: Plan) -> tuple[Ints, Ints, Ints, Ints]:
    """Members of families in order of N and class: this as a key (`_key`), family, place in it, and number of the rotational block."""
    families, places = numbers_in_runs(np.array([len(family) for family in plan.families], dtype=np.int64))
    members = np.array([member for family in plan.families for member in family]).reshape(-1, 2)
    keys = _key(np.array([block.j for block in plan.blocks])[members[:, 0]], members[:, 1])
    order = np.argsort(keys, kind="stable")
    return keys[order], families[order], places[order], members[order, 0]


def _runs_of_patterns(plan: Plan, patterns: Mapping[int, Ints]) -> Sequence[Ints]:
    """F, key, first and last row among the patterns of the F, of successive patterns of one N and class."""
    counts = np.array([len(patterns_of_f) for patterns_of_f in patterns.values()], dtype=np.int64)
    if not counts.any():
        return list(np.zeros((4, 0), dtype=np.int64))
    place, row = numbers_in_runs(counts)
    f, rows = np.array(list(patterns))[place], np.concatenate([each for each in patterns.values() if len(each)])
    keys = _key(rows[:, 0] // 2, plan.scheme.classes(rows))
    begins = np.flatnonzero(np.append(True, (f[1:] != f[:-1]) | (keys[1:] != keys[:-1])))
    lengths = np.diff(np.append(begins, len(rows)))
    return f[begins], keys[begins], row[begins], row[begins] + lengths


def _key(n: Ints, symmetry_class: Ints) -> Ints:
    """One number for N and the class of a function of two equivalent spins, 0 or 1."""
    return 2 * n + symmetry_class


def functions_of_blocks(plan: Plan, all_f: Sequence[int]) -> list[SolvedBlock]:
    """Basis functions of the blocks of all F, without vectors: labels and energies are those of the rotational states."""
    table = pattern_table(plan.scheme, all_f[0], all_f[-1])
    shared = plan.shared(frame := frame_of(plan.stacks, table))
    all_twice_f, columns = blocks_of_f(plan, {f: table.patterns[f] for f in all_f if f in table.patterns})
    groups = groups_by_number(groups_of(all_twice_f, columns, frame))
    out = []
    for number, twice_f in enumerate(all_twice_f.tolist()):
        patterns, parts = table.patterns[twice_f], columns.block_parts(number)
        energies = np.concatenate([np.tile(part.rotor.energies_mhz, part.repeats) for part in parts])
        labels = np.concatenate([_labels_of_functions(part, patterns[part.patterns]) for part in parts])
        spins = SpinFunctions(twice_f, patterns, columns, number, shared, *groups[number])
        mixing = np.ones(len(energies))
        out.append(SolvedBlock((), energies, np.zeros((0, 0)), labels=labels, mixing=mixing, spins=spins))
    return out


def _labels_of_functions(part: SpinPart, part_patterns: Ints) -> Ints:
    """Labels of the functions of a part, pattern by pattern."""
    names = named_states(part.rotor, part.rotor.vectors)
    return np.concatenate([np.column_stack([names, np.tile(pattern, (len(names), 1))]) for pattern in part_patterns])
