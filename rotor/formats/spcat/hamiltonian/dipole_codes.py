"""Dipoles of an .int file by their codes, FC TYP I1 V2 V1 SYM: plain components by pairs of states, and other moments."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from rotor.formats.spcat.hamiltonian.code_table import state_digits
from rotor.formats.spcat.hamiltonian.codes import NOT_YET
from rotor.formats.spcat.hamiltonian.moment_operators import (
    commutator_with_n2,
    imaginary,
    moment_operator,
    moment_tensor,
)
from rotor.formats.spcat.hamiltonian.series import Series, angles_by_k, k_factor
from rotor.formats.spcat.text.int_file import Dipole
from rotor.quantum.moments import DEBYE_PER_BOHR_MAGNETON, Moment, Written
from rotor.quantum.operators.algebra import Operator, half_anticommutator
from rotor.quantum.operators.rotation import j_squared, j_z, weighted

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
_POWERS = {3: "J", 5: "[J]", 9: "JJ", 10: "[[J]]"}  # TYP with powers of N² of TYP 0
_WRITTEN = (0, 1, 2, 3, 4, 6, 9, 10, 11, 12)


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
    powers = _POWERS.get(code.typ, "")
    if code.axis and powers and (powers != "[J]" or states[0] == states[1]):
        return Moment(value, states, _along(code.axis), powers)
    if (code.typ == 5 and code.axis) or code.typ in _WRITTEN:
        operator = moment_operator(0 if powers else code.typ, code.axis, oblate, as_spcat=as_spcat)
        operator = commutator_with_n2(operator) if code.typ == 5 else _with_n2(operator, powers)
        return Moment(value, states[::-1], written=Written(operator, bool(code.axis)))
    raise ValueError(f"dipole {dipole.code}: {_meaning(code)} {NOT_YET}")


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


def _along(axis: int) -> tuple[float, float, float]:
    """Unit vector along an axis 1, 2 or 3."""
    return (float(axis == 1), float(axis == 2), float(axis == 3))


def _with_n2(operator: Operator, powers: str) -> Operator:
    """½{N², O}, ½{N⁴, O} or ¼[N², [N², O]] by the name of the powers; O for none."""
    if powers == "[[J]]":
        return commutator_with_n2(commutator_with_n2(operator))
    return half_anticommutator(j_squared(len(powers)), operator) if powers else operator


def _spin_moment(
    dipole: Dipole, code: DipoleCode, states: tuple[int, int], value: float, oblate: bool, as_spcat: bool
) -> Moment:
    """The magnetic moment of a spin."""
    spin = f"I{code.spin}"
    if code.axis == 0 and code.typ in (0, 3, 4, 6, 9):
        operator = moment_operator(0 if code.typ in _POWERS else code.typ, 0, oblate, with_spin=True)
        operator = _with_n2(operator, _POWERS.get(code.typ, ""))
        return Moment(value, states, spin=spin, written=Written(operator, False))
    if code.typ == 0 and code.axis == (3 if oblate else 1):
        return Moment(value, states[::-1], _along(code.axis), spin=spin)
    if code.typ in (1, 2):
        if code.axis == 0 and as_spcat:
            operator = (
                1.5 * j_z(2) - 0.5 * j_squared() if code.typ == 1 else moment_operator(6, 0, oblate, with_spin=True)
            )
            return Moment(value, states, spin=spin, written=Written(operator, False))
        tensor = moment_tensor(code.typ, code.axis, oblate)
        return Moment(value, states[::-1], tensor=tensor, spin=spin, with_i=code.axis > 0)
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
    plain = code.axis and not sine and not series.nofc and not (series.g12 and n % 2)
    if plain:
        low, high = angles_by_k(n, series, code.states)
        return Moment(dipole.value, states, _along(code.axis), cosine=(high, low))
    in_debye = bool(code.axis) or (sine and not as_spcat)
    value = dipole.value * (1.0 if in_debye else DEBYE_PER_BOHR_MAGNETON)
    plain_operator = (imaginary(oblate) if sine else 1.0) * moment_operator(0, code.axis, oblate, as_spcat=as_spcat)
    operator = weighted(plain_operator, k_factor(n, sine, series, code.states))
    return Moment(value, states[::-1], written=Written(operator, bool(code.axis)))


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
