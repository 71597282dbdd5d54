"""Levels of each F: rotational eigenstates coupled with the spins, one real symmetric matrix for each connected part.

The rotation, with all states v and their interactions, is solved first. Its eigenstates r of N from F - ΣS to F + ΣS, times the coupling
patterns p of each N, are the basis of an F,

    ⟨r' p'|H|r p⟩ = E_r δ + Σ_channels c(p', p) ⟨r'|X|r⟩,

a Kronecker product for each pair of solved blocks. Blocks that no channel connects are solved separately. `parts` labels the levels.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.hyperfine_method import FIRST_ORDER
from rotor.quantum.levels import Block, SolvedBlock, Used
from rotor.quantum.spins.axial import are_axial, contracted_operators
from rotor.quantum.spins.contraction import Contracted, Stack, by_numbers, stacks_of
from rotor.quantum.spins.families import families_of, links_of_stacks
from rotor.quantum.spins.many_f import Frame, Group, frame_of, groups_of
from rotor.quantum.spins.parts import SpinPart, named_states
from rotor.quantum.spins.pattern_tables import pattern_table
from rotor.quantum.spins.rotor import (
    Channel,
    Channels,
    Exist,
    channels_of,
    solved_rotor,
    valued_terms,
)
from rotor.quantum.spins.scheme import Scheme, scheme_of
from rotor.quantum.spins.three_spins import Allowed
from rotor.tops.top import without_internal_rotation

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.tops.top import Top

Operators = dict[tuple[int, int], list[tuple[Floats, list[Channel]]]]
"""Matrices between two blocks of the rotation, each with the channels that share it."""
InStacks = list[tuple[list[Contracted], list[Channel]]]


@dataclass(frozen=True)
class Shared:
    """Data of all blocks of a calculation: coupling scheme, representation, blocks of the rotation in stacks, and a cache of elements."""

    scheme: Scheme
    representation: str
    stacks: list[Stack] = field(repr=False, compare=False)
    cache: dict[Any, Any] = field(default_factory=dict, repr=False, compare=False)
    used: Used | None = None

    @property
    def state_by_state(self) -> bool:
        """Whether spins mix no rotational states (first order)."""
        return self.used is not None and self.used.method == FIRST_ORDER

    @property
    def axial(self) -> bool:
        """Whether the functions are |N K⟩ instead of Wang functions."""
        return are_axial(self.stacks[0].blocks)


@dataclass(frozen=True)
class SpinBlock(Block):
    """States of one F that are solved together: energies (n,) in MHz, rising, and eigenvectors (functions, n) over the parts.

    patterns: all coupling patterns of the F, doubled. labels: (n, columns) v, Ka (K if axial), Kc and the doubled pattern N, J ... F.
    mixing: (n,) weight of the sub-block that labels each state. start: row of the first state. allowed: functions that exchange allows.
    group: blocks of other F solved in the same array.
    """

    with_spins: ClassVar[bool] = True

    twice_f: int
    patterns: Ints
    parts: tuple[SpinPart, ...]
    energies_mhz: Floats
    vectors: Floats
    labels: Ints
    mixing: Floats
    shared: Shared
    group: Group = field(repr=False, compare=False)
    start: int = 0
    allowed: Allowed | None = None

    @property
    def twice_total(self) -> int:
        """2F."""
        return self.twice_f

    @property
    def axial_k(self) -> int | None:
        """|K| where K is a good quantum number."""
        return getattr(self.parts[0].rotor.parts[0].basis, "axial_k", None)

    @property
    def used(self) -> Used | None:
        """Treatment of the spins, the same for all blocks of a calculation."""
        return self.shared.used

    def twice_row(self, frame: Frame) -> int:
        """The doubled row of the block in tables of a frame."""
        return frame.twice_row(self.twice_f, self.parts[0].number)


class Member(NamedTuple):
    """A block before it is solved.

    names: v, Ka, Kc and pattern of the levels, sub-block after sub-block. sizes: number of levels of each sub-block. allowed: functions
    that exchange of equivalent nuclei allows.
    """

    twice_f: int
    parts: tuple[SpinPart, ...]
    names: Ints
    sizes: Ints
    allowed: Allowed | None = None


class States(NamedTuple):
    """Solved blocks of one size: their numbers, energies (blocks, n), rising, vectors (blocks, functions, n), and groups by number."""

    numbers: Sequence[int]
    energies_mhz: Floats
    vectors: Floats
    groups: Mapping[int, Group] = MappingProxyType({})


def diagonalised(
    numbers: Sequence[int], matrices: Floats, zeros_mhz: Floats, groups: Mapping[int, Group] = MappingProxyType({})
) -> States:
    """States of blocks of one size from lower triangles (blocks, n, n), from whose diagonals `zeros_mhz` (blocks,) is subtracted."""
    if not np.isfinite(matrices).all():
        raise ValueError("a block of the Hamiltonian overflows: N max is too high for these constants")
    energies, vectors = np.linalg.eigh(matrices)  # reads the lower triangles
    return States(numbers, energies + zeros_mhz[:, None], vectors, groups)


@dataclass(frozen=True)
class Plan:
    """Solved rotation, operators of each channel, and the blocks that they connect.

    families: members (block, class), see `families`. contracted: operators in stacks, each with the channels that share it.
    replacement: operators by pairs of blocks (i ≥ k) that replace the contracted ones.
    """

    shared: Shared
    blocks: list[SolvedBlock]
    families: list[list[tuple[int, int]]]
    contracted: InStacks = field(repr=False)
    replacement: Operators | None = field(default=None, repr=False)

    @cached_property
    def operators(self) -> Operators:
        """Operators by pairs of blocks (i ≥ k)."""
        if self.replacement is not None:
            return self.replacement
        out: Operators = {}
        for stacked, channels in self.contracted:
            for pair, operator in by_numbers(stacked).items():
                out.setdefault(pair, []).append((operator, channels))
        return out

    @cached_property
    def sizes(self) -> list[int]:
        """The number of states of each rotational block."""
        return [len(block.energies_mhz) for block in self.blocks]

    @cached_property
    def families_at(self) -> dict[tuple[int, int], dict[int, list[tuple[int, int]]]]:
        """By N and class, then by number of the family: (place in the family, block) of its members there."""
        places: dict[tuple[int, int], dict[int, list[tuple[int, int]]]] = {}
        for number, family in enumerate(self.families):
            for at, (i, symmetry_class) in enumerate(family):
                places.setdefault((self.blocks[i].j, symmetry_class), {}).setdefault(number, []).append((at, i))
        return places

    def with_method(self, used: Used, operators: InStacks | None = None) -> Plan:
        """This rotation with the operators of a treatment of the spins (all by default), which `used` describes."""
        shared = replace(self.shared, used=used)
        if operators is None:
            return replace(self, shared=shared)
        families = families_of(len(self.blocks), links_of_stacks(operators), max(shared.scheme.equivalent, 1))
        return Plan(shared, self.blocks, families, operators)


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
    scheme, terms = scheme_of(top, effects), valued_terms(top, effects)
    blocks, representation = solved_rotor(top, effects, terms, nmin, nmax, executor, exist)
    channels = channels_of(terms, scheme)
    firsts = _alike(channels)
    distinct = {first: channels[first] for first in firsts.values()}
    reach = 0 if "n" in scheme.conserved else 2
    stacks = stacks_of(blocks)
    by_channel: dict[Channel, list[Contracted]] = {}
    for rank in {channel.rank for channel in distinct}:
        same_rank = [channel for channel in distinct if channel.rank == rank]
        pieces = [distinct[channel] for channel in same_rank]
        by_channel |= zip(
            same_rank, contracted_operators(stacks, min(reach, rank), pieces, representation), strict=True
        )
    contracted = [(by_channel[c], [other for other, first in firsts.items() if first == c]) for c in distinct]
    families = families_of(len(blocks), links_of_stacks(contracted), max(scheme.equivalent, 1))
    return Plan(Shared(scheme, representation, stacks), blocks, families, contracted)


def _alike(channels: Channels) -> dict[Channel, Channel]:
    """The first channel with the same operators of N for each channel (such as another equivalent nucleus): they share matrices."""
    firsts: dict[Channel, Channel] = {}
    for channel, pieces in channels.items():
        alike = (other for other in firsts.values() if other.rank == channel.rank and channels[other] == pieces)
        firsts[channel] = next(alike, channel)
    return firsts


def parts_of_f(plan: Plan, patterns: Ints) -> Iterator[tuple[SpinPart, ...]]:
    """The parts of each block of an F with these patterns; nothing for an F that N and the spins cannot form."""
    if not len(patterns):
        return
    n, classes = patterns[:, 0] // 2, plan.shared.scheme.classes(patterns)
    bounds = [0, *(np.flatnonzero((n[1:] != n[:-1]) | (classes[1:] != classes[:-1])) + 1).tolist(), len(patterns)]
    families: dict[int, list[tuple[int, int, int, int]]] = {}
    for a, b in pairwise(bounds):
        for number, members in plan.families_at.get((int(n[a]), int(classes[a])), {}).items():
            families.setdefault(number, []).extend([(at, i, a, b) for at, i in members])
    for number in sorted(families):
        yield _parts(plan, sorted(families[number]))


def functions_of_blocks(plan: Plan, all_f: Sequence[int]) -> list[SpinBlock]:
    """Basis functions of the blocks of all F, without vectors: labels and energies are those of the rotational states."""
    table = pattern_table(plan.shared.scheme, all_f[0], all_f[-1])
    frame = plan.shared.cache["frame"] = frame_of(plan.shared.stacks, table)
    members = [(f, parts) for f in all_f if f in table.patterns for parts in parts_of_f(plan, table.patterns[f])]
    groups = {number: group for group, numbers in groups_of(members, frame) for number in numbers}
    out = []
    for number, (twice_f, parts) in enumerate(members):
        patterns = table.patterns[twice_f]
        energies = np.concatenate([np.tile(part.rotor.energies_mhz, part.repeats) for part in parts])
        labels = np.concatenate([_labels_of_functions(part, patterns[part.patterns]) for part in parts])
        results = energies, np.zeros((0, 0)), labels, np.ones(len(energies))
        out.append(SpinBlock(twice_f, patterns, parts, *results, plan.shared, groups[number]))
    return out


def _labels_of_functions(part: SpinPart, part_patterns: Ints) -> Ints:
    """Labels of the functions of a part, pattern by pattern."""
    names = named_states(part.rotor, part.rotor.vectors)
    return np.concatenate([np.column_stack([names, np.tile(pattern, (len(names), 1))]) for pattern in part_patterns])


def _parts(plan: Plan, members: list[tuple[int, int, int, int]]) -> tuple[SpinPart, ...]:
    """The parts of one block, one after another; members: place in the family, rotational block, first and last row of its patterns."""
    parts, start, blocks, sizes = [], 0, plan.blocks, plan.sizes
    for _, i, first, last in members:
        stop = start + (last - first) * sizes[i]
        parts.append(SpinPart(i, blocks[i], slice(first, last), slice(start, stop)))
        start = stop
    return tuple(parts)
