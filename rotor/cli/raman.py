"""`rotor raman`: rotational Raman lines of a molecule."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.checks import require_between, require_whole
from rotor.cli.shared import gas_layer, inputs
from rotor.cli.shared.gas_layer import Vibration
from rotor.cli.shared.hyperfine import HyperfineOptions, effects_asked, hyperfine_lines
from rotor.cli.shared.inputs import Input, json_option
from rotor.cli.shared.line_tables import the_first
from rotor.cli.shared.options import file_option, grouped, option
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
from rotor.cli.shared.plot_options import ViewOptions, view_of
from rotor.cli.shared.process import one_thread_of_blas
from rotor.cli.shared.save_scene import save_scene, save_scene_option
from rotor.cli.shared.sources import source_facts

if TYPE_CHECKING:
    from rotor.plots.view import View
    from rotor.spectra.raman import RamanLines
    from rotor.spectra.raman_request import RamanAnswer
    from rotor.tops.top import Top

EXAMPLES = """\b
Examples:
  rotor raman N2
  rotor raman CO2 --laser 488 --temperature 500 --csv co2.csv --plot co2.png
  rotor raman HCN --polarizability 3.9,2.0 --temperature 10 --hyperfine
  rotor raman --constants "B=1.98958 cm-1" --polarizability 2.22,1.53 --spin-weights even=2,odd=1"""

NAMES = {
    "temperature_k": "--temperature", "laser_nm": "--laser", "jmax": "--jmax", "min_relative": "--min-relative",
}  # fmt: skip  # field of the request -> option


@dataclass(frozen=True)
class Options:
    """What is computed, and how much of it is shown."""

    temperature: str = option("300", metavar="T", help="Temperature (K).")
    laser: str = option("532", metavar="W", help="Wavelength of the laser in vacuum (nm).")
    polarizability: str | None = option(
        None, metavar="LIST", help="In principal axes: aa,bb,cc[,ab,ac,bc] or parallel,perpendicular (Å³)."
    )
    jmax: int | None = option(None, metavar="N", help="Highest J; by default what the cut needs.")
    min_relative: str = option("1e-6", metavar="X", help="Leave out lines below X of the strongest; or 'none'.")
    top_lines: int = option(20, "--top", metavar="N", help="How many of the strongest lines are shown.")


@dataclass(frozen=True)
class Outputs:
    """Files to write."""

    csv: str | None = file_option(".csv", help="Write all lines as CSV.")
    parquet: str | None = file_option(".parquet", help="Write all lines as Parquet.")
    plot: str | None = file_option(".png", ".pdf", ".svg", help="Draw the lines (.png, .pdf, .svg).")
    json: str | None = json_option()
    save_scene: str | None = save_scene_option()


@grouped(given=("dipole", "dipole_abc", "state_dipoles", "calculator", "hessian"))
def command(
    context: typer.Context,
    given: Input,
    options: Options,
    spins: HyperfineOptions,
    vibration: Vibration,
    outputs: Outputs,
    picture: ViewOptions,
) -> None:
    """Rotational Raman lines: Stokes and anti-Stokes shifts and their cross sections."""
    one_thread_of_blas(options.jmax)
    from rotor.spectra.raman_request import RamanRequest, answer_raman

    require_whole("--top", options.top_lines, 0)
    settings = {**_settings(options), "vibrations": gas_layer.vibrations_of(vibration)}
    files = Files.of(outputs)
    view = view_of(picture, files, "cm-1")
    top = with_polarizability(inputs.read_top(given), options.polarizability)
    with inputs.fields_as_options(**NAMES):
        request = RamanRequest(top, **settings, effects=effects_asked(top, spins, given.spin_constants))
    with answering():
        answer = answer_raman(request)
        content = _content(answer, given, context.obj, options.top_lines)
    if "--plot" in files.paths and answer.why_no_lines:
        raise ComputationError(f"--plot: no lines: {answer.why_no_lines}")
    for warning in answer.lines.warnings:
        note(warning)

    content["files"] = files.names
    text = lambda: json_with_rows(answer.lines, "lines", content)  # noqa: E731
    saved = save_scene("raman", request, outputs, given, options.polarizability is not None)
    deliver(
        files,
        _writers(answer.lines, content, view) | saved,
        text,
        lambda: _show(answer, content, given.sources),
    )


def _settings(options: Options) -> dict[str, Any]:
    """Fields of the request from the texts of the options."""
    require_whole("--jmax", options.jmax, 0)
    least = inputs.cut("--min-relative", options.min_relative)
    if least is not None:
        require_between("--min-relative", least, 0, 1)
    return {
        "temperature_k": inputs.positive("--temperature", options.temperature, "K"),
        "laser_nm": inputs.positive("--laser", options.laser, "nm"),
        "jmax": options.jmax,
        "min_relative": least,
    }


def _content(answer: RamanAnswer, given: Input, command: str, shown: int) -> dict[str, Any]:
    """What is printed and more, by the keys of docs/command_line.md."""
    from rotor.cli.shared.report import begin

    return {**begin(command, given.text), **answer.facts(), "strongest": answer.strongest(shown)}


def with_polarizability(top: Top, text: str | None) -> Top:
    """The top with the polarizability given, else its own; ValueError where none is known."""
    if text is not None:
        return inputs.parsed("--polarizability", text, lambda value: _given(top, value))
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


def _writers(lines: RamanLines, content: dict[str, Any], view: View) -> dict[str, Writer]:
    provenance = {"command": content["command"], "input": content["input"]}

    def table(path: Path) -> None:
        """The table as a file."""
        import rotor

        rotor.write(lines, path, settings=provenance)

    def draw(path: Path) -> None:
        """The picture as a file."""
        from rotor.plots.raman import plot_raman

        plot_raman(lines, path, view=view, provenance={"command": provenance["command"]})

    return {"--csv": table, "--parquet": table, "--plot": draw}


def _show(answer: RamanAnswer, content: dict[str, Any], whole_sources: bool) -> None:
    from rotor.cli.shared.report import heading, model_facts

    lines = answer.lines
    print(heading(lines.top))
    show_facts(_facts(lines, content))
    if not len(lines):
        print(f"\nno lines: {answer.why_no_lines}")
    elif len(content["strongest"]):
        print()
        show_table(_table(lines, content["strongest"]))
    print()
    tables = ("constants", "polarizability", "spin weights")
    show_facts([*source_facts(lines.top, tables, whole_sources), *model_facts(content)])


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
        ("constants", report.constants_text(top)),
        ("polarizability", report.tensor_text(top)),
        ("anisotropy", f"{content['anisotropy_angstrom3']:.6g} Å³"),
        ("spin weights", weights),
        *report.states_facts(top)[:1],
        ("temperature", f"{lines.temperature_k:g} K"),
        ("laser", f"{lines.laser_nm:g} nm in vacuum"),
        ("Q", report.q_text(content["q"])),
        ("J max", f"{lines.jmax}: {content['jmax_source']}"),
        ("cut", cut),
        *hyperfine_lines(content["hyperfine"]),
        (
            "lines",
            f"{len(lines)}, together {content['band_cross_section_cm2_per_sr']:.4g} cm²/sr" if len(lines) else "none",
        ),
    ]


def _table(lines: RamanLines, rows: Any) -> Table:
    """The strongest lines in order of shift."""
    from rotor.quantum import quanta

    shown = lines.where(rows)
    names = quanta.headings(lines.quanta_names)
    columns = ("shift (cm-1)", "dσ/dΩ (cm²/sr)", "λ (nm)", "E (cm-1)", "g", "S (Å⁶)", "from", "to")
    wavenumber = "{:.6f}" if "f" in lines.quanta_names else "{:.4f}"  # spins move levels by some 1e-5 cm⁻¹
    formats = (wavenumber, "{:.4e}", "{:.4f}", wavenumber, "{}", "{:.5g}")
    cells = [[form.format(x) for x in column] for form, column in zip(formats, shown.columns.values(), strict=False)]
    labels = [shown.levels.labels(states) for states in (shown.initial, shown.final)]
    title = the_first(len(shown), "strongest line") if len(shown) < len(lines) else "all lines"
    return Table(f"{title}, in order of shift (states: {names})", columns, list(zip(*cells, *labels, strict=True)))
