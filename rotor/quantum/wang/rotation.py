"""Levels of the rotation without spins by the cheapest exact method (`rotor.quantum.solve`): closed forms, Wang or coupled blocks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.coupled_levels import Model, coupled_levels, model_of
from rotor.quantum.effect import QuantumEffect, k_limits_of
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.levels import Levels, SolvedBlock, single_block, weights_of_levels
from rotor.quantum.wang.basis import WangBlock, limited, names_of, wang_blocks
from rotor.quantum.wang.spherical_top import DIMENSION, is_cubic, scalar_and_tensor, tensor_eigenvalues
from rotor.quantum.wang.wang_matrix import (
    JMatrix,
    block_bands,
    diagonalise_all,
    lowest_energies,
    matrices_of,
    scalar_energy,
)
from rotor.tops.operators import AXIAL_REPRESENTATION, Operators, added
from rotor.tops.spins.spin_weights import SpinWeights

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
            return _symmetric_states(top, effects, model, jmin, jmax)
        if len(model.states) > 1 or model.couplings:
            return coupled_levels(top, effects, model, jmin, jmax, executor)
        if top.kind == "asymmetric" or in_blocks or limits or not _closed_form_holds(top.kind, operators):
            return _in_wang_blocks(top, effects, operators, jmin, jmax, vectors, executor, limits.get(0), below_mhz)
    if top.kind in ("prolate", "oblate"):
        return _symmetric(top, effects, operators, jmin, jmax)
    if top.kind == "spherical":
        return _spherical(top.spin_weights, effects, operators, jmin, jmax)
    return _linear(top, effects, operators, jmin, jmax, in_blocks)


def _closed_form_holds(kind: str, operators: Operators) -> bool:
    """Whether the operators have closed-form energies for this kind of top."""
    if kind == "spherical":
        return is_cubic(operators)
    return all(n == 0 for _, _, n in operators)


def _scalar_energies(operators: Operators, jmin: int, jmax: int) -> tuple[Ints, Floats]:
    """J and Σ c X^p for each."""
    j = np.arange(jmin, jmax + 1)
    return j, np.array([scalar_energy(operators, int(value)) for value in j])


def _linear(
    top: Top, effects: tuple[QuantumEffect, ...], operators: Operators, jmin: int, jmax: int, in_blocks: bool
) -> Levels:
    """Linear tops: E = Σ c X^p. In blocks, each J is the Wang function of K = 0 in the representation Iʳ."""
    beyond = [powers for powers in operators if powers[1] or powers[2]]
    with_axis = [
        e.name or type(e).__name__ for e in effects if e.couplings(top) or e.states(top) or _has_j_operator(e, top)
    ]
    if beyond or with_axis:
        what = f"operator {beyond[0]} (powers p, q, n of J², Jz², J±²)" if beyond else f"effect {with_axis[0]}"
        raise ValueError(
            f"{what}: a linear top in a Σ state has K = 0 and operators of J² alone; give the top an axis (kind prolate) or "
            "leave the effect out"
        )
    j, energy = _scalar_energies(operators, jmin, jmax)
    return Levels(
        kind="linear",
        representation="Ir" if in_blocks else None,
        jmax=jmax,
        energy_mhz=energy,
        quanta={"j": j},
        multiplicity=2 * j + 1,
        components=np.ones_like(j),
        weight=top.spin_weights.linear_weights(j),
        effects=effects,
        blocks=tuple(
            _single_function(int(number), e, row) for row, (number, e) in enumerate(zip(j, energy, strict=True))
        )
        if in_blocks
        else (),
    )


def _single_function(j: int, energy: float, row: int) -> SolvedBlock:
    """A block of the single function K = 0."""
    basis = WangBlock(j, "eo" if j % 2 else "ee", 0, 1, 1)
    return single_block(basis, np.array([energy]), np.ones((1, 1)), row)


def _has_j_operator(effect: QuantumEffect, top: Top) -> bool:
    """Whether a parameter of an effect multiplies an operator other than powers of J."""
    return any(effect.j_operator(top, name, 1, "Ir") is not None for name in effect.parameters(top))


def _spherical(
    weights: SpinWeights, effects: tuple[QuantumEffect, ...], operators: Operators, jmin: int, jmax: int
) -> Levels:
    """Spherical tops: E = Σ c X^p with one row of 2J+1 components for each J, or with one row for each level that D_t splits."""
    scalars, dt = scalar_and_tensor(operators)
    j, energy = _scalar_energies(scalars, jmin, jmax)
    if not dt:
        weight = weights.spherical_weights(j)
        return Levels("spherical", None, jmax, energy, {"j": j}, 2 * j + 1, 2 * j + 1, weight, effects=effects)

    split = [tensor_eigenvalues(int(value), 1 if dt > 0 else -1) for value in j]
    sizes = [len(irreps) for irreps, _ in split]
    irreps = np.concatenate([irreps for irreps, _ in split])
    return Levels(
        kind="spherical",
        representation=None,
        jmax=jmax,
        energy_mhz=np.repeat(energy, sizes) + dt * np.concatenate([omega for _, omega in split]),
        quanta={"j": np.repeat(j, sizes), "irrep": irreps},
        multiplicity=2 * np.repeat(j, sizes) + 1,
        components=np.array([DIMENSION[irrep] for irrep in irreps]),
        weight=np.array([weights.irrep_weight(irrep) for irrep in irreps]),
        effects=effects,
    )


def _symmetric(top: Top, effects: tuple[QuantumEffect, ...], operators: Operators, jmin: int, jmax: int) -> Levels:
    """Symmetric tops: E(J, K) = Σ c X^p K^2q, with one row for ±K."""
    j = np.repeat(np.arange(jmin, jmax + 1), np.arange(jmin, jmax + 1) + 1)
    k = np.concatenate([np.arange(value + 1) for value in range(jmin, jmax + 1)])
    x, squares = (j * (j + 1)).astype(float), (k * k).astype(float)
    energy = np.zeros(j.shape)
    for (p, q, _), c in operators.items():
        energy += c * x**p * squares**q

    weight = top.spin_weights.symmetric_weights(j, k, oblate=top.kind == "oblate")
    components = np.where(k == 0, 1, 2)
    return Levels(top.kind, None, jmax, energy, {"j": j, "k": k}, 2 * j + 1, components, weight, effects=effects)


def _axial_states(top: Top, model: Model) -> bool:
    """Whether several states of a symmetric top have closed forms: they are uncoupled, and K is good in each."""
    alone = len(model.states) > 1 and not model.couplings and not model.limits
    return top.kind in ("prolate", "oblate") and alone and all(n == 0 for o in model.states.values() for _, _, n in o)


def _symmetric_states(top: Top, effects: tuple[QuantumEffect, ...], model: Model, jmin: int, jmax: int) -> Levels:
    """Closed forms of all states, with the spin weights of each, ordered by J, state and K."""
    weights = {state.v: state.spin_weights for effect in effects for state in effect.states(top)}
    numbers = sorted(model.states)

    def weighted(v: int) -> Top:
        return replace(top, spin_weights=weights.get(v) or top.spin_weights, symmetry_checked=False)

    by_state = [_symmetric(weighted(v), effects, model.states[v], jmin, jmax) for v in numbers]
    quanta = {"v": np.repeat(numbers, len(by_state[0]))}
    quanta |= {name: np.concatenate([levels.quanta[name] for levels in by_state]) for name in ("j", "k")}
    order = np.lexsort((quanta["k"], quanta["v"], quanta["j"]))

    def joined(name: str) -> NDArray[Any]:
        return np.concatenate([getattr(levels, name) for levels in by_state])[order]

    return replace(
        by_state[0],
        energy_mhz=joined("energy_mhz"),
        quanta={name: column[order] for name, column in quanta.items()},
        multiplicity=joined("multiplicity"),
        components=joined("components"),
        weight=joined("weight"),
    )


def _in_wang_blocks(
    top: Top,
    effects: tuple[QuantumEffect, ...],
    operators: Operators,
    jmin: int,
    jmax: int,
    vectors: bool,
    executor: Executor | None,
    limits: tuple[int, int] | None = None,
    below_mhz: float = math.inf,
) -> Levels:
    """Levels from Wang blocks, in parallel over J with an executor."""
    representation = representation_of(top)
    all_j = range(jmin, jmax + 1)
    pieces = [
        (operators, js, representation, vectors, limits, below_mhz)
        for js in ([[j] for j in all_j] if executor else [all_j])
    ]
    solved = executor.map(_solve, *zip(*pieces, strict=True)) if executor else (_solve(*piece) for piece in pieces)
    blocks = tuple(_placed(block for solutions in solved for block in solutions))

    labels = [names_of(b.basis, representation) for b in blocks]
    sizes = [len(b.energies_mhz) for b in blocks]
    j = np.repeat([b.basis.j for b in blocks], sizes)
    ka, kc = (
        np.concatenate([column[:size] for column, size in zip(columns, sizes, strict=True)])
        for columns in zip(*labels, strict=True)
    )
    quanta = {"j": j, "ka": ka, "kc": kc}
    return Levels(
        kind=top.kind,
        representation=representation,
        jmax=jmax,
        energy_mhz=np.concatenate([b.energies_mhz for b in blocks]),
        quanta=quanta,
        multiplicity=2 * j + 1,
        components=np.ones(sum(sizes), dtype=np.int64),
        weight=_weights_of_blocks(top, blocks, quanta),
        effects=effects,
        blocks=blocks if vectors else (),
    )


def _weights_of_blocks(top: Top, blocks: tuple[SolvedBlock, ...], quanta: dict[str, NDArray[np.int64]]) -> Ints:
    """Spin weights of levels in blocks; all levels of an asymmetric block have the same."""
    if top.kind == "asymmetric":
        return np.repeat(
            [top.spin_weights.asymmetric_weight(b.basis.species) for b in blocks], [len(b.energies_mhz) for b in blocks]
        )
    ones = np.ones(len(quanta["j"]), dtype=np.int64)
    bare = Levels(top.kind, None, int(quanta["j"].max()), ones.astype(float), dict(quanta), ones, ones, ones)
    return weights_of_levels(bare, top.spin_weights)


def _placed(solved: Iterator[tuple[WangBlock, Floats, Floats]]) -> Iterator[SolvedBlock]:
    """Solved blocks with the row of the first level of each."""
    start = 0
    for basis, energies, vectors in solved:
        yield single_block(basis, energies, vectors, start)
        start += len(energies)


def _solve(
    operators: Operators, js: Iterable[int], representation: str, vectors: bool = True,
    limits: tuple[int, int] | None = None, below_mhz: float = math.inf,
) -> list[tuple[WangBlock, Floats, Floats]]:  # fmt: skip
    """Solve the Wang blocks of several J: (block, energies in MHz, eigenvectors) by J in the order ee, eo, oe, oo; K within `limits`."""
    all_j = list(js)
    j_and_matrix = zip(all_j, matrices_of(operators, all_j), strict=True)
    pieces = [
        piece for j, matrix in j_and_matrix for piece in _blocks_of_j(operators, j, matrix, representation, limits)
    ]
    if below_mhz < math.inf and not vectors:
        return [(block, lowest_energies(bands, below_mhz - scalar) + scalar, _NONE) for block, scalar, bands in pieces]
    solved = diagonalise_all([bands for _, _, bands in pieces], vectors)
    return [
        (block, energies + scalar, states)
        for (block, scalar, _), (energies, states) in zip(pieces, solved, strict=True)
    ]


def _blocks_of_j(
    operators: Operators, j: int, matrix: JMatrix, representation: str, limits: tuple[int, int] | None
) -> list[tuple[WangBlock, float, list[Floats]]]:
    """The Wang blocks of one J: (block, scalar part of the energy, diagonals of the rest)."""
    scalar, out = scalar_energy(operators, j), []
    whole = wang_blocks(j, representation)
    for block in whole if limits is None else [part for b in whole if (part := limited(b, *limits))]:
        out.append((block, scalar, block_bands(matrix, block)))
    return out
