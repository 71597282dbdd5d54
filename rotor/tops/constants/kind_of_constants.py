"""Kind of top, reduction and representation of a set of constants, from its names and values; names allowed for each kind."""

from __future__ import annotations

import math
from collections.abc import Mapping

from rotor.tops.constants import operators as published
from rotor.tops.constants.operators import KINDS, axis_order

RIGID = ("A", "B", "C")
LINEAR, SPHERICAL, SYMMETRIC = tuple(published.LINEAR), tuple(published.SPHERICAL), tuple(published.SYMMETRIC)
S_REDUCTION, A_REDUCTION = tuple(published.S_REDUCTION), tuple(published.A_REDUCTION)
DISTORTION = {"linear": LINEAR, "spherical": SPHERICAL, "prolate": SYMMETRIC, "oblate": SYMMETRIC}
REDUCED = {"A": A_REDUCTION, "S": S_REDUCTION}
_SHARED = {*RIGID, *A_REDUCTION} & {*RIGID, *S_REDUCTION}
KNOWN = tuple(dict.fromkeys((*RIGID, *LINEAR, *SPHERICAL, *S_REDUCTION, *A_REDUCTION)))


def ray_kappa(a: float, b: float, c: float) -> float:
    """Ray's asymmetry parameter κ = (2B - A - C)/(A - C): -1 prolate, +1 oblate; -1 for a linear top (A infinite).

    Source: Ray, Z. Phys. 78 (1932) 74. Raises ValueError for a spherical top, where κ is undefined.

    >>> ray_kappa(3.0, 2.0, 1.0)
    0.0
    """
    if math.isinf(a):
        return -1.0  # the prolate limit, as C/A tends to 0
    if not a >= b >= c or a == c:
        raise ValueError(f"Ray's κ of A = {a!r}, B = {b!r}, C = {c!r}: expected A >= B >= C and A > C")
    return (2 * b - a - c) / (a - c)


def vocabulary(kind: str, reduction: str | None = None) -> tuple[str, ...]:
    """The names of constants for a kind of top; for an asymmetric top without a reduction, those of both reductions.

    >>> vocabulary("linear")
    ('B', 'D', 'H', 'L')
    """
    if kind == "asymmetric":
        return RIGID + (REDUCED[reduction] if reduction else tuple(dict.fromkeys(S_REDUCTION + A_REDUCTION)))
    return (("B",) if kind == "linear" else RIGID) + DISTORTION[kind]


def resolve_kind(values: Mapping[str, float], kind: str | None) -> str:
    """The given kind if the constants fit it, else the kind by the rule of `Constants`; ValueError if they do not fit."""
    rigid = "".join(name for name in RIGID if name in values)
    if kind is None:
        return _by_rule(rigid, values)
    if kind not in KINDS:
        raise ValueError(f"kind {kind!r}: a top is one of {', '.join(KINDS)}")

    fits = {
        "linear": rigid == "B",
        "spherical": "B" in rigid and len({values[name] for name in rigid}) == 1,
        "prolate": rigid == "AB" or (rigid == "ABC" and values["B"] == values["C"]),
        "oblate": rigid == "BC" or (rigid == "ABC" and values["A"] == values["B"]),
        "asymmetric": rigid == "ABC",
    }
    if not fits[kind]:
        needed = {
            "linear": "B alone",
            "spherical": "B, or equal A, B, C",
            "prolate": "A and B, or A, B, C with B = C exactly",
            "oblate": "B and C, or A, B, C with A = B exactly",
            "asymmetric": "A, B and C",
        }[kind]
        present = ", ".join(f"{name} = {values[name]!r}" for name in rigid) or "none of A, B, C"
        raise ValueError(f"kind {kind!r} needs {needed}, but the constants have {present}")
    return kind


def _by_rule(rigid: str, values: Mapping[str, float]) -> str:
    if rigid not in ("B", "AB", "BC", "ABC"):
        raise ValueError(
            f"constants with {rigid or 'none of A, B, C'}: give B (linear molecule), A and B (prolate top), "
            "B and C (oblate top) or A, B and C"
        )
    if rigid == "B":
        return "linear"
    if len({values[name] for name in rigid}) == 1:
        return "spherical"
    if rigid == "AB" or (rigid == "ABC" and values["B"] == values["C"]):
        return "prolate"
    if rigid == "BC" or values["A"] == values["B"]:
        return "oblate"
    return "asymmetric"


def resolve_reduction(kind: str, names: Mapping[str, float], reduction: str | None) -> str | None:
    """The given reduction, or the one that the names imply; None for rigid asymmetric tops and all other kinds."""
    if reduction not in (None, "A", "S"):
        raise ValueError(f"reduction {reduction!r}: Watson's reductions are 'A' and 'S'")
    if kind != "asymmetric":
        if reduction:
            raise ValueError(f"reduction {reduction!r} belongs to asymmetric tops; the kind here is {kind!r}")
        return None

    belonging = {key: [n for n in names if n in table and n not in _SHARED] for key, table in REDUCED.items()}
    if belonging["A"] and belonging["S"]:
        raise ValueError(
            f"both reductions in one set: {', '.join(belonging['A'])} (A) with {', '.join(belonging['S'])} (S)"
        )
    implied = next((key for key, members in belonging.items() if members), None)
    if reduction and implied and reduction != implied:
        raise ValueError(
            f"reduction {reduction!r}, but {', '.join(belonging[implied])} belong to the {implied}-reduction"
        )
    if not reduction and not implied and any(name in _SHARED - {*RIGID} for name in names):
        raise ValueError("octic and decic names fit both reductions; give reduction='A' or reduction='S'")
    return reduction or implied


def resolve_representation(kind: str, values: Mapping[str, float], representation: str | None) -> str | None:
    """The given representation, or Ir for κ <= 0 and IIIl for κ > 0; None for all kinds but asymmetric tops."""
    if representation is not None:
        axis_order(representation)  # raises for an unknown representation
    if kind != "asymmetric":
        if representation:
            raise ValueError(f"representation {representation!r} belongs to asymmetric tops; kind is {kind!r}")
        return None
    if representation:
        return representation
    a, b, c = values["A"], values["B"], values["C"]
    return "IIIl" if a > c and ray_kappa(a, b, c) > 0 else "Ir"
