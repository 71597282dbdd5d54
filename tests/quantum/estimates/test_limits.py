"""What a model leaves out: signs of each effect in a molecule, sizes that are estimated, order of the list."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy import constants

import rotor
from rotor.molecules.nuclei import data_folder, isotope
from rotor.molecules.readers.read import read_molecule
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.effects.spin_effect import NuclearQuadrupole
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.limits import VIBRATION_CM, VIBRATION_POWER, model_limits, model_sizes
from rotor.quantum.estimates.splittings import GRADIENT_MHZ_PER_BARN, GRADIENTS, splitting_nuclei
from rotor.quantum.solve import solve_levels
from rotor.quantum.spins import Spin
from rotor.thermodynamics.sums.classical_limit import populated_j
from rotor.tops.top import Top
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
        ("D2O", "nuclear quadrupole"), ("CH3Cl", "nuclear quadrupole"), ("SMILES:CO", "vibration-rotation difference"),
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
        ("water", "centrifugal distortion"), ("CO", "magnetic coupling of nuclear spins"), ("H2CO", "vibration-rotation difference"),
    ],
)  # fmt: skip
def test_no_false_signs(source, name):
    """Methyl on the axis of a symmetric top turns with it; formamide's nitrogen is flat; 12C16O has no spins."""
    assert name not in limits(source)


def test_the_larger_part_of_the_dipole_decides_which_lines_a_methyl_group_splits():
    """Methanol: μ_b > μ_a, and the E lines of ΔK = 1 lie hundreds of GHz from those of a rigid top; of ΔK = 0 less than 1 GHz."""
    along, across = (
        {limit.name: limit.size_mhz for limit in model_limits(replace(top, dipole_abc_debye=dipole), 16, SEMI_RIGID)}
        for top in [rotor.read("CH3OH")]
        for dipole in ((1.4, 0.9, 0.0), (0.9, 1.4, 0.0))
    )
    assert along["internal rotation"] < 1e3 < 1e5 < across["internal rotation"]


@pytest.mark.parametrize(
    ("source", "bonds"),
    [
        ("SMILES:OO", "O1-O2"), ("SMILES:CCO", "C2-O3"), ("SMILES:Oc1ccccc1", "O1-C2"), ("SMILES:OCCO", "O1-C2, C3-O4"),
        ("SMILES:SCC", "S1-C2"), ("H2O2", "O1-O2"),
        ("SMILES:OC=O", ""), ("SMILES:OCC=O", ""), ("SMILES:OCl", ""), ("SMILES:CO", ""), ("water", ""), ("SMILES:CC(=O)O", ""),
    ],
)  # fmt: skip
def test_hydrogens_that_turn_to_an_equal_position(source, bonds):
    """Gauche ethanol, phenol and H2O2 have equal minima; a carboxylic acid, HOCl and planar glycolaldehyde have none."""
    shown = {limit.name: limit.text for limit in model_limits(rotor.read(source), 5, SEMI_RIGID)}
    assert ("torsional tunnelling" in shown) == bool(bonds)
    if bonds:
        assert f"about {bonds} to an equal position" in shown["torsional tunnelling"]


def test_an_effect_of_the_calculation_is_not_left_out():
    top, coupling = rotor.read("HCN"), NuclearQuadrupole({"chi_aa(14N)": -4.7}, (Spin("14N", 2),))
    effects = (*SEMI_RIGID, coupling)
    assert "nuclear quadrupole" not in limits("HCN", effects)
    sizes = {size.name: (size.size_mhz, size.present) for size in model_sizes(top, 8, effects)}
    assert sizes["nuclear quadrupole"] == (4.7, True)
    left_out = {size.name: size.present for size in model_sizes(top, 8, SEMI_RIGID)}
    assert left_out == {"rigid rotor": True, "centrifugal distortion": True, "nuclear quadrupole": False}


# |χ_zz| in MHz along the bond: deuterium of DCO+, DCOOH, HCOOD (J. Chem. Phys. 1974, 100, abstract), CH3OD; nitrogen of HCN, CH3CN,
# NH3, HCONH2, CH2CHCN (files of the library), HOCN, ICN; 17O of HCO+; chlorine of CH3Cl (library), CH2BrCl; bromine of CH3Br,
# CH3CH2Br, 2-bromopropane, CH2Br2, HOBr; iodine of CH3I, CF3I (abstract of the pure quadrupole spectra), ICN, CH2ICN, IN3. Without
# a source: measured values in the tables of W. C. Bailey, nqcc.wcbailey.net
COUPLINGS = {
    ("H", 2): [0.151, 0.166, 0.272, 0.303], ("N", 14): [4.707, 4.223, 4.090, 3.851, 3.789, 2.913, 3.80], ("O", 17): [4.597],
    ("Cl", 35): [74.752, 75.19], ("Br", 79): [577.13, 544.03, 522.33, 595.74, 915.66],
    ("I", 127): [1934.13, 2142.5, 2420.85, 2086.0, 2748.08],
}  # fmt: skip


@pytest.mark.parametrize(("symbol", "number"), list(COUPLINGS))
def test_estimated_couplings(symbol, number):
    nucleus = isotope(symbol, number)
    estimate = abs(GRADIENTS[symbol] * nucleus.quadrupole_barn) * GRADIENT_MHZ_PER_BARN
    ratios = estimate / np.array(COUPLINGS[symbol, number])
    assert ratios.min() > 1 / 2  # claimed in docs/scenes.md; 3 is asked for
    assert ratios.max() < 2


@pytest.mark.parametrize(("source", "nucleus"), [("SMILES:CBr", "79Br"), ("SMILES:CI", "127I"), ("SMILES:CN", "14N")])
def test_unknown_couplings_are_those_of_covalent_bonds(source, nucleus):
    item = next(item for item in splitting_nuclei(rotor.read(source)) if item.nucleus == nucleus)
    assert not item.known
    expected = np.mean(COUPLINGS[item.nucleus.lstrip("0123456789"), int(item.nucleus.rstrip("BrIN"))])
    assert 1 / 2 < abs(item.chi_mhz) / expected < 2  # as above
    limit = next(
        limit for limit in model_limits(rotor.read(source), 3, SEMI_RIGID) if limit.name == "nuclear quadrupole"
    )
    assert "covalent bonds" in limit.text


@pytest.mark.parametrize("source", ["CH3OH", "CH3CHO", "NO", "NH3"])
def test_largest_first_and_unknown_spin_before_all(source):
    computed = list(limits(source).items())
    known = [size for _, size in computed if size is not None]
    assert known == sorted(known, reverse=True)
    assert computed[-1] == ("magnetic coupling of nuclear spins", None)
    assert ("electron spin" in dict(computed)) == (source == "NO") == (computed[0][1] is None)


@pytest.mark.parametrize(
    ("source", "magnetic"),
    [("NH3", "1H: small splittings"), ("HCONH2", "14N, 1H: small splittings"), ("HCN", "1H: small splittings")],
)
def test_nuclei_without_magnetic_constants_are_left_out(source, magnetic):
    """C of 14N is known of two; that of protons is not, which split lines of NH3 by 0.06 MHz."""
    top = rotor.read(source)
    for effects in (SEMI_RIGID, effects_of(top, True)):
        (computed,) = [
            limit for limit in model_limits(top, 3, effects) if limit.name == "magnetic coupling of nuclear spins"
        ]
        assert computed.text == magnetic


def test_the_size_of_distortion_is_that_of_a_harmonic_diatomic_molecule():
    """Lines ν = 2B(J+1) - 4D(J+1)³ with D = 4B³/ω²."""
    b = 57_600.0
    top = rotor.Top.from_constants(f"B={b} MHz")
    d = 4 * b**3 / (VIBRATION_CM * (b / MHZ_PER_CM) ** VIBRATION_POWER * MHZ_PER_CM) ** 2
    real = rotor.Top.from_constants(f"B={b} D={d} MHz")
    moved = solve_levels(top, 8).energy_mhz - solve_levels(real, 8).energy_mhz
    limit = {limit.name: limit.size_mhz for limit in model_limits(top, 7, SEMI_RIGID)}["centrifugal distortion"]
    assert limit == pytest.approx(moved[8] - moved[7], rel=1e-9)  # differences of large numbers


def distortion_over_real(name: str) -> float | None:
    """The size for the rigid constants of a molecule of the library over that of its own D, D_J or ΔJ; None where it has none."""
    top = rotor.read(name)
    known = [top.constants[item] for item in ("D", "DJ", "DeltaJ") if item in top.constants.values]
    if not known or not known[0] or top.kind == "spherical":
        return None
    a, b, c = top.rotational_constants_mhz
    text = f"B={b} MHz" if top.kind == "linear" else f"A={a} B={b} C={c} MHz"
    sizes = {limit.name: limit.size_mhz for limit in model_limits(rotor.Top.from_constants(text), 7, SEMI_RIGID)}
    return sizes["centrifugal distortion"] / (4 * abs(known[0]) * 8**3)


def test_distortion_of_rigid_constants():
    names = sorted(path.stem for path in (data_folder() / "molecules").glob("*.toml"))
    computed = {name: ratio for name in names if (ratio := distortion_over_real(name)) is not None}
    assert len(computed) > 40
    beyond = [name for name, ratio in computed.items() if not 1 / 3 < ratio < 3]
    assert beyond == ["CH2OHCHO"]  # 0.28: its molecules are soft


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
    words = ("HCN", "--polarizability", "3,2") if verb == "raman" else ("HCN",)
    code, out, _ = call(verb, *words)
    assert code == 0
    last = out.rstrip().splitlines()[-5:]
    assert last[0].startswith("effects   at J = ")
    assert " ".join([last[1], last.pop(2).lstrip()]).startswith(
        "left out  nuclear quadrupole: about 2.4 MHz; levels shift by this amount, 14N splits J = 1 by 3.53 MHz: rotor"
    )
    assert last[2].lstrip() == "magnetic coupling of nuclear spins: not estimated; 1H: small splittings"
    assert last[3].lstrip() == "and smaller or not estimated: spin-rotation"  # below a tenth of the largest
    printed = json.loads(call(verb, *words, "--json", "-")[1])
    assert [limit["name"] for limit in printed["limits"]] == [
        "nuclear quadrupole",
        "spin-rotation",
        "magnetic coupling of nuclear spins",
    ]
    assert {effect["name"]: effect["present"] for effect in printed["effects"]}["nuclear quadrupole"] is False


@pytest.mark.parametrize(
    ("command", "effect", "size"),
    [
        (("CH3CN", "--field", "0:1kV/cm:2"), "nuclear quadrupole", "2.1"),  # χ/2
        (("OCS", "--field", "0:100kV/cm:2"), "polarization by the static field", "65"),  # ½ α F²
    ],
)
def test_a_report_has_the_same_size_of_an_effect_twice(call, command, effect, size):
    """In the line of errors, where other effects add less than a digit, and in that of what is left out."""
    out = " ".join(call("stark", *command, "--states", "J<=1")[1].split())
    assert f"left out about {size} MHz ({effect} and" in out
    assert f"left out {effect}: about {size} MHz; " in out


def test_the_size_of_neglected_distortion_names_its_levels(call):
    """The estimate grows as a high power of J: H2CO at 300 K has its strongest lines from J = 13."""
    out = " ".join(call("spectrum", "H2CO", "--range", "840:1540GHz")[1].split())
    assert "(centrifugal distortion of order J^10 at J = 13, K up to 13)" in out
    linear = ("--constants", "B=6081.492 D=0.0013 MHz", "--dipole-abc", "0.7,0,0")
    out = " ".join(call("spectrum", *linear)[1].split())
    assert re.search(r"\(centrifugal distortion of order J\^6 at J = \d+\)", out)


def test_effects_are_compared_at_the_j_of_the_listed_lines(call):
    """A single line of J = 4 had the neglected distortion of J = 24, the most populated J: 22 MHz."""
    out = call("spectrum", "HCONH2", "--range", "84.5:84.6GHz")[1]
    assert "effects   at J = 4: " in out
    assert "left out about 2.9 MHz (nuclear quadrupole" in out
    source = ("--column", "1e15", "--excitation", "300K", "--range", "84.5:84.6GHz")
    out = call("emission", "HCONH2", *source)[1]  # a shift by 19 MHz at J = 24, all of the line
    assert "left out about 1.2 K (nuclear quadrupole)" in out
    assert "effects   at J = 4: " in call("raman", "N2", "--jmax", "4")[1]  # the most populated is 7


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (("raman", "CO2", "--jmax", "4"), "nothing that the molecule shows signs of"),
        (("thermo", "HCN", "--temperature", "10"), "nuclear quadrupole: about 2.4 MHz"),
        (("stark", "HCN", "--field", "0,1", "--states", "0"), "nuclear quadrupole: about 2.4 MHz"),
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


def test_couplings_of_an_electron_with_known_constants_are_left_out_by_size():
    """ε of S stands before χ: it splits by N ε S, here 22 (5.4 GHz)/2; with the spins nothing of it is left out."""
    from rotor.quantum.effects.of_top import effects_of
    from rotor.quantum.estimates.limits import model_limits
    from rotor.tops.spins.spin_constants import SpinConstants

    spins = SpinConstants.parse("eps_aa(S)=5406 eps_bb(S)=8 b_F(S,14N)=147 chi_aa(14N)=0.5 MHz", "S=1/2")
    top = rotor.Top.from_constants("A=239905 B=13002 C=12305 MHz", spin_constants=spins)
    computed = {limit.name: limit for limit in model_limits(top, 22, effects_of(top, False))}
    assert next(iter(computed)) == "spin-rotation"
    assert computed["spin-rotation"].size_mhz == pytest.approx(22 * 5406 / 2)
    assert "S, 14N: its constants are known" in computed["spin-spin"].text
    assert not {"spin-rotation", "spin-spin", "nuclear quadrupole"} & {
        limit.name for limit in model_limits(top, 22, effects_of(top, True))
    }


@pytest.mark.parametrize(("isotopes", "size_mhz"), [("N=14N", 24000.0), ("H=2H", 1600.0), ("2=2H,3=2H", 24000.0)])
def test_inversion_of_heavy_ammonia_is_slower(isotopes, size_mhz):
    """Measured at (J, K) = (1, 1): 23.7 GHz of NH3, 1.59 GHz of ND3; one hydrogen left counts as NH3."""
    top = Top.from_molecule(read_molecule("SMILES:N", isotopes=isotopes))
    (computed,) = [limit for limit in model_limits(top, 5, SEMI_RIGID) if limit.name == "inversion"]
    assert computed.size_mhz == size_mhz
