"""Blocks whose diagonal elements cease to rise with K, beyond the range in which the constants describe the molecule."""

from __future__ import annotations

import numpy as np

from rotor.arrays import Floats, Ints


def turned(diagonal: Floats, sizes: Ints) -> tuple[Ints, Ints]:
    """Numbers of the blocks whose diagonal has its maximum (the turn) before the end, and the place of the maximum in each block."""
    turn = np.where(np.arange(diagonal.shape[1]) < sizes[:, None], diagonal, -np.inf).argmax(axis=1)
    return np.flatnonzero((turn > 0) & (turn < sizes - 1)), turn


def order_beyond_the_turn(turning: tuple[Ints, Ints], sizes: Ints, energies: Floats, vectors: Floats) -> None:
    """Move states beyond the turn of the diagonal to the end of their block, ordered by mean K, in place.

    Constants that describe K up to 20 may shift states of K = 60 down among lower K, where the distortion series diverges. These states are
    mostly beyond the turn; the other states are labelled by rank among themselves. turning: from `turned`, for the diagonals with the sign
    that makes them rise in a molecule. energies (blocks, size) rise; vectors (blocks, size, size) stand in columns.
    """
    blocks, turn = turning
    for b in blocks.tolist():
        n = sizes[b]
        share = vectors[b, :n, :n] ** 2
        beyond = share[turn[b] + 1 :].sum(axis=0) > 0.5
        order = np.lexsort((np.where(beyond, np.arange(n) @ share, 0.0), beyond))
        energies[b, :n] = energies[b, order]
        vectors[b, :n, :n] = vectors[b, :n, order].T
