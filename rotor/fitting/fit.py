"""Constants from assigned lines by weighted least squares, with the statistics of the result.

    χ² = Σ ((ν_obs - ν_calc)/σ)² + Σ ((p - p₀)/σ_prior)²,      ν_calc = E(upper) - E(lower), in a blend the weighted mean

A `LevelModel` gives the energies of the labelled levels, and their derivatives, for any constants. The search itself is in
`rotor.fitting.search.residuals` and `rotor.fitting.search.strategies`. A fit has converged if the search is at a minimum and the minimum
describes the lines; a weighted rms far above 1 is reported as a failure.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.fitting.assignment import Assignments, levels_in
from rotor.fitting.levels.top_levels import label_model
from rotor.fitting.parameters import Parameters
from rotor.fitting.reports.fit_notes import fit_notes, start_notes
from rotor.fitting.result import Fit
from rotor.fitting.search.residuals import FitOptions as FitOptions
from rotor.fitting.search.residuals import Search, line_errors, round_off, too_few
from rotor.fitting.search.strategies import with_rejection
from rotor.fitting.top_constants import ConstantSet
from rotor.quantum.labels.labelled import LevelModel, MissingLevelsError
from rotor.requests.budget import ROUNDING
from rotor.statistics.least_squares import EXHAUSTED, Minimum, Progress
from rotor.statistics.regression import Regression, regression
from rotor.table import counted
from rotor.tops.constants.constants import AxisOrderError

NEARLY_THERE = 0.01  # convergence limit (standard errors of the next step) at the last allowed iteration
CHANGED_STATE = 0.5  # overlap with the state at the start below which a level is reported as changed


def fit_lines(
    lines: Assignments,
    constants: ConstantSet | None,
    parameters: Parameters,
    options: FitOptions | None = None,
    *,
    model: Callable[[Ints], LevelModel] | None = None,
    progress: Progress | None = None,
) -> Fit:
    """Fit constants to assigned lines.

    Parameters
    ----------
    lines : Assignments
    constants : Constants or TopConstants
        Start of the fit, with kind, reduction, representation and the constants that are held; None if `model` is given.
    parameters : Parameters
        The free parameters of these constants.
    options : FitOptions, optional
    model : callable, optional
        Makes a `LevelModel` from labels (levels, k). Default: the model of the constants.
    progress : callable, optional
        Called with each `Iteration`. A KeyboardInterrupt ends the search with the best constants so far.

    Returns
    -------
    Fit
        If the fit failed, `converged` is False and `reason` says why; the best point is returned all the same.

    Raises
    ------
    ValueError
        No lines, all errors 0, labels that no level has, a line from a level to itself, more free parameters than measured frequencies.

    Notes
    -----
    Errors are those of normal statistics to first order at the minimum; a blend counts as one frequency with the error of its
    first line.

    >>> from rotor.fitting.assignment import assignments
    >>> from rotor.fitting.parameters import parameters as free
    >>> from rotor.tops.constants.constants import Constants
    >>> start = Constants(B=57000.0, D=0.1)
    >>> seen = assignments(("j",), [[1], [2], [3]], [[0], [1], [2]], [115271.2018, 230538.0, 345795.9899], 0.0005)
    >>> fit = fit_lines(seen, start, free(start, ["B", "D"]))
    >>> fit.converged, round(fit.constants["B"], 3), round(fit.constants["D"], 4)
    (True, 57635.968, 0.1835)
    """
    options = options or FitOptions()
    if not len(lines):
        raise ValueError("there are no lines to fit to")
    lines, level_model, missing = _with_levels(lines, model or _model_from_labels(constants, options), options)
    left_out, sigma = line_errors(lines, options)
    labels, upper, lower = levels_in(lines)
    if level_model.names != parameters.constant_names:
        raise ValueError(f"parameters for {parameters.constant_names}, but the levels depend on {level_model.names}")

    used = np.ones(len(lines), dtype=bool)
    used[list(left_out)] = False
    if few := too_few(lines, used, parameters):
        raise ValueError(f"{lines.source or 'the lines'}: {few}")
    search = Search(lines, level_model, parameters, options, upper, lower, sigma, used)
    noted = [*missing, *start_notes(search)]
    search, minimum, rejected = with_rejection(search, options, progress)
    left_out |= rejected
    fit = _finished(search, minimum, constants, left_out, labels)
    return replace(fit, notes=(*noted, *fit.notes))


def _model_from_labels(constants: ConstantSet | None, options: FitOptions) -> Callable[[Ints], LevelModel]:
    """A function from labels to the level model of the constants."""
    if constants is None:
        raise ValueError("either constants or a model of the levels is needed")
    return partial(label_model, constants, kmax=options.kmax)


def _with_levels(
    lines: Assignments, model: Callable[[Ints], LevelModel], options: FitOptions
) -> tuple[Assignments, LevelModel, list[str]]:
    """The lines whose two levels exist, their level model, and notes on lines left out.

    A label without a level is an error; with `leave_out_missing` its lines are left out.
    """
    labels, upper, lower = levels_in(lines)
    same = np.flatnonzero(upper == lower)
    if len(same):
        raise ValueError(
            f"{_named(lines, int(same[0]))}: upper and lower state are the same "
            "level: correct the labels, or remove the line"
        )
    try:
        return lines, model(labels), []
    except MissingLevelsError as error:
        lost = np.isin(upper, error.places) | np.isin(lower, error.places)
        if not options.leave_out_missing or lost.all():
            raise missing_level(lines, error) from None
        notes = [
            f"{_named(lines, i)}, is left out: it has a level that does not exist"
            for i in np.flatnonzero(lost).tolist()
        ]
    rest, level_model, more = _with_levels(lines.take(~lost), model, options)
    return rest, level_model, notes + more


def missing_level(lines: Assignments, error: MissingLevelsError) -> ValueError:
    """An error that names the first line with the missing level."""
    _, upper, lower = levels_in(lines)
    lost = (upper == error.places[0]) | (lower == error.places[0])
    return ValueError(f"{_named(lines, int(np.argmax(lost)))}: {error}")


def _named(lines: Assignments, i: int) -> str:
    """A line by source, number and labels, for messages."""
    return f"{lines.source or 'the lines'}: line {lines.number(i)}, {lines.text(i)} at {lines.frequency_mhz[i]:.4f} MHz"


def _finished(
    search: Search, minimum: Minimum, constants: ConstantSet | None, left_out: dict[int, str], labels: Ints
) -> Fit:
    values, parameters = minimum.parameters, search.parameters
    calculated, jacobian, slopes, largest = search.line_values(values)
    residuals, _ = search.weighted(values)
    statistics = regression(minimum.jacobian, parameters.names, round_off(search, slopes))
    fitted, order = _constants(constants, parameters, values, statistics)
    fit = Fit(
        lines=search.lines,
        constants=fitted,
        parameters=parameters,
        values=values,
        calculated_mhz=calculated,
        blended_mhz=search.group.spread_back(search.group.mean(calculated), calculated),
        calculated_errors_mhz=_prediction_errors(jacobian, statistics),
        line_errors_mhz=_line_errors(search),
        used=search.used,
        left_out=left_out,
        residuals=residuals,
        groups=search.group.first,
        statistics=statistics,
        minimum=minimum,
        rounding_mhz=2 * ROUNDING * largest,
        converged=False,
        reason="",
        changed_states=_changed(search, values, labels),
        notes=(),
    )
    converged, reason = _verdict(fit, order, search.options)
    return replace(fit, converged=converged, reason=reason, notes=tuple(fit_notes(fit)))


def _constants(
    constants: ConstantSet | None, parameters: Parameters, values: Floats, statistics: Regression
) -> tuple[ConstantSet | None, str]:
    """The fitted set with standard errors and an empty text; if the fitted values are invalid, the start and the error text."""
    if constants is None:
        return None, ""
    new = dict(zip(parameters.constant_names, parameters.to_constants(values).tolist(), strict=True))
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
    except AxisOrderError as error:
        return constants, f"{error.constants}: they left the order {error.order}{_held_barrier(parameters)}"
    except ValueError as error:
        return constants, str(error)


def _held_barrier(parameters: Parameters) -> str:
    """Constants of an internal rotor that were held and may have made rotational constants cross, with the remedy; empty without any."""
    moves = np.asarray(parameters.matrix.any(axis=1)).tolist()
    held = [name for name, free in zip(parameters.constant_names, moves, strict=True) if not free]
    rotor = [name for name in held if re.fullmatch(r"(V3|rho|F0?)(_\d)?", name)]
    if not rotor:
        return ""
    remedy = ",".join([name for name in rotor if name.startswith("V3")] or rotor)
    return f"; {', '.join(rotor)} held at a wrong value can make rotational constants cross: free {remedy}"


def _line_errors(search: Search) -> Floats:
    # without any error nothing weights the line; it is shown as 0
    without = (search.lines.error_mhz == 0) & (search.options.default_error_mhz is None)
    return np.where(without, 0.0, search.sigma)


def _prediction_errors(jacobian: Floats, statistics: Regression) -> Floats:
    """√(d C dᵀ) for rows d (lines, n); infinite if a line depends on an undetermined parameter."""
    open_ = ~np.isfinite(statistics.errors)
    closed = np.where(np.isfinite(statistics.covariance), statistics.covariance, 0.0)
    # round-off may make a variance of 0 negative
    out = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", jacobian, closed, jacobian, optimize=True), 0.0))
    touched = (np.abs(jacobian[:, open_]) > 0).any(axis=1) if open_.any() else np.zeros(len(jacobian), dtype=bool)
    # an undetermined parameter leaves the line unpredictable
    return np.where(touched & bool(len(statistics.undetermined)), np.inf, out)


def _changed(search: Search, values: Floats, labels: Ints) -> tuple[str, ...]:
    """Labels of levels that are mostly another state than with the start constants."""
    start = search.parameters.to_constants(search.parameters.start)
    overlap = search.model.overlaps(start, search.parameters.to_constants(values))
    return tuple(search.lines.label_text(labels[i].tolist()) for i in np.flatnonzero(overlap < CHANGED_STATE))


def _verdict(fit: Fit, disorder: str, options: FitOptions) -> tuple[bool, str]:
    """Whether the fit is valid, and a sentence that says why or why not."""
    minimum = fit.minimum
    # for a robust loss: of the function that was minimised
    rms = fit.weighted_rms if options.loss == "squares" else minimum.rms
    if disorder:
        return False, f"the constants that were reached are no set of constants: {disorder}"
    near = minimum.status == EXHAUSTED and minimum.distance <= NEARLY_THERE
    if not (minimum.converged or near):
        return False, f"{minimum.reason}; weighted rms {rms:.4g}"
    if rms > options.poor_rms:
        return False, (
            f"a minimum was reached, but it does not describe the lines: weighted rms {rms:.4g}, above {options.poor_rms:g}; "
            "check assignments, the start, and which constants are free"
        )
    reason = minimum.reason
    if near:
        count = len(minimum.iterations)
        done, left = counted(count, "iteration"), f"{minimum.distance:.1e} standard errors"
        reason = f"ended after {done}, as many as allowed: the next step would be {left}"
    if not fit.degrees_of_freedom:
        reason += (
            "; 0 degrees of freedom: as many frequencies as they determine constants, so that nothing checks these, and there "
            "are no errors from the scatter"
        )
    if len(fit.statistics.undetermined):
        named = "; ".join(combination.text for combination in fit.statistics.undetermined)
        return True, f"{reason}; not determined by these lines and left at the start: {named}"
    return True, reason
