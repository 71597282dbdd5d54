"""A relaxed scan of the rotation about a bond: energies and geometries from an ASE calculator or MMFF94 of RDKit."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.molecules.bond_rotation import BondRotation
from rotor.molecules.molecule import Molecule
from rotor.molecules.optimise import ase_atoms, calculator_by_name
from rotor.units import AVOGADRO_PER_MOL, CM_PER_EV, ELEMENTARY_CHARGE_C

# eV/Å; the energy, of second order in the force, is then converged to about 1e-6 eV, 0.01 cm⁻¹
MOST_FORCE_EV_PER_ANGSTROM = 5e-4
MOST_STEPS = 500
EV_PER_KCAL_MOL = 4184.0 / AVOGADRO_PER_MOL / ELEMENTARY_CHARGE_C  # exact
MMFF = "mmff"
MMFF_ERROR = 0.20  # median relative error for 13 measured barriers of methyl groups (tests/quantum/estimates/test_scanned_barriers.py)
MMFF_DOUBT = (
    f"half of 13 barriers of methyl groups by MMFF94 were off by more than {MMFF_ERROR:.0%}, the worst by a factor of 7"
)
POINTS = 36  # of a whole turn
LEAST_POINTS = 6  # of one period: two harmonics of it


@dataclass(frozen=True, eq=False)
class BondScan:
    """Energies along the rotation about a bond.

    angles : (n,) radian, mean angle of the group from that of the input, over one period (`BondRotation.angle`)
    energies_cm : (n,) cm⁻¹ above the lowest
    positions_angstrom : (n, atoms, 3)
    closure_cm : energy after a whole period minus that at its start; not 0 if the path has left its valley
    source : the calculator
    relative_error : of barriers of this calculator; 0 if it is not known
    """

    angles: Floats
    energies_cm: Floats
    positions_angstrom: Floats
    closure_cm: float
    source: str
    relative_error: float = 0.0

    @property
    def doubt(self) -> str:
        """How far barriers of this calculator can be trusted; "" if that is not known."""
        return MMFF_DOUBT if self.relative_error else ""


def relaxed_scan(
    rotation: BondRotation,
    calculator: Any = MMFF,
    *,
    points: int = POINTS,
    progress: Callable[[int, int], object] | None = None,
) -> BondScan:
    """Energies over a period of the rotation with all other coordinates relaxed (BFGS with fixed dihedral angle).

    Between planar groups (a peptide bond) the dihedral angles on both sides are fixed: with only one, the groups bend instead of turning.

    Parameters
    ----------
    rotation : BondRotation
    calculator : ASE calculator or str, optional
        A calculator with forces, a name for `calculator_by_name`, or "mmff" for MMFF94 of RDKit.
    points : int, optional
        Angles per turn; only a period is calculated, 2π divided by the symmetry number without isotopes.
    progress : callable, optional
        Called with the numbers of points done and in total.

    Returns
    -------
    BondScan

    Raises
    ------
    ValueError
        If the calculator is unknown or fails, or a geometry does not converge.
    """
    engine = _calculator(rotation.molecule, calculator)
    name = "MMFF94 (RDKit)" if calculator == MMFF else type(engine).__name__
    period = 2 * math.pi / rotation.symmetry_number(isotopes=False)
    points = max(LEAST_POINTS, math.ceil(points * period / (2 * math.pi)))
    step = period / points
    energies, geometries, positions = [], [], np.array(rotation.molecule.positions_angstrom)
    for point in range(points + 1):
        if point:
            positions = rotation.turned_positions(positions, step)
        positions, energy = _relaxed(rotation, positions, engine, name, math.degrees(point * step))
        energies.append(energy * CM_PER_EV)
        geometries.append(positions)
        if progress is not None:
            progress(point + 1, points + 1)
    levels = np.array(energies)
    return BondScan(
        np.array([_unwrapped(rotation.angle(x), i * step) for i, x in enumerate(geometries[:-1])]),
        levels[:-1] - levels[:-1].min(),
        np.array(geometries[:-1]),
        float(levels[-1] - levels[0]),
        f"relaxed scan with {name}, {points} angles in a period",
        MMFF_ERROR if calculator == MMFF else 0.0,
    )


def _relaxed(rotation: BondRotation, positions: Floats, engine: Any, name: str, degrees: float) -> tuple[Floats, float]:
    """Positions and energy (eV) minimised with the dihedral angle fixed (two of them between planar groups)."""
    from ase import constraints
    from ase.optimize import BFGS

    library: Any = constraints  # ASE has no types
    atoms = ase_atoms(rotation.molecule)
    atoms.set_positions(positions)
    quartets = [list(atoms) for atoms in (rotation.dihedral_atoms(), rotation.opposite_atoms()) if atoms is not None]
    fixed = [[atoms.get_dihedral(*quartet), quartet] for quartet in quartets]
    atoms.set_constraint(library.FixInternals(dihedrals_deg=fixed, epsilon=1e-9))
    atoms.calc = engine
    try:
        search: Any = BFGS(atoms, logfile=None)
        converged = search.run(fmax=MOST_FORCE_EV_PER_ANGSTROM, steps=MOST_STEPS)
        energy = float(atoms.get_potential_energy())
    except (
        Exception
    ) as reason:  # calculators raise exceptions of any class; all mean that it cannot treat this molecule
        raise ValueError(
            f"{name} fails for {rotation.molecule.formula} at {degrees:g} degrees: {reason or type(reason).__name__}"
        ) from reason
    if not converged:
        raise ValueError(
            f"{name} did not relax {rotation.molecule.formula} at {degrees:g} degrees in {MOST_STEPS} steps; "
            "refine the geometry first, or use another calculator"
        )
    return np.asarray(atoms.get_positions()), energy


def _unwrapped(angle: float, near: float) -> float:
    """The angle plus the multiple of 2π that brings it closest to `near`."""
    return angle + 2 * math.pi * round((near - angle) / (2 * math.pi))


def _calculator(molecule: Molecule, calculator: Any) -> Any:
    if calculator == MMFF:
        return mmff_calculator(molecule)
    return calculator_by_name(calculator) if isinstance(calculator, str) else calculator


def mmff_calculator(molecule: Molecule) -> Any:
    """An ASE calculator with the energy and forces of MMFF94 (T. A. Halgren, J. Comput. Chem. 17 (1996) 490) by RDKit.

    Raises ValueError if no bonds fit the geometry or MMFF94 has no parameters.
    """
    from ase.calculators import calculator as library
    from rdkit import Chem, rdBase
    from rdkit.Chem import rdForceFieldHelpers

    from rotor.molecules.mmff_dipole import bonded_rdkit

    with rdBase.BlockLogs():
        mol = bonded_rdkit(molecule)
        parameters = None
        if mol is not None and not Chem.SanitizeMol(mol, catchErrors=True):
            parameters = rdForceFieldHelpers.MMFFGetMoleculeProperties(mol)
    if parameters is None:
        raise ValueError(f"MMFF94 has no parameters for {molecule.formula}; give the potential or an ASE calculator")
    field = rdForceFieldHelpers.MMFFGetMoleculeForceField(mol, parameters)
    conformer = mol.GetConformer()

    base: Any = library.Calculator  # ASE has no types

    class Mmff94(base):  # type: ignore[misc]
        """Energy and forces of RDKit's force field."""

        implemented_properties = ["energy", "forces"]  # noqa: RUF012  # ASE expects a list

        def calculate(
            self, atoms: Any = None, properties: Any = ("energy",), system_changes: Any = library.all_changes
        ) -> None:
            """Energy (eV) and forces (eV/Å) of the atoms."""
            super().calculate(atoms, properties, system_changes)
            for i, position in enumerate(atoms.get_positions().tolist()):  # the force field follows its conformer
                conformer.SetAtomPosition(i, position)
            field.Initialize()  # otherwise it reuses the distances of its last call
            gradient = np.array(field.CalcGrad()).reshape(-1, 3)
            self.results = {
                "energy": field.CalcEnergy() * EV_PER_KCAL_MOL,
                "forces": -gradient * EV_PER_KCAL_MOL,
            }

    calculator_class: Any = Mmff94
    return calculator_class()
