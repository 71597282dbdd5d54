"""Loomis-Wood rows: sections of a spectrum about the expected lines of a series, drawn below each other.

A series is a line of a species with a step of its quantum numbers, whose frequencies the model predicts, or two or more frequencies that
are extrapolated: ν_n is the polynomial through the last three of them (F. W. Loomis and R. W. Wood, Phys. Rev. 32, 223 (1928), for the
diagram).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.viewer.prediction import Model, Predicted
from rotor.viewer.pyramid import Pyramid
from rotor.viewer.records import Series

MOST_ROWS = 200


@dataclass(frozen=True, eq=False)
class Centres:
    """Expected frequencies (n,) of a series, numbers of the rows, and labels (n, k); k is 0 for extrapolated series."""

    number: Ints
    frequency_mhz: Floats
    upper: Ints
    lower: Ints

    def where(self, chosen: Ints) -> Centres:
        """The rows with these indices."""
        return Centres(self.number[chosen], self.frequency_mhz[chosen], self.upper[chosen], self.lower[chosen])


def row_centres(series: Series, band_mhz: tuple[float, float], predicted: Predicted | None) -> Centres:
    """The rows of a series in a band, in order of their numbers.

    Raises ValueError for a series without a step, with labels that do not fit, and of fewer than two frequencies.
    """
    if series.frequencies_mhz:
        rows = _extrapolated(series.frequencies_mhz)
    elif predicted is None:
        raise ValueError("series: choose a species and a line of it, or two frequencies")
    else:
        rows = _modelled(series, predicted)
    inside = np.isfinite(rows.frequency_mhz) & (rows.frequency_mhz > band_mhz[0]) & (rows.frequency_mhz < band_mhz[1])
    return rows.where(np.flatnonzero(inside)[:MOST_ROWS])


def _extrapolated(frequencies: tuple[float, ...]) -> Centres:
    """The polynomial through the last two or three frequencies, extrapolated to both sides."""
    if len(frequencies) < 2:
        raise ValueError("series: one frequency; two or more are needed to extrapolate")
    points = frequencies[-3:]
    first = len(frequencies) - len(points)
    number = np.arange(-MOST_ROWS, len(frequencies) + MOST_ROWS)
    t = number - first
    difference, bend = points[1] - points[0], points[-1] - 2 * points[1] + points[0] if len(points) == 3 else 0.0
    values = points[0] + difference * t + bend * t * (t - 1) / 2  # Newton's form
    if difference == 0:
        raise ValueError(f"series: {points[0]:.4f} MHz twice; two different frequencies are needed")
    known = dict(enumerate(frequencies))
    values = np.array([known.get(n, value) for n, value in zip(number.tolist(), values.tolist(), strict=True)])
    rising = np.sign(difference) * np.gradient(values) > 0  # beyond the vertex the polynomial turns back
    blank = np.zeros((len(number), 0), dtype=np.int64)
    return Centres(number[rising], values[rising], blank[rising], blank[rising])


def _modelled(series: Series, predicted: Predicted) -> Centres:
    """Labels of a series and their predicted frequencies."""
    model: Model = predicted.model
    count = len(model.quanta)
    if not (len(series.upper) == len(series.lower) == len(series.step) == count) or not any(series.step):
        raise ValueError(
            f"series: upper, lower and step need {count} quantum numbers each ({', '.join(model.quanta)}), and a step other than 0"
        )
    number = np.arange(-MOST_ROWS, MOST_ROWS + 1)
    steps = number[:, None] * np.array(series.step)
    upper, lower = np.array(series.upper) + steps, np.array(series.lower) + steps
    levels = predicted.lines.levels
    rows = [label_rows(model, levels, side) for side in (upper, lower)]
    exists = (rows[0] >= 0) & (rows[1] >= 0)
    energy = levels.energy_mhz
    frequency = np.where(exists, energy[rows[0]] - energy[rows[1]], np.nan)
    return Centres(number[exists], frequency[exists], upper[exists], lower[exists])


def label_rows(model: Model, levels: object, labels: Ints) -> Ints:
    """Rows of levels by their labels; -1 for labels without a level."""
    from rotor.quantum.labels.quanta import SPECIES_NUMBERS

    letters = {number: letter for letter, number in SPECIES_NUMBERS.items()}
    columns = {
        name: np.array([letters.get(x, "?") for x in labels[:, i].tolist()]) if name == "species" else labels[:, i]
        for i, name in enumerate(model.quanta)
    }
    return np.asarray(levels.rows_of(**columns))  # type: ignore[attr-defined]


def row_points(centres: Centres, spectrum: Pyramid, half_width_mhz: float, pixels: int) -> list[tuple[Floats, Floats]]:
    """Points to draw for each row: distance from the centre (MHz) and intensity."""
    if not half_width_mhz > 0:
        raise ValueError(f"half width of the rows: {half_width_mhz:g} MHz; expected more than 0")
    points = []
    for centre in centres.frequency_mhz.tolist():
        x, y = spectrum.window(centre - half_width_mhz, centre + half_width_mhz, pixels)
        points.append((x - centre, y))
    return points
