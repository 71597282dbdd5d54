"""The accuracy setting of maps of levels in a field: the tolerance of the energies, from which J max follows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from rotor.requests.knob import Knob, Measure

TOLERANCES_MHZ = (1e3, 1e2, 1e1, 1.0, 1e-1, 1e-2, 1e-4, 1e-6)
LEAST_MHZ = 1e-9


def largest_difference(first: Any, other: Any) -> float:
    """The largest difference of two arrays of one shape."""
    return float(np.max(np.abs(np.asarray(first) - np.asarray(other)), initial=0.0))


def _with_tolerance(request: Any, name: str, value: Any) -> Any:
    """The request with a tolerance of energies; the population at the edge of the basis, which affects only cosines, is not limited."""
    free = {"most_at_edge": 1.0} if hasattr(request, "most_at_edge") else {}
    return replace(request, **{name: value}, **free)


def _energies_alone(request: Any) -> Any:
    """The request without criteria other than energies, so that a small basis is not refused."""
    changes = {"diabatic_gap_mhz": None, "most_at_edge": 1.0}
    return replace(request, **{name: value for name, value in changes.items() if hasattr(request, name)})


def _finest(request: Any) -> float:
    """Tolerance of the reference: a hundredth of the finest one that is compared."""
    return float(max(1e-2 * min(*TOLERANCES_MHZ, request.tolerance_mhz), LEAST_MHZ))


ENERGY = Measure(
    "energy", "MHz", lambda answer, reference: largest_difference(answer.states.energy_mhz, reference.states.energy_mhz)
)
TOLERANCE = Knob(
    TOLERANCES_MHZ, _finest, (ENERGY,), "a tolerance of {:g} MHz", LEAST_MHZ, _with_tolerance, _energies_alone,
    used=lambda request: request.jmax is None,
)  # fmt: skip
