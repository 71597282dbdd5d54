"""The discrete Moser-Veselov map with preprocessed moments: a polynomial step that conserves energy and momentum.

Order: 2, 4, 6, 8 by series in the step, or exact: see `exact_modified_moments`. Conserves, for free motion: |L|, L in
space, the energy, time reversal and the Poisson structure of L, to round-off (the map of (L, q) is not symplectic).
Cost: 3 or 4 Newton iterations of a 3x3 system without trigonometry, about 0.15 µs per step and body on one core; between
kicks of torques the moments are recomputed in each drift. The method requires step x |ω| below about 1, and bodies that are not nearly
linear; otherwise Newton's iteration fails and the step is refused. The root is computed beyond double precision: a rounded root would
change the energy by 4e-19 per step in one direction, 4e-11 after 10⁸ steps. The remaining error is random rounding, 4e-17 √steps.

With x the root of J x = (1 + |x|²) (h/2) L + ((J2 - J3) x2 x3, (J3 - J1) x3 x1, (J1 - J2) x1 x2), the body turns by the
quaternion (1, x)/√(1 + |x|²) while L stays where it is in space. With 1/J_i = S/I_i + D, S and D functions of the step
and the invariants alone, the map moves along the same polhodes as the body.

Sources: J. Moser and A. P. Veselov, Commun. Math. Phys. 139, 217 (1991); E. Hairer and
G. Vilmart, J. Phys. A 39, 13225 (2006), for S and D.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.classical.euler import kinetic_energy
from rotor.classical.free.free_motion import free_motion
from rotor.classical.integrators.compositions import fractions
from rotor.classical.integrators.method import KickDrift, pieces
from rotor.classical.system import acting_inverse
from rotor.geometry.rotations import conjugate, multiply

LONGEST_TURN = 1.2  # rad per step; x = tan(turn/2) beyond which Newton may settle on another root
EXACT = 0  # the `order` that means exact_modified_moments


@dataclass(frozen=True)
class MoserVeselov(KickDrift):
    """Preprocessed discrete Moser-Veselov steps of order 2, 4, 6 or 8, or order 0: exact for free motion.

    `kick_order` is the order of the composition with torques, changing moments and inner momenta. The drifts between kicks
    then have order `order` (8 if that is 0); the lower of both orders applies.

    >>> from rotor.classical.integrators.method import integrate
    >>> motion = integrate(MoserVeselov(step=0.25, order=0), [0.6, 0.8, 1.0], [1.8, 0.4, -0.9], [0.0, 10.0])
    >>> motion.momentum[-1].round(12).tolist()
    [1.765962508518, -0.695464197033, 0.779554981482]
    """

    order: int = EXACT
    kick_order: int = 2

    def __post_init__(self) -> None:
        super().__post_init__()
        fractions(self.kick_order)
        if self.order not in (EXACT, 2, 4, 6, 8):
            raise ValueError(f"Moser-Veselov has order 2, 4, 6 or 8, or 0 for exact free motion; got {self.order!r}")

    @property
    def kick_fractions(self) -> Floats:
        """Fractions of the composition of kicks and drifts."""
        return fractions(self.kick_order)

    def drift(self, moments: Floats, state: Floats, carry: Floats, step: float, steps: int, whole: bool) -> None:
        """As `KickDrift.drift`, with moments modified for the invariants the drift starts with.

        Raises ValueError if a step is too long for the motion or the body is too nearly linear.
        """
        from rotor.classical.integrators._step_kernels import moser_veselov

        acting = 1.0 / acting_inverse(moments)
        momentum = state[:, :3]
        _check_turn(momentum, acting, step)
        if whole and self.order == EXACT:
            modified = exact_modified_moments(acting, momentum, step)
        else:
            modified = modified_moments(acting, momentum, step, self.order or 8)
        scaled = _on_grid(modified / (0.5 * step))
        failed = next(
            (bad for part in pieces(steps, len(state)) if (bad := moser_veselov(state, carry, scaled, part)) >= 0), -1
        )
        if failed >= 0:
            raise ValueError(
                f"the Moser-Veselov step {step:g} has no solution near the motion for moments "
                f"{moments[failed].tolist()}: take a shorter step, or a splitting for a nearly linear body"
            )


def modified_moments(moments: Floats, momentum: Floats, step: float, order: int) -> Floats:
    """Moments J (n, 3) for which the map has this order at the invariants of the motion.

    1/J_i = S/I_i + D, S = 1 + Σ S_ab N^a H^b, D = Σ D_ab N^a H^b, N = (h|L|)²/2, H = h² energy, summed to a + b = order/2 - 1
    (Hairer and Vilmart 2006). moments, momentum: (n, 3), no moment is zero.
    """
    n, h = 0.5 * step**2 * np.sum(momentum**2, axis=-1), step**2 * kinetic_energy(momentum, momentum / moments)
    s, d = np.ones_like(n), np.zeros_like(n)
    for (a, b), (s_coefficient, d_coefficient) in _series(moments).items():
        if a + b < order / 2:
            s, d = s + s_coefficient * n**a * h**b, d + d_coefficient * n**a * h**b
    return np.asarray(1.0 / (s[:, None] / moments + d[:, None]))


def exact_modified_moments(moments: Floats, momentum: Floats, step: float) -> Floats:
    """Moments J (n, 3) for which the map is the free motion itself: the sum of Hairer and Vilmart's series.

    Their theorem gives S(N, H) and D(N, H) to any order, so that their sums, where they converge, make the map exact.
    The sums are read off the exact solution: with x = tan(φ/2) n of the rotation between times t and t + h, the map
    demands J_i x_i = (h/4) (L(t) + L(t + h))_i (1 + |x|²), that is (S/I_i + D) y_i = x_i, linear in S and D. Several t
    make the system well conditioned; that one S and D satisfy all of them is checked here to 1e-10 for every body.
    """
    starts = step * np.array([0.0, 2.3, 5.1, 9.7, 15.9])
    path, attitude = free_motion(moments, momentum).at(np.concatenate([starts, starts + step]))
    (before, after), (q0, q1) = (np.split(array, 2, axis=1) for array in (path, attitude))
    turn = multiply(conjugate(q0), q1)
    x = turn[..., 1:] / turn[..., :1]
    # tan of the half angle: x = v/w of the quaternion
    y = 0.25 * step * (before + after) * (1.0 + np.sum(x**2, axis=-1, keepdims=True))
    matrix = np.stack([y / moments[:, None], y], axis=-1).reshape(len(moments), -1, 2)
    expected = x.reshape(len(moments), -1)
    solution = _least_squares(matrix, expected)
    misfit = np.max(np.abs(np.einsum("nij,nj->ni", matrix, solution) - expected), axis=-1)
    # the equations have more rows than unknowns; a misfit means that no such step exists
    if np.any(misfit > 1e-10 * np.max(np.abs(expected), axis=-1)):
        worst = int(np.argmax(misfit))
        raise ValueError(
            f"no exact Moser-Veselov step of {step:g} exists for moments {moments[worst].tolist()}: take a shorter one"
        )
    return np.asarray(1.0 / (solution[:, :1] / moments + solution[:, 1:]))


def _on_grid(scaled: Floats) -> Floats:
    """Numbers rounded to the last digit of the largest: their differences are then exact, and no energy drifts."""
    # 53 bits below the largest: products of whole multiples of the grid are exact
    grid = np.ldexp(1.0, np.frexp(np.max(np.abs(scaled), axis=-1, keepdims=True))[1] - 53)
    return np.ascontiguousarray(np.rint(scaled / grid) * grid)


def _least_squares(matrix: Floats, expected: Floats) -> Floats:
    """Least-squares solutions (n, 2) of small systems; S and D are not independent for a sphere or a rotation about one axis.

    By projection on the left singular vectors, since the explicit pseudo-inverse would lose the digits of the condition number.
    """
    left, sizes, right = np.linalg.svd(matrix, full_matrices=False)
    along = np.einsum("nij,ni->nj", left, expected)
    regular = sizes > 1e-13 * sizes[:, :1]  # a free axis of a symmetric top leaves a zero singular value
    return np.asarray(np.einsum("nj,nji->ni", np.where(regular, along, 0.0) / np.where(regular, sizes, 1.0), right))


def _check_turn(momentum: Floats, moments: Floats, step: float) -> None:
    turn = abs(step) * float(np.max(np.linalg.norm(momentum / moments, axis=-1)))
    if not turn < LONGEST_TURN:
        raise ValueError(
            f"a step of {abs(step):g} turns the body by {turn:.3g} rad, more than the {LONGEST_TURN} that the "
            "Moser-Veselov map can follow; take a shorter step"
        )


def _series(moments: Floats) -> dict[tuple[int, int], tuple[Any, Any]]:
    """(S_ab, D_ab) by (a, b), to order 8, functions of the symmetric sums of the moments."""
    i1, i2, i3 = moments.T
    d = i1 * i2 * i3
    s1, s2, s3 = (np.sum(moments**k, axis=-1) for k in (1, 2, 3))
    x1, x2, x3 = (np.sum(moments**-k, axis=-1) for k in (1, 2, 3))

    def p(r: int, k: int) -> Floats:
        """Σ (I_a^r + I_b^r)/I_c^k over the three axes c."""
        powers = moments**r
        return np.asarray(np.sum((np.sum(powers, axis=-1, keepdims=True) - powers) / moments**k, axis=-1))

    return {
        (1, 0): (s1 / (6 * d), -1 / (3 * d)),
        (0, 1): (-x1 / 3, s1 / (6 * d)),
        (2, 0): ((s2 / d - x1) / (30 * d), -s1 / (60 * d**2)),
        (1, 1): ((1 - p(1, 1)) / (30 * d), x1 / (10 * d) - s2 / (60 * d**2)),
        (0, 2): ((3 * s1 / d + 2 * x2) / 60, -(9 + p(1, 1)) / (60 * d)),
        (3, 0): ((4 * d + 17 * s3 - 15 * d * p(1, 1)) / (2520 * d**3), (34 * d * x1 - 19 * s2) / (2520 * d**3)),
        (2, 1): ((9 * s1 + 10 * d * x2 - 6 * p(2, 1)) / (420 * d**2), (s3 + 2 * d * p(1, 1) - 85 * d) / (1260 * d**3)),
        (1, 2): (
            ((6 * p(1, 2) - 100 * x1) * d + 53 * s2) / (2520 * d**2),
            (47 * s1 + 13 * p(2, 1) - 38 * d * x2) / (2520 * d**2),
        ),
        (0, 3): ((15 - d * x3 - 2 * p(1, 1)) / (630 * d), (9 * d * x1 + d * p(1, 2) - 11 * s2) / (1260 * d**2)),
    }
