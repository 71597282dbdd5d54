"""Lines of a .par file that are not measured but similar to measured ones in kind, frequency and N, as candidates for measurement."""

from __future__ import annotations

from math import prod

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.fitting.assignment import Assignments
from rotor.formats.spcat.file_model import Group
from rotor.formats.spcat.file_quanta import Format, listed_quanta, quanta_format
from rotor.formats.spcat.fits.fit_states import groups_for_fit, levels_in_blocks
from rotor.formats.spcat.text.par import ParameterFile
from rotor.quantum.spins.levels import unmixed_levels

_WIDER = 0.01  # relative distance by which a line may lie outside the measured frequencies


def unmeasured_lines(file: ParameterFile, measured: Assignments) -> tuple[Ints, Ints]:
    """Labels (n, k) of both states of the lines with the same changes of quantum numbers as a measured line.

    The states are the same as the measured line's (v), N is at most the highest measured, the frequency within the measured range,
    where spins do not count. Raises ValueError where a file has so many quantum numbers that labels cannot be counted.

    file: parameters near the fitted ones. measured: measured lines; F below 0 and energies are ignored.
    """
    groups = groups_for_fit(file)
    form = quanta_format(file, groups)
    highest = int(max(measured.upper[:, 0].max(), measured.lower[:, 0].max()))
    tables = [_group_labels(group, form, highest) for group in groups]
    labels, first = np.unique(np.concatenate([table[0] for table in tables]), axis=0, return_index=True)
    energies = np.concatenate([table[1] for table in tables])[first]

    plain = ~measured.from_zero & (
        measured.upper.min(axis=1) >= 0 if form.rotation != 2 else measured.upper[:, -1] >= 0
    )
    seen = measured.take(plain)
    v = form.rotation if form.states else 0
    state = seen.lower[:, v] if form.states else np.zeros(len(seen), dtype=np.int64)
    changes = np.unique(np.column_stack([state, seen.upper - seen.lower]), axis=0)
    all_labels = np.concatenate([labels, seen.upper, seen.lower])
    least = all_labels.min(axis=0) + np.minimum(changes[:, 1:].min(axis=0, initial=0), 0)
    spans = all_labels.max(axis=0) + np.maximum(changes[:, 1:].max(axis=0, initial=0), 0) - least + 1
    if prod(spans.tolist()) > 2**62:
        raise ValueError("so many quantum numbers cannot be counted: no line can be suggested for this file")

    def number(rows: Ints) -> Ints:
        return np.asarray(np.ravel_multi_index(tuple((rows - least).T), spans.tolist()))

    measured_pairs = set(zip(number(seen.upper).tolist(), number(seen.lower).tolist(), strict=True))
    numbers = number(labels)  # rising, as the labels do
    low_mhz = float(seen.frequency_mhz.min()) * (1 - _WIDER)  # a little beyond the measured band
    high_mhz = float(seen.frequency_mhz.max()) * (1 + _WIDER)
    pairs = []
    for change in changes:
        lower = np.flatnonzero(labels[:, v] == change[0]) if form.states else np.arange(len(labels))
        goal = number(labels[lower] + change[1:])
        upper = np.minimum(np.searchsorted(numbers, goal), len(numbers) - 1)
        frequency = energies[upper] - energies[lower]
        chosen = (numbers[upper] == goal) & (frequency > low_mhz) & (frequency < high_mhz)
        new = zip(upper[chosen].tolist(), lower[chosen].tolist(), strict=True)
        pairs += [(i, k) for i, k in new if (int(numbers[i]), int(numbers[k])) not in measured_pairs]
    table = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    return labels[table[:, 0]], labels[table[:, 1]]


def _group_labels(group: Group, form: Format, highest: int) -> tuple[Ints, Floats]:
    """Labels (n, k) with N up to the highest, and energies of the levels without spins, MHz."""
    if group.spins:
        total = sum(group.spins)
        if group.states[0].equivalent == 3:
            raise ValueError("no line is suggested with a total spin of three nuclei; leave --suggest out")
        # F has the parity of the sum of the spins, doubled
        levels = unmixed_levels(group.top, (group.effect,), list(range(total % 2, 2 * highest + total + 1, 2)))
    else:
        levels = levels_in_blocks(group, range(0, 2 * highest + 1, 2))
    tables = [
        listed_quanta(group, levels, form, negative) for negative in ((False, True) if form.rotation == 2 else (False,))
    ]
    labels = np.concatenate(tables)
    inside = labels[:, 0] <= highest
    return labels[inside], np.tile(levels.energy_mhz, len(tables))[inside]
