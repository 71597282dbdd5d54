"""What spins that are coupled one by one do to a partition function: they multiply it.

    Q = Σ_rot e^(-E/kT) Σ_F (2F+1) e^(-δ_F/kT) = Π(2I+1) Q_rot [1 + O((δ/kT)²)]

The first order in the shifts δ vanishes for traceless couplings, since the mean of δ over all F of a rotational level, with weights
2F+1, is zero. At 1 K a coupling of 100 MHz leaves (δ/kT)²/2 = 1e-5.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from typing import TYPE_CHECKING

from rotor.quantum.effect import QuantumEffect

if TYPE_CHECKING:
    from rotor.tops.top import Top


def without_spins(top: Top, effects: Sequence[QuantumEffect]) -> tuple[tuple[QuantumEffect, ...], int]:
    """The effects that need no spin, and Π(2I+1) over the nuclear spins that the others couple.

    With an unpaired electron nothing is left out: its couplings are too large for this, and the factor is 1. Likewise with three
    equivalent nuclei of one total spin, since each K has its own number of their functions, and with two whose weights go by it.
    """
    spins = {spin.name: spin for effect in effects for spin in effect.spins(top)}
    of_total = sum(bool(spin.total) for spin in spins.values())
    if of_total == 3 or (of_total and top.spin_weights.rule != "none") or any(spin.electron for spin in spins.values()):
        return tuple(effects), 1
    return tuple(effect for effect in effects if not effect.spins(top)), prod(spin.twice + 1 for spin in spins.values())


def spin_functions(top: Top, effects: Sequence[QuantumEffect], electrons: bool = True) -> float:
    """How many functions of spins a rotational state has on average beside its spin weight: Π(2I+1), a third of it where three
    equivalent nuclei are coupled to one total spin, of whose functions every K has those of its own symmetry.

    electrons: whether theirs count too.
    """
    spins = {spin.name: spin for effect in effects for spin in effect.spins(top)}
    together = sum(bool(spin.total) for spin in spins.values())
    return prod(spin.twice + 1 for spin in spins.values() if electrons or not spin.electron) / (
        3 if together == 3 else 1
    )
