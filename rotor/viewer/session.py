"""A session: state and journal for undo and redo, in a JSON file that is written after each action.

The file is written beside and renamed: a killed process leaves the session of its last finished action. A second program on the same
session is refused; the pages of a server share the session.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import msgspec

from rotor.formats.atomic_write import open_atomic
from rotor.temporary import locked_file
from rotor.version import version
from rotor.viewer.records import SCHEMA, Changes, Record, SpectrumFile, State, Step

SUFFIX = ".view.json"
MOST_STEPS = 1000  # that can be undone
KIND = "rotor view session"


class SessionFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The content of a session file."""

    kind: str
    schema: int
    rotor: str
    revision: int
    spectrum: SpectrumFile
    records: dict[str, Record]
    done: list[Step] = []
    undone: list[Step] = []


def file_sha256(path: str | os.PathLike[str]) -> str:
    """The hash of a file's content."""
    with open(path, "rb") as handle:
        return hashlib.file_digest(handle, "sha256").hexdigest()


class Session:
    """State and journal of a session. path: of its file; None for a session that is not saved.

    warnings: remarks about the resumed session. Listeners are called after each change.
    """

    def __init__(self, spectrum: SpectrumFile, path: Path | None = None, state: State | None = None) -> None:
        self.spectrum = spectrum
        self.path = path
        self.state = state or State({})
        self.revision = 0
        self.done: list[Step] = []
        self.undone: list[Step] = []
        self.warnings: tuple[str, ...] = ()
        self.listeners: list[Callable[[], None]] = []
        self._lock = ExitStack()

    def apply(self, label: str, changes: Changes) -> bool:
        """Carry out an action as a step; False for an action that changes nothing."""
        step = self.state.step(label, changes)
        if not step.after:
            return False
        self._move(step.after, [*self.done, step][-MOST_STEPS:], [])
        return True

    def undo(self) -> str:
        """Take back the last action and return its label; ValueError without an action."""
        if not self.done:
            raise ValueError("undo: there is no action to take back")
        *done, step = self.done
        self._move(step.before, done, [*self.undone, step])
        return step.label

    def redo(self) -> str:
        """Repeat the action that was taken back last and return its label; ValueError without such an action."""
        if not self.undone:
            raise ValueError("redo: no action was taken back")
        *undone, step = self.undone
        self._move(step.after, [*self.done, step], undone)
        return step.label

    def _move(self, changes: Changes, done: list[Step], undone: list[Step]) -> None:
        """Write the new state, then adopt it: a page shows only what a resumed session has."""
        state = self.state.with_changes(changes)
        self._write(state, done, undone, self.revision + 1)
        self.state, self.done, self.undone, self.revision = state, done, undone, self.revision + 1
        for listener in self.listeners:
            listener()

    def save(self) -> None:
        """Write the session file."""
        self._write(self.state, self.done, self.undone, self.revision)

    def _write(self, state: State, done: list[Step], undone: list[Step], revision: int) -> None:
        if self.path is None:
            return
        content = SessionFile(KIND, SCHEMA, version(), revision, self.spectrum, dict(state.records), done, undone)
        with open_atomic(self.path, "wb") as handle:
            handle.write(msgspec.json.encode(content) + b"\n")

    def hold(self) -> None:
        """Lock the session until `release`; ValueError for a session that another program has locked."""
        if self.path is not None:
            self._lock.enter_context(locked_file(self.path))

    def release(self) -> None:
        """Unlock the session."""
        self._lock.close()


def spectrum_file(path: Path, points: int, folder: Path, stated: SpectrumFile | None = None) -> SpectrumFile:
    """Reference of a session to a spectrum: relative path below the folder, else absolute. stated: units and noise."""
    where, base = path.resolve(), folder.resolve()
    shown = where.relative_to(base) if where.is_relative_to(base) else where
    begin = stated or SpectrumFile("", "", 0)
    return msgspec.structs.replace(begin, path=shown.as_posix(), sha256=file_sha256(path), points=points)


def is_session(path: str | os.PathLike[str]) -> bool:
    """Whether the name of a file is the name of a session."""
    return os.fspath(path).endswith(SUFFIX)


def read_session(path: Path) -> Session:
    """The saved session of a file.

    Raises ValueError with the place for other files, sessions of a later version, and invalid records.
    """
    try:
        content = msgspec.json.decode(path.read_bytes(), type=SessionFile)
    except msgspec.MsgspecError as error:
        raise ValueError(
            f"{path}: not a session of rotor view: {error}; name another file with --session to start a new session"
        ) from None
    if content.kind != KIND or content.schema != SCHEMA:
        raise ValueError(
            f"{path}: kind {content.kind!r}, schema {content.schema}; this version reads {KIND!r}, schema {SCHEMA}"
        )
    session = Session(content.spectrum, path, State(content.records))
    session.revision, session.done, session.undone = content.revision, content.done, content.undone
    return session


def check_spectrum(session: Session, path: Path, points: int, folder: Path) -> None:
    """Refer to the present spectrum, with a warning if it has changed since the session was saved."""
    before, now = session.spectrum, spectrum_file(path, points, folder, session.spectrum)
    if before.sha256 != now.sha256:
        session.warnings += (
            f"{path.name} has changed since the session was saved ({before.points} points then, {now.points} now); "
            "assigned frequencies are those of the earlier spectrum",
        )
    session.spectrum = now


def facts(session: Session) -> dict[str, Any]:
    """The session for a page: records, warnings, labels of the steps that can be undone and repeated."""
    return {
        "revision": session.revision,
        "spectrum": msgspec.to_builtins(session.spectrum),
        "records": msgspec.to_builtins(dict(session.state.records)),
        "undo": session.done[-1].label if session.done else None,
        "redo": session.undone[-1].label if session.undone else None,
        "warnings": list(session.warnings),
    }
