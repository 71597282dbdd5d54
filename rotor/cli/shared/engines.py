"""`rotor fluid --engine openmm` and `--engine lammps`: the same box and options, rows and frames read back as they come."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing
from typing import TYPE_CHECKING, Any

from rotor.cli.shared import inputs
from rotor.cli.shared.output import ComputationError

if TYPE_CHECKING:
    from ase import Atoms

    from rotor.fluid.engines.engine_input import Frame, Scene
    from rotor.fluid.record import FluidRecord
    from rotor.fluid.run import Outputs
    from rotor.fluid.settings import Settings

OPTIONS = {"openmm": "threads", "lammps": "cores"}  # what --threads means to each


def check(engine: str, threads: int, outputs: Outputs, resume: bool) -> None:
    """ValueError for an engine that there is not, and for what only our own does."""
    inputs.whole("--threads", threads, 1)
    if engine != "rotor" and engine not in OPTIONS:
        raise ValueError(f"--engine: {engine!r} is no engine; there are rotor, {', '.join(OPTIONS)}")
    if engine != "rotor" and (outputs.checkpoint or resume):
        raise ValueError(f"--engine {engine}: checkpoints are kept by --engine rotor alone")


def run(
    engine: str, atoms: Atoms, settings: Settings, outputs: Outputs, threads: int, provenance: dict[str, Any]
) -> FluidRecord:
    """Run a box by an engine; rows and frames are written as they come."""
    from rotor.fluid.engines.engine_input import scene_of
    from rotor.fluid.engines.results import engine_frames

    frames_every = outputs.frames_every or settings.every
    if outputs.trajectories and frames_every % settings.every:
        raise ValueError(
            f"--frames-every {frames_every}: with --engine {engine} a multiple of --every, {settings.every}"
        )
    scene = scene_of(atoms, settings)
    try:
        frames = engine_frames(engine, scene, settings, **{OPTIONS[engine]: threads})
        return _follow(frames, scene, atoms, settings, outputs, provenance)
    except ModuleNotFoundError as error:
        raise ValueError(str(error)) from error
    except RuntimeError as error:
        raise ComputationError(str(error)) from error


def _follow(
    frames: Iterator[Frame],
    scene: Scene,
    atoms: Atoms,
    settings: Settings,
    outputs: Outputs,
    provenance: dict[str, Any],
) -> FluidRecord:
    """Write every frame that comes, and make the table; files are opened when the engine has given its first frame."""
    import numpy as np

    from rotor.fluid.checkpoint import csv_line
    from rotor.fluid.engines.results import row_of
    from rotor.fluid.record import FluidRecord
    from rotor.fluid.run import ns_per_day, progress_bar

    first = next(frames)
    rows, started = [], time.perf_counter()
    with ExitStack() as stack, progress_bar(settings.steps, None) as shown:
        csv, trajectories = _opened(stack, outputs, provenance)
        for frame in itertools.chain([first], frames):
            rows.append(row_of(frame, scene, settings))
            if csv is not None:
                csv.add(csv_line(rows[-1]))
            if trajectories and frame.step % (outputs.frames_every or settings.every) == 0:
                placed = _placed(frame, scene, atoms)
                for file in trajectories:
                    file.add(placed, rows[-1][0])
            shown(frame.step, settings.steps, ns_per_day(settings, frame.step, time.perf_counter() - started))
    return FluidRecord(*np.array(rows).T)


def _opened(stack: ExitStack, outputs: Outputs, provenance: dict[str, Any]) -> tuple[Any, list[Any]]:
    """The growing files, closed with the stack."""
    from rotor.fluid.checkpoint import TextFile, trajectory_file
    from rotor.fluid.run import COLUMNS
    from rotor.formats.line_tables import write_beside

    trajectories = [stack.enter_context(closing(trajectory_file(path))) for path in outputs.trajectories]
    if outputs.csv is None:
        return None, trajectories
    csv = stack.enter_context(closing(TextFile(outputs.csv)))
    write_beside(outputs.csv, provenance)
    csv.add(",".join(COLUMNS) + "\n")
    return csv, trajectories


def _placed(frame: Frame, scene: Scene, atoms: Atoms) -> Atoms:
    """The box as a frame has it, with the velocities of its rigid motion."""
    from rotor.fluid.engines.engine_input import point_velocities

    masses, owners = scene.site_masses[scene.real], scene.molecule_of_site[scene.real]
    placed: Atoms = atoms.copy()
    placed.set_masses(masses)
    placed.positions = frame.positions
    placed.set_velocities(point_velocities(frame.motion, owners, masses, frame.positions))
    return placed
