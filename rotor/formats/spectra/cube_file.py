"""Cubes in FITS, masks of their pixels, and maps of fitted parameters with the celestial coordinates of the cube."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.formats.spectra.axis import ReadChoices, intensity_unit
from rotor.formats.spectra.fits_file import (
    astropy_fits,
    image_axis_mhz,
    read_beam,
    rest_frame,
    spectral_axis_number,
    unreadable,
)
from rotor.observed.cube import CubeFit
from rotor.observed.spectrum import JANSKY_PER_BEAM, KELVIN, kelvin_per_jansky, noise_level
from rotor.version import version

_UNITS = {
    "column_per_cm2": "cm-2",
    "excitation_k": "K",
    "velocity_km_s": "km s-1",
    "fwhm_km_s": "km s-1",
    "size_arcsec": "arcsec",
}
_LEAST_FINITE = 0.5  # smallest share of finite channels of a pixel that is fitted


@dataclass(frozen=True)
class Cube:
    """Brightness over the sky: frequency_mhz (n,) rising, intensity_k (n, y, x) with nan for missing values, noise_k (y, x).

    sky: cards of the celestial coordinates. beam_arcsec, frame, rest_mhz, source: as in `ObservedSpectrum`.
    """

    frequency_mhz: Floats
    intensity_k: NDArray[Any]
    noise_k: Floats
    sky: Any
    beam_arcsec: tuple[float, float] | None
    frame: str
    rest_mhz: float | None
    source: str

    def between(self, first_mhz: float, last_mhz: float) -> Cube:
        """The channels of a range; ValueError if there are none."""
        first, last = np.searchsorted(self.frequency_mhz, [first_mhz, np.nextafter(last_mhz, np.inf)]).tolist()
        if first == last:
            span = f"{self.frequency_mhz[0]:.10g} to {self.frequency_mhz[-1]:.10g} MHz"
            raise ValueError(f"{self.source}: no channels from {first_mhz:.10g} to {last_mhz:.10g} MHz; it has {span}")
        return Cube(
            self.frequency_mhz[first:last], self.intensity_k[first:last], self.noise_k, self.sky, self.beam_arcsec,
            self.frame, self.rest_mhz, self.source,
        )  # fmt: skip


def read_cube(path: Path, choices: ReadChoices | None = None) -> Cube:
    """The cube in a FITS file, in K.

    choices: settings that the header does not state. By default the noise of each pixel is estimated from its line-free channels.
    Raises ValueError with file and rule: no image of three axes, no spectral axis, missing or unknown units, Jy/beam without a beam.
    Raises ImportError without astropy.
    """
    fits, choices, name = astropy_fits(), choices or ReadChoices(), str(path)
    try:
        opened = fits.open(path, memmap=False)
    except OSError as error:
        raise unreadable(path, error) from None
    with opened as units_of_file:
        image = next((hdu for hdu in units_of_file if hdu.data is not None), None)
        if image is None or isinstance(image, fits.BinTableHDU):
            raise ValueError(f"{path}: no image; maps need a cube of two axes of the sky and one of frequency")
        header, data = image.header, np.asarray(image.data)
    axis = spectral_axis_number(header, name)
    planes = np.moveaxis(data, data.ndim - axis, 0)
    if any(length > 1 for length in planes.shape[1:-2]) or planes.ndim < 3:
        raise ValueError(f"{path}: an image of {data.shape[::-1]}; maps need two axes of the sky and one of frequency")
    planes = planes.reshape(planes.shape[0], *planes.shape[-2:])
    frequency, rest = image_axis_mhz(header, axis, len(planes), name, choices)
    order = np.argsort(frequency, kind="stable")
    beam = read_beam(header, choices)
    factor = _to_kelvin(header, frequency, beam, name, choices)
    values = planes[order] * factor[order, None, None].astype(planes.dtype if planes.dtype.kind == "f" else np.float64)
    noise = _noise(values, None if choices.noise is None else choices.noise * float(np.median(factor)))
    return Cube(frequency[order], values, noise, _sky(header), beam, choices.frame or rest_frame(header), rest, name)


def _to_kelvin(
    header: Any, frequency: Floats, beam: tuple[float, float] | None, name: str, choices: ReadChoices
) -> Floats:
    """Factors from the unit of a file to K, (n,)."""
    stated = choices.unit or header.get("BUNIT")
    unit, factor = intensity_unit(None if stated is None else str(stated), name)
    if unit == KELVIN:
        return np.full(len(frequency), factor)
    if unit != JANSKY_PER_BEAM:
        raise ValueError(f"{name}: a cube in {unit} has no brightness temperature; expected K or Jy/beam")
    if beam is None:
        raise ValueError(f"{name}: Jy/beam without a beam; state its width, such as --beam 0.5")
    return factor * kelvin_per_jansky(frequency, beam)


def _noise(values: NDArray[Any], stated: float | None) -> Floats:
    """Noise of each pixel; nan if too few channels are finite."""
    shape = values.shape[1:]
    finite = np.isfinite(values)
    enough = finite.mean(axis=0) >= _LEAST_FINITE
    if stated is not None:
        return np.where(enough, stated, np.nan)
    out = np.full(shape, np.nan)
    for y, x in np.argwhere(enough).tolist():
        out[y, x] = noise_level(values[finite[:, y, x], y, x].astype(np.float64))
    return out


def _sky(header: Any) -> Any:
    """Cards of the two axes of the sky; none where the header has no celestial coordinates."""
    import warnings

    from astropy.wcs import WCS, FITSFixedWarning

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FITSFixedWarning)  # old keywords and dates are translated
        world = WCS(header)
        return world.celestial.to_header() if world.has_celestial else None


def read_mask(path: Path, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Pixels (y, x) of an image that are finite and not 0; ValueError for another shape than that of the cube."""
    fits = astropy_fits()
    try:
        with fits.open(path, memmap=False) as opened:
            image = next((np.asarray(hdu.data) for hdu in opened if hdu.data is not None), None)
    except OSError as error:
        raise unreadable(path, error) from None
    flat = None if image is None or image.ndim < 2 else image.reshape(-1, *image.shape[-2:])
    if flat is None or flat.shape != (1, *shape):
        pixels = "no image" if image is None else " by ".join(map(str, image.shape[::-1]))
        raise ValueError(f"{path}: a mask of {pixels} pixels; the cube has {shape[1]} by {shape[0]}")
    return np.asarray(np.isfinite(flat[0]) & (flat[0] != 0))


def write_maps(fit: CubeFit, cube: Cube, path: Path, command: str = "") -> None:
    """Write maps as extensions: each parameter and its error, χ²/ν, and the pixels whose fit converged."""
    fits = astropy_fits()
    primary = fits.PrimaryHDU()
    primary.header["ORIGIN"] = f"rotor {version()}"
    for line in filter(None, (f"maps of {Path(cube.source).name}", command)):
        primary.header["HISTORY"] = line.encode("ascii", "replace").decode("ascii")
    hdus = [primary]
    for name, variable, value, error in zip(fit.names, fit.parameters, fit.values, fit.errors, strict=True):
        for end, plane in (("", value), (" error", error)):
            hdus.append(_plane(plane, name + end, _UNITS[variable], cube))
    hdus += [_plane(fit.reduced_chi_squared, "chi2", "", cube), _plane(fit.fitted, "converged", "", cube)]
    fits.HDUList(hdus).writeto(path, overwrite=True)


def _plane(values: NDArray[Any], name: str, unit: str, cube: Cube) -> Any:
    fits = astropy_fits()
    plane = values.astype(np.int16) if values.dtype == np.bool_ else values.astype(np.float32)
    if np.isfinite(values).any() and np.nanmax(np.abs(values)) > np.finfo(np.float32).max / 10:
        plane = values  # column densities of doubles that float cannot hold
    hdu = fits.ImageHDU(plane, header=cube.sky, name=name.encode("ascii", "replace").decode("ascii"))
    if unit:
        hdu.header["BUNIT"] = unit
    return hdu
