"""Synthetic peak lists of cold gas with their truth, for `bench_assign.py` and the tests: rotor's own lines, any seed.

A case has one to three molecules of random geometry, their singly substituted ¹³C species where the signal shows them, split lines
of some weaker species, foreign peaks with intensities of a power law, spurs of a clock, a response with ripple and roll-off,
saturation, noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import rotor

BANDS = ((6000.0, 18000.0), (8000.0, 18000.0), (10000.0, 20000.0), (2000.0, 8000.0), (18000.0, 26500.0))
SHARES = (0.38, 0.22, 0.18, 0.1, 0.12)
MASS_12C, MASS_13C = 12.0, 13.00335
INERTIA_MHZ = 505379.0046  # u Å² MHz: h/(8π² c) in these units
LOWEST = 6.0  # times the noise

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Species:
    """One molecule of a case: constants in MHz (8,), dipole in D, strength, and for a parent its atoms (mass in u, x, y, z in Å)."""

    constants: Floats
    dipole: tuple[float, float, float]
    strength: float
    atoms: Floats
    parent: int | None = None
    atom: int | None = None


@dataclass(frozen=True)
class Case:
    """A peak list (n, 3) with frequency, intensity, uncertainty, and what it was made from."""

    seed: int
    band_mhz: tuple[float, float]
    temperature_k: float
    signal_to_noise: float
    peaks: Floats
    species: tuple[Species, ...]
    main_lines: int
    foreign: int
    split: bool


def rotational_constants(atoms: Floats) -> tuple[Floats, Floats]:
    """A, B, C in MHz and the principal axes (rows a, b, c) of point masses (n, 4)."""
    mass, x = atoms[:, 0], atoms[:, 1:]
    x = x - mass @ x / mass.sum()
    inertia = np.eye(3) * np.sum(mass * np.sum(x**2, axis=1)) - np.einsum("i,ij,ik->jk", mass, x, x)
    moments, axes = np.linalg.eigh(inertia)
    return INERTIA_MHZ / moments, axes.T


def molecule(rng: np.random.Generator) -> Floats:
    """Atoms (n, 4) of a random chain of carbon with hydrogens left out: mass, x, y, z."""
    while True:
        count = int(rng.integers(4, 13))
        steps = rng.normal(size=(count, 3)) * (1.0, rng.uniform(0.2, 1.0), rng.uniform(0.0, 0.8))
        if rng.random() < 0.15:
            steps[:, 2] = 0.0
        x = [np.zeros(3)]
        for step in steps:
            at = x[int(rng.integers(max(0, len(x) - 3), len(x)))]
            x.append(at + 1.45 * step / np.linalg.norm(step))
        positions = np.array(x)
        apart = np.linalg.norm(positions[:, None] - positions[None], axis=2)[np.triu_indices(len(x), 1)]
        if apart.min() < 1.1:
            continue
        mass = rng.choice([12.0, 12.0, 14.01565, 15.994915], size=len(x))
        mass[0] = 12.0
        atoms = np.column_stack([mass, positions])
        (a, b, c), _ = rotational_constants(atoms)
        if 850 < a < 9500 and c > 350 and a > 1.02 * b and b > 1.005 * c:
            return atoms


def quartic(constants: Floats, rng: np.random.Generator) -> Floats:
    """DJ, DJK, DK, d1, d2 of the size of semi-rigid molecules."""
    a, b, c = constants
    mean = (b + c) / 2
    size = 10 ** rng.normal(-13.0, 0.3)
    dj = size * mean**3
    return np.array(
        [dj, size * a * mean**2 * rng.normal(0.8, 1.0), size * a**3 * rng.uniform(0.1, 1.5), -dj * rng.uniform(0.02, 0.5),
         -dj * rng.uniform(0.002, 0.09)]
    )  # fmt: skip


def lines_of(species: Species, temperature_k: float, band: tuple[float, float], floor: float) -> tuple[Floats, Floats]:
    """Frequencies and intensities, the strongest of a species of strength 1 at 100."""
    names = ("A", "B", "C", "DJ", "DJK", "DK", "d1", "d2")
    constants = rotor.Constants(
        **dict(zip(names, species.constants.tolist(), strict=True)), reduction="S", representation="Ir"
    )
    top = rotor.Top.from_constants(constants, dipole_abc_debye=species.dipole)
    jmax = int(np.clip(np.sqrt(16 * 20836.6 * temperature_k / species.constants[1:3].mean()), 12, 60))
    lines = rotor.api.line_list(top, temperature_k=temperature_k, jmax=jmax, range_mhz=band, untrusted=True)
    intensity = 10 ** lines.columns["lgint"]
    intensity *= 100.0 * species.strength / intensity.max()
    strong = intensity > floor
    return lines.frequency_mhz[strong], intensity[strong]


def isotopologues(parent: Species, place: int, rng: np.random.Generator) -> list[Species]:
    """Up to six ¹³C species by substitution in the geometry, with constants that a real molecule would shift alike."""
    carbons = np.flatnonzero(parent.atoms[:, 0] == MASS_12C)
    rigid, _ = rotational_constants(parent.atoms)
    out = []
    for atom in rng.permutation(carbons)[:6].tolist():
        atoms = parent.atoms.copy()
        atoms[atom, 0] = MASS_13C
        changed, _ = rotational_constants(atoms)
        constants = parent.constants.copy()
        constants[:3] *= changed / rigid
        out.append(Species(constants, parent.dipole, 0.0107 * parent.strength, atoms, place, atom))
    return out


def make_case(seed: int, signal_to_noise: float | None = None) -> Case:
    """The case of a seed."""
    rng = np.random.default_rng([seed, 29])
    band = BANDS[int(rng.choice(len(BANDS), p=SHARES))]
    temperature = float(np.exp(rng.uniform(0.0, np.log(8.0))))
    snr = signal_to_noise or float(np.exp(rng.uniform(np.log(30), np.log(3000))))
    floor = LOWEST * 100 / snr
    mains, species = [], list[Species]()
    for k in range(int(rng.choice([1, 2, 3], p=[0.35, 0.4, 0.25]))):
        while True:
            atoms = molecule(rng)
            rigid, _ = rotational_constants(atoms)
            dipole = rng.uniform(0.1, 2.0, 3) * (rng.random(3) < 0.85)
            if rng.random() < 0.3:
                dipole *= np.eye(3)[int(rng.integers(3))]
            component = Species(
                np.concatenate([rigid, quartic(rigid, rng)]), tuple(dipole.round(4).tolist()),
                1.0 if k == 0 else float(rng.uniform(0.1, 1.0)), atoms,
            )  # fmt: skip
            if not dipole.any():
                continue
            try:
                enough = len(lines_of(component, temperature, band, max(floor, 1e-3))[0]) >= 16
            except ValueError:
                enough = False
            if enough:
                break
        mains.append(component)
    species = list(mains)
    if snr > 450:
        for place, component in enumerate(mains):
            species += isotopologues(component, place, rng)
    return case_with(seed, band, temperature, snr, floor, species, len(mains), rng)


def case_with(
    seed: int, band: tuple[float, float], temperature: float, snr: float, floor: float, species: list[Species], mains: int,
    rng: np.random.Generator,
) -> Case:  # fmt: skip
    """Lines of all species through the instrument."""
    frequency, intensity, split, main_lines = [], [], False, 0
    phases = rng.uniform(0, 2 * np.pi, 2)

    def response(f: Floats) -> Floats:
        x = (f - band[0]) / (band[1] - band[0])
        ripple = np.exp(0.25 * np.sin(9 * x + phases[0]) + 0.25 * np.sin(23 * x + phases[1]))
        return np.asarray(ripple / (1 + np.exp(-(x - 0.0) / 0.06)) / (1 + np.exp((x - 1.0) / 0.06)))

    saturation = rng.uniform(150, 2000)
    for place, component in enumerate(species):
        f, i = lines_of(component, temperature, band, floor / 3)
        if component.parent is None and place > 0 and rng.random() < 0.25:
            split = True
            f, i = _split(f, i, float(rng.uniform(0.5, 1.5)), rng)
        i = i * response(f)
        i = i / (1 + i / saturation)
        if place == 0:
            main_lines = int((i > floor).sum())
        frequency.append(f)
        intensity.append(i)
    seen = int(sum((i > floor).sum() for i in intensity))
    foreign = int(rng.uniform(0, 0.5) * seen)
    frequency.append(rng.uniform(*band, foreign))
    intensity.append(np.minimum(floor * rng.random(foreign) ** (-1 / 0.8), 80.0))
    spurs = rng.choice(np.arange(band[0] / 50, band[1] / 50), size=int(rng.integers(0, 13)), replace=False) * 50.0
    frequency.append(spurs)
    intensity.append(np.minimum(floor * rng.random(len(spurs)) ** (-1 / 0.7), 80.0))
    fwhm = float(rng.uniform(0.05, 0.15))
    peaks = _measured(np.concatenate(frequency), np.concatenate(intensity), fwhm, 100 / snr, floor, rng)
    return Case(seed, band, temperature, snr, peaks, tuple(species), main_lines, foreign, split)


def _split(f: Floats, i: Floats, width_mhz: float, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Each line as two, at equal distance on either side."""
    apart = width_mhz * rng.uniform(0.0, 1.0, len(f))
    share = rng.uniform(0.4, 0.6, len(f))
    return np.concatenate([f - apart, f + apart]), np.concatenate([i * share, i * (1 - share)])


def _measured(f: Floats, i: Floats, fwhm: float, noise: float, floor: float, rng: np.random.Generator) -> Floats:
    """Peaks (n, 3): lines nearer than the width are one; noise in height and position."""
    order = np.argsort(f)
    f, i = f[order], i[order]
    blend = np.concatenate([[0], np.cumsum(np.diff(f) > fwhm)])
    height = np.bincount(blend, i)
    centre = np.bincount(blend, f * i) / height
    height = height + noise * rng.normal(size=len(height))
    visible = height > floor
    centre, height = centre[visible], height[visible]
    error = np.sqrt(0.004**2 + (0.5 * fwhm * noise / height) ** 2)
    centre = centre + error * rng.normal(size=len(centre))
    order = np.argsort(centre)
    return np.column_stack([centre[order].round(4), height[order].round(4), error[order].round(4)])
