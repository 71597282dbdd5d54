"""Inputs of verbs on an observed spectrum; the spectrum, species and sight that they describe, and the start of a model or a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.checks import require_file
from rotor.frozen import dataclass
from rotor.requests.field import CONDITIONS, changed_fields, declared, declared_fields, identical, part
from rotor.requests.lists import NameList, Numbers
from rotor.requests.readers import INFINITE, Names, Quantity, Rule, Text, Whole
from rotor.spectra.emission.request import LayerInput, WindowInput
from rotor.verbs.common.molecule import with_some_dipole
from rotor.verbs.common.subjects import top_of_word
from rotor.verbs.common.verb import Note, silent

if TYPE_CHECKING:
    from rotor.observed.fit import FitChoices
    from rotor.observed.model.model import Component, Sight
    from rotor.observed.model.species import SpeciesLines
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
class FileFacts:
    """Facts that the file of a spectrum does not state."""

    rest_mhz: float | None = observed(
        None, Quantity("MHz", above=0, metavar="F"), "Rest frequency of a velocity axis (MHz)", option="--rest"
    )
    unit: str | None = observed(
        None, Text(metavar="UNIT"), "Unit of the intensities: K, mK, Jy/beam, mJy/beam, absorbance"
    )
    axis_unit: str | None = observed(
        None, Text(metavar="UNIT"), "Unit of the spectral axis of a text: MHz, GHz, cm-1, km/s"
    )
    noise: float | None = observed(None, Quantity(), "Noise of a channel; by default estimated from line-free channels")


@dataclass(frozen=True)
class SpectrumFile(FileFacts):
    """Facts that the file of a spectrum does not state, and corrections before its use."""

    frame: str | None = observed(None, Text(metavar="NAME"), "Frame of the frequencies, such as LSRK or SOURCE")
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
        from rotor.observed.model.model import Sight

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

    species: list[SpeciesLines] = []
    with LineCatalogue(catalogue) as opened:
        for word in words:
            in_file = is_catalogue(word)
            matches = (
                [_species_of_word(word, range_mhz, partition, note)]
                if in_file
                else opened.species_between(*range_mhz, [word])
            )
            if len(matches) != 1:
                listed = ", ".join(
                    f"{match.identity.get('tag', '')} {match.name} ({match.identity.get('database', '')})"
                    for match in matches[:6]
                )
                raise ValueError(
                    f"{word}: {len(matches)} species of {catalogue} with lines in the range: {listed}; name one by its tag or full name"
                )
            species += matches
    return species


def is_catalogue(source: Any) -> bool:
    """Whether a source is a line catalogue (.cat)."""
    return isinstance(source, str) and source.lower().endswith((".cat", ".cat.gz"))


def _species_of_word(word: str, range_mhz: tuple[float, float], partition: str | None, note: Note) -> SpeciesLines:
    if is_catalogue(word):
        from rotor.formats.catalogue.cat_species import read_cat_with

        require_file(word)
        return read_cat_with(Path(word), partition)
    from rotor.observed.model.species import species_from_lines
    from rotor.spectra.lines import line_list

    top = top_of_word(word, note, prepare=with_some_dipole)
    lines = line_list(top, temperature_k=300.0, min_lgint=-12.0, range_mhz=range_mhz)
    return species_from_lines(lines, top.name or word)


def padded(spectrum: ObservedSpectrum, redshift: float = 0.0) -> tuple[float, float]:
    """Range of rest frequencies (MHz) whose lines may fall into a spectrum: widened by velocities up to 300 km/s."""
    factor = 300.0 / 299792.458
    first, last = (float(spectrum.frequency_mhz[i]) * (1 + redshift) for i in (0, -1))
    return first * (1 - factor), last * (1 + factor)


def spectrum_facts(record: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The spectrum as rows of a report, from its record in the JSON."""
    (first, last), noise = record["range_mhz"], record.get("noise_k", record.get("noise"))
    channels = f"{record['channels']} channels from {first:.6f} to {last:.6f} MHz, frame {record['frame']}"
    rows = [("spectrum", f"{record['source']}: {channels}"), ("noise", f"{noise:.4g} {record['unit']} a channel")]
    return rows + [("", text) for text in record["notes"]]


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


FREE = {
    "column": "column_per_cm2",
    "excitation": "excitation_k",
    "velocity": "velocity_km_s",
    "width": "fwhm_km_s",
    "size": "size_arcsec",
}


OF_FIT = Rule(("fit",), why="belongs to a fit")
SINGLE_FIT = Rule(("fit",), SINGLE.excludes, "belongs to a fit of a single spectrum")
FIT_OPTIONS = ("free", "shared", "sample", "calibration", "reject")


def layer_field(name: str, default: Any = None) -> Any:
    """A field of the emitting gas with another default; None if not typed: a fit then estimates it."""
    field = declared_fields(LayerInput)[name]
    return declared(default, field.reader, field.help, field.key, option=field.option, panel=field.panel)


@dataclass(frozen=True)
class ObservedRequest:
    """Inputs of a model over a spectrum, or of its fit."""

    sources: SeveralInput = part(SeveralInput, identical, identical, SeveralInput())
    over: str | None = observed(None, Text(metavar="FILE"), "Observed spectrum (FITS, text) to compare with the model")
    fit: str | None = observed(None, Text(metavar="FILE"), "Observed spectrum to fit")
    catalogue: str | None = observed(None, Text(metavar="FILE"), "Local catalogue with the species that SOURCE names")
    free: tuple[str, ...] = observed(
        (), NameList(tuple(FREE)), "Fitted parameters: column, excitation, velocity, width, size", rule=OF_FIT
    )
    shared: tuple[str, ...] = observed(
        (), NameList(tuple(FREE)), "Parameters with one value for all species: velocity,width", rule=OF_FIT
    )
    calibration: float = observed(0.0, Quantity(least=0, most=1), "Relative error of the intensity scale", rule=OF_FIT)
    reject: float | None = observed(
        None, Quantity(), "Fit near lines only, without channels X standard deviations above the model", rule=SINGLE_FIT
    )
    mask: str | None = observed(
        None, Text(metavar="FILE"), "Pixels of --maps: FITS, nonzero where fitted; by default those above 5 standard deviations",
        rule=Rule(("outputs.maps",), why="belongs to maps of a cube"),
    )  # fmt: skip
    sample: int = observed(0, Whole(1), "Steps of emcee after the fit (extra sampling)", rule=SINGLE_FIT)
    spectrum: SpectrumFile = part(SpectrumFile, identical, identical, SpectrumFile())
    column_per_cm2: tuple[float, ...] | None = layer_field("column_per_cm2")
    excitation_k: tuple[float, ...] | None = layer_field("excitation_k")
    velocity_km_s: tuple[float, ...] | None = layer_field("velocity_km_s")
    fwhm_km_s: tuple[float, ...] | None = layer_field("fwhm_km_s")
    background_k: float | None = layer_field("background_k")
    redshift: float | None = layer_field("redshift")
    range_mhz: tuple[float, float] = part(
        WindowInput, lambda value, _: value.range_mhz or value.band, lambda value, _: WindowInput(value), INFINITE,
        single=True, why="give one of them",
    )  # fmt: skip

    @property
    def names(self) -> tuple[str, ...]:
        """The molecules as the user named them."""
        return self.sources.names

    def __post_init__(self) -> None:
        if self.over is not None and self.fit is not None:
            raise ValueError("--over, --fit: both name a spectrum; give one of them (a fit also shows the model)")
        if self.over is None and self.fit is None:
            typed = [*changed_fields(self.spectrum), *changed_fields(self, ("catalogue", "mask"))]
            what = typed[0].flag if typed else "--maps, --diagram, --corner, --workers"
            raise ValueError(f"{what}: belongs to an observed spectrum; expected with --over or --fit")
        if not self.names:
            raise ValueError("SOURCE: expected one molecule or several, such as 'rotor emission CO HCN --band ALMA3'")

    def sight(self, spectrum: ObservedSpectrum) -> Sight:
        """Beam, background and redshift of the line of sight."""
        background = self.background_k
        if background is None:
            background = declared_fields(LayerInput)["background_k"].default
        return self.spectrum.sight(spectrum, background, self.redshift or 0.0)

    def species(self, spectrum: ObservedSpectrum, note: Note) -> list[SpeciesLines]:
        """The named species, with their lines in the range of the spectrum."""
        reach = padded(spectrum, self.redshift or 0.0)
        species = species_of(self.names, self.catalogue, reach, self.sources.partition, note)
        for lines in species:
            if "note" in lines.identity:
                note(f"{lines.name}: {lines.identity['note']}")
        return species

    def components(self, spectrum: ObservedSpectrum, species: Sequence[SpeciesLines], sight: Sight) -> list[Component]:
        """Components from the typed options; for a fit, the rest is estimated from the spectrum."""
        from rotor.observed.model.model import Component
        from rotor.observed.start import start_components

        count, size = len(species), self.spectrum.size_arcsec
        typed = {name: self.each_species(name, count) for name in FREE.values() if name != "size_arcsec"}
        if self.fit is None:
            defaults = {name: declared_fields(LayerInput)[name].default * count for name in typed}
            values = {name: numbers or defaults[name] for name, numbers in typed.items()}
            rows: list[dict[str, Any]] = [{name: numbers[k] for name, numbers in values.items()} for k in range(count)]
            return [Component(lines, **row, size_arcsec=size) for lines, row in zip(species, rows, strict=True)]
        first = {name: (values[0] if values else None) for name, values in typed.items()}
        del first["column_per_cm2"]
        start = start_components(spectrum, species, sight, **first, size_arcsec=size)
        changes = [{name: values[k] for name, values in typed.items() if values} for k in range(count)]
        return [replace(component, **change) for component, change in zip(start, changes, strict=True)]  # type: ignore[arg-type]

    def each_species(self, name: str, count: int) -> tuple[float, ...] | None:
        """One number for each species, or one for all."""
        values: tuple[float, ...] | None = getattr(self, name)
        if values is not None and len(values) not in (1, count):
            flag, text = declared_fields(LayerInput)[name].flag, ",".join(f"{number:g}" for number in values)
            raise ValueError(
                f"{flag} {text}: {len(values)} numbers for {count} species; expected one for all or one each"
            )
        return values * count if values is not None and len(values) == 1 else values

    @property
    def choices(self) -> FitChoices:
        """Free and shared parameters, and the calibration error, of a fit."""
        from rotor.observed.fit import FitChoices
        from rotor.observed.model.variables import DEFAULT_FREE

        free, shared = (tuple(FREE[word] for word in words) for words in (self.free, self.shared))
        return FitChoices(free=free or DEFAULT_FREE, shared=shared, calibration=self.calibration)
