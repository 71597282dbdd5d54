"""Selection of the dipole of the electronic ground state: programs print dipoles of excited densities in the same form.

Gaussian names the density in the heading of its population analysis ("using the SCF density"; "CI" for CIS and TD-DFT with a list of
excited states). ORCA 6 names the method below the heading of the dipole, older versions in the lines before it.
"""

from __future__ import annotations

import re

import numpy as np

from rotor.arrays import Floats
from rotor.molecules.readers.programs import Output
from rotor.units import BOHR_RADIUS_ANGSTROM, DEBYE_PER_E_ANGSTROM

_DENSITY = re.compile(r"Population analysis using the (.+?) density", re.IGNORECASE)
_EXCITED_METHOD = re.compile(r"\b(CIS|TDA|TD-?DFT|EOM|STEOM|ROCIS|relaxed density)", re.IGNORECASE)
_DEBYE_PER_AU = DEBYE_PER_E_ANGSTROM * BOHR_RADIUS_ANGSTROM
_LINES_OF_HEAD = 12  # between the head of ORCA's dipole and its total
_LINES_BEFORE = 25  # in which an older ORCA names the method of the density


def dipole_lines(output: Output) -> list[int]:
    """Indices of the first lines of printed dipoles."""
    return [i for i, line in enumerate(output.lines) if line.strip().startswith(output.program.dipole)]


def is_excited(output: Output, start: int) -> bool:
    """Whether the dipole printed from line `start` is that of an excited density."""
    if output.program.name == "Gaussian":
        heads = [match[1] for line in output.lines[:start] if (match := _DENSITY.search(line))]
        density = heads[-1].upper() if heads else "SCF"
        lists_states = any(line.lstrip().startswith("Excited State ") for line in output.lines)
        return "CIS" in density or (density in ("CI", "CURRENT") and lists_states)
    if output.program.name == "ORCA":
        below = output.lines[start : start + _LINES_OF_HEAD]
        named = [line for line in below if re.match(r"\s*(Method|Type of density)\s*:", line)]
        return any(
            _EXCITED_METHOD.search(line) for line in named or output.lines[max(0, start - _LINES_BEFORE) : start]
        )
    return False


def printed_dipole(output: Output, start: int) -> Floats | None:
    """The dipole (3,) in D printed from line `start` by Gaussian, ORCA or Psi4, in its printed axes; None if not found."""
    if output.program.name == "Gaussian":
        numbers = re.findall(r"[XYZ]=\s*(-?\d+\.\d+)", output.lines[start + 1])
        return np.array([float(x) for x in numbers]) if len(numbers) == 3 else None
    if output.program.name == "Psi4":
        numbers = re.findall(r"[XYZ]:\s*(-?\d+\.\d+)", output.lines[min(start + 1, len(output.lines) - 1)])
        return np.array([float(x) for x in numbers]) * _DEBYE_PER_AU if len(numbers) == 3 else None
    for line in output.lines[start : start + _LINES_OF_HEAD + 6]:
        if line.strip().startswith("Total Dipole Moment"):
            au = np.array([float(x) for x in line.partition(":")[2].split()])
            return au * _DEBYE_PER_AU
    return None
