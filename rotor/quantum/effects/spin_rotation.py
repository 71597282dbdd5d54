"""Spin-rotation coupling of nuclei (C) and of unpaired electrons (ε).

    H = Σ_ij C_ij ½{S_i, N_j},     S_i = Σ_p φ_pi S_p the component of the spin along a, b or c of the molecule

(J. M. Brown and T. J. Sears, J. Mol. Spectrosc. 75, 111 (1979) for electrons; W. Gordy and R. L. Cook, Microwave Molecular
Spectra, 3rd ed., eq. 9.139 for nuclei, with the sign +I·C·J). Parameters: C_aa, C_bb, C_cc, C_ab (mean of both orders), C_ab-ba (half of
their difference), C_iso for a scalar C N·S, and the same with eps; gamma is eps_iso. Note the sign: catalogues that define -I·C·J list -C.

C_ab multiplies ½{S_a, N_b} + ½{S_b, N_a}, C_ab-ba ½{S_a, N_b} - ½{S_b, N_a} = i/2 [N², S_c] (a, b, c in cyclic order), so that the
element of the tensor with the spin along a is C_ab + C_ab-ba. The difference connects N only with N ± 1: its first order is zero.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from rotor.quantum.effects.spin_effect import SpinEffect, Symbol, matrix_of
from rotor.quantum.spins.operators import CosinesWithN

if TYPE_CHECKING:
    from rotor.tops.top import Top

COMPONENTS = ("iso", "aa", "bb", "cc", "bb-cc", "bb-aa", "ab", "ac", "bc", "ab-ba", "ac-ca", "bc-cb")


def _symbol(letters: str) -> Symbol:
    """Meaning of a component such as ab."""
    return Symbol(CosinesWithN(matrix_of(letters)), 1.0, 1)


@dataclass(frozen=True, eq=False)
class SpinRotation(SpinEffect):
    """Spin-rotation coupling of any number of spins.

    C_bb-cc multiplies S_b N_b - S_c N_c. With powers: C_aa_J multiplies ½{N², S_a N_a}.
    """

    name: ClassVar[str] = "spin-rotation"
    conserved: ClassVar[frozenset[str]] = frozenset()
    symbols: ClassVar[Mapping[str, Symbol]] = {
        f"{letter}_{letters}": _symbol(letters) for letter in ("C", "eps") for letters in COMPONENTS
    } | {"gamma": _symbol("iso")}

    def size_mhz(self, top: Top, j: int) -> float:
        """The largest constant times S and powers of N."""
        sizes = [0.0]
        for term in self.terms:
            spin = max(s.twice for s in self.coupled if s.name in term.spins) / 2
            sizes.append(abs(self.values[term.name]) * spin * max(j, 1) ** (1 + 2 * (term.n2 + term.nz2)))
        return max(sizes)
