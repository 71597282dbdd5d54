"""The dipole from MMFF94 charges: its stated error measured, its direction, and when there is none."""

import numpy as np
import pytest

from rotor.molecules.mmff_dipole import GAS_SCALE, estimate_dipole
from rotor.molecules.molecule import Molecule
from rotor.molecules.readers.read import g2_molecule
from rotor.molecules.readers.smiles import from_smiles
from rotor.tops.estimated_dipole import with_dipole_estimate
from rotor.tops.top import Top

# Measured dipoles in D of molecules in the gas: CRC Handbook of Chemistry and Physics, section 9, Dipole Moments
MEASURED_DEBYE = {
    "O": 1.855, "N": 1.472, "C=O": 2.332, "CO": 1.70, "CC#N": 3.922, "CF": 1.858, "CCl": 1.896, "C#N": 2.985,
    "NC=O": 3.73, "O=C=S": 0.715, "O=S=O": 1.633, "COC": 1.30, "CC(C)=O": 2.88, "CC=O": 2.75, "OC=O": 1.425,
    "CC#C": 0.784, "CCC": 0.084, "c1ccncc1": 2.215, "c1ccoc1": 0.66, "CS": 1.52, "C=CCl": 1.45, "Fc1ccccc1": 1.60,
    "C1CO1": 1.89, "C[N+](=O)[O-]": 3.46, "S": 0.978, "CN": 1.31, "CBr": 1.822, "ClC(Cl)Cl": 1.04,
    "c1cc[nH]c1": 1.767, "Cc1ccccc1": 0.375,
}  # fmt: skip


def test_the_scale_and_the_errors_that_the_note_states_are_those_measured():
    computed = np.array([np.linalg.norm(from_smiles(text).dipole_debye) for text in MEASURED_DEBYE])
    measured = np.array(list(MEASURED_DEBYE.values()))
    best = GAS_SCALE * np.sum(computed * measured) / np.sum(computed**2)
    assert best == pytest.approx(GAS_SCALE, abs=0.01)  # two digits are kept
    errors = np.abs(computed - measured)
    assert np.median(errors) == pytest.approx(0.20, abs=0.02)  # D; one digit is stated
    assert errors.max() == pytest.approx(1.2, abs=0.1)  # D, SO2


def test_bonds_found_from_the_geometry_give_the_same_as_those_of_the_smiles():
    for text in ("O", "CC#N", "NC=O", "c1ccncc1", "[NH4+]"):
        molecule = from_smiles(text)
        dipole, note = estimate_dipole(molecule)
        np.testing.assert_allclose(dipole, molecule.dipole_debye, atol=1e-9)  # D; the same charges and positions
        assert note == molecule.notes[-1]


def test_the_dipole_points_from_negative_to_positive_and_turns_along():
    formaldehyde = g2_molecule("H2CO")
    dipole, _ = estimate_dipole(formaldehyde)
    oxygen, carbon = formaldehyde.positions_angstrom[[formaldehyde.symbols.index(s) for s in "OC"]]
    assert dipole @ (carbon - oxygen) > 0
    turned = formaldehyde.moved([[0, 0, 1], [1, 0, 0], [0, 1, 0]], [1, 2, 3])
    np.testing.assert_allclose(estimate_dipole(turned)[0], dipole[[2, 0, 1]], atol=1e-9)  # D, round-off


def test_symmetry_that_forbids_a_dipole_gives_exactly_none():
    assert estimate_dipole(g2_molecule("C6H6"))[0].tolist() == [0, 0, 0]
    assert estimate_dipole(g2_molecule("CO2"))[0].tolist() == [0, 0, 0]


def test_the_dipole_of_an_ion_refers_to_its_centre_of_mass():
    ion = from_smiles("C[NH3+]")
    heavy = ion.with_isotopes("C=13C")
    dipole, note = estimate_dipole(heavy)
    np.testing.assert_allclose(dipole, heavy.dipole_debye, atol=1e-9)  # D: moved by `with_isotopes`, or found anew
    assert np.linalg.norm(dipole - ion.dipole_debye) > 0.05  # D, so that a dipole that stays would be seen
    assert "centre of mass" in note


@pytest.mark.parametrize("name", ["HCl", "LiF", "OH", "CH3", "Al"])
def test_where_there_are_no_bonds_or_charges_the_note_says_so(name, capfd):
    dipole, note = estimate_dipole(g2_molecule(name))
    assert dipole is None
    assert note.startswith("no dipole")
    assert capfd.readouterr().err == ""


def test_a_top_without_an_estimate_is_refused():
    with pytest.raises(ValueError, match="MMFF94 has no charges for it"):
        with_dipole_estimate(Top.from_molecule(g2_molecule("HCl")))


def test_a_crowd_of_atoms_is_not_tried():
    crowd = Molecule(("He",) * 201, [[0, 0, 3 * i] for i in range(201)])
    assert estimate_dipole(crowd)[0] is None
