"""Film of a free rotation: the body in space beside the momentum sphere, as .gif or .mp4."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.free.free_motion import FreeMotion
from rotor.geometry.rotations import rotate, to_matrix
from rotor.plots.motion.sphere import MOTION, View, clear_view, draw_axes, draw_curve, draw_family, draw_sphere
from rotor.version import version

Names = tuple[str, str, str]

FRAMES = 150
FRAMES_PER_SECOND = 25
LARGEST_TURN_RAD = 0.8  # between frames; turns near π look slow or reversed
DOTS_PER_INCH = 80
PATH_POINTS = 1001  # of the path of L on the sphere
LIMIT = 1.45  # half the width of each panel; the body fits into a sphere of radius 1.15
# rows: right, up, towards the viewer; L points up
_EYE = np.array([[0.0, 1.0, 0.0], [-0.3, 0.0, 0.954], [0.954, 0.0, 0.3]])
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
_FACES = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))
_FACE_NORMALS = np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]], dtype=float)
_FACE_COLOURS = ("#0072B2", "#56B4E9", "#A06A92", "#CC79A7", "#009E73", "#7CCBB0")


@dataclass(frozen=True)
class Atoms:
    """Atoms to draw: positions (n, 3) in Å in the principal frame about the centre of mass, and symbols."""

    positions: Floats
    symbols: tuple[str, ...]

    @property
    def bonds(self) -> list[tuple[int, int]]:
        """Pairs closer than 1.25 times the sum of their covalent radii (ASE's, of Cordero et al. 2008)."""
        from ase.data import atomic_numbers, covalent_radii

        radii = covalent_radii[[atomic_numbers[s] for s in self.symbols]]
        apart = np.linalg.norm(self.positions[:, None] - self.positions[None], axis=-1)
        near = apart < 1.25 * (radii[:, None] + radii[None])
        return [(int(i), int(j)) for i, j in np.argwhere(near) if i < j]


def box_edges(moments: ArrayLike) -> Floats:
    """Half edges (3,) of the uniform box with these principal moments, the longest scaled to 1: e_i² ~ I_j + I_k - I_i.

    Moments that violate the triangle inequality, which no real body has, give a plate.

    >>> box_edges([2.0, 5.0, 5.0]).round(4).tolist()  # edges 1, 1, 2: moments as 2 : 5 : 5
    [1.0, 0.5, 0.5]
    """
    moments = np.asarray(moments, dtype=np.float64)
    squares = np.maximum(np.sum(moments) - 2.0 * moments, 0.0)
    return np.asarray(np.sqrt(squares / squares.max()))


def check_film(path: str | os.PathLike[str]) -> None:
    """Raise ValueError unless this installation can make a film of this suffix."""
    suffix = Path(path).suffix.lower()
    if suffix not in (".gif", ".mp4"):
        raise ValueError(f"{os.fspath(path)}: a film is a .gif or .mp4 file")
    if suffix == ".mp4":
        from matplotlib.animation import FFMpegWriter

        if not FFMpegWriter.isAvailable():
            raise ValueError(
                f"{os.fspath(path)}: an mp4 needs ffmpeg, which is not installed; install it, or write a .gif"
            )


def animate(
    motion: FreeMotion,
    times: ArrayLike,
    path: str | os.PathLike[str],
    *,
    atoms: Atoms | None = None,
    axis_names: Names = ("1", "2", "3"),
    time_unit: str = "",
    time_factor: float = 1.0,
    frames: int = FRAMES,
    provenance: Mapping[str, Any] | None = None,
) -> None:
    """Write a film of a free rotation from the first of `times`, in even steps of the exact motion.

    It ends at the last of `times`, or where its steps would turn the body by more than `LARGEST_TURN_RAD`.

    Left: the body in space, with L upright, drawn as its atoms or, without them, as the uniform box with its moments. Right: the
    path of L on the momentum sphere in the body.

    motion: motion of one body, in any units. times (n,): in the units of the motion; only their range counts. path: a .gif or .mp4 file.
    atoms: drawn instead of the box. axis_names: names of the principal axes. time_unit: unit of the displayed times. time_factor: factor
    of the displayed times. frames: number of frames. provenance: content of the comment (.gif) or comment tag (.mp4) in addition to
    program and version.
    Raises ValueError for a suffix that cannot be written here, and for equal times.
    """
    check_film(path)
    times = np.asarray(times, dtype=np.float64)
    if not times.size or np.ptp(times) == 0.0:
        raise ValueError("a film needs at least two different times")
    when = frame_times(motion, times, frames)
    momentum, attitude = motion.at(when)
    size = np.linalg.norm(motion.momentum0)
    path_of_l, whole_path = momentum / size, motion.at(np.linspace(times.min(), times.max(), PATH_POINTS))[0] / size
    to_view = _EYE @ _upright(rotate(motion.attitude0, motion.momentum0)) @ to_matrix(attitude)

    figure, (left, right) = _empty_stage()
    view = clear_view(motion.moments, path_of_l[0])
    _draw_still_parts(right, view, motion.moments, whole_path, axis_names)
    figure, (left, right) = _with_backdrop(figure)
    (trail,) = right.plot([], [], color=MOTION, linewidth=2.2, alpha=0.55)
    (dot,) = right.plot([], [], "o", ms=8, mfc=MOTION, mec="white")
    _draw_momentum(left)
    clock = left.set_title("", fontsize=9, y=1.0)
    body: list[Any] = []
    with _filmed(figure, Path(path), provenance or {}) as add_frame:
        for i in range(frames):
            for part in body:
                part.remove()
            body = (
                _draw_box(left, motion.moments, to_view[i]) if atoms is None else _draw_atoms(left, atoms, to_view[i])
            )
            clock.set_text(f"$t$ = {when[i] * time_factor:.4g} {time_unit}".rstrip())
            dot.set_data(*view.flat(path_of_l[i : i + 1]).T)
            trail.set_data(*view.flat(path_of_l[: i + 1]).T)
            add_frame()


def frame_times(motion: FreeMotion, times: Floats, frames: int = FRAMES) -> Floats:
    """Times (frames,) of a film from the first of `times` on, with steps that turn the body by `LARGEST_TURN_RAD` at most."""
    momentum, _ = motion.at(np.linspace(times.min(), times.max(), PATH_POINTS))
    omega = np.divide(momentum, motion.moments, out=np.zeros_like(momentum), where=motion.moments > 0.0)
    fastest = float(np.linalg.norm(omega, axis=-1).max())
    shown = min(float(np.ptp(times)), LARGEST_TURN_RAD * (frames - 1) / fastest)
    return np.asarray(times.min() + np.linspace(0.0, shown, frames))


@contextmanager
def _filmed(figure: Any, path: Path, provenance: Mapping[str, Any]) -> Iterator[Callable[[], None]]:
    """Yield a function that adds the current figure to a film; at the end, write the film with its provenance."""
    description = json.dumps({"program": "rotor", "version": version(), **provenance})  # ASCII, which gif requires
    if path.suffix.lower() == ".mp4":
        from matplotlib.animation import FFMpegWriter

        film = FFMpegWriter(fps=FRAMES_PER_SECOND, metadata={"comment": description})
        with film.saving(figure, os.fspath(path), dpi=DOTS_PER_INCH):
            yield film.grab_frame
        return
    from PIL import Image

    frames: list[Any] = []

    def add_frame() -> None:
        figure.canvas.draw()
        frames.append(Image.fromarray(np.array(figure.canvas.buffer_rgba())[..., :3]))

    yield add_frame
    frames[0].save(
        path,
        "GIF",
        save_all=True,
        append_images=frames[1:],
        duration=1000 // FRAMES_PER_SECOND,
        loop=0,
        comment=description,
    )


def _empty_stage() -> tuple[Any, Any]:
    """A figure with one panel for the body and one for the sphere, both within ±LIMIT."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 3.7), dpi=DOTS_PER_INCH)
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2, gridspec_kw={"left": 0, "right": 1, "bottom": 0, "top": 0.92, "wspace": 0})
    for axes in (left, right):
        axes.set(xlim=(-LIMIT, LIMIT), ylim=(-LIMIT, LIMIT), aspect="equal")
        axes.axis("off")
        axes.set_title("", y=1.0)  # a fixed position; otherwise each frame computes one
    return figure, (left, right)


def _with_backdrop(figure: Any) -> tuple[Any, Any]:
    """A new stage with the current drawing as background image, so that it is drawn once and not for each frame."""
    figure.canvas.draw()
    stage, places = _empty_stage()
    stage.figimage(np.array(figure.canvas.buffer_rgba()), zorder=-10)
    return stage, places


def _upright(momentum: Floats) -> Floats:
    """The rotation (3, 3) of space that takes L to the vertical by the shortest way."""
    unit = momentum / np.linalg.norm(momentum)
    half_way = unit + np.array([0.0, 0.0, 1.0])
    if np.linalg.norm(half_way) < 1e-8:  # L points straight down
        return np.diag([1.0, -1.0, -1.0])
    half_way /= np.linalg.norm(half_way)
    # takes L to the vertical, with an extra turn by π about it
    half_turn = 2.0 * np.outer(half_way, half_way) - np.eye(3)
    return np.asarray(np.diag([-1.0, -1.0, 1.0]) @ half_turn)


def _draw_still_parts(axes: Any, view: View, moments: Floats, path_of_l: Floats, names: Names) -> None:
    draw_sphere(axes)
    axes.set(xlim=(-LIMIT, LIMIT), ylim=(-LIMIT, LIMIT))
    draw_family(axes, view, moments)
    draw_curve(axes, view, path_of_l, color=MOTION, linewidth=1.0)
    draw_axes(axes, view, moments, names)
    axes.set_title("$L$ in the body", fontsize=9, y=1.0)


def _draw_momentum(axes: Any) -> None:
    """Draw the fixed direction of L in space."""
    up = (_EYE @ np.array([0.0, 0.0, 1.42]))[:2]
    axes.annotate("", up, -0.92 * up, zorder=0, arrowprops={"arrowstyle": "-|>", "color": "0.45", "lw": 1.2})
    axes.text(up[0] + 0.09, up[1] - 0.03, "$L$", color="0.35", va="center")


def _draw_box(axes: Any, moments: Floats, to_view: Floats) -> list[Any]:
    """Draw the visible faces of the box with these moments; `to_view` (3, 3) takes body axes to right, up, viewer."""
    edges = np.maximum(box_edges(moments), 0.03)  # a plate or a rod stays visible
    corners = _CORNERS * (1.15 * edges / np.linalg.norm(edges)) @ to_view.T
    return [
        axes.fill(*corners[list(face), :2].T, facecolor=colour, edgecolor="black", linewidth=0.8, alpha=0.95)[0]
        for face, normal, colour in zip(_FACES, _FACE_NORMALS @ to_view.T, _FACE_COLOURS, strict=True)
        if normal[2] > 0.0
    ]


def _draw_atoms(axes: Any, atoms: Atoms, to_view: Floats) -> list[Any]:
    """Draw balls and sticks from back to front."""
    from ase.data import atomic_numbers, covalent_radii
    from ase.data.colors import jmol_colors
    from matplotlib.patches import Circle

    numbers = [atomic_numbers[s] for s in atoms.symbols]
    radii = 0.55 * covalent_radii[numbers]
    scale = 1.15 / float(np.max(np.linalg.norm(atoms.positions, axis=1) + radii))
    seen = scale * atoms.positions @ to_view.T
    parts = []
    for i, j in atoms.bonds:
        along = (seen[j] - seen[i]) / np.linalg.norm(seen[j] - seen[i])
        ends = np.array([seen[i] + scale * radii[i] * along, seen[j] - scale * radii[j] * along])
        parts += axes.plot(
            *ends[:, :2].T, color="0.35", linewidth=5, solid_capstyle="round", zorder=2 + ends[:, 2].mean()
        )
    for place, radius, number in zip(seen, radii, numbers, strict=True):
        ball = Circle(place[:2], scale * radius, facecolor=jmol_colors[number], edgecolor="black", linewidth=0.9)
        ball.set_zorder(2 + place[2])
        parts.append(axes.add_patch(ball))
    return parts
