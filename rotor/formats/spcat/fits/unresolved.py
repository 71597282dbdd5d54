"""SPFIT's lines without resolved hyperfine structure: F below 0, and the last NXPAR parameters, which do not affect them.

The energy of such a level is that of the level |F| without the first-order contribution of the last NXPAR parameters, E - Σ p ∂E/∂p, and
its derivative by these parameters is 0 (`dnuadd` in the source of H. M. Pickett's program).

F = -1 stands for minus the sum of angular momenta before F, or N (`linein`); if |F| is below 10 and has no such level, the next F up to 9
are tried (`getblk`).
"""

from __future__ import annotations

import numpy as np

from rotor.arrays import Ints
from rotor.formats.spcat.file_quanta import Format
from rotor.formats.spcat.text.par import ParameterFile
from rotor.quantum.labelled import MissingLevelsError

HIGHEST_SEARCHED = 9  # highest F that is tried for a level with F below 0 if |F| has none


def excluded_parameters(file: ParameterFile) -> Ints:
    """Places of the last NXPAR parameter lines that follow no parameter before them."""
    first = len(file.parameters) - file.header.nxpar
    # a constrained parameter follows the last free one above it
    leaders = np.maximum.accumulate([0 if p.constrained else place for place, p in enumerate(file.parameters)])
    return np.flatnonzero(leaders >= first)


def spelled_out(labels: Ints, form: Format) -> Ints:
    """F of labels with F below 0, with -1 replaced by minus the sum of angular momenta before it."""
    before = -labels[:, -2 if form.spins > 1 and not form.aggregate else 0]
    return np.where((labels[:, -1] == -1) & (before < 0), before, labels[:, -1])


def refuse_far_f(labels: Ints, reduced: Ints, form: Format, names: tuple[str, ...], twice_spins: int) -> None:
    """Refuse labels with F below 0 whose |F| cannot result from N and the spins.

    labels (n, quanta): quantum numbers by level, N first. reduced (m,): places of labels with F below 0. form: format of the quantum
    numbers of the file. names: names of the columns. twice_spins: twice the sum of all spins.
    Raises MissingLevelsError with the first such label, and the places of all.
    """
    reduced_labels = labels[reduced]
    far = reduced[np.abs(-spelled_out(reduced_labels, form) - reduced_labels[:, 0]) > (twice_spins + 1) // 2]
    if len(far):
        first = " ".join(map(str, labels[far[0]].tolist()))
        text = f"there is no level {first} ({', '.join(names)}): F and N differ by more than the spins"
        raise MissingLevelsError(text, far)
