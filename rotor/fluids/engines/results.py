"""Conversion of the frames of an engine to the table of a run, and to a path for analysis."""

from __future__ import annotations

import importlib
from collections.abc import Generator, Iterable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from rotor import units
from rotor.arrays import Floats
from rotor.fluids.engines.engine_input import EngineInput, Frame, make_engine_input
from rotor.fluids.motion.thermometers import THERMOMETERS, temperatures
from rotor.fluids.record import FluidRecord
from rotor.fluids.settings import Settings

ENGINES = ("openmm", "lammps")


@dataclass(frozen=True)
class EngineRun:
    """Results of an engine: the table, and positions (frames, atoms, 3) of the real atoms, molecules whole."""

    engine_input: EngineInput
    record: FluidRecord
    positions_angstrom: Floats


def run_engine(name: str, atoms: Any, settings: Settings, **options: Any) -> EngineRun:
    """Run a box with an engine and collect its results.

    Parameters
    ----------
    name : str
        "openmm" or "lammps".
    atoms : ase.Atoms
        The box.
    settings : Settings
        What is run.
    options : object
        Of the engine, see `rotor.fluids.engines.openmm.frames` and `rotor.fluids.engines.lammps.frames`.

    Returns
    -------
    EngineRun
        Input, table and positions in Å.

    Raises
    ------
    ValueError
        If the engine cannot represent the input.
    ModuleNotFoundError
        If it is not installed.
    OSError
        If it does not load.
    RuntimeError
        If it stops during the run.
    """
    engine_input = make_engine_input(atoms, settings)
    seen = list(engine_frames(name, engine_input, settings, **options))
    return EngineRun(
        engine_input, frame_record(seen, engine_input, settings), np.stack([frame.positions for frame in seen])
    )


def engine_frames(name: str, engine_input: EngineInput, settings: Settings, **options: Any) -> Generator[Frame]:
    """The frames of an engine by its name, at step 0 and after every `settings.every` steps; options: as of `run_engine`.

    Raises ValueError for an unknown engine, RuntimeError for energies or positions that are not finite.
    """
    if name not in ENGINES:
        raise ValueError(f"{name!r} is no engine; there are {', '.join(ENGINES)}")
    engine = importlib.import_module(f"rotor.fluids.engines.{name}")
    for frame in engine.frames(engine_input, settings, **options):
        if not (np.isfinite(frame.potential_ev) and np.isfinite(frame.positions).all()):
            raise RuntimeError(
                f"{name}: energy or positions are not finite at step {frame.step}: molecules on top of each other, or a "
                "step too long"
            )
        yield frame


def frame_record(frames: Iterable[Frame], engine_input: EngineInput, settings: Settings) -> FluidRecord:
    """The table of frames."""
    rows = np.array([frame_row(frame, engine_input, settings) for frame in frames], dtype=np.float64)
    return FluidRecord(*rows.reshape(-1, len(fields(FluidRecord))).T)


def frame_row(frame: Frame, engine_input: EngineInput, settings: Settings) -> list[float]:
    """A row of the table.

    Kinetic energies are those of the thermometer without an error of order h² (`rotor.fluids.motion.thermometers`): "mixed" for momenta
    at full steps, unchanged for momenta at half steps, where a thermostat acts. The total contains the energy at full steps.
    """
    stored = frame.motion.kinetic()
    kinetic = stored
    if not frame.half:
        h = settings.step_fs / 1000 / units.ASE_TIME_PS
        kinetic = stored + frame.motion.correction(h).times(THERMOMETERS["mixed"])
    heat = temperatures(kinetic, engine_input.degrees)
    return [
        frame.step * settings.step_fs / 1000,
        frame.potential_ev,
        kinetic.translation_ev,
        kinetic.rotation_ev,
        frame.potential_ev + stored.total_ev + frame.thermostat_ev,
        heat.all_k,
        heat.translation_k,
        heat.rotation_k,
        frame.pressure_bar,
    ]
