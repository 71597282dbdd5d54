"""What a scene will do, before it is done: method, basis, counts, time and memory - and what it leaves out, by size."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Any

import msgspec

from rotor.requests.budget import ErrorBudget
from rotor.requests.knob import NOTHING_CHEAPER, Choice
from rotor.requests.plan import LONG_SEARCH, Plan, plan_of_whole, timed
from rotor.scenes.kind import NoResultError, kind_of
from rotor.scenes.numerics import answering, numerics_of
from rotor.scenes.run import answer_as_run, choice_of, output_paths
from rotor.scenes.scene import Scene
from rotor.verbs.verb import verb_of

SHARE = 0.1  # of what is uncertain besides, below which a numerical error does not count
SHORT_RUN, SMALL_MB = 1.0, 500.0  # seconds and memory of a scene that is run for its plan


def plan_of(scene: Scene, folder: str | os.PathLike[str] = ".", out: str | os.PathLike[str] = ".") -> Plan:
    """The plan of a scene. One that takes a second or less is run too, so that whatever it would be refused for is known.

    Parameters
    ----------
    scene : Scene
        Without a sweep.
    folder : path
        From which the files that the scene reads are counted.
    out : path
        From which the files that it writes are counted; none is written.

    Returns
    -------
    Plan

    Raises
    ------
    ValueError
        Whatever the scene itself would be refused for, in the same words; of one that takes long, what is known before it is run.

    Examples
    --------
    >>> from rotor.scenes.scene import LevelsScene
    >>> plan_of(LevelsScene(molecule="CO")).counts
    {'levels': 11}
    """
    if scene.sweep:
        raise ValueError("sweep: a plan is of one point; plan the scene without its sweep")
    output_paths(scene, out)
    kind = kind_of(scene)
    request = kind.request(scene, folder)
    with kind.naming():
        plan, choice = _plan(scene, request)
        if plan.seconds <= SHORT_RUN and plan.memory_mb <= SMALL_MB:
            plan = _with_outcome(plan, scene, request, choice)
    return plan


def _with_outcome(plan: Plan, scene: Scene, request: Any, choice: Choice | None) -> Plan:
    """The plan, with a warning where the run reaches no result, or with settings that would do; ValueError as the run."""
    try:
        answer = answer_as_run(scene, request, choice)
    except NoResultError as reason:
        return replace(plan, parts=(*plan.parts, ("warning", f"no result: {reason}")))
    enough = "" if choice is not None else coarser_settings(scene, request, getattr(answer, "errors", None))
    return replace(plan, parts=(*plan.parts, ("enough", enough))) if enough else plan


def coarser_settings(scene: Scene, request: Any, errors: ErrorBudget | None) -> str:
    """The accuracy that is a tenth of what the model or the data leave uncertain; empty where the settings are no finer than that.

    Of kinds whose accuracy one field decides on, and where that field is not given.
    """
    from rotor.scenes.accuracy import chosen

    goals = numerics_of(scene.kind).goals
    if errors is None or errors.numerical is None or errors.unit not in goals or goals[errors.unit].choose is not None:
        return ""
    uncertain = max((errors.model, errors.data), key=lambda term: term.value or 0.0)
    goal = float(f"{SHARE * (uncertain.value or 0.0):.2g}")
    if not 0.0 < goal > errors.numerical:
        return ""
    try:
        choice = chosen(msgspec.structs.replace(scene, accuracy=goal), request)
    except ValueError:  # the field is given
        return ""
    if choice.how == NOTHING_CHEAPER:
        return ""
    enough, size = (f"{value:.2g} {errors.unit}".rstrip() for value in (goal, uncertain.value or 0.0))
    return f'accuracy = "{enough}" would do, a tenth of {size}: {uncertain.source}'


def _plan(scene: Scene, request: Any) -> tuple[Plan, Choice | None]:
    """The plan, and the settings for the accuracy of the scene; None where it asks for none, or where the run alone finds them."""
    from rotor.scenes.accuracy import asked_of, unit_of

    goal, numerics = asked_of(scene), numerics_of(scene.kind)
    if goal is None:
        return plan_of_request(scene.kind, request), None
    if numerics.planned is not None and unit_of(scene) == next(iter(numerics.goals)):
        return numerics.planned(scene, request, goal)
    choices: list[Choice | None] = []
    search = timed(lambda: choices.append(choice_of(scene, request)), LONG_SEARCH)
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
    """The plan of a request; of a kind that says nothing of its plan that of a run."""
    if plan := numerics_of(kind).plan:
        return plan(request)
    answer, table = answering(kind), verb_of(kind).table
    return plan_of_whole(kind, lambda: answer(request), lambda result: {"counts": {"rows": len(table(result))}})


def _checked(rounding: float, goal: float, choice: Choice) -> float:
    """Rounding of the energies of the highest J in MHz; ValueError where it is clearly more than the accuracy asked for.

    A run leaves out levels beyond the reach of the distortion constants, so that its rounding may be a little less.
    """
    from rotor.scenes.accuracy import out_of_reach

    if rounding > 2.0 * goal:
        raise out_of_reach(goal, rounding, "MHz", choice.how)
    return rounding
