"""Neglected effects whose size follows from the constants of a top: the next order of distortion, and known spin couplings.

The next order is extrapolated as a geometric series, c s_n²/s_(n-1), from the sizes s of the last two orders at one J (`order_sizes_mhz`).
From the quartic to the sextic order c = 0.3 for linear tops and 3 for others; c = 1 for all higher orders. A harmonic diatomic molecule has
c = 2, most of which anharmonicity cancels (Dunham's H = 2D(12B² - αω)/3ω²). The values were chosen on the library, where they hold within a
factor of 3 for 25 of 30 orders (tests/scenes/test_scene_plans.py names the others).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rotor.frozen import dataclass
from rotor.quantum.effect import QuantumEffect
from rotor.requests.budget import two_digits

if TYPE_CHECKING:
    from rotor.tops.top import Top

FACTORS = {"linear": 0.3, "other": 3.0, "higher": 1.0}  # c
COMPUTE = "its constants are known, add the effects of spins"  # reports replace this by the option
ZERO_POINT, ESTIMATED = "vibration-rotation difference", "errors of the estimated constants"
OF_CHI = 0.5  # largest shift relative to χ: χ/2 for J = 1 with I = 1, χ/4 for higher J


@dataclass(frozen=True)
class Limit:
    """A neglected effect.

    size_mhz: for a line at the highest J; None if not estimated. at_most: whether the size is an upper bound. levels: J and K for which
    the size holds, where it grows fast with them.
    """

    name: str
    size_mhz: float | None
    text: str
    at_most: bool = False
    levels: str = ""

    @property
    def size(self) -> float | None:
        """The size in MHz, as that of `rotor.requests.plan.LeftOut`."""
        return self.size_mhz

    def sentence(self, with_spins: str = COMPUTE) -> str:
        """Name, size and consequence, as reports print them. with_spins: how the effects of spins are added."""
        estimate = "not estimated" if self.size_mhz is None else f"about {two_digits(self.size_mhz)} MHz"
        size = f"at most {estimate}" if self.at_most else estimate
        return f"{self.name}: {size}; {self.text.replace(COMPUTE, with_spins)}"


def next_order(top: Top, j: int, effects: Sequence[QuantumEffect]) -> Limit | None:
    """The order of distortion beyond the highest of the calculation; None for rigid constants.

    >>> from rotor.quantum.effects.watson import SEMI_RIGID
    >>> from rotor.tops.top import Top
    >>> sextic = next_order(Top.from_constants("B=6000 D=0.001 MHz"), 20, SEMI_RIGID)
    >>> f"{sextic.size_mhz:.2e}"  # 0.3 D²/B (J(J+1))³
    '3.70e-03'
    """
    from rotor.quantum.estimates.convergence import order_sizes_mhz

    sizes = list(order_sizes_mhz(top, j, effects=effects).items())
    if len(sizes) < 2 or not sizes[-2][1]:
        return None
    (_, before), (order, last) = sizes[-2:]
    which = "higher" if order > 4 else "linear" if top.kind == "linear" else "other"
    text = f"{FACTORS[which]:g} times the order J^{order} ({last:.2g} MHz) squared over the order before"
    levels = f"J = {j}" if top.kind == "linear" else f"J = {j}, K up to {j}"
    return Limit(
        f"centrifugal distortion of order J^{order + 2}", FACTORS[which] * last**2 / before, text, levels=levels
    )


def known_couplings(top: Top, j: int, effects: Sequence[QuantumEffect]) -> list[Limit]:
    """Spin couplings with known constants that the calculation neglects."""
    if top.spin_constants is None:
        return []
    from rotor.quantum.effects.of_top import spin_effects

    present = {effect.name for effect in effects}
    parts = {"nuclear quadrupole": OF_CHI}
    limits = []
    for effect in spin_effects(top):
        if effect.name not in present:
            spins = ", ".join(dict.fromkeys(name for term in effect.spin_terms(top) for name in term.spins))
            size = parts.get(effect.name, 1.0) * effect.size_mhz(top, j)
            limits.append(Limit(effect.name, size, f"{spins}: {COMPUTE}"))
    return limits
