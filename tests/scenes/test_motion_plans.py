"""Plans of driven motions: the tolerance that a plan names is the one of the run, and what the run states covers what is found."""

from __future__ import annotations

import re
import time
from dataclasses import replace

import numpy as np
import pytest

from rotor.classical import motion_steps, tolerance_search
from rotor.classical.driven import answer_driven
from rotor.geometry.rotations import distance
from rotor.scenes.plan import plan_of
from rotor.scenes.run import run_scene, scene_calculation
from rotor.scenes.scene import make_scene

BODY = {"moments": [1.0, 2.0, 3.0], "angular_velocity": [0.2, 1.0, 0.1]}
DRIVEN = [
    {"effect": "periodic drive", "amplitude": [0.1, 0.0, 0.2], "angular_frequency": 1.3},
    {"effect": "linear drag", "coefficients": [0.1, 0.1, 0.1]},
]
REGULAR = make_scene("tumble", body=BODY, effects=DRIVEN, conditions={"times": "0:60:13"}, accuracy="1e-7 rad")


def found_error(result) -> float:
    """Of the attitudes, beside those of the finest tolerance."""
    fine = answer_driven(replace(result.request, tolerance=1e-13)).motion
    return float(distance(result.answer.motion.attitude, fine.attitude).max())


@pytest.mark.parametrize("long", [False, True])
def test_the_run_takes_the_tolerance_of_its_plan(long, monkeypatch):
    """Found by whole motions, or by the first part of a motion that counts as long here."""
    monkeypatch.setattr(tolerance_search, "LONG_STEPS", 10 if long else 10**6)
    plan, result = plan_of(REGULAR), run_scene(REGULAR)
    assert dict(plan.parts)["accuracy"] == result.reached.how
    assert f"tolerance {result.request.tolerance:g} of a step" in dict(plan.parts)["method"]
    assert ("first 5 %" in result.reached.how) == long
    assert plan.counts["steps"] == pytest.approx(result.answer.motion.steps, rel=0.3 if long else 0.0)
    assert found_error(result) <= result.reached.error <= 1e-7


def test_a_first_part_that_says_too_little_is_corrected_by_the_run(monkeypatch):
    """As if errors did not grow at all: the tolerance of the plan misses, the run says so and takes a finer one."""
    monkeypatch.setattr(tolerance_search, "LONG_STEPS", 10)
    monkeypatch.setattr(tolerance_search, "_growth", lambda middle, end: 1e-2)
    result = run_scene(REGULAR)
    assert "finer than the plan's" in result.reached.how
    assert found_error(result) <= result.reached.error <= 1e-7


def test_a_wobble_below_the_tolerance_is_in_the_error_that_is_stated():
    """All tolerances from 1e-5 to 1e-8 do not see it and agree among themselves; their error is its size, 1e-5 rad."""
    body = {"moments": [1.0, 1.2, 1.5], "angular_velocity": [1e-5, 0.0, 0.3]}
    when = {"times": "0:40000:101"}
    scene = make_scene(
        "tumble",
        body=body,
        effects=[{"effect": "spinning rotor", "momentum": [0, 0, 0.7]}],
        conditions=when,
        accuracy="1e-5 rad",
    )
    result = run_scene(scene)
    assert found_error(result) <= result.reached.error <= 1e-5


def test_steps_of_a_body_that_is_spun_up_are_expected_to_grow(monkeypatch):
    """Its rate grows with the time, so that the first twentieth of the time has a four hundredth of the steps."""
    body = {"moments": [100.0, 100.0, 180.0], "angular_velocity": [0.0, 0.0, 0.0]}
    when = {"times": "0:3000:3"}
    scene = make_scene(
        "tumble", body=body, effects=[{"effect": "constant torque", "vector": [0.05, 0.0, 2.0]}], conditions=when
    )
    request = scene_calculation(scene).request
    monkeypatch.setattr(motion_steps, "MORE_COMPILED", 0)
    monkeypatch.setattr(motion_steps, "ENOUGH_STEPS", 10)
    assert 0.5 < motion_steps.expected_steps(request) / answer_driven(request).motion.steps < 2.0


@pytest.mark.parametrize("moments", ["6e-13, 0.6, 1.0", pytest.param("1e-8, 1.0, 1.0", marks=pytest.mark.slow)])
def test_a_body_that_drag_stops_at_once_is_planned_by_its_first_moments(call, folder, moments, recwarn):
    """The first part of a plan was a twentieth of the time, in which drag on a thin axis takes 1e9 steps: it hung."""
    (folder / "thin.toml").write_text(
        f'schema = 1\nkind = "tumble"\n[body]\nmoments = [{moments}]\nangular_velocity = [1.0, 1.0, 1.0]\n'
        '[conditions]\ntimes = "0:10:101"\n[[effects]]\neffect = "linear drag"\ncoefficients = [0.01, 0.02, 0.01]\n'
    )
    start = time.process_time()
    code, out, err = call("plan", "thin.toml")
    assert (code, err) == (0, "")
    assert time.process_time() - start < 20.0  # s; kernels may have to be compiled
    steps = int(re.search(r"(\d{5,}) steps each", " ".join(out.split()))[1])
    assert steps > 1e6
    assert len(recwarn) == 0


def test_an_undefined_error_estimate_shortens_the_step():
    """NaN counted as an error of 0, and the step was taken."""
    from rotor.classical.integrators.lie_runge_kutta import _error

    slopes = np.full((12, 1, 6), np.nan)
    assert np.isnan(_error(slopes, 0.1, np.ones(12), np.ones(12)))
