"""The exact free motion: published values, two independent routes in plain double, group law, every kind of top."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipkinc, ellipkm1, elliprj

from rotor.classical import euler
from rotor.classical.free.free_motion import free_motion
from rotor.classical.free.stability import growth_rate
from rotor.geometry.rotations import IDENTITY, continuous, distance, exp, multiply, rotate, uniform

REGRESSION = [  # moments, momentum, time, momentum there, attitude there: 50-digit values rounded to 16
    (
        (0.6, 0.8, 1.0),
        (1.8, 0.4, -0.9),
        10.0,
        (1.7659625085182075, -0.69546419703308912, 0.77955498148187109),
        (-0.73606136416079394, -0.57078695124035073, -0.29938857183079009, -0.20683908610467319),
    ),
    (
        (0.345, 0.653, 1.0),
        (1.8, 0.4, -0.9),
        10.0,
        (1.8057486941533169, -0.29315907005202235, 0.92915521481064942),
        (0.59095313005987768, -0.7497771466036243, 0.27756735059869179, 0.10754066386713205),
    ),
    (
        (1.0, 1.875, 2.875),
        (0.5, 0.75, 1.0),
        1e3,
        None,
        (0.89834997892268562, 0.024997933189805489, 0.10192471267223579, -0.42656039625418872),
    ),
    (
        (1.0, 1.875, 2.875),
        (0.5, 0.75, 1.0),
        1e6,
        None,
        (0.18396472966240838, -0.12579834796681974, 0.37906201650949952, 0.89813347645481284),
    ),
]


@pytest.mark.parametrize(("moments", "momentum", "t", "momentum_there", "attitude_there"), REGRESSION)
def test_published_values(moments, momentum, t, momentum_there, attitude_there):
    m, q = free_motion(moments, momentum).at(t)
    rounded_input = (
        1.1e-16 * 30.0 * 3
    )  # moments like 0.6 are decimal there: half an ulp of each, times the angle turned
    assert distance(q, attitude_there) < (rounded_input if t == 10.0 else 1e-15)  # 1.875 and so on are exact in binary
    if momentum_there is not None:
        assert np.allclose(m, momentum_there, rtol=0.0, atol=2 * rounded_input)  # |L| is about 2


def test_published_motion_within_1e_12_of_the_intermediate_axis():
    moments = np.array([1.0, 1.875, 2.875])
    motion = free_motion(moments, moments * [1e-12, 1.0, 1e-12])
    m, _ = motion.at(100.0)
    assert np.allclose(m, [-1.0765111111172092e-11, -1.875, 1.7241803476116202e-11], rtol=4e-15)  # 3 digits of e^(σt)
    assert motion.period == pytest.approx(207.39643991872882, rel=1e-15)


@pytest.mark.parametrize(
    ("moments", "momentum", "period"),
    [
        ((0.6, 0.8, 1.0), (1.8, 0.4, -0.9), 6.8626161780581164),
        ((0.345, 0.653, 1.0), (1.8, 0.4, -0.9), 2.2146446558330431),
        ((1.0, 1.875, 2.875), (0.5, 0.75, 1.0), 20.6947551192268),
        ((1.0, 2.0, 3.0), (0.01, 2.0, 0.0), 41.5092195293379),
        ((3.0, 5.0, 9.0), (0.0, 2.0, 0.01), 118.110887046395),
        ((0.3, 0.35, 0.4), (0.03, 5.25, 0.04), 12.3349458093386),
    ],
)
def test_published_periods(moments, momentum, period):
    # the last three are printed to 12 digits for ω, with L = Iω rounded here
    assert free_motion(moments, momentum).period == pytest.approx(period, rel=2e-13)


def carlson_route(moments, momentum, times):
    """Van Zon and Schofield's solution in plain double by scipy's ellipj and elliprj, for moments in rising order."""
    (i1, i2, i3), g = moments, np.linalg.norm(momentum)
    i21, i31, i32 = i2 - i1, i3 - i1, i3 - i2
    squares = np.square(momentum)
    d1 = squares[1] * i21 / i2 + squares[2] * i31 / i3
    d2 = squares[2] * i32 / i3 - squares[0] * i21 / i1
    d3 = -(squares[0] * i31 / i1 + squares[1] * i32 / i2)
    about = 2 if d2 > 0 else 0
    flip = momentum[about] < 0.0
    m = momentum * [-1.0, 1.0, -1.0] if flip else momentum
    b13, b31 = np.sqrt(-i1 * d3 / i31), np.sqrt(i3 * d1 / i31)
    if about == 2:
        mc, speed = d2 * i31 / (d1 * i32), np.sqrt(d1 * i32 / (i1 * i2 * i3))
        b2, n, root, cn0 = np.sqrt(-i2 * d3 / i32), -i3 * i21 / (i1 * i32), np.sqrt(i1 * i32), m[0] / b13
    else:
        mc, speed = d2 * i31 / (d3 * i21), np.sqrt(-d3 * i21 / (i1 * i2 * i3))
        b2, n, root, cn0 = np.sqrt(i2 * d1 / i21), -i1 * i32 / (i3 * i21), np.sqrt(i3 * i21), m[2] / b31
    quarter, sign = ellipkm1(mc), 1.0 if about == 2 else -1.0
    start = ellipkinc(np.arctan2(-m[1] / b2, cn0), 1 - mc)
    third = quarter + n / 3 * elliprj(0.0, mc, 1.0, 1.0 - n)

    def phase_and_momentum(t):
        u = -speed * t + start
        j = np.rint(u / (2 * quarter))
        sn, cn, dn, _ = ellipj(u - 2 * j * quarter, 1 - mc)
        f = u - 2 * j * quarter
        integral = 2 * j * third + f + n / 3 * sn**3 * elliprj(cn**2, dn**2, 1.0, 1 - n * sn**2)
        moment = moments[about]
        drift = -g * i31 / (speed * i1 * i3) * integral + np.arctan2(np.sqrt(i2 * i31) * sn, root * cn) + j * np.pi
        parity = np.where(j % 2 == 0, 1.0, -1.0)
        amplitudes = (b13 * parity * cn, -b2 * parity * sn, b31 * dn)
        if about == 0:
            amplitudes = (b13 * dn, -b2 * parity * sn, b31 * parity * cn)
        return g / moment * t + sign * drift, np.stack(amplitudes, axis=-1)

    def pole(y):
        p0 = np.sqrt((1 + y[..., about] / g) / 2)
        second, first = (y[..., 1], -y[..., 0]) if about == 2 else (y[..., 2], -y[..., 1])
        parts = [p0, second / (2 * g * p0), first / (2 * g * p0)]
        parts.insert(3 if about == 2 else 1, np.zeros_like(p0))
        return np.stack(parts, axis=-1)

    turn = np.array([0.0, 0.0, 1.0, 0.0]) if flip else IDENTITY
    (psi, y), (psi0, _) = phase_and_momentum(times), phase_and_momentum(0.0)
    axis = np.eye(3)[about]
    inner = multiply(exp((psi - psi0)[:, None] * axis), multiply(pole(y), turn))
    left = multiply(turn * [1.0, -1.0, -1.0, -1.0], pole(m) * [1.0, -1.0, -1.0, -1.0])
    return y * ([-1.0, 1.0, -1.0] if flip else 1.0), multiply(left, inner)


def test_agrees_with_the_usual_solution_by_integrals_of_the_third_kind():
    rng = np.random.default_rng(7)
    times = np.linspace(-20.0, 60.0, 41)
    for _ in range(60):
        moments, momentum = np.sort(rng.uniform(0.3, 3.0, 3)), rng.normal(size=3)
        m, q = free_motion(moments, momentum).at(times)
        m_usual, q_usual = carlson_route(moments, momentum, times)
        # plain double in corners: the usual form loses 1e-16/d near the separatrix (d of these cases > 1e-3)
        assert np.max(np.abs(m - m_usual)) < 1e-10
        assert np.max(distance(q, q_usual)) < 1e-10


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
@pytest.mark.parametrize("momentum", [(1.8, 0.4, -0.9), (-0.3, 0.5, 1.7), (0.4, -1.0, -0.5)])
def test_agrees_with_stepping_in_any_order_of_axes(order, momentum):
    moments, momentum = np.array([0.6, 0.8, 1.0])[list(order)], np.array(momentum)
    start = exp([0.3, -0.2, 0.5])

    def rates(_, y):
        return np.concatenate(
            [
                euler.momentum_rate(y[:3], moments),
                euler.attitude_rate(y[3:], euler.angular_velocity(y[:3], moments)),
            ]
        )

    stepped = solve_ivp(rates, (0.0, 9.0), np.concatenate([momentum, start]), method="DOP853", rtol=1e-12, atol=1e-13)
    m, q = free_motion(moments, momentum, start).at(9.0)
    assert np.max(np.abs(m - stepped.y[:3, -1])) < 1e-9  # tolerance of the stepper times some 100 steps
    assert distance(q, stepped.y[3:, -1]) < 1e-9


moments3 = arrays(np.float64, 3, elements=st.floats(0.05, 5.0))
vectors = arrays(np.float64, 3, elements=st.floats(-3.0, 3.0).map(lambda x: 0.0 if abs(x) < 1e-100 else x))


@settings(max_examples=150)
@given(moments3, vectors, st.floats(-1e4, 1e4))
def test_keeps_what_a_free_motion_keeps(moments, momentum, t):
    m, q = free_motion(moments, momentum).at(t)
    size = np.linalg.norm(momentum)
    assert np.linalg.norm(rotate(q, m) - momentum) <= 8e-15 * size  # L in space: some 20 roundings
    assert np.linalg.norm(m) == pytest.approx(size, rel=4e-15)
    assert euler.energy(m, moments) == pytest.approx(euler.energy(momentum, moments), rel=8e-15)
    assert np.linalg.norm(q) == pytest.approx(1.0, abs=4e-15)


def test_going_on_from_a_later_state_is_the_same_motion():
    rng = np.random.default_rng(21)
    moments, momenta = rng.uniform(0.3, 3.0, (200, 3)), rng.normal(size=(200, 3))
    first, second = 7.3, 4.1
    motion = free_motion(moments, momenta, exp([1.0, 2.0, 0.5]))
    m, q = motion.at(first)
    m_on, q_on = free_motion(moments, m, q).at(second)
    m_all, q_all = motion.at(first + second)
    # the state in between is rounded; that grows with the angle turned and near the saddle by exp(growth rate * time)
    turned = np.linalg.norm(momenta, axis=-1) / np.min(moments, axis=-1) * (first + second)
    allowed = 1e-15 * (4.0 + turned) * np.exp(growth_rate(moments, np.linalg.norm(momenta, axis=-1)) * second)
    assert np.all(distance(q_on, q_all) < allowed)
    assert np.all(np.linalg.norm(m_on - m_all, axis=-1) < allowed * np.linalg.norm(momenta, axis=-1))
    assert np.median(allowed) < 1e-12  # so that the test can fail


def test_attitude_follows_the_angular_velocity():
    rng = np.random.default_rng(3)
    moments, momenta = rng.uniform(0.3, 3.0, (40, 3)), rng.normal(size=(40, 3))
    motion, h = free_motion(moments, momenta), 1e-4
    m, q = motion.at(np.array([5.0 - h, 5.0, 5.0 + h]))
    q = continuous(q)
    rate = euler.attitude_rate(q[:, 1], euler.angular_velocity(m[:, 1], moments))
    speed = np.max(np.abs(euler.angular_velocity(m[:, 1], moments)))
    assert np.max(np.abs((q[:, 2] - q[:, 0]) / (2 * h) - rate)) < h**2 * (1 + speed) ** 3  # central difference


def test_extreme_bodies_stay_finite_and_keep_their_invariants():
    rng = np.random.default_rng(5)
    n = 4000
    moments, kinds = 10.0 ** rng.uniform(-12, 0, (n, 3)), rng.integers(0, 4, n)
    moments[kinds == 1, 1] = moments[kinds == 1, 0] * (1.0 + 1e-12 * rng.integers(-3, 4, np.sum(kinds == 1)))
    moments[kinds == 2, 2] = moments[kinds == 2, 0]
    momenta = rng.normal(size=(n, 3)) * 10.0 ** (rng.uniform(-110, 0, (n, 3)) * (rng.uniform(size=(n, 3)) < 0.3))
    momenta[rng.uniform(size=(n, 3)) < 0.1] = 0.0
    m, q = free_motion(moments, momenta).at([0.0, 1.0, 1e8])
    size = np.linalg.norm(momenta, axis=-1)[:, None]
    assert np.all(np.linalg.norm(rotate(q, m) - momenta[:, None], axis=-1) <= 4e-15 * size)  # some 20 roundings
    energy0 = euler.energy(momenta, moments)[:, None]
    assert np.all(
        np.abs(euler.energy(m, moments[:, None]) - energy0) <= 4e-15 * energy0
    )  # each part is exact by itself


def test_symmetric_top_is_two_turns():
    moments, momentum = np.array([1.3, 1.3, 0.4]), np.array([0.5, -0.2, 0.7])
    times = np.linspace(0.0, 50.0, 11)
    _, q = free_motion(moments, momentum).at(times)
    in_space = exp(times[:, None] * momentum / 1.3)  # precession |L|/I about L
    in_body = exp(times[:, None] * np.array([0.0, 0.0, 0.7]) * (1 / 0.4 - 1 / 1.3))  # and the spin that is left
    assert np.max(distance(q, multiply(in_space, in_body))) < 2e-14  # the closed form in plain double: 1e-16 of 60 rad


@pytest.mark.parametrize(
    ("moments", "momentum"),
    [
        ((2.0, 2.0, 2.0), (0.3, -0.4, 1.2)),
        ((0.0, 2.0, 2.0), (0.0, -0.4, 1.2)),
        ((1.0, 2.0, 3.0), (0.0, 0.0, -1.2)),
        ((1.0, 2.0, 3.0), (0.0, 1.2, 0.0)),
        ((2.0, 1.0, 2.0), (0.5, 0.0, 1.2)),
        ((1.0, 2.0, 3.0), (0.0, 0.0, 0.0)),
    ],
)
def test_steady_motions_turn_about_a_fixed_axis(moments, momentum):
    motion = free_motion(moments, momentum)
    m, q = motion.at([0.0, 1.0, 7.5])
    omega = euler.angular_velocity(momentum, moments)
    assert motion.steady
    assert np.isinf(motion.period)
    assert np.array_equal(m, np.tile(momentum, (3, 1)))
    assert np.max(distance(q, exp(np.array([0.0, 1.0, 7.5])[:, None] * omega))) < 4e-15  # the comparison's own rounding


def test_separatrix_ends_on_the_intermediate_axis():
    motion = free_motion([3.0, 4.0, 6.0], [0.7, 0.2, -0.7])
    m, _ = motion.at([-1e6, 0.0, 1e6])
    size = np.linalg.norm([0.7, 0.2, -0.7])
    assert motion.separatrix
    assert np.isinf(motion.period)
    assert np.allclose(np.abs(m[[0, 2]]), [0.0, size, 0.0], atol=1e-15)  # sech of 1e5 is zero
    assert m[0, 1] == pytest.approx(-m[2, 1])
    assert np.allclose(m[1], [0.7, 0.2, -0.7], atol=4e-16)
    size_rate = motion.turning_rate
    assert size_rate == pytest.approx(size / 4.0, rel=1e-15)  # it turns about the intermediate axis nearly always


def test_joins_across_the_separatrix_and_across_the_change_of_series():
    moments = np.array([1.0, 2.0, 3.0])
    on = np.sqrt(3.0)  # L3/L1 of the separatrix
    times = np.linspace(0.0, 6.0, 13)
    for at, step in ((on, 1e-9), (2.0, 1e-9)):
        ratios = at * (1.0 + step * np.array([-1.0, 1.0]))
        momenta = np.stack([[0.7, 0.1, 0.7 * r] for r in ratios])
        m, q = free_motion(moments, momenta).at(times)
        assert np.max(np.abs(m[0] - m[1])) < 100 * step  # grows like exp(σt), σ = 0.4
        assert np.max(distance(q[0], q[1])) < 100 * step
    # both series at the modulus where one hands over to the other, mc = 0.2
    low, high = _ratio_with_modulus(moments, 0.2 - 1e-12), _ratio_with_modulus(moments, 0.2 + 1e-12)
    motion = free_motion(moments, [[0.7, 0.1, low], [0.7, 0.1, high]])
    assert motion.rows.kind[0] != motion.rows.kind[1]
    m, q = motion.at(times)
    assert np.max(np.abs(m[0] - m[1])) < 1e-10  # the momenta differ by 1e-12
    assert np.max(distance(q[0], q[1])) < 1e-10


def _ratio_with_modulus(moments, mc):
    """L3 for L = (0.7, 0.1, L3) such that mc = D2 I31 / (D1 I32)."""
    i1, i2, i3 = moments
    # D2 I31 = mc D1 I32 is linear in L3²
    a = (i3 - i2) / i3 * (i3 - i1) - mc * (i3 - i1) / i3 * (i3 - i2)
    b = 0.49 * (i2 - i1) / i1 * (i3 - i1) + mc * 0.01 * (i2 - i1) / i2 * (i3 - i2)
    return np.sqrt(b / a)


@pytest.mark.parametrize("gap", [1e-4, 1e-8, 1e-12])
def test_near_symmetric_joins_symmetric(gap):
    times, momentum = np.linspace(0.0, 20.0, 9), np.array([0.5, -0.2, 0.7])
    for near, exactly in (((1.0, 1.0 + gap, 1.6), (1.0, 1.0, 1.6)), ((1.0, 1.6, 1.6 + gap), (1.0, 1.6, 1.6))):
        difference = distance(free_motion(near, momentum).at(times)[1], free_motion(exactly, momentum).at(times)[1])
        assert np.max(difference) < 20 * gap + 1e-14  # the moments differ by gap, turned through about 20 rad


def test_small_component_keeps_its_relative_accuracy():
    # 1e-12 off the intermediate axis: the small parts grow by cosh and sinh of σt, each to full relative accuracy
    moments, size = np.array([1.0, 2.0, 3.0]), 2.0
    sigma = size / 2.0 * np.sqrt(1.0 / 3.0)
    t = 5.0
    m, _ = free_motion(moments, [1e-12, size, 0.0]).at(t)
    assert m[0] == pytest.approx(1e-12 * np.cosh(sigma * t), rel=1e-13)  # next order: 1e-24; σt known to 1e-15


def test_bodies_and_times_at_once_equal_one_by_one():
    rng = np.random.default_rng(9)
    moments = np.array(
        [[1.0, 2.0, 3.0], [2.0, 2.0, 2.0], [0.0, 1.0, 1.0], [3.0, 4.0, 6.0], [1.0, 1.0, 2.0], [5.0, 1.0, 3.0]]
    )
    momenta = np.array([[1.0, 0.2, 0.3], [1, 2, 3], [0, 2, 1], [1, 1, 1], [0.1, 1, 1], [0.2, 0.4, -2.0]])
    starts = uniform(6, rng=rng)
    times = rng.uniform(-10.0, 10.0, (4, 5))
    m, q = free_motion(moments.reshape(2, 3, 3), momenta.reshape(2, 3, 3), starts.reshape(2, 3, 4)).at(times)
    assert m.shape == (2, 3, 4, 5, 3)
    assert q.shape == (2, 3, 4, 5, 4)
    for b in range(6):
        m_one, q_one = free_motion(moments[b], momenta[b], starts[b]).at(times)
        assert np.array_equal(m.reshape(6, 4, 5, 3)[b], m_one)
        assert np.array_equal(q.reshape(6, 4, 5, 4)[b], q_one)


def test_one_body_many_momenta_broadcasts():
    m, q = free_motion([1.0, 2.0, 3.0], np.ones((7, 3))).at(1.0)
    assert m.shape == (7, 3)
    assert q.shape == (7, 4)


def test_starts_where_it_was_put():
    rng = np.random.default_rng(12)
    moments, momenta, starts = rng.uniform(0.3, 3, (50, 3)), rng.normal(size=(50, 3)), uniform(50, rng=rng)
    m, q = free_motion(moments, momenta, starts).at(0.0)
    assert np.max(np.abs(m - momenta)) < 4e-15  # sn, cn, dn of the initial phase, times |L| of 4
    assert np.max(distance(q, starts)) < 2e-15


@pytest.mark.parametrize(("unit_i", "unit_m"), [(1e-46, 1e-34), (1e30, 1e40), (1e-3, 1e20)])
def test_units_do_not_matter(unit_i, unit_m):
    times = np.linspace(0.0, 50.0, 6)
    moments, momentum = np.array([1.0, 2.2, 2.9]), np.array([0.4, 1.0, -0.2])
    m, q = free_motion(moments, momentum).at(times)
    m_units, q_units = free_motion(moments * unit_i, momentum * unit_m).at(times * unit_i / unit_m)
    assert np.max(distance(q, q_units)) < 1e-13  # moments, momenta and times are rounded anew: 50 rad of 1e-16, growing
    assert np.allclose(m_units, m * unit_m, rtol=0, atol=1e-13 * unit_m)


def test_double_double_phases_are_what_keeps_a_million_periods():
    motion = free_motion([1.0, 1.875, 2.875], [0.5, 0.75, 1.0])
    truth = (0.18396472966240838, -0.12579834796681974, 0.37906201650949952, 0.89813347645481284)
    assert distance(motion.at(1e6)[1], truth) < 1e-15
    rounded = motion.rows._replace(rates=motion.rows.rates * [1.0, 0.0, 1.0, 0.0, 1.0, 0.0])
    assert 1e-12 < distance(replace(motion, rows=rounded).at(1e6)[1], truth) < 1e-9  # 5e4 periods of some 2e-15


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: free_motion([1.0, 2.0, 3.0], [1.0, 0.0, np.nan]), "not finite"),
        (lambda: free_motion([1.0, 2.0, -3.0], [1.0, 0.0, 0.0]), "not negative"),
        (lambda: free_motion([0.0, 2.0, 2.0], [1.0, 0.0, 0.0]), "about its own axis"),
        (lambda: free_motion([1.0, 2.0, 3.0], [1e-130, 1.0, 1e-130]), "set it to 0"),
        (lambda: free_motion([1.0, 2.0, 3.0], [1.0, 1.0, 1.0], [0.0, 0.0, 0.0, 0.0]), "zero or undefined length"),
        (lambda: free_motion([1.0, 2.0, 3.0], [1.0, 1.0, 1.0]).at(np.inf), "time is not finite"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_moments_too_far_apart_are_refused_with_a_remedy():
    with pytest.raises(ValueError, match=r"expected the smallest above 1e-100 of the largest.*\(0, I, I\)"):
        free_motion([1e-300, 1.0, 2.0], [0.0, 1.0, 1.0])
    with pytest.raises(ValueError, match="1e-100 of the largest"):
        free_motion([1.0, 2.0, 1e300], [1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="choose units"):
        free_motion([1e-300, 2e-300, 2.5e-300], [1e5, 2.0, 3.0])
    steady = free_motion([1e-300, 1.0, 1.0], [0.0, 1.0, 1.0]).at(0.3)[1]  # L stands still: exact all the same
    assert np.allclose(steady, exp(0.3 * np.array([0.0, 1.0, 1.0])), atol=1e-15)
    tiny = free_motion([1e-300, 2e-300, 2.5e-300], [1e-300, 2e-300, 3e-300])  # small moments are no matter, only units
    usual = free_motion([1.0, 2.0, 2.5], [1.0, 2.0, 3.0])
    assert np.allclose(tiny.at(0.7)[1], usual.at(0.7)[1], atol=1e-14)


def test_a_moment_just_above_the_limit_moves_as_it_should():
    """I1 = 1e-90: L turns about axis 1 at L1/I1, so that the phase is known in steps of I1 and the motion is a cone."""
    motion = free_motion([1e-90, 1.0, 1.0 + 1e-3], [1e-92, 0.6, 0.8])
    momentum, attitude = motion.at(np.linspace(0.0, 3e-90, 7))
    assert np.all(np.isfinite(attitude))
    assert np.allclose(np.linalg.norm(momentum, axis=-1), 1.0, atol=1e-14)
    assert np.allclose(rotate(attitude, momentum), [0.0, 0.6, 0.8], atol=1e-14)
