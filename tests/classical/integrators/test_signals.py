"""Long compiled motions obey signals, and their pieces do not change a number."""

import signal
import time
from dataclasses import replace

import numpy as np
import pytest

from rotor.classical.effects.drag import LinearDrag
from rotor.classical.effects.gravity import GravityAboutPivot
from rotor.classical.integrators import lie_runge_kutta, method
from rotor.classical.integrators.lie_runge_kutta import LieRungeKutta
from rotor.classical.integrators.method import integrate
from rotor.classical.integrators.moser_veselov import MoserVeselov
from rotor.classical.integrators.splitting import RotationSplitting, SymmetricTopSplitting

DRAG = [LinearDrag([0.01, 0.02, 0.01])]


class RangError(Exception):
    pass


def _ring(*_):
    raise RangError


def _motion(last):
    return integrate(LieRungeKutta(1e-11), [1.0, 2.0, 3.0], [1.0, 5.0, 1.0], np.linspace(0, last, 11), effects=DRAG)


@pytest.mark.parametrize("steps", [7, 300])
def test_pieces_of_a_compiled_motion_change_nothing(monkeypatch, steps):
    whole = _motion(400.0)
    assert whole.steps > lie_runge_kutta.PLAIN_STEPS + steps
    monkeypatch.setattr(lie_runge_kutta, "STEPS_OF_A_CALL", steps)
    pieces = _motion(400.0)
    assert pieces.steps == whole.steps
    np.testing.assert_array_equal(pieces.momentum, whole.momentum)  # bit by bit: the same steps
    np.testing.assert_array_equal(pieces.attitude, whole.attitude)


@pytest.mark.skipif(not hasattr(signal, "SIGALRM"), reason="this system has no SIGALRM")
def test_a_long_compiled_motion_obeys_a_signal():
    """One call made all steps, and a signal waited for its end: SIGTERM took 13 s with moments 6e-13, 0.6, 1.0."""
    _motion(400.0)  # loads the kernels
    moments, omega, times = [6e-13, 0.6, 1.0], [1.0, 1.0, 1.0], [0.0, 1e-3, 2e-3]
    before = signal.signal(signal.SIGALRM, _ring)
    try:
        signal.setitimer(signal.ITIMER_REAL, 1.0)
        start = time.perf_counter()
        with pytest.raises(RangError):
            integrate(LieRungeKutta(1e-10), moments, omega, times, effects=DRAG)
        assert time.perf_counter() - start < 2.0  # s: within one after the signal
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


FIELD = [GravityAboutPivot(1.0, [0.1, 0.0, -1.0], [0.0, 0.0, -9.8])]
MOMENTS, START = [1.0, 2.0, 3.0], [1.0, 5.0, 1.0]


@pytest.mark.parametrize("steps", [1, 7, 300, 100_000])
def test_pieces_of_a_driven_splitting_change_nothing(monkeypatch, steps):
    def swung():
        times = [0.0, 0.5, 1.0, 20.0, 21.0]
        return integrate(SymmetricTopSplitting(1e-3), MOMENTS, START, times, effects=FIELD)

    whole = swung()
    assert whole.steps == 21_000
    monkeypatch.setattr(method, "STEPS_OF_A_CALL", steps)
    pieces = swung()
    np.testing.assert_array_equal(pieces.momentum, whole.momentum)  # bit by bit: the same steps
    np.testing.assert_array_equal(pieces.attitude, whole.attitude)


@pytest.mark.parametrize("stepper", [SymmetricTopSplitting, RotationSplitting, MoserVeselov])
def test_pieces_of_free_steps(monkeypatch, stepper):
    """Half turns of neighbouring steps are one turn within a call, so that pieces round otherwise."""
    whole = integrate(stepper(1e-2), MOMENTS, START, [0.0, 50.0])
    monkeypatch.setattr(method, "STEPS_OF_A_CALL", 777)
    pieces = integrate(stepper(1e-2), MOMENTS, START, [0.0, 50.0])
    assert pieces.steps == whole.steps == 5000
    assert pieces.momentum == pytest.approx(whole.momentum, abs=1e-12)  # round-off of |L| = 5 at 1e-16 a step
    assert pieces.attitude == pytest.approx(whole.attitude, abs=1e-12)  # the same


LONG = [
    (SymmetricTopSplitting(1e-9), FIELD),  # 2e9 steps, hours
    (SymmetricTopSplitting(1e-9), []),
    (RotationSplitting(1e-9, 8), []),
    (MoserVeselov(1e-9, 8), []),
]


@pytest.mark.skipif(not hasattr(signal, "SIGALRM"), reason="this system has no SIGALRM")
@pytest.mark.parametrize(("stepper", "effects"), LONG, ids=["driven", "free", "rotations", "Moser-Veselov"])
def test_long_steps_obey_a_signal(stepper, effects):
    """One call made all steps of a splitting, and a signal waited for its end."""
    integrate(replace(stepper, step=1e-4), MOMENTS, START, [0.0, 1.0], effects=effects)  # loads the kernels
    before = signal.signal(signal.SIGALRM, _ring)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.3)
        start = time.perf_counter()
        with pytest.raises(RangError):
            integrate(stepper, MOMENTS, START, [0.0, 1.0, 2.0], effects=effects)
        assert time.perf_counter() - start < 2.5  # s: within two after the signal, on a busy machine
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
