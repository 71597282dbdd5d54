"""Request of levels in a static electric field, and its answer."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.checks import require_positive
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.effects.stark import Z, acting, checked_direction, checked_j, map_request, projections
from rotor.quantum.fields.answer import MapAnswer, dipole_term, static_polarization
from rotor.quantum.fields.field_map import field_map
from rotor.quantum.fields.inputs import basis_field, read_direction, read_m, states_field, tolerance_field
from rotor.quantum.fields.map_request import MOST_AT_EDGE, MapRequest
from rotor.quantum.hamiltonian_input import spins_field
from rotor.requests.budget import ErrorTerm
from rotor.requests.field import check_fields, declared
from rotor.requests.readers import Custom, Grid, Quantity

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.quantum.estimates.beyond import Limit
    from rotor.tops.top import Top

POINTS = 201  # number of fields of a range without a count


@dataclass(frozen=True)
class StarkRequest:
    """A map of levels in an electric field; all values are checked when the request is made.

    top: with its dipole. fields_kv_per_cm: in any order. j_highest: highest J of the free levels in the map. m_values: |M|; None for all.
    intensity_w_per_cm2: of a laser along Z. direction: of the field. jmax: highest J of the basis; None for what tolerance_mhz needs.
    diabatic_gap_mhz: None for no diabatic labels. hyperfine: include the spins of the top's constants; m_values are then |M_F|.
    most_at_edge: largest population of a state in the two highest J of the basis; the error of cosines is about as large.
    """

    top: Top
    fields_kv_per_cm: tuple[float, ...] = declared(
        tuple(np.linspace(0.0, 100.0, POINTS).tolist()), Grid("kV/cm", points=POINTS),
        "Fields: start:stop[:count], of 201 by default, or a comma list (kV/cm)", "conditions.field", common=True,
        typed="0:100kV/cm:201",
    )  # fmt: skip
    j_highest: int = states_field()
    m_values: tuple[float, ...] | None = declared(
        None, Custom(read_m, list, "LIST", list[float]), "|M| of the states: 0,1; by default all. With spins |M_F|: 0.5,1.5",
        "observables.m", common=True, example=[0, 1],
    )  # fmt: skip
    intensity_w_per_cm2: float = declared(
        0.0, Quantity("W/cm2", metavar="I"), "Of a laser along Z, far from resonance (W/cm2)", "conditions.intensity"
    )
    direction: tuple[float, float, float] = declared(
        Z, Custom(read_direction, list, "ANGLE", list[float]), "Angle of the field with the light of the laser (degrees); M is mixed then",
        "conditions.direction", option="--tilt", example=[0.0, 0.0, 1.0],
    )  # fmt: skip
    jmax: int | None = basis_field(30)
    tolerance_mhz: float = tolerance_field(1e-4, "1e-4 MHz")
    diabatic_gap_mhz: float | None = declared(
        None, Quantity("MHz", above=0, metavar="GAP"),
        "Follow states diabatically through avoided crossings narrower than this (MHz)", "observables.diabatic_gap", example="10 MHz",
    )  # fmt: skip
    hyperfine: bool = spins_field()
    most_at_edge: float = MOST_AT_EDGE

    def __post_init__(self) -> None:
        check_fields(self)
        checked_j(self.j_highest)
        projections(self.top, self.effects, self.m_values, self.j_highest)
        require_positive("most_at_edge", self.most_at_edge)
        checked_direction(self.direction)
        if self.tilted and self.m_values is not None:
            raise ValueError("m_values: a field at an angle with the light mixes M; leave them out")
        acting(self.top, self.intensity_w_per_cm2)

    @property
    def effects(self) -> tuple[QuantumEffect, ...]:
        """Effects with spins if these are requested; empty for the default Hamiltonian."""
        return effects_of(self.top, True) if self.hyperfine else ()

    @property
    def tilted(self) -> bool:
        """Whether the field is at an angle with Z."""
        return bool(self.direction[0] or self.direction[1])

    @property
    def map(self) -> MapRequest:
        """Hamiltonian, fields and states of the map."""
        return map_request(
            self.top,
            self.fields_kv_per_cm,
            j_highest=self.j_highest,
            m_values=self.m_values,
            intensity_w_per_cm2=self.intensity_w_per_cm2,
            direction=self.direction,
            effects=self.effects,
            tolerance_mhz=self.tolerance_mhz,
            diabatic_gap_mhz=self.diabatic_gap_mhz,
            most_at_edge=self.most_at_edge,
        )


@dataclass(frozen=True, repr=False)
class StarkAnswer(MapAnswer):
    """The map of a request."""

    request: StarkRequest

    def conditions(self) -> dict[str, Any]:
        """The laser, the direction of the field, and the gap of diabatic labels."""
        return {
            "intensity_w_per_cm2": self.request.intensity_w_per_cm2,
            "field_direction": list(self.request.direction),
            "diabatic_gap_mhz": self.request.diabatic_gap_mhz,
        }

    def field_limits(self) -> list[Limit]:
        """The polarization by the static field."""
        return static_polarization(self.request.top, float(np.abs(self.states.fields).max()))

    def moment_terms(self) -> list[ErrorTerm]:
        """Errors of the dipole, and of the polarizability in light."""
        terms = [dipole_term(self.request.top, self.states)]
        if self.request.intensity_w_per_cm2:
            terms.append(ErrorTerm(None, "the polarizability has no stated uncertainty"))
        return terms


def answer_stark(request: StarkRequest, executor: Executor | None = None) -> StarkAnswer:
    """The map of a request. executor: solves blocks of states in parallel.

    >>> from rotor.tops.top import Top
    >>> rod = Top.from_constants("B=6000 MHz", dipole_abc_debye=(0.7, 0, 0))
    >>> answer_stark(StarkRequest(rod, (0.0, 1.0), j_highest=0)).states.energy_mhz.round(3).tolist()  # -μ²E²/6B
    [0.0, -3.449]
    """
    return StarkAnswer(request, field_map(request.map, request.jmax, executor))
