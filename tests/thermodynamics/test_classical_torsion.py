"""A classical gas over the barrier of an internal rotation: passages, equipartition and conserved quantities."""

import csv
import json

import numpy as np
import pytest
from scipy.integrate import quad

import rotor
from rotor import units
from rotor.formats import read
from rotor.thermodynamics.torsion import classical_torsion as classical_torsion_module
from rotor.thermodynamics.torsion.classical_torsion import ENERGY_PER_K, classical_torsion, passage_rate, turning_top
from rotor.thermodynamics.torsion.request import TorsionRequest, answer_torsion


@pytest.fixture(scope="module")
def ethane():
    answer = answer_torsion(TorsionRequest(read("C2H6"), "1-2", "V3=1013 cm-1", vmax=0))
    return turning_top(answer.rotation, answer.torsion.potential)


def test_the_body_is_that_of_the_quantum_mechanics(ethane):
    answer = answer_torsion(TorsionRequest(read("C2H6"), "1-2", "V3=1013 cm-1", vmax=0))
    assert ethane.reduced_moment == pytest.approx(answer.facts()["reduced_moment_u_angstrom2"], rel=1e-9)
    barrier = ethane.potential(np.pi / 3) / ENERGY_PER_K * units.MHZ_PER_K / units.MHZ_PER_CM
    assert barrier == pytest.approx(1013, rel=1e-9)


def test_the_flux_is_that_of_transition_state_theory(ethane):
    """3 √(2kT/πI) exp(-V3/kT)/∮ exp(-V/kT) dα, the quadrature by scipy."""
    kt, v3 = ENERGY_PER_K * 500.0, float(ethane.potential(np.pi / 3))
    circle = quad(lambda x: np.exp(-0.5 * v3 * (1 - np.cos(3 * x)) / kt), 0, 2 * np.pi)[0]
    expected = 3 * np.sqrt(2 * kt / (np.pi * ethane.reduced_moment)) * np.exp(-v3 / kt) / circle
    assert passage_rate(ethane, kt) == pytest.approx(expected, rel=2e-5)  # maxima on a grid of 4096 angles


@pytest.mark.parametrize("temperature", [400.0, pytest.param(1500.0, marks=pytest.mark.slow)])
def test_passages_and_equipartition_of_a_gas(ethane, temperature):
    gas = classical_torsion(ethane, temperature, 4.0, 600, seed=3)
    assert abs(gas.rate.value - gas.expected_rate) < 4 * gas.rate.error
    assert gas.energy_error < 2e-3  # of kT: the step is of order 2
    assert gas.momentum_error < 1e-11  # rounding of some thousand steps
    for name, expected in (("torsion", 1.0), ("rotation", 1.0), ("potential", gas.expected_potential)):
        mean = gas.equipartition[name]
        assert abs(mean.value - expected) < 4 * mean.error, name
    assert abs(gas.expected_potential - 0.5) > 0.02  # V is not harmonic: equipartition does not hold for it


def test_a_gas_that_is_not_in_equilibrium_is_seen(ethane):
    """The same test fails for momenta of another temperature."""
    gas = classical_torsion(ethane, 1500.0, 1.0, 600, seed=3)
    assert abs(gas.equipartition["torsion"].value - 400 / 1500) > 4 * gas.equipartition["torsion"].error


def test_errors_of_passages(ethane, monkeypatch):
    """Tunnelling from the harmonic quantum of the well, whose curvature is that of the maximum; the step by half of it."""
    gas = classical_torsion(ethane, 800.0, 1.0, 200, seed=4)
    terms = gas.errors.terms
    facts = answer_torsion(TorsionRequest(read("C2H6"), "1-2", "V3=1013 cm-1", vmax=0)).facts()
    quantum = facts["wells"][0]["harmonic_cm"] * units.MHZ_PER_CM / (800.0 * units.MHZ_PER_K)  # ħω/kT
    assert terms["model"].value == pytest.approx(gas.expected_rate * quantum**2 / 24, rel=1e-4)
    assert terms["statistics"].value == gas.rate.error
    assert 0 < terms["truncation"].value < 0.1 * gas.expected_rate
    monkeypatch.setattr(classical_torsion_module, "STEP", classical_torsion_module.STEP / 2)
    finer = classical_torsion(ethane, 800.0, 1.0, 200, seed=4)
    assert finer.errors.terms["truncation"].value < 0.5 * terms["truncation"].value  # the step is of order 2
    assert abs(finer.rate.value - gas.rate.value) <= terms["truncation"].value


def test_the_command_prints_and_writes_the_gas(call):
    options = (
        "torsion",
        "C2H6",
        "--bond",
        "1-2",
        "--potential",
        "V3=1013 cm-1",
        "--classical",
        "800K",
        "--duration",
        "1ps",
    )
    code, out, err = call(*options, "--molecules", "100", "--classical-csv", "gas.csv")
    assert code == 0, err
    assert "by the equilibrium flux" in out
    errors = [line for line in out.splitlines() if line.startswith("errors")]
    assert len(errors) == 2
    assert "of passages: statistics" in errors[0]
    assert "of torsional levels: " in errors[1]
    with open("gas.csv", encoding="utf-8") as handle:
        rows = list(csv.DictReader(handle))
    assert [float(rows[i]["time_ps"]) for i in (0, -1)] == [0.0, 1.0]
    code, out, err = call(*options, "--molecules", "100", "--json", "-")
    assert code == 0, err
    gas = json.loads(out)["classical"]
    assert gas["passages_per_ps"] == pytest.approx(float(rows[-1]["passages"]))


def test_a_part_whose_turning_changes_the_moments_is_refused(call):
    code, _, err = call("torsion", "SMILES:OO", "--bond", "1-2", "--potential", "V1=100 cm-1", "--classical", "300K")
    assert code == 2
    assert "threefold" in err


def test_a_file_of_the_gas_needs_its_temperature(call):
    code, _, err = call("torsion", "C2H6", "--bond", "1-2", "--potential", "V3=1013 cm-1", "--classical-csv", "gas.csv")
    assert code == 2
    assert "--classical" in err


def test_the_function_has_the_gas():
    result = rotor.torsion(
        "C2H6", bond="1-2", potential="V3=1013 cm-1", vmax=0, classical_k=700.0, duration_ps=0.5, molecules=50
    )
    assert result.answer.classical.molecules == 50
