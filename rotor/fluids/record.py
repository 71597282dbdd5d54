"""The table of a run of a fluid, the same for all engines."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from rotor.arrays import Floats
from rotor.table import Table


@dataclass(frozen=True, eq=False, repr=False)
class FluidRecord(Table):
    """Energies, temperatures and pressure at n times; all arrays (n,).

    time_ps. potential_ev. translation_ev, rotation_ev: kinetic energies, by the thermometer without h² term if the engine
    allows it. total_ev: conserved energy, including that of a thermostat. temperature_k, translation_k, rotation_k: 2 E/(k degrees).
    pressure_bar: nan if the engine gives none.
    """

    time_ps: Floats
    potential_ev: Floats
    translation_ev: Floats
    rotation_ev: Floats
    total_ev: Floats
    temperature_k: Floats
    translation_k: Floats
    rotation_k: Floats
    pressure_bar: Floats

    def __post_init__(self) -> None:
        lengths = {field.name: len(getattr(self, field.name)) for field in fields(self)}
        if len(set(lengths.values())) > 1:
            raise ValueError(f"columns of a record have one length; got {lengths}")

    def __len__(self) -> int:
        return len(self.time_ps)

    @property
    def columns(self) -> dict[str, Floats]:
        """The table by column, in the order of a file."""
        return {field.name: np.asarray(getattr(self, field.name)) for field in fields(self)}
