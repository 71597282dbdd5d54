"""Inputs of levels in static fields: the highest J of the free levels, |M|, and the direction of a field."""

from __future__ import annotations

import math
import re
from typing import Any

from rotor.units import parse_quantity

MOST_J = 500  # highest J of a basis: about a minute for an asymmetric top


def highest_j(raw: Any) -> int:
    """The J in `J<=2` or `2`.

    >>> highest_j("J <= 2"), highest_j("3"), highest_j(4)
    (2, 3, 4)
    """
    if isinstance(raw, int) and not isinstance(raw, bool):
        return raw
    number = str(raw).replace(" ", "").upper().removeprefix("J<=").removeprefix("J≤")
    if not number.isdecimal():
        raise ValueError(f"{raw!r}: expected J<=2, or the number alone")
    return int(number)


def read_m(raw: Any) -> tuple[float, ...]:
    """Values of |M| between commas, or a list of them."""
    if not isinstance(raw, str):
        return tuple(raw)
    parts = [part.strip() for part in raw.split(",")]
    if not all(re.fullmatch(r"\d+(\.[05])?", part) for part in parts):
        raise ValueError(f"{raw!r}: expected numbers of 0 or more between commas, such as 0,1, or 0.5,1.5 of M_F")
    return tuple(float(part) if "." in part else int(part) for part in parts)


def read_direction(raw: Any) -> tuple[float, float, float]:
    """Three components from a list, or the direction in the plane XZ at an angle (degrees) with Z; exactly Z for 0."""
    if isinstance(raw, str | int | float):
        try:
            angle = parse_quantity(raw, "deg")
        except ValueError as error:
            raise ValueError(str(error) if "unit" in str(error) else f"{raw!r}: expected an angle in degrees") from None
        return (math.sin(math.radians(angle)), 0.0, math.cos(math.radians(angle))) if angle else (0.0, 0.0, 1.0)
    if len(raw) != 3:
        raise ValueError(f"{list(raw)}: expected three numbers")
    x, y, z = map(float, raw)
    return x, y, z
