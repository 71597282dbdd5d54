"""Levels as an .egy file: energies from the Hamiltonian's zero, quantum numbers in the order of SPCAT.

Blocks are numbered as SPCAT numbers those of an asymmetric top whose species all exist, 4J + 1 to 4J + 4 for the species ee,
oe, oo, eo of (Ka, Kc); in other cases, with spins or states, in the order in which they first appear.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from rotor import units
from rotor.arrays import Ints
from rotor.formats.atomic_write import write_whole
from rotor.formats.provenance import provenance_record, write_beside
from rotor.formats.spcat.hamiltonian.states import species_numbers
from rotor.formats.spcat.text.egy import LevelList, format_egy
from rotor.quantum.levels import Levels
from rotor.quantum.request import SelectedLevels

_FIRST = ("n", "j", "k", "ka", "kc", "v")  # the order of SPCAT: rotation, state, then whatever spins add


def write_level_list(table: SelectedLevels, path: str | os.PathLike[str], settings: Mapping[str, Any]) -> None:
    """Write levels as an .egy file, their provenance beside it; ValueError for labels that are no numbers (irreps)."""
    write_whole(path, format_egy(level_list(table)))
    write_beside(path, provenance_record(table, settings))


def level_list(table: SelectedLevels) -> LevelList:
    """Levels as the list of an .egy file, in order of block and energy.

    >>> from rotor.formats.spcat.text.egy import format_level
    >>> from rotor.quantum.request import LevelsRequest, answer_levels
    >>> from rotor.tops.top import Top
    >>> answer = answer_levels(LevelsRequest(Top.from_constants("A=10 B=6 C=4 GHz"), jmin=1, jmax=1))
    >>> format_level(level_list(answer.table).level(0)).split()
    ['6', '1', '0.533703', '0.000000', '1.000000', '3:', '1', '1', '0']
    """
    levels, rows = table.levels, table.rows
    if "irrep" in levels.quanta:
        raise ValueError("an .egy file labels levels by numbers; these have an irrep: write .csv, .parquet or .json")
    names = [name for name in _FIRST if name in levels.quanta]
    names += [name for name in levels.quanta if name not in names]
    doubled = [(levels.quanta[n] + 1) // 2 if n in levels.halves else levels.quanta[n] for n in names]
    block = _blocks(levels)
    order = np.lexsort((levels.energy_mhz, block))
    rank = np.empty(len(levels), dtype=np.int64)
    starts = np.searchsorted(block[order], block[order], side="left")
    rank[order] = np.arange(len(levels)) - starts + 1
    chosen = rows[np.lexsort((rank[rows], block[rows]))]
    return LevelList(
        block=block[chosen].astype(np.int32),
        rank=rank[chosen].astype(np.int32),
        energy_cm=levels.energy_mhz[chosen] / units.MHZ_PER_CM,
        error_cm=np.zeros(len(chosen)),
        mixing=levels.shares[chosen],
        degeneracy=levels.degeneracy[chosen].astype(np.int32),
        quanta=np.stack(doubled, axis=1)[chosen].astype(np.int16),
    )


def _blocks(levels: Levels) -> Ints:
    """The number of the block that each level belongs to."""
    quanta = levels.quanta
    if tuple(quanta) == ("j", "ka", "kc"):
        return np.asarray(4 * quanta["j"] + 1 + species_numbers(quanta["ka"], quanta["kc"], False))
    last = "f" if "f" in quanta else "n" if "n" in quanta else "j"
    keys = np.stack([quanta[last], *(quanta[name] % 2 for name in ("ka", "kc") if name in quanta)], axis=1)
    _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    place = np.empty(len(first), dtype=np.int64)
    place[np.argsort(first, kind="stable")] = np.arange(len(first)) + 1
    return np.asarray(place[number.reshape(-1)])
