"""Constants of spins by name, in text, in a top, and in a spectrum."""

from __future__ import annotations

import json

import numpy as np
import pytest
from places import ORACLES

from rotor.cli import run
from rotor.formats.molecules.molecule_file import parse_molecule_file
from rotor.quantum.effects.of_top import effects_of, spin_effects
from rotor.quantum.solve import solve_levels
from rotor.spectra.lines import line_list
from rotor.spectra.request import SpectrumRequest, answer_spectrum
from rotor.thermodynamics.sums.partition import partition_function
from rotor.thermodynamics.sums.spin_factor import rotational_sum
from rotor.tops.constants.constants import Constants
from rotor.tops.spins.spin_constants import SpinConstants, parse_spins, spin_names, twice_spin
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.top import Top

CHI = -4.7
NITRILE = Top.from_constants(
    "B=44315.975 D=0.0872 MHz",
    dipole_abc_debye=(2.985, 0, 0),
    spin_constants=SpinConstants.parse(f"chi_aa(14N)={CHI} MHz"),
)


def test_text_becomes_values_and_spins():
    constants = SpinConstants.parse("chi_aa(35Cl_1)=-57.1 chi_aa(35Cl_2)=33.5 C_bb(D)=1.2e-3 MHz")
    assert dict(constants.twice) == {"35Cl_1": 3, "35Cl_2": 3, "D": 2}
    assert constants.values["chi_aa(35Cl_2)"] == 33.5
    mixed = SpinConstants.parse("eps_aa(S)=500kHz b_F(S,14N)=12.5 MHz", "S=1/2 14N=1")
    assert dict(mixed.values) == {"eps_aa(S)": 0.5, "b_F(S,14N)": 12.5}
    assert list(mixed.twice.items()) == [("S", 1), ("14N", 2)]
    assert spin_names("b_F(S,14N)") == ("S", "14N")
    assert (twice_spin("2H"), parse_spins("I=3/2")) == (2, {"I": 3})


@pytest.mark.parametrize(
    ("text", "spins", "says"),
    [
        ("chi_aa=5 MHz", None, "expected constants such as"),
        ("chi_aa(14N)=5 rubbish", None, "unit|expected"),
        ("chi_aa(14N)=5 chi_aa(14N)=6", None, "given twice"),
        ("chi_aa(X)=5", None, "give its size"),
        ("chi_aa(12C)=5", None, "splits nothing"),
        ("chi_aa(14N)=5", "14N=0.3", "expected spins such as"),
        ("chi_aa(14N)=5 GHK", None, "GHK"),
    ],
)
def test_impossible_text_is_refused(text, spins, says):
    with pytest.raises(ValueError, match=says):
        SpinConstants.parse(text, spins)


@pytest.mark.parametrize(
    ("text", "spins", "says"),
    [
        ("eps_aa=-500 eps_bb=-4 MHz", "S=1/2", r"eps_aa needs its spin or spins in round brackets"),
        ("chi_aa(14N)=2", "14N=3/2", r"spin 14N = 3/2: the isotope has 1"),
    ],
)
def test_a_mistake_is_named_with_what_to_do(text, spins, says):
    with pytest.raises(ValueError, match=says):
        SpinConstants.parse(text, spins)


def test_a_difference_may_be_spelled():
    assert SpinConstants.parse("chi_bb_minus_cc(14N)=1.5 chi_aa(14N)=2").values["chi_bb-cc(14N)"] == 1.5


def test_first_order_pattern_of_a_linear_molecule():
    """J = 1: F = 0, 1, 2 at eQq (½, -¼, 1/20) from the centre to first order (Casimir's function of I = 1)."""
    lines = line_list(NITRILE, jmax=1, temperature_k=30.0, effects=effects_of(NITRILE, True), min_lgint=None)
    centre = 2 * 44315.975 - 4 * 0.0872
    assert "f" not in lines.levels.halves
    upper = lines.levels.quanta["f"][lines.upper]
    at_n1 = np.abs(lines.frequency_mhz - centre) < 100
    by_name = dict(zip(upper[at_n1].tolist(), (lines.frequency_mhz - centre)[at_n1], strict=True))
    assert set(by_name) == {0, 1, 2}
    for f, shift in by_name.items():
        assert shift == pytest.approx(_casimir(f), abs=2e-3), f  # second order is about χ²/B


def _casimir(f: int) -> float:
    """eQq Y(J=1, I=1, F) with E = -eQq Y, Y = [¾C(C+1) - I(I+1)J(J+1)]/[2(2J-1)(2J+3)I(2I-1)]."""
    c = f * (f + 1) - 4
    return -CHI * (0.75 * c * (c + 1) - 4) / (2 * 1 * 5 * 1 * 1)


def test_strengths_and_q_of_a_pattern_add_up_to_the_line_without_spins():
    with_spins = line_list(NITRILE, jmax=3, temperature_k=30.0, effects=effects_of(NITRILE, True), min_lgint=None)
    plain = line_list(NITRILE, jmax=3, temperature_k=30.0, min_lgint=None)
    assert with_spins.q == pytest.approx(3 * plain.q, rel=1e-9)  # second order: J = 0 is 5e-4 MHz lower
    n = with_spins.levels.quanta["n"]
    allowed = np.abs(n[with_spins.upper] - n[with_spins.lower]) == 1
    for row in range(len(plain)):
        near = allowed & (np.abs(with_spins.frequency_mhz - plain.frequency_mhz[row]) < 20)
        assert with_spins.strength_debye2[near].sum() == pytest.approx(
            3 * plain.strength_debye2[row], rel=1e-6
        )  # χ²/B²
        assert with_spins.intensity_nm2_mhz[near].sum() == pytest.approx(plain.intensity_nm2_mhz[row], rel=1e-4)  # δ/kT


def test_the_factor_of_spins_is_that_of_the_sum_over_all_levels():
    effects = effects_of(NITRILE, True)
    rest, factor = rotational_sum(NITRILE, effects)[:2]
    assert (len(rest), factor) == (2, 3)
    from rotor.quantum.solve import solve_levels

    levels = solve_levels(NITRILE, 30, effects=effects)
    kelvin = levels.energy_mhz * 4.799243073e-5
    inside = levels.quanta["n"] <= 29
    by_hand = float((levels.degeneracy * np.exp(-kelvin / 20.0))[inside].sum())
    assert partition_function(NITRILE, 20.0, effects=effects).q == pytest.approx(by_hand, rel=1e-6)


def test_like_nuclei_in_the_weights_are_refused():
    chlorines = SpinConstants.parse("chi_aa(35Cl_1)=-57 chi_aa(35Cl_2)=-57 MHz")
    weights = SpinWeights.from_mapping({"ee": 3, "eo": 5, "oe": 5, "oo": 3})
    top = Top.from_constants("A=9 B=3 C=2 GHz", spin_weights=weights, spin_constants=chlorines)
    with pytest.raises(ValueError, match="count their exchange already"):
        spin_effects(top)


def test_names_that_no_effect_knows_are_refused():
    top = Top.from_constants("B=9 GHz", spin_constants=SpinConstants.parse("magic(14N)=1"))
    with pytest.raises(ValueError, match="known constants of spins are chi_aa"):
        spin_effects(top)
    with pytest.raises(ValueError, match="no constants of spins are known"):
        effects_of(Top.from_constants("B=9 GHz"), True)


COMMAND = ["spectrum", "--constants", "B=44315.975 MHz", "--dipole-abc", "2.985,0,0", "--jmax", "2"]


def test_command_splits_lines(capsys):
    assert run([*COMMAND, "--spin-constants", "chi_aa(14N)=-4.709 MHz"]) == 0
    assert "states: N F" in capsys.readouterr().out
    assert run([*COMMAND, "--spin-constants", "chi_aa(14N)=-4.709 MHz", "--no-hyperfine"]) == 0
    assert "states: J)" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (["--hyperfine"], "no constants of spins are known"),
        (["--spins", "14N=1"], "give those too"),
        (["--spin-constants", "chi_aa(14N)=x"], "--spin-constants"),
        (["--spin-constants", "chi_zz(14N)=1"], "known constants of spins|form"),
    ],
)
def test_command_refuses(more, says, capsys):
    import re

    assert run([*COMMAND, *more]) == 2
    error = capsys.readouterr().err
    assert re.search(says, error)
    assert error.count("\n") == 1


def test_a_unit_at_one_constant_does_not_serve_the_others():
    with pytest.raises(
        ValueError,
        match=r"the unit kHz belongs to C_bb\(14N\) only; put a space before it to apply it to chi_aa\(14N\) too",
    ):
        SpinConstants.parse("chi_aa(14N)=-4.22 C_bb(14N)=1.8kHz")
    assert SpinConstants.parse("chi_aa(14N)=-4.22 C_bb(14N)=1.8 MHz").values["C_bb(14N)"] == 1.8


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("chi_bb-cc(14N)=2 MHz", r"chi_bb-cc\(14N\) = 2 MHz: a linear molecule has none"),
        ("chi_aa(14N)=2 chi_ab(14N)=1 MHz", r"chi_ab\(14N\) = 1 MHz: a linear molecule has none"),
        (
            "C_bb(1H)=2 MHz",
            r"C_bb\(1H\) = 2 MHz and C_cc\(1H\) = 0 MHz: alike in a linear molecule; .* C_iso\(1H\) alone",
        ),
        ("C_bb(1H)=2 C_cc(1H)=1 MHz", "alike in a linear molecule"),
    ],
)
def test_tensors_that_a_linear_molecule_cannot_have_are_refused(text, says):
    top = Top.from_constants("B=9400 MHz", spin_constants=SpinConstants.parse(text))
    with pytest.raises(ValueError, match=says):
        effects_of(top, True)


def test_perpendicular_spin_rotation_of_a_linear_molecule_is_the_scalar():
    """N has no component along the axis."""
    texts = ("C_bb(1H)=2 C_cc(1H)=2 MHz", "C_iso(1H)=2 MHz")
    tops = [Top.from_constants("B=9400 MHz", spin_constants=SpinConstants.parse(text)) for text in texts]
    computed = [solve_levels(top, 2, effects=effects_of(top, True)).energy_mhz for top in tops]
    assert computed[0] == pytest.approx(computed[1], abs=1e-9)  # round-off of 56 GHz


@pytest.mark.parametrize("spins", ["X=1/3", "X=0.75", "X=-1", "X=3/4", "X"])
def test_spins_that_are_no_multiple_of_a_half_are_refused_by_their_rule(spins, capsys):
    words = ["spectrum", "--constants", "B=9400 MHz", "--dipole-abc", "1,0,0", "--spin-constants", "C_iso(X)=1kHz"]
    assert run([*words, f"--spins={spins}"]) == 2
    assert "--spins: " in (error := capsys.readouterr().err)
    assert "1/2" in error


def test_the_classical_limit_counts_the_spins_that_q_counts():
    top = Top.from_constants(
        "B=3000 MHz", dipole_abc_debye=(1, 0, 0), spin_constants=SpinConstants.parse("chi_aa(14N)=-4 MHz")
    )
    computed = answer_spectrum(SpectrumRequest(top, jmax=2, effects=effects_of(top, True))).facts()["q"]
    assert computed["classical"] == pytest.approx(computed["q"], rel=1e-3)  # B/3kT of 1.6e-4


NAMED = {"A": "9.4 GHz", "B": 3100.0, "C": 2500.0, "chi_aa(14N)": -4.2, "eps_aa(S)": "0.3 GHz"}


def test_a_mapping_divides_into_constants_spins_and_states():
    top = Top.from_constants(
        NAMED | {"E[1]": "5 GHz", "A[1]": 9300, "B[1]": 3000, "C[1]": 2400, "chi_aa(14N)[1]": -4.1, "G_c[0,1]": 450},
        spins="S=1/2",
    )
    assert top.constants.text() == "A=9400.0 B=3100.0 C=2500.0 MHz"
    assert dict(top.spin_constants.values) == {"chi_aa(14N)": -4.2, "eps_aa(S)": 300.0, "chi_aa(14N)[1]": -4.1}
    assert (top.states.values["E[1]"], top.states.couplings) == (5000.0, ("G_c[0,1]",))


def test_constants_of_spins_as_text_or_mapping_are_the_same():
    computed = [
        Top.from_constants("A=9.4 B=3.1 C=2.5 GHz", spin_constants=source, spins="S=1/2").spin_constants
        for source in ("chi_aa(14N)=-4.2 eps_aa(S)=300 MHz", {"chi_aa(14N)": -4.2, "eps_aa(S)": "0.3 GHz"})
    ]
    assert [dict(entry.values) for entry in computed] == [{"chi_aa(14N)": -4.2, "eps_aa(S)": 300.0}] * 2
    assert list(computed[0].twice) == ["S", "14N"]


def test_what_a_mapping_refuses():
    with pytest.raises(ValueError, match="give its size, such as S=1/2"):
        Top.from_constants(NAMED)
    with pytest.raises(ValueError, match="spin_constants: given among the constants and again"):
        Top.from_constants(NAMED, spin_constants="chi_aa(14N)=1 MHz", spins="S=1/2")
    with pytest.raises(ValueError, match=r"--spin-constants .* in Python spin_constants and states"):
        Constants(A=9400.0, B=3100.0, C=2500.0, chi_aa=3.0)


def test_the_public_names_make_hyperfine_lines():
    import rotor

    lines = rotor.api.line_list("HCN", jmax=1, effects=rotor.api.effects_of("HCN", True, "first-order"))
    assert lines.levels.quanta_names[-1] == "f"
    assert rotor.SpinConstants is SpinConstants


def test_a_file_says_spins_as_text_or_number(tmp_path):
    head = "constants = { A = 9400.0, B = 3100.0, C = 2500.0 }\n[spins.X]\nC_iso = 0.003\n"
    computed = [
        parse_molecule_file(f"{head}spin = {size}").spin_constants.twice["X"] for size in ('"3/2"', "1.5", "2", '"2"')
    ]
    assert computed == [3, 3, 4, 4]
    for size in ("0.75", '"1/3"', "-1"):
        with pytest.raises(ValueError, match="each a multiple of 1/2"):
            parse_molecule_file(f"{head}spin = {size}")


def test_a_quadrupole_of_a_spin_of_a_half_in_a_file_is_named(tmp_path, capsys):
    (tmp_path / "a.int").write_text("a\n00 91 100.0 0 3 -12. -12. 100 300.\n 001 1.0\n")
    options = "a\n 4 1 1 0 0 1. 1. 1. 1.\n'a' 2 1 0 9 0 1 1 1 0 -1 0\n"
    (tmp_path / "a.var").write_text(options + "10000 9400. 0\n20000 3100. 0\n30000 2500. 0\n110010000 -6. 0\n")
    assert run(["spectrum", str(tmp_path / "a.int")]) == 0
    error = capsys.readouterr().err
    assert "note: parameter 110010000 is left out, as SPCAT does: spin" in error
    assert "has no quadrupole moment" in error


def test_a_report_of_files_without_names_gives_no_dipole_of_its_own(capsys):
    """PHASE puts moments beside the top's own dipole, which is 0 then."""
    case = ORACLES / "kinds" / "odd_and_phase" / "odd_and_phase.int"
    assert run(["spectrum", str(case), "--as-spcat"]) == 0
    assert "the moments of the file" in capsys.readouterr().out
    assert run(["spectrum", str(case), "--as-spcat", "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["dipole_abc_debye"] is None
