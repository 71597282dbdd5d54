"""Dipole and polarizability components that symmetry allows; forbidden components are refused.

A vector or tensor of a molecule is invariant under each operation of its point group; its mean over the operations is the allowed
part. If only constants are known, nuclear-spin weights decide: μ_a joins levels (Ka, Kc) of species whose parities differ in Kc alone,
μ_c in Ka alone, μ_b in both, and likewise α_bc, α_ab, α_ac. A component that would join species of different weight is zero, since
light does not convert ortho into para.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.tops.spins.spin_weights import SpinWeights

if TYPE_CHECKING:
    from rotor.geometry.inertia import PrincipalFrame
    from rotor.molecules.symmetry.point_group import Symmetry

NOISE_DEBYE = 1e-3  # smaller forbidden components are rounding or noise, and removed
NOISE = 1e-3  # the same for a polarizability, relative to its norm
DEBYE_PER_ANGSTROM = 10.0  # dipole that displaced nuclei may add, about two elementary charges
PER_ANGSTROM = 1.0  # the same for a polarizability, relative to its norm
_JOINED = {"a": (("ee", "eo"), ("oe", "oo")), "b": (("ee", "oo"), ("eo", "oe")), "c": (("ee", "oe"), ("eo", "oo"))}
_TENSOR = {"ab": "c", "ac": "b", "bc": "a"}  # an element of α joins the same species as this component of μ


def allowed_dipole(dipole: ArrayLike, symmetry: Symmetry) -> Floats:
    """The part of a dipole (D) that is invariant under the point group, if the rest is noise; else the whole.

    Noise is up to 0.001 D, plus 10 D for each Å by which nuclei deviate from exact symmetry.
    """
    vector = np.asarray(dipole, dtype=float)
    part = invariant_vector(vector, symmetry)
    return part if np.linalg.norm(vector - part) < _noise_debye(symmetry) else vector


def _noise_debye(symmetry: Symmetry) -> float:
    return max(NOISE_DEBYE, DEBYE_PER_ANGSTROM * symmetry.deviation_angstrom)


def _noise(symmetry: Symmetry) -> float:
    return max(NOISE, PER_ANGSTROM * symmetry.deviation_angstrom)


def allowed_polarizability(tensor: ArrayLike, symmetry: Symmetry) -> Floats:
    """The invariant part of a (3, 3) tensor if the rest is noise (0.001 of its norm); else the whole."""
    whole = np.asarray(tensor, dtype=float)
    part = invariant_tensor(whole, symmetry)
    return part if np.linalg.norm(whole - part) < _noise(symmetry) * np.linalg.norm(whole) else whole


def invariant_vector(vector: Floats, symmetry: Symmetry) -> Floats:
    """Mean of a vector (3,) over the operations, in the frame of the geometry."""
    if symmetry.rotation_group == "C∞":  # only the identity is listed
        return np.asarray(symmetry.axes_abc[0] * (symmetry.axes_abc[0] @ vector))
    operations = [operation.matrix for operation in (*symmetry.rotations, *symmetry.improper)]
    mean = np.mean([matrix @ vector for matrix in operations], axis=0)
    return np.zeros(3) if symmetry.rotation_group == "D∞" else np.asarray(mean)


def invariant_tensor(whole: Floats, symmetry: Symmetry) -> Floats:
    """Mean of a tensor (3, 3) over the operations, in the frame of the geometry."""
    if symmetry.linear:
        along = symmetry.axes_abc[0]
        parallel = along @ whole @ along
        across = (np.trace(whole) - parallel) / 2
        return np.asarray(across * np.eye(3) + (parallel - across) * np.outer(along, along))
    operations = [operation.matrix for operation in (*symmetry.rotations, *symmetry.improper)]
    return np.asarray(np.mean([matrix @ whole @ matrix.T for matrix in operations], axis=0))


def refuse_forbidden_dipole(
    dipole_abc: ArrayLike, symmetry: Symmetry | None, frame: PrincipalFrame | None, weights: SpinWeights
) -> None:
    """Refuse a dipole with more than 0.001 D along a forbidden axis.

    Without a geometry, a component that joins levels of different spin weight is forbidden.

    Parameters
    ----------
    dipole_abc : (3,) array
        Debye, along the principal axes.
    symmetry : Symmetry or None
        Point group of the geometry, if known.
    frame : PrincipalFrame or None
        Principal axes of the geometry.
    weights : SpinWeights
        Nuclear-spin weights.

    Raises
    ------
    ValueError
        For such a dipole, with the allowed axes.
    """
    values = np.asarray(dipole_abc, dtype=float)
    if symmetry is not None and frame is not None:
        rest = values - frame.axes @ invariant_vector(values @ frame.axes, symmetry)
        wrong = [axis for axis, part in zip("abc", rest.tolist(), strict=True) if abs(part) > _noise_debye(symmetry)]
        by, allowed = f"a molecule of {symmetry.point_group}", _allowed_axes(symmetry, frame)
    else:
        barred = [axis for axis in "abc" if not _joins_equals(axis, weights)]
        wrong = [
            axis
            for axis, value in zip("abc", values.tolist(), strict=True)
            if axis in barred and abs(value) > NOISE_DEBYE
        ]
        by, allowed = _weights_text(weights), [axis for axis in "abc" if axis not in barred]
    if wrong:
        components = ", ".join(f"μ{axis} = {values['abc'.index(axis)]:g} D" for axis in wrong)
        raise ValueError(
            f"dipole {components}: {by} has none along {' and '.join(wrong)}; {_allowed_text('μ', allowed)}"
        )


def refuse_forbidden_polarizability(
    tensor_abc: ArrayLike, symmetry: Symmetry | None, frame: PrincipalFrame | None, weights: SpinWeights
) -> None:
    """Refuse a polarizability whose forbidden part exceeds 0.001 of its norm.

    Parameters
    ----------
    tensor_abc : (3, 3) array
        Å³, along the principal axes.
    symmetry : Symmetry or None
        Point group of the geometry, if known.
    frame : PrincipalFrame or None
        Principal axes of the geometry.
    weights : SpinWeights
        Nuclear-spin weights, used without a geometry.

    Raises
    ------
    ValueError
        For such a polarizability, with the allowed part.
    """
    whole = np.asarray(tensor_abc, dtype=float)
    if symmetry is not None and frame is not None:
        part = frame.axes @ invariant_tensor(frame.axes.T @ whole @ frame.axes, symmetry) @ frame.axes.T
        if np.linalg.norm(whole - part) > _noise(symmetry) * np.linalg.norm(whole):
            elements = [f"α{'abc'[i]}{'abc'[j]} = {whole[i, j]:g}" for i in range(3) for j in range(i, 3)]
            allowed = [f"{part[i, j]:.4g}" for i in range(3) for j in range(i, 3)]
            raise ValueError(
                f"polarizability {', '.join(elements)} Å³: not invariant under {symmetry.point_group}; the "
                f"invariant part is {', '.join(allowed)} in the same order"
            )
        return
    for name, axis in _TENSOR.items():
        i, j = ("abc".index(letter) for letter in name)
        if abs(whole[i, j]) > NOISE * np.linalg.norm(whole) and not _joins_equals(axis, weights):
            raise ValueError(
                f"polarizability α{name} = {whole[i, j]:g} Å³: {_weights_text(weights)} has none, since it would join levels of "
                "different nuclear-spin weight; give 0"
            )


def _allowed_axes(symmetry: Symmetry, frame: PrincipalFrame) -> list[str]:
    """The principal axes along which symmetry allows a dipole."""
    shares = [frame.axes @ invariant_vector(axis, symmetry) for axis in frame.axes]
    return [name for i, name in enumerate("abc") if abs(shares[i][i]) > 0.5]


def _allowed_text(letter: str, axes: list[str]) -> str:
    return f"symmetry allows {' and '.join(letter + axis for axis in axes)} alone" if axes else "symmetry allows none"


def _joins_equals(axis: str, weights: SpinWeights) -> bool:
    """Whether a dipole component joins only levels of equal weight, according to the classes of the weights."""
    weight_of = dict(zip(weights.classes, weights.values, strict=True))
    if weights.rule == "KaKc":
        return all(weight_of[first] == weight_of[other] for first, other in _JOINED[axis])
    if weights.rule == "J":
        return weight_of["even"] == weight_of["odd"]
    if weights.rule == "irrep":
        return len(set(weight_of.values())) == 1
    return weights.rule != "K" or weight_of.get("0even", 0) == weight_of.get("0odd", 0)


def _weights_text(weights: SpinWeights) -> str:
    classes = ", ".join(f"{name} {value}" for name, value in zip(weights.classes, weights.values, strict=True))
    return f"a molecule of spin weights {classes}"
