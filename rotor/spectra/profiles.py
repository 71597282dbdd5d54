"""Line shapes of unit area on plain arrays, their widths and reaches.

All widths are full widths at half maximum, in any unit that is the same throughout; a shape has the inverse unit.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from rotor import units
from rotor.arrays import Floats

_SIGMA_PER_FWHM = 1 / (2 * math.sqrt(2 * math.log(2)))


def gaussian(offset: ArrayLike, fwhm: ArrayLike) -> Floats:
    """A Gaussian of unit area: √(4 ln2/π)/w · exp(-4 ln2 (x/w)²).

    >>> round(float(gaussian(0.0, 2.0)), 6), round(float(gaussian(1.0, 2.0) / gaussian(0.0, 2.0)), 6)
    (0.469719, 0.5)
    """
    x, w = np.asarray(offset, dtype=float), np.asarray(fwhm, dtype=float)
    return np.asarray(math.sqrt(4 * math.log(2) / math.pi) / w * np.exp(-4 * math.log(2) * (x / w) ** 2))


def lorentzian(offset: ArrayLike, fwhm: ArrayLike) -> Floats:
    """A Lorentzian of unit area: (w/2π) / (x² + w²/4).

    >>> round(float(lorentzian(0.0, 2.0) * np.pi), 12), round(float(lorentzian(1.0, 2.0) * np.pi), 12)
    (1.0, 0.5)
    """
    x, w = np.asarray(offset, dtype=float), np.asarray(fwhm, dtype=float)
    return np.asarray(w / (2 * math.pi) / (x * x + w * w / 4))


def voigt(offset: ArrayLike, fwhm_gaussian: ArrayLike, fwhm_lorentzian: ArrayLike) -> Floats:
    """Convolution of a Gaussian and a Lorentzian, of unit area: Re w(z) / (σ √2π), z = (x + i w_L/2) / (σ √2).

    w(z) is the Faddeeva function (NIST Digital Library of Mathematical Functions, eqs. 7.19.1 and 7.19.3), to round-off.
    Either width may be 0.

    >>> round(float(voigt(0.5, 0.0, 1.0) / lorentzian(0.5, 1.0)), 12)
    1.0
    """
    from scipy.special import voigt_profile

    sigma = np.asarray(fwhm_gaussian, dtype=float) * _SIGMA_PER_FWHM
    return np.asarray(
        voigt_profile(np.asarray(offset, dtype=float), sigma, np.asarray(fwhm_lorentzian, dtype=float) / 2)
    )


def doppler_fwhm(frequency: ArrayLike, temperature_k: float, mass_u: float) -> Floats:
    """Doppler width (full width at half maximum) in the unit of the frequency: ν √(8 ln2 kT/(m c²)).

    From the Maxwell distribution of velocities along the line of sight, ν' = ν (1 + v/c), ⟨v²⟩ = kT/m; numerically
    7.1623e-7 ν √(T/K · u/m) (C. H. Townes and A. L. Schawlow, Microwave Spectroscopy, 1955, chapter 13, with 3.581e-7 for the half
    width). Raises ValueError for a temperature or mass not above 0.

    >>> round(float(doppler_fwhm(115271.2018, 300.0, 27.9949)), 6)
    0.270269
    """
    if not (temperature_k > 0 and mass_u > 0):
        raise ValueError(f"Doppler width at {temperature_k} K for a mass of {mass_u} u: both must be above 0")
    speed2 = units.BOLTZMANN_J_PER_K * temperature_k / (mass_u * units.ATOMIC_MASS_KG)
    relative = math.sqrt(8 * math.log(2) * speed2) / units.SPEED_OF_LIGHT_M_PER_S
    return np.asarray(np.asarray(frequency, dtype=float) * relative)


def gaussian_reach(fwhm: ArrayLike, outside: float) -> Floats:
    """Distance from the centre beyond which a fraction `outside` of the area of a Gaussian lies.

    >>> round(float(gaussian_reach(1.0, 0.002)), 4)  # 3.09 standard deviations
    1.3123
    """
    from scipy.special import erfcinv

    return np.asarray(np.asarray(fwhm, dtype=float) * (erfcinv(outside) / (2 * math.sqrt(math.log(2)))))


def lorentzian_reach(fwhm: ArrayLike, outside: float) -> Floats:
    """Distance beyond which a fraction `outside` of a Lorentzian lies: (w/2) cot(π outside/2), about w/(π outside).

    >>> round(float(lorentzian_reach(2.0, 0.5)), 12)  # half of it lies beyond its half width
    1.0
    """
    return np.asarray(np.asarray(fwhm, dtype=float) / 2 / math.tan(math.pi * outside / 2))
