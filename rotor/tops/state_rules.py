"""Which states, couplings and dipoles of states a top can have: its constants' names, its geometry and its spin weights decide.

Two couplings between the same two states are allowed together only if no operation of the point group tells them apart. A
dipole between two states joins levels of equal nuclear-spin weight alone, since light does not turn ortho into para.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotor.tops.constants import vocabulary
from rotor.tops.operators import powers_of_spelled
from rotor.tops.spin_weights import SpinWeights
from rotor.tops.state_constants import StateConstants, Vector

if TYPE_CHECKING:
    from rotor.geometry.inertia import PrincipalFrame
    from rotor.molecules.symmetry.point_group import Symmetry
    from rotor.tops.top import Top

NOISE_DEBYE = 1e-3
_ALONG = 1e-2  # of the elements of an operation, below which it has the principal axes for its own
_FIGURE = {"linear": 0, "prolate": 0, "oblate": 2}
_JOINED = ((("ee", "eo"), ("oe", "oo")), (("ee", "oo"), ("eo", "oe")), (("ee", "oe"), ("eo", "oo")))  # by μa, μb, μc


def one_state(top: Top, what: str) -> Top:
    """The top itself where it has one state; ValueError, with what cannot be computed, where it has more.

    >>> from rotor.tops.top import Top
    >>> one_state(Top.from_constants("B=5 MHz"), "levels in a field").kind
    'linear'
    """
    if top.states is not None:
        names = ", ".join(top.states.name_of(v) for v in range(top.states.count))
        raise ValueError(
            f"{what} of {top.name or 'this top'}: computed for tops of one state, and this one has {top.states.count} ({names}); "
            "give the constants of one of them alone"
        )
    return top


def refuse_impossible_states(states: StateConstants, top: Top) -> None:
    """ValueError for states that a top cannot have.

    Each needs the same of A, B, C as the top; couplings are those that its geometry allows together; dipoles join levels of equal
    weight. What neither geometry nor weights tell is taken as given.
    """
    rigid = [name for name in top.constants.values if name in ("A", "B", "C")]
    known = ("E", *vocabulary(top.kind, top.constants.reduction))
    for v in range(1, states.count):
        strange = [name for name in states.of_state(v) if name not in known and not powers_of_spelled(name)]
        if strange:
            raise ValueError(f"{strange[0]}[{v}]: a state of this {top.kind} top has {', '.join(known)}")
        missing = [name for name in rigid if name not in states.of_state(v)]
        if missing:
            raise ValueError(
                f"state {states.name_of(v)}: no {', '.join(f'{name}[{v}]' for name in missing)}; each state has constants of its own"
            )
    if top.symmetry is not None and top.frame is not None and top.kind == "asymmetric":
        group, even = _even_rotations(top.symmetry, top.frame)
        if len(even) < 3:
            states.refuse_couplings(group, even)
    _refuse_dipoles(states, top)


def _even_rotations(symmetry: Symmetry, frame: PrincipalFrame) -> tuple[str, str]:
    """The point group, and the axes of "abc" about which a rotation is totally symmetric in it.

    A rotation is an axial vector, that an operation R multiplies by det R times R_xx.
    """
    found = "abc"
    for operation in (*symmetry.rotations, *symmetry.improper):
        matrix = frame.axes @ operation.matrix @ frame.axes.T
        if np.abs(matrix - np.diag(np.diag(matrix))).max() < _ALONG:
            signs = np.diag(matrix) * np.linalg.det(matrix)
            found = "".join(axis for axis, sign in zip("abc", signs, strict=True) if sign > 0 and axis in found)
    return symmetry.point_group, found


def _refuse_dipoles(states: StateConstants, top: Top) -> None:
    own: dict[tuple[int, int], Vector] = {}
    if top.dipole_abc_debye is not None:
        own = {(v, v): top.dipole_abc_debye for v in range(states.count)}
    for (upper, lower), moment in (own | dict(states.dipoles)).items():
        first, second = (states.weights.get(v, top.spin_weights) for v in (upper, lower))
        for axis, value in enumerate(moment):
            if abs(value) > NOISE_DEBYE and not _joins_equals(axis, top.kind, first, second):
                where = f"in state {states.name_of(upper)}" if upper == lower else "between states "
                where += "" if upper == lower else f"{states.name_of(lower)} and {states.name_of(upper)}"
                raise ValueError(
                    f"dipole μ{'abc'[axis]} = {value:g} D {where}: it would join levels of different nuclear-spin weight; give 0"
                )


def _joins_equals(axis: int, kind: str, first: SpinWeights, second: SpinWeights) -> bool:
    """Whether μ along one axis joins levels of equal weight alone, of two states with weights of one rule."""
    if first.rule != second.rule:
        return False
    one, other = (dict(zip(of.classes, of.values, strict=True)) for of in (first, second))
    if first.rule == "KaKc":
        return all(one[a] == other[b] and one[b] == other[a] for a, b in _JOINED[axis])
    if first.rule == "J":
        return one["even"] == other["odd"] and one["odd"] == other["even"]
    if first.rule == "K" and axis == _FIGURE.get(kind):  # along the axis K stays, and J of K = 0 changes by one
        both = [(of.get("0even", of.get("0")), of.get("0odd", of.get("0"))) for of in (one, other)]
        same = [[value for name, value in of.items() if not name.startswith("0")] for of in (one, other)]
        return both[0] == both[1][::-1] and same[0] == same[1]
    return True
