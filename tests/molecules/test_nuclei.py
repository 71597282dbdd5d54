"""Isotopes against the tables they come from, and how names are read."""

import csv

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from places import SHARED

from rotor.molecules.nuclei import _isotopes, _lines, data_folder, element_symbol, isotope, isotope_by_mass, masses

NUCLEI = [item for element in _lines() for item in _isotopes(element).values()]


def test_published_values():
    assert isotope("H").mass_u == 1.007825031898  # AME2020, exact digits
    assert isotope("12C").mass_u == 12.0  # the definition of u
    assert isotope("D").spin == 1
    assert isotope("D").quadrupole_barn == 0.00285783
    assert isotope("35Cl").quadrupole_barn == -0.0817
    assert isotope("14N").quadrupole_barn == 0.02044
    assert isotope("127I").quadrupole_barn == -0.688


def test_quadrupole_ratio_of_bromine_isotopes_is_the_measured_one():
    ratio = isotope("79Br").quadrupole_barn / isotope("81Br").quadrupole_barn
    assert ratio == pytest.approx(1.1970568, rel=3e-4)  # molecular beams; 4 digits of each moment are tabulated


def test_elements_mean_their_most_abundant_isotope():
    computed = [isotope(symbol).mass_number for symbol in ("H", "C", "O", "Cl", "Br", "Sn", "Te")]
    assert computed == [1, 12, 16, 35, 79, 120, 130]
    assert isotope("Tc").mass_number == 97  # no abundance: the longest-lived


def test_abundances_of_an_element_add_up_to_one_or_none():
    for isotopes in map(_isotopes, _lines()):
        total = sum(item.abundance for item in isotopes.values())
        assert total == 0 or total == pytest.approx(1, abs=3e-4)  # the worst, 2.4e-4, is rounding of the tables


def test_mass_numbers_and_spins_fit_the_nucleus():
    for item in NUCLEI:
        assert round(item.mass_u) == item.mass_number
        assert (2 * item.spin) % 2 == item.mass_number % 2  # half-integer spin for an odd number of nucleons
        assert item.spin >= 1 or item.quadrupole_barn == 0.0  # Q of a spin below 1 vanishes (Wigner-Eckart)


@pytest.mark.parametrize("name", ["2H", "D", "H2", "H-2", "2-H", " D "])
def test_ways_to_write_deuterium(name):
    assert isotope(name) is isotope("H", 2)


@pytest.mark.parametrize(
    ("name", "number", "message"),
    [
        ("CL", None, "near it: Cl"),
        ("Xy", None, "not an element or isotope"),
        ("X", None, "'X' is a dummy atom, without a nucleus: remove it"),
        ("Bq", None, "a dummy atom"),
        ("", None, "not an element or isotope"),
        ("45C", None, "near it are 12C, 13C, 14C"),
        ("13C", 12, "the two differ"),
        ("c", None, "near it: C"),
    ],
)
def test_unknown_names_are_refused_with_what_is_near(name, number, message):
    with pytest.raises(ValueError, match=message):
        isotope(name, number)


@given(st.sampled_from(NUCLEI))
def test_a_label_and_a_mass_name_their_isotope(item):
    assert isotope(item.label) is item
    assert isotope_by_mass(item.symbol, item.mass_u) is item
    assert element_symbol(item.element_number) == item.symbol


def test_a_mass_of_zero_or_of_the_natural_mixture_is_no_isotope():
    for mass in (0.0, 35.453, float("nan")):
        with pytest.raises(ValueError, match="not that of an isotope of Cl"):
            isotope_by_mass("Cl", mass)


def test_an_element_number_that_is_none():
    with pytest.raises(ValueError, match="not the atomic number"):
        element_symbol(200)


def test_masses_of_many():
    np.testing.assert_array_equal(masses(["C", "H"], [13, 2]), [13.00335483534, 2.014101777844])
    np.testing.assert_array_equal(masses(["C", "H"], [None, 2]), [12.0, 2.014101777844])
    with pytest.raises(ValueError, match="2 symbols but 1 mass numbers"):
        masses(["C", "H"], [12])


def test_the_file_is_small_and_carries_its_sources():
    text = (data_folder() / "isotopes.csv").read_text(encoding="utf-8")
    assert len(text) < 60_000
    assert "AME2020" in text
    assert "INDC(NDS)-0833" in text


@pytest.mark.oracle
def test_every_natural_isotope_agrees_with_the_tables():
    path = SHARED / "reference/isotopes/isotopes_data.csv"
    if not path.is_file():
        pytest.skip(f"{path} is not here")
    with path.open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if float(row["abundance"] or 0) > 0]
    assert len(rows) == 288
    for row in rows:
        item = isotope(row["symbol"], int(row["mass_number"]))
        assert item.mass_u == float(row["mass [u]"])
        assert item.spin == float(row["spin"])
        if item.label != "126Te":  # the table's 8.84 % leaves tellurium at 90 %; 18.84 % is IUPAC's
            assert item.abundance == pytest.approx(float(row["abundance"]) / 100, rel=1e-7)  # 8 digits are kept
