"""Request for the emission of a source with one or several molecules, and its answer.

Optical depths add: τ = Σ_m N_m Σ_i I_i φ_i, where each molecule has an excitation temperature, velocity and width. T_B follows from the sum
(`emission.emission`). For each line the answer has E_u/k, the optical depth and T_B at its centre, and ∫T_B dv over its Gaussian,
computed without overlap with other lines.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.hamiltonian_input import effects_of_each_field
from rotor.requests.budget import ErrorBudget
from rotor.requests.field import CONDITIONS, REQUIRED, check_fields, declared, part
from rotor.requests.knob import DECADES, Knob, Measure
from rotor.requests.lists import Each
from rotor.requests.readers import Custom, Quantity, Range
from rotor.spectra.emission.emission import (
    BACKGROUND_K,
    KM_PER_S,
    Emission,
    Source,
    band_mhz,
    contrast_k,
    emission,
    peak_depth,
    require_layer,
    source_grid,
    together,
)
from rotor.table import Table, TextOf, counted

if TYPE_CHECKING:
    from rotor.spectra.emission.emitters import CatalogueLines, EmittedLines
    from rotor.tops.top import Top

LEAST_DEPTH = 1e-6  # weaker lines are left out
MOST_POINTS = 5_000_000
_ACROSS = np.linspace(-3.0, 3.0, 241)  # widths at half maximum: a Gaussian has fallen to 1e-11


@dataclass(frozen=True)
class LayerInput:
    """The gas of a source and its background; tuples have one number for all molecules or one for each."""

    column_per_cm2: tuple[float, ...] = declared(
        (1e14,), Each("1/cm2", above=0, metavar="N"), "Column density, one for all or one each: 1e14,3e13 (1/cm²)", option="--column",
        panel=CONDITIONS, common=True,
    )  # fmt: skip
    excitation_k: tuple[float, ...] = declared(
        (100.0,), Each("K", above=0, metavar="T"), "Excitation temperature of rotation, one for all or one each (K)",
        "conditions.excitation", common=True,
    )  # fmt: skip
    background_k: float = declared(
        BACKGROUND_K, Quantity("K", least=0, metavar="T"), "Temperature behind the source, as observed (K)", "conditions.background",
        common=True,
    )  # fmt: skip
    filling: float = declared(
        1.0, Quantity(above=0, most=1, metavar="F"), "Fraction of the beam that the source fills", "conditions.filling"
    )
    velocity_km_s: tuple[float, ...] = declared(
        (0.0,), Each("km/s", metavar="V"), "Velocity, one for all or one each; receding positive, radio convention (km/s)",
        "conditions.velocity", common=True,
    )  # fmt: skip
    redshift: float = declared(
        0.0, Quantity(metavar="Z"), "Redshift of the source; velocities are relative to it", "conditions.redshift"
    )
    fwhm_km_s: tuple[float, ...] = declared(
        (1.0,), Each("km/s", metavar="W"), "Full width of the lines at half maximum, one for all or one each (km/s)", "conditions.width",
        common=True,
    )  # fmt: skip


_MOLECULE_FIELDS = ("column_per_cm2", "excitation_k", "fwhm_km_s", "velocity_km_s")


def _sources(layer: LayerInput, subject: Any) -> tuple[Source, ...]:
    """The source of each molecule; `departures` of the subject override the layer's values."""
    count, departures = len(subject.values["molecules"]), subject.departures
    for name in _MOLECULE_FIELDS:
        values = getattr(layer, name)
        if len(values) not in (1, count):
            text = ",".join(f"{value:g}" for value in values)
            raise ValueError(
                f"{name}: {text}: {counted(len(values), 'number')} for {counted(count, 'molecule')}; "
                "expected a single number, or one for each molecule"
            )

    def value(name: str, number: int) -> float:
        values = getattr(layer, name)
        return float(departures[number].get(name, values[number if len(values) > 1 else 0]))

    shared = {"background_k": layer.background_k, "filling": layer.filling, "redshift": layer.redshift}
    return tuple(
        Source(**{name: value(name, number) for name in _MOLECULE_FIELDS}, **shared) for number in range(count)
    )


def _saved_layer(sources: tuple[Source, ...], _: Any) -> LayerInput:
    first = sources[0]
    several = {name: (getattr(first, name),) for name in _MOLECULE_FIELDS}
    return LayerInput(**several, background_k=first.background_k, filling=first.filling, redshift=first.redshift)


@dataclass(frozen=True)
class WindowInput:
    """The observed range, or a receiver band."""

    range_mhz: tuple[float, float] | None = declared(
        None,
        Range("MHz"),
        "First and last frequency observed (MHz)",
        "conditions.range",
        common=True,
        example="86:116GHz",
    )
    band: tuple[float, float] | None = declared(
        None, Custom(band_mhz, metavar="NAME"), "Receiver band instead of a range: ALMA1 to ALMA10", "conditions.band", common=True,
        example="ALMA6",
    )  # fmt: skip


def _window(window: WindowInput, subject: Any) -> tuple[float, float]:
    band = window.range_mhz or window.band
    if band is None:
        raise ValueError("range_mhz: expected a range or a band, such as 86:116GHz or ALMA3")
    return band


def _brightness_error(answer: Any, reference: Any) -> float:
    return float(np.max(np.abs(answer.spectrum.brightness_k - reference.spectrum.brightness_k), initial=0.0))


DEPTH = Knob(
    lambda request: [request.least_depth * more for more in (1e5, 1e4, 1e3, 1e2, 1e1)], lambda request: 1e-2 * request.least_depth,
    (Measure("brightness", "K", _brightness_error),), "a least depth of {:g}", tried=DECADES, coarsest=(1.0, "loosest"),
    title="least optical depth of a line",
)  # fmt: skip


@dataclass(frozen=True)
class EmissionRequest:
    """The observed source; fields are checked when the request is made.

    molecules: tops with dipoles, or catalogue lines with Q(T). sources: column density, excitation temperature, velocity and width of each
    molecule; background, filling and redshift are common. range_mhz: as observed. least_depth: optical depth below which a line is left
    out. effects: the Hamiltonian of each molecule; by default the semi-rigid one, and empty for a catalogue.
    """

    molecules: tuple[Top | CatalogueLines, ...]
    sources: tuple[Source, ...] = part(LayerInput, _sources, _saved_layer, REQUIRED)
    range_mhz: tuple[float, float] = part(
        WindowInput, _window, lambda value, _: WindowInput(value), REQUIRED, single=True, why="give one of them"
    )
    least_depth: float = declared(
        LEAST_DEPTH, Quantity(above=0), "Least optical depth of a line", "observables.least_depth", knob=DEPTH
    )
    effects: tuple[tuple[QuantumEffect, ...], ...] = effects_of_each_field()

    def __post_init__(self) -> None:
        require_layer(self.sources, len(self.molecules))
        check_fields(self)
        if self.effects and len(self.effects) != len(self.molecules):
            raise ValueError(
                f"effects: {len(self.effects)} given for {len(self.molecules)} molecules; expected one Hamiltonian for each"
            )
        first, last = self.range_mhz
        if not 0 < first < last or math.isinf(last):
            raise ValueError(f"range_mhz: {first:g} to {last:g} MHz: expected a finite, rising range above 0")
        # eight channels a width over a range in ln ν
        count = math.log(last / first) * 8 * KM_PER_S / self.narrowest.fwhm_km_s
        if count > MOST_POINTS:
            raise ValueError(
                f"range_mhz: {first:g} to {last:g} MHz has {count:.3g} points, eight to a width of {self.narrowest.fwhm_km_s:g} km/s; at "
                f"most {MOST_POINTS} are computed: choose a narrower range or a larger fwhm_km_s"
            )

    @property
    def narrowest(self) -> Source:
        """The source with the narrowest lines."""
        return min(self.sources, key=lambda source: source.fwhm_km_s)

    @property
    def names(self) -> tuple[str, ...]:
        """Distinct names of the molecules."""
        names: list[str] = []
        for number, molecule in enumerate(self.molecules, start=1):
            name = molecule.name or f"molecule {number}"
            names.append(f"{name} ({number})" if name in names else name)
        return tuple(names)


@dataclass(frozen=True, eq=False, repr=False)
class EmissionLines(Table):
    """Lines of all molecules, (n,) each, in order of observed frequency; T_B and its integral are those of the line alone.

    names: of the molecules. molecule: index into names. row: index among the lines of its molecule. frequency_mhz: at rest.
    observed_mhz: as observed. energy_upper_k: E_u/k. optical_depth, brightness_k: at the centre. integrated_k_km_s: ∫T_B dv.
    """

    names: tuple[str, ...]
    molecule: Ints
    row: Ints
    frequency_mhz: Floats
    observed_mhz: Floats
    energy_upper_k: Floats
    g_upper: Ints
    einstein_a_per_s: Floats
    optical_depth: Floats
    brightness_k: Floats
    integrated_k_km_s: Floats
    upper: tuple[str, ...]
    lower: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.frequency_mhz)

    @property
    def columns(self) -> dict[str, Any]:
        """The table by column; molecule is a name, upper and lower are texts of quantum numbers."""
        numbers = ("frequency_mhz", "observed_mhz", "energy_upper_k", "g_upper", "einstein_a_per_s",
                   "optical_depth", "brightness_k", "integrated_k_km_s")  # fmt: skip
        names = np.array(self.names, dtype=np.str_)[self.molecule]
        return (
            {"molecule": names}
            | {name: getattr(self, name) for name in numbers}
            | {name: np.array(getattr(self, name), dtype=np.str_) for name in ("upper", "lower")}
        )


@dataclass(frozen=True)
class Peak:
    """The line at whose centre the layer differs most from the background: its row, and T_B and τ of all molecules there."""

    row: int
    observed_mhz: float
    brightness_k: float
    optical_depth: float


@dataclass(frozen=True, repr=False)
class EmissionAnswer(TextOf):
    """The spectrum of all molecules, that of each, and their lines.

    emitted: lines, Q and Hamiltonian of each molecule.
    """

    shown = "lines"

    request: EmissionRequest
    spectrum: Emission
    parts: tuple[Emission, ...]
    lines: EmissionLines
    emitted: tuple[EmittedLines, ...]

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes of all molecules, without repetition."""
        return tuple(dict.fromkeys(text for lines in self.emitted for text in lines.notes))

    @cached_property
    def peak(self) -> Peak | None:
        """The line with the largest |T_B| of all molecules together at its centre; None without lines."""
        if not len(self.lines):
            return None
        observed = self.lines.observed_mhz
        centres, position = np.unique(observed, return_inverse=True)
        at = emission(self.emitted, self.request.sources, centres)
        size = np.abs(at.brightness_k)[position]
        most = np.flatnonzero(size == size.max())  # lines that overlap at one frequency: the most opaque is named
        row = int(most[np.argmax(self.lines.optical_depth[most])])
        k = position[row]
        return Peak(row, float(observed[row]), float(at.brightness_k[k]), float(at.optical_depth[k]))

    @cached_property
    def errors(self) -> ErrorBudget:
        """Error budget of the brightness at the brightest line."""
        from rotor.spectra.emission.budget import brightness_budget

        return brightness_budget(self)

    def facts(self) -> dict[str, Any]:
        """All content except the tables, by the keys of docs/verbs."""
        request, layer, peak = self.request, self.request.sources[0], self.peak
        return {
            "molecules": [self._molecule_facts(number) for number in range(len(request.molecules))],
            "source": {name: getattr(layer, name) for name in ("background_k", "filling", "redshift")},
            "range_mhz": list(request.range_mhz),
            "line_count": len(self.lines),
            "peak_k": None if peak is None else peak.brightness_k,
            "peak_mhz": None if peak is None else peak.observed_mhz,
            "peak_molecule": None if peak is None else request.names[int(self.lines.molecule[peak.row])],
            "deepest": float(self.spectrum.optical_depth.max()),
            "notes": list(self.notes),
            "errors": self.errors.as_json(),
        }

    def _molecule_facts(self, number: int) -> dict[str, Any]:
        source, lines, molecule = self.request.sources[number], self.emitted[number], self.request.molecules[number]
        columns = ("column_per_cm2", "excitation_k", "velocity_km_s", "fwhm_km_s")
        return {
            "name": self.request.names[number],
            **{name: value for name, value in asdict(source).items() if name in columns},
            "q": lines.q,
            "q_source": lines.q_source,
            "quantum_numbers": list(lines.quanta),
            "hyperfine": lines.hyperfine,
            "constants_source": molecule.source,
        }


def answer_emission(request: EmissionRequest) -> EmissionAnswer:
    """The spectrum and the lines of a request.

    >>> from rotor.tops.top import Top
    >>> co = Top.from_constants("B=57635.968 D=0.1835 MHz", dipole_abc_debye=(0.11011, 0, 0), name="CO")
    >>> answer = answer_emission(EmissionRequest((co,), (Source(1e16, 20.0, 1.0),), (115e3, 116e3)))
    >>> len(answer.lines), round(float(answer.lines.energy_upper_k[0]), 3)
    (1, 5.532)
    """
    from rotor.spectra.emission.emitters import emitted_lines

    effects = request.effects or (SEMI_RIGID,) * len(request.molecules)
    emitted = tuple(
        emitted_lines(molecule, source, request.range_mhz, request.least_depth, hamiltonian)
        for molecule, source, hamiltonian in zip(request.molecules, request.sources, effects, strict=True)
    )
    grid = source_grid(*request.range_mhz, request.narrowest)
    parts = tuple(emission(lines, source, grid) for lines, source in zip(emitted, request.sources, strict=True))
    tables = [
        _line_table(request, number, lines, source)
        for number, (lines, source) in enumerate(zip(emitted, request.sources, strict=True))
    ]
    return EmissionAnswer(request, together(parts), parts, _joined(tables), emitted)


def _line_table(request: EmissionRequest, number: int, emitted: EmittedLines, source: Source) -> EmissionLines:
    """Table of the lines with their centre in the range; lines beyond its edges contribute only wings to the spectrum."""
    first, last = request.range_mhz
    centres = emitted.frequency_mhz * source.frequency_ratio
    rows = np.flatnonzero((centres >= first) & (centres <= last))
    lines, observed = emitted.where(rows), centres[rows]
    depth = peak_depth(lines, source)
    contrast = source.filling * contrast_k(observed, source)
    integral = np.array([_across(optical_depth) for optical_depth in depth]) * source.fwhm_km_s
    return EmissionLines(
        names=request.names,
        molecule=np.full(len(depth), number, dtype=np.int64),
        row=rows,
        frequency_mhz=lines.frequency_mhz,
        observed_mhz=observed,
        energy_upper_k=lines.energy_upper_k,
        g_upper=np.asarray(lines.g_upper).astype(np.int64),
        einstein_a_per_s=lines.einstein_a_per_s,
        optical_depth=depth,
        brightness_k=contrast * -np.expm1(-depth),
        integrated_k_km_s=contrast * integral,
        upper=lines.upper,
        lower=lines.lower,
    )


def _across(depth: float) -> float:
    """∫ (1 - e^-τ(v)) dv in full widths, for a Gaussian τ(v) with this depth at its centre (trapezoidal rule)."""
    absorbed = -np.expm1(-depth * np.exp(-4 * math.log(2) * _ACROSS**2))
    return float(absorbed.sum() * (_ACROSS[1] - _ACROSS[0]))


def _joined(tables: Sequence[EmissionLines]) -> EmissionLines:
    """All lines in one table, in order of observed frequency."""
    # stable: lines of one frequency keep the order of the molecules
    order = np.argsort(np.concatenate([table.observed_mhz for table in tables]), kind="stable")
    columns: dict[str, Any] = {"names": tables[0].names}
    for name in EmissionLines.__dataclass_fields__.keys() - columns:
        parts = [getattr(table, name) for table in tables]
        if name in ("upper", "lower"):
            texts = [text for part in parts for text in part]
            columns[name] = tuple(texts[i] for i in order.tolist())
        else:
            columns[name] = np.concatenate(parts)[order]
    return EmissionLines(**columns)
