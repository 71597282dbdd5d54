"""Moments of inertia that change in time: a skater's arms, panels that unfold. Angular momentum is conserved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.effect import InertiaChange, vector_field
from rotor.classical.euler import checked_moments
from rotor.requests.field import REQUIRED, declared
from rotor.requests.lists import Array


@dataclass(frozen=True)
class ChangingInertia(InertiaChange):
    """Principal moments (..., 3) as a function of time, about axes fixed in the body.

    The moving masses are assumed to carry no angular momentum relative to the body (they move along radii, or in mirror pairs);
    otherwise add it as an inner momentum. The work that moves them changes the energy; L does not change.

    >>> skater = ChangingInertia(lambda time: [4.0, 4.0, 2.0 / (1.0 + time)])
    >>> skater.moments(1.0)
    array([4., 4., 1.])
    """

    conserves_momentum: ClassVar[bool] = True
    depends_on_time: ClassVar[bool] = True

    history: Callable[[float], ArrayLike]

    def __post_init__(self) -> None:
        if not callable(self.history):
            raise ValueError("changing inertia needs a function of time that returns three moments")

    def moments(self, time: float) -> Floats:
        """The moments at `time`, checked; a moment of zero is refused because it has no inverse."""
        moments = checked_moments(np.asarray(self.history(time), dtype=np.float64))
        if np.any(moments == 0.0):
            raise ValueError(f"changing inertia at time {time:g}: moments {moments.tolist()} must all be positive")
        return moments


@dataclass(frozen=True)
class MomentsByTime(InertiaChange):
    """Principal moments (n, 3) at increasing times (n,), interpolated linearly and constant before and after.

    >>> MomentsByTime([0.0, 2.0], [[4.0, 4.0, 4.0], [4.0, 4.0, 2.0]]).moments(1.0)
    array([4., 4., 3.])
    """

    name: ClassVar[str] = "changing inertia"
    conserves_momentum: ClassVar[bool] = True
    depends_on_time: ClassVar[bool] = True

    times: ArrayLike = vector_field("times", "rising")
    rows: ArrayLike = declared(REQUIRED, Array(list[list[float]]), "three at each time", "moments")

    def __post_init__(self) -> None:
        knots, rows = np.array(self.times, dtype=np.float64), checked_moments(self.rows)
        if knots.ndim != 1 or rows.shape != (len(knots), 3) or not np.all(np.diff(knots) > 0.0) or np.any(rows == 0.0):
            raise ValueError(
                f"moments by time: expected rising times and three positive moments at each; got {rows.tolist()}"
            )
        object.__setattr__(self, "times", knots)
        object.__setattr__(self, "rows", rows)

    def moments(self, time: float) -> Floats:
        """The moments at `time`."""
        rows = np.asarray(self.rows)
        return np.array([np.interp(time, np.asarray(self.times), rows[:, axis]) for axis in range(3)])
