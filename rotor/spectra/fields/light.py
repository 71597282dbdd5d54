"""Polarization of light in a static field, and the squared dipole elements that it selects.

Strengths are scaled so that their mean over all directions of polarization is the S μ² of a catalogue. For light polarized at an angle β
to the field (averaged over the azimuth), for polarization along a unit vector e, and for isotropic light

    S(β) = 3 [cos²β |⟨μ_∥⟩|² + ½ sin²β (|⟨μ⟩|² - |⟨μ_∥⟩|²)],      S(e) = 3 |⟨e·μ⟩|²,      isotropic light: |⟨μ⟩|².

If M is a good quantum number, |⟨μ_∥⟩|² belongs to ΔM = 0 and the rest to ΔM = ±1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats

LIGHT = {"parallel": 0.0, "perpendicular": 90.0, "isotropic": None}
Vector = tuple[float, float, float]
LightText = str | float | Sequence[float]


@dataclass(frozen=True)
class Light:
    """angle_degrees: with the static field, None for isotropic light. direction: of the polarization, (3,) of length 1, instead."""

    angle_degrees: float | None
    direction: Vector | None = None

    def about(self, field: Vector) -> Light:
        """This light described by its angle with the field, for levels with a good M."""
        if self.direction is None:
            return self
        cosine = float(np.dot(self.direction, field) / np.linalg.norm(field))
        return Light(math.degrees(math.acos(min(1.0, max(-1.0, cosine)))))  # round-off may exceed 1

    @property
    def factors(self) -> tuple[float, float]:
        """Factors of |⟨μ_∥⟩|² and of the other squares: (1, 1) for isotropic light, (3 cos²β, 1.5 sin²β) for linear polarization."""
        if self.angle_degrees is None:
            return 1.0, 1.0
        cosine = math.cos(math.radians(self.angle_degrees))
        return 3 * cosine**2, 1.5 * (1 - cosine**2)

    def strength(self, components: Sequence[NDArray[Any]], field: Vector) -> Floats:
        """S(β), or S(e), from elements of μ_X, μ_Y and μ_Z (arrays of equal shape); field: unit vector."""
        if self.direction is not None:
            return 3 * _square(components, self.direction)
        along, across = self.factors
        parallel = _square(components, field)
        whole = np.sum([np.abs(component) ** 2 for component in components], axis=0)
        # the difference of squares may round below 0
        return np.asarray(along * parallel + across * np.maximum(whole - parallel, 0.0))

    @property
    def text(self) -> str:
        """Description for reports."""
        if self.direction is not None:
            return f"along ({', '.join(f'{x:g}' for x in self.direction)})"
        names = {angle: name for name, angle in LIGHT.items()}
        return names.get(self.angle_degrees, f"{self.angle_degrees}° to the field")


def _square(components: Sequence[NDArray[Any]], vector: Vector) -> Floats:
    x, y, z = (part * axis for part, axis in zip(vector, components, strict=True))
    return np.asarray(np.abs(x + y + z) ** 2)


def light_components(light: LightText) -> Light:
    """The light of a name in `LIGHT`, an angle with the field in degrees, or three components along X, Y, Z; else ValueError.

    >>> light_components("perpendicular").factors
    (1.1248198369963932e-32, 1.5)
    """
    if isinstance(light, str) and light in LIGHT:
        return Light(LIGHT[light])
    try:
        numbers = np.atleast_1d(np.asarray(light, dtype=np.float64))  # one number is an angle, three are components
    except ValueError:
        numbers = np.array([math.nan])
    length = float(np.linalg.norm(numbers))
    if numbers.shape not in ((1,), (3,)) or not math.isfinite(length) or (numbers.size == 3 and not length > 0):
        raise ValueError(
            f"light {light!r}: expected one of {', '.join(LIGHT)}, an angle with the field in degrees, or three components of the "
            "polarization along X, Y, Z, not all 0"
        )
    if numbers.size == 1:
        return Light(float(numbers[0]))
    x, y, z = (numbers / length).tolist()
    return Light(None, (x, y, z))
