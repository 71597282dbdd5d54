"""Inputs that once ended in "this is a defect": each is one line that names the key, with exit code 2."""

from __future__ import annotations

import json
import re
import time
from pathlib import Path

import numpy as np
import pytest
from places import ORACLES

import rotor
from rotor.classical.motion_steps import count_first_steps, expected_steps, first_share
from rotor.scenes.scene import parse_scene

TUMBLE = """schema = 1
kind = "tumble"
{accuracy}
[body]
moments = {moments}
angular_momentum = {momentum}
[conditions]
times = "0:10:11"
[[effects]]
effect = {effect}
vector = [0.0, 0.0, 1.0]
frame = "body"
"""


def tumble(effect='"constant torque"', moments=(6e-13, 0.6, 1.0), momentum=(1.0, 1.0, 1.0), accuracy=""):
    return TUMBLE.format(effect=effect, moments=list(moments), momentum=list(momentum), accuracy=accuracy)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            'schema = 1\nkind = "spectrum"\nmolecule = "CO"\n[observables]\nmin_lgint = 1000\n',
            "observables.min_lgint: 1000: expected a number from -300 to 300",
        ),
        (
            'schema = 1\nkind = "spectrum"\nmolecule = "CO"\n[observables]\nmin_lgint = -1e308\n',
            "observables.min_lgint: -1e+308: expected a number from -300",
        ),
        (tumble("[1, 2, 3]"), "effects[0].effect"),
        (tumble("{ a = 1 }"), "effects[0].effect"),
        (tumble("7"), "effects[0].effect"),
        ('schema = 1\nkind = "align"\nmolecule = "CO"\n[[pulses]]\nshape = [1]\n', "pulses[0].shape"),
        ('schema = 1\nkind = [1]\nmolecule = "CO"\n', "expected kind, one of"),
        ('schema = [1]\nkind = "levels"\nmolecule = "CO"\n', "expected schema = 1"),
        (
            'schema = 1\nkind = "levels"\nmolecule = "CO"\n[outputs]\ncsv = "o_{jmax.x}.csv"\n[sweep]\n"observables.jmax" = [1, 2]\n',
            "{jmax.x} is no swept name",
        ),
    ],
)
@pytest.mark.parametrize("verb", ["run", "plan"])
def test_a_wrong_value_is_one_line(call, folder, verb, text, said):
    Path("s.toml").write_text(text)
    code, out, err = call(verb, "s.toml")
    if verb == "plan" and "[sweep]" in text:
        assert code == 2
        return
    assert (code, out, len(err.splitlines())) == (2, "", 1)
    assert said in err
    assert "defect" not in err


@pytest.mark.parametrize("cut", [1000.0, -301.0, float("nan"), float("inf")])
def test_a_cut_that_no_intensity_has(cut, tmp_path):
    top = rotor.read("CO")
    calls = [
        lambda: rotor.api.line_list(top, min_lgint=cut),
        lambda: rotor.api.SpectrumRequest(top, min_lgint=cut),
        lambda: rotor.api.stream_lines(top, tmp_path / "a.cat", min_lgint=cut),
    ]
    for make in calls:
        with pytest.raises(ValueError, match=r"min_lgint: .*expected a (number|finite number)"):
            make()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "momentum", [pytest.param((1.0, 1.0, 1.0), marks=pytest.mark.slow(seconds=14)), (0.0, 0.0, 0.0)]
)
def test_a_plan_of_a_body_that_turns_1e13_times_is_short(call, folder, momentum):
    """ω = L/I is 1.7e12 about the first axis; at rest, the torque about that axis brings it there."""
    text = tumble(momentum=momentum).replace("[0.0, 0.0, 1.0]", "[1.0, 0.0, 0.0]")
    Path("s.toml").write_text(text)
    start = time.process_time()
    code, out, err = call("plan", "s.toml")
    assert (code, err) == (0, "")
    assert (
        time.process_time() - start < 200
    )  # s, mostly compilation on a busy machine; steps one by one would take months
    steps = int(next(line for line in out.splitlines() if line.startswith("steps")).split()[1].replace(",", ""))
    assert steps > 1e7


def test_an_accuracy_that_needs_endless_steps_is_refused(call, folder):
    Path("s.toml").write_text(tumble(accuracy="accuracy = 1e-6"))
    code, _, err = call("run", "s.toml")
    assert code == 2
    assert "this motion takes about" in err


@pytest.mark.parametrize("moments", [(0.3, 0.35, 0.4), (6e-4, 0.6, 1.0)])
def test_steps_are_expected_by_a_short_part(moments):
    """The expected number is near the count where the count can be made."""
    from rotor.scenes.run import scene_calculation

    scene = parse_scene(tumble(moments=moments))
    request = scene_calculation(scene).request
    assert 0.0 < first_share(request) <= 0.05
    np.testing.assert_allclose(
        expected_steps(request), count_first_steps(request, 1.0), rtol=0.3
    )  # of a motion not quite regular


@pytest.mark.parametrize("range_", [("--range", "0:1GHz"), ()])
def test_a_spectrum_in_a_field_needs_two_levels(call, range_):
    """J = 0 alone has no line; without a range the edges of the spectrum were sought among none."""
    words = ["stark", "OCS", "--field", "20kV/cm", "--states", "J<=0", "--linewidth", "50MHz", "--spectrum", "o.csv"]
    code, _, err = call(*words, *range_)
    assert (code, err) == (2, "error: --states: no line joins two of the states up to J = 0; take a higher J\n")
    assert not Path("o.csv").exists()


@pytest.mark.parametrize("case", ["ocs", "hcn_quad", "two_state_coriolis"])  # named constants, spins, states
@pytest.mark.parametrize("temperature", ["0", "-3", "0.0"])
@pytest.mark.parametrize("basis", [(), ("--full-basis",), ("--as-spcat",)])
def test_an_int_file_has_a_temperature_above_0(call, case, temperature, basis):
    oracle = ORACLES / case
    Path("a.var").write_bytes((oracle / f"{case}.var").read_bytes())
    title, request, *rest = (oracle / f"{case}.int").read_text().split("\n")
    request = " ".join([*request.split()[:8], temperature])
    Path("a.int").write_text("\n".join([title, request, *rest]))
    code, _, err = call("spectrum", "a.int", *basis, "--cat", "x.cat")
    assert code == 2
    assert "TEMP" in err
    assert not Path("x.cat").exists()


def test_an_intensity_that_underflows_has_a_bound(call, folder):
    """At 1.8 mK the lines of CO from J = 1 on have exp(-3000) of the intensity of the first: no number on the screen is infinite."""
    code, out, _ = call(
        "spectrum", "CO", "--temperature", "0.0018K", "--min-lgint", "none", "--jmax", "3", "--csv", "a.csv"
    )
    assert code == 0
    assert "inf" not in out.split("in order of frequency")[1].split("sources")[0]
    assert out.count("<-300") == 2
    assert "inf" not in (folder / "a.csv").read_text(encoding="utf-8").split("frequency_mhz")[1]


def test_a_line_with_an_f_that_no_spins_make_is_named(call):
    """Spins of another molecule: no function of rotation and spins has some F of the lines. It ended in an IndexError."""
    oracle = ORACLES / "spcat"
    text = (oracle / "csf.par").read_text()
    assert "l  -28 " in text
    Path("csf.par").write_text(text.replace("l  -28 ", "l  -32 "))
    Path("csf.lin").write_bytes((oracle / "csf.lin").read_bytes())
    code, _, err = call("fit", "csf.par", "--iterations", "2", "--out", "o")
    assert code == 2
    line, level = re.fullmatch(
        r"error: csf.lin: line \d+, (.*) at .* there is no level (.*) \(n, f1, f\) in this model\n", err
    ).groups()
    assert level in line.split(" - ")  # the level that is named is one of the line's


def test_a_constant_that_no_line_determines_has_no_error(call):
    """A code of a state that does not exist: neither the table nor the files print an infinite error."""
    oracle = ORACLES / "fits"
    Path("co.par").write_text((oracle / "co.par").read_text().replace("             400 ", "             342 "))
    Path("co.lin").write_bytes((oracle / "co.lin").read_bytes())
    code, out, _ = call("fit", "co.par", "--iterations", "2", "--out", "o")
    assert code == 0
    assert "(not determined)" in out
    texts = [out, *(path.read_text() for path in Path().glob("o.*"))]
    assert not [text for text in texts if re.search(r"\binf\b", text, re.IGNORECASE)]


@pytest.mark.parametrize("options", [(), ("--full-basis",), ("--as-spcat",)])
@pytest.mark.parametrize("code", [115, 27115, 80109])
def test_a_dipole_along_a_fourth_axis_is_refused(call, options, code):
    """SYM of a dipole is 0 to 3: other digits ended in an IndexError."""
    oracle = next((ORACLES).rglob("moments_alone.int"))
    lines = oracle.read_text().split("\n")
    Path("a.int").write_text("\n".join([*lines[:5], f" {code} 0.3", *lines[6:]]))
    Path("a.var").write_bytes(oracle.with_suffix(".var").read_bytes())
    code_of_exit, _, err = call("spectrum", "a.int", *options, "--cat", "x.cat")
    assert code_of_exit == 2
    assert str(code) in err
    assert "defect" not in err
    assert not Path("x.cat").exists()


def test_a_line_of_a_large_depth_has_an_error_of_its_brightness(call):
    """exp of the optical depth ended in an OverflowError; of a line that is opaque in every component nothing is lost."""
    words = "emission HCN --range 80:98GHz --column 2e17 --excitation 20 --width 1 --json -"
    code, out, err = call(*words.split())
    assert code == 0, err
    left_out = json.loads(out)["errors"]["model"]
    assert "% of the depth split off" in left_out["from"]
    assert 0 < left_out["value"] < 1e-6


@pytest.mark.parametrize("energy", ["5e11", "-5e11"])
def test_a_state_far_from_zero_is_named(call, folder, energy):
    """Intensities were nan, or the exponential ended in an OverflowError."""
    Path("a.var").write_text(f"OCS\n 2 1 5 0 0 1e6 1 1\nl -1 1 0 0\n 100 6081.492 1e-3\n 0 {energy} 1e-3\n")
    Path("a.int").write_text("OCS\n 0 60503 1028.6 0 3 -9 -9 99 300\n 1 0.71519\n")
    code, _, err = call("spectrum", "a.int", "--csv", "x.csv")
    assert code == 2
    assert "error: a.int with a.var: the lowest level lies at" in err
    assert "give states energies near zero" in err
    assert not Path("x.csv").exists()


def test_a_quantum_number_of_a_table_has_a_bound(call, folder):
    head = "j_upper,j_lower,frequency_mhz,error_mhz\n"
    for text in ("999999999999999999991", "-999999999999999999991", "1e30"):
        Path("g.csv").write_text(f"{head}1,{text},12000,0.1\n")
        code, _, err = call("fit", "g.csv", "--constants", "B=6 GHz", "--free", "B")
        assert code == 2
        assert "g.csv, line 1 of the table: j_lower = " in err
