"""Internal coordinates of a molecule, and Wilson's B matrix exact to round-off.

A coordinate is a function of the positions that also accepts complex ones, so that its derivative follows from a single
imaginary step without cancellation: f'(x) = Im f(x + i h) / h (W. Squire and G. Trapp, SIAM Rev. 40, 110 (1998)).
Atoms are counted from 0; the order of atoms in each function is that of E. B. Wilson, J. C. Decius and P. C. Cross, Molecular
Vibrations (1955), § 4-1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Coordinate = Callable[[NDArray[Any]], Any]
_STEP = 1e-30  # so small that the cubic term is far below round-off


def stretch(i: int, j: int) -> Coordinate:
    """The distance of atoms i and j, Å."""
    return lambda x: _length(x[j] - x[i])


def bend(i: int, apex: int, k: int) -> Coordinate:
    """The angle at `apex` between atoms i and k, radian; not for a straight one (`linear_bend`)."""

    def angle(x: NDArray[Any]) -> Any:
        u, v = _unit(x[i] - x[apex]), _unit(x[k] - x[apex])
        return np.arccos(u @ v)

    return angle


def linear_bend(i: int, apex: int, k: int, across: ArrayLike) -> Coordinate:
    """The bend of a straight angle in the plane of the bond and a fixed vector.

    Parameters
    ----------
    i, apex, k : int
        Atoms, counted from 0; the angle is at `apex`.
    across : (3,) array
        Direction across the bond, any length.

    Returns
    -------
    callable
        Positions (n, 3) in Å to radian.
    """
    direction = np.asarray(across, dtype=float)

    def angle(x: NDArray[Any]) -> Any:
        return (_unit(x[i] - x[apex]) + _unit(x[k] - x[apex])) @ (direction / np.linalg.norm(direction))

    return angle


def torsion(i: int, j: int, k: int, m: int) -> Coordinate:
    """The change of the dihedral angle i-j-k-m near its present value.

    Parameters
    ----------
    i, j, k, m : int
        Atoms along the chain, counted from 0.

    Returns
    -------
    callable
        Positions (n, 3) in Å to radian, up to a constant.
    """

    def angle(x: NDArray[Any]) -> Any:
        axis = _unit(x[k] - x[j])
        first, last = np.cross(x[j] - x[i], axis), np.cross(axis, x[m] - x[k])
        across, along = np.cross(first, last) @ axis, first @ last
        if abs(along.real) > abs(across.real):
            return np.arctan(across / along)
        return -np.arctan(along / across)

    return angle


def wilson_b(coordinates: Sequence[Coordinate], positions_angstrom: ArrayLike) -> NDArray[np.float64]:
    """B (m, 3n), the derivatives of m coordinates by the positions x1 y1 z1 x2 ...

    >>> wilson_b([stretch(0, 1)], [[0, 0, 0], [0, 0, 1.1]]).tolist()
    [[0.0, 0.0, -1.0, 0.0, 0.0, 1.0]]
    """
    start = np.asarray(positions_angstrom, dtype=complex)
    rows = np.empty((len(coordinates), start.size))
    for place in range(start.size):
        moved = start.copy()
        moved.flat[place] += 1j * _STEP
        rows[:, place] = [complex(coordinate(moved)).imag / _STEP for coordinate in coordinates]
    return rows + 0.0


def _length(vector: NDArray[Any]) -> Any:
    return np.sqrt(vector @ vector)


def _unit(vector: NDArray[Any]) -> NDArray[Any]:
    return np.asarray(vector / _length(vector))
