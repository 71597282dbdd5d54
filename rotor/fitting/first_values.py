"""Lines and their derivatives at given constants without a search, and where constants start of which lines know the square alone.

At 0 the derivatives of all lines by a coupling of two states, or an element off the diagonal, are 0, so that no search goes
anywhere; such a constant has to start beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.fitting.assignment import Assignments, levels_in
from rotor.fitting.fit import Fit, missing_level
from rotor.fitting.parameters import Parameters, parameters, with_names
from rotor.fitting.search import FitOptions, Search, errors_of
from rotor.fitting.top_constants import ConstantSet, TopConstants
from rotor.fitting.top_levels import model_of
from rotor.quantum.labelled import MissingLevelsError

_STEPS = 4  # to the value that moves the lines by one error
_EVEN = 1e-3  # errors: by so much do the lines of a value and of its negative differ, rms, where they know its square


def weighted_derivatives(fit: Fit, names: Sequence[str], options: FitOptions | None = None) -> Floats:
    """Derivatives of the measured frequencies over their errors, (frequencies, names), by any constants at those of a fit.

    names : named constants, free in the fit or not, also those that it does not have (at 0). Raises ValueError for other names.
    """
    constants = with_names(fit.named, [name for name in names if name not in fit.named])
    free = parameters(constants, names)
    search = search_of(fit.lines, constants, free, options or FitOptions(), fit.used)
    return search.weighted(free.start)[1]


def search_of(
    lines: Assignments,
    constants: ConstantSet,
    free: Parameters,
    options: FitOptions,
    used: NDArray[np.bool_] | None = None,
) -> Search:
    """What evaluates lines for named constants, without a search.

    Parameters
    ----------
    lines : Assignments
    constants : Constants or TopConstants
    free : Parameters
        Of the same constants.
    options : FitOptions
    used : (lines,) array of bool, optional
        Which lines count; those with an error that are not excluded where it is left out.

    Returns
    -------
    Search

    Raises
    ------
    ValueError
        With the first line that has a level which does not exist.
    """
    labels, upper, lower = levels_in(lines)
    left_out, sigma = errors_of(lines, options)
    if used is None:
        used = np.ones(len(lines), dtype=bool)
        used[list(left_out)] = False
    try:
        model = model_of(constants, labels, options.kmax)
    except MissingLevelsError as error:
        raise missing_level(lines, error) from None
    return Search(lines, model, free, options, upper, lower, sigma, used)


def beside_zero(
    constants: ConstantSet, names: Sequence[str], lines: Assignments, options: FitOptions | None = None
) -> tuple[ConstantSet, dict[str, float]]:
    """The constants with those of `names` that are 0, and of which the lines know the square alone, at a value that they can see.

    Parameters
    ----------
    constants : Constants or TopConstants
        Constants of one state without spins are left as they are: their levels depend on each of them to first order.
    names : sequence of str
        Those that are to be fitted.
    lines : Assignments
    options : FitOptions, optional

    Returns
    -------
    constants : Constants or TopConstants
    changed : dict of str to float
        The values that were put in, MHz: with each of them alone the lines move by one of their errors (rms).
    """
    changed = dict[str, float]()
    if isinstance(constants, TopConstants):
        for name in (each for each in names if constants[each] == 0.0):
            if value := _seen(constants, name, lines, replace(options or FitOptions(), kmax=None)):
                changed[name] = value
        constants = constants.replace(**changed)
    return constants, changed


def _seen(constants: TopConstants, name: str, lines: Assignments, options: FitOptions) -> float:
    """The value that moves the lines by one error; 0 where they depend on its sign, or not on it at all."""
    search = search_of(lines, constants, parameters(constants, [name]), options)

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
