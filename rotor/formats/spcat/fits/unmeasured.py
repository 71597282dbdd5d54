"""Lines of a .par file that are not measured but similar to measured ones in kind, frequency and N, as candidates for measurement."""

from __future__ import annotations

from operator import add

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.fitting.assignment import Assignments
from rotor.fitting.unmeasured import measured_range, without_measured
from rotor.formats.spcat.file_model import Group
from rotor.formats.spcat.file_quanta import Format, listed_quanta, quanta_format
from rotor.formats.spcat.fits.fit_states import groups_for_fit, levels_in_blocks
from rotor.formats.spcat.text.par import ParameterFile
from rotor.quantum.spins.levels import unmixed_levels


def unmeasured_lines(file: ParameterFile, measured: Assignments) -> tuple[Ints, Ints]:
    """Labels (n, k) of both states of the lines with the same changes of quantum numbers as a measured line.

    The states are the same as the measured line's (v), N is at most the highest measured, the frequency within the measured range,
    where spins do not count.

    file: parameters near the fitted ones. measured: measured lines; F below 0 and energies are ignored.
    """
    groups = groups_for_fit(file)
    form = quanta_format(file, groups)
    plain = ~measured.from_zero & (
        measured.upper.min(axis=1) >= 0 if form.rotation != 2 else measured.upper[:, -1] >= 0
    )
    seen = measured.take(plain)
    (highest, _), (_, (low_mhz, high_mhz)) = measured_range(measured), measured_range(seen)
    energy_of: dict[tuple[int, ...], float] = {}
    for labels, energies in [_group_labels(group, form, highest) for group in groups]:
        energy_of |= dict(zip(map(tuple, labels.tolist()), energies.tolist(), strict=True))
    by_state: dict[int | None, list[tuple[int, ...]]] = {}
    for label in energy_of:
        by_state.setdefault(label[form.rotation] if form.states else None, []).append(label)
    state = seen.lower[:, form.rotation].tolist() if form.states else [None] * len(seen)
    changes = dict.fromkeys(zip(state, map(tuple, (seen.upper - seen.lower).tolist()), strict=True))
    pairs = [
        (upper, lower)
        for v, change in changes
        for lower in by_state.get(v, [])
        if (upper := tuple(map(add, lower, change))) in energy_of
        and low_mhz < energy_of[upper] - energy_of[lower] < high_mhz
    ]
    table = np.array(pairs, dtype=np.int64).reshape(-1, 2, seen.upper.shape[1])
    return without_measured(table[:, 0], table[:, 1], seen)


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
