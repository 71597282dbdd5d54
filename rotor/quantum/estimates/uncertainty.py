"""Errors of levels and lines due to uncertain constants.

    σ² = d C dᵀ,      C the covariance of the constants, d = ∂E/∂c of a level, ∂E′/∂c - ∂E″/∂c of a line

to first order, which is enough as long as levels are linear in their constants over one σ. Neglected effects of the Hamiltonian are not
included. With C = F Fᵀ the variance is the squared length of the row d F, so that a list of lines needs only the rows of its levels.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.levels import Levels
from rotor.tops.covariance import Covariance

if TYPE_CHECKING:
    from rotor.tops.top import Top


ESTIMATES = "estimated errors"
_AT_ONCE = 1 << 16  # lines computed at a time


def level_spread(top: Top, levels: Levels, covariance: Covariance) -> Floats:
    """∂E/∂c F of each level, (levels, n) in MHz; errors are lengths of its rows and of their differences."""
    return np.asarray(level_derivatives(top, levels, covariance.names) @ covariance.factor)


def level_errors(top: Top, levels: Levels, covariance: Covariance) -> Floats:
    """One standard deviation of each energy, (levels,) in MHz, relative to the zero of the Hamiltonian.

    >>> from rotor.tops.constants import Constants
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
