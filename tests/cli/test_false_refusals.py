"""Legal files that were once refused: each is read, and says what its program meant."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from places import ORACLES

import rotor
from rotor.formats.lines.hitran import HitranLines, format_hitran, read_hitran
from rotor.formats.spcat.text.cat import format_lines, read_cat
from rotor.formats.spcat.text.fields import BLANK
from rotor.formats.spcat.text.lin import LineList, format_lin, read_lin, with_defaults
from rotor.molecules.readers.quantum_chemistry import read_output
from rotor.quantum.solve import solve_levels
from rotor.units import BOHR_RADIUS_ANGSTROM

with_cclib = pytest.mark.skipif(
    importlib.util.find_spec("cclib") is None, reason="the extra qc (cclib) is not installed"
)


# Catalogues


def line_of(qnfmt: str, upper: str, lower: str) -> str:
    return f"{'12162.9790':>13}  0.0000 -6.3104 2    0.0000  3  60503{qnfmt:>4}{upper:<12}{lower:<12}\n"


def test_a_lower_state_that_is_blank_has_no_label(tmp_path):
    path = tmp_path / "a.cat"
    path.write_text(line_of("102", " 1 0", "") + line_of("102", " 2 1", " 1 0"))
    catalogue = read_cat(path)
    assert catalogue.quanta_lower[0].tolist()[:2] == [BLANK, BLANK]
    assert catalogue.quanta_lower[1].tolist()[:2] == [1, 0]
    assert format_lines(catalogue) == path.read_bytes()


@pytest.mark.parametrize(("upper", "lower"), [("", " 1 0"), (" 1", " 1 0"), (" 1 0", " 1"), (" 1 0", "   0")])
def test_a_state_that_lacks_a_number_is_refused(tmp_path, upper, lower):
    (tmp_path / "a.cat").write_text(line_of("102", upper, lower))
    with pytest.raises(ValueError, match="blank, but QNFMT 102 says"):
        read_cat(tmp_path / "a.cat")


def test_a_file_that_ends_inside_the_lower_state_was_cut(tmp_path):
    (tmp_path / "a.cat").write_text(line_of("102", " 2 1", " 1 0") + line_of("102", " 2 1", "").rstrip())
    with pytest.raises(ValueError, match="line 2: the file ends without a lower state"):
        read_cat(tmp_path / "a.cat")


# SPFIT's files


@pytest.mark.parametrize("option", ["l -1", " l -1", "  l -1", " -1"])
def test_the_letter_of_the_option_line_may_stand_in_any_column(tmp_path, option):
    lines = (ORACLES / "ocs" / "ocs.var").read_text().split("\n")
    lines[2] = option + lines[2][4:]
    (tmp_path / "a.par").write_text("\n".join(lines))
    assert rotor.read(tmp_path / "a.par").constants.values["B"] == pytest.approx(6081.492112, rel=1e-12)  # text


@pytest.mark.parametrize(
    ("code", "name"),
    [(40400, "J8Jpm2"), (40500, "J10Jpm2"), (50300, "J6Jpm4"), (60200, "J4Jpm6"), (70100, "J2Jpm8"), (80000, "Jpm10")],
)
def test_any_further_term_of_the_s_reduction_is_read_and_counts(tmp_path, code, name):
    lines = (ORACLES / "abc_sred" / "abc_sred.var").read_text().split("\n")[:11]
    lines[1] = lines[1].replace("   8 ", "   9 ", 1)
    (tmp_path / "a.par").write_text("\n".join([*lines, f"{code:13d}   1.0E-09 1.00000000E-037 /x", ""]))
    top = rotor.read(tmp_path / "a.par")
    assert top.constants.values[name] == 1e-9
    without = rotor.read(ORACLES / "abc_sred" / "abc_sred.var")
    moved = solve_levels(top, 12).energy_mhz - solve_levels(without, 12).energy_mhz
    assert np.abs(moved).max() > 1e-6  # MHz; the term's elements are 1e-9 MHz times powers of 12


def test_missing_quantum_numbers_are_those_of_spfit():
    """QNFMT 304: F is N where it is blank, Ka and Kc are 0; of a second spin F is F1."""
    names = ("n", "ka", "kc", "f")
    text = (
        b"  2  0  2  3  1  0  1  2            43000.0 0.01\n"
        b"  2  0  2     1  0  1  1            43001.0 0.01\n"
        b"  2  1     2  1     1  2            43002.0 0.01\n"
    )
    lines = with_defaults(read_lin(text), names)
    assert lines.quanta[:, :8].tolist() == [
        [2, 0, 2, 3, 1, 0, 1, 2],
        [2, 0, 2, 2, 1, 0, 1, 1],
        [2, 1, 0, 2, 1, 0, 1, 2],
    ]
    assert lines.defaulted == {1, 2}
    two = with_defaults(read_lin(b"  2     3  1     2               43001.0 0.01\n", 3), ("n", "f1", "f"))
    assert two.quanta[0, :6].tolist() == [2, 2, 3, 1, 1, 2]
    assert format_lin(read_lin(text)) == text


def test_a_missing_error_is_that_of_spfit():
    lines = read_lin(b"  1  0" + b" " * 30 + b" 5.0\n")
    assert (lines.error.tolist(), lines.weight.tolist(), lines.defaulted) == ([0.01], [1.0], {0})


def test_a_fit_says_which_defaults_it_took(call):
    names = ["ocs.var", "fit.par"]
    lines = (ORACLES / "ocs" / names[0]).read_text().split("\n")
    lines[1] = lines[1].replace("    0    0    0", "    4    5    0", 1)
    Path("fit.par").write_text("\n".join(lines).replace("1.00000000E-037 /B", "1.00000000E+037 /B"))
    Path("fit.lin").write_text(
        "".join(f"{j + 1:3d}{j:3d}{'':30} {2 * 6081.492 * (j + 1):.4f} 0.01\n" for j in range(3))
        + f"  1   {'':30} {2 * 6081.492:.4f}\n"
    )
    _, out, err = call("fit", "fit.par")
    assert "1 line lacks quantum numbers or an error" in out + err


def test_lists_of_lines_and_levels_are_read_by_their_suffix(tmp_path):
    (tmp_path / "a.lin").write_bytes(b"  1  0" + b" " * 30 + b" 115271.2018 0.0005\n")
    assert isinstance(rotor.read(tmp_path / "a.lin"), LineList)
    assert len(rotor.read(ORACLES / "ocs" / "sample.egy")) > 5


# HITRAN


def test_rows_of_hapi_with_further_parameters_are_read(tmp_path):
    plain = next((ORACLES / "hitran").glob("*.par")).read_text().splitlines()[:3]
    path = tmp_path / "co.data"
    path.write_text("".join(f"{row},0.0661,-0.00125,#\n" for row in plain))
    content = rotor.read(path)
    assert isinstance(content, HitranLines)
    np.testing.assert_array_equal(content.wavenumber_cm, read_hitran("\n".join([*plain, ""]).encode()).wavenumber_cm)
    assert format_hitran(content) == path.read_bytes()
    with pytest.raises(ValueError, match="a record of HITRAN has 160"):
        read_hitran((plain[0] + "x\n").encode())


def test_a_file_of_lamda_is_refused_with_what_to_give_instead(tmp_path):
    (tmp_path / "co.dat").write_text("!MOLECULE\nCO\n!MOLECULAR WEIGHT\n28.0\n")
    with pytest.raises(ValueError, match=r"a file of LAMDA .* give the catalogue of the molecule"):
        rotor.read(tmp_path / "co.dat")


# Outputs of programs


@with_cclib
def test_psi4_1_0():
    molecule = read_output(ORACLES / "outputs" / "water_psi4_1.0.out")
    printed = (795336.70122, 401083.16849, 266625.59877)
    assert rotor.Top.from_molecule(molecule).rotational_constants_mhz == pytest.approx(printed, rel=2e-8)  # CODATA
    assert abs(molecule.dipole_debye[2]) == pytest.approx(1.6734, abs=2e-4)  # from 0.6584 a.u., four digits


@with_cclib
def test_psi4_0_5_wrote_its_name_in_capitals(tmp_path):
    text = (ORACLES / "outputs" / "water_psi4_1.0.out").read_text().replace("Psi4", "PSI4")
    (tmp_path / "a.out").write_text(text)
    assert read_output(tmp_path / "a.out").formula == "H2O"


@with_cclib
@pytest.mark.parametrize("ending", [" == MOPAC DONE ==", ""])
def test_mopac_with_internal_coordinates(tmp_path, ending):
    text = (ORACLES / "outputs" / "water_mopac2012.out").read_text()
    path = tmp_path / "a.out"
    path.write_text(text.replace(" == MOPAC DONE ==", ending))
    if not ending:
        with pytest.raises(ValueError, match="does not report a normal end here"):
            read_output(path)
        return
    molecule = read_output(path)
    assert molecule.symbols == ("O", "H", "H")
    distance = np.linalg.norm(molecule.positions_angstrom[1] - molecule.positions_angstrom[0])
    assert distance == pytest.approx(0.95658454, abs=1e-8)  # its own table of bond lengths


@with_cclib
@pytest.mark.parametrize("ending", ["Variable memory released", "Molpro calculation terminated", "ERROR EXIT"])
def test_molpro_of_2012_and_of_2018(tmp_path, ending):
    text = (ORACLES / "outputs" / "water_molpro2012.out").read_text()
    path = tmp_path / "a.out"
    path.write_text(text.replace("Variable memory released", ending))
    if ending == "ERROR EXIT":
        with pytest.raises(ValueError, match="does not report a normal end here"):
            read_output(path)
        return
    molecule = read_output(path)
    distance = np.linalg.norm(molecule.positions_angstrom[1] - molecule.positions_angstrom[0])
    assert distance == pytest.approx(1.85 * BOHR_RADIUS_ANGSTROM, abs=1e-6)  # bohr of the program's CODATA
