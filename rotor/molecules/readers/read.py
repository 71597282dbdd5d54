"""Read a molecule from SMILES, InChI, xyz, sdf, a file that ASE reads, ASE and RDKit objects, or a g2 name."""

import difflib
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rotor.checks import require_file
from rotor.molecules.molecule import Molecule
from rotor.molecules.nuclei import element_symbol, isotope, isotope_by_mass
from rotor.molecules.readers.quantum_chemistry import WITHOUT_CCLIB, has_cclib, is_output, needs_no_cclib, read_output
from rotor.molecules.readers.sdf_entries import BUILT, entry_bytes, parse_entry
from rotor.molecules.readers.smiles import from_rdkit, from_smiles, parse_sdf
from rotor.molecules.readers.xyz import decode, parse_xyz
from rotor.units import DEBYE_PER_E_ANGSTROM

_SDF_SUFFIXES = (".mol", ".sdf", ".sd", ".mdl")
_OUTPUT_SUFFIXES = (".log", ".out", ".dat", ".c4", ".g09", ".g16")


def read_molecule(source: Any, *, isotopes: dict[int | str, str] | str | None = None) -> Molecule:
    """The molecule of a text, path or object.

    Parameters
    ----------
    source : str, Path, Molecule, ase.Atoms or rdkit.Chem.Mol
        `"SMILES:CO"` (methanol); an InChI; the path of an xyz, mol or sdf file, or of another that `ase.io.read` knows;
        `"-"` for xyz or sdf text on standard input; a name of ASE's g2 set (`"H2O"`).
    isotopes : mapping or str, optional
        Substitutions for `Molecule.with_isotopes`, such as `"1=2H"` or `{"O": "18O"}`.

    Returns
    -------
    Molecule
        With the source of the geometry; `notes` list assumptions.

    Raises
    ------
    ValueError
        With the position and text of the mistake, the rule, and the remedy.

    Examples
    --------
    >>> read_molecule("H2O", isotopes="O=18O").formula
    'H2[18O]'
    """
    molecule = _read(source)
    return molecule if not isotopes else molecule.with_isotopes(isotopes)


def _read(source: Any) -> Molecule:
    if isinstance(source, Molecule):
        return source
    if isinstance(source, Path):
        return _read_file(source)
    if isinstance(source, str):
        return _read_word(source)
    if hasattr(source, "get_atomic_numbers"):
        return from_ase(source)
    if hasattr(source, "GetConformer"):
        return from_rdkit(source)
    raise ValueError(
        f"a {type(source).__name__} is not a molecule: give a path, 'SMILES:...', a name, ase.Atoms or an RDKit molecule"
    )


def _read_word(word: str) -> Molecule:
    if word == "-":
        return parse_molecule(decode(sys.stdin.buffer.read(), "standard input"), "standard input")
    if word.startswith(BUILT):
        return from_smiles(word.removeprefix("SMILES:").strip())
    path = Path(word)
    if parse_entry(word) is not None:
        return _read_file(path)
    if not path.is_file():
        return g2_molecule(word)
    if word in g2_names():
        raise ValueError(f"{word!r} is a file here and a molecule of ASE's g2; write './{word}' for the file")
    return _read_file(path)


def _read_file(path: Path) -> Molecule:
    entry = parse_entry(str(path))
    if entry is not None:
        molecule = parse_sdf(decode(entry_bytes(*entry), str(path)), str(path))
        return molecule if molecule.name else replace(molecule, name=f"{entry[0].stem}_{entry[1]}")
    require_file(path, "give one in xyz, mol or sdf, or in another format that ASE reads")
    suffix = path.suffix.lower()
    if suffix in (".xyz", ".extxyz"):
        molecule = parse_xyz(decode(path.read_bytes(), str(path)), str(path))
    elif suffix in _SDF_SUFFIXES:
        molecule = parse_sdf(decode(path.read_bytes(), str(path)), str(path))
    elif suffix in _OUTPUT_SUFFIXES and is_output(path):
        whole = has_cclib() or needs_no_cclib(path)
        molecule = read_output(path) if whole else _output_without_cclib(path)
    else:
        molecule = _read_with_ase(path)
    return molecule if molecule.name else replace(molecule, name=path.stem)


def parse_molecule(text: str, where: str) -> Molecule:
    """The molecule in xyz or sdf text; sdf has the line `M  END` or the version on the fourth line."""
    head = text.splitlines()[:4]
    if "M  END" in text or (len(head) == 4 and head[3].rstrip().endswith(("V2000", "V3000"))):
        return parse_sdf(text, where)
    return parse_xyz(text, where)


def _output_without_cclib(path: Path) -> Molecule:
    """The data that ASE reads from a quantum-chemistry output, with a note on what cclib would add or check."""
    try:
        molecule = _read_with_ase(path)
    except ValueError as reason:
        raise ValueError(f"{reason}; {WITHOUT_CCLIB}") from None
    note = f"{path}: {WITHOUT_CCLIB}; with it, rotor also reads the polarizability and checks the printed constants and the end of the file"
    return replace(molecule, notes=(*molecule.notes, note))


def _read_with_ase(path: Path) -> Molecule:
    """The last structure of a file in one of ASE's formats (the optimised one of an optimisation)."""
    from rotor.molecules.readers.ase_files import structures

    frames = structures(path)
    if not frames:
        raise ValueError(f"{path}: no structure in it; give a file with one")
    try:
        molecule = from_ase(frames[-1])
    except ValueError as reason:
        raise ValueError(f"{path}: {reason}") from None
    several = (f"{path} holds {len(frames)} structures: the last one was taken",) if len(frames) > 1 else ()
    return replace(molecule, source=f"{path}, read with ASE", notes=(*several, *molecule.notes))


def from_ase(atoms: Any) -> Molecule:
    """A molecule from `ase.Atoms`.

    Masses set by the user select isotopes (within 0.01 u); ASE's average masses mean the most abundant ones. The dipole is
    `info["dipole"]` or a calculator's finished result (e Å); the charge is `info["charge"]` or the sum of initial charges. Tags and
    constraints are ignored; a periodic cell gives a note.

    >>> import ase
    >>> from_ase(ase.Atoms("HCl", [(0, 0, 0), (0, 0, 1.2746)], masses=[2.014, 34.969])).formula
    'Cl[2H]'
    """
    symbols = tuple(element_symbol(int(number)) for number in atoms.get_atomic_numbers())
    dipole = _ase_dipole(atoms)
    charge = atoms.info.get("charge", round(float(np.sum(atoms.get_initial_charges())), 6))
    periodic = "the periodic cell was not used: a molecule that crosses its edge is torn; make it whole first"
    return Molecule(
        symbols=symbols,
        mass_numbers=_ase_mass_numbers(atoms, symbols),
        positions_angstrom=atoms.get_positions(),
        charge=charge,
        dipole_debye=None if dipole is None else np.asarray(dipole, dtype=float) * DEBYE_PER_E_ANGSTROM,
        dipole_source="" if dipole is None else "ASE Atoms (e Å)",
        source="ASE Atoms",
        notes=(periodic,) if np.any(atoms.pbc) else (),
    )


def _ase_dipole(atoms: Any) -> Any:
    """The dipole stored with the atoms, in e Å; nothing is calculated."""
    if "dipole" in atoms.info:
        return atoms.info["dipole"]
    if atoms.calc is None or "dipole" not in getattr(atoms.calc, "results", {}):
        return None
    return atoms.calc.get_property("dipole", atoms, allow_calculation=False)


def _ase_mass_numbers(atoms: Any, symbols: tuple[str, ...]) -> tuple[int, ...]:
    """Mass numbers from the masses of the atoms; ASE's average masses mean the most abundant isotopes."""
    from ase.data import atomic_masses

    if not atoms.has("masses"):
        return ()
    numbers = []
    for i, (symbol, mass) in enumerate(zip(symbols, atoms.get_masses(), strict=True)):
        if abs(mass - atomic_masses[atoms.numbers[i]]) < 1e-6:
            numbers.append(isotope(symbol).mass_number)
            continue
        try:
            numbers.append(isotope_by_mass(symbol, float(mass)).mass_number)
        except ValueError as reason:
            raise ValueError(f"atom {i + 1}: {reason}") from None
    return tuple(numbers)


def g2_names() -> tuple[str, ...]:
    """Names of the molecules of ASE's g2 collection (G2/97), in alphabetical order."""
    from ase.collections import g2

    return tuple(sorted(g2.names))


def g2_molecule(name: str) -> Molecule:
    """A molecule of ASE's g2 set: geometries from MP2(full)/6-31G*.

    Median error of the rotational constants 2 % (22 molecules of NIST CCCBDB).
    L. A. Curtiss, K. Raghavachari, P. C. Redfern, J. A. Pople, J. Chem. Phys. 106, 1063 (1997). Raises ValueError, with near
    matches, for other names.

    >>> g2_molecule("CH3Cl").formula
    'CH3Cl'
    """
    from ase.collections import g2

    names = g2_names()
    if name not in names:
        same = [candidate for candidate in names if candidate.lower() == name.lower()]
        near = list(dict.fromkeys([*same, *difflib.get_close_matches(name, names, n=5, cutoff=0.5)]))
        hint = f" (near it: {', '.join(near)})" if near else ""
        raise ValueError(
            f"{name!r} is neither a file nor a molecule of ASE's g2{hint}; give a path, or 'SMILES:...' for a SMILES"
        )
    atoms = g2[name]
    unpaired = round(float(sum(atoms.get_initial_magnetic_moments())))  # the collection gives those of the ground state
    molecule = from_ase(atoms)
    return replace(
        molecule,
        name=name,
        multiplicity=unpaired + 1,
        source="ASE g2: MP2(full)/6-31G*, Curtiss et al. 1997",
        uncertainty=0.02,
    )
