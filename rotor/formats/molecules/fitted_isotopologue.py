"""Comparison of constants that were scaled from another isotopologue with fitted ones of the library."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats
from rotor.formats.molecules.library import count_atoms, names
from rotor.formats.molecules.molecule_file import read_molecule_file
from rotor.molecules.molecule import Molecule

if TYPE_CHECKING:
    from rotor.formats.molecules.molecule_file import MoleculeFile
    from rotor.tops.top import Top

_NEAR = 0.03  # largest relative difference of distances between two geometries of one molecule
_HYDROGEN = {"D": "H", "T": "H"}


def with_fitted_isotopologue(top: Top) -> Top:
    """The top with a note if the library has fitted constants of this isotopologue, with the differences from them.

    >>> import rotor
    >>> rotor.read("water", isotopes="H=2H").notes[-1]
    "the library has constants of this isotopologue itself, 'D2O': here A is +0.58 %, B -0.10 %, C -0.70 % off; read that one"
    """
    entry = None if top.molecule is None else _library_entry(top.molecule)
    if entry is None or entry[1].constants is None:
        return top
    name, constants = entry[0], entry[1].constants
    pairs = {x: (top.constants.values.get(x), constants.values.get(x)) for x in "ABC"}
    off = {x: 100 * (here / fitted - 1) for x, (here, fitted) in pairs.items() if here and fitted}
    if not off or not any(off.values()):
        return top
    text = ", ".join(f"{x} {change:+.2f} %" for x, change in off.items()).replace(" ", " is ", 1)
    note = f"the library has constants of this isotopologue itself, {name!r}: here {text} off; read that one"
    return replace(top, notes=(*top.notes, note))


def _library_entry(molecule: Molecule) -> tuple[str, MoleculeFile] | None:
    """Name and file of the library for the molecule with these isotopes and distances."""
    elements = _elements(molecule.formula)
    paths = {path: name for name, path in names().items() if _elements(name) == elements and name == path.stem}
    for path, name in paths.items():
        file = read_molecule_file(path)
        if file.molecule is not None and _same(file.molecule, molecule):
            return name, file
    return None


def _elements(formula: str) -> dict[str, int]:
    counts: dict[str, int] = {}
    for atom, number in count_atoms(formula).items():
        element = "".join(letter for letter in atom if letter.isalpha())
        element = _HYDROGEN.get(element, element)
        counts[element] = counts.get(element, 0) + number
    return counts


def _same(molecule: Molecule, other: Molecule) -> bool:
    """Whether two molecules have the same isotopes at the same distances."""
    if sorted(zip(molecule.symbols, molecule.mass_numbers, strict=True)) != sorted(
        zip(other.symbols, other.mass_numbers, strict=True)
    ):
        return False
    first, second = _distances(molecule), _distances(other)
    return all(np.allclose(first[pair], second[pair], rtol=_NEAR) for pair in first)


def _distances(molecule: Molecule) -> dict[tuple[tuple[str, int], ...], Floats]:
    """Rising distances by pair of isotopes."""
    kinds = list(zip(molecule.symbols, molecule.mass_numbers, strict=True))
    out: dict[tuple[tuple[str, int], ...], list[float]] = {}
    for i, j in combinations(range(len(kinds)), 2):
        pair = tuple(sorted((kinds[i], kinds[j])))
        out.setdefault(pair, []).append(float(np.linalg.norm(np.subtract(*molecule.positions_angstrom[[i, j]]))))
    return {pair: np.sort(distances) for pair, distances in out.items()}
