"""Constants with errors: the assigned lines of a species fitted with the full Hamiltonian by `rotor.fitting`.

Quartic constants that the lines do not determine are restrained to 0 with a-priori errors of their typical size
(`rotor.assignment.species.growth.quartic_sizes`), so that the errors of A, B, C include their influence.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotor.arrays import Floats
from rotor.assignment.peaks.peak_list import PeakList
from rotor.assignment.search.rigid_table import PARAMETERS, RigidTable
from rotor.assignment.species.grown import OPEN, Grown
from rotor.assignment.species.growth import SMALLEST_MHZ, quartic_sizes
from rotor.fitting.assignment import Assignments, assignments
from rotor.fitting.fit import FitOptions, fit_lines
from rotor.fitting.parameters import parameters
from rotor.fitting.result import Fit
from rotor.tops.constants.constants import Constants

REJECTED = 5.0  # standard errors beyond which a line does not count
SCATTERED = 3.0  # ratio of scatter to peak errors above which the scatter replaces the errors


@dataclass(frozen=True, eq=False)
class Refined:
    """A fit of a species: constants and scaled standard errors (8,) in MHz in the order of `PARAMETERS`."""

    fit: Fit
    values: Floats
    errors: Floats

    @property
    def open_constants(self) -> tuple[str, ...]:
        """Which of A, B, C are not determined: relative error above 0.1 %."""
        return tuple(
            name for name, value, error in zip("ABC", self.values, self.errors, strict=False) if error > OPEN * value
        )


def assigned_lines(grown: Grown, peaks: PeakList, table: RigidTable) -> Assignments:
    """The lines of a species with labels; lines of one peak are a blend."""
    rows = grown.rows
    _, blend = np.unique(grown.peak, return_inverse=True)
    error = np.hypot(np.maximum(peaks.uncertainty_mhz[grown.peak], SMALLEST_MHZ), excess_scatter(grown, peaks))
    return assignments(
        ("j", "ka", "kc"), table.quanta[table.upper[rows]], table.quanta[table.lower[rows]], peaks.frequency_mhz[grown.peak],
        error, weight=grown.share, blend=blend, source=peaks.source or "the spectrum",
    )  # fmt: skip


def excess_scatter(grown: Grown, peaks: PeakList) -> float:
    """Scatter (MHz) of the lines in excess of the errors of their peaks; 0 if it is below `SCATTERED` times these.

    Lines with an unresolved splitting all scatter about their calculated frequencies. Without this term the fit would reject them as
    outliers until only a few chance matches are left.
    """
    peak_error = float(np.median(np.maximum(peaks.uncertainty_mhz[grown.peak], SMALLEST_MHZ)))
    scatter = 1.4826 * float(np.median(np.abs(grown.residual)))
    # scatter beyond the stated errors, as far as it is clear
    return float(np.sqrt(scatter**2 - peak_error**2)) if scatter > SCATTERED * peak_error else 0.0


def refine(grown: Grown, peaks: PeakList, table: RigidTable) -> Refined:
    """Fit a species with the full Hamiltonian."""
    lines = assigned_lines(grown, peaks, table)
    start = Constants(
        **dict(zip(PARAMETERS, grown.constants.tolist(), strict=True)), reduction="S", representation="Ir"
    )
    sizes = quartic_sizes(grown.constants)
    free = parameters(start, PARAMETERS, priors_mhz=dict(zip(PARAMETERS[3:], sizes.tolist(), strict=True)))
    free = type(free)(**{**free.__dict__, "centre": np.concatenate([free.start[:3], np.zeros(5)])})
    fit = fit_lines(lines, start, free, FitOptions(reject_above=REJECTED, poor_rms=100.0, most_iterations=30))
    # errors grow with reduced χ, and never shrink
    return Refined(fit, fit.values, fit.errors * max(1.0, fit.reduced_chi if np.isfinite(fit.reduced_chi) else 1.0))
