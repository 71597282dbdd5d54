"""Knobs of fits: iterations and tolerance of the search; and kinds that have none beside those of their fields."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from rotor.requests.knob import Measure, Sweep, Sweeps, ladder

ITERATIONS = (1, 2, 3, 4, 6, 10)
TOLERANCES = (1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8)
FINEST_TOLERANCE = 1e-12


def fit(request: Any) -> Sweeps:
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
    return Sweeps(
        (
            Sweep("numerics.iterations", (measure,), iterations, finest, against, answer_fit),
            Sweep("tolerance of the search", (measure,), tolerances, finest, against, answer_fit),
        ),
        ("numerics.loss, numerics.reject_above: which lines count is not a question of accuracy",),
    )


def _in_errors(found: Any, reference: Any) -> float:
    """The largest difference of a free constant in its standard errors."""
    one, true = found.parameters, reference.parameters
    return float(np.max(np.abs(one.value_mhz - true.value_mhz) / true.error_mhz))


def assign(request: Any) -> Sweeps:
    """Of a scene of an assignment: the search is seeded and has no setting of accuracy."""
    return Sweeps((), ("search: seeded; how sure the answer is stands with it as a probability",))


def torsion(request: Any) -> Sweeps:
    """Of a scene of a torsion; without a scan nothing is left to choose, since the basis follows from the energies."""
    from rotor.thermodynamics.torsion_request import is_scan

    why = "basis: its size follows from the highest energy; the error is stated with each run"
    return Sweeps((), () if is_scan(request.potential) else (why,))
