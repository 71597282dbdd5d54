"""Frames of an engine read back: into the table that every run fills, and into a path for the analysis."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotor import units
from rotor.fluid.engines.scene import Frame, Scene, scene_of
from rotor.fluid.record import FluidRecord
from rotor.fluid.settings import Settings
from rotor.fluid.temperature import THERMOMETERS, temperatures
from rotor.rotations import Array

ENGINES = ("openmm", "lammps")


@dataclass(frozen=True)
class EngineRun:
    """What an engine has made of a box: the table, and the real atoms' places (frames, atoms, 3), molecules whole."""

    scene: Scene
    record: FluidRecord
    positions_angstrom: Array


def run_engine(
    name: str, atoms: Any, settings: Settings, *, progress: Callable[[int], None] | None = None, **options: Any
) -> EngineRun:
    """Hand a box to the engine of that name, run it, read it back.

    atoms: an ase.Atoms box. progress: called with every step that is reached. options: of the engine, see
    `rotor.fluid.engines.openmm.frames` and `rotor.fluid.engines.lammps.frames`.

    Raises ValueError for what the engine cannot be handed, ModuleNotFoundError where it is not installed.
    """
    scene = scene_of(atoms, settings)
    seen: list[Frame] = []
    for frame in engine_frames(name, scene, settings, **options):
        seen.append(frame)
        if progress:
            progress(frame.step)
    return EngineRun(scene, record_of(seen, scene, settings), np.stack([frame.positions for frame in seen]))


def engine_frames(name: str, scene: Scene, settings: Settings, **options: Any) -> Iterator[Frame]:
    """The frames of an engine by its name."""
    if name == "openmm":
        from rotor.fluid.engines import openmm

        return openmm.frames(scene, settings, **options)
    if name == "lammps":
        from rotor.fluid.engines import lammps

        return lammps.frames(scene, settings, **options)
    raise ValueError(f"{name!r} is no engine; there are {', '.join(ENGINES)}")


def record_of(frames: Sequence[Frame], scene: Scene, settings: Settings) -> FluidRecord:
    """The table of frames.

    Energies of motion are those of the thermometer without an error of order h² (`rotor.fluid.temperature`): mixed from
    momenta on the step, as they are from momenta between steps, where a thermostat acts. The total has the energy on the
    step.
    """
    h = settings.step_fs / 1000 / units.CLASSICAL_TIME_PS
    energies = [frame.motion.kinetic() for frame in frames]
    measured = [
        kinetic if frame.half else kinetic + frame.motion.correction(h).times(THERMOMETERS["mixed"])
        for frame, kinetic in zip(frames, energies, strict=True)
    ]
    heat = [temperatures(kinetic, scene.degrees) for kinetic in measured]
    total = [f.potential_ev + k.total_ev + f.thermostat_ev for f, k in zip(frames, energies, strict=True)]
    return FluidRecord(
        time_ps=np.array([frame.step for frame in frames]) * settings.step_fs / 1000,
        potential_ev=np.array([frame.potential_ev for frame in frames]),
        translation_ev=np.array([kinetic.translation_ev for kinetic in measured]),
        rotation_ev=np.array([kinetic.rotation_ev for kinetic in measured]),
        total_ev=np.array(total),
        temperature_k=np.array([one.all_k for one in heat]),
        translation_k=np.array([one.translation_k for one in heat]),
        rotation_k=np.array([one.rotation_k for one in heat]),
        pressure_bar=np.array([frame.pressure_bar for frame in frames]),
    )
