"""Coupling patterns of many F, and coefficients between them, in tables by F.

They depend only on the spins and on F. The most recent ones stay in memory for fits and further predictions.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.spins.coupling import ChainOperator, powers_of_n_dot_s
from rotor.quantum.spins.rotor import Channel
from rotor.quantum.spins.scheme import Scheme

ROUND_OFF = 1e-13  # round-off of sums of products of a few coefficients of size 1
WHOLE = slice(None)


class PatternTable(NamedTuple):
    """Patterns by doubled F, numbered alike for all F by their distances from F.

    places: numbers of the patterns of each F. distances: the distances that each number stands for, and the class of exchange in the last
    column.
    """

    patterns: dict[int, Ints]
    places: dict[int, Ints]
    distances: Ints

    def present(self, twice_f: Ints) -> NDArray[np.bool_]:
        """Whether each F has the pattern of each number, (F, numbers)."""
        mask = np.zeros((len(twice_f), len(self.distances)), dtype=bool)
        for row, f in enumerate(twice_f.tolist()):
            mask[row, self.places.get(f, [])] = True
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
    """c(p', p) of a channel within each F, (F, patterns', patterns), 0 where an F lacks a pattern; shared and read-only.

    With its powers of N·S; 0 between different conserved sums; for two equivalent spins ½(value ± value with both exchanged).
    """
    values = _by_f(scheme, ChainOperator(channel.acting, channel.rank), 0, first, last)
    b = len(scheme.spins) - 1
    exchanged = tuple(sorted({b: b - 1, b - 1: b}.get(place, place) for place in channel.acting))
    if exchanged != channel.acting and scheme.equivalent == 2:
        turned = _by_f(scheme, ChainOperator(exchanged, channel.rank), 0, first, last)
        values = _without_round_off((values + channel.exchange * turned) / 2)
    table = pattern_table(scheme, first, last)
    for sums in table.distances[:, scheme.conserved_columns].T:
        values = np.where(sums[:, None] == sums, values, 0.0)
    if channel.ns:
        patterns = table.distances[:, :2] + np.array(list(table.patterns))[:, None, None]
        powers = powers_of_n_dot_s(scheme.twice[0], (channel.ns, channel.n2), patterns)
        values = values * ((powers[:, :, None] + powers[:, None, :]) / 2)
    values.flags.writeable = False
    return values


@lru_cache(maxsize=64)
def tensors_by_f(scheme: Scheme, moment: ChainOperator, step: int, first: int, last: int) -> Floats:
    """t(p', p) of a moment from each F to F + step, (F, patterns', patterns), 0 where there is no F + step; shared and read-only."""
    values = _by_f(scheme, moment, step, first, last) * scheme.count_of(moment.spins)
    values.flags.writeable = False
    return values


def column_tensors(
    scheme: Scheme, moment: ChainOperator, step: int, first: int, last: int, twice_f: Ints, left: slice, right: slice
) -> Floats:
    """Some columns of `tensors_by_f` (twice_f, left, right), without the others; spins are not equivalent."""
    return _one_by_one(scheme, moment, step, pattern_table(scheme, first, last), twice_f, left, right)


def _by_f(scheme: Scheme, acting: ChainOperator, step: int, first: int, last: int) -> Floats:
    """Coefficients from each F to F + step, (F, patterns', patterns)."""
    plain = pattern_table(scheme.one_by_one, first, last)
    values = _one_by_one(scheme, acting, step, plain, np.array(list(plain.patterns)))
    if not scheme.equivalent:
        return values
    turns = _turns_by_f(scheme, first, last)
    count = len(turns) - step // 2
    out = np.zeros((len(turns), *(2 * turns.shape[2:])))
    out[:count] = turns[step // 2 :].transpose(0, 2, 1) @ values[:count] @ turns[:count]
    return _without_round_off(out)


def _without_round_off(values: Floats) -> Floats:
    """Coefficients without round-off, which would connect states of different symmetry."""
    return np.where(np.abs(values) > ROUND_OFF, values, 0.0)


@lru_cache(maxsize=16)
def _turns_by_f(scheme: Scheme, first: int, last: int) -> Floats:
    """Amplitudes (F, one by one, total) of patterns with spins coupled one by one in those with a total spin."""
    plain, table = (pattern_table(each, first, last) for each in (scheme.one_by_one, scheme))
    out = np.zeros((len(table.patterns), len(plain.distances), len(table.distances)))
    for row, f in enumerate(table.patterns):
        out[row, plain.places[f][:, None], table.places[f]] = scheme.recoupling(f)[1]
    return out


def _one_by_one(
    scheme: Scheme, acting: ChainOperator, step: int, table: PatternTable, twice_f: Ints, left: slice = WHOLE,
    right: slice = WHOLE,
) -> Floats:  # fmt: skip
    """Coefficients (F, left, right) between patterns coupled one by one, whose distances are alike for all F."""
    bra, ket = table.distances[left, :-1] + step, table.distances[right, :-1]
    up, low = np.nonzero(acting.connects(bra, ket))
    both = table.present(twice_f + step)[:, left][:, up] & table.present(twice_f)[:, right][:, low]
    at, pair = np.nonzero(both)
    up, low, f = up[pair], low[pair], twice_f[at, None]
    out = np.zeros((len(twice_f), len(bra), len(ket)))
    out[at, up, low] = acting.coefficients(scheme.twice, bra[up] + f, ket[low] + f)
    return out
