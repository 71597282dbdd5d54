"""Slow, plain matrices of tops in fields over all |J k M⟩, from QuTiP's Clebsch-Gordan coefficients alone."""

from __future__ import annotations

import functools
import math

import numpy as np
import qutip


@functools.cache
def clebsch(j1: int, j2: int, j3: int, m1: int, m2: int, m3: int) -> float:
    """⟨j1 m1 j2 m2|j3 m3⟩ of QuTiP."""
    return float(qutip.clebsch(j1, j2, j3, m1, m2, m3))


def states(jmax: int, linear: bool = False) -> list[tuple[int, int, int]]:
    """All (J, k, M); k = 0 alone of a linear top."""
    return [
        (j, k, m) for j in range(jmax + 1) for k in (range(1) if linear else range(-j, j + 1)) for m in range(-j, j + 1)
    ]


def rotation_function(basis: list[tuple[int, int, int]], rank: int, p: int, q: int) -> np.ndarray:
    """⟨J'k'M'|D^K*_pq|J k M⟩ = √((2J+1)/(2J'+1)) ⟨J M K p|J' M'⟩ ⟨J k K q|J' k'⟩ (Zare, Angular Momentum, eq. 3.118)."""
    place = {state: i for i, state in enumerate(basis)}
    out = np.zeros((len(basis), len(basis)))
    for (j, k, m), column in place.items():
        for up in range(abs(j - rank), j + rank + 1):
            row = place.get((up, k + q, m + p))
            if row is not None:
                product = clebsch(j, rank, up, m, p, m + p) * clebsch(j, rank, up, k, q, k + q)
                out[row, column] = math.sqrt((2 * j + 1) / (2 * up + 1)) * product
    return out


def vector_components(vector) -> dict[int, complex]:
    """T_0 = z, T_±1 = ∓(x ± iy)/√2."""
    x, y, z = vector
    return {0: z, 1: -(x + 1j * y) / math.sqrt(2), -1: (x - 1j * y) / math.sqrt(2)}


def contracted_vectors(basis, body_xyz, space) -> np.ndarray:
    """Σ_F E_F μ_F, the body vector along x, y, z of the representation: Σ_pq E_p* μ_q D^1*_pq."""
    body, field = vector_components(body_xyz), vector_components(space)
    return sum(
        np.conj(field[p]) * body[q] * rotation_function(basis, 1, p, q)
        for p in (-1, 0, 1)
        for q in (-1, 0, 1)
        if body[q]
    )


def rigid(basis, bx: float, by: float, bz: float) -> np.ndarray:
    """½(Bx+By) J² + [Bz - ½(Bx+By)] Jz² + ¼(Bx-By)(J₊² + J₋²)."""
    place = {state: i for i, state in enumerate(basis)}
    out = np.zeros((len(basis), len(basis)))
    for (j, k, m), i in place.items():
        out[i, i] = (bx + by) / 2 * j * (j + 1) + (bz - (bx + by) / 2) * k * k
        if (j, k + 2, m) in place:
            step = math.sqrt((j * (j + 1) - k * (k + 1)) * (j * (j + 1) - (k + 1) * (k + 2)))
            other = place[j, k + 2, m]
            out[other, i] = out[i, other] = (bx - by) / 4 * step
    return out
