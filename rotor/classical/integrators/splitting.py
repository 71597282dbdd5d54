"""Splitting of the free Hamiltonian into flows that are rotations: three axes, or a sphere and two axes.

Order: 2, and 4, 6, 8 by composition (`compositions.py`). Conserves: the symplectic form, |L| and L in space, the length of
the quaternion, time reversal; the energy to the order of the step, without drift. Cost of one step of order 2 of one
body on one core, with compensated sums: about 0.2 µs; without them, in blocks of bodies (`batch.py`), 0.002 µs.
Order 4, 6, 8 cost 5, 9, 17 times as much.

Sources: J. Touma and J. Wisdom, Astron. J. 107, 1189 (1994); S. Reich, Fields Inst. Commun. 10, 181 (1996);
A. Dullweber, B. Leimkuhler, R. McLachlan, J. Chem. Phys. 107, 5840 (1997). On unit quaternions the first is the
NO_SQUISH of T. F. Miller et al., J. Chem. Phys. 116, 8649 (2002).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.classical.integrators.method import Composed, pieces, steps_per_call
from rotor.classical.system import System, acting_inverse
from rotor.classical.torque_form import kernels_are_compiled

_BASE = np.ones(1)
WORTH_LOADING = 4000  # drifts that take 0.1 s step by step, as long as loading the compiled form


@dataclass(frozen=True)
class RotationSplitting(Composed):
    """H = Σ L_i²/2I_i one term at a time: each turns the body about one axis at the steady rate L_i/I_i.

    The error grows with the differences of 1/I and does not vanish for symmetric tops or spheres. A linear rotor is
    refused: its own axis, left out of H, would take part in the turns about the others.

    >>> RotationSplitting(step=0.1, order=4).kick_fractions.size
    5
    """

    def drift(self, moments: Floats, state: Floats, carry: Floats, step: float, steps: int, whole: bool) -> None:
        """As `KickDrift.drift`: turns about axes 1, 2, 3, 2, 1.

        Raises ValueError for a linear rotor, which `SymmetricTopSplitting` steps.
        """
        from rotor.classical.integrators._step_kernels import rotations

        if np.any(moments == 0.0):
            raise ValueError("RotationSplitting cannot step a linear rotor; SymmetricTopSplitting does, exactly")
        inverse, gammas = acting_inverse(moments), self.kick_fractions if whole else _BASE
        for part in pieces(steps, len(state) * len(gammas)):
            rotations(state, carry, inverse, step, gammas, part)


@dataclass(frozen=True)
class SymmetricTopSplitting(Composed):
    """The sphere of the intermediate moment, and a rotation for the remainder of each of the other two axes.

    H = L²/2I_m + ½ (1/I_a - 1/I_m) L_a² + ½ (1/I_b - 1/I_m) L_b²; the sphere's flow commutes with the others (see
    `strang.py`). Together with the larger remainder it is a symmetric top, solved exactly, so that only the smaller remainder causes an
    error. Exact for spherical tops, linear rotors and symmetric tops.

    >>> from rotor.classical.integrators.method import integrate
    >>> motion = integrate(SymmetricTopSplitting(step=1.0), [2.0, 2.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0])
    >>> motion.momentum[-1].round(12).tolist()  # cos and -sin of (1/I3 - 1/I1) L3 t = ½
    [0.87758256189, -0.479425538604, 1.0]
    """

    def follow_compiled(self, system: System, times: Floats, counts: NDArray[np.int64], path: Floats) -> bool:
        """As `KickDrift.follow_compiled`, if all effects have a compiled form and the steps are many enough."""
        few = counts.sum() * len(self.kick_fractions) < WORTH_LOADING
        if system.free or system.compiled is None or few or not kernels_are_compiled():
            return False
        from rotor.classical.integrators._driven_kernels import kicked

        inverse = system.start_acting
        forms = system.compiled, inverse, turned_axes(inverse), self.kick_fractions
        state = path[0].copy(), np.zeros_like(path[0]), np.zeros((path.shape[1], 3))
        for place in _places(counts, steps_per_call(path.shape[1] * len(self.kick_fractions))):
            kicked(*forms, times, counts, path, state, place)
        return True

    def drift(self, moments: Floats, state: Floats, carry: Floats, step: float, steps: int, whole: bool) -> None:
        """As `KickDrift.drift`: half the larger remainder, the smaller one, half the larger one; the sphere for all steps at once."""
        from rotor.classical.integrators._step_kernels import symmetric

        inverse = acting_inverse(moments)
        gammas = self.kick_fractions if whole else _BASE
        for part in pieces(steps, len(state) * len(gammas)):
            symmetric(state, carry, inverse, turned_axes(inverse), step, gammas, part)


def _places(counts: NDArray[np.int64], most: int) -> Iterator[tuple[int, int, int, int]]:
    """Ranges of intervals, and of steps in each, for calls of at most about `most` steps."""
    if not counts.size:
        return
    several = max(1, most // int(counts.max()))  # intervals of a call
    for k in range(0, len(counts), several):
        longest = int(counts[k : k + several].max())
        for first in range(0, longest, most):
            yield k, min(k + several, len(counts)), first, first + most


def turned_axes(inverse: Floats) -> NDArray[np.int64]:
    """Axes (n, 3) of each body with inverse moments (n, 3): of the outer turn, the inner turn and the sphere.

    The sphere has the intermediate moment, the outer turn the larger remainder: of the six choices that with the smallest
    error for most motions, of size h² (outer² inner/24 + outer inner²/12).

    >>> turned_axes(np.array([[1.0, 0.8, 0.3]])).tolist()
    [[2, 0, 1]]
    """
    order = np.argsort(inverse, axis=-1, kind="stable")  # stable: equal moments keep the order of the axes
    low, middle, high = np.take_along_axis(inverse, order, axis=-1).T
    # the axis of the unlike moment first: about it the other two nearly form a symmetric top
    unlike = (high - middle < middle - low)[:, None]
    # where follows its arguments, which are in the order of columns
    return np.ascontiguousarray(np.where(unlike, order[:, [0, 2, 1]], order[:, [2, 0, 1]]))
