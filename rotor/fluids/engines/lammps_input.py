"""The files that LAMMPS reads: atoms with molecules, the pair potential, rigid bodies, an ensemble.

Massless sites get MASSLESS_U, which changes mass and moments of a body by a few parts in 10¹¹. All bonds of a molecule go to its first
site and have no energy; they only mark pairs within a molecule. LAMMPS has no reaction field: the potential of charges with a cutoff,
including Lennard-Jones, is passed as a table. Units: metal (eV, Å, ps).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.arrays import Floats, Ints
from rotor.fluids.engines.engine_input import EngineInput
from rotor.fluids.engines.pair_tables import Form, pair_energy
from rotor.fluids.forces.interactions import mixed
from rotor.fluids.forces.models import Site
from rotor.fluids.settings import Settings

MASSLESS_U = 1e-10
TABLE_POINTS, TABLE_FROM_ANGSTROM = 20_000, 0.6


@dataclass(frozen=True)
class SiteTypes:
    """LAMMPS' atom types: sites that differ in mass, charge, Lennard-Jones parameters, or in being a single atom.

    sites, masses: of the types. by_species: for each species the types of its sites, numbered from 1.
    """

    sites: tuple[Site, ...]
    masses: Floats
    by_species: tuple[Ints, ...]


def site_types(engine_input: EngineInput) -> SiteTypes:
    """The site types of an engine's input."""
    number_of_type: dict[tuple[float, ...], int] = {}
    sites, masses, by_species = [], [], []
    for kind in engine_input.species:
        numbers = []
        for k, site in enumerate(kind.model.sites):
            mass = float(kind.masses[k]) if k < len(kind.masses) else MASSLESS_U
            key = (mass, site.charge_e, site.sigma_angstrom, site.epsilon_k, len(kind.model.sites) == 1)
            if key not in number_of_type:
                number_of_type[key] = len(number_of_type) + 1
                sites.append(site)
                masses.append(mass)
            numbers.append(number_of_type[key])
        by_species.append(np.array(numbers))
    return SiteTypes(tuple(sites), np.array(masses), tuple(by_species))


def data_file(engine_input: EngineInput) -> str:
    """Atoms, velocities and bonds of a box (`read_data`, atom_style full)."""
    site_kinds = site_types(engine_input)
    within = np.arange(len(engine_input.site_masses)) - engine_input.first_sites[engine_input.site_molecule]
    types = np.concatenate([site_kinds.by_species[k] for k in engine_input.kinds])
    charges = np.array([site.charge_e for site in site_kinds.sites])[types - 1]
    bonded = np.flatnonzero(within)
    most = int(engine_input.sites_per_kind.max())
    lines = ["a box of rigid molecules", "", f"{len(types)} atoms", f"{len(site_kinds.sites)} atom types"]
    if len(bonded):
        lines += [
            f"{len(bonded)} bonds",
            "1 bond types",
            f"{most} extra bond per atom",
            f"{most} extra special per atom",
        ]
    lines += ["", *(f"0 {edge:.17g} {axis}lo {axis}hi" for edge, axis in zip(engine_input.edges, "xyz", strict=True))]
    lines += _section("Masses", [(m,) for m in site_kinds.masses])
    columns = zip(engine_input.site_molecule + 1, types, charges, *engine_input.site_positions.T, strict=True)
    lines += _section("Atoms # full", columns)
    lines += _section("Velocities", engine_input.site_velocities / units.ASE_TIME_PS)
    if len(bonded):
        first = engine_input.first_sites[engine_input.site_molecule[bonded]]
        lines += _section("Bonds", [(1, int(i) + 1, int(j) + 1) for i, j in zip(first, bonded, strict=True)])
    return "\n".join(lines) + "\n"


def _section(name: str, rows: Iterable[Iterable[float]]) -> list[str]:
    """A section of a data file, its rows numbered from 1."""
    numbered = enumerate(rows, 1)
    return ["", name, "", *(f"{k} " + " ".join(f"{value:.17g}" for value in row) for k, row in numbered)]


def _pairs(engine_input: EngineInput) -> list[tuple[int, int, tuple[Site, Site]]]:
    """All pairs of types with their sites."""
    sites = site_types(engine_input).sites
    return [(i + 1, j + 1, (sites[i], sites[j])) for i in range(len(sites)) for j in range(i, len(sites))]


def table_file(engine_input: EngineInput, settings: Settings, form: Form) -> str:
    """The table of every pair of types (`pair_style table`), equal steps in r²."""
    r = np.sqrt(np.linspace(TABLE_FROM_ANGSTROM**2, settings.cutoff_angstrom**2, TABLE_POINTS))
    parts = []
    for i, j, sites in _pairs(engine_input):
        energy, force = pair_energy(r, sites, settings, form)
        rows = _section(f"PAIR_{i}_{j}", zip(r, energy, force, strict=True))
        rows[2] = f"N {TABLE_POINTS} RSQ {r[0]:.17g} {r[-1]:.17g}\n"
        parts += rows
    return "\n".join(parts) + "\n"


def pair_commands(engine_input: EngineInput, settings: Settings, form: Form, accuracy: float, kspace: str) -> list[str]:
    """The pair style with its coefficients; arguments as of `input_file`."""
    pairs, cutoff = _pairs(engine_input), settings.cutoff_angstrom
    charged = any(site.charge_e for kind in engine_input.species for site in kind.model.sites)
    if charged and settings.electrostatics != "ewald":
        style = [f"pair_style table spline {TABLE_POINTS}"]
        return style + [f"pair_coeff {i} {j} pairs.table PAIR_{i}_{j} {cutoff:.17g}" for i, j, _ in pairs]
    if form.switch_angstrom:
        lennard_jones, name = f"lj/mdf {cutoff - form.switch_angstrom:.17g} {cutoff:.17g}", "lj/mdf"
    else:
        lennard_jones, name = f"lj/cut {cutoff:.17g}", "lj/cut"
    if not charged:
        return [f"pair_style {lennard_jones}", *(f"pair_coeff {i} {j} {_depth(sites)}" for i, j, sites in pairs)]
    commands = [f"pair_style hybrid/overlay {lennard_jones} coul/long {cutoff:.17g}"]
    commands += [f"pair_coeff {i} {j} {name} {_depth(sites)}" for i, j, sites in pairs]
    return [*commands, "pair_coeff * * coul/long", f"kspace_style {kspace} {accuracy:g}"]


def _depth(sites: tuple[Site, Site]) -> str:
    """ε in eV and σ in Å of two sites."""
    first, other = sites
    sigma, epsilon = mixed((first.sigma_angstrom, other.sigma_angstrom), (first.epsilon_ev, other.epsilon_ev))
    return f"{epsilon:.17g} {sigma or 1.0:.17g}"


def ensemble_commands(engine_input: EngineInput, settings: Settings) -> list[str]:
    """Fixes that move the bodies, and the single atoms where there are some."""
    if settings.ensemble == "nose-hoover":
        raise ValueError(
            "nose-hoover: LAMMPS' chains for rigid bodies hold translations and rotations apart and count the total momentum, "
            "which stays at 0: translations would be too warm by N/(N - 1); use langevin, or OpenMM"
        )
    single, bodies = engine_input.sites_per_kind == 1, engine_input.sites_per_kind > 1
    bath = f"{settings.temperature_k:.17g} {settings.temperature_k:.17g} {1 / settings.friction_per_ps:.17g}"
    noise = settings.ensemble == "langevin"
    commands = []
    if bodies.any():
        commands += [f"group bodies type {_types(engine_input, bodies)}", "fix move bodies rigid/nve/small molecule"]
        commands[-1] += f" langevin {bath} {settings.seed}" if noise else ""
    if single.any():
        commands += [f"group single type {_types(engine_input, single)}", "fix move_single single nve"]
        commands += [f"fix bath single langevin {bath} {settings.seed + 1}"] if noise else []
    return commands


def _types(engine_input: EngineInput, chosen: NDArray[np.bool_]) -> str:
    """Types of the chosen species."""
    numbers = np.concatenate([site_types(engine_input).by_species[k] for k in np.flatnonzero(chosen)])
    return " ".join(map(str, np.unique(numbers)))


def input_file(
    engine_input: EngineInput, settings: Settings, form: Form, *, accuracy: float = 1e-5, kspace: str = "pppm"
) -> str:
    """The commands before the run; they read the files data.box and pairs.table beside them.

    form: of the charges under a cutoff. accuracy, kspace: relative error of the forces of Ewald's sum, and LAMMPS' name of its solver.
    """
    bonded = bool(np.any(engine_input.sites_per_kind > 1))
    lines = ["units metal", "atom_style full", "boundary p p p"]
    lines += ["bond_style zero nocoeff", "special_bonds lj/coul 0 0 0"] if bonded else []
    lines += ["read_data data.box", *(["bond_coeff *"] if bonded else [])]
    lines += pair_commands(engine_input, settings, form, accuracy, kspace)
    lines += ["neighbor 1.5 bin", "neigh_modify delay 0 every 1 check yes", f"timestep {settings.step_fs / 1000:.17g}"]
    lines += ensemble_commands(engine_input, settings)
    lines += [f"thermo {settings.every}", "thermo_style custom step pe press ecouple", "thermo_modify norm no"]
    return "\n".join(lines) + "\n"
