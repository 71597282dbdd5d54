"""Peak lists: frequencies, intensities, uncertainties; their density; spurs of clocks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.table import Table

CLOCKS_MHZ = (10.0, 20.0, 25.0, 50.0, 100.0, 125.0, 200.0, 250.0, 500.0)
DENSITY_WIDTH_MHZ = 400.0
EMPTY = 30.0  # mean distances between peaks: a longer empty stretch was not recorded
LOG_WIDTH = 0.35  # of the kernel that estimates the density of ln intensity


@dataclass(frozen=True, eq=False, repr=False)
class PeakList(Table):
    """Peaks in order of frequency.

    frequency_mhz, intensity, uncertainty_mhz (n,). band_mhz : first and last recorded frequency. given_windows (k, 2) : recorded parts
    of the band, if known. trace : frequencies and intensities of each piece of the spectrum in which the peaks were found.
    notes : assumptions and omissions of the file.
    """

    frequency_mhz: Floats
    intensity: Floats
    uncertainty_mhz: Floats
    band_mhz: tuple[float, float]
    source: str = ""
    stated_windows: Floats | None = None
    trace: tuple[tuple[Floats, Floats], ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The three columns by name."""
        return {
            "frequency_mhz": self.frequency_mhz,
            "intensity": self.intensity,
            "uncertainty_mhz": self.uncertainty_mhz,
        }

    @cached_property
    def windows(self) -> Floats:
        """Recorded parts of the band (n, 2), without empty stretches in which thirty peaks would be expected."""
        if self.stated_windows is not None:
            return self.stated_windows
        f = np.concatenate([[self.band_mhz[0]], self.frequency_mhz, [self.band_mhz[1]]])
        steps = np.diff(f)
        # an empty stretch also needs a hundredth of the whole band
        empty = np.flatnonzero(steps > max(EMPTY * float(np.mean(steps)), 0.01 * (f[-1] - f[0])))
        inner = empty[(empty > 0) & (empty < len(steps) - 1)]
        first = np.concatenate([[f[0]], f[inner + 1] - 1.0])
        last = np.concatenate([f[inner] + 1.0, [f[-1]]])
        return np.column_stack([first, last])

    def covers(self, frequency_mhz: Floats) -> NDArray[np.bool_]:
        """Which frequencies were recorded: those in the band, or in its parts where they are known."""
        parts = np.array([self.band_mhz]) if self.stated_windows is None else self.stated_windows
        part = np.maximum(np.searchsorted(parts[:, 0], frequency_mhz, side="right") - 1, 0)
        return np.asarray((frequency_mhz >= parts[part, 0]) & (frequency_mhz <= parts[part, 1]))

    def where(self, mask: NDArray[np.bool_]) -> PeakList:
        """The peaks selected by a mask."""
        return replace(
            self,
            frequency_mhz=self.frequency_mhz[mask],
            intensity=self.intensity[mask],
            uncertainty_mhz=self.uncertainty_mhz[mask],
            stated_windows=self.windows,
        )

    @cached_property
    def log_intensity(self) -> Floats:
        """ln of the intensities."""
        return np.log(self.intensity)

    @cached_property
    def log_threshold(self) -> float:
        """ln of the detection threshold: the intensity of the weakest peak, without outliers."""
        return float(np.quantile(self.log_intensity, 0.02))  # the weakest 2 % of the peaks are left aside

    @cached_property
    def log_density(self) -> Floats:
        """ln of the density of peaks per MHz and per unit of ln intensity, at each peak (n,)."""
        per_mhz = local_density(self.frequency_mhz, self.frequency_mhz, self.band_mhz)
        return np.log(per_mhz) + _log_density(self.log_intensity)


def peak_list(
    frequency_mhz: Any,
    intensity: Any,
    uncertainty_mhz: Any = None,
    *,
    band_mhz: tuple[float, float] | None = None,
    source: str = "",
) -> PeakList:
    """A peak list from numbers, sorted and checked.

    Parameters
    ----------
    frequency_mhz, intensity : (n,) arrays
        Intensities on a linear scale, above 0.
    uncertainty_mhz : (n,) array or float, optional
        Standard errors of the frequencies; 0.01 MHz by default.
    band_mhz : (float, float), optional
        First and last recorded frequency. Default: those of the peaks.
    source : str
        Named in messages.

    Returns
    -------
    PeakList

    Raises
    ------
    ValueError
        Fewer than two peaks, columns of different length, numbers that are not finite or not above 0, frequencies in GHz.

    Examples
    --------
    >>> peak_list([6000.0, 5000.0], [1.0, 2.0]).frequency_mhz.tolist()
    [5000.0, 6000.0]
    """
    f, height = np.asarray(frequency_mhz, dtype=np.float64), np.asarray(intensity, dtype=np.float64)
    error = np.broadcast_to(np.asarray(0.01 if uncertainty_mhz is None else uncertainty_mhz, dtype=np.float64), f.shape)
    where = f"{source}: " if source else ""
    if f.ndim != 1 or f.shape != height.shape:
        raise ValueError(
            f"{where}{f.shape} frequencies and {height.shape} intensities; two columns of equal length are needed"
        )
    if len(f) < 2:
        raise ValueError(
            f"{where}{len(f)} peak: constants need more; at least 5 lines of a species must be in the list"
        )
    for name, column in (("frequency_mhz", f), ("intensity", height), ("uncertainty_mhz", error)):
        bad = np.flatnonzero(~(np.isfinite(column) & (column > 0)))
        if len(bad):
            hint = "; give heights on a linear scale, with the baseline at 0" if name == "intensity" else ""
            raise ValueError(
                f"{where}row {bad[0] + 1}: {name} is {column[bad[0]]:g}; a finite number above 0 is needed{hint}"
            )
    if f.max() < 500.0:
        raise ValueError(
            f"{where}frequencies from {f.min():g} to {f.max():g}: below 500 MHz no top has a spectrum that can be searched; "
            "if they are in GHz, multiply by 1000"
        )
    order = np.argsort(f, kind="stable")
    band = band_mhz or (float(f.min()), float(f.max()))
    return PeakList(f[order], height[order], error[order], band, source)


def local_density(at: Floats, frequency: Floats, band_mhz: tuple[float, float]) -> Floats:
    """Peaks per MHz near frequencies, from counts (plus one) in a window of 400 MHz within the band."""
    first = np.clip(at - DENSITY_WIDTH_MHZ / 2, band_mhz[0], max(band_mhz[0], band_mhz[1] - DENSITY_WIDTH_MHZ))
    last = np.minimum(first + DENSITY_WIDTH_MHZ, band_mhz[1])
    counts = np.searchsorted(frequency, last, side="right") - np.searchsorted(frequency, first)
    # one more than counted, so that no stretch has a density of 0
    return np.asarray((counts + 1.0) / np.maximum(last - first, 1.0))


def _log_density(values: Floats) -> Floats:
    # spacing of a quarter of the width resolves the kernel
    """ln of a kernel estimate of a density at the values themselves."""
    grid = np.arange(values.min() - 2, values.max() + 2, LOG_WIDTH / 4)
    counts = np.bincount(np.searchsorted(grid, values), minlength=len(grid)).astype(np.float64)
    reach = np.arange(-16, 17) * (LOG_WIDTH / 4)  # four widths of the kernel
    kernel = np.exp(-0.5 * (reach / LOG_WIDTH) ** 2)
    smooth = np.convolve(counts, kernel / kernel.sum(), mode="same") / (len(values) * LOG_WIDTH / 4)
    # no density of 0: its logarithm is needed
    return np.asarray(np.log(np.maximum(np.interp(values, grid, smooth), 1e-6)))


def spurs(peaks: PeakList) -> NDArray[np.bool_]:
    """Which peaks are harmonics of a clock: more multiples of its frequency than expected by chance.

    For each clock the peaks within 0.03 MHz of multiples are counted; they are spurs if the Poisson probability of this number is
    below 1e-4.
    """
    out = np.zeros(len(peaks), dtype=bool)
    f = peaks.frequency_mhz
    for clock in CLOCKS_MHZ:
        apart = np.abs(f - clock * np.round(f / clock))  # distance to the nearest harmonic of the clock
        near = apart < 0.03
        expected = float(np.sum(~out)) * 0.06 / clock  # a window of 2 · 0.03 MHz in each period of the clock
        if _poisson_tail(int(near.sum()), expected) < 1e-4:  # more coincidences than chance explains
            out |= near
    return out


def _poisson_tail(count: int, mean: float) -> float:
    """P(n ≥ count)."""
    from math import exp

    term, below = exp(-mean), 0.0
    for n in range(count):
        below += term
        term *= mean / (n + 1)
    return max(0.0, 1.0 - below)  # round-off may leave less than 0
