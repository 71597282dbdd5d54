"""Result of an accuracy goal: the chosen settings and the error that was reached."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import msgspec


class TotalAccuracy(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An accuracy of the whole error budget, not of its numerical part alone."""

    total: Annotated[str | float, msgspec.Meta(description="of all sources of error together")]


Accuracy = str | float | TotalAccuracy | None


@dataclass(frozen=True)
class Reached:
    """The requested accuracy and the error that was reached, in `unit`. how: the chosen settings."""

    asked: float
    error: float
    unit: str
    how: str
