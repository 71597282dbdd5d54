"""Force evaluations of rigid water per second: energy, forces on atoms and stress, by charges and threads.

    python benchmarks/bench_forces.py [--json benchmarks/results/forces.json]

Water (SPC/E) at 33.36 molecules/nm³, turned at random, cutoff 9 Å; a step is `atoms.get_forces()` after a move, the fastest of
many. list_over_step is what making the lists costs beside it (in liquid water they live for tens of steps of 2 fs). A C kernel
of the same forces (reaction field, full list, AVX-512) made 2.7e5 molecule-steps per second on the machine of the results.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from ase import Atoms
from bench_tops import processor

from rotor.fluids.forces.models import find_model
from rotor.fluids.forces.potential import RigidPotential
from rotor.geometry.rotations import uniform

PER_CUBIC_ANGSTROM = 33.36e-3


def water(n: int, rng: np.random.Generator) -> Atoms:
    """n molecules on a cubic lattice, turned at random."""
    model, edge, side = find_model("spce"), (n / PER_CUBIC_ANGSTROM) ** (1 / 3), math.ceil(n ** (1 / 3) - 1e-9)
    lattice = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)[:n]
    w, x, y, z = np.moveaxis(uniform(n, rng=rng), -1, 0)
    u = np.stack((x, y, z), axis=-1)[:, None]
    bodies = np.broadcast_to(model.positions_angstrom, (n, 3, 3))
    turned = bodies + 2 * np.cross(u, np.cross(u, bodies) + w[:, None, None] * bodies)
    places = (lattice + 0.5)[:, None] * edge / side + turned
    return Atoms("OH2" * n, positions=places.reshape(-1, 3), cell=[edge] * 3, pbc=True)


def seconds(run: Callable[[], object], repeats: int) -> float:
    """The fastest of some runs."""
    results = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        results.append(time.perf_counter() - start)
    return min(results)


def measured(n: int, electrostatics: str, threads: int, repeats: int) -> dict[str, float]:
    """One row of the table."""
    atoms = water(n, np.random.default_rng(1))
    calc = RigidPotential("spce", electrostatics=electrostatics, threads=threads, tolerance=1e-4)
    atoms.calc = calc
    atoms.get_forces()

    def through_ase() -> None:
        atoms.positions[0, 0] += 1e-9
        atoms.get_forces()

    def with_a_list() -> None:
        atoms.positions[:3] += 1.01 if calc.rebuilds % 2 else -1.01  # there and back, each more than half the skin
        atoms.get_forces()

    still, anew = seconds(through_ase, repeats), seconds(with_a_list, repeats)
    return {"steps_per_s": 1 / still, "molecule_steps_per_s": n / still, "list_over_step": anew / still - 1}


def main() -> None:
    """Print the table; write it if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--repeats", type=int, default=30)
    options = parser.parse_args()
    table: dict[str, object] = {"processor": processor(), "cores": os.cpu_count(), "load": os.getloadavg()[0]}
    for electrostatics in ("reaction-field", "shifted", "ewald"):
        for n in (216, 1000, 4096):
            for threads in (1, 2):
                row = measured(n, electrostatics, threads, options.repeats)
                table[f"{electrostatics}, {n} waters, {threads} threads"] = row
                print(
                    f"{electrostatics:15s} {n:5d} {threads}", *(f"{value:10.4g}" for value in row.values()), flush=True
                )
    if options.json:
        options.json.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
