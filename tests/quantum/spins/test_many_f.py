"""Levels and lines of many F at once, against the same block by block and sums over parts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spin_elements import elements_of_parts

from rotor.quantum.blocks.reduced import connections
from rotor.quantum.effects.interactions import InteractingStates
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.operators.tensors import body_tensor
from rotor.quantum.spins import many_f, many_f_lines
from rotor.quantum.spins.levels import levels_of_f
from rotor.spectra.intensity import intensity_cut
from rotor.spectra.lines import line_list
from rotor.spectra.transitions.pairs import all_transitions
from rotor.thermodynamics.sums.partition import PartitionFunction
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.top import Top

CONSTANTS = "A=9400 B=3100 C=2500 MHz"
DIPOLE = (1.2, 0.7, 0.4)
STATES = InteractingStates(
    {"E[1]": 2e4, "A[1]": 9300.0, "B[1]": 3110.0, "C[1]": 2490.0, "G_c[0,1]": 300.0, "F_ab[0,1]": 4.0},
    {},
    {(1, 1): DIPOLE},
)
CASES = {
    "one nucleus": ("chi_aa(35Cl)=-57 chi_bb-cc(35Cl)=-4 MHz", ()),
    "every element of its tensor": ("chi_aa(14N)=-4 chi_ab(14N)=3 chi_bc(14N)=2 C_aa(14N)=0.1 MHz", ()),
    "two nuclei": ("chi_aa(14N_1)=-4 chi_bb-cc(14N_1)=1 chi_aa(14N_2)=2 C_cc(14N_2)=0.01 MHz", ()),
    "electron and nucleus": ("eps_aa(S)=300 eps_bb(S)=20 b_F(S,1H)=60 T_aa(S,1H)=10 MHz", ()),
    "two states": ("chi_aa(14N)=-4 chi_bb-cc(14N)=1 MHz", (STATES,)),
}


def _levels(case: str):
    text, more = CASES[case]
    spins = SpinConstants.parse(text, "S=1/2 1H=1/2") if "(S" in text else SpinConstants.parse(text)
    top = Top.from_constants(CONSTANTS, dipole_abc_debye=DIPOLE, spin_constants=spins)
    effects = (*effects_of(top, True), *more)
    half = sum(spin.twice for effect in effects for spin in effect.spins(top)) % 2
    return levels_of_f(top, effects, range(half, 14, 2))


@pytest.mark.parametrize("case", CASES)
def test_levels_are_those_of_one_block_at_a_time(case, monkeypatch):
    together = _levels(case)
    assert len({id(block.spins.group) for block in together.blocks}) < len(together.blocks)
    monkeypatch.setattr(many_f, "_MOST", 0)
    apart = _levels(case)
    assert np.abs(together.energy_mhz - apart.energy_mhz).max() < 1e-9
    assert all(np.array_equal(together.quanta[name], column) for name, column in apart.quanta.items())


@pytest.mark.parametrize("case", CASES)
def test_elements_are_sums_over_parts(case):
    """⟨F'‖μ‖F⟩ of all pairs of blocks, part by part, with coefficients of each pair of F."""
    levels = _levels(case)
    tensors = {(v, v): body_tensor(DIPOLE, 1, str(levels.representation)) for v in range(2 if "two s" in case else 1)}
    pairs, amplitudes = connections(levels.blocks, tensors)
    assert len(pairs) > 10
    starts = {(up.start, low.start) for up, low in pairs}
    assert len(starts) == len(pairs)
    for up in levels.blocks:
        for low in levels.blocks:
            expected = elements_of_parts(up, low, tensors)
            if (up.start, low.start) in starts:
                assert np.abs(amplitudes(up, low) - expected).max() < 1e-12
            elif up.twice_total > low.twice_total or (up.twice_total == low.twice_total and up.start >= low.start):
                assert not expected.any()


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("range_mhz", [(0.0, float("inf")), (8000.0, 40000.0)], ids=["all", "in a range"])
def test_lines_above_a_cut_are_among_all_lines(case, range_mhz, monkeypatch):
    levels = _levels(case)
    dipoles = {(v, v): DIPOLE for v in (0, 1)} if "v" in levels.quanta else DIPOLE
    cut = intensity_cut(levels, PartitionFunction.stated(5.0, 100.0), -7.0)
    together = all_transitions(levels, dipoles, range_mhz, cut)
    monkeypatch.setattr(many_f_lines, "_IN_MEMORY", 0)
    listed = all_transitions(levels, dipoles, range_mhz)
    kept = cut.keeps(listed.frequency_mhz, listed.strength_debye2, cut.population[listed.lower])
    first, second = np.lexsort((together.lower, together.upper)), np.lexsort((listed.lower[kept], listed.upper[kept]))
    assert len(first) > 50
    assert np.array_equal(together.upper[first], listed.upper[kept][second])
    assert np.array_equal(together.lower[first], listed.lower[kept][second])
    assert np.array_equal(together.frequency_mhz[first], listed.frequency_mhz[kept][second])
    # strengths of up to 20 D² from sums of products in two orders; of a weak one the amplitude has that error
    assert np.abs(together.strength_debye2[first] - listed.strength_debye2[kept][second]).max() < 1e-12


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("range_mhz", [(2.0e4, 2.02e4), (0.0, 30.0), (1.0, 1.01)])
def test_a_narrow_range_has_the_lines_of_the_whole_list_from_few_states(case, range_mhz, monkeypatch):
    text, more = CASES[case]
    spins = SpinConstants.parse(text, "S=1/2 1H=1/2") if "(S" in text else SpinConstants.parse(text)
    top = Top.from_constants(CONSTANTS, dipole_abc_debye=DIPOLE, spin_constants=spins)
    settings = {"jmax": 10, "q": 1e3, "min_lgint": -14.0, "effects": (*effects_of(top, True), *more)}
    widths, states_with_lines = [], many_f_lines._states_with_lines

    def counted(vectors, rows, needed):
        chosen = states_with_lines(vectors, rows, needed)
        widths.append((chosen[0].shape[3], vectors.shape[3]))
        return chosen

    monkeypatch.setattr(many_f_lines, "_states_with_lines", counted)
    narrow, whole = line_list(top, range_mhz=range_mhz, **settings), line_list(top, **settings)
    expected = whole[(whole.frequency_mhz >= range_mhz[0]) & (whole.frequency_mhz <= range_mhz[1])]
    assert len(expected) > 0 or range_mhz[1] < 2
    for column in ("upper", "lower", "frequency_mhz"):
        assert np.array_equal(getattr(narrow, column), getattr(expected, column))
    assert np.allclose(narrow.strength_debye2, expected.strength_debye2, rtol=1e-9, atol=1e-18)
    if range_mhz[0] > 1e4:
        few, all_states = np.sum(widths, axis=0)
        assert few < all_states / 2


def test_levels_without_a_weight_make_no_lines():
    """Rows of weight 0 within a block, as with a spin that spin weights take into account."""
    levels = _levels("one nucleus")
    weight = levels.weight.copy()
    weight[::3] = 0
    transitions = all_transitions(
        replace(levels, weight=weight), DIPOLE, cut=intensity_cut(levels, PartitionFunction.stated(5.0, 100.0), -7.0)
    )
    assert (weight[transitions.lower] > 0).all()


def test_elements_of_large_blocks_are_those_of_small_ones(monkeypatch):
    """Columns multiplied one kind after another, and whole matrices."""
    spins = SpinConstants.parse("chi_aa(14N_1)=-4 chi_ab(14N_1)=1 chi_aa(14N_2)=2 chi_bb-cc(14N_2)=3 MHz")
    top = Top.from_constants("A=9000 B=3500 C=2600 MHz", dipole_abc_debye=(1.0, 0.5, 0.0), spin_constants=spins)
    strengths = []
    for large in (0, 1 << 40):
        monkeypatch.setattr(many_f_lines, "_LARGE", large)
        lines = line_list(top, jmax=4, temperature_k=10.0, effects=effects_of(top, True))
        strengths.append(lines.strength_debye2[np.lexsort((lines.lower, lines.upper))])
    assert len(strengths[0]) == len(strengths[1]) > 1000
    assert np.abs(strengths[0] - strengths[1]).max() < 1e-12
