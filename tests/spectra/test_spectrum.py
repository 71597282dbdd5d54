"""Spectra on a grid: areas, the slow sum, truncation, the grid that follows lines, files."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rotor
from rotor.spectra import profiles, spectrum
from rotor.spectra.spectrum import Spectrum, line_widths, resolving_grid
from rotor.tops.top import Top

SHAPES = [
    {"profile": "gaussian", "fwhm_mhz": 300.0},
    {"profile": "gaussian"},
    {"profile": "lorentzian", "fwhm_mhz": 5.0},
    {"profile": "voigt", "fwhm_mhz": 0.3},
]


@pytest.fixture(scope="module")
def lines():
    top = rotor.Top.from_constants("A=8572 B=3640 C=2790 MHz", dipole_abc_debye=(1.0, 0.5, 0.2), mass_u=50.0)
    return rotor.api.line_list(top, temperature_k=20.0, jmax=6)


def slow(lines, grid, shape):
    """One line after the other over the whole grid."""
    total = np.zeros(len(grid))
    widths = profiles.doppler_fwhm(lines.frequency_mhz, lines.temperature_k, lines.top.mass_u)
    for f, area, doppler in zip(lines.frequency_mhz, lines.intensity_nm2_mhz, widths, strict=True):
        fwhm = shape.get("fwhm_mhz", doppler)
        match shape["profile"]:
            case "gaussian":
                value = profiles.gaussian(grid - f, fwhm)
            case "lorentzian":
                value = profiles.lorentzian(grid - f, fwhm)
            case _:
                value = profiles.voigt(grid - f, doppler, fwhm)
        total += area * value
    return total


@pytest.mark.parametrize("shape", SHAPES)
def test_windows_change_nothing_that_can_be_seen(lines, shape, monkeypatch):
    grid = np.linspace(1000.0, 90_000.0, 20_001)
    whole = Spectrum.from_lines(lines, grid, **shape)
    reference = slow(lines, grid, shape)
    assert np.allclose(whole.intensity, reference, rtol=0, atol=1e-6 * reference.max())  # 2.5e-8 of each of 400 lines

    monkeypatch.setattr(spectrum, "PIECE", 137)  # so that pieces end inside windows
    pieces = Spectrum.from_lines(lines, grid, **shape)
    assert np.allclose(pieces.intensity, whole.intensity, rtol=1e-12, atol=0)  # round-off of another order of summing


@pytest.mark.parametrize("shape", SHAPES)
def test_area_is_the_integrated_absorption(lines, shape):
    grid = resolving_grid(lines, **shape)
    profile = Spectrum.from_lines(lines, grid, **shape)
    area = np.trapezoid(profile.intensity, profile.frequency_mhz)
    assert area == pytest.approx(lines.intensity_nm2_mhz.sum(), rel=2.5e-3)  # what resolving_grid promises


@settings(max_examples=20)
@given(outside=st.floats(1e-6, 0.3))
def test_truncation_stays_below_its_bound(lines, outside):
    line = lines.where([5])
    reach = float(profiles.lorentzian_reach(1.0, outside))
    grid = line.frequency_mhz[0] + np.linspace(-1.5 * reach, 1.5 * reach, 4001)
    profile = Spectrum.from_lines(line, grid, fwhm_mhz=1.0, profile="lorentzian", outside=outside)
    lost = slow(line, grid, {"profile": "lorentzian", "fwhm_mhz": 1.0}) - profile.intensity
    edge = line.intensity_nm2_mhz[0] * float(profiles.lorentzian(reach, 1.0))
    assert lost.max() <= edge * (1 + 1e-9)  # nothing larger than the shape at its reach is left out; round-off
    assert (lost[np.abs(grid - line.frequency_mhz[0]) < 0.99 * reach] == 0).all()


def test_a_voigt_line_is_as_wide_as_its_width_says(lines):
    line = lines.where([40])
    width = float(line_widths(line, "voigt", 0.2)[0])
    doppler = float(profiles.doppler_fwhm(line.frequency_mhz, 20.0, 50.0)[0])
    ratio = profiles.voigt(width / 2, doppler, 0.2) / profiles.voigt(0.0, doppler, 0.2)
    assert float(ratio) == pytest.approx(0.5, rel=1e-3)  # the approximation is good to 2e-4 of the width


def test_a_grid_follows_only_the_lines_of_its_range(lines):
    grid = resolving_grid(lines, fwhm_mhz=0.1, range_mhz=(20_000.0, 30_000.0))
    assert grid[0] == 20_000.0
    assert grid[-1] == 30_000.0
    inside = lines.frequency_mhz[(lines.frequency_mhz > 20_000) & (lines.frequency_mhz < 30_000)]
    assert np.isin(inside, grid).all()
    assert (np.diff(grid) > 0).all()


@pytest.mark.parametrize(
    ("change", "rule"),
    [
        ({"grid_mhz": [3.0, 2.0]}, "rising"),
        ({"grid_mhz": [1.0, math.nan]}, "finite"),
        ({"grid_mhz": []}, "rising"),
        ({"fwhm_mhz": 0.0}, "above 0"),
        ({"fwhm_mhz": math.inf}, "finite"),
        ({"profile": "square"}, "none of gaussian"),
        ({"profile": "lorentzian", "fwhm_mhz": None}, "fwhm_mhz"),
        ({"outside": 0.0}, "between 0 and 1"),
    ],
)
def test_what_makes_no_spectrum_is_refused(lines, change, rule):
    value = {"grid_mhz": [1.0, 2.0], "fwhm_mhz": 1.0} | change
    with pytest.raises(ValueError, match=rule):
        Spectrum.from_lines(lines, value.pop("grid_mhz"), **value)


def test_doppler_without_a_mass_is_refused():
    lines = rotor.api.line_list(rotor.Top.from_constants("B=10 GHz", dipole_abc_debye=(1, 0, 0)), jmax=2)
    with pytest.raises(ValueError, match="needs a mass"):
        Spectrum.from_lines(lines, [1.0, 2.0])


def test_a_grid_that_would_be_too_long_is_refused(lines, monkeypatch):
    monkeypatch.setattr(spectrum, "MOST_POINTS", 1000)
    with pytest.raises(ValueError, match="narrower range"):
        resolving_grid(lines, fwhm_mhz=1.0)
    with pytest.raises(ValueError, match="without lines"):
        resolving_grid(lines.where([]), fwhm_mhz=1.0)


def test_csv_holds_the_columns_and_where_they_are_from(lines, tmp_path):
    profile = Spectrum.from_lines(lines, np.linspace(1e4, 2e4, 11), fwhm_mhz=100.0)
    path = tmp_path / "s.csv"
    rotor.write(profile, path, settings={"command": "by hand"})
    heading, *rows = path.read_text(encoding="utf-8").splitlines()
    assert heading == "frequency_mhz,cross_section_nm2"
    assert [float(r.split(",")[1]) for r in rows] == profile.intensity.tolist()
    provenance = json.loads((tmp_path / "s.csv.provenance.json").read_text(encoding="utf-8"))
    assert (provenance["command"], provenance["profile"], provenance["fwhm_mhz"]) == ("by hand", "gaussian", 100.0)
    assert (
        list(profile.to_pandas().columns) == list(profile.to_polars().columns) == ["frequency_mhz", "cross_section_nm2"]
    )
    with pytest.raises(ValueError, match=r"as \.csv"):
        rotor.write(profile, tmp_path / "s.txt")


def test_columns_of_unlike_length_are_refused():
    with pytest.raises(ValueError, match="both must be"):
        Spectrum(np.zeros(3), np.zeros(2))


@pytest.mark.parametrize(
    "shape", [{"profile": "lorentzian", "fwhm_mhz": 20.0}, {"profile": "gaussian", "fwhm_mhz": 300.0}]
)
def test_lines_beyond_the_edges_of_a_range_show_their_wings(shape):
    """CO between its lines, against the same part of a wider range; the list itself has no line there."""
    from rotor.spectra.request import SpectrumRequest, answer_spectrum

    top = Top.from_constants("B=57635.968 D=0.1835 MHz", dipole_abc_debye=(0.11, 0, 0))
    answer = answer_spectrum(SpectrumRequest(top, range_mhz=(115_400.0, 115_900.0), **shape))
    grid = answer.spectrum.frequency_mhz
    whole = Spectrum.from_lines(answer_spectrum(SpectrumRequest(top)).lines, grid, **shape)
    assert len(answer.lines) == 0
    assert answer.spectrum.intensity.max() > 0
    assert np.allclose(answer.spectrum.intensity, whole.intensity, rtol=0, atol=1e-6 * whole.intensity.max())
