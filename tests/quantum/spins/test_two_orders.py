"""Spin-rotation constants whose two orders differ, C_ab and C_ba: names, files, the command line and a fit."""

from __future__ import annotations

import csv
import tomllib

import numpy as np
import pytest

import rotor
from rotor.cli import run
from rotor.fitting.top_constants import TopConstants
from rotor.molecules.nuclei import isotope
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.solve import solve_levels
from rotor.spectra.lines import line_list
from rotor.tops.isotopes.isotopic_spins import _Change, _turned_rotation
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.top import Top

RADICAL = """
name = "radical"
[constants]
A = 9400.0
B = 3100.0
C = 2500.0
[dipole]
a = 1.0
b = 0.7
c = 0.0
[spins.S]
spin = "1/2"
eps_aa = 300.0
eps_ab = { value = 145.0, uncertainty = 3.0 }
eps_ba = { value = 45.0, uncertainty = 4.0 }
"""


def energies(constants: SpinConstants) -> np.ndarray:
    top = Top.from_constants("A=9400 B=3100 C=2500", spin_constants=constants)
    return np.sort(solve_levels(top, 3, effects=effects_of(top, True)).energy_mhz)


def test_two_orders_become_mean_and_difference():
    constants = SpinConstants(
        {"C_ba(H)": 1.0, "C_ab(H)": 3.0, "C_ca_J(H)": 5.0}, {"H": 1}, uncertainties={"C_ab(H)": 0.3}
    )
    assert dict(constants.values) == {"C_ab(H)": 2.0, "C_ac_J(H)": 5.0, "C_ab-ba(H)": 1.0}
    assert not constants.uncertainties  # of the mean of two constants, of which one alone has an error
    level_energies = energies(SpinConstants({"C_ba(H)": 3000.0}, {"H": 1}))
    assert level_energies == pytest.approx(
        energies(SpinConstants({"C_ab(H)": 3000.0}, {"H": 1})), abs=1e-9
    )  # one stands for both
    apart = energies(SpinConstants({"C_ab(H)": 3000.0, "C_ba(H)": 0.0}, {"H": 1}))
    same = energies(SpinConstants({"C_ab(H)": 1500.0, "C_ab-ba(H)": 1500.0}, {"H": 1}))
    assert apart == pytest.approx(same, abs=1e-9)  # round-off of 1e5 MHz
    assert np.abs(apart - energies(SpinConstants({"C_ab(H)": 1500.0}, {"H": 1}))).max() > 10


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"chi_ab(D)": 1.0, "chi_ba(D)": 2.0}, "chi_ab(D) and chi_ba(D) are one constant"),
        ({"C_ab(D)": 1.0, "C_ba(D)": 2.0, "C_ab-ba(D)": 1.0}, "C_ab-ba(D) beside C_ab(D) and C_ba(D)"),
        (
            {"C_ba(D)": 1.0, "C_ab-ba(D)": 2.0},
            "C_ba(D) beside C_ab-ba(D): give C_ab(D) and C_ab-ba(D), or C_ab(D) and C_ba(D)",
        ),
    ],
)
def test_what_is_given_twice_is_refused(values, says):
    with pytest.raises(ValueError, match=says.replace("(", r"\(").replace(")", r"\)")):
        SpinConstants(values, {"D": 2})


def test_an_isotopologue_has_the_difference_too():
    change = _Change(isotope("1H"), isotope("1H"), np.eye(3), np.array([1.0, 2.0, 3.0]), np.array([2.0, 2.0, 3.0]))
    turned = _turned_rotation(
        {"C_ab": 2.0, "C_ab-ba": 1.0}, change, 1.0
    )  # C_ab 3 with I_b alike, C_ba 1 with I_a doubled
    assert turned == pytest.approx({"C_ab": 1.75, "C_ab-ba": 1.25})


@pytest.fixture
def radical(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "radical.toml").write_text(RADICAL)
    return tmp_path


def test_files_of_this_package_hold_it_and_spfits_do_not(radical, capsys):
    top = rotor.read("radical.toml")
    assert dict(top.spin_constants.values) == {"eps_aa(S)": 300.0, "eps_ab(S)": 95.0, "eps_ab-ba(S)": 50.0}
    assert top.spin_constants.uncertainties["eps_ab-ba(S)"] == pytest.approx(2.5)
    assert run(["convert", "radical.toml", "again.toml"]) == 0
    assert rotor.read("again.toml").spin_constants.values == top.spin_constants.values
    capsys.readouterr()
    assert run(["convert", "radical.toml", "radical.var"]) == 2
    assert "eps_ab-ba(S): no code of SPFIT" in capsys.readouterr().err
    assert not (radical / "radical.var").exists()


def test_the_command_line_takes_both_orders(capsys):
    command = [
        "levels",
        "--constants",
        "A=9400 B=3100 C=2500",
        "--hyperfine",
        "--jmax",
        "1",
        "--spins",
        "S=1/2",
        "--spin-constants",
    ]
    answers = []
    for text in ("eps_ab(S)=1450 eps_ba(S)=450", "eps_ab(S)=950 eps_ab-ba(S)=500", "eps_ab(S)=950"):
        assert run([*command, text]) == 0
        answers.append([line for line in capsys.readouterr().out.splitlines() if "eps_" not in line])
    assert answers[0] == answers[1] != answers[2]


def test_a_fit_finds_the_difference(radical):
    constants = TopConstants(rotor.read("radical.toml"), True)
    lines = line_list(constants.top, jmax=3, min_lgint=-9, q=1e5, range_mhz=(2e3, 1e5), effects=constants.effects)
    quanta = lines.levels.quanta
    with open("lines.csv", "w", newline="") as handle:
        writer = csv.writer(handle)
        heads = [f"{name}_{side}" for side in ("upper", "lower") for name in constants.quanta]
        writer.writerow([*heads, "frequency_mhz", "error_mhz"])
        for up, low, frequency in zip(lines.upper, lines.lower, lines.frequency_mhz, strict=True):
            labels = [int(quanta[name][row]) for row in (up, low) for name in constants.quanta]
            writer.writerow([*labels, round(float(frequency), 6), 1e-3])
    start = RADICAL.replace("145.0", "142.0").replace("45.0, unc", "44.0, unc")
    (radical / "start.toml").write_text(start)
    command = ["fit", "lines.csv", "--start", "start.toml", "--free", "A,B,C,eps_aa(S),eps_ab(S),eps_ab-ba(S)"]
    assert run([*command, "--out", "fitted"]) == 0
    computed = tomllib.loads((radical / "fitted.toml").read_text())["spins"]["S"]
    assert computed["eps_ab-ba"]["value"] == pytest.approx(50.0, abs=3 * computed["eps_ab-ba"]["uncertainty"])
    assert computed["eps_ab-ba"]["uncertainty"] < 1.0  # lines of 1 kHz decide it
