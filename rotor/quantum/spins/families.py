"""Families of solved rotational blocks that operators with spins connect.

With two equivalent spins each block has two classes of functions: symmetric (0) and antisymmetric (1) under their exchange. An operator
that changes sign with the exchange connects the two classes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from rotor.quantum.connected import connected_parts
from rotor.quantum.spins.contraction import Contracted, acting_numbers
from rotor.quantum.spins.rotor import Channel

Link = tuple[int, int, int]
"""Two blocks that an operator connects, and 1 if the operator changes sign with the exchange, else 0."""


def links_of_stacks(contracted: Iterable[tuple[Sequence[Contracted], Sequence[Channel]]]) -> Iterator[Link]:
    """Links of operators in stacks, each with the channels that share it."""
    for matrices, channels in contracted:
        kinds = {int(channel.exchange < 0) for channel in channels}
        for i, k in acting_numbers(matrices):
            for changed in kinds:
                yield i, k, changed


def families_of(count: int, links: Iterable[Link], classes: int) -> list[list[tuple[int, int]]]:
    """Members (block, class) that links connect, each once, by the lowest one of each; `classes`: number of equivalent spins, or 1."""
    pairs = (
        (i * classes + symmetry_class, k * classes + (symmetry_class ^ changed))
        for i, k, changed in links
        for symmetry_class in range(classes)
    )
    edges = (pair for pair in pairs if pair[0] != pair[1])
    return [[divmod(member, classes) for member in part] for part in connected_parts(count * classes, edges)]
