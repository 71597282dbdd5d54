"""Spins coupled to the rotation, N + S1 = J, J + I1 = F1, ... = F: the levels, and what lines and fits need of them.

    H = H_rot + Σ_terms (`operators`)

Levels are solved F by F (`blocks`) over the eigenstates of the rotation (`rotor`), with coefficients of coupling (`coupling`);
`lines` has elements of dipoles between them, and derivatives; `scheme` the spins themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rotor.arrays import Floats, Ints
from rotor.quantum.spins.scheme import Scheme, scheme_of
from rotor.quantum.spins.terms import Spin, SpinTerm

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.quantum.effect import QuantumEffect
    from rotor.quantum.levels import Levels
    from rotor.quantum.spins.blocks import SpinBlock
    from rotor.quantum.tensors import Tensors
    from rotor.tops.top import Top

__all__ = [
    "Scheme",
    "Spin",
    "SpinTerm",
    "scheme_of",
    "spin_amplitudes",
    "spin_blocks_connected",
    "spin_derivatives",
    "spin_levels",
]


def spin_levels(
    top: Top, effects: tuple[QuantumEffect, ...], jmin: int, jmax: int, executor: Executor | None = None
) -> Levels:
    """All levels of a top with spins whose label has N from `jmin` to `jmax`, by (v), n, k or ka and kc, j, f1, ... f.

    Every F that such an N reaches is solved with all its N, so that nothing is left out of a block.

    Parameters
    ----------
    top : Top
        Constants, kind and spin weights.
    effects : tuple of QuantumEffect
        What the Hamiltonian consists of, spins among it.
    jmin, jmax : int
        Lowest and highest N of the labels.
    executor : Executor, optional
        The rotation is spread over it by N.

    Returns
    -------
    Levels
        Energies in MHz; half-integer quantum numbers are doubled.
    """
    from rotor.quantum.spins.levels import levels_of_f

    total = scheme_of(top, effects).total
    first = max(2 * jmin - total, total % 2)
    return levels_of_f(top, effects, range(first, 2 * jmax + total + 1, 2), (jmin, jmax), executor)


def spin_derivatives(top: Top, levels: Levels, names: Sequence[str], rows: Ints) -> Floats:
    """∂E/∂c of levels with spins.

    Parameters
    ----------
    top : Top
        The constants that the levels were solved with.
    levels : Levels
        Levels with spins and their eigenvectors.
    names : sequence of str
        Parameters, in the order of the columns.
    rows : (rows,) array of int
        Indices of the levels.

    Returns
    -------
    (rows, names) array
        MHz per MHz.

    Raises
    ------
    ValueError
        For levels without vectors.
    """
    from rotor.quantum.spins.lines import derivatives

    return derivatives(top, levels, names, rows)


def spin_amplitudes(up: SpinBlock, low: SpinBlock, tensors: Tensors) -> Floats:
    """Real reduced elements between all states of two blocks, (n_up, n_low)."""
    from rotor.quantum.spins.lines import amplitudes

    return amplitudes(up, low, tensors)


def spin_blocks_connected(up: SpinBlock, low: SpinBlock, tensors: Tensors) -> bool:
    """Whether the tensors have an element between two blocks."""
    from rotor.quantum.spins.lines import connected

    return connected(up, low, tensors)
