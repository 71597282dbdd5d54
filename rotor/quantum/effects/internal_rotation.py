"""Internal rotation of one threefold group: levels of the species A and E in every torsional state.

    H = A Pa² + B Pb² + C Pc² + D_ab {Pa, Pb} + F (p - ρPa)² + ½V3 (1 - cos 3α) + ½V6 (1 - cos 6α) + further terms and distortion

in the rho-axis frame, with A beside F (p - ρPa)². Constants: F, rho, V3, V6, Dab ... (`rotor.quantum.internal_rotation.terms` has the
table with its sources); rotational constants and distortion are those of the top. The torsion is solved for each K, and its lowest
n_v functions are the basis of the rotation (`rotor.quantum.internal_rotation.contracted`). Levels are labelled by species, v_t, J, Ka, Kc.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from rotor.quantum.effect import QuantumEffect
from rotor.tops.internal_rotation import InternalRotationConstants

if TYPE_CHECKING:
    from rotor.quantum.levels import Levels
    from rotor.tops.top import Top

SPINS = ("nuclear quadrupole", "spin-rotation")  # effects of spins that have elements between torsional functions
ROTATION = ("rigid rotor", "centrifugal distortion")  # effects whose constants are coefficients of the same blocks


@dataclass(frozen=True, eq=False)
class InternalRotation(QuantumEffect):
    """Internal rotation of one to three threefold groups."""

    name: ClassVar[str] = "internal rotation"
    conserved: ClassVar[frozenset[str]] = frozenset({"j"})

    constants: InternalRotationConstants

    def parameters(self, top: Top) -> dict[str, float]:
        """Constants of the internal rotor in MHz; rho has no unit."""
        return dict(self.constants.values)

    def size_mhz(self, top: Top, j: int) -> float:
        """The largest E-A splitting of the torsional ground state for |K| ≤ J, relative to that of K = 0."""
        from rotor.quantum.internal_rotation.levels import species_splitting

        return species_splitting(top, self.constants, j)

    def solve(
        self,
        top: Top,
        effects: Sequence[QuantumEffect],
        jmin: int,
        jmax: int,
        vectors: bool,
        below_mhz: float = math.inf,
    ) -> Levels:
        """Levels of all species with v_t ≤ vt_max; without vectors, energies of all n_v torsional functions.

        Raises ValueError for effects that have no elements between torsional functions.
        """
        spins = [effect for effect in effects if effect.name in SPINS]
        for effect in effects:
            if effect.name not in (*ROTATION, *SPINS, self.name):
                raise ValueError(
                    f"{effect.name or type(effect).__name__} beside internal rotation: not computed together; leave one of them out"
                )
        if spins:
            from rotor.quantum.internal_rotation.hyperfine import hyperfine_levels

            return hyperfine_levels(top, self.constants, tuple(effects), jmin, jmax)
        from rotor.quantum.internal_rotation.levels import energies_alone, torsion_rotation_levels

        if vectors:
            return torsion_rotation_levels(top, self.constants, tuple(effects), jmin, jmax)
        return energies_alone(top, self.constants, tuple(effects), jmin, jmax, below_mhz)
