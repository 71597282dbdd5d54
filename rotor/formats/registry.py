"""Registry of file formats: suffixes, readers, and writers by type of object.

`rotor.read` and `rotor.write` look here and nowhere else. Readers, writers and types are named by text ("module:name"), so
that nothing is imported before it is used. A writer that is registered for a class serves its subclasses. A file of this folder that
declares `FORMAT = Format(...)` is a format without a row here.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import field
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from rotor.frozen import dataclass

LINES = "rotor.spectra.lines:Lines"
TABLE = "rotor.table:Table"
MOTION = "rotor.classical.integrators.method:Motion"
CATALOGUE = "rotor.formats.spcat.text.catalogue:Catalogue"
LEVELS = "rotor.quantum.request:SelectedLevels"
HITRAN = "rotor.formats.lines.hitran:HitranLines"

FOLDER, PACKAGE = Path(__file__).parent, "rotor.formats"
Writer = Callable[[Any, str | os.PathLike[str], Mapping[str, Any]], None]


@dataclass(frozen=True)
class Format:
    """A file format.

    name: what messages call it. suffixes: how its files' names end, in lower case. reader: "module:function" of a path, which
    returns a top, a catalogue or another table. writers: by type, "module:function" of (thing, path, settings), settings being
    what the provenance shall say besides. recognises: "module:function" of a path, for suffixes that several formats have.
    """

    name: str
    suffixes: tuple[str, ...]
    reader: str | None = None
    writers: Mapping[str, str] = field(default_factory=dict)
    recognises: str | None = None


FORMATS = (
    Format(
        "catalogue of 80 columns",
        (".cat", ".cat.gz"),
        "rotor.formats.spcat.text.cat:read_cat",
        {
            LINES: "rotor.formats.lines.line_tables:write_catalogue",
            CATALOGUE: "rotor.formats.lines.line_tables:write_read_catalogue",
        },
    ),
    Format(
        "records of HITRAN",
        (".hitran", ".hitran.gz"),
        "rotor.formats.lines.hitran:read_hitran",
        {
            LINES: "rotor.formats.lines.line_tables:write_hitran_lines",
            HITRAN: "rotor.formats.lines.line_tables:write_records",
        },
    ),
    Format(
        "records of HITRAN",
        (".par", ".par.gz", ".data"),
        "rotor.formats.lines.hitran:read_hitran",
        recognises="rotor.formats.lines.hitran:is_hitran_file",
    ),
    Format(
        "lines of ExoMol",
        (".states",),
        "rotor.formats.lines.exomol_writer:refuse_exomol",
        {LINES: "rotor.formats.lines.exomol_writer:write_exomol"},
    ),
    Format(
        "packed lines of ExoMol",
        (".states.bz2", ".trans", ".trans.bz2"),
        "rotor.formats.lines.exomol_writer:refuse_exomol",
    ),
    Format("input of SPFIT and SPCAT", (".par", ".var", ".int"), "rotor.formats.read_write:read_spcat_top"),
    Format("measured lines of SPFIT", (".lin", ".lin.gz"), "rotor.formats.spcat.text.lin:read_lin"),
    Format("levels of SPCAT", (".egy.gz",), "rotor.formats.spcat.text.egy:read_egy"),
    Format(
        "levels of SPCAT",
        (".egy",),
        "rotor.formats.spcat.text.egy:read_egy",
        {LEVELS: "rotor.formats.spcat.text.level_list:write_level_list"},
    ),
    Format(
        "data of LAMDA",
        (".dat",),
        "rotor.formats.lamda:refuse_lamda",
        recognises="rotor.formats.lamda:is_lamda_file",
    ),
    Format("input and output of XIAM", (".xi", ".xo", ".xo.gz"), "rotor.formats.internal_rotation.xiam:read_xiam"),
    Format(
        "input of westerfit",
        (".inp",),
        "rotor.formats.internal_rotation.westerfit:read_westerfit",
        recognises="rotor.formats.internal_rotation.westerfit:is_westerfit_file",
    ),
    Format(
        "output of BELGI",
        (".txt", ".out"),
        "rotor.formats.internal_rotation.belgi:read_belgi",
        recognises="rotor.formats.internal_rotation.belgi:is_belgi_file",
    ),
    Format("molecule file", (".toml",), "rotor.formats.read_write:read_top_file"),
    Format(
        "comma-separated values",
        (".csv",),
        writers={TABLE: "rotor.formats.tables:write_csv", MOTION: "rotor.formats.tables:write_motion"},
    ),
    Format(
        "Parquet",
        (".parquet",),
        writers={TABLE: "rotor.formats.tables:write_parquet", MOTION: "rotor.formats.tables:write_motion"},
    ),
    Format(
        "JSON",
        (".json",),
        writers={
            LINES: "rotor.formats.lines.line_tables:write_lines_json",
            TABLE: "rotor.formats.tables:write_json",
            MOTION: "rotor.formats.tables:write_motion",
        },
    ),
)


def formats() -> Iterator[Format]:
    """All formats: those of the table first, so that modules are not searched if one of them fits."""
    yield from FORMATS
    yield from _declared(FOLDER, PACKAGE)


@cache
def _declared(folder: Path, package: str) -> tuple[Format, ...]:
    """The formats that files of a folder declare."""
    files = [file for file in sorted(folder.glob("*.py")) if "\nFORMAT = Format(" in file.read_text(encoding="utf-8")]
    return tuple(import_module(f"{package}.{file.stem}".lstrip(".")).FORMAT for file in files)


def loaded(name: str) -> Any:
    """The object that "module:name" names."""
    module, _, attribute = name.partition(":")
    return getattr(import_module(module), attribute)


def find_reader(path: Path) -> Callable[[Path], Any] | None:
    """The reader for a file name; None if no format has its suffix."""
    for known_format in formats():
        fits = known_format.reader and path.name.lower().endswith(known_format.suffixes)
        if fits and (known_format.recognises is None or loaded(known_format.recognises)(path)):
            reader: Callable[[Path], Any] = loaded(str(known_format.reader))
            return reader
    return None


def find_writer(thing: Any, path: str | os.PathLike[str]) -> Writer:
    """The writer of an object for a file name.

    Raises ValueError, with the suffixes for such objects, if no format has the suffix.
    """
    name, types = Path(path).name.lower(), [_class_name(cls) for cls in type(thing).__mro__]
    for known_format in formats():
        writers = [known_format.writers[cls] for cls in types if cls in known_format.writers]
        if writers and name.endswith(known_format.suffixes):
            writer: Writer = loaded(writers[0])
            return writer
    suffixes = suffixes_for(type(thing))
    if not suffixes:
        raise ValueError(f"{os.fspath(path)}: there is no format for a {type(thing).__name__}")
    raise ValueError(
        f"{os.fspath(path)}: a {type(thing).__name__} can be written as {', '.join(suffixes[:-1])} or {suffixes[-1]}; "
        "the suffix names the format"
    )


def suffixes_for(kind: type) -> list[str]:
    """The suffixes of files to which objects of a class can be written."""
    types = {_class_name(cls) for cls in kind.__mro__}
    return [suffix for known_format in formats() if types & {*known_format.writers} for suffix in known_format.suffixes]


def _class_name(cls: type) -> str:
    return f"{cls.__module__}:{cls.__qualname__}"
