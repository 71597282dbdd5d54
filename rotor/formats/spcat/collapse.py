"""Lines split by spins as the lines they are split from, so that a catalogue with F meets a list without.

Of the lines that differ in their spin quantum numbers alone, intensities are added; frequency, its error and the energy are
their means, weighted by intensity. A splitting of first order leaves this centre where the unsplit line is: strengths summed over
the components of the other level go as 2F + 1 of a level, and Σ (2F + 1) ΔE(F) is the trace of the coupling over the spins, which is 0.
How many numbers belong to spins is in QNFMT = 100 Q + 10 H + NQN: the last digit of Q counts those that do not.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.formats.spcat.text.fields import BLANK


def spin_quanta(catalogue: Catalogue) -> int:
    """How many quantum numbers of the spins each state of a catalogue has, the most of its lines.

    >>> from rotor.formats.spcat.text.cat import read_cat
    >>> spin_quanta(read_cat(b"   26164.4901  0.0010 -5.8078 3   -0.0000  8  52009 213 1 0 2       0 0 2       \\n"))
    1
    """
    return int(_of_spins(catalogue).max(initial=0))


def _of_spins(catalogue: Catalogue) -> NDArray[np.int64]:
    count, before = catalogue.qnfmt % 10, catalogue.qnfmt // 100 % 10
    return np.where(before > 0, np.maximum(count - before, 0), 0).astype(np.int64)


def without_spins(catalogue: Catalogue) -> Catalogue:
    """The lines with their spin quantum numbers dropped and the components of each added, rising in frequency.

    A line is measured (a negative tag) where every component is. Degeneracies are the sums over components, which is not that
    of the upper state: they are not to be compared. Frequencies must be in MHz.
    """
    of_spins = _of_spins(catalogue)
    count = catalogue.qnfmt % 10
    place = np.arange(catalogue.quanta_upper.shape[1])
    dropped = (place >= (count - of_spins)[:, None]) & (place < count[:, None])
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
        lgint=np.log10(total) + catalogue.lgint.max(initial=-np.inf),
        g_upper=np.bincount(code, catalogue.g_upper).astype(np.int32),
        tag=np.where(measured, -1, 1) * np.abs(catalogue.tag[first]),
        qnfmt=(catalogue.qnfmt - 10 * (catalogue.qnfmt // 10 % 10) - of_spins)[first],
        quanta_upper=upper[first],
        quanta_lower=lower[first],
    )
    return out.take(np.argsort(out.frequency_mhz, kind="stable"))
