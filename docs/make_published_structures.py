"""Write published_structures.md: structures from measured lines and constants beside published ones, exceptions explained.

`python docs/make_published_structures.py PATH_TO_SHARED`, with the folder of reference files.
"""

from __future__ import annotations

import ast
import csv
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rotor.fitting.choice.choose import choose_constants
from rotor.fitting.fit import FitOptions
from rotor.fitting.result import Fit
from rotor.formats.fits.family_file import read_family
from rotor.formats.lines.assigned_lines import QUANTA, read_assigned_lines
from rotor.molecules.molecule import Molecule
from rotor.molecules.nuclei import isotope
from rotor.structures.family import Family, family
from rotor.structures.kraitchman import Substituted, kraitchman
from rotor.structures.least_squares import FittedStructure, fit_structure
from rotor.structures.substitution import substitution_structure
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top
from rotor.units import ROTATIONAL_MHZ_U_ANGSTROM2

PAGE = Path(__file__).with_name("validation") / "published_structures.md"
MALEIC = Path(__file__).resolve().parents[1] / "examples" / "maleic_anhydride.toml"

# From measured lines: start geometry, isotopologues and their catalogues of JPL and CDMS, published r_s in Å
LINEAR = {
    "OCS": {"": "c060503", "C=13C": "c061502", "S=34S": "c062505", "O=18O": "c062506"},
    "HC3N": {
        "": "c051501", "1=2H": "c052508", "2=13C": "c052509", "3=13C": "c052510", "4=13C": "c052511", "N=15N": "c052512",
    },
}  # fmt: skip
STARTS = {
    "OCS": Molecule(("O", "C", "S"), [[0, 0, 1.2], [0, 0, 0], [0, 0, -1.6]]),
    "HC3N": Molecule(("H", "C", "C", "C", "N"), [[0, 0, z] for z in (-2.3, -1.2, 0.0, 1.4, 2.6)]),
}
PUBLISHED_RS = {"OCS": (1.16054, 1.55967), "HC3N": (1.0575, 1.2042, 1.3791, 1.1591)}

HEAVY = {"C": "13C", "N": "15N", "O": "18O", "Si": "29Si"}
LEAST_ANGSTROM = 5e-4  # digits of the constants: what a coordinate may be off where Costain's error is smaller
# one unit of the last digit of a coordinate given with three, which is cut off in places, not rounded
THREE_DIGITS = 1e-3


@dataclass(frozen=True)
class Reading:
    """How published coordinates follow from the constants beside them where Kraitchman's equations alone do not give them.

    why : in words. pair : two moments, as for a planar molecule: of every atom, or `alone` of those without a published c
    positive : squares below zero are taken for positive ones. factor : on the reduced mass. parent, atoms : constants (MHz) by place
    instead of those given, of the parent and of an isotopologue by its place. computed : the coordinates are not of substitution
    """

    why: str = ""
    pair: str = ""
    alone: bool = False
    positive: bool = False
    factor: float = 1.0
    parent: Mapping[int, float] = field(default_factory=dict)
    atoms: Mapping[int, Mapping[int, float]] = field(default_factory=dict)
    computed: bool = False


READINGS = {
    "trans-cinnamaldehyde (s-trans-trans)": Reading(pair="bc", why="as for a planar molecule, from I_b and I_c"),
    "2,4,5-trifluorotoluene": Reading(
        pair="bc", positive=True,
        why="as for a planar molecule, from I_b and I_c, and the imaginary a of atoms 3 and 6 given as 0.102 and 0.1339",
    ),
    "2,3,4-trifluorotoluene": Reading(
        computed=True, why="the column holds the whole geometry of the same file, hydrogen and fluorine included: its centre of "
        "mass is at 1e-5 Å and its B is 1199.33 MHz where 1201.43 was measured; it is no result of substitution",
    ),
    "strawberry aldehyde (c-sg-)": Reading(
        pair="ac", alone=True, why="atoms whose c is imaginary or small, and not given, are from I_a and I_c alone",
    ),
    "strawberry aldehyde (t-aa)": Reading(
        pair="ac", alone=True, why="atoms whose c is imaginary, and not given, are from I_a and I_c alone",
    ),
    "2-methyltetrahydrofuran (equatorial)": Reading(
        positive=True, why="imaginary coordinates, a of O and c of atom 3, given as 0.104 and 0.039",
    ),
    "delta-valerolactam": Reading(
        positive=True, why="imaginary coordinates, b of atoms 2 and 5, given as -0.076 and -0.07",
    ),
    "cyclopropyl (isocyanato) silane (gauche)": Reading(
        factor=1.00175, why="every square is 1.00175 times smaller, of C and of Si alike: the reduced mass of a parent of 140.9 u, "
        "where C4H7NOSi has 113.03 u",
    ),
    "trans-thymol-A": Reading(
        parent={0: 2055.993, 2: 591.5251}, why="the parent's A (2034.068) and C (591.51673) in the file are of something else: "
        "P_c falls by 1.29 u Å² in nine isotopologues of ten, and with A = 2055.993, C = 591.5251 MHz all 27 coordinates are met",
    ),
    "4-hydroxy-2-butanone (I)": Reading(
        atoms={1: {0: 7282.994}}, why="A of the second isotopologue (7284.002) is 1.008 MHz too large for its own b and c; with "
        "7282.994 all are met",
    ),
}  # fmt: skip

Atom = tuple[str, list[float], list[float | None]]  # element, constants of the isotopologue, published coordinates


def published(shared: Path) -> dict[str, tuple[float, list[float], list[Atom]]]:
    """Molecules with published r_s coordinates: mass and constants of the parent, and what each substitution gave."""
    found = {}
    path = shared / "reference" / "structures" / "isotopologues_rs.csv"
    with open(path, encoding="utf-8", newline="") as handle:
        for row in csv.DictReader(handle):
            if not row["kra"].strip():
                continue
            parent, changed, coordinates = (
                ast.literal_eval(row[key].replace("nan", "None")) for key in ("rot", "iso_rot", "kra")
            )
            parts = re.findall(r"([A-Z][a-z]?)_(\d+)", row["formula"])
            mass = sum(isotope(symbol).mass_u * int(count) for symbol, count in parts)
            atoms = [
                (one[0], one[1:], other[1:])
                for one, other in zip(changed, coordinates, strict=True)
                if one[1] is not None and any(x is not None for x in other[1:])
            ]
            found[row["name"]] = (mass, parent, atoms)
    return found


def substituted(mass: float, parent: list[float], atom: Atom, reading: Reading) -> Substituted:
    """Kraitchman's equations for one atom, as the reading has them but for its factor."""
    symbol, changed, coordinates = atom
    pair = reading.pair if not reading.alone or coordinates[2] is None else ""
    return kraitchman(
        ROTATIONAL_MHZ_U_ANGSTROM2 / np.array(parent),
        ROTATIONAL_MHZ_U_ANGSTROM2 / np.array(changed),
        mass_u=mass,
        change_u=isotope(HEAVY[symbol]).mass_u - isotope(symbol).mass_u,
        shape="planar" if pair else "asymmetric",
        pair=pair or "ab",
    )


def met(mass: float, parent: list[float], atoms: list[Atom], reading: Reading) -> list[bool]:
    """Of every published coordinate whether it is met within Costain's error, or its digits where that is smaller."""
    parent = [reading.parent.get(i, value) for i, value in enumerate(parent)]
    good = []
    for place, (symbol, changed, coordinates) in enumerate(atoms):
        changes = reading.atoms.get(place, {})
        atom = (symbol, [changes.get(i, value) for i, value in enumerate(changed)], coordinates)
        found = substituted(mass, parent, atom, reading)
        squares = found.squares_angstrom2 / reading.factor
        ours = np.sqrt(np.abs(squares) if reading.positive else np.maximum(squares, 0.0))
        for axis in range(2 if found.shape == "planar" else 3):
            if (theirs := coordinates[axis]) is not None:
                within = max(float(found.costain_angstrom[axis]), _digits(theirs))
                good.append(bool(abs(ours[axis] - abs(theirs)) <= within))
    return good


def _digits(coordinate: float) -> float:
    """What the digits of a published coordinate and of the constants allow, Å."""
    return THREE_DIGITS if len(repr(coordinate).partition(".")[2]) == 3 else LEAST_ANGSTROM


def of_lines(name: str, shared: Path) -> tuple[Family, dict[str, Fit]]:
    """The family of a linear molecule, each B fitted to the measured lines of its catalogue.

    The fits start from the B of the start geometry; D, H and L are taken as the lines call for them.
    """
    start, measured, fits = STARTS[name], [], {}
    for isotopes, tag in LINEAR[name].items():
        molecule = start.with_isotopes(isotopes) if isotopes else start
        lines, _ = read_assigned_lines(shared / "reference" / "catalogues" / f"{tag}.cat.gz", QUANTA["linear"])
        begin = Constants(B=float(Top.from_molecule(molecule).rotational_constants_mhz[1]))
        fit, _ = choose_constants(lines, begin, ["B"], ["D", "H", "L"], FitOptions(default_error_mhz=0.05))
        fits[tag] = fit
        measured.append(
            (
                molecule.formula if isotopes else name,
                isotopes,
                {"B": fit.named["B"]},
                {"B": fit.named.uncertainties["B"]},
            )
        )
    return family(start, measured, name=name), fits


def maleic_anhydride() -> FittedStructure:
    """r_e of maleic anhydride from published constants and corrections."""
    file = read_family(MALEIC)
    return fit_structure(file.family, "re", coordinates=file.coordinates)


HEAD = """# Structures beside published ones

Generated by `python docs/make_published_structures.py PATH_TO_SHARED`.

## From measured lines to bonds

Every B is fitted to the lines that JPL and CDMS mark as measured, starting from the B of a rough geometry
({rough}); no constant is typed. r_s by Kraitchman's equations, errors by Costain's rule.

| molecule | isotopologues, lines, weighted rms | r_s, Å | published, Å |
|---|---|---|---|
"""
SETS = """
## Substitution structures of a literature collection

22 molecules with the constants of their isotopologues (the collection of the KREED work); five of them (two isoleucinols, three
naphthols) have no coordinates of substitution there. A coordinate is met within Costain's error, 0.0015 Å²/|r|, or 0.5 mÅ where that
is smaller (1 mÅ where three digits are given). "Plainly": Kraitchman's equations for three dimensions, imaginary coordinates as 0.
"As explained": with what is said in the last column, and with nothing else changed; of a planar molecule the coordinates in its
plane. Constants that the explanations put in place of others are inferred from the coordinates, not found in the publications.

| molecule | coordinates | met plainly | as explained | explanation |
|---|---|---|---|---|
"""
EQUILIBRIUM = """
## A semi-experimental equilibrium structure

Maleic anhydride (`examples/maleic_anhydride.toml`): constants of the ground state of ten isotopologues and their corrections to
equilibrium, of J. Vogt, J. Demaison and H. D. Rudolph, Struct. Chem. 22, 337 (2011), table 5, as transcribed in the examples of the
program MORPHEUS (yogibubu/morpheus on GitHub); the published values, of table 1, are from the start geometry there. Corrections are
the vibrational and electronic ones together, B_e - B_0. All moments weigh equally here; the authors weighed them otherwise.

| coordinate | here | published | difference, standard errors |
|---|---|---|---|
"""
PUBLISHED_RE = {  # Å, °
    (1, 2): 1.3848, (2, 3): 1.4849, (3, 4): 1.3324, (2, 6): 1.1894, (3, 8): 1.0765, (1, 2, 6): 122.55, (4, 3, 8): 129.90,
}  # fmt: skip


def page(shared: Path) -> str:
    """The whole page."""
    return _lines_part(shared) + _sets_part(shared) + _equilibrium_part()


def _lines_part(shared: Path) -> str:
    rough = "; ".join(
        f"{name} at {', '.join(f'{z:g}' for z in STARTS[name].positions_angstrom[:, 2].tolist())} Å" for name in LINEAR
    )
    rows = []
    for name in LINEAR:
        together, fits = of_lines(name, shared)
        values = substitution_structure(together).values
        of_fits = "; ".join(f"{tag} {len(fit.groups)}, {fit.weighted_rms:.2f}" for tag, fit in fits.items())
        ours = ", ".join(f"{one.name} {one.value:.5f}({one.error * 1e5:.0f})" for one in values if len(one.atoms) == 2)
        rows.append(f"| {name} | {of_fits} | {ours} | {', '.join(map(str, PUBLISHED_RS[name]))} |\n")
    return HEAD.format(rough=rough) + "".join(rows)


def _sets_part(shared: Path) -> str:
    rows = []
    for name, (mass, parent, atoms) in published(shared).items():
        reading = READINGS.get(name)
        plain = met(mass, parent, atoms, Reading())
        after = [] if reading is None or reading.computed else met(mass, parent, atoms, reading)
        explained = f"{sum(after)} of {len(after)}" if after else ""
        count, why = len(plain), reading.why if reading else ""
        rows.append(f"| {name} | {count} | {sum(plain)} | {explained} | {why} |\n")
    return SETS + "".join(rows)


def _equilibrium_part() -> str:
    rows = []
    for one in maleic_anhydride().values:
        theirs = PUBLISHED_RE.get(one.atoms)
        if theirs is not None:
            digits = 5 if one.unit == "Å" else 3
            off = (one.value - theirs) / one.error
            error = round(one.error * 10**digits)
            rows.append(
                f"| {one.name} | {one.value:.{digits}f}({error}) {one.unit} | {theirs} {one.unit} | {off:+.1f} |\n"
            )
    return EQUILIBRIUM + "".join(rows)


if __name__ == "__main__":
    PAGE.write_text(page(Path(sys.argv[1])), encoding="utf-8")
