"""What the parameter lines of a file stand for among connected states: operators with their spins, as entries and as one effect.

| line | entries |
|---|---|
| of all states | the operator in every state |
| of l-doubled states | its parts between the real states x, y (`l_doubled`) |
| that a half turn changes, in phases with odd operators within a state | the operator times the half turn (`phases`) |
| with one of two equivalent spins whose even and odd totals weigh differently | the part that is even, or odd, under their exchange |
| with one of three equivalent spins | the operator with its parts of ΔK ≠ 0 halved (`symmetry.halved_across`) |
| between states of which weights forbid some species | the operator without elements between those |
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np

from rotor.formats.spcat.hamiltonian.coded_file import CodedLine
from rotor.formats.spcat.hamiltonian.codes import NOT_YET, basis_of
from rotor.formats.spcat.hamiltonian.l_doubled import Pair, RealPart, over_real_states, turned_operator, turned_rotor
from rotor.formats.spcat.hamiltonian.operators import CodedOperator
from rotor.formats.spcat.hamiltonian.phases import half_turned
from rotor.formats.spcat.hamiltonian.states import StateOptions
from rotor.formats.spcat.hamiltonian.symmetry import SpeciesPairs, exchange_part, halved_across, species_pairs
from rotor.frozen import dataclass
from rotor.quantum.effect import Coupling, Moment, QuantumEffect, State
from rotor.quantum.spins import Scheme, Spin
from rotor.quantum.spins.scheme import (
    EVERY_STATE,
    ByElements,
    BySpecies,
    Cosines,
    CosinesWithN,
    Rotor,
    Scalar,
    SpinTerm,
)
from rotor.quantum.spins.stack_elements import elements_of_pair
from rotor.quantum.wang.basis import SpeciesFactors, factors_of_pairs, wang_blocks
from rotor.tops.constants.operators import Operators

if TYPE_CHECKING:
    from rotor.tops.top import Top


States = tuple[int, int]
Vector = tuple[float, float, float]
_EVERY = (EVERY_STATE, EVERY_STATE)
_LOOKED_AT = 5  # N at which all elements of a file's operators exist


class Entry(NamedTuple):
    """A part of a parameter line: `factor` times an operator between two states, numbered in their group, or in every state.

    factors: what elements of an operator without spins between Wang blocks are multiplied with.
    """

    name: str
    operator: CodedOperator
    bra: int
    ket: int
    factor: float = 1.0
    factors: SpeciesFactors | None = None


@dataclass(frozen=True, eq=False)
class Connected:
    """Connected states of a file, numbered from 0, as the lines between them and within them see these states.

    pairs: l-doubled states. axes: the axes x, y, z. turned: the axis g of `phases` whose half turn accompanies time reversal, if an
    operator within one state is odd under it.
    """

    states: tuple[StateOptions, ...]
    pairs: tuple[Pair, ...]
    axes: str
    turned: str

    @cached_property
    def apart(self) -> dict[States, SpeciesPairs]:
        """Species with elements by pairs of states, where weights forbid others."""
        second, count = {pair.second for pair in self.pairs}, len(self.states)
        between = [(v, w) for v in range(count) for w in range(v, count)]
        allowed = {
            (v, w): species_pairs(self.states[v], self.states[w], (v in second, w in second), self.axes[2])
            for v, w in between
        }
        return {both: species for both, species in allowed.items() if species is not None}

    def entries(self, lines: Sequence[CodedLine]) -> tuple[Entry, ...]:
        """The entries of all lines; ValueError, with the parameter, for operators that these states do not support."""
        return tuple(entry for line in lines for entry in self._entries(line))

    def _entries(self, line: CodedLine) -> Iterator[Entry]:
        operator = self._with_threefold_factors(line)
        for states, exchange in self._exchanges(line):
            for swapped, factor in _exchanged(operator, exchange, len(self.states[0].spins)):
                for part in self._parts(line, states):
                    yield from self._between(line, swapped, part._replace(factor=factor * part.factor))

    def _with_threefold_factors(self, line: CodedLine) -> CodedOperator:
        """The operator with SPCAT's factors for three equivalent spins."""
        if not self.states[0].is_threefold(line.operator.spins):
            return line.operator
        if isinstance(line.operator.rotor, ByElements):
            raise line.parameter.refusal(f"a term of higher order or of a series with three equivalent spins {NOT_YET}")
        return halved_across(line.operator, self.axes)

    def _exchanges(self, line: CodedLine) -> list[tuple[States | None, int]]:
        """The states of a line, one by one where they differ in the part of it that connects levels of equal weight, and that part.

        1 is even under the exchange of two equivalent spins, -1 odd, 0 both. Levels of l-doubled states do not tell the parts."""
        if self.states[0].equivalent != 2 or self.pairs or not line.operator.spins:
            return [(line.states, 0)]
        axis = line.symmetry.axis
        if line.states:
            return [(line.states, exchange_part(axis, *(self.states[v] for v in line.states)))]
        parts = [exchange_part(axis, state, state) for state in self.states]
        return [(None, parts[0])] if len(set(parts)) == 1 else [((v, v), part) for v, part in enumerate(parts)]

    def _parts(self, line: CodedLine, states: States | None) -> list[RealPart]:
        """Where a line acts: in every state, between its states, or between real states of l-doubled ones."""
        if states is None and (line.operator.rotor or line.operator.plain is not None):
            return [RealPart(*_EVERY, 1.0)]
        if states is None:
            return [RealPart(v, v, 1.0) for v in range(len(self.states))]
        if not any(v in states for pair in self.pairs for v in pair):
            return [RealPart(*states, 1.0)]
        if isinstance(line.operator.rotor, ByElements):
            raise line.parameter.refusal(f"a spin term of higher order or of a series, of l-doubled states, {NOT_YET}")
        what = "operator" if line.operator.rotor is None else "spin operator"
        try:
            return over_real_states(states, line.operator.odd, line.reversed_, self.pairs, self.axes, what)
        except ValueError as error:
            raise line.parameter.refusal(str(error)) from None

    def _between(self, line: CodedLine, operator: CodedOperator, part: RealPart) -> Iterator[Entry]:
        """The entry of a part of a line, if it has elements."""
        factors = None
        if self.turned and line.symmetry.axis not in ("", self.turned):
            factors = half_turned(self.turned, operator.odd)
        if operator.rotor is not None:
            rotor = turned_rotor(operator.rotor, self.axes) if part.turned else operator.rotor
            if rotor is None:
                return
            is_odd, pairs = rotor.odd and factors is None, self.apart.get((part.bra, part.ket))
            if pairs and self._has_elements_beyond(rotor, pairs):
                factors = _times(factors, pairs)
            if factors:
                assert isinstance(rotor, ByElements | Cosines | CosinesWithN)
                rotor = BySpecies(rotor, factors, is_odd)
            yield Entry(line.name, replace(operator, rotor=rotor), part.bra, part.ket, part.factor)
        elif operator.plain is not None and not line.is_between:
            yield Entry(line.name, operator, part.bra, part.ket)
        else:
            alone = turned_operator(operator.alone) if part.turned else operator.alone
            placed, pairs = (
                replace(operator, plain=None, of_n=part.factor * alone),
                self.apart.get((part.bra, part.ket)),
            )
            yield Entry(line.name, placed, part.bra, part.ket, factors=_times(factors, pairs) if pairs else factors)

    def _has_elements_beyond(self, rotor: Rotor, pairs: SpeciesPairs) -> bool:
        """Whether the operator of a spin term connects other species than these pairs."""
        if isinstance(rotor, Scalar):
            return False
        basis = basis_of(self.axes)
        blocks = wang_blocks(_LOOKED_AT, basis)
        beyond = [(up, low) for up in blocks for low in blocks if (up.species, low.species) not in pairs]
        all_elements = (elements_of_pair(rotor, up, low, basis) for up, low in beyond)
        return any(elements is not None and elements.any() for elements in all_elements)


def _times(factors: SpeciesFactors | None, pairs: SpeciesPairs) -> SpeciesFactors:
    """Factors of an operator, 0 beyond these pairs of species."""
    between = np.array(factors_of_pairs(pairs)) * (1.0 if factors is None else np.array(factors))
    return tuple(map(tuple, between.tolist()))


def _exchanged(operator: CodedOperator, exchange: int, count: int) -> list[tuple[CodedOperator, float]]:
    """The part of an operator that is even, or odd, under the exchange of the last two of `count` spins, with factors."""
    last = (count - 1, count)
    touched = set(operator.spins) & set(last)
    if not exchange or not touched:
        return [(operator, 1.0)]
    if len(touched) == 2:  # the product of both, which is even
        return [(operator, 1.0)] if exchange > 0 else []
    other = {last[0]: last[1], last[1]: last[0]}
    swapped = replace(operator, spins=tuple(other.get(place, place) for place in operator.spins))
    return [(operator, 0.5), (swapped, exchange / 2)]


@dataclass(frozen=True, eq=False)
class FileEffect(QuantumEffect):
    """The parameter lines of a file for a group of its states, which are numbered here from 0.

    values: in MHz by code and number of the line. lines: the parameter lines. connected: the states. coupled: the spins by place.
    moments: dipoles in debye by pairs of states. limits: smallest and largest K by state. others: moments of other kinds. ixx: bits for
    conserved sums of angular momenta, from N on.
    """

    name: ClassVar[str] = ""
    conserved: ClassVar[frozenset[str]] = frozenset()

    values: dict[str, float]
    lines: tuple[CodedLine, ...]
    connected: Connected
    coupled: tuple[Spin, ...]
    moments: dict[tuple[int, int], Vector]
    limits: dict[int, tuple[int, int]]
    others: tuple[Moment, ...] = ()
    ixx: int = 0

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """The l-doubled states."""
        return self.connected.pairs

    @cached_property
    def entries(self) -> tuple[Entry, ...]:
        """What the lines stand for, made when a Hamiltonian is asked for."""
        return self.connected.entries(self.lines)

    def parameters(self, top: Top) -> dict[str, float]:
        """Values in MHz by code and number of the line."""
        return dict(self.values)

    def operators(self, top: Top) -> dict[str, Operators]:
        """The operators of the first state."""
        return self._plain(0)

    def _plain(self, v: int) -> dict[str, Operators]:
        """Operators of a state that have powers (p, q, n), by parameter."""
        return {
            entry.name: entry.operator.plain
            for entry in self.entries
            if entry.operator.plain is not None and entry.bra in (v, EVERY_STATE)
        }

    def states(self, top: Top) -> tuple[State, ...]:
        """The states beyond the first."""
        return tuple(State(v, self._plain(v)) for v in range(1, len(self.connected.states)))

    def couplings(self, top: Top, representation: str) -> tuple[Coupling, ...]:
        """Interactions of states, and operators of one state that have no powers (p, q, n)."""
        return tuple(
            Coupling(entry.name, entry.bra, entry.ket, entry.operator.of_n, entry.factors)
            for entry in self.entries
            if entry.operator.of_n is not None
        )

    def spins(self, top: Top) -> tuple[Spin, ...]:
        """The spins, in the order of the file."""
        return self.coupled

    def spin_terms(self, top: Top) -> tuple[SpinTerm, ...]:
        """The lines with spins."""
        terms = []
        for name, o, bra, ket, factor, _ in self.entries:
            if o.rotor is not None:
                spins = tuple(self.coupled[place - 1].name for place in o.spins)
                terms.append(SpinTerm(name, spins, o.rotor, factor, o.n2, o.nz2, o.ns, bra, ket))
        return tuple(terms)

    def dipoles(self, top: Top) -> dict[tuple[int, int], Vector]:
        """The dipoles of the .int file."""
        return dict(self.moments)

    def other_moments(self, top: Top) -> tuple[Moment, ...]:
        """Further moments of the .int file."""
        return self.others

    def conserved_sums(self, top: Top) -> frozenset[str]:
        """The sums of angular momenta that IXX treats as conserved."""
        sums = ("n", *Scheme(self.coupled).names)
        return frozenset(name for bit, name in enumerate(sums) if self.ixx >> bit & 1)

    def k_limits(self, top: Top) -> dict[int, tuple[int, int]]:
        """KNMIN and KNMAX of states where they exclude K."""
        return dict(self.limits)

    def size_mhz(self, top: Top, j: int) -> float:
        """0: the size of the Hamiltonian of a file is not estimated."""
        return 0.0
