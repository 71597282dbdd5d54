"""Molecule files: what is read, what is refused and where, and that writing and reading back lose nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import rotor
from rotor.formats.molecules.library import library_file, library_molecule, names
from rotor.formats.molecules.molecule_file import MoleculeFile, parse_molecule_file, read_molecule_file
from rotor.formats.molecules.molecule_writer import molecule_file_text, write_molecule_file
from rotor.molecules.molecule import Molecule
from rotor.tops.constants.constants import Constants
from rotor.tops.spins.spin_weights import SpinWeights

LIBRARY = sorted(set(names().values()))

HDO = """
name = "semiheavy water"
names = ["HDO"]

[geometry]
kind = "re"
source = "r = 1 Å, 90°, invented"
atoms = [["O", 0, 0, 0], ["H", 0, 1, 0], ["D", 0, 0, 1]]

[constants]
unit = "GHz"
source = "invented"
A = 700.0
B = { value = 300.0, uncertainty = 0.5, source = "elsewhere" }
C = "7 cm-1"

[dipole]
a = 0.6
b = 1.7
source = "invented"
"""


def test_units_uncertainties_and_sources_arrive():
    read = parse_molecule_file(HDO)
    assert dict(read.constants.values) == {"A": 700_000.0, "B": 300_000.0, "C": pytest.approx(7 * 29979.2458)}
    assert dict(read.constants.uncertainties) == {"B": 500.0}
    assert dict(read.constants.sources) == {"B": "elsewhere"}
    assert read.sources == {"geometry": "r = 1 Å, 90°, invented", "constants": "invented", "dipole": "invented"}
    assert read.molecule.mass_numbers == (16, 1, 2)
    assert (read.dipole_abc_debye, read.geometry_kind, read.names) == ((0.6, 1.7, 0.0), "re", ("HDO",))


def test_dipole_is_turned_into_the_frame_of_the_atoms():
    molecule = parse_molecule_file(HDO).molecule
    m, r = molecule.masses_u, molecule.positions_angstrom
    r = r - m @ r / m.sum()
    axes = np.linalg.eigh(np.eye(3) * (m @ (r**2).sum(axis=1)) - (m[:, None] * r).T @ r)[1]
    assert np.abs(axes.T @ molecule.dipole_debye).tolist() == pytest.approx([0.6, 1.7, 0.0], abs=1e-12)  # round-off


def test_constants_alone_are_a_molecule_file():
    read = parse_molecule_file("[constants]\nB = 5\n", default_name="rod")
    assert (read.name, read.molecule, read.dipole_abc_debye, read.spin_weights.rule) == ("rod", None, None, "none")
    assert read.constants == Constants(B=5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name = 'x'", "neither .constants. nor .geometry."),
        ("name = 3\n[constants]\nB = 5", "x.toml, name = 3: expected text in quotes"),
        ("constants = 5", r"x.toml, \[constants\]: expected a table"),
        ("[constants\nB = 5", "x.toml: not a TOML file.*line 1"),
        ("[constant]\nB = 5", "x.toml: unknown key 'constant'; did you mean constants"),
        ("[constants]\nb = 5", r"x.toml, \[constants\]: 'b' is not .*did you mean B"),
        ("[constants]\nB = nan", "value = nan: expected a finite number of MHz"),
        ("[constants]\nB = true", "a finite number"),
        ("[constants]\nB = '5 D'", "does not measure the same"),
        ("[constants]\nunit = 'parsec'\nB = 5", "not a known unit"),
        ("[constants]\nB = { value = 5, error = 1 }", "unknown key 'error'"),
        ("[constants]\nB = { uncertainty = 1 }", "value = None: expected a finite number"),
        ("[constants]\nB = 5\n[dipole]\nx = 1", r"\[dipole\]: unknown key 'x'"),
        ("[constants]\nB = 5\n[spin_weights]\nee = 1", r"\[spin_weights\]: .*no rule"),
        ("[constants]\nB = 5\n[spin_weights]\nA = 5\nE = 2\nF = 3", "kind 'linear', whose weights go by J"),
        ("[constants]\nB = 5\n[catalogue]\nlines = 3", "tag is missing"),
        ("[constants]\nB = 5\n[catalogue]\ntag = 'c1'\nlines = 3.5", "lines = 3.5: expected a whole number"),
        ("[geometry]\nsource = 'x'", "atoms = None: expected a list"),
        ("[geometry]\natoms = [['O', 0, 0]]", "atom 1 = .*expected .*in Å"),
        ("[geometry]\natoms = [['O', 0, 0, 0], ['Xx', 0, 0, 1]]", r"\[geometry\], atoms: atom 2"),
        (
            "[geometry]\nkind = 'r9'\natoms = [['O', 0, 0, 0], ['C', 0, 0, 1]]",
            "kind = 'r9': expected one of r0, rs, re",
        ),
        (
            "[geometry]\nelectronic = 'g'\natoms = [['O', 0, 0, 0], ['C', 0, 0, 1]]",
            "electronic = 'g': expected one of even, odd",
        ),
        ("[geometry]\nvibrational_difference = -1\natoms = [['O', 0, 0, 0], ['C', 0, 0, 1]]", "of at least 0"),
    ],
)
def test_mistakes_are_told_with_file_table_and_key(text, message):
    with pytest.raises(ValueError, match=message):
        parse_molecule_file(text, "x.toml")


def test_a_byte_order_mark_is_skipped_and_other_encodings_are_told(tmp_path):
    (tmp_path / "bom.toml").write_bytes("\ufeff[constants]\r\nB = 5\r\n".encode())
    assert read_molecule_file(tmp_path / "bom.toml").constants["B"] == 5
    (tmp_path / "latin.toml").write_bytes("name = 'é'".encode("latin-1"))
    with pytest.raises(ValueError, match=r"latin.toml, line 1: not UTF-8 text"):
        read_molecule_file(tmp_path / "latin.toml")


def content(file: MoleculeFile) -> dict[str, object]:
    """All that a file says, as values that can be compared."""
    keys = (
        "name",
        "names",
        "constants",
        "dipole_abc_debye",
        "spin_weights",
        "sources",
        "catalogue",
        "serves",
        "unverified",
    )
    values = {key: getattr(file, key) for key in (*keys, "geometry_kind", "vibrational_difference")}
    molecule, levels = file.molecule, file.levels
    if molecule:
        values |= {key: getattr(molecule, key) for key in ("nuclei", "charge", "electronic")}
        values["positions"] = molecule.positions_angstrom.tolist()
    if levels is not None:
        values["levels"] = {name: column.tolist() for name, column in levels.columns.items()}
    return values


@pytest.mark.parametrize("path", LIBRARY, ids=lambda path: path.stem)
def test_library_survives_writing_and_reading(path: Path, tmp_path: Path):
    molecule = read_molecule_file(path)
    write_molecule_file(molecule, tmp_path / "copy.toml")
    assert content(read_molecule_file(tmp_path / "copy.toml")) == content(molecule)


def test_levels_are_written_beside_and_never_lost(tmp_path: Path):
    water = read_molecule_file(next(path for path in LIBRARY if path.stem == "H2O"))
    with pytest.raises(ValueError, match="level energies need a separate file"):
        molecule_file_text(water)
    write_molecule_file(water, tmp_path / "w.toml")
    assert {path.name for path in tmp_path.iterdir()} == {"w.toml", "w_levels.csv"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("energy_mhz,error_mhz\n1,2\n", "expected the columns j"),
        ("j,energy_mhz,error_mhz\n1,x,2\n", "line 2: energy_mhz is no number: '1,x,2'"),
        ("# c\nj,energy_mhz,error_mhz\n1,2,3\n1,2\n", "line 4: error_mhz is no number"),
        ("j,energy_mhz,error_mhz\n1,2,3\n1,2,3\n", "the level j = 1 is twice in the table"),
        ("j,energy_mhz,error_mhz\n-1,2,3\n", "whole numbers of 0 or more"),
        ("j,energy_mhz,error_mhz\n1,inf,3\n", "expected finite numbers"),
        ("j,energy_mhz,error_mhz\n", "one length above 0"),
    ],
)
def test_a_wrong_level_table_says_where(tmp_path: Path, text: str, said: str):
    (tmp_path / "l.csv").write_text(text, encoding="utf-8")
    (tmp_path / "m.toml").write_text("[constants]\nB = 5\n[levels]\nfile = 'l.csv'\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"l\.csv") as caught:
        read_molecule_file(tmp_path / "m.toml")
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[constants]\nB = 5\n[levels]\nfile = 'none.csv'", "level energies cannot be read"),
        ("[constants]\nB = 5\n[levels]\nsource = 'x'", "expected file = the name of a .csv"),
        ("[constants]\nB = 5\n[serves]\nk_max = 3", "expected j_max; found k_max"),
        ("[constants]\nB = 5\nunverified = 1", "unverified is true or false, not 1"),
    ],
)
def test_tables_of_levels_and_of_lines_served_are_checked(tmp_path: Path, text: str, said: str):
    (tmp_path / "m.toml").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=r"m\.toml|none\.csv") as caught:
        read_molecule_file(tmp_path / "m.toml")
    assert said in str(caught.value)


def test_lines_served_are_read_with_their_error():
    file = parse_molecule_file(
        "[constants]\nB = 5\n[serves]\nj_max = 40\nk_max = 12\nmax_ghz = 950.5\nerror_mhz = 0.25\n"
    )
    served = file.serves
    assert (served.j_max, served.k_max, served.max_ghz, served.error_mhz) == (40, 12, 950.5, 0.25)


def test_marks_of_unverified_numbers_are_read_and_shown():
    text = "[constants]\nsource = 'a'\nB = 5\nD = { value = 1e-6, unverified = true }\n[dipole]\nsource = 'b'\nunverified = true\na = 1\n"
    file = parse_molecule_file(text)
    assert file.unverified == {"constants.D", "dipole"}
    assert (file.cited("constants"), file.cited("dipole"), file.cited("geometry")) == (
        "D unverified; a",
        "unverified: b",
        "",
    )


def test_hard_text_survives_writing_and_reading():
    molecule = MoleculeFile(
        name='quote " backslash \\ newline \n tab \t Å',
        names=("x",),
        molecule=Molecule(("N", "H"), [[0, 0, 0], [0, 0, 1e-3 + 1]], charge=1, electronic="odd"),
        geometry_kind="r0",
        constants=Constants(A=5, B=4, C=3, d1=-1e-300, uncertainties={"A": 1e-17}, sources={"d1": "memory"}),
        spin_weights=SpinWeights.from_mapping({"ee": 1, "eo": 0, "oe": 0, "oo": 1}),
        sources={"geometry": "x"},
    )
    assert content(parse_molecule_file(molecule_file_text(molecule))) == content(molecule)


def test_names_find_formulas_as_written_and_words_in_any_case():
    assert library_file("CO").name == "CO.toml"
    assert library_file("Co") is library_file("co") is None
    assert library_file("WATER") == library_file("water") == library_file("H2O")
    assert library_molecule("Methyl Cyanide").constants.kind == "prolate"
    with pytest.raises(ValueError, match=r"no molecule 'wat' in the library: did you mean water"):
        library_molecule("wat")


AXIAL = "constants = { B = 2.0, kind = 'linear', unit = 'cm-1' }\n[polarizability]\nsource = 'x'\n"


@pytest.mark.parametrize("numbers", ["mean = 2.0\nanisotropy = 0.6", "parallel = 2.4\nperpendicular = 1.8"])
def test_axial_polarizability(numbers):
    tensor = parse_molecule_file(AXIAL + numbers).polarizability_abc_angstrom3
    assert np.array(tensor) == pytest.approx(np.diag([2.4, 1.8, 1.8]), abs=1e-15)  # one rounding


def test_axial_polarizability_of_an_oblate_top_stands_along_c():
    text = "constants = { B = 5.0, C = 3.0 }\n[polarizability]\nmean = 2.0\nanisotropy = -0.6"
    assert np.array(parse_molecule_file(text).polarizability_abc_angstrom3) == pytest.approx(np.diag([2.2, 2.2, 1.6]))


@pytest.mark.parametrize(
    ("numbers", "said"),
    [
        ("mean = 2.0", "mean and anisotropy"), ("aa = 1.0\nbb = 2.0", "expected aa, bb and cc"),
        ("aa = 1.0\nbb = 2.0\ncc = 1.0\nmean = 2.0", "expected aa, bb and cc"), ("mean = '2 D'\nanisotropy = 0.0", "unit 'D'"),
        ("alpha = 1.0", "unknown key 'alpha'"),
    ],
)  # fmt: skip
def test_polarizability_that_says_too_little_or_too_much(numbers, said):
    with pytest.raises(ValueError, match=said):
        parse_molecule_file(AXIAL + numbers)


def test_an_asymmetric_top_has_no_figure_axis():
    with pytest.raises(ValueError, match="no figure axis"):
        parse_molecule_file("constants = { A = 9.0, B = 5.0, C = 3.0 }\n[polarizability]\nmean = 2.0\nanisotropy = 1.0")


def test_polarizability_is_written_and_read_back():
    text = AXIAL + "aa = 2.5\nbb = 1.5\ncc = 1.25\nab = 0.125"
    first = parse_molecule_file(text)
    again = parse_molecule_file(molecule_file_text(first))
    assert again.polarizability_abc_angstrom3 == first.polarizability_abc_angstrom3 == (
        (2.5, 0.125, 0.0), (0.125, 1.5, 0.0), (0.0, 0.0, 1.25)
    )  # fmt: skip
    assert again.sources["polarizability"] == "x"


def test_polarizability_turns_along_with_isotopes():
    """HDO: the tensor of water in its own axes, turned about c by the angle between the frames; invariants stay."""
    water, hdo = (np.array(rotor.read("water", isotopes=i).polarizability_abc_angstrom3) for i in (None, "2=2H"))
    assert np.linalg.eigvalsh(hdo) == pytest.approx(np.linalg.eigvalsh(water), rel=1e-12)  # round-off of a turn
    assert abs(hdo[0, 1]) == pytest.approx(0.0237, abs=0.001)  # ½ (1.4904 - 1.4198) sin 2·21°


MAGNETIC = """
[constants]
A = 10
B = 6
C = 4
[magnetic]
source = "invented"
g_aa = 0.6
g_bb = -0.2
g_cc = 0.3
g_ab = 0.1
magnetisability_aa = -3
magnetisability_bb = 2
magnetisability_cc = -7
"""


def test_magnetic_tensors_are_read_and_written():
    read = parse_molecule_file(MAGNETIC)
    assert read.magnetic.g == ((0.6, 0.1, 0.0), (0.1, -0.2, 0.0), (0.0, 0.0, 0.3))
    assert read.magnetic.magnetisability[2] == (0.0, 0.0, -7.0)
    assert parse_molecule_file(molecule_file_text(read)).magnetic == read.magnetic
    axial = parse_molecule_file("[constants]\nB = 6\nC = 4\n[magnetic]\ng_parallel = 0.5\ng_perpendicular = 0.1")
    assert np.diag(axial.magnetic.g).tolist() == [0.1, 0.1, 0.5]  # oblate: the axis is c


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("g_aa = 0.6\n", "", "g_aa is missing"),
        ("g_aa = 0.6", "g = 0.6", "g_ab, g_bb, g_cc beside g"),
        ("g_aa = 0.6", "g_dd = 0.6", "unknown key 'g_dd'"),
        ("g_aa = 0.6", "g_aa = 'x'", "g_aa = 'x': expected a finite number"),
        ("g_aa = 0.6\ng_bb = -0.2\ng_cc = 0.3\ng_ab = 0.1\n", "", "no g: give g_aa"),
        ("g_aa = 0.6\ng_bb = -0.2\ng_cc = 0.3\ng_ab = 0.1\n", "g = 1\n", "1 numbers for a top of the kind asymmetric"),
    ],
)
def test_bad_magnetic_tables_are_refused(old, new, message):
    with pytest.raises(ValueError, match=message):
        parse_molecule_file(MAGNETIC.replace(old, new))
