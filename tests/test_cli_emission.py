"""`rotor emission` keeps the contract of docs/command_line.md; its numbers against closed forms."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

import rotor

CONTRACT = Path(__file__).resolve().parents[1] / "docs" / "command_line.md"
H_OVER_K = 4.799243073e-5  # K per MHz
THIN = ("emission", "CO", "--range", "115:116GHz", "--column", "1e13", "--excitation", "20", "--width", "2")


def rayleigh_jeans(mhz: float, kelvin: float) -> float:
    return H_OVER_K * mhz / math.expm1(H_OVER_K * mhz / kelvin)


def test_a_thin_line_has_the_area_of_the_closed_form(call):
    """∫T_B dv = [J(T_ex) - J(T_bg)] c³ A g_u N / (8π ν³ Q) e^(-E_u/kT) (e^(hν/kT) - 1) (Mangum and Shirley 2015)."""
    code, out, err = call(*THIN, "--json", "-")
    assert (code, err) == (0, "")
    (line,) = json.loads(out)["lines"]
    mhz, q = line["frequency_mhz"], rotor.partition_function(rotor.read("CO"), 20.0).q
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
    assert content["peak_mhz"] == pytest.approx(
        line["observed_mhz"], abs=0.2
    )  # spacing of the grid: an eighth of 0.77 MHz


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
    assert "excitation 50 K" in text
    content = json.loads((tmp_path / "all.json").read_text(encoding="utf-8"))
    assert {line["molecule"] for line in content["lines"]} == {0, 1}
    rows = np.genfromtxt("p.csv", delimiter=",", names=True)
    assert rows["brightness_k"].max() == pytest.approx(content["peak_k"], rel=1e-12)  # text of 17 digits
    assert rows["frequency_mhz"][0] == pytest.approx(84e3)
    assert len(np.genfromtxt("l.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")) == content["line_count"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("CO",), "--range or --band: expected one of them"),
        (("CO", "--band", "ALMA99"), "--band: band 'ALMA99': known are ALMA1"),
        (("CO", "--band", "ALMA3", "--column", "1,2"), "--column: 2 given for 1 molecules"),
        (("CO", "--band", "ALMA3", "--column", "-1"), "--column"),
        (("CO", "--band", "ALMA3", "--width", "0"), "--width"),
        (("CO", "--band", "ALMA3", "--filling", "2"), "--filling = 2.0"),
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


def test_every_option_and_key_is_documented(call):
    part = CONTRACT.read_text(encoding="utf-8").split("## rotor emission")[1].split("## rotor raman")[0]
    out = call("emission", "--help")[1]
    options = set(re.findall(r"--[a-z][a-z-]+", out.split("Options:")[1].split("Examples:")[0])) - {"--help"}
    assert {option for option in options if f"`{option}" not in part} == set()
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
    assert "CH3OH: error of the geometry: about " in last  # the largest of what is known
