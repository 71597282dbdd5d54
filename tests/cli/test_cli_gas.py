"""`rotor gas` keeps its contract: docs/verbs/gas.md."""

from __future__ import annotations

import csv
import json
import math

import numpy as np
import pytest

import rotor
from rotor.classical.gas.correlations import linear_curves, short_time
from rotor.statistics.equipartition import Equipartition
from rotor.units import ASE_TIME_PS, CM_PER_EV, EV_PER_K

_KEYS = """
    temperature_k molecules seed confidence degrees_of_freedom tested_at_ps accepted p_value chi2 chi2_degrees chi2_p ks_p
    failing degrees vector_abc vector_source tensor_source short_time_per_ps2 c1_plateau correlation files
"""
KEYS = set(_KEYS.split())
_COLUMNS = """
    name molecules frames mean spread mean_spread effective sigma p_value ks_distance ks_p_value energy_cm expected_cm
"""
SMALL = ("--molecules", "3000")


def answer(call, *arguments: str) -> dict:
    code, out, err = call("gas", *arguments, "--json", "-")
    assert (code, err) == (0, "")
    return json.loads(out)


def test_the_contract_of_water(call):
    printed = answer(call, "water", "--molecules", "20000", "--temperature", "300", "--seed", "7")
    info = json.loads(call("info", "water", "--json", "-")[1])
    assert set(printed) == KEYS | {"left_out", "errors"} | set(info) - {
        "partition_function",
        "sizes_at_j",
        "effects",
        "limits",
        "splitting_nuclei",
    }
    assert printed["degrees_of_freedom"] == {"translation": 3, "rotation": 3, "total": 6, "gas": 120_000}
    assert printed["accepted"] is True
    assert [set(row) for row in printed["degrees"]] == [set(_COLUMNS.split())] * 6
    assert printed["correlation"] is None
    for row in printed["degrees"]:
        assert row["expected_cm"] == pytest.approx(0.5 * EV_PER_K * 300 * CM_PER_EV, rel=1e-12)
        assert row["energy_cm"] == pytest.approx(row["expected_cm"] * row["mean"], rel=1e-12)
        assert abs(row["mean"] - 1) < 4 * row["mean_spread"] == 4 * math.sqrt(2 / 20_000)  # 4 σ of a fixed seed


@pytest.mark.parametrize(("name", "degrees"), [("HCl", 5), ("CO2", 5), ("CH4", 6), ("NH3", 6), ("C6H6", 6)])
def test_other_molecules_have_their_degrees(call, name, degrees):
    printed = answer(call, name, *SMALL)
    assert printed["chi2_degrees"] == len(printed["degrees"]) == printed["degrees_of_freedom"]["total"] == degrees
    assert printed["accepted"] is True


def test_a_seed_is_a_gas(call):
    first, again, other = (answer(call, "water", *SMALL, "--seed", seed) for seed in ("7", "7", "8"))
    assert first["degrees"] == again["degrees"]
    assert first["degrees"] != other["degrees"]


def test_correlation_functions_in_the_file_and_in_json(call, folder):
    printed = answer(call, "OCS", *SMALL, "--times", "0:4ps:9", "--csv", "ocs.csv")
    with open(folder / "ocs.csv", newline="") as handle:
        rows = [{key: float(text) for key, text in row.items()} for row in csv.DictReader(handle)]
    assert rows == printed["correlation"]
    assert list(rows[0]) == ["t_ps", "c1", "c1_error", "c2", "c2_error"]
    assert [row["t_ps"] for row in rows] == np.linspace(0, 4, 9).tolist()
    ocs = rotor.read("OCS")
    kt, moment = EV_PER_K * 300, ocs.moments_u_angstrom2[1]
    closed = linear_curves(np.linspace(0, 4, 9) / ASE_TIME_PS, moment, kt)
    for row, c1, c2 in zip(rows[1:], closed[0][1:], closed[1][1:], strict=True):
        assert abs(row["c1"] - c1) < 4 * row["c1_error"]  # σ of a fixed seed
        assert abs(row["c2"] - c2) < 4 * row["c2_error"]
    start = short_time(ocs.moments_u_angstrom2, kt)
    assert printed["short_time_per_ps2"]["c1"] == pytest.approx(start.m2 / ASE_TIME_PS**2, rel=1e-12)
    assert printed["short_time_per_ps2"]["c2"] == pytest.approx(
        6 * kt / moment / ASE_TIME_PS**2, rel=1e-12
    )  # l(l + 1) kT/I
    assert printed["c1_plateau"] == 0.0
    assert printed["vector_source"] == "the dipole"
    provenance = json.loads((folder / "ocs.csv.provenance.json").read_text(encoding="utf-8"))
    assert provenance["molecules"] == 3000
    assert provenance["seed"] == 1


@pytest.mark.parametrize(
    ("name", "axis", "said"),
    [("CH4", 0, "axis a"), ("C6H6", 2, "axis c"), ("CO2", 0, "axis a"), ("NH3", 2, "the dipole")],
)
def test_what_the_functions_are_of_is_said(call, name, axis, said):
    printed = answer(call, name, *SMALL, "--times", "0,1")
    assert printed["vector_source"].startswith(said)
    assert np.abs(printed["vector_abc"]).tolist() == np.eye(3)[axis].tolist()


def test_constants_alone_and_times_chosen(call, folder):
    printed = answer(call, "--constants", "A=10 B=5 C=4 GHz", *SMALL, "--csv", "x.csv")
    assert [row["name"] for row in printed["degrees"]] == ["rotation a", "rotation b", "rotation c"]
    assert len(printed["correlation"]) == 101
    assert printed["correlation"][0]["c1"] == pytest.approx(1.0, abs=1e-12)  # nothing has moved
    assert abs(printed["correlation"][-1]["c1"] - printed["c1_plateau"]) < 0.1  # it has settled
    assert printed["tested_at_ps"] == printed["correlation"][-1]["t_ps"]


def test_the_report_of_a_gas_has_its_numbers(call):
    code, out, err = call("gas", "HCl", *SMALL, "--times", "0:1:101")
    assert (code, err) == (0, "")
    for words in (
        "a classical gas",
        "3 translations, 2 rotations",
        "equipartition accepted at 99 %",
        "rotation b",
        "c2_error",
    ):
        assert words in out
    assert "rotation a" not in out
    code, out, _ = call("gas", "--constants", "B=6 GHz", *SMALL)
    assert "translations are left out" in out


def test_a_rejected_gas_is_an_answer(call):
    """At a confidence of 1 % nearly every honest gas is rejected."""
    printed = answer(call, "water", *SMALL, "--confidence", "0.01")
    assert printed["accepted"] is False
    assert printed["confidence"] == 0.01


def test_the_picture_of_a_gas_is_written(call, folder):
    assert call("gas", "water", *SMALL, "--plot", "w.png", "--times", "0:2:21")[0] == 0
    assert call("gas", "water", *SMALL, "--plot", "w.svg")[0] == 0
    assert (folder / "w.png").stat().st_size > 20_000
    assert "Equipartition accepted" in (folder / "w.svg").read_text(encoding="utf-8")


def test_tables_of_the_test_itself(folder):
    from rotor.classical.gas.ensembles import thermal_ensemble
    from rotor.statistics.equipartition import equipartition

    gas = thermal_ensemble([0.6, 1.2, 1.8], 1.0, 100, rng=np.random.default_rng(1))
    test = equipartition(gas.kinetic, 1.0)
    assert isinstance(test, Equipartition)
    for suffix in ("csv", "parquet", "json"):
        rotor.write(test, folder / f"test.{suffix}")
    assert len(json.loads((folder / "test.json").read_text(encoding="utf-8"))["rows"]) == 3
    with pytest.raises(ValueError, match=r"\.csv, \.parquet or \.json"):
        rotor.write(test, folder / "test.txt")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("water", "--molecules", "1"), "--molecules: 1: expected a whole number from 2 to 10000000"),
        (("water", "--seed", "-1"), "--seed: -1: expected a whole number of 0 or more"),
        (("water", "--confidence", "1"), "--confidence: 1: expected a number between 0 and 1"),
        (("water", "--temperature", "0"), "--temperature: 0: expected a finite number above 0 K"),
        (("water", "--times", "5:1:3"), "--times: '5:1:3': the range must rise"),
        (("water", "--times", "0:1:200000"), "at most 100000 numbers"),
        (("water", "--plot", "x.txt"), "--plot x.txt: the name must end in .png or .pdf or .svg"),
        (("water", "--constants", "B=1"), "either a source or --constants"),
        ((), "either a source or --constants"),
    ],
)
def test_wrong_input_is_one_line(call, folder, arguments, said):
    code, out, err = call("gas", *arguments)
    assert (code, out) == (2, "")
    assert said in err
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert not list(folder.iterdir())


def test_an_atom_does_not_rotate(call, folder):
    (folder / "ar.xyz").write_text("1\n\nAr 0 0 0\n", encoding="utf-8")
    code, _, err = call("gas", "ar.xyz")
    assert code == 2
    assert "is a single atom" in err
