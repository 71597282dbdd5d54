"""A family of isotopologues as a TOML file: a start geometry, constants of each, what is to be fitted.

name = "OCS"

[geometry]                                    # good enough to decide axes and signs; the isotopes of the parent
atoms = [["O", 0, 0, 1.16], ["C", 0, 0, 0], ["S", 0, 0, -1.56]]

[coordinates]                                 # what is fitted, atoms from 1: a distance, an angle, a dihedral angle;
CO = [1, 2]                                   # left out: everything that preserves the symmetry
CS = [2, 3]

[held]                                        # coordinates that stay as in the geometry

[[isotopologue]]                              # the parent first
constants = "B=6081.492114(6) MHz"            # those of A, B, C that are known
source = "..."

[[isotopologue]]
isotopes = "C=13C"                            # or "2=13C", "C2=13C"
lines = "c061502.cat.gz"                      # instead of constants: measured lines (.cat, .lin, .csv) that are fitted here,
start = "B=6062 D=0.0013 MHz"                 # from these constants, all of them free; a path counts from the file's folder
corrections = "B=13.2 MHz"                    # to be added to the constants of the ground state: B_e = B_0 + correction
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.formats.toml import read_toml
from rotor.molecules.molecule import Molecule
from rotor.structures.coordinates import Named, named
from rotor.structures.family import Family, family
from rotor.tops.constants.constants import Constants
from rotor.tops.constants.uncertain_numbers import parse_named

if TYPE_CHECKING:
    from rotor.fitting.fit import FitOptions
    from rotor.fitting.result import Fit

_TABLES = ("name", "geometry", "coordinates", "held", "isotopologue")
_SPECIES = ("name", "isotopes", "constants", "source", "lines", "start", "corrections")


@dataclass(frozen=True)
class FamilyFile:
    """Content of a family file: the family, coordinates to fit and to hold, and fits of lines by isotopologue."""

    family: Family
    coordinates: tuple[Named, ...]
    held: tuple[Named, ...]
    fits: Mapping[str, Fit]


def read_family(path: str | os.PathLike[str], options: FitOptions | None = None) -> FamilyFile:
    """The family in a TOML file; constants are fitted to measured lines if the file names them.

    Raises ValueError, with file, table and key, for text that is no TOML, unknown keys, isotopologues that do not fit the
    geometry, constants that are missing, and lines whose fit does not converge.
    """
    content = read_toml(path)
    _refuse_unknown(content, _TABLES, str(path))
    molecule = _molecule(content, str(path))
    species = content.get("isotopologue")
    if not isinstance(species, list) or not species:
        raise ValueError(f"{path}: no [[isotopologue]]; the parent with its constants is the first")

    fits: dict[str, Fit] = {}
    measured, corrections, sources = [], [], []
    for i, entry in enumerate(species, 1):
        place = f"{path}, isotopologue {i}"
        if not isinstance(entry, dict):
            raise ValueError(f"{place}: a table [[isotopologue]] is needed")
        _refuse_unknown(entry, _SPECIES, place)
        for key in entry:
            if not isinstance(entry[key], str):
                raise ValueError(f"{place}, {key} = {entry[key]!r}: text in quotes is needed")
        label = entry.get("name") or (entry.get("isotopes") or "parent")
        values, errors, source = _constants(entry, place, Path(path).parent, label, fits, options)
        measured.append((label, entry.get("isotopes", ""), values, errors))
        corrections.append(_parsed(entry, "corrections", place)[0] if "corrections" in entry else {})
        sources.append(entry.get("source", source))
    try:
        isotopologues = family(
            molecule, measured, corrections_mhz=corrections, sources=sources, name=content.get("name", "")
        )
        coordinates = _coordinates(molecule, content.get("coordinates", {}))
        held = _coordinates(molecule, content.get("held", {}))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    return FamilyFile(isotopologues, coordinates, held, fits)


def _refuse_unknown(table: Mapping[str, Any], accepted: Sequence[str], place: str) -> None:
    strange = [key for key in table if key not in accepted]
    if strange:
        raise ValueError(f"{place}: unknown key {strange[0]!r}; known are {', '.join(accepted)}")


def _molecule(content: Mapping[str, Any], path: str) -> Molecule:
    table = content.get("geometry")
    atoms = table.get("atoms") if isinstance(table, dict) else None
    if not isinstance(atoms, list) or not all(isinstance(row, list) and len(row) == 4 for row in atoms):
        raise ValueError(f'{path}: [geometry] with atoms = [["O", x, y, z], ...] in Å is needed')
    try:
        return Molecule(
            tuple(row[0] for row in atoms),
            np.array([row[1:] for row in atoms], dtype=float),
            name=content.get("name", ""),
        )
    except (TypeError, ValueError) as error:
        raise ValueError(f"{path}, [geometry]: {error}") from None


def _parsed(entry: Mapping[str, str], key: str, place: str) -> tuple[dict[str, float], dict[str, float]]:
    try:
        return parse_named(entry[key])
    except ValueError as error:
        raise ValueError(f"{place}, {key}: {error}") from None


def _constants(
    entry: Mapping[str, str], place: str, folder: Path, label: str, fits: dict[str, Fit], options: FitOptions | None
) -> tuple[dict[str, float], dict[str, float], str]:
    """A, B, C and their errors, as stated or fitted to measured lines, and their source."""
    if ("constants" in entry) == ("lines" in entry):
        raise ValueError(f"{place}: either constants or lines (with start) say what was measured; give one of them")
    if "constants" in entry:
        values, errors = _parsed(entry, "constants", place)
        return _rigid(values), _rigid(errors), ""
    if "start" not in entry:
        raise ValueError(f'{place}: lines need start constants, such as start = "B=6062 D=0.0013 MHz"')
    try:
        if not (folder / entry["lines"]).is_file():
            raise ValueError(f"{entry['lines']}: no such file beside the family")
        fit = _fitted(folder / entry["lines"], Constants.parse(entry["start"]), options)
    except (ValueError, OSError) as error:
        raise ValueError(f"{place}, lines: {error}") from None
    if not fit.converged or fit.constants is None:
        raise ValueError(f"{place}, lines = {entry['lines']!r}: the fit has not converged: {fit.reason}")
    fits[label] = fit
    source = f"fitted to {int(fit.used.sum())} measured lines of {Path(entry['lines']).name}, weighted rms {fit.weighted_rms:.3g}"
    return _rigid(fit.named.values), _rigid(fit.named.uncertainties), source


def _fitted(path: Path, start: Constants, options: FitOptions | None) -> Fit:
    from rotor.fitting.fit import fit_lines
    from rotor.fitting.parameters import parameters
    from rotor.formats.lines.assigned_lines import QUANTA, read_assigned_lines

    lines, _ = read_assigned_lines(path, QUANTA[start.kind])
    return fit_lines(lines, start, parameters(start, list(start.values)), options)


def _rigid(table: Mapping[str, float]) -> dict[str, float]:
    return {name: value for name, value in table.items() if name in ("A", "B", "C")}


def _coordinates(molecule: Molecule, table: Mapping[str, Any]) -> tuple[Named, ...]:
    for name, atoms in table.items():
        if not isinstance(atoms, list) or not all(type(atom) is int for atom in atoms):
            raise ValueError(f"{name} = {atoms!r}: a list of atom numbers is needed, such as [1, 2]")
    return tuple(named(molecule, name, atoms) for name, atoms in table.items())
