"""Names of states: each function once, the sum of the overlaps as large as any other method finds it."""

from __future__ import annotations

import numpy as np
import pytest

from rotor.quantum.wang.coupled_levels import match_names


@pytest.mark.parametrize("kind", ["vectors", "numbers", "ties"])
def test_the_sum_of_the_overlaps_is_that_of_scipy(kind):
    from scipy.optimize import linear_sum_assignment

    rng = np.random.default_rng(5)
    conflicts = 0
    for size in range(2, 42):
        mixed = np.linalg.qr(rng.normal(size=(size, size)) + 2 * np.eye(size)[rng.permutation(size)])[0] ** 2
        overlaps = {"vectors": mixed, "numbers": rng.random((size, size)) ** 3, "ties": np.round(mixed, 1)}[kind]
        conflicts += len(set(overlaps.argmax(axis=0).tolist())) < size
        computed = match_names(overlaps)
        assert sorted(computed.tolist()) == list(range(size))
        rows, columns = linear_sum_assignment(overlaps, maximize=True)
        best = overlaps[rows, columns].sum()
        assert overlaps[computed, np.arange(size)].sum() == pytest.approx(best, abs=1e-12)  # round-off of 40 sums
    assert conflicts > 20
