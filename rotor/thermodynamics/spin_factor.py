"""Nuclear spins that couple separately multiply the partition function by a constant factor.

    Q = Σ_rot e^(-E/kT) Σ_F (2F+1) e^(-δ_F/kT) = Π(2I+1) Q_rot [1 + O((δ/kT)²)]

The first order in the shifts δ vanishes for traceless couplings, since the mean of δ over all F of a rotational level, with weights
2F+1, is zero. The second order (δ/kT)²/2 is 1e-5 for a coupling of 100 MHz at 1 K.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from typing import TYPE_CHECKING

from rotor.quantum.effect import QuantumEffect

if TYPE_CHECKING:
    from rotor.tops.top import Top


def without_spins(top: Top, effects: Sequence[QuantumEffect]) -> tuple[tuple[QuantumEffect, ...], int]:
    """The effects without spins, and Π(2I+1) over the nuclear spins of the other effects.

    All effects remain, with a factor of 1, if the product does not apply: for an unpaired electron (large couplings), for three
    equivalent nuclei with a total spin (their number of functions depends on K), and for two whose spin weights depend on the total
    spin.
    """
    spins = {spin.name: spin for effect in effects for spin in effect.spins(top)}
    in_total_spin = sum(bool(spin.total) for spin in spins.values())
    if (
        in_total_spin == 3
        or (in_total_spin and top.spin_weights.rule != "none")
        or any(spin.electron for spin in spins.values())
    ):
        return tuple(effects), 1
    return tuple(effect for effect in effects if not effect.spins(top)), prod(spin.twice + 1 for spin in spins.values())


def spin_functions(top: Top, effects: Sequence[QuantumEffect], electrons: bool = True) -> float:
    """The mean number of spin functions of a rotational state, apart from its spin weight.

    This is Π(2I+1), and a third of it for three equivalent nuclei with a total spin: each K has only the functions of one symmetry.
    electrons: whether to count electron spins.
    """
    spins = {spin.name: spin for effect in effects for spin in effect.spins(top)}
    in_total_spin = sum(bool(spin.total) for spin in spins.values())
    return prod(spin.twice + 1 for spin in spins.values() if electrons or not spin.electron) / (
        3 if in_total_spin == 3 else 1
    )
