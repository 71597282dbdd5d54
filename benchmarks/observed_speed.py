"""Times of fits: ten species in 30,000 channels, and a cube of 64 by 64 pixels, 1000 channels, three species.

python benchmarks/observed_speed.py           # the fit, and one row of the cube
python benchmarks/observed_speed.py cube      # the whole cube on two processes
"""

from __future__ import annotations

import sys
import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from rotor.observed.cube import fit_cube
from rotor.observed.fit import FitChoices, fit_source
from rotor.observed.model.model import Component, model
from rotor.observed.model.partition import PartitionTable
from rotor.observed.model.species import SpeciesLines, species_lines
from rotor.observed.spectrum import observed_spectrum
from rotor.observed.start import start_components


def artificial(name: str, rng: np.random.Generator, first: float, last: float, lines: int) -> SpeciesLines:
    """A species with lines anywhere in a range."""
    kelvin = np.geomspace(2.0, 800.0, 30)
    partition = PartitionTable(kelvin, 0.5 * kelvin**1.5)
    strength = 10.0 ** rng.uniform(0.0, 1.5, lines)
    return species_lines(
        name, rng.uniform(first, last, lines), strength, rng.uniform(5.0, 400.0, lines), np.full(lines, 21), partition
    )


def wide_fit(rng: np.random.Generator) -> None:
    """Ten species with 100 lines each, the start included."""
    grid = np.arange(220e3, 223e3, 0.1)
    species = [artificial(f"s{i}", rng, grid[0], grid[-1], 100) for i in range(10)]
    true = [Component(component, 10 ** rng.uniform(15, 16), rng.uniform(30, 200), 2.0, 2.0) for component in species]
    spectrum = observed_spectrum(grid, model(true, grid).brightness_k + rng.normal(0, 0.05, len(grid)), noise=0.05)
    begin, cpu = time.perf_counter(), time.process_time()
    start = start_components(spectrum, species)
    middle = time.process_time()
    fit = fit_source(spectrum, start)
    print(
        f"10 species, {len(grid)} channels, {len(fit.values)} parameters: start {middle - cpu:.2f} s, fit "
        f"{time.process_time() - middle:.2f} s of processor time, {time.perf_counter() - begin:.2f} s in all; {fit.minimum.reason}; "
        f"χ²/ν {fit.reduced_chi_squared:.3f}"
    )


def cube(rng: np.random.Generator, rows: int, workers: int) -> None:
    """Rows of 64 pixels."""
    grid = np.arange(220e3, 220.1e3, 0.1)
    species = [artificial(f"s{i}", rng, grid[0], grid[-1], 10) for i in range(3)]
    y, x = np.mgrid[0:rows, 0:64]
    data = np.zeros((len(grid), rows, 64))
    for i in range(rows):
        for j in range(64):
            scale = np.exp(-((x[i, j] - 32) ** 2 + (y[i, j] - rows / 2) ** 2) / 800)
            parts = [
                Component(component, 5e15 * scale, 60 + 60 * scale, 0.05 * (x[i, j] - 32), 3.0) for component in species
            ]
            data[:, i, j] = model(parts, grid).brightness_k
    data += rng.normal(0, 0.1, data.shape)
    start = [Component(component, 3e15, 90.0, 0.0, 3.0) for component in species]
    choices = FitChoices(shared=("velocity_km_s", "fwhm_km_s"))
    begin, cpu = time.perf_counter(), time.process_time()
    if workers > 1:
        with ProcessPoolExecutor(workers) as pool:
            cube_fit = fit_cube(grid, data, 0.1, start, choices=choices, executor=pool)
    else:
        cube_fit = fit_cube(grid, data, 0.1, start, choices=choices)
    print(
        f"cube of {rows} by 64 pixels, {len(grid)} channels, 3 species, {workers} processes: {time.perf_counter() - begin:.1f} s "
        f"({time.process_time() - cpu:.1f} s of this process); {int(cube_fit.fitted.sum())} of {cube_fit.fitted.size} converged"
    )


if __name__ == "__main__":
    generator = np.random.default_rng(1)
    if "cube" in sys.argv:
        cube(generator, 64, 2)
    else:
        wide_fit(generator)
        cube(generator, 2, 1)
