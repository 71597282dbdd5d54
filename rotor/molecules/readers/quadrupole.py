"""Quadrupole couplings printed by Gaussian with `output=pickett`: χ_ij = e Q q_ij/h in MHz, with the Q of the isotope.

     Nuclear quadrupole coupling constants [Chi] (MHz):
     3  N(14)
       aa=     2.5734   ba=     0.0094   ca=    -0.0000
       ab=     0.0094   bb=     2.3852   cb=    -0.0000
       ac=    -0.0000   bc=    -0.0000   cc=    -4.9586

The letters denote columns of the table "Principal axis orientation:", which need not be a, b, c in order of the moments (the example,
from K. L. K. Lee's page "Gaussian Recipes for Rotational Spectroscopy", has cc along a). The axes are therefore found by superposing
that table on the geometry, and checked with the dipole printed below the couplings. If the check fails, the couplings are left out, with
a note.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from rotor.arrays import Floats
from rotor.geometry.superposition import Superposition, superpose
from rotor.molecules.molecule import Molecule
from rotor.molecules.nuclei import Isotope
from rotor.molecules.readers.programs import Output

TABLE, COUPLINGS, DIPOLE = (
    "Principal axis orientation:",
    "Nuclear quadrupole coupling constants [Chi] (MHz):",
    "Dipole moment (Debye):",
)
ROWS_AFTER = 5  # lines from the head of the table to the first atom
SAME_GEOMETRY_ANGSTROM = 1e-3  # rmsd
SAME_DIPOLE_DEBYE = 5e-3  # printed twice, once rounded to 1e-4 D
_NUCLEUS = re.compile(r"\s*(\d+)\s+([A-Z][a-z]?)\((\d+)\)\s*$")
_NUMBER = re.compile(r"[a-c]{2}=\s*([-+]?\d+\.\d+)")


def with_quadrupole(molecule: Molecule, output: Output) -> Molecule:
    """The molecule with the quadrupole couplings of an output (MHz, axes of the geometry), or with a note why they are left out."""
    start, table = output.last((COUPLINGS,)), output.last((TABLE,))
    if output.program.name != "Gaussian" or start is None:
        return molecule
    fit = None if table is None else _axes(output, table, molecule)
    if fit is None:
        return _noted(molecule, output, start, "stand in axes that no table of the same geometry says")
    if not _dipole_agrees(molecule, output, start, fit):
        return _noted(molecule, output, start, "stand beside a dipole that is not the molecule's in the same axes")
    couplings = {}
    for atom, (symbol, mass_number), tensor in _tensors(output, start):
        nucleus: Isotope = molecule.nuclei[atom - 1]
        if (nucleus.symbol, nucleus.mass_number) != (symbol, mass_number):
            return _noted(molecule, output, start, f"are of {mass_number}{symbol}, atom {atom} is {nucleus.label}")
        turned = fit.rotation @ tensor @ fit.rotation.T
        couplings[atom] = (turned + turned.T) / 2 - np.eye(3) * np.trace(turned) / 3
    source = f"{output.program.name}, {output.where}"
    return replace(molecule, quadrupole_mhz=couplings, quadrupole_source=source)


def _axes(output: Output, table: int, molecule: Molecule) -> Superposition | None:
    """Rotation and translation from the axes of a printed table of atoms to those of the geometry; None if they do not match."""
    rows = []
    for line in output.lines[table + ROWS_AFTER :]:
        words = line.split()
        if len(words) < 5:
            break
        rows.append([float(word) for word in words[-3:]])
    points = np.array(rows)
    if points.shape != molecule.positions_angstrom.shape:
        return None
    fit = superpose(points, molecule.positions_angstrom)
    return fit if fit.rmsd < SAME_GEOMETRY_ANGSTROM else None


def _dipole_agrees(molecule: Molecule, output: Output, start: int, fit: Superposition) -> bool:
    """Whether the dipole printed after the couplings agrees with that of the molecule; True if one of them is unknown."""
    after = [i for i in range(start, len(output.lines) - 1) if output.lines[i].strip() == DIPOLE]
    if not after or molecule.dipole_debye is None or molecule.charge:
        return True
    words = output.lines[after[0] + 1].split()
    printed = fit.rotation @ np.array([float(word) for word in words[:3]])
    return bool(np.abs(printed - molecule.dipole_debye).max() < SAME_DIPOLE_DEBYE)


def _tensors(output: Output, start: int) -> list[tuple[int, tuple[str, int], Floats]]:
    """Atom number, element, mass number and printed tensor of each nucleus."""
    tensors, i = [], start + 1
    while i + 3 < len(output.lines) and (head := _NUCLEUS.match(output.lines[i])):
        rows = [_NUMBER.findall(line) for line in output.lines[i + 1 : i + 4]]
        if [len(row) for row in rows] != [3, 3, 3]:
            raise output.refuse(i, "nine elements of a quadrupole coupling are expected in three lines after this one")
        tensors.append((int(head[1]), (head[2], int(head[3])), np.array(rows, dtype=float)))
        i += 4
    return tensors


def _noted(molecule: Molecule, output: Output, start: int, why: str) -> Molecule:
    note = f"{output.where}: the quadrupole couplings of line {start + 1} {why}: left out"
    return replace(molecule, notes=(*molecule.notes, note))
