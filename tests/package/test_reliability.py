"""Warnings: the ratio of orders in closed form and against matrices, and sentences where they are due."""

from __future__ import annotations

import numpy as np
import pytest

from rotor.quantum.estimates.convergence import RATIO_LIMIT, order_sizes_mhz, series_ratio, warnings_of
from rotor.quantum.solve import solve_levels
from rotor.quantum.wang.rotation import hamiltonian
from rotor.spectra.lines import line_list
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

WATER_QUARTIC = Constants(
    A=835840.288, B=435351.717, C=278138.7, DeltaJ=37.59422, DeltaJK=-172.91276, DeltaK=973.29052, deltaJ=15.210402,
    deltaK=41.05025, reduction="A",
)  # fmt: skip


def test_linear_and_symmetric_tops_in_closed_form():
    linear = Top.from_constants("B=6000 D=0.01 H=1e-7 MHz")
    assert order_sizes_mhz(linear, 99) == pytest.approx({2: 6000 * 9900, 4: 0.01 * 9900**2, 6: 1e-7 * 9900**3})
    assert series_ratio(linear, 99) == pytest.approx(0.0990, rel=1e-9)  # H X/D before D X/B
    symmetric = Top.from_constants("A=9000 B=5000 DJ=0.1 DK=0.3 MHz")
    assert series_ratio(symmetric, 10, kmax=0) == pytest.approx(0.1 * 110 / 5000)
    assert series_ratio(symmetric, 10) == pytest.approx((0.1 * 110**2 + 0.3 * 1e4) / (5000 * 110 + 4000 * 100))


def test_rows_bound_the_eigenvalues_of_each_order():
    """Gershgorin: no eigenvalue of an order's own matrix is larger than the bound, nor far below it."""
    from slow_matrix import term_matrix

    top, j = Top(WATER_QUARTIC), 12
    for order, size in order_sizes_mhz(top, j).items():
        terms = {powers: c for powers, c in hamiltonian(top).items() if 2 * sum(powers) == order}
        matrix = sum(c * term_matrix(*powers, j) for powers, c in terms.items())
        norm = np.abs(np.linalg.eigvalsh(matrix)).max()
        row_sums = np.abs(matrix).sum(axis=1).max()
        assert size == pytest.approx(row_sums, rel=1e-12)
        assert norm <= size * (1 + 1e-12)
        assert norm > size / 3


def test_quartic_water_is_told_of():
    top = Top(WATER_QUARTIC, (0, 1.85, 0))
    sentences = warnings_of(top, solve_levels(top, 20))
    assert len(sentences) == 2
    assert "J = 20" in sentences[0]
    first = int(sentences[0].split("above J = ")[1].split()[0]) + 1
    assert series_ratio(top, first) > RATIO_LIMIT >= series_ratio(top, first - 1)
    assert "from J = 18 on" in sentences[1]  # where disordered_blocks begins
    assert warnings_of(top, solve_levels(top, 8)) == ()


def test_a_sextic_that_outgrows_the_quartic_is_told_of():
    top = Top.from_constants("B=6000 D=0.001 H=1e-6 MHz")
    (sentence,) = warnings_of(top, solve_levels(top, 30))
    assert "order J^6" in sentence
    assert "above J = 16 " in sentence  # H X / D = 0.3 at X = 300, J = 16.8


def test_rigid_and_light_tops_are_silent():
    for text in ("A=9 B=5 C=3 GHz", "B=6 GHz", "A=9 B=5 GHz"):
        top = Top.from_constants(text)
        assert series_ratio(top, 50) == 0.0
        assert warnings_of(top, solve_levels(top, 50)) == ()


def test_tensor_of_a_spherical_top_counts_as_quartic():
    methane = Top(Constants(kind="spherical", B=157127.0, D=3.3236, Dt=0.13294))
    sizes = order_sizes_mhz(methane, 10)
    assert sizes[2] == pytest.approx(157127.0 * 110, rel=1e-5)
    assert 3.3236 * 110**2 / 2 < sizes[4] < 3.3236 * 110**2 * 2


def test_lines_carry_warnings_into_provenance():
    top = Top(WATER_QUARTIC.replace(uncertainties={"A": 0.1}), (0, 1.85, 0))
    lines = line_list(top, jmax=20, q=100.0)
    assert len(lines.warnings) == 3
    assert "take B, C, DeltaJ" in lines.warnings[2]
    assert lines.provenance["warnings"] == list(lines.warnings)
    assert line_list(Top(Constants(B=6000.0), (1, 0, 0)), jmax=5).warnings == ()
