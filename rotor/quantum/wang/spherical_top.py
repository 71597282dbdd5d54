"""Spherical tops: exact splittings of each J into levels A1, A2, E, F1, F2 by the fourth-rank tensor.

    Ω = 6 J⁴ - 2 J² - 10 (Jx⁴ + Jy⁴ + Jz⁴),      E = B X - D X² + ... + D_t ω(J, irrep, rank),      X = J(J+1)

(K. T. Hecht, J. Mol. Spectrosc. 5 (1960) 355, 390). ω are the eigenvalues of Ω and thus exact for any D_t. With z along a
fourfold axis, states |J K s⟩ (see `basis`) with K of one residue modulo 4 and one s span the irreps A1, A2, B1, B2 of D4, by the signs
e^{iπK/2} under C4z and s(-1)^J under C2x. From O to D4

    A1 → A1,    A2 → B1,    E → A1 + B1,    F1 → A2 + E,    F2 → B2 + E

(Bunker and Jensen, Molecular Symmetry and Spectroscopy, table B-2). F1 and F2 thus are separate blocks. A threefold turn, whose matrix in
such a block has the eigenvalue χ(C3)/dimension, distinguishes A1 and A2 (1) from E (-½). Labels are therefore correct even for levels of
one cluster, which at high J are closer than round-off.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.quantum.wang.basis import WangBlock
from rotor.quantum.wang.wang_matrix import block_bands, scalar_energy
from rotor.tops.constants.operators import CUBIC_TENSOR, Operators
from rotor.tops.spins.spin_weights import CUBIC_IRREPS

_SUBBLOCKS = {"A1": (0, 1), "B1": (2, 1), "A2": (0, -1), "B2": (2, -1)}  # K modulo 4 and character under C2x
DIMENSION = {"A1": 1, "A2": 1, "E": 2, "F1": 3, "F2": 3}


def is_cubic(operators: Operators) -> bool:
    """Whether operators are those of a spherical top: powers of J² and the tensor of D_t."""
    dt = operators.get((0, 0, 2), 0.0) / CUBIC_TENSOR[0, 0, 2]
    others = {powers for powers in operators if powers[1] or powers[2]}
    return all(
        abs(operators[powers] - dt * CUBIC_TENSOR.get(powers, 0.0)) <= 1e-12 * abs(operators[powers])
        for powers in others
    )


def scalar_and_tensor(operators: Operators) -> tuple[Operators, float]:
    """Operators of a spherical top divided into powers of J² and D_t; terms that are not cubic (`is_cubic`) are ignored."""
    dt = operators.get((0, 0, 2), 0.0) / CUBIC_TENSOR[0, 0, 2]
    scalars = {
        powers: value - dt * CUBIC_TENSOR.get(powers, 0.0) for powers, value in operators.items() if not any(powers[1:])
    }
    return scalars, dt


@lru_cache(maxsize=512)
def tensor_eigenvalues(j: int, sign: int = 1) -> tuple[NDArray[np.str_], Floats]:
    """Irreps (n,) and eigenvalues ω (n,) of the tensor for one J, in the order A1, A2, E, F1, F2.

    Within each irrep sign · ω rises, so that energies rise for D_t of that sign.

    >>> irreps, omega = tensor_eigenvalues(2)
    >>> irreps.tolist(), omega.round(9).tolist()
    (['E', 'F2'], [-36.0, 24.0])
    """
    eigenvalues = {"F1": np.linalg.eigvalsh(_block(j, "A2")), "F2": np.linalg.eigvalsh(_block(j, "B2"))}
    eigenvalues["A1"], eigenvalues["E"] = _one_and_two_dimensional(j, "A1")
    eigenvalues["A2"], _ = _one_and_two_dimensional(j, "B1")

    irreps = np.repeat(CUBIC_IRREPS, [len(eigenvalues[irrep]) for irrep in CUBIC_IRREPS])
    omega = np.concatenate([sign * np.sort(sign * eigenvalues[irrep]) for irrep in CUBIC_IRREPS])
    return irreps, omega + scalar_energy(CUBIC_TENSOR, j)


def _wang(j: int, name: str) -> tuple[WangBlock, slice]:
    """The Wang block that contains an irrep of D4, and its states of this irrep, alternate ones."""
    residue, character = _SUBBLOCKS[name]
    sign = character * (-1) ** j
    first = 0 if sign == 1 else 2
    block = WangBlock(j, "", first, sign, max((j - first) // 2 + 1, 0))
    return block, slice((residue - first) // 2 % 2, None, 2)


def _block(j: int, name: str) -> Floats:
    """The matrix of the tensor without its scalar part over the states of one irrep of D4."""
    block, chosen = _wang(j, name)
    if block.size == 0:
        return np.zeros((0, 0))
    (bands,) = block_bands(CUBIC_TENSOR, [block])
    matrix = np.diag(bands[0])
    for n, band in enumerate(bands[1:], 1):
        matrix += np.diag(band, n) + np.diag(band, -n)
    return np.asarray(matrix[chosen, chosen])


def _one_and_two_dimensional(j: int, name: str) -> tuple[Floats, Floats]:
    """Eigenvalues of A1 (or A2) and of E, which share an irrep of D4."""
    matrix, turn = _block(j, name), _threefold_turn(j, name)
    characters, states = np.linalg.eigh(turn)
    a_states, e_states = states[:, characters > 0.25], states[:, characters < 0.25]  # 1 and -½
    return np.linalg.eigvalsh(a_states.T @ matrix @ a_states), np.linalg.eigvalsh(e_states.T @ matrix @ e_states)


def _threefold_turn(j: int, name: str) -> Floats:
    """The matrix of C3 about (1, 1, 1) = C4z C4y over the states of A1 or B1 of D4.

    C4y turns z into x, so that its matrix is Σ_m ⟨K|m⟩_x e^{-iπm/2} ⟨m|K'⟩_x, up to phases that are 1 here, with |m⟩_x the eigenvectors of
    Jx. For even K and K' only the cosine of the exponential remains. C4z is 1 in A1 and -1 in B1.
    """
    block, chosen = _wang(j, name)
    k = block.k[chosen]
    along_x = _eigenvectors_of_jx(j)
    states = np.where(k == 0, 0.5, np.sqrt(0.5))[:, None] * (along_x[j + k] + block.sign * along_x[j - k])
    cosines = np.array([1, 0, -1, 0])[np.arange(-j, j + 1) % 4]
    return np.asarray((1 if name == "A1" else -1) * (states * cosines) @ states.T)


@lru_cache(maxsize=2)
def _eigenvectors_of_jx(j: int) -> Floats:
    """⟨K|m⟩_x with K and m rising from -J to J, (2J+1, 2J+1)."""
    from scipy.linalg import eigh_tridiagonal

    k = np.arange(-j, j)
    if j == 0:
        return np.ones((1, 1))
    return np.asarray(eigh_tridiagonal(np.zeros(2 * j + 1), 0.5 * np.sqrt(j * (j + 1) - k * (k + 1)))[1])
