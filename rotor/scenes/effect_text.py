"""Effects on a classical body as a line of text, with the names and parameters of the tables of scene files.

    linear drag coefficients=0.1,0.1,0.2
    periodic drive amplitude=0.1,0,0 angular_frequency=1.5 frame=space

Numbers of a vector are separated by commas, rows of a matrix by semicolons.
"""

from __future__ import annotations

import difflib
from typing import Any, get_args, get_type_hints

import msgspec

from rotor.scenes.effect_sections import EffectSection

SECTIONS: dict[str, Any] = {str(one.__struct_config__.tag): one for one in get_args(EffectSection)}  # by name


def effect_section(text: str) -> EffectSection:
    """The table that a line of text means.

    Raises ValueError for a name that there is not, a parameter that it has not, one that is missing, and a value that is none.

    >>> effect_section("linear drag coefficients=0.1, 0.1, 0.2").coefficients
    [0.1, 0.1, 0.2]
    """
    name, given = _parts(text)
    if name not in SECTIONS:
        raise ValueError(f"{text!r}: no effect is named {name!r}; {_nearest(name, list(SECTIONS))}")
    kind = SECTIONS[name]
    for key in given:
        if key not in kind.__struct_fields__:
            raise ValueError(f"{text!r}: {name} has no {key!r}; {_nearest(key, list(kind.__struct_fields__))}")
    values = {key: _value(key, value, text) for key, value in given.items()}
    try:
        found: EffectSection = msgspec.convert(values | {kind.__struct_config__.tag_field: name}, kind)
    except msgspec.ValidationError:
        missing = [one.name for one in msgspec.structs.fields(kind) if one.required and one.name not in values]
        if missing:
            raise ValueError(f"{text!r}: {missing[0]} is missing; give {_usage(kind)}") from None
        raise ValueError(f"{text!r}: a value of another kind is expected; give {_usage(kind)}") from None
    return found


def _parts(text: str) -> tuple[str, dict[str, str]]:
    """The name in front, and what is given for each parameter."""
    name: list[str] = []
    given: dict[str, str] = {}
    key = ""
    for word in text.split():
        before, equals, after = word.partition("=")
        if equals:
            key = before
            if not key or key in given:
                raise ValueError(f"{text!r}: expected each parameter once, as name=value")
            given[key] = after
        elif given:
            given[key] += word
        else:
            name.append(word)
    return " ".join(name), given


def _value(key: str, text: str, line: str) -> Any:
    """A word, a number, a vector or a matrix."""
    try:
        if ";" in text:
            return [[float(x) for x in row.split(",")] for row in text.split(";")]
        return [float(x) for x in text.split(",")] if "," in text else float(text)
    except ValueError:
        if text.isidentifier():
            return text
        raise ValueError(f"{line!r}: {key}={text}: expected numbers, separated by commas; rows by semicolons") from None


def _usage(kind: Any) -> str:
    """All parameters of an effect, with what each is."""
    hints = get_type_hints(kind, include_extras=True)
    return ", ".join(f"{name} ({hints[name].__metadata__[0].description})" for name in kind.__struct_fields__)


def _nearest(word: str, known: list[str]) -> str:
    near = difflib.get_close_matches(word, known, n=1, cutoff=0.5)
    return f"the nearest is {near[0]!r}" if near else f"there are {', '.join(known)}"
