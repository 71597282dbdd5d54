"""Knobs of fits and of emission: iterations and tolerance of the search, least optical depth of a line."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from rotor.scenes.knobs.knob import Knob, Knobs, Measure, ladder

ITERATIONS = (1, 2, 3, 4, 6, 10)
TOLERANCES = (1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8)
FINEST_TOLERANCE = 1e-12
MORE_DEPTH = (1e5, 1e4, 1e3, 1e2, 1e1)  # times the least depth of the scene


def fit(request: Any) -> Knobs:
    """Of a scene of a fit: the search alone; weights and rejected lines are another question, not another accuracy."""
    from rotor.formats.fit_request import answer_fit

    def with_options(**changes: Any) -> Any:
        return replace(request, options=replace(request.options, **changes))

    measure = Measure("a constant", "σ", _in_errors)
    finest = with_options(tolerance=FINEST_TOLERANCE)
    against = f"a search to {FINEST_TOLERANCE:g}"
    own = request.options
    counts = [n for n in ITERATIONS if n < own.most_iterations]
    iterations = ladder(counts, own.most_iterations, lambda n: with_options(most_iterations=int(n)), "{:.0f}".format)
    tolerances = ladder(TOLERANCES, own.tolerance, lambda one: with_options(tolerance=one))
    return Knobs(
        (
            Knob("numerics.iterations", (measure,), iterations, finest, against, answer_fit),
            Knob("tolerance of the search", (measure,), tolerances, finest, against, answer_fit),
        ),
        ("numerics.loss, numerics.reject_above: which lines count is not a question of accuracy",),
    )


def _in_errors(found: Any, reference: Any) -> float:
    """The largest difference of a free constant in its standard errors."""
    one, true = found.parameters, reference.parameters
    return float(np.max(np.abs(one.value_mhz - true.value_mhz) / true.error_mhz))


def emission(request: Any) -> Knobs:
    """Of a scene of emission: which weak lines are left out."""
    from rotor.spectra.emission_request import answer_emission

    own = request.least_depth
    settings = ladder([own * more for more in MORE_DEPTH], own, lambda one: replace(request, least_depth=one))
    measure = Measure("brightness", "K", _brightness)
    finest = replace(request, least_depth=1e-2 * own)
    against = f"a least depth of {1e-2 * own:g}"
    return Knobs((Knob("observables.least_depth", (measure,), settings, finest, against, answer_emission),))


def assign(request: Any) -> Knobs:
    """Of a scene of an assignment: the search is seeded and has no setting of accuracy."""
    return Knobs((), ("search: seeded; how sure the answer is stands with it as a probability",))


def _brightness(found: Any, reference: Any) -> float:
    return float(np.max(np.abs(found.spectrum.brightness_k - reference.spectrum.brightness_k), initial=0.0))
