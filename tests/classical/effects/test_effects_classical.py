"""Classical effects: each against a closed form or an independent equation, and what each says that it conserves."""

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, solve_ivp
from scipy.special import ellipj, ellipk

from rotor.classical.effects.changing_inertia import ChangingInertia
from rotor.classical.effects.dipole_in_field import InducedDipole, PermanentDipole
from rotor.classical.effects.drag import LinearDrag, QuadraticDrag
from rotor.classical.effects.drive import PeriodicDrive
from rotor.classical.effects.gravity import GravityAboutPivot
from rotor.classical.effects.gyrostat import SpinningRotor
from rotor.classical.effects.ideal_fluid import FluidImpulse, shape_integrals
from rotor.classical.effects.optical_centrifuge import OpticalCentrifuge
from rotor.classical.effects.rolling import RollingEllipsoid
from rotor.classical.effects.torques import ConstantTorque, TimedTorque
from rotor.classical.integrators.exact_drift import ExactDrift
from rotor.classical.integrators.lie_runge_kutta import LieRungeKutta
from rotor.classical.integrators.method import integrate
from rotor.classical.integrators.splitting import RotationSplitting, SymmetricTopSplitting
from rotor.classical.system import flatten_system, total_momentum
from rotor.geometry.rotations import (
    conjugate,
    distance,
    exp,
    from_matrix,
    multiply,
    normalised,
    rotate,
    to_matrix,
    uniform,
)

MOMENTS, MOMENTUM = np.array([1.0, 1.4, 2.0]), np.array([0.6, -0.3, 0.8])
TIGHT = LieRungeKutta(1e-12)
TIMES = np.linspace(0.0, 8.0, 9)

EVERY = {
    "constant, body": ConstantTorque([0.1, 0.2, -0.1]),
    "constant, space": ConstantTorque([0.1, 0.2, -0.1], "space"),
    "timed": TimedTorque(lambda t: [0.1 * t, 0.0, np.sin(t)]),
    "drive": PeriodicDrive([0.2, 0.0, 0.1], 1.3, 0.4),
    "linear drag": LinearDrag([0.1, 0.2, 0.3]),
    "quadratic drag": QuadraticDrag([0.1, 0.2, 0.3]),
    "rotor": SpinningRotor([0.2, 0.0, 0.5]),
    "inertia": ChangingInertia(lambda t: MOMENTS * (1.0 + 0.3 * np.sin(t) ** 2)),
    "dipole": PermanentDipole([0.5, 0.2, 0.1], [0.0, 0.3, 0.8]),
    "induced": InducedDipole([[1.0, 0.2, 0.0], [0.2, 0.5, 0.0], [0.0, 0.0, 0.3]], [0.9, 0.0, 0.8]),
    "centrifuge": OpticalCentrifuge([[1.0, 0.2, 0.0], [0.2, 0.5, 0.0], [0.0, 0.0, 0.3]], 1.1, 0.6, 0.9, 0.3),
    "pivot": GravityAboutPivot(1.2, [0.1, 0.0, 0.6], [0.0, 0.0, -1.0]),
    "impulse": FluidImpulse([1.0, -0.5, 0.3], [1.0, 2.0, 3.0]),
    "rolling": RollingEllipsoid(1.0, [0.6, 0.8, 0.7], [0.0, 0.0, -1.0], [0.1, 0.0, 0.05]),
}


@pytest.mark.parametrize("name", EVERY)
def test_what_an_effect_says_it_conserves_is_conserved_and_nothing_else(name):
    effect = EVERY[name]
    motion = integrate(TIGHT, MOMENTS, MOMENTUM, TIMES, effects=[effect])
    space = rotate(motion.attitude, motion.momentum)
    energy_moves = np.ptp(motion.energy) > 1e-9  # tolerance 1e-12 a step, some hundred steps
    momentum_moves = np.max(np.ptp(space, axis=0)) > 1e-9
    assert energy_moves != effect.conserves_energy
    assert momentum_moves != effect.conserves_momentum


@pytest.mark.parametrize("name", ["dipole", "induced", "pivot", "impulse"])
def test_torque_is_minus_the_gradient_of_the_energy(name):
    effect = EVERY[name]
    attitude = uniform(20, rng=np.random.default_rng(5))
    torque, h = effect.torque(0.0, attitude, np.zeros((20, 3))), 1e-5
    for k in range(3):
        turn = exp(h * np.eye(3)[k])
        ahead = effect.potential_energy(0.0, multiply(attitude, turn))
        behind = effect.potential_energy(0.0, multiply(attitude, conjugate(turn)))
        assert np.allclose(torque[:, k], -(ahead - behind) / (2 * h), atol=1e-9)  # central difference: h², eps/h


@pytest.mark.parametrize("name", [name for name in EVERY if name != "rolling"])
def test_against_plain_equations_with_a_rotation_matrix(name):
    """An independent route: 12 equations for L in space and the matrix R, R' = R [ω], by scipy."""
    effect = EVERY[name]
    system = flatten_system(MOMENTS, [effect])

    def rates(t, y):
        matrix = y[3:].reshape(3, 3)
        inertia = effect.moments(t) if name == "inertia" else MOMENTS
        inner = effect.momentum if name == "rotor" else 0.0
        omega = (matrix.T @ y[:3] - inner) / inertia
        torque = np.zeros(3) if not system.torques else matrix @ space_torque(t, matrix, omega)
        return np.concatenate([torque, turn(matrix, omega)])

    def turn(matrix, omega):
        x, y, z = omega
        return (matrix @ np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])).reshape(-1)

    def light(t):
        angle = 0.3 + 0.9 * t + 0.6 * t**2 / 2
        return 1.1 * np.array([np.cos(angle), np.sin(angle), 0.0])

    def space_torque(t, matrix, omega):
        down = {
            "constant, body": lambda: np.array([0.1, 0.2, -0.1]),
            "constant, space": lambda: matrix.T @ [0.1, 0.2, -0.1],
            "timed": lambda: np.array([0.1 * t, 0.0, np.sin(t)]),
            "drive": lambda: np.array([0.2, 0.0, 0.1]) * np.cos(1.3 * t + 0.4),
            "linear drag": lambda: -np.array([0.1, 0.2, 0.3]) * omega,
            "quadratic drag": lambda: -np.array([0.1, 0.2, 0.3]) * omega * np.sqrt(omega @ omega),
            "dipole": lambda: np.cross([0.5, 0.2, 0.1], matrix.T @ [0.0, 0.3, 0.8]),
            "induced": lambda: np.cross(
                np.array([[1.0, 0.2, 0.0], [0.2, 0.5, 0.0], [0.0, 0.0, 0.3]]) @ matrix.T @ [0.9, 0.0, 0.8],
                matrix.T @ [0.9, 0.0, 0.8],
            ),
            "centrifuge": lambda: np.cross(
                np.array([[1.0, 0.2, 0.0], [0.2, 0.5, 0.0], [0.0, 0.0, 0.3]]) @ matrix.T @ light(t), matrix.T @ light(t)
            ),
            "pivot": lambda: np.cross([0.1, 0.0, 0.6], matrix.T @ [0.0, 0.0, -1.2]),
            "impulse": lambda: np.cross(matrix.T @ [1.0, -0.5, 0.3], matrix.T @ [1.0, -0.5, 0.3] / [1.0, 2.0, 3.0]),
        }
        return down[name]()

    start = np.concatenate([MOMENTUM, np.eye(3).reshape(-1)])
    plain = solve_ivp(rates, (0.0, 8.0), start, "DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    motion = integrate(TIGHT, MOMENTS, MOMENTUM, [0.0, 8.0], effects=[effect])
    matrix = to_matrix(motion.attitude[-1])
    assert np.allclose(matrix, plain[3:].reshape(3, 3), atol=1e-9)  # both tolerances 1e-12 a step
    assert np.allclose(rotate(motion.attitude[-1], motion.momentum[-1]), plain[:3], atol=1e-9)


def test_linear_drag_on_a_sphere_decays_exponentially():
    motion = integrate(TIGHT, [2, 2, 2], MOMENTUM, TIMES, effects=[LinearDrag([0.3, 0.3, 0.3])])
    assert np.allclose(motion.momentum, MOMENTUM * np.exp(-0.15 * TIMES)[:, None], atol=1e-11)


def test_quadratic_drag_on_a_sphere():
    spin = np.linalg.norm(MOMENTUM) / 2.0
    motion = integrate(TIGHT, [2, 2, 2], MOMENTUM, TIMES, effects=[QuadraticDrag([0.3, 0.3, 0.3])])
    closed = spin / (1.0 + 0.15 * spin * TIMES)  # ω' = -(c/I) ω²
    assert np.allclose(np.linalg.norm(motion.omega, axis=-1), closed, atol=1e-11)


def test_planar_pendulum_by_jacobi():
    """A dipole in a field from 2 rad: sin(θ/2) = k sn(K + ω0 t), k = sin 1, ω0² = μE/I."""
    times = np.linspace(0.0, 10.0, 11)
    dipole = PermanentDipole([0.0, 0.0, 1.0], [0.0, 0.0, 0.7])
    motion = integrate(SymmetricTopSplitting(0.01, 6), [1.3, 1.3, 1.0], [0, 0, 0], times, exp([2.0, 0, 0]), [dipole])
    k = np.sin(1.0)
    closed = k * ellipj(ellipk(k**2) + np.sqrt(0.7 / 1.3) * times, k**2)[0]
    assert np.allclose(motion.attitude[:, 1], closed, atol=1e-11)  # order 6 at h ω0 = 0.007


def test_heavy_top_keeps_what_lagrange_says():
    top = GravityAboutPivot(1.0, [0.0, 0.0, 0.5], [0.0, 0.0, -9.81])
    moments = [0.4, 0.4, 0.1]
    start = exp([0.6, 0.0, 0.0])
    motion = integrate(SymmetricTopSplitting(0.002, 4), moments, [0.1, 0.0, 3.0], np.linspace(0, 5, 21), start, [top])
    assert np.ptp(motion.momentum[:, 2]) < 1e-13  # along the figure: each flow keeps it exactly
    assert np.ptp(rotate(motion.attitude, motion.momentum)[:, 2]) < 1e-12  # along gravity
    assert np.ptp(motion.energy) < 1e-7 * np.abs(motion.energy[0])  # order 4, oscillating


def test_sleeping_top_wakes_below_the_critical_spin():
    """Upright is stable iff L3² > 4 m g l I1 (Landau and Lifshitz, Mechanics, section 35, problem 2)."""
    top = GravityAboutPivot(1.0, [0.0, 0.0, 0.5], [0.0, 0.0, -10.0])
    critical = np.sqrt(4 * 10.0 * 0.5 * 0.4)
    tilts = []
    for spin in (0.98 * critical, 1.02 * critical):
        times, start = np.linspace(0, 40, 401), exp([1e-4, 0, 0])
        motion = integrate(SymmetricTopSplitting(0.02, 4), [0.4, 0.4, 0.1], [0, 0, spin], times, start, [top])
        tilts.append(np.max(np.hypot(motion.attitude[:, 1], motion.attitude[:, 2])))
    assert tilts[0] > 0.05 > 1e-3 > tilts[1]


def test_spin_up_by_a_space_torque_keeps_its_direction():
    motion = integrate(TIGHT, MOMENTS, MOMENTUM, [0.0, 4.0], effects=[ConstantTorque([0.3, 0.1, 0.2], "space")])
    gained = rotate(motion.attitude[-1], motion.momentum[-1]) - MOMENTUM
    assert np.allclose(gained, 4.0 * np.array([0.3, 0.1, 0.2]), atol=1e-11)


def test_effects_add_up():
    both = [EVERY["dipole"], EVERY["pivot"], SpinningRotor([0.1, 0, 0]), SpinningRotor([0, 0.2, 0])]
    system = flatten_system(MOMENTS, both)
    attitude = uniform(3, rng=np.random.default_rng(1))
    total = system.torque(0.0, attitude, np.zeros((3, 3)))
    parts = [effect.torque(0.0, attitude, np.zeros((3, 3))) for effect in both[:2]]
    assert np.array_equal(total, parts[0] + parts[1])
    assert np.array_equal(system.inner_momentum(0.0), [0.1, 0.2, 0.0])


def test_an_empty_list_is_free_motion_to_the_last_bit():
    method = RotationSplitting(0.05, 4)
    free = integrate(method, MOMENTS, MOMENTUM, TIMES)
    named = integrate(method, MOMENTS, MOMENTUM, TIMES, effects=[])
    zero = integrate(method, MOMENTS, MOMENTUM, TIMES, effects=[ConstantTorque([0.0, 0.0, 0.0])])
    assert np.array_equal(free.attitude, named.attitude)
    assert np.allclose(free.attitude, zero.attitude, atol=1e-13)  # the same composition, kicked with zero


def test_exact_drift_with_a_weak_torque_takes_long_steps():
    weak = [PermanentDipole([0.0, 0.0, 1e-4], [0.0, 0.0, 1.0])]
    reference = integrate(TIGHT, MOMENTS, MOMENTUM, [0.0, 5.0], effects=weak).attitude[-1]
    exact = integrate(ExactDrift(0.5), MOMENTS, MOMENTUM, [0.0, 5.0], effects=weak).attitude[-1]
    split = integrate(RotationSplitting(0.5), MOMENTS, MOMENTUM, [0.0, 5.0], effects=weak).attitude[-1]
    assert distance(exact, reference) < 1e-3 * distance(split, reference)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ConstantTorque([1.0, 2.0]), "three finite components"),
        (lambda: ConstantTorque([1.0, 2.0, 3.0], "lab"), "space"),
        (lambda: TimedTorque(3.0), "function of time"),
        (lambda: LinearDrag(np.ones((2, 2))), "3x3"),
        (lambda: QuadraticDrag([-1.0, 1.0, 1.0]), "not negative"),
        (lambda: InducedDipole([[1, 2, 0], [0, 1, 0], [0, 0, 1]], [0, 0, 1]), "symmetric"),
        (lambda: GravityAboutPivot(0.0, [0, 0, 1], [0, 0, 1]), "positive"),
        (lambda: ChangingInertia([1, 2, 3]), "function of time"),
        (lambda: ChangingInertia(lambda t: [0.0, 1.0, 1.0]).moments(0.0), "positive"),
        (lambda: flatten_system(MOMENTS, [EVERY["inertia"], EVERY["inertia"]]), "2 effects set the moments"),
    ],
)
def test_impossible_effects_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_ball_rolls_steadily_and_as_the_closed_form_says():
    mass, radius = 2.0, 0.5
    moments = 0.4 * mass * radius**2 * np.ones(3)
    ball = RollingEllipsoid(mass, [radius] * 3, gravity=[0.0, 0.0, -9.8])
    spin = np.array([3.0, -1.0, 2.0])
    start = total_momentum(spin, moments, [ball])
    assert np.allclose(start, [1.4 / 0.4, 1.4 / 0.4, 1.0] * moments * spin, rtol=1e-15)  # 7/5 m r² about the contact
    motion = integrate(LieRungeKutta(1e-11), moments, start, np.linspace(0, 3, 7), effects=[ball])
    in_space = rotate(motion.attitude, motion.omega)
    assert np.max(np.abs(in_space - spin)) < 1e-9  # on a level plane ω does not change; tolerance x steps
    assert np.allclose(motion.energy, motion.energy[0], rtol=1e-10)


def test_an_egg_keeps_its_energy_while_it_rolls():
    q = exp([0.4, -0.3, 0.2])
    egg = RollingEllipsoid(1.3, [1.0, 0.7, 0.8], [0.0, 0.0, -9.8], centre=[0.05, -0.1, 0.02], axes=exp([0.1, 0.2, 0.3]))
    start = total_momentum([0.3, 1.1, -0.4], [0.3, 0.4, 0.5], [egg], q)
    motion = integrate(LieRungeKutta(1e-11), [0.3, 0.4, 0.5], start, np.linspace(0, 5, 41), q, [egg])
    assert np.ptp(motion.energy) < 1e-8 * np.mean(motion.energy)  # tolerance x some hundred steps
    assert np.ptp([egg.potential_energy(0.0, attitude) for attitude in motion.attitude]) > 0.05  # and it does rock


def test_rolling_is_that_of_kane_and_levinson():
    """Their equations for ω and μ, with a full inertia tensor along the ellipsoid's axes, written out and stepped apart."""
    inertia, squares, height, g = (
        np.array([[2.0, -0.4, 0.0], [-0.4, 3.0, 0.0], [0.0, 0.0, 4.0]]),
        np.array([9, 4, 1]),
        0.3,
        5.0,
    )

    def rates(_, y):
        mu, omega = y[:3], y[3:]
        mu_rate = np.cross(mu, omega)
        e = np.sqrt(squares @ mu**2)
        e_rate = squares @ (mu * mu_rate) / e
        x, x_rate = squares * mu / e - [0.0, 0.0, height], squares * (mu_rate - mu * e_rate / e) / e
        rolling = np.cross(x_rate, omega) + np.cross(omega, np.cross(x, omega))
        torque = np.cross(inertia @ omega, omega) + np.cross(x, rolling) + g * np.cross(mu, x) - 0.3 * omega
        return np.concatenate([mu_rate, np.linalg.solve(inertia + x @ x * np.eye(3) - np.outer(x, x), torque)])

    mu, omega = np.array([0.2, 0.3, np.sqrt(0.87)]), np.array([0.3, -0.4, 2.0])
    plain = solve_ivp(rates, (0.0, 2.0), [*mu, *omega], "DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    moments, columns = np.linalg.eigh(inertia)
    columns[:, 2] *= np.linalg.det(columns)
    turn = from_matrix(columns.T)
    across = np.cross(mu, [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    attitude = multiply(from_matrix([across, np.cross(mu, across), mu]), conjugate(turn))
    celt = RollingEllipsoid(1.0, np.sqrt(squares), [0.0, 0.0, g], rotate(turn, [0.0, 0.0, -height]), turn)
    effects = [celt, LinearDrag([0.3, 0.3, 0.3])]
    start = total_momentum(rotate(turn, omega), moments, effects, attitude)
    motion = integrate(TIGHT, moments, start, [0.0, 2.0], attitude, effects)
    back = conjugate(turn)
    assert np.allclose(rotate(back, motion.omega[-1]), plain[3:], atol=1e-9)  # both tolerances 1e-12 a step
    assert np.allclose(rotate(back, rotate(conjugate(motion.attitude[-1]), [0.0, 0.0, 1.0])), plain[:3], atol=1e-9)


def test_the_contact_is_the_lowest_point_of_the_ellipsoid():
    axes, centre, q = exp([0.5, 0.1, -0.2]), np.array([0.1, 0.0, -0.2]), exp([1.0, 2.0, 0.5])
    body = RollingEllipsoid(1.0, [1.0, 2.0, 3.0], [0.0, 0.0, -1.0], centre, axes)
    x, down = body.contact(q)
    directions = normalised(np.random.default_rng(5).normal(size=(20_000, 4)))[:, :3]
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    surface = centre + rotate(axes, directions * [1.0, 2.0, 3.0])
    lowest = np.max(surface @ down)
    assert x @ down >= lowest
    assert x @ down - lowest < 0.01  # 20,000 points leave gaps of 0.02 rad; half their square


def test_rolling_and_fluid_refuse_nonsense():
    ball = RollingEllipsoid(1.0, [1.0, 1.0, 1.0], [0.0, 0.0, -1.0])
    with pytest.raises(ValueError, match="LieRungeKutta"):
        integrate(SymmetricTopSplitting(0.1), [1, 1, 1], [1, 0, 0], [0.0, 1.0], effects=[ball])
    with pytest.raises(ValueError, match="positive and finite"):
        RollingEllipsoid(0.0, [1.0, 1.0, 1.0], [0.0, 0.0, -1.0])
    with pytest.raises(ValueError, match="semi-axes of an ellipsoid are positive"):
        RollingEllipsoid(1.0, [1.0, 0.0, 1.0], [0.0, 0.0, -1.0])
    with pytest.raises(ValueError, match="other than zero"):
        RollingEllipsoid(1.0, [1.0, 1.0, 1.0], [0.0, 0.0, 0.0])
    with pytest.raises(ValueError, match="masses of body and fluid are positive"):
        FluidImpulse([1.0, 0.0, 0.0], [1.0, -1.0, 1.0])


def test_added_mass_of_an_ellipsoid_by_quadrature():
    from scipy.integrate import quad

    a, b, c = 3.0, 2.0, 1.2

    def integrand(u, first):
        return a * b * c / ((first**2 + u) * np.sqrt((a**2 + u) * (b**2 + u) * (c**2 + u)))

    slow = [quad(integrand, 0.0, np.inf, args=(first,), epsabs=1e-12)[0] for first in (a, b, c)]
    assert np.allclose(shape_integrals([a, b, c]), slow, rtol=1e-8)  # quad's own estimate


def test_a_centrifuge_changes_the_energy_in_its_turning_frame_by_its_acceleration_alone():
    """d(E - Ω L_Z)/dt = -β L_Z for any body: energy in the frame of the field, which turns at Ω = Ω0 + β t."""
    light = EVERY["centrifuge"]
    times = np.linspace(0.0, 8.0, 801)
    motion = integrate(TIGHT, MOMENTS, MOMENTUM, times, effects=[light])
    along = rotate(motion.attitude, motion.momentum)[:, 2]
    turning = motion.energy - (0.9 + 0.6 * times) * along
    expected = turning[0] - 0.6 * cumulative_simpson(along, x=times, initial=0)
    assert np.allclose(turning, expected, atol=1e-6)  # Simpson's rule over 0.01
    assert np.ptp(turning) > 1.0
