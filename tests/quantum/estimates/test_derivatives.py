"""Derivatives of levels: numerical differences, sum rules, closed forms; uncertainties of lines."""

from __future__ import annotations

import time

import numpy as np
import pytest

from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.effects.watson import operators_by_name
from rotor.quantum.estimates.derivatives import expectations, level_derivatives
from rotor.quantum.solve import solve_levels
from rotor.tops.constants.constants import Constants
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.top import Top

A_SET = Constants(
    A=9000.0, B=5000.0, C=3000.0, reduction="A",
    DeltaJ=0.1, DeltaJK=-0.3, DeltaK=2.0, deltaJ=0.02, deltaK=0.5, PhiK=1e-3, phiJ=3e-6, phiJK=-2e-5, phiK=4e-4, lK=1e-7,
)  # fmt: skip
S_SET = Constants(
    A=9000.0, B=5000.0, C=3000.0, DJ=0.1, DJK=-0.3, DK=2.0, d1=-0.02, d2=-0.013, HK=1e-3, h1=3e-6, h2=-2e-6, h3=4e-6,
    l4=1e-9, terms={(1, 0, 4): 1e-11, (0, 1, 2): -1e-6, (0, 0, 5): 2e-12},
)  # fmt: skip
CLOSED = [
    Constants(B=6000.0, D=1e-3, H=1e-9, terms={(5, 0, 0): 1e-14}),
    Constants(A=9000.0, B=5000.0, DJ=0.1, DJK=0.3, DK=0.2, HKJ=1e-6),
    Constants(B=9000.0, C=5000.0, DJ=0.1, DJK=0.3, DK=0.2, HK=1e-6),
    Constants(B=9000.0, D=0.1, kind="spherical"),
    Constants(B=9000.0, D=0.1, Dt=2e-3, kind="spherical"),
    Constants(B=9000.0, D=0.1, Dt=-2e-3, kind="spherical"),
]


def differences(constants: Constants, name: str, jmax: int) -> np.ndarray:
    """(E(c + h) - E(c - h)) / 2h; E is a smooth function of each constant, so the error goes as h²."""
    step = 1e-4 * abs(constants[name])
    up, down = (solve_levels(Top(constants.replace(**{name: constants[name] + s})), jmax) for s in (step, -step))
    return (up.energy_mhz - down.energy_mhz) / (2 * step)


@pytest.mark.parametrize("representation", ["Ir", "Il", "IIr", "IIl", "IIIr", "IIIl"])
@pytest.mark.parametrize("constants", [A_SET, S_SET])
def test_derivatives_are_differences(constants, representation):
    constants = constants.replace(representation=representation)
    top, jmax = Top(constants), 12
    ours = level_derivatives(top, solve_levels(top, jmax))
    for column, name in enumerate(constants.values):
        slow = differences(constants, name, jmax)
        scale = np.abs(slow).max()
        assert scale * abs(constants[name]) > 0.05  # MHz, far above what is let through
        assert np.allclose(ours[:, column], slow, rtol=0, atol=2e-6 * scale + 1e-5 / abs(constants[name])), name
        # h² of 1e-8 times near-degenerate curvatures; round-off of 1e-9 MHz over the step of 1e-4 c


@pytest.mark.parametrize("constants", CLOSED)
def test_derivatives_of_closed_forms(constants):
    top = Top(constants)
    ours = level_derivatives(top, solve_levels(top, 7))
    for column, name in enumerate(constants.values):
        slow = differences(constants, name, 7)
        assert np.allclose(ours[:, column], slow, rtol=1e-9, atol=2e-6 / abs(constants[name])), name  # linear in c


@pytest.mark.parametrize("constants", [A_SET, S_SET, *CLOSED])
def test_energy_is_the_sum_of_constants_times_derivatives(constants):
    """H is linear in its constants, so E = Σ c ∂E/∂c (Euler), to round-off."""
    top = Top(constants)
    levels = solve_levels(top, 20)
    total = level_derivatives(top, levels) @ np.array(list(constants.values.values()))
    assert np.allclose(total, levels.energy_mhz, rtol=1e-13, atol=1e-7)  # round-off of 4e6 MHz


def test_derivatives_of_a_block_add_up_to_the_trace():
    """Σ_i ∂E_i/∂c over one J is the trace of ∂H/∂c: X/3 (2J+1) for A, B, C; zero for every off-diagonal term."""
    top = Top(A_SET)
    levels = solve_levels(top, 30, jmin=30)
    sums = dict(zip(A_SET.values, level_derivatives(top, levels).sum(axis=0), strict=True))
    x, states = 30 * 31.0, 61
    for name in "ABC":
        assert sums[name] == pytest.approx(states * x / 3, rel=1e-13)
    assert sums["DeltaJ"] == pytest.approx(-states * x**2, rel=1e-13)
    assert sums["DeltaK"] == pytest.approx(-2 * sum(k**4 for k in range(31)), rel=1e-13)
    for name in ("deltaJ", "deltaK", "phiJ", "phiJK", "phiK", "lK"):
        largest = max(
            abs(expectations(levels, [{powers: 1.0} for powers in operators_by_name(A_SET)[name]], np.arange(61))[:, 0])
        )
        assert abs(sums[name]) < 1e-12 * largest * states


def test_rows_and_names_choose():
    top = Top(A_SET)
    levels = solve_levels(top, 10)
    everything = level_derivatives(top, levels)
    rows = np.array([77, 3, 0, 50, 3])
    chosen = level_derivatives(top, levels, ["phiK", "A"], rows)
    column = list(A_SET.values).index
    assert np.allclose(chosen, everything[rows][:, [column("phiK"), column("A")]], rtol=1e-14, atol=0)
    assert level_derivatives(top, levels, [], rows).shape == (5, 0)
    assert level_derivatives(top, levels, None, rows[:0]).shape == (0, len(A_SET.values))


def test_what_cannot_be_derived_is_said():
    top = Top(A_SET)
    with pytest.raises(ValueError, match="no parameter DJ here"):
        level_derivatives(top, solve_levels(top, 2), ["DJ"])
    with pytest.raises(ValueError, match="without vectors"):
        level_derivatives(top, solve_levels(top, 2, vectors=False))


def test_pieces_give_the_same(monkeypatch):
    from rotor.quantum.blocks import linear_stacks

    top = Top(S_SET)
    levels = solve_levels(top, 15)
    whole = level_derivatives(top, levels)
    monkeypatch.setattr(linear_stacks, "_AT_ONCE", 100)
    assert np.allclose(level_derivatives(top, levels), whole, rtol=1e-13, atol=1e-9)  # other summation order


def test_a_fit_can_afford_it():
    """1000 levels of 500 lines by 15 constants, J ≤ 60: 4 ms on the machine of the benchmarks; here with a wide margin."""
    top = Top(A_SET)
    levels = solve_levels(top, 60)
    rows = np.random.default_rng(1).choice(len(levels), 1000, replace=False)
    level_derivatives(top, levels, None, rows)
    start = time.perf_counter()
    level_derivatives(top, levels, None, rows)
    assert time.perf_counter() - start < 0.2


@pytest.mark.parametrize(
    ("constants", "spins"),
    [
        ("A=30000 B=9200 C=9200 DJ=0.004 DJK=0.2 MHz", "chi_aa(14N)=-4.2 C_aa(14N)=0.01 MHz"),
        ("A=9000 B=9000 C=5000 MHz", "chi_cc(14N)=-4.2 MHz"),
    ],
)
def test_energies_of_an_axial_top_with_spins_are_sums_of_constants_times_derivatives(constants, spins):
    """Levels up to a J max: of the blocks of the highest F some states alone."""
    top = Top.from_constants(constants, spin_constants=SpinConstants.parse(spins))
    levels = solve_levels(top, 6, effects=effects_of(top, True))
    assert len({block.vectors.shape[1] - len(block.vectors) for block in levels.blocks}) > 1
    values = [value for effect in levels.effects for value in effect.parameters(top).values()]
    assert np.allclose(level_derivatives(top, levels) @ values, levels.energy_mhz, rtol=1e-12, atol=1e-7)
