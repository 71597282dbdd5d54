"""`rotor.plot`: a matplotlib figure of any result of the package, for notebooks, or a picture in a file.

A module of these folders has a function `picture`, which draws the objects of its classes.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib import import_module
from typing import Any

from rotor.plots.picture import Picture, checked_suffix, users_style, wrap_titles

MODULES = {
    "motion.alignment": ("AlignmentTrace", "AlignAnswer"),
    "spectra.assign": ("AssignAnswer",),
    "spectra.catalogue": ("Catalogue",),
    "spectra.comparison": ("Comparison",),
    "motion.driven": ("DrivenAnswer",),
    "spectra.emission": ("EmissionAnswer",),
    "spectra.fit": ("Fit", "FitAnswer"),
    "motion.fluid": ("FluidAnswer",),
    "motion.gas": ("GasAnswer", "Correlations", "Equipartition"),
    "energies.heat_capacity": ("ThermoAnswer", "ThermoFunctions"),
    "energies.levels": ("LevelsAnswer", "SelectedLevels", "Levels"),
    "motion.polhodes": ("TumbleAnswer", "FreeMotion"),
    "spectra.raman": ("RamanAnswer", "RamanLines"),
    "spectra.spectrum": ("SpectrumAnswer", "Spectrum", "Lines"),
    "energies.stark": ("StarkAnswer", "FieldMap", "FieldLines"),
    "structure": ("StructureAnswer",),
    "energies.torsion": ("TorsionAnswer",),
    "energies.zeeman": ("ZeemanAnswer",),
}  # classes by the module that draws them; a module is imported when it draws
# modules that draw on axes of the user
SINGLE_PANEL = ("spectra.catalogue", "spectra.emission", "energies.levels", "spectra.raman", "spectra.spectrum")


def plot(
    thing: Any,
    path: str | os.PathLike[str] | None = None,
    *,
    ax: Any = None,
    style: str | os.PathLike[str] | None = None,
    **options: Any,
) -> Any:
    """A matplotlib figure of lines, spectra, levels, motions, thermodynamic functions, gases and fits, or of an answer with them.

    Parameters
    ----------
    thing : Lines, Spectrum, RamanLines, Levels, FreeMotion, ThermoFunctions, Correlations, Equipartition, Catalogue, Fit
        What to draw: one of these, the answer to a request for one of them, or the result of a verb.
    path : path, optional
        A .png, .pdf or .svg file to write.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on, for lines, spectra, Raman lines, levels, emission and catalogues; other pictures have several panels.
    style : str or path, optional
        A style of matplotlib ("ggplot") or an .mplstyle file over the style of the package: letters, lines, grid, size, background.
        Colours that have a meaning stay.
    options :
        Options of the picture: those of `spectrum_figure`, `raman_figure`, `levels_figure`, `polhode_figure`, ...

    Returns
    -------
    matplotlib.figure.Figure
        A notebook shows it as the last expression of a cell.

    Raises
    ------
    ValueError
        For an object without a picture, a suffix other than .png, .pdf, .svg, and `ax` for a picture of several panels.

    Examples
    --------
    >>> from rotor.spectra.lines import line_list
    >>> from rotor.tops.top import Top
    >>> figure = plot(line_list(Top.from_constants("B=57.6 GHz", dipole_abc_debye=(0.1, 0, 0)), jmax=5))
    >>> figure.axes[0].get_xlabel()
    'Frequency (GHz)'
    """
    thing = getattr(thing, "answer", thing)  # of the result of a verb
    module = _picture_module(thing)
    if path is not None:
        checked_suffix(path)
    if ax is not None:
        if module not in SINGLE_PANEL:
            accepted = ", ".join(sorted(kind for name in SINGLE_PANEL for kind in MODULES[name]))
            raise ValueError(
                f"ax: the picture of a {type(thing).__name__} needs a figure of its own; ax is accepted for {accepted}"
            )
        options["axes"] = ax
    with users_style(style):
        picture = _draw(module, thing, **options)
        if ax is None:
            wrap_titles(picture.figure)
        if path is not None:
            picture.save(path)
    return picture.figure


def write_picture(
    thing: Any, path: str | os.PathLike[str], provenance: Mapping[str, Any] | None = None, **options: Any
) -> None:
    """Draw an object into a .png, .pdf or .svg file, with the provenance in its metadata.

    Raises ValueError for another suffix, and as `plot` does.
    """
    checked_suffix(path)
    _draw(_picture_module(thing), thing, **options).save(path, provenance)


def _picture_module(thing: Any) -> str:
    """The module that draws an object."""
    for kind in type(thing).__mro__:
        for module, names in MODULES.items():
            if kind.__name__ in names:
                return module
    drawable = ", ".join(sorted(name for names in MODULES.values() for name in names))
    raise ValueError(f"there is no picture of a {type(thing).__name__}; there are pictures of {drawable}")


def _draw(module: str, thing: Any, **options: Any) -> Picture:
    picture: Picture = import_module(f"rotor.plots.{module}").picture(thing, **options)
    return picture
