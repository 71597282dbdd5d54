"""Weighted residuals and their derivatives for any constants, with blends, a-priori values and robust losses.

A level is labelled by its block and rank, so that no iteration reassigns a line.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.fitting.assignment import Assignments
from rotor.fitting.parameters import Parameters
from rotor.quantum.labels.labelled import LevelModel

LOSSES = ("squares", "huber", "cauchy")
POOR_RMS = 10.0  # default weighted rms above which the constants do not describe the lines
# residuals (in σ) beyond which a loss deviates from r²; gives 95 % efficiency for normal errors
_HUBER, _CAUCHY = 1.345, 2.385
_CANCELLED = 1e-12  # relative to the level derivatives: smaller differences between two levels are round-off
_NONE = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class FitOptions:
    """Options of a fit.

    reject_above : lines with |obs - calc| above this many errors do not count and are reported. None: all lines count
    loss : "squares", "huber" or "cauchy"; the last two reduce the weight of lines beyond 1.3 or 2.4 errors
    default_error_mhz : error of lines with 0 in the file. None: such lines are left out and reported
    poor_rms : weighted rms above which the fit has failed
    tolerance, most_iterations : limits of the search, see `rotor.statistics.least_squares.minimise`
    kmax : truncation of the basis of an asymmetric top, as SPFIT's KNMAX; None for the whole basis
    leave_out_missing : leave out and report lines with a level that does not exist, as SPFIT does; otherwise an error
    pass_interrupt : raise a KeyboardInterrupt to the caller (a fit among many); otherwise the fit ends with its best point
    """

    reject_above: float | None = None
    loss: str = "squares"
    default_error_mhz: float | None = None
    poor_rms: float = POOR_RMS
    tolerance: float = 1e-4
    most_iterations: int = 100
    kmax: int | None = None
    leave_out_missing: bool = False
    pass_interrupt: bool = False

    def __post_init__(self) -> None:
        if self.loss not in LOSSES:
            raise ValueError(f"loss {self.loss!r}: one of {', '.join(LOSSES)} is needed")
        for name in ("reject_above", "default_error_mhz", "poor_rms", "tolerance"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise ValueError(f"{name} = {value!r}: a finite number above 0 is needed")


def robust(residuals: Floats, loss: str) -> tuple[Floats, Floats]:
    """sign(r) √ρ(r²) and its derivative; ρ = r² for "squares".

    Huber: r² up to c, then 2 c |r| - c². Cauchy: c² ln(1 + r²/c²). Source: P. J. Huber, Robust Statistics (1981).
    """
    r, size = residuals, np.abs(residuals)
    if loss == "huber":
        far = size > _HUBER
        # the square of the root is the loss, so that least squares minimizes it
        root = np.sqrt(np.where(far, 2 * _HUBER * size - _HUBER**2, r**2))
        slope = np.where(far, _HUBER / np.where(far, root, 1.0), 1.0)
        return np.sign(r) * root, slope
    if loss == "cauchy":
        root = _CAUCHY * np.sqrt(np.log1p((r / _CAUCHY) ** 2))
        near = size < 1e-6  # the slope tends to 1 at r = 0, where its formula is 0/0
        slope = np.where(near, 1.0, size / (1 + (r / _CAUCHY) ** 2) / np.where(near, 1.0, root))
        return np.sign(r) * root, slope
    return residuals, np.ones_like(residuals)


class Blends(NamedTuple):
    """The measured frequencies that count, with the lines of each.

    first : index of the first line of each frequency. order : lines sorted by frequency; starts : where each frequency begins in
    `order`; shares : weights within blends. plain : no blends. in_order : all lines count, in their original order
    blended, members, bounds : indices of the blends, of their lines in `order`, and where each blend begins among `members`
    """

    first: Ints
    order: Ints
    starts: Ints
    shares: Floats
    plain: bool
    in_order: bool
    blended: Ints
    members: Ints
    bounds: Ints

    @classmethod
    def from_lines(cls, lines: Assignments, used: NDArray[np.bool_]) -> Blends:
        """The blends among the lines that are used; without weights the lines of a blend count equally."""
        rows = np.flatnonzero(used)
        # stable: lines of a blend stay in the order of the list
        order = rows[np.argsort(lines.blend[rows], kind="stable")]
        blend = lines.blend[order]
        starts = np.flatnonzero(np.concatenate(([True], np.diff(blend) != 0))) if len(order) else np.zeros(0, np.int64)
        weights = np.where(lines.weight[order] > 0, lines.weight[order], 0.0)
        totals = np.add.reduceat(weights, starts) if len(starts) else np.zeros(0)  # reduceat refuses an empty list
        counts = np.diff(np.append(starts, len(order)))
        each = np.repeat(np.arange(len(starts)), counts)
        equal = 1.0 / counts[each] if len(order) else weights
        # a blend without weights is the plain mean
        shares = np.where(totals[each] > 0, weights / np.where(totals[each] > 0, totals[each], 1.0), equal)
        blended = np.flatnonzero(counts > 1)
        bounds = np.concatenate([[0], np.cumsum(counts[blended])[:-1]]).astype(np.int64)
        members = np.flatnonzero(np.isin(each, blended))
        first = order[starts]
        each_line = np.array_equal(first, np.arange(len(lines)))
        return cls(first, order, starts, shares, len(blended) == 0, each_line, blended, members, bounds)

    def mean(self, values: Floats) -> Floats:
        """The weighted mean of values (lines, ...) over each measured frequency."""
        if self.plain and self.in_order:
            return values
        out = values[self.first]
        if not self.plain:
            shares = self.shares[self.members].reshape(-1, *[1] * (values.ndim - 1))
            out[self.blended] = np.add.reduceat(values[self.order[self.members]] * shares, self.bounds, axis=0)
        return out

    def spread_back(self, means: Floats, values: Floats) -> Floats:
        """Values (lines,) with each measured frequency's mean in place of its lines."""
        out = values.copy()
        out[self.order] = np.repeat(means, np.diff(np.append(self.starts, len(self.order))))
        return out


class LineValues(NamedTuple):
    """Calculated frequencies (lines,), their derivatives (lines, n), those of the levels (levels, n), the largest |E|; MHz."""

    calculated: Floats
    derivatives: Floats
    slopes: Floats
    largest_mhz: float


@dataclass(frozen=True, eq=False)
class Search:
    """The lines, level model and parameters that give residuals and derivatives at any point."""

    lines: Assignments
    model: LevelModel
    parameters: Parameters
    options: FitOptions
    upper: Ints
    lower: Ints
    sigma: Floats
    used: NDArray[np.bool_]

    def line_values(self, values: Floats) -> LineValues:
        """Calculated frequencies, and the derivatives of lines and levels.

        The last point is cached, because the search ends at a point that it has evaluated.
        """
        point = values.tobytes()
        before: tuple[bytes, LineValues] | None = self.__dict__.get("_last")
        if before is None or before[0] != point:
            before = self.__dict__["_last"] = (point, self._line_values(values))
        return before[1]

    def _line_values(self, values: Floats) -> LineValues:
        energies, slopes = self.model.levels(self.parameters.to_constants(values))
        slopes = self.parameters.to_parameter_slopes(slopes)
        if self.from_zero:  # their lower level has index -1, which selects the last row
            energies, slopes = np.append(energies, 0.0), np.vstack([slopes, np.zeros(slopes.shape[1])])
        derivatives = slopes[self.upper]
        derivatives -= slopes[self.lower]
        largest = float(np.abs(energies).max(initial=0.0))
        return LineValues(energies[self.upper] - energies[self.lower], derivatives, slopes, largest)

    @property
    def from_zero(self) -> bool:
        """Which lines are energies above the zero of the Hamiltonian; their lower level has index -1."""
        return bool((self.lower < 0).any())

    @property
    def grouping(self) -> Blends:
        return Blends.from_lines(self.lines, self.used)

    def evaluate(self, values: Floats) -> tuple[Floats, Floats]:
        """Weighted residuals, followed by those of a-priori values, and the Jacobian."""
        return self.bent(*self.weighted(values))

    def weighted(self, values: Floats) -> tuple[Floats, Floats]:
        """(obs - calc)/σ, spreads of blends, deviations from a-priori values; and the derivatives of their negatives."""
        calculated, jacobian = self.line_values(values)[:2]
        group = self.group
        sigma = self.sigma[group.first]
        residuals = (self.lines.frequency_mhz[group.first] - group.mean(calculated)) / sigma
        rows = group.mean(jacobian) / sigma[:, None]
        spread, spread_slopes = self._apart(calculated, jacobian)
        with_prior = np.flatnonzero(np.isfinite(self.parameters.prior))
        prior = self.parameters.prior[with_prior]
        behind = np.zeros((len(with_prior), len(values)))
        behind[np.arange(len(with_prior)), with_prior] = 1 / prior
        if not len(with_prior) and not len(spread):
            return residuals, rows
        held = (self.parameters.expected - values)[with_prior] / prior
        return np.concatenate([residuals, spread, held]), np.vstack([rows, spread_slopes, behind])

    def _apart(self, calculated: Floats, jacobian: Floats) -> tuple[Floats, Floats]:
        """√w (mean - calculated)/width for the components of blends of known width, and the derivatives of its negative.

        Together with the residual of the mean, χ² contains (obs - mean)²/σ² + Σ w (calculated - mean)²/width², with Σ w = 1.
        """
        group, places = self.group, self.wide
        if not len(places):
            return np.zeros(0), np.zeros((0, jacobian.shape[1]))
        rows = group.order[places]
        group_numbers = np.searchsorted(group.starts, places, side="right") - 1
        widths = np.array([self.lines.widths_mhz[number] for number in self.lines.blend[rows].tolist()])
        factor = np.sqrt(group.shares[places]) / widths
        means, mean_slopes = group.mean(calculated)[group_numbers], group.mean(jacobian)[group_numbers]
        return factor * (means - calculated[rows]), factor[:, None] * (jacobian[rows] - mean_slopes)

    @property
    def wide(self) -> Ints:
        """Indices in `group.order` of the components of blends with a known width."""
        numbers = self.lines.blend[self.group.order]
        return np.flatnonzero(np.isin(numbers, list(self.lines.widths_mhz))) if self.lines.widths_mhz else _NONE

    @property
    def group(self) -> Blends:
        cached: Blends | None = self.__dict__.get("_group")
        if cached is None:
            cached = self.grouping
            self.__dict__["_group"] = cached
        return cached

    def bent(self, residuals: Floats, jacobian: Floats) -> tuple[Floats, Floats]:
        """For a robust loss, sign(r) √ρ(r²) in place of r, so that Σ ρ is minimised."""
        count = len(self.group.first)
        bent, slope = robust(residuals[:count], self.options.loss)
        if self.options.loss == "squares":
            return residuals, jacobian
        factor = np.concatenate([slope, np.ones(len(residuals) - count)])
        return np.concatenate([bent, residuals[count:]]), jacobian * factor[:, None]


def round_off(search: Search, slopes: Floats) -> Floats:
    """Norms (n,) below which a weighted column is round-off left by cancelling level derivatives."""
    size = (np.abs(slopes[search.upper]) + np.abs(slopes[search.lower])) / search.sigma[:, None]
    return np.asarray(_CANCELLED * np.sqrt(np.einsum("ij,ij->j", size[search.used], size[search.used])))


def too_few(lines: Assignments, used: NDArray[np.bool_], parameters: Parameters) -> str:
    """A message if there are fewer measured frequencies than free constants; empty otherwise."""
    count = len(set(lines.blend[used].tolist())) + parameters.prior_count
    if count >= len(parameters.names):
        return ""
    return f"{len(parameters.names)} free constants for {count} measured frequencies; free fewer, or add lines"


def line_errors(lines: Assignments, options: FitOptions) -> tuple[dict[int, str], Floats]:
    """Reasons why lines do not count (excluded, or without an error), by index; and the errors with the default filled in."""
    excluded = {int(i): "it is marked as excluded" for i in np.flatnonzero(lines.is_excluded)}
    zero = lines.error_mhz == 0
    if zero.all() and options.default_error_mhz is None:
        raise ValueError(
            f"{lines.source or 'the lines'}: all lines have an error of 0: give errors in the file, or a common error "
            "(default_error_mhz)"
        )
    if options.default_error_mhz is not None:
        return excluded, np.where(zero, options.default_error_mhz, lines.error_mhz)
    left_out = {int(i): "its error is 0" for i in np.flatnonzero(zero)} | excluded
    # any number above 0 will do: lines without an error do not count
    return left_out, np.where(zero, 1.0, lines.error_mhz)
