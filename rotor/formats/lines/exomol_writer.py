"""A line list in ExoMol's form: levels (.states), transitions (.trans beside it) and Q(T) (.pf beside it).

J. Tennyson et al., J. Mol. Spectrosc. 327, 73 (2016): a level has a number from 1, an energy above the lowest (cm⁻¹), its degeneracy with
the weight of the nuclear spins, J, and further labels; a transition has the numbers of its upper and lower level, the Einstein coefficient
(1/s) and, in a fourth column, its wavenumber (cm⁻¹). Transitions are written some thousand at a time.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from rotor import units
from rotor.formats.atomic_write import open_atomic
from rotor.formats.provenance import provenance_record, write_beside
from rotor.observed.model.partition import top_partition
from rotor.spectra.lines import Lines

SUFFIX = ".states"
_PIECE = 1 << 15


def write_exomol(lines: Lines, path: str | os.PathLike[str], settings: Mapping[str, Any] | None = None) -> None:
    """Write the levels of a line list, and its transitions and Q(T) beside, named as ExoMol names them.

    Raises ValueError for lines that spins split: the form's J is then not the first quantum number of the labels.
    """
    quanta, target = lines.levels.quanta, Path(path)
    if "n" in quanta or "j" not in quanta:
        raise ValueError(
            f"{target.name}: lines split by spins (labels {' '.join(quanta)}); ExoMol's states have J and labels: leave the hyperfine "
            "structure out, or write a .cat file, which holds F"
        )
    base = target.name.removesuffix(SUFFIX)
    used = np.unique(np.concatenate([lines.upper, lines.lower]))
    with open_atomic(target.with_name(f"{base}.trans")) as handle:
        wavenumber, a = lines.frequency_mhz / units.MHZ_PER_CM, lines.einstein_a_per_s
        for start in range(0, len(lines), _PIECE):
            part = slice(start, start + _PIECE)
            numbers = (np.searchsorted(used, rows[part]) + 1 for rows in (lines.upper, lines.lower))
            rows = zip(*(each.tolist() for each in (*numbers, a[part], wavenumber[part])), strict=True)
            handle.write(b"".join(b"%12d %12d %10.4e %15.6f\n" % row for row in rows))
    table = top_partition(lines.top)
    with open_atomic(target.with_name(f"{base}.pf")) as handle:
        rows = zip(table.temperature_k.tolist(), table.q.tolist(), strict=True)
        handle.write(b"".join(b"%9.3f %15.4f\n" % row for row in rows))
    with open_atomic(target) as handle:
        handle.write(_states(lines, used))
    write_beside(target, provenance_record(lines, settings or {}))


def refuse_exomol(path: Path) -> NoReturn:
    """Raise ValueError with the content of the file and the command that reads it."""
    raise ValueError(
        f"{path}: a line list of ExoMol (levels and transitions), which has neither constants nor a dipole to make a top of; enter it in a "
        f"local catalogue (rotor catalogue add X.states --catalogue lines.rotorcat), whose species emission and identify read"
    )


def _states(lines: Lines, used: np.ndarray) -> bytes:
    """Text of the levels that occur in lines, with J as the first label."""
    levels = lines.levels
    energy = levels.energy_mhz[used] / units.MHZ_PER_CM
    labels = [levels.quanta["j"][used], *(values[used] for name, values in levels.quanta.items() if name != "j")]
    columns = (energy.tolist(), levels.degeneracy[used].tolist(), *(values.tolist() for values in labels))
    text = [
        f"{number:12d} {e:12.6f} {g:6d} {j:7d}{''.join(f' {label:4d}' for label in others)}\n"
        for number, (e, g, j, *others) in enumerate(zip(*columns, strict=True), start=1)
    ]
    return "".join(text).encode("ascii")
