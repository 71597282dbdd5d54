"""Input and frames of an engine: rigid molecules with all sites placed, their masses, motion and cell.

Lengths are Å, masses u, energies eV, and velocities those of ASE's set, Å √(eV/u): ½ m v² is in eV.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.classical.euler import kinetic_energy
from rotor.fluids.forces.models import RigidModel, find_models, model_shapes
from rotor.fluids.initial_box import at_rest, check_apart, model_labels, thermal_momenta
from rotor.fluids.motion.bodies import Bodies, Pose, rigid_bodies
from rotor.fluids.motion.thermometers import Kinetic
from rotor.fluids.settings import Settings
from rotor.geometry.rotations import rotate
from rotor.geometry.superposition import superpose
from rotor.statistics.degrees_of_freedom import Degrees


@dataclass(frozen=True)
class Species:
    """Molecules of one model and one set of masses: masses (atoms,) of its real atoms, u."""

    model: RigidModel
    masses: Floats


@dataclass(frozen=True)
class EngineInput:
    """Rigid molecules in a rectangular periodic cell.

    species: all species. kinds: (molecules,) species of each molecule. site_positions, site_velocities: (sites, 3), molecule by
    molecule, real atoms first, molecules whole. edges: (3,) of the cell. degrees: degrees of freedom in the ensemble of the run.
    """

    species: tuple[Species, ...]
    kinds: Ints
    site_positions: Floats
    site_velocities: Floats
    edges: Floats
    degrees: Degrees

    @cached_property
    def sites_per_kind(self) -> Ints:
        """(species,) number of sites."""
        return np.array([len(kind.model.sites) for kind in self.species])

    @cached_property
    def first_sites(self) -> Ints:
        """(molecules,) index of the first site of each molecule."""
        lengths = self.sites_per_kind[self.kinds]
        return np.asarray(np.cumsum(lengths) - lengths)

    @cached_property
    def site_molecule(self) -> Ints:
        """(sites,) the molecule of each site."""
        return np.repeat(np.arange(len(self.kinds)), self.sites_per_kind[self.kinds])

    @cached_property
    def site_masses(self) -> Floats:
        """(sites,) masses, 0 for massless sites."""
        padded = [np.pad(kind.masses, (0, len(kind.model.sites) - len(kind.masses))) for kind in self.species]
        return np.concatenate([padded[k] for k in self.kinds])

    @cached_property
    def real(self) -> Ints:
        """(atoms,) sites of the real atoms, in the order of the box."""
        return np.flatnonzero(self.site_masses)

    def motion(self) -> Motion:
        """The initial motion, without forces."""
        zero = np.zeros_like(self.site_positions)
        return rigid_motion(self.site_molecule, self.site_masses, self.site_positions, self.site_velocities, zero)


@dataclass(frozen=True)
class Motion:
    """The rigid motion of molecules, with forces and torques.

    mass: (n,). momentum: (n, 3) M V. angular_momentum: (n, 3) about the centres, in space. inertia: (n, 3, 3) in space.
    force, torque: (n, 3), about the centres, in space.
    """

    mass: Floats
    momentum: Floats
    angular_momentum: Floats
    inertia: Floats
    force: Floats
    torque: Floats

    @cached_property
    def inverse(self) -> Floats:
        """Pseudo-inverse I⁺ (n, 3, 3): only the part across the axis for a linear molecule, 0 for an atom."""
        return np.asarray(np.linalg.pinv(self.inertia, rcond=1e-9, hermitian=True), dtype=np.float64)

    def kinetic(self) -> Kinetic:
        """Energies of translation and rotation, Σ P²/2M and Σ ½ L·I⁻¹L."""
        return self._energies(self.momentum, self.angular_momentum)

    def correction(self, step: float) -> Kinetic:
        """h² Σ F²/M and h² Σ N·I⁻¹N, which `rotor.fluids.motion.thermometers.THERMOMETERS` multiplies."""
        return self._energies(self.force, self.torque).times(2.0 * step**2)

    def kicked(self, time: float) -> Motion:
        """The motion after the forces have acted for a time (Å √(u/eV)) at fixed positions."""
        return replace(
            self,
            momentum=self.momentum + time * self.force,
            angular_momentum=self.angular_momentum + time * self.torque,
        )

    def _energies(self, linear: Floats, turning: Floats) -> Kinetic:
        rotation = np.sum(kinetic_energy(turning, np.einsum("nij,nj->ni", self.inverse, turning)))
        return Kinetic(0.5 * float(np.sum(linear**2 / self.mass[:, None])), float(rotation))


def rigid_motion(owners: Ints, masses: Floats, positions: Floats, velocities: Floats, forces: Floats) -> Motion:
    """The rigid motion of points (n, 3) in space; owners: the molecule of each point, rising from 0.

    P = Σ m v, L = Σ m (r - R) x v, I = Σ m (d² 1 - d dᵀ), F = Σ f, N = Σ (r - R) x f; internal forces of constraint drop out.
    """
    mass = np.bincount(owners, masses).astype(np.float64)
    lever = positions - centres(owners, masses, positions)[owners]
    second = _sums(owners, (masses[:, None, None] * lever[:, :, None] * lever[:, None, :]).reshape(-1, 9))
    second = second.reshape(-1, 3, 3)
    inertia = np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second
    momenta = masses[:, None] * velocities
    return Motion(
        mass,
        _sums(owners, momenta),
        _sums(owners, np.cross(lever, momenta)),
        inertia,
        _sums(owners, forces),
        _sums(owners, np.cross(lever, forces)),
    )


def centres(owners: Ints, masses: Floats, positions: Floats) -> Floats:
    """Centres of mass (molecules, 3) of points (n, 3)."""
    return np.asarray(_sums(owners, masses[:, None] * positions) / np.bincount(owners, masses)[:, None])


def _sums(owners: Ints, rows: Floats) -> Floats:
    return np.stack([np.bincount(owners, column) for column in rows.T], axis=-1)


def point_velocities(motion: Motion, owners: Ints, masses: Floats, positions: Floats) -> Floats:
    """Velocities V + ω x d (n, 3), Å √(eV/u), of points that move with their molecules; arguments as of `rigid_motion`."""
    omega = np.einsum("nij,nj->ni", motion.inverse, motion.angular_momentum)
    lever = positions - centres(owners, masses, positions)[owners]
    return np.asarray((motion.momentum / motion.mass[:, None])[owners] + np.cross(omega[owners], lever))


@dataclass(frozen=True)
class Frame:
    """The data of an engine at a step.

    positions: (atoms, 3) of the real atoms, molecules whole and not folded into the cell. motion: on the step, unless
    `half` says that the engine's velocities are those between steps. potential_ev; thermostat_ev: its share of the
    conserved quantity; pressure_bar.
    """

    step: int
    positions: Floats
    motion: Motion
    potential_ev: float
    thermostat_ev: float = 0.0
    pressure_bar: float = float("nan")
    half: bool = False


def make_engine_input(atoms: Any, settings: Settings) -> EngineInput:
    """The input of an engine from an ASE box: each molecule is replaced by its model, superposed on its atoms.

    Velocities are the rigid part of those of the box; a box without velocities gets thermal ones at the temperature of the settings,
    without total momentum. Raises ValueError for a cell that is not rectangular and periodic, a cutoff beyond half of
    its shortest edge, atoms in another order than in the models, and molecules that deviate from their model or overlap.
    """
    edges = _edges(atoms, settings.cutoff_angstrom)
    models = find_models(settings.model)
    labels = model_labels(atoms, models)
    bodies, pose = rigid_bodies(atoms, labels, model_shapes(models))
    check_apart(atoms, bodies)
    by_symbols = {model.symbols: model for model in models}
    heads = [int(np.argmax(bodies.species == number)) for number in range(len(bodies.names))]
    spans = [slice(bodies.starts[body], bodies.starts[body + 1]) for body in heads]
    species = tuple(Species(by_symbols[tuple(atoms.symbols[span])], bodies.masses[span]) for span in spans)
    body_axes = [
        superpose(kind.model.positions_angstrom[: len(kind.masses)], bodies.sites[span], kind.masses).apply(
            kind.model.positions_angstrom
        )
        for kind, span in zip(species, spans, strict=True)
    ]
    removed = settings.removed_degrees
    motion = _starting_motion(atoms, bodies, pose, settings, removed)
    places, speeds = _sites(bodies, pose, body_axes, *motion)
    return EngineInput(species, bodies.species, places, speeds, edges, bodies.degrees(removed))


def _edges(atoms: Any, cutoff_angstrom: float) -> Floats:
    cell = np.asarray(atoms.cell)
    edges = np.diag(cell)
    if not (np.all(atoms.pbc) and np.allclose(cell, np.diag(edges)) and np.all(edges > 0)):
        raise ValueError(
            "the engines need a rectangular cell that is periodic in all directions; give the box such a cell"
        )
    if 2 * cutoff_angstrom > edges.min():
        raise ValueError(
            f"a cutoff of {cutoff_angstrom:g} Å in a cell of {edges.min():g} Å: expected at most half of the cell"
        )
    return edges


def _starting_motion(atoms: Any, bodies: Bodies, pose: Pose, settings: Settings, removed: int) -> tuple[Floats, Floats]:
    """Momenta and angular momenta (body axes) of the box, or thermal ones, as in `rotor.fluids.run.make_dynamics`."""
    if atoms.get_momenta().any():
        momentum, angular = bodies.wrench(bodies.masses[:, None] * atoms.get_velocities(), pose.attitude)
        return (at_rest(bodies, momentum) if removed else momentum), angular
    velocities, _ = np.random.default_rng(settings.seed).spawn(2)
    return thermal_momenta(bodies, settings.temperature_k, velocities, removed=3)


def _sites(
    bodies: Bodies, pose: Pose, body_axes: list[Floats], momentum: Floats, angular: Floats
) -> tuple[Floats, Floats]:
    """Positions and velocities of all sites, (sites, 3), from the shapes in principal axes (one array per species)."""
    owners = np.repeat(np.arange(len(bodies)), [len(body_axes[k]) for k in bodies.species])
    body = np.concatenate([body_axes[k] for k in bodies.species])
    lever = rotate(pose.attitude[owners], body)
    omega = rotate(pose.attitude, angular * bodies.inverse_moments)
    return pose.centres[owners] + lever, (momentum / bodies.mass[:, None])[owners] + np.cross(omega[owners], lever)
