"""Further states from texts of the command line and of scenes, with the content of the table [states] of a molecule file.

constants   E[1]=23785.9 A[1]=... W[0,1]=3 MHz
names       0+,0-                                   a name for each state, from 0 on
symmetry    C2v                                     group of the states, one of `state_constants.GROUPS`
weights     [0] even=1,odd=3  [1] even=3,odd=1      spin weights that differ from the top's; "none": equal weights of all levels
dipoles     [1] 0,0,1.30  [0,1] 0,0,1.47 D          along a, b, c, within a state or between two
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, TypeVar

from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.states.state_constants import StateConstants, Vector
from rotor.units import parse_grid

if TYPE_CHECKING:
    from rotor.tops.top import Top

T = TypeVar("T")
WORDS = {
    "state_names": "names",
    "state_symmetry": "symmetry",
    "state_weights": "spin weights",
    "state_dipoles": "dipoles",
}
KEYS = ("state_constants", *WORDS)
_ITEM = re.compile(r"\[(?P<states>[^\[\]]*)\]\s*=?\s*(?P<text>[^\[\]]+)")


def with_state_texts(top: Top, texts: Mapping[str, str | None], source: str) -> Top:
    """A top with further states, or with changed names, weights, dipoles or symmetry of its states.

    Weights and dipoles without an entry do not change.

    Parameters
    ----------
    top : Top
    texts : mapping of str to str or None
        Texts by `KEYS`; a key may be missing or None.
    source : str
        Source of the texts; it is added to the source of the top's states.

    Returns
    -------
    Top

    Raises
    ------
    ValueError
        For an unreadable text, and for a text about a state that the top does not have; the message begins with the key.

    Examples
    --------
    >>> from rotor.tops.top import Top
    >>> top = Top.from_constants("A=9 B=8 C=7 GHz")
    >>> states = {"state_constants": "E[1]=5 A[1]=9 B[1]=8 C[1]=7 GHz", "state_dipoles": "[0,1] 0,0,1.47"}
    >>> dict(with_state_texts(top, states, "given").states.dipoles)
    {(1, 0): (0.0, 0.0, 1.47)}
    """
    stated = {key: text for key in KEYS if (text := texts.get(key)) is not None}
    if not stated:
        return top
    states, first = top.states, next(iter(stated))
    if "state_constants" in stated:
        states = _parsed("state_constants", lambda: StateConstants.parse(stated["state_constants"], source))
    if states is None:
        raise ValueError(f"{first}: this top has a single state; give the constants of further states too")
    for key, text in stated.items():
        if key != "state_constants":
            states = _parsed(key, partial(_changed, states, key, text, top))
    changed = [WORDS[key] for key in stated if key in WORDS and "state_constants" not in stated]
    said = [states.source, f"{', '.join(changed)} {source}" if changed else ""]
    whole = replace(states, source="; ".join(filter(None, said)))
    try:
        return replace(top, states=whole)
    except ValueError as error:
        dipole_keys = [
            key for key in ("state_dipoles", "state_weights") if key in stated and str(error).startswith("dipole")
        ]
        raise ValueError(f"{[*dipole_keys, first][0]}: {error}") from None


def _changed(states: StateConstants, key: str, text: str, top: Top) -> StateConstants:
    """The states after the change that a text describes."""
    if key == "state_names":
        return replace(states, names=tuple(name.strip() for name in text.split(",")))
    if key == "state_symmetry":
        return replace(states, symmetry=text.strip())
    if key == "state_weights":
        return replace(states, weights={**states.weights, **parse_weights(text, top)})
    return replace(states, dipoles={**states.dipoles, **parse_dipoles(text)})


def _parsed(key: str, make: Callable[[], T]) -> T:
    try:
        return make()
    except ValueError as error:
        raise ValueError(f"{key}: {error}") from None


def parse_dipoles(text: str) -> dict[tuple[int, int], Vector]:
    """Dipoles in debye by pairs of states, from `[1] 0,0,1.3 [0,1] 0,0,1.47`.

    >>> parse_dipoles("[1]=0,0,1.3 [0,1]=0,0,1.47 D")
    {(1, 1): (0.0, 0.0, 1.3), (1, 0): (0.0, 0.0, 1.47)}
    """
    dipoles: dict[tuple[int, int], Vector] = {}
    for states, part in _items(text, "[0,1] 0,0,1.47", 2):
        numbers = parse_grid(part, "D").tolist() if ":" not in part else []
        if len(numbers) != 3:
            raise ValueError(f"{part!r}: expected three numbers, along a, b, c in D")
        pair = (states[-1], states[0])
        if pair in dipoles:
            raise ValueError(f"{text!r}: the states {list(states)} are given twice; leave one out")
        dipoles[pair] = (numbers[0], numbers[1], numbers[2])
    return dipoles


def parse_weights(text: str, top: Top) -> dict[int, SpinWeights]:
    """Spin weights by state, from `[0] even=1,odd=3 [1] even=3,odd=1`; "none" for equal weights of all levels."""
    weights: dict[int, SpinWeights] = {}
    for (state,), part in _items(text, "[1] even=3,odd=1", 1):
        if state in weights:
            raise ValueError(f"{text!r}: state {state} is given twice; leave one out")
        weights[state] = SpinWeights() if part == "none" else _weights(part)
        rule = weights[state].rule
        if "none" not in (rule, top.spin_weights.rule) and rule != top.spin_weights.rule:
            raise ValueError(
                f"{part!r}: these weights follow the rule {rule}, those of the top the rule {top.spin_weights.rule}; use the top's rule"
            )
    return weights


def _weights(text: str) -> SpinWeights:
    values: dict[str, int] = {}
    for item in text.split(","):
        name, equals, number = (part.strip() for part in item.partition("="))
        if not (name and equals and number.isdecimal()) or name in values:
            raise ValueError(f"{item.strip()!r}: expected class=number, each class once, such as even=1, or none")
        values[name] = int(number)
    weights = SpinWeights.from_mapping(values)
    if weights.to_mapping() != values:
        raise ValueError(f"{text!r}: expected numbers without a common divisor, as those of state 0 have")
    return weights


def _items(text: str, example: str, most: int) -> list[tuple[tuple[int, ...], str]]:
    """Numbers of states in rising order, with the text that follows them."""
    items = list(_ITEM.finditer(text))
    if not items or _ITEM.sub("", text).strip(" ,;"):
        raise ValueError(f"{text!r}: expected the state in square brackets and its value, such as {example}")
    return [(_states(item["states"], example, most), item["text"].strip(" ,;")) for item in items]


def _states(text: str, example: str, most: int) -> tuple[int, ...]:
    parts = [part.strip() for part in text.split(",")]
    if len(parts) > most or not all(part.isdecimal() for part in parts):
        what = "the number of a state" if most == 1 else "the number of a state, or of two"
        raise ValueError(f"[{text}]: expected {what}, 0 for the top's own, such as {example}")
    return tuple(sorted(map(int, parts)))
