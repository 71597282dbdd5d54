"""Levels of SPFIT's files with spins or several states, for parameters that change: the model behind such a fit.

Every parameter line of the file is one constant, by the name that `file_effect` gives it. States that are connected are solved
together, F by F, and only those F in which a line has a level. A level is found by the quantum numbers that the file prints for it.

A label with F below 0 is a level of |F| without the last NXPAR parameters of the file, for lines whose hyperfine structure is not
resolved: E - Σ p ∂E/∂p over them, and no derivative by them. That is what SPFIT does (`getblk`, `dnuadd`, `linein` in H. M. Pickett's
program): where |F| is below 10 and has no such level, the next F up to 9 are looked through, and F = -1 means minus the sum of
angular momenta before F, or N.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.formats.spcat.file_lines import Format, format_of, quanta_of
from rotor.formats.spcat.file_model import Group, groups_of
from rotor.formats.spcat.int_file import IntensityFile, Request
from rotor.formats.spcat.par import ParameterFile
from rotor.formats.spcat.predict_states import line_names
from rotor.quantum.effect_units import unit_levels
from rotor.quantum.labelled import LevelModel
from rotor.quantum.levels import Levels
from rotor.quantum.rotation import solve_rotation
from rotor.quantum.spins.levels import levels_of_f
from rotor.quantum.unit_blocks import UnitBlocks

_NO_REQUEST = IntensityFile("", Request(), ())
_HIGHEST_SEARCHED = 9  # F up to which a level with F below 0 is looked for where |F| has none
_AT_ZERO = 1e-30  # MHz: a free parameter that starts at 0 must not be left out of the Hamiltonian


def groups_for_fit(file: ParameterFile) -> list[Group]:
    """The groups of connected states with every parameter line in, those of value 0 too; K limited as SPFIT does."""
    nonzero = tuple(replace(p, value=p.value or _AT_ZERO) for p in file.parameters)
    return groups_of(replace(file, parameters=nonzero), _NO_REQUEST, as_spcat=True)


def names_of_quanta(form: Format) -> tuple[str, ...]:
    """Names of the columns of quantum numbers in a .lin file: n, (k | ka, kc), (v), and those of spins.

    >>> names_of_quanta(Format(3, True, 1)), names_of_quanta(Format(1, False, 2))
    (('n', 'ka', 'kc', 'v', 'f'), ('n', 'f1', 'f'))
    """
    rotation = {1: ("n",), 2: ("n", "k"), 3: ("n", "ka", "kc")}[form.rotation]
    spins = [f"f{i}" for i in range(1, form.spins)] + ["f"] if form.spins else []
    if form.i_tot and len(spins) > 1:
        spins[-2] = "i_tot"
    if form.aggregate:
        spins = ["pattern", "f"]
    names = (*rotation, *(["v"] if form.states else []), *spins)
    return names if spins else ("j", *names[1:])


@dataclass(frozen=True)
class _Solved:
    """A group with the labels that lie in it: their places among all, the parameters that it has, and its blocks."""

    rows: Ints
    columns: Ints
    blocks: UnitBlocks


@dataclass(frozen=True)
class FileLevels(LevelModel):
    """Energies of the labelled levels of a file; names: its parameter lines as code#place.

    reduced : levels with F below 0. excluded : the parameters that are taken off them
    """

    names: tuple[str, ...]
    count: int
    solved: tuple[_Solved, ...]
    reduced: Ints
    excluded: Ints

    @classmethod
    def of(cls, file: ParameterFile, labels: Ints) -> FileLevels:
        """The model for labels as the file prints them.

        Raises ValueError for labels that no level has, with the first of them, and for what does not compute.
        """
        groups = groups_for_fit(file)
        form, names = format_of(file, groups), line_names(file)
        values = np.array([p.value for p in file.parameters])
        reduced = np.flatnonzero(labels[:, -1] < 0) if form.spins else np.zeros(0, np.int64)
        positive = labels.copy()
        positive[reduced, -1] = -_spelled_out(labels[reduced], form)
        parts = _parts(groups, form, positive, names, values)
        while len(lost := np.setdiff1d(np.arange(len(labels)), _found(parts))):
            if not np.isin(lost, reduced).all() or (positive[lost, -1] >= _HIGHEST_SEARCHED).any():
                first = " ".join(map(str, labels[int(lost[0])].tolist()))
                raise ValueError(f"there is no level {first} ({', '.join(names_of_quanta(form))}) in this model")
            positive[lost, -1] += 1
            parts = _parts(groups, form, positive, names, values)
        return cls(names, len(labels), tuple(parts), reduced, excluded_parameters(file))

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """See `LevelModel`."""
        energies, slopes = np.empty(self.count), np.zeros((self.count, len(self.names)))
        for part in self.solved:
            found, derived = part.blocks.levels(values_mhz[part.columns])
            energies[part.rows] = found
            slopes[part.rows[:, None], part.columns] = derived
        if len(self.reduced):
            rows, columns = self.reduced[:, None], self.excluded
            energies[self.reduced] -= slopes[rows, columns] @ values_mhz[columns]
            slopes[rows, columns] = 0.0
        return energies, slopes


def excluded_parameters(file: ParameterFile) -> Ints:
    """Those of the last NXPAR parameter lines that follow no parameter before them, and what is tied to these."""
    first = len(file.parameters) - file.header.nxpar
    leader, leaders = 0, []
    for place, parameter in enumerate(file.parameters):
        leader = leader if parameter.constrained else place
        leaders.append(leader)
    return np.flatnonzero(np.array(leaders) >= first)


def _spelled_out(labels: Ints, form: Format) -> Ints:
    """F of labels with F below 0, where -1 stands for the sum of angular momenta before it."""
    before = -labels[:, -2 if form.spins > 1 and not form.aggregate else 0]
    return np.where((labels[:, -1] == -1) & (before < 0), before, labels[:, -1])


def _parts(groups: Sequence[Group], form: Format, labels: Ints, names: Sequence[str], values: Floats) -> list[_Solved]:
    return [part for group in groups if (part := _with_labels(group, form, labels, names, values))]


def _found(parts: Sequence[_Solved]) -> Ints:
    return np.concatenate([part.rows for part in parts]) if parts else np.zeros(0, np.int64)


def _levels(group: Group, angular: Sequence[int]) -> Levels:
    """The levels of the doubled F, or J, that are listed, in blocks."""
    if group.spins:
        return levels_of_f(group.top, (group.effect,), angular, None, None)
    j = [value // 2 for value in angular]
    return solve_rotation(group.top, (group.effect,), min(j), max(j), in_blocks=True)


def _with_labels(group: Group, form: Format, labels: Ints, names: Sequence[str], values: Floats) -> _Solved | None:
    """The labels that lie in the group, found in its levels by the quantum numbers that the file prints; None without any."""
    here = _of_group(group, form, labels)
    if not len(here):
        return None
    total = labels[here, -1] if form.spins else labels[here, 0]
    half = sum(group.spins) % 2
    angular = tuple(sorted({2 * int(f) - half for f in total}))
    if min(angular) < 0:
        raise ValueError(f"F or J below 0 in the labels {labels[here[int(np.argmin(total))]].tolist()}")
    levels = _levels(group, angular)
    rows_by_label: dict[tuple[int, ...], int] = {}
    for negative in (True, False):
        for row, label in enumerate(map(tuple, quanta_of(group, levels, form, negative).tolist())):
            rows_by_label.setdefault(label, row)
    rows = np.array([_row(rows_by_label, tuple(label), form) for label in labels[here].tolist()])
    found = rows >= 0
    if not found.any():
        return None
    own = tuple(group.effect.parameters(group.top))
    columns = np.array([names.index(name) for name in own])
    blocks = unit_levels(group.top, levels, rows[found], own, np.where(values == 0, _AT_ZERO, values)[columns])
    return _Solved(here[found], columns, blocks)


def _of_group(group: Group, form: Format, labels: Ints) -> Ints:
    """Positions of the labels whose state is one of the group's."""
    if not form.states:
        return np.arange(len(labels))
    numbers = [state.number for state in group.states]
    return np.flatnonzero(np.isin(labels[:, form.rotation], numbers))


def _row(rows: dict[tuple[int, ...], int], label: tuple[int, ...], form: Format) -> int:
    """The row of a label, else of the one with the other sign of K, -1 where there is none."""
    if label in rows or form.rotation != 2:
        return rows.get(label, -1)
    turned = (label[0], -label[1], *label[2:])
    return rows.get(turned, -1)
