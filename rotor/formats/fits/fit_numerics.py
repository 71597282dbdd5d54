"""Accuracy and plan of a fit: iterations and tolerance of the search."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.plans import effect_texts, neglected_in_levels
from rotor.requests.knob import DECADES, Knob, Measure
from rotor.requests.numerics import Goal, Numerics
from rotor.requests.plan import Cost, Growth, LeftOut

if TYPE_CHECKING:
    from rotor.formats.fits.fit_request import FitRequest
    from rotor.tops.top import Top

ITERATIONS = (1, 2, 3, 4, 6, 10)
TOLERANCES = (1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8)
FINEST_TOLERANCE = 1e-12
# of the calibration; of fits whose start is near (tests/scenes/test_scene_fit.py)
SHORT_ITERATIONS, USUAL_ITERATIONS = (1, 3), 6


def with_options(request: Any, **changes: Any) -> Any:
    """The request with other options of the search."""
    return replace(request, options=replace(request.options, **changes))


def constants_error(answer: Any) -> float:
    """The numerical error of the constants of a fit, in percent of their standard errors."""
    return 100.0 * float(answer.constants_errors.numerical or 0.0)


def _in_errors(answer: Any, reference: Any) -> float:
    """The largest difference of a free constant in its standard errors."""
    fitted, true = answer.parameters, reference.parameters
    return float(np.max(np.abs(fitted.value_mhz - true.value_mhz) / true.error_mhz))


def _with_tolerance(request: Any, _: str, tolerance: float) -> Any:
    return with_options(request, tolerance=tolerance)


ERROR = Measure("a constant", "σ", _in_errors)
AGAINST = f"a search to {FINEST_TOLERANCE:g}"
STEPS = Knob(
    lambda request: [count for count in ITERATIONS if count < request.options.most_iterations],
    FINEST_TOLERANCE,
    (ERROR,),
    AGAINST,
    change=lambda request, _, count: with_options(request, most_iterations=int(count)),
    key="numerics.iterations",
    title="iterations of the search",
    value=lambda request: request.options.most_iterations,
    reference=lambda request: with_options(request, tolerance=FINEST_TOLERANCE),
    label="{:.0f}".format,
    cost=Growth(
        SHORT_ITERATIONS,
        lambda request: min(USUAL_ITERATIONS, request.options.most_iterations),
        largest=lambda request: with_options(request, most_iterations=1),
    ),
)
TOLERANCE = Knob(
    TOLERANCES,
    FINEST_TOLERANCE,
    (ERROR,),
    AGAINST,
    change=_with_tolerance,
    tried=DECADES,
    coarsest=(1.0, "loosest"),
    bounds=("MHz", "%"),
    key="tolerance of the search",
    value=lambda request: request.options.tolerance,
)


ROWS = Knob(key="numerics.loss, numerics.reject_above", fixed="an accuracy does not decide which lines count")


def describe_fit(request: Any, _: Cost) -> dict[str, Any]:
    """What a fit does."""
    lines, free = request.lines, request.parameters.names
    blends = len(lines) - len(set(lines.blend.tolist()))
    labels = len({tuple(row) for side in (lines.upper, lines.lower) for row in side.tolist()})
    top, j = request.top, int(max(lines.upper[:, 0].max(), lines.lower[:, 0].max(), 1))
    return {
        "effects": () if top is None else effect_texts(top, j, SEMI_RIGID),
        "good": tuple(lines.names),
        "parts": (
            ("free", ", ".join(free)),
            ("levels", f"{labels}, to J = {j}, {_levels_text(request)}"),
            (
                "method",
                "Levenberg and Marquardt in scaled variables, analytic derivatives; errors by the column-scaled SVD",
            ),
        ),
        "counts": {"lines": len(lines), "blended": blends, "parameters": len(free)},
        "left_out": () if top is None else _absent(request, top, j),
    }


def _absent(request: FitRequest, top: Top, j: int) -> tuple[LeftOut, ...]:
    """Neglected effects; without distortion if a free constant starts at 0, since the model then contains its order."""
    complete = not request.parameters.start.all()
    parts = neglected_in_levels(top, j, SEMI_RIGID)
    return tuple(part for part in parts if not (complete and part.name.startswith("centrifugal distortion")))


def _levels_text(request: FitRequest) -> str:
    if request.spfit is not None and request.spfit.model is not None:
        return "blocks of F with spins or several states, as the .par file has them"
    assert request.constants is not None  # of one state without spins
    if request.constants.kind == "asymmetric":
        return "in those Wang blocks alone that have a label"
    return "in closed form"


FIT = Numerics(
    {"MHz": Goal("frequencies of the lines"), "%": Goal("constants", constants_error)},
    knobs=(STEPS, TOLERANCE, ROWS),
    describe=describe_fit,
)
