"""Long compiled motions obey signals, and their pieces do not change a number."""

import signal
import time

import numpy as np
import pytest

from rotor.classical.effects.drag import LinearDrag
from rotor.classical.integrators import lie_runge_kutta
from rotor.classical.integrators.lie_runge_kutta import LieRungeKutta
from rotor.classical.integrators.method import integrate

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
