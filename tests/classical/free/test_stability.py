"""Closed forms of free rotation, each measured from motions to 1e-6."""

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from rotor.classical.free import stability as stab
from rotor.classical.free.free_motion import free_motion
from rotor.geometry.rotations import rotate
from rotor.requests.budget import ROUNDING

MEASURED = 1e-6  # to which every closed form has to be met by a motion

bodies = st.tuples(*(st.floats(0.3, 1.0), st.floats(1.1, 1.9), st.floats(2.0, 3.0)))


def component(motion, i):
    """L_i of the body as a function of time."""
    return lambda t: motion.at(t)[0][..., i]


def returns(motion, i, upto, samples=4001):
    """Times at which L_i crosses zero upwards."""
    times = np.linspace(0.0, upto, samples)
    values = component(motion, i)(times)
    rising = np.nonzero((values[:-1] < 0.0) & (values[1:] >= 0.0))[0]
    return np.array([brentq(component(motion, i), times[k], times[k + 1], xtol=1e-13) for k in rising])


@pytest.mark.parametrize("spin", [0.9, -1.3])
@pytest.mark.parametrize("unique", [0.6, 1.7])
def test_precession_of_a_symmetric_top(unique, spin):
    moments, momentum = np.array([1.0, 1.0, unique]), np.array([0.3, -0.4, spin * unique])
    body, space = stab.precession_rates(moments, momentum)
    dt = 0.1
    m, q = free_motion(moments, momentum).at([0.0, dt])
    in_body = np.arctan2(m[:, 1], m[:, 0])
    # ω turns in the body at +(I3/I - 1) ω3 (Landau and Lifshitz 36.6)
    assert (in_body[1] - in_body[0]) / dt == pytest.approx(float(body), rel=MEASURED)
    pole = momentum / np.linalg.norm(momentum)
    axis = rotate(q, [0.0, 0.0, 1.0])
    side = axis - (axis @ pole)[:, None] * pole
    turned = np.arctan2(np.cross(side[0], side[1]) @ pole, side[0] @ side[1])
    assert turned / dt == pytest.approx(float(space), rel=MEASURED)


@pytest.mark.parametrize("axis", [0, 2])
def test_small_oscillation_about_the_stable_axes(axis):
    moments, size = np.array([1.0, 1.7, 2.3]), 1.9
    momentum = 1e-5 * np.ones(3)  # amplitude squared, 1e-10, is the error of the linear law
    momentum[axis] = size
    rate = np.sqrt(stab.axis_rate_squared(moments, axis, size))
    crossings = returns(free_motion(moments, momentum), 1, 20 * 2 * np.pi / rate)
    assert 2 * np.pi / np.mean(np.diff(crossings)) == pytest.approx(rate, rel=MEASURED)


def test_growth_from_the_intermediate_axis():
    moments, size = np.array([2.3, 1.0, 1.7]), 1.9  # the intermediate axis is the third
    rate = stab.growth_rate(moments, size)
    motion = free_motion(moments, [1e-13, 0.0, size])
    # between 10 and 22 e-foldings: the decaying part is below e^-20, the amplitude below 4e-4, squared 1e-7
    early, late = 10.0 / rate, 22.0 / rate
    first, last = np.abs(component(motion, 0)(np.array([early, late])))
    assert np.log(last / first) / (late - early) == pytest.approx(rate, rel=MEASURED)
    assert -stab.axis_rate_squared(moments, 2, size) == pytest.approx(rate**2, rel=1e-14)


@pytest.mark.parametrize("moments", [(1.0, 2.0, 3.0), (0.6, 0.8, 1.0), (1.0, 1.875, 2.875)])
def test_separatrix_ratio_by_bisection_of_motions(moments):
    i1, _, i3 = moments

    def circles_third(ratio):
        motion = free_motion(moments, [i1, 0.0, i3 * ratio])
        m = component(motion, 2)(np.linspace(0.0, motion.period, 200))
        return np.all(m > 0.0)

    low, high = 0.01, 10.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if circles_third(middle) else (middle, high)
    assert 0.5 * (low + high) == pytest.approx(float(stab.separatrix_ratio(moments)), rel=MEASURED)


@pytest.mark.parametrize(
    ("moments", "momentum"),
    [
        ((1.0, 2.0, 3.0), (0.001, 2.0, 0.003)),
        ((0.6, 0.8, 1.0), (1.8, 0.4, -0.9)),
        ((3.0, 5.0, 9.0), (0.0, 2.0, 0.01)),
        ((1.0, 1.0, 2.0), (0.3, 0.1, 0.9)),
    ],
)
def test_tumbling_period_from_returns(moments, momentum):
    period = float(stab.tumbling_period(moments, momentum))
    crossings = returns(free_motion(moments, momentum), 1, 3.2 * period)
    assert np.diff(crossings) == pytest.approx(period, rel=MEASURED)


def test_it_flips_every_half_period():
    motion = free_motion([1.0, 2.0, 3.0], [0.001, 2.0, 0.003])
    m, _ = motion.at([0.0, motion.period / 2, motion.period])
    assert np.allclose(m[1], [-0.001, -2.0, 0.003], rtol=1e-12)  # the tumbling racket, turned over
    assert np.allclose(m[2], m[0], rtol=1e-12)  # and back


@pytest.mark.parametrize(
    ("moments", "omega", "period"),
    [
        ((1.0, 2.0, 3.0), (0.01, 1.0, 0.0), 41.5092195293379),
        ((0.3, 0.35, 0.4), (0.1, 15.0, 0.1), 12.3349458093386),
        ((1.0, 1.875, 2.875), (1e-12, 1.0, 1e-12), 207.39643991872882),
    ],
)
def test_published_periods(moments, omega, period):
    assert stab.tumbling_period(moments, np.array(moments) * omega) == pytest.approx(period, rel=1e-12)


@given(bodies, st.floats(1e-9, 1e-5), st.floats(1e-9, 1e-5))
def test_asymptotic_period_close_to_the_intermediate_axis(moments, a, c):
    momentum = np.array([a, 1.0, c])
    exact = free_motion(moments, momentum)
    # the series of K goes on with terms of the order of mc ln mc; mc is at most 1e-9 (moments differ by 0.1 or more)
    if np.isfinite(exact.period):
        assert stab.asymptotic_period(moments, momentum) == pytest.approx(float(exact.period), rel=1e-7)


@given(bodies, st.tuples(*[st.floats(-2.0, 2.0)] * 3).filter(lambda m: min(abs(x) for x in m) > 0.01))
def test_period_of_both_routes(moments, momentum):
    ratio = abs(momentum[2] / moments[2]) / abs(momentum[0] / moments[0]) / stab.separatrix_ratio(moments)
    if abs(ratio - 1.0) > 1e-4:  # closer to the separatrix the plain form loses its digits
        exact = float(free_motion(moments, momentum).period)
        assert stab.tumbling_period(moments, momentum) == pytest.approx(exact, rel=1e-11)  # 1e-16 over 1e-4, and K


def test_kinds_of_fixed_axes():
    kinds = {
        (1.0, 2.0, 3.0): ["stable", "unstable", "stable"],
        (2.0, 3.0, 1.0): ["unstable", "stable", "stable"],
        (2.0, 1.0, 2.0): ["neutral", "stable", "neutral"],
        (2.0, 2.0, 2.0): ["neutral", "neutral", "neutral"],
        (0.0, 2.0, 2.0): ["none", "neutral", "neutral"],
    }
    for moments, expected in kinds.items():
        assert [axis.kind for axis in stab.fixed_axes(moments, 1.5)] == expected


def test_kinds_are_what_motions_do():
    moments, size = np.array([1.7, 1.0, 2.3]), 1.0
    for axis, fixed in enumerate(stab.fixed_axes(moments, size)):
        start = np.full(3, 1e-4)
        start[axis] = size
        m, _ = free_motion(moments, start).at(np.linspace(0.0, 300.0, 1001))
        strayed = np.max(np.linalg.norm(np.delete(m, axis, axis=-1), axis=-1))
        assert (strayed < 1e-3) == (fixed.kind == "stable")
        assert (strayed > 0.9) == (fixed.kind == "unstable")


def test_one_table_for_every_kind_of_body():
    water = stab.stability([1.0, 1.875, 2.875], [0.5, 0.75, 1.0])
    assert water.period == pytest.approx(20.6947551192268, rel=1e-13)
    assert "periodic, not chaotic" in water.chaos
    sphere = stab.stability([2.0, 2.0, 2.0], [0.5, 0.75, 1.0])
    assert np.isnan(sphere.separatrix_ratio)
    assert (sphere.growth_rate, sphere.period) == (0.0, np.inf)
    assert "growth rate" in water.chaos
    assert "growth rate" not in sphere.chaos  # it has no unstable axis
    assert "single rate" in sphere.chaos
    linear = stab.stability([0.0, 2.0, 2.0], [0.0, 0.75, 1.0])
    assert (linear.growth_rate, linear.period) == (0.0, np.inf)
    assert "single rate" in linear.chaos
    for momentum, limit in (([0.0, 2.0, 0.0], "saddle"), ([2.0, 0.0, 0.0], "steady"), ([0.1, 2.0, 0.1], "")):
        assert stab.stability([1.0, 2.0, 3.0], momentum).limit == limit
    assert stab.separatrix_ratio([[1.0, 2.0, 2.0], [1.0, 1.0, 2.0]]).tolist() == [np.inf, 0.0]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: stab.growth_rate([0.0, 1.0, 1.0], 1.0), "linear rotor"),
        (lambda: stab.separatrix_ratio([1.0, 1.0, 1.0]), "spherical top"),
        (lambda: stab.precession_rates([1.0, 2.0, 3.0], [1.0, 0.0, 0.0]), r"\(I, I, I3\)"),
        (lambda: stab.fixed_axes([[1.0, 2.0, 3.0]], 1.0), "one body"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_the_growth_rate_is_rounded_as_stated():
    """Against 50 digits, for moments over four orders of magnitude, some of them nearly equal: an accuracy of it is that of rounding."""
    rng = np.random.default_rng(27)
    for _ in range(200):
        moments, momentum = np.sort(10 ** rng.uniform(-2, 2, 3)), 10 ** rng.uniform(-2, 2)
        if rng.random() < 0.3:
            moments[1] = moments[0] * (1 + 10 ** rng.uniform(-15, -3))
        with mpmath.workdps(50):
            low, middle, high = (mpmath.mpf(moment) for moment in np.sort(moments))
            true = momentum / middle * mpmath.sqrt((high - middle) * (middle - low) / (low * high))
            apart = abs(mpmath.mpf(float(stab.growth_rate(moments, momentum))) - true)
            assert apart <= ROUNDING * true
