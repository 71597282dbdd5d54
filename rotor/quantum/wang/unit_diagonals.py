"""Diagonals of the unit matrices ½[Jz^2q, J₊^2n + J₋^2n]₊ over Wang blocks side by side, and their expectation values.

The formulas are those of `wang_matrix`, without a constant; levels of many J, labelled levels of fits and derivatives have them in common.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotor.arrays import Floats, Workspace
from rotor.quantum.wang.basis import WangBlock


def unit_diagonals(
    blocks: Sequence[WangBlock], taken: Sequence[int], units: Sequence[tuple[int, int]]
) -> tuple[Floats, ...]:
    """Diagonal d of ½[Jz^2q, J₊^2n + J₋^2n]₊ at (block, state, (q, n)), state i with i + d; zero beyond a block.

    As in `rotor.quantum.effects.watson`: ⟨K+2n|..|K⟩ on diagonal n, √2 more where K = 0, and ⟨2n-K|..|-K⟩ with the sign of the
    block on diagonal n - K. taken: how many of the states of each block.
    """
    order = max((n for _, n in units), default=0)
    j = np.array([basis.j for basis in blocks], dtype=float)[:, None]
    first = np.array([basis.first_k for basis in blocks])[:, None]
    sign = np.array([basis.sign for basis in blocks], dtype=float)[:, None]
    size, sizes = max(taken), np.array(taken)[:, None]
    index = np.arange(size)[None, :]
    k = (first + 2 * index).astype(float)

    out = tuple(np.zeros((len(blocks), size, len(units))) for _ in range(order + 1))
    for place, (q, n) in enumerate(units):
        inside = index + n < sizes
        element = _element(j, k, q, n) * np.where((k == 0) & (n > 0), np.sqrt(2.0), 1.0)
        out[n][:, :, place] += np.where(inside, element, 0.0)
        for low in range(1, n + 1):
            here = (k == low) & (index + n - low < sizes) & (index < sizes)
            folded = sign * _element(j, np.full_like(k, -low), q, n)
            out[n - low][:, :, place] += np.where(here, folded, 0.0)
    return out


def expectations(diagonals: Sequence[Floats], vectors: Floats, space: Workspace) -> Floats:
    """⟨unit⟩ (blocks, states, units) of states (blocks, size, states) by `unit_diagonals`."""
    size = vectors.shape[1]
    products = np.multiply(vectors, vectors, out=space.array("products", *vectors.shape))
    total = np.matmul(products.transpose(0, 2, 1), diagonals[0])
    for d, unit in enumerate(diagonals[1:size], 1):
        products = space.array("products", len(vectors), size - d, vectors.shape[2])
        np.multiply(vectors[:, :-d, :], vectors[:, d:, :], out=products)
        total += 2.0 * np.matmul(products.transpose(0, 2, 1), unit[:, :-d])
    return np.asarray(total)


def _element(j: Floats, k: Floats, q: int, n: int) -> Floats:
    """⟨K+2n|½[Jz^2q, J₊^2n + J₋^2n]₊|K⟩, K^2q for n = 0."""
    if n == 0:
        return np.asarray(k ** (2 * q) + 0.0 * j)
    squared = np.ones_like(j * k)
    for i in range(2 * n):
        squared = squared * np.maximum((j - k - i) * (j + k + i + 1), 0.0)
    return np.asarray(0.5 * ((k + 2 * n) ** (2 * q) + k ** (2 * q)) * np.sqrt(squared))
