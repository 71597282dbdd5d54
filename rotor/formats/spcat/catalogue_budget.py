"""Error budget of the frequencies of a catalogue (`rotor.requests.budget`): printed decimals and stated errors."""

from __future__ import annotations

import numpy as np

from rotor import units
from rotor.arrays import Floats
from rotor.formats.spcat.compare import in_mhz
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.requests.budget import ROUNDING, ErrorBudget, ErrorTerm

STRONG = 0.1  # weaker lines, relative to the strongest, are ignored
WIDE_MHZ, WIDE_DECIMALS = 99999999.0, 3  # higher frequencies have fewer decimals
MODEL = ErrorTerm(None, "a catalogue does not say what its lines leave out")


def catalogue_budget(lines: Catalogue) -> ErrorBudget:
    """The errors of printed frequencies, for lines above a tenth of the strongest.

    >>> j = np.full((1, 6), -32768)
    >>> line = Catalogue([115271.2018], [0.0005], [-5.0], [2], [0.0], [3], [28503], [101], j, j)
    >>> catalogue_budget(line).line()
    'errors of frequencies: data 0.0005 MHz (errors of the file), numerical 5e-05 MHz, left out not estimated: a catalogue does not say \
what its lines leave out'
    """
    frequency, error = in_mhz(lines)
    decimals = lines.layout.decimals[0]
    if decimals == 4 and lines.frequency_mhz.max(initial=0.0) >= WIDE_MHZ:
        decimals = WIDE_DECIMALS
    per_unit = units.MHZ_PER_CM if bool(len(lines)) and frequency[0] != lines.frequency_mhz[0] else 1.0
    # half of the last printed digit
    rounding = ErrorTerm(0.5 * 10.0**-decimals * per_unit, f"{decimals} decimals are printed")
    return listed_budget(rounding, error, lines.lgint)


def stored_budget(frequency_mhz: Floats, error_mhz: Floats, lgint: Floats) -> ErrorBudget:
    """The errors of frequencies stored in double precision."""
    rounding = ErrorTerm(ROUNDING * float(frequency_mhz.max(initial=0.0)), "double precision")
    return listed_budget(rounding, error_mhz, lgint)


def listed_budget(rounding: ErrorTerm, error_mhz: Floats, lgint: Floats) -> ErrorBudget:
    """The errors of frequencies of lines with stated errors (n,) and log10 intensities (n,)."""
    return ErrorBudget(
        of="frequencies",
        unit="MHz",
        rounding=rounding,
        truncation=ErrorTerm(0.0, "nothing is computed"),
        model=MODEL,
        data=_stated(error_mhz, lgint),
        statistics=ErrorTerm(0.0, "nothing is sampled"),
    )


def _stated(error_mhz: Floats, lgint: Floats) -> ErrorTerm:
    """The largest error of strong lines; not estimated if one of them has no error."""
    if not len(error_mhz):
        return ErrorTerm(None, "there is no line")
    errors = error_mhz[lgint >= lgint.max() + np.log10(STRONG)]  # lgint is a logarithm: a tenth is one less
    stated = errors[np.isfinite(errors) & (errors > 0)]
    if len(stated) < len(errors):
        others = f"; the largest of the others is {stated.max():.2g} MHz" if len(stated) else ""
        return ErrorTerm(None, f"{len(errors) - len(stated)} of {len(errors)} strong lines have no error{others}")
    return ErrorTerm(float(errors.max()), "errors of the file; largest of the lines above a tenth of the strongest")
