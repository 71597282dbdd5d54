"""Accuracy and plan of a classical gas: the number of molecules. Their motion is exact.

| accuracy of | molecules | error stated |
|---|---|---|
| temperature of the kinetic energy, "1 K" | z T √(2/fN) | the same |
| heat capacity var(E)/kT², "1 %" | z √((2 + 12/f)/N) | the same |
| C1 and C2 at each time, "2 %" or 0.02 | z s/√N, s of a small gas | from the spread in the run |

The energy E of the f degrees of freedom of one molecule has a gamma distribution of shape f/2: mean f kT/2, variance f (kT)²/2, excess
kurtosis κ = 12/f. For N independent values the mean has the variance var/N, and the variance has var² (2/(N - 1) + κ/N). z is the
two-sided quantile of the confidence of the scene. The effects neglected by rigid classical molecules are stated as the terms a/T and d T
of ln Q (`rotor.thermodynamics.sums.classical_limit`).
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.requests.knob import NOTHING_CHEAPER, Estimate, Knob, Measure, Sought
from rotor.requests.numerics import Goal, Numerics
from rotor.requests.plan import Cost, Growth, LeftOut, largest_first

if TYPE_CHECKING:
    from rotor.thermodynamics.gas.classical_gas import GasAnswer, GasRequest
    from rotor.tops.top import Top

PILOT_MOLECULES = 2_000
MOLECULES = (100, 300, 1_000, 3_000, 10_000)
SEEDS = 8  # gases whose errors are averaged
MOST_IN_REFERENCE = 200_000
SHORT_GAS = (500, 2000)  # of the calibration
STORED_SHARE = 0.13  # memory of a stored molecule, 136 bytes, over that of one at work


def quantile(confidence: float) -> float:
    """z of a two-sided interval of a normal distribution.

    >>> round(quantile(0.99), 4)
    2.5758
    """
    from statistics import NormalDist

    return NormalDist().inv_cdf(0.5 + 0.5 * confidence)


def count_degrees_per_molecule(request: GasRequest) -> int:
    """Degrees of freedom of one molecule; bare constants have no mass and hence no translation."""
    from rotor.statistics.degrees_of_freedom import count_degrees

    degrees = count_degrees([request.top.moments_u_angstrom2])
    return round(degrees.rotation + (degrees.translation if request.top.mass_u is not None else 0))


def relative_spread(unit: str, degrees: int) -> float:
    """Relative standard error times √N of the temperature ("K") or of the heat capacity ("%").

    >>> relative_spread("K", 6), relative_spread("%", 6)
    (0.5773502691896257, 2.0)
    """
    return math.sqrt(2.0 / degrees) if unit == "K" else math.sqrt(2.0 + 12.0 / degrees)


def _enough_molecules(sought: Sought) -> list[int]:
    """As many molecules as an accuracy of the temperature (K), the heat capacity (%), or C1 and C2 needs, at most those of a run."""
    from rotor.thermodynamics.gas.classical_gas import MOST_MOLECULES

    deviation = sought.known["deviation"] = _deviation(sought.request, sought.unit)
    return [min(max(math.ceil((deviation / sought.accuracy) ** 2), 2), MOST_MOLECULES)]


def _count_error(sought: Sought, request: Any, count: int) -> Estimate:
    error = sought.known["deviation"] / math.sqrt(count)
    return Estimate(error, remark=f", at a confidence of {request.confidence:g}")


def _deviation(request: GasRequest, unit: str) -> float:
    """Half-width of the confidence interval times √N, in the unit of the accuracy."""
    z = quantile(request.confidence)
    if unit:
        scale = request.temperature_k if unit == "K" else 100.0
        return z * scale * relative_spread(unit, count_degrees_per_molecule(request))
    from rotor.thermodynamics.gas.classical_gas import answer_gas

    pilot = answer_gas(replace(request, molecules=PILOT_MOLECULES))
    # margin: the spread itself has an error of a few percent
    return 1.1 * z * _largest_error(pilot) * math.sqrt(PILOT_MOLECULES)


def _largest_error(answer: GasAnswer) -> float:
    """The largest standard error of C1 and C2."""
    curves = answer.correlations
    assert curves is not None
    return max(float(error.max()) for error in (curves.c1_error, curves.c2_error) if error is not None)


def gas_error(unit: str, answer: GasAnswer) -> float:
    """Half-width of the confidence interval of the result at the requested confidence."""
    request = answer.request
    if unit:
        return _deviation(request, unit) / math.sqrt(request.molecules)
    return quantile(request.confidence) * _largest_error(answer)


def _mean_square(errors: list[float]) -> float:
    return math.sqrt(sum(error * error for error in errors) / len(errors))


def _temperature_error(answers: list[Any], _: Any) -> float:
    """Rms error of the kinetic temperature in K."""
    return _mean_square(
        [_energies(answer).mean() / _degrees(answer) * 2 - answer.request.temperature_k for answer in answers]
    )


def _heat_capacity_error(answers: list[Any], _: Any) -> float:
    """Rms error in percent of C_v = var(E)/kT² per molecule; exact: f k/2 for f degrees of freedom."""
    return _mean_square(
        [
            100 * (_energies(answer).var() / (0.5 * _degrees(answer) * answer.request.temperature_k**2) - 1)
            for answer in answers
        ]
    )


def _energies(answer: Any) -> Any:
    """The kinetic energy of each molecule over k, in K."""
    from rotor import units

    return sum(answer.ensemble.kinetic.energies.values()) / units.EV_PER_K


def _degrees(answer: Any) -> int:
    return len(answer.ensemble.kinetic.energies)


def _curve_error(answer: Any, reference: Any) -> float:
    pairs = [(getattr(answer.correlations, name), getattr(reference.correlations, name)) for name in ("c1", "c2")]
    return max(float(np.max(np.abs(curve - true))) for curve, true in pairs if curve is not None)


def _gases(request: Any) -> list[Any]:
    """Gases that differ in their seeds."""
    from rotor.thermodynamics.gas.classical_gas import answer_gas

    return [answer_gas(replace(request, seed=request.seed + 10 * number)) for number in range(SEEDS)]


def _held(request: Any, molecules: float) -> float:
    """Memory of a gas, in molecules at work: a piece is propagated at once, others are stored."""
    from rotor.classical.gas.ensembles import PIECE

    return min(molecules, PIECE) + STORED_SHARE * max(molecules - PIECE, 0.0)


def _molecules(**more: Any) -> Knob:
    """The number of molecules."""
    return Knob(
        lambda request: [count for count in MOLECULES if count < request.molecules],
        lambda request: min(100 * request.molecules, MOST_IN_REFERENCE),
        key="numerics.molecules",
        title="number of molecules",
        attribute="molecules",
        label="{:.0f}".format,
        tried=_enough_molecules,
        error=_count_error,
        text="{} molecules",
        stated=True,
        cost=Growth(SHORT_GAS, memory=_held),
        **more,
    )


KINETIC = _molecules(
    measures=(Measure("temperature", "K", _temperature_error), Measure("heat capacity", "%", _heat_capacity_error)),
    against=lambda _: "kT/2 in every degree of freedom",
    prepare=lambda request: replace(request, times_ps=None),
    reference=lambda request: None,
    answer=_gases,
    repeats=SEEDS,
)
CURVES = _molecules(
    measures=(Measure("C1 and C2", "", _curve_error),),
    against="{} other molecules",
    used=lambda request: request.times_ps is not None,
    reference=lambda request: replace(
        request, molecules=min(100 * request.molecules, MOST_IN_REFERENCE), seed=request.seed + 1
    ),
)


def neglected_in_gas(top: Top, temperature_k: float) -> tuple[LeftOut, ...]:
    """Effects that a classical gas of rigid molecules neglects, in percent of Q, largest first."""
    from rotor.thermodynamics.sums.classical_limit import classical_limit

    limit = classical_limit(top)
    quantum, distortion = abs(limit.a) / temperature_k, abs(limit.d) * temperature_k
    return largest_first(
        [
            LeftOut("quantum corrections", 100 * quantum, "%", f"a/T of ln Q at {temperature_k:g} K"),
            LeftOut("centrifugal distortion", 100 * distortion, "%", f"d T of ln Q at {temperature_k:g} K"),
        ]
    )


def describe_gas(request: Any, _: Cost) -> dict[str, Any]:
    """What a classical gas does."""
    return {
        "effects": ("free rotation of rigid molecules", "free flight"),
        "good": ("energy and angular momentum of every molecule",),
        "parts": (("method", "exact free motion of every molecule (theta functions); no step"),),
        "counts": {"molecules": request.molecules, "times": len(request.times_ps or ())},
        "left_out": neglected_in_gas(request.top, request.temperature_k),
    }


def _without_times(request: Any) -> str:
    """Why an accuracy without a unit does not suit a request."""
    reason = "an accuracy without a unit is one of correlation functions; give observables.times, or the unit K or %"
    return reason if request.times_ps is None else ""


MOTION = Knob(key="the motion of each molecule", fixed=f"{NOTHING_CHEAPER}; theta functions, round-off alone")
GAS = Numerics(
    {
        "K": Goal("temperature", partial(gas_error, "K")),
        "%": Goal("heat capacity", partial(gas_error, "%")),
        "": Goal("C1 and C2", partial(gas_error, ""), _without_times),
    },
    percent=lambda entries: "%" if entries.values.get("observables.times") is None else "",  # C1 and C2 are 1 at first
    knobs=(KINETIC, CURVES, MOTION),
    describe=describe_gas,
)
