"""Request for rotational Raman lines, and its answer."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.arrays import Ints
from rotor.checks import require_top
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.estimates.budgets import (
    known_covariance,
    level_spread,
    line_errors,
    parameter_names,
    source_of_errors,
)
from rotor.quantum.estimates.limits import all_limits, limit_facts
from rotor.quantum.hamiltonian_input import effects_field
from rotor.quantum.hyperfine_method import hyperfine_facts
from rotor.requests.budget import ErrorBudget
from rotor.requests.field import check_fields, declared
from rotor.requests.knob import Measure
from rotor.requests.readers import Quantity, Whole
from rotor.spectra.budgets import frequencies_budget
from rotor.spectra.intensity import largest
from rotor.spectra.intensity_accuracy import cut_knob
from rotor.spectra.raman.raman import (
    DEFAULT_LASER_NM,
    DEFAULT_MIN_RELATIVE,
    LEAST_LASER_NM,
    RamanLines,
    anisotropy_angstrom3,
    band_cross_section,
    raman_lines,
)
from rotor.table import TextOf
from rotor.thermodynamics.sums.classical_limit import typical_j
from rotor.thermodynamics.sums.partition_table import partition_facts
from rotor.thermodynamics.vibration import VibrationalStates, missing_fundamentals
from rotor.thermodynamics.vibration_input import vibrations_field
from rotor.tops.facts import top_facts

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.tops.top import Top


def section_left_out(answer: Any, reference: Any) -> float:
    """Percentage of the total cross section that a list lacks compared with a reference."""
    part, whole = (float(raman.lines.cross_section_cm2_per_sr.sum()) for raman in (answer, reference))
    return 100.0 * max(1.0 - part / whole, 0.0) if whole else 0.0  # round-off may leave a part above the whole


SECTION = Measure("total cross section", "%", section_left_out)
RELATIVE_CUT = cut_knob(
    "min_relative",
    lambda request: [cut for cut in (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8) if request.min_relative is None or cut > request.min_relative],
    lambda request: None if request.min_relative is None else 1e-2 * request.min_relative,
    SECTION, lambda cut, decades: cut * 10.0**-decades, "weakest line in the list, relative to the strongest",
)  # fmt: skip


@dataclass(frozen=True)
class RamanRequest:
    """Rotational Raman lines to compute; fields are checked when the request is made.

    top: with its polarizability; a spherical top needs none. temperature_k: of the gas. laser_nm: wavelength in vacuum.
    jmax: highest J; None: as the cut requires. min_relative: cross section, relative to the strongest line, below which lines
    are left out; None: all lines. q, vibrations: as in a `SpectrumRequest`. effects: the Hamiltonian.
    """

    top: Top
    temperature_k: float = declared(
        300.0, Quantity("K", above=0, metavar="T"), "Temperature (K)", "conditions.temperature", common=True
    )
    laser_nm: float = declared(
        DEFAULT_LASER_NM,
        Quantity("nm", above=LEAST_LASER_NM, metavar="W"),
        "Wavelength of the laser in vacuum (nm)",
        "conditions.laser",
        common=True,
    )
    jmax: int | None = declared(
        None, Whole(0), "Highest J; by default as the cut requires", "numerics.jmax", common=True, example=40
    )
    min_relative: float | None = declared(
        DEFAULT_MIN_RELATIVE, Quantity(above=0, below=1), "Weakest line, relative to the strongest; or 'none'",
        "observables.min_relative", none="none", knob=RELATIVE_CUT,
    )  # fmt: skip
    q: float | None = declared(
        None,
        Quantity(above=0, metavar="Q"),
        "Partition function to use instead of the summed one",
        "observables.q",
        example=100.0,
    )
    vibrations: VibrationalStates | None = vibrations_field()
    effects: tuple[QuantumEffect, ...] = effects_field()

    def __post_init__(self) -> None:
        require_top(self.top)
        check_fields(self)
        missing_fundamentals(self.top, self.vibrations)  # refuses too many
        if self.top.polarizability_abc_angstrom3 is None and self.top.kind != "spherical":
            raise ValueError(
                f"the polarizability of {self.top.name or 'this top'} is not known; give one, in principal axes"
            )


@dataclass(frozen=True, repr=False)
class RamanAnswer(TextOf):
    """The Raman lines of a request."""

    shown = "lines"

    request: RamanRequest
    lines: RamanLines

    def strongest(self, count: int) -> Ints:
        """Rows of the `count` lines with the largest cross sections, in order of shift."""
        return np.sort(largest(self.lines.cross_section_cm2_per_sr, count))

    @property
    def notes(self) -> tuple[str, ...]:
        """Limits of the lines, and vibrations left out of Q."""
        return (*self.lines.warnings, *missing_fundamentals(self.request.top, self.request.vibrations))

    @property
    def typical_j(self) -> int:
        """The J at which effects are compared."""
        lines, rotational = self.lines, self.lines.levels.rotational
        return typical_j(
            lines.top, lines.temperature_k, np.maximum(rotational[lines.initial], rotational[lines.final]), lines.jmax
        )

    @property
    def jmax_source(self) -> str:
        """Reason for the highest J."""
        if self.request.jmax is not None:
            return "given"
        return f"beyond it no line reaches {self.request.min_relative or DEFAULT_MIN_RELATIVE:g} of the strongest"

    @property
    def why_no_lines(self) -> str:
        """Reason for an empty list; empty text otherwise."""
        if len(self.lines):
            return ""
        if self.lines.top.kind == "spherical":
            return "the polarizability of a rigid spherical top is isotropic"
        if self.lines.jmax < 2:
            return "there are none up to this J max"
        return "the polarizability is isotropic, or the levels that it connects do not exist"

    @cached_property
    def errors(self) -> ErrorBudget:
        """Error budget of the shifts."""
        lines = self.lines
        top, effects = lines.top, lines.levels.effects
        parameters = parameter_names(top, lines.levels)
        covariance = known_covariance(top, parameters)
        errors = None
        if covariance is not None:
            errors = line_errors(level_spread(top, lines.levels, covariance), lines.initial, lines.final)
        limits = all_limits(top, self.typical_j, effects)
        source = source_of_errors(top, parameters, None)
        return frequencies_budget(lines.levels, limits, lines.cross_section_cm2_per_sr, errors, source, "shifts")

    def facts(self) -> dict[str, Any]:
        """All content except the table of lines, by the keys of docs/verbs."""
        lines = self.lines
        return {
            **top_facts(lines.top),
            "temperature_k": lines.temperature_k,
            "laser_nm": lines.laser_nm,
            "anisotropy_angstrom3": anisotropy_angstrom3(lines.top),
            "band_cross_section_cm2_per_sr": band_cross_section(lines),
            "q": partition_facts(lines.top, lines.partition, lines.levels.effects),
            "jmax": lines.jmax,
            "jmax_source": self.jmax_source,
            "min_relative": self.request.min_relative,
            "line_count": len(lines),
            "hyperfine": hyperfine_facts(lines.top, lines.levels),
            **limit_facts(lines.top, self.typical_j, lines.levels.effects),
            "errors": self.errors.as_json(),
        }


def answer_raman(request: RamanRequest, executor: Executor | None = None) -> RamanAnswer:
    """The Raman lines of a request. executor: shares the work over J.

    >>> from rotor.tops.top import Top
    >>> rod = Top.from_constants("B=2 cm-1", polarizability_abc_angstrom3=((2.2, 0, 0), (0, 1.5, 0), (0, 0, 1.5)))
    >>> answer_raman(RamanRequest(rod, jmax=2)).lines.shift_cm.round(6).tolist()  # 6B
    [-12.0, 12.0]
    """
    lines = raman_lines(
        request.top,
        temperature_k=request.temperature_k,
        laser_nm=request.laser_nm,
        jmax=request.jmax,
        min_relative=request.min_relative,
        q=request.q,
        vibrations=request.vibrations,
        effects=request.effects,
        executor=executor,
    )
    return RamanAnswer(request, lines)
