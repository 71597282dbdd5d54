"""Checks of arguments with uniform messages: name, value, rule."""

from __future__ import annotations

import math
import os
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


def require_positive(name: str, value: float, unit: str = "") -> float:
    """The value; ValueError unless it is finite and above zero.

    >>> require_positive("temperature_k", 300.0)
    300.0
    """
    in_unit = f" {unit}" if unit else ""
    if isinstance(value, str):
        raise ValueError(f"{name}: {value!r}: expected a number above 0{in_unit}, not a text")
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"{name}: {value:g}: expected a finite number above 0{in_unit}")
    return value


def require_whole(name: str, value: int | None, least: int, most: int | None = None) -> None:
    """Raise ValueError for a whole number out of bounds; None passes.

    name: name of the number in the error. value: the number. least: smallest allowed value. most: largest allowed value.
    Raises ValueError with name, value and bounds.
    """
    if value is not None and not hasattr(value, "__index__"):
        raise ValueError(f"{name}: {value!r}: expected a whole number, of type int")
    if value is not None and (value < least or (most is not None and value > most)):
        bounds = f"of {least} or more" if most is None else f"from {least} to {most}"
        raise ValueError(f"{name}: {value}: expected a whole number {bounds}")


def require_between(name: str, value: float, low: float, high: float) -> float:
    """The value; ValueError unless it lies strictly between two bounds.

    name: name of the number in the error. value: the number. low, high: bounds, excluded.
    Returns: the value.
    Raises ValueError with name, value and bounds.
    """
    if not low < value < high:
        raise ValueError(f"{name}: {value:g}: expected a number between {low:g} and {high:g}")
    return value


def require_file(path: str | os.PathLike[str], rule: str = "") -> None:
    """Raise ValueError for a folder, and for a path that does not exist.

    path: path that was given. rule: what would do, such as "expected a spectrum"; of a folder by default, a file in it.
    """
    if Path(path).is_dir():
        raise ValueError(f"{path}: is a folder; {rule or 'give a file in it'}")
    if not Path(path).exists():
        raise ValueError(f"{path}: no such file{rule and '; '}{rule}")


def read_text(path: str | os.PathLike[str]) -> str:
    """The text of a file without a byte-order mark; ValueError, with the line, for bytes that are not UTF-8."""
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise not_text(error, os.fspath(path)) from None


def not_text(error: UnicodeDecodeError, where: str) -> ValueError:
    """The error for bytes that are not the text expected; error: of the whole content."""
    line = error.object[: error.start].count(b"\n") + 1
    encoding = error.encoding.upper().removesuffix("-SIG")
    return ValueError(f"{where}, line {line}: not {encoding} text ({error.reason}); save it as UTF-8")


def require_choice(name: str, value: str, allowed: Collection[str]) -> str:
    """The value; ValueError unless it is one of the allowed words."""
    if value not in allowed:
        raise ValueError(f"{name}: {value!r}: expected one of {', '.join(allowed)}")
    return value


def require_top(value: object) -> None:
    """Raise ValueError for an object that is not a Top; this module imports nothing and knows a top by its constants."""
    if not hasattr(value, "constants"):
        raise ValueError(f"top: {value!r:.60}: expected a Top; rotor.read makes one of a name, a file or a molecule")


_HELD = {
    "Catalogue": "a catalogue of lines (rotor cat shows it)",
    "LineList": "a list of measured lines (rotor fit finds constants from it)",
    "LevelList": "a list of levels",
}


def no_molecule(source: object, value: object) -> ValueError:
    """The error for a file that was read and holds something else than a molecule."""
    name = type(value).__name__
    return ValueError(f"{source}: holds {_HELD.get(name, f'a {name}')}, not a molecule or constants")


class NoAnswerError(RuntimeError):
    """The input is valid, but no answer was reached: exit code 1, and no file is written."""


class RunStopped(ValueError):
    """A run stopped after it began; files written so far remain."""


@contextmanager
def leaving(*files: tuple[str | os.PathLike[str], str], new: bool = False) -> Iterator[None]:
    """Context in which the text of an interrupt names the first of these files that exists, with what it is good for.

    new: only files written within the context, not those of an earlier run.
    """
    before = {path: _stamp(path) for path, _ in files if new}
    try:
        yield
    except KeyboardInterrupt as stop:
        texts = [f"interrupted; {path} {use}" for path, use in files if _stamp(path) not in (None, before.get(path))]
        if stop.args or not texts:
            raise
        raise KeyboardInterrupt(texts[0]) from None


def _stamp(path: str | os.PathLike[str]) -> tuple[int, int, int] | None:
    """Identity, time and size of a file; None if there is none."""
    try:
        state = os.stat(path)
    except OSError:
        return None
    return state.st_ino, state.st_mtime_ns, state.st_size


def warn_renamed(old: str, new: str, stacklevel: int = 3) -> None:
    """Warn of a former name; stacklevel: 3 where the caller of this function is called by the user's code."""
    import warnings

    text = f"{old} is {new} from version 0.3 on; see docs/migration.md"
    warnings.warn(text, DeprecationWarning, stacklevel=stacklevel)


class Renamed:
    """The former name of a method, which works for one minor release with a DeprecationWarning."""

    def __init__(self, new: str) -> None:
        self.new = new

    def __set_name__(self, owner: type, name: str) -> None:
        self.old = name

    def __get__(self, instance: object, owner: type) -> Any:
        warn_renamed(f"{owner.__name__}.{self.old}", self.new)
        return getattr(owner if instance is None else instance, self.new)


def did_you_mean(name: str, names: Iterable[str]) -> str:
    """End of a message with the names similar to an unknown one; empty if there are none.

    >>> did_you_mean("jmex", ["jmax", "range"])
    '; did you mean jmax?'
    """
    from difflib import get_close_matches

    matches = get_close_matches(name, list(names), n=3)
    return f"; did you mean {', '.join(matches)}?" if matches else ""


def first_names(known: Iterable[str], most: int = 12) -> str:
    """The first of the known names, and how many more there are: errors stay readable.

    >>> first_names("ABCDE", 3)
    'A, B, C and 2 more'
    """
    names = list(known)
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")
