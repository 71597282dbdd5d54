"""Bounds of coupling coefficients for all F, from the spins on which a channel acts.

A channel acts on N and on one or two spins, and leaves the others unchanged. Its coefficients c between the patterns of N' and N therefore
have the same norm over all F as with those spins alone over all sums J of N and the spins, and their eigenvalues within one N have the same
limits. With one spin they are numbers by J. With two spins the norm is bounded by ‖c‖₂² ≤ ‖c‖₁ ‖c‖∞ (largest sums of columns and of rows),
and the eigenvalues by Gershgorin circles.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.spins.coupling import coefficients, for_every_f, patterns, powers_between
from rotor.quantum.spins.rotor import Channel
from rotor.quantum.spins.scheme import Scheme


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
    tables = {j: patterns(twice, j) for j in range(sum(twice) % 2, 2 * highest_n + sum(twice) + 1, 2)}
    tables = {j: patterns_of_j[patterns_of_j[:, 0] <= 2 * highest_n] for j, patterns_of_j in tables.items()}

    def of(bra: Ints, ket: Ints) -> Floats:
        plain = coefficients(twice, channel.acting, channel.rank, bra, ket)
        return plain * powers_between(twice[0], (channel.ns, channel.n2), bra, ket) if channel.ns else plain

    by_j = for_every_f(
        {j: (patterns_of_j, patterns_of_j) for j, patterns_of_j in tables.items() if len(patterns_of_j)}, of
    )
    norm = np.zeros((highest_n + 1, highest_n + 1))
    ends = np.full((2, highest_n + 1), -np.inf)
    for j, values in by_j.items():
        n, starts = np.unique(tables[j][:, 0] // 2, return_index=True)
        size, inside = np.abs(values), np.ix_(n, n)
        rows = np.maximum.reduceat(np.add.reduceat(size, starts, axis=1), starts, axis=0)
        columns = np.maximum.reduceat(np.add.reduceat(size, starts, axis=0), starts, axis=1)
        norm[inside] = np.maximum(norm[inside], np.sqrt(rows * columns))
        diagonal, places = np.diag(values), np.searchsorted(n, tables[j][:, 0] // 2)
        radius = np.add.reduceat(size, starts, axis=1)[np.arange(len(values)), places] - np.abs(diagonal)
        circles = np.array([radius - diagonal, radius + diagonal])
        ends[:, n] = np.maximum(ends[:, n], np.maximum.reduceat(circles, starts, axis=1))
    for array in (norm, ends):
        array.flags.writeable = False
    return Alone(norm, -ends[0], ends[1])
