"""From the options of `rotor tumble` to a body, its angular momentum and times: a `TumbleRequest`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import Input
from rotor.cli.shared.options import option
from rotor.cli.shared.output import note

if TYPE_CHECKING:
    from rotor.arrays import Floats
    from rotor.classical.tumble import Three, TumbleRequest
    from rotor.plots.animation import Atoms
    from rotor.tops.top import Top

GIVEN = "given (--angular-momentum)"


@dataclass(frozen=True)
class Options:
    """The body and how it starts."""

    moments: str | None = option(
        None, metavar="I1,I2,I3", help="Principal moments instead of a molecule (any coherent units); in any order."
    )
    angular_momentum: str | None = option(
        None, metavar="L1,L2,L3", help="At time 0, in principal axes (ħ for a molecule; by default the thermal mean)."
    )
    temperature: str | None = option(
        None, metavar="T", help="Of the thermal mean of |L| of a molecule (K; by default 300)."
    )
    times: str | None = option(
        None, metavar="GRID", help="start:stop:count or a comma list (ps for a molecule); by default two periods."
    )


@dataclass(frozen=True)
class Start:
    """A body and how it starts. text: what was given. temperature_k: of the thermal mean, if it is one. top: of a molecule."""

    text: str
    request: TumbleRequest
    temperature_k: float | None = None
    top: Top | None = None

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
    if options.moments is None:
        if given.source is None and given.constants is None:
            raise ValueError("expected a molecule, --constants or --moments; try 'rotor tumble water'")
        return _molecule(given, options)
    if given.source is not None or given.constants is not None:
        raise ValueError("a molecule and --moments: give one of them")
    if given.isotope:
        raise ValueError("--isotope: bare moments have no atoms; give the moments of the isotopologue itself")
    if options.temperature is not None:
        raise ValueError("--temperature: bare moments have no units for a temperature; give --angular-momentum alone")
    return _bare_body(options)


def _bare_body(options: Options) -> Start:
    from rotor.classical.euler import checked_moments
    from rotor.classical.tumble import TumbleRequest

    moments = inputs.parsed("--moments", options.moments or "", lambda text: _checked(text, checked_moments))
    if options.angular_momentum is None:
        raise ValueError("--angular-momentum: expected with --moments: three components in the axes of the moments")
    momentum = _momentum(options.angular_momentum, moments)
    times = inputs.times("--times", options.times, "")
    request = TumbleRequest(_tuple(moments), momentum, times, source=GIVEN)
    for text in request.notes:
        note(text)
    return Start(options.moments or "", request)


def _molecule(given: Input, options: Options) -> Start:
    from rotor.thermo.thermal_tumble import TEMPERATURE_K, thermal_tumble

    if options.temperature is not None and options.angular_momentum is not None:
        raise ValueError(
            "--temperature and --angular-momentum: give one of them; the first chooses |L|, the second is it"
        )
    kelvin = (
        TEMPERATURE_K if options.temperature is None else inputs.positive("--temperature", options.temperature, "K")
    )
    times = inputs.times("--times", options.times, "ps")
    import numpy as np

    top = inputs.read_top(given)
    if options.angular_momentum is None:
        return Start(given.text, thermal_tumble(top, temperature_k=kelvin, times_ps=times), kelvin, top)
    momentum = _momentum(options.angular_momentum, np.array(top.moments_u_angstrom2))
    request = thermal_tumble(top, angular_momentum_hbar=momentum, times_ps=times)
    return Start(given.text, _with_source(request), None, top)


def _with_source(request: TumbleRequest) -> TumbleRequest:
    from dataclasses import replace

    return replace(request, source=GIVEN)


def _momentum(text: str, moments: Floats) -> Three:
    from rotor.classical.euler import checked_momentum

    def parse(value: str) -> Three:
        momentum = _checked(value, lambda three: checked_momentum(three, moments))
        if not momentum.any():
            raise ValueError(f"{value!r}: a body at rest does not tumble; give a component that is not 0")
        return _tuple(momentum)

    return inputs.parsed("--angular-momentum", text, parse)


def _checked(text: str, check: Callable[[Any], Floats]) -> Floats:
    """Three numbers, checked; the message of a mistake begins with the text that was read."""
    try:
        return check(_three(text))
    except ValueError as error:
        message = str(error)
        raise ValueError(message if message.startswith(repr(text)) else f"{text!r}: {message}") from None


def _three(text: str) -> Floats:
    import numpy as np

    from rotor.units import parse_grid

    if text.count(",") != 2 or ":" in text:
        raise ValueError(f"{text!r}: expected three numbers, such as 0.6,0.8,1.0")
    return np.asarray(parse_grid(text, ""))


def _tuple(vector: Floats) -> Three:
    x, y, z = vector.tolist()
    return x, y, z
