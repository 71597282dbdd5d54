"""Ammonia of the library: lines measured in laboratories, levels that exist, Q of the catalogue; ND3 with the other weights.

Measured: the centre of 1(0)-0(0), 572,498.15977(20) MHz (G. Cazzoli, L. Dore, C. Puzzarini, Astron. Astrophys. 507 (2009) 1707, table
2, fit I); inversion lines as they stand in lists of rest frequencies (F. J. Lovas, NIST 2004, in many observers' scripts; digits to
0.1 kHz). ND3: the lines of E. Canè et al., J. Mol. Spectrosc. 395 (2023) 111797, as github.com/oleksiysmola/MARVEL-ND3 lists them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from places import PROJECT

import rotor
from rotor import units
from rotor.formats.lines.line_tables import catalogue
from rotor.formats.molecules.level_table import read_level_table, write_level_table
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.solve import solve_levels
from rotor.spectra.lines import line_list
from rotor.thermodynamics.functions import thermodynamic_functions
from rotor.thermodynamics.sums.partition import partition_function
from rotor.tops.isotopes.isotopologues import isotopologue
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.spins.spin_statistics import statistical_weights
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.states.state_constants import StateConstants
from rotor.tops.states.state_texts import with_state_texts
from rotor.tops.top import Top

AMMONIA = rotor.read("NH3")
INVERSION = {  # (J, K): MHz
    (1, 1): 23694.4955, (2, 2): 23722.6333, (3, 3): 23870.1292, (4, 4): 24139.4163, (5, 5): 24532.9887, (6, 6): 25056.0250,
    (7, 7): 25715.1820, (2, 1): 23098.8190, (3, 2): 22834.1820,
}  # fmt: skip
ROTATION = 572498.15977
JPL_LOG_Q = {300: 2.7700, 225: 2.5802, 150: 2.3179, 75: 1.8759, 37.5: 1.4477, 18.75: 1.0644, 9.375: 0.7587}  # tag 17002
V2_CM = (932.434, 968.122)  # ν2 = 1, s and a, which that Q counts


def _splitting(levels, j: int, k: int) -> float:
    return float(levels.energy_mhz[levels.find(v=1, j=j, k=k)] - levels.energy_mhz[levels.find(v=0, j=j, k=k)])


def test_measured_lines():
    lines = line_list(AMMONIA, jmax=8, range_mhz=(0.0, 600e3))
    quanta = np.hstack([lines.quanta(lines.upper), lines.quanta(lines.lower)])
    computed = {tuple(q): f for q, f in zip(quanta.tolist(), lines.frequency_mhz.tolist(), strict=True)}
    for (j, k), frequency in INVERSION.items():
        tolerance = (
            5e-3 if (j, k) == (3, 2) else 5e-4
        )  # sources differ in (3,2) by 3 kHz; file's rounding of two energies
        assert computed[1, j, k, 0, j, k] == pytest.approx(frequency, abs=tolerance)
    assert computed[0, 1, 0, 1, 0, 0] == pytest.approx(
        ROTATION, abs=5e-4
    )  # what rounding leaves; 2 kHz of pressure shift
    assert not any(upper[2] == 0 and upper[0] == 1 and upper[1] % 2 for upper in quanta[:, :3].tolist())


def test_constants_alone_are_as_good_as_the_file_says():
    """a - s within 0.2 MHz, levels within 3 MHz; those of K = 3 by 1.7e-4 MHz (J+3)!/(J-3)! off, in turn up and down."""
    table = AMMONIA.level_table
    alone = solve_levels(replace(AMMONIA, level_table=None), 10)
    for (j, k), frequency in INVERSION.items():
        assert _splitting(alone, j, k) == pytest.approx(frequency, abs=0.2)
    assert alone.energy_mhz[alone.find(v=0, j=1, k=0)] - alone.energy_mhz[alone.find(v=1, j=0, k=0)] == pytest.approx(
        ROTATION, abs=0.2
    )
    rows = alone.rows_of(**table.quanta)
    off = alone.energy_mhz[rows] - table.energy_mhz
    j, k, v = (table.quanta[name] for name in "jkv")
    doubled = (k == 3) & (j > 3)
    assert np.abs(off[~doubled]).max() < 3.0
    assert off[~doubled].std() < 0.9
    factor = np.prod([j + 3, j + 2, j + 1, j, j - 1, j - 2], axis=0) * np.where((j + v) % 2, -1, 1)
    ratio = off[doubled] / (1.7e-4 * factor[doubled])
    assert np.abs(np.abs(ratio).mean() - 1) < 0.05  # 1.70e-4 is rounded; the model's own error is up to 3 MHz
    assert (np.sign(ratio) == np.sign(ratio[0])).all()


def test_levels_that_exist():
    """Of K = 0 those of 0+ with odd J and of 0- with even J alone; ortho (K a multiple of 3) weighs 4, para 2, as pairs."""
    levels = solve_levels(AMMONIA, 4)
    v, j, k = (levels.quanta[name] for name in "vjk")
    expected = np.where(k == 0, np.where((j + v) % 2 == 1, 4, 0), np.where(k % 3 == 0, 4, 2))
    np.testing.assert_array_equal(levels.weight, expected)
    assert levels.ground_mhz == pytest.approx(23785.6961, abs=1e-3)  # 0(0) of 0-; digits of the file


def test_weights_are_those_of_the_permutations():
    for v, inversion in enumerate(("symmetric", "antisymmetric")):
        assert statistical_weights(AMMONIA.molecule, inversion=inversion) == AMMONIA.states.weights[v]


@pytest.mark.parametrize("temperature_k", JPL_LOG_Q)
def test_q_is_the_catalogue_s(temperature_k):
    """JPL 17002: log Q with ν2 = 1 in it, which the rotation here has not."""
    q = partition_function(AMMONIA, temperature_k).q
    vibration = np.exp(-np.array(V2_CM) * units.MHZ_PER_CM / units.MHZ_PER_K / temperature_k).mean()
    assert np.log10(q * (1 + vibration)) == pytest.approx(
        JPL_LOG_Q[temperature_k], abs=1.5e-4
    )  # digits; B of ν2 = 1 is 0.5 % off


def test_quadrupole_components_of_the_first_rotational_line():
    """1(0)-0(0) by F of 14N, table 1 of Cazzoli et al., each the mean of what protons split by up to 0.06 MHz."""
    measured = {1: (572497.1247 + 572497.1565) / 2, 2: (572498.3391 + 572498.3885 + 572498.3979) / 3, 0: 572500.1913}
    top = AMMONIA
    lines = line_list(top, jmax=1, effects=effects_of(top, hyperfine=True), range_mhz=(5e5, 6e5), min_lgint=None)
    by_name = dict(zip(lines.levels.quanta["f"][lines.upper].tolist(), lines.frequency_mhz.tolist(), strict=True))
    for f, frequency in measured.items():
        assert by_name[f] == pytest.approx(frequency, abs=0.03)  # half of what the protons split


GROUPS = {  # kHz from the centre, of components F1' - F1'' that protons part by up to 0.06 MHz, and the frequencies that parts them
    (1, 1): ((-1540.8, -600.7, 0.0, 600.0, 1541.5), (-1000, -300, 300, 1000)),
    (2, 2): ((-2059.4, -1295.5, 0.0, 1294.7, 2059.4), (-1700, -300, 300, 1700)),
}


@pytest.mark.parametrize("quanta", GROUPS)
def test_quadrupole_groups_of_inversion_lines(quanta):
    """Five groups of (1,1) and (2,2), 18 and 21 components with relative strengths in velocities to 0.1 m/s (8 Hz).

    Read in pyspeckit/spectrum/models/ammonia_constants.py of the repository pyspeckit/pyspeckit (commit 1aa2a44), where they stand
    without a reference; lines first resolved by S. G. Kukolich, Phys. Rev. 156 (1967) 83. Here the mean of each group, by strength. (3,3)
    is not compared: its protons have a total spin of 3/2 and move the groups by 7 kHz.
    """
    computed, edges = GROUPS[quanta]
    j = quanta[0]
    lines = line_list(AMMONIA, jmax=j, effects=effects_of(AMMONIA, True), range_mhz=(23e3, 24e3), min_lgint=None)
    rows = (lines.quanta(lines.upper)[:, 1:3] == quanta).all(axis=1)
    strength = lines.strength_debye2[rows]
    offsets = (lines.frequency_mhz[rows] - np.average(lines.frequency_mhz[rows], weights=strength)) * 1e3
    group = np.digitize(offsets, edges)
    means = [np.average(offsets[group == i], weights=strength[group == i]) for i in range(5)]
    assert means == pytest.approx(
        computed, abs=1.3
    )  # both sides of a pair differ by 0.8: what protons do to the means is left out
    bare = replace(AMMONIA, spin_constants=SpinConstants.parse("chi_cc(14N)=-4.08983MHz"))
    plain = line_list(bare, jmax=j, effects=effects_of(bare, True), range_mhz=(23e3, 24e3), min_lgint=None)
    assert (
        np.abs(np.sort(plain.frequency_mhz[rows]) - np.sort(lines.frequency_mhz[rows])).max() > 5e-3
    )  # spin-rotation shows


def test_levels_with_spins_are_those_of_the_table():
    """The centres of inversion lines with hyperfine structure are the measured ones; each line stands once, by v, N, K, F."""
    plain = line_list(AMMONIA, jmax=10, range_mhz=(20e3, 30e3), min_lgint=None)
    split = line_list(AMMONIA, jmax=10, effects=effects_of(AMMONIA, True), range_mhz=(20e3, 30e3), min_lgint=None)
    assert list(split.levels.quanta) == ["v", "n", "k", "f"]
    of, whole = split.quanta(split.upper)[:, :3], plain.quanta(plain.upper)
    for line, (quanta, frequency) in enumerate(zip(whole.tolist(), plain.frequency_mhz.tolist(), strict=True)):
        rows = (of == quanta).all(axis=1)
        centre = np.average(split.frequency_mhz[rows], weights=split.strength_debye2[rows])
        assert centre == pytest.approx(frequency, abs=1e-4)  # second order: chi²/(100 GHz)
        total = split.intensity_nm2_mhz[rows].sum()
        assert total == pytest.approx(plain.intensity_nm2_mhz[line], rel=1e-5)  # Boltzmann's factor within a line
    k3 = solve_levels(AMMONIA, 10, effects=effects_of(AMMONIA, True))
    computed = k3.energy_mhz[k3.find(v=0, n=10, k=3, f=10)] - solve_levels(AMMONIA, 10).energy_mhz[0]
    table = AMMONIA.level_table
    known = table.energy_mhz[table.rows_of({"v": [0], "j": [10], "k": [3]})[0]]
    assert computed == pytest.approx(known, abs=3.0)  # the constants alone are 210 MHz off, splittings within 2 MHz


def test_spins_off_the_axis_take_the_table_too():
    spins = SpinConstants.parse("chi_aa(14N)=1 chi_ac(14N)=0.5 MHz")
    top = replace(AMMONIA, spin_constants=spins)
    levels = solve_levels(top, 2, effects=effects_of(top, True))
    rows = (levels.quanta["n"] == 2) & (levels.quanta["kc"] == 2) & (levels.quanta["f"] == 2)
    low, high = (levels.energy_mhz[rows & (levels.quanta["v"] == v)].mean() for v in (0, 1))
    assert high - low == pytest.approx(INVERSION[2, 2], abs=1e-3)  # both split alike


def test_states_go_with_the_constants_of_this_isotopologue_alone():
    assert isotopologue(AMMONIA, {"H": "2H"}).top.states is None


def test_errors_of_lines_are_those_of_the_table():
    """5 kHz of inversion lines, in which the whole errors of 3 MHz are shared; none of levels beyond J = 10; spins change nothing."""
    lines = line_list(AMMONIA, jmax=12, range_mhz=(0.0, 600e3), min_lgint=None)
    assert lines.errors_from == "the table of energies"
    up, low = lines.quanta(lines.upper), lines.quanta(lines.lower)
    inside = (up[:, 1] <= 10) & (low[:, 1] <= 10)
    np.testing.assert_array_equal(np.isnan(lines.error_mhz), ~inside)
    inversion = inside & (up[:, 1:] == low[:, 1:]).all(axis=1)
    assert lines.error_mhz[inversion] == pytest.approx(0.0035 * np.sqrt(2))
    computed = {tuple(q): row for row, q in enumerate(np.hstack([up, low]).tolist())}
    for (j, k), frequency in INVERSION.items():
        row = computed[1, j, k, 0, j, k]
        assert abs(lines.frequency_mhz[row] - frequency) < 1.01 * lines.error_mhz[row]  # the worst, (3,2), is the 5 kHz
    rotation = computed[0, 1, 0, 1, 0, 0]
    assert lines.error_mhz[rotation] == pytest.approx(3.0 * np.sqrt(2))
    split = line_list(AMMONIA, jmax=2, effects=effects_of(AMMONIA, True), range_mhz=(23e3, 24e3), min_lgint=None)
    assert split.error_mhz == pytest.approx(0.0035 * np.sqrt(2))
    assert line_list(replace(AMMONIA, level_table=None), jmax=2).error_mhz is None
    assert (catalogue(lines).error_mhz[~inside] == 0).all()  # where it is not known


def test_a_table_with_own_errors_is_written_and_read(tmp_path):
    path = tmp_path / "levels.csv"
    write_level_table(AMMONIA.level_table, path)
    again = read_level_table(path)
    for name, column in AMMONIA.level_table.columns.items():
        np.testing.assert_array_equal(again.columns[name], column)
    path.write_text(path.read_text().replace("own_error_mhz", "note"))
    assert read_level_table(path).own_error_mhz is None
    with pytest.raises(ValueError, match="expected a table with own_error_mhz"):
        read_level_table(path).line_errors(np.array([0]), np.array([1]))


# ND3


ND3_WEIGHTS = ({"0even": 10, "0odd": 1, "1": 4, "2": 4}, {"0even": 1, "0odd": 10, "1": 4, "2": 4})
ND3_INVERSION = {(1, 1): 1589.006, (2, 1): 1568.357, (2, 2): 1591.695}  # MHz
ND3_ROTATION = (306736.710, 309909.490)  # 1(0)-0(0): 0+ from 0-, 0- from 0+


def _nd3() -> Top:
    """B, C of 0- less those of 0+, and E, from three inversion lines; B of 0+ from one line of rotation."""
    b = (ND3_INVERSION[2, 1] - ND3_INVERSION[1, 1]) / 4
    c = (ND3_INVERSION[2, 2] - ND3_INVERSION[2, 1]) / 3 + b
    energy = ND3_INVERSION[1, 1] - b - c
    low, axial = (ND3_ROTATION[0] + energy) / 2, 94000.0
    states = StateConstants(
        {"E[1]": energy, "B[1]": low + b, "C[1]": axial + c},
        weights={v: SpinWeights.from_mapping(item) for v, item in enumerate(ND3_WEIGHTS)},
        dipoles={(0, 0): (0, 0, 0), (1, 1): (0, 0, 0), (0, 1): (0, 0, 1.497)},
    )
    return Top.from_constants({"B": low, "C": axial}, dipole_abc_debye=(0, 0, 1.497), states=states)


def test_nd3_has_both_halves_of_every_doublet():
    """The second line of 1(0)-0(0) from the others; both exist, 10 : 1 by weight (CDMS 020501: A1, A2, E as 10 : 1 : 8, E of both K)."""
    heavy = isotopologue(AMMONIA, {"H": "2H"}).top.molecule
    for weights, inversion in zip(ND3_WEIGHTS, ("symmetric", "antisymmetric"), strict=True):
        assert statistical_weights(heavy, inversion=inversion).to_mapping() == weights
    top = _nd3()
    assert top.states.values["E[1]"] == pytest.approx(1591.6, abs=0.1)  # CDMS 020501; quartic terms left out here
    lines = line_list(top, jmax=1, min_lgint=None)
    quanta = np.hstack([lines.quanta(lines.upper), lines.quanta(lines.lower)]).tolist()
    first, second = (quanta.index([v, 1, 0, 1 - v, 0, 0]) for v in (0, 1))
    computed = lines.frequency_mhz[[first, second]]
    assert computed == pytest.approx(
        ND3_ROTATION, abs=0.2
    )  # quartic terms: their difference between the states is 0.05 MHz
    populations = lines.intensity_nm2_mhz[[first, second]]
    assert populations[0] / populations[1] == pytest.approx(
        0.1 * (computed[0] / computed[1]) ** 2, rel=2e-3
    )  # ν² for hν << kT
    assert [lines.g_upper[i] for i in (first, second)] == [3, 30]


HEAVY = rotor.read("ND3")
LINES = PROJECT / "data" / "lines" / "ND3.csv"


def _lines_of_nd3() -> np.ndarray:
    return np.loadtxt(LINES, delimiter=",", skiprows=1)


def test_nd3_of_the_library_meets_measured_lines():
    """35 lines of inversion, 0.3 errors of 10 kHz; 84 of rotation, 1.4 errors, most of 3 MHz; constants as the file has them."""
    table = _lines_of_nd3()
    levels = solve_levels(HEAVY, 10)
    ends = [
        levels.rows_of(v=side[:, 0], j=side[:, 1], k=side[:, 2])
        for side in (table[:, :3].astype(int), table[:, 3:6].astype(int))
    ]
    off = (table[:, 6] - (levels.energy_mhz[ends[0]] - levels.energy_mhz[ends[1]])) / table[:, 7]
    inversion = (table[:, 1:3] == table[:, 4:6]).all(axis=1)
    assert (inversion.sum(), (~inversion).sum()) == (35, 84)
    assert np.sqrt(np.mean(off[inversion] ** 2)) < 0.4  # 0.29 in the fit; digits of the file
    assert np.sqrt(np.mean(off[~inversion] ** 2)) < 1.45  # 1.37
    assert np.abs(off).max() < 4.5  # 6(4)-5(4), 4.4 errors; the list's own fit is 4.2 off there
    assert statistical_weights(HEAVY.molecule, inversion="symmetric") == HEAVY.states.weights[0]
    assert statistical_weights(HEAVY.molecule, inversion="antisymmetric") == HEAVY.states.weights[1]
    assert statistical_weights(HEAVY.molecule) == HEAVY.spin_weights


def test_k_3_of_nd3_lies_between_its_halves():
    """Measured: 1599.645 and 1599.704 for (3,3), 1453.125 and 1448.056 for (6,3); what J+^6 + J-^6 parts is left out."""
    levels = solve_levels(HEAVY, 6)
    for j, (first, other), tolerance in ((3, (1599.645, 1599.704), 0.01), (6, (1453.125, 1448.056), 0.05)):
        assert _splitting(levels, j, 3) == pytest.approx(
            (first + other) / 2, abs=tolerance
        )  # 10 kHz of each; constants not fitted to them


STATES_WITH_WEIGHTS = {
    "state_constants": "E[1]=5GHz A[1]=9GHz B[1]=8GHz C[1]=7GHz",
    "state_weights": "[0] ee=1,eo=3,oe=3,oo=1 [1] ee=3,eo=1,oe=1,oo=3",
}


@pytest.mark.parametrize("case", ["NH3", "ND3", "given"])
def test_classical_q_counts_states_as_the_sum_does(case):
    """Weights of the top that are sums of those of its states, as of ND3 (11, 8, 8), count once."""
    if case == "given":
        top = with_state_texts(Top.from_constants("A=9 B=8 C=7 GHz"), STATES_WITH_WEIGHTS, "given")
    else:
        top = rotor.read(case)
        species = {name: thermodynamic_functions(top, [300.0], species=name) for name in ("para", "ortho")}
        for component in species.values():
            assert component.q_rot_classical[0] == pytest.approx(
                component.q_rot[0], rel=0.02
            )  # quantum corrections and distortion
    functions = thermodynamic_functions(top, [300.0])
    assert functions.q_rot_corrected[0] == pytest.approx(
        functions.q_rot[0], rel=1e-4
    )  # distortion of state 0 serves both
    factors = {"NH3": 8, "ND3": 27}  # (2I+1)³
    assert functions.spin_factor == pytest.approx(factors.get(case, functions.spin_factor), rel=1e-12)  # rounding
