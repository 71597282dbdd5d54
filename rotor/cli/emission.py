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
from rotor.cli.shared.observed_emission import ObservedOptions, Wanted, run_observed
from rotor.cli.shared.observed_options import SpectrumOptions
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
from rotor.cli.shared.save_scene import beside, molecule_of, save_made, save_scene_option
from rotor.reports.line_tables import the_first

if TYPE_CHECKING:
    from rotor.scenes.scene import EmissionScene
    from rotor.scenes.sections import MoleculeSection
    from rotor.spectra.emission import Source
    from rotor.spectra.emission_request import EmissionAnswer, EmissionRequest
    from rotor.spectra.emitters import CatalogueLines
    from rotor.tops.top import Top

EXAMPLES = """\b
Examples:
  rotor emission CO --range 115.1:115.4GHz --column 1e17 --excitation 20 --width 2
  rotor emission CH3CN HC3N SO2 --band ALMA6 --column 1e15,3e14,1e15 --excitation 100 --width 5 --plot core.png
  rotor emission HCN --range 88.62:88.64GHz --hyperfine --width 0.3 --excitation 10
  rotor emission CO --isotope C=13C --band ALMA3 --column 1e16 --excitation 10 --velocity 5.6 --csv co.csv
  rotor emission CO HCN --band ALMA3 --column 1e18,1e15 --excitation 40,10 --width 300 --redshift 2.3
  rotor emission c028503.cat --partition catdir.cat --band ALMA6 --column 1e16
  rotor emission CH3OH HCN --over spectrum.fits --column 1e16,1e14 --velocity 4 --plot pages.pdf
  rotor emission --fit spectrum.fits CH3OH CH3CN --catalogue lines.rotorcat --shared velocity,width"""

NAMES = {
    "columns_per_cm2": "--column", "column_per_cm2": "--column", "excitation_k": "--excitation", "background_k": "--background",
    "filling": "--filling", "velocity_km_s": "--velocity", "fwhm_km_s": "--width", "range_mhz": "--range",
    "least_depth": "--least-depth", "redshift": "--redshift",
}  # fmt: skip  # field of the request -> option
_OF_ONE = {
    "isotope": "--isotope", "spin_constants": "--spin-constants", "spins": "--spins", **inputs.STATES,
}  # fmt: skip  # what belongs to a single molecule


@dataclass(frozen=True)
class Options:
    """The molecules, the source, and what of it is looked at."""

    sources: list[str] | None = argument(
        None, metavar="SOURCE", help="Molecules: names, files, SMILES:..., .cat files of JPL and CDMS."
    )
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
    excitation: str = option(
        "100", metavar="T", help="Excitation temperature of rotation, one for all or one each (K)."
    )
    background: str = option("2.725", metavar="T", help="Temperature behind the source, as observed (K).")
    filling: float = option(1.0, metavar="F", help="Part of the beam that the source fills.")
    velocity: str = option(
        "0", metavar="V", help="Velocity, one for all or one each; receding positive, radio convention (km/s)."
    )
    redshift: float = option(0.0, metavar="Z", help="Redshift of the source; velocities count from there.")
    width: str = option(
        "1", metavar="W", help="Full width of the lines at half maximum, one for all or one each (km/s)."
    )
    partition: str | None = option(
        None, metavar="FILE", help="Q(T) of .cat files: a catdir.cat, or T=Q pairs: 300=108.87,75=27.46."
    )
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
    context: typer.Context,
    options: Options,
    observed: ObservedOptions,
    spectrum: SpectrumOptions,
    spins: HyperfineOptions,
    outputs: Outputs,
    picture: PlotOptions,
) -> None:
    """Brightness temperature of a source in local thermodynamic equilibrium; over, or fitted to, an observed spectrum."""
    one_thread_of_blas()
    require_whole("--top", options.top_lines, 0)
    if not options.sources:
        raise ValueError("SOURCE: expected one molecule or several, such as 'rotor emission CO HCN --band ALMA3'")
    files = Files.of(outputs)
    if observed.file is not None:
        if outputs.save_scene:
            raise ValueError(
                "--save-scene: an observed spectrum is no part of a scene; expected without --over and --fit"
            )
        with inputs.fields_as_options(**NAMES):
            run_observed(context, _wanted(context, options), observed, spectrum, files)
        return
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


def _wanted(context: typer.Context, options: Options) -> Wanted:
    """What was typed of the source; a fit estimates the rest."""
    typed = {
        name: getattr(options, name) if "DEFAULT" not in str(context.get_parameter_source(name)) else None
        for name in ("column", "excitation", "velocity", "width")
    }
    range_mhz = None if options.band is None and options.range_ is None else _range(options)
    return Wanted(
        sources=_sources(options),
        background=options.background,
        redshift=options.redshift,
        range_mhz=range_mhz,
        partition=options.partition,
        **typed,
    )


def _request(options: Options, spins: HyperfineOptions) -> EmissionRequest:
    from rotor.spectra.emission_request import EmissionRequest
    from rotor.tops.top import Top

    range_mhz, names = _range(options), _sources(options)
    for name, text in _OF_ONE.items():
        if getattr(options, name) and (len(names) > 1 or _is_catalogue(names[0])):
            raise ValueError(f"{text}: expected with a single molecule that is no catalogue")
    if options.partition is not None and not any(map(_is_catalogue, names)):
        raise ValueError("--partition: is Q(T) of .cat files, and none is among the molecules")
    sources = _layer(options, len(names))
    molecules = tuple(_molecule(each, options) for each in _inputs(options))
    tops = [molecule for molecule in molecules if isinstance(molecule, Top)]
    hamiltonians = iter(effects_of_each(tops, spins, options.spin_constants))
    effects = tuple(next(hamiltonians) if isinstance(each, Top) else () for each in molecules)
    return EmissionRequest(molecules, sources, range_mhz, options.least_depth, effects)


def _is_catalogue(source: str) -> bool:
    return source.lower().endswith((".cat", ".cat.gz"))


def _molecule(given: Input, options: Options) -> Top | CatalogueLines:
    """A top with a dipole, or the lines of a catalogue with Q(T)."""
    if not _is_catalogue(given.source or ""):
        return inputs.with_some_dipole(inputs.read_top(given))
    from rotor.formats.catalogue.cat_species import read_cat_with

    path = Path(given.source or "")
    if not path.is_file():
        raise ValueError(f"{path}: no such file")
    species = read_cat_with(path, options.partition)
    if "note" in species.identity:
        note(f"{path}: {species.identity['note']}; --partition states another")
    return species


def _inputs(options: Options) -> list[Input]:
    """Which molecules are meant."""
    of_one = {name: getattr(options, name) for name in _OF_ONE}
    return [Input(one, **of_one) for one in _sources(options)]


def _scene(request: EmissionRequest, options: Options, folder: Path) -> EmissionScene:
    """The scene that a file in a folder holds."""
    from rotor.scenes.kinds.emission import saved_molecules

    sections = [_saved_molecule(one, request, options, folder) for one in _inputs(options)]
    return saved_molecules(request, sections)


def _saved_molecule(given: Input, request: EmissionRequest, options: Options, folder: Path) -> MoleculeSection:
    """The molecule of the options, with Q(T) where it is a catalogue."""
    section = molecule_of(given, request, folder)
    if options.partition is None or not _is_catalogue(given.source or ""):
        return section
    from rotor.scenes.sections import EmittingMolecule

    fields = {name: getattr(section, name) for name in section.__struct_fields__}
    return EmittingMolecule(**fields, partition=beside(options.partition, folder))


def _sources(options: Options) -> list[str]:
    return options.sources or []


def _layer(options: Options, count: int) -> tuple[Source, ...]:
    """The source of each molecule; a single number counts for all."""
    from rotor.spectra.emission import Source

    columns, background = _columns(options.column), inputs.quantity("--background", options.background, "K")
    listed = {
        "--column": columns,
        "--excitation": _numbers("--excitation", options.excitation, "K"),
        "--width": _numbers("--width", options.width, ""),
        "--velocity": _numbers("--velocity", options.velocity, ""),
    }
    for name, values in listed.items():
        if len(values) not in (1, count):
            raise ValueError(f"{name}: {len(values)} given for {count} molecules; expected one for all or one for each")
    each = zip(*(values * count if len(values) == 1 else values for values in listed.values()), strict=True)
    return tuple(
        Source(column, excitation, width, velocity, background, options.filling, options.redshift)
        for column, excitation, width, velocity in each
    )


def _numbers(name: str, text: str, unit: str) -> tuple[float, ...]:
    """A comma list of numbers."""
    return tuple(inputs.quantity(name, item, unit) for item in text.split(","))


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

    request, layer = answer.request, answer.request.sources[0]
    print(
        f"{', '.join(request.names)}: brightness temperature, from {request.range_mhz[0]:.10g} to {request.range_mhz[1]:.10g} MHz"
    )
    behind = f"background {layer.background_k:g} K as observed, filling {layer.filling:g}"
    facts = [
        ("source", behind + (f", redshift {layer.redshift:g}" if layer.redshift else "")),
        ("lines", f"{len(answer.lines)}; velocities in the radio convention, v = c (1 - ν/ν_rest)"),
    ]
    for name, source, lines in zip(request.names, request.sources, answer.emitted, strict=True):
        gas = f"N = {source.column_per_cm2:.4g} /cm², T_ex = {source.excitation_k:g} K"
        motion = f"width {source.fwhm_km_s:g} km/s at {source.velocity_km_s:g} km/s"
        quanta = f"; upper, lower: {headings(lines.quanta)}" if lines.quanta else ""
        facts.append((name, f"{gas}, {motion}, Q = {lines.q:.6g}{quanta}"))
    for name, lines in zip(request.names, answer.emitted, strict=True):
        of_which = f"{name}: " if len(request.names) > 1 else ""
        facts += [(title, of_which + text) for title, text in hyperfine_lines(lines.hyperfine)]
    if (peak := answer.peak) is not None:
        line = f"{request.names[int(answer.lines.molecule[peak.row])]} {answer.lines.upper[peak.row]} – {answer.lines.lower[peak.row]}"
        facts.append(
            (
                "brightest" if peak.brightness_k >= 0 else "deepest",
                f"{peak.brightness_k:.4g} K at {peak.observed_mhz:.4f} MHz, {line}, τ = {peak.optical_depth:.3g}",
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
        f"{name}: {short_source(molecule.source)}" + ("" if lines.quanta else f", Q {lines.q_source}")
        for name, molecule, lines in zip(request.names, request.molecules, answer.emitted, strict=True)
    )
    show_facts([("sources", cited), *_limits(answer)])


def _limits(answer: EmissionAnswer) -> list[tuple[str, str]]:
    """What is left out: of the source, and the largest of each molecule."""
    from rotor.quantum.estimates.limits import model_limits, populated_j
    from rotor.reports.top_facts import with_option
    from rotor.tops.top import Top

    request = answer.request
    facts = [("left out", "departures from one excitation temperature; structure of the source in the beam")]
    for name, top, source, lines in zip(request.names, request.molecules, request.sources, answer.emitted, strict=True):
        if not isinstance(top, Top):
            continue
        limits = model_limits(top, populated_j(top, source.excitation_k), lines.effects)
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
