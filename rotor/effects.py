"""The face that every effect shows, nothing else.

An effect is one object in one file. Levels and integrators take a list of effects and pay only for those they
are given; registering one is naming it in that list.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rotor.top import Top


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


class ClassicalEffect(ABC):
    """A torque or a change of the equations of motion dm/dt = m × ω + torque, in the body's principal axes."""

    conserves_energy: bool = False
    conserves_momentum: bool = False

    @abstractmethod
    def torque(
        self,
        time: float,
        momentum: NDArray[np.float64],
        attitude: NDArray[np.float64],
        moments: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Torque on the body, (..., 3) in body axes, from momentum (..., 3) in body axes and attitude (..., 4)."""

    def energy(self, time: float, attitude: NDArray[np.float64]) -> Any:
        """Potential energy (...,) that goes with the torque; zero for an effect that has none."""
        return 0.0
