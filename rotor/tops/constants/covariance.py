"""Covariance of rotational constants, from fits, for errors of levels and lines."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.frozen import dataclass
from rotor.tops.constants.constants import Constants

_NEGATIVE = 1e-4  # rounding of printed correlation matrices may make eigenvalues negative by this much


@dataclass(frozen=True, eq=False)
class Covariance:
    """Covariance of constants.

    names: of the constants. matrix_mhz2: (n, n), symmetric, MHz². Other constants count as exact.
    Raises ValueError for repeated names, a matrix of another shape, and a matrix that is not a covariance.
    """

    names: tuple[str, ...]
    matrix_mhz2: Floats

    def __post_init__(self) -> None:
        matrix = np.asarray(self.matrix_mhz2, dtype=np.float64)
        _refuse_impossible(self.names, matrix)
        object.__setattr__(self, "matrix_mhz2", matrix)

    @classmethod
    def from_uncertainties(cls, constants: Constants) -> Covariance | None:
        """Covariance without correlations from the stated uncertainties; None without any.

        Published constants are correlated, though correlations are often not printed: errors of lines from
        uncertainties alone are mostly too large.
        """
        if not constants.uncertainties:
            return None
        return cls(tuple(constants.uncertainties), np.diag([s**2 for s in constants.uncertainties.values()]))

    @classmethod
    def from_correlations(
        cls, names: Sequence[str], uncertainties_mhz: ArrayLike, correlations: ArrayLike
    ) -> Covariance:
        """Covariance from standard deviations (n,) in MHz and correlation coefficients (n, n).

        >>> Covariance.from_correlations(["B", "D"], [0.1, 0.01], [[1, 0.5], [0.5, 1]]).matrix_mhz2.round(6).tolist()
        [[0.01, 0.0005], [0.0005, 0.0001]]
        """
        sigma = np.asarray(uncertainties_mhz, dtype=np.float64)
        matrix = np.asarray(correlations, dtype=np.float64)
        if sigma.shape != (len(names),) or matrix.shape != (len(names), len(names)):
            raise ValueError(
                f"{len(names)} constants: expected uncertainties of shape ({len(names)},) and correlations of shape "
                f"({len(names)}, {len(names)}), found {sigma.shape} and {matrix.shape}"
            )
        if not np.allclose(np.diag(matrix), 1.0):
            raise ValueError("a correlation matrix has 1 on its diagonal; is this a covariance?")
        return cls(tuple(names), matrix * np.outer(sigma, sigma))

    def of(self, names: Collection[str]) -> Covariance | None:
        """The covariance of the constants in `names`, ignoring the others; None if there are none.

        >>> Covariance(("B", "D"), np.diag([4.0, 1.0])).of({"D", "H"}).names
        ('D',)
        """
        rows = [i for i, name in enumerate(self.names) if name in names]
        if not rows:
            return None
        return (
            self
            if len(rows) == len(self.names)
            else Covariance(tuple(self.names[i] for i in rows), self.matrix_mhz2[np.ix_(rows, rows)])
        )

    def beside(self, uncertainties_mhz: Mapping[str, float]) -> Covariance:
        """The covariance extended by uncorrelated constants with these standard deviations.

        >>> Covariance(("B",), np.diag([4.0])).beside({"chi_aa(14N)": 3.0}).matrix_mhz2.tolist()
        [[4.0, 0.0], [0.0, 9.0]]
        """
        count, variances = len(self.names), [s**2 for s in uncertainties_mhz.values()]
        matrix = np.zeros((count + len(variances),) * 2)
        matrix[:count, :count], matrix[count:, count:] = self.matrix_mhz2, np.diag(variances)
        return Covariance((*self.names, *uncertainties_mhz), matrix)

    @property
    def correlations(self) -> Floats:
        """Correlation coefficients (n, n); 0 for an exact constant."""
        sigma = np.sqrt(np.diag(self.matrix_mhz2))
        safe = np.where(sigma > 0, sigma, 1.0)  # a constant without a variance has a row of zeros
        matrix = self.matrix_mhz2 / np.outer(safe, safe)
        np.fill_diagonal(matrix, 1.0)
        return np.asarray(matrix)

    @property
    def factor(self) -> Floats:
        """F (n, n) in MHz with C = F Fᵀ."""
        sigma = np.sqrt(np.diag(self.matrix_mhz2))
        safe = np.where(sigma > 0, sigma, 1.0)
        values, vectors = np.linalg.eigh(self.matrix_mhz2 / np.outer(safe, safe))
        # eigenvalues below 0 are round-off
        return np.asarray(sigma[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))


def _refuse_impossible(names: Sequence[str], matrix: Floats) -> None:
    if len(set(names)) != len(names):
        raise ValueError(f"covariance of {', '.join(names)}: a name is repeated")
    if matrix.shape != (len(names), len(names)):
        raise ValueError(
            f"covariance of {len(names)} constants: expected a square of that size, found shape {matrix.shape}"
        )
    variances = np.diag(matrix)
    if not np.isfinite(matrix).all() or (variances < 0).any():
        raise ValueError("covariance: expected finite numbers, and variances of 0 or more")
    sigma = np.sqrt(variances)
    # in units of the standard errors, so that the sizes of the constants do not matter
    scale = np.outer(np.where(sigma > 0, sigma, 1.0), np.where(sigma > 0, sigma, 1.0))
    if not np.allclose(matrix / scale, matrix.T / scale, rtol=0, atol=1e-9):
        raise ValueError("covariance: a covariance is symmetric, this matrix is not")
    if len(names) and np.linalg.eigvalsh(matrix / scale).min() < -_NEGATIVE:
        raise ValueError("covariance: some combination of the constants has a negative variance; check the matrix")
