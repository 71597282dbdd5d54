"""Scenes of a fluid of rigid molecules in a box."""

from __future__ import annotations

from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING

from rotor.fluids.record import FluidRecord
from rotor.fluids.request import FluidAnswer, FluidRequest, NewBox, answer_fluid
from rotor.fluids.run import Outputs
from rotor.fluids.settings import Settings
from rotor.scenes import kind
from rotor.scenes.kind import Kind, Where
from rotor.scenes.molecule import named
from rotor.scenes.scene import FluidScene, within
from rotor.scenes.sections import FluidConditions, FluidNumerics, FluidOutputs, MoleculeSection

if TYPE_CHECKING:
    from ase import Atoms

_NAMES = {
    "molecules": "conditions.molecules", "density_g_cm3": "conditions.density", "threads": "numerics.threads",
    "engine": "numerics.engine", "temperature_k": "conditions.temperature", "step_fs": "numerics.step", "steps": "conditions.steps",
    "every": "conditions.every", "cutoff_angstrom": "numerics.cutoff", "ewald_tolerance": "numerics.ewald_tolerance",
    "friction_per_ps": "conditions.friction", "relaxation_fs": "conditions.relaxation", "seed": "numerics.seed",
}  # fmt: skip


def request(scene: FluidScene, folder: Where = ".") -> FluidRequest:
    """The request of a scene."""
    of, how = scene.conditions, scene.numerics
    with kind.fields(**_NAMES):
        settings = Settings(
            model=of.model,
            ensemble=of.ensemble,
            temperature_k=kind.quantity("conditions.temperature", of.temperature, "K"),
            step_fs=kind.quantity("numerics.step", how.step, "fs"),
            steps=of.steps,
            every=of.every,
            cutoff_angstrom=kind.quantity("numerics.cutoff", how.cutoff, "Å"),
            electrostatics=how.electrostatics,
            ewald_tolerance=how.ewald_tolerance,
            friction_per_ps=of.friction,
            relaxation_fs=kind.quantity("conditions.relaxation", of.relaxation, "fs"),
            seed=how.seed,
        )
        box = _box(of, folder)
        source = "given" if of.box is None else str(of.box)
        return FluidRequest(box, settings, how.engine, how.threads, source)


def _box(of: FluidConditions, folder: Where) -> NewBox | Atoms:
    if (of.molecules is None) == (of.box is None):
        raise ValueError("conditions: give either molecules, to make a box of, or a box")
    if of.molecules is not None:
        time = None if of.equilibration == "auto" else kind.quantity("conditions.equilibration", of.equilibration, "ps")
        return NewBox(of.molecules, of.density, time)
    from rotor.formats.boxes import read_box

    path = within(folder, str(of.box))
    if not Path(path).is_file():
        raise ValueError(f"conditions.box: {path}: no such file")
    return named("conditions.box", lambda: read_box(path))


def answer(asked: FluidRequest, scene: FluidScene, out: Where, executor: Executor | None) -> FluidAnswer:
    """The run; it goes on from its checkpoint where there is one.

    Parameters
    ----------
    asked : FluidRequest
        The scene as the library takes it, checked.
    scene : FluidScene
        Names the files of the run.
    out : path
        Folder from which the files of the run are counted.
    executor : Executor or None
        Not used.

    Returns
    -------
    FluidAnswer
        The table of the run.
    """
    files = outputs_in(scene.outputs, out)
    resume = files.checkpoint is not None and Path(files.checkpoint).is_file()
    return answer_fluid(asked, files, resume=resume, progress=lambda *_: None)


def outputs_in(files: FluidOutputs, out: Where) -> Outputs:
    """The growing files of a scene in a folder."""
    csv, checkpoint = (None if name is None else within(out, name) for name in (files.csv, files.checkpoint))
    trajectories = tuple(within(out, name) for name in files.trajectories)
    return Outputs(csv, trajectories, files.frames_every, checkpoint, files.checkpoint_every)


def table(found: FluidAnswer) -> FluidRecord:
    """The rows of the run."""
    return found.record


def saved(asked: FluidRequest, molecule: MoleculeSection | None) -> FluidScene:
    """The scene of a request."""
    run, made = asked.settings, asked.box if isinstance(asked.box, NewBox) else None
    return FluidScene(
        conditions=FluidConditions(
            model=run.model,
            molecules=None if made is None else made.molecules,
            density=NewBox(1).density_g_cm3 if made is None else made.density_g_cm3,
            equilibration="auto" if made is None or made.equilibration_ps is None else f"{made.equilibration_ps!r} ps",
            box=None if made is not None else asked.box_source,
            ensemble=run.ensemble,
            temperature=f"{run.temperature_k!r} K",
            friction=run.friction_per_ps,
            relaxation=f"{run.relaxation_fs!r} fs",
            steps=run.steps,
            every=run.every,
        ),
        numerics=FluidNumerics(
            step=f"{run.step_fs!r} fs",
            cutoff=f"{run.cutoff_angstrom!r} Å",
            electrostatics=run.electrostatics,
            ewald_tolerance=run.ewald_tolerance,
            seed=run.seed,
            threads=asked.threads,
            engine=asked.engine,
        ),
    )


KIND = Kind(request, answer, table, saved, grows=frozenset({"csv", "trajectories", "checkpoint"}), names=_NAMES)
