"""What `rotor fit` says where the lines need constants that are not free, and what its counts and `rotor assign` say."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from assignment_cases import spectrum

import rotor
from rotor.fitting.budgets import predictions_budget
from rotor.fitting.fit import fit_lines
from rotor.fitting.parameters import parameters
from rotor.formats.lines.assigned_lines import read_assigned_lines
from rotor.spectra.lines import line_list
from rotor.tops.constants.constants import Constants

Call = Callable[..., tuple[int, str, str]]
RIGID = "A=5213.4471 B=1897.2265 C=1401.8812 MHz"
QUARTICS = {
    "A": {"DeltaJ": 2.1e-3, "DeltaJK": -1.1e-2, "DeltaK": 0.03, "deltaJ": 5.1e-4, "deltaK": 9.3e-3},
    "S": {"DJ": 2.1e-3, "DJK": -1.1e-2, "DK": 0.03, "d1": -5.1e-4, "d2": -2e-4},
}


def write_lines(path: Path, reduction: str) -> None:
    """Lines to J = 8 of a top with distortion, with normal noise of 3 kHz."""
    constants = Constants(A=5213.4471, B=1897.2265, C=1401.8812, **QUARTICS[reduction], reduction=reduction)
    lines = line_list(rotor.Top.from_constants(constants, dipole_abc_debye=(1, 1, 0)), jmax=8, min_lgint=None, q=1.0)
    quanta = np.stack([lines.levels.quanta[name] for name in ("j", "ka", "kc")], axis=1)
    seen = lines.frequency_mhz + 0.003 * np.random.default_rng(7).normal(size=len(lines))
    head = [f"{name}_{level}" for level in ("upper", "lower") for name in ("j", "ka", "kc")]
    rows = [
        ",".join(map(str, [*quanta[up], *quanta[low], f"{frequency:.4f}", 0.003]))
        for up, low, frequency in zip(lines.upper, lines.lower, seen, strict=True)
    ]
    path.write_text("\n".join([",".join([*head, "frequency_mhz", "error_mhz"]), *rows]) + "\n")


@pytest.mark.parametrize("reduction", ["A", "S"])
def test_a_fit_without_distortion_names_what_is_missing(call: Call, folder: Path, reduction: str) -> None:
    """Twenty lines far off were listed, of which none is wrong; the names are those of the reduction, and --choose finds them."""
    write_lines(folder / "l.csv", reduction)
    first, *others = QUARTICS[reduction]
    start = ("fit", "l.csv", "--constants", RIGID.replace(" MHz", f" {first}=0 MHz"), "--free", "A,B,C")
    code, out, _ = call(*start)
    assert code == 1
    words = " ".join(out.split())
    names = ",".join([first, *others])
    assert f"most lines are off: constants may be missing (--choose {names} adds those that the lines need" in words
    off = [line for line in out.splitlines() if line.startswith("far off, ")]
    assert len(off) == 6
    assert re.fullmatch(r"far off, \d+ further lines of \d+", off[-1])

    code, out, err = call(*start, "--choose", names)
    assert code == 0, err
    assert "most lines are off" not in out
    assert "CONVERGED" in out.splitlines()[0]


def test_a_line_that_alone_makes_the_fit_poor_is_named(call: Call, folder: Path) -> None:
    """A line 10,000 errors off takes most lines along; the advice was to free constants of distortion."""
    write_lines(folder / "l.csv", "A")
    text = " ".join(f"{name}={value}" for name, value in QUARTICS["A"].items())
    start = ("--constants", f"{RIGID.removesuffix(' MHz')} {text} MHz", "--free", "A,B,C")
    head, *rows = (folder / "l.csv").read_text().splitlines()
    place = next(i for i, row in enumerate(rows) if row.startswith("2,1,1,2,0,2,"))
    cells = rows[place].split(",")
    shifted = ",".join([*cells[:6], f"{float(cells[6]) + 30:.4f}", cells[7]])
    (folder / "off.csv").write_text("\n".join([head, *rows[:place], shifted, *rows[place + 1 :]]) + "\n")
    (folder / "without.csv").write_text("\n".join([head, *rows[:place], *rows[place + 1 :]]) + "\n")
    assert call("fit", "without.csv", *start, "--json", "f.json")[0] == 0
    rms = json.loads((folder / "f.json").read_text())["weighted_rms"]
    code, out, _ = call("fit", "off.csv", *start)
    assert code == 1
    said = f"outlier, line {place + 1}, 2 1 1 - 2 0 2: without it the weighted rms is about "
    assert float(" ".join(out.split()).partition(said)[2].split(";")[0]) == pytest.approx(rms, rel=0.1)
    assert "most lines are off" not in out


def test_a_trial_that_is_not_better_says_why(call: Call, folder: Path) -> None:
    """The cell was "no" beside F = 592 and a much lower AICc where the fit has an rms above 10."""
    write_lines(folder / "l.csv", "S")
    common = ("fit", "l.csv", "--constants", "A=5213.4471 B=1897.2265 C=1401.8812 DJ=0 MHz")
    _, out, _ = call(*common, "--free", "A,B,C", "--try", "DK", "--json", "t.json")
    trial = json.loads((folder / "t.json").read_text())["trials"][0]
    assert trial["chance"] < 1e-10
    assert trial["aicc"] < trial["aicc_before"]
    assert trial["better"] is False
    assert verdict(out, "DK") == "no: rms above 10"
    assert verdict(call(*common, "--free", "A,B,C", "--try", "DK", "--poor-rms", "1e4")[1], "DK") == "yes"

    out = call(*common, "--free", "A,B,C,DJ,DJK,DK,d1,d2", "--try", "HK,d1")[1]
    assert verdict(out, "HK") == "no: by chance, AICc, left-one-out rms"
    assert verdict(out, "d1") == "no: rms above 10, by chance, AICc"


def verdict(out: str, name: str) -> str:
    """The last cell of the row of a trial."""
    rows = out[out.index("\ntried\n") :].splitlines()
    return re.split(r"\s{2,}", next(row for row in rows if row.split()[:1] == [name]))[-1]


def test_degrees_of_freedom_say_what_they_count(folder: Path) -> None:
    """141 beside 144 lines and eight constants: five a-priori values count as data."""
    write_lines(folder / "l.csv", "S")
    lines, _ = read_assigned_lines(folder / "l.csv", ("j", "ka", "kc"))
    start = Constants(A=5213.4471, B=1897.2265, C=1401.8812, **QUARTICS["S"], reduction="S")
    names = ["A", "B", "C", *QUARTICS["S"]]
    free = parameters(start, names)
    plain = predictions_budget(fit_lines(lines, start, free)).statistics.source
    assert plain == f"{len(lines) - 8} degrees of freedom"
    priors = dict.fromkeys(["DJ", "d1"], 1e-3)
    known = predictions_budget(fit_lines(lines, start, parameters(start, names, priors_mhz=priors))).statistics.source
    assert known == (
        f"{len(lines) - 6} degrees of freedom from {len(lines)} frequencies and 2 a-priori values for 8 constants"
    )


@pytest.mark.slow
def test_peaks_that_are_left_point_to_isotopologues(call: Call, folder: Path) -> None:
    """The option is named where it was not given; not where nothing is left or no species is known."""
    columns = spectrum().columns
    rows = np.column_stack(list(columns.values()))
    np.savetxt("peaks.csv", rows, delimiter=",", header=",".join(columns), comments="", fmt="%.6f")
    code, out, _ = call("assign", "peaks.csv", "--range", "8000:18000")
    assert code == 0
    words = " ".join(out.split())
    assert re.search(
        r"left \d+ peaks belong to no species; isotopologues are .* --isotopologues --molecule FILE", words
    )
    assert re.search(r"degrees of freedom from \d+ frequencies and 5 a-priori values for 8 constants", words)
    rng = np.random.default_rng(1)
    np.savetxt("noise.csv", np.column_stack([rng.uniform(8000, 18000, 12), rng.random(12) + 1]), delimiter=",")
    assert "--isotopologues" not in call("assign", "noise.csv")[1]


def test_extremes_of_a_trace_are_samples(call: Call) -> None:
    """The largest sample, 0.712108 at 39.003 ps, stood beside a numerical error of 1e-6; the maximum is 0.712120 at 39.022 ps."""
    code, out, _ = call(
        "align", "--constants", "B=6081.492 MHz", "--anisotropy", "4.04", "--pulse", "1e13 W/cm2, 50 fs", "--points", "51",
        "--temperature", "0", "--tolerance", "1e-4", "--json", "a.json",
    )  # fmt: skip
    assert code == 0
    times = [row["t_ps"] for row in json.loads(Path("a.json").read_text())["trace"]]
    words = " ".join(out.split())
    step = f"{np.diff(times).max():.3g}"
    assert f"51 times, at most {step} ps apart; max and min are samples" in words


def test_the_report_says_how_far_cosines_go_between_samples(call: Call) -> None:
    """0.818652 is the largest of 2001 samples; the maximum, from 40001 samples, is 0.818675."""
    out = call("align", "OCS", "--pulse", "1e13 W/cm2, 0.1 ps", "--temperature", "1 K", "--until", "100 ps")[1]
    beyond = float(re.search(r"between them go about (\S+) further", " ".join(out.split()))[1])
    assert abs(beyond - 2.3e-5) < 0.5e-5  # a digit is printed
