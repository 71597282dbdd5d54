"""Dipole estimated from the partial charges of MMFF94, for molecules without a measured dipole.

μ = s Σ q_i (r_i - R), with R the centre of mass. The estimate only shows which types of lines (a, b, c) a spectrum has, and their
approximate strengths. MMFF94 charges are made for liquids, where molecules polarise each other, and overestimate gas-phase dipoles by
a third; s = 0.74 reduces the median error for 30 measured dipoles to 0.2 D.
"""

from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.molecules.molecule import Molecule
from rotor.units import DEBYE_PER_E_ANGSTROM

# least squares over 30 molecules (tests/molecules/test_dipoles.py): median error 0.2 D; without it 0.6 D
GAS_SCALE = 0.74
CHARGES_SOURCE = "estimate from MMFF94 partial charges"
NO_DIPOLE_DEBYE = 1e-4  # smaller dipoles are round-off of a geometry whose symmetry forbids a dipole
MOST_ATOMS = 200  # bond perception of larger geometries takes too long


def estimate_dipole(molecule: Molecule) -> tuple[Floats | None, str]:
    """The dipole of a geometry from MMFF94 charges, with a note on its accuracy.

    μ = s Σ q_i (r_i - R), s = 0.74 (1 for an ion, whose charges must add up). The bonds are found from the distances
    and the molecule's charge (RDKit's rdDetermineBonds), the charges q_i are those of T. A. Halgren, J. Comput. Chem.
    17, 490 (1996).

    Parameters
    ----------
    molecule : Molecule
        Its positions and charge are used; its isotopes only for the centre of mass of an ion.

    Returns
    -------
    dipole_debye : (3,) array or None
        In the frame of the positions, D; None if bonds or charges cannot be determined.
    note : str
        The accuracy of the dipole, or why there is none.

    Examples
    --------
    >>> carbon_monoxide = Molecule(("C", "O"), [[0, 0, 0], [0, 0, 1.128]])
    >>> estimate_dipole(carbon_monoxide)[1]
    'no dipole for CO: MMFF94 has no charges for it; give one'
    """
    from rdkit import rdBase

    if len(molecule.symbols) > MOST_ATOMS:
        return (
            None,
            f"no dipole for {molecule.formula}: bonds are only determined for up to {MOST_ATOMS} atoms; give a dipole",
        )
    with rdBase.BlockLogs():
        bare = bonded_rdkit(molecule)
        if bare is None:
            why = "its geometry does not fit ordinary bonds (a radical, a metal, or far from equilibrium?)"
            return None, f"no dipole for {molecule.formula}: {why}; give one"
        dipole = mmff_dipole(bare, molecule)
    if dipole is None:
        return None, f"no dipole for {molecule.formula}: MMFF94 has no charges for it; give one"
    return dipole, charges_note(molecule)


def bonded_rdkit(molecule: Molecule) -> Any:
    """An RDKit molecule with bonds from the distances and the charge (rdDetermineBonds); None if no bonds fit."""
    from rdkit import Chem, Geometry
    from rdkit.Chem import rdDetermineBonds

    bare = Chem.RWMol()
    conformer = Chem.Conformer(len(molecule.symbols))
    for i, (symbol, position) in enumerate(zip(molecule.symbols, molecule.positions_angstrom, strict=True)):
        bare.AddAtom(Chem.Atom(symbol))
        conformer.SetAtomPosition(i, Geometry.Point3D(*position.tolist()))
    bare.AddConformer(conformer)
    try:
        rdDetermineBonds.DetermineBonds(bare, charge=molecule.charge)
    except (ValueError, RuntimeError):
        return None
    return bare


def mmff_dipole(mol: Any, molecule: Molecule) -> Floats | None:
    """Dipole (3,) in D from the bonds of the RDKit molecule and the positions of `molecule`; None without parameters."""
    from rdkit import Chem
    from rdkit.Chem import rdForceFieldHelpers

    typed = Chem.Mol(mol)
    if Chem.SanitizeMol(typed, catchErrors=True):
        return None
    properties = rdForceFieldHelpers.MMFFGetMoleculeProperties(typed)
    if properties is None:
        return None
    charges = np.array([properties.GetMMFFPartialCharge(i) for i in range(typed.GetNumAtoms())])
    arms = molecule.positions_angstrom - molecule.centre_of_mass_angstrom
    scale = 1.0 if molecule.charge else GAS_SCALE
    dipole = np.asarray(scale * DEBYE_PER_E_ANGSTROM * (charges @ arms), dtype=np.float64)
    return dipole if np.linalg.norm(dipole) > NO_DIPOLE_DEBYE else np.zeros(3)


def charges_note(molecule: Molecule) -> str:
    """A note on the accuracy of a dipole from MMFF94 charges."""
    if molecule.charge:
        return f"dipole of the ion about its centre of mass is an {CHARGES_SOURCE}: its error was not measured"
    return f"dipole is an {CHARGES_SOURCE}: half of 30 molecules were off by more than 0.2 D, the worst by 1.2 D"
