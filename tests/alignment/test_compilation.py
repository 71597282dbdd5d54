"""What the compiler makes of the kernels of first runs: nothing but their own arithmetic.

An assignment of slices or of a tuple to a row compiles the texts of its errors, functions of strings, for two to four seconds.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytestmark = pytest.mark.slow


def compiled_with(function: Any, *arguments: Any) -> list[str]:
    """Modules of everything that a first call compiles, without the cache on disk."""
    from numba import njit
    from numba.core import event

    results: list[str] = []

    class Listener(event.Listener):  # type: ignore[misc]
        def on_start(self, event: Any) -> None:
            results.append(event.data["dispatcher"].py_func.__module__)

        def on_end(self, event: Any) -> None:
            pass

    with event.install_listener("numba:compile", Listener()):
        njit(function.py_func)(*arguments)
    return results


def call_of(name: str) -> tuple[Any, ...]:
    """A kernel and arguments of the smallest size."""
    from rotor.alignment.propagation import _kernels as alignment
    from rotor.classical.integrators import _attitude_kernels as attitude
    from rotor.geometry import _kernels as geometry

    rows, three, six = np.eye(4)[:1], np.ones((1, 3)), np.zeros((1, 6))
    if name == "upright":
        return geometry.upright, three / np.sqrt(3)
    if name == "placed":
        return attitude.placed, rows, six, three, rows.copy(), three.copy()
    if name in ("seen_from_body", "lever"):
        return getattr(attitude, name), rows, *([np.ones(3)] * (1 if name == "seen_from_body" else 2))
    column, drifts, phases = (
        np.ones((2, 1), dtype=complex),
        np.ones((1, 2, 2), dtype=complex),
        np.ones((1, 2), dtype=complex),
    )
    snapshots = np.empty((1, 2, 1), dtype=complex)
    return (
        alignment.kick_and_drift,
        column,
        drifts,
        np.zeros(1, dtype=np.int64),
        phases,
        np.ones(1, dtype=bool),
        snapshots,
    )


@pytest.mark.parametrize("name", ["upright", "placed", "seen_from_body", "lever", "kick_and_drift"])
def test_no_functions_of_strings_are_compiled(name: str):
    assert not [module for module in compiled_with(*call_of(name)) if "unicode" in module]


def test_an_assignment_of_slices_would_be_found():
    from numba import njit

    def assign(target: Any, source: Any) -> None:
        target[:, :] = source

    assert any("unicode" in module for module in compiled_with(njit(assign), np.ones((2, 2)), np.ones((2, 2))))
