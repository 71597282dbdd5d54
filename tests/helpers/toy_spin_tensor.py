"""A toy effect in one file: a rank-2 tensor of the molecule coupled to an artificial spin, T²(molecule) · T²(S, S)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rotor.quantum.effect import QuantumEffect
from rotor.quantum.spins import Spin, SpinTerm
from rotor.quantum.spins.scheme import Cosines, Matrix
from rotor.tops.top import Top


@dataclass(frozen=True)
class SpinTensor(QuantumEffect):
    """g Σ_ij t_ij S_i S_j / (2S(2S-1)) with t symmetric and traceless along a, b, c."""

    g_mhz: float
    t_abc: Matrix
    twice_s: int

    name: ClassVar[str] = "tensor on an artificial spin"
    conserved: ClassVar[frozenset[str]] = frozenset({"m"})

    def parameters(self, top: Top) -> dict[str, float]:
        return {"g_spin": self.g_mhz}

    def size_mhz(self, top: Top, j: int) -> float:
        return abs(self.g_mhz) * max(abs(x) for row in self.t_abc for x in row)

    def spins(self, top: Top) -> tuple[Spin, ...]:
        return (Spin("X", self.twice_s),)

    def spin_terms(self, top: Top) -> tuple[SpinTerm, ...]:
        return (SpinTerm("g_spin", ("X", "X"), Cosines(self.t_abc)),)
