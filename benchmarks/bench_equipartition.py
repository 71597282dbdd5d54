"""Equipartition in fluids of SPC/E and TIP4P water, TraPPE nitrogen and carbon dioxide: one statement for all.

    python benchmarks/bench_equipartition.py [--frames 400] [--json benchmarks/results/equipartition.json]

Each fluid: 216 molecules on a lattice, relaxed, brought to temperature by Langevin's thermostat, then frames 0.2 ps
apart under it. Momenta of the half step (on the step those of librations are too small, by the error of order h²) are
tested degree by degree by `rotor.statistics.equipartition`, as correlated data, and all degrees of all fluids as one family. Then
mistakes are planted: linear molecules counted with three rotations, and momenta on the step at twice the step's length.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from ase.units import fs

from rotor import units
from rotor.fluids.forces.models import find_model
from rotor.fluids.initial_box import heat, lattice_box, relax
from rotor.fluids.motion.bodies import rigid_bodies
from rotor.fluids.motion.dynamics import RigidDynamics
from rotor.fluids.motion.thermostats import Langevin
from rotor.fluids.run import make_calculator
from rotor.fluids.settings import Settings
from rotor.statistics.equipartition import Equipartition, KineticDegrees, equipartition, kinetic_degrees

CONFIDENCE = 0.99
APART_PS = 0.2
FRICTION_PER_PS = 20.0  # the box forgets its energy between frames, or all degrees would rise and fall together


@dataclass(frozen=True)
class Fluid:
    """A fluid at a state where it is liquid; step in fs."""

    model: str
    temperature_k: float
    density_g_cm3: float
    step_fs: float


FLUIDS = (
    Fluid("spce", 298.15, 0.997, 2.0),
    Fluid("tip4p", 298.15, 0.997, 2.0),
    Fluid("trappe-n2", 90.0, 0.745, 4.0),
    Fluid("trappe-co2", 250.0, 1.046, 4.0),
)


def frames_of(
    fluid: Fluid, molecules: int, frames: int, seed: int, stretch: float = 1.0, on_step: bool = False
) -> KineticDegrees:
    """Kinetic energies over kT by degree of freedom, (frames, molecules)."""
    model = find_model(fluid.model)
    settings = Settings(model=fluid.model, temperature_k=fluid.temperature_k)
    atoms = lattice_box(model, molecules, fluid.density_g_cm3, np.random.default_rng([seed, 1]))
    atoms.calc = make_calculator(settings)
    shapes = {model.symbols: model.positions_angstrom[: len(model.symbols)]}
    relax(atoms, shapes=shapes)
    bodies, pose = rigid_bodies(atoms, shapes=shapes)
    heat(atoms, bodies, pose.attitude, fluid.temperature_k, np.random.default_rng([seed, 2]))
    step = stretch * fluid.step_fs
    thermostat = Langevin(fluid.temperature_k, FRICTION_PER_PS / (1000.0 * fs), np.random.default_rng([seed, 3]))
    dynamics = RigidDynamics(atoms, step * fs, thermostat=thermostat, shapes=shapes)
    seen = []
    for k in range(-50, frames):
        for _ in range(round(1000.0 * APART_PS / step)):
            dynamics.step()
            dynamics.nsteps += 1
        if k >= 0:
            momenta = (dynamics.state.momentum.copy(), dynamics.state.angular.copy())
            seen.append(momenta if on_step else dynamics.half_step_momenta())
    kinetics = kinetic_degrees(
        masses=bodies.mass, velocities=np.array([p for p, _ in seen]) / bodies.mass[:, None],
        moments=bodies.moments, momenta=np.array([spin for _, spin in seen]),
    )  # fmt: skip
    kt = fluid.temperature_k * units.EV_PER_K
    return KineticDegrees({name: energies / kt for name, energies in kinetics.energies.items()}, kinetics.counts)


def family(parts: dict[str, KineticDegrees]) -> KineticDegrees:
    """All degrees of all fluids."""
    energies = {f"{fluid}: {name}": e for fluid, part in parts.items() for name, e in part.energies.items()}
    counts = {f"{fluid}: {name}": n for fluid, part in parts.items() for name, n in part.counts.items()}
    return KineticDegrees(energies, counts)


def miscounted(part: KineticDegrees, factor: float) -> KineticDegrees:
    """The same energies where rotations are thought to be `factor` times as many degrees."""
    counts = {name: n * (factor if name.startswith("rotation") else 1.0) for name, n in part.counts.items()}
    return KineticDegrees(part.energies, counts)


def verdict_record(title: str, verdict: Equipartition) -> dict[str, object]:
    """Print a verdict, and what of it is stored."""
    print(f"{title}: {verdict}", flush=True)
    record = asdict(verdict)
    record["degrees"] = [
        {k: row[k] for k in ("name", "mean", "mean_spread", "effective", "sigma", "p_value", "ks_p_value")}
        for row in record["degrees"]
    ]
    return {"title": title, "sentence": str(verdict), **record}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=400)
    parser.add_argument("--molecules", type=int, default=216)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    parts, results = {}, []
    for seed, fluid in enumerate(FLUIDS):
        parts[fluid.model] = frames_of(fluid, options.molecules, options.frames, seed)
        results.append(verdict_record(fluid.model, equipartition(parts[fluid.model], 1.0, confidence=CONFIDENCE)))
    results.append(verdict_record("all fluids as one family", equipartition(family(parts), 1.0, confidence=CONFIDENCE)))
    for name in ("trappe-n2", "trappe-co2"):
        bent = equipartition(miscounted(parts[name], 1.5), 1.0, confidence=CONFIDENCE)
        results.append(verdict_record(f"planted: {name} counted with three rotations", bent))
    long = frames_of(FLUIDS[0], options.molecules, options.frames, 9, stretch=2.0, on_step=True)
    results.append(
        verdict_record("planted: spce at 4 fs, momenta on the step", equipartition(long, 1.0, confidence=CONFIDENCE))
    )
    results.append(
        verdict_record("the same without a temperature given", equipartition(long, None, confidence=CONFIDENCE))
    )
    if options.json:
        options.json.write_text(json.dumps(results, indent=1, default=float) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
