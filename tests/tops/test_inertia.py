"""Plates, solids, composites and the unique frame: the figures of systems.md row 2."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from rotor.classical.euler import momentum_rate
from rotor.geometry.inertia import Body, box, cone, hemisphere, point_masses, principal_frame, rectangle, rod, triangle
from rotor.tops.kind import kind_from_moments
from rotor.tops.top import Top


def test_plate_with_a_given_tensor():
    """α(5, -2, 0; -2, 8, 0; 0, 0, 13): moments 4α, 9α, 13α along (2, 1, 0)/√5, (1, -2, 0)/√5 and z."""
    alpha = 0.37
    frame = principal_frame(Body(1.0, np.zeros(3), alpha * np.array([[5.0, -2, 0], [-2, 8, 0], [0, 0, 13]])))
    assert frame.moments == pytest.approx(alpha * np.array([4, 9, 13]), rel=1e-14)
    for axis, expected in zip(frame.axes, ([2, 1, 0], [1, -2, 0], [0, 0, 1]), strict=True):
        assert abs(axis @ np.array(expected) / np.linalg.norm(expected)) == pytest.approx(1, abs=1e-14)
    assert np.linalg.det(frame.axes) == pytest.approx(1)


def test_right_isosceles_triangle_has_an_axis_at_45_degrees():
    plate = triangle(1.0, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    axes = principal_frame(plate).axes
    assert np.abs(axes @ np.array([1, 1, 0]) / np.sqrt(2)).max() == pytest.approx(1, abs=1e-14)
    assert plate.tensor[0, 0] == pytest.approx(1 / 18)  # m b h²/36 of a triangle with b = h = 1


def test_axis_at_half_of_45_degrees():
    """tan 2θ = 2 I_xy/(I_xx - I_yy) = 1: tan θ = √2 - 1."""
    frame = principal_frame(Body(1.0, np.zeros(3), np.array([[1.0, -1, 0], [-1, 3, 0], [0, 0, 4]])))
    a = frame.axes[0]
    assert abs(a[1] / a[0]) == pytest.approx(np.sqrt(2) - 1, abs=1e-14)


def composite(height: float) -> Body:
    """A cone on a hemisphere, both of radius 1 and density 1."""
    return cone(np.pi * height / 3, 1.0, height) + hemisphere(2 * np.pi / 3, 1.0)


def test_cone_on_a_hemisphere_can_be_a_spherical_top():
    height = brentq(lambda h: composite(h).tensor[0, 0] - composite(h).tensor[2, 2], 0.5, 3.0, xtol=1e-14)
    assert kind_from_moments(principal_frame(composite(height)).moments).kind == "spherical"
    assert kind_from_moments(principal_frame(composite(height * 1.01)).moments).kind == "prolate"


def test_composite_is_what_a_sum_over_small_pieces_says():
    """Independent route: midpoints of 200 discs along z, each of m r²/4 across and m r²/2 along."""
    body, n = composite(1.3), 20000
    z = np.linspace(-1, 1.3, n, endpoint=False) + 2.3 / (2 * n)
    r2 = np.where(z < 0, 1 - z**2, (1 - z / 1.3) ** 2)
    m = np.pi * r2 * 2.3 / n
    centre = m @ z / m.sum()
    assert body.mass == pytest.approx(m.sum(), rel=1e-7)  # midpoint rule, error of order 1/n²
    assert body.centre[2] == pytest.approx(centre, abs=1e-7)
    assert body.tensor[2, 2] == pytest.approx(m @ r2 / 2, rel=1e-7)
    assert body.tensor[0, 0] == pytest.approx(m @ (r2 / 4 + (z - centre) ** 2), rel=1e-7)


def test_tetrahedral_frame():
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    assert kind_from_moments(principal_frame(point_masses([1] * 4, corners)).moments).kind == "spherical"
    one_heavy = principal_frame(point_masses([1.1, 1, 1, 1], corners), [1.1, 1, 1, 1], corners)
    assert (
        kind_from_moments(one_heavy.moments).kind == "prolate" or kind_from_moments(one_heavy.moments).kind == "oblate"
    )


@pytest.mark.parametrize(
    ("edges", "parallel"),
    [([1.0, 1.0, 1.0], (True, True)), ([1.0, 1.0, 2.0], (True, False)), ([1.0, 1.5, 2.0], (False, False))],
    ids=["cube", "square", "unequal edges"],
)
def test_momentum_is_along_the_angular_velocity_off_a_principal_axis_only_where_moments_coincide(edges, parallel):
    """A cube any way; a square box across its axis, not oblique to it; a box of unequal edges never. Where so, L does not change."""
    moments = principal_frame(box(3.0, edges)).moments
    oblique = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 1.0]])
    if edges[2] > edges[1] == edges[0]:
        oblique = oblique[:, ::-1]  # the long axis has the smallest moment and comes first
    turned = np.linalg.norm(momentum_rate(moments * oblique, moments), axis=-1)
    assert tuple(turned < 1e-14) == parallel  # round-off
    assert np.all((turned < 1e-14) | (turned > 0.1))


def test_steiner_and_turning():
    stick = rod(2.0, [0, 0, -1], [0, 0, 1])
    assert stick.about([3, 0, 0])[1, 1] == pytest.approx(2 * 4 / 12 + 2 * 9)
    plate = rectangle(1.0, 2.0, 1.0)
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert np.allclose(plate.turned(quarter).tensor.diagonal(), plate.tensor.diagonal()[[1, 0, 2]])
    assert np.allclose(plate.moved([5, 5, 5]).tensor, plate.tensor)


@pytest.mark.parametrize(
    ("tensor", "words"),
    [
        (np.diag([1.0, 1.0, 3.0]), "are impossible"),
        (np.array([[1.0, 2, 0], [0, 1, 0], [0, 0, 1]]), "symmetric"),
        (np.full((3, 3), np.nan), "finite"),
    ],
)
def test_impossible_tensors(tensor, words):
    with pytest.raises(ValueError, match=words):
        principal_frame(Body(1.0, np.zeros(3), tensor))


def test_impossible_masses():
    with pytest.raises(ValueError, match="above 0"):
        point_masses([1.0, 0.0], [[0, 0, 0], [0, 0, 1]])
    with pytest.raises(ValueError, match="expected"):
        point_masses([1.0], [[0, 0, 0], [0, 0, 1]])


def test_a_top_from_a_body():
    top = Top.from_body(point_masses([12.0, 16.0], [[0, 0, 0], [0, 0, 1.128]]))
    assert top.kind == "linear"


def test_a_tensor_alone_is_refused_with_what_would_do():
    with pytest.raises(ValueError, match=r"body: ndarray: expected a Body"):
        principal_frame(np.diag([1.0, 2.0, 3.0]))
