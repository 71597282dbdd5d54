"""Strict reader for xyz and extended xyz text; errors give the line.

Accepted: any line ending, a byte-order mark, blank lines before and among the atoms, `D` exponents, a unicode minus, atomic numbers
instead of symbols, isotopes written as `D`, `T`, `2H`, `13C`. Other deviations are refused.
"""

import codecs
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotor.checks import not_text
from rotor.molecules.molecule import Molecule
from rotor.molecules.nuclei import Isotope, element_symbol, isotope, isotope_by_mass
from rotor.units import DEBYE_PER_E_ANGSTROM

_LINE_END = re.compile(r"\r\n|\n|\r")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
_STATED = re.compile(r"\b(charge|multiplicity)\s*=\s*([+-]?\d+)(?![\w.])")
_NUMBERED = re.compile(r"[A-Za-z]{1,2}-?\d+")
_MINUS_SIGNS = str.maketrans("\u2212\u2013\u2012", "---")  # minus sign, en dash, figure dash
_ENCODINGS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))


@dataclass(frozen=True)
class _Columns:
    """Columns of an atom's line, counted from 0."""

    label: int = 0
    position: int = 1
    mass: int | None = None
    count: int = 4


def decode(content: bytes, where: str) -> str:
    """Text of a file: UTF-8, or the encoding of its byte-order mark; ValueError for other bytes."""
    encoding = next((name for mark, name in _ENCODINGS if content.startswith(mark)), "utf-8")
    try:
        return content.decode(encoding)
    except UnicodeDecodeError as error:
        raise not_text(error, where) from None


def parse_xyz(text: str, where: str = "xyz text") -> Molecule:
    r"""The molecule in xyz or extended xyz text.

    Parameters
    ----------
    text : str
        Number of atoms; a comment; a line per atom: symbol, isotope or atomic number, then x y z in Å. A comment with `Properties=`
        makes it extended xyz, from which `dipole` (e Å, as written by ASE) and the column `masses` are read too; `charge` and
        `multiplicity` (charge=1) are read from any comment.
    where : str
        File name for messages.

    Returns
    -------
    Molecule
        Notes mention columns that were not read and a periodic cell.

    Raises
    ------
    ValueError
        With file and line: for an invalid or wrong count, ambiguous labels such as `C13` (number or isotope), asterisks of an
        overflowed field, a truncated file, a second structure.

    Examples
    --------
    >>> parse_xyz("2\nfrom a textbook\nH 0 0 0\nCl 0 0 1.2746D0\n").formula
    'ClH'
    """
    lines = _LINE_END.split(text.removeprefix("\ufeff"))
    start = next((i for i, line in enumerate(lines) if line.strip()), None)
    if start is None:
        raise ValueError(f"{where}: the file is empty; an xyz file begins with the number of atoms")

    count = _count(lines[start], f"{where}, line {start + 1}")
    comment = lines[start + 1].strip() if start + 1 < len(lines) else ""
    info, columns = _extended(comment, f"{where}, line {start + 2}")
    rows = [(i + 1, line.split()) for i, line in enumerate(lines) if i > start + 1 and line.strip()]
    _refuse_wrong_count(rows, count, len(lines), where)
    if lines[-1]:
        _refuse_cut_number(rows, columns, where)
    return _molecule(rows, columns, comment, info, where)


def _count(line: str, where: str) -> int:
    if not line.strip().isdecimal() or int(line) < 1:
        raise ValueError(f"{where}: {line.strip()!r:.60} is not a number of atoms; an xyz file begins with it")
    return int(line)


def _refuse_wrong_count(rows: list[tuple[int, list[str]]], count: int, n_lines: int, where: str) -> None:
    if len(rows) < count:
        raise ValueError(
            f"{where}, line {n_lines}: the file ends after {len(rows)} of {count} atoms; it was cut, or line 1 is wrong"
        )
    if len(rows) > count:
        number, words = rows[count]
        if len(words) == 1 and words[0].isdecimal():
            raise ValueError(
                f"{where}, line {number}: a second structure begins here; keep one structure in the file, or in Python give each "
                "ase.Atoms of ase.io.iread(file)"
            )
        raise ValueError(
            f"{where}, line {number}: {' '.join(words)!r:.60} comes after the {count} atoms that the file announces; "
            "correct the count or remove the line"
        )


def _refuse_cut_number(rows: list[tuple[int, list[str]]], columns: _Columns, where: str) -> None:
    """Refuse a file that was cut inside its last number: no final line end, and fewer decimals than all other numbers."""
    last = rows[-1][1]
    if len(last) != columns.position + 3:
        return
    words = [word for _, row in rows for word in row[columns.position : columns.position + 3]]
    decimals = [len(word.partition(".")[2]) for word in words]
    if len(decimals) > 1 and len(set(decimals[:-1])) == 1 and decimals[-1] < decimals[0]:
        raise ValueError(
            f"{where}, line {rows[-1][0]}: the file ends in {words[-1]!r} without a line end, with fewer decimals than "
            "every other number: it looks cut; write the number in full, or end the line"
        )


def _extended(comment: str, where: str) -> tuple[dict[str, Any], _Columns]:
    """Key-value pairs and columns of an extended xyz comment; for other comments charge and multiplicity and the plain columns."""
    if not re.search(r"\b(Properties|Lattice)=", comment):
        return {name: int(number) for name, number in _STATED.findall(comment)}, _Columns()
    from ase.io import extxyz

    read_pairs: Callable[[str], dict[str, Any]] = extxyz.key_val_str_to_dict
    try:
        info = read_pairs(comment)
    except (IndexError, ValueError) as reason:
        raise ValueError(
            f"{where}: {comment!r:.80} is not a list of key=value; correct its quotes and brackets"
        ) from reason
    if "Properties" not in info:
        return info, _Columns()
    words = str(info["Properties"]).split(":")
    if len(words) % 3 or not all(word.isdecimal() for word in words[2::3]):
        raise ValueError(f"{where}: Properties={':'.join(words)} is not a list of name:type:columns")
    widths = [int(word) for word in words[2::3]]
    first = dict(zip(words[0::3], np.cumsum([0, *widths[:-1]]).tolist(), strict=True))
    if "species" not in first or "pos" not in first:
        raise ValueError(f"{where}: Properties={':'.join(words)} has no columns species and pos")
    return info, _Columns(first["species"], first["pos"], first.get("masses"), sum(widths))


def _molecule(
    rows: list[tuple[int, list[str]]], columns: _Columns, comment: str, info: dict[str, Any], where: str
) -> Molecule:
    nuclei, positions = [], []
    for number, words in rows:
        here = f"{where}, line {number}"
        if len(words) < columns.count:
            raise ValueError(f"{here}: {' '.join(words)!r:.60} has {len(words)} of {columns.count} columns; is it cut?")
        nuclei.append(_nucleus(words, columns, here))
        positions.append([_number(word, here) for word in words[columns.position : columns.position + 3]])
    dipole = info.get("dipole")
    try:
        return Molecule(
            symbols=tuple(nucleus.symbol for nucleus in nuclei),
            mass_numbers=tuple(nucleus.mass_number for nucleus in nuclei),
            positions_angstrom=np.array(positions),
            charge=info.get("charge", 0),
            multiplicity=info.get("multiplicity"),
            dipole_debye=None if dipole is None else np.asarray(dipole, dtype=float) * DEBYE_PER_E_ANGSTROM,
            dipole_source="" if dipole is None else f"{where} (e Å, as ASE writes it)",
            source=f"{where}, which says {comment!r}" if comment and "Properties" not in info else where,
            notes=_notes(rows, columns, info),
        )
    except ValueError as reason:
        raise ValueError(f"{where}: {reason}") from None


def _notes(rows: list[tuple[int, list[str]]], columns: _Columns, info: dict[str, Any]) -> tuple[str, ...]:
    notes = []
    if any(len(words) > columns.count for _, words in rows):
        notes.append("columns after x y z were not read")
    if "Lattice" in info:
        notes.append("the periodic cell was not used: a molecule that crosses its edge is torn; make it whole first")
    return tuple(notes)


def _nucleus(words: list[str], columns: _Columns, where: str) -> Isotope:
    """The isotope of a label, or of the mass column if present."""
    label = words[columns.label]
    if _NUMBERED.fullmatch(label):
        raise ValueError(
            f"{where}: {label!r} may be an atom with a running number or an isotope; write the bare symbol, or the "
            "mass number first, as in '13C'"
        )
    try:
        nucleus = isotope(element_symbol(int(label)) if label.isdecimal() else label)
        return nucleus if columns.mass is None else isotope_by_mass(nucleus.symbol, _number(words[columns.mass], where))
    except ValueError as reason:
        raise ValueError(f"{where}: {reason}") from None


def _number(word: str, where: str) -> float:
    plain = word.translate(_MINUS_SIGNS)
    if _NUMBER.fullmatch(plain):
        return float(plain.replace("D", "e").replace("d", "e"))
    if "*" in word:
        hint = "a number too wide for its field was printed as asterisks; print it wider"
    elif "," in word:
        hint = "write a decimal point and separate columns by blanks"
    else:
        hint = "expected a finite number in Å such as -0.7572"
    raise ValueError(f"{where}: {word!r:.40} is not a number; {hint}")
