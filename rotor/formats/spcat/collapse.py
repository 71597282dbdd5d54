"""Merge hyperfine components into unsplit lines, to compare a catalogue with F with a list without.

Lines that differ only in spin quantum numbers are merged: intensities are added; frequency, its error and the energy are means weighted by
intensity. First-order splittings leave this centre at the unsplit line: strengths summed over the components of the other level are
proportional to 2F + 1, and Σ (2F + 1) ΔE(F) is the trace of the coupling over the spins, which is 0.
QNFMT = 100 Q + 10 H + NQN gives the number of spin quantum numbers: the last digit of Q counts all others.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.formats.spcat.text.fields import BLANK


def spin_quanta(catalogue: Catalogue) -> int:
    """The largest number of spin quantum numbers of a state in a catalogue.

    >>> from rotor.formats.spcat.text.cat import read_cat
    >>> spin_quanta(read_cat(b"   26164.4901  0.0010 -5.8078 3   -0.0000  8  52009 213 1 0 2       0 0 2       \\n"))
    1
    """
    return int(_spin_counts(catalogue).max(initial=0))


def _spin_counts(catalogue: Catalogue) -> NDArray[np.int64]:
    """Number of spin quantum numbers of each line."""
    count, before = catalogue.qnfmt % 10, catalogue.qnfmt // 100 % 10
    # codes without a count of rotational quantum numbers name no spins
    return np.where(before > 0, np.maximum(count - before, 0), 0).astype(np.int64)


def without_spins(catalogue: Catalogue) -> Catalogue:
    """The lines without spin quantum numbers, with components merged, rising in frequency.

    A merged line is measured (negative tag) if all its components are. Its degeneracy is the sum over components, not that of the upper
    state, and must not be compared. Frequencies must be in MHz.
    """
    spin_count = _spin_counts(catalogue)
    count = catalogue.qnfmt % 10
    place = np.arange(catalogue.quanta_upper.shape[1])
    dropped = (place >= (count - spin_count)[:, None]) & (place < count[:, None])
    upper, lower = (
        np.where(dropped, np.int16(BLANK), side) for side in (catalogue.quanta_upper, catalogue.quanta_lower)
    )
    labels = np.concatenate([upper, lower], axis=1)
    _, code = np.unique(labels, axis=0, return_inverse=True)
    code = np.asarray(code).reshape(-1)
    _, first = np.unique(code, return_index=True)
    weight = 10.0 ** (catalogue.lgint - catalogue.lgint.max(initial=-np.inf))  # scaled: no sum overflows
    total = np.bincount(code, weight)

    def mean(column: NDArray[np.float64]) -> NDArray[np.float64]:
        origin = column[first]  # differences are averaged, so that frequencies keep their digits
        return np.asarray(origin + np.bincount(code, weight * (column - origin[code])) / total)

    measured = np.bincount(code, catalogue.tag >= 0) == 0
    out = replace(
        catalogue.take(first),
        frequency_mhz=mean(catalogue.frequency_mhz),
        error_mhz=mean(catalogue.error_mhz),
        energy_lower_cm=mean(catalogue.energy_lower_cm),
        # relative to the strongest line, so that weak lines keep their digits
        lgint=np.log10(total) + catalogue.lgint.max(initial=-np.inf),
        g_upper=np.bincount(code, catalogue.g_upper).astype(np.int32),
        # a negative tag: at least one component was measured
        tag=np.where(measured, -1, 1) * np.abs(catalogue.tag[first]),
        qnfmt=(catalogue.qnfmt - 10 * (catalogue.qnfmt // 10 % 10) - spin_count)[first],
        quanta_upper=upper[first],
        quanta_lower=lower[first],
    )
    # stable: lines of one frequency keep the order of the file
    return out.take(np.argsort(out.frequency_mhz, kind="stable"))
