"""Blocks of an asymmetric top in a field along Z: Wang blocks of all J that the field connects, for one M.

The matrix between two solved Wang blocks is the reduced elements of `rotor.quantum.tensors` times (-1)^(J'-M) (J' K J; -M 0 M).
Elements of vectors are i times real ones there. Multiplying the states of a Wang block by 1 or i makes them all real where one
or two components of the dipole act, or M = 0: the blocks are coloured so that vectors lead to the other colour and tensors to
the same one. Three components with M > 0 admit no such colouring, and the matrix stays complex.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.blocks import Contraction, FieldBlock, FieldSpace, FreeLevels
from rotor.quantum.reduced import wang_amplitudes
from rotor.quantum.symmetric_top_elements import coupling
from rotor.quantum.tensors import BodyTensor, body_tensor

if TYPE_CHECKING:
    from rotor.quantum.levels import SolvedBlock
    from rotor.tops.top import Top


@dataclass(frozen=True)
class WangBlockInField(FieldBlock):
    """States |J τ M⟩ of the Wang blocks `members` (indices into the space's), with the colour 0 or 1 of each.

    `real` is False where no colouring makes all matrices real.
    """

    m: int
    species: str
    copies: int
    members: tuple[int, ...]
    colours: tuple[int, ...]
    real: bool
    rows: Ints = field(repr=False)
    space: WangSpace = field(repr=False)

    @property
    def label(self) -> str:
        """Which block it is."""
        return self.species

    @property
    def levels(self) -> FreeLevels:
        """The levels of the space."""
        return self.space.levels

    def matrix(self, contraction: Contraction) -> NDArray[Any]:
        """The contraction over the states (n, n), real symmetric or complex Hermitian."""
        blocks = [self.space.solved[i] for i in self.members]
        edges = np.cumsum([0, *(block.basis.size for block in blocks)])
        out = np.zeros((edges[-1], edges[-1]), dtype=np.complex128)
        out[np.diag_indices(edges[-1])] = contraction.scalar
        for up, low, elements in self.space.elements(contraction, self.members, self.m):
            phase = 1j ** (self.colours[low] - self.colours[up] + contraction.rank % 2)
            rows, columns = slice(edges[up], edges[up + 1]), slice(edges[low], edges[low + 1])
            out[rows, columns] += phase * elements
            if up != low:
                out[columns, rows] += np.conj(phase) * elements.T
        return np.ascontiguousarray(out.real) if not out.imag.any() else out


@dataclass(frozen=True)
class WangSpace(FieldSpace):
    """Solved Wang blocks up to J max and everything that will act on them."""

    levels: FreeLevels = field(repr=False)
    jmax: int
    representation: str
    solved: tuple[SolvedBlock, ...] = field(repr=False)
    contractions: tuple[Contraction, ...]

    def blocks(self, m: int) -> list[FieldBlock]:
        """Connected sets of Wang blocks with J ≥ m, coloured."""
        nodes = [i for i, block in enumerate(self.solved) if block.basis.j >= m]
        edges = self._edges(nodes, m)
        out: list[FieldBlock] = []
        for members, colours, real in coloured_components(nodes, edges):
            copies = 2 if m and real else 1
            for sign in (1, -1) if m and not real else (1,):
                out.append(self.block_of(sign * m, copies, members, colours, real))
        return out

    def solved_of(self, j: int) -> list[SolvedBlock]:
        """The solved Wang blocks of one J."""
        return [self.solved[i] for i in self._by_j.get(j, [])]

    def block_of(self, m: int, copies: int, members: list[int], colours: list[int], real: bool) -> WangBlockInField:
        """A block of the field made of some Wang blocks, for one M.

        Parameters
        ----------
        m : int
            Projection M on the field, with its sign where the block is complex.
        copies : int
            2 where the block stands for +M and -M, else 1.
        members : list of int
            Indices of the Wang blocks in `solved`.
        colours : list of int
            0 or 1 for each of them: its states are multiplied by 1 or i.
        real : bool
            Whether the matrices are real then.

        Returns
        -------
        WangBlockInField
            With the rows of its states among the levels.
        """
        names = sorted({self.solved[i].basis.species for i in members})
        rows = np.concatenate([np.arange(b.start, b.start + b.basis.size) for b in (self.solved[i] for i in members)])
        return WangBlockInField(m, "+".join(names), copies, tuple(members), tuple(colours), real, rows, self)

    def _edges(self, nodes: list[int], m: int) -> list[tuple[int, int, int]]:
        """(node, node, 1 for a vector or 0) wherever a contraction is not zero."""
        here = set(nodes)
        out = []
        for contraction in self.contractions:
            for up, low in self._pairs(contraction):
                j_up, j_low = self.solved[up].basis.j, self.solved[low].basis.j
                if up in here and low in here and self.space_factor(j_up, j_low, contraction.rank)[m]:
                    out.append((up, low, contraction.rank % 2))
        return out

    def connected(self, contraction: Contraction) -> list[tuple[int, int]]:
        """Pairs (up, low) of solved blocks that the body part of a contraction connects."""
        return list(self._pairs(contraction))

    @cached_property
    def _cache(self) -> dict[Any, Any]:
        return {}

    def _tensor(self, contraction: Contraction) -> BodyTensor:
        key = ("tensor", contraction.body.tobytes())
        if key not in self._cache:
            self._cache[key] = body_tensor(contraction.body, contraction.rank, self.representation)
        return self._cache[key]  # type: ignore[no-any-return]

    def _pairs(self, contraction: Contraction) -> dict[tuple[int, int], Floats | None]:
        """Every pair (up, low) of solved blocks that the body part connects, with the elements once they are known."""
        key = ("pairs", contraction.body.tobytes())
        if key not in self._cache:
            tensor, by_j = self._tensor(contraction), self._by_j
            found: dict[tuple[int, int], Floats | None] = {}
            for j, lows in by_j.items():
                for place, low in enumerate(lows):
                    above = [i for rise in range(1, tensor.rank + 1) for i in by_j.get(j + rise, [])]
                    for up in lows[place:] + above:
                        if tensor.between(self.solved[up].basis, self.solved[low].basis) is not None:
                            found[up, low] = None
            self._cache[key] = found
        return self._cache[key]  # type: ignore[no-any-return]

    @cached_property
    def _by_j(self) -> dict[int, list[int]]:
        out: dict[int, list[int]] = {}
        for i, block in enumerate(self.solved):
            out.setdefault(block.basis.j, []).append(i)
        return out

    def space_factor(self, j_up: int, j_low: int, rank: int) -> Floats:
        """(-1)^(J'-M) (J' K J; -M 0 M) for M = 0 ... min(J', J); round-off is 0."""
        key = ("space", j_up, j_low, rank)
        if key not in self._cache:
            m = np.arange(min(j_up, j_low) + 1)
            factor = coupling(j_low, j_up, rank, 0, m) / np.sqrt((2.0 * j_up + 1) * (2 * j_low + 1))
            self._cache[key] = np.append(factor, 0.0)
        return self._cache[key]  # type: ignore[no-any-return]

    def elements(self, contraction: Contraction, members: Sequence[int], m: int) -> list[tuple[int, int, Floats]]:
        """(place of up, place of low, real elements) of all pairs among `members`, for M = m."""
        place = {node: i for i, node in enumerate(members)}
        pairs, size = self._pairs(contraction), _space_size(contraction)
        out = []
        for (up, low), known in pairs.items():
            if up not in place or low not in place:
                continue
            j_up, j_low = self.solved[up].basis.j, self.solved[low].basis.j
            factor = self.space_factor(j_up, j_low, contraction.rank)[abs(m)]
            if m < 0 and (j_up + j_low + contraction.rank) % 2:
                factor = -factor
            if not factor:
                continue
            if known is None:
                known = pairs[up, low] = wang_amplitudes(self.solved[up], self.solved[low], self._tensor(contraction))
            out.append((place[up], place[low], size * factor * known))
        return out


def _space_size(contraction: Contraction) -> float:
    """The q = 0 component of the space part, T^1_0 = Z or T^2_0 = (2ZZ - XX - YY)/√6."""
    space = contraction.space
    return (
        float(space[2]) if contraction.rank == 1 else float((2 * space[2, 2] - space[0, 0] - space[1, 1]) / np.sqrt(6))
    )


def coloured_components(
    nodes: Sequence[int], edges: Sequence[tuple[int, int, int]]
) -> list[tuple[list[int], list[int], bool]]:
    """Connected components of a graph with a colour 0 or 1 for each node, and whether all edges agree with the colours.

    An edge (a, b, 1) asks for different colours, (a, b, 0) for the same one.

    >>> coloured_components([0, 1, 2], [(0, 1, 1)])
    [([0, 1], [0, 1], True), ([2], [0], True)]
    """
    beside: dict[int, list[tuple[int, int]]] = {node: [] for node in nodes}
    for a, b, odd in edges:
        beside[a].append((b, odd))
        beside[b].append((a, odd))
    colour: dict[int, int] = {}
    out = []
    for start in nodes:
        if start in colour:
            continue
        colour[start], found, agree = 0, [start], True
        for node in found:  # grows while it is walked
            for other, odd in beside[node]:
                if other not in colour:
                    colour[other] = (colour[node] + odd) % 2
                    found.append(other)
                agree = agree and colour[other] == (colour[node] + odd) % 2
        members = sorted(found)
        out.append((members, [colour[node] for node in members], agree))
    return out


def wang_space(top: Top, jmax: int, contractions: Sequence[Contraction]) -> WangSpace:
    """The space of a top whose tensors do not have the axis of a symmetric top."""
    from rotor.quantum.effects.watson import SEMI_RIGID
    from rotor.quantum.wang.rotation import representation_of, solve_rotation
    from rotor.tops.top import one_state

    levels = solve_rotation(one_state(top, "levels in a field"), SEMI_RIGID, 0, jmax, in_blocks=True)
    quanta = {name: column for name, column in levels.quanta.items() if name != "j"}
    free = FreeLevels(levels.rotational, levels.energy_mhz, quanta, levels.weight_per_component)
    return WangSpace(free, jmax, representation_of(top), levels.blocks, tuple(contractions))
