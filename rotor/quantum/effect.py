"""The face of a quantum effect.

An effect is one object in one file of `rotor.quantum.effects`. Levels take a list of effects and compute only what is
in it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rotor.tops.top import Top


class QuantumEffect(ABC):
    """A term of the rotational Hamiltonian.

    A term is a sum of operators ½[Jz^2q, J₊^2n + J₋^2n]₊ J^2p (n = 0: Jz^2q J^2p), which is what any effective
    Hamiltonian of a semi-rigid top in one vibrational state consists of. Effects that need a larger basis
    (nuclear spin, fields) will extend the face by the basis they ask for.
    """

    @abstractmethod
    def operators(self, top: Top) -> dict[tuple[int, int, int], float]:
        """Coefficients in MHz, keyed by the powers (p, q, n) above."""

    @abstractmethod
    def estimate_mhz(self, top: Top, j: int) -> float:
        """How large the effect is for levels of angular momentum `j`, in MHz; rough, never an underestimate by 10."""
