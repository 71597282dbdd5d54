"""Constants of one to three methyl groups from a geometry: kinetic constants, equivalence, spin weights, barriers and their errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import rotor
from rotor import units
from rotor.quantum.estimates.budgets import known_covariance, level_errors
from rotor.quantum.internal_rotation.frames import axis_of_angles
from rotor.quantum.internal_rotation.from_geometry import with_internal_rotation


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
    ("smiles", "isotopes", "reason"),
    [
        ("CC(C)(C)C", "", "4 methyl groups turn; up to three"),
        ("CC(=O)C", "5=2H,6=2H,7=2H", "CH3 and CD3 turn"),
        ("C=C", "", "no methyl group turns"),
        ("Cc1ccccc1", "", r"no threefold barrier .toluene: V6 = 4.88 cm-1 alone.; give both"),
    ],
)
def test_groups_that_cannot_be_computed_are_named(smiles, isotopes, reason):
    top = rotor.read(f"SMILES:{smiles}")
    if isotopes:
        top = rotor.Top.from_molecule(top.molecule.with_isotopes(isotopes))
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
