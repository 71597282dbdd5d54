"""`rotor stark`: levels of a molecule in a static electric field."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.shared import inputs, pulse_inputs
from rotor.cli.shared.inputs import Input
from rotor.cli.shared.output import (
    Files,
    Table,
    Writer,
    deliver,
    json_with_rows,
    show_facts,
    show_table,
)

if TYPE_CHECKING:
    from rotor.arrays import Floats
    from rotor.quantum.field_map import FieldMap
    from rotor.tops.top import Top

EXAMPLES = """\b
Examples:
  rotor stark OCS --field 0:200kV/cm --states "J<=2" --plot ocs.png --csv ocs.csv
  rotor stark --constants "A=5655.2654 B=1546.8759 C=1214.4040 MHz" --dipole-abc 4.5152,0,0 --field 0,100kV/cm
  rotor stark OCS --field 0:50kV/cm:101 --intensity "1e11 W/cm2" --states "J<=1\""""

POINTS = 201
SHOWN = 24


@dataclass(frozen=True)
class Settings:
    """What the options ask for, in the units of the package."""

    fields_kv_per_cm: Floats
    j_highest: int
    m_values: tuple[int, ...] | None
    intensity_w_per_cm2: float
    jmax: int | None
    tolerance_mhz: float
    diabatic_gap_mhz: float | None


def command(
    context: typer.Context,
    source: str | None = inputs.SOURCE,
    constants: str | None = inputs.CONSTANTS,
    field: str = typer.Option(
        "0:100kV/cm", metavar="GRID", help="Fields: start:stop[:count], count 201 by default, or a comma list (kV/cm)."
    ),
    states: str = typer.Option("J<=2", metavar="TEXT", help="Levels up to this J of the free molecule."),
    m: str | None = typer.Option(None, "--m", metavar="LIST", help="|M| of the states: 0,1; by default 0 to the highest J."),
    intensity: str = typer.Option("0", metavar="I", help="Of a laser along the field, far from resonance (W/cm2)."),
    diabatic_gap: str | None = typer.Option(
        None, metavar="GAP", help="Also labels that pass near crossings with a smaller gap (MHz)."
    ),
    dipole: str | None = inputs.DIPOLE,
    dipole_abc: str | None = inputs.DIPOLE_ABC,
    polarizability: str | None = typer.Option(
        None, metavar="LIST", help="In principal axes: aa,bb,cc[,ab,ac,bc] or parallel,perpendicular (Å³)."
    ),
    jmax: int | None = typer.Option(None, metavar="N", help="Highest J of the basis; by default what the tolerance needs."),
    tolerance: str = typer.Option("1e-4", metavar="E", help="Of the energies (MHz)."),
    isotope: list[str] | None = inputs.ISOTOPE,
    csv: str | None = typer.Option(None, metavar="FILE", help="Write the map as CSV."),
    parquet: str | None = typer.Option(None, metavar="FILE", help="Write the map as Parquet."),
    plot: str | None = typer.Option(None, metavar="FILE", help="Draw the map (.png, .pdf, .svg)."),
    json: str | None = inputs.JSON,
) -> None:
    """Levels in a static electric field: energies, labels, effective dipoles and cosines of every M."""
    inputs.whole("--jmax", jmax, 2)
    settings = Settings(
        fields_kv_per_cm=inputs.option("--field", field, _fields),
        j_highest=pulse_inputs.states("--states", states),
        m_values=None if m is None else inputs.option("--m", m, _m_values),
        intensity_w_per_cm2=inputs.quantity("--intensity", intensity, "W/cm2"),
        jmax=jmax,
        tolerance_mhz=inputs.positive("--tolerance", tolerance, "MHz"),
        diabatic_gap_mhz=None if diabatic_gap is None else inputs.positive("--diabatic-gap", diabatic_gap, "MHz"),
    )
    files = Files()
    files.ask("--csv", csv, (".csv",))
    files.ask("--parquet", parquet, (".parquet",))
    files.ask("--plot", plot, (".png", ".pdf", ".svg"))
    files.ask_json(json)
    if "--plot" in files.wanted and len(settings.fields_kv_per_cm) < 2:
        raise ValueError("--plot: a picture of a map needs two fields or more; give --field a range")

    given = Input(source, constants, isotope or [], dipole, dipole_abc, None)
    top = inputs.with_some_dipole(inputs.read_top(given))
    if polarizability is not None or settings.intensity_w_per_cm2:
        from rotor.cli.raman import with_polarizability

        top = with_polarizability(top, polarizability)
    found = _map(top, settings)
    content = _content(top, found, settings, given, context.obj)
    content["files"] = [str(path) for path in files.wanted.values()]
    deliver(
        files,
        _writers(top, found, content),
        lambda: json_with_rows(found, "states", content),
        lambda: _show(top, found, content),
    )


def _fields(text: str) -> Floats:
    from rotor.units import parse_grid

    return parse_grid(f"{text}:{POINTS}" if text.count(":") == 1 else text, "kV/cm")


def _m_values(text: str) -> tuple[int, ...]:
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isdecimal() for part in parts):
        raise ValueError(f"{text!r}: whole numbers of 0 or more between commas are expected, such as 0,1")
    return tuple(int(part) for part in parts)


def _map(top: Top, settings: Settings) -> FieldMap:
    from rotor.quantum.effects.stark import stark_map

    return stark_map(
        top,
        settings.fields_kv_per_cm,
        j_highest=settings.j_highest,
        m_values=settings.m_values,
        intensity_w_per_cm2=settings.intensity_w_per_cm2,
        jmax=settings.jmax,
        tolerance_mhz=settings.tolerance_mhz,
        diabatic_gap_mhz=settings.diabatic_gap_mhz,
    )


def _content(top: Top, found: FieldMap, settings: Settings, given: Input, command: str) -> dict[str, Any]:
    """What is printed and more, by the keys of docs/command_line.md."""
    from rotor.cli.shared.report import describe

    fields = found.fields
    return {
        **describe(top, given.text, command),
        "field_kv_per_cm": [float(fields[0]), float(fields[-1]), len(fields)],
        "intensity_w_per_cm2": settings.intensity_w_per_cm2,
        "j_highest": settings.j_highest,
        "diabatic_gap_mhz": settings.diabatic_gap_mhz,
        "tolerance_mhz": settings.tolerance_mhz,
        **found.facts,
        "curves": len(found.curves()),
    }


def _writers(top: Top, found: FieldMap, content: dict[str, Any]) -> dict[str, Writer]:
    provenance = {"command": content["command"], "input": content["input"], "dipole_abc_debye": top.dipole_abc_debye}

    def table(path: Path) -> None:
        import rotor

        rotor.write(found, path, settings=provenance)

    def draw(path: Path) -> None:
        from rotor.plots.stark import plot_stark

        plot_stark(found, path, title=top.name or "in a static field", provenance={"command": provenance["command"]})

    return {"--csv": table, "--parquet": table, "--plot": draw}


def _show(top: Top, found: FieldMap, content: dict[str, Any]) -> None:
    from rotor.cli.shared.report import heading

    print(heading(top))
    show_facts(_facts(top, content))
    print()
    curves = found.curves()
    last = f"{found.fields[-1]:g} kV/cm"
    rows = []
    for rows_of in curves[:SHOWN]:
        at, end = rows_of.start, rows_of.stop - 1
        numbers = (found.energy_mhz[at], found.energy_mhz[end], found.slope[end], found.cosines["costheta"][end])
        rows.append([str(found.label[at]), str(found.m[at]), *(f"{value:.6f}" for value in numbers)])
    names = ("state", "|M|", f"E at {found.fields[0]:g} kV/cm (MHz)", f"E at {last} (MHz)", f"μ_eff at {last} (D)", "⟨cosθ⟩")
    title = f"{len(rows)} of {len(curves)} states" if len(rows) < len(curves) else "all states"
    show_table(Table(f"{title}, by M and block", names, rows, frozenset({"state"})))


def _facts(top: Top, content: dict[str, Any]) -> list[tuple[str, str]]:
    from rotor.cli.shared import report

    first, last, count = content["field_kv_per_cm"]
    facts = [
        ("constants", report.with_source(report.constants_text(top), top.source)),
        ("dipole", report.with_source(report.vector_text(top.dipole_abc_debye), top.dipole_source)),
        ("field", f"{first:g} to {last:g} kV/cm along Z, {count} values"),
    ]
    if content["intensity_w_per_cm2"]:
        facts.append(("laser", f"{content['intensity_w_per_cm2']:g} W/cm² along Z"))
    accuracy = f"J max {content['jmax']}; energies move by {content['accuracy_mhz']:.1e} MHz with a higher one"
    return [*facts, ("accuracy", f"{accuracy}, edge population {content['edge_population']:.1e}")]
