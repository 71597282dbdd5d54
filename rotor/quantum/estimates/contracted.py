"""Labelled levels with spins in large blocks: functions near each level are solved, all others enter to second order.

The functions of an F are the rotational states r, solved for each N, times the coupling patterns p,

    ⟨r' p'|H|r p⟩ = E_r δ + V,    V = Σ_channels c(p', p) ⟨r'|X|r⟩.

For levels near an energy E₀ the functions P within W of it are solved; those beyond, Q with the diagonal D, are eliminated. The equations
of Q, (E - D) q = V_QP a, give q = C a - (E - E₀) (E₀ - D)⁻² V_QP a with C = (E₀ - D)⁻¹ V_QP. Those of P become

    (H_PP - E₀ + V_PQ C) a = (E - E₀)(1 + M) a,    M = CᵀC;

and the vector of the level is (a, C a). V between two functions of Q is neglected. It shifts a level by at most v³/W², with v the norm of a
column of V; W is chosen so that this is below `TOLERANCE_MHZ`. Where V is too large for that, the whole block is solved (`effect_units`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.basis.state_elements import StateTerms
from rotor.quantum.blocks.linear_stacks import LinearBlock
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.spins.linear_blocks import linear_blocks_of_spins, rotation_blocks
from rotor.quantum.spins.parts import SpinPart, assigned, named_states, turned

if TYPE_CHECKING:
    from rotor.tops.top import Top

TOLERANCE_MHZ = 1e-6  # error of a level
_WIDE = 0.15  # largest window relative to the spread of energies; a wider one contains too many functions
_LEAST_RATIO = 10.0  # smallest window relative to the norm of a column of V
_SPREAD = 0.01  # levels this close, relative to the window, share E₀; the neglected term is χ²(E - E₀)²/W³


class _Target(NamedTuple):
    """A label in a block: its place among all labels, the part, the pattern in it, and v, Ka, Kc of the rotational state."""

    row: int
    part: int
    pattern: int
    name: list[int]


class _Coupled(NamedTuple):
    """A block at given constants: its parts, vectors of the rotation, E_r and the diagonal of H, and H over basis functions."""

    parts: tuple[SpinPart, ...]
    vectors: Mapping[int, Floats]
    energies: Floats
    diagonal: Floats
    matrix: Any

    def over_functions(self, columns: Floats) -> Floats:
        """Columns over rotational states times patterns as columns over basis functions."""
        return turned(self.parts, columns, self.vectors)

    def over_states(self, columns: Floats) -> Floats:
        """Columns over basis functions as columns over rotational states times patterns."""
        return turned(self.parts, columns, {part.number: self.vectors[part.number].T for part in self.parts})


@dataclass(frozen=True)
class ContractedLevels:
    """Labelled levels as functions of the parameters.

    rotors, rotations: rotational blocks and their linear blocks, by their numbers. blocks: of each block of an F its parts, the matrices
    over basis functions that parameters multiply, and the labels in it.
    """

    count: int
    rotors: dict[int, SolvedBlock]
    rotations: dict[int, LinearBlock]
    blocks: tuple[tuple[tuple[SpinPart, ...], LinearBlock, tuple[_Target, ...]], ...]
    window_mhz: float

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """Energies (count,) in MHz and derivatives (count, parameters) at values (parameters,) in MHz."""
        if not np.isfinite(values_mhz).all():
            raise ValueError("a block of the Hamiltonian is not finite with these constants")
        energies, slopes = np.empty(self.count), np.zeros((self.count, len(values_mhz)))
        for (_, linear, targets), (coupled, functions) in zip(self.blocks, self.coupled(values_mhz), strict=True):
            rows = np.array([target.row for target in targets])
            energies[rows], vectors = _levels_of(coupled, functions, self.window_mhz)
            slopes[rows[:, None], linear.parameters] = linear.slopes(coupled.over_functions(vectors))
        return energies, slopes

    def coupled(self, values_mhz: Floats) -> Iterator[tuple[_Coupled, Ints]]:
        """Each block at values (parameters,) in MHz, and the places of the functions that its labels name."""
        solved = {number: _eigen(linear.lower(values_mhz)) for number, linear in self.rotations.items()}
        energies, vectors = ({number: pair[i] for number, pair in solved.items()} for i in range(2))
        for parts, linear, targets in self.blocks:
            yield _coupled(parts, linear, energies, vectors, values_mhz), self._functions(parts, targets, vectors)

    def _functions(self, parts: Sequence[SpinPart], targets: Sequence[_Target], vectors: Mapping[int, Floats]) -> Ints:
        """Places of the functions that the labels of a block name."""
        numbers = {parts[target.part].number for target in targets}
        names = {number: named_states(self.rotors[number], vectors[number]).tolist() for number in numbers}
        functions = []
        for target in targets:
            part = parts[target.part]
            state = names[part.number].index(target.name)
            functions.append(part.place.start + target.pattern * len(part.rotor.energies_mhz) + state)
        return np.array(functions, dtype=np.int64)


def _eigen(lower: Floats) -> tuple[Floats, Floats]:
    """Energies and vectors of a lower triangle; a constant is subtracted from the diagonal to reduce round-off."""
    zero = float(lower[0, 0])
    energies, vectors = np.linalg.eigh(lower - zero * np.eye(len(lower)))
    return energies + zero, vectors


def _coupled(
    parts: tuple[SpinPart, ...],
    linear: LinearBlock,
    energies_mhz: Mapping[int, Floats],
    vectors: Mapping[int, Floats],
    values_mhz: Floats,
) -> _Coupled:
    """A block at values (parameters,) in MHz, with the rotation solved there."""
    from scipy.sparse import tril  # loaded in fits of large blocks only

    lower = linear.sparse(values_mhz)
    matrix = (lower + tril(lower, -1).T).tocsr()
    diagonal = []
    for part in parts:
        turning = vectors[part.number]
        for start in range(part.place.start, part.place.stop, len(turning)):
            inside = matrix[start : start + len(turning), start : start + len(turning)]
            diagonal.append(np.einsum("ij,ij->j", turning, inside @ turning))
    energies = np.concatenate([np.tile(energies_mhz[part.number], part.repeats) for part in parts])
    return _Coupled(parts, vectors, energies, np.concatenate(diagonal), matrix)


def _levels_of(coupled: _Coupled, functions: Ints, window_mhz: float) -> tuple[Floats, Floats]:
    """Energies (targets,) and vectors (functions, targets) of the levels dominated by these functions."""
    diagonal = coupled.diagonal
    energies, vectors = np.empty(len(functions)), np.empty((len(diagonal), len(functions)))
    groups = list(_groups(diagonal[functions], _SPREAD * window_mhz))
    centres = [float(diagonal[functions[group]].mean()) for group in groups]
    near = [np.flatnonzero(np.abs(diagonal - centre) < window_mhz) for centre in centres]
    chosen = np.unique(np.concatenate(near))
    columns = coupling_columns(coupled, chosen)
    for group, centre, inside in zip(groups, centres, near, strict=True):
        inside_columns = columns[:, np.searchsorted(chosen, inside)]
        eliminated, states = _eliminated(coupled.energies, diagonal, inside_columns, inside, centre)
        function_of_state = assigned(states[inside] ** 2, np.ones(len(inside), dtype=np.int64))
        state_of = np.argsort(function_of_state)
        states_here = state_of[np.searchsorted(inside, functions[group])]
        energies[group], vectors[:, group] = eliminated[states_here], states[:, states_here]
    return energies, vectors


def _groups(energies: Floats, spread_mhz: float) -> Iterator[Ints]:
    """Groups of positions of energies that lie within `spread_mhz`."""
    order = np.argsort(energies)
    start = 0
    for stop in range(1, len(order) + 1):
        if stop == len(order) or energies[order[stop]] - energies[order[start]] > spread_mhz:
            yield order[start:stop]
            start = stop


def coupling_columns(coupled: _Coupled, chosen: Ints) -> Floats:
    """Columns of V (functions, chosen)."""
    places = np.arange(len(chosen))
    units = np.zeros((len(coupled.energies), len(chosen)))
    units[chosen, places] = 1.0
    columns = coupled.over_states(coupled.matrix @ coupled.over_functions(units))
    columns[chosen, places] -= coupled.energies[chosen]
    return columns


def _eliminated(
    rotation: Floats, diagonal: Floats, columns: Floats, inside: Ints, centre: float
) -> tuple[Floats, Floats]:
    """Energies (m,) and vectors (functions, m) over the functions inside, with all others eliminated at the energy `centre`."""
    solved = columns[inside] + np.diag(rotation[inside] - centre)
    others = columns.copy()
    others[inside] = 0.0
    apart = centre - diagonal
    apart[inside] = 1.0
    mixed = others / apart[:, None]
    factor = np.linalg.cholesky(np.eye(len(inside)) + mixed.T @ mixed)
    back = np.linalg.inv(factor)
    energies, mixtures = np.linalg.eigh(back @ (solved + others.T @ mixed) @ back.T)
    vectors = back.T @ mixtures
    states = mixed @ vectors
    states[inside] = vectors
    return energies + centre, states


def contracted_levels(
    top: Top,
    effects: tuple[QuantumEffect, ...],
    levels: Levels,
    rows: Ints,
    names: Sequence[str],
    values_mhz: Floats,
    large: int,
) -> ContractedLevels | None:
    """Labelled levels, rows of `spins.levels.unmixed_levels` in the order of the answer, as functions of the parameters.

    None where whole blocks are solved faster, with fewer functions than `large`, or V is too large at approximate values of the parameters.
    """
    chosen = _blocks_with(levels, rows)
    if max(len(block.energies_mhz) for block, _ in chosen) < large:
        return None
    shared = levels.blocks[0].spins.shared
    rotors = {part.number: part.rotor for block, _ in chosen for part in block.spins.parts}
    terms = StateTerms.from_effects(top, effects, names, shared.representation)
    rotations = rotation_blocks(terms, len(names), list(rotors.values()))
    linear = linear_blocks_of_spins(top, effects, names, [block for block, _ in chosen])
    blocks = tuple(
        (block.spins.parts, matrices, targets) for (block, targets), matrices in zip(chosen, linear, strict=True)
    )
    contracted = ContractedLevels(len(rows), rotors, dict(zip(rotors, rotations, strict=True)), blocks, 0.0)
    window = _window(contracted, values_mhz)
    spread = min(float(np.ptp(block.energies_mhz)) for block, _ in chosen)
    if window > _WIDE * spread:
        return None
    return replace(contracted, window_mhz=window)


def _blocks_with(levels: Levels, rows: Ints) -> list[tuple[SolvedBlock, tuple[_Target, ...]]]:
    """The blocks that contain the rows, with the labels in each."""
    block_of_row = levels.block_numbers(rows)
    with_targets = []
    for number in np.unique(block_of_row).tolist():
        block = levels.blocks[number]
        stops = np.array([part.place.stop for part in block.spins.parts])
        targets = []
        for place in np.flatnonzero(block_of_row == number).tolist():
            function = int(rows[place]) - block.start
            part = int(np.searchsorted(stops, function, side="right"))
            chosen_part = block.spins.parts[part]
            pattern = (function - chosen_part.place.start) // len(chosen_part.rotor.energies_mhz)
            targets.append(_Target(place, part, pattern, block.labels[function, :3].tolist()))
        with_targets.append((block, tuple(targets)))
    return with_targets


def _window(levels: ContractedLevels, values_mhz: Floats) -> float:
    """W from the largest norm of a column of V of a labelled function."""
    longest = 0.0
    for coupled, functions in levels.coupled(values_mhz):
        columns = coupling_columns(coupled, np.unique(functions))
        longest = max(longest, float(np.sqrt(np.einsum("ij,ij->j", columns, columns)).max()))
    return max(_LEAST_RATIO * longest, float(np.sqrt(longest**3 / TOLERANCE_MHZ)))
