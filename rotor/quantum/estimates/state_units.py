"""The unit matrices of several states' parameters over the connected Wang blocks in which labels lie, without spins.

Labels are J, v, Ka, Kc. Nothing is solved to find them: which block a label lies in follows from J, v and the parities of Ka and Kc,
and which state it is from the names that its block has at the start. The elements of ½[Jz^2q, J₊^2n + J₋^2n]₊ in the Wang blocks of
every J are made at once, in whole arrays; every state has the same, times X^p and the factors of its parameters. Only blocks with a
label are made. `effect_units` does the same for levels that have been solved, with spins too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints, distinct
from rotor.quantum.coupled import NOTHING, Part, connected_parts, names_of_functions, names_of_states, parts_of
from rotor.quantum.effect import QuantumEffect, k_limits_of
from rotor.quantum.estimates.unit_blocks import UnitBlocks, tracked_blocks
from rotor.quantum.estimates.unit_matrices import Follows, NamedFunctions, Naming, UnitBlock, members_of, numbered
from rotor.quantum.label_blocks import unit_diagonals
from rotor.quantum.states import OperatorOfJ, State
from rotor.quantum.wang.basis import WangBlock, limited, wang_blocks
from rotor.quantum.wang.j_operators import JOperator, between_blocks
from rotor.quantum.wang.rotation import representation_of

if TYPE_CHECKING:
    from rotor.tops.top import Top

_LOOKED_AT = 3  # J at which all pairs of Wang blocks are tried
Vertex = tuple[int, WangBlock]


class WangElements(NamedTuple):
    """Elements that are not zero: rows, columns, which unit matrix, values."""

    rows: Ints
    columns: Ints
    units: Ints
    values: Floats


class _Link(NamedTuple):
    """What one parameter multiplies between two states or within one: its operator of J, and the unit matrix that it makes."""

    unit: int
    bra: int
    ket: int
    operator: OperatorOfJ


class _Terms(NamedTuple):
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
    def of(cls, top: Top, effects: Sequence[QuantumEffect], names: Sequence[str], representation: str) -> _Terms:
        place = {name: i for i, name in enumerate(names)}
        own = [state for effect in effects for state in (State(0, effect.operators(top)), *effect.states(top))]
        found = {(q, n) for state in own for operators in state.terms.values() for _, q, n in operators}
        powers = ((0, 0), *sorted(found - {(0, 0)}))
        first = {v: i * len(powers) for i, v in enumerate(dict.fromkeys(state.v for state in own))}
        terms = [
            (first[state.v] + powers.index((q, n)), place[name], p, factor)
            for state in own
            for name, operators in state.terms.items()
            for (p, q, n), factor in operators.items()
        ]
        links = list[_Link]()
        for name, bra, ket, operator in _links(top, effects, representation):
            links.append(_Link(len(first) * len(powers) + len(links), bra, ket, operator))
            terms.append((links[-1].unit, place[name], 0, 1.0))
        rows, columns, p = np.array([term[:3] for term in terms], dtype=np.int64).reshape(-1, 3).T
        factors = np.array([term[3] for term in terms], dtype=float)
        return cls(powers, first, rows, columns, p, factors, tuple(links))

    def mix(self, j: int, count: int) -> Floats:
        """How much of each unit matrix each parameter has at one J, (units, count)."""
        out = np.zeros((len(self.first) * len(self.powers) + len(self.links), count))
        np.add.at(out, (self.rows, self.columns), self.factors * (j * (j + 1.0)) ** self.p)
        return out


def _links(top: Top, effects: Sequence[QuantumEffect], representation: str) -> list[tuple[str, int, int, OperatorOfJ]]:
    """Parameter, states and operator of couplings and of operators of the top's own state that no powers describe."""
    found = list[tuple[str, int, int, OperatorOfJ]]()
    for effect in effects:
        found += [(one.name, one.bra, one.ket, one.operator) for one in effect.couplings(top)]
        for name in effect.parameters(top):
            if effect.j_operator(top, name, 1, representation) is not None:
                found.append((name, 0, 0, _of_effect(effect, top, name)))
    return found


def _of_effect(effect: QuantumEffect, top: Top, name: str) -> OperatorOfJ:
    def operator(j: int, representation: str) -> JOperator:
        made = effect.j_operator(top, name, j, representation)
        assert made is not None
        return made

    return operator


def state_units(
    top: Top,
    effects: Sequence[QuantumEffect],
    names: Sequence[str],
    labels: Ints,
    values_mhz: Floats,
    naming: Naming | None = None,
) -> UnitBlocks:
    """The blocks in which labels lie, for any values of the parameters.

    Parameters
    ----------
    top : Top
        Kind and representation count.
    effects : sequence of QuantumEffect
        What the Hamiltonian consists of: operators, states and couplings, no spins.
    names : sequence of str
        Parameters of the effects, in the order of the values.
    labels : (n, 4) array
        J, v, Ka, Kc.
    values_mhz : (parameters,) array
        At which states are named.
    naming : callable, optional
        How the states of connected Wang blocks get their names; by overlaps, see `names_of_states`, where it is None.

    Returns
    -------
    UnitBlocks
        `found` has the places of the labels that are levels.

    Raises
    ------
    ValueError
        For a Hamiltonian that is not finite, or not invariant under time reversal.
    """
    representation, limits, named = representation_of(top), k_limits_of(top, effects), naming or by_overlaps
    terms = _Terms.of(top, effects, names, representation)
    of_j = {j: np.flatnonzero(labels[:, 0] == j) for j in distinct(labels[:, 0][labels[:, 0] >= 0]).tolist()}
    whole = {j: wang_blocks(j, representation) for j in of_j}
    vertices = {
        j: [(v, cut) for v in sorted(terms.first) for block in whole[j] if (cut := _within(block, limits.get(v)))]
        for j in of_j
    }
    elements = wang_elements({block for some in vertices.values() for _, block in some}, terms.powers)

    blocks, inside, joining = list[UnitBlock](), list[Ints](), _Joining(terms.links, representation)
    for j, rows in sorted(of_j.items(), reverse=True):
        mix, links = terms.mix(j, len(names)), joining.elements(vertices[j], j)
        asked = {(int(v), "eo"[ka % 2] + "eo"[kc % 2]) for _, v, ka, kc in labels[rows].tolist()}
        for members in connected_parts(len(vertices[j]), [(i, k) for i, k, _ in links]):
            own = {(vertices[j][i][0], vertices[j][i][1].species) for i in members}
            if own & asked:
                parts = parts_of([vertices[j][i] for i in members])
                place = dict(zip(members, parts, strict=True))
                found = [_shifted(elements[part.basis], part, terms.first[part.v]) for part in parts]
                found += [_between(one, place[i], place[k]) for i, k, one in links if i in place]
                blocks.append(
                    _block(found, mix, parts[-1].place.stop, named([vertices[j][i] for i in members], representation))
                )
                inside.append(rows)

    def find(number: int, made: Ints) -> tuple[Ints, Ints]:
        state_of = {tuple(name): state for state, name in enumerate(made.tolist())}
        rows = inside[number]
        states = np.array([state_of.get(tuple(name), -1) for name in labels[rows, 1:].tolist()], dtype=np.int64)
        return rows[states >= 0], states[states >= 0]

    return tracked_blocks(blocks, len(labels), find, values_mhz)


def _within(block: WangBlock, limits: tuple[int, int] | None) -> WangBlock | None:
    return limited(block, *limits) if limits else block


def wang_elements(blocks: set[WangBlock], powers: Sequence[tuple[int, int]]) -> dict[WangBlock, WangElements]:
    """The unit matrices of one state, those of `powers`, over every Wang block: lower triangles."""
    if not blocks:
        return {}
    every = sorted(blocks)
    diagonals = unit_diagonals(every, [block.size for block in every], powers[1:])
    size = max(block.size for block in every)
    ones = np.arange(size)[None, :] < np.array([block.size for block in every])[:, None]
    of_block, functions = np.nonzero(ones)
    found = [(of_block, functions, np.zeros_like(functions), np.zeros_like(functions))]
    given = [np.ones(len(functions))]
    for d, values in enumerate(diagonals):
        places = np.nonzero(values)
        found.append((places[0], places[1], np.full_like(places[0], d), places[2] + 1))
        given.append(values[places])
    b, i, d_of, unit = (np.concatenate(column) for column in zip(*found, strict=True))
    value = np.concatenate(given)
    order = np.argsort(b, kind="stable")
    bounds = np.searchsorted(b[order], np.arange(len(every) + 1))
    out = {}
    for number, block in enumerate(every):
        chosen = order[bounds[number] : bounds[number + 1]]
        out[block] = WangElements(i[chosen] + d_of[chosen], i[chosen], unit[chosen], value[chosen])
    return out


class _Joining:
    """What links connect. Between which kinds of Wang blocks, E±, O± of two states, is found at the highest three J, which come first."""

    def __init__(self, links: Sequence[_Link], representation: str) -> None:
        self._links, self._representation, self._looked = links, representation, 0
        self._kinds: set[tuple[int, int, int, int, int]] = set()

    def elements(self, vertices: Sequence[Vertex], j: int) -> list[tuple[int, int, WangElements]]:
        """Elements between two vertices, those of the bra in rows, or within one, for every link; none for round-off of zero."""
        found = list[tuple[int, int, WangElements]]()
        everywhere, self._looked = self._looked < _LOOKED_AT, self._looked + 1
        of_state: dict[int, list[tuple[int, WangBlock, int]]] = {}
        for i, (v, block) in enumerate(vertices):
            of_state.setdefault(v, []).append((i, block, 2 * (block.first_k % 2) + (block.sign > 0)))
        for link in self._links:
            operator = link.operator(j, self._representation)
            least = NOTHING * max(
                (float(np.abs(band).max(initial=0.0)) for band in operator.bands.values()), default=0.0
            )
            for i, up, of_up in of_state.get(link.bra, ()):
                for k, low, of_low in of_state.get(link.ket, ()):
                    kind = (link.unit, link.bra, of_up, link.ket, of_low)
                    if (everywhere or kind in self._kinds) and (one := _linked(link, operator, up, low, least)):
                        self._kinds.add(kind)
                        found.append((i, k, one))
        return found


def _linked(link: _Link, operator: JOperator, up: WangBlock, low: WangBlock, least: float) -> WangElements | None:
    """Elements between two Wang blocks; None where all are below `least`."""
    between = between_blocks(up, low, operator)
    size = np.abs(between)
    if not size.max() > least:
        return None
    if np.abs(between.imag).max() > least:
        raise ValueError(
            f"parameter of states {link.bra} and {link.ket}: the operator is not invariant under time reversal"
        )
    rows, columns = np.nonzero(size)
    return WangElements(rows, columns, np.full(len(rows), link.unit), between.real[rows, columns])


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


def _block(found: Sequence[WangElements], mix: Floats, size: int, named: NamedFunctions) -> UnitBlock:
    rows, columns, units, values = (np.concatenate(column) for column in zip(*found, strict=True))
    places, of_place = numbered(rows * size + columns, size * size)
    used, of_unit = numbered(units, len(mix))
    factors = np.zeros((len(places), len(used)))
    np.add.at(factors, (of_place, of_unit), values)
    of_used = mix[used]
    parameters = np.flatnonzero(of_used.any(axis=0))
    members = members_of(named.sub_blocks)
    return UnitBlock(
        size, *np.divmod(places, size), factors, of_used[:, parameters], parameters, members, named.namer, named.follows
    )


def by_overlaps(blocks: Sequence[Vertex], representation: str) -> NamedFunctions:
    """Names of states by their overlaps with those of each Wang block by itself."""
    parts = parts_of(blocks)
    sub_blocks = np.repeat(np.arange(len(parts)), [part.basis.size for part in parts])

    def namer(matrix: Floats, energies: Floats, vectors: Floats) -> Ints:
        if len(parts) == 1:
            return names_of_functions(parts, representation)
        return names_of_states(parts, matrix, vectors, representation)[0]  # of the matrix the lower triangle is read

    return NamedFunctions(sub_blocks, namer, Follows.MOSTLY)
