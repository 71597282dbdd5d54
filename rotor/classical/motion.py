"""A motion as a table: time, angular momentum, attitude and energy, and the drift of its conserved quantities."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.checks import warn_renamed
from rotor.classical.euler import energy, invariants
from rotor.classical.free.free_motion import FreeMotion
from rotor.classical.integrators.method import Motion
from rotor.geometry.rotations import continuous
from rotor.table import Table

ATTITUDE = "qw", "qx", "qy", "qz"


@dataclass(frozen=True)
class Units:
    """Names of the units of an answer, and factors from the units of the motion.

    Without names all numbers are in one coherent set. moment: the unit of the moments, which are not converted.
    """

    time: str = ""
    angular_momentum: str = ""
    energy: str = ""
    time_factor: float = 1.0
    momentum_factor: float = 1.0
    energy_factor: float = 1.0
    moment: str = ""

    @property
    def rate(self) -> str:
        """Unit of angular velocities."""
        return f"rad/{self.time}" if self.time else ""


COHERENT = Units()
SI = Units("s", "kg m²/s", "J", moment="kg m²")


class ColumnsInUnits(dict[str, Floats]):
    """Columns with their units behind their names; the bare names of version 0.2 work for one minor release, with a warning.

    columns: name, unit and values of each.
    >>> ColumnsInUnits([("t", "ps", np.zeros(1)), ("w1", "rad/s", np.ones(1))])
    {'t_ps': array([0.]), 'w1_rad_per_s': array([1.])}
    """

    def __init__(self, columns: Iterable[tuple[str, str, Floats]]) -> None:
        self.bare: dict[str, str] = {}
        for name, unit, values in columns:
            self.bare[name] = f"{name}_{_unit_word(unit)}" if unit else name
            self[self.bare[name]] = values

    def __missing__(self, name: str) -> Floats:
        if name not in self.bare:
            raise KeyError(name)
        warn_renamed(f'the column "{name}"', f'"{self.bare[name]}"')
        return self[self.bare[name]]


def _unit_word(unit: str) -> str:
    """A unit as part of a name.

    >>> [_unit_word(unit) for unit in ("ps", "ħ", "cm-1", "kg m²/s", "J")]
    ['ps', 'hbar', 'cm', 'kg_m2_per_s', 'j']
    """
    word = unit.replace("ħ", "hbar").replace("²", "2").replace("/", "_per_").removesuffix("-1")
    return word.replace(" ", "_").lower()


@dataclass(frozen=True, eq=False, repr=False)
class MotionTable(Table):
    """One body at n times.

    times: (n,). momentum: (n, 3), L in principal axes. attitude: (n, 4), body to space. energy: (n,). omega: (n, 3), angular velocity
    in principal axes, of a motion under effects.
    """

    times: Floats
    momentum: Floats
    attitude: Floats
    energy: Floats
    omega: Floats | None = None
    units: Units = COHERENT

    def __len__(self) -> int:
        return len(self.times)

    @classmethod
    def from_motion(cls, motion: Motion, units: Units = COHERENT, *, rates: bool = False) -> MotionTable:
        """The table of a motion that an integrator made, of one body; rates: with the angular velocity."""
        if motion.momentum.ndim != 2:
            raise ValueError(
                f"a table has a single body; this motion has bodies {motion.momentum.shape[:-2]}: choose one of them"
            )
        omega = motion.omega if rates else None
        return cls(motion.times, motion.momentum, continuous(motion.attitude), motion.energy, omega, units)

    @property
    def columns(self) -> dict[str, Floats]:
        """t, m1, m2, m3, qw, qx, qy, qz, energy, and w1, w2, w3 of ω, with their units."""
        units, omega = self.units, () if self.omega is None else self.omega.T
        return ColumnsInUnits(
            [
                ("t", units.time, self.times),
                *((f"m{axis}", units.angular_momentum, values) for axis, values in enumerate(self.momentum.T, 1)),
                *((name, "", values) for name, values in zip(ATTITUDE, self.attitude.T, strict=True)),
                ("energy", units.energy, self.energy),
                *((f"w{axis}", units.rate, values) for axis, values in enumerate(omega, 1)),
            ]
        )


@dataclass(frozen=True)
class InvariantDrift:
    """Largest relative deviation from the start of energy, |L|, and L in space (its length over |L|)."""

    energy: float
    momentum: float
    space_momentum: float


def sampled(motion: FreeMotion, times: ArrayLike) -> MotionTable:
    """The exact motion of one body at `times` (n,), in the order given; signs of q follow the neighbour before.

    >>> from rotor.classical.free.free_motion import free_motion
    >>> table = sampled(free_motion([1.0, 1.0, 2.0], [3.0, 0.0, 4.0]), [0.0, 1.0])
    >>> table.energy.tolist()  # ½ (9/1 + 16/2)
    [8.5, 8.5]
    """
    times = np.asarray(times, dtype=np.float64)
    if motion.moments.shape != (3,) or times.ndim != 1:
        raise ValueError(
            f"a table has a single body at a list of times; got bodies {motion.moments.shape[:-1]}, times {times.shape}"
        )
    momentum, attitude = motion.at(times)
    attitude = continuous(attitude)
    return MotionTable(times, momentum, attitude, energy(momentum, motion.moments))


def invariant_drift(motion: MotionTable, start: FreeMotion) -> InvariantDrift:
    """Largest deviation of the rows from the conserved quantities of the start; round-off (about 1e-15) for the exact motion."""
    now = invariants(motion.momentum, motion.attitude, start.moments)
    then = invariants(start.momentum0, start.attitude0, start.moments)
    apart = np.linalg.norm(now.space_momentum - then.space_momentum, axis=-1)
    return InvariantDrift(
        float(np.max(np.abs(now.energy / then.energy - 1.0))),
        float(np.max(np.abs(now.momentum / then.momentum - 1.0))),
        float(np.max(apart / then.momentum)),
    )
