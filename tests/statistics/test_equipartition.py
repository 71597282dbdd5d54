"""Equipartition as a test: exact laws, stated error rates, planted mistakes, correlated frames."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

import rotor
from rotor.classical.gas.ensembles import thermal_ensemble
from rotor.statistics.degrees_of_freedom import count_degrees
from rotor.statistics.equipartition import equipartition, kinetic_degrees, statistical_inefficiency
from rotor.units import EV_PER_K

GASES = ("water", "HCl", "CH4", "NH3", "CO2", "C6H6")
KT = EV_PER_K * 300


def gas_of(name: str, n: int = 20_000, seed: int = 7):
    top = rotor.read(name)
    return thermal_ensemble(top.moments_u_angstrom2, KT, n, rng=np.random.default_rng(seed), mass=top.mass_u)


def ornstein_uhlenbeck(frames: int, n: int, memory: float, rng: np.random.Generator) -> np.ndarray:
    """Velocities (frames, n) of unit variance that remember `memory` of the frame before."""
    v = np.empty((frames, n))
    v[0] = rng.normal(size=n)
    for i in range(1, frames):
        v[i] = memory * v[i - 1] + math.sqrt(1 - memory**2) * rng.normal(size=n)
    return v


@pytest.mark.parametrize("name", GASES)
def test_free_gases_are_in_equilibrium_and_stay_there(name):
    gas = gas_of(name, 6000)
    assert gas.kinetic.total == count_degrees(np.broadcast_to(gas.moments, (len(gas), 3))).total
    assert len(gas.kinetic.energies) == (5 if name in ("HCl", "CO2") else 6)
    for moment in (gas, gas.moved(100.0), gas.moved(1e6)):
        test = equipartition(moment.kinetic, KT)
        assert test.accepted, str(test)  # a fixed seed; 1 % of all seeds would fail
        assert max(abs(degree.sigma) for degree in test.degrees) < 4
        assert all(abs(degree.spread - math.sqrt(2)) < 0.14 for degree in test.degrees)  # 4 √(56/8n), n = 6000


def test_the_exact_law_of_one_degree():
    """z and p of a mean against scipy's χ², near and far."""
    n = 50
    for scale in (0.5, 1.0, 1.4, 3.0):
        x = np.full(n, scale)  # Σ 2E/kT = n scale
        degree = equipartition({"x": 0.5 * x}, 1.0).degrees[0]
        low, high = stats.chi2.cdf(n * scale, n), stats.chi2.sf(n * scale, n)
        assert degree.p_value == pytest.approx(min(1.0, 2 * min(low, high)), rel=1e-9, abs=0)
        assert degree.sigma == pytest.approx(
            -stats.norm.ppf(low) if low > 0.5 else stats.norm.ppf(low), rel=1e-6, abs=1e-9
        ) or (low > 0.5 and degree.sigma == pytest.approx(stats.norm.isf(high), rel=1e-6))


def test_the_distance_of_distributions_is_scipys():
    x = np.random.default_rng(3).chisquare(1, 4000) * 1.05
    degree = equipartition({"x": 0.5 * x}, 1.0).degrees[0]
    theirs = stats.kstest(x, stats.chi2(1).cdf)
    assert degree.ks_distance == pytest.approx(theirs.statistic, rel=1e-12)
    assert degree.ks_p_value == pytest.approx(theirs.pvalue, abs=2e-3)  # Stephens's approximation


@pytest.mark.parametrize("kt", [1.0, None])
def test_honest_ensembles_are_rejected_as_often_as_stated(kt):
    """1000 seeds at 95 %: each statement at its own rate, the answer at most at 5 %."""
    rng, computed = np.random.default_rng(11), []
    for _ in range(1000):
        test = equipartition({name: 0.5 * rng.normal(size=100) ** 2 for name in "xyzabc"}, kt, confidence=0.95)
        computed.append((test.chi2_p < 0.05, test.ks_p < 0.05, not test.accepted))
    chi2, ks, rejected = np.mean(computed, axis=0)
    spread = math.sqrt(0.05 * 0.95 / 1000)  # 0.0069
    assert abs(chi2 - 0.05) < 3 * spread
    assert ks < 0.05 + 3 * spread
    assert 0.05 - 5 * spread < rejected < 0.05 + 3 * spread  # Bonferroni and dependence: below, not much
    if kt is not None:
        assert abs(ks - 0.05) < 3 * spread  # with kT from the same data it is a little less


@pytest.mark.slow
def test_one_honest_gas_in_a_hundred_is_rejected():
    """5000 seeds of water at the default confidence: translations, and rotations about unlike axes."""
    rejected, chi2 = 0, 0
    top = rotor.read("water")
    for seed in range(5000):
        rng = np.random.default_rng(seed)
        gas = thermal_ensemble(top.moments_u_angstrom2, KT, 200, rng=rng, mass=top.mass_u)
        test = equipartition(gas.kinetic, KT)
        rejected, chi2 = rejected + (not test.accepted), chi2 + (test.chi2_p < 0.01)
    assert chi2 == pytest.approx(50, abs=21)  # 3 σ of a binomial
    assert 25 < rejected < 71  # a little below 50, by Bonferroni; 3 σ


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_correlated_frames_are_rejected_as_often_as_stated(memory):
    rng, computed, effective = np.random.default_rng(12), [], []
    for _ in range(120):
        data = {name: 0.5 * ornstein_uhlenbeck(800, 10, memory, rng) ** 2 for name in "xa"}
        test = equipartition(data, 1.0, confidence=0.95)
        computed.append((test.chi2_p < 0.05, not test.accepted))
        effective.append(test.degrees[0].effective)
    rates = np.mean(computed, axis=0)
    assert np.all(rates < 0.05 + 3 * math.sqrt(0.05 * 0.95 / 120))  # 3 σ of 120 trials
    true = 8000 * (1 - memory**2) / (1 + memory**2)  # of energies, whose correlation is that of velocities squared
    found_spread2 = np.mean(1 / np.array(effective))  # spreads² average without bias
    assert 1 / found_spread2 == pytest.approx(true, rel=0.12)  # each is known to √(10 g/F) = 35 %, of 120 trials 3 %


def test_forgetting_the_correlation_would_reject_everything():
    rng, rejected = np.random.default_rng(13), 0
    for _ in range(30):
        data = 0.5 * ornstein_uhlenbeck(2000, 10, 0.98, rng) ** 2
        rejected += equipartition({"x": data.ravel()}, 1.0, confidence=0.95).p_value < 0.05
    assert rejected > 15  # so the test above tests something


def test_sokals_window_on_a_known_series():
    series = ornstein_uhlenbeck(200_000, 1, 0.9, np.random.default_rng(2))
    assert statistical_inefficiency(series) == pytest.approx(
        1.9 / 0.1, rel=0.1
    )  # √(2·2·48/2e5) = 3 %, and e^-5 cut off


def test_a_linear_molecule_counted_with_six_degrees_is_caught():
    """A thermostat that believes in 6 degrees of CO2 gives 6/5 of the energy to the 5 there are."""
    gas = gas_of("CO2")
    wrong = equipartition({name: 6 / 5 * energies for name, energies in gas.kinetic.energies.items()}, KT)
    assert not wrong.accepted
    assert len(wrong.failing) == 5
    assert all(degree.sigma > 15 for degree in wrong.degrees)  # 0.2 √(n/2) = 20


def test_a_third_rotation_that_is_not_there_is_caught():
    gas = gas_of("CO2")
    planted = dict(gas.kinetic.energies) | {"rotation a": np.zeros(len(gas))}
    test = equipartition(planted, KT)
    assert test.failing == ("rotation a",)
    assert test.degrees[-1].sigma < -100


def test_a_total_removed_and_not_counted_is_caught():
    """Few molecules: 3 of 60 translations are a twentieth of the energy. Over many boxes the mean shows it."""
    rng = np.random.default_rng(4)
    masses = np.full(20, 18.0)
    v = rng.normal(size=(2000, 20, 3)) / math.sqrt(18.0)
    v -= v.mean(axis=1, keepdims=True)
    counted = kinetic_degrees(masses=masses, velocities=v, momentum_removed=True)
    forgotten = kinetic_degrees(masses=masses, velocities=v)
    assert counted.total == pytest.approx(count_degrees(np.zeros((20, 3)), removed=3).total, rel=1e-15)
    assert equipartition(counted, 1.0).accepted
    wrong = equipartition(forgotten, 1.0)
    assert not wrong.accepted
    assert all(degree.sigma < -4 for degree in wrong.degrees)  # 0.05/√(2/38000) = 6.9 expected, ± 1 of it
    assert wrong.degrees[0].mean == pytest.approx(0.95, abs=0.03)


def test_a_mixture_is_tested_kind_by_kind():
    rng = np.random.default_rng(5)
    species = ["H2O"] * 3000 + ["CO2"] * 2000 + ["Ar"] * 1000
    moments = np.array([(0.6, 1.2, 1.8)] * 3000 + [(0.0, 43.0, 43.0)] * 2000 + [(0.0, 0.0, 0.0)] * 1000)
    masses = np.repeat([18.0, 44.0, 40.0], [3000, 2000, 1000])
    momenta = rng.normal(size=(6000, 3)) * np.sqrt(moments)
    velocities = rng.normal(size=(6000, 3)) / np.sqrt(masses)[:, None]
    velocities -= masses @ velocities / masses.sum()
    settings = {
        "masses": masses,
        "velocities": velocities,
        "moments": moments,
        "species": species,
        "momentum_removed": True,
    }
    mixture = kinetic_degrees(momenta=momenta, **settings)
    assert mixture.total == pytest.approx(count_degrees(moments, removed=3).total, rel=1e-12)
    assert len(mixture.energies) == 9 + 3 + 2
    assert equipartition(mixture, 1.0).accepted
    hot = momenta.copy()
    hot[:3000, 1] *= math.sqrt(1.2)
    assert equipartition(kinetic_degrees(momenta=hot, **settings), 1.0).failing == ("H2O: rotation b",)


def test_two_temperatures_are_seen_without_knowing_either():
    rng = np.random.default_rng(6)
    data = {name: 0.7 * ornstein_uhlenbeck(2000, 50, 0.8, rng) ** 2 for name in ("tx", "ty", "ra", "rb")}
    same = equipartition(data, None)
    assert same.accepted
    assert same.kt == pytest.approx(1.4, rel=0.02)
    cold = data | {name: 0.95 * data[name] for name in ("ra", "rb")}
    apart = equipartition(cold, None)
    assert not apart.accepted
    assert apart.chi2_degrees == 3
    assert not equipartition(data, 1.3).accepted


def test_the_right_mean_with_the_wrong_distribution_is_caught():
    """A thermostat that gives every molecule the same energy: means perfect, spread none."""
    test = equipartition({"x": np.full(1000, 0.5)}, 1.0)
    assert test.chi2_p > 0.5
    assert not test.accepted
    assert test.failing == ("x",)


def test_a_turned_frame_is_caught():
    """Moments of one axis taken for another, as when body and space axes are mixed."""
    gas = gas_of("water")
    wrong = kinetic_degrees(moments=np.broadcast_to(gas.moments[[1, 0, 2]], (len(gas), 3)), momenta=gas.momentum)
    assert set(equipartition(wrong, KT).failing) == {"rotation a", "rotation b"}


def test_energies_that_never_change_are_refused():
    gas = gas_of("water", 100)
    energies = np.tile(gas.kinetic.energies["translation x"], (200, 1))
    with pytest.raises(ValueError, match="200 frames are too few"):
        equipartition({"x": energies}, KT)


def test_energy_about_an_axis_without_a_degree_is_an_error():
    with pytest.raises(ValueError, match="an axis that has no degree of freedom"):
        kinetic_degrees(moments=[[1e-7, 1.0, 1.0]], momenta=[[1e-4, 1.0, 0.0]])
    energies = kinetic_degrees(moments=[[1e-7, 1.0, 1.0]], momenta=[[1e-4, 1.0, 0.0]], linear_below=1e-9).energies
    assert list(energies) == ["rotation a", "rotation b", "rotation c"]


@pytest.mark.parametrize(
    ("energies", "kt", "options", "said"),
    [
        ({}, 1.0, {}, "no degree of freedom was given"),
        ({"x": [1.0, -1.0]}, 1.0, {}, "not negative"),
        ({"x": [1.0, math.nan]}, 1.0, {}, "finite"),
        ({"x": np.ones((2, 2, 2))}, 1.0, {}, "shape"),
        ({"x": [1.0]}, 0.0, {}, "above 0"),
        ({"x": [1.0]}, None, {}, "two degrees"),
        ({"x": [0.0], "y": [0.0]}, None, {}, "every kinetic energy is zero"),
        ({"x": [1.0]}, 1.0, {"confidence": 1.0}, "between 0 and 1"),
    ],
)
def test_equipartition_refuses_wrong_input(energies, kt, options, said):
    with pytest.raises(ValueError, match=said):
        equipartition(energies, kt, **options)


def test_wrong_species_and_nothing_at_all():
    with pytest.raises(ValueError, match="1 names of species for 2 bodies"):
        kinetic_degrees(masses=[1.0, 1.0], velocities=np.ones((2, 3)), species=["a"])
    with pytest.raises(ValueError, match="expected"):
        kinetic_degrees()


def test_the_table_and_the_sentence():
    test = equipartition(gas_of("water", 1000).kinetic, KT)
    assert list(test.to_pandas()["name"]) == [degree.name for degree in test.degrees]
    assert str(test).startswith("equipartition accepted at 99 % confidence, p = ")


def test_energies_that_follow_the_law_too_well_have_an_answer():
    ranks = (np.arange(200) + 0.5) / 200
    test = equipartition({"x": stats.chi2(1).ppf(ranks) / 2}, 1.0)
    assert test.ks_p == 1.0  # the asymptotic law is 1 to the last bit at this distance, 0.0025
    assert test.accepted


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"masses": [1, 2], "velocities": np.zeros((3, 3))}, r"velocities of shape \(3, 3\) for 2 bodies"),
        ({"masses": [1, 2], "velocities": np.zeros((2, 2))}, r"velocities of shape \(2, 2\) for 2 bodies"),
        ({"moments": [[1, 1, 1]], "momenta": np.zeros((4, 2, 3))}, r"momenta of shape \(4, 2, 3\) for 1 bodies"),
        (
            {"masses": [1], "velocities": np.zeros((1, 3)), "momentum_removed": True},
            "a single body without total momentum",
        ),
    ],
)
def test_motions_of_other_bodies_than_there_are_are_refused(change, said):
    with pytest.raises(ValueError, match=said):
        kinetic_degrees(**change)
