"""What an accuracy comes to: the settings that were chosen for it, and the error that a result has reached."""

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
    """asked, error: in `unit`. how: which settings were chosen for it."""

    asked: float
    error: float
    unit: str
    how: str
