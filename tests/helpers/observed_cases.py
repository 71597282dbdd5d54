"""Species in closed form and synthetic spectra, shared by the tests of observed spectra."""

from collections.abc import Sequence

import numpy as np

from rotor import units
from rotor.observed.model.model import Component, Sight, model
from rotor.observed.model.partition import PartitionTable
from rotor.observed.model.species import SpeciesLines, species_lines, strength_from_einstein
from rotor.observed.spectrum import ObservedSpectrum, observed_spectrum

EINSTEIN_PER_MHZ3 = 1.1639654e-20  # 64π⁴/3hc³ for MHz and D²


def rigid(b_mhz: float = 10e3, name: str = "rigid", dipole_debye: float = 1.0, lines: int = 12) -> SpeciesLines:
    """Lines of a rigid rotor in closed form: E_J = B J(J+1), A = (64π⁴ν³/3hc³) μ² (J+1)/(2J+3), Q summed."""
    b_k = b_mhz / units.MHZ_PER_K
    j = np.arange(0, 400)
    table = np.geomspace(2.0, 600.0, 200)
    q = np.array([np.sum((2 * j + 1) * np.exp(-b_k * j * (j + 1) / t)) for t in table])
    low = np.arange(0, lines)
    frequency = 2 * b_mhz * (low + 1)
    a = EINSTEIN_PER_MHZ3 * frequency**3 * dipole_debye**2 * (low + 1) / (2 * low + 3)
    strength = strength_from_einstein(a, frequency, 2 * low + 3)
    return species_lines(name, frequency, strength, b_k * low * (low + 1), 2 * low + 3, PartitionTable(table, q))


def artificial(name: str, rng: np.random.Generator, first_mhz: float, last_mhz: float, lines: int = 12) -> SpeciesLines:
    """A species with lines anywhere in a range: energies of 5 to 400 K, strengths over a factor of 30, Q of a nonlinear top."""
    frequency = rng.uniform(first_mhz, last_mhz, lines)
    kelvin = np.geomspace(2.0, 600.0, 30)
    strength = 10.0 ** rng.uniform(0.0, 1.5, lines)
    return species_lines(
        name,
        frequency,
        strength,
        rng.uniform(5.0, 400.0, lines),
        np.full(lines, 21),
        PartitionTable(kelvin, 0.5 * kelvin**1.5),
    )


def injected(
    components: Sequence[Component],
    grid_mhz: np.ndarray,
    noise_k: float,
    rng: np.random.Generator,
    sight: Sight | None = None,
) -> ObservedSpectrum:
    """The model with Gaussian noise."""
    seen = model(components, grid_mhz, sight).brightness_k
    return observed_spectrum(
        grid_mhz, seen + rng.normal(0.0, noise_k, len(grid_mhz)), noise=noise_k, source="synthetic"
    )
