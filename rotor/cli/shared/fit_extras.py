"""What `rotor fit` does beside the fit: choosing constants, trying them, lines worth measuring, errors by resampling."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rotor.cli.shared import inputs

if TYPE_CHECKING:
    from rotor.fitting.choose import Suggestion, Trial
    from rotor.fitting.fit import Fit, FitOptions
    from rotor.formats.fit_request import FitAnswer, FitRequest


@dataclass(frozen=True)
class Extras:
    """What was asked for beside the fit; spread: errors by resampling; interrupted: by an interrupt, what is not complete."""

    trials: Sequence[Trial] = ()
    suggestions: Sequence[Suggestion] = ()
    spread: Sequence[float] = ()
    interrupted: str = ""


def extras_of(answer: FitAnswer, tried: Sequence[str] | None, suggest: str | None, samples: int, seed: int) -> Extras:
    """Trials of constants, the lines that would help one most, errors from so many samples; an interrupt leaves those that are done."""
    request, fit = answer.request, answer.fit
    done, now = Extras(), "--try"
    try:
        done = replace(done, trials=_trials(fit, request.options, tried))
        now = "--suggest"
        done = replace(done, suggestions=_suggestions(request, fit, suggest))
        now = "--bootstrap"
        spread, count = _bootstrap(request, fit, samples, seed)
        few = f"{count} of {samples} samples of --bootstrap" if count < samples else ""
        return replace(done, spread=spread, interrupted=few)
    except KeyboardInterrupt:
        return replace(done, interrupted=f"{now} is not complete")


def chosen(request: FitRequest, candidates: Sequence[str], by_order: bool) -> tuple[FitAnswer, list[Trial]]:
    """The fit of the constants that the lines call for, and the steps that led to it; after an interrupt those found so far."""
    from rotor.fitting.choose import choose_constants
    from rotor.fitting.parameters import with_names
    from rotor.formats.fit_request import FitAnswer, answer_fit

    if request.spfit is not None:
        raise ValueError("--choose: start from a line list and constants, whose free ones are the base of the model")
    assert request.constants is not None  # a list of lines has constants to start from
    own_name = request.constants.own_name
    idle = [name for name in candidates if own_name(name) in request.parameters.names]
    if idle:
        raise ValueError(
            f"--choose: {', '.join(idle)} is free already, part of the base of the model; choose from others"
        )
    with inputs.named("--choose"):
        known = with_names(request.constants, candidates)
        request.parameters.with_free(known, list(dict.fromkeys(map(own_name, candidates))))
    fit, steps = choose_constants(
        request.lines, request.constants, request.parameters, candidates, request.options, by_order=by_order
    )
    if fit.minimum.status == "interrupted":
        return FitAnswer(request, fit), steps
    free = fit.parameters.moved(fit.values)
    return answer_fit(replace(request, constants=fit.named, parameters=free)), steps


def _trials(fit: Fit, options: FitOptions, names: Sequence[str] | None) -> list[Trial]:
    if names is None:
        return []
    from rotor.fitting.choose import try_constants

    with inputs.named("--try"):
        return try_constants(fit, names, options)


def _suggestions(request: FitRequest, fit: Fit, name: str | None) -> list[Suggestion]:
    """The best twenty of all lines of the kinds that were measured, for J up to the highest measured."""
    if name is None:
        return []
    import numpy as np

    from rotor.fitting.choose import suggest_lines

    error = float(np.median(fit.line_errors_mhz[fit.used]))
    own = name if fit.constants is None else fit.constants.own_name(name)
    if own not in fit.parameters.names:
        raise ValueError(f"--suggest: {name} is not among the free parameters {', '.join(fit.parameters.names)}")
    if request.spfit is not None and fit.constants is None:
        from rotor.formats.spcat.fits.unmeasured import unmeasured_lines

        upper, lower = unmeasured_lines(request.spfit.file, fit.lines)
        return suggest_lines(fit, name, upper, lower, error_mhz=error, model=request.model)[:20]
    from rotor.fitting.unmeasured import unmeasured

    upper, lower = unmeasured(fit)
    return suggest_lines(fit, fit.named.own_name(name), upper, lower, error_mhz=error)[:20]


def _bootstrap(request: FitRequest, fit: Fit, samples: int, seed: int) -> tuple[list[float], int]:
    """Standard deviations from samples of the lines, and from how many."""
    if not samples:
        return [], 0
    import numpy as np

    from rotor.fitting.resampling import bootstrap

    values, spread = bootstrap(fit, samples, np.random.default_rng(seed), request.options, model=request.model)
    return spread.tolist(), len(values)
