"""Names of peaks, upright above them: the tallest always has its own, others where it lies on nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rotor.arrays import Floats
from rotor.plots.picture import GREY

SPACE = 1.3  # the vertical axis over the tallest peak that has a name


@dataclass(frozen=True)
class Peak:
    """Where the tip of a peak is, in the units of the axes, its name, and the colour of the name."""

    x: float
    y: float
    name: str
    colour: str = GREY


def name_peaks(axes: Any, peaks: Sequence[Peak], drawn: Floats, most: int = 12) -> None:
    """Write names above peaks, from the tallest down, none on another or on what is drawn.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        With its limits set; there is space above the tallest peak.
    peaks : sequence of Peak
        Of which those outside the limits have no name.
    drawn : (n, 2) array
        Tips of all that is drawn, in the units of the axes.
    most : int
        Names at most.
    """
    axes.figure.canvas.draw()  # places the axes, so that sizes in pixels are known
    (first, last), (low, high) = sorted(axes.get_xlim()), axes.get_ylim()
    pixels = axes.transData.transform(drawn)
    taken: list[Any] = []
    for peak in sorted(peaks, key=lambda each: -each.y):
        if len(taken) == most or not (first <= peak.x <= last and low < peak.y <= high):
            continue
        leave_or_remove(_written(axes, peak), axes, taken, pixels)


def leave_or_remove(text: Any, axes: Any, taken: list[Any], drawn: Floats) -> None:
    """Leave a name where it lies on nothing, else remove it; the first one always stays, inside the axes even at their edge.

    Parameters
    ----------
    text : matplotlib.text.Annotation
        The name, written.
    axes : matplotlib.axes.Axes
        On which it stands.
    taken : list of Bbox
        Of the names that are there, in pixels; that of a name that stays is added.
    drawn : (n, 2) array
        Tips of what is drawn, in pixels.
    """
    if not taken:
        move_inside(text, axes)
    box = text.get_window_extent().padded(2.0)
    if not taken or fits(box, axes.bbox, taken, drawn):
        taken.append(box)
    else:
        text.remove()


def _written(axes: Any, peak: Peak) -> Any:
    text = axes.annotate(
        peak.name, (peak.x, peak.y), xytext=(0, 3), textcoords="offset points", rotation=90, ha="center", va="bottom",
        fontsize=7, color=peak.colour,
    )  # fmt: skip
    text.set_in_layout(False)  # names go where the axes leave space; they do not move the axes
    return text


def move_inside(text: Any, axes: Any) -> None:
    """Shift a name sideways until it is inside the axes."""
    box = text.get_window_extent().padded(2.0)
    beyond = min(box.x0 - axes.bbox.x0, 0.0) + max(box.x1 - axes.bbox.x1, 0.0)
    across, up = text.get_position()
    text.set_position((across - beyond * 72.0 / axes.figure.dpi, up))


def fits(box: Any, frame: Any, taken: Sequence[Any], drawn: Floats) -> bool:
    """Whether a name lies inside the axes, on no other name and on nothing that is drawn.

    Parameters
    ----------
    box, frame : matplotlib.transforms.Bbox
        Of the name and of the axes, in pixels.
    taken : sequence of Bbox
        Of the names that are there.
    drawn : (n, 2) array
        Tips of what is drawn, in pixels.

    Returns
    -------
    bool
    """
    inside = box.x0 >= frame.x0 and box.x1 <= frame.x1 and box.y1 <= frame.y1
    crossed = (drawn[:, 0] > box.x0) & (drawn[:, 0] < box.x1) & (drawn[:, 1] > box.y0)
    return bool(inside and not crossed.any() and not any(box.overlaps(other) for other in taken))
