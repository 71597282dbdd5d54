"""Chosen levels and their derivatives for constants that change: what a fit asks for, again and again.

A model is made once for the labels that occur. Linear, spherical and symmetric tops have E = Σ c x(label): the derivatives are
a constant matrix. An asymmetric top is solved in those Wang blocks alone in which a label lies; a block is a sum of unit
matrices ½[Jz^2q, J₊^2n + J₋^2n]₊ X^p made once, for all blocks side by side, so that new constants cost one LAPACK call a block
and

    ∂E_i/∂c = ⟨i|∂H/∂c|i⟩ = Σ_d (2 - δ_d0) Σ_K v_K v_K+2d U_d(K)

over the diagonals d of each unit matrix U, all states of many blocks at once. A label is (J, block, rank in the order of energy),
so that it never changes its state by accident; `overlaps` says where a state has become another.
"""

from __future__ import annotations

import os
import sys
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import field
from functools import cached_property

import numpy as np

from rotor.arrays import Floats, Ints, Workspace
from rotor.frozen import dataclass
from rotor.quantum.effects.watson import operators_by_name
from rotor.quantum.label_blocks import Chunk, chunks_of, occurring_blocks
from rotor.quantum.solvers.tridiagonal import vectors_of_values
from rotor.quantum.wang.turn import order_beyond_the_turn, turned
from rotor.quantum.wang.unit_diagonals import expectations
from rotor.table import with_article
from rotor.tops.constants import Constants
from rotor.tops.operators import REPRESENTATIONS

AT_ZERO_MHZ = 1e-30  # in place of 0: a free constant that starts there must not be left out of the Hamiltonian


class MissingLevelsError(ValueError):
    """Labels that no level has: their places (n,) among those asked for."""

    def __init__(self, text: str, places: Ints) -> None:
        super().__init__(text)
        self.places = places


class LevelModel(ABC):
    """Energies of labelled levels as a function of constants.

    names : the constants, in the order in which values are given and derivatives come
    """

    names: tuple[str, ...]

    @abstractmethod
    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """Energies (levels,) in MHz and their derivatives (levels, names) at constants (names,) in MHz."""

    def overlaps(self, before_mhz: Floats, after_mhz: Floats) -> Floats:
        """|⟨before|after⟩|² (levels,) of each labelled state at two sets of constants; 1 where vectors do not depend on them."""
        return np.ones(len(self.levels(after_mhz)[0]))


def level_model(constants: Constants, labels: Ints, *, kmax: int | None = None) -> LevelModel:
    """The model for the labels (levels, 1 to 3): J; J, K; or J, Ka, Kc, after the kind of the constants, whose values do not count.

    kmax: basis states of an asymmetric top with K above it are left out, as SPFIT's KNMAX does. Raises MissingLevelsError for labels that
    no level has, and ValueError for tetrahedral splittings of a spherical top.
    """
    labels = np.atleast_2d(np.asarray(labels, dtype=np.int64))
    width = {"linear": 1, "spherical": 1, "prolate": 2, "oblate": 2}.get(constants.kind, 3)
    if labels.shape[1] != width:
        what = {1: "J", 2: "J, K", 3: "J, Ka, Kc"}[width]
        raise ValueError(
            f"{labels.shape[1]} quantum numbers for each state; {with_article(constants.kind)} top has {what}"
        )
    _refuse_labels(constants.kind, labels)
    if constants.kind == "asymmetric":
        return WangLevels.from_labels(constants, labels, kmax)
    if "Dt" in constants.values:
        raise ValueError(
            "D_t splits the levels of a spherical top, which J alone does not label; it cannot be fitted here"
        )
    return ClosedForm.from_labels(constants, labels)


def _refuse_labels(kind: str, labels: Ints) -> None:
    bad = labels[:, 0] < 0
    rule = "J is 0 or more"
    if kind in ("prolate", "oblate"):
        bad, rule = bad | (np.abs(labels[:, 1]) > labels[:, 0]), "|K| is at most J"
    if kind == "asymmetric":
        j, ka, kc = labels.T
        bad = bad | (ka < 0) | (kc < 0) | ((ka + kc != j) & (ka + kc != j + 1)) | (ka > j) | (kc > j)
        rule = "Ka and Kc run from 0 to J and add up to J or J + 1"
    if bad.any():
        first = " ".join(map(str, labels[np.argmax(bad)].tolist()))
        raise MissingLevelsError(f"there is no level {first}: {rule}", np.flatnonzero(bad))


@dataclass(frozen=True)
class ClosedForm(LevelModel):
    """E = slopes @ values: linear, spherical and symmetric tops, and diagonal elements over fixed functions."""

    names: tuple[str, ...]
    slopes: Floats

    @classmethod
    def from_labels(cls, constants: Constants, labels: Ints) -> ClosedForm:
        """Σ c X^p K^2q of every named constant."""
        by_name = operators_by_name(constants)
        x = (labels[:, 0] * (labels[:, 0] + 1)).astype(float)
        k = labels[:, 1].astype(float) if labels.shape[1] > 1 else np.zeros(len(labels))
        columns = [
            sum((factor * x**p * k ** (2 * q) for (p, q, _), factor in terms.items()), np.zeros(len(labels)))
            for terms in by_name.values()
        ]
        return cls(tuple(by_name), np.stack(columns, axis=1))

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """See `LevelModel`."""
        return self.slopes @ values_mhz, self.slopes


@dataclass(frozen=True)
class WangLevels(LevelModel):
    """An asymmetric top, the blocks that occur.

    rise: 1 where energies rise with K (z is a), -1 where they fall (c), 0 where neither (b)
    terms: unique (q, n) but for (0, 0); powers: p, (q, n) as a place in `terms` or -1, of every column of factors (terms of the
    Hamiltonian, names)
    """

    names: tuple[str, ...]
    count: int
    powers: tuple[tuple[int, int], ...]
    factors: Floats
    chunks: tuple[Chunk, ...] = field(repr=False)
    j: Ints = field(repr=False)
    rise: int

    @classmethod
    def from_labels(cls, constants: Constants, labels: Ints, kmax: int | None) -> WangLevels:
        """The model for labels (J, Ka, Kc) of a set of constants."""
        by_name = operators_by_name(constants)
        hamiltonian = sorted({powers for terms in by_name.values() for powers in terms})
        units = sorted({(q, n) for _, q, n in hamiltonian if q or n})
        factors = np.array([[terms.get(powers, 0.0) for terms in by_name.values()] for powers in hamiltonian])
        places = tuple((p, units.index((q, n)) if q or n else -1) for p, q, n in hamiltonian)
        chunks = tuple(
            chunks_of(
                occurring_blocks(labels, str(constants.representation), kmax), units, [p for p, _, _ in hamiltonian]
            )
        )
        axis = REPRESENTATIONS[str(constants.representation)][2]
        rise = {"a": 1, "c": -1}.get(axis, 0)
        return cls(tuple(by_name), len(labels), places, factors, chunks, labels[:, 0], rise)

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """See `LevelModel`. Raises ValueError where a block is not finite or LAPACK does not converge."""
        coefficients = self.factors @ values_mhz
        energies, slopes = np.empty(self.count), np.empty((self.count, len(self.names)))
        places = [place for _, place in self.powers]  # that of a scalar is -1, the column of ones
        for chunk in self.chunks:
            solved, vectors = self._labelled(chunk, coefficients)
            energies[chunk.rows] = solved[chunk.block, chunk.rank]
            expected = np.ones((len(chunk.rows), chunk.units[0].shape[2] + 1))
            means = expectations(chunk.units, vectors, self._space)
            expected[:, :-1] = means[chunk.block, chunk.rank if chunk.states is None else chunk.slot]
            slopes[chunk.rows] = (expected[:, places] * chunk.powers) @ self.factors
        alone = [i for i, place in enumerate(places) if place < 0]
        for chunk in self.chunks:
            energies[chunk.rows] += chunk.powers[:, alone] @ coefficients[alone]
        return energies, slopes

    def overlaps(self, before_mhz: Floats, after_mhz: Floats) -> Floats:
        """See `LevelModel`."""
        out = np.empty(self.count)
        for chunk in self.chunks:
            both = []
            for values in (before_mhz, after_mhz):
                both.append(self._solved(chunk, self.factors @ values)[1][chunk.block, :, chunk.rank])
            out[chunk.rows] = np.einsum("lk,lk->l", *both) ** 2
        return out

    def _solved(self, chunk: Chunk, coefficients: Floats) -> tuple[Floats, Floats]:
        """Eigenvalues (blocks, size) and eigenvectors (blocks, size, size) with the coefficients of the terms, in the order of labels."""
        bands = self._bands(chunk, coefficients)
        return self._in_order(chunk, bands, self._turned(chunk, bands))

    def _turned(self, chunk: Chunk, bands: Sequence[Floats]) -> tuple[Ints, Ints] | None:
        """Which blocks turn and where, see `turn`; None where there are none."""
        turned_order = turned(self.rise * bands[0], chunk.sizes) if self.rise else None
        return turned_order if turned_order is not None and len(turned_order[0]) else None

    def _in_order(self, chunk: Chunk, bands: Sequence[Floats], turn: tuple[Ints, Ints] | None) -> tuple[Floats, Floats]:
        energies, vectors = _diagonalised(bands, chunk, self._space)
        if turn is not None:
            order_beyond_the_turn(turn, chunk.sizes, energies, vectors)
        return energies, vectors

    def _labelled(self, chunk: Chunk, coefficients: Floats) -> tuple[Floats, Floats]:
        """Eigenvalues (blocks, size), and the eigenvectors of the labelled states (blocks, size, most labels), or of all states."""
        bands, states = self._bands(chunk, coefficients), chunk.states
        turn = self._turned(chunk, bands)
        if states is None:
            return self._in_order(chunk, bands, turn)
        if len(bands) == 2 and _dense() and turn is None:
            energies = _banded(bands, chunk, self._space)
            by_recursion = vectors_of_values(bands[0], bands[1], energies, chunk.block, chunk.rank, self._space)
            if by_recursion is not None:
                chosen = self._space.array("chosen", len(states), len(by_recursion), states.shape[1])
                chosen.fill(0.0)
                chosen.transpose(1, 0, 2)[:, chunk.block, chunk.slot] = by_recursion
                return energies, chosen
        energies, vectors = self._in_order(chunk, bands, turn)
        count, size, most = len(vectors), vectors.shape[1], states.shape[1]
        rows = size * size * np.arange(count)[:, None, None] + size * np.arange(size)[:, None]
        chosen = self._space.array("chosen", count, size, most)
        return energies, vectors.ravel().take(rows + states[:, None, :], out=chosen, mode="clip")

    def _bands(self, chunk: Chunk, coefficients: Floats) -> list[Floats]:
        """Diagonals (blocks, size) of the Hamiltonian."""
        weights = (chunk.x * coefficients) @ self._unit_of_term
        bands = [(unit @ weights[:, :, None])[:, :, 0] for unit in chunk.units]
        if not all(np.isfinite(band.sum()) for band in bands):
            raise ValueError("a block of the Hamiltonian is not finite with these constants")
        return bands

    @cached_property
    def _unit_of_term(self) -> Floats:
        """1 where a term of the Hamiltonian has a unit matrix, (terms, units)."""
        places = np.array([place for _, place in self.powers])
        return np.asarray(places[:, None] == np.arange(1 + max(places.max(initial=-1), -1)), dtype=float)

    @cached_property
    def _space(self) -> Workspace:
        return Workspace()


def _diagonalised(bands: Sequence[Floats], chunk: Chunk, space: Workspace) -> tuple[Floats, Floats]:
    """Eigenvalues (blocks, size), rising, and eigenvectors (blocks, size, size) in columns, padded with zeros."""
    count, size = bands[0].shape
    vectors, least = space.array("vectors", count, size, size), chunk.sizes[0]
    vectors[:, least:, :] = vectors[:, :, least:] = 0.0
    if len(bands) <= 2 and not _dense():
        energies = np.zeros((count, size))
        _tridiagonal(bands, chunk.sizes, energies, vectors)
        return energies, vectors
    return _banded(bands, chunk, space, vectors), vectors


def _dense() -> bool:
    """Whether tridiagonal blocks too are solved by numpy's dense routine: where scipy.linalg is not loaded.

    Loading it takes as long as 500 iterations of a fit to 5,000 lines gain by it. Only where BLAS has one thread: several of them wait for
    each other on small blocks.
    """
    return "scipy.linalg" not in sys.modules and os.environ.get("OPENBLAS_NUM_THREADS") == "1"


def _tridiagonal(bands: Sequence[Floats], sizes: Sequence[int], energies: Floats, vectors: Floats) -> None:
    from scipy.linalg.lapack import dstevd

    diagonal, beside = bands[0], bands[1] if len(bands) == 2 else np.zeros_like(bands[0])
    for b, n in enumerate(sizes):
        if n == 1:
            energies[b, 0], vectors[b, 0, 0] = diagonal[b, 0], 1.0
            continue
        eigenvalues, states, info = dstevd(diagonal[b, :n], beside[b, : n - 1])
        if info:
            raise ValueError(f"LAPACK dstevd did not converge on a block of size {n} (info = {info})")
        energies[b, :n] = eigenvalues
        vectors[b, :n, :n] = states


def _banded(bands: Sequence[Floats], chunk: Chunk, space: Workspace, vectors: Floats | None = None) -> Floats:
    """Eigenvalues, infinite beyond a block, by LAPACK's dense routine, which reads the lower triangle; blocks of one size at a time.

    Eigenvectors are put into `vectors` where it is given; without them it takes a third of the time.
    """
    energies, whole = np.full(bands[0].shape, np.inf), space.array("matrices", int(chunk.offsets[-1]))
    whole.fill(0.0)
    for band, (inside, places) in zip(bands, chunk.bands, strict=False):
        whole[places] = band.take(inside)
    for first, stop, n in chunk.runs:
        matrices = whole[chunk.offsets[first] : chunk.offsets[stop]].reshape(stop - first, n, n)
        if vectors is None:
            energies[first:stop, :n] = np.linalg.eigvalsh(matrices)
        else:
            energies[first:stop, :n], vectors[first:stop, :n, :n] = np.linalg.eigh(matrices)
    return energies
