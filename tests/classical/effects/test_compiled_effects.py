"""Compiled forms of effects and motions beside the plain ones: the same numbers to round-off, and where each is used."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from rotor.classical.effects.changing_inertia import ChangingInertia
from rotor.classical.effects.dipole_in_field import InducedDipole, PermanentDipole
from rotor.classical.effects.drag import LinearDrag, QuadraticDrag
from rotor.classical.effects.drive import PeriodicDrive
from rotor.classical.effects.gravity import GravityAboutPivot
from rotor.classical.effects.gyrostat import SpinningRotor
from rotor.classical.effects.ideal_fluid import FluidImpulse
from rotor.classical.effects.optical_centrifuge import OpticalCentrifuge
from rotor.classical.effects.rolling import RollingEllipsoid
from rotor.classical.effects.torques import ConstantTorque, TimedTorque
from rotor.classical.integrators import lie_runge_kutta, splitting
from rotor.classical.integrators._torque_kernels import torque_at
from rotor.classical.integrators.driven_batch import propagate_driven
from rotor.classical.integrators.lie_runge_kutta import LieRungeKutta
from rotor.classical.integrators.method import integrate
from rotor.classical.integrators.splitting import SymmetricTopSplitting
from rotor.classical.system import flatten_system
from rotor.geometry.rotations import uniform

MOMENTS, MOMENTUM = np.array([1.0, 1.4, 2.0]), np.array([0.6, -0.3, 0.8])
TIMES = np.array([0.2, 1.0, 1.1, 3.0])
PLACE_EFFECTS = {
    "constant, body": ConstantTorque([0.1, 0.2, -0.1]),
    "constant, space": ConstantTorque([0.1, 0.2, -0.1], "space"),
    "drive": PeriodicDrive([0.2, 0.0, 0.1], 1.3, 0.4),
    "drive, space": PeriodicDrive([0.2, 0.0, 0.1], 1.3, 0.4, "space"),
    "dipole": PermanentDipole([0.5, 0.2, 0.1], [0.0, 0.3, 0.8]),
    "induced": InducedDipole([[1.0, 0.2, 0.0], [0.2, 0.5, 0.0], [0.0, 0.0, 0.3]], [0.9, 0.0, 0.8]),
    "centrifuge": OpticalCentrifuge([[1.0, 0.2, 0.0], [0.2, 0.5, 0.0], [0.0, 0.0, 0.3]], 1.1, 0.6, 0.9, 0.3),
    "pivot": GravityAboutPivot(1.2, [0.1, 0.0, 0.6], [0.0, 0.0, -1.0]),
    "impulse": FluidImpulse([1.0, -0.5, 0.3], [1.0, 2.0, 3.0]),
}
ALL_EFFECTS = PLACE_EFFECTS | {
    "linear drag": LinearDrag([[0.1, 0.3, 0.0], [-0.2, 0.2, 0.0], [0.0, 0.1, 0.3]]),
    "quadratic drag": QuadraticDrag([0.1, 0.2, 0.3]),
}

ROLLING = RollingEllipsoid(
    1.1, [0.9, 0.6, 0.4], [0.0, 0.3, -5.0], [0.0, 0.02, 0.1], [0.9950041652780258, 0.0, 0.0, 0.09983341664682815]
)


class Doubled(ConstantTorque):
    """A user's change of the plain form alone."""

    def torque(self, time, attitude, omega):
        return 2.0 * super().torque(time, attitude, omega)


def both(method, effects, monkeypatch, attitude=(1.0, 0, 0, 0), moments=MOMENTS, momentum=MOMENTUM):
    """The compiled and the plain motion."""
    motions = []
    for few in (0, np.inf):
        monkeypatch.setattr(splitting, "WORTH_LOADING", few)
        monkeypatch.setattr(lie_runge_kutta, "PLAIN_STEPS", few)
        motions.append(integrate(method, moments, momentum, TIMES, attitude, effects))
    return motions


@pytest.mark.parametrize("name", ALL_EFFECTS)
def test_the_compiled_torque_is_the_plain_one(name):
    form = flatten_system(MOMENTS, [ALL_EFFECTS[name]]).compiled
    rng = np.random.default_rng(3)
    for attitude, omega, time in zip(uniform(5, rng=rng), rng.normal(size=(5, 3)), rng.uniform(0, 9, 5), strict=True):
        plain = ALL_EFFECTS[name].torque(time, attitude[None], omega[None])[0]
        compiled = torque_at(form.codes, form.parameters, time, tuple(attitude), tuple(omega))
        assert np.allclose(compiled, plain, rtol=0, atol=2e-15)  # round-off of numbers of size 1


@pytest.mark.parametrize("order", [2, 4])
def test_kicks_and_drifts_are_those_of_the_plain_form(order, monkeypatch):
    effects = [*PLACE_EFFECTS.values(), SpinningRotor([0.2, 0.0, 0.5])]
    attitude = uniform(3, rng=np.random.default_rng(1))
    momenta = np.random.default_rng(2).normal(size=(3, 3))
    method = SymmetricTopSplitting(0.01, order)
    compiled, plain = both(
        method, effects, monkeypatch, attitude, [[1.0, 1.4, 2.0], [2.0, 1.0, 1.4], [1, 1, 1]], momenta
    )
    for first, other in ((compiled.momentum, plain.momentum), (compiled.attitude, plain.attitude)):
        assert np.allclose(first, other, rtol=0, atol=1e-14)  # the same operations; sums may be fused
    assert np.allclose(compiled.energy, plain.energy, rtol=0, atol=1e-13)
    assert compiled.steps == plain.steps


@pytest.mark.parametrize("options", [{"tolerance": 1e-9}, {"fixed_step": 0.07}])
def test_the_lie_group_method_is_that_of_the_plain_form(options, monkeypatch):
    effects = [*ALL_EFFECTS.values(), SpinningRotor([0.2, 0.0, 0.5])]
    compiled, plain = both(LieRungeKutta(**options), effects, monkeypatch)
    assert compiled.steps == plain.steps
    for first, other in ((compiled.momentum, plain.momentum), (compiled.attitude, plain.attitude)):
        assert np.allclose(
            first, other, rtol=0, atol=1e-12
        )  # steps chosen from sums in another order: 1e-16/step², times 100


@pytest.mark.slow
def test_a_body_that_rolls_is_that_of_the_plain_form(monkeypatch):
    """Inertia and torque of the contact, with other torques and an inner momentum; about 1e3 smaller numbers than their parts."""
    effects = [ROLLING, ALL_EFFECTS["linear drag"], ALL_EFFECTS["drive"], SpinningRotor([0.2, 0.0, 0.5])]
    compiled, plain = both(LieRungeKutta(1e-9), effects, monkeypatch, uniform(2, rng=np.random.default_rng(5)))
    assert compiled.steps == plain.steps > 10
    for first, other in ((compiled.momentum, plain.momentum), (compiled.attitude, plain.attitude)):
        assert np.allclose(
            first, other, rtol=0, atol=1e-12
        )  # steps chosen from sums in another order: 1e-16/step², times 100


def test_rolling_without_other_effects_conserves_energy_when_compiled(monkeypatch):
    monkeypatch.setattr(lie_runge_kutta, "PLAIN_STEPS", 0)
    motion = integrate(LieRungeKutta(1e-12), MOMENTS, MOMENTUM, np.linspace(0, 4, 5), effects=[ROLLING])
    assert np.ptp(motion.energy) < 1e-10 * abs(motion.energy[0])  # some hundred steps of 1e-12


def test_a_change_of_the_inertia_alone_is_not_compiled():
    class Heavier(RollingEllipsoid):
        def inertia(self, time, attitude):
            return 2.0 * super().inertia(time, attitude)

    like = (1.1, [0.9, 0.6, 0.4], [0.0, 0.3, -5.0])
    assert flatten_system(MOMENTS, [RollingEllipsoid(*like)]).compiled is not None
    assert flatten_system(MOMENTS, [Heavier(*like)]).compiled is None


def test_a_linear_rotor_in_a_field_is_compiled_too(monkeypatch):
    effects, moments, momentum = [PermanentDipole([0, 0, 1.0], [0, 0, 0.5])], [1.0, 1.0, 0.0], [0.3, 0.2, 0.0]
    compiled, plain = both(SymmetricTopSplitting(0.01), effects, monkeypatch, moments=moments, momentum=momentum)
    assert np.allclose(compiled.attitude, plain.attitude, rtol=0, atol=1e-14)  # round-off


def test_going_over_to_the_compiled_form_within_an_interval(monkeypatch):
    """The plain steps end in the middle of an interval; the motion goes on from there."""
    effects, grid = [ALL_EFFECTS["drive"], ALL_EFFECTS["linear drag"]], [0.0, 40.0, 60.0]
    monkeypatch.setattr(lie_runge_kutta, "PLAIN_STEPS", np.inf)
    plain = integrate(LieRungeKutta(1e-11), MOMENTS, MOMENTUM, grid, effects=effects)
    monkeypatch.setattr(lie_runge_kutta, "PLAIN_STEPS", 7)
    mixed = integrate(LieRungeKutta(1e-11), MOMENTS, MOMENTUM, grid, effects=effects)
    assert np.allclose(mixed.momentum, plain.momentum, rtol=0, atol=1e-12)  # the same steps to round-off
    assert plain.steps == mixed.steps > 20
    back = integrate(LieRungeKutta(1e-11), MOMENTS, mixed.momentum[-1], [60.0, 0.0], mixed.attitude[-1], effects)
    assert np.allclose(back.momentum[-1], MOMENTUM, atol=1e-6)  # 1e-11 a step, grown by the drag that is undone


def test_what_is_called_at_every_step_is_not_compiled(monkeypatch):
    """A user's effect, a change of the plain form, moments that change: none is bypassed."""
    compiled = lambda *effects: flatten_system(MOMENTS, effects).compiled  # noqa: E731
    assert compiled(ConstantTorque([0.1, 0, 0])) is not None
    assert compiled(ConstantTorque([0.1, 0, 0]), Doubled([0.1, 0, 0])) is None
    assert compiled(TimedTorque(lambda t: [t, 0, 0])) is None
    assert compiled(ConstantTorque([0.1, 0, 0]), ChangingInertia(lambda t: [1.0, 1.0, 1.0 + t])) is None
    monkeypatch.setattr(splitting, "WORTH_LOADING", 0)
    first, two = (
        integrate(SymmetricTopSplitting(0.1), [1, 1, 1], [0, 0, 0], [0, 1.0], effects=[kind([0.1, 0, 0])])
        for kind in (ConstantTorque, Doubled)
    )
    assert np.allclose(two.momentum[-1], 2.0 * first.momentum[-1], rtol=1e-12)  # rounding of ten steps


def test_few_steps_do_not_load_the_compiled_form(monkeypatch):
    effects = [ALL_EFFECTS["dipole"]]
    method, system = SymmetricTopSplitting(0.1), flatten_system(MOMENTS, effects)
    path = np.zeros((2, 1, 7))
    assert not method.follow_compiled(system, np.array([0.0, 1.0]), np.array([10]), path)
    assert not method.follow_compiled(flatten_system(MOMENTS), np.array([0.0, 1.0]), np.array([10**6]), path)


def test_blocks_of_bodies_in_a_field_move_as_each_alone():
    rng, effects = np.random.default_rng(7), list(PLACE_EFFECTS.values())
    moments = np.array([[1.0, 1.4, 2.0], [2.0, 1.0, 1.4], [1.4, 2.0, 1.0]])[np.arange(130) % 3]
    momenta, attitudes = rng.normal(size=(130, 3)), uniform(130, rng=rng)
    alone = integrate(SymmetricTopSplitting(0.02), moments, momenta, [0.3, 1.3], attitudes, effects)
    with ThreadPoolExecutor(2) as threads:
        many = propagate_driven(moments, momenta, attitudes, 0.02, 50, effects, 0.3, threads)
    assert np.allclose(many[0], alone.momentum[:, -1], rtol=0, atol=5e-14)  # 50 steps of rounding of numbers up to 4
    assert np.allclose(many[1], alone.attitude[:, -1], rtol=0, atol=5e-14)
    single = propagate_driven(moments, momenta, attitudes, 0.02, 50, effects, 0.3)
    assert all(np.array_equal(first, other) for first, other in zip(many, single, strict=True))


def test_a_crowd_in_a_field_is_of_order_two_and_keeps_its_energy():
    rng = np.random.default_rng(5)
    momenta, attitudes = rng.normal(size=(20, 3)), uniform(20, rng=rng)
    dipole = PermanentDipole([0.5, 0.2, 0.1], [0.0, 0.3, 0.8])
    exact = integrate(LieRungeKutta(1e-13), MOMENTS, momenta, [0.0, 2.0], attitudes, [dipole]).momentum[:, -1]
    errors = [
        np.abs(propagate_driven(MOMENTS, momenta, attitudes, 2.0 / n, n, [dipole])[0] - exact).max()
        for n in (40, 80, 160)
    ]
    assert np.allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.05)  # the next term is of order 4


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: propagate_driven(MOMENTS, [MOMENTUM], [1, 0, 0, 0], 0.1, 9, [ALL_EFFECTS["linear drag"]]),
            "integrate",
        ),
        (lambda: propagate_driven(MOMENTS, [MOMENTUM], [1, 0, 0, 0], 0.1, 9, [SpinningRotor([0, 0, 1])]), "integrate"),
        (lambda: propagate_driven(MOMENTS, [MOMENTUM], [1, 0, 0, 0], 0.1, 9, [Doubled([0, 0, 1])]), "integrate"),
        (lambda: propagate_driven(MOMENTS, MOMENTUM, [1, 0, 0, 0], 0.1, 9, [ALL_EFFECTS["dipole"]]), r"shape \(n, 3\)"),
        (
            lambda: propagate_driven(MOMENTS, [MOMENTUM], [1, 0, 0, 0], 0.1, 0, [ALL_EFFECTS["dipole"]]),
            "at least one step",
        ),
        (
            lambda: propagate_driven(MOMENTS, [MOMENTUM], [1, 0, 0, 0], 5.0, 9, [ALL_EFFECTS["dipole"]]),
            "take a shorter step",
        ),
    ],
)
def test_refusals_of_blocks(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize("angle", [1e-9, 1e-4, 0.1, 0.5, 0.999999, 1.000001, 3.0])
def test_the_series_of_a_turn(angle):
    """Cosine, sine and (1 - (θ/2) cot(θ/2))/θ² on both sides of the angle below which they are summed, in extended precision."""
    from rotor.classical.integrators._attitude_kernels import half_angle_terms

    cosine, half_sinc, factor = half_angle_terms.py_func((0.6 * angle, 0.0, 0.8 * angle))
    half = np.longdouble(angle) / 2
    assert cosine == pytest.approx(float(np.cos(half)), rel=1e-15, abs=3e-16)  # round-off, and that of |u|
    assert half_sinc == pytest.approx(float(np.sin(half) / (2 * half)), rel=1e-15)
    exact = (1 - half / np.tan(half)) / (2 * half) ** 2 if angle > 0.05 else 1 / 12 + (2 * half) ** 2 / 720
    assert factor == pytest.approx(float(exact), rel=2e-15)  # 1 - x cot x loses a digit at 0.1, next term 1e-13 at 1e-4
