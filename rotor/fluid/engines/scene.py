"""What an engine is handed: whole rigid molecules with all sites placed, their masses, motion and cell; and what it gives back.

Lengths are Å, masses u, energies eV, and velocities those of ASE's set, Å √(eV/u): ½ m v² is in eV.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.fluid.models import RigidModel, model_of
from rotor.fluid.settings import Settings
from rotor.rotations import Array
from rotor.superpose import superpose

FAR_ANGSTROM = 0.1  # rms distance of a molecule's atoms from their model beyond which it is another molecule

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Scene:
    """Rigid molecules in a rectangular periodic cell.

    models: one of each kind. kinds: (molecules,) which model each molecule is. masses: for each model the masses of its
    real atoms. site_positions, site_velocities: (sites, 3) of all sites, molecule by molecule, real atoms first, with
    molecules whole. edges: (3,) of the cell.
    """

    models: tuple[RigidModel, ...]
    kinds: Ints
    masses: tuple[Array, ...]
    site_positions: Array
    site_velocities: Array
    edges: Array

    @cached_property
    def molecule_of_site(self) -> Ints:
        """(sites,) the molecule that a site belongs to."""
        return np.repeat(np.arange(len(self.kinds)), [len(self.models[k].sites) for k in self.kinds])

    @cached_property
    def site_masses(self) -> Array:
        """(sites,) 0 for sites without mass."""
        padded = [np.pad(m, (0, len(model.sites) - len(m))) for m, model in zip(self.masses, self.models, strict=True)]
        return np.concatenate([padded[k] for k in self.kinds])

    @cached_property
    def real(self) -> Ints:
        """(atoms,) which sites are the real atoms, in the order of the box."""
        return np.flatnonzero(self.site_masses)

    @cached_property
    def first_sites(self) -> Ints:
        """(molecules,) index of the first site of each molecule."""
        return np.searchsorted(self.molecule_of_site, np.arange(len(self.kinds)))

    @cached_property
    def linear(self) -> NDArray[np.bool_]:
        """(models,) whether a model's masses stand on a line: five degrees of freedom instead of six."""
        return np.array([_rank(m, model) == 1 for m, model in zip(self.masses, self.models, strict=True)])

    @cached_property
    def rotational_degrees(self) -> int:
        """3 for a molecule, 2 for a linear one, 0 for an atom."""
        ranks = np.array([_rank(m, model) for m, model in zip(self.masses, self.models, strict=True)])
        return int(np.array([0, 2, 3, 3])[ranks][self.kinds].sum())

    def translational_degrees(self, settings: Settings) -> int:
        """3 for each molecule, less the 3 of the total momentum where the ensemble keeps it."""
        return 3 * len(self.kinds) - (0 if settings.ensemble == "langevin" else 3)


def _rank(masses: Array, model: RigidModel) -> int:
    """Dimensions that the masses of a model span: 0 an atom, 1 a line, 2 a plane, 3 space."""
    places = model.positions_angstrom[: len(masses)]
    return int(np.linalg.matrix_rank(places - places[0], tol=1e-6))


@dataclass(frozen=True)
class Motion:
    """The rigid motion of molecules, with what acts on them.

    mass: (n,). momentum: (n, 3) M V. angular_momentum: (n, 3) about the centres. inertia: (n, 3, 3) in space. force,
    torque: (n, 3) about the centres.
    """

    mass: Array
    momentum: Array
    angular_momentum: Array
    inertia: Array
    force: Array
    torque: Array

    def kinetic(self) -> tuple[float, float]:
        """Energies of translation and rotation, Σ P²/2M and Σ ½ L·I⁻¹L."""
        translation = 0.5 * np.sum(self.momentum**2 / self.mass[:, None])
        return float(translation), 0.5 * _quadratic(self.inertia, self.angular_momentum)

    def kicks(self) -> tuple[float, float]:
        """Σ F²/2M and Σ ½ N·I⁻¹N: times h²/4, how much half-step energies are above full-step ones in the mean."""
        return 0.5 * float(np.sum(self.force**2 / self.mass[:, None])), 0.5 * _quadratic(self.inertia, self.torque)

    def kicked(self, time: float) -> Motion:
        """The motion after the forces have acted for a time (Å √(u/eV)) on bodies that stand still."""
        return Motion(
            self.mass,
            self.momentum + time * self.force,
            self.angular_momentum + time * self.torque,
            self.inertia,
            self.force,
            self.torque,
        )


def _quadratic(inertia: Array, vectors: Array) -> float:
    """Σ v·I⁺v; of a linear molecule's tensor only the part across its axis is inverted, of an atom's nothing."""
    return float(np.einsum("ni,nij,nj", vectors, np.linalg.pinv(inertia, rcond=1e-9, hermitian=True), vectors))


def rigid_motion(owners: Ints, masses: Array, positions: Array, velocities: Array, forces: Array) -> Motion:
    """The rigid motion of points (n, 3) with masses (n,), point i of molecule owners[i] (rising from 0).

    P = Σ m v, L = Σ m (r - R) x v, I = Σ m (d² 1 - d dᵀ), F = Σ f, N = Σ (r - R) x f: what internal forces of constraint
    do drops out.
    """
    n = int(owners[-1]) + 1

    def total(rows: Array) -> Array:
        return np.stack([np.bincount(owners, column, n) for column in rows.T], axis=-1)

    mass = np.bincount(owners, masses, n)
    lever = positions - (total(masses[:, None] * positions) / mass[:, None])[owners]
    second = total((masses[:, None, None] * lever[:, :, None] * lever[:, None, :]).reshape(-1, 9)).reshape(n, 3, 3)
    inertia = np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second
    momenta = masses[:, None] * velocities
    return Motion(
        mass, total(momenta), total(np.cross(lever, momenta)), inertia, total(forces), total(np.cross(lever, forces))
    )


def point_velocities(motion: Motion, owners: Ints, masses: Array, positions: Array) -> Array:
    """Velocities V + ω x d of points that move with their molecules."""
    centres = np.stack([np.bincount(owners, masses * x) for x in positions.T], axis=-1) / motion.mass[:, None]
    inverse = np.linalg.pinv(motion.inertia, rcond=1e-9, hermitian=True)
    omega = np.einsum("nij,nj->ni", inverse, motion.angular_momentum)
    velocity = motion.momentum / motion.mass[:, None]
    return np.asarray(velocity[owners] + np.cross(omega[owners], positions - centres[owners]))


@dataclass(frozen=True)
class Frame:
    """What an engine gives at one step.

    positions: (atoms, 3) of the real atoms, molecules whole and not folded into the cell. motion: on the step, unless
    `half` says that the engine's velocities are those between steps. potential_ev; thermostat_ev: its share of the
    conserved quantity; pressure_bar.
    """

    step: int
    positions: Array
    motion: Motion
    potential_ev: float
    thermostat_ev: float = 0.0
    pressure_bar: float = float("nan")
    half: bool = False


def scene_of(atoms: Any, settings: Settings) -> Scene:
    """The scene of an ASE box: each molecule replaced by its model, laid onto its atoms.

    Raises ValueError for a cell that is not rectangular and periodic, a cutoff beyond half of its shortest edge, atoms
    in another order than the models have, and molecules whose shape is not that of their model within 0.1 Å rms.
    """
    edges = _edges(atoms, settings.cutoff_angstrom)
    models = tuple(model_of(name.strip()) for name in settings.model.split(","))
    kinds = molecules_in(atoms.get_chemical_symbols(), models)
    masses = tuple(_masses(atoms, models, kinds, k) for k in range(len(models)))
    places = _placed(atoms.get_positions(), models, kinds, masses, edges)
    still = Scene(models, kinds, masses, places, np.zeros_like(places), edges)
    return Scene(models, kinds, masses, places, _velocities(atoms, still, settings), edges)


def _edges(atoms: Any, cutoff_angstrom: float) -> Array:
    cell = np.asarray(atoms.cell)
    if not (np.all(atoms.pbc) and np.allclose(cell, np.diag(np.diag(cell))) and np.all(np.diag(cell) > 0)):
        raise ValueError("the engines are handed a rectangular cell that is periodic in all directions; give the box one")
    edges = np.diag(cell)
    if 2 * cutoff_angstrom > edges.min():
        raise ValueError(f"a cutoff of {cutoff_angstrom:g} Å in a cell of {edges.min():g} Å: at most half of it will do")
    return edges


def molecules_in(symbols: list[str], models: tuple[RigidModel, ...]) -> Ints:
    """Which model each molecule is, read in the order of the box.

    >>> molecules_in(["O", "H", "H", "O", "H", "H"], (model_of("spce"),)).tolist()
    [0, 0]
    """
    kinds, at = [], 0
    by_length = sorted(range(len(models)), key=lambda k: -len(models[k].symbols))
    while at < len(symbols):
        fits = [k for k in by_length if tuple(symbols[at : at + len(models[k].symbols)]) == models[k].symbols]
        if not fits:
            orders = " or ".join("".join(model.symbols) for model in models)
            raise ValueError(f"atom {at + 1} of the box is {symbols[at]}: molecules are wanted as {orders}, one by one")
        kinds.append(fits[0])
        at += len(models[fits[0]].symbols)
    return np.array(kinds, dtype=np.int64)


def _masses(atoms: Any, models: tuple[RigidModel, ...], kinds: Ints, kind: int) -> Array:
    """Masses of a model's real atoms: those that the box was given, else of the most abundant isotopes."""
    from rotor.molecules.nuclei import isotope

    if not atoms.has("masses"):
        return np.array([isotope(symbol).mass_u for symbol in models[kind].symbols])
    lengths = np.array([len(model.symbols) for model in models])[kinds]
    first = (np.cumsum(lengths) - lengths)[kinds == kind]
    return np.asarray(atoms.get_masses()[first[0] : first[0] + len(models[kind].symbols)])


def _placed(
    positions: Array, models: tuple[RigidModel, ...], kinds: Ints, masses: tuple[Array, ...], edges: Array
) -> Array:
    """All sites, (sites, 3): every model laid onto its atoms, which the cell may have taken apart."""
    lengths = np.array([len(model.symbols) for model in models])[kinds]
    sites = np.array([len(model.sites) for model in models])[kinds]
    from_atom, to_site = np.cumsum(lengths) - lengths, np.cumsum(sites) - sites
    placed = np.empty((int(sites.sum()), 3))
    for kind, model in enumerate(models):
        mine = np.flatnonzero(kinds == kind)
        if not len(mine):
            continue
        atoms = positions[from_atom[mine, None] + np.arange(len(model.symbols))]
        whole = atoms - edges * np.round((atoms - atoms[:, :1]) / edges)
        fit = superpose(np.broadcast_to(model.positions_angstrom[: len(model.symbols)], whole.shape), whole, masses[kind])
        if np.max(fit.rmsd) > FAR_ANGSTROM:
            worst = int(np.argmax(fit.rmsd))
            raise ValueError(
                f"molecule {mine[worst] + 1} of the box is {fit.rmsd[worst]:.2g} Å away from the shape of {model.name}; "
                f"at most {FAR_ANGSTROM} Å is taken for the same molecule"
            )
        placed[to_site[mine, None] + np.arange(len(model.sites))] = fit.apply(model.positions_angstrom)
    return placed


def _velocities(atoms: Any, scene: Scene, settings: Settings) -> Array:
    """Velocities (sites, 3): the rigid part of those of the box, else thermal ones without total momentum."""
    owners, masses, places = scene.molecule_of_site, scene.site_masses, scene.site_positions
    given = np.zeros_like(places)
    if atoms.has("momenta") and np.any(atoms.get_momenta()):
        given[scene.real] = atoms.get_velocities()
        return point_velocities(rigid_motion(owners, masses, places, given, given), owners, masses, places)
    return thermal_velocities(scene, settings.temperature_k, np.random.default_rng(settings.seed))


def thermal_velocities(scene: Scene, temperature_k: float, rng: np.random.Generator) -> Array:
    """Site velocities (sites, 3) of Maxwell and Boltzmann's distribution of P and L, the total momentum taken out."""
    from rotor.units import EV_PER_K

    owners, masses, places = scene.molecule_of_site, scene.site_masses, scene.site_positions
    zero = np.zeros_like(places)
    still = rigid_motion(owners, masses, places, zero, zero)
    size = np.sqrt(EV_PER_K * temperature_k)
    momentum = size * np.sqrt(still.mass)[:, None] * rng.normal(size=(len(still.mass), 3))
    momentum -= still.mass[:, None] * momentum.sum(axis=0) / still.mass.sum()
    values, axes = np.linalg.eigh(still.inertia)
    along = size * np.sqrt(np.maximum(values, 0.0)) * rng.normal(size=values.shape)
    turning = np.einsum("nij,nj->ni", axes, along)
    thermal = Motion(still.mass, momentum, turning, still.inertia, zero, zero)
    return point_velocities(thermal, owners, masses, places)
