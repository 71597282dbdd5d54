"""Fit the constants of the library's files to the measured lines of their catalogues anew, and write them with their covariance.

`python data/make_constants.py PATH_TO_SHARED [NAME ...]`, with the folder of reference files, rewrites [constants] and [covariance]
of `data/molecules/NAME.toml` (all of FITS without names). `docs/make_library.py` and `docs/make_measured_lines.py` come after it.

It is the fit of `rotor fit`: weighted least squares, blends as one frequency, of lines that the catalogue marks as measured (a
negative tag) within the J and K of the file's [catalogue], none with an error below `least_mhz`, from the constants that the file has.
Where lines leave constants open, level energies of the catalogue count too (cm⁻¹ with four decimals, taken at 0.9 MHz). Standard
errors are multiplied by the reduced chi where that is above 1. Of molecules without a catalogue among the reference files, the
lines are those of `data/lines/NAME.csv`, whose source stands in FITS.
"""

from __future__ import annotations

import importlib.util
import re
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rotor.fitting.assignment import Assignments, assignments, merged
from rotor.fitting.fit import FitOptions, fit_lines
from rotor.fitting.parameters import parameters
from rotor.fitting.result import Fit
from rotor.formats.atomic_write import open_atomic
from rotor.formats.lines.assigned_lines import QUANTA, read_assigned_lines
from rotor.formats.molecules.molecule_file import MoleculeFile, read_molecule_file
from rotor.formats.spcat.text.cat import read_cat
from rotor.tops.constants.constants import Constants
from rotor.units import MHZ_PER_CM

MOLECULES = Path(__file__).with_name("molecules")
LINES = Path(__file__).with_name("lines")
ROUNDING_MHZ = 0.9


@dataclass(frozen=True)
class Fitted:
    """What is particular to a fit: smallest error of a line in MHz, highest J and K of level energies that count, a remark.

    `lines` is where the lines of `data/lines/NAME.csv` are from; without it they are those of the catalogue.
    """

    least_mhz: float = 0.0
    energies: tuple[int, int] | None = None
    note: str = ""
    lines: str = ""


FITS = {
    "OCS": Fitted(), "HC3N": Fitted(), "HC5N": Fitted(1e-3), "N2O": Fitted(1e-3),
    "HCN": Fitted(note="the quadrupole splitting of 14N is not resolved in them"),
    "CH3CCH": Fitted(energies=(20, 12)), "CH2CO": Fitted(energies=(20, 9)), "H2CS": Fitted(energies=(20, 12)),
    "SO2": Fitted(), "c-C2H4O": Fitted(energies=(20, 20)), "CH2OHCHO": Fitted(energies=(20, 15)),
    "HCONH2": Fitted(energies=(20, 15)), "HCOOH": Fitted(energies=(20, 15)), "HNCO": Fitted(0.03),
    "H2S": Fitted(0.05, (10, 10)), "D2O": Fitted(0.02, (12, 6)), "HDO": Fitted(0.1, (10, 6)), "H2O": Fitted(0.1),
    "H2": Fitted(
        lines="S0(0) to S0(5) of E. Roueff et al., Astron. Astrophys. 630 (2019) A58, table 2, as the package pdrtpy 3.0.1 has it",
        note="four terms of a slowly converging series, taken at 0.0001 cm-1",
    ),
    "HCl": Fitted(
        lines="1H35Cl, centroids of the quadrupole splitting of 35Cl, of JPL's list as LAMDA has it (HCl rotation-hyperfine "
        "spectrum, version 3 of May 2012), read in the tests of the program pythonradex (commit 84cd8ce1)",
    ),
    "O3": Fitted(
        lines="the vibrational ground state, J <= 14, Ka <= 5, of P. W. Rosenkranz's list of 2022 (catalogued frequencies to "
        "0.01 MHz) as the package pyrtlib 1.2.0 has it; five of its lines that no level of the ground state explains left out",
        note="the list's other 74 lines of J <= 20, Ka <= 6 are met within 0.6 MHz",
    ),
}  # fmt: skip


def observations(name: str, file: MoleculeFile, shared: Path) -> tuple[Assignments, Assignments | None]:
    """The measured lines of a molecule, and its level energies as lines from the lowest level, None where they do not count."""
    assert file.constants is not None
    if FITS[name].lines:
        return read_assigned_lines(LINES / f"{name}.csv", QUANTA[file.constants.kind])[0], None
    assert file.catalogue is not None
    folders = (shared / "reference" / one for one in ("catalogues", "library_lines"))
    path = next(one for folder in folders if (one := folder / f"{file.catalogue.tag}.cat.gz").is_file())
    names = QUANTA[file.constants.kind]
    lines, _ = read_assigned_lines(path, names)
    lines = lines.take(_inside(lines, file.catalogue.j_max or 10**6, file.catalogue.k_max))
    errors = np.maximum(lines.error_mhz, FITS[name].least_mhz)
    lines = assignments(
        names,
        lines.upper,
        lines.lower,
        lines.frequency_mhz,
        errors,
        weight=lines.weight,
        blend=lines.blend,
        source=lines.source,
    )
    limits = FITS[name].energies
    return lines, _energies(path, names, *limits) if limits else None


def _inside(lines: Assignments, j_max: int, k_max: int | None) -> np.ndarray:
    both = np.abs(np.stack([lines.upper, lines.lower]))
    inside = (both[..., 0] <= j_max).all(axis=0)
    return inside & (both[..., 1] <= k_max).all(axis=0) if k_max is not None and both.shape[2] > 1 else inside


def _energies(path: Path, names: tuple[str, ...], j_max: int, k_max: int) -> Assignments:
    """Lower energies of all lines of the catalogue, each level once, at the mean of what is printed."""
    found = read_cat(path)
    width = len(names)
    beyond = found.quanta_lower[:, width:]
    labels = np.abs(found.quanta_lower[:, :width].astype(np.int64))
    chosen = (beyond <= 0).all(axis=1) & (labels[:, 0] <= j_max) & (labels[:, 1] <= k_max)
    levels, place = np.unique(labels[chosen], axis=0, return_inverse=True)
    place = place.reshape(-1)
    mean = np.bincount(place, found.energy_lower_cm[chosen]) / np.bincount(place) * MHZ_PER_CM
    rows = levels[:, 0] > 0
    return assignments(names, levels[rows], np.zeros_like(levels[rows]), mean[rows], ROUNDING_MHZ, source="energies")


def fitted(name: str, shared: Path, start: Constants | None = None) -> tuple[Fit, float, int]:
    """The fit, √(χ²/lines) of its lines alone, and how many level energies counted."""
    file = read_molecule_file(MOLECULES / f"{name}.toml")
    lines, energies = observations(name, file, shared)
    assert file.constants is not None
    start = start or file.constants
    both = merged(lines, energies)[0] if energies is not None else lines
    free = parameters(start, list(file.constants.uncertainties))
    fit = fit_lines(both, start, free, FitOptions())
    of_lines = fit.residuals[fit.groups < len(lines)]
    count = max(len(of_lines) - (0 if energies is not None else len(free.names)), 1)
    return fit, float(np.sqrt(of_lines @ of_lines / count)), 0 if energies is None else len(energies)


def rewritten(text: str, name: str, fit: Fit, chi: float, energies: int) -> str:
    """The text of a molecule's file with the constants, standard errors, correlations and source of a fit."""
    assert fit.constants is not None
    scale = max(chi, 1.0)
    for key, error in fit.constants.uncertainties.items():
        line = f"{key} = {{ value = {fit.constants[key]:.15g}, uncertainty = {error * scale:.9e} }}"
        text, count = re.subn(rf"^{re.escape(key)} = \{{.*\}}$", line, text, flags=re.MULTILINE)
        assert count == 1, key
    text = re.sub(r"\n\[covariance\]\n[^\[]*\[[^\]]*\]\n[^\[]*\[\n(?: .*\n)*\]\n", "", text)
    head, _, rest = text.partition("[constants]\n")
    rest = re.sub(
        r'source = "(fitted.*)"',
        lambda old: f'source = "{_source(old[1], name, len(fit.lines) - energies, chi, energies)}"',
        rest,
        count=1,
    )
    body, _, after = rest.partition("\n\n")
    return head + "[constants]\n" + body + "\n\n" + _covariance(fit) + "\n" + after


def _source(old: str, name: str, lines: int, chi: float, energies: int) -> str:
    """What the file says of its constants: the catalogue and the range as it said before, the rest of the fit made now."""
    one = FITS[name]
    if one.lines:
        text = f"fitted by data/make_constants.py to the {lines} lines of data/lines/{name}.csv: {one.lines}; reduced chi {chi:.2g}"
        return text + (f"; {one.note}" if one.note else "")
    catalogue = re.search(r"of (c\d+ of \w+ \([^)]*\))", old)
    span = re.search(r"with (J <= \d+(?:, Ka? <= \d+)?)", old)
    assert catalogue is not None
    text = f"fitted by data/make_constants.py to the {lines} measured lines of {catalogue[1]}"
    text += f" with {span[1]}" if span else ""
    text += ", weighted by their errors" + (f", none below {one.least_mhz:g} MHz" if one.least_mhz else "")
    if one.energies:
        text += f", and to {energies} of its level energies (J <= {one.energies[0]}, K <= {one.energies[1]}; cm-1 with 4 decimals, "
        text += "taken at 0.9 MHz), which hold what the lines leave open"
    text += f"; reduced chi of the lines {chi:.2g}"
    return text + (f"; {one.note}" if one.note else "")


def _covariance(fit: Fit) -> str:
    found = fit.covariance
    rows = [
        "    [" + ", ".join(f"{value:.15g}" for value in row[: i + 1]) + "],\n"
        for i, row in enumerate(found.correlations.tolist())
    ]
    names = ", ".join(f'"{name}"' for name in found.names)
    return f"[covariance]\nnames = [{names}]\ncorrelations = [\n{''.join(rows)}]\n"


def _write(path: Path, text: str) -> None:
    with open_atomic(path, "w", encoding="utf-8") as handle:
        handle.write(text)


def _with_measures(path: Path, shared: Path) -> str:
    """The text of a file with rms of its lines, and by how much a line in the range it serves may be missed, as they are now."""
    spec = importlib.util.spec_from_file_location("make_library", path.parents[2] / "docs" / "make_library.py")
    assert spec is not None
    assert spec.loader is not None
    library = sys.modules["make_library"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(library)
    file, text = read_molecule_file(path), path.read_text(encoding="utf-8")
    if file.catalogue is None:
        return text
    off = library.residuals(file, library.measured_lines(file, shared))
    text = re.sub(r"rms_mhz = .*", f"rms_mhz = {np.sqrt(np.mean(off**2)):.3g}", text)
    missed = float(library.served(file, shared)[1].max())
    if not missed <= file.serves.error_mhz <= max(1.3 * missed, 1e-3):
        text = re.sub(r"error_mhz = .*", f"error_mhz = {max(1.1 * missed, 1e-3):.2g}", text)
    return text


def main(shared: Path, names: list[str]) -> None:
    for name in names or FITS:
        path = MOLECULES / f"{name}.toml"
        before = read_molecule_file(path).constants
        fit, chi, energies = fitted(name, shared)
        assert before is not None
        assert fit.constants is not None
        moved = {
            key: (fit.constants[key] - before[key]) / (fit.constants.uncertainties[key] * max(chi, 1.0))
            for key in before.uncertainties
        }
        worst = max(moved, key=lambda key: abs(moved[key]))
        print(
            f"{name}: {fit.reason}; {len(fit.lines) - energies} lines, {energies} energies, reduced chi {chi:.3g}; "
            f"{worst} moved by {moved[worst]:+.2g} standard errors"
        )
        if not fit.converged or not np.isfinite(fit.errors).all():
            raise ValueError(f"{name}: not written: {fit.reason}")
        _write(path, rewritten(path.read_text(encoding="utf-8"), name, fit, chi, energies))
        _write(path, _with_measures(path, shared))


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
