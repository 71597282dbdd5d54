"""`rotor tumble` keeps its contract: docs/verbs/tumble.md."""

import csv
import json
import math
import re
import shutil
from functools import partial

import matplotlib
import numpy as np
import pytest
from PIL import Image
from places import PROJECT

import rotor
from rotor.classical.free.free_motion import free_motion
from rotor.classical.gas.thermal_momentum import mean_thermal_momentum
from rotor.classical.tumble import TumbleRequest
from rotor.geometry.rotations import distance
from rotor.plots.motion import animation
from rotor.units import ASE_TIME_PS, CM_PER_EV, EV_PER_K, HBAR_CLASSICAL

COLUMNS = ["t", "m1", "m2", "m3", "qw", "qx", "qy", "qz", "energy"]
BODY = ("tumble", "--moments", "0.6,0.8,1.0", "--angular-momentum", "1.8,0.4,-0.9")
_KEYS = """
    units moments axes angular_momentum angular_momentum_size angular_momentum_source temperature_k energy times_source
    motion_kind period turning_rate fixed_axes separatrix_ratio growth_rate asymptotic_period chaos invariant_drift motion files
"""
MOTION_KEYS = {*_KEYS.split(), "errors"}
BARE_KEYS = {"rotor_version", "command", "input", "kind", "notes"}


def rows_of(path):
    with open(path, newline="") as handle:
        return list(csv.DictReader(handle))


@pytest.mark.parametrize(
    ("moments", "momentum_there", "attitude_there", "period"),
    [
        (
            "0.6,0.8,1.0",
            (1.7659625085182075, -0.69546419703308912, 0.77955498148187109),
            (-0.73606136416079394, -0.57078695124035073, -0.29938857183079009, -0.20683908610467319),
            6.8626161780581164,
        ),
        (
            "0.345,0.653,1.0",
            (1.8057486941533169, -0.29315907005202235, 0.92915521481064942),
            (0.59095313005987768, -0.7497771466036243, 0.27756735059869179, 0.10754066386713205),
            2.2146446558330431,
        ),
    ],
)
def test_regression_values_come_out_of_the_command(call, tmp_path, moments, momentum_there, attitude_there, period):
    body = ("tumble", "--moments", moments, "--angular-momentum", "1.8,0.4,-0.9")
    code, out, _ = call(*body, "--times", "0:10:101", "--csv", "out.csv", "--json", "-")
    assert code == 0
    rows = rows_of("out.csv")
    assert list(rows[0]) == COLUMNS
    assert [float(row["t"]) for row in rows] == np.linspace(0, 10, 101).tolist()
    last = {name: float(text) for name, text in rows[-1].items()}
    momentum = [last[f"m{i}"] for i in (1, 2, 3)]
    attitude = [last[f"q{c}"] for c in "wxyz"]
    assert np.allclose(
        momentum, momentum_there, rtol=0, atol=1e-14
    )  # decimal moments round: half an ulp times the angle
    assert float(distance(attitude, attitude_there)) < 1e-14
    assert json.loads(out)["period"] == pytest.approx(period, rel=1e-14)


def test_csv_is_the_exact_motion_bit_by_bit(call, tmp_path):
    code, _, _ = call(*BODY, "--times", "3,1,2", "--csv", "out.csv")
    assert code == 0
    momentum, _ = free_motion([0.6, 0.8, 1.0], [1.8, 0.4, -0.9]).at([3.0, 1.0, 2.0])
    read = [[float(row[f"m{i}"]) for i in (1, 2, 3)] for row in rows_of("out.csv")]
    assert read == momentum.tolist()
    provenance = json.loads((tmp_path / "out.csv.provenance.json").read_text(encoding="utf-8"))
    assert provenance["moments"] == [0.6, 0.8, 1.0]
    assert provenance["rows"] == 3


def test_axes_keep_the_order_given(call):
    code, out, _ = call(
        "tumble", "--moments", "1.0,0.6,0.8", "--angular-momentum=-0.9,1.8,0.4", "--times", "10", "--json", "-"
    )
    assert code == 0
    row = json.loads(out)["motion"][0]
    assert row["m2"] == pytest.approx(1.7659625085182075, abs=2e-14)  # the same body with its axes renamed in a cycle
    assert json.loads(out)["motion_kind"] == "about axis 2"


def test_json_has_the_keys_of_the_contract(call):
    code, out, _ = call(*BODY, "--json", "-")
    assert code == 0
    content = json.loads(out)
    assert set(content) == BARE_KEYS | MOTION_KEYS
    assert content["separatrix_ratio"] == pytest.approx(math.sqrt(0.6 * 0.2 / (1.0 * 0.2)), rel=1e-14)  # conventions
    growth = math.sqrt(0.2 * 0.2 / 0.6) / 0.8 * math.sqrt(1.8**2 + 0.4**2 + 0.9**2)
    assert content["growth_rate"] == pytest.approx(growth, rel=1e-14)
    assert content["motion"][-1]["t"] == pytest.approx(2 * content["period"], rel=1e-15)
    assert max(content["invariant_drift"].values()) < 1e-14
    assert [axis["kind"] for axis in content["fixed_axes"]] == ["stable", "unstable", "stable"]
    code, out, _ = call("tumble", "water", "--json", "-")
    info = set(json.loads(call("info", "water", "--json", "-")[1])) - {
        "partition_function",
        "sizes_at_j",
        "splitting_nuclei",
        "effects",
        "limits",
    }
    assert set(json.loads(out)) == info | MOTION_KEYS


def test_a_molecule_spins_as_heat_does_half_a_degree_off(call):
    code, out, _ = call("tumble", "water", "--json", "-")
    assert code == 0
    content, top = json.loads(out), rotor.read("water")
    mean = float(mean_thermal_momentum(top.moments_u_angstrom2, 300 * EV_PER_K)) / HBAR_CLASSICAL
    assert content["angular_momentum_size"] == pytest.approx(mean, rel=1e-14)
    assert 4.2 < mean < 4.4  # √(8kT/π) R_G with kT = 208.5 cm⁻¹ and A, B, C of 27.9, 14.5, 9.3 cm⁻¹
    start = np.array(content["angular_momentum"]) / mean
    assert math.degrees(math.acos(start[1])) == pytest.approx(0.5, rel=1e-9)  # acos near 1 loses half the digits
    assert "300 K" in content["angular_momentum_source"]
    assert "off axis b" in content["angular_momentum_source"]
    cold = json.loads(call("tumble", "water", "--temperature", "75", "--json", "-")[1])
    assert cold["angular_momentum_size"] == pytest.approx(mean / 2, rel=1e-14)  # √T


def test_columns_have_their_unit_and_the_former_bare_name_warns():
    table = rotor.tumble("water", times=(0.0, 1.0)).table
    assert [*table.columns][:4] == ["t_ps", "m1_hbar", "m2_hbar", "m3_hbar"]
    with pytest.warns(DeprecationWarning, match='the column "energy" is "energy_cm" from version 0.3 on'):
        assert table.columns["energy"] is table.columns["energy_cm"]
    with pytest.raises(KeyError, match="energy_mhz"):
        table.columns["energy_mhz"]


def test_units_of_a_molecule_are_ps_hbar_and_wavenumbers(call):
    code, out, _ = call("tumble", "water", "--angular-momentum", "1,10,2", "--times", "0,0.5,1ps", "--json", "-")
    assert code == 0
    content = json.loads(out)
    a, b, c = content["rotational_constants_cm"]
    assert content["energy"] == pytest.approx(a + 100 * b + 4 * c, rel=1e-9)  # CODATA: ħ²/2I and h/8π²cI are one
    assert [row["t_ps"] for row in content["motion"]] == [0.0, 0.5, 1.0]
    moments = np.array(content["moments"])
    inside = free_motion(moments, np.array([1.0, 10.0, 2.0]) * HBAR_CLASSICAL)
    momentum, _ = inside.at(1.0 / ASE_TIME_PS)
    assert np.allclose([content["motion"][2][f"m{i}_hbar"] for i in (1, 2, 3)], momentum / HBAR_CLASSICAL, rtol=1e-13)
    per_cm = 4 * math.pi * 2.99792458e-2 * math.sqrt(105)  # |L|/I in rad/ps is 4π c B |L|/ħ
    assert c * per_cm < content["turning_rate"] < a * per_cm  # a mean of angular velocities along L


def test_constants_of_units_are_those_of_ase():
    import ase.units

    # ASE has CODATA 2014: its electron volt and Boltzmann's constant differ by 1e-8 and 4e-7
    assert ASE_TIME_PS * 1000 * ase.units.fs == pytest.approx(1.0, rel=1e-7)
    assert HBAR_CLASSICAL / (ase.units._hbar * ase.units.J * ase.units.s) == pytest.approx(1.0, rel=1e-7)
    assert EV_PER_K / ase.units.kB == pytest.approx(1.0, rel=1e-6)
    assert CM_PER_EV * ase.units.invcm == pytest.approx(1.0, rel=1e-7)


@pytest.mark.parametrize(
    ("source", "kind", "motion_kind"),
    [("CO", "linear", "steady"), ("NH3", "oblate", "about axis c"), ("CH3Cl", "prolate", "about axis a")],
)
def test_every_kind_of_molecule_turns(call, source, kind, motion_kind):
    code, out, err = call("tumble", source, "--json", "-")
    assert code == 0, err
    content = json.loads(out)
    assert (content["kind"], content["motion_kind"]) == (kind, motion_kind)
    assert content["separatrix_ratio"] is None
    if kind == "linear":
        assert "two degrees" in content["angular_momentum_source"]
        assert content["angular_momentum"][0] == 0.0
        assert content["period"] is None


def test_the_separatrix_is_told(call):
    code, out, _ = call("tumble", "--moments", "2,3,6", "--angular-momentum", "1,0.5,1")
    assert code == 0
    assert "on the separatrix" in out
    assert "10 turns about L" in out
    assert "motion that runs into it" in out


@pytest.mark.parametrize("source", ["OCS", "CH4"])
def test_rows_of_a_steady_spin_show_its_turn(call, source):
    """Rows a whole turn apart repeat one attitude, as if the molecule stood still."""
    code, out, err = call("tumble", source)
    assert code == 0, err
    rows = [line.split() for line in out.split("the motion, ")[1].splitlines()[2:13]]
    assert len({row[4] for row in rows}) > 5


def test_files_are_written(call, tmp_path):
    code, out, err = call("tumble", "water", "--plot", "w.png", "--csv", "w.csv", "--json", "w.json")
    assert code == 0, err
    assert "separatrix" in out
    assert {p.name for p in tmp_path.iterdir()} == {"w.png", "w.csv", "w.csv.provenance.json", "w.json"}
    assert json.loads((tmp_path / "w.json").read_text(encoding="utf-8"))["files"] == ["w.csv", "w.png", "w.json"]


def test_an_animation_is_written(call, tmp_path, monkeypatch):
    monkeypatch.setattr(animation, "animate", partial(animation.animate, frames=3))
    code, _, err = call("tumble", "water", "--gif", "w.gif")
    assert code == 0, err
    assert (tmp_path / "w.gif").read_bytes()[:6] == b"GIF89a"
    with Image.open(tmp_path / "w.gif") as film:
        assert film.n_frames == 3
        film.seek(0)
        provenance = json.loads(film.info["comment"])
    assert provenance["program"] == "rotor"
    assert provenance["input"] == "water"
    assert provenance["command"].startswith("rotor tumble water --gif")
    assert len(provenance["moments"]) == 3


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="no ffmpeg here to make an mp4")
def test_an_mp4_is_written(call, tmp_path, monkeypatch):
    monkeypatch.setattr(animation, "animate", partial(animation.animate, frames=3))
    code, _, err = call("tumble", "water", "--gif", "w.mp4")
    assert code == 0, err
    content = (tmp_path / "w.mp4").read_bytes()
    assert content[4:8] == b"ftyp"
    assert b'"command": "rotor tumble water --gif' in content


MISTAKES = [
    (("water", "--moments", "1,2,3"), "a molecule and --moments"),
    ((), "try 'rotor tumble water'"),
    (("--moments", "-1,1,1", "--angular-momentum", "1,1,1"), "--moments: '-1,1,1': principal moments must be finite"),
    (("--moments", "1,1", "--angular-momentum", "1,1,1"), "--moments: '1,1': expected three finite numbers"),
    (("--moments", "0,0,1", "--angular-momentum", "0,1,1"), "two moments are zero"),
    (("--moments", "1,2,x", "--angular-momentum", "1,1,1"), "'x' is not a number"),
    (("--moments", "1,2,3 kg", "--angular-momentum", "1,1,1"), "unit 'kg' does not measure the same thing as 'kg*m2'"),
    (("--moments", "1,2,3"), "--angular-momentum: expected with --moments"),
    (("--moments", "1,2,3", "--angular-momentum", "0,0,0"), "a body at rest does not tumble"),
    (("--moments", "0,1,1", "--angular-momentum", "1,0,1"), "--angular-momentum: '1,0,1': a linear rotor has no"),
    (("CO", "--angular-momentum", "1,0,1"), "a linear rotor has no angular momentum about its own axis"),
    (("--moments", "1,2,3", "--angular-momentum", "1,1,1", "--temperature", "3"), "--temperature: bare moments"),
    (("--moments", "1,2,3", "--angular-momentum", "1,1,1", "--isotope", "1=2H"), "--isotope: bare moments"),
    (("water", "--angular-momentum", "1,1,1", "--temperature", "3"), "--temperature and --angular-momentum"),
    (("water", "--temperature", "-3"), "--temperature: -3"),
    (("water", "--times", "0:10"), "--times: '0:10': a grid is start:stop:count"),
    (("water", "--times", "10:0:5"), "the range must rise"),
    (("water", "--times", "now"), "--times: 'now' is not a number"),
    (("water", "--times", "0:1GHz:5"), "does not measure the same thing as 'ps'"),
    ((*BODY[1:], "--times", "0:1ps:5"), "expected plain numbers here, without the unit 'ps'"),
    (("water", "--times", "0:1:99999999999"), "at most 10000000 numbers"),
    (("water", "--times", "1e999"), "expected finite numbers"),
    (("water", "--times", "1", "--gif", "a.gif"), "--gif a.gif: a film needs at least two different times"),
    (("water", "--csv", "a.txt"), "--csv a.txt: the name must end in .csv"),
    (("water", "--gif", "a.avi"), "--gif a.avi: the name must end in .gif or .mp4"),
    (("atom.xyz",), "is a single atom"),
    (("--body", "rackett"), "wing nut; did you mean racket?"),
    (("rackett",), "'rackett' is no file, no molecule and no body; did you mean racket?"),
    (
        ("book", "--temperature", "300"),
        "--temperature: bare moments and bodies have no temperature; give --angular-momentum or --omega",
    ),
    (("--body", "brick"), "--body: 'brick': expected one of book, phone, racket, wing nut"),
    (("water", "--body", "book"), "a molecule and --body: give one of them"),
    (("--body", "book", "--moments", "1,2,3"), "--body and --moments: give one of them"),
    (("book", "--omega", "1,2,3", "--angular-momentum", "1,2,3"), "--omega and --angular-momentum"),
    (("book", "--omega", "0,0,0"), "--omega: '0,0,0': a body at rest does not tumble"),
    (("book", "--omega", "1,2,3 kg"), "unit 'kg' does not measure the same thing as 'rad/s'"),
    (("--moments", "1,2,3", "--omega", "1,2,3 rpm"), "expected plain numbers here, without the unit 'rpm'"),
    (("water", "--omega", "1,2,3", "--temperature", "3"), "--temperature and --omega"),
]


@pytest.mark.parametrize(("arguments", "said"), MISTAKES, ids=[said for _, said in MISTAKES])
def test_mistakes_are_told_in_one_line_and_nothing_is_written(call, tmp_path, arguments, said):
    if "atom.xyz" in arguments:
        (tmp_path / "atom.xyz").write_text("1\n\nHe 0 0 0\n")
    before = sorted(tmp_path.iterdir())
    extra = () if "--csv" in arguments else ("--csv", "out.csv")
    code, out, err = call("tumble", *arguments, *extra)
    assert code == 2
    assert said in err
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert out == ""
    assert sorted(tmp_path.iterdir()) == before


def test_mp4_without_ffmpeg_is_refused(call, tmp_path):
    with matplotlib.rc_context({"animation.ffmpeg_path": "no-such-program"}):
        code, out, err = call("tumble", "water", "--gif", "a.mp4", "--csv", "a.csv")
    assert code == 2
    assert err.startswith("error: --gif: a.mp4: an mp4 needs ffmpeg, which is not installed")
    assert err.count("\n") == 1
    assert out == ""
    assert not list(tmp_path.iterdir())


def test_moments_of_no_real_body_are_noted(call):
    code, _, err = call("tumble", "--moments", "0.345,0.653,1.0", "--angular-momentum", "1.8,0.4,-0.9")
    assert code == 0
    assert "note: no real body" in err


def test_code_in_the_documentation_runs():
    text = (PROJECT / "docs" / "classical.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len(blocks) == 3
    exec(compile("\n".join(blocks), "docs/classical.md", "exec"), {})


@pytest.mark.parametrize("name", ["book", "phone", "racket", "wing nut"])
def test_ordinary_bodies_have_the_inertia_of_their_parts(name):
    from rotor.classical.bodies import named_body

    body = named_body(name)
    np.testing.assert_allclose(body.body.tensor, np.diag(body.moments_kg_m2), atol=1e-20)  # axes x, y, z are principal
    low, middle, high = sorted(body.moments_kg_m2)
    assert (
        0 < low < middle < high <= (low + middle) * (1 + 1e-12)
    )  # asymmetric, and possible; equal where flat, to round-off
    assert body.axes[int(np.argsort(body.moments_kg_m2)[1])] == ("bolt" if name == "wing nut" else "across")


def test_parts_of_ordinary_bodies_against_sums_over_points():
    from rotor.geometry.inertia import box, cylinder, hoop, rod

    middles = (np.arange(200) + 0.5) / 200 - 0.5  # the mean of x² over 200 strips is (1 - 1/200²)/12
    x, y, z = np.meshgrid(*3 * [middles[::4]], indexing="ij")
    points = np.stack([2 * x, 3 * y, 4 * z], axis=-1).reshape(-1, 3)
    squares = (points**2).mean(axis=0)
    np.testing.assert_allclose(
        box(7.0, [2, 3, 4]).tensor.diagonal(), 7 * (squares.sum() - squares), rtol=1e-3
    )  # 50² strips
    turn = 2 * np.pi * np.arange(12) / 12
    ring = np.mean(np.stack([np.cos(turn), np.sin(turn), 0 * turn]) ** 2, axis=1) * 0.3**2
    np.testing.assert_allclose(hoop(2.0, 0.3).tensor.diagonal(), 2 * (ring.sum() - ring), rtol=1e-12)  # exact sums
    radii = np.sqrt((np.arange(1000) + 0.5) / 1000) * 0.3  # equal areas
    across = 5 * (np.mean(radii**2) / 2 + np.mean((0.8 * middles) ** 2))
    expected = (across, across, 5 * np.mean(radii**2))
    np.testing.assert_allclose(cylinder(5.0, 0.3, 0.8).tensor.diagonal(), expected, rtol=1e-4)  # 200 strips
    np.testing.assert_allclose(
        rod(5.0, [1, 2, 3], [1.8, 2, 3]).tensor[1, 1], 5 * np.mean((0.8 * middles) ** 2), rtol=1e-4
    )


def test_a_body_is_spun_by_an_angular_velocity_in_si_units(call):
    _, out, _ = call("tumble", "--moments", "1e-3,2e-3,2.5e-3 kg m2", "--omega", "0,60,3 rpm", "--json", "-")
    content = json.loads(out)
    assert content["units"] == {"time": "s", "angular_momentum": "kg m²/s", "energy": "J"}
    omega = np.array([0, 60, 3]) * np.pi / 30
    moments = np.array([1e-3, 2e-3, 2.5e-3])
    np.testing.assert_allclose(content["angular_momentum"], moments * omega, rtol=1e-15)  # round-off
    assert content["energy"] == pytest.approx(0.5 * moments @ omega**2, rel=1e-14)  # round-off
    _, plain, _ = call("tumble", "--moments", "1e-3,2e-3,2.5e-3", "--omega", "0,6,3", "--json", "-")
    assert json.loads(plain)["angular_momentum"] == [0.0, 2e-3 * 6, 2.5e-3 * 3]
    assert json.loads(plain)["units"]["time"] == ""


def test_a_molecule_is_spun_by_an_angular_velocity(call):
    _, out, _ = call("tumble", "CO", "--omega", "0,10,0", "--json", "-")
    content = json.loads(out)
    hbar = 1.054571817e-34 / 1.66053906892e-27 * 1e8  # in u Å²/ps
    expected = 10 * content["moments"][1] / hbar
    assert content["angular_momentum"][1] == pytest.approx(expected, rel=1e-9)  # digits of hbar here


def test_a_named_body_turns_over_by_itself(call, tmp_path):
    code, out, err = call("tumble", "racket", "--plot", "r.png")
    assert (code, err) == (0, "")
    assert out.startswith("racket: asymmetric top")
    assert "one turn a second, 0.5 degrees off the intermediate axis, across" in " ".join(out.split())
    assert (tmp_path / "r.png").exists()
    assert call("tumble", "--body", "Wing Nut", "--times", "0:1s:3", "--json", "-")[0] == 0


def test_moments_of_a_molecule_in_its_unit(call):
    """The same motion as in kg m², and a table whose small numbers are shown."""
    start = ("--omega", "1,20,0 rad/ps", "--times", "0:1ps:3")
    _, out, _ = call("tumble", "--moments", "0.614,1.154,1.768 u A^2", *start)
    assert "1.01957e-35" in out
    _, text, _ = call("tumble", "--moments", "0.614,1.154,1.768 u A^2", *start, "--json", "-")
    moments = [value * 1.66053906892e-47 for value in (0.614, 1.154, 1.768)]
    _, si, _ = call("tumble", "--moments", ",".join(map(repr, moments)) + " kg m2", *start, "--json", "-")
    assert json.loads(text)["energy"] == pytest.approx(json.loads(si)["energy"], rel=1e-14)  # round-off


def test_the_scene_of_a_body_names_the_key_of_its_momentum(call):
    """It was said to be given as conditions.angular_momentum, which is for molecules."""
    start = ("--moments", "0.6,0.8,1.0", "--angular-momentum", "1.8,0.4,-0.9", "--times", "0:10:3")
    assert call("tumble", *start, "--save-scene", "s.toml")[0] == 0
    assert "in the body: given (body.angular_momentum)" in call("run", "s.toml")[1]


def test_the_scene_of_an_everyday_body_keeps_its_name(call, tmp_path):
    """Its sizes and the names of its axes: saved as moments, a book was a body with axes 1, 2, 3."""
    code, out, _ = call("tumble", "wing-nut", "--omega", "0.01,0,20", "--save-scene", "s.toml")
    assert code == 0
    assert '[body]\nname = "wing nut"\n' in (tmp_path / "s.toml").read_text(encoding="utf-8")
    again = call("run", "s.toml")[1]
    for said in ("wing nut: asymmetric top", "Lbolt (kg m²/s)"):
        assert said in out
        assert said in again


@pytest.mark.parametrize(
    "body", [("OCS", "--omega", "1,1,0"), ("--moments", "0,1,1", "--omega", "3,1,0"),
             ("--moments", "0,1,1", "--omega", "3,1,0", "--times", "0:1:3", "--effect", "linear drag coefficients=1,1,1")],
)  # fmt: skip
def test_a_linear_body_refuses_a_rotation_about_its_own_axis(call, body):
    code, out, err = call("tumble", *body)
    assert (code, out) == (2, "")
    assert "a linear rotor does not rotate about its own axis: set that component to 0" in err
    with pytest.raises(ValueError, match="own axis"):
        TumbleRequest.from_angular_velocity([0.0, 1.0, 1.0], [3.0, 1.0, 0.0])


@pytest.mark.parametrize(("source", "stays"), [("OCS", True), ("CH4", True), ("CH3CN", False)])
def test_a_push_moves_l_on_only_where_a_moment_differs(call, source, stays):
    code, out, err = call("tumble", source)
    assert code == 0, err
    out = " ".join(out.split())
    assert ("a push stays" in out, "a push drifts" in out) == (stays, not stays)
    assert ("at a single rate" in out, "at a second rate" in out) == (stays, not stays)


def test_numbers_of_numpy_are_numbers():
    for kelvin in (np.float32(300), np.int64(300), np.float64(300)):
        assert rotor.tumble("water", temperature_k=kelvin).request.temperature_k == 300.0
    assert rotor.raman("N2", laser_nm=np.float32(488)).request.laser_nm == 488.0
    assert rotor.thermo("N2", temperatures_k=np.int64(300)).table.temperature_k.tolist() == [300.0]
    with pytest.raises(ValueError, match="expected a number"):
        rotor.tumble("water", temperature_k=np.bool_(True))


def test_a_driven_motion_names_its_method_in_words(call):
    code, out, err = call("tumble", "--moments", "1,2,2.5", "--omega", "1,1,0", "--times", "0:1:3", "--effect",
                          "constant torque vector=0,0,1")  # fmt: skip
    assert code == 0, err
    assert "Runge-Kutta of order 8, adaptive, tolerance 1e-10 of a step" in out
    assert "the effects change it" in out


def test_a_velocity_beyond_doubles_is_refused_by_its_option(call):
    code, out, err = call("tumble", "water", "--omega", "1e400,1,1")
    assert (code, out) == (2, "")
    assert err == "error: --omega: '1e400,1,1': expected three finite numbers, such as 0.6,0.8,1.0\n"
    with pytest.raises(ValueError, match=r"^angular_velocity: \[1, 2\]: expected three finite numbers"):
        rotor.tumble("water", angular_velocity=[1, 2])
