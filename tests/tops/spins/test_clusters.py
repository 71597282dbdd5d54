"""Spherical tops split by the fourth-rank tensor: closed forms, full matrices, irreps by characters, weights."""

from __future__ import annotations

import numpy as np
import pytest
from slow_matrix import cubic_matrix, threefold_turn

from rotor.quantum.solve import solve_levels
from rotor.quantum.wang.spherical_top import DIMENSION, tensor_eigenvalues
from rotor.thermodynamics.sums.partition import partition_function
from rotor.tops.constants.constants import Constants
from rotor.tops.constants.operators import CUBIC_TENSOR
from rotor.tops.spins.spin_weights import CUBIC_IRREPS, SpinWeights
from rotor.tops.top import Top

METHANE = Constants(kind="spherical", B=157127.0, D=3.3236, Dt=0.13294)
CH4_WEIGHTS = SpinWeights.from_mapping({"A": 5, "E": 2, "F": 3})


def irreps_in(j: int) -> list[int]:
    """Reduction of the characters of O, sin((2J+1)θ/2)/sin(θ/2), over the classes 1, 8 C3, 3 C2, 6 C4, 6 C2'."""
    character = lambda angle: np.sin((2 * j + 1) * angle / 2) / np.sin(angle / 2)  # noqa: E731
    chi = [2 * j + 1, *(character(a) for a in (2 * np.pi / 3, np.pi, np.pi / 2, np.pi))]
    table = [[1, 1, 1, 1, 1], [1, 1, 1, -1, -1], [2, -1, 2, 0, 0], [3, 0, -1, 1, -1], [3, 0, -1, -1, 1]]
    return [round(sum(n * a * b for n, a, b in zip([1, 8, 3, 6, 6], row, chi, strict=True)) / 24) for row in table]


def test_low_j_in_closed_form():
    """Eigenvalues by hand from Ω|K⟩: the diagonal -½(35K⁴ - 30XK² + 25K² + 3X² - 6X) and -5/4 of the ladder to K ± 4."""
    closed = {
        0: {"A1": [0]},
        1: {"F1": [0]},
        2: {"E": [-36], "F2": [24]},
        3: {"A2": [360], "F1": [-180], "F2": [60]},
        4: {"A1": [-840], "E": [-120], "F1": [-420], "F2": [780]},
    }
    for j, levels in closed.items():
        irreps, omega = tensor_eigenvalues(j)
        assert irreps.tolist() == [irrep for irrep, values in levels.items() for _ in values]
        assert np.allclose(omega, [value for values in levels.values() for value in values], atol=1e-10)  # round-off


@pytest.mark.parametrize("j", [5, 6, 9, 12, 15])
def test_eigenvalues_and_irreps_of_the_full_matrix(j):
    """Ω as printed; a level's trace of C3 is 1 for A, -1 for E, 0 for F."""
    values, vectors = np.linalg.eigh(cubic_matrix(j))
    irreps, omega = tensor_eigenvalues(j)
    repeats = np.array([DIMENSION[irrep] for irrep in irreps])
    assert np.allclose(np.sort(np.repeat(omega, repeats)), values, atol=1e-9 * j**2)  # round-off of 35 J⁴

    turn = (
        np.abs(vectors.conj().T) @ np.zeros_like(vectors) if j < 0 else vectors.conj().T @ threefold_turn(j) @ vectors
    )
    for irrep, value in zip(irreps, omega, strict=True):
        near = np.abs(values - value) < 1e-6 * j**4
        alone = np.abs(omega - value) < 1e-6 * j**4
        if alone.sum() == 1:
            expected = {"A": 1, "E": -1, "F": 0}[irrep[0]]
            assert np.trace(turn[np.ix_(near, near)]) == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("j", [*range(26), 60, 90])
def test_how_many_of_each(j):
    irreps, omega = tensor_eigenvalues(j)
    assert [(irreps == irrep).sum() for irrep in CUBIC_IRREPS] == irreps_in(j)
    dimension = np.array([DIMENSION[irrep] for irrep in irreps])
    assert dimension.sum() == 2 * j + 1
    assert abs(dimension @ omega) < 1e-13 * (2 * j + 1) * 35 * (j + 1) ** 4  # traceless to round-off


def test_methane_has_its_order():
    """J = 3 of CH4, with its positive D_t: A2 is highest and F1 lowest, 300 and 240 D_t away from F2."""
    levels = solve_levels(Top(METHANE), 3, jmin=3)
    energy = dict(zip(levels.quanta["irrep"].tolist(), levels.energy_mhz, strict=True))
    assert energy["A2"] - energy["F2"] == pytest.approx(300 * 0.13294, rel=1e-6)
    assert energy["F2"] - energy["F1"] == pytest.approx(240 * 0.13294, rel=1e-6)


def test_levels_keep_their_barycentre():
    plain, split = (solve_levels(Top(c), 12) for c in (METHANE.replace(Dt=None), METHANE))
    for j in range(13):
        here = split.quanta["j"] == j
        mean = (split.energy_mhz * split.components)[here].sum() / (2 * j + 1)
        assert mean == pytest.approx(plain.energy_mhz[j], rel=1e-13, abs=1e-9)
    assert len(plain) == 13
    assert "irrep" not in plain.quanta


@pytest.mark.parametrize(
    "weights", [SpinWeights(), CH4_WEIGHTS, SpinWeights.from_mapping({"A1": 3, "A2": 7, "E": 4, "F1": 1, "F2": 5})]
)
def test_weights_add_up_to_those_of_j(weights):
    split = solve_levels(Top(METHANE, spin_weights=weights), 24)
    sums = [split.weight[split.quanta["j"] == j].sum() for j in range(25)]
    assert sums == weights.spherical_weights(np.arange(25)).tolist()


def test_sign_of_dt_turns_the_order_of_energy():
    up, down = (solve_levels(Top(METHANE.replace(Dt=s * 0.1)), 9, jmin=9) for s in (1, -1))
    assert up.quanta["irrep"].tolist() == down.quanta["irrep"].tolist()
    for irrep in CUBIC_IRREPS:
        for levels in (up, down):
            assert (np.diff(levels.energy_mhz[levels.quanta["irrep"] == irrep]) > 0).all()
    mean = METHANE["B"] * 90 - METHANE["D"] * 90**2
    assert np.allclose(
        np.sort(up.energy_mhz - mean), np.sort(mean - down.energy_mhz), atol=1e-7
    )  # round-off of 1e7 MHz


def test_partition_function_is_that_of_the_unsplit_top():
    """At 300 K the splittings of methane, below 1e-3 of kT, leave Q alone in first order."""
    plain, split = (
        partition_function(Top(c, spin_weights=CH4_WEIGHTS), 300.0).q for c in (METHANE.replace(Dt=None), METHANE)
    )
    assert split == pytest.approx(plain, rel=1e-6)


def test_table_says_the_irrep():
    frame = solve_levels(Top(METHANE, spin_weights=CH4_WEIGHTS), 2).to_pandas()
    assert frame.irrep.tolist() == ["A1", "F1", "E", "F2"]
    assert frame.degeneracy.tolist() == [5, 9, 10, 15]


def test_noncubic_terms_leave_the_closed_form():
    from rotor.quantum.wang.spherical_top import is_cubic

    assert is_cubic({(1, 0, 0): 5.0, (2, 0, 0): -1e-4})
    assert is_cubic({(1, 0, 0): 5.0} | {powers: 0.1 * c for powers, c in CUBIC_TENSOR.items() if powers != (1, 0, 0)})
    assert not is_cubic({(1, 0, 0): 5.0, (0, 1, 0): 0.1})
    assert not is_cubic({(1, 0, 0): 5.0, (0, 0, 1): 0.1})


@pytest.mark.parametrize(
    ("weights", "says"),
    [
        ({"A": 1, "F1": 3, "F2": 3, "G": 4, "H": 5}, "icosahedral"),
        ({"0": 2, "1": 1, "2": 1}, "do not fit a spherical top"),
    ],
)
def test_weights_that_cannot_serve_split_levels(weights, says):
    with pytest.raises(ValueError, match=says):
        solve_levels(Top(METHANE, spin_weights=SpinWeights.from_mapping(weights)), 3)
