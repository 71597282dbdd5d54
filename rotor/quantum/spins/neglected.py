"""Bounds of the shifts of levels with spins by elements that a simpler method leaves out, one for each rotational state.

The spins split a rotational state r to first order into levels between low_r and high_r. An element of norm V between two states whose
levels are at least Δ apart shifts a level by at most

    2V² / [Δ + √(Δ² + 4V²)]        (C.-K. Li and R.-C. Li, Linear Algebra Appl. 395, 183 (2005))

as for two levels (the formula stands in the abstract of arXiv:2508.08203, the same paper). V is the sum of |⟨r'|X|r⟩| ‖c‖ over the
channels, with ‖c‖ of `coupling_alone`; Δ, V and the bound hold for all F together. The shifts by all other states are added. In a second
pass, Δ is reduced by the shifts of the two states by third ones. States of one N that the spins mix share the shifts by other N; their
cross term is added in proportion to the mixing. The bound is not strict where three states are mixed strongly; it held in all of 370
random molecules.

A channel acts on N and on one or two spins, and leaves the others unchanged. Its coefficients c between the patterns of N' and N therefore
have the same norm over all F as with those spins alone over all sums J of N and the spins, and their eigenvalues within one N have the same
limits. With one spin they are numbers by J. With two spins the norm is bounded by ‖c‖₂² ≤ ‖c‖₁ ‖c‖∞ (largest sums of columns and of rows),
and the eigenvalues by Gershgorin circles.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.spins.blocks import Plan
from rotor.quantum.spins.pattern_tables import couplings_by_f, pattern_table
from rotor.quantum.spins.rotor import Channel
from rotor.quantum.spins.scheme import Scheme, Spin

# difference of eigenvalues from two methods, relative to the highest energy
_ROUND_OFF = 4 * float(np.finfo(float).eps)
_AT_ONCE = 100_000  # elements in one array; intermediate arrays then fit the processor's cache
_TINY = float(np.finfo(float).tiny)


class _Matrices(NamedTuple):
    """Operators between pairs of blocks.

    up, low: numbers of the blocks, (pairs,). acting: matrices (pairs, states', states), each with the channels that share it.
    """

    up: Ints
    low: Ints
    acting: list[tuple[Floats, list[Channel]]]


class _States(NamedTuple):
    """All rotational states: N, and the lowest and highest first-order level in MHz, (n,) each."""

    n: Ints
    low: Floats
    high: Floats


class _Elements(NamedTuple):
    """Pairs of states and the norm (MHz) of the elements that connect them, (elements,) each."""

    up: Ints
    low: Ints
    norm: Floats


def largest_shifts(plan: Plan) -> tuple[float, float]:
    """The largest shift of a level (MHz) by elements between different N, and between different states of one N.

    The first includes the round-off of the highest energy.
    """
    sizes = np.array([len(block.energies_mhz) for block in plan.blocks], dtype=np.int64)
    starts = np.cumsum(sizes) - sizes
    n = np.array([block.j for block in plan.blocks], dtype=np.int64)
    highest = int(n.max(initial=0))
    acting = {channel for _, _, matrices in _matrices(plan) for _, channels in matrices for channel in channels}
    alone = {channel: coupling_alone(plan.scheme, channel, highest) for channel in acting}
    states = _states(plan, n, starts, alone)
    elements = [_elements(matrices, n, starts, alone) for matrices in _matrices(plan)]
    other_n, same_n = _shifts(states, [*_together(states, elements)])
    energy = max((float(np.abs(block.energies_mhz).max(initial=0.0)) for block in plan.blocks), default=0.0)
    return float(other_n.max(initial=0.0)) + _ROUND_OFF * energy, float(same_n.max(initial=0.0))


def _matrices(plan: Plan) -> Iterator[_Matrices]:
    """Each pair of blocks once; pairs of two stacks come together."""
    by_stacks: dict[tuple[int, int, int], _Matrices] = {}
    for contracted, channels in plan.contracted:
        for up, low, pairs, matrices in contracted:
            numbers = up.numbers[pairs.up], low.numbers[pairs.low]
            key = (int(up.numbers[0]), int(low.numbers[0]), pairs.rise)
            by_stacks.setdefault(key, _Matrices(*numbers, [])).acting.append((matrices, channels))
    yield from by_stacks.values()


def _states(plan: Plan, n: Ints, starts: Ints, alone: dict[Channel, Alone]) -> _States:
    """First-order limits of all rotational states."""
    energies = np.concatenate([block.energies_mhz for block in plan.blocks])
    low, high = energies.copy(), energies.copy()
    for up, other, acting in _matrices(plan):
        if up[0] != other[0]:
            continue
        for matrices, channels in acting:
            diagonal = np.einsum("pss->ps", matrices)
            rows, columns = np.nonzero(diagonal)
            value, place = diagonal[rows, columns], starts[up[rows]] + columns
            for channel in channels:
                ends = value * alone[channel].lowest[n[up[rows]]], value * alone[channel].highest[n[up[rows]]]
                low[place] += np.minimum(*ends)
                high[place] += np.maximum(*ends)
    return _States(np.repeat(n, [len(block.energies_mhz) for block in plan.blocks]), low, high)


def _elements(operators: _Matrices, n: Ints, starts: Ints, alone: dict[Channel, Alone]) -> _Elements:
    """The elements between different states, each once."""
    n_pairs = n[operators.up], n[operators.low]
    total = np.zeros(())
    for matrices, channels in operators.acting:
        norms = sum((alone[channel].norm[n_pairs] for channel in channels), np.zeros(len(operators.up)))
        total = total + np.abs(matrices) * norms[:, None, None]
    if operators.up[0] == operators.low[0]:
        total = np.tril(total, -1)
    pair, row, column = np.nonzero(total)
    return _Elements(starts[operators.up[pair]] + row, starts[operators.low[pair]] + column, total[pair, row, column])


def _together(states: _States, elements: list[_Elements]) -> Iterator[_Elements]:
    """The elements in few arrays, each either within one N or between different N."""
    for same in (False, True):
        batch: list[_Elements] = []
        for part in (part for part in elements if len(part.norm) and _is_same(states, part) == same):
            batch.append(part)
            if sum(len(member.norm) for member in batch) > _AT_ONCE:
                yield _Elements(*map(np.concatenate, zip(*batch, strict=True)))
                batch = []
        if batch:
            yield _Elements(*map(np.concatenate, zip(*batch, strict=True)))


def _shifts(states: _States, elements: list[_Elements]) -> tuple[Floats, Floats]:
    """Bounds (n,) in MHz of the shift of each state: by other N, and by other states of its N."""
    count = len(states.n)
    total, same_n, other_n, mixed = np.zeros((4, count))
    for pairs in elements:
        _add(total, pairs, _two_level_shift(_apart(states, pairs), pairs.norm))
    second = []
    for pairs in elements:
        apart = _apart(states, pairs)
        pair_shifts = _two_level_shift(apart, pairs.norm)
        third = total[pairs.up] + total[pairs.low] - 2 * pair_shifts
        apart = np.maximum(apart - third, 0.0)
        _add(same_n if _is_same(states, pairs) else other_n, pairs, _two_level_shift(apart, pairs.norm))
        second.append(apart)
    root = np.sqrt(other_n)
    for pairs, apart in zip(elements, second, strict=True):
        if _is_same(states, pairs):
            mixing = 2 * pairs.norm / (np.sqrt(apart**2 + 4 * pairs.norm**2) + _TINY)
            mixed += np.bincount(pairs.up, mixing * root[pairs.low], count)
            mixed += np.bincount(pairs.low, mixing * root[pairs.up], count)
    return other_n + root * mixed, same_n


def _is_same(states: _States, pairs: _Elements) -> bool:
    """Whether the elements connect states of one N; all elements of two stacks have the same difference of N."""
    return bool(states.n[pairs.up[0]] == states.n[pairs.low[0]])


def _apart(states: _States, pairs: _Elements) -> Floats:
    """Smallest distances (MHz) between the first-order levels of both states."""
    up, low = pairs.up, pairs.low
    return np.maximum(np.maximum(states.low[up] - states.high[low], states.low[low] - states.high[up]), 0.0)


def _add(sums: Floats, pairs: _Elements, shifts: Floats) -> None:
    """Add the shift of each pair to both of its states."""
    sums += np.bincount(pairs.up, shifts, len(sums)) + np.bincount(pairs.low, shifts, len(sums))


def _two_level_shift(apart: Floats, norm: Floats) -> Floats:
    """Bound of the shift of two levels by an element between them."""
    return np.asarray(2 * norm**2 / (np.sqrt(apart**2 + 4 * norm**2) + apart + _TINY))


class Alone(NamedTuple):
    """Bounds of the coefficients of a channel: norm (N', N), lowest and highest eigenvalue (N,)."""

    norm: Floats
    lowest: Floats
    highest: Floats


def coupling_alone(scheme: Scheme, channel: Channel, highest_n: int) -> Alone:
    """Bounds of the coefficients of a channel for all F and N up to `highest_n`.

    For ½(X ± X'), with two equivalent spins exchanged in X', the norm is at most that of X. Eigenvalues of ½(X + X') have the limits of X;
    those of ½(X - X') lie within ± half the distance of these limits.
    """
    places = sorted({*channel.acting, *([0] if channel.ns else [])})
    acting = tuple(places.index(place) for place in channel.acting)
    twice = tuple(scheme.twice[place] for place in places)
    bounds = _alone(twice, channel._replace(acting=acting, exchange=0), highest_n)
    if channel.exchange >= 0:
        return bounds
    half = (bounds.highest - bounds.lowest) / 2
    return Alone(bounds.norm, -half, half)


@lru_cache(maxsize=64)
def _alone(twice: tuple[int, ...], channel: Channel, highest_n: int) -> Alone:
    """Bounds with the acting spins only; read-only."""
    scheme = Scheme(tuple(Spin(str(place), size) for place, size in enumerate(twice)))
    limits = scheme.total % 2, 2 * highest_n + scheme.total
    table, by_j = pattern_table(scheme, *limits), couplings_by_f(scheme, channel, *limits)
    norm = np.zeros((highest_n + 1, highest_n + 1))
    ends = np.full((2, highest_n + 1), -np.inf)
    for (j, all_patterns), of_j in zip(table.patterns.items(), by_j, strict=True):
        n_of_pattern = all_patterns[all_patterns[:, 0] <= 2 * highest_n, 0] // 2
        if not len(n_of_pattern):
            continue
        chosen = table.places[j][: len(n_of_pattern)]  # N rises
        values = of_j[np.ix_(chosen, chosen)]
        n, starts = np.unique(n_of_pattern, return_index=True)
        size, inside = np.abs(values), np.ix_(n, n)
        rows = np.maximum.reduceat(np.add.reduceat(size, starts, axis=1), starts, axis=0)
        columns = np.maximum.reduceat(np.add.reduceat(size, starts, axis=0), starts, axis=1)
        norm[inside] = np.maximum(norm[inside], np.sqrt(rows * columns))
        diagonal, places = np.diag(values), np.searchsorted(n, n_of_pattern)
        radius = np.add.reduceat(size, starts, axis=1)[np.arange(len(values)), places] - np.abs(diagonal)
        circles = np.array([radius - diagonal, radius + diagonal])
        ends[:, n] = np.maximum(ends[:, n], np.maximum.reduceat(circles, starts, axis=1))
    for array in (norm, ends):
        array.flags.writeable = False
    return Alone(norm, -ends[0], ends[1])
