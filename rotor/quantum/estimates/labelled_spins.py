"""Labelled levels with spins for parameters that change: only those F are looked at in which a label lies, some at a time.

Small blocks are solved whole (`effect_units`); in large ones each label is solved among the functions near it (`contracted`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints, distinct
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.estimates.effect_units import Functions, unit_levels
from rotor.quantum.label_tracking import LabelledBlocks
from rotor.quantum.levels import Levels
from rotor.quantum.spins.levels import levels_of_f, unmixed_levels
from rotor.quantum.spins.scheme import scheme_of

if TYPE_CHECKING:
    from rotor.quantum.estimates.contracted import ContractedLevels
    from rotor.tops.top import Top

_MOST_ELEMENTS = 1e7  # of vectors over all functions of the F that are solved at a time
_LARGE = 400  # functions of an F from which on blocks may be contracted


class FoundLevels(NamedTuple):
    """Labels by their places among all, and the blocks in which they lie."""

    rows: Ints
    blocks: LabelledBlocks | ContractedLevels


def found_with_spins(
    top: Top,
    effects: tuple[QuantumEffect, ...],
    names: Sequence[str],
    values_mhz: Floats,
    twice_f: Ints,
    rows_of: Callable[[Levels, Ints], Ints],
    functions: Callable[[Levels], Functions] | None = None,
) -> list[FoundLevels]:
    """The labels of some F in the blocks in which they lie, for any values of the parameters.

    Parameters
    ----------
    top : Top
    effects : tuple of QuantumEffect
        What the Hamiltonian consists of, spins among it; the values of its parameters are `values_mhz`.
    names : sequence of str
        Parameters of the effects, in the order of the values.
    values_mhz : (parameters,) array
        At which levels get their names.
    twice_f : (n,) array
        Twice the F of each label, 0 or more.
    rows_of : callable
        Levels and places of labels to the row of each of these, -1 where there is none.
    functions : callable, optional
        Of levels that are called by other functions than those of the basis, see `unit_levels`.

    Returns
    -------
    list of FoundLevels
        Labels that are no levels are in none.
    """
    scheme, every = scheme_of(top, effects), distinct(twice_f)
    size = (1 + sum(len(effect.states(top)) for effect in effects)) * int(np.prod([two + 1 for two in scheme.twice]))
    products = scheme.equivalent < 3 and functions is None  # functions of three equivalent nuclei are none
    if products and size * int(every.max() + 1) > _LARGE:
        from rotor.quantum.estimates.contracted import contracted_levels

        levels, plan = unmixed_levels(top, effects, every.tolist())
        rows = rows_of(levels, np.arange(len(twice_f)))
        here = np.flatnonzero(rows >= 0)
        if not len(here):
            return []
        contracted = contracted_levels(top, effects, plan, levels, rows[here], names, values_mhz)
        if contracted is not None:
            return [FoundLevels(here, contracted)]
    out = list[FoundLevels]()
    for some in np.split(every, np.flatnonzero(np.diff(np.cumsum((size * (every + 1.0)) ** 2) // _MOST_ELEMENTS)) + 1):
        asked, angular = np.flatnonzero(np.isin(twice_f, some)), some.tolist()
        levels = unmixed_levels(top, effects, angular)[0] if products else levels_of_f(top, effects, angular)
        rows = rows_of(levels, asked)
        found = rows >= 0
        if found.any():
            own = functions(levels) if functions else None
            out.append(FoundLevels(asked[found], unit_levels(top, levels, rows[found], names, values_mhz, own)))
    return out
