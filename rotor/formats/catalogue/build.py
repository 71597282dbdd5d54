"""Sources added to a local catalogue: files and folders of .cat, ExoMol, HITRAN, and the library of molecules.

Lines are added to a copy of the catalogue, which replaces it when all lines are sorted; an interrupted command leaves the old catalogue. A
file that cannot be read is reported with file, line and rule, and the others are still added. A source that is added again replaces its
lines.
"""

from __future__ import annotations

import datetime
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.formats.atomic_write import atomic_path
from rotor.formats.catalogue.cat_species import read_cat_species
from rotor.formats.catalogue.catdir import CatdirEntry, catdir_beside, is_catdir, read_catdir
from rotor.formats.catalogue.database import MEMORY_MB, connect, new_catalogue, scalar
from rotor.formats.catalogue.names import hill_formula
from rotor.observed.model.species import SpeciesLines

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection

LIBRARY = "library"
_LIBRARY_K = 300.0
_LIBRARY_CUT = -9.0  # LGINT at 300 K
_LIBRARY_MHZ = 3e6
_ENTRY_MB = 128  # for pages of the file while lines are entered: DuckDB fills what it is given with pages that nothing reads again
_CHECKPOINT_LINES = 1_000_000  # after which what is in the log of the database goes into its file
Progress = Callable[[str], None]


@dataclass(frozen=True)
class SourceFacts:
    """Statements of the user about sources: licence, citation, date, and names, formulas or InChIKeys by tag or name of a species."""

    database: str = ""
    licence: str = ""
    citation: str = ""
    date: str = ""
    inchikeys: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Added:
    """Result of adding a source: its name, its species and number of lines, or the fault."""

    source: str
    species: str = ""
    lines: int = 0
    fault: str | None = None


@dataclass(frozen=True)
class Batch:
    """Lines of a source in pieces of bounded size.

    states: texts of the states where `upper` and `lower` of the pieces are rows of them, else None.
    """

    source: str
    pieces: Iterable[SpeciesLines]
    states: NDArray[Any] | None = None


def add_sources(
    path: str | os.PathLike[str],
    sources: Sequence[str],
    facts: SourceFacts | None = None,
    *,
    catdir: str | None = None,
    progress: Progress | None = None,
) -> list[Added]:
    """Add sources to a catalogue, which is created if it does not exist.

    path: path of the catalogue. sources: files (.cat, .cat.gz, .par or .hitran of HITRAN, .states of ExoMol), folders of them, or
    `library`. catdir: table of species with Q(T); by default those beside each .cat file. progress: called with the name of each source.
    Returns: one for each file or molecule, in order; those with a fault gave no lines.
    Raises ValueError, and changes nothing, if all of them have one.
    Raises FileNotFoundError for a source that does not exist. Raises ValueError for a folder without a file of a known kind; a file that
    is no catalogue in the place of the catalogue.
    """
    target, entries = Path(path), None if catdir is None else read_catdir(catdir)
    jobs = [job for source in sources for job in _jobs(source, entries)]
    report: list[Added] = []
    with atomic_path(target) as unfinished:
        if target.exists():
            connect(target, read_only=True).close()
            shutil.copyfile(target, unfinished)
            engine = connect(unfinished)
        else:
            with new_catalogue(unfinished):
                pass
            engine = connect(unfinished)
        try:
            engine.execute(f"SET temp_directory = '{unfinished.parent / 'sort'}'")
            engine.execute(f"SET memory_limit = '{_ENTRY_MB}MB'")
            for name, read in jobs:
                if progress:
                    progress(name)
                report.append(_add(engine, name, read, facts or SourceFacts()))
            faults = [entry.fault for entry in report if entry.fault]
            if len(faults) == len(report):
                raise ValueError(f"nothing to add: {'; '.join(faults)}")
            engine.execute(f"SET memory_limit = '{MEMORY_MB}MB'")
            _sort(engine)
        finally:
            engine.close()
    return report


def _jobs(source: str, entries: Mapping[int, CatdirEntry] | None) -> Iterator[tuple[str, Callable[[], Batch]]]:
    """Files or molecules of a source: names, and functions that start reading."""
    if source == LIBRARY and not Path(source).exists():
        yield from _library()
        return
    path = Path(source)
    if not path.exists():
        raise FileNotFoundError(
            f"{source}: no such file or folder; expected .cat, HITRAN's .par, ExoMol's .states, or 'library'"
        )
    files = sorted(file for file in path.rglob("*") if file.is_file() and _kind(file)) if path.is_dir() else [path]
    if not files:
        raise ValueError(f"{source}: no .cat, .par, .hitran or .states file in this folder")
    for file in files:
        if _kind(file) is None:
            raise ValueError(f"{file}: expected .cat, .cat.gz, .par, .hitran or .states")
        yield str(file), lambda file=file: _batch(file, entries)  # type: ignore[misc]


def _kind(path: Path) -> str | None:
    name = path.name.lower().removesuffix(".gz").removesuffix(".bz2")
    if name.endswith(".cat"):
        return None if is_catdir(path) else "cat"
    if name.endswith(".states"):
        return "exomol"
    if name.endswith((".par", ".hitran")):
        return "hitran"
    return None


def _batch(file: Path, entries: Mapping[int, CatdirEntry] | None) -> Batch:
    kind = _kind(file)
    if kind == "cat":
        species = read_cat_species(file, entries if entries is not None else catdir_beside(file))
        return Batch(str(file), [species])
    if kind == "exomol":
        from rotor.formats.catalogue.exomol import exomol_species, read_states

        states = read_states(file)
        return Batch(str(file), exomol_species(file, states), states.label)
    from rotor.formats.catalogue.hitran_species import hitran_species

    return Batch(str(file), hitran_species(file))


def _library() -> Iterator[tuple[str, Callable[[], Batch]]]:
    """The molecules of the library with a dipole."""
    from rotor.formats.molecules.library import names

    for name in sorted({path.stem for path in names().values()}):
        yield f"{LIBRARY}: {name}", lambda name=name: _library_batch(name)  # type: ignore[misc]


def _library_batch(name: str) -> Batch:
    from rotor.formats.read_write import read
    from rotor.observed.model.species import species_from_lines
    from rotor.spectra.lines import line_list

    top = read(name)
    lines = line_list(top, temperature_k=_LIBRARY_K, min_lgint=_LIBRARY_CUT, range_mhz=(0.0, _LIBRARY_MHZ))
    return Batch(f"{LIBRARY}: {name}", [species_from_lines(lines, name)])


def _add(engine: DuckDBPyConnection, name: str, read: Callable[[], Batch], facts: SourceFacts) -> Added:
    """Add one source; with a fault nothing is added.

    Pieces are stored as they come, since a transaction of all of them would stand in memory: what a source gave before is removed when
    all is entered, and what was entered when there is a fault.
    """
    first = int(scalar(engine, "SELECT coalesce(max(number), 0) + 1 FROM species"))
    try:
        batch = read()
        added = _entered(engine, batch, facts)
    except (ValueError, OSError) as error:
        _remove(engine, "number >= ?", first)
        return Added(name, fault=str(error))
    _remove(engine, f"number < {first} AND source = ?", batch.source)
    return added


def _entered(engine: DuckDBPyConnection, batch: Batch, facts: SourceFacts) -> Added:
    numbers: dict[str, int] = {}
    texts: dict[str, int] = {}
    first = None if batch.states is None else _new_states(engine, batch.states)
    total = stored = 0
    for piece in batch.pieces:
        if piece.name not in numbers:
            numbers[piece.name] = _species(engine, piece, batch.source, facts)
        upper, lower = (
            (piece.upper.astype(np.int64) + first, piece.lower.astype(np.int64) + first)
            if first is not None
            else _state_numbers(engine, piece, texts)
        )
        _insert(engine, piece, numbers[piece.name], upper, lower)
        total += len(piece)
        stored += len(piece)
        if stored >= _CHECKPOINT_LINES:
            engine.execute("CHECKPOINT")
            stored = 0
    if not numbers:
        raise ValueError(f"{batch.source}: no lines")
    for number in numbers.values():
        engine.execute(
            "UPDATE species SET lines = (SELECT count(*) FROM lines WHERE species = ?) WHERE number = ?",
            [number, number],
        )
    return Added(batch.source, ", ".join(numbers), total)


def _remove(engine: DuckDBPyConnection, condition: str, value: Any) -> None:
    """Remove the species of a condition, with their lines."""
    for (number,) in engine.execute(f"SELECT number FROM species WHERE {condition}", [value]).fetchall():
        for table in ("lines", "partition"):
            engine.execute(f"DELETE FROM {table} WHERE species = ?", [number])
        engine.execute("DELETE FROM species WHERE number = ?", [number])


def _species(engine: DuckDBPyConnection, species: SpeciesLines, source: str, facts: SourceFacts) -> int:
    """A row of the table of species and Q(T); the number."""
    number, identity = int(scalar(engine, "SELECT coalesce(max(number), 0) + 1 FROM species")), species.identity
    tag = identity.get("tag")
    engine.execute(
        "INSERT INTO species VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, 0)",
        [
            number,
            species.name,
            identity.get("formula") or hill_formula(species.name),
            tag,
            identity.get("inchikey") or facts.inchikeys.get(str(tag)) or facts.inchikeys.get(species.name),
            source,
            identity.get("database") or facts.database,
            facts.licence,
            facts.citation,
            facts.date or datetime.date.today().isoformat(),
            identity.get("note"),
        ],
    )
    kelvin, q = species.partition.temperature_k, species.partition.q
    _insert_columns(engine, "partition", {"species": np.full(len(q), number), "temperature_k": kelvin, "q": q})
    return number


def _insert(
    engine: DuckDBPyConnection, piece: SpeciesLines, number: int, upper: NDArray[Any], lower: NDArray[Any]
) -> None:
    columns = {
        "frequency_mhz": piece.frequency_mhz,
        "error_mhz": piece.error_mhz,
        "strength_nm2_mhz": piece.strength_nm2_mhz,
        "energy_lower_k": piece.energy_lower_k,
        "g_upper": piece.g_upper,
        "species": np.full(len(piece), number),
        "upper": upper,
        "lower": lower,
    }
    _insert_columns(engine, "lines", columns)


def _state_numbers(
    engine: DuckDBPyConnection, piece: SpeciesLines, texts: dict[str, int]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Numbers of the states of a piece; new texts are entered."""
    unique, inverse = np.unique(np.concatenate([piece.upper, piece.lower]), return_inverse=True)
    new = [text for text in unique.tolist() if text not in texts]
    if new:
        first = _new_states(engine, np.array(new, dtype=np.str_))
        texts |= {text: first + i for i, text in enumerate(new)}
    numbers = np.array([texts[text] for text in unique.tolist()], dtype=np.int64)[inverse]
    return numbers[: len(piece)], numbers[len(piece) :]


def _new_states(engine: DuckDBPyConnection, texts: NDArray[Any]) -> int:
    """Enter texts of states; the number of the first."""
    first = int(scalar(engine, "SELECT coalesce(max(number), 0) + 1 FROM states"))
    _insert_columns(engine, "states", {"number": np.arange(first, first + len(texts)), "text": texts.astype(object)})
    return first


def _insert_columns(engine: DuckDBPyConnection, table: str, columns: Mapping[str, NDArray[Any]]) -> None:
    engine.register("piece", dict(columns))
    engine.execute(f"INSERT INTO {table} SELECT {', '.join(columns)} FROM piece")
    engine.unregister("piece")


def _sort(engine: DuckDBPyConnection) -> None:
    """Sort the lines by frequency, and free the space of removed rows in the file."""
    engine.execute("SET preserve_insertion_order = true")
    engine.execute("CREATE TABLE sorted AS SELECT * FROM lines ORDER BY frequency_mhz")
    engine.execute("DROP TABLE lines")
    engine.execute("ALTER TABLE sorted RENAME TO lines")
    engine.execute("CHECKPOINT")
