"""TOML text as tables; all faults raise ValueError."""

from __future__ import annotations

import math
import tomllib
from typing import Any

MOST_DEPTH = 50  # deepest nesting of lists and tables; the files here have four levels


def parse_toml(text: str, where: str) -> dict[str, Any]:
    """The tables of a TOML text; ValueError for invalid text, too deep nesting, or numbers too large for a double."""
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{where}: not a TOML file: {error}") from None
    except RecursionError:
        raise ValueError(_too_deep(where)) from None
    except ValueError:  # Python's bound for the digits of a whole number
        raise ValueError(f"{where}: not a TOML file: a whole number of thousands of digits") from None
    _refuse_extremes(content, where, 0)
    return content


def _too_deep(where: str) -> str:
    return f"{where}: lists or tables more than {MOST_DEPTH} deep; a molecule file needs four"


def _refuse_extremes(thing: Any, where: str, depth: int) -> None:
    if depth > MOST_DEPTH:
        raise ValueError(_too_deep(where))
    if isinstance(thing, dict | list):
        for item in thing.values() if isinstance(thing, dict) else thing:
            _refuse_extremes(item, where, depth + 1)
    elif isinstance(thing, int):
        try:
            math.isfinite(float(thing))
        except OverflowError:
            raise ValueError(
                f"{where}: a whole number of {len(str(thing))} digits is too large; write it as 1e99"
            ) from None
