"""Block number and place of levels, as in the first two columns of SPCAT's .egy file.

Functions stand in sub-blocks of one state v, one species of the Wang functions and one coupling pattern of the spins, those of a
species that has a weight. Sub-blocks that some parameter connects make a block of every F; blocks are numbered by their first
sub-block, in order of v, species and pattern, and go on from F to F:

    block = (number of blocks) · (F, rounded up) + place of the block,      place of a level = functions before it + 1

In a block sub-blocks stand in order of pattern, v, species, each with its K rising; a level has the place of the function that it is
called after. Species 0 to 3 are A, Bx, By, Bz, with x, y, z = c, b, a, or a, b, c where NVIB is negative. Found by comparison with the
program's .out and .egy files.

Not known here: l-doubled states and total spins of equivalent nuclei. Their levels count by F and energy, 9999 to a block.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from rotor.arrays import Ints
from rotor.formats.spcat.file_model import Group
from rotor.formats.spcat.file_quanta import pattern_numbers, pattern_steps
from rotor.formats.spcat.hamiltonian.code_table import TURNS, Digits, Kind, file_codes
from rotor.formats.spcat.hamiltonian.states import SPECIES, StateOptions, species_numbers
from rotor.formats.spcat.text.par import ParameterFile
from rotor.frozen import dataclass
from rotor.quantum.blocks.connected import part_numbers
from rotor.quantum.levels import Levels


class SubBlock(NamedTuple):
    """State, species and coupling pattern; sub-blocks are ordered as in SPCAT."""

    v: int
    species: int
    pattern: int


@dataclass(frozen=True)
class Blocks:
    """The sub-blocks of each block; by state, the range of K, the doubled spins, and 2(N - F), 2(J - F), ... of the patterns."""

    members: tuple[tuple[SubBlock, ...], ...]
    limits: dict[int, tuple[int, int]]
    spins: dict[int, tuple[int, ...]]
    rises: dict[int, Ints]

    def numbers(self, group: Group, levels: Levels, rows: Ints, negative: bool) -> tuple[Ints, Ints]:
        """Block and place of rows of the levels of a group, as in the first two columns of an .egy file.

        negative: for a symmetric top, of the component -K.
        """
        every, k = _sub_blocks(group, levels, negative)
        subs, twice_f = [every[i] for i in rows], (levels.multiplicity[rows] - 1).astype(np.int64).tolist()
        starts = {f: self._starts(f) for f in sorted(set(twice_f))}
        block, rank = list[int](), list[int]()
        for sub, n_of_level, k_of_level, f in zip(
            subs, levels.rotational[rows].tolist(), k[rows].tolist(), twice_f, strict=True
        ):
            place, before = starts[f][sub]
            block.append(len(self.members) * ((f + 1) // 2) + place + 1)
            rank.append(before + (k_of_level - self._least_k(sub, n_of_level)) // 2 + 1)
        return np.array(block, dtype=np.int64), np.array(rank, dtype=np.int64)

    def _starts(self, twice_f: int) -> dict[SubBlock, tuple[int, int]]:
        """The block of each sub-block of one F, and the number of functions before it in the block."""
        starts = {}
        for place, block in enumerate(self.members):
            before = 0
            for sub in block:
                starts[sub] = place, before
                before += self._size(sub, twice_f)
        return starts

    def _size(self, sub: SubBlock, twice_f: int) -> int:
        """Number of functions of a sub-block at one F; 0 if its pattern does not exist there."""
        steps = self.rises[sub.v][sub.pattern]
        sums = twice_f + steps
        if (sums < 0).any() or (
            sums[:-1] + sums[1:] < self.spins[sub.v]
        ).any():  # two sums and the spin form no triangle
            return 0
        n = int(sums[0]) // 2
        return max((min(self.limits[sub.v][1], n) - self._least_k(sub, n)) // 2 + 1, 0)

    def _least_k(self, sub: SubBlock, n: int) -> int:
        """The smallest K of a sub-block at one N."""
        return _least_k(sub.species if n % 2 == 0 else 3 - sub.species, self.limits[sub.v][0])


def _least_k(species: int, first: int) -> int:
    """The smallest K ≥ `first` of the functions of a species at even N."""
    least = (0, 1, 1, 2)[species]  # least K of the species in Wang functions: 0 for E+, 1 for O±, 2 for E-
    # KNMIN of the other parity of K begins one higher
    return least if least >= first else first + (first - least) % 2


def numbered_blocks(file: ParameterFile, groups: Sequence[Group]) -> Blocks | None:
    """The blocks of a file; None for cases that are not supported (see the head of this module)."""
    states = {state.number: state for group in groups for state in group.states}
    if any(state.equivalent or state.l_code for state in states.values()):
        return None
    oblate = file.options[0].oblate
    rises = {v: _rises(state.spins) for v, state in states.items()}
    subs = [
        SubBlock(v, species, pattern)
        for v in sorted(states)
        for species in range(4)
        if _exists(states[v], species, oblate)
        for pattern in range(len(rises[v]))
    ]
    reaches = {_reach(d, oblate) for d in file_codes(file) if not d.is_constant}
    weights = [_weight(states[sub.v], sub.species, oblate) for sub in subs]
    parts = _connected(subs, weights, [rises[sub.v][sub.pattern] for sub in subs], reaches, file.options[0].ixx)
    members = [
        [sub for sub, part in zip(subs, parts, strict=True) if part == number] for number in range(max(parts) + 1)
    ]
    ordered = tuple(tuple(sorted(block, key=lambda s: (s.pattern, s.v, s.species))) for block in members)
    limits = {v: (state.kmin, state.kmax) for v, state in states.items()}
    return Blocks(ordered, limits, {v: state.spins for v, state in states.items()}, rises)


def _rises(spins: tuple[int, ...]) -> Ints:
    """2(N - F), 2(J - F), ... 0 of all coupling patterns, (patterns, spins + 1)."""
    if not spins:
        return np.zeros((1, 1), dtype=np.int64)
    steps = pattern_steps(spins)
    ups = 2 * steps[:, 1:] - np.array(spins)
    return np.concatenate([steps[:, :1], steps[:, :1] + np.cumsum(ups, axis=1)], axis=1)


# species alternate with N, so that a state exists for either
def _exists(state: StateOptions, species: int, oblate: bool) -> bool:
    """Whether SPCAT forms sub-blocks of a species: K in its range for even or odd N, and a weight."""
    least = min(_least_k(parity_species, state.kmin) for parity_species in (species, 3 - species))
    return state.kmax >= least and _weight(state, species, oblate)[0] > 0


def _weight(state: StateOptions, species: int, oblate: bool) -> tuple[int, ...]:
    """The weights that must agree between connected sub-blocks; the first is above 0 if the sub-block exists."""
    along, other = (np.array([parity]) for parity in SPECIES[species])
    ka, kc = (other, along) if oblate else (along, other)
    if state.fold < 3:
        return (int(state.weights(ka, kc, along)[0]),)
    if state.fold == 3:
        return int(state.class_weight(ka, kc)[0]), state.e_weight, state.fold
    a, e = state.block_weights(ka, kc, along)[0].tolist()
    return max(a, e), a, e, state.fold


class _Reach(NamedTuple):
    """Sub-blocks that a parameter connects: states, change of species, and largest doubled change of each sum of angular momenta."""

    states: tuple[int, int] | None
    species: int
    ranks: tuple[int, ...]


def _reach(d: Digits, oblate: bool) -> _Reach:
    """The sub-blocks that a code connects; sums of angular momenta change up to the last coupled of the acting spins."""
    species = int(species_numbers(*TURNS[d.symmetry(oblate).axis], oblate))
    spins = (1,) if d.projects_spin else tuple(sorted(d.spins))
    if not spins:
        return _Reach(d.states, species, ())
    rotational_rank = 0 if d.kind is Kind.SCALAR and not d.projects_spin else 1 if len(spins) == 1 else 2
    ranks = (*([2 * rotational_rank] * spins[0]), *([2] * (spins[-1] - spins[0])))
    return _Reach(d.states, species, ranks)


_UNLIKE = 10_000  # stands for sums of angular momenta that a state does not have


def _connected(
    subs: Sequence[SubBlock],
    weights: Sequence[tuple[int, ...]],
    rises: Sequence[Ints],
    reaches: Iterable[_Reach],
    ixx: int,
) -> Ints:
    """For each sub-block the number of its connected component; weights must agree, and sums that IXX conserves do not change.

    subs: in order of v.
    """
    v, species, _ = np.array(subs).T
    width = max(len(each) for each in rises)
    # int16: pairs of sub-blocks are many
    sums = np.array([[*each, *[_UNLIKE] * (width - len(each))] for each in rises], dtype=np.int16)
    alike = np.array([weights.index(weight) for weight in weights])
    low, high = np.triu_indices(len(subs), 1)
    change, held = np.abs(sums[low] - sums[high]), ixx >> np.arange(width) & 1 == 1
    free = (alike[low] == alike[high]) & ~change[:, held].any(axis=1)
    linked = np.zeros(len(low), dtype=bool)
    for reach in reaches:
        first, second = reach.states or (v[high], v[low])  # sub-blocks rise in v
        both = (v[low] == first) & (v[high] == second)
        ranks = [*reach.ranks, *[0] * width][:width]
        linked |= both & (species[low] ^ species[high] == reach.species) & (change <= ranks).all(axis=1)
    return part_numbers(len(subs), low[linked & free], high[linked & free])


def _sub_blocks(group: Group, levels: Levels, negative: bool) -> tuple[list[SubBlock], Ints]:
    """Sub-block and |K| of each level of a group; negative: for a symmetric top, of the component -K."""
    quanta, n = levels.quanta, levels.rotational
    v, k, names = group.numbers(levels), group.basis_k(levels), group.spin_names(levels)
    if "kc" in quanta:
        species = species_numbers(quanta["ka"], quanta["kc"], group.oblate)
    else:
        species = np.where(k % 2, 1 if negative else 2, 3 if negative else 0)
        species = np.where(k == 0, 3 * (n % 2), species)  # K = 0 has one function, even or odd as N
    pattern = pattern_numbers(group, levels, names) if names else np.zeros(len(n), dtype=np.int64)
    return [SubBlock(*row) for row in zip(v.tolist(), species.tolist(), pattern.tolist(), strict=True)], k
