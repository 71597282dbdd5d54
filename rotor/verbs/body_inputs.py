"""Inputs of `tumble`: a named body or bare moments, initial conditions, and times with units."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from rotor.classical.effect import BODY_EFFECTS, DEFAULT_TOLERANCE
from rotor.frozen import dataclass
from rotor.requests.field import MOLECULE, NUMERICS, all_fields, declared
from rotor.requests.readers import Custom, Quantity, Reader, Whole
from rotor.units import parse_grid

if TYPE_CHECKING:
    from rotor.classical.bodies import NamedBody
    from rotor.classical.tumble import Three

_UNIT_AT_END = re.compile(r"[A-Za-z][\w ²*^/]*$")
MOST_TIMES = 10_000_000


def three(raw: Any, unit: str = "") -> Three:
    """Three finite numbers; a text may carry a unit, else `unit` holds."""
    x, y, z = _numbers(raw, 3, "three numbers, such as 0.6,0.8,1.0", unit)
    return x, y, z


def _four(raw: Any) -> tuple[float, float, float, float]:
    w, x, y, z = _numbers(raw, 4, "four numbers, such as 1,0,0,0")
    return w, x, y, z


def _numbers(raw: Any, count: int, expected: str, unit: str = "") -> list[float]:
    if isinstance(raw, str) and (raw.count(",") != count - 1 or ":" in raw):
        raise ValueError(f"{raw!r}: expected {expected}")
    values = [float(number) for number in (parse_grid(raw, unit) if isinstance(raw, str) else raw)]
    if len(values) != count:
        raise ValueError(f"{values}: expected {expected}")
    return values


def _moments(raw: Any) -> Three:
    from rotor.classical.euler import checked_moments

    moments = three(raw, "kg*m2" if in_si(raw) else "")
    try:
        checked_moments(moments)
    except ValueError as error:
        text = str(error)
        raise ValueError(f"{raw!r}: {text}" if isinstance(raw, str) else text) from None
    return moments


def _named_body(raw: Any) -> NamedBody:
    from rotor.classical.bodies import named_body

    return named_body(raw)


def in_si(moments: Any) -> bool:
    """Whether the moments carry a unit."""
    return isinstance(moments, str) and bool(_UNIT_AT_END.search(moments))


def _units(raw: Any) -> str:
    if raw not in ("", "SI"):
        raise ValueError(f'{raw!r}: expected "SI", or "" for any coherent set')
    return str(raw)


@dataclass(frozen=True, eq=False, repr=False)
class InBodyUnits(Reader):
    """Numbers in the body's units. Text is read once the body is known."""

    metavar: str
    scene_type: Any = list[float]

    def write(self, value: Any) -> Any:
        """Text and a single number unchanged, several numbers as a list."""
        return value if isinstance(value, str | int | float) else [float(number) for number in value]


@dataclass(frozen=True)
class BodyInput:
    """A rigid body instead of a molecule, in any coherent units."""

    body: NamedBody | None = declared(
        None, Custom(_named_body, lambda body: body.name, "NAME"), "Everyday body instead of a molecule: book, phone, racket or wing-nut",
        "body.name", option="--body", panel=MOLECULE, common=True, example="book",
    )  # fmt: skip
    moments: Three | None = declared(
        None, Custom(_moments, list, "I1,I2,I3", list[float] | str),
        'Principal moments instead of a molecule, in any order: "1,2,3 kg m2", or plain numbers in any coherent units', "body.moments",
        panel=MOLECULE, common=True, example=[0.3, 0.35, 0.4],
    )  # fmt: skip
    units: str = declared("", Custom(_units), '"SI" (kg m², s, J), or "" for any coherent set', "body.units", option="")
    angular_momentum: Three | None = declared(
        None,
        InBodyUnits("L1,L2,L3"),
        "Angular momentum at time 0, in principal axes",
        "body.angular_momentum",
        option="",
        example=[1.8, 0.4, -0.9],
    )
    angular_velocity: Three | None = declared(
        None, InBodyUnits("W1,W2,W3"),
        "Angular velocity at time 0, in principal axes, instead of the angular momentum: 0.1,10,0 (rad/s; rad/ps "
        "for a molecule; also rpm, deg/s)", "body.angular_velocity", option="--omega", common=True, example=[0.1, 15.0, 0.1],
    )  # fmt: skip
    attitude: tuple[float, float, float, float] | None = declared(
        None, Custom(_four, list, "W,X,Y,Z", list[float]), "With effects: unit quaternion, body to space, at time 0", "body.attitude",
        example=[1.0, 0.0, 0.0, 0.0],
    )  # fmt: skip


@dataclass(frozen=True)
class MotionInput:
    """Initial motion of a body, torques on it, and output times."""

    temperature_k: float = declared(
        300.0, Quantity("K", above=0, metavar="T"), "Temperature of the thermal mean |L| of a molecule (K)",
        "conditions.temperature", common=True,
    )  # fmt: skip
    angular_momentum: Three | None = declared(
        None, InBodyUnits("L1,L2,L3"), "Angular momentum at time 0, in principal axes (ħ for a molecule; by default the thermal mean)",
        "conditions.angular_momentum", common=True, example=[10.0, 0.1, 0.1],
    )  # fmt: skip
    times: Any = declared(
        None, InBodyUnits("GRID", list[float] | str), "Times (ps for a molecule, s with SI units); by default two periods",
        "conditions.times", common=True, example="0:2:201",
    )  # fmt: skip
    effects: tuple[Any, ...] = declared(
        (), BODY_EFFECTS, 'Torque or other effect: its name and parameters, such as "linear drag coefficients=0.1,0.1,0.2"; repeatable',
        "effects", option="--effect", common=True,
    )  # fmt: skip
    tolerance: float = declared(
        DEFAULT_TOLERANCE, Quantity(), "With effects: tolerance of a step, relative to |L| and one radian", "numerics.tolerance",
        typed=DEFAULT_TOLERANCE,
    )  # fmt: skip
    step: float | None = declared(
        None, InBodyUnits("T", float | str),
        "With effects: step of a splitting instead, where no torque depends on the angular velocity", "numerics.step", panel=NUMERICS,
        example=0.01,
    )  # fmt: skip
    order: int = declared(4, Whole(), "Order of the splitting: 2, 4, 6 or 8", "numerics.order")


BODY = {field.name: field for field in all_fields(BodyInput).values()}
MOTION = {field.name: field for field in all_fields(MotionInput).values()}
