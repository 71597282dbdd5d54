"""What uncertain constants make of levels and lines.

    σ² = d C dᵀ,      C the covariance of the constants, d = ∂E/∂c of a level, ∂E′/∂c - ∂E″/∂c of a line

to first order, which is all there is as long as levels are linear in their constants over one σ. The constants are
taken as the only cause: what the Hamiltonian leaves out is no part of it. With C = F Fᵀ the variance is the squared
length of the row d F, so that a list of lines needs the rows of its levels only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats
from rotor.quantum.derivatives import level_derivatives
from rotor.quantum.levels import Levels

if TYPE_CHECKING:
    from rotor.tops.constants import Constants
    from rotor.tops.top import Top


_AT_ONCE = 1 << 16  # lines whose rows are gathered at a time
_NEGATIVE = 1e-4  # a correlation matrix printed with few digits has eigenvalues below zero by so much


@dataclass(frozen=True, eq=False)
class Covariance:
    """Covariance of some constants of a set.

    names: which. matrix_mhz2: (n, n), symmetric, MHz². Constants that are not named are taken as exact.
    Raises ValueError for names given twice, a matrix of another shape, and one that is no covariance.
    """

    names: tuple[str, ...]
    matrix_mhz2: Floats

    def __post_init__(self) -> None:
        matrix = np.asarray(self.matrix_mhz2, dtype=np.float64)
        _refuse_impossible(self.names, matrix)
        object.__setattr__(self, "matrix_mhz2", matrix)

    @classmethod
    def of_uncertainties(cls, constants: Constants) -> Covariance | None:
        """Uncorrelated constants with the uncertainties they carry; None where they carry none.

        Published constants are correlated, which is not printed as often as it should be: errors of lines from
        uncertainties alone are mostly too large.
        """
        if not constants.uncertainties:
            return None
        return cls(tuple(constants.uncertainties), np.diag([s**2 for s in constants.uncertainties.values()]))

    @classmethod
    def of_correlations(cls, names: Sequence[str], uncertainties_mhz: ArrayLike, correlations: ArrayLike) -> Covariance:
        """From standard deviations (n,) in MHz and their correlation coefficients (n, n).

        >>> Covariance.of_correlations(["B", "D"], [0.1, 0.01], [[1, 0.5], [0.5, 1]]).matrix_mhz2.round(6).tolist()
        [[0.01, 0.0005], [0.0005, 0.0001]]
        """
        sigma = np.asarray(uncertainties_mhz, dtype=np.float64)
        matrix = np.asarray(correlations, dtype=np.float64)
        if sigma.shape != (len(names),) or matrix.shape != (len(names), len(names)):
            raise ValueError(
                f"{len(names)} constants with uncertainties of shape {sigma.shape} and correlations of shape "
                f"{matrix.shape}; ({len(names)},) and ({len(names)}, {len(names)}) are wanted"
            )
        if not np.allclose(np.diag(matrix), 1.0):
            raise ValueError("a correlation matrix has 1 on its diagonal; is this a covariance?")
        return cls(tuple(names), matrix * np.outer(sigma, sigma))

    @property
    def factor(self) -> Floats:
        """F with C = F Fᵀ, (n, n), in MHz."""
        sigma = np.sqrt(np.diag(self.matrix_mhz2))
        safe = np.where(sigma > 0, sigma, 1.0)
        values, vectors = np.linalg.eigh(self.matrix_mhz2 / np.outer(safe, safe))
        return np.asarray(sigma[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))


def _refuse_impossible(names: Sequence[str], matrix: Floats) -> None:
    if len(set(names)) != len(names):
        raise ValueError(f"covariance of {', '.join(names)}: a name stands twice")
    if matrix.shape != (len(names), len(names)):
        raise ValueError(
            f"covariance of {len(names)} constants of shape {matrix.shape}: a square of that size is wanted"
        )
    variances = np.diag(matrix)
    if not np.isfinite(matrix).all() or (variances < 0).any():
        raise ValueError("covariance: finite numbers are wanted, and variances of 0 or more")
    sigma = np.sqrt(variances)
    scale = np.outer(np.where(sigma > 0, sigma, 1.0), np.where(sigma > 0, sigma, 1.0))
    if not np.allclose(matrix / scale, matrix.T / scale, rtol=0, atol=1e-9):
        raise ValueError("covariance: a covariance is symmetric, this matrix is not")
    if len(names) and np.linalg.eigvalsh(matrix / scale).min() < -_NEGATIVE:
        raise ValueError("covariance: some combination of the constants has a negative variance; check the matrix")


def level_spread(top: Top, levels: Levels, covariance: Covariance) -> Floats:
    """∂E/∂c F of every level, (levels, n) in MHz; lengths and differences of its rows are errors."""
    return np.asarray(level_derivatives(top, levels, covariance.names) @ covariance.factor)


def level_errors(top: Top, levels: Levels, covariance: Covariance) -> Floats:
    """One standard deviation of every level's energy, (levels,) in MHz, against the Hamiltonian's zero.

    >>> from rotor.tops.constants import Constants
    >>> from rotor.quantum.solve import solve_levels
    >>> from rotor.tops.top import Top
    >>> top = Top(Constants(B=6000.0, uncertainties={"B": 0.1}))
    >>> covariance = Covariance.of_uncertainties(top.constants)
    >>> level_errors(top, solve_levels(top, 2), covariance).round(9).tolist()
    [0.0, 0.2, 0.6]
    """
    return np.asarray(np.linalg.norm(level_spread(top, levels, covariance), axis=1))


def line_errors(spread: Floats, upper: NDArray[np.integer], lower: NDArray[np.integer]) -> Floats:
    """One standard deviation of lines between the levels `upper` and `lower`, (lines,) in MHz, from `level_spread`."""
    out = np.empty(len(upper))
    for start in range(0, len(upper), _AT_ONCE):
        here = slice(start, start + _AT_ONCE)
        difference = spread[upper[here]] - spread[lower[here]]
        out[here] = np.sqrt(np.einsum("ij,ij->i", difference, difference))
    return out
