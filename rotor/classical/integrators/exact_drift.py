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
        """One evaluation per time for free motion, otherwise kicks and drifts.

        Parameters
        ----------
        system : System
            Moments and effects.
        momentum, attitude : (n, 3) array, (n, 4) array
            The start of n bodies, at times[0]; momentum in the body.
        times : (t,) array
            Increasing or decreasing.

        Returns
        -------
        momenta : (t, n, 3) array
            In body axes.
        attitudes : (t, n, 4) array
            Unit quaternions.
        steps : int
            Number of steps; 0 for free motion.

        Raises
        ------
        ValueError
            With torques, as in `KickDrift.states`.
        """
        if not system.free:
            return super().states(system, momentum, attitude, times)
        path, attitudes = free_motion(system.start_moments, momentum, attitude).at(times - times[0])
        return np.moveaxis(path, 1, 0), np.moveaxis(attitudes, 1, 0), 0

    def drift(self, moments: Floats, state: Floats, carry: Floats, step: float, steps: int, whole: bool) -> None:
        """The state after steps x step; an exact state needs no rounding compensation.

        Parameters
        ----------
        moments : (n, 3) array
            Principal moments during the drift.
        state, carry : (n, 7) array
            Momentum and attitude, and their rounding compensation; both change in place.
        step : float
            Length of a step.
        steps : int
            Number of steps.
        whole : bool
            Whether the steps are of the full order of the method; otherwise base steps, for the parts of a composition.
        """
        momentum, attitude = free_motion(moments, state[:, :3], state[:, 3:]).at(step * steps)
        state[:, :3], state[:, 3:] = momentum, attitude
        carry[:] = 0.0
