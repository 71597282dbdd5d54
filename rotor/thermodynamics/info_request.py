"""Request and answer for the facts of a molecule as a top: sizes of effects, Q(T), conformers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.frozen import dataclass
from rotor.molecules.readers.sdf_entries import BUILT
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.estimates.limits import limit_facts
from rotor.requests.budget import ErrorBudget
from rotor.requests.field import OBSERVABLES, check_fields, declared
from rotor.requests.readers import Grid, Quantity, Whole
from rotor.table import Table
from rotor.thermodynamics.sums.classical_limit import populated_j
from rotor.thermodynamics.sums.partition_table import partition_table
from rotor.tops.constants.budget import constants_budget
from rotor.tops.facts import top_facts
from rotor.tops.top import Top

TEMPERATURES_K = (
    9.375,
    18.75,
    37.5,
    75.0,
    150.0,
    225.0,
    300.0,
    500.0,
    1000.0,
)  # temperatures of the catalogues, and two more
MOST_CONFORMERS, MOST_TEMPERATURES = 1000, 100_000
ROOM_TEMPERATURE_K = 300.0  # effects are compared at the most populated J of this temperature


@dataclass(frozen=True)
class InfoRequest:
    """Optional computations for a top.

    top: the molecule. temperatures_k: temperatures of Q. conformers: number of trial geometries of `smiles`; None: no search.
    """

    top: Top
    temperatures_k: tuple[float, ...] = declared(
        TEMPERATURES_K, Grid("K", most_points=MOST_TEMPERATURES, each=Quantity("K", above=0)), "Temperatures: 10:300K:30 or 10,20,50 K",
        "conditions.temperature", common=True, example="10:300K:30",
    )  # fmt: skip
    conformers: int | None = declared(
        None, Whole(1, MOST_CONFORMERS), "For a SMILES: try N conformers, and list the different ones with their energies",
        "observables.conformers", panel=OBSERVABLES, common=True, example=20,
    )  # fmt: skip
    smiles: str = ""

    def __post_init__(self) -> None:
        check_fields(self)
        if self.conformers is not None and not self.smiles.startswith(BUILT):
            raise ValueError(
                f"conformers: {self.smiles or 'constants'!r} is a single geometry; conformers need a SMILES or InChI"
            )


@dataclass(frozen=True, eq=False, repr=False)
class PartitionRows(Table):
    """Rows of Q(T): temperature, sum, classical limit, highest J of the sum, error; in each row also A, B, C and their errors.

    So a table of many molecules has the constants of each. top: whose constants they are.
    """

    records: tuple[Mapping[str, Any], ...]
    top: Top

    @cached_property
    def columns(self) -> dict[str, NDArray[Any]]:
        """temperature_k, q, classical, relative_error, jmax, a_mhz, ..., c_error_mhz; NaN or -1 for a missing value."""
        names = ("temperature_k", "q", "classical", "relative_error")
        numbers = {name: np.array([record[name] for record in self.records], dtype=np.float64) for name in names}
        return {
            **numbers,
            "jmax": np.array([-1 if record["jmax"] is None else record["jmax"] for record in self.records]),
            **{name: np.full(len(self.records), value) for name, value in abc_columns(self.top).items()},
        }


def abc_columns(top: Top) -> dict[str, float]:
    """A, B, C and their errors, measured or estimated; rounded to the digits of an estimated error; NaN for what is not known.

    >>> columns = abc_columns(Top.from_constants("A=9000.0(3) B=6000.0 C=4000.0 MHz"))
    >>> columns["a_mhz"], columns["a_error_mhz"], columns["b_error_mhz"]
    (9000.0, 0.3, nan)
    """
    estimated = top.estimated_errors_mhz
    errors = {**estimated, **top.constants.uncertainties}
    columns = {}
    for name, value in zip("ABC", top.rotational_constants_mhz, strict=True):
        unknown = not math.isfinite(value)
        same = (
            "B" if name not in errors and name not in top.constants.values else name
        )  # of symmetric and spherical tops
        error = math.nan if unknown else errors.get(same, math.nan)
        digits = 1 - math.floor(math.log10(estimated[same])) if same in estimated and not unknown else 15
        columns[f"{name.lower()}_mhz"] = math.nan if unknown else round(value, digits)
        columns[f"{name.lower()}_error_mhz"] = error
    return {name: columns[name] for name in sorted(columns, key=lambda name: ("error" in name, name))}


@dataclass(frozen=True, eq=False)
class InfoAnswer:
    """Facts of a top: records of Q(T) and of conformers, and sizes of effects."""

    request: InfoRequest
    partition: tuple[Mapping[str, Any], ...]
    conformers: tuple[Mapping[str, Any], ...]
    sizes: Mapping[str, Any]

    @property
    def table(self) -> PartitionRows:
        """Q(T)."""
        return PartitionRows(self.partition, self.request.top)

    @property
    def errors(self) -> ErrorBudget:
        """Error budget of A, B and C; the error of Q is in its table."""
        return constants_budget([self.request.top])

    def facts(self) -> dict[str, Any]:
        """Facts of the top, by the keys of docs/verbs."""
        facts = {
            **top_facts(self.request.top),
            **self.sizes,
            "partition_function": list(self.partition),
            "errors": self.errors.as_json(),
        }
        return facts | ({} if self.request.conformers is None else {"conformers": list(self.conformers)})


def answer_info(request: InfoRequest, progress: Callable[..., Any] | None = None) -> InfoAnswer:
    """Compute the sizes of effects at the most populated J at 300 K, Q(T), and optionally conformers."""
    top = request.top
    sizes = limit_facts(top, populated_j(top, ROOM_TEMPERATURE_K), effects_of(top, hyperfine=False))
    rows = partition_table(top, request.temperatures_k, progress, quick=request.temperatures_k == TEMPERATURES_K)
    return InfoAnswer(request, tuple(rows), tuple(_conformers(request)), sizes)


def _conformers(request: InfoRequest) -> Sequence[dict[str, Any]]:
    """Energy and constants of the distinct conformers, lowest first."""
    if request.conformers is None:
        return ()
    from rotor.molecules.readers.smiles import conformers

    records = []
    for conformer in conformers(request.smiles.removeprefix("SMILES:").strip(), request.conformers):
        top = Top.from_molecule(conformer.molecule)
        records.append(
            {
                "energy_kj_per_mol": conformer.energy_kj_per_mol,
                "rotational_constants_mhz": top.rotational_constants_mhz,
                "dipole_abc_debye": top.dipole_abc_debye,
                "uncertainty": conformer.molecule.uncertainty,
            }
        )
    return records
