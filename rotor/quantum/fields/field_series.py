"""Energies as power series in a field about zero field, E(x) = E0 + c1 x + c2 x² + ..., for degenerate levels too.

H(x) = Σ x^n H_n. P projects on the states of one energy E0, Q on all others. The wave operator 1 + X, with X from P to Q, maps P to
the space of the perturbed states, and (Bloch's equation; C. Brouder et al., arXiv:1011.1751, section 2)

    H_QP + H_QQ X - X H_PP - X H_PQ X = 0,      H_eff = H_PP + H_PQ X                                                  (1)

are solved order by order: X_n (E0 - E_Q) = the terms of order n. With S = 1 + X†X, S^½ H_eff S^-½ = E0 + x A_1 + x² A_2 + ... is
Hermitian and has the same eigenvalues. For a single state c_n = A_n. For a degenerate level, c1 are the eigenvalues of A_1; equal ones are
split by A_2, A_3, ... in the same way, since the eigenvalues of A_1 + x A_2 + ... are a problem of the same form (reduction process;
T. Kato, Perturbation Theory for Linear Operators, section II.2.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.solver import Matrix, Terms

EQUAL = 1e-11  # eigenvalues closer than this, relative to the operators of one order, count as equal
ROUND_OFF = 8 * float(np.finfo(np.float64).eps)  # of free energies, relative to the largest

Series = list[Matrix]  # coefficients of x^0, x^1, ...


class FieldSeries(NamedTuple):
    """Coefficients c_1 ... of the lowest states of a block (states, orders), and their errors.

    errors: change of each coefficient when neighbouring free levels move apart by the round-off of their energies.
    """

    coefficients: Floats
    errors: Floats


def field_series(terms: Terms, count: int, orders: int, even: bool = False) -> FieldSeries:
    """Power series at zero field of the lowest `count` states, in order of energy at a small positive field.

    terms: H_0, H_1, ... in MHz per power of the unit of the field. orders: the highest power. even: whether reversing the field changes no
    energy; odd coefficients of a single state are then 0.

    >>> two = (np.diag([0.0, 2.0]), np.array([[0.0, 1.0], [1.0, 0.0]]))
    >>> field_series(two, 2, 4).coefficients.tolist()  # 1 -+ √(1 + x²)
    [[0.0, -0.5, 0.0, 0.125], [0.0, 0.5, 0.0, -0.125]]
    """
    energies, operators = _free_states(terms, count, orders)
    shift = ROUND_OFF * float(np.abs(energies).max(initial=0.0))
    clusters = _clusters(energies, shift)
    moved = energies.copy()
    for number, places in enumerate(clusters):
        moved[places] += shift * (-1) ** number
    followed = [places for places in clusters if places[0] < count]
    values, others = (
        np.concatenate([_cluster_series(levels, operators, places, orders, even) for places in followed])[:count]
        for levels in (energies, moved)
    )
    return FieldSeries(values, np.abs(others - values))


def _free_states(terms: Terms, count: int, orders: int) -> tuple[Floats, Terms]:
    """Energies at zero field, rising, and H_1, H_2, ... over the states that the lowest `count` reach up to the highest order."""
    fixed = terms[0]
    if not np.any(fixed - np.diag(np.diag(fixed))):
        energies = np.diag(fixed).real
        order = np.argsort(energies, kind="stable")
        last = int(
            np.searchsorted(energies[order], energies[order[count - 1]] + ROUND_OFF * np.abs(energies).max(), "right")
        )
        reached = np.isin(np.arange(len(order)), order[:last])
        for _ in range(orders // 2):
            reached |= np.any([np.any(term[:, reached] != 0, axis=1) for term in terms[1:]], axis=0)
        order = order[reached[order]]
        return energies[order], tuple(term[np.ix_(order, order)] for term in terms[1:])
    energies, vectors = np.linalg.eigh(fixed)
    return energies, tuple(vectors.conj().T @ term @ vectors for term in terms[1:])


def _clusters(values: Floats, tolerance: float) -> list[Ints]:
    """Groups of places of rising values whose neighbours coincide."""
    return np.split(np.arange(len(values)), np.flatnonzero(np.diff(values) > tolerance) + 1)


def _cluster_series(energies: Floats, terms: Terms, places: Ints, orders: int, even: bool) -> Floats:
    """c_1 ... of the states at `places` (states, orders), in order of energy at a small positive field."""
    operators, sizes = _effective(energies, terms, places, orders)
    if len(places) > 1:
        return _split(operators, sizes)
    series = np.array([[float(operator[0, 0].real) for operator in operators]])
    if even:
        series[:, ::2] = 0.0
    return series


def _split(operators: Series, sizes: Sequence[float]) -> Floats:
    """Eigenvalues of A_1 + x A_2 + ... as series (states, orders); sizes: size of the terms in each A_n."""
    first, vectors = np.linalg.eigh(operators[0])
    rest = tuple(vectors.conj().T @ term @ vectors for term in operators[1:])
    parts = []
    for places in _clusters(first, EQUAL * sizes[0]):
        value = float(first[places].mean())
        value = 0.0 if abs(value) <= EQUAL * sizes[0] else value
        if not rest:
            parts.append(np.full((len(places), 1), value))
            continue
        inner, inner_sizes = _effective(first, rest, places, len(rest))
        larger = [max(pair) for pair in zip(inner_sizes, sizes[1:], strict=True)]
        series = _split(inner, larger)
        parts.append(np.concatenate([np.full((len(places), 1), value), series], axis=1))
    return np.concatenate(parts)


def _effective(energies: Floats, terms: Terms, places: Ints, orders: int) -> tuple[Series, list[float]]:
    """A_1 ... over the states at `places`, Hermitian, and the size of the terms of each (equation 1)."""
    outside = np.setdiff1d(np.arange(len(energies)), places)
    gaps = energies[places].mean() - energies[outside]
    empty = np.zeros_like(terms[0])
    powers = [terms[n] if n < len(terms) else empty for n in range(orders)]  # powers[n - 1] = H_n
    inside = [term[np.ix_(places, places)] for term in powers]
    up = [term[np.ix_(outside, places)] for term in powers]
    rest = [term[np.ix_(outside, outside)] for term in terms]
    waves: Series = [np.zeros((len(outside), len(places)), dtype=terms[0].dtype)]  # X_0, X_1, ...
    effective: Series = []
    sizes: list[float] = []
    for n in range(1, orders + 1):
        products = [up[k - 1].conj().T @ waves[n - k] for k in range(1, n)]
        effective.append(inside[n - 1] + sum(products))
        sizes.append(_norm(powers[n - 1][places]) + sum(_norm(up[k - 1]) * _norm(waves[n - k]) for k in range(1, n)))
        wave = up[n - 1] + sum(rest[k - 1] @ waves[n - k] for k in range(1, min(n, len(rest) + 1)))
        wave = wave - sum(waves[n - k] @ effective[k - 1] for k in range(1, n))
        waves.append(wave / gaps[:, None])
    return _hermitian(effective, waves), sizes


def _norm(matrix: Matrix) -> float:
    return float(np.linalg.norm(matrix)) if matrix.size else 0.0


def _hermitian(effective: Series, waves: Series) -> Series:
    """S^½ H_eff S^-½ with S = 1 + X†X, all as series; `effective` begins with the first power."""
    if len(effective[0]) == 1:
        return effective
    orders = len(effective)
    unit = np.eye(len(effective[0]), dtype=waves[0].dtype)
    overlap = [sum((waves[k].conj().T @ waves[n - k] for k in range(n + 1)), 0 * unit) for n in range(orders)]
    root, inverse = [unit], [unit]
    for n in range(1, orders):
        root.append((overlap[n] - sum((root[k] @ root[n - k] for k in range(1, n)), 0 * unit)) / 2)
        inverse.append(-sum((root[k] @ inverse[n - k] for k in range(1, n + 1)), 0 * unit))
    out = _product(_product(root, effective), inverse)
    return [(part + part.conj().T) / 2 for part in out]


def _product(left: Series, right: Series) -> Series:
    """Product of two series, up to the length of the shorter one."""
    length = min(len(left), len(right))
    zero: NDArray[Any] = 0 * left[0]
    return [sum((left[k] @ right[n - k] for k in range(n + 1)), zero) for n in range(length)]
