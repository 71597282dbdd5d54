"""xyz text: every way of writing it right gives the same molecule, everything else an error with its line."""

import codecs

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rotor.molecules.readers.read import parse_molecule
from rotor.molecules.readers.xyz import decode, parse_xyz
from rotor.units import DEBYE_PER_E_ANGSTROM

LABELS = {"C": ("C", 12), "13C": ("C", 13), "D": ("H", 2), "T": ("H", 3), "17": ("Cl", 35), "37Cl": ("Cl", 37)}
coordinate = st.integers(-99_999_999, 99_999_999).map(lambda n: n / 1_000_000)
WATER = "3\nwater\nO 0.000000 0.000000 0.117300\nH 0.000000 0.757200 -0.469200\nH 0.000000 -0.757200 -0.469200\n"


@st.composite
def molecules(draw):
    """Labels and positions with 6 decimals, the atoms 1 Å and more apart along x."""
    labels = draw(st.lists(st.sampled_from(list(LABELS)), min_size=1, max_size=5))
    others = draw(st.lists(st.tuples(coordinate, coordinate), min_size=len(labels), max_size=len(labels)))
    return labels, [(float(i), *yz) for i, yz in enumerate(others)]


def written(labels, positions, digits=".6f"):
    rows = [f"{label} " + "  ".join(f"{x:{digits}}" for x in row) for label, row in zip(labels, positions, strict=True)]
    return "\n".join([str(len(labels)), "a comment", *rows]) + "\n"


def assert_is(molecule, labels, positions):
    assert list(zip(molecule.symbols, molecule.mass_numbers, strict=True)) == [LABELS[label] for label in labels]
    np.testing.assert_allclose(molecule.positions_angstrom, positions, atol=1e-12)  # 6 decimals come back exactly


@given(
    molecules(),
    st.sampled_from(["\n", "\r\n", "\r"]),
    st.sampled_from([b"", codecs.BOM_UTF8, "utf-16"]),
    st.sampled_from(["-", "−", "–"]),
    st.sampled_from([".6f", ".9E"]),
    st.booleans(),
)
def test_every_line_ending_mark_minus_and_exponent_gives_the_same(molecule, end, mark, minus, digits, blanks):
    labels, positions = molecule
    text = written(labels, positions, digits).replace("-", minus).replace("E", "D")
    if blanks:
        head, comment, *rows = text.splitlines()
        text = "\n".join(["", "  ", head, comment, *[f"\n\t{row}  " for row in rows], "", ""])
    text = text.replace("\n", end)
    content = text.encode("utf-16") if mark == "utf-16" else mark + text.encode()
    assert_is(parse_xyz(decode(content, "a.xyz")), labels, positions)


@given(molecules(), st.data())
def test_a_file_cut_anywhere_is_refused_or_whole(molecule, data):
    labels, positions = molecule
    text = written(labels, positions)
    cut = data.draw(st.integers(0, len(text) - 1))
    if text[cut:] == "\n":
        assert_is(parse_xyz(text[:cut]), labels, positions)
    else:
        with pytest.raises(ValueError, match="xyz text"):
            parse_xyz(text[:cut])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("0.757200", "********", r"w.xyz, line 4: '\*+' is not a number; .* asterisks"),
        ("0.757200", "0,7572", "line 4: '0,7572' is not a number; write a decimal point"),
        ("0.757200", "nan", "line 4: 'nan' is not a number"),
        ("0.757200", "inf", "line 4: 'inf' is not a number"),
        ("0.757200", "", "line 4: .* has 3 of 4 columns"),
        ("3\n", "4\n", "line 6: the file ends after 3 of 4 atoms"),
        ("3\n", "2\n", "line 5: .* comes after the 2 atoms"),
        ("3\n", "three\n", "line 1: 'three' is not a number of atoms"),
        ("3\n", "0\n", "line 1: '0' is not a number of atoms"),
        ("O ", "O1 ", "line 3: 'O1' may be an atom with a running number or an isotope"),
        ("O ", "Ox ", "line 3: 'Ox' is not an element or isotope"),
        ("O ", "999 ", "line 3: 999 is not the atomic number"),
        ("O 0.000000 0.000000 0.117300", "O 0 0.7572 -0.4692", r"w.xyz: atoms 1 \(O\) and 2 \(H\) are 0 Å apart"),
        (WATER, "", "the file is empty"),
        (WATER, "\n \n", "the file is empty"),
        (WATER, WATER + WATER, "line 6: a second structure begins here"),
        ("water", "Properties=species:S", "line 2: .* is not a list of name:type:columns"),
        ("water", "Properties=species:S:1", "line 2: .* has no columns species and pos"),
        ("water", "=1 Properties=species:S:1:pos:R:3", "line 2: .* is not a list of key=value"),
        ("water", "Properties=species:S:1:pos:R:3 charge=x", "charge: expected a number"),
    ],
)
def test_mistakes_are_told_with_their_line(old, new, message):
    with pytest.raises(ValueError, match=message):
        parse_xyz(WATER.replace(old, new, 1), "w.xyz")


def test_bytes_that_are_no_text():
    with pytest.raises(ValueError, match=r"a\.xyz, line 2: not UTF-8 text"):
        decode(b"1\n\xff\xfa\nH 0 0 0\n", "a.xyz")


def test_the_comment_is_kept_as_part_of_the_source():
    assert parse_xyz(WATER, "w.xyz").source == "w.xyz, which says 'water'"


def test_columns_that_are_not_read_are_told():
    molecule = parse_xyz(WATER.replace("0.117300", "0.117300 -0.8"))
    assert molecule.notes == ("columns after x y z were not read",)


@pytest.mark.parametrize(
    ("comment", "charge", "multiplicity"),
    [("charge=1 multiplicity=2", 1, 2), ("cation, charge = +1", 1, None), ("Properties=species:S:1:pos:R:3 charge=1 multiplicity=4", 1, 4),
     ("charge=0.5", 0, None), ("a charge of 1", 0, None), ("multiplicity=3", 0, 3)],
)  # fmt: skip
def test_charge_and_multiplicity_of_any_comment(comment, charge, multiplicity):
    molecule = parse_xyz(f"3\n{comment}\nO 0 0 0.117\nH 0 0.757 -0.47\nH 0 -0.757 -0.47\n")
    assert (molecule.charge, molecule.multiplicity) == (charge, multiplicity)


def test_an_impossible_multiplicity_is_refused():
    with pytest.raises(ValueError, match="multiplicity 2: with an even number of electrons"):
        parse_xyz("3\nmultiplicity=2\nO 0 0 0.117\nH 0 0.757 -0.47\nH 0 -0.757 -0.47\n")


def test_extended_xyz_as_ase_writes_it(tmp_path):
    import ase.io
    from ase.calculators.singlepoint import SinglePointCalculator

    atoms = ase.Atoms("HCl", [(0, 0, 0), (0, 0, 1.2746)], masses=[2.0141, 36.9659])
    atoms.info["charge"] = 1
    atoms.calc = SinglePointCalculator(atoms, dipole=[0, 0, -0.25], energy=-1.0)
    ase.io.write(tmp_path / "a.xyz", atoms, format="extxyz", columns=["positions", "masses", "symbols"])
    molecule = parse_xyz((tmp_path / "a.xyz").read_text(), "a.xyz")
    assert molecule.formula == "[37Cl][2H]+"
    np.testing.assert_allclose(molecule.dipole_debye, [0, 0, -0.25 * DEBYE_PER_E_ANGSTROM], rtol=1e-12)  # round-off
    np.testing.assert_allclose(molecule.positions_angstrom[1], [0, 0, 1.2746], atol=1e-8)  # ASE writes 8 decimals


def test_a_periodic_cell_is_told():
    text = WATER.replace("water", 'Lattice="9 0 0 0 9 0 0 0 9" Properties=species:S:1:pos:R:3 pbc="T T T"')
    assert "cell" in parse_xyz(text).notes[0]


def test_text_is_told_apart_by_its_content():
    assert parse_molecule(WATER, "standard input").formula == "H2O"
    with pytest.raises(ValueError, match="'M  END' is missing"):
        parse_molecule("name\n program\n\n  1  0  0  0  0  0  0  0  0  0999 V2000\n", "standard input")
