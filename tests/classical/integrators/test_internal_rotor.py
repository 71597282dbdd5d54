"""A top that turns in a body over a barrier: against Lagrange's equations, the gyrostat, the rigid body, a pendulum and a gas."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from rotor.classical.effects.gyrostat import SpinningRotor
from rotor.classical.integrators.lie_runge_kutta import LieRungeKutta
from rotor.classical.integrators.method import integrate
from rotor.classical.internal_rotor import TurningTop, turning_motion
from rotor.geometry.rotations import rotate

BODY = TurningTop([8.0, 40.0, 44.0], [0.9, 0.4, 0.1], 3.0, {3: 6.0, 6: -0.5})
START = np.array([4.0, 9.0, -5.0]), 9.0, 0.3


def lagrange(body, momentum, p, angle, times):
    """L, α and α' from d/dt (∂T/∂ω, ∂T/∂α') with the 4 x 4 matrix of T, in body axes."""
    inertia = np.zeros((4, 4))
    inertia[:3, :3] = np.diag(body.moments)
    inertia[:3, 3] = inertia[3, :3] = body.top_moment * np.asarray(body.axis)
    inertia[3, 3] = body.top_moment

    def rate(_, y):
        velocity = np.linalg.solve(inertia, y[:4])
        slope = sum(0.5 * n * v * np.sin(n * y[4]) for n, v in body.barriers.items())
        return [*np.cross(y[:3], velocity[:3]), -slope, velocity[3]]

    solution = solve_ivp(rate, (times[0], times[-1]), [*momentum, p, angle], "DOP853", times, rtol=1e-12, atol=1e-12)
    return solution.y.T


def test_the_motion_is_that_of_lagranges_equations():
    times = np.linspace(0, 8, 5)
    expected = lagrange(BODY, *START, times)
    errors = []
    for step in (0.04, 0.02):
        motion = turning_motion(BODY, *START, times, step)
        path = np.column_stack([motion.momentum[:, 0], motion.p[:, 0], motion.angle[:, 0]])
        errors.append(np.abs(path - expected).max())
    assert errors[1] < 0.1
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.3)  # order 2
    assert np.ptp(expected[:, 4]) > 2 * np.pi / 3  # over the barrier


def test_energy_stays_within_the_step_and_momentum_in_space():
    times = np.linspace(0, 60, 61)
    swings = []
    for step in (0.04, 0.02):
        motion = turning_motion(BODY, *START, times, step)
        swings.append(np.ptp(motion.energy))
        assert np.abs(motion.momentum_in_space - motion.momentum_in_space[0]).max() < 1e-11
    assert swings[0] / swings[1] == pytest.approx(4.0, abs=0.5)
    early, late = motion.energy[:30].mean(), motion.energy[30:].mean()
    assert abs(late - early) < 0.3 * swings[1]  # bounded, without drift


def test_without_a_barrier_it_is_the_gyrostat():
    free = TurningTop(BODY.moments, BODY.axis, BODY.top_moment)
    times = np.linspace(0, 10, 6)
    motion = turning_motion(free, *START, times, 0.01)
    assert np.ptp(motion.p) == 0
    axis = free.rest_axes.T @ free.axis
    gyrostat = integrate(
        LieRungeKutta(1e-12),
        free.rest_moments,
        free.rest_axes.T @ START[0],
        times,
        effects=[SpinningRotor(START[1] * axis)],
    )
    assert np.abs(motion.momentum[:, 0] @ free.rest_axes - gyrostat.momentum).max() < 1e-3
    seen = rotate(
        motion.attitude[:, 0], np.broadcast_to(free.rest_axes[:, 0], (6, 3))
    )  # the same material axis in space
    start = free.rest_axes  # the gyrostat began with its own axes along those of space
    expected = rotate(gyrostat.attitude, np.broadcast_to([1.0, 0.0, 0.0], (6, 3))) @ start.T
    assert np.abs(seen - expected).max() < 1e-3


def test_behind_a_high_barrier_the_body_is_rigid():
    times = np.linspace(0, 4, 3)
    momentum = START[0]
    rigid = integrate(LieRungeKutta(1e-12), BODY.moments, momentum, times).momentum
    errors = []
    for barrier in (1e3, 1.6e4):
        stiff = TurningTop(BODY.moments, BODY.axis, BODY.top_moment, {3: barrier})
        p = stiff.top_moment * float(stiff.axis @ (momentum / stiff.moments))  # α' = 0
        motion = turning_motion(stiff, momentum, p, 0.0, times, 0.3 / np.sqrt(barrier))
        errors.append(np.abs(motion.momentum[:, 0] - rigid).max())
    assert errors[0] < 0.05
    assert errors[1] < errors[0] / 8  # falls as 1/V


def test_without_rotation_it_is_a_pendulum():
    body = TurningTop(BODY.moments, BODY.axis, BODY.top_moment, {3: 6.0})
    amplitude = 0.9  # of 3α, radian
    times = np.linspace(0, 12, 601)
    motion = turning_motion(body, np.zeros(3), 0.0, amplitude / 3, times, 0.02)
    angle = motion.angle[:, 0]
    falls = np.flatnonzero((angle[:-1] > 0) & (angle[1:] <= 0))
    crossings = times[falls] + (times[1] - times[0]) * angle[falls] / (angle[falls] - angle[falls + 1])
    exact = 4 * ellipk(np.sin(amplitude / 2) ** 2) / np.sqrt(4.5 * 6.0 / body.reduced_moment)  # V'' = 9 V3/2
    assert np.diff(crossings).mean() == pytest.approx(exact, rel=3e-4)


def test_equipartition_in_a_gas_stays():
    """⟨p ∂H/∂p⟩ = ⟨L_i ω_i⟩ = kT of a thermal gas at every time; a gas with tops at rest is no equilibrium."""
    kt, rng = 4.0, np.random.default_rng(5)
    momentum, p, angle = BODY.thermal(kt, 4000, rng=rng)
    times = np.array([0.0, 2.0, 4.0])
    motion = turning_motion(BODY, momentum, p, angle, times, 0.05)
    slip = motion.p * BODY.angle_rate(motion.momentum, motion.p)
    error = slip.std(axis=1) / np.sqrt(4000)
    assert (np.abs(slip.mean(axis=1) - kt) < 4 * error).all()
    assert (np.abs(motion.energy.mean(axis=1) - motion.energy.mean()) < 0.02).all()
    cold = turning_motion(BODY, momentum, np.zeros(4000), angle, times, 0.05)
    warm = cold.p * BODY.angle_rate(cold.momentum, cold.p)
    assert warm.mean(axis=1)[0] == 0.0
    assert warm.mean(axis=1)[1] > 0.2 * kt  # the rotation drives the tops


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"axis": [0, 0, 0]}, "axis of a top"),
        ({"top_moment": 9.0}, "leaves the rest"),
        ({"barriers": {0: 1.0}}, "counted from"),
    ],
)
def test_bodies_that_cannot_be_are_refused(change, text):
    settings = {"moments": [8.0, 40.0, 44.0], "axis": [1.0, 0, 0], "top_moment": 3.0, "barriers": {3: 1.0}} | change
    with pytest.raises(ValueError, match=text):
        TurningTop(**settings)
