"""Free rotation of a molecule at a temperature: from a top to a `TumbleRequest` in ps, ħ and cm⁻¹."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotor import units
from rotor.arrays import Floats
from rotor.checks import require_positive
from rotor.classical.gas.thermal_momentum import mean_thermal_momentum, off_intermediate_axis
from rotor.classical.motion import Units
from rotor.classical.tumble import Three, TumbleRequest
from rotor.tops.facts import top_facts
from rotor.tops.top import Top

TEMPERATURE_K = 300.0
TILT_DEGREES = 0.5
# moments in u Å², energies in eV
MOLECULAR = Units("ps", "ħ", "cm-1", units.ASE_TIME_PS, 1.0 / units.HBAR_CLASSICAL, units.CM_PER_EV, "u Å²")


@dataclass(frozen=True)
class MolecularTumble(TumbleRequest):
    """The free rotation of a molecule. top: source of the moments. temperature_k: that of |L|, if |L| is a thermal mean."""

    top: Top | None = None
    temperature_k: float | None = None

    def about(self) -> dict[str, Any]:
        """Facts about the top, by the keys of docs/verbs."""
        assert self.top is not None
        return {**top_facts(self.top), "temperature_k": self.temperature_k}

    @property
    def relative_errors(self) -> Floats | None:
        """Stated or estimated relative errors of A, B, C, those of the moments too; None if one of them is not known."""
        assert self.top is not None
        constants, known = self.top.constants, {**self.top.constants.uncertainties, **self.top.estimated_errors_mhz}
        errors = {
            value: known.get(name, math.nan) for name, value in constants.values.items() if name in ("A", "B", "C")
        }
        rotations = [value for value in self.top.rotational_constants_mhz if math.isfinite(value)]
        linear = [0.0] * (3 - len(rotations))
        relative = np.array([*linear, *(errors.get(value, math.nan) / value for value in rotations)])
        return None if np.isnan(relative).any() else relative


def thermal_tumble(
    top: Top,
    *,
    temperature_k: float = TEMPERATURE_K,
    angular_momentum_hbar: Sequence[float] | None = None,
    times_ps: Sequence[float] | None = None,
) -> MolecularTumble:
    """The request for the free rotation of a top, distortion neglected.

    Parameters
    ----------
    top : Top
        Its moments of inertia are those of the constants.
    temperature_k : float
        Temperature of the thermal mean ⟨|L|⟩, which is taken half a degree off the intermediate axis.
    angular_momentum_hbar : (3,), optional
        Angular momentum along a, b, c in ħ, instead of the thermal mean.
    times_ps : (n,), optional
        Times of the table in ps. Default: two periods of the motion.

    Returns
    -------
    MolecularTumble
        With angular momenta in ħ, times in ps and energies in cm⁻¹.

    Raises
    ------
    ValueError
        A temperature not above 0 K; an angular momentum along the axis of a linear molecule.

    Examples
    --------
    >>> from rotor.tops.top import Top
    >>> request = thermal_tumble(Top.from_constants("A=10 B=10 C=10 GHz"))
    >>> round(math.hypot(*request.angular_momentum), 2)  # √(4 kT/πhB), kT/h = 6250.98 GHz
    28.21
    """
    a, b, c = top.moments_u_angstrom2
    times = None if times_ps is None else tuple(float(t) for t in times_ps)
    if angular_momentum_hbar is not None:
        x, y, z = (float(m) for m in angular_momentum_hbar)
        return MolecularTumble((a, b, c), (x, y, z), times, MOLECULAR, ("a", "b", "c"), top=top)
    momentum, source = _thermal((a, b, c), temperature_k)
    return MolecularTumble(
        (a, b, c), momentum, times, MOLECULAR, ("a", "b", "c"), source, top=top, temperature_k=temperature_k
    )


def _thermal(moments: Three, temperature_k: float) -> tuple[Three, str]:
    """The vector of the thermal mean |L| in ħ, half a degree off the intermediate axis, and a sentence that describes it."""
    require_positive("temperature_k", temperature_k, "K")
    size = float(mean_thermal_momentum(moments, units.EV_PER_K * temperature_k)) * MOLECULAR.momentum_factor
    x, y, z = off_intermediate_axis(np.array(moments), size, math.radians(TILT_DEGREES)).tolist()
    mean = f"the thermal mean of |L| at {temperature_k:g} K"
    if moments[0] == 0.0:
        return (x, y, z), f"{mean} (two degrees of freedom), across the axis"
    return (x, y, z), f"{mean} (classical), {TILT_DEGREES:g} degrees off axis b, half way between a and c"
