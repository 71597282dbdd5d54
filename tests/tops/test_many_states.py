"""Constants of as many states as SPCAT takes."""

from __future__ import annotations

import sys

from rotor.tops.states import state_constants
from rotor.tops.states.state_constants import StateConstants


def test_names_are_read_once_however_many_states_are_looked_up():
    """Each state read the names of all states again: 8 of 9 s of a file with 999 states."""
    states = StateConstants({f"E[{v}]": float(v) for v in range(1, 60)})
    calls = []

    def counted(frame, event, _):
        if event == "call" and frame.f_code is state_constants.state_numbers.__code__:
            calls.append(1)

    sys.setprofile(counted)
    try:
        read = [states.for_state(v) for v in range(1, 60)]
    finally:
        sys.setprofile(None)
    assert read == [{"E": float(v)} for v in range(1, 60)]
    assert len(calls) <= 59
