"""Title and limits of a picture, and whether its vertical axis is logarithmic."""

from __future__ import annotations

from typing import Any

from rotor.frozen import dataclass

Limits = tuple[float, float]


@dataclass(frozen=True)
class View:
    """Title; limits of the horizontal and the vertical axis in their units; log: vertical scale. None: chosen by the picture."""

    title: str | None = None
    horizontal: Limits | None = None
    vertical: Limits | None = None
    log: bool | None = None


WHOLE = View()


def show_part(axes: Any, view: View, scale: float = 1.0) -> None:
    """Set the limits of matplotlib axes to those of a view, the horizontal ones multiplied by `scale`; a log scale first.

    >>> from matplotlib.figure import Figure
    >>> axes = Figure().add_subplot()
    >>> show_part(axes, View(horizontal=(1.0, 2.0)), scale=1e3)
    >>> [float(x) for x in axes.get_xlim()]
    [1000.0, 2000.0]
    """
    if view.log is not None:
        axes.set_yscale("log" if view.log else "linear")
    if view.horizontal is not None:
        axes.set_xlim(view.horizontal[0] * scale, view.horizontal[1] * scale)
    if view.vertical is not None:
        low, high = view.vertical
        if low <= 0 and axes.get_yscale() == "log":
            raise ValueError(
                f"the vertical limits {low:g}:{high:g}: a logarithmic axis starts above 0; raise the first"
            )
        axes.set_ylim(low, high)
