"""Dipoles of an .int file by their codes, FC TYP I1 V2 V1 SYM: plain components by pairs of states, and other moments.

Moments by TYP, as operators made of direction cosines φ and components of N. x, y, z are b, c, a in a prolate and b, a, c in an oblate
basis, where i stands for -i, {A, B} = AB + BA
(H. M. Pickett, documentation of SPFIT and SPCAT, "Format of the .int file", table of dipole types):

| TYP | SYM 0, of N | SYM 0, of a spin | SYM along z (and x, y in turn) |
|---|---|---|---|
| 0 | N = Σ φ_i N_i | S | φ_z |
| 1 | ½(2 φ_z N_z - φ_x N_x - φ_y N_y) | as of N with S_i for N_i | ½i({φ_y, N_x} + {φ_x, N_y}) |
| 2 | φ_y N_y - φ_x N_x | as of N | that of TYP 1 |
| 6 | N (Ny² - Nx²) | S (Ny² - Nx²) | ({φ_z, Ny² - Nx²} + {φ_y, {Ny, Nz}} - {φ_x, {Nx, Nz}})/√6 |
| 6 along x, y | | | ½({φ_x, Ny² - Nx²} + {φ_y, {Nx, Ny}}), ½({φ_y, Ny² - Nx²} - {φ_x, {Nx, Ny}}) |
| 3, 5, 9, 10 | ½{N², }, -, ½{N⁴, }, ¼[N², [N², ]] of TYP 0 | the same | ½{N², }, ½[N², ], ½{N⁴, }, ¼[N², [N², ]] of TYP 0 |
| 4 | ½{Nz², TYP 0} | the same | the same |
| 11, 12 | ½[N², TYP 2], -½i{Nz, TYP 2} (documented with the other sign, which the program does not have) | | the same |
| 7; n | TYP 0 times a cosine of K, a Fourier term of internal rotation (`series`) | | the same |
| 8; n | i times TYP 0 times a sine of K; with n = 0 ½i{Nz, TYP 0}, as the program has it | | the same |

SYM 1 to 3 in D, SYM 0 in Bohr magnetons, with TYP 8 in D, as documented, but in Bohr magnetons with `as_spcat`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import sqrt
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.formats.spcat.hamiltonian.code_table import state_digits
from rotor.formats.spcat.hamiltonian.codes import AXES, NOT_YET, basis_of
from rotor.formats.spcat.hamiltonian.operators import as_matrix, imaginary, operator_of
from rotor.formats.spcat.hamiltonian.series import Series, k_factor
from rotor.formats.spcat.text.int_file import Dipole
from rotor.quantum.effect import DEBYE_PER_BOHR_MAGNETON, Moment
from rotor.quantum.operators.algebra import UNIT, Operator, half_anticommutator
from rotor.quantum.operators.rotation import Weight, components, direction_cosine, j_squared, j_z, weighted
from rotor.quantum.spins.scheme import ByElements, Cosines, CosinesWithN


def moment_operator(typ: int, sym: int, axes: str, with_spin: bool = False, as_spcat: bool = False) -> Operator:
    """The operator of a TYP without its powers of N², for a value of 1.

    typ: TYP 0, 1, 2, 4, 6, 11 or 12. sym: SYM: 0 for magnetic moments, 1 to 3 for a, b, c. axes: the axes x, y, z. with_spin: whether a
    spin multiplies the operator, which then contains no cosine. as_spcat: whether N is ½(2 φ_z N_z - φ_x N_x - φ_y N_y), as SPCAT computes
    it, except for TYP 6.
    """
    n_z = components(basis_of(axes))[axes[2]]
    if typ == 4:
        return half_anticommutator(n_z**2, moment_operator(0, sym, axes, with_spin, as_spcat))
    if typ == 11:
        return _with_n2(moment_operator(2, sym, axes), 5)
    if typ == 12:
        return -imaginary(axes, True) * half_anticommutator(n_z, moment_operator(2, sym, axes))
    if typ in (1, 2) or not (sym or with_spin):
        spcat_n = as_spcat and typ == 0 and not sym
        c = moment_tensor(1 if spcat_n else typ, sym, axes)
        plain = (1j if sym else 1.0) * operator_of(CosinesWithN(as_matrix(c)), axes)
    else:
        plain = direction_cosine("abc"[sym - 1], basis_of(axes)) if sym else UNIT
    return _third_order(plain, sym, axes) if typ == 6 else plain


def _third_order(plain: Operator, sym: int, axes: str) -> Operator:
    """TYP 6 along an axis, or TYP 0 times Ny² - Nx² without one."""
    (x, y, z), n = tuple(axes), components(basis_of(axes))
    squares = n[y] ** 2 - n[x] ** 2
    if not sym:
        return plain @ squares

    def product(cosine: str, first: str, second: str) -> Operator:
        products_of_n = half_anticommutator(n[first], n[second])
        return 4.0 * half_anticommutator(direction_cosine(cosine, basis_of(axes)), products_of_n)

    both, along = 2.0 * half_anticommutator(plain, squares), "abc"[sym - 1]
    if along == z:
        return 1 / sqrt(6) * (both + product(y, y, z) - product(x, x, z))
    return 0.5 * (both + product(y, x, y) if along == x else both - product(x, x, y))


def moment_tensor(typ: int, sym: int, axes: str) -> Floats:
    """c (3, 3) of Σ_ij c_ij φ_i N_j or φ_i S_j; for SYM 1 to 3 without the factor i, with its sign in an oblate basis."""
    c = np.zeros((3, 3))
    if sym:
        i, j = (place for place in range(3) if place != sym - 1)
        c[i, j] = c[j, i] = 1.0 if axes[2] == "a" else -1.0
    else:
        along_xyz = {1: (-0.5, -0.5, 1.0), 2: (-1.0, 1.0, 0.0)}.get(typ, (1.0, 1.0, 1.0))
        for axis, value in zip(axes, along_xyz, strict=True):
            c["abc".index(axis), "abc".index(axis)] = value
    return c


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
    axes: str = AXES["Ir"],
    as_spcat: bool = False,
    series: Series | None = None,
) -> Moment:
    """The moment of a dipole line that is not a plain component of the dipole.

    A moment between two states leads from the one with the higher number to the other.

    dipole: the line of the .int file, its value in D or Bohr magnetons. code: fields of its code. states: numbers of the states in their
    group, the higher number of the file first. spins: number of spins in SPIND. axes: the axes x, y, z. as_spcat: whether to reproduce
    SPCAT where it differs from its documentation: N, spins with TYP 1 and 2. series: constants of the Fourier series of the file.
    Returns: the moment in debye.
    Raises ValueError for any other code, with its meaning.
    """
    if not as_spcat and states[0] == states[1] and _is_turned(code):
        raise ValueError(f"dipole {dipole.code}: {_TURNED}")
    if code.axis > 3:
        raise ValueError(
            f"dipole {dipole.code}: SYM = {code.axis}; expected 0 for magnetic moments, 1, 2, 3 for a, b, c"
        )
    sine, fourier, value = code.typ == 8, code.typ in FOURIER, dipole.value
    if not code.axis and not (sine and not as_spcat):
        value *= DEBYE_PER_BOHR_MAGNETON
    if fourier:
        plain = imaginary(axes, sine) * moment_operator(0, code.axis, axes, as_spcat=as_spcat)
        operator = weighted(plain, k_factor(code.spin, sine, series or Series(), code.states))
    elif code.spin > spins:
        raise ValueError(f"dipole {dipole.code}: spin {code.spin} is not among the {spins} that SPIND names")
    elif code.spin:
        return _spin_moment(dipole, code, states, value, axes, as_spcat)
    elif code.typ not in _OPERATORS and not (code.typ == 5 and code.axis):
        raise ValueError(f"dipole {dipole.code}: {_meaning(code)} {NOT_YET}")
    else:
        typ = 0 if code.typ in _POWERS else code.typ
        operator = _with_n2(moment_operator(typ, code.axis, axes, as_spcat=as_spcat), code.typ)
        if as_spcat and _is_left_out(code, axes):
            value = 0.0
        if code.typ == 5 and states[0] == states[1]:
            value = -value  # not Hermitian: from the higher F to the lower elements are those of ½[N², φ]
    rotor = ByElements(1, (1j if code.axis else 1.0) * operator)
    return Moment(value, states[::-1], rotor, electric=bool(code.axis))


def deviates_in_spcat(code: DipoleCode, axes: str) -> bool:
    """Whether SPCAT deviates from its documentation, so that `as_spcat` changes the result of `line_moment`."""
    magnetic = code.axis == 0
    if code.states[0] == code.states[1] and _is_turned(code):
        return True
    if code.typ in FOURIER or not magnetic:
        return magnetic or _is_left_out(code, axes)
    return code.typ in (1, 2) if code.spin else code.typ not in (1, 2, 6, 12)


def _is_left_out(code: DipoleCode, axes: str) -> bool:
    """Whether SPCAT has no elements of a moment: [N², ] of N, and within a state TYP 12 along z."""
    if not code.axis:
        return code.typ in (10, 11)
    return code.typ == 12 and "abc"[code.axis - 1] == axes[2] and code.states[0] == code.states[1]


_TURNED = "time reversal would change the sign of this moment in one state, so that it leads between two alone, V2 ≠ V1"


def _is_turned(code: DipoleCode) -> bool:
    """Whether a moment is anti-Hermitian and thus impossible within one state: i{φ, N}, i sine, i{Nz, }, [N², ] of second order."""
    return code.typ in (8, 11) or (code.typ in (1, 2) and code.axis > 0) or (code.typ == 12 and code.axis == 0)


def moment_species(code: DipoleCode, axes: str) -> str:
    """The species of a moment under half turns, "" if none changes its sign: that of SYM, times that of z for i sin and i{Nz, }."""
    along = "abc"[code.axis - 1] if code.axis else ""
    if code.typ not in (8, 12):
        return along
    z = axes[2]
    return z if not along else "" if along == z else next(axis for axis in "abc" if axis not in (along, z))


def _with_n2(operator: Operator, typ: int) -> Operator:
    """The operator with the powers of N² of a TYP."""
    return weighted(operator, _POWERS[typ]) if typ in _POWERS else operator


def _rank_two_with_n(m: Ints, n: Ints, above: Ints, below: Ints) -> Floats:
    """Factor of the elements of φ in those of {φ, N} of rank 2; zero between N = 0 and 1."""
    return np.sqrt(np.maximum(0.375 * ((m + n + 1) ** 2 - 4) * (1 - (m - n) ** 2 / 4), 0.0))


def _spin_moment(
    dipole: Dipole, code: DipoleCode, states: tuple[int, int], value: float, axes: str, as_spcat: bool
) -> Moment:
    """The magnetic moment of a spin."""
    spin, magnetic = f"I{code.spin}", code.axis == 0
    if magnetic and code.typ in (0, 3, 4, 6, 9):
        operator = moment_operator(0 if code.typ in _POWERS else code.typ, 0, axes, with_spin=True)
    elif magnetic and as_spcat and code.typ in (1, 2):
        squares = 1.5 * j_z(2) - 0.5 * j_squared()
        operator = squares if code.typ == 1 else moment_operator(6, 0, axes, with_spin=True)
    elif code.typ in (1, 2):
        tensor = Cosines(as_matrix(moment_tensor(code.typ, code.axis, axes)))
        # times i along an axis, hence i² in elements
        return Moment(value if magnetic else -value, states[::-1], tensor, spin, electric=not magnetic)
    elif code.typ == 0 and "abc"[code.axis - 1] == axes[2]:
        cosine = direction_cosine(axes[2], basis_of(axes))
        return Moment(value, states[::-1], ByElements(2, 1j * weighted(cosine, _rank_two_with_n)), spin)
    else:
        raise ValueError(f"dipole {dipole.code}: {_meaning(code)} {NOT_YET}")
    return Moment(value, states, ByElements(0, _with_n2(operator, code.typ)), spin, electric=False)


def _meaning(code: DipoleCode) -> str:
    """Meaning of a code, for messages."""
    what = "a moment of third order" if code.typ == 6 else f"a moment of TYP {code.typ}"
    if code.typ in (0, 4, *_POWERS):
        magnetic = (
            "the moment of l_z of an l-doubled state" if code.typ == 5 else "a magnetic moment with powers of N² or Nz²"
        )
        what = "a moment along an axis" if code.axis else magnetic
    return what + (f" that acts on spin {code.spin}" if code.spin else "")
