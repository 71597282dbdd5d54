"""Levels of a molecule with an internal rotor, and moments between their blocks."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.blocks.connected import ByBlocks, Entries, elements_by_blocks
from rotor.quantum.internal_rotation.chain_rule import NO_CHAIN, ChainRule, chain_rule, further_operators
from rotor.quantum.internal_rotation.contracted import Product
from rotor.quantum.internal_rotation.exchange import exchanged_functions
from rotor.quantum.internal_rotation.expectations import Expectations
from rotor.quantum.internal_rotation.functions import TorsionRotation
from rotor.quantum.internal_rotation.model import RamModel, model_of_principal_axes
from rotor.quantum.internal_rotation.rho_axis_tensors import (
    REPRESENTATION,
    operator_beside_spins,
    turned_components,
)
from rotor.quantum.internal_rotation.several_tops import SeveralTops, several_tops
from rotor.quantum.internal_rotation.species import SpeciesHamiltonian, SpeciesLevels, states_of
from rotor.quantum.levels import Levels, Mixtures, SolvedBlock, SpeciesFunctions, levels_table, placed
from rotor.quantum.operators.algebra import Operator
from rotor.quantum.operators.rotation import body_tensor
from rotor.quantum.operators.tensors import BodyTensor, Tensors
from rotor.quantum.spins.scheme import Fixed, Rotor
from rotor.quantum.wang.basis import Part
from rotor.tops.internal_rotation import InternalRotationConstants, sigma_species

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top

TurningTops = RamModel | SeveralTops
Columns = dict[str, NDArray[Any]]
FEW = 1 << 14  # up to so many elements a dense matrix is faster than a sparse one
MOST_POPULATED = 2  # products of three tops below the limit of a sum, of which blocks of any size are solved
MOST_SUMMED = 1500  # functions of a block of three tops that is solved as a whole for a sum


@dataclass(frozen=True, eq=False)
class TorsionMoments:
    """Operators of one species and derivatives of its states; elements between functions are computed at first use.

    chain: dependence of F, ρ and its direction on constants of principal axes. further: operators of the quantities of the chain that are
    no coefficients of the Hamiltonian, by name.
    """

    levels: SpeciesLevels
    model: TurningTops
    chain: ChainRule = NO_CHAIN
    further: Mapping[str, Sequence[Product]] = field(default_factory=dict)
    _cache: dict[Rotor | BodyTensor, ByBlocks] = field(default_factory=dict)

    @property
    def combined(self) -> bool:
        """Whether functions of K and -K are combined."""
        return self.levels.functions.folded

    def connect(self, up: SolvedBlock, low: SolvedBlock, tensors: Tensors) -> bool:
        """Whether a tensor has elements between two blocks."""
        return (up.basis.number, low.basis.number) in self._between(tensors)

    def reduced(self, up: SolvedBlock, low: SolvedBlock, tensors: Tensors) -> NDArray[Any]:
        """Reduced elements (n_up, n_low) of a tensor; those of odd rank without their factor i where functions are `combined`."""
        return _contracted(self._between(tensors)[up.basis.number, low.basis.number], up.vectors, low.vectors)

    def beside_spins(self, rotor: Rotor) -> Callable[[SolvedBlock, SolvedBlock], NDArray[Any] | None]:
        """The function of the reduced elements (n_up, n_low) of an operator of N in a term with spins; None where it does not act."""
        if not isinstance(rotor, Fixed) and rotor not in self._cache:
            operator = operator_beside_spins(rotor, self.model.frame)
            self._cache[rotor] = self._entries(operator, rotor.rank, rotor.rank == 1)
        by_blocks = self._between({(0, 0): rotor.tensor}) if isinstance(rotor, Fixed) else self._cache[rotor]

        def between(up: SolvedBlock, low: SolvedBlock) -> NDArray[Any] | None:
            entries = by_blocks.get((up.basis.number, low.basis.number))
            return None if entries is None else _contracted(entries, up.vectors, low.vectors)

        return between

    def slopes(self, mixtures: Mixtures, names: Sequence[str]) -> Floats:
        """∂E/∂c (n, names) of mixtures of states, by the constants of the top and of the internal rotor."""
        by_operators = self.term_slopes(mixtures)
        return self.chain.slopes(names, self.by_quantities(by_operators), len(by_operators))

    def by_quantities(self, by_operators: Floats) -> dict[str, Floats]:
        """∂E/∂q (n,) by the values of the model and the quantities of the chain, from slopes by terms and further operators."""
        count = len(self.levels.source.terms)
        slopes = dict(zip(self.model.values, (by_operators[:, :count] @ self.model.jacobian).T, strict=True))
        return slopes | dict(zip(self.further, by_operators[:, count:].T, strict=True))

    def term_slopes(self, mixtures: Mixtures) -> Floats:
        """∂E/∂c (n, terms and further operators) of mixtures of states, by coefficients of the Hamiltonian."""
        _, patterns, count = mixtures[0][1].shape
        states: Any = 0.0
        for block, mixture in mixtures:
            vectors = block.vectors @ mixture.reshape(len(mixture), -1)
            rows = self.levels.members[block.basis.number]
            states = states + self.levels.functions.over_products(rows, vectors, self._expectations.needs_phases)
        return np.asarray(self._expectations.of_states(states).reshape(patterns, count, -1).sum(axis=0))

    @cached_property
    def _expectations(self) -> Expectations:
        """Terms and further operators."""
        return Expectations(self.levels.functions, [*self.levels.source.terms.values(), *self.further.values()])

    def _between(self, tensors: Tensors) -> Mapping[tuple[int, int], Entries]:
        """Elements of a tensor by pairs of blocks: overlaps of torsional functions times elements of the rotation."""
        body = tensors[0, 0]
        if body not in self._cache:
            turned = turned_components(np.array(body.components), self.model.frame)
            self._cache[body] = self._entries(body_tensor(turned), body.rank)
        return self._cache[body]

    def _entries(self, operator: Operator, rank: int, time_odd: bool = False) -> ByBlocks:
        """Reduced elements of a tensor of the rotation from J to J' ≥ J by pairs of blocks."""
        elements = self.levels.functions.elements([[Product(operator)]], rank, time_odd, half=True)
        return elements_by_blocks(elements, self.levels.members)


def _contracted(entries: Entries, bra: NDArray[Any], ket: NDArray[Any]) -> NDArray[Any]:
    """V'† X V of elements between the functions of two blocks."""
    shape = len(bra), len(ket)
    if shape[0] * shape[1] <= FEW:
        matrix: Any = np.zeros(shape, dtype=entries.values.dtype)
        matrix[entries.rows, entries.columns] = entries.values[0]
    else:
        from scipy.sparse import csr_array

        matrix = csr_array((entries.values[0], (entries.rows, entries.columns)), shape=shape)
    return np.asarray(bra.conj().T @ (matrix @ ket))


def torsion_rotation_levels(
    top: Top, constants: InternalRotationConstants, effects: tuple[QuantumEffect, ...], jmin: int, jmax: int
) -> Levels:
    """Levels with v_t ≤ vt_max and J from `jmin` to `jmax`, labelled by species, vt, j, ka, kc; MHz above the minimum of the potential.

    Raises ValueError unless the top is asymmetric and in the representation Iʳ.
    """
    refuse_axes(top)
    model = turning_tops(top, constants)
    chain = chain_rule(model, {**top.constants.values, **constants.values})
    degeneracies = Degeneracies.from_model(model, constants)
    blocks, pieces = list[SolvedBlock](), list[Columns]()
    for name in model.species:
        species = species_blocks(model, name, jmin, jmax, constants.functions).solve_once(
            model.coefficients, constants.vt_max, constants.names == "energy"
        )
        moments = TorsionMoments(species, model, chain, further_operators(model, name, chain))
        blocks += species_rotors(moments, degeneracies.components(name))
        quanta = {key: species.quanta[key] for key in ("vt", "j", "ka", "kc")}
        pieces.append(degeneracies.columns(name, species.functions, species.names) | quanta)
    energies = np.concatenate([block.energies_mhz for block in blocks])
    return joined_levels(top, effects, jmax, pieces, energies, tuple(placed(blocks)))


def energies_alone(
    top: Top,
    constants: InternalRotationConstants,
    effects: tuple[QuantumEffect, ...],
    jmin: int,
    jmax: int,
    below_mhz: float = math.inf,
) -> Levels:
    """Energies from all n_v torsional functions, for sums over states. J is exact; v_t, Ka and Kc are those of a basis function.

    Functions that lie above `below_mhz` together with all that they couple to are left out.
    """  # fmt: skip
    refuse_axes(top)
    model, pieces, energies = turning_tops(top, constants), [], []
    degeneracies = Degeneracies.from_model(model, constants)
    for name in model.species:
        blocks = species_blocks(model, name, jmin, jmax, constants.functions)
        # low levels need all torsional functions, so the highest one of K = 0 is the least limit
        highest = float(blocks.functions.torsion.energies[jmax].max())
        linear = blocks.summed(model.coefficients, max(below_mhz, highest))
        labels, unit = blocks.functions.labels, np.ones(1)
        if constants.tops < 3:  # whole blocks, energies alone: faster than few states with their vectors
            solved = [block.energies(unit) for _, block in linear]
        else:
            populated = int((blocks.functions.torsion.energies.min(axis=0) <= below_mhz).sum())  # they rise with t
            size = (2 * jmax + 1) * constants.functions
            if populated > MOST_POPULATED and size > MOST_SUMMED:  # blocks that take minutes
                raise ValueError(
                    f"internal rotation of three tops: sums over levels at this temperature need many states of blocks of {size} "
                    "functions; give the partition function (--q), a lower temperature, or fewer functions"
                )
            solved = [states_of(block, unit, labels["t"][rows] < populated)[0] for rows, block in linear]
        energies += solved
        rows = np.concatenate([of_block[: len(e)] for (of_block, _), e in zip(linear, solved, strict=True)])
        labels = {key: column[rows] for key, column in labels.items()}
        j, ka = labels["J"], np.abs(labels["K"])
        kc = j - ka + np.where((labels["K"] > 0) & (labels["s"] >= 0), 1, 0)
        columns = degeneracies.columns(name, blocks.functions, rows)
        pieces.append(columns | {"vt": labels["t"], "j": j, "ka": ka, "kc": kc})
    return joined_levels(top, effects, jmax, pieces, np.concatenate(energies))


def joined_levels(
    top: Top, effects: tuple[QuantumEffect, ...], jmax: int, pieces: Sequence[Columns], energies: Floats,
    blocks: tuple[SolvedBlock, ...] = (), halves: frozenset[str] = frozenset(),
) -> Levels:  # fmt: skip
    """Levels from columns of quantum numbers, components, weights and, with spins, projections in space, piece by piece."""
    columns = {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
    others: Any = {name: columns.pop(name) for name in ("components", "weight", "multiplicity") if name in columns}
    return levels_table(top, effects, jmax, energies, columns, REPRESENTATION, blocks=blocks, halves=halves, **others)


def refuse_axes(top: Top) -> None:
    """Raise ValueError unless the top is asymmetric in the representation Iʳ."""
    if top.kind != "asymmetric" or top.constants.representation != REPRESENTATION:
        raise ValueError(
            f"internal rotation of a top of kind {top.kind} in {top.constants.representation}: expected A, B, C of the rho-axis frame in "
            "the representation Ir (z, x, y = a, b, c)"
        )


def turning_tops(top: Top, constants: InternalRotationConstants) -> TurningTops:
    """Model of the constants of the top and of its internal rotors."""
    model = turning_model(top.constants.values, constants.values, constants)
    dipole = zip("abc", top.dipole_abc_debye or (), strict=False)
    if (
        isinstance(model, SeveralTops)
        and model.axis
        and (beside := [name for name, mu in dipole if mu and name != model.axis])
    ):
        raise ValueError(
            f"dipole along {', '.join(beside)}: the tops are exchanged by C2 about {model.axis}, which leaves a dipole along "
            f"{model.axis} alone; leave the others out, or give the constants by which the tops differ"
        )
    return model


def turning_model(
    rotation: Mapping[str, float], values: Mapping[str, float], constants: InternalRotationConstants
) -> TurningTops:
    """Model of constants of the rotation and of the internal rotors, in the frame that `constants` states."""
    if constants.tops > 1:
        return several_tops(rotation, values)
    return (
        RamModel({**rotation, **values})
        if constants.frame == "RAM"
        else model_of_principal_axes({**rotation, **values})
    )


def species_blocks(
    model: TurningTops, name: str, jmin: int, jmax: int, count: int, needed: Ints | None = None
) -> SpeciesHamiltonian:
    """Blocks of a species, for J from jmin to jmax or for those in `needed`."""
    sigma: Any = model.species[name]
    return model.blocks(sigma, jmax, jmin=jmin, count=count, needed=needed)


@dataclass(frozen=True)
class Degeneracies:
    """Degeneracy of levels of a species, and their spin weights without the common divisor.

    equivalent: whether a rotation of the molecule exchanges the two tops. Weights of inequivalent tops are products.
    """

    constants: InternalRotationConstants
    equivalent: bool = False

    @classmethod
    def from_model(cls, model: TurningTops, constants: InternalRotationConstants) -> Degeneracies:
        """Degeneracies of a model."""
        equivalent = isinstance(model, SeveralTops) and bool(model.axis)
        if constants.exchanged and not equivalent:
            raise ValueError(
                "internal rotation: exchanged nuclei are stated, and no twofold axis a, b or c exchanges the tops: expected equal F0, V3, "
                "V6, and angles such as delta_2 = pi - delta_1"
            )
        if equivalent and len(set(constants.states_of_tops)) > 1:
            raise ValueError(
                f"spin_states = {constants.spin_states} of tops with equal constants, which C2 exchanges: expected the same nuclei, or the "
                "constants by which the tops differ"
            )
        return cls(constants, equivalent)

    def columns(self, species: str, functions: TorsionRotation, rows: Ints) -> Columns:
        """Species, components and weight of the levels at `rows` of the functions."""
        components, weight = np.full(len(rows), self.components(species)), self.weights(species, functions, rows)
        return {"species": np.full(len(rows), species), "components": components, "weight": weight}

    def components(self, species: str) -> int:
        """States that coincide: σ and -σ, except for A, AA and AAA; for equivalent tops also AE and EA."""
        return 1 if set(species) == {"A"} else 4 if self.equivalent and species == "AE" else 2

    def weights(self, species: str, functions: TorsionRotation, rows: Ints) -> Ints:
        """Spin weights (levels,), summed over components, of the levels at `rows` of the functions.

        Weights of inequivalent tops are products; each of the species has two components, σ and -σ, but for that of σ = 0.
        """
        names = sigma_species(self.constants.tops)
        if self.equivalent:
            states, pairs = self.constants.states_of_tops[0], self.constants.exchanged
            weights = {name: exchanged_functions(states, pairs, sigma) for name, sigma in names.items()}
        else:
            tops = self.constants.weights
            weights = {
                name: np.full(2, (1 + any(sigma)) * math.prod(top[abs(s)] for top, s in zip(tops, sigma, strict=True)))
                for name, sigma in names.items()
            }
        x = functions.labels.get("x", np.ones(len(functions.labels["J"]), dtype=np.int64))
        divisor = np.gcd.reduce(np.concatenate([*weights.values()]))
        return np.asarray(weights[species][(x[rows] < 0).astype(int)] // divisor)


def species_rotors(moments: TorsionMoments, components: int) -> list[SolvedBlock]:
    """Blocks of one species with the states that are levels, in their order."""
    levels, blocks, places = moments.levels, list[SolvedBlock](), Counter[int]()
    energies = np.split(levels.energies, levels.starts[1:-1])
    for number, (rows, vectors) in enumerate(zip(levels.members, levels.vectors, strict=True)):
        if vectors.size:
            j = int(levels.functions.labels["J"][rows[0]])
            parts = (Part(0, SpeciesFunctions(j, number, places[j]), 0),)
            places[j] += 1
            blocks.append(SolvedBlock(parts, energies[number], vectors, moments=moments, components=components))
    return blocks


def species_splitting(top: Top, constants: InternalRotationConstants, j: int) -> float:
    """The largest |E_s(K) - E_A(K) - E_s(0) + E_A(0)| over |K| ≤ J and species s of the torsional ground state, MHz."""
    model = turning_tops(top, constants)
    species: Mapping[str, Any] = model.species
    ground = [model.ground_energies(sigma, j) for sigma in species.values()]
    differences = np.array(ground[1:]) - ground[0]
    return float(np.abs(differences - differences[:, [j]]).max())
