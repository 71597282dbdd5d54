"""Accuracy and plan of a fluid: the step, by short runs of the box, and Ewald's tolerance, by forces in it.

| accuracy of | what is chosen | error stated |
|---|---|---|
| conserved energy, 2E/k per degree, "0.5 K" | the step, by short runs of the box | bound of these, and of the run |
| forces of Ewald's sum, "0.1 %" | its tolerance, by forces in the box | where the run ends |

A step of order 2 conserves H + h² G to order h⁴, with h the step and G a function of coordinates and momenta. The conserved energy H
therefore deviates from its mean by h² G(q, p). The deviation depends on the part of the motion: a box with newly drawn velocities deviates
more than an equilibrated one, and a mean over a long run hides that. So n boxes with different velocities are propagated without a
thermostat over `FOLLOWED_FS`. The root mean squares r of their conserved energies give a bound for another such run: the difference
between its r and the mean of n is normal with variance σ²(1 + 1/n); divided by the standard deviation s of the n values it follows
Student's distribution with quantile t:

    r < mean(r) + t(0.99, n - 1) s(r) √(1 + 1/n)

The stated error is the larger of this bound and the root mean square of the whole run. It holds for rigid molecules with the forces of
the scene, whose cutoff is part of the model. Effects neglected by a box of classical molecules:

| left out | size |
|---|---|
| quantum corrections | ħ²/24(kT)³ (⟨F²⟩/m + Σ⟨T²⟩/I) of A/NkT (J. G. Powles and G. Rickayzen, Mol. Phys. 38, 1875 (1979)) |
| step | h²/12 Σ⟨T²⟩/I of the rotational energy (`rotor.fluids.motion.thermometers`) |
| box | N^(-1/3) of the diffusion (S. A. Khrapak, J. Phys. Chem. B (2024), arXiv:2402.09348), a short form of Yeh and Hummer's |
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor import units
from rotor.fluids.request import NewBox, answer_fluid, make_box
from rotor.fluids.settings import ELECTROSTATICS
from rotor.requests.knob import Estimate, Knob, Measure, Sought
from rotor.requests.numerics import Goal, Numerics
from rotor.requests.plan import Cost, Growth, LeftOut, largest_first

if TYPE_CHECKING:
    from rotor.arrays import Floats
    from rotor.fluids.motion.bodies import Bodies
    from rotor.fluids.request import FluidRequest

SPARE = 1.25  # the forces where a run ends are others than those that Ewald's tolerance was chosen by
BOXES, SURE = 8, 0.99  # number of boxes, and the confidence of the bound
FIRST_STEP_FS, LONGEST_STEP_FS, SHORTEST_STEP_FS = 1.0, 8.0, 0.05
EWALD_LADDER = tuple(10.0**-n for n in range(2, 11))
REFERENCE_EWALD = 1e-12  # below the finest tolerance tried, so that its error adds nothing to the one measured
STEPS_FS = (8.0, 6.0, 4.0, 3.0, 2.0, 1.0, 0.5)
FOLLOWED_FS, FINEST_STEP_FS = 48.0, 0.05  # length of a run of a box, and the step of its reference
CUTOFFS = (5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 12.0)  # Å
EWALD = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
FINEST_EWALD = 1e-10
SETTLING_STEPS, SHORT_STEPS = 50, (5, 20)  # after which forces are nearly those of a fluid; of the calibration


def with_box(request: FluidRequest) -> FluidRequest:
    """The request with its box, which is made once; ValueError for an engine whose settings are not known here."""
    if request.engine != "rotor":
        raise ValueError(
            f"numerics.engine {request.engine}: an accuracy, its cost and a plan are those of the engine rotor alone"
        )
    if not isinstance(request.box, NewBox):
        return request
    box = make_box(request)
    box.calc = None  # a new calculator is made for the chosen settings
    return replace(request, box=box, box_source=request.start)


def _other_forces(request: FluidRequest) -> str:
    """Why an accuracy of Ewald's forces does not suit a request."""
    other = request.settings.electrostatics
    if other == "ewald":
        return ""
    return (
        f"of the forces is that of Ewald's sum, and {other} is another model; give "
        'numerics.electrostatics = "ewald", or an accuracy of the conserved energy in K'
    )


def _shorter_steps(sought: Sought) -> Iterator[float]:
    """The longest step first, extrapolated from a short one, in hundredths of a femtosecond: the error is of second order."""
    step = FIRST_STEP_FS * math.sqrt(sought.accuracy / conserved_bound_k(sought.request, FIRST_STEP_FS))
    step = max(min(math.floor(100.0 * step) / 100.0, LONGEST_STEP_FS), SHORTEST_STEP_FS)
    while step >= SHORTEST_STEP_FS:
        yield step
        step = math.floor(95.0 * step) / 100.0


def _step_error(_: Sought, request: FluidRequest, step_fs: float) -> Estimate:
    """Bound of the deviation of the conserved energy, in K."""
    return Estimate(
        conserved_bound_k(request, step_fs), remark="; root mean square of the conserved energy about its mean"
    )


def _with_setting(request: FluidRequest, name: str, value: Any) -> FluidRequest:
    return replace(request, settings=replace(request.settings, **{name: value}))


def conserved_bound_k(request: FluidRequest, step_fs: float) -> float:
    """Upper bound of the rms deviation of a box's conserved energy over a short time, in K per degree of freedom.

    request: with a box that is made; the first of the test boxes starts with its velocities, if it has any.
    """
    from scipy.special import stdtrit

    deviations = []
    for number in range(BOXES):
        box: Any = request.box
        box = box.copy()
        if number:
            box.set_momenta(np.zeros((len(box), 3)))  # drawn anew at the temperature
        settings = replace(request.settings, seed=request.settings.seed + number)
        deviations.append(conserved_k(answer_followed(followed(replace(request, box=box, settings=settings), step_fs))))
    spread = float(np.std(deviations, ddof=1)) * math.sqrt(1.0 + 1.0 / BOXES)
    return float(np.mean(deviations)) + float(stdtrit(BOXES - 1, SURE)) * spread


def force_error(request: FluidRequest) -> float:
    """Rms error in percent of the forces in a box, relative to an Ewald sum with tolerance 1e-12 and the same cutoff."""
    settings = request.settings
    forces, reference = (
        force_function(request, "ewald", settings.cutoff_angstrom, tolerance)()
        for tolerance in (settings.ewald_tolerance, REFERENCE_EWALD)
    )
    return force_difference(forces, reference)


def followed(request: FluidRequest, step_fs: float) -> FluidRequest:
    """A short run of the box without a thermostat, with this step."""
    steps = max(round(FOLLOWED_FS / step_fs), 1)
    short = replace(request.settings, ensemble="nve", step_fs=step_fs, steps=steps, every=1)
    return replace(request, settings=short)


def answer_followed(request: FluidRequest) -> Any:
    """The run of a copy of its box."""
    return answer_fluid(replace(request, box=_copied(request)), progress=lambda *_: None)


def _copied(request: FluidRequest) -> Any:
    """A copy of the box, without its potential."""
    box: Any = request.box
    return box.copy()


def conserved_k(answer: Any) -> float:
    """Rms deviation of the conserved energy from its mean, in K per degree of freedom: 2E/k over their number."""
    facts = answer.facts()
    return float(2.0 * facts["conserved_rms_ev"] / units.EV_PER_K / facts["degrees"]["total"])


def _moved(answer: Any, reference: Any) -> float:
    """Root mean square distance in Å of the nuclei at the end."""
    apart = answer.atoms.positions - reference.atoms.positions
    lengths = reference.atoms.cell.lengths()
    if reference.atoms.pbc.all():
        apart = apart - lengths * np.round(apart / lengths)
    return float(np.sqrt(np.mean(np.sum(apart**2, axis=1))))


def force_function(request: FluidRequest, electrostatics: str, cutoff: float, tolerance: float) -> Callable[[], Any]:
    """A function that computes the forces (n, 3) in eV/Å on the nuclei of a request whose box is made."""
    from rotor.fluids.forces.potential import RigidPotential

    atoms = _copied(request)
    atoms.calc = RigidPotential(
        request.settings.model, cutoff_angstrom=cutoff, electrostatics=electrostatics, tolerance=tolerance
    )

    def forces() -> Any:
        atoms.calc.reset()
        return atoms.get_forces()

    return forces


def force_difference(forces: Any, reference: Any) -> float:
    """Rms difference of forces in percent of their rms."""
    return 100.0 * float(np.sqrt(np.mean((forces - reference) ** 2) / np.mean(reference**2)))


def _most(request: FluidRequest) -> float:
    """The largest cutoff that the box allows."""
    return 0.5 * float(min(request.box.cell.lengths()))  # type: ignore[union-attr]


STEP = Knob(
    STEPS_FS,
    FINEST_STEP_FS,
    (
        Measure("conserved energy per degree", "K", lambda answer, _: conserved_k(answer)),
        Measure(f"positions after {FOLLOWED_FS:g} fs", "Å", _moved),
    ),
    "a step of {:g} fs",
    key="numerics.step",
    title="length of a step",
    attribute="step_fs",
    change=_with_setting,
    value=lambda request: request.settings.step_fs,
    swept=followed,
    answer=answer_followed,
    tried=_shorter_steps,
    error=_step_error,
    coarsest=(LONGEST_STEP_FS, "longest"),
    text="a step of {:g} fs",
)
FORCE = Measure("force", "%", force_difference)


def _cutoff(electrostatics: str) -> Knob:
    """The cutoff of the forces, with a treatment of the charges."""
    return Knob(
        lambda request: [cutoff for cutoff in CUTOFFS if cutoff < 0.95 * _most(request)],
        lambda request: 0.99 * _most(request),
        (FORCE,),
        f"Ewald's sum to {FINEST_EWALD:g}, Lennard-Jones to {{:.3g}} Å",
        key=f"numerics.cutoff, {electrostatics}",
        title="cutoff of the forces (Å)",
        value=lambda request: request.settings.cutoff_angstrom,
        used=lambda request: request.settings.electrostatics == electrostatics,
        swept=lambda request, cutoff: force_function(request, electrostatics, cutoff, request.settings.ewald_tolerance),
        reference=lambda request: force_function(request, "ewald", 0.99 * _most(request), FINEST_EWALD),
        answer=lambda forces: forces(),
    )


SUM = Knob(
    EWALD,
    FINEST_EWALD,
    (FORCE,),
    "a tolerance of {:g}",
    key="numerics.ewald_tolerance",
    title="tolerance of Ewald's sum",
    attribute="ewald_tolerance",
    change=_with_setting,
    value=lambda request: request.settings.ewald_tolerance,
    used=lambda request: request.settings.electrostatics == "ewald",
    swept=lambda request, tolerance: force_function(request, "ewald", request.settings.cutoff_angstrom, tolerance),
    answer=lambda forces: forces(),
    tried=EWALD_LADDER,
    error=lambda sought, request, tolerance: Estimate(SPARE * force_error(request)),
    stated=True,  # of the forces where the run ends
    text="a tolerance of {:g} of Ewald's sum",
)


def neglected_in_fluid(
    bodies: Bodies, force: Floats, torque: Floats, temperature_k: float, step_fs: float
) -> tuple[LeftOut, ...]:
    """Effects that a box of rigid classical molecules neglects, in percent, largest first; vibration is not estimated.

    force, torque: (n, 3) in space and in body axes, at any time of the run; ASE's units.
    """
    from rotor.fluids.motion.thermometers import step_correction

    kt, count = units.EV_PER_K * temperature_k, len(bodies)
    quantum = step_correction(bodies, force, torque, units.HBAR_CLASSICAL / kt).total_ev / (24 * kt * count)
    degrees = int((bodies.inverse_moments > 0).sum())
    turning = step_correction(bodies, force, torque, step_fs * 1e-3 / units.ASE_TIME_PS).rotation_ev / 12
    neglected = [
        LeftOut("quantum mechanics of nuclei", 100 * quantum, "%", "of kT a molecule, free energy, to order ħ²"),
        LeftOut(
            "finite box", 100 * count ** (-1 / 3), "%", "of the diffusion coefficient, which a periodic box lowers"
        ),
    ]
    if degrees:
        share = turning / (0.5 * degrees * kt)
        neglected.append(LeftOut("finite step", 100 * share, "%", "of the rotational temperature at full steps"))
    return largest_first([*neglected, LeftOut("vibration", None, "", "molecules are rigid")])


def _steps(request: Any) -> int:
    """Steps of a run and of its equilibration."""
    from rotor.fluids.equilibration import equilibration_range

    return int(request.settings.steps) + _steps_before(
        equilibration_range(request.equilibration_ps)[0], request.settings
    )


def _steps_before(picoseconds: float, settings: Any) -> int:
    """Steps of an equilibration."""
    return round(1e3 * picoseconds / float(settings.step_fs))


def _short_run(request: Any, steps: int) -> Any:
    """The first steps of a box, which remains as it is, without its equilibration."""
    return replace(_with_setting(request, "steps", int(steps)), box=request.box.copy(), box_equilibration_ps=0.0)


def _planned_box(request: Any) -> Any:
    """The request with its box."""
    return replace(with_box(request), box_equilibration_ps=request.equilibration_ps)


LENGTH = Knob(
    key="conditions.steps",
    fixed="the error of a mean is in its report",
    cost=Growth(
        SHORT_STEPS,
        _steps,
        _short_run,
        _planned_box,
        largest=lambda request: _short_run(request, min(SETTLING_STEPS, request.settings.steps)),
    ),
)


def describe_fluid(request: Any, cost: Cost) -> dict[str, Any]:
    """What a box does, from a short run."""
    from rotor.fluids.equilibration import equilibration_range

    settings, settled = request.settings, cost.answer
    least_ps, most_ps = equilibration_range(request.equilibration_ps)
    before = _steps_before(least_ps, settings)
    until = (
        "" if most_ps == least_ps else f" at least, until stationary, {most_ps:g} ps at most; seconds count the least"
    )
    return {
        "effects": ("Lennard-Jones and charges of rigid sites", settings.electrostatics),
        "good": ("energy", "momentum") if settings.ensemble == "nve" else (),
        "parts": (
            ("method", f"splitting of rigid bodies, {settings.step_fs:g} fs a step, {settings.ensemble}"),
            ("forces", f"cutoff {settings.cutoff_angstrom:g} Å, {settings.electrostatics}, even liquid beyond it"),
            *([("equilibration", f"{least_ps:g} ps{until}")] if before else []),
        ),
        "counts": {"atoms": len(settled.atoms), "steps": settings.steps}
        | ({"equilibration steps": before} if before else {}),
        "left_out": _left_out(settled.atoms, settings),
    }


def _left_out(atoms: Any, settings: Any) -> tuple[LeftOut, ...]:
    """Neglected effects, from the forces and torques of a box."""
    from rotor.fluids.forces.models import find_models, model_shapes
    from rotor.fluids.motion.dynamics import RigidDynamics

    dynamics = RigidDynamics(atoms, 1.0, removed=0, shapes=model_shapes(find_models(settings.model)))
    return neglected_in_fluid(dynamics.bodies, *dynamics.wrench(), settings.temperature_k, settings.step_fs)


def _force_error_at_end(answer: Any) -> float:
    """The error of the forces at the end of a run, in percent."""
    return force_error(replace(answer.request, box=answer.atoms))


FLUID = Numerics(
    {
        "K": Goal("conserved energy", conserved_k, prepare=with_box),
        "%": Goal("forces", _force_error_at_end, _other_forces, with_box),
    },
    bare=False,
    knobs=(STEP, *map(_cutoff, ELECTROSTATICS), SUM, LENGTH),
    prepare=with_box,
    describe=describe_fluid,
)
