"""Pairs of states that form a line, with frequency and strength: from Wang blocks, or in closed form.

All allowed lines are included except those that an `IntensityCut` or a frequency range excludes.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Indices, Ints, Workspace
from rotor.frozen import dataclass
from rotor.quantum.blocks.reduced import connections, wang_columns
from rotor.quantum.effect import Moment
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.operators.tensors import body_tensor
from rotor.quantum.wang.stacked_blocks import are_whole
from rotor.spectra.intensity import IntensityCut
from rotor.spectra.transitions.strong_lines import strong_lines
from rotor.tops.constants.operators import FIGURE_AXIS

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.quantum.spins.many_f_lines import Rows as ManyF
    from rotor.tops.top import Top

EVERYTHING = (0.0, float("inf"))
LONG_LIST = 30_000_000  # lines above which the compiled loop is used: loading it takes 0.6 s, the plain loop 20 ns more per line
COMPILED = "rotor.spectra.transitions._kernels"

BATCH = 30_000  # lines processed together

Vector = tuple[float, float, float]
Places = Indices | Ints
Rows = tuple[Places, Places, Floats]  # rows of both states, and S in D²
Amplitudes = Callable[
    [Any, Sequence[Any]], Floats
]  # of a block with several others, side by side: (n_up, sum of n_low)
Pair = tuple[SolvedBlock, SolvedBlock]  # two blocks with an allowed transition, the block of higher or equal J first


@dataclass(frozen=True)
class Transitions:
    """Columns (n,): frequency in MHz, S μ² in D² over all components, rows of both states in the levels."""

    frequency_mhz: Floats
    strength_debye2: Floats
    upper: Indices
    lower: Indices


class TooManyLinesError(Exception):
    """More lines are above a cut than were allowed."""


def spin_functions(top: Top, effects: Sequence[QuantumEffect]) -> int:
    """Number of functions of the spins of all effects."""
    twice = {spin.name: spin.twice for effect in effects for spin in effect.spins(top)}
    return math.prod(size + 1 for size in twice.values())


def transition_count(top: Top, jmax: int, effects: Sequence[QuantumEffect]) -> float:
    """Approximate number of transitions up to a J before any cut, without further states; each F joins all N that spins reach."""
    components = sum(1 for mu in top.dipole_abc_debye or () if mu)
    count = 0.5 * components * (jmax + 1) ** 3 if top.kind == "asymmetric" else components * (jmax + 1.0) ** 2
    return count * spin_functions(top, effects) ** 2


def all_transitions(
    levels: Levels,
    dipoles_abc: Vector | Mapping[tuple[int, int], Vector],
    range_mhz: tuple[float, float] = EVERYTHING,
    cut: IntensityCut | None = None,
    moments: Sequence[Moment] = (),
) -> Transitions:
    """All allowed transitions between `levels` in the range and above the cut, unordered.

    Parameters
    ----------
    levels : Levels
        With eigenvectors for asymmetric tops.
    dipoles_abc : (float, float, float) or mapping of (int, int) to it
        Components of μ along a, b, c in debye; for several vibrational states by pairs (v', v), each pair once.
    range_mhz : (float, float), optional
        First and last frequency.
    cut : IntensityCut, optional
        Least intensity; by default no cut. TooManyLinesError for more lines than it allows.
    moments : sequence of Moment, optional
        Moments other than dipoles, for levels with spins.

    Returns
    -------
    Transitions
        Frequencies in MHz, S μ² in D², and rows of both states.
    """
    dipoles = dipoles_abc if isinstance(dipoles_abc, Mapping) else {(0, 0): dipoles_abc}
    if levels.representation is None:
        return _joined(
            (piece for states, mu in dipoles.items() for piece in _closed_form(levels, states, mu, range_mhz, cut)), cut
        )

    blocks, incomplete = _existing_blocks(levels)
    solved = [block for block in blocks if block.alone]
    if cut is not None and solved and len(solved) == len(blocks) and are_whole(solved) and not moments:
        vector = body_tensor(dipoles[0, 0], 1, levels.representation)
        strong = strong_lines(levels, solved, vector, cut.needed, range_mhz[1])
        pieces = (_with_frequencies(levels, *batch, range_mhz, cut) for batch in _batches(strong))
        transitions = _joined(pieces, cut)
        return _rows(transitions, levels.weight[transitions.lower] > 0) if incomplete else transitions
    if (
        cut is not None
        and not moments
        and (stacked := _many_f_transitions(levels, blocks, dipoles, range_mhz, cut)) is not None
    ):
        return _rows(stacked, levels.weight[stacked.lower] > 0) if incomplete else stacked
    pairs, between = _connections(levels, blocks, dipoles, moments)
    if cut is None and range_mhz == EVERYTHING and not any(up is low for up, low in pairs):
        transitions = _all_lines(pairs, between)
    else:
        transitions = _selected_lines(levels, pairs, between, range_mhz, cut)
    return _rows(transitions, levels.weight[transitions.lower] > 0) if incomplete else transitions


def _connections(
    levels: Levels, blocks: list[SolvedBlock], dipoles: Mapping[tuple[int, int], Vector], moments: Sequence[Moment]
) -> tuple[list[Pair], Amplitudes]:
    """Pairs of blocks that the moments connect, and the function of their amplitudes."""
    if moments:
        from rotor.quantum.spins.many_f_lines import connections_of, moments_of

        pairs, between = connections_of(blocks, moments_of(levels, dict(dipoles), moments))
        return pairs, _side_by_side(between)
    representation = str(levels.representation)
    tensors = {states: body_tensor(mu, 1, representation) for states, mu in dipoles.items()}
    pairs, between = connections(blocks, tensors)
    if blocks and blocks[0].alone:
        return pairs, lambda up, lows: wang_columns(up, lows, tensors[0, 0])
    return pairs, _side_by_side(between)


def _side_by_side(pair_amplitudes: Callable[[Any, Any], NDArray[Any]]) -> Amplitudes:
    return lambda up, lows: _real(np.hstack([pair_amplitudes(up, low) for low in lows]))


def _real(amplitudes: NDArray[Any]) -> Floats:
    """Amplitudes, their moduli where they are complex."""
    return np.abs(amplitudes) if np.iscomplexobj(amplitudes) else amplitudes


def _existing_blocks(levels: Levels) -> tuple[list[SolvedBlock], bool]:
    """Blocks with levels of nonzero spin weight, and whether some of them also contain levels of zero weight."""
    if (levels.weight > 0).all():
        return list(levels.blocks), False
    weights = [(block, levels.weight[block.start : block.start + len(block.energies_mhz)]) for block in levels.blocks]
    existing = [(block, weight) for block, weight in weights if (weight > 0).any()]
    return [block for block, _ in existing], any((weight <= 0).any() for _, weight in existing)


def _rows(lines: Transitions, chosen: NDArray[np.bool_]) -> Transitions:
    rows = np.flatnonzero(chosen)
    upper, lower = (column[rows].astype(np.int32, copy=False) for column in (lines.upper, lines.lower))
    return Transitions(lines.frequency_mhz[rows], lines.strength_debye2[rows], upper, lower)


def _joined(pieces: Iterable[Transitions], cut: IntensityCut | None) -> Transitions:
    """All pieces; TooManyLinesError as soon as they have more lines than the cut allows."""
    parts, count, most_lines = list[Transitions](), 0, math.inf if cut is None else cut.most_lines
    for piece in pieces:
        parts.append(piece)
        count += len(piece.lower)
        if count > most_lines:
            raise TooManyLinesError(f"more than {most_lines:g} lines")
    if not parts:
        return Transitions(np.zeros(0), np.zeros(0), np.zeros(0, np.int32), np.zeros(0, np.int32))
    return Transitions(
        np.concatenate([p.frequency_mhz for p in parts]),
        np.concatenate([p.strength_debye2 for p in parts]),
        np.concatenate([p.upper for p in parts]),
        np.concatenate([p.lower for p in parts]),
    )


def _all_lines(pairs: list[Pair], between: Amplitudes) -> Transitions:
    """All lines of all pairs, written directly into columns of their final length."""
    sizes = [len(up.energies_mhz) * len(low.energies_mhz) for up, low in pairs]
    total = sum(sizes)
    # int32 halves the memory of rows
    out = Transitions(np.empty(total), np.empty(total), np.empty(total, np.int32), np.empty(total, np.int32))
    fill = _choose_fill(total)

    at = 0
    for (up, low), size in zip(pairs, sizes, strict=True):
        here = slice(at, at + size)
        at += size
        fill(
            up.energies_mhz, low.energies_mhz, between(up, [low]), up.start, low.start,
            out.frequency_mhz[here], out.strength_debye2[here], out.upper[here], out.lower[here],
        )  # fmt: skip
    return out


def _choose_fill(total: int) -> Callable[..., None]:
    """The compiled loop if loading it pays, or if it is loaded already; else the plain loop. Both give the same bits."""
    if total < LONG_LIST and COMPILED not in sys.modules:
        return _fill_pair
    from rotor.spectra.transitions._kernels import fill_pair

    compiled: Callable[..., None] = fill_pair
    return compiled


def _fill_pair(
    energies_up: Floats, energies_low: Floats, amplitude: Floats, start_up: int, start_low: int,
    frequency: Floats, strength: Floats, upper: Indices, lower: Indices,
) -> None:  # fmt: skip
    """Frequency, strength and states of all lines between two blocks; the upper state has the higher energy."""
    shape = amplitude.shape
    difference = np.subtract.outer(energies_up, energies_low)
    np.abs(difference, out=frequency.reshape(shape))
    np.multiply(amplitude, amplitude, out=strength.reshape(shape))

    first = np.arange(start_up, start_up + shape[0], dtype=np.int32)[:, None]
    second = np.arange(start_low, start_low + shape[1], dtype=np.int32)[None, :]
    falls = difference < 0
    upper.reshape(shape)[...] = np.where(falls, second, first)  # the upper state is the one of higher energy
    lower.reshape(shape)[...] = np.where(falls, first, second)


def _selected_lines(
    levels: Levels,
    pairs: list[Pair],
    between: Amplitudes,
    range_mhz: tuple[float, float],
    cut: IntensityCut | None,
) -> Transitions:
    """The lines of all pairs in a range and above a cut.

    Candidates are found without the photon factor (at most 1): their ν S reaches the requirement of the larger of both populations.
    They are then compared exactly.
    """
    needed = np.full(len(levels), -np.inf) if cut is None else cut.needed
    candidates = (_candidates(levels, up, lows, between(up, lows), needed, range_mhz) for up, lows in _by_upper(pairs))
    pieces = (_with_frequencies(levels, *batch, range_mhz, cut) for batch in _batches(candidates))
    return _joined(pieces, cut)


def _many_f_transitions(
    levels: Levels, blocks: list[SolvedBlock], dipoles: Mapping[tuple[int, int], Vector], range_mhz: tuple[float, float],
    cut: IntensityCut,
) -> Transitions | None:  # fmt: skip
    """All transitions of levels with spins that were solved for many F together; None for other levels."""
    needed = cut.needed
    if not blocks or blocks[0].spins is None or not (needed > 0).all():
        return None
    from rotor.quantum.spins.many_f_lines import amplitudes_of_groups, tensor_moments

    tensors = {states: body_tensor(mu, 1, str(levels.representation)) for states, mu in dipoles.items()}
    energies, needed = np.append(levels.energy_mhz, 0.0), np.append(needed, np.inf)
    first, last = range_mhz

    def in_range(up: Indices, low: Indices) -> NDArray[np.bool_]:
        frequency = np.abs(energies[up][:, :, None] - energies[low][:, None, :])
        return np.asarray((frequency >= first) & (frequency <= last))

    near = None if range_mhz == EVERYTHING else in_range
    groups = amplitudes_of_groups(blocks, tensor_moments(blocks[0].spins.shared, tensors), len(levels), near=near)
    space = Workspace()
    return _joined((_group_transitions(energies, needed, group, range_mhz, cut, space) for group in groups), cut)


def _group_transitions(
    energies: Floats, needed: Floats, group: ManyF, range_mhz: tuple[float, float], cut: IntensityCut, space: Workspace
) -> Transitions:
    """Lines between groups of blocks of many F in a range and above a cut (`_selected_lines`); padding of a group has amplitude 0."""
    up, low, amplitude, alike = group._replace(amplitudes=_real(group.amplitudes))
    strength = np.multiply(amplitude, amplitude, out=amplitude)
    difference = space.array("difference", *amplitude.shape)
    np.subtract(energies[up][:, :, None], energies[low][:, None, :], out=difference)
    reach = np.multiply(difference, strength, out=space.array("reach", *amplitude.shape))
    keep = np.abs(reach, out=reach) >= min(needed[up].min(), needed[low].min())
    if alike:
        keep &= up[:, :, None] > low[:, None, :]  # a block with itself contains each pair twice
    places = np.flatnonzero(keep)
    above = places // low.shape[1]
    below = above // up.shape[1] * low.shape[1] + places - above * low.shape[1]
    return _upward_lines(
        up.ravel()[above], low.ravel()[below], difference.ravel()[places], strength.ravel()[places], range_mhz, cut
    )


def _batches(pieces: Iterable[Rows]) -> Iterator[Rows]:
    """Pieces joined to some thousand lines each, so that their arrays stay in the processor's cache."""
    waiting: list[Rows] = []
    count = 0
    for piece in pieces:
        waiting.append(piece)
        count += len(piece[0])
        if count > BATCH:
            yield _side_to_side(waiting)
            waiting, count = [], 0
    if waiting:
        yield _side_to_side(waiting)


def _side_to_side(pieces: list[Rows]) -> Rows:
    first, second, strength = (np.concatenate(column) for column in zip(*pieces, strict=True))
    return first, second, strength


def _with_frequencies(
    levels: Levels, first: Places, second: Places, strength: Floats, range_mhz: tuple[float, float],
    cut: IntensityCut | None,
) -> Transitions:  # fmt: skip
    """Lines between rows of levels, in either order, that lie in the range and reach the cut."""
    difference = levels.energy_mhz[first] - levels.energy_mhz[second]
    return _upward_lines(first, second, difference, strength, range_mhz, cut)


def _upward_lines(
    first: Places, second: Places, difference: Floats, strength: Floats, range_mhz: tuple[float, float],
    cut: IntensityCut | None,
) -> Transitions:  # fmt: skip
    """Lines from energy differences (first minus second state), those in the range and above the cut, with ordered states."""
    exchange = (first ^ second) * (difference < 0)  # a quarter of the time of np.where
    upper, lower = first ^ exchange, second ^ exchange
    transitions = Transitions(np.abs(difference), strength, upper, lower)
    if cut is None:
        return transitions
    keep = cut.keeps(transitions.frequency_mhz, strength, cut.population[lower])
    if range_mhz != EVERYTHING:
        keep &= (transitions.frequency_mhz >= range_mhz[0]) & (transitions.frequency_mhz <= range_mhz[1])
    return _rows(transitions, keep)


def _by_upper(pairs: list[Pair]) -> Iterator[tuple[SolvedBlock, list[SolvedBlock]]]:
    """Each upper block with all lower blocks of its lines; lines inside a block are a separate item."""
    lows_of: dict[int, tuple[SolvedBlock, list[SolvedBlock]]] = {}
    for up, low in pairs:
        if up is low:
            yield up, [low]
        else:
            lows_of.setdefault(up.start, (up, []))[1].append(low)
    yield from lows_of.values()


def _candidates(
    levels: Levels,
    up: SolvedBlock,
    lows: list[SolvedBlock],
    amplitude: Floats,
    needed: Floats,
    range_mhz: tuple[float, float],
) -> Rows:
    """Lines between all states of a block and others in the range that may reach the cut."""
    rows = np.concatenate([np.arange(low.start, low.start + len(low.energies_mhz), dtype=np.int32) for low in lows])
    frequency = np.subtract.outer(up.energies_mhz, levels.energy_mhz[rows])
    np.abs(frequency, out=frequency)
    strength = amplitude * amplitude
    needed_up = needed[up.start : up.start + len(up.energies_mhz)]
    keep = frequency * strength >= np.minimum.outer(needed_up, needed[rows])
    if range_mhz != EVERYTHING:
        keep &= (frequency >= range_mhz[0]) & (frequency <= range_mhz[1])
    # a block with itself contains each pair twice
    places = np.flatnonzero(np.tril(keep, -1) if up is lows[0] else keep)
    i, k = np.divmod(places, len(rows))
    return (i + up.start).astype(np.int32), rows[k], strength.ravel()[places]


def _closed_form(
    levels: Levels,
    states: tuple[int, int],
    dipole_abc: Vector,
    range_mhz: tuple[float, float],
    cut: IntensityCut | None,
) -> Iterator[Transitions]:
    """Lines of linear and symmetric tops from one dipole; a spherical top without field or distortion has none."""
    if levels.kind == "spherical":
        return
    along, across2 = _split(levels.kind, dipole_abc)
    ways = [states, states[::-1]] if states[0] != states[1] else [states]
    rises = [(v, delta_j, delta_k, s2) for v in ways for delta_j, delta_k, s2 in _rises(along**2, across2)]
    if states[0] != states[1] and along:
        rises.append((states, 0, 0, along**2))
    for between, delta_j, delta_k, dipole2 in rises:
        first, second, strength = _hoenl_london(levels, delta_j, delta_k, between)
        difference = levels.energy_mhz[second] - levels.energy_mhz[first]
        frequency, strength = np.abs(difference), strength * dipole2
        upper, lower = np.where(difference < 0, first, second), np.where(difference < 0, second, first)

        keep = (frequency >= range_mhz[0]) & (frequency <= range_mhz[1])
        keep &= (levels.weight[lower] > 0) & (levels.weight[upper] > 0)
        if cut is not None:
            keep &= cut.keeps(frequency, strength, cut.population[lower])
        yield Transitions(frequency[keep], strength[keep], upper[keep].astype(np.int32), lower[keep].astype(np.int32))


def _rises(along2: float, across2: float) -> list[tuple[int, int, float]]:
    """(ΔJ, ΔK, squared dipole) of the branches, each line once."""
    steps = ((1, 0, along2), (0, 1, across2), (1, 1, across2), (1, -1, across2))
    return [(delta_j, delta_k, dipole2) for delta_j, delta_k, dipole2 in steps if dipole2]


def _split(kind: str, dipole_abc: tuple[float, float, float]) -> tuple[float, float]:
    """The dipole along the figure axis, and the square of the component across it."""
    a, b, c = dipole_abc
    if kind == "linear":
        return a, 0.0
    return (a, b * b + c * c) if FIGURE_AXIS[kind] == "a" else (c, a * a + b * b)


def _hoenl_london(
    levels: Levels, delta_j: int, delta_k: int, states: tuple[int, int] = (0, 0)
) -> tuple[NDArray[np.int64], NDArray[np.int64], Floats]:
    """Rows of (v, J, K) and (v', J + ΔJ, K + ΔK), and S summed over both signs of K, for a unit dipole.

    Parallel: [(J+1)² - K²]/(J+1) for R, (2J+1) K²/(J(J+1)) for Q (within a state Q has no change of energy). Perpendicular, with the
    squared dipole across the axis: (2J+1)(J∓K)(J±K+1)/(2J(J+1)) for Q, (J±K+1)(J±K+2)/(2(J+1)) for R, over both signs of K (the
    squares of `tensors.coupling`; W. Gordy and R. L. Cook, Microwave Molecular Spectra, table 2.1). Q with
    K - 1 is Q with K + 1 from the other level.
    """
    all_j = levels.quanta["j"]
    all_k = levels.quanta.get("k", np.zeros_like(all_j))
    to_j, to_k = all_j + delta_j, all_k + delta_k
    here = (to_j <= levels.jmax) & (to_k >= 0) & (to_k <= to_j)
    if "v" in levels.quanta:
        here &= levels.quanta["v"] == states[0]
    if delta_j == delta_k == 0:
        here &= all_k > 0
    first = np.nonzero(here)[0]
    target = {"j": to_j[first]} | ({"k": to_k[first]} if "k" in levels.quanta else {})
    if "v" in levels.quanta:
        target["v"] = np.full(len(first), states[1])
    second = levels.rows_of(**target)

    j, k = all_j[first].astype(float), all_k[first].astype(float)
    if delta_k == 0 and delta_j == 0:
        strength = 2.0 * (2 * j + 1) * k**2 / (j * (j + 1))  # ±K counts twice
    elif delta_k == 0:
        strength = np.where(k == 0, 1.0, 2.0) * ((j + 1) ** 2 - k**2) / (j + 1)
    elif delta_j:
        strength = (j + delta_k * k + 1) * (j + delta_k * k + 2) / (2 * (j + 1))
    else:
        strength = (2 * j + 1) * (j - k) * (j + k + 1) / (2 * j * (j + 1))
    return first, second, strength
