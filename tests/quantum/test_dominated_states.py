"""States that lie mostly in a few functions against all states of the matrix."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from rotor.quantum.blocks import dominated
from rotor.quantum.blocks.dominated import dominated_states


def matrix_of(coupling, *, resonance=False, size=300, count=12):
    """A few functions below 300, the others from 1000; with `resonance` one of the others among the few."""
    rng = np.random.default_rng(7)
    diagonal = np.where(np.arange(size) < count, 20.0 * np.arange(size), 1000.0 + 5.0 * np.arange(size))
    if resonance:
        diagonal[-1] = 100.0 + 1e-5  # beside function 5
    full = rng.normal(scale=coupling, size=(size, size))
    return np.tril(full + full.T) / 2 + np.diag(diagonal)


@pytest.mark.parametrize("resonance", [False, True])
def test_energies_and_vectors_are_those_of_the_whole_matrix(resonance):
    lower, chosen = matrix_of(3.0, resonance=resonance), np.arange(12)
    energies, vectors = dominated_states(csr_array(np.tril(lower)), chosen)
    eigenvalues, states = np.linalg.eigh(np.tril(lower) + np.tril(lower, -1).T)
    shares = (states[chosen] ** 2).sum(axis=0)
    best = np.sort(np.argsort(-shares)[:12])
    assert np.abs(energies - eigenvalues[best]).max() < 1e-6
    overlaps = np.abs(states[:, best].T @ vectors)
    assert np.abs(overlaps - np.eye(12)).max() < 1e-5
    assert np.abs(vectors.T @ vectors - np.eye(12)).max() < 1e-12


def test_without_convergence_all_states_are_solved(monkeypatch):
    monkeypatch.setattr(dominated, "SPACE", 0.05)
    assert dominated_states(csr_array(np.tril(matrix_of(3.0))), np.arange(12)) is None
    assert dominated_states(csr_array(np.tril(matrix_of(3.0))), np.arange(100)) is None  # too many
    assert dominated_states(csr_array(np.tril(matrix_of(3.0, size=100))), np.arange(5)) is None  # small
