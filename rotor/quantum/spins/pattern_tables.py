"""Coupling patterns of many F, and coefficients between them, in tables by F.

They depend only on the spins and on F. The most recent ones stay in memory for fits and further predictions.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.spins.coupling import (
    coefficients,
    for_all_f,
    moment_coefficients,
    moment_products,
    powers_between,
    within_reach,
)
from rotor.quantum.spins.rotor import Channel
from rotor.quantum.spins.scheme import Scheme

ROUND_OFF = 1e-13  # round-off of sums of products of a few coefficients of size 1


class PatternTable(NamedTuple):
    """Patterns by doubled F, numbered alike for all F by their distances from F.

    places: numbers of the patterns of each F. distances: the distances that each number stands for, and the class of exchange in the last
    column.
    """

    patterns: dict[int, Ints]
    places: dict[int, Ints]
    distances: Ints

    def present(self, twice_f: int) -> NDArray[np.bool_]:
        """Whether an F has the pattern of each number."""
        mask = np.zeros(len(self.distances), dtype=bool)
        mask[self.places.get(twice_f, [])] = True
        return mask


@lru_cache(maxsize=16)
def pattern_table(scheme: Scheme, first: int, last: int) -> PatternTable:
    """The patterns of all doubled F from the first to the last that have any."""
    patterns = {f: patterns_of_f for f in range(first, last + 1, 2) if len(patterns_of_f := scheme.patterns(f))}
    if not patterns:
        return PatternTable({}, {}, np.zeros((0, 0), dtype=np.int64))
    highest = patterns[max(patterns)]
    moving = np.ones(highest.shape[1], dtype=np.int64)
    if scheme.equivalent:
        # the total of equivalent spins does not rise with F, nor does the symmetry number of three
        moving[-scheme.equivalent : -1] = 0
    # patterns of the highest F come first, then those that equivalent spins have only at lower F
    classes: dict[tuple[int, ...], int] = {}
    for f in sorted(patterns, reverse=True):
        distances = (patterns[f] - moving * f).tolist()
        for row, number in zip(distances, np.asarray(scheme.classes(patterns[f])).tolist(), strict=True):
            classes.setdefault(tuple(row), number)
    numbers = {row: place for place, row in enumerate(classes)}
    places = {
        f: np.array([numbers[tuple(row)] for row in (patterns_of_f - moving * f).tolist()])
        for f, patterns_of_f in patterns.items()
    }
    all_distances = np.array(list(classes), dtype=np.int64)
    return PatternTable(patterns, places, np.column_stack([all_distances, list(classes.values())]))


@lru_cache(maxsize=64)
def couplings_by_f(scheme: Scheme, channel: Channel, first: int, last: int) -> Floats:
    """c(p', p) of a channel within each F, (F, patterns', patterns), 0 where an F lacks a pattern; shared and read-only."""
    table = pattern_table(scheme, first, last)
    return _by_f(table, couplings_of(scheme, channel, table.patterns), 0)


@lru_cache(maxsize=64)
def tensors_by_f(scheme: Scheme, rank: int, step: int, first: int, last: int, acting: int | None = None) -> Floats:
    """t(p', p) from each F to F + step, (F, patterns', patterns), 0 where there is no F + step; shared and read-only.

    Of a tensor, or of the vector of a spin if one acts (see `coupling`).
    """
    table = pattern_table(scheme, first, last)
    return _by_f(table, _coefficients_of_step(scheme, table.patterns, rank, step, acting), step)


def column_tensors(
    scheme: Scheme, rank: int, step: int, first: int, last: int, acting: int | None, twice_f: Ints, left: slice,
    right: slice,
) -> Floats:  # fmt: skip
    """Some columns of `tensors_by_f` (twice_f, left, right), without the others: they have distances between patterns in common for all F.

    Spins are not equivalent.
    """
    table = pattern_table(scheme, first, last)
    bra, ket = table.distances[left, :-1] + step, table.distances[right, :-1]
    up, low = np.nonzero(within_reach(rank, bra, ket))
    both = [table.present(f + step)[left][up] & table.present(f)[right][low] for f in twice_f.tolist()]
    at, pair = np.nonzero(both)
    up, low, f = up[pair], low[pair], twice_f[at, None]
    out = np.zeros((len(twice_f), len(bra), len(ket)))
    out[at, up, low] = moment_products(scheme.twice, rank, acting, bra[up] + f, ket[low] + f)
    return out


def _by_f(table: PatternTable, coefficients: Mapping[int, Floats], step: int) -> Floats:
    """Coefficients by F as one read-only array (F, patterns', patterns)."""
    first, count = min(table.patterns), len(table.distances)
    out = np.zeros((len(table.patterns), count, count))
    for f, values in coefficients.items():
        out[(f - first) // 2, table.places[f + step][:, None], table.places[f]] = values
    out.flags.writeable = False
    return out


@lru_cache(maxsize=1024)
def _couplings_of_f(scheme: Scheme, channel: Channel, twice_f: int) -> Floats:
    """c(p', p) of a channel over all patterns of one F with a total spin; read-only, shared by levels and derivatives."""
    patterns = scheme.patterns(twice_f)
    values = coefficients_between(scheme, channel, patterns, patterns)
    values = np.where(np.abs(values) > ROUND_OFF, values, 0.0)  # round-off would connect states of different symmetry
    values.flags.writeable = False
    return values


def couplings_of(scheme: Scheme, channel: Channel, tables: Mapping[int, Ints]) -> dict[int, Floats]:
    """c(p', p) of a channel by F, from the patterns of each F."""
    if scheme.equivalent:
        return {f: _couplings_of_f(scheme, channel, f) for f in tables}
    both = {f: (patterns, patterns) for f, patterns in tables.items()}
    return for_all_f(both, lambda bra, ket: coefficients_between(scheme, channel, bra, ket))


def coefficients_between(scheme: Scheme, channel: Channel, bra: Ints, ket: Ints) -> Floats:
    """c(p', p) of a channel between patterns (..., n, columns), with its powers of N·S; 0 between different conserved sums."""
    values = _with_total(scheme, channel, bra) if scheme.equivalent else _one_by_one(scheme, channel, bra, ket)
    for column in scheme.conserved_columns:
        values = np.where(bra[..., :, None, column] == ket[..., None, :, column], values, 0.0)
    powers = channel.ns, channel.n2
    return np.asarray(values * powers_between(scheme.twice[0], powers, bra, ket)) if channel.ns else values


def _one_by_one(scheme: Scheme, channel: Channel, bra: Ints, ket: Ints) -> Floats:
    """c(p', p) between patterns coupled one by one, without powers."""
    return coefficients(scheme.twice, channel.acting, channel.rank, bra, ket)


def _with_total(scheme: Scheme, channel: Channel, patterns: Ints) -> Floats:
    """c(p', p) over all patterns of an F with a total spin; for two equivalent spins ½(value ± value with both exchanged)."""
    plain, turn = scheme.recoupling(int(patterns[0, -1]))
    values = _one_by_one(scheme, channel, plain, plain)
    b = len(scheme.spins) - 1
    turned = tuple(sorted({b: b - 1, b - 1: b}.get(place, place) for place in channel.acting))
    if turned != channel.acting and scheme.equivalent == 2:
        exchanged = _one_by_one(scheme, channel._replace(acting=turned), plain, plain)
        values = (values + channel.exchange * exchanged) / 2
    return np.asarray(turn.T @ values @ turn)


def _coefficients_of_step(
    scheme: Scheme, patterns: Mapping[int, Ints], rank: int, step: int, acting: int | None
) -> dict[int, Floats]:
    """t(p', p) between doubled F' = F + step and F, by F, where both have patterns."""

    def compute(bra: Ints, ket: Ints) -> Floats:
        if not scheme.equivalent:
            return moment_coefficients(scheme.twice, rank, acting, bra, ket)
        (up, left), (low, right) = (scheme.recoupling(int(patterns[0, -1])) for patterns in (bra, ket))
        values = left.T @ moment_coefficients(scheme.twice, rank, acting, up, low) @ right
        values *= scheme.count_of(() if acting is None else (acting,))
        return np.where(np.abs(values) > ROUND_OFF, values, 0.0)

    tables = {f: (patterns[f + step], patterns_of_f) for f, patterns_of_f in patterns.items() if f + step in patterns}
    return {f: compute(*both) for f, both in tables.items()} if scheme.equivalent else for_all_f(tables, compute)
