"""Levels: adds the terms it is given, diagonalises block by block, labels.

Linear, spherical and symmetric tops have closed forms; asymmetric ones are solved in Wang blocks, each by itself, so
that labels are parity-correct by construction: inside a block, states in order of energy take (Ka, Kc) in order.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.basis import WangBlock, ka_kc, wang_blocks
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.watson import (
    Centrifugal,
    JMatrix,
    Rigid,
    block_bands,
    centrifugal_operators,
    rigid_operators,
    scalar_energy,
)
from rotor.quantum.spherical_top import DIMENSION, scalar_and_tensor, tensor_eigenvalues
from rotor.table import Table
from rotor.tops.operators import Operators
from rotor.tops.spin_weights import SpinWeights

if TYPE_CHECKING:
    from rotor.tops.top import Top


SEMI_RIGID: tuple[QuantumEffect, ...] = (Rigid(), Centrifugal())


@dataclass(frozen=True)
class SolvedBlock:
    """One Wang block solved: energies (n,) in MHz, rising, and eigenvectors (n, n) in columns over `basis.k`.

    `start` is the place of its first state in the arrays of `Levels`.
    """

    basis: WangBlock
    energies_mhz: Floats
    vectors: Floats
    start: int

    @property
    def jz_squared(self) -> Floats:
        """⟨Jz²⟩ of every state, (n,): how prolate (or oblate) it is along the z of the representation."""
        k = self.basis.k
        return np.asarray((self.vectors**2).T @ (k * k).astype(float))


@dataclass(frozen=True)
class Levels(Table):
    """Rotational levels as columns of equal length; the key of a level is (J, block, rank in the block).

    energy_mhz: E/h in MHz from the Hamiltonian's zero. j, ka, kc: quantum numbers; a symmetric top has K in `ka` (one
    row for both signs of K, `components` = 2) and -1 in `kc`, linear and spherical tops -1 in both. components: levels
    that coincide in the row (2J+1 for a spherical top). weight: nuclear-spin weight summed over the components.
    degeneracy: (2J+1) times that. irrep: A1, A2, E, F1 or F2 of the levels into which D_t splits a spherical top, else
    None. representation: of the Wang blocks, None for closed forms. blocks: the solved Wang
    blocks of an asymmetric top, empty for closed forms.
    """

    kind: str
    representation: str | None
    jmax: int
    energy_mhz: Floats
    j: Ints
    ka: Ints
    kc: Ints
    components: Ints
    weight: Ints
    irrep: NDArray[np.str_] | None = None
    blocks: tuple[SolvedBlock, ...] = field(default=(), repr=False)

    def __len__(self) -> int:
        return len(self.energy_mhz)

    @property
    def degeneracy(self) -> Ints:
        """(2J+1) times the spin weight, over all components of the row."""
        return (2 * self.j + 1) * self.weight

    @property
    def ground_mhz(self) -> float:
        """The lowest energy of a level that exists (spin weight above zero)."""
        return float(self.energy_mhz[self.weight > 0].min())

    @property
    def quanta_names(self) -> tuple[str, ...]:
        """Which quantum numbers label a level: j; j, k; or j, ka, kc."""
        if self.kind in ("linear", "spherical"):
            return ("j",)
        return ("j", "ka", "kc") if (self.kc >= 0).any() else ("j", "k")

    def quanta(self, rows: NDArray[Any]) -> Ints:
        """Quantum numbers (n, 1 to 3) of the levels `rows`, in the order of `quanta_names`."""
        columns = (self.j, self.ka, self.kc)[: len(self.quanta_names)]
        return np.stack([column[rows] for column in columns], axis=1)

    def quanta_columns(self, rows: NDArray[Any], suffix: str) -> dict[str, Ints]:
        """The same as columns by name: j_upper, ka_upper, kc_upper for the suffix upper."""
        return {f"{name}_{suffix}": column for name, column in zip(self.quanta_names, self.quanta(rows).T, strict=True)}

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Quantum numbers or irreps, energy_mhz, components, weight and degeneracy, by name."""
        labels = ("j", "ka", "kc") if self.irrep is None else ("j", "irrep")
        names = (*labels, "energy_mhz", "components", "weight", "degeneracy")
        return {name: getattr(self, name) for name in names}


class TransitionTable(Table):
    """What every list of transitions has: the levels that it leads between, and their quantum numbers."""

    levels: Levels

    @property
    def quanta_names(self) -> tuple[str, ...]:
        """Which quantum numbers label a state: j; j, k; or j, ka, kc."""
        return self.levels.quanta_names

    def quanta(self, rows: NDArray[Any]) -> Ints:
        """Quantum numbers (n, 1 to 3) of the states `rows`, such as those above or below each transition."""
        return self.levels.quanta(rows)


def disordered_blocks(top: Top, levels: Levels) -> list[tuple[int, str]]:
    """(J, species) of Wang blocks where the order of energy is not that of the rigid energy ⟨A Ja² + B Jb² + C Jc²⟩.

    There Ka and Kc only count states: distortion has outgrown the rigid energies (quartic-only water from J = 15 on).
    ⟨Jz²⟩ itself (`SolvedBlock.jz_squared`) is not the measure, since it falls by a little near the separatrix of a
    rigid top, where labels are in perfect order.
    """
    out: list[tuple[int, str]] = []
    if not centrifugal_operators(top.constants):  # a rigid top is in order
        return out
    for block in levels.blocks:
        bands = block_bands(JMatrix(rigid_operators(top.constants), block.basis.j), block.basis)
        rigid = _expectations(bands, block.vectors)
        if (np.diff(rigid) < -1e-9 * np.abs(rigid).max()).any():
            out.append((block.basis.j, block.basis.species))
    return out


def _expectations(bands: list[Floats], vectors: Floats) -> Floats:
    """⟨v|H|v⟩ for every column of `vectors`, H given by its diagonals."""
    total = bands[0] @ vectors**2
    for n, band in enumerate(bands[1:], 1):
        total += 2 * (band @ (vectors[:-n] * vectors[n:]))
    return np.asarray(total)


def hamiltonian(top: Top, effects: Sequence[QuantumEffect] = SEMI_RIGID) -> Operators:
    """The operators of all effects added: {(p, q, n): MHz}, zeros left out."""
    total: Operators = {}
    for effect in effects:
        for powers, value in effect.operators(top).items():
            total[powers] = total.get(powers, 0.0) + value
    return {powers: value for powers, value in total.items() if value}


def solve_levels(
    top: Top,
    jmax: int,
    *,
    jmin: int = 0,
    effects: Sequence[QuantumEffect] = SEMI_RIGID,
    vectors: bool = True,
    executor: Executor | None = None,
) -> Levels:
    """All rotational levels from J = `jmin` to `jmax`.

    effects: what the Hamiltonian consists of. vectors: False leaves the eigenvectors of an asymmetric top out.
    executor: any `concurrent.futures.Executor`; J are spread over it. Energies are true eigenvalues of the truncated
    effective Hamiltonian; nothing is treated to first order. Raises ValueError for a J max below zero.

    >>> from rotor.tops.top import Top
    >>> levels = solve_levels(Top.from_constants("A=10 B=6 C=4 MHz"), 1)
    >>> levels.energy_mhz.tolist(), levels.ka.tolist(), levels.kc.tolist()
    ([0.0, 10.0, 16.0, 14.0], [0, 0, 1, 1], [0, 1, 0, 1])
    """
    if jmax < 0 or jmin < 0 or jmin > jmax:
        raise ValueError(f"J from {jmin} to {jmax}: J max must be 0 or more and not below J min")

    operators = hamiltonian(top, effects)
    if top.kind == "asymmetric":
        return _asymmetric(top, operators, jmin, jmax, vectors, executor)
    if top.kind in ("prolate", "oblate"):
        return _symmetric(top.kind, operators, top.spin_weights, jmin, jmax)
    if top.kind == "spherical":
        return _spherical(operators, top.spin_weights, jmin, jmax)
    return _linear(operators, top.spin_weights, jmin, jmax)


def _scalar_energies(operators: Operators, jmin: int, jmax: int) -> tuple[Ints, Floats]:
    j = np.arange(jmin, jmax + 1)
    return j, np.array([scalar_energy(operators, int(value)) for value in j])


def _linear(operators: Operators, weights: SpinWeights, jmin: int, jmax: int) -> Levels:
    """Linear tops: E = Σ c X^p."""
    j, energy = _scalar_energies(operators, jmin, jmax)
    none = np.full(j.shape, -1)
    return Levels("linear", None, jmax, energy, j, none, none, np.ones_like(j), weights.of_j(j))


def _spherical(operators: Operators, weights: SpinWeights, jmin: int, jmax: int) -> Levels:
    """Spherical tops: E = Σ c X^p in one row of 2J+1 components, or, with D_t, a row for every level that it splits."""
    scalars, dt = scalar_and_tensor(operators)
    j, energy = _scalar_energies(scalars, jmin, jmax)
    if not dt:
        none = np.full(j.shape, -1)
        return Levels("spherical", None, jmax, energy, j, none, none, 2 * j + 1, weights.of_spherical(j))

    split = [tensor_eigenvalues(int(value), 1 if dt > 0 else -1) for value in j]
    sizes = [len(irreps) for irreps, _ in split]
    irreps = np.concatenate([irreps for irreps, _ in split])
    none = np.full(irreps.shape, -1)
    return Levels(
        kind="spherical",
        representation=None,
        jmax=jmax,
        energy_mhz=np.repeat(energy, sizes) + dt * np.concatenate([omega for _, omega in split]),
        j=np.repeat(j, sizes),
        ka=none,
        kc=none,
        components=np.array([DIMENSION[irrep] for irrep in irreps]),
        weight=np.array([weights.of_irrep(irrep) for irrep in irreps]),
        irrep=irreps,
    )


def _symmetric(kind: str, operators: Operators, weights: SpinWeights, jmin: int, jmax: int) -> Levels:
    """Symmetric tops: E(J, K) = Σ c X^p K^2q, one row for ±K."""
    j = np.repeat(np.arange(jmin, jmax + 1), np.arange(jmin, jmax + 1) + 1)
    k = np.concatenate([np.arange(value + 1) for value in range(jmin, jmax + 1)])
    x, squares = (j * (j + 1)).astype(float), (k * k).astype(float)
    energy = np.zeros(j.shape)
    for (p, q, _), c in operators.items():
        energy += c * x**p * squares**q

    components = np.where(k == 0, 1, 2)
    weight = weights.of_symmetric(j, k, oblate=kind == "oblate")
    return Levels(kind, None, jmax, energy, j, k, np.full(j.shape, -1), components, weight)


def _asymmetric(
    top: Top, operators: Operators, jmin: int, jmax: int, vectors: bool, executor: Executor | None
) -> Levels:
    pieces = [(operators, j, str(top.constants.representation), vectors) for j in range(jmin, jmax + 1)]
    solved = executor.map(solve_j, *zip(*pieces, strict=True)) if executor else (solve_j(*piece) for piece in pieces)
    blocks = tuple(_placed(block for of_one_j in solved for block in of_one_j))

    labels = [ka_kc(b.basis.j, b.basis.species, b.basis.size) for b in blocks]
    sizes = [b.basis.size for b in blocks]
    weight = np.repeat([top.spin_weights.of_ka_kc(b.basis.species) for b in blocks], sizes)
    return Levels(
        kind="asymmetric",
        representation=str(top.constants.representation),
        jmax=jmax,
        energy_mhz=np.concatenate([b.energies_mhz for b in blocks]),
        j=np.repeat([b.basis.j for b in blocks], sizes),
        ka=np.concatenate([ka for ka, _ in labels]),
        kc=np.concatenate([kc for _, kc in labels]),
        components=np.ones(sum(sizes), dtype=np.int64),
        weight=weight,
        blocks=blocks if vectors else (),
    )


def _placed(solved: Iterator[tuple[WangBlock, Floats, Floats]]) -> Iterator[SolvedBlock]:
    start = 0
    for basis, energies, vectors in solved:
        yield SolvedBlock(basis, energies, vectors, start)
        start += basis.size


def solve_j(
    operators: Operators, j: int, representation: str, vectors: bool = True
) -> list[tuple[WangBlock, Floats, Floats]]:
    """The Wang blocks of one J solved: (block, energies in MHz, eigenvectors) in the order ee, eo, oe, oo."""
    scalar, multiplet = scalar_energy(operators, j), JMatrix(operators, j)
    out = []
    for block in wang_blocks(j, representation):
        energies, states = diagonalise(block_bands(multiplet, block), vectors)
        out.append((block, energies + scalar, states))
    return out


def diagonalise(bands: list[Floats], vectors: bool = True) -> tuple[Floats, Floats]:
    """Eigenvalues, rising, and eigenvectors in columns of a symmetric matrix given by its diagonals.

    Tridiagonal matrices go to LAPACK's divide and conquer (dstevd), wider ones to its dense form (dsyevd).
    Raises ValueError where LAPACK does not converge or the matrix has numbers that are not finite.
    """
    if len(bands[0]) == 1:
        return bands[0], np.ones((1, 1))
    if not all(np.isfinite(band).all() for band in bands):
        raise ValueError("a block of the Hamiltonian overflows: J max is too high for these distortion constants")
    if len(bands) > 2:
        return _dense(bands, vectors)
    if len(bands) == 1:
        return _diagonal(bands[0], vectors)

    from scipy.linalg.lapack import dstevd

    energies, states, info = dstevd(bands[0], bands[1], compute_v=int(vectors))
    if info:
        raise ValueError(f"LAPACK dstevd did not converge on a block of size {len(bands[0])} (info = {info})")
    return energies, states


def _diagonal(band: Floats, vectors: bool) -> tuple[Floats, Floats]:
    order = np.argsort(band, kind="stable")
    return band[order], np.eye(len(band))[:, order] if vectors else np.zeros((0, 0))


def _dense(bands: list[Floats], vectors: bool) -> tuple[Floats, Floats]:
    matrix = np.diag(bands[0])
    for n, band in enumerate(bands[1:], 1):
        matrix += np.diag(band, -n)  # eigh reads the lower triangle
    if not vectors:
        return np.asarray(np.linalg.eigvalsh(matrix), dtype=np.float64), np.zeros((0, 0))
    solved = np.linalg.eigh(matrix)
    return np.asarray(solved.eigenvalues, dtype=np.float64), np.asarray(solved.eigenvectors, dtype=np.float64)
