"""`rotor fluid`: a box of rigid molecules, run, kept and resumed."""

from __future__ import annotations

from dataclasses import asdict
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import typer

from rotor.cli.shared import engines, inputs
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

if TYPE_CHECKING:
    from ase import Atoms

    from rotor.fluid.motion.bodies import Bodies
    from rotor.fluid.record import FluidRecord
    from rotor.fluid.run import Outputs
    from rotor.fluid.settings import Settings

EXAMPLES = """\b
Examples:
  rotor fluid water --molecules 216 --ensemble langevin --steps 20000 --trajectory liquid.traj --checkpoint run.npz
  rotor fluid water --molecules 216 --ensemble langevin --steps 40000 --trajectory liquid.traj --checkpoint run.npz --resume
  rotor fluid liquid.traj --ensemble nve --steps 50000 --every 10 --csv nve.csv --json -
  rotor fluid liquid.traj --steps 50000 --engine openmm --threads 2 --csv openmm.csv
  rotor fluid argon --molecules 500 --model argon --density 1.4 --temperature 90 --step 5fs"""

TRAJECTORY = typer.Option(None, metavar="FILE", help="Write frames as they come (.traj, .xyz, .extxyz); repeatable.")


def command(
    context: typer.Context,
    source: str = typer.Argument(..., help="A box with its cell, or with --molecules 'water' or a model's name."),
    model: str = typer.Option("spce", metavar="NAME", help="Rigid model; several joined by commas."),
    molecules: int | None = typer.Option(None, metavar="N", help="Make a box of N molecules on a lattice, relaxed."),
    density: str | None = typer.Option(None, metavar="D", help="Of the box that is made (g/cm³; by default 0.997)."),
    ensemble: str = typer.Option("nve", metavar="NAME", help="nve, langevin or nose-hoover."),
    temperature: str = typer.Option("298.15", metavar="T", help="Of thermostat and starting velocities (K)."),
    step: str = typer.Option("2", metavar="T", help="Length of a step (fs)."),
    steps: int = typer.Option(1000, metavar="N", help="How many steps."),
    every: int = typer.Option(10, metavar="N", help="Steps between rows."),
    cutoff: str = typer.Option("9", metavar="R", help="Of Lennard-Jones and charges (Å)."),
    electrostatics: str = typer.Option("reaction-field", metavar="NAME", help="reaction-field, ewald or shifted."),
    friction: str = typer.Option("1", metavar="F", help="Of langevin (1/ps)."),
    relaxation: str = typer.Option("100", metavar="T", help="Time constant of nose-hoover (fs)."),
    seed: int = typer.Option(1, metavar="N", help="Of the lattice, the velocities and the noise."),
    threads: int = typer.Option(1, metavar="N", help="Threads of the built-in potential, or of the engine."),
    csv: str | None = typer.Option(None, metavar="FILE", help="Write rows as they come (.csv)."),
    trajectory: list[str] | None = TRAJECTORY,
    frames_every: int | None = typer.Option(None, metavar="N", help="Steps between frames; by default as --every."),
    checkpoint: str | None = typer.Option(None, metavar="FILE", help="Write what the run needs to continue (.npz)."),
    checkpoint_every: int = typer.Option(1000, metavar="N", help="Steps between checkpoints."),
    resume: bool = typer.Option(False, "--resume", help="Continue from --checkpoint."),
    engine: str = typer.Option("rotor", metavar="NAME", help="Who runs it: rotor, openmm or lammps."),
    json: str | None = inputs.JSON,
) -> None:
    """Rigid molecules that attract and repel: a run of a periodic box, its temperatures, energies and pressure."""
    from rotor.fluid.settings import Settings

    settings = Settings(
        model=_model(model), ensemble=ensemble, temperature_k=inputs.positive("--temperature", temperature, "K"),
        step_fs=inputs.positive("--step", step, "fs"), steps=steps, every=every,
        cutoff_angstrom=inputs.positive("--cutoff", cutoff, "angstrom"), electrostatics=electrostatics,
        friction_per_ps=inputs.positive("--friction", friction, ""),
        relaxation_fs=inputs.positive("--relaxation", relaxation, "fs"), seed=seed,
    )  # fmt: skip
    outputs, files = _outputs(source, csv, trajectory or [], frames_every, checkpoint, checkpoint_every, json)
    engines.check(engine, threads, outputs, resume)
    atoms, start = _box(source, settings, molecules, density, threads, relaxing=not resume)
    provenance = {
        "command": context.obj,
        "input": source,
        "engine": engine,
        "settings": asdict(settings),
        "start": start,
    }
    if engine == "rotor":
        record, about = _run(atoms, settings, outputs, resume, threads, provenance)
    else:
        about = {"start": f"{start}; velocities {_speeds(atoms, settings)}"}
        record = engines.run(engine, atoms, settings, outputs, threads, _head(provenance))
    _tell(record, {**_head(provenance), **about}, atoms, settings, outputs, files)


def _model(names: str) -> str:
    from rotor.fluid.forces.models import model_of

    for name in names.split(","):
        inputs.option("--model", name.strip(), model_of)
    return names


def _outputs(
    source: str,
    csv: str | None,
    trajectories: list[str],
    frames_every: int | None,
    checkpoint: str | None,
    every: int,
    json: str | None,
) -> tuple[Outputs, Files]:
    """The files that grow, each with a suffix that can be written, and the one written at the end."""
    from rotor.fluid.run import Outputs

    growing, last = Files(), Files()
    growing.ask("--csv", csv, (".csv",))
    for number, path in enumerate(trajectories):
        growing.ask(f"--trajectory{' ' * number}", path, (".traj", ".xyz", ".extxyz"))
    growing.ask("--checkpoint", checkpoint, (".npz",))
    last.ask_json(json)
    for name, target in (growing.wanted | last.wanted).items():
        if target.resolve() == Path(source).resolve():
            raise ValueError(f"{name.strip()} {target}: is the box that is read; write to another file")
    return Outputs(csv, tuple(trajectories), frames_every, checkpoint, every), last


def _box(
    source: str, settings: Settings, molecules: int | None, density: str | None, threads: int, relaxing: bool
) -> tuple[Atoms, str]:
    """The box of a file, or one that is made; and where it came from."""
    if molecules is None:
        if density is not None:
            raise ValueError("--density: is wanted with --molecules; the box of a file has the density of its cell")
        return _read(source), source
    import numpy as np

    from rotor.fluid.forces.models import MODELS, model_of, shapes_of
    from rotor.fluid.initial_box import RELAXING_STEPS, lattice_box, relax
    from rotor.fluid.run import calculator_of

    inputs.whole("--molecules", molecules, 1)
    if source != settings.model and source in MODELS:
        raise ValueError(f"{source!r}: the model is {settings.model}; write --model {source} too")
    if "," in settings.model or source not in ("water", settings.model):
        raise ValueError(
            f"{source!r}: a box is made of one model: write {settings.model.split(',')[0]!r} (or 'water') with its --model"
        )
    model = model_of(settings.model)
    if source == "water" and model.symbols != ("O", "H", "H"):
        raise ValueError(f"{source!r}: --model {model.name} is no model of water; write {model.name!r}")
    grams = inputs.positive("--density", density or "0.997", "")
    atoms = lattice_box(model, molecules, grams, np.random.default_rng(settings.seed))
    atoms.calc = calculator_of(settings, threads)
    if relaxing:
        relax(atoms, shapes=shapes_of([model]))
    made = f"{molecules} molecules on a lattice at {grams:g} g/cm³, turned at random, {RELAXING_STEPS} quenched steps of 1 fs"
    return atoms, made


def _read(source: str) -> Atoms:
    """The last frame of a file."""
    from ase.io import read
    from ase.io.formats import UnknownFileTypeError

    if not Path(source).is_file():
        raise ValueError(f"{source}: no such file; with --molecules N a box is made of 'water' or of a model")
    try:
        atoms: Any = read(source)
    except (UnknownFileTypeError, OSError, ValueError, KeyError, IndexError, AssertionError) as error:
        raise ValueError(
            f"{source}: cannot be read as a box of atoms ({str(error) or type(error).__name__})"
        ) from error
    atoms.calc = None
    if not atoms.pbc.any():
        raise ValueError(f"{source}: has no cell that repeats; a box has one (in extended xyz, Lattice and pbc)")
    return cast("Atoms", atoms)


def _run(
    atoms: Atoms, settings: Settings, outputs: Outputs, resume: bool, threads: int, provenance: dict[str, Any]
) -> tuple[FluidRecord, dict[str, Any]]:
    """The run of our own engine: what stops it on its way is no mistake of the user."""
    from rotor.fluid.run import RunStopped, calculator_of, run_fluid

    if atoms.calc is None:
        atoms.calc = calculator_of(settings, threads)
    speeds = _speeds(atoms, settings)

    def on_start() -> None:
        from rotor.formats.line_tables import write_beside

        if outputs.csv is not None and not resume:
            write_beside(outputs.csv, _head(provenance))

    try:
        record = run_fluid(atoms, settings, outputs, resume=resume, on_start=on_start)
    except RunStopped as error:
        raise ComputationError(str(error)) from error
    except KeyboardInterrupt:
        if outputs.checkpoint is not None and Path(outputs.checkpoint).is_file():
            note(f"interrupted; the same command with --resume goes on from {outputs.checkpoint}")
        raise
    start = f"resumed from {outputs.checkpoint}" if resume else f"{provenance['start']}; velocities {speeds}"
    return record, {"start": start}


def _speeds(atoms: Atoms, settings: Settings) -> str:
    """Where the velocities of the start come from."""
    return "those of the box" if atoms.get_momenta().any() else f"drawn at {settings.temperature_k:g} K"


def _head(provenance: dict[str, Any]) -> dict[str, Any]:
    import rotor

    return {"rotor_version": rotor.__version__, **provenance}


def _tell(
    record: FluidRecord, content: dict[str, Any], atoms: Atoms, settings: Settings, outputs: Outputs, files: Files
) -> None:
    """Everything printed: as JSON, or as a report."""
    from rotor.fluid.run import bodies_and_degrees
    from rotor.fluid.summary import conserved, means

    bodies, degrees, thermometer = bodies_and_degrees(atoms, settings)
    if content["engine"] == "lammps":
        thermometer = "mixed"  # its momenta are those on the step under its thermostat too
    rms, drift = conserved(record)
    grown = [outputs.csv, *outputs.trajectories, outputs.checkpoint, *files.wanted.values()]
    content |= {
        "box_angstrom": atoms.cell.lengths() if atoms.pbc.all() else None,
        "density_g_cm3": _density(atoms, bodies),
        "molecules": _species(bodies),
        "degrees": {name: getattr(degrees, name) for name in ("translation", "rotation", "removed", "total")},
        "thermometer": thermometer,
        "means": [asdict(mean) for mean in means(record, len(bodies))],
        "conserved_rms_ev": rms,
        "conserved_drift_ev_per_ns": drift,
        "notes": list(degrees.notes),
        "files": [str(path) for path in grown if path is not None],
    }
    for text in degrees.notes:
        note(text)
    deliver(files, {}, lambda: json_with_rows(record, "record", content), lambda: _show(content, settings))


def _density(atoms: Atoms, bodies: Bodies) -> float | None:
    from rotor.units import ATOMIC_MASS_KG

    return float(bodies.mass.sum()) * ATOMIC_MASS_KG * 1e27 / float(atoms.get_volume()) if atoms.pbc.all() else None


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


def _claim(content: dict[str, Any], settings: Settings) -> str:
    """What is known of the thermometer's error; under LAMMPS' noise nothing."""
    return "" if content["engine"] == "lammps" and settings.ensemble != "nve" else ": no error of order h²"


def _show(content: dict[str, Any], settings: Settings) -> None:
    kinds = ", ".join(f"{kind['count']} {kind['name']}" for kind in content["molecules"])
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
        ("conserved", "one row alone tells nothing" if isnan(rms) else f"rms {rms:.3g} eV, drift {drift:.3g} eV/ns"),
    ]
    if content["density_g_cm3"] is not None:
        edges = " x ".join(f"{edge:.6g}" for edge in content["box_angstrom"])
        facts.insert(1, ("box", f"{edges} Å, {content['density_g_cm3']:.5g} g/cm³"))
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
    show_table(Table("second half of the rows", columns, rows, frozenset({"quantity", "unit"})))
