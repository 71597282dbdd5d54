"""H with spins is linear in its parameters: Σ c ∂E/∂c = E for every level, and the linear blocks have the solved energies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from places import ORACLES

from rotor.formats.spcat.file_model import connected_groups
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import read_par
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.spins.levels import levels_of_f
from rotor.quantum.spins.linear_blocks import linear_blocks_of_spins
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.top import Top

KINDS = ORACLES / "kinds"
FILES = ["weights_of_states_i_tot", "patterns_of_i_tot", "methyl_i_tot", "oc33s", "h2coh"]
TENSORS = {
    "every element of a tensor": "chi_aa(14N)=-4 chi_ab(14N)=3 chi_bc(14N)=2 C_aa(14N)=0.1 MHz",
    "two nuclei": "chi_aa(14N_1)=-4 chi_ab(14N_1)=1 chi_aa(14N_2)=2 C_cc(14N_2)=0.01 MHz",
}


def _check(top, levels):
    parameters = {name: value for effect in levels.effects for name, value in effect.parameters(top).items()}
    names, values = list(parameters), np.array(list(parameters.values()))
    highest = np.abs(levels.energy_mhz).max()
    assert np.abs(level_derivatives(top, levels, names) @ values - levels.energy_mhz).max() < 1e-11 * highest
    linear = linear_blocks_of_spins(top, levels.effects, names, levels.blocks)
    for matrices, block in zip(linear, levels.blocks, strict=True):
        energies = np.linalg.eigvalsh(matrices.lower(values))
        assert np.abs(energies - block.energies_mhz).max() < 1e-11 * highest


@pytest.mark.parametrize("name", FILES)
def test_files(name: str):
    par, request = read_par(KINDS / name / f"{name}.var"), read_int(KINDS / name / f"{name}.int")
    group = connected_groups(par, replace(request, request=replace(request.request, fend=3)))[0]
    half = sum(group.spins) % 2
    _check(group.top, levels_of_f(group.top, (group.effect,), range(half, 7, 2)))


@pytest.mark.parametrize("case", TENSORS)
def test_tops(case: str):
    top = Top.from_constants("A=9400 B=3100 C=2500 MHz", spin_constants=SpinConstants.parse(TENSORS[case]))
    _check(top, levels_of_f(top, effects_of(top, True), range(0, 12, 2)))
