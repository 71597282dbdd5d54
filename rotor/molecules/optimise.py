"""Optimisation of a geometry with an ASE calculator; a search that does not converge is an error."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np

from rotor.molecules.molecule import Molecule
from rotor.table import counted
from rotor.units import DEBYE_PER_E_ANGSTROM

MOST_FORCE_EV_PER_ANGSTROM = 1e-3  # largest force on an atom of an optimised geometry
MOST_STEPS = 500
_INSTALLED_SEPARATELY = {"tblite": "tblite.ase", "xtb": "xtb.ase.calculator"}
_CLASS_NAMES = {"tblite": "TBLite", "xtb": "XTB"}
_SETTINGS = {"tblite": {"verbosity": 0}, "xtb": {}}  # by default tblite writes each cycle to standard output
_NOT_FOR_MOLECULES = {
    "emt": "EMT is a potential for metals; its forces on C, N, O and H are for tests of programs, not for geometries",
    "lj": "equal Lennard-Jones parameters for all atoms do not bind a molecule; build the calculator in Python",
    "morse": "one Morse parameter for all atoms is no molecule; build the calculator in Python",
    "tip3p": "TIP3P holds water rigid, so that there is nothing to optimise",
    "tip4p": "TIP4P holds water rigid, so that there is nothing to optimise",
}


def ase_atoms(molecule: Molecule) -> Any:
    """The molecule as `ase.Atoms`, with its isotopic masses and its charge (on the first atom)."""
    from ase import Atoms

    charges = [float(molecule.charge)] + [0.0] * (len(molecule.symbols) - 1)
    return Atoms(
        list(molecule.symbols), positions=molecule.positions_angstrom, masses=molecule.masses_u, charges=charges
    )


def refine(
    molecule: Molecule,
    calculator: Any,
    *,
    most_force_ev_per_angstrom: float = MOST_FORCE_EV_PER_ANGSTROM,
    most_steps: int = MOST_STEPS,
) -> Molecule:
    """The molecule at the nearest minimum of an ASE calculator, by BFGS.

    Parameters
    ----------
    molecule : Molecule
        Start of the search.
    calculator : ASE calculator or str
        A calculator with forces, or a name for `calculator_by_name`.
    most_force_ev_per_angstrom : float
        Convergence limit: largest force on an atom.
    most_steps : int
        Largest number of steps.

    Returns
    -------
    Molecule
        With the new positions. The dipole is the calculator's, or unknown, since the frame has changed. A note gives the number of
        steps and the remaining force; the uncertainty of the constants is unknown.

    Raises
    ------
    ValueError
        If the search does not converge, or the calculator fails.

    Examples
    --------
    >>> from ase.calculators.lj import LennardJones
    >>> pair = Molecule(("Ar", "Ar"), [[0, 0, 0], [0, 0, 1.3]])
    >>> near = refine(pair, LennardJones(rc=100.0, smooth=False), most_force_ev_per_angstrom=1e-6)
    >>> round(float(near.positions_angstrom[1, 2] - near.positions_angstrom[0, 2]), 4), round(2 ** (1 / 6), 4)
    (1.1225, 1.1225)
    """
    from ase.optimize import BFGS

    if isinstance(calculator, str):
        calculator = calculator_by_name(calculator)
    name = type(calculator).__name__
    atoms = ase_atoms(molecule)
    atoms.calc = calculator
    search: Any = BFGS(atoms, logfile=None)
    try:
        converged = search.run(fmax=most_force_ev_per_angstrom, steps=most_steps)
        left = float(np.linalg.norm(atoms.get_forces(), axis=1).max())
    except (
        Exception
    ) as reason:  # calculators raise exceptions of any class; all mean that it cannot treat this molecule
        raise ValueError(f"{name} fails for {molecule.formula}: {reason or type(reason).__name__}") from reason
    if not converged:
        raise ValueError(
            f"{name} did not bring {molecule.formula} to a minimum in {most_steps} steps: a force of {left:.3g} eV/Å is "
            f"left, expected at most {most_force_ev_per_angstrom:g}; start nearer, or allow more steps or a larger force"
        )
    note = f"geometry refined with {name} by BFGS in {counted(search.get_number_of_steps(), 'step')}; largest force left {left:.2g} eV/Å"
    return _refined(molecule, atoms, name, note)


def _refined(molecule: Molecule, atoms: Any, name: str, note: str) -> Molecule:
    dipole = atoms.calc.results.get("dipole")
    return replace(
        molecule,
        positions_angstrom=atoms.get_positions(),
        dipole_debye=None if dipole is None else np.asarray(dipole, dtype=float) * DEBYE_PER_E_ANGSTROM,
        dipole_source="" if dipole is None else name,
        polarizability_angstrom3=None,
        source=f"{name}, from {molecule.source or 'a geometry without source'}",
        uncertainty=None,
        notes=(note,),
    )


def calculator_by_name(name: str) -> Any:
    """An ASE calculator with default settings, by its name in ASE, or `tblite`, `xtb` if installed.

    Raises ValueError, with a reason, for an unknown name, a program that is not installed or set up, and potentials that are
    not for molecules (such as EMT).
    """
    library: Any = import_module("ase.calculators.calculator")
    key, names = name.strip().lower(), library.names
    if key in _NOT_FOR_MOLECULES:
        raise ValueError(f"calculator {name!r}: {_NOT_FOR_MOLECULES[key]}")
    if key not in (*names, *_INSTALLED_SEPARATELY):
        available = ", ".join(sorted({*names, *_INSTALLED_SEPARATELY} - {*_NOT_FOR_MOLECULES}))
        raise ValueError(f"calculator {name!r} is unknown to ASE; known are {available}")
    try:
        return _separate(key) if key in _INSTALLED_SEPARATELY else library.get_calculator_class(key)()
    except Exception as reason:  # a missing import, configuration or program: the calculator is not available
        raise ValueError(
            f"calculator {name!r} cannot be built here ({' '.join(str(reason).split()) or type(reason).__name__}); install "
            "and set it up, or build it in Python and give it to rotor.api.refine"
        ) from reason


def _separate(key: str) -> Any:
    return getattr(import_module(_INSTALLED_SEPARATELY[key]), _CLASS_NAMES[key])(**_SETTINGS[key])
