"""Lines of one frequency, lines that were rejected, and half-integer quantum numbers: the same in a .csv and a .lin, from fit to fit."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import rotor
from rotor.cli import run
from rotor.fitting.reports.publication import name_text
from rotor.fitting.reports.report import dfbetas, influence, report_text, statistics_text
from rotor.formats.fits.fit_request import answer_fit, lines_request
from rotor.formats.lines.assigned_lines import read_assigned_lines, write_assigned_lines
from rotor.plots.spectra.fit import fit_figure
from rotor.spectra.lines import line_list
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

TRUE = Constants(A=9400.0, B=3100.0, C=2500.0)
HEADS = "j_upper,ka_upper,kc_upper,j_lower,ka_lower,kc_lower,frequency_mhz,error_mhz"
NAMES = ("j", "ka", "kc")


def _rows(jmax: int = 12) -> list[list[str]]:
    """Lines of a prolate asymmetric top; the two of one asymmetry doublet at high Ka fall together and are measured as one."""
    top = Top.from_constants(TRUE, dipole_abc_debye=(1.0, 0.0, 0.0))
    lines = line_list(top, jmax=jmax, min_lgint=None, q=1.0)
    quanta = lines.levels.quanta
    labels = [
        [str(quanta[name][rows[i]]) for rows in (lines.upper, lines.lower) for name in NAMES] for i in range(len(lines))
    ]
    return [[*label, f"{f:.3f}", "0.003"] for label, f in zip(labels, lines.frequency_mhz.tolist(), strict=True)]


def _merged(rows: list[list[str]]) -> list[list[str]]:
    """Two neighbours above 5 GHz that are not resolved are measured at their mean."""
    records = [list(row) for row in sorted(rows, key=lambda row: float(row[6])) if float(row[6]) > 5000]
    last = -1
    for place, (first, second) in enumerate(pairwise(records)):
        low, high = float(first[6]), float(second[6])
        if place > last and 0 < high - low < 0.5:
            first[6] = second[6] = f"{(low + high) / 2:.4f}"
            last = place + 1  # a third one is resolved
    return records


def _lin(rows: list[list[str]]) -> str:
    return "".join("".join(f"{int(q):3d}" for q in row[:6]).ljust(36) + f" {row[6]} {row[7]}\n" for row in rows)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    rows = _merged(_rows())
    (tmp_path / "a.csv").write_text("\n".join([HEADS, *(",".join(row) for row in rows)]) + "\n")
    (tmp_path / "a.lin").write_text(_lin(rows))
    return tmp_path


def _fit(path: str, reject: float | None = None):
    top = Top.from_constants(TRUE.replace(A=9401.0, C=2500.2))
    request = lines_request(path, top, ["A", "B", "C"])
    return answer_fit(replace(request, options=replace(request.options, reject_above=reject)))


def test_lines_of_one_frequency_blend_in_both_files(folder: Path):
    """Neighbours of equal frequency and error are one datum, as in SPFIT: constants, errors and counts are those of the .lin."""
    by_csv, by_lin = _fit("a.csv"), _fit("a.lin")
    assert by_csv.fit.lines.blend.tolist() == by_lin.fit.lines.blend.tolist()
    assert by_csv.fit.values == pytest.approx(by_lin.fit.values, rel=1e-12)
    assert by_csv.fit.errors == pytest.approx(by_lin.fit.errors, rel=1e-9)
    blended = int(by_csv.fit.lines.blended.sum())
    assert blended >= 20
    assert any(
        f"{blended} lines have the frequency and the error of their neighbours" in note for note in by_csv.request.notes
    )
    count = len(by_csv.fit.lines) - len(by_csv.fit.groups)
    assert statistics_text(by_csv.fit)[0].endswith(f"{blended - count} of these are blends of {blended} lines")


def test_a_column_of_blends_says_otherwise(folder: Path):
    rows = [line.split(",") for line in (folder / "a.csv").read_text().splitlines()[1:]]
    text = "\n".join([HEADS + ",blend", *(",".join([*row, ""]) for row in rows)])
    (folder / "b.csv").write_text(text + "\n")
    alone = _fit("b.csv")
    assert not alone.fit.lines.blended.any()
    assert len(alone.fit.groups) == len(rows)
    ratio = alone.fit.errors / _fit("a.csv").fit.errors
    assert (ratio < 0.99).all()  # a frequency that counts twice makes errors too small


def test_equal_frequencies_that_are_no_neighbours_or_have_other_errors_are_separate(folder: Path):
    rows = ["1,0,1,0,0,0,5600.0,0.01", "2,0,2,1,0,1,5600.0,0.02", "3,0,3,2,0,2,9000.0,0.02", "4,0,4,3,0,3,5600.0,0.02"]
    (folder / "c.csv").write_text("\n".join([HEADS, *rows]) + "\n")
    lines, notes = read_assigned_lines("c.csv", NAMES)
    assert lines.blend.tolist() == [0, 1, 2, 3]
    assert notes == []


@pytest.mark.parametrize("suffix", ["csv", "lin"])
def test_rejected_lines_stay_rejected(folder: Path, suffix: str):
    """The saved list has every line; those left out are marked, and the next fit without --reject has the same constants."""
    source = (folder / f"a.{suffix}").read_text().splitlines()
    place = next(i for i, line in enumerate(source) if "5600.000" in line)
    wrong = source[place].replace("5600.000", "5603.000")
    (folder / f"wrong.{suffix}").write_text("\n".join([*source[:place], wrong, *source[place + 1 :]]) + "\n")
    command = ["--constants", "A=9400.1 B=3100 C=2500.01", "--free", "A,B,C"]
    assert (
        run(
            ["fit", f"wrong.{suffix}", *command, "--reject", "20", "--save-lines", f"kept.{suffix}", "--json", "1.json"]
        )
        == 0
    )
    assert run(["fit", f"kept.{suffix}", *command, "--save-lines", f"again.{suffix}", "--json", "2.json"]) == 0
    first, second = (json.loads(Path(name).read_text()) for name in ("1.json", "2.json"))
    assert first["line_count"] == second["line_count"]
    assert first["lines_used"] == second["lines_used"] == first["line_count"] - 1
    for parameter, other in zip(first["parameters"], second["parameters"], strict=True):
        assert parameter["value"] == pytest.approx(other["value"], abs=1e-6)  # the same lines with the same weights
    assert any("it is marked as excluded" in note for note in second["notes"])
    names = ("j", "ka", "kc")
    saved, again = (read_assigned_lines(f"{name}.{suffix}", names)[0] for name in ("kept", "again"))
    assert saved.is_excluded.sum() == again.is_excluded.sum() == 1
    assert saved.frequency_mhz[saved.is_excluded].tolist() == [5603.0]
    everything, _ = read_assigned_lines(f"wrong.{suffix}", names)
    assert sorted(saved.frequency_mhz.tolist()) == sorted(everything.frequency_mhz.tolist())


def test_spfit_does_not_read_what_is_excluded(folder: Path):
    """A blank line ends the list there; a .par beside such a list has the line, and does not count it."""
    lines, _ = read_assigned_lines("a.lin", NAMES)
    marked = np.arange(len(lines)) == 3
    write_assigned_lines(replace(lines, excluded=marked), "case.lin")
    before, _, behind = (folder / "case.lin").read_text().partition("\n\n")
    assert before.count("\n") + 1 == len(lines) - 1
    assert behind.count("\n") == 2
    par = f"case\n 3 {len(lines)} 20 0 0 1e6 1 1\na 1 1 0 99 0 1 1 1 0 1 3\n10000 9400.1 1e36\n20000 3100 1e36\n30000 2500 1e36\n"
    (folder / "case.par").write_text(par)
    assert run(["fit", "case.par", "--save-lines", "again.lin", "--json", "p.json"]) == 0
    answer = json.loads((folder / "p.json").read_text())
    assert (answer["line_count"], answer["lines_used"]) == (len(lines), len(lines) - 1)
    assert (folder / "again.lin").read_text().split() == (folder / "case.lin").read_text().split()


def test_an_unknown_mark_is_refused(folder: Path):
    (folder / "d.csv").write_text(f"{HEADS},excluded\n1,0,1,0,0,0,5600.0,0.01,maybe\n")
    with pytest.raises(ValueError, match="line 1 of the table: excluded reads 'maybe'; yes or no is needed"):
        read_assigned_lines("d.csv", NAMES)


@pytest.mark.parametrize("count", [3, 4, 5])
def test_dfbetas_need_two_degrees_of_freedom(folder: Path, count: int):
    """With one, s(i) without a line is 0/0."""
    rows = [line.split(",") for line in (folder / "a.csv").read_text().splitlines()[1:]]
    chosen = [
        row
        for row in rows
        if row[:6] in (list("101000"), list("212111"), list("211110"), list("202101"), list("303202"))
    ]
    noisy = [[*row[:6], f"{float(row[6]) + 0.002 * (-1) ** i:.4f}", row[7]] for i, row in enumerate(chosen[:count])]
    (folder / "few.csv").write_text("\n".join([HEADS, *(",".join(row) for row in noisy)]) + "\n")
    answer = _fit("few.csv")
    assert answer.fit.degrees_of_freedom == count - 3
    moved = dfbetas(answer.fit)
    assert (moved is None) == (count < 5)
    if moved is None:
        assert influence(answer.fit)[0].startswith("undefined with ")
    assert "nan" not in report_text(answer.fit)
    assert (
        run(["fit", "few.csv", "--constants", "A=9400.1 B=3100 C=2500", "--free", "A,B,C", "--json", "few.json"]) == 0
    )
    records = json.loads((folder / "few.json").read_text())["lines"]
    assert all((record["dfbetas"] is None) == (count < 5) for record in records)


CHLORIDE = """name = "a chloride"
constants = { A = 9400.0, B = 3100.0, C = 2500.0 }
dipole = { a = 1.0 }
[spins.35Cl]
chi_aa = -50.0
chi_bb-cc = 10.0
"""
FREE = ["A", "B", "C", "chi_aa(35Cl)", "chi_bb-cc(35Cl)"]


@pytest.fixture
def chloride(folder: Path) -> Path:
    (folder / "start.toml").write_text(CHLORIDE)
    top = rotor.read("start.toml")
    lines = line_list(top, effects=rotor.api.effects_of(top, True), jmax=4, min_lgint=-9.0, q=1.0)
    quanta, names = lines.levels.quanta, ("n", "ka", "kc", "f")

    def labels(row: int) -> list[str]:
        return [*(str(quanta[name][row]) for name in names[:3]), f"{quanta['f'][row]}/2"]

    rows = [
        [*labels(up), *labels(low), f"{f:.5f}", "0.005"]
        for up, low, f in zip(lines.upper.tolist(), lines.lower.tolist(), lines.frequency_mhz.tolist(), strict=True)
    ]
    heads = [f"{name}_{side}" for side in ("upper", "lower") for name in names] + ["frequency_mhz", "error_mhz"]
    (folder / "cl.csv").write_text("\n".join([",".join(heads), *(",".join(row) for row in rows)]) + "\n")
    return folder


def test_half_integers_are_printed_as_such(chloride: Path):
    """9/2 in the report, in the saved list and on the axis of the picture."""
    answer = answer_fit(lines_request("cl.csv", rotor.read("start.toml"), FREE))
    fit = answer.fit
    row = int(np.flatnonzero(fit.lines.upper[:, 3] == 9)[0])
    text = fit.lines.text(row)
    assert "9/2" in text
    assert f" {text} " in report_text(fit)
    write_assigned_lines(fit.lines, "saved.csv")
    with (chloride / "saved.csv").open() as handle:
        saved = list(csv.DictReader(handle))
    assert saved[row]["f_upper"] == "9/2"
    again, _ = read_assigned_lines("saved.csv", fit.lines.names, fit.lines.halves)
    assert again.upper.tolist() == fit.lines.upper.tolist()
    axes = next(axes for axes in fit_figure(fit).axes if axes.get_xlabel().startswith("F of"))
    assert axes.get_xlabel() == "F of the upper state"
    assert (
        max(line.get_xdata().max() for line in axes.lines if len(line.get_xdata()) > 2)
        == fit.lines.upper[:, 3].max() / 2
    )


def test_a_level_that_does_not_exist_is_named_with_its_row(chloride: Path):
    lines = (chloride / "cl.csv").read_text().splitlines()
    lines[3] = "3,2,1,17/2,2,2,0,15/2," + ",".join(lines[3].split(",")[8:])
    (chloride / "cl.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(ValueError, match=r"cl.csv: line 3, 3 2 1 17/2 - 2 2 0 15/2 at .* MHz: there is no level"):
        answer_fit(lines_request("cl.csv", rotor.read("start.toml"), FREE))


def test_mass_numbers_are_raised_in_latex(chloride: Path):
    assert name_text("chi_aa(35Cl)", "latex") == r"$\chi_{aa}$($^{35}$Cl)"
    assert name_text("T_aa(14N_1,1H)[0]", "latex") == r"$T_{aa}$($^{14}$N\_1,$^{1}$H)[0]"
    assert name_text("chi_aa(35Cl)", "text") == "χ_aa(35Cl)"
    assert run(["fit", "cl.csv", "--start", "start.toml", "--free", ",".join(FREE), "--table", "t.tex"]) == 0
    assert r"$\chi_{aa}$($^{35}$Cl)" in (chloride / "t.tex").read_text()


def test_a_list_with_fewer_quantum_numbers_than_the_top_has_is_refused(tmp_path):
    (tmp_path / "a.lin").write_text("  1  1  0  0".ljust(36) + " 5600.0 0.01\n")
    with pytest.raises(ValueError, match="line 1 of the list: 2 quantum numbers for each state; 3 are needed"):
        read_assigned_lines(str(tmp_path / "a.lin"), NAMES)
