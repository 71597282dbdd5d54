"""`rotor.plot`: a matplotlib figure of any result of the package, for notebooks, or a picture in a file."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import singledispatch
from typing import Any

import numpy as np

from rotor.alignment.align import AlignmentTrace
from rotor.alignment.request import AlignAnswer
from rotor.assignment.answer import AssignAnswer
from rotor.classical.free.free_motion import FreeMotion
from rotor.classical.gas.ensembles import Correlations
from rotor.classical.tumble import PERIODS, TumbleAnswer
from rotor.fitting.fit import Fit
from rotor.fluids.request import FluidAnswer
from rotor.formats.fit_request import FitAnswer
from rotor.formats.spcat.compare import Comparison
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.formats.structure_request import StructureAnswer
from rotor.plots.picture import name_text, save, users_style, wrap_titles
from rotor.quantum.fields.field_map import FieldMap
from rotor.quantum.fields.stark_request import StarkAnswer
from rotor.quantum.fields.zeeman_request import ZeemanAnswer
from rotor.quantum.levels import Levels
from rotor.quantum.request import LevelsAnswer, SelectedLevels
from rotor.spectra.emission_request import EmissionAnswer
from rotor.spectra.lines import Lines
from rotor.spectra.raman import RamanLines
from rotor.spectra.raman_request import RamanAnswer
from rotor.spectra.request import SpectrumAnswer
from rotor.spectra.spectrum import Spectrum
from rotor.statistics.equipartition import Equipartition
from rotor.thermodynamics.classical_gas import GasAnswer
from rotor.thermodynamics.functions import ThermoFunctions
from rotor.thermodynamics.request import ThermoAnswer
from rotor.thermodynamics.torsion_request import TorsionAnswer

ONE_PANEL = (
    Lines,
    Spectrum,
    SpectrumAnswer,
    RamanLines,
    RamanAnswer,
    SelectedLevels,
    Levels,
    LevelsAnswer,
    EmissionAnswer,
    Catalogue,
)


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
        What to draw: one of these, or the answer to a request for one of them.
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
    if ax is not None:
        if not isinstance(thing, ONE_PANEL):
            accepted = ", ".join(sorted(kind.__name__ for kind in ONE_PANEL))
            raise ValueError(
                f"ax: the picture of a {type(thing).__name__} needs a figure of its own; ax is accepted for {accepted}"
            )
        options["axes"] = ax
    with users_style(style):
        figure = _figure(thing, **options)
        if ax is None:
            wrap_titles(figure)
        if path is not None:
            save(figure, path, type(thing).__name__, {})
    return figure


@singledispatch
def _figure(thing: Any, **options: Any) -> Any:
    drawable = ", ".join(sorted(kind.__name__ for kind in _figure.registry if kind is not object))
    raise ValueError(f"there is no picture of a {type(thing).__name__}; there are pictures of {drawable}")


@_figure.register(Lines)
@_figure.register(Spectrum)
def _(thing: Lines | Spectrum, **options: Any) -> Any:
    from rotor.plots.spectrum import spectrum_figure

    return spectrum_figure(thing, **options)


@_figure.register
def _(thing: SpectrumAnswer, **options: Any) -> Any:
    return _figure(thing.lines if thing.request.shape == "sticks" else thing.spectrum, **options)


@_figure.register
def _(thing: RamanLines, **options: Any) -> Any:
    from rotor.plots.raman import raman_figure

    return raman_figure(thing, **options)


@_figure.register
def _(thing: SelectedLevels, **options: Any) -> Any:
    from rotor.plots.levels import levels_figure

    return levels_figure(thing, **options)


@_figure.register
def _(thing: Levels, **options: Any) -> Any:
    return _figure(SelectedLevels(thing, np.arange(len(thing))), **options)


@_figure.register
def _(thing: LevelsAnswer, **options: Any) -> Any:
    return _figure(thing.table, **({"top": thing.request.top} | options))


@_figure.register
def _(thing: FreeMotion, **options: Any) -> Any:
    from rotor.plots.polhodes import polhode_figure

    span = PERIODS * float(thing.period) if np.isfinite(thing.period) else 20 * np.pi / float(thing.turning_rate)
    return polhode_figure(thing, **({"times": [0.0, span]} | options))


@_figure.register
def _(thing: TumbleAnswer, **options: Any) -> Any:
    units = thing.request.units
    shown = {
        "times": thing.table.times / units.time_factor,
        "axis_names": thing.request.axes,
        "time_label": f"Time ({units.time})" if units.time else "Time",
        "time_factor": units.time_factor,
    }
    return _figure(thing.motion, **(shown | options))


@_figure.register
def _(thing: ThermoFunctions, **options: Any) -> Any:
    from rotor.plots.heat_capacity import Panel, heat_capacity_figure
    from rotor.plots.picture import name_of_top

    label = "quantum" if thing.species == "equilibrium" else f"quantum, {thing.species}"
    return heat_capacity_figure([Panel(name_of_top(thing.top), {label: thing})], **options)


@_figure.register
def _(thing: Correlations, **options: Any) -> Any:
    from rotor.plots.gas import correlation_figure

    return correlation_figure({options.pop("title", ""): thing}, **options)


@_figure.register
def _(thing: Equipartition, **options: Any) -> Any:
    from rotor.plots.gas import equipartition_figure

    return equipartition_figure({options.pop("title", ""): thing}, **options)


@_figure.register
def _(thing: Catalogue, **options: Any) -> Any:
    from rotor.plots.catalogue import catalogue_figure

    return catalogue_figure(thing, **options)


def _drawn_by_attribute(attribute: str) -> Callable[..., Any]:
    """A function that draws an attribute of an answer instead of the answer."""

    def figure(thing: Any, **options: Any) -> Any:
        return _figure(getattr(thing, attribute), **options)

    return figure


@_figure.register
def _(thing: EmissionAnswer, **options: Any) -> Any:
    from rotor.plots.emission import emission_figure

    return emission_figure(thing, **options)


@_figure.register
def _(thing: FieldMap, **options: Any) -> Any:
    from rotor.plots.stark import stark_figure

    return stark_figure(thing, **options)


@_figure.register
def _(thing: AlignmentTrace, **options: Any) -> Any:
    from rotor.plots.alignment import alignment_figure

    return alignment_figure(thing, **options)


@_figure.register
def _(thing: AlignAnswer, **options: Any) -> Any:
    return _figure(thing.trace, **({"classical": thing.classical} | options))


@_figure.register
def _(thing: Comparison, **options: Any) -> Any:
    from rotor.plots.comparison import comparison_figure

    return comparison_figure(thing, **options)


@_figure.register
def _(thing: GasAnswer, **options: Any) -> Any:
    return _figure(thing.test if thing.correlations is None else thing.correlations, **options)


@_figure.register
def _(thing: FluidAnswer, **options: Any) -> Any:
    from rotor.plots.fluid import fluid_figure

    molecules = len(np.unique(thing.atoms.arrays["molecule"]))
    return fluid_figure(thing.record, None, molecules, **options)


@_figure.register
def _(thing: ZeemanAnswer, **options: Any) -> Any:
    from rotor.plots.zeeman import zeeman_figure

    return zeeman_figure(thing.states, spins=len(thing.request.spin_g), **options)


@_figure.register
def _(thing: Fit, **options: Any) -> Any:
    from rotor.plots.fit import fit_figure

    return fit_figure(thing, **options)


@_figure.register
def _(thing: AssignAnswer, **options: Any) -> Any:
    from rotor.plots.assign import assignment_figure

    return assignment_figure(thing, **options)


@_figure.register
def _(thing: TorsionAnswer, **options: Any) -> Any:
    from rotor.plots.torsion import torsion_figure

    return torsion_figure(thing, **options)


@_figure.register
def _(thing: StructureAnswer, **options: Any) -> Any:
    from rotor.plots.structure import structure_figure

    molecule, values, method = thing.geometry
    title = f"{name_text(thing.request.file.family.name)}, {method}"
    return structure_figure(molecule, **({"values": values, "title": title} | options))


_figure.register(FitAnswer, _drawn_by_attribute("fit"))
_figure.register(StarkAnswer, _drawn_by_attribute("states"))
_figure.register(RamanAnswer, _drawn_by_attribute("lines"))
_figure.register(ThermoAnswer, _drawn_by_attribute("functions"))
