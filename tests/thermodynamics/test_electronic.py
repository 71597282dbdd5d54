"""Electronic states in the functions of an ideal gas: closed forms, radicals beside published polynomials, refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest

import rotor
from rotor.formats.molecules.molecule_file import read_molecule_file
from rotor.formats.molecules.molecule_writer import molecule_file_text
from rotor.quantum.effects.of_top import effects_of
from rotor.thermodynamics.electronic import ElectronicStates, electronic_states
from rotor.thermodynamics.functions import GAS_CONSTANT, thermodynamic_functions
from rotor.thermodynamics.request import ThermoRequest, answer_thermo
from rotor.thermodynamics.vibration import VibrationalStates
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.top import Top

# S at 298.15 K and 1 bar of the NASA polynomials of GRI-Mech 3.0 (gri30.yaml of Cantera 638955d; notes TPIS89, RUS78, L7/88)
PUBLISHED = {"O2": 205.148, "NO": 210.744, "NO2": 240.170}


def gas(top, temperatures=(298.15,), **settings):
    functions = thermodynamic_functions(top, temperatures, pressure_bar=1.0, **settings)
    return functions.gas


@pytest.mark.parametrize(
    ("name", "vibration", "electronic", "off"),
    [
        ("O2", "1556.4", None, 0.02),  # harmonic vibration, rigid spin triplet
        ("NO", "1876", "2,2@121.1", 0.3),  # constants of MP2, 2 %: R ln 1.02
        ("NO2", "1318,750,1618", None, 0.5),  # the same, three constants
    ],
)
def test_entropies_of_radicals(name, vibration, electronic, off):
    """They were 5.8 to 11.3 J/(mol K) too low without the degeneracy."""
    states = None if electronic is None else ElectronicStates.parse(electronic)
    vibrations = VibrationalStates.parse(vibration, harmonic=True)
    computed = gas(rotor.read(name), vibrations=vibrations, electronic=states)
    assert computed.entropy_j_per_mol_k[0] == pytest.approx(PUBLISHED[name], abs=off)
    closed = gas(rotor.read(name), vibrations=vibrations, electronic=ElectronicStates())
    assert PUBLISHED[name] - closed.entropy_j_per_mol_k[0] > 5


def test_functions_are_those_of_a_sum_over_states():
    states, temperatures = ElectronicStates((2, 2, 4), (0.0, 121.1, 900.0)), np.array([20.0, 174.0, 3000.0])
    ln_q, energy, heat = states.functions(temperatures)
    kt = temperatures * 0.695034800  # cm-1/K, CODATA
    weights = [g * np.exp(-e / kt) for g, e in zip(states.degeneracies, states.energies_cm, strict=True)]
    assert np.exp(ln_q) == pytest.approx(sum(weights), rel=1e-8)  # digits of the constant
    step = 1e-4 * temperatures
    above, below = (states.functions(temperatures + sign * step)[0] for sign in (1, -1))
    assert energy == pytest.approx(temperatures * (above - below) / (2 * step), rel=1e-6, abs=1e-8)  # U = kT² dlnq/dT
    u = [t * states.functions(t)[1] for t in (temperatures + step, temperatures - step)]
    assert heat == pytest.approx((u[0] - u[1]) / (2 * step), rel=1e-6, abs=1e-8)


def test_a_degeneracy_adds_its_logarithm_alone():
    top = rotor.read("CO")
    plain, triplet = gas(top, (10.0, 500.0)), gas(top, (10.0, 500.0), electronic=ElectronicStates((3,)))
    more = GAS_CONSTANT * math.log(3)
    assert triplet.entropy_j_per_mol_k - plain.entropy_j_per_mol_k == pytest.approx([more, more], rel=1e-12)
    assert triplet.gibbs_j_per_mol_k - plain.gibbs_j_per_mol_k == pytest.approx([more, more], rel=1e-12)
    assert triplet.cp_j_per_mol_k.tolist() == plain.cp_j_per_mol_k.tolist()
    assert triplet.enthalpy_j_per_mol.tolist() == plain.enthalpy_j_per_mol.tolist()


def test_heat_and_enthalpy_of_a_splitting():
    """Two doublets 121.1 cm-1 apart: the Schottky term in C_p, its integral in H, and S = ∫ C_p/T."""
    top, grid = rotor.read("CO"), np.linspace(40.0, 400.0, 2001)
    states = ElectronicStates((2, 2), (0.0, 121.1))
    plain, split = gas(top, grid), gas(top, grid, electronic=states)
    heat = split.cp_j_per_mol_k - plain.cp_j_per_mol_k
    rise = split.enthalpy_j_per_mol - plain.enthalpy_j_per_mol
    entropy = split.entropy_j_per_mol_k - plain.entropy_j_per_mol_k
    assert rise[-1] - rise[0] == pytest.approx(np.trapezoid(heat, grid), rel=1e-5)  # trapezoids of 0.18 K
    assert entropy[-1] - entropy[0] == pytest.approx(np.trapezoid(heat / grid, grid), rel=1e-5)


def test_what_a_molecule_says():
    assert rotor.read("O2").molecule.multiplicity == 3
    assert electronic_states(rotor.read("O2").molecule).degeneracies == (3,)
    assert electronic_states(rotor.read("NO2").molecule).degeneracies == (2,)
    assert electronic_states(rotor.read("CH2_s3B1d").molecule).degeneracies == (3,)
    assert electronic_states(rotor.read("water").molecule).degeneracies == (1,)
    odd = replace(rotor.read("NO2").molecule, multiplicity=None)
    assert "odd number of electrons" in electronic_states(odd).text
    assert electronic_states(replace(odd, charge=1)).degeneracies == (1,)
    assert rotor.read("O2", isotopes="1=18O").molecule.multiplicity == 3
    with pytest.raises(ValueError, match="multiplicity 2: with an even number of electrons"):
        replace(rotor.read("water").molecule, multiplicity=2)
    with pytest.raises(ValueError, match="multiplicity 0"):
        replace(odd, multiplicity=0)


def test_the_spin_counts_once():
    """With constants of the electron spin Q counts its three functions, and nothing is added."""
    constants = SpinConstants.parse("lambda(S)=59501.3 gamma(S)=-252.6 MHz", "S=1")
    top = replace(rotor.read("O2"), spin_constants=constants)
    with_spin, without = gas(top, effects=effects_of(top, True)), gas(rotor.read("O2"))
    assert with_spin.entropy_j_per_mol_k == pytest.approx(without.entropy_j_per_mol_k, abs=0.01)  # (λ/kT)²
    assert with_spin.electronic.degeneracies == (1,)
    with pytest.raises(ValueError, match="leave one of the two out"):
        ThermoRequest(top, (300.0,), pressure_bar=1.0, electronic=ElectronicStates((3,)), effects=effects_of(top, True))


def test_the_command_and_its_scene(call, folder):
    command = ("thermo", "CO", "--gas", "--temperature", "298.15", "--electronic", "2,2@121.1cm-1")
    code, out, err = call(*command, "--save-scene", "s.toml", "--json", "a.json")
    assert code == 0, err
    assert "electronic degeneracy 2, 2@121.1 cm-1 (given)" in out
    assert "2, 2@121.1 cm-1" in (folder / "s.toml").read_text()
    assert call("run", "s.toml")[0] == 0
    assert "electronic" not in call("thermo", "CO", "--gas", "--temperature", "298.15")[1]
    (folder / "no.toml").write_text(
        'name = "NO"\n[geometry]\nkind = "re"\nmultiplicity = 2\natoms = [["N", 0, 0, 0], ["O", 0, 0, 1.15]]\n'
    )
    answer = answer_thermo(ThermoRequest(rotor.read(folder / "no.toml"), (300.0,), pressure_bar=1.0))
    assert answer.facts()["electronic"] == "electronic degeneracy 2 (multiplicity of the molecule)"
    assert "multiplicity = 2" in molecule_file_text(read_molecule_file(folder / "no.toml"))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--electronic", "3"), "counts in the ideal gas; give --gas"),
        (("--gas", "--electronic", "0"), "--electronic: electronic states [0]"),
        (("--gas", "--electronic", "2@5"), "the first is the lowest, with energy 0"),
        (("--gas", "--electronic", "a"), "--electronic: 'a': expected degeneracies such as '3'"),
    ],
)
def test_wrong_electronic_states_are_one_line(call, options, said):
    code, out, err = call("thermo", "CO", *options)
    assert (code, out) == (2, "")
    assert said in err
    assert len(err.splitlines()) == 1


def test_constants_alone_have_no_electrons():
    assert electronic_states(Top.from_constants("B=10 GHz").molecule) == ElectronicStates()


def test_a_linear_doublet_notes_orbital_momentum(call):
    """S of NO by the spin alone is 5.6 J/(mol K) below the published one, and had no word for it."""
    said = "with orbital angular momentum (a Π or Δ state) its functions are twice as many"
    thermo = "thermo", "NO", "--gas", "--temperature", "298.15"
    assert said in call(*thermo)[2]
    assert said not in call(*thermo, "--electronic", "2,2@121.1")[2]
    assert said not in call("thermo", "NO2", *thermo[2:])[2]
    assert said not in call("thermo", "O2", *thermo[2:])[2]
    assert said not in call("thermo", "NO", "--temperature", "298.15")[2]
