"""Constants of one to three methyl groups from a geometry: kinetic constants, equivalence, spin weights, barriers and their errors."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import rotor
from rotor import units
from rotor.formats.molecules.molecule_file import read_molecule_file
from rotor.formats.molecules.molecule_writer import molecule_file_text
from rotor.quantum.estimates.budgets import known_covariance, level_errors
from rotor.quantum.internal_rotation.frames import axis_of_angles
from rotor.quantum.internal_rotation.from_geometry import with_internal_rotation
from rotor.tops.internal_rotation import InternalRotationConstants, sigma_species

TWO_TOPS = """
name = "two tops"
[constants]
A = 9000
B = 7000
C = 4500
reduction = "A"
representation = "Ir"
[internal_rotation]
frame = "PAM"
F0_1 = 160e3
delta_1 = 0.5
V3_1 = 8e6
F0_2 = 80e3
delta_2 = 2.6
V3_2 = 8e6
spin_states = [2, 3]
"""


def _species_weights(top):
    levels = rotor.api.solve_levels(top, 1)
    labels = {"vt": 0, "j": 0, "ka": 0, "kc": 0}
    names = ("AA", "AE", "EE", "EE*")
    return {name: int(levels.weight[levels.find(species=name, **labels)]) for name in names}


def test_kinetic_constants_are_those_of_the_nuclei():
    """F0 = ħ²/2I_α and the direction of each axis, from the positions of carbon and hydrogens alone."""
    top = with_internal_rotation(rotor.read("SMILES:CCC(=O)C"))
    molecule, values = top.molecule, top.internal_rotation.values
    x = molecule.positions_angstrom @ top.frame.axes.T
    carbons = [i for i in range(len(x)) if molecule.symbols[i] == "C" and _hydrogens(molecule, i).size == 3]
    assert len(carbons) == 2
    for number, carbon in enumerate(carbons, 1):
        hydrogens = _hydrogens(molecule, carbon)
        axis = x[carbon] - x[hydrogens].mean(axis=0)
        axis /= np.linalg.norm(axis)
        across = np.cross(x[hydrogens] - x[carbon], axis)
        moment = float(molecule.masses_u[hydrogens] @ np.sum(across**2, axis=1))
        expected = units.ROTATIONAL_MHZ_U_ANGSTROM2 / moment
        assert values[f"F0_{number}"] == pytest.approx(expected, rel=1e-3)
        direction = axis_of_angles(values[f"delta_{number}"], values.get(f"epsilon_{number}", 0.0))
        assert direction == pytest.approx(axis, abs=1e-3)


def _hydrogens(molecule, atom):
    x = molecule.positions_angstrom
    near = np.linalg.norm(x - x[atom], axis=1) < 1.3
    return np.flatnonzero(near & (np.array(molecule.symbols) == "H"))


def test_acetone_has_equivalent_tops():
    """AA, AE, EE, EE* alone; weights of J = 0 are 6, 16, 2 and 4 of the 64 spin functions, here without their common factor."""
    top = with_internal_rotation(rotor.read("SMILES:CC(=O)C"), given="V3=266cm-1 vt_max=0")
    assert _species_weights(top) == {"AA": 3, "AE": 8, "EE": 1, "EE*": 2}
    values = top.internal_rotation.values
    assert values["V3_1"] == values["V3_2"] == pytest.approx(266 * units.MHZ_PER_CM)


def test_propane_exchanges_the_hydrogens_of_ch2_too():
    top = with_internal_rotation(rotor.read("SMILES:CCC"), given="vt_max=0")
    assert top.internal_rotation.exchanged == (2,)
    assert _species_weights(top)["AA"] == 9  # of 36 : 28


def _functions_by_species(states):
    """Spin functions by the σ of each top, of tops with three nuclei of 2I + 1 states: counted from traces of the permutations.

    The number for (σ1, σ2, ...) is the mean over all combinations of rotations by 0, 120 and 240° of Π exp(-i 2π σ n/3) times the number
    of product functions that the permutation leaves unchanged.
    """
    counts = {}
    for sigma in product((0, 1, -1), repeat=len(states)):
        total = 0.0
        for turns in product(range(3), repeat=len(states)):
            fixed = [
                sum(np.roll(f, n).tolist() == list(f) for f in product(range(m), repeat=3))
                for m, n in zip(states, turns, strict=True)
            ]
            total += np.prod(fixed) * np.exp(-2j * np.pi / 3 * np.dot(sigma, turns))
        counts[sigma] = round((total / 3 ** len(states)).real)
    return counts


def test_ch3_beside_cd3_has_the_weights_of_all_spin_functions():
    molecule = rotor.read("SMILES:CC(=O)C").molecule.with_isotopes("5=2H,6=2H,7=2H")
    top = with_internal_rotation(rotor.Top.from_molecule(molecule), given="V3=266cm-1 vt_max=0")
    f0 = [top.internal_rotation.values[f"F0_{number}"] for number in (1, 2)]
    assert f0[0] / f0[1] == pytest.approx(0.5 if f0[0] < f0[1] else 2.0, rel=0.01)
    states = top.internal_rotation.spin_states
    assert states == ((3, 2) if f0[0] < f0[1] else (2, 3))
    counts = _functions_by_species(states)
    assert sum(counts.values()) == 6**3
    expected = {
        name: (1 if name == "AA" else 2) * counts[sigma] for name, sigma in sigma_species(2).items()
    }  # σ and -σ coincide
    levels = rotor.api.solve_levels(top, 2)
    divisor = int(np.gcd.reduce(list(expected.values())))
    for name, number in expected.items():
        here = levels.quanta["species"] == name
        assert here.any()
        assert (levels.weight[here] * divisor == number).all()


def test_nuclei_of_each_top_are_settings(tmp_path):
    text = "PAM F0_1=160GHz delta_1=0.5 V3_1=266cm-1 F0_2=80GHz delta_2=2.6 V3_2=266cm-1 spin_states=2,3 vt_max=0"
    internal = InternalRotationConstants.parse(text)
    assert internal.weights == ((4, 2), (11, 8))
    constants = rotor.Constants(A=9000.0, B=7000.0, C=4500.0, reduction="A", representation="Ir")
    (tmp_path / "top.toml").write_text(TWO_TOPS)
    molecule = read_molecule_file(tmp_path / "top.toml")
    assert molecule.internal_rotation.spin_states == (2, 3)
    assert "spin_states = [2, 3]" in molecule_file_text(molecule)
    (tmp_path / "top.toml").write_text(TWO_TOPS.replace("[2, 3]", '"2"'))
    with pytest.raises(ValueError, match=r"spin_states.*of each top, such as .2, 3."):
        read_molecule_file(tmp_path / "top.toml")
    with pytest.raises(ValueError, match=r"spin_states = .2, 3, 3.: expected 2I . 1 .* of each of 2"):
        InternalRotationConstants.parse(text.replace("2,3", "2,3,3"))
    equal = text.replace("F0_2=80GHz delta_2=2.6", f"F0_2=160GHz delta_2={np.pi - 0.5}")
    top = rotor.Top.from_constants(constants, internal_rotation=InternalRotationConstants.parse(equal))
    with pytest.raises(ValueError, match="tops with equal constants, which C2 exchanges: expected the same nuclei"):
        rotor.api.solve_levels(top, 1)


def test_groups_of_different_kinds_have_barriers_of_their_own():
    top = with_internal_rotation(rotor.read("SMILES:CC(=O)OC"), given="vt_max=0")
    values, errors = top.internal_rotation.values, top.internal_rotation.uncertainties
    assert values["V3_1"] == pytest.approx(170 * units.MHZ_PER_CM)
    assert values["V3_2"] == pytest.approx(370.9 * units.MHZ_PER_CM)
    assert errors["V3_1"] == pytest.approx(0.35 * values["V3_1"])
    assert errors["F0_2"] == pytest.approx(0.02 * values["F0_2"])
    assert "similar molecule (acetic acid)" in top.internal_rotation.source
    assert "V12) left out" in top.internal_rotation.source


def test_a_given_value_replaces_that_of_the_geometry_and_is_exact():
    top = with_internal_rotation(rotor.read("SMILES:CC=O"), given="V3=400cm-1 F0=158GHz vt_max=0")
    internal = top.internal_rotation
    assert (internal.values["F0"], internal.vt_max) == (158000.0, 0)
    assert internal.values["V3"] == pytest.approx(400 * units.MHZ_PER_CM)
    assert not internal.uncertainties


@pytest.mark.parametrize(
    ("smiles", "reason"),
    [
        ("CC(C)(C)C", "4 methyl groups turn; up to three"),
        ("C=C", "no methyl group turns"),
        ("Cc1ccccc1", r"no threefold barrier .toluene: V6 = 4.88 cm-1 alone.; give both"),
    ],
)
def test_groups_that_cannot_be_computed_are_named(smiles, reason):
    top = rotor.read(f"SMILES:{smiles}")
    with pytest.raises(ValueError, match=reason):
        with_internal_rotation(top)


def test_errors_of_levels_contain_that_of_the_barrier():
    """σ of E 1(01) with V3 alone uncertain is 0.35 V3 |∂E/∂V3|, here by differences; the V3 of propene itself is exact."""
    assert "V3" not in with_internal_rotation(rotor.read("SMILES:CC=C")).internal_rotation.uncertainties
    top = with_internal_rotation(rotor.read("SMILES:CC=CF"), given="vt_max=0")
    values, error = top.internal_rotation.values, top.internal_rotation.uncertainties["V3"]
    assert error == pytest.approx(0.35 * values["V3"])
    covariance = known_covariance(top, ("A", "F0", "V3"))
    assert covariance.names == ("A", "F0", "V3")
    levels = rotor.api.solve_levels(top, 1)
    row = levels.find(species="E", vt=0, j=1, ka=0, kc=1)
    spread = level_errors(top, levels, covariance.of(("V3",)))[row]

    def energy(v3):
        internal = replace(top.internal_rotation, values=dict(values) | {"V3": v3})
        shifted = rotor.api.solve_levels(replace(top, internal_rotation=internal), 1)
        return shifted.energy_mhz[shifted.find(species="E", vt=0, j=1, ka=0, kc=1)]

    step = 1e-3 * values["V3"]
    slope = (energy(values["V3"] + step) - energy(values["V3"] - step)) / (2 * step)
    assert spread == pytest.approx(abs(slope) * error, rel=1e-4)


def test_words_of_the_command_line(call):
    code, _, err = call("levels", "SMILES:CC(=O)C", "--jmax", "1", "--internal-rotation", "geometry V3=266cm-1")
    assert code == 0
    assert "V3_1, V3_2 = 266cm-1, given" in err
    code, _, err = call("levels", "SMILES:CC=O", "--jmax", "1", "--internal-rotation", "V3=266cm-1")
    assert code == 2
    assert "the word geometry or scan, with values behind it" in err
    code, _, err = call("levels", "SMILES:CC=O", "--jmax", "1", "--internal-rotation", "geometry V3=266 cm-1")
    assert code == 2
    assert "without spaces" in err
