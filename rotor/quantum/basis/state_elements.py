"""Elements of Hamiltonians of states without spins over connected Wang blocks, linear in their parameters.

The elements of ½[Jz^2q, J₊^2n + J₋^2n]₊ in the Wang blocks of every J are made at once, in whole arrays; every state has the same, times
X^p and the factors of its parameters. Couplings of states, and operators of J that no powers describe, are a unit matrix each. Fits
(`labelled_states`) and derivatives of levels take their blocks from here.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.effect import QuantumEffect, couplings_of
from rotor.quantum.label_blocks import unit_diagonals
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.linear_stacks import LinearBlock, numbered
from rotor.quantum.states import OperatorOfJ, State
from rotor.quantum.wang.basis import NOTHING, Part, WangBlock, parts_of
from rotor.quantum.wang.j_operators import JOperator, between_blocks
from rotor.tops.operators import Operators, Powers

if TYPE_CHECKING:
    from rotor.tops.top import Top

_TRIED_AT = 3  # J at which a pair of kinds of Wang blocks is tried
Vertex = tuple[int, WangBlock]
Summed = tuple[
    int, int, OperatorOfJ, Sequence[tuple[str, OperatorOfJ]]
]  # states, the sum of operators, and each by its name


class WangElements(NamedTuple):
    """Elements that are not zero: rows, columns, which unit matrix, values."""

    rows: Ints
    columns: Ints
    units: Ints
    values: Floats


class _Link(NamedTuple):
    """An operator of J between two states or within one, the unit matrix that it makes, and what it is the sum of, by name."""

    unit: int
    bra: int
    ket: int
    operator: OperatorOfJ
    named: Sequence[tuple[str, OperatorOfJ]]


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
    links: tuple[_Link, ...]

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
        links = [(place[c.name], (c.bra, c.ket, c.operator, [(c.name, c.operator)])) for c in couplings]
        return cls.from_operators([state.v for state in states], operators, links)

    @classmethod
    def from_operators(
        cls, states: Iterable[int], operators: Sequence[tuple[int, int, Operators]], links: Sequence[tuple[int, Summed]]
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
        numbered_links = tuple(_Link(number, *link) for number, (_, link) in zip(units, links, strict=True))
        return cls(powers, first, unit, column, p, factors, numbered_links)

    @property
    def linked(self) -> list[int]:
        """The parameters that multiply other operators than powers."""
        return sorted({int(column) for column in self.columns[self.rows >= len(self.first) * len(self.powers)]})

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


def wang_elements(blocks: set[WangBlock], powers: Sequence[tuple[int, int]]) -> dict[WangBlock, WangElements]:
    """The unit matrices of one state, those of `powers`, over every Wang block: lower triangles."""
    if not blocks:
        return {}
    rising = sorted(blocks)
    diagonals = unit_diagonals(rising, [block.size for block in rising], powers[1:])
    size = max(block.size for block in rising)
    ones = np.arange(size)[None, :] < np.array([block.size for block in rising])[:, None]
    numbers, functions = np.nonzero(ones)
    pieces = [(numbers, functions, np.zeros_like(functions), np.zeros_like(functions))]
    elements = [np.ones(len(functions))]
    for d, values in enumerate(diagonals):
        places = np.nonzero(values)
        pieces.append((places[0], places[1], np.full_like(places[0], d), places[2] + 1))
        elements.append(values[places])
    b, i, distance, unit = (np.concatenate(column) for column in zip(*pieces, strict=True))
    value = np.concatenate(elements)
    order = np.argsort(b, kind="stable")
    bounds = np.searchsorted(b[order], np.arange(len(rising) + 1))
    out = {}
    for number, block in enumerate(rising):
        chosen = order[bounds[number] : bounds[number + 1]]
        out[block] = WangElements(i[chosen] + distance[chosen], i[chosen], unit[chosen], value[chosen])
    return out


class _Joining:
    """What links connect. Whether two kinds of Wang blocks, E±, O± of two states, are connected is found at the three highest J that have
    both; these come first."""

    def __init__(self, links: Sequence[_Link], representation: str) -> None:
        self._links, self._representation = links, representation
        self._tried = defaultdict[tuple[int, int, int, int, int], int](int)
        self._kinds: set[tuple[int, int, int, int, int]] = set()

    def elements(self, vertices: Sequence[Vertex], j: int) -> list[tuple[int, int, WangElements]]:
        """Elements between two vertices, those of the bra in rows, or within one, for every link; none for round-off of zero."""
        linked = list[tuple[int, int, WangElements]]()
        blocks_by_state: dict[int, list[tuple[int, WangBlock, int]]] = {}
        for i, (v, block) in enumerate(vertices):
            blocks_by_state.setdefault(v, []).append((i, block, 2 * (block.first_k % 2) + (block.sign > 0)))
        for link in self._links:
            operator = link.operator(j, self._representation)
            least = NOTHING * max(
                (float(np.abs(band).max(initial=0.0)) for band in operator.bands.values()), default=0.0
            )
            for i, up, kind_up in blocks_by_state.get(link.bra, ()):
                for k, low, kind_low in blocks_by_state.get(link.ket, ()):
                    kind = (link.unit, link.bra, kind_up, link.ket, kind_low)
                    self._tried[kind] += 1
                    if (self._tried[kind] <= _TRIED_AT or kind in self._kinds) and (
                        elements := _linked(link, operator, (up, low), least, self._representation)
                    ):
                        self._kinds.add(kind)
                        linked.append((i, k, elements))
        return linked


def _linked(
    link: _Link, operator: JOperator, blocks: tuple[WangBlock, WangBlock], least: float, representation: str
) -> WangElements | None:
    """Elements between two Wang blocks; None where all are below `least`."""
    up, low = blocks
    between = between_blocks(up, low, operator)
    size = np.abs(between)
    if not size.max() > least:
        return None
    if np.abs(between.imag).max() > least:
        _refuse_imaginary(link, up, low, representation)
    rows, columns = np.nonzero(size)
    return WangElements(rows, columns, np.full(len(rows), link.unit), between.real[rows, columns])


def _refuse_imaginary(link: _Link, up: WangBlock, low: WangBlock, representation: str) -> None:
    """ValueError with the name of the coupling, of those added up, that has an imaginary element."""
    for name, operator in link.named:
        between = between_blocks(up, low, operator(low.j, representation))
        if np.abs(between.imag).max() > NOTHING * np.abs(between).max():
            raise ValueError(
                f"{name}: the operator is not invariant under time reversal; an odd power of J is Hermitian and allowed "
                "between two states only, with the factor i"
            )


def _shifted(elements: WangElements, part: Part, first: int) -> WangElements:
    """Of one state, where its part stands in a block."""
    rows, columns, units, values = elements
    return WangElements(rows + part.start, columns + part.start, units + first, values)


def _between(elements: WangElements, up: Part, low: Part) -> WangElements:
    """In the lower triangle of a block; of one state both elements of a pair are there, between two states the one alone."""
    rows, columns = elements.rows + up.start, elements.columns + low.start
    if up.v != low.v and up.start < low.start:
        rows, columns = columns, rows
    lower = rows >= columns
    return WangElements(rows[lower], columns[lower], elements.units[lower], elements.values[lower])


class StateElements:
    """Linear blocks over Wang blocks of states: `vertices` by J, each a state v and one of its Wang blocks."""

    def __init__(
        self, terms: StateTerms, count: int, representation: str, vertices: Mapping[int, Sequence[Vertex]]
    ) -> None:
        """count: of the parameters."""
        self.terms, self._count = terms, count
        self._vertices, self._joining = vertices, _Joining(self.terms.links, representation)
        self._elements = wang_elements(
            {block for members in vertices.values() for _, block in members}, self.terms.powers
        )

    def at(self, j: int) -> ElementsOfJ:
        """The elements of one J; the highest J come first."""
        links = self._joining.elements(self._vertices[j], j)
        return ElementsOfJ(self._vertices[j], links, self.terms.mix(j, self._count), self.terms.first, self._elements)


class ElementsOfJ(NamedTuple):
    """Elements between the Wang blocks of one J: links by numbers of vertices; mix (units, parameters)."""

    vertices: Sequence[Vertex]
    links: list[tuple[int, int, WangElements]]
    mix: Floats
    first: dict[int, int]
    within: dict[WangBlock, WangElements]

    def block(self, members: Sequence[int]) -> LinearBlock:
        """The block of some vertices, one behind the other."""
        parts = parts_of([self.vertices[i] for i in members])
        place = dict(zip(members, parts, strict=True))
        pieces = [_shifted(self.within[part.basis], part, self.first[part.v]) for part in parts]
        pieces += [_between(link, place[i], place[k]) for i, k, link in self.links if i in place and k in place]
        rows, columns, units, values = (np.concatenate(column) for column in zip(*pieces, strict=True))
        size = parts[-1].place.stop
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
    return blocks_of_terms(terms, len(names), str(levels.representation), blocks)


def blocks_of_terms(
    terms: StateTerms, count: int, representation: str, blocks: Sequence[SolvedBlock]
) -> list[LinearBlock]:
    """The linear blocks of so many parameters over the functions of solved blocks."""
    members, by_j = [vertices_of(block) for block in blocks], dict[int, list[int]]()
    for number, vertices_of_block in enumerate(members):
        by_j.setdefault(vertices_of_block[0][1].j, []).append(number)
    vertices = {j: [vertex for i in numbers for vertex in members[i]] for j, numbers in by_j.items()}
    elements = StateElements(terms, count, representation, vertices)
    out: dict[int, LinearBlock] = {}
    for j in sorted(by_j, reverse=True):
        here, start = elements.at(j), 0
        for number in by_j[j]:
            stop = start + len(members[number])
            out[number], start = here.block(range(start, stop)), stop
    return [out[number] for number in range(len(blocks))]
