"""Operators of axial tops with spins over functions |N K⟩ times coupling patterns, K a good quantum number.

A solved block of the rotation is a single function, so the Hamiltonian of each F and K has one row for each pattern with N ≥ K,

    ⟨N' p'|H|N p⟩ = E_N,K δ + Σ_channels c(p', p) X(N', N, K).

Matrices of one size share an array (`axial_levels`). X is a closed form over arrays of N and K (`symmetric_top_elements`), by the formulas
of `operators`.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.basis.state_elements import StateTerms
from rotor.quantum.levels import SolvedBlock
from rotor.quantum.spins.contraction import Contracted, Stack, operators_of_stacks, tensors_of_stacks
from rotor.quantum.spins.operators import AxialState, Cosines, CosinesWithN, Rotor, Scalar, factors_with_n, tensor_of
from rotor.quantum.spins.rotor import Piece, acts
from rotor.quantum.spins.stack_elements import MOST_RANK, Pairs
from rotor.quantum.symmetric_top_elements import closed_coupling
from rotor.quantum.tensors import Tensors, rank_of, tensor_between


def are_axial(blocks: Sequence[SolvedBlock]) -> bool:
    """Whether the solved blocks of the rotation are functions |N K⟩."""
    return isinstance(blocks[0].parts[0].basis, AxialState)


def contracted_operators(
    stacks: Sequence[Stack], reach: int, operators: Sequence[Sequence[Piece]], representation: str
) -> list[list[Contracted]]:
    """`contraction.operators_of_stacks`, by closed forms where the functions are |N K⟩."""
    contract = operators_of_axial_stacks if are_axial(stacks[0].blocks) else operators_of_stacks
    return contract(stacks, reach, operators, representation)


def contracted_tensors(stacks: Sequence[Stack], tensors: Tensors) -> list[Contracted]:
    """`contraction.tensors_of_stacks`, by closed forms where the functions are |N K⟩."""
    return (tensors_of_axial_stacks if are_axial(stacks[0].blocks) else tensors_of_stacks)(stacks, tensors)


def operators_of_axial_stacks(
    stacks: Sequence[Stack], reach: int, operators: Sequence[Sequence[Piece]], representation: str
) -> list[list[Contracted]]:
    """`contraction.operators_of_stacks` for stacks of |N K⟩."""
    out: list[list[Contracted]] = [[] for _ in operators]
    for up in stacks:
        for low in stacks:
            for rise in range(reach + 1):
                pairs, k = _higher_first(up, low, *_pairs(up, low, rise, 0))
                for contracted, pieces in zip(out, operators, strict=True) if len(k) else ():
                    values = _values(pieces, (up.sections[0].v, low.sections[0].v), pairs, k, representation)
                    if values.any():
                        contracted.append(Contracted(up, low, pairs, values[:, None, None]))
    return out


def _pairs(up: Stack, low: Stack, rise: int, q: int) -> tuple[Pairs, Ints]:
    """Pairs of functions of two stacks with N' - N = rise and K' - K = q, and K of the second function."""
    k_up, k_low = _axial_k(up), _axial_k(low)
    width = 1 + max(int(k_up.max()), int(k_low.max())) + abs(q)
    _, a, b = np.intersect1d(up.n * width + k_up, (low.n + rise) * width + k_low + q, True, True)
    return Pairs(a, b, up.n[a][:, None], low.n[b][:, None]), k_low[b]


def _higher_first(up: Stack, low: Stack, pairs: Pairs, k: Ints) -> tuple[Pairs, Ints]:
    """The pairs whose first block number is not below the second."""
    ordered = up.numbers[pairs.up] >= low.numbers[pairs.low]
    return Pairs(*(column[ordered] for column in pairs)), k[ordered]


def _axial_k(stack: Stack) -> Ints:
    """K of the functions of a stack."""
    return np.array([part.basis.axial_k for part in stack.sections[0].parts])


def _values(pieces: Sequence[Piece], states: tuple[int, int], pairs: Pairs, k: Ints, representation: str) -> Floats:
    """Σ value ⟨N'K‖X‖N K⟩ over the pieces and, between different states, their conjugates: (pairs,)."""
    m, n = pairs.m[:, 0].astype(float), pairs.n[:, 0].astype(float)
    total = np.zeros(len(k))
    for piece in pieces:
        powers = piece.value * ((m * (m + 1)) ** piece.n2 + (n * (n + 1)) ** piece.n2) / 2 * k ** (2.0 * piece.nz2)
        if acts(piece, *states):
            total += powers * _elements(piece.rotor, n, pairs.rise, k, representation)
        if piece.bra != piece.ket and acts(piece, *states[::-1]):
            total += (-1.0) ** pairs.rise * powers * _elements(piece.rotor, m, -pairs.rise, k, representation)
    return total


def tensors_of_axial_stacks(stacks: Sequence[Stack], tensors: Tensors) -> list[Contracted]:
    """`contraction.tensors_of_stacks` for stacks of |N K⟩, times √(number of components), so that squares count both signs of K.

    A component across the axis enters with its absolute value.
    """
    rank = rank_of(tensors)
    if rank > MOST_RANK:
        raise ValueError(f"a tensor of rank {rank}: expected at most {MOST_RANK} with spins")
    out = []
    for up, low in product(stacks, stacks):
        tensor = tensor_between(tensors, up.sections[0].v, low.sections[0].v)
        for rise, q in product(range(-rank, rank + 1), range(-rank, rank + 1)) if tensor else ():
            if not (part := tensor.components[rank + q]):  # type: ignore[union-attr]
                continue
            pairs, k = _pairs(up, low, rise, q)
            closes = np.flatnonzero((pairs.m + pairs.n)[:, 0] >= rank)
            if len(closes):
                pairs, k = Pairs(*(column[closes] for column in pairs)), k[closes]
                values = closed_coupling(pairs.n[:, 0].astype(float), rise, rank, q, k.astype(float))
                values = (abs(part) if q else part.real) * values * np.where((k > 0) | (k + q > 0), np.sqrt(2.0), 1.0)
                out.append(Contracted(up, low, pairs, values[:, None, None]))
    return out


def powers_of_axial(terms: StateTerms, count: int, blocks: Sequence[SolvedBlock]) -> Floats:
    """Diagonal elements [N(N+1)]^p K^2q by function and parameter, (blocks, count); operators that change K do not contribute."""
    parts = [block.parts[0] for block in blocks]
    v, n, k = np.array([(part.v, part.basis.j, part.basis.axial_k) for part in parts]).T
    x, out = n * (n + 1.0), np.zeros((len(parts), count))
    for state, (p, q, order), column, factor in terms.by_power():
        if not order:
            out[:, column] += np.where(v == state, factor * x**p * k ** (2.0 * q), 0.0)
    return out


def _elements(rotor: Rotor, n: Floats, rise: int, k: Ints, representation: str) -> Floats:
    """⟨N + rise K‖X‖N K⟩ of an axial operator, (n,)."""
    if isinstance(rotor, Scalar):
        x = n * (n + 1)
        along = [factor * x**p * k ** (2.0 * q) for (p, q, _), factor in rotor.operators]
        return np.sum(along, axis=0) if not rise else np.zeros(len(n))
    assert isinstance(rotor, Cosines | CosinesWithN)
    tensor = tensor_of(rotor.components, 2, representation)
    along_axis = tensor.components[2].real if tensor else 0.0
    closes = 2 * n + rise >= 2
    elements = np.zeros(len(n))
    if along_axis and abs(rise) <= 2:
        elements[closes] = along_axis * closed_coupling(n[closes], rise, 2, 0, k[closes].astype(float))
    if isinstance(rotor, Cosines):
        return elements
    stretch, _, length = factors_with_n(n + rise, n)
    trace = float(np.trace(np.array(rotor.components))) / 3
    if abs(rise) > 1:
        return np.zeros(len(n))
    return np.asarray(stretch * elements + (0 if rise else trace * length))
