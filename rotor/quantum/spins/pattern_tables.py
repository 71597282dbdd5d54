"""Coupling patterns of many F, and coefficients between them, in tables by F.

They depend only on the spins and on F. The most recent ones stay in memory for fits and further predictions.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.spins.blocks import couplings_of
from rotor.quantum.spins.lines import coefficients_of_step
from rotor.quantum.spins.rotor import Channel
from rotor.quantum.spins.scheme import Scheme


class PatternTable(NamedTuple):
    """Patterns by doubled F, numbered alike for all F by their distances from F.

    places: numbers of the patterns of each F. distances: the distances that each number stands for, and the class of exchange in the last
    column.
    """

    patterns: dict[int, Ints]
    places: dict[int, Ints]
    distances: Ints


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
def tensors_by_f(scheme: Scheme, rank: int, step: int, first: int, last: int) -> Floats:
    """t(p', p) of a tensor from each F to F + step, (F, patterns', patterns), 0 where there is no F + step; shared and read-only."""
    table = pattern_table(scheme, first, last)
    return _by_f(table, coefficients_of_step(scheme, table.patterns, rank, step), step)


def _by_f(table: PatternTable, coefficients: Mapping[int, Floats], step: int) -> Floats:
    """Coefficients by F as one read-only array (F, patterns', patterns)."""
    first, count = min(table.patterns), len(table.distances)
    out = np.zeros((len(table.patterns), count, count))
    for f, values in coefficients.items():
        out[(f - first) // 2, table.places[f + step][:, None], table.places[f]] = values
    out.flags.writeable = False
    return out
