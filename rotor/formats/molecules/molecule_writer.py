"""Writer of molecule files; the text reads back as the same molecule."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rotor.formats.atomic_write import open_atomic
from rotor.formats.molecules.internal_rotation_table import internal_rotation_table
from rotor.formats.molecules.level_table import write_level_table
from rotor.formats.molecules.magnetic_table import magnetic_table
from rotor.formats.molecules.molecule_file import MoleculeFile
from rotor.formats.molecules.spin_table import spin_tables, uncertain_entry
from rotor.formats.toml import toml_key, toml_value
from rotor.tops.states.state_constants import StateConstants


def write_molecule_file(molecule: MoleculeFile, path: str | os.PathLike[str]) -> None:
    """Write a molecule file atomically: after an error the path has its previous content.

    Level energies are written to a separate file in the same folder, `NAME_levels.csv`.
    """
    levels_file = f"{Path(path).stem}_levels.csv" if molecule.levels is not None else ""
    text = molecule_file_text(molecule, levels_file)
    if molecule.levels is not None:
        write_level_table(molecule.levels, Path(path).with_name(levels_file))
    with open_atomic(path, "w", encoding="utf-8", newline="\n") as handle:
        handle.write(text)


def molecule_file_text(molecule: MoleculeFile, levels_file: str = "") -> str:
    """The TOML text of a molecule; constants in MHz, dipole in D, polarizability in Å³, positions in Å.

    levels_file: file of the level energies, which the text only names. Raises ValueError if they have no file.

    >>> from rotor.tops.constants.constants import Constants
    >>> print(molecule_file_text(MoleculeFile("hydrogen chloride", constants=Constants(B=312989.0))))
    name = "hydrogen chloride"
    <BLANKLINE>
    [constants]
    unit = "MHz"
    kind = "linear"
    B = 312989.0
    <BLANKLINE>
    """
    head = {"name": molecule.name, "names": list(molecule.names)}
    tables: dict[str, Mapping[str, Any]] = {
        "geometry": _geometry(molecule),
        "constants": _constants(molecule),
        "covariance": _covariance(molecule),
        "dipole": _dipole(molecule),
        "polarizability": _polarizability(molecule),
        "magnetic": magnetic_table(molecule.magnetic),
        "spin_weights": molecule.spin_weights.to_mapping(),
        "states": _states(molecule.states),
        "internal_rotation": internal_rotation_table(molecule.internal_rotation),
        "catalogue": _catalogue(molecule),
        "serves": vars(molecule.serves) if molecule.serves else {},
    }
    if molecule.levels is not None:
        if not levels_file:
            raise ValueError(f"{molecule.name}: level energies need a separate file; name it, or leave them out")
        tables["levels"] = {"file": levels_file}
    parts = ["\n".join(_lines(head))]
    for name, table in tables.items():
        if table:
            marks = {"source": molecule.sources.get(name), "unverified": True if name in molecule.unverified else None}
            parts.append("\n".join([f"[{name}]", *_lines({**marks, **table})]))
    spins = spin_tables(molecule.spin_constants, molecule.unverified, molecule.molecule is not None)
    for name, table in spins.items():
        heading = name if name == "spins" else f"spins.{toml_key(name)}"
        parts.append("\n".join([f"[{heading}]", *_lines(table)]))
    return "\n\n".join(parts) + "\n"


def _states(states: StateConstants | None) -> dict[str, Any]:
    if states is None:
        return {}
    weights = {str(v): weight.to_mapping() for v, weight in states.weights.items()}
    dipoles = {",".join(map(str, sorted(set(pair)))): list(moment) for pair, moment in states.dipoles.items()}
    values = {name: uncertain_entry(value, states.uncertainties.get(name)) for name, value in states.values.items()}
    more = {"names": list(states.names), "symmetry": states.symmetry, "weights": weights, "dipoles": dipoles}
    return {"unit": "MHz", **values, **{key: value for key, value in more.items() if value}}


def _geometry(molecule: MoleculeFile) -> dict[str, Any]:
    if molecule.molecule is None:
        return {}
    body = molecule.molecule
    labels = [nucleus.label for nucleus in body.nuclei]
    return {
        "kind": molecule.geometry_kind,
        "vibrational_difference": molecule.vibrational_difference,
        "charge": body.charge or None,
        "multiplicity": body.multiplicity,
        "electronic": None if body.electronic == "even" else body.electronic,
        "atoms": [[label, *position] for label, position in zip(labels, body.positions_angstrom.tolist(), strict=True)],
    }


def _constants(molecule: MoleculeFile) -> dict[str, Any]:
    constants = molecule.constants
    if constants is None:
        return {}
    numbers: dict[str, Any] = {}
    for name, value in constants.values.items():
        extra = {"uncertainty": constants.uncertainties.get(name), "source": constants.sources.get(name)}
        extra["unverified"] = True if f"constants.{name}" in molecule.unverified else None
        extra = {key: thing for key, thing in extra.items() if thing is not None}
        numbers[name] = {"value": value, **extra} if extra else value
    return {
        "unit": "MHz",
        "kind": constants.kind,
        "reduction": constants.reduction,
        "representation": constants.representation,
        **numbers,
    }


def _covariance(molecule: MoleculeFile) -> dict[str, Any]:
    """Correlations up to the diagonal; standard errors are written with the constants."""
    if molecule.covariance is None:
        return {}
    rows = [[float(value) for value in row[: i + 1]] for i, row in enumerate(molecule.covariance.correlations.tolist())]
    return {"names": list(molecule.covariance.names), "correlations": rows}


def _dipole(molecule: MoleculeFile) -> dict[str, Any]:
    if molecule.dipole_abc_debye is None:
        return {}
    return {"unit": "D", **dict(zip("abc", molecule.dipole_abc_debye, strict=True))}


def _polarizability(molecule: MoleculeFile) -> dict[str, Any]:
    """The elements of the tensor, without off-diagonal ones that are 0."""
    if molecule.polarizability_abc_angstrom3 is None:
        return {}
    (aa, ab, ac), (_, bb, bc), (_, _, cc) = molecule.polarizability_abc_angstrom3
    mixed = {name: value for name, value in (("ab", ab), ("ac", ac), ("bc", bc)) if value}
    return {"unit": "Å3", "aa": aa, "bb": bb, "cc": cc, **mixed}


def _catalogue(molecule: MoleculeFile) -> dict[str, Any]:
    return vars(molecule.catalogue) if molecule.catalogue else {}


def _lines(table: Mapping[str, Any]) -> list[str]:
    """The entries of a table; a list of lists has a line for each."""
    filled = {key: value for key, value in table.items() if value is not None and value != []}
    return [f"{toml_key(key)} = {toml_value(value, by_row=True)}" for key, value in filled.items()]
