"""Inputs of maps of levels in static fields: fields that requests share, readers of J, |M| and directions, and the tolerance as a knob."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from numbers import Real
from typing import Any

import numpy as np

from rotor.requests.field import declared
from rotor.requests.knob import Knob, Measure
from rotor.requests.readers import Custom, Quantity, Whole
from rotor.units import parse_quantity

MOST_J = 500  # highest J of a basis: about a minute for an asymmetric top
TOLERANCES_MHZ = (1e3, 1e2, 1e1, 1.0, 1e-1, 1e-2, 1e-4, 1e-6)
LEAST_MHZ = 1e-9
INTENSITY = Quantity("W/cm2", least=0, most=1e17, metavar="I")  # of light, far beyond the ionisation of any molecule


def largest_difference(first: Any, other: Any) -> float:
    """The largest difference of two arrays of one shape."""
    return float(np.max(np.abs(np.asarray(first) - np.asarray(other)), initial=0.0))


def _with_tolerance(request: Any, name: str, value: Any) -> Any:
    """The request with a tolerance of energies; the population at the edge of the basis, which affects only cosines, is not limited."""
    free = {"most_at_edge": 1.0} if hasattr(request, "most_at_edge") else {}
    return replace(request, **{name: value}, **free)


def _energies_alone(request: Any) -> Any:
    """The request without criteria other than energies, so that a small basis is not refused."""
    changes = {"diabatic_gap_mhz": None, "most_at_edge": 1.0}
    return replace(request, **{name: value for name, value in changes.items() if hasattr(request, name)})


def _finest(request: Any) -> float:
    """Tolerance of the reference: a hundredth of the finest one that is compared."""
    return float(max(1e-2 * min(*TOLERANCES_MHZ, request.tolerance_mhz), LEAST_MHZ))


ENERGY = Measure(
    "energy", "MHz", lambda answer, reference: largest_difference(answer.states.energy_mhz, reference.states.energy_mhz)
)
TOLERANCE = Knob(
    TOLERANCES_MHZ, _finest, (ENERGY,), "a tolerance of {:g} MHz", LEAST_MHZ,
    change=_with_tolerance, prepare=_energies_alone, used=lambda request: request.jmax is None,
)  # fmt: skip


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
    if isinstance(raw, str | Real):
        try:
            angle = parse_quantity(raw, "deg")
        except ValueError as error:
            raise ValueError(str(error) if "unit" in str(error) else f"{raw!r}: expected an angle in degrees") from None
        return (math.sin(math.radians(angle)), 0.0, math.cos(math.radians(angle))) if angle else (0.0, 0.0, 1.0)
    if len(raw) != 3:
        raise ValueError(f"{list(raw)}: expected three numbers")
    x, y, z = map(float, raw)
    return x, y, z


def states_field() -> Any:
    """The field `j_highest` of a request."""
    return declared(
        2,
        Custom(highest_j, scene_type=int),
        "Levels up to this J of the free molecule",
        "observables.jmax",
        option="--states",
        common=True,
    )


def basis_field(example: int) -> Any:
    """The field `jmax` of a request."""
    return declared(
        None,
        Whole(2, MOST_J),
        "Highest J of the basis; by default what the tolerance needs",
        "numerics.jmax",
        example=example,
    )


def tolerance_field(default_mhz: float, typed: str) -> Any:
    """The field `tolerance_mhz` of a request."""
    return declared(
        default_mhz,
        Quantity("MHz", above=0, metavar="E"),
        "Error of the energies (MHz)",
        "numerics.tolerance",
        typed=typed,
        knob=TOLERANCE,
    )
