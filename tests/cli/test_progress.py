"""How far a command is: on a terminal, and nothing in a pipe."""

from __future__ import annotations

import io
import os
import re
import subprocess
import sys
import time

import pytest

from rotor.cli.workers import working
from rotor.reports import progress
from rotor.reports.progress import elapsed_time, progress_bar
from rotor.scenes.scene import make_scene, write_scene


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def on_terminal(monkeypatch) -> Terminal:
    """Standard error as a terminal; set inside a test, since the capture of pytest sets its own before."""
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(progress, "SHOW_AFTER_S", 0.05)
    return stream


def test_long_work_shows_its_time_and_leaves_an_empty_line(monkeypatch):
    terminal = on_terminal(monkeypatch)
    with elapsed_time("computing"):
        time.sleep(0.3)
    assert re.match(r"\rcomputing: 0 s ", terminal.getvalue())
    assert terminal.getvalue().endswith("\r\x1b[2K")


def test_the_line_says_when_kernels_are_compiled(monkeypatch):
    from numba.core import event

    import rotor.kernels  # noqa: F401  # counts compilations

    terminal = on_terminal(monkeypatch)
    with elapsed_time("computing"):
        with event.trigger_event("numba:compile", data={}):
            time.sleep(0.3)
        assert re.match(r"\rcompiling, at the first use only: 0 s ", terminal.getvalue())
        assert "computing" not in terminal.getvalue()
        time.sleep(0.3)
    assert "computing: 0 s " in terminal.getvalue()


def test_short_work_shows_nothing(monkeypatch):
    terminal = on_terminal(monkeypatch)
    monkeypatch.setattr(progress, "SHOW_AFTER_S", 5.0)
    with elapsed_time("computing"):
        time.sleep(0.1)
    assert terminal.getvalue() == ""


def test_a_bar_takes_the_place_of_the_time(monkeypatch):
    terminal = on_terminal(monkeypatch)
    monkeypatch.setenv("TERM", "xterm")
    with progress_bar("pieces") as advance, elapsed_time("computing"):
        advance(1, 2)
        time.sleep(0.3)
    assert "computing" not in terminal.getvalue()
    assert "1/2" in terminal.getvalue()
    assert progress._Display.bars == 0


def test_the_bar_of_a_fluid_names_its_equilibration(monkeypatch):
    """The steps of the longest equilibration were shown as those of the run: of 50000."""
    from rotor.fluids.request import FluidRequest, NewBox, answer_fluid
    from rotor.fluids.settings import Settings

    terminal = on_terminal(monkeypatch)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "200")
    box = NewBox(27, equilibration_ps=0.1)
    answer_fluid(FluidRequest(box, Settings("argon", temperature_k=90.0, steps=100, every=50, cutoff_angstrom=4.0)))
    assert "equilibration: 50 of 50 steps" in terminal.getvalue()


def test_a_prediction_from_an_int_file_shows_its_time_and_notes_begin_a_line(monkeypatch, folder):
    """Such files are predicted where inputs are read: predictions of minutes showed nothing."""
    from rotor import cli
    from rotor.formats.spcat import predict

    predict_file = predict.predict_file

    def slow(*arguments, **basis):
        time.sleep(0.3)
        return predict_file(*arguments, **basis)

    monkeypatch.setattr(predict, "predict_file", slow)
    (folder / "a.var").write_text("linear\n 1 1\nl 1 1 0 0 0 1 1 1 0\n 100 6081.0 1e-37\n")
    (folder / "a.int").write_text("linear\n0 1 0.5 0 3 -10. -10. 99.9 300.0\n 1 0.7\n")
    terminal = on_terminal(monkeypatch)
    assert cli.run(["spectrum", "a.int"]) == 0
    assert "\rcomputing: 0 s " in terminal.getvalue()
    assert "\r\x1b[2Knote: QROT = 0.5" in terminal.getvalue()


def test_a_pipe_shows_nothing(monkeypatch):
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(progress, "SHOW_AFTER_S", 0.02)
    with elapsed_time("computing"), progress_bar("pieces") as advance:
        advance(1, 2)
        time.sleep(0.1)
    assert stream.getvalue() == ""


@pytest.mark.parametrize("workers", [1, 2])
def test_the_blocks_of_a_map_are_counted_on_a_terminal(monkeypatch, workers):
    """In this process and in others: a map of minutes showed nothing where it was made by workers."""
    monkeypatch.setenv("TERM", "xterm")
    terminal = on_terminal(monkeypatch)
    with working(workers, "blocks") as executor:
        assert list(executor.map(abs, [-1, 2, -3])) == [1, 2, 3]
        time.sleep(0.3)  # s; the bar is drawn anew ten times a second
    assert "3/3" in terminal.getvalue()
    assert "blocks" in terminal.getvalue()


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
def test_a_sweep_shows_points_and_the_time_left_on_a_terminal(folder):
    import pty

    write_scene(
        make_scene("levels", molecule="CO", observables={"jmax": 2}, sweep={"observables.jmax": [*range(60)]}),
        "s.toml",
    )
    reading, writing = pty.openpty()
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "100"}
    command = [sys.executable, "-m", "rotor", "run", "s.toml"]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=writing, env=environment, check=False)
    os.close(writing)
    shown = b""
    try:
        while piece := os.read(reading, 65536):
            shown += piece
    except OSError:  # the other end is closed
        pass
    os.close(reading)
    assert done.returncode == 0
    text = re.sub(r"\x1b\[[\d;?]*[A-Za-z]", "", shown.decode())
    assert re.search(r"\d+/60 points", text)
    assert "left" in text
    assert "60 points: 60 computed now in" in text
