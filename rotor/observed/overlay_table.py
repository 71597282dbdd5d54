"""An observed spectrum beside its model as tables: channel by channel, and line by line."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.observed.gas_cell import absorbance
from rotor.observed.model.model import KM_PER_S, Component, Sight, model
from rotor.observed.spectrum import ABSORBANCE, ObservedSpectrum
from rotor.table import ColumnTable

VISIBLE = 3.0  # smallest listed line of the model, in standard deviations
BLEND = 1 / 3  # brightness of other species at the centre of a line, relative to it, above which it is a blend


def modelled(spectrum: ObservedSpectrum, components: Sequence[Component], sight: Sight) -> Floats:
    """Model of components (n,) in the unit of a spectrum: brightness in K, or absorbance of a gas cell."""
    if spectrum.unit == ABSORBANCE:
        return absorbance(components, spectrum.frequency_mhz)
    return model(components, spectrum.frequency_mhz, sight).brightness_k


def overlay_table(spectrum: ObservedSpectrum, components: Sequence[Component], sight: Sight) -> ColumnTable:
    """frequency_mhz, observed_k, noise_k, model_k, residual_k, optical_depth of each channel; names without `_k` for absorbance."""
    unit = _suffix(spectrum)
    if spectrum.unit == ABSORBANCE:
        seen = absorbance(components, spectrum.frequency_mhz)
        depth = seen * math.log(10)
    else:
        source = model(components, spectrum.frequency_mhz, sight)
        seen, depth = source.brightness_k, source.optical_depth
    return ColumnTable(
        {
            "frequency_mhz": spectrum.frequency_mhz,
            f"observed{unit}": spectrum.intensity,
            f"noise{unit}": spectrum.noise,
            f"model{unit}": seen,
            f"residual{unit}": spectrum.intensity - seen,
            "optical_depth": depth,
        }
    )


def _suffix(spectrum: ObservedSpectrum) -> str:
    return "" if spectrum.unit == ABSORBANCE else "_k"


def line_table(spectrum: ObservedSpectrum, components: Sequence[Component], sight: Sight) -> ColumnTable:
    """Lines whose species is above three standard deviations at their centre, rising in frequency.

    species, rest_mhz, observed_mhz, upper, lower, energy_upper_k, model_k (of the species alone), total_k, observed_k,
    blend; without `_k` in absorbance.
    """
    rows: list[tuple[Any, ...]] = []
    total = modelled(spectrum, components, sight)
    alone = [modelled(spectrum, [component], sight) for component in components]
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
        *(f"{name}{_suffix(spectrum)}" for name in ("model", "total", "observed")),
        "blend",
    )
    columns = list(zip(*rows, strict=True)) if rows else [()] * len(names)
    return ColumnTable({name: np.array(column) for name, column in zip(names, columns, strict=True)})
