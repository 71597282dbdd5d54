"""`--hyperfine` and the options that belong to it, in every verb that has spins."""

from __future__ import annotations

import json

import numpy as np
import pytest

ROD = ("--constants", "B=44.316 GHz", "--polarizability", "3.9,2.0", "--temperature", "5")
CHI = ("--spin-constants", "chi_aa(14N)=-4.7 MHz")
STATES = ("--constants", "A=50 B=44 C=40 GHz", "--state-constants", "E[1]=100 A[1]=49 B[1]=44 C[1]=39 GHz")
PAIR = (
    "--constants", "A=30 B=20 C=15 GHz", "--spin-weights", "ee=1,eo=3,oe=3,oo=1", "--spins", "14N_1+14N_2", "--spin-constants",
    "chi_aa(14N_1)=1 chi_aa(14N_2)=1", "--temperature", "5",
)  # fmt: skip
SPLIT = "88.62:88.64GHz"


def content(call, *words: str) -> dict:
    code, out, _ = call(*words, "--json", "-")
    assert code == 0
    return json.loads(out)


def test_levels_by_the_cheapest_method(call):
    words = ("levels", "formamide", "--jmax", "2", "--hyperfine")
    exact = content(call, *words)
    cheap = content(call, *words, "--hyperfine-method", "auto", "--hyperfine-tolerance", "1 MHz")
    assert (exact["hyperfine"]["method"], cheap["hyperfine"]["method"]) == ("exact", "first-order")
    energies = [sorted(level["energy_mhz"] for level in each["levels"]) for each in (exact, cheap)]
    apart = [abs(a - b) for a, b in zip(*energies, strict=True)]
    assert 0 < max(apart) < cheap["hyperfine"]["estimate_mhz"] < 1.0


def test_emission_of_components_adds_up_to_the_line_without_spins(call):
    """Integrals of thin lines: Σ over F is the line without spins, at the mean of its components."""
    words = ("emission", "HCN", "--range", SPLIT, "--column", "1e10", "--excitation", "10")
    whole, split = content(call, *words), content(call, *words, "--hyperfine")
    (line,), parts = whole["lines"], split["lines"]
    assert [part["upper"] for part in parts] == ["1 1", "1 2", "1 0"]
    assert sum(part["integrated_k_km_s"] for part in parts) == pytest.approx(
        line["integrated_k_km_s"], rel=1e-3
    )  # 1.5 MHz of ν
    assert split["molecules"][0]["q"] == pytest.approx(3 * whole["molecules"][0]["q"], rel=1e-9)  # the factor 2I+1
    mean = np.average([part["frequency_mhz"] for part in parts], weights=[part["optical_depth"] for part in parts])
    assert mean == pytest.approx(line["frequency_mhz"], abs=0.05)  # MHz: spin-rotation and second order
    assert split["molecules"][0]["hyperfine"]["method"] == "exact"
    assert whole["molecules"][0]["hyperfine"] is None


def test_emission_of_several_molecules_splits_those_with_spins(call):
    code, out, err = call("emission", "CO", "HCN", "--range", "88:116GHz", "--hyperfine")
    assert code == 0
    assert "no constants of spins are known of carbon monoxide" in err
    assert "upper, lower: J\n" in out
    assert "upper, lower: N F\n" in out


def test_raman_lines_with_spins(call):
    whole, split = content(call, "raman", *ROD), content(call, "raman", *ROD, *CHI)
    assert split["band_cross_section_cm2_per_sr"] == pytest.approx(
        whole["band_cross_section_cm2_per_sr"], rel=1e-4
    )  # the cut
    assert split["q"]["q"] == pytest.approx(3 * whole["q"]["q"], rel=1e-9)
    assert split["q"]["classical"] == pytest.approx(3 * whole["q"]["classical"], rel=1e-12)
    assert content(call, "raman", *ROD, *CHI, "--no-hyperfine")["lines"] == whole["lines"]


def test_thermo_counts_the_functions_of_spins(call):
    words = ("thermo", "HCN", "--temperature", "1,300")
    whole, split = content(call, *words), content(call, *words, "--hyperfine")
    for function, many in zip(whole["functions"], split["functions"], strict=True):
        assert many["q_rot"] == pytest.approx(3 * function["q_rot"], rel=1e-6)  # δ/kT = 2e-4 at 1 K, its square
        assert many["cv_over_r"] == pytest.approx(function["cv_over_r"], rel=1e-6)
    assert split["hyperfine"]["spin_functions"] == 3
    assert split["spin_factor"] == pytest.approx(3 * whole["spin_factor"])
    assert "Q counts 3 functions of the spins" in call(*words, "--hyperfine")[1]


@pytest.mark.parametrize(
    "words",
    [
        ("emission", "HCN", "--range", SPLIT, "--hyperfine"),
        ("raman", *ROD, *CHI, "--hyperfine-method", "auto", "--hyperfine-tolerance", "1 MHz"),
        ("levels", *STATES, "--jmax", "2"),
        ("thermo", "HCN", "--hyperfine", "--hyperfine-method", "first-order", "--temperature", "0.01,1,300"),
    ],
)
def test_a_saved_scene_gives_the_same(call, tmp_path, words):
    scene, first, second = (tmp_path / name for name in ("s.toml", "a.csv", "b.csv"))
    assert call(*words, "--csv", str(first), "--save-scene", str(scene))[0] == 0
    text = scene.read_text(encoding="utf-8").replace("a.csv", "b.csv")
    scene.write_text(text, encoding="utf-8")
    assert call("run", str(scene), "--out", str(tmp_path))[0] == 0
    plain = [path.read_text(encoding="utf-8").splitlines() for path in (first, second)]
    assert [[row for row in rows if not row.startswith("#")] for rows in plain[:1]] == [
        [row for row in rows if not row.startswith("#")] for rows in plain[1:]
    ]


REFUSED = [
    (("levels", "CO", "--hyperfine"), "no constants of spins are known"),
    (("levels", "formamide", "--hyperfine-method", "auto"), "without hyperfine or constants of spins nothing is split"),
    (("levels", "formamide", "--hyperfine", "--hyperfine-method", "exakt"), "--hyperfine-method: 'exakt': expected one of"),
    (("levels", "formamide", "--hyperfine", "--hyperfine-tolerance", "0"), "--hyperfine-tolerance"),
    (("levels", "formamide", "--hyperfine", "--hyperfine-tolerance", "1 K s"), "--hyperfine-tolerance"),
    (("emission", "CO", "--range", SPLIT, "--hyperfine"), "no constants of spins are known"),
    (("emission", "CO", "HCN", "--range", SPLIT, *CHI), "--spin-constants: expected with a single molecule"),
    (("emission", "HCN", "--range", SPLIT, "--hyperfine-method", "auto"), "nothing is split"),
    (("emission", "HCN", "--range", SPLIT, "--spins", "14N=1"), "--spins: states the sizes of the spins"),
    (("emission", "HCN", "--range", SPLIT, "--spin-constants", "chi_aa(14N)"), "--spin-constants"),
    (("thermo", "CO", "--hyperfine"), "no constants of spins are known"),
    (("thermo", "HCN", "--hyperfine-method", "auto"), "nothing is split"),
    (("thermo", "HCN", "--hyperfine", "--hyperfine-method", "1"), "--hyperfine-method: '1': expected one of"),
    (("thermo", "HCN", "--hyperfine", "--hyperfine-tolerance", "nan"), "--hyperfine-tolerance"),
    (("thermo", *PAIR, "--species", "ortho"), "--species: 'ortho': with nuclei that are coupled to a total spin"),
    (("raman", "CO2", "--hyperfine"), "no constants of spins are known"),
    (("raman", "CO2", "--hyperfine-method", "first-order"), "nothing is split"),
    (("raman", *ROD, "--spin-constants", "chi_aa(12C)=1"), "12C"),
    (("raman", *ROD, *CHI, "--hyperfine-method", "none"), "expected one of auto, exact"),
    (("raman", *ROD, *CHI, "--hyperfine-tolerance", "-1"), "--hyperfine-tolerance"),
]  # fmt: skip


@pytest.mark.parametrize(("words", "why"), REFUSED)
def test_wrong_input_is_one_line_and_exit_code_2(call, words, why):
    code, out, err = call(*words)
    assert (code, out) == (2, "")
    (line,) = [row for row in err.splitlines() if not row.startswith("note:")]
    assert line.startswith("error: ")
    assert why in line


def test_isotopologues_have_the_constants_of_spins_that_their_nuclei_have(call):
    """Of bare geometry and given constants: 14N stays, turned with the axes; 15N has no quadrupole moment."""
    words = ("isotopologues", "HCN", "--spin-constants", "chi_aa(14N)=-4.7 MHz", "--each", "C=13C", "--each", "N=15N")
    computed = {
        isotopologue["substituted"].popitem()[1]: isotopologue["spin_constants_mhz"]
        for isotopologue in content(call, *words)["isotopologues"]
    }
    assert computed["13C"] == pytest.approx({"chi_aa(14N)": -4.7}, rel=1e-12)  # rounding: the axis stays
    assert computed["15N"] is None
    printed = call("isotopologues", "HCN", "--each", "C=13C")[1]
    assert "spin constants (MHz)" in printed
    assert "chi_aa(14N)" in printed


@pytest.mark.parametrize("verb", ["gas", "tumble"])
@pytest.mark.parametrize("option", ["--spin-constants", "--spins"])
def test_classical_verbs_have_no_options_of_spins(call, verb, option):
    code, _, err = call(verb, "HCN", option, "chi_aa(14N)=-4.7 MHz")
    assert code == 2
    assert f"No such option: {option}" in err
