"""`rotor torsion`: what docs/verbs/torsion.md promises."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from places import ORACLES

import rotor
from rotor.formats import read
from rotor.reports.screen import plain, table_records
from rotor.thermodynamics.torsion.request import TorsionRequest, answer_torsion

ETHANE = ("torsion", "C2H6", "--bond", "1-2", "--potential", "V3=1013 cm-1")


def test_the_command_gives_what_python_gives(call):
    code, out, err = call(*ETHANE, "--vmax", "1", "--temperature", "100,300 K", "--json", "-")
    assert code == 0, err
    command = json.loads(out)
    answer = answer_torsion(TorsionRequest(read("C2H6"), "1-2", "V3=1013 cm-1", vmax=1, temperatures_k=(100.0, 300.0)))
    facts = {**answer.facts(), "levels": table_records(answer.levels), "functions": table_records(answer.functions)}
    for key, value in plain(facts).items():
        assert command[key] == value, key
    assert command["levels"][1]["degeneracy"] == 2
    assert len(command["functions"]) == 12  # six methods, two temperatures


def test_files_and_report(call):
    code, out, _ = call(*ETHANE, "--csv", "levels.csv", "--thermo-csv", "heat.csv", "--plot", "ethane.png")
    assert code == 0
    assert "reduced moment  1.5696 u Å²" in out
    assert "barrier         1013 cm⁻¹" in out
    with open("levels.csv", encoding="utf-8") as handle:
        levels = list(csv.DictReader(handle))
    assert [row["species"] for row in levels[:3]] == ["0", "1", "0"]
    with open("heat.csv", encoding="utf-8") as handle:
        heat = list(csv.DictReader(handle))
    assert {row["method"] for row in heat} == {"levels", "free rotor", "harmonic", "classical", "Pitzer-Gwinn", "tanh"}
    assert Path("ethane.png").stat().st_size > 20000


def test_the_function_of_that_name():
    result = rotor.torsion("C2H6", bond="1-2", potential="V3=1013 cm-1", vmax=0)
    assert result.table.energy_cm.round(2).tolist() == [150.15, 150.15]
    assert result.errors.truncation.value < 1e-3  # MHz


def test_a_scene_says_the_same(call):
    _, out, _ = call(*ETHANE, "--vmax", "1", "--save-scene", "s.toml", "--json", "-")
    code, again, err = call("run", "s.toml", "--json", "-")
    assert code == 0, err
    assert json.loads(again)["levels"] == json.loads(out)["levels"]
    code, plan, err = call("plan", "s.toml")
    assert code == 0, err
    assert "exp(imα)" in plan


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (("C3H8",), "error: --bond: none is named; give two atom numbers, such as 1-2; groups turn about 1-2 (C-C), 1-3 (C-C)"),
        (("water",), "error: --bond: none is named; give two atom numbers, such as 1-2; nothing turns about any bond of this molecule"),
        (("C2H6", "--bond", "3-6"), "error: --bond: atoms 3 (H) and 6 (H) are not bonded"),
        (("C2H6", "--bond", "1-3"), "error: --bond: atoms 1 (C) and 3 (H): atom 3 (H) is bonded to no other atom"),
        (("SMILES:C1CC1", "--bond", "1-2"), "error: --bond: atoms 1 (C) and 2 (C): the bond is part of a ring"),
        (("C2H6", "--bond", "1-2", "--potential", "V2=3"), "error: --potential: V2: the bond has 3 equal positions in a turn"),
        (("C2H6", "--bond", "1-2", "--potential", "nothing"), "error: --potential: calculator 'nothing' is unknown to ASE"),
        (("C2H6", "--bond", "1-2", "--vmax", "-1"), "error: --vmax: -1: expected a whole number"),
        (("C2H6", "--bond", "1-2", "--points", "3"), "error: --points: 3: expected a whole number from 6"),
        (("C2H6", "--bond", "1-2", "--temperature", "0"), "error: --temperature: '0': expected"),
    ],
)  # fmt: skip
def test_mistakes_are_one_line(call, words, error):
    code, out, err = call("torsion", *words, "--csv", "a.csv")
    assert (code, out) == (2, "")
    last = err.rstrip("\n").splitlines()[-1]
    assert last.startswith(error)
    assert not Path("a.csv").exists()


def test_spin_weights_of_a_turning_group_are_not_called_missing(call):
    code, out, _ = call("spectrum", str(ORACLES / "ch3cho_ram.toml"), "--jmax", "2", "--temperature", "5", "--q", "100")
    assert code == 0
    assert "by torsional species, from the nuclei of the turning groups" in out
    assert "not given" not in out


@pytest.mark.parametrize(
    ("potential", "cm"), [("V3=1 kcal/mol", 349.7551), ("V3=4.184 kJ/mol", 349.7551), ("V3=10 meV", 80.65544)]
)
def test_a_barrier_in_units_of_chemistry(call, potential, cm):
    """1 kcal/mol = 4.184 kJ/mol; NIST's table of conversion factors has 1 kJ/mol = 83.593 cm-1. Refused before."""
    code, out, _ = call("torsion", "CH3OH", "--bond", "1-2", "--potential", potential, "--json", "-")
    assert code == 0
    assert json.loads(out)["barrier_cm"] == pytest.approx(cm, rel=1e-6)


def test_moments_of_the_geometry_and_over_a_turn(call):
    """0.6348, and 0.6350 to 0.6356 over a turn: the second is the mean of three positions, which the geometry has within 0.03 %."""
    _, out, _ = call("torsion", "CH3OH", "--bond", "1-2", "--potential", "V3=373 cm-1")
    assert "u Å² of the geometry; 0.635004 to 0.635623 over a turn of 3 equal positions" in " ".join(out.split())
    _, out, _ = call("torsion", "CH3OH", "--bond", "1-2")
    assert "over the relaxed scan" in " ".join(out.split())


def test_a_bond_without_symmetry_says_so(call):
    """1 equal positions in a turn."""
    _, out, _ = call("torsion", "SMILES:CCO", "--bond", "2-3", "--potential", "V1=0.1 V3=1 kcal/mol")
    assert "none: no two positions in a turn are equal" in out
    assert "1 equal positions" not in out


def test_a_minimum_just_below_a_turn_is_that_at_zero(call):
    """The relaxed scan of H2O2 has its minimum at 359.9999 degrees, which was printed as 360 and last."""
    code, out, err = call("torsion", "SMILES:OO", "--bond", "1-2")
    assert code == 0, err
    assert "minima          0° (0 cm⁻¹), 101" in out
