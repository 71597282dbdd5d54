"""Vibrational and tunnelling states beyond the top's own, and the operators that connect them."""

from __future__ import annotations

from rotor.frozen import dataclass
from rotor.quantum.operators.algebra import Operator
from rotor.quantum.wang.basis import SpeciesFactors
from rotor.tops.operators import Operators, added
from rotor.tops.spins.spin_weights import SpinWeights


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

    bra, ket: numbers v of states. operator: O on |J K⟩ of a representation, which leaves J alone. An operator that time reversal changes
    in sign (an odd power of J) has a factor i, which belongs to O. factors: what its elements between Wang blocks are multiplied with.
    """

    name: str
    bra: int
    ket: int
    operator: Operator
    factors: SpeciesFactors | None = None
