"""How spins are treated: exactly, with N as a good quantum number, or to first order; and what that neglects.

    exact           all N and all rotational states that a tensor connects
    N-diagonal      elements between different N left out
    first-order     elements between different rotational states left out too; several spins are still coupled with each other

What an element V between two states apart by Δ does is estimated as for two levels, [√(Δ² + 4V²) - |Δ|]/2, added over all elements of
a state; V is bounded by the largest coefficient of coupling of the F. A line may be off by as much for each of its two states.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.spins.blocks import Operators, Plan, coefficients_of
from rotor.quantum.spins.method import EXACT, FIRST_ORDER, N_DIAGONAL, HyperfineMethod, Used


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
    other_n, same_n = largest_shifts(plan, every_f)
    estimates = {FIRST_ORDER: 2 * (other_n + same_n), N_DIAGONAL: 2 * other_n, EXACT: 0.0}
    chosen = asked.method
    if chosen == "auto":
        chosen = next(name for name, size in estimates.items() if size <= asked.tolerance_mhz)
    used = Used(chosen, estimates[chosen], asked.tolerance_mhz)
    return plan.with_method(used, _remaining(plan, chosen))


def _remaining(plan: Plan, method: str) -> Operators | None:
    """The operators that a method has; None for all of them."""
    blocks = plan.blocks
    if method == N_DIAGONAL:
        return {pair: found for pair, found in plan.operators.items() if blocks[pair[0]].n == blocks[pair[1]].n}
    if method == FIRST_ORDER:
        alone = {pair: found for pair, found in plan.operators.items() if pair[0] == pair[1]}
        return {pair: {c: np.diag(np.diag(x)) for c, x in found.items()} for pair, found in alone.items()}
    return None


def largest_shifts(plan: Plan, every_f: Sequence[int]) -> tuple[float, float]:
    """The largest shift of a level in MHz by elements between different N, and by those between other states of one N."""
    scheme, largest = plan.shared.scheme, np.zeros(2)
    channels = {channel for operators in plan.operators.values() for channel in operators}
    for twice_f in every_f:
        every = scheme.patterns(twice_f)
        of_n = {int(n) // 2: every[:, 0] == n for n in np.unique(every[:, 0])}
        known = {channel: np.abs(coefficients_of(scheme, channel, every)) for channel in channels}
        bound: dict[Any, float] = {}
        shifts: dict[int, Floats] = {}
        for (i, k), found in plan.operators.items():
            m, n = plan.blocks[i].n, plan.blocks[k].n
            if m not in of_n or n not in of_n:
                continue
            element = np.zeros((len(plan.blocks[i].energies_mhz), len(plan.blocks[k].energies_mhz)))
            for channel, operator in found.items():
                key = (channel, m, n)
                if key not in bound:
                    bound[key] = float(known[channel][np.ix_(of_n[m], of_n[n])].max())
                element += bound[key] * np.abs(operator)
            _add_shifts(shifts, plan, (i, k), element)
        largest = np.maximum(largest, np.max([own.max(axis=1) for own in shifts.values()], axis=0, initial=0.0))
    return float(largest[0]), float(largest[1])


def _add_shifts(shifts: dict[int, Floats], plan: Plan, pair: tuple[int, int], element: Floats) -> None:
    """Adds what elements between two blocks do to their states: (2, states), by other N and by the same N."""
    i, k = pair
    if i == k:
        np.fill_diagonal(element, 0.0)
    apart = np.abs(plan.blocks[i].energies_mhz[:, None] - plan.blocks[k].energies_mhz)
    shift = 2 * element**2 / (np.sqrt(apart**2 + 4 * element**2) + apart + np.finfo(float).tiny)
    row = int(plan.blocks[i].n == plan.blocks[k].n)
    for number, axis in ((i, 1), (k, 0)) if i != k else ((i, 1),):
        own = shifts.setdefault(number, np.zeros((2, len(plan.blocks[number].energies_mhz))))
        own[row] += shift.sum(axis=axis)
