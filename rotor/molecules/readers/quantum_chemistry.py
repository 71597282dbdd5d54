"""A molecule from the output of a quantum-chemistry program: geometry, dipole, polarizability, quadrupole couplings.

cclib reads the numbers, or `cfour_orca` if it cannot. The text is checked first (`programs`). Each tensor is rotated from its printed
axes to those of the geometry, and the printed rotational constants serve as a check.
"""

from __future__ import annotations

import importlib.util
import io
import logging
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.geometry.superposition import Superposition, superpose
from rotor.molecules.molecule import Molecule
from rotor.molecules.nuclei import isotope, isotope_by_mass
from rotor.molecules.readers.cfour_orca import read_plain, reads_itself, unread
from rotor.molecules.readers.field_gradients import with_field_gradients
from rotor.molecules.readers.ground_state import dipole_lines, is_excited, printed_dipole
from rotor.molecules.readers.programs import (
    Output,
    coordinates_angstrom,
    detect_program,
    refuse_cut,
    refuse_unreadable,
    tables,
    without_constants,
)
from rotor.molecules.readers.quadrupole import with_quadrupole
from rotor.units import BOHR_RADIUS_ANGSTROM, DEBYE_PER_E_ANGSTROM, ROTATIONAL_MHZ_U_ANGSTROM2

CONSTANTS_AGREE = 1e-4  # relative; printed constants have 6 to 8 digits, coordinates 6 decimals
OTHER_GEOMETRY = 5e-3  # relative difference of constants above which the geometry is not that of the output
SAME_GEOMETRY_ANGSTROM = 1e-3  # largest rmsd between the last geometry and that of a tensor
SAME_DIPOLE_DEBYE = 2e-3  # Gaussian prints its dipole to 1e-4 D and, in a second place, in atomic units
OTHER_ENDINGS = {  # last words of programs whose versions end otherwise than cclib expects
    "MOPAC": ("== MOPAC DONE ==", "JOB ENDED NORMALLY"),
    "Molpro": ("Variable memory released", "Molpro calculation terminated"),
}
WITHOUT_CCLIB = "cclib is not installed; install the extra with it: pip install 'molrotor[qc]'"


def read_output(path: Path | str) -> Molecule:
    """The last geometry of a quantum-chemistry output, with dipole and polarizability in its axes.

    Parameters
    ----------
    path : Path or str
        Output of Gaussian, ORCA, Psi4 or CFOUR; for other programs that cclib supports, only the geometry is read.

    Returns
    -------
    Molecule
        Positions in Å; dipole in D and static polarizability in Å³ if printed, rotated by the superposition of the last geometry
        printed before the tensor on the returned one. Isotopes follow from the printed masses; default: the most abundant.
        `notes` report differences above 1e-4 between printed A, B, C and those of the geometry, and tensors that were left out.
        A dipole of an excited density is never used.

    Raises
    ------
    ValueError
        If cclib is missing (not needed for CFOUR and ORCA 6); for an output of an unknown program; with the line, for asterisks, an
        unexpected `D` exponent, or a truncated file; for printed constants that differ by more than 0.5 % from those of the
        geometry.

    Notes
    -----
    The dipole of an ion is moved from the program's origin to the centre of mass. Vibrational corrections are
    neglected. Reader: N. M. O'Boyle, A. L. Tenderholt, K. M. Langner, J. Comput. Chem. 29, 839 (2008).
    """
    text = _text(Path(path))
    program = detect_program(text)
    if not has_cclib() and not needs_no_cclib(Path(path)):
        raise ValueError(f"{path}: {WITHOUT_CCLIB}")
    if program is None:
        return _read_other(text, str(path))
    output = Output(str(path), tuple(text.splitlines()), program)
    refuse_cut(output)
    refuse_unreadable(output)
    plain = reads_itself(output)
    data = read_plain(output) if plain else _parse(without_constants(output), str(path))
    molecule = _geometry(data, str(path), program.name if plain else f"{program.name}, read with cclib")
    molecule = _with_dipole(molecule, data, output)
    molecule = with_quadrupole(_with_polarizability(molecule, data, output), output)
    molecule = with_field_gradients(molecule, output)
    return replace(molecule, notes=(*molecule.notes, *unread(output), *_disagreement(molecule, data, output)))


def _text(path: Path) -> str:
    return path.read_bytes().decode("utf-8-sig", errors="replace")


def needs_no_cclib(path: Path) -> bool:
    """Whether an output is read without cclib: CFOUR, ORCA from version 6."""
    text = _text(path)
    program = detect_program(text)
    return program is not None and reads_itself(Output(str(path), tuple(text.splitlines()), program))


def has_cclib() -> bool:
    """Whether cclib, the optional reader, is installed."""
    return importlib.util.find_spec("cclib") is not None


def is_output(path: Path) -> bool:
    """Whether `read_output` can read a file, judged by its banner, or by cclib if installed."""
    text = _text(path)
    if detect_program(text) is not None:
        return True
    if not has_cclib():
        return False
    from cclib.io.ccio import guess_filetype

    return guess_filetype(text.splitlines()) is not None


# --- cclib


def _parse(text: str, where: str) -> Any:
    """Parse an output with cclib."""
    from cclib.io.ccio import ccopen

    try:
        parser = ccopen(io.StringIO(text), loglevel=logging.CRITICAL)
        data = None if parser is None else parser.parse()
    except Exception as reason:  # cclib's parsers raise exceptions of any class; all mean that the file is invalid
        why = str(reason).strip().splitlines()[0] if str(reason).strip() else type(reason).__name__
        raise ValueError(f"{where}: cclib cannot read it ({why}); give an xyz file of the geometry") from reason
    if data is None:
        raise ValueError(f"{where}: no output of a program that cclib knows; give an xyz file of the geometry")
    if not hasattr(data, "atomcoords") and data.metadata.get("package") == "MOPAC":
        _set_last_table(data, text)
    if not hasattr(data, "atomcoords") or not hasattr(data, "atomnos"):
        raise ValueError(f"{where}: no geometry in it; give an output with one")
    return data


def _set_last_table(data: Any, text: str) -> None:
    """Set the last Cartesian coordinates of MOPAC in cclib's data; cclib reads them only for Cartesian input."""
    from ase.data import atomic_numbers

    tables = re.split(r"CARTESIAN COORDINATES *\n(?:\s*NO\. .*)?\s*\n", text)[1:]
    rows = re.match(r"(?:\s*\d+\s+[A-Z][a-z]?(?:\s+-?\d+\.\d+){3} *\n)+", tables[-1]) if tables else None
    if rows is not None:
        words = [line.split() for line in rows[0].strip().splitlines()]
        data.atomnos = [atomic_numbers[row[1]] for row in words]
        data.atomcoords = np.array([[[float(x) for x in row[2:5]] for row in words]])


def _geometry(data: Any, where: str, program: str) -> Molecule:
    symbols, mass_numbers = _isotopes(data, where)
    try:
        return Molecule(
            symbols=symbols,
            mass_numbers=mass_numbers,
            positions_angstrom=np.asarray(data.atomcoords[-1], dtype=np.float64),
            charge=getattr(data, "charge", 0),
            source=f"{where}, output of {program}",
        )
    except ValueError as reason:
        raise ValueError(f"{where}: {reason}") from None


def _isotopes(data: Any, where: str) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Symbols, and isotopes from the printed masses; an average over isotopes means the most abundant one."""
    from ase.data import atomic_masses, chemical_symbols

    numbers = [int(number) for number in data.atomnos]
    if not all(0 < number < len(chemical_symbols) for number in numbers):
        raise ValueError(f"{where}: a ghost atom or dummy in the geometry; give the output of the molecule alone")
    symbols = tuple(chemical_symbols[number] for number in numbers)
    masses = _printed_masses(data)
    if masses is None:
        return symbols, ()
    mass_numbers = []
    for number, symbol, mass in zip(numbers, symbols, masses, strict=True):
        average = abs(mass - atomic_masses[number]) < 5e-3  # programs' averages differ in the third decimal
        near = isotope(symbol) if average else isotope_by_mass(symbol, float(mass))
        mass_numbers.append(near.mass_number)
    return symbols, tuple(mass_numbers)


def _printed_masses(data: Any) -> Floats | None:
    """Printed masses in u; None unless all atoms have one."""
    masses = np.asarray(getattr(data, "atommasses", ()), dtype=np.float64)
    n = len(data.atomnos)
    return masses[-n:] if len(masses) and len(masses) % n == 0 else None


def _read_other(text: str, where: str) -> Molecule:
    """The geometry only, for a program whose tensor axes are unknown."""
    data = _parse(text, where)
    program = data.metadata.get("package", "a program")
    ended_well = any(words in text for words in OTHER_ENDINGS.get(program, ()))
    if not data.metadata.get("success", False) and not ended_well:
        last = len(text.rstrip().splitlines())
        raise ValueError(f"{where}: line {last}: {program} does not report a normal end here; give a complete output")
    note = f"{where}: dipole and polarizability were not read, because the axes of {program}'s tensors are not known"
    molecule = _geometry(data, where, f"{program}, read with cclib")
    return (
        replace(molecule, notes=(note,)) if hasattr(data, "moments") or hasattr(data, "polarizabilities") else molecule
    )


# --- tensors, each in the axes it was printed in


def _axes_at(
    output: Output, tensor: int, target: Floats, openings: tuple[str, ...] | None = None
) -> Superposition | None:
    """The superposition of the geometry printed before line `tensor` on `target`; None if no printed geometry matches."""
    before = [(i, rows) for i, rows in tables(output) if i < tensor]
    for opening in openings or output.program.geometries:
        opened = [(i, rows) for i, rows in before if output.lines[i].strip().startswith(opening)]
        if opened:
            start, rows = opened[-1]
            points = coordinates_angstrom(output, start, rows)
            if points.shape != target.shape:
                return None
            fit = superpose(points, target)
            return fit if fit.rmsd < SAME_GEOMETRY_ANGSTROM else None
    return None


def _with_dipole(molecule: Molecule, data: Any, output: Output) -> Molecule:
    """Add the ground-state dipole (D) in the axes of the geometry; for an ion about its centre of mass."""
    starts = dipole_lines(output)
    if not starts:
        return molecule
    start, has_moments = starts[-1], len(getattr(data, "moments", ())) > 1
    vector = np.asarray(data.moments[1], dtype=np.float64) if has_moments else printed_dipole(output, starts[-1])
    if vector is None:
        return molecule
    printed = vector
    if is_excited(output, start):
        ground = [
            (i, dipole)
            for i in starts
            if not is_excited(output, i) and (dipole := printed_dipole(output, i)) is not None
        ]
        if not ground:
            return _noted(
                molecule, output, start, "dipole", "is of an excited density, and none is of the ground state"
            )
        start, printed = ground[-1]
    fit = _axes_at(output, start, molecule.positions_angstrom)
    if fit is None:
        return _noted(molecule, output, start, "dipole", "is for another geometry than the last one")
    dipole = fit.rotation @ printed
    if molecule.charge:
        origin = _moment_origin(data, output)
        if origin is None:
            return _noted(molecule, output, start, "dipole", "of an ion has no origin printed with it")
        shift = molecule.centre_of_mass_angstrom - fit.apply(origin[None, :])[0]
        dipole = dipole - molecule.charge * DEBYE_PER_E_ANGSTROM * shift
    return replace(molecule, dipole_debye=dipole, dipole_source=f"{output.program.name}, {output.where}")


def _moment_origin(data: Any, output: Output) -> Floats | None:
    """The origin of the dipole (Å, printed axes); 0 for Gaussian and CFOUR."""
    if output.program.name in ("Gaussian", "CFOUR"):
        return np.zeros(3)
    for line in reversed(output.lines):
        origin = re.search(
            r"origin for moment calculation is .*= *\(([^)]*)\)|Position of electric origin *\.\.\.(.*)", line
        )
        if origin:
            return BOHR_RADIUS_ANGSTROM * np.array(
                [float(word) for word in (origin[1] or origin[2]).replace(",", " ").split()]
            )
    return None


def _with_polarizability(molecule: Molecule, data: Any, output: Output) -> Molecule:
    """Add the static polarizability, converted from a.u. to Å³, in the axes of the geometry."""
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


def _polarizability_axes(molecule: Molecule, data: Any, output: Output, start: int) -> Superposition | None:
    """Axes of the polarizability; Gaussian's `Polarizability=` has those of the `Dipole =` printed above it.

    They are the standard or the input axes. This dipole is compared with that of the population analysis (standard axes): equal as
    printed, or equal after the rotation. If neither agrees, the axes are undecided.
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
    fits = [axes for axes in (fit, turned) if _close(axes.rotation @ here, molecule.dipole_debye)]
    return fits[0] if len(fits) == 1 else None


def _close(dipole: Floats, other: Floats) -> bool:
    return bool(np.max(np.abs(dipole - other)) < SAME_DIPOLE_DEBYE)


def _noted(molecule: Molecule, output: Output, start: int, tensor: str, why: str) -> Molecule:
    note = f"{output.where}: the {tensor} of line {start + 1} {why}: left out"
    return replace(molecule, notes=(*molecule.notes, note))


# --- the printed constants


def _disagreement(molecule: Molecule, data: Any, output: Output) -> tuple[str, ...]:
    """A note if printed rotational constants differ slightly from those of the geometry; ValueError if they differ much."""
    printed, digits = _printed_constants(output)
    if not len(printed):
        return ()
    here = _constants_mhz(molecule.masses_u, molecule.positions_angstrom)
    apart = _apart(printed, here)
    if apart < max(CONSTANTS_AGREE, digits):
        return ()
    texts = ["/".join(f"{value:.3f}" for value in constants) for constants in (printed, here[-len(printed) :])]
    differ = f"{output.where}: printed constants {texts[0]} MHz, from the geometry {texts[1]}"
    others = [
        _apart(printed, _constants_mhz(masses, molecule.positions_angstrom)) for masses in _other_masses(molecule, data)
    ]
    if min(others) < max(CONSTANTS_AGREE, digits):
        used = f"they agree with the masses that {output.program.name} used, which differ from those of the isotopes"
        return (f"{differ}, {apart:.1e} apart: {used}",)
    if min(apart, *others) > OTHER_GEOMETRY:
        bohr = _apart(printed, _constants_mhz(molecule.masses_u, molecule.positions_angstrom * BOHR_RADIUS_ANGSTROM))
        cause = "its coordinates are in bohr" if bohr < OTHER_GEOMETRY else "it is another geometry, or in another unit"
        raise ValueError(f"{differ}, {apart:.1%} apart: {cause}; give an xyz file of the right geometry")
    return (f"{differ}, {apart:.1e} apart: is the geometry the last one?",)


def _other_masses(molecule: Molecule, data: Any) -> list[Floats]:
    """Masses that a program may have used: printed ones, and averages over isotopes."""
    from ase.data import atomic_masses

    printed = _printed_masses(data)
    averages = np.array([atomic_masses[nucleus.element_number] for nucleus in molecule.nuclei])
    return [averages] if printed is None else [averages, printed]


def _printed_constants(output: Output) -> tuple[Floats, float]:
    """The last printed rotational constants, MHz, in decreasing order, without the infinite or zero A of a linear molecule.

    Also returns half a unit of the last digit of the smallest constant, relative to it.
    """
    pairs = zip(output.lines, (*output.lines[1:], ""), strict=True)
    texts = [match[1].strip() or below for line, below in pairs if (match := re.search(output.program.constants, line))]
    if not texts:
        return np.zeros(0), 0.0
    words = [word for word in re.findall(r"\d+\.\d+", texts[-1]) if float(word) > 0]
    values = [float(word) * output.program.constants_mhz for word in words]
    digits = [0.5 * 10.0 ** -len(word.partition(".")[2]) / float(word) for word in words]
    return np.sort(values)[::-1], max(digits, default=0.0)


def _constants_mhz(masses_u: Floats, positions_angstrom: Floats) -> Floats:
    """A, B, C (3,) of point masses, MHz, from the moments h/(8π² I); inf for a moment that vanishes."""
    r = positions_angstrom - masses_u @ positions_angstrom / masses_u.sum()
    spread = (masses_u[:, None] * r).T @ r
    moments = np.linalg.eigvalsh(np.trace(spread) * np.eye(3) - spread)
    vanishes = moments < 1e-6 * moments[-1]
    return np.where(vanishes, np.inf, ROTATIONAL_MHZ_U_ANGSTROM2 / np.where(vanishes, 1.0, moments))


def _apart(printed: Floats, calculated: Floats) -> float:
    """Largest relative difference between printed constants and the smallest calculated ones.

    >>> round(_apart(np.array([10.1, 8.0]), np.array([np.inf, 10.0, 8.0])), 9)
    0.01
    """
    smaller = calculated[-len(printed) :]
    if not np.all(np.isfinite(smaller)):
        return float("inf")
    return float(np.max(np.abs(printed / smaller - 1)))
