"""Which solved blocks of the rotation belong together, since operators with spins connect them.

Two equivalent spins make two classes of each block: of functions that keep (0) and that change (1) their sign with the exchange of
both. An operator that changes sign with the exchange joins one class to the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from rotor.quantum.connected import connected_parts
from rotor.quantum.spins.contraction import Contracted, acting_numbers
from rotor.quantum.spins.rotor import Channel

Link = tuple[int, int, int]
"""Two blocks that an operator connects, and 1 where that changes sign with the exchange."""


def links_of_stacks(contracted: Iterable[tuple[Sequence[Contracted], Sequence[Channel]]]) -> Iterator[Link]:
    """The links of the same operators in stacks, each with the channels that share it."""
    for found, channels in contracted:
        kinds = {int(channel.exchange < 0) for channel in channels}
        for i, k in acting_numbers(found):
            for changed in kinds:
                yield i, k, changed


def families_of(count: int, links: Iterable[Link], classes: int) -> list[list[tuple[int, int]]]:
    """Members (block, class) that links connect, each family in rising order.

    Parameters
    ----------
    count : int
        Number of blocks.
    links : iterable of Link
        What connects them.
    classes : int
        1, or 2 with two equivalent spins, or 3.

    Returns
    -------
    list of list of (int, int)
        Every block and class once, by the lowest member of each family.
    """
    pairs = ((i * classes + own, k * classes + (own ^ changed)) for i, k, changed in links for own in range(classes))
    edges = (pair for pair in pairs if pair[0] != pair[1])
    return [[divmod(member, classes) for member in part] for part in connected_parts(count * classes, edges)]
