"""An observed spectrum beside its model as tables: channel by channel, and line by line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.observed.model import KM_PER_S, Component, Sight, model
from rotor.observed.spectrum import ObservedSpectrum
from rotor.table import Table

VISIBLE = 3.0  # standard deviations of a modelled line that is listed
BLEND = 1 / 3  # of the brightness of a line, from which another species at its centre makes a blend


@dataclass(frozen=True, eq=False, repr=False)
class ColumnTable(Table):
    """A table of its columns."""

    values: dict[str, NDArray[Any]]

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Every column by its name."""
        return self.values


def overlay_table(spectrum: ObservedSpectrum, components: Sequence[Component], sight: Sight) -> ColumnTable:
    """frequency_mhz, observed_k, noise_k, model_k, residual_k, optical_depth of every channel."""
    seen = model(components, spectrum.frequency_mhz, sight)
    return ColumnTable(
        {
            "frequency_mhz": spectrum.frequency_mhz,
            "observed_k": spectrum.intensity,
            "noise_k": spectrum.noise,
            "model_k": seen.brightness_k,
            "residual_k": spectrum.intensity - seen.brightness_k,
            "optical_depth": seen.optical_depth,
        }
    )


def line_table(spectrum: ObservedSpectrum, components: Sequence[Component], sight: Sight) -> ColumnTable:
    """Lines whose species is above three standard deviations at their centre, rising in frequency.

    species, rest_mhz, observed_mhz, upper, lower, energy_upper_k, model_k (of the species alone), total_k, observed_k, blend.
    """
    rows: list[tuple[Any, ...]] = []
    total = model(components, spectrum.frequency_mhz, sight).brightness_k
    alone = [model([component], spectrum.frequency_mhz, sight).brightness_k for component in components]
    for k, component in enumerate(components):
        species = component.species
        observed = species.frequency_mhz * (1 - component.velocity_km_s / KM_PER_S) / (1 + sight.redshift)
        inside = np.flatnonzero((observed > spectrum.frequency_mhz[0]) & (observed < spectrum.frequency_mhz[-1]))
        channels = np.minimum(np.searchsorted(spectrum.frequency_mhz, observed[inside]), len(spectrum) - 1)
        for i, channel in zip(inside.tolist(), channels.tolist(), strict=True):
            brightness = alone[k][channel]
            if abs(brightness) < VISIBLE * spectrum.noise[channel]:
                continue
            others = max(
                (abs(spectrum_of_other[channel]) for j, spectrum_of_other in enumerate(alone) if j != k), default=0.0
            )
            texts = (species.name, species.frequency_mhz[i], observed[i], str(species.upper[i]), str(species.lower[i]))
            seen = (
                species.energy_upper_k[i],
                brightness,
                total[channel],
                spectrum.intensity[channel],
                others > BLEND * abs(brightness),
            )
            rows.append((*texts, *seen))
    rows.sort(key=lambda row: row[2])
    names = (
        "species",
        "rest_mhz",
        "observed_mhz",
        "upper",
        "lower",
        "energy_upper_k",
        "model_k",
        "total_k",
        "observed_k",
        "blend",
    )
    columns = list(zip(*rows, strict=True)) if rows else [()] * len(names)
    return ColumnTable({name: np.array(column) for name, column in zip(names, columns, strict=True)})
