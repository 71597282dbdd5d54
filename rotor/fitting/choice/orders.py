"""The order of a constant: the highest power of the angular momentum in its operator. Models are built up in this order."""

from __future__ import annotations

from rotor.fitting.top_constants import ConstantSet, TopConstants
from rotor.tops.constants.operators import distortion_terms, spelled_powers
from rotor.tops.constants.parameter_names import parse_name


def j_order(name: str, constants: ConstantSet) -> int:
    """The highest power of J in a constant's operator: 2 for A, 4 for DeltaJ, 6 for PhiK; 1 for G_c, 0 for chi_aa.

    >>> from rotor.tops.constants.constants import Constants
    >>> j_order("PhiK", Constants(A=9.0, B=3.0, C=2.0, reduction="A"))
    6
    """
    if isinstance(constants, TopConstants) and set("[(") & set(name):
        return _named_order(name, constants)
    if name in ("A", "B", "C"):
        return 2
    spelled = spelled_powers(name)
    terms_by_name = distortion_terms(constants.kind, constants.reduction)
    if not spelled and name not in terms_by_name:
        raise ValueError(
            f"{name!r} is not a constant of the kind {constants.kind}; expected one such as {', '.join(list(terms_by_name)[:3])}"
        )
    terms = {spelled: 1.0} if spelled else terms_by_name[name]
    return max(2 * (p + q + n) for p, q, n in terms)  # X^p Jz^2q J±^2n: each of p, q, n counts two powers of J


def _named_order(name: str, constants: TopConstants) -> int:
    """Order of a constant of a further state, of a pair of states, or of spins; spin-rotation and G have one power of N."""
    head = name.partition("[")[0]
    if "(" not in name and "," not in name:
        return 0 if head == "E" else j_order(head, constants.top.constants)
    parts = parse_name(name)
    kind, _, letters = parts.symbol.partition("_")
    powers = {"G": 1, "F": 2, "C": 1, "eps": 1, "gamma": 1}.get(kind, 0)
    if kind == "W" and letters:
        powers = int(letters.removeprefix("pm"))
    return powers + 2 * (parts.n2 + parts.nz2) + parts.ns
