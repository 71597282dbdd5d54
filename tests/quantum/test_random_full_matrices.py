"""Random Hamiltonians of two states, two spins, fields and a methyl group against full matrices of direct products.

The matrices are those of `random_hamiltonians`, with N ≤ 3. Levels of N ≤ 1 of all states are compared: what is left out above N = 3
moves them by less than 1e-7 MHz.
"""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import scipy.linalg
from random_hamiltonians import LARGEST, NUCLEAR_G, Case, full_matrix, random_case
from random_tops import top_and_effects

from rotor.quantum.effects.stark import stark_map
from rotor.quantum.effects.zeeman import zeeman_map
from rotor.quantum.fields.blocks import Contraction
from rotor.quantum.fields.solved_space import solved_levels, solved_space
from rotor.quantum.solve import solve_levels
from rotor.tops.top import Top
from rotor.units import MHZ_PER_DEBYE_KV_PER_CM

PARTS = ("states", "spins", "electric", "magnetic", "torsion")
BELOW_MHZ = 18_000.0  # all N ≤ 1 of both states, and no N = 2
WITHIN_MHZ = 1e-6
COMPUTED = [
    (), ("states",), ("spins",), ("states", "spins"), ("electric",), ("magnetic",), ("spins", "electric"),
    ("spins", "magnetic"), ("states", "electric"), ("states", "magnetic"), ("states", "spins", "electric"),
    ("states", "spins", "magnetic"), ("torsion",), ("spins", "torsion"), ("electric", "torsion"),
]  # fmt: skip
ELSEWHERE = {("spins", "electric", "torsion")}  # torsional states are not taken together there: test_fields_combined.py
OTHERS = [
    parts for count in range(6) for parts in combinations(PARTS, count)
    if parts not in COMPUTED and parts not in ELSEWHERE and not {"electric", "magnetic"} <= set(parts)
]  # fmt: skip
COUNT = {("spins", "torsion"): 4}  # of 200 in all: 3 s of processor time each


def full_levels(case: Case) -> np.ndarray:
    """The energies of one total M, beside internal rotation the lowest sixty."""
    matrix = full_matrix(case)
    if not case.torsion:
        return np.linalg.eigvalsh(matrix)
    return scipy.linalg.eigh(matrix, eigvals_only=True, subset_by_index=[0, min(59, len(matrix) - 1)])


# The package


def package_levels(case: Case) -> np.ndarray:
    """The energies of one total M, of one species beside internal rotation."""
    top, effects = top_and_effects(case)
    if case.torsion and case.kv_per_cm and not case.spins and len(case.abc) == 1:
        return _turning_in_field(case, top)
    if case.kv_per_cm or case.tesla:
        common = {"j_highest": 1, "jmax": LARGEST + 2, "tolerance_mhz": 1e-6}
        with_effects = {"effects": effects} if case.spins or len(case.abc) == 2 or case.torsion else {}
        if case.tesla:
            nuclear = {"nuclear_g": NUCLEAR_G} if case.spins else {}
            zeeman = zeeman_map(top, [0.0, case.tesla], case.g, **with_effects, **nuclear, **common)
        else:
            zeeman = stark_map(top, [0.0, case.kv_per_cm], m_values=[abs(case.twice_m) / 2], **with_effects, **common)
        m = case.twice_m / 2 if case.tesla else abs(case.twice_m) / 2
        chosen = (zeeman.field == zeeman.field.max()) & (zeeman.m == m)
        return np.sort(zeeman.energy_mhz[chosen])
    levels = solve_levels(top, LARGEST, effects=effects)
    chosen = levels.multiplicity > abs(case.twice_m)
    if case.torsion:
        chosen &= levels.quanta["species"] == "AE"[case.sigma]
    return np.sort(levels.energy_mhz[chosen])


def _turning_in_field(case: Case, top: Top) -> np.ndarray:
    """All torsional states of one species together in an electric field."""
    along = Contraction(tuple(case.dipole), (0.0, 0.0, 1.0))
    levels = solved_levels(top, LARGEST, ())
    without_vt = {name: column for name, column in levels.quanta.items() if name != "vt"}
    space = solved_space(top, replace(levels, quanta=without_vt), LARGEST, [along])
    species = space.levels.quanta["species"]
    blocks = [block for block in space.blocks(abs(case.twice_m) // 2) if species[block.rows[0]] == "AE"[case.sigma]]
    strength = case.kv_per_cm * MHZ_PER_DEBYE_KV_PER_CM
    matrices = [np.diag(block.energies_mhz) - strength * block.matrix(along) for block in blocks]
    return np.sort(np.concatenate([np.linalg.eigvalsh(matrix) for matrix in matrices]))


def differences(case: Case) -> np.ndarray:
    """Of the levels that neither side leaves out."""
    everything = not (case.spins or case.kv_per_cm or case.tesla or case.torsion)
    slow, ours = full_levels(case), package_levels(case)
    if not everything:
        lowest = slow[0] if case.torsion else 0.0
        slow, ours = (energies[energies < lowest + BELOW_MHZ] for energies in (slow, ours))
    assert len(ours) == len(slow) >= 3
    return np.abs(ours - slow)


@pytest.mark.parametrize("parts", [parts for parts in COMPUTED if parts not in COUNT], ids="+".join)
def test_one_of_each_combination(parts):
    assert differences(random_case(parts, np.random.default_rng(7))).max() < WITHIN_MHZ


@pytest.mark.slow
@pytest.mark.parametrize("parts", COMPUTED, ids="+".join)
def test_two_hundred_hamiltonians(parts):
    rng = np.random.default_rng(COMPUTED.index(parts))
    for _ in range(COUNT.get(parts, 14)):
        assert differences(random_case(parts, rng)).max() < WITHIN_MHZ


@pytest.mark.parametrize("parts", OTHERS, ids="+".join)
def test_other_combinations_are_refused_with_a_reason_or_right(parts):
    """No request takes an electric and a magnetic field at once; of the others each that computes is compared."""
    case = random_case(parts, np.random.default_rng(7))
    try:
        package_levels(case)
    except ValueError as error:
        refusal = str(error)
    else:
        refusal = ""
        assert differences(case).max() < WITHIN_MHZ
    assert not refusal or re.search(
        r"states|spins|internal rotation", refusal
    )  # which part it is that does not go with others


@pytest.mark.parametrize("name", ["chi", "c", "f_ab", "coriolis"])
def test_a_changed_constant_is_seen(name):
    """The comparison fails where the full matrix has another value: a negative control."""
    case = random_case(("states", "spins"), np.random.default_rng(7))
    value = getattr(case, name)
    wrong = replace(case, **{name: 1.05 * value})
    energies, slow = package_levels(case), full_levels(wrong)
    count = int((slow < BELOW_MHZ).sum())
    assert np.abs(energies[:count] - slow[:count]).max() > 5 * WITHIN_MHZ
