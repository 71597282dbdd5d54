"""The Schoenflies name of a finite point group, and of its rotation group, from its operations.

The decisions follow the textbook flow chart: more than one axis of order 3 or higher; two-fold axes perpendicular to the main axis;
mirror planes (P. R. Bunker and P. Jensen, Molecular Symmetry and Spectroscopy, 2nd ed., NRC Research Press 1998, chapter 3).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotor.arrays import Floats
from rotor.molecules.symmetry.operations import Operation

_CUBIC = {12: "T", 24: "O", 60: "I"}
_SAME_LINE = 1e-4  # of 1 - |cos|: two axes of a group of order below 480 differ by more


def rotation_axes(rotations: Sequence[Operation]) -> list[tuple[int, Floats]]:
    """The order and the unit vector (3,) of each axis of rotation, highest order first; each line once."""
    axes: list[tuple[int, Floats]] = []
    for rotation in sorted((r for r in rotations if r.order > 1), key=lambda r: -r.order):
        if not any(_along(rotation.axis, other) for _, other in axes):
            axes.append((rotation.order, rotation.axis))
    return axes


def rotation_group_name(rotations: Sequence[Operation]) -> str:
    """C1, Cn, Dn, T, O or I from all rotations of a group, including the identity."""
    axes = rotation_axes(rotations)
    if sum(order > 2 for order, _ in axes) > 1:
        return _CUBIC[len(rotations)]
    highest = axes[0][0] if axes else 1
    return f"{'C' if len(rotations) == highest else 'D'}{highest}"


def point_group_name(rotations: Sequence[Operation], improper: Sequence[Operation]) -> str:
    """The Schoenflies name from all rotations and all improper operations of a group."""
    group = rotation_group_name(rotations)
    if not improper:
        return group
    inverts = any(np.trace(operation.matrix) < -3 + 1e-6 for operation in improper)
    if group in ("T", "O", "I"):
        return f"{group}h" if group != "T" or inverts else "Td"
    if group == "C1":
        return "Ci" if inverts else "Cs"
    if group == "D2":
        return "D2h" if inverts else "D2d"

    n, main = rotation_axes(rotations)[0]
    normals = [
        operation.axis for operation in improper if operation.order == 2 and not np.trace(operation.matrix) < -3 + 1e-6
    ]
    if any(_along(normal, main) for normal in normals):
        return f"{group}h"
    if normals:
        return f"{group}{'v' if group.startswith('C') else 'd'}"
    return f"S{2 * n}"


def _along(axis: Floats, other: Floats) -> bool:
    return bool(abs(axis @ other) > 1 - _SAME_LINE)
