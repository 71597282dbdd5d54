"""Doublets from tunnelling or a nucleus, replaced by their centres: pairs of close peaks of similar height."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Ints
from rotor.assignment.peaks.peak_list import PeakList

WIDEST_MHZ = 3.0
UNLIKE = 2.5  # smallest ratio of intensities of two peaks that are not a doublet
AROUND = 30.0  # of WIDEST_MHZ: the density of peaks is that within so many to both sides
LEAST_SPLIT, SPREADS = (
    5,
    4.0,
)  # lines with a near peak, and standard deviations above chance, from which on lines look split


def with_centres(peaks: PeakList, alone: bool = False) -> tuple[PeakList, Ints]:
    """The peaks and the centres of all doublets, and (n, 2) their constituent peaks (equal for a single peak).

    alone : omit single peaks that are part of a doublet.

    A centre has the summed intensity. For unequal intensities the midpoint is not the centre of gravity; a hundredth of the splitting
    is then added to its standard error.
    """
    f, height = peaks.frequency_mhz, peaks.intensity
    members = [np.column_stack([np.arange(len(f)), np.arange(len(f))])]
    for step in (1, 2):
        first = np.arange(len(f) - step)
        second = first + step
        ratio = height[first] / height[second]
        paired = (f[second] - f[first] < WIDEST_MHZ) & (ratio < UNLIKE) & (ratio > 1 / UNLIKE)
        members.append(np.column_stack([first[paired], second[paired]]))
    both = np.concatenate(members)
    if alone:
        doublets = both[len(f) :]
        both = np.concatenate([np.delete(both[: len(f)], np.unique(doublets), axis=0), doublets])
    split = both[:, 0] != both[:, 1]
    centre = f[both].mean(axis=1)
    order = np.argsort(centre, kind="stable")  # stable: doublets at one centre keep their order
    # two peaks measure their centre √2 better
    error = np.sqrt((peaks.uncertainty_mhz[both] ** 2).mean(axis=1) / np.where(split, 2, 1))
    # the centre of unequal components is uncertain by some part of their distance
    error = error + 0.01 * (f[both[:, 1]] - f[both[:, 0]])
    total = np.where(split, height[both].sum(axis=1), height[both[:, 0]])  # a doublet has the intensity of both
    doubled = replace(
        peaks, frequency_mhz=centre[order], intensity=total[order], uncertainty_mhz=error[order],
        stated_windows=peaks.windows,
    )  # fmt: skip
    return doubled, both[order]


def split_lines(peaks: PeakList, assigned: Ints, left: NDArray[np.bool_]) -> tuple[int, float]:
    """Number of assigned peaks with an unassigned one of similar height within 3 MHz, and the number expected by chance.

    assigned: peaks of lines. left (n,): peaks without a species. The chance follows from the density of such peaks within 90 MHz.
    """
    f, height = peaks.frequency_mhz, peaks.intensity
    near, expected = 0, 0.0
    for peak in np.unique(assigned).tolist():
        ratio = height / height[peak]
        distance = np.abs(f - f[peak])[left & (ratio < UNLIKE) & (ratio > 1 / UNLIKE)]
        near += bool((distance < WIDEST_MHZ).any())
        around = (distance >= WIDEST_MHZ) & (distance < AROUND * WIDEST_MHZ)
        expected += -math.expm1(-float(around.sum()) / (AROUND - 1))
    return near, expected


def look_split(near: int, expected: float) -> bool:
    """Whether more lines have a near peak than chance explains.

    >>> look_split(12, 1.0), look_split(4, 0.1), look_split(12, 9.0)
    (True, False, False)
    """
    return near >= LEAST_SPLIT and near > expected + SPREADS * math.sqrt(expected)
