"""Consistency of the constants of isotopologues: planar moments that a substitution does not change, and leave-one-out fits.

Atoms in the plane g = 0, perpendicular to the axis g, do not contribute to the planar moment

    P_g = (I_a + I_b + I_c)/2 - I_g = Σ m g²

(P_c = -Δ/2 for a planar molecule with inertial defect Δ). Substituting such an atom changes P_g only through vibration. In measured
constants of trifluorotoluenes and of maleic anhydride with 13C or 18O in the plane, P_c changes by less than 0.002 u Å², once by 0.013;
an error of 1 MHz in B = 5 GHz gives 0.010. Larger moments change more: P_a of maleic anhydride, 205 u Å², by 0.017 with 18O on the b axis.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rotor.structures.family import AXES, Family, Species
from rotor.structures.kraitchman import planar_moments
from rotor.structures.least_squares import FittedStructure

IN_PLANE_ANGSTROM = 1e-5  # distance below which an atom of a symmetrised geometry lies in the plane
VIBRATION = 0.005  # u Å²: largest change of a planar moment that vibration explains
VIBRATION_PART = 1e-4  # this limit as a fraction of the planar moment
VIBRATION_OF_HYDROGEN = 0.03  # u Å²: this limit for substituted hydrogen (H2CO and HDCO differ by 0.004)
_SIGMAS = 5.0
_CHANCE = 0.01  # probability by chance, over all isotopologues, below which an isotopologue is reported


@dataclass(frozen=True)
class PlanarMoment:
    """Planar moment of a species along an axis of the parent, its change from the parent, and the error of the change; u Å²."""

    species: str
    axis: str
    value: float
    change: float
    error: float
    limit: float

    @property
    def doubtful(self) -> bool:
        """Whether vibration and the errors of the constants do not explain the change."""
        return abs(self.change) > self.limit + _SIGMAS * self.error


def moments_across_planes(family: Family) -> list[PlanarMoment]:
    """P_g of all species with known A, B, C whose replaced atoms all have g = 0; none for linear molecules."""
    parent = family.parent
    if family.linear or not np.isfinite(parent.moments).all():
        return []
    places, out = family.frame_positions(parent), list[PlanarMoment]()
    for species in family.species[1:]:
        replaced = _replaced(parent, species)
        if not np.isfinite(species.moments).all():
            continue
        hydrogen = any(species.molecule.symbols[i] == "H" for i in replaced)
        for g, axis in enumerate(AXES):
            if (np.abs(places[replaced, g]) < IN_PLANE_ANGSTROM).all():
                (before, error_of_species), (value, error) = (
                    _planar(parent, g),
                    _planar(species, species.axes.index(axis)),
                )
                limit = (VIBRATION_OF_HYDROGEN if hydrogen else VIBRATION) + VIBRATION_PART * abs(before)
                out.append(
                    PlanarMoment(
                        species.name, axis, value, value - before, float(np.hypot(error_of_species, error)), limit
                    )
                )
    return out


def _replaced(parent: Species, species: Species) -> list[int]:
    pairs = zip(parent.molecule.mass_numbers, species.molecule.mass_numbers, strict=True)
    return [i for i, (old, new) in enumerate(pairs) if old != new]


def _planar(species: Species, g: int) -> tuple[float, float]:
    """Planar moment along an axis of the species, and its standard error."""
    signs = np.where(np.arange(3) == g, -0.5, 0.5)
    return float(planar_moments(species.moments)[g]), float(np.linalg.norm(signs * species.moment_errors))


@dataclass(frozen=True)
class Without:
    """A fit without one species: rms of the remaining moments, u Å², and the probability of such a gain by chance."""

    species: str
    rms_u_angstrom2: float
    chance: float


def without_each(family: Family, fitted: FittedStructure, refit: Callable[[Family], FittedStructure]) -> list[Without]:
    """Leave-one-out fits for all isotopologues except the parent, largest gain first; fits with too few moments are skipped.

    Without k moments, F = ((χ₀² - χ₁²)/k)/(χ₁²/f₁) follows Fisher's distribution with k and f₁ degrees of freedom if the isotopologue
    is consistent with the others; `chance` is this probability times the number of isotopologues (Bonferroni).
    """
    from scipy.special import fdtrc

    whole, out = float(fitted.minimum.residuals @ fitted.minimum.residuals), list[Without]()
    for place, species in enumerate(family.species[1:], 1):
        rest = replace(family, species=family.species[:place] + family.species[place + 1 :])
        try:
            less = refit(rest)
        except ValueError:  # more unknowns than moments
            continue
        fewer, free = len(fitted.moments) - len(less.moments), less.degrees_of_freedom
        if less.undetermined or free < 1 or fewer < 1:
            continue
        left = float(less.minimum.residuals @ less.minimum.residuals)
        ratio = (whole - left) / fewer / (left / free) if left > 0 else np.inf
        chance = float(fdtrc(fewer, free, max(ratio, 0.0))) * (len(family.species) - 1)
        out.append(Without(species.name, less.rms_u_angstrom2, min(chance, 1.0)))
    return sorted(out, key=lambda less: less.chance)


def doubts(family: Family) -> list[str]:
    """Notes on planar moments that change more than by vibration."""
    return [
        f"{moment.species}: P_{moment.axis} = {moment.value:.5f} u Å², {moment.change:+.5f} from the parent, where its atoms lie in "
        f"the plane and vibration changes it by less than {moment.limit:.1g}: are its constants right?"
        for moment in moments_across_planes(family)
        if moment.doubtful
    ]


def gains(method: str, gained: list[Without], rms_u_angstrom2: float) -> list[str]:
    """A note on an isotopologue without which the others fit much better."""
    if not gained or gained[0].chance > _CHANCE:
        return []
    first = gained[0]
    return [
        f"{method}: without {first.species} the rms of the moments falls from {rms_u_angstrom2:.3g} to {first.rms_u_angstrom2:.3g} u Å², "
        f"by chance with a probability of {first.chance:.1g}: are its constants right?"
    ]
