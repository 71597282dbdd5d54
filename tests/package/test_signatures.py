"""Compiled loops have one signature: each further one costs seconds of every first run."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest
from places import PROJECT

SCRIPT = """
import json
from importlib import import_module

import numpy as np

from assignment_cases import spectrum
from rotor.assignment.assign import answer_assign
from rotor.assignment.request import AssignRequest
from rotor.classical.effects.torques import from_body, lever_torque
from rotor.classical.integrators.splitting import turned_axes

assert answer_assign(AssignRequest(spectrum(), seconds=120)).species
down, still = np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, -1.0])
still.setflags(write=False)
turned, fixed = np.array([[0.6, 0.0, 0.8, 0.0]]), np.array([[0.6, 0.0, 0.8, 0.0]])
fixed.setflags(write=False)
for vector in (down, still, np.arange(9.0)[::3], [0, 0, -1]):
    for attitude in (turned, fixed):
        from_body(vector, attitude), lever_torque(vector, still, attitude)
assert turned_axes(np.array([[1.0, 0.8, 0.3], [0.3, 0.8, 1.0]])).flags.c_contiguous
modules = ("rotor.assignment.search._kernels", "rotor.assignment.search._sweep", "rotor.classical.integrators._attitude_kernels")
numbers = {}
for module in map(import_module, modules):
    for name, value in vars(module).items():
        if getattr(value, "__module__", "") == module.__name__ and getattr(value, "signatures", ()):
            numbers[name] = len(value.signatures)
print(json.dumps(numbers))
"""


@pytest.mark.slow
def test_an_assignment_and_its_loops_have_one_signature(tmp_path):
    path = os.pathsep.join([str(PROJECT), str(PROJECT / "tests" / "helpers")])
    ran = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ
        | {"PYTHONPATH": path, "NUMBA_CACHE_DIR": str(tmp_path)},  # callees read from disk show no signatures
    )
    numbers = json.loads(ran.stdout)
    assert {"_joint", "best_scale", "best_scales", "_crossing", "_root", "seen_from_body", "lever"} <= numbers.keys()
    assert {name for name, number in numbers.items() if number != 1} == set()
