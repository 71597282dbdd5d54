"""Error budgets of levels and of quantities derived from them (`rotor.requests.budget`).

Rounding: computed eigenvalues are exact for a matrix that differs by a few units in the last place of the norm (LAPACK Users' Guide,
section 4.7), so that no energy has an error above `ROUNDING` times the largest energy. Truncation: each J of a free top is a complete
block; an approximate treatment of spins has its own bound. Model: the sum of the sizes of neglected effects. Data: uncertain constants,

    σ² = d C dᵀ,      C the covariance of the constants, d = ∂E/∂c of a level, ∂E′/∂c - ∂E″/∂c of a line

to first order, which is enough as long as levels are linear in their constants over one σ. Neglected effects of the Hamiltonian are not
included. With C = F Fᵀ the variance is the squared length of the row d F, so that a list of lines needs only the rows of its levels.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.estimates.limits import ESTIMATED, ZERO_POINT, Limit
from rotor.quantum.hyperfine_method import used_method
from rotor.quantum.levels import Levels
from rotor.quantum.tabulated import tabulated_level_errors
from rotor.requests.budget import ROUNDING, ErrorBudget, ErrorTerm
from rotor.tops.constants.covariance import Covariance

if TYPE_CHECKING:
    from rotor.tops.top import Top

ESTIMATES = "estimated errors"
_AT_ONCE = 1 << 16  # lines computed at a time


def level_spread(top: Top, levels: Levels, covariance: Covariance) -> Floats:
    """∂E/∂c F of each level, (levels, n) in MHz; errors are lengths of its rows and of their differences."""
    return np.asarray(level_derivatives(top, levels, covariance.names) @ covariance.factor)


def level_errors(top: Top, levels: Levels, covariance: Covariance) -> Floats:
    """One standard deviation of each energy, (levels,) in MHz, relative to the zero of the Hamiltonian.

    >>> from rotor.tops.constants.constants import Constants
    >>> from rotor.quantum.solve import solve_levels
    >>> from rotor.tops.top import Top
    >>> top = Top(Constants(B=6000.0, uncertainties={"B": 0.1}))
    >>> covariance = Covariance.from_uncertainties(top.constants)
    >>> level_errors(top, solve_levels(top, 2), covariance).round(9).tolist()
    [0.0, 0.2, 0.6]
    """
    return np.asarray(np.linalg.norm(level_spread(top, levels, covariance), axis=1))


def line_errors(spread: Floats, upper: NDArray[np.integer], lower: NDArray[np.integer]) -> Floats:
    """One standard deviation of the lines `upper` ← `lower`, (lines,) in MHz, from `level_spread`."""
    out = np.empty(len(upper))
    for start in range(0, len(upper), _AT_ONCE):
        here = slice(start, start + _AT_ONCE)
        difference = spread[upper[here]] - spread[lower[here]]
        out[here] = np.sqrt(np.einsum("ij,ij->i", difference, difference))
    return out


def known_covariance(top: Top, parameters: Collection[str]) -> Covariance | None:
    """Covariance of these parameters: that of the top, else its uncertainties if they count as uncorrelated.

    Estimated errors of A, B, C (`Top.estimated_errors_mhz`), and uncertainties of spin constants and internal rotors that the covariance
    does not contain, enter as uncorrelated; those of internal rotors only where correlations are known to be absent. None for a top with a
    table of energies, which do not follow from its constants, and if correlations are not known.
    """
    if top.level_table is not None:
        return None
    if top.covariance is None:
        covariance = Covariance.from_uncertainties(top.constants) if top.independent_errors else None
    else:
        covariance = top.covariance.of(parameters)
    estimates = top.estimated_errors_mhz
    if covariance is None and not estimates:
        return None
    covariance = covariance or Covariance((), np.zeros((0, 0)))
    further = {**estimates, **(top.spin_constants.uncertainties if top.spin_constants else {})}
    if top.internal_rotation is not None and top.independent_errors:
        further |= top.internal_rotation.uncertainties
    alone = {
        name: error for name, error in further.items() if error and name in parameters and name not in covariance.names
    }
    return covariance.beside(alone) if alone else covariance


def without_errors(top: Top, parameters: Collection[str], covariance: Covariance | None) -> list[str]:
    """Constants that count as exact beside others with errors; `covariance` replaces that of the top."""
    used = covariance or known_covariance(top, parameters)
    if used is None:
        return []
    values = {**top.constants.values, **(top.spin_constants.values if top.spin_constants else {})}
    return [name for name in parameters if values.get(name) and name not in used.names]


def source_of_errors(top: Top, parameters: Collection[str], covariance: Covariance | None) -> str | None:
    """Text on the uncertainties behind errors of frequencies, None without any; `covariance` replaces that of the top."""
    if covariance is None and top.level_table is not None:
        unknown = top.level_table.own_error_mhz is None
        return "none: the energies are from a table" if unknown else "the table of energies"
    used = covariance or known_covariance(top, parameters)
    if used is None:
        has_uncertainties = top.constants.uncertainties and top.covariance is None
        return "none: the constants are from a fit whose correlations are not known" if has_uncertainties else None
    together = covariance or (top.covariance.of(parameters) if top.covariance else None)
    estimates = [name for name in used.names if covariance is None and name in top.estimated_errors_mhz]
    alone = [name for name in used.names if name not in estimates and (together is None or name not in together.names)]
    texts = [f"{ESTIMATES} of {', '.join(estimates)}, uncorrelated"] if estimates else []
    texts += [f"covariance of {', '.join(together.names)}"] if together else []
    texts += [f"uncertainties of {', '.join(alone)}, uncorrelated"] if alone else []
    return "; ".join(texts)


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

    σ² = d C dᵀ with d = ∂E/∂c - ∂E₀/∂c, E₀ the lowest level (`level_spread`). Constants without an uncertainty
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
