"""Constants of an isotopologue from those of its parent: matching of the axes, their rotation, and scaling.

Measured constants of the parent are multiplied by the ratio of calculated ones along matched axes, X' = X · X'_calc / X_calc.
Most of the effect of vibration cancels in this ratio.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.geometry.inertia import PrincipalFrame
from rotor.table import with_article
from rotor.tops.components import symmetric_tensor
from rotor.tops.constants.constants import Constants
from rotor.tops.constants.operators import distortion_terms, spelled_powers
from rotor.tops.top import Top

# Errors of scaled distortion constants against fitted ones; test_isotopologues.py measures them again.
_OFF_HEAVY = "by up to 1.1 % (quartic) and 10 % (sextic) for replaced heavy atoms (OCS, HC3N)"
_OFF_HYDROGEN = (
    "by 4 % (DC3N), 3 to 13 % (H2O to D2O) and 15 to 27 % (NH3 to ND3) for replaced hydrogen; sextic ones by up to 107 %, so "
    "that even their sign may be wrong"
)
TURNED_TOO_FAR_DEGREES = 5.0  # beyond it distortion constants are not carried over


def _alike(kind: str) -> tuple[tuple[int, ...], ...]:
    """Groups of axes that symmetry does not distinguish."""
    return {"spherical": ((0, 1, 2),), "oblate": ((0, 1), (2,)), "asymmetric": ((0,), (1,), (2,))}.get(
        kind, ((0,), (1, 2))
    )


# Relative errors of scaled constants, measured on molecules with a replaced heavy atom and with replaced hydrogen.
HEAVY_ERROR, HYDROGEN_ERROR = 2e-4, 8e-3


def matched_axes(parent: Top, turned: Top) -> tuple[str, float]:
    """The parent's axes nearest to a, b, c, and the smallest cos² of the matches; degenerate axes are matched as a group."""
    assert parent.frame is not None  # both are tops of a geometry
    assert turned.frame is not None
    squares = (turned.frame.axes @ parent.frame.axes.T) ** 2
    inside = np.zeros((3, 3))  # squared projection of each axis on the degenerate space of the other
    for axes, other in itertools.product(map(list, _alike(turned.kind)), map(list, _alike(parent.kind))):
        block = np.ix_(axes, other)
        inside[block] = squares[block].sum() / min(len(axes), len(other))
        # equal moments: only the overlap of the whole plane or space has a meaning
        squares[block] = squares[block].mean()
    ways = itertools.permutations(range(3))  # the identity comes first, so that it wins among equal overlaps
    best = max(ways, key=lambda way: round(sum(squares[i, j] for i, j in enumerate(way)), 9))
    return "".join("abc"[j] for j in best), min(float(inside[i, j]) for i, j in enumerate(best))


def turned_degrees(parent: Top, turned: Top, axes: str) -> float:
    """Angle between matched axes in degrees; for a symmetric top, the angle of its unique axis."""
    assert parent.frame is not None  # both are tops of a geometry
    assert turned.frame is not None
    if "spherical" in (parent.kind, turned.kind):
        return 0.0
    if parent.kind == turned.kind == "asymmetric":
        matched = parent.frame.axes[["abc".index(letter) for letter in axes]]
        return min(_angle(turned.frame.axes @ (matched * signs).T) for signs in _proper_signs(matched))
    asymmetric, other = (turned, parent) if parent.kind == "asymmetric" else (parent, turned)
    unique = asymmetric.frame.axes[2 if asymmetric.kind == "oblate" else 0]  # type: ignore[union-attr]  # asserted above
    nearest = float(np.abs(other.frame.axes @ unique).max())  # type: ignore[union-attr]
    return math.degrees(math.atan2(math.sqrt(max(0.0, 1 - nearest**2)), nearest))


def _proper_signs(axes: Floats) -> Iterator[Floats]:
    """Signs (3, 1) of axes that make them right-handed."""
    for signs in itertools.product((1.0, -1.0), repeat=3):
        if math.prod(signs) * np.linalg.det(axes) > 0:
            yield np.array(signs)[:, None]


def _angle(rotation: Floats) -> float:
    """Angle of a rotation matrix in degrees, exact for small angles too."""
    vector = np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    return math.degrees(math.atan2(float(np.linalg.norm(vector)), float(np.trace(rotation)) - 1))


def carried_over(parent: Top, rigid: Top, turned: Top, axes: str, angle: float) -> Top:
    """The isotopologue with the parent's constants scaled to it, if these differ from those of the parent's geometry.

    Parameters
    ----------
    parent : Top
        The parent with its measured constants.
    rigid : Top
        The parent with the constants of its geometry.
    turned : Top
        The isotopologue with the constants of its geometry.
    axes : str
        The parent's axes nearest to a, b, c, from `matched_axes`.
    angle : float
        Rotation of the axes in degrees.

    Returns
    -------
    Top
        The parent itself if no mass differs; `turned` if the parent's constants are those of its geometry.

    Notes
    -----
    Neglected: the effect of vibration on the ratio of constants. Scaled constants differed from measured ones by 0.02 % for
    replaced heavy atoms, and by up to 0.8 % for replaced hydrogen.
    """
    if _masses(turned) == _masses(parent):
        return parent
    if _is_rigid(parent.constants, rigid.constants):
        return turned
    ratios = _ratios(rigid, turned, axes)
    order = ["abc".index(letter) for letter in axes]
    values = np.array(parent.constants.rigid)[order] * ratios
    values, turned = _in_order(values, turned)
    constants = _kind_constants(values, turned.kind)
    name = parent.name or "the parent"
    note = (
        f"constants are those of {name} times the ratio calculated from its geometry; constants scaled in this way were wrong by "
        f"{100 * HEAVY_ERROR:g} % for replaced heavy atoms, and by up to {100 * HYDROGEN_ERROR:g} % for replaced hydrogen"
    )
    origin = f" ({parent.source})" if parent.source else ""
    source = f"scaled from {name}{origin} by {_ratio_text(ratios, axes)}"
    hydrogen = _hydrogen_replaced(parent, turned)
    constants, annotated = _with_distortion(parent, constants, axes, angle, hydrogen)
    error = HYDROGEN_ERROR if hydrogen else HEAVY_ERROR
    notes = (*turned.notes, note, *annotated)
    return replace(turned, constants=constants, source=source, notes=notes, scaling_error=error)


def _hydrogen_replaced(parent: Top, turned: Top) -> bool:
    symbols = parent.molecule.symbols if parent.molecule else ()
    return any(s == "H" and a != b for s, a, b in zip(symbols, _masses(parent), _masses(turned), strict=True))


def _masses(top: Top) -> tuple[int, ...]:
    return top.molecule.mass_numbers if top.molecule else ()


def _is_rigid(constants: Constants, rigid: Constants) -> bool:
    """Whether the constants equal those of the rigid geometry."""
    same = constants.values.keys() == rigid.values.keys()
    return same and all(math.isclose(constants[name], rigid[name], rel_tol=1e-9) for name in rigid.values)


def _ratios(rigid: Top, turned: Top, axes: str) -> Floats:
    """X'_calc / X_calc along a, b, c; 1 along the axis of a linear molecule, which has no A."""
    before = np.array(rigid.constants.rigid)[["abc".index(letter) for letter in axes]]
    after = np.array(turned.constants.rigid)
    finite = np.isfinite(before)
    # a linear top has no A to scale
    return np.where(finite, np.where(finite, after, 1.0) / np.where(finite, before, 1.0), 1.0)


def _ratio_text(ratios: Floats, axes: str) -> str:
    return ", ".join(
        f"{axis.upper()} {ratio:.5f}" + (f" (from the parent's {other.upper()})" if axis != other else "")
        for axis, other, ratio in zip("abc", axes, ratios, strict=True)
    )


def _in_order(values: Floats, turned: Top) -> tuple[Floats, Top]:
    """Constants in falling order, with frame and tensors in the same order; near a symmetric top, scaling may exchange axes."""
    order = np.argsort(-values, kind="stable")  # stable: equal constants keep their axes
    if turned.kind != "asymmetric" or (order == np.arange(3)).all():
        return values, turned
    assert turned.frame is not None  # a top of a geometry has one
    axes = turned.frame.axes[order]
    axes = axes * np.array([[1.0], [1.0], [np.sign(np.linalg.det(axes))]])
    change = axes @ turned.frame.axes.T
    frame = PrincipalFrame(turned.frame.moments[order], axes, turned.frame.centre)
    note = "scaling changed the order of the constants: a, b and c are named by the scaled constants"
    dipole, tensor = turned.dipole_abc_debye, turned.polarizability_abc_angstrom3
    moved: dict[str, Any] = {"frame": frame, "notes": (*turned.notes, note)}
    if dipole is not None:
        moved["dipole_abc_debye"] = tuple((change @ np.array(dipole)).tolist())
    if tensor is not None:
        moved["polarizability_abc_angstrom3"] = symmetric_tensor(change @ np.array(tensor) @ change.T)
    annotated = replace(turned, **moved)
    return values[order], annotated


def _kind_constants(values: Floats, kind: str) -> Constants:
    a, b, c = (float(value) for value in values)
    return {
        "linear": lambda: Constants(B=(b + c) / 2, kind=kind),
        "spherical": lambda: Constants(B=(a + b + c) / 3, kind=kind),
        "prolate": lambda: Constants(A=a, B=(b + c) / 2, kind=kind),
        "oblate": lambda: Constants(B=(a + b) / 2, C=c, kind=kind),
        "asymmetric": lambda: Constants(A=a, B=b, C=c, kind=kind),
    }[kind]()


def _with_distortion(
    parent: Top, constants: Constants, axes: str, angle: float, hydrogen: bool
) -> tuple[Constants, tuple[str, ...]]:
    """The parent's distortion constants scaled by powers of the rotational constants; none if the axes changed.

    The coefficient of J^2p Jz^2q J±^2n is multiplied by ρ^(p+n) ρz^q, with the ratios ρ of Bx + By and ρz of Bz. For a diatomic
    molecule this is exact: D scales as B², H as B³ (J. L. Dunham, Phys. Rev. 41, 721 (1932); D = 4 B³/ω² and ω² is
    proportional to B). Neglected: a rotation of the axes mixes the constants. From H2O to HDO, ΔJK even changes its sign.
    """
    old = parent.constants
    names = [name for name in old.values if name not in ("A", "B", "C")]
    if not names:
        return constants, ()
    if constants.kind != old.kind or axes != "abc" or angle > TURNED_TOO_FAR_DEGREES:
        return constants, (_why_rigid(old, constants, axes, angle),)
    if constants.kind == "asymmetric":
        constants = constants.replace(representation=old.representation)
    across, along = (new / before for new, before in zip(_z_constants(constants), _z_constants(old), strict=True))
    scaled = {name: old[name] * across ** (p + n) * along**q for name, (p, q, n) in _powers(old, names).items()}
    changes = {**scaled, "reduction": old.reduction} if old.reduction else scaled
    note = (
        f"distortion constants are the parent's, scaled with powers of the rotational constants (D as B², H as B³); constants scaled "
        f"in this way were wrong {_OFF_HYDROGEN if hydrogen else _OFF_HEAVY}"
    )
    return constants.replace(**changes), (note,)


def _powers(constants: Constants, names: list[str]) -> dict[str, tuple[int, int, int]]:
    """Powers (p, q, n) of the operator of each distortion constant."""
    table = distortion_terms(constants.kind, constants.reduction)
    spelled = {name: spelled_powers(name) for name in names}
    return {name: powers if (powers := spelled[name]) else next(iter(table[name])) for name in names}


def _why_rigid(old: Constants, constants: Constants, axes: str, angle: float) -> str:
    if constants.kind != old.kind:
        why = f"it is {with_article(constants.kind)} top, the parent {with_article(old.kind)} one"
    elif axes != "abc":
        why = f"its axes a, b, c are nearest to the parent's {', '.join(axes)}"
    else:
        why = f"its axes are turned by {angle:.1f}°"
    return f"no distortion constants: those of the parent cannot be scaled, because {why}; a force field gives them (rotor.tops.distortion)"


def _z_constants(constants: Constants) -> tuple[float, float]:
    """½(Bx + By) and Bz; 1 in place of Bz for a linear or spherical top, whose terms have no Jz."""
    a, b, c = constants.rigid
    if constants.kind in ("linear", "spherical"):
        return b, 1.0
    if constants.kind in ("prolate", "oblate"):
        return b, a if constants.kind == "prolate" else c
    z = {"I": 0, "II": 1, "III": 2}[str(constants.representation).rstrip("rl")]
    return (a + b + c - (a, b, c)[z]) / 2, (a, b, c)[z]
