"""The intensity file of SPCAT, .int: what to predict, at which temperature, with which dipole components."""

from __future__ import annotations

import os
from dataclasses import field

from rotor.formats.packed import source_name
from rotor.formats.spcat.text import freeform
from rotor.formats.spcat.text.freeform import Line
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


_REQUEST = freeform.default_values(Request)
_NAMES = {"fqlim_ghz": "FQLIM", "temperature_k": "TEMP"}
_LEAST_MHZ = 0.00005


def read_int(source: str | os.PathLike[str] | bytes) -> IntensityFile:
    """The request in an .int file, or in the bytes of one.

    Raises ValueError with file, line, column and the rule that is broken.
    """
    lines = freeform.read_lines(source)
    if len(lines) < 2:
        name = lines[0].file if lines else source_name(source)
        raise ValueError(
            f"{name}: {counted(len(lines), 'line')}; expected a title, a line FLAGS TAG QROT FBGN FEND ... and dipoles"
        )
    end = next((i for i, line in enumerate(lines) if i >= 2 and line.blank), len(lines))
    dipoles = tuple(_dipole(line) for line in lines[2:end])
    rest = "".join(line.text for line in lines[end:])
    return IntensityFile(freeform.read_title(lines[0]), _request(lines[1]), dipoles, rest, lines[0].text)


def _request(line: Line) -> Request:
    names = " ".join(_NAMES.get(key, key.upper()) for key in _REQUEST)
    with freeform.expecting(f"line 2, behind a title, is {names}"):
        words, _ = freeform.read_words(line, 0, len(_REQUEST))
        values = freeform.numbers(line, words, _REQUEST, _NAMES)
    for key in ("str0", "str1"):
        if values[key] > MOST_LOG10:
            raise line.error(
                0, f"{key.upper()} is {values[key]:g}: expected log10 of an intensity, at most {MOST_LOG10}"
            )
    return Request(**values, text=line.text)


def _dipole(line: Line) -> Dipole:
    words, rest = freeform.read_code(line)
    words += freeform.read_words(line, rest, 1)[0]
    code = freeform.whole(line, words, 0, "the dipole's code")
    value = freeform.number(line, words, 1, "the dipole's value", most=freeform.MOST)
    return Dipole(abs(code), value, code < 0, line.text)


def format_int(file: IntensityFile) -> bytes:
    """The text of an .int file; each line as it was read, as long as it says the same."""
    request = freeform.as_read(file.request, _request) or _request_text(file.request)
    dipoles = [
        freeform.as_read(dipole, _dipole) or f"{'-' if dipole.grouped else ''}{dipole.code} {dipole.value!r}\n"
        for dipole in file.dipoles
    ]
    return freeform.encode([freeform.title_text(file.title, file.title_text), request, *dipoles, file.rest])


def _request_text(r: Request) -> str:
    last = f" {r.maxv}" if r.maxv >= 0 else ""
    range_f, cut = f"{r.fbgn} {r.fend}", f"{r.str0!r} {r.str1!r}"
    return f"{r.flags} {r.tag} {r.qrot!r} {range_f} {cut} {r.fqlim_ghz!r} {r.temperature_k!r}{last}\n"
