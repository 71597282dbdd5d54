"""From the options of `rotor tumble` to a body, its angular momentum and times: a `TumbleRequest`."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import Input
from rotor.cli.shared.options import option
from rotor.cli.shared.output import note
from rotor.units import ASE_TIME_PS, HBAR_CLASSICAL

if TYPE_CHECKING:
    from rotor.arrays import Floats
    from rotor.classical.bodies import NamedBody
    from rotor.classical.tumble import Three, TumbleRequest, Units
    from rotor.plots.animation import Atoms
    from rotor.tops.top import Top

GIVEN = "given (--angular-momentum)"
SPUN = "given as an angular velocity (--omega)"
_UNITS_OF_MOLECULES = ASE_TIME_PS / HBAR_CLASSICAL  # angular momentum in ħ of 1 u Å² at 1 rad/ps
_UNIT_AT_END = re.compile(r"[A-Za-z][\w ²*^/]*$")
TURN_RAD_PER_S = 2 * math.pi  # of a named body that is given no motion: one turn a second


@dataclass(frozen=True)
class Options:
    """The body and how it starts."""

    body: str | None = option(
        None, metavar="NAME", help="An ordinary body instead of a molecule: book, phone, racket or wing-nut."
    )
    moments: str | None = option(
        None,
        metavar="I1,I2,I3",
        help='Principal moments instead of a molecule, in any order: "1,2,3 kg m2", or plain numbers of any coherent units.',
    )
    omega: str | None = option(
        None,
        metavar="W1,W2,W3",
        help="Angular velocity at time 0, in principal axes, such as 0.1,10,0 (rad/s; rad/ps for a molecule; also rpm, deg/s).",
    )
    angular_momentum: str | None = option(
        None, metavar="L1,L2,L3", help="At time 0, in principal axes (ħ for a molecule; by default the thermal mean)."
    )
    temperature: str | None = option(
        None, metavar="T", help="Of the thermal mean of |L| of a molecule (K; by default 300)."
    )
    times: str | None = option(
        None,
        metavar="GRID",
        help="start:stop:count or a comma list (ps for a molecule, s with SI units); by default two periods.",
    )


@dataclass(frozen=True)
class Start:
    """A body and how it starts. text: what was given. temperature_k: of the thermal mean, if it is one. top: of a molecule.

    body: what an ordinary body consists of.
    """

    text: str
    request: TumbleRequest
    temperature_k: float | None = None
    top: Top | None = None
    body: NamedBody | None = None

    @property
    def notes(self) -> Sequence[str]:
        """Notes of the molecule, else what is unusual about the body."""
        return self.top.notes if self.top is not None else self.request.notes

    @property
    def atoms(self) -> Atoms | None:
        """The atoms in the principal frame, where there is a geometry."""
        if self.top is None or self.top.molecule is None or self.top.frame is None:
            return None
        from rotor.plots.animation import Atoms

        molecule, frame = self.top.molecule, self.top.frame
        return Atoms((molecule.positions_angstrom - frame.centre) @ frame.axes.T, molecule.symbols)


@dataclass(frozen=True)
class Body:
    """A rigid body that is no molecule. text: what was given. moments: principal ones, in coherent or SI units.

    named: what an ordinary body consists of. start: its angular momentum where none is given, and how that was chosen.
    """

    text: str
    moments: Three
    units: Units
    axes: tuple[str, str, str] = ("1", "2", "3")
    named: NamedBody | None = None
    start: tuple[Three, str] | None = None

    @property
    def rate_unit(self) -> str:
        """Of angular velocities; empty: of any coherent set."""
        return f"rad/{self.units.time}" if self.units.time else ""


def read_start(given: Input, options: Options) -> Start:
    """The body and its angular momentum that the options mean; notes go to standard error."""
    body = read_body(given, options)
    return _molecule(given, options) if body is None else _turning(body, options)


def read_body(given: Input, options: Options) -> Body | None:
    """The body of --moments or --body, or of a source that is the name of one; None for a molecule."""
    if options.omega is not None and options.angular_momentum is not None:
        raise ValueError("--omega and --angular-momentum: each fixes the motion; give one of them")
    if options.body is not None and options.moments is not None:
        raise ValueError("--body and --moments: give one of them")
    body = _named_body(given, options)
    if options.moments is None and body is None:
        if given.source is None and given.constants is None:
            raise ValueError("expected a molecule, --constants, --moments or --body; try 'rotor tumble water'")
        return None
    what = "--moments" if body is None else "--body"
    if (given.source is not None and (body is None or options.body is not None)) or given.constants is not None:
        raise ValueError(f"a molecule and {what}: give one of them")
    if given.isotope:
        raise ValueError("--isotope: bare moments have no atoms; give the moments of the isotopologue itself")
    if options.temperature is not None:
        raise ValueError("--temperature: bare moments have no units for a temperature; give --angular-momentum alone")
    return _of_moments(options.moments or "") if body is None else _ordinary_body(body)


def _named_body(given: Input, options: Options) -> NamedBody | None:
    """The body of --body; or of a source that is the name of one, and no file."""
    from rotor.classical.bodies import BODIES, named_body

    if options.body is not None:
        return inputs.parsed("--body", options.body, named_body)
    if given.source is None or Path(given.source).exists():
        return None
    return BODIES.get(given.source.replace("-", " "))


def _ordinary_body(body: NamedBody) -> Body:
    """An ordinary body in SI units: unless it is spun, one turn a second about the axis that it cannot keep."""
    import numpy as np

    from rotor.classical.gas.thermal_momentum import off_intermediate_axis
    from rotor.classical.tumble import SI
    from rotor.thermodynamics.thermal_tumble import TILT_DEGREES

    moments = np.array(body.moments_kg_m2)
    size = TURN_RAD_PER_S * float(np.sort(moments)[1])
    momentum = _tuple(off_intermediate_axis(moments, size, math.radians(TILT_DEGREES)))
    middle = body.axes[int(np.argsort(moments)[1])]
    source = f"one turn a second, {TILT_DEGREES:g} degrees off the intermediate axis, {middle}"
    return Body(body.name, _tuple(moments), SI, body.axes, body, (momentum, source))


def _of_moments(text: str) -> Body:
    from rotor.classical.euler import checked_moments
    from rotor.classical.tumble import COHERENT, SI

    si = bool(_UNIT_AT_END.search(text))
    moments = inputs.parsed("--moments", text, lambda one: _checked(one, checked_moments, "kg*m2" if si else ""))
    return Body(text, _tuple(moments), SI if si else COHERENT)


def _turning(body: Body, options: Options) -> Start:
    """A body that turns freely."""
    import numpy as np

    from rotor.classical.tumble import TumbleRequest

    if options.omega is not None or options.angular_momentum is not None:
        momentum, source = _start_of(options, np.array(body.moments), body.rate_unit)
    elif body.start is not None:
        momentum, source = body.start
    else:
        raise ValueError(
            "--angular-momentum: expected with --moments: three components in the axes of the moments; or --omega"
        )
    times = inputs.times("--times", options.times, body.units.time)
    request = TumbleRequest(body.moments, momentum, times, body.units, body.axes, source)
    if body.named is None:
        for text in request.notes:
            note(text)
    return Start(body.text, request, body=body.named)


def _start_of(options: Options, moments: Floats, unit: str) -> tuple[Three, str]:
    """The angular momentum in the units of the moments, from an angular velocity in `unit` or as it is given."""
    if options.omega is None:
        return _momentum(options.angular_momentum or "", moments), GIVEN

    def parse(text: str) -> Three:
        """The angular momentum of an angular velocity other than 0."""
        from rotor.classical.euler import checked_momentum

        momentum = _checked(text, lambda omega: checked_momentum(moments * omega, moments), unit)
        if not momentum.any():
            raise ValueError(f"{text!r}: a body at rest does not tumble; give a component that is not 0")
        return _tuple(momentum)

    return inputs.parsed("--omega", options.omega, parse), SPUN


def _molecule(given: Input, options: Options) -> Start:
    from rotor.thermodynamics.thermal_tumble import TEMPERATURE_K, thermal_tumble

    fixed = "--omega" if options.omega is not None else "--angular-momentum"
    if options.temperature is not None and (options.angular_momentum or options.omega) is not None:
        raise ValueError(f"--temperature and {fixed}: give one of them; the first chooses |L|, the second fixes it")
    kelvin = (
        TEMPERATURE_K if options.temperature is None else inputs.positive("--temperature", options.temperature, "K")
    )
    times = inputs.times("--times", options.times, "ps")
    import numpy as np

    top = inputs.read_top(given)
    if options.omega is not None:
        hbar_ps = _UNITS_OF_MOLECULES * np.array(top.moments_u_angstrom2)  # ħ for 1 rad/ps
        momentum, source = _start_of(options, hbar_ps, "rad/ps")
        request = thermal_tumble(top, angular_momentum_hbar=momentum, times_ps=times)
        return Start(given.text, replace(request, source=source), None, top)
    if options.angular_momentum is None:
        return Start(given.text, thermal_tumble(top, temperature_k=kelvin, times_ps=times), kelvin, top)
    momentum = _momentum(options.angular_momentum, np.array(top.moments_u_angstrom2))
    request = thermal_tumble(top, angular_momentum_hbar=momentum, times_ps=times)
    return Start(given.text, replace(request, source=GIVEN), None, top)


def _momentum(text: str, moments: Floats) -> Three:
    from rotor.classical.euler import checked_momentum

    def parse(value: str) -> Three:
        """An angular momentum other than 0."""
        momentum = _checked(value, lambda three: checked_momentum(three, moments))
        if not momentum.any():
            raise ValueError(f"{value!r}: a body at rest does not tumble; give a component that is not 0")
        return _tuple(momentum)

    return inputs.parsed("--angular-momentum", text, parse)


def read_vector(text: str, unit: str) -> Three:
    """Three finite numbers, in a unit of their own or in `unit`."""
    return _tuple(_three(text, unit))


def _checked(text: str, check: Callable[[Any], Floats], unit: str = "") -> Floats:
    """Three numbers, checked; the message of a mistake begins with the text that was read."""
    try:
        return check(_three(text, unit))
    except ValueError as error:
        message = str(error)
        raise ValueError(message if message.startswith(repr(text)) else f"{text!r}: {message}") from None


def _three(text: str, unit: str) -> Floats:
    import numpy as np

    from rotor.units import parse_grid

    if text.count(",") != 2 or ":" in text:
        raise ValueError(f"{text!r}: expected three numbers, such as 0.6,0.8,1.0")
    return np.asarray(parse_grid(text, unit))


def _tuple(vector: Floats) -> Three:
    x, y, z = vector.tolist()
    return x, y, z
