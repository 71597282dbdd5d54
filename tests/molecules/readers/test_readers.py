"""Every door that a molecule comes in by."""

import io
from pathlib import Path

import ase
import ase.build
import ase.io
import numpy as np
import pytest
from ase.calculators.singlepoint import SinglePointCalculator

from rotor.molecules.molecule import Molecule
from rotor.molecules.readers.read import from_ase, g2_molecule, g2_names, read_molecule
from rotor.units import DEBYE_PER_E_ANGSTROM

XYZ = "2\n\nC 0 0 0\nO 0 0 1.128\n"


def test_every_reader_gives_the_same_molecule(tmp_path, monkeypatch):
    from rdkit import Chem
    from rdkit.Chem import rdDistGeom

    (tmp_path / "co.xyz").write_text(XYZ)
    mol = Chem.AddHs(Chem.MolFromSmiles("CO"))
    rdDistGeom.EmbedMolecule(mol, randomSeed=1)
    (tmp_path / "methanol.sdf").write_text(Chem.MolToMolBlock(mol) + "$$$$\n")
    ase.io.write(tmp_path / "co.gen", ase.build.molecule("CO"))

    assert read_molecule(str(tmp_path / "co.xyz")).formula == "CO"
    assert read_molecule(tmp_path / "co.xyz").name == "co"
    assert read_molecule(tmp_path / "methanol.sdf").formula == "CH4O"
    assert read_molecule(tmp_path / "co.gen").formula == "CO"
    assert read_molecule(ase.build.molecule("CO")).formula == "CO"
    assert read_molecule(mol).formula == "CH4O"
    assert read_molecule("SMILES:CO").formula == "CH4O"
    assert read_molecule("CO").formula == "CO"
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(XYZ.encode())))
    assert read_molecule("-").source == "standard input"
    molecule = Molecule(("C", "O"), [[0, 0, 0], [0, 0, 1.128]])
    assert read_molecule(molecule) is molecule


def test_isotopes_at_the_door():
    assert read_molecule("H2O", isotopes={1: "18O"}).formula == "H2[18O]"
    assert read_molecule("SMILES:[2H]O", isotopes="O=17O").formula == "H[2H][17O]"


def test_what_is_no_molecule():
    with pytest.raises(ValueError, match="a float is not a molecule"):
        read_molecule(1.5)
    with pytest.raises(ValueError, match=r"near it: .*CH3CHO"):
        read_molecule("CH3CH0")
    with pytest.raises(ValueError, match=r"gone\.xyz: no such file"):
        read_molecule(Path("gone.xyz"))


def test_a_name_with_two_meanings(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("CO").write_text("not even a molecule")
    with pytest.raises(ValueError, match=r"write './CO' for the file"):
        read_molecule("CO")


@pytest.mark.parametrize(("name", "content"), [("a.gen", "2 C\nC O\n1 1 0 0"), ("a.nothing", "x"), ("a.traj", "x")])
def test_files_that_ase_does_not_read(tmp_path, name, content):
    (tmp_path / name).write_text(content)
    with pytest.raises(ValueError, match="ASE cannot read it"):
        read_molecule(tmp_path / name)


def test_the_last_of_several_structures_is_taken_and_told(tmp_path):
    first, last = ase.Atoms("CO", [(0, 0, 0), (0, 0, 1.2)]), ase.Atoms("CO", [(0, 0, 0), (0, 0, 1.13)])
    ase.io.write(tmp_path / "path.traj", [first, last])
    molecule = read_molecule(tmp_path / "path.traj")
    assert molecule.positions_angstrom[1, 2] == 1.13
    assert "holds 2 structures" in molecule.notes[0]


def test_masses_of_ase_are_isotopes():
    atoms = ase.build.molecule("CH3Cl")
    assert from_ase(atoms).formula == "CH3Cl"
    atoms.set_masses([12.011, 36.966, 2.014, 1.008, 1.008])  # ASE's averages of C and H mean the most abundant ones
    assert atoms.get_chemical_symbols() == ["C", "Cl", "H", "H", "H"]
    assert from_ase(atoms).mass_numbers == (12, 37, 2, 1, 1)
    atoms.set_masses([12.011, 36.5, 1, 1, 1])
    with pytest.raises(ValueError, match="a mass of 36"):
        from_ase(atoms)
    atoms.set_masses([12.011, 35.45, 0, 1, 1])
    with pytest.raises(ValueError, match="atom 3: a mass of 0 u"):
        from_ase(atoms)


def test_dipole_charge_and_cell_of_ase():
    atoms = ase.build.molecule("H2O")
    atoms.calc = SinglePointCalculator(atoms, dipole=[0, 0, -0.386])
    np.testing.assert_allclose(from_ase(atoms).dipole_debye, [0, 0, -0.386 * DEBYE_PER_E_ANGSTROM])  # rounding only
    atoms.positions[0, 0] += 0.1  # the result belongs to other positions now
    assert from_ase(atoms).dipole_debye is None
    atoms.set_initial_charges([0.2, 0.4, 0.4])
    assert from_ase(atoms).charge == 1
    assert not from_ase(atoms).notes
    atoms.set_cell([9, 9, 9])
    atoms.pbc = True
    assert "cell" in from_ase(atoms).notes[0]


def test_a_dummy_atom_is_refused():
    with pytest.raises(ValueError, match="dummy atom, without a nucleus"):
        from_ase(ase.Atoms("XO", [(0, 0, 0), (0, 0, 1)]))


def test_every_g2_molecule_comes_in():
    assert len(g2_names()) == 162
    for name in g2_names():
        molecule = g2_molecule(name)
        assert len(molecule.symbols) == len(ase.build.molecule(name))
        assert "MP2" in molecule.source
