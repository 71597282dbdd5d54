"""States of a top with M, in the blocks that fields connect, and the matrices of operators over them.

Blocks follow from the elements of the operators. For a molecule with one axis they are (M, k), with even and odd J separate where nothing
connects them (M = 0 or k = 0, no dipole). For all others they are sets of solved blocks, divided at M = 0 by the reflection. In fields
along Z, M is a good quantum number; other directions mix it (`rotor.quantum.fields.solved_space`).

A field acts by a molecule-fixed vector or tensor contracted with a space-fixed one,

    Σ_F E_F μ_F     (vector with vector),        Σ_FG S_FG α_FG     (symmetric tensor with symmetric tensor).

Cosines have this form too: cosθ of a body axis g and Z is the contraction of the unit vectors g and Z, cos²θ that of gg and ZZ. A
`Contraction` holds both as Cartesian arrays; in spherical components it is tr·tr/3 and Σ_p S^K_p* T^K_p with the elements of
`rotor.quantum.operators.tensors`. A `Magnet` is the magnetic moment on which a field along Z acts,

    ½ Σ g_ij {Φ_Zi, N_j} + Σ_spins g_I I_Z,        times -μ_N B.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.labels.quanta import value_text
from rotor.quantum.levels import Levels
from rotor.quantum.operators.tensors import Tensors, body_tensor

ROUND_OFF = 1e-9  # smaller deviations from axial symmetry, relative to the largest element, are ignored

Key = tuple[Any, ...]


@dataclass(frozen=True)
class Contraction:
    """A body vector (3,) with a space vector (3,), or a symmetric body tensor (3, 3) with a symmetric space tensor (3, 3).

    body: along a, b, c, for the state v = 0. space: along X, Y, Z. states: body parts by pairs (v', v) of several states; by default all
    states have the same and none acts between them.

    >>> Contraction([1.0, 0, 0], [0, 0, 1.0]).rank  # cosθ of the a axis
    1
    """

    body: Any
    space: Any
    states: Mapping[tuple[int, int], tuple[float, ...]] = field(default_factory=dict)

    time_odd = False

    def __post_init__(self) -> None:
        body, space = np.array(self.body, dtype=np.float64), np.array(self.space, dtype=np.float64)
        if body.shape != space.shape or body.shape not in ((3,), (3, 3)):
            raise ValueError(
                f"a contraction is of two vectors (3,) or of two tensors (3, 3); got {body.shape}, {space.shape}"
            )
        if not (np.isfinite(body).all() and np.isfinite(space).all()):
            raise ValueError("a contraction of fields has numbers that are not finite")
        object.__setattr__(self, "body", body)
        object.__setattr__(self, "space", space)

    @property
    def rank(self) -> int:
        """1 for vectors, 2 for tensors (whose traces give a scalar besides)."""
        return int(self.body.ndim)

    @cached_property
    def key(self) -> Key:
        """Identifies the molecule-fixed part, whose elements are cached."""
        return (self.body.tobytes(), *sorted(self.states.items()))

    @cached_property
    def key_in_space(self) -> Key:
        """Identifies both parts."""
        return (*self.key, self.space.tobytes())

    def tensors(self, states: tuple[int, ...], representation: str) -> Tensors:
        """T^K by pairs of states (v', v)."""
        bodies = dict(self.states) if self.states else {(v, v): self.body for v in states}
        return {pair: body_tensor(body, self.rank, representation) for pair, body in bodies.items() if np.any(body)}

    @cached_property
    def along_z(self) -> bool:
        """Whether the space part is symmetric about Z, so that M is conserved."""
        return _axial(self.space, 2)

    def axial_about(self, axis: int) -> bool:
        """Whether the body part is symmetric about a (0), b (1) or c (2)."""
        return all(_axial(np.asarray(body), axis) for body in (self.body, *self.states.values()))

    @cached_property
    def size(self) -> float:
        """The component q = 0 of the space part: T^1_0 = Z, or T^2_0 = (2ZZ - XX - YY)/√6."""
        space = self.space
        return float(space[2]) if self.rank == 1 else float((2 * space[2, 2] - space[0, 0] - space[1, 1]) / np.sqrt(6))

    @property
    def scalar(self) -> float:
        """The part that does not depend on orientation."""
        return float(np.trace(self.body) * np.trace(self.space) / 3) if self.rank == 2 else 0.0


@dataclass(frozen=True)
class Magnet:
    """The rotational g tensor (3, 3) along a, b, c, equal in all states, and g of nuclei by the names of their spins."""

    g: Floats
    nuclei: Mapping[str, float] = field(default_factory=dict)

    rank = 1
    time_odd = True
    along_z = True
    size = 1.0
    scalar = 0.0

    @cached_property
    def key(self) -> Key:
        """Identifies the moment, whose elements are cached."""
        return ("magnet", self.g.tobytes(), *self.nuclei.items())

    @property
    def key_in_space(self) -> Key:
        """The moment is taken along Z."""
        return self.key

    def axial_about(self, axis: int) -> bool:
        """Whether the g tensor is symmetric about a (0), b (1) or c (2)."""
        return _axial(self.g, axis)


FieldOperator = Contraction | Magnet


def _axial(array: Floats, axis: int) -> bool:
    """Whether a vector or tensor is symmetric about an axis."""
    others = [i for i in range(3) if i != axis]
    if array.ndim == 1:
        rest = array[others]
    else:
        i, j = others
        rest = np.array([array[0, 1], array[0, 2], array[1, 2], array[i, i] - array[j, j]])
    return bool(np.abs(rest).max() <= ROUND_OFF * max(float(np.abs(array).max()), 1e-300))


def along(array: Floats, axis: int) -> float:
    """The axial component of a vector, or the difference of a tensor's element along the axis and across it."""
    if array.ndim == 1:
        return float(array[axis])
    across = (np.trace(array) - array[axis, axis]) / 2
    return float(array[axis, axis] - across)


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
        """The operator over the states (n, n), Hermitian; a sparse one where most elements of many states are 0."""
        return self.space.matrix(self, operator)

    def dense(self, operator: FieldOperator) -> NDArray[Any]:
        """The operator over the states (n, n), Hermitian."""
        matrix = self.matrix(operator)
        return np.asarray(matrix if isinstance(matrix, np.ndarray) else matrix.toarray())


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
    def matrix(self, block: FieldBlock, operator: FieldOperator) -> Any:
        """See `FieldBlock.matrix`."""

    def abs_m(self, block: FieldBlock) -> Ints:
        """|M| of the states of a block (n,)."""
        return np.full(len(block), abs(block.m))
