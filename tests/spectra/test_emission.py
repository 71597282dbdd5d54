"""Brightness temperatures: thick and thin limits, widths and velocities, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import constants as si

import rotor
from rotor.spectra.emission.emission import (
    BACKGROUND_K,
    Source,
    band_mhz,
    emission,
    planck_k,
    radio_velocity_km_s,
    source_grid,
)
from rotor.spectra.lines import line_list
from rotor.tops.top import Top

CO = Top.from_constants("B=57635.968 D=0.1835 MHz", dipole_abc_debye=(0.11011, 0, 0))
REST = 2 * 57635.968 - 4 * 0.1835


def lines_at(temperature_k: float):
    return line_list(CO, temperature_k=temperature_k, jmax=12, min_lgint=None)


def test_a_thick_line_has_the_temperature_of_the_gas():
    source = Source(1e22, 25.0, 2.0, filling=0.3)
    seen = emission(lines_at(25.0), source, [REST - 1e3, REST])
    contrast = planck_k(REST, 25.0) - planck_k(REST, BACKGROUND_K)
    assert seen.brightness_k[1] == pytest.approx(0.3 * contrast, rel=1e-12)
    assert seen.brightness_k[0] == 0.0


def test_a_thin_line_gives_its_column_density_back():
    """∫T_B dv of a thin line, inverted by N = (8πν²·k/(h c³ A g)) Q e^(E/kT) ∫T dv J-corrected, without `intensity`."""
    temperature, column = 15.0, 1e12
    lines = lines_at(temperature)
    source = Source(column, temperature, 1.5, background_k=0.0)
    grid = np.linspace(REST - 4.0, REST + 4.0, 4001)
    seen = emission(lines, source, grid)
    velocity = radio_velocity_km_s(grid, REST)
    area_k_m_s = -np.trapezoid(seen.brightness_k, velocity) * 1e3
    nu, row = REST * 1e6, int(np.argmin(np.abs(lines.frequency_mhz - REST)))
    a, g = lines.einstein_a_per_s[row], lines.g_upper[row]
    q = lines.q
    upper_k = lines.energy_lower_cm[row] * 1.438776877 + si.h * nu / si.k
    n_upper = 8 * math.pi * si.k * nu**2 / (si.h * si.c**3 * a) * area_k_m_s
    computed = n_upper / g * q * math.exp(upper_k / temperature) * 1e-4
    assert computed == pytest.approx(column, rel=2e-5)  # τ = 1e-4 at most, and the grid


def test_width_and_velocity_are_the_sources():
    source = Source(1e12, 10.0, 0.8, velocity_km_s=12.5)
    grid = source_grid(REST - 20, REST + 5, source, 60)
    seen = emission(lines_at(10.0), source, grid)
    velocity = seen.velocity_km_s(REST)
    weight = seen.optical_depth / seen.optical_depth.sum()
    assert float(velocity @ weight) == pytest.approx(12.5, abs=1e-3)
    above = velocity[seen.optical_depth > seen.optical_depth.max() / 2]
    assert above.max() - above.min() == pytest.approx(0.8, abs=0.03)  # two steps of the grid


def test_molecules_in_one_source_add_their_depths():
    other = Top.from_constants("B=57600 MHz", dipole_abc_debye=(0.2, 0, 0))
    source = Source(1e14, 10.0, 1.0)
    grid = np.linspace(115150, 115300, 3001)
    lists = [lines_at(10.0), line_list(other, temperature_k=10.0, jmax=12)]
    both = emission(lists, source, grid).optical_depth
    assert both == pytest.approx(sum(emission(lines, source, grid).optical_depth for lines in lists), rel=1e-12)


def test_absorption_against_a_hot_background_is_negative():
    seen = emission(lines_at(5.0), Source(1e16, 5.0, 1.0, background_k=30.0), [REST])
    assert seen.brightness_k[0] < 0


@pytest.mark.parametrize(("redshift", "velocity"), [(0.0, 1e5), (2.3, 0.0), (6.0, -3000.0)])
def test_a_redshifted_layer_is_the_layer_at_rest_with_photons_stretched(redshift, velocity):
    """I_ν/ν³ is invariant: transfer in the frame of the gas, before a background of T_bg (1+z), then T_B divided by 1+z."""
    source = Source(1e18, 20.0, 30.0, velocity, redshift=redshift)
    stretch = (1 + redshift) / (1 - velocity / 299792.458)
    rest = REST + np.linspace(-15, 15, 41)
    seen = emission(lines_at(20.0), source, rest / stretch)
    there = emission(lines_at(20.0), Source(1e18, 20.0, 30.0, background_k=BACKGROUND_K * stretch), rest)
    assert seen.optical_depth == pytest.approx(there.optical_depth, rel=1e-9)  # offsets from a line lose digits
    assert seen.brightness_k == pytest.approx(there.brightness_k / stretch, rel=1e-9, abs=1e-15)
    assert 0.5 < seen.optical_depth.max() < 5  # neither thin nor thick
    assert seen.brightness_k.max() < 20.0 / stretch  # 17 K were seen of 10 K at 1e5 km/s


def test_gas_as_cold_as_the_background_of_its_time_is_not_seen():
    source = Source(1e18, BACKGROUND_K * 3.3, 30.0, redshift=2.3)
    assert emission(lines_at(source.excitation_k), source, [REST / 3.3]).brightness_k[0] == pytest.approx(0, abs=1e-12)


def test_molecules_of_two_temperatures_mix_in_a_layer():
    """T_B of a layer cut into 20,000 slices, each with the emission of both molecules."""
    other = Top.from_constants("B=57635.968 D=0.1835 MHz", dipole_abc_debye=(0.2, 0, 0))
    sources = (Source(2e16, 8.0, 1.0), Source(3e16, 40.0, 2.0, velocity_km_s=0.3))
    lists = [lines_at(8.0), line_list(other, temperature_k=40.0, jmax=12)]
    seen = emission(lists, sources, [REST])
    a, b = (
        float(emission(lines, source, [REST]).optical_depth[0]) for lines, source in zip(lists, sources, strict=True)
    )
    brightness, slices = float(planck_k(REST, BACKGROUND_K)), 20000
    for _ in range(slices):
        gain = (a * float(planck_k(REST, 8.0)) + b * float(planck_k(REST, 40.0 * (1 - 0.3 / 299792.458)))) / slices
        brightness += gain - brightness * (a + b) / slices
    assert seen.optical_depth[0] == pytest.approx(a + b, rel=1e-12)
    assert seen.brightness_k[0] == pytest.approx(brightness - float(planck_k(REST, BACKGROUND_K)), rel=2e-4)  # 1/slices
    assert min(a, b) > 0.3


def test_sources_of_one_layer_share_what_lies_behind_it():
    with pytest.raises(ValueError, match="redshift"):
        emission([lines_at(10.0)] * 2, [Source(1e14, 10.0, 1.0), Source(1e14, 10.0, 1.0, redshift=1.0)], [REST])
    with pytest.raises(ValueError, match="1 given for 2"):
        emission([lines_at(10.0)] * 2, [Source(1e14, 10.0, 1.0)], [REST])


def test_planck_limits():
    assert planck_k(1.0, 300.0) == pytest.approx(300.0, rel=1e-6)  # Rayleigh-Jeans
    assert planck_k(1e5, 0.0) == 0.0
    assert BACKGROUND_K == 2.725


def test_bands_by_name():
    assert band_mhz("ALMA 3") == (84000.0, 116000.0)
    with pytest.raises(ValueError, match="known are ALMA1"):
        band_mhz("VLA")


@pytest.mark.parametrize(
    "change",
    [
        {"column_per_cm2": 0.0}, {"excitation_k": -1.0}, {"fwhm_km_s": math.nan}, {"filling": 1.5}, {"background_k": -1.0},
        {"velocity_km_s": 3e5}, {"redshift": -1.0}, {"redshift": math.inf},
    ],
)  # fmt: skip
def test_impossible_sources_are_refused(change):
    with pytest.raises(ValueError, match="expected"):
        Source(**({"column_per_cm2": 1e14, "excitation_k": 10.0, "fwhm_km_s": 1.0} | change))


def test_other_temperatures_and_grids_are_refused():
    with pytest.raises(ValueError, match="temperature of the source"):
        emission(lines_at(10.0), Source(1e14, 11.0, 1.0), [REST])
    with pytest.raises(ValueError, match="rising"):
        emission(lines_at(10.0), Source(1e14, 10.0, 1.0), [REST, REST])


def test_a_library_molecule_in_a_band():
    low, high = band_mhz("ALMA3")
    top = rotor.read("HC3N")
    source = Source(1e13, 20.0, 3.0, 5.0)
    lines = line_list(top, temperature_k=20.0, range_mhz=(low, high))
    seen = emission(lines, source, source_grid(low, high, source))
    assert 0 < seen.brightness_k.max() < 17.0
    assert list(seen.columns) == ["frequency_mhz", "optical_depth", "brightness_k"]


def test_a_line_beyond_the_edge_shows_its_wing():
    """A range that begins one half width above the centre of CO 1-0, against a range that holds the line."""
    from rotor.spectra.emission.request import EmissionRequest, answer_emission

    source, half = Source(1e16, 20.0, 10.0), 115271.2 * 5.0 / 299792.458
    edge = 115271.2021 + half
    molecule = rotor.read("CO")
    part, whole = (
        answer_emission(EmissionRequest((molecule,), (source,), (low, 115300.0))) for low in (edge, 115200.0)
    )
    assert len(part.lines) == 0
    assert part.peak is None
    there = np.interp(part.spectrum.frequency_mhz, whole.spectrum.frequency_mhz, whole.spectrum.brightness_k)
    assert part.spectrum.brightness_k[0] == pytest.approx(0.5 * whole.peak.brightness_k, rel=0.1)  # thin at its centre
    assert (
        np.abs(part.spectrum.brightness_k - there).max() < 0.01 * whole.peak.brightness_k
    )  # of the grid, 8 points a width


@pytest.mark.parametrize("name", ["column_per_cm2", "excitation_k", "fwhm_km_s"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.inf, -math.inf, math.nan])
def test_a_source_is_finite_and_above_zero(name, value):
    fine = {"column_per_cm2": 1e15, "excitation_k": 20.0, "fwhm_km_s": 1.0}
    assert Source(**fine).fwhm_km_s == 1.0
    with pytest.raises(ValueError, match=f"{name}: .*: expected a finite number above 0"):
        Source(**{**fine, name: value})
