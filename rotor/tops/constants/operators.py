"""Operators behind the published names of constants, and names for terms without a published name.

A term of the effective Hamiltonian of one vibrational state is J^2p Jz^2q (n = 0) or J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊, identified
by its powers (p, q, n). Watson's names denote such terms with a sign, such as ΔJ for -J⁴. A term without a name is spelled
out: `J4Jz2Jpm6` is J⁴ ½[Jz², J₊⁶ + J₋⁶]₊, with the exponents of the angular momentum.

Names and signs: J. K. G. Watson, "Aspects of quartic and sextic centrifugal effects", in Vibrational Spectra and
Structure 6 (1977), eq. 39 (A) and table 6 (S); octic names as in Watson, J. Mol. Spectrosc. 103 (1984) 350-363. The decic
terms P J^2(5-q) Jz^2q have the names of CDMS; without them the levels of water above J = 14 fold back.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

Powers = tuple[int, int, int]  # p, q, n
Operators = dict[Powers, float]  # coefficient of every term

REPRESENTATIONS = {
    "Ir": "bca",
    "Il": "cba",
    "IIr": "cab",
    "IIl": "acb",
    "IIIr": "abc",
    "IIIl": "bac",
}  # principal axes at x, y, z

KINDS = ("linear", "spherical", "prolate", "oblate", "asymmetric")
FIGURE_AXIS = {"linear": "a", "prolate": "a", "oblate": "c"}  # figure axis of linear and symmetric tops
AXIAL_REPRESENTATION = {
    "prolate": "Ir",
    "spherical": "Ir",
    "oblate": "IIIr",
}  # representation with the figure axis as z


def axis_order(representation: str) -> str:
    """The principal axes at x, y, z of a representation.

    Raises ValueError for an unknown representation.

    >>> axis_order("IIIl")
    'bac'
    """
    if representation not in REPRESENTATIONS:
        raise ValueError(f"representation {representation!r}: known are {', '.join(REPRESENTATIONS)}")
    return REPRESENTATIONS[representation]


def added(weighted: Iterable[tuple[Operators, float]]) -> Operators:
    """Sum of operators times numbers.

    >>> added([({(1, 0, 0): 0.5, (0, 1, 0): -0.5}, 2.0), ({(1, 0, 0): 1.0}, 3.0)])
    {(1, 0, 0): 4.0, (0, 1, 0): -1.0}
    """
    total: Operators = {}
    for operators, value in weighted:
        for powers, factor in operators.items():
            total[powers] = total.get(powers, 0.0) + factor * value
    return total


_QUARTIC = {"J": (2, 0), "JK": (1, 1), "K": (0, 2)}
_SEXTIC = {"J": (3, 0), "JK": (2, 1), "KJ": (1, 2), "K": (0, 3)}
_OCTIC = {"LJ": (4, 0), "LJJK": (3, 1), "LJK": (2, 2), "LKKJ": (1, 3), "LK": (0, 4)}
_DECIC = {"PJ": (5, 0), "PJJK": (4, 1), "PJK": (3, 2), "PKJ": (2, 3), "PKKJ": (1, 4), "PK": (0, 5)}


def _diagonal(quartic: str, sextic: str) -> dict[str, Operators]:
    """Terms diagonal in K: DJ ... or DeltaJ ..., HJ ... or PhiJ ..., LJ ..., PJ ..."""
    table: dict[str, Operators] = {quartic + name: {(*powers, 0): -1.0} for name, powers in _QUARTIC.items()}
    table |= {sextic + name: {(*powers, 0): 1.0} for name, powers in _SEXTIC.items()}
    return table | {name: {(*powers, 0): 1.0} for name, powers in (_OCTIC | _DECIC).items()}


def _off(sign: float, **powers: Powers) -> dict[str, Operators]:
    return {name: {term: sign} for name, term in powers.items()}


SYMMETRIC = _diagonal("D", "H")
S_REDUCTION = SYMMETRIC | _off(
    1.0, d1=(1, 0, 1), d2=(0, 0, 2), h1=(2, 0, 1), h2=(1, 0, 2), h3=(0, 0, 3),
    l1=(3, 0, 1), l2=(2, 0, 2), l3=(1, 0, 3), l4=(0, 0, 4),
)  # fmt: skip
A_REDUCTION = (
    _diagonal("Delta", "Phi")
    | _off(-1.0, deltaJ=(1, 0, 1), deltaK=(0, 1, 1))
    | _off(1.0, phiJ=(2, 0, 1), phiJK=(1, 1, 1), phiK=(0, 2, 1))
    | _off(1.0, lJ=(3, 0, 1), lJK=(2, 1, 1), lKJ=(1, 2, 1), lK=(0, 3, 1))
)
LINEAR: dict[str, Operators] = {"D": {(2, 0, 0): -1.0}, "H": {(3, 0, 0): 1.0}, "L": {(4, 0, 0): 1.0}}

# The fourth-rank tensor Ω = 6 J⁴ - 2 J² - 10 (Jx⁴ + Jy⁴ + Jz⁴) of cubic tops (K. T. Hecht, J. Mol. Spectrosc. 5 (1960) 355) is,
# with z along a fourfold axis, -½ [35 Jz⁴ - 30 J² Jz² + 25 Jz² + 3 J⁴ - 6 J² + (5/2)(J₊⁴ + J₋⁴)]; the sign is that of
# J. T. Hougen, Methane Symmetry Operations (NIST 2001, first MTP Int. Rev. Sci., Phys. Chem. 3 (1976) 75), section 4:
# H = ... - D_J J⁴ - ½ D_t [3 J⁴ - ...], in which D_t of methane is positive
CUBIC_TENSOR: Operators = {
    (0, 2, 0): -17.5, (1, 1, 0): 15.0, (0, 1, 0): -12.5, (2, 0, 0): -1.5, (1, 0, 0): 3.0, (0, 0, 2): -1.25,
}  # fmt: skip
SPHERICAL: dict[str, Operators] = {"D": {(2, 0, 0): -1.0}, "H": {(3, 0, 0): 1.0}, "Dt": CUBIC_TENSOR}

_SPELLED = re.compile(r"(?=J)(?:J(?P<p>[1-9]\d*))?(?:Jz(?P<q>[1-9]\d*))?(?:Jpm(?P<n>[1-9]\d*))?")


def distortion_terms(kind: str, reduction: str | None) -> dict[str, Operators]:
    """The published names of distortion constants for a kind of top, with their operators; S if no reduction is given.

    >>> distortion_terms("asymmetric", "A")["deltaK"]
    {(0, 1, 1): -1.0}
    """
    if kind == "asymmetric":
        return A_REDUCTION if reduction == "A" else S_REDUCTION
    return {"linear": LINEAR, "spherical": SPHERICAL}.get(kind, SYMMETRIC)


def spelled_term(p: int, q: int, n: int) -> str:
    """The spelled-out name of a term.

    >>> spelled_term(2, 1, 3), spelled_term(6, 0, 0)
    ('J4Jz2Jpm6', 'J12')
    """
    for power in (p, q, n):
        if isinstance(power, bool) or not isinstance(power, int) or power < 0:
            raise ValueError(f"term ({p!r}, {q!r}, {n!r}): the powers p, q, n are whole numbers of 0 or more")
    if not p and not q and not n:
        raise ValueError("term (0, 0, 0): a constant energy is not a rotational term")
    return "".join(f"{letter}{2 * power}" for letter, power in (("J", p), ("Jz", q), ("Jpm", n)) if power)


def spelled_powers(name: str) -> Powers | None:
    """The powers (p, q, n) of a spelled-out name; None for other names.

    >>> spelled_powers("J4Jz2Jpm6"), spelled_powers("DJK")
    ((2, 1, 3), None)
    """
    match = _SPELLED.fullmatch(name)
    if not match:
        return None
    exponents = [int(match[part] or 0) for part in "pqn"]
    if any(exponent % 2 for exponent in exponents):  # terms are products of J², Jz² and J±²: only even powers occur
        return None
    p, q, n = (exponent // 2 for exponent in exponents)
    return p, q, n


def published_name(powers: Powers, kind: str, reduction: str | None) -> str:
    """The published name of a term for a kind of top and reduction (either, if None); "" if there is none.

    >>> published_name((2, 0, 0), "asymmetric", "A"), published_name((2, 0, 1), "linear", None)
    ('DeltaJ', '')
    """
    if sum(powers) == 1:
        return "A, B, C" if kind == "asymmetric" else "B"
    reductions = (reduction,) if reduction or kind != "asymmetric" else ("A", "S")
    names = [
        name
        for reduction in reductions
        for name, term in distortion_terms(kind, reduction).items()
        if term.keys() == {powers}
    ]
    return " or ".join(dict.fromkeys(names))
