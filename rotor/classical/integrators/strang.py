"""The step of the symmetric-top splitting, shared by the kernels for single bodies and for blocks of bodies.

With the moment I_s of a sphere taken out, the energy of a free top is

    H = L²/2I_s + ½ (1/I_a - 1/I_s) L_a² + ½ (1/I_b - 1/I_s) L_b² .

|L|² commutes with all functions of L, so that the sphere's flow commutes with those of the remainders and is applied once for all
steps: a steady rotation about L in space at |L|/I_s. The flow of a remainder rotates the body about its axis at the rate
(1/I_a - 1/I_s) L_a, with L_a constant. A step is half an outer turn (axis a), an inner turn (axis b), half an outer turn (G. Strang,
SIAM J. Numer. Anal. 5, 506 (1968)); neighbouring halves are merged.

These are plain functions of numbers; kernels compile them (`rotor.classical._kernels`). The implementation of a turn differs: single
bodies use compensated sums, blocks of bodies are vectorised.
"""

from __future__ import annotations

from typing import Any


def remainders(inverse_outer: Any, inverse_inner: Any, inverse_sphere: Any) -> Any:
    """Rates of the outer and the inner turn per unit of L along their axes, 1/I - 1/I_s each.

    >>> remainders(2.0, 1.5, 1.0)
    (1.0, 0.5)
    """
    return inverse_outer - inverse_sphere, inverse_inner - inverse_sphere


def symmetric_steps(turns: Any, state: Any, fractions: Any, step: Any, steps: Any) -> None:
    """`steps` steps of length `step`, each composed of base steps of the given fractions of it.

    Parameters
    ----------
    turns : function
        `turns(state, inner, outer)` applies the inner turn for the time `inner`, then the outer one for the time `outer`,
        in place.
    state
        Passed on to `turns`.
    fractions : sequence of float
        Fractions of a composition (`compositions.py`); (1.0,) for a step of order 2.
    step, steps : float, int
        Length and number of the steps.

    Examples
    --------
    >>> symmetric_steps(lambda state, inner, outer: print(inner, outer), None, [1.0], 0.5, 2)
    0.0 0.25
    0.5 0.5
    0.5 0.25
    """
    before, k = 0.0, 0
    for left in range(steps * len(fractions), -1, -1):
        now = fractions[k] * step if left > 0 else 0.0
        turns(state, before, 0.5 * (before + now))  # neighbouring half steps are one turn
        before, k = now, k + 1 if k + 1 < len(fractions) else 0
