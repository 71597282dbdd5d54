"""Levels and lines of many F at once, against the same F by F and pair by pair."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rotor.quantum.effects.interactions import InteractingStates
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.spins import many_f_lines, solve
from rotor.quantum.spins.levels import levels_of_f
from rotor.spectra.intensity import intensity_cut
from rotor.spectra.transitions import all_transitions
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
def test_levels_are_those_of_one_f_at_a_time(case, monkeypatch):
    together = _levels(case)
    assert all(block.group is not None for block in together.blocks)
    monkeypatch.setattr(solve, "MOST", 0)
    apart = _levels(case)
    assert all(block.group is None for block in apart.blocks)
    assert np.array_equal(together.energy_mhz, apart.energy_mhz)  # the same matrices, to the last bit
    assert all(np.array_equal(together.quanta[name], column) for name, column in apart.quanta.items())
    assert all(np.array_equal(a.vectors, b.vectors) for a, b in zip(together.blocks, apart.blocks, strict=True))


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("range_mhz", [(0.0, float("inf")), (8000.0, 40000.0)], ids=["all", "in a range"])
def test_lines_are_those_of_pairs(case, range_mhz, monkeypatch):
    levels = _levels(case)
    dipoles = {(v, v): DIPOLE for v in (0, 1)} if "v" in levels.quanta else DIPOLE
    cut = intensity_cut(levels, 5.0, 100.0, -7.0)
    together = all_transitions(levels, dipoles, range_mhz, cut)
    monkeypatch.setattr(many_f_lines, "can_be_stacked", lambda *a: False)
    apart = all_transitions(levels, dipoles, range_mhz, cut)
    assert len(apart.upper) > 50
    first, second = (np.lexsort((item.lower, item.upper)) for item in (together, apart))
    assert np.array_equal(together.upper[first], apart.upper[second])
    assert np.array_equal(together.lower[first], apart.lower[second])
    assert np.array_equal(together.frequency_mhz[first], apart.frequency_mhz[second])
    # strengths of up to 20 D² from sums of products in two orders; of a weak one the amplitude has that error
    assert np.abs(together.strength_debye2[first] - apart.strength_debye2[second]).max() < 1e-12


def test_levels_without_a_weight_make_no_lines():
    """Rows of weight 0 within a block, as with a spin that spin weights take into account."""
    levels = _levels("one nucleus")
    weight = levels.weight.copy()
    weight[::3] = 0
    transitions = all_transitions(replace(levels, weight=weight), DIPOLE, cut=intensity_cut(levels, 5.0, 100.0, -7.0))
    assert (weight[transitions.lower] > 0).all()
