"""Error budgets of levels and of quantities derived from them (`rotor.requests.budget`).

Rounding: computed eigenvalues are exact for a matrix that differs by a few units in the last place of the norm (LAPACK Users' Guide,
section 4.7), so that no energy has an error above `ROUNDING` times the largest energy. Truncation: each J of a free top is a complete
block; an approximate treatment of spins has its own bound. Model: the sum of the sizes of neglected effects.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotor.quantum.estimates.beyond import ESTIMATED, ZERO_POINT, Limit
from rotor.quantum.estimates.uncertainty import ESTIMATES, known_covariance, level_spread, source_of_errors
from rotor.quantum.hyperfine_method import used_method
from rotor.quantum.tabulated import tabulated_level_errors
from rotor.requests.budget import ROUNDING, ErrorBudget, ErrorTerm

if TYPE_CHECKING:
    from rotor.arrays import Floats
    from rotor.quantum.levels import Levels
    from rotor.tops.top import Top

NO_SAMPLES = ErrorTerm(0.0, "nothing is sampled")
NO_UNCERTAINTIES = "no uncertainties of the constants are known"


def rounding_term(energies_mhz: Floats) -> ErrorTerm:
    """Rounding error of energies, from the largest of them."""
    return ErrorTerm(ROUNDING * float(np.abs(energies_mhz).max(initial=0.0)), "eigenvalues in double precision")


def truncation_term(levels: Levels) -> ErrorTerm:
    """Truncation error of levels: zero, or the bound of an approximate treatment of spins."""
    used = used_method(levels)
    if used is None or not used.estimate_mhz:
        return ErrorTerm(0.0, "every J is a complete block")
    return ErrorTerm(used.estimate_mhz, f"spins by the method {used.method}", "the exact method of spins")


def model_term(limits: Sequence[Limit]) -> ErrorTerm:
    """The sum of the sizes of neglected effects, named after the largest; effects without a size are listed.

    >>> model_term([Limit("centrifugal distortion", 2.0, ""), Limit("electron spin", None, "")]).text("MHz")
    '2 MHz (centrifugal distortion; electron spin not estimated)'
    >>> model_term([Limit("centrifugal distortion of order J^8", 734.0, "", levels="J = 30, K up to 30")]).text("MHz")
    '730 MHz (centrifugal distortion of order J^8 at J = 30, K up to 30)'
    """
    sizes = [(limit.size_mhz, limit.name, limit.levels) for limit in limits if limit.size_mhz is not None]
    unknown = ", ".join(limit.name for limit in limits if limit.size_mhz is None)
    if not sizes:
        return ErrorTerm(None, unknown or "no effect that is left out has a known size")
    _, largest, levels = max(sizes)
    source = largest + (f" at {levels}" if levels else "") + (f" and {len(sizes) - 1} more" if len(sizes) > 1 else "")
    remedy = "measured constants" if largest in (ZERO_POINT, ESTIMATED) else f"{largest} in the calculation"
    return ErrorTerm(
        float(sum(size for size, *_ in sizes)), source + (f"; {unknown} not estimated" if unknown else ""), remedy
    )


def data_term(errors_mhz: Floats | None, source: str | None) -> ErrorTerm:
    """The largest standard deviation due to uncertain constants.

    errors_mhz: of the energies or lines; None if unknown. source: origin of the errors, or why there are none.
    """
    if errors_mhz is None or not len(errors_mhz):
        return ErrorTerm(None, (source or NO_UNCERTAINTIES).removeprefix("none: "))
    if source is not None and source.startswith(ESTIMATES):
        return ErrorTerm(float(errors_mhz.max()), f"estimated constants: {source}", "measured constants")
    return ErrorTerm(float(errors_mhz.max()), f"constants: {source}", "more precise constants")


def parameter_names(top: Top, levels: Levels) -> tuple[str, ...]:
    """The constants on which levels depend, each once."""
    return tuple(dict.fromkeys(name for effect in levels.effects for name in effect.parameters(top)))


def energy_errors(top: Top, levels: Levels) -> Floats | None:
    """One standard deviation (levels,) in MHz of every energy above the lowest level that exists; None where no errors are known.

    σ² = d C dᵀ with d = ∂E/∂c - ∂E₀/∂c, E₀ the lowest level (`rotor.quantum.estimates.uncertainty`). Constants without an uncertainty
    count as exact. Errors of a level table count from J = 0, whichever level is the lowest; nan for a level that is missing in the table.
    """
    covariance = known_covariance(top, parameter_names(top, levels))
    if covariance is None:
        return tabulated_level_errors(top, levels)
    spread = level_spread(top, levels, covariance)
    existing = np.flatnonzero(levels.weight > 0)
    lowest = existing[np.argmin(levels.energy_mhz[existing])] if len(existing) else 0
    return np.asarray(np.linalg.norm(spread - spread[lowest], axis=1))


def levels_budget(top: Top, levels: Levels, errors_mhz: Floats | None, limits: Sequence[Limit]) -> ErrorBudget:
    """The errors of energies.

    errors_mhz: of the levels shown, from `energy_errors`. limits: what the calculation leaves out, at the highest J.
    """
    known = None if errors_mhz is None else errors_mhz[np.isfinite(errors_mhz)]
    if known is not None and len(known) and top.level_table is not None:
        data = ErrorTerm(float(known.max()), "the table of energies")
    else:
        data = data_term(known, source_of_errors(top, parameter_names(top, levels), None))
    return ErrorBudget(
        of="energies",
        unit="MHz",
        rounding=rounding_term(levels.energy_mhz),
        truncation=truncation_term(levels),
        model=model_term(limits),
        data=data,
        statistics=NO_SAMPLES,
    )
