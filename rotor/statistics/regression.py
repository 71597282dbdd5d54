"""What a least-squares fit knows of its parameters: errors, correlations, condition, and what it does not know.

The weighted Jacobian X = J/σ is scaled to columns of length 1, X = Y D, and taken apart, Y = U S Vᵀ (the column-scaled
singular value decomposition of D. A. Belsley, E. Kuh and R. E. Welsch, Regression Diagnostics (1980), chapter 3). Then

    (XᵀX)⁻¹ = D⁻¹ V S⁻² Vᵀ D⁻¹

without ever forming XᵀX. A singular value at round-off is a combination of parameters that the data do not fix; it is
named, and every parameter that takes part in it has an infinite error instead of a small wrong one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotor.arrays import Floats

UNDETERMINED = 1e-10  # singular values below this part of the largest say that a combination is not determined
_PART = 1e-4  # of a combination below which a parameter has no part in it


@dataclass(frozen=True)
class Combination:
    """A combination Σ weights · parameters/scale of unit length that the data do not determine, and its singular value."""

    names: tuple[str, ...]
    weights: Floats
    singular_value: float

    @property
    def text(self) -> str:
        """Such as `A - 0.71 DK`, in units of each parameter's own scale, leading part first; one parameter by name."""
        order = np.argsort(-np.abs(self.weights), kind="stable")
        if len(order) == 1:
            return self.names[0]
        first = self.weights[order[0]]
        parts = [f"{self.weights[i] / first:+.3g} {self.names[i]}" for i in order[1:]]
        return " ".join([self.names[order[0]], *(f"{part[0]} {part[1:]}" for part in parts)])


@dataclass(frozen=True)
class Regression:
    """The linear model of a fit at its end.

    names : parameters, in order. covariance : (n, n) from the stated errors of the data; infinite variances where a
    parameter is not determined. singular_values : (n,) of the column-scaled Jacobian. scale : (n,) norms of its columns.
    undetermined : combinations that the data leave open. left : (m, r) U of the determined part. inverse : (r, n), the
    change of a parameter is U inverse times that of a datum in its standard deviations.
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
        """How many combinations are determined."""
        return int(self.left.shape[1])

    @property
    def errors(self) -> Floats:
        """Standard errors (n,) from the stated errors of the data; infinite where not determined."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def condition(self) -> float:
        """Largest over smallest singular value of the column-scaled Jacobian; infinite where one is at round-off."""
        if not len(self.singular_values):
            return 1.0
        least = float(self.singular_values[-1])
        return float(self.singular_values[0]) / least if not self.undetermined and least > 0 else math.inf

    @property
    def correlations(self) -> Floats:
        """Correlation coefficients (n, n); nan in rows of parameters that are not determined."""
        errors = self.errors
        with np.errstate(invalid="ignore", divide="ignore"):
            matrix = self.covariance / np.outer(errors, errors)
        open_ = ~np.isfinite(errors)
        matrix[open_, :] = matrix[:, open_] = np.nan
        return np.asarray(matrix)

    @property
    def leverages(self) -> Floats:
        """h (m,), the share of each datum in its own fitted value, 0 to 1; 1 fixes a combination alone."""
        return np.asarray(np.einsum("ij,ij->i", self.left, self.left))

    def dfbetas(self, residuals: Floats) -> Floats:
        """By how many standard errors each parameter moves when a datum is left out, (m, n).

        b_j - b_j(i) over s(i) √(XᵀX)⁻¹_jj, with s(i) the weighted standard deviation without the datum (Belsley, Kuh and
        Welsch, eq. 2.7), which needs two degrees of freedom. A datum of leverage 1 cannot be left out; its row is infinite.
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

    floor : (n,) norms below which a column is round-off of numbers that cancel; such a parameter is not determined.

    >>> one = regression(np.array([[1.0, 1.0], [1.0, 1.0], [2.0, 2.0]]), ["B", "C"])
    >>> [c.text for c in one.undetermined], one.errors.tolist()
    (['B - 1 C'], [inf, inf])
    """
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    blind = scale <= (np.zeros_like(scale) if floor is None else floor)
    safe = np.where(blind, 1.0, scale)
    u, s, vt = _decomposed(np.where(blind, 0.0, jacobian / safe))
    known = s > UNDETERMINED * s.max(initial=0.0)

    inverse = (vt[known] / s[known, None]) / safe
    covariance = inverse.T @ inverse
    open_ = (np.abs(vt[~known]) > _PART).any(axis=0) | blind
    covariance[np.diag_indices_from(covariance)] = np.where(open_, np.inf, np.diag(covariance))
    combinations = [_combination(names, row, float(value)) for row, value in zip(vt[~known], s[~known], strict=True)]
    return Regression(tuple(names), covariance, s, scale, tuple(combinations), u[:, known], inverse)


def _decomposed(scaled: Floats) -> tuple[Floats, Floats, Floats]:
    """U, S, Vᵀ with as many singular values as columns, by a QR first where there are many more rows."""
    m, n = scaled.shape
    if m < n:
        scaled = np.vstack([scaled, np.zeros((n - m, n))])
    q, r = np.linalg.qr(scaled)
    u, s, vt = np.linalg.svd(r)
    return (q @ u)[:m], s, _by_axes(s, vt)


def _by_axes(s: Floats, vt: Floats) -> Floats:
    """Vᵀ whose null space has single parameters where it contains them, so that each is named by itself."""
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
