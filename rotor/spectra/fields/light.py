"""The polarization of light in a static field, and the squares of the dipole that it sees.

The strength is scaled so that its mean over all directions of polarization is the S μ² of a catalogue. Light at an angle β with the
field, whatever its azimuth, and light of one direction e see

    S(β) = 3 [cos²β |⟨μ_∥⟩|² + ½ sin²β (|⟨μ⟩|² - |⟨μ_∥⟩|²)],      S(e) = 3 |⟨e·μ⟩|²,      isotropic light: |⟨μ⟩|².

Where M is good |⟨μ_∥⟩|² is that of ΔM = 0 and the rest that of ΔM = ±1.
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
        """This light, described by its angle with a field that has an axis of symmetry."""
        if self.direction is None:
            return self
        cosine = float(np.dot(self.direction, field) / np.linalg.norm(field))
        return Light(math.degrees(math.acos(min(1.0, max(-1.0, cosine)))))

    @property
    def factors(self) -> tuple[float, float]:
        """What |⟨μ_∥⟩|² and the other squares are multiplied by: (1, 1) for isotropic light, (3 cos²β, 1.5 sin²β) for linear."""
        if self.angle_degrees is None:
            return 1.0, 1.0
        cosine = math.cos(math.radians(self.angle_degrees))
        return 3 * cosine**2, 1.5 * (1 - cosine**2)

    def strength(self, of_axes: Sequence[NDArray[Any]], field: Vector) -> Floats:
        """From elements of μ_X, μ_Y and μ_Z, arrays of one shape; field: of length 1."""
        if self.direction is not None:
            return 3 * _square(of_axes, self.direction)
        along, across = self.factors
        parallel = _square(of_axes, field)
        whole = np.sum([np.abs(component) ** 2 for component in of_axes], axis=0)
        return np.asarray(along * parallel + across * np.maximum(whole - parallel, 0.0))

    @property
    def text(self) -> str:
        """As it is reported."""
        if self.direction is not None:
            return f"along ({', '.join(f'{x:g}' for x in self.direction)})"
        names = {angle: name for name, angle in LIGHT.items()}
        return names.get(self.angle_degrees, f"{self.angle_degrees}° to the field")


def _square(of_axes: Sequence[NDArray[Any]], vector: Vector) -> Floats:
    x, y, z = (part * axis for part, axis in zip(vector, of_axes, strict=True))
    return np.asarray(np.abs(x + y + z) ** 2)


def light_of(light: LightText) -> Light:
    """From a name in `LIGHT`, an angle with the field in degrees, or three components along X, Y, Z; ValueError for others.

    >>> light_of("perpendicular").factors
    (1.1248198369963932e-32, 1.5)
    """
    if isinstance(light, str) and light in LIGHT:
        return Light(LIGHT[light])
    try:
        numbers = np.atleast_1d(np.asarray(light, dtype=np.float64))
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
