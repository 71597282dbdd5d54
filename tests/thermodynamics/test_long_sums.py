"""Sums over levels of absurd constants: one of A, B, C orders of magnitude from the others, cut files, mistyped units."""

import json
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import rotor
from rotor.cli import declaration
from rotor.quantum.solve import solve_levels
from rotor.quantum.wang import wang_matrix
from rotor.quantum.wang.rotation import hamiltonian
from rotor.quantum.wang.wang_matrix import block_bands, diagonalise_all, lowest_energies
from rotor.thermodynamics.request import ThermoRequest, answer_thermo
from rotor.thermodynamics.sums.classical_onset import classical_above_k
from rotor.thermodynamics.sums.level_sums import level_sums
from rotor.thermodynamics.sums.partition import partition_function
from rotor.thermodynamics.sums.partition_table import partition_table
from rotor.tops.top import Top

sums_module = import_module("rotor.thermodynamics.sums.level_sums")
table_module = import_module("rotor.thermodynamics.sums.partition_table")

CUT_SHORT = "A=60778.5498 B=10318.0735 C=8.7997 MHz"  # C of SO2 read from a file that ends in the middle of the number


def of(constants: str) -> Top:
    return Top.from_constants(constants)


def one_block(constants: str, j: int) -> list[np.ndarray]:
    top = of(constants)
    return next(block_bands(hamiltonian(top), [solve_levels(top, j, jmin=j).blocks[0].basis]))


@pytest.mark.parametrize("constants", [CUT_SHORT, "A=1e9 B=10 C=9 MHz", "A=8572 B=3640 C=2790 MHz"])
def test_energies_up_to_a_bound_are_those_of_the_whole_block(constants, monkeypatch):
    monkeypatch.setattr(wang_matrix, "SMALL", 10)
    bands = one_block(constants, 120)
    whole = diagonalise_all([bands], vectors=False)[0][0]
    for place in (0, 1, 3, 40):
        below = 0.5 * (whole[place] + whole[place + 1])
        computed = lowest_energies(bands, below)
        assert len(computed) >= place + 1
        assert (
            np.abs(computed - whole[: len(computed)]).max() < 1e-13 * np.abs(whole).max()
        )  # both to round-off of the largest
    assert len(lowest_energies(bands, whole[0] - 1e-3 * np.abs(whole).max())) in (0, len(whole))


def test_levels_left_out_of_a_sum_do_not_count(monkeypatch):
    """The same Q, U and C_v with every level, where most are left out: e^-80 of what was taken is no more than 1e-26."""
    top, temperatures = of("A=60778 B=10318 C=300 MHz"), [2.0, 10.0]
    monkeypatch.setattr(wang_matrix, "SMALL", 8)
    few = level_sums(top, [top.spin_weights], temperatures, 1e-9)[0]
    monkeypatch.setattr(sums_module, "HIGHEST_KT", 1e9)
    complete = level_sums(top, [top.spin_weights], temperatures, 1e-9)[0]
    assert few.jmax.tolist() == complete.jmax.tolist()
    for name in ("q", "energy_over_rt", "cv_over_r"):
        assert getattr(few, name) == pytest.approx(getattr(complete, name), rel=1e-12)  # round-off of energies over kT


def test_a_table_of_q_sums_once_where_one_temperature_is_out_of_reach(monkeypatch):
    monkeypatch.setattr(sums_module, "MOST_J", {"asymmetric": 40})
    monkeypatch.setattr(table_module, "_row_alone", None)  # none by itself
    top = of(CUT_SHORT)
    rows = partition_table(top, [0.5, 30.0, 1.0])
    assert [row["q"] is None for row in rows] == [False, True, False]
    assert rows[1]["source"].startswith("Q(30 K): populated levels lie beyond the reach")
    assert rows[1]["jmax"] is rows[1]["relative_error"] is None
    assert rows[1]["classical"] > 1000
    alone = partition_function(top, [0.5, 1.0])
    assert [rows[0]["q"], rows[2]["q"]] == pytest.approx(alone.q.tolist(), rel=1e-14)  # the same sums
    with pytest.raises(ValueError, match=r"Q\(30 K\).*can be had up to 1 K"):
        partition_function(top, [0.5, 30.0, 1.0])


def test_an_onset_that_no_sum_reaches_is_said_and_not_an_error(monkeypatch):
    monkeypatch.setattr(sums_module, "MOST_J", {"asymmetric": 40})
    answer = answer_thermo(ThermoRequest(of(CUT_SHORT), (0.5,)))
    assert answer.classical_above_k is None
    assert answer.facts()["classical_above_k"] is None
    with pytest.raises(ValueError, match="beyond the reach"):
        classical_above_k(of(CUT_SHORT))


MIXED = ("--constants", "A=9400 B=3100 C=2500 MHz", "--state-constants")
TWO_STATES = "E[1]=60000 A[1]=9480 B[1]=3090 C[1]=2497 G_c[0,1]=450 MHz"


def test_sums_at_temperatures_that_nobody_typed_are_left_out_where_they_are_long(call, monkeypatch):
    """Of states that mix, at the temperatures of catalogues; a sum that --temperature asks for is made."""
    monkeypatch.setattr(sums_module, "QUICK_PRODUCTS", 1e7)

    def table(*words):
        return json.loads(call("info", *MIXED, TWO_STATES, *words, "--json", "-")[1])["partition_function"]

    rows = table()
    summed = {row["temperature_k"]: row["q"] for row in rows if row["q"] is not None}
    assert max(summed) == 18.75
    left_out = [row["source"] for row in rows if row["q"] is None]
    assert set(left_out) == {"a long sum over levels of states that mix; --temperature asks for it"}
    assert len(left_out) == len(rows) - 2
    assert table("--temperature", "18.75,37.5")[0]["q"] == pytest.approx(summed[18.75], rel=1e-9)
    assert table("--temperature", "37.5")[0]["q"] is not None
    plain = rotor.Top.from_constants(
        {"A": 9400.0, "B": 3100.0, "C": 2500.0, "E[1]": 6e4, "A[1]": 9480.0, "B[1]": 3090.0, "C[1]": 2497.0}
    )
    assert sums_module.is_quick(plain, 1000.0)  # states that nothing joins


TURNING = """constants = { A = 9200.0, B = 3000.0, C = 2310.0 }
[internal_rotation]
frame = "PAM"
F0 = 160000.0
delta = 0.6
V3 = 9e6
"""


def test_long_sums_over_levels_of_a_methyl_group_are_left_out(call, folder):
    """Q at 1000 K takes minutes there. Only temperatures that were typed are summed so far."""
    Path("top.toml").write_text(TURNING)
    code, shown, _ = call("info", "top.toml", "--json", "info.json")
    assert code == 0
    rows = json.loads(Path("info.json").read_text())["partition_function"]
    assert [row["temperature_k"] for row in rows if row["q"] is not None] == [9.375, 18.75, 37.5]
    assert {row["source"] for row in rows[3:]} == {
        "a long sum over levels of internal rotation; --temperature asks for it"
    }
    assert {row["classical"] for row in rows} == {None}  # that of the rigid top lacks the torsion
    assert "a long sum over levels of internal rotation" in shown
    assert declaration("info").small_blocks
