"""The intensity file of SPCAT, .int: what to predict, at which temperature, with which dipole components."""

from __future__ import annotations

import os
from dataclasses import field
from typing import Any

from rotor.formats.atomic_write import open_atomic
from rotor.formats.packed import source_name
from rotor.formats.spcat.text.freeform import Line, encode, number, read_code, read_lines, read_words, whole
from rotor.frozen import dataclass
from rotor.spectra.intensity import MOST_LOG10
from rotor.table import counted


@dataclass(frozen=True)
class Request:
    """Line 2 of an .int file.

    flags: digits for the output asked for, 1000 and more when constants are in cm⁻¹. tag: the species. qrot: partition
    function at temperature_k. fbgn, fend: range of F, rounded up, not of N. str0, str1: a line is left out when its
    LGINT is below log10(10^str0 + (ν/300 GHz)² 10^str1). fqlim_ghz: highest frequency. maxv: highest state.
    """

    flags: int = 0
    tag: int = 999
    qrot: float = 1000.0
    fbgn: int = 0
    fend: int = 0
    str0: float = -100.0
    str1: float = -100.0
    fqlim_ghz: float = 9999.99
    temperature_k: float = 300.0
    maxv: int = -1
    text: str = field(default="", compare=False)

    @property
    def range_mhz(self) -> tuple[float, float]:
        """Limits of the frequencies of lines; the program does not list those that would print as 0.0000."""
        return _LEAST_MHZ, self.fqlim_ghz * 1e3


@dataclass(frozen=True)
class Dipole:
    """A dipole component: its code (1, 2, 3 for a, b, c of the lowest state) and its value, in D for those."""

    code: int
    value: float
    grouped: bool = False
    text: str = field(default="", compare=False)


@dataclass(frozen=True)
class IntensityFile:
    """An .int file. `rest` is what follows the dipoles after a blank line, as it stands."""

    title: str
    request: Request
    dipoles: tuple[Dipole, ...]
    rest: str = ""
    title_text: str = field(default="", compare=False)


_REQUEST = {
    "flags": 0, "tag": 999, "qrot": 1000.0, "fbgn": 0, "fend": 0,
    "str0": -100.0, "str1": -100.0, "fqlim_ghz": 9999.99, "temperature_k": 300.0, "maxv": -1,
}  # fmt: skip
_LEAST_MHZ = 0.00005
_NAMES = ("FLAGS", "TAG", "QROT", "FBGN", "FEND", "STR0", "STR1", "FQLIM", "TEMP", "MAXV")


def read_int(source: str | os.PathLike[str] | bytes) -> IntensityFile:
    """The request in an .int file, or in the bytes of one.

    Raises ValueError with file, line, column and the rule that is broken.
    """
    lines = read_lines(source)
    if len(lines) < 2:
        name = lines[0].file if lines else source_name(source)
        raise ValueError(
            f"{name}: {counted(len(lines), 'line')}; expected a title, a line FLAGS TAG QROT FBGN FEND ... and dipoles"
        )
    end = next((i for i, line in enumerate(lines) if i >= 2 and line.blank), len(lines))
    dipoles = tuple(_dipole(line) for line in lines[2:end])
    rest = "".join(line.text for line in lines[end:])
    return IntensityFile(_title(lines[0]), _request(lines[1]), dipoles, rest, lines[0].text)


def _title(line: Line) -> str:
    return line.body.removeprefix("\ufeff").strip()


def _request(line: Line) -> Request:
    words, _ = read_words(line, 0, len(_REQUEST))
    values: dict[str, Any] = {}
    for index, (key, default) in enumerate(_REQUEST.items()):
        if isinstance(default, int):
            values[key] = whole(line, words, index, _NAMES[index], default)
        else:
            values[key] = number(line, words, index, _NAMES[index], default)
    for key in ("str0", "str1"):
        if values[key] > MOST_LOG10:
            raise line.error(
                0, f"{key.upper()} is {values[key]:g}: expected log10 of an intensity, at most {MOST_LOG10}"
            )
    return Request(**values, text=line.text)


def _dipole(line: Line) -> Dipole:
    words, rest = read_code(line)
    words += read_words(line, rest, 1)[0]
    code = whole(line, words, 0, "the dipole's code")
    value = number(line, words, 1, "the dipole's value")
    return Dipole(abs(code), value, code < 0, line.text)


def format_int(file: IntensityFile) -> bytes:
    """The text of an .int file; each line as it was read, as long as it says the same."""
    if "\n" in file.title or "\r" in file.title:
        raise ValueError(f"{file.title!r}: a title is one line")
    stored = file.title_text and _title(Line(file.title_text, 1, "")) == file.title
    pieces = [file.title_text if stored else file.title + "\n"]
    request = file.request
    same = request.text and _request(Line(request.text, 2, "stored text")) == request
    pieces.append(request.text if same else _request_text(request))
    for dipole in file.dipoles:
        same = dipole.text and _dipole(Line(dipole.text, 3, "stored text")) == dipole
        pieces.append(dipole.text if same else f"{'-' if dipole.grouped else ''}{dipole.code} {dipole.value!r}\n")
    return encode([*pieces, file.rest])


def _request_text(r: Request) -> str:
    last = f" {r.maxv}" if r.maxv >= 0 else ""
    range_f, cut = f"{r.fbgn} {r.fend}", f"{r.str0!r} {r.str1!r}"
    return f"{r.flags} {r.tag} {r.qrot!r} {range_f} {cut} {r.fqlim_ghz!r} {r.temperature_k!r}{last}\n"


def write_int(file: IntensityFile, path: str | os.PathLike[str]) -> None:
    """Write an .int file; an existing one is replaced at the end or not at all."""
    with open_atomic(path) as handle:
        handle.write(format_int(file))
