"""The number that replaces a coupling pattern if there are more quantum numbers than columns: its place in SPCAT's list of patterns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotor.arrays import Ints
from rotor.formats.spcat.file_model import Group
from rotor.quantum.levels import Levels
from rotor.quantum.spins.three_spins import symmetric_functions


def pattern_numbers(group: Group, levels: Levels, names: list[str]) -> Ints:
    """Numbers of the coupling patterns among those of any F.

    Patterns are ordered by N - F, by I_tot if there is one, then by J_i - J_(i-1), the last spin first."""
    doubled = [levels.quanta[name] * (1 if name in levels.halves else 2) for name in names]
    chain, spins = [2 * levels.rotational, *doubled], group.spins
    if not group.states[0].i_tot:
        return _among(pattern_steps(spins), _steps(chain, spins))
    if group.states[0].equivalent == 3:
        return _among(_threefold_patterns(spins), _threefold_steps(chain, spins))
    total, totals = chain.pop(-2), range(0, spins[-1] + spins[-2] + 1, 2)
    all_steps = np.concatenate([np.insert(pattern_steps((*spins[:-2], i_tot)), 1, i_tot, axis=1) for i_tot in totals])
    all_steps = all_steps[np.lexsort((all_steps[:, 1], all_steps[:, 0]))]  # lexsort is stable within one I_tot
    steps = _steps(chain, (*spins[:-2], total))
    return _among(all_steps, np.insert(steps, 1, total, axis=1))


def _threefold_patterns(spins: tuple[int, ...]) -> Ints:
    """2(N - F), I_tot, the other steps and the species of all patterns with a total of three spins, in the order of SPCAT."""
    tables = []
    # totals of three spins fall by whole numbers, to 0 or 1/2
    for total in range(3 * spins[-1] % 2, 3 * spins[-1] + 1, 2):
        names = symmetric_functions(spins[-1], total).symmetry // 2
        order = np.lexsort((names, ~np.isin(names % 6, (0, 2))))  # even functions before odd ones
        steps = np.insert(pattern_steps((*spins[:-3], total)), 1, total, axis=1)
        tables.append(np.column_stack([np.repeat(steps, len(names), axis=0), np.tile(names[order], len(steps))]))
    table = np.concatenate(tables)
    return table[np.lexsort((table[:, 1], table[:, 0]))]


def _threefold_steps(chain: list[Ints], spins: tuple[int, ...]) -> Ints:
    """Steps of levels with a total of three spins."""
    total, symmetry = chain[-2], chain[-3] // 2
    steps = _steps([*chain[:-3], chain[-1]], (*spins[:-3], total))
    return np.column_stack([np.insert(steps, 1, total, axis=1), symmetry])


def pattern_steps(spins: tuple[int, ...]) -> Ints:
    """2(N - F) and (J_i - J_(i-1) + S_i) of all coupling patterns of doubled spins, in SPCAT's order.

    >>> pattern_steps((1, 1)).tolist()
    [[-2, 1, 1], [0, 1, 0], [0, 0, 1], [2, 0, 0]]
    """
    steps = np.stack(np.meshgrid(*(np.arange(spin + 1) for spin in spins), indexing="ij"), axis=-1).reshape(
        -1, len(spins)
    )
    difference = (np.array(spins, dtype=np.int64) - 2 * steps).sum(axis=1)
    return np.column_stack((difference, steps))[np.lexsort((*steps.T, difference))]


def _steps(chain: list[Ints], spins: Sequence[Ints | int]) -> Ints:
    """The steps of `pattern_steps` for levels, from their doubled N, J, F1, ... F."""
    steps = [(after - before + spin) // 2 for before, after, spin in zip(chain, chain[1:], spins, strict=False)]
    return np.column_stack((chain[0] - chain[-1], *steps))


def _among(all_steps: Ints, steps: Ints) -> Ints:
    """Place of each pattern in the list of all."""
    number = {tuple(row): place for place, row in enumerate(all_steps.tolist())}
    return np.array([number[tuple(row)] for row in steps.tolist()], dtype=np.int64)
