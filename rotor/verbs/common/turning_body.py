"""Subject of `tumble`: a molecule, an everyday body or bare moments, with its initial motion, times and torques; their units."""

from __future__ import annotations

import math
import re
from contextlib import nullcontext
from dataclasses import replace
from difflib import get_close_matches
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rotor.checks import did_you_mean
from rotor.classical.effect import BODY_EFFECTS, DEFAULT_TOLERANCE
from rotor.frozen import dataclass
from rotor.requests.field import MOLECULE as MOLECULE_PANEL
from rotor.requests.field import all_fields, declared
from rotor.requests.fill import Entries, NamedError, naming, read_instance, within, written_fields
from rotor.requests.lists import Numbers
from rotor.requests.readers import Custom, Field, Grid, Quantity, Reader, Whole
from rotor.units import ASE_TIME_PS, HBAR_CLASSICAL
from rotor.verbs.common.subjects import MOLECULE, OneMolecule, saved_molecule
from rotor.verbs.common.verb import Place, Subject, Verb

if TYPE_CHECKING:
    from rotor.classical.bodies import NamedBody
    from rotor.classical.driven import DrivenRequest
    from rotor.classical.motion import Units
    from rotor.classical.tumble import Three, TumbleRequest

_UNIT_AT_END = re.compile(r"[A-Za-z][\w ²*^/]*$")


def three(raw: Any, unit: str = "") -> Three:
    """Three finite numbers; a text may carry a unit, else `unit` holds."""
    x, y, z = Numbers(unit, (3,), "0.6,0.8,1.0").read(raw)
    return x, y, z


def _moments(raw: Any) -> Three:
    from rotor.classical.euler import checked_moments

    moments = three(raw, "kg*m2" if in_si(raw) else "")
    with within(repr(raw)) if isinstance(raw, str) else nullcontext():
        checked_moments(moments)
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
    scene_type: Any = list[float] | str

    def write(self, value: Any) -> Any:
        """Text and a single number unchanged, several numbers as a list."""
        return value if isinstance(value, str | Real) else [float(number) for number in value]


@dataclass(frozen=True)
class BodyInput:
    """A rigid body instead of a molecule, in any coherent units."""

    body: NamedBody | None = declared(
        None, Custom(_named_body, lambda body: body.name, "NAME"), "Everyday body instead of a molecule: book, phone, racket or wing-nut",
        "body.name", option="--body", panel=MOLECULE_PANEL, common=True, example="book",
    )  # fmt: skip
    moments: Three | None = declared(
        None, Custom(_moments, list, "I1,I2,I3", list[float] | str),
        'Principal moments instead of a molecule, in any order: "1,2,3 kg m2", or plain numbers in any coherent units', "body.moments",
        panel=MOLECULE_PANEL, common=True, example=[0.3, 0.35, 0.4],
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
        None, Numbers("", (4,), "1,0,0,0", "W,X,Y,Z"), "With effects: unit quaternion, body to space, at time 0", "body.attitude",
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
        None, InBodyUnits("GRID"), "Times (ps for a molecule, s with SI units); by default two periods",
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
        "With effects: step of a splitting instead, where no torque depends on the angular velocity", "numerics.step",
        example=0.01,
    )  # fmt: skip
    order: int = declared(4, Whole(), "Order of the splitting: 2, 4, 6 or 8", "numerics.order")


BODY = {field.name: field for field in all_fields(BodyInput).values()}
MOTION = {field.name: field for field in all_fields(MotionInput).values()}


_HBAR_PER_U_ANGSTROM2_RAD_PER_PS = ASE_TIME_PS / HBAR_CLASSICAL  # angular momentum in ħ of 1 u Å² at 1 rad/ps
AT_REST = (1.0, 0.0, 0.0, 0.0)  # attitude: body and space axes coincide
TURN_RAD_PER_S = 2 * math.pi  # default of a named body: one turn a second


@dataclass(frozen=True)
class Body:
    """A rigid body that is not a molecule. moments: principal ones, in coherent or SI units.

    named: dimensions of an everyday body. start: default angular momentum, and how it was chosen.
    """

    text: str
    moments: Three
    units: Units
    axes: tuple[str, str, str] = ("1", "2", "3")
    named: NamedBody | None = None
    start: tuple[Three, str] | None = None


@dataclass(frozen=True)
class TurningBody(OneMolecule):
    """A molecule, an everyday body or bare moments."""

    further: type = BodyInput
    scene_fields: ClassVar[tuple[Field, ...]] = (
        replace(MOLECULE, default=None, example="water"),
    )  # a body may replace it

    def read(self, entries: Entries, place: Place, verb: Verb) -> Subject:
        """Read the molecule or the body, and how it moves."""
        body, motion = read_body(entries), read_instance(MotionInput, entries)
        if body is not None:
            return Subject(
                {"body": body}, (), body.text, place.note, further=(read_instance(BodyInput, entries), motion)
            )
        subject = super().read(entries, place, verb)
        return replace(subject, further=(subject.further, motion))

    def saved(self, request: Any, subject: Subject, folder: Path) -> dict[str, Any]:
        """The molecule or the body and its motion as entered; a scene has the momentum of a body in the table of the body."""
        start, motion = subject.further
        if subject.molecules:
            return saved_molecule(subject.molecules[0], folder) | written_fields(start) | written_fields(motion)
        body = subject.values["body"]
        if motion.angular_momentum is not None:
            start = replace(start, angular_momentum=motion.angular_momentum)
            motion = replace(motion, angular_momentum=None)
        units = "SI" if start.moments is not None and body.units.time else ""
        return written_fields(replace(start, body=body.named, units=units)) | written_fields(motion)


def read_body(entries: Entries) -> Body | None:
    """The body given by moments or by name; None for a molecule."""
    inputs, in_scene = read_instance(BodyInput, entries), entries.style == "key"
    source, constants = entries.values.get("molecule.source"), entries.values.get("molecule.constants")
    momenta = inputs.angular_momentum, entries.of(MOTION["angular_momentum"])
    if inputs.angular_velocity is not None and momenta != (None, None):
        raise NamedError("{angular_velocity} and {angular_momentum}: each fixes the motion; give one of them")
    if inputs.body is not None and inputs.moments is not None:
        raise NamedError("{body} and {moments}: give one of them")
    named = inputs.body or _named_source(source)
    if inputs.moments is None and named is None:
        if source is None and constants is None:
            raise NamedError(
                "molecule, body: give one of them"
                if in_scene
                else "expected a molecule, {constants}, {moments} or {body}; try 'rotor tumble water'"
            )
        return None
    if (source is not None and (named is None or inputs.body is not None)) or constants is not None:
        other = "moments" if named is None else "body"
        raise NamedError(f"{'molecule, body' if in_scene else f'a molecule and {{{other}}}'}: give one of them")
    if entries.values.get("molecule.isotopes"):
        raise NamedError("{isotopes}: bare moments have no atoms; give the moments of the isotopologue itself")
    if entries.has(MOTION["temperature_k"]):
        raise NamedError(
            "{temperature_k}: bare moments and bodies have no temperature; give {angular_momentum} or {angular_velocity}"
        )
    if in_scene and entries.has(MOTION["angular_momentum"]):
        raise NamedError("{angular_momentum}: is for a molecule; for a body give it in [body]")
    return _body_of_moments(entries, inputs) if named is None else _everyday_body(named)


def _named_source(source: Any) -> NamedBody | None:
    """The everyday body that a source names, unless it is a file; ValueError for a name with a slip."""
    from rotor.classical.bodies import BODIES

    if not isinstance(source, str) or Path(source).exists():
        return None
    name = source.replace("-", " ").casefold()
    if name not in BODIES and get_close_matches(name, BODIES, n=1, cutoff=0.8):
        raise ValueError(f"{source!r} is no file, no molecule and no body{did_you_mean(name, BODIES)}")
    return BODIES.get(name)


def _body_of_moments(entries: Entries, inputs: BodyInput) -> Body:
    from rotor.classical.motion import COHERENT, SI

    assert inputs.moments is not None
    typed = entries.of(BODY["moments"])
    text = typed if isinstance(typed, str) else ",".join(f"{moment:g}" for moment in inputs.moments)
    return Body(text, inputs.moments, SI if inputs.units == "SI" or in_si(typed) else COHERENT)


def _everyday_body(body: NamedBody) -> Body:
    """An everyday body in SI units; its default motion is one turn a second about the intermediate, unstable axis."""
    from rotor.classical.gas.thermal_momentum import off_intermediate_axis
    from rotor.classical.motion import SI
    from rotor.thermodynamics.gas.thermal_tumble import TILT_DEGREES

    moments = np.array(body.moments_kg_m2)
    size = TURN_RAD_PER_S * float(np.sort(moments)[1])
    momentum = three(off_intermediate_axis(moments, size, math.radians(TILT_DEGREES)))
    middle = body.axes[int(np.argsort(moments)[1])]
    source = f"one turn a second, {TILT_DEGREES:g} degrees off the intermediate axis, {middle}"
    return Body(body.name, three(moments), SI, body.axes, body, (momentum, source))


def build(verb: Verb, entries: Entries, subject: Subject) -> TumbleRequest | DrivenRequest:
    """The request for a molecule or a body: free motion, or motion under effects."""
    start, motion = subject.further
    in_scene, is_body = entries.style == "key", "body" in subject.values
    if in_scene and start.angular_momentum is not None:
        motion = replace(motion, angular_momentum=start.angular_momentum)
    momentum = (BODY if in_scene and is_body else MOTION)["angular_momentum"]
    with naming([*BODY.values(), momentum], entries.style):
        if motion.effects:
            return _driven(entries, subject, start, motion)
        _refuse_without_effect(entries)
        make = _motion_of_body if is_body else _motion_of_top
        return make(entries, subject, start, motion)


def _refuse_without_effect(entries: Entries) -> None:
    """Refuse settings of integration for a free motion; scenes may hold settings that are not used."""
    of_steps = () if entries.style == "key" else ("tolerance", "step", "order")
    for field in (BODY["attitude"], *(MOTION[name] for name in of_steps)):
        if entries.has(field):
            raise NamedError(
                f"{{{field.name}}}: belongs to a motion under effects; give {{effects}}, or leave it out: free motion is exact"
            )


def _times(entries: Entries, motion: MotionInput, unit: str) -> tuple[float, ...] | None:
    """Times in the unit of the body."""
    field = replace(MOTION["times"], reader=Grid(unit))
    return None if motion.times is None else field.read(motion.times, entries.style)


def _motion_of_body(entries: Entries, subject: Subject, start: BodyInput, motion: MotionInput) -> TumbleRequest:
    from rotor.classical.tumble import TumbleRequest

    body: Body = subject.values["body"]
    chosen = _start(entries, start, motion, np.array(body.moments), (body.units.rate, "")) or body.start
    if chosen is None:
        raise NamedError(
            "body: give either {body.angular_momentum} or {angular_velocity}"
            if entries.style == "key"
            else "{angular_momentum}: expected with {moments}: three components in the axes of the moments; or {angular_velocity}"
        )
    times = _times(entries, motion, body.units.time)
    request = TumbleRequest(body.moments, chosen[0], times, body.units, body.axes, chosen[1], body.named)
    for text in request.notes:
        subject.note(text)
    return request


def _motion_of_top(entries: Entries, subject: Subject, start: BodyInput, motion: MotionInput) -> TumbleRequest:
    from rotor.thermodynamics.gas.thermal_tumble import thermal_tumble

    top, times = subject.top, _times(entries, motion, "ps")
    by_velocity = start.angular_velocity is not None
    scale = _HBAR_PER_U_ANGSTROM2_RAD_PER_PS if by_velocity else 1.0  # ħ for 1 rad/ps
    chosen = _start(entries, start, motion, scale * np.array(top.moments_u_angstrom2), ("rad/ps", "ħ"))
    if chosen is None:
        return thermal_tumble(top, temperature_k=motion.temperature_k, times_ps=times)
    if entries.has(MOTION["temperature_k"]):
        fixed = "angular_velocity" if by_velocity else "angular_momentum"
        raise NamedError(
            f"{{temperature_k}} and {{{fixed}}}: give one of them; the first chooses |L|, the second fixes it"
        )
    return replace(thermal_tumble(top, angular_momentum_hbar=chosen[0], times_ps=times), source=chosen[1])


def _entered(
    entries: Entries, start: BodyInput, motion: MotionInput, units: tuple[str, str]
) -> tuple[Field, Any, Three] | None:
    """The angular velocity or momentum at time 0: its field, as entered, and as numbers; None without. units: of both."""
    field, value, unit = BODY["angular_velocity"], start.angular_velocity, units[0]
    if value is None:
        in_body = BODY if start.angular_momentum is not None else MOTION  # the key of a scene's body
        field, value, unit = in_body["angular_momentum"], motion.angular_momentum, units[1]
    if value is None:
        return None
    typed = value if isinstance(value, str) else list(value)
    return field, typed, replace(field, reader=Custom(lambda raw: three(raw, unit))).read(typed, entries.style)


def _start(
    entries: Entries, start: BodyInput, motion: MotionInput, moments: Any, units: tuple[str, str]
) -> tuple[Three, str] | None:
    """The nonzero initial angular momentum, entered directly or as an angular velocity, and its source; None if neither is given.

    units: of the angular velocity and of the angular momentum.
    """
    from rotor.classical.euler import checked_momentum, checked_velocity

    entered = _entered(entries, start, motion, units)
    if entered is None:
        return None
    field, typed, vector = entered
    called, by_velocity = field.called(entries.style), start.angular_velocity is not None
    with within(f"{called}: {typed!r}"):
        momentum = moments * checked_velocity(vector, moments) if by_velocity else checked_momentum(vector, moments)
        if not momentum.any():
            raise ValueError("a body at rest does not tumble; give a component that is not 0")
    return three(momentum), f"{'given as an angular velocity' if by_velocity else 'given'} ({called})"


def _driven(entries: Entries, subject: Subject, start: BodyInput, motion: MotionInput) -> DrivenRequest:
    from rotor.classical.driven import DrivenRequest

    if "body" not in subject.values:
        raise NamedError("{effects}: acts on a body; give {moments} or {body} instead of a molecule")
    body: Body = subject.values["body"]
    if motion.times is None:
        raise NamedError("{times}: expected with {effects}, the start first: such as 0:10:101")
    step = None
    if motion.step is not None:
        step = replace(MOTION["step"], reader=Quantity(body.units.time, above=0)).read(motion.step, entries.style)
    if entries.has(MOTION["order"]) and step is None and entries.style != "key":
        raise NamedError("{order}: belongs to a splitting; give {step} too")
    entered = _entered(entries, start, motion, (body.units.rate, ""))
    if entered is None and body.start is None:
        raise NamedError(
            "{angular_velocity}: expected with {moments}, the angular velocity at the first time; or {angular_momentum}"
        )
    by_velocity = start.angular_velocity is not None
    vector = entered[2] if entered is not None else body.start and body.start[0]
    return DrivenRequest(
        body.moments, _times(entries, motion, body.units.time) or (), motion.effects,
        vector if by_velocity else None, None if by_velocity else vector,
        start.attitude or AT_REST, motion.tolerance, step, motion.order, body.units, body.axes, body.named,
    )  # fmt: skip
