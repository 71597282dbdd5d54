"""J = 1000 for A = 1000, B = 500, C = 499.9 MHz: traces to round-off, a sample of levels in 50-digit arithmetic."""

from __future__ import annotations

import time

import mpmath
import numpy as np
import pytest

from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.solve import solve_levels
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

A, B, C, J = 1000.0, 500.0, 499.9, 1000
DIGITS = 50
X = J * (J + 1)
ULP = float(np.spacing(A * J**2))  # 1.2e-7 MHz, the spacing of doubles at the highest level
SAMPLE = (0, 1, 7, 60, 150, 250, 350, 450, 490, -2, -1)


@pytest.fixture(scope="module")
def levels() -> Levels:
    start = time.perf_counter()
    solved = solve_levels(Top(Constants(A=A, B=B, C=C)), J, jmin=J)
    print(f"J = {J}: {time.perf_counter() - start:.2f} s with vectors")
    return solved


def exact_matrix(block: SolvedBlock) -> tuple[list, list]:
    """Diagonal and squared off-diagonal of a Wang block in Ir, written out for the rigid top (Wang, Phys. Rev. 34 (1929) 243)."""
    a, b, c = (mpmath.mpf(value) for value in (A, B, C))
    mean, quarter = (b + c) / 2, (b - c) / 4
    k = [int(value) for value in block.basis.k]
    diagonal = [mean * (X - n * n) + a * n * n for n in k]
    squared = [quarter**2 * (X - n * (n + 1)) * (X - (n + 1) * (n + 2)) for n in k[:-1]]
    if k[0] == 0:
        squared[0] *= 2
    if k[0] == 1:
        diagonal[0] += block.basis.sign * quarter * X
    return diagonal, squared


def below(matrix: tuple[list, list], energy) -> int:
    """How many eigenvalues lie below an energy: negative pivots of H - E (Sylvester's law of inertia)."""
    diagonal, squared = matrix
    pivot, count = diagonal[0] - energy, 0
    count += pivot < 0
    for d, e in zip(diagonal[1:], squared, strict=True):
        pivot = d - energy - e / pivot
        count += pivot < 0
    return count


def eigenvalue(matrix: tuple[list, list], rank: int, guess: float):
    """Eigenvalue number `rank` by bisection around a guess, to 1e-12 MHz."""
    low, high = mpmath.mpf(guess) - 1, mpmath.mpf(guess) + 1
    assert below(matrix, low) <= rank < below(matrix, high)  # the guess is within 1 MHz of the level of that rank
    while high - low > mpmath.mpf("1e-12"):
        middle = (low + high) / 2
        low, high = (low, middle) if below(matrix, middle) > rank else (middle, high)
    return (low + high) / 2


@pytest.mark.parametrize("number", range(4))
def test_trace_of_every_block(levels, number):
    """The trace of a block in 50 digits is the sum of its levels to round-off."""
    block = levels.blocks[number]
    with mpmath.workdps(DIGITS):
        trace = mpmath.fsum(exact_matrix(block)[0])
        error = abs(mpmath.fsum(block.energies_mhz.tolist()) - trace)
    assert error < 4 * ULP * block.basis.size  # a few roundings a level
    assert error / trace < 2e-16  # they cancel: round-off of the sum itself


@pytest.mark.parametrize("number", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in (1, 2)), 3])
def test_levels_against_fifty_digits(levels, number):
    """Eleven levels of each block from bottom to top, doublets closer than round-off among them, within 4 spacings."""
    block = levels.blocks[number]
    with mpmath.workdps(DIGITS):
        matrix = exact_matrix(block)
        ranks = [rank % block.basis.size for rank in SAMPLE]
        errors = [float(abs(block.energies_mhz[r] - eigenvalue(matrix, r, block.energies_mhz[r]))) for r in ranks]
    print(f"{block.basis.species}: largest error {max(errors):.1e} MHz, spacing of doubles {ULP:.1e} MHz")
    assert max(errors) < 4 * ULP


def test_blocks_are_in_order_and_vectors_orthogonal(levels):
    assert sum(block.basis.size for block in levels.blocks) == 2 * J + 1
    for block in levels.blocks:
        assert (np.diff(block.energies_mhz) > 0).all()
        identity = block.vectors.T @ block.vectors
        assert np.abs(identity - np.eye(len(identity))).max() < 1e-13  # orthogonal to round-off
