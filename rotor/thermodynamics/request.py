"""Request and answer for thermodynamic functions of rotation."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.checks import require_top
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.limits import all_limits, limit_facts
from rotor.quantum.hamiltonian_input import effects_field
from rotor.requests.budget import ErrorBudget
from rotor.requests.field import check_fields, declared
from rotor.requests.knob import Knob, Measure
from rotor.requests.readers import Custom, Grid, Quantity, Text
from rotor.table import Table, TextOf, counted
from rotor.thermodynamics.electronic import ElectronicStates
from rotor.thermodynamics.functions import (
    ThermoFunctions,
    refuse_electrons_twice,
    refuse_species_with_totals,
    species_names,
    thermodynamic_functions,
)
from rotor.thermodynamics.sums.classical_limit import classical_limit, populated_j, rotational_temperatures_k
from rotor.thermodynamics.sums.classical_onset import classical_above_if_known
from rotor.thermodynamics.sums.level_sums import AT_WORST, OutOfReachError, Progress, refusal
from rotor.thermodynamics.vibration import VibrationalStates, missing_fundamentals
from rotor.thermodynamics.vibration_input import vibrations_field
from rotor.tops.facts import top_facts

if TYPE_CHECKING:
    from rotor.tops.top import Top

TEMPERATURES_K = (
    5.0, 10.0, 20.0, 50.0, 100.0, 150.0, 200.0, 298.15, 300.0, 400.0, 500.0, 600.0, 700.0, 800.0, 900.0, 1000.0,
)  # fmt: skip
MOST_TEMPERATURES = 100_000
CLASSICAL_TOLERANCE = 0.01  # relative difference of the quantum heat capacity that marks the classical limit


def _electronic(states: ElectronicStates | str) -> ElectronicStates:
    return ElectronicStates.parse(states) if isinstance(states, str) else states


def _relative(name: str) -> Callable[[Any, Any], float]:
    """The largest relative error of a column in percent, at the temperatures that have a sum."""

    def error(answer: Any, reference: Any) -> float:
        values, true = (each.table.columns[name] for each in (answer, reference))
        return 100.0 * float(np.nanmax(np.abs(values - true) / np.maximum(np.abs(true), 1e-12)))

    return error


LEFT_OUT = Knob(
    (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10), 1e-13,
    tuple(Measure(quantity, "%", _relative(name)) for quantity, name in (("Q", "q_rot"), ("U", "energy_j_per_mol"), ("C_v", "cv_over_r"))),
    "sums to {:g}", least=1e-13, bounds=("",), title="relative error of the sums",
)  # fmt: skip


@dataclass(frozen=True)
class ThermoRequest:
    """Thermodynamic functions to compute; all fields are checked when the request is made.

    temperatures_k: above 0 K, in any order. species: see `species_names`. vibrations: vibrational states; None: no vibration.
    pressure_bar: pressure of the ideal gas, whose functions are then computed too; the top must have a mass. electronic: degeneracies
    of electronic states of the ideal gas; None: those of the molecule. relative_error: largest error of Q, U and C_v. effects: effects
    in the Hamiltonian, with spins if Q is to count them.
    """

    top: Top
    temperatures_k: Sequence[float] = declared(
        TEMPERATURES_K, Grid("K", each=Quantity("K", above=0), most_points=MOST_TEMPERATURES), "Temperatures: 10:1000K:100 or 10,20,50 K",
        "conditions.temperature", common=True, example="10:1000K:100",
    )  # fmt: skip
    species: str = declared(
        "equilibrium", Text(metavar="NAME"), "equilibrium, normal (frozen), para, ortho, or a class of the spin weights",
        "observables.species", common=True,
    )  # fmt: skip
    vibrations: VibrationalStates | None = vibrations_field()
    pressure_bar: float | None = declared(
        None, Quantity("bar", above=0, metavar="P"), "Pressure of the ideal gas, whose functions are then given too (bar)",
        "conditions.pressure", common=True, example="1 bar",
    )  # fmt: skip
    electronic: ElectronicStates | None = declared(
        None, Custom(_electronic, lambda states: states.listed, "LIST", str),
        "Degeneracies of electronic states of the ideal gas, with energies (cm⁻¹); by default those of the molecule",
        "observables.electronic", example="2,2@121.1",
    )  # fmt: skip
    relative_error: float = declared(
        1e-6,
        Quantity(above=0),
        "Relative error of Q, U and C_v from the levels left out of the sums",
        "numerics.relative_error",
        knob=LEFT_OUT,
    )
    effects: tuple[QuantumEffect, ...] = effects_field()

    def __post_init__(self) -> None:
        require_top(self.top)
        check_fields(self)
        missing_fundamentals(self.top, self.vibrations)  # refuses too many
        names = species_names(self.top)
        if self.species not in names:
            only = "; its levels are all of one nuclear-spin species" if len(names) == 1 else ""
            raise ValueError(f"species: {self.species!r}: {self.top.name or 'this top'} has {', '.join(names)}{only}")
        refuse_species_with_totals(self.top, self.species, self.effects)
        if self.electronic is not None and self.pressure_bar is None:
            raise ValueError("electronic: counts in the ideal gas; give --gas, or its pressure")
        if self.pressure_bar is not None:
            refuse_electrons_twice(self.top, self.effects, self.electronic)
            if self.top.mass_u is None:
                raise ValueError("the ideal gas needs the mass, which bare constants do not have; give a molecule")


@dataclass(frozen=True, eq=False, repr=False)
class AllTemperatures(Table):
    """The functions at the temperatures of a request, in its order; NaN where the sum was refused."""

    functions: ThermoFunctions
    temperatures_k: Sequence[float]

    @cached_property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The columns of the functions."""
        temperatures = np.array(self.temperatures_k, dtype=np.float64)
        summed = np.isin(temperatures, self.functions.temperature_k)
        out = {name: np.full(len(temperatures), math.nan) for name in self.functions.columns}
        for name, column in self.functions.columns.items():
            out[name][summed] = column
        return out | {"temperature_k": temperatures}

    @property
    def provenance(self) -> dict[str, Any]:
        """Inputs of the functions."""
        return self.functions.provenance | {"rows": len(self)}


@dataclass(frozen=True, repr=False)
class ThermoAnswer(TextOf):
    """The functions of a request, with notes and errors.

    functions: at the temperatures at which the sum can be computed. refused: why it cannot, by the other temperatures (K).
    """

    shown = "table"

    request: ThermoRequest
    functions: ThermoFunctions
    refused: Mapping[float, str] = field(default_factory=dict)

    @property
    def table(self) -> Table:
        """The functions at all temperatures; NaN at refused ones."""
        return AllTemperatures(self.functions, self.request.temperatures_k) if self.refused else self.functions

    @property
    def effects(self) -> tuple[QuantumEffect, ...]:
        """The effects in the Hamiltonian, including further states of the top."""
        effects = self.request.effects
        return effects_of(self.request.top, hyperfine=False) if effects == SEMI_RIGID else effects

    @cached_property
    def classical_above_k(self) -> float | None:
        """The temperature above which the heat capacity is classical within 1 %; None if no sum over levels reaches it."""
        return classical_above_if_known(self.request.top, CLASSICAL_TOLERANCE)

    @cached_property
    def errors(self) -> ErrorBudget:
        """Error budget of Q."""
        from rotor.thermodynamics.budgets import q_budget

        top, effects = self.functions.top, self.effects
        j = populated_j(top, float(self.functions.temperature_k.max()))
        parameters = dict.fromkeys(name for effect in effects for name in effect.parameters(top))
        return q_budget(self.functions, j, all_limits(top, j, effects), tuple(parameters))

    @property
    def notes(self) -> tuple[str, ...]:
        """Temperatures without a sum, vibrations left out, and a linear radical whose spin degeneracy is not all of it."""
        missing = missing_fundamentals(self.request.top, self.request.vibrations)
        return (*self._refusal_notes, *missing, *self._electronic_notes)

    @property
    def _refusal_notes(self) -> tuple[str, ...]:
        """The reason at the first temperature without a sum, and which others have none."""
        if not self.refused:
            return ()
        first, *others = sorted(self.refused)
        also = (
            f"; nor is there a sum at {counted(len(others), 'other temperature')} up to {others[-1]:g} K"
            if others
            else ""
        )
        return (self.refused[first] + also,)

    @property
    def _electronic_notes(self) -> tuple[str, ...]:
        gas, top = self.functions.gas, self.functions.top
        doublet = gas is not None and self.request.electronic is None and gas.electronic.degeneracies == (2,)
        if not doublet or top.kind != "linear":
            return ()
        return (
            "the doublet of a linear radical is counted by its spin alone: with orbital angular momentum (a Π or Δ state) its functions "
            "are twice as many, split by spin-orbit coupling; give them, as those of NO: electronic 2,2@121.1",
        )

    def facts(self) -> dict[str, Any]:
        """Facts of the answer except its table, by the keys of docs/verbs."""
        functions = self.functions
        top, limit = functions.top, classical_limit(functions.top)
        gas, vibrations = functions.gas, functions.vibrations
        return {
            **top_facts(top),
            "rotational_temperatures_k": rotational_temperatures_k(top),
            "classical_above_k": self.classical_above_k,
            "classical_tolerance": CLASSICAL_TOLERANCE,
            "classical_corrections": {"a_k": limit.a, "b_k2": limit.b, "d_per_k": limit.d, "e_per_k2": limit.e},
            "species": functions.species,
            "species_known": species_names(top),
            "fractions": dict(functions.fractions),
            "symmetry_number_counted": functions.symmetry_number,
            "spin_factor": functions.spin_factor,
            "jmax": int(functions.jmax.max()),
            "relative_error": float(functions.relative_error.max()),
            "vibrations": vibrations.text if vibrations is not None else None,
            "pressure_bar": gas.pressure_bar if gas is not None else None,
            "electronic": gas.electronic.text if gas is not None else None,
            "hyperfine": functions.hyperfine,
            "refused": [{"temperature_k": t, "reason": reason} for t, reason in self.refused.items()],
            **limit_facts(top, populated_j(top, float(functions.temperature_k.max())), self.effects),
            "errors": self.errors.as_json(),
        }


def answer_thermo(request: ThermoRequest, progress: Progress | None = None) -> ThermoAnswer:
    """Compute the functions of a request; ValueError if the sum is refused at all temperatures. progress: see `level_sums`.

    >>> from rotor.tops.top import Top
    >>> answer = answer_thermo(ThermoRequest(Top.from_constants("B=10 cm-1"), (300.0,)))
    >>> round(float(answer.functions.cv_over_r[0]), 4)  # 1 + (Θ/T)²/45
    1.0001
    """
    functions = thermodynamic_functions(
        request.top,
        request.temperatures_k,
        species=request.species,
        vibrations=request.vibrations,
        pressure_bar=request.pressure_bar,
        electronic=request.electronic,
        relative_error=request.relative_error,
        progress=progress,
        effects=request.effects,
        refuse=False,
    )
    inexact = functions.relative_error > AT_WORST
    if not inexact.any():
        return ThermoAnswer(request, functions)
    errors = zip(functions.temperature_k[inexact].tolist(), functions.relative_error[inexact].tolist(), strict=True)
    refused = {temperature: refusal(temperature, error) for temperature, error in errors}
    if inexact.all():
        raise OutOfReachError(refused)
    return ThermoAnswer(request, functions.where(~inexact), refused)
