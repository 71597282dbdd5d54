"""Means of a run with errors for correlated data, and the conservation of the conserved energy."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.fluids.record import FluidRecord
from rotor.statistics.equipartition import statistical_inefficiency
from rotor.units import KJ_PER_MOL_EV


@dataclass(frozen=True)
class Mean:
    """A mean, its standard error √(var g/n), and n/g with the statistical inefficiency g; nan for too few rows."""

    quantity: str
    unit: str
    mean: float
    error: float
    effective_samples: float


def series_mean(quantity: str, unit: str, values: Floats) -> Mean:
    """The mean of a correlated series (n,).

    >>> noise = np.random.default_rng(1).normal(size=4000)
    >>> round(series_mean("x", "K", noise).error, 3)
    0.016
    """
    if len(values) < 2 or not np.isfinite(values).all():
        return Mean(quantity, unit, float(np.mean(values)) if len(values) else math.nan, math.nan, math.nan)
    samples = len(values) / statistical_inefficiency(values[:, None])
    return Mean(quantity, unit, float(values.mean()), float(values.std(ddof=1) / math.sqrt(samples)), samples)


def means(record: FluidRecord, molecules: int, share: float = 0.5) -> list[Mean]:
    """Means over the last `share` of a record: energies per molecule, temperatures and their ratio, pressure.

    Undefined quantities (rotational temperature of atoms, pressure without a cell) have no row.
    """
    first = math.floor(len(record) * (1.0 - share))
    last = {name: column[first:] for name, column in record.columns.items()}
    per_mole = KJ_PER_MOL_EV / molecules
    table = [series_mean("potential energy", "kJ/mol", last["potential_ev"] * per_mole)]
    for name, column in (
        ("temperature", "temperature_k"),
        ("of translation", "translation_k"),
        ("of rotation", "rotation_k"),
    ):
        if np.isfinite(last[column]).all():
            table.append(series_mean(name, "K", last[column]))
    if np.isfinite(last["rotation_k"]).all() and np.all(last["translation_k"] > 0.0):
        table.append(series_ratio("rotation over translation", last["rotation_k"], last["translation_k"]))
    if np.isfinite(last["pressure_bar"]).all():
        table.append(series_mean("pressure", "bar", last["pressure_bar"]))
    return table


def series_ratio(quantity: str, above: Floats, below: Floats) -> Mean:
    """The ratio of two means of correlated series; its error is that of above - ratio · below, over the mean of below.

    >>> x = np.random.default_rng(1).normal(300, 5, size=4000)
    >>> round(series_ratio("r", x, x).error, 12)
    0.0
    """
    ratio = float(above.mean() / below.mean())
    return series_mean(quantity, "", ratio + (above - ratio * below) / below.mean())


def conserved(record: FluidRecord) -> tuple[float, float, float]:
    """Root mean square of the conserved energy about its mean, eV, and its drift with a standard error, eV/ns."""
    if len(record) < 2:
        return math.nan, math.nan, math.nan
    return float(record.total_ev.std()), *drift_per_ns(record.time_ps, record.total_ev)


def drift_per_ns(time_ps: ArrayLike, energy: ArrayLike) -> tuple[float, float]:
    """Slope of an energy per ns by least squares, and its standard error from the scatter about the line, including correlations.

    The error is nan for two rows, which leave no scatter.
    """
    t, e = np.asarray(time_ps, dtype=np.float64) / 1000, np.asarray(energy, dtype=np.float64)
    away = t - t.mean()
    slope = float(away @ (e - e.mean()) / (away @ away))
    rest = series_mean("", "", e - e.mean() - slope * away)
    return slope, rest.error / float(t.std()) if len(t) > 2 else math.nan
