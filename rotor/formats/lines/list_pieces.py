"""Pieces of a line list larger than memory: what all of them share, ranges of J, and the lines of one range in Parquet files.

A piece contains the transitions whose lower J lies in its range; with spins, whose lower F does, since they mix N but not F.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from rotor import units
from rotor.arrays import Ints
from rotor.formats.atomic_write import atomic_path
from rotor.formats.tables import copy_columns
from rotor.quantum.effect import QuantumEffect, dipoles_by_state
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.levels import Levels
from rotor.quantum.solve import solve_levels
from rotor.quantum.spins.scheme import scheme_of
from rotor.spectra.intensity import highest_j, intensity_cut
from rotor.spectra.lines import Lines
from rotor.spectra.transitions.pairs import all_transitions, spin_functions, transition_count
from rotor.thermodynamics.sums.partition import PartitionFunction
from rotor.thermodynamics.sums.trusted_levels import are_trusted
from rotor.tops.top import Top

BATCH = 1 << 18  # lines of a piece in one file, and lines that are converted into text at once
MOST_TRANSITIONS = 1e11  # before the intensity cut; a few days of computation


@dataclass(frozen=True)
class Plan:
    """The input of all pieces, which can be sent to other processes.

    twice_spins: doubled sizes of the spins; with any, pieces are ranges of F, counted from the lowest, 0 or 1/2.
    """

    top: Top
    dipole_abc: tuple[float, float, float]
    jmax: int
    temperature_k: float
    partition: PartitionFunction
    min_lgint: float
    range_mhz: tuple[float, float]
    ground_mhz: float
    folder: Path
    quanta_names: tuple[str, ...]
    halves: frozenset[str]
    effects: tuple[QuantumEffect, ...] = SEMI_RIGID
    twice_spins: tuple[int, ...] = ()

    def piece(self, first: int, last: int, part: int = 0) -> Path:
        """The file of the lines with lower J (or number of the lower F) from `first` to `last`; of many lines that of a part."""
        letter, number = "f" if self.twice_spins else "j", f".{part}" if part else ""
        return self.folder / f"{letter}{first:04d}-{last:04d}{number}.parquet"

    @property
    def highest(self) -> int:
        """The highest J, or the number of the highest F."""
        return self.jmax + sum(self.twice_spins) // 2

    def levels(self, first: int, last: int) -> tuple[Levels, Ints]:
        """The levels of these J (or F), and the J (or number of F) of each."""
        if not self.twice_spins:
            levels = solve_levels(self.top, last, jmin=first, effects=self.effects)
            return levels, levels.rotational
        from rotor.quantum.spins.levels import levels_of_f

        half = sum(self.twice_spins) % 2
        all_f = range(2 * first + half, 2 * last + half + 1, 2)
        levels = levels_of_f(self.top, self.effects, all_f, (0, self.jmax))
        name = list(levels.quanta)[-1]
        return levels, (levels.quanta[name] - half) // 2 if name in levels.halves else levels.quanta[name]


def list_plan(start: Lines, jmax: int | None, least: float, range_mhz: tuple[float, float], folder: Path) -> Plan:
    """The input of all pieces; `start` is the list of J = 0, with its settings."""
    top, dipole, partition = start.top, start.top.dipole_abc_debye, start.partition
    assert dipole is not None  # line_list has refused a top without one
    jmax = highest_j(top, dipole, partition, least, jmax, start.levels.effects)
    if jmax < 1:
        raise ValueError(f"J max = {jmax}: expected 1 or more, J = 0 alone has no line")
    effects = start.levels.effects
    twice_spins = scheme_of(top, effects).twice
    if (count := transition_count(top, jmax, effects)) > MOST_TRANSITIONS:
        raise ValueError(
            f"J max {jmax}: about {count:.0e} transitions before the cut, more than {MOST_TRANSITIONS:.0e}; lower J max, or leave "
            "it out: it then follows from min_lgint"
        )
    ground = solve_levels(
        top, 3, effects=effects, vectors=False
    ).ground_mhz  # whatever the weights are, it is among these
    return Plan(
        top,
        dipole,
        jmax,
        start.temperature_k,
        partition,
        least,
        range_mhz,
        ground,
        folder,
        start.quanta_names,
        start.levels.halves,
        effects,
        twice_spins,
    )


def piece_ranges(plan: Plan, piece_lines: int) -> Iterator[tuple[int, int]]:
    """First and last lower J (or number of F) of the pieces, chosen for about `piece_lines` transitions in each."""
    # closed forms start at J = 0; their lists, of about J² lines, are one piece
    if plan.top.kind != "asymmetric" and not plan.twice_spins:
        yield 0, plan.jmax
        return
    components = sum(1 for mu in plan.dipole_abc if mu)
    first, count, functions = 0, 0.0, spin_functions(plan.top, plan.effects)
    for j in range(plan.highest + 1):
        count += 1.5 * components * ((j + 1) * functions) ** 2
        if (count >= piece_lines and j >= 3) or j == plan.highest:  # from J = 2 on every species has a level
            yield first, j
            first, count = j + 1, 0.0


def make_piece(plan: Plan, first: int, last: int) -> None:
    """Lines with lower J (or number of F) from `first` to `last`, as Parquet files of bounded length."""
    levels, totals = plan.levels(first, min(last + 1, plan.highest))
    trusted = are_trusted(plan.top, levels, plan.ground_mhz)
    if trusted.any():  # the others may lie far below the ground; without any there are no lines at all
        levels = replace(levels, weight=np.where(trusted, levels.weight, 0))
    cut = intensity_cut(levels, plan.partition, plan.min_lgint, plan.ground_mhz)
    dipoles = dipoles_by_state(plan.top, plan.dipole_abc, levels.effects)
    transitions = all_transitions(levels, dipoles, plan.range_mhz, cut)
    in_piece = np.minimum(totals[transitions.upper], totals[transitions.lower]) <= last
    in_piece &= trusted[transitions.upper] & trusted[transitions.lower]
    lines = Lines(
        plan.top,
        levels,
        transitions.frequency_mhz[in_piece],
        transitions.strength_debye2[in_piece],
        transitions.upper[in_piece],
        transitions.lower[in_piece],
        plan.temperature_k,
        plan.min_lgint,
        plan.range_mhz,
        plan.partition,
    )
    lines, rows = lines.sorted(), np.arange(len(lines))  # ranges of frequency are in few of the parts
    parts = [rows[start : start + BATCH] for start in range(0, len(rows), BATCH)] or [rows]
    for number, part in reversed(list(enumerate(parts))):  # the piece is complete with its first part
        with atomic_path(plan.piece(first, last, number)) as unfinished:
            copy_columns(_columns(plan, lines.where(part)), unfinished, "(FORMAT parquet)")


def _columns(plan: Plan, lines: Lines) -> dict[str, Any]:
    """The columns of `Lines`, energies and intensities from the lowest level of all J instead of that of the piece."""
    offset_mhz = lines.levels.ground_mhz - plan.ground_mhz if len(lines) else 0.0
    offset_k = offset_mhz / units.MHZ_PER_K
    error = lines.error_mhz
    return {
        "frequency_mhz": lines.frequency_mhz,
        **({} if error is None else {"error_mhz": error}),
        "lgint": lines.lgint - offset_k / plan.temperature_k / math.log(10),
        "energy_lower_cm": lines.energy_lower_cm + offset_mhz / units.MHZ_PER_CM,
        "g_upper": lines.g_upper,
        "einstein_a_per_s": lines.einstein_a_per_s,
        "strength_debye2": lines.strength_debye2,
        "intensity_cm_per_molecule": lines.intensity_cm_per_molecule * math.exp(-offset_k / plan.temperature_k),
    } | _quanta(lines)


def _quanta(lines: Lines) -> dict[str, Any]:
    columns = lines.levels.quanta_columns(lines.upper, "upper") | lines.levels.quanta_columns(lines.lower, "lower")
    return {name: column.astype(np.int16) for name, column in columns.items()}
