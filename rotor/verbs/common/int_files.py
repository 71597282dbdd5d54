"""`rotor spectrum case.int`: the prediction of SPCAT from this file and the .var or .par beside it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.frozen import dataclass
from rotor.requests.field import all_fields
from rotor.requests.fill import Entries, NamedError, naming
from rotor.spectra.request import SpectrumAnswer, SpectrumRequest
from rotor.verbs.common.molecule import FIELDS
from rotor.verbs.common.outputs import Report
from rotor.verbs.common.verb import Note

if TYPE_CHECKING:
    from rotor.formats.spcat.predict import Prediction

# inputs of the verb that the .int or its parameter file already determines -> field of the files; of a molecule all but its source
ANSWERED = {
    "conditions.temperature": "TEMP",
    "numerics.jmax": "FEND",
    "observables.min_lgint": "STR0 and STR1",
    "conditions.range": "FQLIM",
    "observables.q": "QROT",
    "observables.vibrational_factor": "QROT",
    "vibration.fundamentals": "QROT",
    "vibration.states": "QROT",
    "outputs.tag": "TAG",
    **{field.identity: "the constants" for name, field in FIELDS.items() if name != "source"},
    "molecule.dipole": "the dipoles",
    "molecule.dipole_abc": "the dipoles",
    "molecule.state_dipoles": "the dipoles",
    "molecule.spin_weights": "WTPL and WTMN",
    "molecule.state_weights": "EWT",
    "molecule.spins": "SPIND",
    "effects.hyperfine": "SPIND",
    "effects.hyperfine_method": "SPIND",
    "effects.hyperfine_tolerance": "SPIND",
}


@dataclass(frozen=True)
class PredictedRequest(SpectrumRequest):
    """The request of SPCAT's files. prediction: its lines. source: the .int file. basis: settings of the prediction."""

    prediction: Any = None
    source: str = ""
    basis: tuple[tuple[str, bool], ...] = ()


def is_int_file(source: Any) -> bool:
    """Whether the source is an .int file."""
    return isinstance(source, str) and source.lower().endswith(".int")


def predicted_request(source: str, entries: Entries, note: Note, **basis: bool) -> PredictedRequest:
    """The request of an .int file, with its prediction. Inputs that the files determine are refused; notes are passed on.

    basis: as_spcat and full_basis.
    """
    clashes = [identity for identity in ANSWERED if entries.values.get(identity) is not None]
    if clashes:
        flags = ", ".join(f"{{{identity}}}" for identity in clashes)
        fields = ", ".join(dict.fromkeys(ANSWERED[identity] for identity in clashes))
        them = "them" if len(clashes) > 1 else "it"
        raise NamedError(f"{flags}: {source} determines {them} ({fields}); change {them} there{_or_its_var(source)}")
    from rotor.formats.spcat.predict import predict_file

    unnamed = predict_file(source, **basis)
    for text in unnamed.notes:
        note(text)
    prediction = with_names(unnamed, Path(source))
    settings, lines = prediction.request, prediction.lines
    with naming(all_fields(PredictedRequest).values(), entries.style):
        return PredictedRequest(
            lines.top,
            temperature_k=settings.temperature_k,
            jmax=settings.fend,
            min_lgint=settings.str0,
            range_mhz=lines.range_mhz,
            q=prediction.q,
            prediction=prediction,
            source=source,
            basis=tuple(basis.items()),
        )


def _or_its_var(source: str) -> str:
    """A second remedy, if the constants of the parameter file have names."""
    from rotor.formats.read_write import read_spcat_top

    path = Path(source).with_suffix(".var")
    try:
        read_spcat_top(path)
    except (OSError, ValueError):
        return ""
    return f", or give {path} with --dipole-abc instead, which has no such settings and no dipole"


def with_names(prediction: Prediction, source: Path) -> Prediction:
    """The prediction with named constants, spins and states if all parameters have names; else unchanged."""
    from rotor.formats.read_write import read_spcat_top
    from rotor.quantum.effects.of_top import effects_of

    lines = prediction.lines
    try:
        top = read_spcat_top(source, alone=False)
        effects = effects_of(top, top.spin_constants is not None)
    except ValueError:
        return prediction
    levels = replace(lines.levels, effects=effects)
    return replace(prediction, lines=replace(lines, top=top, levels=levels))


def write_catalogue(answer: SpectrumAnswer, path: Path, report: Report) -> None:
    """Write the catalogue as SPCAT does: with its weights, its zero of energy, and K doublets as two lines."""
    from rotor.formats.spcat.text.cat import write_cat

    prediction = _prediction(answer)
    write_cat(prediction.catalogue, path)
    _write_record(prediction, path, report, q=prediction.q, lines=len(prediction.catalogue))


def write_levels(answer: SpectrumAnswer, path: Path, report: Report) -> None:
    """Write the levels as SPCAT lists them."""
    from rotor.formats.atomic_write import write_whole
    from rotor.formats.spcat.text.egy import format_egy

    prediction = _prediction(answer)
    write_whole(path, format_egy(prediction.levels))
    _write_record(prediction, path, report, levels=len(prediction.levels))


def _write_record(prediction: Prediction, path: Path, report: Report, **numbers: float) -> None:
    """Write the provenance of a file beside it."""
    from rotor.formats.provenance import provenance_record, write_beside

    write_beside(path, provenance_record(prediction.lines, dict(report.provenance)) | numbers)


def _prediction(answer: SpectrumAnswer) -> Prediction:
    if not isinstance(answer.request, PredictedRequest):
        raise ValueError("an .egy of a spectrum is that of an .int file; rotor.levels writes levels of anything else")
    prediction: Prediction = answer.request.prediction
    return prediction
