"""Spin-spin coupling: scalar and dipolar coupling of two spins, and of the electrons of a triplet or higher state.

    H = J I1·I2 + Σ_ij T_ij I1_i I2_j,     H = Σ_ij D_ij S_i S_j,     T and D symmetric and traceless along a, b, c

b_F is J of an electron and a nucleus, Fermi's contact interaction; T of an electron and a nucleus is its dipolar part. lambda is D of
a linear molecule, 2λ(S_a² - S²/3). (W. Gordy and R. L. Cook, Microwave Molecular Spectra, 3rd ed., chapters 4.5 and 9.7.)
Parameters: J(1,2), b_F(S,N), T_aa(1,2), T_bb-cc(1,2), T_ab(1,2), ...; D_aa(S), D_bb-cc(S), ..., lambda(S).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from rotor.quantum.effects.spin_effect import TRACELESS, SpinEffect, Symbol, traceless_of
from rotor.quantum.spins.operators import Cosines, Scalar
from rotor.tops.parameter_names import ParameterName

if TYPE_CHECKING:
    from rotor.tops.top import Top


@dataclass(frozen=True, eq=False)
class SpinSpin(SpinEffect):
    """Spin-spin coupling of any number of pairs, and of spins of 1 or more with themselves."""

    name: ClassVar[str] = "spin-spin"
    conserved: ClassVar[frozenset[str]] = frozenset()
    symbols: ClassVar[Mapping[str, Symbol]] = (
        {"J": Symbol(Scalar(), 1.0, 2), "b_F": Symbol(Scalar(), 1.0, 2)}
        | {f"T_{letters}": Symbol(Cosines(traceless_of(letters)), 1.0, 2) for letters in TRACELESS}
        | {f"D_{letters}": Symbol(Cosines(traceless_of(letters)), 1.0, 1, True) for letters in TRACELESS}
        | {"lambda": Symbol(Cosines(traceless_of("aa")), 4 / 3, 1, True)}
    )

    def scale(self, name: str, parts: ParameterName) -> float:
        """2S(2S-1) for a spin with itself, by which the quadrupole operator is divided; else 1."""
        if not self.symbols[parts.symbol].squared:
            return 1.0
        twice = next(spin.twice for spin in self.coupled if spin.name == parts.spins[0])
        if twice < 2:
            raise ValueError(f"{name}: a spin of {twice}/2 has no coupling with itself; that needs 1 or more")
        return float(twice * (twice - 1))

    def size_mhz(self, top: Top, j: int) -> float:
        """The largest constant times both spins."""
        sizes = [0.0]
        for term in self.terms:
            spins = [next(s.twice for s in self.coupled if s.name == name) / 2 for name in term.spins]
            sizes.append(abs(self.values[term.name]) * spins[0] * spins[1])
        return max(sizes)
