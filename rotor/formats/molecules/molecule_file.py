"""A molecule as a TOML file: geometry, constants, dipole, spin weights, each with where it came from.

    name = "water"
    names = ["H2O"]

    [geometry]                          # Å, any frame; isotopes as "18O" or "D"
    kind = "r0"                         # r0, rs, re, or computed (a force field, quantum chemistry)
    source = "..."
    vibrational_difference = 0.02       # how far A, B, C of this geometry may be from the constants, relative
    atoms = [["O", 0.0, 0.0, 0.1], ...]

    charge = 0                          # may be left out, as may the next
    multiplicity = 1                    # 2S + 1 of the electrons; thermodynamic functions of the gas count it
    electronic = "even"                 # or "odd": half turns that change places of like nuclei turn the sign of the
                                        # electronic state, as in the 3Σg- of O2 (spin weights of isotopologues need it)

    [constants]                         # named as in rotor.tops.constants.constants
    unit = "MHz"
    reduction = "S"
    source = "..."
    A = 835852.4
    DJ = { value = 34.8, uncertainty = 0.1, source = "..." }

    [covariance]                        # of constants that were fitted together: their correlation coefficients, row by row as
    names = ["A", "DJ"]                 # far as the diagonal; the standard errors are the uncertainties. Constants of states and
                                        # spins by their full names: "B[1]", "G_c[0,1]", "chi_aa(14N)"
    correlations = [[1.0], [0.3, 1.0]]

    [dipole]                            # along the principal axes a, b, c
    unit = "D"
    source = "..."
    b = 1.8546

    [polarizability]                    # volume, along a, b, c: aa, bb, cc (ab, ac, bc where not 0); of a symmetric top or
    unit = "Å3"                         # linear molecule also parallel and perpendicular, or mean and anisotropy, the
    source = "..."                      # difference of the two
    mean = 1.45
    anisotropy = 0.1

    [magnetic]                          # what a magnetic field acts on, along a, b, c: the rotational g tensor, as
    source = "..."                      # g_aa, g_bb, g_cc (g_ab, ... where not 0), g_parallel and g_perpendicular, or the
    g = -0.03                           # one g of a linear top; the magnetisability in 1e-6 erg/(G2 mol) likewise as
                                        # magnetisability_aa, ... or _parallel, _perpendicular

    [spin_weights]                      # classes of rotor.tops.spins.spin_weights
    source = "..."
    ee = 1
    eo = 3
    oe = 3
    oo = 1

    [states]                            # further states, such as those of an inversion: E and constants with the number of the
    source = "..."                      # state in brackets, what couples them (G_c[0,1], W[0,1], ...); state 0 is that of
    unit = "MHz"                        # [constants]
    names = ["0+", "0-"]
    "E[1]" = 23785.9
    "B[1]" = { value = 298041.5, uncertainty = 0.3 }
    symmetry = "C2v"                    # which couplings may stand together; Cs(ab) with the plane, C2(b) with the axis
    weights = { 0 = { 0even = 0, 0odd = 4, 1 = 1, 2 = 1 }, 1 = { 0even = 4, 0odd = 0, 1 = 1, 2 = 1 } }
    dipoles = { 0 = [0, 0, 0], 1 = [0, 0, 0], "0,1" = [0, 0, 1.47] }  # (μa, μb, μc) in D; else that of [dipole] in each

    [internal_rotation]                 # a methyl group that turns, see rotor.formats.molecules.internal_rotation_table
    frame = "RAM"
    F = "7.57 cm-1"
    rho = 0.3286
    V3 = "407.6 cm-1"

    [spins]                             # constants of nuclear and electron spins, see rotor.formats.molecules.spin_table
    source = "..."

    [spins.14N]
    chi_aa = { value = -4.22324, uncertainty = 0.00108 }
    "chi_aa[1]" = -0.05                 # more in state 1 alone

    [levels]                            # energies that count instead of those of the constants where the table has them:
    file = "../levels/H2O.csv"          # columns j, ka, kc, energy_mhz, error_mhz
    source = "..."

    [catalogue]                         # the measured lines that the constants were compared with
    tag = "c018003"
    lines = 144
    rms_mhz = 0.8
    j_max = 10
    k_max = 5

    [serves]                            # which lines the file is good for, and how well: no measured line in the range is
    j_max = 20                          # missed by more than error_mhz and three times its own error
    k_max = 20
    max_ghz = 5000
    error_mhz = 1.0

Every table may be left out, except that constants or a geometry must be there: a file of constants alone is one, too. A
number whose source was not read has `unverified = true` beside it, or in its table, and is called so wherever it is shown.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path

from rotor.checks import read_text
from rotor.formats.molecules.internal_rotation_table import read_internal_rotation
from rotor.formats.molecules.magnetic_table import read_magnetic
from rotor.formats.molecules.molecule_tables import (
    MeasuredLines,
    Served,
    TableReader,
    file_kind,
    geometry,
    read_constants,
    read_covariance,
    read_dipole,
    read_measured_lines,
    read_named_level_table,
    read_polarizability,
    read_served,
    read_spin_weights,
    refuse_unknown_keys,
    unverified_in,
    with_polarizability,
)
from rotor.formats.molecules.spin_table import read_spins
from rotor.formats.molecules.state_table import read_states
from rotor.formats.toml import parse_toml
from rotor.frozen import dataclass
from rotor.molecules.molecule import Molecule
from rotor.tops.components import Tensor
from rotor.tops.constants.constants import Constants
from rotor.tops.constants.covariance import Covariance
from rotor.tops.internal_rotation import InternalRotationConstants
from rotor.tops.magnetic import MagneticTensors
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.states.level_table import LevelTable
from rotor.tops.states.state_constants import StateConstants

__all__ = ["GEOMETRY_KINDS", "MeasuredLines", "MoleculeFile", "Served", "parse_molecule_file", "read_molecule_file"]

GEOMETRY_KINDS = ("r0", "rs", "re", "computed")
_TABLES = (
    "geometry",
    "constants",
    "covariance",
    "dipole",
    "polarizability",
    "magnetic",
    "spin_weights",
    "states",
    "internal_rotation",
    "spins",
    "levels",
    "catalogue",
    "serves",
)


@dataclass(frozen=True)
class MoleculeFile:
    """Content of a molecule file.

    name, names : what the molecule is called, other names
    molecule : its geometry, with the dipole turned into the same frame; None in a file without one
    geometry_kind : "r0", "rs", "re" or "computed"
    vibrational_difference : bound of the relative difference between A, B, C of the geometry and the constants
    constants : in MHz; None in a file without them
    dipole_abc_debye : (μa, μb, μc) in D. The sign of a single component has no bearing on a spectrum
    spin_weights : nuclear-spin weights; rule "none" where the file has none
    sources : by table, where its numbers are from; single constants may have their own in `constants.sources`
    catalogue : the measured lines that the constants were compared with
    polarizability_abc_angstrom3 : the tensor (3, 3) along a, b, c in Å³
    levels : energies that count instead of those of the constants
    serves : the lines that the file is good for
    unverified : tables, or entries such as "constants.DK", whose numbers were not read in a source
    covariance : of the constants, where the file has their correlations
    states : further states of the top
    spin_constants : of nuclear and electron spins
    magnetic : what a magnetic field acts on
    internal_rotation : constants of an internal rotor
    """

    name: str
    names: tuple[str, ...] = ()
    molecule: Molecule | None = None
    geometry_kind: str | None = None
    vibrational_difference: float | None = None
    constants: Constants | None = None
    dipole_abc_debye: tuple[float, float, float] | None = None
    spin_weights: SpinWeights = field(default_factory=SpinWeights)
    sources: Mapping[str, str] = field(default_factory=dict)
    catalogue: MeasuredLines | None = None
    polarizability_abc_angstrom3: Tensor | None = None
    covariance: Covariance | None = None
    levels: LevelTable | None = None
    serves: Served | None = None
    unverified: frozenset[str] = frozenset()
    states: StateConstants | None = None
    spin_constants: SpinConstants | None = None
    magnetic: MagneticTensors | None = None
    internal_rotation: InternalRotationConstants | None = None

    def cited(self, table: str) -> str:
        """The source of a table, preceded by its unverified entries."""
        names = sorted(name.partition(".")[2] for name in self.unverified if name.startswith(f"{table}."))
        mark = "unverified: " if table in self.unverified else f"{', '.join(names)} unverified; " if names else ""
        return mark + self.sources.get(table, "")


def read_molecule_file(path: str | os.PathLike[str], *, listed: bool = False) -> MoleculeFile:
    """Read and check a molecule file. listed: read only what a list shows of a file with constants, in a third of the time.

    Raises ValueError, with file, table and key, for text that is no TOML, unknown tables and keys, numbers that
    cannot be, and a file with neither constants nor a geometry.
    """
    return parse_molecule_file(read_text(path), str(path), Path(path).stem, Path(path).parent, listed=listed)


def parse_molecule_file(
    text: str, where: str = "molecule file", default_name: str = "", folder: Path | None = None, *, listed: bool = False
) -> MoleculeFile:
    """Parse the text of a molecule file.

    text: TOML, see the head of the module. where: names the file in errors. default_name: name for a file without one. folder: folder of
    a relative path to a file of levels. listed: whether to read only what a list of molecules shows of a file with constants: constants,
    dipole, range of lines, sources.
    Returns: the content of the file.
    Raises ValueError with file, table and key, for unknown, missing or contradictory entries.

    >>> parse_molecule_file("constants = { B = 57635.96804, D = 0.1835 }").constants.text()
    'B=57635.96804 D=0.1835 MHz'
    """
    content = parse_toml(text, where)
    if "isotopologue" in content:
        raise ValueError(f"{where}: a family of isotopologues, not one molecule; rotor structure reads it")
    refuse_unknown_keys(content, ("name", "names", *_TABLES), where)
    tables = {name: TableReader(where, name, content[name]) for name in _TABLES if name in content}
    if not {"geometry", "constants"} & tables.keys():
        raise ValueError(f"{where}: neither [constants] nor [geometry]: a molecule file needs one of them, or both")

    sources = {name: table.text("source") for name, table in tables.items() if "source" in table.content}
    unverified: frozenset[str] = frozenset().union(*(unverified_in(name, table) for name, table in tables.items()))
    if listed and "constants" in tables:
        tables = {name: table for name, table in tables.items() if name in ("constants", "dipole", "serves")}
    top = TableReader(where, "", content)
    constants = read_constants(tables.get("constants"))
    dipole = read_dipole(tables.get("dipole"))
    molecule = geometry(tables.get("geometry"), top.text("name", default_name), dipole, tables.get("dipole"))
    polarizability = read_polarizability(tables.get("polarizability"), constants, molecule)
    states = read_states(tables.get("states"), constants)
    spins = read_spins(tables.get("spins"), molecule)
    internal = read_internal_rotation(tables.get("internal_rotation"), constants)
    return MoleculeFile(
        name=top.text("name", default_name),
        names=top.texts("names"),
        molecule=with_polarizability(molecule, polarizability, tables.get("polarizability")),
        geometry_kind=tables["geometry"].choice("kind", GEOMETRY_KINDS) if molecule else None,
        vibrational_difference=tables["geometry"].number("vibrational_difference", 0.0) if molecule else None,
        constants=constants,
        dipole_abc_debye=dipole,
        spin_weights=read_spin_weights(tables.get("spin_weights"), constants),
        sources=sources,
        catalogue=read_measured_lines(tables.get("catalogue")),
        polarizability_abc_angstrom3=polarizability,
        levels=read_named_level_table(tables.get("levels"), folder),
        serves=read_served(tables.get("serves")),
        unverified=unverified,
        covariance=read_covariance(tables.get("covariance"), constants, states, spins, internal),
        states=states,
        spin_constants=spins,
        magnetic=read_magnetic(tables.get("magnetic"), file_kind(constants, molecule)),
        internal_rotation=internal,
    )
