"""Bounds of coefficients of coupling for all F, from the spins that act alone, against the whole chain F by F."""

from __future__ import annotations

import numpy as np
import pytest

from rotor.quantum.spins.neglected import coupling_alone
from rotor.quantum.spins.pattern_tables import couplings_by_f
from rotor.quantum.spins.rotor import Channel
from rotor.quantum.spins.scheme import Scheme, Spin

HIGHEST = 6
THREE = Scheme((Spin("S", 1, True), Spin("14N", 2), Spin("35Cl", 3)))
PAIR = Scheme((Spin("14N", 2), Spin("Cl1", 3, total="I"), Spin("Cl2", 3, total="I")))


@pytest.mark.parametrize(
    ("scheme", "channel", "within"),
    [
        (THREE, Channel((2, 2), 2), 1.0),
        (THREE, Channel((1,), 1), 1.0),
        (THREE, Channel((0,), 1, ns=1, n2=1), 1.0),
        (THREE, Channel((0, 2), 2), 1.5),
        (THREE, Channel((1, 2), 0), 1.5),
        (PAIR, Channel((2, 2), 2, exchange=1), 1.5),
        (PAIR, Channel((2, 2), 2, exchange=-1), 2.0),
    ],
)
def test_bounds_are_those_of_the_whole_chain(scheme, channel, within):
    """The largest singular value and the eigenvalues over all F; of one spin equal, of two no more than `within` times as much."""
    computed = coupling_alone(scheme, channel, HIGHEST)
    largest = np.zeros((HIGHEST + 1, HIGHEST + 1))
    ends = np.array([np.full(HIGHEST + 1, np.inf), np.full(HIGHEST + 1, -np.inf)])
    for f in range(scheme.total % 2, 2 * HIGHEST + scheme.total + 1, 2):
        pattern = scheme.patterns(f)
        pattern = pattern[pattern[:, 0] <= 2 * HIGHEST]
        whole = couplings_by_f(scheme, channel, f, f)[0][: len(pattern), : len(pattern)]
        rows_by_n = {n: np.flatnonzero(pattern[:, 0] == 2 * n) for n in range(HIGHEST + 1) if 2 * n in pattern[:, 0]}
        for m, rows in rows_by_n.items():
            for n, columns in rows_by_n.items():
                largest[m, n] = max(largest[m, n], np.linalg.norm(whole[np.ix_(rows, columns)], 2))
            values = np.linalg.eigvalsh(whole[np.ix_(rows, rows)])
            ends[:, m] = min(ends[0, m], values[0]), max(ends[1, m], values[-1])
    allowed = 1e-12 * largest.max()  # round-off of sums of a few products
    assert (largest <= computed.norm + allowed).all()
    assert (computed.norm.sum(), computed.norm.max()) <= (
        within * largest.sum() + allowed,
        within * largest.max() + allowed,
    )
    assert (computed.lowest <= ends[0] + allowed).all()
    assert (computed.highest >= ends[1] - allowed).all()
