"""Levels of the rotation without spins by the cheapest exact method (`rotor.quantum.solve`): closed forms, Wang or coupled blocks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import partial
from itertools import accumulate
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.effect import QuantumEffect, couplings_of, k_limits_of
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.levels import Levels, levels_table, single_block
from rotor.quantum.wang.basis import WangBlock, blocks_within, names_of_blocks
from rotor.quantum.wang.coupled_levels import Model, coupled_levels, model_of
from rotor.quantum.wang.spherical_top import DIMENSION, is_cubic, scalar_and_tensor, tensor_eigenvalues
from rotor.quantum.wang.wang_matrix import (
    block_bands,
    diagonal_elements,
    diagonalise_all,
    lowest_energies,
    scalar_energy,
)
from rotor.tops.constants.operators import AXIAL_REPRESENTATION, Operators, added

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.tops.top import Top

_NONE: Floats = np.zeros((0, 0))  # in place of eigenvectors that are not computed


def hamiltonian(top: Top, effects: Sequence[QuantumEffect] = SEMI_RIGID) -> Operators:
    """Sum of the operators of all effects, {(p, q, n): MHz}, without zeros."""
    total = added(
        (operators, values[name])
        for effect in effects
        for values in [effect.parameters(top)]
        for name, operators in effect.operators(top).items()
    )
    return {powers: value for powers, value in total.items() if value}


def representation_of(top: Top) -> str:
    """The representation in which a top without closed form is solved: that of its constants, or the one with the axis along z."""
    return AXIAL_REPRESENTATION.get(top.kind) or str(top.constants.representation or "Ir")


def solve_rotation(
    top: Top,
    effects: tuple[QuantumEffect, ...],
    jmin: int,
    jmax: int,
    vectors: bool = True,
    executor: Executor | None = None,
    in_blocks: bool = False,
    below_mhz: float = math.inf,
) -> Levels:
    """Levels of the rotation, and of states v, without spins; see `solve_levels`.

    in_blocks: solve symmetric tops in Wang blocks too, so that the levels have eigenvectors. Raises ValueError for constants that overflow,
    and as `coupled_levels` for coupled blocks.
    """
    operators, limits = hamiltonian(top, effects), k_limits_of(top, effects)
    if top.kind != "linear":
        representation = representation_of(top)
        model = model_of(top, effects, operators, representation)
        if _axial_states(top, model) and not in_blocks:
            return _symmetric(top, effects, model.states, jmin, jmax)
        if len(model.states) > 1 or model.links:
            return coupled_levels(top, effects, model, jmin, jmax, executor)
        if top.kind == "asymmetric" or in_blocks or limits or not _closed_form_holds(top.kind, operators):
            return _in_wang_blocks(top, effects, operators, jmin, jmax, vectors, executor, limits.get(0), below_mhz)
    if top.kind in ("prolate", "oblate"):
        return _symmetric(top, effects, {0: operators}, jmin, jmax)
    if top.kind == "spherical":
        return _spherical(top, effects, operators, jmin, jmax)
    return _linear(top, effects, operators, jmin, jmax, in_blocks)


def _closed_form_holds(kind: str, operators: Operators) -> bool:
    """Whether the operators have closed-form energies for this kind of top."""
    if kind == "spherical":
        return is_cubic(operators)
    return all(n == 0 for _, _, n in operators)


def _linear(
    top: Top, effects: tuple[QuantumEffect, ...], operators: Operators, jmin: int, jmax: int, in_blocks: bool
) -> Levels:
    """Linear tops: E = Σ c X^p. In blocks, each J is the Wang function of K = 0 in the representation Iʳ."""
    beyond = [powers for powers in operators if powers[1] or powers[2]]
    with_axis = [e.name or type(e).__name__ for e in effects if e.states(top) or couplings_of(top, [e], "Ir")]
    if beyond or with_axis:
        what = f"operator {beyond[0]} (powers p, q, n of J², Jz², J±²)" if beyond else f"effect {with_axis[0]}"
        raise ValueError(
            f"{what}: a linear top in a Σ state has K = 0 and operators of J² alone; give the top an axis (kind prolate) or "
            "leave the effect out"
        )
    j = np.arange(jmin, jmax + 1)
    energy = diagonal_elements(operators, j, 0 * j)
    if not in_blocks:
        return levels_table(top, effects, jmax, energy, {"j": j})
    functions = [WangBlock(number, "eo" if number % 2 else "ee", 0, 1, 1) for number in j.tolist()]
    blocks = tuple(single_block(basis, energy[[i]], np.ones((1, 1)), i) for i, basis in enumerate(functions))
    return levels_table(top, effects, jmax, energy, {"j": j}, "Ir", blocks=blocks)


def _spherical(top: Top, effects: tuple[QuantumEffect, ...], operators: Operators, jmin: int, jmax: int) -> Levels:
    """Spherical tops: E = Σ c X^p with one row of 2J+1 components for each J, or with one row for each level that D_t splits."""
    scalars, dt = scalar_and_tensor(operators)
    j = np.arange(jmin, jmax + 1)
    energy = diagonal_elements(scalars, j, 0 * j)
    if not dt:
        return levels_table(top, effects, jmax, energy, {"j": j}, components=2 * j + 1)
    split = [tensor_eigenvalues(int(value), 1 if dt > 0 else -1) for value in j]
    sizes = [len(irreps) for irreps, _ in split]
    irreps, omega = (np.concatenate(column) for column in zip(*split, strict=True))
    quanta, components = {"j": np.repeat(j, sizes), "irrep": irreps}, np.array([DIMENSION[irrep] for irrep in irreps])
    return levels_table(top, effects, jmax, np.repeat(energy, sizes) + dt * omega, quanta, components=components)


def _symmetric(
    top: Top, effects: tuple[QuantumEffect, ...], states: dict[int, Operators], jmin: int, jmax: int
) -> Levels:
    """Symmetric tops: E(J, K) = Σ c X^p K^2q of each state, with one row for ±K; ordered by J, state and K."""
    all_j = np.arange(jmin, jmax + 1)
    j, k = np.repeat(all_j, all_j + 1), np.concatenate([np.arange(value + 1) for value in all_j.tolist()])
    numbers, quanta = sorted(states), {"j": j, "k": k}
    energy = np.concatenate([diagonal_elements(states[v], j, k) for v in numbers])
    if len(numbers) > 1:
        v, j, k = np.repeat(numbers, len(j)), np.tile(j, len(numbers)), np.tile(k, len(numbers))
        order = np.lexsort((k, v, j))
        energy, quanta = energy[order], {"v": v[order], "j": j[order], "k": k[order]}
    return levels_table(top, effects, jmax, energy, quanta, components=np.where(quanta["k"] == 0, 1, 2))


def _axial_states(top: Top, model: Model) -> bool:
    """Whether several states of a symmetric top have closed forms: they are uncoupled, and K is good in each."""
    alone = len(model.states) > 1 and not model.links and not model.limits
    return top.kind in ("prolate", "oblate") and alone and all(n == 0 for o in model.states.values() for _, _, n in o)


def _in_wang_blocks(
    top: Top,
    effects: tuple[QuantumEffect, ...],
    operators: Operators,
    jmin: int,
    jmax: int,
    vectors: bool,
    executor: Executor | None,
    limits: tuple[int, int] | None,
    below_mhz: float,
) -> Levels:
    """Levels from Wang blocks, in parallel over J with an executor."""
    representation = representation_of(top)
    all_j = range(jmin, jmax + 1)
    solve = partial(_solve, operators, representation, vectors, limits, below_mhz)
    solved = executor.map(solve, [[j] for j in all_j]) if executor else [solve(all_j)]
    whole = [block for solutions in solved for block in solutions]
    functions, sizes = [basis for basis, _, _ in whole], [len(energies) for _, energies, _ in whole]
    blocks = tuple(map(single_block, *zip(*whole, strict=True), accumulate(sizes, initial=0)))
    j = np.repeat([block.j for block in functions], sizes)
    ka, kc = names_of_blocks(functions, sizes, representation)
    energies, quanta = np.concatenate([b.energies_mhz for b in blocks]), {"j": j, "ka": ka, "kc": kc}
    return levels_table(top, effects, jmax, energies, quanta, representation, blocks=blocks if vectors else ())


def _solve(
    operators: Operators, representation: str, vectors: bool, limits: tuple[int, int] | None, below_mhz: float,
    js: Iterable[int],
) -> list[tuple[WangBlock, Floats, Floats]]:  # fmt: skip
    """Solve the Wang blocks of several J: (block, energies in MHz, eigenvectors) by J in the order ee, eo, oe, oo; K within `limits`."""
    pieces = _with_bands(operators, [block for j in js for block in blocks_within(j, representation, limits)])
    if below_mhz < math.inf and not vectors:
        return [(block, lowest_energies(bands, below_mhz - scalar) + scalar, _NONE) for block, scalar, bands in pieces]
    solved = diagonalise_all([bands for _, _, bands in pieces], vectors)
    return [
        (block, energies + scalar, states)
        for (block, scalar, _), (energies, states) in zip(pieces, solved, strict=True)
    ]


def _with_bands(operators: Operators, blocks: Sequence[WangBlock]) -> list[tuple[WangBlock, float, list[Floats]]]:
    """Wang blocks, each with the scalar part of its energies and the diagonals of the rest."""
    bands = block_bands(operators, blocks)
    return [(block, scalar_energy(operators, block.j), each) for block, each in zip(blocks, bands, strict=True)]
