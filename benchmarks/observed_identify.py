"""Synthetic spectra of 1 to 10 species among 100 candidates: recall and precision of `identify`.

Candidates are artificial species with 3 to 40 lines in the range, energies of 5 to 400 K. Species that are there have brightest lines of
5 to 100 times the noise and temperatures of 15 to 250 K; velocity and width are estimated from the spectrum.

With `unknown`, three more species that are among no candidates have lines in each spectrum: those of the candidates that are named for them
are wrong.

    python benchmarks/observed_identify.py 200 identify.jsonl
    python benchmarks/observed_identify.py 200 identify_unknown.jsonl unknown

The file takes one line for each spectrum, as that of `observed_coverage.py`; a last number bounds the spectra of one run.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import numpy as np
from observed_coverage import records, scaled, wilson

from rotor.observed.identification.identify import identify
from rotor.observed.model.model import Component, model
from rotor.observed.model.partition import PartitionTable
from rotor.observed.model.species import SpeciesLines, species_lines
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


def one_case(rng: np.random.Generator, unknown: int = 0) -> dict[str, int]:
    """Species that are there, those found, those named, and those named with more than one line seen, right and in all."""
    known = [candidate(i, rng) for i in range(CANDIDATES)]
    grid = np.arange(FIRST, LAST, CHANNEL)
    count = int(rng.integers(1, 11))
    velocity, width = rng.uniform(-20, 20), rng.uniform(1.5, 6.0)
    present = [known[i] for i in rng.choice(CANDIDATES, count, replace=False)]
    true = []
    for species in [*present, *(candidate(1000 + i, rng) for i in range(unknown))]:
        start = Component(species, 1e14, float(np.exp(rng.uniform(np.log(15), np.log(250)))), velocity, width)
        peak = min(NOISE * np.exp(rng.uniform(np.log(5), np.log(100))), 0.7 * start.excitation_k)
        true.append(scaled(start, peak, grid))
    seen = model(true, grid).brightness_k + rng.normal(0, NOISE, len(grid))
    found = identify(observed_spectrum(grid, seen, noise=NOISE), known).species
    exact = {species.name for species in present}
    right = [each.component.species.name in exact for each in found]
    firm = [each.visible > 1 for each in found]
    return {
        "there": count,
        "found": sum(right),
        "named": len(found),
        "firm_found": sum(a and b for a, b in zip(right, firm, strict=True)),
        "firm": sum(firm),
    }


def main(count: int, path: Path, unknown: int = 0, most: int = 1 << 30, seed: int = 30) -> None:
    cases = records(count, path, seed, partial(one_case, unknown=unknown), most)
    total = {name: sum(case[name] for case in cases) for name in ("there", "found", "named", "firm_found", "firm")}
    print(f"{len(cases)} of {count} spectra, {total['there']} species, {unknown} more that are no candidates")
    for name, part, whole in (
        ("recall", "found", "there"),
        ("precision", "found", "named"),
        ("precision, more than one line seen", "firm_found", "firm"),
    ):
        low, high = wilson(total[part], max(total[whole], 1))
        print(
            f"{name}: {total[part]} of {total[whole]}, {total[part] / max(total[whole], 1):.3f} ({low:.3f} to {high:.3f})"
        )
    print(f"without any fault: {sum(case['there'] == case['found'] == case['named'] for case in cases)}")


if __name__ == "__main__":
    more = sys.argv[3:]
    main(
        int(sys.argv[1]),
        Path(sys.argv[2]),
        3 if "unknown" in more else 0,
        *map(int, [word for word in more if word != "unknown"]),
    )
