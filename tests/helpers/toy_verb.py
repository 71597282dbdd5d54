"""A toy verb in one file: the moment of inertia of a ring, with a quantity of every kind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rotor.requests.budget import ErrorBudget, ErrorTerm
from rotor.requests.field import check_fields, declared
from rotor.requests.knob import Knob, Measure
from rotor.requests.readers import Grid, Quantity, Text, Whole
from rotor.table import Table
from rotor.verbs.common.outputs import Output
from rotor.verbs.common.subjects import OneMolecule
from rotor.verbs.common.verb import Verb


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

    tolerance_mhz: float = declared(
        1e-6, Quantity("MHz", above=0), "Energies are rounded to this (MHz)", "numerics.tolerance", typed="1e-6 MHz",
        knob=Knob(
            (1e5, 1e4, 1e3),
            1.0,
            (Measure("energy", "MHz", lambda answer, true: np.abs(answer.table.energy_mhz - true.table.energy_mhz).max()),),
            "multiples of {:g} MHz",
            least=1e-6,
        ),
    )  # fmt: skip

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

    @property
    def errors(self) -> ErrorBudget:
        """That of the rounding alone."""
        exact = ErrorTerm(0.0, "exact")
        return ErrorBudget(
            "energies", "MHz", exact, ErrorTerm(self.request.tolerance_mhz / 2, "multiples"), exact, exact, exact
        )

    def facts(self) -> dict[str, Any]:
        """Numbers of the report."""
        return {"levels": len(self.table), "radius_angstrom": self.request.radius_angstrom}


def answer_ring(request: RingRequest) -> RingAnswer:
    """E = B m² with B = ħ²/2μr² of one unit of mass: 505379 MHz/r² in Å."""
    m = np.arange(request.mmax + 1)
    exact = 505379.0 / request.radius_angstrom**2 * m**2
    energy = np.round(exact / request.tolerance_mhz) * request.tolerance_mhz
    seen = np.ones(len(m), bool) if request.cut_mhz is None else energy <= request.cut_mhz
    return RingAnswer(request, RingTable(m[seen], energy[seen]))


VERB = Verb(
    name="ring",
    about="A particle on a ring.",
    examples="  rotor ring water --radius 2",
    request=RingRequest,
    answer=lambda request, work: answer_ring(request),
    table=lambda answer: answer.table,
    rows="levels",
    results=lambda answer: {"highest_mhz": answer.table.energy_mhz.max()},
    show=lambda answer, report: [[("levels", str(report.content["levels"]))]],
    outputs=(Output("csv", (".csv",), "Write the energies as CSV", example="ring.csv"),),
    subject=OneMolecule(),
    drawn=None,
    accuracy="of the energies",
    start={"molecule": "water", "conditions.radius": "2 Å"},
)
