"""`rotor emission --fit cube.fits --maps maps.fits`: the fit of a source in every pixel of a cube."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.frozen import dataclass
from rotor.reports.screen import Part, record_table
from rotor.requests.readers import INFINITE
from rotor.verbs.observed_request import ObservedRequest, components_of, fit_choices, sight_of, species_in
from rotor.verbs.outputs import Report
from rotor.verbs.verb import Work

if TYPE_CHECKING:
    from rotor.formats.spectra.cube_file import Cube
    from rotor.observed.cube import CubeFit


@dataclass(frozen=True)
class Mapped:
    """A cube and the maps of its fit. pixels: number of fitted pixels."""

    request: ObservedRequest
    cube: Cube
    fit: CubeFit
    pixels: int

    table = None

    def facts(self) -> dict[str, Any]:
        """Cube and maps, by the keys of docs/verbs."""
        cube = self.cube
        return {
            "cube": {
                "source": cube.source,
                "pixels": list(cube.noise_k.shape[::-1]),
                "channels": len(cube.frequency_mhz),
                "range_mhz": [float(cube.frequency_mhz[0]), float(cube.frequency_mhz[-1])],
                "frame": cube.frame,
                "beam_arcsec": None if cube.beam_arcsec is None else list(cube.beam_arcsec),
                "noise_k": float(np.nanmedian(cube.noise_k)),
            },
            "pixels": self.pixels,
            "converged": int(self.fit.fitted.sum()),
            "reduced_chi_squared": _quantiles(self.fit.reduced_chi_squared)[1],
            "maps": self._rows(),
        }

    def _rows(self) -> list[dict[str, Any]]:
        rows = []
        for name, value, error in zip(self.fit.names, self.fit.values, self.fit.errors, strict=True):
            ends = dict(zip(("low", "median", "high"), _quantiles(value), strict=True))
            rows.append({"name": name, **ends, "determined": int(np.isfinite(error).sum())})
        return rows

    def parts(self) -> Iterable[Part]:
        """The cube, and the range of each map."""
        cube = self.cube
        width, height = cube.noise_k.shape[::-1]
        first, last = cube.frequency_mhz[0], cube.frequency_mhz[-1]
        size = f"{width} by {height} pixels, {len(cube.frequency_mhz)} channels from {first:.6f} to {last:.6f} MHz"
        yield [
            ("cube", f"{cube.source}: {size}, frame {cube.frame}"),
            ("noise", f"{float(np.nanmedian(cube.noise_k)):.4g} K a channel, median of the pixels"),
            ("fitted", f"{self.pixels} pixels, {int(self.fit.fitted.sum())} of them converged"),
            ("χ²/ν", f"{_quantiles(self.fit.reduced_chi_squared)[1]:.4g}, median"),
        ]
        columns = {
            "parameter": "{name}",
            "16 %": "{low:.5g}",
            "median": "{median:.5g}",
            "84 %": "{high:.5g}",
            "determined": "{determined}",
        }
        yield record_table("pixels of each map", columns, self._rows(), {"parameter"})


def _quantiles(values: Any) -> tuple[float | None, ...]:
    """16, 50 and 84 % quantiles of the finite values; None without any."""
    finite = values[np.isfinite(values)]
    return tuple(np.quantile(finite, (0.16, 0.5, 0.84)).tolist()) if len(finite) else (None, None, None)


def refuse(request: ObservedRequest, outputs: Mapping[str, Any], _: Any) -> None:
    """Refuse a picture of draws without its package, before the fit."""
    if "corner" in outputs:
        from rotor.observed.sampling import load_corner

        load_corner()


def answer(request: ObservedRequest, work: Work) -> Mapped:
    """Read the cube, start from its brightest pixel, and fit every pixel."""
    from rotor.formats.spectra.cube_file import read_cube, read_mask
    from rotor.observed.cube import fit_cube
    from rotor.observed.spectrum import observed_spectrum

    cube = read_cube(Path(request.fit or ""), request.spectrum.choices)
    if request.range_mhz != INFINITE:
        cube = cube.between(*request.range_mhz)
    peak = np.max(np.where(np.isfinite(cube.intensity_k), cube.intensity_k, -np.inf), axis=0)
    shape = cube.noise_k.shape
    chosen = peak > 5 * cube.noise_k if request.mask is None else read_mask(Path(request.mask), shape)
    chosen = chosen & np.isfinite(cube.noise_k)
    if not chosen.any():
        where = (
            "inside the mask with noise and half of its channels" if request.mask else "above five standard deviations"
        )
        raise ValueError(f"{cube.source}: no pixel {where}, nothing to fit")
    y, x = np.unravel_index(np.argmax(np.where(chosen, peak, -np.inf)), shape)
    brightest = observed_spectrum(
        cube.frequency_mhz, cube.intensity_k[:, y, x], noise=float(cube.noise_k[y, x]), beam_arcsec=cube.beam_arcsec,
        source=f"{cube.source}, pixel {x + 1},{y + 1}", rest_mhz=cube.rest_mhz, frame=cube.frame,
    )  # fmt: skip
    sight = sight_of(brightest, request)
    start = components_of(brightest, species_in(brightest, request, work.note), sight, request)
    work.note(f"the search begins at the brightest pixel, {x + 1},{y + 1}")
    choices = fit_choices(request)
    noise = np.where(chosen, cube.noise_k, 1.0)
    fit = fit_cube(
        cube.frequency_mhz, cube.intensity_k, noise, start, sight, choices, mask=chosen, executor=work.executor
    )
    return Mapped(request, cube, fit, int(chosen.sum()))


def write(mapped: Mapped, path: Path, report: Report) -> None:
    """Write the maps with the coordinates of the cube."""
    from rotor.formats.spectra.cube_file import write_maps

    write_maps(mapped.fit, mapped.cube, path, str(report.content["command"]))
