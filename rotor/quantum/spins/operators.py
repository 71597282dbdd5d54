"""Operators of N in the terms of the Hamiltonian that couple rotation and spins.

    c · factor · ½{N^2p (N·S1)^r, ½{Nz^2q, X^K(N)}} · W^K(spins)

X^K contains N and the direction cosines φ_pi between space-fixed p and molecule-fixed i:

| operator | X^K | terms |
|---|---|---|
| `Scalar` | operators J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊ of N, K = 0 | Fermi contact, S1·S2, N·S with powers |
| `Cosines` of a vector | Σ_i c_i φ_pi, K = 1 | spin-orbit, between states |
| `Cosines` of a matrix | T² of the symmetric traceless c_ij, K = 2 | quadrupole, dipolar spin-spin |
| `CosinesWithN` | Σ_ij c_ij ½{φ_pi, N_j}, K = 1 | spin-rotation |
| `ByElements` | any, by its elements over |N k⟩ | higher orders, series |
| `Fixed` | a tensor of the molecule by its spherical components | - |
| `BySpecies` | one of these times a factor for each pair of species | phases |

Real elements over the functions of `tensors` are those of X, of vectors (`Cosines`) those of i X, which is Hermitian and invariant under
time reversal.

`CosinesWithN` is not a tensor of the molecule alone. With c = c0 1 + c_s + c_a, where c_s is symmetric and traceless and c_a antisymmetric
with the vector v_k = c_ij,

    ⟨N'‖X‖N⟩ = c0 √(N(N+1)(2N+1)) δ + √{[(N'+N+1)² - 4][1 - (N'-N)²/4]/6} ⟨N'‖T²(c_s)‖N⟩ + (i/2)[N'(N'+1) - N(N+1)] ⟨N'‖φ·v‖N⟩

(the last part is the commutator [N², φ·v] i/2, which has ΔN = ±1 only). All matrices are real, over the functions of `tensors`.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.frozen import dataclass
from rotor.quantum.operators.algebra import Operator
from rotor.quantum.tensors import BodyTensor, body_tensor
from rotor.quantum.wang.basis import SpeciesFactors
from rotor.tops.operators import Powers

EVERY_STATE = -1  # in place of v: a term that is diagonal in the states and equal in all of them

Matrix = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
Vector = tuple[float, float, float]


class AxialState(NamedTuple):
    """|N K⟩ of a symmetric top with K ≥ 0, which stands for -K too; K is a good quantum number where all terms are axial."""

    j: int
    axial_k: int
    size: int = 1

    @property
    def k(self) -> Ints:
        """K, (1,)."""
        return np.array([self.axial_k])


@dataclass(frozen=True)
class Scalar:
    """Operators of N by powers (p, q, n): X of rank 0, as a plain matrix."""

    operators: tuple[tuple[Powers, float], ...] = (((0, 0, 0), 1.0),)
    rank = 0
    odd = False


@dataclass(frozen=True)
class Cosines:
    """Direction cosines with components along a, b, c: a vector (rank 1), or the T² part of a matrix (rank 2)."""

    components: Vector | Matrix

    @property
    def rank(self) -> int:
        """1 for a vector, 2 for a matrix."""
        return 2 if isinstance(self.components[0], tuple) else 1

    @property
    def odd(self) -> bool:
        """Whether time reversal changes the sign of the operator after contraction with spins."""
        return self.rank == 1


def factors_with_n(m: float | Floats, n: float | Floats) -> tuple[Floats, float | Floats, Floats]:
    """Factors in the elements of `CosinesWithN` from N = n to N' = m, |m - n| ≤ 1, as in the formula of this module.

    They multiply T² of c, its antisymmetric part, and a third of its trace (for m = n).
    """
    stretch = np.sqrt(np.maximum(((m + n + 1) ** 2 - 4) * (1 - (m - n) ** 2 / 4) / 6, 0.0))
    return stretch, (n * (n + 1) - m * (m + 1)) / 2, np.sqrt(n * (n + 1) * (2 * n + 1))


@dataclass(frozen=True)
class CosinesWithN:
    """Σ_ij c_ij ½{φ_pi, N_j} with any c (3, 3) along a, b, c: rank 1."""

    components: Matrix
    rank = 1
    odd = False


@dataclass(frozen=True)
class ByElements:
    """Any operator by its reduced elements over |N'k'⟩ and |N k⟩; for rank 0, plain elements within N.

    operator: on |N K⟩ of the representation of the calculation. odd: whether time reversal changes the sign after contraction with spins;
    the elements then contain the factor i of the operator.
    """

    rank: int
    operator: Operator
    odd: bool = False


@dataclass(frozen=True)
class Fixed:
    """A tensor of the molecule by its spherical components; moments have it, terms do not."""

    tensor: BodyTensor
    odd = False

    @property
    def rank(self) -> int:
        """Rank of the tensor."""
        return self.tensor.rank


@dataclass(frozen=True)
class BySpecies:
    """An operator whose elements are multiplied by a factor for each pair of species of Wang blocks.

    With the character of the bra under a half turn C2g it is C2g times an operator that changes sign under C2g, which represents the
    operator in functions that θ C2g leaves unchanged, θ being time reversal. If θ changes the sign of the operator too, the product is
    Hermitian within one state.
    """

    operator: Cosines | CosinesWithN | ByElements | BySpecies | Fixed
    factors: SpeciesFactors
    odd: bool

    @property
    def rank(self) -> int:
        """Rank of the operator."""
        return self.operator.rank


Rotor = Scalar | Cosines | CosinesWithN | ByElements | BySpecies | Fixed
_ALONE = Scalar | ByElements | BySpecies | Fixed  # operators that are not added to others


@lru_cache(maxsize=256)
def tensor_of(components: Vector | Matrix, rank: int, representation: str) -> BodyTensor | None:
    """Spherical tensor of a vector, or of the symmetric traceless part of a matrix; None if it is zero."""
    parts = np.array(components, dtype=float)
    if rank == 2:
        parts = (parts + parts.T) / 2 - np.eye(3) * np.trace(parts) / 3
    return body_tensor(parts, rank, representation) if parts.any() else None


@lru_cache(maxsize=256)
def axis_tensor(components: Matrix, representation: str) -> BodyTensor | None:
    """Spherical tensor of the vector of the antisymmetric part; None if it is zero."""
    c = np.array(components, dtype=float)
    c = (c - c.T) / 2
    return tensor_of((float(c[1, 2]), float(c[2, 0]), float(c[0, 1])), 1, representation)


def is_axial(rotor: Rotor, axis: str) -> bool:
    """Whether an operator leaves K good in a symmetric top about a or c.

    >>> is_axial(Cosines(((1.0, 0, 0), (0, -0.5, 0), (0, 0, -0.5))), "a")
    True
    """
    if isinstance(rotor, Scalar):
        return all(n == 0 for (_, _, n), _ in rotor.operators)
    if isinstance(rotor, ByElements | BySpecies | Fixed):
        return False
    c = np.array(rotor.components, dtype=float)
    across = (1, 2) if axis == "a" else (0, 1)
    return (
        c.ndim == 2
        and bool((c == np.diag(np.diag(c))).all())
        and bool(c[across[0], across[0]] == c[across[1], across[1]])
    )


def summed(weighted: Iterable[tuple[float, Rotor]]) -> list[tuple[float, Rotor]]:
    """Weighted operators, in which those of one kind are added to one by their components.

    A sum that is zero within round-off is left out: it would connect states of different symmetry.
    """
    sums: dict[object, list[Floats]] = {}
    for value, rotor in weighted:
        alone = isinstance(rotor, _ALONE)
        key: object = rotor if alone else (type(rotor), rotor.rank)
        components = np.array(1.0 if isinstance(rotor, _ALONE) else rotor.components)
        sums.setdefault(key, []).append(value * components)
    out: list[tuple[float, Rotor]] = []
    for key, parts in sums.items():
        total = np.sum(parts, axis=0)
        total = np.where(np.abs(total) > _CANCELS * np.abs(parts).sum(axis=0), total, 0.0)
        if total.any():
            alone = isinstance(key, _ALONE)
            out.append((float(total), key) if alone else (1.0, key[0](_nested(total))))  # type: ignore[index,arg-type]
    return out


_CANCELS = 1e-14  # round-off of a sum, relative to the sum of absolute values of its terms


def _nested(array: Floats) -> tuple:  # type: ignore[type-arg]
    """An array as nested tuples, which can be hashed."""
    return tuple(_nested(row) if row.ndim else float(row) for row in array)
