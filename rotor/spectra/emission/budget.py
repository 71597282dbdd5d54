"""Error budget of the brightness of a source (`rotor.requests.budget`) at its brightest line.

T_B = C (1 - e^-τ), τ = τ0 exp(-4 ln 2 x²), x = (ν - ν0)/Δν. With u = τ the slope is |dT_B/dx| = C u e^-u 8 ln 2 |x|. It is at most
√(8 ln 2/e) C τ0 for any depth (reached one standard deviation from the centre of a thin line), and at most √(8 ln 2/e) C (1 + √ln τ0) for
a thick line, where |x| = √(ln(τ0/u)/4 ln 2) and u e^-u is below 1/e. A frequency error δ changes T_B by at most this slope times δ/Δν,
and by at most the whole line. A neglected line adds at most C τ; the relative error of Q is at most that of T_B.

To first order, neglected spin couplings do not shift a line: they split it about its centre of gravity. The centre loses a part f of its
depth, that is C (e^-τ(1-f) - e^-τ) of its brightness. For quadrupole coupling f follows from the components of the line
(`rotor.quantum.estimates.splittings.depth_lost`); for other couplings, of size δ, it is at most 1 - exp(-4 ln 2 (δ/Δν)²).
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor import units
from rotor.quantum.estimates.budgets import NO_SAMPLES, model_term
from rotor.quantum.estimates.limits import ELECTRON_SPIN, ESTIMATED, QUADRUPOLE, Limit, all_limits
from rotor.quantum.estimates.splittings import depth_lost, splitting_nuclei
from rotor.requests.budget import ROUNDING, ErrorBudget, ErrorTerm, size_text
from rotor.spectra.emission.emission import KM_PER_S, contrast_k
from rotor.spectra.emission.emitters import CatalogueLines

if TYPE_CHECKING:
    from rotor.tops.top import Top

# couplings that split lines about their centre of gravity
SPLITTING = frozenset({QUADRUPOLE, "spin-rotation", "spin-spin", ELECTRON_SPIN})
STEEPEST = math.sqrt(8 * math.log(2) / math.e)


def steepness(depth: float) -> float:
    """Bound of |dT_B/dx| over C, the brightness of an opaque layer.

    >>> round(steepness(1e-3) / 1e-3, 3), round(steepness(100.0), 3)
    (1.428, 4.493)
    """
    # a saturated line is flat at the top and steep at its edges, √ln τ widths away
    return STEEPEST * min(depth, 1 + math.sqrt(math.log(max(depth, 1.0))))


def brightness_budget(answer: Any) -> ErrorBudget:
    """Error budget of T_B (K) at the brightest line, or of the background if there is no line."""
    request, peak = answer.request, answer.peak
    number = 0 if peak is None else int(answer.lines.molecule[peak.row])
    source, lines = request.sources[number], answer.emitted[number]
    observed = np.mean(request.range_mhz) if peak is None else peak.observed_mhz
    opaque = source.filling * abs(float(contrast_k(observed, source)))
    brightness, depth = (0.0, 0.0) if peak is None else (abs(peak.brightness_k), peak.optical_depth)
    per_mhz = opaque * steepness(depth) / (float(observed) * source.fwhm_km_s / KM_PER_S)
    rounding_mhz = 2 * ROUNDING * units.MHZ_PER_K * float(lines.energy_upper_k.max(initial=0.0))
    left_out = math.fsum(species.left_out_depth for species in answer.emitted)
    return ErrorBudget(
        of="brightness",
        unit="K",
        rounding=ErrorTerm(
            per_mhz * rounding_mhz + 16 * sys.float_info.epsilon * brightness, "frequencies in double precision"
        ),
        truncation=ErrorTerm(
            opaque * left_out + brightness * lines.q_error,
            f"lines of an optical depth below {request.least_depth:g}, together at most {left_out:.1g}, and Q",
            "a smaller least depth",
        ),
        model=_model(answer, number, per_mhz, opaque),
        data=ErrorTerm(None, "dipoles and conditions of the source have no stated uncertainty"),
        statistics=NO_SAMPLES,
    )


def _model(answer: Any, number: int, per_mhz: float, opaque: float) -> ErrorTerm:
    """Error of T_B at the centre of the brightest line from shifted frequencies and neglected splittings."""
    request, peak, lines = answer.request, answer.peak, answer.emitted[number]
    top = request.molecules[number]
    if isinstance(top, CatalogueLines):
        return ErrorTerm(None, "a catalogue does not state what its lines neglect")
    limits = [*all_limits(top, lines.typical_j, lines.effects), *_estimated(top, peak)]
    splittings = [limit for limit in limits if limit.name in SPLITTING and limit.size_mhz is not None]
    shifts = model_term([limit for limit in limits if limit not in splittings])
    if peak is None or not splittings:
        return _shifted(shifts, per_mhz, 0.0 if peak is None else abs(peak.brightness_k))
    split = _split(answer, number, splittings, opaque)
    if shifts.value is None:
        complete = len(splittings) == len(limits)
        return split if complete else replace(split, source=f"{split.source}; {shifts.source} not estimated")
    shift = _shifted(shifts, per_mhz, abs(peak.brightness_k))
    larger, smaller = sorted((shift, split), key=lambda term: -(term.value or 0.0))
    # an error cannot exceed the brightness
    whole = min((larger.value or 0.0) + (smaller.value or 0.0), abs(peak.brightness_k))
    return ErrorTerm(whole, f"{larger.source}; {smaller.source}", larger.remedy)


def _estimated(top: Top, peak: Any) -> list[Limit]:
    """The shift of the brightest line by errors of estimated A, B, C, which it shares with them: δν/ν = δB/B."""
    if peak is None or not top.estimated_errors_mhz:
        return []
    return [Limit(ESTIMATED, top.estimated_error * peak.observed_mhz, "")]


def _shifted(term: ErrorTerm, per_mhz: float, brightness: float) -> ErrorTerm:
    """Error of T_B from shifts in MHz, at most the whole line."""
    if term.value is None:
        return term
    text = f"lines shifted by {size_text(term.value, 'MHz')}: {term.source}"
    # an error cannot exceed the brightness
    return ErrorTerm(min(term.value * per_mhz, brightness), text, term.remedy)


def _split(answer: Any, number: int, splittings: Sequence[Limit], opaque: float) -> ErrorTerm:
    """Loss of T_B at the centre of the brightest line through splittings."""
    peak, width = answer.peak, answer.peak.observed_mhz * answer.request.sources[number].fwhm_km_s / KM_PER_S
    remaining = 1.0
    for limit in splittings:
        if limit.name == QUADRUPOLE:
            remaining *= 1 - _quadrupole_loss(answer, number, width)
        else:
            remaining *= _gaussian((limit.size_mhz or 0.0) / width)
    names = ", ".join(limit.name for limit in splittings)
    left = math.exp(-peak.optical_depth * remaining)  # of the background behind the line
    return ErrorTerm(
        opaque * left * -math.expm1(-peak.optical_depth * (1 - remaining)),
        f"{names}: {100 * (1 - remaining):.2g} % of the depth split off the centre of the line",
        f"{splittings[0].name} in the calculation",
    )


def _gaussian(x: float) -> float:
    """Relative depth of a line at x full widths from its centre."""
    return math.exp(-4 * math.log(2) * x**2)


def _quadrupole_loss(answer: Any, number: int, width_mhz: float) -> float:
    """Part of the depth that quadrupole coupling takes from the centre of the brightest line."""
    top, row, quanta = answer.request.molecules[number], answer.peak.row, answer.emitted[number].quanta
    upper, lower = (text[row].split() for text in (answer.lines.upper, answer.lines.lower))
    k = 0 if top.kind == "linear" else abs(int(lower[quanta.index("k")])) if "k" in quanta else None
    j = quanta.index("n" if "n" in quanta else "j")
    return depth_lost(splitting_nuclei(top), (int(upper[j]), int(lower[j])), k, width_mhz)
