"""Accuracy of what is compared with measurements: brightness, fitted constants and the frequencies of their lines.

Settings are tried in decades, the loosest first; the first whose stated numerical error is what was asked for is taken.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from rotor.requests.knob import Choice

DEPTHS = tuple(10.0**-n for n in range(13))  # least optical depths
TOLERANCES = tuple(10.0**-n for n in range(13))  # of the search, in standard errors
LOOSEST = ", nothing cheaper: the loosest there is"


def choose_depth(scene: Any, request: Any, accuracy: float) -> Choice:
    """The largest least depth, in decades, with which T_B is known to an accuracy in K."""
    from rotor.spectra.emission_request import LEAST_DEPTH, answer_emission

    if request.least_depth != LEAST_DEPTH:
        raise ValueError("accuracy and observables.least_depth: give one of them")

    def tried(depth: float) -> tuple[Any, float | None]:
        """The request with a least depth, and its error."""
        looser = replace(request, least_depth=depth)
        return looser, answer_emission(looser).errors.numerical

    return _first(DEPTHS, tried, accuracy, "least depth")


def choose_for_lines(scene: Any, request: Any, accuracy: float) -> Choice:
    """The loosest tolerance of a search with which the frequencies of the lines are known to an accuracy in MHz."""
    return _first(
        TOLERANCES, lambda one: _searched(request, one, lambda answer: answer.errors.numerical), accuracy, "tolerance"
    )


def choose_for_constants(scene: Any, request: Any, accuracy: float) -> Choice:
    """The same of the constants, to an accuracy in percent of their standard errors."""
    return _first(TOLERANCES, lambda one: _searched(request, one, error_of_constants), accuracy, "tolerance")


def error_of_constants(answer: Any) -> float:
    """The numerical error of the constants of a fit, in percent of their standard errors."""
    return 100.0 * float(answer.constants_errors.numerical or 0.0)


def _searched(request: Any, tolerance: float, error: Callable[[Any], float | None]) -> tuple[Any, float | None]:
    """The request of a fit with a tolerance, and its error."""
    from rotor.formats.fit_request import answer_fit

    looser = replace(request, options=replace(request.options, tolerance=tolerance))
    return looser, error(answer_fit(looser))


def _first(
    values: tuple[float, ...], tried: Callable[[float], tuple[Any, float | None]], accuracy: float, name: str
) -> Choice:
    """The first of some values whose error is within the accuracy; the last where none is, which a run refuses."""
    for value in values:
        request, error = tried(value)
        if error is not None and error <= accuracy:
            break
    return Choice(request, f"{name} {value:g}" + (LOOSEST if value == values[0] else ""))
