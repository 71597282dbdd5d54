"""Derivatives of levels by constants (theorem of Hellmann and Feynman).

    ∂E_i/∂c = ⟨i|∂H/∂c|i⟩

(H. Hellmann, Einführung in die Quantenchemie (1937) 285; R. P. Feynman, Phys. Rev. 56 (1939) 340), where ∂H/∂c is a sum of
terms J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊. Their elements over Wang functions are those of fits (`linear_stacks`); the states of
blocks of like size are computed together.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints, Workspace, distinct
from rotor.quantum.basis.state_elements import StateTerms, linear_blocks_of, wang_stacks
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.hyperfine_method import are_with_spins
from rotor.quantum.levels import Levels
from rotor.quantum.wang.rotation import hamiltonian
from rotor.quantum.wang.spherical_top import scalar_and_tensor, tensor_eigenvalues
from rotor.quantum.wang.wang_matrix import diagonal_elements
from rotor.tops.constants.operators import Operators

if TYPE_CHECKING:
    from rotor.tops.top import Top

Rows = NDArray[np.integer]


def level_derivatives(top: Top, levels: Levels, names: Sequence[str] | None = None, rows: Rows | None = None) -> Floats:
    """∂E/∂c (rows, names) of levels by named parameters of their effects, exact at those that the levels were solved with.

    By default of all levels and by all parameters. Raises ValueError for a name that no effect has, and for levels of an asymmetric top
    that were solved without vectors.

    >>> from rotor.quantum.solve import solve_levels
    >>> from rotor.tops.top import Top
    >>> top = Top.from_constants("A=10 B=6 C=4 MHz")
    >>> (level_derivatives(top, solve_levels(top, 1)).round(12) + 0.0).tolist()[1:]
    [[0.0, 1.0, 1.0], [1.0, 1.0, 0.0], [1.0, 0.0, 1.0]]
    """
    by_name = parameter_operators(top, levels.effects)
    names = tuple(by_name) if names is None else tuple(names)
    for name in names:
        if name not in by_name:
            raise ValueError(f"no parameter {name} here to derive by: the effects have {', '.join(by_name)}")
    places: Ints = np.asarray(np.arange(len(levels)) if rows is None else rows, dtype=np.int64)
    of_species = [
        block.moments.slopes([(block, np.eye(len(block.energies_mhz))[:, None])], names)
        for block in levels.blocks
        if block.moments is not None
    ]
    if of_species:
        return np.asarray(np.concatenate(of_species)[places])
    if "f" in levels.quanta or are_with_spins(levels):
        from rotor.quantum.spins.linear_blocks import derivatives

        return derivatives(top, levels, names, places)
    if "irrep" in levels.quanta:
        return _derivatives_of_spherical(top, levels, names, places)
    if any(not block.alone for block in levels.blocks):
        return _derivatives_of_coupled(top, levels, names, places)
    return _derivatives_of_uncoupled(top, levels, names, places)


def _derivatives_of_uncoupled(top: Top, levels: Levels, names: Sequence[str], rows: Rows) -> Floats:
    """Derivatives of levels of one state or of uncoupled ones, in closed form: each parameter acts in its state only."""
    terms = {0: parameter_operators(top, levels.effects)}
    terms |= {state.v: state.terms for effect in levels.effects for state in effect.states(top)}
    out, v = np.zeros((len(rows), len(names))), levels.quantum("v")
    for number, by_name in terms.items():
        here = v[rows] == number
        out[here] = expectations(levels, [by_name.get(name, {}) for name in names], rows[here])
    return out


def parameter_operators(top: Top, effects: Sequence[QuantumEffect]) -> dict[str, Operators]:
    """∂H/∂c by powers (p, q, n) for each parameter; empty for parameters of other operators.

    If two effects have a parameter of the same name, its operators are added.
    """
    by_name: dict[str, Operators] = {}
    for effect in effects:
        operators = effect.operators(top)
        for name in effect.parameters(top):
            total = by_name.setdefault(name, {})
            for powers, factor in operators.get(name, {}).items():
                total[powers] = total.get(powers, 0.0) + factor
    return by_name


def _derivatives_of_coupled(top: Top, levels: Levels, names: Sequence[str], rows: Rows) -> Floats:
    """Derivatives of levels in coupled blocks, from their linear blocks."""
    blocks = [levels.blocks[i] for i in distinct(levels.block_numbers(rows)).tolist()]
    out = np.zeros((len(levels), len(names)))
    for block, linear in zip(blocks, linear_blocks_of(top, levels, names, blocks), strict=True):
        out[block.start : block.start + len(block.energies_mhz), linear.parameters] = linear.slopes(block.vectors)
    return out[rows]


def _derivatives_of_spherical(top: Top, levels: Levels, names: Sequence[str], rows: Rows) -> Floats:
    """Derivatives of split levels of a spherical top: X^p by scalar constants, the eigenvalue ω of the tensor by D_t.

    A parameter that multiplies d times the tensor plus scalars contributes d ω plus the scalars.
    """
    by_name = parameter_operators(top, levels.effects)
    total = hamiltonian(top, levels.effects)
    sign = 1 if scalar_and_tensor(total)[1] > 0 else -1
    j = levels.quanta["j"]
    omega = np.concatenate([tensor_eigenvalues(int(value), sign)[1] for value in np.unique(j)])
    x = (j * (j + 1)).astype(float)
    out = np.empty((len(levels), len(names)))
    for i, name in enumerate(names):
        scalars, dt = scalar_and_tensor(by_name[name])
        out[:, i] = dt * omega + sum(factor * x**p for (p, _, _), factor in scalars.items())
    return out[rows]


def expectations(levels: Levels, operators: Sequence[Operators], rows: Rows) -> Floats:
    """⟨Σ c J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊⟩ (rows, operators) of levels."""
    if "kc" in levels.quanta:
        return _expectations_in_blocks(levels, operators, rows)
    j, k = levels.rotational[rows], levels.quantum("k")[rows]
    return np.stack([diagonal_elements(terms, j, k) for terms in operators], axis=1)


def _expectations_in_blocks(levels: Levels, operators: Sequence[Operators], rows: Rows) -> Floats:
    """`expectations` in states of Wang blocks."""
    if not levels.blocks:
        raise ValueError("these levels were solved without vectors; solve them with vectors=True")
    blocks = [levels.blocks[i] for i in distinct(levels.block_numbers(rows)).tolist()]
    terms = StateTerms.from_operators([0], [(0, i, operator) for i, operator in enumerate(operators)], ())
    out, space = np.empty((len(levels), len(operators))), Workspace()
    for positions, stack in wang_stacks([block.basis for block in blocks], terms, len(operators)):
        alike = [blocks[i] for i in positions.tolist()]
        vectors = np.zeros((len(alike), stack.size, stack.size))
        for place, block in enumerate(alike):
            vectors[place, : block.basis.size, : block.basis.size] = block.vectors
        total = stack.slopes(vectors, None, space)
        for place, block in enumerate(alike):
            out[block.start : block.start + block.basis.size] = total[place, : block.basis.size]
    return out[rows]
