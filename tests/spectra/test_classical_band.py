"""Classical rotational bands: the closed form of a linear gas, sums, detailed balance, and the quantum lines beside them."""

from __future__ import annotations

import math

import numpy as np
import pytest

import rotor
from rotor import units
from rotor.classical.gas.correlations import linear_curves
from rotor.spectra.classical_band import (
    band_from_correlation,
    band_times,
    classical_band,
    compare_bands,
    dipole_band_area,
    lines_area,
    rigid,
)
from rotor.spectra.intensity import INTENSITY_NM2_MHZ
from rotor.spectra.spectrum import Spectrum
from rotor.tops.top import Top

CM = units.MHZ_PER_CM
OCS = rigid(rotor.read("OCS"))
WATER = rigid(rotor.read("water"))


def linear_band(top: Top, grid, fwhm, correction="harmonic", temperature_k=300.0) -> Spectrum:
    """The band from the closed form of C1, without a gas."""
    times = band_times(top, temperature_k, fwhm)
    moment, kt = top.moments_u_angstrom2[1], units.EV_PER_K * temperature_k
    c1, _ = linear_curves(times / units.ASE_TIME_PS, moment, kt)
    options = {"fwhm_mhz": fwhm, "temperature_k": temperature_k, "correction": correction}
    return band_from_correlation(times, c1, top.dipole_abc_debye[0] ** 2, grid, **options)


@pytest.mark.parametrize(
    ("name", "temperature_k"), [("OCS", 300), ("OCS", 20), ("water", 300), ("water", 30), ("NH3", 300), ("HDO", 100)]
)
def test_the_area_of_a_rigid_band_is_a_number(name, temperature_k):
    """Double commutator against the sum over all lines, spin weights and all; the cut leaves out 1e-6."""
    top = rigid(rotor.read(name))
    lines = rotor.api.line_list(top, temperature_k=temperature_k, min_lgint=-14)
    assert lines_area(lines) == pytest.approx(dipole_band_area(top), rel=3e-6, abs=0)


def test_a_linear_gas_has_the_band_of_its_speeds():
    """S(ν) is half the Rayleigh distribution of frequencies; narrow smoothing, σ = const ν x μ² S."""
    fwhm, grid = 0.2 * CM, np.linspace(0, 100, 501) * CM
    band = linear_band(OCS, grid, fwhm)
    kt = units.EV_PER_K * 300
    spread = math.sqrt(kt / OCS.moments_u_angstrom2[1]) / (2 * math.pi) / units.ASE_TIME_PS * 1e6  # MHz
    density = 0.5 * grid / spread**2 * np.exp(-0.5 * (grid / spread) ** 2)
    x = grid / (300 * units.MHZ_PER_K)
    closed = INTENSITY_NM2_MHZ * OCS.dipole_abc_debye[0] ** 2 * grid * x * density
    assert np.abs(band.intensity - closed).max() < 3e-4 * closed.max()  # the smoothing: (w/band)² of a curvature
    assert np.trapezoid(band.intensity, grid) == pytest.approx(dipole_band_area(OCS), rel=1e-4)  # 1e-4 lies outside
    mean = np.trapezoid(grid * band.intensity, grid) / np.trapezoid(band.intensity, grid)
    assert mean == pytest.approx(1.5 * math.sqrt(math.pi / 2) * spread, rel=1e-3)  # <ν³>/<ν²>


def test_corrections_restore_detailed_balance_and_part_as_x_squared():
    """(1 - e^-x) F: x, 2 tanh x/2, 2 sinh x/2; their ratios at one frequency follow, smoothing apart."""
    grid = np.linspace(1, 60, 100) * CM
    bands = {c: linear_band(OCS, grid, 0.5 * CM, c, 60.0).intensity for c in ("harmonic", "standard", "schofield")}
    x = grid / (60 * units.MHZ_PER_K)
    seen = bands["harmonic"] > 1e-3 * bands["harmonic"].max()
    assert np.allclose(
        bands["standard"][seen] / bands["harmonic"][seen], (np.tanh(x / 2) / (x / 2))[seen], rtol=2e-3
    )  # smoothing
    assert np.allclose(bands["schofield"][seen] / bands["harmonic"][seen], (np.sinh(x / 2) / (x / 2))[seen], rtol=2e-3)


def test_egelstaffs_time_is_shifted():
    """∫ e^(-x/2) S dν over all ν is C1 at the time ħ/2kT, known in closed form."""
    cold, grid = 5.0, np.linspace(0.05, 40, 8000) * CM
    band = linear_band(OCS, grid, 0.01 * CM, "egelstaff", cold).intensity
    kt_mhz = cold * units.MHZ_PER_K
    density = band / (INTENSITY_NM2_MHZ * OCS.dipole_abc_debye[0] ** 2 * grid * 2 * np.sinh(0.5 * grid / kt_mhz))
    shift_ps = 1e6 / (4 * math.pi * kt_mhz)
    c1, _ = linear_curves(shift_ps / units.ASE_TIME_PS, OCS.moments_u_angstrom2[1], units.EV_PER_K * cold)
    assert 0.9 < c1 < 0.98
    total = 2 * np.trapezoid(density, grid) + grid[0] * density[0]  # as if S rose straight from 0
    assert total == pytest.approx(float(c1), abs=6e-4)  # S(0) is not 0 but 1e-7 per MHz: 4e-4


def test_ocs_at_300_k_over_its_lines():
    """No random numbers: the closed classical band against the quantum lines, smoothed alike, 2 cm-1."""
    grid = np.linspace(0, 120, 1201) * CM
    quantum = Spectrum.from_lines(rotor.api.line_list(OCS, temperature_k=300, min_lgint=-14), grid, fwhm_mhz=2 * CM)
    beside = compare_bands(linear_band(OCS, grid, 2 * CM), quantum)
    assert beside.area == pytest.approx(1.0, abs=1e-4)  # the cut of the lines and the end of the grid
    assert beside.mean == pytest.approx(1.0, abs=2e-3)  # hB/kT = 1e-3
    assert beside.largest < 5e-4  # (hB/kT) of 1e-3, smoothed
    few = np.linspace(0, 12, 1201) * CM  # at 0.6 K, hB/kT = ½, four levels are there
    lines = rotor.api.line_list(OCS, temperature_k=0.6, min_lgint=-14)
    cold = compare_bands(linear_band(OCS, few, CM, temperature_k=0.6), Spectrum.from_lines(lines, few, fwhm_mhz=CM))
    assert cold.largest > 0.03


def test_water_agrees_at_300_k_and_parts_at_30_k():
    results = {}
    for temperature_k, fwhm, end in ((300.0, 60.0, 900.0), (30.0, 20.0, 400.0)):
        grid = np.linspace(0, end, 901) * CM
        lines = rotor.api.line_list(WATER, temperature_k=temperature_k, min_lgint=-14)
        quantum = Spectrum.from_lines(lines, grid, fwhm_mhz=fwhm * CM)
        gas = {"temperature_k": temperature_k, "molecules": 50_000, "rng": np.random.default_rng(2)}
        results[temperature_k] = compare_bands(classical_band(WATER, grid, fwhm_mhz=fwhm * CM, **gas), quantum)
    assert results[300.0].area == pytest.approx(1.0, abs=0.02)  # 50,000 molecules: 0.5 %
    assert results[300.0].mean == pytest.approx(1.0, abs=0.03)
    assert results[300.0].largest < 0.08
    assert results[30.0].area == pytest.approx(1.0, abs=0.02)  # the sum holds at any temperature
    assert results[30.0].mean < 0.95  # the first lines of water lie above what 30 K can classically reach
    assert results[30.0].largest > 0.3


def test_what_stays_is_no_absorption():
    """An oblate top keeps 0.2 to 0.5 of C1 for ever: a line at frequency 0, which absorbs nothing."""
    ammonia = rigid(rotor.read("NH3"))
    grid = np.linspace(0, 600, 601) * CM
    band = classical_band(ammonia, grid, fwhm_mhz=20 * CM, molecules=40_000, rng=np.random.default_rng(1))
    assert np.trapezoid(band.intensity, grid) == pytest.approx(dipole_band_area(ammonia), rel=0.02)  # 40,000: 0.7 %


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (
            lambda: classical_band(rotor.read("CO2"), [1.0], fwhm_mhz=1.0, rng=np.random.default_rng()),
            "no known dipole",
        ),
        (lambda: band_times(OCS, 0.0, 1.0), "above 0 K"),
        (lambda: band_times(OCS, 300.0, -1.0), "width"),
        (lambda: linear_band(OCS, np.array([1.0]), CM, "wigner"), "is none of harmonic"),
        (
            lambda: band_from_correlation(np.arange(9) ** 2.0, np.ones(9), 1.0, [1.0], fwhm_mhz=1.0, temperature_k=1.0),
            "evenly spaced times",
        ),
        (
            lambda: band_from_correlation(np.arange(9.0), np.ones(9), 1.0, [1.0], fwhm_mhz=1.0, temperature_k=1.0),
            "too short for a width",
        ),
    ],
)
def test_classical_bands_refuse_wrong_input(call, said):
    with pytest.raises(ValueError, match=said):
        call()


def test_spectra_on_different_grids_are_not_compared():
    a = linear_band(OCS, np.linspace(1, 10, 10) * CM, CM)
    b = linear_band(OCS, np.linspace(1, 10, 11) * CM, CM)
    with pytest.raises(ValueError, match="different grids"):
        compare_bands(a, b)


def test_ocs_at_0_6_k_in_the_limit_of_narrow_smoothing():
    """The figures of docs/gas.md: smoothed to 1 cm-1 a part of the lowest line, at 0.4 cm-1, falls below ν = 0."""
    grid = np.linspace(0, 12, 4801) * CM
    lines = rotor.api.line_list(OCS, temperature_k=0.6, min_lgint=-14)
    beside = compare_bands(
        linear_band(OCS, grid, 0.05 * CM, temperature_k=0.6), Spectrum.from_lines(lines, grid, fwhm_mhz=0.05 * CM)
    )
    assert beside.area == pytest.approx(1.0, abs=1e-5)  # the same number, but for smoothing, 0.05²
    assert beside.mean == pytest.approx(0.9662, abs=1e-4)
