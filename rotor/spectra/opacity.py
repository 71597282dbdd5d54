"""Opacity of a gas: absorption by a layer of given pressure and length, at a line's centre and across it.

    τ(ν) = N L σ(ν),    N = p/kT,    absorbed: 1 - exp(-τ)       τ_i(ν_i) = N L I_i s_i(0) at the centre of a line alone

(Lambert-Beer; S. S. Penner, Quantitative Molecular Spectroscopy and Gas Emissivities, 1959, chapter 2). σ is the cross
section of `Spectrum`, I_i the integrated absorption of `Lines`, both with stimulated emission, s_i a shape of unit area.
The pressure is the partial pressure of the absorbing molecules, an ideal gas at the temperature of the lines. Neglected:
pressure broadening beyond the stated width, and emission of the gas.
"""

from __future__ import annotations

import math

from rotor import units
from rotor.arrays import Floats
from rotor.spectra.lines import Lines
from rotor.spectra.spectrum import Spectrum, line_peaks

OPTICAL_DEPTH = "optical depth"
PASCAL_PER_BAR = 1e5


def column_density_per_cm2(pressure_bar: float, path_cm: float, temperature_k: float) -> float:
    """Column density N L = p L/kT in 1/cm².

    pressure_bar: partial pressure of the molecules. path_cm: length of the layer. Raises ValueError unless all are above 0.

    >>> f"{column_density_per_cm2(1.01325, 1.0, 273.15):.5e}"  # Loschmidt's number
    '2.68678e+19'
    """
    for name, value, unit in (
        ("pressure", pressure_bar, "bar"), ("path", path_cm, "cm"), ("temperature", temperature_k, "K"),
    ):  # fmt: skip
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name} {value} {unit}: expected a finite number above 0")
    per_m3 = pressure_bar * PASCAL_PER_BAR / (units.BOLTZMANN_J_PER_K * temperature_k)  # n = p/kT
    return per_m3 * 1e-6 * path_cm


def line_optical_depth(
    lines: Lines, pressure_bar: float, path_cm: float, *, profile: str = "gaussian", fwhm_mhz: float | None = None
) -> Floats:
    """Optical depth at the centre of each line alone.

    Parameters
    ----------
    lines : Lines
        Lines at the temperature of the layer.
    pressure_bar : float
        Partial pressure of the absorbing molecules.
    path_cm : float
        Length of the layer.
    profile : "gaussian", "lorentzian" or "voigt", optional
        Line shape, as in `Spectrum.from_lines`.
    fwhm_mhz : float, optional
        Full width at half maximum, as there; by default the Doppler width.

    Returns
    -------
    (lines,) array
        Optical depths τ; the absorbed fraction is 1 - exp(-τ).

    Raises
    ------
    ValueError
        For a pressure or path not above 0, and for a Doppler width without a mass.

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
    return column * units.NM2_IN_CM2 * lines.intensity_nm2_mhz * line_peaks(lines, profile, fwhm_mhz)


def optical_depth(spectrum: Spectrum, pressure_bar: float, path_cm: float) -> Spectrum:
    """Optical depth of a layer of gas on the grid of a cross section, all lines together.

    Raises ValueError for a spectrum that is not a cross section at a temperature, and for a pressure or path not above 0.
    """
    if spectrum.unit != "nm^2" or spectrum.temperature_k is None:
        raise ValueError(f"a spectrum in {spectrum.unit}: expected a cross section in nm^2 at a temperature")
    column = column_density_per_cm2(pressure_bar, path_cm, spectrum.temperature_k)
    return Spectrum(
        spectrum.frequency_mhz,
        column * units.NM2_IN_CM2 * spectrum.intensity,
        OPTICAL_DEPTH,
        spectrum.temperature_k,
        spectrum.profile,
        spectrum.fwhm_mhz,
        spectrum.outside,
        spectrum.lines,
    )
