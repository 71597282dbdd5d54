"""Checks of states, couplings and dipoles against the names of a top's constants, its geometry and its spin weights.

Two couplings between the same two states are allowed together only if no operation of the point group distinguishes them. A
dipole between two states joins only levels of equal nuclear-spin weight, since light does not convert ortho into para.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotor.tops.constants.constants import Constants
from rotor.tops.constants.kind_of_constants import vocabulary
from rotor.tops.constants.operators import spelled_powers
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.states.state_constants import StateConstants, Vector

if TYPE_CHECKING:
    from rotor.geometry.inertia import PrincipalFrame
    from rotor.molecules.symmetry.point_group import Symmetry

NOISE_DEBYE = 1e-3
_ALONG = 1e-2  # largest off-diagonal element of an operation whose axes are the principal axes
_FIGURE = {"linear": 0, "prolate": 0, "oblate": 2}
_JOINED = ((("ee", "eo"), ("oe", "oo")), (("ee", "oo"), ("eo", "oe")), (("ee", "oe"), ("eo", "oo")))  # by μa, μb, μc


def refuse_incomplete_states(states: StateConstants, kind: str, constants: Constants) -> None:
    """Raise ValueError if a further state lacks one of A, B, C of the first, or has a constant of another kind of top."""
    rigid = [name for name in constants.values if name in ("A", "B", "C")]
    known = ("E", *vocabulary(kind, constants.reduction))
    for v in range(1, states.count):
        strange = [name for name in states.for_state(v) if name not in known and not spelled_powers(name)]
        if strange:
            raise ValueError(f"{strange[0]}[{v}]: a state of this {kind} top has {', '.join(known)}")
        if kind == "asymmetric" and constants.reduction is None:
            _refuse_reduced(states, v)
        missing = [name for name in rigid if name not in states.for_state(v)]
        if missing:
            raise ValueError(
                f"state {states.name_of(v)}: no {', '.join(f'{name}[{v}]' for name in missing)}; each state has constants of its own"
            )


def _refuse_reduced(states: StateConstants, v: int) -> None:
    """Raise ValueError for distortion constants of a further state if the first state has no reduction."""
    reduced = [name for name in states.for_state(v) if name not in ("E", "A", "B", "C") and not spelled_powers(name)]
    if reduced:
        raise ValueError(
            f"{reduced[0]}[{v}]: the constants of the first state are rigid and have no reduction; "
            'add it to the first state, reduction = "A" or "S"'
        )


def refuse_forbidden_couplings(states: StateConstants, symmetry: Symmetry, frame: PrincipalFrame) -> None:
    """Raise ValueError for couplings of an asymmetric top that its geometry does not allow together."""
    group, even = _even_rotations(symmetry, frame)
    if len(even) < 3:
        states.refuse_couplings(group, even)


def _even_rotations(symmetry: Symmetry, frame: PrincipalFrame) -> tuple[str, str]:
    """The point group, and those of the axes "abc" about which a rotation is totally symmetric in it.

    A rotation is an axial vector; an operation R multiplies it by det R times R_xx.
    """
    even_axes = "abc"
    for operation in (*symmetry.rotations, *symmetry.improper):
        matrix = frame.axes @ operation.matrix @ frame.axes.T
        if np.abs(matrix - np.diag(np.diag(matrix))).max() < _ALONG:
            # angular momenta are axial vectors: reflections act with the opposite sign
            signs = np.diag(matrix) * np.linalg.det(matrix)
            even_axes = "".join(axis for axis, sign in zip("abc", signs, strict=True) if sign > 0 and axis in even_axes)
    return symmetry.point_group, even_axes


def refuse_forbidden_state_dipoles(
    states: StateConstants, kind: str, spin_weights: SpinWeights, dipole_abc_debye: Vector | None
) -> None:
    """Refuse a dipole in a state, or between two, that would join levels of different nuclear-spin weight.

    Parameters
    ----------
    states : StateConstants
        Dipoles and spin weights of the states.
    kind : str
        Kind of top.
    spin_weights : SpinWeights
        Weights of the first state, and of states without an entry in `states.weights`.
    dipole_abc_debye : (3,) tuple or None
        Dipole of states without an entry in `states.dipoles`.

    Raises
    ------
    ValueError
        Names the component, its value and the states. Dipoles that the weights cannot decide are accepted.
    """
    moments = {} if dipole_abc_debye is None else {(v, v): dipole_abc_debye for v in range(states.count)}
    for (upper, lower), moment in (moments | dict(states.dipoles)).items():
        first, second = (states.weights.get(v, spin_weights) for v in (upper, lower))
        for axis, value in enumerate(moment):
            if abs(value) > NOISE_DEBYE and not _joins_equals(axis, kind, first, second):
                where = f"in state {states.name_of(upper)}" if upper == lower else "between states "
                where += "" if upper == lower else f"{states.name_of(lower)} and {states.name_of(upper)}"
                raise ValueError(
                    f"dipole μ{'abc'[axis]} = {value:g} D {where}: it would join levels of different nuclear-spin weight; give 0, "
                    "or other spin weights of the states"
                )


def _joins_equals(axis: int, kind: str, first: SpinWeights, second: SpinWeights) -> bool:
    """Whether μ along an axis joins only levels of equal weight, for two states whose weights follow the same rule."""
    if first.rule != second.rule:
        return False
    first_weights, other = (dict(zip(weights.classes, weights.values, strict=True)) for weights in (first, second))
    if first.rule == "KaKc":
        return all(first_weights[a] == other[b] and first_weights[b] == other[a] for a, b in _JOINED[axis])
    if first.rule == "J":
        return first_weights["even"] == other["odd"] and first_weights["odd"] == other["even"]
    if first.rule == "K" and axis == _FIGURE.get(kind):  # μ along the axis keeps K, and for K = 0 changes J by one
        both = [
            (by_class.get("0even", by_class.get("0")), by_class.get("0odd", by_class.get("0")))
            for by_class in (first_weights, other)
        ]
        same = [
            [value for name, value in by_class.items() if not name.startswith("0")]
            for by_class in (first_weights, other)
        ]
        return both[0] == both[1][::-1] and same[0] == same[1]
    return True
