"""Labels, symmetry blocks, closed forms of symmetric tops, and the hard cases about levels."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from rotor.quantum.estimates.convergence import disordered_blocks
from rotor.quantum.solve import solve_levels
from rotor.quantum.wang.basis import wang_blocks
from rotor.tops.constants.constants import Constants
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.top import Top

WATER_QUARTIC = Constants(
    A=835840.288, B=435351.717, C=278138.7, DeltaJ=37.59422, DeltaJK=-172.91276, DeltaK=973.29052, deltaJ=15.210402,
    deltaK=41.05025, reduction="A",
)  # fmt: skip


def test_every_label_stands_once():
    levels = solve_levels(Top.from_constants("A=10 B=6 C=4 GHz"), 25)
    for j in range(26):
        labels = {
            (int(a), int(c))
            for a, c in zip(
                levels.quanta["ka"][levels.quanta["j"] == j], levels.quanta["kc"][levels.quanta["j"] == j], strict=True
            )
        }
        assert labels == {(ka, kc) for ka in range(j + 1) for kc in (j - ka, j - ka + 1) if 0 <= kc <= j}


def test_labels_run_as_energies_do_in_a_rigid_top():
    """Of one J the energy rises with Ka - Kc (Wang 1929)."""
    levels = solve_levels(Top.from_constants("A=10 B=7 C=4 GHz"), 20)
    for j in range(1, 21):
        here = levels.quanta["j"] == j
        order = np.argsort((levels.quanta["ka"] - levels.quanta["kc"])[here])
        assert (np.diff(levels.energy_mhz[here][order]) > -1e-6).all()  # doublets closer than round-off


def test_dominant_k_would_label_wrongly():
    """Hard case 1: at κ = -0.5, J = 20 the largest coefficient gives another label than the order in the block for 44 %."""
    b = 6000.0 + 0.25 * 4000.0  # A = 10, C = 6 GHz, κ = -0.5
    levels = solve_levels(Top(Constants(A=10000.0, B=b, C=6000.0)), 20, jmin=20)
    wrong = sum(
        int(
            (
                block.basis.k[np.argmax(np.abs(block.vectors), axis=0)]
                != levels.quanta["ka"][block.start : block.start + block.basis.size]
            ).sum()
        )
        for block in levels.blocks
    )
    assert wrong / len(levels) == pytest.approx(0.44, abs=0.02)  # the figure as printed, two digits


def test_unfactorised_vectors_mix_parity():
    """Hard case 3: the whole 2J+1 matrix mixes E+ with E- partners; Wang blocks cannot."""
    from slow_matrix import watson_matrix

    j = 20
    matrix = watson_matrix({"A": 10000.0, "B": 6200.0, "C": 6000.0}, "A", "Ir", j).real  # κ = -0.9
    _, vectors = np.linalg.eigh(matrix)
    parity = np.abs((vectors * vectors[::-1]).sum(axis=0))  # |⟨K|-K⟩ overlap|, 1 for pure Wang functions
    assert (parity < 0.99).mean() > 0.3
    levels = solve_levels(Top(Constants(A=10000.0, B=6200.0, C=6000.0)), j, jmin=j)
    assert [b.basis.species for b in levels.blocks] == ["ee", "eo", "oe", "oo"]


def falling(block):
    jz_squared = (block.vectors**2).T @ block.basis.k.astype(float) ** 2
    return bool((np.diff(jz_squared) < -1e-6).any())


def test_quartic_water_says_where_its_order_fails():
    """Hard case 2: ⟨Jz²⟩ is not monotonic in one block at J = 15, in all from J = 20 on."""
    top = Top(WATER_QUARTIC)
    levels = solve_levels(top, 22)
    assert sum(falling(b) for b in levels.blocks if b.basis.j == 15) == 1
    assert all(falling(b) for b in levels.blocks if b.basis.j >= 20)
    disordered = disordered_blocks(top, levels)
    assert all((j, species) in disordered for j in (20, 21, 22) for species in ("ee", "eo", "oe", "oo"))
    assert not any(j < 15 for j, _ in disordered)


@pytest.mark.parametrize("kappa", [-0.95, -0.5, 0.0, 0.3, 0.8])
def test_rigid_tops_are_in_order(kappa):
    top = Top(Constants(A=10000.0, B=7000.0 + 3000.0 * kappa, C=4000.0))
    assert disordered_blocks(top, solve_levels(top, 40)) == []


@pytest.mark.parametrize(("kind", "text"), [("prolate", "A=9 B=4 GHz"), ("oblate", "B=9 C=4 GHz")])
def test_symmetric_tops_join_asymmetric_ones(kind, text):
    """Hard case 6: closed form and Wang blocks agree where two constants differ by 1e-13 of themselves."""
    closed = solve_levels(Top.from_constants(text), 30)
    near = {"prolate": (9000.0, 4000.0 * (1 + 1e-13), 4000.0), "oblate": (9000.0 * (1 + 1e-13), 9000.0, 4000.0)}[kind]
    solved = solve_levels(Top(Constants(**dict(zip("ABC", near, strict=True)), kind="asymmetric")), 30)
    for j in range(31):
        both = np.repeat(closed.energy_mhz[closed.quanta["j"] == j], closed.components[closed.quanta["j"] == j])
        assert np.allclose(
            np.sort(both), np.sort(solved.energy_mhz[solved.quanta["j"] == j]), rtol=1e-12
        )  # 1e-13 times J-sized factors


def test_near_symmetric_levels_approach_without_a_jump():
    """Hard case 6: the distance to the symmetric top falls in proportion to B - C at J = 150."""
    distances = []
    for split in (1e-6, 1e-7, 1e-8):
        b, c = 500.0 * (1 + split / 2), 500.0 * (1 - split / 2)
        levels = solve_levels(Top(Constants(A=1000.0, B=b, C=c, kind="asymmetric")), 150, jmin=150)
        closed = 500.0 * 150 * 151 + 500.0 * levels.quanta["ka"].astype(float) ** 2
        distances.append(np.abs(levels.energy_mhz - closed).max())
    assert distances[0] / distances[1] == pytest.approx(10, rel=0.02)
    assert distances[1] / distances[2] == pytest.approx(10, rel=0.02)


def test_j_of_a_thousand():
    """Hard case 7: finite, ordered, and the trace of each block to round-off."""
    top = Top(Constants(A=1000.0, B=500.0, C=499.9))
    levels = solve_levels(top, 1000, jmin=1000)
    exact = (1000.0 + 500.0 + 499.9) * 1000 * 1001 * 2001 / 3
    assert np.isfinite(levels.energy_mhz).all()
    assert levels.energy_mhz.sum() == pytest.approx(exact, rel=1e-14)  # round-off
    for block in levels.blocks:
        assert (np.diff(block.energies_mhz) > 0).all()


def test_symmetric_top_with_distortion_is_its_formula():
    top = Top.from_constants("A=158099 B=9198.9 DJ=3.8e-3 DJK=0.177 DK=2.83 HJ=-2.6e-10 HJK=1e-6 HKJ=6e-6 HK=5e-5 MHz")
    levels = solve_levels(top, 6)
    row = levels.find(j=6, k=4)
    x, k2 = 42.0, 16.0
    closed = 9198.9 * x + (158099 - 9198.9) * k2 - 3.8e-3 * x**2 - 0.177 * x * k2 - 2.83 * k2**2
    closed += -2.6e-10 * x**3 + 1e-6 * x**2 * k2 + 6e-6 * x * k2**2 + 5e-5 * k2**3
    assert levels.energy_mhz[row] == pytest.approx(closed, rel=1e-14)
    assert levels.components[row] == 2


def test_spherical_weights_add_up_to_all_spin_states():
    """CH4: over J the weights of A, E, F levels make 16 spin states per component on average; J = 0 to 3 by hand."""
    weights = SpinWeights.from_mapping({"A": 5, "E": 2, "F": 3})
    assert weights.spherical_weights(np.arange(4)).tolist() == [5, 3, 5, 11]  # A; F; E+F; A+2F
    assert weights.mean == pytest.approx(16 / 12)


def test_blocks_of_an_executor_are_the_same():
    top = Top.from_constants("A=10 B=6 C=4 GHz")
    with ThreadPoolExecutor(2) as pool:
        shared = solve_levels(top, 12, executor=pool)
    assert np.array_equal(shared.energy_mhz, solve_levels(top, 12).energy_mhz)


def test_block_sizes_add_up():
    for representation in ("Ir", "IIIl", "IIr"):
        for j in range(12):
            assert sum(b.size for b in wang_blocks(j, representation)) == 2 * j + 1


@pytest.mark.parametrize("jmax", [-1, -5])
def test_negative_j_is_an_error(jmax):
    with pytest.raises(ValueError, match="J max must be 0 or more"):
        solve_levels(Top.from_constants("B=1 GHz"), jmax)


def test_overflow_is_said():
    wild = Constants(A=3e5, B=2e5, C=1e5, DJ=1e-3, d2=1e305, reduction="S")
    with pytest.raises(ValueError, match="overflows"):
        solve_levels(Top(wild), 40, jmin=40)
