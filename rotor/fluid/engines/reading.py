"""Frames of an engine read back: into the table that every run fills, and into a path for the analysis."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotor import units
from rotor.fluid.engines.scene import Frame, Scene, scene_of
from rotor.fluid.record import FluidRecord
from rotor.fluid.settings import Settings
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


def record_of(frames: Iterable[Frame], scene: Scene, settings: Settings) -> FluidRecord:
    """The table of frames.

    Energies of motion are those of the thermometer without the error of order h²: on the step K + h²/12 Σ F²/M, which is
    (2 K_half + K_full)/3; between steps, where a thermostat acts there, K itself.
    """
    h2 = (settings.step_fs / 1000 / units.CLASSICAL_TIME_PS) ** 2
    rows = [_row(frame, h2, settings) for frame in frames]
    time, potential, translation, rotation, total, pressure = np.array(rows, dtype=np.float64).reshape(-1, 6).T
    f_t, f_r = scene.translational_degrees(settings), scene.rotational_degrees

    def kelvin(energy: Array, degrees: int) -> Array:
        return 2 * energy / (degrees * units.EV_PER_K) if degrees else np.full_like(energy, np.nan)

    return FluidRecord(
        time_ps=time,
        potential_ev=potential,
        translation_ev=translation,
        rotation_ev=rotation,
        total_ev=total,
        temperature_k=kelvin(translation + rotation, f_t + f_r),
        translation_k=kelvin(translation, f_t),
        rotation_k=kelvin(rotation, f_r),
        pressure_bar=pressure,
    )


def _row(frame: Frame, h2: float, settings: Settings) -> tuple[float, ...]:
    """Time, potential energy, energies of translation and rotation, total, pressure."""
    full_t, full_r = frame.motion.kinetic()
    kick_t, kick_r = (0.0, 0.0) if frame.half else frame.motion.kicks()
    return (
        frame.step * settings.step_fs / 1000,
        frame.potential_ev,
        full_t + h2 / 6 * kick_t,
        full_r + h2 / 6 * kick_r,
        frame.potential_ev + full_t + full_r + frame.thermostat_ev,
        frame.pressure_bar,
    )
