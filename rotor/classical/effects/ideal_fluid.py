"""A body in an ideal fluid at rest at infinity: added moments and masses, and the torque of an impulse.

Kirchhoff's equations are M' = M x ω + p x u and p' = p x ω in body axes, with M = (I + K) ω and p = (m + m_f) u along axes
of symmetry: the fluid adds moments K and masses m_f. The impulse p of body and fluid is constant in space, so that the first equation
is Euler's with the moments I + K and the torque p x u, which depends only on the attitude and has the potential ½ p·u. Without an
impulse the motion is that of a free top (H. Lamb, Hydrodynamics, sections 114, 115 and 124).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.effect import Torque, vector_field
from rotor.classical.effects.torques import checked_vector, from_body
from rotor.classical.torque_form import INDUCED, TorqueForm, torque_form
from rotor.geometry.rotations import vector_product


@dataclass(frozen=True)
class FluidImpulse(Torque):
    """Torque p x u and energy ½ p·u of an impulse p (3,), constant in space; u_i = p_i/masses_i in body axes.

    masses (3,) are those of body and fluid together along the principal axes; the moments of the motion are I + K.

    >>> pushed = FluidImpulse([1.0, 1.0, 0.0], masses=[1.0, 2.0, 2.0])
    >>> pushed.torque(0.0, np.array([1.0, 0, 0, 0]), np.zeros(3)).tolist()
    [0.0, 0.0, -0.5]
    """

    name: ClassVar[str] = "fluid impulse"
    conserves_energy: ClassVar[bool] = True

    impulse: ArrayLike = vector_field("impulse", "in space")
    masses: ArrayLike = vector_field("masses", "of the body with the fluid's, along its axes")

    def __post_init__(self) -> None:
        object.__setattr__(self, "impulse", checked_vector(self.impulse, "an impulse"))
        masses = checked_vector(self.masses, "the masses along the axes")
        if np.any(masses <= 0.0):
            raise ValueError(f"the masses of body and fluid are positive; got {masses.tolist()}")
        object.__setattr__(self, "masses", masses)

    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """p x u in body axes."""
        p = from_body(self.impulse, attitude)
        return vector_product(p, p / np.asarray(self.masses))

    def compiled_form(self) -> TorqueForm:
        """(M p) x p with M the negative diagonal of 1/masses."""
        return torque_form(INDUCED, np.diag(-1.0 / np.asarray(self.masses)), self.impulse)

    def potential_energy(self, time: float, attitude: Floats) -> Floats:
        """½ p·u."""
        p = from_body(self.impulse, attitude)
        return np.asarray(0.5 * np.sum(p * p / np.asarray(self.masses), axis=-1))


def added_moments(semiaxes: ArrayLike, density: float) -> Floats:
    """Moments K (3,) added to an ellipsoid by a fluid of this density,

        K1 = (m_f/5) (b² - c²)² (γ - β) / (2 (b² - c²) + (b² + c²)(β - γ)), cyclic,   m_f the mass of fluid displaced

    (Lamb, section 115). 0 for a sphere; 16/45 density r⁵ for a thin disc rotating about a diameter.

    >>> added_moments([2.0, 1.0, 1.0], 1.0)[0]  # nothing about an axis of revolution
    np.float64(0.0)
    """
    alpha, squares = shape_integrals(semiaxes), np.square(semiaxes)
    fluid = _displaced(semiaxes, density)
    added = np.zeros(3)
    for k in range(3):
        (b2, c2), (beta, gamma) = (np.roll(v, -k)[1:] for v in (squares, alpha))
        if b2 != c2:
            added[k] = fluid / 5 * (b2 - c2) ** 2 * (gamma - beta) / (2 * (b2 - c2) + (b2 + c2) * (beta - gamma))
    return added


def added_masses(semiaxes: ArrayLike, density: float) -> Floats:
    """Masses m_f α/(2 - α) (3,) added by a fluid of this density to an ellipsoid moving along its axes (Lamb, section 114).

    >>> added_masses([1.0, 1.0, 1.0], 3.0 / (2.0 * np.pi)).round(12).tolist()  # half of the fluid displaced by a sphere
    [1.0, 1.0, 1.0]
    """
    alpha = shape_integrals(semiaxes)
    return np.asarray(_displaced(semiaxes, density) * alpha / (2.0 - alpha))


def shape_integrals(semiaxes: ArrayLike) -> Floats:
    """Lamb's α, β, γ (3,) of an ellipsoid, α = abc ∫ dλ/((a² + λ) Δ) from 0 to ∞, by Carlson's R_D; α + β + γ = 2.

    >>> shape_integrals([1.0, 1.0, 1.0]).round(12).tolist()
    [0.666666666667, 0.666666666667, 0.666666666667]
    """
    from scipy.special import elliprd

    axes = checked_vector(semiaxes, "an ellipsoid's semi-axes")
    if np.any(axes <= 0.0):
        raise ValueError(f"the semi-axes of an ellipsoid are positive; got {axes.tolist()}")
    a2, b2, c2 = np.square(axes)
    integrals = np.array([elliprd(b2, c2, a2), elliprd(c2, a2, b2), elliprd(a2, b2, c2)])
    return np.asarray(2.0 / 3.0 * np.prod(axes) * integrals)


def _displaced(semiaxes: ArrayLike, density: float) -> float:
    return density * 4.0 / 3.0 * np.pi * float(np.prod(np.asarray(semiaxes, dtype=np.float64)))
