"""Lyapunov exponents: closed forms, published attractors, the trace identity, compiled against plain; sections."""

import numpy as np
import pytest

from rotor.classical.effects.drag import LinearDrag, QuadraticDrag
from rotor.classical.effects.drive import PeriodicDrive
from rotor.classical.effects.gravity import GravityAboutPivot
from rotor.classical.exponents import kaplan_yorke
from rotor.classical.free.free_motion import free_motion
from rotor.classical.free.stability import growth_rate
from rotor.classical.lyapunov import (
    Flow,
    body_flow,
    lyapunov_exponents,
    orbit,
    poincare_section,
    quadratic_form,
)
from rotor.geometry.rotations import exp


def leipnik_newton(t, y):
    x, y, z = y.T
    return np.stack([-0.4 * x + y + 10 * y * z, -x - 0.4 * y + 5 * x * z, 0.175 * z - 5 * x * y], axis=-1)


def chen_lee(c):
    def rate(t, y):
        x, y, z = y.T
        return np.stack([-y * z + 5 * x, x * z - 10 * y, x * y / 3 + c * z], axis=-1)

    return rate


# Leipnik and Newton (1981) and Chen and Lee (2004); exponents by Runge-Kutta with Gram-Schmidt elsewhere, all ± 0.01
ATTRACTORS = [
    pytest.param(leipnik_newton, (0.349, 0.0, -0.160), (0.14, 0.0, -0.765), -0.625, 2.185, marks=pytest.mark.slow),
    pytest.param(leipnik_newton, (0.349, 0.0, -0.180), (0.1296, 0.0, -0.7546), -0.625, 2.172, marks=pytest.mark.slow),
    (chen_lee(-3.8), (0.2, 0.2, 0.2), (0.64, 0.0, -9.44), -8.8, 2.068),
    (chen_lee(-3.8), (1.0, 1.0, 1.0), (0.0, -0.909, -7.89), -8.8, 1.0),
    pytest.param(chen_lee(-0.38), (0.2, 0.2, 0.2), (0.136, 0.0, -5.515), -5.38, 2.025, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("rate", "start", "expected", "divergence", "dimension"), ATTRACTORS)
def test_published_attractors(rate, start, expected, divergence, dimension):
    time = {-8.8: 5000.0, -5.38: 10_000.0, -0.625: 30_000.0}[divergence]  # the fast attractors average sooner
    exponents = lyapunov_exponents(Flow(rate, np.array(start)), time=time, transient=300.0)
    assert np.allclose(exponents.values, expected, atol=0.01)  # as stated with them
    assert abs(np.sum(exponents.values) - divergence) < 1e-6
    assert exponents.divergence == pytest.approx(divergence, abs=1e-9)
    assert exponents.kaplan_yorke == pytest.approx(dimension, abs=0.01)


def test_compiled_and_plain_routes_agree():
    start = np.array([0.349, 0.0, -0.160])
    compiled = lyapunov_exponents(Flow(leipnik_newton, start), time=300.0, transient=20.0, segments=3)
    plain = lyapunov_exponents(
        Flow(lambda t, y: leipnik_newton(t, y) + 1e-9 * np.abs(y), start), time=300.0, transient=20.0, segments=3
    )
    assert quadratic_form(Flow(leipnik_newton, start)) is not None
    assert np.allclose(compiled.values, plain.values, atol=0.05)  # two stretches of 300 on one attractor: 0.1/√3 spread
    assert abs(np.sum(plain.values) - plain.divergence) < 1e-6
    limit_cycle = np.array([1.0, 1.0, 1.0])
    compiled = lyapunov_exponents(Flow(chen_lee(-3.8), limit_cycle), time=60.0, transient=40.0, segments=2)
    plain = lyapunov_exponents(Flow(chen_lee(-3.8), limit_cycle, timed=True), time=60.0, transient=40.0, segments=2)
    assert np.allclose(compiled.values, plain.values, atol=5e-3)  # a regular orbit: both see the same cycle


def test_the_unstable_axis_grows_at_the_closed_rate():
    moments, momentum = [1.0, 2.0, 3.0], [0.0, 2.0, 0.0]
    exponents = lyapunov_exponents(body_flow(moments, momentum), time=60.0, transient=20.0, segments=2)
    sigma = growth_rate(moments, 2.0)
    assert np.allclose(exponents.values, [sigma, 0.0, -sigma], atol=1e-9)  # the fixed point's own exponents


def test_free_tumbling_is_not_chaotic():
    moments, momentum = [1.0, 1.875, 2.875], [0.5, 0.75, 1.0]
    short = lyapunov_exponents(body_flow(moments, momentum), time=1000.0, segments=2).values[0]
    long = lyapunov_exponents(body_flow(moments, momentum), time=20_000.0, segments=2).values[0]
    assert long < 1e-3
    assert long < 0.3 * short  # it falls as log(t)/t


def test_damped_top_contracts_at_its_drag():
    moments = np.array([1.0, 2.0, 4.0])
    drag = np.array([0.1, 0.4, 0.2])
    exponents = lyapunov_exponents(body_flow(moments, [0.0, 0.0, 0.0], [LinearDrag(drag)]), time=40.0, segments=2)
    assert np.allclose(np.sort(exponents.values), np.sort(-drag / moments), atol=1e-9)


def test_exponents_with_attitude_carry_the_zero_of_the_quaternion():
    """A pendulum upside down leaves at √(m g l/I), its seven exponents pair up, and |q| adds one zero."""
    weight = GravityAboutPivot(1.0, [0.0, 0.0, 0.5], [0.0, 0.0, -10.0])
    upright = body_flow([2.0, 1.0, 0.5], [0, 0, 0], [weight], exp([0.0, 0, 0]))
    exponents = lyapunov_exponents(upright, time=8.0, count=7, segments=2, transient=0.0)
    assert np.allclose(exponents.values[:2], [np.sqrt(5.0), np.sqrt(2.5)], atol=0.02)  # alignment over 0.8 only
    assert np.allclose(exponents.values, -exponents.values[::-1], atol=1e-6)
    assert abs(exponents.values[2]) < 0.5  # the free turn about the vertical: a shear, log t / t with t = 4
    assert abs(exponents.values[3]) < 1e-6
    assert abs(np.sum(exponents.values)) < 1e-6


def test_driven_body_is_followed_at_its_own_time():
    """x' = -x + cos t through a driven, damped sphere: the exponents are the drag's, whatever the drive."""
    effects = [PeriodicDrive([1.0, 0, 0], 1.0), LinearDrag([0.5, 0.5, 0.5])]
    flow = body_flow([1.0, 1.0, 1.0], [0.0, 0.0, 0.0], effects)
    assert flow.timed
    exponents = lyapunov_exponents(flow, time=20.0, segments=2)
    assert np.allclose(exponents.values, -0.5, atol=1e-6)  # central differences of a linear flow


def test_quadratic_form_is_found_and_refused():
    body = body_flow([1.0, 2.0, 3.0], [1.0, 1.0, 1.0], [LinearDrag([0.1, 0.2, 0.3])])
    constant, linear, quadratic = quadratic_form(body)
    assert np.allclose(constant, 0.0)
    assert np.allclose(linear, -np.diag([0.1, 0.1, 0.1]), atol=1e-15)
    assert quadratic[0, 1, 2] == pytest.approx((1 / 3 - 1 / 2) / 2)  # L2 L3 (1/I3 - 1/I2), shared by two entries
    assert quadratic_form(body_flow([1.0, 2.0, 3.0], [1, 1, 1], [QuadraticDrag([0.1, 0.2, 0.3])])) is None


@pytest.mark.parametrize(
    ("values", "dimension"),
    [([0.1, 0.0, -0.5], 2.2), ([-1.0, -2.0], 0.0), ([1.0, -1.0], 2.0), ([0.0, -1.0, -2.0], 1.0)],
)
def test_the_kaplan_yorke_dimension_of_known_spectra(values, dimension):
    assert kaplan_yorke(values) == pytest.approx(dimension)


def test_section_of_a_free_top_is_met_once_per_period():
    moments, momentum = [1.0, 1.875, 2.875], [0.5, 0.75, 1.0]
    times, states = poincare_section(body_flow(moments, momentum), lambda t, y: y[1], time=100.0)
    assert np.allclose(np.diff(times), free_motion(moments, momentum).period, atol=1e-7)  # the orbit's tolerance, 1e-10
    assert np.ptp(states, axis=0).max() < 1e-7


def test_section_of_a_strange_attractor_has_width():
    flow = Flow(leipnik_newton, np.array([0.349, 0.0, -0.160]))
    _, states = poincare_section(flow, lambda t, y: y[1], time=400.0, transient=100.0)
    assert len(states) > 30
    assert np.allclose(states[:, 1], 0.0, atol=1e-9)
    assert len(np.unique(states.round(3), axis=0)) > 30  # no cycle


def test_orbit_agrees_with_the_exact_motion():
    times = np.linspace(0.0, 40.0, 9)
    path = orbit(body_flow([1.0, 1.875, 2.875], [0.5, 0.75, 1.0]), times, tolerance=1e-12)
    assert np.allclose(path, free_motion([1.0, 1.875, 2.875], [0.5, 0.75, 1.0]).at(times)[0], atol=1e-9)


def test_exponents_refuse_impossible_settings():
    flow = Flow(leipnik_newton, np.zeros(3))
    with pytest.raises(ValueError, match="count=4"):
        lyapunov_exponents(flow, 10.0, count=4)
    with pytest.raises(ValueError, match="two segments"):
        lyapunov_exponents(flow, 10.0, segments=1)
    with pytest.raises(ValueError, match="one body"):
        body_flow(np.ones((2, 3)), np.ones((2, 3)))
    with pytest.raises(ValueError, match="without bound"):
        lyapunov_exponents(Flow(lambda t, y: y * y, np.array([1.0])), 10.0)


@pytest.mark.parametrize("time", [100.0, 1000.0, 10_000.0])
@pytest.mark.parametrize("transient", [0.0, 300.0])
def test_exponents_of_a_free_top_are_zero_within_their_errors(time, transient):
    exponents = lyapunov_exponents(body_flow([0.6, 0.8, 1.0], [1.8, 0.4, -0.9]), time=time, transient=transient)
    assert np.all(
        np.abs(exponents.values) < 1.5 * exponents.errors
    )  # a shear grows as t: one bias, and the spread beside it
    assert exponents.kaplan_yorke == 3.0  # all count as zero: the spectrum of a flow that keeps volumes
    assert exponents.errors[0] < 20.0 * np.log(time) / time  # and the errors do not hide everything


def test_the_bias_is_counted_for_segments_side_by_side_too():
    flow = body_flow([0.6, 0.8, 1.0], [1.8, 0.4, -0.9])
    timed = Flow(flow.rate, flow.start, timed=True)  # not the compiled loop
    exponents = lyapunov_exponents(timed, time=200.0, segments=4, tolerance=1e-9)
    assert np.all(np.abs(exponents.values) < 1.5 * exponents.errors)
    assert exponents.bias == pytest.approx(np.log(6.0) / 50.0)  # from a fifth of a segment to six fifths


def test_the_bias_does_not_hide_chaos():
    exponents = lyapunov_exponents(Flow(leipnik_newton, np.array([0.349, 0.0, -0.160])), time=2000.0, transient=200.0)
    assert exponents.values[0] > 10.0 * exponents.errors[0]
    assert abs(exponents.values[1]) < 3.0 * exponents.errors[1]  # along the orbit


def linear_flow(rng):
    """y' = A y with real eigenvalues and eigenvectors that are not orthogonal."""
    values, basis = rng.uniform(-1.0, 0.3, 3), np.eye(3) + 0.5 * rng.normal(size=(3, 3))
    matrix = basis @ np.diag(values) @ np.linalg.inv(basis)
    return Flow(lambda t, y: y @ matrix.T, np.zeros(3)), np.sort(values)[::-1]


def damped_body(rng):
    """A body at rest with a drag about each axis."""
    moments, drag = np.sort(rng.uniform(0.5, 2.0, 3)), rng.uniform(0.02, 0.8, 3)
    return body_flow(moments, np.zeros(3), [LinearDrag(drag)]), np.sort(-drag / moments)[::-1]


def unstable_axis(rng):
    """A body that turns about its intermediate axis."""
    moments, size = np.sort(rng.uniform(0.5, 2.0, 3)), rng.uniform(0.2, 1.5)
    rate = float(growth_rate(moments, size))
    return body_flow(moments, [0.0, size, 0.0]), np.array([rate, 0.0, -rate])


def free_tumble(rng):
    """A body that tumbles freely: neighbouring orbits separate in proportion to time."""
    return body_flow(np.sort(rng.uniform(0.5, 2.0, 3)), rng.normal(size=3)), np.zeros(3)


@pytest.mark.parametrize("make", [linear_flow, damped_body, unstable_axis, free_tumble])
def test_closed_forms_are_within_the_stated_errors(make):
    """20 random flows of each kind, with random times, tolerances and intervals; the bound is not larger than what it counts."""
    for seed in range(20):
        rng = np.random.default_rng([27, seed])
        flow, exact = make(rng)
        exponents = lyapunov_exponents(
            flow, time=10 ** rng.uniform(2, 3.5), transient=rng.choice([0.0, 20.0]), segments=8,
            interval=rng.uniform(0.2, 2.0), tolerance=10 ** rng.uniform(-11, -5),
        )  # fmt: skip
        assert np.all(
            np.abs(exponents.values - exact) <= exponents.rounding + exponents.truncation + 2.0 * exponents.spread
        ), seed
        assert exponents.budget.numerical <= 2.5 * exponents.bias + exponents.budget.rounding.value + 1e-4


def test_the_errors_of_chaos_cover_it():
    """The largest exponent of a strange attractor in 40 parts of it against the whole: 95 % within 2.04 standard errors (Student, 31)."""
    flow = Flow(leipnik_newton, np.array([0.349, 0.0, -0.160]))
    whole = lyapunov_exponents(flow, time=40_000.0, transient=300.0, tolerance=1e-8)
    starts = orbit(flow, 300.0 + 37.0 * np.arange(40), 1e-8)
    parts = [
        lyapunov_exponents(Flow(leipnik_newton, start), time=640.0, transient=5.0, tolerance=1e-8) for start in starts
    ]
    departures = np.array(
        [(part.values[0] - whole.values[0]) / np.hypot(part.spread[0], whole.spread[0]) for part in parts]
    )
    assert np.mean(np.abs(departures) <= 2.04) > 0.84  # 0.95 less three deviations of a count of 40
    assert 0.6 < np.std(departures) < 1.5


def test_an_accuracy_is_met_by_a_longer_time():
    flow = Flow(leipnik_newton, np.array([0.349, 0.0, -0.160]))
    exponents = lyapunov_exponents(flow, time=200.0, transient=300.0, accuracy=0.04)
    shorter = lyapunov_exponents(flow, time=exponents.time / 2, transient=300.0)
    assert exponents.time > 200.0
    assert exponents.reached <= 0.04 < shorter.reached
    assert exponents.budget.line().startswith("errors of growth rates: ")
    with pytest.raises(ValueError, match="cannot be given: the error after a time of 1024 "):
        lyapunov_exponents(Flow(leipnik_newton, flow.start), time=1.0, segments=2, accuracy=1e-9)


def test_a_part_of_the_exponents_has_no_gap_below():
    """The last one that is followed may mix with those that are not: its bound is that of a growth in proportion to time."""
    flow = Flow(lambda t, y: y * np.array([1.0, -0.5, -2.0]), np.zeros(3))
    two, three = (lyapunov_exponents(flow, time=100.0, count=count, segments=4) for count in (2, 3))
    assert two.truncation[1] == pytest.approx(2 * two.bias, rel=1e-6)
    assert three.truncation[1] < 1e-3 * two.truncation[1]
