"""Euler's equations: what they conserve, the ellipsoids, linear rotors, refusals."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from rotor.classical import euler
from rotor.geometry.rotations import IDENTITY, exp, rotate, uniform

moments3 = arrays(np.float64, 3, elements=st.floats(0.1, 10.0))
vectors = arrays(np.float64, 3, elements=st.floats(-5.0, 5.0, allow_subnormal=False))


@given(moments3, vectors)
def test_free_rates_keep_momentum_and_energy(moments, momentum):
    rate = euler.momentum_rate(momentum, moments)
    omega = euler.angular_velocity(momentum, moments)
    scale = 1.0 + np.sum(momentum**2) * np.max(np.abs(omega))
    assert abs(rate @ momentum) < 1e-15 * scale * 8  # d|L|²/dt = 2 L·dL/dt: rounding of three products
    assert abs(rate @ omega) < 1e-15 * 8 * (1.0 + np.sum(omega**2) * np.max(np.abs(momentum)))  # dE/dt = ω·dL/dt


@given(moments3, vectors)
def test_matches_euler_in_omega(moments, momentum):
    w, (i1, i2, i3) = euler.angular_velocity(momentum, moments), moments
    textbook = np.array([(i2 - i3) * w[1] * w[2], (i3 - i1) * w[2] * w[0], (i1 - i2) * w[0] * w[1]])
    scale = np.max(np.abs(momentum)) * np.max(np.abs(w))
    assert np.allclose(euler.momentum_rate(momentum, moments), textbook, atol=4e-15 * scale)  # difference of products


def test_momentum_stays_put_in_space_without_torque():
    rng = np.random.default_rng(4)
    q, m = uniform(50, rng=rng), rng.normal(size=(50, 3))
    moments = np.array([1.0, 2.0, 2.5])
    h = 1e-5
    dm, dq = euler.momentum_rate(m, moments), euler.attitude_rate(q, euler.angular_velocity(m, moments))
    moved = rotate(q + h * dq, m + h * dm) - rotate(q - h * dq, m - h * dm)
    assert np.max(np.abs(moved / (2 * h))) < 1e-8  # central difference: h² |ω|³|m| and eps/h


def test_torque_changes_the_rate_by_itself():
    free = euler.momentum_rate([1.0, 2.0, 3.0], [1.0, 2.0, 4.0])
    assert np.array_equal(euler.momentum_rate([1.0, 2.0, 3.0], [1.0, 2.0, 4.0], [0.5, 0.0, -1.0]) - free, [0.5, 0, -1])


def test_attitude_rate_is_the_derivative_of_exp():
    omega = np.array([0.3, -0.2, 0.9])
    h = 1e-6
    difference = (exp(h * omega) - exp(-h * omega)) / (2 * h)
    assert np.allclose(euler.attitude_rate(IDENTITY, omega), difference, atol=1e-10)  # eps/h


def test_linear_rotor_is_never_divided_by_zero():
    moments, momentum = np.array([0.0, 2.0, 2.0]), np.array([0.0, 1.0, 3.0])
    assert np.array_equal(euler.momentum_rate(momentum, moments), np.zeros(3))
    assert euler.energy(momentum, moments) == 2.5
    assert np.array_equal(euler.poinsot_semiaxes(moments, 2.5), [np.inf, np.sqrt(2.5), np.sqrt(2.5)])


def test_polhode_lies_on_both_ellipsoids():
    moments, momentum = np.array([1.0, 2.0, 2.5]), np.array([0.4, -1.0, 0.7])
    conserved = euler.invariants(momentum, exp([0.1, 0.2, 0.3]), moments)
    omega = euler.angular_velocity(momentum, moments)
    for semiaxes in (
        euler.poinsot_semiaxes(moments, conserved.energy),
        euler.momentum_semiaxes(moments, conserved.momentum),
    ):
        assert np.sum((omega / semiaxes) ** 2) == pytest.approx(1.0, abs=1e-15)  # a point of the ellipsoid
    on_binet = momentum / euler.binet_semiaxes(moments, conserved.energy)
    assert np.sum(on_binet**2) == pytest.approx(1.0, abs=1e-15)


def test_poinsot_plane_stands_at_a_fixed_distance():
    moments, momentum = np.array([1.0, 2.0, 2.5]), np.array([0.4, -1.0, 0.7])
    conserved = euler.invariants(momentum, IDENTITY, moments)
    omega = euler.angular_velocity(momentum, moments)
    # the normal of the ellipsoid at ω is along I ω = L, so the tangent plane is normal to L, at 2E/|L|
    assert omega @ momentum / conserved.momentum == pytest.approx(2 * conserved.energy / conserved.momentum, rel=1e-15)


@pytest.mark.parametrize(
    ("moments", "momentum", "message"),
    [
        ([1.0, 2.0], [1.0, 0.0, 0.0], r"shape \(\.\.\., 3\)"),
        ([1.0, -2.0, 2.0], [1.0, 0.0, 0.0], "not negative"),
        ([1.0, np.nan, 2.0], [1.0, 0.0, 0.0], "finite"),
        ([0.0, 0.0, 2.0], [0.0, 0.0, 1.0], "a point has no rotation"),
        ([0.0, 1.0, 2.0], [0.0, 1.0, 1.0], r"\(0, I, I\)"),
        ([0.0, 2.0, 2.0], [0.1, 1.0, 1.0], "no angular momentum about its own axis"),
        ([1.0, 2.0, 2.0], [np.inf, 1.0, 1.0], "not finite"),
        ([1.0, 2.0, 2.0], [1.0, 1.0], r"shape \(\.\.\., 3\)"),
    ],
)
def test_bad_input_is_named(moments, momentum, message):
    with pytest.raises(ValueError, match=message):
        euler.momentum_rate(momentum, moments)
