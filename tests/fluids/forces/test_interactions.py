"""Mixing, fields at the cutoff, and what lies beyond it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from rotor.fluids.forces.interactions import pair_tables, reaction_field, screened, switched, tail
from rotor.fluids.forces.models import find_model
from rotor.units import EV_PER_K


def test_tail_of_a_hard_cut_is_the_textbook_s() -> None:
    """8/3 π N ρ ε σ³ [⅓(σ/r)⁹ - (σ/r)³] and 16/3 π ρ² ε σ³ [⅔(σ/r)⁹ - (σ/r)³]."""
    n, volume, r, sigma, epsilon = 500, 3.0e4, 9.0, 3.405, 119.8 * EV_PER_K
    energy, pressure = tail((find_model("argon"),), np.array([n]), r, 0.0)
    third, ninth = (sigma / r) ** 3, (sigma / r) ** 9
    scale = math.pi * n / volume * epsilon * sigma**3
    assert energy / volume == pytest.approx(8 / 3 * scale * n * (ninth / 3 - third), rel=1e-12)  # formula
    assert pressure / volume**2 == pytest.approx(
        16 / 3 * scale * n / volume * (2 * ninth / 3 - third), rel=1e-12
    )  # formula


def test_tail_of_a_switched_mixture_by_quadrature() -> None:
    """Energy and pressure of what is missing, each from its own integral (the pressure from the slope)."""
    models, numbers, r, width = (find_model("argon"), find_model("trappe-co2")), np.array([30, 50]), 8.0, 1.5
    energy = pressure = 0.0
    for first, n in zip(models, numbers, strict=True):
        for second, m in zip(models, numbers, strict=True):
            for s in first.sites:
                for t in second.sites:
                    sigma = 0.5 * (s.sigma_angstrom + t.sigma_angstrom)
                    four = 4 * math.sqrt(s.epsilon_ev * t.epsilon_ev)

                    def missing(x: float, sigma: float = sigma, four: float = four) -> float:
                        z = min(max((x - r + width) / width, 0.0), 1.0)
                        return four * ((sigma / x) ** 12 - (sigma / x) ** 6) * z**3 * (10 - 15 * z + 6 * z**2)

                    def slope(x: float, missing=missing) -> float:
                        return (missing(x + 1e-5) - missing(x - 1e-5)) / 2e-5

                    for low, high in ((r - width, r), (r, 20.0), (20.0, 400.0)):
                        energy += 2 * math.pi * n * m * quad(lambda x, f=missing: f(x) * x**2, low, high)[0]
                        pressure -= 2 / 3 * math.pi * n * m * quad(lambda x, f=slope: f(x) * x**3, low, high)[0]
    computed = tail(models, numbers, r, width)
    assert computed[0] == pytest.approx(energy, rel=1e-5)  # quadrature to 400 Å: (20/400)³ of a fraction
    assert computed[1] == pytest.approx(pressure, rel=5e-5)  # and slopes by differences


def test_reaction_field_is_that_of_openmm() -> None:
    """k = (ε-1)/(2ε+1)/r³, c = 3ε/(2ε+1)/r at 78.3 and 9 Å; energy 0 at the cutoff, force 0 for a conductor."""
    square, k, c = reaction_field(9.0, 78.3)
    assert (square, k, c) == pytest.approx((81.0, 77.3 / 157.6 / 729, 3 * 78.3 / 157.6 / 9), rel=1e-14)  # formula
    for dielectric in (1.0, 78.3, math.inf):
        _, k, c = reaction_field(9.0, dielectric)
        assert 1 / 9 + k * 81 - c == pytest.approx(0.0, abs=1e-16)  # round-off
    assert -1 / 81 + 2 * reaction_field(9.0, math.inf)[1] * 9 == pytest.approx(0.0, abs=1e-17)  # round-off


def test_shifted_forces_end_at_the_cutoff() -> None:
    _, b, c, alpha, slope, r = screened(9.0, 0.2, shifted=True)
    assert math.erfc(alpha * r) / r - c == 0.0
    force = (math.erfc(alpha * r) / r + slope * math.exp(-((alpha * r) ** 2))) / r - b
    assert force == pytest.approx(0.0, abs=1e-18)  # round-off of 1e-4


def test_open_space_has_no_cut() -> None:
    assert reaction_field(math.inf, 5.0).tolist() == [1e9, 0.0, 0.0]
    assert switched(math.inf, 1.0).tolist() == [1e9, 0.0, 0.0]


def test_pairs_of_sites_without_anything_between_them_are_left_out() -> None:
    tables = pair_tables((find_model("tip4p"), find_model("argon")))
    assert np.diff(tables.starts).tolist() == [10, 1, 1, 1]  # O-O and nine of H, H, M; argon sees O alone
    assert tables.numbers[tables.starts[1], 0] == 0
    assert (tables.numbers[:10, 1] > 0).sum() == 1
