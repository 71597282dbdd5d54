"""Options of verbs that read an observed spectrum, and what they make of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rotor.cli.shared import inputs
from rotor.cli.shared.options import option

if TYPE_CHECKING:
    from rotor.observed.species import SpeciesLines
    from rotor.observed.spectrum import ObservedSpectrum


@dataclass(frozen=True)
class SpectrumOptions:
    """What the file of a spectrum does not state, and what is done before it is used."""

    rest: str | None = option(None, metavar="F", help="Rest frequency of a velocity axis (MHz).")
    unit: str | None = option(None, metavar="UNIT", help="Unit of the intensities: K, mK, Jy/beam, mJy/beam.")
    axis_unit: str | None = option(None, metavar="UNIT", help="Unit of the spectral axis of a text: MHz, GHz, km/s.")
    frame: str | None = option(None, metavar="NAME", help="Frame of the frequencies: LSRK, SOURCE, ...")
    noise: str | None = option(None, metavar="X", help="Noise of a channel; estimated from line-free channels.")
    beam: str | None = option(None, metavar="A[,B]", help="Widths of the beam at half maximum (arcsec).")
    size: str | None = option(None, metavar="A", help="Width of the source at half maximum (arcsec); needs --beam.")
    baseline: int | None = option(None, metavar="N", help="Subtract a baseline of this order.")
    row: int | None = option(None, metavar="N", help="Which spectrum of a table, from 1.")
    pixel: str | None = option(None, metavar="X,Y", help="Which spectrum of a cube, from 1.")


def numbers(name: str, text: str, least: int, most: int) -> tuple[float, ...]:
    """Numbers with commas between; ValueError for too few or too many."""
    values = inputs.parsed(name, text, lambda value: tuple(float(item) for item in value.split(",")))
    if not least <= len(values) <= most:
        raise ValueError(f"{name} {text}: expected {least if least == most else f'{least} or {most}'} numbers")
    return values


def read_observed(file: str, given: SpectrumOptions, range_mhz: tuple[float, float] | None = None) -> ObservedSpectrum:
    """The spectrum in K, its baseline subtracted, and cut to a range."""
    from rotor.formats.spectra.axis import ReadChoices
    from rotor.formats.spectra.read import read_spectrum
    from rotor.observed.spectrum import in_kelvin, without_baseline

    beam = beam_of(given)
    choices = ReadChoices(
        axis_unit=given.axis_unit,
        unit=given.unit,
        rest_mhz=None if given.rest is None else inputs.quantity("--rest", given.rest, "MHz"),
        frame=given.frame,
        noise=None if given.noise is None else inputs.quantity("--noise", given.noise, ""),
        beam_arcsec=beam,
        row=given.row,
        pixel=None if given.pixel is None else tuple(int(one) for one in numbers("--pixel", given.pixel, 2, 2)),  # type: ignore[arg-type]
    )
    spectrum = in_kelvin(read_spectrum(file, choices), beam)
    if range_mhz is not None:
        spectrum = spectrum.between(*range_mhz)
    return spectrum if given.baseline is None else without_baseline(spectrum, given.baseline)


def beam_of(given: SpectrumOptions) -> tuple[float, float] | None:
    """Both widths of the beam."""
    from rotor.units import parse_grid

    if given.beam is None:
        return None
    values = inputs.parsed(
        "--beam", given.beam, lambda text: parse_grid(text, "arcsec").tolist() if ":" not in text else []
    )
    if not 1 <= len(values) <= 2:
        raise ValueError(f"--beam {given.beam}: expected 1 or 2 numbers")
    return values[0], values[-1]


def size_of(given: SpectrumOptions) -> float | None:
    """Width of the source."""
    return None if given.size is None else inputs.quantity("--size", given.size, "arcsec")


def species_of(
    words: Sequence[str], catalogue: str | None, range_mhz: tuple[float, float], partition: str | None = None
) -> list[SpeciesLines]:
    """Species by words: .cat files, names of a local catalogue where one is given, else molecules of the library; one each.

    Raises ValueError for a word that means several species of the catalogue.
    """
    if catalogue is None:
        return [_species_of_word(word, range_mhz, partition) for word in words]
    from rotor.formats.catalogue.database import LineCatalogue

    out = []
    with LineCatalogue(catalogue) as opened:
        for word in words:
            if _is_cat(word):
                out.append(_species_of_word(word, range_mhz, partition))
                continue
            matches = opened.species_between(*range_mhz, [word])
            if len(matches) != 1:
                listed = ", ".join(
                    f"{one.identity.get('tag', '')} {one.name} ({one.identity.get('database', '')})"
                    for one in matches[:6]
                )
                raise ValueError(
                    f"{word}: {len(matches)} species of {catalogue} with lines in the range: {listed}; name one by its tag or full name"
                )
            out += matches
    return out


def _is_cat(word: str) -> bool:
    return word.lower().endswith((".cat", ".cat.gz"))


def _species_of_word(word: str, range_mhz: tuple[float, float], partition: str | None) -> SpeciesLines:
    if _is_cat(word):
        from pathlib import Path

        from rotor.formats.catalogue.cat_species import read_cat_with

        if not Path(word).is_file():
            raise ValueError(f"{word}: no such file")
        return read_cat_with(Path(word), partition)
    from rotor.observed.species import species_of_lines
    from rotor.spectra.lines import line_list

    top = inputs.with_dipole(word)
    lines = line_list(top, temperature_k=300.0, min_lgint=-12.0, range_mhz=range_mhz)
    return species_of_lines(lines, top.name or word)


def padded(spectrum: ObservedSpectrum, redshift: float = 0.0, km_s: float = 300.0) -> tuple[float, float]:
    """Rest frequencies whose lines may be in a spectrum: its range and what velocities may move into it."""
    factor = km_s / 299792.458
    first, last = (float(spectrum.frequency_mhz[i]) * (1 + redshift) for i in (0, -1))
    return first * (1 - factor), last * (1 + factor)


def spectrum_facts(spectrum: ObservedSpectrum) -> list[tuple[str, str]]:
    """The spectrum as lines of a report."""
    import numpy as np

    first, last = spectrum.frequency_mhz[0], spectrum.frequency_mhz[-1]
    rows = [
        (
            "spectrum",
            f"{spectrum.source}: {len(spectrum)} channels from {first:.6f} to {last:.6f} MHz, frame {spectrum.frame}",
        ),
        ("noise", f"{float(np.median(spectrum.noise)):.4g} {spectrum.unit} a channel"),
    ]
    return rows + [("", text) for text in spectrum.notes]


def json_of(spectrum: ObservedSpectrum) -> dict[str, Any]:
    """The spectrum by the keys of docs/verbs."""
    import numpy as np

    return {
        "source": spectrum.source,
        "channels": len(spectrum),
        "range_mhz": [float(spectrum.frequency_mhz[0]), float(spectrum.frequency_mhz[-1])],
        "frame": spectrum.frame,
        "noise_k": float(np.median(spectrum.noise)),
        "beam_arcsec": None if spectrum.beam_arcsec is None else list(spectrum.beam_arcsec),
        "notes": list(spectrum.notes),
    }
