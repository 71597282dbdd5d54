"""What the files of SPCAT say is what is computed: KNMIN and KNMAX cut the basis, spins that are not there have no constants.

What the program itself does otherwise than it documents is an option, and each such place has a note.
"""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import ORACLES

from rotor.cli import run
from rotor.fitting.fit import fit_lines
from rotor.formats.spcat.fits.fit_input import spfit_input
from rotor.formats.spcat.predict import Prediction, predict, predict_file
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.lin import read_lin
from rotor.formats.spcat.text.par import read_par

KINDS = ORACLES / "kinds"
TOP = (
    b"a top\n 4 900 9 0 0.0 1.0e6 1.0 1.0\na %s 1 %d %d 0 1 1 1 0 1 0\n"
    b"10000 9400.0 1e36\n20000 3100.0 1e36\n30000 2500.0 1e36\n200 -7.13e-4 1e36\n"
)
REQUEST = b"a top\n1 76004 1000.0 0 %d -19.0 -19.0 9000.0 300.0\n1 1.2\n3 0.4\n"
LINEAR = b"bent\n 2 0 0 0 0.0 1.0e6 1.0 1.0\nl -1 1 0 1 0 1 1 1 0 1 0\n100 6030.0 0\n200 -1e-3 0\n"


def _prediction(kmin: int, kmax: int, fend: int = 8, spind: bytes = b"1", **options: bool) -> Prediction:
    return predict(read_par(TOP % (spind, kmin, kmax)), read_int(REQUEST % fend), **options)


def _by_label(computed: Prediction) -> dict[tuple[int, ...], float]:
    listed = computed.catalogue
    labels = np.concatenate([listed.quanta_upper, listed.quanta_lower], axis=1)
    return dict(zip(map(tuple, labels.tolist()), listed.frequency_mhz.tolist(), strict=True))


def test_knmax_cuts_the_basis_unless_it_is_lifted():
    cut, whole, large = (
        _by_label(_prediction(0, 3)),
        _by_label(_prediction(0, 3, full_basis=True)),
        _by_label(_prediction(0, 60)),
    )
    assert whole == pytest.approx(large, abs=1e-9)  # the same basis
    assert len(cut) < len(whole)
    assert max(label[1] for label in cut) == 3  # Ka
    moved = max(abs(cut[label] - whole[label]) for label in cut)
    assert moved > 1.0


def test_a_note_says_what_the_cut_leaves_out_and_how_much():
    """At J = 8 the levels with K > 3 are 17 - 7; the shift is that of the J = 8 levels of two complete matrices."""
    (note,) = _prediction(0, 3).notes
    assert "KNMAX = 3 of state 0" in note
    assert "at J = 8 these are 10 of 17 levels" in note
    said = float(re.search(r"up to ([\d.e+]+) MHz", note)[1])
    energies = [_matrix_levels(8, limit) for limit in (3, 8)]
    # Wang's blocks are mixed here: the lowest 7 of 17 levels of the whole matrix are those with Ka <= 3
    assert said == pytest.approx(np.abs(energies[0] - energies[1][:7]).max(), rel=6e-3)  # three digits are printed
    assert _prediction(0, 60).notes == ()
    (lifted,) = _prediction(0, 3, full_basis=True).notes
    assert "KNMAX = 3 of state 0 is lifted" in lifted


def _matrix_levels(j: int, kmax: int) -> np.ndarray:
    """Eigenvalues of B Nb^2 + C Nc^2 + A Na^2 - D N^4 in signed K up to a limit, rising; z, x, y = a, b, c."""
    k = np.arange(-kmax, kmax + 1.0)
    jj = j * (j + 1.0)
    h = np.diag((3100.0 + 2500.0) / 2 * (jj - k**2) + 9400.0 * k**2 - 7.13e-4 * jj**2)
    step = (3100.0 - 2500.0) / 4 * np.sqrt((jj - k[:-2] * (k[:-2] + 1)) * (jj - (k[:-2] + 1) * (k[:-2] + 2)))
    return np.linalg.eigvalsh(h + np.diag(step, 2) + np.diag(step, -2))


def test_knmin_is_honoured_and_lifted():
    assert min(label[1] for label in _by_label(_prediction(2, 60))) == 2
    assert _by_label(_prediction(2, 60, full_basis=True)) == pytest.approx(_by_label(_prediction(0, 60)), abs=1e-9)
    assert "KNMIN = 2 of state 0" in _prediction(2, 60).notes[0]


def test_k_is_l_of_a_linear_molecule():
    """Lines R(J) of J to 6: 6 of l = 0 and 5 of each component of l = 1."""
    file, request = read_par(LINEAR), read_int((REQUEST % 6).replace(b"3 0.4\n", b""))
    listed = predict(file, request)
    assert sorted(np.abs(listed.catalogue.quanta_upper[:, 1]).tolist()) == [0] * 6 + [1] * 10
    assert "at J = 6 these are 10 of 13 levels, and the others lie where the whole basis" in listed.notes[0]
    assert np.abs(predict(file, request, full_basis=True).catalogue.quanta_upper[:, 1]).max() == 5  # of R(5): K to 5
    one_l = read_par(LINEAR.replace(b"l -1 1 0 1", b"l -1 1 1 1"))
    for lifted in (False, True):  # l is a quantum number of this state
        assert set(np.abs(predict(one_l, request, full_basis=lifted).catalogue.quanta_upper[:, 1]).tolist()) == {1}


def test_a_fit_and_a_prediction_have_one_basis(tmp_path):
    """Lines that a file predicts fit back to its constants, with the cut that the file says."""
    par = read_par(TOP % (b"1", 0, 3))
    listed = predict(par, read_int(REQUEST % 8)).catalogue
    rows = [
        "".join(f"{q:3d}" for q in (*up[:3], *low[:3])).ljust(36) + f" {frequency:.6f} 0.01"
        for up, low, frequency in zip(
            listed.quanta_upper.tolist(), listed.quanta_lower.tolist(), listed.frequency_mhz.tolist(), strict=True
        )
    ]
    (tmp_path / "a.lin").write_text("\n".join(rows) + "\n")
    fit_input = spfit_input(par, read_lin(tmp_path / "a.lin", 3, 900), "a.lin")
    fit = fit_lines(
        fit_input.lines, fit_input.constants, fit_input.parameters, fit_input.options, model=fit_input.model
    )
    assert fit.values == pytest.approx(fit_input.parameters.start, rel=1e-9)  # six decimals of frequencies
    assert fit.rms_mhz() < 1e-5  # six decimals


def test_a_fit_says_which_constants_it_passes_over(tmp_path):
    """As the prediction does: a quadrupole constant of a spin that SPIND does not name."""
    par = read_par((TOP % (b"1", 0, 60)).replace(b" 4 900", b" 5 900") + b"110010000 2.5 1e-37\n")
    (tmp_path / "a.lin").write_text("  1  0  1  0  0  0".ljust(36) + " 5600.0 0.01\n")
    notes = spfit_input(par, read_lin(tmp_path / "a.lin", 3, 900), "a.lin").notes
    assert any("parameter 110010000 is left out, as SPCAT does: spin 1" in note for note in notes)


def test_levels_have_the_basis_of_the_lines(tmp_path):
    (tmp_path / "a.var").write_bytes(TOP % (b"1", 0, 3))
    (tmp_path / "a.int").write_bytes(REQUEST % 8)
    all_levels = predict_file(tmp_path / "a.int", full_basis=True).levels
    cut = predict_file(tmp_path / "a.int").levels
    assert len(all_levels) == sum(2 * j + 1 for j in range(9))
    assert len(cut) == sum(min(2 * j + 1, 7) for j in range(9))
    for option, levels in (([], cut), (["--full-basis"], all_levels)):
        assert run(["spectrum", str(tmp_path / "a.int"), "--egy", str(tmp_path / "a.egy"), "--top", "0", *option]) == 0
        assert len((tmp_path / "a.egy").read_text().splitlines()) == len(levels)


def test_a_comparison_lifts_the_limits_too(tmp_path, capsys):
    """`rotor cat --compare case.int` had no --full-basis: beside the list of the whole basis it lacks the lines of other K."""
    (tmp_path / "a.var").write_bytes(TOP % (b"1", 0, 3))
    (tmp_path / "a.int").write_bytes(REQUEST % 8)
    files = str(tmp_path / "a.int"), str(tmp_path / "a.cat")
    assert run(["spectrum", files[0], "--full-basis", "--cat", files[1]]) == 0
    missing = {}
    for option in ([], ["--full-basis"]):
        capsys.readouterr()
        assert run(["cat", files[1], "--compare", files[0], "--json", "-", *option]) == 0
        missing[tuple(option)] = json.loads(capsys.readouterr().out)["compared"]["missing"]
    assert missing[()] > missing[("--full-basis",)] == 0
    assert run(["cat", files[1], "--compare", files[1], "--full-basis"]) == 2
    assert "--full-basis: expected with --compare and an .int file" in capsys.readouterr().err


def test_the_option_needs_an_int_file(capsys):
    assert run(["spectrum", "water", "--full-basis"]) == 2
    assert "--full-basis: expected with an .int file" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["o2", "moment_of_n", "moments_alone"])
def test_each_error_of_the_program_has_a_note(name):
    """Where --as-spcat changes a number, a note says so with and without it."""
    par, request = read_par(KINDS / name / f"{name}.var"), read_int(KINDS / name / f"{name}.int")
    request = replace(
        request, request=replace(request.request, fend=min(request.request.fend, request.request.fbgn + 4))
    )
    ours, program = predict(par, request), predict(par, request, as_spcat=True)
    lgint = [np.sort(computed.catalogue.lgint) for computed in (ours, program)]
    assert len(lgint[0]) != len(lgint[1]) or np.abs(lgint[0] - lgint[1]).max() > 1e-3  # above the digits printed
    assert sum("--as-spcat has SPCAT's" in note for note in ours.notes) == 1
    assert sum("so do these numbers" in note for note in program.notes) == 1


def test_qrot_below_one_has_a_note():
    request = read_int((REQUEST % 3).replace(b" 1000.0 ", b" 0.5 "))
    file = read_par(TOP % (b"1", 0, 60))
    ours, program = predict(file, request), predict(file, request, as_spcat=True)
    assert program.catalogue.lgint == pytest.approx(ours.catalogue.lgint - np.log10(2), abs=1e-4)  # digits printed
    assert "QROT = 0.5 is below 1: SPCAT takes 1, these numbers do not" in ours.notes[0]
    assert "so do these numbers" in program.notes[0]


def test_files_without_errors_of_the_program_have_no_such_note():
    """All kinds whose lines are equal either way."""
    for name in ("fso3", "dipoles_between", "water_diag1"):
        par, request = read_par(KINDS / name / f"{name}.var"), read_int(KINDS / name / f"{name}.int")
        request = replace(
            request, request=replace(request.request, fend=min(request.request.fend, request.request.fbgn + 2))
        )
        assert not [note for note in predict(par, request).notes if "as-spcat" in note]


@pytest.mark.oracle
@pytest.mark.parametrize("option", [[], ["--as-spcat"]])
def test_constants_of_spins_without_spins(shared: Path, option: list[str], capsys):
    """SPIND 1 in a file of two states: SPCAT passes over the quadrupole constants and lists 6,584 lines."""
    case = shared / "reference" / "cases_refused_or_wrong" / "two_states_spind1.int"
    assert run(["spectrum", str(case), "--top", "0", *option]) == 0
    said = capsys.readouterr()
    assert "lines         6584" in said.out
    for code in (110010099, 110040099):
        assert (
            f"note: parameter {code} is left out, as SPCAT does: spin 1 is not among the 0 that SPIND names" in said.err
        )


def test_a_file_that_is_read_as_a_top_notes_its_range_of_k(call, folder):
    """`rotor levels case.var` has every K, whatever KNMAX says, and had no word for it."""
    text = "a top\n 3 0 0 0\na 1 1 0 {knmax} 0 1 1 1 0 1 0\n 10000 30000.0 0\n 20000 9000.0 0\n 30000 8000.0 0\n"
    (folder / "cut.var").write_text(text.format(knmax=5))
    (folder / "whole.var").write_text(text.format(knmax=99))
    code, _, err = call("levels", "cut.var", "--jmax", "2")
    assert code == 0
    assert "note: KNMAX = 5 of state 0 in cut.var: constants alone are read from it here, and every K to N is" in err
    assert call("levels", "whole.var", "--jmax", "2")[2] == ""


def test_names_of_levels_that_mix_are_noted(call, folder):
    """Names of mixed levels are a choice: SPCAT's search for one may end elsewhere, as of states 4 and 5 of 18 (QNFMT 1404)."""
    source = ORACLES / "kinds" / "eighteen_states"
    strong = {
        "407": "1500000.0",
        "40000405": "900000.0",
    }  # MHz: a coupling of the size of what lies between the states, and an axis
    for suffix in (".int", ".var"):
        lines = (source / f"eighteen_states{suffix}").read_text().splitlines()
        codes = [line.split()[0] if line.split() else "" for line in lines]
        changed = [
            f" {code} {strong[code]} 0" if code in strong else line for code, line in zip(codes, lines, strict=True)
        ]
        (folder / f"mixed{suffix}").write_text("\n".join(changed) + "\n")
    code, out, err = call("spectrum", "mixed.int", "--top", "0")
    assert code == 0
    assert re.search(
        r"note: \d+ levels from J = 1 on are mixed by more than 50 %: what names a level has less than half", err + out
    )


@pytest.mark.parametrize(("diag", "whole"), [(1, False), (2, True), (4, True)])
def test_the_share_that_names_a_level_is_that_of_a_function_or_of_its_wang_block(diag, whole, tmp_path):
    """States of a rigid top lie in one block of Wang's functions; DIAG = 1 names them by single functions."""
    text = (TOP % (b"1", 0, 60)).replace(b" 1 1 1 0 1 0\n", b" 1 1 1 0 1 %d\n" % diag)
    (tmp_path / "a.var").write_bytes(text)
    (tmp_path / "a.int").write_bytes(REQUEST % 8)
    mixing = predict_file(tmp_path / "a.int").levels.mixing
    assert mixing.max() == pytest.approx(1.0, abs=1e-12)  # J = 0; round-off
    assert (mixing.min() > 1 - 1e-12) == whole
    assert (mixing.min() < 0.9) != whole
