"""What all pictures share: style, colours, names of molecules, and files with their provenance in the metadata."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rotor.tops.top import Top
from rotor.version import version

BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#555555"  # Okabe and Ito's palette, for the colour-blind
PALETTE = (BLUE, ORANGE, GREEN, "#CC79A7", "#E69F00", "#56B4E9")
STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.labelsize": 9.0,
    "axes.titlesize": 10.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "axes.formatter.use_mathtext": True,
    "svg.fonttype": "none",
    "svg.hashsalt": "rotor",  # the same picture is the same file
    "pdf.fonttype": 42,
}
SIZE_INCHES = (7.2, 3.8)
DPI = 200
SUFFIXES = (".png", ".pdf", ".svg")
MOST_VECTOR_STICKS = 5_000  # more are drawn as pixels inside a PDF or SVG


def checked_suffix(path: str | os.PathLike[str]) -> str:
    """The suffix of a path in lower case; ValueError unless it is that of a picture."""
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"{os.fspath(path)}: a picture is .png, .pdf or .svg; the suffix names the format")
    return suffix


def new_figure(size: tuple[float, float] = SIZE_INCHES) -> Any:
    """An empty matplotlib figure with a canvas of its own, in inches; draw on it inside `styled()`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def styled() -> Any:
    """A context in which matplotlib has the style of the package."""
    import matplotlib as mpl

    return mpl.rc_context(STYLE)


def save(figure: Any, path: str | os.PathLike[str], title: str, facts: Mapping[str, Any]) -> None:
    """Write a figure with its title and facts, as JSON, in the metadata; no date, so that the same picture is the same file."""
    suffix, plain = checked_suffix(path), title.replace("$", "")
    text = json.dumps(dict(facts), ensure_ascii=False, default=str)
    program = f"rotor {version()}"
    if suffix == ".png":
        metadata: dict[str, Any] = {"Software": program, "Title": plain, "Description": text}
    elif suffix == ".pdf":
        metadata = {"Creator": program, "Title": plain, "Subject": text, "CreationDate": None}
    else:
        metadata = {"Creator": program, "Title": plain, "Description": text, "Date": None}
    with styled():
        figure.savefig(path, dpi=DPI, metadata=metadata)


def formula_text(formula: str) -> str:
    """A formula with subscripts and isotope numbers in matplotlib's mathtext.

    >>> formula_text("C[13C]H6O"), formula_text("H3O+")
    ('C$^{13}$CH$_{6}$O', 'H$_{3}$O$^{+}$')
    """
    text = re.sub(r"\[(\d+)([A-Z][a-z]?)\]", r"<\1>\2", formula)
    text = re.sub(r"(?<=[A-Za-z)])(\d+)", r"$_{\1}$", text)
    text = re.sub(r"\((\d+[+-])\)$|([+-])$", lambda m: f"$^{{{m[1] or m[2]}}}$", text)
    return re.sub(r"<(\d+)>", r"$^{\1}$", text)


def name_of_top(top: Top) -> str:
    """Name and formula of a top for the head of a picture; the formula as the library writes it, else in Hill's order.

    >>> from rotor.formats.read_write import read
    >>> name_of_top(read("HC3N")), name_of_top(Top.from_constants("B=1 GHz", name="SO2"))
    ('cyanoacetylene, HC$_{3}$N', 'SO$_{2}$')
    """
    written = formula_text(_as_written(top.name, top.molecule.formula)) if top.molecule is not None else ""
    name = formula_text(top.name) if _COMPOSED.fullmatch(top.name) else top.name.replace("$", r"\$")
    return ", ".join(dict.fromkeys(filter(None, (name, written)))) or f"{top.kind} top"


_ATOM = r"(?:\[\d+[A-Z][a-z]?\]|[A-Z][a-z]?)"
_COMPOSED = re.compile(rf"(?=.*\d)(?:{_ATOM}\d*)+")


def _as_written(name: str, formula: str) -> str:
    """The formula as the library writes that of a molecule of this name: HC3N, where Hill's order is C3HN."""
    from rotor.formats.library import library_file, names

    path = library_file(name) if name else None
    if path is None:
        return formula
    known = [path.stem, *(key for key, of in names().items() if of == path)]
    return next((one for one in known if _atoms(one) == _atoms(formula)), formula)


def _atoms(formula: str) -> dict[str, int]:
    """How many atoms of each element, or of each isotope that is marked, a formula has."""
    counts: dict[str, int] = {}
    for atom, number in re.findall(rf"({_ATOM})(\d*)", formula):
        counts[atom] = counts.get(atom, 0) + int(number or 1)
    return counts
