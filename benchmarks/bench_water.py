"""Liquid water through three engines: energy, pressure, pair distribution, diffusion and drift of one box, with errors.

    python benchmarks/bench_water.py rotor openmm lammps [--model spce] [--electrostatics ewald] [--molecules 216] [--ps 200]
        [--json benchmarks/results/water.json]

A lattice at 0.997 g/cm³ is relaxed, held at 298.15 K for 20 ps by Langevin's thermostat, and given the mean total energy of
another 20 ps; from there every engine runs at constant energy with steps of 2 fs. Figures that the file has from other
engines stay, so that engines can be run one by one; the box is stored beside the file.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from ase import Atoms, units
from ase.io import read, write

from rotor.fluids.analysis import block_errors, diffusion, pair_distribution, yeh_hummer_correction
from rotor.fluids.engines.results import run_engine
from rotor.fluids.forces.models import find_model
from rotor.fluids.forces.potential import RigidPotential
from rotor.fluids.initial_box import lattice_box, relax
from rotor.fluids.record import FluidRecord
from rotor.fluids.run import make_dynamics, pressure_bar
from rotor.fluids.settings import Settings
from rotor.fluids.summary import drift_per_ns, series_mean

KJ_PER_MOL = units.mol / units.kJ  # of 1 eV
VISCOSITY = 0.729e-3  # Pa s, SPC/E at 298 K: M. A. González and J. L. F. Abascal, J. Chem. Phys. 132, 096101 (2010)


def potential(settings: Settings) -> RigidPotential:
    """Our calculator."""
    return RigidPotential(
        settings.model, cutoff_angstrom=settings.cutoff_angstrom, electrostatics=settings.electrostatics
    )


def ours(atoms: Atoms, settings: Settings) -> tuple[FluidRecord, np.ndarray]:
    """Run with our dynamics: the table with the molecular pressure, and the path of the atoms."""
    atoms.calc = potential(settings)
    dynamics, rows, path = make_dynamics(atoms, settings), [], []
    for step in range(settings.steps + 1):
        if step % settings.every == 0:
            kinetic, heat = dynamics.kinetic(), dynamics.temperatures()
            row = [step * settings.step_fs / 1000, atoms.get_potential_energy(), kinetic.translation_ev]
            row += [kinetic.rotation_ev, dynamics.conserved_energy(), heat.all_k, heat.translation_k, heat.rotation_k]
            rows.append([*row, pressure_bar(dynamics)])
            path.append(atoms.positions.copy())
        if step < settings.steps:
            dynamics.step()
            dynamics.nsteps += 1
    return FluidRecord(*np.array(rows).T), np.array(path)


def start(settings: Settings, molecules: int, box: Path) -> Atoms:
    """The equilibrated box with velocities, made once."""
    if not box.exists():
        atoms = lattice_box(find_model(settings.model), molecules, 0.997, np.random.default_rng(7))
        atoms.calc = potential(settings)
        relax(atoms)
        for friction, interval in ((10.0, 1000), (2.0, 50)):
            warm = replace(settings, ensemble="langevin", friction_per_ps=friction, steps=10_000, every=interval)
            record, _ = ours(atoms, warm)
        # the mean energy of the ensemble is potential + f kT/2; the momenta are scaled to it
        energy = float(np.mean(record.potential_ev)) + (6 * molecules - 3) / 2 * units.kB * settings.temperature_k
        dynamics = make_dynamics(atoms, settings)
        expected = energy - atoms.get_potential_energy()
        atoms.set_momenta(atoms.get_momenta() * np.sqrt(expected / dynamics.kinetic("full").total_ev))
        atoms.calc = None
        write(box, atoms)
    return read(box)


def measured(engine: str, atoms: Atoms, settings: Settings) -> dict[str, Any]:
    """All figures of one engine."""
    begin = time.perf_counter()
    if engine == "rotor":
        record, path = ours(atoms, settings)
    else:
        run = run_engine(engine, atoms, settings)
        record, path = run.record, run.positions_angstrom
    seconds = time.perf_counter() - begin
    oxygen = path[:, [i for i, s in enumerate(atoms.get_chemical_symbols()) if s == "O"]]
    molecules = oxygen.shape[1]
    edges = np.diag(np.asarray(atoms.cell))
    table: dict[str, Any] = {"molecules": molecules, "ns": float(record.time_ps[-1] / 1000), "seconds": seconds}
    for name, series in (
        ("energy_kj_per_mol", record.potential_ev * KJ_PER_MOL / molecules),
        ("temperature_k", record.temperature_k),
        ("rotation_k", record.rotation_k),
        ("translation_k", record.translation_k),
        ("pressure_bar", record.pressure_bar[1:]),
    ):
        # the slow share of the correlations of water is small and long: blocks of an eighth of the run see it
        table[name] = [
            float(np.mean(series)),
            float(max(series_mean(name, "", series).error, *block_errors(series)[-2:])),
        ]
    shells = [pair_distribution(part, edges, edges.min() / 2, 180) for part in np.array_split(oxygen[::4], 5)]
    peaks = np.array([shell.first_peak() for shell in shells])
    table["first_peak_angstrom"], table["first_peak_height"] = (
        [float(peaks[:, k].mean()), float(peaks[:, k].std(ddof=1) / np.sqrt(5))] for k in (0, 1)
    )
    g = np.mean([shell.g for shell in shells], axis=0)
    table["g"] = [np.round(shells[0].r_angstrom, 4).tolist(), np.round(g, 4).tolist()]
    interval = float(record.time_ps[1] - record.time_ps[0])
    transport = diffusion(oxygen, interval)
    endless = yeh_hummer_correction(transport, float(np.mean(record.temperature_k)), VISCOSITY, float(edges[0]))
    table["diffusion_1e9_m2_per_s"] = [transport.value * 1e9, transport.error * 1e9]
    table["diffusion_endless_box"] = endless.corrected * 1e9
    slope, error = drift_per_ns(record.time_ps, record.total_ev / (6 * molecules - 3) / (units.kB * 298.15))
    table["drift_kt_per_degree_per_ns"] = [slope, error]
    return table


def main() -> None:
    """Run, print, keep."""
    parser = argparse.ArgumentParser(description="liquid water through several engines")
    parser.add_argument("engines", nargs="+", choices=("rotor", "openmm", "lammps"))
    parser.add_argument("--model", default="spce")
    parser.add_argument("--electrostatics", default="ewald")
    parser.add_argument("--molecules", type=int, default=216)
    parser.add_argument("--ps", type=float, default=200.0)
    parser.add_argument("--box", type=Path, default=Path("water.extxyz"), help="made if it is not there")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    settings = Settings(
        model=arguments.model,
        electrostatics=arguments.electrostatics,
        steps=round(arguments.ps * 500),
        every=25,
        cutoff_angstrom=9.0,
    )
    for engine in arguments.engines:
        table = measured(engine, start(settings, arguments.molecules, arguments.box), settings)
        for name, value in table.items():
            if name != "g":
                print(f"{engine:8s} {name:35s} {value}", flush=True)
        if arguments.json:
            stored = json.loads(arguments.json.read_text(encoding="utf-8")) if arguments.json.exists() else {}
            stored[f"{arguments.model}, {arguments.electrostatics}, {engine}"] = table
            arguments.json.write_text(
                json.dumps(stored, indent=None, separators=(",", ":")).replace('"},', '"},\n') + "\n", encoding="utf-8"
            )


if __name__ == "__main__":
    main()
