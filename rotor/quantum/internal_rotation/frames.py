"""Conversion of constants of an internal rotor between geometry, principal axes (PAM, XIAM) and the rho-axis frame (RAM).

A top with the moment I_α about its axis, which has the cosines λ_g to the principal axes, in a molecule with the moments I_g
(C. C. Lin and J. D. Swalen, Rev. Mod. Phys. 31 (1959) 841, as reviews that were read cite it; H. Hartwig and H. Dreizler, Z. Naturforsch.
51a (1996) 923 for the names of XIAM, checked with its output):

    F0 = ħ²/2I_α,    ρ_g = λ_g I_α/I_g = λ_g B_g/F0,    r = 1 - Σ λ_g ρ_g,    F = F0/r,    λ = (cos δ, sin δ cos ε, sin δ sin ε),

    H = A Pa² + B Pb² + C Pc² + F (p - ρ·P)² + V(α)                                    with B_g = A, B, C of the whole molecule.

The axes of the RAM have z along ρ; for ρ in the plane ab, at the angle θ = atan(ρ_b/ρ_a) from a,

    A_RAM = A cos²θ + B sin²θ,    B_RAM = A sin²θ + B cos²θ,    D_ab = -½ (A - B) sin 2θ,    C_RAM = C,

an exact rotation: A_RAM stands beside F (p - ρPz)². Published A may contain Fρ² (IAM, A_eff = A + Fρ²). In any other direction of ρ the
rotation is that of `frame_along`, and the Hamiltonian is real if ρ lies in a plane of two principal axes, whose normal is then y.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats

IN_PLANE = 1e-12  # a smaller cosine of ρ across a plane of principal axes is round-off


def frame_along(rho_abc: ArrayLike) -> Floats:
    """Rows z, x, y of the rho-axis frame along the principal axes: z along ρ, y along the principal axis that is normal to ρ (c before b
    before a), or as near c as possible.

    >>> frame_along([3.0, 0.0, 4.0]).tolist()  # in the plane ac
    [[0.6, 0.0, 0.8], [-0.8, 0.0, 0.6], [0.0, -1.0, 0.0]]
    """
    first = np.asarray(rho_abc, dtype=float)
    first = first / np.linalg.norm(first)
    first = np.where(np.abs(first) < IN_PLANE, 0.0, first)
    normal = 2 - int(np.argmax(first[::-1] == 0.0))  # c if ρ lies in no plane
    third = np.eye(3)[normal] * (-1.0 if normal == 1 else 1.0)
    third = third - (third @ first) * first
    third /= np.linalg.norm(third)
    return np.stack([first, np.cross(third, first), third]) + 0.0


def torsional_kinetics(rotation: Mapping[str, float], constants: Mapping[str, float]) -> tuple[Floats, Floats]:
    """F (tops, tops) in the unit of A, B, C, and ρ (tops, 3) along a, b, c, from F0, delta and epsilon of one top, or F0_1 ... of each.

    >>> mtbe = {"A": 4.382840234, "B": 2.732392836, "C": 2.73075628}  # of XIAM's test
    >>> f, rho = torsional_kinetics(mtbe, {"F0": 156.758300542, "delta": 0.460684017})
    >>> round(float(f[0, 0]), 6), round(float(np.linalg.norm(rho)), 9)
    (160.922724, 0.026215839)
    """
    abc = np.array([rotation[name] for name in "ABC"])
    tops = [name.removeprefix("F0") for name in sorted(constants) if name.startswith("F0")]
    axes = np.array([axis_of_angles(constants[f"delta{top}"], constants.get(f"epsilon{top}", 0.0)) for top in tops])
    f0 = np.array([constants[f"F0{top}"] for top in tops])
    return np.linalg.inv(np.diag(1 / f0) - (axes * abc) @ axes.T / np.outer(f0, f0)), axes * abc / f0[:, None]


def axis_of_angles(delta: float, epsilon: float = 0.0) -> Floats:
    """Cosines of a top's axis to a, b, c from XIAM's angles δ (from a) and ε (about a, from b), in radians."""
    return np.array([np.cos(delta), np.sin(delta) * np.cos(epsilon), np.sin(delta) * np.sin(epsilon)])
