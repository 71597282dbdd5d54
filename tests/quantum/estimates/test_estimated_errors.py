"""Errors of levels and lines from estimated errors of A, B, C: of a geometry, and of constants scaled from another isotopologue."""

from dataclasses import replace

import numpy as np
import pytest

import rotor
from rotor.quantum.estimates.budgets import known_covariance, source_of_errors
from rotor.tops.constants.constants import Constants

STEP = 1e-4  # of the estimated error, for differences


def lines(top):
    return rotor.spectrum(top, jmax=4, temperature_k=50.0, min_lgint=-30.0).table


def by_label(table):
    return np.lexsort(
        [table.columns[name] for name in table.columns if name.endswith(("_upper", "_lower")) and name[0] in "jk"]
    )


def test_errors_of_lines_are_differences_with_moved_constants():
    """σ² = Σ (ν(c + σ_c) - ν(c))², to first order."""
    top = replace(rotor.read("CH3CHO"), dipole_abc_debye=(2.4, 1.4, 0.0))
    at, variances = lines(top), 0.0
    for name, error in top.estimated_errors_mhz.items():
        moved = dict(top.constants.values) | {name: top.constants[name] + STEP * error}
        other = lines(replace(top, constants=Constants(**moved), molecule=None))
        difference = other.frequency_mhz[by_label(other)] - at.frequency_mhz[by_label(at)]
        variances = variances + (difference / STEP) ** 2
    assert at.error_mhz[by_label(at)] == pytest.approx(np.sqrt(variances), rel=1e-3)  # second order of a step of 2e-6


def test_a_uniform_error_of_all_constants_is_of_the_size_of_the_stated_one():
    top = rotor.read("CH3CHO")
    relative = top.molecule.uncertainty
    at = lines(top)
    r_branch = at.columns["ka_upper"] == at.columns["ka_lower"]
    r_branch &= at.columns["j_upper"] > at.columns["j_lower"]
    share = at.error_mhz[r_branch] / (relative * at.frequency_mhz[r_branch])
    assert ((share > 0.7) & (share < 1.0)).all()  # √(B² + C²)/(B + C) = 0.71 of independent errors


def test_an_isotopologue_has_the_error_of_scaling():
    table = rotor.spectrum("CH3Cl", isotopes="Cl=37Cl", jmax=2).table
    top = table.top
    assert table.error_mhz == pytest.approx(
        top.scaling_error * table.frequency_mhz, rel=1e-3
    )  # B alone; distortion is exact
    assert source_of_errors(top, ("A", "B", "DJ"), None) == "estimated errors of A, B, uncorrelated"


def test_constants_that_are_given_have_no_estimated_errors():
    assert known_covariance(rotor.read("OCS"), ("B",)) is not None  # its own
    assert known_covariance(rotor.Top.from_constants("B=6000 MHz"), ("B",)) is None


def test_a_catalogue_has_the_errors(call, folder):
    assert call("spectrum", "CH3CHO", "--jmax", "2", "--cat", "a.cat")[0] == 0
    rows = (folder / "a.cat").read_text().splitlines()
    errors = np.array([float(row[13:21]) for row in rows])
    assert errors.max() == 999.9999  # the widest that the column has
    assert 5 < errors[0] < 15  # 2 2 0 - 2 2 1 at 17.6 MHz goes as (B - C)²/A
