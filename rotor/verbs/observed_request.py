"""Inputs of `rotor emission --over` and `--fit`, and the start of a model or a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rotor.frozen import dataclass
from rotor.requests.field import Rule, changed_fields, declared, declared_fields, identical, part
from rotor.requests.readers import INFINITE, NameList, Quantity, Text, Whole
from rotor.spectra.emission_request import LayerInput, WindowInput
from rotor.verbs.observed_file import SINGLE, SeveralInput, SpectrumFile, observed, padded, species_of
from rotor.verbs.verb import Note

if TYPE_CHECKING:
    from rotor.observed.fit import FitChoices
    from rotor.observed.model import Component, Sight
    from rotor.observed.species import SpeciesLines
    from rotor.observed.spectrum import ObservedSpectrum

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


def layer_field(name: str) -> Any:
    """A field of the emitting gas, None if not typed: a fit then estimates it."""
    field = declared_fields(LayerInput)[name]
    return declared(None, field.reader, field.help, field.key, option=field.option, panel=field.panel)


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


def sight_of(spectrum: ObservedSpectrum, request: ObservedRequest) -> Sight:
    """Beam, background and redshift of the request."""
    background = request.background_k
    if background is None:
        background = declared_fields(LayerInput)["background_k"].default
    return request.spectrum.sight(spectrum, background, request.redshift or 0.0)


def species_in(spectrum: ObservedSpectrum, request: ObservedRequest, note: Note) -> list[SpeciesLines]:
    """The named species, with their lines in the range of the spectrum."""
    reach = padded(spectrum, request.redshift or 0.0)
    species = species_of(request.names, request.catalogue, reach, request.sources.partition, note)
    for lines in species:
        if "note" in lines.identity:
            note(f"{lines.name}: {lines.identity['note']}")
    return species


def components_of(
    spectrum: ObservedSpectrum, species: Sequence[SpeciesLines], sight: Sight, request: ObservedRequest
) -> list[Component]:
    """Components from the typed options; for a fit, the rest is estimated from the spectrum."""
    from rotor.observed.model import Component
    from rotor.observed.start import start_components

    count, size = len(species), request.spectrum.size_arcsec
    typed = {name: each_species(name, request, count) for name in FREE.values() if name != "size_arcsec"}
    if request.fit is None:
        defaults = {name: declared_fields(LayerInput)[name].default * count for name in typed}
        values = {name: numbers or defaults[name] for name, numbers in typed.items()}
        rows: list[dict[str, Any]] = [{name: numbers[k] for name, numbers in values.items()} for k in range(count)]
        return [Component(lines, **row, size_arcsec=size) for lines, row in zip(species, rows, strict=True)]
    first = {name: (values[0] if values else None) for name, values in typed.items()}
    del first["column_per_cm2"]
    start = start_components(spectrum, species, sight, **first, size_arcsec=size)
    changes = [{name: values[k] for name, values in typed.items() if values} for k in range(count)]
    return [replace(component, **change) for component, change in zip(start, changes, strict=True)]  # type: ignore[arg-type]


def each_species(name: str, request: ObservedRequest, count: int) -> tuple[float, ...] | None:
    """One number for each species, or one for all."""
    values: tuple[float, ...] | None = getattr(request, name)
    if values is not None and len(values) not in (1, count):
        flag, text = declared_fields(LayerInput)[name].flag, ",".join(f"{number:g}" for number in values)
        raise ValueError(f"{flag} {text}: {len(values)} numbers for {count} species; expected one for all or one each")
    return values * count if values is not None and len(values) == 1 else values


def fit_choices(request: ObservedRequest) -> FitChoices:
    """Free and shared parameters, and the calibration error, of a fit."""
    from rotor.observed.fit import FitChoices
    from rotor.observed.variables import DEFAULT_FREE

    free, shared = (tuple(FREE[word] for word in words) for words in (request.free, request.shared))
    return FitChoices(free=free or DEFAULT_FREE, shared=shared, calibration=request.calibration)
