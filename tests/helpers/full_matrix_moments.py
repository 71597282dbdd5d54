"""Moments of .int files, FC TYP I1 V2 V1 SYM, between the levels of full matrices in the plain basis |v, pattern, k⟩: slow, independent.

Each electric moment is written out as the table of dipole types in Pickett's documentation has it, with φ along molecule-fixed axes as a
reduced matrix ⟨N'k'‖φ‖N k⟩ and products with N_i from either side, which do not change N. Between two states ⟨v|M|v'⟩, v < v', is the
operator, times i where no more moments within states are of odd order than of even order, and ⟨v'|M|v⟩ its adjoint.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import sqrt

import numpy as np
from full_matrix import Piece, step
from full_matrix_codes import Case
from full_matrix_rotor import momenta, reduced_coupled, reduced_vector, spin_reduced

DEBYE_PER_MAGNETON = 0.009274  # as the program has it
OF_EVEN_ORDER = (1, 2, 5)


@dataclass(frozen=True)
class Moment:
    """A line of an .int file: states (lower first), TYP, SYM (0: magnetic), number of a spin or 0, value."""

    states: tuple[int, int]
    typ: int
    sym: int
    value: float
    spin: int = 0

    @property
    def line(self) -> str:
        """Its text in a file with less than ten states."""
        low, high = self.states
        types = 100_000 * (self.typ // 10) + 10_000 * (self.typ % 10)
        return f"{types + 1000 * self.spin + 100 * high + 10 * low + self.sym} {self.value!r}\n"


def rotor_elements(moment: Moment, bra: int, ket: int, z: str) -> np.ndarray:
    """⟨N'k'‖M‖N k⟩ of a moment without spins for a value of 1, N' = bra, N = ket."""
    left, right = momenta(bra, z), momenta(ket, z)
    x, y = ("b", "c") if z == "a" else ("b", "a")
    i = 1j if z == "a" else -1j
    phi = {axis: reduced_vector(bra, ket, np.eye(3)["abc".index(axis)], z) for axis in "abc"}

    def both(axis: str, first: str, two: str = "") -> np.ndarray:
        """½{φ_axis, N_first} or ½{φ_axis, ½{N_first, N_two}}."""
        after, before = (
            of[first] if not two else (of[first] @ of[two] + of[two] @ of[first]) / 2 for of in (right, left)
        )
        return (phi[axis] @ after + before @ phi[axis]) / 2

    def second() -> np.ndarray:
        if moment.sym:
            first, two = (axis for axis in "abc" if axis != "abc"[moment.sym - 1])
            return i * (both(first, two) + both(two, first))
        return both(y, y) - both(x, x)

    up, low = bra * (bra + 1.0), ket * (ket + 1.0)
    plain = phi["abc"[moment.sym - 1]] if moment.sym else reduced_coupled(bra, ket, np.eye(3), z)
    k_bra, k_ket = np.arange(-bra, bra + 1.0)[:, None], np.arange(-ket, ket + 1.0)
    if moment.typ == 1 and not moment.sym:
        return (2 * both(z, z) - both(x, x) - both(y, y)) / 2
    if moment.typ in (1, 2):
        return second()
    if moment.typ == 6:
        return _third_order(moment.sym, x, y, z, both)
    if moment.typ == 11:
        return (up - low) / 2 * second()
    if moment.typ == 12:
        return -i * (k_bra + k_ket) / 2 * second()
    powers = {0: 1.0, 3: (up + low) / 2, 5: (up - low) / 2, 9: (up**2 + low**2) / 2, 10: (up - low) ** 2 / 4}
    return plain * ((k_bra**2 + k_ket**2) / 2 if moment.typ == 4 else powers[moment.typ])


def _third_order(sym: int, x: str, y: str, z: str, both) -> np.ndarray:
    along = "abc"[sym - 1]
    squares = both(along, y, y) - both(along, x, x)
    if along == z:
        return (2 * squares + 4 * both(y, y, z) - 4 * both(x, x, z)) / sqrt(6)
    other, sign = (y, 1) if along == x else (x, -1)
    return squares + 2 * sign * both(other, x, y)


def chain(bra: Piece, ket: Piece, spins2: tuple[int, ...], spin: int) -> float:
    """⟨F'‖T¹‖F⟩ over ⟨N'‖T‖N⟩, where T acts on the rotation (spin 0), or is the vector of a spin."""
    factor = 1.0
    for level, size in enumerate(spins2, 1):
        pairs = (bra.pattern[level - 1], bra.pattern[level]), (ket.pattern[level - 1], ket.pattern[level])
        before, here = (1, 0) if level > spin else (0, int(level == spin))
        unit = spin_reduced(size, 1) if here else sqrt(size + 1)
        factor *= step(*pairs, size, (before, here, max(before, here))) * unit
    return factor


def moment_matrix(case: Case, moment: Moment, phase: complex, bras: list[Piece], kets: list[Piece]) -> np.ndarray:
    """⟨F'‖M‖F⟩ over all functions |v, pattern, k⟩ of two F."""
    z, spins2 = "c" if case.oblate else "a", case.states[0].spins2
    rows, columns = (np.cumsum([0, *(len(piece.ks) for piece in basis)]) for basis in (bras, kets))
    total = np.zeros((rows[-1], columns[-1]), complex)
    low, high = moment.states
    value = moment.value * (1.0 if moment.sym else DEBYE_PER_MAGNETON)
    if low != high and moment.sym:
        value = value * phase
    for (i, bra), (j, ket) in product(enumerate(bras), enumerate(kets)):
        if (bra.v, ket.v) not in ((low, high), (high, low)) or abs(bra.n - ket.n) > 1:
            continue
        factor = chain(bra, ket, spins2, moment.spin)
        if factor == 0.0:
            continue
        place = np.ix_(np.array(bra.ks) + bra.n, np.array(ket.ks) + ket.n)
        if moment.spin:
            whole = value * sqrt(2 * ket.n + 1) * np.eye(2 * bra.n + 1, 2 * ket.n + 1) * (bra.n == ket.n)
        elif bra.v <= ket.v:
            whole = value * rotor_elements(moment, bra.n, ket.n, z)
        else:
            whole = (-1) ** (bra.n - ket.n) * (value * rotor_elements(moment, ket.n, bra.n, z)).conj().T
        total[rows[i] : rows[i + 1], columns[j] : columns[j + 1]] += factor * whole[place]
    return total


def phase_between(moments: list[Moment]) -> complex:
    """The factor of electric moments between two states."""
    within = [m.typ in OF_EVEN_ORDER for m in moments if m.sym and m.states[0] == m.states[1]]
    return 1.0 if within.count(False) > within.count(True) else 1j


def strengths(case: Case, moments: list[Moment], up, low, phase: complex | None = None) -> np.ndarray:
    """Σ |⟨F'‖M‖F⟩|² of electric and of magnetic moments; up, low: (pieces, eigenvectors) of two F; phase: of `phase_between`."""
    phase, total = phase_between(moments) if phase is None else phase, 0.0
    for electric in (True, False):
        chosen = [m for m in moments if bool(m.sym) == electric]
        if chosen:
            matrix = sum(moment_matrix(case, m, phase, up[0], low[0]) for m in chosen)
            total = total + np.abs(up[1].conj().T @ matrix @ low[1]) ** 2
    return total
