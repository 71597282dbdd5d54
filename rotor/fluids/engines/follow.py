"""A run by OpenMM or LAMMPS: rows and frames are written as they arrive."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack, closing, contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.checks import RunStopped
from rotor.fluids.checkpoint import csv_line
from rotor.fluids.engines.engine_input import EngineInput, Frame, make_engine_input, point_velocities
from rotor.fluids.engines.results import engine_frames, frame_row
from rotor.fluids.record import FluidRecord
from rotor.fluids.run import Outputs, ns_per_day, open_outputs, progress_bar
from rotor.fluids.settings import Settings

if TYPE_CHECKING:
    from ase import Atoms

THREAD_OPTIONS = {"openmm": "threads", "lammps": "cores"}  # name of the number of threads in each engine


def follow_engine(
    engine: str,
    atoms: Atoms,
    settings: Settings,
    outputs: Outputs,
    threads: int = 1,
    on_start: Callable[[], None] = lambda: None,
) -> FluidRecord:
    """Run a box with an engine, and write rows and frames as they arrive.

    Parameters
    ----------
    engine : "openmm" or "lammps"
    atoms : ase.Atoms
        The box; its momenta are used if there are any.
    settings, outputs : Settings, Outputs
        What is run and which files grow; no checkpoints.
    threads : int
        Threads of OpenMM's CPU platform, MPI processes of LAMMPS.
    on_start : callable
        Called when the engine has given its first frame, before any file is opened.

    Returns
    -------
    FluidRecord
        One row every `settings.every` steps.

    Raises
    ------
    ValueError
        If the engine cannot run this input, is not installed, or does not load.
    RunStopped
        If it stops before the end.
    """
    engine_input, frames = _start_frames(engine, atoms, settings, outputs, threads)
    with _engine_errors():
        return _follow(frames, engine_input, atoms, settings, outputs, on_start)


def check_engine(engine: str, atoms: Atoms, settings: Settings, outputs: Outputs, threads: int = 1) -> None:
    """Start an engine with a box and stop after the first frame, to refuse unsuitable input before any long work.

    Raises the same errors as `follow_engine`.
    """
    _, frames = _start_frames(engine, atoms, settings, outputs, threads)
    with _engine_errors(), closing(frames):
        next(frames)


def _start_frames(
    engine: str, atoms: Atoms, settings: Settings, outputs: Outputs, threads: int
) -> tuple[EngineInput, Generator[Frame]]:
    """The input of the engine, and its frames; the engine starts when the first frame is requested."""
    frames_every = outputs.frames_every or settings.every
    if outputs.trajectories and frames_every % settings.every:
        raise ValueError(
            f"frames_every {frames_every}: with {engine} expected a multiple of the {settings.every} steps between rows"
        )
    engine_input = make_engine_input(atoms, settings)
    options: dict[str, Any] = {THREAD_OPTIONS[engine]: threads, "accuracy": settings.ewald_tolerance}
    with _engine_errors():
        return engine_input, engine_frames(engine, engine_input, settings, **options)


@contextmanager
def _engine_errors() -> Iterator[None]:
    """Convert errors of an engine: ValueError if it is not installed, `RunStopped` if it stops during the run."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise ValueError(str(error)) from error
    except RuntimeError as error:
        raise RunStopped(str(error)) from error


def _follow(
    frames: Iterator[Frame],
    engine_input: EngineInput,
    atoms: Atoms,
    settings: Settings,
    outputs: Outputs,
    on_start: Callable[[], None],
) -> FluidRecord:
    """Write the frames and make the table; files are opened after the first frame."""
    first = next(frames)
    rows, started = [], time.perf_counter()
    with ExitStack() as stack, progress_bar() as shown:
        on_start()
        csv, trajectories = open_outputs(stack, outputs, {})
        for frame in itertools.chain([first], frames):
            rows.append(frame_row(frame, engine_input, settings))
            if csv is not None:
                csv.add(csv_line(rows[-1]))
            if trajectories and frame.step % (outputs.frames_every or settings.every) == 0:
                placed = _placed(frame, engine_input, atoms)
                for file in trajectories:
                    file.add_frame(placed, rows[-1][0])
            shown(frame.step, settings.steps, ns_per_day(settings, frame.step, time.perf_counter() - started))
    return FluidRecord(*np.array(rows).T)


def _placed(frame: Frame, engine_input: EngineInput, atoms: Atoms) -> Atoms:
    """The box at a frame, with the velocities of its rigid motion."""
    masses, owners = engine_input.site_masses[engine_input.real], engine_input.site_molecule[engine_input.real]
    placed: Atoms = atoms.copy()
    placed.set_masses(masses)
    placed.positions = frame.positions
    placed.set_velocities(point_velocities(frame.motion, owners, masses, frame.positions))
    return placed
