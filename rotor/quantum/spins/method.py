"""How spins are treated: exactly, with N as a good quantum number, or to first order; and what that neglects.

    exact           all N and all rotational states that a tensor connects
    N-diagonal      elements between different N left out
    first-order     elements between different rotational states left out too; several spins are still coupled with each other

What an element V between two states apart by Δ does is estimated as for two levels, [√(Δ² + 4V²) - |Δ|]/2, added over all elements of
a state; V is bounded by the largest coefficient of coupling of the F. A line may be off by as much for each of its two states.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rotor.arrays import Floats
from rotor.checks import require_one_of, require_positive
from rotor.quantum.effect import QuantumEffect

if TYPE_CHECKING:
    from rotor.quantum.levels import Levels
    from rotor.quantum.spins.blocks import Plan
    from rotor.quantum.spins.rotor import Channel
    from rotor.quantum.spins.terms import Spin
    from rotor.tops.top import Top

METHODS = ("auto", "exact", "N-diagonal", "first-order")
EXACT, N_DIAGONAL, FIRST_ORDER = "exact", "N-diagonal", "first-order"
TOLERANCE_MHZ = 1e-4


@dataclass(frozen=True)
class Used:
    """The method of a calculation, and by how much its lines may differ from exact ones, in MHz."""

    method: str
    estimate_mhz: float
    tolerance_mhz: float


@dataclass(frozen=True)
class HyperfineMethod(QuantumEffect):
    """Which method is asked for: "exact", "N-diagonal", "first-order", or "auto", the cheapest that is estimated to keep a tolerance.

    coupled: the spins that the other effects couple.
    """

    method: str
    tolerance_mhz: float
    coupled: tuple[Spin, ...]
    name: ClassVar[str] = "hyperfine method"
    conserved: ClassVar[frozenset[str]] = frozenset()

    def __post_init__(self) -> None:
        require_one_of("hyperfine", self.method, METHODS)
        require_positive("tolerance_mhz", self.tolerance_mhz)

    def parameters(self, top: Top) -> dict[str, float]:
        """None: it is a choice."""
        return {}

    def size_mhz(self, top: Top, j: int) -> float:
        """None."""
        return 0.0

    def spins(self, top: Top) -> tuple[Spin, ...]:
        """Those of the effects that it is about."""
        return self.coupled


def used_method(levels: Levels) -> Used | None:
    """What was used for levels with spins; None without spins, and where nothing was asked, which means exact."""
    shared = getattr(levels.blocks[0], "shared", None) if levels.blocks else None
    found: Used | None = getattr(shared, "used", None)
    return found


def hyperfine_facts(top: Top, levels: Levels) -> dict[str, Any] | None:
    """Method, estimate and tolerance by the keys of docs/command_line.md; None for levels without spins."""
    if not any(effect.spins(top) for effect in levels.effects):
        return None
    return asdict(used_method(levels) or Used(EXACT, 0.0, TOLERANCE_MHZ))


def simplified(plan: Plan, effects: Sequence[QuantumEffect], every_f: Sequence[int]) -> Plan:
    """A plan with the elements alone that the method asked for has; the plan itself where none was."""
    asked = next((effect for effect in effects if isinstance(effect, HyperfineMethod)), None)
    if asked is None:
        return plan
    if asked.method == EXACT:
        return plan.with_method(Used(EXACT, 0.0, asked.tolerance_mhz), plan.operators)
    other_n, same_n = largest_shifts(plan, every_f)
    estimates = {FIRST_ORDER: 2 * (other_n + same_n), N_DIAGONAL: 2 * other_n, EXACT: 0.0}
    chosen = asked.method
    if chosen == "auto":
        chosen = next(name for name, size in estimates.items() if size <= asked.tolerance_mhz)
    used = Used(chosen, estimates[chosen], asked.tolerance_mhz)
    return plan.with_method(used, _kept(plan, chosen))


def _kept(plan: Plan, method: str) -> dict[tuple[int, int], dict[Channel, Floats]]:
    blocks = plan.blocks
    if method == N_DIAGONAL:
        return {pair: found for pair, found in plan.operators.items() if blocks[pair[0]].n == blocks[pair[1]].n}
    if method == FIRST_ORDER:
        alone = {pair: found for pair, found in plan.operators.items() if pair[0] == pair[1]}
        return {pair: {c: np.diag(np.diag(x)) for c, x in found.items()} for pair, found in alone.items()}
    return plan.operators


def largest_shifts(plan: Plan, every_f: Sequence[int]) -> tuple[float, float]:
    """The largest shift of a level in MHz by elements between different N, and by those between other states of one N."""
    from rotor.quantum.spins.blocks import coefficients_of

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
