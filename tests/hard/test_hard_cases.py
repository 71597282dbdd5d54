"""Cases 30 to 38 of docs/hard_cases.md: limits that audits of the package added."""

from __future__ import annotations

import math

import numpy as np
import pytest
from slow_matrix import watson_matrix

from rotor.alignment.pulse import DipolePulse
from rotor.alignment.request import AlignRequest, answer_align
from rotor.classical.tumble import TumbleRequest, answer_tumble
from rotor.molecules.molecule import Molecule
from rotor.quantum.effects.stark import stark_map
from rotor.quantum.solve import solve_levels
from rotor.requests.budget import ROUNDING
from rotor.thermodynamics.functions import thermodynamic_functions
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top
from rotor.units import MHZ_PER_K

SEPARATRIX = ((1.0, 2.0, 3.0), (1.0, 0.3, math.sqrt(3.0) * (1 + 1e-13)))


def test_flips_near_the_separatrix_are_not_claimed_after_1e10_periods():
    """Case 30: 8e10 periods. The rotation about L is right, and the phase of the flips is said to be unknown."""
    answer = answer_tumble(TumbleRequest(*SEPARATRIX, times=(0.0, 1e13)))
    assert 1e13 / float(answer.motion.period) > 8e10
    assert answer.errors.numerical < 1e-14
    assert "the phase of the flips is not known" in answer.errors.data.source


@pytest.mark.parametrize("bend", [1e-9, 1e-7])
def test_a_molecule_bent_by_a_nanoradian_is_linear(bend):
    """Case 31: OCS whose angle is off by 1e-9 rad has the levels of the straight one, and no A of 1e21 MHz."""
    x, y = 1.56 * math.cos(bend), 1.56 * math.sin(bend)
    bent, straight = (
        Top.from_molecule(Molecule(("O", "C", "S"), [[-1.16, 0, 0], [0, 0, 0], [*place, 0]]))
        for place in ((x, y), (1.56, 0))
    )
    assert bent.kind == "linear"
    energies = [solve_levels(top, 20).energy_mhz for top in (bent, straight)]
    assert energies[0] == pytest.approx(energies[1], rel=1e-12)  # of the square of the bend


@pytest.mark.parametrize("part", [1e-10, 1e-12])
def test_a_and_b_within_1e_10_of_each_other(part):
    """Case 32: doublets of K = 1 are split by (A - B)/2 J(J+1), here 1e-6 MHz beside 1e6 MHz, or less than rounding."""
    b, c, j = 5000.0, 3000.0, 20
    top = Top(Constants(A=b * (1 + part), B=b, C=c, representation="IIIr", reduction="A"))
    round_top = Top.from_constants(f"B={b} C={c} MHz")
    levels, limit = solve_levels(top, j, jmin=j), solve_levels(round_top, j, jmin=j)
    energies = np.sort(np.repeat(limit.energy_mhz, np.where(limit.quanta["k"] == 0, 1, 2)))
    shift = 0.5 * b * part * j * (j + 1)  # the mean of A and B
    rounding = ROUNDING * energies.max()
    sorted_energies = np.sort(levels.energy_mhz)
    assert np.abs(sorted_energies - energies).max() <= 2 * shift + rounding
    place = np.flatnonzero(energies == limit.energy_mhz[limit.quanta["k"] == 1])
    assert np.diff(sorted_energies[place]) == pytest.approx(
        shift, rel=1e-2
    )  # |K| = 1 of an oblate top; rounding of 1e-6 MHz


def test_j_of_300_sums_to_its_trace():
    """Case 33: Σ E = (A + B + C) J(J+1)(2J+1)/3, all 601 energies of a heavy top within their stated rounding."""
    a, b, c, j = 3000.1, 1000.3, 900.7, 300
    energies = solve_levels(Top.from_constants(f"A={a} B={b} C={c} MHz"), j, jmin=j, vectors=False).energy_mhz
    assert len(energies) == 2 * j + 1
    total = (a + b + c) * j * (j + 1) * (2 * j + 1) / 3
    assert abs(math.fsum(energies.tolist()) - total) <= (2 * j + 1) * ROUNDING * energies.max()
    assert np.all(np.diff(np.sort(energies)) >= 0)


def test_a_millikelvin_is_two_levels():
    """Case 34: Q, U and C_v of 1 mK by the lowest two levels, without overflow where the second has exp(-5532)."""
    top = Top.from_constants("B=57635.968 MHz")
    functions = thermodynamic_functions(top, [1e-3, 0.2])
    x = 2 * 57635.968 / (MHZ_PER_K * functions.temperature_k)
    first = 3 * np.exp(-x)
    assert functions.q_rot == pytest.approx(1 + first, rel=1e-12)
    assert functions.cv_over_r == pytest.approx(x**2 * first / (1 + first) ** 2, rel=1e-9)  # the third level
    assert functions.cv_over_r[0] == 0.0


@pytest.mark.parametrize("least", [1e-12, 1e-6])
def test_moments_over_twelve_orders_of_magnitude(least):
    """Case 35: a needle that spins about its axis: a symmetric top in closed form, ten turns of the axis and 1e13 spins."""
    answer = answer_tumble(TumbleRequest((least, 1.0, 1.0), (0.5, 1.0, 0.0), times=(0.0, 1.0, 10.0)))
    momentum = answer.table.momentum
    assert np.linalg.norm(momentum, axis=1) == pytest.approx(math.hypot(0.5, 1.0), rel=1e-15)
    assert momentum[:, 0] == pytest.approx(0.5, rel=1e-15)
    assert np.isfinite(answer.table.attitude).all()
    spin = 0.5 * (1 / least - 1) * answer.table.times  # exact but for the last digits of 1/I
    known = answer.errors.rounding.value + 8 * np.finfo(float).eps * np.abs(spin)
    cosine = momentum[:, 1]
    assert (np.abs(cosine - np.cos(spin)) <= known + 1e-15).all()


def test_three_bands_of_the_s_reduction():
    """Case 36: d1, d2 and h3 connect K with K + 2, K + 4 and K + 6; against the whole matrix of 2J + 1 functions."""
    values = {"A": 9000.0, "B": 5000.0, "C": 3500.0, "DJ": 0.01, "DJK": 0.02, "DK": 0.03, "d1": -0.004, "d2": -0.003,
              "h1": 2e-6, "h2": 3e-6, "h3": 4e-6}  # fmt: skip
    for j in (3, 12):
        levels = solve_levels(Top(Constants(**values, reduction="S")), j, jmin=j)
        whole = np.linalg.eigvalsh(watson_matrix(values, "S", "Ir", j))
        assert np.sort(levels.energy_mhz) == pytest.approx(whole, abs=1e-12 * whole.max())


def test_a_pulse_of_half_a_cycle_kicks():
    """Case 37: a field of half a cycle that is much shorter than the rotation is a kick of the dipole by μ∫E dt/ħ.

    To first order in the kick P, <cosθ>(t) = 2P/3 sin(2π 2B t) of J = 0.
    """
    top = Top.from_constants("B=6000 MHz", dipole_abc_debye=(0.7, 0, 0))
    width, peak = 0.02, 5.0  # ps, kV/cm
    pulse = DipolePulse(peak, width, 0.0)
    trace = answer_align(
        AlignRequest(top, (pulse,), 0.0, observables=("costheta",), until_ps=80.0, points=801, tolerance=1e-8)
    ).trace
    area = peak * width * math.sqrt(math.pi / (4 * math.log(2)))  # of a Gaussian
    kick = 2 * math.pi * 0.7 * 503.4117 * area * 1e-6  # 0.7 D × 503.4117 MHz/(D kV/cm), rad/(ps MHz) is 2π 1e-6
    expected = 2 * kick / 3 * np.sin(2 * math.pi * 2 * 6000e-6 * trace.t_ps)
    late = trace.t_ps > 1
    assert trace.cosines["costheta"][late] == pytest.approx(expected[late], abs=0.02 * kick)


def test_a_crossing_narrower_than_the_grid():
    """Case 38: at 49.7 kV/cm two states avoid each other by 0.9 MHz within 5 V/cm, a thousandth of the distance of the fields.

    Energies and labels at the fields of the coarse map are those of a map with fields inside the crossing.
    """
    top = Top.from_constants("A=5655.2654 B=1546.875864 C=1214.40399 MHz", dipole_abc_debye=(4.5152, 0.0002, 0))
    common = {"j_highest": 2, "m_values": (1,), "tolerance_mhz": 1e-3}
    apart = np.linspace(0, 100, 21)
    fields = np.unique(np.concatenate([apart, np.linspace(49.6, 49.8, 41)]))
    coarse, fine = stark_map(top, apart, **common), stark_map(top, fields, **common)
    shared = np.searchsorted(fields, apart)
    for wide, narrow in zip(coarse.curves(), fine.curves(), strict=True):
        assert str(coarse.label[wide.start]) == str(fine.label[narrow.start])
        error = (
            coarse.truncation_mhz[wide]
            + coarse.round_off_mhz[wide]
            + (fine.truncation_mhz + fine.round_off_mhz)[narrow][shared]
        )
        assert (np.abs(coarse.energy_mhz[wide] - fine.energy_mhz[narrow][shared]) <= error).all()
    gaps = np.diff(np.sort([fine.energy_mhz[rows] for rows in fine.curves()], axis=0), axis=0).min(axis=0)
    inside = (fields > 49.6) & (fields < 49.8)
    assert gaps[inside].min() < 1.0
    assert gaps[shared[9:12]].min() > 20.0  # the coarse map sees nothing of it
