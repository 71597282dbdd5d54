"""Screws, brackets of twists, base-pair steps and rigid parts: closed forms, the way back, known answers."""

import numpy as np
import pytest

from rotor.geometry.base_pair_steps import mean_rotation, persistence_steps, step_parameters, step_pose
from rotor.geometry.rigid_motions import bracket, chasles_screw, compose, twist_exp, twist_log
from rotor.geometry.rigid_parts import rigid_parts
from rotor.geometry.rotations import conjugate, exp, rotate, to_matrix, uniform


def test_a_screw_leaves_its_line_where_it_is_but_for_the_shift():
    rng = np.random.default_rng(4)
    for q, position in zip(uniform(20, rng=rng), rng.normal(size=(20, 3)), strict=True):
        screw = chasles_screw(q, position)
        for along in (0.0, 1.7):
            point = screw.point + along * screw.axis
            assert np.allclose(rotate(q, point) + position, point + screw.shift * screw.axis, atol=1e-12)  # round-off
        assert screw.point @ screw.axis == pytest.approx(0.0, abs=1e-12)
        assert np.allclose(exp(screw.angle * screw.axis) @ q, np.sign(q[0]), atol=1e-12)
    moved = chasles_screw([1, 0, 0, 0], [0.0, 3.0, 4.0])
    assert (moved.angle, moved.shift, moved.axis.tolist()) == (0.0, 5.0, [0.0, 0.6, 0.8])
    at_rest = chasles_screw([1, 0, 0, 0], [0.0, 0.0, 0.0])
    assert (at_rest.angle, at_rest.shift, at_rest.axis.tolist()) == (0.0, 0.0, [0.0, 0.0, 1.0])
    assert moved.point.tolist() == at_rest.point.tolist() == [0.0, 0.0, 0.0]


def test_the_bracket_is_what_a_small_loop_leaves():
    a, b = np.array([0.3, -0.2, 0.5, 1.0, 0.4, -0.7]), np.array([-0.4, 0.9, 0.1, 0.2, -0.5, 0.3])
    rests = []
    for s in (1e-2, 5e-3):
        q, p = np.array([1.0, 0, 0, 0]), np.zeros(3)
        for twist in (a, b, -a, -b):
            q, p = compose(q, p, *twist_exp(s * twist))
        rests.append(np.linalg.norm(twist_log(q, p) - s**2 * bracket(a, b)))
    assert np.log2(rests[0] / rests[1]) == pytest.approx(3.0, abs=0.05)  # the next term is of order s³
    c = np.array([0.1, 0.2, -0.6, 0.3, 0.8, 0.5])
    jacobi = bracket(a, bracket(b, c)) + bracket(b, bracket(c, a)) + bracket(c, bracket(a, b))
    assert np.allclose(jacobi, 0.0, atol=1e-15)


def test_steps_are_those_of_el_hassan_and_calladine():
    """Their product of Euler turns with the phase φ of the bend, T = Rz(Ω/2 - φ) Ry(Γ) Rz(Ω/2 + φ), by matrices."""
    shift, slide, rise, tilt, roll, twist = parameters = np.array([0.09, 0.53, 3.33, -2.5, 4.7, 37.3])
    t, r, w = np.radians([tilt, roll, twist])
    phase, bend = np.arctan2(t, r), np.hypot(t, r)
    about_z = lambda angle: to_matrix(exp([0, 0, angle]))  # noqa: E731
    about_y = lambda angle: to_matrix(exp([0, angle, 0]))  # noqa: E731
    whole = about_z(w / 2 - phase) @ about_y(bend) @ about_z(w / 2 + phase)
    middle = about_z(w / 2 - phase) @ about_y(bend / 2) @ about_z(phase)
    q, position = step_pose(parameters)
    assert np.allclose(to_matrix(q), whole, atol=1e-14)  # round-off
    assert np.allclose(position, middle @ [shift, slide, rise], atol=1e-14)
    many = np.random.default_rng(1).normal(size=(50, 6)) * [1, 1, 1, 30, 30, 60]
    assert np.allclose(step_parameters(*step_pose(many)), many, atol=1e-11)  # degrees
    back, there = step_pose([*parameters[:3], 0.0, 0.0, twist])
    assert np.allclose(step_parameters(-back, there), [*parameters[:3], 0.0, 0.0, twist], atol=1e-12)


def test_a_strand_read_backwards_has_the_shift_and_tilt_of_the_other_sign():
    """Turned by π about x, the second pair is the first of the other strand: the mid-step frame is symmetric."""
    parameters = np.array([0.09, 0.53, 3.33, 0.5, 4.7, 37.3])
    q, position = step_pose(parameters)
    flip = np.array([0.0, 1.0, 0, 0])
    back = compose(conjugate(q), -rotate(conjugate(q), position), [1.0, 0, 0, 0], np.zeros(3))
    q2, p2 = compose(*compose(flip, np.zeros(3), *back), conjugate(flip), np.zeros(3))
    assert np.allclose(step_parameters(q2, p2), parameters * [-1, 1, 1, -1, 1, 1], atol=1e-12)


def test_persistence_of_small_bends_and_of_samples():
    """2/(var tilt + var roll) for small bends; and the mean over samples of chains."""
    mean, spread = np.array([0.0, 0.0, 34.0]), np.diag([3.0, 5.0, 6.0]) ** 2
    steps = persistence_steps(mean_rotation(mean, spread))
    assert steps == pytest.approx(2.0 / np.radians(1.0) ** 2 / 34.0, rel=5e-3)  # the next term is var/4, 3e-3
    angles = np.random.default_rng(3).multivariate_normal(mean, spread, 200_000)
    sampled = to_matrix(step_pose(np.concatenate([np.zeros_like(angles), angles], axis=-1))[0]).mean(axis=0)
    assert np.allclose(sampled, mean_rotation(mean, spread), atol=1e-3)  # 5 sigma of 0.1 rad/√200000
    with pytest.raises(ValueError, match="no persistence length"):
        persistence_steps(np.eye(3))
    with pytest.raises(ValueError, match="shift, slide, rise"):
        step_pose([1.0, 2.0])


def two_domains(rng, noise):
    """180 points in two clouds, the second hinged by 41 degrees about a line, and a loop that follows neither."""
    first, second = rng.normal(size=(100, 3)) * 8.0, rng.normal(size=(70, 3)) * 6.0 + [20.0, 0, 0]
    loop = rng.normal(size=(10, 3)) * 2.0 + [10.0, 0, 0]
    axis, point, angle, shift = np.array([0.0, 0.6, 0.8]), np.array([9.0, 4.0, -3.0]), np.radians(41.0), 1.5
    q = exp(angle * axis)
    hinged = rotate(q, second - point) + point + shift * axis
    whole, offset = exp([0.4, -1.0, 0.7]), np.array([30.0, -5.0, 2.0])
    after = np.concatenate([first, hinged, loop + rng.normal(size=(10, 3)) * 6.0])
    after = rotate(whole, after) + offset + rng.normal(size=after.shape) * noise
    return np.concatenate([first, second, loop]), after, (axis, point, angle, shift)


def test_two_domains_and_their_hinge_are_found():
    before, after, (axis, point, angle, shift) = two_domains(np.random.default_rng(8), 0.2)
    first, two = rigid_parts(before, after, tolerance=1.2)[:2]
    assert set(range(100)) <= set(first.members)
    assert set(range(100, 170)) <= set(two.members)
    assert len(first.members) + len(two.members) <= 173  # hardly a point of the loop
    few = rigid_parts(before, after, tolerance=1.2, neighbours=4)[:2]  # first motions of four points are fitted again
    assert [part.members.tolist() for part in few] == [first.members.tolist(), two.members.tolist()]
    screw = two.screw_against(first)
    # noise of 0.2 over 70 points of spread 6: 0.2/(6 √70) = 0.004 rad, and 20 times that from the origin
    assert screw.angle == pytest.approx(angle, abs=0.015)
    assert abs(screw.axis @ axis) == pytest.approx(1.0, abs=1e-3)
    assert np.linalg.norm(np.cross(screw.point - point, axis)) < 0.3
    assert screw.shift == pytest.approx(shift, abs=0.3)


def test_one_body_is_one_part_and_nonsense_is_refused():
    before, _, _ = two_domains(np.random.default_rng(9), 0.0)
    after = rotate(exp([0.1, 0.2, 3.0]), before) + np.array([1.0, 2.0, 3.0])
    (whole,) = rigid_parts(before, after, tolerance=1e-9)
    assert len(whole.members) == 180
    assert whole.rmsd < 1e-13 * 20  # round-off of coordinates of 20
    with pytest.raises(ValueError, match="same shape"):
        rigid_parts(before, after[:-1], 1.0)
    with pytest.raises(ValueError, match="tolerance above 0"):
        rigid_parts(before, after, 0.0)
