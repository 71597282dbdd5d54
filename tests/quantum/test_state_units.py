"""Unit matrices of several states made without a solution: the levels and derivatives of those that are made from solved levels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rotor.arrays import Workspace
from rotor.formats.spcat.fits import fit_states
from rotor.formats.spcat.fits.fit_states import FileLevels, groups_for_fit
from rotor.formats.spcat.text.par import read_par
from rotor.quantum.basis.state_elements import linear_blocks_of
from rotor.quantum.blocks.linear_stacks import LinearStack, stack_numbers
from rotor.quantum.effects.interactions import InteractingStates
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.labels.tracking import TrackedLevels
from rotor.quantum.solve import solve_levels
from rotor.tops.top import Top

THREE = """three states
  17  100   20    0    0.0  1.0E+06  1.0 1.0
{options}
10099 14500.1 1E+36 /A
20099 4200.2 1E+36 /B
30099 3300.3 1E+36 /C
299 -1.1e-3 1E+36 /-DJ
1199 -6.2e-3 1E+36 /-DJK
40199 -3.1e-4 1E+36 /d1
40399 -3.1e-8 1E+36 /hJ
50099 1e-5 1E+36 /d2
60000 2e-8 1E+36 /J+^6
11 900.0 1E+36 /E1
22 4100.0 1E+36 /E2
10011 -55.5 1E+36 /dA1
30022 -1.5 1E+36 /dC2
200012 900.0 1E+36 /Ga12
12 850.0 1E+36 /W12
400002 510.0 1E+36 /Gb
610000 12.0 1E+36 /Fab
"""
OPTIONS = {
    "prolate": "a 1 3 0 40 0 1 1 1 0 1 0",
    "oblate": "a 1 -3 0 40 0 1 1 1 0 1 0",
    "K up to 4": "a 1 3 0 4 0 1 1 1 0 1 0",
    "K of state 2 from 2 to 3": "a 1 3 0 40 0 1 1 1 -1 1 0\na 1 2 2 3 0 1 1 1 0 1 0",
}


def models(
    options: str, labels: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> tuple[FileLevels, FileLevels, np.ndarray]:
    file = read_par(THREE.format(options=options).encode())
    direct = FileLevels.from_labels(file, labels)
    with monkeypatch.context() as patched:
        patched.setattr(fit_states, "_direct", lambda group, form: False)
        solved = FileLevels.from_labels(file, labels)
    return direct, solved, np.array([p.value for p in file.parameters])


@pytest.mark.parametrize("name", OPTIONS)
def test_levels_are_those_of_the_solved_blocks(name, monkeypatch):
    rng = np.random.default_rng(2)
    n = np.array([0, 1, 2, 3, 3, 5, 7, 8, 8, 8, 12])
    ka = np.minimum(rng.integers(0, 4, len(n)), n)
    kc = n - ka if "oblate" not in name else n - ka + (ka > 0)
    labels = np.column_stack([n, ka, kc, np.where(ka < 2, [0, 1] * 5 + [0], 2 * (ka < 4))])
    labels[labels[:, 0] == 3, 3] = [1, 0]
    direct, solved, values = models(OPTIONS[name], labels, monkeypatch)
    for point in (values, values * (1 + 0.01 * rng.normal(size=len(values)))):
        energies, slopes = direct.levels(point)
        computed, derivatives = solved.levels(point)
        assert energies == pytest.approx(computed, rel=1e-12)  # round-off of matrices of 20 rows
        assert np.abs(slopes - derivatives).max(axis=0) == pytest.approx(
            0, abs=1e-9 * np.abs(derivatives).max()
        )  # the same
    used = np.abs(slopes).max(axis=0) > 0
    assert used.sum() >= 14


def test_levels_that_a_state_does_not_have_are_named():
    file = read_par(THREE.format(options=OPTIONS["K of state 2 from 2 to 3"]).encode())
    for label in ([5, 1, 5, 2], [5, 6, 0, 0], [5, 1, 2, 0], [5, 1, 5, 3]):
        text = " ".join(map(str, label))
        with pytest.raises(ValueError, match=f"there is no level {text} "):
            FileLevels.from_labels(file, np.array([[3, 1, 3, 0], label]))


def test_blocks_of_many_sizes_give_what_each_gives_alone(monkeypatch):
    """Side by side and padded, or one at a time."""
    from rotor.quantum.blocks import linear_stacks

    labels = np.array([[n, ka, n - ka, v] for n in range(3, 9) for ka in range(3) for v in range(3)])
    text = THREE.format(options=OPTIONS["prolate"])  # less what connects all blocks of one J
    without = "\n".join(row for row in text.splitlines() if not row.startswith(("400002", "610000", "12 ")))
    file = read_par(without.replace("  17 ", "  14 ").encode())
    values = np.array([p.value for p in file.parameters])
    other = values * (1 + 1e-9)
    together = FileLevels.from_labels(file, labels).levels(other)
    monkeypatch.setattr(linear_stacks, "_AT_ONCE", 1)
    model = FileLevels.from_labels(file, labels)
    blocks = model.whole
    assert isinstance(blocks, TrackedLevels)
    alone = model.levels(other)
    at_start, _ = model.levels(values)
    assert at_start == pytest.approx(alone[0], rel=2e-9)  # the step of 1e-9
    assert len(blocks._labelled) == len(blocks.tracked) > 12
    assert together[0] == pytest.approx(alone[0], rel=1e-13)  # order of sums
    assert together[1] == pytest.approx(alone[1], abs=1e-12 * np.abs(alone[1]).max())  # order of sums


STRONG = """four states
  16  100   20    0    0.0  1.0E+06  1.0 1.0
a 1 {sign}4 0 40 0 1 1 1 0 1 {diag}
10099 6500.1 1E+36 /A
20099 5800.2 1E+36 /B
30099 3100.3 1E+36 /C
299 -1.1e-3 1E+36 /-DJ
11 9000.0 1E+36 /E1
22 12600.0 1E+36 /E2
33 31000.0 1E+36 /E3
10011 -55.5 1E+36 /dA1
20022 -4.5 1E+36 /dB2
30033 3.5 1E+36 /dC3
1 5200.0 1E+36 /W01
400001 2100.0 1E+36 /Gb01
200012 1700.0 1E+36 /Ga12
23 7300.0 1E+36 /W23
600023 1900.0 1E+36 /Gc23
400003 900.0 1E+36 /Gb03
"""


@pytest.mark.parametrize("start", [1.0, 1.02])
@pytest.mark.parametrize(("diag", "sign"), [(0, ""), (0, "-"), (1, ""), (2, ""), (3, ""), (3, "-"), (4, ""), (5, "")])
def test_mixed_levels_have_the_names_of_the_prediction(diag, sign, start, monkeypatch):
    """Every level to J = 11 of four states that no overlap tells apart, from the constants themselves and from 2 % off."""
    file = read_par(STRONG.format(diag=diag, sign=sign).encode())
    levels = groups_for_fit(file)[0].levels((0, 22))
    labels = np.column_stack([levels.quanta[name] for name in ("j", "ka", "kc", "v")])
    assert levels.mixing is not None
    assert levels.mixing.min() < 0.4
    values = np.array([p.value for p in file.parameters])
    moved = [replace(p, value=p.value * (start if i % 2 else 2 - start)) for i, p in enumerate(file.parameters)]
    for direct in (True, False):
        with monkeypatch.context() as patched:
            if not direct:
                patched.setattr(fit_states, "_direct", lambda group, form: False)
            model = FileLevels.from_labels(replace(file, parameters=tuple(moved)), labels)
        assert model.levels(values)[0] == pytest.approx(levels.energy_mhz, abs=1e-4)  # MHz, round-off of 1e6


def test_states_that_hardly_mix_have_one_name_by_diag_0_and_3():
    """Several Wang blocks of one state in a block, whose levels of one K are in the order of energy that each Wang block has."""
    text = STRONG.replace("5200.0", "5.2").replace("2100.0", "2.1").replace("1700.0", "1.7").replace("7300.0", "7.3")
    text = text.replace("1900.0", "1.9").replace("900.0 1E+36 /Gb03", "0.9 1E+36 /Gb03").replace("5800.2", "3800.2")
    names = []
    for diag in (0, 3):
        levels = groups_for_fit(read_par(text.format(diag=diag, sign="").encode()))[0].levels((0, 10))
        assert any(len(block.parts) > len({part.v for part in block.parts}) for block in levels.blocks)
        order = np.argsort(levels.energy_mhz)
        names.append(np.column_stack([levels.quanta[name] for name in ("j", "ka", "kc", "v")])[order])
    assert (names[0] == names[1]).all()


def norms(blocks) -> np.ndarray:
    """Twice the largest energy of each block: a bound of the norm of its matrix and of what was taken off its diagonal."""
    return np.concatenate([np.full(len(b.energies_mhz), 2 * np.abs(b.energies_mhz).max()) for b in blocks])


@pytest.mark.parametrize("name", OPTIONS)
def test_linear_blocks_have_the_energies_and_slopes_of_the_solved_blocks(name):
    """Energies at the values of the parameters within 32 eps ||H_b||; Σ c ∂E/∂c = E since H is linear in all of them."""
    file = read_par(THREE.format(options=OPTIONS[name]).encode())
    group = groups_for_fit(file)[0]
    levels = group.levels((0, 24))
    values = group.effect.parameters(group.top)
    linear = linear_blocks_of(group.top, levels, tuple(values), levels.blocks)
    energies = np.empty(len(levels))
    for numbers in stack_numbers([block.shape for block in linear]):
        stack = LinearStack.from_blocks([linear[i] for i in numbers.tolist()])
        solved, *_ = stack.solved(np.array(list(values.values())), Workspace())
        for place, block in enumerate(levels.blocks[i] for i in numbers.tolist()):
            size = len(block.energies_mhz)
            energies[block.start : block.start + size] = solved[place, :size]
    allowed = 32 * np.finfo(float).eps * norms(levels.blocks)  # round-off of sums of the terms and of the solver
    assert (np.abs(energies - levels.energy_mhz) <= allowed).all()
    slopes = level_derivatives(group.top, levels)
    assert (np.abs(slopes @ list(values.values()) - levels.energy_mhz) <= allowed).all()


def test_slopes_of_some_parameters_are_those_of_all():
    file = read_par(THREE.format(options=OPTIONS["prolate"]).encode())
    group = groups_for_fit(file)[0]
    levels = group.levels((0, 10))
    names = tuple(group.effect.parameters(group.top))
    subset, rows = names[4:7] + names[-3:], np.arange(0, len(levels), 3)
    slopes = level_derivatives(group.top, levels, names)[rows][:, [names.index(name) for name in subset]]
    assert level_derivatives(group.top, levels, subset, rows) == pytest.approx(slopes, rel=1e-12)  # order of sums


def test_derivatives_of_a_few_levels_are_those_of_all():
    """Levels at high J of blocks that a coupling does not reach, and one at low J of a block that it does."""
    top = Top.from_constants("A=9000 B=3000 C=2500 MHz")
    states = InteractingStates({"E[1]": 700.0, "A[1]": 9000.0, "B[1]": 3000.0, "C[1]": 2500.0, "F_ac[0,1]": 20.0})
    levels = solve_levels(top, 9, effects=(*SEMI_RIGID, states))
    derivatives = level_derivatives(top, levels)
    by_j = {j: [block for block in levels.blocks if block.j == j] for j in (2, 7, 8, 9)}
    for low in by_j[2]:
        kinds = {(part.basis.first_k % 2, part.basis.sign, part.v) for part in low.parts}
        high = [
            block.start
            for j in (9, 8, 7)
            for block in by_j[j]
            if kinds.isdisjoint((part.basis.first_k % 2, part.basis.sign, part.v) for part in block.parts)
        ]
        rows = np.array([*high, low.start])
        assert len(high) >= 3
        assert level_derivatives(top, levels, rows=rows) == pytest.approx(derivatives[rows], abs=1e-12)  # the same sums
    assert max(len(block.parts) for block in by_j[2]) > 1
