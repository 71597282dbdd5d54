"""Poses, twists and wrenches: group laws, the adjoint, power in every frame, screws by brute force."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.linalg import expm

from rotor.geometry import rigid_motions as twists
from rotor.geometry.rotations import conjugate, distance, exp, normalised, rotate, to_matrix

numbers = st.floats(-2.0, 2.0, allow_subnormal=False)
vectors = arrays(np.float64, 3, elements=numbers)
sixes = arrays(np.float64, 6, elements=numbers)
quaternions = arrays(np.float64, 4, elements=numbers).filter(lambda q: np.linalg.norm(q) > 0.1).map(normalised)


@given(quaternions, vectors, quaternions, vectors, vectors)
def test_poses_compose_as_they_act(q1, p1, q2, p2, x):
    q, p = twists.compose(q1, p1, q2, p2)
    assert np.allclose(rotate(q, x) + p, rotate(q1, rotate(q2, x) + p2) + p1, atol=1e-14)  # some 40 roundings of 6


@given(quaternions, vectors, quaternions, vectors)
def test_adjoint_is_a_representation(q1, p1, q2, p2):
    both = twists.adjoint(*twists.compose(q1, p1, q2, p2))
    assert np.allclose(both, twists.adjoint(q1, p1) @ twists.adjoint(q2, p2), atol=2e-14)


@given(quaternions, vectors, sixes, sixes)
def test_twist_and_wrench_follow_the_adjoint_and_keep_the_power(q, p, twist, wrench):
    ad = twists.adjoint(q, p)
    moved, pushed = twists.twist_to_space(twist, q, p), twists.wrench_to_space(wrench, q, p)
    assert np.allclose(moved, ad @ twist, atol=1e-14)
    assert np.allclose(ad.T @ pushed, wrench, atol=4e-14)  # wrenches move by the inverse transpose
    assert twists.power(moved, pushed) == pytest.approx(float(twists.power(twist, wrench)), abs=1e-13)


@given(sixes)
def test_screw_against_the_matrix_exponential(twist):
    generator = np.zeros((4, 4))
    generator[:3, :3], generator[:3, 3] = np.cross(twist[:3], np.eye(3)).T, twist[3:]
    pose = expm(generator)
    q, p = twists.twist_exp(twist)
    assert np.allclose(to_matrix(q), pose[:3, :3], atol=1e-13)  # expm's own rounding
    assert np.allclose(p, pose[:3, 3], atol=1e-13)


@pytest.mark.parametrize("angle", [0.0, 1e-200, 1e-8, 1e-3, 0.5, 0.999999, 1.000001, 1.999999, 2.000001, 3.0, 3.1415])
def test_log_undoes_exp_at_every_angle(angle):
    twist = np.concatenate([angle * np.array([2.0, -3.0, 6.0]) / 7.0, [1.0, -2.0, 0.5]])
    assert np.allclose(twists.twist_log(*twists.twist_exp(twist)), twist, rtol=1e-13, atol=1e-15)


def test_small_twists_keep_their_digits():
    twist = np.array([1e-8, 0.0, 0.0, 0.0, 1.0, 0.0])
    _, p = twists.twist_exp(twist)
    assert p[2] == pytest.approx(0.5e-8, rel=1e-15)  # half the angle; 1 - cos θ in plain form is zero


def test_velocity_of_a_moving_pose_is_its_space_twist():
    body, h = np.array([0.3, -0.5, 0.2, 1.0, 0.4, -0.7]), 1e-6
    q, p = exp([0.5, 0.1, -0.2]), np.array([1.0, 2.0, -0.5])
    ahead, behind = (twists.compose(q, p, *twists.twist_exp(s * h * body)) for s in (1.0, -1.0))
    space = twists.twist_to_space(body, q, p)
    rate = (ahead[1] - behind[1]) / (2 * h)
    assert np.allclose(rate, space[3:] + np.cross(space[:3], p), atol=1e-9)  # v at the origin of space, carried to p
    assert distance(ahead[0], behind[0]) / (2 * h) == pytest.approx(np.linalg.norm(body[:3]), rel=1e-9)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: twists.power([1, 2, 3], [1, 2, 3]), r"\(\.\.\., 6\)"),
        (lambda: twists.adjoint([1, 0, 0, 0], [1, 2]), r"\(\.\.\., 3\)"),
        (lambda: twists.twist_log(conjugate([0, 0, 0, 0]), [1, 2, 3]), "zero or undefined length"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()
