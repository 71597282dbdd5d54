"""Sums of line strengths between groups of levels that nearly coincide, which round-off mixes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rotor.formats.spcat.file_model import Group
from rotor.quantum.levels import Levels
from rotor.spectra.transitions.pairs import all_transitions

CLOSE = 1e-6  # of the largest energy; round-off of 1e-15 of it mixes closer levels by more than 1e-9


def groups_of_close(energies: Mapping[int, np.ndarray], size: float) -> dict[int, np.ndarray]:
    """The number of the group of each level, by 2F; energies rise."""
    return {f2: np.cumsum(np.diff(energy, prepend=energy[:1]) > CLOSE * size) for f2, energy in energies.items()}


def summed(strength: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Strengths (upper, lower level) added up by groups of both."""
    sums = np.zeros((rows[-1] + 1, columns[-1] + 1))
    np.add.at(sums, (rows[:, None], columns), strength)
    return sums


def compare_levels(
    groups: list[tuple[Group, Levels]], energies: Mapping[int, np.ndarray], size: float, text: str
) -> None:
    """AssertionError with the file where a level differs."""
    of_f = np.concatenate([np.repeat(levels.multiplicity - 1, levels.components) for _, levels in groups])
    computed = np.concatenate([np.repeat(levels.energy_mhz, levels.components) for _, levels in groups])
    for f2, energy in energies.items():
        np.testing.assert_allclose(np.sort(computed[of_f == f2]), energy, rtol=0, atol=1e-13 * size, err_msg=text)


def compare_lines(
    groups: list[tuple[Group, Levels]],
    energies: Mapping[int, np.ndarray],
    close: Mapping[int, np.ndarray],
    expected: Mapping[tuple[int, int], np.ndarray],
    text: str,
) -> int:
    """How many sums of strengths were compared, both ways; AssertionError with the file where one differs."""
    ours = {pair: np.zeros_like(sums) for pair, sums in expected.items()}
    for group, levels in groups:
        _add_lines(ours, group, levels, energies, close)
    largest, count = max(sums.max() for sums in expected.values()), 0
    for (f, g), sums in expected.items():
        mine = ours[f, g]
        if f == g:  # a line is listed once, from either level
            mine, sums = np.triu(mine + mine.T, 1), np.triu(sums, 1)
        wrong = np.abs(mine - sums) > 1e-9 * largest + 1e-7 * sums
        assert not wrong.any(), (text, f, g, mine[wrong], sums[wrong])
        count += int((sums > 1e-9 * largest).sum())
    return count


def _add_lines(
    ours: dict[tuple[int, int], np.ndarray],
    group: Group,
    levels: Levels,
    energies: Mapping[int, np.ndarray],
    close: Mapping[int, np.ndarray],
) -> None:
    """Add the lines of a group to the sums between groups of close levels."""
    of_f = (levels.multiplicity - 1).tolist()
    place = [
        close[f2][np.abs(energies[f2] - energy).argmin()]
        for f2, energy in zip(of_f, levels.energy_mhz.tolist(), strict=True)
    ]
    lines = all_transitions(levels, dict(group.effect.moments), moments=group.effect.others)
    for *rows, strength in zip(lines.upper.tolist(), lines.lower.tolist(), lines.strength_debye2.tolist(), strict=True):
        up, low = sorted(rows, key=lambda row: -of_f[row])
        ours[of_f[up], of_f[low]][place[up], place[low]] += strength
