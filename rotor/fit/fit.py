"""The fit: constants from assigned lines by weighted least squares, with all that is known about the result.

    χ² = Σ ((ν_obs - ν_calc)/σ)² + Σ ((p - p₀)/σ_prior)²,      ν_calc = E(upper) - E(lower), in a blend the weighted mean

The fit knows levels by their labels only: a `LevelModel` gives their energies and derivatives for any constants. Levels keep
their label by block and rank, so that no iteration reassigns a line. A fit has converged when the search is at a minimum and
that minimum describes the lines: a weighted rms far above 1 is a failure and says so.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.fit.assignment import Assignments, duplicates
from rotor.fit.parameters import Parameters, with_names
from rotor.fit.parameters import parameters as parameters_of
from rotor.quantum.labelled import LevelModel, level_model
from rotor.statistics.least_squares import EXHAUSTED, INTERRUPTED, Minimum, Progress, minimise
from rotor.statistics.regression import Regression, regression
from rotor.tops.constants import Constants
from rotor.tops.covariance import Covariance

LOSSES = ("squares", "huber", "cauchy")
POOR_RMS = 10.0  # weighted rms above which the lines are not described, unless the caller says otherwise
CHANGED_STATE = 0.5  # overlap below which a level is another state than it was at the start
_HUBER, _CAUCHY = 1.345, 2.385  # σ at which a loss bends: 95 % efficiency for normal errors
_CANCELLED = 1e-12  # of the level derivatives: what is left of differences below it is round-off
_REJECTIONS = 20
_STAGES = (0.1, 0.2, 0.35, 0.5, 0.7, 0.85)  # shares of the lines, in order of J, of a search that begins with low J
_ROUGH = 10.0  # standard errors within which a stage has converged
_FIRST_ITERATIONS = 12  # of a direct search, after which it must have made way
_WAY = 0.01  # of the weighted rms at the start, below which it has
_AT_ZERO_MHZ = 1e-30  # how far a constant that starts at 0 may move in these stages


@dataclass(frozen=True)
class FitOptions:
    """How a fit is done.

    reject_above : lines with |obs - calc| above so many errors do not count; they are reported. None: every line counts
    loss : "squares", or "huber" or "cauchy", whose weight falls for lines beyond 1.3 or 2.4 errors
    default_error_mhz : of lines whose file gives 0; such lines are left out, and reported, where it is None
    poor_rms : weighted rms above which the fit has failed
    tolerance, most_iterations : of the search, see `rotor.statistics.least_squares.minimise`
    kmax : cut of the basis of an asymmetric top, as SPFIT's KNMAX; None for the whole basis
    """

    reject_above: float | None = None
    loss: str = "squares"
    default_error_mhz: float | None = None
    poor_rms: float = POOR_RMS
    tolerance: float = 1e-4
    most_iterations: int = 100
    kmax: int | None = None

    def __post_init__(self) -> None:
        if self.loss not in LOSSES:
            raise ValueError(f"loss {self.loss!r}: one of {', '.join(LOSSES)} is needed")
        for name in ("reject_above", "default_error_mhz", "poor_rms", "tolerance"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise ValueError(f"{name} = {value!r}: a finite number above 0 is needed")


@dataclass(frozen=True, eq=False)
class Fit:
    """A finished fit.

    lines : as given. constants : the fitted set with its standard errors, None where the parameters are not named constants (SPFIT's
    codes with spins or several states). parameters : what was fitted, `values` (n,) at the end
    calculated_mhz (lines,) : each line; blended_mhz (lines,) : the mean of its blend. calculated_errors_mhz (lines,) : of the
    prediction, from the stated errors. used (lines,) : whether a line counted; left_out : why not, by line
    residuals (u,), jacobian's statistics : of the measured frequencies that counted, blends as one, in order of `groups`
    minimum : how the search ended. converged, reason : whether this is a result, and the sentence that says why or why not
    changed_states : levels that are another state than at the start, as text. notes : what must be known
    """

    lines: Assignments
    constants: Constants | None
    parameters: Parameters
    values: Floats
    calculated_mhz: Floats
    blended_mhz: Floats
    calculated_errors_mhz: Floats
    used: NDArray[np.bool_]
    left_out: dict[int, str]
    residuals: Floats
    groups: Ints
    statistics: Regression
    minimum: Minimum
    converged: bool
    reason: str
    changed_states: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def named(self) -> Constants:
        """The fitted constants. ValueError where the parameters are not named constants."""
        if self.constants is None:
            raise ValueError(
                "the parameters of this fit are codes of SPFIT with spins or states; it has no named constants"
            )
        return self.constants

    @property
    def difference_mhz(self) -> Floats:
        """Observed minus calculated (lines,), of blends against their mean."""
        return np.asarray(self.lines.frequency_mhz - self.blended_mhz)

    @property
    def weighted_rms(self) -> float:
        """√(Σ ((obs - calc)/σ)² / lines that counted), blends as one: what SPFIT calls RMS ERROR."""
        r = self.residuals[: len(self.groups)]
        return float(np.sqrt(r @ r / len(r))) if len(r) else float("nan")

    @property
    def degrees_of_freedom(self) -> int:
        """Measured frequencies that counted, and a-priori values, less the combinations that they determine."""
        return len(self.residuals) - self.statistics.rank

    @property
    def reduced_chi(self) -> float:
        """√(χ²/degrees of freedom); nan where there are none."""
        free = self.degrees_of_freedom
        return float(np.sqrt(self.residuals @ self.residuals / free)) if free > 0 else float("nan")

    @property
    def errors(self) -> Floats:
        """Standard errors (n,) of the parameters in MHz from the stated errors of the lines."""
        return self.statistics.errors

    @property
    def scaled_errors(self) -> Floats:
        """The same times √(χ²/degrees of freedom): from the scatter of the lines."""
        return np.asarray(self.errors * self.reduced_chi)

    @property
    def covariance(self) -> Covariance:
        """Of the constants that depend on what was fitted, from the stated errors. ValueError where one is not determined."""
        return covariance_of(self.parameters, self.statistics)

    def rms_mhz(self, wavenumber: bool = False) -> float:
        """Unweighted rms of the measured frequencies, MHz (of those measured in cm⁻¹ in cm⁻¹); nan where there are none."""
        chosen = self.groups[self.lines.wavenumber[self.groups] == wavenumber]
        d = self.difference_mhz[chosen] / (29979.2458 if wavenumber else 1.0)
        return float(np.sqrt(d @ d / len(d))) if len(d) else float("nan")


def covariance_of(parameters: Parameters, statistics: Regression) -> Covariance:
    """The covariance (MHz²) of the constants that follow from free parameters."""
    if not np.isfinite(statistics.errors).all():
        lost = ", ".join(one.text for one in statistics.undetermined)
        raise ValueError(
            f"the lines do not determine {lost}: there is no covariance; hold it or give an a-priori error"
        )
    rows = np.flatnonzero(parameters.matrix.any(axis=1))
    matrix = parameters.matrix[rows] @ statistics.covariance @ parameters.matrix[rows].T
    return Covariance(tuple(parameters.constant_names[i] for i in rows), (matrix + matrix.T) / 2)


def fit_lines(
    lines: Assignments,
    constants: Constants | None,
    parameters: Parameters,
    options: FitOptions | None = None,
    *,
    model: Callable[[Ints], LevelModel] | None = None,
    progress: Progress | None = None,
) -> Fit:
    """Constants fitted to assigned lines.

    Parameters
    ----------
    lines : Assignments
    constants : Constants
        Where the fit starts: kind, reduction, representation and every constant that is held; None with a model of its own.
    parameters : Parameters
        What is free, for the same constants.
    options : FitOptions, optional
    model : callable, optional
        Labels (levels, k) to a `LevelModel`; that of the constants (one state, no spins) where it is left out.
    progress : callable, optional
        Called with every `Iteration`. A KeyboardInterrupt ends the search with the best constants so far.

    Returns
    -------
    Fit
        `converged` is False where it is no result, and `reason` says why; the best point is in it all the same.

    Raises
    ------
    ValueError
        No lines, all errors 0, labels that no level has, more free parameters than measured frequencies.

    Notes
    -----
    Errors are those of normal statistics to first order at the minimum; a blend counts as one frequency with the error of its
    first line.

    >>> from rotor.fit.assignment import assignments
    >>> from rotor.fit.parameters import parameters as free
    >>> start = Constants(B=57000.0, D=0.1)
    >>> seen = assignments(("j",), [[1], [2], [3]], [[0], [1], [2]], [115271.2018, 230538.0, 345795.9899], 0.0005)
    >>> found = fit_lines(seen, start, free(start, ["B", "D"]))
    >>> found.converged, round(found.constants["B"], 3), round(found.constants["D"], 4)
    (True, 57635.968, 0.1835)
    """
    options = options or FitOptions()
    if not len(lines):
        raise ValueError("there are no lines to fit to")
    left_out, sigma = _errors_of(lines, options)
    if model is None and constants is None:
        raise ValueError("either constants or a model of the levels is needed")
    labels, upper, lower = _labels(lines)
    made = model(labels) if model else level_model(constants, labels, kmax=options.kmax)  # type: ignore[arg-type]
    if made.names != parameters.constant_names:
        raise ValueError(f"parameters for {parameters.constant_names}, but the levels depend on {made.names}")

    used = np.ones(len(lines), dtype=bool)
    used[list(left_out)] = False
    _refuse_too_few(lines, used, parameters)
    search = _Search(lines, made, parameters, options, upper, lower, sigma, used)
    search, minimum, rejected = _with_rejection(search, options, progress)
    left_out |= rejected
    return _finished(search, minimum, constants, left_out, labels)


def weighted_derivatives(fit: Fit, names: Sequence[str], options: FitOptions | None = None) -> Floats:
    """Derivatives of the measured frequencies over their errors, (frequencies, names), by any constants at those of a fit.

    names : named constants, free in the fit or not, also those that it does not have (at 0). Raises ValueError for other names.
    """
    options = options or FitOptions()
    constants = with_names(fit.named, [name for name in names if name not in fit.named])
    free = parameters_of(constants, names)
    labels, upper, lower = _labels(fit.lines)
    model = level_model(constants, labels, kmax=options.kmax)
    _, sigma = _errors_of(fit.lines, options)
    search = _Search(fit.lines, model, free, options, upper, lower, sigma, fit.used)
    return search.weighted(free.start)[1]


def _labels(lines: Assignments) -> tuple[Ints, Ints, Ints]:
    """The levels that occur, and for each line the places of its upper and lower one among them."""
    labels, places = np.unique(np.concatenate([lines.upper, lines.lower]), axis=0, return_inverse=True)
    places = places.reshape(-1)
    return labels, places[: len(lines)], places[len(lines) :]


def _errors_of(lines: Assignments, options: FitOptions) -> tuple[dict[int, str], Floats]:
    """Lines without an error, by position, and errors with the default put in."""
    zero = lines.error_mhz == 0
    if zero.all() and options.default_error_mhz is None:
        raise ValueError(
            "every line has an error of 0: give errors in the file, or one for all of them (default_error_mhz, --default-error)"
        )
    if options.default_error_mhz is not None:
        return {}, np.where(zero, options.default_error_mhz, lines.error_mhz)
    return {int(i): "its error is 0" for i in np.flatnonzero(zero)}, np.where(zero, 1.0, lines.error_mhz)


def _refuse_too_few(lines: Assignments, used: NDArray[np.bool_], parameters: Parameters) -> None:
    count = len(np.unique(lines.blend[used])) + int(np.isfinite(parameters.prior).sum())
    if count < len(parameters.names):
        raise ValueError(
            f"{len(parameters.names)} free constants for {count} measured frequencies; hold some, or add lines"
        )


@dataclass(frozen=True, eq=False)
class _Search:
    """What is evaluated at each point."""

    lines: Assignments
    model: LevelModel
    parameters: Parameters
    options: FitOptions
    upper: Ints
    lower: Ints
    sigma: Floats
    used: NDArray[np.bool_]

    def lines_of(self, values: Floats) -> tuple[Floats, Floats, Floats]:
        """Calculated lines (lines,), derivatives by the parameters (lines, n), and of the levels (levels, n)."""
        energies, slopes = self.model.levels(self.parameters.constants_of(values))
        slopes = slopes @ self.parameters.matrix
        derivatives = slopes[self.upper]
        derivatives -= slopes[self.lower]
        return energies[self.upper] - energies[self.lower], derivatives, slopes

    @property
    def grouping(self) -> _Grouping:
        return _Grouping.of(self.lines, self.used)

    def evaluate(self, values: Floats) -> tuple[Floats, Floats]:
        """Weighted residuals, those of a-priori values behind them, and the Jacobian."""
        return self.bent(*self.weighted(values))

    def weighted(self, values: Floats) -> tuple[Floats, Floats]:
        calculated, jacobian, _ = self.lines_of(values)
        group = self.group
        sigma = self.sigma[group.first]
        residuals = (self.lines.frequency_mhz[group.first] - group.mean(calculated)) / sigma
        rows = group.mean(jacobian)
        rows /= sigma[:, None]
        known = np.flatnonzero(np.isfinite(self.parameters.prior))
        if not len(known):
            return residuals, rows
        prior = self.parameters.prior[known]
        behind = np.zeros((len(known), len(values)))
        behind[np.arange(len(known)), known] = 1 / prior
        return np.concatenate([residuals, (self.parameters.start - values)[known] / prior]), np.vstack([rows, behind])

    @property
    def group(self) -> _Grouping:
        cached: _Grouping | None = self.__dict__.get("_group")
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


@dataclass(frozen=True, eq=False)
class _Grouping:
    """The measured frequencies that count: for each the position of its first line; order, starts, shares: how blends add.

    plain : no blend among them; blended, members, bounds : which of them are blends, the places of their lines in `order`, and where
    each begins among these
    """

    first: Ints
    order: Ints
    starts: Ints
    shares: Floats
    plain: bool
    blended: Ints
    members: Ints
    bounds: Ints

    @classmethod
    def of(cls, lines: Assignments, used: NDArray[np.bool_]) -> _Grouping:
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
        return cls(order[starts], order, starts, shares, len(blended) == 0, blended, members, bounds)

    def mean(self, values: Floats) -> Floats:
        """The weighted mean over each blend of values (lines, ...)."""
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


def _with_rejection(
    search: _Search, options: FitOptions, progress: Progress | None
) -> tuple[_Search, Minimum, dict[int, str]]:
    """The search, repeated without the lines that are too far off until the same ones stay out."""
    minimum = _searched(search, progress)
    if options.reject_above is None:
        return search, minimum, {}
    may = search.used
    for _ in range(_REJECTIONS):
        calculated, _, _ = search.lines_of(minimum.parameters)
        group = _Grouping.of(search.lines, may)
        means = group.spread_back(group.mean(calculated), calculated)
        far = np.abs(search.lines.frequency_mhz - means) / search.sigma > options.reject_above
        used = may & ~far
        if (used == search.used).all():
            break
        _refuse_too_few(search.lines, used, search.parameters)
        search = replace(search, used=used)
        minimum = _continued(minimum, _minimised(search, minimum.parameters, progress, options.most_iterations))
    out = np.flatnonzero(may & ~search.used)
    return search, minimum, {int(i): f"more than {options.reject_above:g} errors off" for i in out}


def _searched(search: _Search, progress: Progress | None) -> Minimum:
    """A direct search; where it makes no way in its first iterations, or ends far from the lines, one by rising J."""
    limit = search.options.most_iterations
    first = _minimised(search, search.parameters.start, progress, min(_FIRST_ITERATIONS, limit))
    before = first.iterations[0].rms_before if first.iterations else first.rms
    slow = first.rms > _WAY * before and first.rms > search.options.poor_rms
    if first.status == EXHAUSTED and limit > _FIRST_ITERATIONS and not slow:
        first = _continued(first, _minimised(search, first.parameters, progress, limit - len(first.iterations)))
    poor = first.rms > search.options.poor_rms and first.status != INTERRUPTED
    return _by_stages(search, first, progress) if poor and len(first.iterations) < limit else first


def _continued(first: Minimum, second: Minimum) -> Minimum:
    """The second search with the iterations of both."""
    return replace(second, iterations=(*first.iterations, *second.iterations))


def _by_stages(search: _Search, first: Minimum, progress: Progress | None) -> Minimum:
    """The better of the minimum found and the one that a search by rising J ends in.

    Low J moves nearly linearly with the constants even when these are 10 % off, and what it fixes carries the next lines: the
    lines come in by J, a tenth of them first. Until all are in, a constant stays within about itself of its start, and one that
    starts at 0 stays there.
    """
    j = np.maximum(search.lines.upper[:, 0], search.lines.lower[:, 0])
    last, limit = replace(first, parameters=search.parameters.start), search.options.most_iterations
    rough = replace(search.options, tolerance=_ROUGH)
    try:
        for share in _STAGES:
            cut = np.quantile(j[search.used], share)
            soft = np.minimum(search.parameters.prior, np.maximum(np.abs(search.parameters.start), _AT_ZERO_MHZ))
            stage = replace(
                search, options=rough, used=search.used & (j <= cut), parameters=replace(search.parameters, prior=soft)
            )
            last = _continued(last, _minimised(stage, last.parameters, progress, max(limit - len(last.iterations), 0)))
        second = _continued(last, _minimised(search, last.parameters, progress, max(limit - len(last.iterations), 0)))
    except ValueError:  # a stage left the bounds of the model
        return first
    return second if second.rms < first.rms else replace(first, iterations=second.iterations)


def _minimised(search: _Search, start: Floats, progress: Progress | None, limit: int) -> Minimum:
    return minimise(
        search.evaluate,
        start,
        tolerance=search.options.tolerance,
        most_iterations=limit,
        floor=_round_off(search, search.lines_of(start)[2]),
        progress=progress,
    )


def _finished(
    search: _Search, minimum: Minimum, constants: Constants | None, left_out: dict[int, str], labels: Ints
) -> Fit:
    values, parameters = minimum.parameters, search.parameters
    calculated, jacobian, slopes = search.lines_of(values)
    residuals, _ = search.weighted(values)
    statistics = regression(minimum.jacobian, parameters.names, _round_off(search, slopes))
    fitted, order = _constants(constants, parameters, values, statistics)
    fit = Fit(
        lines=search.lines,
        constants=fitted,
        parameters=parameters,
        values=values,
        calculated_mhz=calculated,
        blended_mhz=search.group.spread_back(search.group.mean(calculated), calculated),
        calculated_errors_mhz=_prediction_errors(jacobian, statistics),
        used=search.used,
        left_out=left_out,
        residuals=residuals,
        groups=search.group.first,
        statistics=statistics,
        minimum=minimum,
        converged=False,
        reason="",
        changed_states=_changed(search, values, labels),
        notes=(),
    )
    converged, reason = _verdict(fit, order, search.options)
    return replace(fit, converged=converged, reason=reason, notes=tuple(_notes(fit)))


def _round_off(search: _Search, slopes: Floats) -> Floats:
    """Norms (n,) of weighted columns below which they are what round-off leaves of level derivatives that cancel."""
    size = (np.abs(slopes[search.upper]) + np.abs(slopes[search.lower])) / search.sigma[:, None]
    return np.asarray(_CANCELLED * np.sqrt(np.einsum("ij,ij->j", size[search.used], size[search.used])))


def _constants(
    constants: Constants | None, parameters: Parameters, values: Floats, statistics: Regression
) -> tuple[Constants | None, str]:
    """The fitted set with standard errors, and what is wrong with it: then it is the start, with that text."""
    if constants is None:
        return None, ""
    new = dict(zip(parameters.constant_names, parameters.constants_of(values).tolist(), strict=True))
    touched = np.asarray(parameters.matrix.any(axis=1)).tolist()
    covariance = statistics.covariance
    errors = {}
    for name, row, moves in zip(parameters.constant_names, parameters.matrix, touched, strict=True):
        used = row != 0
        if moves and np.isfinite(covariance.diagonal()[used]).all():
            errors[name] = float(np.sqrt(row[used] @ covariance[np.ix_(used, used)] @ row[used]))
    chosen = {name: value for name, value in constants.uncertainties.items() if name not in new}
    try:
        return constants.replace(**new, uncertainties={**chosen, **errors}), ""
    except ValueError as error:
        return constants, str(error)


def _prediction_errors(jacobian: Floats, statistics: Regression) -> Floats:
    """√(d C dᵀ) of rows d (lines, n); infinite where a parameter that is not determined counts."""
    open_ = ~np.isfinite(statistics.errors)
    closed = np.where(np.isfinite(statistics.covariance), statistics.covariance, 0.0)
    out = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", jacobian, closed, jacobian, optimize=True), 0.0))
    touched = (np.abs(jacobian[:, open_]) > 0).any(axis=1) if open_.any() else np.zeros(len(jacobian), dtype=bool)
    return np.where(touched & bool(len(statistics.undetermined)), np.inf, out)


def _changed(search: _Search, values: Floats, labels: Ints) -> tuple[str, ...]:
    """Levels that are mostly another state than with the constants of the start."""
    start = search.parameters.constants_of(search.parameters.start)
    overlap = search.model.overlaps(start, search.parameters.constants_of(values))
    return tuple(" ".join(map(str, labels[i].tolist())) for i in np.flatnonzero(overlap < CHANGED_STATE))


def _verdict(fit: Fit, disorder: str, options: FitOptions) -> tuple[bool, str]:
    """Whether the fit is a result, and the sentence that says so or says why not."""
    rms, minimum = fit.weighted_rms, fit.minimum
    if disorder:
        return False, f"the constants that were reached are no set of constants: {disorder}"
    if not minimum.converged:
        return False, f"{minimum.reason}; weighted rms {rms:.4g}"
    if rms > options.poor_rms:
        return False, (
            f"a minimum was reached, but it does not describe the lines: weighted rms {rms:.4g}, above {options.poor_rms:g}; "
            "check assignments, the start, and which constants are free"
        )
    if len(fit.statistics.undetermined):
        named = "; ".join(one.text for one in fit.statistics.undetermined)
        return True, f"{minimum.reason}; not determined by these lines and left at the start: {named}"
    return True, minimum.reason


def _notes(fit: Fit) -> list[str]:
    lines, notes = fit.lines, list[str]()
    for i, why in fit.left_out.items():
        notes.append(f"line {i + 1}, {lines.text(i)} at {lines.frequency_mhz[i]:.4f} MHz, does not count: {why}")
    if fit.changed_states:
        some = ", ".join(fit.changed_states[:5]) + (", ..." if len(fit.changed_states) > 5 else "")
        notes.append(
            f"{len(fit.changed_states)} levels are mostly another state than at the start (by overlap): {some}"
        )
    twice = duplicates(lines)
    if twice:
        notes.append(f"{len(twice)} lines stand twice in the list, the first: {lines.text(twice[0][1])}")
    reversed_ = np.flatnonzero(
        fit.used & (np.abs(lines.frequency_mhz + fit.calculated_mhz) < 1e-3 * np.abs(lines.frequency_mhz))
    )
    for i in reversed_.tolist():
        notes.append(
            f"line {i + 1}, {lines.text(i)}: calculated with the opposite sign; are upper and lower exchanged?"
        )
    if np.isfinite(fit.statistics.condition) and fit.statistics.condition > 1e5:
        notes.append(f"condition number {fit.statistics.condition:.1e}: some constants are nearly interchangeable")
    return notes
