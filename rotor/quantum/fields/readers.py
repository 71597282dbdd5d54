"""Inputs of levels in static fields: the highest J of the free levels, |M|, and the direction of a field."""

from __future__ import annotations

import math
import re
from typing import Any

from rotor.units import parse_quantity

MOST_J = 500  # of the basis: a minute's work for an asymmetric top


def highest_j(given: Any) -> int:
    """The J of `J<=2`, or of the number alone.

    >>> highest_j("J <= 2"), highest_j("3"), highest_j(4)
    (2, 3, 4)
    """
    if isinstance(given, int) and not isinstance(given, bool):
        return given
    number = str(given).replace(" ", "").upper().removeprefix("J<=").removeprefix("J≤")
    if not number.isdecimal():
        raise ValueError(f"{given!r}: expected J<=2, or the number alone")
    return int(number)


def read_m(given: Any) -> tuple[float, ...]:
    """Values of |M| between commas, or a list of them."""
    if not isinstance(given, str):
        return tuple(given)
    parts = [part.strip() for part in given.split(",")]
    if not all(re.fullmatch(r"\d+(\.[05])?", part) for part in parts):
        raise ValueError(f"{given!r}: expected numbers of 0 or more between commas, such as 0,1, or 0.5,1.5 of M_F")
    return tuple(float(part) if "." in part else int(part) for part in parts)


def read_direction(given: Any) -> tuple[float, float, float]:
    """Three components; or, of an angle, the direction in the plane of X and Z at that angle with Z, exactly Z for 0."""
    if isinstance(given, str | int | float):
        try:
            angle = parse_quantity(given, "deg")
        except ValueError as error:
            raise ValueError(
                str(error) if "unit" in str(error) else f"{given!r}: expected an angle in degrees"
            ) from None
        return (math.sin(math.radians(angle)), 0.0, math.cos(math.radians(angle))) if angle else (0.0, 0.0, 1.0)
    if len(given) != 3:
        raise ValueError(f"{list(given)}: expected three numbers")
    x, y, z = map(float, given)
    return x, y, z
