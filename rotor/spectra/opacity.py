"""Opacity of a gas: how much of the light a layer of given pressure and length takes out, at a line's centre and across it.

    τ(ν) = N L σ(ν),    N = p/kT,    absorbed: 1 - exp(-τ)       τ_i(ν_i) = N L I_i s_i(0) at the centre of a line alone

(Lambert-Beer; S. S. Penner, Quantitative Molecular Spectroscopy and Gas Emissivities, 1959, chapter 2). σ is the cross
section of `Spectrum`, I_i the integrated absorption of `Lines`, stimulated emission in both, s_i a shape of unit area.
The pressure is that of the absorbing molecules themselves, an ideal gas at the temperature of the lines. Neglected: what
the pressure does to the width, which is the user's to state, and emission of the gas.
"""

from __future__ import annotations

import math

import numpy as np

from rotor import units
from rotor.arrays import Floats
from rotor.spectra.lines import Lines
from rotor.spectra.spectrum import Spectrum, line_peaks

OPTICAL_DEPTH = "optical depth"
NM2_IN_CM2 = 1e-14
PASCAL_PER_BAR = 1e5


def column_density_per_cm2(pressure_bar: float, path_cm: float, temperature_k: float) -> float:
    """Molecules in the line of sight, N L = p L/kT, in 1/cm².

    pressure_bar: of the molecules meant, bar. path_cm: length of the layer, cm. Raises ValueError unless all are above 0.

    >>> f"{column_density_per_cm2(1.01325, 1.0, 273.15):.5e}"  # Loschmidt's number
    '2.68678e+19'
    """
    for name, value, unit in (
        ("pressure", pressure_bar, "bar"), ("path", path_cm, "cm"), ("temperature", temperature_k, "K"),
    ):  # fmt: skip
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name} {value} {unit}: expected a finite number above 0")
    per_m3 = pressure_bar * PASCAL_PER_BAR / (units.BOLTZMANN_J_PER_K * temperature_k)
    return per_m3 * 1e-6 * path_cm


def line_optical_depth(
    lines: Lines, pressure_bar: float, path_cm: float, *, profile: str = "gaussian", fwhm_mhz: float | None = None
) -> Floats:
    """Optical depth at the centre of every line, as if it were alone.

    Parameters
    ----------
    lines : Lines
        At their temperature.
    pressure_bar : float
        Of the absorbing molecules themselves.
    path_cm : float
        Length of the layer.
    profile : "gaussian", "lorentzian" or "voigt", optional
        Shape, as `Spectrum.from_lines` takes it.
    fwhm_mhz : float, optional
        Full width at half maximum, as there; Doppler's by default.

    Returns
    -------
    (lines,) array
        Pure numbers: absorbed is 1 - exp(-τ).

    Raises
    ------
    ValueError
        For a pressure or a path not above 0, and for a Doppler width without a mass.

    Examples
    --------
    >>> from rotor.spectra.lines import line_list
    >>> from rotor.tops.top import Top
    >>> rod = Top.from_constants("B=57635.968 MHz", dipole_abc_debye=(0.11011, 0, 0))
    >>> depth = line_optical_depth(line_list(rod, jmax=1), 1e-3, 100.0, fwhm_mhz=10.0)
    >>> [f"{x:.2e}" for x in depth]
    ['2.22e-02']
    """
    column = column_density_per_cm2(pressure_bar, path_cm, lines.temperature_k)
    return column * NM2_IN_CM2 * lines.intensity_nm2_mhz * line_peaks(lines, profile, fwhm_mhz)


def optical_depth(spectrum: Spectrum, pressure_bar: float, path_cm: float) -> Spectrum:
    """The optical depth of a layer of gas on the grid of a spectrum of cross sections, all lines together.

    Raises ValueError for a spectrum that is not a cross section at a temperature, a pressure or a path not above 0.
    """
    if spectrum.unit != "nm^2" or spectrum.temperature_k is None:
        raise ValueError(
            f"a spectrum in {spectrum.unit}: an optical depth follows from a cross section in nm^2 of a gas"
        )
    column = column_density_per_cm2(pressure_bar, path_cm, spectrum.temperature_k)
    return Spectrum(
        spectrum.frequency_mhz,
        column * NM2_IN_CM2 * spectrum.intensity,
        OPTICAL_DEPTH,
        spectrum.temperature_k,
        spectrum.profile,
        spectrum.fwhm_mhz,
        spectrum.outside,
        spectrum.lines,
    )


def absorbed_fraction(depth: Spectrum) -> Floats:
    """1 - exp(-τ) on the grid of an optical depth, to full precision where τ is small."""
    if depth.unit != OPTICAL_DEPTH:
        raise ValueError(f"a spectrum in {depth.unit}: what is absorbed follows from an optical depth")
    return -np.expm1(-depth.intensity)
