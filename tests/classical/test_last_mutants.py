"""Refusals and edges that a random sample of changes to the code showed unseen by other tests."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from observed_cases import artificial, injected

from rotor.classical.effects.drag import LinearDrag
from rotor.classical.effects.torques import ConstantTorque
from rotor.classical.integrators import lie_runge_kutta
from rotor.classical.integrators.method import integrate
from rotor.fitting.choice.criteria import aicc, f_test
from rotor.fluids.motion.bodies import _principal
from rotor.observed.identification.identify import identify
from rotor.observed.identification.selection import IdentifyChoices
from rotor.observed.model.model import Component
from rotor.observed.model.partition import PartitionTable
from rotor.structures.kraitchman import _used_moments


@pytest.mark.parametrize("plain_steps", [0, 400])
def test_a_torque_that_no_step_follows_is_refused(monkeypatch, plain_steps):
    """By compiled steps as by plain ones."""
    monkeypatch.setattr(lie_runge_kutta, "PLAIN_STEPS", plain_steps)
    torque = ConstantTorque([1e300, 1e300, 0.0])
    with np.errstate(all="ignore"), pytest.raises(ValueError, match="no step is short enough at time 0"):
        integrate(lie_runge_kutta.LieRungeKutta(), [1.0, 1.5, 2.0], [0.0, 0.0, 1.0], [0.0, 1.0], effects=[torque])


def test_a_motion_that_speeds_up_without_bound_is_refused_early(monkeypatch):
    """Drag of the wrong sign: steps shorten as exp(-t), so that what is left is estimated after each compiled call."""
    monkeypatch.setattr(lie_runge_kutta, "PLAIN_STEPS", 0)
    monkeypatch.setattr(lie_runge_kutta, "MOST_STEPS", 1e5)
    drag = LinearDrag([-1.0, -1.0, -1.0])
    with pytest.raises(ValueError, match="more steps are needed: an effect adds energy without bound"):
        integrate(lie_runge_kutta.LieRungeKutta(), [1.0, 2.0, 3.0], [0.3, 0.2, 1.0], [0.0, 1000.0], effects=[drag])


def test_a_shape_has_three_coordinates_for_each_mass():
    with pytest.raises(ValueError, match=r"a shape of \(2, 3\) for a molecule of 3 atoms"):
        _principal(np.ones(3), np.zeros((2, 3)))


def test_the_moment_about_the_axis_of_a_linear_molecule_does_not_count():
    used = _used_moments(np.ones((2, 3)), "linear", "", 1.0)
    assert used.tolist() == [[False, True, True]] * 2
    assert _used_moments(np.array([[1.0, 1.0, np.nan]] * 2), "linear", "", 1.0).tolist() == [[False, True, False]] * 2


@pytest.mark.parametrize("kelvin", [30.0, 300.0])
def test_a_species_is_looked_for_at_the_ends_of_its_table_of_q(kelvin):
    """One template temperature, the first or the last of the table: the species is found with it."""
    rng = np.random.default_rng(5)
    table = np.geomspace(30.0, 300.0, 20)
    species = replace(artificial("s", rng, 230e3, 230.4e3, 12), partition=PartitionTable(table, 0.5 * table**1.5))
    component = Component(species, 1e16, 100.0, 0.0, 3.0)
    observed = injected([component], np.arange(229.9e3, 230.5e3, 0.5), 0.01, rng)
    choices = IdentifyChoices(temperatures_k=(kelvin,), velocity_km_s=0.0, fwhm_km_s=3.0)
    assert identify(observed, [species], choices=choices).names == ["s"]


def test_models_of_lines_that_fit_exactly_are_compared():
    """No scatter is left: F and Akaike's criterion stay finite, and the larger model is not better by chance."""
    smaller, larger = (
        SimpleNamespace(
            residuals=np.full(20, size), statistics=SimpleNamespace(rank=rank), degrees_of_freedom=20 - rank
        )
        for size, rank in ((1.0, 3), (0.0, 4))
    )
    ratio, chance = f_test(smaller, larger)
    assert np.isfinite([ratio, aicc(larger)]).all()
    assert ratio > 1e6
    assert chance < 1e-6
