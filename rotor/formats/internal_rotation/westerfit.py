"""Input of westerfit (.inp) and its line lists (.lne): one threefold top, with one nuclear spin, in the rho-axis frame.

westerfit has z, x, y = a, b, c, and three heads (README of wes648/Westerfit.jl; J. Mol. Spectrosc. 2024, 10.1016/j.jms.2024.111928):

    %CNTRLS     name = value: NFOLD, S (the spin), vtmax ...
    %2NDORDER   name; value; scale: A, B, C, Dab, χzz, χxz, χxmy = χxx - χyy, ϵ.. in MHz, F and Vn in cm⁻¹, ρ
    %PARAMS     name; value; scale; powers; stage: MHz, the operator being N^a Nz^c ½(N₊^e + N₋^e) p^g cos hα as half anticommutators

    H = A Nz² + B Nx² + C Ny² + D_ab {Nz, Nx} + F (p - ρNz)² + ½Vn (1 - cos 3α) + ...

The ½ of the ladder is missing from the head of its own list; it and A beside F (p - ρNz)² follow from 2-butynoic acid and m-chlorotoluene,
whose printed frequencies come out here. Stage 0 is a dipole, 1 a term, and -k multiplies the value by that of the k-th term before. Lines
are J N Ka Kc m of both states (J = N + S), frequency and error in MHz; m mod 3 is the species. Ka and Kc count by energy.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.checks import first_names
from rotor.tops.constants.constants import Constants
from rotor.tops.internal_rotation import InternalRotationConstants, is_torsional
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.top import Top
from rotor.units import MHZ_PER_CM

SPIN = "I1"  # the file does not name its nucleus
SECOND_ORDER = {
    "A": "A",
    "B": "B",
    "C": "C",
    "Dab": "Dab",
    "Dxz": "Dab",
    "F": "F",
    "ρ": "rho",
    "ρz": "rho",
    "Vn": "V3",
    "V3": "V3",
}
QUADRUPOLE = {"χzz": "chi_aa", "χxz": "chi_ab", "χxmy": "chi_bb-cc", "χxx-χyy": "chi_bb-cc"}
SPIN_ROTATION = {"ϵzz": "C_aa", "ϵxx": "C_bb", "ϵyy": "C_cc"}
WITHOUT_COUNTERPART = ("ϵzx", "ϵxz", "ρx", "η", "ηz", "ηx")
IN_CM = ("F", "V3")
DISTORTION = {
    (4, 0, 0): ("DeltaJ", -1.0), (2, 2, 0): ("DeltaJK", -1.0), (0, 4, 0): ("DeltaK", -1.0), (2, 0, 2): ("deltaJ", -0.5),
    (0, 2, 2): ("deltaK", -0.5), (6, 0, 0): ("PhiJ", 1.0), (4, 2, 0): ("PhiJK", 1.0), (2, 4, 0): ("PhiKJ", 1.0), (0, 6, 0): ("PhiK", 1.0),
    (4, 0, 2): ("phiJ", 0.5), (2, 2, 2): ("phiJK", 0.5), (0, 4, 2): ("phiK", 0.5), (2, 1, 1): ("DabJ", 1.0), (0, 3, 1): ("DabK", 1.0),
}  # fmt: skip
POWERS = {
    8: ("N", "Nz", "ladder", "NS", "Sz", "p", "cos", "sin"),
    9: ("N", "S", "Nz", "Sz", "ladder", "S ladder", "p", "cos", "sin"),
}  # by their number in a line, of the version of 2023 and of later ones


@dataclass(frozen=True)
class _Term:
    """A line of %PARAMS."""

    name: str
    value: float
    powers: Mapping[str, int]
    stage: int


def is_westerfit_file(path: str | os.PathLike[str]) -> bool:
    """Whether a file has westerfit's heads."""
    text = Path(path).read_text(encoding="utf-8", errors="replace")
    return "%CNTRLS" in text and "%2NDORDER" in text


def read_westerfit(path: str | os.PathLike[str]) -> Top:
    """The top of an input file of westerfit.

    path: a .inp file.
    Returns: top with constants of internal rotation in the frame RAM, labels as in westerfit, and for S > 0 constants of the spin I1.
    Raises ValueError with the file, for invalid lines, tops that are not threefold, and unsupported terms.
    """
    try:
        return _top(Path(path).stem, _sections(Path(path).read_text(encoding="utf-8")))
    except ValueError as reason:
        raise ValueError(f"{os.fspath(path)}: {reason}") from None


def _sections(text: str) -> dict[str, list[tuple[int, str]]]:
    """Numbered lines by section, without comments; a section ends with a blank line or the next head."""
    sections: dict[str, list[tuple[int, str]]] = {}
    name = ""
    for number, line in enumerate(text.splitlines(), 1):
        content = line.partition("#")[0].strip()
        if match := re.match(r"%(CNTRLS|2NDORDER|PARAMS)", content):
            name = match[1]
            sections[name] = []
        elif not content:
            name = ""
        elif name and not content.startswith("%"):
            sections[name].append((number, content))
    return sections


def _top(name: str, sections: Mapping[str, Sequence[tuple[int, str]]]) -> Top:
    settings = {key.strip(): value.strip() for _, line in sections["CNTRLS"] for key, _, value in [line.partition("=")]}
    if settings.get("NFOLD") != "3":
        raise ValueError(f"NFOLD = {settings.get('NFOLD', '0')}: rotor reads threefold tops only")
    if settings.get("Irrep", "Ir") != "Ir":
        raise ValueError(f"Irrep = {settings['Irrep']}: rotor reads Ir only (z, x, y = a, b, c)")
    values, spins = _second_order(sections["2NDORDER"])
    dipole = [0.0, 0.0, 0.0]
    for key, value in _further(_terms(sections.get("PARAMS", ())), dipole).items():
        values[key] = values.get(key, 0.0) + value
    rotation: dict[str, Any] = {key: values.pop(key) for key in list(values) if not is_torsional(key)}
    internal = InternalRotationConstants(
        values, "RAM", vt_max=int(settings.get("vtmax", "0")), names="energy", source="file of westerfit"
    )
    twice = round(2 * float(settings.get("S", "0")))
    if spins and not twice:
        raise ValueError(f"{', '.join(spins)} with S = 0: set S to the spin of the nucleus")
    named = {f"{key}({SPIN})": value for key, value in spins.items()}
    return Top.from_constants(
        Constants(reduction="A", representation="Ir", **rotation),
        dipole_abc_debye=dipole if any(dipole) else None,
        spin_constants=SpinConstants(named, {SPIN: twice}, "file of westerfit") if twice and named else None,
        internal_rotation=internal,
        name=name,
    )


def _number(line: int, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"line {line}: {text.strip()!r} is no number") from None


def _second_order(lines: Sequence[tuple[int, str]]) -> tuple[dict[str, float], dict[str, float]]:
    """Constants of the rotation and the rotor, and of the spin, MHz."""
    values: dict[str, float] = {}
    spins: dict[str, float] = {}
    for number, line in lines:
        parts = [part.strip() for part in line.split(";")]
        if len(parts) < 2:
            raise ValueError(f"line {number}: {line!r}: expected name; value; scale")
        name, value = parts[0], _number(number, parts[1])
        if name in SECOND_ORDER:
            ours = SECOND_ORDER[name]
            values[ours] = value * (MHZ_PER_CM if ours in IN_CM else 1.0)
        elif name in QUADRUPOLE or name in SPIN_ROTATION:
            spins |= {(QUADRUPOLE | SPIN_ROTATION)[name]: value} if value else {}
        elif name not in WITHOUT_COUNTERPART:
            raise ValueError(
                f"line {number}: {name}: known are {first_names((*SECOND_ORDER, *QUADRUPOLE, *SPIN_ROTATION))}"
            )
        elif value:
            raise ValueError(
                f"line {number}: {name} = {value:g}: this term is not computed; leave it out and fit again"
            )
    return values, spins


def _terms(lines: Sequence[tuple[int, str]]) -> list[_Term]:
    """The terms, with factors by other terms multiplied into their values."""
    terms: list[_Term] = []
    for number, line in lines:
        parts = [part.strip() for part in line.split(";")]
        names = POWERS.get(len(parts) - 4)
        if names is None:
            raise ValueError(f"line {number}: {line!r}: expected name; value; scale; 8 or 9 powers; stage")
        powers = {name: int(_number(number, part)) for name, part in zip(names, parts[3:-1], strict=True)}
        value, stage = _number(number, parts[1]), int(_number(number, parts[-1]))
        if stage < 0:
            if len(terms) + stage < 0:
                raise ValueError(f"line {number}: {parts[0]}: stage {stage} names no term before")
            value *= terms[stage].value
        terms.append(_Term(parts[0], value, powers, stage))
    return terms


def _further(terms: Sequence[_Term], dipole: list[float]) -> dict[str, float]:
    """Constants of terms by name, MHz; components of the dipole (D) go into `dipole`."""
    values: dict[str, float] = {}
    for term in terms:
        if term.stage == 0:
            if term.name in ("μa", "μb"):
                dipole["ab".index(term.name[1])] = term.value
        elif term.value and (named := _constant(term)):
            values[named[0]] = values.get(named[0], 0.0) + named[1]
    return values


def _constant(term: _Term) -> tuple[str, float] | None:
    """Name and value (MHz) of a term; None for a term that shifts all levels equally."""
    powers = term.powers
    strange = [key for key in ("S", "Sz", "S ladder", "NS", "sin") if powers.get(key)]
    if strange:
        raise ValueError(f"{term.name} with a power of {', '.join(strange)}: such a term is not computed here")
    rotation = powers["N"], powers["Nz"], powers["ladder"]
    if not powers["p"] and not powers["cos"]:
        if rotation == (0, 0, 0):
            return None
        if rotation in DISTORTION:
            name, factor = DISTORTION[rotation]
            return name, factor * term.value
    if not any(rotation) and not powers["p"] and powers["cos"] in (3, 6, 9):
        return f"V{powers['cos']}", -2.0 * term.value
    spelled = "".join(
        f"{letter}{powers[key]}"
        for key, letter in (("N", "J"), ("Nz", "Jz"), ("ladder", "Jpm"), ("p", "p"), ("cos", "cos"))
        if powers[key]
    )
    return spelled, term.value * (0.5 if powers["ladder"] else 1.0)


def read_line_table(path: str | os.PathLike[str]) -> tuple[Ints, Ints, Floats, Floats]:
    """Labels of the upper and the lower states, frequencies and errors of a .lne file.

    path: a .lne file: J N Ka Kc m of both states, frequency, error.
    Returns: 2F, N, Ka, Kc, species (0 A, 1 E) and v_t of both states; MHz.
    Raises ValueError with file and line, for another number of columns, and for excited A states, whose order of m is not documented.
    """
    rows = []
    for number, line in enumerate(Path(path).read_text(encoding="utf-8").splitlines(), 1):
        parts = [part for part in re.split(r"[,;\s]+", line.partition("#")[0].strip()) if part]
        if not parts:
            continue
        if len(parts) != 12:
            raise ValueError(
                f"{path}, line {number}: {len(parts)} columns: expected J N Ka Kc m of both states, frequency, error"
            )
        rows.append([_number(number, part) for part in parts])
        for m in (rows[-1][4], rows[-1][9]):
            if m % 3 == 0 and m:
                raise ValueError(f"{path}, line {number}: m = {m:g}: A states are read with m = 0, their ground state")
    table = np.array(rows).reshape(len(rows), 12)
    sides = []
    for first in (0, 5):
        j, n, ka, kc, m = np.rint(table[:, first : first + 5] * [2, 1, 1, 1, 1]).astype(np.int64).T
        sides.append(np.column_stack([j, n, ka, kc, np.where(m % 3, 1, 0), 2 * np.abs(m) // 3]))
    return sides[0], sides[1], table[:, 10], table[:, 11]
