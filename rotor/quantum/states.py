"""Vibrational and tunnelling states beyond the top's own, and the operators that connect them."""

from __future__ import annotations

from collections.abc import Callable

from rotor.frozen import dataclass
from rotor.quantum.wang.j_operators import JOperator
from rotor.tops.operators import Operators, added
from rotor.tops.spins.spin_weights import SpinWeights

OperatorOfJ = Callable[[int, str], JOperator]  # (J, representation) -> the operator in |J k⟩


@dataclass(frozen=True)
class State:
    """A state with a rotational Hamiltonian of its own, Σ c O over named parameters c of the effect that brings it.

    v: its number, 1 or more (0 is the top's own). terms: for each parameter the operators J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊ that
    it multiplies, by powers (p, q, n); (0, 0, 0) is the unit operator, that of the energy of the state. spin_weights: None for those of
    the top.
    """

    v: int
    terms: dict[str, Operators]
    spin_weights: SpinWeights | None = None

    def operators(self, values: dict[str, float]) -> Operators:
        """The terms times the values of the parameters, added."""
        return added((terms, values[name]) for name, terms in self.terms.items())


@dataclass(frozen=True)
class Coupling:
    """What the parameter `name` of an effect multiplies: |bra⟩⟨ket| ⊗ O + Hermitian conjugate; O alone where bra is ket.

    bra, ket: numbers v of states. operator: O of one J in |J k⟩ of a representation. An operator that time reversal changes
    in sign (an odd power of J) has a factor i, which belongs to O.
    """

    name: str
    bra: int
    ket: int
    operator: OperatorOfJ
