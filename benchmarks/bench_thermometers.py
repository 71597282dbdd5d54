"""SPC/E water at constant energy: which thermometer is right at which step, what the energy does, what a step costs.

    python benchmarks/bench_thermometers.py [--span-ps 100] [--json benchmarks/results/thermometers.json]
        [--plot docs/pictures/fluid_thermometers.png]

216 molecules, 298 K, reaction field at 9 Å: brought to temperature by Langevin's thermostat, then run at constant energy
with steps of 1 to 4 fs from the same start. T_rot/T_trans by momenta on the step, at half steps, and by the mixture of both, each with
the standard error of 20 blocks; rms and drift of the energy; and the cost of the two splittings that can drift a body.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from ase import Atoms
from ase.units import fs

from rotor import units
from rotor.classical.integrators.splitting import RotationSplitting
from rotor.fluids.forces.models import find_model
from rotor.fluids.initial_box import heat, lattice_box, relax
from rotor.fluids.motion.bodies import rigid_bodies
from rotor.fluids.motion.dynamics import RigidDynamics
from rotor.fluids.motion.state import Flows, State
from rotor.fluids.motion.thermometers import THERMOMETERS, kinetic_energy, step_correction
from rotor.fluids.run import make_calculator, run_fluid
from rotor.fluids.settings import Settings

MOLECULES = 216
STEPS_FS = (1.0, 2.0, 3.0, 4.0)
MODEL = find_model("spce")
SHAPES = {MODEL.symbols: MODEL.positions_angstrom}
LIBRATION_PER_PS = 112.0  # of water, from one fit to 4 fs in another program
BLOCKS = 20


def liquid(span_ps: float) -> Atoms:
    """A box of water at temperature, with momenta of a Langevin run."""
    settings = Settings(ensemble="langevin", friction_per_ps=5.0, step_fs=2.0, steps=round(span_ps * 500), every=500)
    atoms = lattice_box(MODEL, MOLECULES, 0.997, np.random.default_rng(1))
    atoms.calc = make_calculator(settings)
    relax(atoms, shapes=SHAPES)
    run_fluid(atoms, settings)
    return atoms


def dynamics_from(atoms: Atoms, step_fs: float) -> RigidDynamics:
    """The same box with fresh momenta and a calculator of its own."""
    box = atoms.copy()
    box.calc = make_calculator(Settings())
    bodies, pose = rigid_bodies(box, shapes=SHAPES)
    heat(box, bodies, pose.attitude, 298.15, np.random.default_rng(5))
    return RigidDynamics(box, step_fs * fs, shapes=SHAPES)


def series(dynamics: RigidDynamics, steps: int) -> np.ndarray:
    """Kinetic energies on the step, their corrections and the potential energy, (steps, 5)."""
    rows = np.empty((steps, 5))
    for k in range(steps):
        dynamics.step()
        dynamics.nsteps += 1
        full = kinetic_energy(dynamics.bodies, dynamics.state.momentum, dynamics.state.angular)
        more = step_correction(dynamics.bodies, *dynamics.wrench(), dynamics.dt)
        rows[k] = (
            full.translation_ev,
            full.rotation_ev,
            more.translation_ev,
            more.rotation_ev,
            dynamics.atoms.get_potential_energy(),
        )
    return rows


def constant_energy(atoms: Atoms, step_fs: float, span_ps: float) -> dict[str, float]:
    """Thermometers, energy and cost of one run."""
    dynamics = dynamics_from(atoms, step_fs)
    series(dynamics, round(2000 / step_fs))  # 2 ps to forget the fresh momenta
    started = time.perf_counter()
    rows = series(dynamics, round(1000 * span_ps / step_fs))
    seconds = time.perf_counter() - started
    f = dynamics.degrees
    row: dict[str, float] = {
        "step_fs": step_fs,
        "span_ps": span_ps,
        "molecule_steps_per_s": len(rows) * MOLECULES / seconds,
    }
    for name, factor in THERMOMETERS.items():
        moving, turning = (
            2 * (rows[:, i] + factor * rows[:, i + 2]) / n for i, n in ((0, f.translation), (1, f.rotation))
        )
        blocks = [b.mean() for b in np.array_split(turning, BLOCKS)], [b.mean() for b in np.array_split(moving, BLOCKS)]
        row[f"{name}_ratio"] = turning.mean() / moving.mean()
        row[f"{name}_error"] = float(np.std(np.divide(*blocks), ddof=1) / math.sqrt(BLOCKS))
        row[f"{name}_rotation_k"] = turning.mean() / units.EV_PER_K
    energy = rows[:, 0] + rows[:, 1] + rows[:, 4]
    time_ns = np.arange(len(energy)) * step_fs * 1e-6
    row["energy_rms_kj_per_mol"] = energy.std() * 96.48533212331
    drifts = [
        np.polyfit(t, e, 1)[0] for t, e in zip(np.array_split(time_ns, 2), np.array_split(energy, 2), strict=True)
    ]
    row["drift_kt_per_ns_per_degree"] = float(np.polyfit(time_ns, energy, 1)[0] / (298.15 * units.EV_PER_K * f.total))
    row["drift_halves_differ_by"] = float(abs(drifts[0] - drifts[1]) / (298.15 * units.EV_PER_K * f.total))
    return row


class ByRotations(Flows):
    """Drifts by turns about three axes."""

    def drift(self, state: State, time: float) -> None:
        state.centres += state.momentum * (time / self.bodies.mass[:, None])
        RotationSplitting(step=abs(time)).drift(self.bodies.moments, state.spin, state.carry, time, 1, whole=False)


def drifts(atoms: Atoms, step_fs: float = 2.0) -> dict[str, dict[str, float]]:
    """Energy error over 2 ps and cost of a drift, for both splittings."""
    results = {}
    makers: dict[str, Callable[..., Flows]] = {"symmetric top and remainder": Flows, "three rotations": ByRotations}
    for name, make in makers.items():
        dynamics = dynamics_from(atoms, step_fs)
        dynamics._flows = make(dynamics.bodies)
        rows = series(dynamics, round(2000 / step_fs))
        energy = rows[:, 0] + rows[:, 1] + rows[:, 4]
        best = min(timed(lambda d=dynamics: d._flows.drift(d.state, 1e-9)) for _ in range(20))
        results[name] = {"energy_rms_kj_per_mol": energy.std() * 96.48533212331, "us_per_body": best / MOLECULES * 1e6}
    return results


def timed(job: Callable[[], None]) -> float:
    """Seconds of one of ten calls."""
    started = time.perf_counter()
    for _ in range(10):
        job()
    return (time.perf_counter() - started) / 10


def plot(rows: list[dict[str, float]], path: Path) -> None:
    """T_rot/T_trans over the step: by momenta on and between steps over that of the mixture, and the mixture itself."""
    from rotor.plots.picture import BLUE, ORANGE, new_figure, save, styled

    steps = np.array([row["step_fs"] for row in rows])
    h = np.linspace(0, 4.2, 200)
    s = np.maximum(0.5e-3 * LIBRATION_PER_PS * h, 1e-9)
    forms = {"full": s * np.sqrt(1 - s**2) / np.arcsin(s), "half": s / (np.sqrt(1 - s**2) * np.arcsin(s))}
    labels = {"full": "momenta on the step", "half": "momenta at half steps"}
    with styled():
        figure = new_figure((4.8, 3.4))
        axes = figure.add_subplot()
        for (name, form), colour in zip(forms.items(), (BLUE, ORANGE), strict=True):
            axes.plot(h, form, color=colour, lw=1, alpha=0.6)
            over = [row[f"{name}_ratio"] / row["mixed_ratio"] for row in rows]
            axes.plot(steps, over, "o", ms=5, color=colour, label=f"{labels[name]}, over the mixture")
        axes.axhline(1.0, color="black", lw=1, alpha=0.6)
        mixed, errors = ([row[f"mixed_{what}"] for row in rows] for what in ("ratio", "error"))
        axes.errorbar(
            steps, mixed, errors, fmt="s", ms=4, capsize=2, color="black", label="the mixture, with its error"
        )
        axes.set(
            xlabel="Step (fs)",
            ylabel="Temperature ratio $T_\\mathrm{rot}/T_\\mathrm{trans}$",
            title="SPC/E water at constant energy; lines: a libration of 112 rad/ps",
        )
        axes.legend(loc="lower left")
    save(figure, path, "Temperatures of water", {"made by": "benchmarks/bench_thermometers.py"})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--span-ps", type=float, default=100.0)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--plot", type=Path)
    options = parser.parse_args()
    atoms = liquid(20.0)
    result = {"drifts": drifts(atoms), "runs": []}
    print(json.dumps(result["drifts"], indent=1), flush=True)
    for step_fs in STEPS_FS:
        result["runs"].append(constant_energy(atoms, step_fs, options.span_ps))
        print({k: round(v, 5) for k, v in result["runs"][-1].items()}, flush=True)
        if options.json:
            options.json.write_text(json.dumps(result, indent=1, default=float) + "\n", encoding="utf-8")
    if options.plot:
        plot(result["runs"], options.plot)


if __name__ == "__main__":
    main()
