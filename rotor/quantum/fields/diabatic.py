"""Diabatic labels of levels in a field: two levels exchange labels at an avoided crossing whose gap is below a threshold.

Where two neighbouring levels of one block come closest, their gap has a minimum and their slopes dE/dx (theorem of Hellmann and Feynman)
exchange. An interval of fields contains a minimum if the gap falls at its first end and rises at its second. Intervals are halved until the
cubic through energies and slopes at the ends predicts the middle. No crossing is missed, however narrow, and the result does not depend on
the grid of fields. Each minimum is located by minimising the gap. If it is below the threshold, the labels are exchanged at all fields
beyond.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rotor.arrays import Floats, Ints

Solve = Callable[[Floats], tuple[Floats, Floats]]  # fields (f,) -> energies and slopes dE/dx (f, states)

PREDICTED = 0.1  # largest error of the cubic in the middle of an interval, relative to the threshold
DEEPEST = 24  # most halvings of an interval


def diabatic_ranks(solve: Solve, fields: Floats, count: int, gap_mhz: float) -> Ints:
    """The adiabatic rank (fields, count), at the first of the rising fields, of the state whose label each of the lowest states has.

    Avoided crossings with a gap below `gap_mhz` are passed diabatically; ValueError unless it is above 0.
    """
    if not gap_mhz > 0:
        raise ValueError(f"diabatic gap {gap_mhz} MHz: a number above 0 is expected")
    swaps = sorted(crossings(solve, fields, gap_mhz))
    names = np.arange(count)
    out = np.empty((len(fields), count), dtype=np.int64)
    done = 0
    for place, x in enumerate(fields.tolist()):
        while done < len(swaps) and swaps[done][0] <= x:
            lower = swaps[done][1]
            names[[lower, lower + 1]] = names[[lower + 1, lower]]
            done += 1
        out[place] = names
    return out


def crossings(solve: Solve, fields: Floats, gap_mhz: float) -> list[tuple[float, int]]:
    """(field, rank of the lower state) of each avoided crossing with a gap below `gap_mhz`."""
    x, energies, slopes = _resolved(solve, fields, gap_mhz)
    gaps, changes = np.diff(energies, axis=1), np.diff(slopes, axis=1)
    out = []
    for left, lower in zip(*np.nonzero((changes[:-1] < 0) & (changes[1:] > 0)), strict=True):
        at, gap = _closest(solve, float(x[left]), float(x[left + 1]), int(lower))
        if min(gap, gaps[left, lower], gaps[left + 1, lower]) < gap_mhz:
            out.append((at, int(lower)))
    return out


def _resolved(solve: Solve, fields: Floats, gap_mhz: float) -> tuple[Floats, Floats, Floats]:
    """Fields with energies and slopes, refined until a cubic predicts the middle of each interval where levels come close."""
    x, (energies, slopes) = fields, solve(fields)
    fresh = np.ones(len(x) - 1, dtype=bool)
    for _ in range(DEEPEST):
        where = np.flatnonzero(fresh & _may_cross(x, energies, slopes, gap_mhz))
        if not len(where):
            break
        middle = (x[where] + x[where + 1]) / 2
        step = (x[where + 1] - x[where])[:, None]
        predicted = (energies[where] + energies[where + 1]) / 2 + step * (slopes[where] - slopes[where + 1]) / 8
        solved, solved_slopes = solve(middle)
        wrong = (np.abs(predicted - solved) > PREDICTED * gap_mhz).any(axis=1)
        order = np.argsort(np.concatenate([x, middle]), kind="stable")
        is_new = np.zeros(len(x) - 1, dtype=bool)
        is_new[where[wrong]] = True
        fresh = np.repeat(is_new, np.where(np.isin(np.arange(len(x) - 1), where), 2, 1))
        x = np.concatenate([x, middle])[order]
        energies, slopes = np.concatenate([energies, solved])[order], np.concatenate([slopes, solved_slopes])[order]
    return x, energies, slopes


def _may_cross(x: Floats, energies: Floats, slopes: Floats, gap_mhz: float) -> Floats:
    """Whether levels can come within the threshold in each interval, estimated from gaps and largest slopes at its ends."""
    step = np.diff(x)[:, None]
    gaps, changes = np.diff(energies, axis=1), np.abs(np.diff(slopes, axis=1))
    spread = np.abs(np.diff(slopes, axis=0))
    steepest = np.maximum(changes[:-1], changes[1:]) + spread[:, :-1] + spread[:, 1:]
    return np.asarray((np.minimum(gaps[:-1], gaps[1:]) - step * steepest < gap_mhz).any(axis=1))


def _closest(solve: Solve, first: float, last: float, lower: int) -> tuple[float, float]:
    """The field between two others at which the gap above state `lower` is smallest, and the gap."""
    from scipy.optimize import minimize_scalar

    def gap(x: float) -> float:
        energies = solve(np.array([x]))[0][0]
        return float(energies[lower + 1] - energies[lower])

    minimum = minimize_scalar(gap, bounds=(first, last), method="bounded", options={"xatol": 1e-6 * (last - first)})
    return float(minimum.x), float(minimum.fun)
