"""A session: the state of a page with everything that undo and redo need, in one JSON file that is written after each action.

The file is written beside and renamed, so that a process that is killed leaves the session as of its last finished action. A second
program on the same session is refused; several pages of one server share the session.
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


def sha256_of(path: str | os.PathLike[str]) -> str:
    """The hash of a file's content."""
    with open(path, "rb") as handle:
        return hashlib.file_digest(handle, "sha256").hexdigest()


class Session:
    """The state of a session and its journal. path: of the file; None for a session that is not saved.

    warnings: what must be known of how it was resumed. Listeners are called after each change.
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
        """Carry out an action as one step; False where it changes nothing."""
        step = self.state.step(label, changes)
        if not step.after:
            return False
        self._move(step.after, [*self.done, step][-MOST_STEPS:], [])
        return True

    def undo(self) -> str:
        """Take the last action back; its label. ValueError where there is none."""
        if not self.done:
            raise ValueError("undo: there is no action to take back")
        *done, step = self.done
        self._move(step.before, done, [*self.undone, step])
        return step.label

    def redo(self) -> str:
        """Carry out again what was taken back last; its label. ValueError where there is nothing."""
        if not self.undone:
            raise ValueError("redo: no action was taken back")
        *undone, step = self.undone
        self._move(step.after, [*self.done, step], undone)
        return step.label

    def _move(self, changes: Changes, done: list[Step], undone: list[Step]) -> None:
        """The new state, first on disk, then here, so that a page never shows what a resumed session lacks."""
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
        """Refuse other programs on this session until `release`; ValueError where another one has it."""
        if self.path is not None:
            self._lock.enter_context(locked_file(self.path))

    def release(self) -> None:
        """Let other programs have the session."""
        self._lock.close()


def spectrum_file(path: Path, points: int, folder: Path, stated: SpectrumFile | None = None) -> SpectrumFile:
    """How a session in a folder refers to a spectrum: below the folder by its relative path. stated: its units and noise."""
    where, base = path.resolve(), folder.resolve()
    shown = where.relative_to(base) if where.is_relative_to(base) else where
    begin = stated or SpectrumFile("", "", 0)
    return msgspec.structs.replace(begin, path=shown.as_posix(), sha256=sha256_of(path), points=points)


def is_session(path: str | os.PathLike[str]) -> bool:
    """Whether a file's name is that of a session."""
    return os.fspath(path).endswith(SUFFIX)


def read_session(path: Path) -> Session:
    """The session of a file, as it was saved last.

    Raises ValueError with the place for what is no session, one of a later version, and records that cannot be.
    """
    try:
        content = msgspec.json.decode(path.read_bytes(), type=SessionFile)
    except msgspec.MsgspecError as error:
        raise ValueError(
            f"{path}: not a session of rotor view: {error}; name another file with --session to begin a new one"
        ) from None
    if content.kind != KIND or content.schema != SCHEMA:
        raise ValueError(
            f"{path}: kind {content.kind!r}, schema {content.schema}; this version reads {KIND!r}, schema {SCHEMA}"
        )
    session = Session(content.spectrum, path, State(content.records))
    session.revision, session.done, session.undone = content.revision, content.done, content.undone
    return session


def check_spectrum(session: Session, path: Path, points: int, folder: Path) -> None:
    """Say in the session's warnings where the spectrum is another than the one it was saved with, and refer to the new one."""
    before, now = session.spectrum, spectrum_file(path, points, folder, session.spectrum)
    if before.sha256 != now.sha256:
        session.warnings += (
            f"{path.name} has changed since the session was saved ({before.points} points then, {now.points} now); "
            "assigned frequencies are those of the earlier spectrum",
        )
    session.spectrum = now


def facts(session: Session) -> dict[str, Any]:
    """The session as a page gets it: records, and what can be undone."""
    return {
        "revision": session.revision,
        "spectrum": msgspec.to_builtins(session.spectrum),
        "records": msgspec.to_builtins(dict(session.state.records)),
        "undo": session.done[-1].label if session.done else None,
        "redo": session.undone[-1].label if session.undone else None,
        "warnings": list(session.warnings),
    }
