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
    from rotor.classical.tumble import Three, TumbleRequest
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


def read_start(given: Input, options: Options) -> Start:
    """The body and its angular momentum that the options mean; notes go to standard error."""
    if options.omega is not None and options.angular_momentum is not None:
        raise ValueError("--omega and --angular-momentum: each fixes the motion; give one of them")
    if options.body is not None and options.moments is not None:
        raise ValueError("--body and --moments: give one of them")
    body = _named_body(given, options)
    if options.moments is None and body is None:
        if given.source is None and given.constants is None:
            raise ValueError("expected a molecule, --constants, --moments or --body; try 'rotor tumble water'")
        return _molecule(given, options)
    what = "--moments" if body is None else "--body"
    if (given.source is not None and (body is None or options.body is not None)) or given.constants is not None:
        raise ValueError(f"a molecule and {what}: give one of them")
    if given.isotope:
        raise ValueError("--isotope: bare moments have no atoms; give the moments of the isotopologue itself")
    if options.temperature is not None:
        raise ValueError("--temperature: bare moments have no units for a temperature; give --angular-momentum alone")
    return _bare_body(options) if body is None else _ordinary_body(body, options)


def _named_body(given: Input, options: Options) -> NamedBody | None:
    """The body of --body; or of a source that is the name of one, and no file."""
    from rotor.classical.bodies import BODIES, named_body

    if options.body is not None:
        return inputs.parsed("--body", options.body, named_body)
    if given.source is None or Path(given.source).exists():
        return None
    return BODIES.get(given.source.replace("-", " "))


def _ordinary_body(body: NamedBody, options: Options) -> Start:
    """An ordinary body in SI units: as it is spun, or one turn a second about the axis that it cannot keep."""
    import numpy as np

    from rotor.classical.gas.thermal_momentum import off_intermediate_axis
    from rotor.classical.tumble import SI, TumbleRequest
    from rotor.thermo.thermal_tumble import TILT_DEGREES

    moments = np.array(body.moments_kg_m2)
    if options.omega is not None or options.angular_momentum is not None:
        momentum, source = _start_of(options, moments, "rad/s")
    else:
        size = TURN_RAD_PER_S * float(np.sort(moments)[1])
        momentum = _tuple(off_intermediate_axis(moments, size, math.radians(TILT_DEGREES)))
        middle = body.axes[int(np.argsort(moments)[1])]
        source = f"one turn a second, {TILT_DEGREES:g} degrees off the intermediate axis, {middle}"
    times = inputs.times("--times", options.times, "s")
    return Start(body.name, TumbleRequest(_tuple(moments), momentum, times, SI, body.axes, source), body=body)


def _start_of(options: Options, moments: Floats, unit: str) -> tuple[Three, str]:
    """The angular momentum in the units of the moments, from an angular velocity in `unit` or as it is given."""
    if options.omega is None:
        return _momentum(options.angular_momentum or "", moments), GIVEN

    def parse(text: str) -> Three:
        from rotor.classical.euler import checked_momentum

        momentum = _checked(text, lambda omega: checked_momentum(moments * omega, moments), unit)
        if not momentum.any():
            raise ValueError(f"{text!r}: a body at rest does not tumble; give a component that is not 0")
        return _tuple(momentum)

    return inputs.parsed("--omega", options.omega, parse), SPUN


def _bare_body(options: Options) -> Start:
    from rotor.classical.euler import checked_moments
    from rotor.classical.tumble import COHERENT, SI, TumbleRequest

    si = bool(_UNIT_AT_END.search(options.moments or ""))
    unit = "kg*m2" if si else ""
    moments = inputs.parsed("--moments", options.moments or "", lambda text: _checked(text, checked_moments, unit))
    if options.angular_momentum is None and options.omega is None:
        raise ValueError(
            "--angular-momentum: expected with --moments: three components in the axes of the moments; or --omega"
        )
    momentum, source = _start_of(options, moments, "rad/s" if si else "")
    times = inputs.times("--times", options.times, "s" if si else "")
    request = TumbleRequest(_tuple(moments), momentum, times, SI if si else COHERENT, source=source)
    for text in request.notes:
        note(text)
    return Start(options.moments or "", request)


def _molecule(given: Input, options: Options) -> Start:
    from rotor.thermo.thermal_tumble import TEMPERATURE_K, thermal_tumble

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
        momentum = _checked(value, lambda three: checked_momentum(three, moments))
        if not momentum.any():
            raise ValueError(f"{value!r}: a body at rest does not tumble; give a component that is not 0")
        return _tuple(momentum)

    return inputs.parsed("--angular-momentum", text, parse)


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
