"""Observed spectra by file name: FITS by its beginning, everything else as text."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from rotor.formats.packed import first_bytes
from rotor.formats.spectra.axis import ReadChoices, intensity_unit
from rotor.observed.spectrum import ObservedSpectrum, observed_spectrum

_FITS = b"SIMPLE  ="


def read_spectrum(source: str | os.PathLike[str] | Any, choices: ReadChoices | None = None) -> ObservedSpectrum:
    """An observed spectrum from a file, or from a spectrum of specutils.

    Parameters
    ----------
    source : path or specutils.Spectrum
        FITS (image, cube, table, SDFITS, as CLASS exports it) or text.
    choices : ReadChoices, optional
        Units, rest frequency, frame, beam, noise, row and pixel, where the file does not state them.

    Returns
    -------
    ObservedSpectrum

    Raises
    ------
    ValueError
        With file and rule for what cannot be read.
    """
    if hasattr(source, "spectral_axis") and hasattr(source, "flux"):
        return from_specutils(source, choices)
    path = Path(source)
    if path.is_dir():
        raise ValueError(
            f"{path}: a folder; expected the file of a spectrum (an image of CASA is exported by exportfits)"
        )
    beginning = first_bytes(path, 80)
    if beginning.startswith(_FITS):
        from rotor.formats.spectra.fits_file import read_fits_spectrum

        return read_fits_spectrum(path, choices)
    if b"\0" in beginning:
        raise ValueError(
            f"{path}: a binary file that is not FITS; a file of CLASS is exported with its command FITS WRITE"
        )
    from rotor.formats.spectra.text import read_text_spectrum

    return read_text_spectrum(path, choices)


def from_specutils(spectrum: Any, choices: ReadChoices | None = None) -> ObservedSpectrum:
    """A one-dimensional `specutils.Spectrum` (Spectrum1D), its units converted by astropy."""
    from astropy import units as astropy_units

    choices = choices or ReadChoices()
    frequency = spectrum.spectral_axis.to_value(astropy_units.MHz, equivalencies=astropy_units.spectral())
    unit, factor = intensity_unit(choices.unit or str(spectrum.flux.unit), "spectrum of specutils")
    uncertainty = None
    if spectrum.uncertainty is not None:
        from astropy.nddata import StdDevUncertainty

        uncertainty = spectrum.uncertainty.represent_as(StdDevUncertainty).array * factor
    if choices.noise is not None:
        uncertainty = choices.noise
    return observed_spectrum(
        frequency,
        spectrum.flux.value * factor,
        noise=uncertainty,
        source="specutils",
        unit=unit,
        rest_mhz=choices.rest_mhz,
        frame=choices.frame or "SOURCE",
        beam_arcsec=choices.beam_arcsec,
    )
