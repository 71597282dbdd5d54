"""Lists of molecules: every pair once, none lost while molecules move, by any edge and in open space."""

from __future__ import annotations

import itertools
import math

import numpy as np
import plain_fluid as plain
import pytest
from ase import Atoms

from rotor.fluids.forces.assembly import assemble
from rotor.fluids.forces.models import find_models
from rotor.fluids.forces.neighbours import Neighbours
from rotor.fluids.forces.potential import RigidPotential


def brute(lists: Neighbours) -> set[tuple[int, ...]]:
    """All pairs (i, j, shift) in range, each named by the larger of its two names."""
    centres, edges = lists.centres, lists.box_angstrom
    within = lists.within_angstrom.max() + lists.skin_angstrom
    numbers = set()
    for shift in itertools.product(*[range(-2, 3) if edge else range(1) for edge in edges]):
        apart = centres[None] + np.array(shift) * edges - centres[:, None]
        for i, j in np.argwhere(np.linalg.norm(apart, axis=-1) < within).tolist():
            if i != j or any(shift):
                numbers.add(max((i, j, *shift), (j, i, *(-n for n in shift))))
    return numbers


@pytest.mark.parametrize("pbc", [(1, 1, 1), (1, 0, 1), (0, 0, 1), (0, 0, 0)])
@pytest.mark.parametrize(
    ("edges", "cutoff", "skin"),
    [((12.0, 12.5, 40.0), 6.0, 1.0), ((30.0, 18.0, 25.0), 4.0, 0.3), ((9.0, 9.0, 9.0), 4.5, 4.0)],
)
def test_every_pair_stands_once(pbc: tuple, edges: tuple, cutoff: float, skin: float) -> None:
    rng, models = np.random.default_rng(5), find_models("argon,trappe-n2")
    places = rng.uniform(-5, 45, size=(60, 3))
    atoms = Atoms("Ar20", positions=places[:20])
    for place in places[20:]:
        atoms += Atoms("N2", positions=[place, place + np.array([0, 0, 1.1])])
    box = np.where(pbc, edges, 0.0)
    lists = Neighbours(assemble(atoms, models), box, cutoff, skin)
    lists._refuse_overlaps = lambda: None  # places are drawn at random
    lists.update(atoms.positions)
    first, second, shift = lists.pairs()
    steps = np.rint(shift / np.where(box > 0, box, 1.0)).astype(int)
    got = [
        max((i, j, *s), (j, i, *(-n for n in s)))
        for i, j, s in zip(first.tolist(), second.tolist(), map(tuple, steps.tolist()), strict=True)
    ]
    assert len(got) == len(set(got))
    assert set(got) == brute(lists)


def test_no_pair_is_lost_while_molecules_move() -> None:
    """40 random steps, turned, drifting over the edges and put back; each energy that of a new calculator."""
    rng, atoms = np.random.default_rng(7), plain.box_of({"tip4p": 64, "argon": 10}, 15.0, seed=4, spread=0.0)
    calc = RigidPotential("tip4p,argon", cutoff_angstrom=7.0, skin_angstrom=0.8)
    labels = np.repeat(np.arange(74), [3] * 64 + [1] * 10)
    drift = np.array([0.05, -0.03, 0.02])
    for step in range(40):
        atoms.positions += drift + np.repeat(rng.normal(size=(74, 3)) * 0.03, np.bincount(labels), axis=0)
        atoms.positions += 15.0 * rng.integers(-1, 2, size=atoms.positions.shape) * (step % 3 == 0)
        fresh = RigidPotential("tip4p,argon", cutoff_angstrom=7.0).evaluate(atoms)
        evaluated = calc.evaluate(atoms)
        assert evaluated.energy_ev == pytest.approx(fresh.energy_ev, rel=1e-11), step  # round-off, energies that cancel
        size = np.abs(fresh.forces_ev_per_angstrom).max()
        assert np.abs(evaluated.forces_ev_per_angstrom - fresh.forces_ev_per_angstrom).max() < 1e-11 * size  # the same
    assert 5 < calc._neighbours.rebuilds < 20  # 0.4 Å at some 0.07 Å a step


def test_lists_live_while_centres_stay_within_half_the_skin() -> None:
    atoms = plain.box_of({"argon": 27}, 15.0)
    calc = RigidPotential("argon", cutoff_angstrom=6.0, skin_angstrom=1.0)
    lists = []
    for shift in (0.0, 0.499, 0.501, 0.0, -0.499, -0.501):  # from the last place where the list was made
        moved = atoms.copy()
        moved.positions[3, 0] += shift
        calc.evaluate(moved)
        lists.append(calc._neighbours.rebuilds)
    assert lists == [1, 1, 2, 3, 3, 4]


def test_more_neighbours_than_one_block_holds() -> None:
    """1331 argon atoms in open space, each with all others: blocks of 128 lanes, lists that outgrow their first room."""
    rng = np.random.default_rng(2)
    grid = np.stack(np.meshgrid(*[np.arange(11)] * 3, indexing="ij"), axis=-1).reshape(-1, 3) * 4.0
    places = grid + rng.uniform(-0.3, 0.3, size=grid.shape)
    evaluated = RigidPotential("argon", cutoff_angstrom=math.inf).evaluate(Atoms(["Ar"] * len(grid), positions=places))
    r2 = np.sum((places[:, None] - places[None]) ** 2, axis=-1)[np.triu_indices(len(grid), 1)]
    six = 3.405**6 / r2**3
    epsilon = 119.8 * 8.617333262e-5
    assert evaluated.energy_ev == pytest.approx(4 * epsilon * np.sum(six**2 - six), rel=1e-9)  # k_B to ten digits


def test_molecules_end_to_end_that_overlap_are_refused() -> None:
    """N2 behind N2 on one line: centres are 1.5 Å apart, the atoms between them 0.4 Å."""
    atoms = Atoms("N4", positions=[[0, 0, 0], [0, 0, 1.1], [0, 0, 1.5], [0, 0, 2.6]])
    with pytest.raises(ValueError, match=r"atoms 1 and 2 of different molecules are 0\.4 Å apart"):
        RigidPotential("trappe-n2", cutoff_angstrom=5.0).evaluate(atoms)


def test_pairs_before_an_update_are_refused() -> None:
    lists = Neighbours(assemble(Atoms("Ar"), find_models("argon")), np.zeros(3), 5.0, 1.0)
    with pytest.raises(ValueError, match="not called yet"):
        lists.pairs()
