"""A local catalogue: the lines of many species in one DuckDB file, sorted by frequency.

Tables: `species` (name, formula, tag, InChIKey, source, licence, citation, date, note), `partition` (Q at temperatures), `states`
(quantum numbers as text, each once), `lines` (frequency, error, strength, lower energy, degeneracy, and numbers of the other tables). The
lines are stored in order of frequency. A range is read without scanning the others, since DuckDB stores the smallest and the largest
value of each block of rows. `SpeciesLines` are returned as they were added.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.formats.catalogue.names import hill_formula, same_species
from rotor.observed.model.partition import PartitionTable
from rotor.observed.model.species import SpeciesLines, species_lines
from rotor.table import Table

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection

VERSION = 1
MEMORY_MB = 400
SCHEMA = """
CREATE TABLE about (key VARCHAR PRIMARY KEY, value VARCHAR);
CREATE TABLE species (number INTEGER PRIMARY KEY, name VARCHAR, formula VARCHAR, tag INTEGER, inchikey VARCHAR, source VARCHAR,
    database VARCHAR, licence VARCHAR, citation VARCHAR, date VARCHAR, note VARCHAR, lines BIGINT);
CREATE TABLE partition (species INTEGER, temperature_k DOUBLE, q DOUBLE);
CREATE TABLE states (number BIGINT, text VARCHAR);
CREATE TABLE lines (frequency_mhz DOUBLE, error_mhz FLOAT, strength_nm2_mhz DOUBLE, energy_lower_k DOUBLE, g_upper FLOAT, species INTEGER,
    upper BIGINT, lower BIGINT);
"""
_FACTS = ("name", "formula", "tag", "inchikey", "source", "database", "licence", "citation", "date", "note", "lines")


@dataclass(frozen=True, eq=False, repr=False)
class CatalogueSpecies(Table):
    """The species of a catalogue in rows: number, the facts of `species`, and number of lines."""

    number: NDArray[np.int64]
    facts: Mapping[str, NDArray[Any]]

    @property
    def columns(self) -> dict[str, Any]:
        """number, name, formula, tag, inchikey, source, database, licence, citation, date, note, lines."""
        return {"number": self.number, **self.facts}


class LineCatalogue:
    """A catalogue opened for reading, as a context manager.

    >>> # with LineCatalogue("lines.rotorcat") as catalogue: catalogue.species_between(100e3, 101e3)
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        if not self.path.is_file():
            raise FileNotFoundError(f"{path}: no such catalogue; make it with 'rotor catalogue add'")
        self._engine = connect(self.path, read_only=True)
        self._texts: dict[int, str] = {}

    def __enter__(self) -> LineCatalogue:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._engine.close()

    def __len__(self) -> int:
        """Number of lines."""
        return int(scalar(self._engine, "SELECT count(*) FROM lines"))

    def species(self) -> CatalogueSpecies:
        """The table of species, in order of their names."""
        rows = self._engine.execute(f"SELECT number, {', '.join(_FACTS)} FROM species ORDER BY name, number").fetchall()
        columns = list(zip(*rows, strict=True)) if rows else [()] * (1 + len(_FACTS))
        facts = {
            name: np.array([("" if value is None else value) for value in column])
            for name, column in zip(_FACTS, columns[1:], strict=True)
        }
        return CatalogueSpecies(np.array(columns[0], dtype=np.int64), facts)

    def numbers(self, word: str) -> list[int]:
        """Numbers of the species with a name, tag, formula or InChIKey; ValueError if there are none."""
        rows = self._engine.execute(
            "SELECT number, name, formula, tag, inchikey FROM species ORDER BY number"
        ).fetchall()
        matches = [
            row[0] for row in rows if row[1] == word or str(row[3]) == word.lstrip("0") or (row[4] and row[4] == word)
        ]
        matches = matches or [row[0] for row in rows if same_species(row[1], word)]
        if not matches and "," not in word:  # a state follows a comma, and a formula has no state
            matches = [row[0] for row in rows if row[2] and row[2] == hill_formula(word)]
        if not matches:
            import difflib

            near = difflib.get_close_matches(word, [row[1] for row in rows], n=3, cutoff=0.5)
            hint = f"; similar names: {', '.join(near)}" if near else ""
            raise ValueError(f"{self.path}: no species {word!r} by name, tag, formula or InChIKey{hint}")
        return [int(each) for each in matches]

    def lines(self, first_mhz: float, last_mhz: float, words: Sequence[str] = ()) -> dict[str, NDArray[Any]]:
        """Lines of a range as columns, rising in frequency; of the species that words mean, or of all."""
        chosen = sorted({number for word in words for number in self.numbers(word)})
        where = f" AND species IN ({', '.join(map(str, chosen))})" if words else ""
        columns = self._engine.execute(
            f"SELECT * FROM lines WHERE frequency_mhz >= ? AND frequency_mhz <= ?{where}", [first_mhz, last_mhz]
        ).fetchnumpy()
        # sorted here: DuckDB splits a sort of a long table into parts of it, which takes three times as long as the range
        order = np.lexsort((columns["species"], columns["frequency_mhz"]))
        return {name: np.asarray(values)[order] for name, values in columns.items()}

    def species_between(self, first_mhz: float, last_mhz: float, words: Sequence[str] = ()) -> list[SpeciesLines]:
        """Species with lines in a range of frequencies, in order of their numbers.

        words: names, tags, formulas or InChIKeys; all species by default. A formula may mean several.
        Returns: species with their lines in the range only.
        Raises ValueError for a word without a species.
        """
        rows = self.lines(first_mhz, last_mhz, words)
        self._read_texts(np.unique(np.concatenate([rows["upper"], rows["lower"]])))
        order = np.argsort(rows["species"], kind="stable")
        numbers, starts = np.unique(rows["species"][order], return_index=True)
        pieces = np.split(order, starts[1:]) if len(numbers) else []
        facts, tables = self._facts(numbers.tolist()), self._partitions(numbers.tolist())
        return [
            self._species(facts[number], tables[number], {name: values[piece] for name, values in rows.items()})
            for number, piece in zip(numbers.tolist(), pieces, strict=True)
        ]

    def _partitions(self, numbers: Sequence[int]) -> dict[int, PartitionTable]:
        """Q(T) of species."""
        columns = self._engine.execute(
            f"SELECT * FROM partition WHERE species IN ({_listed(numbers)}) ORDER BY 1, 2"
        ).fetchnumpy()
        number, kelvin, q = (np.asarray(columns[name]) for name in ("species", "temperature_k", "q"))
        return {
            species: PartitionTable(kelvin[number == species], q[number == species], f"{self.path}, species {species}")
            for species in numbers
        }

    def _facts(self, numbers: Sequence[int]) -> dict[int, dict[str, Any]]:
        """Rows of the table of species."""
        rows = self._engine.execute(
            f"SELECT number, {', '.join(_FACTS)} FROM species WHERE number IN ({_listed(numbers)})"
        ).fetchall()
        return {row[0]: dict(zip(_FACTS, row[1:], strict=True)) for row in rows}

    def _species(
        self, facts: Mapping[str, Any], partition: PartitionTable, rows: Mapping[str, NDArray[Any]]
    ) -> SpeciesLines:
        identity = {
            key: value
            for key, value in facts.items()
            if value not in (None, "") and key not in ("name", "source", "lines")
        }
        return species_lines(
            facts["name"],
            rows["frequency_mhz"],
            rows["strength_nm2_mhz"],
            rows["energy_lower_k"],
            rows["g_upper"],
            partition,
            error_mhz=rows["error_mhz"],
            upper=np.array([self._texts[text] for text in rows["upper"].tolist()], dtype=np.str_),
            lower=np.array([self._texts[text] for text in rows["lower"].tolist()], dtype=np.str_),
            source=facts["source"] or str(self.path),
            identity=identity,
        )

    def _read_texts(self, numbers: NDArray[Any]) -> None:
        """Read texts of states that are not in memory yet."""
        new = np.array([each for each in numbers.tolist() if each not in self._texts], dtype=np.int64)
        if len(new):
            self._engine.register("requested", {"number": new})
            rows = self._engine.execute(
                "SELECT states.number, text FROM states JOIN requested ON states.number = requested.number"
            ).fetchall()
            self._engine.unregister("requested")
            self._texts |= dict(rows)


def _listed(numbers: Sequence[int]) -> str:
    return ", ".join(map(str, numbers)) or "NULL"


def scalar(engine: DuckDBPyConnection, command: str) -> Any:
    """The first value of the first row of an answer, None without one; the answer is read to its end."""
    rows = engine.execute(command).fetchall()
    return rows[0][0] if rows else None


def connect(path: Path, *, read_only: bool = False) -> DuckDBPyConnection:
    """An engine on a file; ValueError for one that is no catalogue of this version."""
    import duckdb

    try:
        engine = duckdb.connect(str(path), read_only=read_only, config={"memory_limit": f"{MEMORY_MB}MB"})
    except duckdb.IOException as error:
        raise ValueError(f"{path}: not a catalogue: {str(error).splitlines()[0]}") from None
    try:
        version = scalar(engine, "SELECT value FROM about WHERE key = 'version'")
    except duckdb.CatalogException:
        engine.close()
        raise ValueError(f"{path}: a DuckDB file, but not a catalogue of lines") from None
    if version is None or int(version) != VERSION:
        engine.close()
        raise ValueError(
            f"{path}: a catalogue of version {version}; this release reads version {VERSION}: build the catalogue again"
        )
    return engine


@contextmanager
def new_catalogue(path: Path) -> Iterator[DuckDBPyConnection]:
    """An engine on a new, empty catalogue."""
    import duckdb

    with duckdb.connect(
        str(path), config={"memory_limit": f"{MEMORY_MB}MB", "temp_directory": str(path.parent / "sort")}
    ) as engine:
        engine.execute(SCHEMA)
        engine.execute("INSERT INTO about VALUES ('version', ?)", [str(VERSION)])
        yield engine
