"""Elements of Hamiltonians of states without spins over connected Wang blocks, linear in their parameters.

The elements of ½[Jz^2q, J₊^2n + J₋^2n]₊ in the Wang blocks of every J are made at once, in whole arrays; every state has the same, times
X^p and the factors of its parameters. Couplings of states, and operators of J that no powers describe, are a unit matrix each. Fits
(`labels.tracking`) and derivatives of levels take their blocks from here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints, distinct, numbers_in_runs
from rotor.quantum.basis.wang_functions import BetweenStates, WangElements, WangFunctions
from rotor.quantum.blocks.connected import connected_parts
from rotor.quantum.blocks.linear_stacks import LinearBlock, LinearStack, numbered, stack_numbers
from rotor.quantum.effect import Coupling, QuantumEffect, State, couplings_of
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.operators.algebra import Operator
from rotor.quantum.wang.basis import SpeciesFactors, WangBlock, parts_of
from rotor.quantum.wang.wang_matrix import unit_diagonals
from rotor.tops.constants.operators import Operators, Powers

if TYPE_CHECKING:
    from rotor.tops.top import Top

_AT_ONCE = 4096  # functions of one state, of neighbouring J, whose links are evaluated together
Vertex = tuple[int, WangBlock]


class UnitElements(NamedTuple):
    """Elements that are not zero: rows, columns, which unit matrix, values."""

    rows: Ints
    columns: Ints
    units: Ints
    values: Floats


class Link(NamedTuple):
    """An operator between two states or within one, which makes a unit matrix, and the couplings that it is the sum of."""

    bra: int
    ket: int
    operator: Operator
    factors: SpeciesFactors | None
    couplings: Sequence[Coupling]

    @classmethod
    def from_couplings(cls, weighted: Sequence[tuple[float, Coupling]]) -> Link:
        """The sum of couplings of the same states with the same factors, each times a number; ValueError for an operator that changes J."""
        _, first = weighted[0]
        for _, coupling in weighted:
            if changed := {label for each in coupling.operator.shifts for label, _ in each.change} - {"K"}:
                raise ValueError(
                    f"{coupling.name}: the operator changes {', '.join(sorted(changed))}; within states it changes K alone"
                )
        total = Operator(tuple(each for value, coupling in weighted for each in (value * coupling.operator).shifts))
        return cls(first.bra, first.ket, total, first.factors, [coupling for _, coupling in weighted])


class StateTerms(NamedTuple):
    """What parameters, by their places, multiply.

    powers : (q, n) of the unit matrices of every state, the first (0, 0); that of state v has the number first[v] + its place here
    rows, columns, p, factors (terms,) : unit matrix, parameter, power of X and factor of every term of the Hamiltonian
    links : what J-dependent operators make, a unit matrix each
    """

    powers: tuple[tuple[int, int], ...]
    first: dict[int, int]
    rows: Ints
    columns: Ints
    p: Ints
    factors: Floats
    links: tuple[Link, ...]

    @classmethod
    def from_effects(
        cls, top: Top, effects: Sequence[QuantumEffect], names: Sequence[str], representation: str
    ) -> StateTerms:
        """The terms of named parameters of effects."""
        place = {name: i for i, name in enumerate(names)}
        states = [state for effect in effects for state in (State(0, effect.operators(top)), *effect.states(top))]
        operators = [
            (state.v, place[name], terms) for state in states for name, terms in state.terms.items() if name in place
        ]
        couplings = [c for c in couplings_of(top, effects, representation) if c.name in place]
        links = [(place[c.name], Link.from_couplings([(1.0, c)])) for c in couplings]
        return cls.from_operators([state.v for state in states], operators, links)

    @classmethod
    def from_operators(
        cls, states: Iterable[int], operators: Sequence[tuple[int, int, Operators]], links: Sequence[tuple[int, Link]]
    ) -> StateTerms:
        """The terms of operators, each with its state and parameter, and of links, each with its parameter."""
        powers = ((0, 0), *sorted({(q, n) for _, _, terms in operators for _, q, n in terms} - {(0, 0)}))
        first = {v: i * len(powers) for i, v in enumerate(dict.fromkeys(states))}
        rows = [
            (first[v] + powers.index((q, n)), parameter, p, factor)
            for v, parameter, terms in operators
            for (p, q, n), factor in terms.items()
        ]
        units = range(len(first) * len(powers), len(first) * len(powers) + len(links))
        rows += [(number, parameter, 0, 1.0) for number, (parameter, _) in zip(units, links, strict=True)]
        unit, column, p = np.array([row[:3] for row in rows], dtype=np.int64).reshape(-1, 3).T
        factors = np.array([row[3] for row in rows], dtype=float)
        return cls(powers, first, unit, column, p, factors, tuple(link for _, link in links))

    def by_power(self) -> Iterator[tuple[int, Powers, int, float]]:
        """State, powers (p, q, n), parameter and factor of every term that is a power."""
        states = list(self.first)
        terms = (column.tolist() for column in (self.rows, self.columns, self.p, self.factors))
        for row, column, p, factor in zip(*terms, strict=True):
            state, unit = divmod(row, len(self.powers))
            if state < len(states):
                yield states[state], (p, *self.powers[unit]), column, factor

    def mix(self, j: int, count: int) -> Floats:
        """How much of each unit matrix each parameter has at one J, (units, count)."""
        out = np.zeros((len(self.first) * len(self.powers) + len(self.links), count))
        np.add.at(out, (self.rows, self.columns), self.factors * (j * (j + 1.0)) ** self.p)
        return out


def wang_elements(blocks: set[WangBlock], powers: Sequence[tuple[int, int]]) -> dict[WangBlock, UnitElements]:
    """The unit matrices of one state, those of `powers`, over every Wang block: lower triangles."""
    if not blocks:
        return {}
    rising = sorted(blocks)
    pieces = []
    for d, values in enumerate(unit_diagonals(rising, [block.size for block in rising], powers)):
        places = np.nonzero(values)
        pieces.append((*places, np.full_like(places[0], d), values[places]))
    b, i, unit, distance, value = (np.concatenate(column) for column in zip(*pieces, strict=True))
    order = np.argsort(b, kind="stable")
    bounds = np.searchsorted(b[order], np.arange(len(rising) + 1))
    out = {}
    for number, block in enumerate(rising):
        chosen = order[bounds[number] : bounds[number + 1]]
        out[block] = UnitElements(i[chosen] + distance[chosen], i[chosen], unit[chosen], value[chosen])
    return out


def wang_stacks(blocks: Sequence[WangBlock], terms: StateTerms, count: int) -> Iterator[tuple[Ints, LinearStack]]:
    """Wang blocks of one state by themselves, those of like size side by side, with their numbers; count: of the parameters."""
    units, order = len(terms.powers), max(n for _, n in terms.powers)
    for numbers in stack_numbers([(block.size, block.size * (order + 1), units) for block in blocks]):
        yield numbers, _wang_stack([blocks[i] for i in numbers.tolist()], terms, count)


def _wang_stack(blocks: Sequence[WangBlock], terms: StateTerms, count: int) -> LinearStack:
    """Wang blocks in order of size."""
    sizes, j = np.array([(block.size, block.j) for block in blocks]).T
    size, starts = int(sizes[-1]), np.cumsum(sizes**2) - sizes**2
    diagonals = unit_diagonals(blocks, sizes.tolist(), terms.powers)[:size]
    distance, columns = numbers_in_runs(size - np.arange(len(diagonals)))
    rows = columns + distance
    inside = rows < sizes[:, None]
    factors = np.concatenate([values[:, : size - d] for d, values in enumerate(diagonals)], axis=1)
    half = np.where(distance, 0.5, 1.0)
    factors /= half[:, None]
    places = np.where(inside, starts[:, None] + rows * sizes[:, None] + columns, (sizes**2).sum())
    mixes = {each: terms.mix(each, count) for each in distinct(j).tolist()}
    first, parameters = size * np.arange(len(blocks))[:, None], np.broadcast_to(np.arange(count), (len(blocks), count))
    mix = np.stack([mixes[each] for each in j.tolist()])
    return LinearStack(sizes, places, rows + first, columns + first, half, factors, mix, parameters)


class LinkElements(NamedTuple):
    """Elements of links between the vertices of one J or of several: numbers of the vertices, places in them, unit matrix, value."""

    up: Ints
    low: Ints
    rows: Ints
    columns: Ints
    units: Ints
    values: Floats


class StateElements:
    """Linear blocks over Wang blocks of states: `vertices` by J, each a state v and one of its Wang blocks."""

    def __init__(self, terms: StateTerms, count: int, vertices: Mapping[int, Sequence[Vertex]]) -> None:
        """count: of the parameters."""
        self.terms, self._count = terms, count
        self._vertices, self._links = vertices, dict[int, LinkElements]()
        self._elements = wang_elements(
            {block for members in vertices.values() for _, block in members}, self.terms.powers
        )

    def at(self, j: int) -> ElementsOfJ:
        """The elements of one J. The links of lower J beside it are evaluated too, so that J should fall from call to call."""
        if j not in self._links:
            self._links = self._linked([i for i in sorted(self._vertices) if 0 <= (j - i) * (2 * j + 1) < _AT_ONCE])
        mix = self.terms.mix(j, self._count)
        return ElementsOfJ(self._vertices[j], self._links[j], mix, self.terms.first, self._elements)

    def _linked(self, all_j: Sequence[int]) -> dict[int, LinkElements]:
        """The elements of all links by J."""
        members: dict[int, list[tuple[int, int, WangBlock]]] = {}
        for j in all_j:
            for number, (v, block) in enumerate(self._vertices[j]):
                members.setdefault(v, []).append((j, number, block))
        functions = {v: tuple(block for *_, block in blocks) for v, blocks in members.items()}
        wang = {blocks: WangFunctions(blocks) for blocks in set(functions.values())}
        between, pieces = dict[tuple[int, int], BetweenStates](), [np.zeros((6, 0), dtype=np.int64)]
        values = [np.zeros(0)]
        for unit, link in enumerate(self.terms.links, len(self.terms.first) * len(self.terms.powers)):
            if link.bra not in members or link.ket not in members:
                continue
            up, low = wang[functions[link.bra]], wang[functions[link.ket]]
            if (id(up), id(low)) not in between:
                between[id(up), id(low)] = BetweenStates(up, low)
            elements = _link_elements(link, between[id(up), id(low)])
            j_up, number_up = np.array([(j, number) for j, number, _ in members[link.bra]]).T
            number_low = np.array([number for _, number, _ in members[link.ket]])
            vertices = j_up[elements.up], number_up[elements.up], number_low[elements.low]
            pieces.append(np.array([*vertices, elements.rows, elements.columns, np.full(len(elements.rows), unit)]))
            values.append(elements.values)
        whole, all_values = np.concatenate(pieces, axis=1), np.concatenate(values)
        order = np.argsort(whole[0], kind="stable")
        whole, all_values = whole[:, order], all_values[order]
        first, last = (np.searchsorted(whole[0], all_j, side=side).tolist() for side in ("left", "right"))
        return {
            j: LinkElements(*(column[start:stop] for column in (*whole[1:], all_values)))
            for j, start, stop in zip(all_j, first, last, strict=True)
        }


def _link_elements(link: Link, between: BetweenStates) -> WangElements:
    """Elements of a link; ValueError with the name of the coupling, of those added up, that has an imaginary one."""
    elements, imaginary = between.elements(link.operator, link.factors)
    for coupling in link.couplings if imaginary else ():
        if between.elements(coupling.operator, coupling.factors)[1]:
            raise ValueError(
                f"{coupling.name}: the operator is not invariant under time reversal; an odd power of J is Hermitian and allowed "
                "between two states only, with the factor i"
            )
    return elements


class ElementsOfJ(NamedTuple):
    """Elements between the Wang blocks of one J, its vertices; mix (units, parameters)."""

    vertices: Sequence[Vertex]
    links: LinkElements
    mix: Floats
    first: dict[int, int]
    within: dict[WangBlock, UnitElements]

    @property
    def connected(self) -> list[list[int]]:
        """The vertices that links connect, each part in rising order."""
        pairs = distinct(self.links.up * len(self.vertices) + self.links.low)
        return connected_parts(len(self.vertices), zip(*np.divmod(pairs, len(self.vertices)), strict=True))

    def lower_triangle(self, members: Sequence[int]) -> UnitElements:
        """The elements of some vertices, one behind the other; of two places those add up that are the same."""
        start, pieces = np.full(len(self.vertices), -1), list[UnitElements]()
        for i, part in zip(members, parts_of([self.vertices[i] for i in members]), strict=True):
            start[i] = part.start
            rows, columns, units, values = self.within[part.basis]
            pieces.append(UnitElements(rows + part.start, columns + part.start, units + self.first[part.v], values))
        state = np.array([v for v, _ in self.vertices])
        here = np.flatnonzero((start[self.links.up] >= 0) & (start[self.links.low] >= 0))
        up, low, units = (column[here] for column in (self.links.up, self.links.low, self.links.units))
        rows, columns = start[up] + self.links.rows[here], start[low] + self.links.columns[here]
        turned = (state[up] != state[low]) & (rows < columns)  # of one state both elements of a pair are there
        rows, columns = np.where(turned, columns, rows), np.where(turned, rows, columns)
        lower = rows >= columns
        pieces.append(UnitElements(rows[lower], columns[lower], units[lower], self.links.values[here][lower]))
        return UnitElements(*(np.concatenate(column) for column in zip(*pieces, strict=True)))

    def block(self, members: Sequence[int]) -> LinearBlock:
        """The block of some vertices, one behind the other."""
        rows, columns, units, values = self.lower_triangle(members)
        size = sum(self.vertices[i][1].size for i in members)
        places, position = numbered(rows * size + columns, size * size)
        used, column = numbered(units, len(self.mix))
        factors = np.zeros((len(places), len(used)))
        np.add.at(factors, (position, column), values)
        mix = self.mix[used]
        parameters = np.flatnonzero(mix.any(axis=0))
        return LinearBlock(size, *np.divmod(places, size), factors, mix[:, parameters], parameters)


def vertices_of(block: SolvedBlock) -> list[Vertex]:
    """The states and Wang blocks of a solved block."""
    return [(part.v, part.basis) for part in block.parts]


def linear_blocks_of(
    top: Top, levels: Levels, names: Sequence[str], blocks: Sequence[SolvedBlock]
) -> list[LinearBlock]:
    """The linear blocks of solved blocks of levels, over the functions that their vectors have."""
    terms = StateTerms.from_effects(top, levels.effects, names, str(levels.representation))
    return blocks_of_terms(terms, len(names), blocks)


def blocks_of_terms(terms: StateTerms, count: int, blocks: Sequence[SolvedBlock]) -> list[LinearBlock]:
    """The linear blocks of so many parameters over the functions of solved blocks."""
    members, by_j = [vertices_of(block) for block in blocks], dict[int, list[int]]()
    for number, vertices_of_block in enumerate(members):
        by_j.setdefault(vertices_of_block[0][1].j, []).append(number)
    # a block may stand there several times, its vertices once
    vertices = {j: list(dict.fromkeys(vertex for i in numbers for vertex in members[i])) for j, numbers in by_j.items()}
    elements = StateElements(terms, count, vertices)
    out: dict[int, LinearBlock] = {}
    for j in sorted(by_j, reverse=True):
        here, number_of = elements.at(j), {vertex: i for i, vertex in enumerate(vertices[j])}
        for number in by_j[j]:
            out[number] = here.block([number_of[vertex] for vertex in members[number]])
    return [out[number] for number in range(len(blocks))]
