"""Error budget of the brightness of a source (`rotor.requests.budget`), at the line where it is brightest.

T_B = C (1 - e^-τ), τ = τ0 exp(-4 ln 2 x²), x = (ν - ν0)/Δν. With u = τ the slope is |dT_B/dx| = C u e^-u 8 ln 2 |x|: at most
√(8 ln 2/e) C τ0 for any depth (at one standard deviation of a thin line), and at most √(8 ln 2/e) C (1 + √ln τ0) of a thick line, where
|x| = √(ln(τ0/u)/4 ln 2) and u e^-u is below 1/e. A frequency that is off by δ makes an error of so much times δ/Δν, and no more than the
whole line. A line that is left out adds C τ at most, and T_B is off by at most the relative error of Q.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor import units
from rotor.quantum.estimates.budgets import NO_SAMPLES, model_term
from rotor.quantum.estimates.limits import every_limit, populated_j
from rotor.requests.budget import ROUNDING, ErrorBudget, ErrorTerm
from rotor.spectra.emission import KM_PER_S, contrast_k
from rotor.spectra.emitters import CatalogueLines

if TYPE_CHECKING:
    from rotor.quantum.estimates.beyond import Limit

STEEPEST = math.sqrt(8 * math.log(2) / math.e)


def steepness(depth: float) -> float:
    """Bound of |dT_B/dx| over C, the brightness of an opaque layer.

    >>> round(steepness(1e-3) / 1e-3, 3), round(steepness(100.0), 3)
    (1.428, 4.493)
    """
    return STEEPEST * min(depth, 1 + math.sqrt(math.log(max(depth, 1.0))))


def brightness_budget(answer: Any) -> ErrorBudget:
    """The errors of T_B in K at the brightest line; those of the background alone where there is no line."""
    request, peak = answer.request, answer.peak
    number = 0 if peak is None else int(answer.lines.molecule[peak.row])
    molecule, source, lines = request.molecules[number], request.sources[number], answer.emitted[number]
    observed = np.mean(request.range_mhz) if peak is None else peak.observed_mhz
    opaque = source.filling * abs(float(contrast_k(observed, source)))
    brightness, depth = (0.0, 0.0) if peak is None else (abs(peak.brightness_k), peak.optical_depth)
    per_mhz = opaque * steepness(depth) / (float(observed) * source.fwhm_km_s / KM_PER_S)
    rounding_mhz = 2 * ROUNDING * units.MHZ_PER_K * float(lines.energy_upper_k.max(initial=0.0))
    left_out = math.fsum(one.left_out_depth for one in answer.emitted)
    limits: Sequence[Limit] = ()
    if not isinstance(molecule, CatalogueLines):
        limits = every_limit(molecule, populated_j(molecule, source.excitation_k), lines.effects)
    return ErrorBudget(
        of="brightness",
        unit="K",
        rounding=ErrorTerm(
            per_mhz * rounding_mhz + 16 * sys.float_info.epsilon * brightness, "frequencies in double precision"
        ),
        truncation=ErrorTerm(
            opaque * left_out + brightness * lines.q_error,
            f"lines of an optical depth below {request.least_depth:g}, together {left_out:.1g} at the most, and Q",
            "a smaller least depth",
        ),
        model=_model(limits, per_mhz, brightness, isinstance(molecule, CatalogueLines)),
        data=ErrorTerm(None, "dipoles and conditions of the source have no stated uncertainty"),
        statistics=NO_SAMPLES,
    )


def _model(limits: Sequence[Limit], per_mhz: float, brightness: float, catalogue: bool) -> ErrorTerm:
    """What frequencies that are off make of T_B at the centre of the line."""
    if catalogue:
        return ErrorTerm(None, "a catalogue does not say what its lines leave out")
    term = model_term(limits)
    if term.value is None:
        return term
    return ErrorTerm(
        min(term.value * per_mhz, brightness), f"lines shifted by {term.value:.2g} MHz: {term.source}", term.remedy
    )
