"""`rotor convert`: constants from one file format into another."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.frozen import dataclass
from rotor.reports.screen import Part
from rotor.reports.top_facts import error_facts
from rotor.requests.field import OUTPUT, REQUIRED, declared
from rotor.requests.readers import Text, Whole
from rotor.tops.facts import top_facts
from rotor.verbs.common.molecule import refuse_weights_of_another_kind
from rotor.verbs.common.outputs import Output, Report
from rotor.verbs.common.subjects import top_of_word
from rotor.verbs.common.verb import ErrorsShown, Note, Tool, Work, silent

if TYPE_CHECKING:
    from rotor.formats.molecules.molecule_file import MoleculeFile
    from rotor.formats.spcat.text.int_file import IntensityFile
    from rotor.requests.budget import ErrorBudget
    from rotor.tops.top import Top

EXAMPLES = """\
  rotor convert case.var constants.toml
  rotor convert constants.toml case.par --kmax 60
  rotor convert water water.var
  rotor convert NH3 ammonia.par && rotor convert NH3 ammonia.int"""


@dataclass(frozen=True)
class ConvertRequest:
    """The source, and the highest quantum number of a file for SPFIT or SPCAT."""

    source: str = declared(REQUIRED, Text(), "File (.par, .var, .int, .toml, ...) or name", option="SOURCE")
    kmax: int = declared(99, Whole(0, 359), "Highest K of a .par or .var (KNMAX), highest F of an .int", panel=OUTPUT)


@dataclass(frozen=True)
class Converted:
    """The top of the source, the target as the user named it, and the function that writes it."""

    request: ConvertRequest
    top: Top
    target: str
    write: Callable[[Path], None]

    def facts(self) -> dict[str, Any]:
        """The top, by the keys of `rotor info`."""
        errors = self.errors
        return top_facts(self.top) | ({} if errors is None else {"errors": errors.as_json()})

    @property
    def errors(self) -> ErrorBudget | None:
        """Error budget of the constants; None for an .int file, which holds no constants."""
        from rotor.tops.constants.budget import constants_budget

        return None if self.target.lower().endswith(".int") else constants_budget([self.top])


def answer(request: ConvertRequest, work: Work) -> Converted:
    """Read the source, and check that the target format can hold it."""
    target = str(work.files["target"][0])
    top = top_with_errors(request.source, work.note)
    write = writer_of(top, request, target, work.note)
    for text in lost_options(top, request, target):
        work.note(text)
    return Converted(request, top, target, write)


def _further(top: Top) -> str:
    """Further vibrational states and spins, in words."""
    states = f"; {top.states.count} states" if top.states else ""
    spins = f"; spins {', '.join(top.spin_constants.twice)}" if top.spin_constants else ""
    return states + spins


def refuse_overwriting(request: ConvertRequest, outputs: Mapping[str, Any], _: Any) -> None:
    """Refuse to overwrite the .var or .par beside an .int source, which is read with it."""
    source, target = Path(request.source), outputs["target"][0]
    beside = [source.with_suffix(suffix) for suffix in (".var", ".par")] if source.suffix.lower() == ".int" else []
    if source.is_file() and target.resolve() in {path.resolve() for path in beside}:
        raise ValueError(f"TARGET {target}: is an input of this command; give another name")


def parameters_of(source: str) -> Path:
    """The file of a source; for an .int file, the parameter file beside it."""
    from rotor.formats.spcat.text.par import parameters_beside

    path = Path(source)
    return parameters_beside(path) if path.suffix.lower() == ".int" else path


def top_with_errors(source: str, note: Note = silent) -> Top:
    """The top of a source; uncertainties of its constants come from the errors in a .var file."""
    from rotor.formats.read_write import read_spcat_top

    path = parameters_of(source)
    if path.suffix.lower() != ".var" or not path.exists():
        return top_of_word(source, note)
    top = read_spcat_top(path, errors=True)
    for text in top.notes:
        note(text)
    return top


def writer_of(top: Top, request: ConvertRequest, target: str, note: Note) -> Callable[[Path], None]:
    """Function that writes the top in the target's format; content that the format cannot hold is refused or noted."""
    from rotor.formats.atomic_write import write_whole
    from rotor.formats.molecules.molecule_writer import write_molecule_file
    from rotor.formats.spcat.names.named_parameters import named_parameter_file
    from rotor.formats.spcat.text.int_file import format_int
    from rotor.formats.spcat.text.par import format_par
    from rotor.tops.top import without_internal_rotation

    suffix = Path(target).suffix
    if suffix.lower() == ".toml":
        file = molecule_file(top, request.source, Path(target).stem)
        return lambda path: write_molecule_file(file, path)

    without_internal_rotation(top, f"a {suffix} file")
    if top.level_table is not None:
        note(f"a {suffix} file cannot hold the table of level energies, which replace energies of the constants")
    if suffix.lower() == ".int":
        intensities = _intensities(top, request.kmax)
        return lambda path: write_whole(path, format_int(intensities))

    moments = [top.dipole_abc_debye or (0.0, 0.0, 0.0), *(top.states.dipoles.values() if top.states else ())]
    if any(map(any, moments)):
        dipole = ", ".join(f"{mu:g}" for mu in moments[0])
        note(f"a {suffix} file cannot hold the dipole ({dipole} D); an .int file can")
    parameters = named_parameter_file(top, request.kmax)
    return lambda path: write_whole(path, format_par(parameters))


def molecule_file(top: Top, source: str, stem: str) -> MoleculeFile:
    """The molecule file of a top, checked to be readable again. stem: its name if the top has none."""
    from rotor.formats.molecules.molecule_file import MoleculeFile

    sources = {"constants": top.source, "dipole": top.dipole_source, "spin_weights": top.weights_source}
    sources = {table: text or f"converted from {Path(source).name}" for table, text in sources.items()}
    if not top.dipole_abc_debye:
        del sources["dipole"]
    shared = ("constants", "covariance", "dipole_abc_debye", "spin_weights", "states", "internal_rotation", "spin_constants",
              "polarizability_abc_angstrom3", "magnetic")  # fmt: skip
    contents: dict[str, Any] = {name: getattr(top, name) for name in shared}
    file = MoleculeFile(name=top.name or stem, sources=sources, **contents)
    _refuse_unreadable(file, source)
    return file


def _refuse_unreadable(file: MoleculeFile, source: str) -> None:
    """Raise ValueError if reading the .toml would fail, as for dipoles or couplings that the spin weights forbid."""
    from rotor.formats.molecules.molecule_file import parse_molecule_file
    from rotor.formats.molecules.molecule_writer import molecule_file_text
    from rotor.formats.read_write import file_top
    from rotor.quantum.effects.of_top import effects_of

    try:
        top = file_top(parse_molecule_file(molecule_file_text(file), "TARGET"))
        refuse_weights_of_another_kind(top)
        if top.spin_constants is not None:
            effects_of(top, True)  # fails if the spin weights count a total spin of the file twice
    except ValueError as reason:
        raise ValueError(
            f"{source}: a .toml of it could not be read: {reason}; remove the part named here from the source (a dipole "
            "between levels of different weight gives no line unless they mix), or predict from the files themselves"
        ) from None


def lost_options(top: Top, request: ConvertRequest, target: str) -> list[str]:
    """Note on options of SPFIT's files (DIAG, KNMAX, NLINE) that the target does not keep."""
    from rotor.formats.spcat.text.par import read_par

    path = parameters_of(request.source)
    if path.suffix.lower() not in (".par", ".var") or not path.is_file() or target.lower().endswith(".int"):
        return []
    file, kind = read_par(path), top.constants.kind
    kmax = 0 if kind == "linear" else request.kmax
    written = {"DIAG": 3 if kind == "asymmetric" else 0, "KNMAX": kmax, "NLINE": 1}
    knmax = min(line.knmax for line in file.options)
    # more lines than 1 are only a count of measured lines
    stated = {"DIAG": file.options[0].diag, "KNMAX": knmax, "NLINE": min(file.header.nline, 1)}
    lost = [f"{name} = {value}" for name, value in stated.items() if value != written[name]]
    if not lost:
        return []
    others = ", ".join(f"{name} = {value}" for name, value in written.items())
    several = len(lost) > 1
    what = f"{'have' if several else 'has'} no place in a .toml"
    if not target.lower().endswith(".toml"):
        what = f"{'are' if several else 'is'} not converted"
    return [
        f"{', '.join(lost)} of {path.name} {what}: a .par or .var written from these constants has {others}; "
        "SPCAT omits K above KNMAX (--kmax)"
    ]


def _intensities(top: Top, highest: int) -> IntensityFile:
    """The .int file at 300 K with F up to `highest`; Q is summed over the levels and spins of the top."""
    from rotor.formats.spcat.model import intensity_file
    from rotor.formats.spcat.text.int_file import Request
    from rotor.quantum.effects.of_top import effects_of
    from rotor.thermodynamics.sums.partition import partition_function

    count = top.states.count if top.states else 1
    q = partition_function(top, 300.0, effects=effects_of(top, bool(top.spin_constants))).q
    request = Request(tag=0, qrot=q, fend=min(highest, 99), str0=-12.0, str1=-12.0, maxv=count - 1)
    return intensity_file(top, request)


def show(answer: Converted, report: Report) -> Iterable[Part | None]:
    """The written constants and their errors."""
    yield f"{answer.request.source} → {answer.target}: {answer.top.constants.text()}{_further(answer.top)}"
    yield error_facts(report.content.get("errors"))


VERB = Tool(
    name="convert",
    about="Constants, spins, states, dipoles and weights into another file format; values stay the same.",
    examples=EXAMPLES,
    request=ConvertRequest,
    of="source",
    answer=answer,
    show=show,
    outputs=(
        Output(
            "target", (".toml", ".par", ".var", ".int"), "File to write: .toml, .par, .var or .int",
            lambda answer, path, report: answer.write(path), option="TARGET", required=True,
        ),
    ),
    check=refuse_overwriting,
    shown=ErrorsShown,
)  # fmt: skip
