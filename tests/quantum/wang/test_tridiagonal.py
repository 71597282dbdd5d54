"""Eigenvectors of tridiagonal matrices from their eigenvalues, against LAPACK."""

from __future__ import annotations

import numpy as np
import pytest

from rotor.arrays import Workspace
from rotor.quantum.solvers.tridiagonal import vectors_of_values


def matrices(rng: np.random.Generator, size: int, count: int):
    """Elements, padded, and every whole matrix: sizes from 1 on, diagonals that rise as K² does."""
    diagonal = rng.normal(size=(count, size)) * 1e4 * np.arange(1, size + 1) ** 2
    beside = rng.normal(size=(count, size)) * 1e5
    whole, values = [], np.full((count, size), np.inf)
    for i, n in enumerate(rng.integers(1, size + 1, size=count).tolist()):
        diagonal[i, n:], beside[i, n - 1 :] = 0.0, 0.0
        whole.append(np.diag(diagonal[i, :n]) + np.diag(beside[i, : n - 1], 1) + np.diag(beside[i, : n - 1], -1))
        values[i, :n] = np.linalg.eigvalsh(whole[-1])
    return diagonal, beside, values, whole


@pytest.mark.parametrize("size", [1, 2, 9, 31])
def test_the_vectors_are_those_of_lapack(size):
    diagonal, beside, values, whole = matrices(np.random.default_rng(size), size, 30)
    places = [(i, state) for i, matrix in enumerate(whole) for state in range(len(matrix))]
    matrix_index, state = np.array(places).T
    computed = vectors_of_values(diagonal, beside, values, matrix_index, state, Workspace())
    assert computed is not None
    for column, (i, k) in enumerate(places):
        energies, vectors = np.linalg.eigh(whole[i])
        n = len(energies)
        gap = np.abs(np.delete(energies, k) - energies[k]).min(initial=np.inf)
        allowed = (
            1e-14 + 30 * 2.2e-16 * n * np.abs(energies).max() / gap
        )  # round-off of either over the distance of states
        assert np.abs(np.abs(computed[:n, column]) - np.abs(vectors[:, k])).max() < allowed
        assert not computed[n:, column].any()


def test_states_that_are_too_near_are_left_to_others():
    beside = np.array([[1e-3, 0.0]])
    values = np.array([[1e6 - 1e-3, 1e6 + 1e-3]])
    only_row = np.array([0])
    assert vectors_of_values(np.full((1, 2), 1e6), beside, values, only_row, only_row, Workspace()) is None


def test_a_value_that_is_none_of_the_matrix_is_found_out():
    only_row = np.array([0])
    values = np.array([[-0.5, 1.0]])  # -1 would be right
    assert vectors_of_values(np.zeros((1, 2)), np.array([[1.0, 0.0]]), values, only_row, only_row, Workspace()) is None
