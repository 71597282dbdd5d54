"""What the notebook of the first lesson says holds: flips of a book, levels and heat of hydrogen, the bond of carbon monoxide."""

from __future__ import annotations

import math

import numpy as np
import pytest

import rotor


def throw(error: float, seconds: float = 4.0, axis: int = 1):
    rates = [error] * 3
    rates[axis] = 10.0
    return rotor.tumble(body="book", angular_velocity=",".join(map(str, rates)), times=f"0:{seconds}:4001")


@pytest.mark.parametrize(("axis", "least"), [(0, 0.99), (2, 0.99)])
def test_a_book_spins_steadily_about_the_outer_axes(axis, least):
    motion = throw(0.1, axis=axis).to_pandas()
    momentum = motion.filter(like="kg_m2_per_s").to_numpy()
    along = momentum[:, axis] / np.linalg.norm(momentum, axis=1)
    assert along.min() > least  # 0.1 rad/s beside 10 rad/s tilts it by a few hundredths at the most


def test_each_tenth_of_the_error_delays_the_flip_by_the_logarithm_over_the_growth_rate():
    first, second = (
        motion.t_s[np.argmax(motion.m2_kg_m2_per_s < 0)]
        for motion in (throw(1e-3).to_pandas(), throw(1e-4).to_pandas())
    )
    small, middle, large = throw(1e-3).facts()["moments"]
    growth = 10 * math.sqrt((middle - small) * (large - middle) / (small * large))
    assert second - first == pytest.approx(math.log(10) / growth, abs=2e-3)  # two steps of the grid of 1 ms


def test_normal_hydrogen_is_a_quarter_para_and_three_quarters_ortho():
    para, ortho, normal = (
        rotor.thermo("H2", temperatures_k="50:400K:8", species=name).to_pandas().cv_over_r
        for name in ("para", "ortho", "normal")
    )
    np.testing.assert_allclose(normal, para / 4 + 3 * ortho / 4, atol=1e-6)  # sums agree to 1e-6 of themselves
    weights = rotor.levels("H2", jmax=5).to_pandas()
    assert weights.weight.tolist() == [1, 3, 1, 3, 1, 3]


def test_the_comb_of_carbon_monoxide_gives_the_distance_of_its_nuclei():
    lines = rotor.spectrum("CO", temperature_k=300, jmax=40).to_pandas()
    teeth = np.diff(lines.frequency_mhz[:10])
    assert np.all(np.abs(teeth / lines.frequency_mhz[0] - 1) < 2.5e-3)  # 6 D J² / B is 2e-3 at J = 10
    reduced = 12.0 * 15.99491461957 / (12.0 + 15.99491461957)
    moment = 505379.00844 / (lines.frequency_mhz[0] / 2)  # u Å² MHz, CONVENTIONS.md
    assert math.sqrt(moment / reduced) == pytest.approx(1.1309, abs=1e-4)  # as the notebook prints it
