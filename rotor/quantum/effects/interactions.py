"""Several vibrational or tunnelling states with their constants, and Coriolis and Fermi terms between them.

    ⟨v|H|v'⟩ = Σ i G_a N_a + Σ F_bc {N_b, N_c} + W,     v < v',     [N_a, N_b] = -i N_c

and the Hermitian conjugate for v' < v. G has a factor i because N changes sign under time reversal; the sign convention is that of SPFIT
(measured: the other sign of G relative to F shifts levels by 0.01 cm⁻¹ at J = 15). Parameters, MHz: E[1] and any constant of the top with a
state, A[1], DeltaJK[1]; between states G_a[0,1], F_bc[0,1], W[0,1], W_pm2[0,1] (with N₊² + N₋²), each with powers as half anticommutators,
G_c_J[0,1] with N², F_ab_K[0,1] with Nz². A state has only the constants that are stated for it; none is copied from v = 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar, Self

from rotor.frozen import dataclass
from rotor.quantum.effect import Coupling, QuantumEffect, State
from rotor.quantum.effects.watson import operators_of_name
from rotor.quantum.operators.algebra import UNIT, Operator, half_anticommutator
from rotor.quantum.operators.rotation import components, ladders, with_powers
from rotor.tops.constants.operators import Operators
from rotor.tops.constants.parameter_names import parse_name
from rotor.tops.spins.spin_weights import SpinWeights

if TYPE_CHECKING:
    from rotor.tops.top import Top

Vector = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class InteractingStates(QuantumEffect):
    """States v ≥ 1 and their interactions, by parameters with states in square brackets.

    values: MHz by name. weights: spin weights of states that differ from those of v = 0. moments: dipoles (a, b, c) in debye by pairs of
    states (v', v); those between states are real in the phases of the couplings.
    """

    name: ClassVar[str] = "interacting states"
    conserved: ClassVar[frozenset[str]] = frozenset({"j"})

    values: Mapping[str, float]
    weights: Mapping[int, SpinWeights] = field(default_factory=dict)
    moments: Mapping[tuple[int, int], Vector] = field(default_factory=dict)

    def __post_init__(self) -> None:
        names = {}
        for name, value in self.values.items():
            if state_of_constant(name):
                names[name] = float(value)
            else:
                names[_coupling(name, "Ir").name] = float(value)
        object.__setattr__(self, "values", MappingProxyType(names))
        moments = {(max(pair), min(pair)): tuple(vector) for pair, vector in self.moments.items()}
        object.__setattr__(self, "moments", MappingProxyType(moments))
        object.__setattr__(self, "weights", MappingProxyType(dict(self.weights)))

    def __reduce__(self) -> tuple[type[Self], tuple[object, ...]]:
        return type(self), (dict(self.values), dict(self.weights), dict(self.moments))

    def parameters(self, top: Top) -> dict[str, float]:
        """The values in MHz."""
        return dict(self.values)

    def states(self, top: Top) -> tuple[State, ...]:
        """The states that have a constant."""
        terms: dict[int, dict[str, Operators]] = {}
        for name in self.values:
            if state := state_of_constant(name):
                constant, v = state
                terms.setdefault(v, {})[name] = (
                    {(0, 0, 0): 1.0} if constant == "E" else operators_of_name(top.constants, constant)
                )
        return tuple(State(v, terms[v], self.weights.get(v)) for v in sorted(terms))

    def couplings(self, top: Top, representation: str) -> tuple[Coupling, ...]:
        """The parameters between two states."""
        return tuple(_coupling(name, representation) for name in self.values if not state_of_constant(name))

    def dipoles(self, top: Top) -> dict[tuple[int, int], Vector]:
        """The dipoles by pairs of states."""
        return dict(self.moments)

    def size_mhz(self, top: Top, j: int) -> float:
        """The largest coupling at K = J."""
        sizes = [0.0]
        for name, value in self.values.items():
            if not state_of_constant(name):
                parts = parse_name(name)
                order = {"G": 1, "F": 2}.get(parts.symbol[0], 2 * ("pm" in parts.symbol)) + 2 * (parts.n2 + parts.nz2)
                sizes.append(abs(value) * max(j, 1) ** order)
        return max(sizes)


def state_of_constant(name: str) -> tuple[str, int] | None:
    """The constant and the state of a name such as A[1]; None for an interaction of two states.

    >>> state_of_constant("DeltaJK[2]"), state_of_constant("G_c[0,1]")
    (('DeltaJK', 2), None)
    """
    head, bracket, tail = name.partition("[")
    if not bracket or not tail.endswith("]") or "," in tail:
        return None
    number = tail[:-1].strip()
    if not number.isdigit() or int(number) < 1:
        raise ValueError(f"{name}: states are numbered from 1; 0 is the top's own, whose constants have no brackets")
    return head.strip(), int(number)


_ORDERS = {"pm2": 1, "pm4": 2, "pm6": 3}


def _coupling(name: str, representation: str) -> Coupling:
    """The interaction of two states that a parameter multiplies."""
    parts = parse_name(name)
    if parts.states is None or parts.states[0] == parts.states[1] or parts.spins or parts.ns:
        raise ValueError(f"{name}: an interaction connects two states, in square brackets, as in G_c[0,1]")
    kind, _, letters = parts.symbol.partition("_")
    letters_of_kind = {"G": ("a", "b", "c"), "F": ("bc", "ac", "ab"), "W": ("", *_ORDERS)}
    if letters not in letters_of_kind.get(kind, ()):
        spelled = ", ".join(f"{k}_{x}" if x else k for k, names in letters_of_kind.items() for x in names)
        raise ValueError(f"{name}: interactions between states are {spelled}")
    operator = with_powers(_plain(kind, letters, representation), parts.n2, parts.nz2)
    return Coupling(parts.text, parts.states[0], parts.states[1], operator)


def _plain(kind: str, letters: str, representation: str) -> Operator:
    """The operator of an interaction without powers."""
    if kind == "W":
        return ladders(_ORDERS[letters]) if letters else UNIT
    along = components(representation)
    return 1j * along[letters] if kind == "G" else 2.0 * half_anticommutator(along[letters[0]], along[letters[1]])
