"""What a map of levels in a field is of: the matrices of a block, the fields, the states, checked."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.blocks import FieldBlock, FieldSpace
from rotor.quantum.fields.solver import Matrix, Terms

MOST_AT_EDGE = 1e-6  # of the population of a state, in the highest J of the basis: cosines are wrong by about as much


class BlockProblem(NamedTuple):
    """Matrices over a block, all (n, n), of H(x) = fixed + x slope + x² curvature; curvature None where nothing is quadratic.

    fixed: MHz. slope: MHz per unit of field. observables: by name, made when called.
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
        """The coefficients of H(x) over some of the states, which rise."""
        return tuple(over(coefficient, states) for coefficient in self.coefficients)

    def over(self, states: Ints) -> BlockProblem:
        """The problem over some of the states, which rise; without observables."""
        curvature = None if self.curvature is None else over(self.curvature, states)
        return BlockProblem(over(self.fixed, states), over(self.slope, states), {}, curvature)


def over(matrix: Matrix, states: Ints) -> Matrix:
    """A matrix over some of the states, which rise; the matrix itself where these are all of them."""
    return matrix if len(states) == len(matrix) else np.asarray(matrix[np.ix_(states, states)])


@dataclass(frozen=True)
class MapRequest:
    """What a map is of.

    space: makes the states up to a J max. problem: the matrices of a block. fields: rising. j_highest: free levels up to this J are
    followed. m_values: |M|, with signs in a magnetic field. tolerance_mhz: of energies. diabatic_gap_mhz: None for no diabatic labels.
    most_at_edge: the population that a state may have in the two highest J. reach: the largest change of J that a field makes.
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
        """How many J beyond the basis the matrices need for a bound of what the basis leaves out."""
        return 2 * self.reach


class KnownSpaces:
    """Makes the space of a J max; the last two stay known, since a map is solved at the J max that was tried last but one."""

    def __init__(self, make: Callable[[int], FieldSpace]) -> None:
        self._make = make
        self._known: dict[int, FieldSpace] = {}

    def __call__(self, jmax: int) -> FieldSpace:
        if jmax not in self._known:
            self._known = {**dict(list(self._known.items())[-1:]), jmax: self._make(jmax)}
        return self._known[jmax]

    def __reduce__(self) -> tuple[type[KnownSpaces], tuple[Callable[[int], FieldSpace]]]:
        return KnownSpaces, (self._make,)


FIELDS = {"kV/cm": "fields_kv_per_cm", "T": "fields_tesla"}  # of requests, by their unit


def checked_fields(fields: Any, unit: str, highest: float) -> Floats:
    """Fields (n,) that rise, finite and within ±`highest`; ValueError where they are not."""
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
    """A tolerance of energies above zero, or ValueError."""
    if not (math.isfinite(tolerance_mhz) and tolerance_mhz > 0):
        raise ValueError(f"tolerance {tolerance_mhz} MHz: a finite number above 0 is expected")
    return float(tolerance_mhz)
