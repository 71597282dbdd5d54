"""Bonds of a geometry, by distance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.molecules.molecule import FEW_ATOMS, Molecule

RADII_ANGSTROM = {"H": 0.31, "B": 0.84, "C": 0.76, "N": 0.71, "O": 0.66, "F": 0.57, "Si": 1.11, "P": 1.07, "S": 1.05,
                  "Cl": 1.02, "Ge": 1.20, "As": 1.19, "Se": 1.20, "Br": 1.20, "I": 1.39}  # fmt: skip
OTHER_RADIUS = 1.3
BONDED = 1.2  # of the sum of two covalent radii (B. Cordero et al., Dalton Trans. 2008, 2832, as ASE's data has them)


def bonded_atoms(
    molecule: Molecule, covalent_radii: Mapping[str, float] = RADII_ANGSTROM, factor: float = BONDED
) -> list[Ints]:
    """Atoms bonded to each atom: closer than `factor` times the sum of covalent radii."""
    x = molecule.positions_angstrom
    radii = np.array([covalent_radii.get(symbol, OTHER_RADIUS) for symbol in molecule.symbols])
    neighbours: list[list[int]] = [[] for _ in x]
    pairs = _pairs_within(x, 2 * factor * float(radii.max(initial=0.0)))
    apart = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1)
    for first, second in pairs[apart < factor * radii[pairs].sum(axis=1)].tolist():
        neighbours[first].append(second)
        neighbours[second].append(first)
    return [np.array(sorted(near), dtype=np.int64) for near in neighbours]


def bonded_parts(bonds: Sequence[Ints]) -> list[list[int]]:
    """Atoms that bonds join, by part, in the order of their first atoms.

    >>> bonded_parts([np.array([1]), np.array([0]), np.array([], dtype=int)])
    [[0, 1], [2]]
    """
    parts, left = [], dict.fromkeys(range(len(bonds)))
    while left:
        first = next(iter(left))
        del left[first]
        part = [first]
        for atom in part:
            near = [other for other in bonds[atom].tolist() if other in left]
            part += near
            for other in near:
                del left[other]
        parts.append(sorted(part))
    return parts


def _pairs_within(x: Floats, reach: float) -> Ints:
    """Pairs (m, 2) of points closer than `reach`, Å."""
    if len(x) > FEW_ATOMS:
        from scipy.spatial import cKDTree

        return np.asarray(cKDTree(x).query_pairs(reach, output_type="ndarray"), dtype=np.int64)
    apart = np.linalg.norm(x[:, None] - x[None], axis=-1)
    return np.argwhere(np.triu(apart < reach, k=1))
