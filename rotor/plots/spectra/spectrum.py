"""A picture of a spectrum: sticks or a profile, with units, temperature, and the strongest lines named."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.checks import require_choice
from rotor.plots.names import leave_or_remove
from rotor.plots.picture import BLUE, GREY, MOST_VECTOR_STICKS, Picture, panel, styled, top_title
from rotor.plots.view import Limits, View, show_part
from rotor.quantum.labels.quanta import line_text, rotational_quanta
from rotor.spectra.lines import Lines
from rotor.spectra.request import SpectrumAnswer
from rotor.spectra.spectrum import Spectrum, line_widths
from rotor.units import MHZ_PER_CM

UNITS = {"MHz": 1.0, "GHz": 1e3, "THz": 1e6, "cm-1": MHZ_PER_CM}  # units of the frequency axis, in MHz
VISIBLE = 4e-3  # lines below this part of the strongest do not stretch the axis of frequency
LEAST_NAMED = 0.02  # of a linear axis: lower lines cannot be seen
LEAST_HEIGHT = 0.55  # part of the axis for the strongest line; long names have the rest
TALL = 1e-2  # below this part of the strongest, lines cannot be seen on a linear axis
NARROW = 1e-3  # a range narrower than this part of its frequency is shown in MHz, with all digits
MOST_DECADES = 6
MOST_VERTICES = 20_000  # per curve; more cannot be distinguished on paper


@dataclass(frozen=True)
class _Axis:
    """Unit of the frequencies, its name and its size in MHz, and the ends shown, in MHz."""

    unit: str
    mhz: float
    first: float
    last: float

    def inside(self, frequency_mhz: Floats) -> NDArray[np.bool_]:
        return (frequency_mhz >= self.first) & (frequency_mhz <= self.last)


def picture(thing: Lines | Spectrum | SpectrumAnswer, **options: Any) -> Picture:
    """The picture of lines, of a spectrum, or of the answer that has them; options: of `spectrum_figure`."""
    if isinstance(thing, SpectrumAnswer):
        thing = thing.lines if thing.request.shape == "sticks" else thing.spectrum
    lines = thing if isinstance(thing, Lines) else thing.lines
    figure = spectrum_figure(thing, **options)
    return Picture(figure, options.get("title") or _title(thing, lines), _facts(thing, lines))


def spectrum_figure(
    thing: Lines | Spectrum,
    *,
    range_mhz: tuple[float, float] | None = None,
    title: str | None = None,
    labels: int = 12,
    unit: str | None = None,
    log: bool | None = None,
    vertical: Limits | None = None,
    axes: Any = None,
) -> Any:
    """A matplotlib figure of lines as sticks, or of a spectrum as a curve.

    thing: sticks are integrated absorption in nm² MHz, a curve is the cross section in nm². range_mhz (2,): frequencies shown. By default
    the range of the request; without one, that of the lines above 0.4 % of the strongest. title: by default name, formula and
    temperature. labels: greatest number of lines that are named: the strongest first, others where there is space. unit: unit of the
    frequency axis; by default the one that gives numbers below 2000. log: whether the axis of intensity is logarithmic; by default where
    fewer than ten lines would be seen on a linear one. vertical (2,): lowest and highest intensity shown, in the unit of the axis. axes:
    axes to draw on; by default those of a new figure.
    Returns: one panel. Lines of one rotational transition are named by the quantum numbers of their spins alone; the transition stands
    above the picture.
    Raises ValueError for a spectrum without lines or with nothing in the range, an unknown unit, a logarithmic axis from 0 or less.
    """
    if unit is not None:
        require_choice("unit", unit, UNITS)
    lines = thing if isinstance(thing, Lines) else thing.lines
    heights = _heights(thing, lines)
    with styled():
        figure, axes = panel(axes)
        x = _frequency_axis(thing, lines, heights, range_mhz, unit)
        _draw(axes, thing, x)
        _scale(axes, thing, lines, heights, x, log)
        show_part(axes, View(vertical=vertical))
        transition = "" if lines is None else _only_transition(lines, _strongest_first(thing, lines, heights, x))
        _inscribe(axes, thing, lines, x, title, transition)
        if lines is not None and labels:
            if vertical is None:
                _leave_space(figure, axes, thing, lines, heights, x, transition)
            _name_lines(figure, axes, thing, lines, heights, x, labels, transition)
    return figure


def _heights(thing: Lines | Spectrum, lines: Lines | None) -> Floats:
    """Height of each line in the picture: its intensity, or the curve at its centre."""
    if lines is None:
        return np.zeros(0)
    if isinstance(thing, Lines):
        return lines.intensity_nm2_mhz
    return np.asarray(np.interp(lines.frequency_mhz, thing.frequency_mhz, thing.intensity, left=0.0, right=0.0))


def _frequency_axis(
    thing: Lines | Spectrum,
    lines: Lines | None,
    heights: Floats,
    range_mhz: tuple[float, float] | None,
    unit: str | None,
) -> _Axis:
    first, last = range_mhz or _range_shown(thing, lines, heights)
    if unit is None:
        narrow = last - first < NARROW * last
        unit = "MHz" if narrow else next((name for name in ("MHz", "GHz") if last < 2e3 * UNITS[name]), "THz")
    return _Axis(unit, UNITS[unit], first, last)


def _range_shown(thing: Lines | Spectrum, lines: Lines | None, heights: Floats) -> tuple[float, float]:
    """The range of the request; without one, that of the visible lines, from 0 if the first is near it."""
    if lines is None:
        assert isinstance(thing, Spectrum)
        return float(thing.frequency_mhz[0]), float(thing.frequency_mhz[-1])
    if not len(lines) or not heights.max() > 0:
        raise ValueError(
            f"there is no line to draw for {lines.top.name or 'this top'}; widen the range or lower the cut"
        )

    if math.isfinite(lines.range_mhz[1]):
        return lines.range_mhz
    visible = lines.frequency_mhz[heights >= VISIBLE * heights.max()]
    low, high = float(visible.min()), float(visible.max())
    margin = 0.02 * (high - low) or 0.02 * high
    return (0.0 if low - margin < 0.1 * high else low - margin), high + margin


def _draw(axes: Any, thing: Lines | Spectrum, x: _Axis) -> None:
    if isinstance(thing, Spectrum):
        shown = x.inside(thing.frequency_mhz)
        axes.plot(*thinned(thing.frequency_mhz[shown] / x.mhz, thing.intensity[shown]), color=BLUE, linewidth=0.8)
        return
    shown = x.inside(thing.frequency_mhz)
    many = int(shown.sum()) > MOST_VECTOR_STICKS
    width = 1.0 if shown.sum() < 300 else 0.6
    frequencies, heights = thing.frequency_mhz[shown] / x.mhz, thing.intensity_nm2_mhz[shown]
    axes.vlines(frequencies, 0.0, heights, color=BLUE, linewidth=width, rasterized=many)


def thinned(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """The lowest and highest point of every strip, where a curve has more points than can be distinguished."""
    if len(x) <= MOST_VERTICES:
        return x, y
    strips = np.linspace(x[0], x[-1], MOST_VERTICES // 4)
    starts = np.unique(np.searchsorted(x, strips, side="left").clip(max=len(x) - 1))
    low, high = np.minimum.reduceat(y, starts), np.maximum.reduceat(y, starts)
    return np.repeat(x[starts], 2), np.stack([low, high], axis=1).ravel()


def _scale(
    axes: Any, thing: Lines | Spectrum, lines: Lines | None, heights: Floats, x: _Axis, log: bool | None
) -> None:
    """Limits of both axes, with space for names above the lines."""
    axes.set_xlim(x.first / x.mhz, x.last / x.mhz)
    shown = np.zeros(0) if lines is None else lines.intensity_nm2_mhz[x.inside(lines.frequency_mhz)]
    tallest = _tallest(thing, x)
    if _is_logarithmic(shown[shown > 0]) if log is None else log:
        positive = shown[shown > 0] if (shown > 0).any() else np.array([tallest * 1e-3, tallest])
        decades = min(max(math.log10(positive.max() / positive.min()), 1.0), MOST_DECADES)
        axes.set_yscale("log")
        axes.set_ylim(tallest * 10 ** (-1.05 * decades), tallest * 10 ** (0.28 * decades))
    else:
        axes.set_ylim(0.0, 1.28 * tallest)
    if x.last - x.first < NARROW * x.last:
        axes.ticklabel_format(axis="x", useOffset=False, style="plain")


def _tallest(thing: Lines | Spectrum, x: _Axis) -> float:
    height = thing.intensity_nm2_mhz if isinstance(thing, Lines) else thing.intensity
    tallest = float(height[x.inside(thing.frequency_mhz)].max(initial=0.0))
    if not tallest > 0:
        raise ValueError(f"nothing between {x.first:g} and {x.last:g} MHz to draw; widen the range or lower the cut")
    return tallest


def _is_logarithmic(heights: Floats) -> bool:
    """Whether fewer than ten lines (or fewer than half of less than twenty) reach a hundredth of the tallest."""
    if len(heights) < 2:
        return False
    return int((heights >= TALL * heights.max()).sum()) < min(10, len(heights) / 2)


def _only_transition(lines: Lines, rows: Ints) -> str:
    """The rotational transition that all hyperfine lines in `rows` share, or an empty text."""
    quanta = lines.levels.quanta
    rotation = rotational_quanta(quanta)
    if len(rows) < 2 or len(rotation) == len(quanta):
        return ""
    quanta_by_line = np.stack(
        [column[side[rows]] for column in rotation.values() for side in (lines.upper, lines.lower)]
    )
    alike = bool((quanta_by_line == quanta_by_line[:, :1]).all())
    return (
        line_text(rotation, int(lines.upper[rows[0]]), int(lines.lower[rows[0]]), lines.levels.halves) if alike else ""
    )


def _inscribe(
    axes: Any, thing: Lines | Spectrum, lines: Lines | None, x: _Axis, title: str | None, transition: str
) -> None:
    axes.set_xlabel("Wavenumber (cm⁻¹)" if x.unit == "cm-1" else f"Frequency ({x.unit})")
    axes.set_ylabel("Integrated absorption (nm² MHz)" if isinstance(thing, Lines) else _ordinate(thing))
    axes.set_title(title if title is not None else _title(thing, lines), loc="left")
    shape = _shape_text(thing) if isinstance(thing, Spectrum) and thing.profile else ""
    axes.set_title("; ".join(filter(None, (transition, shape))), loc="right", fontsize=9, color=GREY)


def _shape_text(spectrum: Spectrum) -> str:
    width = "Doppler width" if spectrum.fwhm_mhz is None else f"FWHM {spectrum.fwhm_mhz:g} MHz"
    if spectrum.profile == "voigt":
        width = f"Doppler and Lorentzian of {width}"
    return f"{spectrum.profile.capitalize()} profile, {width}"


def _ordinate(spectrum: Spectrum) -> str:
    names = {"nm^2": "Absorption cross section (nm²)", "optical depth": "Optical depth"}
    return names.get(spectrum.unit, f"Intensity ({spectrum.unit})")


def _title(thing: Lines | Spectrum, lines: Lines | None) -> str:
    temperature = f"{thing.temperature_k:g} K" if thing.temperature_k else ""
    return ", ".join(filter(None, (top_title(lines.top) if lines is not None else "", temperature)))


def _name_lines(
    figure: Any, axes: Any, thing: Lines | Spectrum, lines: Lines, heights: Floats, x: _Axis, most: int, transition: str
) -> None:
    """Name the strongest lines from the strongest down, upright above them, wherever there is space."""
    figure.canvas.draw()  # places the axes, so that sizes in pixels are known
    low, high = axes.get_ylim()
    if axes.get_yscale() == "linear":
        low = max(low, LEAST_NAMED * high)
    rows = _strongest_first(thing, lines, heights, x)
    rows = rows[(heights[rows] > low) & (heights[rows] <= high)][: 15 * most]
    drawn = _drawn_points(axes, thing, x)
    places = axes.transData.transform(np.stack([lines.frequency_mhz[rows] / x.mhz, heights[rows]], axis=1))
    boxes: list[Any] = []
    for row, place in zip(rows.tolist(), places, strict=True):
        if len(boxes) == most:
            break
        if any(box.x0 - 6 < place[0] < box.x1 + 6 and box.y0 - 40 < place[1] < box.y1 for box in boxes):
            continue  # no need to measure a name that cannot fit
        leave_or_remove(_label(axes, lines, row, heights[row], x, transition), axes, boxes, drawn)


def _strongest_first(thing: Lines | Spectrum, lines: Lines, heights: Floats, x: _Axis) -> Ints:
    """Rows of the lines that can be seen as such between the ends shown, the strongest first."""
    rows = np.flatnonzero(x.inside(lines.frequency_mhz) & _stands_out(thing, lines, heights))
    return rows[np.argsort(-lines.intensity_nm2_mhz[rows], kind="stable")]


def _leave_space(
    figure: Any, axes: Any, thing: Lines | Spectrum, lines: Lines, heights: Floats, x: _Axis, transition: str
) -> None:
    """Raise the upper limit until the name of the strongest line stands inside."""
    rows = _strongest_first(thing, lines, heights, x)
    if not len(rows):
        return
    figure.canvas.draw()  # places the axes, so that sizes in pixels are known
    name = _label(axes, lines, int(rows[0]), heights[rows[0]], x, transition)
    box = name.get_window_extent()
    name.remove()
    if box.y1 + 4 <= axes.bbox.y1:
        return
    place = axes.transData.transform((lines.frequency_mhz[rows[0]] / x.mhz, heights[rows[0]]))[1]
    share = max(1 - (box.y1 + 4 - place) / axes.bbox.height, LEAST_HEIGHT)  # the name keeps its height in pixels
    if axes.get_yscale() == "log":
        low = axes.get_ylim()[0]
        axes.set_ylim(low, low * (heights[rows[0]] / low) ** (1 / share))
    else:
        axes.set_ylim(0.0, heights[rows[0]] / share)


def _stands_out(thing: Lines | Spectrum, lines: Lines, heights: Floats) -> NDArray[np.bool_]:
    """Lines that can be seen as such: every stick; of a curve, those within a peak and not on its slope."""
    if isinstance(thing, Lines):
        return heights > 0
    width = line_widths(lines, thing.profile, thing.fwhm_mhz)
    on_sides = [
        np.interp(lines.frequency_mhz + side * width / 2, thing.frequency_mhz, thing.intensity) for side in (-1, 1)
    ]
    return (heights > 0) & (heights > np.maximum(*on_sides))


def _drawn_points(axes: Any, thing: Lines | Spectrum, x: _Axis) -> Floats:
    """Pixels (n, 2) of the tops of sticks, or of the curve: names must not cover them."""
    shown = x.inside(thing.frequency_mhz)
    height = thing.intensity_nm2_mhz if isinstance(thing, Lines) else thing.intensity
    points = np.stack([thing.frequency_mhz[shown] / x.mhz, height[shown]], axis=1)
    return np.asarray(axes.transData.transform(points[points[:, 1] > 0]))


def _label(axes: Any, lines: Lines, row: int, height: float, x: _Axis, transition: str) -> Any:
    levels = lines.levels
    text = line_text(levels.quanta, int(lines.upper[row]), int(lines.lower[row]), levels.halves)
    name = axes.annotate(
        text.removeprefix(f"{transition}, ") if transition else text,
        (lines.frequency_mhz[row] / x.mhz, height),
        xytext=(0, 3),
        textcoords="offset points",
        rotation=90,
        ha="center",
        va="bottom",
        fontsize=9,
        color=GREY,
    )
    name.set_in_layout(False)  # names go where the axes leave space; they do not move the axes
    return name


def _facts(thing: Lines | Spectrum, lines: Lines | None) -> dict[str, Any]:
    """Entries of the metadata that describe the lines and their shape."""
    facts: dict[str, Any] = {}
    if lines is not None:
        top = lines.top
        facts = {
            "constants": top.constants.text(),
            "constants source": top.source,
            "dipole": top.dipole_abc_debye,
            "dipole source": top.dipole_source,
            "spin weights": top.spin_weights.to_mapping(),
            "temperature_k": lines.temperature_k,
            "q": lines.q,
            "jmax": lines.jmax,
            "min_lgint": lines.min_lgint,
        }
    if isinstance(thing, Spectrum):
        facts |= {"profile": thing.profile, "fwhm_mhz": thing.fwhm_mhz}
    return facts
