"""`rotor fluid`: a box of rigid molecules, run, written as it runs, and resumed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from math import isnan
from pathlib import Path
from tempfile import gettempdir
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import json_option
from rotor.cli.shared.options import argument, file_option, grouped, option
from rotor.cli.shared.output import (
    ComputationError,
    Files,
    Table,
    deliver,
    json_with_rows,
    note,
    show_facts,
    show_table,
)
from rotor.cli.shared.plot_options import ViewOptions, view_of
from rotor.cli.shared.save_scene import save_scene, save_scene_option
from rotor.temporary import locked_folder

if TYPE_CHECKING:
    from rotor.arrays import Floats
    from rotor.fluids.request import FluidAnswer, FluidRequest, NewBox
    from rotor.fluids.run import Outputs as RunFiles
    from rotor.fluids.settings import Settings
    from rotor.plots.view import View

EXAMPLES = """\b
Examples:
  rotor fluid water --molecules 216 --ensemble langevin --steps 20000 --trajectory liquid.traj --checkpoint run.npz
  rotor fluid water --molecules 216 --ensemble langevin --steps 40000 --trajectory liquid.traj --checkpoint run.npz --resume
  rotor fluid liquid.traj --ensemble nve --steps 50000 --every 10 --csv nve.csv --json -
  rotor fluid liquid.traj --steps 50000 --engine openmm --threads 2 --csv openmm.csv
  rotor fluid water --molecules 64 --cutoff 6 --ensemble langevin --steps 2000 --plot run.png
  rotor fluid argon --molecules 500 --model argon --density 1.4 --temperature 90 --step 5fs"""

NAMES = {
    "engine": "--engine", "threads": "--threads", "frames_every": "--frames-every", "every": "--every", "model": "--model",
    "molecules": "--molecules", "density_g_cm3": "--density",
}  # fmt: skip  # field of the request -> option


@dataclass(frozen=True)
class Options:
    """The box and the run."""

    source: str = argument(..., help="A box with its cell, or with --molecules 'water' or a model's name.")
    model: str = option("spce", metavar="NAME", help="Rigid model; several joined by commas.")
    molecules: int | None = option(None, metavar="N", help="Make a box of N molecules on a lattice, relaxed.")
    density: str | None = option(None, metavar="D", help="Of the box that is made (g/cm³; by default 0.997).")
    equilibration: str = option(
        "auto", metavar="T", help="Thermostat before the run of a box that is made: auto until stationary, 0 none (ps)."
    )
    ensemble: str = option("nve", metavar="NAME", help="nve, langevin or nose-hoover.")
    temperature: str = option("298.15", metavar="T", help="Of thermostat and starting velocities (K).")
    step: str = option("2", metavar="T", help="Length of a step (fs).")
    steps: int = option(1000, metavar="N", help="How many steps.")
    every: int = option(10, metavar="N", help="Steps between rows.")
    cutoff: str = option("9", metavar="R", help="Of Lennard-Jones and charges (Å).")
    electrostatics: str = option("reaction-field", metavar="NAME", help="reaction-field, ewald or shifted.")
    ewald_tolerance: str = option("1e-5", metavar="X", help="Of forces by ewald, relative to e²/4πε0 Å².")
    friction: str = option("1", metavar="F", help="Of langevin (1/ps).")
    relaxation: str = option("100", metavar="T", help="Time constant of nose-hoover (fs).")
    seed: int = option(1, metavar="N", help="Of the lattice, the velocities and the noise.")
    threads: int = option(1, metavar="N", help="Threads of the built-in potential, or of the engine.")
    engine: str = option("rotor", metavar="NAME", help="Which engine runs it: rotor, openmm or lammps.")


@dataclass(frozen=True)
class Outputs:
    """Files that grow during the run, and the one written at its end."""

    csv: str | None = file_option(".csv", help="Write rows as they come (.csv).")
    trajectory: list[str] | None = option(
        None, metavar="FILE", help="Write frames as they come (.traj, .xyz, .extxyz); repeatable."
    )
    frames_every: int | None = option(None, metavar="N", help="Steps between frames; by default as --every.")
    checkpoint: str | None = file_option(".npz", help="Write what the run needs to continue (.npz).")
    checkpoint_every: int = option(1000, metavar="N", help="Steps between checkpoints.")
    resume: bool = option(False, "--resume", help="Continue from --checkpoint.")
    plot: str | None = file_option(
        ".png", ".pdf", ".svg", help="Draw temperatures, energy and g(r) (.png, .pdf, .svg)."
    )
    json: str | None = json_option()
    save_scene: str | None = save_scene_option()


@grouped(picture=("plot_scale",))
def command(context: typer.Context, options: Options, outputs: Outputs, picture: ViewOptions) -> None:
    """Rigid molecules in a periodic box: a run, its temperatures, energies and pressure."""
    settings = _settings(options)
    growing, files = _files(options.source, outputs)
    view = view_of(picture, files, "ps")
    with inputs.fields_as_options(**NAMES), frames_for(growing, files) as (growing, frames):
        request = _request(options, settings)
        answer, start = _answer(request, growing, outputs, {"command": context.obj, "input": options.source})
        paths = _paths(answer, frames) if "--plot" in files.paths else None
    for remark in answer.notes:
        note(remark)
    grown = [growing.csv, *(outputs.trajectory or ()), growing.checkpoint, *files.paths.values()]
    content = start | answer.facts() | {"files": [str(path) for path in grown if path is not None]}
    text = lambda: json_with_rows(answer.record, "record", content)  # noqa: E731
    writers = {"--plot": lambda path: _draw(answer, paths, path, str(context.obj), view)}
    writers |= save_scene("fluid", request, outputs)
    deliver(files, writers, text, lambda: _show(content, settings))


@contextmanager
def frames_for(growing: RunFiles, files: Files) -> Iterator[tuple[RunFiles, str | None]]:
    """The files of a run and the one its frames are read from: where a picture asks for some, and none is written, a temporary.

    A run that can be resumed has no temporary file: its checkpoint would name it. Its last frame alone is drawn.
    """
    if "--plot" not in files.paths or growing.trajectories or growing.checkpoint is not None:
        yield growing, str(growing.trajectories[0]) if growing.trajectories else None
        return
    with locked_folder(Path(gettempdir()), "rotor-frames-") as folder:
        path = str(folder / "frames.traj")
        yield replace(growing, trajectories=(path,)), path


def _paths(answer: FluidAnswer, frames: str | None) -> Floats:
    """Centres of mass (frames, n, 3) in the second half of a run, or those at its end."""
    import numpy as np
    from ase.io import read

    from rotor.fluids.forces.models import models_of, shapes_of
    from rotor.fluids.initial_box import model_labels
    from rotor.fluids.motion.bodies import bodies_of

    models = models_of(answer.request.settings.model)
    shapes = shapes_of(models)
    taken = read(frames, ":") if frames is not None else [answer.atoms]
    for atoms in taken:
        if "molecule" not in atoms.arrays:
            atoms.arrays["molecule"] = model_labels(atoms, models)
    return np.array([bodies_of(atoms, shapes=shapes)[1].centres for atoms in taken[len(taken) // 2 :]])


def _draw(answer: FluidAnswer, paths: Floats | None, path: Path, command: str, view: View) -> None:
    from rotor.fluids.analysis import pair_distribution
    from rotor.plots.fluid import plot_fluid

    assert paths is not None
    atoms, settings = answer.atoms, answer.request.settings
    edges = atoms.cell.lengths()
    shells = None
    if atoms.pbc.all() and atoms.cell.orthorhombic and paths.shape[1] > 1:
        shells = pair_distribution(paths, edges, float(edges.min()) / 2, 120)
    title = f"{paths.shape[1]} molecules, {settings.model}, {settings.ensemble}, by {answer.request.engine}"
    if shells is not None:
        title += f"; g(r) of {len(paths)} frame{'s' if len(paths) > 1 else ''}"
    plot_fluid(answer.record, shells, paths.shape[1], path, title=title, view=view, provenance={"command": command})


def _settings(options: Options) -> Settings:
    from rotor.fluids.forces.models import model_of
    from rotor.fluids.settings import Settings

    for name in options.model.split(","):
        inputs.parsed("--model", name.strip(), model_of)
    return Settings(
        model=options.model, ensemble=options.ensemble, steps=options.steps, every=options.every, seed=options.seed,
        temperature_k=inputs.positive("--temperature", options.temperature, "K"),
        step_fs=inputs.positive("--step", options.step, "fs"),
        cutoff_angstrom=inputs.positive("--cutoff", options.cutoff, "angstrom"), electrostatics=options.electrostatics,
        ewald_tolerance=inputs.positive("--ewald-tolerance", options.ewald_tolerance, ""),
        friction_per_ps=inputs.positive("--friction", options.friction, ""),
        relaxation_fs=inputs.positive("--relaxation", options.relaxation, "fs"),
    )  # fmt: skip


def _files(source: str, outputs: Outputs) -> tuple[RunFiles, Files]:
    """The files that grow, each with a suffix that can be written, and the one written at the end."""
    from rotor.fluids.run import Outputs as RunFiles

    growing, last = Files(), Files()
    growing.ask("--csv", outputs.csv, (".csv",))
    for number, path in enumerate(outputs.trajectory or []):
        growing.ask(f"--trajectory{' ' * number}", path, (".traj", ".xyz", ".extxyz"))
    growing.ask("--checkpoint", outputs.checkpoint, (".npz",))
    last.ask("--plot", outputs.plot, (".png", ".pdf", ".svg"))
    last.ask_json(outputs.json)
    last.ask("--save-scene", outputs.save_scene, (".toml",))
    for name, target in (growing.paths | last.paths).items():
        if target.resolve() == Path(source).resolve():
            raise ValueError(f"{name.strip()} {target}: is the box that is read; write to another file")
    files = RunFiles(
        outputs.csv, tuple(outputs.trajectory or ()), outputs.frames_every, outputs.checkpoint, outputs.checkpoint_every
    )
    return files, last


def _request(options: Options, settings: Settings) -> FluidRequest:
    """The request: the box of a file, or one to make."""
    from rotor.fluids.request import FluidRequest

    if options.molecules is not None:
        box = _new_box(options, settings)
        return FluidRequest(box, settings, options.engine, options.threads)
    if options.density is not None:
        raise ValueError("--density: expected with --molecules; the box of a file has the density of its cell")
    from rotor.formats.boxes import read_box

    if not Path(options.source).is_file():
        raise ValueError(f"{options.source}: no such file; with --molecules N a box is made of 'water' or of a model")
    return FluidRequest(read_box(options.source), settings, options.engine, options.threads, options.source)


def _new_box(options: Options, settings: Settings) -> NewBox:
    from rotor.fluids.forces.models import MODELS, model_of
    from rotor.fluids.request import WATER_G_CM3, NewBox

    source = options.source
    if source != settings.model and source in MODELS:
        raise ValueError(f"{source!r}: the model is {settings.model}; write --model {source} too")
    if "," in settings.model or source not in ("water", settings.model):
        raise ValueError(
            f"{source!r}: a box is made of one model: write {settings.model.split(',')[0]!r} (or 'water') with its --model"
        )
    model = model_of(settings.model)
    if source == "water" and model.symbols != ("O", "H", "H"):
        raise ValueError(f"{source!r}: --model {model.name} is no model of water; write {model.name!r}")
    grams = WATER_G_CM3 if options.density is None else inputs.positive("--density", options.density, "")
    return NewBox(options.molecules or 0, grams, _equilibration(options.equilibration))


def _equilibration(text: str) -> float | None:
    """Picoseconds; None for auto."""
    if text == "auto":
        return None
    value = inputs.quantity("--equilibration", text, "ps")
    return value if value == 0 else inputs.positive("--equilibration", text, "ps")


def _answer(
    request: FluidRequest, growing: RunFiles, outputs: Outputs, said: dict[str, Any]
) -> tuple[FluidAnswer, dict[str, Any]]:
    """The run and the keys that begin its JSON; a run that stops on its way is no mistake of the user."""
    import rotor
    from rotor.fluids.request import answer_fluid
    from rotor.fluids.run import RunStopped

    head = {"rotor_version": rotor.__version__, **said, "engine": request.engine, "settings": asdict(request.settings)}

    def on_start() -> None:
        """What is written before the run begins."""
        from rotor.formats.provenance import write_beside

        if growing.csv is not None and not outputs.resume:
            write_beside(growing.csv, {**head, "start": request.start})

    try:
        return answer_fluid(request, growing, resume=outputs.resume, on_start=on_start), head
    except RunStopped as error:
        raise ComputationError(str(error)) from error
    except KeyboardInterrupt:
        if growing.checkpoint is not None and Path(growing.checkpoint).is_file():
            note(f"interrupted; the same command with --resume goes on from {growing.checkpoint}")
        raise


def _claim(content: dict[str, Any], settings: Settings) -> str:
    """What is known of the thermometer's error; under LAMMPS' noise nothing."""
    return "" if content["engine"] == "lammps" and settings.ensemble != "nve" else ": no error of order h²"


def _hill(symbols: str) -> str:
    """A formula in Hill's order: OH2 is H2O."""
    from ase.formula import Formula

    return str(Formula(symbols).format("hill"))


def _show(content: dict[str, Any], settings: Settings) -> None:
    kinds = ", ".join(f"{kind['count']} {_hill(kind['name'])}" for kind in content["molecules"])
    degrees = content["degrees"]
    print(f"{kinds}: {settings.steps} steps of {settings.step_fs:g} fs, {settings.ensemble}, by {content['engine']}")
    rms, drift = content["conserved_rms_ev"], content["conserved_drift_ev_per_ns"]
    facts = [
        ("model", f"{settings.model}, cutoff {settings.cutoff_angstrom:g} Å, {settings.electrostatics}"),
        ("start", content["start"]),
        (
            "degrees",
            f"{degrees['translation']} of translation, {degrees['rotation']} of rotation; {degrees['removed']} removed",
        ),
        ("thermometer", content["thermometer"] + _claim(content, settings)),
        ("conserved", "not known from one row alone" if isnan(rms) else f"rms {rms:.3g} eV, drift {drift:.3g} eV/ns"),
    ]
    if content["density_g_cm3"] is not None:
        edges = " x ".join(f"{edge:.6g}" for edge in content["box_angstrom"])
        facts.insert(1, ("box", f"{edges} Å, {content['density_g_cm3']:.5g} g/cm³"))
    if content["motion_reason"]:
        facts.append(("no motion", content["motion_reason"]))
    show_facts(facts)
    rows = [
        [
            mean["quantity"],
            mean["unit"],
            f"{mean['mean']:.6g}",
            *("-" if isnan(x) else f"{x:.{n}g}" for x, n in ((mean["error"], 2), (mean["effective_samples"], 3))),
        ]
        for mean in content["means"]
    ]
    print()
    columns = ["quantity", "unit", "mean", "error", "samples"]
    rows_meant = "all rows, after the equilibration" if content["averaged_share"] == 1 else "second half of the rows"
    show_table(Table(rows_meant, columns, rows, frozenset({"quantity", "unit"})))
