"""What an accuracy comes to: the settings that were chosen for it, and the error that a result has reached."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

NOTHING_CHEAPER = "exact: nothing cheaper"


@dataclass(frozen=True)
class Choice:
    """request: with the settings that were chosen. how: which, in words. error: found while they were chosen, in the unit of the
    accuracy; 0 where the answer alone says it."""

    request: Any
    how: str
    error: float = 0.0


@dataclass(frozen=True)
class Reached:
    """asked, error: in `unit`. how: which settings were chosen for it."""

    asked: float
    error: float
    unit: str
    how: str
