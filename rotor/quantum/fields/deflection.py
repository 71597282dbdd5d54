"""Table of effective dipoles for programs of deflection and deceleration: one column for each state, evenly spaced fields.

The force on a molecule in a static field is μ_eff(E) grad E, with μ_eff = -dE/dE of its state; trajectories need nothing else. A state
keeps its label while the field changes slowly (adiabatic following); its population is that of the free level.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.field_map import FieldMap
from rotor.table import Table
from rotor.units import MHZ_PER_K

EVEN_WITHIN = 1e-9  # largest deviation of a step, relative to the step


@dataclass(frozen=True, eq=False, repr=False)
class DeflectionTable(Table):
    """Effective dipoles in D against evenly spaced fields, one column for each state, such as `mu_eff_debye 1 0 1 M1`.

    fields_kv_per_cm: (n,). states: names. mu_eff_debye: (states, n). copies, weight: of each state (states,). free_mhz: energy of its free
    level (states,).
    """

    fields_kv_per_cm: Floats
    states: tuple[str, ...]
    mu_eff_debye: Floats
    copies: Ints
    weight: Floats
    free_mhz: Floats

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """field_kv_per_cm, then one column for each state."""
        each = {f"mu_eff_debye {name}": row for name, row in zip(self.states, self.mu_eff_debye, strict=True)}
        return {"field_kv_per_cm": self.fields_kv_per_cm, **each}

    @property
    def provenance(self) -> dict[str, Any]:
        """States, numbers of coinciding states, spin weights and energies of the free levels, in the order of the columns."""
        return {
            "states": list(self.states),
            "copies": self.copies.tolist(),
            "weight": self.weight.tolist(),
            "free_mhz": self.free_mhz.tolist(),
        }

    def populations(self, temperature_k: float) -> Floats:
        """Population of each state (with its copies) relative to all states of the table, without field, (states,)."""
        if not temperature_k > 0:
            raise ValueError(f"temperature {temperature_k} K: a temperature is above 0 K")
        above = (self.free_mhz - self.free_mhz.min()) / (temperature_k * MHZ_PER_K)
        factor = self.copies * self.weight * np.exp(-above)
        return np.asarray(factor / factor.sum())


def deflection_table(states: FieldMap) -> DeflectionTable:
    """The effective dipoles of a map of a static field along Z, one column for each state.

    Raises ValueError for a map of another field, and for fewer than two or unevenly spaced fields.

    >>> from rotor.quantum.effects.stark import stark_map
    >>> from rotor.tops.top import Top
    >>> rod = Top.from_constants("B=6000 MHz", dipole_abc_debye=(0.7, 0, 0))
    >>> deflection_table(stark_map(rod, [0.0, 1.0], j_highest=1)).states
    ('0 M0', '1 M0', '1 M1')
    """
    fields = states.fields
    if states.slope_name != "mu_eff_debye":
        raise ValueError(
            f"a table of effective dipoles is made of a map of a static electric field, not of {states.field_name}"
        )
    steps = np.diff(fields)
    if not len(steps) or np.ptp(steps) > EVEN_WITHIN * steps.max():
        raise ValueError("a table of effective dipoles needs two or more evenly spaced fields")
    curves = states.curves()
    first = [rows.start for rows in curves]
    names = _unique([f"{states.label[at]} M{states.m[at]}" for at in first])
    dipoles = np.array([states.slope[rows] for rows in curves]) + 0.0  # no -0.0
    return DeflectionTable(fields, names, dipoles, states.copies[first], states.weight[first], states.free_mhz[first])


def _unique(names: list[str]) -> tuple[str, ...]:
    """Names, with a number after those that occur more than once (+K M and -K M)."""
    seen: dict[str, int] = {}
    out = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        out.append(name if seen[name] == 1 else f"{name} ({seen[name]})")
    return tuple(out)
