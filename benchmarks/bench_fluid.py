"""Rigid water at constant energy: molecule-steps per second and drift, ours beside OpenMM, LAMMPS and ASE's own, one core each.

    taskset -c 0 python benchmarks/bench_fluid.py speed drift ase [--json benchmarks/results/fluid.json]
        [--picture docs/pictures/fluid_drift.png]

speed: 1000 SPC/E molecules, cutoff 9 Å, 2 fs. drift: 216 molecules, steps from 0.25 to 6 fs, the same time each: rms of the
total energy about its line, and the line's slope. ase: TIP3P with FixBondLengths as ASE has it (27 molecules in its own test
of it; here 216), 1 fs. Rates are per second of processor time of the one thread, so that other work beside counts less;
the best of a few pieces, which take turns. Engines that are not installed are left out and listed. Figures that the file has
from other parts stay.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENMM_CPU_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from ase import Atoms, units
from ase.io import read, write

from rotor.fluids.engines import lammps, openmm
from rotor.fluids.engines.engine_input import make_engine_input
from rotor.fluids.engines.pair_tables import Form
from rotor.fluids.forces.models import find_model
from rotor.fluids.initial_box import lattice_box, relax
from rotor.fluids.run import make_calculator, make_dynamics
from rotor.fluids.settings import Settings
from rotor.fluids.summary import drift_per_ns

KJ_PER_MOL = units.mol / units.kJ
LAMMPS_RUN = """
import sys, time
from lammps import lammps
lmp = lammps(cmdargs=["-screen", "none", "-log", "none"] + sys.argv[2:])
lmp.file("in.box")
lmp.command(f"thermo {sys.argv[1]}")
lmp.command(f"run {sys.argv[1]} post no")
for _ in sys.stdin:
    begin = time.process_time()
    lmp.command(f"run {sys.argv[1]} pre no post no")
    print(time.process_time() - begin, flush=True)
"""


def water(model: str, molecules: int, folder: Path) -> Atoms:
    """An equilibrated box at 0.997 g/cm³ and 298.15 K with velocities, made once."""
    path = folder / f"{model}_{molecules}.extxyz"
    if not path.exists():
        atoms = lattice_box(find_model(model), molecules, 0.997, np.random.default_rng(11))
        settings = Settings(model=model, ensemble="langevin", friction_per_ps=10.0)
        atoms.calc = make_calculator(settings)
        relax(atoms)
        dynamics = make_dynamics(atoms, settings)
        for _ in range(5000):
            dynamics.step()
            dynamics.nsteps += 1
        atoms.calc = None
        write(path, atoms)
    return read(path)


def ours(atoms: Atoms, settings: Settings, steps: int) -> Iterator[float]:
    """Seconds of pieces of a run."""
    atoms.calc = make_calculator(settings)
    dynamics = make_dynamics(atoms, settings)
    while True:
        begin = time.process_time()
        for _ in range(steps):
            dynamics.step()
            dynamics.nsteps += 1
        yield time.process_time() - begin


def by_openmm(atoms: Atoms, settings: Settings, steps: int) -> Iterator[float]:
    """Seconds of pieces of a run, the barostat that measures pressure left out."""
    run = openmm.session(make_engine_input(atoms, settings), settings, accuracy=5e-4, platform="CPU")
    stepper = run.context.getIntegrator()
    while True:
        begin = time.process_time()
        stepper.step(steps)
        run.context.getState(positions=True)
        yield time.process_time() - begin


def by_lammps(
    atoms: Atoms, settings: Settings, steps: int, change: Callable[[str], str], arguments: list[str]
) -> Iterator[float]:
    """Seconds of pieces of a run in its own process, which waits for its turn; change: of the input file."""
    engine_input = make_engine_input(atoms, settings)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        lammps.write_files(folder, engine_input, settings, Form(), accuracy=1e-4)
        text = change((folder / "in.box").read_text(encoding="ascii"))
        (folder / "in.box").write_text(text, encoding="ascii")
        if "angle_style" in text:
            data = folder / "data.box"
            data.write_text(with_angles(data.read_text(encoding="ascii")), encoding="ascii")
        command = [sys.executable, "-c", LAMMPS_RUN, str(steps), *arguments]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        with subprocess.Popen(command, cwd=folder, env=lammps.environment(), text=True, **pipes) as process:
            assert process.stdin is not None
            assert process.stdout is not None
            try:
                while True:
                    process.stdin.write("go\n")
                    process.stdin.flush()
                    yield float(process.stdout.readline())
            finally:
                process.stdin.close()


def shaken(text: str) -> str:
    """The input with `fix shake` and `fix nve` in the place of rigid bodies."""
    text = text.replace("bond_style zero nocoeff", "bond_style harmonic\nangle_style harmonic")
    text = text.replace("bond_coeff *", "bond_coeff 1 10 1.0\nangle_coeff 1 10 109.4712206344907")
    moved = "fix move all nve\nfix hold all shake 1e-5 20 0 b 1 a 1"
    return "\n".join(moved if line.startswith("fix move") else line for line in text.splitlines()) + "\n"


def with_angles(text: str) -> str:
    """A data file of water with its H-O-H angles."""
    n = sum(bool(line.strip()) for line in text.split("Bonds")[1].splitlines()) // 2
    angles = "\n".join(f"{k + 1} 1 {3 * k + 2} {3 * k + 1} {3 * k + 3}" for k in range(n))
    head = text.replace("1 bond types", f"1 bond types\n{n} angles\n1 angle types\n3 extra angle per atom")
    return f"{head}\nAngles\n\n{angles}\n"


def speed(folder: Path, pieces: int = 6) -> dict[str, Any]:
    """Molecule-steps per second of processor time, the engines taking turns."""
    atoms, n, steps = water("spce", 1000, folder), 1000, 100
    field = Settings()
    mesh = replace(field, electrostatics="ewald")
    suffix = ["-sf", "opt"]
    cases: dict[str, Iterator[float]] = {
        "rotor, reaction field": ours(atoms.copy(), field, steps),
        "rotor, Ewald 1e-5": ours(atoms.copy(), mesh, steps // 4),
        "OpenMM, reaction field": by_openmm(atoms, field, steps),
        "OpenMM, PME 5e-4": by_openmm(atoms, mesh, steps),
        "LAMMPS rigid, reaction field as a table": by_lammps(atoms, field, steps, str, suffix),
        "LAMMPS rigid, lj/cut/coul/dsf": by_lammps(atoms, field, steps, damped, suffix),
        "LAMMPS shake, lj/cut/coul/dsf": by_lammps(atoms, field, steps, lambda text: shaken(damped(text)), suffix),
        "LAMMPS shake, lj/cut/coul/long, PPPM 1e-4": by_lammps(
            atoms, mesh, steps, lambda text: shaken(one_style(text)), suffix
        ),
        "LAMMPS rigid, lj/cut/coul/long, PPPM 1e-4": by_lammps(atoms, mesh, steps, one_style, suffix),
    }
    length = {"rotor, Ewald 1e-5": steps // 4}
    seconds: dict[str, list[float]] = {name: [] for name in cases}
    for case in cases.values():
        next(case)  # compiled, lists made
    for _ in range(pieces):
        for name, case in cases.items():
            seconds[name].append(next(case))
    table = {}
    for name, taken in seconds.items():
        rates = n * length.get(name, steps) / np.array(taken)
        table[name] = {"best": float(rates.max()), "median": float(np.median(rates))}
        print(f"{name:45s} {rates.max():10.3g} {np.median(rates):10.3g} molecule-steps/s")
    table["load"] = list(os.getloadavg())
    return table


def damped(text: str) -> str:
    """Lennard-Jones and damped shifted charges in one of LAMMPS' own pair styles, as most would run it."""
    return _pairs(text, "pair_style lj/cut/coul/dsf 0.2 9.0 9.0", [])


def one_style(text: str) -> str:
    """Lennard-Jones and Ewald's real part in one of LAMMPS' own pair styles, as most would run it."""
    return _pairs(text, "pair_style lj/cut/coul/long 9.0", ["kspace_style pppm 1e-4"])


def _pairs(text: str, style: str, after: list[str]) -> str:
    lines = [line for line in text.splitlines() if not line.startswith(("pair_", "kspace_"))]
    oxygen = find_model("spce").sites[0]
    mine = [style, "pair_coeff * * 0.0 1.0", f"pair_coeff 1 1 {oxygen.epsilon_ev} {oxygen.sigma_angstrom}", *after]
    at = next(k for k, line in enumerate(lines) if line.startswith("neighbor "))
    return "\n".join([*lines[:at], *mine, *lines[at:]]) + "\n"


def drift(folder: Path, ps: float) -> dict[str, Any]:
    """Errors of the total energy against the step, with the cost of a picosecond."""
    atoms, n = water("spce", 216, folder), 216
    table: dict[str, Any] = {}
    for step in (0.25, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0):
        steps = round(ps * 1000 / step)
        settings = Settings(step_fs=step, steps=steps, every=max(1, round(10 / step)))
        for name, run in (("rotor", our_energies), ("OpenMM", openmm_energies), ("LAMMPS", lammps_energies)):
            if name == "LAMMPS" and step < 1.0:
                continue  # its table of pairs makes it slow; its order shows without
            seconds, times, energy = run(atoms.copy(), settings)
            per_degree = energy / (6 * n - 3) / (units.kB * 298.15)
            slope, error = drift_per_ns(times, per_degree)
            rest = per_degree - np.polyval(np.polyfit(times, per_degree, 1), times)
            row = {"rms": float(np.std(rest)), "slope": slope, "error": error, "seconds_per_ps": seconds / ps}
            table.setdefault(name, {})[str(step)] = row
            print(
                f"{name:8s} {step:5.2f} fs", "  ".join(f"{key} {value:10.3g}" for key, value in row.items()), flush=True
            )
    return table


def our_energies(atoms: Atoms, settings: Settings) -> tuple[float, np.ndarray, np.ndarray]:
    """Processor time of the steps, times in ps and total energies in eV."""
    atoms.calc = make_calculator(settings)
    dynamics = make_dynamics(atoms, settings)

    def advance() -> None:
        for _ in range(settings.every):
            dynamics.step()
            dynamics.nsteps += 1

    return _followed(dynamics.conserved_energy, advance, settings)


def openmm_energies(atoms: Atoms, settings: Settings) -> tuple[float, np.ndarray, np.ndarray]:
    """The same by OpenMM, its velocities put back onto the step."""
    run = openmm.session(make_engine_input(atoms, settings), settings, platform="CPU")
    stepper = run.context.getIntegrator()

    def energy() -> float:
        _, motion, potential = run.state()
        return potential + motion.kicked(0.5 * run.step_classical).kinetic().total_ev

    return _followed(energy, lambda: stepper.step(settings.every), settings)


def _followed(
    energy: Callable[[], float], advance: Callable[[], None], settings: Settings
) -> tuple[float, np.ndarray, np.ndarray]:
    energies, seconds = [energy()], 0.0
    for _ in range(settings.steps // settings.every):
        begin = time.process_time()
        advance()
        seconds += time.process_time() - begin
        energies.append(energy())
    return seconds, settings.step_fs / 1000 * settings.every * np.arange(len(energies)), np.array(energies)


def lammps_energies(atoms: Atoms, settings: Settings) -> tuple[float, np.ndarray, np.ndarray]:
    """The same by LAMMPS (time of the wall: another process)."""
    begin = time.perf_counter()
    frames = list(lammps.frames(make_engine_input(atoms, settings), settings))
    energies = np.array([frame.potential_ev + frame.motion.kinetic().total_ev for frame in frames])
    return time.perf_counter() - begin, settings.step_fs / 1000 * settings.every * np.arange(len(energies)), energies


def by_ase(folder: Path, steps: int) -> dict[str, Any]:
    """ASE's own rigid water: TIP3P, FixBondLengths on all three distances, velocity Verlet; and ours with the same model."""
    from ase.calculators.tip3p import TIP3P, angleHOH, rOH
    from ase.constraints import FixBondLengths
    from ase.md.verlet import VelocityVerlet

    atoms, n, table = water("tip3p", 216, folder), 216, {}
    pairs = [(3 * k + i, 3 * k + j) for k in range(n) for i, j in ((0, 1), (0, 2), (1, 2))]
    assert abs(atoms.get_distance(0, 1) - rOH) < 1e-6
    assert abs(atoms.get_angle(1, 0, 2) - angleHOH) < 1e-4
    for step in (1.0, 2.0):
        theirs = atoms.copy()
        theirs.calc = TIP3P(rc=9.0)
        theirs.constraints = FixBondLengths(pairs, tolerance=1e-8)
        dynamics = VelocityVerlet(theirs, step * units.fs)
        energies, begin = [], time.process_time()
        for _ in range(steps):
            energies.append(theirs.get_total_energy())
            dynamics.run(1)
        seconds = time.process_time() - begin
        table[f"ASE, {step:g} fs"] = _fluctuation(np.array(energies), steps, seconds, n)
        mine = atoms.copy()
        settings = Settings(model="tip3p", step_fs=step, steps=steps, every=1)
        our_energies(mine.copy(), replace(settings, steps=20))
        seconds, _, energy = our_energies(mine, settings)
        table[f"rotor, {step:g} fs"] = _fluctuation(energy, steps, seconds, n)
    for name, row in table.items():
        print(f"{name:20s}", "  ".join(f"{key} {value:10.4g}" for key, value in row.items()))
    return table


def _fluctuation(energy: np.ndarray, steps: int, seconds: float, n: int) -> dict[str, float]:
    per_degree = energy / (6 * n - 3) / (units.kB * 298.15)
    times = np.arange(len(per_degree))
    line = np.polyfit(times, per_degree, 1)
    return {
        "molecule_steps_per_s": n * steps / seconds,
        "rms": float(np.std(per_degree - np.polyval(line, times))),
        "change": float(line[0] * times[-1]),
    }


def draw(table: dict[str, Any], picture: Path) -> None:
    """Energy error against step, and against cost."""
    from rotor.plots.picture import BLUE, GREEN, ORANGE, new_figure, save, styled

    looks = {"rotor": (ORANGE, "o"), "OpenMM": (BLUE, "s"), "LAMMPS": (GREEN, "^")}
    guide = np.array([0.5, 4.0])
    with styled():
        figure = new_figure((6.0, 3.6))
        left, right = figure.subplots(1, 2, sharey=True)
        for name, rows in table.items():
            rms, cost = (np.array([row[key] for row in rows.values()]) for key in ("rms", "seconds_per_ps"))
            color, marker = looks[name]
            left.loglog([float(step) for step in rows], rms, marker=marker, color=color, label=name, ms=4)
            if name != "LAMMPS":
                right.loglog(cost, rms, marker=marker, color=color, ms=4)
        left.loglog(guide, table["rotor"]["1.0"]["rms"] * guide**2, "k:", lw=1, label="order 2")
        left.set(xlabel="Step (fs)", ylabel="Rms error of the total energy\nper degree of freedom (kT)")
        right.set(xlabel="Processor time of a ps (s)")
        figure.suptitle("216 SPC/E molecules, reaction field, constant energy", x=0.01, ha="left")
        for axes, ticks in ((left, [0.25, 0.5, 1, 2, 4]), (right, [0.1, 0.2, 0.5, 1, 2, 4])):
            axes.set_xticks(ticks, map(str, ticks))
            axes.minorticks_off()
            axes.grid(alpha=0.3)
        figure.legend(loc="outside lower left", ncols=4)
    save(figure, picture, "Drift of rigid water", {"made by": "benchmarks/bench_fluid.py"})


def main() -> None:
    """Measure, print, keep, draw."""
    parser = argparse.ArgumentParser(description="speed and drift of rigid water")
    parser.add_argument("parts", nargs="+", choices=("speed", "drift", "ase"))
    parser.add_argument("--ps", type=float, default=10.0, help="of each run of the drift")
    parser.add_argument("--ase-steps", type=int, default=100)
    parser.add_argument("--boxes", type=Path, default=Path(tempfile.gettempdir()), help="folder that keeps the boxes")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--picture", type=Path)
    arguments = parser.parse_args()
    stored = (
        json.loads(arguments.json.read_text(encoding="utf-8")) if arguments.json and arguments.json.exists() else {}
    )
    parts = {
        "speed": lambda: speed(arguments.boxes),
        "drift": lambda: drift(arguments.boxes, arguments.ps),
        "ase": lambda: by_ase(arguments.boxes, arguments.ase_steps),
    }
    for part in arguments.parts:
        stored[part] = parts[part]()
    if arguments.json:
        arguments.json.write_text(json.dumps(stored, indent=1) + "\n", encoding="utf-8")
    if arguments.picture and "drift" in stored:
        draw(stored["drift"], arguments.picture)


if __name__ == "__main__":
    main()
