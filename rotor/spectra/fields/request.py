"""Request for lines, a spectrum, Stark coefficients and thermal means in a field, beside the map of the levels, and its answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.quantum.effects.stark import StarkRequest
from rotor.requests.field import CONDITIONS, OBSERVABLES, check_fields, declared
from rotor.requests.readers import Custom, Quantity, Range, Rule, Text
from rotor.spectra.fields.light import LightText, light_components
from rotor.table import Table
from rotor.thermodynamics.gas.field_mixture import POPULATIONS, field_mixture

if TYPE_CHECKING:
    from rotor.quantum.fields.field_map import FieldMap
    from rotor.spectra.fields.lines import FieldLines
    from rotor.spectra.spectrum import Spectrum

SPECTRUM_POINTS = 4001
MOST_POINTS = 2_000_000
FIELDS_OF_SPREAD = 41


def _read_light(light: Any) -> LightText:
    if light in ("parallel", "perpendicular", "isotropic") or not isinstance(light, str):
        return tuple(light) if isinstance(light, list) else light
    try:
        numbers = tuple(float(part) for part in light.removesuffix("deg").split(","))
    except ValueError:
        numbers = ()
    if len(numbers) not in (1, 3):
        raise ValueError(
            f"{light!r}: expected parallel, perpendicular, isotropic, an angle in degrees, or a direction such as 1,0,1"
        )
    return numbers if len(numbers) == 3 else numbers[0]


def _read_line(line: Any) -> tuple[str, str]:
    if not isinstance(line, str):
        upper, lower = line
        return str(upper), str(lower)
    parts = [" ".join(part.replace(",", " ").split()) for part in line.split(" - ")]
    if len(parts) != 2 or not all(parts):
        raise ValueError(f"{line!r}: expected quantum numbers of two levels, such as '1 - 0' or '2 1 2 - 1 1 1'")
    return parts[0], parts[1]


def _files(*names: str) -> Rule:
    """Rule of an input that these files alone use."""
    return Rule(tuple(f"outputs.{name}" for name in names), why="does not change the map itself")


@dataclass(frozen=True, kw_only=True)
class FieldSample:
    """The sample of lines, spectra and mixtures in fields; fields are checked when the request is made.

    light: "parallel", "perpendicular", "isotropic", an angle with the field in degrees, or a direction. temperature_k, populations: as in
    `field_lines`. line: labels of two free levels, to compute only lines between these; None: all lines. linewidth_mhz, range_mhz: of the
    spectrum at the highest field; a range None: from the first line to the last. spread: standard deviation of the field over the
    sample, as a fraction of the field; 0 for a homogeneous field.
    """

    light: LightText = declared(
        "parallel", Custom(_read_light, metavar="NAME"),
        "Polarization for --lines: parallel, perpendicular, isotropic, the angle with the field (degrees), or X,Y,Z", option="--light",
        panel=CONDITIONS, rule=_files("lines", "lobes", "spectrum"),
    )  # fmt: skip
    temperature_k: float = declared(
        300.0, Quantity("K", above=0, metavar="T"), "Temperature for --lines, --spectrum, --mixture (K)", option="--temperature",
        panel=CONDITIONS, common=True, rule=_files("lines", "lobes", "mixture", "spectrum"),
    )  # fmt: skip
    populations: str = declared(
        "equilibrium", Text(POPULATIONS, "NAME"), "Equilibrium in the field, or adiabatic: those of the free molecule, as in a beam",
        option="--populations", panel=CONDITIONS, rule=_files("lines", "lobes", "mixture", "spectrum"),
    )  # fmt: skip
    line: tuple[str, str] | None = declared(
        None,
        Custom(_read_line),
        "Only lines between these two free levels, such as '1 - 0'",
        option="--line",
        panel=OBSERVABLES,
        rule=_files("coefficients", "lines", "lobes"),
    )
    linewidth_mhz: float = declared(
        1.0, Quantity("MHz", above=0, metavar="W"), "Full width at half maximum of the lines of --spectrum (MHz)", option="--linewidth",
        panel=OBSERVABLES, rule=_files("spectrum"),
    )  # fmt: skip
    range_mhz: tuple[float, float] | None = declared(
        None,
        Range("MHz"),
        "Frequency range of --spectrum (MHz); by default that of the lines",
        option="--range",
        panel=OBSERVABLES,
        rule=_files("spectrum"),
    )
    spread: float = declared(
        0.0, Quantity(least=0, below=0.25), "Standard deviation of the field over the sample for --spectrum, as a fraction",
        option="--spread", panel=CONDITIONS, rule=_files("spectrum"),
    )  # fmt: skip

    def __post_init__(self) -> None:
        light_components(self.light)
        check_fields(self)
        if self.range_mhz is not None and not 0 <= self.range_mhz[0] < self.range_mhz[1]:
            raise ValueError(f"range_mhz: {self.range_mhz}: expected two rising frequencies")


@dataclass(frozen=True)
class FieldRequest(FieldSample):
    """Lines, spectra and mixtures of a sample in the fields of a `StarkRequest`."""

    stark: StarkRequest


def compute_lines(request: FieldRequest, states: FieldMap, executor: Executor | None = None) -> FieldLines:
    """The lines at each field of the map."""
    return _lines_at(request, states.fields, executor)


def _lines_at(request: FieldRequest, fields: Any, executor: Executor | None) -> FieldLines:
    from rotor.spectra.fields.lines import field_lines

    stark = request.stark
    lines = field_lines(
        stark.top,
        fields,
        j_highest=stark.j_highest,
        light=request.light,
        temperature_k=request.temperature_k,
        populations=request.populations,
        intensity_w_per_cm2=stark.intensity_w_per_cm2,
        direction=stark.direction,
        effects=stark.effects,
        jmax=stark.jmax,
        tolerance_mhz=stark.tolerance_mhz,
        executor=executor,
    )
    return lines if request.line is None else lines.lobes(*request.line)


def compute_spectrum(request: FieldRequest, states: FieldMap, executor: Executor | None = None) -> Spectrum:
    """The cross section at the highest field, with lines broadened by the spread of the field."""
    from rotor.spectra.fields.spectrum import FieldDistribution, field_spectrum

    mean = float(states.fields[np.argmax(np.abs(states.fields))])
    deviation = request.spread * abs(mean)
    # four standard deviations; a field without spread takes a small range for the slopes
    width = 4 * deviation or 1e-3 * abs(mean) or 1e-3
    lines = _lines_at(request, np.linspace(mean - width, mean + width, FIELDS_OF_SPREAD), executor)
    if not len(lines):
        raise ValueError(
            f"j_highest: no line joins two of the states up to J = {request.stark.j_highest}; take a higher J"
        )
    first, last = request.range_mhz or _around(lines, request.linewidth_mhz)
    points = max(SPECTRUM_POINTS, int(8 * (last - first) / request.linewidth_mhz) + 1)  # eight points a line width
    if points > MOST_POINTS:
        raise ValueError(
            f"range_mhz: {first:.6g} to {last:.6g} MHz with lines of {request.linewidth_mhz:g} MHz are {points} points; "
            f"more than {MOST_POINTS} are not made: give a narrower range or a larger width"
        )
    grid = np.linspace(first, last, points)
    distribution = FieldDistribution.gaussian(mean, deviation) if deviation else mean
    return field_spectrum(lines, grid, distribution, fwhm_mhz=request.linewidth_mhz)


def _around(lines: FieldLines, linewidth_mhz: float) -> tuple[float, float]:
    """Range in MHz around all lines that are not weak."""
    strong = lines.intensity_nm2_mhz > 1e-3 * lines.intensity_nm2_mhz.max(initial=0.0)
    frequency = np.abs(lines.frequency_mhz[strong])
    margin = 20 * linewidth_mhz
    return max(float(frequency.min()) - margin, 0.0), float(frequency.max()) + margin


def compute_coefficients(request: FieldRequest, states: FieldMap, executor: Executor | None = None) -> Table:
    """Stark coefficients of the states, or of the lines between the two levels of `line`."""
    from rotor.spectra.fields.stark_coefficients import level_coefficients, line_coefficients

    if request.line is None:
        return level_coefficients(states)
    return line_coefficients(compute_lines(request, states, executor))


def thermal_mixture(request: FieldRequest, states: FieldMap, executor: Executor | None = None) -> Table:
    """Means of the thermal mixture at each field."""
    stark = request.stark
    if stark.hyperfine:
        raise ValueError("mixtures of states with spins are not computed: leave out the hyperfine structure")
    return field_mixture(
        stark.top,
        states.fields,
        request.temperature_k,
        populations=request.populations,
        intensity_w_per_cm2=stark.intensity_w_per_cm2,
        direction=stark.direction,
        tolerance_mhz=max(stark.tolerance_mhz, 1e-3),
        executor=executor,
    )


def effective_dipoles(request: FieldRequest, states: FieldMap, executor: Executor | None = None) -> Table:
    """Effective dipoles, a column for each state."""
    from rotor.quantum.fields.deflection import deflection_table

    return deflection_table(states)


Maker = Callable[[FieldRequest, "FieldMap", "Executor | None"], Table]
MAKERS: Mapping[str, Maker] = {
    "lines": compute_lines,
    "spectrum": compute_spectrum,
    "coefficients": compute_coefficients,
    "mixture": thermal_mixture,
    "deflection": effective_dipoles,
}
