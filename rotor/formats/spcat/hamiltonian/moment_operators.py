"""Moments of .int files by TYP, as operators made of direction cosines φ and components of N.

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

from collections.abc import Mapping
from math import sqrt

from rotor.quantum.operators.algebra import UNIT, Operator, half_anticommutator
from rotor.quantum.operators.rotation import components, direction_cosine, weighted
from rotor.quantum.spins.operators import Matrix


def moment_axes(oblate: bool) -> tuple[str, str, str]:
    """The axes at x, y, z in the table of dipole types."""
    return ("b", "a", "c") if oblate else ("b", "c", "a")


def imaginary(oblate: bool) -> complex:
    """The i of the table: in the left-handed frame b, a, c of an oblate basis -i."""
    return -1j if oblate else 1j


def moment_operator(typ: int, sym: int, oblate: bool, with_spin: bool = False, as_spcat: bool = False) -> Operator:
    """The operator of a TYP without its powers of N², for a value of 1.

    typ: TYP 0, 1, 2, 4, 6, 11 or 12. sym: SYM: 0 for magnetic moments, 1 to 3 for a, b, c. oblate: whether z is the c axis. with_spin:
    whether a spin multiplies the operator, which then contains no cosine. as_spcat: whether N is ½(2 φ_z N_z - φ_x N_x - φ_y N_y), as
    SPCAT computes it, except for TYP 6.
    """
    basis, (x, y, z) = "IIIl" if oblate else "Ir", moment_axes(oblate)
    n, phi = components(basis), {axis: direction_cosine(axis, basis) for axis in "abc"}
    along = "abc"[sym - 1] if sym else ""

    def product(cosine: str, axis: str) -> Operator:
        return half_anticommutator(phi[cosine], n[axis])

    if typ == 4:
        return half_anticommutator(n[z] ** 2, moment_operator(0, sym, oblate, with_spin, as_spcat))
    if typ == 11:
        return commutator_with_n2(moment_operator(2, sym, oblate))
    if typ == 12:
        return -imaginary(oblate) * half_anticommutator(n[z], moment_operator(2, sym, oblate))
    if typ in (1, 2) and sym:
        first, second = (axis for axis in (x, y, z) if axis != along)
        return imaginary(oblate) * (product(first, second) + product(second, first))
    if typ == 2:
        return product(y, y) - product(x, x)
    if typ == 1 or (typ == 0 and as_spcat and not sym and not with_spin):
        return product(z, z) - 0.5 * (product(x, x) + product(y, y))
    plain = UNIT if with_spin else phi[along] if sym else product("a", "a") + product("b", "b") + product("c", "c")
    return plain if typ == 0 else _third_order(plain, along, n, phi, (x, y, z))


def _third_order(
    plain: Operator, along: str, n: Mapping[str, Operator], phi: Mapping[str, Operator], axes: tuple[str, str, str]
) -> Operator:
    """TYP 6 along an axis, or TYP 0 times Ny² - Nx² without one."""
    (x, y, z), squares = axes, n[axes[1]] ** 2 - n[axes[0]] ** 2
    if not along:
        return plain @ squares

    def product(cosine: str, first: str, second: str) -> Operator:
        return 4.0 * half_anticommutator(phi[cosine], half_anticommutator(n[first], n[second]))

    both = 2.0 * half_anticommutator(plain, squares)
    if along == z:
        return 1 / sqrt(6) * (both + product(y, y, z) - product(x, x, z))
    return 0.5 * (both + product(y, x, y) if along == x else both - product(x, x, y))


def commutator_with_n2(operator: Operator) -> Operator:
    """½[N², O]."""
    return weighted(operator, lambda m, n, above, below: (m * (m + 1.0) - n * (n + 1.0)) / 2)


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
