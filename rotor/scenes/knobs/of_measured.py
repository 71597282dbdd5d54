"""Knobs of scenes that have to do with measured lines: the tolerance of a fit, and the depth below which lines of a source are left out."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.scenes.knobs.knob import Knob, Knobs, Measure, ladder

if TYPE_CHECKING:
    from rotor.formats.fit_request import FitAnswer, FitRequest
    from rotor.spectra.emission_request import EmissionAnswer, EmissionRequest


def fit(request: FitRequest) -> Knobs:
    """The tolerance of the search: errors of the parameters in their own standard errors."""
    from rotor.formats.fit_request import answer_fit

    def at(tolerance: float) -> Any:
        return replace(request, options=replace(request.options, tolerance=tolerance))

    tolerance = Knob(
        "tolerance of the search",
        (Measure("parameters", "standard errors", _in_errors),),
        ladder([10.0, 1.0, 1e-1, 1e-2, 1e-4], request.options.tolerance, at),
        at(request.options.tolerance / 100),
        "a tolerance a hundred times finer",
        answer_fit,
    )
    return Knobs((tolerance,), ("levels and derivatives are exact: blocks diagonalised or closed forms",))


def _in_errors(answer: FitAnswer, reference: FitAnswer) -> float:
    return float(np.max(np.abs(answer.fit.values - reference.fit.values) / reference.fit.errors))


def emission(request: EmissionRequest) -> Knobs:
    """The depth of the cut: errors of the brightness temperature on the whole grid."""
    from rotor.spectra.emission_request import answer_emission

    def at(depth: float) -> Any:
        return replace(request, least_depth=depth)

    depth = Knob(
        "observables.least_depth",
        (Measure("brightness temperature", "K", _brightness),),
        ladder([1e-1, 1e-2, 1e-3, 1e-4, 1e-6], request.least_depth, at),
        at(request.least_depth / 100),
        "a cut a hundred times lower",
        answer_emission,
    )
    return Knobs(
        (depth,),
        ("the spectrum is that of every line on the grid: no other approximation but one excitation temperature",),
    )


def _brightness(answer: EmissionAnswer, reference: EmissionAnswer) -> float:
    return float(np.max(np.abs(answer.spectrum.brightness_k - reference.spectrum.brightness_k)))
