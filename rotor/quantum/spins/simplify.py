"""Treatment of spins: exact, with N as a good quantum number, or to first order; and the error of each.

    exact           all N and all rotational states that a tensor connects
    N-diagonal      elements between different N neglected
    first-order     elements between different rotational states neglected too; several spins are still coupled with each other

`neglected` bounds the shifts of levels. The error of a line is at most the sum for its two states.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotor.quantum.effect import QuantumEffect
from rotor.quantum.hyperfine_method import EXACT, FIRST_ORDER, N_DIAGONAL, HyperfineMethod
from rotor.quantum.levels import Used
from rotor.quantum.spins.blocks import Plan
from rotor.quantum.spins.contraction import Contracted


def simplified(plan: Plan, effects: Sequence[QuantumEffect], all_f: Sequence[int]) -> Plan:
    """The plan with the elements of the requested treatment; unchanged if none is requested."""
    requested = next((effect for effect in effects if isinstance(effect, HyperfineMethod)), None)
    if requested is None:
        return plan
    if plan.scheme.equivalent == 3 and requested.method not in (EXACT, "auto"):
        raise ValueError(
            f"method {requested.method} with a total spin of three nuclei: only the exact method computes them"
        )
    if requested.method == EXACT or plan.scheme.equivalent == 3:
        return plan.with_method(Used(EXACT, 0.0, requested.tolerance_mhz))
    from rotor.quantum.spins.neglected import largest_shifts

    other_n, same_n = largest_shifts(plan)
    estimates = {FIRST_ORDER: 2 * (other_n + same_n), N_DIAGONAL: 2 * other_n, EXACT: 0.0}
    chosen = requested.method
    if chosen == "auto":
        chosen = next(name for name, size in estimates.items() if size <= requested.tolerance_mhz)
    used = Used(chosen, estimates[chosen], requested.tolerance_mhz)
    if chosen == EXACT:
        return plan.with_method(used)
    return plan.with_method(
        used, [(_without_neglected(contracted, chosen), channels) for contracted, channels in plan.contracted]
    )


def _without_neglected(contracted: Sequence[Contracted], method: str) -> list[Contracted]:
    """Operators without elements that a treatment neglects."""
    same_n = [entry for entry in contracted if not entry.pairs.rise]
    if method == N_DIAGONAL:
        return same_n
    diagonal = [entry for entry in same_n if entry.up is entry.low]
    return [entry._replace(matrices=entry.matrices * np.eye(entry.matrices.shape[1])) for entry in diagonal]
