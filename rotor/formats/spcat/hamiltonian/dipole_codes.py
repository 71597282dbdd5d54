"""Dipoles of an .int file by their codes, FC TYP I1 V2 V1 SYM: plain components by pairs of states, and other moments."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.formats.spcat.hamiltonian.code_table import state_digits
from rotor.formats.spcat.hamiltonian.codes import NOT_YET
from rotor.formats.spcat.hamiltonian.moment_operators import (
    imaginary,
    moment_operator,
    moment_tensor,
)
from rotor.formats.spcat.hamiltonian.series import Series, k_factor
from rotor.formats.spcat.text.int_file import Dipole
from rotor.quantum.moments import DEBYE_PER_BOHR_MAGNETON, Moment
from rotor.quantum.operators.algebra import Operator
from rotor.quantum.operators.rotation import Weight, direction_cosine, j_squared, j_z, weighted
from rotor.quantum.spins.operators import ByElements, Cosines

Dipoles = dict[tuple[int, int], tuple[float, float, float]]


class DipoleCode(NamedTuple):
    """The fields of a dipole's code, FC TYP I1 V2 V1 SYM: TYP with FC as its second digit, the states lower first.

    With TYP 7 and 8, Fourier terms, FC and I1 are the two digits of n, which stands in `spin`.
    """

    typ: int
    spin: int
    states: tuple[int, int]
    axis: int


def split_dipole(code: int, states: int) -> DipoleCode:
    """The fields of a code in a file with this number of states.

    >>> split_dipole(50001, 1), split_dipole(113, 2)
    (DipoleCode(typ=5, spin=0, states=(0, 0), axis=1), DipoleCode(typ=0, spin=0, states=(1, 1), axis=3))
    """
    step = 10 ** state_digits(states)
    rest, axis = divmod(abs(code), 10)
    rest, v1 = divmod(rest, step)
    rest, v2 = divmod(rest, step)
    rest, spin = divmod(rest, 10)
    second, typ = divmod(rest, 10)
    low, high = sorted((v1, v2))  # V1 and V2 in either order are one pair
    if typ in FOURIER:
        return DipoleCode(typ, spin + 10 * second, (low, high), axis)
    return DipoleCode(typ + 10 * second, spin, (low, high), axis)


def split_dipoles(dipoles: Iterable[Dipole], states: int) -> tuple[Dipoles, list[tuple[Dipole, DipoleCode]]]:
    """(μa, μb, μc) in D by pairs of states (lower first) with equal codes added, and the lines of other moments."""
    plain: dict[tuple[int, int], list[float]] = {}
    others = []
    for dipole in dipoles:
        code = split_dipole(dipole.code, states)
        if code.states[1] >= states:  # states that the file does not have
            continue
        if code.typ or code.spin or code.axis not in (1, 2, 3):
            others.append((dipole, code))
        else:
            plain.setdefault(code.states, [0.0, 0.0, 0.0])[code.axis - 1] += dipole.value
    return {pair: (mu[0], mu[1], mu[2]) for pair, mu in plain.items()}, others


FOURIER = (7, 8)
EVEN_ORDER = (1, 2, 5, 8)  # TYP of electric moments of even order in angular momenta: {φ, N}, [N², φ], i sine
# TYP with powers of N² of TYP 0: ½{N², }, ½[N², ], ½{N⁴, }, ¼[N², [N², ]]
_POWERS: Mapping[int, Weight] = {
    3: lambda m, n, above, below: (m * (m + 1.0) + n * (n + 1.0)) / 2,
    5: lambda m, n, above, below: (m * (m + 1.0) - n * (n + 1.0)) / 2,
    9: lambda m, n, above, below: ((m * (m + 1.0)) ** 2 + (n * (n + 1.0)) ** 2) / 2,
    10: lambda m, n, above, below: (m * (m + 1.0) - n * (n + 1.0)) ** 2 / 4,
}
_OPERATORS = (0, 1, 2, 3, 4, 6, 9, 10, 11, 12)


def line_moment(
    dipole: Dipole,
    code: DipoleCode,
    states: tuple[int, int],
    spins: int,
    oblate: bool = False,
    as_spcat: bool = False,
    series: Series | None = None,
) -> Moment:
    """The moment of a dipole line that is not a plain component of the dipole.

    | TYP, I1, SYM | moment |
    |---|---|
    | 3, 5, 9, 10 | ½{N², φ}, ½[N², φ], ½{N⁴, φ}, ¼[N², [N², φ]], or of N or a spin in place of φ but for 5 |
    | 0, 1, 2, 4, 6, 11, 12 | see `moment_operators` |
    | 7; n; any | TYP 0 times a cosine of K, a Fourier term of internal rotation (`series`) |
    | 8; n; any | i times TYP 0 times a sine of K; with n = 0 ½i{Nz, TYP 0}, as the program has it |

    SYM 1 to 3 in D, SYM 0 in Bohr magnetons, with TYP 8 in D, as documented, but in Bohr magnetons with `as_spcat`. A moment between
    two states leads from the one with the higher number to the other.

    dipole: the line of the .int file, its value in D or Bohr magnetons. code: fields of its code. states: numbers of the states in their
    group, the higher number of the file first. spins: number of spins in SPIND. oblate: whether z is the c axis. as_spcat: whether to
    reproduce SPCAT where it differs from its documentation: N, spins with TYP 1 and 2. series: constants of the Fourier series of the
    file.
    Returns: the moment in debye.
    Raises ValueError for any other code, with its meaning.
    """
    if not as_spcat and states[0] == states[1] and _is_turned(code):
        raise ValueError(f"dipole {dipole.code}: {_TURNED}")
    if code.typ in FOURIER:
        return _fourier_moment(dipole, code, states, series or Series(), oblate, as_spcat)
    if code.spin > spins:
        raise ValueError(f"dipole {dipole.code}: spin {code.spin} is not among the {spins} that SPIND names")
    if code.axis > 3:
        raise ValueError(
            f"dipole {dipole.code}: SYM = {code.axis}; expected 0 for magnetic moments, 1, 2, 3 for a, b, c"
        )
    value = dipole.value * (1.0 if code.axis else DEBYE_PER_BOHR_MAGNETON)
    if code.spin:
        return _spin_moment(dipole, code, states, value, oblate, as_spcat)
    if as_spcat and not code.axis and code.typ in (10, 11):  # without elements there
        value = 0.0
    if as_spcat and code.typ == 12 and code.axis == (3 if oblate else 1) and states[0] == states[1]:
        value = 0.0
    if code.typ not in _OPERATORS and not (code.typ == 5 and code.axis):
        raise ValueError(f"dipole {dipole.code}: {_meaning(code)} {NOT_YET}")
    if (
        code.typ == 5 and states[0] == states[1]
    ):  # not Hermitian: the elements from the higher F to the lower are those of ½[N², φ]
        value = -value
    operator = moment_operator(0 if code.typ in _POWERS else code.typ, code.axis, oblate, as_spcat=as_spcat)
    return _without_spin(value, states, _with_n2(operator, code.typ), bool(code.axis))


def _without_spin(value: float, states: tuple[int, int], operator: Operator, electric: bool) -> Moment:
    """The moment of an operator on |N K⟩ from the state of the higher number in the file, the first one here, to the other."""
    return Moment(value, states[::-1], ByElements(1, (1j if electric else 1.0) * operator), electric=electric)


def deviates_in_spcat(code: DipoleCode, oblate: bool) -> bool:
    """Whether SPCAT deviates from its documentation, so that `as_spcat` changes the result of `line_moment`."""
    magnetic, alone = code.axis == 0, code.states[0] == code.states[1]
    if alone and _is_turned(code):
        return True
    if code.typ in FOURIER:
        return magnetic
    if code.spin:
        return magnetic and code.typ in (1, 2)
    if magnetic:
        return code.typ not in (1, 2, 6, 12)
    return code.typ == 12 and code.axis == (3 if oblate else 1) and alone


_TURNED = "time reversal would change the sign of this moment in one state, so that it leads between two alone, V2 ≠ V1"


def _is_turned(code: DipoleCode) -> bool:
    """Whether a moment is anti-Hermitian and thus impossible within one state: i{φ, N}, i sine, i{Nz, }, [N², ] of second order."""
    return code.typ in (8, 11) or (code.typ in (1, 2) and code.axis > 0) or (code.typ == 12 and code.axis == 0)


def is_vector(code: DipoleCode) -> bool:
    """Whether a moment is a vector along an axis, times numbers that no half turn changes."""
    between_states = code.states[0] != code.states[1]
    return bool(code.axis) and not code.spin and code.typ in (3, 5, 7, 9, 10) and not (code.typ == 5 and between_states)


def _with_n2(operator: Operator, typ: int) -> Operator:
    """The operator with the powers of N² of a TYP."""
    return weighted(operator, _POWERS[typ]) if typ in _POWERS else operator


def _rank_two_with_n(m: Ints, n: Ints, above: Ints, below: Ints) -> Floats:
    """Factor of the elements of φ in those of {φ, N} of rank 2; zero between N = 0 and 1."""
    return np.sqrt(np.maximum(0.375 * ((m + n + 1) ** 2 - 4) * (1 - (m - n) ** 2 / 4), 0.0))


def _spin_moment(
    dipole: Dipole, code: DipoleCode, states: tuple[int, int], value: float, oblate: bool, as_spcat: bool
) -> Moment:
    """The magnetic moment of a spin."""
    spin = f"I{code.spin}"
    if code.axis == 0 and code.typ in (0, 3, 4, 6, 9):
        operator = moment_operator(0 if code.typ in _POWERS else code.typ, 0, oblate, with_spin=True)
        return Moment(value, states, ByElements(0, _with_n2(operator, code.typ)), spin, electric=False)
    if code.typ == 0 and code.axis == (3 if oblate else 1):
        cosine = direction_cosine("abc"[code.axis - 1], "IIIl" if oblate else "Ir")
        return Moment(value, states[::-1], ByElements(2, 1j * weighted(cosine, _rank_two_with_n)), spin)
    if code.typ in (1, 2):
        if code.axis == 0 and as_spcat:
            operator = (
                1.5 * j_z(2) - 0.5 * j_squared() if code.typ == 1 else moment_operator(6, 0, oblate, with_spin=True)
            )
            return Moment(value, states, ByElements(0, operator), spin, electric=False)
        tensor = Cosines(moment_tensor(code.typ, code.axis, oblate))  # times i along an axis, hence i² in elements
        return Moment(-value if code.axis else value, states[::-1], tensor, spin, electric=code.axis > 0)
    raise ValueError(f"dipole {dipole.code}: {_meaning(code)} {NOT_YET}")


def _fourier_moment(
    dipole: Dipole, code: DipoleCode, states: tuple[int, int], series: Series, oblate: bool, as_spcat: bool
) -> Moment:
    """TYP 0 times a function of K; states: numbers in the group, the higher number of the file first."""
    sine, n = code.typ == 8, code.spin
    if code.axis > 3:
        raise ValueError(
            f"dipole {dipole.code}: SYM = {code.axis}; expected 0 for magnetic moments, 1, 2, 3 for a, b, c"
        )
    in_debye = bool(code.axis) or (sine and not as_spcat)
    value = dipole.value * (1.0 if in_debye else DEBYE_PER_BOHR_MAGNETON)
    plain_operator = (imaginary(oblate) if sine else 1.0) * moment_operator(0, code.axis, oblate, as_spcat=as_spcat)
    operator = weighted(plain_operator, k_factor(n, sine, series, code.states))
    return _without_spin(value, states, operator, bool(code.axis))


def _meaning(code: DipoleCode) -> str:
    """Meaning of a code, for messages."""
    kinds = {1: "a moment of second order", 2: "a moment of second order", 6: "a moment of third order"}
    what = kinds.get(code.typ, f"a moment of TYP {code.typ}")
    if code.axis == 0 and code.typ in (0, 4, *_POWERS):
        what = (
            "the moment of l_z of an l-doubled state" if code.typ == 5 else "a magnetic moment with powers of N² or Nz²"
        )
    elif code.typ in (0, 4, *_POWERS):
        what = "a moment along an axis"
    return what + (f" that acts on spin {code.spin}" if code.spin else "")
