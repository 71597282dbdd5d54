"""Fit constants of nuclear spins to the measured hyperfine lines of catalogues, and print them as lines of a molecule file.

`python data/make_spin_constants.py PATH_TO_SHARED [NAME ...]`, with the folder of reference files.

Only differences inside a rotational line count: the centre of each is free, so that errors of the rotational constants do no harm.
Components at one frequency are one line at their mean, weighted by intensity. Weighted least squares by Gauss and Newton, derivatives
by Hellmann and Feynman, of lines that the catalogue marks as measured (a negative tag). Of HNCO the calculated ones serve: two of the
measured components near 43,799 and 44,119 MHz do not fit their labels, and the constants of the catalogue's own fit come back exactly.
"""

from __future__ import annotations

import gzip
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rotor import read
from rotor.formats.spcat.text.cat import read_cat
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.levels import Levels
from rotor.quantum.solve import solve_levels
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.top import Top

WIDTH = {"linear": 1, "prolate": 2, "oblate": 2}  # quantum numbers of the rotation; of other tops 3


@dataclass(frozen=True)
class Fit:
    """What to fit: molecule, catalogue, constants to begin with, highest N and K, least error in MHz, measured lines or calculated."""

    molecule: str
    tag: str
    start: str
    n_max: int
    k_max: int = 99
    least_mhz: float = 1e-3
    measured: bool = True


FITS = {
    "CH3Cl": Fit("CH3Cl", "c050007", "chi_aa(35Cl)=-74.7 C_iso(35Cl)=0.001 MHz", 12),
    "HNCO": Fit("HNCO", "c043002", "chi_aa(14N)=2.05 chi_bb-cc(14N)=-1.5 MHz", 6, 1, 0.0, False),
}


class Line(NamedTuple):
    """Components at one frequency: quanta of both states of each, weights that add up to 1, and which rotational line it is of."""

    frequency_mhz: float
    error_mhz: float
    upper: list[tuple[int, ...]]
    lower: list[tuple[int, ...]]
    weights: np.ndarray
    centre: tuple[int, ...]


def read_catalogue(tag: str, shared: Path) -> Catalogue:
    """The catalogue of that name."""
    folders = (shared / "reference" / name for name in ("catalogues", "library_lines"))
    path = next(folder / f"{tag}.cat.gz" for folder in folders if (folder / f"{tag}.cat.gz").is_file())
    return read_cat(gzip.decompress(path.read_bytes()))


def split_lines(found: Catalogue, fit: Fit, width: int) -> list[Line]:
    """The lines, measured or calculated, whose rotational line has two of them or more, so that a splitting was seen."""
    up, low = np.abs(found.quanta_upper[:, : width + 1]), np.abs(found.quanta_lower[:, : width + 1])
    inside = ((found.tag < 0) == fit.measured) & (np.maximum(up[:, 0], low[:, 0]) <= fit.n_max)
    if width > 1:
        inside &= np.maximum(up[:, 1], low[:, 1]) <= fit.k_max
    together: dict[tuple[int, ...], dict[float, list[int]]] = {}
    for i in np.flatnonzero(inside).tolist():
        key = (*up[i, :width].tolist(), *low[i, :width].tolist())
        together.setdefault(key, {}).setdefault(float(found.frequency_mhz[i]), []).append(i)
    lines = []
    for key, groups in together.items():
        for frequency, rows in groups.items() if len(groups) > 1 else ():
            weights = 10.0 ** found.lgint[rows]
            error = max(float(found.error_mhz[rows].min()), fit.least_mhz)
            pairs = ([tuple(q[i].tolist()) for i in rows] for q in (up, low))
            lines.append(Line(frequency, error, *pairs, weights / weights.sum(), key))
    return lines


def rows_by_quanta(levels: Levels) -> dict[tuple[int, ...], int]:
    """Rows by n, (ka, kc | k) and F rounded up, as a catalogue writes it."""
    quanta = levels.quanta_of(np.arange(len(levels)))
    quanta[:, -1] = (quanta[:, -1] + 1) // 2 if "f" in levels.halves else quanta[:, -1]
    return {tuple(np.abs(q).tolist()): i for i, q in enumerate(quanta)}


def without_centres(values: np.ndarray, lines: list[Line], weights: np.ndarray) -> np.ndarray:
    """Values (lines, ...) less the weighted mean of their rotational line."""
    out = values.copy()
    keys = [line.centre for line in lines]
    for key in dict.fromkeys(keys):
        of_it = np.array([one == key for one in keys])
        out[of_it] -= np.average(values[of_it], axis=0, weights=weights[of_it] ** 2)
    return out


def fitted(fit: Fit, shared: Path) -> tuple[SpinConstants, list[str]]:
    """The constants with errors, and what is to be said of the fit."""
    top: Top = read(fit.molecule)
    lines = split_lines(read_catalogue(fit.tag, shared), fit, WIDTH.get(top.kind, 3))
    constants = SpinConstants.parse(fit.start)
    names = tuple(constants.values)
    weights = np.array([1 / line.error_mhz for line in lines])
    seen = np.array([line.frequency_mhz for line in lines])
    for _ in range(6):
        top = replace(top, spin_constants=constants)
        levels = solve_levels(top, fit.n_max, effects=effects_of(top, True))
        row, slopes = rows_by_quanta(levels), level_derivatives(top, levels, names)

        def mean(values: np.ndarray, row: dict[tuple[int, ...], int] = row) -> np.ndarray:
            return np.array(
                [
                    sum(
                        w * (values[row[u]] - values[row[v]])
                        for u, v, w in zip(x.upper, x.lower, x.weights, strict=True)
                    )
                    for x in lines
                ]
            )

        residuals = without_centres(seen - mean(levels.energy_mhz), lines, weights) * weights
        design = without_centres(mean(slopes), lines, weights) * weights[:, None]
        step, *_ = np.linalg.lstsq(design, residuals, rcond=None)
        constants = replace(
            constants, values={n: constants.values[n] + float(d) for n, d in zip(names, step, strict=True)}
        )
    left = residuals - design @ step
    free = len(lines) - len({line.centre for line in lines}) - len(names)
    covariance = np.linalg.inv(design.T @ design)
    errors = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    chi = float(np.sqrt(left @ left / free))
    kind, count = "measured" if fit.measured else "calculated", len({line.centre for line in lines})
    rms = float(np.sqrt(np.mean((left / weights) ** 2)))
    said = f"{len(lines)} {kind} lines of {count} rotational lines; reduced chi {chi:.2g}, rms {rms:.2g} MHz"
    return replace(constants, uncertainties=errors), [said]


def main() -> None:
    shared, *chosen = sys.argv[1:]
    for name in chosen or FITS:
        constants, said = fitted(FITS[name], Path(shared))
        print(f"# {name}: {'; '.join(said)}")
        for key, value in constants.values.items():
            print(f"{key} = {{ value = {value:.6g}, uncertainty = {constants.uncertainties[key]:.2g} }}")


if __name__ == "__main__":
    main()
