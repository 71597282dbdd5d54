"""The Hamiltonian of a .par or .var file as one effect: what its lines stand for among connected states."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

from rotor.formats.spcat.hamiltonian.coded_file import CodedLine
from rotor.formats.spcat.hamiltonian.entries import Connected, Entry
from rotor.formats.spcat.hamiltonian.l_doubled import Pair
from rotor.frozen import dataclass
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.moments import Moment
from rotor.quantum.spins import Scheme, Spin
from rotor.quantum.spins.operators import EVERY_STATE
from rotor.quantum.spins.scheme import SpinTerm
from rotor.quantum.states import Coupling, State
from rotor.tops.operators import Operators

if TYPE_CHECKING:
    from rotor.tops.top import Top

Vector = tuple[float, float, float]


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
