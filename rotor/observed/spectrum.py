"""An observed spectrum: intensity against frequency, with noise, unit, frame and beam from its file.

Clipping selects the line-free channels. With the median and 1.4826 times the median absolute deviation of the remaining channels (P. J.
Huber, Robust Statistics, 1981, chapter 5), channels beyond three deviations are removed with their neighbours, until none is removed.
Baselines are Legendre polynomials through the line-free channels. The Rayleigh-Jeans law converts flux density to brightness:

    T_B = c² S/(2 k ν² Ω),  Ω = π θ_1 θ_2/(4 ln 2), the integral of a Gaussian beam
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor import units
from rotor.arrays import Floats
from rotor.table import Table, counted

KELVIN, JANSKY_PER_BEAM, ABSORBANCE, VOLT = "K", "Jy/beam", "absorbance", "V"
UNITS = (KELVIN, JANSKY_PER_BEAM, ABSORBANCE, VOLT)
ARCSEC = math.pi / 180 / 3600
_CLIP = 3.0
_LOW_MHZ = 1000.0  # a band below has hardly a rotational line; in GHz it is that of most telescopes
_HIGH_MHZ = 1e9  # above visible light
_MAD = 1.4826
_LEAST_CHANNELS = 16


@dataclass(frozen=True, eq=False, repr=False)
class ObservedSpectrum(Table):
    """Channels (n,) of rising frequency with finite intensities.

    frequency_mhz: in the stated frame. intensity: in `unit`. noise (n,): one standard deviation of each channel. unit: one of `UNITS`.
    rest_mhz: rest frequency of the header, or None. frame: LSRK, BARYCENT, TOPOCENT, SOURCE, ... as in the file. beam_arcsec:
    full widths at half maximum, None if unknown. source: file or origin. notes: assumptions and omissions.
    header: further facts by name.
    """

    frequency_mhz: Floats
    intensity: Floats
    noise: Floats
    unit: str = KELVIN
    rest_mhz: float | None = None
    frame: str = "SOURCE"
    beam_arcsec: tuple[float, float] | None = None
    source: str = ""
    notes: tuple[str, ...] = ()
    header: dict[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.frequency_mhz)

    @property
    def columns(self) -> dict[str, Any]:
        """frequency_mhz, intensity, noise."""
        return {"frequency_mhz": self.frequency_mhz, "intensity": self.intensity, "noise": self.noise}

    @property
    def provenance(self) -> dict[str, Any]:
        """File, unit, frame, beam, and assumptions."""
        return {
            "source": self.source,
            "unit": self.unit,
            "frame": self.frame,
            "rest_mhz": self.rest_mhz,
            "beam_arcsec": None if self.beam_arcsec is None else list(self.beam_arcsec),
            "noise": float(np.median(self.noise)),
            "notes": list(self.notes),
            **self.header,
            "rows": len(self),
        }

    @property
    def channel_mhz(self) -> float:
        """Median distance of neighbouring channels."""
        return float(np.median(np.diff(self.frequency_mhz))) if len(self) > 1 else 0.0

    def where(self, chosen: NDArray[Any] | slice) -> ObservedSpectrum:
        """The channels selected by a slice or a mask."""
        return replace(
            self, frequency_mhz=self.frequency_mhz[chosen], intensity=self.intensity[chosen], noise=self.noise[chosen]
        )

    def between(self, first_mhz: float, last_mhz: float) -> ObservedSpectrum:
        """The channels in a range of frequencies; ValueError if there are none."""
        inside = (self.frequency_mhz >= first_mhz) & (self.frequency_mhz <= last_mhz)
        if not inside.any():
            raise ValueError(
                f"{self.source or 'spectrum'}: no channels from {first_mhz:.10g} to {last_mhz:.10g} MHz; it has "
                f"{self.frequency_mhz[0]:.10g} to {self.frequency_mhz[-1]:.10g} MHz"
            )
        return self.where(inside)


def observed_spectrum(
    frequency_mhz: ArrayLike, intensity: ArrayLike, *, noise: ArrayLike | None = None, source: str = "", **facts: Any
) -> ObservedSpectrum:
    """A spectrum from columns (n,) in any order.

    Parameters
    ----------
    frequency_mhz, intensity : (n,) array
        Channels that are not finite are left out, with a note.
    noise : float or (n,) array, optional
        One standard deviation; by default estimated from the line-free channels.
    source : str, optional
        Origin of the numbers, for messages.
    **facts :
        unit, rest_mhz, frame, beam_arcsec, notes and header of `ObservedSpectrum`.

    Returns
    -------
    ObservedSpectrum

    Raises
    ------
    ValueError
        For columns of different length, fewer than two finite channels, two channels at the same frequency, noise not above 0, and an
        unknown unit.

    Examples
    --------
    >>> spectrum = observed_spectrum([3.0, 2.0, 1.0], [0.3, float("nan"), 0.1], noise=0.1)
    >>> spectrum.frequency_mhz.tolist(), spectrum.notes
    ([1.0, 3.0], ('1 channel without a finite number left out',))
    """
    x, y = (np.array(values, dtype=np.float64) for values in (frequency_mhz, intensity))
    if x.ndim != 1 or x.shape != y.shape:
        raise ValueError(
            f"{source or 'spectrum'}: {x.shape} frequencies for {y.shape} intensities; expected columns (n,)"
        )
    spread = None if noise is None else np.broadcast_to(np.asarray(noise, dtype=np.float64), x.shape)
    finite = np.isfinite(x) & np.isfinite(y)
    if spread is not None:
        finite &= np.isfinite(spread)
    order = np.flatnonzero(finite)[np.argsort(x[finite], kind="stable")]
    x, y = x[order], y[order]
    _refuse_bad_axis(x, source)
    notes = (*facts.pop("notes", ()), *lost_channels(~finite))
    if facts.get("unit", KELVIN) not in UNITS:
        raise ValueError(f"{source or 'spectrum'}: unit {facts['unit']!r}: known are {', '.join(UNITS)}")
    if spread is None:
        level = noise_level(y)
        notes += (f"noise of {level:.4g} {facts.get('unit', KELVIN)} estimated from line-free channels",)
        sigma = np.full(len(x), level)
    else:
        sigma = spread[order].copy()
    if not (sigma > 0).all():
        raise ValueError(f"{source or 'spectrum'}: noise of 0 or less; state the noise of a channel")
    return ObservedSpectrum(x, y, sigma, source=source, notes=notes, **facts)


def lost_channels(lost: NDArray[np.bool_]) -> tuple[str, ...]:
    """The note on channels that are left out; none if there are none."""
    return (f"{counted(int(lost.sum()), 'channel')} without a finite number left out",) if lost.any() else ()


def _refuse_bad_axis(frequency: Floats, source: str) -> None:
    name = source or "spectrum"
    if len(frequency) < 2:
        raise ValueError(f"{name}: {counted(len(frequency), 'finite channel')}; expected two or more")
    if frequency[0] <= 0:
        raise ValueError(f"{name}: a frequency of {frequency[0]:g} MHz; expected frequencies above 0")
    if (np.diff(frequency) == 0).any():
        twice = frequency[:-1][np.diff(frequency) == 0][0]
        raise ValueError(f"{name}: two channels at {twice:.10g} MHz; expected each frequency once")


def band_text(first_mhz: float, last_mhz: float) -> str:
    """The ends of a band in words; of a band that is low for rotational lines, with the unit that may be meant.

    >>> band_text(84e3, 116e3), band_text(84.0, 116.0)
    ('from 84000 to 116000 MHz', 'from 84 to 116 MHz; for a file in GHz give --axis-unit GHz')
    """
    unit = "GHz" if last_mhz < _LOW_MHZ else "Hz" if first_mhz > _HIGH_MHZ else ""
    hint = f"; for a file in {unit} give --axis-unit {unit}" if unit else ""
    return f"from {first_mhz:.10g} to {last_mhz:.10g} MHz{hint}"


def line_free(intensity: Floats, widen: int = 2) -> NDArray[np.bool_]:
    """Mask (n,) of line-free channels, by clipping at three deviations together with `widen` neighbours of each clipped channel."""
    selected = np.ones(len(intensity), dtype=np.bool_)
    for _ in range(50):
        middle, deviation = _middle(intensity[selected])
        beyond = np.abs(intensity - middle) > _CLIP * deviation
        # a single channel beyond three deviations is noise as often as a line: only pairs take their neighbours along
        pairs = beyond & (np.roll(beyond, 1) | np.roll(beyond, -1))
        wide = np.convolve(pairs, np.ones(2 * widen + 1))[widen : len(pairs) + widen] > 0
        now = ~(wide | beyond)
        if now.sum() < max(_LEAST_CHANNELS, len(intensity) // 50) or (now == selected).all():
            break
        selected = now
    return selected


def _middle(values: Floats) -> tuple[float, float]:
    """Median and robust standard deviation."""
    middle = float(np.median(values))
    return middle, _MAD * float(np.median(np.abs(values - middle)))


def noise_level(intensity: Floats) -> float:
    """Standard deviation of the line-free channels, corrected for the clipping of a Gaussian at three deviations."""
    free = intensity[line_free(intensity)]
    clipped = 0.98658  # √(1 - 6 φ(3)/(2 Φ(3) - 1)): the deviation of a Gaussian cut at three deviations
    return max(_middle(free)[1], float(np.std(free)) / clipped) if len(free) > 1 else float(np.std(intensity))


def without_baseline(spectrum: ObservedSpectrum, order: int) -> ObservedSpectrum:
    """The spectrum minus a Legendre polynomial of this order through its line-free channels, with a new estimate of the noise.

    Raises ValueError for an order below 0, and for fewer than four line-free channels for each coefficient.
    """
    if order < 0:
        raise ValueError(f"baseline order {order}: expected 0 or more")
    x = 2 * (spectrum.frequency_mhz - spectrum.frequency_mhz[0]) / np.ptp(spectrum.frequency_mhz) - 1
    flat = spectrum.intensity
    for _ in range(5):  # lines are detected better after a baseline is subtracted
        free = line_free(flat)
        if free.sum() < 4 * (order + 1):
            raise ValueError(
                f"{spectrum.source or 'spectrum'}: {int(free.sum())} line-free channels for a baseline of order {order}"
            )
        series = np.polynomial.legendre.Legendre.fit(x[free], spectrum.intensity[free], order, domain=[-1, 1])
        flat = spectrum.intensity - series(x)
    note = f"baseline of order {order} through {int(free.sum())} line-free channels subtracted"
    return replace(
        spectrum, intensity=flat, noise=np.full(len(spectrum), noise_level(flat)), notes=(*spectrum.notes, note)
    )


def in_kelvin(spectrum: ObservedSpectrum, beam_arcsec: tuple[float, float] | None = None) -> ObservedSpectrum:
    """The spectrum as brightness temperature (Rayleigh-Jeans); ValueError for Jy/beam without a beam and for other units."""
    if spectrum.unit == KELVIN:
        return spectrum
    beam = beam_arcsec or spectrum.beam_arcsec
    if spectrum.unit != JANSKY_PER_BEAM:
        fitting = {ABSORBANCE: "rotor emission --fit FILE (a gas cell)", VOLT: "rotor spectrum MOLECULE --over FILE"}
        raise ValueError(
            f"{spectrum.source or 'spectrum'}: a spectrum in {spectrum.unit} has no brightness temperature; its temperature follows from "
            f"{fitting[spectrum.unit]}"
        )
    if beam is None:
        raise ValueError(
            f"{spectrum.source or 'spectrum'}: Jy/beam without a beam; state its width, such as --beam 0.5"
        )
    factor = kelvin_per_jansky(spectrum.frequency_mhz, beam)
    note = f"Jy/beam to K with a beam of {beam[0]:g} x {beam[1]:g} arcsec"
    return replace(
        spectrum,
        intensity=spectrum.intensity * factor,
        noise=spectrum.noise * factor,
        unit=KELVIN,
        beam_arcsec=beam,
        notes=(*spectrum.notes, note),
    )


def kelvin_per_jansky(frequency_mhz: ArrayLike, beam_arcsec: tuple[float, float]) -> Floats:
    """T_B of 1 Jy/beam, (n,).

    >>> round(float(kelvin_per_jansky(230e3, (0.5, 0.5))), 2)  # 1.222e6 /(GHz² arcsec²) K
    92.41
    """
    solid = math.pi * beam_arcsec[0] * beam_arcsec[1] * ARCSEC**2 / (4 * math.log(2))
    hertz = np.asarray(frequency_mhz, dtype=np.float64) * 1e6
    return np.asarray(
        1e-26 * units.SPEED_OF_LIGHT_M_PER_S**2 / (2 * units.BOLTZMANN_J_PER_K * hertz**2 * solid), dtype=np.float64
    )
