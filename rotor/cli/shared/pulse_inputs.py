"""Texts of pulses: `"1e13 W/cm2, 1 ps"` and its relatives become pulses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import typer

from rotor.cli.shared import inputs

if TYPE_CHECKING:
    from rotor.alignment.pulse import Axis, Pulse

PULSE = typer.Option(
    None,
    metavar="TEXT",
    help='Gaussian pulse: peak intensity, full width at half maximum[, time of the peak]: "1e13 W/cm2, 1 ps[, 40 ps]"; repeatable.',
)
SWITCHED = typer.Option(
    None, metavar="TEXT", help='Switched pulse: "1e12 W/cm2, RISE, PLATEAU, FALL[, START]" (ps); repeatable.'
)
KICK = typer.Option(None, metavar="TEXT", help='Kick without duration: "1.0 J/cm2[, TIME]"; repeatable.')
PULSE_TABLE = typer.Option(None, metavar="FILE", help="Pulse from a CSV of t_ps and intensity_w_per_cm2.")
THZ = typer.Option(
    None,
    metavar="TEXT",
    help='Field on the dipole: "100 kV/cm, 1 ps[, 0.3 THz[, TIME]]": peak, width of the envelope, frequency; repeatable.',
)
POLARIZATION = typer.Option(
    "z", metavar="NAME", help="Of all light: z, x, circular (in XY) or elliptical:R (I_X : I_Z = R : 1)."
)


def pulses(
    gaussian: Sequence[str], switched: Sequence[str], kicks: Sequence[str], table: str | None, thz: Sequence[str], named: str
) -> tuple[Pulse, ...]:
    """All pulses of the options; ValueError, with the option, for a text that is none, and where there is none at all."""
    axis = inputs.option("--polarization", named, _axis)
    out = [inputs.option("--pulse", text, lambda value: _gaussian(value, axis)) for text in gaussian]
    out += [inputs.option("--switched", text, lambda value: _switched(value, axis)) for text in switched]
    out += [inputs.option("--kick", text, lambda value: _kick(value, axis)) for text in kicks]
    out += [inputs.option("--thz", text, _thz) for text in thz]
    if table is not None:
        out.append(inputs.option("--pulse-table", table, lambda path: _of_table(path, axis)))
    if not out:
        raise ValueError('no pulse: give --pulse "1e13 W/cm2, 1 ps", --switched, --kick, --pulse-table or --thz')
    return tuple(out)


def _axis(name: str) -> Axis:
    from rotor.alignment.pulse import elliptical, polarization

    word, _, ratio = name.strip().lower().partition(":")
    known = {"z": (0, 0, 1), "x": (1, 0, 0), "y": (0, 1, 0), "circular": (1, 1j, 0)}
    if word in known and not ratio:
        return polarization(known[word])
    if word == "elliptical":
        try:
            return elliptical(float(ratio))
        except ValueError as error:
            raise ValueError(f"{name!r}: write elliptical:R, R of 0 or more, such as elliptical:0.33 ({error})") from None
    raise ValueError(f"{name!r} is not z, x, y, circular or elliptical:R")


def _numbers(text: str, units: Sequence[str], least: int) -> list[float]:
    """Numbers between commas in the units given; ValueError unless there are between `least` and all of them."""
    from rotor.units import parse_quantity

    parts = [part.strip() for part in text.split(",")]
    if not least <= len(parts) <= len(units):
        count = f"{least}" if least == len(units) else f"{least} to {len(units)}"
        raise ValueError(f"{text!r}: {count} numbers between commas are expected, in {', '.join(units)}; found {len(parts)}")
    return [parse_quantity(part, unit) for part, unit in zip(parts, units, strict=False)]


def _gaussian(text: str, axis: Axis) -> Pulse:
    from rotor.alignment.pulse import GaussianPulse

    return GaussianPulse(*_numbers(text, ("W/cm2", "ps", "ps"), 2), axis=axis)


def _switched(text: str, axis: Axis) -> Pulse:
    from rotor.alignment.pulse import SwitchedPulse

    return SwitchedPulse(*_numbers(text, ("W/cm2", "ps", "ps", "ps", "ps"), 4), axis=axis)


def _kick(text: str, axis: Axis) -> Pulse:
    from rotor.alignment.pulse import Kick

    return Kick(*_numbers(text, ("J/cm2", "ps"), 1), axis=axis)


def _thz(text: str) -> Pulse:
    from rotor.alignment.pulse import DipolePulse

    field, width, *rest = _numbers(text, ("kV/cm", "ps", "THz", "ps"), 2)
    frequency, centre = [*rest, 0.0, 0.0][:2]
    return DipolePulse(field, width, frequency_thz=frequency, centre_ps=centre)


def _of_table(path: str, axis: Axis) -> Pulse:
    import numpy as np

    from rotor.alignment.pulse import TabulatedPulse

    names, rows = _rows(path)
    wanted = ("t_ps", "intensity_w_per_cm2")
    if not set(wanted) <= set(names):
        raise ValueError(f"{path}: columns {', '.join(wanted)} are expected; found {', '.join(names)}")
    table = np.array(rows).reshape(len(rows), len(names))
    return TabulatedPulse(table[:, names.index("t_ps")], table[:, names.index("intensity_w_per_cm2")], axis)


def _rows(path: str) -> tuple[list[str], list[list[float]]]:
    import csv

    with open(path, newline="", encoding="utf-8-sig") as handle:
        lines = [line for line in csv.reader(handle) if line and not line[0].startswith("#")]
    if not lines:
        raise ValueError(f"{path}: the file is empty")
    names = [name.strip() for name in lines[0]]
    try:
        rows = [[float(cell) for cell in line] for line in lines[1:]]
    except ValueError as error:
        raise ValueError(f"{path}: a number is expected in every row after the first ({error})") from None
    if any(len(row) != len(names) for row in rows):
        raise ValueError(f"{path}: every row must have {len(names)} numbers, as many as there are columns")
    return names, rows


def states(name: str, text: str) -> int:
    """The highest J of `J<=2`, or of a number alone."""

    def parse(value: str) -> int:
        number = value.replace(" ", "").upper().removeprefix("J<=").removeprefix("J≤")
        if not number.isdecimal():
            raise ValueError(f"{value!r}: write J<=2, or the number alone")
        return int(number)

    return inputs.option(name, text, parse)


