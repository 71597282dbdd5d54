"""SPFIT's lines whose hyperfine structure is not resolved: F below 0, and the NXPAR parameters at the end that do not count for them.

In SPFIT the energy of such a level is that of the level |F| less what the last NXPAR parameters add to it to first order,
E - Σ p ∂E/∂p, and these parameters have no derivative (`dnuadd` in H. M. Pickett's program, whose source this was read from). Here
those parameters, and the outer spins that no other one needs, are left out of the Hamiltonian: the same to second order, and the
blocks are smaller by the number of spin functions. Where spins cannot be left out (two equivalent ones in a total spin, numbered
coupling patterns) the levels are computed as SPFIT does.

F = -1 means minus the sum of angular momenta before F, or N (`linein`); where |F| is below 10 and has no such level, the next F
up to 9 are looked through (`getblk`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rotor.arrays import Ints
from rotor.formats.spcat.codes import split_code
from rotor.formats.spcat.file_lines import Format
from rotor.formats.spcat.states import doubled_spins
from rotor.formats.spcat.text.par import Options, ParameterFile

HIGHEST_SEARCHED = 9  # F up to which a level with F below 0 is looked for where |F| has none


class Inner(NamedTuple):
    """A file without its last NXPAR parameters and the spins that they alone need.

    columns : its parameters among those of the whole file. width : quantum numbers that are left
    """

    file: ParameterFile
    columns: Ints
    width: int


def excluded_parameters(file: ParameterFile) -> Ints:
    """Those of the last NXPAR parameter lines that follow no parameter before them."""
    first = len(file.parameters) - file.header.nxpar
    leaders = np.maximum.accumulate([0 if p.constrained else place for place, p in enumerate(file.parameters)])
    return np.flatnonzero(leaders >= first)


def spelled_out(labels: Ints, form: Format) -> Ints:
    """F of labels with F below 0, where -1 stands for the sum of angular momenta before it."""
    before = -labels[:, -2 if form.spins > 1 and not form.aggregate else 0]
    return np.where((labels[:, -1] == -1) & (before < 0), before, labels[:, -1])


def inner_file(file: ParameterFile, form: Format) -> Inner | None:
    """The file that gives the levels of such lines; None where no spin can be left out.

    >>> from rotor.formats.spcat.text.par import read_par
    >>> made = read_par(b"t\\n 3 1 1 2\\na 44 1 0 5\\n 10000 9e3 1\\n 110010000 3 1\\n 220010000 3 1\\n")
    >>> found = inner_file(made, Format(3, False, 2))
    >>> found.file.options[0].spind, found.columns.tolist(), found.width
    (1, [0], 3)
    """
    if form.i_tot or form.aggregate:
        return None
    columns = np.setdiff1d(np.arange(len(file.parameters)), excluded_parameters(file))
    rest = tuple(file.parameters[i] for i in columns.tolist())
    states = max(abs(file.options[0].nvib), 1)
    digits = [split_code(p.code, states) for p in rest]
    needed = max((max(d.i1, d.i2, 1 if d.ns else 0) for d in digits), default=0)
    if needed >= form.spins:
        return None
    made = replace(file, options=tuple(_with_spins(one, needed) for one in file.options), parameters=rest)
    return Inner(made, columns, form.before_spins + needed)


def _with_spins(options: Options, count: int) -> Options:
    """The options with the first `count` spins, which stand at the end of SPIND."""
    spins = doubled_spins(options.spind)[:count]
    sizes = [twice + 1 for twice in reversed(spins)]
    text = "".join(map(str, sizes)) if max(sizes, default=0) < 10 else "".join(f"{size:02d}" for size in sizes) + "0"
    return replace(options, spind=(-1 if options.spind < 0 else 1) * int(text or "1"))


def refuse_far_f(labels: Ints, form: Format, names: tuple[str, ...], twice_spins: int) -> None:
    """Refuse labels with F below 0 whose |F| no coupling of N with the spins gives.

    Parameters
    ----------
    labels : (n, quanta) array
        Quantum numbers by line, N first.
    form : Format
        Of the quantum numbers of the file.
    names : tuple of str
        Of the columns.
    twice_spins : int
        Twice the sum of all spins.

    Raises
    ------
    ValueError
        With the first such label.
    """
    far = np.abs(-spelled_out(labels, form) - labels[:, 0]) > (twice_spins + 1) // 2
    if far.any():
        first = " ".join(map(str, labels[int(np.argmax(far))].tolist()))
        raise ValueError(f"there is no level {first} ({', '.join(names)}): F and N differ by more than the spins")
