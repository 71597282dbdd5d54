"""Blocks of a top in fields of any direction: M is mixed, and takes part like K.

A contraction of a body tensor T with a space tensor S is Σ_pq S^K_p* T^K_q D^K*_pq, in which M and space stand like k and body:

    ⟨J'k'M'|...|J k M⟩ = ⟨J'k'‖T^K‖J k⟩ ⟨J'M'‖S^K*‖J M⟩ / √((2J'+1)(2J+1)).

Both factors come from `rotor.quantum.tensors`, over Wang blocks of k and over the same Wang functions of M, so that the matrix of two
J is a Kronecker product, real in the phases of that module: for an odd rank both factors are i times real, and their product -1
times real. Light whose polarization has principal axes along X, Y, Z leaves the D2 species of M apart, as a diagonal polarizability
those of k: together up to 16 blocks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.blocks import Contraction, FieldBlock, FieldSpace, FreeLevels
from rotor.quantum.fields.wang_blocks import coloured_components
from rotor.quantum.reduced import wang_amplitudes
from rotor.quantum.tensors import BodyTensor, block_elements, body_tensor
from rotor.quantum.wang.basis import WangBlock, wang_blocks

if TYPE_CHECKING:
    from rotor.quantum.levels import SolvedBlock
    from rotor.tops.top import Top

NO_M = -1  # in place of M where it is mixed
SPARSE_ABOVE = 600  # states
_SPACE_AXES = "IIIr"  # x, y, z of a representation are a, b, c: those of space are X, Y, Z


@dataclass(frozen=True)
class TiltedBlock(FieldBlock):
    """States (Wang function of M) x (state of a solved Wang block of k) of the pairs `members`."""

    m: int
    species: str
    copies: int
    members: tuple[tuple[int, int], ...]
    rows: Ints = field(repr=False)
    projections: Ints = field(repr=False)
    space: TiltedSpace = field(repr=False)

    @property
    def abs_m(self) -> Ints:
        """|M| of the Wang functions (n,)."""
        return self.projections

    @property
    def label(self) -> str:
        """Which block it is."""
        return self.species

    @property
    def levels(self) -> FreeLevels:
        """The levels of the space."""
        return self.space.levels

    def matrix(self, contraction: Contraction) -> Any:
        """The contraction over the states (n, n), real symmetric; sparse (CSR) for more than 600 of them."""
        from scipy.sparse import csr_array

        edges = np.cumsum([0, *(self.space.size(pair) for pair in self.members)])
        place = {pair: i for i, pair in enumerate(self.members)}
        out = csr_array if len(self) > SPARSE_ABOVE else None
        dense = np.zeros((len(self), len(self))) if out is None else None
        pieces: list[tuple[Ints, Ints, Floats]] = []
        for up, low, elements in self.space.elements(contraction, place):
            first, second = edges[place[up]], edges[place[low]]
            if dense is not None:
                dense[first : first + len(elements), second : second + elements.shape[1]] += elements
                if up != low:
                    dense[second : second + elements.shape[1], first : first + len(elements)] += elements.T
                continue
            i, j = np.nonzero(elements)
            pieces.append((first + i, second + j, elements[i, j]))
            if up != low:
                pieces.append((second + j, first + i, elements[i, j]))
        if dense is not None:
            dense[np.diag_indices(len(self))] += contraction.scalar
            return dense
        diagonal = np.arange(len(self))
        pieces.append((diagonal, diagonal, np.full(len(self), contraction.scalar)))
        rows, columns, values = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
        return csr_array((values, (rows, columns)), shape=(len(self), len(self)))


@dataclass(frozen=True)
class TiltedSpace(FieldSpace):
    """Solved Wang blocks of k up to J max, Wang blocks of M of each J, and everything that will act."""

    m_is_good: ClassVar[bool] = False

    levels: FreeLevels = field(repr=False)
    jmax: int
    representation: str
    solved: tuple[SolvedBlock, ...] = field(repr=False)
    contractions: tuple[Contraction, ...]

    def blocks(self, m: int) -> list[FieldBlock]:
        """All blocks, for m = 0; none for others, since each block holds every M."""
        if m:
            return []
        nodes = [(i, k) for i, block in enumerate(self.solved) for k in range(len(self._of_m[block.basis.j]))]
        number = {pair: n for n, pair in enumerate(nodes)}
        edges = [
            (number[up], number[low], 0)
            for contraction in self.contractions
            for up, low in self._connected(contraction)
        ]
        found = coloured_components(range(len(nodes)), edges)
        return [self._block(n, [nodes[i] for i in members]) for n, (members, _, _) in enumerate(found)]

    def _block(self, number: int, members: list[tuple[int, int]]) -> TiltedBlock:
        rows, abs_m = [], []
        for i, k in members:
            block, of_m = self.solved[i], self._of_m[self.solved[i].basis.j][k]
            rows.append(np.tile(np.arange(block.start, block.start + block.basis.size), of_m.size))
            abs_m.append(np.repeat(of_m.k, block.basis.size))
        return TiltedBlock(
            NO_M, f"block {number}", 1, tuple(members), np.concatenate(rows), np.concatenate(abs_m), self
        )

    def size(self, pair: tuple[int, int]) -> int:
        """States of a pair of blocks."""
        block = self.solved[pair[0]].basis
        return block.size * self._of_m[block.j][pair[1]].size

    @cached_property
    def _of_m(self) -> dict[int, list[WangBlock]]:
        return {j: wang_blocks(j, _SPACE_AXES) for j in range(self.jmax + 1)}

    @cached_property
    def _by_j(self) -> dict[int, list[int]]:
        out: dict[int, list[int]] = {}
        for i, block in enumerate(self.solved):
            out.setdefault(block.basis.j, []).append(i)
        return out

    def _connected(self, contraction: Contraction) -> list[tuple[tuple[int, int], tuple[int, int]]]:
        """Pairs (up, low) of nodes that a contraction connects, J' ≥ J."""
        body, space = self._tensors(contraction)
        out = []
        for j, lows in self._by_j.items():
            for place, low in enumerate(lows):
                above = [i for rise in range(1, contraction.rank + 1) for i in self._by_j.get(j + rise, [])]
                for up in lows[place:] + above:
                    if body.between(self.solved[up].basis, self.solved[low].basis) is None:
                        continue
                    out += [
                        ((up, a), (low, b)) for a, b in self._of_m_pairs(self.solved[up].basis.j, j, space, up == low)
                    ]
        return out

    def _of_m_pairs(self, j_up: int, j_low: int, space: BodyTensor, same: bool) -> list[tuple[int, int]]:
        """Wang blocks of M that the space tensor connects; each pair once where both nodes share the body block."""
        ups, lows = self._of_m[j_up], self._of_m[j_low]
        return [
            (a, b)
            for a in range(len(ups))
            for b in range(len(lows))
            if space.between(ups[a], lows[b]) is not None and (a >= b or not same)
        ]

    def _tensors(self, contraction: Contraction) -> tuple[BodyTensor, BodyTensor]:
        """The body tensor, and the complex conjugate of the space tensor, which is that of its mirror image y → -y."""
        mirror = np.array([1.0, -1.0, 1.0])
        space = contraction.space * mirror if contraction.rank == 1 else contraction.space * np.outer(mirror, mirror)
        body = body_tensor(contraction.body, contraction.rank, self.representation)
        return body, body_tensor(space, contraction.rank, _SPACE_AXES)

    def elements(
        self, contraction: Contraction, members: dict[tuple[int, int], int]
    ) -> list[tuple[tuple[int, int], tuple[int, int], Floats]]:
        """(up, low, real elements) of every connected pair among `members`, M running slower than the states of k."""
        body, space = self._tensors(contraction)
        sign = -1.0 if contraction.rank == 1 else 1.0
        out, known = [], {}
        for up, low in self._connected(contraction):
            if up not in members or low not in members:
                continue
            of_k, low_k = self.solved[up[0]], self.solved[low[0]]
            of_m, low_m = self._of_m[of_k.basis.j][up[1]], self._of_m[low_k.basis.j][low[1]]
            if (up[0], low[0]) not in known:
                known[up[0], low[0]] = wang_amplitudes(of_k, low_k, body)
            root = np.sqrt((2.0 * of_k.basis.j + 1) * (2 * low_k.basis.j + 1))
            out.append((up, low, np.kron(block_elements(of_m, low_m, space) * (sign / root), known[up[0], low[0]])))
        return out


def tilted_space(top: Top, jmax: int, contractions: Sequence[Contraction]) -> TiltedSpace:
    """The space of a top for fields of any direction.

    Raises ValueError for a spherical top.
    """
    from rotor.quantum.effects.watson import SEMI_RIGID
    from rotor.quantum.wang.rotation import representation_of, solve_rotation
    from rotor.tops.top import one_state

    if top.kind == "spherical":
        raise ValueError(f"{top.name or 'this top'} is a spherical top: neither a dipole nor an anisotropy turns it")
    levels = solve_rotation(one_state(top, "levels in a field"), SEMI_RIGID, 0, jmax, in_blocks=True)
    quanta = {name: column for name, column in levels.quanta.items() if name != "j"}
    free = FreeLevels(levels.rotational, levels.energy_mhz, quanta, levels.weight_per_component)
    return TiltedSpace(free, jmax, representation_of(top), levels.blocks, tuple(contractions))
