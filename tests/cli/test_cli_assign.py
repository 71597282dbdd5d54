"""`rotor assign`: the same numbers as from Python, files, scenes, and one line for each mistake."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from assignment_cases import BAND, TRUTH, is_right, lines_of, spectrum

import rotor
from rotor.assignment.assign import answer_assign
from rotor.assignment.peaks.peak_finding import pick_peaks
from rotor.assignment.request import AssignRequest
from rotor.formats.spectra.peak_files import peaks_from_columns, read_peaks

Call = Callable[..., tuple[int, str, str]]


@pytest.fixture
def peaks_csv(folder: Path) -> Path:
    """A list of peaks as a file."""
    path = folder / "peaks.csv"
    columns = spectrum().columns
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.6f")
    return path


def test_command_scene_and_python_agree(call: Call, peaks_csv: Path) -> None:
    code, shown, _ = call(
        "assign", "peaks.csv", "--range", "8000:18000", "--csv", "a.csv", "--lin", "a.lin", "--json", "a.json",
        "--plot", "a.png", "--save-scene", "a.toml",
    )  # fmt: skip
    assert code == 0
    assert "species 1, certain" in shown
    content = json.loads(Path("a.json").read_text())
    answer = answer_assign(AssignRequest(read_peaks(peaks_csv, BAND)))
    for key, value in json.loads(json.dumps(answer.facts())).items():
        assert content[key] == value
    assert Path("a.png").read_bytes().startswith(b"\x89PNG")
    assert len(Path("a.lin").read_text().splitlines()) == len(answer.species[0].lines)

    before = Path("a.csv").read_text()
    Path("a.csv").unlink()
    code, _, error = call("run", "a.toml")
    assert code == 0, error
    assert Path("a.csv").read_text() == before


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("7000,1\n9000,abc\n", "line 2: '9000,abc': expected two or three numbers, separated by commas or blanks"),
        ("7000,1\n9000\n", "line 2: 1 columns"),
        ("7,1\n9,1\n", "if they are in GHz, multiply by 1000"),
        ("7000,1\n9000,-3\n", "row 2: intensity is -3"),
        ("7000,1\n", "1 peak: constants need more"),
        ("frequency,intensity\n", "no numbers in it"),
    ],
)
def test_mistakes_in_a_list_are_one_line(call: Call, text: str, message: str) -> None:
    Path("peaks.csv").write_text(text)
    code, _, error = call("assign", "peaks.csv")
    assert code == 2
    assert message in error
    assert len(error.strip().splitlines()) == 1


def test_a_file_that_is_not_there(call: Call) -> None:
    code, _, error = call("assign", "none.csv")
    assert (code, "no such file" in error) == (2, True)
    code, _, error = call("assign")
    assert (code, "no spectrum" in error) == (2, True)


def test_a_geometry_is_needed_for_isotopologues(call: Call, peaks_csv: Path) -> None:
    code, _, error = call("assign", "peaks.csv", "--isotopologues")
    assert code == 2
    assert "a geometry of the first species is needed; give it as the molecule (--molecule FILE)" in error


def gridded(noise: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    """Gaussian lines of 0.1 MHz full width on a grid of 25 kHz, with noise."""
    rng = np.random.default_rng(6)
    f, i = lines_of(TRUTH, (0.0, 1.0, 0.6), 100.0)
    grid = np.arange(*BAND, 0.025)
    x = noise * rng.normal(size=len(grid))
    for f0, height in zip(f, i, strict=True):
        at = slice(*np.searchsorted(grid, [f0 - 0.4, f0 + 0.4]))
        x[at] += height * np.exp(-4 * np.log(2) * ((grid[at] - f0) / 0.1) ** 2)
    return grid, x


def test_a_spectrum_on_a_grid(tmp_path: Path) -> None:
    """Peaks are found within four of their errors, and the species from them; the same from text to its four decimals."""
    grid, x = gridded()
    np.save(tmp_path / "spectrum.npy", np.column_stack([grid, x]))
    part = slice(0, 40_000)
    np.savetxt(tmp_path / "part.csv", np.column_stack([grid[part], x[part]]), delimiter=",", fmt="%.4f")
    peaks, written = (read_peaks(tmp_path / name) for name in ("spectrum.npy", "part.csv"))
    assert len(written) > 2
    near = np.abs(peaks.frequency_mhz - written.frequency_mhz[:, None]).min(axis=1)
    assert (near < written.uncertainty_mhz).all()
    f, _ = lines_of(TRUTH, (0.0, 1.0, 0.6), 100.0)
    apart = np.array([np.abs(f - peak).min() for peak in peaks.frequency_mhz])
    alone = np.array([np.sort(np.abs(f - peak))[1] > 0.3 for peak in peaks.frequency_mhz])
    assert (apart[alone] < 4 * peaks.uncertainty_mhz[alone] + 0.001).mean() > 0.97
    assert is_right(answer_assign(AssignRequest(peaks, seconds=120)), 0, TRUTH)


def test_noise_alone_has_no_species(call: Call) -> None:
    """10⁶ points of noise: none is above six times the noise but by a chance of 1e-3; the answer is "not found"."""
    noise = np.random.default_rng(7).normal(size=1_000_000)
    grid = 6000 + 0.01 * np.arange(1_000_000)
    assert len(pick_peaks(grid, noise)) == 0
    np.save("noise.npy", np.column_stack([grid, noise]))
    code, out, _ = call("assign", "noise.npy", "--csv", "peaks.csv", "--plot", "noise.png", "--json", "noise.json")
    assert code == 0
    assert "not found: no asymmetric top stands above chance\n" in out
    assert "errors" not in out  # of no species


@pytest.mark.parametrize(
    ("factor", "sign", "message"),
    [(1e-3, 1.0, "if they are in GHz, multiply by 1000"), (1.0, -1.0, "the lines point down; change the sign")],
)
def test_a_grid_in_ghz_and_an_inverted_one(factor: float, sign: float, message: str) -> None:
    grid, x = gridded()
    with pytest.raises(ValueError, match=message):
        pick_peaks(factor * grid, sign * x)


@pytest.mark.parametrize("array", [np.ones((5, 4)), np.ones(6), np.ones((2, 3, 2)), np.array([["a", "b"]] * 3)])
def test_an_array_that_is_no_list_of_peaks_is_refused(call: Call, array: np.ndarray) -> None:
    np.save("peaks.npy", array)
    code, _, error = call("assign", "peaks.npy")
    assert code == 2
    assert f"an array of shape {array.shape}; expected two or three columns or rows of numbers" in error


@pytest.mark.parametrize(
    ("heading", "factor"),
    [("frequency_mhz,intensity", 1.0), ("frequency_ghz,intensity", 1e-3), ("f (cm-1),I", 1 / 29979.2458), ("f,I", 1.0)],
)
def test_a_heading_has_the_unit_of_the_frequencies(folder, heading, factor):
    """A column frequency_ghz was read as MHz and refused."""
    frequencies = [8100.25, 8211.5, 9301.125, 10007.5]
    rows = [f"{f * factor!r},{n + 1},{0.01 * factor!r}" for n, f in enumerate(frequencies)]
    Path("p.csv").write_text("\n".join([f"{heading},error", *rows]) + "\n")
    peaks = read_peaks("p.csv")
    np.testing.assert_allclose(peaks.frequency_mhz, frequencies, rtol=1e-12)
    np.testing.assert_allclose(peaks.uncertainty_mhz, 0.01, rtol=1e-9)
    assert peaks.intensity.tolist() == [1, 2, 3, 4]


@pytest.mark.parametrize(
    "text", ["f;I\n8100,25;1,5\n8211,5;2\n9301,125;3,25\n", "8100.25;1.5\n8211.5;2\n9301.125;3.25\n"]
)
def test_a_comma_between_semicolons_is_a_decimal_point(folder, text):
    """8100,25;1,5 was read as a peak at 8100 MHz of intensity 25 and error 1 MHz, without a word."""
    Path("p.csv").write_text(text)
    peaks = read_peaks("p.csv")
    np.testing.assert_array_equal(peaks.frequency_mhz, [8100.25, 8211.5, 9301.125])
    np.testing.assert_array_equal(peaks.intensity, [1.5, 2, 3.25])


def test_a_spectrum_with_decimal_commas(folder):
    from rotor.formats.spectra.text import read_text_spectrum

    rows = [f"{8 + n / 10:.1f};{n}.5".replace(".", ",") for n in range(5)]
    Path("s.csv").write_text("\n".join(["frequency_ghz;intensity_k", *rows]) + "\n")
    spectrum = read_text_spectrum(Path("s.csv"))
    np.testing.assert_allclose(spectrum.frequency_mhz, 8000 + 100 * np.arange(5))
    np.testing.assert_array_equal(spectrum.intensity, np.arange(5) + 0.5)


def in_pieces(edges: tuple[tuple[float, float, float], ...]) -> np.ndarray:
    """Rows of a spectrum in windows (first, last, step): noise about 0 and Gaussian lines in each window."""
    rng, rows = np.random.default_rng(3), []
    for first, last, step in edges:
        f = np.arange(first, last, step)
        centres = np.linspace(first, last, 7)[1:-1] + 0.013
        x = sum(np.exp(-(((f - centre) / 0.3) ** 2) / 2) for centre in centres) + 0.01 * rng.normal(size=len(f))
        rows.append(np.column_stack([f, x]))
    return np.concatenate(rows)


WINDOWS = ((9000.0, 9050.0, 0.1), (9300.0, 9340.0, 0.1), (9340.0, 9390.0, 0.06), (12000.0, 12040.0, 0.1))


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("digits", [2, 6])  # rounded to a tenth of the step, too
def test_a_spectrum_with_gaps_is_read_piece_by_piece(folder: Path, digits: int, order: int) -> None:
    """Rows of noise are below 0, so that they are no list of peaks; each window has its five lines."""
    np.savetxt(folder / "alma.txt", in_pieces(WINDOWS)[::order], fmt=f"%.{digits}f")
    peaks = read_peaks(folder / "alma.txt")
    expected = [x + 0.013 for first, last, _ in WINDOWS for x in np.linspace(first, last, 7)[1:-1]]
    np.testing.assert_allclose(peaks.frequency_mhz, expected, atol=0.02)
    np.testing.assert_allclose(peaks.windows, [(a, b - step) for a, b, step in WINDOWS], atol=0.12)
    assert peaks.covers(np.array([8999.0, 9020.0, 9100.0, 9341.0, 12020.0, 12041.0])).tolist() == [0, 1, 0, 1, 1, 0]
    part = read_peaks(folder / "alma.txt", (9310.0, 12010.0))
    assert part.windows[0, 0] == 9310.0
    assert part.windows[-1, 1] == 12010.0


@pytest.mark.parametrize("points", [100, 2000])
def test_channels_without_a_number_hide_no_line_elsewhere(call: Call, folder: Path, points: int) -> None:
    """A single channel that is NaN hid every peak within 4096 channels, without a word."""
    rows = in_pieces(((9000.0, 9000.0 + 0.1 * points, 0.1),))[:points]
    complete = peaks_from_columns(rows)
    columns = (
        1 if points < 300 else [0, 1]
    )  # a frequency is missing too in a file long enough to be a spectrum with gaps
    rows[[points // 30, points // 30 + 1], columns] = np.nan
    np.savetxt(folder / "grid.txt", rows)
    peaks = read_peaks(folder / "grid.txt")
    np.testing.assert_allclose(peaks.frequency_mhz, complete.frequency_mhz, atol=2e-3)
    assert peaks.notes == ("2 channels without a finite number left out",)
    assert "note: 2 channels without a finite number left out" in call("assign", "grid.txt")[2]
    with pytest.raises(ValueError, match="row 2: intensity is nan"):
        peaks_from_columns(np.array([[9000.0, 1.0], [9100.0, np.nan]]))
    with pytest.raises(ValueError, match="finite intensities"):
        pick_peaks(rows[20:, 0], np.append(rows[20:-1, 1], np.nan))


def test_a_guess_in_another_unit_is_refused(call: Call, peaks_csv: Path) -> None:
    code, _, error = call("assign", "peaks.csv", "--guess", "9,3,2.4")
    assert code == 2
    assert "--guess: A = 9 MHz" in error
    assert "9,3,2.4GHz" in error


def test_overlapping_windows_count_once(folder: Path) -> None:
    rows = in_pieces(((9000.0, 9050.0, 0.1),))
    second = rows[200:] + np.array([0.03, 0.0])
    np.savetxt(folder / "twice.txt", np.concatenate([rows, second]))
    assert len(read_peaks(folder / "twice.txt")) == 5


def test_a_long_list_that_is_no_grid_says_how_it_was_read(call: Call) -> None:
    f = np.sort(np.random.default_rng(1).uniform(8000, 18000, 400))
    np.savetxt("peaks.csv", np.column_stack([f, np.full(400, -1.0)]), delimiter=",")
    code, _, error = call("assign", "peaks.csv")
    assert code == 2
    assert "row 1: intensity is -1" in error
    assert "read as a list of peaks, as its steps are not equal" in error


@pytest.mark.parametrize(
    ("heading", "ghz"),
    [
        ("", False), ("# made at 300 K with a 100 GHz multiplier\n", False), ("# frequency_ghz intensity\n", True),
        ("#xLabel: frequency [GHz]\n#yLabel: (K)\n", True), ("# f (GHz)  T (K)\n", True), ("f (GHz)   T (K)\n", True),
        ("frequency_ghz intensity\n", True), ("frequency intensity\n", False), ("! f(GHz) T(K)\n", True),
    ],
)  # fmt: skip
def test_columns_between_blanks(folder: Path, heading: str, ghz: bool) -> None:
    factor = 1000.0 if ghz else 1.0
    rows = f"  {9000 / factor:.6f}   2.0 \n  {9100 / factor:.6f}\t5.7719E-03\n"
    (folder / "peaks.txt").write_text(heading + rows)
    peaks = read_peaks(folder / "peaks.txt")
    assert peaks.frequency_mhz.tolist() == pytest.approx([9000.0, 9100.0])
    assert peaks.intensity.tolist() == [2.0, 5.7719e-3]


def test_a_linear_molecule_is_found_by_its_progression(call, folder):
    """OCS as measured, J = 1 - 0 to 9 - 8, with its frequencies from the library: constants and lines for a fit."""
    lines = rotor.spectrum("OCS", temperature_k=20, range_mhz="10:120GHz").to_pandas()
    rows = np.column_stack([lines.frequency_mhz, 10 ** (lines.lgint + 5)])
    np.savetxt("peaks.csv", rows, delimiter=",", header="frequency_mhz,intensity", comments="", fmt="%.4f")
    code, out, err = call("assign", "peaks.csv", "--lin", "ocs.csv", "--json", "ocs.json")
    assert code == 0, err
    assert "not found: no asymmetric top stands above chance; lines of a linear top: below" in out
    assert "9 peaks left are its lines, J = 1 - 0 to 9 - 8: B 6081.492" in " ".join(out.split())
    (progression,) = json.loads(Path("ocs.json").read_text())["progressions"]
    assert progression["j_lower"] == list(range(9))
    assert progression["constants_mhz"]["B"] == pytest.approx(6081.49211, abs=1e-4)  # four decimals of the frequencies
    code, out, err = call("fit", "ocs.csv", "--constants", "B=6081 MHz", "--free", "B,D", "--json", "-")
    assert code == 0, err
    assert json.loads(out)["parameters"][0]["value"] == pytest.approx(progression["constants_mhz"]["B"], abs=1e-6)
