"""Thermal ensembles and correlation functions of a free gas: closed forms, plain forms, streaming."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy import integrate, stats
from scipy.special import hyp1f1

from rotor.classical.euler import momentum_rate
from rotor.classical.free.free_motion import free_motion
from rotor.classical.gas.correlations import linear_curves, plateau, short_time, spherical_curves, symmetric_curves
from rotor.classical.gas.ensembles import (
    PIECE,
    free_gas_correlations,
    stepped_gas_correlations,
    thermal_ensemble,
    thermal_momenta,
)
from rotor.geometry.rotations import rotate, to_matrix

KT = 1.3
TOPS = {
    "linear": (0.0, 2.0, 2.0), "spherical": (2.0, 2.0, 2.0), "prolate": (0.3, 2.0, 2.0), "oblate": (2.0, 2.0, 3.5),
    "asymmetric": (0.6, 1.3, 1.9), "atom": (0.0, 0.0, 0.0),
}  # fmt: skip
TIMES = np.linspace(0.0, 8.0, 33)


def rng(seed: int = 3) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize("kind", TOPS)
def test_momenta_are_normal_with_the_right_variance(kind):
    momenta = thermal_momenta(TOPS[kind], KT, 100_000, rng=rng())
    assert momenta.var(axis=0) == pytest.approx(np.array(TOPS[kind]) * KT, rel=0.02)  # 4 √(2/100,000) = 0.018
    for moment, column in zip(TOPS[kind], momenta.T, strict=True):
        if moment == 0.0:
            assert not column.any()
        else:
            assert stats.kstest(column, stats.norm(0, math.sqrt(moment * KT)).cdf).pvalue > 1e-3  # a fixed seed
    pairs = np.corrcoef(momenta.T[np.array(TOPS[kind]) > 0]) if kind != "atom" else np.eye(1)
    assert np.abs(np.atleast_2d(pairs) - np.eye(len(np.atleast_2d(pairs)))).max() < 0.03  # 4/√100,000 and more


def test_orientations_are_uniform_and_velocities_thermal():
    gas = thermal_ensemble(TOPS["asymmetric"], KT, 20_000, rng=rng(), mass=18.0)
    for axis in np.eye(3):
        seen = rotate(gas.attitude, axis)
        assert all(stats.kstest(seen[:, k], stats.uniform(-1, 2).cdf).pvalue > 1e-3 for k in range(3))  # Archimedes
    angle = 2 * np.arccos(np.abs(gas.attitude[:, 0]))
    assert stats.kstest(angle, lambda x: (x - np.sin(x)) / math.pi).pvalue > 1e-3  # the measure of SO(3)
    assert gas.velocity.var() == pytest.approx(KT / 18.0, rel=0.03)  # 5 √(2/60,000)


def test_a_moved_gas_keeps_its_energy_and_an_atom_its_place():
    gas = thermal_ensemble(TOPS["asymmetric"], KT, 100, rng=rng(), mass=1.0)
    later = gas.moved(1e3)
    before, after = (sum(g.kinetic.energies[f"rotation {x}"] for x in "abc") for g in (gas, later))
    assert np.allclose(after, before, rtol=1e-13)  # round-off of three squares
    assert not np.allclose(later.kinetic.energies["rotation b"], gas.kinetic.energies["rotation b"], rtol=0.1)
    atom = thermal_ensemble(TOPS["atom"], KT, 10, rng=rng(), mass=1.0)
    assert atom.moved(5.0) is atom
    assert list(atom.kinetic.energies) == ["translation x", "translation y", "translation z"]


def test_the_compiled_sums_are_the_plain_ones():
    e, beta = np.array([0.6, 0.0, 0.8]), np.array([[1.0, 0.2, 0.1], [0.2, -0.4, 0.3], [0.1, 0.3, 2.0]])
    inertia, source = np.array(TOPS["asymmetric"]), rng(9).spawn(1)[0]
    gas = free_gas_correlations(inertia, KT, TIMES, vector=5 * e, tensor=beta, molecules=500, rng=rng(9))
    part = beta - np.trace(beta) / 3 * np.eye(3)
    r = to_matrix(free_motion(inertia, thermal_momenta(inertia, KT, 500, rng=source)).at(TIMES)[1])
    first = np.einsum("i,ntij,j->nt", e, r, e)
    second = np.einsum("ij,ntik,kl,ntjl->nt", part, r, part, r) / np.sum(part**2)
    assert np.abs(gas.c1 - first.mean(axis=0)).max() < 1e-14  # two orders of summation
    assert np.abs(gas.c2 - second.mean(axis=0)).max() < 1e-14
    assert gas.c1_error == pytest.approx(stats.sem(first, axis=0), rel=1e-6, abs=1e-9)
    assert gas.c2_error == pytest.approx(stats.sem(second, axis=0), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(
    ("kind", "vector", "curves"),
    [
        ("linear", (1, 0, 0), lambda t: linear_curves(t, 2.0, KT)),
        ("spherical", (1, 0.4, 0.1), lambda t: spherical_curves(t, 2.0, KT)),
        ("oblate", (0, 0, 1), lambda t: symmetric_curves(t, 2.0, 3.5, KT)),
        ("prolate", (1, 0, 0), lambda t: symmetric_curves(t, 2.0, 0.3, KT)),
    ],
)
def test_whole_curves_of_simple_tops(kind, vector, curves):
    tensor = np.outer(vector, vector)
    gas = free_gas_correlations(TOPS[kind], KT, TIMES, vector=vector, tensor=tensor, molecules=30_000, rng=rng())
    for measured, error, closed in zip((gas.c1, gas.c2), (gas.c1_error, gas.c2_error), curves(TIMES), strict=True):
        assert measured[0] == pytest.approx(1.0, abs=1e-12)  # nothing has moved yet
        assert np.abs((measured - closed)[1:] / error[1:]).max() < 4  # σ, at 32 correlated times of a fixed seed
        assert error[-1] < 4.5 / math.sqrt(30_000)


def test_the_closed_curves_by_quadrature():
    """Kummer's function, and the mean over speeds done numerically."""
    tau = np.linspace(0, 6, 13)
    c1, c2 = linear_curves(tau * math.sqrt(2.0 / KT), 2.0, KT)
    assert np.allclose(c1, hyp1f1(1, 0.5, -(tau**2) / 2), atol=1e-12)  # two special functions
    for i in (1, 5, 9):
        flat = integrate.quad(lambda w, t=tau[i]: w * math.exp(-w * w / 2) * math.cos(2 * w * t), 0, 12, limit=500)[0]
        assert c2[i] == pytest.approx(0.25 + 0.75 * flat, abs=1e-9)  # quad's own tolerance is 1.5e-8 of the integrand
        round_ = integrate.quad(
            lambda w, t=tau[i]: math.sqrt(2 / math.pi) * w * w * math.exp(-w * w / 2) * math.cos(w * t),
            0,
            12,
            limit=500,
        )[0]
        ball = spherical_curves(tau[i] * math.sqrt(2.0 / KT), 2.0, KT)[0]
        assert ball == pytest.approx(1 / 3 + 2 / 3 * round_, abs=1e-9)
    near = symmetric_curves(tau, 2.0, 2.0, KT)
    assert np.allclose(near, spherical_curves(tau, 2.0, KT), atol=1e-12)  # the same body by another road


@pytest.mark.parametrize("kind", ["linear", "spherical", "prolate", "oblate", "asymmetric"])
def test_beginnings_from_euler_s_equations(kind):
    """M2 = <|u̇|²>, M4 = <|ü|²>, N2 = <β̇:β̇> by drawing L and differentiating, no formula shared."""
    inertia, e = np.array(TOPS[kind]), np.array([0.6, 0.0, 0.8]) if kind != "linear" else np.array([1.0, 0.0, 0.0])
    beta = np.diag([1.0, 0.3, -0.5]) if kind != "linear" else np.outer(e, e) - np.eye(3) / 3
    beta = beta - np.trace(beta) / 3 * np.eye(3)
    closed = short_time(inertia, KT, e, beta)
    momenta = thermal_momenta(inertia, KT, 200_000, rng=rng(8))
    safe = np.where(inertia > 0, inertia, np.inf)
    omega, alpha = momenta / safe, momentum_rate(momenta, inertia) / safe
    first = np.cross(omega, e)
    second = np.cross(alpha, e) + np.cross(omega, first)
    rates = np.einsum("nij,jk->nik", _cross_matrix(omega), beta)
    rates = rates + np.swapaxes(rates, 1, 2)
    for value, sample in (
        (closed.m2, np.sum(first**2, axis=1)),
        (closed.m4, np.sum(second**2, axis=1)),
        (closed.n2, np.sum(rates**2, axis=(1, 2)) / np.sum(beta**2)),
    ):
        assert abs(value - sample.mean()) < 4 * stats.sem(sample)  # of a fixed seed


def _cross_matrix(omega):
    x, y, z = omega.T
    zero = np.zeros_like(x)
    return np.stack([np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1), np.stack([-y, x, zero], -1)], axis=1)


def test_the_curves_begin_as_they_should():
    small = np.array([0.0, 0.01, 0.02])
    for curves, inertia in (
        (linear_curves(small, 2.0, KT), TOPS["linear"]), (symmetric_curves(small, 2.0, 0.3, KT), TOPS["prolate"]),
    ):  # fmt: skip
        start = short_time(inertia, KT, (1, 0, 0))
        assert curves[0] == pytest.approx(1 - start.m2 * small**2 / 2 + start.m4 * small**4 / 24, abs=1e-10)  # t⁶ term
        assert curves[1][1] == pytest.approx(1 - start.n2 * small[1] ** 2 / 2, abs=3e-7)  # t⁴ term, some 30 t⁴


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_what_an_asymmetric_gas_never_forgets(axis):
    unit = np.eye(3)[axis]
    closed = plateau(TOPS["asymmetric"], unit)
    late = np.geomspace(1e3, 1e6, 5)
    gas = free_gas_correlations(TOPS["asymmetric"], KT, late, vector=unit, molecules=20_000, rng=rng())
    assert np.abs((gas.c1 - closed) / gas.c1_error).max() < 4  # σ
    assert (closed == 0.0) == (axis == 1)


def test_plateaus_in_the_limits():
    for kind, unit in (("oblate", (0, 0, 1)), ("prolate", (1, 0, 0))):
        first, third = sorted(set(TOPS[kind]), key=TOPS[kind].count, reverse=True)
        curve = symmetric_curves([1e4], first, third, KT)[0][0]
        assert plateau(TOPS[kind], unit) == pytest.approx(curve, abs=1e-8)  # quadratures of 96 points
        across = np.roll(unit, 1)
        assert plateau(TOPS[kind], across) == pytest.approx(0.0, abs=1e-12)
    assert plateau((1.9, 0.6, 1.3), (1, 0, 0)) == pytest.approx(plateau(TOPS["asymmetric"], (0, 0, 1)), rel=1e-14)
    nearly = plateau((1.0, 1.0 + 1e-9, 1.0 + 2e-9), (0, 0, 1)) + plateau((1.0, 1.0 + 1e-9, 1.0 + 2e-9), (1, 0, 0))
    assert 0.3 < nearly < 0.6  # finite: a nearly spherical top after a time that tumbles it


def test_a_stepper_meets_the_exact_motion_with_an_error_of_step_squared():
    args = {"vector": (0, 1, 0), "tensor": np.diag([1.0, 0.3, -0.5]), "molecules": 1000}
    exact = free_gas_correlations(TOPS["asymmetric"], KT, 0.1 * np.arange(50), rng=rng(), **args)
    errors = []
    for steps in (4, 8, 16):
        stepped = stepped_gas_correlations(TOPS["asymmetric"], KT, 0.1, 50, steps=steps, rng=rng(), **args)
        errors.append([np.abs(stepped.c1 - exact.c1).max(), np.abs(stepped.c2 - exact.c2).max()])
    orders = -np.diff(np.log2(errors), axis=0)
    assert np.all(np.abs(orders - 2.0) < 0.15)  # the next term of the error, of order 4
    assert stepped.c1_error == pytest.approx(exact.c1_error, rel=1e-2, abs=1e-4)  # the error of 16 steps


def test_streaming_does_not_depend_on_threads_and_says_how_far_it_is():
    args = {"vector": (1, 0, 0), "molecules": PIECE + 500}
    seen: list[int] = []
    alone = free_gas_correlations(TOPS["prolate"], KT, TIMES[:5], rng=rng(), progress=seen.append, **args)
    with ThreadPoolExecutor(2) as pool:
        together = free_gas_correlations(TOPS["prolate"], KT, TIMES[:5], rng=rng(), executor=pool, **args)
    assert np.array_equal(alone.c1, together.c1)
    assert seen == [PIECE, 500]
    assert list(alone.columns) == ["t", "c1", "c1_error"]
    assert alone.c2 is None
    assert len(alone) == 5


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({}, "a vector or a tensor"),
        ({"vector": (0, 0, 0)}, "not all 0"),
        ({"tensor": np.eye(3)}, "isotropic"),
        ({"tensor": np.arange(9).reshape(3, 3)}, "symmetric"),
        ({"vector": (1, 0, 0), "molecules": 1}, "two or more"),
        ({"vector": (1, 0, 0), "times": [math.nan]}, "finite"),
        ({"vector": (1, 0, 0), "kt": -1.0}, "above 0"),
    ],
)
def test_correlations_refuse_wrong_input(options, said):
    settings = {"moments": TOPS["asymmetric"], "kt": KT, "times": [0.0, 1.0], "molecules": 10, "rng": rng()} | options
    with pytest.raises(ValueError, match=said):
        free_gas_correlations(**settings)


def test_ensembles_and_stepped_gases_refuse_wrong_input():
    with pytest.raises(ValueError, match="take a shorter step"):
        stepped_gas_correlations(TOPS["prolate"], KT, 9.0, 3, vector=(1, 0, 0), molecules=10, rng=rng())
    with pytest.raises(ValueError, match="whole numbers"):
        stepped_gas_correlations(TOPS["prolate"], KT, 0.1, 3, steps=0, vector=(1, 0, 0), molecules=10, rng=rng())
    with pytest.raises(ValueError, match="mass"):
        thermal_ensemble(TOPS["linear"], KT, 3, rng=rng(), mass=0.0)
    with pytest.raises(ValueError, match="moments"):
        thermal_momenta([[1.0, 1.0, 1.0]], KT, 3, rng=rng())
