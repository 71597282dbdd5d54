"""The unit matrices of an effect's parameters over the blocks in which labelled levels lie, with spins and states or without.

The levels are solved once as the core solves them; the blocks that have a label are then made anew over the functions of the
basis, linear in their parameters (`linear_stacks`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.arrays import Floats, Ints, distinct
from rotor.quantum.basis.state_elements import WangElements, linear_blocks_of, vertices_of, wang_elements
from rotor.quantum.coupled import CoupledBlock
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.label_tracking import (
    Follows,
    LabelledBlocks,
    NamedBlock,
    NamedFunctions,
    Namer,
    Naming,
    tracked_blocks,
)
from rotor.quantum.labelled_states import by_overlaps
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.linear_stacks import Elements, LinearBlock, WeightedElements, elements_of, linear_block
from rotor.quantum.spins.blocks import SpinBlock, coefficients_of, product
from rotor.quantum.spins.lines import Declared, ParameterOperator
from rotor.quantum.spins.operators import AxialState, Basis
from rotor.quantum.spins.parts import SpinPart, assigned, labels_of, names_of_parts
from rotor.quantum.spins.rotor import Channel, RotorBlock
from rotor.quantum.spins.three_equivalent import labels_of_functions
from rotor.quantum.spins.three_spins import Allowed
from rotor.quantum.wang.basis import WangBlock
from rotor.tops.operators import Operators

if TYPE_CHECKING:
    from rotor.tops.top import Top

Units = dict[int, Elements]
Functions = Callable[[CoupledBlock | SpinBlock], tuple[Floats, Ints]]


def unit_levels(
    top: Top,
    levels: Levels,
    rows: Ints,
    names: Sequence[str],
    values_mhz: Floats,
    functions: Functions | None = None,
    naming: Naming | None = None,
) -> LabelledBlocks:
    """The blocks in which the rows of levels lie, for other values of the parameters.

    Parameters
    ----------
    top : Top
    levels : Levels
        Solved with vectors, at values near those of the parameters.
    rows : (n,) array
        Rows of levels, in the order in which `LabelledBlocks.levels` gives them.
    names : sequence of str
        Parameters of the effects of the levels, in the order of the values.
    values_mhz : (parameters,) array
        At which the levels were solved.
    functions : callable, optional
        Of blocks of several states: the functions (n, n) in rows by which the states are called, over those of the basis, and their
        names v, Ka, Kc and with spins the doubled pattern (n, 3 + pattern), where these are not the functions of the basis; levels
        without spins have these names.
    naming : callable, optional
        Of blocks without spins: how the states get their names, which the levels have; by overlaps where it is None.

    Returns
    -------
    LabelledBlocks

    Raises
    ------
    ValueError
        For levels without blocks.
    """
    if not levels.blocks:
        raise ValueError("levels of a closed form have no blocks; solve them in blocks")
    starts = np.array([block.start for block in levels.blocks])
    of_row = np.searchsorted(starts, rows, side="right") - 1
    numbers = distinct(of_row).tolist()
    blocks = [levels.blocks[number] for number in numbers]
    makers = _Makers(top, levels, names, blocks, functions, naming)
    units = [makers.unit(number, block) for number, block in enumerate(blocks)]
    inside = [np.flatnonzero(of_row == number) for number in numbers]

    def find(place: int, found: Ints) -> tuple[Ints, Ints]:
        """Labels of the block by their names, which are those that the levels have."""
        block, own = blocks[place], inside[place]
        state_of = {tuple(name): state for state, name in enumerate(found.tolist())}
        if functions and isinstance(block, SpinBlock):
            asked = _names_by(block, *functions(block))[rows[own] - block.start]
        else:
            asked = _quanta(levels)[rows[own]] if functions or naming else _names(block)[rows[own] - block.start]
        return own, np.array([state_of[tuple(name)] for name in asked.tolist()])

    return tracked_blocks(units, len(rows), find, values_mhz)


def _quanta(levels: Levels) -> Ints:
    v = levels.quanta.get("v", np.zeros(len(levels), dtype=np.int64))
    return np.stack([v, levels.quanta["ka"], levels.quanta["kc"]], axis=1)


def _names(block: Any) -> Ints:
    """What the states of a solved block are called; the rank alone where one Wang block is solved by itself."""
    return np.arange(len(block.energies_mhz))[:, None] if isinstance(block, SolvedBlock) else block.labels


def _names_by(block: SpinBlock, functions: Floats, names: Ints) -> Ints:
    """What the states of a block are called by functions over those of the basis."""
    rows = [block.vectors[part.place].reshape(part.repeats, len(part.rotor.energies_mhz), -1) for part in block.parts]
    over_basis = np.concatenate(
        [
            np.matmul(part.rotor.vectors, own).reshape(-1, block.vectors.shape[1])
            for part, own in zip(block.parts, rows, strict=True)
        ]
    )
    return np.asarray(names[assigned((functions @ over_basis) ** 2, np.ones(len(names), dtype=np.int64))])


class _Makers:
    """Linear blocks of solved blocks of any kind, with what they share."""

    def __init__(
        self,
        top: Top,
        levels: Levels,
        names: Sequence[str],
        blocks: Sequence[Any],
        functions: Functions | None,
        naming: Naming | None,
    ) -> None:
        self._functions, self._naming, self._representation = functions, naming, str(levels.representation)
        self._spins: _SpinUnits | None = None
        self._states: list[LinearBlock] = []
        if isinstance(blocks[0], SpinBlock):
            self._spins = _SpinUnits(top, levels.effects, tuple(names), blocks, apart=functions is None)
        else:
            self._states = linear_blocks_of(top, levels, names, blocks)

    def unit(self, number: int, block: Any) -> NamedBlock:
        """One block, and how its states get their names."""
        if isinstance(block, SpinBlock):
            assert self._spins is not None
            if self._functions:
                size = block.parts[-1].place.stop
                return _turned(linear_block(size, self._spins.matrices(block)), *self._functions(block))
            return self._spins.unit(block)
        linear = self._states[number]
        if self._functions:
            return _turned(linear, *self._functions(block))
        if self._naming:
            return NamedBlock(linear, self._naming(vertices_of(block), self._representation))
        if isinstance(block, SolvedBlock):
            return NamedBlock(linear, NamedFunctions(np.zeros(linear.size, dtype=np.int64), _by_rank, Follows.MOSTLY))
        return NamedBlock(linear, by_overlaps(vertices_of(block), self._representation))


def _turned(block: LinearBlock, functions: Floats, names: Ints) -> NamedBlock:
    """The block over other functions, each of a state by itself: the sub-blocks are their v, the parity of Ka and the pattern."""
    turned = {}
    matrices = block.factors @ block.mix
    for place, parameter in enumerate(block.parameters.tolist()):
        lower = np.zeros(functions.shape)
        lower[block.rows, block.columns] = matrices[:, place]
        turned[parameter] = elements_of(functions @ (lower + np.tril(lower, -1).T) @ functions.T)

    def namer(matrix: Floats, energies: Floats, vectors: Floats) -> Ints:
        return np.asarray(names[assigned(vectors**2, np.ones(len(names), dtype=np.int64))])

    members = np.column_stack([names[:, 0], names[:, 1] % 2, names[:, 3:]])
    sub_blocks = np.unique(members, axis=0, return_inverse=True)[1].reshape(-1)
    return NamedBlock(linear_block(len(names), turned), NamedFunctions(sub_blocks, namer, Follows.MOSTLY))


def _by_rank(matrix: Floats, energies: Floats, vectors: Floats) -> Ints:
    return np.arange(len(energies))[:, None]


class _SpinUnits:
    """Unit matrices of blocks with spins."""

    def __init__(
        self,
        top: Top,
        effects: tuple[QuantumEffect, ...],
        names: Sequence[str],
        blocks: Sequence[SpinBlock],
        *,
        apart: bool,
    ) -> None:
        """apart: whether the powers of N², Nz² and N± are made for all patterns at once."""
        self._shared = blocks[0].shared
        rotation = _Rotation.of(top, effects, names, blocks) if apart else None
        self._rotation = rotation
        declared = Declared.of(top, effects)
        self._operators = {
            place: ParameterOperator(top, effects, name, self._shared, declared)
            for place, name in enumerate(names)
            if rotation is None or name not in rotation.names
        }
        self._coefficients: dict[tuple[Channel, int], Floats] = {}

    def matrices(self, block: SpinBlock) -> Units:
        """The unit matrices that are made for every pattern, over the functions of the basis or those that exchange allows."""
        parts = tuple(_in_functions(part) for part in block.parts)
        units: Units = {}
        for place, operator in self._operators.items():
            matrix = self._matrix(operator, parts, block)
            if matrix is not None:
                units[place] = elements_of(_of_allowed(matrix, block.allowed) if block.allowed else matrix)
        return units

    def unit(self, block: SpinBlock) -> NamedBlock:
        """The unit matrices of one block of an F, the functions of the basis in place of the states of the rotation."""
        parts, units = tuple(_in_functions(part) for part in block.parts), self.matrices(block)
        if block.allowed:
            allowed = block.allowed
            linear = linear_block(len(allowed.sub_block), units)
            return NamedBlock(linear, NamedFunctions(allowed.sub_block, _namer_of_allowed(allowed), Follows.MOSTLY))
        more = self._rotation.of_parts(parts) if self._rotation else None
        size = parts[-1].place.stop
        named = NamedFunctions(_sub_blocks(parts, size), _namer(parts, block.patterns), Follows.MOSTLY)
        return NamedBlock(linear_block(size, units, more), named)

    def _matrix(self, operator: ParameterOperator, parts: tuple[SpinPart, ...], block: SpinBlock) -> Floats | None:
        out: Floats | None = None
        for a, up in enumerate(parts):
            for low in (part for part in parts[: a + 1] if operator.connects(up, part)):
                for channel, element in operator.elements(up, low).items():
                    key = (channel, block.twice_f)
                    if key not in self._coefficients:
                        self._coefficients[key] = self._coupling(channel, block)
                    out = np.zeros((parts[-1].place.stop,) * 2) if out is None else out
                    out[up.place, low.place] += product(self._coefficients[key][up.patterns, low.patterns], element)
        return out

    def _coupling(self, channel: Channel, block: SpinBlock) -> Floats:
        """Coefficients over the patterns of an F; those of the Hamiltonian are there since its plan was made."""
        known = self._shared.cache.get(("coupling", block.twice_f), {})
        return known[channel] if channel in known else coefficients_of(self._shared.scheme, channel, block.patterns)


class _Rotation:
    """The parameters whose operators are powers of N², Nz² and N± alone: elements over the functions of all parts, made at once.

    They are the same for every coupling pattern. names : these parameters
    """

    def __init__(self, names: Sequence[str], own: dict[int, dict[str, Operators]], bases: set[Basis]) -> None:
        found = {(q, n) for terms in own.values() for name in names for _, q, n in terms.get(name, {})}
        powers = ((0, 0), *sorted(found - {(0, 0)}))
        self.names = frozenset(names)
        self._all, self._own, self._powers = names, own, {power: i for i, power in enumerate(powers)}
        wang = {basis for basis in bases if isinstance(basis, WangBlock)}
        self._elements: dict[Basis, WangElements] = {
            basis: _axial(basis, powers) for basis in bases if isinstance(basis, AxialState)
        }
        for basis, elements in wang_elements(wang, powers).items():
            self._elements[basis] = elements
        self._known: dict[int, WeightedElements] = {}

    @classmethod
    def of(
        cls, top: Top, effects: tuple[QuantumEffect, ...], names: Sequence[str], blocks: Sequence[SpinBlock]
    ) -> _Rotation | None:
        """None where exchange allows some functions alone, or two effects have parameters of one name."""
        if any(block.allowed for block in blocks):
            return None
        bases = {own.basis for block in blocks for part in block.parts for own in part.rotor.parts}
        others = {term.name for effect in effects for term in effect.spin_terms(top)}
        others |= {one.name for effect in effects for one in effect.couplings(top)}
        representation = blocks[0].shared.representation
        others |= {
            name
            for effect in effects
            for name in effect.parameters(top)
            if effect.j_operator(top, name, 1, representation) is not None
        }
        own: dict[int, dict[str, Operators]] = {}
        for effect in effects:
            for v, terms in ((0, effect.operators(top)), *((one.v, one.terms) for one in effect.states(top))):
                if own.get(v, {}).keys() & terms.keys():  # of two effects: they add up
                    return None
                own[v] = own.get(v, {}) | dict(terms)
        return cls([name if name not in others else "" for name in names], own, bases)

    def of_parts(self, parts: Sequence[SpinPart]) -> WeightedElements:
        """The elements of a block with spins."""
        size, places, factors = parts[-1].place.stop, list[Ints](), list[Floats]()
        for part in parts:
            if part.number not in self._known:
                self._known[part.number] = self._of_rotor(part.rotor)
            one = self._known[part.number]
            states = len(part.rotor.energies_mhz)
            rows, columns = np.divmod(one.places, states)
            start = part.place.start + states * np.arange(part.repeats)[:, None]
            places.append(((start + rows) * size + start + columns).ravel())
            factors.append(np.tile(one.factors, (part.repeats, 1)))
        return WeightedElements(np.concatenate(places), np.concatenate(factors))

    def _of_rotor(self, rotor: RotorBlock) -> WeightedElements:
        """The lower triangle over the functions of a solved block."""
        size, places, factors = len(rotor.energies_mhz), list[Ints](), list[Floats]()
        for part in rotor.parts:
            elements, start = self._elements[part.basis], part.place.start
            mix = np.zeros((len(self._powers), len(self._all)))
            for column, name in enumerate(self._all):
                for (p, q, n), factor in self._own.get(part.v, {}).get(name, {}).items():
                    mix[self._powers[q, n], column] += factor * (rotor.n * (rotor.n + 1.0)) ** p
            places.append((start + elements.rows) * size + start + elements.columns)
            factors.append(elements.values[:, None] * mix[elements.units])
        return WeightedElements(np.concatenate(places), np.concatenate(factors))


def _axial(state: AxialState, powers: Sequence[tuple[int, int]]) -> WangElements:
    """Nz^2q of one |N K⟩."""
    units = np.array([place for place, (_, n) in enumerate(powers) if n == 0])
    values = np.array([float(state.axial_k) ** (2 * q) for q, n in powers if n == 0])
    zeros = np.zeros_like(units)
    return WangElements(zeros, zeros, units, values)


def _of_allowed(matrix: Floats, allowed: Allowed) -> Floats:
    """A matrix, of which the lower triangle is read, between the functions that exchange allows."""
    whole = np.tril(matrix) + np.tril(matrix, -1).T
    return np.asarray(allowed.products.T @ whole @ allowed.products)


def _namer_of_allowed(allowed: Allowed) -> Namer:
    def namer(matrix: Floats, energies: Floats, vectors: Floats) -> Ints:
        return labels_of_functions(vectors, allowed.sub_block, allowed.names, allowed.sizes)[0]

    return namer


def _in_functions(part: SpinPart) -> SpinPart:
    return part._replace(rotor=replace(part.rotor, vectors=np.eye(len(part.rotor.energies_mhz))))


def _sub_blocks(parts: tuple[SpinPart, ...], size: int) -> Ints:
    """The number of the Wang block and pattern of every function, as `labels_of` counts them."""
    out, number = np.empty(size, dtype=np.int64), 0
    for part in parts:
        states = len(part.rotor.energies_mhz)
        for own in part.rotor.parts:
            for pattern in range(part.repeats):
                start = part.place.start + pattern * states
                out[start + own.place.start : start + own.place.stop] = number
                number += 1
    return out


def _namer(parts: tuple[SpinPart, ...], every: Ints) -> Namer:
    names = names_of_parts(parts, every)

    def namer(matrix: Floats, energies: Floats, vectors: Floats) -> Ints:
        return labels_of(parts, names, vectors)[0]

    return namer
