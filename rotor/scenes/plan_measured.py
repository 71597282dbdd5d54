"""Plans of scenes that have to do with measured lines: fits, and the emission of a source."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.limits import populated_j
from rotor.scenes import left_out
from rotor.scenes.left_out import LeftOut
from rotor.scenes.plan_parts import Plan, effect_texts, peak_mb, timed

if TYPE_CHECKING:
    from rotor.formats.fit_request import FitRequest
    from rotor.tops.top import Top

SHORT_ITERATIONS, USUAL_ITERATIONS = 1, 6  # of the calibration; of fits whose start is near (tests/test_scene_fit.py)


def plan_of_fit(request: Any) -> Plan:
    """The plan of a fit: seconds are those of one iteration and of what is always there, for as many iterations as fits usually take."""
    from rotor.formats.fit_request import answer_fit

    lines, free = request.lines, request.parameters.names

    def limited(iterations: int) -> Any:
        few = min(iterations, request.options.most_iterations)
        return answer_fit(replace(request, options=replace(request.options, most_iterations=few)))

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
    """What the model leaves out; no distortion where a free constant starts at 0, since its order is in the model then."""
    complete = not request.parameters.start.all()
    found = left_out.of_levels(top, j, SEMI_RIGID)
    return tuple(one for one in found if not (complete and one.name.startswith("centrifugal distortion")))


def _levels_text(request: FitRequest) -> str:
    if request.spfit is not None and request.spfit.model is not None:
        return "blocks of F with spins or several states, as the .par file has them"
    assert request.constants is not None  # of one state without spins
    if request.constants.kind == "asymmetric":
        return "in those Wang blocks alone that have a label"
    return "in closed form"


def plan_of_emission(request: Any) -> Plan:
    """The plan of a source; the whole request is timed, which takes seconds at the most."""
    from rotor.spectra.emission_request import answer_emission
    from rotor.tops.top import Top

    found: list[Any] = []
    seconds = timed(lambda: found.append(answer_emission(request)))
    answer = found[-1]
    effects, absent = [], [LeftOut("departures from one excitation temperature", None, "", "collisions and radiation")]
    for name, top, source, lines in zip(request.names, request.molecules, request.sources, answer.emitted, strict=True):
        if not isinstance(top, Top):
            continue
        j, taken = populated_j(top, source.excitation_k), lines.effects
        effects += [f"{name}: {text}" for text in effect_texts(top, j, taken)]
        largest = [one for one in left_out.of_levels(top, j, taken) if one.size is not None][:1]
        absent += [replace(one, name=f"{name}: {one.name}") for one in largest]
    return Plan(
        kind="emission",
        effects=tuple(effects),
        good=(),
        parts=(
            ("method", "optical depths of all lines added, one excitation temperature a molecule, one background"),
            ("grid", "eight points to a width of the lines"),
        ),
        counts={"molecules": len(request.molecules), "lines": len(answer.lines), "points": len(answer.spectrum)},
        seconds=seconds,
        memory_mb=peak_mb(lambda: answer_emission(request)),
        left_out=tuple(sorted(absent, key=lambda one: (one.size is None, -(one.size or 0.0)))),
    )


def plan_of_assign(request: Any) -> Plan:
    """What a search for constants will do; its time is bounded by the seconds of the request."""
    peaks = request.peaks
    known = "not known, tried from 1 to 8 K" if request.temperature_k is None else f"{request.temperature_k:g} K"
    bounds = request.bounds
    limits = ", ".join(
        f"{name} {low:g} to {high:g}" for name, low, high in zip("ABC", bounds.low, bounds.high, strict=True)
    )
    return Plan(
        kind="assign",
        effects=("rigid", "quartic distortion"),
        good=("J",),
        parts=(
            ("method", "families of three lines on the strongest peaks, evidence against chance, refinement by a fit"),
            ("bounds", f"{limits} MHz"),
            ("temperature", known),
        ),
        counts={"peaks": len(peaks), "species": request.species},
        seconds=float(min(request.seconds, 1.0 + request.species)),
        memory_mb=150.0,
        left_out=(),
    )
