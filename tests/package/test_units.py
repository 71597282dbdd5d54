"""Constants against CODATA 2022 as scipy carries it, and the grammar of numbers with units."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.constants
from hypothesis import given
from hypothesis import strategies as st

from rotor import units


def codata(name: str) -> float:
    return float(scipy.constants.physical_constants[name][0])


def test_the_edition_is_codata_2022():
    """u of 2022 is 1.66053906892e-27 kg; 2018 had ...660."""
    assert units.CODATA_EDITION == "2022"
    assert codata("atomic mass constant") == units.ATOMIC_MASS_KG == 1.66053906892e-27
    assert codata("electron mass") == units.ELECTRON_MASS_KG


def test_constants_are_those_of_codata_2022():
    assert codata("speed of light in vacuum") == units.SPEED_OF_LIGHT_M_PER_S
    assert codata("Planck constant") == units.PLANCK_J_S
    assert codata("Boltzmann constant") == units.BOLTZMANN_J_PER_K
    assert codata("elementary charge") == units.ELEMENTARY_CHARGE_C
    assert codata("Avogadro constant") == units.AVOGADRO_PER_MOL
    assert codata("vacuum electric permittivity") == units.VACUUM_PERMITTIVITY_F_PER_M
    assert codata("Bohr radius") * 1e10 == pytest.approx(units.BOHR_RADIUS_ANGSTROM, rel=1e-12)
    assert codata("Hartree energy in eV") == pytest.approx(units.HARTREE_EV, rel=1e-12)
    assert codata("nuclear magneton in MHz/T") == pytest.approx(units.NUCLEAR_MAGNETON_MHZ_PER_T, rel=1e-10)
    assert codata("kelvin-hertz relationship") * 1e-6 == pytest.approx(units.MHZ_PER_K, rel=1e-9)
    assert pytest.approx(505379.00844, abs=5e-6) == units.ROTATIONAL_MHZ_U_ANGSTROM2
    assert pytest.approx(4.80320, abs=5e-6) == units.DEBYE_PER_E_ANGSTROM


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("9.2 GHz", "MHz", 9200.0), ("9.2GHz", "MHz", 9200.0), ("100", "K", 100.0), ("1cm^-1", "MHz", 29979.2458),
        ("−5 D", "D", -5.0), ("2e3 kHz", "MHz", 2.0), ("300 mK", "K", 0.3),
    ],
)  # fmt: skip
def test_quantities_are_converted_to_the_expected_unit(text, unit, value):
    assert units.parse_quantity(text, unit) == pytest.approx(value, rel=1e-15)


def test_a_unit_at_any_item_of_a_list_serves_the_items_without_one():
    """As at either end of a range; `1GHz,2` was 1000 and 2 MHz."""
    for text in ("1,2 GHz", "1GHz,2", "1 GHz, 2 GHz"):
        assert units.parse_grid(text, "MHz").tolist() == [1000.0, 2000.0]
    assert units.parse_grid("1 GHz,2 THz", "MHz").tolist() == [1e3, 2e6]


@given(st.floats(1e-6, 1e6), st.sampled_from(["Hz", "kHz", "MHz", "GHz", "THz", "cm-1"]))
def test_there_and_back(value, unit):
    assert units.parse_quantity(units.parse_quantity(f"{value!r} {unit}", "MHz"), "MHz") * units.parse_quantity(
        "1 MHz", unit
    ) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "unit", "words"),
    [
        ("5 K", "D", "does not measure the same thing"), ("5 parsec", "MHz", "not a known unit"), ("abc", "MHz", "not a number"),
        ("", "MHz", "not a number"), ("nan", "K", "not a number"), ("1e999", "K", "not a finite number"),
    ],
)  # fmt: skip
def test_quantities_without_a_meaning_are_refused(text, unit, words):
    with pytest.raises(ValueError, match=words):
        units.parse_quantity(text, unit)


def test_ranges_and_grids():
    assert units.parse_range("2:18GHz", "MHz") == (2000.0, 18000.0)
    assert units.parse_range("2GHz:18GHz", "MHz") == (2000.0, 18000.0)
    assert units.parse_range("500MHz:2GHz", "MHz") == (500.0, 2000.0)
    assert np.array_equal(units.parse_grid("0:200kV/cm:21", "kV/cm"), np.linspace(0, 200, 21))
    assert units.parse_grid("1, 2, 5 GHz", "MHz").tolist() == [1000.0, 2000.0, 5000.0]


@pytest.mark.parametrize("text", ["5", "5:", ":5", "7:3GHz", "1:2:3:4", "a:b", "2:18 D"])
def test_ranges_without_a_meaning_are_refused(text):
    with pytest.raises(ValueError, match=r"range|number|unit"):
        units.parse_range(text, "MHz")


@pytest.mark.parametrize("text", ["0:10", "0:10:1", "0:10:x", "1,,2"])
def test_grids_without_a_meaning_are_refused(text):
    with pytest.raises(ValueError, match=r"grid|number"):
        units.parse_grid(text, "MHz")


@pytest.mark.parametrize("unit", ["u A^2", "u*A2", "u Å²", "u angstrom^2"])
def test_moments_of_molecules_in_their_unit(unit):
    """B = h/(8π² I): 505379.00844 MHz of 1 u Å² (CONVENTIONS.md)."""
    moment = units.parse_quantity(f"1 {unit}", "kg*m2")
    assert units.PLANCK_J_S / (8 * math.pi**2 * moment) * 1e-6 == pytest.approx(505379.00844, rel=1e-11)  # digits
