"""Energies of a top's level table in place of those of its constants, with spins or without."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.levels import Levels
from rotor.tops.states.level_table import LevelTable, tabulated_energies

if TYPE_CHECKING:
    from rotor.tops.top import Top


def as_tabulated(top: Top, effects: Sequence[QuantumEffect], rotation: Levels) -> Levels:
    """Solved levels of the rotation with the energies of the top's table, where it has one that holds for these effects.

    The table stands for the semi-rigid Hamiltonian of the top in all its states; spins do not change that.
    """
    if top.level_table is None or not _are_of_constants(top, effects):
        return rotation
    return with_tabulated_energies(rotation, top.level_table)


def _are_of_constants(top: Top, effects: Sequence[QuantumEffect]) -> bool:
    """Whether the effects without spins are those of the constants of a top and of its further states, no more and no other values."""
    plain = [effect for effect in effects if not effect.spins(top)]
    others = [effect for effect in plain if effect not in SEMI_RIGID]
    if len(plain) != len(SEMI_RIGID) + len(others):
        return False
    known = [dict(top.states.values)] if top.states else []
    return [dict(effect.parameters(top)) for effect in others] == known


def tabulated_line_errors(
    top: Top, levels: Levels, upper: NDArray[np.int32], lower: NDArray[np.int32]
) -> Floats | None:
    """One standard deviation (lines,) in MHz of lines between levels of the top's table; spins count as exact.

    nan where a level is not in the table; None where no table holds for these levels, or where it does not know what errors have in common.
    """
    table = top.level_table
    if table is None or table.own_error_mhz is None or not _are_of_constants(top, levels.effects):
        return None
    rows = _rows_of_table(table, levels)
    return table.line_errors(rows[upper], rows[lower])


def tabulated_level_errors(top: Top, levels: Levels) -> Floats | None:
    """One standard deviation (levels,) in MHz of energies from the top's table, nan for levels that it has not; None without a table."""
    table = top.level_table
    if table is None or not _are_of_constants(top, levels.effects):
        return None
    rows = _rows_of_table(table, levels)
    return np.where(rows >= 0, table.error_mhz[rows], np.nan)


def _rows_of_table(table: LevelTable, levels: Levels) -> Ints:
    """The row of each level in a table."""
    quanta = _labels_of_table(levels)
    return table.rows_of({name: quanta[name] for name in table.quanta})


def _labels_of_table(levels: Levels) -> dict[str, Ints]:
    """Quanta of levels by the names of a table, k of a symmetric top in Wang functions and j of one with spins among them."""
    quanta = dict(levels.quanta)
    if "k" not in quanta and "ka" in quanta:
        quanta["k"] = quanta["kc" if levels.kind == "oblate" else "ka"]
    return quanta | {"j": levels.rotational}


def with_tabulated_energies(levels: Levels, table: LevelTable) -> Levels:
    """The levels and their states with the energies of a table where it has the level."""
    energy, _ = tabulated_energies(table, _labels_of_table(levels), levels.energy_mhz)
    blocks = tuple(
        replace(block, energies_mhz=energy[block.start : block.start + len(block.energies_mhz)])
        for block in levels.blocks
    )
    return replace(levels, energy_mhz=energy, blocks=blocks)
