"""Files of SPFIT with spins and states as named constants, and back: the same levels, lines, codes and values."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from places import ORACLES

import rotor
from rotor.cli import run
from rotor.formats.spcat.file_model import connected_groups
from rotor.formats.spcat.model import intensity_file
from rotor.formats.spcat.names.named_parameters import named_parameter_file
from rotor.formats.spcat.names.named_top import named_top
from rotor.formats.spcat.predict import predict
from rotor.formats.spcat.text.int_file import IntensityFile, read_int
from rotor.formats.spcat.text.par import ParameterFile, format_par, read_par
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.solve import solve_levels
from rotor.spectra.lines import line_list
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.states.state_constants import StateConstants
from rotor.tops.top import Top

CASES = (
    "asym_spinrot",
    "formamide_quad",
    "vinylcl35_quad",
    "ch2cl2_2quad",
    "ch3cn_quad",
    "hcn_quad",
    "tunnelling_doublet_quad",
)
CASES += ("two_state_coriolis", "three_states_fermi_coriolis")


def files(name: str) -> tuple[ParameterFile, IntensityFile]:
    folder = ORACLES / name
    return read_par(next(folder.glob("*.var"))), read_int(next(folder.glob("*.int")))


def named_energies(top: Top, twice_f: int, n_max: int) -> np.ndarray:
    """Energies of F to a limit, each as often as its degeneracy, from the lowest."""
    levels = solve_levels(top, n_max, effects=effects_of(top, top.spin_constants is not None))
    return _repeated(levels, levels.multiplicity - 1 <= twice_f)


def _repeated(levels, chosen) -> np.ndarray:
    energies = np.repeat(levels.energy_mhz[chosen], levels.degeneracy[chosen])
    return np.sort(energies)


def coded_energies(file: ParameterFile, light: IntensityFile, twice_f: int) -> np.ndarray:
    """The same from the codes."""
    levels = [group.levels((0, twice_f)) for group in connected_groups(file, light)]
    return np.sort(np.concatenate([_repeated(level, np.ones(len(level), dtype=bool)) for level in levels]))


@pytest.mark.parametrize("name", CASES)
def test_names_say_the_hamiltonian_of_the_codes(name):
    file, light = files(name)
    top = named_top(file, light)
    spins = sum(top.spin_constants.twice.values()) if top.spin_constants else 0
    named, coded = named_energies(top, 6, 3 + spins), coded_energies(file, light, 6)
    np.testing.assert_allclose(named, coded, rtol=0, atol=1e-8)  # round-off of 1e6 MHz
    again = named_parameter_file(top, 20)
    np.testing.assert_allclose(coded_energies(again, light, 6), coded, rtol=0, atol=1e-8)
    if top.spin_constants:
        more = {key: 1.01 * value for key, value in top.spin_constants.values.items()}
        other = replace(top, spin_constants=replace(top.spin_constants, values=more, uncertainties={}))
        assert np.abs(named_energies(other, 6, 3 + spins) - coded).max() > 1e-5


@pytest.mark.parametrize("name", ["tunnelling_doublet_quad", "ch3cn_quad"])
def test_lines_of_named_constants_are_those_of_the_files(name):
    file, light = files(name)
    top = named_top(file, light)
    widened = replace(light, request=replace(light.request, fend=3, str0=-20.0, str1=-20.0))
    expected = predict(file, widened).lines
    lines = line_list(top, jmax=5, effects=effects_of(top, True), min_lgint=None, temperature_k=300.0)
    chosen = np.maximum(lines.levels.multiplicity[lines.upper], lines.levels.multiplicity[lines.lower]) <= 7
    strong = lambda lines_, rows: lines_.strength_debye2[rows] > 1e-6  # noqa: E731
    mine, theirs = np.flatnonzero(chosen), np.arange(len(expected.frequency_mhz))
    mine, theirs = mine[strong(lines, mine)], theirs[strong(expected, theirs)]
    assert len(mine) == len(theirs) > 20
    ours = np.sort(np.rec.fromarrays([lines.frequency_mhz[mine].round(5), lines.strength_debye2[mine]]))
    sorted_lines = np.sort(
        np.rec.fromarrays([expected.frequency_mhz[theirs].round(5), expected.strength_debye2[theirs]])
    )
    np.testing.assert_allclose(ours["f0"], sorted_lines["f0"], rtol=0, atol=2e-5)  # two roundings to 1e-5
    np.testing.assert_allclose(
        np.sort(ours["f1"]), np.sort(sorted_lines["f1"]), rtol=1e-6, atol=0
    )  # 1e-12 MHz of round-off mixes little


def test_codes_and_values_come_back():
    """What the tensors of a file are called here goes into the same codes."""
    file, light = files("formamide_quad")
    again = named_parameter_file(named_top(file, light), 12)
    expected = {p.code % 10**10: p.value for p in file.parameters}
    computed = {p.code: p.value for p in again.parameters}
    for code in (110010000, 110040000):
        assert computed[code] == pytest.approx(expected[code], rel=1e-14)  # factors 3/2 and 1/4
    assert again.options[0].spind == 3


@pytest.mark.parametrize("molecule", ["HCONH2", "CH3CN", "CH3Cl", "NH3", "HCN"])
def test_the_library_goes_to_files_and_comes_back(molecule):
    top = rotor.read(molecule)
    back = named_top(read_par(format_par(named_parameter_file(top, 30))))
    for name, value in back.constants.values.items():
        assert value == pytest.approx(top.constants[name], rel=1e-13)
    names = tuple(top.spin_constants.twice)
    assert tuple(back.spin_constants.twice) == names  # the labels of the file have them
    assert back.spin_weights == (top.states.weights[0] if top.states else top.spin_weights)
    if top.states:
        assert dict(back.states.values) == pytest.approx(dict(top.states.values), rel=1e-13)
        assert dict(back.states.weights) == dict(top.states.weights)
    first = named_energies(replace(top, level_table=None), 2 * 3 + 1, 5)
    np.testing.assert_allclose(named_energies(back, 2 * 3 + 1, 5), first, rtol=0, atol=1e-7)  # digits of a file


def test_a_radical_with_powers_and_states_goes_to_codes():
    text = "eps_aa(S)=-49571 eps_bb(S)=-421 eps_cc(S)=9 eps_ab(S)=180 eps_aa_K(S)=12 b_F(S,14N)=140 T_aa(S,14N)=-21 T_bb-cc(S,14N)=40 "
    text += "T_ab(S,14N)=5 chi_aa(14N)=0.5 chi_bb-cc(14N)=-3 chi_ab(14N)=0.2 MHz"
    spins = SpinConstants.parse(text, "S=1/2")
    states = StateConstants({"E[1]": 9e4, "A[1]": 609e3, "B[1]": 31.6e3, "C[1]": 29.7e3, "G_c[0,1]": 450.0, "F_ab_K[0,1]": 0.3,
                             "W_pm2[0,1]": 1.2})  # fmt: skip
    top = Top.from_constants(
        "A=610000 B=31672 C=29701 MHz", dipole_abc_debye=(1.4, 1.5, 0), spin_constants=spins, states=states
    )
    file = named_parameter_file(top, 20)
    assert file.options[0].spind == 32
    codes = {p.code: p.value for p in file.parameters}
    assert codes[10011099] == 12.0  # ½{Nz², S_a N_a}
    assert codes[120000099] == 140.0
    assert codes[120010099] == pytest.approx(-31.5)  # 3/2 T_aa
    assert codes[120040099] == pytest.approx(10.0)
    assert codes[600001] == 450.0
    assert codes[611001] == 0.3
    back = named_top(file, intensity_file(top, read_int(b"x\n0 1 1 0 9\n").request))
    assert back.states.values["G_c[0,1]"] == 450.0
    assert back.dipole_abc_debye == (1.4, 1.5, 0.0)
    np.testing.assert_allclose(
        named_energies(back, 5, 4), named_energies(top, 5, 4), rtol=0, atol=1e-6
    )  # 1e-12 of 1e6 MHz


@pytest.mark.parametrize(
    ("options", "parameters", "says"),
    [
        ("s -222 1 0 20 0 -6 1 0 0 0 0", ("1000 9e3", "100 3e3"), "IAX = -6: a total spin of three nuclei with unlike weights"),
        ("a 2 2 0 20 0 1 1 1 0 1 0", ("10099 9e3", "20099 3e3", "30099 2e3", "10200001 5.0"), "spin-orbit"),
        ("a 1 2 0 20 0 1 1 1 0 1 0", ("10099 9e3", "20099 3e3", "30099 2e3", "70001 5.0"), "this coupling of two states"),
        ("a 3 1 0 20 0 1 1 1 0 1 0", ("10000 9e3", "20000 3e3", "30000 2e3", "610000 5.0"), "a term of this kind in one state"),
        ("a 3 1 0 20 0 1 1 1 0 1 0", ("10000 9e3", "20000 3e3", "30000 2e3", "1000000000 5.0"), "Fourier or Euler"),
        ("a 3 1 2 20 0 1 1 1 0 1 0", ("10000 9e3", "20000 3e3", "30000 2e3"), "KNMIN"),
    ],
)  # fmt: skip
def test_what_has_no_name_is_refused(options, parameters, says):
    lines = "".join(f"{line} 1\n" for line in parameters)
    with pytest.raises(ValueError, match=says):
        named_top(read_par(f"a case\n{len(parameters)} 1 1\n{options}\n{lines}".encode()))


def test_the_command_takes_spins_and_states_along(tmp_path, capsys):
    for target in ("a.var", "a.int", "a.toml"):
        assert run(["convert", "NH3" if target != "a.toml" else str(tmp_path / "a.var"), str(tmp_path / target)]) == 0
        assert "2 states; spins 14N" in capsys.readouterr().out
    top = rotor.read(tmp_path / "a.toml")
    assert top.states.dipoles[1, 0] == (0.0, 0.0, 1.47)
    assert top.spin_constants.values["chi_bb-cc(14N)"] == pytest.approx(1.5 * 4.08983, rel=1e-12)


def test_lines_of_a_file_are_shown_with_its_names(capsys):
    assert (
        run(["spectrum", str(ORACLES / "tunnelling_doublet_quad" / "tunnelling_doublet_quad.int"), "--top", "1"]) == 0
    )
    shown = " ".join(capsys.readouterr().out.split())  # long rows are wrapped
    for text in (
        "dipole between 0 and 1: μa 0, μb 0, μc 0.9 D",
        "interacting states",
        "nuclear quadrupole 2.5 MHz",
        "hyperfine exact",
    ):
        assert text in shown
    assert (
        run(["spectrum", str(ORACLES / "kinds" / "o2" / "o2.int"), "--top", "1"]) == 0
    )  # magnetic moments have no name
    assert "effects   those of the parameters of the files" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["NH3", "formamide", "CH3CN"])
def test_molecules_of_the_library_with_spins_are_converted(name, call, folder):
    """Atoms have numbers in a geometry alone, which a file of constants does not have."""
    code, _, said = call("convert", name, "found.toml")
    assert code == 0, said
    assert "atom" not in (folder / "found.toml").read_text(encoding="utf-8")
    assert rotor.read(str(folder / "found.toml")).spin_constants.values == rotor.read(name).spin_constants.values


def test_a_report_does_not_show_constants_that_the_file_does_not_have(call, folder):
    """l-doubled states with series have no named constants: neither A, B, C nor what would follow from them is printed."""
    for suffix in ("int", "var"):
        shutil.copy(
            ORACLES / "kinds" / "fourier_l_doubled" / f"fourier_l_doubled.{suffix}",
            folder / f"e.{suffix}",
        )
    code, out, _ = call("spectrum", "e.int", "--top", "0")
    assert code == 0
    assert "constants     those of the file, which have no names here" in out
    assert "classical limit" not in out
    assert "κ" not in out
    code, out, _ = call("spectrum", "e.int", "--top", "0", "--json", "-", "--cat", "e.cat")
    content = json.loads(out)
    for key in ("constants_mhz", "kind", "kappa", "moments_u_angstrom2", "rotational_constants_mhz", "spin_weights"):
        assert content[key] is None
    assert content["q"]["classical"] is None
    assert content["limits"] == []
    assert "have no names here" in content["constants_reason"]
    record = json.loads((folder / "e.cat.provenance.json").read_text(encoding="utf-8"))
    assert record["constants"] is None
    assert record["constants_reason"] == content["constants_reason"]


def test_constants_in_wavenumbers_become_mhz(call, folder):
    """FLAGS of 1000 and more: 0.75, 0.13 and 0.11 cm⁻¹, two states and a nucleus of spin 1."""
    source = ORACLES / "kinds" / "wavenumbers" / "wavenumbers.int"
    assert call("convert", str(source), "found.toml")[0] == 0
    top = rotor.read(str(folder / "found.toml"))
    assert top.rotational_constants_mhz == pytest.approx([29979.2458 * x for x in (0.75, 0.13, 0.11)], rel=1e-14)
    assert top.states.values["G_a[0,1]"] == pytest.approx(299.792458, rel=1e-14)
    assert top.spin_constants.values["chi_aa(I1)"] == pytest.approx(-1.4e-4 * 29979.2458 / 1.5, rel=1e-12)


@pytest.mark.parametrize(
    "words",
    [
        ["structure", "none.toml"],
        ["accuracy", "none.toml"],
        ["run", "none.toml"],
        ["plan", "none.toml"],
        ["cat", "none.cat"],
        ["info", "none.xyz"],
        ["fit", "none.par"],
        ["align", "OCS", "--pulse-table", "none.csv"],
        ["info", "water", "--hessian", "none.txt"],
    ],
    ids=" ".join,
)
def test_a_missing_file_is_named_in_the_same_words_by_every_verb(call, words):
    code, _, err = call(*words)
    assert (code, err.strip()) == (2, f"error: {words[-1]}: no such file")
