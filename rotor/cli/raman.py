"""`rotor raman`: rotational Raman lines of a molecule."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.shared import gas_layer as layer
from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import Input
from rotor.cli.shared.output import (
    ComputationError,
    Files,
    Table,
    Writer,
    answering,
    deliver,
    json_with_rows,
    note,
    show_facts,
    show_table,
)

if TYPE_CHECKING:
    from rotor.spectra.raman import RamanLines
    from rotor.thermo import VibrationalStates
    from rotor.tops.top import Top

EXAMPLES = """\b
Examples:
  rotor raman N2
  rotor raman CO2 --laser 488 --temperature 500 --csv co2.csv --plot co2.png
  rotor raman --constants "B=1.98958 cm-1" --polarizability 2.22,1.53 --spin-weights even=2,odd=1"""


@dataclass(frozen=True)
class Settings:
    """What the options ask for, in the units of the package."""

    temperature_k: float
    laser_nm: float
    jmax: int | None
    min_relative: float | None
    vibrations: VibrationalStates | None


def command(
    context: typer.Context,
    source: str | None = inputs.SOURCE,
    constants: str | None = inputs.CONSTANTS,
    temperature: str = typer.Option("300", metavar="T", help="Temperature (K)."),
    laser: str = typer.Option("532", metavar="W", help="Wavelength of the laser in vacuum (nm)."),
    polarizability: str | None = typer.Option(
        None, metavar="LIST", help="In principal axes: aa,bb,cc[,ab,ac,bc] or parallel,perpendicular (Å³)."
    ),
    jmax: int | None = typer.Option(None, metavar="N", help="Highest J; by default what the cut needs."),
    min_relative: str = typer.Option("1e-6", metavar="X", help="Leave out lines below X of the strongest; or 'none'."),
    isotope: list[str] | None = inputs.ISOTOPE,
    spin_weights: str | None = inputs.SPIN_WEIGHTS,
    symmetry_tolerance: str | None = inputs.SYMMETRY_TOLERANCE,
    vibration: str | None = layer.VIBRATION,
    vibrational_states: str | None = layer.VIBRATIONAL_STATES,
    csv: str | None = typer.Option(None, metavar="FILE", help="Write all lines as CSV."),
    parquet: str | None = typer.Option(None, metavar="FILE", help="Write all lines as Parquet."),
    plot: str | None = typer.Option(None, metavar="FILE", help="Draw the lines (.png, .pdf, .svg)."),
    json: str | None = inputs.JSON,
    top_lines: int = typer.Option(20, "--top", metavar="N", help="How many of the strongest lines are shown."),
) -> None:
    """Rotational Raman lines: Stokes and anti-Stokes shifts and their cross sections."""
    inputs.whole("--jmax", jmax, 0)
    inputs.whole("--top", top_lines, 0)
    settings = Settings(
        temperature_k=inputs.positive("--temperature", temperature, "K"),
        laser_nm=inputs.positive("--laser", laser, "nm"),
        jmax=jmax,
        min_relative=_cut(min_relative),
        vibrations=layer.vibrations(vibration, vibrational_states),
    )
    files = Files()
    files.ask("--csv", csv, (".csv",))
    files.ask("--parquet", parquet, (".parquet",))
    files.ask("--plot", plot, (".png", ".pdf", ".svg"))
    files.ask_json(json)

    given = Input(source, constants, isotope or [], None, None, spin_weights, symmetry_tolerance=symmetry_tolerance)
    top = _with_polarizability(inputs.read_top(given), polarizability)
    with answering():
        lines = _lines(top, settings)
        content = _content(lines, settings, given, context.obj, top_lines)
    if "--plot" in files.wanted and not len(lines):
        raise ComputationError(f"--plot: no lines: {_why_none(lines)}")
    for warning in lines.warnings:
        note(warning)

    content["files"] = [str(path) for path in files.wanted.values()]
    deliver(
        files, _writers(lines, content), lambda: json_with_rows(lines, "lines", content), lambda: _show(lines, content)
    )


def _cut(text: str) -> float | None:
    least = inputs.cut("--min-relative", text)
    if least is not None and not 0 < least < 1:
        raise ValueError(f"--min-relative: {text!r}: a number between 0 and 1 is wanted, or 'none'")
    return least


def _with_polarizability(top: Top, text: str | None) -> Top:
    """The top with the polarizability given, else its own; ValueError where there is none to be had."""
    if text is not None:
        return inputs.option("--polarizability", text, lambda value: _given(top, value))
    if top.polarizability_abc_angstrom3 is None and top.kind != "spherical":
        raise ValueError(
            "the polarizability is not known: give --polarizability aa,bb,cc (principal axes, Å³), or "
            "parallel,perpendicular of a linear or symmetric top"
        )
    return top


def _given(top: Top, text: str) -> Top:
    from rotor.units import parse_grid

    numbers = parse_grid(text, "Å3").tolist() if ":" not in text else []
    source = "given in principal axes (--polarizability)"
    if len(numbers) == 2 and top.kind in ("linear", "prolate", "oblate"):
        along, across = numbers
        numbers = [across, across, along] if top.kind == "oblate" else [along, across, across]
    if len(numbers) not in (3, 6):
        raise ValueError(
            f"{text!r}: aa,bb,cc or aa,bb,cc,ab,ac,bc, or parallel,perpendicular of a linear or symmetric top"
        )
    aa, bb, cc, ab, ac, bc = [*numbers, 0.0, 0.0, 0.0][:6]
    return top.with_polarizability([[aa, ab, ac], [ab, bb, bc], [ac, bc, cc]], source)


def _lines(top: Top, settings: Settings) -> RamanLines:
    from rotor.spectra.raman import raman_lines

    return raman_lines(
        top,
        temperature_k=settings.temperature_k,
        laser_nm=settings.laser_nm,
        jmax=settings.jmax,
        min_relative=settings.min_relative,
        vibrations=settings.vibrations,
    )


def _content(lines: RamanLines, settings: Settings, given: Input, command: str, shown: int) -> dict[str, Any]:
    """What is printed and more, by the keys of docs/command_line.md."""
    import numpy as np

    from rotor.cli.shared.report import describe, q_record
    from rotor.spectra.raman import anisotropy_angstrom3, band_cross_section
    from rotor.thermo import classical_partition_function

    given_jmax = settings.jmax is not None
    return {
        **describe(lines.top, given.text, command),
        "temperature_k": lines.temperature_k,
        "laser_nm": lines.laser_nm,
        "anisotropy_angstrom3": anisotropy_angstrom3(lines.top),
        "band_cross_section_cm2_per_sr": band_cross_section(lines),
        "q": q_record(lines.partition, classical_partition_function(lines.top, lines.temperature_k)),
        "jmax": lines.jmax,
        "jmax_source": "given"
        if given_jmax
        else f"beyond it no line reaches {settings.min_relative or 1e-6:g} of the strongest",
        "min_relative": settings.min_relative,
        "line_count": len(lines),
        "strongest": np.sort(np.argsort(-lines.cross_section_cm2_per_sr, kind="stable")[:shown]),
    }


def _writers(lines: RamanLines, content: dict[str, Any]) -> dict[str, Writer]:
    provenance = {"command": content["command"], "input": content["input"]}

    def table(path: Path) -> None:
        import rotor

        rotor.write(lines, path, settings=provenance)

    def draw(path: Path) -> None:
        from rotor.plots.raman import plot_raman

        plot_raman(lines, path, provenance={"command": provenance["command"]})

    return {"--csv": table, "--parquet": table, "--plot": draw}


def _show(lines: RamanLines, content: dict[str, Any]) -> None:
    from rotor.cli.shared.report import heading

    print(heading(lines.top))
    show_facts(_facts(lines, content))
    if not len(lines):
        print(f"\nno lines: {_why_none(lines)}")
    elif len(content["strongest"]):
        print()
        show_table(_table(lines, content["strongest"]))


def _facts(lines: RamanLines, content: dict[str, Any]) -> list[tuple[str, str]]:
    from rotor.cli.shared import report

    top = lines.top
    weights = report.weights_text(content["spin_weights"])
    cut = (
        "none: every allowed line"
        if content["min_relative"] is None
        else f"{content['min_relative']:g} of the strongest"
    )
    return [
        ("constants", report.with_source(report.constants_text(top), top.source)),
        ("polarizability", report.with_source(report.tensor_text(top), top.polarizability_source)),
        ("anisotropy", f"{content['anisotropy_angstrom3']:.6g} Å³"),
        ("spin weights", report.with_source(weights, top.weights_source)),
        ("temperature", f"{lines.temperature_k:g} K"),
        ("laser", f"{lines.laser_nm:g} nm in vacuum"),
        ("Q", report.q_text(content["q"])),
        ("J max", f"{lines.jmax}: {content['jmax_source']}"),
        ("cut", cut),
        (
            "lines",
            f"{len(lines)}, together {content['band_cross_section_cm2_per_sr']:.4g} cm²/sr" if len(lines) else "none",
        ),
    ]


def _why_none(lines: RamanLines) -> str:
    if lines.top.kind == "spherical":
        return "the polarizability of a rigid spherical top is isotropic"
    if lines.jmax < 2:
        return "J max leaves none"
    return "the polarizability is isotropic, or the levels that it connects do not exist"


def _table(lines: RamanLines, rows: Any) -> Table:
    """The strongest lines in order of shift."""
    shown = lines.where(rows)
    names = " ".join(name.capitalize() for name in lines.quanta_names)
    columns = ("shift (cm-1)", "dσ/dΩ (cm²/sr)", "λ (nm)", "E (cm-1)", "g", "S (Å⁶)", "from", "to")
    formats = ("{:.4f}", "{:.4e}", "{:.4f}", "{:.4f}", "{}", "{:.5g}")
    cells = [[form.format(x) for x in column] for form, column in zip(formats, shown.columns.values(), strict=False)]
    labels = [[" ".join(f"{n:2d}" for n in quanta) for quanta in shown.quanta(s)] for s in (shown.initial, shown.final)]
    title = f"the {len(shown)} strongest lines" if len(shown) < len(lines) else "all lines"
    return Table(f"{title}, in order of shift (states: {names})", columns, list(zip(*cells, *labels, strict=True)))
