"""Write levels/*.csv: level energies of molecules whose distortion series does not converge, from JPL's catalogues.

`python data/make_levels.py PATH_TO_SHARED`, with the folder of reference files.

A catalogue (H. M. Pickett et al., J. Quant. Spectrosc. Radiat. Transfer 60 (1998) 883) prints frequencies, measured or computed
by its compilers, with errors, and the energy of each lower level in cm⁻¹ with four decimals. The energies here are the least
squares of all of these: E′ - E″ = ν with the catalogue's error, and E″ with that of its last digit; the lowest level is 0.
Lines tie levels of one nuclear-spin species to each other, E″ the species to each other and levels that no line joins.
"""

from __future__ import annotations

import csv
import gzip
import sys
from pathlib import Path

import numpy as np

from rotor import units
from rotor.formats.spcat.text.cat import read_cat
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.formats.spcat.text.fields import BLANK

FOLDER = Path(__file__).with_name("levels")
CATALOGUES = {"H2O": "c018003", "HDO": "c019002", "D2O": "c020001"}
ROUNDING_MHZ = 1e-4 * units.MHZ_PER_CM / np.sqrt(12)  # standard deviation of a number rounded in its last digit
LEAST_ERROR_MHZ = 1e-3  # some lines are given errors of 0
WORST_MHZ = 30.0  # levels that the catalogue knows worse, 0.001 cm-1, are left to the constants
COLUMNS = "j,ka,kc,energy_mhz,error_mhz,measured_lines"
HEAD = """\
# Level energies E/h in MHz of {name} from {tag} of JPL (H. M. Pickett et al., J. Quant. Spectrosc. Radiat. Transfer 60 (1998) 883):
# least squares of its frequencies and lower energies, by make_levels.py. error_mhz: one standard deviation, the catalogue's errors
# taken as such. measured_lines: how many lines measured in laboratories end in the level.
"""

Level = tuple[int, int, int]


def read_catalogue(shared: Path, tag: str) -> Catalogue:
    """A catalogue of the reference files, in whichever folder it is."""
    folders = (shared / "reference" / name for name in ("catalogues", "library_lines"))
    path = next(folder / f"{tag}.cat.gz" for folder in folders if (folder / f"{tag}.cat.gz").is_file())
    found = read_cat(gzip.decompress(path.read_bytes()))
    states = np.stack([found.quanta_upper[:, 3], found.quanta_lower[:, 3]])
    return found.take(np.isin(states, (0, BLANK)).all(axis=0))


def solved(found: Catalogue) -> tuple[dict[Level, tuple[float, float, int]], np.ndarray]:
    """Energy, error and measured lines of every level, and (measured - energies' difference)/error of the measured lines."""
    upper, lower = ([tuple(row) for row in q[:, :3].tolist()] for q in (found.quanta_upper, found.quanta_lower))
    levels = sorted(set(upper) | set(lower))
    row = {level: i for i, level in enumerate(levels)}
    up, low = (np.array([row[level] for level in ends]) for ends in (upper, lower))
    count, lines = len(levels), len(found.frequency_mhz)

    error = np.maximum(found.error_mhz, LEAST_ERROR_MHZ)
    design = np.zeros((2 * lines, count))
    design[np.arange(lines), up], design[np.arange(lines), low] = 1 / error, -1 / error
    design[lines + np.arange(lines), low] = 1 / ROUNDING_MHZ
    data = np.concatenate([found.frequency_mhz / error, found.energy_lower_cm * units.MHZ_PER_CM / ROUNDING_MHZ])
    once = np.unique(low, return_index=True)[1]  # E″ of a level is one number, however many lines repeat it
    kept = np.concatenate([np.arange(lines), lines + once])
    free = np.arange(count) != row[0, 0, 0]  # the zero of energy
    used = design[kept][:, free]
    scale = np.linalg.norm(used, axis=0)
    _, triangle = np.linalg.qr(used / scale)
    inverse = np.linalg.inv(triangle) / scale[:, None]
    energy, spread = np.zeros(count), np.zeros(count)
    energy[free] = inverse @ (inverse.T @ (used.T @ data[kept]))
    energy[free] += inverse @ (inverse.T @ (used.T @ (data[kept] - used @ energy[free])))  # once more, for round-off
    spread[free] = np.linalg.norm(inverse, axis=1)

    measured = found.tag < 0
    ends = np.concatenate([up[measured], low[measured]])
    times = np.bincount(ends, minlength=count)
    off = (found.frequency_mhz - (energy[up] - energy[low]))[measured] / error[measured]
    table = {level: (energy[i], spread[i], int(times[i])) for level, i in row.items()}
    return table, off


def main(shared: Path) -> None:
    FOLDER.mkdir(exist_ok=True)
    for name, tag in CATALOGUES.items():
        table, off = solved(read_catalogue(shared, tag))
        print(
            f"{name}: {len(table)} levels, {len(off)} measured lines, rms of (o-c)/error {np.sqrt(np.mean(off**2)):.2f}"
        )
        with (FOLDER / f"{name}.csv").open("w", encoding="utf-8", newline="") as file:
            file.write(HEAD.format(name=name, tag=tag) + COLUMNS + "\n")
            rows = csv.writer(file, lineterminator="\n")
            for (j, ka, kc), (energy, error, lines) in sorted(table.items()):
                if error > WORST_MHZ:
                    continue
                rows.writerow([j, ka, kc, f"{round(energy, 4) + 0.0:.4f}", f"{error:.2g}", lines])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
