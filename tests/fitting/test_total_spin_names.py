"""Total spins of two and of three equivalent nuclei by names: in files of molecules, on the command line, and in SPFIT's files."""

from __future__ import annotations

import csv
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

import rotor
from rotor.fitting.top_constants import TopConstants
from rotor.formats.molecules.molecule_file import parse_molecule_file
from rotor.formats.molecules.molecule_writer import molecule_file_text
from rotor.formats.read_write import file_top
from rotor.formats.spcat.fits.fit_states import groups_for_fit, levels_in_blocks
from rotor.formats.spcat.names.named_parameters import named_parameter_file, named_parameters
from rotor.formats.spcat.names.named_top import named_top
from rotor.formats.spcat.text.par import format_par, read_par
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.solve import solve_levels
from rotor.spectra.lines import line_list
from rotor.thermodynamics.sums.partition import partition_function
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.top import Top

PROTONS = """constants = { A = 282000.0, B = 38800.0, C = 34000.0 }
dipole = { a = 2.3 }
spin_weights = { ee = 1, eo = 1, oe = 0, oo = 0 }
[spins.1H_1]
total = "I"
C_aa = -0.004
C_ab = 0.01
[spins.1H_2]
total = "I"
C_aa = -0.004
C_ab = -0.01
[spins."1H_1,1H_2"]
T_aa = 0.03
"""
CHLORINES = "chi_aa(35Cl_1)=-40 chi_aa(35Cl_2)=-40 chi_ab(35Cl_1)=20 chi_ab(35Cl_2)=-20"
DEUTERONS = (
    "chi_aa(2H_1)=.2 chi_bb-cc(2H_1)=.3 chi_ab(2H_1)=.1 C_aa(2H_1)=.01 C_bb(2H_1)=.02 C_cc(2H_1)=.03 C_ac(2H_1)=.005 "
    "T_aa(2H_1,2H_2)=.03 T_bb-cc(2H_1,2H_2)=.02 J(2H_1,2H_2)=.01"
)
TOPS = {
    "two": Top.from_constants(
        "A=9 B=3 C=2.5 GHz", spin_constants=SpinConstants.parse(CHLORINES, "35Cl_1+35Cl_2")
    ),
    "three": Top.from_constants("A=9 B=3 GHz", spin_constants=SpinConstants.parse(DEUTERONS, "2H_1+2H_2+2H_3")),
    "three, oblate": Top.from_constants(
        "B=9 C=5 GHz", spin_constants=SpinConstants.parse("chi_cc(2H_1)=.2 chi_aa-bb(2H_1)=.3 chi_bc(2H_1)=.1", "2H_1+2H_2+2H_3")
    ),
}  # fmt: skip


def test_a_total_goes_through_a_file():
    file = parse_molecule_file(PROTONS)
    assert dict(file.spin_constants.totals) == {"1H_1": "I", "1H_2": "I"}
    again = parse_molecule_file(molecule_file_text(file))
    assert dict(again.spin_constants.totals) == dict(file.spin_constants.totals)
    assert dict(again.spin_constants.values) == dict(file.spin_constants.values)


def test_a_total_of_two_makes_the_levels_of_the_plain_coupling():
    """Without weights the two ways of coupling differ in names alone."""
    plain = Top.from_constants("A=9 B=3 C=2.5 GHz", spin_constants=SpinConstants.parse(CHLORINES))
    computed = [solve_levels(top, 1, effects=effects_of(top, True)) for top in (TOPS["two"], plain)]
    assert computed[0].quanta_names == ("n", "ka", "kc", "i_tot", "f")
    energies = [np.sort(entry.energy_mhz) for entry in computed]
    assert energies[0] == pytest.approx(energies[1], abs=1e-8)  # round-off of energies of 1e5 MHz


def test_q_of_ortho_and_para_is_that_without_spins():
    text = PROTONS.partition("[spins")[0].replace("oe = 0, oo = 0", "oe = 3, oo = 3")
    tops = [file_top(parse_molecule_file(file)) for file in (PROTONS, text)]
    q = [partition_function(top, 20.0, effects=effects_of(top, top is tops[0])).q for top in tops]
    assert q[0] == pytest.approx(q[1], rel=1e-6)  # the tail of either sum


def test_components_of_ortho_and_para_add_up_to_the_lines_without_spins():
    """Weights 1, 1, 0, 0 of even I make 1, 1, 3, 3 without spins: for each rotational line the sum over its components."""
    text = PROTONS.partition("[spins")[0].replace("oe = 0, oo = 0", "oe = 3, oo = 3")
    tops = [file_top(parse_molecule_file(file)) for file in (PROTONS, text)]
    lines = [
        line_list(top, jmax=2, min_lgint=None, q=1.0, range_mhz=(0, 3e5), effects=effects_of(top, top is tops[0]))
        for top in tops
    ]
    sums: Counter[tuple[int, ...]] = Counter()
    names = ("n", "ka", "kc")
    for line, total, j in zip(lines, (1, 0), ("n", "j"), strict=True):
        columns = [
            line.levels.quanta[name if name != "n" else j][rows] for rows in (line.upper, line.lower) for name in names
        ]
        for key, lgint in zip(zip(*(c.tolist() for c in columns), strict=True), line.lgint, strict=True):
            sums[key, total] += 10.0**lgint
    rotational = [key for key, total in sums if not total]
    assert len(rotational) >= 5
    for key in rotational:
        assert sums[key, 1] == pytest.approx(sums[key, 0], rel=1e-6)  # kHz of hyperfine shifts move h nu / kT


@pytest.mark.parametrize("kind", TOPS)
def test_the_codes_make_the_same_levels(kind):
    constants = TopConstants(TOPS[kind], True)
    file, _ = named_parameters(constants, "", 99)
    assert file.options[0].iax == {"two": -1}.get(kind, -6)
    levels = solve_levels(constants.top, 1 if kind == "three" else 2, effects=constants.effects)
    (group,) = groups_for_fit(file)
    computed = levels_in_blocks(group, sorted(set((levels.multiplicity - 1).tolist())))
    pairs = [
        np.array(
            sorted(
                zip(
                    (labels.multiplicity - 1)[labels.rotational <= 1],
                    labels.energy_mhz[labels.rotational <= 1],
                    strict=True,
                )
            )
        )
        for labels in (levels, computed)
    ]
    assert pairs[0] == pytest.approx(pairs[1], abs=1e-8)  # round-off of energies of 1e5 MHz


@pytest.mark.parametrize("kind", [*TOPS, "protons"])
def test_a_total_goes_to_codes_and_comes_back(kind):
    top = file_top(parse_molecule_file(PROTONS)) if kind == "protons" else TOPS[kind]
    back = named_top(read_par(format_par(named_parameter_file(top, 20))))
    assert len(back.spin_constants.totals) == len(top.spin_constants.totals)
    assert back.spin_weights == top.spin_weights
    ours, theirs = (solve_levels(molecule, 1, effects=effects_of(molecule, True)) for molecule in (top, back))
    assert np.sort(theirs.energy_mhz) == pytest.approx(np.sort(ours.energy_mhz), abs=1e-8)  # round-off of 1e5 MHz
    assert sorted(theirs.degeneracy) == sorted(ours.degeneracy)


def test_the_command_line(call, folder):
    (folder / "h2.toml").write_text(PROTONS)
    code, out, err = call(
        "spectrum", "h2.toml", "--hyperfine", "--jmax", "2", "--q", "1e3", "--csv", "l.csv", "--top", "1"
    )
    assert code == 0, err
    assert "N Ka Kc I F" in out
    with open("l.csv") as handle:
        assert "i_tot_upper" in next(csv.reader(handle))
    code, _, err = call("convert", "h2.toml", "h2.var")
    assert code == 0, err
    assert "  -1 " in (folder / "h2.var").read_text().splitlines()[2]
    code, _, err = call("convert", "h2.toml", "again.toml")
    assert code == 0, err
    assert (folder / "again.toml").read_text().count('total = "I"') == 2


@pytest.mark.parametrize(
    ("spins", "said"),
    [
        ("35Cl_1+14N", "total spin of 35Cl_1, 14N: expected one total of two or three equivalent nuclei of one size"),
        ("35Cl_1+35Cl_1", "spin 35Cl_1 is given twice; once is enough"),
        ("35Cl_1+", "expected spins such as S=1/2 14N or 35Cl_1+35Cl_2"),
    ],
)
def test_wrong_totals_are_one_line(call, spins, said):
    text = CHLORINES + " chi_aa(14N)=-4"
    code, _, err = call(
        "spectrum", "--constants", "A=9 B=3 C=2.5 GHz", "--spin-constants", text, "--spins", spins, "--jmax", "1"
    )
    assert code == 2
    assert said in err.splitlines()[-1]


def test_weights_beside_a_total_are_those_of_half_a_turn():
    weights = {"ee": 1, "eo": 2, "oe": 0, "oo": 0}
    top = Top.from_constants("A=9 B=3 C=2.5 GHz", spin_weights=weights, spin_constants=TOPS["two"].spin_constants)
    with pytest.raises(ValueError, match="expected those of half a turn about one axis"):
        effects_of(top, True)


@pytest.mark.parametrize(
    ("spins", "text", "weights"),
    [
        ("1H_1+1H_2", "C_iso(1H_1)=-.03 C_iso(1H_2)=-.03", "ee=1,eo=1,oe=3,oo=3"),
        ("1H_1+1H_2", "C_iso(1H_1)=-.03 C_iso(1H_2)=-.03", "ee=6,eo=2,oe=2,oo=6"),  # the other way round, not reduced
        ("14N_1+14N_2", "chi_aa(14N_1)=-4 chi_aa(14N_2)=-4", "ee=6,eo=6,oe=3,oo=3"),
        ("35Cl_1+35Cl_2", "chi_aa(35Cl_1)=-40 chi_aa(35Cl_2)=-40", "ee=3,eo=3,oe=5,oo=5"),
    ],
)
def test_typed_weights_that_count_a_pair_twice_are_refused(call, spins, text, weights):
    """Levels that do not exist, and Q two to four times too large; the same rule as for weights from a geometry."""
    command = ("levels", "--constants", "A=9 B=3 C=2.5 GHz", "--spins", spins, "--spin-constants", text, "--jmax", "1")
    code, out, err = call(*command, "--spin-weights", weights)
    assert (code, out) == (2, "")
    assert "in a total spin: the spin weights of this top count their" in err
    assert len(err.splitlines()) == 1
    code, _, err = call(*command, "--spin-weights", "ee=1,eo=1,oe=0,oo=0")
    assert code == 0, err


def test_weights_of_other_nuclei_beside_a_pair():
    """Of CH2Cl2 with the total spin of 35Cl the weights are those of the protons, with that of the protons those of 35Cl."""
    geometry = rotor.read("H2CCl2")
    chlorines = SpinConstants.parse("chi_aa(35Cl_1)=-40 chi_aa(35Cl_2)=-40", "35Cl_1+35Cl_2")
    protons = SpinConstants.parse("C_iso(1H_1)=-.03 C_iso(1H_2)=-.03", "1H_1+1H_2")
    all_nuclei = geometry.spin_weights
    spin_weights = SpinWeights.from_mapping({"ee": 1, "eo": 3, "oe": 3, "oo": 1})
    value = SpinWeights.from_mapping({"ee": 3, "eo": 5, "oe": 5, "oo": 3})
    assert spin_weights.with_pair(3) == all_nuclei == value.with_pair(1)
    for weights, spins in ((spin_weights, chlorines), (value, protons)):
        top = replace(geometry.with_weights(weights.to_mapping(), "given"), spin_constants=spins)
        assert len(effects_of(top, True)) > 2
        twice = replace(geometry, spin_constants=spins)
        with pytest.raises(ValueError, match="count their"):
            effects_of(twice, True)


def test_a_geometry_tells_the_weights_of_another_such_pair():
    """Four protons in two pairs: beside the total spin of one pair the other has 3:1, which without a geometry is taken for the pair's."""
    furan = rotor.read("C4H4O")
    spins = SpinConstants.parse("C_iso(1H_1)=-.03 C_iso(1H_2)=-.03", "1H_1+1H_2")
    names = furan.spin_weights.to_mapping()
    other = {name: 1 if weight == max(names.values()) else 3 for name, weight in names.items()}
    known = replace(furan.with_weights(other, "of the other pair"), spin_constants=spins)
    assert SpinWeights.from_mapping(other).with_pair(1) == furan.spin_weights
    assert len(effects_of(known, True)) > 2
    with pytest.raises(ValueError, match="count their 4 functions"):
        effects_of(Top.from_constants("A=9 B=8 C=4 GHz", spin_weights=other, spin_constants=spins), True)


def test_weights_of_states_that_count_a_pair_are_refused(call, folder):
    constants = "".join(
        f'"{name}[1]" = {value}\n' for name, value in {"E": 1e3, "A": 282e3, "B": 388e2, "C": 34e3}.items()
    )
    states = f"[states]\n{constants}[states.weights]\n1 = {{ ee = 1, eo = 1, oe = 3, oo = 3 }}\n"
    (folder / "two.toml").write_text(PROTONS + states)
    code, _, err = call("levels", "two.toml", "--hyperfine", "--jmax", "1")
    assert code == 2
    assert "count their 4 functions already" in err
