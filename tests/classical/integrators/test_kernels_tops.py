"""Many tops at once: the same motion as one by one, bounded energy, threads, refusals."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from rotor.classical import euler
from rotor.classical.free.free_motion import free_motion
from rotor.classical.integrators import batch
from rotor.classical.integrators._kernels import LANES, sine_cosine
from rotor.classical.integrators.method import integrate
from rotor.classical.integrators.splitting import RotationSplitting, SymmetricTopSplitting, turned_axes
from rotor.geometry.rotations import distance, normalised, rotate, uniform


def gas(n):
    rng = np.random.default_rng(11)
    return rng.uniform(0.5, 2.0, (n, 3)), rng.normal(size=(n, 3)), uniform(n, rng=rng)


def test_blocks_make_the_same_steps_as_one_body_at_a_time():
    moments, momentum, attitude = gas(2 * LANES + 5)  # a last block that is not full
    m, q = batch.propagate(moments, momentum, attitude, 0.02, 50)
    slow = integrate(SymmetricTopSplitting(0.02), moments, momentum, [0.0, 1.0], attitude)
    assert np.max(np.abs(m - slow.momentum[:, -1])) < 5e-14  # 50 steps of rounding, |L| up to 3
    assert np.max(distance(q, slow.attitude[:, -1])) < 5e-14


def test_second_order_against_the_exact_motion():
    moments, momentum, attitude = gas(300)
    exact = free_motion(moments, momentum, attitude).at(1.0)[1]
    errors = [
        np.median(distance(batch.propagate(moments, momentum, attitude, 1.0 / n, n)[1], exact)) for n in (50, 100)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.01)


def test_the_sphere_leaves_a_smaller_error_than_turns_about_three_axes():
    moments, momentum, attitude = gas(300)
    exact = free_motion(moments, momentum, attitude).at(1.0)[1]
    three = integrate(RotationSplitting(0.02), moments, momentum, [0.0, 1.0], attitude).attitude[:, -1]
    two = batch.propagate(moments, momentum, attitude, 0.02, 50)[1]
    assert np.median(distance(two, exact)) < np.median(distance(three, exact)) / 20  # measured: 47


def test_the_sphere_takes_the_middle_and_the_outer_turn_the_larger_remainder():
    rng = np.random.default_rng(4)
    inverse = rng.uniform(0.5, 2.0, (50, 3))
    outer, inner, sphere = np.take_along_axis(inverse, turned_axes(inverse), axis=-1).T
    assert np.array_equal(sphere, np.median(inverse, axis=-1))
    assert np.all(np.abs(outer - sphere) >= np.abs(inner - sphere))


@pytest.mark.parametrize(
    "moments", [[2.0, 2.0, 1.0], [1.0, 2.0, 2.0], [2.0, 1.0, 2.0], [1.5, 1.5, 1.5], [2.0, 0.0, 2.0]]
)
def test_exact_for_symmetric_tops_spheres_and_linear_rotors(moments):
    along = 0.0 if moments[1] == 0.0 else 0.7
    momentum = np.array([[0.3, along, -0.4], [-0.5, along, 0.2]])
    m, q = batch.propagate(moments, momentum, [1.0, 0, 0, 0], 0.8, 100)
    m_exact, q_exact = free_motion(moments, momentum).at(80.0)
    assert np.max(np.abs(m - m_exact)) < 1e-13  # rounding of 100 steps
    assert np.max(distance(q, q_exact)) < 1e-13


def test_invariants_over_many_steps():
    moments, momentum, attitude = gas(LANES)
    for steps in (10_000, 1_000_000):
        m, q = batch.propagate(moments, momentum, attitude, 0.02, steps)
        walk = 1e-15 * np.sqrt(steps)  # 7e-17 √steps is the spread measured, the largest of 128 is four times that
        assert np.max(np.abs(np.linalg.norm(q, axis=-1) - 1)) < walk  # a bias of 1e-17 a step would be ten times more
        assert np.max(np.abs(np.linalg.norm(m, axis=-1) / np.linalg.norm(momentum, axis=-1) - 1)) < 2 * walk
        assert np.max(np.abs(euler.energy(m, moments) / euler.energy(momentum, moments) - 1)) < 2e-4  # (h ω)², bounded
        assert np.max(np.abs(rotate(normalised(q), m) - rotate(attitude, momentum))) < 10 * walk  # |L| up to 3


def test_a_negative_step_goes_back():
    moments, momentum, attitude = gas(10)
    there = batch.propagate(moments, momentum, attitude, 0.03, 200)
    m, q = batch.propagate(moments, *there, -0.03, 200)
    assert np.max(np.abs(m - momentum)) < 1e-13
    assert np.max(distance(q, attitude)) < 1e-13


def test_threads_change_nothing():
    moments, momentum, attitude = gas(1000)
    alone = batch.propagate(moments, momentum, attitude, 0.02, 20)
    with ThreadPoolExecutor(2) as pool:
        together = batch.propagate(moments, momentum, attitude, 0.02, 20, executor=pool)
    assert np.array_equal(alone[0], together[0])
    assert np.array_equal(alone[1], together[1])


def test_no_steps_and_shared_moments():
    m, q = batch.propagate([1.0, 2.0, 3.0], [[1.0, 0.5, 0.2]], [1.0, 0, 0, 0], 0.1, 0)
    assert m.tolist() == [[1.0, 0.5, 0.2]]
    assert q.tolist() == [[1.0, 0.0, 0.0, 0.0]]


def test_polynomials_of_sine_and_cosine():
    x = np.linspace(-0.25, 0.25, 2001)
    s, c = np.array([sine_cosine(value) for value in x]).T
    assert np.max(np.abs(s - np.sin(x))) < 6e-17  # half an ulp of 0.25, and that of numpy
    assert np.max(np.abs(c - np.cos(x))) < 2.3e-16


def test_batches_refuse_long_steps_and_wrong_shapes():
    with pytest.raises(ValueError, match="shorter step"):
        batch.propagate([1.0, 2.0, 3.0], [[0.0, 0.0, 20.0]], [1.0, 0, 0, 0], 0.1, 1)
    with pytest.raises(ValueError, match="about its own axis"):
        batch.propagate([0.0, 1.0, 1.0], [[1.0, 1.0, 0.0]], [1.0, 0, 0, 0], 0.1, 1)
    with pytest.raises(ValueError, match="shape"):
        batch.propagate([1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [1.0, 0, 0, 0], 0.1, 1)
    with pytest.raises(ValueError, match="negative step"):
        batch.propagate([1.0, 1.0, 1.0], [[1.0, 0.0, 0.0]], [1.0, 0, 0, 0], 0.1, -1)
