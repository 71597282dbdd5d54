"""Constants that were not measured are shown with their estimated error and no more digits than it leaves."""

import json
import re
from pathlib import Path

import pytest

import rotor
from rotor.tops.constants.uncertain_numbers import known_digits


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (288720.789408, 3464.6, "288700"), (6011.70626348, 72.0, "6012"), (6011.70626348, 99.9, "6012"), (6011.70626348, 100.0, "6010"),
        (9.630688888, 0.11557, "9.63"), (1.26, 2e-5, "1.260000"), (-12345.6, 130.0, "-12350"), (1.5, None, "1.5"), (1.5, 0.0, "1.5"),
    ],
)  # fmt: skip
def test_two_digits_of_a_number_are_uncertain(value, error, text):
    assert known_digits(value, error) == text
    if error:
        assert (
            abs(float(text) - value) <= 0.051 * error
        )  # half a unit in the second digit of the error, at most 1/20 of it


def test_info_of_a_guessed_geometry(call):
    code, out, _ = call("info", "SMILES:C=O", "--json", "a.json")
    assert code == 0
    (row,) = (line for line in out.splitlines() if re.match(r"A +\d", line))
    assert row.split() == ["A", "288700", "about", "3500", "9.63"]
    content = json.loads(Path("a.json").read_text(encoding="utf-8"))
    assert content["estimated_errors_mhz"]["A"] == pytest.approx(0.012 * content["constants_mhz"]["A"], rel=1e-12)
    assert content["uncertainties_mhz"] == {}
    assert "A 288700, B 37720, C 33360 MHz (good to about 1.2 %)" in call("levels", "SMILES:C=O", "--jmax", "1")[1]


def test_a_guessed_top_shows_the_digits_that_are_known():
    top = rotor.read("SMILES:C=O")
    text = "Top(C=O, CH2O, asymmetric: A 288700, B 37720, C 33360 MHz (Ir); dipole"
    assert repr(top).startswith(text), repr(top)
    assert re.search(r"dipole -?\d\.?\d?, 0, 0 D \(estimated\)\)$", repr(top)), repr(top)
    assert "<td>A</td><td>288700</td><td>about 3500</td>" in top._repr_html_()
    assert "<td>B</td><td>6081.492114</td>" in rotor.Top.from_constants("B=6081.492114 MHz")._repr_html_()


def test_isotopologues_have_the_error_of_scaling(call):
    """0.02 % where heavy atoms were replaced, 0.8 % where hydrogen was; nothing for the molecule itself."""
    out = call("isotopologues", "water")[1]
    rows = {line.split()[0]: line.split() for line in out.splitlines()[2:] if line.strip()}
    assert rows["H2O"][6] == "835852.406"
    heavy, light = rows["H2[18O]"], rows["H[2H]O"]
    assert (heavy[7], heavy[10]) == ("825440", "0.02")
    assert (light[7], light[10]) == ("705900", "0.8")
    top = rotor.read("water", isotopes="O=18O")
    assert top.estimated_errors_mhz["B"] == pytest.approx(2e-4 * top.constants["B"], rel=1e-12)
    assert rotor.read("water").estimated_errors_mhz == {}
    words = call("info", "water", "--isotope", "2=2H")[1].split()
    assert "errors of rotational constants: data 5.6 GHz (scaling from another isotopologue)" in " ".join(words)


def test_measured_constants_keep_their_digits(call):
    out = call("info", "CH3CN")[1]
    assert re.search(r"\nB +9198\.899134\d* ", out)
    assert "about" not in out.split("constant ")[1].split("axis")[0]
