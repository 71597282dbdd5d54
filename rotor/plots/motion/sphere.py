"""The momentum sphere seen from one direction: visible and hidden curves, projected to a plane, so that they print sharp."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.free.polhodes import centre_axis, even_levels, polhode, separatrix

# colours for colour-blind readers (Okabe and Ito): polhodes about the axis of smallest moment, intermediate, largest; the motion
SMALL, MIDDLE, LARGE, MOTION = "#0072B2", "#A06A92", "#009E73", "#D55E00"
_RIM, _HIDDEN = "#9A9A9A", 0.22
_ASIDE = 0.5  # horizontal part of the direction of an axis from which its name begins or ends at the tip


@dataclass(frozen=True)
class View:
    """A direction of sight: rows of `axes` (3, 3) are right, up and towards the eye, in body axes."""

    axes: Floats

    def flat(self, points: ArrayLike) -> Floats:
        """Right and up, (..., 2), of points (..., 3) seen from far away."""
        return np.asarray(np.asarray(points) @ self.axes[:2].T)

    def depth(self, points: ArrayLike) -> Floats:
        """How far points are in front of the centre, (...)."""
        return np.asarray(np.asarray(points) @ self.axes[2])


def clear_view(moments: Floats, start: Floats) -> View:
    """A view that shows all three axes and has the unit vector `start` on the front, largest moment upright.

    The intermediate axis points at the reader more than the other two: there the separatrix crosses itself.
    """
    order = np.argsort(moments, kind="stable")
    eye, up = np.zeros(3), np.zeros(3)
    eye[order] = np.array([0.48, 0.78, 0.42]) * np.where(start[order] < 0.0, -1.0, 1.0)
    up[order[2]] = 1.0
    eye /= np.linalg.norm(eye)
    right = np.cross(up, eye)
    right /= np.linalg.norm(right)
    return View(np.array([right, np.cross(eye, right), eye]))


def draw_sphere(axes: Any) -> None:
    """Draw a shaded disc with a rim, without ticks and frame."""
    span = np.linspace(-1.0, 1.0, 256)
    x, y = np.meshgrid(span, span)
    light = np.hypot(x + 0.35, y - 0.45)
    disc = axes.imshow(
        -light, extent=(-1, 1, -1, 1), origin="lower", cmap="Greys_r", vmin=-4.6, vmax=-0.1, interpolation="bilinear"
    )
    from matplotlib.patches import Circle

    disc.set_clip_path(Circle((0, 0), 1.0, transform=axes.transData))
    axes.add_patch(Circle((0, 0), 1.0, fill=False, edgecolor=_RIM, linewidth=0.8))
    axes.set(xlim=(-1.3, 1.3), ylim=(-1.08, 1.36), aspect="equal")
    axes.axis("off")


def draw_curve(axes: Any, view: View, curve: Floats, **style: Any) -> None:
    """Draw a curve on the sphere, its hidden parts faint and thin.

    axes: axes to draw on. view: direction from which the sphere is seen. curve (n, 3): points on the unit sphere. style: options of
    `Axes.plot`: colour, width, label.
    """
    flat, front = view.flat(curve), view.depth(curve) >= 0.0
    width = style.pop("linewidth", 1.0)
    label = style.pop("label", None)
    for seen, strength, thick in ((front, 1.0, width), (~front, _HIDDEN, 0.7 * width)):
        shown = seen | np.roll(seen, 1)  # one point more, so that the parts meet at the rim
        x, y = np.where(shown[:, None], flat, np.nan).T
        name = label if seen is front else None
        axes.plot(x, y, alpha=strength, linewidth=thick, solid_capstyle="round", label=name, **style)


def draw_family(axes: Any, view: View, moments: Floats, per_side: int = 5) -> None:
    """Draw the separatrix, and polhodes on both sides in the colour of the axis that they enclose.

    A symmetric top has circles and an equator of points at rest, drawn dotted; a spherical or linear body has no
    polhodes.

    axes: axes to draw on. view: direction from which the sphere is seen. moments (3,): moments of inertia, any unit. per_side: energies
    on each side of the separatrix.
    """
    if np.any(moments == 0.0):
        _draw_equator(axes, view, int(np.argmin(moments)))
        return
    small = int(np.argsort(moments, kind="stable")[0])
    for level in even_levels(moments, per_side):
        colour = SMALL if centre_axis(moments, float(level)) == small else LARGE
        for branch in polhode(moments, float(level)):
            draw_curve(axes, view, branch, color=colour, linewidth=0.8)
    values = np.sort(moments)
    if values[0] < values[1] < values[2]:
        for circle, label in zip(separatrix(moments), ("separatrix", None), strict=True):
            draw_curve(axes, view, circle, color="black", linewidth=1.5, label=label)
    elif values[0] < values[2]:
        _draw_equator(axes, view, int(np.argmax(moments) if values[0] == values[1] else np.argmin(moments)))


def draw_axes(axes: Any, view: View, moments: Floats, names: tuple[str, str, str]) -> None:
    """Draw the ends of the principal axes with their names: filled where rotation about them is stable, else open.

    axes: axes to draw on. view: direction from which the sphere is seen. moments (3,): moments of inertia, any unit. names: names of the
    axes, as TeX.
    """
    values = np.sort(moments)
    for axis, name in enumerate(names):
        if moments[axis] == 0.0:  # L cannot point there
            continue
        unstable = values[0] < moments[axis] < values[2]
        for sign in (1.0, -1.0):
            end = sign * np.eye(3)[axis]
            (x, y), hidden = view.flat(end), view.depth(end) < 0.0
            face = "white" if unstable else "black"
            axes.plot(x, y, "o", ms=4.2, mfc=face, mec="black", mew=0.9, alpha=_HIDDEN if hidden else 1.0, zorder=6)
        positive = np.eye(3)[axis]
        tip, foot = view.flat(1.2 * positive), view.flat(positive)
        front = view.depth(positive) >= 0.0
        axes.annotate(
            "", tip, foot, zorder=5,
            arrowprops={"arrowstyle": "-|>,head_width=0.18,head_length=0.35", "color": "black", "lw": 0.9,
                        "alpha": 1.0 if front else 0.45, "shrinkA": 3, "shrinkB": 0},
        )  # fmt: skip
        outward = _outward(tip)
        side = "center" if abs(outward[0]) < _ASIDE else "left" if outward[0] > 0 else "right"
        axes.text(*tip + (0.075 if side == "center" else 0.04) * outward, f"${name}$", ha=side, va="center", zorder=7)


def _outward(point: Floats) -> Floats:
    return np.asarray(point / max(float(np.linalg.norm(point)), 1e-12))


def _draw_equator(axes: Any, view: View, axis: int) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    circle = np.zeros((361, 3))
    circle[:, (axis + 1) % 3], circle[:, (axis + 2) % 3] = np.cos(angle), np.sin(angle)
    draw_curve(axes, view, circle, color="black", linewidth=1.3, linestyle=":", label="points at rest")
