"""Options of verbs that read an observed spectrum, and the spectrum, species and sight that they describe."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.frozen import dataclass
from rotor.requests.field import CONDITIONS, Rule, declared
from rotor.requests.readers import INFINITE, Names, Numbers, Quantity, Text, Whole
from rotor.verbs.molecule import with_some_dipole
from rotor.verbs.subjects import top_of_word
from rotor.verbs.verb import Note, silent

if TYPE_CHECKING:
    from rotor.observed.model import Sight
    from rotor.observed.species import SpeciesLines
    from rotor.observed.spectrum import ObservedSpectrum

PANEL = "Observed spectrum"
observed = partial(declared, panel=PANEL)  # a field under this heading of --help
SINGLE = Rule(excludes=("outputs.maps",), why="needs a single spectrum")


@dataclass(frozen=True)
class SeveralInput:
    """The molecules on the command line."""

    names: tuple[str, ...] = declared(
        (), Names(), "Molecules: names, files, SMILES:..., .cat files of JPL and CDMS", option="SOURCE"
    )
    partition: str | None = declared(
        None, Text(metavar="FILE"), "Q(T) of .cat files: a catdir.cat, or T=Q pairs: 300=108.87,75=27.46",
        panel=CONDITIONS,
    )  # fmt: skip


@dataclass(frozen=True)
class SpectrumFile:
    """Facts that the file of a spectrum does not state, and corrections before its use."""

    rest_mhz: float | None = observed(
        None, Quantity("MHz", metavar="F"), "Rest frequency of a velocity axis (MHz)", option="--rest"
    )
    unit: str | None = observed(
        None, Text(metavar="UNIT"), "Unit of the intensities: K, mK, Jy/beam, mJy/beam, absorbance"
    )
    axis_unit: str | None = observed(None, Text(metavar="UNIT"), "Unit of the spectral axis of a text: MHz, GHz, km/s")
    frame: str | None = observed(None, Text(metavar="NAME"), "Frame of the frequencies, such as LSRK or SOURCE")
    noise: float | None = observed(None, Quantity(), "Noise of a channel; by default estimated from line-free channels")
    beam_arcsec: tuple[float, ...] | None = observed(
        None, Numbers("arcsec", (1, 2), "30 or 30,25", metavar="A[,B]"), "Widths of the beam at half maximum (arcsec)", option="--beam",
    )  # fmt: skip
    size_arcsec: float | None = observed(
        None, Quantity("arcsec", metavar="A"), "Width of the source at half maximum (arcsec); needs --beam", option="--size",
    )  # fmt: skip
    baseline: int | None = observed(None, Whole(0), "Subtract a baseline of this order", rule=SINGLE)
    row: int | None = observed(None, Whole(), "Number of the spectrum in a table, from 1", rule=SINGLE)
    pixel: tuple[float, ...] | None = observed(
        None, Numbers(counts=(2,), example="32,40", metavar="X,Y"), "Pixel of the spectrum in a cube, from 1", rule=SINGLE,
    )  # fmt: skip

    @property
    def beam(self) -> tuple[float, float] | None:
        """Widths of the beam on both axes (arcsec)."""
        return None if self.beam_arcsec is None else (self.beam_arcsec[0], self.beam_arcsec[-1])

    @property
    def choices(self) -> Any:
        """Settings for reading a file of spectra."""
        from rotor.formats.spectra.axis import ReadChoices

        pixel = None if self.pixel is None else (int(self.pixel[0]), int(self.pixel[1]))
        names = ("axis_unit", "unit", "rest_mhz", "frame", "noise", "row")
        return ReadChoices(**{name: getattr(self, name) for name in names}, beam_arcsec=self.beam, pixel=pixel)

    def read(self, file: str, range_mhz: tuple[float, float] = INFINITE, *, gas_cell: bool = False) -> ObservedSpectrum:
        """The spectrum in K, for a gas cell in absorbance too, without its baseline, cut to a range."""
        from rotor.formats.spectra.read import read_spectrum
        from rotor.observed.spectrum import ABSORBANCE, in_kelvin, without_baseline

        spectrum = read_spectrum(file, self.choices)
        if not (gas_cell and spectrum.unit == ABSORBANCE):
            spectrum = in_kelvin(spectrum, self.beam)
        if range_mhz != INFINITE:
            spectrum = spectrum.between(*range_mhz)
        return spectrum if self.baseline is None else without_baseline(spectrum, self.baseline)

    def sight(self, spectrum: ObservedSpectrum, background_k: float, redshift: float) -> Sight:
        """Beam, background and redshift of the line of sight."""
        from rotor.observed.model import Sight

        beam = spectrum.beam_arcsec or self.beam
        return Sight(background_k, None if beam is None else (beam[0] * beam[1]) ** 0.5, redshift)


def species_of(
    words: Sequence[str],
    catalogue: str | None,
    range_mhz: tuple[float, float],
    partition: str | None = None,
    note: Note = silent,
) -> list[SpeciesLines]:
    """One species for each word: a .cat file, a name in a local catalogue if one is given, else a molecule of the library.

    Raises ValueError for a word that matches several species of the catalogue, or none.
    """
    if catalogue is None:
        return [_species_of_word(word, range_mhz, partition, note) for word in words]
    from rotor.formats.catalogue.database import LineCatalogue

    out = []
    with LineCatalogue(catalogue) as opened:
        for word in words:
            if is_catalogue(word):
                out.append(_species_of_word(word, range_mhz, partition, note))
                continue
            matches = opened.species_between(*range_mhz, [word])
            if len(matches) != 1:
                listed = ", ".join(
                    f"{match.identity.get('tag', '')} {match.name} ({match.identity.get('database', '')})"
                    for match in matches[:6]
                )
                raise ValueError(
                    f"{word}: {len(matches)} species of {catalogue} with lines in the range: {listed}; name one by its tag or full name"
                )
            out += matches
    return out


def is_catalogue(source: Any) -> bool:
    """Whether a source is a line catalogue (.cat)."""
    return isinstance(source, str) and source.lower().endswith((".cat", ".cat.gz"))


def _species_of_word(word: str, range_mhz: tuple[float, float], partition: str | None, note: Note) -> SpeciesLines:
    if is_catalogue(word):
        from rotor.formats.catalogue.cat_species import read_cat_with

        if not Path(word).is_file():
            raise ValueError(f"{word}: no such file")
        return read_cat_with(Path(word), partition)
    from rotor.observed.species import species_from_lines
    from rotor.spectra.lines import line_list

    top = top_of_word(word, note, prepare=with_some_dipole)
    lines = line_list(top, temperature_k=300.0, min_lgint=-12.0, range_mhz=range_mhz)
    return species_from_lines(lines, top.name or word)


def padded(spectrum: ObservedSpectrum, redshift: float = 0.0, km_s: float = 300.0) -> tuple[float, float]:
    """Range of rest frequencies (MHz) whose lines may fall into a spectrum: widened by velocities up to `km_s`."""
    factor = km_s / 299792.458
    first, last = (float(spectrum.frequency_mhz[i]) * (1 + redshift) for i in (0, -1))
    return first * (1 - factor), last * (1 + factor)


def spectrum_facts(spectrum: ObservedSpectrum) -> list[tuple[str, str]]:
    """The spectrum as rows of a report."""
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
    return {
        "source": spectrum.source,
        "channels": len(spectrum),
        "range_mhz": [float(spectrum.frequency_mhz[0]), float(spectrum.frequency_mhz[-1])],
        "frame": spectrum.frame,
        "unit": spectrum.unit,
        "noise_k" if spectrum.unit == "K" else "noise": float(np.median(spectrum.noise)),
        "beam_arcsec": None if spectrum.beam_arcsec is None else list(spectrum.beam_arcsec),
        "notes": list(spectrum.notes),
    }
