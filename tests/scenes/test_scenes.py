"""Every scene runs, and asserts its own published figure while it does."""

import runpy
import sys

import pytest
from places import PROJECT

SCENES = sorted((PROJECT / "examples" / "scenes").glob("*.py"))


def test_no_scene_is_missing():
    assert len(SCENES) == 14  # a file that is lost or renamed is noticed


@pytest.mark.parametrize("scene", SCENES, ids=lambda path: path.stem)
def test_a_published_scene_runs_with_its_asserts(scene, monkeypatch):
    monkeypatch.setattr(sys, "argv", [str(scene)])  # no --plot
    assert "assert " in scene.read_text(encoding="utf-8")
    assert runpy.run_path(str(scene), run_name="__main__")
