"""Nuclear quadrupole coupling of nuclei of spin 1 or more with the gradient of the electric field.

    H = Σ_ij χ_ij I_i I_j / (2I(2I-1)),     χ_ij = eQ q_ij along a, b, c, symmetric and traceless

(W. Gordy and R. L. Cook, Microwave Molecular Spectra, 3rd ed., eq. 9.9). Parameters: chi_aa, chi_bb-cc (the difference), chi_ab,
chi_ac, chi_bc; chi_aa alone is a tensor with -½ chi_aa along b and c.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rotor.quantum.effects.spin_effect import TRACELESS, SpinEffect, Symbol, traceless_of
from rotor.quantum.spins.operators import Cosines
from rotor.quantum.spins.scheme import Spin
from rotor.tops.parameter_names import parse_name

if TYPE_CHECKING:
    from rotor.tops.top import Top


@dataclass(frozen=True, eq=False)
class NuclearQuadrupole(SpinEffect):
    """Quadrupole coupling of any number of nuclei.

    >>> from rotor.tops.top import Top
    >>> effect = NuclearQuadrupole({"chi_aa(14N)": -4.7, "chi_bb-cc(14N)": 0.2}, (Spin("14N", 2),))
    >>> effect.parameters(Top.from_constants("A=9 B=5 C=4 MHz"))["chi_aa(14N)"]
    -4.7
    """

    name: ClassVar[str] = "nuclear quadrupole"
    conserved: ClassVar[frozenset[str]] = frozenset()
    symbols: ClassVar[Mapping[str, Symbol]] = {
        f"chi_{letters}": Symbol(Cosines(traceless_of(letters)), 1.0, 1, True) for letters in TRACELESS
    }

    def size_mhz(self, top: Top, j: int) -> float:
        """The largest element of χ, summed over the nuclei; splittings are fractions of it."""
        largest: dict[str, float] = {}
        for name, value in self.values.items():
            spin = parse_name(name).spins[0]
            largest[spin] = max(largest.get(spin, 0.0), abs(value))
        return sum(largest.values())


def quadrupole_of_tensor(spin: Spin, chi_mhz: ArrayLike) -> NuclearQuadrupole:
    """The coupling of one nucleus from its tensor χ (3, 3) in principal axes a, b, c, MHz.

    Raises ValueError unless the tensor is symmetric and traceless within 1e-3 of its largest element; the trace that rounding of published
    elements leaves is removed.

    >>> quadrupole_of_tensor(Spin("35Cl", 3), [[-57.0, 0, 0], [0, 26.4, 0], [0, 0, 30.6]]).values["chi_bb-cc(35Cl)"].__round__(6)
    -4.2
    """
    chi = np.asarray(chi_mhz, dtype=float)
    if chi.shape != (3, 3) or not np.isfinite(chi).all():
        raise ValueError(f"chi({spin.name}) is a (3, 3) tensor of finite numbers in MHz, not {chi.tolist()}")
    largest = float(np.abs(chi).max())
    if np.abs(chi - chi.T).max() > 1e-3 * largest:
        raise ValueError(f"chi({spin.name}) is a symmetric tensor; this one is not: {chi.tolist()}")
    if abs(np.trace(chi)) > 1e-3 * largest:
        raise ValueError(
            f"chi({spin.name}): chi_aa + chi_bb + chi_cc = {np.trace(chi):g} MHz; a quadrupole tensor is traceless, check the elements"
        )
    chi = (chi + chi.T) / 2 - np.eye(3) * np.trace(chi) / 3
    named = {"aa": chi[0, 0], "bb-cc": chi[1, 1] - chi[2, 2], "ab": chi[0, 1], "ac": chi[0, 2], "bc": chi[1, 2]}
    values = {f"chi_{letters}({spin.name})": float(value) for letters, value in named.items() if value}
    return NuclearQuadrupole(values or {f"chi_aa({spin.name})": 0.0}, (spin,))
