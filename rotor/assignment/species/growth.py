"""From a root to a species: lines are added as they become predictable, until none is left.

The constants c = (A, B, C, quartic) have a Gaussian distribution with covariance C: a-priori errors of the quartic ones, then least
squares with the matched lines. A predicted line has the standard error √(gᵀCg + σ²), g = ∂ν/∂c. It is matched to a peak of suitable
intensity within 3.5 standard errors if a chance match is unlikely. Each round refits; the errors decrease, and further lines can be
matched.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.assignment.search import _kernels
from rotor.assignment.search.roots import SPREAD, Candidate, Field
from rotor.assignment.species.grown import LEAST_RATIO, Grown
from rotor.assignment.species.likelihood import (
    best_temperature,
    joint_ratio,
    line_errors,
    line_slopes,
    merged_lines,
    predict,
    type_ratios,
    variances,
)

SOFTEST_MHZ = 3e6  # 100 cm⁻¹: vibrational wavenumber for the a-priori sizes of quartic constants
ROUNDS = 24
WINDOW = 3.5  # standard errors
MOST_IN_WINDOW = 12  # peaks; a line with more is not matched
FEW = 12  # lines up to which a window may hold more chance peaks
FIRST_CHANCE, LAST_CHANCE, RISE = 0.003, 0.05, 1.6  # this limit with more lines, increasing by round: safe lines first
SMALLEST_MHZ = 0.003  # smallest standard error of a peak
# smallest share of a peak for an assigned line; the peak does not measure the frequency of a weaker one
LEAST_SHARE = 0.1
MOST_OF_TYPE = 60  # strongest lines of a type that tell its intensity while lines are added
FIRST_MHZ = 0.05  # standard error of the family's lines, for distortion
LARGER = (10.0, 40.0)  # factors of the errors when a species is grown again


def quartic_sizes(constants: Floats) -> Floats:
    """A-priori standard errors of DJ, DJK, DK, d1, d2 (5,), MHz: 4B³/ω² with ω = 100 cm⁻¹ and like products.

    A. Kratzer, Z. Phys. 3, 289 (1920): D = 4B³/ω² for a diatomic molecule.
    """
    a, b, c = constants[:3]
    mean = (b + c) / 2
    return 4 / SOFTEST_MHZ**2 * np.array([mean**3, a * mean**2, a**3, mean**3 / 2, mean**3 / 6])


def quartic_prior(field: Field, constants: Floats) -> tuple[Floats, Floats]:
    """A-priori values and standard errors of the quartic constants: about 0, or those of a parent within a fifth of their size."""
    if field.parent is None:
        return np.zeros(5), quartic_sizes(constants)
    # a fifth of the parent's constants, and a hundredth of typical sizes where they are 0
    return field.parent[3:], 0.2 * np.abs(field.parent[3:]) + 0.01 * quartic_sizes(constants)


def prior_weight(field: Field, constants: Floats, sizes: Floats) -> Floats:
    """1/σ² of all constants (8, 8) before any line is assigned; A, B, C to 5 % by default."""
    # without a stated spread 5 % of each constant
    spread = 0.05 * constants[:3] if field.spread is None else field.spread
    return np.diag(1 / np.concatenate([spread, sizes]) ** 2)


def grow(field: Field, start: Candidate, rounds: int = ROUNDS) -> Grown | None:
    """Grow a species from a candidate; None if its constants leave the order A > B > C."""
    centre, sizes = quartic_prior(field, start.constants)
    constants = np.concatenate([start.constants, centre])
    prior = prior_weight(field, constants, sizes)
    slopes = line_slopes(field, start.family.lines, constants)
    covariance = np.asarray(np.linalg.inv(slopes.T @ slopes / FIRST_MHZ**2 + prior), dtype=np.float64)
    return grown_from(field, constants, covariance, prior, FIRST_MHZ, start, rounds)


def regrown(field: Field, species: Grown) -> Grown:
    """The species grown again from its constants with larger errors, if that increases the evidence.

    This removes lines that were matched too early and exclude others.
    """
    return max([species, *grown_anew(field, species)], key=lambda rival: rival.evidence)


def grown_anew(field: Field, species: Grown) -> list[Grown]:
    """A species grown from its constants with errors larger by the factors `LARGER`; the field may hold other peaks."""
    if species.start is None:
        return []
    _, sizes = quartic_prior(field, species.constants)
    prior = prior_weight(field, species.constants, sizes)
    sigma0 = max(3 * species.rms_mhz, SMALLEST_MHZ)
    begin = species.start._replace(temperature_k=species.temperature_k)
    grown = []
    for factor in LARGER:
        covariance = np.asarray(np.linalg.inv(np.linalg.inv(species.covariance) / factor**2 + prior), dtype=np.float64)
        grown.append(grown_from(field, species.constants, covariance, prior, sigma0, begin, ROUNDS))
    return [species for species in grown if species is not None]


def grown_from(
    field: Field, constants: Floats, covariance: Floats, prior: Floats, sigma0: float, start: Candidate, rounds: int
) -> Grown | None:
    """Rounds of matching and refitting until no line is added."""
    temperature, last, before = start.temperature_k, -1, -1
    grown: Grown | None = None
    for turn in range(rounds):
        if turn == 1 or (turn and turn % 3 == 0):
            temperature = best_temperature(field, constants, covariance, sigma0)
        chance = min(LAST_CHANCE, FIRST_CHANCE * RISE**turn) if last > FEW else field.chance_of_few
        matched = _matched(field, constants, covariance, temperature, sigma0, chance, grown)
        # few matches so far: a larger chance is allowed
        while chance < field.chance_of_few and (matched is None or len(np.unique(matched.peak)) < FEW):
            chance = min(3 * chance, field.chance_of_few)
            matched = _matched(field, constants, covariance, temperature, sigma0, chance, grown)
        if matched is None or len(matched.peak) < 5:
            return None
        constants, covariance, sigma0, grown = _refitted(field, constants, prior, temperature, matched, sigma0, start)
        if not (constants[0] > constants[1] > constants[2] > 0):
            return None
        if turn > 7 and turn % 3 == 2 and grown.lines <= before:
            break
        if turn % 3 == 2:
            before = grown.lines
        last = grown.lines
    return None if grown is None else with_evidence(field, grown)


@dataclass(frozen=True, eq=False)
class _Matched:
    rows: Ints
    peak: Ints
    share: Floats
    ratios: Floats
    scales: Floats


def _matched(
    field: Field,
    constants: Floats,
    covariance: Floats,
    temperature_k: float,
    sigma0: float,
    most_chance: float,
    before: Grown | None,
) -> _Matched | None:
    """The lines matched to peaks."""
    lines = predict(field, constants, temperature_k)
    errors = np.minimum(line_errors(line_slopes(field, lines.row, constants), covariance, sigma0), 2.0)
    ratios, scales = type_ratios(field, lines, errors, MOST_OF_TYPE)
    if not (ratios > LEAST_RATIO).any():
        return None
    merged = merged_lines(field, constants, lines, np.where(ratios > LEAST_RATIO, scales, -np.inf))
    if not len(merged.centre):
        return None
    variance = variances(merged.slope, covariance)
    centre, variance = _predicted_by_others(field, before, merged.main, merged.centre, variance)
    chosen = _nearest(field, centre, merged.height, np.sqrt(variance + sigma0**2), most_chance)
    peak = _without_doubles(chosen, merged.height)[merged.blend]
    mask = (peak >= 0) & (merged.share > LEAST_SHARE)
    return _Matched(merged.row[mask], peak[mask], merged.share[mask], ratios, scales)


def _predicted_by_others(
    field: Field, before: Grown | None, rows: Ints, centre: Floats, variance: Floats
) -> tuple[Floats, Floats]:
    """Predictions of lines and their variances, without the lines' own contributions in the last round.

    An observation of weight w has leverage h = w g C gᵀ; without it the variance is g C gᵀ/(1-h) and the prediction moves by
    -r h/(1-h) (R. D. Cook and S. Weisberg, Residuals and Influence in Regression (1982), section 2.2).
    """
    if before is None:
        return centre, variance
    weight, residual = np.zeros(len(field.table.upper)), np.zeros(len(field.table.upper))
    weight[before.rows], residual[before.rows] = before.weight, before.residual
    leverage = np.minimum(weight[rows] * variance, 0.9999)  # a leverage of 1 has no prediction by the others
    return centre - residual[rows] * leverage / (1 - leverage), variance / (1 - leverage)


def _nearest(field: Field, centre: Floats, height: Floats, errors: Floats, most_chance: float) -> Ints:
    """The peak matched to each line (lines,), or -1."""
    peaks = field.peaks
    chosen: Ints = _kernels.nearest_peaks(
        centre, height, errors, WINDOW, most_chance, peaks.frequency_mhz, peaks.log_intensity, peaks.log_density, SPREAD,
        MOST_IN_WINDOW,
    )  # fmt: skip
    return chosen


def _without_doubles(chosen: Ints, height: Floats) -> Ints:
    """Match each peak to one line only, the strongest."""
    out = chosen.copy()
    for peak in np.flatnonzero(np.bincount(chosen[chosen >= 0], minlength=1) > 1).tolist():
        rivals = np.flatnonzero(chosen == peak)
        out[rivals] = -1  # a peak belongs to its strongest line
        out[rivals[np.argmax(height[rivals])]] = peak
    return out


def _refitted(
    field: Field,
    constants: Floats,
    prior: Floats,
    temperature: float,
    matched: _Matched,
    sigma0: float,
    start: Candidate,
) -> tuple[Floats, Floats, float, Grown]:
    """A step of weighted least squares; distant lines have lower weights."""
    peaks = field.peaks
    energy = np.empty(len(field.jj))
    _kernels.level_energies(field.table.levels, field.table.theta, field.jj, constants, energy)
    calculated = energy[field.table.upper[matched.rows]] - energy[field.table.lower[matched.rows]]
    slopes = line_slopes(field, matched.rows, constants)
    change = field.jj[field.table.upper[matched.rows]] - field.jj[field.table.lower[matched.rows]]
    peak, group = np.unique(matched.peak, return_inverse=True)
    total = np.bincount(group, matched.share)
    share = matched.share / total[group]
    centre = np.bincount(group, share * calculated)
    slope = np.zeros((len(peak), slopes.shape[1]))
    np.add.at(slope, group, share[:, None] * slopes)
    residual = peaks.frequency_mhz[peak] - centre
    peak_errors = np.maximum(peaks.uncertainty_mhz[peak], SMALLEST_MHZ)
    sigma = np.maximum(peak_errors, sigma0 / 1.5)
    # a Cauchy weight: lines beyond 2.4 errors count less
    weight = 1 / (sigma**2 * (1 + (residual / (2.4 * sigma)) ** 2))
    normal = slope.T @ (weight[:, None] * slope) + prior
    pull = slope.T @ (weight * residual)
    pull[3:] -= np.diag(prior)[3:] * (constants[3:] - quartic_prior(field, constants)[0])
    covariance = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    new = constants + covariance @ pull
    after = residual - slope @ (new - constants)
    # 1.4826 turns a median deviation into a standard deviation; four degrees of freedom are used up
    scatter = 1.4826 * float(np.median(np.abs(after))) * np.sqrt(len(peak) / max(len(peak) - 4, 1.0))
    sigma0 = float(np.clip(max(scatter, np.median(peak_errors)), SMALLEST_MHZ, sigma0))
    grown = Grown(
        new, covariance, temperature, matched.ratios, matched.scales, matched.rows, matched.peak, after[group], matched.share,
        weight[group],
        float(np.sqrt(np.mean(after**2))), 0.0, start, len(np.unique(matched.peak[change != 0])),
    )  # fmt: skip
    return new, covariance, sigma0, grown


def with_evidence(field: Field, grown: Grown) -> Grown:
    """Add the evidence against chance to a species.

    ln Z = ln L/L₀ - ½ Σ (c/σ_prior)² + ½ ln det(C/σ_prior²) for the quartic constants; for A, B, C the prior is uniform in the volume V
    of the bounds, which gives - ln V + ½ ln det(2π C) (Laplace's approximation; D. J. C. MacKay, Information Theory, Inference, and
    Learning Algorithms (2003), eq. 28.10).
    """
    sigma0 = 1.3 * max(1.4826 * float(np.median(np.abs(grown.residual))), SMALLEST_MHZ)
    lines = predict(field, grown.constants, grown.temperature_k)
    ratios, scales = type_ratios(field, lines, np.full(len(lines.row), sigma0), 2 * MOST_OF_TYPE)
    active = ratios > LEAST_RATIO
    best = joint_ratio(field, grown.constants, lines, np.where(active, scales, -np.inf), sigma0)
    for q in np.flatnonzero(active).tolist():
        fewer = active.copy()
        fewer[q] = False
        rest = np.where(fewer, scales, -np.inf)
        without = joint_ratio(field, grown.constants, lines, rest, sigma0) if fewer.any() else 0.0
        if without > best:
            best, active = without, fewer
    centre, sizes = quartic_prior(field, grown.constants)
    volume = float(np.log(field.bounds.high - field.bounds.low).sum())
    scaled = grown.covariance.copy()
    scaled[3:] /= sizes[:, None]
    scaled[:, 3:] /= sizes[None, :]
    _, determinant = np.linalg.slogdet(scaled)
    occam = (
        0.5 * determinant
        + 1.5 * np.log(2 * np.pi)
        - volume
        - 0.5 * float(np.sum(((grown.constants[3:] - centre) / sizes) ** 2))
    )
    return replace(
        grown, ratios=np.where(active, ratios, 0.0), scales=np.where(active, scales, -np.inf), evidence=best + occam
    )
