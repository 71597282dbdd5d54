"""Families of solved rotational blocks that operators with spins connect.

With two equivalent spins each block has two classes of functions: symmetric (0) and antisymmetric (1) under their exchange. An operator
that changes sign with the exchange connects the two classes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from rotor.arrays import Ints
from rotor.quantum.connected import part_numbers
from rotor.quantum.spins.contraction import Contracted, acting_numbers
from rotor.quantum.spins.rotor import Channel


def links_of_stacks(contracted: Iterable[tuple[Sequence[Contracted], Sequence[Channel]]]) -> Ints:
    """Links (links, 3) of operators in stacks, each with the channels that share it.

    A link is two blocks that an operator connects, and 1 if the operator changes sign with the exchange, else 0.
    """
    links = [np.zeros((0, 3), dtype=np.int64)]
    for matrices, channels in contracted:
        pairs = acting_numbers(matrices)
        for changed in {int(channel.exchange < 0) for channel in channels}:
            links.append(np.column_stack([pairs, np.full(len(pairs), changed)]))
    return np.concatenate(links)


def families_of(count: int, links: Ints, classes: int) -> list[list[tuple[int, int]]]:
    """Members (block, class) that links connect, each once, by the lowest one of each; `classes`: number of equivalent spins, or 1."""
    first, second, changed = links.T
    each = np.arange(classes)[:, None]
    numbers = part_numbers(
        count * classes, (first * classes + each).ravel(), (second * classes + (each ^ changed)).ravel()
    )
    families: list[list[tuple[int, int]]] = [[] for _ in range(int(numbers.max(initial=-1)) + 1)]
    for member, number in enumerate(numbers.tolist()):
        families[number].append(divmod(member, classes))
    return families
