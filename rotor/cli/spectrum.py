"""`rotor spectrum`: the rotational lines of a molecule."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.shared import gas_layer as layer
from rotor.cli.shared import inputs
from rotor.cli.shared import spcat_request as request
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
    from rotor.cli.shared.gas_layer import Layer
    from rotor.formats.spcat.predict import Prediction
    from rotor.spectra.lines import Lines
    from rotor.spectra.spectrum import Spectrum
    from rotor.thermo import VibrationalStates
    from rotor.tops.top import Top

PROFILES = ("sticks", "gaussian", "lorentzian", "voigt")

EXAMPLES = """\b
Examples:
  rotor spectrum water
  rotor spectrum "SMILES:C=O" --temperature 100
  rotor spectrum my.xyz --dipole 0,0,1.85 --range 0:2000GHz --cat out.cat --csv out.csv --plot out.png
  rotor spectrum --constants "A=835840.288 B=435351.717 C=278138.7 MHz" --dipole-abc 0,1.8546,0 --jmax 20
  rotor spectrum case.int --cat case.cat"""


@dataclass(frozen=True)
class Settings:
    """What the options ask for, in the units of the package."""

    temperature_k: float
    jmax: int | None
    min_lgint: float | None
    range_mhz: tuple[float, float]
    q: float | None
    vibrational_factor: float
    profile: str
    fwhm_mhz: float | None
    vibrations: VibrationalStates | None = None
    gas: Layer | None = None


def command(
    context: typer.Context,
    source: str | None = inputs.SOURCE,
    constants: str | None = inputs.CONSTANTS,
    temperature: str = typer.Option("300", metavar="T", help="Temperature (K)."),
    jmax: int | None = typer.Option(None, metavar="N", help="Highest J; by default what the cut needs."),
    min_lgint: str = typer.Option("-12", metavar="X", help="Leave out lines with log10(nm² MHz) below; or 'none'."),
    range_: str | None = typer.Option(
        None, "--range", metavar="A:B", help="First and last frequency, such as 0:2000GHz (MHz)."
    ),
    dipole: str | None = inputs.DIPOLE,
    dipole_abc: str | None = inputs.DIPOLE_ABC,
    isotope: list[str] | None = inputs.ISOTOPE,
    spin_weights: str | None = inputs.SPIN_WEIGHTS,
    symmetry_tolerance: str | None = inputs.SYMMETRY_TOLERANCE,
    calculator: str | None = inputs.CALCULATOR,
    hessian: str | None = inputs.HESSIAN,
    q: float | None = typer.Option(None, metavar="Q", help="Partition function to use instead of the summed one."),
    vibrational_factor: float = typer.Option(1.0, metavar="X", help="Multiplies Q."),
    vibration: str | None = layer.VIBRATION,
    vibrational_states: str | None = layer.VIBRATIONAL_STATES,
    pressure: str | None = layer.PRESSURE,
    path: str | None = layer.PATH,
    profile: str | None = typer.Option(None, metavar="NAME", help="sticks, gaussian, lorentzian or voigt."),
    fwhm: str | None = typer.Option(None, metavar="W", help="Full width at half maximum (MHz); by default Doppler's."),
    cat: str | None = typer.Option(None, metavar="FILE", help="Write a catalogue of 80 columns (.cat, .cat.gz)."),
    csv: str | None = typer.Option(None, metavar="FILE", help="Write all lines as CSV."),
    parquet: str | None = typer.Option(None, metavar="FILE", help="Write all lines as Parquet."),
    profile_csv: str | None = typer.Option(None, metavar="FILE", help="Write the profile on its grid as CSV."),
    plot: str | None = typer.Option(None, metavar="FILE", help="Draw the spectrum (.png, .pdf, .svg)."),
    json: str | None = inputs.JSON,
    top_lines: int = typer.Option(20, "--top", metavar="N", help="How many of the strongest lines are shown."),
    tag: int = typer.Option(0, metavar="N", help="Tag of the species in --cat."),
) -> None:
    """Rotational lines: frequencies, intensities, and what they were made from."""
    gas = layer.layer(pressure, path)
    profile = profile or ("gaussian" if gas else None)
    settings = _settings(temperature, jmax, min_lgint, range_, q, vibrational_factor, profile, fwhm)
    settings = replace(settings, vibrations=layer.vibrations(vibration, vibrational_states), gas=gas)
    _refuse_contradictions(settings)
    inputs.whole("--top", top_lines, 0)
    inputs.whole("--tag", tag, 0, 999_999)
    files = _files(
        settings, {"--cat": cat, "--csv": csv, "--parquet": parquet, "--profile-csv": profile_csv, "--plot": plot}
    )
    files.ask_json(json)

    given = Input(
        source,
        constants,
        isotope or [],
        dipole,
        dipole_abc,
        spin_weights,
        calculator,
        hessian,
        symmetry_tolerance=symmetry_tolerance,
    )
    prediction = request.prediction_of(context, str(source)) if request.is_request(source) else None
    if prediction is not None:
        settings, tag = _requested(settings, prediction), prediction.request.tag
    top = prediction.lines.top if prediction else inputs.with_some_dipole(inputs.read_top(given))
    _refuse_doppler_without_mass(top, settings)
    with answering():
        lines = prediction.lines if prediction else _lines(top, settings)
        content = _content(lines, settings, given, context.obj, top_lines)
    _refuse_nothing_to_draw(lines, files)
    for warning in lines.warnings:
        note(warning)
    content["notes"] = [*content["notes"], *lines.warnings]

    content["files"] = [str(path) for path in files.wanted.values()]
    writers = _writers(lines, settings, content, tag)
    if prediction is not None:
        writers["--cat"] = _program_catalogue(prediction, content)
    deliver(files, writers, lambda: json_with_rows(lines, "lines", content), lambda: _show(lines, content))


def _refuse_contradictions(settings: Settings) -> None:
    if settings.vibrations is not None and settings.vibrational_factor != 1.0:
        raise ValueError("--vibrational-factor and vibrational energies: give one of them")
    if settings.gas is not None and settings.profile == "sticks":
        raise ValueError("--pressure: an optical depth needs a width, and sticks have none; choose another --profile")


def _files(settings: Settings, paths: dict[str, str | None]) -> Files:
    """The files asked for, each with a name of its format, and a use for what was said of the profile."""
    suffixes = {"--cat": (".cat", ".cat.gz"), "--parquet": (".parquet",), "--plot": (".png", ".pdf", ".svg")}
    files = Files()
    for name, path in paths.items():
        files.ask(name, path, suffixes.get(name, (".csv",)))
    if paths["--profile-csv"] and settings.profile == "sticks":
        raise ValueError(
            "--profile-csv: sticks have no profile; give --fwhm or --profile gaussian, lorentzian or voigt"
        )
    if settings.profile != "sticks" and not (settings.gas or paths["--profile-csv"] or paths["--plot"]):
        raise ValueError(
            f"a {settings.profile} profile was asked for, but not where to put it; add --plot or --profile-csv"
        )
    return files


def _refuse_doppler_without_mass(top: Top, settings: Settings) -> None:
    doppler = settings.profile == "voigt" or (settings.profile == "gaussian" and settings.fwhm_mhz is None)
    if doppler and top.mass_u is None:
        raise ValueError(
            "a Doppler width needs a mass, which constants alone do not have; give --fwhm, not --profile voigt"
        )


def _refuse_nothing_to_draw(lines: Lines, files: Files) -> None:
    drawn = [name for name in ("--plot", "--profile-csv") if name in files.wanted]
    if drawn and not len(lines):
        raise ComputationError(f"{drawn[0]}: no lines: {_why_none(lines)}")


def _settings(
    temperature: str,
    jmax: int | None,
    min_lgint: str,
    range_: str | None,
    q: float | None,
    vibrational_factor: float,
    profile: str | None,
    fwhm: str | None,
) -> Settings:
    """The options as numbers, each checked by itself."""
    from rotor.units import parse_range

    inputs.whole("--jmax", jmax, 0)
    if q is not None:
        inputs.above_zero("--q", q)
    profile = profile or ("gaussian" if fwhm else "sticks")
    if profile not in PROFILES:
        raise ValueError(f"--profile: {profile!r} is none of {', '.join(PROFILES)}")
    if profile == "sticks" and fwhm:
        raise ValueError("--fwhm: sticks have no width; leave it out or choose another --profile")
    if profile in ("lorentzian", "voigt") and not fwhm:
        raise ValueError(f"--profile {profile}: the width of the Lorentzian is wanted, --fwhm")
    return Settings(
        temperature_k=inputs.positive("--temperature", temperature, "K"),
        jmax=jmax,
        min_lgint=inputs.cut("--min-lgint", min_lgint),
        range_mhz=(0.0, math.inf)
        if range_ is None
        else inputs.option("--range", range_, lambda r: parse_range(r, "MHz")),
        q=q,
        vibrational_factor=inputs.above_zero("--vibrational-factor", vibrational_factor),
        profile=profile,
        fwhm_mhz=inputs.positive("--fwhm", fwhm, "MHz") if fwhm else None,
    )


def _requested(settings: Settings, prediction: Prediction) -> Settings:
    """The settings that an .int file makes."""
    wanted = prediction.request
    return replace(
        settings,
        temperature_k=wanted.temperature_k,
        jmax=wanted.fend,
        min_lgint=wanted.str0,
        range_mhz=prediction.lines.range_mhz,
        q=prediction.q,
    )


def _program_catalogue(prediction: Prediction, content: dict[str, Any]) -> Writer:
    """The catalogue as the field's program lists it: its weights, its zero of energy, K doublets parted."""
    from rotor.formats.line_tables import provenance, write_beside
    from rotor.formats.spcat.cat import write_cat

    def write(path: Path) -> None:
        write_cat(prediction.catalogue, path)
        record = provenance(prediction.lines) | {"command": content["command"], "input": content["input"]}
        write_beside(path, record | {"q": prediction.q, "lines": len(prediction.catalogue)})

    return write


def _lines(top: Top, settings: Settings) -> Lines:
    from rotor.spectra.lines import line_list

    if top.dipole_abc_debye is None:  # a spherical top: it has no lines, whatever the dipole
        top = top.with_dipole((0.0, 0.0, 0.0), "none: a rigid spherical top has no rotational lines")
    return line_list(
        top,
        temperature_k=settings.temperature_k,
        jmax=settings.jmax,
        min_lgint=settings.min_lgint,
        range_mhz=settings.range_mhz,
        q=settings.q,
        vibrational_factor=settings.vibrational_factor,
        vibrations=settings.vibrations,
    )


def _content(lines: Lines, settings: Settings, given: Input, command: str, shown: int) -> dict[str, Any]:
    """What is printed and more, by the keys of docs/command_line.md."""
    import numpy as np

    from rotor.cli.shared.report import describe, q_record
    from rotor.thermo import classical_partition_function

    q = q_record(lines.partition, classical_partition_function(lines.top, lines.temperature_k))
    strongest = np.sort(np.argsort(-lines.intensity_nm2_mhz, kind="stable")[:shown])
    return {
        **describe(lines.top, given.text, command),
        "temperature_k": lines.temperature_k,
        "q": q,
        "jmax": lines.jmax,
        "jmax_source": "given" if settings.jmax is not None else _reach(settings.min_lgint),
        "min_lgint": settings.min_lgint,
        "range_mhz": lines.range_mhz,
        "line_count": len(lines),
        "profile": settings.profile,
        "fwhm_mhz": settings.fwhm_mhz,
        **layer.depths(lines, settings.gas, settings.profile, settings.fwhm_mhz),
        "strongest": strongest,
    }


def _reach(min_lgint: float | None) -> str:
    if min_lgint is None:
        return "beyond it no line reaches an lgint of -12"
    return "beyond it no line reaches the cut"


def _writers(lines: Lines, settings: Settings, content: dict[str, Any], tag: int) -> dict[str, Writer]:
    """How each option's file is written, with the provenance that its format can hold."""
    import rotor

    record = {"command": content["command"], "input": content["input"], "tag": tag}

    def table(path: Path) -> None:
        rotor.write(lines, path, settings=record)

    return {
        "--cat": table,
        "--csv": table,
        "--parquet": table,
        "--profile-csv": lambda path: rotor.write(
            _spectrum(lines, settings), path, settings={"command": record["command"]}
        ),
        "--plot": lambda path: _draw(lines, settings, path, record),
    }


def _spectrum(lines: Lines, settings: Settings) -> Spectrum:
    """The lines with their shape, on a grid that follows each of them."""
    from rotor.spectra.spectrum import Spectrum, resolving_grid

    first, last = settings.range_mhz
    shape: dict[str, Any] = {"profile": settings.profile, "fwhm_mhz": settings.fwhm_mhz}
    grid = resolving_grid(lines, range_mhz=(first, last) if math.isfinite(last) else None, **shape)
    spectrum = Spectrum.from_lines(lines, grid, **shape)
    if settings.gas is None:
        return spectrum
    from rotor.spectra.opacity import optical_depth

    return optical_depth(spectrum, settings.gas.pressure_bar, settings.gas.path_cm)


def _draw(lines: Lines, settings: Settings, path: Path, record: dict[str, Any]) -> None:
    from rotor.plots.spectrum import plot_spectrum

    sticks = settings.profile == "sticks"
    plot_spectrum(lines if sticks else _spectrum(lines, settings), path, provenance={"command": record["command"]})


def _show(lines: Lines, content: dict[str, Any]) -> None:
    from rotor.cli.shared.report import heading

    print(heading(lines.top))
    show_facts(_facts(lines, content))
    if len(lines) == 0:
        print(f"\nno lines: {_why_none(lines)}")
        return
    if len(content["strongest"]):
        print()
        show_table(_lines_table(lines, content["strongest"], content["optical_depth"]))


def _facts(lines: Lines, content: dict[str, Any]) -> list[tuple[str, str]]:
    from rotor.cli.shared import report

    top = lines.top
    cut = "none: every allowed line" if content["min_lgint"] is None else f"lgint above {content['min_lgint']:g}"
    weights = report.weights_text(content["spin_weights"])
    dipole = report.vector_text(top.dipole_abc_debye)
    return [
        ("constants", report.with_source(report.constants_text(top), top.source)),
        ("dipole", report.with_source(dipole, top.dipole_source)),
        ("spin weights", report.with_source(weights, top.weights_source)),
        ("temperature", f"{lines.temperature_k:g} K"),
        ("Q", report.q_text(content["q"])),
        ("J max", f"{lines.jmax}: {content['jmax_source']}"),
        ("cut", cut + _range_text(lines.range_mhz)),
        ("lines", _count_text(lines)),
        *_layer_facts(content),
    ]


def _layer_facts(content: dict[str, Any]) -> list[tuple[str, str]]:
    if content["column_per_cm2"] is None:
        return []
    width = "Doppler's width" if content["fwhm_mhz"] is None else f"FWHM {content['fwhm_mhz']:g} MHz"
    layer_text = (
        f"{content['pressure_bar']:g} bar, {content['path_cm']:g} cm: {content['column_per_cm2']:.6g} molecules/cm²"
    )
    return [("layer", f"{layer_text}; optical depths τ at line centres, {content['profile']} profile, {width}")]


def _range_text(range_mhz: tuple[float, float]) -> str:
    first, last = range_mhz
    if first <= 0 and math.isinf(last):
        return ""
    return f", from {first:g} to {last:g} MHz"


def _count_text(lines: Lines) -> str:
    if not len(lines):
        return "none"
    return f"{len(lines)}, from {lines.frequency_mhz[0]:.4f} to {lines.frequency_mhz[-1]:.4f} MHz"


def _why_none(lines: Lines) -> str:
    if lines.top.kind == "spherical":
        return "a rigid spherical top has none (neither field nor distortion dipole is taken in)"
    if not any(lines.top.dipole_abc_debye or ()):
        return "without a permanent dipole there is no rotational absorption"
    return "none of the allowed ones is inside the range and above the cut; widen --range or lower --min-lgint"


def _lines_table(lines: Lines, rows: Any, depth: Any = None) -> Table:
    """The strongest lines in order of frequency, with their optical depths where there is a layer of gas."""
    shown = lines.where(rows)
    names = " ".join(name.capitalize() for name in lines.quanta_names)
    columns: tuple[str, ...] = ("frequency (MHz)", "lgint", 'E" (cm-1)', "g'", "A (1/s)", "Sμ² (D²)", "upper", "lower")
    formats = ("{:.4f}", "{:.4f}", "{:.4f}", "{}", "{:.2e}", "{:.5g}")
    numbers = list(shown.columns.values())[: len(formats)]
    labels = [
        [" ".join(f"{n:2d}" for n in quanta) for quanta in shown.quanta(states)]
        for states in (shown.upper, shown.lower)
    ]
    cells = [[form.format(x) for x in column] for form, column in zip(formats, numbers, strict=True)]
    if depth is not None:
        columns = (*columns[: len(formats)], "τ", *columns[len(formats) :])
        cells.append([f"{x:.3e}" for x in depth[rows]])
    title = f"the {len(shown)} strongest lines" if len(shown) < len(lines) else "all lines"
    return Table(f"{title}, in order of frequency (states: {names})", columns, list(zip(*cells, *labels, strict=True)))
