"""DIAG below 0: SPCAT diagonalizes nothing. Its levels are the functions of the basis, with the diagonal elements as energies.

A solved block has all its eigenvectors c and energies E, so that <i|H|i> = sum over states of c_i^2 E; no matrix is set up again.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.formats.spcat.hamiltonian.labels import renamed, wang_functions
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.spins.blocks import SpinBlock


def is_undiagonalized(levels: Levels, diag: int) -> bool:
    """Whether DIAG is below 0 and the levels are those of blocks over Wang functions, so that their functions can be listed."""
    whole = all(getattr(block, "allowed", None) is None for block in levels.blocks)
    return diag < 0 and "kc" in levels.quanta and bool(levels.blocks) and whole


def without_diagonalization(levels: Levels) -> Levels:
    """Levels of the functions of each block, in order of their diagonal elements; each has a single function."""
    pieces = [_functions_as_states(block, str(levels.representation)) for block in levels.blocks]
    blocks = tuple(block for block, _ in pieces)
    energies = levels.energy_mhz.copy()
    for block in blocks:
        energies[block.start : block.start + len(block.energies_mhz)] = block.energies_mhz
    named = renamed(levels, [names for _, names in pieces], [np.ones(len(names)) for _, names in pieces])
    return replace(named, energy_mhz=energies, blocks=blocks)


def _functions_as_states(block: SolvedBlock | SpinBlock, representation: str) -> tuple[SolvedBlock | SpinBlock, Ints]:
    """A block whose states are its functions, and their labels.

    The rows of the eigenvectors are rotational states where spins are added. With functions F = T R of rows R, amplitudes A = T V and
    orthogonal V, the functions are the columns of V A^T.
    """
    functions = wang_functions(block, representation)
    diagonal: Floats = functions.amplitudes**2 @ block.energies_mhz
    order = np.argsort(diagonal, kind="stable")  # stable: equal diagonal elements keep the order of functions
    vectors = (block.vectors @ functions.amplitudes.T)[:, order]
    names = functions.names[order]
    if isinstance(block, SpinBlock):
        return replace(block, energies_mhz=diagonal[order], vectors=vectors, labels=names), names
    labels = None if block.labels is None else names
    return replace(block, energies_mhz=diagonal[order], vectors=vectors, labels=labels), names
