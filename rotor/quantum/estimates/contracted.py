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

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.spins.blocks import Plan, SpinBlock, coefficients_by_f
from rotor.quantum.spins.linear_blocks import Unit, unit_matrices
from rotor.quantum.spins.parts import SpinPart, assigned, named_states
from rotor.quantum.spins.rotor import Channel

if TYPE_CHECKING:
    from rotor.tops.top import Top

TOLERANCE_MHZ = 1e-6  # error of a level
_LARGE = 400  # smaller blocks are solved whole, which is then faster
_WIDE = 0.15  # largest window relative to the spread of energies; a wider one contains too many functions
_LEAST_RATIO = 10.0  # smallest window relative to the norm of a column of V
_SPREAD = 0.01  # levels this close, relative to the window, share E₀; the neglected term is χ²(E - E₀)²/W³


class _Target(NamedTuple):
    """A label in a block: its place among all labels, the part, the pattern in it, and v, Ka, Kc of the rotational state."""

    row: int
    part: int
    pattern: int
    name: tuple[int, ...]


@dataclass(frozen=True)
class _Block:
    """One block of an F: its parts, coupling coefficients c(p', p), and the labels in it."""

    parts: tuple[SpinPart, ...]
    coefficients: dict[Channel, Floats]
    targets: tuple[_Target, ...]


class _Solved(NamedTuple):
    """The rotation at given constants: energies and vectors by block, and X between its states by pair of blocks and channel."""

    energies: dict[int, Floats]
    vectors: dict[int, Floats]
    operators: dict[tuple[int, int], dict[Channel, Floats]]


@dataclass(frozen=True)
class ContractedLevels:
    """Labelled levels as functions of the parameters; rotations, couplings: see `spins.linear_blocks.Units`."""

    count: int
    rotors: dict[int, SolvedBlock]
    rotations: dict[int, Unit]
    couplings: dict[tuple[int, int], dict[Channel, Unit]]
    blocks: tuple[_Block, ...]
    window_mhz: float

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """Energies (count,) in MHz and derivatives (count, parameters) at values (parameters,) in MHz."""
        if not np.isfinite(values_mhz).all():
            raise ValueError("a block of the Hamiltonian is not finite with these constants")
        solved = self._solved(values_mhz)
        energies, slopes = np.empty(self.count), np.zeros((self.count, len(values_mhz)))
        names: dict[int, dict[tuple[int, ...], int]] = {}
        for block in self.blocks:
            for number in {block.parts[target.part].number for target in block.targets} - set(names):
                names[number] = _states_by_name(self.rotors[number], solved.vectors[number])
            rows = np.array([target.row for target in block.targets])
            level_energies, vectors = _levels_of(block, _functions_of(block, names), solved, self.window_mhz)
            energies[rows] = level_energies
            slopes[rows] = self._slopes(block, vectors, solved, len(values_mhz))
        return energies, slopes

    def _solved(self, values_mhz: Floats) -> _Solved:
        """The rotation solved at values (parameters,) in MHz."""
        energies, vectors = {}, {}
        for number in self.rotors:
            energies[number], vectors[number] = _eigen(self.rotations[number].matrix(values_mhz))
        operators = {
            (i, k): {channel: vectors[i].T @ unit.matrix(values_mhz) @ vectors[k] for channel, unit in units.items()}
            for (i, k), units in self.couplings.items()
        }
        return _Solved(energies, vectors, operators)

    def _slopes(self, block: _Block, vectors: Floats, solved: _Solved, count: int) -> Floats:
        """⟨n|∂H/∂c|n⟩ (targets, parameters) of vectors (functions, targets)."""
        out = np.zeros((vectors.shape[1], count))
        turned = []
        for part in block.parts:
            part_vectors = vectors[part.place].reshape(part.repeats, -1, vectors.shape[1])
            turned.append(np.matmul(solved.vectors[part.number], part_vectors))
            unit = self.rotations[part.number]
            pairs = np.einsum("pet,pet->te", turned[-1][:, unit.rows], turned[-1][:, unit.columns])
            out[:, unit.parameters] += pairs @ unit.factors
        for a, up in enumerate(block.parts):
            for b, low in enumerate(block.parts[: a + 1]):
                for channel, unit in self.couplings.get((up.number, low.number), {}).items():
                    moved = np.tensordot(block.coefficients[channel][up.patterns, low.patterns], turned[b], axes=1)
                    pairs = np.einsum("pet,pet->te", turned[a][:, unit.rows], moved[:, unit.columns])
                    out[:, unit.parameters] += (1.0 if a == b else 2.0) * (pairs @ unit.factors)
        return out


def _eigen(matrix: Floats) -> tuple[Floats, Floats]:
    """Energies and vectors; a constant is subtracted from the diagonal to reduce round-off."""
    zero = float(matrix[0, 0])
    energies, vectors = np.linalg.eigh(matrix - zero * np.eye(len(matrix)))
    return energies + zero, vectors


def _states_by_name(rotor: SolvedBlock, vectors: Floats) -> dict[tuple[int, ...], int]:
    """Rotational states by v, Ka, Kc."""
    return {tuple(name): state for state, name in enumerate(named_states(rotor, vectors).tolist())}


def _functions_of(block: _Block, names: dict[int, dict[tuple[int, ...], int]]) -> Ints:
    """Places of the functions that the labels name."""
    functions = []
    for target in block.targets:
        part = block.parts[target.part]
        state = names[part.number][target.name]
        functions.append(part.place.start + target.pattern * len(part.rotor.energies_mhz) + state)
    return np.array(functions, dtype=np.int64)


def _levels_of(block: _Block, functions: Ints, solved: _Solved, window_mhz: float) -> tuple[Floats, Floats]:
    """Energies (targets,) and vectors (functions, targets) of the levels dominated by these functions."""
    rotation, diagonal = _diagonal(block, solved)
    energies, vectors = np.empty(len(functions)), np.empty((len(diagonal), len(functions)))
    groups = list(_groups(diagonal[functions], _SPREAD * window_mhz))
    centres = [float(diagonal[functions[group]].mean()) for group in groups]
    near = [np.flatnonzero(np.abs(diagonal - centre) < window_mhz) for centre in centres]
    chosen = np.unique(np.concatenate(near))
    columns = coupling_columns(block, chosen, solved)
    for group, centre, inside in zip(groups, centres, near, strict=True):
        inside_columns = columns[:, np.searchsorted(chosen, inside)]
        eliminated, states = _eliminated(rotation, diagonal, inside_columns, inside, centre)
        function_of_state = assigned(states[inside] ** 2, np.ones(len(inside), dtype=np.int64))
        state_of = np.argsort(function_of_state)
        states_here = state_of[np.searchsorted(inside, functions[group])]
        energies[group], vectors[:, group] = eliminated[states_here], states[:, states_here]
    return energies, vectors


def _diagonal(block: _Block, solved: _Solved) -> tuple[Floats, Floats]:
    """E_r, and E_r plus the diagonal of V, of each function."""
    rotation, coupled = [], []
    for part in block.parts:
        energies = np.tile(solved.energies[part.number], part.repeats)
        rotation.append(energies)
        coupled.append(energies.copy())
        for channel, operator in solved.operators.get((part.number, part.number), {}).items():
            pattern = np.diag(block.coefficients[channel][part.patterns, part.patterns])
            coupled[-1] += np.outer(pattern, np.diag(operator)).ravel()
    return np.concatenate(rotation), np.concatenate(coupled)


def _groups(energies: Floats, spread_mhz: float) -> Iterator[Ints]:
    """Groups of positions of energies that lie within `spread_mhz`."""
    order = np.argsort(energies)
    start = 0
    for stop in range(1, len(order) + 1):
        if stop == len(order) or energies[order[stop]] - energies[order[start]] > spread_mhz:
            yield order[start:stop]
            start = stop


def coupling_columns(block: _Block, chosen: Ints, solved: _Solved) -> Floats:
    """Columns of V (functions, chosen)."""
    out = np.zeros((block.parts[-1].place.stop, len(chosen)))
    bounds = np.searchsorted(chosen, [0, *(part.place.stop for part in block.parts)])
    for b, ket in enumerate(block.parts):
        where = slice(bounds[b], bounds[b + 1])
        patterns, states = np.divmod(chosen[where] - ket.place.start, len(ket.rotor.energies_mhz))
        if not len(states):
            continue
        for a, bra in enumerate(block.parts):
            up, low = (bra, ket) if a >= b else (ket, bra)
            for channel, operator in solved.operators.get((up.number, low.number), {}).items():
                c = block.coefficients[channel][up.patterns, low.patterns]
                c, x = (c, operator) if a >= b else (c.T, operator.T)
                out[bra.place, where] += (c[:, None, patterns] * x[None, :, states]).reshape(-1, len(states))
    return out


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
    energies, turned = np.linalg.eigh(back @ (solved + others.T @ mixed) @ back.T)
    vectors = back.T @ turned
    states = mixed @ vectors
    states[inside] = vectors
    return energies + centre, states


def contracted_levels(
    top: Top,
    effects: tuple[QuantumEffect, ...],
    plan: Plan,
    levels: Levels,
    rows: Ints,
    names: Sequence[str],
    values_mhz: Floats,
) -> ContractedLevels | None:
    """Labelled levels as functions of the parameters; None where whole blocks are solved faster or V is too large.

    Parameters
    ----------
    top : Top
        Constants and kind.
    effects : tuple of QuantumEffect
        Effects of the Hamiltonian.
    plan : Plan
        The rotation and the operators between its blocks.
    levels : Levels
        Basis functions with labels, from `unmixed_levels`.
    rows : (n,) array
        Rows of these levels, in the order of the answer.
    names : sequence of str
        Parameters of the effects, in the order of the values.
    values_mhz : (parameters,) array
        Approximate values of the parameters.

    Returns
    -------
    ContractedLevels or None
    """
    blocks = _blocks_with(plan, levels, rows)
    if max(len(block.energies_mhz) for block, _ in blocks) < _LARGE:
        return None
    used = {number for block, _ in blocks for number in (part.number for part in block.parts)}
    rotors = {i: plan.blocks[i] for i in sorted(used)}
    rotations, couplings = unit_matrices(top, effects, names, plan.shared, rotors)
    coefficients = coefficients_by_f(plan, {block.twice_f: block.patterns for block, _ in blocks})
    known_blocks = tuple(_Block(block.parts, coefficients[block.twice_f], targets) for block, targets in blocks)
    contracted = ContractedLevels(len(rows), rotors, rotations, couplings, known_blocks, 0.0)
    window = _window(contracted, values_mhz)
    spread = min(float(np.ptp(block.energies_mhz)) for block, _ in blocks)
    if window > _WIDE * spread:
        return None
    return replace(contracted, window_mhz=window)


def _blocks_with(plan: Plan, levels: Levels, rows: Ints) -> list[tuple[SpinBlock, tuple[_Target, ...]]]:
    """The blocks that contain the rows, with the labels in each."""
    starts = np.array([block.start for block in levels.blocks])
    block_of_row = np.searchsorted(starts, rows, side="right") - 1
    with_targets = []
    for number in np.unique(block_of_row).tolist():
        block = levels.blocks[number]
        stops = np.array([part.place.stop for part in block.parts])
        targets = []
        for place in np.flatnonzero(block_of_row == number).tolist():
            function = int(rows[place]) - block.start
            part = int(np.searchsorted(stops, function, side="right"))
            chosen_part = block.parts[part]
            pattern = (function - chosen_part.place.start) // len(chosen_part.rotor.energies_mhz)
            targets.append(_Target(place, part, pattern, tuple(block.labels[function, :3].tolist())))
        with_targets.append((block, tuple(targets)))
    return with_targets


def _window(levels: ContractedLevels, values_mhz: Floats) -> float:
    """W from the largest norm of a column of V of a labelled function."""
    solved = levels._solved(values_mhz)
    longest = 0.0
    for block in levels.blocks:
        states = {number: _states_by_name(levels.rotors[number], solved.vectors[number])
                  for number in {block.parts[target.part].number for target in block.targets}}  # fmt: skip
        columns = coupling_columns(block, np.unique(_functions_of(block, states)), solved)
        longest = max(longest, float(np.sqrt(np.einsum("ij,ij->j", columns, columns)).max()))
    return max(_LEAST_RATIO * longest, float(np.sqrt(longest**3 / TOLERANCE_MHZ)))
