"""Splitting of the free Hamiltonian into flows that are rotations: three axes, or a symmetric top and a remainder.

Order: 2, and 4, 6, 8 by composition (`compositions.py`). Keeps: the symplectic form, |L| and L in space, the length of
the quaternion, time reversal; the energy to the order of the step, without drift. Cost of one step of order 2 of one
body on one core, with compensated sums: about 0.2 µs; without them, in blocks of bodies (`many.py`), 0.01 µs.
Order 4, 6, 8 cost 5, 9, 17 times as much.

Sources: J. Touma and J. Wisdom, Astron. J. 107, 1189 (1994); S. Reich, Fields Inst. Commun. 10, 181 (1996);
A. Dullweber, B. Leimkuhler, R. McLachlan, J. Chem. Phys. 107, 5840 (1997). On unit quaternions the first is the
NO_SQUISH of T. F. Miller et al., J. Chem. Phys. 116, 8649 (2002).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotor.classical.compositions import fractions
from rotor.classical.integrators import KickDrift
from rotor.classical.system import acting_inverse
from rotor.rotations import Array

_BASE = np.ones(1)
_CYCLES = np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1]])


@dataclass(frozen=True)
class RotationSplitting(KickDrift):
    """H = Σ L_i²/2I_i one term at a time: each turns the body about one axis at the steady rate L_i/I_i.

    The error grows with the differences of 1/I and does not vanish for symmetric tops or spheres. A linear rotor is
    refused: its own axis, left out of H, would take part in the turns about the others.

    >>> RotationSplitting(step=0.1, order=4).kick_fractions.size
    5
    """

    order: int = 2

    def __post_init__(self) -> None:
        super().__post_init__()
        fractions(self.order)

    @property
    def kick_fractions(self) -> Array:
        """Fractions of the composition, the same for the free steps."""
        return fractions(self.order)

    def drift(self, moments: Array, state: Array, carry: Array, step: float, steps: int, whole: bool) -> None:
        """Turns about axes 1, 2, 3, 2, 1."""
        from rotor.classical._step_kernels import rotations

        if np.any(moments == 0.0):
            raise ValueError("RotationSplitting cannot step a linear rotor; SymmetricTopSplitting does, exactly")
        rotations(state, carry, acting_inverse(moments), step, self.kick_fractions if whole else _BASE, steps)


@dataclass(frozen=True)
class SymmetricTopSplitting(KickDrift):
    """The symmetric top whose equal moments are nearest to each other, solved exactly, and a turn for the remainder.

    Exact for spheres, linear rotors and symmetric tops; the error is proportional to the asymmetry 1/I_a - 1/I_b of the
    two moments that are nearest, so this is the splitting for nearly symmetric tops.

    >>> from rotor.classical.integrators import integrate
    >>> motion = integrate(SymmetricTopSplitting(step=1.0), [2.0, 2.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0])
    >>> motion.momentum[-1].round(12).tolist()  # cos and -sin of (1/I3 - 1/I1) L3 t = ½
    [0.87758256189, -0.479425538604, 1.0]
    """

    order: int = 2

    def __post_init__(self) -> None:
        super().__post_init__()
        fractions(self.order)

    @property
    def kick_fractions(self) -> Array:
        """Fractions of the composition, the same for the free steps."""
        return fractions(self.order)

    def drift(self, moments: Array, state: Array, carry: Array, step: float, steps: int, whole: bool) -> None:
        """Half the remainder, the symmetric top, half the remainder."""
        from rotor.classical._step_kernels import symmetric

        inverse = acting_inverse(moments)
        gammas = self.kick_fractions if whole else _BASE
        symmetric(state, carry, inverse, symmetric_axes(inverse), step, gammas, steps)


def symmetric_axes(inverse: Array) -> NDArray[np.int64]:
    """Cyclic axes (k, a, b) per body (n, 3) with 1/I_a and 1/I_b (n, 3) the nearest pair."""
    gaps = np.stack([np.abs(inverse[:, a] - inverse[:, b]) for _, a, b in _CYCLES], axis=-1)
    return np.ascontiguousarray(_CYCLES[np.argmin(gaps, axis=-1)])
