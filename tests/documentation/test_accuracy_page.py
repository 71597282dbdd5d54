"""docs/accuracy.md is made from the stored figures, its sentences agree with them, and the errors come out again."""

from __future__ import annotations

import importlib.util
import re
import sys
from types import ModuleType

import numpy as np
import pytest
from places import PROJECT


@pytest.fixture(scope="module")
def program() -> ModuleType:
    folder = str(PROJECT / "benchmarks")
    sys.path.insert(0, folder)
    try:
        spec = importlib.util.spec_from_file_location("accuracy_pictures", PROJECT / "benchmarks" / "accuracy.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        yield module
    finally:
        sys.path.remove(folder)


def errors(program, name: str, panel: int = 0) -> dict[str, dict[str, float]]:
    """The stored errors by curve and setting."""
    curves = program.read_results()[name][panel].curves
    return {curve: {point.setting: point.error for point in points} for curve, points in curves.items()}


def test_the_page_is_made_of_the_stored_figures(program):
    assert program.PAGE.read_text(encoding="utf-8") == program.page(program.read_results())
    assert set(program.read_results()) == {subject.name for subject in program.SUBJECTS}


def test_every_subject_has_its_picture(program):
    named = re.findall(r"\(pictures/(accuracy_\w+\.png)\)", program.PAGE.read_text(encoding="utf-8"))
    assert sorted(named) == sorted(path.name for path in program.PICTURES.glob("accuracy_*.png"))


def test_the_sentences_hold_for_the_figures(program):
    for name in ("levels", "cut", "partition", "orders"):
        for curve in errors(program, name).values():
            assert list(curve.values()) == sorted(curve.values(), reverse=True)
    ratios = [
        b / a
        for curve in errors(program, "cut").values()
        for a, b in zip(*[list(curve.values())[k:] for k in (0, 1)], strict=False)
    ]
    assert 0.05 < np.median(ratios) < 0.2  # a decade of the cut: a tenth
    rigid = [curve["J^2"] for curve in errors(program, "orders").values()]
    assert 500 < min(rigid) < max(rigid) < 5000  # MHz
    for curve in errors(program, "partition").values():
        assert all(error <= 100 * float(setting) for setting, error in curve.items())  # percent
    steps = errors(program, "fluid_step")["step"]
    assert steps["2"] == pytest.approx(0.4, abs=0.05)
    assert steps["2"] / steps["1"] == pytest.approx(4.0, rel=0.1)  # of second order
    assert errors(program, "ewald")["tolerance"]["1e-05"] == pytest.approx(0.01, rel=0.2)
    assert all(
        2.5 < errors(program, "ewald", panel)["cutoff"]["9"] < 4.5 for panel in (2, 3)
    )  # reaction field, shifted
    fit = program.read_results()["fit"][0].curves["fit"]
    assert [point.error < 1e-3 for point in fit if point.own] == [True]


def test_no_curve_folds_back(program):
    """A finer setting is as slow as the coarser one or slower, but where the page says why not."""
    faster = {("Ewald's sum and cutoffs", "cutoff (Å) of Ewald's sum")}  # a short cutoff needs more waves
    for subject in program.SUBJECTS:
        for panel in program.read_results()[subject.name]:
            for name, points in panel.curves.items():
                if not panel.joined or (subject.title, panel.title) in faster:
                    continue
                assert len(points) >= 4 or name.startswith("exact"), (subject.name, panel.title, name)
                times = [point.seconds for point in points]
                assert times == sorted(times), (subject.name, panel.title, name)


CHEAP = ["levels", "cut", "partition", "stark", "fluid_step", "ewald", "fit"]


@pytest.mark.slow(seconds=20)
@pytest.mark.parametrize("name", CHEAP)
def test_the_errors_come_out_again(program, name):
    """Within a factor of 1.5 where they are no round-off, since another LAPACK takes other steps."""
    subject = next(subject for subject in program.SUBJECTS if subject.name == name)
    for panel, stored in zip(subject.panels(None), program.read_results()[name], strict=True):
        assert panel.title == stored.title
        for curve, points in panel.curves.items():
            for now, then in zip(points, stored.curves[curve], strict=True):
                assert now.setting == then.setting
                if then.error > 1e-6:
                    assert 1 / 1.5 < now.error / then.error < 1.5
