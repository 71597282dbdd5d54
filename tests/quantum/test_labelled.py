"""Levels by their labels for changing constants: against the core's levels and derivatives, in every representation."""

import numpy as np
import pytest

from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.labels.labelled import level_model
from rotor.quantum.solve import solve_levels
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

A_TERMS = {"DeltaJ": 1e-3, "DeltaJK": 2e-3, "DeltaK": 1e-3, "deltaJ": 3e-4, "deltaK": 5e-4, "PhiK": 1e-8, "phiK": 1e-8,
           "lK": 1e-12, "J2Jpm6": 1e-13}  # fmt: skip
S_TERMS = {"DJ": 1e-3, "DJK": 2e-3, "DK": 1e-3, "d1": 3e-4, "d2": 5e-4, "h1": 1e-8, "h3": 1e-9, "l4": 1e-12}
RIGID = {"A": 8572.0, "B": 3640.0, "C": 2790.0}


def labels_of(levels):
    names = [name for name in ("j", "ka", "kc", "k") if name in levels.quanta]
    return np.stack([levels.quanta[name] for name in names], axis=1)


@pytest.mark.parametrize("representation", ["Ir", "Il", "IIr", "IIl", "IIIr", "IIIl"])
@pytest.mark.parametrize("terms", [A_TERMS, S_TERMS], ids="AS")
def test_labelled_levels_are_the_cores(representation, terms):
    constants = Constants(representation=representation, **RIGID, **terms)
    top = Top(constants)
    levels = solve_levels(top, 13)
    rows = np.random.default_rng(0).permutation(len(levels))[: len(levels) // 2]
    model = level_model(constants, labels_of(levels)[rows])
    energies, slopes = model.levels(np.array([constants[name] for name in model.names]))
    scale = np.abs(levels.energy_mhz).max()
    assert np.abs(energies - levels.energy_mhz[rows]).max() < 1e-14 * scale  # round-off of one diagonalisation
    expected = level_derivatives(top, levels, model.names, rows)
    assert np.abs((slopes - expected) / np.abs(expected).max(axis=0)).max() < 1e-13  # the same


@pytest.mark.parametrize("axis", ["Ir", "IIIl"])
def test_single_vectors_of_few_labels_are_those_of_all(monkeypatch, axis):
    """Tridiagonal blocks with one label each, in which no neighbours are close, need no decomposition with all vectors."""
    constants = Constants(
        representation=axis, **RIGID, DeltaJ=1e-4, DeltaJK=2e-4, DeltaK=1e-4, deltaJ=3e-5, deltaK=5e-5
    )
    levels = solve_levels(Top(constants), 80)
    rows = [levels.find(j=j, ka=j // 2, kc=j - j // 2) for j in range(56, 81)]
    values = np.array([constants[name] for name in constants.values])
    everything = level_model(constants, labels_of(levels)[levels.quanta["j"] >= 56])
    energies, slopes = everything.levels(values)
    places = np.array(rows) - np.flatnonzero(levels.quanta["j"] == 56)[0]
    monkeypatch.setattr(np.linalg, "eigh", None)
    few_energies, few_slopes = level_model(constants, labels_of(levels)[rows]).levels(values)
    assert np.abs(few_energies / energies[places] - 1).max() < 1e-13  # round-off
    assert np.abs((few_slopes - slopes[places]) / np.abs(slopes).max(axis=0)).max() < 1e-11  # of a gap of 1e-4


@pytest.mark.parametrize(
    "constants",
    [
        Constants(B=6081.5, D=1.3e-3, H=1e-10),
        Constants(A=158099.0, B=9198.9, DJ=3.8e-3, DJK=0.177, DK=2.8),
        Constants(B=13000.0, C=5000.0, DJ=1e-3, DJK=-1e-3),
    ],
)
def test_closed_forms_too(constants):
    top = Top(constants)
    levels = solve_levels(top, 9)
    model = level_model(constants, labels_of(levels))
    energies, slopes = model.levels(np.array([constants[name] for name in model.names]))
    assert energies == pytest.approx(levels.energy_mhz, rel=1e-14, abs=1e-9)  # round-off
    assert slopes == pytest.approx(level_derivatives(top, levels, model.names), rel=1e-14)  # the same


def test_a_cut_basis_is_a_submatrix():
    """J = 3, block ee with K up to 1 or 2: K = 0 alone, as the 1 x 1 matrix."""
    constants = Constants(**RIGID, reduction="A", DeltaJ=1e-3)
    model = level_model(constants, np.array([[2, 0, 2]]), kmax=1)
    energy, _ = model.levels(np.array([constants[name] for name in model.names]))
    mean = (RIGID["B"] + RIGID["C"]) / 2
    assert energy[0] == pytest.approx(6 * mean - 36e-3, rel=1e-13)  # round-off
    with pytest.raises(ValueError, match="level 2 2 0 is not among the states with K up to 1"):
        level_model(constants, np.array([[2, 2, 0]]), kmax=1)


def test_a_model_of_no_labels_has_no_levels():
    energies, slopes = level_model(Constants(**RIGID), np.zeros((0, 3), dtype=int)).levels(
        np.array(list(RIGID.values()))
    )
    assert energies.shape == (0,)
    assert slopes.shape == (0, 3)


def test_a_cut_at_high_k_takes_away_the_levels_of_high_kc_where_z_is_c():
    """J = 3, odd K: without K = 3 a block has one function, (A + B)/2 · 12 + C - (A + B)/2 ± (A - B)/4 · 12; Kc = 3 is cut."""
    constants = Constants(A=9000.0, B=8000.0, C=3000.0, representation="IIIl")
    model = level_model(constants, np.array([[3, 3, 1], [3, 2, 1]]), kmax=2)
    energies, _ = model.levels(np.array([constants[name] for name in model.names]))
    assert energies == pytest.approx([8500 * 12 - 5500 + 3000, 8500 * 12 - 5500 - 3000], rel=1e-13)  # round-off
    with pytest.raises(ValueError, match="level 3 0 3 is not among the states with K up to 2"):
        level_model(constants, np.array([[3, 0, 3]]), kmax=2)


@pytest.mark.parametrize(
    ("label", "rule"),
    [([2, 3, 0], "there is no level 2 3 0"), ([2, 1, 3], "there is no level"), ([-1, 0, 0], "there is no level"),
     ([3, 1, 1], "add up to J or J")],
)  # fmt: skip
def test_levels_that_do_not_exist_are_refused(label, rule):
    with pytest.raises(ValueError, match=rule):
        level_model(Constants(**RIGID), np.array([label]))


def test_other_quantum_numbers_are_refused():
    with pytest.raises(ValueError, match="1 quantum numbers for each state; an asymmetric top has J, Ka, Kc"):
        level_model(Constants(**RIGID), np.array([[1]]))
    with pytest.raises(ValueError, match="at most J"):
        level_model(Constants(A=9.0, B=3.0), np.array([[2, 3]]))


def test_overlaps_see_a_state_that_has_become_another():
    """Two levels of one block that change places as D_K grows: their vectors do, their labels do not."""
    constants = Constants(A=10.0, B=3.001, C=2.999, DK=0.0, reduction="S")
    model = level_model(constants, np.array([[4, 2, 3], [4, 4, 1]]))
    before = np.array([constants[name] for name in model.names])
    after = before.copy()
    after[model.names.index("DK")] = 1.0  # K⁴ takes 256 from K = 4 and 16 from K = 2, more than A K² gives
    assert model.overlaps(before, before) == pytest.approx([1.0, 1.0], abs=1e-14)  # round-off
    assert model.overlaps(before, after).max() < 0.01


def test_a_series_that_diverges_at_high_k_leaves_the_labels_of_low_k_as_they_are():
    """D_K bends the diagonal down from K = 12 on: states of K = 18 and 20 lie among those of low K; a cut at K = 14 knows none."""
    constants = Constants(A=30.0, B=5.0, C=4.9, DK=0.0863, reduction="S")
    labels = np.array([[20, ka, 20 - ka] for ka in range(7)] + [[20, ka, 21 - ka] for ka in range(1, 7)])
    whole, cut = level_model(constants, labels), level_model(constants, labels, kmax=14)
    values = np.array([constants[name] for name in whole.names])
    energies = whole.levels(values)[0]
    assert energies == pytest.approx(
        cut.levels(values)[0], abs=1e-9
    )  # round-off; K = 16 is nine steps of 0.05 x^2 away
    assert whole.overlaps(values, values * (1 + 1e-6)).min() > 0.99
    high = level_model(constants, np.array([[20, 18, 2], [20, 20, 0], [20, 14, 6]])).levels(values)[0]
    assert high[1] < high[0] < energies[4] < high[2]  # the highest K is the lowest, and still called by its K
