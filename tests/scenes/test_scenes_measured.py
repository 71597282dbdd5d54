"""docs/validation/scenes_measured.md: every scene that asks for an accuracy reached it and could hardly be coarser; plans of all scenes."""

from __future__ import annotations

import importlib.util
import sys
from types import ModuleType

import pytest
from places import PROJECT


def load(name: str = "scenes_measured") -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, PROJECT / "benchmarks" / f"{name}.py")
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def program() -> ModuleType:
    return load()


def test_the_page_is_made_of_the_stored_figures(program):
    rows = program.read_results()
    assert [one.scene for one in rows] == program.asking()
    assert program.PAGE.read_text(encoding="utf-8") == program.page(rows)


def test_every_stated_error_is_met(program):
    """What was found is below what is stated, and that below what was asked for."""
    for one in program.read_results():
        assert one.stated <= one.asked
        for knob in one.knobs:
            assert program.in_unit_asked(one, knob.found, knob) <= one.stated, (one.scene, knob.name)


def test_one_step_coarser_would_miss(program):
    for one in program.read_results():
        if program.CHEAPEST in one.how:
            assert not program.misses(one)
        elif one.unit == "MHz" and not one.knobs:
            assert "spins of nuclei" in one.how  # 4 MHz of them: left out they would miss it
        else:
            assert program.misses(one), one.scene


def test_seconds_of_the_plans(program):
    """Within a factor of 3 for runs over 1 s; shorter ones are held to be short."""
    for one in program.read_results():
        assert max(one.plan_seconds, one.run_seconds) < 1.0 or 1 / 3 < one.plan_seconds / one.run_seconds < 3


def test_memory_of_the_plans(program):
    """Within a factor of 3 of the peak where that is over 1 MB."""
    for one in program.read_results():
        assert max(one.plan_mb, one.run_mb) < 1.0 or 1 / 3 < one.plan_mb / one.run_mb < 3, one.scene


def test_plans_of_all_scenes_and_of_longer_ones():
    """What benchmarks/bench_plans.py stored: seconds above 1 s and memory above 1 MB within a factor of 3."""
    plans = load("bench_plans")
    stored = plans.read_results()
    assert set(stored) == set(plans.cases())
    assert sum(one.taken_seconds > 1.0 for one in stored.values()) >= 5  # some are as long as that
    for one in stored.values():
        assert plans.within(one.planned_seconds, one.taken_seconds, 1.0), one.case
        assert plans.within(one.planned_mb, one.taken_mb, 1.0), one.case


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hydrogen_heat_capacity", "driven_chaos", "rigid_water", "water_gas"])
def test_a_scene_measured_again(program, name):
    """The same settings, the accuracy met, and missed one step coarser."""
    stored = next(one for one in program.read_results() if one.scene == name)
    now = program.measure(name)
    assert now.how == stored.how
    assert all(program.in_unit_asked(now, knob.found, knob) <= now.asked for knob in now.knobs)
    assert program.misses(now)
