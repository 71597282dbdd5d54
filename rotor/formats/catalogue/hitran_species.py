"""HITRAN's 160-character records as species: strengths from Einstein coefficients, in pieces of bounded memory.

Q(T) is that of a file with the same name and the suffix .pf beside (temperature and Q in two columns, as HITRAN's q*.txt). Without it
Q(296 K) follows from the file's own intensities, S = A g' [...]/(8π c ν² Q) with the isotopologue's abundance in it, and Q rises
with T^(3/2) from there; a note says so.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.formats.catalogue.exomol import opened
from rotor.formats.lines.hitran import LENGTH, TEMPERATURE_K, isotopologue_number, nm2_mhz, read_hitran
from rotor.observed.model.partition import PartitionTable
from rotor.observed.model.species import SpeciesLines, species_lines, strength_from_einstein

Columns = dict[str, NDArray[Any]]

PIECE_LINES = 1 << 16
SCALED_NOTE = "Q(296 K) from the file's intensities, with the isotopologue's abundance; T^(3/2) at other temperatures: no .pf file beside"
_SCALED_K = (10.0, 30.0, 100.0, 296.0, 1000.0)
_COLUMNS = {"molecule": (0, 2), "isotopologue": (2, 3), "wavenumber": (3, 15), "intensity": (15, 25), "a": (25, 35), "energy": (45, 55),
            "upper": (97, 112), "lower": (112, 127), "g_upper": (146, 153)}  # fmt: skip


def hitran_species(path: Path) -> Iterator[SpeciesLines]:
    """The lines of a file, a species for each isotopologue, in pieces; ValueError with file, line and column for what is no record."""
    tables: dict[str, PartitionTable] = {}
    stated = _partition_beside(path)
    for piece in _pieces(path):
        for key in np.unique(piece["species"]).tolist():
            rows = {name: values[piece["species"] == key] for name, values in piece.items()}
            if key not in tables:
                tables[key] = stated or _intensity_partition(rows)
            yield _species(key, rows, tables[key], path, stated is None)


def _species(key: str, rows: Columns, table: PartitionTable, path: Path, scaled: bool) -> SpeciesLines:
    frequency = rows["wavenumber"] * units.MHZ_PER_CM
    return species_lines(
        key,
        frequency,
        strength_from_einstein(rows["a"], frequency, rows["g_upper"]),
        rows["energy"] * units.MHZ_PER_CM / units.MHZ_PER_K,
        rows["g_upper"],
        table,
        upper=rows["upper"],
        lower=rows["lower"],
        source=str(path),
        identity={"database": "HITRAN"} | ({"note": SCALED_NOTE} if scaled else {}),
    )


def _partition_beside(path: Path) -> PartitionTable | None:
    beside = path.with_suffix(".pf")
    if not beside.exists():
        return None
    kelvin, q = np.loadtxt(beside, usecols=(0, 1), unpack=True, ndmin=2)
    return PartitionTable(kelvin, q, str(beside))


def _intensity_partition(rows: Columns) -> PartitionTable:
    """Q(296 K) as the median over lines of the value from strength and intensity."""
    frequency = rows["wavenumber"] * units.MHZ_PER_CM
    strength = strength_from_einstein(rows["a"], frequency, rows["g_upper"])
    lower_k = rows["energy"] * units.MHZ_PER_CM / units.MHZ_PER_K
    population = np.exp(-lower_k / TEMPERATURE_K) * -np.expm1(-frequency / (units.MHZ_PER_K * TEMPERATURE_K))
    used = (rows["intensity"] > 0) & (strength > 0)
    if not used.any():
        raise ValueError("no line with an intensity and an Einstein coefficient: Q does not follow from the file")
    q = float(np.median((strength * population)[used] / nm2_mhz(rows["intensity"][used])))
    kelvin = np.array(_SCALED_K)
    return PartitionTable(kelvin, q * (kelvin / TEMPERATURE_K) ** 1.5, SCALED_NOTE)


def _pieces(path: Path) -> Iterator[Columns]:
    count = 0
    with opened(path) as handle:
        while lines := handle.readlines(PIECE_LINES * (LENGTH + 1)):
            yield _record_columns(lines, path, count)
            count += len(lines)


def _record_columns(lines: list[bytes], path: Path, before: int) -> Columns:
    """Columns of records; those of unusual length, and faulty ones, go through the reader that names the fault."""
    bodies = [line.rstrip(b"\r\n") for line in lines]
    try:
        if any(len(body) != LENGTH for body in bodies):
            raise ValueError
        text = np.frombuffer(b"".join(bodies), dtype="S1").reshape(len(bodies), LENGTH)
        cut = {name: np.ascontiguousarray(text[:, a:b]).view(f"S{b - a}")[:, 0] for name, (a, b) in _COLUMNS.items()}
        columns: Columns = {
            name: cut[name].astype(np.float64) for name in ("wavenumber", "intensity", "a", "energy", "g_upper")
        }
        kinds = {pair: pair.decode("ascii").strip() for pair in np.unique(text[:, :3].copy().view("S3")[:, 0]).tolist()}
        columns["species"] = np.array(
            [_name(kinds[code]) for code in np.ascontiguousarray(text[:, :3]).view("S3")[:, 0].tolist()]
        )
        for side, (a, b) in (("upper", _COLUMNS["upper"]), ("lower", _COLUMNS["lower"])):
            words = np.ascontiguousarray(text[:, a:b]).view("S15")[:, 0]
            columns[side] = np.char.strip(words.astype(np.str_))
        return columns
    except ValueError:
        return _slow_columns(lines, path, before)


def _slow_columns(lines: list[bytes], path: Path, before: int) -> Columns:
    blank = b"\n" * before  # so that lines count from the beginning of the file
    try:
        records = read_hitran(blank + b"".join(lines))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    return {
        "wavenumber": records.wavenumber_cm,
        "intensity": records.intensity_cm,
        "a": records.einstein_a_per_s,
        "energy": records.energy_lower_cm,
        "g_upper": records.g_upper,
        "species": np.array(
            [
                f"HITRAN {m}, isotopologue {i}"
                for m, i in zip(records.molecule.tolist(), records.isotopologue.tolist(), strict=True)
            ]
        ),
        "upper": np.char.strip(records.local_upper),
        "lower": np.char.strip(records.local_lower),
    }


def _name(text: str) -> str:
    return f"HITRAN {int(text[:-1])}, isotopologue {isotopologue_number(text[-1])}"
