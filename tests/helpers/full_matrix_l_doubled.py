"""l-doubled states over |l = ±⟩|N k⟩ as full matrices: what codes of SPFIT between such states stand for, by signed k and l.

|K⟩|±⟩ of all signed K stand for both states of a pair, which differ in the sign of K l (Pickett's documentation, "EWT1"). Parameters of
the first state act on both l, times l where they are odd; between both states they have Δl = 2 and between another state and the first
Δl = 1, with Δk Δl > 0 for V2 < V1, else < 0; between two first states they act at each l.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from full_matrix import Piece, element, is_odd, pieces
from full_matrix_codes import Case, Term


def l_values(case: Case) -> dict[int, int]:
    """l of the states of pairs, which stand side by side: 1 for the first, with the smaller code, -1 for the second."""
    doubled = [v for v, state in enumerate(case.states) if state.l_code]
    l_of: dict[int, int] = {}
    for a, b in zip(doubled[::2], doubled[1::2], strict=True):
        sign = 1 if case.states[a].l_code < case.states[b].l_code else -1
        l_of |= {a: sign, b: -sign}
    return l_of


def _partner(v: int, l_of: Mapping[int, int]) -> int:
    doubled = sorted(l_of)
    return doubled[doubled.index(v) ^ 1]


def _entries(term: Term, l_of: Mapping[int, int], oblate: bool) -> list[tuple[int, int, complex, int]]:
    """States of bra and ket, factor, and sign of Δk (0: all elements) of a term; the adjoint stands for those of the other order."""
    (low, high), odd, along = term.pair, is_odd(term), -1 if term.below else 1
    i = (-1j if oblate else 1j) if odd else 1.0
    if low == high:
        if low not in l_of:
            return [(low, low, 1.0, 0)]
        both = (low, _partner(low, l_of)) if l_of[low] == 1 else ()
        return [(v, v, l_of[v] if odd else 1.0, 0) for v in both]
    if low not in l_of and high not in l_of:
        return [(low, high, i, 0)]
    if low in l_of and high in l_of:
        if _partner(low, l_of) == high:
            plus, minus = (low, high) if l_of[low] == 1 else (high, low)
            return [(plus, minus, 1.0, along)]
        return [(low, high, 1.0, 0), (_partner(low, l_of), _partner(high, l_of), 1.0, 0)]
    doubled, other = (high, low) if high in l_of else (low, high)
    factor = i if other < doubled else np.conj(i)
    return [(other, v, factor, -l_of[v] * along) for v in (doubled, _partner(doubled, l_of))]


def l_doubled_solution(case: Case, f2: int) -> tuple[list[Piece], np.ndarray, np.ndarray]:
    """Pieces, eigenvectors over |v, pattern, k⟩ and energies of one F; the states of a pair are l = 1 and l = -1."""
    l_of, basis = l_values(case), pieces(case.states, f2)
    starts = np.cumsum([0, *(len(piece.ks) for piece in basis)])
    total = np.zeros((starts[-1], starts[-1]), complex)
    for term in case.terms:
        for bra_v, ket_v, factor, change in _entries(term, l_of, case.oblate):
            matrix = _between(replace(term, pair=(bra_v, ket_v)), basis, starts, case, change)
            total += factor * matrix if bra_v == ket_v else factor * matrix + (factor * matrix).conj().T
    energy, vectors = np.linalg.eigh(total)
    return basis, vectors, energy


def _between(term: Term, basis: list[Piece], starts: np.ndarray, case: Case, change: int) -> np.ndarray:
    """Elements of a term from its second state to its first; those with Δk of one sign where that is not 0."""
    total = np.zeros((starts[-1], starts[-1]), complex)
    for i, bra in enumerate(basis):
        for j, ket in enumerate(basis):
            if (bra.v, ket.v) != term.pair:
                continue
            matrix = element(term, bra, ket, case.states, "c" if case.oblate else "a")
            if matrix is not None:
                rise = np.sign(np.subtract.outer(bra.ks, ket.ks))
                total[starts[i] : starts[i + 1], starts[j] : starts[j + 1]] = matrix * (rise == change if change else 1)
    return total
