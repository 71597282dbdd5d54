"""Diagonals of the unit matrices ½[Jz^2q, J₊^2n + J₋^2n]₊ over Wang blocks side by side.

Labelled levels of fits and derivatives have them in common; the elements are those of `wang_matrix`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.wang.basis import WangBlock
from rotor.quantum.wang.wang_matrix import WangRows


def unit_diagonals(
    blocks: Sequence[WangBlock], taken: Sequence[int], units: Sequence[tuple[int, int]]
) -> tuple[Floats, ...]:
    """Diagonal d of ½[Jz^2q, J₊^2n + J₋^2n]₊ at (block, state, (q, n)), state i with i + d; zero beyond a block.

    taken: how many of the states of each block.
    """
    js, rows = WangRows.from_blocks(blocks, taken)
    j = np.array(js, dtype=float)[:, None]
    order = max((n for _, n in units), default=0)
    out = tuple(np.zeros((*rows.k.shape, len(units))) for _ in range(order + 1))
    for place, (q, n) in enumerate(units):
        elements = _elements(j, np.arange(-2.0 * n, js[-1] + 1), q, n)
        rows.add(elements, n, n, [diagonal[:, :, place] for diagonal in out])
    return out


def _elements(j: Floats, k: Floats, q: int, n: int) -> Floats:
    """⟨K+2n|½[Jz^2q, J₊^2n + J₋^2n]₊|K⟩ (J, K), K^2q for n = 0."""
    if n == 0:
        return np.asarray(k ** (2 * q) + 0.0 * j)
    squared = np.ones_like(j * k)
    for i in range(2 * n):
        squared = squared * np.maximum((j - k - i) * (j + k + i + 1), 0.0)
    return np.asarray(0.5 * ((k + 2 * n) ** (2 * q) + k ** (2 * q)) * np.sqrt(squared))
