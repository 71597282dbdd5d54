"""By how much levels with spins may shift by elements that a simpler method leaves out: a bound for every rotational state of an F.

The spins split a rotational state r to first order into levels between low_r and high_r, the eigenvalues of its own sub-matrix. An
element of norm V between two states whose levels are Δ apart at least shifts a level by at most

    2V² / [Δ + √(Δ² + 4V²)]        (C.-K. Li and R.-C. Li, Linear Algebra Appl. 395, 183 (2005))

as for two levels (the formula stands in the abstract of arXiv:2508.08203, the same paper). V is the sum of |⟨r'|X|r⟩| ‖c‖ over the
channels, ‖c‖ the largest singular value of the coefficients of coupling. The shifts by all other states are added, and Δ is taken once
more less what third states shift the two by. States of one N that the spins mix have in common what other N do to both; the cross term is
added with the mixing. This is no strict bound where three states are mixed strongly; in 370 random molecules it held in every one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.spins.blocks import Plan, coefficients_of
from rotor.quantum.spins.rotor import Channel

_ROUND_OFF = 4 * float(np.finfo(float).eps)  # of the highest energy, of eigenvalues of two methods


class _Neighbours(NamedTuple):
    """Rotational states of an F: N of each (n,), distance of their levels in MHz and norm of what joins them (n, n)."""

    n: Floats
    apart: Floats
    norm: Floats


def largest_shifts(plan: Plan, every_f: Sequence[int]) -> tuple[float, float]:
    """The largest shift of a level in MHz by elements between different N, and by those between other states of one N.

    Parameters
    ----------
    plan : Plan
        Solved rotation and the operators between its blocks.
    every_f : sequence of int
        Doubled F.

    Returns
    -------
    (float, float)
        In MHz, with the round-off of the highest energy in the first; (0, 0) for no F.
    """
    largest = np.zeros(2)
    for twice_f in every_f:
        found = _neighbours(plan, twice_f)
        if found is not None:
            largest = np.maximum(largest, _shifts(found).max(axis=1))
    highest = max((float(np.abs(block.energies_mhz).max(initial=0.0)) for block in plan.blocks), default=0.0)
    return float(largest[0]) + _ROUND_OFF * highest, float(largest[1])


def _neighbours(plan: Plan, twice_f: int) -> _Neighbours | None:
    scheme = plan.shared.scheme
    every = scheme.patterns(twice_f)
    of_n = {int(n) // 2: np.flatnonzero(every[:, 0] == n) for n in np.unique(every[:, 0])}
    there = [i for i, block in enumerate(plan.blocks) if block.n in of_n]
    if not there:
        return None
    channels = {channel for operators in plan.operators.values() for channel in operators}
    known = {channel: coefficients_of(scheme, channel, every) for channel in channels}
    parts = {(c, m, n): known[c][np.ix_(of_n[m], of_n[n])] for c in channels for m in of_n for n in of_n}
    norms = {key: float(np.linalg.norm(part, 2)) for key, part in parts.items()}
    starts = dict(zip(there, np.cumsum([0, *(len(plan.blocks[i].energies_mhz) for i in there)]).tolist(), strict=False))
    size = sum(len(plan.blocks[i].energies_mhz) for i in there)
    norm, edges = np.zeros((size, size)), np.zeros((2, size))
    for i in there:
        rows = slice(starts[i], starts[i] + len(plan.blocks[i].energies_mhz))
        edges[:, rows] = _first_order(plan, i, parts)
    for (i, k), found in plan.operators.items():
        if i in starts and k in starts:
            m, n = plan.blocks[i].n, plan.blocks[k].n
            element = np.sum([norms[c, m, n] * np.abs(operator) for c, operator in found.items()], axis=0)
            rows, columns = (slice(starts[x], starts[x] + len(plan.blocks[x].energies_mhz)) for x in (i, k))
            norm[rows, columns], norm[columns, rows] = element, element.T
    np.fill_diagonal(norm, 0.0)
    apart = np.maximum(edges[0][:, None] - edges[1], 0.0)
    number = np.concatenate([np.full(len(plan.blocks[i].energies_mhz), plan.blocks[i].n) for i in there])
    return _Neighbours(number, np.maximum(apart, apart.T), norm)


def _first_order(plan: Plan, i: int, parts: dict[tuple[Channel, int, int], Floats]) -> Floats:
    """Lowest and highest level (2, n) of the states of a block to first order."""
    block = plan.blocks[i]
    total = np.zeros(())
    for channel, operator in plan.operators.get((i, i), {}).items():
        total = total + np.diag(operator).real[:, None, None] * parts[channel, block.n, block.n]
    if total.ndim == 0:
        return np.array([block.energies_mhz, block.energies_mhz])
    split = np.linalg.eigvalsh(total)
    return np.array([block.energies_mhz + split[:, 0], block.energies_mhz + split[:, -1]])


def _shifts(found: _Neighbours) -> Floats:
    """Bounds (2, n) of the shift of every state in MHz: by other N, and by other states of its N."""
    same = found.n[:, None] == found.n
    of_pairs = _of_two(found.apart, found.norm)
    third = of_pairs.sum(axis=1)[:, None] - of_pairs
    apart = np.maximum(found.apart - third - third.T, 0.0)
    of_pairs = _of_two(apart, found.norm)
    own, other = np.where(same, of_pairs, 0.0).sum(axis=1), np.where(same, 0.0, of_pairs).sum(axis=1)
    mixing = np.where(same, 2 * found.norm / (np.hypot(apart, 2 * found.norm) + np.finfo(float).tiny), 0.0)
    return np.array([other + np.sqrt(other) * (mixing @ np.sqrt(other)), own])


def _of_two(apart: Floats, norm: Floats) -> Floats:
    """The shift of two levels by an element between them."""
    return 2 * norm**2 / (np.hypot(apart, 2 * norm) + apart + np.finfo(float).tiny)
