"""Thermostats for rigid molecules: Langevin noise and Nosé-Hoover chains, both in the middle of the step.

A thermostat that acts between two half drifts, on the half-step momenta, gives positions with a smaller error than at the ends of the
step; for a harmonic libration with none (B. Leimkuhler and C. Matthews, J. Chem. Phys. 138, 174102 (2013); Z. Zhang et al., J. Chem.
Phys. 147, 034109 (2017), for chains too). Angular momenta and noise are in principal axes, where a component L_i has the variance
I_i kT at any attitude.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from rotor import units
from rotor.fluids.motion.bodies import Bodies
from rotor.fluids.motion.state import State
from rotor.fluids.motion.thermometers import kinetic_energy
from rotor.statistics.degrees_of_freedom import Degrees

# H. Yoshida, Phys. Lett. A 150, 262 (1990): weights of a step of order 4, w, 1 - 2w, w
_W = 1.0 / (2.0 - 2.0 ** (1.0 / 3.0))
_YOSHIDA = (_W, 1.0 - 2.0 * _W, _W)
ROUNDS = 2  # repetitions of Yoshida's three sub-steps per action of a chain


class Thermostat(ABC):
    """Changes momenta in the middle of a step so that the ensemble is canonical at `temperature_k`."""

    conserves_momentum: bool

    def __init__(self, temperature_k: float) -> None:
        if not (math.isfinite(temperature_k) and temperature_k > 0.0):
            raise ValueError(f"a thermostat's temperature of {temperature_k} K: expected a number above 0")
        self.temperature_k = temperature_k
        self.kt = temperature_k * units.EV_PER_K

    @abstractmethod
    def start(self, bodies: Bodies, degrees: Degrees) -> None:
        """Take over bodies and the count of degrees; called by the dynamics."""

    @abstractmethod
    def act(self, state: State, time: float) -> None:
        """Apply the bath to the momenta for a time."""

    @abstractmethod
    def energy(self) -> float:
        """The bath's part of the conserved energy, eV."""

    @abstractmethod
    def state_dict(self) -> dict[str, Any]:
        """The variables that change during a run, in a form that JSON stores without loss."""

    @abstractmethod
    def restore(self, state_dict: dict[str, Any]) -> None:
        """Continue from what `state_dict` gave."""


class Langevin(Thermostat):
    """Friction and noise on centres and on angular momenta about principal axes, solved exactly for the time of a step:

        p → e^(-γt) p + √(m kT (1 - e^(-2γt))) ξ,    L_i → e^(-γt) L_i + √(I_i kT (1 - e^(-2γt))) ξ_i

    (the Ornstein-Uhlenbeck part of R. L. Davidchack, T. E. Ouldridge, M. V. Tretyakov, J. Chem. Phys. 142, 144114 (2015),
    with a common friction). The total momentum is not conserved: all 3N translational degrees count.

    friction: 1/(ASE's unit of time): `1e-3 / ase.units.fs` is 1/ps. rng: of the noise; its state is saved for restarts.
    """

    conserves_momentum = False

    def __init__(self, temperature_k: float, friction: float, rng: np.random.Generator) -> None:
        super().__init__(temperature_k)
        if not (math.isfinite(friction) and friction > 0.0):
            raise ValueError(f"a friction of {friction}: expected a number above 0, in 1/(ASE's unit of time)")
        self.friction, self._rng, self._heat = friction, rng, 0.0

    def start(self, bodies: Bodies, degrees: Degrees) -> None:
        """The widths of the noise."""
        self._bodies = bodies
        self._momentum_width = np.sqrt(bodies.mass * self.kt)[:, None]
        self._angular_width = np.sqrt(bodies.moments * self.kt)

    def act(self, state: State, time: float) -> None:
        """Exact Ornstein-Uhlenbeck processes of all momenta."""
        before = kinetic_energy(self._bodies, state.momentum, state.angular).total_ev
        keep, gain = math.exp(-self.friction * time), math.sqrt(-math.expm1(-2.0 * self.friction * time))
        noise = self._rng.standard_normal((2, len(self._bodies), 3))
        state.momentum[...] = keep * state.momentum + gain * self._momentum_width * noise[0]
        state.spin[:, :3] = keep * state.angular + gain * self._angular_width * noise[1]
        state.carry[:, :3] = 0.0
        self._heat += before - kinetic_energy(self._bodies, state.momentum, state.angular).total_ev

    def energy(self) -> float:
        """Heat that the bath has taken."""
        return self._heat

    def state_dict(self) -> dict[str, Any]:
        """Heat and the state of the random numbers."""
        return {"heat": self._heat, "rng": self._rng.bit_generator.state}

    def restore(self, state_dict: dict[str, Any]) -> None:
        """Restore the heat and the state of the random numbers."""
        self._heat = float(state_dict["heat"])
        self._rng.bit_generator.state = state_dict["rng"]


class _Chain:
    """One Nosé-Hoover chain on f degrees: G. J. Martyna, M. L. Klein, M. Tuckerman, J. Chem. Phys. 97, 2635 (1992).

    The links have masses Q_1 = f kT τ², Q_k = kT τ²; x their positions, v their velocities.
    """

    def __init__(self, degrees: int, kt: float, relaxation: float, links: int) -> None:
        self.degrees, self.kt = degrees, kt
        self.mass = np.full(links, kt * relaxation**2)
        self.mass[0] *= degrees
        self.x, self.v = np.zeros(links), np.zeros(links)

    def scaled(self, twice_kinetic: float, time: float) -> float:
        """The factor for the momenta of the degrees, whose 2K is given, after `time` under the chain.

        The flow is that of G. J. Martyna, M. E. Tuckerman, D. J. Tobias, M. L. Klein, Mol. Phys. 87, 1117 (1996), section 4,
        in `ROUNDS` times Yoshida's three sub-steps.
        """
        factor = 1.0
        for weight in _YOSHIDA * ROUNDS:
            h = weight * time / ROUNDS
            self._push(factor * factor * twice_kinetic, h, inwards=True)
            factor *= math.exp(-h * self.v[0])
            self.x += h * self.v
            self._push(factor * factor * twice_kinetic, h, inwards=False)
        return factor

    def energy(self) -> float:
        """½ Σ Q v² + f kT x_1 + kT Σ x_k."""
        return float(0.5 * self.mass @ self.v**2 + self.kt * (self.degrees * self.x[0] + self.x[1:].sum()))

    def _push(self, twice_kinetic: float, h: float, inwards: bool) -> None:
        """Half a step of the links' velocities, from the last link to the first, or back."""
        last = len(self.v) - 1
        for k in range(last, -1, -1) if inwards else range(last + 1):
            drag = 1.0 if k == last else math.exp(-0.25 * h * self.v[k + 1])
            if k == 0:
                force = (twice_kinetic - self.degrees * self.kt) / self.mass[0]
            else:
                force = (self.mass[k - 1] * self.v[k - 1] ** 2 - self.kt) / self.mass[k]
            self.v[k] = drag * (drag * self.v[k] + 0.5 * h * force)


class NoseHoover(Thermostat):
    """Chains that scale momenta so that the kinetic energy has the canonical distribution; deterministic.

    Parameters
    ----------
    temperature_k : float
        Temperature.
    relaxation : float
        Time constant τ in ASE's unit of time.
    links : int
        Links of a chain.
    separate : bool
        Separate chains for translations and rotations instead of a common one.

    Notes
    -----
    The chain counts exactly the moving degrees: three fewer if the total momentum is zero and conserved.
    """

    conserves_momentum = True

    def __init__(self, temperature_k: float, relaxation: float, links: int = 3, separate: bool = False) -> None:
        super().__init__(temperature_k)
        if not (math.isfinite(relaxation) and relaxation > 0.0):
            raise ValueError(f"a relaxation time of {relaxation}: expected a number above 0, in ASE's unit of time")
        if links < 1:
            raise ValueError(f"a chain of {links} links: expected at least 1")
        self.relaxation, self.links, self.separate = relaxation, links, separate

    def start(self, bodies: Bodies, degrees: Degrees) -> None:
        """Chains for the degrees there are."""
        self._bodies = bodies
        counts = (degrees.translation, degrees.rotation) if self.separate else (degrees.total,)
        if min(counts) < 1:
            raise ValueError(f"a chain on {min(counts)} degrees of freedom has nothing to thermostat")
        self._chains = [_Chain(count, self.kt, self.relaxation, self.links) for count in counts]

    def act(self, state: State, time: float) -> None:
        """The chains' flow."""
        kinetic = kinetic_energy(self._bodies, state.momentum, state.angular)
        if self.separate:
            energies = (kinetic.translation_ev, kinetic.rotation_ev)
            moving, turning = (c.scaled(2.0 * e, time) for c, e in zip(self._chains, energies, strict=True))
        else:
            moving = turning = self._chains[0].scaled(2.0 * kinetic.total_ev, time)
        state.momentum *= moving
        state.spin[:, :3] *= turning
        state.carry[:, :3] *= turning

    def energy(self) -> float:
        """The energy of the chains."""
        return sum(chain.energy() for chain in self._chains)

    def state_dict(self) -> dict[str, Any]:
        """Positions and velocities of the links."""
        return {"x": [c.x.tolist() for c in self._chains], "v": [c.v.tolist() for c in self._chains]}

    def restore(self, state_dict: dict[str, Any]) -> None:
        """Restore the links of the chains."""
        for chain, x, v in zip(self._chains, state_dict["x"], state_dict["v"], strict=True):
            chain.x, chain.v = np.array(x), np.array(v)
