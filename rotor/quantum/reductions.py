"""Constants in another reduction or representation, to first order in the quartic constants, never in silence.

An orthorhombic Hamiltonian has six quartic terms, of which a spectrum determines five: a unitary turn e^{sS} with

    S = {Jz, J₊² - J₋²} = 4i (JxJyJz + JzJyJx)       (J₊ what raises K; J. K. G. Watson's s111 is 4s, up to the sign of i)

moves them among each other and leaves every level where it is. With X = J(J+1), B_zz = Bz - ½(Bx+By), B_xy = ¼(Bx-By), H' = H +
s [H, S] + ..., and from [Jz, J₊²] = 2 J₊² and J₋²J₊² = [X - K(K+1)] [X - (K+1)(K+2)] in a state |K⟩,

    [H_rigid, S] = 8 B_zz {½[Jz², J₊²+J₋²]₊ - (J₊²+J₋²)}
                 + B_xy {-4 (J₊⁴+J₋⁴) + 8 J⁴ - 48 J²Jz² + 40 Jz⁴ - 16 J² + 56 Jz²}.

The A-reduction chooses s so that J₊⁴+J₋⁴ vanishes, the S-reduction so that ½[Jz², J₊²+J₋²]₊ does. From A to S this gives

    s = δK/8B_zz,  d1 = -δJ,  d2 = -δK B_xy/2B_zz = -δK/4σ,  DJ = ΔJ + 2d2,  DJK = ΔJK - 12d2,  DK = ΔK + 10d2,
    Bx' = Bx + 4d2 - 2δK,  By' = By + 4d2 + 2δK,  Bz' = Bz - 10d2,       σ = (2Bz-Bx-By)/(Bx-By),

the relations of Watson, in Vibrational Spectra and Structure 6 (1977) 1, section 4; B. P. van Eijck, J. Mol. Spectrosc. 53
(1974) 246; V. Typke, J. Mol. Spectrosc. 63 (1976) 170. Another representation exchanges the axes: the six terms are
written in Jx, Jy, Jz, which is exact, their letters exchanged, and one of them turned away again in the new axes.

What is neglected are terms of second order, distortion²/B, of the size of sextic constants. So sets that have sextic
constants are refused: they would change by as much as they are worth.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotor.quantum.effects.watson import operators_by_name
from rotor.tops.constants.constants import Constants
from rotor.tops.constants.covariance import Covariance
from rotor.tops.constants.operators import Operators, Powers, added, axis_order, distortion_terms

# the quartic and quadratic terms by (p, q, n), and what each is in Jα⁴, JαJα JβJβ + JβJβ JαJα, Jα², for (x, y, z, xy, yz, zx)
_TERMS: tuple[Powers, ...] = (
    (2, 0, 0), (1, 1, 0), (0, 2, 0), (1, 0, 1), (0, 1, 1), (0, 0, 2), (1, 0, 0), (0, 1, 0), (0, 0, 1),
)  # fmt: skip
_CARTESIAN = np.array(
    [  # x⁴  y⁴  z⁴  xy  yz  zx  x²  y²  z²
        [1, 1, 1, 1, 1, 1, 0, 0, 0],  # J⁴
        [0, 0, 1, 0, 0.5, 0.5, 0, 0, 0],  # J² Jz²
        [0, 0, 1, 0, 0, 0, 0, 0, 0],  # Jz⁴
        [2, -2, 0, 0, -1, 1, 0, 0, 0],  # J² (J₊² + J₋²), where J₊² + J₋² = 2 (Jx² - Jy²)
        [0, 0, 0, 0, -1, 1, 0, 0, 0],  # ½[Jz², J₊² + J₋²]₊
        # J₊⁴ + J₋⁴ = 4 (Jx² - Jy²)² - 2J⁴ + 4J²Jz² + 4J² - 2Jz⁴ - 10Jz²
        [2, 2, 0, -6, 0, 0, 4, 4, -6],
        [0, 0, 0, 0, 0, 0, 1, 1, 1],  # J²
        [0, 0, 0, 0, 0, 0, 0, 0, 1],  # Jz²
        [0, 0, 0, 0, 0, 0, 2, -2, 0],  # J₊² + J₋²
    ]
).T


@dataclass(frozen=True)
class Conversion:
    """Converted constants, the turn s111 that was needed, in words what was done and how far it holds, and covariance.

    covariance: of the new constants, None where nothing was known of the old ones. The new constants carry its
    diagonal as uncertainties; on its own that says little, for a conversion correlates what was not.
    """

    constants: Constants
    s111: float
    note: str
    covariance: Covariance | None = None


def to_reduction(constants: Constants, reduction: str, covariance: Covariance | None = None) -> Conversion:
    """Convert a top to Watson's A- or S-reduction, axes unchanged.

    covariance : of the constants; by default their uncertainties, uncorrelated. It is carried over to first order.

    Levels stay the same to first order in the quartic constants. Raises ValueError for sextic and higher constants,
    a top that is not asymmetric, an unknown reduction, and where the turn has no finite size: to A with Bx = By.

    >>> done = to_reduction(Constants(A=9000.0, B=5000.0, C=3000.0, DeltaJ=0.1, deltaK=0.5), "S")
    >>> done.constants["d2"], done.constants["DJ"]
    (-0.025, 0.05)
    """
    return _converted(constants, reduction, str(constants.representation), covariance)


def to_representation(constants: Constants, representation: str, covariance: Covariance | None = None) -> Conversion:
    """Convert a top to the axes of another representation, reduction unchanged.

    Exact for a rigid top, whose A, B, C stay; else, and for errors, see `to_reduction`.

    >>> to_representation(Constants(A=9000.0, B=5000.0, C=3000.0, DJ=0.1), "IIIl").constants.representation
    'IIIl'
    """
    return _converted(constants, constants.reduction, representation, covariance)


def _converted(
    constants: Constants, reduction: str | None, representation: str, covariance: Covariance | None
) -> Conversion:
    """The new set, in which every constant's source says that it was converted; without a covariance errors stay."""
    _refuse(constants, reduction, representation)
    covariance, errors = covariance or Covariance.from_uncertainties(constants), dict(constants.uncertainties)
    if {*constants.values} <= {*"ABC"}:
        values, s = dict(constants.values), 0.0
        note = f"rigid top in {constants.representation} to {representation}, where A, B, C are the same"
    else:
        way = (str(constants.representation), str(reduction), representation)
        values, s = _values(constants, constants.values, *way)
        note = (
            f"{constants.reduction} in {constants.representation} to {reduction} in {representation}, to first order in the "
            f"quartic constants, s111 = {4 * s:.3g}; it holds while |s111| J³ is far below 1"
        )
        if covariance is not None:
            covariance = _carried(constants, covariance, way)
            errors = dict(zip(covariance.names, np.sqrt(np.diag(covariance.matrix_mhz2)).tolist(), strict=True))
    sources = dict.fromkeys(values, f"converted: {note}")
    sources |= {name: f"{sources[name]}; {old}" for name, old in constants.sources.items() if name in values}
    settings: Any = {"reduction": reduction, "representation": representation, "kind": "asymmetric", **values}
    return Conversion(Constants(**settings, uncertainties=errors, sources=sources), 4 * s, note, covariance)


def _values(
    constants: Constants, values: Mapping[str, float], old: str, reduction: str, new: str
) -> tuple[dict[str, float], float]:
    """The new constants by name, and the turn s, of values of the constants in the axes of `old`."""
    operators = added((terms, values[name]) for name, terms in operators_by_name(constants).items())
    exchanged = _exchange_axes(operators, axis_order(old), axis_order(new))
    s = _turn(exchanged, reduction)
    return _named(_turned(exchanged, s), reduction, new), s


def _carried(constants: Constants, covariance: Covariance, way: tuple[str, str, str]) -> Covariance:
    """J C Jᵀ, J the derivatives of new constants by old ones, from differences of a smooth function."""
    columns, names = [], tuple[str, ...]()
    for name in covariance.names:
        step = 1e-6 * (abs(constants[name]) or 1e3)
        up, down = (
            _values(constants, {**constants.values, name: constants[name] + sign * step}, *way)[0] for sign in (1, -1)
        )
        columns.append(np.subtract(list(up.values()), list(down.values())) / (2 * step))
        names = tuple(up)
    jacobian = np.stack(columns, axis=1)
    matrix = jacobian @ covariance.matrix_mhz2 @ jacobian.T
    return Covariance(names, (matrix + matrix.T) / 2)


def _refuse(constants: Constants, reduction: str | None, representation: str) -> None:
    if constants.kind != "asymmetric":
        raise ValueError(f"a top of kind {constants.kind!r} has neither reduction nor representation to convert")
    if reduction not in ("A", "S", None):
        raise ValueError(f"reduction {reduction!r}: Watson's reductions are 'A' and 'S'")
    axis_order(representation)  # refuses one that does not exist
    higher = [name for name in constants.values if name not in (*"ABC", *_quartic(constants.reduction))]
    if higher:
        raise ValueError(
            f"constants with {', '.join(higher)}: the conversion is of first order in quartic constants and would "
            "spoil these; leave them out knowingly with .replace(name=None), or fit again in the reduction asked for"
        )


def _quartic(reduction: str | None) -> dict[str, Operators]:
    """The terms of the quartic constants of a reduction, one each."""
    terms = distortion_terms("asymmetric", reduction)
    return {name: term for name, term in terms.items() if max(map(sum, term)) == 2}


def _exchange_axes(operators: Operators, old: str, new: str) -> Operators:
    """Express an operator in terms of the new x, y, z; exact."""
    cartesian = _CARTESIAN @ np.array([operators.get(powers, 0.0) for powers in _TERMS])
    place = [old.index(axis) for axis in new]  # where the new x, y, z stood
    pairs = [{0, 1}, {1, 2}, {2, 0}]
    moved_pairs = [3 + pairs.index({place[i], place[k]}) for i, k in ((0, 1), (1, 2), (2, 0))]
    moved = cartesian[[*place, *moved_pairs, *(6 + i for i in place)]]
    return dict(zip(_TERMS, np.linalg.solve(_CARTESIAN, moved).tolist(), strict=True))


def _turn(operators: Operators, reduction: str) -> float:
    """s that takes the sixth quartic term away: J₊⁴ + J₋⁴ for A, ½[Jz², J₊² + J₋²]₊ for S."""
    removed, rate = ((0, 0, 2), -4 * operators[0, 0, 1]) if reduction == "A" else ((0, 1, 1), 8 * operators[0, 1, 0])
    if operators[removed] == 0:
        return 0.0
    if rate == 0:
        equal = "Bx = By" if reduction == "A" else "Bz = ½(Bx + By)"
        raise ValueError(f"no {reduction}-reduction in these axes: {equal}; choose the other one, or other axes")
    return -operators[removed] / rate


def _turned(operators: Operators, s: float) -> Operators:
    """H + s [H_rigid, S]."""
    zz, xy = 8 * s * operators[0, 1, 0], s * operators[0, 0, 1]
    change: Operators = {
        (0, 1, 1): zz, (0, 0, 1): -zz, (0, 0, 2): -4 * xy,
        (2, 0, 0): 8 * xy, (1, 1, 0): -48 * xy, (0, 2, 0): 40 * xy, (1, 0, 0): -16 * xy, (0, 1, 0): 56 * xy,
    }  # fmt: skip
    return {powers: value + change.get(powers, 0.0) for powers, value in operators.items()}


def _named(operators: Operators, reduction: str, representation: str) -> dict[str, float]:
    """A, B, C and the five quartic constants of a reduction; the sixth term is zero by construction."""
    mean, along, across = (operators[powers] for powers in ((1, 0, 0), (0, 1, 0), (0, 0, 1)))
    rigid = dict(
        zip(axis_order(representation).upper(), (mean + 2 * across, mean - 2 * across, mean + along), strict=True)
    )
    values = {name: rigid[name] for name in "ABC"}
    for name, term in _quartic(reduction).items():
        ((powers, sign),) = term.items()
        values[name] = sign * operators[powers]
    return values
