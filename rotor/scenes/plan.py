"""Plan of a scene: method, basis, counts, time, memory, and neglected effects by size."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Any

import msgspec

from rotor.requests.budget import ErrorBudget
from rotor.requests.knob import NOTHING_CHEAPER, Choice
from rotor.requests.plan import LONG_SEARCH, Plan, plan_complete_run, timed
from rotor.scenes.calculation import Calculation, NoResultError
from rotor.scenes.outputs import checked_paths
from rotor.scenes.scene import Scene
from rotor.verbs.verb import verb_of

SHARE = 0.1  # of the model or data error: a smaller numerical error does not matter
SHORT_RUN, SMALL_MB = 1.0, 500.0  # seconds and memory up to which a scene is run for its plan


def plan_of(scene: Scene, folder: str | os.PathLike[str] = ".", out: str | os.PathLike[str] = ".") -> Plan:
    """The plan of a scene. A scene of at most a second is also run, so that its errors are found.

    Parameters
    ----------
    scene : Scene
        Without a sweep.
    folder : path
        Folder of the files that the scene reads.
    out : path
        Folder of the files that the scene would write; none is written.

    Returns
    -------
    Plan

    Raises
    ------
    ValueError
        As a run, in the same words; for long scenes, only what is known before the calculation.

    Examples
    --------
    >>> from rotor.scenes.scene import LevelsScene
    >>> plan_of(LevelsScene(molecule="CO")).counts
    {'levels': 11}
    """
    if scene.sweep:
        raise ValueError("sweep: a plan is of one point; plan the scene without its sweep")
    checked_paths(scene, out)
    calculation = Calculation(scene, folder)
    request = calculation.request()
    with calculation.verb.naming("key"):
        plan, choice = _plan(calculation, request)
        if plan.seconds <= SHORT_RUN and plan.memory_mb <= SMALL_MB:
            plan = _with_outcome(plan, calculation, request, choice)
    return plan


def _with_outcome(plan: Plan, calculation: Calculation, request: Any, choice: Choice | None) -> Plan:
    """The plan with a warning if the run has no result, or with coarser settings that would do; ValueError as in a run."""
    scene: Any = calculation.scene
    bare = replace(calculation, scene=msgspec.structs.replace(scene, outputs=type(scene.outputs)()))
    try:
        answer = bare.answer(request if choice is None else choice.request)
    except NoResultError as reason:
        return replace(plan, parts=(*plan.parts, ("warning", f"no result: {reason}")))
    calculation.reached(answer, choice)
    enough = "" if choice is not None else coarser_settings(scene, request, getattr(answer, "errors", None))
    return replace(plan, parts=(*plan.parts, ("enough", enough))) if enough else plan


def coarser_settings(scene: Scene, request: Any, errors: ErrorBudget | None) -> str:
    """Advice to use an accuracy of a tenth of the model or data error; empty if the settings are no finer than that.

    Only for kinds whose accuracy is set by one field, and if the scene leaves that field out.
    """
    from rotor.scenes.accuracy import chosen

    goals = verb_of(scene.kind).load_numerics().goals
    if errors is None or errors.numerical is None or errors.unit not in goals or not goals[errors.unit].by_field:
        return ""
    uncertain = max((errors.model, errors.data), key=lambda term: term.value or 0.0)
    goal = float(f"{SHARE * (uncertain.value or 0.0):.2g}")
    if not 0.0 < goal > errors.numerical:
        return ""
    try:
        choice = chosen(msgspec.structs.replace(scene, accuracy=goal), request)
    except ValueError:  # the scene sets the field
        return ""
    if choice.how == NOTHING_CHEAPER:
        return ""
    enough, size = (f"{value:.2g} {errors.unit}".rstrip() for value in (goal, uncertain.value or 0.0))
    return f'accuracy = "{enough}" would do, a tenth of {size}: {uncertain.source}'


def _plan(calculation: Calculation, request: Any) -> tuple[Plan, Choice | None]:
    """The plan, and the settings for the accuracy of the scene; None without an accuracy, or if only the run finds the settings."""
    from rotor.scenes.accuracy import accuracy_of, unit_of

    scene = calculation.scene
    goal, numerics = accuracy_of(scene), verb_of(scene.kind).load_numerics()
    if goal is None:
        return plan_of_request(scene.kind, request), None
    if numerics.planned is not None and unit_of(scene) == next(iter(numerics.goals)):
        return numerics.planned(scene, request, goal)
    choices: list[Choice | None] = []
    search = timed(lambda: choices.append(calculation.choice(request)), LONG_SEARCH)
    choice = choices[-1]
    assert choice is not None  # the scene has an accuracy
    plan, parts = plan_of_request(scene.kind, choice.request), [("accuracy", choice.how)]
    if numerics.rounding is not None:
        parts.append(("orders of distortion", "all that the constants have: fewer save milliseconds at the most"))
        parts.append(
            ("rounding", f"{_checked(numerics.rounding(choice.request), goal, choice):.1e} MHz of the highest energy")
        )
    return replace(plan, parts=(*plan.parts, *parts), seconds=plan.seconds + search), choice


def plan_of_request(kind: str, request: Any) -> Plan:
    """The plan of a request; from a complete run if its kind declares no plan."""
    verb = verb_of(kind)
    if plan := verb.load_numerics().plan:
        return plan(request)
    return plan_complete_run(
        kind, lambda: verb.compute(request), lambda answer: {"counts": {"rows": len(verb.table(answer))}}
    )


def _checked(rounding: float, goal: float, choice: Choice) -> float:
    """Rounding error of the energies at the highest J in MHz; ValueError if it clearly exceeds the requested accuracy.

    The factor of 2: a run omits levels beyond the reach of the distortion constants, so that its rounding may be less.
    """
    from rotor.scenes.accuracy import out_of_reach

    if rounding > 2.0 * goal:
        raise out_of_reach(goal, rounding, "MHz", choice.how)
    return rounding
