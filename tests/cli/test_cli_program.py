"""The command as a program: its list of verbs, completion, errors that are no mistakes of the user."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest
from places import PROJECT

from rotor import cli
from rotor.spectra import request


def test_the_list_of_verbs_fits_a_terminal(call):
    _, out, _ = call("--help")
    lines = out.splitlines()
    assert max(map(len, lines[: lines.index("  Examples:")])) < 80  # columns of a terminal
    for verb, summary in cli.VERBS.items():
        assert f"  {verb:<13}  {summary}" in out


def test_a_defect_is_one_line_and_debug_shows_where(call, monkeypatch):
    def broken(*args, **options):
        raise KeyError("lost")

    monkeypatch.setattr(request, "line_list", broken)
    code, out, err = call("spectrum", "CO")
    assert (code, out) == (1, "")
    assert err == "error: KeyError: 'lost'; this is a defect, please report it with the output of --debug\n"
    code, _, err = call("--debug", "spectrum", "CO")
    assert code == 1
    assert err.startswith("Traceback")
    assert err.endswith("report it with the output of --debug\n")


def test_debug_shows_where_a_mistake_was_found(call):
    code, _, err = call("--debug", "spectrum", "no-such-molecule")
    assert code == 2
    assert err.startswith("Traceback")
    assert "\nerror: 'no-such-molecule' is no file here" in err
    assert call("spectrum", "no-such-molecule", "--debug") == (2, "", err)  # where one adds it after an error


@pytest.mark.parametrize(
    ("words", "computed"),
    [("rotor spec", "spectrum"), ("rotor levels --uni", "--unit"), ("rotor levels formam", "formamide")],
)
def test_a_shell_can_complete_words(words, computed):
    environment = os.environ | {
        "PYTHONPATH": str(PROJECT), "_ROTOR_COMPLETE": "complete_bash", "COMP_WORDS": words,
        "COMP_CWORD": str(len(words.split()) - 1),
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-m", "rotor"], env=environment, capture_output=True, text=True, check=False, timeout=60
    )
    assert done.stdout.split() == [computed]


@pytest.mark.parametrize("ignored", [True, False])
@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="Windows has no SIGHUP")
def test_a_process_started_by_nohup_goes_on(ignored):
    """A terminal that closes sends SIGHUP: it ends a command, but one that ignores it goes on ignoring it."""
    code = (
        "import signal, sys, rotor.cli as cli\n"
        f"signal.signal(signal.SIGHUP, signal.{'SIG_IGN' if ignored else 'SIG_DFL'})\n"
        "cli.run = lambda: print(signal.getsignal(signal.SIGHUP) == signal.SIG_IGN)\n"
        "cli.process.end = lambda _: None\n"
        "cli.main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | {"PYTHONPATH": str(PROJECT)}, capture_output=True, text=True,
        check=False, timeout=60,
    )  # fmt: skip
    assert done.stdout.split() == [str(ignored)], done.stderr
