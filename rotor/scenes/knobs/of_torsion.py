"""Knob of the rotation about a bond: the angles of its relaxed scan."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from rotor.scenes.knobs.knob import Knob, Knobs, Measure, ladder

POINTS = (12, 18, 24, 36, 48, 72)  # of a whole turn
FINEST = 144


def torsion(request: Any) -> Knobs:
    """Of a scene of a torsion; without a scan nothing is left to choose, since the basis follows from the energies."""
    from rotor.thermodynamics.torsion_request import answer_torsion, is_scan

    if not is_scan(request.potential):
        return Knobs((), ("basis: its size follows from the highest energy; the error is stated with each run",))
    measures = (Measure("levels", "cm-1", _largest_difference),)
    settings = ladder(POINTS, request.points, lambda count: replace(request, points=int(count)))
    finest = replace(request, points=FINEST)
    return Knobs((Knob("numerics.points", measures, settings, finest, f"{FINEST} angles", answer_torsion),))


def _largest_difference(answer: Any, reference: Any) -> float:
    """Largest difference of the levels above the lowest one, cm⁻¹."""
    one, other = (np.sort(each.levels.columns["above_lowest_cm"]) for each in (answer, reference))
    count = min(len(one), len(other))
    return float(np.abs(one[:count] - other[:count]).max())
