"""Lines and derivatives at fixed constants, and start values for constants that act on the lines only through their square.

At 0 all lines have zero derivatives by a coupling of two states, or by another off-diagonal element. A search cannot leave this
point, so such a constant must start away from 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.fitting.assignment import Assignments, levels_in
from rotor.fitting.fit import missing_level
from rotor.fitting.levels.top_levels import label_model
from rotor.fitting.parameters import Parameters, parameters, with_names
from rotor.fitting.result import Fit
from rotor.fitting.search.residuals import FitOptions, Search, line_errors
from rotor.fitting.top_constants import ConstantSet, TopConstants
from rotor.quantum.labels.labelled import MissingLevelsError

_STEPS = 4  # iterations to the value that shifts the lines by one error
_EVEN = 1e-3  # rms difference (errors) of the lines for ± a value below which they depend on its square only


def weighted_derivatives(fit: Fit, names: Sequence[str], options: FitOptions | None = None) -> Floats:
    """Derivatives of the measured frequencies, divided by their errors, (frequencies, names), at the constants of a fit.

    names : constants, free in the fit or not; those that the fit lacks are 0. Raises ValueError for unknown names.
    """
    constants = with_names(fit.named, [name for name in names if name not in fit.named])
    free = parameters(constants, names)
    search = line_evaluator(fit.lines, constants, free, options or FitOptions(), fit.used)
    return search.weighted(free.start)[1]


def line_evaluator(
    lines: Assignments,
    constants: ConstantSet,
    free: Parameters,
    options: FitOptions,
    used: NDArray[np.bool_] | None = None,
) -> Search:
    """A `Search` to evaluate lines for named constants, without searching.

    Parameters
    ----------
    lines : Assignments
    constants : Constants or TopConstants
    free : Parameters
        Of the same constants.
    options : FitOptions
    used : (lines,) array of bool, optional
        Lines that count. Default: lines with an error that are not excluded.

    Returns
    -------
    Search

    Raises
    ------
    ValueError
        Names the first line with a level that does not exist.
    """
    labels, upper, lower = levels_in(lines)
    left_out, sigma = line_errors(lines, options)
    if used is None:
        used = np.ones(len(lines), dtype=bool)
        used[list(left_out)] = False
    try:
        model = label_model(constants, labels, options.kmax)
    except MissingLevelsError as error:
        raise missing_level(lines, error) from None
    return Search(lines, model, free, options, upper, lower, sigma, used)


def beside_zero(
    constants: ConstantSet, names: Sequence[str], lines: Assignments, options: FitOptions | None = None
) -> tuple[ConstantSet, dict[str, float]]:
    """Start values for constants of `names` that are 0 and act on the lines only through their square.

    Parameters
    ----------
    constants : Constants or TopConstants
        Constants of a single state without spins are not changed: their levels depend on each constant to first order.
    names : sequence of str
        The constants to be fitted.
    lines : Assignments
    options : FitOptions, optional

    Returns
    -------
    constants : Constants or TopConstants
    changed : dict of str to float
        The new start values, MHz; each of them alone shifts the lines by one error (rms).
    """
    changed = dict[str, float]()
    if isinstance(constants, TopConstants):
        for name in (each for each in names if constants[each] == 0.0):
            if value := _seen(constants, name, lines, replace(options or FitOptions(), kmax=None)):
                changed[name] = value
        constants = constants.replace(**changed)
    return constants, changed


def _seen(constants: TopConstants, name: str, lines: Assignments, options: FitOptions) -> float:
    """The value that shifts the lines by one error; 0 if they depend on its sign, or not at all on the constant."""
    search = line_evaluator(lines, constants, parameters(constants, [name]), options)

    def frequencies(value: float) -> Floats:
        return search.weighted(np.array([value]))[0]

    at_zero, value = frequencies(0.0), 1.0
    for _ in range(_STEPS):
        rms = _rms(frequencies(value) - at_zero)
        if not np.isfinite(rms) or not rms:
            return 0.0
        value /= np.sqrt(rms)
    return float(value) if _rms(frequencies(value) - frequencies(-value)) < _EVEN else 0.0


def _rms(moved: Floats) -> float:
    return float(np.sqrt(moved @ moved / len(moved)))
