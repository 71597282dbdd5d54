"""Derivatives of levels with spins whose rotation is that of species of internal rotation.

States r of a species take the place of functions: for a constant of a spin,

    ∂E/∂c = Σ c(p', p) v*_r'p' ⟨r'‖X_c‖r⟩ v_rp,

of many blocks at once (`many_f`); for a coefficient of the torsion-rotation the species derives mixtures Σ_r v_rp |r⟩ of its states, and
sums over p.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.levels import Levels, Mixtures, SolvedBlock
from rotor.quantum.spins.blocks import Shared
from rotor.quantum.spins.contraction import operators_of_stacks
from rotor.quantum.spins.many_f import Coefficients, Frame, Group, Tables, between, coefficients_by_f, tables_of
from rotor.quantum.spins.many_f_lines import groups_of_blocks
from rotor.quantum.spins.pattern_tables import couplings_by_f
from rotor.quantum.spins.rotor import Channels, parameter_channels

if TYPE_CHECKING:
    from rotor.tops.top import Top


def species_derivatives(top: Top, levels: Levels, names: Sequence[str]) -> Floats:
    """∂E/∂c (levels, names) of levels by constants of the spins and of the torsion-rotation."""
    scheme = levels.blocks[0].spins.shared.scheme
    slopes = slopes_by_spins(levels.blocks, parameter_channels(top, levels.effects, names, scheme))
    for block in levels.blocks:
        of_rotation = partial(block.spins.rotor.moments.slopes, names=names)
        slopes[block.start : block.start + len(block.energies_mhz)] += slopes_by_rotation(block, of_rotation)
    return slopes


def slopes_by_rotation(block: SolvedBlock, mixture_slopes: Callable[[Mixtures], Floats]) -> Floats:
    """Derivatives (n, coefficients) by coefficients of the torsion-rotation: those of mixtures of the states of each N."""
    n, by_patterns = len(block.energies_mhz), dict[int, list[tuple[SolvedBlock, NDArray[Any]]]]()
    for part in block.spins.parts:
        mixture = block.vectors[part.place].reshape(part.repeats, -1, n).swapaxes(0, 1)
        by_patterns.setdefault(part.patterns.start, []).append((part.rotor, mixture))
    return np.asarray(sum(mixture_slopes(mixtures) for mixtures in by_patterns.values()))


def slopes_by_spins(blocks: Sequence[SolvedBlock], by_parameter: Sequence[Channels]) -> Floats:
    """Derivatives (states, parameters) of the states of blocks by parameters, from their spin terms."""
    shared: Shared = blocks[0].spins.shared
    frame = shared.frame
    operators = [list(_operators(shared, channels)) for channels in by_parameter]
    number = blocks[-1].start + len(blocks[-1].energies_mhz)
    out = np.zeros((number + 1, len(by_parameter)))  # the last row takes the padding
    for states in groups_of_blocks(blocks, number):
        for at, vectors, rows in states.runs():
            for parameter, terms in enumerate(operators):
                out[rows, parameter] = sum(_expectations(states.group, at, vectors, *term, frame) for term in terms)
    return out[:-1]


def _operators(shared: Shared, channels: Channels) -> Iterator[tuple[Tables, Coefficients]]:
    """Elements of the rotation and coefficients of each channel."""
    frame = shared.frame
    for channel, pieces in channels.items():
        (contracted,) = operators_of_stacks(shared.stacks, channel.rank, [pieces], shared.representation)
        couplings = couplings_by_f(shared.scheme, channel, frame.twice_f[0], frame.twice_f[-1])
        yield tables_of(contracted, frame), coefficients_by_f(couplings, frame)


def _expectations(
    group: Group, at: Ints, vectors: NDArray[Any], tables: Tables, coefficients: Coefficients, frame: Frame
) -> Floats:
    """⟨i|Σ c X|i⟩ (blocks, n) of vectors (blocks, columns, states, n); columns of different N or kind have elements in one order."""
    (count, _, height, n), total = vectors.shape, np.zeros((len(vectors), vectors.shape[3]))
    for left, right, elements, coupling in between(group, group, at, 0, tables, coefficients, frame, (height, height)):
        _, rows, columns = elements.shape
        moved = np.matmul(elements[:, None], vectors[:, right.columns, :columns]).reshape(count, -1, rows * n)
        moved = np.matmul(coupling, moved).reshape(count, -1, rows, n)
        each = np.einsum("bpsn,bpsn->bn", vectors[:, left.columns, :rows].conj(), moved).real
        total += each if left is right else 2 * each
    return total
