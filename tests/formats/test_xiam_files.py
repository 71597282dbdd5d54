"""XIAM's input and output: constants as it has them, splittings and rigid lines as it prints them."""

import gzip

import numpy as np
import pytest
from places import ORACLES

import rotor
from rotor.fitting.levels.top_levels import label_model
from rotor.fitting.top_constants import TopConstants

# constants of kncrabtree/blackchirp @71a1a6e, tests/testdata/test_aprint32_small.xi (MTBE), its layout
INPUT = """mtbe

ntop 1
ncycl 200
reduc 1
temp 7

 BJ(1)         2.731574558 { 0.000000082}
 BJ(2)         2.733474508 { 0.000000356}
 BK(1)         1.651265676 { 0.000000122}
 B-(1)         0.000818278 { 0.000000092}
 DJ(1)         0.323517E-6 { 0.000574E-6}
 dj(1)        -5.111316E-9 { 0.416810E-9}
 mu_x          1.242000000 {     fixed  }
 mu_z          0.107000000 {     fixed  }
\\F(1)        160.922724227 {     derived}
 V1n          23855.231617 {    6.708321}
 V2n         -11471.086948 {    3.757949}
 F0          156.758300542 { 0.038903118}
 delta(1)      0.460684017 { 0.000399552}
"""


@pytest.fixture
def mtbe(tmp_path):
    path = tmp_path / "mtbe.xi"
    path.write_text(INPUT)
    return path


def test_an_input_gives_constants_of_the_first_set_in_principal_axes(mtbe):
    top = rotor.read(mtbe)
    assert top.constants.values["A"] == pytest.approx(4382.840234)
    assert top.constants.values["B"] == pytest.approx(2732.392836)
    assert top.constants.values["C"] == pytest.approx(2730.75628)
    assert top.constants.values["DJ"] == pytest.approx(0.323517e-3)
    assert top.constants.values["d1"] == pytest.approx(-5.111316e-6)
    assert top.constants.reduction == "S"
    assert dict(top.internal_rotation.values) == pytest.approx(
        {"F0": 156758.300542, "delta": 0.460684017, "V3": 23855231.617, "V6": -11471086.948}
    )
    assert top.internal_rotation.frame == "PAM"
    assert np.array(top.dipole_abc_debye).tolist() == [0.107, 1.242, 0.0]
    assert len(rotor.api.solve_levels(top, 2)) == 18


def test_an_axis_on_the_other_side_of_a_has_a_delta_below_zero(mtbe):
    mtbe.write_text(INPUT + " epsil  3.14159265359\n")
    assert rotor.read(mtbe).internal_rotation.values["delta"] == pytest.approx(-0.460684017)


def test_an_axis_out_of_the_plane_ab_has_its_epsilon(mtbe):
    mtbe.write_text(INPUT + " epsil  0.3\n")
    values = rotor.read(mtbe).internal_rotation.values
    assert (values["delta"], values["epsilon"]) == pytest.approx((0.460684017, 0.3))


@pytest.mark.parametrize("ntop", [2, 3])
def test_xiam_files_of_several_tops_are_read(tmp_path, ntop):
    path = tmp_path / "several.xi"
    tops = " F0_1 158.\n delta_1 0.5\n V1n_1 9000.\n F0_2 160.\n delta_2 2.4\n epsil_2 0.1\n V1n_2 7000.\n"
    third = " F0_3 159.\n delta_3 1.4\n V1n_3 8000.\n"
    path.write_text(f"several\n\nntop {ntop}\n BJ 2.7\n BK 1.6\n B- 0.4\n" + tops + third * (ntop - 2))
    values = rotor.read(path).internal_rotation.values
    assert values == {
        "F0_1": 158e3,
        "delta_1": 0.5,
        "V3_1": 9e6,
        "F0_2": 160e3,
        "delta_2": 2.4,
        "epsilon_2": 0.1,
        "V3_2": 7e6,
    } | ({"F0_3": 159e3, "delta_3": 1.4, "V3_3": 8e6} if ntop == 3 else {})


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (" BK(1) ", " XX(1) ", "BK missing"),
        (" F0 ", " XX ", "F0 missing"),
        ("reduc 1", "reduc 2", "reduc 2"),
        ("ntop 1", "ntop 4", "4 tops"),
        ("\\F(1) ", " Dpi2J 1E-6\n\\F(1) ", "Dpi2J.*which no term here does"),
        ("\\F(1) ", " chi_z 1E-3\n\\F(1) ", "chi_aa beside spin 0: expected spin 2"),
        ("reduc 1", "reduc 1\nspin 2\nspin2 2", "spin2 2: rotor reads a single nucleus"),
        ("\\F(1) ", " C+ 1E-6\n\\F(1) ", r"C\+: these terms"),
    ],
)
def test_what_is_not_read_is_named_with_the_file(mtbe, old, new, text):
    mtbe.write_text(INPUT.replace(old, new))
    with pytest.raises(ValueError, match=text) as error:
        rotor.read(mtbe)
    assert "mtbe.xi" in str(error.value)


IODOTOLUENE = """2-Iodotoluene, its layout as in SvenHerbers/XIAM-2NQ_Examples @2036b69, without Dpi2J

ntop    1
reduc   1
spin    5

 BJ            0.660902142
 BK            2.072056049
 B-            0.077507617
 DJ           15.897561E-9
 DJK           0.145458E-6
 DK            0.269793E-6
 dj           -3.710560E-9
 dk           -0.887974E-9
 chi_z        -1.864606686
 chi_-         0.133941184
 chi_xz       -0.027292289
 V1n          15889.173406
 F0          160.0
 delta         1.195063954
"""


def test_quadrupole_constants_give_the_components_that_xiam_calculates(tmp_path):
    """127I, 1.9 GHz: components about the centre of their line, within 0.3 kHz of a spread of 10 to 140 MHz."""
    path = tmp_path / "iodotoluene.xi"
    path.write_text(IODOTOLUENE)
    top = rotor.read(path)
    assert top.spin_constants.values == pytest.approx(
        {"chi_aa(I1)": -1864.606686, "chi_bb-cc(I1)": 133.941184, "chi_ab(I1)": -27.292289}
    )
    constants, rows = TopConstants(top, hyperfine=True), np.loadtxt(ORACLES / "iodotoluene.txt")
    labels = []
    for side in (0, 1):
        n, ka, kc, f, species = rows[:, [3 * side, 3 * side + 1, 3 * side + 2, 6 + side, 8]].astype(int).T
        columns = {"n": n, "ka": ka, "kc": kc, "species": species, "vt": 0 * n, "f": f}
        labels.append(np.column_stack([columns[name] for name in constants.quanta]))
    energies = label_model(constants, np.vstack(labels)).levels(np.array(list(constants.values.values())))[0]
    difference = energies[: len(rows)] - energies[len(rows) :] - rows[:, 9]
    _, line = np.unique(rows[:, [0, 1, 2, 3, 4, 5, 8]], axis=0, return_inverse=True)
    counts = np.bincount(line.ravel())
    centred = difference - (np.bincount(line.ravel(), difference) / counts)[line.ravel()]
    assert (counts > 1).sum() >= 10
    assert np.median(np.abs(centred)) * 1e3 < 0.05
    assert np.abs(centred).max() * 1e3 < 0.3  # of F = 13/2, which is near another level
    assert np.abs(difference).max() * 1e3 < 17  # its single torsional state and Dpi2J are not in ours


@pytest.mark.oracle
@pytest.mark.parametrize(
    ("name", "count", "khz"), [("test_aprint32_small.xo", 60, 0.6), ("pred_ints3_problematic.xo.gz", 450, 0.6)]
)
def test_rigid_lines_of_an_output_are_those_of_its_constants(shared, name, count, khz):
    """Printed to 1 kHz: rms of the rounding 0.3 kHz."""
    path = shared / "reference" / "internal_rotation" / "xiam" / name
    top = rotor.read(path)
    text = (gzip.decompress(path.read_bytes()) if name.endswith("gz") else path.read_bytes()).decode()
    rigid = rotor.api.solve_levels(rotor.Top.from_constants(top.constants), 20)
    missed = []
    for line in text.split("-- B 2")[0].splitlines():
        words = line.split()
        if len(words) > 7 and words[6] == "rigid":
            labels = [int(word) for word in words[:6]]
            high, low = (rigid.find(j=j, ka=ka, kc=kc) for j, ka, kc in (labels[:3], labels[3:]))
            missed.append(rigid.energy_mhz[high] - rigid.energy_mhz[low] - 1e3 * float(words[7]))
    assert len(missed) > count
    assert np.sqrt(np.mean(np.square(missed))) * 1e3 < khz
