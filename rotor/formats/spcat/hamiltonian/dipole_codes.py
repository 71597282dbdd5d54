"""Dipoles of an .int file by their codes: FC TYP I1 V2 V1 SYM, plain components by pairs of states and moments of other kinds."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from rotor.formats.spcat.hamiltonian.codes import NOT_YET, state_digits
from rotor.formats.spcat.hamiltonian.series import Series, angles_by_k
from rotor.formats.spcat.text.int_file import Dipole
from rotor.quantum.moments import DEBYE_PER_BOHR_MAGNETON, Moment

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
    """The fields of a code in a file with so many states.

    >>> split_dipole(50001, 1), split_dipole(113, 2)
    (DipoleCode(typ=5, spin=0, states=(0, 0), axis=1), DipoleCode(typ=0, spin=0, states=(1, 1), axis=3))
    """
    step = 10 ** state_digits(states)
    rest, axis = divmod(abs(code), 10)
    rest, v1 = divmod(rest, step)
    rest, v2 = divmod(rest, step)
    rest, spin = divmod(rest, 10)
    second, typ = divmod(rest, 10)
    low, high = sorted((v1, v2))
    if typ in FOURIER:
        return DipoleCode(typ, spin + 10 * second, (low, high), axis)
    return DipoleCode(typ + 10 * second, spin, (low, high), axis)


def dipoles_of(dipoles: Iterable[Dipole], states: int) -> tuple[Dipoles, list[tuple[Dipole, DipoleCode]]]:
    """(μa, μb, μc) in D by pairs of states, lower first, lines of one code added; and the lines of other kinds."""
    found: dict[tuple[int, int], list[float]] = {}
    others = []
    for dipole in dipoles:
        code = split_dipole(dipole.code, states)
        if code.states[1] >= states:
            continue
        if code.typ or code.spin or code.axis not in (1, 2, 3):
            others.append((dipole, code))
        else:
            found.setdefault(code.states, [0.0, 0.0, 0.0])[code.axis - 1] += dipole.value
    return {pair: (mu[0], mu[1], mu[2]) for pair, mu in found.items()}, others


FOURIER = (7, 8)
_POWERS = {3: "J", 4: "K", 5: "[J]", 9: "JJ", 10: "[[J]]"}  # TYP of electric moments


def moment_of(
    dipole: Dipole,
    code: DipoleCode,
    states: tuple[int, int],
    spins: int,
    oblate: bool = False,
    as_spcat: bool = False,
    series: Series | None = None,
) -> Moment:
    """A moment that makes lines of another kind than a plain component of the dipole does.

    | TYP, I1, SYM | moment |
    |---|---|
    | 3, 4, 5, 9, 10; 0; 1, 2, 3 | {N², φ}/2, {Nz², φ}/2, [N², φ]/2, {N⁴, φ}/2, [N², [N², φ]]/4, in D |
    | 7; n; 1, 2, 3 | φ times a cosine of K, a Fourier term of internal rotation (`series`), in D |
    | 0; 0 or a spin; 0 | N, or that spin, in Bohr magnetons |
    | 1; 0; 0 | ½(2 φ_z N_z - φ_x N_x - φ_y N_y), in Bohr magnetons; with `as_spcat` TYP 0 too: the program has this for N |
    | 1; a spin; 0 | S ½(3 Nz² - N²), in Bohr magnetons, as the program computes it (documented: φ_z S_z - ½ φ_x S_x - ½ φ_y S_y) |

    Parameters
    ----------
    dipole : Dipole
        The line of the .int file, its value in D or Bohr magnetons.
    code : DipoleCode
        Its code in parts.
    states : (int, int)
        As numbered in its group.
    spins : int
        How many spins SPIND names.
    oblate : bool, optional
        Whether z is the c axis.
    as_spcat : bool, optional
        Whether N is what the program computes for it.
    series : Series, optional
        The constants of Fourier series of the file.

    Returns
    -------
    Moment
        In debye.

    Raises
    ------
    ValueError
        With what it stands for, for any other code.
    """
    if code.typ in FOURIER:
        return _cosine_of(dipole, code, states, series or Series())
    if code.spin > spins:
        raise ValueError(f"dipole {dipole.code}: spin {code.spin} is not among the {spins} that SPIND names")
    if code.axis == 0 and code.states[0] == code.states[1]:
        magnetons = dipole.value * DEBYE_PER_BOHR_MAGNETON
        spin = f"I{code.spin}" if code.spin else ""
        if not spin and (code.typ == 1 or (code.typ == 0 and as_spcat)):
            a, c = (-0.5, 1.0) if oblate else (1.0, -0.5)
            return Moment(magnetons, states, tensor=((a, 0.0, 0.0), (0.0, -0.5, 0.0), (0.0, 0.0, c)))
        if code.typ == 0:
            return Moment(magnetons, states, spin=spin)
        if code.typ == 1 and spin:
            return Moment(magnetons, states, powers="3K-J", spin=spin)
    if code.axis in (1, 2, 3) and code.spin == 0 and code.typ in _POWERS:
        along = (float(code.axis == 1), float(code.axis == 2), float(code.axis == 3))
        return Moment(dipole.value, states, along, _POWERS[code.typ])
    raise ValueError(f"dipole {dipole.code}: {_meaning(code)} {NOT_YET}")


def _cosine_of(dipole: Dipole, code: DipoleCode, states: tuple[int, int], series: Series) -> Moment:
    """A component of the dipole times cos(2π n (ρ'K' + ρ''K'')/2 / 3); states: as numbered in the group, the higher of the file first."""
    odd = series.g12 and code.spin % 2
    if code.typ != 7 or code.axis == 0 or series.nofc or odd:
        more = " of one K (NOFC)" if series.nofc else ", with signs by K (G12)" if odd else ""
        raise ValueError(f"dipole {dipole.code}: {_meaning(code)}{more} {NOT_YET}")
    low, high = angles_by_k(code.spin, series, code.states)
    along = (float(code.axis == 1), float(code.axis == 2), float(code.axis == 3))
    return Moment(dipole.value, states, along, cosine=(high, low))


def _meaning(code: DipoleCode) -> str:
    kinds = {1: "a moment of second order", 2: "a moment of second order", 6: "a moment of third order"}
    kinds |= {7: "a moment times a cosine of internal rotation", 8: "a moment times a sine of internal rotation"}
    what = kinds.get(code.typ, f"a moment of TYP {code.typ}")
    if code.axis == 0 and code.typ in (0, *_POWERS):
        between = code.states[0] != code.states[1]
        what = "a magnetic moment between two states" if between else "a magnetic moment with powers of N² or Nz²"
    elif code.typ in (0, *_POWERS):
        what = "a moment along an axis"
    return what + (f" that acts on spin {code.spin}" if code.spin else "")
