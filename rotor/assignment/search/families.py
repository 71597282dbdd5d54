"""Families of three lines to try, chosen so that most tops have one among their strongest lines in the band.

Tops are sampled within the bounds, and the strongest lines of each type in the band are computed. A family is a set of three of these
lines that determines A, B and C well enough to predict the others. Families are ordered by greedy cover: each next family belongs to the
strongest lines of as many tops as possible that no preceding family covers.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.assignment.search._kernels import strongest_lines
from rotor.assignment.search.bounds import Bounds, sample_tops
from rotor.assignment.search.rigid_table import MIXED, RigidTable

STRONGEST = 7  # strongest lines of a type from which families are formed
COMPANIONS = 16  # lines that a family predicts
LARGEST_ERROR = 4.0  # largest error of a predicted line, in errors of the family's lines
FEWEST_COMPANIONS = 4
SMALLEST_DETERMINANT = 1e-4  # of the derivatives of a family's lines by A, B, C
SAME_PEAK_MHZ = 0.3  # closer lines form one peak
SAMPLES, MOST = 2000, 1500
MIXED_WORTH = 0.5  # of a top with lines of several types, over one with lines of a type
WEAKEST_DIPOLE = 0.1  # component over the largest, of families of lines of several types
PLACES = 4  # of a top: types a, b, c, and all of them
LEAST_GAIN = 0.3  # smallest number of newly covered tops for a further family
DECAY = 0.45  # weight of a second family for a top that is covered already


@dataclass(frozen=True, eq=False)
class Family:
    """Three lines by their rows in the table, the lines they predict, the covered share of sampled tops; kind: a, b, c or several."""

    kind: int
    lines: Ints
    companions: Ints
    share: float


def families(
    table: RigidTable,
    bounds: Bounds,
    band_mhz: tuple[float, float],
    temperature_k: tuple[float, float],
    rng: np.random.Generator,
    samples: int = SAMPLES,
    most: int = MOST,
) -> list[Family]:
    """Families of lines in the order in which to try them.

    Parameters
    ----------
    table : RigidTable
    bounds : Bounds
        Of A, B, C.
    band_mhz : (float, float)
        First and last frequency of the spectrum.
    temperature_k : (float, float)
        Lowest and highest; log-uniform between them.
    rng : numpy Generator
        Draws the tops.
    samples, most : int
        Number of sampled tops, and largest number of families.

    Returns
    -------
    list of Family
        Ordered by greedy cover: families that cover most tops first.
    """
    tops = sample_tops(bounds, samples, rng)
    temperatures = np.exp(rng.uniform(np.log(temperature_k[0]), np.log(temperature_k[1]), len(tops)))
    j = table.quanta[:, 0].astype(np.float64)
    rows, slopes = strongest_lines(
        table.levels, table.theta, j * (j + 1), table.upper, table.lower, table.kind, table.strength, tops,
        2 * np.log(rng.uniform(WEAKEST_DIPOLE, 1.0, (len(tops), 3))), temperatures,
        np.array([band_mhz]), COMPANIONS, SAME_PEAK_MHZ,
    )  # fmt: skip
    return _cover(table, *_members(table, rows, slopes), len(tops), most)


def _members(table: RigidTable, rows: Ints, slopes: Floats) -> tuple[Ints, Ints, Ints, NDArray[np.bool_]]:
    """Families of each sampled top and type: lines (members, 3), index 4 top + type, all lines, and which of them are predicted."""
    lines, slopes = rows.reshape(-1, COMPANIONS), slopes.reshape(-1, COMPANIONS, 3)
    enough = np.flatnonzero((lines >= 0).sum(axis=1) >= 3 + FEWEST_COMPANIONS)
    picks = np.array(list(combinations(range(STRONGEST), 3)))
    place = np.repeat(enough, len(picks))
    pick = np.tile(picks, (len(enough), 1))
    chosen = lines[place[:, None], pick]
    matrix = slopes[place[:, None], pick]
    regular = (chosen >= 0).all(axis=1) & (np.abs(np.linalg.det(matrix)) > SMALLEST_DETERMINANT)
    place, chosen, matrix = place[regular], chosen[regular], matrix[regular]
    # errors of all lines in units of the errors of the family's lines
    errors = np.abs(slopes[place] @ np.linalg.inv(matrix)).sum(axis=2)
    good = (errors < LARGEST_ERROR) & (lines[place] >= 0)
    selected = good.sum(axis=1) >= 3 + FEWEST_COMPANIONS
    return np.sort(chosen[selected], axis=1), place[selected], lines[place[selected]], good[selected]


def _cover(
    table: RigidTable, chosen: Ints, place: Ints, lines: Ints, good: NDArray[np.bool_], tops: int, most: int
) -> list[Family]:
    """Families by greedy cover of tops with types."""
    if not len(chosen):
        return []
    size = len(table.upper)
    # one integer a family: triples compare faster
    keys, family = np.unique((chosen[:, 0] * size + chosen[:, 1]) * size + chosen[:, 2], return_inverse=True)
    by_family, by_place = np.argsort(family, kind="stable"), np.argsort(place, kind="stable")
    firsts = np.searchsorted(family[by_family], np.arange(len(keys) + 1))
    starts = np.searchsorted(place[by_place], np.arange(PLACES * tops + 1))
    worth = np.where(np.arange(PLACES * tops) % PLACES == MIXED, MIXED_WORTH, 1.0)
    gain = np.bincount(family, worth[place], minlength=len(keys))
    out = []
    for _ in range(min(most, len(keys))):
        best = int(np.argmax(gain))
        if gain[best] < LEAST_GAIN:
            break
        members = by_family[firsts[best] : firsts[best + 1]]
        out.append(_family(table, chosen[members[0]], lines[members], good[members], float(gain[best] / tops)))
        for item in place[members].tolist():
            lost = worth[item] * (1 - DECAY)
            worth[item] -= lost
            gain[family[by_place[starts[item] : starts[item + 1]]]] -= lost
        gain[best] = -1.0
    return out


def _mixed(table: RigidTable, lines: Ints, kind: int) -> bool:
    """Whether more than a third of the lines have another type than `kind`."""
    return bool((table.kind[lines] != kind).mean() > 1 / 3) if len(lines) else False


def _family(table: RigidTable, chosen: Ints, lines: Ints, good: NDArray[np.bool_], share: float) -> Family:
    """A family with the lines that it predicts in most tops, strongest first."""
    weight = 1.0 / (4 + np.broadcast_to(np.arange(lines.shape[1]), lines.shape))
    useful = good & ~np.isin(lines, chosen)
    line, which = np.unique(lines[useful], return_inverse=True)
    total = np.bincount(which, weight[useful])
    kinds = table.kind[chosen]
    kind = int(kinds[0]) if (kinds == kinds[0]).all() and not _mixed(table, line, int(kinds[0])) else MIXED
    # stable: equal strengths keep the order of lines
    return Family(kind, chosen, line[np.argsort(-total, kind="stable")][:COMPANIONS], share)
