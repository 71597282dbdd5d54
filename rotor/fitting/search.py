"""The search of a fit: weighted residuals and their derivatives for any constants, blends, robust losses, far-off lines, stages.

Levels keep their label by block and rank, so that no iteration reassigns a line.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.fitting.assignment import Assignments
from rotor.fitting.parameters import Parameters
from rotor.quantum.labelled import LevelModel

LOSSES = ("squares", "huber", "cauchy")
POOR_RMS = 10.0  # weighted rms above which the lines are not described, unless the caller says otherwise
_HUBER, _CAUCHY = 1.345, 2.385  # σ at which a loss bends: 95 % efficiency for normal errors
_CANCELLED = 1e-12  # of the level derivatives: what is left of differences below it is round-off
_NONE = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class FitOptions:
    """How a fit is done.

    reject_above : lines with |obs - calc| above so many errors do not count; they are reported. None: every line counts
    loss : "squares", or "huber" or "cauchy", whose weight falls for lines beyond 1.3 or 2.4 errors
    default_error_mhz : of lines whose file gives 0; such lines are left out, and reported, where it is None
    poor_rms : weighted rms above which the fit has failed
    tolerance, most_iterations : of the search, see `rotor.statistics.least_squares.minimise`
    kmax : cut of the basis of an asymmetric top, as SPFIT's KNMAX; None for the whole basis
    leave_out_missing : lines with a level that does not exist are left out, and named, as SPFIT does; else they are an error
    pass_interrupt : a KeyboardInterrupt goes on to the caller, of a fit that is one of many; else the fit ends with its best point
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
        root = np.sqrt(np.where(far, 2 * _HUBER * size - _HUBER**2, r**2))
        slope = np.where(far, _HUBER / np.where(far, root, 1.0), 1.0)
        return np.sign(r) * root, slope
    if loss == "cauchy":
        root = _CAUCHY * np.sqrt(np.log1p((r / _CAUCHY) ** 2))
        near = size < 1e-6
        slope = np.where(near, 1.0, size / (1 + (r / _CAUCHY) ** 2) / np.where(near, 1.0, root))
        return np.sign(r) * root, slope
    return residuals, np.ones_like(residuals)


class Grouping(NamedTuple):
    """The measured frequencies that count: for each the position of its first line; order, starts, shares: how blends add.

    plain : no blend among them. each : every line counts, in its order
    blended, members, bounds : which of them are blends, the places of their lines in `order`, and where each begins among these
    """

    first: Ints
    order: Ints
    starts: Ints
    shares: Floats
    plain: bool
    each: bool
    blended: Ints
    members: Ints
    bounds: Ints

    @classmethod
    def of(cls, lines: Assignments, used: NDArray[np.bool_]) -> Grouping:
        rows = np.flatnonzero(used)
        order = rows[np.argsort(lines.blend[rows], kind="stable")]
        blend = lines.blend[order]
        starts = np.flatnonzero(np.concatenate(([True], np.diff(blend) != 0))) if len(order) else np.zeros(0, np.int64)
        weights = np.where(lines.weight[order] > 0, lines.weight[order], 0.0)
        totals = np.add.reduceat(weights, starts) if len(starts) else np.zeros(0)
        counts = np.diff(np.append(starts, len(order)))
        each = np.repeat(np.arange(len(starts)), counts)
        equal = 1.0 / counts[each] if len(order) else weights
        shares = np.where(totals[each] > 0, weights / np.where(totals[each] > 0, totals[each], 1.0), equal)
        blended = np.flatnonzero(counts > 1)
        bounds = np.concatenate([[0], np.cumsum(counts[blended])[:-1]]).astype(np.int64)
        members = np.flatnonzero(np.isin(each, blended))
        first = order[starts]
        each_line = np.array_equal(first, np.arange(len(lines)))
        return cls(first, order, starts, shares, len(blended) == 0, each_line, blended, members, bounds)

    def mean(self, values: Floats) -> Floats:
        """The weighted mean over each blend of values (lines, ...); these themselves where every line stands alone."""
        if self.plain and self.each:
            return values
        out = values[self.first]
        if not self.plain:
            shares = self.shares[self.members].reshape(-1, *[1] * (values.ndim - 1))
            out[self.blended] = np.add.reduceat(values[self.order[self.members]] * shares, self.bounds, axis=0)
        return out

    def spread_back(self, means: Floats, values: Floats) -> Floats:
        """Values (lines,) with those of a blend replaced by its mean."""
        out = values.copy()
        out[self.order] = np.repeat(means, np.diff(np.append(self.starts, len(self.order))))
        return out


class LineValues(NamedTuple):
    """Calculated lines (lines,), derivatives by the parameters (lines, n), those of the levels (levels, n), the largest |E| in MHz."""

    calculated: Floats
    derivatives: Floats
    slopes: Floats
    largest_mhz: float


@dataclass(frozen=True, eq=False)
class Search:
    """What is evaluated at each point."""

    lines: Assignments
    model: LevelModel
    parameters: Parameters
    options: FitOptions
    upper: Ints
    lower: Ints
    sigma: Floats
    used: NDArray[np.bool_]

    def lines_of(self, values: Floats) -> LineValues:
        """Calculated lines, and derivatives of these and of the levels.

        The last point is not computed a second time: the search ends where it was.
        """
        point = values.tobytes()
        before: tuple[bytes, LineValues] | None = self.__dict__.get("_last")
        if before is None or before[0] != point:
            before = self.__dict__["_last"] = (point, self._lines_of(values))
        return before[1]

    def _lines_of(self, values: Floats) -> LineValues:
        energies, slopes = self.model.levels(self.parameters.constants_of(values))
        slopes = self.parameters.slopes_of(slopes)
        if self.from_zero:  # the place -1 of such lower levels is the last one
            energies, slopes = np.append(energies, 0.0), np.vstack([slopes, np.zeros(slopes.shape[1])])
        derivatives = slopes[self.upper]
        derivatives -= slopes[self.lower]
        largest = float(np.abs(energies).max(initial=0.0))
        return LineValues(energies[self.upper] - energies[self.lower], derivatives, slopes, largest)

    @property
    def from_zero(self) -> bool:
        """Whether a line is an energy from the zero of the Hamiltonian: its lower level has the place -1."""
        return bool((self.lower < 0).any())

    @property
    def grouping(self) -> Grouping:
        return Grouping.of(self.lines, self.used)

    def evaluate(self, values: Floats) -> tuple[Floats, Floats]:
        """Weighted residuals, those of a-priori values behind them, and the Jacobian."""
        return self.bent(*self.weighted(values))

    def weighted(self, values: Floats) -> tuple[Floats, Floats]:
        calculated, jacobian = self.lines_of(values)[:2]
        group = self.group
        sigma = self.sigma[group.first]
        residuals = (self.lines.frequency_mhz[group.first] - group.mean(calculated)) / sigma
        rows = group.mean(jacobian) / sigma[:, None]
        spread, of_spread = self._apart(calculated, jacobian)
        known = np.flatnonzero(np.isfinite(self.parameters.prior))
        prior = self.parameters.prior[known]
        behind = np.zeros((len(known), len(values)))
        behind[np.arange(len(known)), known] = 1 / prior
        if not len(known) and not len(spread):
            return residuals, rows
        held = (self.parameters.expected - values)[known] / prior
        return np.concatenate([residuals, spread, held]), np.vstack([rows, of_spread, behind])

    def _apart(self, calculated: Floats, jacobian: Floats) -> tuple[Floats, Floats]:
        """√w (mean - calculated)/width of the components of blends of a known width, and the derivatives of the negative.

        With the mean's own residual they make (obs - mean)²/σ² + Σ w (calculated - mean)²/width², w of the sum 1.
        """
        group, places = self.group, self.wide
        if not len(places):
            return np.zeros(0), np.zeros((0, jacobian.shape[1]))
        rows = group.order[places]
        of_group = np.searchsorted(group.starts, places, side="right") - 1
        widths = np.array([self.lines.widths_mhz[number] for number in self.lines.blend[rows].tolist()])
        factor = np.sqrt(group.shares[places]) / widths
        means, of_means = group.mean(calculated)[of_group], group.mean(jacobian)[of_group]
        return factor * (means - calculated[rows]), factor[:, None] * (jacobian[rows] - of_means)

    @property
    def wide(self) -> Ints:
        """Places, in the order of the groups, of the components of blends whose width is known."""
        numbers = self.lines.blend[self.group.order]
        return np.flatnonzero(np.isin(numbers, list(self.lines.widths_mhz))) if self.lines.widths_mhz else _NONE

    @property
    def group(self) -> Grouping:
        cached: Grouping | None = self.__dict__.get("_group")
        if cached is None:
            cached = self.grouping
            self.__dict__["_group"] = cached
        return cached

    def bent(self, residuals: Floats, jacobian: Floats) -> tuple[Floats, Floats]:
        """√ρ(r²) with its sign in place of r for a robust loss, so that Σ ρ is what is made least."""
        count = len(self.group.first)
        bent, slope = robust(residuals[:count], self.options.loss)
        if self.options.loss == "squares":
            return residuals, jacobian
        factor = np.concatenate([slope, np.ones(len(residuals) - count)])
        return np.concatenate([bent, residuals[count:]]), jacobian * factor[:, None]


def round_off(search: Search, slopes: Floats) -> Floats:
    """Norms (n,) of weighted columns below which they are what round-off leaves of level derivatives that cancel."""
    size = (np.abs(slopes[search.upper]) + np.abs(slopes[search.lower])) / search.sigma[:, None]
    return np.asarray(_CANCELLED * np.sqrt(np.einsum("ij,ij->j", size[search.used], size[search.used])))


def too_few(lines: Assignments, used: NDArray[np.bool_], parameters: Parameters) -> str:
    """What is wrong with fewer measured frequencies than free constants; empty where they are enough."""
    count = len(set(lines.blend[used].tolist())) + int(np.isfinite(parameters.prior).sum())
    if count >= len(parameters.names):
        return ""
    return f"{len(parameters.names)} free constants for {count} measured frequencies; free fewer, or add lines"


def errors_of(lines: Assignments, options: FitOptions) -> tuple[dict[int, str], Floats]:
    """Why lines do not count, by position: excluded ones and those without an error; and errors with the default put in."""
    excluded = {int(i): "it is marked as excluded" for i in np.flatnonzero(lines.is_excluded)}
    zero = lines.error_mhz == 0
    if zero.all() and options.default_error_mhz is None:
        raise ValueError(
            f"{lines.source or 'the lines'}: every line has an error of 0: give errors in the file, or one for all of them "
            "(default_error_mhz, --default-error)"
        )
    if options.default_error_mhz is not None:
        return excluded, np.where(zero, options.default_error_mhz, lines.error_mhz)
    left_out = {int(i): "its error is 0" for i in np.flatnonzero(zero)} | excluded
    return left_out, np.where(zero, 1.0, lines.error_mhz)
