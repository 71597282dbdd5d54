"""Spectra as columns of text: two or three numbers in each line, separated by blanks or commas, after any heading.

The columns are frequency (or velocity), intensity and, where the heading names it, noise. Units stand in the heading:
`#xLabel: frequency [MHz]` and `#yLabel: (Jy/beam) Mean` as CASA and CASSIS write them, or a line of names such as
`frequency_mhz,intensity_k`, `freq (GHz)  T (K)` or `f/GHz, T/K`. Without a heading the choices of the user count, MHz and K by default,
with a note.
"""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rotor.formats.packed import load
from rotor.formats.spectra.axis import AXIS_UNITS, INTENSITIES, ReadChoices, axis_mhz, intensity_unit, is_unit
from rotor.observed.spectrum import ObservedSpectrum, observed_spectrum

LOW_MHZ = 1000.0  # of spectra below it the unit may be wrong: numbers of bands in GHz are between 1 and 1000
COMMENTS = ("#", "!", "//", ";", "%")
_SEPARATOR = re.compile(r"[,;\s]+")
_NAME_AND_BRACKET = re.compile(r"[^\[\]()]+[\[(][^\])]+[\])]")
_AFTER_SLASH = re.compile(r"[^/]+/\s*([^/\s]+)")
_IN_BRACKETS = re.compile(r"[\[(]\s*([^\])]+?)\s*[\])]")
_LABEL = re.compile(r"\s*([xy])\s*label\s*:\s*(.*)", re.IGNORECASE)
_SUFFIX = re.compile(r"_(hz|khz|mhz|ghz|k|mk|km_s|jy_beam)$", re.IGNORECASE)
_UNIT_OF_SUFFIX = {"km_s": "km/s", "jy_beam": "Jy/beam"}
_NOISE = re.compile(r"noise|error|sigma|uncertainty|rms", re.IGNORECASE)


def read_text_spectrum(path: Path, choices: ReadChoices | None = None) -> ObservedSpectrum:
    """The spectrum in a text file.

    path: packed with gzip or not. choices: settings that the file does not state.
    Raises ValueError with file, line and rule: a line without two or three numbers, or an unknown unit.
    """
    choices = choices or ReadChoices()
    text, name = load(path)
    heading, numbers = _parsed(text.decode("utf-8", "replace"), name)
    names, labels = _names_and_labels(heading)
    axis_unit, unit = choices.axis_unit or labels.get("x"), choices.unit or labels.get("y")
    assumed = [
        text for stated, text in ((axis_unit, "frequencies in MHz"), (unit, "intensities in K")) if stated is None
    ]
    chosen, factor = intensity_unit(unit or "K", name)
    notes = (f"no units in the file: {' and '.join(assumed)} assumed",) if assumed else ()
    frequency = axis_mhz(numbers[:, 0], axis_unit or "MHz", name, choices)
    if (axis_unit or "MHz").lower() == "mhz" and frequency.max() < LOW_MHZ:
        low = f"frequencies of {frequency.min():g} to {frequency.max():g} MHz are lower than those of most spectra"
        notes = (*notes, f"{low}; if the numbers are GHz, --axis-unit GHz says so")
    if axis_unit is None and (numbers[:, 0] <= 0).any():
        raise ValueError(
            f"{name}: the first column, read as frequencies in MHz, contains {numbers[:, 0].min():g}; for velocities give "
            "--axis-unit km/s and --rest"
        )
    third = numbers.shape[1] > 2 and len(names) > 2 and _NOISE.search(names[2])
    noise = numbers[:, 2] * factor if third else None
    if choices.noise is not None:
        noise = np.full(len(numbers), choices.noise * factor)
    return observed_spectrum(
        frequency,
        numbers[:, 1] * factor,
        noise=noise,
        source=name,
        unit=chosen,
        rest_mhz=choices.rest_mhz,
        frame=choices.frame or "SOURCE",
        beam_arcsec=choices.beam_arcsec,
        notes=notes,
    )


def _parsed(text: str, name: str) -> tuple[list[str], NDArray[np.float64]]:
    """Lines of the heading, and the numbers (n, 2 or more)."""
    return _plain_columns(text) or _parsed_by_line(text, name)


def _plain_columns(text: str) -> tuple[list[str], NDArray[np.float64]] | None:
    """Heading and numbers of a file with nothing but equal columns of numbers after its heading; None for other files.

    numpy's reader in C needs 0.1 s for a million channels; line by line it takes 2 s."""
    heading, start = list[str](), 0
    while start < len(text):
        end = text.find("\n", start)
        body = text[start : end if end >= 0 else len(text)].strip().lstrip("\ufeff")
        mark = next((mark for mark in COMMENTS if body.startswith(mark)), None)
        if body and mark is None and _numbers(body) is not None:
            break
        heading += [body[len(mark or "") :].strip()] if body else []
        start = end + 1 if end >= 0 else len(text)
    if start >= len(text):  # nothing but a heading: numpy warns of it
        return None
    try:
        delimiter = "," if "," in text[start : text.find("\n", start)] else None
        rows = np.loadtxt(io.StringIO(text[start:]), delimiter=delimiter, comments=None, ndmin=2)
    except ValueError:  # ragged or marked lines: those are read, or refused, line by line
        return None
    return (heading, rows) if len(rows) >= 2 and rows.shape[1] >= 2 else None


def _parsed_by_line(text: str, name: str) -> tuple[list[str], NDArray[np.float64]]:
    heading: list[str] = []
    rows: list[list[float]] = []
    for number, line in enumerate(text.lstrip("\ufeff").splitlines(), start=1):
        body = line.strip()
        if not body:
            continue
        mark = next((mark for mark in COMMENTS if body.startswith(mark)), None)
        if mark:
            heading.append(body[len(mark) :].strip())
            continue
        values = _numbers(body)
        if values is None and not rows:
            heading.append(body)
            continue
        if values is None or len(values) < 2 or (rows and len(values) != len(rows[0])):
            raise ValueError(
                f"{name}, line {number}: {body[:60]!r}: expected {len(rows[0]) if rows else 'two or three'} numbers"
            )
        rows.append(values)
    if len(rows) < 2:
        raise ValueError(
            f"{name}: {len(rows)} lines with numbers; expected a spectrum: frequency and intensity in each line"
        )
    return heading, np.array(rows)


def _numbers(body: str) -> list[float] | None:
    try:
        return [float(item.replace("D", "E").replace("d", "e")) if item else float("nan") for item in _items(body)]
    except ValueError:
        return None


def _items(body: str) -> list[str]:
    """Fields between commas, which may be empty, or between blanks. Between semicolons a comma is a decimal point."""
    if ";" in body:
        return [item.strip() for item in body.replace(",", ".").split(";")]
    return [item.strip() for item in body.split(",")] if "," in body else _SEPARATOR.split(body)


def _names_and_labels(heading: list[str]) -> tuple[list[str], dict[str, str]]:
    """Names of the columns from the last line of the heading that names two or more, and units of x and y."""
    labels: dict[str, str] = {}
    names: list[str] = []
    for line in heading:
        if match := _LABEL.match(line):
            if bracket := _IN_BRACKETS.findall(match.group(2)):
                labels[match.group(1).lower()] = bracket[-1] if match.group(1).lower() == "x" else bracket[0]
        elif ("," in line or ";" in line) and ":" not in line:
            listed = [item.strip() for item in re.split("[,;]", line)]
            stated = [unit for unit in map(_unit_in, listed[:2]) if unit]
            names = listed if not stated or any(map(is_unit, stated)) else names  # else a remark with brackets
        elif len(named := _NAME_AND_BRACKET.findall(line)) > 1 and str(_unit_in(named[0])).lower() in AXIS_UNITS:
            names = named
        elif line.strip() and _unit_in(line.split()[0]):
            names = line.split()
    for axis, name in zip("xy", names[:2], strict=False):
        if unit := _unit_in(name):
            labels.setdefault(axis, unit)
    return names, labels


def _unit_in(name: str) -> str | None:
    """`freq (GHz)`, `frequency_mhz` and `f / GHz` state a unit."""
    if bracket := _IN_BRACKETS.search(name):
        return bracket.group(1)
    if suffix := _SUFFIX.search(name):
        return _UNIT_OF_SUFFIX.get(suffix.group(1).lower(), suffix.group(1))
    slash = _AFTER_SLASH.fullmatch(name.strip())
    if slash and slash.group(1).lower() in (AXIS_UNITS | INTENSITIES):
        return slash.group(1)
    return None
