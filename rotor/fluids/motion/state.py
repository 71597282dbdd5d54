"""State of rigid molecules in motion, and the two flows of a step: drifts and kicks.

Units are ASE's: Å, u, eV, and Å √(u/eV) for times, so that momenta are in √(u eV) and angular momenta in Å √(u eV).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.fluids.motion.bodies import Bodies, Pose

_WHOLE_STEP = np.ones(1)


@dataclass
class State:
    """n bodies in motion; the arrays are changed in place by the flows.

    centres, momentum: (n, 3), in space. spin: (n, 7), angular momentum in principal axes and attitude. carry: (n, 7), compensation of
    the rounding errors of spin (`rotor.classical.integrators._step_kernels`).
    """

    centres: Floats
    momentum: Floats
    spin: Floats
    carry: Floats

    @classmethod
    def at(cls, pose: Pose, momentum: Floats, angular: Floats) -> State:
        """The state of bodies with a pose, momenta (n, 3) and angular momenta (n, 3) in body axes."""
        spin = np.concatenate([angular, pose.attitude], axis=1)
        return cls(pose.centres.copy(), momentum.copy(), np.ascontiguousarray(spin), np.zeros_like(spin))

    @property
    def angular(self) -> Floats:
        """L (n, 3) in body axes, a view."""
        return self.spin[:, :3]

    @property
    def attitude(self) -> Floats:
        """Attitudes (n, 4), a copy."""
        return self.spin[:, 3:].copy()

    @property
    def pose(self) -> Pose:
        """Centres and attitudes."""
        return Pose(self.centres, self.attitude)


@dataclass(frozen=True)
class Flows:
    """Drifts and kicks of given bodies.

    The drift is the free motion: exact for the centre; for the attitude `SymmetricTopSplitting`, which is exact for linear molecules,
    symmetric and spherical tops; for asymmetric tops its error is smaller than that of the kicks (benchmarks/bench_thermometers.py
    compares it with `RotationSplitting`).
    """

    bodies: Bodies

    @cached_property
    def _inverse(self) -> Floats:
        from rotor.classical.system import acting_inverse

        return acting_inverse(self.bodies.moments)

    @cached_property
    def _axes(self) -> NDArray[np.int64]:
        from rotor.classical.integrators.splitting import turned_axes

        return turned_axes(self._inverse)

    def drift(self, state: State, time: float) -> None:
        """Free motion for a time."""
        from rotor.classical.integrators._step_kernels import symmetric

        state.centres += state.momentum * (time / self.bodies.mass[:, None])
        symmetric(state.spin, state.carry, self._inverse, self._axes, time, _WHOLE_STEP, 1)

    def kick(self, state: State, force: Floats, torque: Floats, time: float) -> None:
        """Momenta gain force (n, 3) in space and torque (n, 3) in body axes times a time, in place."""
        from rotor.classical.integrators._step_kernels import kick

        state.momentum += force * time
        kick(state.spin, state.carry, torque, time)
