"""A body with a symmetric internal top in a periodic potential: the classical motion of a hindered internal rotation.

With the moments I of the whole (the top locked), the top's moment I_t about its axis λ, its angle α in the body and V(α),

    T = ½ ω·Iω + I_t α' λ·ω + ½ I_t α'²,        L = ∂T/∂ω = Iω + I_t α' λ,        p = ∂T/∂α' = I_t (λ·ω + α').

A symmetric top leaves I constant. Eliminating ω and α' with J = I - I_t λλᵀ, the body without the axial moment of its top,

    H = ½ (L - pλ)·J⁻¹(L - pλ) + p²/2I_t + V(α),
    dL/dt = L x ω,    dp/dt = -V'(α),    dα/dt = p/I_t - λ·ω,    ω = J⁻¹(L - pλ):

Kelvin's gyrostat (`rotor.classical.effects.gyrostat`) with a torque on its rotor. Without V, p is constant; for a high barrier the body is
rigid with the moments I. At L = 0 it is a pendulum with 1/I_red = 1/I_t + λ·J⁻¹λ, which gives the quantum-mechanical F = ħ²/2I_red.

A step splits H into flows that are exact: V kicks p; -p b·L, b = J⁻¹λ, turns L and the body about b at the rate -p |b|, and α with it;
½ L·J⁻¹L is the free body, stepped by Euler's core. Their symmetric composition is symplectic, of order 2, and conserves L in space.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.euler import checked_moments, kinetic_energy
from rotor.classical.integrators.splitting import SymmetricTopSplitting
from rotor.geometry.rotations import IDENTITY, conjugate, exp, from_matrix, multiply, rotate


@dataclass(frozen=True, eq=False)
class TurningTop:
    """A body with an internal top, in any coherent units.

    Parameters
    ----------
    moments : (3,) array
        Principal moments of the whole with the top locked.
    axis : (3,) array
        Direction λ in the principal axes, of any length.
    top_moment : float
        I_t.
    barriers, sines : mapping of int to float
        V_n and W_n of V = Σ ½ V_n (1 - cos nα) + Σ ½ W_n sin nα, energies.

    Examples
    --------
    >>> ethane_like = TurningTop([20.0, 40.0, 44.0], [1.0, 0.0, 0.0], 10.0, {3: 100.0})
    >>> ethane_like.reduced_moment  # I_t (1 - I_t/I)
    5.0
    """

    moments: ArrayLike
    axis: ArrayLike
    top_moment: float
    barriers: Mapping[int, float] = field(default_factory=dict)
    sines: Mapping[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        moments, axis = checked_moments(self.moments), np.asarray(self.axis, dtype=float)
        length = float(np.linalg.norm(axis))
        if axis.shape != (3,) or not length > 0:
            raise ValueError(f"axis of a top {axis}: expected three numbers along the principal axes, not all 0")
        for name in ("barriers", "sines"):
            terms = dict(getattr(self, name))
            if any(n < 1 for n in terms):
                raise ValueError(f"{name} {terms}: terms of the potential are counted from n = 1")
            object.__setattr__(self, name, MappingProxyType(terms))
        object.__setattr__(self, "moments", moments)
        object.__setattr__(self, "axis", axis / length)
        if not self.top_moment > 0 or not self.rest_moments[0] > 0:
            raise ValueError(
                f"moment of a top {self.top_moment:g}: expected a number above 0 that leaves the rest of the body moments above 0"
            )

    @cached_property
    def _rest(self) -> tuple[Floats, Floats]:
        """Principal moments of J, and its axes as columns along those of the whole; a proper rotation."""
        axis = np.asarray(self.axis, dtype=float)
        whole = np.diag(np.asarray(self.moments)) - self.top_moment * np.outer(axis, axis)
        moments, axes = np.linalg.eigh(whole)
        axes[:, 2] *= np.sign(np.linalg.det(axes))
        return moments, axes

    @property
    def rest_moments(self) -> Floats:
        """Principal moments (3,) of the body without the axial moment of its top, in increasing order."""
        return self._rest[0]

    @property
    def rest_axes(self) -> Floats:
        """Their axes in columns along the principal axes of the whole."""
        return self._rest[1]

    @cached_property
    def _axis(self) -> Floats:
        """λ along the axes of J."""
        return np.asarray(self.rest_axes.T @ np.asarray(self.axis, dtype=float))

    @cached_property
    def reduced_moment(self) -> float:
        """I_red of 1/I_red = 1/I_t + λ·J⁻¹λ."""
        return float(1 / (1 / self.top_moment + np.sum(self._axis**2 / self.rest_moments)))

    def potential(self, angle: ArrayLike) -> Floats:
        """V at angles."""
        alpha, total = np.asarray(angle, dtype=float), np.zeros(np.shape(angle))
        for n, v in self.barriers.items():
            # ½ V_n (1 - cos nα), as potentials of torsions are written
            total = total + 0.5 * v * (1 - np.cos(n * alpha))
        for n, w in self.sines.items():
            total = total + 0.5 * w * np.sin(n * alpha)
        return total

    def torque(self, angle: ArrayLike) -> Floats:
        """-V'(α)."""
        alpha, total = np.asarray(angle, dtype=float), np.zeros(np.shape(angle))
        for n, v in self.barriers.items():
            total = total - 0.5 * n * v * np.sin(n * alpha)
        for n, w in self.sines.items():
            total = total - 0.5 * n * w * np.cos(n * alpha)
        return total

    def energy(self, momentum: ArrayLike, p: ArrayLike, angle: ArrayLike) -> Floats:
        """H (n,) of momenta (n, 3) along the principal axes of the whole, p (n,) and angles (n,)."""
        torsion, relative, velocity = self._relative(momentum, p)
        return np.asarray(
            kinetic_energy(relative, velocity) + torsion**2 / (2 * self.top_moment) + self.potential(angle)
        )

    def angle_rate(self, momentum: ArrayLike, p: ArrayLike) -> Floats:
        """α' (n,) of momenta (n, 3) along the principal axes of the whole."""
        torsion, _, velocity = self._relative(momentum, p)
        return np.asarray(torsion / self.top_moment - velocity @ self._axis)

    def angular_velocity(self, momentum: ArrayLike, p: ArrayLike) -> Floats:
        """ω (n, 3) of the body, along the principal axes of the whole, of momenta along these."""
        return np.asarray(self._relative(momentum, p)[2] @ self.rest_axes.T)

    def _relative(self, momentum: ArrayLike, p: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """p (n,), and L - pλ and ω = J⁻¹(L - pλ) (n, 3) along the axes of J."""
        torsion = np.asarray(p, dtype=float)
        relative = np.asarray(momentum, dtype=float) @ self.rest_axes - torsion[..., None] * self._axis
        return torsion, relative, relative / self.rest_moments

    def thermal(self, kt: float, count: int, *, rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
        """L (n, 3), p (n,) and α (n,) of a gas at kT: L - pλ and p are Gaussian, α is drawn from exp(-V/kT) on a grid of 4096 angles."""
        p = rng.normal(scale=np.sqrt(self.top_moment * kt), size=count)
        relative = rng.normal(size=(count, 3)) * np.sqrt(self.rest_moments * kt)
        # the density is even on a fine grid, and uniform within its cells
        angles = 2 * np.pi * np.arange(4096) / 4096
        weight = np.exp(-self.potential(angles) / kt)
        alpha = rng.choice(angles, size=count, p=weight / weight.sum()) + rng.uniform(0, 2 * np.pi / 4096, count)
        return (relative + p[:, None] * self._axis) @ self.rest_axes.T, p, alpha


@dataclass(frozen=True, eq=False)
class TurningMotion:
    """The motion of n bodies at t times: L (t, n, 3) along the principal axes of the whole, attitudes (t, n, 4), p and α (t, n)."""

    body: TurningTop
    times: Floats
    momentum: Floats
    attitude: Floats
    p: Floats
    angle: Floats

    @property
    def energy(self) -> Floats:
        """H (t, n)."""
        return self.body.energy(self.momentum, self.p, self.angle)

    @property
    def momentum_in_space(self) -> Floats:
        """L (t, n, 3) in space."""
        return rotate(self.attitude, self.momentum)


def turning_motion(
    body: TurningTop,
    momentum: ArrayLike,
    p: ArrayLike,
    angle: ArrayLike,
    times: ArrayLike,
    step: float,
    attitude: ArrayLike = IDENTITY,
) -> TurningMotion:
    """The motion of bodies with an internal top.

    Parameters
    ----------
    body : TurningTop
        Moments, axis and barrier.
    momentum : (n, 3) or (3,) array
        L at the first time, along the principal axes of the whole.
    p, angle : (n,) arrays or float
        The momentum of the top, total and about its axis, and its angle at the first time.
    times : (t,) array
        Rising; the start first.
    step : float
        Longest step; each interval of the times has whole steps of equal length.
    attitude : (n, 4) or (4,) array, optional
        Body to space.

    Returns
    -------
    TurningMotion

    Raises
    ------
    ValueError
        For a step that is not above 0, and times that do not rise.
    """
    t = np.asarray(times, dtype=float)
    if not step > 0 or t.ndim != 1 or len(t) < 2 or not (np.diff(t) > 0).all():
        raise ValueError("step, times: expected a step above 0 and at least two rising times, the start first")
    start = np.atleast_2d(np.asarray(momentum, dtype=float)) @ body.rest_axes
    torsion, alpha = (np.broadcast_to(np.asarray(x, dtype=float), len(start)).copy() for x in (p, angle))
    to_rest = from_matrix(body.rest_axes)
    state = np.hstack([start, multiply(np.broadcast_to(attitude, (len(start), 4)), to_rest)])
    carry, moments = np.zeros_like(state), np.broadcast_to(body.rest_moments, (len(start), 3)).copy()
    path = [(state.copy(), torsion.copy(), alpha.copy())]
    for interval in np.diff(t).tolist():
        # a quotient that is whole but for round-off makes no further step
        count = int(np.ceil(interval / step - 1e-9))
        _advance(body, moments, state, carry, torsion, alpha, interval / count, count)
        path.append((state.copy(), torsion.copy(), alpha.copy()))
    states, torsions, angles = (np.array(part) for part in zip(*path, strict=True))
    back = multiply(states[..., 3:], conjugate(to_rest))
    return TurningMotion(body, t, states[..., :3] @ body.rest_axes.T, back, torsions, angles)


def _advance(
    body: TurningTop, moments: Floats, state: Floats, carry: Floats, p: Floats, alpha: Floats, step: float, count: int
) -> None:
    """`count` steps of one length, in place."""
    euler = SymmetricTopSplitting(step)
    p += 0.5 * step * body.torque(alpha)
    for i in range(count):
        _turn(body, state, p, alpha, 0.5 * step)
        euler.drift(moments, state, carry, step, 1, True)
        _turn(body, state, p, alpha, 0.5 * step)
        # half kicks at both ends, whole ones between
        p += (1.0 if i + 1 < count else 0.5) * step * body.torque(alpha)


def _turn(body: TurningTop, state: Floats, p: Floats, alpha: Floats, time: float) -> None:
    """The flow of -p b·L + p² (1/I_t + λ·b)/2: L turns backwards about b as the body turns forwards, α by its derivative by p."""
    b = body._axis / body.rest_moments
    alpha += time * (p / body.reduced_moment - state[:, :3] @ b)
    turn = exp((-p * time)[:, None] * b)
    state[:, :3] = rotate(conjugate(turn), state[:, :3])
    state[:, 3:] = multiply(state[:, 3:], turn)
