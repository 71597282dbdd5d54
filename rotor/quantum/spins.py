"""Spins coupled to the rotation: what an effect says about them, and the levels of a top that has them.

    H = H_rot + Σ_terms c · factor · ½{N^2p Nz^2q (N·S1)^r, X^K(N) · W^K(spins)}

N is the rotational angular momentum, coupled with the spins one after another, N + S1 = J, J + S2 = F1, ... = F. X^K is made of
direction cosines φ_pi between space-fixed p and molecule-fixed i, and of N:

| `Rotor` | X^K | terms |
|---|---|---|
| `Scalar` | operators J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊ of N, K = 0 | Fermi contact, S1·S2, N·S with powers |
| `Cosines` of a vector | Σ_i c_i φ_pi, K = 1 | spin-orbit, between states |
| `Cosines` of a matrix | T² of the symmetric traceless c_ij, K = 2 | quadrupole, dipolar spin-spin |
| `CosinesWithN` | Σ_ij c_ij ½{φ_pi, N_j}, K = 1 | spin-rotation |

The last one is no tensor of the molecule alone. With c = c0 1 + c_s + c_a, symmetric and traceless, antisymmetric with the vector
v_k = c_ij,

    ⟨N'‖X‖N⟩ = c0 √(N(N+1)(2N+1)) δ + √{[(N'+N+1)² - 4][1 - (N'-N)²/4]/6} ⟨N'‖T²(c_s)‖N⟩ + (i/2)[N'(N'+1) - N(N+1)] ⟨N'‖φ·v‖N⟩

(the commutator [N², φ·v]/2 is the last part, so that it has ΔN = ±1 alone).
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import lru_cache
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.basis import WangBlock
from rotor.quantum.effects.watson import JMatrix, block_bands, scalar_energy
from rotor.quantum.tensors import BodyTensor, block_elements, body_tensor
from rotor.tops.operators import Operators, Powers

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.quantum.levels import Levels
    from rotor.tops.top import Top

Matrix = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Spin:
    """One spin: its name, as parameters have it, twice its size (2I, a whole number), and whether it is an electron's.

    Spins are coupled in the order in which effects first name them, electrons' before nuclei's.
    """

    name: str
    twice: int
    electron: bool = False

    def __post_init__(self) -> None:
        if self.twice < 1 or self.twice != int(self.twice):
            raise ValueError(f"spin {self.name}: 2I = {self.twice}; twice a spin is a whole number, 1 or more")


@dataclass(frozen=True)
class Scalar:
    """Operators of N by powers (p, q, n), times unit strength: X of rank 0."""

    operators: tuple[tuple[Powers, float], ...] = (((0, 0, 0), 1.0),)
    rank = 0
    odd = False

    def elements(self, up: WangBlock, low: WangBlock, representation: str) -> Floats | None:
        """The plain matrix between two Wang blocks, None where it is zero."""
        if up != low:
            return None
        operators: Operators = dict(self.operators)
        bands = block_bands(JMatrix(operators, low.j), low)
        matrix = np.diag(bands[0] + scalar_energy(operators, low.j))
        for n, band in enumerate(bands[1:], 1):
            matrix += np.diag(band, n) + np.diag(band, -n)
        return np.asarray(matrix)


@dataclass(frozen=True)
class Cosines:
    """Direction cosines with components along a, b, c: a vector (rank 1), or a matrix of which T² acts (rank 2)."""

    components: Vector | Matrix

    @property
    def rank(self) -> int:
        """1 of a vector, 2 of a matrix."""
        return np.ndim(self.components)

    @property
    def odd(self) -> bool:
        """Whether time reversal changes the sign once a spin is contracted with it."""
        return self.rank == 1

    def elements(self, up: WangBlock, low: WangBlock, representation: str) -> Floats | None:
        """The real reduced matrix; of a vector that of i times it, which is Hermitian and invariant under time reversal."""
        sign = -1.0 if self.rank == 1 else 1.0  # i · (i E)
        return _scaled(up, low, _tensor(self.components, self.rank, representation), sign)


@dataclass(frozen=True)
class CosinesWithN:
    """Σ_ij c_ij ½{φ_pi, N_j} with any c (3, 3) along a, b, c: rank 1."""

    components: Matrix
    rank = 1
    odd = False

    def elements(self, up: WangBlock, low: WangBlock, representation: str) -> Floats | None:
        """The real reduced matrix between two Wang blocks, None where it is zero."""
        c, n, m = np.array(self.components), low.j, up.j
        found = []
        if up == low and n and (scalar := np.trace(c) / 3):
            found.append(scalar * sqrt(n * (n + 1.0) * (2 * n + 1)) * np.eye(low.size))
        if abs(m - n) <= 1 and m + n:
            stretch = sqrt(max(((m + n + 1) ** 2 - 4) * (1 - (m - n) ** 2 / 4) / 6, 0.0))
            found.append(_scaled(up, low, _symmetric(self.components, representation), stretch))
            found.append(_scaled(up, low, _axial(self.components, representation), (n * (n + 1) - m * (m + 1)) / 2))
        kept = [matrix for matrix in found if matrix is not None]
        return sum(kept[1:], kept[0]) if kept else None


Rotor = Scalar | Cosines | CosinesWithN


def _scaled(up: WangBlock, low: WangBlock, tensor: BodyTensor | None, factor: float) -> Floats | None:
    if tensor is None or factor == 0.0 or tensor.between(up, low) is None:
        return None
    return factor * block_elements(up, low, tensor)


@lru_cache(maxsize=256)
def _tensor(components: Vector | Matrix, rank: int, representation: str) -> BodyTensor | None:
    parts = np.array(components, dtype=float)
    if rank == 2:
        parts = (parts + parts.T) / 2 - np.eye(3) * np.trace(parts) / 3
    return body_tensor(parts, rank, representation) if parts.any() else None


def _symmetric(components: Matrix, representation: str) -> BodyTensor | None:
    return _tensor(components, 2, representation)


def _axial(components: Matrix, representation: str) -> BodyTensor | None:
    c = np.array(components, dtype=float)
    c = (c - c.T) / 2
    return _tensor((float(c[1, 2]), float(c[2, 0]), float(c[0, 1])), 1, representation)


@dataclass(frozen=True)
class SpinTerm:
    """What a parameter of an effect multiplies, besides `factor`: X^K(N) · W^K of the spins named.

    name: of the parameter. spins: none, one (its vector), one twice (its quadrupole, T²(I, I)/(2I(2I-1))) or two (their product,
    coupled to the rank of `rotor`). n2, nz2: powers of N² and Nz², ns: power of N·S1, as half anticommutators, the one with Nz²
    inside. bra, ket: the states v that it connects, h.c. added where they differ; an operator that is odd under time reversal
    has the factor i there.
    """

    name: str
    spins: tuple[str, ...]
    rotor: Rotor
    factor: float = 1.0
    n2: int = 0
    nz2: int = 0
    ns: int = 0
    bra: int = 0
    ket: int = 0

    def __post_init__(self) -> None:
        wanted = {0: (0,), 1: (1,), 2: (0, 2)}.get(len(self.spins), ())
        if self.rotor.rank not in wanted or (len(set(self.spins)) < len(self.spins) and self.rotor.rank != 2):
            raise ValueError(
                f"{self.name}: {len(self.spins)} spins {self.spins} cannot close an operator of rank {self.rotor.rank}"
            )
        if self.rotor.odd and self.bra == self.ket:
            raise ValueError(f"{self.name}: time reversal changes its sign; such an operator connects different states only")

    @property
    def acting(self) -> tuple[str, ...]:
        """The spins that it touches, without those of N·S."""
        return self.spins


@dataclass(frozen=True)
class Scheme:
    """Which spins are coupled, and what the angular momenta on the way to F are called."""

    spins: tuple[Spin, ...]
    twice: tuple[int, ...] = field(init=False)

    def __post_init__(self) -> None:
        names = [spin.name for spin in self.spins]
        if len(set(names)) < len(names):
            raise ValueError(f"spins {', '.join(names)}: every spin has a name of its own")
        object.__setattr__(self, "twice", tuple(spin.twice for spin in self.spins))

    @property
    def total(self) -> int:
        """Twice the sum of all spins."""
        return sum(self.twice)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the quantum numbers after each spin: j after electrons, f1, f2, ..., f after the last nucleus.

        >>> Scheme((Spin("S", 1, True), Spin("14N", 2))).names, Scheme((Spin("Cl1", 3), Spin("Cl2", 3))).names
        (('j', 'f'), ('f1', 'f'))
        """
        electrons = [f"j{i}" if i else "j" for i, spin in enumerate(self.spins) if spin.electron]
        nuclei = len(self.spins) - len(electrons)
        return (*electrons, *(f"f{i + 1}" for i in range(nuclei - 1)), *(["f"] if nuclei else []))

    @property
    def half(self) -> tuple[bool, ...]:
        """Which of them are half-integers."""
        return tuple(bool(total % 2) for total in np.cumsum(self.twice).tolist())

    def place(self, name: str) -> int:
        """The place of a spin by its name."""
        for place, spin in enumerate(self.spins):
            if spin.name == name:
                return place
        raise ValueError(f"spin {name}: the spins here are {', '.join(spin.name for spin in self.spins) or 'none'}")


def scheme_of(top: Top, effects: Sequence[QuantumEffect]) -> Scheme:
    """The spins of all effects, each once, electrons first; ValueError where two effects give one of them another size."""
    found: dict[str, Spin] = {}
    for spin in (spin for effect in effects for spin in effect.spins(top)):
        if found.setdefault(spin.name, spin) != spin:
            raise ValueError(f"spin {spin.name}: given as {found[spin.name].twice}/2 and as {spin.twice}/2")
    return Scheme(tuple(sorted(found.values(), key=lambda spin: not spin.electron)))


def spin_levels(
    top: Top, effects: tuple[QuantumEffect, ...], jmin: int, jmax: int, executor: Executor | None = None
) -> Levels:
    """All levels of a top with spins whose label has N from `jmin` to `jmax`, by n, k or ka, kc, (v), j, f1, ... f.

    Every F that such an N reaches is solved with all its N, so that nothing is left out of a block.
    """
    from rotor.quantum.spin_blocks import levels_of_f

    scheme = scheme_of(top, effects)
    first = max(2 * jmin - scheme.total, scheme.total % 2)
    return levels_of_f(top, effects, range(first, 2 * jmax + scheme.total + 1, 2), (jmin, jmax), executor)


def spin_derivatives(top: Top, levels: Levels, names: Sequence[str], rows: Ints) -> Floats:
    """∂E/∂c of levels with spins, (rows, names)."""
    from rotor.quantum.spin_blocks import derivatives

    return derivatives(top, levels, names, rows)
