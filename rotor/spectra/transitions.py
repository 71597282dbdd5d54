"""Pairs of states that make a line, with frequency and strength: from Wang blocks, or in closed form.

Nothing weak is left out here but what an `IntensityCut` or a range of frequencies excludes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Indices
from rotor.quantum.levels import Block, Levels
from rotor.quantum.moments import Moment
from rotor.quantum.reduced import amplitudes, connected_pairs, pairs_where
from rotor.quantum.tensors import body_tensor
from rotor.spectra.intensity import IntensityCut
from rotor.tops.operators import FIGURE_AXIS

EVERYTHING = (0.0, float("inf"))
LONG_LIST = 1_000_000  # lines above which the compiled loop is loaded

Vector = tuple[float, float, float]
Amplitudes = Callable[[Any, Any], Floats]  # of a pair of blocks, (n_up, n_low)
Pair = tuple[Block, Block]  # two blocks with an allowed transition, the one of higher or equal J first


@dataclass(frozen=True)
class Transitions:
    """Columns (n,): frequency in MHz, S μ² in D² over all components, rows of the two states in the levels."""

    frequency_mhz: Floats
    strength_debye2: Floats
    upper: Indices
    lower: Indices


def all_transitions(
    levels: Levels,
    dipoles_abc: Vector | Mapping[tuple[int, int], Vector],
    range_mhz: tuple[float, float] = EVERYTHING,
    cut: IntensityCut | None = None,
    moments: Sequence[Moment] = (),
) -> Transitions:
    """Every transition between `levels` that is allowed, in the range and above the cut, in no particular order.

    dipoles_abc: components of μ along a, b, c in debye; of several states by pairs (v', v), each pair once. moments: others, of
    levels that were solved with spins.
    """
    dipoles = dipoles_abc if isinstance(dipoles_abc, Mapping) else {(0, 0): dipoles_abc}
    if levels.representation is None:
        return _joined(list(_closed_form(levels, dipoles[0, 0], range_mhz, cut)))

    blocks, some_without = _blocks_with_weight(levels)
    pairs, between = _acting(levels, blocks, dipoles, moments)
    if cut is None and range_mhz == EVERYTHING and not any(up is low for up, low in pairs):
        found = _every_pair(pairs, between)
    else:
        found = _joined(list(_chosen(pairs, between, range_mhz, cut)))
    return _rows(found, levels.weight[found.lower] > 0) if some_without else found


def _acting(
    levels: Levels, blocks: list[Block], dipoles: Mapping[tuple[int, int], Vector], moments: Sequence[Moment]
) -> tuple[list[Pair], Amplitudes]:
    """Pairs of blocks that the moments connect, and the function that gives their amplitudes."""
    if moments:
        from rotor.quantum.spins.moments import moments_of

        found = moments_of(levels, dict(dipoles), moments)
        return list(pairs_where(blocks, 1, found.connected)), found.amplitudes
    representation = str(levels.representation)
    tensors = {states: body_tensor(mu, 1, representation) for states, mu in dipoles.items()}
    return list(connected_pairs(blocks, tensors)), lambda up, low: amplitudes(up, low, tensors)


def _blocks_with_weight(levels: Levels) -> tuple[list[Block], bool]:
    """Blocks in which a level exists by its spin weight, and whether one of them also holds levels that do not."""
    weights = [(block, levels.weight[block.start : block.start + len(block.energies_mhz)]) for block in levels.blocks]
    with_some = [(block, weight) for block, weight in weights if (weight > 0).any()]
    return [block for block, _ in with_some], any((weight <= 0).any() for _, weight in with_some)


def _rows(lines: Transitions, rows: NDArray[np.bool_]) -> Transitions:
    return Transitions(lines.frequency_mhz[rows], lines.strength_debye2[rows], lines.upper[rows], lines.lower[rows])


def _joined(pieces: list[Transitions]) -> Transitions:
    if not pieces:
        return Transitions(np.zeros(0), np.zeros(0), np.zeros(0, np.int32), np.zeros(0, np.int32))
    return Transitions(
        np.concatenate([p.frequency_mhz for p in pieces]),
        np.concatenate([p.strength_debye2 for p in pieces]),
        np.concatenate([p.upper for p in pieces]),
        np.concatenate([p.lower for p in pieces]),
    )


def _every_pair(pairs: list[Pair], between: Amplitudes) -> Transitions:
    """All lines of all pairs, written straight into columns of their final length."""
    sizes = [len(up.energies_mhz) * len(low.energies_mhz) for up, low in pairs]
    total = sum(sizes)
    out = Transitions(np.empty(total), np.empty(total), np.empty(total, np.int32), np.empty(total, np.int32))
    fill = _fill_of(total)

    at = 0
    for (up, low), size in zip(pairs, sizes, strict=True):
        here = slice(at, at + size)
        at += size
        fill(
            up.energies_mhz, low.energies_mhz, between(up, low), up.start, low.start,
            out.frequency_mhz[here], out.strength_debye2[here], out.upper[here], out.lower[here],
        )  # fmt: skip
    return out


def _fill_of(total: int) -> Callable[..., None]:
    """The compiled loop for lists so long that loading the compiler pays."""
    if total < LONG_LIST:
        return _fill_pair
    from rotor.spectra._kernels import fill_pair

    compiled: Callable[..., None] = fill_pair
    return compiled


def _fill_pair(
    energies_up: Floats, energies_low: Floats, amplitude: Floats, start_up: int, start_low: int,
    frequency: Floats, strength: Floats, upper: Indices, lower: Indices,
) -> None:  # fmt: skip
    """Frequency, strength and states of all lines between two blocks, the upper state being the one higher in energy."""
    shape = amplitude.shape
    difference = np.subtract.outer(energies_up, energies_low)
    np.abs(difference, out=frequency.reshape(shape))
    np.multiply(amplitude, amplitude, out=strength.reshape(shape))

    first = np.arange(start_up, start_up + shape[0], dtype=np.int32)[:, None]
    second = np.arange(start_low, start_low + shape[1], dtype=np.int32)[None, :]
    falls = difference < 0
    upper.reshape(shape)[...] = np.where(falls, second, first)
    lower.reshape(shape)[...] = np.where(falls, first, second)


def _chosen(
    pairs: list[Pair], between: Amplitudes, range_mhz: tuple[float, float], cut: IntensityCut | None
) -> Iterator[Transitions]:
    choose = _choice_of(sum(len(up.energies_mhz) * len(low.energies_mhz) for up, low in pairs))
    for up, low in pairs:
        energies = (up.energies_mhz, low.energies_mhz)
        strength = between(up, low) ** 2
        i, k = choose(*energies, strength, range_mhz, cut, up.start, low.start)
        if up is low:  # both ways round stand in the matrix
            i, k = i[i > k], k[i > k]

        difference = energies[0][i] - energies[1][k]
        first, second = (i + up.start).astype(np.int32), (k + low.start).astype(np.int32)
        falls = difference < 0
        upper, lower = np.where(falls, second, first), np.where(falls, first, second)
        yield Transitions(np.abs(difference), strength[i, k], upper, lower)


def _choice_of(total: int) -> Callable[..., tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """The compiled choice for lists so long that loading the compiler pays."""
    if total < LONG_LIST:
        return _choose
    from rotor.spectra._kernels import choose

    def compiled(
        up: Floats,
        low: Floats,
        strength: Floats,
        range_mhz: tuple[float, float],
        cut: IntensityCut | None,
        *starts: int,
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        cut = cut or IntensityCut(np.ones(max(starts) + max(len(up), len(low))), 1.0, -np.inf)
        rows = choose(up, low, strength, *range_mhz, cut.population, cut.kt_mhz, cut.least, *starts)
        return rows[0], rows[1]

    return compiled


def _choose(
    energies_up: Floats, energies_low: Floats, strength: Floats, range_mhz: tuple[float, float],
    cut: IntensityCut | None, start_up: int, start_low: int,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:  # fmt: skip
    """Rows and columns of the lines between two blocks that are in the range and above the cut."""
    difference = np.subtract.outer(energies_up, energies_low)
    frequency = np.abs(difference)
    keep = (frequency >= range_mhz[0]) & (frequency <= range_mhz[1])
    if cut is not None:
        of_up = cut.population[start_up : start_up + len(energies_up), None]
        of_low = cut.population[None, start_low : start_low + len(energies_low)]
        keep &= cut.keeps(frequency, strength, np.where(difference < 0, of_up, of_low))
    i, k = np.nonzero(keep)
    return i, k


def _closed_form(
    levels: Levels, dipole_abc: tuple[float, float, float], range_mhz: tuple[float, float], cut: IntensityCut | None
) -> Iterator[Transitions]:
    """Lines of linear and symmetric tops; a spherical top without field or distortion has none."""
    if levels.kind == "spherical":
        return
    along, across2 = _split(levels.kind, dipole_abc)
    for delta_j, delta_k, dipole2 in ((1, 0, along**2), (0, 1, across2), (1, 1, across2), (1, -1, across2)):
        if dipole2 == 0:
            continue
        first, second, strength = _hoenl_london(levels, delta_j, delta_k)
        difference = levels.energy_mhz[second] - levels.energy_mhz[first]
        frequency, strength = np.abs(difference), strength * dipole2
        upper, lower = np.where(difference < 0, first, second), np.where(difference < 0, second, first)

        keep = (frequency >= range_mhz[0]) & (frequency <= range_mhz[1]) & (levels.weight[lower] > 0)
        if cut is not None:
            keep &= cut.keeps(frequency, strength, cut.population[lower])
        yield Transitions(frequency[keep], strength[keep], upper[keep].astype(np.int32), lower[keep].astype(np.int32))


def _split(kind: str, dipole_abc: tuple[float, float, float]) -> tuple[float, float]:
    """The dipole along the figure axis, and the square of what is across it."""
    a, b, c = dipole_abc
    if kind == "linear":
        return a, 0.0
    return (a, b * b + c * c) if FIGURE_AXIS[kind] == "a" else (c, a * a + b * b)


def _hoenl_london(levels: Levels, delta_j: int, delta_k: int) -> tuple[NDArray[np.int64], NDArray[np.int64], Floats]:
    """Rows of J, K and of J + ΔJ, K + ΔK, and S summed over both signs of K, for a unit dipole.

    Parallel: [(J+1)² - K²]/(J+1) for R, nothing for Q (no change of energy). Perpendicular, with the square of the
    dipole across the axis: Q: (2J+1)(J∓K)(J±K+1)/(2J(J+1)), R: (J±K+1)(J±K+2)/(2(J+1)), over both signs of K (the
    squares of `tensors.coupling`; W. Gordy and R. L. Cook, Microwave Molecular Spectra, table 2.1). Q with
    K - 1 is Q with K + 1 from the other side.
    """
    all_j = levels.quanta["j"]
    all_k = levels.quanta.get("k", np.zeros_like(all_j))
    to_j, to_k = all_j + delta_j, all_k + delta_k
    first = np.nonzero((to_j <= levels.jmax) & (to_k >= 0) & (to_k <= to_j))[0]
    reached = {"j": to_j[first]} | ({"k": to_k[first]} if "k" in levels.quanta else {})
    second = levels.rows_of(**reached)

    j, k = all_j[first].astype(float), all_k[first].astype(float)
    if delta_k == 0:
        strength = np.where(k == 0, 1.0, 2.0) * ((j + 1) ** 2 - k**2) / (j + 1)
    elif delta_j:
        strength = (j + delta_k * k + 1) * (j + delta_k * k + 2) / (2 * (j + 1))
    else:
        strength = (2 * j + 1) * (j - k) * (j + k + 1) / (2 * j * (j + 1))
    return first, second, strength
