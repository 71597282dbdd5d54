"""The algebra of quaternions and vectors by components.

All functions take and return tuples of components: (w, x, y, z), or three of a vector. A component is a float or an array of any
shape: `rotations.py` calls these functions with arrays, and `_kernels.py` compiles them for kernels. Quaternions have unit length,
scalar first, body to space, as in `rotations.py`.
"""

from __future__ import annotations

from typing import Any


def cross(a: Any, b: Any) -> Any:
    """a x b.

    >>> cross((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    (0.0, 0.0, 1.0)
    """
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def product(p: Any, q: Any) -> Any:
    """p q by Hamilton's rule, i j = k: first the rotation q, then p.

    >>> product((0, 1, 0, 0), (0, 0, 1, 0))
    (0, 0, 0, 1)
    """
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


def conjugate(q: Any) -> Any:
    """The inverse rotation: the vector part changes sign.

    >>> conjugate((0.6, 0.8, 0.0, 0.0))
    (0.6, -0.8, -0.0, -0.0)
    """
    return q[0], -q[1], -q[2], -q[3]


def turned(q: Any, v: Any) -> Any:
    """A vector v of the body, seen from space: v + w u + r x u with u = 2 r x v and q = (w, r).

    >>> turned((0.0, 0.0, 0.0, 1.0), (1.0, 2.0, 3.0))
    (-1.0, -2.0, 3.0)
    """
    r = (q[1], q[2], q[3])
    half = cross(r, v)
    u = (2.0 * half[0], 2.0 * half[1], 2.0 * half[2])
    t = cross(r, u)
    return v[0] + q[0] * u[0] + t[0], v[1] + q[0] * u[1] + t[1], v[2] + q[0] * u[2] + t[2]


def half_third_row(q: Any) -> Any:
    """Half of the first two components of the third axis of space, seen from the body.

    >>> half_third_row((0.6, 0.8, 0.0, 0.0))
    (0.0, 0.48)
    """
    return q[1] * q[3] - q[0] * q[2], q[2] * q[3] + q[0] * q[1]


def matrix(q: Any) -> Any:
    """Rows of the matrix R with v_space = R v_body; its third row is the third axis of space, seen from the body.

    >>> matrix((0, 0, 0, 1))
    ((-1, 0, 0), (0, -1, 0), (0, 0, 1))
    """
    w, x, y, z = q
    zx, zy = half_third_row(q)
    return (
        ((w * w - z * z) + (x * x - y * y), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), (w * w - x * x) + (y * y - z * z), 2 * (y * z - w * x)),
        (2 * zx, 2 * zy, (w * w - x * x) + (z * z - y * y)),
    )


def to_third(direction: Any) -> Any:
    """A rotation that takes a unit vector (three floats) to the third axis; downward vectors are first turned by π about the second.

    >>> to_third((0.0, 0.0, -1.0))
    (-0.0, 0.0, 1.0, 0.0)
    """
    x, y, z = direction
    half = (0.5 * (1.0 + abs(z))) ** 0.5
    if z >= 0.0:
        return half, 0.5 * y / half, -0.5 * x / half, 0.0
    return -0.5 * x / half, 0.0, half, 0.5 * y / half


def exponential(cosine: Any, half_sinc: Any, r: Any) -> Any:
    """The quaternion (cos θ/2, (sin θ/2)/θ r) of the rotation by θ = |r| about r.

    >>> exponential(0.0, 0.3183098861837907, (0.0, 0.0, 3.141592653589793))
    (0.0, 0.0, 0.0, 1.0)
    """
    return cosine, half_sinc * r[0], half_sinc * r[1], half_sinc * r[2]
