"""Reader for outputs that cclib 1.8 cannot read: CFOUR (no parser) and ORCA from version 6 (its dipole fails).

The same numbers are read as by cclib from other programs, under its names. The formats were taken from the real outputs listed in
`tests/oracles/outputs/README.md`. CFOUR's polarizability is not read, because no real output with one was available; a note says so.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

from rotor.arrays import Floats
from rotor.molecules.nuclei import isotope
from rotor.molecules.readers.programs import Output, coordinates_angstrom, tables
from rotor.units import BOHR_RADIUS_ANGSTROM, DEBYE_PER_E_ANGSTROM

DEBYE_PER_AU = DEBYE_PER_E_ANGSTROM * BOHR_RADIUS_ANGSTROM


@dataclass
class Read:
    """Data of an output, with cclib's names and units: Å, D, atomic units of polarizability, u."""

    atomnos: list[int]
    atomcoords: list[Floats]
    charge: int
    moments: list[Floats] = field(default_factory=list)  # a point of reference, which is not used, and the dipole
    polarizabilities: list[Floats] = field(default_factory=list)
    atommasses: Floats = field(default_factory=lambda: np.zeros(0))


def reads_itself(output: Output) -> bool:
    """Whether this module reads an output instead of cclib."""
    return output.program.name == "CFOUR" or (output.program.name == "ORCA" and _version(output) >= 6)


def read_plain(output: Output) -> Read:
    """The last geometry, charge, dipole, polarizability and masses of an output.

    Raises ValueError, with the line, for a malformed table, and for an output without geometry.
    """
    geometries = tables(output)
    if not geometries:
        raise ValueError(f"{output.where}: no geometry in it; give an output with one")
    start, rows = geometries[-1]
    try:
        numbers = [isotope(row[0].rstrip("0123456789").capitalize()).element_number for row in rows]
        coordinates = coordinates_angstrom(output, start, rows)
    except (ValueError, IndexError) as reason:
        raise output.refuse(start, f"no table of coordinates below this line ({reason})") from None
    read = Read(numbers, [coordinates], _charge(output), atommasses=_masses(output, len(rows)))
    dipole, polarizability = _dipole(output), _polarizability(output)
    read.moments = [] if dipole is None else [np.zeros(3), dipole * DEBYE_PER_AU]
    read.polarizabilities = [] if polarizability is None else [polarizability]
    return read


def unread(output: Output) -> tuple[str, ...]:
    """Notes on data in such an output that are not read."""
    if output.program.name == "CFOUR" and any("polarizabilit" in line.lower() for line in output.lines):
        return (f"{output.where}: CFOUR's polarizability was not read: rotor does not know its printed form",)
    return ()


def _version(output: Output) -> int:
    version = next(
        (re.search(r"Program Version (\d+)", line) for line in output.lines if "Program Version" in line), None
    )
    return int(version[1]) if version else 0


def _charge(output: Output) -> int:
    """The charge: `Total Charge  Charge  ....  0` of ORCA, `CHARGE  ICHRGE  0  ***` of CFOUR; default 0."""
    pattern = r"\s*(?:Total Charge\s+Charge\s+\.{4}|CHARGE\s+ICHRGE)\s+(-?\d+)"
    charges = [match for line in output.lines if (match := re.match(pattern, line))]
    return int(charges[-1][1]) if charges else 0


def _dipole(output: Output) -> Floats | None:
    """The last total dipole, a.u.; for a correlated method the correlated one."""
    if output.program.name == "CFOUR":
        start = output.last(output.program.dipole)
        if start is None:
            return None
        return _three(output, start + 1, r"X =\s*(\S+)\s+Y =\s*(\S+)\s+Z =\s*(\S+)")
    start = output.last(("Total Dipole Moment",))
    return None if start is None else _three(output, start, r":\s*(\S+)\s+(\S+)\s+(\S+)\s*$")


def _three(output: Output, i: int, pattern: str) -> Floats:
    numbers = re.search(pattern, output.lines[i])  # `refuse_cut` made sure that more lines follow a heading
    try:
        return np.array([float(word) for word in (numbers.groups() if numbers else [""])])
    except ValueError:
        raise output.refuse(i, "expected three numbers of a dipole here") from None


def _polarizability(output: Output) -> Floats | None:
    """The raw Cartesian tensor below the last heading of a static polarizability, a.u."""
    openings = output.program.polarizability
    start = output.last(openings) if openings else None
    if start is None:
        return None
    raw = next((i for i in range(start, len(output.lines)) if "The raw cartesian tensor" in output.lines[i]), None)
    rows = [] if raw is None else [line.split() for line in output.lines[raw + 1 : raw + 4]]
    try:
        return np.array(rows, dtype=np.float64).reshape(3, 3)
    except ValueError:
        raise output.refuse(start, "no 3 x 3 numbers of a polarizability below this line") from None


def _masses(output: Output, n: int) -> Floats:
    """ORCA's masses, u, from its table in atomic units; none for CFOUR, which uses the most abundant isotopes."""
    start = output.last(("CARTESIAN COORDINATES (A.U.)",))
    if output.program.name != "ORCA" or start is None:
        return np.zeros(0)
    rows = [line.split() for line in output.lines[start + 3 : start + 3 + n]]
    return np.array([float(row[4]) for row in rows if len(row) == 8])
