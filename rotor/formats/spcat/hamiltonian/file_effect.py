"""The Hamiltonian of a .par or .var file as one effect, with parameter lines by code and the states and spins of the file."""

from __future__ import annotations

from dataclasses import field, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from rotor.formats.spcat.hamiltonian.coded_file import CodedLine
from rotor.formats.spcat.hamiltonian.codes import AXES, NOT_YET, basis_of
from rotor.formats.spcat.hamiltonian.l_doubled import Pair, RealPart, over_real_states, turned_operator, turned_rotor
from rotor.formats.spcat.hamiltonian.phases import half_turned
from rotor.formats.spcat.hamiltonian.symmetry import SpeciesPairs
from rotor.frozen import dataclass
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.moments import Moment
from rotor.quantum.spins import Scheme, Spin
from rotor.quantum.spins.operators import EVERY_STATE, ByElements, BySpecies, Cosines, CosinesWithN, Scalar
from rotor.quantum.spins.scheme import SpinTerm
from rotor.quantum.spins.stack_elements import elements_of_pair
from rotor.quantum.states import Coupling, State
from rotor.quantum.wang.basis import SpeciesFactors, factors_of_pairs, wang_blocks
from rotor.tops.operators import Operators

if TYPE_CHECKING:
    from rotor.tops.top import Top

Vector = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class FileEffect(QuantumEffect):
    """The parameter lines of a file for a group of its states, which are numbered here from 0.

    lines: with state numbers of the group, None for all of its `count` states. coupled: the spins by place. moments: dipoles in debye
    by pairs of states. limits: smallest and largest K by state. others: moments of other kinds. ixx: bits for conserved sums of angular
    momenta, from N on. pairs: l-doubled states. axes: the axes x, y, z. turned: the axis g of `phases` whose half turn accompanies time
    reversal, if an operator within one state is odd under it. apart: species with elements by pairs of states, where weights forbid others.
    """

    name: ClassVar[str] = ""
    conserved: ClassVar[frozenset[str]] = frozenset()

    lines: tuple[CodedLine, ...]
    count: int
    coupled: tuple[Spin, ...]
    moments: dict[tuple[int, int], Vector]
    limits: dict[int, tuple[int, int]]
    others: tuple[Moment, ...] = ()
    ixx: int = 0
    pairs: tuple[Pair, ...] = ()
    axes: str = AXES["Ir"]
    turned: str = ""
    apart: dict[tuple[int, int], SpeciesPairs] = field(default_factory=dict)

    def parameters(self, top: Top) -> dict[str, float]:
        """Values in MHz by code and number of the line."""
        return {line.name: line.parameter.value for line in self.lines}

    def operators(self, top: Top) -> dict[str, Operators]:
        """The operators of the first state."""
        return self._plain(0)

    def _plain(self, v: int) -> dict[str, Operators]:
        """Operators of a state that have powers (p, q, n), by parameter."""
        # parameters refer to the first state of a pair
        named = next((pair.first for pair in self.pairs if pair.second == v), v)
        return {
            line.name: line.operator.plain
            for line in self.lines
            if line.operator.plain is not None and line.states in (None, (named, named))
        }

    def states(self, top: Top) -> tuple[State, ...]:
        """The states beyond the first."""
        return tuple(State(v, self._plain(v)) for v in range(1, self.count))

    def couplings(self, top: Top, representation: str) -> tuple[Coupling, ...]:
        """Interactions of states, and operators of one state that have no powers (p, q, n)."""
        couplings = list[Coupling]()
        for line in self.lines:
            operator, states = line.operator, line.states
            if operator.rotor is not None:
                continue
            if states and self._has_pairs(states):
                if line.is_between or operator.plain is None:  # else with the operators of both components
                    turned = turned_operator(operator.alone)
                    couplings += [
                        Coupling(
                            line.name, part.bra, part.ket, part.factor * (turned if part.turned else operator.alone)
                        )
                        for part in self._real_parts(line, states)
                    ]
            elif operator.of_n is not None or line.is_between:
                factors = half_turned(self.turned, operator.odd) if self._is_turned(line) else None
                pairs = [states] if states else [(v, v) for v in range(self.count)]
                couplings += [Coupling(line.name, *pair, operator.alone, factors) for pair in pairs]
        return tuple(replace(each, factors=self._restricted(each)) for each in couplings)

    def _restricted(self, coupling: Coupling) -> SpeciesFactors | None:
        """The factors of a coupling, 0 between levels of unequal weights."""
        pairs = self.apart.get((coupling.bra, coupling.ket))
        if pairs is None:
            return coupling.factors
        between = np.array(factors_of_pairs(pairs)) * (1.0 if coupling.factors is None else np.array(coupling.factors))
        return tuple(map(tuple, between.tolist()))

    def _has_pairs(self, states: tuple[int, int]) -> bool:
        """Whether one of two states is l-doubled."""
        return any(v in states for pair in self.pairs for v in pair)

    def _is_turned(self, line: CodedLine) -> bool:
        """Whether a half turn about the axis of the phases changes the sign of the operator of a line."""
        return bool(self.turned) and line.symmetry.axis not in ("", self.turned)

    def _real_parts(self, line: CodedLine, states: tuple[int, int], what: str = "operator") -> list[RealPart]:
        """Parts of a line with l-doubled states over real states."""
        try:
            return over_real_states(states, line.operator.odd, line.reversed_, self.pairs, self.axes, what)
        except ValueError as error:
            raise ValueError(f"parameter {line.parameter.code}: {error}") from None

    def spins(self, top: Top) -> tuple[Spin, ...]:
        """The spins, in the order of the file."""
        return self.coupled

    def spin_terms(self, top: Top) -> tuple[SpinTerm, ...]:
        """The lines with spins."""
        terms = []
        for line in self.lines:
            o, states = line.operator, line.states
            if o.rotor is not None:
                names = tuple(self.coupled[place - 1].name for place in o.spins)
                bra, ket = states or (EVERY_STATE, EVERY_STATE)
                rotor = o.rotor
                if self._is_turned(line):
                    assert isinstance(rotor, ByElements | Cosines | CosinesWithN)
                    rotor = BySpecies(rotor, half_turned(self.turned, o.odd), False)
                elif o.odd and bra == ket:  # of an l-doubled pair, between its components
                    ket = next(pair.second if bra == pair.first else pair.first for pair in self.pairs if bra in pair)
                term = SpinTerm(line.name, names, rotor, 1.0, o.n2, o.nz2, o.ns, bra, ket)
                for part in self._by_exchange(term, line.exchange):
                    terms += self._at_pairs(line, states, part)
        return tuple(self._restricted_term(term) for term in terms)

    def _restricted_term(self, term: SpinTerm) -> SpinTerm:
        """A spin term without elements between levels of unequal weights."""
        pairs, rotor = self.apart.get((term.bra, term.ket)), term.rotor
        if pairs is None or isinstance(rotor, Scalar):
            return term
        basis = basis_of(self.axes)
        blocks = wang_blocks(_LOOKED_AT, basis)
        beyond = (
            elements_of_pair(rotor, up, low, basis)
            for up in blocks
            for low in blocks
            if (up.species, low.species) not in pairs
        )
        forbidden = any(elements is not None and elements.any() for elements in beyond)
        return replace(term, rotor=BySpecies(rotor, factors_of_pairs(pairs), rotor.odd)) if forbidden else term

    def _by_exchange(self, term: SpinTerm, exchange: int) -> list[SpinTerm]:
        """The part of a term that is even, or odd, under the exchange of the last two spins."""
        last = [spin.name for spin in self.coupled[-2:]]
        touched = set(term.spins) & set(last)
        if not exchange or not touched:
            return [term]
        if len(touched) == 2:  # the product of both, which is even
            return [term] if exchange > 0 else []
        other = {last[0]: last[1], last[1]: last[0]}
        turned = tuple(other.get(name, name) for name in term.spins)
        return [replace(term, factor=term.factor / 2), replace(term, spins=turned, factor=exchange * term.factor / 2)]

    def _at_pairs(self, line: CodedLine, states: tuple[int, int] | None, term: SpinTerm) -> list[SpinTerm]:
        """Terms of a line with a spin and l-doubled states."""
        if not states or not self._has_pairs(states):
            return [term]
        if isinstance(term.rotor, ByElements):
            raise ValueError(
                f"parameter {line.parameter.code}: a spin term of higher order or of a series, of l-doubled states, {NOT_YET}"
            )
        turned = turned_rotor(term.rotor, self.axes)
        return [
            replace(term, bra=part.bra, ket=part.ket, factor=term.factor * part.factor, rotor=rotor)
            for part in self._real_parts(line, states, "spin operator")
            if (rotor := turned if part.turned else term.rotor) is not None
        ]

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


_LOOKED_AT = 5  # N at which all elements of a file's operators exist
