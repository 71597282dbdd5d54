"""Answers of maps of levels in a field, and their error budgets (`rotor.requests.budget`)."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.estimates.budgets import (
    NO_SAMPLES,
    NO_UNCERTAINTIES,
    data_term,
    known_covariance,
    level_errors,
    model_term,
    parameter_names,
    source_of_errors,
)
from rotor.quantum.estimates.limits import Limit, all_limits, limit_facts
from rotor.quantum.fields.field_map import FieldMap
from rotor.quantum.solve import solve_levels
from rotor.requests.budget import ErrorBudget, ErrorTerm, size_text
from rotor.table import TextOf
from rotor.tops.facts import top_facts

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top


@dataclass(frozen=True, repr=False)
class MapAnswer(TextOf):
    """The map of a request, the errors of its energies, and the effects that it neglects."""

    shown = "states"

    request: Any
    states: FieldMap

    @abstractmethod
    def conditions(self) -> dict[str, Any]:
        """What acts, beside the fields themselves, by the keys of docs/verbs."""

    @abstractmethod
    def field_limits(self) -> list[Limit]:
        """Neglected effects of the field."""

    @abstractmethod
    def moment_terms(self) -> list[ErrorTerm]:
        """Errors of the energies from those of the moments on which the field acts."""

    @property
    def _hamiltonian(self) -> tuple[Top, int, tuple[QuantumEffect, ...]]:
        """The top, the highest J of the map, at least 1, and the effects: what estimates of neglected effects start from."""
        request = self.request
        return request.top, max(request.j_highest, 1), effects_of(request.top, request.hyperfine)

    @cached_property
    def errors(self) -> ErrorBudget:
        """Error budget of the energies in MHz, the largest over all states and fields."""
        top, j, effects = self._hamiltonian
        states = self.states
        return ErrorBudget(
            of="energies",
            unit="MHz",
            rounding=ErrorTerm(
                float(np.nanmax(states.round_off_mhz, initial=0.0)),
                "eigenvalues of the largest block in double precision",
            ),
            truncation=ErrorTerm(
                float(np.nanmax(states.truncation_mhz, initial=0.0)),
                f"functions left out of the basis, J max {states.jmax}",
                "a smaller tolerance",
            ),
            model=model_term([*all_limits(top, j, effects), *self.field_limits()]),
            data=joined_data(*self.moment_terms(), constants_term(top, effects, j)),
            statistics=NO_SAMPLES,
        )

    def facts(self) -> Mapping[str, Any]:
        """Everything about the answer but its table of states, by the keys of docs/verbs."""
        fields, request = self.states.fields, self.request
        top, j, effects = self._hamiltonian
        return {
            **top_facts(top),
            self.states.field_name: [float(fields[0]), float(fields[-1]), len(fields)],
            **self.conditions(),
            "j_highest": request.j_highest,
            "hyperfine": request.hyperfine,
            "tolerance_mhz": request.tolerance_mhz,
            **self.states.provenance,
            "curves": len(self.states.curves()),
            **limit_facts(top, j, effects, self.field_limits()),
            "errors": self.errors.as_json(),
        }


def constants_term(top: Top, effects: Sequence[QuantumEffect], j: int) -> ErrorTerm:
    """One standard deviation of the free levels up to J = `j` from the uncertainties of the constants."""
    levels = solve_levels(top, j, effects=effects)
    parameters = parameter_names(top, levels)
    covariance = known_covariance(top, parameters)
    source = source_of_errors(top, parameters, None)
    if covariance is None:
        return data_term(None, source)
    return data_term(level_errors(top, levels, covariance), f"{source}; levels without the field")


def joined_data(*terms: ErrorTerm) -> ErrorTerm:
    """Quadratic sum of independent standard deviations; not estimated if one of them is not.

    >>> joined_data(ErrorTerm(3.0, "dipole"), ErrorTerm(4.0, "constants")).text("MHz")
    '5 MHz (constants; dipole)'
    >>> joined_data(ErrorTerm(None, "the dipole has no stated uncertainty"), ErrorTerm(4.0, "constants")).source
    'the dipole has no stated uncertainty; constants 4 MHz'
    """
    estimated = sorted((term for term in terms if term.value), key=lambda term: -(term.value or 0.0))
    if not_estimated := [term.source for term in terms if term.value is None]:
        sizes = [f"{term.source} {size_text(term.value or 0.0, 'MHz')}" for term in estimated]
        return ErrorTerm(None, "; ".join([*not_estimated, *sizes]))
    if not estimated:
        return ErrorTerm(0.0, "; ".join(term.source for term in terms) or NO_UNCERTAINTIES)
    value = math.hypot(*(term.value or 0.0 for term in estimated))
    return ErrorTerm(value, "; ".join(term.source for term in estimated), estimated[0].remedy)
