"""Servers and pages of `rotor view` that are killed at random moments, and whether the session keeps what was acknowledged.

An action is acknowledged when its answer has arrived. A session may have one action more: the one that was being answered. The assigned
lines are followed here by a journal, apart from what the server says of them.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from places import PROJECT
from view_cases import KELVIN, NAME, spectrum_columns, true_lines, write_case

SESSION = "spectrum.view.json"
BAND = (8000.0, 17000.0)
LATEST_S = 0.8  # of a moment, after the first action; an action takes 10 to 50 ms
LATEST_IN_PAGE_S = 2.0  # where a peak is fitted and drawn before
KINDS, SHARES = ("assign", "undo", "redo", "refit", "settings"), (0.55, 0.2, 0.1, 0.1, 0.05)
Lines = dict[tuple[Any, Any], float]  # measured frequency by the labels of both levels


@dataclass
class Journal:
    """Assigned lines after the acknowledged actions, and after the action that is not acknowledged yet."""

    lines: Lines = field(default_factory=dict)
    before: list[Lines] = field(default_factory=list)
    undone: list[Lines] = field(default_factory=list)
    action: dict[str, Any] = field(default_factory=dict)
    next: Lines = field(default_factory=dict)
    revision: int = 0
    acknowledged: int = 0

    def begin(self, action: dict[str, Any]) -> bool:
        """Note what an action will lead to; False for undo and redo where the journal has nothing to take back or to repeat."""
        if (action["do"] == "undo" and not self.before) or (action["do"] == "redo" and not self.undone):
            return False
        self.action, self.next = action, self.lines
        if action["do"] == "assign":
            target = action["to"][0]
            labels = (tuple(target["upper"]), tuple(target["lower"]))
            self.next = {**self.lines, labels: action["frequency_mhz"]}
        elif action["do"] == "undo":
            self.next = self.before[-1]
        elif action["do"] == "redo":
            self.next = self.undone[-1]
        return True

    def end(self, moved: bool) -> None:
        """Note that the action was carried out. moved: whether it changed anything."""
        if moved and self.action["do"] == "undo":
            self.undone.append(self.lines)
            self.before.pop()
        elif moved:
            self.undone = self.undone[:-1] if self.action["do"] == "redo" else []
            self.before.append(self.lines)
        if moved:
            self.lines = self.next
            self.revision += 1
        self.action = {}

    def check(self, revision: int, lines: Lines) -> bool:
        """Compare a saved session; whether it has the action that was not acknowledged."""
        further = revision - self.revision
        assert further == 0 or (further == 1 and self.action), (revision, self.revision, self.action)
        if further:
            self.end(True)
        assert lines == self.lines, (self.action, lines, self.lines)
        self.action = {}
        return bool(further)


@dataclass
class Outcome:
    """What was killed: moments, acknowledged actions, moments with an action unanswered, and such actions that were saved."""

    moments: int = 0
    acknowledged: int = 0
    unanswered: int = 0
    saved: int = 0
    reads: int = 0


def read_session_file(path: Path) -> tuple[int, Lines]:
    """Revision and assigned lines of a session file; an error where the file is not whole."""
    content = msgspec.json.decode(path.read_bytes())
    lines = {
        (tuple(record["upper"]), tuple(record["lower"])): record["frequency_mhz"]
        for key, record in content["records"].items()
        if key.startswith("line/")
    }
    return content["revision"], lines


def strong_lines(count: int = 40) -> list[tuple[float, list[int], list[int]]]:
    """Frequency and labels of the strongest lines behind the spectrum."""
    lines = true_lines(BAND).strongest(count)
    quanta = np.stack([lines.levels.quanta[name] for name in ("j", "ka", "kc")], axis=1)
    return list(
        zip(lines.frequency_mhz.tolist(), quanta[lines.upper].tolist(), quanta[lines.lower].tolist(), strict=True)
    )


def random_action(lines: list[Any], random: np.random.Generator) -> dict[str, Any]:
    """An assignment, undo, redo, refit, or a change of the settings."""
    kind = str(random.choice(KINDS, p=SHARES))
    if kind == "settings":
        return {"do": kind, "auto_refit": bool(random.integers(2))}
    if kind != "assign":
        return {"do": kind}
    frequency, upper, lower = lines[random.integers(len(lines))]
    frequency = round(frequency + 0.002 * random.normal(), 6)
    return {
        "do": "assign",
        "frequency_mhz": frequency,
        "error_mhz": 0.002,
        "to": [{"species": 1, "upper": upper, "lower": lower}],
    }


@contextmanager
def served(folder: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A server in its own process, and its address; killed at the end."""
    words = [sys.executable, "-m", "rotor", "view", "spectrum.csv", NAME, "--temperature", f"{KELVIN}", "--no-browser"]
    environment = {**os.environ, "PYTHONPATH": str(PROJECT)}
    process = subprocess.Popen(words, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield process, process.stdout.readline().strip()
    finally:
        process.kill()
        process.wait(10)
        process.stdout.close()


@contextmanager
def watched(path: Path, outcome: Outcome) -> Iterator[None]:
    """Read a session file again and again meanwhile; AssertionError where it was not whole at any time."""
    ended, failures = threading.Event(), list[Exception]()

    def read() -> None:
        while not ended.wait(0.003):
            try:
                read_session_file(path)
                outcome.reads += 1
            except (OSError, msgspec.DecodeError, KeyError) as error:
                failures.append(error)

    thread = threading.Thread(target=read)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
    assert not failures, failures[0]


def connect(address: str) -> Any:
    """The websocket of a page with this address."""
    from websockets.sync.client import connect

    host = address.split("/")[2]
    return connect(f"ws{address.removeprefix('http')}socket", origin=f"http://{host}", max_size=None)


def call(socket: Any, message: dict[str, Any]) -> Any:
    """The answer to a message; EOFError where the server ends before it."""
    from websockets.exceptions import ConnectionClosed

    try:
        socket.send(msgspec.json.encode(message).decode())
        while "session" in (content := msgspec.json.decode(socket.recv(timeout=20))):
            pass
    except (ConnectionClosed, OSError) as error:
        raise EOFError from error
    return content


def kill_servers(folder: Path, moments: int, seed: int) -> Outcome:
    """Kill servers of one session, each at a random moment while actions are sent, and resume it each time."""
    write_case(folder)
    x, y = spectrum_columns(BAND, step=0.2)  # is read in a moment
    np.savetxt(
        folder / "spectrum.csv", np.stack([x, y], axis=1), delimiter=",", header="frequency_mhz,intensity", comments=""
    )
    random, lines, session = np.random.default_rng(seed), strong_lines(), folder / SESSION
    journal, outcome = Journal(revision=1), Outcome()  # the molecule is the first change
    for _ in range(moments):
        with served(folder) as (process, address), connect(address) as socket, watched(session, outcome):
            shown = call(socket, {"do": "hello"})["ok"]["session"]
            assert (shown["revision"], lines_of_records(shown["records"])) == (journal.revision, journal.lines)
            timer = threading.Timer(LATEST_S * random.random(), process.kill)
            timer.start()
            with suppress(EOFError):
                while True:
                    if not journal.begin(random_action(lines, random)):
                        continue
                    answer = call(socket, journal.action)
                    moved = answer.get("ok", {}).get("label") is not None
                    journal.end(moved)
                    outcome.acknowledged += moved
            timer.join()
            assert process.wait(10) == -9
        outcome.moments += 1
        outcome.unanswered += bool(journal.action)
        outcome.saved += journal.check(*read_session_file(session))
    with served(folder) as (_, address), connect(address) as socket:
        shown = call(socket, {"do": "hello"})["ok"]["session"]
        assert lines_of_records(shown["records"]) == journal.lines
    return outcome


def lines_of_records(records: dict[str, Any]) -> Lines:
    """Assigned lines of the records that a page gets."""
    return {
        (tuple(record["upper"]), tuple(record["lower"])): record["frequency_mhz"]
        for key, record in records.items()
        if key.startswith("line/")
    }


PLAN_IN_PAGE = """async (plan) => {
    const v = rotorView;
    for (const [i, action] of plan.entries()) {
      let acts = () => v.do(action);
      if (action.do === "assign" && i % 2) {
        const f = action.frequency_mhz;
        v.wish = action.to[0];
        await v.fitPeak(f - 0.4, f + 0.4, v.active);
        action.frequency_mhz = v.offered.peak.frequency_mhz;
        acts = async () => { await v.assign(); return { label: v.offered === null || null }; };
      }
      if (!await beginAction(action)) continue;
      const answer = await acts();
      await endAction(answer?.label ?? null);
    } }"""


def kill_pages(folder: Path, moments: int, seed: int, browser: Any) -> Outcome:
    """Close (even moments) or crash (odd ones) pages of one server, each at a random moment while it assigns, and open a new page."""
    write_case(folder)
    random, lines, session = np.random.default_rng(seed), strong_lines(), folder / SESSION
    journal, outcome = Journal(revision=1), Outcome()

    def end(label: Any) -> None:
        journal.end(label is not None)
        outcome.acknowledged += label is not None

    with served(folder) as (_, address):
        for moment in range(moments + 1):
            page = open_page(browser, address, journal.begin, end)
            outcome.saved += journal.check(*shown_by(page))
            assert read_session_file(session) == shown_by(page)
            if moment == moments:
                page.context.close()
                return outcome
            plan = [random_action(lines, random) for _ in range(60)]
            with watched(session, outcome):
                page.evaluate(f"(plan) => {{ ({PLAN_IN_PAGE})(plan); }}", plan)
                page.wait_for_timeout(1000 * LATEST_IN_PAGE_S * random.random())
                crash(page) if moment % 2 else page.close()
            outcome.moments += 1
            outcome.unanswered += bool(journal.action)
            page.context.close()
    return outcome


def open_page(browser: Any, address: str, begin: Any, end: Any) -> Any:
    """A page of the server, ready, that reports its actions."""
    page = browser.new_context().new_page()
    page.expose_function("beginAction", begin)
    page.expose_function("endAction", end)
    page.goto(address)
    page.wait_for_selector("[data-ready=yes]", timeout=30_000)
    return page


def shown_by(page: Any) -> tuple[int, Lines]:
    """Revision and assigned lines that a page shows."""
    shown = page.evaluate("rotorView.session")
    return shown["revision"], lines_of_records(shown["records"])


def crash(page: Any) -> None:
    """End the process that draws a page."""
    from playwright.sync_api import Error

    with page.expect_event("crash"), suppress(Error):
        page.goto("chrome://crash")
