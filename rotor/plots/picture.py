"""Common parts of all pictures: style, colours, names of molecules, and files with provenance in their metadata."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rotor.formats.molecules.library import count_atoms, written_formula
from rotor.tops.top import Top
from rotor.version import version

BLUE, ORANGE, GREEN, GREY = (
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#555555",
)  # palette of Okabe and Ito, safe for colour-blind readers
PALETTE = (BLUE, ORANGE, GREEN, "#CC79A7", "#E69F00", "#56B4E9", "#000000")
STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.labelsize": 9.0,
    "axes.titlesize": 10.0,
    "axes.titlelocation": "left",
    "figure.labelsize": 9.0,
    "figure.titlesize": 10.0,
    "axes.prop_cycle": f"cycler('color', {list(PALETTE)})",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "axes.formatter.use_mathtext": True,
    "legend.frameon": False,
    "legend.fontsize": 9.0,
    "svg.fonttype": "none",
    "svg.hashsalt": "rotor",  # equal pictures give equal files
    "pdf.fonttype": 42,
}
_USERS: ContextVar[dict[Any, Any] | None] = ContextVar("settings of the user's style", default=None)
WIDTH_INCHES = 6.0  # letters of 9 points have 5 points where the picture is as wide as a column of 8.5 cm
SIZE_INCHES = (WIDTH_INCHES, 3.6)
DPI = 200
SUFFIXES = (".png", ".pdf", ".svg")
MOST_VECTOR_STICKS = 5_000  # more sticks are drawn as pixels inside a PDF or SVG


def checked_suffix(path: str | os.PathLike[str]) -> str:
    """The suffix of a path in lower case; ValueError unless it is .png, .pdf or .svg."""
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"{os.fspath(path)}: a picture is a .png, .pdf or .svg file")
    return suffix


def new_figure(size: tuple[float, float] = SIZE_INCHES, layout: Any = "constrained") -> Any:
    """An empty matplotlib figure with its canvas; size in inches, layout of matplotlib. Draw on it inside `styled()`.

    The user's style may set size and resolution (figure.figsize, figure.dpi).
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    users = _USERS.get() or {}
    figure = Figure(figsize=users.get("figure.figsize", size), dpi=users.get("figure.dpi", DPI), layout=layout)
    FigureCanvasAgg(figure)
    return figure


def styled() -> Any:
    """Context with the package's matplotlib style, overlaid by the user's style."""
    import matplotlib as mpl

    users = _USERS.get() or {}
    scale = users.get("font.size", STYLE["font.size"]) / STYLE["font.size"]
    sizes = {
        name: scale * size for name, size in STYLE.items() if name.endswith(("labelsize", "titlesize", "fontsize"))
    }
    return mpl.rc_context({**STYLE, **sizes, **users})


def style_settings(style: str | os.PathLike[str]) -> dict[Any, Any]:
    """Settings of a matplotlib style, by name or from an .mplstyle file; ValueError for an unknown name or a faulty file.

    >>> style_settings("ggplot")["axes.facecolor"]
    '#E5E5E5'
    """
    from matplotlib import style as styles

    name = os.fspath(style)
    if name in styles.library:
        return dict(styles.library[name])
    if not name.endswith(".mplstyle") or not Path(name).is_file():
        styles_text = ", ".join(name for name in styles.available if not name.startswith(("_", "seaborn")))
        raise ValueError(f"style {name!r}: expected an .mplstyle file, or a style of matplotlib, such as {styles_text}")
    return _read_style(name)


def _read_style(path: str) -> dict[Any, Any]:
    """Settings of an .mplstyle file; faults are collected from matplotlib's log, the only place where it reports them."""
    import logging

    import matplotlib as mpl

    faults: list[str] = []
    listener = logging.Handler(logging.WARNING)
    listener.emit = lambda record: faults.append(record.getMessage())  # type: ignore[method-assign]
    log = logging.getLogger("matplotlib")
    log.addHandler(listener)
    try:
        settings: dict[Any, Any] = dict(mpl.rc_params_from_file(path, use_default_template=False))
    except (ValueError, UnicodeDecodeError) as error:
        raise ValueError(f"style {path}: {error}") from None
    finally:
        log.removeHandler(listener)
    if faults:
        raise ValueError(f"style {path}: {' '.join(faults[0].split(chr(10), 2)[:2]).strip()}")
    return settings


@contextmanager
def users_style(style: str | os.PathLike[str] | None) -> Iterator[None]:
    """Context in which pictures have the user's style over that of the package; a matplotlib name, an .mplstyle file, or None."""
    token = _USERS.set(None if style is None else style_settings(style))
    try:
        yield
    finally:
        _USERS.reset(token)


def use_style() -> None:
    """Give all further matplotlib pictures the package's style: colours, letter sizes, axes without a frame.

    >>> import matplotlib
    >>> with matplotlib.rc_context():
    ...     use_style()
    ...     matplotlib.rcParams["axes.titlelocation"]
    'left'
    """
    import matplotlib as mpl

    mpl.rcParams.update(STYLE)


def panel(axes: Any = None, size: tuple[float, float] = SIZE_INCHES) -> tuple[Any, Any]:
    """A figure and one panel: the user's axes, or those of a new figure."""
    if axes is not None:
        return axes.figure, axes
    figure = new_figure(size)
    return figure, figure.add_subplot()


def without_signs(axes: Any) -> None:
    """Label the vertical axis of a mirrored picture by sizes: lines that are drawn downwards are not negative."""
    axes.yaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")


def legend_below(figure: Any, axes: Any, **options: Any) -> None:
    """Put a legend below the only panel of a figure, or inside the user's axes, whose figure may have others."""
    layout = figure.get_layout_engine() if hasattr(figure, "get_layout_engine") else None
    if len(figure.axes) == 1 and layout is not None:
        if "ncols" in options:  # as many as fit the width
            options["ncols"] = max(1, round(options["ncols"] * figure.get_figwidth() / SIZE_INCHES[0]))
        figure.legend(loc="outside lower right", **options)
    else:
        axes.legend(**options)


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure, and the title and facts in the metadata of its file."""

    figure: Any
    title: str = ""
    facts: Mapping[str, Any] = field(default_factory=dict)

    def save(self, path: str | os.PathLike[str], provenance: Mapping[str, Any] | None = None) -> None:
        """Write a .png, .pdf or .svg file with the title, the provenance and the facts in its metadata."""
        save(self.figure, path, self.title, {**(provenance or {}), **self.facts})


def save(figure: Any, path: str | os.PathLike[str], title: str, facts: Mapping[str, Any]) -> None:
    """Write a figure with title and facts (as JSON) in its metadata; without a date, so that equal pictures give equal files.

    figure: figure to write. path: a .png, .pdf or .svg file. title: title; dollar signs of formulas are removed. facts: content of the
    metadata.
    Raises ValueError for another suffix.
    """
    description = json.dumps(dict(facts), ensure_ascii=False, default=str)
    suffix, plain, program = checked_suffix(path), title.replace("$", ""), f"rotor {version()}"
    if suffix == ".png":
        metadata: dict[str, Any] = {"Software": program, "Title": plain, "Description": description}
    elif suffix == ".pdf":
        metadata = {"Creator": program, "Title": plain, "Subject": description, "CreationDate": None}
    else:
        metadata = {"Creator": program, "Title": plain, "Description": description, "Date": None}
    dots = (_USERS.get() or {}).get("savefig.dpi", "figure")
    with styled():
        wrap_titles(figure)
        wrap_titles(figure)
        figure.savefig(path, dpi=figure.dpi if dots == "figure" else dots, metadata=metadata)


def wrap_titles(figure: Any) -> None:
    """Break titles at the right edge of a figure, and shrink words that are wider; where two titles of a panel meet, stack them."""
    width = 0.76 * figure.bbox.width  # the rest is for the labels of the vertical axis
    suptitle = getattr(figure, "_suptitle", None)
    titles = [] if suptitle is None else [suptitle]
    for axes in figure.axes:
        left, right = axes._left_title, axes._right_title
        if right.get_text() and left.get_text() and _widest(left) + _widest(right) > width:
            left.set_text(f"{left.get_text()}\n{right.get_text()}")
            right.set_text("")
        titles += [axes.title, left, right]
    for title in titles:
        title.set_wrap(True)
        if (word := _widest(title, " ")) > width:
            title.set_fontsize(title.get_fontsize() * width / word)


def _widest(text: Any, separator: str = "\n") -> float:
    """The widest part of a text between separators and line ends, in pixels."""
    from matplotlib.text import Text

    parts = text.get_text().replace(separator, "\n").split("\n")
    figure, font = text.figure, text.get_fontproperties()
    return max(float(Text(0, 0, part, fontproperties=font, figure=figure).get_window_extent().width) for part in parts)


def formula_text(formula: str) -> str:
    """A formula in matplotlib's mathtext, with subscripts and isotope numbers.

    >>> formula_text("C[13C]H6O"), formula_text("H3O+")
    ('C$^{13}$CH$_{6}$O', 'H$_{3}$O$^{+}$')
    """
    text = re.sub(r"\[(\d+)([A-Z][a-z]?)\]", r"<\1>\2", formula)
    text = re.sub(r"(?<=[A-Za-z)])(\d+)", r"$_{\1}$", text)
    text = re.sub(r"\((\d+[+-])\)$|([+-])$", lambda m: f"$^{{{m[1] or m[2]}}}$", text)
    return re.sub(r"<(\d+)>", r"$^{\1}$", text)


def top_title(top: Top) -> str:
    """Name and formula of a top for a picture's title; the formula as in the library, else in Hill order.

    >>> from rotor.formats.read_write import read
    >>> top_title(read("HC3N")), top_title(Top.from_constants("B=1 GHz", name="SO2"))
    ('cyanoacetylene, HC$_{3}$N', 'SO$_{2}$')
    """
    if top.molecule is None:
        return name_text(top.name) or f"{top.kind} top"
    formula = top.molecule.formula
    written, name = written_formula(top.name, formula), top.name.removesuffix(f" ({formula})")
    if _COMPOSED.fullmatch(name) and count_atoms(name) == count_atoms(formula):
        return name_text(name)  # the name is the formula
    return ", ".join(dict.fromkeys(filter(None, (name_text(name), formula_text(written))))) or f"{top.kind} top"


def name_text(name: str) -> str:
    """A name for matplotlib, with subscripts if it is a formula.

    >>> name_text("SO2"), name_text("water"), name_text("c064502.cat")
    ('SO$_{2}$', 'water', 'c064502.cat')
    """
    return formula_text(name) if _COMPOSED.fullmatch(name) else name.replace("$", r"\$")


_ATOM = r"(?:\[\d+[A-Z][a-z]?\]|[A-Z][a-z]?)"
_COMPOSED = re.compile(rf"(?=.*\d)(?:{_ATOM}\d*)+")
