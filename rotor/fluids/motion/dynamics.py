"""Rigid molecules moved by the forces of any ASE calculator: an ASE dynamics for `attach`, loggers and trajectories.

A step kicks with half the force and torque, drifts freely, and kicks again (T. F. Miller et al., J. Chem. Phys. 116, 8649
(2002), with the core's drift): order 2, symplectic, reversible; total momentum is conserved to round-off. A thermostat acts in
the middle of the drift. This module imports ASE when it is imported; the rest of the package does so only on use.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import IO, Any

import numpy as np
from ase import Atoms
from ase.md.md import MolecularDynamics
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.fluids.motion.bodies import SHAPE_TOLERANCE_ANGSTROM, rigid_bodies
from rotor.fluids.motion.state import Flows, State
from rotor.fluids.motion.thermometers import (
    THERMOMETERS,
    Kinetic,
    Temperatures,
    kinetic_energy,
    step_correction,
    temperatures,
)
from rotor.fluids.motion.thermostats import Thermostat
from rotor.statistics.degrees_of_freedom import Degrees

AT_REST = 1e-8  # share of the kinetic energy of translation below which the total momentum counts as removed
NET_FORCE = 1e-3  # share of the summed sizes of forces below which they count as adding to nothing
NO_FORCE_EV_PER_ANGSTROM = 1e-12  # a molecule: what round-off leaves of forces on a perfect lattice


class RigidDynamics(MolecularDynamics):
    """Dynamics of rigid molecules, in ASE's units.

    Parameters
    ----------
    atoms : ase.Atoms
        With a calculator. The motion starts from the rigid part of its momenta. Positions (whole molecules, unwrapped), momenta and
        masses are written back after each step.
    timestep : float
        In ASE's unit of time: `2 * ase.units.fs`.
    thermostat : Thermostat, optional
        None for constant energy.
    molecules, shapes, tolerance_angstrom
        As of `rotor.fluids.motion.bodies.rigid_bodies`.
    removed : int, optional
        Degrees of freedom removed from the motion. Default: 3 if the total momentum is conserved, which must then be zero, and 0 with a
        thermostat that changes it. With walls or fields give 0.
    trajectory, logfile, loginterval
        As in other ASE dynamics; the temperatures in the log are those of rigid bodies.

    Examples
    --------
    >>> from ase import units
    >>> from ase.build import molecule
    >>> from ase.calculators.lj import LennardJones
    >>> pair = molecule("N2") + molecule("N2")
    >>> pair.positions[2:] += [4.0, 0.3, 0.0]
    >>> pair.calc = LennardJones(sigma=3.3, epsilon=0.003, rc=20.0)
    >>> dynamics = RigidDynamics(pair, 1.0 * units.fs)
    >>> dynamics.run(10)
    True
    >>> dynamics.degrees.total, bool(abs(pair.get_distance(2, 3) - pair.get_distance(0, 1)) < 1e-12)
    (7, True)
    """

    def __init__(
        self,
        atoms: Atoms,
        timestep: float,
        *,
        thermostat: Thermostat | None = None,
        molecules: ArrayLike | Sequence[Sequence[int]] | None = None,
        shapes: Mapping[tuple[str, ...], ArrayLike] | None = None,
        tolerance_angstrom: float = SHAPE_TOLERANCE_ANGSTROM,
        removed: int | None = None,
        trajectory: Any = None,
        logfile: IO[str] | str | None = None,
        loginterval: int = 1,
        **kwargs: Any,
    ) -> None:
        if not (np.isfinite(timestep) and timestep != 0.0):
            raise ValueError(f"timestep {timestep}: expected a time other than 0, in ASE's unit (2 * ase.units.fs)")
        self.bodies, pose = rigid_bodies(atoms, molecules, shapes, tolerance_angstrom)
        self.thermostat, self._tolerance = thermostat, tolerance_angstrom
        self._flows = Flows(self.bodies)
        conserves_momentum = thermostat is None or thermostat.conserves_momentum
        self.degrees: Degrees = self.bodies.degrees((3 if conserves_momentum else 0) if removed is None else removed)
        atoms.set_masses(self.bodies.masses)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Zero mass encountered")  # a site without mass belongs to its body
            super().__init__(atoms, timestep, trajectory=trajectory, logfile=None, loginterval=loginterval, **kwargs)
        if thermostat is not None:
            thermostat.start(self.bodies, self.degrees)
        self.state = State.at(pose, *self.bodies.wrench(atoms.get_momenta(), pose.attitude))
        self._check_momentum()
        self._wrench: tuple[Floats, Floats] | None = None
        self._write_positions()
        self.write_momenta()
        if logfile:
            self._attach_log(logfile, loginterval)

    def step(self) -> None:
        """One step; ASE calls it from `run` and `irun`."""
        self._notice_changes()
        h, state = self.dt, self.state
        self._flows.kick(state, *self.wrench(), 0.5 * h)
        if self.thermostat is None:
            self._flows.drift(state, h)
        else:
            self._flows.drift(state, 0.5 * h)
            self.thermostat.act(state, h)
            self._flows.drift(state, 0.5 * h)
        self._write_positions()
        self._wrench = None
        self._flows.kick(state, *self.wrench(), 0.5 * h)
        self.write_momenta()

    def wrench(self) -> tuple[Floats, Floats]:
        """Current forces (n, 3) in space and torques (n, 3) in body axes; ValueError if one is not finite."""
        if self._wrench is None:
            forces = self.atoms.get_forces(apply_constraint=False)
            force, torque = self.bodies.wrench(forces, self.state.attitude)
            fine = np.isfinite(force).all(axis=1) & np.isfinite(torque).all(axis=1)
            if not fine.all():
                raise ValueError(
                    f"the force on {self.bodies.name_of(int(np.argmin(fine)))} is not finite in step {self.nsteps + 1}: molecules "
                    "on top of each other, or a step too long"
                )
            self._wrench = force, torque
            if self.nsteps == 0:
                self._check_net_force(force)
        return self._wrench

    @property
    def thermometer(self) -> str:
        """The thermometer without an error of order h²: "mixed", or "half" with a thermostat."""
        return "mixed" if self.thermostat is None else "half"

    def kinetic(self, thermometer: str | None = None) -> Kinetic:
        """Kinetic energies by a thermometer of `rotor.fluids.motion.thermometers` ("full", "half", "mixed"; default: the best)."""
        factor = THERMOMETERS[thermometer or self.thermometer]
        full = kinetic_energy(self.bodies, self.state.momentum, self.state.angular)
        return full + step_correction(self.bodies, *self.wrench(), self.dt).times(factor) if factor else full

    def half_step_momenta(self) -> tuple[Floats, Floats]:
        """Momenta (n, 3) and angular momenta (n, 3) in body axes after half a step; with a thermostat those of its ensemble.

        At full steps they are too small by (Ωh)²/8 for a libration of frequency Ω (`rotor.fluids.motion.thermometers`).
        """
        force, torque = self.wrench()
        return self.state.momentum + 0.5 * self.dt * force, self.state.angular + 0.5 * self.dt * torque

    def temperatures(self, thermometer: str | None = None) -> Temperatures:
        """Temperatures of all degrees, translations and rotations, K."""
        return temperatures(self.kinetic(thermometer), self.degrees)

    def conserved_energy(self) -> float:
        """Potential energy, full-step kinetic energy and energy of the thermostat, eV: constant up to order h²."""
        energy = float(self.atoms.get_potential_energy()) + self.kinetic("full").total_ev
        return energy + (self.thermostat.energy() if self.thermostat is not None else 0.0)

    def refresh(self) -> None:
        """Discard the calculator's results, so that the further motion depends only on the current state."""
        if hasattr(self.atoms.calc, "reset"):
            self.atoms.calc.reset()
        self._wrench = None

    def restore(self, state: State, nsteps: int) -> None:
        """Continue from a saved state."""
        self.state, self.nsteps = state, nsteps
        self._write_positions()
        self.write_momenta()
        self.refresh()

    def todict(self) -> dict[str, Any]:
        """The header of an ASE trajectory."""
        name = "none" if self.thermostat is None else type(self.thermostat).__name__
        return super().todict() | {"thermostat": name}  # type: ignore[no-any-return]

    def _write_positions(self) -> None:
        self._positions = self.bodies.positions(self.state.pose)
        self.atoms.arrays["positions"][...] = self._positions

    def write_momenta(self) -> None:
        """Write the momenta of `state` to the atoms."""
        self._momenta = self.bodies.momenta(self.state.momentum, self.state.angular, self.state.attitude)
        self.atoms.arrays["momenta"][...] = self._momenta

    def _notice_changes(self) -> None:
        """Take over positions or momenta that were set on the atoms since the last step."""
        moved = not np.array_equal(self.atoms.arrays["positions"], self._positions)
        pushed = not np.array_equal(self.atoms.arrays["momenta"], self._momenta)
        if not (moved or pushed):
            return
        pose = self.bodies.pose(self.atoms, self._tolerance) if moved else self.state.pose
        self.state = State.at(pose, *self.bodies.wrench(self.atoms.arrays["momenta"], pose.attitude))
        self._check_momentum()
        self._write_positions()
        self.write_momenta()
        self._wrench = None

    def _check_momentum(self) -> None:
        if self.degrees.removed < 3:
            return
        total = self.state.momentum.sum(axis=0)
        share = float(total @ total) / (2.0 * self.bodies.mass.sum())
        if share > AT_REST * kinetic_energy(self.bodies, self.state.momentum, 0.0 * self.state.angular).total_ev:
            raise ValueError(
                "the total momentum is not zero, but 3 degrees of freedom are counted as removed: set it to zero "
                "(ase.md.velocitydistribution.Stationary(atoms)), or give removed=0"
            )

    def _check_net_force(self, force: Floats) -> None:
        net, sizes = np.linalg.norm(force.sum(axis=0)), np.linalg.norm(force, axis=1).sum()
        nothing = NET_FORCE * sizes + NO_FORCE_EV_PER_ANGSTROM * len(force)
        if self.degrees.removed >= 3 and net > nothing:
            raise ValueError(
                f"the forces add to {net:.3g} eV/Å, so the total momentum changes, but 3 degrees of freedom are counted "
                "as removed: give removed=0"
            )

    def _attach_log(self, logfile: IO[str] | str, interval: int) -> None:
        file = self.openfile(logfile, comm=self.comm, mode="a")
        file.write(f"{'time_ps':>12} {'total_ev':>16} {'potential_ev':>16} {'t_trans_k':>10} {'t_rot_k':>10}\n")

        def line() -> None:
            from ase.units import fs

            heat = self.temperatures()
            total, potential = self.conserved_energy(), self.atoms.get_potential_energy()
            time_ps = self.get_time() / (1000.0 * fs)
            file.write(
                f"{time_ps:12.4f} {total:16.8f} {potential:16.8f} {heat.translation_k:10.2f} {heat.rotation_k:10.2f}\n"
            )
            file.flush()

        self.attach(line, interval)
