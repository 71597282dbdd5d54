"""Tops whose diagonal elements fall as K rises: oblate ones written in prolate axes, with a term that joins K and K + 6.

K is nearly good: frequencies of lines with ΔK = 0 are those of the diagonal elements, whatever block and order the levels stand in.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from spcat_fits import fit_of_prediction

from rotor.cli import run
from rotor.fitting.fit import fit_lines
from rotor.formats.spcat.fits.fit_input import read_fit
from rotor.formats.spcat.hamiltonian.labels import connected_groups, falls_with_k
from rotor.formats.spcat.predict import Prediction, predict
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import ParameterFile, format_par, read_par

MEAN, ALONG = 133480.0, -15992.0


def _file(options: str = "-1 1 0 60 0 1 1 1 0 1 0", chi: float = 0.0, h3: float = 2e-9) -> ParameterFile:
    """B = A of an oblate top along x and y of the prolate basis; in the oblate basis, NVIB -1, the same as a prolate top."""
    prolate = options.split()[1] == "1"
    mean, along = (MEAN, ALONG) if prolate else (MEAN + ALONG, -ALONG)
    spins = f"110010000 {chi} 1e-37\n" if chi else ""
    text = (
        f"t\n {6 + bool(chi)} 900 20 0 0.0 1.0e6 1.0 1.0\ns {options}\n100 {mean} 1e36\n1000 {along} 1e-37\n200 -3.95 1e36\n"
        f"1100 5.18 1e36\n2000 -4.24 1e-37\n60000 {h3} 1e36\n{spins}"
    )
    return read_par(text.encode())


def _prediction(file: ParameterFile, fend: int = 8) -> Prediction:
    axis = 1 if file.options[0].nvib > 0 else 3
    return predict(file, read_int(f"t\n0 1 1000.0 0 {fend} -30 -30 99999 300\n{axis} 1.2\n".encode()))


def _diagonal(file: ParameterFile, n: int, k: int) -> float:
    values = {p.code: p.value for p in file.parameters}
    x = n * (n + 1)
    return values[100] * x + values[1000] * k**2 + values[200] * x**2 + values[1100] * x * k**2 + values[2000] * k**4


@pytest.mark.parametrize("options", ["-1 1 0 60 0 1 1 1 0 1 0", "-1 -1 0 60 0 1 1 1 0 1 0", "-1 1 0 60 0 4 1 1 0 1 0"])
@pytest.mark.parametrize("chi", [0.0, 0.001])
def test_k_is_that_of_the_function(options: str, chi: float):
    """Every line R(N) of one K lies at the difference of its diagonal elements; the term of third order moves it by less."""
    file = _file(options.replace("-1 ", "-3 ", 1) if chi else options, chi)
    computed = _prediction(file)
    listed, count = computed.catalogue, 0
    for up, low, frequency in zip(
        listed.quanta_upper.tolist(), listed.quanta_lower.tolist(), listed.frequency_mhz.tolist(), strict=True
    ):
        if up[0] == low[0] + 1 and abs(up[1]) == abs(low[1]):
            n, k = low[0], abs(low[1])
            assert frequency == pytest.approx(_diagonal(file, n + 1, k) - _diagonal(file, n, k), abs=0.01)  # chi and h3
            count += 1
    assert count >= 36 if options.endswith("1 1 1 0 1 0") else count >= 20
    assert any("on the diagonal of the Hamiltonian falls with K" in note for note in computed.notes)


def test_other_files_have_no_such_note():
    upright = read_par(format_par(_file()).replace(b"-15992", b"15992"))
    assert not [note for note in _prediction(upright).notes if "falls" in note]


def test_where_the_diagonal_falls():
    states = [{"b": {(1, 0, 0): 1.0}, "c": {(0, 1, 0): 1.0}, "d": {(0, 2, 0): 1.0}, "x": {(0, 0, 1): 1.0}}]
    rising = {"b": 5.0, "c": 2.0, "d": 0.0, "x": 9.0}
    assert falls_with_k(states, rising, 20, oblate=False) is None
    assert falls_with_k(states, rising, 20, oblate=True) == 2
    # 2 K^2 - 0.02 K^4 has its maximum at K^2 = 50: K = 8 lies above 6 by 2 (64 - 36) - 0.02 (4096 - 1296) = 0
    turned = {**rising, "d": -0.0201}
    assert falls_with_k(states, turned, 20, oblate=False) == 8


def test_functions_that_nothing_joins_are_named_apart():
    """A matrix of K = 0, 2 without an element between them, the diagonal falling: by energy alone K = 0 would be the lower state."""
    energies, vectors = np.array([1.0, 5.0]), np.array([[0.0, 1.0], [1.0, 0.0]])
    groups = connected_groups(np.zeros(2, dtype=int), np.array([0, 2]), vectors, energies, 3)
    assert groups.tolist() == [0, 1]
    joined = np.linalg.eigh(np.array([[5.0, 0.1], [0.1, 1.0]]))
    assert connected_groups(np.zeros(2, dtype=int), np.array([0, 2]), joined[1], joined[0], 3).tolist() == [0, 0]


def test_with_diag_0_functions_beyond_the_fall_stand_alone():
    """SPCAT looks from K = 4 on in a block that begins with K = 0; 6 lies below 4 here, so that 6 and 8 are taken out."""
    matrix = np.diag([0.0, 2.0, 4.0, 3.0, 6.0]) + 0.1 * (np.eye(5, k=1) + np.eye(5, k=-1))
    energies, vectors = np.linalg.eigh(matrix)
    groups = [connected_groups(np.zeros(5, dtype=int), np.arange(0, 10, 2), vectors, energies, diag) for diag in (0, 3)]
    assert groups[0].tolist() == [0, 0, 0, 1, 2]
    assert groups[1].tolist() == [0] * 5


@pytest.mark.parametrize(
    "options",
    ["-1 1 0 60 0 1 1 1 0 1 0", "-1 1 0 60 0 4 1 1 0 1 0", "-1 -1 0 60 0 1 1 1 0 1 1"],
)
def test_a_fit_finds_the_constants(options: str, tmp_path: Path):
    """Lines of the true constants, which h3 of 2e-4 MHz moves by up to a GHz, from a start with B 0.1 % off."""
    true = _file(options, h3=2e-4)
    _, fit = fit_of_prediction(true, _prediction(true, 7), tmp_path)
    assert fit.converged, fit.reason
    assert fit.weighted_rms < 0.01
    expected = [p.value for p in true.parameters if p.error is not None and p.error > 1]
    assert (np.abs(fit.values - expected) < 0.1 * fit.errors).all()  # lines are given to 1e-5 of 0.01 MHz


@pytest.mark.parametrize("diag", [0, 1, 2, 4, 5])
@pytest.mark.parametrize("nvib", [1, -1])
def test_a_fit_with_spins_names_levels_as_the_prediction_does(diag: int, nvib: int, tmp_path: Path):
    """Named by energy in each Wang block, as K rises, no fit converged (weighted rms 2e7)."""
    true = _file(f"-3 {nvib} 0 60 0 1 1 1 0 1 {diag}", chi=0.5, h3=2e-4)
    fit_input, fit = fit_of_prediction(true, _prediction(true, 5), tmp_path)
    assert fit.converged, fit.reason
    assert fit.weighted_rms < 0.01
    expected = [p.value for p in true.parameters if p.error is not None and p.error > 1]
    assert (np.abs(fit.values - expected) < 0.1 * fit.errors).all()
    assert not any("by energy" in note for note in fit_input.notes)


def test_names_of_spins_are_those_of_the_constants_of_each_step(tmp_path: Path):
    """The model of a fit beside predictions at other constants: its energies by quantum numbers are theirs, under each DIAG."""
    for diag in (0, 1, 2, 4, 5):
        true = _file(f"-3 1 0 60 0 1 1 1 0 1 {diag}", chi=0.5, h3=2e-4)
        fit_input, _ = fit_of_prediction(true, _prediction(true, 4), tmp_path)
        assert fit_input.model is not None
        lines = fit_input.lines
        other = replace(true, parameters=tuple(replace(p, value=1.02 * p.value) for p in true.parameters))
        values = np.array([p.value for p in other.parameters])
        energies = [fit_input.model(labels).levels(values)[0] for labels in (lines.upper, lines.lower)]
        listed = _prediction(other, 4).catalogue
        frequency = {
            (*up[:3], *low[:3]): nu
            for up, low, nu in zip(
                listed.quanta_upper.tolist(), listed.quanta_lower.tolist(), listed.frequency_mhz.tolist(), strict=True
            )
        }
        both = np.column_stack([lines.upper, lines.lower]).tolist()
        expected = [frequency[tuple(row)] for row in both]
        np.testing.assert_allclose(energies[0] - energies[1], expected, atol=1e-3)


CASES = "cases_refused_or_wrong"


@pytest.mark.oracle
def test_the_lines_of_spcat(shared: Path, tmp_path: Path, capsys):
    """50 lines, and that at 533,793.6 MHz is 2 0 - 1 0."""
    assert (
        run(
            [
                "spectrum",
                str(shared / "reference" / CASES / "oblate_c3v_diag0.int"),
                "--cat",
                str(tmp_path / "a.cat"),
                "--json",
                "-",
            ]
        )
        == 0
    )
    assert len(json.loads(capsys.readouterr().out)["strongest"]) > 0
    lines = (tmp_path / "a.cat").read_text().splitlines()
    assert len(lines) == 50
    (line,) = (text for text in lines if text.startswith("  533793.6000"))
    assert line[55:].split() == ["2", "0", "1", "0"]


@pytest.mark.oracle
@pytest.mark.parametrize("options", ["1 1 1 0 1 1", "4 1 1 0 1 0", "1 1 1 0 1 0"])
def test_the_fit_of_spfit(shared: Path, tmp_path: Path, options: str):
    """SPFIT converges with a weighted rms of 1.094; refused before for the order of A and B, or at an rms of 8.9e6 with IAX 4, DIAG 0."""
    folder = shared / "reference" / CASES
    text = (folder / "oblate_c3v_fit.par").read_text()
    assert "\ns -1 1 0 20 0 1 1 1 0 1 1\n" in text
    (tmp_path / "x.par").write_text(text.replace("20 0 1 1 1 0 1 1", f"20 0 {options}"))
    (tmp_path / "x.lin").write_text((folder / "oblate_c3v_fit.lin").read_text())
    fit_input = read_fit(tmp_path / "x.par")
    fit = fit_lines(
        fit_input.lines, fit_input.constants, fit_input.parameters, fit_input.options, model=fit_input.model
    )
    assert fit.converged, fit.reason
    assert fit.weighted_rms == pytest.approx(1.094, abs=6e-4)  # as SPFIT prints it
