"""`rotor emission --over` and `--fit` of a spectrum in absorbance: a gas cell with one temperature and one width."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

from rotor.requests.field import changed_fields, declared_fields
from rotor.verbs.observed_request import FIT_OPTIONS, ObservedRequest, each_species, species_in

if TYPE_CHECKING:
    from rotor.observed.gas_cell import CellFit
    from rotor.observed.spectrum import ObservedSpectrum
    from rotor.verbs.verb import Note

_TELESCOPE_INPUTS = ("background_k", "redshift", *FIT_OPTIONS)
_BEAM_INPUTS = ("beam_arcsec", "size_arcsec")
_TELESCOPE_FILES = ("diagram", "corner")


def refuse_telescope(request: ObservedRequest, files: Collection[str]) -> None:
    """ValueError for options that a gas cell has no place for."""
    fields = changed_fields(request, _TELESCOPE_INPUTS) + changed_fields(request.spectrum, _BEAM_INPUTS)
    flags = [field.flag for field in fields] + [f"--{name}" for name in _TELESCOPE_FILES if name in files]
    flags += ["--velocity"] if any(request.velocity_km_s or ()) else []
    if flags:
        raise ValueError(f"{flags[0]}: belongs to brightness in K; expected without a spectrum in absorbance")


def cell_fit(spectrum: ObservedSpectrum, request: ObservedRequest, note: Note) -> CellFit:
    """The fit of a gas cell, from numbers that were typed and from the spectrum."""
    from dataclasses import replace

    from rotor.observed.gas_cell import fit_cell, start_cell

    kelvin, width = _single(request, "excitation_k"), _single(request, "fwhm_km_s")
    species = species_in(spectrum, request, note)
    columns = each_species("column_per_cm2", request, len(species))
    start = start_cell(spectrum, species, kelvin, width)
    if columns is not None:
        start = [replace(part, column_per_cm2=column) for part, column in zip(start, columns, strict=True)]
    return fit_cell(spectrum, start)


def _single(request: ObservedRequest, name: str) -> float | None:
    """A number that all the gas has in common."""
    values = getattr(request, name)
    if values is not None and len(values) > 1:
        flag = declared_fields(ObservedRequest)[name].flag
        raise ValueError(f"{flag}: {len(values)} numbers; the gas of a cell has one temperature and one width")
    return values[0] if values else None
