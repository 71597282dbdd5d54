"""Lines that a molecule of a source emits at its excitation temperature: computed from a top, or taken from a catalogue.

    I(T) = (8π³/3hc) ν g_I S μ² [exp(-E″/kT) - exp(-E′/kT)] / Q(T)          integrated absorption (`rotor.spectra.intensity`)

A top is solved at the temperature; a catalogue has lines and Q(T). Lines below the least optical depth are computed down to a thousandth
of it, so that the error from leaving them out is known.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.arrays import Floats, Ints
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.hyperfine_method import hyperfine_facts
from rotor.spectra.emission.emission import KM_PER_S, Source, peak_depth
from rotor.spectra.lines import line_list
from rotor.spectra.profiles import gaussian
from rotor.thermodynamics.sums.classical_limit import typical_j

if TYPE_CHECKING:
    from rotor.tops.top import Top

EDGE_WIDTHS = 5.0  # full widths beyond the edges of a range: a Gaussian is down to exp(-69) there
WEAKEST = 1e-3  # of the least optical depth: weaker lines are not computed
BETWEEN = 1.25  # sum of Gaussians between their centres over that at a centre: 1.07 for two lines, 1.22 for many


class Partition(Protocol):
    """Partition function Q(T) with the spin weights of the lines."""

    @property
    def source(self) -> str:
        """Source of Q."""

    def at(self, temperature_k: float) -> float:
        """Q at a temperature in K."""


@runtime_checkable
class CatalogueLines(Protocol):
    """Lines of a catalogue with Q(T), (n,) each, rising in frequency (`rotor.observed.model.species.SpeciesLines`)."""

    @property
    def name(self) -> str:
        """Name of the molecule."""

    @property
    def source(self) -> str:
        """Source of the lines."""

    @property
    def partition(self) -> Partition:
        """Q(T)."""

    @property
    def frequency_mhz(self) -> Floats:
        """Rest frequencies in MHz."""

    @property
    def energy_upper_k(self) -> Floats:
        """E′/k."""

    @property
    def g_upper(self) -> Floats:
        """Degeneracy of the upper level."""

    @property
    def einstein_a_per_s(self) -> Floats:
        """Einstein coefficient of spontaneous emission in 1/s."""

    @property
    def upper(self) -> NDArray[np.str_]:
        """Quantum numbers of the upper level."""

    @property
    def lower(self) -> NDArray[np.str_]:
        """Quantum numbers of the lower level."""

    def intensity_nm2_mhz(self, temperature_k: float) -> Floats:
        """Integrated absorption I(T) of a molecule in nm² MHz."""

    def between(self, first_mhz: float, last_mhz: float) -> CatalogueLines:
        """The lines in a range of frequencies."""


@dataclass(frozen=True, eq=False)
class EmittedLines:
    """Lines of a molecule, (n,) each, at one temperature.

    energy_upper_k: E′/k. q: partition function, with its source. quanta: names of the quantum numbers in upper and lower; empty for a
    catalogue, whose numbers are as printed. effects, hyperfine: of the Hamiltonian of a top; hyperfine is None without spins.
    typical_j: J at which effects on a top's lines are compared. q_error: relative bound of the sum Q; 0 for a catalogue.
    left_out_depth: bound of the optical depth of neglected lines, anywhere.
    """

    temperature_k: float
    frequency_mhz: Floats
    intensity_nm2_mhz: Floats
    energy_upper_k: Floats
    g_upper: Floats
    einstein_a_per_s: Floats
    upper: tuple[str, ...]
    lower: tuple[str, ...]
    q: float
    q_source: str
    quanta: tuple[str, ...] = ()
    effects: tuple[QuantumEffect, ...] = ()
    typical_j: int = 0
    hyperfine: dict[str, Any] | None = None
    notes: tuple[str, ...] = ()
    q_error: float = 0.0
    left_out_depth: float = 0.0

    def where(self, rows: Ints) -> EmittedLines:
        """The lines of these rows."""
        columns = ("frequency_mhz", "intensity_nm2_mhz", "energy_upper_k", "g_upper", "einstein_a_per_s")
        selected: dict[str, Any] = {name: getattr(self, name)[rows] for name in columns}
        selected |= {name: tuple(getattr(self, name)[row] for row in rows.tolist()) for name in ("upper", "lower")}
        return replace(self, **selected)


def emitted_lines(
    molecule: Top | CatalogueLines,
    source: Source,
    range_mhz: tuple[float, float],
    least_depth: float,
    effects: Sequence[QuantumEffect] = SEMI_RIGID,
) -> EmittedLines:
    """Lines of a molecule above a least optical depth whose profile, or wing, falls into the observed range.

    Parameters
    ----------
    molecule : Top or CatalogueLines
    source : Source
        Column density, excitation temperature, width, velocity and redshift of the molecule.
    range_mhz : (float, float)
        Observed range.
    least_depth : float
        Optical depth of the weakest line, at its centre.
    effects : sequence of QuantumEffect, optional
        The Hamiltonian of a top.

    Returns
    -------
    EmittedLines

    Raises
    ------
    ValueError
        For a catalogue whose Q(T) does not cover the temperature.
    """
    widths = EDGE_WIDTHS * source.fwhm_km_s / KM_PER_S
    first, last = (
        ν / source.frequency_ratio * (1 + wing) for ν, wing in zip(range_mhz, (-widths, widths), strict=True)
    )
    if isinstance(molecule, CatalogueLines):
        return _catalogue_lines(molecule, source, (first, last), least_depth)
    return _top_lines(molecule, source, (first, last), least_depth, tuple(effects))


def _top_lines(
    top: Top, source: Source, rest_mhz: tuple[float, float], least_depth: float, effects: tuple[QuantumEffect, ...]
) -> EmittedLines:
    """Lines of a top. The depth at a centre is N I 2 √(ln 2/π)/Δν; the narrowest Δν, at the lowest frequency, gives the cut."""
    width = rest_mhz[0] * source.fwhm_km_s / KM_PER_S
    depth_per_area = float(gaussian(np.zeros(1), width)[0]) * source.column_per_cm2 * units.NM2_IN_CM2
    least = math.log10(least_depth / depth_per_area)
    lines = line_list(
        top,
        temperature_k=source.excitation_k,
        min_lgint=least + math.log10(WEAKEST),
        range_mhz=rest_mhz,
        effects=effects or SEMI_RIGID,
    )
    strong = lines.intensity_nm2_mhz >= 10.0**least
    rows = np.flatnonzero(strong)
    labels = [
        tuple(" ".join(text.split()) for text in lines.levels.labels(states[rows]))
        for states in (lines.upper, lines.lower)
    ]
    frequency = lines.frequency_mhz[rows]
    upper_cm = lines.energy_lower_cm[rows] + frequency / units.MHZ_PER_CM
    weak = lines.frequency_mhz[~strong], lines.intensity_nm2_mhz[~strong] * depth_per_area
    return EmittedLines(
        temperature_k=source.excitation_k,
        frequency_mhz=frequency,
        intensity_nm2_mhz=lines.intensity_nm2_mhz[rows],
        energy_upper_k=upper_cm * units.MHZ_PER_CM / units.MHZ_PER_K,
        g_upper=np.asarray(lines.g_upper, dtype=np.float64)[rows],
        einstein_a_per_s=lines.einstein_a_per_s[rows],
        upper=labels[0],
        lower=labels[1],
        q=float(lines.q),
        q_source=lines.partition.source,
        quanta=tuple(lines.quanta_names),
        effects=tuple(lines.levels.effects),
        typical_j=typical_j(top, source.excitation_k, lines.levels.rotational[lines.upper[rows]], lines.jmax),
        hyperfine=hyperfine_facts(top, lines.levels),
        notes=(*_geometry_notes(top), *lines.warnings),
        q_error=lines.partition.relative_error,
        left_out_depth=WEAKEST * least_depth + blend_depth(*weak, source),
    )


def _geometry_notes(top: Top) -> Iterator[str]:
    """Note that frequencies from a geometry are too inaccurate to find lines with a telescope."""
    if top.source_geometry is not None and top.estimated_error:
        yield (
            f"{top.name}: constants are from a geometry with an error of {100 * top.estimated_error:.2g} %, frequencies have "
            "this error: a catalogue of JPL or CDMS (.cat) has measured frequencies"
        )


def blend_depth(frequency_mhz: Floats, depth: Floats, source: Source) -> float:
    """Bound of the optical depth that Gaussian lines (n,) of these central depths reach together.

    >>> narrow = Source(1e14, 10.0, 1.0)
    >>> round(blend_depth(np.array([1e5, 1e5, 2e5]), np.array([1e-7, 1e-7, 1e-7]), narrow) / 1e-7, 3)
    2.5
    """
    if not len(depth):
        return 0.0
    order = np.argsort(frequency_mhz)
    places, depths = frequency_mhz[order], depth[order]
    width = places * source.fwhm_km_s / KM_PER_S
    first, last = np.searchsorted(places, places - 3 * width), np.searchsorted(places, places + 3 * width)
    near = [slice(*pair) for pair in zip(first.tolist(), last.tolist(), strict=True)]
    sums = [
        float(depths[group] @ np.exp(-4 * math.log(2) * ((places[group] - place) / line_width) ** 2))
        for group, place, line_width in zip(near, places.tolist(), width.tolist(), strict=True)
    ]
    return BETWEEN * max(sums)


def _catalogue_lines(
    catalogue: CatalogueLines, source: Source, rest_mhz: tuple[float, float], least_depth: float
) -> EmittedLines:
    lines, temperature = catalogue.between(*rest_mhz), source.excitation_k
    all_lines = EmittedLines(
        temperature_k=temperature,
        frequency_mhz=lines.frequency_mhz,
        intensity_nm2_mhz=lines.intensity_nm2_mhz(temperature),
        energy_upper_k=lines.energy_upper_k,
        g_upper=lines.g_upper,
        einstein_a_per_s=lines.einstein_a_per_s,
        upper=tuple(lines.upper.tolist()),
        lower=tuple(lines.lower.tolist()),
        q=catalogue.partition.at(temperature),
        q_source=catalogue.partition.source,
    )
    depth = peak_depth(all_lines, source)
    weak = depth < least_depth
    left_out = blend_depth(all_lines.frequency_mhz[weak], depth[weak], source)
    return replace(all_lines.where(np.flatnonzero(~weak)), left_out_depth=left_out)
