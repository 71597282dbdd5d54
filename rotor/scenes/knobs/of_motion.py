"""Knobs of classical motion: tolerance or step of a driven body, molecules of a gas, step and forces of a fluid."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.requests.knob import Measure, Sweep, Sweeps, ladder
from rotor.scenes.choice import NOTHING_CHEAPER

if TYPE_CHECKING:
    from rotor.fluids.request import FluidRequest

TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11)
FINEST_TOLERANCE = 1e-13
DIVISIONS = (8, 16, 32, 64, 128)  # of the duration: steps of a splitting, times 16
ORDERS = (2, 4, 6, 8)
MOLECULES = (100, 300, 1_000, 3_000, 10_000)
SEEDS = 8  # gases whose errors are averaged
MOST_IN_REFERENCE = 200_000
STEPS_FS = (8.0, 6.0, 4.0, 3.0, 2.0, 1.0, 0.5)
FOLLOWED_FS, FINEST_STEP_FS = 48.0, 0.05  # how long a box is followed, and the step of its reference
CUTOFFS = (5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 12.0)  # Å
EWALD = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
FINEST_EWALD = 1e-10


def tumble(request: Any) -> Sweeps:
    """Of a scene of one body."""
    from rotor.classical.tumble import TumbleRequest

    if isinstance(request, TumbleRequest):
        return Sweeps((), (f"the free motion: {NOTHING_CHEAPER}; theta functions, round-off alone",))
    from rotor.classical.driven import answer_driven

    measure = Measure("attitude", "rad", _turned)
    finest = replace(request, step=None, tolerance=min(FINEST_TOLERANCE, 1e-2 * request.tolerance))
    against = f"steps to {finest.tolerance:g}"
    own = request.tolerance if request.step is None else None
    settings = ladder(TOLERANCES, own, lambda one: replace(request, step=None, tolerance=one))
    knobs = [Sweep("numerics.tolerance", (measure,), settings, finest, against, answer_driven)]
    remark = _refusal(request)
    if remark is None:
        knobs += [_splitting(request, order, finest, measure, against) for order in ORDERS]
    return Sweeps(tuple(knobs), () if remark is None else (f"numerics.step: {remark}",))


def _turned(found: Any, reference: Any) -> float:
    from rotor.geometry.rotations import distance

    return float(np.max(distance(found.motion.attitude, reference.motion.attitude)))


def _refusal(request: Any) -> str | None:
    """Why no splitting serves these effects; None where one does."""
    from rotor.classical.driven import answer_driven

    first, second = request.times[:2]
    try:
        answer_driven(replace(request, times=(first, second), step=(second - first) / 4))
    except ValueError as error:
        return str(error)
    return None


def _splitting(request: Any, order: int, finest: Any, measure: Measure, against: str) -> Sweep:
    from rotor.classical.driven import answer_driven

    span = abs(request.times[-1] - request.times[0])
    own = request.step if request.step is not None and request.order == order else None
    steps = [span / (16 * number) for number in DIVISIONS]
    settings = ladder(steps, own, lambda one: replace(request, step=one, order=order), "{:.3g}".format)
    return Sweep(f"numerics.step, order {order}", (measure,), settings, finest, against, answer_driven)


def gas(request: Any) -> Sweeps:
    """Of a scene of a classical gas: the number of molecules, whose error is statistical."""
    from rotor.thermodynamics.classical_gas import answer_gas

    def answers(asked: Any) -> list[Any]:
        return [answer_gas(replace(asked, seed=asked.seed + 10 * n)) for n in range(SEEDS)]

    still = replace(request, times_ps=None)
    counts = [n for n in MOLECULES if n < request.molecules]
    make = partial(_with_molecules, still)
    exact = (Measure("temperature", "K", _temperature_error), Measure("heat capacity", "%", _heat_capacity_error))
    settings = ladder(counts, request.molecules, make, "{:.0f}".format)
    knobs = [Sweep("numerics.molecules", exact, settings, None, "kT/2 in every degree of freedom", answers, SEEDS)]
    if request.times_ps is not None:
        most = min(100 * request.molecules, MOST_IN_REFERENCE)
        many = replace(request, molecules=most, seed=request.seed + 1)
        curves = Measure("C1 and C2", "", _curve_error)
        own = ladder(counts, request.molecules, partial(_with_molecules, request), "{:.0f}".format)
        reference, against = many, f"{most} other molecules"
        knobs.append(Sweep("numerics.molecules", (curves,), own, reference, against, answer_gas))
    return Sweeps(tuple(knobs), (f"the motion of each molecule: {NOTHING_CHEAPER}; theta functions, round-off alone",))


def _with_molecules(request: Any, count: float) -> Any:
    return replace(request, molecules=int(count))


def _mean_square(errors: list[float]) -> float:
    return math.sqrt(sum(one * one for one in errors) / len(errors))


def _temperature_error(found: list[Any], _: Any) -> float:
    """Root mean square error in K of the temperature that the kinetic energy of a gas has."""
    return _mean_square([_energies(one).mean() / _degrees(one) * 2 - one.request.temperature_k for one in found])


def _heat_capacity_error(found: list[Any], _: Any) -> float:
    """Root mean square error in percent of C_v = var(E)/kT² of a molecule, f k/2 for f degrees of freedom."""
    return _mean_square(
        [100 * (_energies(one).var() / (0.5 * _degrees(one) * one.request.temperature_k**2) - 1) for one in found]
    )


def _energies(answer: Any) -> Any:
    """The kinetic energy over k of each molecule in K."""
    from rotor import units

    return sum(answer.ensemble.kinetic.energies.values()) / units.EV_PER_K


def _degrees(answer: Any) -> int:
    return len(answer.ensemble.kinetic.energies)


def _curve_error(found: Any, reference: Any) -> float:
    pairs = [(getattr(found.correlations, name), getattr(reference.correlations, name)) for name in ("c1", "c2")]
    return max(float(np.max(np.abs(one - true))) for one, true in pairs if one is not None)


def fluid(request: FluidRequest) -> Sweeps:
    """Of a scene of a fluid: the step, by energy and positions over a short time; cutoff and Ewald's tolerance, by forces."""
    from rotor.fluids.request import NewBox, box_of

    if request.engine != "rotor":
        raise ValueError(f"numerics.engine {request.engine}: the knobs of the engine rotor alone are swept")
    made = replace(request, box=box_of(request)) if isinstance(request.box, NewBox) else request
    return Sweeps(
        (_step(made), _cutoff(made), *_ewald(made)), ("conditions.steps: the error of a mean is in its report",)
    )


def followed(request: FluidRequest, step_fs: float) -> FluidRequest:
    """The box without a thermostat over a short time, by one step."""
    steps = max(round(FOLLOWED_FS / step_fs), 1)
    short = replace(request.settings, ensemble="nve", step_fs=step_fs, steps=steps, every=1)
    return replace(request, settings=short)


def answer_followed(request: FluidRequest) -> Any:
    """The run of a copy of its box."""
    from rotor.fluids.request import answer_fluid

    return answer_fluid(replace(request, box=_copied(request)), progress=lambda *_: None)


def _copied(request: FluidRequest) -> Any:
    """A copy of the box, without its potential."""
    box: Any = request.box
    return box.copy()


def conserved_k(answer: Any) -> float:
    """Root mean square of the conserved energy about its mean, for each degree of freedom in K: 2E/k over their number."""
    from rotor import units

    facts = answer.facts()
    return float(2.0 * facts["conserved_rms_ev"] / units.EV_PER_K / facts["degrees"]["total"])


def _moved(found: Any, reference: Any) -> float:
    """Root mean square distance in Å of the nuclei at the end."""
    apart = found.atoms.positions - reference.atoms.positions
    lengths = reference.atoms.cell.lengths()
    if reference.atoms.pbc.all():
        apart = apart - lengths * np.round(apart / lengths)
    return float(np.sqrt(np.mean(np.sum(apart**2, axis=1))))


def _step(request: FluidRequest) -> Sweep:
    measures = (
        Measure("conserved energy per degree", "K", lambda found, _: conserved_k(found)),
        Measure(f"positions after {FOLLOWED_FS:g} fs", "Å", _moved),
    )
    settings = ladder(STEPS_FS, request.settings.step_fs, partial(followed, request))
    reference = followed(request, FINEST_STEP_FS)
    return Sweep("numerics.step", measures, settings, reference, f"a step of {FINEST_STEP_FS:g} fs", answer_followed)


def forces_of(request: FluidRequest, electrostatics: str, cutoff: float, tolerance: float) -> Callable[[], Any]:
    """A call that gives the forces on the nuclei of the box.

    Parameters
    ----------
    request : FluidRequest
        With a box that is made.
    electrostatics : str
        As in the settings.
    cutoff : float
        Å.
    tolerance : float
        Of Ewald's sum.

    Returns
    -------
    callable
        Its answer is an (n, 3) array in eV/Å.
    """
    from rotor.fluids.forces.potential import RigidPotential

    atoms = _copied(request)
    atoms.calc = RigidPotential(
        request.settings.model, cutoff_angstrom=cutoff, electrostatics=electrostatics, tolerance=tolerance
    )

    def forces() -> Any:
        atoms.calc.reset()
        return atoms.get_forces()

    return forces


def force_difference(found: Any, reference: Any) -> float:
    """Root mean square difference of forces in percent of their root mean square."""
    return 100.0 * float(np.sqrt(np.mean((found - reference) ** 2) / np.mean(reference**2)))


def _most(request: FluidRequest) -> float:
    """The largest cutoff that the box allows."""
    return 0.5 * float(min(request.box.cell.lengths()))  # type: ignore[union-attr]


def _cutoff(request: FluidRequest) -> Sweep:
    most, own = _most(request), request.settings
    make = partial(forces_of, request, own.electrostatics)
    cutoffs = [one for one in CUTOFFS if one < 0.95 * most]
    settings = ladder(cutoffs, own.cutoff_angstrom, lambda one: make(one, own.ewald_tolerance))
    reference = forces_of(request, "ewald", 0.99 * most, FINEST_EWALD)
    against = f"Ewald's sum to {FINEST_EWALD:g}, Lennard-Jones to {0.99 * most:.3g} Å"
    measure = Measure("force", "%", force_difference)
    return Sweep(
        f"numerics.cutoff, {own.electrostatics}", (measure,), settings, reference, against, lambda call: call()
    )


def _ewald(request: FluidRequest) -> list[Sweep]:
    """The tolerance of Ewald's sum, where the scene has one."""
    own = request.settings
    if own.electrostatics != "ewald":
        return []
    make = partial(forces_of, request, "ewald", own.cutoff_angstrom)
    settings = ladder(EWALD, own.ewald_tolerance, make)
    measure = Measure("force", "%", force_difference)
    against = f"a tolerance of {FINEST_EWALD:g}"
    return [Sweep("numerics.ewald_tolerance", (measure,), settings, make(FINEST_EWALD), against, lambda call: call())]
