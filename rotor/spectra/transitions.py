"""Pairs of states that make a line, with frequency and strength: from Wang blocks, or in closed form.

Nothing weak is left out here but what an `IntensityCut` or a range of frequencies excludes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Indices
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.tensors import BodyTensor, amplitudes, body_tensor, connected_pairs

EVERYTHING = (0.0, float("inf"))
LONG_LIST = 1_000_000  # lines above which the compiled loop is loaded

Pair = tuple[SolvedBlock, SolvedBlock]  # two blocks with an allowed transition, the one of higher or equal J first


@dataclass(frozen=True)
class Transitions:
    """Columns (n,): frequency in MHz, S μ² in D² over all components, rows of the two states in the levels."""

    frequency_mhz: Floats
    strength_debye2: Floats
    upper: Indices
    lower: Indices


@dataclass(frozen=True)
class IntensityCut:
    """What an intensity needs besides frequency and strength, and the least one wanted.

    population: (levels,) intensity per MHz and D² of a line from each state, the photon factor apart. kt_mhz: kT/h.
    """

    population: Floats
    kt_mhz: float
    least: float

    def keeps(self, frequency_mhz: Floats, strength: Floats, population: Floats) -> NDArray[np.bool_]:
        """Which lines are strong enough."""
        scaled = frequency_mhz * strength * population
        return scaled * -np.expm1(-frequency_mhz / self.kt_mhz) >= self.least


def all_transitions(
    levels: Levels,
    dipole_abc: tuple[float, float, float],
    range_mhz: tuple[float, float] = EVERYTHING,
    cut: IntensityCut | None = None,
) -> Transitions:
    """Every transition between `levels` that is allowed, in the range and above the cut, in no particular order.

    dipole_abc: components of μ along a, b, c in debye.
    """
    if levels.representation is None:
        return _joined(list(_closed_form(levels, dipole_abc, range_mhz, cut)))

    dipole = body_tensor(dipole_abc, 1, levels.representation)
    pairs = list(connected_pairs((block for block in levels.blocks if levels.weight[block.start] > 0), dipole))
    if cut is None and range_mhz == EVERYTHING:
        return _every_pair(pairs, dipole)
    return _joined(list(_chosen(pairs, dipole, range_mhz, cut)))


def _joined(pieces: list[Transitions]) -> Transitions:
    if not pieces:
        return Transitions(np.zeros(0), np.zeros(0), np.zeros(0, np.int32), np.zeros(0, np.int32))
    return Transitions(
        np.concatenate([p.frequency_mhz for p in pieces]),
        np.concatenate([p.strength_debye2 for p in pieces]),
        np.concatenate([p.upper for p in pieces]),
        np.concatenate([p.lower for p in pieces]),
    )


def _every_pair(pairs: list[Pair], dipole: BodyTensor) -> Transitions:
    """All lines of all pairs, written straight into columns of their final length."""
    sizes = [up.basis.size * low.basis.size for up, low in pairs]
    total = sum(sizes)
    out = Transitions(np.empty(total), np.empty(total), np.empty(total, np.int32), np.empty(total, np.int32))
    fill = _fill_of(total)

    at = 0
    for (up, low), size in zip(pairs, sizes, strict=True):
        here = slice(at, at + size)
        at += size
        fill(
            up.energies_mhz, low.energies_mhz, amplitudes(up, low, dipole), up.start, low.start,
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
    pairs: list[Pair], dipole: BodyTensor, range_mhz: tuple[float, float], cut: IntensityCut | None
) -> Iterator[Transitions]:
    choose = _choice_of(sum(up.basis.size * low.basis.size for up, low in pairs))
    for up, low in pairs:
        energies = (up.energies_mhz, low.energies_mhz)
        strength = amplitudes(up, low, dipole) ** 2
        i, k = choose(*energies, strength, range_mhz, cut, up.start, low.start)

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
    for rise, step, dipole2 in ((1, 0, along**2), (0, 1, across2), (1, 1, across2), (1, -1, across2)):
        if dipole2 == 0:
            continue
        first, second, strength = _hoenl_london(levels, rise, step)
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
    return (a, b * b + c * c) if kind == "prolate" else (c, a * a + b * b)


def _hoenl_london(levels: Levels, rise: int, step: int) -> tuple[NDArray[np.int64], NDArray[np.int64], Floats]:
    """Rows of J, K and of J + rise, K + step, and S summed over both signs of K, for a unit dipole.

    Parallel: [(J+1)² - K²]/(J+1) for R, nothing for Q (no change of energy). Perpendicular, with the square of the
    dipole across the axis: Q: (2J+1)(J∓K)(J±K+1)/(2J(J+1)), R: (J±K+1)(J±K+2)/(2(J+1)), over both signs of K (the
    squares of `tensors.coupling`; W. Gordy and R. L. Cook, Microwave Molecular Spectra, table 2.1). Q with
    K - 1 is Q with K + 1 from the other side. The levels must start at J = 0.
    """
    all_j, all_k = levels.j, np.maximum(levels.ka, 0)
    first = np.nonzero((all_j + rise <= levels.jmax) & (all_k + step >= 0) & (all_k + step <= all_j + rise))[0]
    to_j, to_k = all_j[first] + rise, all_k[first] + step
    second = to_j if levels.kind == "linear" else to_j * (to_j + 1) // 2 + to_k

    j, k = all_j[first].astype(float), all_k[first].astype(float)
    if step == 0:
        strength = np.where(k == 0, 1.0, 2.0) * ((j + 1) ** 2 - k**2) / (j + 1)
    elif rise:
        strength = (j + step * k + 1) * (j + step * k + 2) / (2 * (j + 1))
    else:
        strength = (2 * j + 1) * (j - k) * (j + k + 1) / (2 * j * (j + 1))
    return first, second, strength
