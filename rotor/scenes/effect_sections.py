"""Effects on a classical body, each a table of a scene: its name and its parameters; and what makes the effect of it.

The parameters are those of the classes in `rotor.classical.effects`; a module there is imported where its effect is named.
"""

from __future__ import annotations

from importlib import import_module
from typing import Annotated, Any, get_args

import msgspec

from rotor.verbs.tables import Section, said

Vector = list[float]
Matrix = list[float | list[float]]
_BODY_OR_SPACE = said('"body" or "space"')


class ConstantTorqueSection(Section, frozen=True, tag="constant torque", tag_field="effect"):
    """A torque that is constant in the body (a thruster) or in space."""

    vector: Annotated[Vector, said("the torque", [0.0, 0.0, 1.0])]
    frame: Annotated[str, _BODY_OR_SPACE] = "body"


class LinearDragSection(Section, frozen=True, tag="linear drag", tag_field="effect"):
    """Torque -C ω."""

    coefficients: Annotated[Matrix, said("diagonal (3,) or matrix (3, 3)")]


class QuadraticDragSection(Section, frozen=True, tag="quadratic drag", tag_field="effect"):
    """Torque -c |ω| ω."""

    coefficients: Annotated[Vector, said("three, not negative")]


class DriveSection(Section, frozen=True, tag="periodic drive", tag_field="effect"):
    """Torque amplitude cos(angular_frequency t + phase)."""

    amplitude: Annotated[Vector, said("the torque at its largest")]
    angular_frequency: Annotated[float, said("rad per time")]
    phase: Annotated[float, said("rad")] = 0.0
    frame: Annotated[str, _BODY_OR_SPACE] = "body"


class RotorSection(Section, frozen=True, tag="spinning rotor", tag_field="effect"):
    """A gyrostat: a rotor of constant angular momentum inside the body."""

    momentum: Annotated[Vector, said("of the rotor, in body axes")]


class GravitySection(Section, frozen=True, tag="gravity about pivot", tag_field="effect"):
    """Gravity on a body that turns about a fixed point."""

    mass: Annotated[float, said("of the body")]
    centre: Annotated[Vector, said("from pivot to centre of mass, in body axes")]
    gravity: Annotated[Vector, said("acceleration in space")]


class PermanentDipoleSection(Section, frozen=True, tag="permanent dipole", tag_field="effect"):
    """Torque μ x E."""

    dipole: Annotated[Vector, said("in body axes")]
    field: Annotated[Vector, said("in space")]


class InducedDipoleSection(Section, frozen=True, tag="induced dipole", tag_field="effect"):
    """Torque αE x E."""

    polarizability: Annotated[Matrix, said("diagonal (3,) or matrix (3, 3), in body axes")]
    field: Annotated[Vector, said("in space")]


class RollingSection(Section, frozen=True, tag="rolling ellipsoid", tag_field="effect"):
    """An ellipsoid that rolls on a plane without slipping."""

    mass: Annotated[float, said("of the body")]
    semiaxes: Annotated[Vector, said("of the ellipsoid")]
    gravity: Annotated[Vector, said("acceleration in space, towards the plane")]
    centre: Annotated[Vector, said("of the ellipsoid, from the centre of mass, in body axes")] = msgspec.field(
        default_factory=lambda: [0.0, 0.0, 0.0]
    )
    axes: Annotated[Vector, said("quaternion from the ellipsoid's axes to the body's")] = msgspec.field(
        default_factory=lambda: [1.0, 0.0, 0.0, 0.0]
    )


class FluidImpulseSection(Section, frozen=True, tag="fluid impulse", tag_field="effect"):
    """An ideal fluid with an impulse around the body."""

    impulse: Annotated[Vector, said("in space")]
    masses: Annotated[Vector, said("of the body with the fluid's, along its axes")]


class ChangingInertiaSection(Section, frozen=True, tag="changing inertia", tag_field="effect"):
    """Moments that change in time, straight between the rows of a table."""

    times: Annotated[Vector, said("rising")]
    moments: Annotated[list[list[float]], said("three at each time")]


EffectSection = (
    ConstantTorqueSection
    | LinearDragSection
    | QuadraticDragSection
    | DriveSection
    | RotorSection
    | GravitySection
    | PermanentDipoleSection
    | InducedDipoleSection
    | RollingSection
    | FluidImpulseSection
    | ChangingInertiaSection
)
_CLASSES = {
    "constant torque": ("torques", "ConstantTorque"),
    "linear drag": ("drag", "LinearDrag"),
    "quadratic drag": ("drag", "QuadraticDrag"),
    "periodic drive": ("drive", "PeriodicDrive"),
    "spinning rotor": ("gyrostat", "SpinningRotor"),
    "gravity about pivot": ("gravity", "GravityAboutPivot"),
    "permanent dipole": ("dipole_in_field", "PermanentDipole"),
    "induced dipole": ("dipole_in_field", "InducedDipole"),
    "rolling ellipsoid": ("rolling", "RollingEllipsoid"),
    "fluid impulse": ("ideal_fluid", "FluidImpulse"),
    "changing inertia": ("changing_inertia", "MomentsByTime"),
}  # by name, the module in `rotor.classical.effects` and the class


def effect_of(section: EffectSection) -> Any:
    """The effect that a table names.

    >>> effect_of(RotorSection(momentum=[0.0, 0.0, 0.7])).momentum.tolist()
    [0.0, 0.0, 0.7]
    """
    module, name = _CLASSES[str(section.__struct_config__.tag)]
    made = getattr(import_module(f"rotor.classical.effects.{module}"), name)
    return made(**msgspec.structs.asdict(section))


def section_of(effect: Any) -> EffectSection:
    """The table that names an effect: the way back from `effect_of`.

    >>> section_of(effect_of(RotorSection(momentum=[0.0, 0.0, 0.7])))
    RotorSection(momentum=[0.0, 0.0, 0.7])
    """
    place = type(effect).__module__.rpartition(".")[2], type(effect).__name__
    names = [name for name, found in _CLASSES.items() if found == place]
    if not names:
        raise ValueError(f"{effect!r}: a scene has no table of this effect; there are {', '.join(_CLASSES)}")
    kind = next(one for one in get_args(EffectSection) if one.__struct_config__.tag == names[0])
    made: EffectSection = kind(**{name: _numbers(effect, name) for name in kind.__struct_fields__})
    return made


def _numbers(effect: Any, name: str) -> Any:
    """A parameter of an effect in the types of a file; moments by time are its rows."""
    import numpy as np  # a scene alone loads no arrays

    value = getattr(effect, "rows" if name == "moments" else name)
    return np.asarray(value).tolist()
