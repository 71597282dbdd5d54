"""`rotor stark`: levels of a molecule in a static electric field."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.checks import require_whole
from rotor.cli.shared import inputs
from rotor.cli.shared.field_maps import (
    accuracy_fact,
    content_of,
    fields_of,
    refuse_picture_of_one_field,
    table_of_states,
)
from rotor.cli.shared.inputs import Input, json_option, parsed, positive, quantity
from rotor.cli.shared.options import file_option, grouped, option
from rotor.cli.shared.output import (
    Files,
    Table,
    Writer,
    deliver,
    json_with_rows,
    show_facts,
    show_table,
)
from rotor.cli.shared.plot_options import ViewOptions, view_of
from rotor.cli.shared.polarizability import with_polarizability
from rotor.cli.shared.save_scene import save_scene, save_scene_option
from rotor.reports.sources import with_sources
from rotor.reports.top_facts import model_facts
from rotor.table import counted

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor import table as tables
    from rotor.plots.view import View
    from rotor.quantum.fields.field_map import FieldMap
    from rotor.spectra.fields.request import FieldRequest
    from rotor.tops.top import Top

EXAMPLES = """\b
Examples:
  rotor stark OCS --field 0:200kV/cm --states "J<=2" --plot ocs.png --csv ocs.csv
  rotor stark indole --field 0:200kV/cm --states "J<=2" --plot indole.png
  rotor stark --constants "A=5655.2654 B=1546.8759 C=1214.4040 MHz" --dipole-abc 4.5152,0,0 --field 0,100kV/cm
  rotor stark OCS --field 0:50kV/cm:101 --intensity "1e11 W/cm2" --tilt 45 --states "J<=1"
  rotor stark OCS --field 0:5kV/cm:21 --states "J<=3" --line "2 - 1" --light perpendicular --lines lobes.csv --coefficients c.csv
  rotor stark OCS --field 20kV/cm --states "J<=6" --spread 0.005 --linewidth 0.5MHz --range 0:90GHz --spectrum ocs.csv
  rotor stark HC3N --field 0:2kV/cm --states "J<=1" --spin-constants "chi_aa(14N)=-4.3 MHz" --plot hc3n.png
  rotor stark indole --field 0:50kV/cm --temperature 1 --mixture indole_1k.csv --deflection mu_eff.csv"""

MOST_J = 500  # of the basis: a minute's work for an asymmetric top
NAMES = {
    "fields_kv_per_cm": "--field", "j_highest": "--states", "m_values": "--m", "intensity_w_per_cm2": "--intensity",
    "jmax": "--jmax", "tolerance_mhz": "--tolerance", "diabatic_gap_mhz": "--diabatic-gap", "direction": "--tilt",
    "temperature_k": "--temperature", "populations": "--populations", "linewidth_mhz": "--linewidth", "range_mhz": "--range",
    "spread": "--spread", "light": "--light", "hyperfine": "--hyperfine",
}  # fmt: skip  # field of the request -> option
POINTS = 201


@dataclass(frozen=True)
class Options:
    """What is computed."""

    field: str = option(
        "0:100kV/cm", metavar="GRID", help="Fields: start:stop[:count], of 201 by default, or a comma list (kV/cm)."
    )
    states: str = option("J<=2", metavar="TEXT", help="Levels up to this J of the free molecule.")
    m: str | None = option(
        None, "--m", metavar="LIST", help="|M| of the states: 0,1; by default all. With spins |M_F|: 0.5,1.5."
    )
    intensity: str = option("0", metavar="I", help="Of a laser along the field, far from resonance (W/cm2).")
    diabatic_gap: str | None = option(
        None, metavar="GAP", help="Also labels that pass near crossings with a smaller gap (MHz)."
    )
    polarizability: str | None = option(
        None, metavar="LIST", help="In principal axes: aa,bb,cc[,ab,ac,bc] or parallel,perpendicular (Å³)."
    )
    tilt: str = option(
        "0", metavar="ANGLE", help="Of the field with the light of the laser (degrees); M is mixed then."
    )
    jmax: int | None = option(None, metavar="N", help="Highest J of the basis; by default what the tolerance needs.")
    tolerance: str = option("1e-4", metavar="E", help="Of the energies (MHz).")
    hyperfine: bool | None = option(
        None,
        "--hyperfine/--no-hyperfine",
        help="With the spins of nuclei; by default where --spin-constants are given.",
    )
    workers: int = option(1, metavar="N", help="Processes over which blocks of states are spread.")


@dataclass(frozen=True)
class Sample:
    """What lines, spectra and mixtures are of."""

    light: str = option(
        "parallel",
        metavar="NAME",
        help="Of --lines: parallel, perpendicular, isotropic, the angle with the field (degrees), or a direction X,Y,Z.",
    )
    temperature: str = option("300", metavar="T", help="Of --lines, --spectrum and --mixture (K).")
    populations: str = option(
        "equilibrium",
        metavar="NAME",
        help="equilibrium in the field, or adiabatic: those of the free molecule, as in a beam.",
    )
    line: str | None = option(None, metavar="TEXT", help="Lines between two free levels alone, such as '1 - 0'.")
    linewidth: str = option("1", metavar="W", help="Full width at half maximum of the lines of --spectrum (MHz).")
    range_: str | None = option(
        None, "--range", metavar="A:B", help="Frequencies of --spectrum (MHz); by default those of the lines."
    )
    spread: float = option(
        0.0, metavar="X", help="Of --spectrum: standard deviation of the field over the sample, a fraction of it."
    )


@dataclass(frozen=True)
class Outputs:
    """Files to write."""

    csv: str | None = file_option(".csv", help="Write the map as CSV.")
    parquet: str | None = file_option(".parquet", help="Write the map as Parquet.")
    plot: str | None = file_option(".png", ".pdf", ".svg", help="Draw the map (.png, .pdf, .svg).")
    lines: str | None = file_option(".csv", help="Write the lines in every field, resolved in M, as CSV.")
    lobes: str | None = file_option(".png", ".pdf", ".svg", help="Draw the lines against the field (.png, .pdf, .svg).")
    spectrum: str | None = file_option(".csv", help="Write the cross section at the highest field as CSV.")
    coefficients: str | None = file_option(".csv", help="Write Stark coefficients of the states, or of --line, as CSV.")
    mixture: str | None = file_option(".csv", help="Write means of the thermal mixture against the field as CSV.")
    deflection: str | None = file_option(".csv", help="Write effective dipoles, one column for each state, as CSV.")
    json: str | None = json_option()
    save_scene: str | None = save_scene_option()


@grouped(given=("spin_weights", "calculator", "hessian", *inputs.STATES), picture=("plot_scale",))
def command(
    context: typer.Context,
    given: Input,
    options: Options,
    sample: Sample,
    outputs: Outputs,
    picture: ViewOptions,
) -> None:
    """Levels in a static electric field: energies, labels, effective dipoles and cosines of every M; lines and mixtures."""
    from rotor.cli.shared.workers import working
    from rotor.quantum.fields.stark_request import StarkRequest, answer_stark
    from rotor.spectra.fields.request import FieldRequest

    settings, of_sample = _settings(options), _sample(sample)
    settings["hyperfine"] = given.spin_constants is not None if options.hyperfine is None else options.hyperfine
    files = Files.of(outputs)
    view = view_of(picture, files, "kV/cm")
    refuse_picture_of_one_field(files, settings["fields_kv_per_cm"])
    top = _acted_on(inputs.read_top(given), options, settings["intensity_w_per_cm2"])
    with inputs.fields_as_options(**NAMES):
        request = FieldRequest(StarkRequest(top, **settings), **of_sample)
        with working(options.workers, "blocks") as executor:
            answer = answer_stark(request.stark, executor)
            made = _made(request, answer.states, files, executor)

    content = content_of(answer, given, context.obj)
    content["files"] = files.names
    text = lambda: json_with_rows(answer.states, "states", content)  # noqa: E731
    writers = {**_writers(top, answer.states, content, view), **_further_writers(made, content)}
    writers |= save_scene("stark", answer.request, outputs, given, options.polarizability is not None)
    show = with_sources(
        lambda: _show(top, answer.states, content),
        top,
        ("constants", "dipole"),
        given.sources,
        lambda: model_facts(content),
    )
    deliver(files, writers, text, show)


def _made(request: FieldRequest, states: FieldMap, files: Files, executor: Executor | None) -> dict[str, tables.Table]:
    """The tables that files were asked for, by the option."""
    from rotor.spectra.fields.request import MAKERS

    asked = {name for name in MAKERS if f"--{name}" in files.paths}
    asked |= {"lines"} if "--lobes" in files.paths else set()
    return {name: MAKERS[name](request, states, executor) for name in sorted(asked)}


def _further_writers(made: dict[str, tables.Table], content: dict[str, Any]) -> dict[str, Writer]:
    provenance = {"command": content["command"], "input": content["input"]}

    def writer(table: tables.Table) -> Writer:
        """What writes one table."""

        def write(path: Path) -> None:
            """The file, with what it was made from."""
            import rotor

            rotor.write(table, path, settings=provenance)

        return write

    def draw(path: Path) -> None:
        """The picture as a file."""
        from rotor.plots.stark import plot_lobes

        plot_lobes(made["lines"], path, title=content["name"] or "", provenance=provenance)  # type: ignore[arg-type]

    return {**{f"--{name}": writer(table) for name, table in made.items()}, "--lobes": draw}


def _sample(sample: Sample) -> dict[str, Any]:
    """Fields of the request from the texts of the options."""
    from rotor.units import parse_range

    named = sample.light in ("parallel", "perpendicular", "isotropic")
    range_ = sample.range_
    return {
        "light": sample.light if named else parsed("--light", sample.light, _light),
        "temperature_k": quantity("--temperature", sample.temperature, "K"),
        "populations": sample.populations,
        "line": None if sample.line is None else parsed("--line", sample.line, _line),
        "linewidth_mhz": positive("--linewidth", sample.linewidth, "MHz"),
        "range_mhz": None if range_ is None else parsed("--range", range_, lambda text: parse_range(text, "MHz")),
        "spread": sample.spread,
    }


def _light(text: str) -> float | tuple[float, ...]:
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) not in (1, 3):
        raise ValueError(
            f"{text!r}: expected parallel, perpendicular, isotropic, an angle in degrees, or a direction such as 1,0,1"
        )
    return numbers if len(numbers) == 3 else numbers[0]


def _line(text: str) -> tuple[str, str]:
    parts = [" ".join(part.replace(",", " ").split()) for part in text.split(" - ")]
    if len(parts) != 2 or not all(parts):
        raise ValueError(f"{text!r}: expected quantum numbers of two levels, such as '1 - 0' or '2 1 2 - 1 1 1'")
    return parts[0], parts[1]


def _settings(options: Options) -> dict[str, Any]:
    """Fields of the request from the texts of the options."""
    gap = options.diabatic_gap
    require_whole("--jmax", options.jmax, 0, MOST_J)
    return {
        "fields_kv_per_cm": parsed("--field", options.field, lambda text: fields_of(text, "kV/cm", POINTS)),
        "j_highest": parsed("--states", options.states, inputs.highest_j),
        "m_values": None if options.m is None else parsed("--m", options.m, _m_values),
        "intensity_w_per_cm2": quantity("--intensity", options.intensity, "W/cm2"),
        "direction": parsed("--tilt", options.tilt, _direction),
        "jmax": options.jmax,
        "tolerance_mhz": positive("--tolerance", options.tolerance, "MHz"),
        "diabatic_gap_mhz": None if gap is None else positive("--diabatic-gap", gap, "MHz"),
    }


def _acted_on(top: Top, options: Options, intensity_w_per_cm2: float) -> Top:
    """The top with the dipole and, where light acts, the polarizability."""
    top = inputs.with_some_dipole(top)
    if options.polarizability is not None or intensity_w_per_cm2:
        top = with_polarizability(top, options.polarizability)
    return top


def _direction(text: str) -> tuple[float, float, float]:
    """The direction of the field at an angle with Z, in the plane of X and Z; exactly Z for 0."""
    import math

    try:
        angle = float(text)
    except ValueError:
        angle = math.nan
    if not math.isfinite(angle):
        raise ValueError(f"{text!r}: expected an angle in degrees")
    return (math.sin(math.radians(angle)), 0.0, math.cos(math.radians(angle))) if angle else (0.0, 0.0, 1.0)


def _m_values(text: str) -> tuple[float, ...]:
    parts = [part.strip() for part in text.split(",")]
    if not all(re.fullmatch(r"\d+(\.[05])?", part) for part in parts):
        raise ValueError(f"{text!r}: expected numbers of 0 or more between commas, such as 0,1, or 0.5,1.5 of M_F")
    return tuple(float(part) if "." in part else int(part) for part in parts)


def _writers(top: Top, states: FieldMap, content: dict[str, Any], view: View) -> dict[str, Writer]:
    provenance = {"command": content["command"], "input": content["input"], "dipole_abc_debye": top.dipole_abc_debye}

    def table(path: Path) -> None:
        """The table as a file."""
        import rotor

        rotor.write(states, path, settings=provenance)

    def draw(path: Path) -> None:
        """The picture as a file."""
        from rotor.plots.picture import name_of_top
        from rotor.plots.stark import plot_stark

        plot_stark(states, path, title=name_of_top(top), view=view, provenance={"command": provenance["command"]})

    return {"--csv": table, "--parquet": table, "--plot": draw}


def _show(top: Top, states: FieldMap, content: dict[str, Any]) -> None:
    from rotor.reports.top_facts import heading

    print(heading(top))
    show_facts(_facts(top, content))
    print()
    show_table(_table(states, mixed=bool(content["field_direction"][0] or content["field_direction"][1])))


def _table(states: FieldMap, mixed: bool) -> Table:
    """The first states, by M and block; M has a sign where three components of the dipole act."""
    first, last = states.fields[0], states.fields[-1]

    def row(rows: slice) -> list[str]:
        """One row of the printed table."""
        at, end = rows.start, rows.stop - 1
        numbers = (states.energy_mhz[at], states.energy_mhz[end], states.slope[end], states.cosines["costheta"][end])
        m = "mixed" if mixed else f"{states.m[at]:g}"
        return [str(states.label[at]), m, *(f"{value:.6f}" for value in numbers)]

    names = (
        "state",
        "M",
        f"E at {first:g} kV/cm (MHz)",
        f"E at {last:g} kV/cm (MHz)",
        "μ_eff there (D)",
        "⟨cosθ⟩ there",
    )
    return table_of_states(states, names, row)


def _along(direction: list[float]) -> str:
    x, _, z = direction
    if not x:
        return "along Z"
    import math

    return f"at {math.degrees(math.atan2(x, z)):g}° with Z"


def _facts(top: Top, content: dict[str, Any]) -> list[tuple[str, str]]:
    from rotor.reports import top_facts as report

    first, last, count = content["field_kv_per_cm"]
    facts = [
        ("constants", report.constants_text(top)),
        ("dipole", report.dipole_text(top)),
        ("field", f"{first:g} to {last:g} kV/cm {_along(content['field_direction'])}, {counted(count, 'value')}"),
    ]
    if content["intensity_w_per_cm2"]:
        facts.append(("laser", f"{content['intensity_w_per_cm2']:g} W/cm² along Z"))
    return [*facts, accuracy_fact(content)]
