"""The rotation of a top with a threefold axis over Wang functions, to which three equivalent nuclei are coupled."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.levels import SolvedBlock
from rotor.quantum.wang.basis import Part, WangBlock

_OF_THE_AXIS = 1e-9  # limit of elements that break the threefold axis, relative to the largest; round-off is smaller


def in_wang_functions(blocks: Sequence[SolvedBlock]) -> tuple[list[SolvedBlock], list[Floats]]:
    """Blocks of the rotation over Wang functions, since the threefold axis needs K, and their Hamiltonians without the diagonal.

    Raises ValueError for a rotation without a threefold axis.
    """
    functions, hamiltonians = list[SolvedBlock](), list[Floats]()
    for block in blocks:
        hamiltonian = (block.vectors * block.energies_mhz) @ block.vectors.T
        _check_axis(block, hamiltonian)
        functions.append(SolvedBlock(block.parts, np.diag(hamiltonian).copy(), np.eye(len(hamiltonian))))
        hamiltonians.append(hamiltonian - np.diag(np.diag(hamiltonian)))
    return functions, hamiltonians


def _check_axis(block: SolvedBlock, matrix: Floats) -> None:
    """Raise ValueError if the rotation connects K with K' other than ±K + 3n."""
    k = np.concatenate([wang_functions(part).k for part in block.parts])
    apart = ((k[:, None] - k) % 3 != 0) & ((k[:, None] + k) % 3 != 0)
    if np.abs(matrix[apart]).max(initial=0.0) > _OF_THE_AXIS * np.abs(matrix).max():
        raise ValueError(
            "three equivalent nuclei lie about a threefold axis, and the constants have none: expected a symmetric top about its a "
            "or c axis, such as B = C"
        )


def wang_functions(part: Part) -> WangBlock:
    """The Wang functions of a part; ValueError for a linear molecule."""
    if not isinstance(part.basis, WangBlock):
        raise ValueError("three equivalent nuclei need functions with K and a sign; a linear molecule has none")
    return part.basis
