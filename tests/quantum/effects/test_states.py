"""States of a top beyond its own: in files, in levels, lines, sums and reports; against closed forms and solutions in blocks."""

from __future__ import annotations

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

import rotor
from rotor import units
from rotor.alignment.ensemble import thermal
from rotor.formats.molecules.molecule_file import parse_molecule_file
from rotor.formats.molecules.molecule_writer import molecule_file_text
from rotor.formats.spcat.text.cat import read_cat
from rotor.molecules.molecule import Molecule
from rotor.quantum.effects.interactions import InteractingStates
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.convergence import warnings_of
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.solve import solve_levels
from rotor.quantum.wang.rotation import solve_rotation
from rotor.spectra.lines import dipoles_by_state, line_list
from rotor.spectra.raman.raman import raman_lines
from rotor.spectra.transitions.pairs import all_transitions
from rotor.thermodynamics.request import ThermoRequest, answer_thermo
from rotor.thermodynamics.sums.partition import partition_function
from rotor.tops.internal_rotation import InternalRotationConstants
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.states.state_constants import GROUPS, StateConstants
from rotor.tops.top import Top

OBLATE_STATES = {"E[1]": 800.0, "B[1]": 5980.0, "C[1]": 4010.0, "DJ[1]": 0.01, "DJK[1]": -0.02}
OBLATE = Top.from_constants(
    "B=6000 C=4000 DJ=0.012 DJK=-0.021 MHz",
    dipole_abc_debye=(0.6, 0.8, 1.5),
    states=StateConstants(
        OBLATE_STATES, ("s", "a"), dipoles={(0, 1): (0.6, 0.8, 1.5), (0, 0): (0, 0, 0.3), (1, 1): (0.4, 0, 0.2)}
    ),
)
COUPLED = {"E[1]": 9000.0, "A[1]": 9390.0, "B[1]": 3110.0, "C[1]": 2490.0, "G_c[0,1]": 400.0, "F_ab[0,1]": 12.0}
ASYMMETRIC = Top.from_constants(
    "A=9400 B=3100 C=2500 MHz", dipole_abc_debye=(1.0, 0.5, 0.0), states=StateConstants(COUPLED)
)
FILE = """
name = "doublet"

[constants]
B = 6000.0
C = 4000.0

[dipole]
c = 1.5

[spin_weights]
0 = 2
1 = 1
2 = 1

[states]
source = "made for a test"
unit = "GHz"
names = ["0+", "0-"]
"E[1]" = "800 MHz"
"B[1]" = 5.98
"C[1]" = 4.01
weights = { 0 = { 0even = 0, 0odd = 4, 1 = 1, 2 = 1 }, 1 = { 0even = 4, 0odd = 0, 1 = 1, 2 = 1 } }
dipoles = { 0 = [0, 0, 0], 1 = [0, 0, 0], "0,1" = [0, 0, 1.5] }
"""


def _strengths(levels, dipoles):
    """Sμ² by frequency to 1e-4 MHz, summed over components; what lies in one row or in a doublet of 0 MHz is left out."""
    transitions = all_transitions(levels, dipoles)
    total: dict[float, float] = {}
    for f, s in zip(transitions.frequency_mhz.tolist(), transitions.strength_debye2.tolist(), strict=True):
        total[round(f, 4)] = total.get(round(f, 4), 0.0) + s
    return {f: s for f, s in total.items() if s > 1e-9 and f > 1e-3}


def test_closed_forms_of_two_states_are_those_of_wang_blocks():
    """Energies and strengths of parallel and perpendicular lines, within states and between them, ΔJ = 0 among them."""
    effects = effects_of(OBLATE, hyperfine=False)
    closed, blocks = solve_levels(OBLATE, 5), solve_rotation(OBLATE, effects, 0, 5, in_blocks=True)
    assert closed.representation is None
    assert blocks.representation == "IIIr"
    energies = np.repeat(closed.energy_mhz, closed.components)
    np.testing.assert_allclose(np.sort(energies), np.sort(blocks.energy_mhz), atol=1e-8)  # round-off of 3e5 MHz
    dipoles = dipoles_by_state(OBLATE, OBLATE.dipole_abc_debye, effects)
    ours, reference = _strengths(closed, dipoles), _strengths(blocks, dipoles)
    assert ours.keys() == reference.keys()
    assert len(ours) > 100
    for frequency, strength in reference.items():
        assert ours[frequency] == pytest.approx(strength, rel=1e-9)  # closed form


def test_rows_are_in_order_of_j_and_energies_are_those_of_each_state():
    levels = solve_levels(OBLATE, 4)
    assert list(levels.quanta) == ["v", "j", "k"]
    assert (np.diff(levels.quanta["j"]) >= 0).all()
    row = levels.find(v=1, j=3, k=2)
    expected = 800.0 + 5980.0 * 12 - 1970.0 * 4 - 0.01 * 144 + 0.02 * 12 * 4
    assert levels.energy_mhz[row] == pytest.approx(expected, rel=1e-14)  # closed form


def test_states_of_a_top_are_the_effect_given_by_hand():
    alone = replace(ASYMMETRIC, states=None)
    by_hand = solve_levels(alone, 6, effects=(*SEMI_RIGID, InteractingStates(COUPLED)))
    levels = solve_levels(ASYMMETRIC, 6)
    np.testing.assert_array_equal(levels.energy_mhz, by_hand.energy_mhz)
    again = solve_levels(ASYMMETRIC, 6, effects=levels.effects)  # not added a second time
    np.testing.assert_array_equal(again.energy_mhz, levels.energy_mhz)
    arguments = (np.array([1.0, 0.5, 0.0]), solve_levels(ASYMMETRIC, 0).energy_mhz)
    assert arguments[1].tolist() == [0.0, 9000.0]


def test_derivatives_of_both_kinds_of_states_are_differences():
    for top, names in (
        (OBLATE, ["B", "DJK", "E[1]", "C[1]", "DJ[1]"]),
        (ASYMMETRIC, ["A", "B[1]", "G_c[0,1]", "F_ab[0,1]"]),
    ):
        levels = solve_levels(top, 5)
        for column, name in zip(level_derivatives(top, levels, names).T, names, strict=True):
            moved = []
            for step in (-0.01, 0.01):
                if name in top.constants.values:
                    other = replace(top, constants=top.constants.replace(**{name: top.constants[name] + step}))
                else:
                    values = {**top.states.values, name: top.states.values[name] + step}
                    other = replace(top, states=replace(top.states, values=values))
                moved.append(solve_levels(other, 5).energy_mhz)
            difference = (moved[1] - moved[0]) / 0.02
            np.testing.assert_allclose(
                column, difference, rtol=1e-5, atol=1e-5
            )  # error of the step, round-off over 0.02


def test_q_is_the_sum_over_states():
    """Of states that nothing connects: Q = Q_0 + exp(-E/kT) Q_1, each with its own constants."""
    far = replace(OBLATE, states=replace(OBLATE.states, values={**OBLATE_STATES, "E[1]": 3e6}))
    for t in (5.0, 100.0):
        first = partition_function(replace(OBLATE, states=None), t, 1e-9).q
        top = Top.from_constants("B=5980 C=4010 DJ=0.01 DJK=-0.02 MHz")
        second = partition_function(top, t, 1e-9).q * np.exp(-3e6 / units.MHZ_PER_K / t)
        partition = partition_function(far, t, 1e-9)
        assert partition.q == pytest.approx(first + second, rel=1e-8)  # ten times what was asked of the sums
    functions = answer_thermo(ThermoRequest(far, (100.0,))).functions
    assert functions.q_rot_corrected[0] == pytest.approx(
        partition.q, rel=1e-4
    )  # distortion of the second state is not corrected for
    assert functions.cv_over_r_corrected[0] == pytest.approx(
        functions.cv_over_r[0], rel=1e-3
    )  # the peak of two states is in both


@pytest.mark.parametrize("moment", ['[0, "x", 1.5]', "[0, 1.5]", "1.5", "[0, true, 1.5]"])
def test_a_dipole_of_states_is_three_numbers(moment):
    with pytest.raises(ValueError, match="state 0,1: expected three numbers, along a, b, c in D"):
        parse_molecule_file(FILE.replace("[0, 0, 1.5] }", f"{moment} }}"))


def test_a_file_is_read_and_written_with_its_states(folder):
    file = parse_molecule_file(FILE)
    text = molecule_file_text(file)
    back = parse_molecule_file(text)
    for item in (file.states, back.states):
        assert dict(item.values) == {"E[1]": 800.0, "B[1]": 5980.0, "C[1]": 4010.0}
        assert (item.names, item.source) == (("0+", "0-"), "made for a test")
        assert item.weights[1].to_mapping() == {"0even": 4, "0odd": 0, "1": 1, "2": 1}
        assert dict(item.dipoles) == {(0, 0): (0, 0, 0), (1, 1): (0, 0, 0), (1, 0): (0, 0, 1.5)}
    assert molecule_file_text(back) == text
    (folder / "doublet.toml").write_text(text)
    top = rotor.read("doublet.toml")
    levels = solve_levels(top, 2)
    absent = {tuple(row) for row in levels.quanta_of(np.flatnonzero(levels.weight == 0)).tolist()}
    assert absent == {(0, 0, 0), (1, 1, 0), (0, 2, 0)}  # v, J, K
    lines = line_list(top, jmax=2)
    rotor.write(lines, "lines.cat", settings={"tag": 17001})
    catalogue = read_cat(folder / "lines.cat")
    assert set(catalogue.qnfmt.tolist()) == {1303}
    assert len(catalogue) == len(lines)
    ends = zip(catalogue.quanta_upper[:, :3].tolist(), catalogue.quanta_lower[:, :3].tolist(), strict=True)
    assert ([1, 0, 0], [0, 0, 1]) in list(ends)
    frequency = {
        tuple(np.r_[u, w].tolist()): f
        for u, w, f in zip(lines.quanta(lines.upper), lines.quanta(lines.lower), lines.frequency_mhz, strict=True)
    }
    assert frequency[0, 1, 0, 1, 0, 0] == pytest.approx(
        2 * 6000 - 800, abs=1e-9
    )  # closed form: 1(0) of 0+ and 0(0) of 0-
    assert (1, 1, 0, 0, 0, 0) not in frequency


def test_every_state_has_the_dipole_of_the_top_unless_it_is_given():
    plain = replace(ASYMMETRIC, states=StateConstants({k: v for k, v in COUPLED.items() if "," not in k}))
    lines = line_list(plain, jmax=1, min_lgint=None)
    assert set(lines.levels.quanta["v"][lines.upper].tolist()) == {0, 1}
    assert (lines.levels.quanta["v"][lines.upper] == lines.levels.quanta["v"][lines.lower]).all()
    file = parse_molecule_file(FILE)
    top = Top.from_constants(
        file.constants, dipole_abc_debye=(0, 0, 1.5), spin_weights=file.spin_weights, states=file.states
    )
    other = top.with_dipole((0, 0, 3.0), "twice as large")
    assert other.states.dipoles[1, 0] == (0.0, 0.0, 3.0)
    assert other.states.dipoles[0, 0] == (0.0, 0.0, 0.0)
    assert top.with_constants(top.constants).states is None
    assert not top.with_weights({"0": 1, "1": 2, "2": 2}, "given").states.weights


def test_mixing_above_one_half_is_reported():
    """Three states share their levels about evenly; of two each has one half at least."""
    rigid = {f"{name}[{v}]": 3000.0 * (i + 1) for v in (1, 2) for i, name in enumerate("CBA")}
    even = {f"W[{a},{b}]": 50.0 for a, b in ((0, 1), (0, 2), (1, 2))}
    near = StateConstants({"E[1]": 1.0, "E[2]": -2.0, **rigid, **even})
    top = Top.from_constants("A=9001 B=6000.5 C=3000 MHz", states=near)
    levels = solve_levels(top, 8)
    (text,) = [text for text in warnings_of(top, levels) if "mixed" in text]
    assert text.startswith(f"{int((levels.mixing < 0.5 - 1e-6).sum())} levels from J = ")
    assert not any("mixed" in text for text in warnings_of(OBLATE, solve_levels(OBLATE, 8)))


def test_raman_lines_stay_in_their_state():
    tensor = np.diag([2.0, 2.0, 3.0])
    twice = replace(
        OBLATE, states=StateConstants({"E[1]": 0.0, **{f"{k}[1]": v for k, v in OBLATE.constants.values.items()}})
    )
    single = raman_lines(replace(OBLATE, states=None, polarizability_abc_angstrom3=tensor), jmax=4)
    double = raman_lines(replace(twice, polarizability_abc_angstrom3=tensor), jmax=4)
    assert len(double) == 2 * len(single)
    np.testing.assert_allclose(
        np.sort(double.shift_cm)[::2], np.sort(single.shift_cm), atol=1e-12
    )  # the same levels twice


def test_hyperfine_structure_and_states_go_together():
    """Of states that nothing connects the pattern is that of each alone, weights of K = 0 with their parity."""
    file = parse_molecule_file(FILE)
    chi = SpinConstants.parse("chi_cc(14N)=-4.1 MHz")
    top = Top.from_constants(
        file.constants,
        dipole_abc_debye=(0, 0, 1.5),
        spin_weights=file.spin_weights,
        states=file.states,
        spin_constants=chi,
    )
    lines = line_list(top, jmax=1, effects=effects_of(top, hyperfine=True), min_lgint=None)
    between = [
        f - (2 * 6000 - 800)
        for f, u, w in zip(
            lines.frequency_mhz, lines.levels.quanta_of(lines.upper), lines.levels.quanta_of(lines.lower), strict=True
        )
        if u[0] == 0 and w[0] == 1 and w[1] == 0
    ]
    expected = [-4.1 * x for x in (-0.5, 0.25, -0.05)]  # -eQq Y(F), Casimir's function of J = 1, K = 0
    np.testing.assert_allclose(sorted(between), sorted(expected), atol=2e-3)  # second order: 4²/4000 MHz


SAY = {
    "E[1]=1 A[1]=9 B[1]=3 C[1]=2 GHz G_c[0,2]=3": "no state 2",
    "E[1]=1 A[1]=9 B[1]=3 GHz": r"no C\[1\]",
    "E[1]=1 A[1]=9 B[1]=3 C[1]=2 GHz H_c[0,1]=3": "interactions between states are|G_a, G_b",
    "E[1]=1 A[1]=9 B[1]=3 C[1]=2 GHz W[1,1]=3": "two different states",
    "E[1]=1 A[0]=9 GHz": "state 0 is the top's own",
    "E[1]=1 E[1]=2": "given twice",
    "E=5": "expected constants of states",
}


@pytest.mark.parametrize("text", SAY)
def test_states_that_cannot_be_are_refused(text, call):
    command = ["levels", "--constants", "A=9 B=3 C=2 GHz", "--jmax", "2", "--state-constants", text]
    code, out, err = call(*command)
    assert code == 2
    assert len(err.strip().splitlines()) == 1
    assert "--state-constants" in err
    assert not out
    with pytest.raises(ValueError, match=SAY[text]):
        solve_levels(Top.from_constants("A=9 B=3 C=2 GHz", states=StateConstants.parse(text)), 1)


@pytest.mark.parametrize("group", GROUPS)
def test_couplings_that_a_group_tells_apart_are_refused(group):
    """Of the six pairs of W, G_a, G_b, G_c all stand together in C1, two in a group with one plane or axis, none in C2v and D2."""
    kinds = {"": "W[0,1]", "a": "G_a[0,1]", "b": "F_ac[0,1]", "c": "G_c_J[1,0]"}
    allowed: list[str] = []
    said: list[str] = []
    for first in kinds:
        for second in kinds:
            if first < second:
                try:
                    StateConstants({"E[1]": 1.0, kinds[first]: 1.0, kinds[second]: 1.0}, symmetry=group)
                    allowed.append(first + second)
                except ValueError as error:
                    said.append(str(error))
    assert all("C1 and Ci only" in text and group in text for text in said)
    assert len(allowed) == {"C1": 6, "Ci": 6, "C2v": 0, "D2": 0, "D2h": 0}.get(group, 2)
    if group == "Cs(ab)":  # a rotation about c keeps the plane
        assert allowed == ["c", "ab"]


def test_geometry_and_weights_forbid_couplings_and_dipoles():
    water = Molecule(("O", "H", "H"), [[0, 0, 0.0], [0.757, 0.586, 0], [-0.757, 0.586, 0]])
    rigid = Top.from_molecule(water)
    constants = {f"{name}[1]": value for name, value in rigid.constants.values.items()} | {"E[1]": 1e5}
    assert replace(rigid, states=StateConstants({**constants, "G_c[0,1]": 5.0, "F_ab[0,1]": 5.0})).states.count == 2
    with pytest.raises(ValueError, match=r"W\[0,1\] and G_c\[0,1\]: two states of a molecule of C2v"):
        replace(rigid, states=StateConstants({**constants, "W[0,1]": 5.0, "G_c[0,1]": 5.0}))
    flat = replace(rigid, states=StateConstants(constants), dipole_abc_debye=(0, 1.85, 0))
    with pytest.raises(ValueError, match="different nuclear-spin weight"):
        replace(flat, states=StateConstants(constants, dipoles={(0, 1): (0.5, 0, 0)}))
    swapped = {1: SpinWeights.from_mapping({"ee": 3, "eo": 1, "oe": 1, "oo": 3})}
    assert (
        replace(flat, states=StateConstants(constants, weights=swapped, dipoles={(0, 1): (0.5, 0, 0)})).states.count
        == 2
    )
    with pytest.raises(ValueError, match="between states 0 and 1"):
        replace(flat, states=StateConstants(constants, weights=swapped, dipoles={(0, 1): (0, 0.5, 0)}))
    with pytest.raises(ValueError, match="symmetry forbids"):  # W joins levels of ortho and para
        solve_levels(replace(flat, states=StateConstants({**constants, "W[0,1]": 5.0}, weights=swapped)), 1)


def test_fields_have_several_states_and_alignment_refuses_them(folder, call):
    (folder / "doublet.toml").write_text(FILE)
    code, out, _ = call("stark", "doublet.toml", "--field", "0:10kV/cm:3", "--states", "1")
    assert code == 0
    assert "1 1 0 1" in out
    top = rotor.read("doublet.toml")
    with pytest.raises(ValueError, match="alignment of doublet: computed for a single state"):
        thermal(top, 10.0, 1e-3)


def test_command_line_shows_states(folder, call):
    (folder / "doublet.toml").write_text(FILE)
    code, out, _ = call("info", "doublet.toml", "--json", "info.json")
    assert code == 0
    assert "v = 0 (0+), 1 (0-)" in out
    assert "dipole between 0+ and 0-" in out
    assert "states: made for a test" in out
    content = json.loads((folder / "info.json").read_text())
    assert content["further_states"]["constants_mhz"]["B[1]"] == 5980.0
    assert content["further_states"]["names"] == ["0+", "0-"]
    assert call("levels", "doublet.toml", "--jmax", "1", "--csv", "levels.csv")[0] == 0
    rows = list(csv.DictReader((folder / "levels.csv").read_text().splitlines()))
    assert {row["v"] for row in rows} == {"0", "1"}
    assert call("spectrum", "doublet.toml", "--jmax", "3", "--csv", "lines.csv")[0] == 0
    assert "v_upper" in (folder / "lines.csv").read_text().splitlines()[0]
    code, out, _ = call("thermo", "doublet.toml", "--species", "ortho", "--temperature", "50K")
    assert code == 0
    assert "ortho" in out
    command = ["spectrum", "--constants", "A=9 B=3 C=2 GHz", "--dipole-abc", "1,0,0", "--jmax", "2", "--q", "1e5"]
    code, out, _ = call(*command, "--state-constants", "E[1]=5 A[1]=9.1 B[1]=3.1 C[1]=2.1 GHz W[0,1]=3MHz")
    assert code == 0
    assert "v J Ka Kc" in out


@pytest.mark.parametrize(("name", "power"), [("G_c[0,1]", 1), ("F_ab[0,1]", 2), ("W[0,1]", 0)])
def test_the_size_of_a_coupling_is_that_at_k_equal_to_j(name, power):
    top = Top.from_constants("A=9 B=6 C=5 GHz")
    assert InteractingStates({"E[1]": 1e5, name: -3.0}).size_mhz(top, 5) == 3.0 * 5**power


def test_states_beside_internal_rotation_are_refused():
    """Not left out in silence where the effects are those by default."""
    methyl = InternalRotationConstants({"F": 2.3e5, "rho": 0.33, "V3": 1.2e7}, "RAM")
    second = {"E[1]": 1e3, "A[1]": 56e3, "B[1]": 10e3, "C[1]": 9e3}
    top = Top.from_constants(
        "A=56505.9 B=10454.1 C=9089.2 MHz", states=StateConstants(second), internal_rotation=methyl
    )
    with pytest.raises(ValueError, match="interacting states beside internal rotation"):
        solve_levels(top, 1)
