"""Spins and their coupling terms, as effects declare them, and the coupling scheme N + S1 = J, J + I1 = F1, ... = F.

The scheme has the order of the spins and the names of the sums. Terms of the Hamiltonian that couple rotation and spins are

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

from collections.abc import Iterable, Sequence
from dataclasses import field, replace
from functools import lru_cache
from itertools import accumulate
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.frozen import dataclass
from rotor.quantum.operators.algebra import Operator
from rotor.quantum.operators.tensors import BodyTensor, body_tensor
from rotor.quantum.spins.coupling import patterns, patterns_of_three, patterns_of_total, recoupling, recoupling_of_three
from rotor.quantum.wang.basis import SpeciesFactors
from rotor.tops.constants.operators import Powers

if TYPE_CHECKING:
    from rotor.tops.top import Top


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


@dataclass(frozen=True)
class Spin:
    """One spin: its name in parameters, twice its size (2I, an integer), and whether it is an electron spin.

    A spin of size 0 is a placeholder: it adds a quantum number but no splitting.

    Spins are coupled in the order in which effects first name them, electrons before nuclei. total: two or three nuclei with an equal
    name here, such as "I", are equivalent. They are coupled to a total spin first, which is coupled last. Terms of three equivalent nuclei
    name only the first, or the first and the second (see `three_equivalent`).
    """

    name: str
    twice: int
    electron: bool = False
    total: str = ""

    def __post_init__(self) -> None:
        if self.twice < 0 or self.twice != int(self.twice):
            raise ValueError(f"spin {self.name}: 2I = {self.twice}; twice a spin is a whole number, 0 or more")


@dataclass(frozen=True)
class SpinTerm:
    """The operator that a parameter multiplies: `factor` times X^K(N) · W^K of the spins.

    name: name of the parameter. spins: none, one (its vector), one twice (its quadrupole, T²(I, I)/(2I(2I-1))) or two (their product,
    coupled to the rank of `rotor`). n2, nz2: powers of N² and Nz². ns: power of N·S1. bra, ket: the states v that it connects; where they
    differ the conjugate is added, and an operator that is odd under time reversal has a factor i.
    """

    name: str
    spins: tuple[str, ...]
    rotor: Rotor
    factor: float = 1.0
    n2: int = 0
    nz2: int = 0
    ns: int = 0
    bra: int = EVERY_STATE
    ket: int = EVERY_STATE

    def __post_init__(self) -> None:
        expected = {0: (0,), 1: (1,), 2: (0, 2)}.get(len(self.spins), ())
        if self.rotor.rank not in expected or (len(set(self.spins)) < len(self.spins) and self.rotor.rank != 2):
            raise ValueError(
                f"{self.name}: {len(self.spins)} spins {self.spins} cannot close an operator of rank {self.rotor.rank}"
            )
        if self.rotor.odd and self.bra == self.ket:
            raise ValueError(
                f"{self.name}: time reversal changes its sign; such an operator connects different states only"
            )


@dataclass(frozen=True)
class Scheme:
    """The spins in the order of coupling, and names of the intermediate sums.

    equivalent: number of last spins (two or three) that are coupled to a total spin first; else 0. conserved: names of sums that count as
    good quantum numbers; elements between their different values are neglected, as in perturbation theory.
    """

    spins: tuple[Spin, ...]
    conserved: frozenset[str] = frozenset()
    twice: tuple[int, ...] = field(init=False)
    equivalent: int = field(init=False, default=0)

    def __post_init__(self) -> None:
        names = [spin.name for spin in self.spins]
        if len(set(names)) < len(names):
            raise ValueError(f"spins {', '.join(names)}: every spin has a name of its own")
        object.__setattr__(self, "twice", tuple(spin.twice for spin in self.spins))
        together = [spin.total for spin in self.spins if spin.total]
        last = self.spins[-max(len(together), 1) :]
        if together and (
            len(together) not in (2, 3) or len({(s.total, s.twice, s.electron) for s in last}) > 1 or last[0].electron
        ):
            raise ValueError(
                "spins that are coupled to a total are two nuclei or three of one size, and the last ones: "
                f"{', '.join(spin.name for spin in self.spins)}"
            )
        object.__setattr__(self, "equivalent", len(together))

    @property
    def total(self) -> int:
        """Twice the sum of all spins."""
        return sum(self.twice)

    def reached_f(self, nmin: int, nmax: int) -> range:
        """All doubled F to which N from `nmin` to `nmax` are coupled."""
        return range(max(2 * nmin - self.total, self.total % 2), 2 * nmax + self.total + 1, 2)

    def patterns(self, twice_f: int) -> Ints:
        """The coupling patterns N, ..., F of one doubled F, doubled."""
        of = {0: patterns, 2: patterns_of_total, 3: patterns_of_three}[self.equivalent]
        return of(self.twice, twice_f)

    @property
    def one_by_one(self) -> Scheme:
        """The scheme without a total of equivalent spins."""
        return replace(self, spins=tuple(replace(spin, total="") for spin in self.spins)) if self.equivalent else self

    def recoupling(self, twice_f: int) -> tuple[Ints, Floats]:
        """Patterns of one F with spins coupled one by one, and their amplitudes in patterns with a total spin, (one by one, total)."""
        plain = patterns(self.twice, twice_f)
        of = recoupling_of_three if self.equivalent == 3 else recoupling
        return plain, of(self.twice, plain, self.patterns(twice_f))

    def classes(self, patterns: Ints) -> Ints:
        """1 for patterns whose function of two equivalent spins changes sign with their exchange, else 0."""
        if self.equivalent != 2:
            return np.zeros(len(patterns), dtype=np.int64)
        return np.asarray((self.twice[-1] + self.twice[-2] - patterns[:, -2]) // 2 % 2)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the quantum numbers after each spin: j after electrons, f1, f2, ..., f after the last nucleus.

        >>> Scheme((Spin("S", 1, True), Spin("14N", 2))).names, Scheme((Spin("Cl1", 3), Spin("Cl2", 3))).names
        (('j', 'f'), ('f1', 'f'))
        """
        electrons = [f"j{i + 1}" if i else "j" for i, spin in enumerate(self.spins) if spin.electron]
        nuclei = len(self.spins) - len(electrons)
        sums = [*electrons, *(f"f{i + 1}" for i in range(nuclei - 1)), *(["f"] if nuclei else [])]
        total_names: list[str] = {0: [], 2: ["i_tot", "f"], 3: ["i_sym", "i_tot", "f"]}[self.equivalent]
        return (*sums[: len(sums) - self.equivalent], *total_names)

    @property
    def half(self) -> tuple[bool, ...]:
        """Whether each sum is a half-integer."""
        halves = [bool(total % 2) for total in accumulate(self.twice)]
        last = halves[-1:]
        total_halves = {0: [], 2: [False, *last], 3: [False, sum(self.twice[-3:]) % 2 == 1, *last]}[self.equivalent]
        return (*halves[: len(halves) - self.equivalent], *total_halves)

    @property
    def halves(self) -> frozenset[str]:
        """Names of the sums that are half-integers."""
        return frozenset(name for name, half in zip(self.names, self.half, strict=True) if half)

    def sums_of(self, labels: Ints) -> dict[str, Ints]:
        """The sums of labels (levels, columns as `SolvedBlock.labels`) by name, doubled where they are half-integers."""
        columns = zip(self.names, self.half, labels[:, 4:].T, strict=True)
        return {name: column if half else column // 2 for name, half, column in columns}

    @property
    def conserved_columns(self) -> list[int]:
        """Columns of the patterns that hold conserved sums."""
        return [column for column, name in enumerate(("n", *self.names)) if name in self.conserved]

    def count_of(self, acting: tuple[int, ...]) -> int:
        """Number of equal operators, turned by 120° each, that an operator on these places represents.

        3 if it acts on one of three equivalent spins, else 1.
        """
        return 3 if self.equivalent == 3 and max(acting, default=-1) >= len(self.spins) - 3 else 1

    def place(self, name: str) -> int:
        """The place of a spin in the order of coupling."""
        for place, spin in enumerate(self.spins):
            if spin.name == name:
                return place
        raise ValueError(f"spin {name}: the spins here are {', '.join(spin.name for spin in self.spins) or 'none'}")


class DeclaresSpins(Protocol):
    """An effect as the coupling scheme sees it: `QuantumEffect`, without an import of that module, which imports this one."""

    def spins(self, top: Top) -> tuple[Spin, ...]:
        """Spins of the effect."""

    def conserved_sums(self, top: Top) -> frozenset[str]:
        """Names of sums that count as good quantum numbers."""


def scheme_of(top: Top, effects: Sequence[DeclaresSpins]) -> Scheme:
    """The spins of all effects, each once, electrons first; ValueError if two effects differ in the size of a spin."""
    spins: dict[str, Spin] = {}
    for spin in (spin for effect in effects for spin in effect.spins(top)):
        if spins.setdefault(spin.name, spin) != spin:
            raise ValueError(f"spin {spin.name}: given as {spins[spin.name].twice}/2 and as {spin.twice}/2")
    conserved = frozenset(name for effect in effects for name in effect.conserved_sums(top))
    return Scheme(tuple(sorted(spins.values(), key=lambda spin: not spin.electron)), conserved)
