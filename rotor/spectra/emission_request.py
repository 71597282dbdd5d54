"""A request for what a telescope sees of a source with one or several molecules, and what answers it.

Optical depths add: τ = Σ_m N_m Σ_i I_i φ_i; T_B follows from the sum (`rotor.spectra.emission`). Of each line by itself the answer has
E_u/k, the optical depth at its centre, T_B there, and the integral ∫T_B dv over its Gaussian, as if no other line were near.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor import units
from rotor.arrays import Floats, Ints
from rotor.checks import require_positive
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.spins.method import hyperfine_facts
from rotor.spectra.emission import Emission, Source, emission, planck_k, source_grid
from rotor.spectra.lines import Lines, line_list
from rotor.spectra.opacity import NM2_IN_CM2
from rotor.spectra.profiles import gaussian
from rotor.table import Table, TextOf

if TYPE_CHECKING:
    from rotor.tops.top import Top

LEAST_DEPTH = 1e-6  # lines of less are left out
MOST_POINTS = 5_000_000
_KM_PER_S = units.SPEED_OF_LIGHT_M_PER_S / 1e3
_ACROSS = np.linspace(-3.0, 3.0, 241)  # widths at half maximum: a Gaussian has fallen to 1e-11


@dataclass(frozen=True)
class EmissionRequest:
    """What is looked at; every field is checked when the request is made.

    tops: of the molecules, each with its dipole. columns_per_cm2: of each, all levels and spin species together. source: excitation,
    background, filling, velocity and width; its own column is not used. range_mhz: as observed. least_depth: optical depth at
    the centre of a line below which it is left out. effects: what the Hamiltonian of each molecule consists of; none: the
    semi-rigid one of each.
    """

    tops: tuple[Top, ...]
    columns_per_cm2: tuple[float, ...]
    source: Source
    range_mhz: tuple[float, float]
    least_depth: float = LEAST_DEPTH
    effects: tuple[tuple[QuantumEffect, ...], ...] = ()

    def __post_init__(self) -> None:
        if not self.tops or len(self.tops) != len(self.columns_per_cm2):
            raise ValueError(
                f"columns_per_cm2: {len(self.columns_per_cm2)} given for {len(self.tops)} molecules; expected one for each"
            )
        for column in self.columns_per_cm2:
            require_positive("columns_per_cm2", column, "1/cm²")
        require_positive("least_depth", self.least_depth)
        if self.effects and len(self.effects) != len(self.tops):
            raise ValueError(
                f"effects: {len(self.effects)} given for {len(self.tops)} molecules; expected those of each"
            )
        first, last = self.range_mhz
        if not 0 < first < last or math.isinf(last):
            raise ValueError(f"range_mhz: {first:g} to {last:g} MHz: expected a finite range above 0 that rises")
        count = math.log(last / first) * 8 * _KM_PER_S / self.source.fwhm_km_s
        if count > MOST_POINTS:
            raise ValueError(
                f"range_mhz: {first:g} to {last:g} MHz has {count:.3g} points, eight to a width of {self.source.fwhm_km_s:g} km/s; at "
                f"most {MOST_POINTS} are computed: choose a narrower range or a larger fwhm_km_s"
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Of the molecules, each different."""
        found: list[str] = []
        for number, top in enumerate(self.tops, start=1):
            name = top.name or f"molecule {number}"
            found.append(f"{name} ({number})" if name in found else name)
        return tuple(found)


@dataclass(frozen=True, eq=False, repr=False)
class EmissionLines(Table):
    """Lines of all molecules, (n,) each, rising in frequency; T_B and its integral of each line by itself.

    molecule: number of the top. row: of the molecule's own lines. frequency_mhz: at rest. observed_mhz. energy_upper_k: E_u/k.
    g_upper, einstein_a_per_s. optical_depth: at the centre. brightness_k: there. integrated_k_km_s: ∫T_B dv.
    """

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
        """The table by column; upper and lower are the quantum numbers."""
        numbers = ("molecule", "frequency_mhz", "observed_mhz", "energy_upper_k", "g_upper", "einstein_a_per_s",
                   "optical_depth", "brightness_k", "integrated_k_km_s")  # fmt: skip
        return {name: getattr(self, name) for name in numbers} | {
            name: np.array(getattr(self, name), dtype=np.str_) for name in ("upper", "lower")
        }


@dataclass(frozen=True, repr=False)
class EmissionAnswer(TextOf):
    """The spectrum of all molecules together, of each, and their lines.

    effects: what the Hamiltonian of each consists of. hyperfine: how its spins were treated, by the keys of docs/command_line.md;
    None of a molecule without. quanta: the names of its quantum numbers, in the order of the labels of lines.
    """

    shown = "lines"

    request: EmissionRequest
    spectrum: Emission
    parts: tuple[Emission, ...]
    lines: EmissionLines
    partition_functions: tuple[float, ...]
    effects: tuple[tuple[QuantumEffect, ...], ...]
    notes: tuple[str, ...]
    hyperfine: tuple[dict[str, Any] | None, ...]
    quanta: tuple[tuple[str, ...], ...]

    def facts(self) -> dict[str, Any]:
        """Everything but the tables, by the keys of docs/command_line.md."""
        request, source = self.request, asdict(self.request.source)
        del source["column_per_cm2"]
        return {
            "molecules": [
                {
                    "name": name,
                    "column_per_cm2": column,
                    "q": q,
                    "quantum_numbers": list(quanta),
                    "hyperfine": used,
                    "constants_source": top.source,
                }
                for name, column, q, quanta, used, top in zip(
                    request.names,
                    request.columns_per_cm2,
                    self.partition_functions,
                    self.quanta,
                    self.hyperfine,
                    request.tops,
                    strict=True,
                )
            ],
            "source": source,
            "range_mhz": list(request.range_mhz),
            "line_count": len(self.lines),
            "peak_k": float(self.spectrum.brightness_k.max()),
            "peak_mhz": float(self.spectrum.frequency_mhz[self.spectrum.brightness_k.argmax()]),
            "deepest": float(self.spectrum.optical_depth.max()),
            "notes": list(self.notes),
        }


def answer_emission(request: EmissionRequest) -> EmissionAnswer:
    """The spectrum and the lines that a request asks for.

    >>> from rotor.tops.top import Top
    >>> co = Top.from_constants("B=57635.968 D=0.1835 MHz", dipole_abc_debye=(0.11011, 0, 0), name="CO")
    >>> answer = answer_emission(EmissionRequest((co,), (1e16,), Source(1e16, 20.0, 1.0), (115e3, 116e3)))
    >>> len(answer.lines), round(float(answer.lines.energy_upper_k[0]), 3)
    (1, 5.532)
    """
    grid = source_grid(*request.range_mhz, request.source)
    parts, tables, sums, effects, hyperfine, quanta = [], [], [], [], [], []
    notes: list[str] = []
    for number, (top, column) in enumerate(zip(request.tops, request.columns_per_cm2, strict=True)):
        source = replace(request.source, column_per_cm2=column)
        lines = _lines_of(top, source, request, request.effects[number] if request.effects else SEMI_RIGID)
        notes += lines.warnings
        parts.append(emission(lines, source, grid))
        tables.append(_line_table(number, lines, source))
        sums.append(float(lines.q))
        effects.append(tuple(lines.levels.effects))
        hyperfine.append(hyperfine_facts(top, lines.levels))
        quanta.append(tuple(lines.quanta_names))
    depth = np.sum([part.optical_depth for part in parts], axis=0)
    source = replace(request.source, column_per_cm2=sum(request.columns_per_cm2))
    contrast = source.filling * (planck_k(grid, source.excitation_k) - planck_k(grid, source.background_k))
    total = Emission(grid, depth, contrast * -np.expm1(-depth), source)
    return EmissionAnswer(
        request, total, tuple(parts), _joined(tables), tuple(sums), tuple(effects), tuple(dict.fromkeys(notes)),
        tuple(hyperfine), tuple(quanta),
    )  # fmt: skip


def _lines_of(top: Top, source: Source, request: EmissionRequest, effects: tuple[QuantumEffect, ...]) -> Lines:
    """Lines whose centre is observed in the range, deep enough to count.

    The optical depth of a Gaussian at its centre is N I 2 √(ln 2/π)/Δν; the narrowest Δν, at the first frequency, gives the cut.
    """
    shift = 1 - source.velocity_km_s / _KM_PER_S
    first, last = (ν / shift for ν in request.range_mhz)
    width = request.range_mhz[0] * source.fwhm_km_s / _KM_PER_S
    depth_per_area = float(gaussian(np.zeros(1), width)[0]) * source.column_per_cm2 * NM2_IN_CM2
    least = math.log10(request.least_depth / depth_per_area)
    return line_list(top, temperature_k=source.excitation_k, min_lgint=least, range_mhz=(first, last), effects=effects)


def _line_table(number: int, lines: Lines, source: Source) -> EmissionLines:
    observed = lines.frequency_mhz * (1 - source.velocity_km_s / _KM_PER_S)
    width = observed * source.fwhm_km_s / _KM_PER_S
    area = source.column_per_cm2 * NM2_IN_CM2 * lines.intensity_nm2_mhz
    depth = area * gaussian(np.zeros_like(width), width)
    contrast = planck_k(observed, source.excitation_k) - planck_k(observed, source.background_k)
    integral = np.array([_across(one) for one in depth]) * source.fwhm_km_s
    upper_cm = lines.energy_lower_cm + lines.frequency_mhz / units.MHZ_PER_CM
    labels = [
        tuple(" ".join(text.split()) for text in lines.levels.labels(states)) for states in (lines.upper, lines.lower)
    ]
    return EmissionLines(
        molecule=np.full(len(lines), number, dtype=np.int64),
        row=np.arange(len(lines)),
        frequency_mhz=lines.frequency_mhz,
        observed_mhz=observed,
        energy_upper_k=upper_cm * units.MHZ_PER_CM / units.MHZ_PER_K,
        g_upper=lines.g_upper,
        einstein_a_per_s=lines.einstein_a_per_s,
        optical_depth=depth,
        brightness_k=source.filling * contrast * -np.expm1(-depth),
        integrated_k_km_s=source.filling * contrast * integral,
        upper=labels[0],
        lower=labels[1],
    )


def _across(depth: float) -> float:
    """∫ (1 - e^-τ(v)) dv in widths at half maximum of a Gaussian τ(v) with the depth at its centre, by the trapezoidal rule."""
    absorbed = -np.expm1(-depth * np.exp(-4 * math.log(2) * _ACROSS**2))
    return float(absorbed.sum() * (_ACROSS[1] - _ACROSS[0]))


def _joined(tables: Sequence[EmissionLines]) -> EmissionLines:
    """All lines in one table, rising in the frequency that is observed."""
    order = np.argsort(np.concatenate([table.observed_mhz for table in tables]), kind="stable")
    columns: dict[str, Any] = {}
    for name in EmissionLines.__dataclass_fields__:
        parts = [getattr(table, name) for table in tables]
        if name in ("upper", "lower"):
            texts = [text for part in parts for text in part]
            columns[name] = tuple(texts[i] for i in order.tolist())
        else:
            columns[name] = np.concatenate(parts)[order]
    return EmissionLines(**columns)
