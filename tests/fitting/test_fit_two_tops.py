"""Fits of two internal rotors: derivatives, also of three, and constants found again from lines of all species."""

import numpy as np
import pytest

import rotor
from rotor import units
from rotor.fitting.assignment import assignments, levels_in
from rotor.fitting.fit import fit_lines
from rotor.fitting.levels.top_levels import label_model
from rotor.fitting.parameters import parameters
from rotor.fitting.top_constants import TopConstants
from rotor.quantum.labels.quanta import SPECIES_NUMBERS
from rotor.tops.internal_rotation import InternalRotationConstants

CM = units.MHZ_PER_CM
NAMES = ("j", "ka", "kc", "species", "vt")
ABC = {"A": 9800.0, "B": 4300.0, "C": 3200.0}
DIFFERENT = {
    "F0_1": 158e3,
    "delta_1": 0.56,
    "V3_1": 250.0 * CM,
    "F0_2": 161e3,
    "delta_2": 2.5,
    "V3_2": 90.0 * CM,
    "V12": 4 * CM,
}
EQUAL = {"F0_1": 158e3, "delta_1": 0.56, "V3_1": 150.0 * CM, "F0_2": 158e3, "delta_2": np.pi - 0.56, "V3_2": 150.0 * CM}


def two_tops(values, functions=16, dipole=(0.4, 1.3, 0.0), **abc):
    constants = rotor.Constants(**ABC | abc, reduction="A", representation="Ir")
    internal = InternalRotationConstants(values, "PAM", vt_max=0, functions=functions)
    return rotor.Top.from_constants(constants, dipole_abc_debye=dipole, internal_rotation=internal)


def lines_of(top, jmax, error_mhz=0.005, noise=None):
    seen = rotor.api.line_list(top, jmax=jmax, min_lgint=None, q=1.0, range_mhz=(5e3, 8e4))
    quanta = dict(seen.levels.quanta)
    quanta["species"] = np.array([SPECIES_NUMBERS[name] for name in quanta["species"]])
    upper, lower = (np.column_stack([quanta[name][rows] for name in NAMES]) for rows in (seen.upper, seen.lower))
    frequency = seen.frequency_mhz + (0.0 if noise is None else noise.normal(scale=error_mhz, size=len(seen)))
    return assignments(NAMES, upper, lower, frequency, error_mhz, blend=np.arange(len(seen)))


THIRD = {"F0_3": 159e3, "delta_3": 1.45, "V3_3": 200.0 * CM, "V23": 3 * CM}


@pytest.mark.parametrize(
    "further",
    [{}, {"epsilon_2": 0.3}, pytest.param(THIRD, marks=pytest.mark.slow)],
    ids=["plane", "no plane", "three tops"],
)
def test_derivatives_by_constants_of_several_tops_are_those_of_finite_differences(further):
    values = DIFFERENT | further
    constants = TopConstants(two_tops(values | {"V12s": -2 * CM}))
    labels = levels_in(lines_of(two_tops(values), 2 if values == DIFFERENT else 1))[0]
    model = label_model(constants, labels)
    point = np.array(list(constants.values.values()))
    slopes = model.levels(point)[1]
    for i, (name, value) in enumerate(constants.values.items()):
        step = abs(value) * (1e-5 if name[:2] in ("F0", "V3", "de", "ep") else 1e-3)
        changed = [np.where(np.arange(len(point)) == i, value + sign * step, point) for sign in (1, -1)]
        upper, lower = (model.levels(c)[0] for c in changed)
        expected = (upper - lower) / (2 * step)
        noise = 2e-7 / step  # rounding of eigenvalues of matrices with elements up to 1e8 MHz
        # the basis of products moves with the constants: what is beyond it changes levels by some kHz
        assert np.allclose(slopes[:, i], expected, rtol=3e-3, atol=3e-3 * np.abs(expected).max() + noise), name


def test_constants_of_both_tops_are_found_again_from_noisy_lines():
    lines = lines_of(two_tops(DIFFERENT), 4, noise=np.random.default_rng(5))
    assert set(lines.upper[:, 3].tolist()) == {10, 11, 12, 13, 14}
    moved = DIFFERENT | {"delta_1": 0.562, "V3_1": 251 * CM, "delta_2": 2.498, "V3_2": 90.5 * CM}
    start = TopConstants(two_tops(moved, A=9803.0, B=4300.6))
    free = ["A", "B", "C", "delta_1", "V3_1", "delta_2", "V3_2"]
    fit = fit_lines(lines, start, parameters(start, free))
    assert fit.converged
    assert 0.85 < fit.weighted_rms < 1.15  # a few hundred lines with the stated noise
    true = np.array([(ABC | DIFFERENT)[name] for name in fit.parameters.names])
    deviations = np.abs(fit.values - true) / fit.errors
    assert deviations.max() < 3  # of seven that are normal: beyond it once in 50 seeds
    assert np.sqrt(np.mean(deviations**2)) < 1.5  # beyond it once in 50 seeds


def test_equivalent_tops_are_fitted_with_ties():
    lines = lines_of(two_tops(EQUAL, dipole=(0.0, 1.3, 0.0)), 4, noise=np.random.default_rng(6))
    assert set(lines.upper[:, 3].tolist()) == {10, 11, 13, 14}
    moved = EQUAL | {"delta_1": 0.561, "delta_2": np.pi - 0.561, "V3_1": 150.5 * CM, "V3_2": 150.5 * CM}
    start = TopConstants(two_tops(moved, dipole=(0.0, 1.3, 0.0), A=9802.0))
    ties = ["V3_2 = V3_1", f"delta_2 = -1*delta_1 + {np.pi!r}"]
    fit = fit_lines(lines, start, parameters(start, ["A", "B", "C", "delta_1", "V3_1"], ties=ties))
    assert fit.converged
    for name, value, error in zip(fit.parameters.names, fit.values, fit.errors, strict=True):
        assert abs(value - (ABC | EQUAL)[name]) < 2 * error, name
