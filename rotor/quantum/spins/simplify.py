"""How spins are treated: exactly, with N as a good quantum number, or to first order; and what that neglects.

    exact           all N and all rotational states that a tensor connects
    N-diagonal      elements between different N left out
    first-order     elements between different rotational states left out too; several spins are still coupled with each other

Whose levels differ by how much from exact ones is bounded in `neglected`. A line may be off by as much for each of its two states.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotor.quantum.effect import QuantumEffect
from rotor.quantum.hyperfine_method import EXACT, FIRST_ORDER, N_DIAGONAL, HyperfineMethod
from rotor.quantum.levels import Used
from rotor.quantum.spins.blocks import Plan
from rotor.quantum.spins.contraction import Contracted
from rotor.quantum.spins.neglected import largest_shifts


def simplified(plan: Plan, effects: Sequence[QuantumEffect], every_f: Sequence[int]) -> Plan:
    """A plan with the elements alone that the method asked for has; the plan itself where none was."""
    asked = next((effect for effect in effects if isinstance(effect, HyperfineMethod)), None)
    if asked is None:
        return plan
    if plan.shared.scheme.equivalent == 3 and asked.method not in (EXACT, "auto"):
        raise ValueError(
            f"method {asked.method} with a total spin of three nuclei: they are computed by the exact one alone"
        )
    if asked.method == EXACT or plan.shared.scheme.equivalent == 3:
        return plan.with_method(Used(EXACT, 0.0, asked.tolerance_mhz))
    other_n, same_n = largest_shifts(plan)
    estimates = {FIRST_ORDER: 2 * (other_n + same_n), N_DIAGONAL: 2 * other_n, EXACT: 0.0}
    chosen = asked.method
    if chosen == "auto":
        chosen = next(name for name, size in estimates.items() if size <= asked.tolerance_mhz)
    used = Used(chosen, estimates[chosen], asked.tolerance_mhz)
    if chosen == EXACT:
        return plan.with_method(used)
    return plan.with_method(used, [(_of_one_n(found, chosen), of) for found, of in plan.contracted])


def _of_one_n(every: Sequence[Contracted], method: str) -> list[Contracted]:
    """The same of operators in stacks."""
    found = [one for one in every if not one.pairs.rise]
    if method == N_DIAGONAL:
        return found
    alone = [one for one in found if one.up is one.low]
    return [one._replace(matrices=one.matrices * np.eye(one.matrices.shape[1])) for one in alone]
