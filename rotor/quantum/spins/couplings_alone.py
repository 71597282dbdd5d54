"""How large coefficients of coupling can be, for all F together: of an operator with the spins alone that act in it.

A channel acts on N and on one or two spins, and leaves all the others as they are. So its coefficients c between the patterns of N' and
of N have, over all F, the norm that they have with those spins alone, over all sums J of N and them; and their eigenvalues within one
N lie between the same two. Those of one spin are numbers by J. Of two spins, bounds: ‖c‖₂² ≤ ‖c‖₁ ‖c‖∞ (largest sums of columns and of
rows), and the circles of Gershgorin.
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
    """Of a channel by N: norm (N', N), lowest and highest eigenvalue (N,) of its coefficients."""

    norm: Floats
    lowest: Floats
    highest: Floats


def coupling_alone(scheme: Scheme, channel: Channel, highest_n: int) -> Alone:
    """Bounds of the coefficients of a channel for all F and up to an N.

    Half the sum or difference of an operator and of that with two equivalent spins exchanged has no larger norm than each of both;
    eigenvalues of half the sum lie between the same two, those of half the difference reach half their distance at most.
    """
    places = sorted({*channel.acting, *([0] if channel.ns else [])})
    acting = tuple(places.index(place) for place in channel.acting)
    twice = tuple(scheme.twice[place] for place in places)
    found = _alone(twice, channel._replace(acting=acting, exchange=0), highest_n)
    if channel.exchange >= 0:
        return found
    half = (found.highest - found.lowest) / 2
    return Alone(found.norm, -half, half)


@lru_cache(maxsize=64)
def _alone(twice: tuple[int, ...], channel: Channel, highest_n: int) -> Alone:
    tables = {j: patterns(twice, j) for j in range(sum(twice) % 2, 2 * highest_n + sum(twice) + 1, 2)}
    tables = {j: own[own[:, 0] <= 2 * highest_n] for j, own in tables.items()}

    def of(bra: Ints, ket: Ints) -> Floats:
        own = coefficients(twice, channel.acting, channel.rank, bra, ket)
        return own * powers_between(twice[0], (channel.ns, channel.n2), bra, ket) if channel.ns else own

    found = for_every_f({j: (own, own) for j, own in tables.items() if len(own)}, of)
    norm = np.zeros((highest_n + 1, highest_n + 1))
    ends = np.full((2, highest_n + 1), -np.inf)
    for j, own in found.items():
        n, starts = np.unique(tables[j][:, 0] // 2, return_index=True)
        size, inside = np.abs(own), np.ix_(n, n)
        rows = np.maximum.reduceat(np.add.reduceat(size, starts, axis=1), starts, axis=0)
        columns = np.maximum.reduceat(np.add.reduceat(size, starts, axis=0), starts, axis=1)
        norm[inside] = np.maximum(norm[inside], np.sqrt(rows * columns))
        diagonal, places = np.diag(own), np.searchsorted(n, tables[j][:, 0] // 2)
        radius = np.add.reduceat(size, starts, axis=1)[np.arange(len(own)), places] - np.abs(diagonal)
        circles = np.array([radius - diagonal, radius + diagonal])
        ends[:, n] = np.maximum(ends[:, n], np.maximum.reduceat(circles, starts, axis=1))
    for array in (norm, ends):
        array.flags.writeable = False
    return Alone(norm, -ends[0], ends[1])
