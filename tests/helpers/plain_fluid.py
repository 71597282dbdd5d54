"""Forces between rigid molecules in the plainest form: all pairs of sites as matrices, nearest images, textbook formulas."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from ase import Atoms
from scipy.special import erf, erfc

from rotor.fluids.forces.ewald import COULOMB_EV_ANGSTROM
from rotor.fluids.forces.models import RigidModel, find_model


def box_of(counts: dict[str, int], edge: float, seed: int = 1, spread: float = 0.1) -> Atoms:
    """Molecules of the named models in a cube, turned at random, on a lattice and a little off it."""
    rng = np.random.default_rng(seed)
    names = [name for name, n in counts.items() for _ in range(n)]
    side = math.ceil(len(names) ** (1 / 3) - 1e-9)
    lattice = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    places = (lattice[rng.permutation(len(lattice))[: len(names)]] + 0.5) * edge / side
    atoms = Atoms(cell=[edge] * 3, pbc=True)
    for name, place in zip(names, places, strict=True):
        model = find_model(name)
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        turn *= np.sign(np.linalg.det(turn))
        real = model.positions_angstrom[: len(model.symbols)] @ turn.T
        atoms += Atoms(model.symbols, positions=place + real + rng.normal(size=3) * spread)
    return atoms


@dataclass
class Sites:
    """Sites of a box: places, molecule, charge, size, depth; and each site's atoms with their weights."""

    places: np.ndarray
    molecule: np.ndarray
    charge: np.ndarray
    sigma: np.ndarray
    epsilon: np.ndarray
    weights: np.ndarray  # (sites, atoms)


def sites_of(atoms: Atoms, models: list[RigidModel]) -> Sites:
    """Sites from atoms; the massless site of water by the bisector, that of N2 in the middle."""
    rows, weights, at = [], [], 0
    for number, model in enumerate(models):
        real = atoms.positions[at : at + len(model.symbols)]
        for s, site in enumerate(model.sites):
            w = np.zeros(len(atoms))
            if site.symbol:
                w[at + s] = 1.0
            elif len(real) == 3:  # r = O + g (H1 + H2 - 2 O)
                half = 0.9572 * math.cos(math.radians(104.52) / 2)
                g = site.position_angstrom[2] / (2 * half)
                w[at : at + 3] = 1 - 2 * g, g, g
            else:
                w[at : at + 2] = 0.5, 0.5
            weights.append(w)
            rows.append((number, site.charge_e, site.sigma_angstrom, site.epsilon_ev))
        at += len(real)
    table, w = np.array(rows), np.array(weights)
    return Sites(w @ atoms.positions, table[:, 0].astype(int), table[:, 1], table[:, 2], table[:, 3], w)


def pair_terms(sites: Sites, edges: np.ndarray, cutoff: float, width: float, charges: tuple) -> tuple:
    """Energies of dispersion and charges (eV), forces on sites (sites, 3) and (sites, sites, 3), nearest images.

    charges: ("reaction-field", dielectric), ("shifted", damping) or ("ewald", alpha).
    """
    d = sites.places[None] - sites.places[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        d -= np.where(edges > 0, edges * np.rint(d / np.where(edges > 0, edges, 1.0)), 0.0)
        r = np.linalg.norm(d, axis=-1)
        pair = (sites.molecule[:, None] != sites.molecule[None]) & (r < cutoff)
        r = np.where(pair, r, 1.0)
        bare, slope = lennard_jones(sites, r)
        s, ds = smooth_step(r, cutoff, width)
        dispersion, fall = s * bare, s * slope + ds * bare
        qq = COULOMB_EV_ANGSTROM * sites.charge[:, None] * sites.charge[None]
        shape, shape_slope = charge_shape(r, cutoff, *charges)
        total_slope = np.where(pair, fall + qq * shape_slope, 0.0)
        forces = -(total_slope / r)[..., None] * d  # on the second of the pair
    energies = 0.5 * np.sum(np.where(pair, dispersion, 0.0)), 0.5 * np.sum(np.where(pair, qq * shape, 0.0))
    return *energies, forces.sum(axis=0), forces


def lennard_jones(sites: Sites, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """4 ε [(σ/r)¹² - (σ/r)⁶] and its slope."""
    sigma = 0.5 * (sites.sigma[:, None] + sites.sigma[None])
    epsilon = np.sqrt(sites.epsilon[:, None] * sites.epsilon[None])
    six = (sigma / r) ** 6
    return 4 * epsilon * (six**2 - six), 24 * epsilon * (six - 2 * six**2) / r


def smooth_step(r: np.ndarray, cutoff: float, width: float) -> tuple[np.ndarray, np.ndarray]:
    """1 - 10 t³ + 15 t⁴ - 6 t⁵ and its slope."""
    if not width:
        return np.ones_like(r), np.zeros_like(r)
    t = np.clip((r - cutoff + width) / width, 0, 1)
    return 1 - 10 * t**3 + 15 * t**4 - 6 * t**5, (-30 * t**2 + 60 * t**3 - 30 * t**4) / width


def charge_shape(r: np.ndarray, cutoff: float, method: str, number: float) -> tuple[np.ndarray, np.ndarray]:
    """What stands in place of 1/r, and its slope."""
    if method == "reaction-field":
        k = (0.5 if math.isinf(number) else (number - 1) / (2 * number + 1)) / cutoff**3
        return 1 / r + k * r**2 - 1 / cutoff - k * cutoff**2, -1 / r**2 + 2 * k * r

    def value(x):
        return erfc(number * x) / x

    def slope(x):
        return -erfc(number * x) / x**2 - 2 * number / math.sqrt(math.pi) * np.exp(-((number * x) ** 2)) / x

    if method == "ewald":
        return value(r), slope(r)
    return value(r) - value(cutoff) - slope(cutoff) * (r - cutoff), slope(r) - slope(cutoff)


def fourier_terms(sites: Sites, edges: np.ndarray, alpha: float, k_cut: float) -> tuple[float, np.ndarray]:
    """Energy and forces of the sum over all wave vectors, both halves."""
    most = np.floor(k_cut * edges / (2 * math.pi)).astype(int)
    grid = np.stack(np.meshgrid(*[np.arange(-m, m + 1) for m in most], indexing="ij"), axis=-1).reshape(-1, 3)
    k = 2 * math.pi * grid / edges
    square = np.sum(k**2, axis=1)
    k, square = k[(square > 0) & (square <= k_cut**2)], square[(square > 0) & (square <= k_cut**2)]
    waves = sites.charge * np.exp(1j * k @ sites.places.T)
    factors = 2 * math.pi / np.prod(edges) * COULOMB_EV_ANGSTROM * np.exp(-square / (4 * alpha**2)) / square
    structure = waves.sum(axis=1)
    forces = 2 * np.imag(np.einsum("k,kc,ks->sc", factors * structure.conj(), k, waves))
    return float(np.sum(factors * np.abs(structure) ** 2)), forces


def inside_terms(sites: Sites, alpha: float) -> float:
    """-Σ q q erf(αr)/r inside molecules."""
    total = 0.0
    for s in range(len(sites.charge)):
        for t in range(s):
            if sites.molecule[s] == sites.molecule[t] and sites.charge[s] * sites.charge[t]:
                r = np.linalg.norm(sites.places[s] - sites.places[t])
                total -= COULOMB_EV_ANGSTROM * sites.charge[s] * sites.charge[t] * erf(alpha * r) / r
    return total
