"""Integrators: the order they claim, what they keep, rounding over many steps, reversal, refusals."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rotor.classical.effects.dipole_in_field import PermanentDipole
from rotor.classical.effects.gyrostat import SpinningRotor
from rotor.classical.euler import energy
from rotor.classical.free.free_motion import free_motion
from rotor.classical.integrators import compositions
from rotor.classical.integrators.exact_drift import ExactDrift
from rotor.classical.integrators.lie_runge_kutta import LieRungeKutta
from rotor.classical.integrators.method import integrate
from rotor.classical.integrators.moser_veselov import MoserVeselov, exact_modified_moments, modified_moments
from rotor.classical.integrators.splitting import RotationSplitting, SymmetricTopSplitting
from rotor.geometry.rotations import distance, rotate

MOMENTS, MOMENTUM, PERIOD = np.array([1.0, 1.875, 2.875]), np.array([0.5, 0.75, 1.0]), 20.6947551192268
EFFECTS = [PermanentDipole([0.3, 0.2, 0.5], [0.0, 0.0, 0.7]), SpinningRotor([0.1, 0.2, 0.3])]

FREE = [
    *[(RotationSplitting, order, steps) for order, steps in ((2, 60), (4, 40), (6, 30), (8, 30))],
    *[(SymmetricTopSplitting, order, steps) for order, steps in ((2, 60), (4, 40), (6, 30), (8, 30))],
    *[(MoserVeselov, order, steps) for order, steps in ((2, 240), (4, 60), (6, 40), (8, 30))],
]


def attitude_error(method, span, **options):
    """Error of the attitude of free motion after `span` periods, in radians."""
    end = integrate(method, MOMENTS, MOMENTUM, [0.0, span * PERIOD], **options).attitude[-1]
    return float(distance(end, free_motion(MOMENTS, MOMENTUM).at(span * PERIOD)[1]))


def slope(errors, steps):
    """Order from errors at two step lengths, `steps` the numbers of steps."""
    return np.log(errors[0] / errors[1]) / np.log(steps[1] / steps[0])


@pytest.mark.parametrize(("kind", "order", "steps"), FREE)
def test_measured_order_of_free_motion_is_the_one_claimed(kind, order, steps):
    counts = [steps, 2 * steps]
    errors = [attitude_error(kind(PERIOD / n, order), 2) for n in counts]
    assert abs(slope(errors, counts) - order) < 0.35  # next term of the error: (step)² of the leading one
    assert errors[1] > 1e-13  # far from rounding, so the slope means something


def test_measured_order_of_the_lie_group_method():
    counts = [30, 60]
    errors = [attitude_error(LieRungeKutta(fixed_step=PERIOD / n), 2) for n in counts]
    assert 7.5 < slope(errors, counts) < 10.5  # at least 8: DOP853's eighth-order error is small beside the ninth's


@pytest.mark.parametrize("order", [2, 4, 6])
@pytest.mark.parametrize(
    "method",
    [
        lambda step, order: RotationSplitting(step, order),
        lambda step, order: SymmetricTopSplitting(step, order),
        lambda step, order: MoserVeselov(step, 0, order),
        lambda step, order: ExactDrift(step, order),
    ],
    ids=["rotations", "symmetric", "moser-veselov", "exact"],
)
def test_measured_order_with_torque_and_rotor(method, order):
    span = 1.0 if isinstance(method(1.0, 2), ExactDrift) else 5.0
    reference = integrate(LieRungeKutta(1e-13), MOMENTS, MOMENTUM, [0.0, span], effects=EFFECTS).attitude[-1]
    counts = [int(5 * span), int(10 * span)]
    ends = [integrate(method(span / n, order), MOMENTS, MOMENTUM, [0.0, span], effects=EFFECTS) for n in counts]
    errors = [float(distance(end.attitude[-1], reference)) for end in ends]
    assert abs(slope(errors, counts) - order) < 0.3  # next term of the error
    assert errors[1] > 1e-12


def test_two_methods_without_a_common_formula_agree_under_torque():
    lie = integrate(LieRungeKutta(1e-13), MOMENTS, MOMENTUM, [0.0, 20.0], effects=EFFECTS)
    split = integrate(RotationSplitting(0.02, 8), MOMENTS, MOMENTUM, [0.0, 20.0], effects=EFFECTS)
    assert distance(lie.attitude[-1], split.attitude[-1]) < 1e-11  # 300 steps of tolerance 1e-13, rounding of 1000
    assert np.allclose(lie.energy, lie.energy[0], rtol=0, atol=1e-12)  # both effects are conservative


LONG = [
    (RotationSplitting(PERIOD / 80, 8), 60_000, 3e-15),
    (SymmetricTopSplitting(PERIOD / 80, 8), 60_000, 3e-15),
    (MoserVeselov(PERIOD / 40, 8), 1_000_000, 1.5e-13),  # 4e-17 √steps, and as much again to be safe
    (MoserVeselov(PERIOD / 20, 0), 1_000_000, 1.5e-13),  # a root rounded to double precision leaves 4e-13
]


@pytest.mark.parametrize(("method", "steps", "bound"), LONG, ids=lambda value: getattr(value, "order", None))
def test_invariants_after_a_million_turns(method, steps, bound):
    # 17 substeps of five turns make 60 000 steps of order 8 five million turns
    end = integrate(method, MOMENTS, MOMENTUM, [0.0, steps * method.step])
    drift = end.energy[-1] / end.energy[0] - 1.0
    truncation = 4e-13 if isinstance(method, (RotationSplitting, SymmetricTopSplitting)) else 0.0
    assert abs(drift) < bound + truncation  # sums that are not compensated make 1e-16 x 10⁶
    assert abs(np.linalg.norm(end.momentum[-1]) / np.linalg.norm(MOMENTUM) - 1.0) < 2e-13  # random walk
    assert abs(np.linalg.norm(end.attitude[-1]) - 1.0) < 2e-13
    in_space = rotate(end.attitude[-1], end.momentum[-1])
    assert np.max(np.abs(in_space - MOMENTUM)) < 1e-11  # rounding of the attitude


def test_energy_of_splitting_is_bounded_without_drift():
    times = np.arange(0.0, 2000.0, 1.0) * PERIOD / 80 * 37  # 74 000 steps, sampled at all phases
    error = integrate(RotationSplitting(PERIOD / 80, 2), MOMENTS, MOMENTUM, times).energy
    halves = np.mean(error[:1000]), np.mean(error[1000:])
    assert 1e-5 < np.ptp(error) / error[0] < 1e-3  # it oscillates: second order is seen
    assert abs(halves[0] - halves[1]) < 0.02 * np.ptp(error)  # and does not drift: sampling noise of 1000 phases


METHODS = [
    RotationSplitting(0.1, 4),
    SymmetricTopSplitting(0.1, 2),
    MoserVeselov(0.3, 6),
    MoserVeselov(0.3, 0),
    LieRungeKutta(1e-12),
    ExactDrift(0.5),
]


@pytest.mark.parametrize("method", METHODS, ids=lambda m: type(m).__name__)
def test_reversal_brings_the_start_back(method):
    out = integrate(method, MOMENTS, MOMENTUM, [0.0, 3.0, 9.0])
    back = integrate(method, MOMENTS, out.momentum[-1], [9.0, 0.0], out.attitude[-1])
    assert np.max(np.abs(back.momentum[-1] - MOMENTUM)) < 1e-11  # rounding of 100 steps, or the Lie tolerance
    assert distance(back.attitude[-1], [1.0, 0, 0, 0]) < 1e-11


@pytest.mark.parametrize("method", METHODS[:4], ids=lambda m: type(m).__name__)
def test_reversal_with_torque(method):
    out = integrate(method, MOMENTS, MOMENTUM, [0.0, 6.0], effects=EFFECTS)
    back = integrate(method, MOMENTS, out.momentum[-1], [6.0, 0.0], out.attitude[-1], EFFECTS)
    assert np.max(np.abs(back.momentum[-1] - MOMENTUM)) < 1e-13  # symmetric steps: rounding only


def test_quaternion_stays_a_unit_by_itself():
    for method in METHODS:
        end = integrate(method, MOMENTS, MOMENTUM, [0.0, 500.0]).attitude[-1]
        assert abs(np.linalg.norm(end) - 1.0) < 1e-13  # nothing renormalises; rounding of some thousand steps


def test_symmetric_top_splitting_is_exact_for_symmetric_tops_spheres_and_linear_rotors():
    for moments, momentum in (([2.0, 2.0, 1.0], [1.0, 0.5, 2.0]), ([1, 1, 1], [1.0, 2, 3]), ([0, 2.0, 2], [0, 1.0, 3])):
        stepped = integrate(SymmetricTopSplitting(0.7), moments, momentum, [0.0, 70.0])
        m, q = free_motion(moments, momentum).at(70.0)
        assert np.max(np.abs(stepped.momentum[-1] - m)) < 1e-12  # 100 steps of rounding, angle of 200 rad
        assert distance(stepped.attitude[-1], q) < 1e-12


@pytest.mark.parametrize("method", METHODS[1:], ids=lambda m: type(m).__name__)
def test_a_linear_rotor_moves_as_the_free_motion(method):
    moments, momentum = [2.0, 0.0, 2.0], [0.6, 0.0, 0.9]
    end = integrate(method, moments, momentum, [0.0, 10.0])
    bound = 1e-4 if isinstance(method, MoserVeselov) else 1e-9  # orders 6 and 8: truncation at h|ω| = 0.16
    assert distance(end.attitude[-1], free_motion(moments, momentum).at(10.0)[1]) < bound
    assert end.momentum[-1, 1] == pytest.approx(0.0, abs=1e-10)


@settings(max_examples=25)
@given(st.lists(st.floats(0.5, 2.0), min_size=3, max_size=3), st.lists(st.floats(-1, 1), min_size=3, max_size=3))
def test_exact_moser_veselov_is_the_free_motion(moments, momentum):
    momentum = np.round(momentum, 12) + np.array([0.0, 0.0, 1e-3])
    step = 0.5 / np.linalg.norm(momentum / np.array(moments))
    end = integrate(MoserVeselov(step, 0), moments, momentum, [0.0, 50 * step])
    m, q = free_motion(moments, momentum).at(50 * step)
    assert np.max(np.abs(end.momentum[-1] - m)) < 1e-9 * np.linalg.norm(momentum)  # saddle: e^12 x rounding at worst
    assert distance(end.attitude[-1], q) < 1e-9


@pytest.mark.parametrize("small", [1e-9, 1e-11, 1e-12, 1e-13, 0.0])
def test_turns_all_but_about_one_axis_have_exact_moments(small: float):
    """The two unknowns of the map are then hardly separate, condition numbers 1/small."""
    for moments, momentum in (([1.0, 1.0, 0.5], [0.0, small, 1.0]), ([1.0, 0.8, 0.5], [1.0, small, 0.0])):
        end = integrate(MoserVeselov(0.1, 0), moments, momentum, [0.0, 10.0]).momentum[-1]
        exact = free_motion(np.array(moments), np.array(momentum)).at(np.array([0.0, 10.0]))[0][-1]
        assert (
            np.abs(end - exact).max() < 2.5e-13
        )  # a hundred roundings; of singular values below 1e-13 the motion, twice `small`


def test_series_of_modified_moments_approaches_the_exact_ones():
    exact = exact_modified_moments(MOMENTS[None], MOMENTUM[None], 0.2)
    series = [modified_moments(MOMENTS[None], MOMENTUM[None], 0.2, order) for order in (2, 4, 6, 8)]
    gaps = [np.max(np.abs(moments - exact)) for moments in series]
    assert gaps[0] > 1e-3  # unmodified moments are far
    assert all(later < 0.05 * earlier for earlier, later in pairwise(gaps))  # each term is h² smaller


def test_compositions_satisfy_their_order_conditions():
    for order in (2, 4, 6, 8):
        gamma = compositions.fractions(order)
        assert np.array_equal(gamma, gamma[::-1])
        for power in range(1, order, 2):
            assert np.sum(gamma**power) == pytest.approx(1.0 if power == 1 else 0.0, abs=3e-15)  # rounding of 17 terms
    with pytest.raises(ValueError, match="2, 4, 6 and 8"):
        compositions.fractions(3)


def test_shapes_broadcast_over_bodies():
    momenta = np.stack([MOMENTUM, 2.0 * MOMENTUM, [0.1, 0.2, 0.3]]).reshape(3, 1, 3)
    moments = np.stack([MOMENTS, [2.0, 1.0, 1.5]])
    together = integrate(RotationSplitting(0.1, 4), moments, momenta, [0.0, 1.0, 4.0], effects=EFFECTS)
    assert together.momentum.shape == (3, 2, 3, 3)
    assert together.energy.shape == (3, 2, 3)
    alone = integrate(RotationSplitting(0.1, 4), moments[1], momenta[2, 0], [0.0, 1.0, 4.0], effects=EFFECTS)
    assert np.allclose(together.attitude[2, 1], alone.attitude, atol=1e-15)


def test_energy_column_is_that_of_euler():
    motion = integrate(MoserVeselov(0.2, 4), MOMENTS, MOMENTUM, [0.0, 1.0])
    assert np.allclose(motion.energy, energy(motion.momentum, MOMENTS), rtol=1e-15)
    assert np.allclose(motion.omega, motion.momentum / MOMENTS, rtol=1e-15)


def test_refusals_say_what_would_do():
    from rotor.classical.effects.drag import LinearDrag

    with pytest.raises(ValueError, match="LieRungeKutta"):
        integrate(RotationSplitting(0.1), MOMENTS, MOMENTUM, [0.0, 1.0], effects=[LinearDrag([1, 1, 1])])
    with pytest.raises(ValueError, match="SymmetricTopSplitting"):
        integrate(RotationSplitting(0.1), [0, 1, 1], [0, 1, 1], [0.0, 1.0])
    with pytest.raises(ValueError, match="shorter step"):
        integrate(MoserVeselov(5.0, 4), MOMENTS, MOMENTUM, [0.0, 10.0])
    with pytest.raises(ValueError, match="all increase"):
        integrate(RotationSplitting(0.1), MOMENTS, MOMENTUM, [0.0, 1.0, 1.0])
    with pytest.raises(ValueError, match="positive time"):
        RotationSplitting(-0.1)
    with pytest.raises(ValueError, match="order 2, 4, 6 or 8"):
        MoserVeselov(0.1, 5)
    with pytest.raises(ValueError, match="expected classical effects"):
        integrate(RotationSplitting(0.1), MOMENTS, MOMENTUM, [0.0, 1.0], effects=["drag"])


def test_sine_and_versed_sine_of_a_turn_belong_together_beyond_double_precision():
    from rotor.classical.integrators._step_kernels import _squared_length, _versed

    rng = np.random.default_rng(0)
    for half in rng.uniform(0.01, 0.2, 200):
        vector = np.sin(half) * rng.normal(size=3) / np.sqrt(3.0)
        cosine = float(np.sqrt(1.0 - np.sum(vector**2)))
        v, low = _versed(*_squared_length(*vector), cosine)
        square = sum(Fraction(float(x)) ** 2 for x in vector)
        excess = (1 - Fraction(v) - Fraction(low)) ** 2 + square - 1
        assert abs(float(excess)) < 1e-19  # without `low` 2e-18, in one direction for a turn that repeats


def test_the_root_of_moser_and_veselov_is_known_beyond_double_precision():
    from rotor.classical.integrators._step_kernels import _near_root, _refined

    rng = np.random.default_rng(1)
    for _ in range(100):
        j = np.rint(rng.uniform(2.0, 8.0, 3) * 2**49) / 2**49
        d = (j[1] - j[2], j[2] - j[0], j[0] - j[1])  # exact on that grid
        m, lost = 0.4 * rng.normal(size=3), 1e-17 * rng.normal(size=3)
        near, settled = _near_root(tuple(m), tuple(j), d, tuple(m / j))
        assert settled
        high, low = _refined(tuple(m), lost, tuple(j), d, near)
        x = [Fraction(float(a)) + Fraction(float(b)) for a, b in zip(high, low, strict=True)]
        size = 1 + sum(c * c for c in x)
        for i, k, n in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            momentum = Fraction(float(m[i])) + Fraction(float(lost[i]))
            residual = size * momentum + Fraction(float(d[i])) * x[k] * x[n] - Fraction(float(j[i])) * x[i]
            assert abs(float(residual)) < 1e-22  # x of 26 bits leaves 1e-8, known to 1e-16; rounded to double: 1e-16


def test_compensated_sums_hold_the_lengths_thirty_times_better():
    rng = np.random.default_rng(3)
    moments, momenta = rng.uniform(0.5, 2.0, (12, 3)), rng.normal(size=(12, 3)) * 0.5
    motion = integrate(RotationSplitting(0.1), moments, momenta, [0.0, 2e4])
    lengths = np.linalg.norm(motion.momentum[:, -1], axis=-1) / np.linalg.norm(momenta, axis=-1) - 1.0
    assert np.sqrt(np.mean(lengths**2)) < 4e-15  # 200 000 steps; 3e-14 when the carry is dropped
    assert np.sqrt(np.mean((np.linalg.norm(motion.attitude[:, -1], axis=-1) - 1.0) ** 2)) < 4e-15


@pytest.mark.parametrize("times", [[0.0, 1.0, 1.0], [0.0, 2.0, 1.0], [0.0, 0.0]])
def test_times_that_turn_back_or_stand_still_are_refused(times):
    with pytest.raises(ValueError, match="times must all increase, or all decrease, without repetition"):
        integrate(RotationSplitting(0.1), MOMENTS, MOMENTUM, times)


@pytest.mark.parametrize("tolerance", [0.0, 1.0, -1e-9, float("nan")])
def test_a_tolerance_is_between_0_and_1(tolerance):
    with pytest.raises(ValueError, match="the tolerance is a number between 0 and 1"):
        LieRungeKutta(tolerance)
