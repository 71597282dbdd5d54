"""Blocks of a top in fields of any direction, which mix M as asymmetry mixes K.

In the contraction Σ_pq S^K_p* T^K_q D^K*_pq of a body tensor T with a space tensor S, M and space play the part of k and body:

    ⟨J'k'M'|...|J k M⟩ = ⟨J'k'‖T^K‖J k⟩ ⟨J'M'‖S^K*‖J M⟩ / √((2J'+1)(2J+1)).

The first factor comes from `rotor.quantum.fields.reduced_elements`, for one or more states; the second from `rotor.quantum.tensors` over
Wang functions of M. The matrix between two J is a Kronecker product, real in the phases of that module: for an odd rank both factors are i
times real, and their product is -1 times real. Light polarized along principal axes X, Y, Z does not connect the D2 species of M, nor does
a diagonal polarizability those of k: together up to 16 blocks.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.fields.blocks import FieldBlock, FreeLevels
from rotor.quantum.fields.operators import Contraction, FieldOperator, Key
from rotor.quantum.fields.reduced_elements import ReducedElements
from rotor.quantum.fields.solved_space import FieldSector, SolvedFieldBlock, SolvedSpace, solved_levels
from rotor.quantum.tensors import BodyTensor, block_elements, body_tensor
from rotor.quantum.wang.basis import WangBlock, wang_blocks

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top

NO_M = -1  # in place of M where it is mixed
_SPACE_AXES = "IIIr"  # x, y, z of a representation are a, b, c: those of space are X, Y, Z


@dataclass(frozen=True, eq=False)
class TiltedSpace(SolvedSpace):
    """Sectors are solved blocks of k times Wang blocks of M."""

    m_is_good: ClassVar[bool] = False

    _tensors: dict[Key, BodyTensor] = field(default_factory=dict, repr=False)

    def blocks(self, m: float) -> list[FieldBlock]:
        """All blocks, for m = 0; none for other m, since each block contains all M."""
        blocks = [] if m else super().blocks(0)
        return [replace(block, m=NO_M) for block in blocks if isinstance(block, SolvedFieldBlock)]

    def _pairs(self, operator: FieldOperator) -> Iterator[tuple[int, int, int]]:
        """Pairs of sectors that an operator connects; all elements are real."""
        tensor = self._tensor(operator)
        for up, low, _ in super()._pairs(operator):
            if tensor.between(*self._projections(up, low)) is not None:
                yield up, low, 0

    def factor(self, operator: FieldOperator, up: int, low: int, twice_m: int, q: int = 0) -> float:
        """1, since elements of M are matrices."""
        return 1.0

    def between(self, operator: FieldOperator, up: int, low: int, twice_m: int, q: int) -> Floats | None:
        """Elements between the states of two sectors, real; M varies more slowly than the solved states."""
        first, second = self.sectors[up], self.sectors[low]
        reduced = self.elements.between(operator, first.block, second.block)
        if reduced is None:
            return None
        in_space = block_elements(*self._projections(up, low), self._tensor(operator))
        root = np.sqrt((first.twice_f + 1.0) * (second.twice_f + 1))
        outer = np.multiply.outer(in_space * ((-1.0 if operator.rank == 1 else 1.0) / root), reduced)
        return np.asarray(outer.swapaxes(1, 2).reshape(len(in_space) * len(reduced), -1))

    def _projections(self, up: int, low: int) -> tuple[WangBlock, WangBlock]:
        """Wang functions of M of two sectors."""
        first, second = self.sectors[up].projections, self.sectors[low].projections
        assert first is not None
        assert second is not None
        return first, second

    def _tensor(self, operator: Any) -> BodyTensor:
        """The complex conjugate of the space tensor, equal to the tensor of its mirror image y → -y."""
        if operator.key_in_space not in self._tensors:
            mirror = np.array([1.0, -1.0, 1.0])
            space = operator.space * (mirror if operator.rank == 1 else np.outer(mirror, mirror))
            self._tensors[operator.key_in_space] = body_tensor(space, operator.rank, _SPACE_AXES)
        return self._tensors[operator.key_in_space]


def tilted_space(
    top: Top, jmax: int, operators: Sequence[FieldOperator], effects: Sequence[QuantumEffect] = ()
) -> TiltedSpace:
    """The space of a top for fields of any direction; ValueError for a spherical top, spins, internal rotation and magnetic fields."""
    if top.kind == "spherical":
        raise ValueError(f"{top.name or 'this top'} is a spherical top: neither a dipole nor an anisotropy turns it")
    if any(effect.spins(top) for effect in effects):
        raise ValueError("a top with spins is solved in fields along Z alone; leave out the angle")
    if top.internal_rotation is not None:
        raise ValueError("a top with internal rotation is solved in fields along Z alone; leave out the angle")
    if not all(isinstance(operator, Contraction) for operator in operators):
        raise ValueError("a magnetic field is solved along Z only")
    levels = solved_levels(top, jmax, effects)
    elements = ReducedElements(levels)
    projections = {j: wang_blocks(j, _SPACE_AXES) for j in range(jmax + 1)}
    sectors = tuple(
        FieldSector(
            number,
            None,
            np.tile(block.start + np.arange(len(block.energies_mhz)), wang.size),
            block.twice_total,
            wang,
        )
        for number, block in enumerate(elements.blocks)
        for wang in projections[block.twice_total // 2]
    )
    return TiltedSpace(FreeLevels.of(levels), jmax, sectors, elements, tuple(operators))
