"""The result of a fit: constants, residuals and statistics, and the covariance of what was fitted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.fitting.assignment import Assignments
from rotor.fitting.parameters import Parameters
from rotor.fitting.top_constants import DIPOLES, ConstantSet
from rotor.statistics.least_squares import Minimum
from rotor.statistics.regression import Regression
from rotor.tops.constants.covariance import Covariance


@dataclass(frozen=True, eq=False)
class Fit:
    """A finished fit.

    lines : the input. constants : the fitted set with standard errors; None if the parameters are not named constants (SPFIT's
    codes with spins or several states). parameters : the free parameters; `values` (n,) : their fitted values
    calculated_mhz (lines,) : frequency of each line; blended_mhz (lines,) : mean of its blend. calculated_errors_mhz (lines,) :
    standard errors of the predictions, from the stated errors. line_errors_mhz (lines,) : errors used in the fit, with the default
    error filled in; 0 without any. used (lines,) : whether a line counted; left_out : the reason, by line, if it did not
    residuals (u,), statistics : of the measured frequencies that counted, one per blend, in order of `groups`
    minimum : how the search ended. rounding_mhz : bound on the rounding error of a calculated line
    converged, reason : whether the fit is valid, and a sentence that says why or why not
    changed_states : labels of levels that are mostly another state than at the start. notes : remarks for the user
    """

    lines: Assignments
    constants: ConstantSet | None
    parameters: Parameters
    values: Floats
    calculated_mhz: Floats
    blended_mhz: Floats
    calculated_errors_mhz: Floats
    line_errors_mhz: Floats
    used: NDArray[np.bool_]
    left_out: dict[int, str]
    residuals: Floats
    groups: Ints
    statistics: Regression
    minimum: Minimum
    rounding_mhz: float
    converged: bool
    reason: str
    changed_states: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def marked_lines(self) -> Assignments:
        """The lines for the next fit, with the rejected ones marked as excluded; lines without an error are not marked."""
        excluded = np.isin(np.arange(len(self.lines)), list(self.left_out)) & (self.line_errors_mhz > 0)
        return replace(self.lines, excluded=excluded)

    @property
    def named(self) -> ConstantSet:
        """The fitted constants. ValueError if the parameters are not named constants."""
        if self.constants is None:
            raise ValueError(
                "the parameters of this fit are SPFIT codes with spins or states; it has no named constants"
            )
        return self.constants

    @property
    def difference_mhz(self) -> Floats:
        """Observed minus calculated frequency (lines,); components of a blend are compared by their mean."""
        return np.asarray(self.lines.frequency_mhz - self.blended_mhz)

    @property
    def weighted_rms(self) -> float:
        """√(Σ ((obs - calc)/σ)² / number of frequencies that counted), one per blend: SPFIT's RMS ERROR without a-priori values.

        For a blend of known width the spread of its components counts too.
        """
        r = self.residuals[: len(self.residuals) - self.parameters.prior_count]
        return float(np.sqrt(r @ r / len(r))) if len(r) else float("nan")

    @property
    def degrees_of_freedom(self) -> int:
        """Measured frequencies that counted plus a-priori values, minus the parameter combinations that they determine."""
        return len(self.residuals) - self.statistics.rank

    @property
    def reduced_chi(self) -> float:
        """√(χ²/degrees of freedom); nan with 0 degrees of freedom."""
        free = self.degrees_of_freedom
        return float(np.sqrt(self.residuals @ self.residuals / free)) if free > 0 else float("nan")

    @property
    def errors(self) -> Floats:
        """Standard errors (n,) of the parameters in MHz from the stated errors of the lines."""
        return self.statistics.errors

    @property
    def scaled_errors(self) -> Floats:
        """Standard errors (n,) in MHz from the scatter of the lines: `errors` times √(χ²/degrees of freedom)."""
        return np.asarray(self.errors * self.reduced_chi)

    @property
    def covariance(self) -> Covariance:
        """Covariance of the constants that were fitted, from the stated errors. ValueError if one is not determined."""
        return fitted_covariance(self.parameters, self.statistics)

    def rms_mhz(self, wavenumber: bool = False) -> float:
        """Unweighted rms of the frequencies measured in MHz, or of those measured in cm⁻¹ (in cm⁻¹); nan without any."""
        chosen = self.groups[self.lines.wavenumber[self.groups] == wavenumber]
        d = self.difference_mhz[chosen] / (29979.2458 if wavenumber else 1.0)
        return float(np.sqrt(d @ d / len(d))) if len(d) else float("nan")


def fitted_covariance(parameters: Parameters, statistics: Regression) -> Covariance:
    """Covariance (MHz²) of the constants that depend on free parameters."""
    if not np.isfinite(statistics.errors).all():
        lost = ", ".join(combination.text for combination in statistics.undetermined)
        raise ValueError(
            f"the lines do not determine {lost}: there is no covariance; hold these parameters or give a-priori errors"
        )
    covariance = determined_covariance(parameters, statistics)
    return covariance or Covariance((), np.zeros((0, 0)))


def determined_covariance(parameters: Parameters, statistics: Regression) -> Covariance | None:
    """Covariance of the determined constants only, without the dipole; None if no constant remains."""
    open_ = ~np.isfinite(statistics.errors)
    frequencies = np.array([name not in DIPOLES for name in parameters.constant_names])
    rows = np.flatnonzero(frequencies & parameters.matrix.any(axis=1) & ~parameters.matrix[:, open_].any(axis=1))
    if not len(rows):
        return None
    # undetermined parameters do not contribute
    finite = np.where(np.isfinite(statistics.covariance), statistics.covariance, 0.0)
    matrix = parameters.matrix[rows] @ finite @ parameters.matrix[rows].T
    return Covariance(tuple(parameters.constant_names[i] for i in rows), (matrix + matrix.T) / 2)
