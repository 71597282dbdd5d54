"""A picture of rotational Raman lines: cross section against shift, Stokes to the right."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rotor.plots.spectrum import BLUE, DPI, GREY, MOST_VECTOR_STICKS, SIZE_INCHES, STYLE, VISIBLE, formula_text
from rotor.spectra.raman import RamanLines
from rotor.tops.top import Top
from rotor.version import version


def plot_raman(
    lines: RamanLines,
    path: str | os.PathLike[str],
    *,
    title: str | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> None:
    """Draw Raman lines as sticks at their shifts into a .png, .pdf or .svg file.

    title: instead of name, temperature and laser. provenance: what the metadata of the file shall say besides version
    and settings. Lines below 0.4 % of the strongest do not stretch the axis. Raises ValueError for a suffix that is no
    picture and for no lines.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".png", ".pdf", ".svg"):
        raise ValueError(f"{os.fspath(path)}: a picture is .png, .pdf or .svg; the suffix names the format")
    if not len(lines):
        raise ValueError(f"there is no Raman line to draw for {lines.top.name or 'this top'}")

    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=SIZE_INCHES, dpi=DPI, layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        _draw(axes, lines)
        axes.set_title(title if title is not None else _title(lines), loc="left")
        figure.savefig(path, dpi=DPI, metadata=_metadata(suffix, lines, provenance or {}))


def _draw(axes: Any, lines: RamanLines) -> None:
    heights, shifts = lines.cross_section_cm2_per_sr, lines.shift_cm
    seen = np.abs(shifts[heights >= VISIBLE * heights.max()]).max()
    many = len(lines) > MOST_VECTOR_STICKS
    axes.vlines(shifts, 0.0, heights, color=BLUE, linewidth=1.0 if len(lines) < 300 else 0.6, rasterized=many)
    axes.axvline(0.0, color=GREY, linewidth=0.7, linestyle=":")
    axes.set_xlim(-1.05 * seen, 1.05 * seen)
    axes.set_ylim(0.0, 1.1 * float(heights.max()))
    axes.set_xlabel("Raman shift (cm⁻¹): anti-Stokes below, Stokes above 0")
    axes.set_ylabel("dσ/dΩ (cm² sr⁻¹)")


def _title(lines: RamanLines) -> str:
    what = f"{lines.temperature_k:g} K, laser at {lines.laser_nm:g} nm"
    return f"{_name(lines.top)}, {what}"


def _name(top: Top) -> str:
    formula = formula_text(top.molecule.formula) if top.molecule is not None else ""
    return ", ".join(part for part in (top.name.replace("$", r"\$"), formula) if part) or f"{top.kind} top"


def _metadata(suffix: str, lines: RamanLines, more: Mapping[str, Any]) -> dict[str, Any]:
    """Provenance by the keys that each format has; no date, so that the same picture is the same file."""
    top = lines.top
    facts = {
        **more,
        "constants": top.constants.text(),
        "polarizability": top.polarizability_abc_angstrom3,
        "temperature_k": lines.temperature_k,
        "laser_nm": lines.laser_nm,
        "q": lines.partition.q,
        "jmax": lines.jmax,
    }
    description = "; ".join(f"{name}: {value}" for name, value in facts.items())
    program, title = f"rotor {version()}", _title(lines).replace("$", "")
    if suffix == ".png":
        return {"Software": program, "Title": title, "Description": description}
    if suffix == ".pdf":
        return {"Creator": program, "Title": title, "Subject": description, "CreationDate": None}
    return {"Creator": program, "Title": title, "Description": description, "Date": None}
