"""Electric field gradients at nuclei, printed by ORCA with `%eprnmr nuclei = all N {fgrad}`, and quadrupole couplings from them.

     Nucleus   0N : A:ISTP=   14 I=  1.0 P= 38.5677 MHz/au**3             (ORCA 6: `Nucleus   0N : A  : Isotope=   14 ...`)
     Raw EFG matrix (all values in a.u.**-3):
     -----------------------------------                                 (not in ORCA 4)
                 0.1486       0.6888       0.2845
                 0.6888      -0.1300      -0.3424
                 0.2845      -0.3424      -0.0186

Atoms are counted from 0, and the axes are those of the coordinates. The sign is that of the second derivative of the potential: a test
computes the part `V(Nuc)` from the other nuclei as positive charges. ORCA's Q (of 2H for hydrogen, of 17O for oxygen) is not used;
χ = e Q q/h has the Q of data/isotopes.csv for the isotope of the molecule.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from rotor.arrays import Floats
from rotor.molecules.molecule import Molecule, couplings_mhz
from rotor.molecules.readers.programs import Output, tables

HEADING = "Raw EFG matrix (all values in a.u.**-3):"
MOST_TRACE = 5e-4  # of three elements with four decimals
_NUCLEUS = re.compile(r"\s*Nucleus\s+(\d+)([A-Z][a-z]?)\s*:\s*A\s*:")


def with_field_gradients(molecule: Molecule, output: Output) -> Molecule:
    """The molecule with the last field gradients printed after its geometry, and the couplings from them."""
    if output.program.name != "ORCA" or (last := output.last((HEADING,))) is None:
        return molecule
    geometry = tables(output)[-1][0]
    if last < geometry:
        note = f"{output.where}: the field gradients of line {last + 1} belong to a geometry before the last one and are left out"
        return replace(molecule, notes=(*molecule.notes, note))
    gradients = _gradients(output, geometry, molecule)
    couplings = {**molecule.quadrupole_mhz, **couplings_mhz(gradients, molecule.nuclei)}
    source = f"field gradients of {output.program.name}, {output.where}"
    return replace(molecule, field_gradients_au=gradients, quadrupole_mhz=couplings, quadrupole_source=source)


def _gradients(output: Output, start: int, molecule: Molecule) -> dict[int, Floats]:
    """The matrices below a line, by atom number."""
    gradients: dict[int, Floats] = {}
    atom: int | None = None
    for i in range(start, len(output.lines)):
        if head := _NUCLEUS.match(output.lines[i]):
            atom = _atom(output, i, molecule, int(head[1]) + 1, head[2])
        elif output.lines[i].strip() == HEADING:
            if atom is None:
                raise output.refuse(i, "a field gradient without the line `Nucleus` that says of which atom")
            gradients[atom] = _matrix(output, i)
    return gradients


def _atom(output: Output, i: int, molecule: Molecule, atom: int, symbol: str) -> int:
    """The atom number, counted from 1; checks the element."""
    if atom > len(molecule.symbols) or molecule.symbols[atom - 1] != symbol:
        raise output.refuse(i, f"atom {atom}, counted from 1, of the last geometry is expected to be {symbol}")
    return atom


def _matrix(output: Output, start: int) -> Floats:
    """The three rows below a heading, made traceless to the last digit."""
    first = start + 2 if output.lines[start + 1].strip().startswith("---") else start + 1
    try:
        matrix = np.array([line.split() for line in output.lines[first : first + 3]], dtype=np.float64).reshape(3, 3)
    except ValueError:
        raise output.refuse(start, "three rows of three numbers are expected below this line") from None
    if abs(np.trace(matrix)) > MOST_TRACE or not np.allclose(matrix, matrix.T, atol=MOST_TRACE):
        raise output.refuse(start, "the matrix below this line is expected to be symmetric and traceless")
    return np.asarray((matrix + matrix.T) / 2 - np.eye(3) * np.trace(matrix) / 3, dtype=np.float64)
