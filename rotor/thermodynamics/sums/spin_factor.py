"""Nuclear spins that couple separately multiply the partition function by a constant factor.

    Q = Σ_rot e^(-E/kT) Σ_F (2F+1) e^(-δ_F/kT) = Π(2I+1) Q_rot [1 + O((δ/kT)²)]

The first order in the shifts δ vanishes for traceless couplings, since the mean of δ over all F of a rotational level, with weights
2F+1, is zero. The second order (δ/kT)²/2 is 1e-5 for a coupling of 100 MHz at 1 K.

Three equivalent nuclei of a symmetric top, coupled to one total spin, have n = 2I+1 functions each. Of the n³ products, (n³ + 2n)/3 are
unchanged by the cyclic exchange and belong to K = 0, 3, 6, ...; each other level of K has (n³ - n)/3 (Burnside's lemma for the cyclic
group of order 3). The product is then a sum with these numbers as spin weights. Scalar couplings J I·I of the three nuclei shift the mean
of a species, so that the first order δ/kT remains.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import gcd, prod
from typing import TYPE_CHECKING, NamedTuple

from rotor.quantum.effect import QuantumEffect
from rotor.tops.spins.spin_weights import SpinWeights

if TYPE_CHECKING:
    from rotor.tops.top import Top


class RotationalSum(NamedTuple):
    """A sum over rotational levels that replaces one over levels split by spins, times a number of spin functions.

    effects: without spins, or all if no such sum exists; then functions is 1. weights: number of spin functions by K, reduced, instead of
    those of the top; None without equivalent nuclei.
    """

    effects: tuple[QuantumEffect, ...]
    functions: int
    weights: SpinWeights | None = None

    @property
    def first_order(self) -> bool:
        """Whether the mean shift of a level may not vanish: that of one species of three equivalent nuclei."""
        return self.weights is not None

    @property
    def is_original(self) -> bool:
        """Whether this is the sum over the levels of all effects: without spins, or with split levels that must be summed."""
        return self.functions == 1 and self.weights is None


def rotational_sum(top: Top, effects: Sequence[QuantumEffect]) -> RotationalSum:
    """The sum over rotational levels that replaces the sum over split levels.

    Split levels must be summed for an unpaired electron (large couplings), for two nuclei whose spin weights depend on their total spin,
    and for three nuclei with a total spin in interacting states.
    """
    spins = {spin.name: spin for effect in effects for spin in effect.spins(top)}
    coupled = [spin for spin in spins.values() if spin.total]
    three = len(coupled) == 3
    symmetric = top.kind in ("prolate", "oblate") and top.states is None
    if (
        (coupled and top.spin_weights.rule != "none")
        or (three and not symmetric)
        or any(spin.electron for spin in spins.values())
    ):
        return RotationalSum(tuple(effects), 1)
    rest = tuple(effect for effect in effects if not effect.spins(top))
    functions = prod(spin.twice + 1 for spin in spins.values() if not (three and spin.total))
    if not three:
        return RotationalSum(rest, functions)
    weights, common = three_spin_weights(coupled[0].twice)
    return RotationalSum(rest, functions * common, weights)


def three_spin_weights(twice_i: int) -> tuple[SpinWeights, int]:
    """Spin weights by K modulo 3 of three equivalent nuclei of spin I, reduced, and their common divisor.

    >>> weights, common = three_spin_weights(2)
    >>> weights.to_mapping(), common, three_spin_weights(1)[1]
    ({'0': 11, '1': 8, '2': 8}, 1, 2)
    """
    n = twice_i + 1
    unchanged, others = (n**3 + 2 * n) // 3, (n**3 - n) // 3
    return SpinWeights.from_mapping({"0": unchanged, "1": others, "2": others}), gcd(unchanged, others)


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
