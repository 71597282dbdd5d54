"""Raman strengths of all transitions between solved levels, from the anisotropy of the polarizability.

S(i, f) = (3/2) Σ_{M' M p} |⟨f M'|α_2p(space)|i M⟩|²,     Σ_f S(i, f) = (2J+1) γ²,     γ² = (3 Σ α_gh² - (Σ α_gg)²)/2,

including the elastic term f = i, so that S = (2J+1) b γ² with the coefficients b of G. Placzek and E. Teller, Z. Phys. 81,
209 (1933). The sums over M', M and p give squares of the reduced elements in `quantum.operators.tensors`.

The polarizability does not act on spins. Each spin of the chain N + I₁ = F₁, F₁ + I₂ = F₂, ... therefore multiplies the
element by

    ⟨F₁' (N' I)‖T²‖F₁ (N I)⟩ = (-1)^(N'+I+F₁+2) √((2F₁'+1)(2F₁+1)) {N' F₁' I; F₁ N 2} ⟨N'‖T²‖N⟩

(A. R. Edmonds, Angular Momentum in Quantum Mechanics, 1957, eq. 7.1.7; `spins.coupling.ChainOperator`). The sum over all F of two
rotational levels is Π(2I+1) times the strength without spins, since Σ (2F'+1)(2F+1) {N' F' I; F N 2}² = 2I+1. Components that nuclear
spins form within one rotational level belong to the Rayleigh line and are not listed; components from electron spins are listed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.blocks import reduced
from rotor.quantum.blocks.reduced import connected_wang_blocks, wang_amplitudes
from rotor.quantum.levels import Levels, SolvedBlock, single_block
from rotor.quantum.operators.symmetric_top_elements import coupling
from rotor.quantum.operators.tensors import body_tensor
from rotor.quantum.wang.basis import wang_blocks
from rotor.tops.constants.operators import AXIAL_REPRESENTATION, axis_order
from rotor.tops.spins.spin_weights import SpinWeights

NO_WEIGHTS = SpinWeights()
ROUND_OFF = 1e-6  # relative deviation from an axial or isotropic tensor that counts as rounding


@dataclass(frozen=True)
class RamanTransitions:
    """Columns (n,): S in Å⁶ over all components, and the rows of both states in the levels, the lower in energy first.

    weight: spin weight of one component; the mean, weighted by strength, if components of different weight form the line.
    """

    strength_angstrom6: Floats
    lower: Ints
    upper: Ints
    weight: Floats


def anisotropy_squared(polarizability: ArrayLike) -> float:
    """γ² of a polarizability (3, 3), in the square of its unit: (α∥ - α⊥)² for an axial tensor.

    >>> anisotropy_squared([[3.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]])
    4.0
    """
    tensor = np.asarray(polarizability, dtype=float)
    spread = tensor - np.eye(3) * np.trace(tensor) / 3
    return float(1.5 * np.sum(spread * spread))


def raman_transitions(
    levels: Levels, polarizability_abc: ArrayLike, spin_weights: SpinWeights = NO_WEIGHTS
) -> RamanTransitions:
    """All pairs of different levels that a polarizability (3, 3) along a, b, c in Å³ connects, unordered.

    Selection rules: ΔJ = 2 for a linear molecule; ΔJ = 1, 2 and ΔK = 0 for a symmetric top with an axial tensor; ΔJ = 0,
    1, 2 for an asymmetric top, between species of (Ka, Kc) parity that elements of the tensor connect (equal species for
    diagonal elements); none for a spherical top. Levels must start at J = 0. spin_weights: of the levels. With spins,
    the rules hold for N and likewise for each coupled angular momentum.
    Raises ValueError for a spherical top with an anisotropic tensor, and for a non-axial tensor with spin weights by K.
    """
    tensor = np.asarray(polarizability_abc, dtype=float)
    if levels.kind == "spherical":
        if anisotropy_squared(tensor) > (ROUND_OFF * np.linalg.norm(tensor)) ** 2:
            raise ValueError(
                "a spherical top has an isotropic polarizability, but this tensor is anisotropic; check it"
            )
        return _joined([])
    if levels.representation is not None:
        if levels.blocks and levels.blocks[0].axial_k is not None:
            _refuse_without_axis(levels, tensor)
        return _inelastic(levels, _joined(list(_block_transitions(levels, tensor))))
    if levels.kind == "linear":
        return _linear(levels, tensor)
    return _symmetric(levels, tensor, spin_weights)


def _refuse_without_axis(levels: Levels, tensor: Floats) -> None:
    """Raise ValueError if a tensor connects different K, where elements of both signs of K would add up."""
    z = "abc".index(axis_order(str(levels.representation))[2])
    along = 1.5 * (tensor[z, z] - np.trace(tensor) / 3)
    if abs(anisotropy_squared(tensor) - along**2) > (ROUND_OFF * np.linalg.norm(tensor)) ** 2:
        raise ValueError(
            f"a {levels.kind} top with spins: expected a polarizability with the axis of the top, {'abc'[z]}; check the tensor"
        )


def _joined(pieces: list[RamanTransitions]) -> RamanTransitions:
    if not pieces:
        return RamanTransitions(np.zeros(0), np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))
    return RamanTransitions(
        np.concatenate([piece.strength_angstrom6 for piece in pieces]),
        np.concatenate([piece.lower for piece in pieces]),
        np.concatenate([piece.upper for piece in pieces]),
        np.concatenate([piece.weight for piece in pieces]),
    )


def _ordered(levels: Levels, strength: Floats, first: Ints, second: Ints, weight: Floats) -> RamanTransitions:
    """Transitions of nonzero strength between existing levels, the lower in energy first."""
    exists = (strength > 0) & (weight > 0)
    strength, first, second = strength[exists], first[exists], second[exists]
    falls = levels.energy_mhz[second] < levels.energy_mhz[first]  # the upper state is the one of higher energy
    return RamanTransitions(strength, np.where(falls, second, first), np.where(falls, first, second), weight[exists])


def _joint_weights(levels: Levels, first: Ints, second: Ints) -> Floats:
    """Spin weight of one component, where both states have the same weight; 0 if one of them does not exist."""
    weight = levels.weight_per_component
    return np.asarray(np.where(weight[second] > 0, weight[first], 0.0))  # a level of weight 0 has no lines


# Linear and symmetric tops


def _linear(levels: Levels, tensor: Floats) -> RamanTransitions:
    """S = (3/2) (J+1)(J+2)/(2J+3) Δα² from J to J + 2."""
    anisotropy = tensor[0, 0] - (tensor[1, 1] + tensor[2, 2]) / 2
    all_j = levels.quanta["j"]
    first = np.flatnonzero(all_j + 2 <= levels.jmax)
    j, second = all_j[first], levels.rows_of(j=all_j[first] + 2)
    strength = 1.5 * (j + 1) * (j + 2) / (2 * j + 3) * anisotropy**2
    return _ordered(levels, strength, first, second, _joint_weights(levels, first, second))


def _symmetric(levels: Levels, tensor: Floats, spin_weights: SpinWeights) -> RamanTransitions:
    """Transitions with ΔK = 0 if the tensor has the axis of the top; otherwise (numerically symmetric tops) in Wang's basis."""
    representation = AXIAL_REPRESENTATION[levels.kind]
    x, y, z = ("abc".index(axis) for axis in axis_order(representation))
    along = (2 * tensor[z, z] - tensor[x, x] - tensor[y, y]) / np.sqrt(6)
    if anisotropy_squared(tensor) - 1.5 * along**2 > (ROUND_OFF * np.linalg.norm(tensor)) ** 2:
        if "v" in levels.quanta:
            raise ValueError(
                "several states of a symmetric top: expected a polarizability with its axis; check the tensor"
            )
        if spin_weights.rule == "K":
            raise ValueError("spin weights by K need an axis, but the polarizability has none; check the tensor")
        return _without_axis(levels, tensor, spin_weights, representation)
    pieces = [_axial_transitions(levels, delta_j, float(along)) for delta_j in (1, 2)]
    return _joined([piece for piece in pieces if len(piece.lower)])


def _axial_transitions(levels: Levels, delta_j: int, along: float) -> RamanTransitions:
    """K → K, J → J + ΔJ, for both signs of K together; J → J with ΔK = 0 is Rayleigh scattering."""
    all_j, all_k = levels.quanta["j"], levels.quanta["k"]
    lower = all_j + delta_j <= levels.jmax
    j, k = all_j[lower], all_k[lower]
    if not len(j):
        return _joined([])
    factor = np.empty(len(j))
    for value in np.unique(j).tolist():
        factor[j == value] = coupling(value, value + delta_j, 2, 0, k[j == value])
    # the polarizability connects no two vibrational states
    state = {"v": levels.quanta["v"][lower]} if "v" in levels.quanta else {}
    first, second = np.flatnonzero(lower), levels.rows_of(j=j + delta_j, k=k, **state)
    strength = 1.5 * (along * factor) ** 2 * np.where(k == 0, 1, 2)  # ±K counts twice, K = 0 once
    return _ordered(levels, strength, first, second, _joint_weights(levels, first, second))


def _without_axis(levels: Levels, tensor: Floats, spin_weights: SpinWeights, representation: str) -> RamanTransitions:
    """Transitions between Wang functions; they are eigenstates if both members of a K pair have one weight. One line for a pair of rows.

    The two functions of a K = 1 pair have different strengths: α_20 and α_2±2 add in one of them and not in the other.
    """
    anisotropic = body_tensor(tensor, 2, representation)
    blocks = [
        single_block(basis, np.zeros(basis.size), np.eye(basis.size), 0)
        for j in range(levels.jmax + 1)
        for basis in wang_blocks(j, representation)
    ]
    pieces = []
    for up, low in connected_wang_blocks(blocks, anisotropic):
        strength = 1.5 * wang_amplitudes(up, low, anisotropic) ** 2
        i, k = np.nonzero(_distinct_pairs(up, low))
        first = levels.rows_of(j=np.full(len(k), low.basis.j), k=low.basis.k[k])
        second = levels.rows_of(j=np.full(len(i), up.basis.j), k=up.basis.k[i])
        inelastic = first != second
        weight = np.full(int(inelastic.sum()), float(spin_weights.asymmetric_weight(low.basis.species)))
        pieces.append(_ordered(levels, strength[i, k][inelastic], first[inelastic], second[inelastic], weight))
    return _summed(levels, _joined(pieces))


def _summed(levels: Levels, transitions: RamanTransitions) -> RamanTransitions:
    """Merge transitions of the same pair of rows; the weight is the mean weighted by strength."""
    keys, place = np.unique(transitions.lower * len(levels) + transitions.upper, return_inverse=True)
    strength, weighted = np.zeros(len(keys)), np.zeros(len(keys))
    np.add.at(strength, place, transitions.strength_angstrom6)
    np.add.at(weighted, place, transitions.strength_angstrom6 * transitions.weight)
    return RamanTransitions(strength, keys // len(levels), keys % len(levels), weighted / strength)


# Asymmetric tops


def _block_transitions(levels: Levels, tensor: Floats) -> Iterator[RamanTransitions]:
    """Transitions between solved blocks; all vibrational states have the same polarizability, which connects no two of them."""
    anisotropic = body_tensor(tensor, 2, str(levels.representation))
    tensors = {(v, v): anisotropic for v in np.unique(levels.quanta.get("v", np.zeros(1, dtype=np.int64))).tolist()}
    existing = [
        block
        for block in levels.blocks
        if (levels.weight[block.start : block.start + len(block.energies_mhz)] > 0).any()
    ]
    pairs, amplitudes = reduced.connections(existing, tensors)
    for up, low in pairs:
        yield _between(levels, up, low, 1.5 * amplitudes(up, low) ** 2)


def _inelastic(levels: Levels, transitions: RamanTransitions) -> RamanTransitions:
    """The lines without transitions between hyperfine components of one level."""
    if "f" not in levels.quanta:
        return transitions
    spins = [name for name in levels.quanta if name in ("i_sym", "i_tot") or name.startswith("f")]
    numbers = np.column_stack([levels.quanta[name] for name in levels.quanta if name not in spins])
    _, level = np.unique(numbers, axis=0, return_inverse=True)
    inelastic = level[transitions.lower] != level[transitions.upper]
    return RamanTransitions(
        transitions.strength_angstrom6[inelastic],
        transitions.lower[inelastic],
        transitions.upper[inelastic],
        transitions.weight[inelastic],
    )


def _distinct_pairs(up: SolvedBlock, low: SolvedBlock) -> NDArray[np.bool_]:
    """Mask of distinct pairs of states of two blocks: all, or the strict lower triangle for a block with itself."""
    all_pairs = np.ones((len(up.energies_mhz), len(low.energies_mhz)), dtype=bool)
    return np.tril(all_pairs, -1) if up is low else all_pairs


def _between(levels: Levels, up: SolvedBlock, low: SolvedBlock, strength: Floats) -> RamanTransitions:
    """All transitions between the states of two blocks, except of a state with itself."""
    i, k = np.nonzero(_distinct_pairs(up, low))
    first, second = k + low.start, i + up.start
    return _ordered(levels, strength[i, k], first, second, _joint_weights(levels, first, second))
