"""Request and answer for a run of a fluid: a box that is read or made, an engine, and the table of the run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.checks import require_positive, require_whole
from rotor.fluids.engines.results import ENGINES
from rotor.fluids.equilibration import Equilibration, equilibrate
from rotor.fluids.forces.models import find_model, find_models, model_shapes
from rotor.fluids.initial_box import RELAXING_STEPS, lattice_box, relax
from rotor.fluids.liquid_motion import MotionFrames, motion_means, reference_axes
from rotor.fluids.record import FluidRecord
from rotor.fluids.run import Outputs, Progress, bodies_and_degrees, make_calculator, progress_bar, run_fluid
from rotor.fluids.settings import Settings
from rotor.fluids.summary import Mean, conserved, means
from rotor.requests.budget import ErrorBudget
from rotor.requests.field import check_fields, declared, identical, part
from rotor.requests.readers import Text, Whole
from rotor.table import TextOf
from rotor.units import ATOMIC_MASS_KG

if TYPE_CHECKING:
    from ase import Atoms

    from rotor.fluids.motion.bodies import Bodies
    from rotor.statistics.degrees_of_freedom import Degrees

WATER_G_CM3 = 0.997
DEFAULT = Settings()


@dataclass(frozen=True)
class NewBox:
    """A box to make: molecules of a model on a lattice at a density, randomly oriented, relaxed and equilibrated.

    equilibration_ps: time with thermostat before the run; None: until the box is stationary, 0: none.
    """

    molecules: int
    density_g_cm3: float = WATER_G_CM3
    equilibration_ps: float | None = None

    def __post_init__(self) -> None:
        require_whole("molecules", self.molecules, 1)
        require_positive("density_g_cm3", self.density_g_cm3, "g/cm³")
        if self.equilibration_ps:
            require_positive("equilibration_ps", self.equilibration_ps, "ps")


@dataclass(frozen=True, eq=False)
class FluidRequest:
    """A run of rigid molecules in a box; all fields are checked when the request is made.

    settings: model, ensemble and length of the run. box: an ase.Atoms with its cell, or a `NewBox` to make. engine: rotor,
    openmm or lammps. threads: of the built-in potential or of the engine. box_source: origin of a box that was read.
    box_equilibration_ps: for a box that was read, as `NewBox.equilibration_ps`; default: none.
    """

    box: Atoms | NewBox
    settings: Settings = part(Settings, identical, identical, DEFAULT)
    engine: str = declared(
        "rotor",
        Text(("rotor", *ENGINES), "NAME"),
        "Engine of the run: rotor, openmm or lammps",
        "numerics.engine",
        common=True,
    )
    threads: int = declared(1, Whole(1), "Threads of the built-in potential, or of the engine", "numerics.threads")
    box_source: str = "given"
    box_equilibration_ps: float | None = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        if self.box_equilibration_ps:
            require_positive("box_equilibration_ps", self.box_equilibration_ps, "ps")
        models = find_models(self.settings.model)
        if isinstance(self.box, NewBox) and len(models) > 1:
            raise ValueError(
                f"model {self.settings.model!r}: a new box has a single model; for a mixture give the file of a box"
            )

    @property
    def equilibration_ps(self) -> float | None:
        """Time with thermostat before the run; None: until the box is stationary, 0: none."""
        return self.box.equilibration_ps if isinstance(self.box, NewBox) else self.box_equilibration_ps

    @property
    def start(self) -> str:
        """The origin of the box in words."""
        if not isinstance(self.box, NewBox):
            return self.box_source
        return (
            f"{self.box.molecules} molecules on a lattice at {self.box.density_g_cm3:g} g/cm³, turned at random, "
            f"{RELAXING_STEPS} quenched steps of 1 fs"
        )


@dataclass(frozen=True, eq=False, repr=False)
class FluidAnswer(TextOf):
    """A run: the table, the final atoms, and the start.

    equilibration: of a box that was made. motion: reorientation and diffusion of the run; motion_reason: why parts are missing.
    centres: of mass (frames, n, 3) in Å over the second half of the run or at its end, for its picture.
    """

    shown = "record"

    request: FluidRequest
    record: FluidRecord
    atoms: Atoms
    start: str
    equilibration: Equilibration | None = None
    motion: tuple[Mean, ...] = ()
    motion_reason: str = ""
    centres: Any = None

    @property
    def averaged_share(self) -> float:
        """Share of the last rows that means are taken over: all after an equilibration, otherwise half."""
        return 0.5 if self.equilibration is None else 1.0

    @cached_property
    def _count(self) -> tuple[Bodies, Degrees, str]:
        return bodies_and_degrees(self.atoms, self.request.settings)

    @property
    def thermometer(self) -> str:
        """The momenta (thermometer) from which the temperature is computed."""
        return "mixed" if self.request.engine == "lammps" else self._count[2]

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the count of degrees of freedom, and on means of a box that was not equilibrated."""
        return (*self._count[1].notes, *self._start_notes)

    @property
    def _start_notes(self) -> tuple[str, ...]:
        moves = self.request.settings.steps > 0 and not isinstance(self.request.box, NewBox)
        if not moves or self.equilibration is not None or "velocities drawn" not in self.start:
            return ()
        return (
            "the box of a file without velocities is not equilibrated: its temperatures drift before means are taken; an equilibration "
            "(--equilibration auto) brings it to its temperature first",
        )

    @property
    def density_g_cm3(self) -> float | None:
        """Mass over volume; None for a non-periodic cell."""
        bodies, atoms = self._count[0], self.atoms
        if not atoms.pbc.all():
            return None
        return float(bodies.mass.sum()) * ATOMIC_MASS_KG * 1e27 / float(atoms.get_volume())

    @cached_property
    def _means(self) -> list[Mean]:
        return means(self.record, len(self._count[0]), self.averaged_share)

    @cached_property
    def errors(self) -> ErrorBudget:
        """Error budget of the mean temperature."""
        from rotor.fluids.budgets import temperature_budget

        bodies, degrees, _ = self._count
        return temperature_budget(self.record, self.request.settings, degrees.total, len(bodies), self._means)

    def facts(self) -> dict[str, Any]:
        """Facts of the answer except its table, by the keys of docs/verbs."""
        bodies, degrees, _ = self._count
        rms, drift, drift_error = conserved(self.record)
        return {
            "engine": self.request.engine,
            "settings": asdict(self.request.settings),
            "start": self.start,
            "box_angstrom": self.atoms.cell.lengths() if self.atoms.pbc.all() else None,
            "density_g_cm3": self.density_g_cm3,
            "molecules": _species(bodies),
            "degrees": {name: getattr(degrees, name) for name in ("translation", "rotation", "removed", "total")},
            "thermometer": self.thermometer,
            "equilibration_ps": None if self.equilibration is None else self.equilibration.time_ps,
            "stationary": None if self.equilibration is None else self.equilibration.stationary,
            "averaged_share": self.averaged_share,
            "means": [asdict(mean) for mean in (*self._means, *self.motion)],
            "motion_reason": self.motion_reason or None,
            "conserved_rms_ev": rms,
            "conserved_drift_ev_per_ns": drift,
            "conserved_drift_error_ev_per_ns": drift_error,
            "notes": list(self.notes),
            "errors": self.errors.as_json(),
        }


def answer_fluid(
    request: FluidRequest,
    outputs: Outputs | None = None,
    *,
    resume: bool = False,
    progress: Progress | None = None,
    on_start: Callable[[], None] = lambda: None,
) -> FluidAnswer:
    """The run of a request.

    Parameters
    ----------
    request : FluidRequest
    outputs : Outputs, optional
        Files that grow during the run.
    resume : bool
        Continue from `outputs.checkpoint`; only with the engine rotor.
    progress : callable, optional
        Called with step, steps and ns per day from time to time, in turn for the quench of a new box (at 0 ns per day), the
        equilibration and the run; without it a bar is shown on a terminal.
    on_start : callable
        Called after all checks.

    Returns
    -------
    FluidAnswer

    Raises
    ------
    ValueError
        An unsuitable box, outputs or engine, see `rotor.fluids.run.run_fluid`.
    RunStopped
        A ValueError too: a run that stopped on its way.
    """
    outputs = outputs or Outputs()
    built_in = request.engine == "rotor"
    if not built_in and (outputs.checkpoint or resume):
        raise ValueError(f"engine {request.engine}: checkpoints are written by the engine rotor alone")
    with progress_bar(progress, "overlaps of the new box: {task.completed} of {task.total} steps", "") as shown:
        atoms = make_box(request, relaxed=not resume, progress=shown)
    settings = request.settings
    speeds = "those of the box" if atoms.get_momenta().any() else f"drawn at {settings.temperature_k:g} K"
    start = f"resumed from {outputs.checkpoint}" if resume else f"{request.start}; velocities {speeds}"
    equilibration = None
    if not resume and request.equilibration_ps != 0:
        atoms = atoms if isinstance(request.box, NewBox) else _with_calculator(atoms, settings, request.threads)
        if not built_in:
            from rotor.fluids.engines.follow import check_engine

            check_engine(request.engine, atoms, settings, outputs, request.threads)
        most = "at most " if request.equilibration_ps is None else ""
        with progress_bar(progress, f"equilibration: {{task.completed}} of {most}{{task.total}} steps") as shown:
            equilibration = equilibrate(atoms, settings, request.equilibration_ps, shown)
        start += f"; {equilibration.text}"
    if not built_in:
        from rotor.fluids.engines.follow import follow_engine

        record = follow_engine(request.engine, atoms, settings, outputs, request.threads, on_start)
        return FluidAnswer(request, record, atoms, start, equilibration)
    if atoms.calc is None:
        atoms.calc = make_calculator(settings, request.threads)
    frames = MotionFrames()
    record = run_fluid(atoms, settings, outputs, resume=resume, progress=progress, on_start=on_start, frames=frames)
    motion, reason = _motion(atoms, settings, frames)
    return FluidAnswer(request, record, atoms, start, equilibration, tuple(motion), reason)


def _motion(atoms: Atoms, settings: Settings, frames: MotionFrames) -> tuple[list[Mean], str]:
    """Reorientation and diffusion of a run."""
    bodies, _, _ = bodies_and_degrees(atoms, settings)
    interval_ps = settings.every * settings.step_fs * 1e-3
    return motion_means(frames, interval_ps, reference_axes(bodies, find_models(settings.model)))


def make_box(request: FluidRequest, relaxed: bool = True, progress: Progress = lambda *_: None) -> Atoms:
    """The box of a request; a `NewBox` is made.

    relaxed: False: without the quench, as for a resumed run. progress: of the quench.
    """
    if not isinstance(request.box, NewBox):
        return request.box
    model, settings = find_model(request.settings.model), request.settings
    rng = np.random.default_rng(settings.seed)
    atoms = lattice_box(model, request.box.molecules, request.box.density_g_cm3, rng)
    atoms.calc = make_calculator(settings, request.threads)
    if relaxed:
        relax(atoms, progress=progress, shapes=model_shapes([model]))
    return atoms


def _with_calculator(atoms: Atoms, settings: Settings, threads: int) -> Atoms:
    """A copy of a box that was read (equilibration moves it), with the built-in potential if it has no calculator."""
    copied: Atoms = atoms.copy()
    copied.calc = atoms.calc or make_calculator(settings, threads)
    return copied


def _species(bodies: Bodies) -> list[dict[str, Any]]:
    """One record for each species."""
    records = []
    for number, name in enumerate(bodies.names):
        members = (bodies.species == number).nonzero()[0]
        moments = bodies.moments[members[0]]
        records.append(
            {
                "name": name,
                "count": len(members),
                "mass_u": float(bodies.mass[members[0]]),
                "moments_u_angstrom2": moments.tolist(),
                "rotational_degrees": int((moments > 0.0).sum()),
            }
        )
    return records
