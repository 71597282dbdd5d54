"""Limits of an effective Hamiltonian: divergence of the distortion series, and levels out of order.

The series J², J⁴, J⁶, ... of an effective Hamiltonian is asymptotic. As long as each order is a small part of the order before, neglected
orders are small too; where the ratio approaches one, energies are meaningless.
The size of an order at one J is the largest sum of a row of its matrix, which bounds its eigenvalues (S. Gershgorin,
Izv. Akad. Nauk SSSR 7 (1931) 749).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import distinct, numbers_in_runs
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.watson import SEMI_RIGID, Rigid, rigid_operators
from rotor.quantum.estimates.derivatives import expectations
from rotor.quantum.levels import Levels
from rotor.quantum.wang.rotation import hamiltonian
from rotor.quantum.wang.wang_matrix import elements_by_order, order_of
from rotor.table import counted
from rotor.tops.constants.operators import Operators

if TYPE_CHECKING:
    from rotor.tops.top import Top

HALF = 0.5 - 1e-6  # below ½, so that a level shared evenly by two functions does not count as mixed by more than half
RATIO_LIMIT = 0.3  # ratio of successive orders above which the series does not count as convergent


def order_sizes_mhz(
    top: Top, j: int, kmax: int | None = None, effects: Sequence[QuantumEffect] = SEMI_RIGID
) -> dict[int, float]:
    """The size in MHz of each order of the Hamiltonian by its power of J, rising, for one J and |K| up to `kmax` (J by default).

    D_t of a spherical top counts as order four, although its expansion contains terms of J² too.

    >>> from rotor.tops.top import Top
    >>> order_sizes_mhz(Top.from_constants("B=6000 D=0.01 MHz"), 10)
    {2: 660000.0, 4: 121.0}
    """
    by_order: dict[int, Operators] = {}
    for powers, value in hamiltonian(top, effects).items():
        by_order.setdefault(2 * sum(powers), {})[powers] = value
    if top.kind == "spherical":  # D_t, whose expansion has terms of J² too, counts as order four
        by_order[2] = {powers: value for powers, value in by_order.get(2, {}).items() if powers == (1, 0, 0)}
    highest = 0 if top.kind == "linear" else j if kmax is None else min(kmax, j)
    return {order: _row_bound(by_order[order], j, highest) for order in sorted(by_order)}


def _row_bound(operators: Operators, j: int, kmax: int) -> float:
    """The largest Σ_K' |⟨K'|H|K⟩| over |K| ≤ kmax."""
    k, multiplet = 2 * order_of(operators) + np.arange(kmax + 1), [row for (row,) in elements_by_order(operators, [j])]
    rows = np.abs(multiplet[0][k])
    for n, elements in enumerate(multiplet[1:], 1):
        rows += np.abs(elements[k]) + np.abs(elements[k - 2 * n])
    return float(rows.max())


def series_ratio(top: Top, jmax: int, kmax: int | None = None, effects: Sequence[QuantumEffect] = SEMI_RIGID) -> float:
    """The largest ratio of one order of the Hamiltonian to the order before it, at J = `jmax` and |K| ≤ `kmax`; 0 for a rigid top.

    >>> from rotor.tops.top import Top
    >>> round(series_ratio(Top.from_constants("A=835840 B=435352 C=278139 DeltaK=973 MHz"), 20), 2)
    0.45
    """
    return max((ratio for ratio, _ in _ratios(top, jmax, kmax, effects)), default=0.0)


def converges_to(top: Top, jmax: int, effects: Sequence[QuantumEffect] = SEMI_RIGID) -> int:
    """The highest J, up to `jmax`, at which no order of the distortion is above `RATIO_LIMIT` of the order before it.

    >>> from rotor.tops.top import Top
    >>> converges_to(Top.from_constants("A=835840 B=435352 C=278139 DeltaK=973 MHz"), 20)
    16
    """
    if not jmax or series_ratio(top, jmax, None, effects) <= RATIO_LIMIT:
        return jmax
    return _first(top, jmax, None, effects) - 1


def _ratios(top: Top, j: int, kmax: int | None, effects: Sequence[QuantumEffect]) -> list[tuple[float, int]]:
    """(ratio to the order before, order) of each order above the first; the energy of a state is not an order."""
    sizes = [(order, size) for order, size in order_sizes_mhz(top, j, kmax, effects).items() if order]
    return [(size / before if before else 0.0, order) for (_, before), (order, size) in pairwise(sizes)]


def warnings_of(top: Top, levels: Levels) -> tuple[str, ...]:
    """Warnings about these levels, as sentences.

    They state that the distortion series diverges at the highest J and K, and from which J on; that energies in a block are not in the
    order of the rigid top, so that Ka and Kc only count states; that levels are so strongly mixed that their labels mean little. For levels
    without vectors only the first is checked.
    """
    return tuple(text for text in (_divergence(top, levels), _disorder(top, levels), _mixture(levels)) if text)


def _mixture(levels: Levels) -> str:
    """Warning about levels with less than half of the function that labels them; empty if there are none."""
    if levels.mixing is None:
        return ""
    mixed = levels.mixing < HALF
    if not mixed.any():
        return ""
    lowest, total = int(np.argmin(levels.mixing)), "N" if "n" in levels.quanta else "J"
    name, first = levels.labels(np.array([lowest]))[0].strip(), int(levels.rotational[mixed].min())
    return (
        f"{counted(int(mixed.sum()), 'level')} from {total} = {first} on {'is' if mixed.sum() == 1 else 'are'} mixed by more than 50 %: "
        f"what names a level has less than half of it (least {levels.mixing[lowest]:.0%}: {name})"
    )


def _divergence(top: Top, levels: Levels) -> str:
    """Warning about a distortion series that does not converge; empty if it does."""
    j = int(levels.rotational.max(initial=0))
    k = int(np.abs(levels.quanta["k"]).max(initial=0)) if "k" in levels.quanta else None
    ratio, order = max(_ratios(top, j, k, levels.effects), default=(0.0, 0)) if j else (0.0, 0)
    if ratio <= RATIO_LIMIT:
        return ""
    return (
        f"the distortion series does not converge at J = {j}: the terms of order J^{order} are up to {ratio:.2g} of the order before "
        f"(limit {RATIO_LIMIT:g}); energies above J = {_first(top, j, k, levels.effects) - 1} at the highest K are not to be trusted"
    )


def _first(top: Top, jmax: int, kmax: int | None, effects: Sequence[QuantumEffect]) -> int:
    """The lowest J with a ratio above the limit, by bisection, as ratios rise with J."""
    low, high = 0, jmax
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if series_ratio(top, middle, kmax, effects) > RATIO_LIMIT else (middle, high)
    return high


def _disorder(top: Top, levels: Levels) -> str:
    """Warning about blocks in which energies are not in the order of the rigid top; empty if there are none."""
    disordered = disordered_blocks(top, levels)
    if not disordered:
        return ""
    first = min(j for j, _ in disordered)
    return (
        f"in {counted(len(disordered), 'block')} from J = {first} on the order of energies is not that of the rigid top: Ka and Kc count "
        "states there and say nothing about the motion"
    )


def disordered_blocks(top: Top, levels: Levels) -> list[tuple[int, str]]:
    """(J, species) of Wang blocks where the order of energies is not that of the rigid energy ⟨A Ja² + B Jb² + C Jc²⟩.

    There Ka and Kc only count states: distortion exceeds the rigid energies (quartic-only water from J = 15 on). ⟨Jz²⟩ would be a wrong
    criterion, since it decreases a little near the separatrix of a rigid top, whose labels are in order.
    """
    blocks = [block for block in levels.blocks if block.alone and len(block.energies_mhz) > 1]
    if not blocks or hamiltonian(top, levels.effects) == hamiltonian(top, (Rigid(),)):  # a rigid top is in order
        return []
    with_k = {powers: value for powers, value in rigid_operators(top.constants).items() if powers[1:] != (0, 0)}
    sizes, starts = np.array([(len(block.energies_mhz), block.start) for block in blocks]).T
    number, rows = numbers_in_runs(sizes, starts)
    (rigid,) = expectations(levels, [with_k], rows).T
    largest = np.maximum.reduceat(np.abs(rigid), np.searchsorted(number, np.arange(len(blocks))))
    falls = (np.diff(rigid) < -1e-9 * largest[number[1:]]) & (np.diff(number) == 0)
    return [(blocks[i].j, blocks[i].basis.species) for i in distinct(number[1:][falls]).tolist()]
