"""Additions to a fit: choice and trial of constants, suggested measurements, errors by resampling."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from rotor.fitting.choice.choose import Suggestion, Trial, choose_constants, suggest_lines, try_constants
from rotor.fitting.choice.unmeasured import unmeasured
from rotor.fitting.fit import FitOptions
from rotor.fitting.parameters import with_names
from rotor.fitting.result import Fit
from rotor.formats.fits.fit_request import FitAnswer, FitRequest, answer_fit

MOST_SUGGESTIONS = 20


@contextmanager
def _named(name: str) -> Iterator[None]:
    """Context in which the message of a ValueError begins with the name of the argument."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def chosen_fit(request: FitRequest, candidates: Sequence[str], by_order: bool) -> FitAnswer:
    """The fit with the constants that the lines require, and the steps of the choice; after an interrupt the steps so far."""
    if request.spfit is not None:
        raise ValueError("choose: needs a line list and start constants; the free constants are the base of the model")
    assert request.constants is not None  # a list of lines has constants to start from
    full_name = request.constants.spelling
    idle = [name for name in candidates if full_name(name) in request.parameters.names]
    if idle:
        raise ValueError(
            f"choose: {', '.join(idle)} is free already, part of the base of the model; choose from others"
        )
    with _named("choose"):
        constants = with_names(request.constants, candidates)
        request.parameters.with_free(constants, list(dict.fromkeys(map(full_name, candidates))))
    fit, steps = choose_constants(
        request.lines, request.constants, request.parameters, candidates, request.options, by_order=by_order
    )
    if fit.minimum.status == "interrupted":
        return FitAnswer(request, fit, steps=tuple(steps))
    free = fit.parameters.moved(fit.values)
    return replace(answer_fit(replace(request, constants=fit.named, parameters=free)), steps=tuple(steps))


def with_further(
    answer: FitAnswer, tried: Sequence[str] | None, suggest: str | None, samples: int, seed: int
) -> FitAnswer:
    """The answer with trials of constants, suggested lines and errors from samples; an interrupt leaves the completed parts."""
    request, fit, now = answer.request, answer.fit, "try_constants"
    try:
        answer = replace(answer, trials=tuple(_trials(fit, request.options, tried)))
        now = "suggest"
        answer = replace(answer, suggestions=tuple(_suggestions(request, fit, suggest)))
        now = "bootstrap"
        spread, count = _bootstrap(request, fit, samples, seed)
        few = f"{count} of {samples} samples of bootstrap" if count < samples else ""
        return replace(answer, spread=tuple(spread), interrupted=few)
    except KeyboardInterrupt:
        return replace(answer, interrupted=f"{now} is not complete")


def _trials(fit: Fit, options: FitOptions, names: Sequence[str] | None) -> list[Trial]:
    if names is None:
        return []
    with _named("try_constants"):
        return try_constants(fit, names, options)


def _suggestions(request: FitRequest, fit: Fit, name: str | None) -> list[Suggestion]:
    """The best twenty lines of the measured kinds, for J up to the highest measured."""
    if name is None:
        return []
    error = float(np.median(fit.line_errors_mhz[fit.used]))
    full = name if fit.constants is None else fit.constants.spelling(name)
    if full not in fit.parameters.names:
        raise ValueError(f"suggest: {name} is not among the free parameters {', '.join(fit.parameters.names)}")
    if request.spfit is not None and fit.constants is None:
        from rotor.formats.spcat.fits.fit_states import unmeasured_lines

        upper, lower = unmeasured_lines(request.spfit.file, fit.lines)
        return suggest_lines(fit, name, upper, lower, error_mhz=error, model=request.model)[:MOST_SUGGESTIONS]
    upper, lower = unmeasured(fit)
    return suggest_lines(fit, fit.named.spelling(name), upper, lower, error_mhz=error)[:MOST_SUGGESTIONS]


def _bootstrap(request: FitRequest, fit: Fit, samples: int, seed: int) -> tuple[Sequence[float], int]:
    """Standard deviations from resampled lines, and number of samples."""
    if not samples:
        return [], 0
    from rotor.fitting.resampling import bootstrap

    values, spread = bootstrap(fit, samples, np.random.default_rng(seed), request.options, model=request.model)
    return spread.tolist(), len(values)
