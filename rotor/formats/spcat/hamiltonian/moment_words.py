"""Moments of .int files by TYP, as sums of products of direction cosines φ and components of N.

x, y, z are b, c, a in a prolate and b, a, c in an oblate basis, where i stands for -i, {A, B} = AB + BA
(H. M. Pickett, documentation of SPFIT and SPCAT, "Format of the .int file", table of dipole types):

| TYP | SYM 0, of N | SYM 0, of a spin | SYM along z (and x, y in turn) |
|---|---|---|---|
| 0 | N = Σ φ_i N_i | S | φ_z |
| 1 | ½(2 φ_z N_z - φ_x N_x - φ_y N_y) | as of N with S_i for N_i | ½i({φ_y, N_x} + {φ_x, N_y}) |
| 2 | φ_y N_y - φ_x N_x | as of N | that of TYP 1 |
| 6 | N (Ny² - Nx²) | S (Ny² - Nx²) | ({φ_z, Ny² - Nx²} + {φ_y, {Ny, Nz}} - {φ_x, {Nx, Nz}})/√6 |
| 6 along x, y | | | ½({φ_x, Ny² - Nx²} + {φ_y, {Nx, Ny}}), ½({φ_y, Ny² - Nx²} - {φ_x, {Nx, Ny}}) |
| 4 | ½{Nz², TYP 0} | the same | the same |
| 11, 12 | ½[N², TYP 2], -½i{Nz, TYP 2} (documented with the other sign, which the program does not have) | | the same |
"""

from __future__ import annotations

from collections.abc import Iterable
from math import sqrt

from rotor.quantum.moments import Matrix, Word

Words = tuple[Word, ...]


def moment_axes(oblate: bool) -> tuple[str, str, str]:
    """The axes at x, y, z in the table of dipole types."""
    return ("b", "a", "c") if oblate else ("b", "c", "a")


def imaginary(oblate: bool) -> complex:
    """The i of the table: in the left-handed frame b, a, c of an oblate basis -i."""
    return -1j if oblate else 1j


def type_words(typ: int, sym: int, oblate: bool, with_spin: bool = False, as_spcat: bool = False) -> Words:
    """The words of a TYP without its powers of N².

    typ: TYP 0, 1, 2, 4, 6, 11 or 12; for 11 the operator in the commutator. sym: SYM: 0 for magnetic moments, 1 to 3 for a, b, c. oblate:
    whether z is the c axis. with_spin: whether a spin multiplies the words, which then contain no cosine. as_spcat: whether N is ½(2 φ_z
    N_z - φ_x N_x - φ_y N_y), as SPCAT computes it, except for TYP 6.
    Returns: words in debye or magnetons, for a value of 1.
    """
    x, y, z = moment_axes(oblate)
    if typ == 4:
        return _half_with(z + z, type_words(0, sym, oblate, with_spin, as_spcat))
    if typ == 6:
        return _third_order(sym, (x, y, z), with_spin)
    if typ == 12:
        return _times(-imaginary(oblate), _half_with(z, type_words(2, sym, oblate)))
    if typ in (1, 2, 11) or (as_spcat and not sym and not with_spin):
        typ = typ or 1
        return _second_order(typ, sym, (x, y, z), imaginary(oblate))
    return _plain(sym, with_spin)


def moment_tensor(typ: int, sym: int, oblate: bool) -> Matrix:
    """c of Σ_ij c_ij φ_i S_j for TYP 1 and 2; for SYM 1 to 3 without the factor i, with its sign in an oblate basis."""
    x, y, z = moment_axes(oblate)
    c = dict.fromkeys((i + j for i in "abc" for j in "abc"), 0.0)
    if sym:
        i, j = (axis for axis in "abc" if axis != "abc"[sym - 1])
        c[i + j] = c[j + i] = -1.0 if oblate else 1.0
    else:
        c |= {2 * z: 1.0, 2 * x: -0.5, 2 * y: -0.5} if typ == 1 else {2 * y: 1.0, 2 * x: -1.0}
    rows = [tuple(c[i + j] for j in "abc") for i in "abc"]
    return (rows[0], rows[1], rows[2])  # type: ignore[return-value]


def _plain(sym: int, with_spin: bool) -> Words:
    """Words of TYP 0."""
    if with_spin:
        return (Word(1.0, "", "", ""),)
    if sym:
        return (Word(1.0, "", "abc"[sym - 1], ""),)
    return tuple(Word(1.0, "", axis, axis) for axis in "abc")


def _second_order(typ: int, sym: int, xyz: tuple[str, str, str], i: complex) -> Words:
    """Words of TYP 1 and 2."""
    x, y, z = xyz
    if sym:
        first, second = (axis for axis in xyz if axis != "abc"[sym - 1])
        return _times(0.5 * i, _anti(first, second) + _anti(second, first))
    along = {z: 1.0, x: -0.5, y: -0.5} if typ == 1 else {y: 1.0, x: -1.0}
    return tuple(word for axis, c in along.items() for word in _times(c / 2, _anti(axis, axis)))


def _third_order(sym: int, xyz: tuple[str, str, str], with_spin: bool) -> Words:
    """Words of TYP 6."""
    x, y, z = xyz
    if not sym:
        plain = _plain(0, with_spin)
        return _after(plain, y + y, 1.0) + _after(plain, x + x, -1.0)
    along = "abc"[sym - 1]
    squares = _times(1.0, _anti(along, y + y)) + _times(-1.0, _anti(along, x + x))
    if along == z:
        crossed = _twice(y, y, z, 1.0) + _twice(x, x, z, -1.0)
        return _times(1 / sqrt(6), squares + crossed)
    other, sign = (y, 1.0) if along == x else (x, -1.0)
    return _times(0.5, squares + _twice(other, x, y, sign))


def _anti(cosine: str, letters: str) -> Words:
    """{φ, N ...}."""
    return (Word(1.0, "", cosine, letters), Word(1.0, letters[::-1], cosine, ""))


def _twice(cosine: str, first: str, second: str, factor: float) -> Words:
    """c {φ, {N_i, N_j}}."""
    return _times(factor, _anti(cosine, first + second) + _anti(cosine, second + first))


def _times(factor: complex, words: Iterable[Word]) -> Words:
    """Words times a factor."""
    return tuple(word._replace(factor=factor * word.factor) for word in words)


def _after(words: Words, letters: str, factor: float) -> Words:
    """Words multiplied from the right by components of N."""
    return tuple(word._replace(factor=factor * word.factor, right=word.right + letters) for word in words)


def _half_with(letters: str, words: Words) -> Words:
    """½{N ..., of each word}."""
    left = tuple(word._replace(left=letters + word.left) for word in words)
    return _times(0.5, left + tuple(word._replace(right=word.right + letters) for word in words))
