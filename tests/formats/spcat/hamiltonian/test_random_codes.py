"""Random files with series, PHASE and odd operators, IXX and two equivalent spins against the direct product |v⟩ |N k m⟩ |m1⟩ ... at one M.

Levels and strengths, the latter summed between groups of close levels and compared both ways.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from direct_codes import strengths
from lines_of_levels import compare_levels, compare_lines, groups_of_close, summed
from random_codes import CodedFile, file_of_equivalent, file_of_ixx, file_of_phase, file_of_series

from rotor.formats.spcat.file_model import connected_groups

# the generator, states, spins
KINDS: list[tuple[Callable[[int, int, int], CodedFile], int, int]] = [
    *((file_of_series, *size) for size in ((1, 0), (2, 0), (1, 1), (2, 1))),
    *((file_of_phase, *size) for size in ((1, 0), (2, 0), (1, 1))),
    *((file_of_ixx, *size) for size in ((1, 1), (2, 1))),
    *((file_of_equivalent, *size) for size in ((1, 2), (2, 2))),
]
LARGER = [
    (file_of_series, 3, 0),
    (file_of_phase, 3, 0),
    (file_of_phase, 2, 1),
    (file_of_ixx, 1, 2),
    (file_of_series, 2, 2),
    (file_of_series, 3, 1),
    (file_of_phase, 2, 2),
    (file_of_ixx, 2, 2),
    (file_of_equivalent, 1, 3),
]


def _compare(file: CodedFile, count_of_f: int) -> int:
    """How many sums of lines were compared."""
    model = file.model
    f2s = range(sum(model.spins2) % 2, sum(model.spins2) % 2 + 2 * count_of_f, 2)
    top, energies, results = (f2s[-1] + sum(model.spins2)) // 2, {}, {}
    for g in f2s:
        for f in (g, g + 2):
            if f in f2s:
                up, low, results[f, g] = strengths(model, f, g, top)
                energies.setdefault(g, np.sort(low))
                results[f, g] = results[f, g][np.ix_(np.argsort(up, kind="stable"), np.argsort(low, kind="stable"))]
    size = max(np.abs(energy).max(initial=0.0) for energy in energies.values())
    close = groups_of_close(energies, size)
    expected = {(f, g): summed(each, close[f], close[g]) for (f, g), each in results.items() if each.size}
    groups = [(group, group.levels((f2s[0], f2s[-1]))) for group in connected_groups(file.par, file.intensities)]
    compare_levels(groups, energies, size, file.text)
    return compare_lines(groups, energies, close, expected, file.text)


@pytest.mark.parametrize(("make", "states", "spins"), KINDS)
def test_levels_and_strengths_are_those_of_the_direct_product(make, states, spins):
    assert _compare(make(0, states, spins), 3 if not spins else 2) > 5


@pytest.mark.slow(seconds=60)
@pytest.mark.parametrize(("make", "states", "spins"), KINDS + LARGER)
def test_levels_and_strengths_of_more_files(make, states, spins):
    count = {0: 60, 1: 30, 2: 10, 3: 5}[spins]
    assert sum(_compare(make(seed, states, spins), 4 if not spins else 3) for seed in range(1, count + 1)) > 100
