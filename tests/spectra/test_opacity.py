"""Intensity in cm/molecule and the opacity of a gas: a calculation by hand for CO 1-0, HITRAN's own, limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.constants as si

import rotor
from rotor.formats.lines.hitran import cm_per_molecule, read_hitran
from rotor.spectra.intensity import INTENSITY_NM2_MHZ, LGINT_NM2_MHZ
from rotor.spectra.lines import line_list
from rotor.spectra.opacity import column_density_per_cm2, line_optical_depth, optical_depth
from rotor.spectra.spectrum import Spectrum, resolving_grid
from rotor.tops.top import Top

CO = rotor.read("CO")


def test_carbon_monoxide_by_hand():
    """CO 1-0 at 300 K, 1 mbar, 1 m, in SI and wavenumbers from the first line on; Q = Σ (2J+1) exp(-E/kT), E = B X - D X²."""
    b_hz, nu_hz, dipole = 57635.968e6, 115271.2018e6, 0.11011e-21 / si.c
    kt = si.k * 300.0
    x = np.arange(80) * np.arange(1, 81)
    q = np.sum((2 * np.arange(80) + 1) * np.exp(-si.h * (b_hz * x - 0.1835e6 * x**2) / kt))
    s_mu2 = dipole**2 / (4 * math.pi * si.epsilon_0)  # J+1 = 1 of J = 0, summed over M
    population = -math.expm1(-si.h * nu_hz / kt) / q
    wavenumber = nu_hz / si.c  # 1/m
    s_m = 8 * math.pi**3 * wavenumber / (3 * si.h * si.c) * s_mu2 * population  # m per molecule

    lines = line_list(CO, jmax=1)
    assert lines.intensity_cm_per_molecule[0] == pytest.approx(
        s_m * 100, rel=3e-5, abs=0
    )  # 4.16231e-5 of catalogues is 1.7e-5 low
    width = wavenumber * math.sqrt(8 * math.log(2) * kt / (27.994915 * si.atomic_mass * si.c**2))
    peak = 2 * math.sqrt(math.log(2) / math.pi) / width
    tau = 100.0 / kt * 1.0 * s_m * peak  # p L/kT, Pa m
    assert line_optical_depth(lines, 1e-3, 100.0)[0] == pytest.approx(tau, rel=3e-5)
    assert tau == pytest.approx(0.8194, abs=1e-4)


@pytest.mark.oracle
def test_one_molecule_of_hitran(shared):
    """The rotational lines of 12C16O in HITRAN, with its abundance of 0.98654 and Q at 296 K."""
    theirs = read_hitran(shared / "reference" / "catalogues" / "hitran_CO_fragment.par")
    ours = line_list(CO, temperature_k=296.0, jmax=40)
    computed = 0
    for wavenumber, intensity in zip(theirs.wavenumber_cm, theirs.intensity_cm, strict=True):
        near = np.flatnonzero(np.abs(ours.frequency_mhz / 29979.2458 - wavenumber) < 1e-3)
        if len(near) == 1:
            computed += 1
            assert ours.intensity_cm_per_molecule[near[0]] * 0.98654 == pytest.approx(
                intensity, rel=0.02
            )  # J dependence of μ
    assert computed >= 1


def test_conversion_is_that_of_hitran():
    lines = line_list(CO, jmax=20)
    assert lines.intensity_cm_per_molecule == pytest.approx(cm_per_molecule(lines.intensity_nm2_mhz), rel=1e-15, abs=0)
    assert lines.columns["intensity_cm_per_molecule"] == pytest.approx(
        10**lines.lgint * INTENSITY_NM2_MHZ / LGINT_NM2_MHZ / 2.99792458e18, rel=1e-12, abs=0
    )


def test_the_density_of_a_gas_is_that_of_loschmidt():
    assert column_density_per_cm2(1.01325, 1.0, 273.15) == pytest.approx(2.686780111e19, rel=1e-9)  # CODATA


@pytest.mark.parametrize(
    ("profile", "fwhm"), [("gaussian", None), ("gaussian", 3.0), ("lorentzian", 2.0), ("voigt", 0.5)]
)
def test_a_line_alone_is_the_spectrum_at_its_centre(profile, fwhm):
    lines = line_list(CO, jmax=1)
    shape = {"profile": profile, "fwhm_mhz": fwhm}
    spectrum = optical_depth(Spectrum.from_lines(lines, resolving_grid(lines, **shape), **shape), 0.01, 200.0)
    assert spectrum.intensity.max() == pytest.approx(line_optical_depth(lines, 0.01, 200.0, **shape)[0], rel=1e-9)
    assert list(spectrum.columns) == ["frequency_mhz", "optical_depth"]


def test_area_and_saturation():
    """∫τ dν = N L I; for thin gas what is absorbed is τ, for thick gas all of it at the centre."""
    lines = line_list(CO, jmax=1)
    section = Spectrum.from_lines(lines, resolving_grid(lines))
    thin, thick = optical_depth(section, 1e-8, 1.0), optical_depth(section, 1.0, 1e7)
    column = column_density_per_cm2(1e-8, 1.0, 300.0)
    area = np.trapezoid(thin.intensity, thin.frequency_mhz)
    assert area == pytest.approx(
        column * 1e-14 * lines.intensity_nm2_mhz[0], rel=2e-3, abs=0
    )  # straight lines between points
    assert thick.intensity == pytest.approx(thin.intensity * 1e15, rel=1e-12, abs=0)  # Lambert and Beer


def test_optical_depth_refuses_wrong_input():
    lines = line_list(CO, jmax=1)
    for pressure, path, said in ((0.0, 1.0, "pressure"), (1.0, -1.0, "path"), (math.nan, 1.0, "pressure")):
        with pytest.raises(ValueError, match=said):
            line_optical_depth(lines, pressure, path)
    bare = Top.from_constants("B=57 GHz", dipole_abc_debye=(0.1, 0, 0))
    with pytest.raises(ValueError, match="Doppler width needs a mass"):
        line_optical_depth(line_list(bare, jmax=1), 1.0, 1.0)
    plain = Spectrum(np.array([1.0, 2.0]), np.array([1.0, 1.0]), "a.u.")
    with pytest.raises(ValueError, match="expected a cross section in nm"):
        optical_depth(plain, 1.0, 1.0)
