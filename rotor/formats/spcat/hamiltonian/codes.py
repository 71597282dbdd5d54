"""Codes of SPFIT's parameters: from digits to operators, and from named constants to codes and signs.

The codes of `code_table` without spins and series multiply N^2p Nz^2q, Na², Nb², Nc² and ½{Nz^2q, N₊^2n + N₋^2n} N^2p (p = NSQ, q = KSQ),
so that each of Watson's constants has one code, with the sign of his Hamiltonian: -ΔJ, -DJ, -δJ, -δK,
all others plus. The basis is Iʳ (z, x, y = a, b, c), or IIIˡ (z, x, y = c, b, a) if NVIB is negative; a constant has the sign published
for that representation.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.formats.spcat.hamiltonian.code_table import Digits, Kind, join_code, ladder_typ, split_code, square_typ
from rotor.formats.spcat.text.par import Options, Parameter, ParameterFile
from rotor.tops.constants import operators as published
from rotor.tops.constants.constants import Constants
from rotor.tops.constants.kind_of_constants import RIGID
from rotor.tops.constants.operators import Operators, axis_order, spelled_powers, spelled_term

NOT_YET = "is read but not computed yet"
PLURAL_NOT_YET = "are read but not computed yet"
NO_NAME = (
    "cannot be said by the named constants of a top; predict from the files themselves, with rotor spectrum FILE.int"
)

AXES = {basis: axis_order(basis) for basis in ("Ir", "IIIl")}  # x, y, z of the two bases


def basis_axes(oblate: bool) -> str:
    """The axes x, y, z of a file: those of IIIl if NVIB is negative, else of Ir."""
    return AXES["IIIl" if oblate else "Ir"]


def basis_of(axes: str) -> str:
    """The representation with these axes x, y, z."""
    return "Ir" if axes == AXES["Ir"] else "IIIl"


def is_oblate(constants: Constants) -> bool:
    """Whether c is the axis z of the basis."""
    return constants.kind == "oblate" or constants.representation == "IIIl"


Factors = dict[int, dict[str, float]]  # by code, factors by name of a constant


def term_code(p: int, q: int, n: int) -> int:
    """The code of ½{Jz^2q, J₊^2n + J₋^2n} J^2p (n = 0: Jz^2q J^2p) in the lowest state.

    >>> [term_code(*term) for term in ((1, 0, 0), (0, 1, 0), (1, 0, 1), (0, 0, 4))]
    [100, 1000, 40100, 70000]
    """
    return join_code(Digits(typ=ladder_typ(n), ksq=q, nsq=p))


def _named(terms: Iterable[tuple[str, Operators]]) -> Factors:
    """The codes of published constants that multiply one term each, with their signs."""
    return {term_code(*powers): {name: sign} for name, operators in terms for powers, sign in operators.items()}


LINEAR, SYMMETRIC, S_REDUCTION = (
    _named(t.items()) for t in (published.LINEAR, published.SYMMETRIC, published.S_REDUCTION)
)
# by order (quartic, sextic, ...), terms diagonal in K first
A_REDUCTION = _named(
    sorted(published.A_REDUCTION.items(), key=lambda term: [(sum(powers), powers[2]) for powers in term[1]])
)


def _whole_code(parameter: Parameter) -> int:
    """The code for the lowest state; ValueError unless it is that of a rotational operator of this state alone."""
    d = split_code(parameter.code)
    if not d.has_name:
        raise parameter.refusal(f"its operator {NO_NAME}")
    return d.in_lowest_state


def file_constants(file: ParameterFile, *, errors: bool = False) -> Constants:
    """The named constants of a .par or .var file with one vibrational state and no spin.

    Values of equal codes are added, as SPFIT does. The reduction follows from the operators, or from the letter of the option line if they
    fit both. With `errors` the errors of a .var file become uncertainties of those constants that are one parameter and were not held (an
    error below 1e-30 holds a parameter).

    Raises ValueError, with the parameter, for operators that have no name here or are not supported."""
    return constants_and_matrix(file, errors=errors)[0]


def constants_and_matrix(file: ParameterFile, *, errors: bool = False) -> tuple[Constants, NDArray[np.float64]]:
    r"""The constants of a file, and M (constants, parameters) with constants = M @ values of the parameters.

    >>> from rotor.formats.spcat.text.par import read_par
    >>> file = read_par(b"x\n 2 1 1\ns -1 1 0 20\n 1000 4.0 1\n 100 5.0 1\n")
    >>> constants, matrix = constants_and_matrix(file)
    >>> constants.values["A"], matrix.tolist()
    (9.0, [[1.0, 1.0], [0.0, 1.0]])
    """
    codes = [_whole_code(parameter) for parameter in file.parameters]
    values = dict.fromkeys(codes, 0.0)
    for code, parameter in zip(codes, file.parameters, strict=True):
        values[code] += parameter.value
    kind, representation = _kind(file.options[0], values), "IIIl" if file.options[0].oblate else "Ir"
    distortion = [code for code in values if code not in _RIGID]
    reduction = _reduction(file.options[0], distortion) if kind == "asymmetric" else None
    rigid = _rigid_factors(kind, AXES[representation])
    useless = next((code for code in values if code in _RIGID and code not in rigid), None)
    if useless is not None:
        raise ValueError(f"parameter {useless} does nothing in a {kind} top, whose constant is {MEAN}; leave it out")
    factors = rigid | _distortion_factors(distortion, kind, reduction)
    named: dict[str, Any] = {name: 0.0 for name in RIGID if any(name in row for row in rigid.values())}
    for code in [*(code for code in rigid if code in values), *distortion]:
        for name, factor in factors[code].items():
            named[name] = named.get(name, 0.0) + factor * values[code]
    matrix = np.array([[factors[code].get(name, 0.0) for code in codes] for name in named])
    # constants that are one parameter
    alone = {name: file.parameters[np.flatnonzero(row)[0]].error for name, row in zip(named, matrix, strict=True)
             if errors and np.count_nonzero(row) == 1}  # fmt: skip
    constants = Constants(
        kind=kind,
        reduction=reduction,
        representation=representation if kind == "asymmetric" else None,
        uncertainties={name: error for name, error in alone.items() if error and error > HELD_BELOW},
        **named,
    )
    rows = [constants.spelling(name) for name in named]
    return constants, matrix[[rows.index(name) for name in constants.values]]


def _distortion_factors(codes: Iterable[int], kind: str, reduction: str | None) -> Factors:
    """The constants of distortion codes: published ones with their signs, else spelled operators such as J8Jpm2 for 40400."""
    factors = dict(_vocabulary(kind, reduction))
    for code in [code for code in codes if code not in factors]:
        d = split_code(code)
        if d.kind is Kind.SQUARE or (d.ladder and kind != "asymmetric") or (d.ksq and kind in ("linear", "spherical")):
            whose = f"the {reduction}-reduction" if reduction else f"a top of kind {kind}"
            raise ValueError(f"parameter {code}: no constant of {whose} has this operator; it {NOT_YET}")
        factors[code] = {spelled_term(d.nsq, d.ksq, d.ladder): 1.0}
    return factors


SQUARES: Factors = {join_code(Digits(typ=square_typ(x))): {x.upper(): 1.0} for x in "abc"}
MEAN, ALONG, ACROSS = term_code(1, 0, 0), term_code(0, 1, 0), term_code(0, 0, 1)  # N², Nz², N₊² + N₋²
_RIGID = (*SQUARES, MEAN, ALONG, ACROSS)


def _rigid_factors(kind: str, axes: str) -> Factors:
    """The factors of Na², Nb², Nc², of N², Nz², and of N₊² + N₋² = 2 (Nx² - Ny²), in A, B, C."""
    if kind in ("linear", "spherical"):
        return {MEAN: {"B": 1.0}}
    if kind in ("prolate", "oblate"):
        axis = "A" if kind == "prolate" else "C"
        return {MEAN: {"B": 1.0, axis: 1.0}, ALONG: {axis: 1.0}}
    x, y, z = (axis.upper() for axis in axes)
    return SQUARES | {MEAN: dict.fromkeys(RIGID, 1.0), ALONG: {z: 1.0}, ACROSS: {x: 2.0, y: -2.0}}


def is_linear(options: Options) -> bool:
    """Whether an option line states a linear molecule."""
    return options.knmin == options.knmax == 0


def _kind(options: Options, values: Mapping[int, float]) -> str:
    """Kind of top; if all terms are diagonal in K the constants decide, not the basis of the file."""
    if is_linear(options):
        return "linear"
    digits = [split_code(code) for code in values]
    if any(d.kind is not Kind.SCALAR for d in digits):
        return "asymmetric"
    if not any(d.ksq for d in digits):
        return "spherical"
    return "prolate" if values.get(ALONG, 0.0) >= 0 else "oblate"


def _reduction(options: Options, distortion: Sequence[int]) -> str | None:
    """A if K² multiplies an off-diagonal term, S if K changes by more than two, else the letter of the file."""
    in_a, in_s = ([code for code in distortion if letter in split_code(code).reductions] for letter in "AS")
    if in_a and in_s:
        raise ValueError(
            f"parameters {in_a} belong to Watson's A-reduction, {in_s} to his S-reduction; such a mixture {NOT_YET}"
        )
    if not distortion:
        return None
    return "A" if in_a else "S" if in_s or options.chr.lower() == "s" else "A"


def _vocabulary(kind: str, reduction: str | None) -> Factors:
    """Codes of the published constants of a kind of top and a reduction."""
    if kind == "asymmetric":
        return {"A": A_REDUCTION, "S": S_REDUCTION, None: {}}[reduction]
    return SYMMETRIC if kind in ("prolate", "oblate") else LINEAR


def code_factors(constants: Constants) -> Factors:
    """The codes of named constants, with the factors of the constants in the value of each.

    >>> code_factors(Constants(A=9000.0, B=6081.5, DJ=0.0013))
    {1000: {'A': 1.0, 'B': -1.0}, 100: {'B': 1.0}, 200: {'DJ': -1.0}}
    """
    rigid: Factors = {MEAN: {"B": 1.0}}
    axis = {"prolate": "A", "oblate": "C"}.get(constants.kind)
    if constants.kind == "asymmetric":
        rigid = SQUARES
    elif axis:
        rigid = {ALONG: {axis: 1.0, "B": -1.0}} | rigid
    vocabulary = _vocabulary(constants.kind, constants.reduction)
    named = {code: factors for code, factors in vocabulary.items() if all(name in constants for name in factors)}
    spelled: Factors = {}
    for name in [name for name in constants.values if name not in {*RIGID, *(n for f in named.values() for n in f)}]:
        if (powers := spelled_powers(name)) is None:
            raise ValueError(f"{name}: SPFIT's files have no code for it; leave it out")
        spelled[term_code(*powers)] = {name: 1.0}
    return rigid | named | spelled


FIXED = 1e-37  # error of a parameter that is not fitted
HELD_BELOW = 1e-30  # a smaller error marks a parameter as not fitted
FREE_ABOVE = 1e15  # MHz; a larger a-priori error counts as none, as in SPFIT
NO_LEADER = "the first one has none before it to keep a ratio to"


def is_held(parameter: Parameter) -> bool:
    """Whether the error of a parameter marks it as not fitted."""
    return parameter.error is not None and parameter.error < HELD_BELOW
