"""A molecule from the output of a quantum-chemistry program, through cclib: geometry, dipole, polarizability.

cclib reads the numbers; here the text is looked through first (asterisks, `D` exponents, a cut end), each tensor is
turned from the axes it was printed in to those of the geometry, and the printed rotational constants are a check.
"""

from __future__ import annotations

import importlib.util
import io
import logging
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.molecules.molecule import Molecule
from rotor.molecules.nuclei import isotope, isotope_of_mass
from rotor.superpose import Superposition, superpose
from rotor.units import BOHR_RADIUS_ANGSTROM, DEBYE_PER_E_ANGSTROM, MHZ_PER_CM, ROTATIONAL_MHZ_U_ANGSTROM2

CONSTANTS_AGREE = 1e-4  # relative; printed constants have 6 to 8 digits, coordinates 6 decimals
SAME_GEOMETRY_ANGSTROM = 1e-3  # rmsd: a tensor printed for a geometry further from the last one is not its tensor
SAME_DIPOLE_DEBYE = 2e-3  # Gaussian prints its dipole to 1e-4 D and, in a second place, in atomic units
WITHOUT_CCLIB = "cclib is not installed; install the extra with it: pip install 'molrotor[qc]'"

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class _Program:
    """How one program's output reads: its name's line, its last line, and what opens its tables and tensors."""

    name: str
    banner: str
    ending: str
    geometries: tuple[str, ...]  # what opens a table of coordinates; of several before a tensor the first one counts
    rows_after: int  # lines between the opening one and the first atom
    columns: slice  # of the coordinates in a row
    dipole: tuple[str, ...]
    polarizability: tuple[str, ...]
    tensor_lines: int  # lines after the opening one that may hold the tensor's numbers
    constants: str  # pattern of a line of rotational constants
    constants_mhz: float  # unit of these


# The orientation of Gaussian's population analysis is the standard one where printed, else that of the input.
_PROGRAMS = (
    _Program(
        "Gaussian", "Gaussian, Inc.", "Normal termination of Gaussian",
        ("Standard orientation:", "Input orientation:", "Z-Matrix orientation:"), 5, slice(-3, None),
        ("Dipole moment (field-independent basis",),
        ("SCF Polarizability for W=", "Polarizability=", "Exact polarizability:"), 1,
        r"Rotational constants \(GHZ\):(.*)", 1e3,
    ),
    _Program(
        "ORCA", "O   R   C   A", "ORCA TERMINATED NORMALLY",
        ("CARTESIAN COORDINATES (ANGSTROEM)",), 2, slice(1, 4),
        ("DIPOLE MOMENT",), ("THE POLARIZABILITY TENSOR",), 6,
        r"Rotational constants in cm-1:(.*)", MHZ_PER_CM,
    ),
    _Program(
        "Psi4", "Psi4: An Open-Source Ab Initio", "Psi4 exiting successfully",
        ("Geometry (in ",), 4, slice(1, 4),
        ("Dipole Moment: (a.u.)", "Multipole Moments:"), (), 1,
        r"Rotational constants: (A =.*)\[cm\^-1\]", MHZ_PER_CM,
    ),
)  # fmt: skip


@dataclass(frozen=True)
class _Output:
    """The lines of an output, of which program, and where it is from."""

    where: str
    lines: tuple[str, ...]
    program: _Program

    def last(self, openings: tuple[str, ...]) -> int | None:
        """Index of the last line that begins with one of the openings."""
        found = [i for i, line in enumerate(self.lines) if line.strip().startswith(openings)]
        return found[-1] if found else None

    def refuse(self, i: int, rule: str) -> ValueError:
        return ValueError(f"{self.where}: line {i + 1}: {rule}: {self.lines[i].strip()[:80]!r}")


def read_output(path: Path | str) -> Molecule:
    """The last geometry of a quantum-chemistry output, with dipole and polarizability in its axes.

    Parameters
    ----------
    path : Path or str
        Output of Gaussian, ORCA or Psi4; of the other programs that cclib tells apart, the geometry alone.

    Returns
    -------
    Molecule
        Positions in Å; dipole in D and static polarizability in Å³ where printed, turned with the rotation that
        superposes the last geometry printed before the tensor on the one returned. Isotopes are those of the masses
        printed, else the most abundant. `notes` says where A, B, C of the geometry and those printed differ by more
        than 1e-4, and which tensor was left out and why.

    Raises
    ------
    ValueError
        No cclib; an output of no program that it knows; asterisks, a `D` exponent where the program prints none, or a
        file that was cut, with the line.

    The dipole of an ion is moved from the program's origin to the centre of mass. Vibrational corrections are
    neglected. Reader: N. M. O'Boyle, A. L. Tenderholt, K. M. Langner, J. Comput. Chem. 29, 839 (2008).
    """
    if not has_cclib():
        raise ValueError(f"{path}: {WITHOUT_CCLIB}")
    text = Path(path).read_bytes().decode("utf-8-sig", errors="replace")
    program = program_of(text)
    if program is None:
        return _read_other(text, str(path))
    output = _Output(str(path), tuple(text.splitlines()), program)
    _refuse_cut(output)
    _refuse_unreadable(output)
    data = _parse(_without_constants(output), str(path))
    molecule = _geometry(data, str(path), program.name)
    molecule = _with_dipole(molecule, data, output)
    molecule = _with_polarizability(molecule, data, output)
    return replace(molecule, notes=(*molecule.notes, *_disagreement(molecule, data, output)))


def has_cclib() -> bool:
    """Whether cclib, the optional reader, is installed."""
    return importlib.util.find_spec("cclib") is not None


def program_of(text: str) -> _Program | None:
    """The program of those known here that an output names first, None for another.

    >>> program_of("Copyright (c) 1988-2016, Gaussian, Inc.  All Rights Reserved.").name
    'Gaussian'
    """
    named = [program for program in _PROGRAMS if program.banner in text]
    return min(named, key=lambda program: text.find(program.banner)) if named else None


def is_output(path: Path) -> bool:
    """Whether a file is an output that `read_output` knows: by its banner, or, with cclib, by what cclib finds."""
    text = path.read_bytes().decode("utf-8-sig", errors="replace")
    if program_of(text) is not None:
        return True
    if not has_cclib():
        return False
    from cclib.io.ccio import guess_filetype

    return guess_filetype(text.splitlines()) is not None


# --- the text, before cclib sees it


def _refuse_cut(output: _Output) -> None:
    """The program's last words must follow the last table and the last start of a job; without them the file is cut or the run failed."""
    endings = [i for i, line in enumerate(output.lines) if output.program.ending in line]
    begun = (*output.program.geometries, "Link1:  Proceeding")  # the second words open Gaussian's next job
    starts = [
        i for i, line in enumerate(output.lines) if output.program.banner in line or line.strip().startswith(begun)
    ]
    if not endings or starts[-1] > endings[-1]:
        last = max((i for i, line in enumerate(output.lines) if line.strip()), default=0)
        rule = (
            f"the file ends without {output.program.ending!r}, so that it was cut or the run failed; give a whole one"
        )
        raise output.refuse(last, rule)


def _refuse_unreadable(output: _Output) -> None:
    """Asterisks and `D` exponents in the numbers that are going to be used."""
    for i, may_have_d in _used_lines(output):
        line = output.lines[i]
        if "**" in line:
            raise output.refuse(i, "asterisks stand where a number did not fit; print it with more room")
        if not may_have_d and re.search(r"\d[dD][+-]?\d", line):
            raise output.refuse(i, f"a D exponent where {output.program.name} prints none; write E, or run it again")


def _used_lines(output: _Output) -> Iterator[tuple[int, bool]]:
    """Indices of the lines with coordinates, dipole, polarizability, and whether D exponents belong there."""
    program = output.program
    for start, rows in _tables(output):
        yield from ((start + program.rows_after + k, False) for k in range(len(rows)))
    d_in_tensor = program.name == "Gaussian"  # as in `Polarizability= 9.1D+00`
    for openings, d_belongs in ((program.dipole, False), (program.polarizability, d_in_tensor)):
        first = output.last(openings) if openings else None
        if first is not None:
            more = 3 if "SCF Polarizability" in output.lines[first] else 0  # a head and three rows, not two
            stop = min(first + program.tensor_lines + 1 + more, len(output.lines))
            yield from ((i, d_belongs) for i in range(first, stop))


def _tables(output: _Output) -> list[tuple[int, list[list[str]]]]:
    """Index of the opening line of each table of coordinates, and its rows as words."""
    program = output.program
    starts = [i for i, line in enumerate(output.lines) if line.strip().startswith(program.geometries)]
    return [(i, list(_rows(output.lines[i + program.rows_after :]))) for i in starts]


def _rows(lines: tuple[str, ...]) -> Iterator[list[str]]:
    for line in lines:
        if not line.strip() or line.strip().startswith("---"):
            return
        yield line.split()


def _without_constants(output: _Output) -> str:
    """The text without rotational constants: those of a linear molecule begin with asterisks, which stops cclib."""
    pattern = re.compile(output.program.constants)
    return "\n".join(line for line in output.lines if not pattern.search(line)) + "\n"


# --- cclib


def _parse(text: str, where: str) -> Any:
    """What cclib reads."""
    from cclib.io.ccio import ccopen

    try:
        parser = ccopen(io.StringIO(text), loglevel=logging.CRITICAL)
        data = None if parser is None else parser.parse()
    except Exception as reason:  # cclib's parsers fail with any class; all mean that the file is not what it should be
        why = str(reason).strip().splitlines()[0] if str(reason).strip() else type(reason).__name__
        raise ValueError(f"{where}: cclib cannot read it ({why}); give an xyz file of the geometry") from reason
    if data is None:
        raise ValueError(f"{where}: no output of a program that cclib knows; give an xyz file of the geometry")
    if not hasattr(data, "atomcoords") or not hasattr(data, "atomnos"):
        raise ValueError(f"{where}: no geometry in it; give an output with one")
    return data


def _geometry(data: Any, where: str, program: str) -> Molecule:
    symbols, mass_numbers = _isotopes(data, where)
    try:
        return Molecule(
            symbols=symbols,
            mass_numbers=mass_numbers,
            positions_angstrom=np.asarray(data.atomcoords[-1], dtype=np.float64),
            charge=getattr(data, "charge", 0),
            source=f"{where}, output of {program}, read with cclib",
        )
    except ValueError as reason:
        raise ValueError(f"{where}: {reason}") from None


def _isotopes(data: Any, where: str) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Symbols, and the isotopes whose masses are printed; an average over isotopes means the most abundant one."""
    from ase.data import atomic_masses, chemical_symbols

    numbers = [int(number) for number in data.atomnos]
    if not all(0 < number < len(chemical_symbols) for number in numbers):
        raise ValueError(f"{where}: a ghost atom or dummy in the geometry; give the output of the molecule alone")
    symbols = tuple(chemical_symbols[number] for number in numbers)
    masses = _printed_masses(data)
    if masses is None:
        return symbols, ()
    found = []
    for number, symbol, mass in zip(numbers, symbols, masses, strict=True):
        average = abs(mass - atomic_masses[number]) < 5e-3  # programs' averages differ in the third decimal
        near = isotope(symbol) if average else isotope_of_mass(symbol, float(mass))
        found.append(near.mass_number)
    return symbols, tuple(found)


def _printed_masses(data: Any) -> Floats | None:
    """Masses in u as printed, None where they are not there for every atom."""
    masses = np.asarray(getattr(data, "atommasses", ()), dtype=np.float64)
    n = len(data.atomnos)
    return masses[-n:] if len(masses) and len(masses) % n == 0 else None


def _read_other(text: str, where: str) -> Molecule:
    """The geometry alone, of a program whose axes of tensors are not known here."""
    data = _parse(text, where)
    program = data.metadata.get("package", "a program")
    if not data.metadata.get("success", False):
        last = len(text.rstrip().splitlines())
        raise ValueError(f"{where}: line {last}: {program} does not say here that it ended well; give a whole output")
    note = (
        f"{where}: dipole and polarizability were not taken, since the axes of {program}'s tensors are not known here"
    )
    molecule = _geometry(data, where, program)
    return (
        replace(molecule, notes=(note,)) if hasattr(data, "moments") or hasattr(data, "polarizabilities") else molecule
    )


# --- tensors, each in the axes it was printed in


def _axes_at(
    output: _Output, tensor: int, target: Floats, openings: tuple[str, ...] | None = None
) -> Superposition | None:
    """What lays the geometry printed before line `tensor` on `target`; None where none is the same geometry."""
    before = [(i, rows) for i, rows in _tables(output) if i < tensor]
    for opening in openings or output.program.geometries:
        tables = [(i, rows) for i, rows in before if output.lines[i].strip().startswith(opening)]
        if tables:
            start, rows = tables[-1]
            scale = BOHR_RADIUS_ANGSTROM if "bohr" in output.lines[start].lower() else 1.0
            points = scale * np.array([[float(word) for word in row[output.program.columns]] for row in rows])
            if points.shape != target.shape:
                return None
            fit = superpose(points, target)
            return fit if fit.rmsd < SAME_GEOMETRY_ANGSTROM else None
    return None


def _with_dipole(molecule: Molecule, data: Any, output: _Output) -> Molecule:
    """The dipole, D: turned to the axes of the geometry, and of an ion moved to the centre of mass."""
    start = output.last(output.program.dipole)
    if start is None or len(getattr(data, "moments", ())) < 2:
        return molecule
    fit = _axes_at(output, start, molecule.positions_angstrom)
    if fit is None:
        return _noted(molecule, output, start, "dipole", "is for another geometry than the last one")
    dipole = fit.rotation @ np.asarray(data.moments[1], dtype=np.float64)
    if molecule.charge:
        origin = _moment_origin(data, output)
        if origin is None:
            return _noted(molecule, output, start, "dipole", "of an ion has no origin printed with it")
        shift = molecule.centre_of_mass_angstrom - fit.apply(origin[None, :])[0]
        dipole = dipole - molecule.charge * DEBYE_PER_E_ANGSTROM * shift
    return replace(molecule, dipole_debye=dipole, dipole_source=f"{output.program.name}, {output.where}")


def _moment_origin(data: Any, output: _Output) -> Floats | None:
    """The point that the dipole refers to, Å in the axes it is printed in; Gaussian's is the origin of these."""
    if output.program.name == "Gaussian":
        return np.zeros(3)
    for line in reversed(output.lines):
        found = re.search(r"origin for moment calculation is .*= *\(([^)]*)\)", line)
        if found:
            return BOHR_RADIUS_ANGSTROM * np.array([float(word) for word in found[1].replace(",", " ").split()])
    return None


def _with_polarizability(molecule: Molecule, data: Any, output: _Output) -> Molecule:
    """The static polarizability, a.u. to Å³, turned to the axes of the geometry."""
    start = output.last(output.program.polarizability) if output.program.polarizability else None
    if start is None or not len(getattr(data, "polarizabilities", ())):
        return molecule
    fit = _polarizability_axes(molecule, data, output, start)
    if fit is None:
        return _noted(molecule, output, start, "polarizability", "has axes or a geometry that the file does not settle")
    alpha = np.asarray(data.polarizabilities[-1], dtype=np.float64) * BOHR_RADIUS_ANGSTROM**3
    turned = fit.rotation @ (0.5 * (alpha + alpha.T)) @ fit.rotation.T
    source = f"{output.program.name}, {output.where}"
    return replace(molecule, polarizability_angstrom3=0.5 * (turned + turned.T), polarizability_source=source)


def _polarizability_axes(molecule: Molecule, data: Any, output: _Output, start: int) -> Superposition | None:
    """Axes of the polarizability; Gaussian's `Polarizability=` has those of the `Dipole =` printed above it.

    Whether these are the standard or the input axes is settled by that dipole and the one of the population
    analysis (standard axes): equal as printed, or equal after the turn. One that fits neither settles nothing.
    """
    fit = _axes_at(output, start, molecule.positions_angstrom)
    above = output.last(("Dipole        =",))
    turned = _axes_at(output, start, molecule.positions_angstrom, ("Input orientation:", "Z-Matrix orientation:"))
    if above is None or fit is None or turned is None or np.allclose(fit.rotation, turned.rotation, atol=1e-5):
        return fit
    if molecule.dipole_debye is None or molecule.charge:
        return None
    line = output.lines[above].replace("D", "E")
    here = np.array([float(line[k : k + 15]) for k in (16, 31, 46)]) * DEBYE_PER_E_ANGSTROM * BOHR_RADIUS_ANGSTROM
    fits = [one for one in (fit, turned) if _close(one.rotation @ here, molecule.dipole_debye)]
    return fits[0] if len(fits) == 1 else None


def _close(one: Floats, other: Floats) -> bool:
    return bool(np.max(np.abs(one - other)) < SAME_DIPOLE_DEBYE)


def _noted(molecule: Molecule, output: _Output, start: int, tensor: str, why: str) -> Molecule:
    note = f"{output.where}: the {tensor} of line {start + 1} {why}: left out"
    return replace(molecule, notes=(*molecule.notes, note))


# --- the printed constants


def _disagreement(molecule: Molecule, data: Any, output: _Output) -> tuple[str, ...]:
    """A note where the printed rotational constants are not those of the geometry."""
    printed = _printed_constants(output)
    if not len(printed):
        return ()
    here = _constants_mhz(molecule.masses_u, molecule.positions_angstrom)
    apart = _apart(printed, here)
    if apart < CONSTANTS_AGREE:
        return ()
    masses = _printed_masses(data)
    cause = "is the geometry the last one?"
    if masses is not None and _apart(printed, _constants_mhz(masses, molecule.positions_angstrom)) < CONSTANTS_AGREE:
        cause = f"they agree with the masses that {output.program.name} used, which are not those of the isotopes"
    texts = ["/".join(f"{value:.3f}" for value in some) for some in (printed, here[-len(printed) :])]
    return (
        f"{output.where}: printed constants {texts[0]} MHz, from the geometry {texts[1]}, {apart:.1e} apart: {cause}",
    )


def _printed_constants(output: _Output) -> Floats:
    """The last rotational constants printed, MHz, large to small; without the infinite or zero A of a linear molecule."""
    found = [match for line in output.lines if (match := re.search(output.program.constants, line))]
    if not found:
        return np.zeros(0)
    values = [float(word) for word in re.findall(r"\d+\.\d+", found[-1][1])]
    return np.sort([value * output.program.constants_mhz for value in values if value > 0])[::-1]


def _constants_mhz(masses_u: Floats, positions_angstrom: Floats) -> Floats:
    """A, B, C (3,) of point masses, MHz, from the moments h/(8π² I); inf for a moment that vanishes."""
    r = positions_angstrom - masses_u @ positions_angstrom / masses_u.sum()
    spread = (masses_u[:, None] * r).T @ r
    moments = np.linalg.eigvalsh(np.trace(spread) * np.eye(3) - spread)
    vanishes = moments < 1e-6 * moments[-1]
    return np.where(vanishes, np.inf, ROTATIONAL_MHZ_U_ANGSTROM2 / np.where(vanishes, 1.0, moments))


def _apart(printed: Floats, calculated: Floats) -> float:
    """Largest relative difference, of as many of the smaller constants as are printed.

    >>> round(_apart(np.array([10.1, 8.0]), np.array([np.inf, 10.0, 8.0])), 9)
    0.01
    """
    some = calculated[-len(printed) :]
    if not np.all(np.isfinite(some)):
        return float("inf")
    return float(np.max(np.abs(printed / some - 1)))
