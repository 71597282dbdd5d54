"""Synthetic spectra of 1 to 10 species among 100 candidates: recall and precision of `identify`.

Candidates are artificial species with 3 to 40 lines in the range, energies of 5 to 400 K. Species that are there have brightest lines of
5 to 100 times the noise and temperatures of 15 to 250 K; velocity and width are estimated from the spectrum.

    python benchmarks/observed_identify.py 200
"""

from __future__ import annotations

import sys
import time

import numpy as np
from observed_coverage import scaled

from rotor.observed.identify import identify
from rotor.observed.model import Component, model
from rotor.observed.partition import PartitionTable
from rotor.observed.species import SpeciesLines, species_lines
from rotor.observed.spectrum import observed_spectrum

FIRST, LAST, CHANNEL, NOISE = 230e3, 231e3, 0.25, 0.05  # MHz, K
CANDIDATES = 100


def candidate(number: int, rng: np.random.Generator) -> SpeciesLines:
    """A species with lines anywhere in the range."""
    lines = int(np.exp(rng.uniform(np.log(3), np.log(40))))
    kelvin = np.geomspace(2.0, 800.0, 30)
    partition = PartitionTable(kelvin, 0.5 * kelvin**1.5)
    frequency, strength = rng.uniform(FIRST, LAST, lines), 10.0 ** rng.uniform(0.0, 1.5, lines)
    return species_lines(
        f"s{number}", frequency, strength, rng.uniform(5.0, 400.0, lines), np.full(lines, 21), partition
    )


def one_case(rng: np.random.Generator) -> tuple[int, int, int]:
    """Species that are there, those found, and those named."""
    known = [candidate(i, rng) for i in range(CANDIDATES)]
    grid = np.arange(FIRST, LAST, CHANNEL)
    count = int(rng.integers(1, 11))
    velocity, width = rng.uniform(-20, 20), rng.uniform(1.5, 6.0)
    true = []
    for i in rng.choice(CANDIDATES, count, replace=False):
        start = Component(known[i], 1e14, float(np.exp(rng.uniform(np.log(15), np.log(250)))), velocity, width)
        peak = min(NOISE * np.exp(rng.uniform(np.log(5), np.log(100))), 0.7 * start.excitation_k)
        true.append(scaled(start, peak, grid))
    seen = model(true, grid).brightness_k + rng.normal(0, NOISE, len(grid))
    names = set(identify(observed_spectrum(grid, seen, noise=NOISE), known).names)
    exact = {one.species.name for one in true}
    return len(exact), len(exact & names), len(names)


def main(count: int, seed: int = 30) -> None:
    rng, begin, total = np.random.default_rng(seed), time.process_time(), np.zeros(3, dtype=int)
    perfect = 0
    for _ in range(count):
        case = one_case(rng)
        perfect += case[0] == case[1] == case[2]
        total += case
    there, found, named = total.tolist()
    print(
        f"{count} spectra, {there} species: recall {found / there:.3f}, precision {found / max(named, 1):.3f}, "
        f"without any fault {perfect}; "
        f"{(time.process_time() - begin) / count:.2f} s of processor time a spectrum"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
