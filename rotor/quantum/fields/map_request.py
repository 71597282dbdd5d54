"""Request of a map of levels in a field: matrices of a block, fields and states."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.blocks import FieldBlock, FieldSpace
from rotor.quantum.fields.solver import Matrix, Terms

MOST_AT_EDGE = (
    1e-6  # largest population of a state in the two highest J of the basis; the error of cosines is about as large
)


class BlockProblem(NamedTuple):
    """Matrices (n, n) over a block of H(x) = fixed + x slope + x² curvature.

    fixed: MHz. slope: MHz per unit of field. observables: functions that compute matrices, by name. curvature: None without a
    quadratic term.
    """

    fixed: Matrix
    slope: Matrix
    observables: Mapping[str, Callable[[], Matrix]]
    curvature: Matrix | None = None

    @property
    def coefficients(self) -> Terms:
        """The coefficients of H(x) as a polynomial in x, (n, n) each."""
        return (self.fixed, self.slope) if self.curvature is None else (self.fixed, self.slope, self.curvature)

    def terms(self, states: Ints) -> Terms:
        """The coefficients of H(x) over a rising selection of states."""
        return tuple(over(coefficient, states) for coefficient in self.coefficients)

    def over(self, states: Ints) -> BlockProblem:
        """The problem over a rising selection of states, without observables."""
        curvature = None if self.curvature is None else over(self.curvature, states)
        return BlockProblem(over(self.fixed, states), over(self.slope, states), {}, curvature)


def over(matrix: Matrix, states: Ints) -> Matrix:
    """A matrix over a rising selection of states; not copied if the selection is complete."""
    return matrix if len(states) == len(matrix) else np.asarray(matrix[np.ix_(states, states)])


@dataclass(frozen=True)
class MapRequest:
    """Hamiltonian, fields, states and accuracy of a map.

    space: makes the states up to a J max. problem: makes the matrices of a block. fields: rising. j_highest: highest J of the free levels
    in the map. m_values: |M|, with signs in a magnetic field. tolerance_mhz: of energies. diabatic_gap_mhz: None for no diabatic labels.
    most_at_edge: largest population of a state in the two highest J. reach: the largest change of J by the field.
    """

    space: Callable[[int], FieldSpace]
    problem: Callable[[FieldBlock], BlockProblem]
    fields: Floats
    j_highest: int
    m_values: tuple[float, ...]
    tolerance_mhz: float
    field_name: str
    slope_name: str
    slope_unit_mhz: float
    diabatic_gap_mhz: float | None = None
    most_at_edge: float = MOST_AT_EDGE
    reach: int = 2

    @property
    def margin(self) -> int:
        """Number of J beyond the basis that a bound of the truncation error needs."""
        return 2 * self.reach


class KnownSpaces:
    """Makes the space of a J max and caches the last two: the search ends one J max beyond the one that is used."""

    def __init__(self, make: Callable[[int], FieldSpace]) -> None:
        self._make = make
        self._cache: dict[int, FieldSpace] = {}

    def __call__(self, jmax: int) -> FieldSpace:
        if jmax not in self._cache:
            self._cache = {**dict(list(self._cache.items())[-1:]), jmax: self._make(jmax)}
        return self._cache[jmax]

    def __reduce__(self) -> tuple[type[KnownSpaces], tuple[Callable[[int], FieldSpace]]]:
        return KnownSpaces, (self._make,)


FIELDS = {"kV/cm": "fields_kv_per_cm", "T": "fields_tesla"}  # name of the field in requests, by unit


def checked_fields(fields: Any, unit: str, highest: float) -> Floats:
    """Fields (n,) in rising order; ValueError unless they are finite and within ±`highest`."""
    values = np.unique(np.atleast_1d(np.asarray(fields, dtype=np.float64)))
    if not len(values) or not np.isfinite(values).all():
        raise ValueError(f"fields must be finite numbers of {unit}; got {np.asarray(fields).tolist()!r}")
    if np.abs(values).max() > highest:
        raise ValueError(
            f"{FIELDS[unit]}: a field of {values[np.argmax(np.abs(values))]:g} {unit} is beyond {highest:g} {unit}, where no molecule "
            "holds together; check the unit"
        )
    return values


def checked_tolerance_mhz(tolerance_mhz: float) -> float:
    """The tolerance of energies; ValueError unless it is finite and above zero."""
    if not (math.isfinite(tolerance_mhz) and tolerance_mhz > 0):
        raise ValueError(f"tolerance {tolerance_mhz} MHz: a finite number above 0 is expected")
    return float(tolerance_mhz)
