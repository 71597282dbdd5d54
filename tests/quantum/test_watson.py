"""The Hamiltonian's matrices against QuTiP's operators, and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from slow_matrix import AXES, watson_matrix

from rotor.quantum.solve import solve_levels
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

RIGID = {"A": 9000.0, "B": 5000.0, "C": 3000.0}
A_SET = RIGID | {
    "DeltaJ": 0.1, "DeltaJK": -0.3, "DeltaK": 2.0, "deltaJ": 0.02, "deltaK": 0.5,
    "PhiJ": 1e-5, "PhiJK": -3e-5, "PhiKJ": 2e-4, "PhiK": 1e-3, "phiJ": 3e-6, "phiJK": -2e-5, "phiK": 4e-4,
}  # fmt: skip
S_SET = RIGID | {
    "DJ": 0.1, "DJK": -0.3, "DK": 2.0, "d1": -0.02, "d2": -0.013,
    "HJ": 1e-5, "HJK": -3e-5, "HKJ": 2e-4, "HK": 1e-3, "h1": 3e-6, "h2": -2e-6, "h3": 4e-6,
}  # fmt: skip


@pytest.mark.parametrize("representation", AXES)
@pytest.mark.parametrize(("reduction", "values"), [("A", A_SET), ("S", S_SET)])
def test_levels_are_those_of_the_full_matrix(reduction, values, representation):
    constants = Constants(reduction=reduction, representation=representation, **values)
    levels = solve_levels(Top(constants), 9)
    for j in range(10):
        slow = np.linalg.eigvalsh(watson_matrix(values, reduction, representation, j))
        ours = np.sort(levels.energy_mhz[levels.quanta["j"] == j])
        assert np.allclose(ours, slow, rtol=0, atol=1e-8)  # round-off of a dense solver at 1e6 MHz


def test_a_wrong_sign_of_one_constant_is_seen():
    wrong = Constants(reduction="S", representation="Ir", **(S_SET | {"h3": -S_SET["h3"]}))
    slow = np.linalg.eigvalsh(watson_matrix(S_SET, "S", "Ir", 6))
    ours = np.sort(solve_levels(Top(wrong), 6, jmin=6).energy_mhz)
    assert np.abs(ours - slow).max() > 1e-4


@given(st.lists(st.floats(1.0, 1e6), min_size=3, max_size=3, unique=True))
@settings(max_examples=50)
def test_levels_of_one_and_two(constants):
    """J = 1: A+B, A+C, B+C; J = 2: 4A+B+C, A+4B+C, A+B+4C and 2(A+B+C) ± 2√((B-C)² + (A-C)(A-B))."""
    c, b, a = sorted(constants)
    if (a - b) < 1e-9 * a or (b - c) < 1e-9 * b:
        return
    levels = solve_levels(Top(Constants(A=a, B=b, C=c, representation="Ir")), 2)
    energy = {
        (int(j), int(p), int(q)): e
        for j, p, q, e in zip(
            levels.quanta["j"], levels.quanta["ka"], levels.quanta["kc"], levels.energy_mhz, strict=True
        )
    }
    root = 2 * np.sqrt((b - c) ** 2 + (a - c) * (a - b))
    closed = {
        (1, 0, 1): b + c, (1, 1, 1): a + c, (1, 1, 0): a + b,
        (2, 1, 2): a + b + 4 * c, (2, 1, 1): a + 4 * b + c, (2, 2, 1): 4 * a + b + c,
        (2, 0, 2): 2 * (a + b + c) - root, (2, 2, 0): 2 * (a + b + c) + root,
    }  # fmt: skip
    for label, value in closed.items():
        assert energy[label] == pytest.approx(
            value, abs=1e-13 * a
        )  # a handful of operations on numbers of the size of A


def test_all_representations_give_the_same_rigid_levels():
    reference = None
    for representation in AXES:
        levels = solve_levels(Top(Constants(representation=representation, **RIGID)), 30)
        order = np.lexsort((levels.quanta["kc"], levels.quanta["ka"], levels.quanta["j"]))
        energies = levels.energy_mhz[order]
        reference = energies if reference is None else reference
        assert np.allclose(energies, reference, rtol=1e-13, atol=1e-7)  # round-off of 8e6 MHz


@pytest.mark.parametrize("j", [0, 1, 2, 7, 50, 300])
def test_traces_of_blocks(j):
    """The trace of H over all of J is (A+B+C) J(J+1)(2J+1)/3, and each block keeps the trace of its diagonal."""
    levels = solve_levels(Top(Constants(**RIGID)), j, jmin=j)
    exact = sum(RIGID.values()) * j * (j + 1) * (2 * j + 1) / 3
    assert levels.energy_mhz.sum() == pytest.approx(exact, rel=2e-14)  # 2J+1 roundings
    for block in levels.blocks:
        identity = block.vectors.T @ block.vectors
        assert np.abs(identity - np.eye(len(identity))).max() < 1e-13  # orthogonal to round-off
