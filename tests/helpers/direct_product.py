"""Operators in a direct product |N k m⟩ x |m_S⟩ x ..., every m written out: direction cosines, N along the axes, QuTiP's spins."""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np
import qutip
from full_matrix_rotor import in_frame, momenta, wigner_3j
from scipy.linalg import block_diag


def states_up_to(top: int) -> list[tuple[int, int, int]]:
    return [(n, k, m) for n in range(top + 1) for k in range(-n, n + 1) for m in range(-n, n + 1)]


@cache
def cosines(top: int, z: str = "a") -> dict[tuple[int, str], np.ndarray]:
    """φ_pi for p = -1, 0, 1 (spherical, space) and i = a, b, c on |N k m⟩, k along z."""
    states = states_up_to(top)
    index = {s: i for i, s in enumerate(states)}
    results = {}
    for p, axis in product((-1, 0, 1), "abc"):
        x, y, along = in_frame(np.eye(3)["abc".index(axis)], z)
        parts = {0: along, 1: -(x + 1j * y) / np.sqrt(2), -1: (x - 1j * y) / np.sqrt(2)}
        matrix = np.zeros((len(states),) * 2, complex)
        for (n, k, m), q, other in product(states, (-1, 0, 1), range(top + 1)):
            if (other, k + q, m + p) in index and parts[q]:
                size = np.sqrt((2 * n + 1) * (2 * other + 1)) * (-1) ** (m + p - k - q)
                size *= wigner_3j(2 * other, 2, 2 * n, -2 * (m + p), 2 * p, 2 * m)
                size *= wigner_3j(2 * other, 2, 2 * n, -2 * (k + q), 2 * q, 2 * k)
                matrix[index[other, k + q, m + p], index[n, k, m]] += parts[q] * size
        results[p, axis] = matrix
    return results


@cache
def space_cosines(top: int, z: str = "a") -> dict[tuple[str, str], np.ndarray]:
    """φ_FI, F = X, Y, Z in space, I = a, b, c in the molecule."""
    phi = cosines(top, z)
    results = {}
    for axis in "abc":
        results["z", axis] = phi[0, axis]
        results["x", axis] = (phi[-1, axis] - phi[1, axis]) / np.sqrt(2)
        results["y", axis] = 1j * (phi[-1, axis] + phi[1, axis]) / np.sqrt(2)
    return results


@cache
def rotor_matrix(axis: str, top: int, z: str = "a") -> np.ndarray:
    """N_axis of the molecule on |N k m⟩."""
    return block_diag(*(np.kron(momenta(n, z)[axis], np.eye(2 * n + 1)) for n in range(top + 1)))


def on_spins(rotor: np.ndarray, spins2: tuple[int, ...], acting: dict[int, np.ndarray]) -> np.ndarray:
    factors = [qutip.Qobj(acting.get(i, np.eye(s + 1))) for i, s in enumerate(spins2, 1)]
    return qutip.tensor(qutip.Qobj(rotor), *factors).full()
