"""The public names as a user meets them: what a wrong argument says, and what a name that is not there is near to."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

import rotor
from rotor.cli import process


@pytest.fixture(scope="module")
def lines():
    return rotor.api.line_list("CO", jmax=3)


@pytest.mark.parametrize(
    ("call", "kind", "said"),
    [
        (lambda: rotor.api.line_list("CO", temperature=300), TypeError, "did you mean temperature_k"),
        (lambda: rotor.api.line_list("CO", 300), TypeError, "by name it takes temperature_k, jmax"),
        (lambda: rotor.lines_list, AttributeError, "did you mean line_list"),
        (
            lambda: rotor.api.line_list("CO", temperature_k="300 K"),
            ValueError,
            "temperature_k: '300 K': expected a number",
        ),
        (lambda: rotor.api.line_list("CO", jmax=2.5), ValueError, "jmax: 2.5: expected a whole number"),
        (
            lambda: rotor.api.line_list("CO", jmax=3, range_mhz=(5, 1)),
            ValueError,
            "range_mhz: 5 to 1 MHz: expected a range",
        ),
        (lambda: rotor.api.line_list("CO", min_lgint=float("nan")), ValueError, "min_lgint: nan"),
        (lambda: rotor.api.line_list(""), ValueError, "an empty text names no molecule"),
        (lambda: rotor.api.SpectrumRequest("CO"), ValueError, "top: 'CO': expected a Top; rotor.read"),
        (lambda: rotor.api.GasRequest("CO"), ValueError, "top: 'CO': expected a Top; rotor.read"),
        (lambda: rotor.api.LevelsRequest(rotor.read("CO"), jmax="5"), ValueError, "jmax: '5': expected a whole number"),
    ],
)
def test_a_wrong_argument_is_named(call, kind, said):
    with pytest.raises(kind) as error:
        call()
    assert said in str(error.value)


def test_rows_of_a_list_of_lines(lines):
    assert len(lines[1]) == 1
    assert lines[-1].frequency_mhz[0] == lines.frequency_mhz[-1]
    assert [float(line.frequency_mhz[0]) for line in lines] == lines.frequency_mhz.tolist()
    with pytest.raises(IndexError):
        lines[len(lines)]
    with pytest.raises(ValueError, match="count: -1"):
        lines.strongest(-1)


def test_threads_agree():
    """Caches that two threads fill at once hold the same numbers as those that one fills."""
    names = ["water", "NH3"]

    def work(first: int) -> dict[str, bytes]:
        order = names[first:] + names[:first]
        return {name: rotor.api.line_list(name, jmax=4).columns["lgint"].tobytes() for name in order}

    switch = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        with ThreadPoolExecutor(2) as pool:
            computed = list(pool.map(work, range(2)))
    finally:
        sys.setswitchinterval(switch)
    assert all(entry == work(0) for entry in computed)


def test_a_stream_that_is_closed_is_the_null_device(monkeypatch):
    monkeypatch.setattr(sys, "stdout", None)
    process._open_missing_streams()
    assert sys.stdout.write("x") == 1
    sys.stdout.close()


@pytest.mark.slow  # a process of its own
def test_every_module_can_be_imported():
    """Importing each module, as a documentation tool does, runs no command and prints nothing."""
    text = (
        "import importlib, pkgutil, rotor\n"
        "for found in pkgutil.walk_packages(rotor.__path__, 'rotor.'):\n"
        "    importlib.import_module(found.name)\n"
    )
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
