"""What is thrown: from the options of `rotor tumble` to a body, its angular momentum, times, and the units of print."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import Input
from rotor.cli.shared.output import note

if TYPE_CHECKING:
    from rotor.arrays import Floats
    from rotor.classical.free.free_motion import FreeMotion
    from rotor.plots.animation import Atoms
    from rotor.tops.top import Top

Names = tuple[str, str, str]

TILT_DEGREES = 0.5
TEMPERATURE_K = 300.0
PERIODS, TURNS, POINTS = 2, 10, 201
MOST_TIMES = 10_000_000


@dataclass(frozen=True)
class Units:
    """Names of the units of print, and their size: a number of the motion times the factor is the number printed."""

    time: str = ""
    angular_momentum: str = ""
    energy: str = ""
    time_factor: float = 1.0
    momentum_factor: float = 1.0
    energy_factor: float = 1.0


@dataclass(frozen=True)
class InitialState:
    """A body and how it is thrown.

    text: what was given. moments, momentum: (3,), in one coherent set (of a molecule: u, Å, eV). momentum_source: how the
    momentum was chosen. temperature_k: of the thermal mean, if it is one. top: None for bare moments.
    """

    text: str
    moments: Floats
    momentum: Floats
    momentum_source: str
    temperature_k: float | None = None
    top: Top | None = None
    names: Names = ("1", "2", "3")
    units: Units = field(default_factory=Units)
    notes: Sequence[str] = ()

    @property
    def atoms(self) -> Atoms | None:
        """The atoms in the principal frame, where there is a geometry."""
        if self.top is None or self.top.molecule is None or self.top.frame is None:
            return None
        from rotor.plots.animation import Atoms

        molecule, frame = self.top.molecule, self.top.frame
        return Atoms((molecule.positions_angstrom - frame.centre) @ frame.axes.T, molecule.symbols)


def read_initial_state(
    given: Input, moments: str | None, angular_momentum: str | None, temperature: str | None
) -> InitialState:
    """The body and its angular momentum that the options mean; what was chosen for the user is said in it."""
    if moments is None:
        if given.source is None and given.constants is None:
            raise ValueError("a molecule, --constants or --moments is wanted; try 'rotor tumble water'")
        return _molecule(given, angular_momentum, temperature)
    if given.source is not None or given.constants is not None:
        raise ValueError("a molecule and --moments: give one of them")
    if given.isotopes:
        raise ValueError("--isotope: bare moments have no atoms; give the moments of the isotopologue itself")
    if temperature is not None:
        raise ValueError("--temperature: bare moments have no units for a temperature; give --angular-momentum alone")
    return _bare_body(moments, angular_momentum)


def _bare_body(moments: str, angular_momentum: str | None) -> InitialState:
    from rotor.classical.euler import checked_moments

    body = inputs.option("--moments", moments, lambda text: _told(text, lambda: checked_moments(_three(text))))
    if angular_momentum is None:
        raise ValueError("--angular-momentum: is wanted with --moments: three components in the axes of the moments")
    momentum = _momentum(angular_momentum, body)
    notes = []
    low, middle, high = sorted(body.tolist())
    if low + middle < high:
        notes = [
            f"no real body has these moments: {low:g} + {middle:g} is less than {high:g}; the equations do not mind"
        ]
        note(notes[0])
    return InitialState(moments, body, momentum, "given (--angular-momentum)", notes=notes)


def _molecule(given: Input, angular_momentum: str | None, temperature: str | None) -> InitialState:
    from rotor import units

    if temperature is not None and angular_momentum is not None:
        raise ValueError(
            "--temperature and --angular-momentum: give one of them; the first chooses |L|, the second is it"
        )
    kelvin = TEMPERATURE_K if temperature is None else inputs.positive("--temperature", temperature, "K")
    top = inputs.read_top(given)
    moments = np.array(top.moments_u_angstrom2)
    chosen = angular_momentum is None
    if angular_momentum is None:
        momentum, source = _thermal(moments, kelvin)
    else:
        momentum = _momentum(angular_momentum, moments) * units.HBAR_CLASSICAL
        source = "given (--angular-momentum)"
    print_units = Units("ps", "ħ", "cm-1", units.ASE_TIME_PS, 1.0 / units.HBAR_CLASSICAL, units.CM_PER_EV)
    temperature_k = kelvin if chosen else None
    return InitialState(
        given.text, moments, momentum, source, temperature_k, top, ("a", "b", "c"), print_units, notes=top.notes
    )


def _thermal(moments: Floats, temperature_k: float) -> tuple[Floats, str]:
    """The thermal mean of |L|, half a degree off the intermediate axis, and the sentence that says so."""
    from rotor.classical.gas.thermal_momentum import mean_thermal_momentum, off_intermediate_axis
    from rotor.units import EV_PER_K

    size = float(mean_thermal_momentum(moments, EV_PER_K * temperature_k))
    momentum = off_intermediate_axis(moments, size, math.radians(TILT_DEGREES))
    if moments[0] == 0.0:
        return momentum, f"the thermal mean of |L| at {temperature_k:g} K (two degrees of freedom), across the axis"
    aside = f"{TILT_DEGREES:g} degrees off axis b, half way between a and c"
    return momentum, f"the thermal mean of |L| at {temperature_k:g} K (classical), {aside}"


def _momentum(text: str, moments: Floats) -> Floats:
    from rotor.classical.euler import checked_momentum

    def parse(value: str) -> Floats:
        momentum = _told(value, lambda: checked_momentum(_three(value), moments))
        if not momentum.any():
            raise ValueError(f"{value!r}: a body at rest does not tumble; give a component that is not 0")
        return momentum

    return inputs.option("--angular-momentum", text, parse)


def _told(text: str, check: Callable[[], Floats]) -> Floats:
    """The value checked; a mistake is told with the text it was read from."""
    try:
        return check()
    except ValueError as error:
        message = str(error)
        raise ValueError(message if message.startswith(repr(text)) else f"{text!r}: {message}") from None


def _three(text: str) -> Floats:
    from rotor.units import parse_grid

    if text.count(",") != 2 or ":" in text:
        raise ValueError(f"{text!r}: three numbers are wanted, such as 0.6,0.8,1.0")
    return np.asarray(parse_grid(text, ""))


def read_times(text: str | None, units: Units) -> Floats | None:
    """The times asked for, in the units of the motion; None: to be chosen."""
    if text is None:
        return None
    from rotor.units import parse_grid

    def parse(value: str) -> Floats:
        count = value.rpartition(":")[2].strip()
        if ":" in value and count.isdecimal() and int(count) > MOST_TIMES:
            raise ValueError(f"{value!r}: at most {MOST_TIMES} times in one run; ask for fewer")
        times = parse_grid(value, units.time)
        if not np.isfinite(times).all():
            raise ValueError(f"{value!r}: a time is beyond the numbers that a computer has")
        return np.asarray(times)

    return inputs.option("--times", text, parse)


def chosen_times(motion: FreeMotion, units: Units) -> tuple[Floats, str]:
    """Times in the units of print that show a motion, and the sentence that says so."""
    if math.isfinite(motion.period):
        span, source = PERIODS * float(motion.period), f"{PERIODS} periods, {POINTS} points"
    else:
        span = TURNS * 2.0 * math.pi / float(motion.turning_rate)
        source = f"{TURNS} turns about L, {POINTS} points, as the motion in the body has no period"
    return np.linspace(0.0, span * units.time_factor, POINTS), source
