"""A harmonic force field: the Hessian of a molecule at its minimum, and its vibrations.

Near the minimum the potential is V = ½ xᵀ F x with the 3n displacements x. Centrifugal distortion from a force field is in
`rotor.tops.distortion`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats, symmetric_from_lower
from rotor.molecules.molecule import Molecule
from rotor.units import (
    ATOMIC_MASS_KG,
    BOHR_RADIUS_ANGSTROM,
    ELEMENTARY_CHARGE_C,
    HARTREE_EV,
    SPEED_OF_LIGHT_M_PER_S,
)

EV_PER_ANGSTROM2 = {  # one of each unit in eV/Å²
    "eV/Å²": 1.0,
    "hartree/bohr²": HARTREE_EV / BOHR_RADIUS_ANGSTROM**2,
    "mdyn/Å": 1e-18 / ELEMENTARY_CHARGE_C,  # 1 mdyn/Å = 100 N/m = 1e-18 J/Å²
}
_UNIT_NAMES = {"eV/A2": "eV/Å²", "hartree/bohr2": "hartree/bohr²", "mdyn/A": "mdyn/Å"}
_WAVENUMBER = np.sqrt(ELEMENTARY_CHARGE_C * 1e20 / ATOMIC_MASS_KG) / (200 * np.pi * SPEED_OF_LIGHT_M_PER_S)

LOPSIDED = 1e-3  # largest asymmetry of a Hessian, relative to its largest element
LEFT_OVER_CM = 100.0  # a stiffer translation or rotation means that the Hessian belongs to another geometry


@dataclass(frozen=True, eq=False)
class Vibrations:
    """Harmonic vibrations.

    wavenumbers_cm : (m,) increasing, m = 3n - 6 or 3n - 5
    modes : (3n, m) mass-weighted displacements, orthonormal, x_i √m_i
    stiffness_ev : (m,) eigenvalues λ of the mass-weighted Hessian, eV/(u Å²); V = ½ λ Q²
    left_over_cm : the stiffest translation or rotation; 0 for a Hessian at an exact minimum
    """

    wavenumbers_cm: Floats
    modes: Floats
    stiffness_ev: Floats
    left_over_cm: float


@dataclass(frozen=True, eq=False)
class ForceField:
    """A molecule at its minimum and the Hessian there.

    hessian_ev_per_angstrom2 : (3n, 3n) array in the frame of the positions, rows and columns x1 y1 z1 x2 ...
    source : origin of the Hessian

    Raises ValueError for a Hessian of another shape, with numbers that are not finite, or asymmetric by more than 1e-3
    of its largest element (smaller asymmetries are averaged).
    """

    molecule: Molecule
    hessian_ev_per_angstrom2: Floats
    source: str = ""

    def __post_init__(self) -> None:
        size = 3 * len(self.molecule.symbols)
        hessian = np.array(self.hessian_ev_per_angstrom2, dtype=np.float64)
        if hessian.shape != (size, size) or not np.isfinite(hessian).all():
            raise ValueError(
                f"Hessian of shape {hessian.shape}: expected {size} x {size} finite numbers for {self.molecule.formula}"
            )
        lopsided = float(np.abs(hessian - hessian.T).max())
        if lopsided > LOPSIDED * float(np.abs(hessian).max()):
            raise ValueError(
                f"the Hessian differs from its transpose by up to {lopsided:.3g} eV/Å²: it is not a Hessian, or its rows are out of order"
            )
        hessian = (hessian + hessian.T) / 2
        hessian.setflags(write=False)
        object.__setattr__(self, "hessian_ev_per_angstrom2", hessian)

    def with_isotopes(self, changes: Mapping[int | str, str] | str) -> ForceField:
        """This force field with other isotopes: it does not change in the Born-Oppenheimer approximation."""
        return replace(self, molecule=self.molecule.with_isotopes(changes))

    def vibrations(self) -> Vibrations:
        """Wavenumbers and modes, translations and rotations projected out.

        ω = √λ / 2πc with the eigenvalues λ of M^(-1/2) F M^(-1/2) (E. B. Wilson, J. C. Decius and P. C. Cross,
        Molecular Vibrations (1955), § 2-2). Raises ValueError if a vibration has a negative λ (no minimum), or if a projected
        motion is stiffer than 100 cm⁻¹ (the Hessian belongs to another geometry, or there are forces).
        """
        roots = np.sqrt(np.repeat(self.molecule.masses_u, 3))
        weighted = self.hessian_ev_per_angstrom2 / np.outer(roots, roots)
        rigid = rigid_motions(self.molecule)
        left_over = np.abs(np.linalg.eigvalsh(rigid.T @ weighted @ rigid)).max()
        left_over_cm = float(np.sqrt(left_over) * _WAVENUMBER)
        if left_over_cm > LEFT_OVER_CM:
            raise ValueError(
                f"rotation or translation changes the energy of this Hessian, by {left_over_cm:.0f} cm⁻¹ "
                f"(at most {LEFT_OVER_CM:.0f}): it belongs to another geometry, frame or order of atoms"
            )
        inside = np.linalg.svd(rigid, full_matrices=True)[0][:, rigid.shape[1] :]
        stiffness, vectors = np.linalg.eigh(inside.T @ weighted @ inside)
        if len(stiffness) and stiffness[0] <= 0:
            raise ValueError(
                f"a vibration of {_wavenumber(stiffness[0]):.0f}i cm⁻¹: the geometry is not a minimum; optimise it first"
            )
        return Vibrations(_wavenumber(stiffness), inside @ vectors, stiffness, left_over_cm)


def _wavenumber(stiffness: Any) -> Any:
    return np.sqrt(np.abs(stiffness)) * _WAVENUMBER


def rigid_motions(molecule: Molecule) -> Floats:
    """Translations and rotations as orthonormal mass-weighted displacements (3n, 6), or (3n, 5) of a linear molecule."""
    roots = np.sqrt(molecule.masses_u)
    positions = molecule.positions_angstrom - molecule.centre_of_mass_angstrom
    shifts = [np.outer(roots, axis) for axis in np.eye(3)]
    turns = [roots[:, None] * np.cross(axis, positions) for axis in np.eye(3)]
    vectors = np.array([motion.ravel() for motion in (*shifts, *turns)]).T
    left, sizes, _ = np.linalg.svd(vectors / np.maximum(np.linalg.norm(vectors, axis=0), 1e-12), full_matrices=False)
    return np.asarray(left[:, sizes > 1e-4 * sizes[0]])


def force_field_from_calculator(
    molecule: Molecule, calculator: Any, *, step_angstrom: float = 0.005, most_force_ev_per_angstrom: float = 0.02
) -> ForceField:
    """The force field of a molecule at its minimum from an ASE calculator, by central differences of the forces.

    F_ij = -[f_j(x_i + h) - f_j(x_i - h)] / 2h, 6n calls.

    Parameters
    ----------
    molecule : Molecule
        At its minimum, n atoms.
    calculator : ase.calculators.calculator.Calculator
        A calculator with forces.
    step_angstrom : float, optional
        The step h.
    most_force_ev_per_angstrom : float, optional
        The largest component of a force that counts as zero at the minimum.

    Returns
    -------
    ForceField
        Hessian (3n, 3n) in eV/Å².

    Raises
    ------
    ValueError
        If the forces at the geometry exceed `most_force_ev_per_angstrom`: refine it first (`rotor.api.refine`).

    Notes
    -----
    The error of order h² times the fourth derivative is neglected.
    """
    from rotor.molecules.optimise import ase_atoms

    atoms = ase_atoms(molecule)
    atoms.calc = calculator
    rest = float(np.abs(atoms.get_forces()).max())
    if not rest <= most_force_ev_per_angstrom:
        raise ValueError(
            f"a force of {rest:.3g} eV/Å on an atom of {molecule.formula} (at most {most_force_ev_per_angstrom:g}): "
            "the geometry is not a minimum of this calculator; refine it first (rotor.api.refine)"
        )
    start = atoms.get_positions()
    rows = []
    for coordinate in range(start.size):
        ahead, behind = (_forces(atoms, start, coordinate, sign * step_angstrom) for sign in (1, -1))
        rows.append((behind - ahead) / (2 * step_angstrom))
    name = type(calculator).__name__
    return ForceField(molecule, np.array(rows), f"{name}, central differences of forces, step {step_angstrom:g} Å")


def _forces(atoms: Any, start: Floats, coordinate: int, step: float) -> Floats:
    moved = start.copy()
    moved.flat[coordinate] += step
    atoms.set_positions(moved)
    return np.asarray(atoms.get_forces(), dtype=np.float64).ravel()


def read_hessian(path: str | os.PathLike[str], molecule: Molecule, *, unit: str = "hartree/bohr²") -> ForceField:
    """Read a force field from a text file: all (3n)² elements by rows, or the lower triangle by rows.

    Lines that start with # are comments. unit : "hartree/bohr²", "eV/Å²" or "mdyn/Å". The molecule must be that of the
    calculation, in its frame. Raises ValueError, with the line, for invalid numbers (asterisks, D exponents), and for
    a wrong number of elements.
    """
    unit = _UNIT_NAMES.get(unit, unit)
    if unit not in EV_PER_ANGSTROM2:
        raise ValueError(f"unit {unit!r} of a Hessian: expected one of {', '.join(EV_PER_ANGSTROM2)}")
    numbers: list[float] = []
    for count, line in enumerate(Path(path).read_text(encoding="utf-8-sig").splitlines(), start=1):
        if not line.lstrip().startswith("#"):
            numbers += [_number(field, f"{path}, line {count}") for field in line.replace(",", " ").split()]
    hessian = _square(np.array(numbers), 3 * len(molecule.symbols), str(path))
    return ForceField(molecule, hessian * EV_PER_ANGSTROM2[unit], f"{path}, {unit}")


def _number(field: str, where: str) -> float:
    if re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)[dD][+-]?\d+", field):
        raise ValueError(f"{where}: {field!r} has a Fortran exponent; write {field.upper().replace('D', 'E')!r}")
    if not re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", field):
        raise ValueError(f"{where}: {field!r} is no plain decimal number")
    return float(field)


def _square(numbers: Floats, size: int, where: str) -> Floats:
    if len(numbers) == size**2:
        return numbers.reshape(size, size)
    if len(numbers) == size * (size + 1) // 2:
        square = np.zeros((size, size))
        square[np.tril_indices(size)] = numbers
        return symmetric_from_lower(square)
    raise ValueError(
        f"{where}: {len(numbers)} numbers; a Hessian of {size} coordinates has {size**2}, its lower triangle "
        f"{size * (size + 1) // 2}: the file was cut, or belongs to another molecule"
    )


def force_field_from_internal(
    molecule: Molecule, coordinates: Any, constants_mdyn_angstrom: ArrayLike, *, source: str = ""
) -> ForceField:
    """The force field of published force constants in internal coordinates, F_x = Bᵀ F B at the minimum.

    Parameters
    ----------
    molecule : Molecule
        At its minimum, n atoms.
    coordinates : sequence of callable
        m functions of the positions (n, 3), from `rotor.molecules.internal_coordinates`.
    constants_mdyn_angstrom : (m, m) array
        Between stretches mdyn/Å, between angles mdyn Å, between both mdyn.
    source : str, optional
        Origin of the constants.

    Returns
    -------
    ForceField
        Hessian (3n, 3n) in eV/Å².

    Raises
    ------
    ValueError
        For constants of the wrong shape.

    Notes
    -----
    Source: Wilson, Decius and Cross (1955), § 4-2; B is exact to round-off.

    Examples
    --------
    >>> from rotor.molecules.internal_coordinates import stretch
    >>> co = Molecule(("C", "O"), [[0, 0, 0], [0, 0, 1.1282]])
    >>> field = force_field_from_internal(co, [stretch(0, 1)], [[19.019]])
    >>> round(float(field.vibrations().wavenumbers_cm[0]), 1)
    2169.8
    """
    from rotor.molecules.internal_coordinates import wilson_b

    constants = np.asarray(constants_mdyn_angstrom, dtype=np.float64)
    if constants.shape != (len(coordinates),) * 2:
        raise ValueError(f"force constants of shape {constants.shape} for {len(coordinates)} internal coordinates")
    b = wilson_b(coordinates, molecule.positions_angstrom)
    return ForceField(molecule, b.T @ constants @ b * EV_PER_ANGSTROM2["mdyn/Å"], source or "internal force constants")
