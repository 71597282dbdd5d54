"""The table of levels: energies, named quantum numbers, degeneracies, and the solved blocks behind them.

What a level is called is in `Levels.quanta` alone; how many states it holds, in `multiplicity`, `components` and `weight`.
Nothing outside this folder computes a row from quantum numbers: `Levels.find` and `Levels.rows_of` do.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats, Ints, matching_rows
from rotor.frozen import dataclass
from rotor.quantum.labels.quanta import labels as texts_of_labels
from rotor.quantum.wang.basis import Part, WangBlock
from rotor.table import Table
from rotor.tops.spins.spin_weights import SpinWeights

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top


@dataclass(frozen=True)
class Used:
    """The method of a calculation, and by how much its lines may differ from exact ones, in MHz."""

    method: str
    estimate_mhz: float
    tolerance_mhz: float


class SpeciesFunctions(NamedTuple):
    """Functions of a block of one species: J (N beside spins), the number of the block in the species, and its place among those of J.

    size: functions of a part beside spins, where each state of the block is one.
    """

    j: int
    number: int
    place: int
    size: int = 1


@dataclass(frozen=True, eq=False)
class SolvedBlock:
    """States solved together over Wang blocks of one J, functions |N K⟩, of a species of internal rotation, or with spins.

    energies (n,) in MHz, rising, and eigenvectors (functions, n) in columns. parts: the state v and the functions of each range of rows;
    those of the rotation beside spins have the names of these too, those of a species are its states there. start: place of the first
    state in the arrays of `Levels`. labels: of states of coupled blocks v, Ka, Kc (n, 3); with spins v (of a species the row of a level),
    Ka (K if axial), Kc and the doubled pattern N, J ... F, (n, 3 + pattern). mixing: (n,) squared overlaps with the functions that name
    them. moments: `TorsionMoments` of a species without spins, else None; components: 2 where its
    states σ and -σ coincide. spins: the functions of a block of one F (`spins.blocks.SpinFunctions`), which has no other parts. Functions
    of a coupled block carry the factor of `wang.basis.phase`, those of a Wang block without labels do not.
    """

    parts: tuple[Any, ...]
    energies_mhz: Floats
    vectors: Floats
    start: int = 0
    labels: Ints | None = None
    mixing: Floats | None = None
    moments: Any = None
    components: int = 1
    spins: Any = None

    @property
    def basis(self) -> Any:
        """The Wang block, of a block of a single one, or the functions of a species."""
        return self.parts[0].basis

    @property
    def j(self) -> int:
        """J, or N beside spins."""
        return int(self.parts[0].basis.j)

    @property
    def twice_total(self) -> int:
        """Twice the total angular momentum: 2J, with spins 2F."""
        if self.spins is not None:
            return int(self.spins.twice_f)
        return 2 * self.j

    @property
    def axial_k(self) -> int | None:
        """|K| where levels with spins have a good K, else None."""
        return None if self.spins is None else self.spins.axial_k

    @property
    def combined(self) -> bool:
        """Whether functions of K and -K are combined, so that reduced elements of odd rank are i times real."""
        moments = self.moments if self.spins is None else self.spins.rotor.moments
        return self.axial_k is None if moments is None else moments.combined

    @property
    def paired(self) -> bool:
        """Whether states stand for their mirror images too: K and -K, σ and -σ."""
        return bool(self.axial_k) or self.components > 1

    @property
    def alone(self) -> bool:
        """Whether it is a Wang block that nothing couples with others."""
        return self.labels is None and self.moments is None


Mixtures = Sequence[tuple[SolvedBlock, NDArray[Any]]]
"""Blocks of one J, and coefficients (states, p, n) of their states in n mixtures, sums over p of squares of functions."""

Connections = tuple[list[tuple[SolvedBlock, SolvedBlock]], Callable[[SolvedBlock, SolvedBlock], Floats]]
"""Pairs of blocks that an operator connects, and the function that returns the reduced elements between them."""


def placed(blocks: Iterable[SolvedBlock]) -> Iterator[SolvedBlock]:
    """Blocks that have states, with the row of the first state of each."""
    start = 0
    for block in blocks:
        if len(block.energies_mhz):
            yield block if block.start == start else replace(block, start=start)
            start += len(block.energies_mhz)


def single_block(basis: WangBlock, energies_mhz: Floats, vectors: Floats, start: int) -> SolvedBlock:
    """A Wang block solved by itself."""
    return SolvedBlock((Part(0, basis, 0),), energies_mhz, vectors, start)


@dataclass(frozen=True, eq=False)
class Levels(Table):
    """Energy levels as columns of equal length.

    kind: of the top. representation: of the Wang functions, None for closed forms. jmax: the highest rotational angular
    momentum in the basis. energy_mhz: E/h in MHz from the Hamiltonian's zero. quanta: the quantum numbers that the case
    has, by name (see `rotor.quantum.labels.quanta`); a symmetric top has one row for both signs of K, linear and spherical tops
    have j alone. multiplicity: states of one component that differ in their projection in space, 2J+1 (2F+1 with spins, 1 where M
    is resolved). components: levels that coincide in the row (2 for ±K, 2J+1 for a spherical top). weight:
    nuclear-spin weight summed over the components. halves: names whose column holds twice the quantum number.
    effects: what the Hamiltonian consists of. blocks: the solved blocks, empty for closed forms and without vectors.
    mixing: share (n,) of the function that names a level, where blocks of different species or states are mixed.
    """

    kind: str
    representation: str | None
    jmax: int
    energy_mhz: Floats
    quanta: dict[str, NDArray[Any]]
    multiplicity: Ints
    components: Ints
    weight: Ints
    halves: frozenset[str] = frozenset()
    effects: tuple[QuantumEffect, ...] = ()
    blocks: tuple[SolvedBlock, ...] = field(default=(), repr=False)
    mixing: Floats | None = None

    def __len__(self) -> int:
        return len(self.energy_mhz)

    def __repr__(self) -> str:
        if not len(self):
            return f"Levels({self.kind}, none)"
        low, high = self.energy_mhz.min(), self.energy_mhz.max()
        return f"Levels({self.kind}, {len(self)} by {', '.join(self.quanta)}; {low:.4f} to {high:.4f} MHz)"

    @property
    def quanta_names(self) -> tuple[str, ...]:
        """Which quantum numbers label a level: j; j, k; j, ka, kc; ..."""
        return tuple(self.quanta)

    @property
    def has_named_constants(self) -> bool:
        """Whether the constants of the top make the levels; those of an .int file may have codes alone."""
        return all(effect.name for effect in self.effects)

    @property
    def provenance(self) -> dict[str, Any]:
        """The Hamiltonian that the levels are of, and how far they go."""
        return {
            "kind": self.kind,
            "representation": self.representation,
            "jmax": self.jmax,
            "effects": [effect.name or type(effect).__name__ for effect in self.effects],
            "rows": len(self),
        }

    @property
    def degeneracy(self) -> Ints:
        """States of the row, projections in space and components, each with its nuclear-spin weight."""
        return self.multiplicity * self.weight

    @property
    def states(self) -> Ints:
        """States of the row without nuclear-spin weights: projections in space times components."""
        return self.multiplicity * self.components

    @cached_property
    def weight_per_component(self) -> Floats:
        """Nuclear-spin weight of one component, (n,), its mean where components differ."""
        return np.asarray(self.weight / self.components)

    @property
    def shares(self) -> Floats:
        """`mixing`, 1 where no blocks are mixed, (n,)."""
        return np.ones(len(self)) if self.mixing is None else self.mixing

    @property
    def ground_mhz(self) -> float:
        """The lowest energy of a level that exists (spin weight above zero)."""
        return float(self.energy_mhz[self.weight > 0].min())

    @property
    def rotational(self) -> Ints:
        """The rotational angular momentum of every level: n where spins are coupled to it, else j."""
        return np.asarray(self.quanta["n" if "n" in self.quanta else "j"])

    def find(self, **quanta: int | str) -> int:
        """The row of the level with these quantum numbers, all of them named.

        Raises ValueError for a missing or unknown name, and for a level that is not in the table.

        >>> from rotor.quantum.solve import solve_levels
        >>> from rotor.tops.top import Top
        >>> solve_levels(Top.from_constants("A=10 B=6 C=4 MHz"), 4).find(j=4, ka=1, kc=3)
        23
        """
        self._refuse_names(quanta)
        here = np.logical_and.reduce([self.quanta[name] == value for name, value in quanta.items()])
        if not here.any():
            label = ", ".join(f"{name} = {value}" for name, value in quanta.items())
            total = "N" if "n" in self.quanta else "J"
            raise ValueError(f"no level with {label} among {len(self)} levels up to {total} = {self.jmax}")
        return int(here.argmax())

    def rows_of(self, **quanta: ArrayLike) -> Ints:
        """Rows of the levels with these quantum numbers, arrays (n,) by name; -1 where there is none.

        Raises ValueError where not all the names that label a level are given, or others.
        """
        self._refuse_names(quanta)
        shape = np.shape(next(iter(quanta.values())))
        keys = [np.ravel(np.asarray(quanta[name])) for name in self.quanta]
        return matching_rows(list(self.quanta.values()), keys).reshape(shape)

    def _refuse_names(self, quanta: Collection[str]) -> None:
        """ValueError unless these are the names that label a level."""
        if set(quanta) != set(self.quanta):
            raise ValueError(
                f"quantum numbers {', '.join(quanta)}: these levels are labelled by {', '.join(self.quanta)}"
            )

    def block_numbers(self, rows: NDArray[np.integer]) -> Ints:
        """The number of the solved block of each of the levels `rows`."""
        return np.searchsorted([block.start for block in self.blocks], rows, side="right") - 1

    def labels(self, rows: NDArray[Any]) -> list[str]:
        """The levels `rows` as text, one row of quantum numbers each."""
        return texts_of_labels(self.quanta, rows, self.halves)

    def quantum(self, name: str) -> Ints:
        """A quantum number of all levels (n,), 0 where they do not have it."""
        return self.quanta.get(name, np.zeros(len(self), dtype=np.int64))

    def quanta_of(self, rows: NDArray[Any]) -> Ints:
        """Quantum numbers (n, names) of the levels `rows`, in the order of `quanta_names`."""
        return np.stack([column[rows] for column in self.quanta.values()], axis=1)

    def quanta_columns(self, rows: NDArray[Any], suffix: str) -> dict[str, NDArray[Any]]:
        """Quantum numbers of the levels `rows` as columns by name: j_upper, ka_upper, kc_upper for the suffix upper."""
        return {f"{name}_{suffix}": column[rows] for name, column in self.quanta.items()}

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Quantum numbers, energy_mhz, components, weight and degeneracy, by name."""
        names = ("energy_mhz", "components", "weight", "degeneracy")
        return self.quanta | {name: getattr(self, name) for name in names}


class TransitionTable(Table):
    """What every list of transitions has: the levels that it leads between, and their quantum numbers."""

    levels: Levels

    @property
    def quanta_names(self) -> tuple[str, ...]:
        """Which quantum numbers label a state: j; j, k; j, ka, kc; ..."""
        return self.levels.quanta_names

    def quanta(self, rows: NDArray[Any]) -> Ints:
        """Quantum numbers (n, names) of the states `rows`, such as those above or below each transition."""
        return self.levels.quanta_of(rows)


def energies_like(reference: Levels, levels: Levels) -> Floats:
    """Energies of `levels` in the rows of a reference, matched by the quantum numbers that both have; NaN for a missing level.

    J and N, the rotational angular momentum, are matched with each other.
    """
    shared = [name for name in reference.quanta_names if name in levels.quanta_names and name not in ("n", "j")]
    table, keys = ([each.rotational, *(each.quanta[name] for name in shared)] for each in (levels, reference))
    rows = matching_rows(table, keys)
    return np.where(rows >= 0, levels.energy_mhz[rows], np.nan)


def weights_of_levels(levels: Levels, weights: SpinWeights) -> Ints:
    """Spin weights of levels by other weights than they were solved with; species have theirs where the weights are all 1."""
    species = "species" in levels.quanta and weights.rule == "none"
    return levels.weight if species else weights_of_quanta(levels.kind, levels.quanta, weights)


def levels_table(
    top: Top,
    effects: tuple[QuantumEffect, ...],
    jmax: int,
    energy_mhz: Floats,
    quanta: dict[str, NDArray[Any]],
    representation: str | None = None,
    **others: Any,
) -> Levels:
    """Levels, by default of one component, 2J+1 projections and the spin weights of the top or of their state. others: see `Levels`."""
    ones = np.ones(len(energy_mhz), dtype=np.int64)
    others = {"multiplicity": 2 * quanta["j"] + 1 if "j" in quanta else ones, "components": ones, **others}
    if "weight" not in others:
        others["weight"] = _weights_by_state(top, effects, quanta)
    return Levels(top.kind, representation, jmax, energy_mhz, quanta, effects=effects, **others)


def _weights_by_state(top: Top, effects: tuple[QuantumEffect, ...], quanta: Quanta) -> Ints:
    """Spin weights of the top, or of the states that have theirs."""
    weight = weights_of_quanta(top.kind, quanta, top.spin_weights)
    for state in (state for effect in effects for state in effect.states(top)):
        if state.spin_weights is not None:
            weight = np.where(quanta["v"] == state.v, weights_of_quanta(top.kind, quanta, state.spin_weights), weight)
    return weight


def levels_of_blocks(
    top: Top,
    effects: tuple[QuantumEffect, ...],
    blocks: tuple[SolvedBlock, ...],
    quanta: dict[str, NDArray[Any]],
    jmax: int,
    representation: str,
    **others: Any,
) -> Levels:
    """The levels of blocks of several states or with spins; others: see `Levels`."""
    energies, mixing = (np.concatenate([getattr(b, name) for b in blocks]) for name in ("energies_mhz", "mixing"))
    return levels_table(top, effects, jmax, energies, quanta, representation, blocks=blocks, mixing=mixing, **others)


Quanta = Mapping[str, NDArray[Any]]


def weights_of_quanta(kind: str, quanta: Quanta, weights: SpinWeights) -> Ints:
    """Spin weights of the levels of a top of this kind.

    Beside a total spin I of two nuclei the weights are those of even I; levels of odd I have those of the other class.

    >>> weights_of_quanta("linear", {"j": np.arange(3)}, SpinWeights.from_mapping({"even": 1, "odd": 3})).tolist()
    [1, 3, 1]
    """
    if "i_tot" in quanta and "i_sym" not in quanta and weights.rule != "none":
        even, odd = (_rotational_weights(kind, quanta, rule) for rule in (weights, weights.exchanged()))
        return np.where(quanta["i_tot"] % 2 == 0, even, odd)
    return _rotational_weights(kind, quanta, weights)


def _rotational_weights(kind: str, quanta: Quanta, weights: SpinWeights) -> Ints:
    """By the rotational quantum numbers alone."""
    if "irrep" in quanta:
        weight_of = {name: weights.irrep_weight(name) for name in np.unique(quanta["irrep"]).tolist()}
        return np.array([weight_of[name] for name in quanta["irrep"].tolist()], dtype=np.int64)
    j = np.asarray(quanta["n" if "n" in quanta else "j"])
    if "kc" in quanta:
        return _asymmetric_weights(kind, j, quanta["ka"], quanta["kc"], weights)
    if "k" in quanta:
        return weights.symmetric_weights(j, np.abs(quanta["k"]), oblate=kind == "oblate")
    return weights.spherical_weights(j) if kind == "spherical" else weights.linear_weights(j)


def _asymmetric_weights(kind: str, j: Ints, ka: Ints, kc: Ints, weights: SpinWeights) -> Ints:
    """By parities of (Ka, Kc); a symmetric top whose ±K are split has weights by K, one component each.

    Of a pair with K a multiple of n, 0even and 0odd go by the parity of the other label, which is J where K = 0: a half turn about
    an axis across the main one distinguishes the two components of the pair.
    """
    if kind in ("prolate", "oblate") and weights.rule == "K":
        k, other = (kc, ka) if kind == "oblate" else (ka, kc)
        # of K = 0, whose other label is J
        at_zero = np.array([weights.symmetric_weights(number, 0) for number in (0, 1)])
        both = weights.symmetric_weights(j, k, oblate=kind == "oblate") // np.where(k == 0, 1, 2)
        return np.where(k % weights.modulus == 0, at_zero[other % 2], both)
    by_parity = np.array([[weights.asymmetric_weight(a + c) for c in "eo"] for a in "eo"], dtype=np.int64)
    return np.asarray(by_parity[ka % 2, kc % 2])
