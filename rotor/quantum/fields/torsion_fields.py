"""Molecules with internal rotation in a field: states of each species with M.

Levels with v_t ≤ vt_max are the basis; a tensor of the molecule between them is that of the rotation times the overlaps of the torsional
functions, and along Z (Edmonds, Angular Momentum in Quantum Mechanics, 1957, eq. 5.4.1)

    ⟨J τ M|T^k_0|J' τ' M⟩ = (-1)^(J-M) (J k J'; -M 0 M) ⟨J τ‖T^k‖J' τ'⟩.

No static field connects species. E levels are no pairs of parities: K has a sign, (σ, M) is like (-σ, -M), and the effect is linear.
Maps leave out elements between states of different v_t, whose overlaps are small: levels move by less than (μE)²/ΔE, 0.1 MHz at 1 kV/cm
for 1 D and 100 cm⁻¹.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.blocks import connected_parts
from rotor.quantum.fields.blocks import Contraction, FieldBlock, FieldSpace, FreeLevels
from rotor.quantum.internal_rotation.contracted import Product
from rotor.quantum.internal_rotation.levels import (
    REPRESENTATION,
    components_of,
    reduced_weights,
    refuse_axes,
    species_blocks,
    turning_tops,
)
from rotor.quantum.internal_rotation.species import SpeciesLevels
from rotor.quantum.operators.rotation import body_tensor
from rotor.quantum.tensors import spherical_components
from rotor.quantum.wigner import three_j

if TYPE_CHECKING:
    from rotor.tops.top import Top

CONNECTED = 1e-10  # of the largest element: smaller ones are round-off of zero


@dataclass(frozen=True)
class TorsionFreeLevels(FreeLevels):
    """Levels with a species and v_t; names: of the species by their number."""

    names: tuple[str, ...] = ()

    def label(self, row: int) -> str:
        """Species and v_t first, then J, Ka, Kc: `E 0 1 0 1`."""
        numbers = [
            int(self.quanta["vt"][row]),
            int(self.j[row]),
            *(int(self.quanta[name][row]) for name in ("ka", "kc")),
        ]
        return " ".join([self.names[int(self.quanta["species"][row])], *map(str, numbers)])


@dataclass(frozen=True)
class TorsionFieldBlock(FieldBlock):
    """States |level, M⟩ of one species that the contractions connect; `states`: their places among its levels."""

    m: int
    copies: int
    rows: Ints = field(repr=False)
    states: Ints = field(repr=False)
    species: SpeciesInField = field(repr=False)
    space: TorsionFieldSpace = field(repr=False)

    @property
    def label(self) -> str:
        """The lowest level."""
        return f"from {self.levels.label(int(self.rows[0]))}"

    @property
    def levels(self) -> FreeLevels:
        """The levels of the space."""
        return self.space.levels

    @property
    def even_in_field(self) -> bool:
        """A reversed field exchanges (σ, M) with (σ, -M) of a species that is not its own mirror image."""
        return self.species.components == 1 or not self.m

    def matrix(self, contraction: Contraction) -> NDArray[Any]:
        """The contraction over the states (n, n)."""
        found = self.species.matrix(contraction, self.m, self.states)
        return np.ascontiguousarray(found.real) if not found.imag.any() else found


class SpeciesInField:
    """The levels of one species, rising in J, with reduced elements of tensors, made when first used."""

    def __init__(self, name: str, levels: SpeciesLevels, angle: float) -> None:
        self.name, self.components = name, components_of(name)
        quanta, energies = levels.quanta, levels.energies
        order = np.lexsort((energies, quanta["j"]))
        self.quanta = {key: column[order] for key, column in quanta.items()}
        self.energies = energies[order]
        self._levels, self._order, self._angle = levels, order, angle
        self._known: dict[bytes, NDArray[Any]] = {}

    def matrix(self, contraction: Contraction, m: int, states: Ints) -> NDArray[np.complex128]:
        """A contraction along Z between chosen states of one M (n, n), Hermitian."""
        numbers, place = np.unique(self.quanta["j"][states], return_inverse=True)
        j = numbers.astype(float)
        rank, space = contraction.rank, contraction.space
        size = space[2] if rank == 1 else (2 * space[2, 2] - space[0, 0] - space[1, 1]) / np.sqrt(6)
        sign = np.where((j - m) % 2, -1.0, 1.0)
        projected = size * sign[:, None] * three_j(j[:, None], rank, j, -m, 0, m)
        found = projected[np.ix_(place, place)] * self._reduced(contraction)[np.ix_(states, states)]
        found[np.diag_indices(len(states))] += contraction.scalar
        return np.asarray((found + found.conj().T) / 2)

    def _reduced(self, contraction: Contraction) -> NDArray[np.complex128]:
        """⟨J τ‖T‖J' τ'⟩ (n, n); between combined functions elements of odd rank are i times those that stand there."""
        key = contraction.body.tobytes()
        if key not in self._known:
            functions = self._levels.functions
            body = _turned(contraction.body, self._angle)
            parts = spherical_components(body, contraction.rank, REPRESENTATION)
            real = parts if np.abs(parts.imag).max() else parts.real
            elements = functions.elements([[Product(body_tensor(real))]], contraction.rank)
            vectors = self._vectors(elements.count)
            from scipy.sparse import csr_array

            tensor = csr_array((elements.values[0], (elements.rows, elements.columns)), shape=(elements.count,) * 2)
            found = (vectors.conj().T @ (tensor @ vectors)).astype(np.complex128)
            self._known[key] = 1j * found if functions.folded and contraction.rank % 2 else found
        return self._known[key]

    def _vectors(self, count: int) -> NDArray[Any]:
        """Vectors of the levels in columns over all functions (functions, levels)."""
        solved = self._levels.solved
        rows = self._levels.rows[self._order]
        block = solved.linear.block[rows]
        out: NDArray[Any] | None = None
        for number in self._levels.blocks:
            here = np.flatnonzero(block == number)
            members, vectors = solved.vectors(number)
            if out is None:
                out = np.zeros((count, len(rows)), dtype=vectors.dtype)
            out[np.ix_(members, here)] = vectors[:, solved.linear.rank[rows[here]]]
        assert out is not None
        return out


@dataclass(frozen=True)
class TorsionFieldSpace(FieldSpace):
    """Levels of every species with J up to J max.

    first: the row of the first level of each species. together: whether states of different v_t are solved together.
    """

    levels: TorsionFreeLevels = field(repr=False)
    jmax: int
    species: tuple[SpeciesInField, ...] = field(repr=False)
    first: tuple[int, ...]
    contractions: tuple[Contraction, ...] = field(repr=False)
    together: bool = False

    def blocks(self, m: int) -> list[FieldBlock]:
        """Connected states of ±M, M ≥ 0; of species with σ ≠ 0 those of M and of -M, each standing for (-σ, -M) too."""
        out: list[FieldBlock] = []
        for species, first in zip(self.species, self.first, strict=True):
            for vt in (-1,) if self.together else np.unique(species.quanta["vt"]).tolist():
                out += self._blocks_of(species, first, m, vt)
        return out

    def _blocks_of(self, species: SpeciesInField, first: int, m: int, vt: int) -> list[FieldBlock]:
        """Blocks of one species and v_t; of all v_t where it is -1."""
        out: list[FieldBlock] = []
        present = np.flatnonzero((species.quanta["j"] >= m) & ((vt < 0) | (species.quanta["vt"] == vt)))
        if len(present):
            if species.components > 1:
                signs = (1, -1) if m else (1,)
                out += [TorsionFieldBlock(sign * m, 2, first + present, present, species, self) for sign in signs]
            else:
                out += [
                    TorsionFieldBlock(m, 2 if m else 1, first + states, states, species, self)
                    for states in self._parts(species, present, m)
                ]
        return out

    def _parts(self, species: SpeciesInField, present: Ints, m: int) -> list[Ints]:
        """The states that the contractions connect."""
        linked = np.zeros((len(present),) * 2, dtype=bool)
        for contraction in self.contractions:
            size = np.abs(species.matrix(contraction, m, present))
            linked |= size > CONNECTED * size.max(initial=0.0)
        part = connected_parts(len(present), *np.nonzero(linked))
        return [present[part == number] for number in np.unique(part).tolist()]


def torsion_field_space(
    top: Top, jmax: int, contractions: Sequence[Contraction], together: bool = False
) -> TorsionFieldSpace:
    """The levels of a top with internal rotation up to J max, for fields along Z; with `together` all v_t of a species in one block.

    Raises ValueError for fields at an angle with Z.
    """
    constants = top.internal_rotation
    assert constants is not None
    if not all(one.along_z for one in contractions):
        raise ValueError("a top with internal rotation is solved in fields along Z alone; leave out the angle")
    refuse_axes(top)
    model, weights = turning_tops(top, constants), reduced_weights(constants)
    species = []
    for name in model.species:
        levels = species_blocks(model, name, 0, jmax, constants.functions).solve_once(
            model.coefficients, constants.vt_max, constants.names == "energy"
        )
        species.append(SpeciesInField(name, levels, model.angle))
    counts = [len(one.energies) for one in species]
    number = np.repeat(np.arange(len(species)), counts)
    quanta = {key: np.concatenate([one.quanta[key] for one in species]) for key in ("j", "vt", "ka", "kc")}
    free = TorsionFreeLevels(
        quanta.pop("j"),
        np.concatenate([one.energies for one in species]),
        {"species": number, **quanta},
        np.repeat([weights[one.name] / one.components for one in species], counts),
        names=tuple(model.species),
    )
    first = tuple(np.cumsum([0, *counts[:-1]]).tolist())
    return TorsionFieldSpace(free, jmax, tuple(species), first, tuple(contractions), together)


def _turned(body: Floats, angle: float) -> Floats:
    """A vector or tensor along the axes of ρ, which lie at an angle (radians) from a towards b."""
    turn = np.array([[np.cos(angle), np.sin(angle), 0.0], [-np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(turn @ body if body.ndim == 1 else turn @ body @ turn.T)
