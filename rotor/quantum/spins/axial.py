"""Axial tops with spins, whole arrays at a time: functions |N K⟩ times coupling patterns, K good.

A solved block of the rotation is one function, so that the Hamiltonian of every F and K has as many rows as patterns with N ≥ K,

    ⟨N' p'|H|N p⟩ = E_N,K δ + Σ_channels c(p', p) X(N', N, K),

and those of one size stand in one array (`axial_levels`). X is a closed form over arrays of N and K (`symmetric_top_elements`), by the
formulas of `operators`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.basis.state_elements import StateTerms
from rotor.quantum.spins.contraction import Contracted, Stack
from rotor.quantum.spins.operators import AxialState, Cosines, CosinesWithN, Rotor, Scalar, factors_with_n, tensor_of
from rotor.quantum.spins.rotor import Piece, RotorBlock, acts
from rotor.quantum.spins.stack_elements import Pairs, Section
from rotor.quantum.symmetric_top_elements import closed_coupling

Exist = Callable[[Ints], NDArray[np.bool_]]  # which of the levels with these labels there are


def are_axial(blocks: Sequence[RotorBlock]) -> bool:
    """Whether solved blocks of the rotation are functions |N K⟩."""
    return isinstance(blocks[0].parts[0].basis, AxialState)


def existing_functions(blocks: Sequence[RotorBlock], exist: Exist, spins: int) -> list[RotorBlock]:
    """The functions |N K⟩ whose v and K exist, all of them if none does."""
    names = [(block.parts[0].v, block.parts[0].basis.k[0], 0, *[0] * (1 + spins)) for block in blocks]
    there = exist(np.array(names, dtype=np.int64)).tolist()
    return [block for block, exists in zip(blocks, there, strict=True) if exists] or list(blocks)


def axial_stacks(blocks: Sequence[RotorBlock]) -> list[Stack]:
    """All blocks of one state v as a stack."""
    by_v: dict[int, list[int]] = {}
    for number, block in enumerate(blocks):
        by_v.setdefault(block.parts[0].v, []).append(number)
    return [_stack(blocks, kind, numbers) for kind, numbers in enumerate(by_v.values())]


def _stack(blocks: Sequence[RotorBlock], kind: int, numbers: list[int]) -> Stack:
    own = [blocks[number] for number in numbers]
    count = len(own)
    first = own[0].parts[0]
    section = Section(first.v, first.basis, slice(0, 1), tuple(block.parts[0] for block in own))  # type: ignore[arg-type]
    return Stack(
        kind, np.array(numbers), np.array([block.n for block in own]), (section,), np.ones((count, 1, 1)), [1] * count, own,
        [True] * count,
    )  # fmt: skip


def operators_of_axial_stacks(
    stacks: Sequence[Stack], reach: int, operators: Sequence[Sequence[Piece]], representation: str
) -> list[list[Contracted]]:
    """`contraction.operators_of_stacks` for stacks of |N K⟩."""
    out: list[list[Contracted]] = [[] for _ in operators]
    for up in stacks:
        for low in stacks:
            for rise in range(reach + 1):
                pairs, k = _pairs_of_one_k(up, low, rise)
                for found, pieces in zip(out, operators, strict=True) if len(k) else ():
                    values = _values(pieces, (up.sections[0].v, low.sections[0].v), pairs, k, representation)
                    if values.any():
                        found.append(Contracted(up, low, pairs, values[:, None, None]))
    return out


def _pairs_of_one_k(up: Stack, low: Stack, rise: int) -> tuple[Pairs, Ints]:
    """Functions of two stacks of one K whose N differ by `rise`, the one of the higher number first, and their K."""
    of_up, of_low = _axial_k(up), _axial_k(low)
    width = 1 + max(int(of_up.max()), int(of_low.max()))
    _, a, b = np.intersect1d(up.n * width + of_up, (low.n + rise) * width + of_low, True, True)
    ordered = up.numbers[a] >= low.numbers[b]
    a, b = a[ordered], b[ordered]
    return Pairs(a, b, up.n[a][:, None], low.n[b][:, None]), of_low[b]


def _axial_k(stack: Stack) -> Ints:
    return np.array([part.basis.axial_k for part in stack.sections[0].every])  # type: ignore[union-attr]


def _values(pieces: Sequence[Piece], states: tuple[int, int], pairs: Pairs, k: Ints, representation: str) -> Floats:
    """Σ value ⟨N'K‖X‖N K⟩ of the pieces and, between different states, of their conjugates, (pairs,)."""
    m, n = pairs.m[:, 0].astype(float), pairs.n[:, 0].astype(float)
    total = np.zeros(len(k))
    for piece in pieces:
        powers = piece.value * ((m * (m + 1)) ** piece.n2 + (n * (n + 1)) ** piece.n2) / 2 * k ** (2.0 * piece.nz2)
        if acts(piece, *states):
            total += powers * _elements(piece.rotor, n, pairs.rise, k, representation)
        if piece.bra != piece.ket and acts(piece, *states[::-1]):
            total += (-1.0) ** pairs.rise * powers * _elements(piece.rotor, m, -pairs.rise, k, representation)
    return total


def powers_of_axial(terms: StateTerms, count: int, blocks: Sequence[RotorBlock]) -> Floats:
    """N^2p Nz^2q, (N (N + 1))^p K^2q, of every function and of so many parameters, (blocks, count); what changes K does not act."""
    parts = [block.parts[0] for block in blocks]
    v, n, k = (np.array(column) for column in zip(*((p.v, p.basis.j, p.basis.k[0]) for p in parts), strict=True))
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
