"""`rotor spectrum`: the rotational lines of a molecule."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.checks import require_whole
from rotor.cli.shared import gas_layer, inputs, plot_options
from rotor.cli.shared import spcat_request as spcat
from rotor.cli.shared.gas_layer import Layer, Vibration
from rotor.cli.shared.hyperfine import HyperfineOptions, effects_asked, hyperfine_lines
from rotor.cli.shared.inputs import Input, json_option
from rotor.cli.shared.options import file_option, grouped, option
from rotor.cli.shared.output import (
    ComputationError,
    Files,
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
from rotor.cli.shared.save_scene import save_scene, save_scene_option
from rotor.reports.line_tables import lines_table, pattern_records, patterns_table
from rotor.reports.sources import source_facts

if TYPE_CHECKING:
    from rotor.formats.spcat.predict import Prediction
    from rotor.formats.spcat.text.egy import LevelList
    from rotor.spectra.lines import Lines
    from rotor.spectra.request import SpectrumAnswer, SpectrumRequest
    from rotor.tops.top import Top

MOST_FACTS_OF_STATES = 10  # in the head of a list of lines; rotor info has all

EXAMPLES = """\b
Examples:
  rotor spectrum water
  rotor spectrum "SMILES:C=O" --temperature 100
  rotor spectrum my.xyz --dipole 0,0,1.85 --range 0:2000GHz --cat out.cat --csv out.csv --plot out.png
  rotor spectrum --constants "A=835840.288 B=435351.717 C=278138.7 MHz" --dipole-abc 0,1.8546,0 --jmax 20
  rotor spectrum case.int --cat case.cat"""

NAMES = {
    "temperature_k": "--temperature", "jmax": "--jmax", "min_lgint": "--min-lgint", "range_mhz": "--range", "q": "--q",
    "vibrational_factor": "--vibrational-factor", "profile": "--profile",
    "fwhm_mhz": "--fwhm",
}  # fmt: skip  # field of the request -> option


@dataclass(frozen=True)
class Options:
    """What is computed, and how much of it is shown."""

    temperature: str | None = option(None, metavar="T", help="Temperature (K); by default 300, with --hitran 296.")
    jmax: int | None = option(None, metavar="N", help="Highest J; by default what the cut needs.")
    min_lgint: str = option("-12", metavar="X", help="Leave out lines with log10(nm² MHz) below; or 'none'.")
    range_: str | None = option(
        None, "--range", metavar="A:B", help="First and last frequency, such as 0:2000GHz (MHz)."
    )
    q: float | None = option(None, metavar="Q", help="Partition function to use instead of the summed one.")
    vibrational_factor: float = option(1.0, metavar="X", help="Multiplies Q.")
    profile: str | None = option(None, metavar="NAME", help="sticks, gaussian, lorentzian or voigt.")
    fwhm: str | None = option(None, metavar="W", help="Full width at half maximum (MHz); by default Doppler's.")
    untrusted: bool = option(False, "--untrusted", help="List lines of levels beyond the reach of the constants too.")
    resolution: str | None = option(
        None, metavar="D", help="Show components of one rotational line that are closer (MHz) as one line."
    )
    as_spcat: bool = option(
        False, "--as-spcat", help="Of an .int file: SPCAT's own numbers also where the program errs (notes say where)."
    )
    full_basis: bool = option(
        False, "--full-basis", help="Of an .int file: every K is in the basis, whatever KNMIN and KNMAX say."
    )
    top_lines: int = option(20, "--top", metavar="N", help="How many of the strongest lines are shown.")
    tag: int = option(0, metavar="N", help="Tag of the species in --cat.")


@dataclass(frozen=True)
class Outputs:
    """Files to write."""

    cat: str | None = file_option(".cat", ".cat.gz", help="Write a catalogue of 80 columns (.cat, .cat.gz).")
    hitran: str | None = file_option(".hitran", help="Write HITRAN records of 160 characters; with --hitran-id.")
    hitran_id: str | None = option(
        None, metavar="M:I", help="HITRAN's numbers of molecule and isotopologue, such as 5:1."
    )
    egy: str | None = file_option(".egy", help="Of an .int file: write its levels as SPCAT's list (.egy).")
    csv: str | None = file_option(".csv", help="Write all lines as CSV.")
    parquet: str | None = file_option(".parquet", help="Write all lines as Parquet.")
    profile_csv: str | None = file_option(".csv", help="Write the profile on its grid as CSV.")
    plot: str | None = file_option(".png", ".pdf", ".svg", help="Draw the spectrum (.png, .pdf, .svg).")
    json: str | None = json_option()
    save_scene: str | None = save_scene_option()


@grouped()
def command(
    context: typer.Context,
    given: Input,
    options: Options,
    spins: HyperfineOptions,
    vibration: Vibration,
    layer: Layer,
    outputs: Outputs,
    picture: PlotOptions,
) -> None:
    """Rotational lines: frequencies, intensities, and what they were made from."""
    one_thread_of_blas(options.jmax)
    require_whole("--top", options.top_lines, 0)
    require_whole("--tag", options.tag, 0, 999_999)
    files, shape = Files.of(outputs), _shape(options, layer)
    resolution = inputs.positive("--resolution", options.resolution, "MHz") if options.resolution else None
    drawn = plot_options.settings_of(picture, files)
    settings = {
        **_settings(options, "296" if outputs.hitran else "300"),
        "vibrations": gas_layer.vibrations_of(vibration),
        **shape,
    }
    _refuse_profile_without_file(settings, files)
    hitran = _hitran_numbers(outputs, settings["temperature_k"])

    prediction = spcat.prediction_asked(context, given.source, options.as_spcat, options.full_basis)
    if prediction is None and outputs.egy is not None:
        raise ValueError("--egy: expected with an .int file; levels of anything else are written by rotor levels --egy")
    with inputs.fields_as_options(**NAMES):
        if prediction is not None:
            answer, tag = spcat.answer_of(prediction, shape), prediction.request.tag
        else:
            top = inputs.with_some_dipole(inputs.read_top(given))
            settings |= {"effects": effects_asked(top, spins, given.spin_constants)}
            answer, tag = _answer(top, settings), options.tag
    _refuse_nothing_to_draw(answer, files, options.range_)
    for warning in answer.lines.warnings:
        note(warning)
    with answering():
        content = _content(answer, given, context.obj, options.top_lines)
        content["patterns"] = (
            None if resolution is None else pattern_records(answer.lines, resolution, options.top_lines)
        )
    content["files"] = files.names

    writers = _writers(answer, content, {"tag": tag, **hitran}, drawn)
    writers |= save_scene("spectrum", answer.request, outputs, given, tag=tag)
    if prediction is not None:
        levels = partial(
            _levels, prediction, str(given.source), as_spcat=options.as_spcat, full_basis=options.full_basis
        )
        writers |= _program_files(prediction, content, levels, files)
    deliver(
        files,
        writers,
        lambda: json_with_rows(answer.lines, "lines", content),
        lambda: _show(answer, content, options.range_, given.sources),
    )


def _settings(options: Options, usual_k: str) -> dict[str, Any]:
    """Fields of the request from the texts of the options; usual_k: the temperature where none is given."""
    from rotor.units import parse_range

    def whole_range(text: str) -> tuple[float, float]:
        """First and last frequency in MHz."""
        return parse_range(text, "MHz")

    settings: dict[str, Any] = {
        "temperature_k": inputs.positive(
            "--temperature", usual_k if options.temperature is None else options.temperature, "K"
        ),
        "jmax": options.jmax,
        "min_lgint": inputs.cut("--min-lgint", options.min_lgint),
        "q": options.q,
        "untrusted": options.untrusted,
        "vibrational_factor": options.vibrational_factor,
    }
    if options.range_ is not None:
        settings["range_mhz"] = inputs.parsed("--range", options.range_, whole_range)
    return settings


def _shape(options: Options, layer: Layer) -> dict[str, Any]:
    """Profile, width and layer of gas from the texts of the options."""
    fwhm = inputs.positive("--fwhm", options.fwhm, "MHz") if options.fwhm else None
    return {"profile": options.profile, "fwhm_mhz": fwhm, "layer": gas_layer.layer_of(layer)}


def _answer(top: Top, settings: dict[str, Any]) -> SpectrumAnswer:
    from rotor.spectra.request import SpectrumRequest, answer_spectrum

    request: SpectrumRequest = SpectrumRequest(top, **settings)
    with answering():
        return answer_spectrum(request)


def _hitran_numbers(outputs: Outputs, temperature_k: float) -> dict[str, int]:
    """HITRAN's numbers of the molecule and of the isotopologue, which begin its records."""
    if (outputs.hitran is None) != (outputs.hitran_id is None):
        raise ValueError(
            "--hitran and --hitran-id: give both; the second has HITRAN's number of the molecule, such as 5 or 5:1 of CO"
        )
    if outputs.hitran is None:
        return {}
    words = (outputs.hitran_id or "").split(":")
    if len(words) > 2 or not all(word.isdecimal() and 0 < int(word) < 100 for word in words):
        raise ValueError(
            f"--hitran-id: {outputs.hitran_id!r}: expected HITRAN's number of the molecule, such as 5 or 5:1"
        )
    if temperature_k != 296.0:
        raise ValueError("--hitran: its intensities are those at 296 K; leave --temperature out, or give 296")
    return {"molecule": int(words[0]), "isotopologue": int(words[1]) if len(words) == 2 else 1}


def _refuse_profile_without_file(settings: dict[str, Any], files: Files) -> None:
    """A profile needs a file that it goes to, and a file for the profile needs one."""
    shaped = settings["profile"] not in (None, "sticks") or settings["fwhm_mhz"] is not None
    if "--profile-csv" in files.paths and not (shaped or settings["layer"]):
        raise ValueError(
            "--profile-csv: sticks have no profile; give --fwhm or --profile gaussian, lorentzian or voigt"
        )
    if shaped and not (settings["layer"] or {"--profile-csv", "--plot"} & files.paths.keys()):
        what = settings["profile"] or "gaussian"
        raise ValueError(f"a {what} profile was asked for, but no file for it; add --plot or --profile-csv")


def _refuse_nothing_to_draw(answer: SpectrumAnswer, files: Files, range_text: str | None) -> None:
    drawn = [name for name in ("--plot", "--profile-csv") if name in files.paths]
    if drawn and answer.why_no_lines:
        raise ComputationError(f"{drawn[0]}: no lines: {_why_none(answer, range_text)}")


def _why_none(answer: SpectrumAnswer, range_text: str | None = None) -> str:
    reason = answer.why_no_lines.replace("the range or lower the cut", "--range or lower --min-lgint")
    if range_text is None or inputs.has_unit(range_text):
        return reason
    return f"{reason}; --range {range_text} has no unit, so it is MHz: write {range_text}GHz for GHz"


def _program_files(
    prediction: Prediction, content: dict[str, Any], levels: Callable[[], LevelList], files: Files
) -> dict[str, Writer]:
    """How the files are written that SPCAT writes itself: the catalogue, and the levels where they are asked for."""
    writers = {"--cat": _program_catalogue(prediction, content)}
    if "--egy" in files.paths:
        with answering():
            writers["--egy"] = _program_levels(prediction, content, levels())
    return writers


def _program_catalogue(prediction: Prediction, content: dict[str, Any]) -> Writer:
    """The catalogue as SPCAT lists it: its weights, its zero of energy, K doublets as two lines."""
    from rotor.formats.provenance import record_of, write_beside
    from rotor.formats.spcat.text.cat import write_cat

    def write(path: Path) -> None:
        """The file, with what it was made from."""
        write_cat(prediction.catalogue, path)
        record = record_of(prediction.lines, {"command": content["command"], "input": content["input"]})
        write_beside(path, record | {"q": prediction.q, "lines": len(prediction.catalogue)})

    return write


def _levels(prediction: Prediction, source: str, **basis: bool) -> LevelList:
    """The levels as SPCAT lists them."""
    from rotor.formats.spcat.predict import levels_of_file

    listed = prediction.levels
    return levels_of_file(source, **basis) if listed is None else listed


def _program_levels(prediction: Prediction, content: dict[str, Any], levels: LevelList) -> Writer:
    """What writes the levels as SPCAT lists them; they are computed before any file is begun."""
    from rotor.formats.provenance import record_of, write_beside
    from rotor.formats.spcat.text.egy import write_egy

    def write(path: Path) -> None:
        """The file, with what it was made from."""
        write_egy(levels, path)
        record = record_of(prediction.lines, {"command": content["command"], "input": content["input"]})
        write_beside(path, record | {"levels": len(levels)})

    return write


def _content(answer: SpectrumAnswer, given: Input, command: str, shown: int) -> dict[str, Any]:
    """What is printed and more, by the keys of docs/command_line.md."""
    from rotor.reports.top_facts import begin

    return {**begin(command, given.text), **answer.facts(), "strongest": answer.strongest(shown)}


def _writers(
    answer: SpectrumAnswer, content: dict[str, Any], numbers: dict[str, int], drawn: dict[str, Any]
) -> dict[str, Writer]:
    """How each option's file is written, with the provenance that its format can hold."""
    import rotor

    record = {"command": content["command"], "input": content["input"], **numbers}

    def table(path: Path) -> None:
        """The table as a file."""
        rotor.write(answer.lines, path, settings=record)

    return {
        "--cat": table,
        "--hitran": table,
        "--csv": table,
        "--parquet": table,
        "--profile-csv": lambda path: rotor.write(answer.spectrum, path, settings={"command": record["command"]}),
        "--plot": lambda path: _draw(answer, path, record, drawn),
    }


def _draw(answer: SpectrumAnswer, path: Path, record: dict[str, Any], drawn: dict[str, Any]) -> None:
    from rotor.plots.spectrum import plot_spectrum

    thing = answer.lines if answer.request.shape == "sticks" else answer.spectrum
    plot_spectrum(thing, path, provenance={"command": record["command"]}, **drawn)


def _show(answer: SpectrumAnswer, content: dict[str, Any], range_text: str | None, whole_sources: bool) -> None:
    from rotor.quantum.quanta import headings, of_rotation
    from rotor.reports import top_facts as report

    lines = answer.lines
    print(
        report.heading(lines.top)
        if lines.levels.of_named_constants
        else f"{lines.top.name}: levels of the file's own parameters"
    )
    show_facts(_facts(lines, content))
    if len(lines) == 0:
        print(f"\nno lines: {_why_none(answer, range_text)}")
    elif content["patterns"] is not None:
        print()
        show_table(patterns_table(content["patterns"], headings(of_rotation(lines.levels.quanta))))
    elif len(content["strongest"]):
        print()
        show_table(lines_table(lines, content["strongest"], content["optical_depth"]))
    print()
    show_facts(
        [*source_facts(lines.top, ("constants", "dipole", "spin weights"), whole_sources), *report.model_facts(content)]
    )


def _facts(lines: Lines, content: dict[str, Any]) -> list[tuple[str, str]]:
    from rotor.reports import top_facts as report

    top = lines.top
    cut = "none: every allowed line" if content["min_lgint"] is None else f"lgint above {content['min_lgint']:g}"
    own = content["spin_weights"]
    weights = "those of the file" if own is None else report.weights_text(own)
    named = lines.levels.of_named_constants
    return [
        (
            "constants",
            report.constants_text(top) if named else "those of the file, which have no names here",
        ),
        ("dipole", report.vector_text(top.dipole_abc_debye) if named else "the moments of the file"),
        ("spin weights", weights),
        *report.states_facts(top)[:MOST_FACTS_OF_STATES],
        ("temperature", f"{lines.temperature_k:g} K"),
        ("Q", report.q_text(content["q"], classical=named)),
        ("J max", f"{lines.jmax}: {content['jmax_source']}"),
        ("cut", cut + _range_text(lines.range_mhz)),
        *hyperfine_lines(content["hyperfine"]),
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
