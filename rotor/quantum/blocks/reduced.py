"""Reduced matrix elements of molecule-fixed tensors between solved blocks of every kind, and which blocks they connect.

For several states a tensor is given for each pair (v′, v); that of (v, v′) is the same. Elements are those of `tensors`: real,
of odd rank i times real, their squares summed over all M the line strengths.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.levels import Connections, SolvedBlock
from rotor.quantum.operators.tensors import BodyTensor, Tensors, acting_on, add_acting_on, rank_of, tensor_between


def connections(blocks: Sequence[SolvedBlock], tensors: Tensors) -> Connections:
    """Every pair (up, low) of blocks that the tensors connect, and the function that returns their reduced elements (n_up, n_low).

    Each pair occurs once, the higher or equal J (or F) first, J rising; a block with itself where it has elements between its states.
    The function can be sent to another process.
    """
    if not blocks:
        return [], no_elements
    if blocks[0].alone:
        tensor = tensors[0, 0]
        return list(connected_wang_blocks(blocks, tensor)), partial(wang_amplitudes, tensor=tensor)
    if blocks[0].spins is not None:
        from rotor.quantum.spins.many_f_lines import connections_of, tensor_moments

        return connections_of(blocks, tensor_moments(blocks[0].spins.shared, tensors))
    pairs = list(pairs_where(blocks, rank_of(tensors), lambda up, low: _connects(up, low, tensors)))
    return pairs, partial(_coupled_amplitudes if blocks[0].moments is None else _by_moments, tensors=tensors)


def no_elements(up: SolvedBlock, low: SolvedBlock) -> Floats:
    """Elements of an operator that connects no blocks."""
    return np.zeros((len(up.energies_mhz), len(low.energies_mhz)))


def _by_moments(up: SolvedBlock, low: SolvedBlock, tensors: Tensors) -> Floats:
    assert up.moments is not None
    return np.asarray(np.sqrt(up.components) * np.abs(up.moments.reduced(up, low, tensors)))


def _coupled_amplitudes(up: SolvedBlock, low: SolvedBlock, tensors: Tensors) -> Floats:
    moved = np.zeros((len(up.energies_mhz), len(low.energies_mhz)))
    for target in up.parts:
        for source in low.parts:
            tensor = tensor_between(tensors, target.v, source.v)
            if tensor is not None:
                moved[target.place] += acting_on(low.vectors[source.place], target.basis, source.basis, tensor)
    return np.asarray(up.vectors.T @ moved)


def pairs_where(
    blocks: Iterable[SolvedBlock], rank: int, connects: Callable[[SolvedBlock, SolvedBlock], bool]
) -> Iterator[tuple[SolvedBlock, SolvedBlock]]:
    """The pairs (up, low) that a test connects, of those whose total angular momenta differ by `rank` at most."""
    by_total: dict[int, list[SolvedBlock]] = {}
    for block in blocks:
        by_total.setdefault(block.twice_total, []).append(block)
    for twice, lows in sorted(by_total.items()):
        above = [block for rise in range(1, rank + 1) for block in by_total.get(twice + 2 * rise, [])]
        for i, low in enumerate(lows):
            for up in lows[i:] + above:
                if connects(up, low):
                    yield up, low


def _connects(up: SolvedBlock, low: SolvedBlock, tensors: Tensors) -> bool:
    if up.moments is not None:
        return low.moments is up.moments and up.moments.connect(up, low, tensors)
    tensors_of_parts = ((tensor_between(tensors, p.v, q.v), p, q) for p in up.parts for q in low.parts)
    return any(tensor is not None and tensor.connects(p.basis, q.basis) for tensor, p, q in tensors_of_parts)


def wang_amplitudes(up: SolvedBlock, low: SolvedBlock, tensor: BodyTensor) -> Floats:
    """Real reduced elements between all states of two blocks, (n_up, n_low); their squares are the line strengths.

    An odd rank stands for i times them, in the phases of |J K s)).
    """
    return wang_columns(up, [low], tensor)


def wang_columns(up: SolvedBlock, lows: Sequence[SolvedBlock], tensor: BodyTensor) -> Floats:
    """`wang_amplitudes` of one block with several, side by side, from a single product of matrices: (n_up, sum of n_low)."""
    stops = np.cumsum([low.vectors.shape[1] for low in lows]).tolist()
    moved = np.zeros((stops[-1], up.basis.size))
    for low, stop in zip(lows, stops, strict=True):
        add_acting_on(moved[stop - low.vectors.shape[1] : stop], low.vectors, up.basis, low.basis, tensor)
    return np.asarray(up.vectors.T @ moved.T)


def connected_wang_blocks(
    blocks: Iterable[SolvedBlock], tensor: BodyTensor
) -> Iterator[tuple[SolvedBlock, SolvedBlock]]:
    """Every pair (up, low) that a tensor connects, each once, the higher or equal J first, J rising.

    A block with itself is among them where a tensor has diagonal elements, as those of even rank do.
    """
    return pairs_where(blocks, tensor.rank, lambda up, low: tensor.connects(up.basis, low.basis))
