"""Molecules through RDKit: SMILES with a geometry from a force field, RDKit molecules, mol and sdf text.

A geometry from MMFF94 (T. A. Halgren, J. Comput. Chem. 17, 490 (1996)) is approximate: `uncertainty` is the median error of its
rotational constants, and notes name atoms for which the force field is known to fail.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.molecules.mmff_dipole import CHARGES_SOURCE, charges_note, mmff_dipole
from rotor.molecules.molecule import Molecule
from rotor.molecules.nuclei import isotope
from rotor.table import counted

# Median relative errors of rotational constants against experiment (the smallest constant of each molecule; NIST
# CCCBDB 22; tests/molecules/readers/test_smiles.py measures them again): 55 molecules of carbon with H, N, O, F, S, Cl, Br by MMFF94, of
# which a tenth are off by 6 % or more; the six for which only UFF has parameters; ten with hypervalent or cumulated
# atoms.
MMFF_UNCERTAINTY = 0.012
UFF_UNCERTAINTY = 0.10
DOUBTFUL_UNCERTAINTY = 0.2

CONFORMERS = 10
KJ_PER_KCAL = 4.184  # exact, the thermochemical calorie
SAME_KJ_PER_MOL = 0.1  # two conformers nearer than that in energy are one,
SAME_MOMENTS = 1e-3  # if their planar moments differ by no more than that, relative to the largest
NEAR_KJ_PER_MOL = 10.0  # 4 kT at 300 K: conformers that contribute to a spectrum
MOST_ATOMS = 200  # including hydrogens: 15 s; larger molecules take minutes and mostly fail
_SEED = 20240229  # any number; fixed, so that the same SMILES gives the same geometry
_MOST_STEPS = 5000


@dataclass(frozen=True)
class Conformer:
    """A geometry of a molecule, and its energy in kJ/mol above the lowest conformer of the same force field."""

    molecule: Molecule
    energy_kj_per_mol: float


def from_smiles(text: str) -> Molecule:
    """A molecule from SMILES or InChI: the lowest of ten ETKDG conformers, optimised with MMFF94.

    Isotopes are given by labels (`"[2H]O[2H]"`, `"[13CH4]"`). The dipole is estimated from the force field's charges. If MMFF94 has
    no parameters, UFF is used, with a note.

    Parameters
    ----------
    text : str
        SMILES of a single molecule or atom, without the prefix `SMILES:`, or its InChI.

    Returns
    -------
    Molecule
        `uncertainty` is the median relative error of rotational constants: 0.012 for MMFF94, 0.1 for UFF, and 0.2 for atoms at
        which the force fields fail (hypervalent atoms, cumulated double bonds), which `notes` name.

    Raises
    ------
    ValueError
        For an invalid SMILES, with RDKit's reason; several molecules; no force field; no geometry found.

    Examples
    --------
    >>> from_smiles("[2H]O[2H]").formula
    '[2H]2O'
    """
    distinct = conformers(text)
    near = sum(0 < conformer.energy_kj_per_mol < NEAR_KJ_PER_MOL for conformer in distinct)
    if not near:
        return distinct[0].molecule
    others = (
        f"the lowest conformer was taken; {near} more within {NEAR_KJ_PER_MOL:g} kJ/mol have different constants "
        "(rotor info --conformers lists them)"
    )
    return replace(distinct[0].molecule, notes=(*distinct[0].molecule.notes, others))


def conformers(text: str, count: int = CONFORMERS) -> tuple[Conformer, ...]:
    """The distinct conformers of a SMILES among `count` optimised ETKDG geometries, lowest first.

    Conformers are the same if their energies differ by less than 0.1 kJ/mol and their planar moments Σ m a², Σ m b², Σ m c² by less
    than 1e-3 of the largest. Mirror images are the same, since they have the same spectrum. Relative energies of a force field have
    errors of some kJ/mol and do not include zero-point energies.

    Parameters
    ----------
    text : str
        SMILES, as for `from_smiles`.
    count : int
        Number of trial geometries, at least 1; more make it likelier that the lowest conformer is found.

    Returns
    -------
    tuple of Conformer

    Raises
    ------
    ValueError
        As `from_smiles`; for a count below 1.

    Examples
    --------
    >>> [round(conformer.energy_kj_per_mol, 1) for conformer in conformers("CCCC")]
    [0.0, 3.3]
    """
    if count < 1:
        raise ValueError(f"{count} conformers: expected 1 or more")
    mol = _parsed(text)
    energies, field = _optimised(mol, text, count)
    typical, doubts = _trust(mol, field)
    lowest = min(energies)
    distinct: list[Conformer] = []
    shapes: list[tuple[float, Floats]] = []  # energies and planar moments of those
    for place in sorted(range(len(energies)), key=lambda i: energies[i]):
        energy = (energies[place] - lowest) * KJ_PER_KCAL
        if not np.isfinite(energy):  # its optimisation did not converge
            continue
        if distinct:
            shape = energy, _planar_moments(distinct[0].molecule.masses_u, mol.GetConformer(place).GetPositions())
            if any(_same_conformer(shape, other) for other in shapes):
                continue
        molecule = from_rdkit(mol, conformer=place, name=text)
        named = text if text.startswith("InChI=") else f"SMILES {text}"
        source = f"{named}: {field} geometry, of {counted(len(energies), 'conformer')}" if field else "one atom"
        conformer = Conformer(
            replace(molecule, source=source, uncertainty=typical, notes=(*doubts, *molecule.notes)), energy
        )
        distinct.append(conformer)
        shapes.append((energy, _planar_moments(conformer.molecule.masses_u, conformer.molecule.positions_angstrom)))
    return tuple(distinct)


def _same_conformer(first: tuple[float, Floats], other: tuple[float, Floats]) -> bool:
    """Whether energies and planar moments agree."""
    if abs(first[0] - other[0]) > SAME_KJ_PER_MOL:
        return False
    return bool(np.abs(first[1] - other[1]).max() <= SAME_MOMENTS * first[1].max())


def _planar_moments(masses_u: Floats, positions_angstrom: Floats) -> Floats:
    """Σ m a², Σ m b², Σ m c² in u Å², in decreasing order."""
    centred = positions_angstrom - masses_u @ positions_angstrom / masses_u.sum()
    weighted = np.sqrt(masses_u)[:, None] * centred
    return np.asarray(np.linalg.svd(weighted.T @ weighted, compute_uv=False))


def from_rdkit(mol: Any, conformer: int = -1, name: str = "") -> Molecule:
    """A molecule from an `rdkit.Chem.Mol` with hydrogens and a 3D conformer.

    Isotope labels and formal charges are preserved; the dipole is estimated from MMFF94 charges if available.
    Raises ValueError without a conformer, with a flat drawing for one, or with hydrogens left implicit.
    """
    from rdkit import rdBase

    with rdBase.BlockLogs():
        mol.UpdatePropertyCache(strict=False)
        _refuse_unfinished(mol)
        positions = np.array(mol.GetConformer(conformer).GetPositions())
        molecule = Molecule(
            symbols=tuple(atom.GetSymbol() for atom in mol.GetAtoms()),
            mass_numbers=tuple(atom.GetIsotope() or isotope(atom.GetSymbol()).mass_number for atom in mol.GetAtoms()),
            positions_angstrom=positions,
            charge=sum(atom.GetFormalCharge() for atom in mol.GetAtoms()),
            name=name,
            source="RDKit molecule",
            notes=_conformer_notes(mol.GetNumConformers()) if conformer < 0 else (),
        )
        return _with_dipole(molecule, mmff_dipole(mol, molecule))


def _conformer_notes(count: int) -> tuple[str, ...]:
    text = f"RDKit molecule of {count} conformers: the first is taken; another is Chem.Mol(molecule, confId=N)"
    return (text,) if count > 1 else ()


def parse_sdf(text: str, where: str = "sdf text") -> Molecule:
    """The molecule in the text of a mol or sdf file; isotope labels are preserved.

    Raises ValueError for text that RDKit cannot read, with its reason, for several molecules, a flat drawing, or
    missing hydrogens.
    """
    from rdkit import Chem, rdBase

    lines = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    blocks = [block for block in re.split(r"^\$\$\$\$.*$", lines, flags=re.M) if block.strip()]
    if len(blocks) != 1:
        entry = f"; {where}#1 is the first of them, and a scene whose molecule is this file runs all" if blocks else ""
        raise ValueError(f"{where}: {len(blocks)} molecules; expected a file with one{entry}")
    if "M  END" not in blocks[0]:
        raise ValueError(f"{where}: the line 'M  END' is missing; the file was cut or is no mol or sdf file")
    _refuse_bad_coordinates(blocks[0], where)
    with rdBase.BlockLogs(), rdBase.CaptureErrorLog() as log:
        mol = Chem.MolFromMolBlock(blocks[0], sanitize=False, removeHs=False)
    if mol is None:
        raise ValueError(f"{where}: not a mol or sdf file ({_reason(log.messages)}); write it as V2000 or V3000")
    try:
        molecule = from_rdkit(mol, name=mol.GetProp("_Name"))
    except ValueError as reason:
        raise ValueError(f"{where}: {reason}") from None
    return replace(molecule, source=where)


def _refuse_bad_coordinates(block: str, where: str) -> None:
    """Raise ValueError for invalid coordinates: RDKit reads a blank field, "0,58" and asterisks as zero."""
    for number, fields in _coordinate_fields(block.split("\n")):
        for field in fields:
            if not re.fullmatch(r"\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*", field):
                raise ValueError(
                    f"{where}, line {number}: {field!r} is not a coordinate; x y z of an atom are plain decimal "
                    "numbers in Å, in V2000 each ten characters wide"
                )


def _coordinate_fields(lines: list[str]) -> Iterator[tuple[int, list[str]]]:
    """Line number and texts of x, y, z of the atoms of a V2000 or V3000 block."""
    version = lines[3] if len(lines) > 3 else ""
    if "V2000" in version and version[:3].strip().isdecimal():
        for number, line in enumerate(lines[4 : 4 + int(version[:3])], start=5):
            yield number, [line[0:10], line[10:20], line[20:30]]
    elif "V3000" in version:
        inside = False
        for number, line in enumerate(lines, start=1):
            words = line.split()
            if words[2:4] in (["BEGIN", "ATOM"], ["END", "ATOM"]):
                inside = words[2] == "BEGIN"
            elif inside and words[:2] == ["M", "V30"]:
                yield number, [*words[4:7], "", "", ""][:3]


def _with_dipole(molecule: Molecule, dipole: Floats | None) -> Molecule:
    if dipole is None:
        return molecule
    return replace(
        molecule, dipole_debye=dipole, dipole_source=CHARGES_SOURCE, notes=(*molecule.notes, charges_note(molecule))
    )


def _reason(messages: str) -> str:
    """The first line of RDKit's log, without time, name and input."""
    said = [line for line in re.split(r"\s*\[\d\d:\d\d:\d\d\]\s*|\n", messages) if line.strip(" *")]
    first = said[0] if said else "RDKit gives no reason"
    return re.sub(r"^SMILES Parse Error: |( while parsing| for input):.*$", "", first)


def _parsed(text: str) -> Any:
    """RDKit's molecule with hydrogens; refuses several fragments."""
    from rdkit import Chem, rdBase

    if not text.strip():
        raise ValueError("SMILES: nothing follows the prefix; write for example 'SMILES:CO' for methanol")
    with rdBase.BlockLogs(), rdBase.CaptureErrorLog() as log:
        mol = (Chem.MolFromInchi if text.startswith("InChI=") else Chem.MolFromSmiles)(text)
    kind = "" if text.startswith("InChI=") else "SMILES "
    if mol is None or not mol.GetNumAtoms():
        place = re.search(r"position (\d+)", log.messages)
        at = f" at character {place[1]}" if place else ""
        raise ValueError(
            f"{kind}{text!r:.80} cannot be read{at}: {_reason(log.messages)}; correct it or give an xyz file"
        )
    if any(atom.GetAtomicNum() == 0 for atom in mol.GetAtoms()):
        raise ValueError(f"{kind}{text!r:.80}: '*' stands for any atom; write the element")
    if len(Chem.GetMolFrags(mol)) > 1:
        raise ValueError(f"{kind}{text!r:.80} has several molecules; give one, or their geometry as an xyz file")
    whole = Chem.AddHs(mol)
    if whole.GetNumAtoms() > MOST_ATOMS:
        raise ValueError(
            f"{kind}{text!r:.80}: {whole.GetNumAtoms()} atoms with their hydrogens, but conformers are searched for at most "
            f"{MOST_ATOMS}; give the geometry as an xyz file"
        )
    return whole


def _optimised(mol: Any, text: str, count: int) -> tuple[list[float], str]:
    """Embed conformers in `mol` and optimise them; energies in kcal/mol and the name of the force field."""
    from rdkit import rdBase
    from rdkit.Chem import rdDistGeom, rdForceFieldHelpers

    with rdBase.BlockLogs(), rdBase.CaptureErrorLog() as log:
        settings: Any = rdDistGeom.ETKDGv3()
        settings.randomSeed = _SEED
        if not len(rdDistGeom.EmbedMultipleConfs(mol, count, settings)):
            raise ValueError(f"SMILES {text!r}: no geometry found ({_reason(log.messages)}); give an xyz file")
        if mol.GetNumAtoms() == 1:
            return [0.0], ""
        optimise: Any
        if rdForceFieldHelpers.MMFFHasAllMoleculeParams(mol):
            field, optimise = "MMFF94", rdForceFieldHelpers.MMFFOptimizeMoleculeConfs
        elif rdForceFieldHelpers.UFFHasAllMoleculeParams(mol):
            field, optimise = "UFF", rdForceFieldHelpers.UFFOptimizeMoleculeConfs
        else:
            raise ValueError(f"SMILES {text!r}: neither MMFF94 nor UFF has parameters for its atoms; give an xyz file")
        try:
            results = optimise(mol, maxIters=_MOST_STEPS)
        except RuntimeError:  # RDKit's own checks, such as of forces that are not finite
            raise ValueError(f"SMILES {text!r}: {field} fails on its geometry; give an xyz file") from None
    energies = [energy if not unfinished else np.inf for unfinished, energy in results]
    if not np.isfinite(energies).any():
        raise ValueError(f"SMILES {text!r}: {field} did not converge in {_MOST_STEPS} steps; give an xyz file")
    return energies, field


def _trust(mol: Any, field: str) -> tuple[float | None, tuple[str, ...]]:
    """Typical relative error of the rotational constants, and notes on it."""
    if not field:
        return None, ()
    notes = ["MMFF94 lacks parameters for this molecule: UFF was used"] if field == "UFF" else []
    doubtful = [f"{atom.GetSymbol()} (atom {atom.GetIdx() + 1})" for atom in mol.GetAtoms() if _is_doubtful(atom)]
    if doubtful:
        warning = (
            f"WARNING: geometry from {field} with hypervalent or cumulated {', '.join(doubtful)}: errors of 17 to 38 % "
            "were seen in the constants of such molecules; use a geometry from experiment or quantum chemistry"
        )
        return DOUBTFUL_UNCERTAINTY, (warning, *notes, *_stereo_note(mol))
    typical = MMFF_UNCERTAINTY if field == "MMFF94" else UFF_UNCERTAINTY
    tail = ", a tenth by more than 6 %" if field == "MMFF94" else ""
    notes.append(
        f"geometry from {field}, not measured: half of such constants are wrong by {typical:.1%} or more{tail}"
    )
    return typical, (*notes, *_stereo_note(mol))


def _is_doubtful(atom: Any) -> bool:
    """Whether an atom of the third row or below exceeds its lowest valence, or any atom has two double bonds."""
    from rdkit import Chem

    doubles = sum(bond.GetBondType() == Chem.BondType.DOUBLE for bond in atom.GetBonds())
    usual = Chem.GetPeriodicTable().GetDefaultValence(atom.GetAtomicNum())
    hypervalent = atom.GetAtomicNum() > 10 and 0 <= usual < atom.GetTotalValence()
    return bool(doubles > 1 or hypervalent)


def _stereo_note(mol: Any) -> tuple[str, ...]:
    """A note if the SMILES does not distinguish diastereomers (a single open centre gives mirror images only)."""
    from rdkit import Chem

    kinds = Chem.StereoType
    open_stereo = [s for s in Chem.FindPotentialStereo(mol) if s.specified == Chem.StereoSpecified.Unspecified]
    bonds = sum(s.type == kinds.Bond_Double for s in open_stereo)
    centres = sum(s.type == kinds.Atom_Tetrahedral for s in open_stereo)
    if not bonds and centres < 2:
        return ()
    return ("the SMILES leaves the configuration open (/ \\ or @): the conformer of lowest energy was taken",)


def _refuse_unfinished(mol: Any) -> None:
    """Raise ValueError for a molecule without atoms, 3D positions or hydrogens."""
    if not mol.GetNumAtoms():
        raise ValueError("a molecule without atoms: give one atom or more")
    if not mol.GetNumConformers():
        raise ValueError("RDKit molecule without a conformer: embed one (rdkit.Chem.AllChem.EmbedMolecule)")
    if not mol.GetConformer().Is3D() and mol.GetNumAtoms() > 1:
        raise ValueError("a flat drawing (2D), not a geometry: give 3D positions, or the molecule as 'SMILES:...'")
    missing = sum(atom.GetTotalNumHs(includeNeighbors=False) for atom in mol.GetAtoms())
    if missing:
        raise ValueError(f"{missing} hydrogen atoms are implied but have no position: add them with their positions")
