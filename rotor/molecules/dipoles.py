"""A dipole estimated from the partial charges of MMFF94, for a molecule whose dipole nobody measured.

μ = Σ q_i (r_i - R), with R the centre of mass: it decides which kinds of lines a spectrum has (a, b or c type) and
their rough strength, no more.
"""

from typing import Any

import numpy as np

from rotor.molecules.molecule import Floats, Molecule
from rotor.units import DEBYE_PER_E_ANGSTROM

CHARGES_SOURCE = "estimate from MMFF94 partial charges"
MOST_ATOMS = 200  # beyond this, finding the bonds of a bare geometry takes too long


def estimate_dipole(molecule: Molecule) -> tuple[Floats | None, str]:
    """The dipole that MMFF94 charges give a geometry, and what to say about it.

    μ = Σ q_i (r_i - R). The bonds are found from the distances and the molecule's charge (RDKit's
    rdDetermineBonds), the charges q_i are those of T. A. Halgren, J. Comput. Chem. 17, 490 (1996).

    Parameters
    ----------
    molecule : Molecule
        Its positions and charge are used; its isotopes only for the centre of mass of an ion.

    Returns
    -------
    dipole_debye : (3,) array or None
        In the frame of the positions, D; None where bonds or charges cannot be found.
    note : str
        How far to trust it, or why there is none.

    >>> carbon_monoxide = Molecule(("C", "O"), [[0, 0, 0], [0, 0, 1.128]])
    >>> estimate_dipole(carbon_monoxide)[1]
    'no dipole: MMFF94 has no charges for CO; give one'
    """
    from rdkit import Chem, Geometry, rdBase
    from rdkit.Chem import rdDetermineBonds

    if len(molecule.symbols) > MOST_ATOMS:
        return None, f"no dipole: bonds are looked for up to {MOST_ATOMS} atoms, {molecule.formula} has more; give one"
    bare = Chem.RWMol()
    conformer = Chem.Conformer(len(molecule.symbols))
    for i, (symbol, position) in enumerate(zip(molecule.symbols, molecule.positions_angstrom, strict=True)):
        bare.AddAtom(Chem.Atom(symbol))
        conformer.SetAtomPosition(i, Geometry.Point3D(*position.tolist()))
    bare.AddConformer(conformer)
    with rdBase.BlockLogs():
        try:
            rdDetermineBonds.DetermineBonds(bare, charge=molecule.charge)
        except (ValueError, RuntimeError) as reason:
            why = str(reason).strip().splitlines()[0]
            return None, f"no dipole: the bonds of {molecule.formula} do not follow from its geometry ({why}); give one"
        dipole = mmff_dipole(bare, molecule)
    if dipole is None:
        return None, f"no dipole: MMFF94 has no charges for {molecule.formula}; give one"
    return dipole, charges_note(molecule)


def mmff_dipole(mol: Any, molecule: Molecule) -> Floats | None:
    """Dipole (3,) in D from the bonds of an RDKit molecule and the positions of ours; None without parameters."""
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
    return np.asarray(DEBYE_PER_E_ANGSTROM * (charges @ arms), dtype=np.float64)


def charges_note(molecule: Molecule) -> str:
    """How far to trust a dipole from MMFF94 charges."""
    frame = "; that of an ion refers to its centre of mass" if molecule.charge else ""
    return f"dipole estimated from MMFF94 partial charges{frame}"
