"""A toy effect in one file: c (J·n)⁴ along any axis n of the molecule, an operator that no table of powers holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rotor.quantum.effect import QuantumEffect
from rotor.quantum.operators.algebra import Operator
from rotor.quantum.operators.rotation import components
from rotor.tops.top import Top


@dataclass(frozen=True)
class AxisPower(QuantumEffect):
    """c (J·n)⁴ with n a unit vector along a, b, c."""

    c_mhz: float
    axis_abc: tuple[float, float, float]

    name: ClassVar[str] = "fourth power along an axis"
    conserved: ClassVar[frozenset[str]] = frozenset({"j", "m"})

    def parameters(self, top: Top) -> dict[str, float]:
        return {"c_axis": self.c_mhz}

    def size_mhz(self, top: Top, j: int) -> float:
        return abs(self.c_mhz) * float(j) ** 4

    def j_operator(self, top: Top, name: str, representation: str) -> Operator:
        along = components(representation)
        a, b, c = (n * along[axis] for n, axis in zip(self.axis_abc, "abc", strict=True))
        return (a + b + c) ** 4
