"""`rotor emission`: lines as a radio telescope sees them, of one or several molecules in one source."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.checks import require_whole
from rotor.cli.shared import inputs, plot_options
from rotor.cli.shared.hyperfine import HyperfineOptions, effects_of_each, hyperfine_lines
from rotor.cli.shared.inputs import Input, json_option
from rotor.cli.shared.options import argument, file_option, grouped, option
from rotor.cli.shared.output import (
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
from rotor.cli.shared.plot_options import PlotOptions
from rotor.cli.shared.process import one_thread_of_blas
from rotor.cli.shared.save_scene import molecule_of, save_made, save_scene_option
from rotor.reports.line_tables import the_first

if TYPE_CHECKING:
    from rotor.scenes.scene import EmissionScene
    from rotor.spectra.emission import Source
    from rotor.spectra.emission_request import EmissionAnswer, EmissionRequest

EXAMPLES = """\b
Examples:
  rotor emission CO --range 115.1:115.4GHz --column 1e17 --excitation 20 --width 2
  rotor emission CH3CN HC3N SO2 --band ALMA6 --column 1e15,3e14,1e15 --excitation 100 --width 5 --plot core.png
  rotor emission HCN --range 88.62:88.64GHz --hyperfine --width 0.3 --excitation 10
  rotor emission CO --isotope C=13C --band ALMA3 --column 1e16 --excitation 10 --velocity 5.6 --csv co.csv"""

NAMES = {
    "columns_per_cm2": "--column", "column_per_cm2": "--column", "excitation_k": "--excitation", "background_k": "--background",
    "filling": "--filling", "velocity_km_s": "--velocity", "fwhm_km_s": "--width", "range_mhz": "--range",
    "least_depth": "--least-depth",
}  # fmt: skip  # field of the request -> option
_OF_ONE = {
    "isotope": "--isotope", "spin_constants": "--spin-constants", "spins": "--spins", **inputs.STATES,
}  # fmt: skip  # what belongs to a single molecule


@dataclass(frozen=True)
class Options:
    """The molecules, the source, and what of it is looked at."""

    sources: list[str] | None = argument(None, metavar="SOURCE", help="Molecules: names, files, SMILES:...")
    isotope: list[str] | None = option(
        None, metavar="1=2H", help="Another isotope, by atom number or element, of a single molecule; repeatable."
    )
    spin_constants: str | None = option(
        None, metavar="TEXT", help='Constants of spins, of a single molecule: "chi_aa(14N)=-4.22 MHz" (MHz).'
    )
    spins: str | None = option(
        None, metavar="LIST", help='Sizes and order of its spins: "S=1/2 14N"; "35Cl_1+35Cl_2" have a total spin.'
    )
    state_constants: str | None = option(
        None, metavar="TEXT", help='Further states of a single molecule: "E[1]=120GHz B[1]=... W[0,1]=3 MHz" (MHz).'
    )
    state_dipoles: str | None = option(
        None, metavar="TEXT", help='Its dipoles in and between states, axes a, b, c: "[0,1] 0,0,1.47" (D).'
    )
    state_weights: str | None = option(
        None, metavar="TEXT", help='Its spin weights of states: "[0] even=1,odd=3 [1] even=3,odd=1".'
    )
    state_symmetry: str | None = option(
        None, metavar="GROUP", help="Group of its states, whose couplings are checked by it: C2v, Cs(ab), ..."
    )
    state_names: str | None = option(None, metavar="LIST", help="Names of all its states, from 0 on: 0+,0-.")
    column: str = option("1e14", metavar="N", help="Column density, one for all or one each: 1e14,3e13 (1/cm²).")
    excitation: str = option("100", metavar="T", help="Excitation temperature of rotation (K).")
    background: str = option("2.725", metavar="T", help="Temperature behind the source (K).")
    filling: float = option(1.0, metavar="F", help="Part of the beam that the source fills.")
    velocity: float = option(0.0, metavar="V", help="Of the source, receding positive, radio convention (km/s).")
    width: float = option(1.0, metavar="W", help="Full width of the lines at half maximum (km/s).")
    band: str | None = option(None, metavar="NAME", help="A receiver's band instead of --range: ALMA1 to ALMA10.")
    range_: str | None = option(None, "--range", metavar="A:B", help="First and last frequency observed (MHz).")
    least_depth: float = option(1e-6, metavar="X", help="Leave out lines of less optical depth.")
    top_lines: int = option(20, "--top", metavar="N", help="How many of the brightest lines are shown.")


@dataclass(frozen=True)
class Outputs:
    """Files to write."""

    csv: str | None = file_option(".csv", help="Write the lines as CSV.")
    parquet: str | None = file_option(".parquet", help="Write the lines as Parquet.")
    profile_csv: str | None = file_option(".csv", help="Write T_B and optical depth on the grid as CSV.")
    plot: str | None = file_option(".png", ".pdf", ".svg", help="Draw T_B of every molecule (.png, .pdf, .svg).")
    json: str | None = json_option()
    save_scene: str | None = save_scene_option()


@grouped()
def command(
    context: typer.Context, options: Options, spins: HyperfineOptions, outputs: Outputs, picture: PlotOptions
) -> None:
    """Brightness temperature of a source in local thermodynamic equilibrium."""
    one_thread_of_blas()
    require_whole("--top", options.top_lines, 0)
    if not options.sources:
        raise ValueError("SOURCE: expected one molecule or several, such as 'rotor emission CO HCN --band ALMA3'")
    files = Files.of(outputs)
    drawn = plot_options.settings_of(picture, files)
    with inputs.fields_as_options(**NAMES):
        request = _request(options, spins)
    from rotor.spectra.emission_request import answer_emission

    with answering():
        answer = answer_emission(request)
        content = _content(answer, options, context.obj)
    for text in answer.notes:
        note(text)
    content["files"] = files.names
    show = lambda: _show(answer, options.top_lines)  # noqa: E731
    writers = _writers(answer, content, drawn) | save_made(lambda folder: _scene(request, options, folder), outputs)
    deliver(files, writers, lambda: json_with_rows(answer.lines, "lines", content), show)


def _request(options: Options, spins: HyperfineOptions) -> EmissionRequest:
    from rotor.spectra.emission_request import EmissionRequest

    source, range_mhz = _source(options), _range(options)
    for name, text in _OF_ONE.items():
        if getattr(options, name) and len(_sources(options)) > 1:
            raise ValueError(f"{text}: expected with a single molecule; which of several is meant is not said")
    tops = tuple(inputs.with_some_dipole(inputs.read_top(one)) for one in _inputs(options))
    columns = _columns(options.column)
    if len(columns) == 1:
        columns *= len(tops)
    effects = effects_of_each(tops, spins, options.spin_constants)
    return EmissionRequest(tops, columns, source, range_mhz, options.least_depth, effects)


def _inputs(options: Options) -> list[Input]:
    """Which molecules are meant."""
    of_one = {name: getattr(options, name) for name in _OF_ONE}
    return [Input(one, **of_one) for one in _sources(options)]


def _scene(request: EmissionRequest, options: Options, folder: Path) -> EmissionScene:
    """The scene that a file in a folder holds."""
    from rotor.scenes.kinds.emission import saved_molecules

    return saved_molecules(request, [molecule_of(one, request, folder) for one in _inputs(options)])


def _sources(options: Options) -> list[str]:
    return options.sources or []


def _source(options: Options) -> Source:
    from rotor.spectra.emission import Source

    return Source(
        column_per_cm2=_columns(options.column)[0],
        excitation_k=inputs.positive("--excitation", options.excitation, "K"),
        fwhm_km_s=options.width,
        velocity_km_s=options.velocity,
        background_k=inputs.quantity("--background", options.background, "K"),
        filling=options.filling,
    )


def _columns(text: str) -> tuple[float, ...]:
    from rotor.units import parse_quantity

    bare = text.replace("cm-2", "").replace("cm^-2", "").replace("/cm2", "").replace("1/cm²", "")
    return inputs.parsed("--column", bare, lambda t: tuple(parse_quantity(item, "") for item in t.split(",")))


def _range(options: Options) -> tuple[float, float]:
    from rotor.spectra.emission import band_mhz
    from rotor.units import parse_range

    if (options.band is None) == (options.range_ is None):
        raise ValueError("--range or --band: expected one of them, such as --range 86:116GHz or --band ALMA3")
    if options.band is not None:
        return inputs.parsed("--band", options.band, band_mhz)
    return inputs.parsed("--range", options.range_ or "", lambda text: parse_range(text, "MHz"))


def _content(answer: EmissionAnswer, options: Options, command: str) -> dict[str, Any]:
    """What is printed and more, by the keys of docs/command_line.md."""
    from rotor.reports.top_facts import begin

    return {**begin(command, " ".join(_sources(options))), **answer.facts()}


def _writers(answer: EmissionAnswer, content: dict[str, Any], drawn: dict[str, Any]) -> dict[str, Writer]:
    import rotor

    keys = ("command", "input", "molecules", "source", "range_mhz")
    record = {key: content[key] for key in keys}

    def draw(path: Path) -> None:
        """The picture as a file."""
        from rotor.plots.emission import plot_emission

        plot_emission(answer, path, provenance=record, **drawn)

    return {
        "--csv": lambda path: rotor.write(answer.lines, path, settings=record),
        "--parquet": lambda path: rotor.write(answer.lines, path, settings=record),
        "--profile-csv": lambda path: rotor.write(answer.spectrum, path, settings=record),
        "--plot": draw,
    }


def _show(answer: EmissionAnswer, shown: int) -> None:
    from rotor.quantum.quanta import headings
    from rotor.reports.sources import short_source

    request, source = answer.request, answer.request.source
    print(
        f"{', '.join(request.names)}: brightness temperature, from {request.range_mhz[0]:.10g} to {request.range_mhz[1]:.10g} MHz"
    )
    behind = f"background {source.background_k:g} K, filling {source.filling:g}"
    facts = [
        ("excitation", f"{source.excitation_k:g} K; {behind}"),
        (
            "lines",
            f"{len(answer.lines)}, {source.fwhm_km_s:g} km/s wide, source at {source.velocity_km_s:g} km/s (radio convention)",
        ),
    ]
    each = zip(request.names, request.columns_per_cm2, answer.partition_functions, answer.quanta, strict=True)
    for name, column, q, quanta in each:
        facts.append((name, f"N = {column:.4g} /cm², Q = {q:.6g}; upper, lower: {headings(quanta)}"))
    for name, used in zip(request.names, answer.hyperfine, strict=True):
        of_which = f"{name}: " if len(request.names) > 1 else ""
        facts += [(title, of_which + text) for title, text in hyperfine_lines(used)]
    if len(answer.lines):
        at, peak = answer.spectrum.brightness_k.argmax(), answer.spectrum
        facts.append(
            (
                "brightest",
                f"{peak.brightness_k[at]:.4g} K at {peak.frequency_mhz[at]:.4f} MHz, τ = {peak.optical_depth[at]:.3g}",
            )
        )
    show_facts(facts)
    if not len(answer.lines):
        print("\nno lines: none is inside the range and deep enough; widen --range or lower --least-depth")
    elif shown:
        print()
        show_table(_table(answer, shown))
    print()
    cited = "; ".join(
        f"{name}: {short_source(top.source)}" for name, top in zip(request.names, request.tops, strict=True)
    )
    show_facts([("sources", cited), *_limits(answer)])


def _limits(answer: EmissionAnswer) -> list[tuple[str, str]]:
    """What is left out: of the source, and the largest of each molecule."""
    from rotor.quantum.estimates.limits import model_limits, populated_j
    from rotor.reports.top_facts import with_option

    request = answer.request
    facts = [("left out", "departures from one excitation temperature; structure of the source in the beam")]
    for name, top, effects in zip(request.names, request.tops, answer.effects, strict=True):
        limits = model_limits(top, populated_j(top, request.source.excitation_k), effects)
        facts += [("", f"{name}: {with_option(limit.sentence, 'rotor emission')}") for limit in limits[:1]]
    return facts


def _table(answer: EmissionAnswer, shown: int) -> Table:
    """The brightest lines, in order of frequency."""
    import numpy as np

    lines, names = answer.lines, answer.request.names
    rows = np.sort(np.argsort(-lines.brightness_k, kind="stable")[:shown]).tolist()
    cells = [
        (
            names[lines.molecule[i]],
            f"{lines.frequency_mhz[i]:.4f}",
            f"{lines.observed_mhz[i]:.4f}",
            lines.upper[i],
            lines.lower[i],
            f"{lines.energy_upper_k[i]:.2f}",
            f"{lines.einstein_a_per_s[i]:.2e}",
            str(lines.g_upper[i]),
            f"{lines.optical_depth[i]:.3g}",
            f"{lines.brightness_k[i]:.4g}",
            f"{lines.integrated_k_km_s[i]:.4g}",
        )
        for i in rows
    ]
    title = the_first(len(rows), "brightest line") if len(rows) < len(lines) else "all lines"
    columns = (
        "molecule", "at rest (MHz)", "observed (MHz)", "upper", "lower", "E_u (K)", "A (1/s)", "g_u", "τ", "T_B (K)", "∫T_B dv (K km/s)",
    )  # fmt: skip
    return Table(f"{title}, in order of frequency; each by itself", columns, cells, frozenset({"molecule"}))
