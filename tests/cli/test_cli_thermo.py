"""`rotor thermo` keeps its contract: docs/verbs/thermo.md."""

import csv
import json
import math
import re
import time
from pathlib import Path

import numpy as np
import pytest
from places import PROJECT

import rotor
from rotor.thermodynamics import functions
from rotor.thermodynamics.functions import GAS_CONSTANT, thermodynamic_functions
from rotor.thermodynamics.sums.partition import partition_function
from rotor.thermodynamics.vibration import VibrationalStates

CONTRACT = PROJECT / "docs" / "verbs" / "thermo.md"
COLUMNS = [
    "temperature_k", "q_rot", "q_rot_classical", "q_rot_corrected", "energy_j_per_mol", "entropy_j_per_mol_k", "cv_over_r",
    "cv_over_r_classical", "cv_over_r_corrected",
]  # fmt: skip
VIBRATION_KEYS = ["q_vib", "cv_vib_over_r"]
GAS_KEYS = ["gas_cp_j_per_mol_k", "gas_entropy_j_per_mol_k", "gas_enthalpy_j_per_mol", "gas_gibbs_j_per_mol_k"]
KEYS = {
    "rotational_temperatures_k", "classical_above_k", "classical_tolerance", "classical_corrections", "species",
    "species_known", "fractions", "symmetry_number_counted", "hyperfine", "spin_factor", "jmax", "relative_error", "refused",
    "vibrations",
    "pressure_bar", "electronic", "functions", "files", "errors",
}  # fmt: skip


def rows_of(path):
    with open(path, newline="") as handle:
        return list(csv.DictReader(handle))


def test_the_grid_of_the_contract(call, folder):
    code, out, err = call(
        "thermo", "water", "--temperature", "10:1000K:100", "--csv", "w.csv", "--plot", "w.png", "--json", "w.json"
    )
    assert (code, err) == (0, "")
    rows = rows_of("w.csv")
    assert list(rows[0]) == COLUMNS
    assert [float(row["temperature_k"]) for row in rows] == np.linspace(10, 1000, 100).tolist()
    functions = thermodynamic_functions(rotor.read("water"), np.linspace(10, 1000, 100))
    assert [float(row["cv_over_r"]) for row in rows] == functions.cv_over_r.tolist()  # full precision
    assert rows[0]["cv_over_r_corrected"] == ""
    assert float(rows[-1]["cv_over_r_classical"]) == 1.5
    assert (folder / "w.png").read_bytes().startswith(b"\x89PNG")
    content = json.loads((folder / "w.json").read_text(encoding="utf-8"))
    assert content["functions"][0]["q_rot_corrected"] is None
    assert content["functions"][99]["q_rot"] == functions.q_rot[99]
    assert content["files"] == ["w.csv", "w.png", "w.json"]
    provenance = json.loads((folder / "w.csv.provenance.json").read_text(encoding="utf-8"))
    assert provenance["species"] == "equilibrium"
    assert provenance["rows"] == 100
    assert "25 of 100 temperatures" in out
    assert "Θ_rot         A 40.1146, B 20.8894, C 13.3521 K" in out
    assert "Θ_rot         B 85.3692 K" in call("thermo", "H2")[1].splitlines()


def test_json_has_the_keys_of_the_contract(call):
    code, out, err = call("thermo", "H2", "--species", "normal", "--temperature", "20,300", "--json", "-")
    assert (code, err) == (0, "")
    content = json.loads(out)
    info = set(json.loads(call("info", "H2", "--json", "-")[1])) - {"partition_function"}
    assert set(content) == info | KEYS
    assert content["species_known"] == ["equilibrium", "normal", "para", "ortho"]
    assert content["fractions"] == {"para": 0.25, "ortho": 0.75}
    assert content["spin_factor"] == pytest.approx(4, rel=1e-12)  # round-off
    assert content["rotational_temperatures_k"][0] is None
    assert content["classical_corrections"]["a_k"] == pytest.approx(
        content["rotational_temperatures_k"][1] / 3, rel=1e-12
    )
    assert list(content["functions"][0]) == COLUMNS
    text = CONTRACT.read_text(encoding="utf-8")
    assert all(f"`{name}`" in text for name in [*KEYS, *COLUMNS, *VIBRATION_KEYS, *GAS_KEYS])


def test_q_is_that_of_info(call):
    code, out, _ = call("thermo", "NH3", "--temperature", "50,300", "--json", "-")
    assert code == 0
    for row in json.loads(out)["functions"]:
        q = partition_function(rotor.read("NH3"), row["temperature_k"], 1e-10).q
        assert row["q_rot"] == pytest.approx(q, rel=1e-6)  # truncation
        assert row["entropy_j_per_mol_k"] == pytest.approx(
            GAS_CONSTANT * math.log(q) + row["energy_j_per_mol"] / row["temperature_k"], rel=1e-6
        )


def test_gas_functions_of_water(call):
    """JANAF at 298.15 K: Cp 33.590, S 188.834, H - H(0) 9904; -(G-H(Tr))/T is S there (Chase 1998)."""
    words = ("--temperature", "298.15", "--gas", "--vibration", "1594.75,3657.05,3755.93")
    code, out, _ = call("thermo", "water", *words, "--json", "-")
    assert code == 0
    content = json.loads(out)
    row = content["functions"][0]
    assert list(row) == COLUMNS + VIBRATION_KEYS + GAS_KEYS
    assert row["gas_cp_j_per_mol_k"] == pytest.approx(33.590, abs=0.01)  # the bending state's own rotation
    assert row["gas_entropy_j_per_mol_k"] == pytest.approx(188.834, abs=0.005)  # natural mass makes 0.003
    assert row["gas_enthalpy_j_per_mol"] == pytest.approx(9904, abs=1)
    assert content["pressure_bar"] == 1.0
    assert content["vibrations"].startswith("fundamentals")
    _, out, _ = call("thermo", "water", *words, "--pressure", "10mbar")
    assert "ideal gas at 0.01 bar" in out
    assert "R ln 4 of nuclear spin left out" in out
    entropy = float(re.search(r"^298\.15 +[\d.]+ +([\d.]+) +9904\.\d+ ", out, re.MULTILINE)[1])
    assert entropy == pytest.approx(row["gas_entropy_j_per_mol_k"] + GAS_CONSTANT * math.log(100), abs=1e-3)  # printed


def test_vibration_without_gas(call):
    code, out, _ = call("thermo", "CO2", "--temperature", "300", "--vibrational-states", "667.4x2", "--json", "-")
    assert code == 0
    row = json.loads(out)["functions"][0]
    assert list(row) == COLUMNS + VIBRATION_KEYS
    assert row["q_vib"] == pytest.approx(VibrationalStates((667.4,), (2,)).factor(300.0), rel=1e-12)


@pytest.mark.parametrize("verb", ["thermo", "spectrum", "raman"])
def test_fundamentals_are_counted_against_the_degrees_of_freedom(call, verb):
    """3N - 5 = 4 of OCS: bending once instead of twice is noted, five are refused, and four pass in silence."""
    for given, code, words in (
        ("520,859,2062", 0, "3 given, but COS has 3N - 5 = 4"),
        ("520x3,859,2062", 2, "5 given"),
    ):
        returned, _, err = call(verb, "OCS", "--temperature", "300", "--vibration", given)
        assert (returned, words in err) == (code, True)
    _, _, err = call(verb, "OCS", "--temperature", "300", "--vibration", "520x2,859,2062")
    assert "fundamentals" not in err


def test_parquet_and_csv_have_the_same_numbers(call, folder):
    import polars as pl

    code, _, _ = call("thermo", "CH4", "--species", "E", "--csv", "m.csv", "--parquet", "m.parquet", "--gas")
    assert code == 0
    table = pl.read_parquet("m.parquet")
    rows = rows_of("m.csv")
    assert table.columns == list(rows[0]) == COLUMNS + GAS_KEYS
    for name in table.columns:
        assert [x if x is None else float(x) for x in table[name]] == [
            float(r[name]) if r[name] else None for r in rows
        ]
    assert len(rows) == 16
    assert float(rows[0]["temperature_k"]) == 5.0


def test_no_other_format(folder):
    functions = thermodynamic_functions(rotor.read("CO"), [10.0])
    with pytest.raises(ValueError, match=r"ThermoFunctions can be written as \.csv, \.parquet or \.json"):
        rotor.write(functions, "co.cat")
    assert list(folder.iterdir()) == []


def test_constants_alone(call):
    code, out, _ = call("thermo", "--constants", "B=60.853 cm-1", "--spin-weights", "even=1,odd=3", "--species", "para")
    assert code == 0
    assert "also available: equilibrium, normal, ortho" in re.sub(r"\s+", " ", out)


def test_one_temperature_is_drawn_too(call, folder):
    code, _, _ = call("thermo", "CO", "--temperature", "30", "--plot", "co.svg")
    assert code == 0
    assert "<svg" in (folder / "co.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("CO", "--species", "ortho"), "error: --species: 'ortho': carbon monoxide has equilibrium; its levels are all"),
        (("CH4", "--species", "ortho"), "error: --species: 'ortho': methane has equilibrium, normal, A, E, F\n"),
        (("water", "--temperature", "0,10"), "error: --temperature: '0,10': expected a finite number above 0 K\n"),
        (("water", "--temperature", "warm"), "error: --temperature: 'warm' is not a number"),
        (("water", "--gas", "--pressure", "0"), "error: --pressure: 0: expected a finite number above 0 bar\n"),
        (("--constants", "B=1 cm-1", "--gas"), "error: the ideal gas needs the mass, which bare constants do not have; give a molecule\n"),
        (("water", "--csv", "w.txt"), "error: --csv w.txt: the name must end in .csv\n"),
        (("water", "--vibration", "1", "--vibrational-states", "2"), "error: --vibration and --vibrational-states: give one"),
        ((), "error: expected either a source or --constants, and neither is; give one of them"),
    ],
)  # fmt: skip
def test_wrong_input_is_one_line(call, folder, arguments, said):
    code, out, err = call("thermo", *arguments, "--json", "x.json")
    assert code == 2
    assert err.startswith(said)
    assert err.count("\n") == 1
    assert (out, list(folder.iterdir())) == ("", [])


def test_beyond_the_reach_of_the_constants_there_is_no_answer(call, folder):
    code, out, err = call("thermo", "water", "--temperature", "4000,5000", "--csv", "w.csv")
    assert code == 1
    assert err.startswith("error: Q(4000 K): populated levels lie beyond the reach of the distortion constants")
    assert (out, err.count("\n"), list(folder.iterdir())) == ("", 1, [])


def test_temperatures_beyond_the_reach_leave_the_others(call, folder):
    """The row of a refused temperature is empty in files, and its reason is in a note; the other rows are as without it."""
    code, out, err = call("thermo", "water", "--temperature", "10,3000,300,4000K", "--csv", "w.csv", "--json", "w.json")
    assert (code, err.count("\n")) == (0, 1)
    assert err.startswith("note: Q(3000 K): populated levels lie beyond the reach of the distortion constants")
    assert err.endswith("; nor is there a sum at 1 other temperature up to 4000 K\n")
    assert "worst at 300 K" in out
    content = json.loads((folder / "w.json").read_text())
    assert [refused["temperature_k"] for refused in content["refused"]] == [3000.0, 4000.0]
    assert all("beyond the reach" in refused["reason"] for refused in content["refused"])
    rows = content["functions"]
    assert [row["temperature_k"] for row in rows] == [10.0, 3000.0, 300.0, 4000.0]
    assert {value for row in rows[1::2] for name, value in row.items() if name != "temperature_k"} == {None}
    assert (folder / "w.csv").read_text().splitlines()[2] == "3000.0,,,,,,,,"
    call("thermo", "water", "--temperature", "10,300", "--json", "alone.json")
    alone = json.loads((folder / "alone.json").read_text())
    assert alone["refused"] == []
    for row, expected in zip(rows[::2], alone["functions"], strict=True):
        numbers = {name: value for name, value in expected.items() if value is not None}
        assert [name for name, value in row.items() if value is not None] == list(numbers)
        assert {name: row[name] for name in numbers} == pytest.approx(numbers, rel=1e-12)  # sums in another order


@pytest.mark.parametrize("species", ["equilibrium", "normal"])
def test_levels_are_summed_once_though_a_temperature_is_refused(species, monkeypatch):
    calls, level_sums = [], functions.level_sums

    def counted(*arguments, **settings):
        calls.append(arguments)
        return level_sums(*arguments, **settings)

    monkeypatch.setattr(functions, "level_sums", counted)
    answer = rotor.thermo("water", temperatures_k=[10, 3000, 300, 4000], species=species, pressure_bar=1.0).answer
    assert len(calls) == 1
    assert sorted(answer.refused) == [3000.0, 4000.0]
    alone = rotor.thermo("water", temperatures_k=[10, 300], species=species, pressure_bar=1.0).answer.functions
    for name, column in answer.functions.columns.items():
        assert np.allclose(column, alone.columns[name], rtol=1e-12, atol=0.0, equal_nan=True), name
    assert (answer.functions.jmax == alone.jmax).all()


def test_a_temperature_far_too_high_is_refused_soon(call, folder):
    """Most of the sum would come from levels that are not trusted: no need to go on to J = 1000."""
    start = time.perf_counter()
    code, out, err = call("thermo", "water", "--temperature", "1e6")
    assert time.perf_counter() - start < 20  # 1 s
    assert code == 1
    assert err.startswith("error: Q(1e+06 K): populated levels lie beyond the reach")
    assert (out, err.count("\n")) == ("", 1)


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="a folder where no user can make a file: /proc of Linux")
def test_a_folder_that_takes_no_file_is_named_with_its_option(call, folder):
    code, out, err = call("thermo", "water", "--temperature", "100", "--csv", "/proc/w.csv")
    assert (code, out) == (2, "")
    assert err.startswith("error: --csv /proc/w.csv: cannot write in /proc: ")


def test_help_has_examples(call):
    code, out, _ = call("thermo", "--help")
    assert code == 0
    assert "rotor thermo H2 --species ortho" in out
