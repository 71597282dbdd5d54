"""The initial states of a gas: all (level, M) at a temperature with their spin weights, or a single level.

Levels are included in order of population per state until the omitted population is below a cut. The others are not renormalised away
but taken as isotropic (cos²θ = 1/3), so that a cut ε changes the cosines by at most ε times their deviation from the isotropic value
(`AlignmentTrace.error_estimate`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rotor import units
from rotor.arrays import Floats
from rotor.quantum.fields.blocks import FreeLevels
from rotor.tops.top import require_single_state

if TYPE_CHECKING:
    from rotor.tops.top import Top

MOST_J = 400


@dataclass(frozen=True)
class Ensemble:
    """The initial ensemble.

    temperature_k: 0 for a single level. ground_mhz: lowest existing level. q: Σ g (2J+1) exp(-E/kT). least: population of a state
    below which it is omitted. left_out: total omitted population. jmax: the highest populated J. chosen: quantum numbers of a single
    level, None for a gas; m: its M, None for equal populations of all M.
    """

    temperature_k: float
    ground_mhz: float
    q: float
    least: float
    left_out: float
    jmax: int
    chosen: Mapping[str, int] | None = None
    m: int | None = None

    def populations(self, levels: FreeLevels) -> Floats:
        """Population of a single state |level, M⟩ of each level (n,), 0 for omitted levels."""
        if self.chosen is not None:
            return self._chosen_state(levels)
        kelvin = (levels.energy_mhz - self.ground_mhz) / units.MHZ_PER_K
        # levels below the ground have weight 0; their exponential must not overflow
        population = levels.weight * np.exp(-np.maximum(kelvin / self.temperature_k, -1.0)) / self.q
        return np.where((population >= self.least) & (levels.j <= self.jmax), population, 0.0)

    def _chosen_state(self, levels: FreeLevels) -> Floats:
        here = np.ones(len(levels), dtype=bool)
        for name, value in (self.chosen or {}).items():
            column = levels.j if name == "j" else np.abs(levels.quanta[name]) if name == "k" else levels.quanta[name]
            here &= column == value
        # all M of a level are equal if none is chosen
        states = here.sum() * (1 if self.m is not None else 2 * int(levels.j[here][0]) + 1)
        return np.where(here, 1.0 / states, 0.0)


def single_level(top: Top, state: Mapping[str, int], m: int | None = None) -> Ensemble:
    """The ensemble of a single level, named by quantum numbers (j; j, k; j, ka, kc), with one |M| or equal populations of all M.

    Raises ValueError for wrong names, a level that does not exist, and an M above J.
    """
    from rotor.quantum.solve import solve_levels

    j = int(state.get("j", -1))
    if not 0 <= j <= MOST_J:
        raise ValueError(f"state: {dict(state)}: expected J from 0 to {MOST_J} among its quantum numbers")
    levels = solve_levels(require_single_state(top, "alignment"), j)
    row = levels.find(**dict(state))
    if levels.weight[row] == 0:
        raise ValueError(f"state: {dict(state)}: its nuclear-spin weight is 0, so that it does not exist")
    if m is not None and not 0 <= m <= j:
        raise ValueError(f"m: {m} of J = {j}: expected 0 to J (M and -M are alike)")
    return Ensemble(0.0, float(levels.energy_mhz[row]), 1.0, 0.0, 0.0, j, dict(state), m)


def ground_level(top: Top) -> Ensemble:
    """The ensemble of the lowest existing level with equal populations of all M: a gas at 0 K."""
    from rotor.quantum.solve import solve_levels

    levels = solve_levels(require_single_state(top, "alignment"), 4)
    existing = np.flatnonzero(levels.weight > 0)
    row = int(existing[np.argmin(levels.energy_mhz[existing])])
    return single_level(top, {name: int(column[row]) for name, column in levels.quanta.items()})


def thermal(top: Top, temperature_k: float, cut: float) -> Ensemble:
    """The ensemble at a temperature, with a total omitted population below `cut`.

    Raises ValueError for a temperature not above 0 K and one that would populate J above 400.
    """
    if not (math.isfinite(temperature_k) and temperature_k > 0):
        raise ValueError(
            f"temperature {temperature_k} K: expected a finite temperature above 0 K (0 means a single level)"
        )
    levels = _levels_for(require_single_state(top, "alignment"), temperature_k, cut)
    exists = levels.weight > 0
    ground = float(levels.energy_mhz[exists].min())
    factor = levels.weight * np.exp(-(levels.energy_mhz - ground) / (units.MHZ_PER_K * temperature_k))
    factor[~exists] = 0.0
    whole = (2 * levels.j + 1) * factor
    order = np.argsort(-factor, kind="stable")  # stable: equal populations keep the order of levels
    share = np.cumsum(whole[order]) / whole.sum()
    last = min(int(np.searchsorted(share, 1.0 - cut)), int(exists.sum()) - 1)
    # a factor below 1 keeps levels of equal population together
    least = float(factor[order[last]] / whole.sum()) * (1 - 1e-9)
    populated = factor / whole.sum() >= least
    return Ensemble(
        temperature_k,
        ground,
        float(whole.sum()),
        least,
        float(whole[~populated].sum() / whole.sum()),
        int(levels.j[populated].max()),
    )


def _levels_for(top: Top, temperature_k: float, cut: float) -> FreeLevels:
    """Levels up to a J whose population is far below the cut."""
    from rotor.quantum.solve import solve_levels

    least = min(x for x in top.rotational_constants_mhz if math.isfinite(x))
    # levels at 12 kT beyond the cut are empty
    reach = temperature_k * units.MHZ_PER_K * (math.log(1 / cut) + 12) / least
    jmax = int(math.sqrt(reach)) + 3
    if jmax > 2 * MOST_J:
        raise ValueError(
            f"{temperature_k:g} K populates J up to about {jmax}: states up to J = {2 * MOST_J} are propagated; take the classical "
            "ensemble, a lower temperature or a larger tolerance"
        )
    solved = solve_levels(top, jmax, vectors=False)
    return FreeLevels(solved.rotational, solved.energy_mhz, {}, solved.weight.astype(np.float64))
