"""Request of a map of levels in a field: H(x) = H_0 + Σ c_i x^n_i O_i, whose field x is a parameter like any other."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.blocks import Contraction, FieldBlock, FieldOperator, FieldSpace
from rotor.quantum.fields.solved_space import field_space
from rotor.quantum.fields.solver import Matrix, Terms

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top

# largest population of a state in the two highest J of the basis; the error of cosines is about as large
MOST_AT_EDGE = 1e-6
MOST_ENERGIES = 1_500_000  # rows of a map, of about 0.6 kB
# Σ n³ over the blocks of n functions, times the number of fields; 3 to 4·10⁻¹⁰ s of a processor each
MOST_WORK = 1e12
SECONDS = 4e-10
FEWER = "follow states of lower J or of fewer M, or ask for fewer fields"
MOST_BLOCKS = 8  # of one M, of an asymmetric top


class FieldKind(NamedTuple):
    """A kind of field: unit, name in requests, names of the columns of the field and of -dE/dfield, and highest strength.

    slope_mhz: the unit of -dE/dfield in MHz per unit of field.
    """

    unit: str
    name: str
    column: str
    slope: str
    slope_mhz: float
    highest: float

    def checked(self, fields: ArrayLike) -> Floats:
        """Fields (n,) in rising order; ValueError unless they are finite and not too strong."""
        values = np.unique(np.atleast_1d(np.asarray(fields, dtype=np.float64)))
        if not len(values) or not np.isfinite(values).all():
            raise ValueError(f"fields must be finite numbers of {self.unit}; got {np.asarray(fields).tolist()!r}")
        if np.abs(values).max() > self.highest:
            raise ValueError(
                f"{self.name}: a field of {values[np.argmax(np.abs(values))]:g} {self.unit} is beyond {self.highest:g} {self.unit}, "
                "where no molecule holds together; check the unit"
            )
        return values


class FieldTerm(NamedTuple):
    """An operator times a power of the field, with its coefficient in MHz per power of the unit of the field."""

    power: int
    mhz: float
    operator: FieldOperator


@dataclass(frozen=True)
class MapRequest:
    """Hamiltonian, fields, states and accuracy of a map.

    top, effects: the free molecule. terms: what acts beside it. observables: operators by the names of their columns. fields: rising.
    j_highest: highest J of the free levels in the map. m_values: |M|, with signs in a magnetic field. tolerance_mhz: of energies.
    diabatic_gap_mhz: None for no diabatic labels. most_at_edge: largest population of a state in the two highest J.
    """

    top: Top
    effects: tuple[QuantumEffect, ...]
    terms: tuple[FieldTerm, ...]
    observables: Mapping[str, Contraction]
    kind: FieldKind
    fields: Floats
    j_highest: int
    m_values: tuple[float, ...]
    tolerance_mhz: float
    diabatic_gap_mhz: float | None = None
    most_at_edge: float = MOST_AT_EDGE
    _spaces: dict[int, FieldSpace] = field(default_factory=dict, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not (math.isfinite(self.tolerance_mhz) and self.tolerance_mhz > 0):
            raise ValueError(f"tolerance {self.tolerance_mhz} MHz: a finite number above 0 is expected")
        if (energies := self.states * len(self.fields)) > MOST_ENERGIES:
            raise ValueError(
                f"{self.states:,} states of J up to {self.j_highest} at {len(self.fields)} fields are {energies:,} energies, more than "
                f"{MOST_ENERGIES:,}: {FEWER}"
            )
        if self.top.kind == "asymmetric":
            self.require_work(
                [math.ceil(count / MOST_BLOCKS) for count in self.states_by_m for _ in range(MOST_BLOCKS)]
            )

    def require_work(self, sizes: Sequence[int]) -> None:
        """Raise ValueError if diagonalizing blocks of so many functions at all fields takes too long."""
        if (work := len(self.fields) * sum(float(size) ** 3 for size in sizes)) > MOST_WORK:
            raise ValueError(
                f"states of J up to {self.j_highest} lie in blocks of up to {max(sizes):,} functions, which at {len(self.fields)} "
                f"fields take some {math.ceil(work * SECONDS / 60)} minutes (a map takes at most {MOST_WORK * SECONDS / 60:.0f}): {FEWER}"
            )

    @property
    def states(self) -> int:
        """Number of states to follow; with spins about so many."""
        return sum(self.states_by_m)

    @property
    def states_by_m(self) -> list[int]:
        """Number of states to follow of each |M|."""
        spins = self.top.spin_constants if any(effect.spins(self.top) for effect in self.effects) else None
        of_spins = math.prod(twice + 1 for twice in spins.twice.values()) if spins else 1
        levels = [1 if self.top.kind == "linear" else 2 * j + 1 for j in range(self.j_highest + 1)]
        return [of_spins * sum(levels[max(math.ceil(abs(m)), 0) :]) for m in self.m_values]

    def __getstate__(self) -> dict[str, Any]:
        """Without the spaces, which another process makes anew."""
        return {**self.__dict__, "_spaces": {}}

    @property
    def margin(self) -> int:
        """Number of J beyond the basis that a bound of the truncation error needs: twice the largest change of J by the field."""
        return 2 * max(term.operator.rank for term in self.terms)

    def space(self, jmax: int) -> FieldSpace:
        """The states up to a J max. The last two spaces stay in memory, since the search ends one J max beyond the result."""
        if jmax not in self._spaces:
            for older in list(self._spaces)[:-1]:
                del self._spaces[older]
            self._spaces[jmax] = field_space(self.top, jmax, [term.operator for term in self.terms], self.effects)
        return self._spaces[jmax]

    def matrices(self, block: FieldBlock) -> Terms:
        """H_0, H_1, ... of H(x) = Σ x^n H_n over a block (n, n), MHz per power of the unit of the field."""
        out: dict[int, Matrix] = {0: np.diag(block.energies_mhz)}
        for power, mhz, operator in self.terms:
            matrix = mhz * block.dense(operator)
            out[power] = out[power] + matrix if power in out else matrix
        return tuple(out[power] for power in range(len(out)))


def over(matrix: Matrix, states: Ints) -> Matrix:
    """A matrix over a rising selection of states; not copied if the selection is complete."""
    return matrix if len(states) == len(matrix) else np.asarray(matrix[np.ix_(states, states)])


def terms_over(terms: Terms, states: Ints) -> Terms:
    """All matrices over a rising selection of states."""
    return tuple(over(term, states) for term in terms)
