"""Labelled levels with spins in large blocks: each among the few functions near it, all others to second order.

The functions of an F are the states r of the rotation, solved for every N, times the coupling patterns p,

    ⟨r' p'|H|r p⟩ = E_r δ + V,    V = Σ_channels c(p', p) ⟨r'|X|r⟩.

For levels near an energy E₀ the functions P within W of it are solved and those beyond, Q with the diagonal D, are eliminated. The
equations of Q, (E - D) q = V_QP a, give q = C a - (E - E₀) (E₀ - D)⁻² V_QP a with C = (E₀ - D)⁻¹ V_QP, and with that those of P

    (H_PP - E₀ + V_PQ C) a = (E - E₀)(1 + M) a,    M = CᵀC;

the vector of the level is a and C a. Left out is V between two functions of Q, which moves a level by v³/W² at most for columns of V
of the length v; W is chosen so that this is below `TOLERANCE_MHZ`. Where V is too large for that the whole block is solved
(`effect_units`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.levels import Levels
from rotor.quantum.spins.blocks import Plan, SpinBlock
from rotor.quantum.spins.linear_blocks import Unit, unit_matrices
from rotor.quantum.spins.parts import SpinPart, assigned, named_states
from rotor.quantum.spins.rotor import Channel, RotorBlock

if TYPE_CHECKING:
    from rotor.tops.top import Top

TOLERANCE_MHZ = 1e-6  # of a level
_LARGE = 400  # functions of a block from which on this is worth while
_WIDE = 0.15  # of the spread of energies: a window beyond it holds too many functions
_LEAST_RATIO = 10.0  # of the window to the length of a column of V
_SPREAD = 0.01  # of the window: levels so near each other share E₀; the rest is χ²(E - E₀)²/W³


class _Target(NamedTuple):
    """Labels of a block: places among all, the part, the pattern within it, and v, Ka, Kc of the state of the rotation."""

    row: int
    part: int
    pattern: int
    name: tuple[int, ...]


@dataclass(frozen=True)
class _Block:
    """One block of an F: its parts, the coefficients of coupling c(p', p), and the labels that lie in it."""

    parts: tuple[SpinPart, ...]
    known: dict[Channel, Floats]
    targets: tuple[_Target, ...]


class _Solved(NamedTuple):
    """The rotation at some constants: energies and vectors by block, and X between its states by pair and channel."""

    energies: dict[int, Floats]
    vectors: dict[int, Floats]
    operators: dict[tuple[int, int], dict[Channel, Floats]]


@dataclass(frozen=True)
class ContractedLevels:
    """Labelled levels for other values of the parameters; see `levels`. rotations, couplings : see `spins.linear_blocks.Units`."""

    count: int
    rotors: dict[int, RotorBlock]
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
            found_energies, vectors = _levels_of(block, _functions_of(block, names), solved, self.window_mhz)
            energies[rows] = found_energies
            slopes[rows] = self._slopes(block, vectors, solved, len(values_mhz))
        return energies, slopes

    def _solved(self, values_mhz: Floats) -> _Solved:
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
                    moved = np.tensordot(block.known[channel][up.patterns, low.patterns], turned[b], axes=1)
                    pairs = np.einsum("pet,pet->te", turned[a][:, unit.rows], moved[:, unit.columns])
                    out[:, unit.parameters] += (1.0 if a == b else 2.0) * (pairs @ unit.factors)
        return out


def _eigen(matrix: Floats) -> tuple[Floats, Floats]:
    """Energies and vectors; a number is taken off the diagonal for the sake of digits."""
    zero = float(matrix[0, 0])
    energies, vectors = np.linalg.eigh(matrix - zero * np.eye(len(matrix)))
    return energies + zero, vectors


def _states_by_name(rotor: RotorBlock, vectors: Floats) -> dict[tuple[int, ...], int]:
    """The state of the rotation that v, Ka, Kc name."""
    return {tuple(name): state for state, name in enumerate(named_states(rotor, vectors).tolist())}


def _functions_of(block: _Block, names: dict[int, dict[tuple[int, ...], int]]) -> Ints:
    """Where the functions that name the labels stand."""
    functions = []
    for target in block.targets:
        part = block.parts[target.part]
        state = names[part.number][target.name]
        functions.append(part.place.start + target.pattern * len(part.rotor.energies_mhz) + state)
    return np.array(functions, dtype=np.int64)


def _levels_of(block: _Block, functions: Ints, solved: _Solved, window_mhz: float) -> tuple[Floats, Floats]:
    """Energies (targets,) and vectors (functions, targets) of the levels that are mostly those functions."""
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
        of_state = assigned(states[inside] ** 2, np.ones(len(inside), dtype=np.int64))
        state_of = np.argsort(of_state)
        states_here = state_of[np.searchsorted(inside, functions[group])]
        energies[group], vectors[:, group] = eliminated[states_here], states[:, states_here]
    return energies, vectors


def _diagonal(block: _Block, solved: _Solved) -> tuple[Floats, Floats]:
    """E_r, and with the diagonal of V, of every function."""
    rotation, coupled = [], []
    for part in block.parts:
        energies = np.tile(solved.energies[part.number], part.repeats)
        rotation.append(energies)
        coupled.append(energies.copy())
        for channel, operator in solved.operators.get((part.number, part.number), {}).items():
            pattern = np.diag(block.known[channel][part.patterns, part.patterns])
            coupled[-1] += np.outer(pattern, np.diag(operator)).ravel()
    return np.concatenate(rotation), np.concatenate(coupled)


def _groups(energies: Floats, spread_mhz: float) -> Iterator[Ints]:
    """Positions of energies that lie within a spread of each other."""
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
                c = block.known[channel][up.patterns, low.patterns]
                c, x = (c, operator) if a >= b else (c.T, operator.T)
                out[bra.place, where] += (c[:, None, patterns] * x[None, :, states]).reshape(-1, len(states))
    return out


def _eliminated(
    rotation: Floats, diagonal: Floats, columns: Floats, inside: Ints, centre: float
) -> tuple[Floats, Floats]:
    """Energies (m,) and vectors (functions, m) of the functions inside, all others eliminated at the energy of the centre."""
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
    """The rows of levels for other values of the parameters; None where their blocks had better be solved whole.

    Parameters
    ----------
    top : Top
    effects : tuple of QuantumEffect
    plan : Plan
        The rotation and what acts between its blocks.
    levels : Levels
        Of `unmixed_levels`: functions and their names.
    rows : (n,) array
        Rows of these levels, in the order of the answer.
    names : sequence of str
        Parameters of the effects, in the order of the values.
    values_mhz : (parameters,) array
        Near those of the parameters.

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
    known_blocks = tuple(_Block(block.parts, _known(plan, block), targets) for block, targets in blocks)
    contracted = ContractedLevels(len(rows), rotors, rotations, couplings, known_blocks, 0.0)
    window = _window(contracted, values_mhz)
    spread = min(float(np.ptp(block.energies_mhz)) for block, _ in blocks)
    if window > _WIDE * spread:
        return None
    return replace(contracted, window_mhz=window)


def _blocks_with(plan: Plan, levels: Levels, rows: Ints) -> list[tuple[SpinBlock, tuple[_Target, ...]]]:
    """The blocks in which the rows lie, with what names these."""
    starts = np.array([block.start for block in levels.blocks])
    of_row = np.searchsorted(starts, rows, side="right") - 1
    with_targets = []
    for number in np.unique(of_row).tolist():
        block = levels.blocks[number]
        stops = np.array([part.place.stop for part in block.parts])
        targets = []
        for place in np.flatnonzero(of_row == number).tolist():
            function = int(rows[place]) - block.start
            part = int(np.searchsorted(stops, function, side="right"))
            chosen_part = block.parts[part]
            pattern = (function - chosen_part.place.start) // len(chosen_part.rotor.energies_mhz)
            targets.append(_Target(place, part, pattern, tuple(block.labels[function, :3].tolist())))
        with_targets.append((block, tuple(targets)))
    return with_targets


def _known(plan: Plan, block: SpinBlock) -> dict[Channel, Floats]:
    known: dict[Channel, Floats] = plan.shared.cache["coupling", block.twice_f]
    return known


def _window(levels: ContractedLevels, values_mhz: Floats) -> float:
    """W from the longest column of V of a labelled function."""
    solved = levels._solved(values_mhz)
    longest = 0.0
    for block in levels.blocks:
        states = {number: _states_by_name(levels.rotors[number], solved.vectors[number])
                  for number in {block.parts[target.part].number for target in block.targets}}  # fmt: skip
        columns = coupling_columns(block, np.unique(_functions_of(block, states)), solved)
        longest = max(longest, float(np.sqrt(np.einsum("ij,ij->j", columns, columns)).max()))
    return max(_LEAST_RATIO * longest, float(np.sqrt(longest**3 / TOLERANCE_MHZ)))
