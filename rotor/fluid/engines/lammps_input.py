"""The files that LAMMPS reads: atoms with molecules, the pair potential as table or closed form, rigid bodies, an ensemble.

Sites without mass get MASSLESS_U, so that a body's mass and moments are the molecule's to a few parts in 10¹¹. All bonds of a
molecule go to its first site and do nothing: they only say which pairs lie in one molecule. LAMMPS has no reaction field;
its pair potential is handed over as a table, Lennard-Jones and charges together. Units: metal (eV, Å, ps).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotor import units
from rotor.fluid.engines.scene import Ints, Scene
from rotor.fluid.settings import Settings
from rotor.rotations import Array

MASSLESS_U = 1e-10
COULOMB_EV_ANGSTROM = units.ELEMENTARY_CHARGE_C * 1e10 / (4 * np.pi * units.VACUUM_PERMITTIVITY_F_PER_M)
TABLE_POINTS, TABLE_FROM_ANGSTROM = 20_000, 0.6


@dataclass(frozen=True)
class SiteTypes:
    """The sites of all models as LAMMPS' atom types, numbered from 1: (types,) arrays; first: of each model."""

    mass: Array
    charge: Array
    sigma: Array
    epsilon: Array
    first: Ints


def site_types(scene: Scene) -> SiteTypes:
    """One type for each site of each model."""
    sites = [site for one in scene.species for site in one.model.sites]
    light = [[MASSLESS_U] * (len(one.model.sites) - len(one.masses)) for one in scene.species]
    mass = [m for one, rest in zip(scene.species, light, strict=True) for m in [*one.masses, *rest]]
    lengths = scene.sites_of_kinds
    return SiteTypes(
        np.array(mass),
        np.array([site.charge_e for site in sites]),
        np.array([site.sigma_angstrom for site in sites]),
        np.array([site.epsilon_ev for site in sites]),
        np.cumsum(lengths) - lengths + 1,
    )


def data_file(scene: Scene) -> str:
    """Atoms, velocities and bonds of a scene (`read_data`, atom_style full)."""
    types = site_types(scene)
    lengths = scene.sites_of_kinds[scene.kinds]
    within = np.arange(len(scene.site_masses)) - scene.first_sites[scene.molecule_of_site]
    type_of = types.first[scene.kinds][scene.molecule_of_site] + within
    second = np.flatnonzero(within)
    speed = scene.site_velocities / units.CLASSICAL_TIME_PS
    lines = ["a box of rigid molecules", "", f"{len(type_of)} atoms", f"{len(types.mass)} atom types"]
    if len(second):
        lines += [f"{len(second)} bonds", "1 bond types", f"{max(2, int(lengths.max()) - 1)} extra bond per atom"]
        lines += [f"{max(2, int(lengths.max()))} extra special per atom"]
    lines += ["", *(f"0 {edge:.17g} {axis}lo {axis}hi" for edge, axis in zip(scene.edges, "xyz", strict=True))]
    lines += ["", "Masses", "", *(f"{k + 1} {m:.17g}" for k, m in enumerate(types.mass)), "", "Atoms # full", ""]
    rows = zip(scene.molecule_of_site + 1, type_of, types.charge[type_of - 1], scene.site_positions, strict=True)
    lines += [f"{k} {m} {t} {q:.17g} {x:.17g} {y:.17g} {z:.17g}" for k, (m, t, q, (x, y, z)) in enumerate(rows, 1)]
    lines += ["", "Velocities", "", *(f"{k} {x:.17g} {y:.17g} {z:.17g}" for k, (x, y, z) in enumerate(speed, 1))]
    if len(second):
        first = scene.first_sites[scene.molecule_of_site[second]]
        lines += ["", "Bonds", ""]
        lines += [f"{k} 1 {i + 1} {j + 1}" for k, (i, j) in enumerate(zip(first, second, strict=True), 1)]
    return "\n".join(lines) + "\n"


def mixed(types: SiteTypes) -> tuple[Array, Array]:
    """σ and ε of all pairs by Lorentz and Berthelot, (types, types)."""
    return 0.5 * (types.sigma[:, None] + types.sigma), np.sqrt(types.epsilon[:, None] * types.epsilon)


def pair_energy(
    r: Array, charges: float, sigma: float, epsilon: float, cutoff: float, dielectric: float
) -> tuple[Array, Array]:
    """Energy (eV) and force (eV/Å) of two sites with Lennard-Jones and a reaction field.

    U = 4ε [(σ/r)¹² - (σ/r)⁶] + q₁q₂/4πε₀ (1/r + k r² - c), k = (ε_rf - 1)/(2ε_rf + 1)/r_c³, c = 3ε_rf/(2ε_rf + 1)/r_c
    (I. G. Tironi et al., J. Chem. Phys. 102, 5451 (1995), eq. 17, shifted to 0 at r_c); dielectric may be infinite.
    """
    share = 1.0 / dielectric
    k = (1 - share) / (2 + share) / cutoff**3
    c = 3 / (2 + share) / cutoff
    sixth = (sigma / r) ** 6
    strength = COULOMB_EV_ANGSTROM * charges
    energy = 4 * epsilon * (sixth**2 - sixth) + strength * (1 / r + k * r**2 - c)
    force = 24 * epsilon * (2 * sixth**2 - sixth) / r + strength * (1 / r**2 - 2 * k * r)
    return energy, force


def table_file(scene: Scene, settings: Settings, dielectric: float) -> str:
    """The table of every pair of types (`pair_style table`), equal steps in r²."""
    types = site_types(scene)
    sigma, epsilon = mixed(types)
    r = np.sqrt(np.linspace(TABLE_FROM_ANGSTROM**2, settings.cutoff_angstrom**2, TABLE_POINTS))
    parts = []
    for i in range(len(types.mass)):
        for j in range(i, len(types.mass)):
            energy, force = pair_energy(
                r, types.charge[i] * types.charge[j], sigma[i, j], epsilon[i, j], settings.cutoff_angstrom, dielectric
            )
            ends = f"N {TABLE_POINTS} RSQ {r[0]:.17g} {r[-1]:.17g}"
            rows = (
                f"{k} {x:.17g} {u:.17g} {f:.17g}" for k, (x, u, f) in enumerate(zip(r, energy, force, strict=True), 1)
            )
            parts.append("\n".join([f"PAIR_{i + 1}_{j + 1}", ends, "", *rows, ""]))
    return "\n".join(parts)


def pair_commands(scene: Scene, settings: Settings, accuracy: float, kspace: str) -> list[str]:
    """The pair style with its coefficients."""
    types, cutoff = site_types(scene), f"{settings.cutoff_angstrom:.17g}"
    pairs = [(i, j) for i in range(len(types.mass)) for j in range(i, len(types.mass))]
    if settings.electrostatics == "reaction-field":
        style = [f"pair_style table spline {TABLE_POINTS}"]
        return style + [f"pair_coeff {i + 1} {j + 1} pairs.table PAIR_{i + 1}_{j + 1} {cutoff}" for i, j in pairs]
    sigma, epsilon = mixed(types)
    coefficients = [f"pair_coeff {i + 1} {j + 1} {epsilon[i, j]:.17g} {sigma[i, j] or 1.0:.17g}" for i, j in pairs]
    if settings.electrostatics == "shifted":
        return [f"pair_style lj/cut/coul/dsf 0.0 {cutoff}", *coefficients, "pair_modify tail yes"]
    charged = bool(np.any(types.charge))
    style = [f"pair_style {'lj/cut/coul/long' if charged else 'lj/cut'} {cutoff}"]
    mesh = [f"kspace_style {kspace} {accuracy:g}"] if charged else []
    return [*style, *coefficients, "pair_modify tail yes", *mesh]


def ensemble_commands(scene: Scene, settings: Settings) -> list[str]:
    """Fixes that move the bodies, and the single atoms where there are some."""
    seed, target = settings.seed, settings.temperature_k
    if settings.ensemble == "nose-hoover":  # its chain counts the total momentum too, which stays at 0
        target *= scene.degrees.total / (scene.degrees.total + scene.degrees.removed)
    temperature = f"{target:.17g} {target:.17g}"
    damping, relaxation = 1 / settings.friction_per_ps, settings.relaxation_fs / 1000
    sizes = scene.sites_of_kinds[scene.kinds]
    single, bodies = bool(np.any(sizes == 1)), bool(np.any(sizes > 1))
    commands = []
    if single and bodies and settings.ensemble == "nose-hoover":
        raise ValueError("LAMMPS has no one Nosé-Hoover chain for molecules and single atoms together; take langevin")
    if bodies:
        first = site_types(scene).first
        kinds = np.flatnonzero(scene.sites_of_kinds > 1)
        ranges = " ".join(f"{first[k]}:{first[k] + scene.sites_of_kinds[k] - 1}" for k in kinds)
        commands.append(f"group bodies type {ranges}")
        style = {
            "nve": "rigid/nve/small molecule",
            "langevin": f"rigid/nve/small molecule langevin {temperature} {damping:.17g} {seed}",
            "nose-hoover": f"rigid/nvt/small molecule temp {temperature} {relaxation:.17g}",
        }[settings.ensemble]
        commands.append(f"fix move bodies {style}")
    if single:
        if bodies:
            commands.append("group single subtract all bodies")
        else:
            commands.append("group single union all")
        if settings.ensemble == "nose-hoover":
            commands.append(f"fix move_single single nvt temp {temperature} {relaxation:.17g}")
        else:
            commands.append("fix move_single single nve")
        if settings.ensemble == "langevin":
            commands.append(f"fix bath single langevin {temperature} {damping:.17g} {seed + 1}")
    return commands


def input_file(scene: Scene, settings: Settings, *, accuracy: float = 1e-5, kspace: str = "pppm") -> str:
    """The commands before the run; files data.box and pairs.table stand beside."""
    bonded = bool(np.any(scene.sites_of_kinds > 1))
    lines = ["units metal", "atom_style full", "boundary p p p"]
    lines += ["bond_style zero nocoeff", "special_bonds lj/coul 0 0 0"] if bonded else []
    lines += ["read_data data.box", *(["bond_coeff *"] if bonded else [])]
    lines += pair_commands(scene, settings, accuracy, kspace)
    lines += ["neighbor 1.5 bin", "neigh_modify delay 0 every 1 check yes", f"timestep {settings.step_fs / 1000:.17g}"]
    lines += ensemble_commands(scene, settings)
    lines += [f"thermo {settings.every}", "thermo_style custom step pe press ecouple", "thermo_modify norm no"]
    return "\n".join(lines) + "\n"
