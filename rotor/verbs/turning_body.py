"""Subject of `tumble`: a molecule, an everyday body or bare moments, and its initial motion."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.requests.fill import Entries, read_instance, renaming, written_fields
from rotor.requests.readers import Custom, Grid, Quantity
from rotor.units import ASE_TIME_PS, HBAR_CLASSICAL
from rotor.verbs.body_inputs import BODY, MOTION, BodyInput, MotionInput, in_si, three
from rotor.verbs.molecule import FIELDS, Reading, read_molecule, top_of
from rotor.verbs.subjects import OneMolecule, optional_molecule, saved_molecule
from rotor.verbs.verb import Place, Subject

if TYPE_CHECKING:
    from rotor.classical.bodies import NamedBody
    from rotor.classical.driven import DrivenRequest
    from rotor.classical.tumble import Three, TumbleRequest, Units
    from rotor.verbs.verb import Verb

_HBAR_PER_U_ANGSTROM2_RAD_PER_PS = ASE_TIME_PS / HBAR_CLASSICAL  # angular momentum in ħ of 1 u Å² at 1 rad/ps
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

    @property
    def rate_unit(self) -> str:
        """Unit of angular velocities; empty for coherent units without names."""
        return f"rad/{self.units.time}" if self.units.time else ""


@dataclass(frozen=True)
class TurningBody(OneMolecule):
    """A molecule, an everyday body or bare moments."""

    further: type = BodyInput

    def scene_fields(self) -> list[tuple[str, Any, Any]]:
        """The key `molecule`; a body may replace it."""
        return [optional_molecule("a name, a file, SMILES:..., or a table")]

    def read(self, entries: Entries, place: Place, verb: Verb) -> Subject:
        """Read the molecule or the body."""
        molecule = read_molecule(entries)
        body = read_body(entries)
        if body is None:
            top = top_of(Reading(molecule, entries.style, place.folder, place.note))
            return Subject({"top": top}, (molecule,), str(molecule.source or molecule.constants), place.note)
        return Subject({"body": body}, (), body.text, place.note)

    def saved(self, request: TumbleRequest | DrivenRequest, subject: Subject, folder: Path) -> dict[str, Any]:
        """The molecule or the body, and its initial motion."""
        times = None if request.times is None else [float(time) for time in request.times]
        content = {} if times is None else {"conditions.times": times}
        if subject.molecules:
            kelvin = getattr(request, "temperature_k", None)
            start = (
                {"conditions.angular_momentum": list(request.angular_momentum or ())}
                if kelvin is None
                else written_fields(MotionInput(temperature_k=kelvin))
            )
            return saved_molecule(subject.molecules[0], folder) | content | start
        units = "SI" if request.units.time else ""
        effects = getattr(request, "effects", None)
        spin = getattr(request, "angular_velocity", None)
        attitude = getattr(request, "attitude", None)
        body = BodyInput(
            moments=request.moments, units=units, angular_momentum=request.angular_momentum, angular_velocity=spin,
            attitude=None if attitude == (1.0, 0.0, 0.0, 0.0) else attitude,
        )  # fmt: skip
        content = written_fields(body) | content
        if effects is None:
            return content
        driven: Any = request
        motion = MotionInput(effects=effects, tolerance=driven.tolerance, step=driven.step, order=driven.order)
        return content | written_fields(motion)


def read_body(entries: Entries) -> Body | None:
    """The body given by moments or by name; None for a molecule."""
    inputs = read_instance(BodyInput, entries)
    called = {
        name: field.called(entries.style)
        for name, field in (BODY | {k: MOTION[k] for k in ("temperature_k", "effects")}).items()
    }
    momentum = MOTION["angular_momentum"].called(entries.style)
    if inputs.angular_velocity is not None and _momentum(entries, inputs) is not None:
        raise ValueError(f"{called['angular_velocity']} and {momentum}: each fixes the motion; give one of them")
    if inputs.body is not None and inputs.moments is not None:
        raise ValueError(f"{called['body']} and {called['moments']}: give one of them")
    source, constants = entries.values.get("molecule.source"), entries.values.get("molecule.constants")
    named = inputs.body or _named_source(source)
    if inputs.moments is None and named is None:
        if source is None and constants is None:
            if entries.style == "key":
                raise ValueError("molecule, body: give one of them")
            words = (
                "a molecule, --constants, --moments or --body"
                if entries.style == "option"
                else "a molecule, moments or body"
            )
            raise ValueError(f"expected {words}; try 'rotor tumble water'")
        return None
    if (source is not None and (named is None or inputs.body is not None)) or constants is not None:
        raise ValueError(
            "molecule, body: give one of them"
            if entries.style == "key"
            else f"a molecule and {called['moments' if named is None else 'body']}: give one of them"
        )
    if entries.values.get("molecule.isotopes"):
        isotopes = FIELDS["isotopes"].called(entries.style)
        raise ValueError(f"{isotopes}: bare moments have no atoms; give the moments of the isotopologue itself")
    if entries.has(MOTION["temperature_k"]):
        raise ValueError(
            f"{called['temperature_k']}: bare moments have no units for a temperature; give {momentum} alone"
        )
    if entries.style == "key" and entries.has(MOTION["angular_momentum"]):
        raise ValueError(f"{momentum}: is for a molecule; for a body give it in [body]")
    return _body_of_moments(entries, inputs) if named is None else _everyday_body(named)


def _momentum(entries: Entries, inputs: BodyInput) -> Any:
    """The angular momentum as entered, of a body or a molecule."""
    return inputs.angular_momentum if inputs.angular_momentum is not None else entries.of(MOTION["angular_momentum"])


def _named_source(source: Any) -> NamedBody | None:
    """The everyday body that a source names, unless it is a file."""
    from rotor.classical.bodies import BODIES

    return BODIES.get(source.replace("-", " ")) if isinstance(source, str) and not Path(source).exists() else None


def _body_of_moments(entries: Entries, inputs: BodyInput) -> Body:
    from rotor.classical.tumble import COHERENT, SI

    assert inputs.moments is not None
    typed = entries.of(BODY["moments"])
    text = typed if isinstance(typed, str) else ",".join(f"{moment:g}" for moment in inputs.moments)
    return Body(text, inputs.moments, SI if inputs.units == "SI" or in_si(typed) else COHERENT)


def _everyday_body(body: NamedBody) -> Body:
    """An everyday body in SI units; its default motion is one turn a second about the intermediate, unstable axis."""
    import numpy as np

    from rotor.classical.gas.thermal_momentum import off_intermediate_axis
    from rotor.classical.tumble import SI
    from rotor.thermodynamics.thermal_tumble import TILT_DEGREES

    moments = np.array(body.moments_kg_m2)
    size = TURN_RAD_PER_S * float(np.sort(moments)[1])
    momentum = three(off_intermediate_axis(moments, size, math.radians(TILT_DEGREES)))
    middle = body.axes[int(np.argsort(moments)[1])]
    source = f"one turn a second, {TILT_DEGREES:g} degrees off the intermediate axis, {middle}"
    return Body(body.name, three(moments), SI, body.axes, body, (momentum, source))


def build(verb: Verb, entries: Entries, subject: Subject) -> TumbleRequest | DrivenRequest:
    """The request for a molecule or a body: free motion, or motion under effects."""
    motion = read_instance(MotionInput, entries)
    start = read_instance(BodyInput, entries)
    if entries.style == "key" and start.angular_momentum is not None:
        motion = replace(motion, angular_momentum=start.angular_momentum)
    momentum = (BODY if entries.style == "key" and "body" in subject.values else MOTION)["angular_momentum"]
    names = {name: BODY[name].called(entries.style) for name in ("moments", "angular_velocity", "attitude")}
    with renaming(names | {"angular_momentum": momentum.called(entries.style)}):
        if motion.effects:
            return _driven(entries, subject, start, motion)
        _refuse_without_effect(entries)
        return (
            _motion_of_body(entries, subject, start, motion)
            if "body" in subject.values
            else _motion_of_top(entries, subject, start, motion)
        )


def _refuse_without_effect(entries: Entries) -> None:
    """Refuse settings of integration for a free motion; scenes may hold settings that are not used."""
    for field in (
        BODY["attitude"],
        *(MOTION[name] for name in ("tolerance", "step", "order") if entries.style != "key"),
    ):
        if entries.has(field):
            raise ValueError(
                f"{field.called(entries.style)}: belongs to a motion under effects; give {MOTION['effects'].called(entries.style)}, or "
                "leave it out: free motion is exact"
            )


def _times(entries: Entries, motion: MotionInput, unit: str) -> tuple[float, ...] | None:
    """Times in the unit of the body."""
    return (
        None if motion.times is None else replace(MOTION["times"], reader=Grid(unit)).read(motion.times, entries.style)
    )


def _motion_of_body(entries: Entries, subject: Subject, start: BodyInput, motion: MotionInput) -> TumbleRequest:
    import numpy as np

    from rotor.classical.tumble import TumbleRequest

    body: Body = subject.values["body"]
    chosen = _start(entries, start, motion, np.array(body.moments), body.rate_unit) or body.start
    if chosen is None:
        if entries.style == "key":
            raise ValueError("body: give either angular_momentum or angular_velocity")
        names = [
            field.called(entries.style)
            for field in (MOTION["angular_momentum"], BODY["moments"], BODY["angular_velocity"])
        ]
        raise ValueError(
            f"{names[0]}: expected with {names[1]}: three components in the axes of the moments; or {names[2]}"
        )
    times = _times(entries, motion, body.units.time)
    request = TumbleRequest(body.moments, chosen[0], times, body.units, body.axes, chosen[1], body.named)
    for text in request.notes:
        subject.note(text)
    return request


def _motion_of_top(entries: Entries, subject: Subject, start: BodyInput, motion: MotionInput) -> TumbleRequest:
    import numpy as np

    from rotor.thermodynamics.thermal_tumble import thermal_tumble

    top, times = subject.top, _times(entries, motion, "ps")
    in_hbar = start.angular_velocity is not None
    scale = _HBAR_PER_U_ANGSTROM2_RAD_PER_PS if in_hbar else 1.0  # ħ for 1 rad/ps
    chosen = _start(entries, start, motion, scale * np.array(top.moments_u_angstrom2), "rad/ps", "ħ")
    if chosen is None:
        return thermal_tumble(top, temperature_k=motion.temperature_k, times_ps=times)
    if entries.has(MOTION["temperature_k"]):
        fixed = (BODY["angular_velocity"] if in_hbar else MOTION["angular_momentum"]).called(entries.style)
        raise ValueError(
            f"{MOTION['temperature_k'].called(entries.style)} and {fixed}: give one of them; the first chooses |L|, the second fixes it"
        )
    return replace(thermal_tumble(top, angular_momentum_hbar=chosen[0], times_ps=times), source=chosen[1])


def _start(
    entries: Entries, start: BodyInput, motion: MotionInput, moments: Any, unit: str, momentum_unit: str = ""
) -> tuple[Three, str] | None:
    """The initial angular momentum, entered directly or as an angular velocity, and its source; None if neither is given."""
    if start.angular_velocity is not None:
        name = BODY["angular_velocity"].called(entries.style)
        return _momentum_of(start.angular_velocity, moments, unit, moments), f"given as an angular velocity ({name})"
    if motion.angular_momentum is None:
        return None
    name = MOTION["angular_momentum"].called(entries.style)
    return _momentum_of(motion.angular_momentum, moments, momentum_unit, None), f"given ({name})"


def _momentum_of(value: Any, moments: Any, unit: str, factors: Any) -> Three:
    """A nonzero angular momentum from an angular velocity (by `factors`, the moments) or as entered."""
    from rotor.classical.euler import checked_momentum

    name = "angular_momentum" if factors is None else "angular_velocity"
    text = value if isinstance(value, str) else list(value)
    try:
        vector = three(value, unit)
        momentum = checked_momentum(vector if factors is None else factors * vector, moments)
    except ValueError as error:
        message = str(error)
        raise ValueError(
            f"{name}: " + (message if message.startswith(f"{text!r}") else f"{text!r}: {message}")
        ) from None
    if not momentum.any():
        raise ValueError(f"{name}: {text!r}: a body at rest does not tumble; give a component that is not 0")
    return three(momentum)


def _driven(entries: Entries, subject: Subject, start: BodyInput, motion: MotionInput) -> DrivenRequest:
    from rotor.classical.driven import DrivenRequest

    effects, times = MOTION["effects"].called(entries.style), MOTION["times"].called(entries.style)
    if "body" not in subject.values:
        names = [BODY[name].called(entries.style) for name in ("moments", "body")]
        raise ValueError(f"{effects}: acts on a body; give {names[0]} or {names[1]} instead of a molecule")
    body: Body = subject.values["body"]
    if motion.times is None:
        raise ValueError(f"{times}: expected with {effects}, the start first: such as 0:10:101")
    step = None
    if motion.step is not None:
        step = replace(MOTION["step"], reader=Quantity(body.units.time, above=0)).read(motion.step, entries.style)
    if entries.has(MOTION["order"]) and step is None and entries.style != "key":
        names = [MOTION[name].called(entries.style) for name in ("order", "step")]
        raise ValueError(f"{names[0]}: belongs to a splitting; give {names[1]} too")
    spin, momentum = _spin_or_momentum(entries, body, start, motion)
    return DrivenRequest(
        body.moments, _times(entries, motion, body.units.time) or (), motion.effects, spin, momentum,
        start.attitude or (1.0, 0.0, 0.0, 0.0), motion.tolerance, step, motion.order, body.units, body.axes, body.named,
    )  # fmt: skip


def _spin_or_momentum(
    entries: Entries, body: Body, start: BodyInput, motion: MotionInput
) -> tuple[Three | None, Three | None]:
    """Initial ω or L; a named body has the default of its free motion."""
    if start.angular_velocity is not None:
        return replace(BODY["angular_velocity"], reader=Custom(lambda typed: three(typed, body.rate_unit))).read(
            start.angular_velocity, entries.style
        ), None
    if motion.angular_momentum is not None:
        return None, replace(MOTION["angular_momentum"], reader=Custom(three)).read(
            motion.angular_momentum, entries.style
        )
    if body.start is None:
        names = [
            field.called(entries.style)
            for field in (BODY["angular_velocity"], BODY["moments"], MOTION["angular_momentum"])
        ]
        raise ValueError(f"{names[0]}: expected with {names[1]}, the angular velocity at the first time; or {names[2]}")
    return None, body.start[0]
