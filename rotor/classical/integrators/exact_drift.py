"""The exact free motion between kicks of the torques.

Order: free motion is exact at any time, without steps; with torques 2, or 4, 6, 8 by composition. Conserves: |L| and L in
space between kicks, the free energy, the symplectic form, time reversal. Cost: with torques each drift recomputes the
constants of the closed form after the kick, about 20 ms for up to some hundred bodies; worthwhile only for torques so weak that steps
are many periods long.
Sources: R. van Zon and J. Schofield, J. Comput. Phys. 225, 145 (2007); E. Celledoni, F. Fassò, N. Säfström, A. Zanna,
SIAM J. Sci. Comput. 30, 2084 (2008).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotor.arrays import Floats
from rotor.classical.free.free_motion import free_motion
from rotor.classical.integrators.method import Composed
from rotor.classical.system import System


@dataclass(frozen=True)
class ExactDrift(Composed):
    """Exact drifts; free motion is evaluated at the requested times, and `step` is not used.

    >>> from rotor.classical.integrators.method import integrate
    >>> motion = integrate(ExactDrift(step=1.0), [0.6, 0.8, 1.0], [1.8, 0.4, -0.9], [0.0, 10.0])
    >>> motion.momentum[-1].round(12).tolist(), motion.steps
    ([1.765962508518, -0.695464197033, 0.779554981482], 0)
    """

    def states(self, system: System, momentum: Floats, attitude: Floats, times: Floats) -> tuple[Floats, Floats, int]:
        """As `Method.states`: for free motion one evaluation per time and no steps, otherwise kicks and drifts."""
        if not system.free:
            return super().states(system, momentum, attitude, times)
        path, attitudes = free_motion(system.start_moments, momentum, attitude).at(times - times[0])
        return np.moveaxis(path, 1, 0), np.moveaxis(attitudes, 1, 0), 0

    def drift(self, moments: Floats, state: Floats, carry: Floats, step: float, steps: int, whole: bool) -> None:
        """As `KickDrift.drift`: the state after steps x step; an exact state needs no rounding compensation."""
        momentum, attitude = free_motion(moments, state[:, :3], state[:, 3:]).at(step * steps)
        state[:, :3], state[:, 3:] = momentum, attitude
        carry[:] = 0.0
