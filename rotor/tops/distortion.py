"""Centrifugal distortion from a harmonic force field: Wilson's τ, and the quartic constants of both reductions.

A rotating molecule is stretched until the force field balances the centrifugal force. With b(Q) = f I(Q)⁻¹ in MHz, f = h/8π², the energy
Σ b_αβ J_α J_β + ½ Σ λ Q² has a minimum in Q that lies below the rigid energy by Σ T_αβγδ J_α J_β J_γ J_δ with

    T_αβγδ = ¼ τ_αβγδ = -½ Σ_k (∂b_αβ/∂Q_k) (∂b_γδ/∂Q_k) / λ_k,    ∂b/∂Q = -b (∂I/∂Q) b / f

(E. B. Wilson, J. Chem. Phys. 4, 526 (1936); D. Kivelson and E. B. Wilson, J. Chem. Phys. 20, 1575 (1952), eq. 5; M. R.
Aliev and J. K. G. Watson, in Molecular Spectroscopy: Modern Research 3 (1985), § 1). Neglected: vibrational averaging and
anharmonicity, which change quartic constants by some per cent (up to ten for hydrides), and shifts of A, B, C from the
order of operators, which are as large as the quartic constants.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rotor.arrays import Floats
from rotor.molecules.force_field import ForceField
from rotor.tops.constants.constants import Constants
from rotor.tops.constants.operators import axis_order
from rotor.tops.inertial_defect import inertia_by_modes, inertial_defect_u_angstrom2, is_planar
from rotor.tops.top import Top
from rotor.units import ELEMENTARY_CHARGE_C, PLANCK_J_S, ROTATIONAL_MHZ_U_ANGSTROM2

MHZ_PER_EV = ELEMENTARY_CHARGE_C / PLANCK_J_S * 1e-6
_NEAR_SYMMETRIC = 1e-4  # (Bx - By)/Bz below which the A-reduction divides by nearly zero


@dataclass(frozen=True)
class Cylindrical:
    """Σ T_αβ J_α² J_β² in operators of the z axis: coefficients in MHz of J⁴, J²Jz², Jz⁴, J²u, Jz²u, J₊⁴ + J₋⁴; u = Jx² - Jy²."""

    jj: float
    jz: float
    zz: float
    ju: float
    zu: float
    four: float


def tau_mhz(field: ForceField) -> Floats:
    """Wilson's τ (3, 3, 3, 3) in MHz along the principal axes a, b, c.

    For a linear molecule the components along a are 0, since J_a = 0.
    """
    top = Top.from_molecule(field.molecule)
    change = _constants_by_modes(field, top)
    stiffness = field.vibrations().stiffness_ev * MHZ_PER_EV
    return np.asarray(-2 * np.einsum("kab,kcd,k->abcd", change, change, 1 / stiffness))


def _constants_by_modes(field: ForceField, top: Top) -> Floats:
    """∂b_αβ/∂Q_k (m, 3, 3) in MHz/(√u Å) along the principal axes; 0 along the axis of a linear molecule."""
    assert top.frame is not None  # from_molecule sets it
    linear = top.kind == "linear"
    inverse = np.array([0.0 if linear and i == 0 else 1 / moment for i, moment in enumerate(top.frame.moments)])
    return np.asarray(-ROTATIONAL_MHZ_U_ANGSTROM2 * inverse[:, None] * inertia_by_modes(field, top) * inverse)


def quartic_tensor_mhz(field: ForceField) -> Floats:
    """Watson's T_αβ (3, 3) in MHz along a, b, c: H = Σ T_αβ J_α² J_β², T_αα = ¼ τ_αααα, T_αβ = ¼ (τ_ααββ + 2 τ_αβαβ).

    J. K. G. Watson, in Vibrational Spectra and Structure 6 (1977), eq. 22. Components such as τ_aaab of a molecule of low
    symmetry do not affect the energies in this order.
    """
    tau = tau_mhz(field)
    squares = np.einsum("aabb->ab", tau) + 2 * np.einsum("abab->ab", tau)
    squares[np.diag_indices(3)] = np.einsum("aaaa->a", tau)
    return np.asarray(squares / 4)


def cylindrical(tensor: Floats, axes: tuple[int, int, int]) -> Cylindrical:
    """The tensor (3, 3) in operators of the z axis; `axes` are the indices of x, y, z in it.

    With w = J² - Jz²: Jx² = ½ (w + u), Jy² = ½ (w - u), u² = ½ w² + ¼ (J₊⁴ + J₋⁴), up to the order of operators.
    """
    t = tensor[np.ix_(axes, axes)]
    xx_yy, xy, ww = t[0, 0] + t[1, 1], t[0, 1], 3 * (t[0, 0] + t[1, 1]) / 8 + t[0, 1] / 4
    return Cylindrical(
        jj=float(ww),
        jz=float(t[0, 2] + t[1, 2] - 2 * ww),
        zz=float(ww + t[2, 2] - t[0, 2] - t[1, 2]),
        ju=float((t[0, 0] - t[1, 1]) / 2),
        zu=float(t[0, 2] - t[1, 2] - (t[0, 0] - t[1, 1]) / 2),
        four=float(xx_yy / 16 - xy / 8),
    )


def reduced(tensor: Floats, rigid_mhz: Floats, axes: tuple[int, int, int], reduction: str) -> Cylindrical:
    """The tensor transformed by exp(i s (JxJyJz + JzJyJx)) so that one of the six operators vanishes.

    A: no J₊⁴ + J₋⁴; S: no Jz² u.

    Parameters
    ----------
    tensor : (3, 3) array
        T_αβ along a, b, c, MHz.
    rigid_mhz : (3,) array
        A, B, C.
    axes : (int, int, int)
        Indices of x, y, z among a, b, c.
    reduction : str
        "A" or "S".

    Returns
    -------
    Cylindrical
        Coefficients of the operators, MHz.

    Raises
    ------
    ValueError
        For the A-reduction of a nearly symmetric top, which would divide by nearly zero.

    Notes
    -----
    The transformation adds s (By - Bx), s (Bz - By), s (Bx - Bz) to T_xy, T_yz, T_xz and does not change the levels (Watson 1977,
    § 3).
    """
    x, y, z = axes
    bx, by, bz = rigid_mhz[list(axes)]
    if reduction == "A":
        if abs(bx - by) < _NEAR_SYMMETRIC * bz:
            raise ValueError(
                f"the A-reduction divides by the difference of {bx:.3f} and {by:.3f} MHz; use reduction='S' for so nearly "
                "symmetric a top"
            )
        s = ((tensor[x, x] + tensor[y, y]) / 2 - tensor[x, y]) / (by - bx)
    else:
        s = (tensor[x, z] - tensor[y, z] - (tensor[x, x] - tensor[y, y]) / 2) / (2 * bz - bx - by)
    transformed = tensor.copy()
    for (i, j), change in {(x, y): by - bx, (y, z): bz - by, (x, z): bx - bz}.items():
        transformed[i, j] = transformed[j, i] = tensor[i, j] + s * change
    return cylindrical(transformed, axes)


def distortion_constants(field: ForceField, *, reduction: str = "S", representation: str | None = None) -> Constants:
    """A, B, C of the geometry with the quartic constants of the force field, in MHz.

    Parameters
    ----------
    field : ForceField
    reduction : "S" or "A", for asymmetric tops
    representation : for asymmetric tops; by default Ir for κ <= 0 and IIIl for κ > 0

    Returns
    -------
    Constants
        Linear: D. Spherical: D, the mean over directions, without the tensor that splits J levels. Symmetric: DJ, DJK,
        DK. Asymmetric: DJ, DJK, DK, d1, d2 or DeltaJ, DeltaJK, DeltaK, deltaJ, deltaK.

    Raises
    ------
    ValueError
        For a geometry that is not a minimum, the A-reduction of a nearly symmetric top, an unknown reduction.

    Examples
    --------
    >>> from rotor.molecules.force_field import force_field_from_internal
    >>> from rotor.molecules.internal_coordinates import stretch
    >>> from rotor.molecules.molecule import Molecule
    >>> co = Molecule(("C", "O"), [[0, 0, 0], [0, 0, 1.128323]])
    >>> field = force_field_from_internal(co, [stretch(0, 1)], [[19.019]])
    >>> constants, w = distortion_constants(field), float(field.vibrations().wavenumbers_cm[0]) * 29979.2458
    >>> round(constants["D"], 6), round(4 * constants["B"] ** 3 / w**2, 6)
    (0.18347, 0.18347)
    """
    if reduction not in ("A", "S"):
        raise ValueError(f"reduction {reduction!r}: Watson's reductions are 'A' and 'S'")
    rigid = Top.from_molecule(field.molecule).constants
    tensor = quartic_tensor_mhz(field)
    if rigid.kind == "linear":
        return rigid.replace(D=-float(tensor[1, 1] + tensor[2, 2]) / 2)
    if rigid.kind == "spherical":
        # means over directions: n_i⁴ 1/5, n_i² n_j² 1/15
        return rigid.replace(D=-float(np.trace(tensor) / 5 + 2 * (tensor.sum() - np.trace(tensor)) / 30))
    if rigid.kind in ("prolate", "oblate"):
        quartic = cylindrical(tensor, (1, 2, 0) if rigid.kind == "prolate" else (0, 1, 2))
        return rigid.replace(DJ=-quartic.jj, DJK=-quartic.jz, DK=-quartic.zz)
    return _asymmetric(rigid, tensor, reduction, representation or str(rigid.representation))


def _asymmetric(rigid: Constants, tensor: Floats, reduction: str, representation: str) -> Constants:
    rigid = rigid.replace(representation=representation)
    x, y, z = ("abc".index(letter) for letter in axis_order(representation))
    quartic = reduced(tensor, np.array(rigid.rigid), (x, y, z), reduction)
    if reduction == "S":
        return rigid.replace(DJ=-quartic.jj, DJK=-quartic.jz, DK=-quartic.zz, d1=quartic.ju / 2, d2=quartic.four)
    quartics = {
        "DeltaJ": quartic.jj,
        "DeltaJK": quartic.jz,
        "DeltaK": quartic.zz,
        "deltaJ": quartic.ju / 2,
        "deltaK": quartic.zu / 2,
    }
    return rigid.replace(**{name: -value for name, value in quartics.items()})


def semirigid_top(field: ForceField, *, reduction: str = "S", representation: str | None = None) -> Top:
    """The top of a force field: its geometry with the quartic distortion of the force field.

    Notes state the source and the neglect of the distortion, and the inertial defect of a planar vibrating molecule.
    """
    top = Top.from_molecule(field.molecule)
    constants = distortion_constants(field, reduction=reduction, representation=representation)
    note = (
        f"quartic distortion from a harmonic force field ({field.source}): error some per cent, ten for hydrides; "
        "no sextic constants"
    )
    notes = (*top.notes, note)
    if is_planar(top):
        defect = inertial_defect_u_angstrom2(field)
        notes += (f"A, B, C are those of the rigid minimum; vibration causes an inertial defect of {defect:.4f} u Å²",)
    return replace(top.with_constants(constants), notes=notes)
