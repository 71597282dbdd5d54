"""Best fit of point clouds, polar decomposition, flow gradients: recovered rotations, planar and mirrored clouds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from rotor.geometry.rotations import distance, exp, from_matrix, rotate, to_matrix, to_scalar_last, uniform
from rotor.geometry.superposition import flow_gradient, polar, superpose

EPS = np.finfo(float).eps

turns = arrays(np.float64, 3, elements=st.floats(-1.7, 1.7)).filter(lambda v: np.linalg.norm(v) < 3.1)
seeds = st.integers(0, 10**6)


@given(turns, seeds)
def test_recovers_the_rotation_of_a_cloud(turn, seed):
    rng = np.random.default_rng(seed)
    cloud, shift = rng.normal(size=(8, 3)), rng.normal(size=3)
    fit = superpose(cloud, rotate(exp(turn), cloud) + shift, weights=rng.uniform(0.5, 2.0, 8))
    assert distance(fit.quaternion, exp(turn)) < 1e-13  # the covariance of eight points is well conditioned
    assert np.allclose(fit.translation, shift, atol=1e-13)
    assert fit.rmsd < 3e-14  # rounding of coordinates of size 5, once for the turn and once for the shift
    assert np.allclose(fit.apply(cloud), rotate(exp(turn), cloud) + shift, atol=1e-13)


@given(turns, seeds)
def test_planar_cloud_gives_a_proper_rotation(turn, seed):
    rng = np.random.default_rng(seed)
    cloud = rng.normal(size=(6, 3)) * [1.0, 1.0, 0.0]
    fit = superpose(cloud, rotate(exp(turn), cloud))
    assert np.linalg.det(fit.rotation) == pytest.approx(1.0, abs=16 * EPS)
    assert fit.rmsd < 3e-14  # rounding of coordinates of size 3
    if fit.unique:
        assert distance(fit.quaternion, exp(turn)) < 1e-8  # six points may lie nearly on a line


@given(seeds)
def test_mirrored_cloud_gives_the_best_proper_rotation(seed):
    rng = np.random.default_rng(seed)
    cloud = rng.normal(size=(7, 3)) * [1.0, 2.0, 3.0]
    fit = superpose(cloud, cloud * [1.0, 1.0, -1.0])
    assert np.linalg.det(fit.rotation) == pytest.approx(1.0, abs=16 * EPS)
    centred = cloud - cloud.mean(axis=0)
    for other in to_matrix(uniform(200, rng=rng)):  # no rotation drawn at random does better
        rest = centred @ other.T - centred * [1.0, 1.0, -1.0]
        assert fit.rmsd <= np.sqrt(np.mean(np.sum(rest**2, axis=-1))) + 1e-12


def test_agrees_with_scipy_on_noisy_clouds():
    rng = np.random.default_rng(8)
    for _ in range(20):
        cloud, weights = rng.normal(size=(10, 3)), rng.uniform(0.1, 1.0, 10)
        target = rotate(uniform(rng=rng), cloud) + 0.1 * rng.normal(size=(10, 3))
        fit = superpose(cloud, target, weights)
        x0, y0 = np.average(cloud, axis=0, weights=weights), np.average(target, axis=0, weights=weights)
        theirs, rssd = Rotation.align_vectors(target - y0, cloud - x0, weights=weights)
        assert np.allclose(to_scalar_last(fit.quaternion), theirs.as_quat(canonical=True), atol=1e-12)
        assert fit.rmsd * np.sqrt(weights.sum()) == pytest.approx(rssd, rel=1e-7)  # scipy forms a difference of squares


def test_weights_decide_who_is_met():
    cloud = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]])
    target = cloud.copy()
    target[3] = [-5.0, 2.0, 1.0]
    fit = superpose(cloud, target, weights=[1.0, 1.0, 1.0, 0.0])
    assert fit.rmsd < 1e-15
    assert superpose(cloud, target).rmsd > 1.0


def test_points_on_a_line_fit_and_say_that_the_turn_is_open():
    line = np.outer(np.arange(4.0), [1.0, 2.0, -1.0])
    fit = superpose(line, rotate(exp([0.3, 0.2, 1.0]), line))
    assert fit.rmsd < 1e-14
    assert not fit.unique
    single = superpose([[1.0, 2.0, 3.0]], [[0.0, 0.0, 1.0]])
    assert np.allclose(single.apply([[1.0, 2.0, 3.0]]), [[0.0, 0.0, 1.0]])
    assert not single.unique


def test_mirrored_cross_fits_two_ways_and_says_so():
    cross = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 2, 0], [0, -2, 0], [0, 0, 1], [0, 0, -1]])
    assert superpose(cross, cross).unique
    fit = superpose(cross, cross * [1.0, 1.0, -1.0] + [0, 0, 0])  # the same cross: points 5 and 6 change places
    assert not fit.unique  # x or z may be the one given up
    assert fit.rmsd == pytest.approx(np.sqrt(8 / 6), rel=1e-14)  # two points at a distance of 2


def test_many_clouds_at_once():
    rng = np.random.default_rng(1)
    cloud, q = rng.normal(size=(5, 3)), uniform((4, 3), rng=rng)
    fit = superpose(cloud, rotate(q[..., None, :], cloud))
    assert fit.rotation.shape == (4, 3, 3, 3)
    assert np.max(distance(fit.quaternion, q)) < 1e-13  # well conditioned for this seed


@given(turns, st.tuples(*[st.floats(0.2, 3.0)] * 3), turns)
def test_polar_takes_rotation_and_stretch_apart(turn, stretches, frame):
    rotation, axes = to_matrix(exp(turn)), to_matrix(exp(frame))
    stretch = axes @ np.diag(stretches) @ axes.T
    parts = polar(rotation @ stretch)
    assert np.allclose(parts.rotation, rotation, atol=1e-13)  # smallest stretch 0.2: condition 15
    assert np.allclose(parts.stretch, stretch, atol=1e-13)
    assert np.allclose(parts.left_stretch @ parts.rotation, rotation @ stretch, atol=1e-13)
    assert bool(parts.unique)


def test_polar_of_a_mirror_keeps_a_proper_rotation():
    parts = polar(np.diag([3.0, 2.0, -0.5]))
    assert np.allclose(parts.rotation, np.eye(3), atol=1e-15)
    assert np.linalg.eigvalsh(parts.stretch)[0] == pytest.approx(-0.5)
    assert not polar(np.diag([1.0, 0.0, 0.0])).unique


def test_flow_that_turns_rigidly_has_no_strain_and_the_reverse():
    omega = np.array([0.3, -0.7, 1.1])
    spin = np.cross(omega, np.eye(3)).T  # columns ω x e_j
    flow = flow_gradient(spin)
    assert np.array_equal(flow.strain_rate, np.zeros((3, 3)))
    assert np.allclose(flow.angular_velocity, omega, rtol=4 * EPS)
    assert np.allclose(flow.vorticity, 2 * omega, rtol=4 * EPS)
    stretch = np.diag([1.0, -0.4, -0.6])
    assert np.array_equal(flow_gradient(stretch).vorticity, np.zeros(3))
    assert np.array_equal(flow_gradient(spin + stretch).strain_rate, stretch)


def test_polar_rotation_follows_the_vorticity_for_a_small_time():
    rng = np.random.default_rng(5)
    gradient, h = rng.normal(size=(3, 3)), 1e-5
    turned = polar(np.eye(3) + h * gradient).rotation
    spun = exp(h * flow_gradient(gradient).angular_velocity)
    assert distance(from_matrix(turned), spun) < 20 * h**2  # first order agrees


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: superpose(np.zeros((3, 3)), np.zeros((4, 3))), "3 and 4 points"),
        (lambda: superpose(np.zeros((0, 3)), np.zeros((0, 3))), "n >= 1"),
        (lambda: superpose(np.zeros((2, 3)), np.full((2, 3), np.nan)), "target: a coordinate is not finite"),
        (lambda: superpose(np.zeros((2, 3)), np.zeros((2, 3)), [1.0, -1.0]), "not negative"),
        (lambda: superpose(np.zeros((2, 3)), np.zeros((2, 3)), [1.0]), "one for each point"),
        (lambda: polar(np.full((3, 3), np.inf)), "not finite"),
        (lambda: flow_gradient(np.zeros((2, 2))), r"\(\.\.\., 3, 3\)"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()
