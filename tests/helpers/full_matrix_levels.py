"""Levels, labels and line strengths from the full matrices of `full_matrix.py`, in the form of SPCAT's files.

A label belongs to a sub-block of the basis: one state v, one N, one coupling pattern, one D2 species. Eigenvectors are given
to sub-blocks one to one, the largest share first; within a sub-block they take K in order of energy (of falling energy in
the oblate basis, where the program turns the sign of H). Parts of a sub-block that nothing joins stay by themselves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from math import log10, sqrt

import numpy as np
from full_matrix import Piece, WangFunction, block, step, wang_columns
from full_matrix_codes import Case, State
from full_matrix_rotor import reduced_vector
from scipy.sparse.csgraph import connected_components

CM_MHZ = 29979.2458
INTENSITY = 4.16231e-5  # nm² MHz over D² MHz, the constant of the JPL catalogue


@dataclass(frozen=True, eq=False)
class Block:
    """One F: basis, eigenvectors (columns, in Wang functions), and columns of levels in order of the eigenvectors."""

    f2: int
    basis: list[Piece]
    functions: list[WangFunction]
    vectors: np.ndarray
    energy_mhz: np.ndarray
    mixing: np.ndarray
    quanta: list[tuple[int, ...]]
    weight: np.ndarray


def assign(shares: np.ndarray, capacity: np.ndarray) -> np.ndarray:
    """The sub-block of each eigenvector: shares (vectors, blocks), the largest first, none beyond its capacity."""
    left, computed = capacity.copy(), np.full(len(shares), -1)
    order = np.dstack(np.unravel_index(np.argsort(-shares, axis=None, kind="stable"), shares.shape))[0]
    for vector, sub in order:
        if computed[vector] < 0 and left[sub]:
            computed[vector], left[sub] = sub, left[sub] - 1
    return computed


def _weight(state: State, k: int, species: str) -> int:
    """Spin weight of a rotational function of one state."""
    if state.axis == 6 and (k - state.l_code) % 3:
        return state.e_weight
    if state.axis > 6 or state.axis in (4, 5):
        raise ValueError(f"IAX = {state.axis} is not in this calculation")
    axis = "b" if state.axis > 3 else "abc"[state.axis - 1]
    return state.plus if species in ("A", axis) else state.minus


def _quanta(case: Case, piece: Piece, k: int, species: str) -> tuple[int, ...]:
    """N, Ka, Kc, v, J ... F as the files print them: half-integers rounded up."""
    n, state = piece.n, case.states[piece.v]
    z, x = ("c", "a") if case.oblate else ("a", "c")  # the axes SPCAT numbers 3 and 1
    odd = species in (z, x)
    other = n - k + ((n + odd) % 2)
    if case.symmetric:
        threefold = state.axis == 6 and (k - state.l_code) % 3
        k_values = () if case.linear else (-k if odd and not threefold else k,)
    else:
        k_values = (other, k) if case.oblate else (k, other)
    v = (piece.v,) if len(case.states) > 1 else ()
    return (n, *k_values, *v, *((x2 + 1) // 2 for x2 in piece.pattern[1:]))


def solve(case: Case, f2: int) -> Block:
    """All levels of one F."""
    basis, functions, hamiltonian, joined = block(case, f2)
    count, part = connected_components(joined, directed=False)
    keys = sorted({(f.piece, f.species) for f in functions})
    key_index = np.array([keys.index((f.piece, f.species)) for f in functions])
    vectors = np.zeros(hamiltonian.shape, complex)
    energy, mixing, label = np.zeros(len(functions)), np.ones(len(functions)), np.zeros(len(functions), int)
    done = 0
    for number in range(count):
        index = np.flatnonzero(part == number)
        values, columns = np.linalg.eigh(hamiltonian[np.ix_(index, index)])
        present = np.unique(key_index[index])
        members = [np.flatnonzero(key_index[index] == key) for key in present]
        shares = np.array([(np.abs(columns[m]) ** 2).sum(axis=0) for m in members]).T
        computed = assign(shares, np.array([len(m) for m in members]))
        for sub, member in enumerate(members):
            chosen_vectors = np.flatnonzero(computed == sub)[:: -1 if case.oblate else 1]
            for vector, place in zip(chosen_vectors, sorted(member, key=lambda i: functions[index[i]].k), strict=True):
                vectors[index, done] = columns[:, vector]
                energy[done], mixing[done], label[done] = values[vector], shares[vector, sub], index[place]
                done += 1
    chosen = [functions[i] for i in label]
    quanta = [_quanta(case, basis[f.piece], f.k, f.species) for f in chosen]
    weight = np.array([_weight(case.states[basis[f.piece].v], f.k, f.species) for f in chosen])
    return Block(f2, basis, functions, vectors, energy, mixing, quanta, weight)


def _dipole_piece(bra: Piece, ket: Piece, spins2: tuple[int, ...]) -> float:
    """⟨F'||T¹(N)||F⟩ over ⟨N'||T¹||N⟩ in a chain of spins that the dipole does not touch."""
    factor = 1.0
    for level, spin in enumerate(spins2, 1):
        pairs = (bra.pattern[level - 1], bra.pattern[level]), (ket.pattern[level - 1], ket.pattern[level])
        factor *= step(*pairs, spin, (1, 0, 1)) * sqrt(spin + 1)
    return factor


def strengths(case: Case, upper: Block, lower: Block) -> np.ndarray:
    """|⟨F'||μ||F⟩|² in D² for each pair of eigenvectors."""

    def dipole(bra: Piece, ket: Piece) -> np.ndarray:
        return vector_elements(case, bra, ket, _dipole(case, bra.v, ket.v))

    return np.abs(amplitudes(case, upper, lower, dipole)) ** 2


def vector_elements(case: Case, bra: Piece, ket: Piece, vector: np.ndarray) -> np.ndarray:
    """⟨N' K'||T¹||N K⟩ of a vector (3,) along a, b, c."""
    whole = reduced_vector(bra.n, ket.n, vector, "c" if case.oblate else "a")
    return whole[np.ix_(np.array(bra.ks) + bra.n, np.array(ket.ks) + ket.n)]


def amplitudes(case: Case, upper: Block, lower: Block, elements: Callable[[Piece, Piece], np.ndarray]) -> np.ndarray:
    """⟨F'||T¹||F⟩ for each pair of eigenvectors; elements: ⟨N' K'||T¹||N K⟩ between two pieces, whose N differ by at most 1."""
    total = np.zeros((len(upper.functions), len(lower.functions)), complex)
    rows, columns = _places(upper), _places(lower)
    for i, j in product(range(len(upper.basis)), range(len(lower.basis))):
        bra, ket = upper.basis[i], lower.basis[j]
        if abs(bra.n - ket.n) <= 1 and (matrix := elements(bra, ket)).any():
            left = wang_columns(bra, [upper.functions[r] for r in rows[i]])
            right = wang_columns(ket, [lower.functions[c] for c in columns[j]])
            factor = _dipole_piece(bra, ket, case.states[ket.v].spins2)
            total[np.ix_(rows[i], columns[j])] = factor * left.T @ matrix @ right
    return np.asarray(upper.vectors.conj().T @ total @ lower.vectors)


def _places(of: Block) -> list[list[int]]:
    return [[i for i, f in enumerate(of.functions) if f.piece == p] for p in range(len(of.basis))]


def _dipole(case: Case, v: int, other: int) -> np.ndarray:
    vector = np.zeros(3)
    for pair, axis, value in case.dipoles:
        if pair == (min(v, other), max(v, other)):
            vector["abc".index(axis)] += value
    return vector


def lgint(
    frequency_mhz: float, strength: float, weight: int, lower_mhz: float, temperature_k: float, q: float
) -> float:
    """log10 of the integrated intensity in nm² MHz."""
    kt = temperature_k * 20836.619  # k/h in MHz/K
    boltzmann = np.exp(-lower_mhz / kt) - np.exp(-(lower_mhz + frequency_mhz) / kt)
    return log10(INTENSITY * frequency_mhz * strength * weight * boltzmann / q)
