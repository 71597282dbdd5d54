"""A box in OpenMM: molecules as points with fixed distances, which carry massless sites.

OpenMM's velocities are half a step behind the positions (leapfrog). They are shifted to full steps with the forces, or left at half
steps with a thermostat, which acts there. Units of OpenMM: nm, ps, kJ/mol.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from rotor import units
from rotor.arrays import Floats, Ints
from rotor.fluids.engines.engine_input import EngineInput, Frame, Motion, point_velocities, rigid_motion
from rotor.fluids.engines.equimomental import EquimomentalPoints, equimomental_points
from rotor.fluids.engines.pair_tables import Form, dispersion_tail
from rotor.fluids.settings import Settings
from rotor.units import EV_PER_ANGSTROM3_BAR

KJ_PER_EV = units.ELEMENTARY_CHARGE_C * units.AVOGADRO_PER_MOL * 1e-3
CONDUCTOR = 1e12  # stands for an infinite dielectric constant
NM_PER_PS = 0.1 / units.ASE_TIME_PS  # 1 Å √(eV/u) in nm/ps


@dataclass(frozen=True)
class OpenMMSystem:
    """A box as an OpenMM system.

    system: openmm.System. barostat: part of the system that only measures the pressure.
    massive: (c,) its particles with mass. owners: (c,) their molecules. masses: (c,). atoms:
    (atoms,) its particles that are the real atoms. positions: (particles, 3) Å.
    """

    system: Any
    barostat: Any
    massive: Ints
    owners: Ints
    masses: Floats
    atoms: Ints
    positions: Floats


def load() -> Any:
    """The openmm module; ModuleNotFoundError says what to install."""
    try:
        import openmm
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            'OpenMM is not installed: python -m pip install "molrotor[openmm]"', name="openmm"
        ) from error
    return openmm


def build_system(engine_input: EngineInput, settings: Settings, form: Form, accuracy: float) -> OpenMMSystem:
    """The system of a box: masses, constraints, virtual sites, Lennard-Jones and charges; arguments as of `session`."""
    mm = load()
    system = mm.System()
    a, b, c = engine_input.edges / 10
    system.setDefaultPeriodicBoxVectors(mm.Vec3(a, 0, 0), mm.Vec3(0, b, 0), mm.Vec3(0, 0, c))
    force = nonbonded(mm, settings, form, accuracy)
    plans = [equimomental_points(kind.model, kind.masses) for kind in engine_input.species]
    massive: list[int] = []
    owners: list[int] = []
    atoms: list[int] = []
    positions: list[Floats] = []
    for molecule, kind in enumerate(engine_input.kinds):
        plan, model, first = plans[kind], engine_input.species[kind].model, system.getNumParticles()
        here = engine_input.site_positions[engine_input.first_sites[molecule] :][: len(model.sites)]
        site_at = _add_molecule(mm, system, force, plan, model)
        massive += range(first, first + len(plan.masses))
        owners += [molecule] * len(plan.masses)
        atoms += range(site_at, site_at + len(model.symbols))
        if not plan.are_atoms:
            positions.append(_laid(plan, model.positions_angstrom, here))
        positions.append(here)
    system.addForce(force)
    barostat = mm.MonteCarloBarostat(1.0, settings.temperature_k, 0)  # 0: it never moves anything
    system.addForce(barostat)
    if settings.ensemble == "nose-hoover":
        system.addForce(mm.CMMotionRemover())  # its chain then counts three degrees fewer, as rotor does
    masses = np.concatenate([plans[k].masses for k in engine_input.kinds])
    return OpenMMSystem(
        system, barostat, np.array(massive), np.array(owners), masses, np.array(atoms), np.concatenate(positions)
    )


def nonbonded(mm: Any, settings: Settings, form: Form, accuracy: float) -> Any:
    """The NonbondedForce without its particles; ValueError for electrostatics that OpenMM does not have."""
    force = mm.NonbondedForce()
    force.setCutoffDistance(settings.cutoff_angstrom / 10)
    if settings.electrostatics == "reaction-field":
        force.setNonbondedMethod(mm.NonbondedForce.CutoffPeriodic)
        force.setReactionFieldDielectric(min(form.dielectric, CONDUCTOR))
    elif settings.electrostatics == "ewald":
        force.setNonbondedMethod(mm.NonbondedForce.PME)
        force.setEwaldErrorTolerance(accuracy)
    else:
        raise ValueError(
            f"electrostatics {settings.electrostatics!r}: expected reaction-field or ewald for OpenMM; LAMMPS takes shifted too"
        )
    if form.switch_angstrom:
        force.setUseSwitchingFunction(True)
        force.setSwitchingDistance((settings.cutoff_angstrom - form.switch_angstrom) / 10)
    force.setUseDispersionCorrection(False)
    return force


def _add_molecule(mm: Any, system: Any, force: Any, plan: EquimomentalPoints, model: Any) -> int:
    """Add particles, constraints and exclusions of a molecule; return the index of its first site."""
    first = int(system.getNumParticles())
    for mass in plan.masses:
        system.addParticle(float(mass))
    for i, j in combinations(range(len(plan.masses)), 2):
        system.addConstraint(first + i, first + j, float(np.linalg.norm(plan.places[i] - plan.places[j])) / 10)
    site_at = first if plan.are_atoms else first + len(plan.masses)
    for k, site in enumerate(model.sites):
        if plan.are_atoms and k < len(plan.masses):
            continue
        index = system.addParticle(0.0)
        system.setVirtualSite(index, _virtual_site(mm, plan, first, np.array(site.position_angstrom)))
    if not plan.are_atoms:
        for _ in plan.masses:
            force.addParticle(0.0, 1.0, 0.0)
    for site in model.sites:
        force.addParticle(site.charge_e, (site.sigma_angstrom or 1.0) / 10, site.epsilon_ev * KJ_PER_EV)
    for i, j in combinations(range(site_at, site_at + len(model.sites)), 2):
        force.addException(i, j, 0.0, 0.1, 0.0)
    return site_at


def _virtual_site(mm: Any, plan: EquimomentalPoints, first: int, place: Floats) -> Any:
    """A massless site that follows the points with mass."""
    points = list(range(first, first + len(plan.places)))
    if plan.rank == 3:
        x, y = plan.places[1] - plan.places[0], plan.places[2] - plan.places[0]
        x = x / np.linalg.norm(x)
        z = np.cross(x, y)
        z /= np.linalg.norm(z)
        local = np.array([x, np.cross(z, x), z]) @ (place - plan.places.mean(axis=0)) / 10
        quarter = [0.25] * 4
        return mm.LocalCoordinatesSite(points, quarter, [-1.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 1.0, 0.0], mm.Vec3(*local))
    weights = plan.weights(place).tolist()
    kind = {2: mm.TwoParticleAverageSite, 3: mm.ThreeParticleAverageSite}[len(points)]
    return kind(*points, *weights)


def _laid(plan: EquimomentalPoints, sites: Floats, here: Floats) -> Floats:
    """Positions of the points with mass in the box, from the sites in the axes of the model and in the box."""
    from rotor.geometry.superposition import superpose

    return superpose(sites, here).apply(plan.places)


def integrator(mm: Any, settings: Settings) -> Any:
    """The integrator of an ensemble."""
    step, temperature = settings.step_fs / 1000, settings.temperature_k
    if settings.ensemble == "nve":
        engine_integrator = mm.VerletIntegrator(step)
    elif settings.ensemble == "langevin":
        engine_integrator = mm.LangevinMiddleIntegrator(temperature, settings.friction_per_ps, step)
        engine_integrator.setRandomNumberSeed(settings.seed)
    else:
        engine_integrator = mm.NoseHooverIntegrator(temperature, 1000 / settings.relaxation_fs, step)
    engine_integrator.setConstraintTolerance(1e-7)
    return engine_integrator


@dataclass(frozen=True)
class Session:
    """A box in an OpenMM context, ready to step."""

    context: Any
    build_system: OpenMMSystem
    settings: Settings
    tail: tuple[float, float]
    volume: float

    @property
    def step_classical(self) -> float:
        """The step in Å √(u/eV)."""
        return self.settings.step_fs / 1000 / units.ASE_TIME_PS

    def state(self) -> tuple[Floats, Motion, float]:
        """Positions (particles, 3) Å, motion of the molecules from OpenMM's velocities, potential energy eV."""
        got = self.context.getState(positions=True, velocities=True, forces=True, energy=True)
        mine = self.build_system
        positions = np.asarray(got.getPositions(asNumpy=True)._value) * 10
        velocities = np.asarray(got.getVelocities(asNumpy=True)._value) / NM_PER_PS
        forces = np.asarray(got.getForces(asNumpy=True)._value) / (10 * KJ_PER_EV)
        at = mine.massive
        motion = rigid_motion(mine.owners, mine.masses, positions[at], velocities[at], forces[at])
        return positions, motion, got.getPotentialEnergy()._value / KJ_PER_EV

    def start(self, velocities: Floats) -> None:
        """Set the initial velocities (massive, 3); a leapfrog needs those half a step earlier."""
        mine = self.build_system
        full = np.zeros_like(mine.positions)
        full[mine.massive] = velocities
        self.context.setVelocities(full * NM_PER_PS)
        if self.settings.ensemble == "nve":
            positions, motion, _ = self.state()
            before = motion.kicked(-0.5 * self.step_classical)
            full[mine.massive] = point_velocities(before, mine.owners, mine.masses, positions[mine.massive])
            self.context.setVelocities(full * NM_PER_PS)

    def frame(self, step: int) -> Frame:
        """The current frame."""
        positions, stored, potential = self.state()
        between = self.settings.ensemble != "nve"
        motion = stored if between else stored.kicked(0.5 * self.step_classical)
        bath = 0.0
        if self.settings.ensemble == "nose-hoover" and step:  # OpenMM creates its chain at the first step
            bath = self.context.getIntegrator().computeHeatBathEnergy()._value / KJ_PER_EV
        pressure = self.pressure_bar(stored, motion)
        return Frame(
            step, positions[self.build_system.atoms], motion, potential + self.tail[0], bath, pressure, between
        )

    def pressure_bar(self, stored: Motion, motion: Motion) -> float:
        """OpenMM's molecular pressure, from energies of the scaled box and the motion at full steps.

        Molecules are scaled about their geometric centres instead of their centres of mass; the mean pressure is the same.
        """
        theirs = self.build_system.barostat.computeCurrentPressure(self.context)._value
        kinetic = motion.kinetic().translation_ev - stored.kinetic().translation_ev
        return float(theirs + (2 / 3 * kinetic / self.volume + self.tail[1]) * EV_PER_ANGSTROM3_BAR)


def session(
    engine_input: EngineInput,
    settings: Settings,
    form: Form | None = None,
    *,
    accuracy: float = 1e-5,
    platform: str | None = None,
    threads: int = 1,
) -> Session:
    """A context with the box and its initial motion.

    Parameters
    ----------
    engine_input : EngineInput
        Molecules and cell.
    settings : Settings
        Of the run.
    form : Form, optional
        Of the charges under a cutoff; by default that of the settings.
    accuracy : float
        Of the forces of Ewald's sum (PME), relative.
    platform : str, optional
        "Reference" (double precision), "CPU", "CUDA", ...; by default the fastest that this machine has.
    threads : int
        Of the platform CPU.

    Returns
    -------
    Session
        Ready to step.
    """
    mm, form = load(), form or Form()
    mine = build_system(engine_input, settings, form, accuracy)
    context = _context(mm, mine.system, integrator(mm, settings), platform, threads)
    context.setPositions(mine.positions / 10)
    context.applyConstraints(1e-7)
    context.computeVirtualSites()
    ready = Session(
        context, mine, settings, dispersion_tail(engine_input, settings, form), float(np.prod(engine_input.edges))
    )
    ready.start(point_velocities(engine_input.motion(), mine.owners, mine.masses, mine.positions[mine.massive]))
    return ready


def _context(mm: Any, system: Any, engine_integrator: Any, platform: str | None, threads: int) -> Any:
    """A context; without a given platform, OpenMM's choice (the first one that works) unless that is the CPU."""
    platforms = [mm.Platform.getPlatform(k) for k in range(mm.Platform.getNumPlatforms())]
    chosen = platform or max(platforms, key=lambda candidate: float(candidate.getSpeed())).getName()
    if chosen == "CPU":
        return mm.Context(system, engine_integrator, mm.Platform.getPlatformByName("CPU"), {"Threads": str(threads)})
    if platform is None:
        return mm.Context(system, engine_integrator)
    return mm.Context(system, engine_integrator, mm.Platform.getPlatformByName(platform))


def frames(engine_input: EngineInput, settings: Settings, form: Form | None = None, **options: Any) -> Iterator[Frame]:
    """Run, and give a frame at step 0 and after every `settings.every` steps; arguments as of `session`.

    Raises RuntimeError if OpenMM stops during the run.
    """
    mm = load()
    try:
        run = session(engine_input, settings, form, **options)
        stepper = run.context.getIntegrator()
        yield run.frame(0)
        for step in range(settings.every, settings.steps + 1, settings.every):
            stepper.step(settings.every)
            yield run.frame(step)
    except mm.OpenMMException as error:
        raise RuntimeError(f"OpenMM stopped: {error}") from error
