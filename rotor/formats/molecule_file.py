"""A molecule as a TOML file: geometry, constants, dipole, spin weights, each with where it came from.

    name = "water"
    names = ["H2O"]

    [geometry]                          # Å, any frame; isotopes as "18O" or "D"
    kind = "r0"                         # r0, rs, re, or computed (a force field, quantum chemistry)
    source = "..."
    vibrational_difference = 0.02       # how far A, B, C of this geometry may be from the constants, relative
    atoms = [["O", 0.0, 0.0, 0.1], ...]

    charge = 0                          # may be left out, as may the next
    electronic = "even"                 # or "odd": half turns that change places of like nuclei turn the sign of the
                                        # electronic state, as in the 3Σg- of O2 (spin weights of isotopologues need it)

    [constants]                         # named as in rotor.tops.constants
    unit = "MHz"
    reduction = "S"
    source = "..."
    A = 835852.4
    DJ = { value = 34.8, uncertainty = 0.1, source = "..." }

    [covariance]                        # of constants that were fitted together: their correlation coefficients, row by row as
    names = ["A", "DJ"]                 # far as the diagonal; the standard errors are the uncertainties above
    correlations = [[1.0], [0.3, 1.0]]

    [dipole]                            # along the principal axes a, b, c
    unit = "D"
    source = "..."
    b = 1.8546

    [polarizability]                    # volume, along a, b, c: aa, bb, cc (ab, ac, bc where not 0); of a symmetric top or
    unit = "Å3"                         # linear molecule also parallel and perpendicular, or mean and anisotropy, the
    source = "..."                      # difference of the two
    mean = 1.45
    anisotropy = 0.1

    [spin_weights]                      # classes of rotor.tops.spin_weights
    source = "..."
    ee = 1
    eo = 3
    oe = 3
    oo = 1

    [catalogue]                         # the measured lines that the constants were held against
    tag = "c018003"
    lines = 144
    rms_mhz = 0.8
    j_max = 10
    k_max = 5

Every table may be left out, except that constants or a geometry must be there: a file of constants alone is one, too.
"""

from __future__ import annotations

import difflib
import math
import os
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.geometry.inertia import PrincipalFrame, point_masses, principal_frame
from rotor.molecules.molecule import ELECTRONIC, Molecule
from rotor.tops.constants import Constants
from rotor.tops.covariance import Covariance
from rotor.tops.kind import kind_from_moments
from rotor.tops.spin_weights import SpinWeights
from rotor.tops.top import Tensor
from rotor.units import parse_quantity

GEOMETRY_KINDS = ("r0", "rs", "re", "computed")
_TABLES = ("geometry", "constants", "covariance", "dipole", "polarizability", "spin_weights", "catalogue")
_RULES = {"linear": "J", "spherical": "irrep", "prolate": "K", "oblate": "K", "asymmetric": "KaKc"}

Table = dict[str, Any]


@dataclass(frozen=True)
class MeasuredLines:
    """How constants meet the measured lines of a catalogue: rms in MHz of `lines` lines up to `j_max` and `k_max`.

    k_max bounds Ka of an asymmetric and K of a symmetric top; None where there is no K or no bound.
    """

    tag: str
    lines: int | None = None
    rms_mhz: float | None = None
    j_max: int | None = None
    k_max: int | None = None


@dataclass(frozen=True)
class MoleculeFile:
    """What a molecule file says.

    name, names : what the molecule is called, other names
    molecule : its geometry, with the dipole turned into the same frame; None in a file without one
    geometry_kind : "r0", "rs", "re" or "computed"
    vibrational_difference : bound of the relative difference between A, B, C of the geometry and the constants
    constants : in MHz; None in a file without them
    dipole_abc_debye : (μa, μb, μc) in D. The sign of a single component has no bearing on a spectrum
    spin_weights : nuclear-spin weights; rule "none" where the file has none
    sources : by table, where its numbers are from; single constants may have their own in `constants.sources`
    catalogue : the measured lines that the constants were held against
    polarizability_abc_angstrom3 : the tensor (3, 3) along a, b, c in Å³
    covariance : of the constants, where the file has their correlations
    """

    name: str
    names: tuple[str, ...] = ()
    molecule: Molecule | None = None
    geometry_kind: str | None = None
    vibrational_difference: float | None = None
    constants: Constants | None = None
    dipole_abc_debye: tuple[float, float, float] | None = None
    spin_weights: SpinWeights = field(default_factory=SpinWeights)
    sources: Mapping[str, str] = field(default_factory=dict)
    catalogue: MeasuredLines | None = None
    polarizability_abc_angstrom3: Tensor | None = None
    covariance: Covariance | None = None


def read_molecule_file(path: str | os.PathLike[str]) -> MoleculeFile:
    """What a molecule file says, checked.

    Raises ValueError, with file, table and key, for text that is no TOML, unknown tables and keys, numbers that
    cannot be, and a file with neither constants nor a geometry.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: a molecule file is UTF-8 text: {error}") from None
    return parse_molecule_file(text, str(path), default_name=Path(path).stem)


def parse_molecule_file(text: str, where: str = "molecule file", default_name: str = "") -> MoleculeFile:
    """What the text of a molecule file says; `where` names it in errors, `default_name` serves if it gives no name.

    >>> parse_molecule_file("constants = { B = 57635.96804, D = 0.1835, source = 'memory' }").constants.text()
    'B=57635.96804 D=0.1835 MHz'
    """
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{where}: not a TOML file: {error}") from None

    _refuse_unknown(content, ("name", "names", *_TABLES), where)
    tables = {name: _Reader(where, name, content[name]) for name in _TABLES if name in content}
    if not {"geometry", "constants"} & tables.keys():
        raise ValueError(f"{where}: neither [constants] nor [geometry]: one of them, or both, make a molecule file")

    top = _Reader(where, "", content)
    constants = _constants(tables.get("constants"))
    dipole = _dipole(tables.get("dipole"))
    molecule = _molecule(tables.get("geometry"), top.text("name", default_name), dipole, tables.get("dipole"))
    polarizability = _polarizability(tables.get("polarizability"), constants, molecule)
    return MoleculeFile(
        name=top.text("name", default_name),
        names=top.texts("names"),
        molecule=_with_polarizability(molecule, polarizability, tables.get("polarizability")),
        geometry_kind=tables["geometry"].choice("kind", GEOMETRY_KINDS) if molecule else None,
        vibrational_difference=tables["geometry"].number("vibrational_difference", 0.0) if molecule else None,
        constants=constants,
        dipole_abc_debye=dipole,
        spin_weights=_spin_weights(tables.get("spin_weights"), constants),
        sources={name: table.text("source") for name, table in tables.items() if "source" in table.content},
        catalogue=_catalogue(tables.get("catalogue")),
        polarizability_abc_angstrom3=polarizability,
        covariance=_covariance(tables.get("covariance"), constants),
    )


class _Reader:
    """One table of a file, whose errors say file, table and key."""

    def __init__(self, where: str, name: str, content: Any) -> None:
        self.place = f"{where}, [{name}]" if name else where
        if not isinstance(content, dict):
            raise ValueError(f"{self.place}: expected a table of key = value, not {content!r}")
        self.content: Table = content

    def refuse_unknown(self, known: Iterable[str]) -> None:
        _refuse_unknown(self.content, known, self.place)

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
        if not _is_number(value) or (minimum is not None and value < minimum):
            raise self.error(key, "a finite number" + (f" of at least {minimum:g}" if minimum is not None else ""))
        return float(value)

    def whole(self, key: str) -> int | None:
        value = self.number(key, 0)
        if value is not None and not value.is_integer():
            raise self.error(key, "expected a whole number")
        return None if value is None else int(value)

    def quantity(self, key: str, value: Any, unit: str, expected: str) -> float:
        """A number in the table's unit, or text with its own, in the unit asked for."""
        if not _is_number(value) and not isinstance(value, str):
            raise self.error(key, f"expected a finite number of {unit}, or text with a unit")
        try:
            return parse_quantity(value if isinstance(value, str) else f"{float(value)!r} {unit}", expected)
        except ValueError as reason:
            raise self.error(key, reason) from None


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _refuse_unknown(given: Iterable[str], known: Iterable[str], place: str) -> None:
    known = tuple(known)
    for key in given:
        if key not in known:
            near = difflib.get_close_matches(key, known, n=1)
            hint = f"did you mean {near[0]}? " if near else ""
            raise ValueError(f"{place}: unknown key {key!r}; {hint}Known are {', '.join(known)}")


# One function a table


def _molecule(
    table: _Reader | None, name: str, dipole: tuple[float, float, float] | None, dipole_table: _Reader | None
) -> Molecule | None:
    if table is None:
        return None
    table.refuse_unknown(("kind", "source", "vibrational_difference", "atoms", "charge", "electronic"))
    symbols, positions = _atoms(table)
    try:
        molecule = Molecule(
            symbols,
            positions,
            name=name,
            source=table.text("source"),
            uncertainty=table.number("vibrational_difference", 0.0),
            charge=table.content.get("charge", 0),
            electronic=table.choice("electronic", ELECTRONIC) or "even",
        )
    except ValueError as reason:
        raise ValueError(f"{table.place}, atoms: {reason}") from None
    if dipole is None or dipole_table is None:
        return molecule
    vector = np.array(dipole) @ _frame_of(molecule).axes
    return replace(molecule, dipole_debye=vector, dipole_source=dipole_table.text("source"))


def _frame_of(molecule: Molecule) -> PrincipalFrame:
    body = point_masses(molecule.masses_u, molecule.positions_angstrom)
    return principal_frame(body, molecule.masses_u, molecule.positions_angstrom)


def _with_polarizability(molecule: Molecule | None, tensor: Tensor | None, table: _Reader | None) -> Molecule | None:
    if molecule is None or tensor is None or table is None:
        return molecule
    axes = _frame_of(molecule).axes
    turned = axes.T @ np.array(tensor) @ axes
    return replace(molecule, polarizability_angstrom3=turned, polarizability_source=table.text("source"))


def _atoms(table: _Reader) -> tuple[tuple[str, ...], NDArray[np.float64]]:
    rows = table.content.get("atoms")
    if not isinstance(rows, list) or not rows:
        raise table.error("atoms", 'expected a list of ["symbol", x, y, z] in Å')
    for i, row in enumerate(rows, start=1):
        if not (isinstance(row, list) and len(row) == 4 and isinstance(row[0], str) and all(map(_is_number, row[1:]))):
            raise ValueError(f'{table.place}, atoms, atom {i} = {row!r}: expected ["symbol", x, y, z] in Å')
    return tuple(row[0] for row in rows), np.array([row[1:] for row in rows], dtype=np.float64)


def _constants(table: _Reader | None) -> Constants | None:
    if table is None:
        return None
    settings = {key: table.text(key) for key in ("reduction", "representation", "kind") if key in table.content}
    unit = table.text("unit", "MHz")
    values: dict[str, float] = {}
    uncertainties: dict[str, float] = {}
    sources: dict[str, str] = {}
    for name, item in table.content.items():
        if name in ("unit", "source", "reduction", "representation", "kind"):
            continue
        one = _Reader(table.place, name, item if isinstance(item, dict) else {"value": item})
        one.refuse_unknown(("value", "uncertainty", "source"))
        values[name] = one.quantity("value", one.content.get("value"), unit, "MHz")
        if "uncertainty" in one.content:
            uncertainties[name] = one.quantity("uncertainty", one.content["uncertainty"], unit, "MHz")
        if "source" in one.content:
            sources[name] = one.text("source")
    try:
        return Constants(**settings, uncertainties=uncertainties, sources=sources, **values)  # type: ignore[arg-type]
    except ValueError as reason:
        raise ValueError(f"{table.place}: {reason}") from None


def _covariance(table: _Reader | None, constants: Constants | None) -> Covariance | None:
    """From the lower triangle of the correlations and the uncertainties of the constants."""
    if table is None:
        return None
    table.refuse_unknown(("source", "names", "correlations"))
    names = table.texts("names")
    known = constants.uncertainties if constants is not None else {}
    lost = [name for name in names if name not in known]
    if lost or not names:
        raise table.error("names", f"{', '.join(lost) or 'none'}: constants of the file with an uncertainty are needed")
    rows: Any = table.content.get("correlations") or []
    fits = isinstance(rows, list) and [len(row) if isinstance(row, list) else 0 for row in rows] == [
        *range(1, len(names) + 1)
    ]
    if not fits or not all(_is_number(value) for row in rows for value in row):
        raise table.error(
            "correlations", f"{len(names)} rows of 1 to {len(names)} numbers are needed, the lower triangle"
        )
    matrix = np.zeros((len(names), len(names)))
    for i, row in enumerate(rows):
        matrix[i, : i + 1] = row
    matrix += np.tril(matrix, -1).T
    try:
        return Covariance.of_correlations(names, [known[name] for name in names], matrix)
    except ValueError as reason:
        raise ValueError(f"{table.place}: {reason}") from None


def _dipole(table: _Reader | None) -> tuple[float, float, float] | None:
    if table is None:
        return None
    table.refuse_unknown(("unit", "source", "a", "b", "c"))
    unit = table.text("unit", "D")
    a, b, c = (table.quantity(axis, table.content.get(axis, 0.0), unit, "D") for axis in "abc")
    return a, b, c


_ELEMENTS = ("aa", "bb", "cc", "ab", "ac", "bc")
_AXIAL = (("parallel", "perpendicular"), ("mean", "anisotropy"))


def _polarizability(table: _Reader | None, constants: Constants | None, molecule: Molecule | None) -> Tensor | None:
    """The tensor along a, b, c, from its elements or from the two numbers that an axial one has."""
    if table is None:
        return None
    table.refuse_unknown(("unit", "source", *_ELEMENTS, *_AXIAL[0], *_AXIAL[1]))
    unit = table.text("unit", "Å3")
    given = [key for key in table.content if key not in ("unit", "source")]
    values = {key: table.quantity(key, table.content[key], unit, "Å3") for key in given}
    if tuple(sorted(given)) in (tuple(sorted(pair)) for pair in _AXIAL):
        return _axial(table, values, _kind(constants, molecule))
    if not {"aa", "bb", "cc"} <= set(given) <= set(_ELEMENTS):
        raise ValueError(
            f"{table.place}: {', '.join(given) or 'nothing'}: expected aa, bb and cc (with ab, ac, bc where not 0), "
            "or parallel and perpendicular, or mean and anisotropy"
        )
    aa, bb, cc, ab, ac, bc = (values.get(key, 0.0) for key in _ELEMENTS)
    return (aa, ab, ac), (ab, bb, bc), (ac, bc, cc)


def _axial(table: _Reader, values: Mapping[str, float], kind: str) -> Tensor:
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


def _kind(constants: Constants | None, molecule: Molecule | None) -> str:
    if constants is not None:
        return constants.kind
    assert molecule is not None  # the reader refuses a file with neither
    return kind_from_moments(_frame_of(molecule).moments).kind


def _spin_weights(table: _Reader | None, constants: Constants | None) -> SpinWeights:
    if table is None:
        return SpinWeights()
    classes = {key: value for key, value in table.content.items() if key != "source"}
    for key, value in classes.items():
        if not _is_number(value):
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


def _catalogue(table: _Reader | None) -> MeasuredLines | None:
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
