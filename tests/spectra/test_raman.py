"""Rotational Raman lines: closed forms, sum rules, QuTiP's Clebsch-Gordan coefficients, joins, and measured gases."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import qutip
from hypothesis import given, settings
from hypothesis import strategies as st
from slow_matrix import AXES, watson_matrix

import rotor
from rotor.quantum.blocks.reduced import wang_amplitudes
from rotor.quantum.operators.symmetric_top_elements import coupling
from rotor.quantum.operators.tensors import body_tensor
from rotor.quantum.solve import solve_levels
from rotor.spectra.raman.raman import anisotropy_angstrom3, band_cross_section, jmax_for_raman, raman_lines
from rotor.spectra.raman.strengths import anisotropy_squared, raman_transitions
from rotor.tops.constants.constants import Constants
from rotor.tops.constants.operators import REPRESENTATIONS
from rotor.tops.top import Top

ROD = ((2.2, 0, 0), (0, 1.5, 0), (0, 0, 1.5))
DISC = ((2.0, 0, 0), (0, 2.0, 0), (0, 0, 1.4))
SKEW = np.array([[2.1, 0.3, -0.2], [0.3, 1.4, 0.5], [-0.2, 0.5, 1.0]])


def top_of(text: str, tensor, **others) -> Top:
    return Top.from_constants(text, **others).with_polarizability(tensor, "made up")


# Linear molecules


def placzek_teller_linear(j: int) -> float:
    return 3 * (j + 1) * (j + 2) / (2 * (2 * j + 1) * (2 * j + 3))


def test_linear_positions_and_strengths():
    lines = raman_lines(top_of("B=2 D=1e-5 cm-1", ROD), jmax=30, min_relative=None)
    stokes = lines.where(lines.shift_mhz > 0)
    j = stokes.levels.quanta["j"][stokes.initial]
    assert j.tolist() == list(range(29))
    at = j + 1.5
    assert stokes.shift_cm == pytest.approx(
        (4 * 2 - 6e-5) * at - 8e-5 * at**3, abs=1e-9
    )  # (4B - 6D)(J+3/2) - 8D(J+3/2)³
    expected = [(2 * n + 1) * placzek_teller_linear(n) * 0.7**2 for n in range(29)]
    assert stokes.strength_angstrom6 == pytest.approx(expected, rel=1e-13)  # round-off
    anti = lines.where(lines.shift_mhz < 0)
    assert sorted(-anti.shift_mhz) == pytest.approx(stokes.shift_mhz, rel=1e-14)


def test_linear_sum_over_final_states():
    """Placzek and Teller: b(J→J) + b(J→J+2) + b(J→J-2) = 1."""
    transitions = raman_transitions(solve_levels(top_of("B=1 cm-1", ROD), 12), ROD)
    for j in range(11):
        elastic = j * (j + 1) * (2 * j + 1) / ((2 * j - 1) * (2 * j + 3)) * 0.49
        around = transitions.strength_angstrom6[(transitions.lower == j) | (transitions.upper == j)].sum()
        assert elastic + around == pytest.approx((2 * j + 1) * 0.49, rel=1e-13)  # round-off


# Symmetric tops


def b_symmetric(j: int, k: int, rise: int) -> float:
    """Coefficients of Placzek and Teller for ΔK = 0 as they are printed."""
    if rise == 1:
        return 3 * k**2 * ((j + 1) ** 2 - k**2) / (j * (j + 1) * (2 * j + 1) * (j + 2)) if j else 0.0
    return 3 * ((j + 1) ** 2 - k**2) * ((j + 2) ** 2 - k**2) / (2 * (j + 1) * (j + 2) * (2 * j + 1) * (2 * j + 3))


@pytest.mark.parametrize(("text", "tensor", "gamma"), [("A=5 B=2 cm-1", ROD, 0.7), ("B=5 C=3 cm-1", DISC, 0.6)])
def test_symmetric_strengths(text, tensor, gamma):
    levels = solve_levels(top_of(text, tensor), 9)
    transitions = raman_transitions(levels, tensor)
    seen = {}
    for s, low, up in zip(transitions.strength_angstrom6, transitions.lower, transitions.upper, strict=True):
        assert levels.quanta["k"][low] == levels.quanta["k"][up]
        j, k = int(levels.quanta["j"][low]), int(levels.quanta["k"][low])
        seen[j, k, int(levels.quanta["j"][up]) - j] = s / ((2 * j + 1) * (2 if k else 1) * gamma**2)
    allowed = {(j, k, r) for r in (1, 2) for j in range(10 - r) for k in range(j + 1) if b_symmetric(j, k, r)}
    assert seen.keys() == allowed
    for (j, k, rise), value in seen.items():
        assert value == pytest.approx(b_symmetric(j, k, rise), rel=1e-12)  # round-off


def test_symmetric_top_has_r_and_s_branches_at_2b_and_4b():
    lines = raman_lines(top_of("A=5 B=2 cm-1", ROD), jmax=6, min_relative=None)
    shifts = np.unique(lines.shift_cm[lines.shift_cm > 0].round(9))
    assert shifts.tolist() == sorted({2 * 2 * (j + 1) for j in range(1, 6)} | {4 * 2 * (j + 1.5) for j in range(5)})


def test_a_tensor_that_is_not_axial_changes_k():
    """A top that is symmetric by numbers alone: the sum over all final states, elastic ones among them, is γ²."""
    tensor = SKEW
    levels = solve_levels(top_of("A=5 B=2 cm-1", tensor), 8)
    transitions = raman_transitions(levels, tensor)
    steps = set((levels.quanta["k"][transitions.upper] - levels.quanta["k"][transitions.lower]).tolist())
    assert steps == {-2, -1, 0, 1, 2}
    for row in np.flatnonzero(levels.quanta["j"] <= 6):
        j, k = int(levels.quanta["j"][row]), int(levels.quanta["k"][row])
        axial = 2 * tensor[0, 0] - tensor[1, 1] - tensor[2, 2]
        elastic = 1.5 * axial**2 / 6 * coupling(j, j, 2, 0, k) ** 2 * (2 if k else 1)
        if k == 1:  # k = 1 to -1 and back
            across = (tensor[1, 1] - tensor[2, 2]) ** 2 / 4 + tensor[1, 2] ** 2
            elastic += 2 * 1.5 * across * coupling(j, j, 2, 2, -1) ** 2
        around = transitions.strength_angstrom6[(transitions.lower == row) | (transitions.upper == row)].sum()
        expected = (2 * j + 1) * levels.components[row] * anisotropy_squared(tensor)
        assert elastic + around == pytest.approx(expected, rel=1e-12)  # round-off


# Asymmetric tops


def slow_strengths(values, representation, tensor, jmax):
    """S between all states, by energy order in each J, from full matrices and QuTiP's coefficients."""
    at = ["abc".index(axis) for axis in AXES[representation]]
    t = np.asarray(tensor)[np.ix_(at, at)]
    part = {0: (2 * t[2, 2] - t[0, 0] - t[1, 1]) / math.sqrt(6)}
    for sign in (1, -1):
        part[sign] = -sign * t[0, 2] - 1j * t[1, 2]
        part[2 * sign] = (t[0, 0] - t[1, 1]) / 2 + sign * 1j * t[0, 1]
    states = [np.linalg.eigh(watson_matrix(values, "A", representation, j))[1] for j in range(jmax + 1)]
    out = {}
    for j in range(jmax + 1):
        for j2 in range(j, min(j + 2, jmax) + 1):
            matrix = np.zeros((2 * j2 + 1, 2 * j + 1), dtype=complex)
            for col, k in enumerate(range(j, -j - 1, -1)):
                for row, k2 in enumerate(range(j2, -j2 - 1, -1)):
                    if abs(k2 - k) <= 2 <= j + j2:
                        matrix[row, col] = part[k2 - k] * math.sqrt(2 * j + 1) * qutip.clebsch(j, 2, j2, k, k2 - k, k2)
            out[j, j2] = 1.5 * np.abs(states[j2].conj().T @ matrix @ states[j]) ** 2
    return out


@pytest.mark.parametrize("representation", list(REPRESENTATIONS))
def test_strengths_are_those_of_full_matrices(representation):
    values = {"A": 9.0, "B": 6.0, "C": 4.0, "DeltaK": 1e-3}
    top = Top(Constants(reduction="A", representation=representation, **values))
    levels = solve_levels(top, 5)
    transitions = raman_transitions(levels, SKEW)
    rank = np.zeros(len(levels), dtype=int)
    for j in range(6):
        rows = np.flatnonzero(levels.quanta["j"] == j)
        rank[rows[np.argsort(levels.energy_mhz[rows])]] = np.arange(len(rows))

    slow = slow_strengths(values, representation, SKEW, 5)
    total = 0.0
    for s, low, up in zip(transitions.strength_angstrom6, transitions.lower, transitions.upper, strict=True):
        (j, a), (j2, b) = sorted((int(levels.quanta["j"][row]), int(rank[row])) for row in (low, up))
        assert s == pytest.approx(slow[j, j2][b, a], abs=1e-9)  # near-degenerate vectors of the full matrix
        total += s
    inelastic = sum(m.sum() if j != j2 else (m.sum() - np.trace(m)) / 2 for (j, j2), m in slow.items())
    assert total == pytest.approx(inelastic, rel=1e-12)  # nothing is missing


@given(values=st.tuples(*[st.floats(1.0, 20.0)] * 3), tensor=st.lists(st.floats(-3, 3), min_size=6, max_size=6))
@settings(max_examples=25)
def test_sum_over_final_states(values, tensor):
    """Σ_f S = (2J+1) γ² for every state of any asymmetric top and any tensor, with the elastic term."""
    c, b, a = sorted(values)
    if b - c < 1e-3 or a - b < 1e-3:
        return
    aa, bb, cc, ab, ac, bc = tensor
    alpha = np.array([[aa, ab, ac], [ab, bb, bc], [ac, bc, cc]])
    levels = solve_levels(Top.from_constants(f"A={a!r} B={b!r} C={c!r} GHz"), 6)
    transitions = raman_transitions(levels, alpha)
    gamma2 = anisotropy_squared(alpha)
    polarizability = body_tensor(alpha, 2, levels.representation)
    for block in (block for block in levels.blocks if block.basis.j <= 4):
        elastic = 1.5 * np.diag(wang_amplitudes(block, block, polarizability)) ** 2
        for i in range(block.basis.size):
            row = block.start + i
            around = transitions.strength_angstrom6[(transitions.lower == row) | (transitions.upper == row)].sum()
            expected = (2 * block.basis.j + 1) * gamma2
            assert elastic[i] + around == pytest.approx(expected, rel=1e-10, abs=1e-12 + 1e-14 * expected)  # round-off


def test_strengths_do_not_depend_on_the_representation():
    """One rigid top, six representations: the same strengths, to round-off of the vectors."""
    results = []
    for representation in REPRESENTATIONS:
        levels = solve_levels(Top(Constants(A=9, B=6, C=4, representation=representation)), 6)
        t = raman_transitions(levels, SKEW)
        key = [tuple(levels_key(levels, row)) for row in range(len(levels))]
        results.append({frozenset((key[a], key[b])): s for s, a, b, _ in zip(*dataclasses.astuple(t), strict=True)})
    for other in results[1:]:
        for pair in results[0].keys() | other.keys():
            assert other.get(pair, 0.0) == pytest.approx(results[0].get(pair, 0.0), abs=1e-10)


def levels_key(levels, row):
    return int(levels.quanta["j"][row]), int(levels.quanta["ka"][row]), int(levels.quanta["kc"][row])


@pytest.mark.parametrize(("near", "exact", "tensor"), [
    ("A=9 B=4.000001 C=4 GHz", "A=9 B=4 GHz", ROD), ("A=9 B=8.999999 C=4 GHz", "B=9 C=4 GHz", DISC),
])  # fmt: skip
def test_asymmetric_tops_join_symmetric_ones(near, exact, tensor):
    """Where B - C goes to 0, strengths at each shift become those of the symmetric top."""
    sums = []
    for text in (near, exact):
        lines = raman_lines(top_of(text, tensor), jmax=7, min_relative=None)
        lines = lines.where(
            lines.shift_mhz > 1.0
        )  # between the two levels of an asymmetric doublet: no line in the limit
        order = np.round(lines.shift_mhz / 500)
        sums.append({key: lines.cross_section_cm2_per_sr[order == key].sum() for key in np.unique(order)})
    strong = {key for key, value in sums[1].items() if value > 0}
    for key in strong:
        assert sums[0][key] == pytest.approx(sums[1][key], rel=1e-4, abs=0)  # (B - C)/(A - C), times J² of mixing
    rest = sum(value for key, value in sums[0].items() if key not in strong)
    assert rest < 1e-9 * sum(sums[1].values())


def test_selection_rules_of_an_asymmetric_top():
    """Diagonal tensor: species stay; α_ab, α_ac, α_bc: Ka Kc change as the products of two dipole components."""
    levels = solve_levels(Top.from_constants("A=9 B=6 C=4 GHz"), 6)
    changes = {(0, 0): (0, 0), (0, 1): (1, 0), (0, 2): (1, 1), (1, 2): (0, 1)}  # element -> parity of (ΔKa, ΔKc)
    for (g, h), parity in changes.items():
        tensor = np.zeros((3, 3))
        tensor[g, h] = tensor[h, g] = 1.0
        transitions = raman_transitions(levels, tensor)
        seen = {
            (
                (int(levels.quanta["ka"][u]) - int(levels.quanta["ka"][d])) % 2,
                (int(levels.quanta["kc"][u]) - int(levels.quanta["kc"][d])) % 2,
            )
            for u, d in zip(transitions.upper, transitions.lower, strict=True)
        }
        assert seen == {parity}
        assert set(np.abs(levels.quanta["j"][transitions.upper] - levels.quanta["j"][transitions.lower]).tolist()) == {
            0,
            1,
            2,
        }


# Spherical tops


def test_spherical_tops_have_none():
    assert len(raman_lines(rotor.read("CH4"), jmax=5)) == 0
    assert anisotropy_angstrom3(rotor.read("CH4")) == 0.0
    with pytest.raises(ValueError, match="a spherical top has an isotropic polarizability"):
        raman_lines(top_of("A=5 B=5 C=5 cm-1", ROD), jmax=5)


# Gases


def stokes_of(name: str, **options):
    lines = raman_lines(rotor.read(name), **options)
    return lines.where(lines.shift_mhz > 0)


def test_nitrogen_alternates_two_to_one():
    lines = stokes_of("N2", temperature_k=3e3, jmax=12, min_relative=None)  # ten levels nearly evenly populated
    j = lines.levels.quanta["j"][lines.initial]
    per_strength = lines.cross_section_cm2_per_sr / lines.strength_angstrom6 / lines.scattered_cm**4
    assert per_strength[j == 4] / per_strength[j == 5] == pytest.approx(
        2 * math.exp((10 * 1.98958 - 500 * 5.76e-6) * 1.438777 / 3e3), rel=1e-6
    )
    assert set(j.tolist()) == set(range(11))


@pytest.mark.parametrize(("name", "parity", "first"), [("O2", 1, 14.3761), ("CO2", 0, 2.3413)])
def test_oxygen_and_carbon_dioxide_lack_every_second_line(name, parity, first):
    """The first lines are at 10 B (J = 1 to 3 of O2) and 6 B (J = 0 to 2 of CO2)."""
    lines = stokes_of(name)
    assert set((lines.levels.quanta["j"][lines.initial] % 2).tolist()) == {parity}
    assert lines.shift_cm[0] == pytest.approx(first, abs=1e-4)
    assert np.diff(lines.shift_cm)[:2] == pytest.approx(8 * lines.top.constants["B"] / 29979.2458, rel=1e-3)  # D


def test_hydrogen_meets_its_published_lines():
    """E. Roueff et al., Astron. Astrophys. 630 (2019) A58, table 2, from which the constants are: S0(0) to S0(4)."""
    published = [354.373130, 587.032025, 814.424302, 1034.670685, 1246.099547]
    assert stokes_of("H2").shift_cm[:5] == pytest.approx(published, abs=2e-4)  # four terms of its series leave 1.1e-4


def test_absolute_cross_sections_meet_measured_ones():
    """C. M. Penney, R. L. St. Peters and M. Lapp, J. Opt. Soc. Am. 64 (1974) 712, at 488.0 nm, all lines of the band.

    N2: 1.64e-29 cm²/sr ± 8 %; O2 2.61 ± 5 % and CO2 10.6 ± 10 % times that. The anisotropies of the library are those at
    632.8 nm, smaller than at 488 nm by some per cent, and the cross section goes with their square.
    """
    n2, o2, co2 = (band_cross_section(raman_lines(rotor.read(x), laser_nm=488.0)) for x in ("N2", "O2", "CO2"))
    assert n2 == pytest.approx(1.64e-29, rel=0.08, abs=0)
    assert o2 / n2 == pytest.approx(2.61, rel=0.11)  # found 9.8 % low, 3.7 % of it dispersion 632.8 to 488 nm
    assert co2 / n2 == pytest.approx(10.6, rel=0.15)  # found 13 % low


def test_a_cold_hand_calculation():
    """CO at 1 K, J = 0 to 2 alone: 7/45 (2π ν)⁴ γ² / Q, Q = 1 + 3 exp(-2B/kT)."""
    top = rotor.read("CO")
    lines = raman_lines(top, temperature_k=1.0, laser_nm=500.0, jmax=2, min_relative=None)
    s = lines.where((lines.shift_mhz > 0) & (lines.levels.quanta["j"][lines.initial] == 0)).cross_section_cm2_per_sr[0]
    q = 1 + 3 * math.exp(-2 * 1.922529 * 1.438777)
    assert s == pytest.approx(7 / 45 * (2 * math.pi * (20000 - 11.5350)) ** 4 * 0.5326**2 * 1e-48 / q, rel=1e-5, abs=0)


def test_stokes_and_anti_stokes_show_the_temperature():
    """Of one pair of levels the ratio is exp(shift/kT) ((ν - shift)/(ν + shift))⁴."""
    lines = raman_lines(rotor.read("N2"), temperature_k=250.0, laser_nm=532.0)
    stokes, anti = lines.where(lines.shift_mhz > 0), lines.where(lines.shift_mhz < 0)
    pairs = {
        (f, i): s
        for i, f, s in zip(anti.initial.tolist(), anti.final.tolist(), anti.cross_section_cm2_per_sr, strict=True)
    }
    laser = 1e7 / 532.0
    for i, f, s, shift in zip(
        stokes.initial.tolist(), stokes.final.tolist(), stokes.cross_section_cm2_per_sr, stokes.shift_cm, strict=True
    ):
        if (i, f) in pairs:
            expected = math.exp(1.438776877 * shift / 250.0) * ((laser - shift) / (laser + shift)) ** 4
            assert s / pairs[i, f] == pytest.approx(expected, rel=1e-7)  # digits of hc/k


def test_accidental_symmetric_tops_keep_the_weight_of_k_zero():
    """K = 0 to 2 with weights by parities: the population is that of the component with the weight of K = 0."""
    weights = {"ee": 1, "eo": 3, "oe": 2, "oo": 5}
    tensor = np.diag([2.0, 1.6, 1.1])
    totals = []
    for text in ("A=9 B=4 GHz", "A=9 B=4.0000001 C=4 GHz"):
        top = Top.from_constants(text, spin_weights=weights).with_polarizability(tensor, "made up")
        lines = raman_lines(top, jmax=6, min_relative=None)
        lines = lines.where(np.abs(lines.shift_mhz) > 100.0)
        place = np.round(lines.shift_mhz / 500)
        totals.append({p: lines.cross_section_cm2_per_sr[place == p].sum() for p in np.unique(place)})
    for p, value in totals[0].items():
        assert totals[1][p] == pytest.approx(value, rel=1e-5, abs=0)  # B - C


# What is asked for


@pytest.mark.parametrize("name", ["N2", "CO2", "water", "NH3"])
def test_the_default_j_max_loses_no_line(name):
    top = rotor.read(name)
    lines = raman_lines(top)
    more = raman_lines(top, jmax=lines.jmax + 6)
    assert len(more) == len(lines)
    assert more.shift_mhz == pytest.approx(lines.shift_mhz, rel=1e-12)


def test_the_cut_is_relative_and_none_keeps_all():
    top = rotor.read("N2")
    all_lines, cut = raman_lines(top, jmax=30, min_relative=None), raman_lines(top, jmax=30, min_relative=0.1)
    section = all_lines.cross_section_cm2_per_sr
    assert len(all_lines) == 58
    assert len(cut) == int((section >= 0.1 * section.max()).sum())
    assert jmax_for_raman(top, 300.0, 1e-12) > jmax_for_raman(top, 300.0, 1e-3)


def test_lines_beyond_the_laser_do_not_exist():
    lines = raman_lines(rotor.read("H2"), laser_nm=20000.0, temperature_k=1000.0)  # 500 cm⁻¹
    assert lines.shift_cm.max() < 500


@pytest.mark.parametrize(
    ("options", "said"),
    [({"temperature_k": 0.0}, "above 0 K"), ({"laser_nm": -1.0}, "laser wavelength"), ({"min_relative": 1.5}, "between 0 and 1"),
     ({"jmax": -1}, "J max must be 0 or more")],
)  # fmt: skip
def test_impossible_requests(options, said):
    with pytest.raises(ValueError, match=said):
        raman_lines(rotor.read("N2"), **options)


def test_unknown_polarizability_is_an_error():
    with pytest.raises(ValueError, match="polarizability of this top is not known"):
        raman_lines(Top.from_constants("B=2 cm-1"))
    with pytest.raises(ValueError, match="symmetric tensor"):
        top_of("B=2 cm-1", [[1, 2, 0], [0, 1, 0], [0, 0, 1]])


def test_tables_have_every_column():
    frame = raman_lines(rotor.read("NH3"), jmax=4).to_pandas()
    assert list(frame.columns) == [
        "shift_cm", "cross_section_cm2_per_sr", "wavelength_nm", "energy_initial_cm", "g_initial", "strength_angstrom6",
        "v_initial", "j_initial", "k_initial", "v_final", "j_final", "k_final",
    ]  # fmt: skip
    assert (np.diff(frame["shift_cm"]) >= 0).all()
    assert frame["wavelength_nm"].to_numpy() == pytest.approx(
        1e7 / (1e7 / 532 - frame["shift_cm"].to_numpy()), rel=1e-14
    )
