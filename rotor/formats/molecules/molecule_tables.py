"""Readers of the tables of a molecule file; all errors state file, table and key."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import symmetric_from_lower
from rotor.formats.molecules.level_table import read_level_table
from rotor.frozen import dataclass
from rotor.geometry.inertia import PrincipalFrame, point_masses, principal_frame
from rotor.molecules.molecule import ELECTRONIC, Molecule
from rotor.tops.components import Tensor
from rotor.tops.constants.constants import Constants
from rotor.tops.constants.covariance import Covariance
from rotor.tops.internal_rotation import InternalRotationConstants
from rotor.tops.kind import kind_from_moments
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.states.level_table import LevelTable
from rotor.tops.states.state_constants import StateConstants
from rotor.units import parse_quantity

_RULES = {"linear": "J", "spherical": "irrep", "prolate": "K", "oblate": "K", "asymmetric": "KaKc"}

Table = dict[str, Any]


@dataclass(frozen=True)
class MeasuredLines:
    """Agreement of constants with measured lines of a catalogue: rms in MHz of `lines` lines up to `j_max` and `k_max`.

    k_max limits Ka of an asymmetric and K of a symmetric top; None without K or without a limit.
    """

    tag: str
    lines: int | None = None
    rms_mhz: float | None = None
    j_max: int | None = None
    k_max: int | None = None


@dataclass(frozen=True)
class Served:
    """Range of lines for which constants and level table of a file are valid: up to `j_max`, `k_max` and `max_ghz`.

    error_mhz: largest deviation from a measured line in this range, beyond three times its error. None: the range is the intended one,
    without a catalogue to compare with.
    """

    j_max: int
    error_mhz: float | None = None
    k_max: int | None = None
    max_ghz: float | None = None


class TableReader:
    """One table of a file; its errors state file, table and key."""

    def __init__(self, where: str, name: str, content: Any) -> None:
        self.place = f"{where}, [{name}]" if name else where
        if not isinstance(content, dict):
            raise ValueError(f"{self.place}: expected a table of key = value, found {content!r}")
        self.content: Table = content

    def refuse_unknown(self, accepted: Iterable[str]) -> None:
        refuse_unknown_keys(self.content, accepted, self.place)

    def error(self, key: str, reason: object) -> ValueError:
        return ValueError(f"{self.place}, {key} = {self.content.get(key)!r}: {reason}")

    def text(self, key: str, default: str = "") -> str:
        value = self.content.get(key, default)
        if not isinstance(value, str):
            raise self.error(key, "expected text in quotes")
        return value

    def texts(self, key: str) -> tuple[str, ...]:
        value = self.content.get(key, [])
        if not isinstance(value, list) or not all(isinstance(item, str) and item for item in value):
            raise self.error(key, 'expected a list of names such as ["H2O"]')
        return tuple(value)

    def choice(self, key: str, choices: tuple[str, ...]) -> str | None:
        if key not in self.content:
            return None
        if self.content[key] not in choices:
            raise self.error(key, f"expected one of {', '.join(choices)}")
        return str(self.content[key])

    def number(self, key: str, minimum: float | None = None) -> float | None:
        if key not in self.content:
            return None
        value = self.content[key]
        if not is_number(value) or (minimum is not None and value < minimum):
            raise self.error(
                key, "expected a finite number" + (f" of at least {minimum:g}" if minimum is not None else "")
            )
        return float(value)

    def whole(self, key: str) -> int | None:
        value = self.number(key, 0)
        if value is not None and not value.is_integer():
            raise self.error(key, "expected a whole number")
        return None if value is None else int(value)

    def quantity(self, key: str, value: Any, unit: str, expected: str) -> float:
        """A number in the unit of the table, or text with a unit, converted to the expected unit.

        key: key, for messages. value: value of the key. unit: unit of a bare number. expected: unit of the result.
        Returns: the number in the expected unit.
        Raises ValueError with file, table and key, unless it is a finite number with a suitable unit.
        """
        if not is_number(value) and not isinstance(value, str):
            raise self.error(key, f"expected a finite number of {unit}, or text with a unit")
        try:
            return parse_quantity(value if isinstance(value, str) else f"{float(value)!r} {unit}", expected)
        except ValueError as reason:
            raise self.error(key, reason) from None


def is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def refuse_unknown_keys(keys: Iterable[str], accepted: Iterable[str], place: str) -> None:
    accepted = tuple(accepted)
    for key in keys:
        if key not in accepted:
            near = difflib.get_close_matches(key, accepted, n=1)
            hint = f"did you mean {near[0]}? " if near else ""
            raise ValueError(
                f"{place}: unknown key {key!r}; {hint}{'K' if hint else 'k'}nown are {', '.join(accepted)}"
            )


# One function a table


def geometry(
    table: TableReader | None, name: str, dipole: tuple[float, float, float] | None, dipole_table: TableReader | None
) -> Molecule | None:
    """The molecule of a `[geometry]` table, with the dipole turned into its frame.

    table: the geometry, where the file has one. name: name of the molecule. dipole: dipole along a, b, c in debye. dipole_table: table of
    the dipole, for messages.
    Returns: none without a table.
    Raises ValueError with file, table and key, for unknown entries or an invalid molecule.
    """
    if table is None:
        return None
    table.refuse_unknown(
        (
            "kind",
            "source",
            "vibrational_difference",
            "atoms",
            "charge",
            "multiplicity",
            "electronic",
            "electron_spin_mhz",
            "unverified",
        )
    )
    symbols, positions = _atoms(table)
    try:
        molecule = Molecule(
            symbols,
            positions,
            name=name,
            source=table.text("source"),
            uncertainty=table.number("vibrational_difference", 0.0),
            charge=table.content.get("charge", 0),
            multiplicity=table.content.get("multiplicity"),
            electron_spin_mhz=table.number("electron_spin_mhz", 0.0),
            electronic=table.choice("electronic", ELECTRONIC) or "even",
        )
    except ValueError as reason:
        raise ValueError(f"{table.place}, atoms: {reason}") from None
    if dipole is None or dipole_table is None:
        return molecule
    vector = np.array(dipole) @ _principal_frame(molecule).axes
    return replace(molecule, dipole_debye=vector, dipole_source=dipole_table.text("source"))


def _principal_frame(molecule: Molecule) -> PrincipalFrame:
    body = point_masses(molecule.masses_u, molecule.positions_angstrom)
    return principal_frame(body, molecule.masses_u, molecule.positions_angstrom)


def with_polarizability(molecule: Molecule | None, tensor: Tensor | None, table: TableReader | None) -> Molecule | None:
    if molecule is None or tensor is None or table is None:
        return molecule
    axes = _principal_frame(molecule).axes
    turned = axes.T @ np.array(tensor) @ axes
    return replace(molecule, polarizability_angstrom3=turned, polarizability_source=table.text("source"))


def _atoms(table: TableReader) -> tuple[tuple[str, ...], NDArray[np.float64]]:
    rows = table.content.get("atoms")
    if not isinstance(rows, list) or not rows:
        raise table.error("atoms", 'expected a list of ["symbol", x, y, z] in Å')
    for i, row in enumerate(rows, start=1):
        if not (isinstance(row, list) and len(row) == 4 and isinstance(row[0], str) and all(map(is_number, row[1:]))):
            raise ValueError(f'{table.place}, atoms, atom {i} = {row!r}: expected ["symbol", x, y, z] in Å')
    return tuple(row[0] for row in rows), np.array([row[1:] for row in rows], dtype=np.float64)


def read_constants(table: TableReader | None) -> Constants | None:
    """The rotational constants of a table with their errors and sources; None without the table."""
    if table is None:
        return None
    settings = {key: table.text(key) for key in ("reduction", "representation", "kind") if key in table.content}
    unit = table.text("unit", "MHz")
    values: dict[str, float] = {}
    uncertainties: dict[str, float] = {}
    sources: dict[str, str] = {}
    for name, item in table.content.items():
        if name in ("unit", "source", "reduction", "representation", "kind", "unverified"):
            continue
        values[name], error = uncertain_number(table, name, unit)
        if error is not None:
            uncertainties[name] = error
        if isinstance(item, dict) and "source" in item:
            sources[name] = TableReader(table.place, name, item).text("source")
    try:
        return Constants(**settings, uncertainties=uncertainties, sources=sources, **values)  # type: ignore[arg-type]
    except ValueError as reason:
        raise ValueError(f"{table.place}: {reason}") from None


def read_covariance(
    table: TableReader | None, *parts: Constants | StateConstants | SpinConstants | InternalRotationConstants | None
) -> Covariance | None:
    """The covariance from the lower triangle of correlations and the uncertainties of all constants, states and spins included."""
    if table is None:
        return None
    table.refuse_unknown(("source", "names", "correlations"))
    names = table.texts("names")
    errors = {name: error for part in parts if part is not None for name, error in part.uncertainties.items()}
    lost = [name for name in names if name not in errors]
    if lost or not names:
        raise table.error("names", f"{', '.join(lost) or 'none'}: expected constants of the file with an uncertainty")
    rows: Any = table.content.get("correlations") or []
    lengths = [len(row) if isinstance(row, list) else 0 for row in rows] if isinstance(rows, list) else []
    if lengths != [*range(1, len(names) + 1)] or not all(is_number(value) for row in rows for value in row):
        raise table.error(
            "correlations", f"expected {len(names)} rows of 1 to {len(names)} numbers, the lower triangle"
        )
    matrix = np.zeros((len(names), len(names)))
    for i, row in enumerate(rows):
        matrix[i, : i + 1] = row
    try:
        return Covariance.from_correlations(names, [errors[name] for name in names], symmetric_from_lower(matrix))
    except ValueError as reason:
        raise ValueError(f"{table.place}: {reason}") from None


def read_dipole(table: TableReader | None) -> tuple[float, float, float] | None:
    if table is None:
        return None
    table.refuse_unknown(("unit", "source", "unverified", "a", "b", "c"))
    unit = table.text("unit", "D")
    a, b, c = (table.quantity(axis, table.content.get(axis, 0.0), unit, "D") for axis in "abc")
    return a, b, c


_ELEMENTS = ("aa", "bb", "cc", "ab", "ac", "bc")
_AXIAL = (("parallel", "perpendicular"), ("mean", "anisotropy"))


def read_polarizability(
    table: TableReader | None, constants: Constants | None, molecule: Molecule | None
) -> Tensor | None:
    """The tensor along a, b, c, from its elements or from the two numbers of an axial tensor."""
    if table is None:
        return None
    table.refuse_unknown(("unit", "source", "unverified", *_ELEMENTS, *_AXIAL[0], *_AXIAL[1]))
    unit = table.text("unit", "Å3")
    elements = [key for key in table.content if key not in ("unit", "source", "unverified")]
    values = {key: table.quantity(key, table.content[key], unit, "Å3") for key in elements}
    if tuple(sorted(elements)) in (tuple(sorted(pair)) for pair in _AXIAL):
        return _axial(table, values, file_kind(constants, molecule))
    if not {"aa", "bb", "cc"} <= set(elements) <= set(_ELEMENTS):
        raise ValueError(
            f"{table.place}: {', '.join(elements) or 'nothing'}: expected aa, bb and cc (with ab, ac, bc where not 0), "
            "or parallel and perpendicular, or mean and anisotropy"
        )
    aa, bb, cc, ab, ac, bc = (values.get(key, 0.0) for key in _ELEMENTS)
    return (aa, ab, ac), (ab, bb, bc), (ac, bc, cc)


def _axial(table: TableReader, values: Mapping[str, float], kind: str) -> Tensor:
    """α_parallel along a of a linear or prolate top, along c of an oblate one; mean (α∥ + 2α⊥)/3, anisotropy α∥ - α⊥."""
    if kind == "asymmetric":
        raise ValueError(f"{table.place}: an asymmetric top has no figure axis; give aa, bb and cc")
    if "mean" in values:
        across = values["mean"] - values["anisotropy"] / 3
        along = across + values["anisotropy"]
    else:
        along, across = values["parallel"], values["perpendicular"]
    aa, cc = (across, along) if kind == "oblate" else (along, across)
    return (aa, 0.0, 0.0), (0.0, across, 0.0), (0.0, 0.0, cc)


def file_kind(constants: Constants | None, molecule: Molecule | None) -> str:
    """The kind of top of a file, from its constants, else its geometry."""
    if constants is not None:
        return constants.kind
    assert molecule is not None  # the reader refuses a file with neither
    return kind_from_moments(_principal_frame(molecule).moments).kind


def read_spin_weights(table: TableReader | None, constants: Constants | None) -> SpinWeights:
    """The nuclear-spin weights of a table, equal without one; ValueError for classes that do not suit the kind of the constants."""
    if table is None:
        return SpinWeights()
    classes = {key: value for key, value in table.content.items() if key != "source"}
    for key, value in classes.items():
        if not is_number(value):
            raise table.error(key, "expected a whole number")
    try:
        weights = SpinWeights.from_mapping(classes)
    except ValueError as reason:
        raise ValueError(f"{table.place}: {reason}") from None
    if constants is not None and weights.rule != _RULES[constants.kind]:
        raise ValueError(
            f"{table.place}: classes {', '.join(weights.classes)} go by {weights.rule}, but the constants are of kind "
            f"{constants.kind!r}, whose weights go by {_RULES[constants.kind]}"
        )
    return weights


def uncertain_number(table: TableReader, key: str, unit: str) -> tuple[float, float | None]:
    """Value and standard deviation in MHz of an entry that is a number, text with a unit, or a table of value and uncertainty."""
    item = table.content[key]
    entry = TableReader(table.place, key, item if isinstance(item, dict) else {"value": item})
    entry.refuse_unknown(("value", "uncertainty", "source", "unverified"))
    value = entry.quantity("value", entry.content.get("value"), unit, "MHz")
    if "uncertainty" not in entry.content:
        return value, None
    return value, entry.quantity("uncertainty", entry.content["uncertainty"], unit, "MHz")


def read_measured_lines(table: TableReader | None) -> MeasuredLines | None:
    """The catalogue with which the constants were compared: its tag, lines, rms and range."""
    if table is None:
        return None
    table.refuse_unknown(("tag", "source", "lines", "rms_mhz", "j_max", "k_max"))
    if not table.text("tag"):
        raise ValueError(f'{table.place}: tag is missing; it names the catalogue, such as "c018003"')
    return MeasuredLines(
        table.text("tag"),
        table.whole("lines"),
        table.number("rms_mhz", 0.0),
        table.whole("j_max"),
        table.whole("k_max"),
    )


def read_served(table: TableReader | None) -> Served | None:
    """The range of J, K and frequency in which predictions hold, with their error."""
    if table is None:
        return None
    table.refuse_unknown(("j_max", "k_max", "max_ghz", "error_mhz", "source"))
    j_max, error = table.whole("j_max"), table.number("error_mhz", 0.0)
    if j_max is None:
        raise ValueError(f"{table.place}: expected j_max; found {', '.join(table.content) or 'nothing'}")
    return Served(j_max, error, table.whole("k_max"), table.number("max_ghz", 0.0))


def read_named_level_table(table: TableReader | None, folder: Path | None) -> LevelTable | None:
    """The level energies in the file that the table names, beside the molecule file."""
    if table is None:
        return None
    table.refuse_unknown(("file", "source"))
    name = table.text("file")
    if not name or folder is None:
        raise ValueError(f"{table.place}: expected file = the name of a .csv beside a molecule file")
    return read_level_table(folder / name, table.text("source"))


def unverified_in(name: str, table: TableReader) -> frozenset[str]:
    """Unverified parts of a table: its name, or names such as constants.DK of single entries."""
    entries = {f"{name}.{key}": item for key, item in table.content.items() if isinstance(item, dict)}
    marks = {name: table.content, **entries}
    for key, content in marks.items():
        if not isinstance(content.get("unverified", False), bool):
            raise ValueError(f"{table.place}, {key}: unverified is true or false, not {content['unverified']!r}")
    return frozenset(key for key, content in marks.items() if content.get("unverified"))
