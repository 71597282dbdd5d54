"""`emission`: lines as a radio telescope sees them, of one or several molecules in one source."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rotor.checks import require_file
from rotor.frozen import dataclass
from rotor.quantum.labels.quanta import headings
from rotor.reports.line_tables import first_rows_title
from rotor.reports.screen import Part, Table, listed, record_table, table_records
from rotor.reports.top_facts import error_facts, hyperfine_lines, short_source
from rotor.requests.field import REQUIRED, all_fields, declared, declared_fields
from rotor.requests.fill import Entries, NamedError, read_instance, written_fields
from rotor.requests.plan import MOST_LEFT_OUT
from rotor.requests.readers import Custom, Field, Quantity, Text
from rotor.spectra.emission.request import EmissionAnswer, EmissionRequest, answer_emission
from rotor.tops.top import Top
from rotor.verbs.common.molecule import (
    FIELDS,
    STATES,
    MoleculeInput,
    Reading,
    range_without_unit,
    top_of,
    with_some_dipole,
)
from rotor.verbs.common.outputs import Report, picture, table_file, tables
from rotor.verbs.common.subjects import beside, saved_molecule
from rotor.verbs.common.verb import LinesShown, Place, Subject, SubjectKind, Verb
from rotor.verbs.measurements.emission_observed import OBSERVED
from rotor.verbs.measurements.observed_file import SeveralInput, is_catalogue

if TYPE_CHECKING:
    from rotor.spectra.emission.emitters import CatalogueLines

EXAMPLES = """\
  rotor emission CO --range 115.1:115.4GHz --column 1e17 --excitation 20 --width 2
  rotor emission CH3CN HC3N SO2 --band ALMA6 --column 1e15,3e14,1e15 --excitation 100 --width 5 --plot core.png
  rotor emission HCN --range 88.62:88.64GHz --hyperfine --width 0.3 --excitation 10
  rotor emission CO --isotope C=13C --band ALMA3 --column 1e16 --excitation 10 --velocity 5.6 --csv co.csv
  rotor emission CO HCN --band ALMA3 --column 1e18,1e15 --excitation 40,10 --width 300 --redshift 2.3
  rotor emission c028503.cat --partition catdir.cat --band ALMA6 --column 1e16
  rotor emission CH3OH HCN --over spectrum.fits --column 1e16,1e14 --velocity 4 --plot pages.pdf
  rotor emission --fit spectrum.fits CH3OH CH3CN --catalogue lines.rotorcat --shared velocity,width
  rotor emission --fit cube.fits CH3CN --catalogue lines.rotorcat --maps maps.fits --workers 2"""
_SINGLE_ONLY = ("isotopes", "spin_constants", "spins", *STATES)  # inputs that need a single molecule


@dataclass(frozen=True)
class EmitterInput:
    """Inputs of one molecule in a source; those left out follow the conditions."""

    column_per_cm2: float = declared(
        1e14, Quantity("1/cm2", above=0), "Column density of the molecule (1/cm²)", "column"
    )
    excitation_k: float | None = declared(
        None,
        Quantity("K", above=0),
        "Excitation temperature, if it differs from the conditions (K)",
        "excitation",
        example="50 K",
    )
    velocity_km_s: float | None = declared(
        None, Quantity("km/s"), "Velocity, if it differs (km/s)", "velocity", example=5.6
    )
    fwhm_km_s: float | None = declared(
        None, Quantity("km/s"), "Width of the lines, if it differs (km/s)", "width", example=2.0
    )
    partition: str | None = declared(
        None, Text(metavar="FILE"), "Q(T) of a .cat file: a catdir.cat, or T=Q pairs: 300=108.87,75=27.46", "partition",
        example="300=108.87,75=27.46",
    )  # fmt: skip


@dataclass(frozen=True)
class EmittingMolecule(EmitterInput, MoleculeInput):
    """A molecule of the source."""


class SeveralMolecules(SubjectKind):
    """Several molecules, or one with further inputs; .cat files with Q(T) may be among them."""

    fields = {**all_fields(SeveralInput), **{FIELDS[name].identity: FIELDS[name] for name in _SINGLE_ONLY}}  # noqa: RUF012
    scene_fields: ClassVar[tuple[Field, ...]] = (
        Field(Custom(list, scene_type=list[EmittingMolecule]), "one or more", "molecules", default=REQUIRED),
    )

    def read(self, entries: Entries, place: Place, verb: Verb) -> Subject:
        """Read all molecules and their inputs."""
        inputs, departures = zip(*self._tables(entries), strict=True)
        molecules: list[Top | CatalogueLines] = []
        for number, (molecule, stated) in enumerate(zip(inputs, departures, strict=True)):
            try:
                reading = Reading(molecule, entries.style, place.folder, place.note)
                molecules.append(_molecule(reading, stated.get("partition")))
            except ValueError as error:
                raise ValueError(f"molecules[{number}]: {error}" if entries.style == "key" else str(error)) from None
        text = " ".join(str(molecule.source or molecule.constants) for molecule in inputs)
        return Subject({"molecules": tuple(molecules)}, inputs, text, place.note, departures)

    def _tables(self, entries: Entries) -> list[tuple[MoleculeInput, Mapping[str, Any]]]:
        """The inputs of each molecule, and those in which its gas departs from the conditions."""
        if entries.style == "key":
            tables = entries.values.get("molecules", ())
            if not tables:
                raise ValueError("molecules: expected one molecule or more")
            return [_read_table(table) for table in tables]
        several: SeveralInput = read_instance(SeveralInput, entries)
        if not several.names:
            raise ValueError("SOURCE: expected one molecule or several, such as 'rotor emission CO HCN --band ALMA3'")
        for field in (FIELDS[name] for name in _SINGLE_ONLY):
            if entries.has(field) and (len(several.names) > 1 or is_catalogue(several.names[0])):
                raise NamedError(f"{{{field.name}}}: expected with a single molecule, not with a catalogue")
        if several.partition is not None and not any(map(is_catalogue, several.names)):
            raise ValueError("--partition: needs a .cat file among the molecules; it gives their Q(T)")
        values = {name: value for name, value in entries.values.items() if name.startswith("molecule.")}
        return [
            (
                read_instance(MoleculeInput, Entries({**values, "molecule.source": source}, entries.style)),
                {"partition": several.partition} if is_catalogue(source) and several.partition else {},
            )
            for source in several.names
        ]

    def saved(self, request: EmissionRequest, subject: Subject, folder: Path) -> dict[str, Any]:
        """The tables of the molecules."""
        first = request.sources[0]
        tables = []
        for molecule, source, stated in zip(subject.molecules, request.sources, subject.departures, strict=True):
            flat = saved_molecule(molecule, folder)
            content = {name.partition(".")[2] or "source": value for name, value in flat.items()}
            gas = ("excitation_k", "velocity_km_s", "fwhm_km_s")
            departures = {name: getattr(source, name) for name in gas if getattr(source, name) != getattr(first, name)}
            if partition := stated.get("partition"):
                departures["partition"] = beside(partition, folder)
            tables.append({**content, **written_fields(EmitterInput(source.column_per_cm2, **departures))})
        return {"molecules": tables}


def _read_table(table: Mapping[str, Any]) -> tuple[MoleculeInput, Mapping[str, Any]]:
    fields = all_fields(EmittingMolecule).values()
    entered = {field.identity: table[field.last] for field in fields if field.last in table}
    molecule: EmittingMolecule = read_instance(EmittingMolecule, Entries(entered, "key"))
    values = {name: getattr(molecule, name) for name in declared_fields(EmitterInput)}
    return molecule, {name: value for name, value in values.items() if value is not None}


def _molecule(reading: Reading, partition: str | None) -> Top | CatalogueLines:
    """A top with a dipole, or the lines of a .cat file with Q(T)."""
    source = reading.inputs.source
    if not is_catalogue(source):
        if partition is not None:
            raise ValueError("partition: needs a .cat file as source; it gives its Q(T)")
        return with_some_dipole(top_of(reading), reading)
    from rotor.formats.catalogue.cat_species import read_cat_with

    path = Path(reading.path(source))
    require_file(path)
    species = read_cat_with(path, partition if partition is None or "=" in partition else reading.path(partition))
    if "note" in species.identity:
        reading.note(f"{path}: {species.identity['note']}; --partition states another")
    return species


def show(answer: EmissionAnswer, report: Report) -> Iterable[Part | None]:
    """The source, the molecules and the brightest lines."""
    request, lines = answer.request, answer.lines
    first, last = request.range_mhz
    yield f"{', '.join(request.names)}: brightness temperature, from {first:.10g} to {last:.10g} MHz"
    yield _facts(answer)
    if not len(lines):
        why = "none is inside the range and deep enough; widen --range or lower --least-depth"
        if all(map(_is_dark, request.molecules)):
            why = "a molecule without a dipole moment emits none"
        yield f"no lines: {why}{range_without_unit(report.entries)}\n"
    yield _table(answer, report.shown.top_lines)
    cited = "; ".join(
        f"{name}: {molecule.source if report.sources else short_source(molecule.source)}"
        + ("" if lines.quanta else f", Q {lines.q_source}")
        for name, molecule, lines in zip(request.names, request.molecules, answer.emitted, strict=True)
    )
    yield [("sources", cited), *error_facts(report.content.get("errors")), *_limits(answer, report.with_spins)]


def _is_dark(molecule: Top | CatalogueLines) -> bool:
    """Whether a molecule has no dipole moment."""
    return isinstance(molecule, Top) and not any(molecule.dipole_abc_debye or ())


def _facts(answer: EmissionAnswer) -> list[tuple[str, str]]:
    request, layer = answer.request, answer.request.sources[0]
    behind = f"background {layer.background_k:g} K as observed, filling {layer.filling:g}"
    facts = [
        ("source", behind + (f", redshift {layer.redshift:g}" if layer.redshift else "")),
        ("lines", f"{len(answer.lines)}; velocities in the radio convention, v = c (1 - ν/ν_rest)"),
    ]
    for name, top, source, lines in zip(request.names, request.molecules, request.sources, answer.emitted, strict=True):
        gas = f"N = {source.column_per_cm2:.4g} /cm², T_ex = {source.excitation_k:g} K"
        motion = f"width {source.fwhm_km_s:g} km/s at {source.velocity_km_s:g} km/s"
        quanta = f"; upper, lower: {headings(lines.quanta)}" if lines.quanta else ""
        dark = "; no dipole moment, no lines" if _is_dark(top) else ""
        facts.append((name, f"{gas}, {motion}, Q = {lines.q:.6g}{quanta}{dark}"))
    for name, lines in zip(request.names, answer.emitted, strict=True):
        prefix = f"{name}: " if len(request.names) > 1 else ""
        facts += [(title, prefix + text) for title, text in hyperfine_lines(lines.hyperfine)]
    if (peak := answer.peak) is not None:
        name = request.names[int(answer.lines.molecule[peak.row])]
        line = f"{name} {answer.lines.upper[peak.row]} – {answer.lines.lower[peak.row]}"
        text = f"{peak.brightness_k:.4g} K at {peak.observed_mhz:.4f} MHz, {line}, τ = {peak.optical_depth:.3g}"
        facts.append(("brightest" if peak.brightness_k >= 0 else "deepest", text))
    return facts


def _limits(answer: EmissionAnswer, with_spins: str) -> list[tuple[str, str]]:
    """Neglected effects: of the source, and the largest of each molecule; of many molecules, those of the largest."""
    from rotor.quantum.estimates.limits import model_limits

    request, largest = answer.request, []
    for name, top, lines in zip(request.names, request.molecules, answer.emitted, strict=True):
        limits = model_limits(top, lines.typical_j, lines.effects) if isinstance(top, Top) else ()
        largest += [(name, limit) for limit in limits[:1]]
    if len(largest) >= MOST_LEFT_OUT:
        largest.sort(key=lambda pair: -(pair[1].size or 0.0))
    shown = largest if len(largest) < MOST_LEFT_OUT else largest[: MOST_LEFT_OUT - 2]
    sentences = ["departures from one excitation temperature; structure of the source in the beam"]
    sentences += [f"{name}: {limit.sentence(with_spins)}" for name, limit in shown]
    if others := [f"{name}: {limit.name}" for name, limit in largest[len(shown) :]]:
        sentences.append(f"smaller or not estimated: {', '.join(others)}")
    return listed("left out", sentences)


def _table(answer: EmissionAnswer, shown: int) -> Table:
    """The brightest lines in order of frequency."""
    lines = answer.lines
    rows = np.sort(np.argsort(-lines.brightness_k, kind="stable")[:shown])
    columns = {
        "molecule": "{molecule}",
        "at rest (MHz)": "{frequency_mhz:.4f}",
        "observed (MHz)": "{observed_mhz:.4f}",
        "upper": "{upper}",
        "lower": "{lower}",
        "E_u (K)": "{energy_upper_k:.2f}",
        "A (1/s)": "{einstein_a_per_s:.2e}",
        "g_u": "{g_upper}",
        "τ": "{optical_depth:.3g}",
        "T_B (K)": "{brightness_k:.4g}",
        "∫T_B dv (K km/s)": "{integrated_k_km_s:.4g}",
    }
    title = first_rows_title(len(rows), len(lines), "brightest line")
    return record_table(
        f"{title}, in order of frequency; each alone", columns, table_records(lines, rows), {"molecule"}
    )


VERB = Verb(
    name="emission",
    about="Lines of a source as a radio telescope sees them: brightness temperature in local thermodynamic equilibrium.",
    examples=EXAMPLES,
    small_blocks=True,
    request=EmissionRequest,
    answer=lambda request, work: answer_emission(request),
    table=lambda answer: answer.lines,
    results=lambda answer: {
        "lines": len(answer.lines),
        "peak_k": answer.peak.brightness_k,
        "peak_mhz": answer.peak.observed_mhz,
    },
    rows="lines",
    show=show,
    outputs=(
        *tables("the lines", "lines"),
        table_file(
            "profile_csv", "T_B and optical depth on the grid", "profile.csv", lambda answer, _: answer.spectrum
        ),
        picture("Draw T_B of all molecules", "emission.png"),
    ),
    subject=SeveralMolecules(),
    shown=LinesShown,
    stated=("molecules", "source", "range_mhz"),
    drawn="MHz",
    spectral=True,
    numerics="rotor.spectra.numerics:EMISSION",
    accuracy="of the brightness",
    accuracy_example="1 mK",
    start={
        "molecules.source": "CO",
        "molecules.column": 1e16,
        "conditions.excitation": "20 K",
        "conditions.range": "115:116GHz",
        "outputs.csv": "emission.csv",
    },
    other=OBSERVED,
)
