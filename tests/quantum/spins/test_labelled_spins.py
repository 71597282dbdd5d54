"""Labelled levels with spins: large blocks, of which functions near each label are solved, against whole blocks."""

from __future__ import annotations

import numpy as np

from rotor.quantum.effects.interactions import InteractingStates
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.estimates.contracted import TOLERANCE_MHZ, ContractedLevels
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.estimates.effect_units import assigned_with_spins
from rotor.quantum.spins.levels import levels_of_f
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.top import Top

F = 44
STATES = InteractingStates({"E[1]": 2e4, "A[1]": 9300.0, "B[1]": 3110.0, "C[1]": 2490.0, "G_c[0,1]": 300.0}, {}, {})
NUCLEI = "chi_aa(14N_1)=-4 chi_bb-cc(14N_1)=1 chi_aa(14N_2)=2 chi_bb-cc(14N_2)=0.5 MHz"


def test_levels_of_large_blocks_are_those_of_whole_blocks():
    top = Top.from_constants("A=9400 B=3100 C=2500 MHz", spin_constants=SpinConstants.parse(NUCLEI))
    effects = (*effects_of(top, True), STATES)
    parameters = {name: value for effect in effects for name, value in effect.parameters(top).items()}
    names, values = list(parameters), np.array(list(parameters.values()))
    whole = levels_of_f(top, effects, [2 * F])
    rows = np.flatnonzero(whole.quanta["ka"] < 4)[::10]

    def rows_of(levels, places):
        return levels.rows_of(**{name: column[rows[places]] for name, column in whole.quanta.items()})

    (part,) = assigned_with_spins(top, effects, names, values, np.full(len(rows), 2 * F), rows_of)
    assert isinstance(part.blocks, ContractedLevels)
    assert part.rows.tolist() == list(range(len(rows)))
    assert len(rows) > 5
    energies, slopes = part.blocks.levels(values)
    assert np.abs(energies - whole.energy_mhz[rows]).max() < TOLERANCE_MHZ
    expected = level_derivatives(top, whole, names, rows)
    assert np.abs(slopes - expected).max() < 1e-6 * np.abs(expected).max()
    assert np.abs(slopes @ values - energies).max() < 1e-5  # H is linear in its parameters
