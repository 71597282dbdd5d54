"""Errors of levels and lines: closed forms, statistics, the reference program's ERR column, tables and files."""

from __future__ import annotations

import gzip
import json

import numpy as np
import pytest

import rotor
from rotor.formats.lines.line_tables import catalogue
from rotor.formats.spcat.hamiltonian.codes import file_constants
from rotor.formats.spcat.text.cat import read_cat
from rotor.formats.spcat.text.par import read_par
from rotor.quantum.estimates.budgets import level_errors
from rotor.quantum.solve import solve_levels
from rotor.spectra.lines import line_list
from rotor.tops.constants.constants import Constants
from rotor.tops.constants.covariance import Covariance
from rotor.tops.top import Top

OCS = Constants(B=6081.492, D=1.3e-3, uncertainties={"B": 6e-6, "D": 2e-8})


def test_linear_molecule_in_closed_form():
    """ν = 2B(J+1) - 4D(J+1)³: σ² = (2(J+1) σB)² + (4(J+1)³ σD)² - 16 ρ (J+1)⁴ σB σD."""
    top = Top(OCS, (0.7, 0, 0))
    n = np.arange(1, 31.0)
    from_b, from_d = 2 * n * 6e-6, 4 * n**3 * 2e-8
    plain = line_list(top, jmax=30, min_lgint=None)
    assert np.allclose(plain.error_mhz, np.hypot(from_b, from_d), rtol=1e-10)
    rho = Covariance.from_correlations(["B", "D"], [6e-6, 2e-8], [[1, 0.9], [0.9, 1]])
    correlated = line_list(top, jmax=30, min_lgint=None, covariance=rho)
    closed = np.sqrt(from_b**2 + from_d**2 - 1.8 * from_b * from_d)
    assert np.allclose(correlated.error_mhz, closed, rtol=1e-9)


def test_errors_are_the_spread_of_drawn_constants():
    """300 sets of constants drawn from a correlated normal distribution: sample σ of each level within 5 / √600 of ours."""
    rng = np.random.default_rng(7)
    values = {"A": 9000.0, "B": 5000.0, "C": 3000.0, "DJ": 0.1, "d1": -0.02}
    sigma = np.array([0.02, 0.01, 0.015, 1e-4, 2e-5])
    root = rng.normal(size=(5, 5)) + 2 * np.eye(5)
    root /= np.linalg.norm(root, axis=1)[:, None]
    covariance = Covariance.from_correlations(tuple(values), sigma, root @ root.T)
    top = Top(Constants(**values))
    ours = level_errors(top, solve_levels(top, 8), covariance)

    drawn = rng.multivariate_normal(list(values.values()), covariance.matrix_mhz2, size=300)
    sets = [Constants(**dict(zip(values, row, strict=True))) for row in drawn]
    energies = np.array([solve_levels(Top(c), 8, vectors=False).energy_mhz for c in sets])
    assert ours[0] == 0
    assert np.allclose(energies.std(axis=0, ddof=1)[1:], ours[1:], rtol=5 / np.sqrt(600))


def correlations_in(rest: str, count: int) -> np.ndarray:
    """The matrix at the end of a .var file: a lower triangle by rows whose columns are unit vectors, C = Mᵀ M."""
    lines = [line for line in rest.splitlines() if line.strip()]
    numbers = [float(line[i : i + 10]) for line in lines for i in range(0, len(line.rstrip()), 10)]
    triangle = np.zeros((count, count))
    triangle[np.tril_indices(count)] = numbers[: count * (count + 1) // 2]
    return triangle.T @ triangle


@pytest.mark.oracle
def test_err_column_of_the_reference_program(shared):
    """SPCAT's ERR from the covariance of a fit with 15 constants, J ≤ 60: to its last digit on all lines it prints."""
    folder = shared / "reference" / "spfit" / "ared6_500_p0p1pct"
    file = read_par(folder / "ared6_500_p0p1pct.var")
    constants = file_constants(file, errors=True)
    names = [p.label.removeprefix("-").replace("Del", "Delta").replace("del", "delta") for p in file.parameters]
    signs = np.array([-1.0 if p.label.startswith("-") else 1.0 for p in file.parameters])
    correlations = correlations_in(file.rest, len(names)) * np.outer(signs, signs)
    covariance = Covariance.from_correlations(names, [constants.uncertainties[n] for n in names], correlations)
    with gzip.open(folder / "ared6_500_p0p1pct.cat.gz") as handle:
        theirs = read_cat(handle.read())

    ours = line_list(Top(constants, (1.201, 1.916, 0.365)), jmax=60, min_lgint=None, covariance=covariance)
    quanta = np.hstack([ours.quanta(ours.upper), ours.quanta(ours.lower)])
    place = {tuple(row): i for i, row in enumerate(quanta.tolist())}
    labels = np.hstack([theirs.quanta_upper[:, :3], theirs.quanta_lower[:, :3]]).tolist()
    rows = np.array([place[tuple(row)] for row in labels])
    difference = np.abs(ours.error_mhz[rows] - theirs.error_mhz)
    assert len(rows) > 2000
    assert (difference <= 1.01 * 5e-5 + 1e-4 * theirs.error_mhz).all()  # its rounding; 7 digits of the matrix


def test_unknown_stays_unknown():
    lines = line_list(Top(Constants(B=6081.492), (0.7, 0, 0)), jmax=3, min_lgint=None)
    assert lines.error_mhz is None
    assert "error_mhz" not in lines.columns
    assert (catalogue(lines).error_mhz == 0).all()
    assert lines.provenance["errors_from"] is None


def test_errors_reach_tables_and_files(tmp_path):
    lines = line_list(Top(Constants(B=6081.492, uncertainties={"B": 0.01}), (0.7, 0, 0)), jmax=3, min_lgint=None)
    assert list(lines.columns)[:2] == ["frequency_mhz", "error_mhz"]
    assert lines.strongest(1).error_mhz.tolist() == pytest.approx([0.06])
    rotor.write(lines, tmp_path / "x.cat")
    assert read_cat(tmp_path / "x.cat").error_mhz.tolist() == [0.02, 0.04, 0.06]
    rotor.write(lines, tmp_path / "x.json")
    content = json.loads((tmp_path / "x.json").read_text(encoding="utf-8"))
    assert content["provenance"]["errors_from"] == "uncertainties of B, uncorrelated"
    assert content["lines"][2]["error_mhz"] == pytest.approx(0.06)


def test_selected_lines_keep_their_errors():
    top = Top(Constants(A=9.0, B=5.0, C=3.0, uncertainties={"A": 1e-3, "C": 2e-3}), (1, 1, 1))
    lines = line_list(top, jmax=5, min_lgint=None)
    errors = lines.error_mhz
    assert np.array_equal(lines.where(slice(3, 9)).error_mhz, errors[3:9])


@pytest.mark.parametrize(
    ("names", "matrix", "says"),
    [
        (("B", "B"), np.eye(2), "a name is repeated"),
        (("B", "D"), np.eye(3), "square"),
        (("B", "D"), [[1, 0.5], [0.2, 1]], "symmetric"),
        (("B", "D"), [[1, 2], [2, 1]], "negative variance"),
        (("B", "D"), [[1, 2e-9], [2e-9, 1e-18]], "negative variance"),  # whatever the units are: a correlation of 2
        (("B",), [[-1]], "0 or more"),
        (("B",), [[np.nan]], "finite"),
    ],
)
def test_what_is_no_covariance(names, matrix, says):
    with pytest.raises(ValueError, match=says):
        Covariance(names, np.array(matrix, dtype=float))


def test_correlations_are_checked():
    with pytest.raises(ValueError, match="1 on its diagonal"):
        Covariance.from_correlations(["B"], [0.1], [[0.01]])
    with pytest.raises(ValueError, match="expected"):
        Covariance.from_correlations(["B", "D"], [0.1], np.eye(2))


def test_a_stranger_among_the_names_is_refused():
    top = Top(OCS, (0.7, 0, 0))
    lines = line_list(top, jmax=2, covariance=Covariance(("A",), np.eye(1)))
    with pytest.raises(ValueError, match="no parameter A here"):
        _ = lines.error_mhz


def test_constants_of_spins_beside_a_covariance_count_by_their_own_uncertainties():
    """The lines 1 - 0 of a linear molecule with I = 1: F' = 2, 1, 0 move by -eqQ/20, eqQ/4, -eqQ/2 (Casimir), B by 2."""
    from rotor.quantum.effects.of_top import effects_of
    from rotor.tops.spins.spin_constants import SpinConstants

    spins = SpinConstants({"chi_aa(14N)": -4.0}, {"14N": 2}, uncertainties={"chi_aa(14N)": 0.2})
    covariance = Covariance(("B",), np.array([[0.01**2]]))
    top = Top(Constants(B=6000.0), dipole_abc_debye=(1.0, 0.0, 0.0), spin_constants=spins, covariance=covariance)
    lines = line_list(top, jmax=1, effects=effects_of(top, True))
    f_upper = lines.levels.quanta["f"][lines.upper].tolist()
    expected = {2: 0.2 / 20, 1: 0.2 / 4, 0: 0.2 / 2}
    assert len(lines) == 3
    for f, error in zip(f_upper, lines.error_mhz.tolist(), strict=True):
        assert error == pytest.approx(np.hypot(0.02, expected[f]), rel=2e-3)  # of χ²/B, which is left out here
    assert lines.errors_from == "covariance of B; uncertainties of chi_aa(14N), uncorrelated"
    plain = line_list(top, jmax=1)
    assert plain.error_mhz == pytest.approx([0.02])
    assert plain.errors_from == "covariance of B"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("HC3N", "--spin-constants", "chi_aa(14N)=-4.31924 MHz"),
            "the constants alone, with chi_aa(14N) as exact; effects",
        ),
        (("HC3N",), "the constants alone; effects"),
        (("H2CO",), None),  # without a column of errors
    ],
)
def test_a_report_says_what_its_column_of_errors_holds(call, words, said):
    code, out, _ = call("spectrum", *words, "--range", "9.05:73GHz", "--temperature", "30")
    assert code == 0
    assert ("error (MHz)" in out) == (said is not None)
    assert ("\ncolumn error" in out) == (said is not None)
    assert said is None or f"from errors of {said} left out are not in it" in " ".join(out.split())
