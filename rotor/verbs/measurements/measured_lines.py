"""Subject of `fit`: measured lines and starting constants."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotor.checks import require_file
from rotor.frozen import dataclass
from rotor.requests.field import all_fields, declared
from rotor.requests.fill import Entries, NamedError, naming, read_instance, within, written_fields
from rotor.requests.lists import NameList
from rotor.requests.readers import Custom, Field, InsideError, Names, Quantity, Reader, Text, Whole
from rotor.units import parse_quantity
from rotor.verbs.common.molecule import FIELDS, MoleculeInput, Reading, top_of
from rotor.verbs.common.subjects import MOLECULE, file_name, saved_inputs, saved_molecule
from rotor.verbs.common.verb import Place, Subject, SubjectKind

if TYPE_CHECKING:
    from rotor.formats.fits.fit_request import FitRequest
    from rotor.verbs.common.verb import Verb


class Priors(Reader):
    """A-priori standard errors in MHz by name: texts such as DeltaK=0.02, or a table."""

    metavar = "X=ERROR"
    scene_type: Any = dict[str, float | str]
    many = True

    def read(self, raw: Any) -> dict[str, float]:
        """The errors by name; a repeated name is refused."""
        if isinstance(raw, Mapping):
            return {name: self._number(value, f".{name}: ") for name, value in raw.items()}
        numbers: dict[str, float] = {}
        for text in (raw,) if isinstance(raw, str) else raw:
            name, equals, value = (part.strip() for part in text.partition("="))
            if not (name and equals and value):
                raise InsideError(f" {text!r}: name=error is needed, such as DeltaK=0.02")
            if name in numbers:
                raise InsideError(f" {text!r}: {name} has an a-priori error already; give one")
            numbers[name] = self._number(value, ": ")
        return numbers

    def _number(self, value: float | str, place: str) -> float:
        try:
            return parse_quantity(value, "MHz")
        except ValueError as error:
            raise InsideError(f"{place}{error}") from None

    def write(self, value: Any) -> dict[str, str]:
        """The errors as texts."""
        return {name: f"{number!r} MHz" for name, number in value.items()}


@dataclass(frozen=True)
class LinesInput:
    """The measured lines."""

    source: Any = declared(
        None, Custom(file_name), "Lines: .lin, .csv, .cat; or case.par (with case.lin)", "lines.source", option="SOURCE",
        example="lines.csv",
    )  # fmt: skip
    lin: str | None = declared(
        None, Text(metavar="FILE"), "Lines of case.par, if not case.lin", "lines.lin", example="case.lin"
    )
    merge: str | None = declared(
        None, Text(metavar="FILE"), "More lines (.lin, .csv, .cat) of the same kind", "lines.merge", common=True,
        example="more.csv",
    )  # fmt: skip


@dataclass(frozen=True)
class FitInput:
    """Free parameters and settings of a fit; a .par file states its free parameters. Numbers as in `rotor.fitting.fit.FitOptions`."""

    free: tuple[str, ...] | None = declared(
        None, NameList(), 'Constants to fit: A,B,C,DeltaJ; of states and spins "E[1],B[1],G_c[0,1],chi_aa(14N)"; by default those of the '
        "start that have an error", "parameters.free", common=True, example=["A", "B", "C", "DeltaJ"],
    )  # fmt: skip
    ties: tuple[str, ...] = declared(
        (), Names(metavar="TEXT"), 'Constant that follows a free one: "DeltaK=2.5*DeltaJ", "C=B-300"; repeatable', "parameters.ties",
        option="--tie", common=True, example=["deltaK = 0.5*deltaJ"],
    )  # fmt: skip
    priors: Mapping[str, float] | None = declared(
        None, Priors(), "A-priori standard error of a free constant (MHz); repeatable", "parameters.priors", option="--prior",
        common=True, example={"DeltaK": "20 kHz"},
    )  # fmt: skip
    reject_above: float | None = declared(
        None, Quantity(), "Exclude and report lines that deviate by more than this many errors", "numerics.reject_above",
        option="--reject", common=True, example=5.0,
    )  # fmt: skip
    loss: str = declared(
        "squares", Text(metavar="NAME"), "squares; huber or cauchy give outliers less weight", "numerics.loss"
    )
    default_error_mhz: float | None = declared(
        None,
        Quantity("MHz", above=0),
        "Error of lines for which the file states 0 (MHz)",
        "numerics.default_error",
        example="10 kHz",
    )
    poor_rms: float = declared(10.0, Quantity(), "Weighted rms above which the fit has failed", "numerics.poor_rms")
    most_iterations: int | None = declared(
        None, Whole(1), "Maximum number of iterations; 100, or NITR of a .par file", "numerics.iterations", example=100
    )


LINES = {field.name: field for field in all_fields(LinesInput).values()}
START = replace(
    FIELDS["source"],
    option="--start",
    name="start",
    common=True,
    help="Constants to start from: a file (.toml, .var, ...) or a name",
)
_START = ("constants", "spin_constants", "spins", "state_constants")  # inputs of the start that are also options


class MeasuredLines(SubjectKind):
    """Measured lines, and the molecule whose constants start the fit."""

    fields = {  # noqa: RUF012
        **all_fields(LinesInput), **{field.identity: field for field in FIELDS.values()}, START.identity: START,
    }  # fmt: skip

    scene_fields: ClassVar[tuple[Field, ...]] = (
        replace(MOLECULE, help="start of the fit; not needed with a .par file", default=None, example="water"),
    )

    @property
    def options(self) -> Mapping[str, Field]:
        """Inputs of the lines and of the start."""
        start = {FIELDS[name].identity: FIELDS[name] for name in _START}
        return {**all_fields(LinesInput), START.identity: START, **start}

    def read(self, entries: Entries, place: Place, verb: Verb) -> Subject:
        """The files of the lines, and the starting top."""
        lines: LinesInput = read_instance(LinesInput, entries)
        if lines.source is None:
            raise NamedError("{lines.source} is missing; expected measured lines: .lin, .csv, .cat or case.par")
        is_file = isinstance(lines.source, str)
        is_par = is_file and lines.source.lower().endswith(".par")
        if lines.lin is not None and not is_par:
            raise NamedError("{lin}: expected with a .par file; otherwise give the lines as the source")
        paths = {name: _path(getattr(lines, name), field.called(entries.style), place) for name, field in LINES.items()}
        values: dict[str, Any] = {
            "paths": paths,
            "inputs": read_instance(FitInput, entries),
            "top": None,
            "start": None,
        }
        text = lines.source if is_file else f"{len(lines.source)} lines"
        if is_par:
            _refuse_start(entries, verb)
            return Subject(values, (lines, None), text, place.note)
        source = Path(place.folder) / lines.source if is_file else None
        if source and source.suffix.lower() == ".var":
            raise NamedError(f"{lines.source}: {_instead_of_var(source)}")
        molecule = _start(entries, source)
        values["top"] = top_of(Reading(molecule, entries.style, place.folder, place.note))
        if molecule.source is not None:
            file = Path(place.folder) / str(molecule.source)
            values["start"] = str(file) if file.is_file() else str(molecule.source)
        return Subject(values, (lines, molecule), text, place.note)

    def saved(self, request: FitRequest, subject: Subject, folder: Path) -> dict[str, Any]:
        """Lines, start and parameters, with files relative to the folder of the scene."""
        lines, molecule = subject.molecules
        start = {} if molecule is None else saved_molecule(molecule, folder)
        return {**saved_inputs(lines, folder, "lines"), **start, **written_fields(subject.values["inputs"])}


def _path(name: Any, called: str, place: Place) -> Any:
    """Path of a file relative to the folder of the call; other values unchanged."""
    if not isinstance(name, str):
        return name
    path = Path(place.folder) / name
    try:
        require_file(path)
    except ValueError as error:
        raise ValueError(f"{called}: {error}" if called != "SOURCE" else str(error)) from None
    return str(path)


def _refuse_start(entries: Entries, verb: Verb) -> None:
    """Refuse constants and parameters beside a .par file."""
    others = [
        field for field in verb.fields.values() if field.table in ("molecule", "parameters") and entries.has(field)
    ]
    if others:
        names = ", ".join(f"{{{field.identity}}}" for field in others)
        raise NamedError(f"{names}: a .par file states the free parameters and the start")


def _instead_of_var(path: Path) -> str:
    """What is missing if a .var file is given in place of lines, and what would do."""
    par, lin = path.with_suffix(".par"), path.with_suffix(".lin")
    constants = "the constants of a fit, not measured lines; "
    if par.is_file():
        return f"{constants}give {par.name}, which says what is free" + (
            "" if lin.is_file() else f", and lines in {lin.name}"
        )
    lines = lin.name if lin.is_file() else "measured lines (.lin, .csv, .cat)"
    return f"{constants}there is no {par.name} beside it, which would say what is free; give {lines} with {{start}} {path.name}"


def _start(entries: Entries, source: Path | None) -> MoleculeInput:
    """The molecule whose constants start the fit."""
    molecule: MoleculeInput = read_instance(MoleculeInput, entries)
    if (molecule.source is None) == (molecule.constants is None):
        if entries.style == "key" and molecule.source is None:
            raise ValueError("molecule: expected the starting constants, as source or constants")
        par = source and source.with_suffix(".par")
        both = f", or {par.name} as the source, which states them for lines beside it" if par and par.is_file() else ""
        raise NamedError(f"expected the starting constants; give either {{start}} or {{constants}}{both}")
    if molecule.source is not None and str(molecule.source).lower().endswith((".csv", ".lin")):
        raise NamedError(
            f"{{start}} {molecule.source}: a list of lines has no constants; give a .toml, .var or the name of a molecule"
        )
    return molecule


def build(verb: Verb, entries: Entries, subject: Subject) -> FitRequest:
    """The request of the fit."""
    from rotor.formats.fits.fit_request import lines_request, spfit_request, with_more_lines

    inputs, paths = subject.values["inputs"], subject.values["paths"]
    if subject.top is None:
        request = spfit_request(paths["source"], paths["lin"])
    else:
        with naming([replace(verb.fields["parameters.priors"], name="priors_mhz")], entries.style):
            request = lines_request(
                paths["source"],
                subject.top,
                inputs.free,
                ties=inputs.ties,
                priors_mhz=inputs.priors,
                start=subject.values["start"],
            )
    if paths["merge"] is not None:
        with within("{merge}"):
            request = with_more_lines(request, paths["merge"])
    settings = {item.name for item in fields(request.options)}
    changes = {name: value for name, value in vars(inputs).items() if name in settings and value is not None}
    return replace(request, options=replace(request.options, **changes))
