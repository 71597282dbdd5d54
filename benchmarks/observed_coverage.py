"""Injected spectra: do intervals of 68 % cover what was put in, and are wrong species reported as not needed?

Each spectrum has 1 to 5 species of artificial lines, blended, with noise so that the brightest line of each is 3 to 100 times it; one
more species that is not there is fitted with them. A parameter counts where its component is needed and its stated error is below the
bound of `IDENTIFIABLE`. Printed: fraction of intervals that cover, and the mean deviation in standard errors, with their own errors.

    python benchmarks/observed_coverage.py 1000 coverage.jsonl

The file takes one line for each spectrum, whose random numbers depend on its number alone: a run that was cut off goes on, and only what
is missing is computed. A last argument bounds the spectra of one run.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

from rotor.observed.fit import contributions, fit_source
from rotor.observed.model.model import Component, model
from rotor.observed.model.partition import PartitionTable
from rotor.observed.model.species import SpeciesLines, species_lines
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
    species = [component.species for component in true] + [artificial("wrong", rng)]
    fit = fit_source(
        spectrum,
        start_components(spectrum, species, velocity_km_s=velocity + rng.normal(0, 0.3), fwhm_km_s=width * 1.2),
    )
    needed = contributions(fit)
    out: dict[str, list] = {"wrong": [int(needed[-1].needed)], "missed": [], "failed": [int(not fit.minimum.converged)]}
    for row in fit.parameters:
        k = row["components"][0]
        if k == count:
            continue
        exact, variable = getattr(true[k], row["parameter"]), fit.variables.items[fit.parameters.index(row)]
        error = float(fit.statistics.errors[fit.parameters.index(row)]) * fit.scale
        if row["parameter"] == "column_per_cm2":
            out["missed"].append(int(not needed[k].needed))
        if not needed[k].needed or not row["determined"] or (variable.logarithmic and error > IDENTIFIABLE):
            continue
        pull = (variable.forward(row["value"]) - variable.forward(exact)) / error
        out.setdefault(row["parameter"], []).append(round(float(pull), 4))
    return out


def wilson(successes: int, trials: int, z: float = 1.96) -> tuple[float, float]:
    """Interval of 95 % of a proportion (E. B. Wilson, J. Am. Stat. Assoc. 22, 209 (1927))."""
    p, n = successes / trials, trials
    middle, half = p + z**2 / (2 * n), z * (p * (1 - p) / n + z**2 / (4 * n**2)) ** 0.5
    return (middle - half) / (1 + z**2 / n), (middle + half) / (1 + z**2 / n)


def records(count: int, path: Path, seed: int, case, most: int) -> list[dict]:  # type: ignore[no-untyped-def]
    """One record for each case, of the file where it has them, else computed and appended."""
    there = {one["case"]: one for one in map(json.loads, path.read_text().splitlines())} if path.exists() else {}
    with path.open("a") as handle:
        for number in [number for number in range(count) if number not in there][:most]:
            there[number] = {"case": number, **case(np.random.default_rng([seed, number]))}
            handle.write(json.dumps(there[number]) + "\n")
            handle.flush()
    return [one for number, one in sorted(there.items()) if number < count]


def main(count: int, path: Path, most: int = 1 << 30, seed: int = 20) -> None:
    total: dict[str, list] = {}
    cases = records(count, path, seed, one_case, most)
    for case in cases:
        for key in case.keys() - {"case"}:
            total.setdefault(key, []).extend(case[key])
    print(f"{len(cases)} of {count} spectra")
    for key in ("wrong", "missed", "failed"):
        print(f"{key}: {sum(total[key])} of {len(total[key])}")
    for key in ("column_per_cm2", "excitation_k", "velocity_km_s", "fwhm_km_s"):
        pulls = np.array(total[key])
        n, inside = len(pulls), int(np.sum(np.abs(pulls) < 1))
        low, high = wilson(inside, n)
        print(
            f"{key:16s} {n:5d}  covered {inside / n:.3f} ({low:.3f} to {high:.3f})  bias {pulls.mean():+.3f}"
            f" ± {pulls.std() / n**0.5:.3f}"
            f"  median {np.median(pulls):+.3f}  beyond 4: {np.sum(np.abs(pulls) > 4)}"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]), Path(sys.argv[2]), *map(int, sys.argv[3:4]))
