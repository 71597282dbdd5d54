"""Statistics of the parameters of a least-squares fit: errors, correlations, condition number, undetermined combinations.

The weighted Jacobian X = J/σ is scaled to columns of length 1, X = Y D, and decomposed, Y = U S Vᵀ (the column-scaled
singular value decomposition of D. A. Belsley, E. Kuh and R. E. Welsch, Regression Diagnostics (1980), chapter 3). Then

    (XᵀX)⁻¹ = D⁻¹ V S⁻² Vᵀ D⁻¹

without forming XᵀX. A singular value at round-off belongs to a combination of parameters that the data do not determine. The
combination is reported, and all parameters in it get an infinite error.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotor.arrays import Floats

UNDETERMINED = 1e-10  # relative singular value below which a combination is not determined
_PART = 1e-4  # smallest weight with which a parameter counts in a combination


@dataclass(frozen=True)
class Combination:
    """An undetermined combination Σ weights · parameters/scale of unit length, and its singular value."""

    names: tuple[str, ...]
    weights: Floats
    singular_value: float

    @property
    def text(self) -> str:
        """Text such as `A - 0.71 DK`, largest weight first, in units of the parameters' scales; a single parameter by name."""
        order = np.argsort(-np.abs(self.weights), kind="stable")
        if len(order) == 1:
            return self.names[0]
        first = self.weights[order[0]]
        parts = [f"{self.weights[i] / first:+.3g} {self.names[i]}" for i in order[1:]]
        return " ".join([self.names[order[0]], *(f"{part[0]} {part[1:]}" for part in parts)])


@dataclass(frozen=True)
class Regression:
    """The linear model at the end of a fit.

    names : parameters, in order. covariance : (n, n) from the stated errors of the data; infinite variances of undetermined
    parameters. singular_values : (n,) of the column-scaled Jacobian. scale : (n,) norms of the columns of the Jacobian.
    undetermined : undetermined combinations. left : (m, r), U of the determined part. inverse : (r, n); left @ inverse is the
    derivative (m, n) of the parameters by the weighted data.
    """

    names: tuple[str, ...]
    covariance: Floats
    singular_values: Floats
    scale: Floats
    undetermined: tuple[Combination, ...]
    left: Floats
    inverse: Floats

    @property
    def rank(self) -> int:
        """Number of determined combinations."""
        return int(self.left.shape[1])

    @property
    def errors(self) -> Floats:
        """Standard errors (n,) from the stated errors of the data; infinite if not determined."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def condition(self) -> float:
        """Condition number of the column-scaled Jacobian; infinite if a singular value is at round-off."""
        if not len(self.singular_values):
            return 1.0
        least = float(self.singular_values[-1])
        return float(self.singular_values[0]) / least if not self.undetermined and least > 0 else math.inf

    @property
    def correlations(self) -> Floats:
        """Correlation coefficients (n, n); nan for undetermined parameters."""
        errors = self.errors
        with np.errstate(invalid="ignore", divide="ignore"):
            matrix = self.covariance / np.outer(errors, errors)
        open_ = ~np.isfinite(errors)
        matrix[open_, :] = matrix[:, open_] = np.nan
        return np.asarray(matrix)

    @property
    def leverages(self) -> Floats:
        """Leverages h (m,), the derivative of each fitted value by its datum, 0 to 1; a datum with 1 alone determines a combination."""
        return np.asarray(np.einsum("ij,ij->i", self.left, self.left))

    def dfbetas(self, residuals: Floats) -> Floats:
        """Shift of each parameter, in standard errors, if a datum is left out, (m, n).

        (b_j - b_j(i)) / [s(i) √(XᵀX)⁻¹_jj], with s(i) the weighted standard deviation without datum i (Belsley, Kuh and
        Welsch, eq. 2.7); needs two degrees of freedom. A datum with leverage 1 cannot be left out; its row is infinite.
        """
        h = self.leverages
        free = len(residuals) - self.rank
        left = np.maximum(1.0 - h, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            squares = residuals @ residuals - np.where(left > 1e-12, residuals**2 / left, 0.0)
            spread = np.sqrt(np.maximum(squares, 0.0) / max(free - 1, 1))
            moved = (self.left @ self.inverse) * (residuals / left)[:, None]
            out = moved / (spread[:, None] * self.errors)
        out[left <= 1e-12] = np.inf
        return np.asarray(out)


def regression(jacobian: Floats, names: Sequence[str], floor: Floats | None = None) -> Regression:
    """The statistics of a weighted Jacobian (m, n).

    floor : (n,) norms below which a column is round-off from cancellation; such a parameter is not determined.

    >>> statistics = regression(np.array([[1.0, 1.0], [1.0, 1.0], [2.0, 2.0]]), ["B", "C"])
    >>> [c.text for c in statistics.undetermined], statistics.errors.tolist()
    (['B - 1 C'], [inf, inf])
    """
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    blind = scale <= (np.zeros_like(scale) if floor is None else floor)
    safe = np.where(blind, 1.0, scale)
    u, s, vt = _decomposed(np.where(blind, 0.0, jacobian / safe))
    determined = s > UNDETERMINED * s.max(initial=0.0)

    inverse = (vt[determined] / s[determined, None]) / safe
    covariance = inverse.T @ inverse
    open_ = (np.abs(vt[~determined]) > _PART).any(axis=0) | blind
    covariance[np.diag_indices_from(covariance)] = np.where(open_, np.inf, np.diag(covariance))
    combinations = [
        _combination(names, row, float(value)) for row, value in zip(vt[~determined], s[~determined], strict=True)
    ]
    return Regression(tuple(names), covariance, s, scale, tuple(combinations), u[:, determined], inverse)


def _decomposed(scaled: Floats) -> tuple[Floats, Floats, Floats]:
    """U, S, Vᵀ with one singular value per column; with many more rows than columns a QR decomposition comes first."""
    m, n = scaled.shape
    if m < n:
        scaled = np.vstack([scaled, np.zeros((n - m, n))])
    q, r = np.linalg.qr(scaled)
    u, s, vt = np.linalg.svd(r)
    return (q @ u)[:m], s, _by_axes(s, vt)


def _by_axes(s: Floats, vt: Floats) -> Floats:
    """Vᵀ with single parameters as null vectors if the null space contains them, so that they are reported separately."""
    null = s <= UNDETERMINED * s.max(initial=0.0)
    if null.sum() < 2:
        return vt
    space, rows = vt[null], list[Floats]()
    for axis in np.eye(vt.shape[1]):
        if np.linalg.norm(space @ axis) > 1 - 1e-9:
            rows.append(axis)
    if not rows:
        return vt
    single = np.array(rows)
    rest = space - space @ single.T @ single
    others = np.linalg.svd(rest, full_matrices=False)[2]
    vt = vt.copy()
    vt[null] = np.vstack([single, others[: int(null.sum()) - len(rows)]])
    return vt


def _combination(names: Sequence[str], row: Floats, singular: float) -> Combination:
    part: list[int] = np.flatnonzero(np.abs(row) > _PART).tolist()
    return Combination(tuple(names[i] for i in part), row[part], singular)
