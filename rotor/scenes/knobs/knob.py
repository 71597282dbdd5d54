"""What a knob is: one setting of a calculation that is given values, coarsest first, and compared with a reference."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Setting:
    """One value of a knob. label: the value as text. request: for the knob's `answer`. own: whether the scene has this value."""

    label: str
    request: Any
    own: bool = False


@dataclass(frozen=True)
class Measure:
    """One error. of: what it is the error of. unit: of the number. error: of an answer beside that of the reference."""

    of: str
    unit: str
    error: Callable[[Any, Any], float]


@dataclass(frozen=True)
class Knob:
    """A setting to sweep.

    name: the key of the scene. measures: errors of each answer. settings: coarsest first. reference: what errors are measured
    against, None where the true value is known. against: the reference in words. answer: of a request; its processor time is what a
    setting costs. repeats: how many calculations one answer holds; the time of one is given.
    """

    name: str
    measures: tuple[Measure, ...]
    settings: tuple[Setting, ...]
    reference: Any
    against: str
    answer: Callable[[Any], Any]
    repeats: int = 1


@dataclass(frozen=True)
class Knobs:
    """All knobs of a scene. remarks: parts of the calculation that have none, or that are not swept, each with the reason."""

    knobs: tuple[Knob, ...]
    remarks: tuple[str, ...] = ()


def ladder(
    values: Iterable[float], own: float | None, make: Callable[[Any], Any], text: Callable[[Any], str] = "{:g}".format
) -> tuple[Setting, ...]:
    """Settings of values that rise or fall from coarse to fine, that of the scene itself among them.

    Parameters
    ----------
    values : iterable of float
        Coarse ones first.
    own : float or None
        The value of the scene; None where it has none.
    make : callable
        The request of a value.
    text : callable
        A value as text.

    Returns
    -------
    tuple of Setting
        Each value once.

    Examples
    --------
    >>> [(one.label, one.own) for one in ladder([1e-2, 1e-4], 1e-3, lambda tolerance: None)]
    [('0.01', False), ('0.001', True), ('0.0001', False)]
    """
    values = list(values)
    falling = len(values) > 1 and values[0] > values[-1]
    every = sorted({*values, *(() if own is None else (own,))}, reverse=falling)
    return tuple(Setting(text(one), make(one), one == own) for one in every)
