"""Compiled forms of the quaternion algebra for the kernels of other modules.

Each compiled form is made from the plain function in `quaternions.py`, so that no formula is written twice.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.geometry import quaternions
from rotor.kernels import inlined, kernel

cross = inlined(quaternions.cross)
product = inlined(quaternions.product)
conjugate = inlined(quaternions.conjugate)
turned = inlined(quaternions.turned, cross=cross)
half_third_row = inlined(quaternions.half_third_row)
matrix = inlined(quaternions.matrix, half_third_row=half_third_row)
to_third = inlined(quaternions.to_third)
exponential = inlined(quaternions.exponential)


@kernel(inline="always")
def vector_at(array: Any, i: int) -> Any:
    """Row i of an array (n, 3) as a tuple."""
    return array[i, 0], array[i, 1], array[i, 2]


@kernel(inline="always")
def quaternion_at(array: Any, i: int) -> Any:
    """Row i of an array (n, 4) as a tuple."""
    return array[i, 0], array[i, 1], array[i, 2], array[i, 3]


@kernel(nogil=True)
def upright(directions: Floats) -> Floats:
    """Rotations (n, 4) that take unit vectors (n, 3) to the third axis."""
    out = np.empty((directions.shape[0], 4))
    for i in range(directions.shape[0]):
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = to_third(vector_at(directions, i))
    return out
