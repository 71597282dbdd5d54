"""Texts of pulses: `"1e13 W/cm2, 1 ps"` and its relatives become pulses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rotor.cli.shared.inputs import parsed
from rotor.cli.shared.options import option

if TYPE_CHECKING:
    from rotor.alignment.pulse import Axis, Pulse

AXES = {"z": (0, 0, 1), "x": (1, 0, 0), "y": (0, 1, 0), "circular": (1, 1j, 0)}


@dataclass(frozen=True)
class Pulses:
    """The texts that say which pulses act."""

    pulse: list[str] | None = option(
        None,
        metavar="TEXT",
        help='Gaussian pulse: peak intensity, full width at half maximum[, time]: "1e13 W/cm2, 1 ps"; repeatable.',
    )
    switched: list[str] | None = option(
        None, metavar="TEXT", help='Switched pulse: "1e12 W/cm2, RISE, PLATEAU, FALL[, START]" (ps); repeatable.'
    )
    kick: list[str] | None = option(
        None, metavar="TEXT", help='Kick without duration: "0.5 J/cm2[, TIME]"; repeatable.'
    )
    pulse_table: str | None = option(
        None, metavar="FILE", help="Pulse from a CSV with columns t_ps and intensity_w_per_cm2."
    )
    thz: list[str] | None = option(
        None,
        metavar="TEXT",
        help='Field on the dipole: "100 kV/cm, 1 ps[, 0.3 THz[, TIME]]": peak, width of its envelope, frequency; repeatable.',
    )
    polarization: str = option(
        "z", metavar="NAME", help="Of all light: z, x, y, circular (in XY) or elliptical:R (I_X : I_Z = R : 1)."
    )


def pulses_of(texts: Pulses) -> tuple[Pulse, ...]:
    """All pulses of the options.

    Raises ValueError, which names the option, for a text that is none, and where there is none at all.
    """
    axis = parsed("--polarization", texts.polarization, _axis)
    out = [parsed("--pulse", text, lambda value: _gaussian(value, axis)) for text in texts.pulse or []]
    out += [parsed("--switched", text, lambda value: _switched(value, axis)) for text in texts.switched or []]
    out += [parsed("--kick", text, lambda value: _kick(value, axis)) for text in texts.kick or []]
    out += [parsed("--thz", text, _thz) for text in texts.thz or []]
    if texts.pulse_table is not None:
        out.append(parsed("--pulse-table", texts.pulse_table, lambda path: _of_table(path, axis)))
    if not out:
        raise ValueError('no pulse: give --pulse "1e13 W/cm2, 1 ps", --switched, --kick, --pulse-table or --thz')
    return tuple(out)


def _axis(name: str) -> Axis:
    from rotor.alignment.pulse import elliptical, polarization

    word, _, ratio = name.strip().lower().partition(":")
    if word in AXES and not ratio:
        return polarization(AXES[word])
    if word == "elliptical":
        try:
            return elliptical(float(ratio))
        except ValueError:
            pass
    raise ValueError(f"{name!r}: expected z, x, y, circular, or elliptical:R with R of 0 or more")


def _numbers(text: str, units: Sequence[str], least: int) -> list[float]:
    """Numbers between commas in the units given; ValueError unless there are between `least` and all of them."""
    from rotor.units import parse_quantity

    parts = [part.strip() for part in text.split(",")]
    if not least <= len(parts) <= len(units):
        count = f"{least}" if least == len(units) else f"{least} to {len(units)}"
        raise ValueError(
            f"{text!r}: expected {count} numbers between commas, in {', '.join(units)}; found {len(parts)}"
        )
    return [parse_quantity(part, unit) for part, unit in zip(parts, units, strict=False)]


def _gaussian(text: str, axis: Axis) -> Pulse:
    from rotor.alignment.pulse import GaussianPulse

    intensity, width, *centre = _numbers(text, ("W/cm2", "ps", "ps"), 2)
    return GaussianPulse(intensity, width, centre[0] if centre else 0.0, axis)


def _switched(text: str, axis: Axis) -> Pulse:
    from rotor.alignment.pulse import SwitchedPulse

    intensity, rise, plateau, fall, *start = _numbers(text, ("W/cm2", "ps", "ps", "ps", "ps"), 4)
    return SwitchedPulse(intensity, rise, plateau, fall, start[0] if start else 0.0, axis)


def _kick(text: str, axis: Axis) -> Pulse:
    from rotor.alignment.pulse import Kick

    fluence, *time = _numbers(text, ("J/cm2", "ps"), 1)
    return Kick(fluence, time[0] if time else 0.0, axis)


def _thz(text: str) -> Pulse:
    from rotor.alignment.pulse import DipolePulse

    field, width, *rest = _numbers(text, ("kV/cm", "ps", "THz", "ps"), 2)
    frequency, centre = [*rest, 0.0, 0.0][:2]
    return DipolePulse(field, width, frequency_thz=frequency, centre_ps=centre)


def _of_table(path: str, axis: Axis) -> Pulse:
    import numpy as np

    from rotor.alignment.pulse import TabulatedPulse

    names, rows = _rows(path)
    columns = ("t_ps", "intensity_w_per_cm2")
    if not set(columns) <= set(names):
        raise ValueError(f"{path}: expected the columns {', '.join(columns)}; found {', '.join(names)}")
    table = np.array(rows).reshape(len(rows), len(names))
    return TabulatedPulse(table[:, names.index(columns[0])], table[:, names.index(columns[1])], axis)


def _rows(path: str) -> tuple[list[str], list[list[float]]]:
    import csv

    with open(path, newline="", encoding="utf-8-sig") as handle:
        lines = [line for line in csv.reader(handle) if line and not line[0].startswith("#")]
    if not lines:
        raise ValueError(f"{path}: the file is empty; expected the columns t_ps and intensity_w_per_cm2")
    names = [name.strip() for name in lines[0]]
    try:
        rows = [[float(cell) for cell in line] for line in lines[1:]]
    except ValueError as error:
        raise ValueError(f"{path}: expected numbers in every row after the first ({error})") from None
    if any(len(row) != len(names) for row in rows):
        raise ValueError(f"{path}: expected {len(names)} numbers in every row, as many as there are columns")
    return names, rows
