"""Two lines of code that nothing else would miss: each test was seen to fail with its line taken away."""

from __future__ import annotations

import numpy as np
import pytest

import rotor
from rotor.quantum.solve import solve_levels

A, B, C, J = 500.01, 500.0, 499.99, 1000


def matrix_without_scalar(k: np.ndarray, sign: int) -> np.ndarray:
    """H - ½(B+C) J(J+1) of a Wang block in Ir, written out (Wang, Phys. Rev. 34 (1929) 243), MHz."""
    x, quarter = float(J * (J + 1)), (B - C) / 4
    diagonal = (A - (B + C) / 2) * k**2.0
    across = quarter * np.sqrt((x - k[:-1] * (k[:-1] + 1)) * (x - (k[:-1] + 1) * (k[:-1] + 2)))
    if k[0] == 0:
        across[0] *= np.sqrt(2.0)
    if k[0] == 1:
        diagonal[0] += sign * quarter * x
    return np.diag(diagonal) + np.diag(across, 1) + np.diag(across, -1)


def test_the_scalar_part_stays_out_of_the_matrix():
    """J² (B+C)/2 is 5e8 MHz, the rest of the matrix 1e4: diagonalised together, vectors would be good to 1e-7 MHz alone."""
    levels = solve_levels(rotor.Top.from_constants(f"A={A} B={B} C={C} MHz"), J, jmin=J)
    scalar = (B + C) / 2 * J * (J + 1)
    for block in levels.blocks:
        k = np.asarray(block.basis.k, dtype=float)
        matrix = matrix_without_scalar(k, block.basis.sign)
        quotients = np.einsum("ij,ij->j", block.vectors, matrix @ block.vectors)
        residual = np.linalg.norm(matrix @ block.vectors - block.vectors * quotients, axis=0).max()
        assert residual < 2e-9  # MHz; round-off of a matrix of norm 1e4 and 500 rows is 2e-12 x 500 at the worst
        # MHz; the last digit of 5e8
        np.testing.assert_allclose(block.energies_mhz - scalar, quotients, rtol=0, atol=1.3e-7)


@pytest.mark.parametrize(
    ("constants", "dipole", "weights", "column", "modulus", "present"),
    [
        ("A=5 B=2 GHz", (1.0, 0.0, 0.0), {"0": 1, "1": 0, "2": 0}, "k", 3, {0}),
        ("A=5 B=2 GHz", (1.0, 0.0, 0.0), {"0": 0, "1": 1, "2": 1}, "k", 3, {1, 2}),
        ("B=5 C=2 GHz", (0.0, 0.0, 1.0), {"0": 1, "1": 0}, "k", 2, {0}),
    ],
)
def test_levels_that_do_not_exist_make_no_lines_in_closed_form(constants, dipole, weights, column, modulus, present):
    top = rotor.Top.from_constants(constants, dipole_abc_debye=dipole, spin_weights=weights)
    lines = rotor.api.line_list(top, jmax=8, min_lgint=None, temperature_k=100.0)
    k = lines.levels.quanta[column][lines.lower]
    assert len(lines) > 8
    assert set((k % modulus).tolist()) == present
    assert (lines.levels.weight[lines.lower] > 0).all()
