"""Blocks of a top in fields of any direction, which mix M as asymmetry mixes K.

In the contraction Σ_pq S^K_p* T^K_q D^K*_pq of a body tensor T with a space tensor S, M and space play the part of k and body:

    ⟨J'k'M'|...|J k M⟩ = ⟨J'k'‖T^K‖J k⟩ ⟨J'M'‖S^K*‖J M⟩ / √((2J'+1)(2J+1)).

The first factor comes from `rotor.quantum.fields.reduced_elements`, for one or more states; the second from `rotor.quantum.tensors` over
Wang functions of M. The matrix between two J is a Kronecker product, real in the phases of that module: for an odd rank both factors are i
times real, and their product is -1 times real. Light polarized along principal axes X, Y, Z does not connect the D2 species of M, nor does
a diagonal polarizability those of k: together up to 16 blocks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.connected import connected_parts
from rotor.quantum.fields.blocks import FieldBlock, FieldSpace, FreeLevels
from rotor.quantum.fields.operators import Contraction, FieldOperator, Magnet
from rotor.quantum.fields.reduced_elements import ReducedElements
from rotor.quantum.fields.solved_space import solved_levels
from rotor.quantum.tensors import BodyTensor, block_elements, body_tensor
from rotor.quantum.wang.basis import WangBlock, wang_blocks

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top

NO_M = -1  # in place of M where it is mixed
SPARSE_ABOVE = 600  # matrices over more states are sparse
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
        """Name of the block."""
        return self.species

    def matrix(self, operator: FieldOperator) -> Any:
        """The contraction over the states (n, n), real symmetric; sparse (CSR) for more than 600 of them."""
        from scipy.sparse import csr_array

        if isinstance(operator, Magnet):
            raise ValueError("a magnetic field is solved along Z only")

        edges = np.cumsum([0, *(self.space.size(pair) for pair in self.members)])
        place = {pair: i for i, pair in enumerate(self.members)}
        out = csr_array if len(self) > SPARSE_ABOVE else None
        dense = np.zeros((len(self), len(self))) if out is None else None
        pieces: list[tuple[Ints, Ints, Floats]] = []
        for up, low, elements in self.space.between(operator, place):
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
            dense[np.diag_indices(len(self))] += operator.scalar
            return dense
        diagonal = np.arange(len(self))
        pieces.append((diagonal, diagonal, np.full(len(self), operator.scalar)))
        rows, columns, values = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
        return csr_array((values, (rows, columns)), shape=(len(self), len(self)))


@dataclass(frozen=True, eq=False)
class TiltedSpace(FieldSpace):
    """Solved blocks up to J max, Wang blocks of M for each J, and the contractions that act."""

    m_is_good: ClassVar[bool] = False

    levels: FreeLevels = field(repr=False)
    jmax: int
    elements: ReducedElements = field(repr=False)
    contractions: tuple[Contraction, ...]

    def blocks(self, m: float) -> list[FieldBlock]:
        """All blocks, for m = 0; none for other m, since each block contains all M."""
        if m:
            return []
        nodes = [(i, k) for i, j in enumerate(self._j) for k in range(len(self._wang[j]))]
        number = {pair: n for n, pair in enumerate(nodes)}
        edges = [
            (number[up], number[low]) for contraction in self.contractions for up, low in self._connected(contraction)
        ]
        parts = connected_parts(len(nodes), edges)
        return [self._block(n, [nodes[i] for i in members]) for n, members in enumerate(parts)]

    def _block(self, number: int, members: list[tuple[int, int]]) -> TiltedBlock:
        """The block of these pairs (solved block, Wang block of M)."""
        rows, abs_m = [], []
        for i, k in members:
            block, wang = self.elements.blocks[i], self._wang[self._j[i]][k]
            size = len(block.energies_mhz)
            rows.append(np.tile(np.arange(block.start, block.start + size), wang.size))
            abs_m.append(np.repeat(wang.k, size))
        return TiltedBlock(
            NO_M, f"block {number}", 1, tuple(members), np.concatenate(rows), np.concatenate(abs_m), self
        )

    def size(self, pair: tuple[int, int]) -> int:
        """States of a pair of blocks."""
        return len(self.elements.blocks[pair[0]].energies_mhz) * self._wang[self._j[pair[0]]][pair[1]].size

    @cached_property
    def _j(self) -> list[int]:
        """J of each solved block."""
        return [block.twice_total // 2 for block in self.elements.blocks]

    @cached_property
    def _wang(self) -> dict[int, list[WangBlock]]:
        """Wang blocks of M by J."""
        return {j: wang_blocks(j, _SPACE_AXES) for j in range(self.jmax + 1)}

    def _connected(self, contraction: Contraction) -> list[tuple[tuple[int, int], tuple[int, int]]]:
        """Pairs (up, low) of nodes that a contraction connects, J' ≥ J; each pair once where both nodes share the solved block."""
        space, out = self._tensor(contraction), []
        for up, low in self.elements.connected(contraction):
            ups, lows = self._wang[self._j[up]], self._wang[self._j[low]]
            out += [
                ((up, a), (low, b))
                for a in range(len(ups))
                for b in range(len(lows))
                if space.between(ups[a], lows[b]) is not None and (a >= b or up != low)
            ]
        return out

    def _tensor(self, contraction: Contraction) -> BodyTensor:
        """The complex conjugate of the space tensor, equal to the tensor of its mirror image y → -y."""
        mirror = np.array([1.0, -1.0, 1.0])
        space = contraction.space * mirror if contraction.rank == 1 else contraction.space * np.outer(mirror, mirror)
        return body_tensor(space, contraction.rank, _SPACE_AXES)

    def between(
        self, contraction: Contraction, members: dict[tuple[int, int], int]
    ) -> list[tuple[tuple[int, int], tuple[int, int], Floats]]:
        """(up, low, real elements) of each connected pair among `members`; M varies more slowly than the solved states."""
        space = self._tensor(contraction)
        sign = -1.0 if contraction.rank == 1 else 1.0
        out = []
        for up, low in self._connected(contraction):
            if up not in members or low not in members:
                continue
            reduced = self.elements.between(contraction, up[0], low[0])
            if reduced is None:
                continue
            j_up, j_low = self._j[up[0]], self._j[low[0]]
            space_elements = block_elements(self._wang[j_up][up[1]], self._wang[j_low][low[1]], space)
            root = np.sqrt((2.0 * j_up + 1) * (2 * j_low + 1))
            out.append((up, low, np.kron(space_elements * (sign / root), reduced)))
        return out


def elements_of_mixed(up: TiltedBlock, low: TiltedBlock, dipole: Contraction) -> list[Floats]:
    """⟨up|μ_X|low⟩, ⟨up|μ_Y|low⟩ and ⟨up|μ_Z|low⟩ (n_up, n_low), real in the phases of this module."""
    space = up.space
    starts = [np.cumsum([0, *(space.size(pair) for pair in block.members)]) for block in (up, low)]
    place = [
        {pair: int(edges[n]) for n, pair in enumerate(block.members)}
        for block, edges in zip((up, low), starts, strict=True)
    ]
    members = dict.fromkeys((*up.members, *low.members), 0)
    out = []
    for axis in np.eye(3):
        matrix = np.zeros((len(up), len(low)))
        for member, other, elements in space.between(replace(dipole, space=axis), members):
            sides = (
                [(member, other, elements)]
                if member == other
                else [(member, other, elements), (other, member, elements.T)]
            )
            for left, right, values in sides:
                if left in place[0] and right in place[1]:
                    row, column = place[0][left], place[1][right]
                    matrix[row : row + values.shape[0], column : column + values.shape[1]] = values
        out.append(matrix)
    return out


def tilted_space(
    top: Top, jmax: int, contractions: Sequence[Contraction], effects: Sequence[QuantumEffect] = ()
) -> TiltedSpace:
    """The space of a top for fields of any direction; ValueError for a spherical top, spins or internal rotation."""
    if top.kind == "spherical":
        raise ValueError(f"{top.name or 'this top'} is a spherical top: neither a dipole nor an anisotropy turns it")
    if any(effect.spins(top) for effect in effects):
        raise ValueError("a top with spins is solved in fields along Z alone; leave out the angle")
    if top.internal_rotation is not None:
        raise ValueError("a top with internal rotation is solved in fields along Z alone; leave out the angle")
    levels = solved_levels(top, jmax, effects)
    return TiltedSpace(FreeLevels.of(levels), jmax, ReducedElements(levels), tuple(contractions))
