"""Long runs of a fluid with growing files, checkpoints, and exact restarts.

After each checkpoint the calculator discards its state (neighbour lists, last result), as after a restart. The further motion then
depends only on the checkpoint: a run that was killed and resumed gives bit for bit the results of an uninterrupted one, on the same machine
with the same settings and checkpoint interval. A run that ends between two checkpoints writes none at its end, because a longer run would
not discard the state there; when it is continued, the steps since the last checkpoint are repeated.
"""

from __future__ import annotations

import hashlib
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.checks import RunStopped
from rotor.fluids.checkpoint import (
    AseTrajectory,
    Checkpoint,
    ExtendedXyz,
    TextFile,
    csv_line,
    read_checkpoint,
    read_rows,
    trajectory_file,
)
from rotor.fluids.forces.models import find_models, model_shapes
from rotor.fluids.initial_box import at_rest, check_apart, heat, model_labels
from rotor.fluids.motion.state import State
from rotor.fluids.record import FluidRecord
from rotor.fluids.settings import Settings
from rotor.units import EV_PER_ANGSTROM3_BAR

if TYPE_CHECKING:
    from ase import Atoms

    from rotor.fluids.liquid_motion import MotionFrames
    from rotor.fluids.motion.bodies import Bodies
    from rotor.fluids.motion.dynamics import RigidDynamics
    from rotor.fluids.motion.thermostats import Thermostat
    from rotor.statistics.degrees_of_freedom import Degrees

COLUMNS = tuple(field.name for field in fields(FluidRecord))
MAY_CHANGE = ("steps",)  # settings that may differ in a resumed run
BAR_INTERVAL_S = 0.2

Progress = Callable[[int, int, float], None]
SPEED = ", {task.fields[speed]:.3g} ns/day"  # text of a progress bar


@dataclass(frozen=True)
class Outputs:
    """Files of a run; those that are None or empty are not written.

    csv: growing table. trajectories: frames, .traj, .xyz or .extxyz. frames_every: steps between frames; default: as between rows.
    checkpoint: file to resume from. checkpoint_every: steps between checkpoints.
    """

    csv: str | os.PathLike[str] | None = None
    trajectories: Sequence[str | os.PathLike[str]] = ()
    frames_every: int | None = None
    checkpoint: str | os.PathLike[str] | None = None
    checkpoint_every: int = 1000

    def __post_init__(self) -> None:
        for name in ("frames_every", "checkpoint_every"):
            value = getattr(self, name)
            if value is not None and value < 1:
                raise ValueError(f"{name} = {value}: expected at least 1")


def run_fluid(
    atoms: Atoms,
    settings: Settings,
    outputs: Outputs | None = None,
    *,
    resume: bool = False,
    progress: Progress | None = None,
    on_start: Callable[[], None] = lambda: None,
    frames: MotionFrames | None = None,
) -> FluidRecord:
    """Run a box of rigid molecules and return its table; the atoms end where the run does.

    Parameters
    ----------
    atoms : ase.Atoms
        Consecutive molecules with atoms in the order of their models. A calculator of the atoms replaces the potential of the model.
        Momenta of the atoms are used (without their total, if that is conserved), or drawn at `settings.temperature_k`.
    settings : Settings
        Model, ensemble, temperature and steps.
    outputs : Outputs, optional
        Files that grow, and checkpoints; none by default.
    resume : bool
        Continue from `outputs.checkpoint`; the growing files are truncated to their lengths at that time.
    progress : callable, optional
        Called with step, steps and ns per day from time to time; without it a bar is shown on a terminal.
    on_start : callable, optional
        Called after all checks, with open files.
    frames : MotionFrames, optional
        Collects centres and attitudes at each row.

    Returns
    -------
    FluidRecord
        One row every `settings.every` steps.

    Raises
    ------
    ValueError
        Molecules that deviate from their model or overlap; a checkpoint of another box or other settings.
    RunStopped
        A ValueError too: a force that is not finite, a full disk; with the step and the last checkpoint.
    """
    outputs = outputs or Outputs()
    if resume and outputs.checkpoint is None:
        raise ValueError("to resume a run, name the checkpoint that it wrote")
    if not resume and outputs.checkpoint is not None and os.path.exists(outputs.checkpoint):
        raise ValueError(f"{outputs.checkpoint}: exists already; resume from it, or remove it to start again")
    dynamics = make_dynamics(atoms, settings, begin=not resume)
    run = _Run(dynamics, settings, outputs, frames)
    if resume:
        assert outputs.checkpoint is not None
        run.restore_from(outputs.checkpoint)
    dynamics.wrench()  # an invalid initial state is refused before any file is opened
    with run.files(), progress_bar(progress) as shown:
        on_start()
        run.go(shown)
    return run.record()


def make_dynamics(atoms: Atoms, settings: Settings, begin: bool = True) -> RigidDynamics:
    """The dynamics for the settings: model, thermostat and, for a new run, thermal momenta."""
    from ase.units import fs

    from rotor.fluids.motion.bodies import rigid_bodies
    from rotor.fluids.motion.dynamics import RigidDynamics

    models = find_models(settings.model)
    if "molecule" not in atoms.arrays:
        atoms.arrays["molecule"] = model_labels(atoms, models)
    shapes = model_shapes(models)
    bodies, pose = rigid_bodies(atoms, shapes=shapes)
    if atoms.calc is None:
        atoms.calc = make_calculator(settings)
    velocities, noise = np.random.default_rng(settings.seed).spawn(2)
    thermostat = make_thermostat(settings, noise)
    if begin:
        check_apart(atoms, bodies)
        if not atoms.get_momenta().any():
            heat(atoms, bodies, pose.attitude, settings.temperature_k, velocities)
        elif thermostat is None or thermostat.conserves_momentum:
            momentum, angular = bodies.wrench(atoms.get_momenta(), pose.attitude)
            atoms.set_momenta(bodies.momenta(at_rest(bodies, momentum), angular, pose.attitude))
    else:
        atoms.set_momenta(np.zeros((len(atoms), 3)))
    return RigidDynamics(atoms, settings.step_fs * fs, thermostat=thermostat, shapes=shapes)


def bodies_and_degrees(atoms: Atoms, settings: Settings) -> tuple[Bodies, Degrees, str]:
    """Bodies of a box, the degrees of freedom that a run counts, and the thermometer that it uses."""
    from rotor.fluids.motion.bodies import rigid_bodies

    bodies, _ = rigid_bodies(atoms, shapes=model_shapes(find_models(settings.model)))
    return bodies, bodies.degrees(settings.removed_degrees), "mixed" if settings.ensemble == "nve" else "half"


def make_thermostat(settings: Settings, rng: np.random.Generator) -> Thermostat | None:
    """The thermostat of an ensemble; None for nve."""
    from ase.units import fs

    from rotor.fluids.motion.thermostats import Langevin, NoseHoover

    if settings.ensemble == "langevin":
        return Langevin(settings.temperature_k, settings.friction_per_ps / (1000.0 * fs), rng)
    if settings.ensemble == "nose-hoover":
        return NoseHoover(settings.temperature_k, settings.relaxation_fs * fs)
    return None


def make_calculator(settings: Settings, threads: int = 1) -> Any:
    """The built-in potential of settings, as an ASE calculator."""
    from rotor.fluids.forces.potential import RigidPotential

    return RigidPotential(
        settings.model,
        cutoff_angstrom=settings.cutoff_angstrom,
        electrostatics=settings.electrostatics,
        tolerance=settings.ewald_tolerance,
        threads=threads,
    )


def pressure_bar(dynamics: RigidDynamics) -> float:
    """Pressure from centres of mass, (2 K_trans + Σ R·F)/3V; nan if the calculator gives no stress.

    The stress of the built-in potential is molecular. For other calculators, the atomic Σ r·f contains the intramolecular part Σ s·f,
    which the constraint forces cancel; it is subtracted (M. P. Allen and D. J. Tildesley, Computer Simulation of Liquids,
    section 2.4).
    """
    from rotor.fluids.forces.potential import RigidPotential

    atoms, bodies = dynamics.atoms, dynamics.bodies
    if "stress" not in getattr(atoms.calc, "implemented_properties", ()) or not atoms.pbc.all():
        return float("nan")
    virial = -float(np.trace(atoms.get_stress(voigt=False, apply_constraint=False))) * float(atoms.get_volume())
    if not isinstance(atoms.calc, RigidPotential):
        centres = np.empty((len(atoms), 3))
        centres[bodies.order] = np.repeat(dynamics.state.centres, np.diff(bodies.starts), axis=0)
        virial -= float(np.sum((atoms.positions - centres) * atoms.get_forces(apply_constraint=False)))
    kinetic = 2.0 * dynamics.kinetic().translation_ev
    return EV_PER_ANGSTROM3_BAR * (virial + kinetic) / (3.0 * float(atoms.get_volume()))


class _Run:
    """The state of a run: rows, files, and its last checkpoint."""

    def __init__(
        self, dynamics: RigidDynamics, settings: Settings, outputs: Outputs, motion: MotionFrames | None = None
    ) -> None:
        self.dynamics, self.settings, self.outputs, self._motion = dynamics, settings, outputs, motion
        self.rows: list[list[float]] = []
        self._csv: TextFile | None = None
        self._frames: list[ExtendedXyz | AseTrajectory] = []
        self._lengths: dict[str, int] = {}
        self._saved_at: int | None = None

    @contextmanager
    def files(self) -> Iterator[None]:
        """Open the growing files, new or at the lengths of the checkpoint."""
        with ExitStack() as stack:
            self._csv, self._frames = open_outputs(stack, self.outputs, self._lengths)
            yield

    def go(self, progress: Progress) -> None:
        """Run the remaining steps."""
        dynamics, steps = self.dynamics, self.settings.steps
        first, started, shown = dynamics.nsteps, time.perf_counter(), 0.0
        try:
            if self._saved_at is None:
                self._write()
                self._save()
            while dynamics.nsteps < steps:
                dynamics.step()
                dynamics.nsteps += 1
                self._write()
                if dynamics.nsteps % self.outputs.checkpoint_every == 0:
                    self._save()
                now = time.perf_counter() - started
                if now - shown > BAR_INTERVAL_S or dynamics.nsteps == steps:
                    shown = now
                    progress(dynamics.nsteps, steps, ns_per_day(self.settings, dynamics.nsteps - first, now))
        except (ValueError, FloatingPointError) as error:
            where = f"step {dynamics.nsteps + 1} of {steps}, {self.settings.step_fs:g} fs each"
            raise RunStopped(f"{error} ({where}){self._named_checkpoint()}") from error
        except OSError as error:
            what = f"{error.filename}: {error.strerror}" if error.filename else error.strerror
            raise RunStopped(
                f"{what} at step {dynamics.nsteps}; files written before are complete{self._named_checkpoint()}"
            ) from error

    def record(self) -> FluidRecord:
        """All rows as a table."""
        columns = np.array(self.rows, dtype=np.float64).reshape(-1, len(COLUMNS)).T
        return FluidRecord(*columns)

    def restore_from(self, path: str | os.PathLike[str]) -> None:
        """Restore the state from a checkpoint file; ValueError if it is invalid, or of another box or run."""
        try:
            self.restore(read_checkpoint(path))
        except (KeyError, TypeError, AttributeError) as error:  # keys or arrays of a checkpoint are missing
            raise ValueError(f"{path}: is no checkpoint of rotor fluid; name the file of --checkpoint") from error

    def restore(self, checkpoint: Checkpoint) -> None:
        """Restore state, thermostat, rows and lengths of files; ValueError for another box or run."""
        about, arrays, path = checkpoint.about, checkpoint.arrays, self.outputs.checkpoint
        if about["box"] != self._box():
            raise ValueError(f"{path}: was written for another box (other atoms, masses, shapes or cell)")
        mine = asdict(self.settings)
        for name, value in about["settings"].items():
            if name not in MAY_CHANGE and mine.get(name) != value:
                raise ValueError(f"{path}: was written by a run with {name} = {value}, not {mine.get(name)}")
        if list(about["files"]) != self._names():
            before = ", ".join(about["files"]) or "none"
            raise ValueError(f"{path}: the resumed run wrote other files: {before}; name the same files")
        if about["step"] > self.settings.steps:
            raise ValueError(
                f"{path}: belongs to step {about['step']}, after the {self.settings.steps} steps of this run"
            )
        state = State(*(np.array(arrays[name]) for name in ("centres", "momentum", "spin", "carry")))
        if self.dynamics.thermostat is not None:
            self.dynamics.thermostat.restore(about["thermostat"])
        self.dynamics.restore(state, about["step"])
        self._lengths = dict(about["files"])
        self._saved_at = about["step"]
        csv = self.outputs.csv
        self.rows = arrays["rows"].tolist() if csv is None else read_rows(csv, about["files"]["csv"])

    def _write(self) -> None:
        """Write a row and frames if they are due."""
        dynamics, steps_per_row = self.dynamics, self.settings.every
        time_ps = dynamics.nsteps * self.settings.step_fs * 1e-3
        if dynamics.nsteps % steps_per_row == 0:
            self.rows.append(self._row(time_ps))
            if self._csv is not None:
                self._csv.add(csv_line(self.rows[-1]))
            if self._motion is not None:
                self._motion.add(dynamics.state.centres, dynamics.state.attitude)
        if dynamics.nsteps % (self.outputs.frames_every or steps_per_row) == 0:
            for file in self._frames:
                file.add_frame(dynamics.atoms, time_ps)

    def _row(self, time_ps: float) -> list[float]:
        dynamics = self.dynamics
        kinetic, heat = dynamics.kinetic(), dynamics.temperatures()
        return [
            time_ps,
            float(dynamics.atoms.get_potential_energy()),
            kinetic.translation_ev,
            kinetic.rotation_ev,
            dynamics.conserved_energy(),
            heat.all_k,
            heat.translation_k,
            heat.rotation_k,
            pressure_bar(dynamics),
        ]

    def _save(self) -> None:
        """Write a checkpoint and reset the calculator."""
        path, dynamics = self.outputs.checkpoint, self.dynamics
        if path is None:
            return
        state, thermostat = dynamics.state, dynamics.thermostat
        files = [*([] if self._csv is None else [self._csv]), *self._frames]
        arrays = {"centres": state.centres, "momentum": state.momentum, "spin": state.spin, "carry": state.carry}
        if self._csv is None:
            arrays["rows"] = np.array(self.rows).reshape(-1, len(COLUMNS))
        about = {
            "box": self._box(),
            "settings": asdict(self.settings),
            "step": dynamics.nsteps,
            "thermostat": None if thermostat is None else thermostat.state_dict(),
            "files": {name: file.sync() for name, file in zip(self._names(), files, strict=True)},
        }
        Checkpoint(arrays, about).write(path)
        self._saved_at = dynamics.nsteps
        dynamics.refresh()

    def _names(self) -> list[str]:
        """Names of the growing files of this run."""
        return [*(["csv"] if self.outputs.csv is not None else []), *map(str, self.outputs.trajectories)]

    def _box(self) -> str:
        """A fingerprint of the constant properties of the box."""
        bodies, atoms = self.dynamics.bodies, self.dynamics.atoms
        parts = (atoms.numbers, bodies.order, bodies.starts, bodies.masses, bodies.sites, atoms.cell.array, atoms.pbc)
        return hashlib.sha256(b"".join(np.ascontiguousarray(part).tobytes() for part in parts)).hexdigest()

    def _named_checkpoint(self) -> str:
        if self._saved_at is None or self.outputs.checkpoint is None:
            return ""
        return f"; {self.outputs.checkpoint} is of step {self._saved_at}, resume from it"


def open_outputs(
    stack: ExitStack, outputs: Outputs, lengths: Mapping[str, int]
) -> tuple[TextFile | None, list[ExtendedXyz | AseTrajectory]]:
    """The growing table and trajectories, closed with the stack; new, or continued at the lengths of a checkpoint."""
    trajectories = [
        stack.enter_context(closing(trajectory_file(path, lengths.get(str(path))))) for path in outputs.trajectories
    ]
    if outputs.csv is None:
        return None, trajectories
    csv = stack.enter_context(closing(TextFile(outputs.csv, lengths.get("csv"))))
    if "csv" not in lengths:
        csv.add(",".join(COLUMNS) + "\n")
    return csv, trajectories


def ns_per_day(settings: Settings, steps: int, seconds: float) -> float:
    """Simulated time per day of computing, ns."""
    return steps * settings.step_fs * 1e-6 * 86400.0 / seconds if seconds > 0.0 else 0.0


@contextmanager
def progress_bar(
    progress: Progress | None = None, steps: str = "{task.completed} of {task.total} steps", speed: str = SPEED
) -> Iterator[Progress]:
    """The receiver of progress: the caller's function, a bar on a terminal, or none. steps, speed: text of the bar."""
    if progress is not None or not sys.stderr.isatty():
        yield progress or (lambda step, steps, speed: None)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    text = TextColumn(steps + speed)
    with Progress(BarColumn(), text, TimeRemainingColumn(), console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", visible=False, speed=0.0)
        yield lambda step, steps, speed: bar.update(task, completed=step, total=steps, speed=speed, visible=True)
