"""Lines of known constants over a measured spectrum: temperature and dipole ratios from its peaks, pictures, mistakes."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from assignment_cases import BAND, TRUTH, lines_of, spectrum

import rotor
from rotor.assignment.peaks.intensities import fit_intensities, line_types, matched
from rotor.assignment.peaks.peak_finding import pick_peaks
from rotor.assignment.peaks.peak_list import peak_list
from rotor.plots.spectra.over import loomis_wood_figure, over_figure
from rotor.spectra.lines import Lines

Call = Callable[..., tuple[int, str, str]]
CONSTANTS = " ".join(f"{name}={value}" for name, value in TRUTH.items()) + " MHz"


def known_lines(
    temperature_k: float = 5.0, factor: float = 1.0, dipole: tuple[float, float, float] = (1.0, 1.0, 1.0)
) -> Lines:
    """Lines of the constants of the spectrum, at another temperature and with equal components of the dipole."""
    constants = {name: value * (factor if name in "ABC" else 1.0) for name, value in TRUTH.items()}
    top = rotor.Top.from_constants(
        rotor.Constants(**constants, reduction="S", representation="Ir"), dipole_abc_debye=dipole
    )
    return rotor.api.line_list(top, temperature_k=temperature_k, jmax=30, range_mhz=BAND)


@pytest.mark.parametrize("seed", [5, 6, 7])
def test_temperature_and_dipole_follow_from_the_heights(seed: int) -> None:
    """Made at 2 K with 0 : 1 : 0.6; the lines that are compared have 5 K and 1 : 1 : 1."""
    fit = fit_intensities(known_lines(), spectrum(seed))
    assert abs(fit.temperature_k - 2.0) < 4 * fit.temperature_error_k
    assert fit.temperature_error_k < 0.1
    np.testing.assert_allclose(fit.dipole_ratio, [0.0, 1.0, 0.6], atol=0.04)
    assert 0.1 < fit.scatter < 0.3  # the heights scatter by 20 %


def test_heights_are_those_of_the_lines() -> None:
    """Of a spectrum without scatter: heights of lines are those it was made with, within the approximation hν << kT."""
    f, i = lines_of(TRUTH, (0.0, 1.0, 0.6), 100.0)
    lines = known_lines()
    fit = fit_intensities(lines, peak_list(f, i, 0.001, band_mhz=BAND))
    heights = fit.heights(lines)
    at = [int(np.argmin(np.abs(lines.frequency_mhz - frequency))) for frequency in f]
    single = np.array([np.sort(np.abs(f - frequency))[1] > 0.3 for frequency in f])
    np.testing.assert_allclose(heights[at][single], i[single], rtol=0.1)


def test_components_that_were_given_count() -> None:
    """With the dipole as it is the ratio stays."""
    fit = fit_intensities(known_lines(dipole=(0.0, 2.0, 1.2)), spectrum())
    np.testing.assert_allclose(fit.dipole_ratio, [0.0, 1.0, 0.6], atol=0.04)


def test_a_type_with_peaks_by_chance_is_absent() -> None:
    """A strong peak at one line of a-type, as of another molecule, does not make the type present."""
    peaks, lines = spectrum(), known_lines()
    a_type = np.flatnonzero(line_types(lines, np.arange(len(lines))) == 0)
    strongest = a_type[np.argsort(-lines.intensity_nm2_mhz[a_type])[:40]]
    rows = [row for row in strongest.tolist() if np.abs(peaks.frequency_mhz - lines.frequency_mhz[row]).min() > 1.0][:2]
    f = np.append(peaks.frequency_mhz, lines.frequency_mhz[rows])
    more = peak_list(f, np.append(peaks.intensity, [300.0] * len(rows)), 0.005, band_mhz=BAND)
    np.testing.assert_allclose(fit_intensities(lines, more).dipole_ratio, [0.0, 1.0, 0.6], atol=0.04)


def test_wrong_constants_have_few_lines_with_a_peak() -> None:
    right, wrong = (int((matched(known_lines(factor=factor), spectrum())[1] >= 0).sum()) for factor in (1.0, 1.01))
    assert right > 60
    assert wrong < right / 6
    with pytest.raises(ValueError, match="at least 5 are needed"):
        fit_intensities(known_lines(), peak_list([8100.0, 9000.0], [1.0, 2.0]))


def test_rows_of_right_constants_have_a_peak_in_the_middle() -> None:
    """And those of wrong constants have not."""
    peaks, shares = spectrum(), []
    for factor in (1.0, 1.01):
        lines = known_lines(2.0, factor, (0.0, 1.0, 0.6))
        axes = loomis_wood_figure(lines, lines.intensity_nm2_mhz, peaks, "rows").axes[0]
        marks = [path.vertices for collection in axes.collections for path in collection.get_paths()]
        middle = {round(float(mark[:, 1].mean())) for mark in marks if abs(mark[0, 0]) < 0.05}
        shares.append(len(middle) / len(axes.get_yticks()))
    assert shares[0] > 0.95
    assert shares[1] < 0.2


TURNING = {"F0": 160000.0, "delta": 0.6, "V3": 9e6}


def test_series_of_split_lines_have_species_and_sums_of_spins() -> None:
    """Lines with N in place of J, half-integer F, and A and E of a methyl group: rows of a species stand together."""
    from rotor.tops.internal_rotation import InternalRotationConstants

    top = rotor.Top.from_constants(
        {"A": 9200.0, "B": 3000.0, "C": 2310.0, "chi_aa(35Cl)": -60.0, "chi_bb-cc(35Cl)": 3.0},
        dipole_abc_debye=(1.5, 1.0, 0.0),
    )
    top = dataclasses.replace(top, internal_rotation=InternalRotationConstants(TURNING, frame="PAM"))
    lines = rotor.api.line_list(top, jmax=3, temperature_k=2.0, effects=rotor.api.effects_of(top, True))
    axes = loomis_wood_figure(lines, lines.intensity_nm2_mhz, spectrum(), "rows").axes[0]
    names = [text.get_text() for text in axes.get_yticklabels()]
    assert re.fullmatch(r"\$\\mathrm{A}\\;v_t{=}0\\;\d_{\d,\d}\$ – \$\d_{\d,\d}\$, \$F = \d+/2 – \d+/2\$", names[0]), (
        names[0]
    )
    figure = over_figure(lines, lines.intensity_nm2_mhz, spectrum(), "")
    figure.canvas.draw()
    assert all(text.get_window_extent().y1 <= figure.axes[0].bbox.y1 for text in figure.axes[0].texts)
    species = [name[9] for name in names]
    assert species == sorted(species)
    assert {*species} == {"A", "E"}


def test_command_with_pictures(call: Call, folder: Path) -> None:
    columns = spectrum().columns
    np.savetxt("peaks.csv", np.column_stack(list(columns.values())), delimiter=",", fmt="%.6f")
    arguments = ("spectrum", "--constants", CONSTANTS, "--dipole-abc", "1,1,1", "--temperature", "2", "--jmax", "20")
    code, shown, error = call(
        *arguments, "--over", "peaks.csv", "--plot", "o.png", "--loomis-wood", "l.png", "--json", "o.json"
    )
    assert code == 0, error
    assert "|μa| : |μb| : |μc| = 0.00 : 1.00 : 0." in shown
    fit = json.loads(Path("o.json").read_text())["over"]["fit"]
    assert fit["temperature_k"] == pytest.approx(2.0, abs=0.15)
    for name in ("o.png", "l.png"):
        assert Path(name).read_bytes().startswith(b"\x89PNG")
    code, _, error = call(*arguments, "--loomis-wood", "l.png")
    assert (code, "its rows are pieces of a spectrum; expected with --over" in error) == (2, True)
    code, _, error = call(*arguments, "--over", "none.csv")
    assert (code, "no such file" in error) == (2, True)
    Path("far.csv").write_text("200000,1\n300000,2\n")
    code, _, error = call(*arguments, "--range", "8000:18000", "--over", "far.csv")
    assert code != 0
    assert "no line lies in its band" in error


def test_strongest_lines_are_named_above_their_peaks() -> None:
    from rotor.plots.spectra.over import over_figure
    from rotor.plots.view import View
    from rotor.quantum.labels.quanta import line_text

    lines, peaks = known_lines(temperature_k=2.0, dipole=(0.0, 1.0, 0.6)), spectrum()
    heights = fit_intensities(lines, peaks).heights(lines)
    axes = over_figure(lines, heights, peaks, "", View()).axes[0]
    first, last = axes.get_xlim()
    assert (
        first < peaks.band_mhz[0] < peaks.band_mhz[1] < last
    )  # a list ends at its outermost peaks, which stand off the frame
    names = {text.get_text(): text.xy for text in axes.texts}
    at = {
        line_text(lines.levels.quanta, int(lines.upper[row]), int(lines.lower[row])): lines.frequency_mhz[row]
        for row in np.flatnonzero(heights > 0.01 * heights.max()).tolist()
    }
    assert len(names) >= 8
    assert all(x == at[name] and y > 0 for name, (x, y) in names.items())


def test_lines_in_gaps_of_the_spectrum_are_not_compared(call: Call) -> None:
    """Two windows 1 GHz apart: the lines between them were not recorded. The short help names --over."""
    known = known_lines().frequency_mhz
    windows = ((8000.0, 9000.0), (10000.0, 11000.0))
    f = np.concatenate([np.arange(a, b, 0.1) for a, b in windows])
    x = sum(np.exp(-(((f - at) / 0.3) ** 2) / 2) for at in known) + 0.005 * np.random.default_rng(2).normal(size=len(f))
    np.savetxt("gaps.txt", np.column_stack([f, x]), fmt="%.5f")
    code, _, error = call(
        "spectrum", "--constants", CONSTANTS, "--dipole-abc", "1,1,1", "--temperature", "5", "--over", "gaps.txt",
        "--json", "over.json", "--csv", "lines.csv",
    )  # fmt: skip
    assert code == 0, error
    over = json.loads(Path("over.json").read_text())["over"]
    lines = np.genfromtxt("lines.csv", delimiter=",", names=True, usecols=(0,))["frequency_mhz"]
    inside = sum(int(((lines > a) & (lines < b)).sum()) for a, b in windows)
    assert 0 < inside < ((lines > 8000) & (lines < 11000)).sum() - 20
    assert abs(over["lines"] - inside) <= 2
    assert "--over FILE" in call("spectrum", "--help")[1]


def test_a_spectrum_on_a_grid_is_drawn_as_a_curve() -> None:
    """The picture has the recorded points, not the peaks found in them."""
    frequency = np.arange(6000.0, 6100.0, 0.02)
    noise = 1e-3 * np.random.default_rng(1).normal(size=len(frequency))
    height = np.exp(-(((frequency - 6020.0) / 0.06) ** 2)) + np.exp(-(((frequency - 6071.3) / 0.06) ** 2)) + noise
    peaks = pick_peaks(frequency, height)
    lines = known_lines()
    axes = over_figure(lines, lines.intensity_nm2_mhz, peaks, "").axes[0]
    curve = next(line for line in axes.lines if line.get_label() == "spectrum")
    np.testing.assert_array_equal(curve.get_ydata(), height)
    assert all(label >= "0" for label in (tick.get_text() for tick in axes.get_yticklabels()))  # no negative intensity
