"""The constants of a free motion: its frame, moduli, two phase rates and the coefficients of its theta series.

Put the axis that L circles (that of the largest or of the smallest moment) third, the intermediate axis second, and
turn by π about the second if L then points down; call the moments J1, J2, J3 and G = |L|, 2T = Σ L_i²/J_i,
D_i = G² - 2T J_i. Then, with sn, cn, dn of u and parameter mc = k'² = 1 - k²,

    L = (B1 cn u, B2 sn u, B3 dn u),   B1² = J1 D3/(J1 - J3),  B2² = J2 D3/(J2 - J3),  B3² = J3 D1/(J3 - J1),
    u = λ t + u0,  λ = sign(J3 - J1) √(D1 (J3 - J2)/(J1 J2 J3)),  mc = D2 (J3 - J1) / (D1 (J3 - J2))

(Jacobi 1849; Landau and Lifshitz, section 37). The attitude needs one more phase. Write the rotation that takes the
body frame to one with L along its third axis as the quaternion w + i x + j y + k z and put α = w + i z, β = x + i y.
Euler's equations make β/α = (L2 - i L1)/(G + L3), an elliptic function of u whose one zero in a cell has dn u = G/B3.
With z = πu/2K, q = exp(-πK'/K) and θ functions of the nome q²,

    α = e^{iΩt/2} θ4(z - iη | q²),  β = e^{iΩt/2} θ1(z - iη | q²)   up to one common real factor,
    η = π F(y, k')/(2K),  tan² y = J1 (J3 - J2) / (J3 (J2 - J1)),
    Ω = mean of (2T + G L3/J3)/(G + L3) = G/J3 - (D3/J3) (G/B3²) RJ(0, mc, 1, G²/B3²)/(3K)
      = G/J1 + (1/J1 - 1/J3) [G n RJ(0, mc, 1, 1-n)/(3K) - (π/2K) B3/√(1-n)],   1 - n = J2 (J3 - J1)/(J1 (J3 - J2)).

The first form of Ω is used for |n| > 1, the second for |n| <= 1, to avoid cancellation even for a very small moment.
For small mc the same functions are used after Jacobi's imaginary transformation, which turns z into
v = πu/(2K'), q into q' = exp(-πK/K'), and adds the phase 2φz/π, φ = πF(y, k')/(4K'); with q' = 0 it is the
separatrix itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.classical.free.double_double import PI, DoubleDouble, choose, exact_sum, products
from rotor.classical.free.elliptic import carlson_rf, complete
from rotor.geometry.rotations import from_matrix

STEADY, CIRCULATING, NEAR_SEPARATRIX, SEPARATRIX = 0.0, 1.0, 2.0, 3.0
TRANSFORM_BELOW = 0.2  # mc below which the transformed series is used; both nomes q, q' then stay below 0.1


class Rows(NamedTuple):
    """Constants of n bodies for the compiled evaluation, one row each.

    kind: (n,), one of the four numbers above.
    rates: (n, 6), hi and lo of: half periods per time, their start, half turns about L per time. On the separatrix
    the first two are λ and u0 themselves.
    shift: (n, 2), πK/K' and 2φ of the transformed series.
    series: (n, 22), amplitudes and coefficients of the series (`_series`, `_transformed_series`).
    axes, signs: (n, 3), body axis and sign of each component of the frame.
    left, right: (n, 4), the constant quaternions around (α, β).
    momentum0: (n, 3), the constant momentum of a steady motion.
    """

    kind: Floats
    rates: Floats
    shift: Floats
    series: Floats
    axes: NDArray[np.int64]
    signs: Floats
    left: Floats
    right: Floats
    momentum0: Floats


@dataclass(frozen=True)
class Frame:
    """Body axes in the order (first, second, third) with their signs, and moments and momentum seen in them.

    d2: D2 J1 J3, invariant under exchange of axes 1 and 3; zero on the separatrix.
    """

    axes: NDArray[np.int64]
    signs: Floats
    moments: tuple[Floats, Floats, Floats]
    momentum: tuple[Floats, Floats, Floats]
    d2: DoubleDouble

    @property
    def separatrix(self) -> NDArray[np.bool_]:
        """Which bodies are exactly on the separatrix: D2 = 0."""
        return np.asarray(self.d2.hi == 0.0)


@dataclass(frozen=True)
class Constants:
    """The numbers named in the head of this file, for n bodies; `mean` is π/2K.

    On the separatrix, where K is infinite, `pace` and `start` are λ and u0; elsewhere they are divided by 2K.
    """

    g: DoubleDouble
    b: tuple[Floats, Floats, Floats]
    mc: Floats
    kk: Floats
    mean: Floats
    pace: DoubleDouble
    start: DoubleDouble
    turning: DoubleDouble


def momentum_frame(moments: Floats, momentum: Floats) -> Frame:
    """The frame with the axis that L circles third (from the exact sign of D2) and L3 > 0."""
    order = np.argsort(moments, axis=-1, kind="stable")  # stable: equal moments keep the order of the axes
    d2 = _d2_j1_j3(_columns(moments, order), _columns(momentum, order))
    # d2 < 0: L circles the axis of the smallest moment, so the order is reversed
    axes = np.where((d2.hi < 0.0)[:, None], order[:, ::-1], order)
    third = np.where(np.take_along_axis(momentum, axes[:, 2:], axis=-1)[:, 0] < 0.0, -1.0, 1.0)
    cyclic = (axes[:, 1] - axes[:, 0]) % 3 == 1  # an odd order of the axes is left-handed: the first axis is reversed
    first = np.where(cyclic, third, -third)
    # on the separatrix cn and dn do not change sign, so L1 must be positive too: rotate by π about the third axis
    back = (d2.hi == 0.0) & (np.take_along_axis(momentum, axes[:, :1], axis=-1)[:, 0] * first < 0.0)
    flip = np.where(back, -1.0, 1.0)
    signs = np.stack([first * flip, flip, third], axis=-1)
    m1, m2, m3 = (np.take_along_axis(momentum, axes, axis=-1) * signs).T
    return Frame(axes, signs, _columns(moments, axes), (m1, m2, m3), d2)


def theta_constants(frame: Frame) -> Constants:
    """Amplitudes, moduli, phase rates and the initial phase; about 30 digits for those that determine phases."""
    j1, j2, j3 = (DoubleDouble.exact(j) for j in frame.moments)
    j21, j31, j32 = (DoubleDouble.difference(frame.moments[a], frame.moments[b]) for a, b in ((1, 0), (2, 0), (2, 1)))
    s1, s2, s3 = (DoubleDouble.product(m, m) for m in frame.momentum)
    d1 = s2 * j21 / j2 + s3 * j31 / j3
    d3 = -(s2 * j32 / j2 + s1 * j31 / j1)
    mc = frame.d2 / (j1 * j3) * j31 / (d1 * j32)
    kk = -(d3 * j21) / (d1 * j32)
    g, b3 = (s1 + s2 + s3).sqrt(), (j3 * d1 / j31).sqrt()

    wide = np.abs(j3.hi * j21.hi) > np.abs(j1.hi * j32.hi)  # |n| > 1
    n = -(j3 * j21) / (j1 * j32)
    usable = choose(frame.separatrix, DoubleDouble.exact(np.ones_like(mc.hi)), mc)
    integrals = complete(usable, choose(wide, g * g / (b3 * b3), j2 * j31 / (j1 * j32)))
    outer = g / j3 - d3 * g * integrals.third / (j3 * b3 * b3)
    bracket = g * n * integrals.third - integrals.mean * b3 / (j2 * j31 / (j1 * j32)).sqrt()
    turning = choose(wide, outer, g / j1 + j31 / (j1 * j3) * bracket)

    speed = (d1 * j32 / (j1 * j2 * j3)).sqrt()
    speed = choose(frame.moments[2] > frame.moments[0], speed, -speed)
    per_half_period = choose(frame.separatrix, DoubleDouble.exact(np.ones_like(mc.hi)), integrals.mean / PI)
    start = _first_integral(frame, s1 * j31 / -(j1 * d3), s2 * j32 / -(j2 * d3), mc) * per_half_period
    b = ((-(j1 * d3) / j31).sqrt().hi, (-(j2 * d3) / j32).sqrt().hi, b3.hi)
    start = choose(frame.momentum[0] < 0.0, _sign(frame.momentum[1]) - start, start)
    turning = choose(frame.separatrix, g / j2, turning)
    return Constants(g, b, mc.hi, kk.hi, integrals.mean.hi, speed * per_half_period, start, turning)


def moving_rows(moments: Floats, momentum: Floats) -> Rows:
    """Rows of bodies (n, 3) whose momentum moves in the body; `left` is set to the identity."""
    frame = momentum_frame(moments, momentum)
    c = theta_constants(frame)
    near = c.mc < TRANSFORM_BELOW  # near the separatrix the nome of the transformed series is small
    kind = np.where(frame.separatrix, SEPARATRIX, np.where(near, NEAR_SEPARATRIX, CIRCULATING))
    other_mean, y, y_rest = _amplitude_integrals(frame, c)
    # πK/K' and πK'/K; the second is infinite for a symmetric top, whose nome is zero
    long = np.pi * np.divide(other_mean, c.mean, out=np.full_like(c.mean, np.inf), where=~frame.separatrix)
    # q = exp(-πK'/K)
    short = np.pi * np.divide(c.mean, other_mean, out=np.full_like(c.mean, np.inf), where=other_mean > 0.0)
    # each kind has one series; the other is switched off by a nome of 0
    nome, other_nome = np.where(near, 0.0, np.exp(-short)), np.where(near, np.exp(-long), 0.0)
    plain = _series(c.b, nome, np.exp(-c.mean * y_rest), 2.0 * c.mean * y)
    phi = np.where(near, 0.5 * other_mean * np.where(near, y, 0.0), 0.0)
    bent = _transformed_series(c.b, other_nome, phi)
    shift = np.stack([np.where(frame.separatrix, 0.0, long), 2.0 * phi], axis=-1)
    half_turns = c.turning / (PI * 4.0)
    return Rows(
        kind=kind,
        rates=np.stack([c.pace.hi, c.pace.lo, c.start.hi, c.start.lo, half_turns.hi, half_turns.lo], axis=-1),
        shift=shift,
        series=np.where(near[:, None], bent, plain),
        axes=frame.axes,
        signs=frame.signs,
        left=_identities(len(moments)),
        right=from_matrix(_frame_rotation(frame)),
        momentum0=momentum,
    )


def steady_rows(moments: Floats, momentum: Floats) -> Rows:
    """Rows of bodies (n, 3) with constant momentum in the body: they rotate about L at the rate 2T/|L|."""
    from rotor.geometry._kernels import upright

    squares = [DoubleDouble.product(m, m) for m in momentum.T]
    divisors = [np.where(j > 0.0, j, 1.0) for j in moments.T]  # where a moment is zero, so is the square above it
    total = squares[0] + squares[1] + squares[2]
    moves = total.hi > 0.0
    g = choose(moves, total.sqrt(), DoubleDouble.exact(np.ones_like(total.hi)))
    twice_energy = squares[0] / divisors[0] + squares[1] / divisors[1] + squares[2] / divisors[2]
    half_turns = twice_energy / g / (PI * 4.0)
    n, zero = len(moments), np.zeros_like(total.hi)
    return Rows(
        kind=np.full(n, STEADY),
        rates=np.stack([zero, zero, zero, zero, half_turns.hi, half_turns.lo], axis=-1),
        shift=np.zeros((n, 2)),
        series=np.zeros((n, 22)),
        axes=np.tile(np.arange(3), (n, 1)),
        signs=np.ones((n, 3)),
        left=_identities(n),
        right=upright(np.where(moves[:, None], momentum / g.hi[:, None], [0.0, 0.0, 1.0])),
        momentum0=momentum,
    )


def _d2_j1_j3(moments: tuple[Floats, Floats, Floats], momentum: tuple[Floats, Floats, Floats]) -> DoubleDouble:
    """D2 J1 J3 = L3² (J3 - J2) J1 + L1² (J1 - J2) J3, summed exactly: it may be 1e-16 of its terms, or zero."""
    (j1, j2, j3), (m1, _, m3) = moments, momentum
    plus = products(DoubleDouble.product(m3, m3), DoubleDouble.difference(j3, j2), DoubleDouble.exact(j1))
    minus = products(DoubleDouble.product(m1, m1), DoubleDouble.difference(j1, j2), DoubleDouble.exact(j3))
    return exact_sum(plus + minus)


def _first_integral(frame: Frame, cn2: DoubleDouble, sn2: DoubleDouble, mc: DoubleDouble) -> DoubleDouble:
    """F of the initial amplitude, |F| <= K, from cn² and sn²; without forming an angle, whose cosine would lose digits."""
    value = sn2.sqrt() * carlson_rf(cn2, cn2 + mc * sn2, DoubleDouble.exact(np.ones_like(mc.hi)))
    return choose(frame.momentum[1] < 0.0, -value, value)


def _amplitude_integrals(frame: Frame, c: Constants) -> tuple[Floats, Floats, Floats]:
    """π/2K', y = F(atan(B1/(kB3)), k') and K' - y = F(atan(B3/B1), k'), each small one without cancellation."""
    from scipy.special import elliprf

    j1, j2, j3 = frame.moments
    sine2 = j1 * (j3 - j2) / (j2 * (j3 - j1))
    cosine2 = j3 * (j2 - j1) / (j2 * (j3 - j1))
    symmetric = c.kk == 0.0
    y = np.sqrt(sine2) * elliprf(np.where(symmetric, 1.0, cosine2), cosine2 + c.kk * sine2 + symmetric, 1.0)
    s2, c2 = (c.b[2] / c.g.hi) ** 2, (c.b[0] / c.g.hi) ** 2
    y_rest = np.sqrt(s2) * elliprf(c2, c2 + c.kk * s2, 1.0)
    other = 1.0 / elliprf(0.0, np.where(symmetric, 1.0, c.kk), 1.0) * (np.pi / 2)
    return np.where(symmetric, 0.0, other), np.where(symmetric, np.inf, y), y_rest


def _series(b: tuple[Floats, Floats, Floats], q: Floats, x: Floats, two_eta: Floats) -> Floats:
    """Amplitudes of L and coefficients of the series in the nomes q (for L) and q² (for α and β).

    Columns: 0-2 amplitudes; 3-5 of θ1, θ2; 6-9 of θ3, θ4 (NIST DLMF 20.2); then, with w = z - iη,
    θ4(w) = 1 + Σ (-1)^n [a_n cos 2nz + i b_n sin 2nz]: 10-12 a, 13-15 b, n = 1, 2, 3;
    θ1(w) ~ Σ (-1)^n [c_n sin kz - i d_n cos kz], k = 2n + 1: 16-18 c, 19-21 d, n = 0, 1, 2.
    x = √q e^η and Y = e^-2η keep every product finite when the top becomes symmetric: q -> 0, η -> infinity.
    Neglected terms are below 1e-20 for q < 0.1.
    """
    theta2, theta3 = 1 + q**2 + q**6 + q**12, 1 + 2 * (q + q**4 + q**9 + q**16)
    theta4 = 1 - 2 * (q - q**4 + q**9 - q**16)
    columns = [b[0] * theta4 / theta2, b[1] * theta3 / theta2, b[2] * theta4 / theta3]
    columns += [q**2, q**6, q**12, 2 * q, 2 * q**4, 2 * q**9, 2 * q**16]
    even = [q ** (2 * n * n - n) * x ** (2 * n) for n in (1, 2, 3)]
    odd = [q ** (2 * n * n + n) * x ** (2 * n + 1) for n in (0, 1, 2)]
    columns += [c * (1 + np.exp(-2 * n * two_eta)) for n, c in zip((1, 2, 3), even, strict=True)]
    columns += [c * -np.expm1(-2 * n * two_eta) for n, c in zip((1, 2, 3), even, strict=True)]
    columns += [c * (1 + np.exp(-k * two_eta)) for k, c in zip((1, 3, 5), odd, strict=True)]
    columns += [c * -np.expm1(-k * two_eta) for k, c in zip((1, 3, 5), odd, strict=True)]
    return np.stack(columns, axis=-1)


def _transformed_series(b: tuple[Floats, Floats, Floats], q: Floats, phi: Floats) -> Floats:
    """Amplitudes of L and coefficients after Jacobi's transformation (NIST DLMF 20.7.30 to 20.7.33).

    Columns: 0-2 amplitudes; 3-9 powers 1, 1/2, 2, 4, 9/2, 6, 8 of q'; 10-14 cos kφ, 15-19 sin kφ, k = 1, 3, ... 9.
    """
    theta2, theta3 = 1 + q**2 + q**6 + q**12, 1 + 2 * (q + q**4 + q**9 + q**16)
    theta4 = 1 - 2 * (q - q**4 + q**9 - q**16)
    columns = [b[0] * theta2 / theta4, b[1] * theta3 / theta4, b[2] * theta2 / theta3]
    columns += [q, np.sqrt(q), q**2, q**4, q**4.5, q**6, q**8]
    columns += [np.cos(k * phi) for k in (1, 3, 5, 7, 9)] + [np.sin(k * phi) for k in (1, 3, 5, 7, 9)]
    return np.stack([*columns, np.zeros_like(q), np.zeros_like(q)], axis=-1)


def _columns(array: Floats, axes: NDArray[np.int64]) -> tuple[Floats, Floats, Floats]:
    first, second, third = np.take_along_axis(array, axes, axis=-1).T
    return first, second, third


def _frame_rotation(frame: Frame) -> Floats:
    """The rotation from body axes to the frame: row i is the signed unit vector of the frame's axis i."""
    matrix = np.zeros((len(frame.axes), 3, 3))
    np.put_along_axis(matrix, frame.axes[:, :, None], frame.signs[:, :, None], axis=-1)
    return matrix


def _identities(n: int) -> Floats:
    return np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))


def _sign(values: Floats) -> DoubleDouble:
    return DoubleDouble.exact(np.where(values < 0.0, -1.0, 1.0))  # the sign of 0 is +1
