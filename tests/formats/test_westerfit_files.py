"""Files of westerfit: m-chlorotoluene (one top, 35Cl) and 2-butynoic acid, frequencies as it prints them."""

import json

import numpy as np
import pytest
from places import SHARED

import rotor
from rotor.fitting.assignment import levels_in
from rotor.fitting.levels.top_levels import label_model
from rotor.formats.fits.fit_request import constants_for
from rotor.formats.lines.assigned_lines import read_assigned_lines

# constants of wes648/Westerfit.jl @a3ad4f0, examples/mcltol/bothfinal/mcltol.inp, its layout
INPUT = """mcltol   @   2023-10-30T18:11:06.405
%CNTRLS
NFOLD = 3
S = 1.5
TK = 25.0
RUNmode = F
vtmax = 0

%2NDORDER
A;             3131.247844178273;   1.0
B;            1393.7716385783463;   1.0
C;             882.5013406017205;   1.0
Dab;          -626.7485336072782;   1.0
ϵzz;                         0.0;   0.0
ϵxz;                        -0.0;   0.0
χzz;          -33.12269362671913;   1.0
χxz;             51.796645630009;   1.0
χxmy;        -32.742152528222064;   1.0
F;                    5.26805401;   0.0
ρ;           0.01666473563488219;   1.0
Vn;            0.391621130367309;   1.0
η;                           0.0;   0.0

%PARAMS N^a Nz^b (N₊^c + N₋^c) (NS)^d Sz^e Pₐ^f cos(g*α) sin(h*α) Ny^(1-δ(0,h))
%Op;                         Val;   Scl;   a;   b;   c;   d;   e;   f;   g;   h;  stg
μa;                          1.0;   0.0;   0;   1;   0;   0;   0;   0;   0;   0;   0
μa(3);                       0.0;   0.0;   0;   1;   0;   0;   0;   0;   3;   0;   0
μb;                          1.0;   0.0;   0;   0;   1;   0;   0;   0;   0;   0;   0
V6;            271018.0339359218;   1.0;   0;   0;   0;   0;   0;   0;   0;   0;   1
V6;                         -1.0;   0.0;   0;   0;   0;   0;   0;   0;   6;   0;  -1
DN;       -0.0001183563883516513;   1.0;   4;   0;   0;   0;   0;   0;   0;   0;   1
DNK;        0.001820887682628916;   1.0;   2;   2;   0;   0;   0;   0;   0;   0;   1
DK;       -0.0059117737976952175;   1.0;   0;   4;   0;   0;   0;   0;   0;   0;   1
d1;         -7.72825472886003e-5;   1.0;   2;   0;   2;   0;   0;   0;   0;   0;   1
d2;        2.6872860355237322e-5;   1.0;   0;   0;   4;   0;   0;   0;   0;   0;   1
"""
# J N Ka Kc m of both states, measured, error, and what it computes (mcltol.res of the same folder)
LINES = """
2.5, 3, 0, 3, 0, 1.5, 2, 0, 2, 0,  6107.1666, 0.003 #  6107.16475
4.5, 3, 0, 3, 0, 3.5, 2, 0, 2, 0,  6110.9206, 0.003 #  6110.91787
4.5, 4, 2, 2, 0, 3.5, 3, 2, 1, 0,  8579.1010, 0.003 #  8579.09814
2.5, 4, 2, 2, 0, 1.5, 3, 2, 1, 0,  8587.1612, 0.003 #  8587.15823
5.5, 6, 4, 3, 0, 4.5, 5, 4, 2, 0, 12570.2131, 0.003 # 12570.21036
4.5, 5, 2, 3, 1, 3.5, 4, 2, 2, 1, 11444.5797, 0.003 # 11444.63981
6.5, 5, 2, 3, 1, 5.5, 4, 2, 2, 1, 11445.5742, 0.003 # 11445.63708
6.5, 6, 0, 6, 1, 5.5, 5, 0, 5, 1, 11555.5786, 0.003 # 11555.57628
4.5, 6, 1, 6, 1, 3.5, 5, 1, 5, 1, 11041.2002, 0.003 # 11041.20114
7.5, 6, 2, 4, 1, 6.5, 5, 2, 3, 1, 13401.1280, 0.003 # 13401.20140
4.5, 6, 1, 5, 1, 3.5, 5, 1, 4, 1, 11817.3549, 0.003 # 11817.37207
6.5, 7, 3, 4, 1, 5.5, 6, 3, 3, 1, 15469.8216, 0.003 # 15469.83431
9.5, 8, 3, 5, 1, 8.5, 7, 3, 4, 1, 17935.7422, 0.003 # 17935.60524
"""


@pytest.fixture
def files(tmp_path):
    """The input and the line list of m-chlorotoluene."""
    (tmp_path / "mcltol.inp").write_text(INPUT, encoding="utf-8")
    (tmp_path / "mcltol.lne").write_text(LINES, encoding="utf-8")
    return tmp_path


def test_hyperfine_lines_of_a_low_barrier_are_those_that_westerfit_prints(files):
    top = rotor.read(files / "mcltol.inp")
    path = str(files / "mcltol.lne")
    constants = constants_for(path, top, ())
    lines, _ = read_assigned_lines(path, constants.quanta, constants.halves)
    labels, up, low = levels_in(lines)
    energies, _ = label_model(constants, labels).levels(np.array(list(constants.values.values())))
    theirs = np.array([float(line.split("#")[1]) for line in LINES.splitlines() if line])
    assert np.abs(energies[up] - energies[low] - theirs).max() < 2e-5  # MHz: five decimals are printed


def test_frequencies_of_westerfit_are_fitted_to_its_constants(files, call):
    computed = [line.split("#") for line in LINES.splitlines() if line]
    table = [",".join([*line.split(",")[:10], theirs, "0.003"]) for line, theirs in computed]
    (files / "computed.lne").write_text("\n".join(table))
    (files / "moved.inp").write_text(INPUT.replace("-33.12269362671913", "-32.9"), encoding="utf-8")
    free = "B,chi_aa(I1),chi_ab(I1)"
    code, output, error = call(
        "fit", str(files / "computed.lne"), "--start", str(files / "moved.inp"), "--free", free, "--json", "-"
    )
    assert code == 0, error
    fitted = json.loads(output)["constants_mhz"]
    assert fitted["chi_aa(I1)"] == pytest.approx(-33.12269362671913, abs=1e-3)  # of five decimals printed
    assert fitted["chi_ab(I1)"] == pytest.approx(51.796645630009, abs=2e-2)


def test_the_input_of_westerfit_is_read_with_its_conventions(files):
    top = rotor.read(files / "mcltol.inp")
    internal = top.internal_rotation
    assert internal.values["V6"] == pytest.approx(2 * 271018.0339359218)  # ½V6 (1 - cos 6α)
    assert internal.values["V3"] == pytest.approx(0.391621130367309 * rotor.units.MHZ_PER_CM)
    assert (internal.frame, internal.names) == ("RAM", "energy")
    assert top.constants.values["deltaJ"] == pytest.approx(7.72825472886003e-5 / 2)
    assert top.constants.values["Jpm4"] == pytest.approx(2.6872860355237322e-5 / 2)
    assert top.dipole_abc_debye == (1.0, 1.0, 0.0)
    assert dict(top.spin_constants.twice) == {"I1": 3}


def test_the_input_of_2_butynoic_acid_has_the_constants_of_its_fit(tmp_path):
    folder = SHARED / "reference" / "internal_rotation" / "westerfit"
    if not folder.is_dir():
        pytest.skip("the reference files in shared/ are not beside this checkout")
    top = rotor.read(folder / "2ba.inp")
    path = str(folder / "2ba.lne")
    constants = constants_for(path, top, ())
    lines, _ = read_assigned_lines(path, constants.quanta, constants.halves)
    labels, up, low = levels_in(lines)
    energies, _ = label_model(constants, labels).levels(np.array(list(constants.values.values())))
    difference = energies[up] - energies[low] - lines.frequency_mhz
    assert len(difference) == 89
    assert np.sqrt(np.mean(difference**2)) == pytest.approx(1.4236, abs=1e-3)  # MHz: "Initial RMS" of 2ba.out


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("NFOLD = 3", "NFOLD = 2", "threefold"),
        ("A;  ", "Q;  ", "line 10: Q: known are A"),
        ("η;                           0.0", "η;  1.0", "η = 1"),
        ("S = 1.5", "S = 0", "set S to the spin"),
        ("0;   0;   6;   0;  -1", "0;   0;   6;   1;  -1", "V6 with a power of sin"),
        ("0;   0;   6;   0;  -1", "0;   6;   0;  -1", "8 or 9 powers"),
        ("-33.12269362671913", "-33.1x", "is no number"),
    ],
)
def test_mistakes_in_an_input_of_westerfit_are_named(files, old, new, text):
    path = files / "mcltol.inp"
    path.write_text(INPUT.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ValueError, match=text):
        rotor.read(path)


def test_line_lists_with_other_columns_are_refused(files):
    path = files / "mcltol.lne"
    path.write_text("2.5, 3, 0, 3, 0, 1.5, 2, 0, 2, 0, 6107.1666\n")
    with pytest.raises(ValueError, match="line 1: 11 columns"):
        read_assigned_lines(path, ("n", "ka", "kc", "species", "vt", "f"), {"f"})
    path.write_text("3, 3, 0, 3, 3, 2, 2, 0, 2, 3, 6107.1666, 0.003\n")
    with pytest.raises(ValueError, match="m = 3"):
        read_assigned_lines(path, ("j", "ka", "kc", "species", "vt"))
