"""Initial boxes: molecules on a lattice, relaxed overlaps, velocities from the canonical ensemble."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.arrays import Floats
from rotor.fluids.forces.assembly import kinds_by_symbols
from rotor.fluids.forces.models import RigidModel
from rotor.fluids.motion.bodies import Bodies
from rotor.geometry import rotations

if TYPE_CHECKING:
    from ase import Atoms

TOO_NEAR_ANGSTROM = 0.5  # atoms of different molecules are never this close
RELAXING_STEPS = 300
RELAXING_FS = 1.0  # half of the usual step: forces of random orientations are larger than those of a liquid
RELAXING_K = 300.0  # temperature of the largest speeds during relaxation


def lattice_box(model: RigidModel, molecules: int, density_g_cm3: float, rng: np.random.Generator) -> Atoms:
    """A cubic periodic box of molecules on a simple cubic lattice with random orientations.

    Parameters
    ----------
    model : RigidModel
        Of the molecules.
    molecules : int
        Number of molecules; the smallest lattice with enough sites is used, with random vacancies.
    density_g_cm3 : float
        Density; determines the edge with the masses of the most abundant isotopes.
    rng : numpy.random.Generator
        Source of the random numbers.

    Returns
    -------
    ase.Atoms
        Molecules are labelled in arrays["molecule"]. Neighbours may be too close: use `relax` first.

    Examples
    --------
    >>> from rotor.fluids.forces.models import find_model
    >>> box = lattice_box(find_model("spce"), 216, 0.997, np.random.default_rng(1))
    >>> len(box), round(float(box.cell[0, 0]), 3)
    (648, 18.643)
    """
    from ase import Atoms

    from rotor.fluids.motion.bodies import atom_masses

    if molecules < 1:
        raise ValueError(f"{molecules} molecules: expected at least 1")
    if not (math.isfinite(density_g_cm3) and density_g_cm3 > 0.0):
        raise ValueError(f"a density of {density_g_cm3} g/cm³: expected a number above 0")
    single = Atoms("".join(model.symbols), model.positions_angstrom[: len(model.symbols)])
    masses = atom_masses(single)
    volume = molecules * masses.sum() * units.ATOMIC_MASS_KG / (density_g_cm3 * 1e-27)  # 1 g/cm³ = 1e-27 kg/Å³
    edge = volume ** (1.0 / 3.0)
    across = math.ceil(round(molecules ** (1.0 / 3.0), 9))
    sites = np.array(list(np.ndindex(across, across, across)))
    chosen = np.sort(rng.choice(len(sites), molecules, replace=False))
    centred = single.positions - masses @ single.positions / masses.sum()
    turned = rotations.rotate(rotations.uniform(molecules, rng=rng)[:, None, :], centred)
    places = (sites[chosen, None, :] + 0.5) * (edge / across) + turned
    box = Atoms(single.get_chemical_symbols() * molecules, places.reshape(-1, 3), cell=[edge] * 3, pbc=True)
    box.arrays["molecule"] = np.repeat(np.arange(molecules), len(single))
    return box


def model_labels(atoms: Atoms, models: Sequence[RigidModel]) -> NDArray[np.int64]:
    """Molecule labels of the atoms of a box with consecutive molecules in the atom order of the models.

    >>> from ase import Atoms
    >>> from rotor.fluids.forces.models import find_model
    >>> model_labels(Atoms("OH2OH2", positions=np.zeros((6, 3))), [find_model("spce")]).tolist()
    [0, 0, 0, 1, 1, 1]
    """
    kinds = kinds_by_symbols(atoms.get_chemical_symbols(), models)
    return np.repeat(np.arange(len(kinds)), [len(models[kind].symbols) for kind in kinds])


def check_apart(atoms: Atoms, bodies: Bodies) -> None:
    """Raise ValueError, with their names, if atoms of two molecules overlap."""
    from ase.neighborlist import neighbor_list

    first, second, distances = neighbor_list("ijd", atoms, TOO_NEAR_ANGSTROM)
    body = np.empty(len(atoms), dtype=np.int64)
    body[bodies.order] = np.repeat(np.arange(len(bodies)), np.diff(bodies.starts))
    between = np.flatnonzero(body[first] != body[second])
    if len(between):
        pair = between[np.argmin(distances[between])]
        name, other = (bodies.name_of(int(body[k])) for k in (first[pair], second[pair]))
        raise ValueError(
            f"{name} and {other} are on top of each other: two of their atoms are {distances[pair]:.3g} Å apart"
        )


def relax(
    atoms: Atoms, steps: int = RELAXING_STEPS, progress: Callable[[int, int, float], None] = lambda *_: None, **how: Any
) -> None:
    """Remove overlaps in place by a quench: a molecule that moves against its force is stopped.

    Steps of 1 fs; speeds are limited to those of 300 K. The result is not an energy minimum, but a valid start of a motion. Momenta are
    discarded. progress: called with step, steps and 0 at the start and after each step. how: as for `RigidDynamics`.
    """
    from ase.units import fs

    from rotor.fluids.motion.dynamics import RigidDynamics

    progress(0, steps, 0.0)
    atoms.set_momenta(np.zeros((len(atoms), 3)))
    dynamics = RigidDynamics(atoms, RELAXING_FS * fs, **{**how, "removed": 0})
    bodies, state = dynamics.bodies, dynamics.state
    kt = RELAXING_K * units.EV_PER_K
    fastest, widest = np.sqrt(bodies.mass * kt)[:, None], np.sqrt(bodies.moments * kt)
    for step in range(1, steps + 1):
        dynamics.step()
        dynamics.nsteps += 1
        force, torque = dynamics.wrench()
        # a motion against its force climbs out of a minimum: it is stopped there, so that the energy falls in all further steps
        against = np.sum(force * state.momentum, axis=1) < 0.0
        state.momentum[against] = 0.0
        back = np.sum(torque * state.angular * bodies.inverse_moments, axis=1) < 0.0
        state.spin[back, :3] = 0.0
        state.carry[back, :3] = 0.0
        np.clip(state.momentum, -fastest, fastest, out=state.momentum)
        state.spin[:, :3] = np.clip(state.angular, -widest, widest)
        dynamics.write_momenta()
        progress(step, steps, 0.0)
    atoms.set_momenta(np.zeros((len(atoms), 3)))


def thermal_momenta(
    bodies: Bodies, temperature_k: float, rng: np.random.Generator, removed: int = 0
) -> tuple[Floats, Floats]:
    """Momenta of rigid molecules drawn from the canonical ensemble, in ASE's units.

    Parameters
    ----------
    bodies : Bodies
        The molecules.
    temperature_k : float
        Temperature.
    rng : numpy.random.Generator
        Source of the random numbers.
    removed : int
        3 removes the total momentum, in proportion to the masses; the result is the canonical ensemble with 3 degrees fewer,
        without rescaling.

    Returns
    -------
    (n, 3) array, (n, 3) array
        p in space and L in body axes, normal with variances m kT and I_i kT (`rotor.classical.gas.ensembles`).
    """
    from rotor.classical.gas import ensembles

    kt = temperature_k * units.EV_PER_K
    momentum = rng.standard_normal((len(bodies), 3)) * np.sqrt(bodies.mass * kt)[:, None]
    angular = np.zeros((len(bodies), 3))
    for species in range(len(bodies.names)):
        members = np.flatnonzero(bodies.species == species)
        angular[members] = ensembles.thermal_momenta(bodies.moments[members[0]], kt, len(members), rng=rng)
    return (at_rest(bodies, momentum) if removed else momentum), angular


def at_rest(bodies: Bodies, momentum: Floats) -> Floats:
    """Momenta (n, 3) without the total momentum, which is removed in proportion to the masses."""
    return np.asarray(momentum - np.outer(bodies.mass / bodies.mass.sum(), momentum.sum(axis=0)))


def heat(atoms: Atoms, bodies: Bodies, attitude: Floats, temperature_k: float, rng: np.random.Generator) -> None:
    """Give the atoms thermal momenta of rigid molecules, the total momentum removed, in place; attitude: (n, 4), of the bodies."""
    momentum, angular = thermal_momenta(bodies, temperature_k, rng, removed=3)
    atoms.set_masses(bodies.masses)
    atoms.set_momenta(bodies.momenta(momentum, angular, attitude))
