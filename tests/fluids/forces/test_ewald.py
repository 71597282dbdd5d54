"""Ewald's sum: Madelung's constant, independence of α, errors as predicted, the kernel's erfc."""

from __future__ import annotations

import math

import numpy as np
import plain_fluid as plain
import pytest
from ase import Atoms
from numba import njit
from scipy.special import erfc

from rotor.fluids.forces import _pair_kernels
from rotor.fluids.forces.ewald import (
    COULOMB_EV_ANGSTROM,
    EwaldParameters,
    fourier_error,
    parameters_for,
    real_space_error,
    wave_vectors,
)
from rotor.fluids.forces.models import RigidModel, Site
from rotor.fluids.forces.potential import RigidPotential

# J. M. Borwein et al., Lattice Sums Then and Now (2013), from nearest neighbours
MADELUNG_ROCK_SALT = 1.7475645946331822


def test_madelung_constant_of_rock_salt() -> None:
    """Dumbbells Na-Cl along x, charges ±1, in 4³ cubes of edge r0; the pair inside a dumbbell does not count."""
    r0 = 2.82
    salt = RigidModel("NaCl", (Site("Na", (0.0, 0.0, 0.0), 1.0), Site("Cl", (r0, 0.0, 0.0), -1.0)), "test")
    grid = np.stack(np.meshgrid(*[np.arange(8)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    sodium = grid[grid.sum(axis=1) % 2 == 0] * r0
    places = np.stack((sodium, sodium + np.array([r0, 0, 0])), axis=1).reshape(-1, 3)
    crystal = Atoms(["Na", "Cl"] * len(sodium), positions=places, cell=[8 * r0] * 3, pbc=True)
    calc = RigidPotential(salt, cutoff_angstrom=9.0, electrostatics="ewald", tolerance=1e-12)
    energy = calc.evaluate(crystal).energy_ev / len(sodium) * r0 / COULOMB_EV_ANGSTROM
    assert 1.0 - energy == pytest.approx(MADELUNG_ROCK_SALT, abs=1e-11)  # tolerance 1e-12 of forces, 512 charges


def test_the_sum_does_not_depend_on_alpha() -> None:
    atoms = plain.box_of({"tip4p": 27}, 14.0, seed=9)
    computed = [
        RigidPotential(
            "tip4p", cutoff_angstrom=7.0, electrostatics="ewald", ewald=EwaldParameters(alpha, 12 * alpha)
        ).evaluate(atoms)
        for alpha in (0.80, 0.95)
    ]
    assert computed[0].terms_ev["fourier"] != pytest.approx(computed[1].terms_ev["fourier"], rel=0.01)
    assert computed[0].energy_ev == pytest.approx(computed[1].energy_ev, rel=1e-12)  # exp(-(0.8*7)²) = 2e-14
    first, two = (e.forces_ev_per_angstrom for e in computed)
    assert np.abs(first - two).max() < 1e-11 * np.abs(first).max()  # the same
    assert (
        np.abs(computed[0].virial_ev - computed[1].virial_ev).max() < 1e-10 * np.abs(computed[0].virial_ev).max()
    )  # the same


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
def test_the_error_of_forces_is_the_predicted_one(tolerance: float) -> None:
    atoms = plain.box_of({"spce": 216}, 18.7, seed=2)
    make = {"cutoff_angstrom": 9.0, "electrostatics": "ewald"}
    exact = RigidPotential("spce", tolerance=1e-11, **make).evaluate(atoms).forces_ev_per_angstrom
    evaluated = RigidPotential("spce", tolerance=tolerance, **make).evaluate(atoms).forces_ev_per_angstrom
    error = math.sqrt(np.mean(np.sum((evaluated - exact) ** 2, axis=1))) / COULOMB_EV_ANGSTROM
    assert tolerance / 4 < error < 2 * tolerance  # random charges are assumed; both halves add: √2


def test_error_estimates_fall_as_kolafa_and_perram_say() -> None:
    """At α r_c = 3 and k_c = 6 α both are exp(-9) times their prefactors."""
    args = (216.0, 648, 18.7**3)
    q = 2 * COULOMB_EV_ANGSTROM * 216.0 * math.exp(-9)
    assert real_space_error(1 / 3, 9.0, *args) == pytest.approx(
        q / math.sqrt(648 * 9.0 * 18.7**3), rel=1e-12
    )  # formula
    shells = 2.0 * 18.7 / (2 * math.pi)
    expected = q / 3 / 18.7 / math.sqrt(math.pi * shells * 648)
    assert fourier_error(1 / 3, 2.0, *args) == pytest.approx(expected, rel=1e-12)  # formula


def test_wave_vectors_are_half_of_all_in_a_flat_cell() -> None:
    edges, k_cut = np.array([10.0, 14.0, 23.0]), 2.1
    waves = wave_vectors(EwaldParameters(0.3, k_cut), edges)
    grid = np.stack(np.meshgrid(*[np.arange(-9, 10)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    k = grid * 2 * math.pi / edges
    inside = (np.linalg.norm(k, axis=1) <= k_cut) & grid.any(axis=1)
    assert 2 * len(waves.vectors_per_angstrom) == inside.sum()
    both = np.vstack((waves.vectors_per_angstrom, -waves.vectors_per_angstrom))
    assert len(np.unique(np.round(both, 9), axis=0)) == inside.sum()


@njit
def _both(x, gauss, screen):
    for i in range(len(x)):
        gauss[i], screen[i] = _pair_kernels.gauss_and_erfc(x[i])


def test_gauss_and_erfc_of_the_kernel() -> None:
    x = np.linspace(0.0, 7.0, 70001)
    gauss, screen = np.empty_like(x), np.empty_like(x)
    _both(x, gauss, screen)
    error = np.maximum(np.abs(screen / erfc(x) - 1), np.abs(gauss / np.exp(-(x**2)) - 1))
    assert error[x < 5].max() < 3e-14  # 64 roundings of the squarings
    assert error.max() < 1e-10  # exp(-49/64) to the 64th; erfc is 4e-23 there


@pytest.mark.parametrize("wrong", [0.0, 1.5, math.nan])
def test_tolerances_are_checked(wrong: float) -> None:
    with pytest.raises(ValueError, match="a relative error of forces"):
        parameters_for(wrong, 9.0, np.array([1.0, -1.0]), np.full(3, 20.0))


def test_parameters_are_checked() -> None:
    with pytest.raises(ValueError, match=r"alpha_per_angstrom = -1\.0"):
        EwaldParameters(-1.0, 2.0)
    with pytest.raises(ValueError, match="holds no wave vector"):
        wave_vectors(EwaldParameters(0.3, 0.1), np.full(3, 20.0))
