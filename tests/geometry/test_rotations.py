"""Quaternions: group laws, corners of exp and log, matrices, Euler angles, uniform sampling."""

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats
from scipy.spatial.transform import Rotation

from rotor.geometry import rotations as rot
from rotor.geometry.quaternions import to_third

EPS = np.finfo(float).eps

components = st.floats(-1.0, 1.0, allow_subnormal=False)
quaternions = arrays(np.float64, 4, elements=components).filter(lambda q: np.linalg.norm(q) > 1e-3).map(rot.normalised)
vectors = arrays(np.float64, 3, elements=st.floats(-10.0, 10.0, allow_subnormal=False))


@given(quaternions, quaternions, quaternions)
def test_group_laws(p, q, r):
    associated = rot.multiply(rot.multiply(p, q), r) - rot.multiply(p, rot.multiply(q, r))
    assert np.max(np.abs(associated)) < 16 * EPS  # two products of unit quaternions, four roundings an entry
    assert np.allclose(rot.multiply(q, rot.conjugate(q)), rot.IDENTITY, atol=8 * EPS)  # one product
    assert rot.distance(rot.multiply(p, q), rot.multiply(p, r)) == pytest.approx(rot.distance(q, r), abs=64 * EPS)


@given(quaternions, quaternions, vectors)
def test_rotations_compose_and_agree_with_matrices(p, q, v):
    size = 1.0 + np.max(np.abs(v))
    by_turns = rot.rotate(p, rot.rotate(q, v))
    assert np.allclose(rot.rotate(rot.multiply(p, q), v), by_turns, atol=64 * EPS * size)  # some 30 roundings each
    assert np.allclose(rot.to_matrix(q) @ v, rot.rotate(q, v), atol=32 * EPS * size)  # some 15 roundings each
    assert np.linalg.norm(by_turns) == pytest.approx(np.linalg.norm(v), abs=32 * EPS * size)  # lengths are kept


@given(quaternions)
def test_matrix_there_and_back(q):
    matrix = rot.to_matrix(q)
    assert np.linalg.det(matrix) == pytest.approx(1.0, abs=32 * EPS)  # products of 9 rounded entries
    assert rot.distance(rot.from_matrix(matrix), q) < 32 * EPS  # the row of the largest diagonal never cancels
    assert np.allclose(matrix, Rotation.from_quat(rot.to_scalar_last(q)).as_matrix(), atol=8 * EPS)  # same convention


@given(vectors.filter(lambda v: 0.0 < np.linalg.norm(v) < np.pi))
def test_log_undoes_exp(v):
    assert np.allclose(rot.log(rot.exp(v)), v, rtol=8 * EPS, atol=8 * EPS * np.linalg.norm(v))  # relative to |v|


@pytest.mark.parametrize("angle", [1e-300, 1e-160, 1e-20, 1e-8, 1.0, np.pi - 1e-8, np.pi - 1e-15, np.pi])
def test_exp_and_log_against_50_digits(angle):
    axis = np.array([2.0, -3.0, 6.0]) / 7.0
    vector = angle * axis
    with mpmath.workdps(50):
        half = mpmath.norm([mpmath.mpf(x) for x in vector.tolist()]) / 2
        truth = [float(mpmath.cos(half))] + [
            float(mpmath.mpf(x) * mpmath.sin(half) / half / 2) for x in vector.tolist()
        ]
    assert np.allclose(rot.exp(vector), truth, rtol=4 * EPS, atol=2 * EPS * (angle > 1))  # cos π/2 rounds at 1e-16
    assert np.allclose(rot.log(rot.exp(vector)), vector, rtol=8 * EPS, atol=0.0)  # relative, down to 1e-300


def test_small_rotations_are_not_lost_as_by_an_arc_cosine():
    q = rot.exp([1e-8, 0.0, 0.0])
    assert rot.log(q)[0] == pytest.approx(1e-8, rel=4 * EPS)  # one sine, one arc tangent
    assert 2 * np.arccos(q[0]) == 0.0  # what the textbook formula makes of it
    assert rot.distance(rot.exp([0.7, 0, 0]), rot.exp([0.7 + 1e-8, 0, 0])) == pytest.approx(1e-8, abs=4 * EPS)


def test_half_turn_keeps_its_axis():
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    assert np.allclose(rot.log(np.concatenate([[0.0], axis])), np.pi * axis, rtol=4 * EPS)  # one arc tangent
    assert np.allclose(
        rot.log(np.concatenate([[0.0], -axis])), -np.pi * axis, rtol=4 * EPS
    )  # the other sign serves too


@given(quaternions, quaternions)
def test_double_cover(p, q):
    assert rot.distance(p, -p) < 4 * EPS  # rounding of one product
    assert rot.distance(p, q) == pytest.approx(rot.distance(-p, q), abs=1e-15)  # the same product but for the sign
    overlap = abs(np.dot(p, q))
    assert np.cos(rot.distance(p, q) / 2) == pytest.approx(min(overlap, 1.0), abs=8 * EPS)  # misorientation


@given(quaternions, quaternions, st.floats(0.0, 1.0))
def test_slerp_divides_the_angle(p, q, f):
    whole = rot.distance(p, q)
    part = rot.slerp(p, q, f)
    assert rot.distance(p, part) == pytest.approx(f * whole, abs=32 * EPS)  # three products and an exp
    assert rot.distance(part, q) == pytest.approx((1 - f) * whole, abs=32 * EPS)  # the rest of the same great circle


def test_continuous_path_of_a_body_turning_twice():
    turns = np.linspace(0.0, 4 * np.pi, 101)
    path = rot.exp(turns[:, None] * np.array([0.0, 0.6, 0.8]))
    scrambled = path * np.random.default_rng(5).choice([-1.0, 1.0], size=(101, 1))
    mended = rot.continuous(scrambled)
    assert np.allclose(mended * np.sign(scrambled[0, 0]), path, atol=0.0)  # only signs were changed


@given(st.floats(-3.1, 3.1), st.floats(1e-3, 3.14), st.floats(-3.1, 3.1))
def test_euler_angles_there_and_back(phi, theta, chi):
    q = rot.from_euler(phi, theta, chi)
    angles = rot.to_euler(q)
    assert not angles.at_pole
    # near the pole phi and chi are known to EPS/sin(theta) each
    worst = 16 * EPS / np.sin(theta)
    assert [angles.phi, angles.theta, angles.chi] == pytest.approx([phi, theta, chi], abs=worst)
    parts = rot.multiply(rot.exp([0, 0, phi]), rot.multiply(rot.exp([0, theta, 0]), rot.exp([0, 0, chi])))
    assert rot.distance(parts, q) < 16 * EPS  # R_z R_y R_z, as defined


@pytest.mark.parametrize("theta", [0.0, np.pi, 1e-12, np.pi - 1e-12])
def test_gimbal_lock_is_said_and_loses_nothing(theta):
    q = rot.from_euler(0.4, theta, 0.3)
    angles = rot.to_euler(q)
    assert angles.at_pole
    assert rot.distance(rot.from_euler(angles.phi, angles.theta, angles.chi), q) < 16 * EPS  # the same orientation


def test_at_the_pole_chi_is_zero_and_phi_carries_the_turn():
    up = rot.to_euler(rot.exp([0.0, 0.0, 0.7]))
    down = rot.to_euler([0.0, np.sin(0.2), np.cos(0.2), 0.0])
    assert (up.phi, up.theta, up.chi) == (pytest.approx(0.7, abs=EPS), 0.0, 0.0)
    assert (down.phi, down.theta, down.chi) == (pytest.approx(-0.4, abs=EPS), np.pi, 0.0)  # phi - chi = -0.4


def test_corrupted_matrix_is_refused_and_its_nearest_rotation_found():
    truth = rot.to_matrix(rot.exp([0.3, -1.1, 2.0]))
    noise = 1e-3 * np.random.default_rng(2).standard_normal((3, 3))
    with pytest.raises(ValueError, match=r"nearest_rotation\(\) gives the nearest"):
        rot.from_matrix(truth + noise)
    mended = rot.nearest_rotation(truth + noise)
    assert mended.distance_from_input == pytest.approx(np.linalg.norm(truth + noise - mended.rotation), rel=1e-12)
    assert mended.distance_from_input <= np.linalg.norm(noise)  # nearest: at least as near as the one we started from
    assert bool(mended.unique)
    assert np.linalg.norm(mended.rotation - truth) < 2 * np.linalg.norm(noise)  # triangle inequality
    assert rot.distance(rot.from_matrix(mended.rotation), rot.from_matrix(truth)) < 5e-3  # noise of 1e-3 an entry


def test_reflection_is_refused_and_its_nearest_rotation_is_not_unique():
    with pytest.raises(ValueError, match="reflection"):
        rot.from_matrix(np.diag([1.0, 1.0, -1.0]))
    mended = rot.nearest_rotation(-np.eye(3))
    assert np.linalg.det(mended.rotation) == pytest.approx(1.0, abs=8 * EPS)
    assert not mended.unique
    assert mended.distance_from_input == pytest.approx(2.0, rel=1e-14)  # one axis is wrong by 2


def test_uniform_sampling_has_the_angle_law_of_the_haar_measure():
    q = rot.uniform(4000, rng=np.random.default_rng(11))
    angles = rot.distance(rot.IDENTITY, q)
    law = stats.ks_1samp(angles, lambda a: (a - np.sin(a)) / np.pi)  # density (1 - cos a)/π on [0, π]
    assert law.pvalue > 0.01  # fixed seed
    heights = rot.rotate(q, [0.0, 0.0, 1.0])[:, 2]
    assert stats.ks_1samp(heights, lambda z: (z + 1) / 2).pvalue > 0.01  # axes uniform on the sphere


def test_shapes_broadcast():
    q = rot.uniform((5, 1), rng=np.random.default_rng(3))
    assert rot.multiply(q, rot.uniform(7, rng=np.random.default_rng(4))).shape == (5, 7, 4)
    assert rot.rotate(q, np.ones((7, 3))).shape == (5, 7, 3)
    assert rot.to_matrix(q).shape == (5, 1, 3, 3)
    assert rot.from_matrix(rot.to_matrix(q)).shape == (5, 1, 4)
    assert rot.to_euler(q).theta.shape == (5, 1)
    assert rot.uniform(rng=np.random.default_rng(0)).shape == (4,)


def test_scipy_order_at_the_door():
    q = rot.uniform(10, rng=np.random.default_rng(6))
    ours = rot.rotate(q, [1.0, 2.0, 3.0])
    theirs = Rotation.from_quat(rot.to_scalar_last(q)).apply([1.0, 2.0, 3.0])
    assert np.allclose(ours, theirs, atol=32 * EPS)  # numbers of size 4
    assert np.array_equal(rot.from_scalar_last(rot.to_scalar_last(q)), q)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: rot.multiply([1, 2, 3], [1, 0, 0, 0]), r"shape \(\.\.\., 4\)"),
        (lambda: rot.rotate([1, 0, 0, 0], [1, 2]), r"shape \(\.\.\., 3\)"),
        (lambda: rot.to_matrix([0, 0, 0, 0]), "zero or undefined length"),
        (lambda: rot.log([np.nan, 0, 0, 0]), "zero or undefined length"),
        (lambda: rot.from_matrix(np.eye(2)), "3, 3"),
        (lambda: rot.from_matrix(np.full((3, 3), np.nan)), "not finite"),
        (lambda: rot.continuous([1, 0, 0, 0]), "path"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize("size", [1e-8, 1e-100, 1e-154, 1e-160, 1e-200, 1e-290])
def test_log_gives_back_the_smallest_rotation_vectors_in_any_direction(size):
    vectors = size * np.random.default_rng(8).normal(size=(2000, 3))
    assert np.allclose(
        rot.log(rot.exp(vectors)), vectors, rtol=4e-16, atol=0.0
    )  # two roundings; subnormal numbers begin at 1e-308


def test_log_scales_with_the_vector_where_squares_underflow():
    assert rot.log(rot.exp([3e-160, 4e-160, 0.0])).tolist() == pytest.approx([3e-160, 4e-160, 0.0], rel=4e-16, abs=0.0)


def test_every_direction_is_turned_to_the_third_axis():
    directions = np.random.default_rng(5).normal(size=(40, 3))
    for direction in directions / np.linalg.norm(directions, axis=1)[:, None]:
        q = np.array(to_third(tuple(direction.tolist())))
        assert np.linalg.norm(q) == pytest.approx(1.0, abs=1e-15)
        assert rot.rotate(q, direction) == pytest.approx(np.array([0.0, 0.0, 1.0]), abs=1e-15)
