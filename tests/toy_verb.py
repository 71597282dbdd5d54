"""A toy verb in one file: the moment of inertia of a ring, with a quantity of every kind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rotor.reports.screen import show_facts
from rotor.requests.field import check_fields, declared
from rotor.requests.readers import Grid, Quantity, Text, Whole
from rotor.table import Table
from rotor.verbs.subjects import OneMolecule
from rotor.verbs.verb import Output, Verb


@dataclass(frozen=True)
class RingRequest:
    """Energies of a particle on a ring about an axis of a top."""

    top: Any
    axis: str = declared("a", Text(("a", "b", "c"), "NAME"), "Principal axis of the ring", "observables.axis")
    radius_angstrom: float = declared(
        1.0, Quantity("Å", above=0), "Radius of the ring (Å)", "conditions.radius", common=True
    )
    mmax: int = declared(3, Whole(0, 50), "Highest |m|", "numerics.mmax")
    fields_kv_per_cm: tuple[float, ...] = declared(
        (0.0,), Grid("kV/cm", points=3), "Fields (kV/cm)", "conditions.field"
    )
    cut_mhz: float | None = declared(
        1e6, Quantity("MHz", above=0), "Leave out energies above; or 'none'", "observables.cut", none="none"
    )

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class RingTable(Table):
    """Energies by |m|."""

    m: np.ndarray
    energy_mhz: np.ndarray

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """|m| and energies."""
        return {"m": self.m, "energy_mhz": self.energy_mhz}


@dataclass(frozen=True)
class RingAnswer:
    """Energies of a request."""

    request: RingRequest
    table: RingTable

    def facts(self) -> dict[str, Any]:
        """Numbers of the report."""
        return {"levels": len(self.table), "radius_angstrom": self.request.radius_angstrom}


def answer_ring(request: RingRequest) -> RingAnswer:
    """E = B m² with B = ħ²/2μr² of one unit of mass: 505379 MHz/r² in Å."""
    m = np.arange(request.mmax + 1)
    energy = 505379.0 / request.radius_angstrom**2 * m**2
    seen = np.ones(len(m), bool) if request.cut_mhz is None else energy <= request.cut_mhz
    return RingAnswer(request, RingTable(m[seen], energy[seen]))


VERB = Verb(
    name="ring",
    about="A particle on a ring.",
    examples="\b\nExamples:\n  rotor ring water --radius 2",
    request=RingRequest,
    answer=lambda request, work: answer_ring(request),
    table=lambda answer: answer.table,
    rows="levels",
    show=lambda answer, report: show_facts([("levels", str(report.content["levels"]))]),
    outputs=(Output("csv", (".csv",), "Write the energies as CSV", example="ring.csv"),),
    subject=OneMolecule(),
    drawn=None,
    start={"molecule": "water", "conditions.radius": "2 Å"},
)
