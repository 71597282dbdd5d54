"""Vibrational and tunnelling states beyond the top's own, and the operators that connect them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rotor.quantum.j_operators import JOperator
from rotor.tops.operators import Operators
from rotor.tops.spin_weights import SpinWeights

if TYPE_CHECKING:
    from rotor.tops.constants import Constants

OperatorOfJ = Callable[[int, str], JOperator]  # (J, representation) -> the operator in |J k⟩


@dataclass(frozen=True)
class State:
    """A state with a rotational Hamiltonian of its own.

    v: its number, 1 or more (0 is the top's own). operators: Σ c J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊ in MHz by (p, q, n), (0, 0, 0)
    being the energy of the state. spin_weights: None for those of the top. constants: what the operators were made from.
    """

    v: int
    operators: Operators
    spin_weights: SpinWeights | None = None
    constants: Constants | None = None


@dataclass(frozen=True)
class Coupling:
    """A Hermitian operator between states, value · (|bra⟩⟨ket| ⊗ O + Hermitian conjugate); O alone where bra is ket.

    bra, ket: numbers v. value: MHz. operator: O of one J in |J k⟩ of a representation. An operator that time reversal changes
    in sign (an odd power of J) enters with the factor i, which belongs to O.
    """

    name: str
    bra: int
    ket: int
    value: float
    operator: OperatorOfJ
