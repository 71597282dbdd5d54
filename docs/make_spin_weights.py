"""Writes docs/spin_weights.md: the spin weights of some fifty species with the character sums behind them.

Run it from the root of the project: `python docs/make_spin_weights.py`. A test compares the file with what it writes.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rotor.molecules.molecule import Molecule
from rotor.molecules.symmetry.point_group import Symmetry, molecule_symmetry
from rotor.tops.spins.spin_statistics import STATES, CharacterRow, character_rows, inverting_symmetry, spin_weights

TARGET = Path(__file__).with_name("spin_weights.md")
TURNS = np.arange(3) * 2 * np.pi / 3


class Species(NamedTuple):
    """A row of the table: what it is called, its geometry, isotopes that differ, its state."""

    label: str
    geometry: str
    isotopes: str = ""
    electronic: str = "even"
    inversion: str | None = None


SPECIES = [
    Species("H2", "H2"),
    Species("HD", "H2", "2=2H"),
    Species("D2", "H2", "H=2H"),
    Species("14N2", "N2"),
    Species("15N2", "N2", "N=15N"),
    Species("16O2, X 3Σg-", "O2", electronic="odd"),
    Species("16O18O", "O2", "2=18O"),
    Species("17O2, X 3Σg-", "O2", "O=17O", electronic="odd"),
    Species("C2H2", "C2H2"),
    Species("C2D2", "C2H2", "H=2H"),
    Species("CO2", "CO2"),
    Species("16O12C18O", "CO2", "2=18O"),
    Species("OCS", "OCS"),
    Species("H2O", "H2O"),
    Species("HDO", "H2O", "2=2H"),
    Species("D2O", "H2O", "H=2H"),
    Species("H2S", "SH2"),
    Species("CH2, X 3B1", "CH2_s3B1d", electronic="odd"),
    Species("H2CO", "H2CO"),
    Species("D2CO", "H2CO", "H=2H"),
    Species("H2CCO", "H2CCO"),
    Species("CH2F2", "H2CF2"),
    Species("SO2", "SO2"),
    Species("O3", "O3"),
    Species("Cl2O, 35Cl", "Cl2O"),
    Species("H2O2", "H2O2"),
    Species("CH3OCH3", "CH3OCH3"),
    Species("C3H8", "C3H8"),
    Species("furan", "C4H4O"),
    Species("pyridine", "C5H5N"),
    Species("butadiene", "butadiene"),
    Species("C2H4", "C2H4"),
    Species("C2D4", "C2H4", "H=2H"),
    Species("allene", "C3H4_D2d"),
    Species("N2O4", "N2O4"),
    Species("NH3", "NH3"),
    Species("NH3, lower of the doublet", "NH3", inversion="symmetric"),
    Species("NH3, upper of the doublet", "NH3", inversion="antisymmetric"),
    Species("ND3", "NH3", "H=2H"),
    Species("NH2D, lower of the doublet", "NH3", "2=2H", inversion="symmetric"),
    Species("PH3", "PH3"),
    Species("CH3-35Cl", "CH3Cl"),
    Species("CH2D-35Cl", "CH3Cl", "3=2H"),
    Species("CH3CN", "CH3CN"),
    Species("CD3CN", "CH3CN", "H=2H"),
    Species("CH-35Cl3", "HCCl3"),
    Species("BF3", "BF3"),
    Species("SO3", "SO3"),
    Species("cyclopropane", "C3H6_D3h"),
    Species("C2H6, staggered", "C2H6"),
    Species("C6H6", "C6H6"),
    Species("C6D6", "C6H6", "H=2H"),
    Species("13C12C5H6", "C6H6", "1=13C"),
    Species("XeF4", "XeF4"),
    Species("CH4", "CH4"),
    Species("CH3D", "CH4", "2=2H"),
    Species("CD4", "CH4", "H=2H"),
    Species("C-35Cl4", "CCl4"),
    Species("SF6", "SF6"),
    Species("12C60", "C60"),
    Species("13C60", "C60", "C=13C"),
]  # fmt: skip


def molecule_of(species: Species) -> Molecule:
    """Its geometry: symmetric shapes of round numbers here, the rest from ASE's g2 collection."""
    symbols, positions = _geometry(species.geometry)
    molecule = Molecule(tuple(symbols), positions)
    return molecule.with_isotopes(species.isotopes) if species.isotopes else molecule


def _geometry(name: str) -> tuple[list[str], np.ndarray]:
    cross = np.concatenate([np.eye(3), -np.eye(3)])
    if name == "SF6":
        return ["S", *"FFFFFF"], np.concatenate([np.zeros((1, 3)), 1.56 * cross])
    if name == "XeF4":
        return ["Xe", *"FFFF"], np.concatenate([np.zeros((1, 3)), 1.95 * cross[[0, 1, 3, 4]]])
    if name == "SO3":
        corners = np.stack([np.cos(TURNS), np.sin(TURNS), 0 * TURNS], axis=1)
        return ["S", *"OOO"], np.concatenate([np.zeros((1, 3)), 1.42 * corners])
    if name == "Cl2O":
        return ["O", "Cl", "Cl"], np.array([[0, 0, 0], [1.40, 0.96, 0], [-1.40, 0.96, 0]])
    if name == "N2O4":
        oxygens = [[x, y, 0] for x in (1.34, -1.34) for y in (1.1, -1.1)]
        return [*"NNOOOO"], np.array([[0.89, 0, 0], [-0.89, 0, 0], *oxygens])
    if name == "C60":
        return ["C"] * 60, _truncated_icosahedron()

    from ase.collections import g2

    atoms = g2[name]
    return atoms.get_chemical_symbols(), atoms.positions


def _truncated_icosahedron() -> np.ndarray:
    """Corners one third along each edge of an icosahedron; edges of 1.43 Å, all alike."""
    golden = (1 + math.sqrt(5)) / 2
    signs = [(s, t) for s in (1, -1) for t in (1, -1)]
    corners = np.array([np.roll([0, s, t * golden], shift) for shift in range(3) for s, t in signs])
    apart = np.linalg.norm(corners[:, None] - corners[None], axis=2)
    edges = np.argwhere(np.abs(apart - 2) < 1e-9)
    return 1.43 * 1.5 * (2 * corners[edges[:, 0]] + corners[edges[:, 1]]) / 3


def row(species: Species) -> str:
    """One line of the table."""
    molecule = molecule_of(species)
    symmetry, electronic = _state(species, molecule)
    spins = [one.spin for one in molecule.nuclei]
    sums = "; ".join(_term(one) for one in character_rows(symmetry, spins, electronic))
    weights = spin_weights(symmetry, spins, electronic).to_mapping()
    text = " ".join(f"{name}:{weight}" for name, weight in weights.items()) or "all alike"
    group = f"{symmetry.point_group} | {symmetry.rotation_group}"
    return f"| {species.label} | {group} | {symmetry.symmetry_number} | {sums} | {text} |"


def _state(species: Species, molecule: Molecule) -> tuple[Symmetry, str | tuple[int, ...]]:
    if species.inversion is None:
        return molecule_symmetry(molecule), species.electronic
    kinds = list(zip(molecule.symbols, molecule.mass_numbers, strict=True))
    flat, signs = inverting_symmetry(kinds, molecule.masses_u, molecule.positions_angstrom)
    return flat, signs if species.inversion == STATES[1] else "even"


def _term(one: CharacterRow) -> str:
    """`2 C3: 2·2 = 4`: how many, which, a factor for each cycle of nuclei with spin, f(R)."""
    factors = [_factor(spin, length, count) for spin, length, count in one.cycles if spin]
    product = "·".join(factors) or "1"
    sign = "" if _product(one) == one.character else ", times -1"
    return f"{one.count} {one.rotation}: {product}{sign} = {one.character}"


def _factor(spin: float, length: int, count: int) -> str:
    value = _value(spin, length)
    text = f"({value})" if value < 0 else f"{value}"
    return text if count == 1 else f"{text}^{count}"


def _value(spin: float, length: int) -> int:
    states = round(2 * spin + 1)
    return -states if states % 2 == 0 and length % 2 == 0 else states


def _product(one: CharacterRow) -> int:
    return math.prod(_value(spin, length) ** count for spin, length, count in one.cycles)


HEAD = """# Spin weights and the sums behind them

Written by `docs/make_spin_weights.py`; a test compares. Nothing here is looked up by name: each row follows from a
geometry, the isotopes and their spins.

A rotation R permutes the nuclei. A cycle of like nuclei with spin I contributes 2I+1 spin functions that it leaves
alike, with a minus sign for an even cycle of fermions (an odd permutation); the product over all cycles, times the
character of the electronic state, is f(R). A rotational species Γ weighs w = Σ χ_Γ(R) f(R) / Σ 1 over all rotations
(P. R. Bunker and P. Jensen, Molecular Symmetry and Spectroscopy, 2nd ed., chapter 8).

- H2O: C2(b) exchanges two protons, f = 4 and -2. Levels with Ka+Kc even: (4 - 2)/2 = 1; odd: (4 + 2)/2 = 3.
- CH4: A: (16 + 8·4 + 3·4)/12 = 5; E, both halves: (2·16 - 8·4 + 2·3·4)/12 = 2; F: (3·16 - 3·4)/12 = 3.

Classes: ee, eo, oe, oo are parities of (Ka, Kc); 0, 1, 2, ... is |K| modulo n, the weight of one component of a ±K
pair, where 0even and 0odd are levels with K = 0 and even or odd J (a pair with K a multiple of n has one of each and
weighs their sum); even and odd are parities of J (of N for 3Σ); A, E, F, G, H are irreps of the group of rotations, a
degenerate level counted once. Weights are divided by their common divisor. Twofold axes across the main one are
marked with ′, those along fourfold axes C4². States are electronic and vibrational ground states, inversion not
resolved, unless said.

| species | point group | rotations | symmetry number | f(R) | weights |
|---|---|---|---|---|---|
"""


def page() -> str:
    """The whole text of docs/spin_weights.md."""
    return HEAD + "\n".join(row(species) for species in SPECIES) + "\n"


if __name__ == "__main__":
    TARGET.write_text(page(), encoding="utf-8")
