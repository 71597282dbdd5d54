"""States of a top with their M, in the blocks that fields connect, and the matrices of fields and of cosines over them.

What a field does to a top is a contraction of something fixed in the molecule with something fixed in space,

    Σ_F E_F μ_F     (vector with vector),        Σ_FG S_FG α_FG     (symmetric tensor with symmetric tensor),

and so are the cosines: cosθ of a body axis g and Z is the contraction of the unit vectors g and Z, cos²θ that of gg and ZZ.
A `Contraction` holds both as Cartesian arrays; in spherical components it is tr·tr/3 and Σ_p S^K_p* T^K_p with the elements of
`rotor.quantum.tensors`. Here both are symmetric about Z, so that M is good; `rotor.quantum.fields.tilted_blocks` has the others.

Blocks are those that the contractions given leave apart, found and not assumed: (M, k) for a molecule with one axis, with J even
and J odd apart where nothing connects them (M = 0 or k = 0, no dipole); (M, sets of D2 species) for others, and at M = 0 the
halves that its reflection separates.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.direction_cosines import cosine_bands, cosine_squared_bands

if TYPE_CHECKING:
    pass

ROUND_OFF = 1e-9  # of the largest element: what a tensor may miss of being axial


@dataclass(frozen=True)
class Contraction:
    """A body vector (3,) with a space vector (3,), or a symmetric body tensor (3, 3) with a symmetric space tensor (3, 3).

    body: along a, b, c. space: along X, Y, Z.

    >>> Contraction([1.0, 0, 0], [0, 0, 1.0]).rank  # cosθ of the a axis
    1
    """

    body: Any
    space: Any

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
        """1 of vectors, 2 of tensors (their traces are a number besides)."""
        return int(self.body.ndim)

    @cached_property
    def along_z(self) -> bool:
        """Whether the space part is symmetric about Z, so that M is conserved."""
        return _axial(self.space, 2)

    def axial_about(self, axis: int) -> bool:
        """Whether the body part is symmetric about a (0), b (1) or c (2)."""
        return _axial(self.body, axis)

    @property
    def scalar(self) -> float:
        """The part that does not depend on orientation."""
        return float(np.trace(self.body) * np.trace(self.space) / 3) if self.rank == 2 else 0.0


def _axial(array: Floats, axis: int) -> bool:
    others = [i for i in range(3) if i != axis]
    if array.ndim == 1:
        rest = array[others]
    else:
        i, j = others
        rest = np.array([array[0, 1], array[0, 2], array[1, 2], array[i, i] - array[j, j]])
    return bool(np.abs(rest).max() <= ROUND_OFF * max(float(np.abs(array).max()), 1e-300))


def _along(array: Floats, axis: int) -> float:
    """The axial component of a vector, or the difference of a tensor's element along the axis and across it."""
    if array.ndim == 1:
        return float(array[axis])
    across = (np.trace(array) - array[axis, axis]) / 2
    return float(array[axis, axis] - across)


@dataclass(frozen=True)
class FreeLevels:
    """Levels of the free top, each with 2J+1 values of M; a symmetric top has K and -K apart.

    j, energy_mhz: (n,). quanta: further quantum numbers by name (n,). weight: spin weight of one state (n,).
    """

    j: Ints
    energy_mhz: Floats
    quanta: dict[str, Ints]
    weight: Floats

    def __len__(self) -> int:
        return len(self.j)

    def label(self, row: int) -> str:
        """Quantum numbers of a row as text, J first: `1 0 1`."""
        return " ".join(str(int(values[row])) for values in (self.j, *self.quanta.values()))


class FieldBlock(ABC):
    """States |level, M⟩ that the contractions of a `FieldSpace` connect among themselves.

    m: M of all states. copies: how many such blocks there are with the same matrices (M and -M). rows: (n,) of the levels,
    rising in J. A matrix is real where the block has real phases, else complex and Hermitian.
    """

    m: float
    copies: int
    rows: Ints

    @property
    @abstractmethod
    def label(self) -> str:
        """Which block of its M it is."""

    @property
    @abstractmethod
    def levels(self) -> FreeLevels:
        """The levels whose rows the states are of."""

    @property
    def j(self) -> Ints:
        """J of the states (n,)."""
        return self.levels.j[self.rows]

    @property
    def energies_mhz(self) -> Floats:
        """Energies of the free top (n,)."""
        return self.levels.energy_mhz[self.rows]

    @property
    def even_in_field(self) -> bool:
        """Whether a reversed electric field leaves all energies: half a turn about an axis across it and time reversal keep K and M."""
        return True

    @cached_property
    def free_order(self) -> Ints:
        """Places of the states in order of their free energies, J deciding between equal ones (n,)."""
        return np.lexsort((self.j, np.round(self.energies_mhz, 9)))

    @property
    def abs_m(self) -> Ints:
        """|M| of the states (n,)."""
        return np.full(len(self), abs(self.m))

    def __len__(self) -> int:
        return len(self.rows)

    @abstractmethod
    def matrix(self, contraction: Contraction) -> NDArray[Any]:
        """The contraction over the states (n, n), Hermitian; large ones of mixed M are sparse."""

    def dense(self, contraction: Contraction) -> NDArray[Any]:
        """The same, never sparse."""
        found: Any = self.matrix(contraction)
        return np.asarray(found if isinstance(found, np.ndarray) else found.toarray())


@dataclass(frozen=True)
class AxialBlock(FieldBlock):
    """States |J k M⟩ of one k and M of a linear or symmetric top, `step` 2 where J even and odd are apart.

    axis: 0 where the figure axis is a, 2 where it is c.
    """

    m: int
    k: int
    copies: int
    step: int
    axis: int
    rows: Ints = field(repr=False)
    space: AxialSpace = field(repr=False)

    @property
    def levels(self) -> FreeLevels:
        """The levels of the space."""
        return self.space.levels

    @property
    def even_in_field(self) -> bool:
        """Where K M is not 0 a reversed field exchanges K and -K."""
        return not self.k * self.m

    @property
    def label(self) -> str:
        """k, and the parity of J where it is good."""
        parity = "" if self.step == 1 else (" J odd" if int(self.j[0]) % 2 else " J even")
        return f"k={self.k}{parity}"

    def bands(self, contraction: Contraction) -> list[Floats]:
        """Diagonals of the matrix, the main one first; at most three."""
        size = _along(contraction.body, self.axis) * _along(contraction.space, 2)
        first, j = max(abs(self.k), abs(self.m)), self.j
        skip = int(j[0]) - first
        bands = _cosines(contraction.rank, first, int(j[-1]), self.k, self.m)
        if contraction.rank == 1:
            return [size * band[skip:] for band in bands]
        d, one, two = (band[skip:] for band in bands)
        main = contraction.scalar + size * (d[:: self.step] - 1 / 3)
        return [main, size * two[::2]] if self.step == 2 else [main, size * one, size * two]

    def matrix(self, contraction: Contraction) -> Floats:
        """The contraction over the states (n, n), real; that of a vector connects nothing where J even and odd are apart."""
        if self.step == 2 and contraction.rank == 1:
            return np.zeros((len(self), len(self)))
        size = len(self)
        out = np.zeros(size * size)
        for n, band in enumerate(self.bands(contraction)):
            out[n : size * (size - n) : size + 1] = out[n * size :: size + 1] = band
        return out.reshape(size, size)


@lru_cache(maxsize=4096)
def _cosines(power: int, first: int, last: int, k: int, m: int) -> tuple[Floats, ...]:
    """Bands of cosθ (power 1) or cos²θ (2) over J = first ... last."""
    return (cosine_bands if power == 1 else cosine_squared_bands)(np.arange(first, last + 1), k, m)


class FieldSpace(ABC):
    """The levels of a top up to J max, and the blocks into which contractions along Z divide them with their M."""

    levels: FreeLevels
    jmax: int
    m_is_good: ClassVar[bool] = True

    @abstractmethod
    def blocks(self, m: int) -> list[FieldBlock]:
        """The blocks of M = ±m, m ≥ 0; `copies` says how many like it there are."""


@dataclass(frozen=True)
class AxialSpace(FieldSpace):
    """Of a linear or symmetric top whose tensors have its axis; `oriented` where a dipole connects J with J ± 1."""

    levels: FreeLevels = field(repr=False)
    jmax: int
    axis: int
    oriented: bool

    def blocks(self, m: int) -> list[FieldBlock]:
        """(k, M) is like (-k, -M); without a dipole like (-k, M) too."""
        out: list[FieldBlock] = []
        for k, rows in self._rows_by_k.items():
            both_signs = self.oriented and m > 0
            rows = rows[max(m - abs(k), 0) :]
            if not len(rows) or (k < 0 and not both_signs):
                continue
            copies = (2 if m else 1) * (2 if k and not both_signs else 1)
            apart = not self.oriented and k * m == 0
            for half in (rows[::2], rows[1::2]) if apart else (rows,):
                if len(half):
                    out.append(AxialBlock(m, k, copies, 2 if apart else 1, self.axis, half, self))
        return out

    @cached_property
    def _rows_by_k(self) -> dict[int, Ints]:
        k = self.levels.quanta.get("k", np.zeros(len(self.levels), dtype=np.int64))
        return {int(value): np.flatnonzero(k == value) for value in np.unique(k)}
