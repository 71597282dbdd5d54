"""The table of spins in a molecule file: constants of nuclear and electron spins, spin by spin.

    [spins]
    unit = "MHz"
    source = "..."

    [spins.14N]                         # called after the isotope; 35Cl_1 and 35Cl_2 where there are several
    atom = 3                            # which atom of [geometry]; may be left out where one alone is that isotope
    chi_aa = { value = 1.9543, uncertainty = 0.0012 }
    chi_bb-cc = 5.7476                  # the difference; names are those of rotor.quantum.effects
    "chi_aa[1]" = 0.02                  # what state 1 has more of it: without a number a constant belongs to every state

    [spins.S]                           # any other name needs its spin
    spin = "1/2"
    eps_aa = 500.0

    [spins."S,14N"]                     # what belongs to two spins
    b_F = 12.5

    [spins.35Cl_1]                      # of two or three equivalent nuclei, the last ones: they are coupled to a total spin I first,
    total = "I"                         # and last to the rest; quantum numbers I and F in place of F1 and F. Of two each has its
    chi_aa = -40.0                      # constants, of three on a threefold axis the first alone, or the first and the second together

The spins are coupled in the order in which they stand here. Spin weights beside a total spin are those of the other nuclei; where
they are as large as those of the pair itself would be, such as 1 and 3 beside two protons (four protons in two pairs), [spins] says
that they are not:

    [spins]
    weights = "other nuclei"
"""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Any

from rotor.formats.molecules.molecule_tables import TableReader, uncertain_number
from rotor.tops.spins.spin_constants import SpinConstants, is_isotope, parse_spins, spin_names, spin_text, twice_spin

if TYPE_CHECKING:
    from rotor.molecules.molecule import Molecule

_OF_TABLE = ("unit", "source", "unverified", "weights")
OTHER_NUCLEI = "other nuclei"
_OF_SPIN = ("spin", "atom", "total", "source", "unverified")


def read_spins(table: TableReader | None, molecule: Molecule | None) -> SpinConstants | None:
    """The spin constants of a file, checked; None without any."""
    if table is None:
        return None
    unit = table.text("unit", "MHz")
    parts = {
        name: TableReader(table.place, name, part) for name, part in table.content.items() if name not in _OF_TABLE
    }
    twice = {name: _twice(part, name) for name, part in parts.items() if "," not in name}
    values: dict[str, float] = {}
    errors: dict[str, float] = {}
    for key, part in parts.items():
        for symbol in part.content:
            if symbol in _OF_SPIN:
                continue
            before, bracket, state = symbol.partition("[")
            name = f"{before}({key.replace(' ', '')}){bracket}{state}"
            values[name], error = uncertain_number(part, symbol, unit)
            if error is not None:
                errors[name] = error
    sources = {name: part.text("source") for name, part in parts.items() if "source" in part.content}
    atoms = {name: number for name, part in parts.items() if (number := _atom(part, name, molecule)) is not None}
    totals = {name: part.text("total") for name, part in parts.items() if "total" in part.content}
    weights_of_others = table.choice("weights", (OTHER_NUCLEI,)) is not None
    try:
        return SpinConstants(values, twice, table.text("source"), errors, sources, atoms, totals, weights_of_others)
    except ValueError as reason:
        raise ValueError(f"{table.place}: {reason}") from None


def _twice(part: TableReader, name: str) -> int:
    """Twice a spin, from the isotope in its name or from the table."""
    stated = part.content.get("spin")
    size = str(stated) if isinstance(stated, float | int) and not isinstance(stated, bool) else None
    size = part.text("spin") if stated is not None and size is None else size
    try:
        return twice_spin(name) if size is None else parse_spins(f"{name}={size}")[name]
    except ValueError as reason:
        raise ValueError(f"{part.place}: {reason}") from None


def _atom(part: TableReader, name: str, molecule: Molecule | None) -> int | None:
    """The number of the nucleus in the geometry; None for electron spins and without a geometry."""
    number = part.whole("atom")
    if molecule is None or "," in name:
        if number is not None:
            raise part.error("atom", "expected only with a geometry, for one nucleus")
        return None
    label = name.partition("_")[0]
    alike = [
        i
        for i, nucleus in enumerate(molecule.nuclei, start=1)
        if label in (nucleus.label, *_short_names(nucleus.label))
    ]
    if number is None:
        return alike[0] if len(alike) == 1 else None
    if number not in alike:
        which = ", ".join(map(str, alike)) or "none"
        raise part.error("atom", f"expected the number of a {label} of the geometry, of which there is {which}")
    return number


def _short_names(label: str) -> tuple[str, ...]:
    return {"2H": ("D",), "3H": ("T",)}.get(label, ())


def spin_tables(
    constants: SpinConstants | None, unverified: Collection[str], geometry: bool = True
) -> dict[str, dict[str, Any]]:
    """The tables of spins for a molecule file, by name: one for all spins, and one for each.

    unverified: names of tables that are marked so. geometry: whether the file has one, to which the numbers of atoms belong.
    """
    if constants is None:
        return {}
    marked = {"source": constants.source or None, "unverified": True if "spins" in unverified else None}
    weights = OTHER_NUCLEI if constants.weights_of_others else None
    tables: dict[str, dict[str, Any]] = {"spins": {**marked, "unit": "MHz", "weights": weights}}
    for name, twice in constants.twice.items():
        tables[name] = {"spin": None if is_isotope(name, twice) else spin_text(twice)}
        tables[name] |= {
            "atom": constants.atoms.get(name) if geometry else None,
            "total": constants.totals.get(name),
            "source": constants.sources.get(name),
        }
        tables[name]["unverified"] = True if f"spins.{name}" in unverified else None
    for name, value in constants.values.items():
        key = ",".join(spin_names(name))
        tables.setdefault(key, {"source": constants.sources.get(key)})
        symbol = name.partition("(")[0] + name.partition(")")[2]
        tables[key][symbol] = uncertain_entry(value, constants.uncertainties.get(name))
    return tables


def uncertain_entry(value: float, error: float | None) -> float | dict[str, float]:
    """A number for a file, with its standard deviation if it has one."""
    return value if error is None else {"value": value, "uncertainty": error}
