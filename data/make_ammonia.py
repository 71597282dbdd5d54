"""Fit the constants of molecules/NH3.toml to levels/NH3.csv: `python data/make_ammonia.py` prints those of both inversion states.

The energies are empirical ones of the ground state of 14NH3, from lines measured in laboratories: T. Furtenbacher, P. A. Coles,
J. Tennyson et al., Empirical rovibrational energy levels of ammonia up to 7500 cm-1, J. Quant. Spectrosc. Radiat. Transfer (2020)
107027, read in the file 14NH3-MarvelEnergies-2020.txt of github.com/oleksiysmola/14NH3-MARVEL-2024, s as v = 0 and a as v = 1.

Each state has B, C and distortion up to J⁸, to which the energies are linear: least squares, first of the differences a - s, each
with one weight, then of all levels with their own errors. Levels of K = 3 above J = 3 are left out: J₊⁶ + J₋⁶ moves them by
1.7e-4 MHz (J+3)!/(J-3)!, up or down with the parity of J, 0.9 MHz at J = 4 and 200 MHz at J = 10, and the constants do not have it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rotor.formats.molecules.level_table import read_level_table
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.solve import solve_levels
from rotor.tops.states.state_constants import StateConstants
from rotor.tops.top import Top

NAMES = ("B", "C", "DJ", "DJK", "DK", "HJ", "HJK", "HKJ", "HK", "LJ", "LJJK", "LJK", "LKKJ", "LK")
TABLE = Path(__file__).with_name("levels") / "NH3.csv"
DIGITS = 1e-3  # of the change that a constant makes at J = 10, in MHz: what is printed


def design(quanta: dict[str, np.ndarray]) -> np.ndarray:
    """∂E/∂c of levels by E and the constants of the upper state, (n, 1 + constants)."""
    rigid = "B=298000 C=187000 MHz"
    states = StateConstants({f"{name}[1]": 1e5 if name in "BC" else 0.0 for name in ("E", *NAMES)})
    top = Top.from_constants(rigid, states=states)
    levels = solve_levels(top, int(quanta["j"].max()))
    rows = levels.rows_of(v=np.ones_like(quanta["j"]), j=quanta["j"], k=quanta["k"])
    return level_derivatives(top, levels, list(states.values), rows)


def least_squares(matrix: np.ndarray, values: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """The solution, columns scaled to one size."""
    scale = np.abs(matrix).max(axis=0)
    return np.linalg.lstsq(matrix / scale / errors[:, None], values / errors, rcond=None)[0] / scale


def main() -> None:
    table = read_level_table(TABLE)
    quanta, energy, error = dict(table.quanta), table.energy_mhz, table.error_mhz
    fitted = (quanta["k"] != 3) | (quanta["j"] <= 3)
    upper = np.flatnonzero(fitted & (quanta["v"] == 1))
    lower = table.rows_of({"v": np.zeros_like(upper), "j": quanta["j"][upper], "k": quanta["k"][upper]})
    upper, lower = upper[lower >= 0], lower[lower >= 0]

    matrix = design(quanta)
    differences = energy[upper] - energy[lower]
    excess = least_squares(
        matrix[upper], differences, np.ones(len(upper))
    )  # of the upper state's constants over the lower's
    own = energy - np.where(quanta["v"] == 1, matrix @ excess, 0.0)
    first = np.r_[0.0, least_squares(matrix[fitted, 1:], own[fitted], error[fitted])]

    digits = np.ceil(np.log10(np.abs(matrix).max(axis=0) / DIGITS)).astype(int)
    for v, values in ((0, first), (1, first + excess)):
        print(f"# v = {v}")
        for name, value, places in zip(("E", *NAMES), values, digits, strict=True):
            print(f"{name} = {value:.{max(places, 1)}f}")
    print(
        "differences, MHz: rms, largest",
        np.std(differences - matrix[upper] @ excess),
        np.abs(differences - matrix[upper] @ excess).max(),
    )
    apart = (own - matrix @ first)[fitted]
    print("levels, MHz: rms, largest", np.std(apart), np.abs(apart).max())


if __name__ == "__main__":
    main()
