"""The effective Hamiltonian of SPFIT/SPCAT as one full matrix for each F: slow, independent, nothing contracted.

States v, rotation N, k and spins coupled one after another, N + S1 = J, J + S2 = F1, ... = F. Each parameter is an operator
(`full_matrix_codes.Term`); its matrix comes from molecule-fixed products (`full_matrix_rotor`) and one general rule of
angular momentum, ⟨(j's')J'||[T^a x U^b]^c||(j s)J⟩ = √((2J'+1)(2c+1)(2J+1)) {j' j a; s' s b; J' J c} ⟨j'||T||j⟩⟨s'||U||s⟩
(A. R. Edmonds, Angular Momentum in Quantum Mechanics, eq. 7.1.5). Numbers that may be half-integer are doubled.

Phase between states v < v': ⟨v|H|v'⟩ = value x operator where it is even in N and S together, i x value x operator where it is
odd, with [Na, Nb] = -i Nc. In an oblate basis it is -i: the program has one algebra of N± = Nx ± i Ny for x, y, z = c, b, a (prolate) and
a, b, c (oblate; documentation, "NVIB"), and these frames differ in handedness.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import product
from math import sqrt

import numpy as np
from full_matrix_codes import Case, State, Term
from full_matrix_rotor import (
    FRAMES,
    momenta,
    reduced_coupled,
    reduced_second_rank,
    reduced_vector,
    spin_reduced,
    wigner_9j,
)
from scipy.linalg import block_diag

AXIS_KINDS = {20: "a", 40: "b", 60: "c"}
CROSS_KINDS = {21: "bc", 41: "ac", 61: "ab"}


# --- operators without spins, on |N k> -------------------------------------------------------------------------------


def _power(matrix: np.ndarray, n: int) -> np.ndarray:
    return np.linalg.matrix_power(matrix, n)


def ladder_axes(z: str) -> tuple[str, str]:
    """The axes x and y of N± = Nx ± i Ny: b and c for z = a (Ir), b and a for z = c (IIIl)."""
    return ("b", "c") if z == "a" else ("b", "a")


def plain_operator(kind: int, n: int, z: str) -> np.ndarray:
    """TYP on |N k>: 1, Na², N₊^2n + N₋^2n, Na, NbNc + NcNb."""
    of = momenta(n, z)
    if kind == 0:
        return np.eye(2 * n + 1, dtype=complex)
    if kind <= 3:
        return _power(of["abc"[kind - 1]], 2)
    if kind <= 11:
        x, y = ladder_axes(z)
        plus = of[x] + 1j * of[y]
        return _power(plus, 2 * (kind - 3)) + _power(plus.conj().T, 2 * (kind - 3))
    if kind in AXIS_KINDS:
        return of[AXIS_KINDS[kind]]
    if kind in CROSS_KINDS:
        first, second = (of[axis] for axis in CROSS_KINDS[kind])
        return first @ second + second @ first
    raise ValueError(f"TYP {kind} is not in this calculation")


def is_odd(term: Term) -> bool:
    """Whether the operator changes sign under time reversal: then it stands between different states, with a factor i."""
    return term.kind in AXIS_KINDS


# --- operators with spins ---------------------------------------------------------------------------------------------


def cartesian(kind: int, z: str) -> np.ndarray:
    """The matrix c in Σ c_ij A_i B_j that TYP stands for, in axes a, b, c."""
    c = np.zeros((3, 3))
    if kind == 0:
        return np.eye(3)
    if kind <= 3:
        c[kind - 1, kind - 1] = 1.0
    elif kind == 4:
        x, y = ("abc".index(axis) for axis in ladder_axes(z))
        c[x, x], c[y, y] = 2.0, -2.0
    elif kind in CROSS_KINDS:
        i, j = ("abc".index(axis) for axis in CROSS_KINDS[kind])
        c[i, j] = c[j, i] = 1.0
    else:
        raise ValueError(f"TYP {kind} with spins is not in this calculation")
    return c


def _traceless(c: np.ndarray) -> np.ndarray:
    return c - np.eye(3) * np.trace(c) / 3


def rotor_reduced(kind: int, spins: tuple[int, ...], n_bra: int, n_ket: int, z: str) -> tuple[int, np.ndarray]:
    """Rank and reduced matrix of what TYP means for N when the spins stand in place of N."""
    if not spins:
        matrix = sqrt(2 * n_ket + 1) * plain_operator(kind, n_ket, z)
        return 0, matrix if n_bra == n_ket else np.zeros((2 * n_bra + 1, 2 * n_ket + 1))
    if len(spins) == 1 and kind in AXIS_KINDS:
        return 1, reduced_vector(n_bra, n_ket, np.eye(3)["abc".index(AXIS_KINDS[kind])], z)
    if len(spins) == 1:
        return 1, reduced_coupled(n_bra, n_ket, cartesian(kind, z), z)
    if kind == 0:
        return 0, sqrt(2 * n_ket + 1) * np.eye(2 * n_ket + 1) if n_bra == n_ket else np.zeros(
            (2 * n_bra + 1, 2 * n_ket + 1)
        )
    return 2, reduced_second_rank(n_bra, n_ket, _traceless(cartesian(kind, z)), z)


@cache
def rotor_part(kind: int, spins: tuple[int, ...], k2: int, n_bra: int, n_ket: int, z: str) -> tuple[int, np.ndarray]:
    """Rank and reduced matrix with the power of Nz² as half an anticommutator."""
    rank, matrix = rotor_reduced(kind, spins, n_bra, n_ket, z)
    bra = np.arange(-n_bra, n_bra + 1.0) ** (2 * k2)
    ket = np.arange(-n_ket, n_ket + 1.0) ** (2 * k2)
    return rank, matrix * (bra[:, None] + ket) / 2


def step(bra: tuple[int, int], ket: tuple[int, int], spin: int, ranks: tuple[int, int, int]) -> float:
    """Edmonds' 7.1.5 without the two reduced elements: (j', J'), (j, J), the spin, ranks a, b, c; all but ranks doubled."""
    a, b, c = ranks
    symbol = wigner_9j(((bra[0], ket[0], 2 * a), (spin, spin, 2 * b), (bra[1], ket[1], 2 * c)))
    return sqrt((bra[1] + 1) * (2 * c + 1) * (ket[1] + 1)) * symbol


@cache
def coupling(
    spins2: tuple[int, ...], acting: tuple[int, ...], rank: int, bra: tuple[int, ...], ket: tuple[int, ...]
) -> float:
    """The matrix element of T^rank(N)·{spin operator} divided by ⟨N'||T||N⟩.

    acting: spins, from 1, that the operator holds; (i, i) is T²(I, I)/(2I(2I-1)), the form of a quadrupole; (i, j) the
    product of two vectors coupled to `rank`. bra, ket: 2N, 2J, ..., 2F.
    """
    first, last = (min(acting), max(acting)) if acting else (0, 0)
    result, have = 1.0, rank
    for level, spin in enumerate(spins2, 1):
        if level > last:
            if bra[level] != ket[level]:
                return 0.0
            continue
        here = 0 if level not in acting else 2 if first == last and len(acting) == 2 else 1
        after = have if level < first else 0 if level == last else 1
        unit = spin_reduced(spin, here) if here else sqrt(spin + 1)
        result *= step((bra[level - 1], bra[level]), (ket[level - 1], ket[level]), spin, (have, here, after)) * unit
        if level == last:
            scale = have if here else 0
            result *= (-1) ** scale * sqrt(2 * scale + 1) / sqrt(ket[level] + 1)
        have = after
    if not acting:
        result = 1.0 / sqrt(ket[0] + 1) if bra == ket else 0.0
    elif len(acting) == 2 and first == last:
        size = spins2[first - 1] / 2
        result /= 2 * size * (2 * size - 1)
    elif len(acting) == 2 and rank == 2:
        result *= -sqrt(5 / 3)
    return result


# --- one block --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Piece:
    """A sub-block of the basis: one state, one coupling pattern (2N, 2J, ..., 2F), all its k."""

    v: int
    pattern: tuple[int, ...]
    ks: tuple[int, ...]
    rank: int  # number of the pattern in SPCAT's own order, of N first

    @property
    def n(self) -> int:
        """N."""
        return self.pattern[0] // 2


def patterns(spins2: tuple[int, ...], f2: int) -> list[tuple[int, ...]]:
    """All (2N, 2J, ..., 2F) of one F, from coupling backwards; N whole."""
    computed = [(f2,)]
    for spin in reversed(spins2):
        computed = [(j, *p) for p in computed for j in range(abs(p[0] - spin), p[0] + spin + 1, 2)]
    return sorted(p for p in computed if p[0] % 2 == 0)


def pieces(states: tuple[State, ...], f2: int) -> list[Piece]:
    """The basis of one F."""
    results = []
    for v, state in enumerate(states):
        for number, pattern in enumerate(patterns(state.spins2, f2)):
            n = pattern[0] // 2
            ks = tuple(k for k in range(-n, n + 1) if state.k_min <= abs(k) <= state.k_max)
            if ks:
                results.append(Piece(v, pattern, ks, number))
    return results


def _n_dot_s(piece: Piece, spins2: tuple[int, ...]) -> float:
    n, j, s = piece.pattern[0], piece.pattern[1], spins2[0]
    return (j * (j + 2) - n * (n + 2) - s * (s + 2)) / 8


def _scalar_factor(term: Term, bra: Piece, ket: Piece, spins2: tuple[int, ...]) -> float:
    """½(bra + ket) of N² and N.S powers together."""
    values = []
    for piece in (bra, ket):
        value = float(piece.n * (piece.n + 1)) ** term.n2
        values.append(value * _n_dot_s(piece, spins2) ** term.ns if term.ns else value)
    return sum(values) / 2


def element(term: Term, bra: Piece, ket: Piece, states: tuple[State, ...], z: str) -> np.ndarray | None:
    """value x operator between two pieces, or None where it is zero by symmetry."""
    spins2 = states[ket.v].spins2
    if spins2 != states[bra.v].spins2 or (len(term.spins) == 0 and bra.pattern != ket.pattern):
        return None
    rank, _ = rotor_part(term.kind, term.spins, 0, 0, 0, z)
    factor = coupling(spins2, term.spins, rank, bra.pattern, ket.pattern)
    if factor == 0.0:
        return None
    matrix = rotor_part(term.kind, term.spins, term.k2, bra.n, ket.n, z)[1]
    rows, columns = np.array(bra.ks) + bra.n, np.array(ket.ks) + ket.n
    scale = term.value * factor * _scalar_factor(term, bra, ket, spins2)
    return scale * matrix[np.ix_(rows, columns)]


def term_matrix(term: Term, basis: list[Piece], states: tuple[State, ...], z: str) -> np.ndarray:
    """The matrix of one parameter in the basis |v, pattern, k⟩, Hermitian."""
    starts = np.cumsum([0, *(len(p.ks) for p in basis)])
    total = np.zeros((starts[-1], starts[-1]), complex)
    low, high = term.pair
    if low == high and is_odd(term):
        raise ValueError(f"{term}: an operator odd under time reversal has no place within one state")
    phase = 1 if not is_odd(term) else 1j if z == "a" else -1j
    for i, j in product(range(len(basis)), repeat=2):
        if (basis[i].v, basis[j].v) == (low, high):
            block = element(term, basis[i], basis[j], states, z)
            if block is not None:
                total[starts[i] : starts[i + 1], starts[j] : starts[j + 1]] += phase * block
    return total if low == high else total + total.conj().T


@dataclass(frozen=True)
class WangFunction:
    """One function of the basis, (|K⟩ + sign |-K⟩)/√2: number of the piece, K ≥ 0, sign, D2 species (A, a, b, c)."""

    piece: int
    k: int
    sign: int
    species: str


def wang_functions(basis: list[Piece], z: str) -> list[WangFunction]:
    """All functions with their species: C2 about z gives (-1)^K, about x gives sign (-1)^N."""
    x, y, _ = FRAMES[z]
    names = {(1, 1): "A", (1, -1): z, (-1, 1): x, (-1, -1): y}
    return [
        WangFunction(number, k, sign, names[(-1) ** k, sign * (-1) ** piece.n])
        for number, piece in enumerate(basis)
        for k in sorted({abs(k) for k in piece.ks})
        for sign in ((1, -1) if k else (1,))
    ]


def wang_columns(piece: Piece, functions: list[WangFunction]) -> np.ndarray:
    """The functions of one piece as columns on its |N k⟩."""
    ks, columns = np.array(piece.ks), []
    for f in functions:
        column = np.where(ks == f.k, 1.0, 0.0) + f.sign * np.where((ks == -f.k) & (ks != 0), 1.0, 0.0)
        columns.append(column / np.linalg.norm(column))
    return np.array(columns).T


def block(case: Case, f2: int) -> tuple[list[Piece], list[WangFunction], np.ndarray, np.ndarray]:
    """Basis, Wang functions, Hamiltonian in them, and where a parameter puts an element that is not zero."""
    z = "c" if case.oblate else "a"
    basis = pieces(case.states, f2)
    functions = wang_functions(basis, z)
    transform = block_diag(*(wang_columns(p, [f for f in functions if f.piece == i]) for i, p in enumerate(basis)))
    total = np.zeros((len(functions),) * 2, complex)
    joined = np.eye(len(functions), dtype=bool)
    for term in case.terms:
        if term.value:
            matrix = transform.T @ term_matrix(term, basis, case.states, z) @ transform
            size = np.abs(matrix)
            joined |= size > 1e-10 * size.max()  # rounding of sums of products leaves 1e-15 of the largest element
            total += matrix
    return basis, functions, total, joined
