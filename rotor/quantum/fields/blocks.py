"""States of a top with M, in the blocks that fields connect, and the matrices of operators over them.

Blocks follow from the elements of the operators. For a molecule with one axis they are (M, k), with even and odd J separate where nothing
connects them (M = 0 or k = 0, no dipole). For all others they are sets of solved blocks, divided at M = 0 by the reflection. In fields
along Z, M is a good quantum number; other directions mix it (`rotor.quantum.fields.solved_space`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.operators import FieldOperator
from rotor.quantum.levels import Levels
from rotor.quantum.quanta import value_text

BEFORE_J = ("species", "vt", "v")  # quantum numbers at the head of a label


@dataclass(frozen=True)
class FreeLevels:
    """Levels of the free top, each with 2J+1 values of M; K and -K of a symmetric top are separate levels.

    j (N with spins), energy_mhz: (n,). quanta: further quantum numbers by name (n,), those in `halves` doubled. weight: spin weight of one
    state (n,). family: levels of different families are never connected.
    """

    j: Ints
    energy_mhz: Floats
    quanta: dict[str, NDArray[Any]]
    weight: Floats
    halves: frozenset[str] = frozenset()
    family: Ints | None = field(default=None, repr=False)

    @classmethod
    def from_levels(cls, levels: Levels) -> FreeLevels:
        """The free levels of a table of solved levels."""
        rotation = "n" if "n" in levels.quanta else "j"
        quanta = {name: column for name, column in levels.quanta.items() if name != rotation}
        return cls(levels.rotational, levels.energy_mhz, quanta, levels.weight_per_component, levels.halves)

    def __len__(self) -> int:
        return len(self.j)

    def label(self, row: int) -> str:
        """Quantum numbers of a row as text, species and state first, then J or N: `1 0 1`, `E 0 1 0 1`, `1 0 1 3/2`."""
        texts = {name: value_text(values[row], name in self.halves) for name, values in self.quanta.items()}
        first = [texts.pop(name) for name in BEFORE_J if name in texts]
        return " ".join([*first, str(int(self.j[row])), *texts.values()])


@dataclass(frozen=True, eq=False)
class FieldBlock:
    """States |level, M⟩ that the operators of a space connect among themselves; the space has the elements.

    m: M of all states, -1 where it is mixed. copies: number of blocks with the same matrices (M and -M). label: name among the blocks of M.
    rows: (n,) of the levels, rising in J. members: k of a chain of J, or sectors of a `SolvedSpace`, each of whose states is multiplied by
    1 or i according to its colour 0 or 1. even_in_field: whether a reversed electric field leaves all energies unchanged. paired: whether
    each state represents its mirror image too (K and -K, σ and -σ), so that M and -M differ in an electric field. real: whether all
    matrices are real, else complex and Hermitian.
    """

    m: float
    copies: int
    label: str
    rows: Ints = field(repr=False)
    members: tuple[int, ...]
    space: FieldSpace = field(repr=False)
    even_in_field: bool = True
    colours: tuple[int, ...] = ()
    paired: bool = False
    real: bool = True

    @property
    def levels(self) -> FreeLevels:
        """The free levels to which the rows refer."""
        return self.space.levels

    @property
    def j(self) -> Ints:
        """J of the states (n,)."""
        return self.levels.j[self.rows]

    @property
    def energies_mhz(self) -> Floats:
        """Energies of the free top (n,)."""
        return self.levels.energy_mhz[self.rows]

    @property
    def twice_m(self) -> int:
        """Twice M."""
        return round(2 * self.m)

    @cached_property
    def free_order(self) -> Ints:
        """Places of the states in order of free energy, then J (n,)."""
        return np.lexsort((self.j, np.round(self.energies_mhz, 9)))

    def __len__(self) -> int:
        return len(self.rows)

    def matrix(self, operator: FieldOperator) -> Any:
        """The operator over the states (n, n); a sparse one where most elements of many states are 0."""
        return self.space.matrix(self, operator)


class FieldSpace(ABC):
    """The levels of a top up to J max, the blocks with M into which operators along Z divide them, and the elements between these."""

    levels: FreeLevels
    jmax: int

    @property
    def m_is_good(self) -> bool:
        """Whether states have one M."""
        return True

    @abstractmethod
    def blocks(self, m: float) -> list[FieldBlock]:
        """The blocks of M = ±m, m ≥ 0, where `copies` counts equal blocks; in a magnetic field the blocks of M = m.

        A half turn about an axis across an electric field, combined with time reversal, conserves K and M.
        """

    @abstractmethod
    def between(self, up: FieldBlock, operator: FieldOperator, low: FieldBlock) -> NDArray[Any]:
        """Elements of T_q of an operator from the states of a block to those of another (n_up, n_low), q = M' - M."""

    @abstractmethod
    def dense(self, block: FieldBlock, operator: FieldOperator) -> NDArray[Any]:
        """The operator over the states of a block (n, n), Hermitian."""

    def matrix(self, block: FieldBlock, operator: FieldOperator) -> Any:
        """The operator over the states of a block (n, n); a sparse one where most elements of many states are 0."""
        return self.dense(block, operator)

    def abs_m(self, block: FieldBlock) -> Ints:
        """|M| of the states of a block (n,)."""
        return np.full(len(block), abs(block.m))
