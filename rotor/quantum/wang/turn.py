"""Blocks whose diagonal ceases to rise with K, where the constants say nothing of the molecule any more."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotor.arrays import Floats, Ints


def turned(diagonal: Floats, sizes: Sequence[int]) -> tuple[Ints, Ints]:
    """The blocks whose diagonal ceases to rise, and where it does, by block."""
    size = np.asarray(sizes)
    turn = np.where(np.arange(diagonal.shape[1]) < size[:, None], diagonal, -np.inf).argmax(axis=1)
    return np.flatnonzero((turn > 0) & (turn < size - 1)), turn


def order_beyond_the_turn(turning: tuple[Ints, Ints], sizes: Sequence[int], energies: Floats, vectors: Floats) -> None:
    """States beyond the K where the diagonal (blocks, size) ceases to rise come last, by their mean K; the arrays are changed.

    Constants that describe K up to 20 may bring the states of K = 60 down among those: the series has left the molecule there. Such a
    state is mostly beyond the turn, and the labels of the others are the ranks among themselves, whatever it does.

    Parameters
    ----------
    turning : (array, array)
        What `turned` finds of the diagonals, with the sign with which they rise in a molecule.
    sizes : sequence of int
    energies : (blocks, size) array
        Rising.
    vectors : (blocks, size, size) array
        In columns.
    """
    blocks, turn = turning
    for b in blocks.tolist():
        n = sizes[b]
        share = vectors[b, :n, :n] ** 2
        beyond = share[turn[b] + 1 :].sum(axis=0) > 0.5
        order = np.lexsort((np.where(beyond, np.arange(n) @ share, 0.0), beyond))
        energies[b, :n] = energies[b, order]
        vectors[b, :n, :n] = vectors[b, :n, order].T
