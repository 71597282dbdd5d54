"""Conversion of constants of an internal rotor between geometry, principal axes (PAM, XIAM) and the rho-axis frame (RAM).

A top with the moment I_α about its axis, which has the cosines λ_g to the principal axes, in a molecule with the moments I_g
(C. C. Lin and J. D. Swalen, Rev. Mod. Phys. 31 (1959) 841, as reviews that were read cite it; H. Hartwig and H. Dreizler, Z. Naturforsch.
51a (1996) 923 for the names of XIAM, checked with its output):

    F0 = ħ²/2I_α,    ρ_g = λ_g I_α/I_g = λ_g B_g/F0,    r = 1 - Σ λ_g ρ_g,    F = F0/r,    λ = (cos δ, sin δ cos ε, sin δ sin ε),

    H = A Pa² + B Pb² + C Pc² + F (p - ρ·P)² + V(α)                                    with B_g = A, B, C of the whole molecule.

The axes of the RAM have z along ρ; for ρ in the plane ab, at the angle θ = atan(ρ_b/ρ_a) from a,

    A_RAM = A cos²θ + B sin²θ,    B_RAM = A sin²θ + B cos²θ,    D_ab = -½ (A - B) sin 2θ,    C_RAM = C,

an exact rotation: A_RAM stands beside F (p - ρPz)². Published A may contain Fρ² (IAM, A_eff = A + Fρ²).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats


@dataclass(frozen=True, eq=False)
class RhoAxis:
    """A top in principal axes: F (the unit of A, B, C) and the vector ρ along a, b, c."""

    f: float
    rho_abc: Floats

    @property
    def rho(self) -> float:
        """|ρ|."""
        return float(np.linalg.norm(self.rho_abc))

    @property
    def axes(self) -> Floats:
        """Rows a, b, c of the rho-axis frame (z, x, y) along the principal axes: a along ρ, c as near the principal axis c as possible."""
        first = self.rho_abc / self.rho
        third = np.array([0.0, 0.0, 1.0])
        third = third - (third @ first) * first
        if np.linalg.norm(third) < 1e-12:  # ρ along c
            third = np.array([0.0, 1.0, 0.0])
        third /= np.linalg.norm(third)
        return np.stack([first, np.cross(third, first), third])


def rho_axis(constants: ArrayLike, f0: float, cosines: ArrayLike) -> RhoAxis:
    """F and ρ of a top from A, B, C, F0 = ħ²/2I_α and the cosines of its axis to a, b, c.

    >>> top = rho_axis([4.382840234, 2.732392836, 2.73075628], 156.758300542, axis_of_angles(0.460684017))  # MTBE of XIAM's test
    >>> round(top.f, 6), round(top.rho, 9)
    (160.922724, 0.026215839)
    """
    direction = np.asarray(cosines, dtype=float)
    rho = direction * np.asarray(constants, dtype=float) / f0
    return RhoAxis(f0 / (1.0 - float(direction @ rho)), rho)


def axis_of_angles(delta: float, epsilon: float = 0.0) -> Floats:
    """Cosines of a top's axis to a, b, c from XIAM's angles δ (from a) and ε (about a, from b), in radians."""
    return np.array([np.cos(delta), np.sin(delta) * np.cos(epsilon), np.sin(delta) * np.sin(epsilon)])
