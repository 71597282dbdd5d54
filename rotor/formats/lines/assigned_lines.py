"""Assigned lines from .lin, .csv and .cat files, and back.

A .csv has a column for each quantum number of both states (`j_upper`, `ka_upper`, `kc_upper`, `j_lower`, ...; of several states
`v_upper` too; with spins N in place of J, `n_upper`, and the sums `f1_upper`, ..., `f_upper`, half-integers as 5/2, 2.5, or as twice
the value, 5), a frequency (`frequency_mhz`, `frequency_ghz` or `wavenumber_cm`), its error (`error_mhz`, `error_khz`, `error_ghz` or
`error_cm`), and, where needed, `weight`, `blend` (one text or number for the lines of one measured frequency; without this column
neighbouring lines of one frequency and error are a blend, as in a .lin), `excluded` (yes for a line that does not count), `width_mhz`
(how far the components of a blend may lie apart, rms, at one of its lines or at all) and `comment`. Capitals do not matter. For internal
rotation `species` and `vt` of both states may stand in one column, without `vt` all lines are of v_t = 0, J may stand for N, and species
of one top may be A1, A2, E1, E2 or the numbers of a column `sigma`. Lines in an electric field have `m_upper`, `m_lower` and
`field_kv_per_cm` (or `field_v_per_cm`). Intensities of a predicted list (`rotor spectrum --csv`) are passed over.
A catalogue gives the lines measured in a laboratory (a negative tag); those of one frequency and error are one blend by intensity, and
components of spins are put together at their mean by intensity. A .lne is a line list of westerfit.
"""

from __future__ import annotations

import csv
import io
import math
import os
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.checks import read_text
from rotor.fitting.assignment import Assignments, assignments
from rotor.formats.lines.assigned_lin import with_excluded_lines
from rotor.formats.lines.assigned_lines_writer import write_assigned_lines as write_assigned_lines
from rotor.formats.lines.species_columns import species_number, with_species
from rotor.formats.spcat.text.lin import (
    default_note,
    like_line_before,
    read_lin,
    remark_notes,
    with_defaults,
    without_v,
    without_zeros_behind,
)
from rotor.quantum.labels.quanta import FIELD_STEP_KV_PER_CM
from rotor.table import counted
from rotor.units import MHZ_PER_CM

SUFFIXES = (".lin", ".csv", ".cat", ".cat.gz", ".lne")
QUANTA = {
    "linear": ("j",),
    "spherical": ("j",),
    "prolate": ("j", "k"),
    "oblate": ("j", "k"),
    "asymmetric": ("j", "ka", "kc"),
}
# columns of a predicted list that a fit has no use for
PREDICTED = ("lgint", "energy_lower_cm", "g_upper", "einstein_a_per_s", "strength_debye2", "intensity_cm_per_molecule")
_YES, _NO = ("yes", "true", "1"), ("no", "false", "0", "")
MOST_QUANTUM = 99_999  # a quantum number of a table; levels have far smaller ones
_FREQUENCY = {"frequency_mhz": 1.0, "frequency_ghz": 1e3, "wavenumber_cm": MHZ_PER_CM}
_WIDTH = {"width_mhz": 1.0, "width_khz": 1e-3}
_FIELD = {"field_kv_per_cm": 1.0, "field_v_per_cm": 1e-3}
_ERROR = {"error_mhz": 1.0, "error_khz": 1e-3, "error_ghz": 1e3, "error_cm": MHZ_PER_CM}


def read_assigned_lines(
    path: str | os.PathLike[str], names: Sequence[str], halves: Collection[str] = ()
) -> tuple[Assignments, list[str]]:
    """The assigned lines of a file, and notes on how they were read.

    Parameters
    ----------
    path : path
        .lin, .csv, .cat or .cat.gz.
    names : sequence of str
        The quantum numbers that label a state, such as ("j", "ka", "kc"); in the order of a .lin file.
    halves : collection of str, optional
        Half-integer quantum numbers, which labels contain doubled. In .lin and .cat files they are rounded up.

    Returns
    -------
    (Assignments, list of str)

    Raises
    ------
    ValueError
        With file and line, for an unknown suffix, no lines, or columns and quantum numbers that do not fit.
    """
    text = os.fspath(path).lower()
    if not text.endswith(SUFFIXES):
        raise ValueError(f"{path}: assigned lines are read from {', '.join(SUFFIXES)}")
    if text.endswith(".csv"):
        lines, notes = _from_csv(path, names, halves)
    elif text.endswith(".lne"):
        lines, notes = _from_westerfit(path, names, halves), []
    else:
        lines, notes = (_from_lin if text.endswith(".lin") else _from_catalogue)(path, names)
        lines = with_halves(lines, halves)
    if not len(lines):
        raise ValueError(
            f"{path}: no lines in it" + ("" if text.endswith((".lin", ".csv", ".lne")) else " that are measured")
        )
    return lines, notes


def with_halves(lines: Assignments, halves: Collection[str]) -> Assignments:
    """Lines with doubled half-integers, from lines with half-integers rounded up."""
    columns = [i for i, name in enumerate(lines.names) if name in halves]
    upper, lower = lines.upper.copy(), lines.lower.copy()
    for side in (upper, lower):
        side[:, columns] = 2 * side[:, columns] - 1
    return replace(lines, upper=upper, lower=lower, halves=frozenset(halves))


def names_sums(path: str | os.PathLike[str], count: int) -> bool:
    """Whether lines have sums with spins: a column F, J unlike N (.lne), or more than `count` quantum numbers for each state."""
    text = os.fspath(path).lower()
    if text.endswith(".csv"):
        return any(name in ("f_upper", "f_lower", "n_upper", "n_lower") for name in _read_csv(path)[0])
    if text.endswith(".lne"):
        from rotor.formats.internal_rotation.westerfit import read_line_table

        return any((labels[:, 0] != 2 * labels[:, 1]).any() for labels in read_line_table(path)[:2])
    if not text.endswith(".lin"):
        return False
    lines = without_v(without_zeros_behind(read_lin(path, count), count), count)
    return len(lines) > 0 and bool(lines.counts[0] > count)


def names_field(path: str | os.PathLike[str]) -> bool:
    """Whether the lines of a .csv file have a column for an electric field."""
    return os.fspath(path).lower().endswith(".csv") and bool(set(_FIELD) & set(_read_csv(path)[0]))


def _from_lin(path: str | os.PathLike[str], names: Sequence[str]) -> tuple[Assignments, list[str]]:
    """The lines of a .lin file."""
    read = read_lin(path, len(names))
    lines = with_defaults(read if {"v", "f"} & set(names) else without_v(read, len(names)), names)
    blends = lines.blends()
    used = blends >= 0
    notes = [default_note(lines)] if lines.defaulted else []
    notes += remark_notes(lines, blends)
    if not used.all():
        notes.append(
            f"{counted(int((~used).sum()), 'line that gives', 'lines that give')} the width of a blend: not counted"
        )
    if len(wrong := np.flatnonzero(used & (lines.counts != len(names)))):
        raise ValueError(
            f"{path}, line {wrong[0] + 1} of the list: {lines.counts[wrong[0]]} quantum numbers for each state; "
            f"{len(names)} are needed ({', '.join(names)})"
        )
    upper, lower = (side[used][:, : len(names)] for side in lines.states())
    listed = assignments(
        names, upper, lower, lines.frequency_mhz[used], lines.error_mhz[used], weight=lines.weight[used],
        blend=blends[used], wavenumber=(lines.error < 0)[used], source=Path(path).name,
    )  # fmt: skip
    return with_excluded_lines(listed, lines), notes


def _from_catalogue(path: str | os.PathLike[str], names: Sequence[str]) -> tuple[Assignments, list[str]]:
    """The measured lines of a catalogue."""
    from rotor.formats.lines.assigned_catalogue import catalogue_lines, whole_catalogue_lines

    plain = "v" not in names and names[0] != "n"
    return (catalogue_lines if plain else whole_catalogue_lines)(path, names)


def _from_westerfit(path: str | os.PathLike[str], names: Sequence[str], halves: Collection[str]) -> Assignments:
    """The lines of a line list of westerfit."""
    from rotor.formats.internal_rotation.westerfit import read_line_table

    columns = {"f": 0, "j": 1, "n": 1, "ka": 2, "kc": 3, "species": 4, "vt": 5}
    if not set(names) <= set(columns):
        raise ValueError(
            f"{path}: a line list of westerfit has N, Ka, Kc, species, v_t and one F; the start has {', '.join(names)}"
        )
    *labels, frequency, error = read_line_table(path)
    for side in labels:
        if "f" in names and "f" not in halves and (side[:, 0] % 2).any():
            raise ValueError(f"{path}: J is a half-integer; the spin to start from is whole")
        if "f" not in halves:
            side[:, 0] //= 2
    upper, lower = (side[:, [columns[name] for name in names]] for side in labels)
    return assignments(
        names,
        upper,
        lower,
        frequency,
        error,
        blend=_equal_lines(frequency, error),
        source=Path(path).name,
        halves=halves,
    )


def _from_csv(
    path: str | os.PathLike[str], names: Sequence[str], halves: Collection[str]
) -> tuple[Assignments, list[str]]:
    """The lines of a .csv file."""
    columns, rows = _read_csv(path)
    notes: list[str] = []
    if "species" in names:
        columns, rows, notes = with_species(columns, rows, names)
    if "field" in names:
        rows = [_with_field(path, columns, i, row) for i, row in enumerate(rows, 1)]
        columns = [name for name in columns if name not in _FIELD] + ["field_upper", "field_lower"]
    if passed := [name for name in columns if name in PREDICTED]:
        columns = [name for name in columns if name not in PREDICTED]
        notes = [*notes, f"columns of a prediction that a fit does not use: {', '.join(passed)}"]
    labels = [f"{name}_{side}" for side in ("upper", "lower") for name in names]
    accepted = {*labels, *_FREQUENCY, *_ERROR, *_WIDTH, "weight", "blend", "comment", "excluded"}
    _refuse_columns(path, columns, labels, accepted)
    unit = next(name for name in _FREQUENCY if name in columns)
    error = next((name for name in _ERROR if name in columns), None)
    _refuse_rows(path, rows)
    read = [(name, _half if name.rpartition("_")[0] in halves else _whole) for name in labels]
    numbers = [[read_number(path, i, name, row) for name, read_number in read] for i, row in enumerate(rows, 1)]
    quanta = np.array(numbers, dtype=np.int64).reshape(len(rows), len(labels))
    for i, row in enumerate(quanta.tolist(), 1):
        for side in (row[: len(names)], row[len(names) :]):
            if side[0] < 0:
                label = " ".join(map(str, side))
                raise ValueError(f"{path}, line {i} of the table: there is no level {label}; {names[0]} is 0 or more")
    frequency = np.array([_real(path, i, unit, row) for i, row in enumerate(rows, 1)])
    errors = np.array([_size(path, i, error, row, 0.0) if error else 0.0 for i, row in enumerate(rows, 1)])
    named = "blend" in columns
    blends = _blends([(row.get("blend") or "").strip() for row in rows]) if named else _equal_lines(frequency, errors)
    lines = assignments(
        names, quanta[:, : len(names)], quanta[:, len(names) :], frequency * _FREQUENCY[unit],
        errors * (_ERROR[error] if error else 1.0),
        weight=np.array([_size(path, i, "weight", row, 1.0) for i, row in enumerate(rows, 1)]),
        blend=blends,
        widths_mhz=_widths(path, rows, columns, blends),
        wavenumber=unit == "wavenumber_cm",
        source=Path(path).name,
        comments=[(row.get("comment") or "").strip() for row in rows] if "comment" in columns else (),
        halves=halves,
    )  # fmt: skip
    if "excluded" in columns:
        lines = replace(lines, excluded=np.array([_is_marked(path, i, row) for i, row in enumerate(rows, 1)]))
    return lines, notes + ([] if named else _blend_notes(lines))


def _with_field(path: object, columns: Sequence[str], line: int, row: dict[str, str]) -> dict[str, str]:
    """A row with the electric field of both states as an integer number of steps."""
    from rotor.quantum.effects.stark import HIGHEST_KV_PER_CM  # imported here, since it loads all modules of fields

    units = [name for name in _FIELD if name in columns]
    if len(units) != 1:
        raise ValueError(f"{path}: one column of {', '.join(_FIELD)} is needed, the field of each line")
    value = _real(path, line, units[0], row) * _FIELD[units[0]]
    if abs(value) > HIGHEST_KV_PER_CM:
        raise ValueError(
            f"{path}, line {line} of the table: {units[0]} = {row[units[0]]}: expected at most {HIGHEST_KV_PER_CM:g} kV/cm"
        )
    steps = str(round(value / FIELD_STEP_KV_PER_CM))
    return {
        **{name: text for name, text in row.items() if name not in _FIELD},
        "field_upper": steps,
        "field_lower": steps,
    }


def _equal_lines(frequency: Floats, error: Floats) -> list[int]:
    """Numbers of blends: as in a .lin file, neighbouring lines of equal frequency and error form one."""
    near, alike = like_line_before(frequency, error)
    places = np.cumsum(np.append(np.zeros(min(len(frequency), 1), dtype=bool), ~(near & alike)))
    return [int(place) for place in places]


def _blend_notes(lines: Assignments) -> list[str]:
    """Notes on blends that follow from equal frequencies."""
    count = int(lines.blended.sum())
    if not count:
        return []
    return [
        f"{count} lines have the frequency and the error of their neighbours: they are "
        f"{counted(len(set(lines.blend[lines.blended].tolist())), 'blend')}, as in a .lin file; use a column blend to change this"
    ]


def _is_marked(path: object, line: int, row: Mapping[str, str]) -> bool:
    """Whether a line is marked as excluded."""
    text = (row.get("excluded") or "").strip().lower()
    if text not in (*_YES, *_NO):
        raise ValueError(f"{path}, line {line} of the table: excluded reads {text!r}; yes or no is needed")
    return text in _YES


def _read_csv(path: str | os.PathLike[str]) -> tuple[list[str], list[dict[str, str]]]:
    """Names of the columns and the rows of a .csv file, without blank lines and comments."""
    text = io.StringIO(read_text(path))
    reader = csv.DictReader(row for row in text if row.strip() and not row.lstrip().startswith("#"))
    columns = [name.strip().lower() for name in reader.fieldnames or ()]
    reader.fieldnames = columns
    return columns, list(reader)


def _widths(
    path: object, rows: Sequence[Mapping[str, str]], columns: Sequence[str], blends: Sequence[int]
) -> dict[int, float]:
    """The stated widths of blends by number."""
    widths, counts = dict[int, float](), Counter(blends)
    for name in (column for column in _WIDTH if column in columns):
        for i, (row, blend) in enumerate(zip(rows, blends, strict=True), 1):
            width = _size(path, i, name, row, 0.0) * _WIDTH[name]
            if width and counts[blend] < 2:
                raise ValueError(
                    f"{path}, line {i} of the table: a {name} belongs to a blend; name a blend of two lines or more"
                )
            if width and widths.setdefault(blend, width) != width:
                raise ValueError(f"{path}, line {i} of the table: another {name} of this blend stands before; give one")
    return widths


def _refuse_rows(path: object, rows: Sequence[Mapping[Any, Any]]) -> None:
    """ValueError for a row with more values than columns."""
    for i, row in enumerate(rows, 1):
        if None in row:
            raise ValueError(
                f"{path}, line {i} of the table: {counted(len(row[None]), 'value')} more than there are columns"
            )


def _shown(labels: Sequence[str]) -> list[str]:
    """Columns of labels in a file, in which the field of a line occurs once."""
    field = [next(iter(_FIELD))] if "field_upper" in labels else []
    return [name for name in labels if not name.startswith("field_")] + field


def _refuse_columns(
    path: str | os.PathLike[str], columns: Sequence[str], labels: Sequence[str], accepted: set[str]
) -> None:
    """Raise ValueError for missing or unknown columns."""
    other = next((sign for sign in (";", "\t") if columns and sign in columns[0]), None)
    if other is not None:
        raise ValueError(
            f"{path}: its columns are separated by {other!r}; expected commas, and a point in decimal numbers"
        )
    missing = [name for name in labels if name not in columns]
    strange = [name for name in columns if name not in accepted]
    if missing or strange:
        what = f"no column {', '.join(missing)}" if missing else f"unknown column {', '.join(map(repr, strange))}"
        present = f"; the file has {', '.join(columns) or 'none: its first line is empty'}" if missing else ""
        raise ValueError(
            f"{path}: {what}; columns are {', '.join(_shown(labels))}, a frequency ({' or '.join(_FREQUENCY)}), an error "
            f"({' or '.join(_ERROR)}), and, where needed, weight, blend, width_mhz, excluded, comment{present}"
        )
    twice = next((name for name in columns if columns.count(name) > 1), None)
    if twice is not None:
        raise ValueError(f"{path}: the column {twice} stands twice; give it once")
    errors = [name for name in _ERROR if name in columns]
    if len(errors) > 1:
        raise ValueError(f"{path}: columns {' and '.join(errors)}; give one error of a line")
    if len([name for name in _FREQUENCY if name in columns]) != 1:
        raise ValueError(f"{path}: one column of {', '.join(_FREQUENCY)} is needed")


def _real(path: object, line: int, name: str, row: Mapping[str, str], default: float | None = None) -> float:
    """A number of a row."""
    text = (row.get(name) or "").strip().replace("−", "-")
    if not text and default is not None:
        return default
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"{path}, line {line} of the table: {name} reads {text!r}; a finite number is needed")
    return number


def _size(path: object, line: int, name: str, row: Mapping[str, str], default: float) -> float:
    """A number of a row, 0 or more."""
    value = _real(path, line, name, row, default)
    if value < 0:
        raise ValueError(f"{path}, line {line} of the table: {name} = {value:g}; a number of 0 or more is needed")
    return value


def _whole(path: object, line: int, name: str, row: Mapping[str, str]) -> int:
    """An integer of a row."""
    text = (row.get(name) or "").strip()
    if name.startswith("species_"):
        return species_number(path, line, name, text)
    if text.partition("/")[2] == "2":
        raise ValueError(f"{path}, line {line} of the table: {name} reads {text!r}; expected a whole number")
    value = _real(path, line, name, row)
    if not float(value).is_integer():
        raise ValueError(f"{path}, line {line} of the table: {name} = {value:g}; expected a whole number")
    return _bounded(path, line, name, int(value))


def _bounded(path: object, line: int, name: str, value: int) -> int:
    """A quantum number within bounds; fields have bounds of their own."""
    if abs(value) > MOST_QUANTUM and not name.startswith("field_"):
        raise ValueError(
            f"{path}, line {line} of the table: {name} = {value:.0e}; expected a number up to {MOST_QUANTUM}"
        )
    return value


def _half(path: object, line: int, name: str, row: Mapping[str, str]) -> int:
    """Twice a half-integer, written as 5/2, 2.5, or doubled as 5."""
    text = (row.get(name) or "").strip()
    number, slash, two = text.partition("/")
    if number.isdigit() and int(number) % 2 and (two == "2" or not slash):
        return _bounded(path, line, name, int(number))
    value = _real(path, line, name, row) if not slash else math.nan
    if not (2 * value) % 2 == 1:
        raise ValueError(
            f"{path}, line {line} of the table: {name} reads {text!r}; expected a half-integer: 5/2, 2.5, or twice its "
            "value, 5"
        )
    return _bounded(path, line, name, int(2 * value))


def _blends(texts: Sequence[str]) -> list[int]:
    """Numbers of blends: lines with equal text form one; a line without text is separate."""
    places: dict[str, int] = {}
    return [places.setdefault(text or f"\0{i}", len(places)) for i, text in enumerate(texts)]
