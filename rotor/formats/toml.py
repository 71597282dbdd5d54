"""TOML text as tables, whose faults all raise ValueError, and keys and values as TOML text."""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Mapping
from typing import Any

from rotor.checks import read_text

_BARE = re.compile(r"[A-Za-z0-9_-]+")  # keys without quotation marks
MOST_DEPTH = 50  # deepest nesting of lists and tables; the files here have four levels


def read_toml(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The tables of a TOML file; ValueError as `parse_toml`, and for bytes that are not UTF-8."""
    return parse_toml(read_text(path), str(path))


def parse_toml(text: str, where: str) -> dict[str, Any]:
    """The tables of a TOML text; ValueError for invalid text, too deep nesting, or numbers too large for a double."""
    too_deep = f"{where}: lists or tables more than {MOST_DEPTH} deep; four are enough"
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{where}: not a TOML file: {error}") from None
    except RecursionError:
        raise ValueError(too_deep) from None
    except ValueError:  # Python's bound for the digits of a whole number
        raise ValueError(f"{where}: not a TOML file: a whole number of thousands of digits") from None
    inner: list[tuple[Any, int]] = [(content, 0)]
    while inner:
        thing, depth = inner.pop()
        if depth > MOST_DEPTH:
            raise ValueError(too_deep)
        if isinstance(thing, dict | list):
            inner += [(item, depth + 1) for item in (thing.values() if isinstance(thing, dict) else thing)]
        elif isinstance(thing, int):
            try:
                float(thing)
            except OverflowError:
                raise ValueError(
                    f"{where}: a whole number of {len(str(thing))} digits is too large; write it as 1e99"
                ) from None
    return content


def toml_key(key: str) -> str:
    """A key, in quotation marks if it needs them."""
    return key if _BARE.fullmatch(key) else _quoted(key)


def toml_value(value: Any, *, by_row: bool = False) -> str:
    """A value; a number reads back as the same double. by_row: whether a list of lists has a line for each.

    >>> toml_value({"a": [1.5, True], "b c": "\\n"})
    '{ a = [1.5, true], "b c" = "\\\\n" }'
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{toml_key(key)} = {toml_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        if by_row and value and isinstance(value[0], list):
            return "[\n" + "".join(f"    {toml_value(row)},\n" for row in value) + "]"
        return f"[{', '.join(map(toml_value, value))}]"
    return repr(value)


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
