"""DIAG below 0: SPCAT and SPFIT diagonalize nothing. Its levels are the functions of the basis, with the diagonal elements as energies.

A solved block has all its eigenvectors c and energies E, so that <i|H|i> = sum over states of c_i^2 E; no matrix is set up again.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.formats.spcat.hamiltonian.labels import renamed, wang_functions
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.spins.blocks import SpinBlock
from rotor.quantum.spins.parts import names_of_block

UNDIAGONALIZED_NOTE = (
    "DIAG is below 0: the energies are diagonal elements of the Hamiltonian over the functions of the file, as in SPCAT, and each "
    "level is one function; DIAG = 0 has eigenvalues"
)


def refuse_other_functions(levels: Levels, l_doubled: bool) -> None:
    """Raise ValueError for levels whose functions are not those of the file, so that they have other diagonal elements than in SPCAT."""
    what = "l-doubled states" if l_doubled else "three equivalent spins"
    if l_doubled or any(getattr(block, "allowed", None) is not None for block in levels.blocks):
        raise ValueError(
            f"DIAG is below 0, diagonal elements in place of eigenvalues: those of {what} are not computed; give DIAG = 0 for eigenvalues"
        )


def without_diagonalization(levels: Levels) -> Levels:
    """Levels of the functions of each block, in order of their diagonal elements; each has a single function.

    Levels without blocks, such as those of a symmetric top, are those of single functions already.
    """
    if not levels.blocks:
        return levels
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
    if block.axial_k is None:
        functions = wang_functions(block, representation)
        names, amplitudes = functions.names, functions.amplitudes
    else:  # |N K⟩ with each pattern: the rows of the vectors
        assert isinstance(block, SpinBlock)
        names, amplitudes = names_of_block(block.parts, block.patterns).labels, block.vectors
    diagonal: Floats = amplitudes**2 @ block.energies_mhz
    order = np.argsort(diagonal, kind="stable")  # stable: equal diagonal elements keep the order of functions
    vectors = (block.vectors @ amplitudes.T)[:, order]
    names = names[order]
    if isinstance(block, SpinBlock):
        return replace(block, energies_mhz=diagonal[order], vectors=vectors, labels=names), names
    labels = None if block.labels is None else names
    return replace(block, energies_mhz=diagonal[order], vectors=vectors, labels=labels), names
