"""Polhodes lie on both surfaces, exact motions on polhodes; the thermal mean of |L| against sampling; pictures and films."""

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rotor
from rotor import units
from rotor.classical import euler
from rotor.classical.free.free_motion import free_motion
from rotor.classical.free.polhodes import centre_axis, even_levels, level, polhode, separatrix
from rotor.classical.free.stability import separatrix_ratio
from rotor.classical.gas.thermal_momentum import mean_thermal_momentum, off_intermediate_axis
from rotor.classical.integrators.method import integrate
from rotor.classical.integrators.splitting import RotationSplitting
from rotor.classical.motion import MotionTable, invariant_drift, sampled
from rotor.geometry.rotations import IDENTITY, distance
from rotor.plots.motion.animation import Atoms, animate, box_edges, frame_times
from rotor.plots.motion.polhodes import polhode_figure
from rotor.plots.motion.sphere import clear_view
from rotor.plots.show import write_picture

moments_of_a_body = st.permutations((0, 1, 2)).flatmap(
    lambda order: st.tuples(*(st.floats(0.5, 2.0) for _ in range(3))).map(lambda m: np.array(m)[list(order)])
)


@settings(max_examples=50)
@given(moments_of_a_body, st.floats(0.02, 0.98))
def test_polhodes_lie_on_sphere_and_ellipsoid(moments, fraction):
    inverse = 1.0 / moments
    expected = inverse.min() + fraction * np.ptp(inverse)
    if np.ptp(moments) < 1e-3:
        return
    curves = polhode(moments, expected)
    assert np.allclose(np.linalg.norm(curves, axis=-1), 1.0, rtol=0, atol=1e-7)  # √ of a cancellation where s_a = 0
    assert np.allclose(level(moments, curves), expected, rtol=1e-12)  # round-off
    around = centre_axis(moments, expected)
    assert (curves[0, :, around] >= 0).all()
    assert np.allclose(curves[0, :, around], -curves[1, :, around])


@pytest.mark.parametrize("momentum", [(1.8, 0.4, -0.9), (0.3, 0.4, -0.9), (0.02, 1.0, 0.01)])
@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 0, 2)])
def test_exact_motion_goes_round_the_axis_it_says(momentum, order):
    moments, momentum = np.array([0.6, 0.8, 1.0])[list(order)], np.array(momentum)[list(order)]
    motion = free_motion(moments, momentum)
    path = motion.at(np.linspace(0, float(motion.period), 400))[0]
    around = centre_axis(moments, float(level(moments, momentum)))
    assert around == motion.centre_axis
    assert np.ptp(np.sign(path[:, around])) == 0  # the component along the centre never changes sign
    for other in {0, 1, 2} - {around}:
        assert np.ptp(np.sign(path[:, other])) == 2  # the others do


def test_separatrix_has_the_ratio_of_the_closed_form():
    moments = np.array([0.8, 1.0, 0.6])  # axis 3 smallest, axis 1 intermediate, axis 2 largest
    circles = separatrix(moments)
    assert np.allclose(level(moments, circles), 1 / 0.8, rtol=1e-14)  # round-off
    omega = circles[0, 90] / moments
    assert omega[0] == pytest.approx(0.0, abs=1e-15)
    assert abs(omega[1] / omega[2]) == pytest.approx(float(separatrix_ratio(moments)), rel=1e-14)  # round-off


def test_polhodes_say_what_they_cannot_draw():
    with pytest.raises(ValueError, match="no polhodes"):
        polhode([1.0, 1.0, 1.0], 1.0)
    with pytest.raises(ValueError, match="outside of 1/I"):
        polhode([1.0, 2.0, 3.0], 1.5)
    with pytest.raises(ValueError, match="no separatrix"):
        separatrix([1.0, 1.0, 3.0])
    with pytest.raises(ValueError, match="above zero"):
        polhode([0.0, 1.0, 1.0], 1.0)
    assert even_levels([1.0, 1.0, 1.0], 4).size == 0
    assert even_levels([1.0, 2.0, 3.0], 4).size == 8


@pytest.mark.parametrize("moments", [(0.6, 1.2, 1.8), (1.0, 1.0, 1.0), (0.0, 2.0, 2.0), (0.01, 3.0, 3.0)])
def test_thermal_mean_is_that_of_sampled_momenta(moments):
    n, kt = 400_000, 1.7
    drawn = np.random.default_rng(5).standard_normal((n, 3)) * np.sqrt(kt * np.array(moments))
    sizes = np.linalg.norm(drawn, axis=1)
    error = sizes.std() / math.sqrt(n)
    assert abs(sizes.mean() - float(mean_thermal_momentum(moments, kt))) < 4 * error  # 4 σ of a fixed seed


def test_thermal_mean_closed_forms():
    assert float(mean_thermal_momentum([2, 2, 2], 3.0)) == pytest.approx(
        math.sqrt(8 * 6 / math.pi), rel=1e-14
    )  # R_G = √I
    assert float(mean_thermal_momentum([2, 0, 2], 3.0)) == pytest.approx(math.sqrt(3 * math.pi), rel=1e-14)  # √(πIkT/2)
    assert mean_thermal_momentum([[1, 2, 3], [2, 2, 2]], 1.0).shape == (2,)
    with pytest.raises(ValueError, match="not negative"):
        mean_thermal_momentum([1, 2, 3], -1.0)


def test_start_is_half_a_degree_off_the_intermediate_axis():
    momentum = off_intermediate_axis([3.0, 1.0, 2.0], 5.0, math.radians(0.5))
    assert np.linalg.norm(momentum) == pytest.approx(5.0, rel=1e-15)
    assert math.degrees(math.acos(momentum[2] / 5.0)) == pytest.approx(
        0.5, rel=1e-9
    )  # acos near 1 loses half the digits
    assert off_intermediate_axis([0.0, 1.0, 1.0], 5.0, 0.1)[0] == 0.0


def test_table_keeps_the_invariants_and_departure_sees_a_fault():
    motion = free_motion([0.6, 0.8, 1.0], [1.8, 0.4, -0.9])
    table = sampled(motion, np.linspace(0, 100, 50))
    drift = invariant_drift(table, motion)
    assert max(drift.energy, drift.momentum, drift.space_momentum) < 1e-14  # round-off of some ten operations
    bent = MotionTable(table.times, table.momentum, np.broadcast_to(IDENTITY, (50, 4)), table.energy)
    assert invariant_drift(bent, motion).space_momentum > 0.1
    with pytest.raises(ValueError, match="a single body"):
        sampled(free_motion([[1.0, 2.0, 3.0]] * 2, [1.0, 0, 1.0]), [0.0])


def test_csv_gives_every_bit_back(tmp_path):
    table = sampled(free_motion([0.6, 0.8, 1.0], [1.8, 0.4, -0.9]), np.linspace(0, 10, 101))
    rotor.write(table, tmp_path / "m.csv", settings={"moments": [0.6, 0.8, 1.0]})
    lines = (tmp_path / "m.csv").read_text().splitlines()
    assert lines[0] == "t,m1,m2,m3,qw,qx,qy,qz,energy"
    read = np.array([[float(x) for x in line.split(",")] for line in lines[1:]])
    assert np.array_equal(read, np.stack(list(table.columns.values()), axis=1))
    assert json.loads((tmp_path / "m.csv.provenance.json").read_text())["rows"] == 101
    assert len(table.to_pandas()) == 101
    with pytest.raises(ValueError, match=r"\.csv"):
        rotor.write(table, tmp_path / "m.gif")


def test_motion_of_an_integrator_is_written_too(tmp_path):
    motion = integrate(RotationSplitting(step=0.01, order=4), [0.6, 0.8, 1.0], [1.8, 0.4, -0.9], [0.0, 1.0])
    rotor.write(motion, tmp_path / "m.csv")
    assert len((tmp_path / "m.csv").read_text().splitlines()) == 3
    many = integrate(RotationSplitting(step=0.01, order=4), [[0.6, 0.8, 1.0]] * 2, [1.8, 0.4, -0.9], [0.0, 1.0])
    with pytest.raises(ValueError, match="a single body"):
        rotor.write(many, tmp_path / "n.csv")


BODIES = [
    ((0.6, 0.8, 1.0), (1.8, 0.4, -0.9)),
    ((1.0, 1.0, 2.0), (1.8, 0.4, -0.9)),
    ((1.0, 2.0, 2.0), (1.8, 0.4, -0.9)),
    ((1.0, 1.0, 1.0), (1.8, 0.4, -0.9)),
    ((0.0, 1.0, 1.0), (0.0, 0.4, -0.9)),
    ((2.0, 3.0, 6.0), (1.0, 0.5, 1.0)),  # the separatrix itself
]


@pytest.mark.parametrize(("moments", "momentum"), BODIES)
def test_every_kind_of_body_has_a_picture(moments, momentum):
    figure = polhode_figure(free_motion(moments, momentum), [0.0, 12.0])
    left, right = figure.axes
    names = [text.get_text() for text in left.get_legend().get_texts()]
    assert "this motion" in names
    assert ("separatrix" in names) == (len(set(moments)) == 3)
    path = right.lines[0].get_xydata()
    assert path[0, 1] == pytest.approx(momentum[0] / np.linalg.norm(momentum), abs=1e-12)  # round-off
    assert path[-1, 0] <= 12.0 + 1e-12  # linspace ends where asked
    view = clear_view(np.array(moments), np.array(momentum))
    assert np.allclose(view.axes @ view.axes.T, np.eye(3), atol=1e-15)
    assert view.depth(momentum) > 0  # the start is on the front
    assert np.linalg.det(view.axes) == pytest.approx(1.0)  # not mirrored


@pytest.mark.parametrize(
    ("moments", "axis"),
    [((1.0, 2.0, 2.0), 0), ((2.0, 1.0, 2.0), 1), ((1.0, 1.0, 2.0), 2), ((2.0, 1.0, 1.0), 0), ((0.0, 1.0, 1.0), 0)],
)
def test_a_body_with_two_equal_moments_rests_at_right_angles_to_its_axis(moments, axis):
    start = np.array([0.0, 0.4, -0.9]) if 0.0 in moments else np.array([1.8, 0.4, -0.9])
    left = polhode_figure(free_motion(moments, start), [0.0, 12.0]).axes[0]
    (dotted,) = (line for line in left.lines if line.get_label() == "points at rest")
    view = clear_view(np.array(moments), start / np.linalg.norm(start))
    x, y = dotted.get_xydata().T
    z = np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.0))  # of the front
    along = np.stack([x, y, z], axis=-1) @ view.axes[:, axis]
    assert np.nanmax(np.abs(along[z > 0.1])) < 1e-12


def test_a_long_motion_is_cut_and_said_to_be():
    figure = polhode_figure(free_motion([0.6, 0.8, 1.0], [1.8, 0.4, -0.9]), [0.0, 1e4], time_factor=2.0)
    right = figure.axes[1]
    assert "first 12 periods" in right.get_xlabel()
    assert right.get_xlim()[1] == pytest.approx(
        2 * 12 * 6.862616178058115, rel=1e-9
    )  # a period to 1e-15, shown doubled


def test_the_word_period_stands_below_the_curves():
    right = polhode_figure(free_motion([0.6, 0.8, 1.0], [0.1, 2.0, 0.1]), [0.0, 40.0]).axes[1]
    right.figure.canvas.draw()
    (word,) = (text for text in right.texts if "period" in text.get_text())
    box = word.get_window_extent().transformed(right.transData.inverted())
    assert right.get_ylim()[0] < box.y0 < box.y1 < -1.0 < min(line.get_ydata().min() for line in right.lines[:3])


def test_long_names_of_axes_begin_beside_their_arrows():
    motion = free_motion([1.8e-3, 3.9e-3, 5.5e-3], [1e-4, 0.02, 1e-4])
    left = polhode_figure(motion, [0.0, 10.0], axis_names=("long", "across", "thick")).axes[0]
    left.figure.canvas.draw()
    arrows = [text.arrow_patch.get_window_extent() for text in left.texts if getattr(text, "arrow_patch", None)]
    names = [text.get_window_extent() for text in left.texts if text.get_text()]
    assert (len(arrows), len(names)) == (4, 3)  # the fourth is of the motion
    assert not any(name.overlaps(arrow) for name in names for arrow in arrows[:3])


def test_the_same_picture_is_the_same_file_and_has_provenance(tmp_path):
    motion = free_motion([0.6, 0.8, 1.0], [1.8, 0.4, -0.9])
    for suffix in ("png", "svg", "pdf"):
        for name in "ab":
            write_picture(motion, tmp_path / f"{name}.{suffix}", {"made": "here"}, times=[0, 10])
        assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()
    assert '"made"' in (tmp_path / "a.svg").read_text(encoding="utf-8").replace("&quot;", '"')
    with pytest.raises(ValueError, match=r"\.png"):
        write_picture(motion, tmp_path / "a.jpg")
    with pytest.raises(ValueError, match="one body"):
        polhode_figure(free_motion([0.6, 0.8, 1.0], [0.0, 0.0, 0.0]), [0, 10])


@pytest.mark.parametrize(
    ("moments", "momentum"), [((1, 1, 2), (0, 1, 0.01)), ((0, 1, 1), (0, 1, 0)), ((1, 2, 3), (1, 1, 1))]
)
def test_frames_of_a_film_are_less_than_half_a_turn_apart(moments, momentum):
    """A disc spun across its axis turns 200 times while L goes round once; 150 even frames of it show turns that it does not make."""
    motion = free_motion(moments, momentum)
    when = frame_times(motion, np.array([3.0, 1003.0]))
    assert (when[0], len(when)) == (3.0, 150)
    assert when[-1] < 1003.0
    assert float(distance(*(motion.at(part)[1] for part in (when[1:], when[:-1]))).max()) < 0.9
    assert frame_times(motion, np.array([3.0, 4.0]))[-1] == 4.0


def test_a_film_has_its_frames(tmp_path):
    from PIL import Image

    motion = free_motion([0.6, 0.8, 1.0], [1.8, 0.4, -0.9])
    animate(motion, [0, 10], tmp_path / "box.gif", frames=4)
    water = rotor.read("water")
    atoms = Atoms((water.molecule.positions_angstrom - water.frame.centre) @ water.frame.axes.T, water.molecule.symbols)
    assert len(atoms.bonds) == 2
    animate(motion, [0, 10], tmp_path / "water.gif", atoms=atoms, frames=3)
    for name, frames in (("box", 4), ("water", 3)):
        with Image.open(tmp_path / f"{name}.gif") as film:
            assert film.n_frames == frames
    with pytest.raises(ValueError, match="different times"):
        animate(motion, [1.0], tmp_path / "no.gif")
    with pytest.raises(ValueError, match=r"\.gif or \.mp4"):
        animate(motion, [0, 1], tmp_path / "no.avi")


def test_box_has_the_moments_it_was_asked_for():
    edges = 2 * box_edges([0.6, 0.8, 1.0])
    moments = np.array([edges[1] ** 2 + edges[2] ** 2, edges[0] ** 2 + edges[2] ** 2, edges[0] ** 2 + edges[1] ** 2])
    assert np.allclose(moments / moments[2], [0.6, 0.8, 1.0], rtol=1e-14)  # round-off
    assert np.array_equal(box_edges([0.0, 1.0, 1.0]), [1.0, 0.0, 0.0])


def test_energy_column_is_that_of_the_core():
    table = sampled(free_motion([0.6, 0.8, 1.0], [1.8, 0.4, -0.9]), [0.0, 3.0])
    assert np.array_equal(table.energy, euler.energy(table.momentum, [0.6, 0.8, 1.0]))


@pytest.mark.parametrize(("towards", "picoseconds"), [((1, 0, 1), 0.90), ((1, 0, 0), 0.81), ((0, 0, 1), 0.88)])
def test_how_often_water_turns_over_depends_on_where_it_is_tipped(towards, picoseconds):
    """The figures of docs/classical.md: thermal |L| at 300 K, half a degree off axis b; a period turns over twice."""
    moments = np.array(rotor.read("water").moments_u_angstrom2)
    tilt, aside = math.radians(0.5), np.array(towards) / math.sqrt(sum(towards))
    size = mean_thermal_momentum(moments, units.EV_PER_K * 300.0)
    period = free_motion(moments, size * (math.sin(tilt) * aside + math.cos(tilt) * np.array([0, 1, 0]))).period
    assert period / 2 * units.ASE_TIME_PS == pytest.approx(picoseconds, abs=0.005)  # two digits stated
