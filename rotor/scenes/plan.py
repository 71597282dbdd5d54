"""Plan of a scene: method, basis, counts, time, memory, and neglected effects by size."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

from rotor.requests.accuracy import Accuracy
from rotor.requests.budget import ErrorBudget, ErrorTerm
from rotor.requests.fill import naming
from rotor.requests.knob import NOTHING_CHEAPER, Choice
from rotor.requests.plan import LONG_SEARCH, Plan, Run, timed
from rotor.scenes.run import Where, files_of, scene_calculation
from rotor.scenes.scene import Scene, checked_scene
from rotor.scenes.sweep.points import Points, is_sweep, points, text_of
from rotor.verbs.common.calculation import Calculation, NoResultError
from rotor.verbs.common.verb import Verb

MOST_POINTS = 20  # of a sweep: each is planned
SHARE = 0.1  # of the model or data error: a smaller numerical error does not matter
SHORT_RUN, SMALL_MB = 1.0, 500.0  # seconds and memory up to which a scene is run for its plan


def plan_of(scene: Scene, folder: Where = ".", out: Where = ".") -> Plan:
    """The plan of a scene. A scene of at most a second is also run, so that its errors are found.

    Parameters
    ----------
    scene : Scene
        Of a sweep, the longest of its points is planned; 20 points at most.
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
    >>> from rotor.scenes.scene import make_scene
    >>> plan_of(make_scene("levels", molecule="CO")).counts
    {'levels': 11}
    """
    checked_scene(scene)
    if is_sweep(scene, folder):
        return _plan_of_sweep(points(scene, folder), folder, out)
    files_of(scene, out)
    return plan_of_calculation(scene_calculation(scene, folder))


def _plan_of_sweep(sweep: Points, folder: Where, out: Where) -> Plan:
    """The plan of the point that takes longest, with the time of all points."""
    if len(sweep) > MOST_POINTS:
        raise ValueError(
            f"sweep: {len(sweep)} points, of which {MOST_POINTS} at most are planned: give fewer values or molecules for the plan"
        )
    planned = [(point, plan_of(point.scene, folder, out)) for point in sweep]
    point, longest = max(planned, key=lambda pair: pair[1].seconds)
    seconds = sum(plan.seconds for _, plan in planned)
    text = f"{len(sweep)}, {seconds:.2g} s of processor time together; this is the longest: {text_of(point.values)}"
    return replace(longest, parts=(("points", text), *longest.parts))


def plan_of_calculation(calculation: Calculation) -> Plan:
    """The plan of a verb with its inputs."""
    with naming(calculation.verb.named, calculation.entries.style):
        plan, choice = _plan(calculation)
        if plan.seconds <= SHORT_RUN and plan.memory_mb <= SMALL_MB:
            plan = _with_outcome(plan, calculation, choice)
    return plan


def _with_outcome(plan: Plan, calculation: Calculation, choice: Choice | None) -> Plan:
    """The plan with a warning if the run has no result, or with coarser settings that would do; ValueError as in a run."""
    bare = replace(calculation, work=replace(calculation.work, files={}))
    try:
        answer = bare.answer(calculation.request if choice is None else choice.request, choice).answer
    except NoResultError as reason:
        return replace(plan, parts=(*plan.parts, ("warning", f"no result: {reason}")))
    enough = "" if choice is not None else coarser_settings(calculation, getattr(answer, "errors", None))
    return replace(plan, parts=(*plan.parts, ("enough", enough))) if enough else plan


def coarser_settings(calculation: Calculation, errors: ErrorBudget | None) -> str:
    """Advice to use an accuracy of a tenth of the model or data error; empty if the settings are no finer than that.

    Only if the accuracy is set by fields alone, and if the scene leaves them out.
    """
    numerics, entries = calculation.verb.load_numerics(), calculation.entries
    if errors is None or errors.numerical is None or errors.unit not in numerics.goals:
        return ""
    uncertain = max((errors.model, errors.data), key=lambda term: term.value or 0.0)
    goal = float(f"{SHARE * (uncertain.value or 0.0):.2g}")
    if not 0.0 < goal > errors.numerical:
        return ""
    accuracy = Accuracy(goal, errors.unit, False, numerics)
    if any(knob.field is None for knob in accuracy.knobs(calculation.request)):
        return ""
    try:
        choice = accuracy.chosen(calculation.request, entries, calculation.verb.compute)
    except ValueError:  # the scene sets the field
        return ""
    if choice.how == NOTHING_CHEAPER:
        return ""
    enough, size = (f"{value:.2g} {errors.unit}".rstrip() for value in (goal, uncertain.value or 0.0))
    return f'accuracy = "{enough}" would do, a tenth of {size}: {uncertain.source}'


def _plan(calculation: Calculation) -> tuple[Plan, Choice | None]:
    """The plan, and the settings for the accuracy of the scene; None without an accuracy."""
    verb, request, goal = calculation.verb, calculation.request, calculation.accuracy
    if goal is None:
        return plan_of_request(verb, request), None
    numerics = goal.numerics
    choose = partial(goal.chosen, request, calculation.entries, verb.compute, confirmed=False)
    choice, search = timed(choose, LONG_SEARCH)
    plan, parts = plan_of_request(verb, choice.request), [("accuracy", choice.how)]
    parts += [(knob.title, knob.unchosen) for knob in numerics.all_knobs(request) if knob.unchosen]
    if numerics.rounding is not None:
        rounding = numerics.rounding(choice.request)
        _refuse_rounding(rounding, goal, choice)
        parts.append(("rounding", f"{rounding.value:.1e} {numerics.first_unit} of {rounding.source}"))
    return replace(plan, parts=(*plan.parts, *parts), seconds=(1.0 + choice.confirming) * plan.seconds + search), choice


def plan_of_request(verb: Verb, request: Any) -> Plan:
    """The plan of a request: its cost, and what its verb says of it."""
    numerics = verb.load_numerics()

    def complete(request: Any) -> Any:
        answer = verb.compute(request)
        verb.table(answer).columns  # noqa: B018  # made on demand
        return answer

    cost = numerics.cost(request, Run(verb.compute, complete))
    described = (
        {"counts": {"rows": len(verb.table(cost.answer))}}
        if numerics.describe is None
        else numerics.describe(request, cost)
    )
    return Plan(verb.name, seconds=cost.seconds, memory_mb=cost.memory_mb, **described)


def _refuse_rounding(rounding: ErrorTerm, goal: Accuracy, choice: Choice) -> None:
    """ValueError for an error of rounding that clearly exceeds the requested accuracy.

    The factor of 2: a run omits levels beyond the reach of the distortion constants, so that its rounding may be less.
    """
    size = rounding.value or 0.0
    if goal.unit == goal.numerics.first_unit and size > 2.0 * goal.value:
        raise goal.out_of_reach(size, choice.how)
