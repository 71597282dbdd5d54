"""Fit the constants of molecules/ND3.toml to lines/ND3.csv: `python data/make_heavy_ammonia.py` prints those of both inversion states.

The lines are measured ones of the ground state of 14ND3 with J up to 10 (E. Canè, G. Di Lonardo, L. Fusina, A. Predoi-Cross and
F. Tamassia, J. Mol. Spectrosc. 395 (2023) 111797, with those of earlier work), read in the list of experimental transitions of
github.com/oleksiysmola/MARVEL-ND3 (commit f34e910), with its errors: s is v = 0, a is v = 1. Those of K = 3 are left out, which the
constants here do not double (J₊⁶ + J₋⁶), and of rotation those with J from 3 to 5, whose errors are 7.5 MHz.

Weighted least squares, linear in the constants: B, C and distortion up to J⁶ of 0+, and what 0- has more, up to J⁸.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.solve import solve_levels
from rotor.tops.states.state_constants import StateConstants
from rotor.tops.top import Top

LINES = Path(__file__).with_name("lines") / "ND3.csv"
NAMES = ("B", "C", "DJ", "DJK", "DK", "HJ", "HJK", "HKJ", "HK")
MORE = (*NAMES, "LJ", "LJJK", "LJK", "LKKJ", "LK")  # of 0- less 0+
DIGITS = 1e-3  # of the change that a constant makes at J = 10, in MHz: what is printed


def slopes(quanta: np.ndarray, names: tuple[str, ...]) -> np.ndarray:
    """∂E/∂c of levels v, J, K (n, 3), as if all were of the upper state, by constants of it."""
    states = StateConstants({f"{name}[1]": 1e5 if name in "BC" else 0.0 for name in ("B", "C", *names)})
    top = Top.from_constants("B=154000 C=94000 MHz", states=states)
    levels = solve_levels(top, int(quanta[:, 1].max()))
    rows = levels.rows_of(v=np.ones(len(quanta), dtype=np.int64), j=quanta[:, 1], k=quanta[:, 2])
    return level_derivatives(top, levels, [f"{name}[1]" for name in names], rows)


def main() -> None:
    with LINES.open(encoding="utf-8") as handle:
        rows = [list(map(float, row.values())) for row in csv.DictReader(handle)]
    table = np.array(rows)
    upper, lower = table[:, :3].astype(np.int64), table[:, 3:6].astype(np.int64)
    common = slopes(upper, NAMES) - slopes(lower, NAMES)
    more = ("E", *MORE)
    excess = upper[:, :1] * slopes(upper, more) - lower[:, :1] * slopes(lower, more)
    matrix = np.hstack([common, excess]) / table[:, 7:]
    scale = np.linalg.norm(matrix, axis=0)
    found, *_ = np.linalg.lstsq(matrix / scale, table[:, 6] / table[:, 7], rcond=None)
    off = table[:, 6] / table[:, 7] - (matrix / scale) @ found
    values = found / scale
    first, differences = dict(zip(NAMES, values, strict=False)), dict(zip(more, values[len(NAMES) :], strict=True))

    for v, constants in ((0, first), (1, {name: first.get(name, 0.0) + d for name, d in differences.items()})):
        print(f"# v = {v}")
        for name, value in constants.items():
            size = np.abs(slopes(upper, (name,))).max()
            print(f"{name} = {value:.{max(int(np.ceil(np.log10(size / DIGITS))), 1)}f}")
    inversion = (upper[:, 1:] == lower[:, 1:]).all(axis=1)
    print(f"{inversion.sum()} lines of inversion: rms {np.sqrt(np.mean(off[inversion] ** 2)):.2f} errors, ", end="")
    print(
        f"{(~inversion).sum()} of rotation: {np.sqrt(np.mean(off[~inversion] ** 2)):.2f}; largest {np.abs(off).max():.1f}"
    )


if __name__ == "__main__":
    main()
