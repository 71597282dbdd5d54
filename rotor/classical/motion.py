"""A motion as a table: time, angular momentum, attitude and energy, and the drift of its conserved quantities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.euler import energy, invariants
from rotor.classical.free.free_motion import FreeMotion
from rotor.classical.integrators.method import Motion
from rotor.geometry.rotations import continuous
from rotor.table import Table


@dataclass(frozen=True, eq=False, repr=False)
class MotionTable(Table):
    """One body at n times.

    times: (n,). momentum: (n, 3), L in principal axes. attitude: (n, 4), body to space. energy: (n,). In one
    coherent set of units, or each in its own, as `rotor tumble` prints them.
    """

    times: Floats
    momentum: Floats
    attitude: Floats
    energy: Floats

    def __len__(self) -> int:
        return len(self.times)

    @classmethod
    def from_motion(cls, motion: Motion) -> MotionTable:
        """The table of a motion that an integrator made, of one body."""
        if motion.momentum.ndim != 2:
            raise ValueError(
                f"a table has a single body; this motion has bodies {motion.momentum.shape[:-2]}: choose one of them"
            )
        return cls(motion.times, motion.momentum, continuous(motion.attitude), motion.energy)

    @property
    def columns(self) -> dict[str, Floats]:
        """The table by column: t, m1, m2, m3, qw, qx, qy, qz, energy."""
        names = ("t", "m1", "m2", "m3", "qw", "qx", "qy", "qz", "energy")
        return dict(zip(names, (self.times, *self.momentum.T, *self.attitude.T, self.energy), strict=True))


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
