"""Formats of the outputs of quantum-chemistry programs, and checks before a number is read.

Each program is a row of `PROGRAMS`: banner, last words, headings of tables and tensors. The parts of an output that are used are
checked first for asterisks, unexpected `D` exponents and a truncated end.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotor.units import BOHR_RADIUS_ANGSTROM, MHZ_PER_CM


@dataclass(frozen=True)
class Program:
    """Format of a program's output: banner, last line, and headings of tables and tensors."""

    name: str
    banner: str
    ending: str
    geometries: tuple[str, ...]  # headings of coordinate tables; if several precede a tensor, the first counts
    rows_after: int  # lines between the opening one and the first atom
    columns: slice  # of the coordinates in a row
    dipole: tuple[str, ...]
    polarizability: tuple[str, ...]
    tensor_lines: int  # lines after the opening one that may hold the tensor's numbers
    constants: str  # pattern of a line of rotational constants; where nothing follows they stand in the next line
    constants_mhz: float  # unit of these


# The orientation of Gaussian's population analysis is the standard one where printed, else that of the input.
PROGRAMS = (
    Program(
        "Gaussian", "Gaussian, Inc.", "Normal termination of Gaussian",
        ("Standard orientation:", "Input orientation:", "Z-Matrix orientation:"), 5, slice(-3, None),
        ("Dipole moment (field-independent basis",),
        ("SCF Polarizability for W=", "Polarizability=", "Exact polarizability:"), 1,
        r"Rotational constants \(GHZ\):(.*)", 1e3,
    ),
    Program(
        "ORCA", "O   R   C   A", "ORCA TERMINATED NORMALLY",
        ("CARTESIAN COORDINATES (ANGSTROEM)",), 2, slice(1, 4),
        ("DIPOLE MOMENT",), ("THE POLARIZABILITY TENSOR", "STATIC POLARIZABILITY TENSOR (Dipole/Dipole)"), 14,
        r"Rotational constants in cm-1:(.*)", MHZ_PER_CM,
    ),
    Program(
        "Psi4", "Psi4: An Open-Source Ab Initio", "Psi4 exiting successfully",
        ("Geometry (in ",), 4, slice(1, 4),
        ("Dipole Moment: (a.u.)", "Multipole Moments:"), (), 10,
        r"Rotational constants: (A =.*)\[cm\^-1\]", MHZ_PER_CM,
    ),
    Program(
        "CFOUR", "CFOUR Coupled-Cluster techniques", "This computation required",
        ("Z-matrix   Atomic            Coordinates (in bohr)",), 3, slice(2, 5),
        ("Components of electric dipole moment",), (), 1,
        r"Rotational constants \(in MHz\):(.*)", 1.0,
    ),
)  # fmt: skip


@dataclass(frozen=True)
class Output:
    """The lines of an output, its program, and its origin."""

    where: str
    lines: tuple[str, ...]
    program: Program

    def last(self, openings: tuple[str, ...]) -> int | None:
        """Index of the last line that begins with one of the openings."""
        rows = [i for i, line in enumerate(self.lines) if line.strip().startswith(openings)]
        return rows[-1] if rows else None

    def refuse(self, i: int, rule: str) -> ValueError:
        return ValueError(f"{self.where}: line {i + 1}: {rule}: {self.lines[i].strip()[:80]!r}")


def detect_program(text: str) -> Program | None:
    """The supported program that an output names first; None for others.

    >>> detect_program("Copyright (c) 1988-2016, Gaussian, Inc.  All Rights Reserved.").name
    'Gaussian'
    """
    named = [program for program in PROGRAMS if program.banner in text]
    return min(named, key=lambda program: text.find(program.banner)) if named else None


def refuse_cut(output: Output) -> None:
    """Refuse an output without the program's last words after its last table and job: it is truncated or the run failed."""
    endings = [i for i, line in enumerate(output.lines) if output.program.ending in line]
    job_starts = (*output.program.geometries, "Link1:  Proceeding")  # the second words open Gaussian's next job
    starts = [
        i for i, line in enumerate(output.lines) if output.program.banner in line or line.strip().startswith(job_starts)
    ]
    if not endings or starts[-1] > endings[-1]:
        last = max((i for i, line in enumerate(output.lines) if line.strip()), default=0)
        rule = f"the file ends without {output.program.ending!r}, because it was cut or the run failed; give a complete file"
        raise output.refuse(last, rule)


def refuse_unreadable(output: Output) -> None:
    """Refuse asterisks and unexpected `D` exponents in the numbers that are used."""
    for i, may_have_d in _used_lines(output):
        line = output.lines[i]
        if "**" in line:
            raise output.refuse(i, "asterisks stand where a number did not fit; print it with more digits")
        if not may_have_d and re.search(r"\d[dD][+-]?\d", line):
            raise output.refuse(i, f"a D exponent where {output.program.name} prints none; write E, or run it again")


def _used_lines(output: Output) -> Iterator[tuple[int, bool]]:
    """Indices of the lines with coordinates, dipole, polarizability, and whether D exponents are expected there."""
    program = output.program
    for start, rows in tables(output):
        yield from ((start + program.rows_after + k, False) for k in range(len(rows)))
    d_in_tensor = program.name == "Gaussian"  # as in `Polarizability= 9.1D+00`
    for openings, d_belongs in ((program.dipole, False), (program.polarizability, d_in_tensor)):
        first = output.last(openings) if openings else None
        if first is not None:
            more = 3 if "SCF Polarizability" in output.lines[first] else 0  # a head and three rows, not two
            stop = min(first + program.tensor_lines + 1 + more, len(output.lines))
            yield from ((i, d_belongs) for i in range(first, stop) if not _is_ornament(output.lines[i]))


def _is_ornament(line: str) -> bool:
    """Whether asterisks surround words, as in `****ORCA TERMINATED NORMALLY****`, instead of replacing a number."""
    return bool(re.search(r"\*\*\s*[A-Za-z]{3}", line))


def tables(output: Output) -> list[tuple[int, list[list[str]]]]:
    """Index of the opening line of each table of coordinates, and its rows as words, dummies of CFOUR left out."""
    program = output.program
    starts = [i for i, line in enumerate(output.lines) if line.strip().startswith(program.geometries)]
    return [(i, list(_rows(output.lines[i + program.rows_after :]))) for i in starts]


def coordinates_angstrom(output: Output, start: int, rows: list[list[str]]) -> NDArray[np.float64]:
    """The coordinates (n, 3) of a table, Å; converted if the heading says bohr."""
    scale = BOHR_RADIUS_ANGSTROM if "bohr" in output.lines[start].lower() else 1.0
    return scale * np.array([[float(word) for word in row[output.program.columns]] for row in rows])


def _rows(lines: tuple[str, ...]) -> Iterator[list[str]]:
    for line in lines:
        if not line.strip() or line.strip().startswith("---"):
            return
        row = line.split()
        if row[:1] != ["X"]:
            yield row


def without_constants(output: Output) -> str:
    """The text without rotational constants: cclib fails at the asterisks of a linear molecule."""
    pattern = re.compile(output.program.constants)
    return "\n".join(line for line in output.lines if not pattern.search(line)) + "\n"
