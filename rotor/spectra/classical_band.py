"""The rotational band of a gas from its classical dipole correlation function, for comparison with the quantum lines.

With S(ν) = ∫ C1(t) cos(2πνt) dt of the classical gas, x = hν/kT and the constant of `lines.py`,

    σ(ν) = (8π³/3hc) ν (1 - e^-x) F(x) μ² S(ν),        ∫ S dν = 1 over positive and negative ν

(R. G. Gordon, J. Chem. Phys. 43, 1307 (1965)). A classical S is even and violates detailed balance; F restores it,
S(-ν) = e^-x S(ν), and is a choice:

    harmonic     F = x/(1 - e^-x)       (1 - e^-x) F = x             keeps the integral of σ; exact for an oscillator
    standard     F = 2/(1 + e^-x)                      2 tanh(x/2)   the symmetrised S is replaced by the classical one
    schofield    F = e^(x/2)                           2 sinh(x/2)   P. Schofield, Phys. Rev. Lett. 4, 239 (1960)
    egelstaff    as schofield, with C1(√(t² + (ħ/2kT)²))                   P. A. Egelstaff, Adv. Phys. 11, 203 (1962)

R. Ramírez et al., J. Chem. Phys. 121, 3973 (2004), compare them: only the harmonic factor agrees with the fluctuation-dissipation theorem.
It is the default, and also the result of classical linear response, so that σ contains no correction.
For a rigid top the area of the band is the same in classical and quantum mechanics, at any temperature and for any spin weights, because
[μ, [H, μ]] is a number:

    ∫ σ dν = (8π³/3hc) Σ_k B_k (μ² - μ_k²),     k = a, b, c, B_k = A, B, C.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from rotor import units
from rotor.arrays import Floats
from rotor.classical.gas.correlations import plateau, short_time
from rotor.classical.gas.ensembles import free_gas_correlations
from rotor.spectra.intensity import INTENSITY_NM2_MHZ
from rotor.spectra.lines import Lines
from rotor.spectra.profiles import gaussian
from rotor.spectra.spectrum import Spectrum
from rotor.tops.constants.constants import Constants

if TYPE_CHECKING:
    from rotor.tops.top import Top

Correction = Literal["harmonic", "standard", "schofield", "egelstaff"]

HZ_PER_MHZ_PS = 1e-6  # MHz times ps is a pure number after this factor
REACH = 6.0  # upper end of the band, in units of its root mean square frequency
WINDOW_SHARE = 0.25  # of the requested width comes from the window in time, the rest from the convolution
WINDOW_END = 1e-4  # value of the window at the last time
POINTS_PER_WIDTH = 16


@dataclass(frozen=True)
class BandComparison:
    """Two bands compared, the first relative to the second.

    area: ratio of the integrals. mean: ratio of the mean frequencies ∫νσ/∫σ. peak: ratio of the maxima. largest: largest |difference| on
    the grid over the maximum of the second; at_mhz: its position.
    """

    area: float
    mean: float
    peak: float
    largest: float
    at_mhz: float


def dipole_band_area(top: Top) -> float:
    """∫ σ dν of a rigid top in nm² MHz, classical or quantum, at any temperature; see the head of this module.

    >>> from rotor.tops.top import Top
    >>> area = dipole_band_area(Top.from_constants("B=57635.968 MHz", dipole_abc_debye=(0.11, 0, 0)))
    >>> round(area / (4.16238e-5 * 2 * 57635.968 * 0.11**2), 5)  # 2 B μ²
    1.0
    """
    dipole = _dipole(top)
    total = float(dipole @ dipole)
    constants = top.rotational_constants_mhz
    # a linear molecule has infinite A and no rotation about a
    return INTENSITY_NM2_MHZ * math.fsum(
        b * (total - m * m) for b, m in zip(constants, dipole, strict=True) if b < math.inf
    )


def classical_band(
    top: Top,
    grid_mhz: ArrayLike,
    *,
    fwhm_mhz: float,
    temperature_k: float = 300.0,
    correction: Correction = "harmonic",
    molecules: int = 200_000,
    rng: np.random.Generator,
    executor: ThreadPoolExecutor | None = None,
    progress: Callable[[int], object] | None = None,
) -> Spectrum:
    """Absorption cross section of a classical free gas of rigid tops, smoothed by a Gaussian.

    The times of the simulation follow from the width and the band.

    Parameters
    ----------
    top : Top
        With a dipole; only its A, B, C are used.
    grid_mhz : (n,) array
        Frequencies.
    fwhm_mhz : float
        Full width at half maximum of the Gaussian, as in `Spectrum.from_lines`, so that both spectra can be compared.
    temperature_k : float, optional
        Temperature of the gas.
    correction : "harmonic", "standard", "schofield" or "egelstaff", optional
        The factor that restores detailed balance; see the head of the module.
    molecules : int, optional
        Number of molecules; the scatter of σ falls as 1/√molecules. It is about 1 % of the peak for 2e5 water molecules and a width
        of a tenth of the band.
    rng : numpy.random.Generator
        Draws the gas.
    executor : ThreadPoolExecutor, optional
        Shares the work over molecules.
    progress : callable, optional
        Called with the number of molecules finished.

    Returns
    -------
    Spectrum
        σ (n,) in nm² per molecule.

    Raises
    ------
    ValueError
        For a top without a dipole, and as `band_from_correlation`.

    Notes
    -----
    Neglected: quantum effects except the factor `correction`, distortion, spin weights (a hot gas averages them).
    """
    dipole, moments = _dipole(top), np.array(top.moments_u_angstrom2)
    kt = units.EV_PER_K * temperature_k
    times = band_times(top, temperature_k, fwhm_mhz)
    gas = free_gas_correlations(
        moments, kt, times / units.ASE_TIME_PS, vector=dipole, molecules=molecules, rng=rng, executor=executor,
        progress=progress,
    )  # fmt: skip
    assert gas.c1 is not None
    return band_from_correlation(
        times, gas.c1 - plateau(moments, dipole), float(dipole @ dipole), grid_mhz, fwhm_mhz=fwhm_mhz,
        temperature_k=temperature_k, correction=correction,
    )  # fmt: skip


def band_times(top: Top, temperature_k: float, fwhm_mhz: float) -> Floats:
    """Evenly spaced times in ps (n,) from 0 to the closing of the window, for the band of a top and a width."""
    if not (math.isfinite(temperature_k) and temperature_k > 0):
        raise ValueError(f"temperature {temperature_k} K: a temperature is above 0 K")
    if not (math.isfinite(fwhm_mhz) and fwhm_mhz > 0):
        raise ValueError(f"full width at half maximum {fwhm_mhz} MHz: expected a finite number above 0")
    start = short_time(top.moments_u_angstrom2, units.EV_PER_K * temperature_k, _dipole(top))
    edge_mhz = REACH * math.sqrt(start.m2) / (2.0 * math.pi) / (units.ASE_TIME_PS * HZ_PER_MHZ_PS)
    end = 2.0 * math.sqrt(-math.log(WINDOW_END) * math.log(2.0)) / (math.pi * WINDOW_SHARE * fwhm_mhz) / HZ_PER_MHZ_PS
    step = 1.0 / (3.0 * edge_mhz * HZ_PER_MHZ_PS)
    return np.linspace(0.0, end, math.ceil(end / step) + 1)


def band_from_correlation(
    times_ps: ArrayLike,
    correlation: ArrayLike,
    dipole2_debye2: float,
    grid_mhz: ArrayLike,
    *,
    fwhm_mhz: float,
    temperature_k: float,
    correction: Correction = "harmonic",
) -> Spectrum:
    """Cross section of one molecule from its dipole correlation C1 at even times from 0.

    Parameters
    ----------
    times_ps : (n,) array
        Evenly spaced from 0, at least 8.
    correlation : (n,) array
        C1 without its constant part, which would be a line at frequency 0.
    dipole2_debye2 : float
        μ².
    grid_mhz : (m,) array
        Frequencies.
    fwhm_mhz : float
        Full width of the Gaussian that smooths the band.
    temperature_k : float
        Temperature of the gas.
    correction : "harmonic", "standard", "schofield" or "egelstaff", optional
        The factor that restores detailed balance.

    Returns
    -------
    Spectrum
        σ (m,) in nm².

    Raises
    ------
    ValueError
        For an unknown correction, and for times that are uneven or too short for the width: the window must have closed.
    """
    times, c1 = np.asarray(times_ps, dtype=float), np.asarray(correlation, dtype=float)
    grid = np.asarray(grid_mhz, dtype=float)
    if correction not in get_args(Correction):
        raise ValueError(f"correction {correction!r} is none of {', '.join(get_args(Correction))}")
    if times.ndim != 1 or times.shape != c1.shape or len(times) < 8 or times[0] != 0 or not _even(times):
        raise ValueError(
            f"times of shape {times.shape} for C1 of {c1.shape}: expected evenly spaced times from 0, 8 or more"
        )
    window = _window(times, WINDOW_SHARE * fwhm_mhz)
    if window[-1] > 2 * WINDOW_END:
        expected = times[-1] * math.sqrt(math.log(WINDOW_END) / math.log(window[-1]))
        raise ValueError(
            f"C1 up to {times[-1]:g} ps is too short for a width of {fwhm_mhz:g} MHz; {expected:.3g} ps would be enough"
        )

    kt_mhz = temperature_k * units.MHZ_PER_K
    if correction == "egelstaff":
        c1 = _at_later_times(times, c1, 1.0 / (4.0 * math.pi * kt_mhz * HZ_PER_MHZ_PS))
    fine, nu2_density = _second_moment_density(times, c1, WINDOW_SHARE * fwhm_mhz, fwhm_mhz / POINTS_PER_WIDTH)
    # beyond the grid four widths suffice for the wings of the window
    shown = fine <= grid.max(initial=0.0) + 4.0 * fwhm_mhz
    fine, nu2_density = fine[shown], nu2_density[shown]
    sigma = INTENSITY_NM2_MHZ * dipole2_debye2 / kt_mhz * _balance(fine / kt_mhz, correction) * nu2_density
    smooth = _smoothed(fine, sigma, math.sqrt(1.0 - WINDOW_SHARE**2) * fwhm_mhz)

    from scipy.interpolate import CubicSpline

    inside = grid <= fine[-1]
    values = np.zeros_like(grid)
    values[inside] = CubicSpline(fine, smooth)(grid[inside])
    return Spectrum(grid, values, "nm^2", temperature_k, "gaussian", fwhm_mhz)


def compare_bands(ours: Spectrum, theirs: Spectrum) -> BandComparison:
    """Ratios of areas, mean frequencies and peaks, and the largest difference, of two spectra on one grid (trapezoidal rule)."""
    nu, a, b = ours.frequency_mhz, ours.intensity, theirs.intensity
    if not np.array_equal(nu, theirs.frequency_mhz):
        raise ValueError("the two spectra are on different grids; compute both on one")
    areas = [float(np.trapezoid(y, nu)) for y in (a, b)]  # areas by the trapezoidal rule on the common grid
    means = [float(np.trapezoid(y * nu, nu)) / area for y, area in zip((a, b), areas, strict=True)]
    at = int(np.argmax(np.abs(a - b)))
    peak = float(b.max())
    return BandComparison(
        areas[0] / areas[1], means[0] / means[1], float(a.max()) / peak, float(abs(a - b)[at]) / peak, float(nu[at])
    )


def rigid(top: Top) -> Top:
    """The top without distortion constants, for comparison with a classical gas of rigid bodies."""
    named: dict[str, Any] = {name: top.constants[name] for name in "ABC" if name in top.constants.values}
    return top.with_constants(Constants(**named, kind=top.kind), f"{top.source}, distortion left out")


def lines_area(lines: Lines) -> float:
    """Sum of the integrated absorption of all lines in nm² MHz, to compare with `dipole_band_area`."""
    return float(lines.intensity_nm2_mhz.sum())


def _dipole(top: Top) -> Floats:
    if top.dipole_abc_debye is None or not any(top.dipole_abc_debye):
        raise ValueError(f"{top.name or 'this top'} has no known dipole: there is no rotational absorption")
    return np.array(top.dipole_abc_debye)


def _even(times: Floats) -> bool:
    step = np.diff(times)
    # steps computed by linspace differ by round-off
    return bool(np.isfinite(times).all() and step[0] > 0 and np.ptp(step) < 1e-6 * step[0])


def _window(times_ps: Floats, fwhm_mhz: float) -> Floats:
    """The Fourier transform of a Gaussian of unit area: exp(-a t²), a = (π w)²/(4 ln 2)."""
    return np.asarray(np.exp(-_closing(fwhm_mhz) * times_ps**2))


def _closing(fwhm_mhz: float) -> float:
    """The constant a of `_window` in 1/ps²."""
    return (math.pi * fwhm_mhz * HZ_PER_MHZ_PS) ** 2 / (4.0 * math.log(2.0))


def _balance(x: Floats, correction: Correction) -> Floats:
    """(1 - e^-x) F(x)/x."""
    half = np.maximum(0.5 * x, 1e-9)  # x/tanh x and its like are 0/0 at 0
    if correction == "harmonic":
        return np.ones_like(x)
    return np.asarray((np.tanh(half) if correction == "standard" else np.sinh(half)) / half)


def _second_moment_density(times_ps: Floats, c1: Floats, fwhm_mhz: float, step_mhz: float) -> tuple[Floats, Floats]:
    """Frequencies in steps of at most `step_mhz`, and ν² S(ν) there in MHz, convolved with a Gaussian.

    This is the transform of -C″ w/(2π)² with the window w. The identity -C″ w = -(C w)″ + 2 (C w′)′ - C w″ avoids numerical derivatives
    of C, and the window does not change the second moment of S, which is the area of the band.
    """
    from scipy.fft import next_fast_len, rfft

    a, dt = _closing(fwhm_mhz), times_ps[1]
    window = np.exp(-a * times_ps**2)
    # zeros behind the function give the finer grid of frequencies
    size = next_fast_len(max(math.ceil(1.0 / (step_mhz * HZ_PER_MHZ_PS * dt)), 2 * len(times_ps)), real=True)
    weights = np.full(len(times_ps), 2.0 * dt)
    weights[[0, -1]] *= 0.5  # the trapezoidal rule: half weights at both ends
    even, odd, curved = (
        rfft(weights * c1 * shape, size)
        for shape in (window, -2.0 * a * times_ps * window, (4.0 * a * a * times_ps**2 - 2.0 * a) * window)
    )
    nu = np.arange(len(even)) / (size * dt)  # 1/ps
    total = nu**2 * even.real + (-2.0 * (2.0 * math.pi * nu) * odd.imag - curved.real) / (4.0 * math.pi**2)
    return nu / HZ_PER_MHZ_PS, total / HZ_PER_MHZ_PS


def _at_later_times(times: Floats, c1: Floats, shift: float) -> Floats:
    """C1(√(t² + shift²)); beyond the last time, where the window has closed, its last value."""
    from scipy.interpolate import CubicSpline

    later = np.minimum(np.hypot(times, shift), times[-1])
    return np.asarray(CubicSpline(times, c1, bc_type=((1, 0.0), "not-a-knot"))(later))  # even in time: no slope at 0


def _smoothed(grid: Floats, values: Floats, fwhm: float) -> Floats:
    """Convolution with a Gaussian on an even grid from 0; values below 0 are zero, as for lines."""
    step = grid[1]
    reach = math.ceil(3.0 * fwhm / step)
    kernel = gaussian(step * np.arange(-reach, reach + 1), fwhm)
    padded = np.concatenate([np.zeros(reach), values, np.zeros(reach)])
    return np.asarray(np.convolve(padded, kernel / kernel.sum(), mode="valid"))
