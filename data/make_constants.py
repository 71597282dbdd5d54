"""Fit the constants of D2O, HNCO, N2O, H2CS and HC5N to their catalogues, and print them as lines of a molecule file.

`python data/make_constants.py PATH_TO_SHARED [NAME ...]`, with the folder of reference files.

Weighted least squares by Gauss and Newton, derivatives by Hellmann and Feynman, of lines that the catalogue marks as measured
(a negative tag), none with an error below `least_mhz`, and of its lower energies (cm⁻¹ with four decimals, taken at 0.9 MHz),
which hold what the lines leave open. Hyperfine components of one line are put together at their mean, weighted by intensity.
"""

from __future__ import annotations

import gzip
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rotor import units
from rotor.formats.spcat.cat import read_cat
from rotor.formats.spcat.catalogue import Catalogue
from rotor.quantum.derivatives import level_derivatives
from rotor.quantum.solve import solve_levels
from rotor.tops.constants import Constants
from rotor.tops.top import Top

ROUNDING_MHZ = 0.9
SPAN = 1e-12  # of the largest singular value, below which a combination of constants is left where it is


@dataclass(frozen=True)
class Fit:
    """What to fit: catalogue, where to start, highest J and K, smallest error of a line, whether E″ count, what is held."""

    tag: str
    start: Constants
    j_max: int
    k_max: int = 0
    least_mhz: float = 1e-3
    energies: bool = True
    held: tuple[str, ...] = ()


S_QUARTIC = ("DJ", "DJK", "DK", "d1", "d2")
S_SEXTIC = ("HJ", "HJK", "HKJ", "HK", "h1", "h2", "h3")
S_OCTIC = ("LJ", "LJJK", "LJK", "LKKJ", "LK", "l1", "l2", "l3", "l4")


def _s_reduced(a: float, b: float, c: float, names: tuple[str, ...]) -> Constants:
    return Constants(A=a, B=b, C=c, reduction="S", representation="Ir", **dict.fromkeys(names, 1e-30))


FITS = {
    "D2O": Fit("c020001", _s_reduced(462300.0, 218014.0, 145277.0, S_QUARTIC + S_SEXTIC + S_OCTIC), 12, 6, 0.02),
    # Quasilinear: Ka = 0 and 1 alone, since D_K K⁴ (some GHz) and what follows turn the levels of Ka > 10 upside down
    "HNCO": Fit(
        "c043002",
        _s_reduced(912711.0, 11071.0, 10910.6, ("DJ", "DJK", "d1", "HJ", "HJK", "h1")),
        50,
        1,
        0.03,
        energies=False,
    ),
    "N2O": Fit("c044004", Constants(B=12561.6338, D=5.28e-3, H=1e-30), 104, energies=False),
    "H2CS": Fit(
        "c046509",
        _s_reduced(
            291613.3, 17699.0, 16652.5, (*S_QUARTIC, *S_SEXTIC, "LJK", "LKKJ", "LK", "l2")
        ),
        60,
        12,
    ),
    "HC5N": Fit("c075503", Constants(B=1331.3327, D=3.01e-5, H=1e-30), 199, energies=False),
}  # fmt: skip


def observations(fit: Fit, shared: Path) -> list[tuple[tuple[int, ...], tuple[int, ...] | None, float, float]]:
    """Upper level, lower level (None: the lowest of all), frequency or energy in MHz, error in MHz."""
    folders = (shared / "reference" / name for name in ("catalogues", "library_lines"))
    path = next(folder / f"{fit.tag}.cat.gz" for folder in folders if (folder / f"{fit.tag}.cat.gz").is_file())
    found = read_cat(gzip.decompress(path.read_bytes()))
    width = 1 if fit.start.kind == "linear" else 3
    lines: dict[tuple[tuple[int, ...], tuple[int, ...]], list[int]] = {}
    for i in np.flatnonzero(_in_range(found, fit, width)).tolist():
        key = (tuple(found.quanta_upper[i, :width].tolist()), tuple(found.quanta_lower[i, :width].tolist()))
        lines.setdefault(key, []).append(i)
    out: list[tuple[tuple[int, ...], tuple[int, ...] | None, float, float]] = []
    energies: dict[tuple[int, ...], float] = {}
    for (upper, lower), rows in lines.items():
        energies.setdefault(lower, float(np.mean(found.energy_lower_cm[rows])) * units.MHZ_PER_CM)
        rows = [i for i in rows if found.tag[i] < 0]
        if rows:
            weight = 10 ** found.lgint[rows]
            error = max(float(np.min(found.error_mhz[rows])), fit.least_mhz)
            out.append((upper, lower, float(np.average(found.frequency_mhz[rows], weights=weight)), error))
    if fit.energies:
        out += [(level, None, energy, ROUNDING_MHZ) for level, energy in energies.items()]
    return out


def _in_range(found: Catalogue, fit: Fit, width: int) -> np.ndarray:
    quanta = np.abs(np.stack([found.quanta_upper, found.quanta_lower]))
    inside = (quanta[..., 0] <= fit.j_max).all(axis=0)
    return inside & (quanta[..., 1] <= fit.k_max).all(axis=0) if width > 1 else inside


def fitted(fit: Fit, shared: Path) -> tuple[Constants, list[str]]:
    """Constants with uncertainties, and what is to be said of the fit."""
    seen = observations(fit, shared)
    constants = fit.start
    names = tuple(name for name in constants.values if name not in fit.held)
    value, error = (np.array([row[i] for row in seen]) for i in (2, 3))
    for _ in range(12):
        top = Top.from_constants(constants)
        levels = solve_levels(top, fit.j_max)
        quanta = levels.quanta_of(np.arange(len(levels)))
        row = {tuple(q): i for i, q in enumerate(quanta.tolist())}
        slopes = level_derivatives(top, levels, names)
        up = np.array([row[upper] for upper, *_ in seen])
        low = np.array([0 if lower is None else row[lower] for _, lower, *_ in seen])
        off = (value - (levels.energy_mhz[up] - levels.energy_mhz[low])) / error
        design = (slopes[up] - slopes[low]) / error[:, None]
        scale = np.linalg.norm(design, axis=0)
        u, s, vt = np.linalg.svd(design / scale, full_matrices=False)
        kept = s > SPAN * s[0]
        step = (vt[kept].T @ ((u[:, kept].T @ off) / s[kept])) / scale
        spread = np.sqrt(np.sum((vt[kept].T / s[kept]) ** 2, axis=1)) / scale
        values = dict(constants.values)
        values |= {name: values[name] + float(d) for name, d in zip(names, step, strict=True)}
        settings = {
            "reduction": constants.reduction,
            "representation": constants.representation,
            "kind": constants.kind,
        }
        constants = Constants(**settings, **values)  # type: ignore[arg-type]
        if np.all(np.abs(step) < 1e-3 * spread):
            break
    return constants, _report(names, constants, spread, seen, off, error)


def _report(
    names: tuple[str, ...],
    constants: Constants,
    spread: np.ndarray,
    seen: list[tuple[tuple[int, ...], tuple[int, ...] | None, float, float]],
    off: np.ndarray,
    error: np.ndarray,
) -> list[str]:
    """How well the fit does, the lines of a molecule file, and the six worst observations."""
    lines = np.array([lower is not None for _, lower, *_ in seen])
    mhz = np.abs(off * error)[lines]
    chi = float(np.sqrt(np.sum(off[lines] ** 2) / max(lines.sum() - len(names), 1)))
    of_energies = np.sqrt(np.mean((off * error)[~lines] ** 2)) if (~lines).any() else 0.0
    said = [
        f"# {lines.sum()} lines, {(~lines).sum()} energies; reduced chi of the lines {chi:.2g}; rms "
        f"{np.sqrt(np.mean(mhz**2)):.3g}, median {np.median(mhz):.2g}, worst {mhz.max():.3g} MHz; energies rms {of_energies:.2g} MHz"
    ]
    for name, one in zip(names, spread.tolist(), strict=True):
        digits = max(1, int(np.ceil(np.log10(abs(constants[name]) / (one * 0.01)))))
        said.append(f"{name} = {{ value = {constants[name]:.{digits}g}, uncertainty = {one * max(chi, 1.0):.2g} }}")
    worst = np.argsort(-np.abs(off) * lines)[:6]
    said += [f"# {seen[i][0]} {seen[i][1]} {seen[i][2]:.3f} {off[i] * error[i]:+.3f} ({error[i]:.3f})" for i in worst]
    return said


if __name__ == "__main__":
    for name in sys.argv[2:] or FITS:
        print(f"# {name}", *fitted(FITS[name], Path(sys.argv[1]))[1], sep="\n")
