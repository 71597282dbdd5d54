"""What a scene will do, before it is done: method, basis, counts, time and memory - and what it leaves out, by size.

Seconds come from a short calibration: the same request to a lower J (or fewer molecules, fields, steps), scaled by the work that
is left. They are processor time without start-up and compilation, within a factor of 3 where they are above 1 s. Memory is the peak
of what Python and NumPy have in use in the same short runs, and grows with what the answer holds.
"""

from __future__ import annotations

import math
import os
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rotor.requests.fill import Given
from rotor.scenes import left_out
from rotor.scenes.choice import Choice
from rotor.scenes.kind import NoResultError, kind_of
from rotor.scenes.numerics import load, numerics_of
from rotor.scenes.plan_parts import (
    LONG_SEARCH,
    Plan,
    effect_texts,
    extrapolated,
    extrapolated_mb,
    good_numbers,
    level_parts,
    peak_mb,
    timed,
)
from rotor.scenes.run import choice_of, output_paths, refuse_as_run
from rotor.scenes.scene import Scene
from rotor.verbs.verb import Work, verb_of

if TYPE_CHECKING:
    from rotor.tops.top import Top

SHORT_J = (12, 30)  # of the calibration; a J that is not above the second is timed itself
SETTLING_STEPS = 50  # of a box, after which its forces are nearly those of a fluid
SHORT_GAS, SHORT_STEPS = (500, 2000), (5, 20)  # likewise
SHORT_RUN, SMALL_MB = 1.0, 500.0  # seconds and memory of a scene that is run for its plan
BYTES_A_MOLECULE = 136  # momentum, attitude, place, velocity and energies of a molecule that is not being moved


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
    """The plan, with a warning where the run reaches no result; ValueError as the run."""
    try:
        refuse_as_run(scene, request, choice)
    except NoResultError as reason:
        return replace(plan, parts=(*plan.parts, ("warning", f"no result: {reason}")))
    return plan


def _plan(scene: Scene, request: Any) -> tuple[Plan, Choice | None]:
    """The plan, and the settings for the accuracy of the scene; None where it asks for none, or where the run alone finds them."""
    if getattr(scene, "accuracy", None) is None:
        return plan_of_request(scene.kind, request), None
    if hasattr(request, "tolerance") and scene.kind == "tumble":
        from rotor.scenes.plan_of_motion import plan_with_accuracy

        return plan_with_accuracy(scene, request)
    found: list[Choice | None] = []
    search = timed(lambda: found.append(choice_of(scene, request)), LONG_SEARCH)
    choice = found[-1]
    assert choice is not None  # the scene has an accuracy
    plan, parts = plan_of_request(scene.kind, choice.request), [("accuracy", choice.how)]
    if numerics_of(scene.kind).levels:
        parts.append(("orders of distortion", "all that the constants have: fewer save milliseconds at the most"))
        parts.append(("rounding", f"{_checked_rounding(scene, choice):.1e} MHz of the highest energy"))
    return replace(plan, parts=(*plan.parts, *parts), seconds=plan.seconds + search), choice


def plan_of_request(kind: str, request: Any) -> Plan:
    """The plan of a request; of a kind that says nothing of its plan that of a run."""
    if name := numerics_of(kind).plan:
        plan: Plan = load(name)(request)
        return plan
    verb = verb_of(kind)
    work = Work(shown=verb.read_shown(Given()))
    found: list[Any] = []
    seconds = timed(lambda: found.append(verb.answer(request, work)))
    return Plan(
        kind=kind,
        effects=(),
        good=(),
        parts=(),
        counts={"rows": len(verb.table(found[-1]))},
        seconds=seconds,
        memory_mb=peak_mb(lambda: verb.answer(request, work)),
        left_out=(),
    )


def _checked_rounding(scene: Scene, choice: Choice) -> float:
    """Rounding of the rotational energies of the highest J in MHz; ValueError where it is clearly more than the accuracy asked for.

    A run leaves out levels beyond the reach of the distortion constants, so that its rounding may be a little less.
    """
    from rotor.quantum.request import LevelsRequest, answer_levels
    from rotor.scenes.accuracy import asked_of, out_of_reach, rounding_mhz

    request, asked = choice.request, asked_of(scene)
    j = _highest_j(scene.kind, request)
    assert asked is not None
    levels = answer_levels(LevelsRequest(request.top, jmin=j, jmax=j)).table.levels
    rounding = rounding_mhz(levels)
    if rounding > 2.0 * asked:
        raise out_of_reach(asked, rounding, "MHz", choice.how)
    return rounding


def _highest_j(kind: str, request: Any) -> int:
    if kind == "levels":
        return int(request.jmax)
    if kind == "spectrum":
        return _jmax_of_spectrum(request)[0]
    from rotor.spectra.raman_request import answer_raman

    return int(answer_raman(request).lines.jmax)


def _jmax_of_spectrum(request: Any) -> tuple[int, str]:
    """J max of a list of lines, and why."""
    from rotor.spectra.intensity import jmax_for_cut
    from rotor.thermodynamics import partition_function

    if request.jmax is not None:
        return request.jmax, "given"
    top, kelvin = request.top, request.temperature_k
    cut = -math.inf if request.min_lgint is None else request.min_lgint
    q = request.q or partition_function(top, kelvin).q
    dipole = top.dipole_abc_debye or (0.0, 0.0, 0.0)
    return jmax_for_cut(top, dipole, kelvin, q * request.vibrational_factor, cut), "what the cut needs"


def allowed_lines(top: Top, jmax: int) -> int:
    """How many dipole lines of a semi-rigid top the selection rules allow up to a J max: blocks that a component connects.

    μ_a keeps the parity of Ka, μ_c that of Kc, μ_b changes both; lines of a linear or symmetric top have ΔJ = 1 and ΔK = 0. Levels
    of spin weight 0 do not exist.

    >>> from rotor.tops.top import Top
    >>> allowed_lines(Top.from_constants("A=10 B=6 C=4 GHz", dipole_abc_debye=(1, 0, 0)), 1)  # 1(0,1)-0(0,0), 1(1,0)-1(1,1)
    2
    """
    from rotor.quantum.solve import solve_levels
    from rotor.quantum.wang.basis import wang_blocks
    from rotor.quantum.wang.rotation import representation_of

    dipole = top.dipole_abc_debye or (0.0, 0.0, 0.0)
    if not any(dipole):
        return 0
    if top.kind != "asymmetric":
        levels = solve_levels(top, jmax, vectors=False)
        return int(((levels.weight > 0) & (levels.rotational < jmax)).sum())
    weights = top.spin_weights.to_mapping()
    blocks = [
        {b.species: b.size for b in wang_blocks(j, representation_of(top)) if weights.get(b.species, 1)}
        for j in range(jmax + 1)
    ]
    flips = [flip for mu, flip in zip(dipole, ((False, True), (True, True), (True, False)), strict=True) if mu]
    total = 0
    for j, level in enumerate(blocks):
        for up in (level, blocks[j + 1]) if j < jmax else (level,):
            pairs = sum(size * up.get(_flipped(species, flip), 0) for species, size in level.items() for flip in flips)
            total += pairs // 2 if up is level else pairs
    return total


def _flipped(species: str, flip: tuple[bool, bool]) -> str:
    return "".join({"e": "o", "o": "e"}[one] if change else one for one, change in zip(species, flip, strict=True))


def plan_of_spectrum(request: Any) -> Plan:
    """The plan of a spectrum request."""
    from rotor.quantum.estimates.limits import populated_j
    from rotor.spectra.request import answer_spectrum

    top, kelvin = request.top, request.temperature_k
    jmax, why = _jmax_of_spectrum(request)
    j = min(populated_j(top, kelvin), max(jmax, 1))
    sizes, growing = (max(SHORT_J[0], jmax // 3), max(SHORT_J[1], jmax // 2)), 1 if top.kind == "linear" else 2

    def short(j: int) -> Any:
        return answer_spectrum(replace(request, jmax=j))

    seconds = extrapolated(short, lambda j: (j + 1.0) ** (3 if top.kind == "asymmetric" else 1), sizes, jmax)
    lines = allowed_lines(top, jmax)  # after the calibration, which refuses a J that no list has
    _, b, c = top.rotational_constants_mhz
    absent = left_out.of_levels(top, j, request.effects)
    pressure = request.layer.pressure_bar if request.layer else None
    lowest, highest = request.range_mhz or (0.0, math.inf)
    frequency = min(max((b + c) * (j + 1), lowest), highest)  # of the lines that are most populated, inside the range
    widths = [
        left_out.doppler(top, frequency, kelvin) if request.shape == "sticks" else None,
        left_out.pressure_width(top, kelvin, pressure) if request.shape in ("sticks", "gaussian") else None,
    ]
    absent = left_out.largest_first([*absent, *(one for one in widths if one is not None)])
    return Plan(
        kind="spectrum",
        effects=effect_texts(top, j, request.effects),
        good=good_numbers(top, request.effects),
        parts=(("J max", f"{jmax}: {why}"), *level_parts(top, jmax, request.effects)),
        counts={"allowed lines of one state, without spins, before range and cut": lines},
        seconds=seconds,
        memory_mb=extrapolated_mb(short, lambda j: (j + 1.0) ** growing, sizes, jmax),
        left_out=tuple(absent),
    )


def plan_of_levels(request: Any) -> Plan:
    """The plan of a list of levels."""
    from rotor.quantum.request import answer_levels

    top, jmax = request.top, request.jmax
    plain = replace(request, jmin=0, kmin=None, kmax=None, max_energy_mhz=None)
    power = 3 if top.kind == "asymmetric" else 1

    def short(j: int) -> Any:
        return answer_levels(replace(plain, jmax=j)).table.columns

    seconds = extrapolated(short, lambda j: (j + 1.0) ** power, SHORT_J, jmax)
    count = (jmax + 1) ** 2 - request.jmin**2 if top.kind == "asymmetric" else jmax + 1 - request.jmin
    if top.kind in ("prolate", "oblate"):
        count = (jmax + 1) * (jmax + 2) // 2 - request.jmin * (request.jmin + 1) // 2
    return Plan(
        kind="levels",
        effects=effect_texts(top, max(jmax, 1), request.effects),
        good=good_numbers(top, request.effects),
        parts=tuple(level_parts(top, jmax, request.effects)),
        counts={"levels": count},
        seconds=seconds,
        memory_mb=extrapolated_mb(short, lambda j: (j + 1.0) ** power, SHORT_J, jmax),
        left_out=tuple(left_out.of_levels(top, max(jmax, 1), request.effects)),
    )


def plan_of_gas(request: Any) -> Plan:
    """The plan of a gas request."""
    from rotor.classical.gas.ensembles import PIECE
    from rotor.thermodynamics.classical_gas import answer_gas

    def short(n: int) -> Any:
        return answer_gas(replace(request, molecules=n))

    points, together = len(request.times_ps or ()), min(request.molecules, PIECE)
    rest = BYTES_A_MOLECULE * (request.molecules - together) / 1e6
    return Plan(
        kind="gas",
        effects=("free rotation of rigid molecules", "free flight"),
        good=("energy and angular momentum of every molecule",),
        parts=(("method", "exact free motion of every molecule (theta functions); no step"),),
        counts={"molecules": request.molecules, "times": points},
        seconds=extrapolated(short, float, SHORT_GAS, request.molecules),
        memory_mb=extrapolated_mb(short, float, SHORT_GAS, together) + rest,
        left_out=tuple(left_out.of_classical_gas(request.top, request.temperature_k)),
    )


def plan_of_raman(request: Any) -> Plan:
    """The plan of a raman request."""
    from rotor.quantum.estimates.limits import populated_j
    from rotor.spectra.raman_request import answer_raman

    top, kelvin = request.top, request.temperature_k
    found: list[Any] = []
    seconds = timed(lambda: found.append(answer_raman(request)))  # milliseconds for what is not an asymmetric top
    lines, j = found[-1].lines, populated_j(top, kelvin)
    return Plan(
        kind="raman",
        effects=effect_texts(top, j, request.effects),
        good=good_numbers(top, request.effects),
        parts=(("J max", f"{lines.jmax}: {found[-1].jmax_source}"), *level_parts(top, lines.jmax, request.effects)),
        counts={"lines": len(lines)},
        seconds=seconds,
        memory_mb=peak_mb(lambda: answer_raman(request)),
        left_out=tuple(left_out.of_levels(top, j, request.effects)),
    )


def plan_of_thermo(request: Any) -> Plan:
    """The plan of a thermo request."""
    from rotor.quantum.estimates.limits import populated_j
    from rotor.thermodynamics.request import answer_thermo

    top, hottest = request.top, max(request.temperatures_k)
    found: list[Any] = []
    seconds = timed(lambda: found.append(answer_thermo(replace(request, temperatures_k=(hottest,)))))
    jmax = int(found[-1].functions.jmax.max())
    summed = f"levels summed to J = {jmax} at {hottest:g} K" if jmax >= 0 else "classical with corrections: no levels"
    vibration = [] if request.vibrations else [left_out.LeftOut("vibration", None, "", "no states given")]
    j = populated_j(top, hottest)
    return Plan(
        kind="thermo",
        effects=effect_texts(top, j, found[-1].effects),
        good=good_numbers(top, found[-1].effects),
        parts=(("method", f"{summed}, to {request.relative_error:g} of Q, U and C_v"),),
        counts={"temperatures": len(request.temperatures_k)},
        seconds=seconds,
        memory_mb=peak_mb(lambda: answer_thermo(request)),
        left_out=(*left_out.of_levels(top, j, found[-1].effects), *vibration),
    )


def plan_of_align(request: Any) -> Plan:
    """The plan of a gas under pulses request."""
    from rotor.alignment.request import answer_align
    from rotor.quantum.effects.watson import SEMI_RIGID

    coarse = replace(request, tolerance=max(request.tolerance, 1e-3), points=11, classical_molecules=0)
    found = answer_align(coarse)
    seconds = timed(lambda: answer_align(coarse)) * (coarse.tolerance / request.tolerance) ** 0.25
    trace, j = found.trace, max(found.trace.ensemble.jmax, 1)
    return Plan(
        kind="align",
        effects=(*effect_texts(request.top, j, SEMI_RIGID), *(f"pulse on the {one.acts_on}" for one in request.pulses)),
        good=("M",) if all(one.axis == (0, 0, 1) for one in request.pulses) else (),
        parts=(
            (
                "basis",
                f"J to {request.jmax}"
                if request.jmax
                else f"J to {trace.jmax} at least, for a tolerance of {coarse.tolerance:g}",
            ),
            (
                "method",
                f"{trace.method} during the pulses, exact phases after them; steps halved until the cosines agree",
            ),
        ),
        counts={"initial states": trace.states, "times": request.points},
        seconds=seconds,
        memory_mb=peak_mb(lambda: answer_align(replace(coarse, points=request.points))),
        left_out=tuple(left_out.of_levels(request.top, j, SEMI_RIGID)),
    )


def plan_of_fluid(request: Any) -> Plan:
    """The plan of a fluid request."""
    from rotor.fluids.equilibration import equilibration_range
    from rotor.fluids.request import NewBox, answer_fluid, box_of

    settings = request.settings
    if request.engine != "rotor":
        raise ValueError(f"numerics.engine {request.engine}: a plan is of the engine rotor alone")
    made = request if not isinstance(request.box, NewBox) else replace(request, box=box_of(request))
    made = replace(made, box_equilibration_ps=0.0)
    least_ps, most_ps = equilibration_range(request.equilibration_ps)
    before = round(1e3 * least_ps / settings.step_fs)

    def short(steps: int) -> Any:
        return answer_fluid(
            replace(made, box=made.box.copy(), settings=replace(settings, steps=steps)), progress=lambda *_: None
        )

    seconds = extrapolated(short, float, SHORT_STEPS, before + settings.steps)
    until = (
        "" if most_ps == least_ps else f" at least, until stationary, {most_ps:g} ps at most; seconds count the least"
    )
    return Plan(
        kind="fluid",
        effects=("Lennard-Jones and charges of rigid sites", settings.electrostatics),
        good=("energy", "momentum") if settings.ensemble == "nve" else (),
        parts=(
            ("method", f"splitting of rigid bodies, {settings.step_fs:g} fs a step, {settings.ensemble}"),
            ("forces", f"cutoff {settings.cutoff_angstrom:g} Å, {settings.electrostatics}, even liquid beyond it"),
            *([("equilibration", f"{least_ps:g} ps{until}")] if before else []),
        ),
        counts={"atoms": len(made.box), "steps": settings.steps} | ({"equilibration steps": before} if before else {}),
        seconds=seconds,
        memory_mb=peak_mb(lambda: short(min(SETTLING_STEPS, settings.steps))),
        left_out=tuple(_left_out_of_fluid(short(min(SETTLING_STEPS, settings.steps)).atoms, settings)),
    )


def _left_out_of_fluid(atoms: Any, settings: Any) -> list[left_out.LeftOut]:
    """By the forces and torques of a box."""
    from rotor.fluids.forces.models import models_of, shapes_of
    from rotor.fluids.motion.dynamics import RigidDynamics

    dynamics = RigidDynamics(atoms, 1.0, removed=0, shapes=shapes_of(models_of(settings.model)))
    return left_out.of_fluid(dynamics.bodies, *dynamics.wrench(), settings.temperature_k, settings.step_fs)


def plan_of_torsion(request: Any) -> Plan:
    """The plan of a torsion request."""
    from rotor.thermodynamics.torsion_request import answer_torsion

    found: list[Any] = []
    seconds = timed(lambda: found.append(answer_torsion(request)))
    answer = found[-1]
    scanned = "" if answer.scan is None else f"; {len(answer.scan.angles) + 1} relaxed geometries"
    return Plan(
        kind="torsion",
        effects=(f"potential: {answer.source}, barrier {answer.facts()['barrier_cm']:.4g} cm⁻¹",),
        good=("species",) if answer.torsion.fold > 1 else (),
        parts=(("basis", f"exp(imα) up to m = {answer.waves}, {answer.torsion.fold} species{scanned}"),),
        counts={"levels": len(answer.levels), "temperatures": len(request.temperatures_k)},
        seconds=seconds,
        memory_mb=peak_mb(lambda: answer_torsion(request)),
        left_out=(
            left_out.LeftOut("coupling with other vibrations and the whole rotation", None, "", "not estimated"),
        ),
    )
