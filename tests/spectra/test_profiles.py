"""Line shapes: closed forms, areas, the convolution done slowly, widths."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import wofz

from rotor.spectra import profiles

widths = st.floats(1e-3, 1e3)


@pytest.mark.parametrize("shape", [profiles.gaussian, profiles.lorentzian])
@given(width=widths)
def test_half_height_stands_at_half_width(shape, width):
    assert float(shape(width / 2, width) / shape(0.0, width)) == pytest.approx(0.5, rel=1e-12)  # definition; round-off


@given(width=widths)
def test_area_of_a_gaussian_is_one(width):
    area, _ = quad(lambda x: float(profiles.gaussian(x, width)), -5 * width, 5 * width)
    assert area == pytest.approx(1.0, rel=1e-9)  # 10 widths hold all but 1e-30; quad's own error


@pytest.mark.parametrize("outside", [0.5, 1e-2, 1e-4])
def test_the_reach_leaves_the_area_that_was_asked_for(outside):
    for shape, reach in (
        (profiles.gaussian, profiles.gaussian_reach(2.0, outside)),
        (profiles.lorentzian, profiles.lorentzian_reach(2.0, outside)),
    ):
        inner, _ = quad(lambda x, s=shape: float(s(x, 2.0)), -float(reach), float(reach), points=[0.0], limit=500)
        assert 1 - inner == pytest.approx(outside, rel=1e-6)  # quad's error on an area of 1, 1e-10, over 1e-4


@pytest.mark.parametrize(("offset", "gauss", "lorentz"), [(0.0, 1.0, 1.0), (0.7, 1.0, 0.2), (3.0, 0.5, 2.0)])
def test_voigt_is_the_convolution(offset, gauss, lorentz):
    def product(y: float) -> float:
        return float(profiles.gaussian(y, gauss) * profiles.lorentzian(offset - y, lorentz))

    slow, _ = quad(product, -6 * gauss, 6 * gauss, points=[0.0], limit=500)
    assert float(profiles.voigt(offset, gauss, lorentz)) == pytest.approx(slow, rel=1e-9)  # quad's error


@given(offset=st.floats(-10, 10), gauss=st.floats(0.01, 10), lorentz=st.floats(0.01, 10))
def test_voigt_is_the_faddeeva_function(offset, gauss, lorentz):
    sigma = gauss / math.sqrt(8 * math.log(2))
    z = (offset + 0.5j * lorentz) / (sigma * math.sqrt(2))
    expected = wofz(z).real / (sigma * math.sqrt(2 * math.pi))
    assert float(profiles.voigt(offset, gauss, lorentz)) == pytest.approx(expected, rel=1e-10)  # wofz: 1e-13


def test_voigt_of_no_width_is_the_other_shape():
    x = np.linspace(-5, 5, 101)
    assert np.allclose(profiles.voigt(x, 0.0, 1.3), profiles.lorentzian(x, 1.3), rtol=1e-12)  # round-off
    assert np.allclose(profiles.voigt(x, 1.3, 0.0), profiles.gaussian(x, 1.3), rtol=1e-12)  # round-off


def test_doppler_width_is_that_of_thermal_velocities():
    rng = np.random.default_rng(3)
    speed = rng.normal(size=400_000) * math.sqrt(1.380649e-23 * 300 / (28 * 1.66053906892e-27))
    fwhm = math.sqrt(8 * math.log(2)) * float(np.std(1e5 * speed / 299792458.0))
    assert float(profiles.doppler_fwhm(1e5, 300.0, 28.0)) == pytest.approx(fwhm, rel=5e-3)  # 1/sqrt(2n) = 1.1e-3
    usual = 7.1623e-7 * 1e5 * math.sqrt(300 / 28)
    assert float(profiles.doppler_fwhm(1e5, 300.0, 28.0)) == pytest.approx(usual, rel=1e-5)  # printed to five digits


@pytest.mark.parametrize(("temperature", "mass"), [(0.0, 28.0), (-1.0, 28.0), (300.0, 0.0), (math.nan, 28.0)])
def test_doppler_refuses_what_has_no_width(temperature, mass):
    with pytest.raises(ValueError, match="above 0"):
        profiles.doppler_fwhm(1e5, temperature, mass)
