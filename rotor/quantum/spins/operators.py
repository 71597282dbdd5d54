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
from rotor.quantum.operators.rotation import matrix_of_j
from rotor.quantum.symmetric_top_elements import coupling
from rotor.quantum.tensors import BodyTensor, Complexes, block_elements, body_tensor, phase_exponent
from rotor.quantum.wang.basis import SPECIES, SpeciesFactors, WangBlock
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


Basis = WangBlock | AxialState


def tensor_elements(up: Basis, low: Basis, tensor: BodyTensor | None) -> Floats | None:
    """Real reduced elements of a tensor between two blocks; None where it does not act.

    Between axial states this is the element of one sign of K, with the absolute value of a component across the axis.
    """
    if tensor is None:
        return None
    if isinstance(up, AxialState) and isinstance(low, AxialState):
        q = up.axial_k - low.axial_k
        if abs(q) > tensor.rank or not abs(up.j - low.j) <= tensor.rank <= up.j + low.j:
            return None
        part = tensor.components[tensor.rank + q]
        return (
            (abs(part) if q else part.real) * coupling(low.j, up.j, tensor.rank, q, [low.axial_k])[:, None]
            if part
            else None
        )
    assert isinstance(up, WangBlock)
    assert isinstance(low, WangBlock)
    return None if tensor.between(up, low) is None else block_elements(up, low, tensor)


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

    def elements(self, up: Basis, low: Basis, representation: str) -> Floats | None:
        """The real reduced matrix; for a vector that of i times it, which is Hermitian and invariant under time reversal."""
        matrix = tensor_elements(up, low, tensor_of(self.components, self.rank, representation))
        return -matrix if matrix is not None and self.rank == 1 else matrix  # i · (i E)


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

    def elements(self, up: Basis, low: Basis, representation: str) -> Floats | None:
        """The real reduced matrix between two blocks, None where it is zero."""
        c, n, m = np.array(self.components), low.j, up.j
        if abs(m - n) > 1 or not m + n:
            return None
        stretch, change, length = factors_with_n(float(m), float(n))
        terms = [
            (stretch, tensor_elements(up, low, tensor_of(self.components, 2, representation))),
            (change, tensor_elements(up, low, axis_tensor(self.components, representation))),
            (float(np.trace(c)) / 3, length * np.eye(low.size) if up == low else None),
        ]
        acting = [factor * matrix for factor, matrix in terms if matrix is not None and factor]
        return np.asarray(sum(acting)) if acting else None


@dataclass(frozen=True)
class ByElements:
    """Any operator by its reduced elements over |N'k'⟩ and |N k⟩; for rank 0, plain elements within N.

    operator: on |N K⟩ of the representation of the calculation. odd: whether time reversal changes the sign after contraction with spins;
    the elements then contain the factor i of the operator.
    """

    rank: int
    operator: Operator
    odd: bool = False

    def elements(self, up: Basis, low: Basis, representation: str) -> Floats | None:
        """The real reduced matrix between two blocks, None where it is zero."""
        if not abs(up.j - low.j) <= self.rank <= up.j + low.j:
            return None
        between = matrix_of_j(self.operator, low.j, up.j)
        reduced = (functions_of(up).conj().T @ between @ functions_of(low)).real
        return reduced if np.abs(reduced).max(initial=0.0) > _NOTHING * np.abs(between).max(initial=0.0) else None


_NOTHING = 1e-13  # round-off of a product of a few numbers, relative to the largest element over |N k⟩


@lru_cache(maxsize=256)
def functions_of(basis: Basis) -> Complexes:
    """The functions of a basis over |N k⟩ (k rising from -N) in columns.

    Raises ValueError for an axial state |N K⟩ with K > 0, which stands for -K too.
    """
    if isinstance(basis, AxialState):
        if basis.axial_k:
            raise ValueError(
                f"functions |N K⟩ with K = {basis.axial_k}, which stand for -K too: Wang functions are needed"
            )
        return np.asarray(np.eye(2 * basis.j + 1, dtype=np.complex128)[:, [basis.j]])
    out = np.zeros((2 * basis.j + 1, basis.size), dtype=np.complex128)
    for column, k in enumerate(basis.k.tolist()):
        out[basis.j + k, column] = np.sqrt(0.5) if k else 1.0
        out[basis.j - k, column] = basis.sign * np.sqrt(0.5) if k else 1.0
    return np.asarray(out * 1j ** phase_exponent(basis))


@dataclass(frozen=True)
class BySpecies:
    """An operator whose elements are multiplied by a factor for each pair of species of Wang blocks.

    With the character of the bra under a half turn C2g it is C2g times an operator that changes sign under C2g, which represents the
    operator in functions that θ C2g leaves unchanged, θ being time reversal. If θ changes the sign of the operator too, the product is
    Hermitian within one state.
    """

    operator: Cosines | CosinesWithN | ByElements | BySpecies
    factors: SpeciesFactors
    odd: bool

    @property
    def rank(self) -> int:
        """Rank of the operator."""
        return self.operator.rank

    def elements(self, up: Basis, low: Basis, representation: str) -> Floats | None:
        """The real reduced matrix between two blocks, None where it is zero."""
        assert isinstance(up, WangBlock)
        assert isinstance(low, WangBlock)
        factor = self.factors[SPECIES.index(up.species)][SPECIES.index(low.species)]
        elements = self.operator.elements(up, low, representation) if factor else None
        return None if elements is None else factor * elements


Rotor = Scalar | Cosines | CosinesWithN | ByElements | BySpecies
_ALONE = Scalar | ByElements | BySpecies  # operators that are not added to others


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
    if isinstance(rotor, ByElements | BySpecies):
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
