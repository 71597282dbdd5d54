"""Levels of each F: rotational eigenstates coupled with the spins, one real symmetric matrix for each connected part.

The rotation, with all states v and what connects them, is solved first. Its eigenstates r of every N from F - ΣS to F + ΣS,
times the coupling patterns p of that N, are the basis of an F,

    ⟨r' p'|H|r p⟩ = E_r δ + Σ_channels c(p', p) ⟨r'|X|r⟩,

a Kronecker product for each pair of solved blocks. Blocks that no channel connects are solved apart.

A level is named after a Wang block of one state and one pattern: the names are given one to one, the largest share first, and
among the levels of one name Ka rises with energy.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.basis import ka_kc
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.levels import Levels, weights_of_levels
from rotor.quantum.spin_coupling import coefficients, n_dot_s, patterns
from rotor.quantum.spin_rotor import (
    Channel,
    Channels,
    Contracted,
    RotorBlock,
    channels_of,
    contracted,
    rotor_blocks,
    valued_terms,
)
from rotor.quantum.spins import Scheme, scheme_of

if TYPE_CHECKING:
    from rotor.tops.top import Top


class SpinPart(NamedTuple):
    """The states of one solved block of N with every pattern (p, 1 + spins) of its N, at `start` ...: pattern by pattern."""

    rotor: RotorBlock
    patterns: Ints
    start: int

    @property
    def size(self) -> int:
        """Number of functions."""
        return len(self.patterns) * len(self.rotor.energies_mhz)

    @property
    def place(self) -> slice:
        """Where they stand in the block."""
        return slice(self.start, self.start + self.size)


@dataclass(frozen=True)
class SpinBlock:
    """States of one F solved together: energies (n,) in MHz, rising, and eigenvectors (functions, n) over the parts.

    f: twice F. labels: (n, columns) v, Ka, Kc, then the doubled pattern N, J ... F of every state. mixing: (n,) the share of the
    functions that name it. start: row of the first state.
    """

    f: int
    parts: tuple[SpinPart, ...]
    energies_mhz: Floats
    vectors: Floats
    labels: Ints
    mixing: Floats
    start: int = 0


class Plan(NamedTuple):
    """What all F share: the scheme of spins, solved rotation, channels, contracted operators by pairs of blocks, connected families."""

    scheme: Scheme
    blocks: list[RotorBlock]
    channels: Channels
    operators: dict[tuple[int, int], Contracted]
    families: list[list[int]]


def plan_of(top: Top, effects: tuple[QuantumEffect, ...], nmin: int, nmax: int, executor: Executor | None) -> Plan:
    """The rotation solved from N = `nmin` to `nmax`, and every channel contracted to it."""
    from rotor.quantum.solve import solve_rotation

    scheme = scheme_of(top, effects)
    rotation = solve_rotation(top, effects, nmin, nmax, True, executor, in_blocks=True)
    blocks = rotor_blocks(rotation)
    channels = channels_of(valued_terms(top, effects), scheme)
    representation = str(rotation.representation)
    operators = {
        pair: found
        for pair in _near(blocks)
        if (found := _operators(blocks[pair[0]], blocks[pair[1]], channels, representation, pair[0] == pair[1]))
    }
    return Plan(scheme, blocks, channels, operators, _families(len(blocks), operators))


def _near(blocks: list[RotorBlock]) -> Iterable[tuple[int, int]]:
    """Pairs (i, k), i ≥ k, whose N differ by 2 at most."""
    by_n: dict[int, list[int]] = {}
    for i, block in enumerate(blocks):
        by_n.setdefault(block.n, []).append(i)
    return (
        (i, k) for i, block in enumerate(blocks) for n in range(block.n - 2, block.n + 1) for k in by_n.get(n, []) if k <= i
    )


def _operators(up: RotorBlock, low: RotorBlock, channels: Channels, representation: str, same: bool) -> Contracted:
    """Σ c ⟨r'|X|r⟩ of every channel that acts, of both orders of two states: c(p', p) = (-1)^(N'-N) c(p, p')."""
    out: Contracted = {}
    for channel, pieces in channels.items():
        if abs(up.n - low.n) > channel.rank:
            continue
        found = contracted(up, low, pieces, representation)
        between = [piece for piece in pieces if piece.bra != piece.ket]
        back = contracted(low, up, between, representation) if between else None
        if back is not None:
            turned = (-1.0) ** (up.n - low.n) * back.T
            found = turned if found is None else found + turned
        if found is not None:
            out[channel] = found
    return out


def _families(count: int, pairs: Iterable[tuple[int, int]]) -> list[list[int]]:
    """Blocks that pairs connect, each family in rising order."""
    group = list(range(count))

    def root(i: int) -> int:
        while group[i] != i:
            group[i] = group[group[i]]
            i = group[i]
        return i

    for i, k in pairs:
        low, high = sorted((root(i), root(k)))
        group[high] = low
    roots = [root(i) for i in range(count)]
    members: dict[int, list[int]] = {}
    for i, r in enumerate(roots):
        members.setdefault(r, []).append(i)
    return list(members.values())


def solve_f(plan: Plan, f: int) -> list[SpinBlock]:
    """The blocks of one F (doubled)."""
    every = patterns(plan.scheme.twice, f)
    by_n = {int(n): every[every[:, 0] == 2 * n] for n in np.unique(every[:, 0]) // 2}
    cache: dict[tuple[Channel, int, int], Floats] = {}
    out = []
    for family in plan.families:
        members = [i for i in family if plan.blocks[i].n in by_n]
        if members:
            out.append(_solved(plan, f, members, by_n, cache))
    return out


def _solved(
    plan: Plan, f: int, members: list[int], by_n: dict[int, Ints], cache: dict[tuple[Channel, int, int], Floats]
) -> SpinBlock:
    sizes = [len(by_n[plan.blocks[i].n]) * len(plan.blocks[i].energies_mhz) for i in members]
    starts = np.cumsum([0, *sizes])
    parts = tuple(
        SpinPart(plan.blocks[i], by_n[plan.blocks[i].n], int(start)) for i, start in zip(members, starts, strict=False)
    )
    zero = float(parts[0].rotor.energies_mhz[0])  # taken out of the matrix for the sake of digits
    matrix = np.diag(
        np.concatenate([np.tile(part.rotor.energies_mhz - zero, len(part.patterns)) for part in parts])
    )
    for a, i in enumerate(members):
        for b, k in enumerate(members[: a + 1]):
            for channel, operator in plan.operators.get((i, k), {}).items():
                c = _coefficients(plan.scheme, channel, parts[a].patterns, parts[b].patterns, cache)
                matrix[parts[a].place, parts[b].place] += np.kron(c, operator)
    energies, vectors = np.linalg.eigh(matrix)  # of the lower triangle
    labels, mixing = _labels(parts, vectors)
    return SpinBlock(f, parts, energies + zero, vectors, labels, mixing)


def _coefficients(
    scheme: Scheme, channel: Channel, bra: Ints, ket: Ints, cache: dict[tuple[Channel, int, int], Floats]
) -> Floats:
    key = (channel, int(bra[0, 0]), int(ket[0, 0]))
    if key not in cache:
        found = coefficients(scheme.twice, channel.acting, channel.rank, bra, ket)
        if channel.ns:
            values = [
                (p[:, 0] * (p[:, 0] + 2.0) / 4) ** channel.n2 * n_dot_s(p, scheme.twice[0]) ** channel.ns
                for p in (bra, ket)
            ]
            found = found * (values[0][:, None] + values[1]) / 2
        cache[key] = found
    return cache[key]


def _labels(parts: tuple[SpinPart, ...], vectors: Floats) -> tuple[Ints, Floats]:
    """Names (n, 3 + pattern) of the states of a block, energies rising, and the shares of the functions that give them."""
    shares, capacity, names = [], [], []
    for part in parts:
        states = len(part.rotor.energies_mhz)
        for number, pattern in enumerate(part.patterns):
            rows = vectors[part.start + number * states : part.start + (number + 1) * states]
            for own in part.rotor.parts:
                inside = rows if len(part.rotor.parts) == 1 else part.rotor.vectors[own.place] @ rows
                shares.append((inside**2).sum(axis=0))
                capacity.append(own.basis.size)
                ka, kc = ka_kc(own.basis.j, own.basis.species, own.basis.size)
                names.append([(own.v, a, c, *pattern.tolist()) for a, c in zip(ka, kc, strict=True)])
    table = np.array(shares)
    of_state = assigned(table, np.array(capacity))
    labels = np.empty((vectors.shape[1], 3 + parts[0].patterns.shape[1]), dtype=np.int64)
    for sub, own_names in enumerate(names):
        labels[of_state == sub] = own_names
    return labels, np.asarray(table[of_state, np.arange(len(of_state))])


def assigned(shares: Floats, capacity: Ints) -> Ints:
    """Which sub-block names each state: shares (sub-blocks, states), the largest first, none beyond its capacity.

    >>> assigned(np.array([[0.9, 0.6, 0.0], [0.1, 0.4, 1.0]]), np.array([1, 2])).tolist()
    [0, 1, 1]
    """
    found = shares.argmax(axis=0)
    if (np.bincount(found, minlength=len(capacity)) == capacity).all():
        return np.asarray(found)
    found, left = np.full(shares.shape[1], -1), capacity.copy()
    for place in np.argsort(-shares, axis=None, kind="stable").tolist():
        sub, state = divmod(place, shares.shape[1])
        if found[state] < 0 and left[sub]:
            found[state], left[sub] = sub, left[sub] - 1
    return found


def levels_of_f(
    top: Top,
    effects: tuple[QuantumEffect, ...],
    every_f: Sequence[int],
    n_range: tuple[int, int] | None = None,
    executor: Executor | None = None,
) -> Levels:
    """The levels of all F (doubled) in `every_f`, those whose label has N within `n_range`, if that is given."""
    scheme = scheme_of(top, effects)
    lowest = min(max(0, (f - scheme.total) // 2) for f in every_f)
    highest = max((f + scheme.total) // 2 for f in every_f)
    plan = plan_of(top, effects, lowest, highest, executor)
    solved = [block for f in every_f for block in solve_f(plan, f)]
    if n_range:
        solved = [_within(block, n_range) for block in solved]
    return _table(top, effects, scheme, tuple(_placed(solved)), highest if n_range is None else n_range[1])


def _within(block: SpinBlock, n_range: tuple[int, int]) -> SpinBlock:
    n = block.labels[:, 3] // 2
    kept = (n >= n_range[0]) & (n <= n_range[1])
    return replace(
        block,
        energies_mhz=block.energies_mhz[kept],
        vectors=block.vectors[:, kept],
        labels=block.labels[kept],
        mixing=block.mixing[kept],
    )


def _placed(blocks: Iterable[SpinBlock]) -> Iterable[SpinBlock]:
    start = 0
    for block in blocks:
        if len(block.energies_mhz):
            yield replace(block, start=start)
            start += len(block.energies_mhz)


def _table(
    top: Top, effects: tuple[QuantumEffect, ...], scheme: Scheme, blocks: tuple[SpinBlock, ...], jmax: int
) -> Levels:
    labels = np.concatenate([block.labels for block in blocks])
    quanta = {"v": labels[:, 0]} if any(effect.states(top) for effect in effects) else {}
    quanta |= {"n": labels[:, 3] // 2}
    if top.kind != "linear":
        quanta |= {"ka": labels[:, 1], "kc": labels[:, 2]}
    for column, (name, half) in enumerate(zip(scheme.names, scheme.half, strict=True), 4):
        quanta[name] = labels[:, column] if half else labels[:, column] // 2
    ones = np.ones(len(labels), dtype=np.int64)
    levels = Levels(
        kind=top.kind,
        representation=None,
        jmax=jmax,
        energy_mhz=np.concatenate([block.energies_mhz for block in blocks]),
        quanta=quanta,
        multiplicity=labels[:, -1] + 1,
        components=ones,
        weight=ones,
        halves=frozenset(name for name, half in zip(scheme.names, scheme.half, strict=True) if half),
        effects=effects,
        blocks=blocks,
        mixing=np.concatenate([block.mixing for block in blocks]),
    )
    return replace(levels, weight=weights_of_levels(levels, top.spin_weights))


def derivatives(top: Top, levels: Levels, names: Sequence[str], rows: Ints) -> Floats:
    """∂E/∂c of levels with spins."""
    raise NotImplementedError
