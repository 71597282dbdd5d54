"""Error budget of a partition function (`rotor.requests.budget`), relative to Q.

Rounding: the error of a level is at most `ROUNDING` times the largest energy E_max of its J; the relative error of its Boltzmann factor is
that over kT, and of a sum of n terms n units in the last place. Data: ∂ln Q/∂c = -⟨∂E/∂c⟩/kT. Scaling all constants together gives -U/kT,
shared equally by the f rotations of a rigid top at high temperature: ∂ln Q/∂ln c = -(U/kT)/f for each rotation that c belongs to.
Model: an effect that shifts the line 2B(J + 1) by δ shifts the levels at J by δ J/2, and ln Q by that over kT.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotor.quantum.estimates.budgets import (
    ESTIMATES,
    NO_SAMPLES,
    NO_UNCERTAINTIES,
    known_covariance,
    model_term,
    source_of_errors,
)
from rotor.quantum.estimates.limits import SPIN_LIMITS
from rotor.requests.budget import ROUNDING, ErrorBudget, ErrorTerm
from rotor.thermodynamics.functions import GAS_CONSTANT
from rotor.units import MHZ_PER_K

if TYPE_CHECKING:
    from rotor.quantum.estimates.limits import Limit
    from rotor.thermodynamics.functions import ThermoFunctions
    from rotor.tops.top import Top

EPS = float(np.finfo(np.float64).eps)


def q_budget(functions: ThermoFunctions, j: int, limits: Sequence[Limit], parameters: Sequence[str]) -> ErrorBudget:
    """The errors of the rotational partition function, the largest over its temperatures.

    Parameters
    ----------
    functions : ThermoFunctions
        The functions, with error bounds of their sums.
    j : int
        Typical J at the highest temperature.
    limits : sequence of Limit
        Effects that the Hamiltonian neglects, with their sizes at that J.
    parameters : sequence of str
        Constants of the Hamiltonian.

    Returns
    -------
    ErrorBudget
        Relative to Q.
    """
    return ErrorBudget(
        of="Q, relative",
        unit="",
        rounding=q_rounding(functions),
        truncation=ErrorTerm(
            float(functions.relative_error.max()),
            "levels left out of the sums, of Q, U and C_v",
            "a smaller relative error",
        ),
        model=q_model_error(functions, j, limits),
        data=q_data_error(functions, parameters),
        statistics=NO_SAMPLES,
    )


def q_rounding(functions: ThermoFunctions) -> ErrorTerm:
    """Bound on the rounding error of Q, from the largest energy of the highest J in each sum."""
    largest = max(functions.top.rotational_constants_mhz, key=lambda c: c if math.isfinite(c) else 0.0)
    j = np.maximum(functions.jmax, 0).astype(np.float64)
    energy = largest * j * (j + 1) / (MHZ_PER_K * functions.temperature_k)
    terms = (j + 1) ** (1 if functions.top.kind == "linear" else 2)
    return ErrorTerm(float((ROUNDING * (1 + energy) + EPS * terms).max()), "levels and their sums in double precision")


def q_data_error(functions: ThermoFunctions, parameters: Sequence[str]) -> ErrorTerm:
    """Standard deviation of ln Q from the uncertainties of A, B and C."""
    top = functions.top
    covariance = known_covariance(top, parameters)
    if covariance is None:
        return ErrorTerm(None, (source_of_errors(top, parameters, None) or NO_UNCERTAINTIES).removeprefix("none: "))
    axes, rotations = _constant_axes(top), 2 if top.kind == "linear" else 3
    share = np.array(
        [axes[name] / (rotations * top.constants[name]) if name in axes else 0.0 for name in covariance.names]
    )
    energy = functions.energy_j_per_mol / (GAS_CONSTANT * functions.temperature_k)  # U/RT
    value = float(energy.max(initial=0.0)) * float(np.linalg.norm(share @ covariance.factor))
    if top.estimated_errors_mhz:
        return ErrorTerm(value, f"{ESTIMATES} of A, B, C", "measured constants")
    return ErrorTerm(value, "uncertainties of A, B, C", "more precise constants")


def _constant_axes(top: Top) -> dict[str, int]:
    """The number of axes that each rotational constant belongs to."""
    if top.kind in ("linear", "spherical"):
        return {"B": 2 if top.kind == "linear" else 3}
    return {"asymmetric": {"A": 1, "B": 1, "C": 1}, "prolate": {"A": 1, "B": 2}, "oblate": {"B": 2, "C": 1}}[top.kind]


def q_model_error(functions: ThermoFunctions, j: int, limits: Sequence[Limit]) -> ErrorTerm:
    """Relative size of neglected effects, level shifts over kT; not estimated if vibration is neglected.

    Splittings by spins (`SPIN_LIMITS`) matter most at the lowest temperature; other effects at the highest, with high J populated.
    """
    if functions.vibrations is None:
        return ErrorTerm(None, "vibration is left out", "vibrational states")
    lowest, highest = (MHZ_PER_K * float(end(functions.temperature_k)) for end in (np.min, np.max))
    relative = [_over(limit, lowest if limit.name in SPIN_LIMITS else 2 * highest / j) for limit in limits]
    return model_term(relative)


def _over(limit: Limit, unit_mhz: float) -> Limit:
    return limit if limit.size_mhz is None else replace(limit, size_mhz=limit.size_mhz / unit_mhz)
