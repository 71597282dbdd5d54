"""Where the shared reference files are, and the count of oracles that ran."""

from __future__ import annotations

import gc
import os
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# the first example may compile, and other workers may have the processor
settings.register_profile("rotor", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("rotor")

# before numpy is loaded: threads of BLAS wait for each other where other workers have the cores
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

SHARED = Path(__file__).resolve().parents[1].parent / "shared"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--sample", default="1/1", metavar="K/N", help="Of the slow tests the K-th of N parts.")


def _seconds(item: pytest.Item) -> float:
    """About how long a slow test takes, from its mark; most of them some seconds."""
    return float(item.get_closest_marker("slow").kwargs.get("seconds", 4.0))


def _parts_of_slow(slow: list[pytest.Item], parts: int) -> list[list[pytest.Item]]:
    """Parts of about the same length: the longest first, each test to the part that is the shortest so far."""
    shared_out: list[list[pytest.Item]] = [[] for _ in range(parts)]
    lengths = [0.0] * parts
    for item in sorted(slow, key=lambda item: (-_seconds(item), zlib.crc32(item.nodeid.encode()))):
        shortest = lengths.index(min(lengths))
        shared_out[shortest].append(item)
        lengths[shortest] += _seconds(item)
    return shared_out


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out slow tests that are not in the sample.

    The slow ones come first, the longest before the others, so that at the end no worker waits for a long one of another.
    """
    part, parts = (int(number) for number in config.getoption("--sample").split("/"))
    if not 1 <= part <= parts:
        raise pytest.UsageError(f"--sample {part}/{parts}: expected K/N with K from 1 to N")
    slow = [item for item in items if item.get_closest_marker("slow")]
    chosen = _parts_of_slow(slow, parts)[part - 1]
    inside = set(chosen)
    config.hook.pytest_deselected(items=[item for item in slow if item not in inside])
    items[:] = [*chosen, *(item for item in items if not item.get_closest_marker("slow"))]


def pytest_collection_finish() -> None:
    """Modules and tests stay to the end: the collector of garbage need not go through a gigabyte of them again and again."""
    gc.collect()
    gc.freeze()


def pytest_unconfigure() -> None:
    gc.unfreeze()  # extension modules complain of objects that are left at the end


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of reference files beside the project."""
    if not SHARED.is_dir():
        pytest.skip("no ../shared beside the project: reference files are not on this machine")
    return SHARED


def _oracle_reports(reporter, outcomes: tuple[str, ...]) -> list:
    reports = (report for outcome in outcomes for report in reporter.stats.get(outcome, []))
    return [r for r in reports if "oracle" in getattr(r, "keywords", {})]


@pytest.hookimpl(tryfirst=True)
def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """A skipped oracle is a failure where the reference files are there."""
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    if reporter and SHARED.is_dir() and _oracle_reports(reporter, ("skipped",)) and exitstatus == 0:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter) -> None:
    """Say how many comparisons with reference files ran."""
    ran = len(_oracle_reports(terminalreporter, ("passed", "failed")))
    skipped = len(_oracle_reports(terminalreporter, ("skipped",)))
    verdict = " (a failure: ../shared is here)" if skipped and SHARED.is_dir() else ""
    terminalreporter.write_line(f"oracles: {ran} ran, {skipped} skipped{verdict}")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str], folder: Path) -> Callable[..., tuple[int, str, str]]:
    """Run a command in this process, in an empty folder: exit code, standard output, standard error."""
    from rotor import cli

    def run(*arguments: str) -> tuple[int, str, str]:
        code = cli.run(list(arguments))
        streams = capsys.readouterr()
        return code, streams.out, streams.err

    return run


@pytest.fixture(autouse=True)
def _quiet_matplotlib(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MPLBACKEND", "Agg")
    monkeypatch.setenv("COLUMNS", "120")  # reports are folded to the width of the terminal
