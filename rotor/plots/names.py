"""Vertical names above peaks: the tallest peak is always named, others where nothing is in the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rotor.arrays import Floats
from rotor.plots.picture import GREY

SPACE = 1.45  # height of the vertical axis relative to the tallest named peak


@dataclass(frozen=True)
class Peak:
    """Position of a peak's tip in axis units, its name, and the colour of the name."""

    x: float
    y: float
    name: str
    colour: str = GREY


def name_peaks(axes: Any, peaks: Sequence[Peak], drawn: Floats, most: int = 12) -> None:
    """Write names above peaks, from the tallest down, without overlap with other names or with the drawing.

    axes: with final limits, and space above the tallest peak. peaks: peaks outside the limits are not named. drawn (n, 2): tips of
    everything drawn, in axis units. most: largest number of names.
    """
    axes.figure.canvas.draw()  # computes the layout, so that pixel sizes are valid
    write_names(axes, peaks, drawn, most)


def write_names(axes: Any, peaks: Sequence[Peak], drawn: Floats, most: int = 12) -> None:
    """`name_peaks` on a figure whose layout is computed."""
    (first, last), (low, high) = sorted(axes.get_xlim()), axes.get_ylim()
    pixels = axes.transData.transform(drawn)
    boxes: list[Any] = []
    for peak in sorted(peaks, key=lambda candidate: -candidate.y):
        if len(boxes) == most or not (first <= peak.x <= last and low < peak.y <= high):
            continue
        leave_or_remove(_written(axes, peak), axes, boxes, pixels)


def leave_or_remove(text: Any, axes: Any, boxes: list[Any], drawn: Floats) -> None:
    """Leave a name if nothing is in the way, else remove it; the first name always stays, moved inside the axes if needed.

    text: the written name. axes: axes of the name. boxes: boxes of the names so far, in pixels; the box of a name that stays is added.
    drawn (n, 2): tips of everything drawn, in pixels.
    """
    if not boxes:
        move_inside(text, axes)
    box = text.get_window_extent().padded(2.0)
    if not boxes or fits(box, axes.bbox, boxes, drawn):
        boxes.append(box)
    else:
        text.remove()


def height_share(axes: Any, name: str) -> float:
    """Part of the height of the axes that an upright name takes with the space below and above it."""
    axes.figure.canvas.draw()  # computes the layout, so that pixel sizes are valid
    text = _written(axes, Peak(axes.get_xlim()[0], axes.get_ylim()[0], name, "black"))
    share = (text.get_window_extent().height + 4.0 * axes.figure.dpi / 72.0) / axes.bbox.height
    text.remove()
    return float(share)


def _written(axes: Any, peak: Peak) -> Any:
    text = axes.annotate(
        peak.name, (peak.x, peak.y), xytext=(0, 3), textcoords="offset points", rotation=90, ha="center", va="bottom",
        fontsize=9, color=peak.colour,
    )  # fmt: skip
    text.set_in_layout(False)  # names use free space and do not change the layout
    return text


def move_inside(text: Any, axes: Any) -> None:
    """Shift a name sideways into the axes."""
    box = text.get_window_extent().padded(2.0)
    beyond = min(box.x0 - axes.bbox.x0, 0.0) + max(box.x1 - axes.bbox.x1, 0.0)
    across, up = text.get_position()
    text.set_position((across - beyond * 72.0 / axes.figure.dpi, up))


def fits(box: Any, frame: Any, boxes: Sequence[Any], drawn: Floats) -> bool:
    """Whether a name lies inside the axes without overlap with other names or the drawing.

    box, frame: boxes of the name and of the axes, in pixels. boxes: boxes of the names so far. drawn (n, 2): tips of everything drawn, in
    pixels.
    """
    inside = box.x0 >= frame.x0 and box.x1 <= frame.x1 and box.y1 <= frame.y1
    crossed = (drawn[:, 0] > box.x0) & (drawn[:, 0] < box.x1) & (drawn[:, 1] > box.y0)
    return bool(inside and not crossed.any() and not any(box.overlaps(other) for other in boxes))
