"""A tensor on an artificial spin, one file beside the package: levels by QuTiP's matrices, strengths, derivatives, sizes."""

from __future__ import annotations

import numpy as np
import pytest
import qutip
from direct_product import on_spins, rotor_matrix, space_cosines, states_up_to
from toy_spin_tensor import SpinTensor

from rotor.quantum.effect import effect_sizes
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.solve import solve_levels
from rotor.quantum.wang.basis import REPRESENTATIONS
from rotor.spectra.lines import line_list
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

A, B, C = 9000.0, 5000.0, 3500.0
DIPOLE = (1.0, 0.7, 0.4)
TENSOR = ((-60.0, 25.0, -9.0), (25.0, 35.0, 14.0), (-9.0, 14.0, 25.0))


def top_in(representation: str = "Ir", **changed: float) -> Top:
    return Top(Constants(**{"A": A, "B": B, "C": C, **changed}, representation=representation), dipole_abc_debye=DIPOLE)


def full_matrix(twice_s: int, g: float, largest_n: int) -> np.ndarray:
    """The Hamiltonian over |N k m⟩|m_S⟩, N ≤ `largest_n`; the cosines multiply out with one N more."""
    wide = states_up_to(largest_n + 1)
    held = np.ix_(*[[i for i, state in enumerate(wide) if state[0] <= largest_n]] * 2)
    s, phi = twice_s / 2, space_cosines(largest_n + 1)
    spin = {p: qutip.jmat(s, p).full() for p in "xyz"}
    total = sum(
        x * on_spins(np.linalg.matrix_power(rotor_matrix(axis, largest_n), 2), (twice_s,), {})
        for x, axis in zip((A, B, C), "abc", strict=True)
    )
    for p in "xyz":
        for q in "xyz":
            both = (spin[p] @ spin[q] + spin[q] @ spin[p]) / (4 * s * (2 * s - 1))
            rotor = sum(TENSOR[i][k] * phi[p, "abc"[i]] @ phi[q, "abc"[k]] for i in range(3) for k in range(3))
            total = total + g * on_spins(rotor[held], (twice_s,), {1: both})
    return total


@pytest.mark.parametrize("representation", REPRESENTATIONS)
def test_levels_are_those_of_the_full_matrix(representation):
    """F ≤ 3 - S has all its N in the full matrix; S = 1, so that F = 0, 1, 2 are compared, each 2F + 1 times."""
    _compare(2, representation)


@pytest.mark.parametrize("twice_s", [3, 4])
def test_larger_spins(twice_s):
    _compare(twice_s, "Ir")


def _compare(twice_s: int, representation: str) -> None:
    largest_n, g = 4, 0.9
    slow = np.linalg.eigvalsh(full_matrix(twice_s, g, largest_n))
    levels = solve_levels(top_in(representation), 8, effects=(*SEMI_RIGID, SpinTensor(g, TENSOR, twice_s)))
    complete = (
        levels.quanta["f"] <= 2 * largest_n - twice_s if twice_s % 2 else levels.quanta["f"] <= largest_n - twice_s // 2
    )
    for energy, f in zip(levels.energy_mhz[complete], levels.quanta["f"][complete], strict=True):
        twice_f = int(f if twice_s % 2 else 2 * f)
        near = np.abs(slow - energy) <= 1e-14 * np.abs(slow).max() + 1e-9  # the round-off of both diagonalisations
        assert near.sum() == twice_f + 1
    assert levels.quanta_names == ("n", "ka", "kc", "f")
    assert complete.sum() > 10


def test_strengths_of_all_lines_from_a_level_add_up():
    """Σ_f S = (2F + 1) μ² for every level all of whose partners are in the list."""
    lines = line_list(top_in(), jmax=7, min_lgint=None, effects=(*SEMI_RIGID, SpinTensor(30.0, TENSOR, 2)))
    levels = lines.levels
    total = np.zeros(len(levels))
    np.add.at(total, lines.upper, lines.strength_debye2)
    np.add.at(total, lines.lower, lines.strength_debye2)
    inside = levels.quanta["n"] < 4  # χ of 1 GHz mixes in higher N, whose partners have N one more
    expected = levels.multiplicity * sum(mu * mu for mu in DIPOLE)
    assert total[inside] == pytest.approx(expected[inside], rel=1e-5)  # the share of N = 7, which has no partner above
    assert np.abs(total[levels.quanta["n"] < 3] / expected[levels.quanta["n"] < 3] - 1).max() < 1e-8  # less of it


def test_derivatives_are_differences_of_energies():
    step = 1e-4
    low, mid, high = (
        solve_levels(top_in(), 5, effects=(*SEMI_RIGID, SpinTensor(1.0 + s, TENSOR, 2))) for s in (-step, 0.0, step)
    )
    derivative = level_derivatives(top_in(), mid, ["g_spin", "A"])
    slope = (high.energy_mhz - low.energy_mhz) / (2 * step)
    assert derivative[:, 0] == pytest.approx(slope, abs=1e-4)  # round-off of 1e-10 MHz over the step, and its square
    bigger = solve_levels(top_in(A=A + 1e-3), 5, effects=(*SEMI_RIGID, SpinTensor(1.0, TENSOR, 2)))
    assert derivative[:, 1] == pytest.approx((bigger.energy_mhz - mid.energy_mhz) / 1e-3, abs=2e-3)  # second order


def test_sizes_and_names():
    effect = SpinTensor(0.01, TENSOR, 2)
    assert effect_sizes(top_in(), 10, [*SEMI_RIGID, effect])[-1].name == "tensor on an artificial spin"
    plain = solve_levels(top_in(), 4)
    split = solve_levels(top_in(), 4, effects=(*SEMI_RIGID, effect))
    rows = plain.rows_of(j=split.quanta["n"], ka=split.quanta["ka"], kc=split.quanta["kc"])
    shift = np.abs(split.energy_mhz - plain.energy_mhz[rows]).max()
    assert 1 / 3 < shift / effect.size_mhz(top_in(), 4) <= 1.0  # the size is right within 3
