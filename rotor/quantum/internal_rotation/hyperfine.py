"""Nuclear spins beside internal rotation: quadrupole and spin-rotation coupling of any number of nuclei.

The torsion-rotation states with v_t ≤ vt_max are the basis; tensors between them are those of the rotation times the overlaps of the
torsional functions, exact for every K, and each nucleus is coupled by `rotor.quantum.contraction`. Left out are elements with states of
v_t > vt_max, which move levels by χ²/ΔE: below 1e-4 MHz for χ of 20 MHz and torsional states 100 cm⁻¹ apart.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.contraction import Sector, Space, contracted_elements, coupled, spin_space
from rotor.quantum.internal_rotation.contracted import Product
from rotor.quantum.internal_rotation.levels import (
    REPRESENTATION,
    Degeneracies,
    TurningTops,
    species_blocks,
    turned_by,
    turning_tops,
)
from rotor.quantum.internal_rotation.species import SpeciesLevels
from rotor.quantum.levels import Levels, MomentBlock
from rotor.quantum.operators.algebra import Operator, half_anticommutator
from rotor.quantum.operators.rotation import body_tensor, j_x, j_y, j_z
from rotor.quantum.spins.operators import Cosines, CosinesWithN
from rotor.quantum.spins.terms import Spin
from rotor.quantum.tensors import Tensors, cartesian_of, spherical_components
from rotor.tops.internal_rotation import InternalRotationConstants

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top


@dataclass(frozen=True, eq=False)
class NucleusTensors:
    """A spin with its coupling tensors (3, 3) in MHz along the axes of ρ: χ of the quadrupole, C of spin-rotation."""

    spin: Spin
    quadrupole: Floats
    rotation: Floats


@dataclass(frozen=True, eq=False)
class SpeciesHyperfine:
    """The states of one species with spins: the last space, its names, and the rotational levels behind them."""

    model: TurningTops
    levels: SpeciesLevels
    space: Space
    quanta: tuple[Mapping[str, Ints], ...]


@dataclass(frozen=True, eq=False)
class HyperfineBlock(MomentBlock):
    """States of one F and one connected block of a species: some states of a sector, rising in energy."""

    species: SpeciesHyperfine
    sector: int
    states: Ints
    energies_mhz: Floats
    start: int
    components: int

    @property
    def twice_f(self) -> int:
        """Twice the total angular momentum."""
        return self.species.space.sectors[self.sector].twice_j

    def connects(self, low: MomentBlock, tensors: Tensors) -> bool:
        """Whether a dipole has elements between the states of both blocks."""
        if not isinstance(low, HyperfineBlock) or low.species is not self.species:
            return False
        dipoles = self.species.space.tensors
        pair = self.sector, low.sector
        return any(pair in dipoles[f"mu {axis}"].blocks for axis, value in self._vector(tensors).items() if value)

    @property
    def combined(self) -> bool:
        """Whether functions of K and -K are combined."""
        return self.species.levels.functions.folded

    def reduced(self, low: MomentBlock, tensors: Tensors) -> NDArray[Any]:
        """Reduced elements (n_up, n_low) of one component."""
        assert isinstance(low, HyperfineBlock)
        pieces = [
            value * block[np.ix_(self.states, low.states)]
            for axis, value in self._vector(tensors).items()
            if value
            and (block := self.species.space.tensors[f"mu {axis}"].blocks.get((self.sector, low.sector))) is not None
        ]
        return np.asarray(sum(pieces)) if pieces else np.zeros((len(self.states), len(low.states)))

    def _vector(self, tensors: Tensors) -> dict[str, float]:
        """Components of a vector along the axes of ρ by their names."""
        body = tensors[0, 0]
        if body.rank != 1:
            raise ValueError(
                "spins beside internal rotation: elements of dipoles are computed, of tensors of rank 2 none"
            )
        vector = turned_by(cartesian_of(body.components, REPRESENTATION), self.species.model.angle)
        if self.species.model.has_plane and abs(vector[2]) > 0:
            raise ValueError("a dipole along c beside internal rotation: the molecule has the plane ab as a mirror")
        return dict(zip("abc", vector.tolist(), strict=True))

    def slopes(self, names: Sequence[str]) -> Floats:
        """∂E/∂c (n, names) of the torsion-rotation levels that name the states; constants of spins count for nothing."""
        known = list(self.species.model.values)
        rows = self.species.quanta[self.sector]["row"][self.states]
        slopes = self.species.levels.slopes(rows) @ self.species.model.jacobian
        return np.column_stack([slopes[:, known.index(n)] if n in known else np.zeros(len(rows)) for n in names])


def hyperfine_levels(
    top: Top, constants: InternalRotationConstants, effects: tuple[QuantumEffect, ...], nmin: int, nmax: int
) -> Levels:
    """Levels of both species with nuclear spins whose label has N from `nmin` to `nmax`.

    Parameters
    ----------
    top : Top
        Rotational constants and distortion in the frame of the internal rotor.
    constants : InternalRotationConstants
        Those of the internal rotor.
    effects : tuple of QuantumEffect
        The rotation, internal rotation, and effects of nuclear spins.
    nmin, nmax : int
        Range of N.

    Returns
    -------
    Levels
        By species, vt, n, ka, kc, f1, ... f; half-integers are doubled.

    Raises
    ------
    ValueError
        For electron spins, total spins of like nuclei, and constants with powers of N.
    """
    model = turning_tops(top, constants)
    degeneracies = Degeneracies.of(model, constants)
    nuclei = _nuclei(top, effects, model.angle)
    if degeneracies.equivalent and len(nuclei) > 1:
        raise ValueError(
            "spins of several nuclei beside equivalent tops: their exchange is not computed; leave one of them"
        )
    total = sum(nucleus.spin.twice for nucleus in nuclei)
    names = [*(f"f{i}" for i in range(1, len(nuclei))), "f"]
    blocks: list[HyperfineBlock] = []
    columns: dict[str, list[NDArray[Any]]] = {}
    start = 0
    for name in model.species:
        states = _species(model, constants, name, nuclei, names, (max(0, nmin - total), nmax + total))
        for sector, quanta in enumerate(states.quanta):
            here = np.flatnonzero((quanta["n"] >= nmin) & (quanta["n"] <= nmax))
            if not len(here):
                continue
            energies = states.space.sectors[sector].energies[here]
            components, rows = degeneracies.components(name), quanta["row"][here]
            blocks.append(HyperfineBlock(states, sector, here, energies, start, components))
            start += len(here)
            table = {
                "species": np.full(len(here), name),
                "components": np.full(len(here), components),
                "weight": degeneracies.weights(name, states.levels.functions, rows),
                **{key: quanta[key][here] for key in ("vt", "n", "ka", "kc", *names)},
            }
            for key, column in table.items():
                columns.setdefault(key, []).append(column)
    quanta = {key: np.concatenate(pieces) for key, pieces in columns.items()}
    halves = _halves(nuclei, names)
    multiplicity = quanta["f"] + 1
    for key in names:
        if key not in halves:
            quanta[key] = quanta[key] // 2
    components_of_levels, weights = quanta.pop("components"), quanta.pop("weight")
    return Levels(
        kind=top.kind,
        representation=REPRESENTATION,
        jmax=nmax,
        energy_mhz=np.concatenate([block.energies_mhz for block in blocks]),
        quanta=quanta,
        multiplicity=multiplicity,
        components=components_of_levels,
        weight=weights,
        halves=halves,
        effects=effects,
        blocks=tuple(blocks),
    )


def _halves(nuclei: Sequence[NucleusTensors], names: Sequence[str]) -> frozenset[str]:
    """The sums that are half-integers."""
    twice = np.cumsum([nucleus.spin.twice for nucleus in nuclei])
    return frozenset(name for name, sum_of_spins in zip(names, twice.tolist(), strict=True) if sum_of_spins % 2)


def _nuclei(top: Top, effects: Sequence[QuantumEffect], angle: float) -> list[NucleusTensors]:
    """The spins in the order of coupling, with their tensors turned to the axes of ρ."""
    spins: dict[str, Spin] = {}
    tensors: dict[str, dict[type, Floats]] = {}
    for effect in effects:
        values = effect.parameters(top)
        spins |= {spin.name: spin for spin in effect.spins(top) if spin.name not in spins}
        for term in effect.spin_terms(top):
            powers = term.n2 or term.nz2 or term.ns
            if not isinstance(term.rotor, Cosines | CosinesWithN) or powers or len(set(term.spins)) != 1:
                raise ValueError(
                    f"{term.name} beside internal rotation: computed are quadrupole and spin-rotation tensors of one nucleus"
                )
            kind: type = type(term.rotor)
            matrix = values[term.name] * term.factor * np.array(term.rotor.components, dtype=float)
            table = tensors.setdefault(term.spins[0], {})
            table[kind] = table.get(kind, np.zeros((3, 3))) + matrix
    for spin in spins.values():
        if spin.electron or spin.total:
            raise ValueError(f"spin {spin.name} beside internal rotation: computed are single nuclei")
    none: dict[type, Floats] = {}
    return [
        NucleusTensors(
            spin,
            *(
                turned_by(tensors.get(name, none).get(kind, np.zeros((3, 3))), angle)
                for kind in (Cosines, CosinesWithN)
            ),
        )
        for name, spin in spins.items()
    ]


def _spin_rotation(matrix: Floats) -> Operator:
    """Σ_ij C_ij ½{Φ_i, N_j} along a, b, c."""
    along = (j_z(), j_x(), j_y())
    unit = np.eye(3)
    terms = [
        float(matrix[i, k])
        * half_anticommutator(body_tensor(_real(spherical_components(unit[i], 1, REPRESENTATION))), along[k])
        for i in range(3)
        for k in range(3)
        if matrix[i, k]
    ]
    return reduce(lambda x, y: x + y, terms, Operator())


def _real(components: NDArray[Any]) -> NDArray[Any]:
    return components if np.abs(components.imag).max() else components.real


def _species(
    model: TurningTops, constants: InternalRotationConstants, species: str, nuclei: Sequence[NucleusTensors], names: Sequence[str],
    n_range: tuple[int, int],
) -> SpeciesHyperfine:  # fmt: skip
    """All states of one species with N in a range."""
    blocks = species_blocks(model, species, *n_range, constants.functions)
    levels = blocks.solve_once(model.coefficients, constants.vt_max, constants.names == "energy")
    space = _rotation_space(levels, nuclei, model.has_plane)
    quanta = _rotation_quanta(levels, space)
    for i, (nucleus, name) in enumerate(zip(nuclei, names, strict=True)):
        space, quanta = _with_nucleus(space, quanta, i, nucleus, name)
    return SpeciesHyperfine(model, levels, space, tuple(quanta))


def _rotation_space(levels: SpeciesLevels, nuclei: Sequence[NucleusTensors], has_plane: bool) -> Space:
    """The named torsion-rotation levels with the tensors of every nucleus and unit vectors for the dipole."""
    functions, linear = levels.functions, levels.solved.linear
    tensors = {}
    for i, nucleus in enumerate(nuclei):
        if nucleus.quadrupole.any():
            parts = _real(spherical_components(nucleus.quadrupole, 2, REPRESENTATION))
            tensors[f"chi {i}"] = 2, functions.elements([[Product(body_tensor(parts))]], 2)
        if nucleus.rotation.any():
            tensors[f"C {i}"] = 1, functions.elements([[Product(_spin_rotation(nucleus.rotation))]], 1, time_odd=True)
    for axis, unit in zip("abc", np.eye(3), strict=True):
        if axis != "c" or not has_plane:  # of a molecule with the plane ab there is no dipole along c
            parts = _real(spherical_components(unit, 1, REPRESENTATION))
            tensors[f"mu {axis}"] = 1, functions.elements([[Product(body_tensor(parts))]], 1)
    block, rank = linear.block[levels.rows], linear.rank[levels.rows]
    retained = {number: np.sort(rank[block == number]) for number in levels.blocks}
    return contracted_elements(levels.solved, tensors, retained)


def _rotation_quanta(levels: SpeciesLevels, space: Space) -> list[dict[str, Ints]]:
    """Names of the states of each sector, and their rows among the solved functions."""
    place = np.full(len(levels.solved.linear.block), -1)
    place[levels.rows] = np.arange(len(levels.rows))
    quanta = levels.quanta
    names = {"vt": "vt", "n": "j", "ka": "ka", "kc": "kc"}
    found = []
    for sector in space.sectors:
        rows = sector.labels["functions"]
        found.append({name: quanta[key][place[rows]] for name, key in names.items()} | {"row": rows})
    return found


def _with_nucleus(
    space: Space, quanta: Sequence[Mapping[str, Ints]], number: int, nucleus: NucleusTensors, name: str
) -> tuple[Space, list[dict[str, Ints]]]:
    """One more nucleus coupled and solved; its sum of angular momenta is named `name`."""
    scalars = {
        key: (f"{key} {number}", own) for key, own in (("chi", "Q"), ("C", "I")) if f"{key} {number}" in space.tensors
    }
    carried = {
        key: (key, None, tensor.rank)
        for key, tensor in space.tensors.items()
        if key.startswith("mu") or int(key.split()[1]) > number
    }
    highest = max(sector.twice_j for sector in space.sectors) + nucleus.spin.twice
    product = coupled(space, spin_space(nucleus.spin.twice), scalars, carried, range(highest % 2, highest + 1, 2))
    solved = product.solve(dict.fromkeys(scalars, 1.0))
    return solved, [_names_of(sector, product.sectors, quanta, name) for sector in solved.sectors]


def _names_of(
    sector: Sector, products: Sequence[Sector], quanta: Sequence[Mapping[str, Ints]], name: str
) -> dict[str, Ints]:
    """Names of the states of a solved sector after the product functions that they mostly are."""
    named = sector.labels["functions"]
    origin = [(products[product].labels["factors"][0], rank) for product, rank in named.tolist()]
    columns = {key: np.array([quanta[i][key][rank] for i, rank in origin]) for key in quanta[0]}
    return {**columns, name: np.full(len(origin), sector.twice_j)}
