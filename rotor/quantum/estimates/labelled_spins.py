"""Labelled levels with spins as functions of the parameters; only F with a label are computed, a few at a time.

Small blocks are solved whole (`effect_units`); in large ones each label is solved among the functions near it (`contracted`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats, Ints, distinct
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.estimates.effect_units import Functions, SpinNaming, unit_levels
from rotor.quantum.label_tracking import AssignedLevels
from rotor.quantum.levels import Levels
from rotor.quantum.spins.levels import levels_of_f, unmixed_levels
from rotor.quantum.spins.scheme import scheme_of

if TYPE_CHECKING:
    from rotor.tops.top import Top

_MOST_ELEMENTS = 1e7  # most elements of vectors of the F that are solved together
_LARGE = 400  # blocks of an F with fewer functions are solved whole, which is then faster


def assigned_with_spins(
    top: Top,
    effects: tuple[QuantumEffect, ...],
    names: Sequence[str],
    values_mhz: Floats,
    twice_f: Ints,
    rows_of: Callable[[Levels, Ints], Ints],
    functions: Callable[[Levels], Functions] | None = None,
    naming: SpinNaming | None = None,
) -> list[AssignedLevels]:
    """Blocks of labels with spins as functions of the parameters; labels without a level are missing.

    values_mhz: at which levels are labelled, in the order of `names`. twice_f: doubled F of each label, 0 or more. rows_of: takes levels
    and places of labels, and returns the row of each label, -1 if it has none. functions: functions other than basis functions that label
    the levels, see `unit_levels`. naming: how the states of solved blocks are labelled; `rows_of` takes levels with these labels.
    """
    scheme, all_f, columns = scheme_of(top, effects), distinct(twice_f), np.arange(len(names))
    size = (1 + sum(len(effect.states(top)) for effect in effects)) * int(np.prod([two + 1 for two in scheme.twice]))
    # functions of three equivalent nuclei are not products
    products = scheme.equivalent < 3 and functions is None and naming is None
    if products and size * int(all_f.max() + 1) > _LARGE:
        from rotor.quantum.estimates.contracted import contracted_levels

        levels = unmixed_levels(top, effects, all_f.tolist())
        rows = rows_of(levels, np.arange(len(twice_f)))
        here = np.flatnonzero(rows >= 0)
        if not len(here):
            return []
        contracted = contracted_levels(top, effects, levels, rows[here], names, values_mhz, _LARGE)
        if contracted is not None:
            return [AssignedLevels(here, columns, contracted)]
    out = list[AssignedLevels]()
    for chunk in np.split(all_f, np.flatnonzero(np.diff(np.cumsum((size * (all_f + 1.0)) ** 2) // _MOST_ELEMENTS)) + 1):
        places, angular = np.flatnonzero(np.isin(twice_f, chunk)), chunk.tolist()
        levels = unmixed_levels(top, effects, angular) if products else levels_of_f(top, effects, angular)
        rows = rows_of(levels, places)
        has_level = rows >= 0
        if has_level.any():
            namer = functions(levels) if functions else None
            blocks = unit_levels(top, levels, rows[has_level], names, values_mhz, namer, spin_naming=naming)
            out.append(AssignedLevels(places[has_level], columns, blocks))
    return out
