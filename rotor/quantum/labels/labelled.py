"""Labelled levels and their derivatives as functions of the constants, for fits.

Linear, spherical and symmetric tops have E = Σ c x(label), with constant derivatives. An asymmetric top is solved in the Wang blocks that
contain a label, side by side (`linear_stacks`). A label is (J, block, rank by energy); `overlaps` tells where its state has changed.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints, Workspace, distinct, numbers_in_runs
from rotor.frozen import dataclass
from rotor.quantum.basis.state_elements import StateTerms, wang_stacks
from rotor.quantum.blocks.linear_stacks import LinearStack, numbered
from rotor.quantum.effects.watson import operators_by_name
from rotor.quantum.wang.basis import SPECIES, WangBlock, names_of_blocks, wang_blocks
from rotor.quantum.wang.wang_matrix import diagonal_elements
from rotor.table import with_article
from rotor.tops.constants.constants import Constants
from rotor.tops.constants.operators import REPRESENTATIONS

AT_ZERO_MHZ = 1e-30  # in place of 0: a free constant that starts there must not be left out of the Hamiltonian


class MissingLevelsError(ValueError):
    """Labels that no level has. places: (n,) among all labels."""

    def __init__(self, text: str, places: Ints) -> None:
        super().__init__(text)
        self.places = places


class LevelModel(ABC):
    """Energies of labelled levels as a function of constants, which have the order of `names`."""

    names: tuple[str, ...]

    @abstractmethod
    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """Energies (levels,) in MHz and their derivatives (levels, names) at constants (names,) in MHz."""

    def overlaps(self, before_mhz: Floats, after_mhz: Floats) -> Floats:
        """|⟨before|after⟩|² (levels,) of each labelled state at two sets of constants; a single 1 where labels follow their states."""
        return np.ones(1)


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
        return RankedLevels.from_labels(constants, labels, kmax)
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
        j, k = labels[:, 0], labels[:, 1] if labels.shape[1] > 1 else np.zeros_like(labels[:, 0])
        columns = [diagonal_elements(terms, j, k) for terms in by_name.values()]
        return cls(tuple(by_name), np.stack(columns, axis=1))

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """See `LevelModel`."""
        return self.slopes @ values_mhz, self.slopes


class _Labels(NamedTuple):
    """Wang blocks of similar size side by side. rows, states: of the labels, (blocks, labels); padded rows follow the last."""

    stack: LinearStack
    rows: Ints
    states: Ints


@dataclass(frozen=True)
class RankedLevels(LevelModel):
    """An asymmetric top, the Wang blocks in which labels lie; a label is a rank in its block.

    rise: 1 where energies rise with K (z is a), -1 where they fall (c), 0 where neither (b)
    """

    names: tuple[str, ...]
    count: int
    rise: int
    parts: tuple[_Labels, ...] = field(repr=False)

    @classmethod
    def from_labels(cls, constants: Constants, labels: Ints, kmax: int | None) -> RankedLevels:
        """The model for labels (J, Ka, Kc) of a set of constants."""
        by_name, representation = operators_by_name(constants), str(constants.representation)
        terms = StateTerms.from_operators([0], [(0, i, powers) for i, powers in enumerate(by_name.values())], ())
        blocks, number, rank = _blocks_of_labels(labels, representation, kmax)
        order, counts = np.argsort(number, kind="stable"), np.bincount(number)
        shape, places = (len(blocks), counts.max(initial=0)), numbers_in_runs(counts)
        rows, states = np.full(shape, len(labels)), np.zeros(shape, dtype=np.int64)
        rows[places], states[places] = order, rank[order]
        parts = []
        for numbers, stack in wang_stacks(blocks, terms, len(by_name)):
            most = counts[numbers].max()
            parts.append(_Labels(stack, rows[numbers, :most], states[numbers, :most]))
        axis = REPRESENTATIONS[representation][2]
        return cls(tuple(by_name), len(labels), {"a": 1, "c": -1}.get(axis, 0), tuple(parts))

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """See `LevelModel`. Raises ValueError where a block is not finite or LAPACK does not converge."""
        energies, slopes = np.empty(self.count + 1), np.empty((self.count + 1, len(self.names)))
        vectors = []
        for part in self.parts:
            solved, chosen = self._solved(part, values_mhz)
            energies[part.rows] = np.take_along_axis(solved, part.states, axis=1)
            slopes[part.rows] = part.stack.slopes(chosen, None, self._space)
            vectors.append(chosen)
        if len(self._vectors) > 1:
            self._vectors.popitem()  # the last one
        self._vectors[values_mhz.tobytes()] = vectors
        return energies[:-1], slopes[:-1]

    def overlaps(self, before_mhz: Floats, after_mhz: Floats) -> Floats:
        """See `LevelModel`."""
        both, out = list[list[Floats]](), np.empty(self.count + 1)
        for values in (before_mhz, after_mhz):
            if values.tobytes() not in self._vectors:
                self.levels(values)
            both.append(self._vectors[values.tobytes()])
        for part, before, after in zip(self.parts, *both, strict=True):
            out[part.rows] = np.einsum("bks,bks->bs", before, after) ** 2
        return out[:-1]

    def _solved(self, part: _Labels, values_mhz: Floats) -> tuple[Floats, Floats]:
        """Energies (blocks, size) in the order of labels, and vectors (blocks, size, labels)."""
        stack = part.stack
        matrices, zero = stack.assembled(values_mhz, self._space)
        turning = turned(self.rise * stack.diagonals(matrices), stack.sizes)
        few = None if len(turning[0]) else stack.few_states(part.states, matrices, zero, self._space)
        if few is not None:
            return few
        energies, vectors = stack.all_states(matrices, zero, self._space)
        order_beyond_the_turn(turning, stack.sizes, energies, vectors)
        return energies, np.take_along_axis(vectors, part.states[:, None, :], axis=2)

    @cached_property
    def _vectors(self) -> dict[bytes, list[Floats]]:
        """Those of the labelled states at the first and at the last values, which a fit compares."""
        return {}

    @cached_property
    def _space(self) -> Workspace:
        return Workspace()


def _blocks_of_labels(labels: Ints, representation: str, kmax: int | None) -> tuple[list[WangBlock], Ints, Ints]:
    """The Wang blocks of the labels, cut at the highest K; block and rank in it of each label."""
    j, ka, kc = labels.T
    occurring, number = numbered(4 * j + 2 * (ka % 2) + kc % 2, 4 * int(j.max(initial=0)) + 4)
    whole = {j: {block.species: block for block in wang_blocks(j, representation)} for j in distinct(j).tolist()}
    blocks = [whole[key // 4][SPECIES[key % 4]] for key in occurring.tolist()]
    if kmax is not None:
        blocks = [block._replace(size=min(block.size, max(0, (kmax - block.first_k) // 2 + 1))) for block in blocks]
    lowest, sizes = names_of_blocks(blocks, [1] * len(blocks), representation)[0], np.array([b.size for b in blocks])
    rank = (ka - lowest[number]) // 2
    missing = np.flatnonzero((rank < 0) | (rank >= sizes[number]))
    if len(missing):
        label = " ".join(map(str, labels[missing[0]].tolist()))
        raise ValueError(f"level {label} is not among the states with K up to {kmax}; raise KNMAX")
    return blocks, number, rank


def turned(diagonal: Floats, sizes: Ints) -> tuple[Ints, Ints]:
    """Numbers of the blocks whose diagonal has its maximum (the turn) before the end, and the place of the maximum in each block."""
    turn = np.where(np.arange(diagonal.shape[1]) < sizes[:, None], diagonal, -np.inf).argmax(axis=1)
    return np.flatnonzero((turn > 0) & (turn < sizes - 1)), turn


def order_beyond_the_turn(turning: tuple[Ints, Ints], sizes: Ints, energies: Floats, vectors: Floats) -> None:
    """Move states beyond the turn of the diagonal to the end of their block, ordered by mean K, in place.

    Constants that describe K up to 20 may shift states of K = 60 down among lower K, where the distortion series diverges. These states are
    mostly beyond the turn; the other states are labelled by rank among themselves. turning: from `turned`, for the diagonals with the sign
    that makes them rise in a molecule. energies (blocks, size) rise; vectors (blocks, size, size) stand in columns.
    """
    blocks, turn = turning
    for b in blocks.tolist():
        n = sizes[b]
        share = vectors[b, :n, :n] ** 2
        beyond = share[turn[b] + 1 :].sum(axis=0) > 0.5
        order = np.lexsort((np.where(beyond, np.arange(n) @ share, 0.0), beyond))
        energies[b, :n] = energies[b, order]
        vectors[b, :n, :n] = vectors[b, :n, order].T
