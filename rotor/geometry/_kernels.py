"""Compiled forms of the quaternion algebra for the kernels of other modules, and the compiler of plain functions.

Each compiled form is made from the plain function in `quaternions.py`, so that no formula is written twice.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np
from numba import njit

from rotor.arrays import Floats
from rotor.geometry import quaternions


def inlined(function: Callable[..., Any], **callees: Any) -> Any:
    """The compiled form of a plain function, inlined into its caller and optimised with it.

    `callees` : compiled forms of the plain functions that it calls, by name.
    """
    plain: Any = function
    copy = FunctionType(plain.__code__, {**plain.__globals__, **callees}, plain.__name__, plain.__defaults__)
    copy.__module__, copy.__qualname__ = plain.__module__, plain.__qualname__
    return njit(inline="always")(copy)


cross = inlined(quaternions.cross)
product = inlined(quaternions.product)
conjugate = inlined(quaternions.conjugate)
turned = inlined(quaternions.turned, cross=cross)
half_third_row = inlined(quaternions.half_third_row)
matrix = inlined(quaternions.matrix, half_third_row=half_third_row)
to_third = inlined(quaternions.to_third)
exponential = inlined(quaternions.exponential)


@njit(inline="always")
def vector_at(array: Any, i: int) -> Any:
    """Row i of an array (n, 3) as a tuple."""
    return array[i, 0], array[i, 1], array[i, 2]


@njit(inline="always")
def quaternion_at(array: Any, i: int) -> Any:
    """Row i of an array (n, 4) as a tuple."""
    return array[i, 0], array[i, 1], array[i, 2], array[i, 3]


@njit(cache=True, nogil=True)
def upright(directions: Floats) -> Floats:
    """Rotations (n, 4) that take unit vectors (n, 3) to the third axis."""
    out = np.empty((directions.shape[0], 4))
    for i in range(directions.shape[0]):
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = to_third(vector_at(directions, i))
    return out
