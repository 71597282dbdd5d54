"""Bonds of a geometry, by distance."""

from __future__ import annotations

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.molecules.molecule import FEW_ATOMS, Molecule

RADII_ANGSTROM = {"H": 0.31, "B": 0.84, "C": 0.76, "N": 0.71, "O": 0.66, "F": 0.57, "Si": 1.11, "P": 1.07, "S": 1.05,
                  "Cl": 1.02, "Ge": 1.20, "As": 1.19, "Se": 1.20, "Br": 1.20, "I": 1.39}  # fmt: skip
OTHER_RADIUS = 1.3
BONDED = 1.2  # of the sum of two covalent radii (B. Cordero et al., Dalton Trans. 2008, 2832, as ASE's data has them)


def bonded_atoms(molecule: Molecule) -> list[Ints]:
    """Atoms bonded to each atom: closer than 1.2 times the sum of covalent radii."""
    x = molecule.positions_angstrom
    radii = np.array([RADII_ANGSTROM.get(symbol, OTHER_RADIUS) for symbol in molecule.symbols])
    neighbours: list[list[int]] = [[] for _ in x]
    pairs = _pairs_within(x, 2 * BONDED * float(radii.max(initial=0.0)))
    apart = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1)
    for first, second in pairs[apart < BONDED * radii[pairs].sum(axis=1)].tolist():
        neighbours[first].append(second)
        neighbours[second].append(first)
    return [np.array(sorted(near), dtype=np.int64) for near in neighbours]


def _pairs_within(x: Floats, reach: float) -> Ints:
    """Pairs (m, 2) of points closer than `reach`, Å."""
    if len(x) > FEW_ATOMS:
        from scipy.spatial import cKDTree

        return np.asarray(cKDTree(x).query_pairs(reach, output_type="ndarray"), dtype=np.int64)
    apart = np.linalg.norm(x[:, None] - x[None], axis=-1)
    return np.argwhere(np.triu(apart < reach, k=1))
