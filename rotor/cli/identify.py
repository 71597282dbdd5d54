"""`rotor identify`: which species an observed spectrum needs, ranked by evidence, and the lines that stay unidentified."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.checks import require_whole
from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import json_option
from rotor.cli.shared.observed_options import (
    SpectrumOptions,
    beam_of,
    json_of,
    padded,
    read_observed,
    size_of,
    spectrum_facts,
)
from rotor.cli.shared.options import argument, file_option, grouped, option
from rotor.cli.shared.output import Files, Table, deliver, json_text, show_facts, show_table
from rotor.cli.shared.process import one_thread_of_blas

if TYPE_CHECKING:
    from rotor.observed.identify import Identification
    from rotor.observed.species import SpeciesLines

EXAMPLES = """\b
Examples:
  rotor identify spectrum.fits --catalogue lines.rotorcat --plot pages.pdf
  rotor identify spectrum.txt --catalogue cdms/ --velocity 2.7 --width 1 --beam 0.5 --size 0.5
  rotor identify cube.fits --pixel 32,40 --catalogue lines.rotorcat --json -"""


@dataclass(frozen=True)
class Options:
    """The spectrum, the candidates, and how they are looked for."""

    file: str = argument(..., metavar="FILE", help="Spectrum: FITS or text.")
    catalogue: list[str] | None = option(
        None, metavar="FILE", help="Local catalogue, folder of .cat, or .cat; repeatable."
    )
    range_: str | None = option(None, "--range", metavar="A:B", help="Frequencies that are used (MHz).")
    velocity: str | None = option(None, metavar="V", help="Velocity of the source (km/s); estimated without.")
    width: str | None = option(None, metavar="W", help="Full width of the lines (km/s); estimated without.")
    background: str = option("2.725", metavar="T", help="Temperature behind the source (K).")
    redshift: float = option(0.0, metavar="Z", help="Redshift of the source.")
    model_error: str = option("0.1", metavar="X", help="Error of the model as a fraction of the brightness.")
    most: int = option(60, "--most", metavar="N", help="Species at most.")


@dataclass(frozen=True)
class Outputs:
    """Files to write."""

    csv: str | None = file_option(".csv", help="Write the species as CSV.")
    plot: str | None = file_option(
        ".png", ".pdf", ".svg", help="Draw pages of panels with the model over the spectrum."
    )
    json: str | None = json_option()


@grouped()
def command(context: typer.Context, options: Options, spectrum: SpectrumOptions, outputs: Outputs) -> None:
    """Which species an observed spectrum needs, by evidence; unidentified lines."""
    import sys

    from rotor.observed.identify import IdentifyChoices, identify
    from rotor.observed.model import Sight

    one_thread_of_blas()
    require_whole("--most", options.most, 1)
    if not options.catalogue:
        raise ValueError(
            "--catalogue: expected a local catalogue ('rotor catalogue add'), a folder of .cat files, or a .cat file"
        )
    files = Files.of(outputs)
    choices = IdentifyChoices(
        velocity_km_s=_speed("--velocity", options.velocity),
        fwhm_km_s=_speed("--width", options.width),
        model_error=inputs.quantity("--model-error", options.model_error, "fraction"),
        most_species=options.most,
        size_arcsec=size_of(spectrum),
    )
    observed = read_observed(options.file, spectrum, _range(options))
    beam = observed.beam_arcsec or beam_of(spectrum)
    width = None if beam is None else (beam[0] * beam[1]) ** 0.5
    sight = Sight(inputs.quantity("--background", options.background, "K"), width, options.redshift)
    candidates = _candidates(options.catalogue, padded(observed, options.redshift))
    progress = (lambda name: print(f"\r{name[:60]:60s}", end="", file=sys.stderr)) if sys.stderr.isatty() else None
    found = identify(observed, candidates, sight, choices, progress=progress)
    if progress:
        print("\r" + " " * 60 + "\r", end="", file=sys.stderr)
    content = {"command": context.obj, "spectrum": json_of(observed), **found.facts(), "files": files.names}

    def show() -> None:
        show_facts(spectrum_facts(observed))
        _show(found)

    deliver(files, _writers(found, observed, sight, context.obj), lambda: json_text(content), show)


def _range(options: Options) -> tuple[float, float] | None:
    from rotor.units import parse_range

    return (
        None
        if options.range_ is None
        else inputs.parsed("--range", options.range_, lambda text: parse_range(text, "MHz"))
    )


def _speed(name: str, text: str | None) -> float | None:
    return None if text is None else inputs.quantity(name, text, "km/s")


def _candidates(sources: Sequence[str], range_mhz: tuple[float, float]) -> list[SpeciesLines]:
    """Species with lines in the range, of catalogues, folders and files."""
    from rotor.formats.catalogue.cat_species import read_cat_species
    from rotor.formats.catalogue.catdir import is_catdir
    from rotor.formats.catalogue.database import LineCatalogue

    out: list[SpeciesLines] = []
    for source in sources:
        path = Path(source)
        if not path.exists():
            raise ValueError(f"--catalogue {source}: no such file or folder")
        if path.is_dir() or path.name.lower().endswith((".cat", ".cat.gz")):
            every = sorted(path.rglob("*.cat*")) if path.is_dir() else [path]
            species = [read_cat_species(file) for file in every if not is_catdir(file)]
            out += [one.between(*range_mhz) for one in species if len(one.between(*range_mhz))]
            if path.is_dir() and not every:
                raise ValueError(f"--catalogue {source}: no .cat file in this folder")
        else:
            with LineCatalogue(path) as catalogue:
                out += catalogue.species_between(*range_mhz)
    return out


def _writers(found: Identification, observed: Any, sight: Any, command: str) -> dict[str, Any]:
    import rotor

    def draw(path: Path) -> None:
        """Pages with the fitted model."""
        from rotor.plots.overlay import plot_overlay

        components = [one.component for one in found.species]
        marked = [one.frequency_mhz for one in found.unidentified]
        plot_overlay(observed, components, path, sight=sight, unidentified_mhz=marked, provenance={"command": command})

    return {"--csv": lambda path: rotor.write(found, path, settings={"command": command}), "--plot": draw}


def _show(found: Identification) -> None:
    chi = "" if found.fit is None else f", χ²/ν = {found.fit.reduced_chi_squared:.3g}"
    show_facts(
        [
            ("candidates", str(found.candidates)),
            ("begun with", f"velocity {found.velocity_km_s:.2f} km/s, width {found.fwhm_km_s:.2f} km/s"),
            ("species", f"{len(found.species)}{chi}"),
        ]
    )
    if found.species:
        print()
        show_table(_species_table(found))
    print()
    if not found.unidentified:
        print("no unidentified line above 5 standard deviations")
        return
    rows = [
        (f"{one.frequency_mhz:.3f}", f"{one.peak_k:.3g}", f"{one.deviations:.1f}", ", ".join(one.candidates) or "none")
        for one in sorted(found.unidentified, key=lambda one: one.frequency_mhz)
    ]
    heads = ("frequency (MHz)", "T_B (K)", "σ", "candidates with a line there")
    show_table(Table(f"{len(rows)} unidentified lines", heads, rows, frozenset({"candidates with a line there"})))


def _species_table(found: Identification) -> Table:
    rows = [
        (
            one.component.species.name,
            f"{one.signal:.0f}",
            f"{one.visible}/{one.expected}",
            f"{one.component.column_per_cm2:.2e}",
            f"{one.component.excitation_k:.0f}",
            f"{one.component.velocity_km_s:.2f}",
            f"{one.component.fwhm_km_s:.2f}",
            ", ".join(one.rivals),
        )
        for one in found.species
    ]
    heads = ("species", "Δχ²", "lines seen", "N (1/cm²)", "T (K)", "v (km/s)", "Δv (km/s)", "or")
    return Table("species by evidence", heads, rows, frozenset({"species", "or"}))
