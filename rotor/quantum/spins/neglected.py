"""By how much levels with spins may shift by elements that a simpler method leaves out: one bound for every rotational state.

The spins split a rotational state r to first order into levels between low_r and high_r. An element of norm V between two states whose
levels are Δ apart at least shifts a level by at most

    2V² / [Δ + √(Δ² + 4V²)]        (C.-K. Li and R.-C. Li, Linear Algebra Appl. 395, 183 (2005))

as for two levels (the formula stands in the abstract of arXiv:2508.08203, the same paper). V is the sum of |⟨r'|X|r⟩| ‖c‖ over the
channels, ‖c‖ as in `couplings_alone`, the same for all F: Δ, V and so the bound are those of all F together. The shifts by all other
states are added, and Δ is taken once more less what third states shift the two by. States of one N that the spins mix have in common what
other N do to both; the cross term is added with the mixing. This is no strict bound where three states are mixed strongly; in 370 random
molecules it held in every one.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.spins.blocks import Plan
from rotor.quantum.spins.couplings_alone import Alone, coupling_alone
from rotor.quantum.spins.rotor import Channel

_ROUND_OFF = 4 * float(np.finfo(float).eps)  # of the highest energy, of eigenvalues of two methods
_AT_ONCE = 100_000  # elements in one array: those on the way stay in the cache of the processor
_TINY = float(np.finfo(float).tiny)


class _Matrices(NamedTuple):
    """Operators between blocks: their numbers (pairs,) twice, by channels that share it (pairs, states', states)."""

    up: Ints
    low: Ints
    acting: list[tuple[Floats, list[Channel]]]


class _States(NamedTuple):
    """All rotational states: N, lowest and highest level to first order in MHz, (n,) each."""

    n: Ints
    low: Floats
    high: Floats


class _Elements(NamedTuple):
    """Two states each, and the norm of what joins them in MHz, (elements,)."""

    up: Ints
    low: Ints
    norm: Floats


def largest_shifts(plan: Plan) -> tuple[float, float]:
    """The largest shift of a level in MHz by elements between different N, and by those between other states of one N.

    With the round-off of the highest energy in the first.
    """
    sizes = np.array([len(block.energies_mhz) for block in plan.blocks], dtype=np.int64)
    starts = np.cumsum(sizes) - sizes
    n = np.array([block.n for block in plan.blocks], dtype=np.int64)
    highest = int(n.max(initial=0))
    acting = {channel for _, _, found in _matrices(plan) for _, channels in found for channel in channels}
    alone = {channel: coupling_alone(plan.shared.scheme, channel, highest) for channel in acting}
    states = _states(plan, n, starts, alone)
    elements = [_elements(found, n, starts, alone) for found in _matrices(plan)]
    other, own = _shifts(states, [*_together(states, elements)])
    energy = max((float(np.abs(block.energies_mhz).max(initial=0.0)) for block in plan.blocks), default=0.0)
    return float(other.max(initial=0.0)) + _ROUND_OFF * energy, float(own.max(initial=0.0))


def _matrices(plan: Plan) -> Iterator[_Matrices]:
    """Every pair of blocks once, those of two stacks together."""
    of_stacks: dict[tuple[int, int, int], _Matrices] = {}
    for every, channels in plan.contracted:
        for up, low, pairs, matrices in every:
            numbers = up.numbers[pairs.up], low.numbers[pairs.low]
            key = (int(up.numbers[0]), int(low.numbers[0]), pairs.rise)
            of_stacks.setdefault(key, _Matrices(*numbers, [])).acting.append((matrices, channels))
    yield from of_stacks.values()


def _states(plan: Plan, n: Ints, starts: Ints, alone: dict[Channel, Alone]) -> _States:
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


def _elements(found: _Matrices, n: Ints, starts: Ints, alone: dict[Channel, Alone]) -> _Elements:
    """The elements between other states, each once."""
    of_n = n[found.up], n[found.low]
    total = np.zeros(())
    for matrices, channels in found.acting:
        norms = sum((alone[channel].norm[of_n] for channel in channels), np.zeros(len(found.up)))
        total = total + np.abs(matrices) * norms[:, None, None]
    if found.up[0] == found.low[0]:
        total = np.tril(total, -1)
    pair, row, column = np.nonzero(total)
    return _Elements(starts[found.up[pair]] + row, starts[found.low[pair]] + column, total[pair, row, column])


def _together(states: _States, elements: list[_Elements]) -> Iterator[_Elements]:
    """The elements in few arrays, of which each has those within one N or those between two alone."""
    for same in (False, True):
        some: list[_Elements] = []
        for found in (found for found in elements if len(found.norm) and _is_same(states, found) == same):
            some.append(found)
            if sum(len(one.norm) for one in some) > _AT_ONCE:
                yield _Elements(*map(np.concatenate, zip(*some, strict=True)))
                some = []
        if some:
            yield _Elements(*map(np.concatenate, zip(*some, strict=True)))


def _shifts(states: _States, elements: list[_Elements]) -> tuple[Floats, Floats]:
    """Bounds (n,) of the shift of every state in MHz: by other N, and by other states of its N."""
    count = len(states.n)
    total, own, other, mixed = np.zeros((4, count))
    for found in elements:
        _add(total, found, _of_two(_apart(states, found), found.norm))
    second = []
    for found in elements:
        apart = _apart(states, found)
        of_pairs = _of_two(apart, found.norm)
        third = total[found.up] + total[found.low] - 2 * of_pairs
        apart = np.maximum(apart - third, 0.0)
        _add(own if _is_same(states, found) else other, found, _of_two(apart, found.norm))
        second.append(apart)
    root = np.sqrt(other)
    for found, apart in zip(elements, second, strict=True):
        if _is_same(states, found):
            mixing = 2 * found.norm / (np.sqrt(apart**2 + 4 * found.norm**2) + _TINY)
            mixed += np.bincount(found.up, mixing * root[found.low], count)
            mixed += np.bincount(found.low, mixing * root[found.up], count)
    return other + root * mixed, own


def _is_same(states: _States, found: _Elements) -> bool:
    """Whether the elements join states of one N; those of two stacks have all the same difference of N."""
    return bool(states.n[found.up[0]] == states.n[found.low[0]])


def _apart(states: _States, found: _Elements) -> Floats:
    """Distances of the levels of both states."""
    up, low = found.up, found.low
    return np.maximum(np.maximum(states.low[up] - states.high[low], states.low[low] - states.high[up]), 0.0)


def _add(sums: Floats, found: _Elements, shifts: Floats) -> None:
    """Adds the shift of every pair to both of its states."""
    sums += np.bincount(found.up, shifts, len(sums)) + np.bincount(found.low, shifts, len(sums))


def _of_two(apart: Floats, norm: Floats) -> Floats:
    """The shift of two levels by an element between them."""
    return np.asarray(2 * norm**2 / (np.sqrt(apart**2 + 4 * norm**2) + apart + _TINY))
