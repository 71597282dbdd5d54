"""Three estimates of the kinetic energy in a motion with finite steps; one has no error of order h².

A step of length h moves a libration of angular frequency Ω under a shadow Hamiltonian. With s = Ωh/2 and the kick-drift-kick
step (velocity Verlet) an ensemble at kT of that Hamiltonian has (E. Hairer, C. Lubich, G. Wanner, Geometric Numerical
Integration, chapter IX, for shadow Hamiltonians; for a harmonic motion the frequency (2/h) asin s and the invariant
p²/2m + ½ m Ω² (1 - s²) x² fix it)

    ⟨p²/m⟩ = kT s √(1 - s²)/asin s   = kT (1 - (Ωh)²/6 + ...)    momenta at full steps,
    ⟨p²/m⟩ = kT s/(√(1 - s²) asin s) = kT (1 + (Ωh)²/12 + ...)   momenta at half steps.

Librations of light atoms are fastest, so rotations appear colder than translations at full steps. The mean over the two half
steps next to a full step follows from the momenta p ± ½ h F:

    K_half = K_full + h²/8 Σ F²/m,     (2 K_half + K_full)/3 = K_full + h²/12 Σ F²/m,

the last without the h² term; torques and moments stand for forces and masses in rotations. A thermostat that acts in the middle
of the step fixes the half-step momenta instead: there ⟨x²⟩ is exact, K_full is low by (Ωh)²/4 and K_half is right
(B. Leimkuhler and C. Matthews, J. Chem. Phys. 138, 174102 (2013), section III).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotor import units
from rotor.arrays import Floats
from rotor.classical.euler import kinetic_energy as rotational_energy
from rotor.fluids.motion.bodies import Bodies
from rotor.statistics.degrees_of_freedom import Degrees

THERMOMETERS = {"full": 0.0, "half": 1 / 8, "mixed": 1 / 12}  # factors of h² Σ F²/m


@dataclass(frozen=True)
class Kinetic:
    """Kinetic energies of translation and rotation, eV."""

    translation_ev: float
    rotation_ev: float

    @property
    def total_ev(self) -> float:
        """Both together."""
        return self.translation_ev + self.rotation_ev

    def __add__(self, other: Kinetic) -> Kinetic:
        return Kinetic(self.translation_ev + other.translation_ev, self.rotation_ev + other.rotation_ev)

    def times(self, factor: float) -> Kinetic:
        """Both, multiplied."""
        return Kinetic(factor * self.translation_ev, factor * self.rotation_ev)


@dataclass(frozen=True)
class Temperatures:
    """2 K/(k f) in K, for all degrees, translations and rotations; nan without such degrees."""

    all_k: float
    translation_k: float
    rotation_k: float


def kinetic_energy(bodies: Bodies, momentum: Floats, angular: Floats) -> Kinetic:
    """½ Σ p²/m and ½ Σ L_i²/I_i of momenta (n, 3) and angular momenta (n, 3) in principal axes; ASE's units give eV.

    >>> from ase.build import molecule
    >>> from rotor.fluids.motion.bodies import rigid_bodies
    >>> bodies, _ = rigid_bodies(molecule("N2"))
    >>> round(kinetic_energy(bodies, np.array([[bodies.mass[0], 0.0, 0.0]]), np.zeros((1, 3))).translation_ev, 4)
    14.0031
    """
    return Kinetic(
        0.5 * float(np.sum(momentum * momentum / bodies.mass[:, None])),
        float(np.sum(rotational_energy(angular, angular * bodies.inverse_moments))),
    )


def step_correction(bodies: Bodies, force: Floats, torque: Floats, step: float) -> Kinetic:
    """h² Σ F²/m and h² Σ T_i²/I_i: with a factor of `THERMOMETERS`, what a thermometer adds to the full step's energy.

    force, torque: (n, 3) in space, and in body axes. step: h, in ASE's unit of time.
    """
    return kinetic_energy(bodies, force, torque).times(2.0 * step**2)


def temperatures(kinetic: Kinetic, degrees: Degrees) -> Temperatures:
    """Temperatures of kinetic energies by the count of degrees.

    >>> from rotor.statistics.degrees_of_freedom import Degrees
    >>> temperatures(Kinetic(3.0 * units.EV_PER_K, 2.0 * units.EV_PER_K), Degrees(2, 3, 4)).translation_k
    2.0
    """
    counts = (degrees.total, degrees.translation, degrees.rotation)
    energies = (kinetic.total_ev, kinetic.translation_ev, kinetic.rotation_ev)
    return Temperatures(
        *(2.0 * e / (f * units.EV_PER_K) if f else float("nan") for e, f in zip(energies, counts, strict=True))
    )
