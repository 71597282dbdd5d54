"""`rotor emission --over` and `--fit` of a spectrum in absorbance: a gas cell with one temperature and one width."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

from rotor.requests.field import all_fields, declared_fields
from rotor.verbs.observed_file import SpectrumFile
from rotor.verbs.observed_request import FIT_OPTIONS, ObservedRequest, species_in

if TYPE_CHECKING:
    from rotor.observed.gas_cell import CellFit
    from rotor.observed.spectrum import ObservedSpectrum
    from rotor.verbs.verb import Note

_TELESCOPE_INPUTS = ("background_k", "redshift", *FIT_OPTIONS)
_BEAM_INPUTS = ("beam_arcsec", "size_arcsec")
_TELESCOPE_FILES = ("diagram", "corner")


def refuse_telescope(request: ObservedRequest, files: Collection[str]) -> None:
    """ValueError for options that a gas cell has no place for."""
    here, file = declared_fields(ObservedRequest), all_fields(SpectrumFile).values()
    named = [here[name].flag for name in _TELESCOPE_INPUTS if getattr(request, name) != here[name].default]
    named += [
        each.flag for each in file if each.name in _BEAM_INPUTS and getattr(request.spectrum, each.name) is not None
    ]
    named += [f"--{name}" for name in _TELESCOPE_FILES if name in files]
    named += ["--velocity"] if any(request.velocity_km_s or ()) else []
    if named:
        raise ValueError(f"{named[0]}: belongs to brightness in K; expected without a spectrum in absorbance")


def cell_fit(spectrum: ObservedSpectrum, request: ObservedRequest, note: Note) -> CellFit:
    """The fit of a gas cell, from numbers that were typed and from the spectrum."""
    from dataclasses import replace

    from rotor.observed.gas_cell import fit_cell, start_cell

    kelvin, width = _single(request, "excitation_k"), _single(request, "fwhm_km_s")
    columns = request.column_per_cm2 or ()
    species = species_in(spectrum, request, note)
    if len(columns) not in (0, 1, len(species)):
        raise ValueError(
            f"--column: {len(columns)} numbers for {len(species)} species; expected one for all or one each"
        )
    start = start_cell(spectrum, species, kelvin, width)
    if columns:
        typed = columns * len(species) if len(columns) == 1 else columns
        start = [replace(each, column_per_cm2=n) for each, n in zip(start, typed, strict=True)]
    return fit_cell(spectrum, start)


def _single(request: ObservedRequest, name: str) -> float | None:
    """A number that all the gas has in common."""
    values = getattr(request, name)
    if values is not None and len(values) > 1:
        flag = declared_fields(ObservedRequest)[name].flag
        raise ValueError(f"{flag}: {len(values)} numbers; the gas of a cell has one temperature and one width")
    return values[0] if values else None
