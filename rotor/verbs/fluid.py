"""`fluid`: run a box of rigid molecules, with files that grow during the run, and resume it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, replace
from math import isnan
from pathlib import Path
from tempfile import gettempdir
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.checks import NoAnswerError, RunStopped, leaving
from rotor.fluids.forces.models import MODELS, find_model, find_models, model_shapes
from rotor.fluids.initial_box import model_labels
from rotor.fluids.motion.bodies import rigid_bodies
from rotor.fluids.request import WATER_G_CM3, FluidAnswer, FluidRequest, NewBox, answer_fluid
from rotor.fluids.run import Outputs
from rotor.fluids.settings import Settings
from rotor.frozen import dataclass
from rotor.reports.screen import Part, record_table
from rotor.reports.top_facts import error_facts
from rotor.requests.field import MOLECULE, OUTPUT, all_fields, declared
from rotor.requests.fill import Entries, NamedError, read_fields, read_instance, written_fields
from rotor.requests.readers import Flag, Quantity, Text, Whole
from rotor.temporary import locked_folder
from rotor.verbs.common.outputs import Output, Report, picture
from rotor.verbs.common.subjects import beside
from rotor.verbs.common.verb import Place, Shown, Subject, SubjectKind, Verb, Work, facts_named

if TYPE_CHECKING:
    from rotor.arrays import Floats

FRAMES = (".traj", ".xyz", ".extxyz")

EXAMPLES = """\
  rotor fluid water --molecules 216 --ensemble langevin --steps 20000 --trajectory liquid.traj --checkpoint run.npz
  rotor fluid water --molecules 216 --ensemble langevin --steps 40000 --trajectory liquid.traj --checkpoint run.npz --resume
  rotor fluid liquid.traj --ensemble nve --steps 50000 --every 10 --csv nve.csv --json -
  rotor fluid liquid.traj --steps 50000 --engine openmm --threads 2 --csv openmm.csv
  rotor fluid water --molecules 64 --cutoff 6 --ensemble langevin --steps 2000 --plot run.png
  rotor fluid water --molecules 64 --cutoff 6 --steps 30000  # 60 ps: rotational correlation times and diffusion
  rotor fluid argon --molecules 500 --model argon --density 1.4 --temperature 90 --step 5fs"""


@dataclass(frozen=True)
class BoxInput:
    """A box that is made on a lattice, or read from a file."""

    source: str | None = declared(
        None,
        Text(),
        "File of a box with its cell; with --molecules, 'water' or a model's name",
        option="SOURCE",
        panel=MOLECULE,
    )
    molecules: int | None = declared(
        None,
        Whole(1),
        "Make a box of N molecules on a lattice, relaxed",
        "conditions.molecules",
        common=True,
        example=216,
    )
    density: float | None = declared(
        None, Quantity("g/cm3", above=0, metavar="D"), "Density of the new box (g/cm³; by default 0.997)", "conditions.density",
        common=True, example=0.997,
    )  # fmt: skip
    equilibration: float | None = declared(
        None, Quantity("ps", least=0, metavar="T"), "Equilibration before the run (ps), 0 for none; auto: until stationary",
        "conditions.equilibration", none="auto", example="20 ps",
    )  # fmt: skip
    box: str | None = declared(
        None,
        Text(),
        "File of a box, relative to the scene's folder, instead of molecules",
        "conditions.box",
        option="",
        example="liquid.traj",
    )


class Box(SubjectKind):
    """A box of rigid molecules, made or read."""

    fields = all_fields(BoxInput)

    def read(self, entries: Entries, place: Place, verb: Verb) -> Subject:
        """The box and its origin."""
        inputs: BoxInput = read_instance(BoxInput, entries)
        settings = Settings(**read_fields(Settings, entries))
        self._refuse_unused(inputs, settings, entries)
        in_scene = entries.style == "key"
        file = inputs.box if in_scene else inputs.source
        if in_scene and (inputs.molecules is None) == (file is None):
            raise ValueError("conditions: give either molecules, to make a box of, or a box")
        if not in_scene and file is None:
            raise ValueError("SOURCE is missing; --help shows what the command takes")
        if inputs.molecules is not None:
            if not in_scene:
                _refuse_other_model(str(inputs.source), settings)
            density = WATER_G_CM3 if inputs.density is None else inputs.density
            box = NewBox(inputs.molecules, density, inputs.equilibration)
            return Subject({"box": box, "box_source": "given"}, (), inputs.source or "", place.note)
        path = str(Path(place.folder) / str(file))
        if not Path(path).is_file() and not in_scene:
            raise ValueError(f"{file}: no such file; for a new box of 'water' or of a model give --molecules N")
        from rotor.formats.boxes import read_box

        try:
            values: dict[str, Any] = {"box": read_box(path), "box_source": file}
        except ValueError as error:
            raise ValueError(f"conditions.box: {error}" if in_scene else str(error)) from None
        if entries.has(self.fields["conditions.equilibration"]):  # none unless it is requested
            values["box_equilibration_ps"] = inputs.equilibration
        return Subject(values, (), path if in_scene else str(file), place.note)

    def _refuse_unused(self, inputs: BoxInput, settings: Settings, entries: Entries) -> None:
        """Refuse inputs without effect: of another ensemble, other electrostatics, or a new box."""
        uses = {
            "conditions.friction": ("ensemble", "langevin"),
            "conditions.relaxation": ("ensemble", "nose-hoover"),
            "numerics.ewald_tolerance": ("electrostatics", "ewald"),
        }
        for name, (choice, needed) in uses.items():
            chosen = getattr(settings, choice)
            if entries.values.get(name) is not None and chosen != needed:
                raise NamedError(f"{{{name}}}: expected with {{{choice}}} {needed}; {chosen} does not use it")
        if inputs.molecules is None and inputs.density is not None:
            raise NamedError("{density}: expected with {molecules}; the box of a file has the density of its cell")

    def saved(self, request: FluidRequest, subject: Subject, folder: Path) -> dict[str, Any]:
        """The inputs of a new box, or its file."""
        if isinstance(request.box, NewBox):
            inputs = BoxInput(None, request.box.molecules, request.box.density_g_cm3, request.box.equilibration_ps)
            return written_fields(inputs)
        files = {"conditions.box": beside(request.box_source, folder)}
        if request.box_equilibration_ps == 0:
            return files
        return files | written_fields(BoxInput(equilibration=request.box_equilibration_ps))


def _refuse_other_model(source: str, settings: Settings) -> None:
    """Refuse a new box of another molecule than that of the model."""
    if source != settings.model and source in MODELS:
        raise ValueError(f"{source!r}: the model is {settings.model}; write --model {source} too")
    if "," in settings.model or source not in ("water", settings.model):
        raise ValueError(
            f"{source!r}: a new box contains 'water' or a single model; models are {', '.join(sorted(MODELS))}, "
            "named twice, as in 'rotor fluid argon --model argon --molecules 500'"
        )
    model = find_model(settings.model)
    if source == "water" and model.symbols != ("O", "H", "H"):
        raise ValueError(f"{source!r}: --model {model.name} is not a model of water; write {model.name!r}")


@dataclass(frozen=True)
class FluidShown(Shown):
    """Intervals of the growing files, and whether a run resumes."""

    frames_every: int | None = declared(
        None, Whole(1), "Steps between frames; by default those between rows", "outputs.frames_every", example=100
    )
    checkpoint_every: int = declared(1000, Whole(1), "Steps between checkpoints", "outputs.checkpoint_every")
    resume: bool = declared(False, Flag(), "Continue from the checkpoint", panel=OUTPUT)


def answer(request: FluidRequest, work: Work) -> FluidAnswer:
    """The run; a scene resumes from its checkpoint if that exists.

    A run that stops early is not a mistake of the user: NoAnswerError.
    """
    paths = {name: [str(path) for path in work.files.get(name, ())] for name in ("csv", "trajectories", "checkpoint")}
    csv, checkpoint = (next(iter(paths[name]), None) for name in ("csv", "checkpoint"))
    shown, from_scene = work.shown, work.from_scene
    outputs = Outputs(csv, tuple(paths["trajectories"]), shown.frames_every, checkpoint, shown.checkpoint_every)
    resume = shown.resume or (from_scene and checkpoint is not None and Path(checkpoint).is_file())
    head = {**work.provenance, **_settings(request)}

    def on_start() -> None:
        from rotor.formats.provenance import write_beside

        if csv is not None and not resume:
            write_beside(csv, {**head, "start": request.start})

    goes_on = f"holds the run so far; {'the same command' if from_scene else '--resume'} continues"
    unfinished = [(path, goes_on) for path in paths["checkpoint"]]
    unfinished += [(path, "has the run so far") for path in (*paths["csv"], *reversed(paths["trajectories"]))]
    try:
        with leaving(*unfinished, new=not resume), frames_for(outputs, "plot" in work.files) as (files, frames):
            quiet: Mapping[str, Any] = {"progress": lambda *_: None} if from_scene else {}
            run = answer_fluid(request, files, resume=resume, on_start=on_start, **quiet)
            if csv is not None:
                _add_errors(csv, run)
            return replace(run, centres=_centres(run, frames)) if "plot" in work.files else run
    except RunStopped as error:
        raise NoAnswerError(str(error)) from error


def _add_errors(csv: str, answer: FluidAnswer) -> None:
    """Add the error budget, known only at the end of a run, to the record beside its table."""
    from rotor.formats.provenance import write_beside

    path = Path(f"{csv}.provenance.json")
    record = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    write_beside(csv, {**record, "errors": answer.errors.as_json()})


def _settings(request: FluidRequest) -> dict[str, Any]:
    return {"engine": request.engine, "settings": asdict(request.settings)}


@contextmanager
def frames_for(outputs: Outputs, drawn: bool) -> Iterator[tuple[Outputs, str | None]]:
    """The files of a run, and the file of frames for its picture: a temporary file if no trajectory is written.

    A run with a checkpoint gets no temporary file, since the checkpoint would name it; then only the last frame is drawn.
    """
    if not drawn or outputs.trajectories or outputs.checkpoint is not None:
        yield outputs, str(outputs.trajectories[0]) if outputs.trajectories else None
        return
    with locked_folder(Path(gettempdir()), "rotor-frames-") as folder:
        path = str(folder / "frames.traj")
        yield replace(outputs, trajectories=(path,)), path


def _centres(answer: FluidAnswer, frames: str | None) -> Floats:
    """Centres of mass (frames, n, 3) in Å over the second half of a run, or at its end without frames."""
    from ase.io import read

    models = find_models(answer.request.settings.model)
    shapes = model_shapes(models)
    images = read(frames, ":") if frames is not None else [answer.atoms]
    for atoms in images:
        if "molecule" not in atoms.arrays:
            atoms.arrays["molecule"] = model_labels(atoms, models)
    return np.array([rigid_bodies(atoms, shapes=shapes)[1].centres for atoms in images[len(images) // 2 :]])


def _hill(symbols: str) -> str:
    """A formula in Hill order: OH2 becomes H2O."""
    from ase.formula import Formula

    return str(Formula(symbols).format("hill"))


def show(answer: FluidAnswer, report: Report) -> Iterable[Part | None]:
    """The run and its means."""
    content, settings = report.content, answer.request.settings
    kinds = ", ".join(f"{kind['count']} {_hill(kind['name'])}" for kind in content["molecules"])
    yield f"{kinds}: {settings.steps} steps of {settings.step_fs:g} fs, {settings.ensemble}, by {content['engine']}"
    yield [*_facts(content, settings), *error_facts(content.get("errors"))]
    columns = {
        "quantity": "{quantity}",
        "unit": "{unit}",
        "mean": "{mean:.6g}",
        "error": "{error:.2g}",
        "samples": "{effective_samples:.3g}",
    }
    title = "all rows, after the equilibration" if content["averaged_share"] == 1 else "second half of the rows"
    yield record_table(title, columns, content["means"], {"quantity", "unit"})


def _facts(content: Mapping[str, Any], settings: Settings) -> list[tuple[str, str]]:
    degrees, rms, drift = content["degrees"], content["conserved_rms_ev"], content["conserved_drift_ev_per_ns"]
    drift_error, density = content["conserved_drift_error_ev_per_ns"], content["density_g_cm3"]
    about = "" if isnan(drift_error) else f" ± {drift_error:.2g}"
    noisy = (
        content["engine"] == "lammps" and settings.ensemble != "nve"
    )  # the error under its thermostat noise is not known
    motions = (
        f"{degrees['translation']} of translation, {degrees['rotation']} of rotation; {degrees['removed']} removed"
    )
    conserved = "not known from one row alone" if isnan(rms) else f"rms {rms:.3g} eV, drift {drift:.3g}{about} eV/ns"
    box = "" if density is None else " x ".join(f"{edge:.6g}" for edge in content["box_angstrom"])
    return [
        ("model", f"{settings.model}, cutoff {settings.cutoff_angstrom:g} Å, {settings.electrostatics}"),
        ("box", box and f"{box} Å, {density:.5g} g/cm³"),
        ("start", content["start"]),
        ("degrees", motions),
        ("thermometer", content["thermometer"] + ("" if noisy else ": no error of order h²")),
        ("conserved", conserved),
        ("not computed", content["motion_reason"]),
    ]


VERB = Verb(
    name="fluid",
    about="Rigid molecules in a periodic box: temperatures, energies, pressure, rotational correlation times and diffusion.",
    examples=EXAMPLES,
    request=FluidRequest,
    answer=answer,
    table=lambda answer: answer.record,
    results=lambda answer: (
        {f"{mean['quantity']} ({mean['unit']})": mean["mean"] for mean in answer.facts()["means"]}
        | facts_named(answer.facts(), "conserved_drift_ev_per_ns")
    ),
    rows="record",
    show=show,
    outputs=(
        Output("csv", (".csv",), "Write rows during the run (.csv)", example="run.csv", grows=True),
        Output(
            "trajectories",
            FRAMES,
            "Write frames during the run (.traj, .xyz, .extxyz); repeatable",
            example="run.traj",
            option="--trajectory",
            grows=True,
            many=True,
        ),
        Output(
            "checkpoint",
            (".npz",),
            "Checkpoint file (.npz); a scene resumes from it if it exists",
            example="run.npz",
            grows=True,
        ),
        picture("Draw temperatures, energy and g(r)", "run.png"),
    ),
    subject=Box(),
    shown=FluidShown,
    content=lambda answer, shown: _settings(answer.request),
    drawn="ps",
    scaled=False,
    sound=False,
    stepwise=True,
    invariants="conserved",
    numerics="rotor.fluids.numerics:FLUID",
    accuracy="of the conserved energy (K) or of Ewald's forces (%)",
    accuracy_example="0.5 K",
    start={
        "conditions.model": "spce",
        "conditions.molecules": 216,
        "conditions.ensemble": "langevin",
        "conditions.steps": 20_000,
        "outputs.csv": "fluid.csv",
        "outputs.checkpoint": "fluid.npz",
    },
)
