"""Families of three lines to try: those that most tops have among their strongest lines in the band.

A sample of tops within the bounds is drawn; for each, the strongest lines of a type in the band are known. A family is three of
them that determine A, B and C well enough to predict the others. Families are ordered so that each next one is among the strongest
lines of as many tops as possible that the ones before do not serve (greedy cover).
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.assignment._kernels import derivatives, strongest_lines
from rotor.assignment.rigid_table import RigidTable

STRONGEST = 7  # lines of a type from which families are chosen
COMPANIONS = 16  # lines that a family predicts
LARGEST_ERROR = 4.0  # of a predicted line, in errors of the family's lines
FEWEST_COMPANIONS = 5
DECAY = 0.45  # what another family is worth for a top that a family serves already


@dataclass(frozen=True, eq=False)
class Family:
    """Three lines of a type by their rows in the table, those they predict, and the share of sampled tops that have them."""

    kind: int
    lines: Ints
    companions: Ints
    share: float


@dataclass(frozen=True, eq=False)
class Bounds:
    """Least and greatest A, B, C in MHz (3,) each."""

    low: Floats
    high: Floats

    @property
    def array(self) -> Floats:
        """A low, A high, B low, ... (6,)."""
        return np.column_stack([self.low, self.high]).ravel()


def sample_tops(bounds: Bounds, count: int, rng: np.random.Generator) -> Floats:
    """A, B, C (count, 3): A and B log-uniform, C between that of a planar molecule and B."""
    rows = list[Floats]()
    total = 0
    low, high = np.log(bounds.low), np.log(bounds.high)
    for _ in range(200):
        u = rng.random((4 * count, 3))
        a, b = (np.exp(low[i] + (high[i] - low[i]) * u[:, i]) for i in (0, 1))
        planar = a * b / (a + b)
        least, most = np.maximum(planar, bounds.low[2]), np.minimum(b, bounds.high[2])
        c = least + (most - least) * u[:, 2] ** 1.5
        kept = (a > 1.02 * b) & (c < 0.999 * b) & (most > least)
        rows.append(np.column_stack([a, b, c])[kept])
        total += len(rows[-1])
        if total >= count:
            return np.concatenate(rows)[:count]
    if not total:
        raise ValueError("bounds: no A > B > C with 1/C of at most 1/A + 1/B lies within them; widen them")
    return np.concatenate(rows)


def families(
    table: RigidTable,
    bounds: Bounds,
    band_mhz: tuple[float, float],
    temperature_k: tuple[float, float],
    rng: np.random.Generator,
    samples: int = 800,
    most: int = 400,
) -> list[Family]:
    """Families in the order in which to try them."""
    tops = sample_tops(bounds, samples, rng)
    temperatures = np.exp(rng.uniform(*np.log(temperature_k), size=len(tops)))
    quanta_j = table.quanta[:, 0].astype(np.float64)
    rows, frequency, _ = strongest_lines(
        table.levels, table.theta, quanta_j * (quanta_j + 1), table.upper, table.lower, table.kind, table.strength,
        tops, temperatures, *band_mhz, COMPANIONS,
    )  # fmt: skip
    served, companions = _candidates(table, tops, rows)
    return _cover(table, served, companions, len(tops), most)


def _candidates(
    table: RigidTable, tops: Floats, rows: Ints
) -> tuple[dict[tuple[int, ...], list[int]], dict[tuple[int, ...], dict[int, float]]]:
    """Sampled tops (with type) by family, and weights of companions by family."""
    served: dict[tuple[int, ...], list[int]] = defaultdict(list)
    companions: dict[tuple[int, ...], dict[int, float]] = defaultdict(lambda: defaultdict(float))
    picks = np.array(list(combinations(range(STRONGEST), 3)))
    constants = np.zeros(8)
    for t in range(len(tops)):
        constants[:3] = tops[t]
        for kind in range(3):
            lines = rows[t, kind][rows[t, kind] >= 0]
            if len(lines) < 3 + FEWEST_COMPANIONS:
                continue
            slopes = derivatives(table.levels, table.theta, table.upper, table.lower, lines, constants)[:, :3]
            chosen = picks[(picks < len(lines)).all(axis=1)]
            matrix = slopes[chosen]
            regular = np.abs(np.linalg.det(matrix)) > 1e-4
            chosen, matrix = chosen[regular], matrix[regular]
            if not len(chosen):
                continue
            # errors of all lines in units of the errors of the family's lines, (families, lines)
            errors = np.abs(slopes @ np.linalg.inv(matrix)).sum(axis=2)
            good = errors < LARGEST_ERROR
            for pick, near in zip(chosen, good, strict=True):
                if near.sum() < 3 + FEWEST_COMPANIONS:
                    continue
                key = tuple(sorted(lines[pick].tolist()))
                served[key].append(3 * t + kind)
                weights = companions[key]
                for place, line in enumerate(lines.tolist()):
                    if near[place] and line not in key:
                        weights[line] += 1.0 / (4 + place)
    return served, companions


def _cover(
    table: RigidTable,
    served: dict[tuple[int, ...], list[int]],
    companions: dict[tuple[int, ...], dict[int, float]],
    tops: int,
    most: int,
) -> list[Family]:
    keys = list(served)
    if not keys:
        return []
    lengths = np.array([len(served[key]) for key in keys])
    member = np.concatenate([np.array(served[key]) for key in keys])
    family = np.repeat(np.arange(len(keys)), lengths)
    order = np.argsort(member, kind="stable")
    starts = np.searchsorted(member[order], np.arange(3 * tops + 1))
    worth = np.ones(3 * tops)
    gain = lengths.astype(float)
    firsts = np.concatenate([[0], np.cumsum(lengths)])
    out = []
    for _ in range(min(most, len(keys))):
        best = int(np.argmax(gain))
        if gain[best] < 0.3:
            break
        key = keys[best]
        weights = companions[key]
        chosen = sorted(weights, key=lambda line: -weights[line])[:COMPANIONS]
        out.append(
            Family(int(table.kind[key[0]]), np.array(key), np.array(chosen), float(gain[best] / tops))
        )
        for item in member[firsts[best] : firsts[best + 1]].tolist():
            lost = worth[item] * (1 - DECAY)
            worth[item] -= lost
            gain[family[order[starts[item] : starts[item + 1]]]] -= lost
        gain[best] = -1.0
    return out
