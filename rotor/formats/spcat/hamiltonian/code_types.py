"""Meaning of TYP in a parameter code: rank, axis, change of K, and name of the operator between two states.

| TYP | rank L | axis |
|---|---|---|
| 3 + n | 2n | none: invariant under all half turns about a, b, c |
| 11 + n | 2n + 1 | none |
| 20 + n, 40 + n, 60 + n | n + 1 | a, b, c: invariant under the half turn about this axis only |

(H. M. Pickett, documentation of SPFIT and SPCAT.) Tensors of odd rank change sign under time reversal.
"""

from __future__ import annotations

from math import sqrt

ODD = {20: "a", 40: "b", 60: "c"}  # change sign under time reversal
CROSS = {21: "bc", 41: "ac", 61: "ab"}
TYPES_BETWEEN = {  # interactions of two states without spins, by name
    "G_a": 20,
    "G_b": 40,
    "G_c": 60,
    "F_bc": 21,
    "F_ac": 41,
    "F_ab": 61,
    "W": 0,
    "W_pm2": 4,
    "W_pm4": 5,
    "W_pm6": 6,
}
PAIRS = {letters: ("abc".index(letters[0]), "abc".index(letters[1])) for letters in sorted(CROSS.values())}
TURNS = {
    "": (0, 0),
    "a": (0, 1),
    "b": (1, 1),
    "c": (1, 0),
}  # species of an operator along an axis: parities of Ka and Kc that it changes


def order_of(typ: int) -> int:
    """Rank L of the tensor of TYP 3 + n (2n), 11 + n (2n + 1), and of 20 + n, 40 + n, 60 + n (n + 1).

    >>> order_of(5), order_of(12), order_of(21), order_of(62)
    (4, 3, 2, 3)
    """
    if typ < 12:
        return 2 * (typ - 3)
    return 2 * (typ - 11) + 1 if typ < 20 else typ % 20 + 1


def is_odd_type(typ: int) -> bool:
    """Whether time reversal changes the sign of an operator without spins and series."""
    return 12 <= typ < 80 and order_of(typ) % 2 == 1


def axis_of(typ: int) -> str:
    """The axis a, b or c of the only half turn that leaves the operator of a TYP invariant; "" if all half turns do.

    >>> [axis_of(typ) for typ in (0, 4, 21, 40, 62, 80)]
    ['', '', 'a', 'b', 'c', '']
    """
    return {1: "a", 2: "b", 3: "c"}.get(typ // 20, "")


def factor_below(typ: int) -> float:
    """Factor of {Z, N₊^(L-1)} with its conjugate: ¼ √(2L), twice that for TYP 12 to 19."""
    return sqrt(2 * order_of(typ)) * (0.5 if typ < 20 else 0.25)


def shape_of(typ: int, z: str) -> tuple[int, bool]:
    """K of the tensor of TYP 12 to 79, and whether it is E + E† or (E - E†)/i, by its species (`operators._tensor_of_n`)."""
    x, y = ("c", "b") if z == "a" else ("a", "b")
    order = order_of(typ)
    along = {"": "", x: "x", y: "y", z: "z"}[axis_of(typ)]
    k = order - (order % 2 if along in ("z", "") else 1 - order % 2)
    return k, along == ("x" if k == order else "y") or (along == "z" and k < order)


def delta_k(typ: int, oblate: bool) -> int:
    """The change of K of an operator; the part of Nb² and Nc² with ΔK = 2 does not count.

    >>> [delta_k(typ, False) for typ in (1, 4, 5, 20, 21, 40, 41, 42, 61)]
    [0, 2, 4, 0, 2, 1, 1, 3, 1]
    """
    if typ < 4 or typ >= 80:
        return 0
    return order_of(typ) if typ < 12 else shape_of(typ, "c" if oblate else "a")[0]
