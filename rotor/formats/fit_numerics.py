"""Accuracy and plan of a fit: iterations and tolerance of the search."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.formats.fit_request import answer_fit
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.left_out import left_out_of_levels
from rotor.quantum.estimates.plans import effect_texts
from rotor.requests.knob import DECADES, Choice, Measure, Sweep, Sweeps, ladder, loosest, stated
from rotor.requests.numerics import Goal, Numerics
from rotor.requests.plan import LeftOut, Plan, peak_mb, timed

if TYPE_CHECKING:
    from collections.abc import Callable

    from rotor.formats.fit_request import FitRequest
    from rotor.tops.top import Top

ITERATIONS = (1, 2, 3, 4, 6, 10)
TOLERANCES = (1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8)
FINEST_TOLERANCE = 1e-12
SHORT_ITERATIONS, USUAL_ITERATIONS = (
    1,
    6,
)  # of the calibration; of fits whose start is near (tests/scenes/test_scene_fit.py)


def with_options(request: Any, **changes: Any) -> Any:
    """The request with other options of the search."""
    return replace(request, options=replace(request.options, **changes))


def error_of_constants(answer: Any) -> float:
    """The numerical error of the constants of a fit, in percent of their standard errors."""
    return 100.0 * float(answer.constants_errors.numerical or 0.0)


def _goal(of: str, error: Callable[[Any], float]) -> Goal:
    """Goal that chooses the loosest sufficient tolerance of the search, in decades."""

    def choose(scene: Any, request: Any, accuracy: float) -> Choice:
        """The choice, by complete fits."""
        return loosest(
            DECADES, lambda value: with_options(request, tolerance=value), answer_fit, accuracy, "tolerance", error
        )

    return Goal(of, choose) if error is stated else Goal(of, choose, error)


def sweeps_of_fit(request: Any) -> Sweeps:
    """Sweep of the search; weights and rejected lines do not concern its accuracy."""
    measure = Measure("a constant", "σ", _in_errors)
    finest = with_options(request, tolerance=FINEST_TOLERANCE)
    against = f"a search to {FINEST_TOLERANCE:g}"
    options = request.options
    counts = [n for n in ITERATIONS if n < options.most_iterations]
    iterations = ladder(
        counts, options.most_iterations, lambda n: with_options(request, most_iterations=int(n)), "{:.0f}".format
    )
    tolerances = ladder(TOLERANCES, options.tolerance, lambda value: with_options(request, tolerance=value))
    return Sweeps(
        (
            Sweep("numerics.iterations", (measure,), iterations, finest, against, answer_fit),
            Sweep("tolerance of the search", (measure,), tolerances, finest, against, answer_fit),
        ),
        ("numerics.loss, numerics.reject_above: an accuracy does not decide which lines count",),
    )


def _in_errors(answer: Any, reference: Any) -> float:
    """The largest difference of a free constant in its standard errors."""
    fitted, true = answer.parameters, reference.parameters
    return float(np.max(np.abs(fitted.value_mhz - true.value_mhz) / true.error_mhz))


def plan_of_fit(request: Any) -> Plan:
    """The plan of a fit: time from the cost of the setup and of one iteration, for the usual number of iterations."""
    lines, free = request.lines, request.parameters.names

    def limited(iterations: int) -> Any:
        return answer_fit(with_options(request, most_iterations=min(iterations, request.options.most_iterations)))

    least = timed(lambda: limited(SHORT_ITERATIONS))
    step = max(timed(lambda: limited(SHORT_ITERATIONS + 2)) - least, 0.0) / 2
    blends = len(lines) - len(set(lines.blend.tolist()))
    labels = len({tuple(row) for side in (lines.upper, lines.lower) for row in side.tolist()})
    top, j = request.top, int(max(lines.upper[:, 0].max(), lines.lower[:, 0].max(), 1))
    return Plan(
        kind="fit",
        effects=() if top is None else effect_texts(top, j, SEMI_RIGID),
        good=tuple(lines.names),
        parts=(
            ("free", ", ".join(free)),
            ("levels", f"{labels}, to J = {j}, {_levels_text(request)}"),
            (
                "method",
                "Levenberg and Marquardt in scaled variables, analytic derivatives; errors by the column-scaled SVD",
            ),
        ),
        counts={"lines": len(lines), "blended": blends, "parameters": len(free)},
        seconds=least + step * (USUAL_ITERATIONS - SHORT_ITERATIONS),
        memory_mb=peak_mb(lambda: limited(SHORT_ITERATIONS)),
        left_out=() if top is None else _absent(request, top, j),
    )


def _absent(request: FitRequest, top: Top, j: int) -> tuple[LeftOut, ...]:
    """Neglected effects; without distortion if a free constant starts at 0, since the model then contains its order."""
    complete = not request.parameters.start.all()
    parts = left_out_of_levels(top, j, SEMI_RIGID)
    return tuple(part for part in parts if not (complete and part.name.startswith("centrifugal distortion")))


def _levels_text(request: FitRequest) -> str:
    if request.spfit is not None and request.spfit.model is not None:
        return "blocks of F with spins or several states, as the .par file has them"
    assert request.constants is not None  # of one state without spins
    if request.constants.kind == "asymmetric":
        return "in those Wang blocks alone that have a label"
    return "in closed form"


FIT = Numerics(
    {"MHz": _goal("frequencies of the lines", stated), "%": _goal("constants", error_of_constants)},
    sweeps=sweeps_of_fit,
    plan=plan_of_fit,
)
