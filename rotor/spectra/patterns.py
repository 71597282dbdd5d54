"""Merging of hyperfine components that an instrument does not resolve."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.checks import require_positive
from rotor.quantum.labels.quanta import rotational_quanta
from rotor.spectra.lines import Lines
from rotor.table import Table


@dataclass(frozen=True, eq=False, repr=False)
class Patterns(Table):
    """Lines of a list with components of one rotational line merged if they are closer than a resolution.

    frequency_mhz: mean of the components, weighted by intensity. intensity_nm2_mhz: their sum. components: their number. width_mhz:
    from the first to the last. strongest: (n,) row of the strongest component in `lines`.
    """

    lines: Lines
    resolution_mhz: float
    frequency_mhz: Floats
    intensity_nm2_mhz: Floats
    components: Ints
    width_mhz: Floats
    strongest: Ints

    @property
    def columns(self) -> Mapping[str, NDArray[Any]]:
        """Frequencies, intensities, counts and widths, and the rotational quantum numbers of both levels."""
        names = ("frequency_mhz", "intensity_nm2_mhz", "components", "width_mhz")
        out: dict[str, NDArray[Any]] = {name: getattr(self, name) for name in names}
        quanta = rotational_quanta(self.lines.levels.quanta)
        for side, rows in (("upper", self.lines.upper), ("lower", self.lines.lower)):
            out |= {f"{name}_{side}": column[rows[self.strongest]] for name, column in quanta.items()}
        return out


def patterns(lines: Lines, resolution_mhz: float) -> Patterns:
    """Merge neighbouring components of one rotational line that are closer than the resolution; sorted by frequency.

    >>> from rotor import read
    >>> from rotor.quantum.effects.of_top import effects_of
    >>> from rotor.spectra.lines import line_list
    >>> top = read("HCONH2")
    >>> lines = line_list(top, jmax=1, temperature_k=300.0, effects=effects_of(top, True), range_mhz=(21206.0, 21209.0))
    >>> patterns(lines, 0.7).components.tolist(), patterns(lines, 1.0).components.tolist()
    ([1, 2], [3])
    """
    require_positive("resolution_mhz", resolution_mhz)
    if not len(lines):
        empty = np.zeros(0)
        return Patterns(lines, resolution_mhz, empty, empty, empty.astype(int), empty, empty.astype(int))
    quanta = rotational_quanta(lines.levels.quanta).values()
    names = np.stack([column[rows] for rows in (lines.upper, lines.lower) for column in quanta], axis=1)
    line_of_row = np.unique(names, axis=0, return_inverse=True)[1].ravel()
    order = np.lexsort((lines.frequency_mhz, line_of_row))  # by line, then by frequency
    frequency, intensity = lines.frequency_mhz[order], lines.intensity_nm2_mhz[order]
    new = (np.diff(line_of_row[order], prepend=-1) != 0) | (np.diff(frequency, prepend=-np.inf) >= resolution_mhz)
    starts = np.flatnonzero(new)
    stops = np.append(starts[1:], len(order)) - 1
    total = np.add.reduceat(intensity, starts)
    # components without intensity have a plain mean
    weights = np.where(total[np.cumsum(new) - 1] > 0, intensity, 1.0)
    offset = frequency - frequency[starts][np.cumsum(new) - 1]  # relative to the first component, to save digits
    mean = frequency[starts] + np.add.reduceat(offset * weights, starts) / np.add.reduceat(weights, starts)
    by_strength = np.lexsort((-intensity, np.cumsum(new)))
    strongest = order[by_strength[starts]]
    rising = np.argsort(mean, kind="stable")  # stable: lines of one frequency keep their order
    return Patterns(
        lines,
        resolution_mhz,
        frequency_mhz=mean[rising],
        intensity_nm2_mhz=total[rising],
        components=(stops - starts + 1)[rising],
        width_mhz=(frequency[stops] - frequency[starts])[rising],
        strongest=strongest[rising],
    )
