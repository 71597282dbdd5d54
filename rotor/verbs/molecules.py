"""`rotor molecules`: the molecules known by name, in the library and in the user's folders."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from json import dumps
from pathlib import Path
from typing import Any

from rotor.frozen import dataclass
from rotor.reports.screen import Part, Table, plain
from rotor.requests.field import declared
from rotor.requests.readers import Text
from rotor.verbs.common.verb import Tool, Work

WIDEST_NAME = 24

EXAMPLES = """\
  rotor molecules
  rotor molecules water
  rotor molecules --json -"""


@dataclass(frozen=True)
class MoleculesRequest:
    """The molecules to list."""

    name: str | None = declared(None, Text(), "Show this molecule only, with all its sources", option="NAME")


@dataclass(frozen=True)
class Molecules:
    """A record for each molecule. alone: whether a single molecule was named."""

    records: list[dict[str, Any]]
    alone: bool

    def facts(self) -> dict[str, Any]:
        """Empty: the JSON is the list of records."""
        return {}


def answer(request: MoleculesRequest, work: Work) -> Molecules:
    """The records; point groups are determined only if they are shown."""
    alone = request.name is not None
    whole = alone or "json" in work.files
    return Molecules([record(path, symmetry=whole) for path in _paths(request.name)], alone)


def json_of(answer: Molecules, _: Any) -> str:
    """A list with one record on each line."""
    lines = (dumps(record, ensure_ascii=False, allow_nan=False) for record in answer.records)
    return "[\n" + ",\n".join(lines) + "\n]\n"


def show(answer: Molecules, _: Any) -> Iterable[Part | None]:
    """The table, or all facts of a single molecule."""
    left = frozenset({"name", "also", "kind", "unverified", "from"})
    yield (
        _facts(answer.records[0])
        if answer.alone
        else Table("", _COLUMNS, [_row(record) for record in answer.records], left)
    )


def _paths(name: str | None) -> list[Path]:
    """The file of one name, or all files with a name, the user's first."""
    from rotor.formats.molecules.library import folders, molecule_path, names

    if name is not None:
        return [molecule_path(name)]
    order = folders()
    return sorted(set(names().values()), key=lambda path: (order.index(path.parent), path.stem.casefold()))


def record(path: Path, *, symmetry: bool = True) -> dict[str, Any]:
    """The content of a molecule file, by the keys of docs/verbs. symmetry: whether to determine the point group."""
    from rotor.formats.molecules.molecule_file import read_molecule_file

    file = read_molecule_file(path, listed=not symmetry)
    if symmetry or file.constants is None:
        from rotor.formats.read_write import file_top

        top = file_top(file)
    else:  # without its geometry: finding the symmetry would take most of the time
        from rotor.tops.top import Top

        top = replace(Top.from_constants(file.constants), dipole_abc_debye=file.dipole_abc_debye)
    return {
        "name": file.name,
        "names": list(file.names),
        "formula": file.molecule.formula if file.molecule else None,
        "kind": top.kind,
        "kappa": top.kappa,
        "constants_mhz": dict(top.constants.values),
        "dipole_abc_debye": plain(top.dipole_abc_debye),
        "spin_weights": top.spin_weights.to_mapping(),
        "point_group": top.symmetry.point_group if top.symmetry else None,
        "symmetry_number": top.symmetry.symmetry_number if top.symmetry else None,
        "geometry_kind": file.geometry_kind,
        "vibrational_difference": file.vibrational_difference,
        "catalogue": dict(vars(file.catalogue)) if file.catalogue else None,
        "serves": dict(vars(file.serves)) if file.serves else None,
        "levels": len(file.levels) if file.levels else 0,
        "unverified": sorted(file.unverified),
        "sources": dict(file.sources),
        "file": str(path),
        "own": _is_own(path.parent),
    }


@cache
def _is_own(folder: Path) -> bool:
    from rotor.molecules.nuclei import data_folder

    return folder != data_folder() / "molecules"


_COLUMNS = ("name", "also", "kind", "κ", "μa", "μb", "μc", "J ≤", "K ≤", "within/MHz", "unverified", "from")


def _row(record: dict[str, Any]) -> list[str]:
    """One molecule: the lines it serves and their error, unverified data, and the source of the constants."""
    dipole = record["dipole_abc_debye"] or [None] * 3
    serves = record["serves"] or {"j_max": None, "k_max": None, "error_mhz": None}
    source = ("own: " if record["own"] else "") + record["sources"].get(
        "constants", record["sources"].get("geometry", "not said")
    )
    stem = Path(record["file"]).stem
    return [
        stem,
        _cut(record["name"], WIDEST_NAME) if record["name"] != stem else "",
        record["kind"],
        *(_number(record["kappa"], ".3f"), *(_number(x or None, ".4g") for x in dipole)),
        *(_number(serves["j_max"], "d"), _number(serves["k_max"], "d"), _number(serves["error_mhz"], "g")),
        ", ".join(name.replace("_", " ") for name in _tables_first(record["unverified"])),
        _cut(source, 60),
    ]


def _tables_first(unverified: list[str]) -> list[str]:
    """Names of unverified tables; single constants only where their table as a whole is verified."""
    return [name for name in unverified if name.partition(".")[0] == name or name.partition(".")[0] not in unverified]


def _number(value: float | None, form: str) -> str:
    return "" if value is None else format(value, form)


def _cut(text: str, width: int) -> str:
    return text if len(text) <= width else text[: width - 1] + "…"


def _facts(record: dict[str, Any]) -> list[tuple[str, str]]:
    group, number = (record[name] or "not known" for name in ("point_group", "symmetry_number"))
    marks = dict.fromkeys(record["unverified"], "unverified: ")
    return [
        ("name", ", ".join([record["name"], *record["names"]])),
        ("kind", record["kind"] + (f", κ = {record['kappa']:.4f}" if record["kappa"] is not None else "")),
        ("point group", f"{group}, symmetry number {number}"),
        ("file", record["file"]),
        ("serves", _serves_text(record["serves"]) if record["serves"] else ""),
        ("level table", record["levels"] and f"{record['levels']} energies, which replace those of the constants"),
        ("unverified", ", ".join(record["unverified"])),
        *(
            (f"{table.replace('_', ' ')} from", marks.get(table, "") + text)
            for table, text in record["sources"].items()
        ),
    ]


def _serves_text(serves: dict[str, Any]) -> str:
    limits = [f"J ≤ {serves['j_max']}"]
    limits += [f"K ≤ {serves['k_max']}"] if serves["k_max"] is not None else []
    limits += [f"up to {serves['max_ghz']:g} GHz"] if serves["max_ghz"] is not None else []
    error = serves["error_mhz"]
    accuracy = (
        "no catalogue was compared"
        if error is None
        else f"measured lines within {error:g} MHz and three of their errors"
    )
    return f"{', '.join(limits)}: {accuracy}"


VERB = Tool(
    name="molecules",
    about="Molecules known by name: kind, κ, dipole, and sources of the numbers.",
    examples=EXAMPLES,
    request=MoleculesRequest,
    answer=answer,
    text=json_of,
    show=show,
)
