"""Groups of lines that alone determine a combination of constants, compared with all other places of the group.

Lines of the highest Ka or J determine distortion constants that no other lines determine. Such a group moves along one direction when
it is left out: with the covariance C of the constants from the other lines and the derivatives G of the group's lines, S = G C Gᵀ has
the leading eigenvalue λ and eigenvector u, and the lines move by a t, a = u √λ, with t of unit variance. The likelihood ratio of the
group's lines at all t in steps of their error gives the probability of the present place, in which the number of alternatives counts
(D. J. C. MacKay, Information Theory, Inference, and Learning Algorithms (2003), chapter 28). A group with a better place is grown from
there; lines of a group without a clear place are left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.assignment.search import _kernels
from rotor.assignment.search.roots import DETECTED, SPREAD, Field
from rotor.assignment.species.grown import LEAST_RATIO, Grown
from rotor.assignment.species.growth import (
    ROUNDS,
    SMALLEST_MHZ,
    WINDOW,
    grown_from,
    prior_weight,
    quartic_prior,
)
from rotor.assignment.species.likelihood import Predicted, line_slopes, merged_lines, predict

CLEAR = 0.999  # least probability of a clear place
REACH = 4.0  # standard deviations over which places are compared
FREE = 3.0  # standard errors of a line by which a group moves that the other lines do not place
SECOND = 5.0  # standard errors of a line by which a group may move in other directions and be left out
FARTHEST_MHZ = 30.0  # of a movement: beyond, the other lines do not predict the group
MOST_STEPS, MOST_LINES = 8000, 60
FEWEST_OTHERS = 6  # peaks without the group
QUANTILES = (0.9, 0.75, 0.5)  # of J, above which lines form a group
BETTER = 2.0  # least gain of evidence of a better place
TURNS = 8  # times that a group changes

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Places:
    """Places of a group: the constants without it (8,), covariance (8, 8), movement (8,) of the constants for t = 1; t (n,) with ln of the
    posterior density of each, not normalised; t of the present place; the largest movement of a matched line in MHz for t = 1, and of a
    line in the second direction."""

    constants: Floats
    covariance: Floats
    movement: Floats
    t: Floats
    log_density: Floats
    present: float
    largest_mhz: float
    second_mhz: float


def confirmed(seen: Field, species: Grown, all_types: bool = False) -> Grown:
    """The species with groups of lines at their best places, without groups that have no clear place.

    all_types : types that the evidence leaves out, because lines at a wrong place are missed, count in groups while lines of them are
    assigned; those that stay left out lose their lines.
    """
    highest = species.evidence
    for _ in range(TURNS):
        for column, least in groups(seen, species):
            checked = _checked(seen, species, column, least, highest + BETTER, all_types)
            if checked is not species:
                break
        else:
            break
        species, highest = checked, max(highest, checked.evidence)
    return _without_absent_types(seen, species) if all_types else species


def groups(seen: Field, species: Grown) -> list[tuple[int, int]]:
    """Column of the quantum numbers and the least value in it of each group: the highest Ka first, then the highest J."""
    quanta = _largest(seen, species.rows)
    high = np.unique(quanta[:, 1])[:0:-1].tolist()
    late = np.unique(np.quantile(quanta[:, 0], QUANTILES).astype(int))[::-1].tolist()
    return [*((1, least) for least in high), *((0, least) for least in late)]


def _largest(seen: Field, rows: Ints) -> Ints:
    """The larger J, Ka, Kc of the two levels of lines (lines, 3)."""
    table = seen.table
    return np.maximum(table.quanta[table.upper[rows]], table.quanta[table.lower[rows]])


def _checked(seen: Field, species: Grown, column: int, least: int, enough: float, all_types: bool) -> Grown:
    """The species itself if the group has a clear place; else grown from a place with enough evidence, or without the group."""
    inside = _largest(seen, species.rows)[:, column] >= least
    taken = np.isin(species.peak, species.peak[inside])  # a peak belongs to the group with all its lines
    if not inside.any() or len(np.unique(species.peak[~taken])) < FEWEST_OTHERS:
        return species
    # 1.4826 turns a median deviation into a standard deviation of normal residuals
    sigma0 = 1.3 * max(1.4826 * float(np.median(np.abs(species.residual))), SMALLEST_MHZ)
    places = _places(seen, species, taken, column, least, sigma0, all_types)
    if places is None:
        return species
    total = np.logaddexp.reduce(places.log_density)
    here = np.abs(places.t - places.present) * places.largest_mhz < WINDOW * np.hypot(sigma0, places.second_mhz)
    if here.any() and np.logaddexp.reduce(places.log_density[here]) - total > np.log(CLEAR):
        return species
    moved = _moved(seen, species, places, sigma0)
    if moved is not None and moved.evidence > enough:
        return moved
    if places.second_mhz > SECOND * sigma0:  # places differ in more than one direction
        return species
    lost = places.log_density[here].max() + 0.5 * places.present**2 if here.any() else 0.0
    return _without(seen, species, places.constants, places.covariance, taken, max(float(lost), 0.0))


def _others(seen: Field, species: Grown, taken: Mask) -> tuple[Floats, Floats]:
    """Constants and covariance from the peaks outside a group."""
    peak, first = np.unique(species.peak, return_index=True)
    slopes = np.zeros((len(peak), len(species.constants)))
    at = np.searchsorted(peak, species.peak)
    np.add.at(slopes, at, species.share[:, None] * line_slopes(seen, species.rows, species.constants))
    slopes /= np.bincount(at, species.share)[:, None]
    weight = np.where(taken[first], 0.0, species.weight[first])
    centre, sizes = quartic_prior(seen, species.constants)
    prior = prior_weight(seen, species.constants, sizes)
    covariance = np.asarray(np.linalg.inv(slopes.T @ (weight[:, None] * slopes) + prior), dtype=np.float64)
    pull = slopes.T @ (weight * species.residual[first])
    pull[3:] -= np.diag(prior)[3:] * (species.constants[3:] - centre)
    return species.constants + covariance @ pull, covariance


def _places(
    seen: Field, species: Grown, taken: Mask, column: int, least: int, sigma0: float, all_types: bool
) -> Places | None:
    """Likelihood of the group at all its places; None where the other lines place it, or do not predict it."""
    constants, covariance = _others(seen, species, taken)
    predicted = predict(seen, species.constants, species.temperature_k)
    scales = np.where(species.ratios > LEAST_RATIO, species.scales, -np.inf)
    if all_types:  # a type without evidence has no scale
        scales = np.maximum(scales, _line_scales(seen, species, predicted))
    lines = merged_lines(seen, species.constants, predicted, scales)
    inside = np.flatnonzero(_largest(seen, lines.main)[:, column] >= least)
    inside = inside[np.argsort(-lines.height[inside], kind="stable")][:MOST_LINES]
    if not len(inside):
        return None
    slopes = lines.slope[inside]
    variances = slopes @ covariance @ slopes.T
    values, vectors = np.linalg.eigh(variances)
    move = vectors[:, -1] * np.sqrt(max(float(values[-1]), 0.0))
    # the length of the largest eigenvector; the limit avoids 0/0
    movement = covariance @ slopes.T @ vectors[:, -1] / np.sqrt(max(float(values[-1]), 1e-30))
    largest = float(np.abs(line_slopes(seen, species.rows[taken], species.constants) @ movement).max())
    second = float(np.abs(vectors[:, -2:-1]).max(initial=0.0) * np.sqrt(max(float(values[:-1].max(initial=0.0)), 0.0)))
    if not FREE * sigma0 < largest < FARTHEST_MHZ:
        return None
    t = np.linspace(-REACH, REACH, int(min(4 * REACH * float(np.abs(move).max()) / sigma0, MOST_STEPS)) + 1)
    present = float(move @ slopes @ (species.constants - constants) / (move @ move))
    # the part of the variance that this direction does not carry, with the scatter of peaks
    rest = np.sqrt(np.maximum(np.diag(variances) - move**2, 0.0) + sigma0**2)
    free = np.setdiff1d(np.arange(len(seen.peaks)), species.peak[~taken])
    peaks = seen.peaks
    ratios = _kernels.joint_ratios_along(
        lines.centre[inside] - present * move, move, t, lines.height[inside], rest, peaks.frequency_mhz[free],
        peaks.log_intensity[free], peaks.log_density[free], peaks.log_threshold, SPREAD, DETECTED,
    )  # fmt: skip
    return Places(constants, covariance, movement, t, ratios - 0.5 * t**2, present, largest, second)


def _moved(seen: Field, species: Grown, places: Places, sigma0: float) -> Grown | None:
    """The species grown from the best place of the group."""
    if species.start is None:
        return None
    best = float(places.t[np.argmax(places.log_density)])
    step = 3 * sigma0 / places.largest_mhz  # three times the scatter, in units of the largest movement
    along = np.outer(places.movement, places.movement)
    _, sizes = quartic_prior(seen, species.constants)
    prior = prior_weight(seen, species.constants, sizes)
    begin = species.start._replace(temperature_k=species.temperature_k)
    covariance = places.covariance - (1 - min(step, 1.0) ** 2) * along
    return grown_from(
        seen,
        species.constants + (best - places.present) * places.movement,
        covariance,
        prior,
        3 * sigma0,
        begin,
        ROUNDS,
    )


def _line_scales(seen: Field, species: Grown, predicted: Predicted) -> Floats:
    """ln of the intensity scales (3,) of types without evidence, from the heights of their assigned lines; -inf without lines."""
    expected = np.full(len(seen.table.upper), np.nan)
    expected[predicted.row] = predicted.expected
    heights = seen.peaks.log_intensity[species.peak] + np.log(species.share) - expected[species.rows]
    kinds, scales = seen.table.kind[species.rows], np.full(3, -np.inf)
    for q in np.flatnonzero(species.ratios <= LEAST_RATIO).tolist():
        known = heights[(kinds == q) & np.isfinite(heights)]
        # the median: a few blended lines do not matter
        scales[q] = float(np.median(known)) if len(known) else -np.inf
    return scales


def _without_absent_types(seen: Field, species: Grown) -> Grown:
    """The species without lines of types that its evidence leaves out: they would determine constants all the same."""
    absent = species.ratios[seen.table.kind[species.rows]] <= LEAST_RATIO
    taken = np.isin(species.peak, species.peak[absent])
    if not absent.any() or len(np.unique(species.peak[~taken])) < FEWEST_OTHERS:
        return species
    return _without(seen, species, *_others(seen, species, taken), taken, 0.0)


def _without(seen: Field, species: Grown, constants: Floats, covariance: Floats, taken: Mask, lost: float) -> Grown:
    """The species without a group of lines, with constants from the other lines; its evidence is lower by that of the group."""
    table, rows, peak = seen.table, species.rows[~taken], species.peak[~taken]
    shift = line_slopes(seen, rows, species.constants) @ (constants - species.constants)
    at = np.unique(peak, return_inverse=True)[1]
    share = species.share[~taken]
    moved = (np.bincount(at, share * shift) / np.bincount(at, share))[at]
    return replace(
        species, constants=constants, covariance=covariance, rows=rows, peak=peak, share=share,
        residual=species.residual[~taken] - moved, weight=species.weight[~taken], evidence=species.evidence - lost,
        moved=len(np.unique(peak[seen.jj[table.upper[rows]] != seen.jj[table.lower[rows]]])),
    )  # fmt: skip
