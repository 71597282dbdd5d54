"""`rotor emission` keeps the contract of docs/verbs/emission.md; its numbers against closed forms."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from documented_options import undocumented
from places import PROJECT

import rotor

DOCS = PROJECT / "docs"
H_OVER_K = 4.799243073e-5  # K per MHz
THIN = ("emission", "CO", "--range", "115:116GHz", "--column", "1e13", "--excitation", "20", "--width", "2")


def rayleigh_jeans(mhz: float, kelvin: float) -> float:
    return H_OVER_K * mhz / math.expm1(H_OVER_K * mhz / kelvin)


def test_a_thin_line_has_the_area_of_the_closed_form(call):
    """∫T_B dv = [J(T_ex) - J(T_bg)] c³ A g_u N / (8π ν³ Q) e^(-E_u/kT) (e^(hν/kT) - 1) (Mangum and Shirley 2015)."""
    code, out, err = call(*THIN, "--json", "-")
    assert (code, err) == (0, "")
    (line,) = json.loads(out)["lines"]
    mhz, q = line["frequency_mhz"], rotor.api.partition_function(rotor.read("CO"), 20.0).q
    photon = H_OVER_K * mhz / 20.0
    depth_m_per_s = (
        2.99792458e8**3 / (8 * math.pi * (mhz * 1e6) ** 3) * line["einstein_a_per_s"] * line["g_upper"] * 1e17 / q
    )
    depth_m_per_s *= math.exp(-line["energy_upper_k"] / 20.0) * math.expm1(photon)
    expected = (rayleigh_jeans(mhz, 20.0) - rayleigh_jeans(mhz, 2.725)) * depth_m_per_s / 1e3
    assert line["integrated_k_km_s"] == pytest.approx(expected, rel=2e-4)  # τ = 2e-4: saturation by half of it
    assert line["energy_upper_k"] == pytest.approx(5.532, abs=5e-4)  # of CO, J = 1, to the digits given


def test_a_thick_line_reaches_the_contrast_and_the_beam_dilutes_it(call):
    thick = (*THIN[:5], "1e21", *THIN[6:])
    line = json.loads(call(*thick, "--filling", "0.5", "--background", "5", "--json", "-")[1])["lines"][0]
    contrast = rayleigh_jeans(line["frequency_mhz"], 20.0) - rayleigh_jeans(line["frequency_mhz"], 5.0)
    assert line["brightness_k"] == pytest.approx(0.5 * contrast, rel=1e-8)  # digits of h/k above


def test_a_receding_source_is_seen_lower(call):
    content = json.loads(call(*THIN, "--velocity", "100", "--json", "-")[1])
    line = content["lines"][0]
    assert line["observed_mhz"] == pytest.approx(line["frequency_mhz"] * (1 - 100 / 299792.458), rel=1e-14)  # round-off
    assert content["peak_mhz"] == line["observed_mhz"]
    assert content["peak_k"] == pytest.approx(line["brightness_k"], rel=1e-12)  # a single line


def test_each_molecule_has_its_own_temperature_width_and_velocity(call):
    code, out, err = call(
        "emission", "CO", "CO", "--range", "115.2:115.3GHz", "--column", "1e15,2e15", "--excitation", "10,40",
        "--width", "1,5", "--velocity", "0,20", "--json", "-",
    )  # fmt: skip
    assert (code, err) == (0, "")
    content = json.loads(out)
    cold, warm = content["molecules"]
    assert (cold["excitation_k"], warm["excitation_k"]) == (10.0, 40.0)
    assert (cold["fwhm_km_s"], warm["fwhm_km_s"], warm["velocity_km_s"]) == (1.0, 5.0, 20.0)
    for gas, name in ((cold, "carbon monoxide"), (warm, "carbon monoxide (2)")):
        options = [("--column", "column_per_cm2"), ("--excitation", "excitation_k"), ("--width", "fwhm_km_s")]
        by_itself = call(
            "emission", "CO", "--range", "115.2:115.3GHz", "--velocity", str(gas["velocity_km_s"]), "--json", "-",
            *(text for option, key in options for text in (option, str(gas[key]))),
        )[1]  # fmt: skip
        (alone,) = json.loads(by_itself)["lines"]
        (line,) = (line for line in content["lines"] if line["molecule"] == name)
        assert alone | {"molecule": name} == line


def test_the_redshift_and_the_convention_of_velocities_are_said(call):
    _, out, _ = call("emission", "CO", "--range", "34:36GHz", "--column", "1e21", "--redshift", "2.3", "--width", "300")
    assert "redshift 2.3" in out
    assert "radio convention, v = c (1 - ν/ν_rest)" in out
    assert "34930.6673" in out  # 115271.2021/3.3


def test_a_catalogue_is_a_source_like_the_molecule_it_was_made_from(call, tmp_path):
    call("spectrum", "HC3N", "--jmax", "120", "--min-lgint", "none", "--no-hyperfine", "--cat", "hc3n.cat")
    same = ("--range", "84:116GHz", "--column", "1e15", "--excitation", "30", "--width", "2", "--json", "-")
    computed = json.loads(call("emission", "HC3N", "--no-hyperfine", *same)[1])
    code, out, err = call("emission", "hc3n.cat", *same)
    assert code == 0
    assert "Q summed over the 121 levels of the catalogue's lines" in err
    listed = json.loads(out)
    assert listed["molecules"][0]["q"] == pytest.approx(computed["molecules"][0]["q"], rel=3e-6)  # ELO has 4 decimals
    assert len(listed["lines"]) == len(computed["lines"]) == 3
    for mine, theirs in zip(listed["lines"], computed["lines"], strict=True):
        for key, rel in (
            ("frequency_mhz", 1e-9),
            ("optical_depth", 3e-4),
            ("brightness_k", 3e-4),
            ("einstein_a_per_s", 3e-4),
        ):
            assert mine[key] == pytest.approx(theirs[key], rel=rel)  # LGINT has 4 decimals
        assert (mine["upper"], mine["g_upper"]) == (theirs["upper"], theirs["g_upper"])
    content = json.loads(call("emission", "hc3n.cat", "--partition", "300=1374.1,30=137.7", *same)[1])
    assert content["molecules"][0]["q"] == pytest.approx(137.7, rel=1e-12)
    (tmp_path / "catdir.cat").write_text("     0 HC3N 1 3.1380 3.0130 2.8368 2.5360 2.2353 1.9349 1.6350 1\n")
    code, out, err = call("emission", "hc3n.cat", "--partition", "catdir.cat", *same)
    assert (code, err) == (0, "")
    assert json.loads(out)["molecules"][0]["q_source"] == "JPL catdir"


def test_a_scene_holds_each_molecule_with_what_is_its_own(call, tmp_path):
    call("spectrum", "CO", "--jmax", "40", "--cat", "co.cat")
    order = ("emission", "co.cat", "CO", "--range", "114:116GHz", "--column", "1e15,1e14", "--width", "2,3",
             "--partition", "300=108.9,20=7.57,10=3.97", "--excitation", "20,10", "--redshift", "0.001")  # fmt: skip
    code, _out, err = call(*order, "--csv", "verb.csv", "--save-scene", "s.toml")
    assert (code, err) == (0, "")
    (tmp_path / "again").mkdir()
    assert call("run", "s.toml", "--out", "again")[0] == 0
    scene = (tmp_path / "again" / "verb.csv").read_text(encoding="utf-8")
    assert scene == (tmp_path / "verb.csv").read_text(encoding="utf-8")
    assert scene.count("\n") == 3


def test_several_molecules_add_their_depths(call, tmp_path):
    code, _, err = call(
        "emission",
        "CO",
        "13CO.toml",
        "--range",
        "110:116GHz",
        "--column",
        "1e17,2e16",
        "--excitation",
        "15",
        "--width",
        "3",
    )
    assert code == 2  # no such file
    assert err.count("\n") == 1
    both = ("emission", "HCN", "HC3N", "--band", "ALMA3", "--column", "1e14,1e15", "--excitation", "50", "--width", "4")
    code, out, err = call(*both, "--plot", "b.svg", "--profile-csv", "p.csv", "--csv", "l.csv", "--json", "all.json")
    assert (code, err) == (0, "")
    assert "hydrogen cyanide, cyanoacetylene: brightness temperature" in out
    text = (tmp_path / "b.svg").read_text(encoding="utf-8")
    assert "together" in text
    assert "Excitation 50 K" in text
    content = json.loads((tmp_path / "all.json").read_text(encoding="utf-8"))
    assert {line["molecule"] for line in content["lines"]} == {"hydrogen cyanide", "cyanoacetylene"}
    assert {row.split(",")[0] for row in (tmp_path / "l.csv").read_text(encoding="utf-8").splitlines()[1:]} == {
        "hydrogen cyanide", "cyanoacetylene",
    }  # fmt: skip
    rows = np.genfromtxt("p.csv", delimiter=",", names=True)
    assert (
        0.98 < rows["brightness_k"].max() / content["peak_k"] <= 1
    )  # a grid of eight points to a width misses a centre
    assert content["peak_mhz"] in [line["observed_mhz"] for line in content["lines"]]
    assert f"{content['peak_k']:.4g} K at {content['peak_mhz']:.4f} MHz, {content['peak_molecule']}" in out
    assert rows["frequency_mhz"][0] == pytest.approx(84e3)
    assert len(np.genfromtxt("l.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")) == content["line_count"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("CO",), "--range: expected a range or a band"),
        (("CO", "--band", "ALMA99"), "--band: band 'ALMA99': known are ALMA1"),
        (("CO", "--band", "ALMA3", "--column", "1,2"), "--column: 1,2: 2 numbers for 1 molecule;"),
        (("CO", "HCN", "--band", "ALMA3", "--excitation", "1,2,3"), "--excitation: 1,2,3: 3 numbers for 2 molecules;"),
        (("CO", "--band", "ALMA3", "--redshift", "-2"), "--redshift: -2: expected a finite number above -1"),
        (("CO", "--band", "ALMA3", "--partition", "300=100"), "--partition: needs a .cat file among the molecules"),
        (("none.cat", "--band", "ALMA3"), "none.cat: no such file"),
        (("CO", "--band", "ALMA3", "--column", "-1"), "--column"),
        (("CO", "--band", "ALMA3", "--width", "0"), "--width"),
        (("CO", "--band", "ALMA3", "--filling", "2"), "--filling: 2: expected a number above 0 and up to 1"),
        (("CO", "--band", "ALMA3", "--velocity", "1e9"), "--velocity"),
        (("CO", "HCN", "--band", "ALMA3", "--isotope", "C=13C"), "--isotope: expected with a single molecule"),
        (("CO", "--range", "1:2000000GHz"), "choose a narrower range"),
        ((), "SOURCE"),
    ],
)
def test_wrong_input_is_one_line(call, folder, arguments, said):
    code, out, err = call("emission", *arguments, "--csv", "a.csv")
    assert (code, out) == (2, "")
    assert said in err
    assert err.count("\n") == 1
    assert list(folder.iterdir()) == []


def test_frequencies_of_a_geometry_are_noted(call):
    """Methanol of the g2 set, 2 % off; not carbon monoxide, which was measured."""
    noted = call("emission", "CH3OH", "--range", "90:100GHz", "--excitation", "50")[2]
    assert "constants are from a geometry with an error of 2 %, frequencies have this error" in noted
    assert call("emission", "CO", "--band", "ALMA3")[2] == ""


@pytest.mark.parametrize(("typed", "hint"), [("115:116", True), ("115:116MHz", False)])
def test_a_range_without_a_unit_is_pointed_out_where_no_line_is_inside(call, typed, hint):
    code, out, _ = call("emission", "CO", "--range", typed)
    assert code == 0
    assert "no lines" in out
    assert ("--range 115:116 has no unit and is taken as MHz: write 115:116GHz for GHz" in out) == hint


def test_every_option_and_key_is_documented(call):
    part = (DOCS / "verbs" / "emission.md").read_text(encoding="utf-8")
    assert undocumented("emission", call("emission", "--help-all")[1]) == set()
    content = json.loads(call(*THIN, "--json", "-")[1])
    for key in (*content, *content["lines"][0], *content["source"], *content["molecules"][0]):
        assert f"`{key}`" in part, key


def test_the_report_ends_with_what_is_left_out_of_each_molecule(call):
    _, out, _ = call(
        "emission", "NH3", "CH3OH", "--range", "23:25GHz", "--excitation", "20", "--width", "5", "--top", "0"
    )
    last = " ".join(out.partition("left out")[2].split())
    assert "structure of the source in the beam" in last
    assert "inversion" not in last  # both states of ammonia are in the list
    assert "CH3OH: internal rotation: about " in last  # the largest of what is known


def test_components_of_one_species_have_names_of_their_own_in_the_legend():
    answer = rotor.emission(["CO", "CO"], range_mhz="115:116GHz", excitation_k=[10.0, 50.0])
    legend = answer.plot().axes[0].figure.legends or [answer.plot().axes[0].get_legend()]
    names = [text.get_text() for text in legend[0].get_texts()]
    assert names == ["together", "carbon monoxide, CO", "carbon monoxide, CO (2)"]


def test_molecules_without_a_dipole_are_said_to_emit_nothing(call):
    code, shown, _ = call("emission", "N2", "--band", "ALMA3")
    assert (code, "no lines: a molecule without a dipole moment emits none" in shown) == (0, True)
    _, shown, _ = call("emission", "N2", "CO", "--band", "ALMA3")
    assert " ".join(shown.split()).count("no dipole moment, no lines") == 1
    assert "carbon monoxide" in shown.split("brightest")[1]
