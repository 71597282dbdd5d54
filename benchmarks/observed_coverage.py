"""Injected spectra: do intervals of 68 % cover what was put in, and are wrong species reported as not needed?

Each spectrum has 1 to 5 species of artificial lines, blended, with noise so that the brightest line of each is 3 to 100 times it; one
more species that is not there is fitted with them. A parameter counts where its component is needed and its stated error is below the
bound of `IDENTIFIABLE`. Printed: fraction of intervals that cover, and the mean deviation in standard errors, with their own errors.

    python benchmarks/observed_coverage.py 1000
"""

from __future__ import annotations

import sys
import time

import numpy as np

from rotor.observed.fit import contributions, fit_source
from rotor.observed.model import Component, model
from rotor.observed.partition import PartitionTable
from rotor.observed.species import SpeciesLines, species_lines
from rotor.observed.spectrum import observed_spectrum
from rotor.observed.start import start_components

FIRST, LAST, CHANNEL = 100e3, 100.6e3, 0.1  # MHz
IDENTIFIABLE = 0.3  # relative error of a temperature or a column density, above which the linear error is no interval


def artificial(name: str, rng: np.random.Generator, lines: int = 15) -> SpeciesLines:
    """A species with lines anywhere in the range: energies of 5 to 400 K, strengths over a factor of 30."""
    frequency = np.sort(rng.uniform(FIRST, LAST, lines))
    kelvin = np.geomspace(2.0, 800.0, 30)
    partition = PartitionTable(kelvin, 0.5 * kelvin**1.5)
    strength = 10.0 ** rng.uniform(0.0, 1.5, lines)
    return species_lines(name, frequency, strength, rng.uniform(5.0, 400.0, lines), np.full(lines, 21), partition)


def scaled(component: Component, peak_k: float, grid: np.ndarray) -> Component:
    """The component with the column density that gives a peak brightness, by bisection in its logarithm."""
    low, high = 5.0, 22.0
    for _ in range(60):
        middle = (low + high) / 2
        trial = Component(
            component.species, 10**middle, component.excitation_k, component.velocity_km_s, component.fwhm_km_s
        )
        low, high = (middle, high) if model([trial], grid).brightness_k.max() < peak_k else (low, middle)
    return trial


def one_case(rng: np.random.Generator, noise: float = 0.05) -> dict[str, list]:
    """A spectrum made and fitted: deviations in standard errors by parameter, and whether the wrong species is needed."""
    grid = np.arange(FIRST, LAST, CHANNEL)
    count = int(rng.integers(1, 6))
    velocity, width = rng.uniform(-10, 10), rng.uniform(1.0, 4.0)
    true = []
    for i in range(count):
        start = Component(
            artificial(f"s{i}", rng), 1e14, float(np.exp(rng.uniform(np.log(15), np.log(200)))), velocity, width
        )
        peak = min(noise * np.exp(rng.uniform(np.log(3), np.log(100))), 0.6 * start.excitation_k)
        true.append(scaled(start, peak, grid))
    spectrum = observed_spectrum(grid, model(true, grid).brightness_k + rng.normal(0, noise, len(grid)), noise=noise)
    species = [one.species for one in true] + [artificial("wrong", rng)]
    fit = fit_source(
        spectrum,
        start_components(spectrum, species, velocity_km_s=velocity + rng.normal(0, 0.3), fwhm_km_s=width * 1.2),
    )
    needed = contributions(fit)
    out: dict[str, list] = {"wrong": [needed[-1].needed], "missed": [], "failed": [not fit.minimum.converged]}
    for row in fit.parameters:
        k = row["components"][0]
        if k == count:
            continue
        exact, variable = getattr(true[k], row["parameter"]), fit.variables.items[fit.parameters.index(row)]
        error = float(fit.statistics.errors[fit.parameters.index(row)]) * fit.scale
        if row["parameter"] == "column_per_cm2":
            out["missed"].append(not needed[k].needed)
        if not needed[k].needed or not row["determined"] or (variable.logarithmic and error > IDENTIFIABLE):
            continue
        out.setdefault(row["parameter"], []).append((variable.forward(row["value"]) - variable.forward(exact)) / error)
    return out


def main(count: int, seed: int = 20) -> None:
    rng, total, begin = np.random.default_rng(seed), {}, time.process_time()
    for _ in range(count):
        for key, values in one_case(rng).items():
            total.setdefault(key, []).extend(values)
    print(f"{count} spectra, {time.process_time() - begin:.0f} s of processor time")
    for key in ("wrong", "missed", "failed"):
        print(f"{key}: {sum(total[key])} of {len(total[key])}")
    for key in ("column_per_cm2", "excitation_k", "velocity_km_s", "fwhm_km_s"):
        pulls = np.array(total[key])
        n = len(pulls)
        print(
            f"{key:16s} {n:5d}  covered {np.mean(np.abs(pulls) < 1):.3f} ± {0.47 / n**0.5:.3f}  bias {pulls.mean():+.3f}"
            f" ± {pulls.std() / n**0.5:.3f}"
            f"  median {np.median(pulls):+.3f}  beyond 4: {np.sum(np.abs(pulls) > 4)}"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
