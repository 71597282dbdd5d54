"""`rotor raman`, and the gas in `rotor spectrum`: what docs/verbs/raman.md promises."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest

import rotor
from rotor.plots.show import write_picture
from rotor.spectra.raman.raman import raman_lines

KEYS = {
    "temperature_k", "laser_nm", "anisotropy_angstrom3", "band_cross_section_cm2_per_sr", "q", "jmax", "jmax_source",
    "min_relative", "line_count", "strongest", "lines", "files", "polarizability_abc_angstrom3", "polarizability_source",
}  # fmt: skip


def test_raman_of_nitrogen(call):
    code, out, err = call(
        "raman", "N2", "--laser", "488", "--top", "3", "--csv", "a.csv", "--plot", "a.png", "--json", "a.json"
    )
    assert (code, err) == (0, "")
    assert "nitrogen, N2: linear molecule" in out
    assert len([row for row in out.splitlines() if row.startswith(" ") and "e-31" in row]) == 3
    content = json.loads(Path("a.json").read_text(encoding="utf-8"))
    assert content.keys() >= KEYS
    assert content["files"] == ["a.csv", "a.png", "a.json"]
    assert content["band_cross_section_cm2_per_sr"] == pytest.approx(1.5443e-29, rel=1e-3, abs=0)
    with open("a.csv", encoding="utf-8") as handle:
        rows = list(csv.DictReader(handle))
    assert len(rows) == content["line_count"] == len(content["lines"])
    assert [float(row["shift_cm"]) for row in rows] == [line["shift_cm"] for line in content["lines"]]
    provenance = json.loads(Path("a.csv.provenance.json").read_text(encoding="utf-8"))
    assert provenance["laser_nm"] == 488.0
    assert "Bates" in provenance["polarizability_source"]
    assert Path("a.png").stat().st_size > 5000


def test_constants_and_polarizability_by_hand_are_the_library_s(call):
    _, out, _ = call("raman", "N2", "--json", "-")
    bare = (
        "--constants",
        "B=1.989581 D=5.76e-6 cm-1",
        "--polarizability",
        "2.2279,1.5304 Å3",
        "--spin-weights",
        "even=2,odd=1",
    )
    _, by_hand, err = call("raman", *bare, "--json", "-")
    assert err == ""
    ours, theirs = (json.loads(text)["lines"] for text in (out, by_hand))
    assert len(ours) == len(theirs)
    for a, b in zip(ours, theirs, strict=True):
        assert a == pytest.approx(b, rel=1e-9, abs=0)  # digits of the constants


@pytest.mark.parametrize(
    ("text", "tensor"),
    [("1,2,3", [[1, 0, 0], [0, 2, 0], [0, 0, 3]]), ("1,2,3,0.1,0.2,0.3", [[1, 0.1, 0.2], [0.1, 2, 0.3], [0.2, 0.3, 3]])],
)  # fmt: skip
def test_a_tensor_of_an_asymmetric_top(call, text, tensor):
    code, out, _ = call("raman", "propylene oxide", "--polarizability", text, "--jmax", "4", "--json", "-")
    assert code == 0
    assert json.loads(out)["polarizability_abc_angstrom3"] == tensor


def test_two_numbers_of_an_oblate_top_stand_along_c(call):
    _, out, _ = call("raman", "NH3", "--polarizability", "2.5,2.0", "--jmax", "3", "--json", "-")
    assert np.diag(json.loads(out)["polarizability_abc_angstrom3"]).tolist() == [2.0, 2.0, 2.5]


def test_no_lines_is_an_answer_and_a_picture_of_none_is_not(call):
    code, out, _ = call("raman", "CH4", "--csv", "a.csv")
    assert code == 0
    assert "isotropic" in out
    assert Path("a.csv").read_text(encoding="utf-8").count("\n") == 1
    code, _, err = call("raman", "CH4", "--plot", "a.png")
    assert code == 1
    assert err == "error: --plot: no lines: the polarizability of a rigid spherical top is isotropic\n"
    with pytest.raises(ValueError, match="no Raman line to draw"):
        write_picture(raman_lines(rotor.read("CH4"), jmax=3), "a.png")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("raman", "SO2"), "error: the polarizability is not known: give --polarizability"),
        (("raman", "SO2", "--polarizability", "2,1"), "error: --polarizability: '2,1': expected aa,bb,cc or"),
        (("raman", "N2", "--polarizability", "2 D,1 D"), "error: --polarizability: '2 D,1 D': unit 'D' does not measure"),
        (("raman", "N2", "--laser", "0.532"), "error: --laser: 0.532: expected a finite number above 50 nm"),
        (("raman", "N2", "--laser", "532 K"), "error: --laser: '532 K': unit 'K'"),
        (("raman", "N2", "--min-relative", "2"), "error: --min-relative: 2: expected a number between 0 and 1"),
        (("raman", "N2", "--jmax", "-1"), "error: --jmax: -1: expected a whole number of 0 or more"),
        (("raman", "N2", "--csv", "a.txt"), "error: --csv a.txt: the name must end in .csv"),
        (("raman",), "error: expected either a source or --constants"),
        (("raman", "N2", "--vibration", "2330", "--vibrational-states", "2330"), "error: --vibration and --vibrational-states: give"),
        (("spectrum", "CO", "--vibration", "x"), "error: --vibration: 'x': expected energies such as"),
        (("spectrum", "CO", "--vibration", "2143", "--vibrational-factor", "2"), "error: --vibrational-factor and vibrational energies"),
        (("spectrum", "CO", "--pressure", "1"), "error: --pressure and --path: an optical depth needs both"),
        (("spectrum", "CO", "--pressure", "1", "--path", "1 K"), "error: --path: '1 K': unit 'K'"),
        (("spectrum", "CO", "--pressure", "1", "--path", "1", "--profile", "sticks"), "error: --profile: an optical depth needs a width"),
    ],
)  # fmt: skip
def test_mistakes_are_one_line_and_write_nothing(call, arguments, said):
    code, out, err = call(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith(said)
    assert err.count("\n") == 1
    assert list(Path().iterdir()) == []


def test_vibration_of_a_spectrum(call):
    results = []
    for option in ((), ("--vibration", "712x2,2097,3311 cm-1"), ("--vibrational-states", "712x2")):
        _, out, _ = call("spectrum", "HCN", *option, "--jmax", "5", "--json", "-")
        results.append(json.loads(out)["q"]["q"])
    occupied = math.exp(-712 * 1.438776877 / 300)
    assert results[2] / results[0] == pytest.approx(1 + 2 * occupied, rel=1e-9)  # digits of hc/k
    assert results[1] / results[0] == pytest.approx((1 - occupied) ** -2, rel=5e-5)  # ν1 and ν3 add 4e-5


def test_a_layer_of_gas(call):
    code, out, _ = call(
        "spectrum", "CO", "--pressure", "1 mbar", "--path", "1 m", "--json", "a.json", "--profile-csv", "p.csv", "--plot", "p.svg",
    )  # fmt: skip
    assert code == 0
    assert "0.001 bar, 100 cm: 2.41432e+18 molecules/cm²" in " ".join(out.split())
    content = json.loads(Path("a.json").read_text(encoding="utf-8"))
    assert content["profile"] == "gaussian"
    assert content["optical_depth"][0] == pytest.approx(0.8194, abs=1e-4)  # test_opacity.py has the calculation
    assert len(content["optical_depth"]) == len(content["lines"])
    with open("p.csv", encoding="utf-8") as handle:
        rows = list(csv.DictReader(handle))
    assert list(rows[0]) == ["frequency_mhz", "optical_depth"]
    assert max(float(row["optical_depth"]) for row in rows) == pytest.approx(max(content["optical_depth"]), rel=1e-9)
    assert "Optical depth" in Path("p.svg").read_text(encoding="utf-8")
    assert json.loads(call("spectrum", "CO", "--json", "-")[1])["optical_depth"] is None
