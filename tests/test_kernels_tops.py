"""Many tops at once: the same motion as one by one, bounded energy, threads, refusals."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from rotor.classical import euler, many
from rotor.classical._kernels import LANES, _sine_cosine
from rotor.classical.free import free_motion
from rotor.classical.integrators import integrate
from rotor.classical.splitting import RotationSplitting
from rotor.rotations import distance, rotate, uniform


def gas(n):
    rng = np.random.default_rng(11)
    return rng.uniform(0.5, 2.0, (n, 3)), rng.normal(size=(n, 3)), uniform(n, rng=rng)


def test_blocks_make_the_same_steps_as_one_body_at_a_time():
    moments, momentum, attitude = gas(2 * LANES + 5)  # a last block that is not full
    m, q = many.advance(moments, momentum, attitude, 0.02, 50)
    slow = integrate(RotationSplitting(0.02), moments, momentum, [0.0, 1.0], attitude)
    assert np.max(np.abs(m - slow.momentum[:, -1])) < 1e-13  # 50 steps of rounding
    assert np.max(distance(q, slow.attitude[:, -1])) < 1e-13


def test_second_order_against_the_exact_motion():
    moments, momentum, attitude = gas(300)
    exact = free_motion(moments, momentum, attitude).at(1.0)[1]
    errors = [np.median(distance(many.advance(moments, momentum, attitude, 1.0 / n, n)[1], exact)) for n in (50, 100)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.01)


def test_invariants_over_many_steps():
    moments, momentum, attitude = gas(LANES)
    m, q = many.advance(moments, momentum, attitude, 0.02, 100_000)
    assert np.max(np.abs(np.linalg.norm(m, axis=-1) / np.linalg.norm(momentum, axis=-1) - 1)) < 1e-11  # 1e-16 a step
    assert np.max(np.abs(np.linalg.norm(q, axis=-1) - 1)) < 1e-11
    assert np.max(np.abs(euler.energy(m, moments) / euler.energy(momentum, moments) - 1)) < 5e-3  # (h ω)², bounded
    in_space = rotate(q, m)
    assert np.max(np.abs(in_space - rotate(attitude, momentum))) < 1e-10  # rounding of 100 000 steps


def test_a_negative_step_goes_back():
    moments, momentum, attitude = gas(10)
    there = many.advance(moments, momentum, attitude, 0.03, 200)
    m, q = many.advance(moments, *there, -0.03, 200)
    assert np.max(np.abs(m - momentum)) < 1e-13
    assert np.max(distance(q, attitude)) < 1e-13


def test_threads_change_nothing():
    moments, momentum, attitude = gas(1000)
    alone = many.advance(moments, momentum, attitude, 0.02, 20)
    with ThreadPoolExecutor(2) as pool:
        together = many.advance(moments, momentum, attitude, 0.02, 20, executor=pool)
    assert np.array_equal(alone[0], together[0])
    assert np.array_equal(alone[1], together[1])


def test_no_steps_and_shared_moments():
    m, q = many.advance([1.0, 2.0, 3.0], [[1.0, 0.5, 0.2]], [1.0, 0, 0, 0], 0.1, 0)
    assert m.tolist() == [[1.0, 0.5, 0.2]]
    assert q.tolist() == [[1.0, 0.0, 0.0, 0.0]]


def test_polynomials_of_sine_and_cosine():
    x = np.linspace(-0.25, 0.25, 2001)
    s, c = np.array([_sine_cosine(value) for value in x]).T
    assert np.max(np.abs(s - np.sin(x))) < 6e-17  # half an ulp of 0.25, and that of numpy
    assert np.max(np.abs(c - np.cos(x))) < 2.3e-16


def test_refusals():
    with pytest.raises(ValueError, match="shorter step"):
        many.advance([1.0, 1.0, 1.0], [[10.0, 0.0, 0.0]], [1.0, 0, 0, 0], 0.1, 1)
    with pytest.raises(ValueError, match="linear rotors"):
        many.advance([0.0, 1.0, 1.0], [[0.0, 1.0, 0.0]], [1.0, 0, 0, 0], 0.1, 1)
    with pytest.raises(ValueError, match="shape"):
        many.advance([1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [1.0, 0, 0, 0], 0.1, 1)
    with pytest.raises(ValueError, match="negative step"):
        many.advance([1.0, 1.0, 1.0], [[1.0, 0.0, 0.0]], [1.0, 0, 0, 0], 0.1, -1)
