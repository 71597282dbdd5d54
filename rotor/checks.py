"""Checks of arguments, each with one wording: name, value found, rule."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable


def require_positive(name: str, value: float, unit: str = "") -> float:
    """The value, refused with a ValueError unless it is finite and above zero.

    >>> require_positive("temperature_k", 300.0)
    300.0
    """
    of = f"{' ' if unit else ''}{unit}"
    if isinstance(value, str):
        raise ValueError(f"{name}: {value!r}: expected a number above 0{of}, not a text")
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"{name}: {value:g}: expected a finite number above 0{of}")
    return value


def require_whole(name: str, value: int | None, least: int, most: int | None = None) -> None:
    """Refuse a whole number out of bounds; None passes.

    Parameters
    ----------
    name : str
        What the number is called in the error.
    value : int or None
        The number.
    least : int
        The smallest that is allowed.
    most : int, optional
        The largest that is allowed.

    Raises
    ------
    ValueError
        With name, value and bounds.
    """
    if value is not None and not hasattr(value, "__index__"):
        raise ValueError(f"{name}: {value!r}: expected a whole number, of type int")
    if value is not None and (value < least or (most is not None and value > most)):
        bounds = f"of {least} or more" if most is None else f"from {least} to {most}"
        raise ValueError(f"{name}: {value}: expected a whole number {bounds}")


def require_between(name: str, value: float, low: float, high: float) -> float:
    """The value, refused unless it lies between two bounds, neither of them included.

    Parameters
    ----------
    name : str
        What the number is called in the error.
    value : float
        The number.
    low, high : float
        Bounds.

    Returns
    -------
    float
        The value.

    Raises
    ------
    ValueError
        With name, value and bounds.
    """
    if not low < value < high:
        raise ValueError(f"{name}: {value:g}: expected a number between {low:g} and {high:g}")
    return value


def require_one_of(name: str, value: str, known: Collection[str]) -> str:
    """The value, refused with a ValueError unless it is one of those known."""
    if value not in known:
        raise ValueError(f"{name}: {value!r}: expected one of {', '.join(known)}")
    return value


def require_top(value: object) -> None:
    """Refuse what is no top, such as its name; a top is known by its constants, since nothing is imported here."""
    if not hasattr(value, "constants"):
        raise ValueError(f"top: {value!r:.60}: expected a Top; rotor.read makes one of a name, a file or a molecule")


class NoAnswerError(RuntimeError):
    """The input is sound, but no answer was reached: exit code 1; nothing is written."""


class RunStopped(ValueError):
    """A run that began could not continue; what was written before stays."""


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """The names that are like an unknown one, as the end of a message; empty where there is none.

    >>> did_you_mean("jmex", ["jmax", "range"])
    '; did you mean jmax?'
    """
    from difflib import get_close_matches

    matches = get_close_matches(name, list(known), n=3)
    return f"; did you mean {', '.join(matches)}?" if matches else ""


def first_names(known: Iterable[str], most: int = 12) -> str:
    """The first of the known names, and how many more there are: errors stay readable.

    >>> first_names("ABCDE", 3)
    'A, B, C and 2 more'
    """
    names = list(known)
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")
