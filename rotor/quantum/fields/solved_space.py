"""Solved states of any Hamiltonian in a field: sets of solved blocks that operators connect, for one M or with all M mixed.

A sector is a solved block of one total angular momentum, or its states of one torsional state. The matrix between two sectors is that of
reduced elements (`rotor.quantum.fields.reduced_elements`) times a factor of M (`space_factor`); reduced elements are computed once
for all M and fields. No static field connects torsional species. Elements between states of different v_t, whose overlaps are small,
are neglected: levels shift by less than (μE)²/ΔE, 0.1 MHz at 1 kV/cm for 1 D and 100 cm⁻¹.

Between real functions (`operators.tensors`) reduced elements of odd rank are i times real. States of a sector times 1 or i, its
colour, make all matrices real where such operators lead to the other factor and all others to the same one.

Fields of other directions than Z mix M as asymmetry mixes K. In the contraction Σ_pq S^K_p* T^K_q D^K*_pq of a body tensor T with a space
tensor S, M and space play the part of k and body,

    ⟨J'k'M'|...|J k M⟩ = ⟨J'k'‖T^K‖J k⟩ ⟨J'M'‖S^K*‖J M⟩ / √((2J'+1)(2J+1)),

with the second factor from `operators.tensors` over Wang functions of M. The matrix between two J is a Kronecker product, real in the
phases of that module: for an odd rank both factors are i times real, and their product is -1 times real. Light polarized along principal
axes X, Y, Z does not connect the D2 species of M, nor does a diagonal polarizability those of k: together up to 16 blocks.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise, product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Ints
from rotor.quantum.blocks.connected import coloured_components, connected_parts
from rotor.quantum.fields.axial import AxialSpace, axial_levels
from rotor.quantum.fields.blocks import (
    BEFORE_J,
    Contraction,
    FieldBlock,
    FieldOperator,
    FieldSpace,
    FreeLevels,
    Key,
    Magnet,
)
from rotor.quantum.fields.reduced_elements import ReducedElements
from rotor.quantum.levels import Levels
from rotor.quantum.operators.symmetric_top_elements import space_factor
from rotor.quantum.operators.tensors import BodyTensor, block_elements, body_tensor
from rotor.quantum.solve import solve_levels
from rotor.quantum.wang.basis import wang_blocks

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top


SPARSE_ABOVE = 600  # matrices over more states of mixed M are sparse
NO_M = -1  # in place of M where it is mixed
SPACE_AXES = "IIIr"  # x, y, z of a representation are a, b, c: those of space are X, Y, Z


class FieldSector(NamedTuple):
    """States of a solved block: number of the block, places in it (None: all), rows among the levels, twice F, and their v_t.

    projections: Wang functions of M (a `WangBlock`) that multiply the states where M is mixed, M varying more slowly than the states.
    """

    block: int
    places: Ints | None
    rows: Ints
    twice_f: int
    vt: int = 0
    projections: Any = None


def _turned(turns: int, matrix: NDArray[Any]) -> NDArray[Any]:
    """i^turns times a matrix; real if the factor is ±1."""
    if turns % 4 == 0:
        return matrix
    return -matrix if turns % 4 == 2 else np.asarray((1j if turns % 4 == 1 else -1j) * matrix)


@dataclass(frozen=True, eq=False)
class SolvedSpace(FieldSpace):
    """Solved blocks up to J max and the operators that act on them; with a magnet M and -M differ, sectors with `projections` mix M."""

    levels: FreeLevels = field(repr=False)
    jmax: int
    sectors: tuple[FieldSector, ...] = field(repr=False)
    elements: ReducedElements = field(repr=False)
    operators: tuple[FieldOperator, ...]
    _below: dict[Key, dict[int, list[tuple[int, int]]]] = field(default_factory=dict, repr=False)
    _tensors: dict[Key, BodyTensor] = field(default_factory=dict, repr=False)

    @property
    def m_is_good(self) -> bool:
        """Whether states have one M."""
        return self.sectors[0].projections is None

    def blocks(self, m: float) -> list[FieldBlock]:
        """Connected sets of sectors: in an electric field for ±M (M and -M apart where states are paired), in a magnetic one for M.

        Where M is mixed all blocks are those of m = 0, since each contains all M. With M ≠ 0 a reversed field exchanges mirror images.
        """
        if m and not self.m_is_good:
            return []
        twice_m = round(2 * m)
        edges = [
            (up, low, odd)
            for operator in self.operators
            for up, lows in self.below(operator).items()
            for low, odd in lows
            if not self.m_is_good or self.factor(operator, up, low, twice_m)
        ]
        magnetic = any(operator.time_odd for operator in self.operators)
        out: list[FieldBlock] = []
        for place, (members, colours, real) in enumerate(coloured_components(len(self.sectors), edges)):
            if self.sectors[members[0]].twice_f < abs(twice_m):
                continue
            paired = self.elements.blocks[self.sectors[members[0]].block].paired
            signs = (1, -1) if paired and twice_m and not magnetic else (1,)
            copies = 2 if paired or (twice_m and not magnetic) else 1
            rows, label = np.concatenate([self.sectors[i].rows for i in members]), self._label(members, place)
            for sign in signs:
                number = sign * twice_m / 2 if twice_m % 2 else sign * (twice_m // 2) if self.m_is_good else NO_M
                even = not (paired and number)
                out.append(
                    FieldBlock(number, copies, label, rows, tuple(members), self, even, tuple(colours), paired, real)
                )
        return out

    def below(self, operator: FieldOperator) -> dict[int, list[tuple[int, int]]]:
        """For each sector, those of equal or lower F that an operator connects, with 1 where elements lack a factor i, else 0.

        Where M is good `blocks` tests the factor of M; all elements are real where M is mixed.
        """
        if operator.key_in_space in self._below:
            return self._below[operator.key_in_space]
        pairs = self._below[operator.key_in_space] = {}
        lacks_i = self.m_is_good and operator.rank % 2 and not operator.time_odd
        for up, low in self.elements.connected(operator):
            odd = int(lacks_i and self.elements.blocks[low].combined)
            for a, b in product(self._sectors_of[up], self._sectors_of[low]):
                first, second = self.sectors[a], self.sectors[b]
                if first.vt != second.vt or (up == low and a < b):
                    continue
                if self.m_is_good or self._space_tensor(operator).connects(first.projections, second.projections):
                    pairs.setdefault(a, []).append((b, odd))
        return pairs

    @cached_property
    def _sectors_of(self) -> dict[int, list[int]]:
        """Sectors by the number of their solved block."""
        out: dict[int, list[int]] = {}
        for number, sector in enumerate(self.sectors):
            out.setdefault(sector.block, []).append(number)
        return out

    def factor(self, operator: FieldOperator, up: int, low: int, twice_m: int, q: int = 0) -> float:
        """The factor of M between two sectors; for q = 0 it includes the size of the operator in space."""
        factor = space_factor(self.sectors[up].twice_f, self.sectors[low].twice_f, operator.rank, twice_m, q)
        return factor if q else operator.size * factor

    def elements_between(self, operator: FieldOperator, up: int, low: int, twice_m: int, q: int) -> NDArray[Any] | None:
        """Elements of T_q from the states of M, or of all M, of a sector to those of another, F' ≥ F; None where all are 0."""
        first, second = self.sectors[up], self.sectors[low]
        factor = self.factor(operator, up, low, twice_m, q) if self.m_is_good else 1.0
        if not factor:
            return None
        elements = self.elements.between(operator, first.block, second.block)
        if first.places is not None and second.places is not None:
            elements = elements[np.ix_(first.places, second.places)]
        if self.m_is_good:
            return np.asarray(factor * elements)
        in_space = block_elements(first.projections, second.projections, self._space_tensor(operator))
        root = np.sqrt((first.twice_f + 1.0) * (second.twice_f + 1))
        return np.kron(in_space * ((-1.0 if operator.rank == 1 else 1.0) / root), elements)

    def _space_tensor(self, operator: Any) -> BodyTensor:
        """The complex conjugate of the space tensor, equal to the tensor of its mirror image y → -y."""
        if operator.key_in_space not in self._tensors:
            mirror = np.array([1.0, -1.0, 1.0])
            space = operator.space * (mirror if operator.rank == 1 else np.outer(mirror, mirror))
            self._tensors[operator.key_in_space] = body_tensor(space, operator.rank, SPACE_AXES)
        return self._tensors[operator.key_in_space]

    def abs_m(self, block: FieldBlock) -> Ints:
        """|M| of the states of a block (n,)."""
        if self.m_is_good:
            return super().abs_m(block)
        sectors = [self.sectors[i] for i in block.members]
        return np.concatenate([np.repeat(s.projections.k, len(s.rows) // s.projections.size) for s in sectors])

    def starts(self, block: FieldBlock) -> Ints:
        """First place of the states of each sector of a block, and the number of states."""
        return np.cumsum([0, *(len(self.sectors[i].rows) for i in block.members)])

    def reversed_states(self, block: FieldBlock, places: Ints, vectors: NDArray[Any]) -> NDArray[Any]:
        """v(-M) of states v(M) (fields, n, states) over some places of a block.

        They are (-1)^(F + c) v(M)*, up to a common sign, with the colours c: (F' K F; M 0 -M) = (-1)^(F' + F + K) (F' K F; -M 0 M) and
        the elements of odd rank change sign when they are conjugated.
        """
        twice_f = np.array([self.sectors[i].twice_f for i in block.members])
        odd = ((twice_f - twice_f[0]) // 2 + np.array(block.colours)) % 2
        signs = np.repeat(np.where(odd, -1, 1), np.diff(self.starts(block)))
        return np.asarray(signs[places][:, None] * vectors.conj())

    def matrix(self, block: FieldBlock, operator: FieldOperator) -> Any:
        """The operator over the states of a block, real symmetric or complex Hermitian; in compressed rows for many states of mixed M."""
        size, placed = len(block), list(self._placed_elements(block, operator, block))
        if self.m_is_good or size <= SPARSE_ABOVE:
            whole = np.diag(np.full(size, operator.scalar, np.result_type(float, *(part for _, _, part in placed))))
            for rows, columns, elements in placed:
                whole[rows, columns] += elements
            return whole
        from scipy.sparse import csr_array

        pieces = [(np.arange(size), np.arange(size), np.full(size, operator.scalar))]
        for rows, columns, elements in placed:
            i, k = np.nonzero(elements)
            pieces.append((rows.start + i, columns.start + k, elements[i, k]))
        places, others, values = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
        return csr_array((values, (places, others)), shape=(size, size))

    def between(self, up: FieldBlock, operator: FieldOperator, low: FieldBlock) -> NDArray[Any]:
        """⟨M'|T_q|M⟩ of an operator from the states of a block to those of another (n_up, n_low), q = M' - M."""
        out = np.zeros((len(up), len(low)), dtype=np.complex128)
        for rows, columns, elements in self._placed_elements(up, operator, low):
            out[rows, columns] += elements
        return out

    def _placed_elements(
        self, up: FieldBlock, operator: FieldOperator, low: FieldBlock
    ) -> Iterator[tuple[slice, slice, NDArray[Any]]]:
        """Places of a member and of a member of `low`, and the elements between their states with the phases of their colours.

        From a higher to a lower F they follow from T_q† = (-1)^q T_-q of Hermitian tensors.
        """
        q = (up.twice_m - low.twice_m) // 2
        below, here, there = self.below(operator), self._placed(up), self._placed(low)
        for first in dict.fromkeys((*up.members, *low.members)):
            for second, odd in below.get(first, ()):
                if first in here and second in there:
                    elements = self.elements_between(operator, first, second, low.twice_m, q)
                    if elements is not None:
                        (rows, colour), (columns, other) = here[first], there[second]
                        elements = _turned(other - colour + odd, elements)
                        yield rows, columns, elements
                        if up is low and first != second:
                            yield columns, rows, elements.conj().T
                if up is not low and first != second and second in here and first in there:
                    elements = self.elements_between(operator, first, second, up.twice_m, -q)
                    if elements is not None:
                        (rows, colour), (columns, other) = here[second], there[first]
                        yield rows, columns, _turned(other - colour - odd, (-1) ** q * elements.conj().T)

    def _placed(self, block: FieldBlock) -> dict[int, tuple[slice, int]]:
        """Places of the states of each member of a block, and its colour."""
        places = [slice(a, b) for a, b in pairwise(self.starts(block).tolist())]
        return dict(zip(block.members, zip(places, block.colours, strict=True), strict=True))

    def _label(self, members: Sequence[int], place: int) -> str:
        """Species of Wang functions, K where it is a good quantum number, else the lowest level; the place where M is mixed."""
        if not self.m_is_good:
            return f"block {place}"
        blocks = [self.elements.blocks[self.sectors[i].block] for i in members]
        if blocks[0].alone:
            return "+".join(sorted({block.basis.species for block in blocks}))
        k = blocks[0].axial_k
        return f"from {self.levels.label(int(self.sectors[members[0]].rows[0]))}" if k is None else f"k={k}"


def solved_space(top: Top, levels: Levels, jmax: int, operators: Sequence[FieldOperator]) -> SolvedSpace:
    """The space of solved levels for fields along Z.

    Raises ValueError for a symmetric top with spins and good K if an operator is not axial, and for g of an unknown spin.
    """
    elements = ReducedElements(levels)
    _refuse_across_axis(top, elements, operators)
    _refuse_unknown_nuclei(elements, operators)
    sectors = tuple(_sectors(levels))
    free = FreeLevels.from_levels(levels)
    space = SolvedSpace(free, jmax, sectors, elements, tuple(operators))
    if not set(BEFORE_J) & set(free.quanta):
        return space
    family = np.zeros(len(free), dtype=np.int64)
    edges = [(up, low) for operator in operators for up, lows in space.below(operator).items() for low, _ in lows]
    for number, members in enumerate(connected_parts(len(sectors), edges)):
        for i in members:
            family[sectors[i].rows] = number
    return replace(space, levels=replace(free, family=family))


def _sectors(levels: Levels) -> Iterator[FieldSector]:
    """Sectors of solved blocks, divided by v_t if there is a torsion."""
    vt = levels.quanta.get("vt")
    for number, block in enumerate(levels.blocks):
        rows = np.arange(block.start, block.start + len(block.energies_mhz))
        if vt is None:
            yield FieldSector(number, None, rows, block.twice_total)
            continue
        for value in np.unique(vt[rows]).tolist():
            places = np.flatnonzero(vt[rows] == value)
            yield FieldSector(number, places, rows[places], block.twice_total, value)


def _refuse_across_axis(top: Top, elements: ReducedElements, operators: Sequence[FieldOperator]) -> None:
    """Raise ValueError if K of a symmetric top is good and an operator is not axial."""
    axis = {"prolate": 0, "oblate": 2}.get(top.kind)
    if axis is None or not any(block.paired for block in elements.blocks):
        return
    if not all(operator.axial_about(axis) for operator in operators):
        raise ValueError("a symmetric top with spins: expected tensors that are axial about its axis")


def _refuse_unknown_nuclei(elements: ReducedElements, operators: Sequence[FieldOperator]) -> None:
    """Raise ValueError for g of a spin that the effects do not have."""
    nuclei = {name for operator in operators if isinstance(operator, Magnet) for name in operator.nuclei}
    if not nuclei:
        return
    spins = elements.blocks[0].spins
    spin_names = [] if spins is None else [spin.name for spin in spins.shared.scheme.spins]
    if unknown := sorted(nuclei - set(spin_names)):
        raise ValueError(f"g of {', '.join(unknown)}: the spins of these effects are {', '.join(spin_names) or 'none'}")


def solved_levels(top: Top, jmax: int, effects: Sequence[QuantumEffect]) -> Levels:
    """All levels up to J max (N with spins) with eigenvectors; by default with all effects of the top except spins."""
    from rotor.quantum.effects.of_top import effects_of
    from rotor.quantum.wang.rotation import solve_rotation

    effects = tuple(effects) or effects_of(top, False)
    if top.internal_rotation is not None or any(effect.spins(top) for effect in effects):
        return solve_levels(top, jmax, effects=effects)
    return solve_rotation(top, effects, 0, jmax, in_blocks=True)


def field_space(
    top: Top, jmax: int, operators: Sequence[FieldOperator], effects: Sequence[QuantumEffect] = ()
) -> FieldSpace:
    """The states of a top up to `jmax` (of N with spins) and the blocks that the operators, all that will act, do not connect.

    effects: the Hamiltonian without the field; by default all effects of the top except spins. Raises ValueError for a spherical top, and
    for a field at an angle with Z beside spins or internal rotation.
    """
    if top.kind == "spherical":
        raise ValueError(
            f"{top.name or 'this top'} is a spherical top: it has neither a dipole nor an anisotropy, and no field of the first "
            "or second order turns it"
        )
    if not all(operator.along_z for operator in operators):
        return tilted_space(top, jmax, operators, effects)
    axis = 2 if top.kind == "oblate" else 0
    axial = top.kind != "asymmetric" and not effects and top.states is None
    if axial and all(operator.axial_about(axis) for operator in operators):
        oriented = any(operator.rank == 1 for operator in operators)
        magnetic = any(operator.time_odd for operator in operators)
        return AxialSpace(axial_levels(top, jmax), jmax, axis, oriented, magnetic)
    return solved_space(top, solved_levels(top, jmax, effects), jmax, operators)


def tilted_space(
    top: Top, jmax: int, operators: Sequence[FieldOperator], effects: Sequence[QuantumEffect] = ()
) -> SolvedSpace:
    """The space of a top for fields of any direction; ValueError for spins, internal rotation and magnetic fields."""
    has_spins = any(effect.spins(top) for effect in effects)
    if has_spins or top.internal_rotation is not None:
        what = "spins" if has_spins else "internal rotation"
        raise ValueError(f"a top with {what} is solved in fields along Z alone; leave out the angle")
    if not all(isinstance(operator, Contraction) for operator in operators):
        raise ValueError("a magnetic field is solved along Z only")
    levels = solved_levels(top, jmax, effects)
    elements = ReducedElements(levels)
    projections = {j: wang_blocks(j, SPACE_AXES) for j in range(jmax + 1)}
    sectors = tuple(
        FieldSector(
            number,
            None,
            np.tile(block.start + np.arange(len(block.energies_mhz)), wang.size),
            block.twice_total,
            projections=wang,
        )
        for number, block in enumerate(elements.blocks)
        for wang in projections[block.twice_total // 2]
    )
    return SolvedSpace(FreeLevels.from_levels(levels), jmax, sectors, elements, tuple(operators))
