"""Compiled passes from bodies to atoms and back: 20 times faster than numpy's for a thousand waters.

Atoms of body b are order[starts[b]:starts[b + 1]]; sites (atoms, 3) are in principal axes, in the order of the atoms.
"""

from __future__ import annotations

from typing import Any

from numba import njit

from rotor.arrays import Floats
from rotor.classical.integrators._attitude_kernels import _seen


@njit(cache=True, nogil=True)
def place(centres: Floats, attitude: Floats, sites: Floats, order: Any, starts: Any, out: Floats) -> None:
    """out (atoms, 3) = centre + q s q*."""
    for body in range(starts.shape[0] - 1):
        w, x, y, z = attitude[body]
        c1, c2, c3 = centres[body]
        for k in range(starts[body], starts[body + 1]):
            atom = order[k]
            s1, s2, s3 = _seen(w, x, y, z, sites[atom, 0], sites[atom, 1], sites[atom, 2])
            out[atom, 0], out[atom, 1], out[atom, 2] = c1 + s1, c2 + s2, c3 + s3


@njit(cache=True, nogil=True)
def wrench(
    vectors: Floats, attitude: Floats, sites: Floats, order: Any, starts: Any, total: Floats, turning: Floats
) -> None:
    """total (n, 3) = Σ v in space, turning (n, 3) = Σ s x (q* v q) in body axes, of vectors (atoms, 3) in space."""
    for body in range(starts.shape[0] - 1):
        w, x, y, z = attitude[body]
        f1, f2, f3, t1, t2, t3 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(starts[body], starts[body + 1]):
            atom = order[k]
            f1, f2, f3 = f1 + vectors[atom, 0], f2 + vectors[atom, 1], f3 + vectors[atom, 2]
            v1, v2, v3 = _seen(w, -x, -y, -z, vectors[atom, 0], vectors[atom, 1], vectors[atom, 2])
            s1, s2, s3 = sites[atom]
            t1, t2, t3 = t1 + (s2 * v3 - s3 * v2), t2 + (s3 * v1 - s1 * v3), t3 + (s1 * v2 - s2 * v1)
        total[body, 0], total[body, 1], total[body, 2] = f1, f2, f3
        turning[body, 0], turning[body, 1], turning[body, 2] = t1, t2, t3


@njit(cache=True, nogil=True)
def momenta(
    velocity: Floats,
    omega: Floats,
    attitude: Floats,
    sites: Floats,
    masses: Floats,
    order: Any,
    starts: Any,
    out: Floats,
) -> None:
    """out (atoms, 3) = m (v + q (ω x s) q*), v (n, 3) in space, ω (n, 3) in body axes."""
    for body in range(starts.shape[0] - 1):
        w, x, y, z = attitude[body]
        v1, v2, v3 = velocity[body]
        w1, w2, w3 = omega[body]
        for k in range(starts[body], starts[body + 1]):
            atom = order[k]
            s1, s2, s3 = sites[atom]
            u1, u2, u3 = _seen(w, x, y, z, w2 * s3 - w3 * s2, w3 * s1 - w1 * s3, w1 * s2 - w2 * s1)
            m = masses[atom]
            out[atom, 0], out[atom, 1], out[atom, 2] = m * (v1 + u1), m * (v2 + u2), m * (v3 + u3)
