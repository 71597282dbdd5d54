"""A request for levels in a static electric field, and what answers it."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rotor.checks import require_positive, require_whole
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.effects.stark import (
    DEFAULT_TOLERANCE_MHZ,
    Z,
    acting,
    checked_direction,
    checked_j,
    checked_m,
    doubled_m,
    stark_map,
)
from rotor.quantum.estimates.limits import limit_facts
from rotor.quantum.fields.field_map import FieldMap
from rotor.quantum.fields.map_request import MOST_AT_EDGE
from rotor.table import TextOf
from rotor.tops.facts import top_facts

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top


@dataclass(frozen=True)
class StarkRequest:
    """A map of levels in a field to compute; every field is checked when the request is made.

    top: with its dipole. fields_kv_per_cm: of any order. j_highest: free levels up to this J are followed. m_values: |M|; None: all.
    intensity_w_per_cm2: of a laser along Z. direction: of the field. jmax: of the basis; None: what tolerance_mhz needs.
    diabatic_gap_mhz: None: no diabatic labels. hyperfine: with the spins of the top's constants; m_values are |M_F| then.
    most_at_edge: population that a state may have in the two highest J of the basis; cosines are wrong by about as much.
    """

    top: Top
    fields_kv_per_cm: tuple[float, ...]
    j_highest: int = 2
    m_values: tuple[float, ...] | None = None
    intensity_w_per_cm2: float = 0.0
    direction: tuple[float, float, float] = Z
    jmax: int | None = None
    tolerance_mhz: float = DEFAULT_TOLERANCE_MHZ
    diabatic_gap_mhz: float | None = None
    hyperfine: bool = False
    most_at_edge: float = MOST_AT_EDGE

    def __post_init__(self) -> None:
        checked_j(self.j_highest)
        if self.hyperfine:
            doubled_m(self.top, self.effects, self.m_values, self.j_highest)
        else:
            checked_m(self.m_values, self.j_highest)
        require_whole("jmax", self.jmax, 2)
        require_positive("tolerance_mhz", self.tolerance_mhz)
        require_positive("most_at_edge", self.most_at_edge)
        if self.diabatic_gap_mhz is not None:
            require_positive("diabatic_gap_mhz", self.diabatic_gap_mhz)
        checked_direction(self.direction)
        if self.tilted and self.m_values is not None:
            raise ValueError("m_values: a field at an angle with the light mixes M; leave them out")
        acting(self.top, self.intensity_w_per_cm2)

    @property
    def effects(self) -> tuple[QuantumEffect, ...]:
        """The Hamiltonian with spins where they are asked for, else nothing beyond what is always there."""
        return effects_of(self.top, True) if self.hyperfine else ()

    @property
    def tilted(self) -> bool:
        """Whether the field is at an angle with Z."""
        return bool(self.direction[0] or self.direction[1])


@dataclass(frozen=True, repr=False)
class StarkAnswer(TextOf):
    """The map that a request asked for."""

    shown = "states"

    request: StarkRequest
    states: FieldMap

    def facts(self) -> Mapping[str, Any]:
        """Everything about the answer but its table of states, by the keys of docs/command_line.md."""
        fields, request = self.states.fields, self.request
        return {
            **top_facts(request.top),
            "field_kv_per_cm": [float(fields[0]), float(fields[-1]), len(fields)],
            "intensity_w_per_cm2": request.intensity_w_per_cm2,
            "field_direction": list(request.direction),
            "j_highest": request.j_highest,
            "hyperfine": request.hyperfine,
            "diabatic_gap_mhz": request.diabatic_gap_mhz,
            "tolerance_mhz": request.tolerance_mhz,
            **self.states.provenance,
            "curves": len(self.states.curves()),
            **limit_facts(request.top, max(request.j_highest, 1), effects_of(request.top, request.hyperfine)),
        }


def answer_stark(request: StarkRequest, executor: Executor | None = None) -> StarkAnswer:
    """The map of a request. executor: blocks of states are spread over it.

    >>> from rotor.tops.top import Top
    >>> rod = Top.from_constants("B=6000 MHz", dipole_abc_debye=(0.7, 0, 0))
    >>> answer_stark(StarkRequest(rod, (0.0, 1.0), j_highest=0)).states.energy_mhz.round(3).tolist()  # -μ²E²/6B
    [0.0, -3.449]
    """
    states = stark_map(
        request.top,
        request.fields_kv_per_cm,
        j_highest=request.j_highest,
        m_values=request.m_values,
        intensity_w_per_cm2=request.intensity_w_per_cm2,
        direction=request.direction,
        effects=request.effects,
        jmax=request.jmax,
        tolerance_mhz=request.tolerance_mhz,
        diabatic_gap_mhz=request.diabatic_gap_mhz,
        most_at_edge=request.most_at_edge,
        executor=executor,
    )
    return StarkAnswer(request, states)
