"""What a model leaves out: signs of each effect in a molecule, sizes that are estimated, order of the list."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy import constants

import rotor
from rotor.molecules.nuclei import isotope
from rotor.quantum.effects.hyperfine import NuclearQuadrupole
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.limits import VIBRATION_CM, model_limits, model_sizes, populated_j
from rotor.quantum.solve import solve_levels
from rotor.quantum.spins import Spin
from rotor.quantum.spins.splittings import GRADIENT_MHZ_PER_BARN
from rotor.units import MHZ_PER_CM


def limits(source: str, effects=SEMI_RIGID) -> dict[str, float | None]:
    top = rotor.read(source)
    return {limit.name: limit.size_mhz for limit in model_limits(top, populated_j(top, 300.0), effects)}


def test_the_unit_of_field_gradients():
    """eQV/h for Q = 1 barn and V = e/(4π ε0 a0³)."""
    bohr = constants.physical_constants["Bohr radius"][0]
    gradient = constants.e / (4 * constants.pi * constants.epsilon_0 * bohr**3)
    assert constants.e * 1e-28 * gradient / constants.h * 1e-6 == pytest.approx(
        GRADIENT_MHZ_PER_BARN, rel=1e-8
    )  # editions


@pytest.mark.parametrize(
    ("source", "name"),
    [
        ("CH3OH", "internal rotation"), ("CH3CHO", "internal rotation"), ("camphor", "internal rotation"),
        ("SMILES:CN", "inversion"), ("O2", "electron spin"), ("HCN", "nuclear quadrupole"),
        ("D2O", "nuclear quadrupole"), ("CH3Cl", "nuclear quadrupole"), ("SMILES:CO", "error of the geometry"),
        ("CH3OH", "centrifugal distortion"), ("water", "magnetic coupling of nuclear spins"),
    ],
)  # fmt: skip
def test_signs_of_what_is_left_out(source, name):
    assert name in limits(source)


@pytest.mark.parametrize(
    ("source", "name"),
    [
        ("CH3CN", "internal rotation"), ("CH3CCH", "internal rotation"), ("CH3F", "internal rotation"),
        ("PH3", "inversion"), ("HCONH2", "inversion"), ("water", "nuclear quadrupole"), ("CO", "electron spin"),
        ("CH3O", "internal rotation"),
        ("water", "centrifugal distortion"), ("CO", "magnetic coupling of nuclear spins"), ("H2CO", "error of the geometry"),
    ],
)  # fmt: skip
def test_no_false_signs(source, name):
    """Methyl on the axis of a symmetric top turns with it; formamide's nitrogen is flat; 12C16O has no spins."""
    assert name not in limits(source)


def test_an_effect_of_the_calculation_is_not_left_out():
    top, coupling = rotor.read("HCN"), NuclearQuadrupole({"chi_aa(14N)": -4.7}, (Spin("14N", 2),))
    effects = (*SEMI_RIGID, coupling)
    assert "nuclear quadrupole" not in limits("HCN", effects)
    sizes = {size.name: (size.size_mhz, size.present) for size in model_sizes(top, 8, effects)}
    assert sizes["nuclear quadrupole"] == (4.7, True)
    left_out = {size.name: size.present for size in model_sizes(top, 8, SEMI_RIGID)}
    assert left_out == {"rigid rotor": True, "centrifugal distortion": True, "nuclear quadrupole": False}


@pytest.mark.oracle
@pytest.mark.parametrize(
    ("case", "label", "quadrupole_barn"), [("hcn_quad", "14N", 0.02044), ("vinylcl35_quad", "35Cl", -0.0817)]
)
def test_estimated_couplings_are_of_the_right_order(shared, case, label, quadrupole_barn):
    """The reference inputs hold 1.5 χ_aa; the estimate has the order of χ_aa."""
    known = {one.label: one.quadrupole_barn for one in (isotope("N", 14), isotope("Cl", 35))}
    assert known[label] == pytest.approx(quadrupole_barn, rel=0.01)  # rounded here
    record = json.loads((shared / "reference" / "spcat" / case / "case.json").read_text(encoding="utf-8"))
    chi = next(one["value"] for one in record["parameters"] if one["label"].startswith("1.5")) / 1.5
    assert 0.1 < abs(quadrupole_barn) * GRADIENT_MHZ_PER_BARN / abs(chi) < 10  # an order of magnitude, as the text says


@pytest.mark.parametrize("source", ["CH3OH", "CH3CHO", "NO", "NH3"])
def test_largest_first_and_unknown_spin_before_all(source):
    found = list(limits(source).items())
    known = [size for _, size in found if size is not None]
    assert known == sorted(known, reverse=True)
    assert found[-1] == ("magnetic coupling of nuclear spins", None)
    assert ("electron spin" in dict(found)) == (source == "NO") == (found[0][1] is None)


def test_the_size_of_distortion_is_that_of_a_harmonic_diatomic_molecule():
    """Lines ν = 2B(J+1) - 4D(J+1)³ with D = 4B³/ω²."""
    b = 57_600.0
    top = rotor.Top.from_constants(f"B={b} MHz")
    d = 4 * b**3 / (VIBRATION_CM * MHZ_PER_CM) ** 2
    real = rotor.Top.from_constants(f"B={b} D={d} MHz")
    moved = solve_levels(top, 8).energy_mhz - solve_levels(real, 8).energy_mhz
    limit = {one.name: one.size_mhz for one in model_limits(top, 7, SEMI_RIGID)}["centrifugal distortion"]
    assert limit == pytest.approx(moved[8] - moved[7], rel=1e-9)  # differences of large numbers


def test_the_most_populated_j():
    """The largest of (2J+1)^2 exp(-E/kT) summed by hand over the levels of a spherical top."""
    top = rotor.Top.from_constants("A=10 B=10 C=10 GHz")
    levels = solve_levels(top, 80)
    population = levels.degeneracy * np.exp(-levels.energy_mhz / (300.0 * 20836.619))
    assert (
        abs(populated_j(top, 300.0) - int(levels.quanta["j"][population.argmax()])) <= 1
    )  # rounding of a flat maximum


@pytest.mark.parametrize("verb", ["info", "spectrum", "levels", "raman"])
def test_reports_end_with_the_limits(call, verb):
    given = ("HCN", "--polarizability", "3,2") if verb == "raman" else ("HCN",)
    code, out, _ = call(verb, *given)
    assert code == 0
    last = out.rstrip().splitlines()[-3:]
    assert last[0].startswith("effects   at J = ")
    assert last[1].startswith("left out  nuclear quadrupole: about 4 MHz; 14N splits J = 1 by 3.53 MHz: rotor")
    assert "magnetic coupling" in last[2]
    printed = json.loads(call(verb, *given, "--json", "-")[1])
    assert [one["name"] for one in printed["limits"]] == ["nuclear quadrupole", "magnetic coupling of nuclear spins"]
    assert {one["name"]: one["present"] for one in printed["effects"]}["nuclear quadrupole"] is False


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (("raman", "CO2", "--jmax", "4"), "nothing that the molecule shows signs of"),
        (("thermo", "HCN", "--temperature", "10"), "nuclear quadrupole: about 4 MHz"),
        (("stark", "HCN", "--field", "0,1", "--states", "0"), "nuclear quadrupole: about 4 MHz"),
        (
            ("align", "CO2", "--pulse", "1e12 W/cm2, 50 fs", "--until", "1ps"),
            "nothing that the molecule shows signs of",
        ),
        (
            ("gas", "CO2", "--molecules", "50"),
            "collisions; vibrations; quantum mechanics: the heat capacity is classical",
        ),
        (("spectrum", "--constants", "B=9 D=1e-6 GHz", "--dipole-abc", "1,0,0", "--jmax", "2"), "of constants alone"),
    ],
)
def test_every_report_says_what_is_left_out(call, command, said):
    code, out, _ = call(*command)
    assert code == 0
    assert f"\nleft out  {said}" in out
    printed = json.loads(call(*command, "--json", "-")[1])
    assert "left_out" in printed if command[0] == "gas" else printed["effects"]
