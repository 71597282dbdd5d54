"""Levels of SPFIT's files with spins or several states as functions of the parameters, for fits.

Each parameter line of the file is a constant, named as in `entries`. Connected states are solved together, for those F in which a line
has a level. Levels are identified by the quantum numbers that the file lists. Levels of lines without resolved hyperfine structure have F
below 0.

The energy of such a level is that of the level |F| without the first-order contribution of the last NXPAR parameters, E - Σ p ∂E/∂p, and
its derivative by these parameters is 0 (`dnuadd` in the source of H. M. Pickett's program). F = -1 stands for minus the sum of angular
momenta before F, or N (`linein`); if |F| is below 10 and has no such level, the next F up to 9 are tried (`getblk`).

A fit may leave out parameters of value 0 that shift no level to first order, and only enlarge blocks. A block of states without spins is a
set of (state, symmetry under the twofold rotations) that nonzero parameters connect. A parameter of value 0 between two such sets shifts
levels only by its square: its derivative is 0 at the start, and a fit does not move it. If levels of two sets coincide, as the two of one
K do at high K, round-off would mix them and give a spurious derivative.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from operator import add
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats, Ints, distinct, matching_rows
from rotor.fitting.assignment import Assignments
from rotor.fitting.choice.unmeasured import measured_range, without_measured
from rotor.formats.spcat.file_model import Group, connected_groups
from rotor.formats.spcat.file_quanta import Format, listed_quanta, quanta_format
from rotor.formats.spcat.hamiltonian.code_table import Digits, Kind
from rotor.formats.spcat.hamiltonian.coded_file import CodedFile, coded_file, line_names
from rotor.formats.spcat.hamiltonian.codes import is_held
from rotor.formats.spcat.hamiltonian.l_doubled import functions_by_l, named_by_l
from rotor.formats.spcat.hamiltonian.labels import (
    has_other_names,
    named_by,
    naming_by,
    over_basis,
    spin_naming_by,
)
from rotor.formats.spcat.text.int_file import IntensityFile, Request
from rotor.formats.spcat.text.par import ParameterFile
from rotor.quantum.blocks.connected import connected_parts
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.estimates.effect_units import Functions, assigned_with_spins, unit_levels
from rotor.quantum.labels.labelled import AT_ZERO_MHZ, ClosedForm, LevelModel, MissingLevelsError
from rotor.quantum.labels.tracking import AssignedLevels, TrackedLevels, labelled_states
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.spins.levels import levels_of_f, unmixed_levels
from rotor.quantum.wang.rotation import solve_rotation

if TYPE_CHECKING:
    from rotor.quantum.labels.tracking import LevelBlocks


_SYMMETRIES = 4  # species of the group of twofold rotations; an operator of symmetry s connects t with s ^ t


def left_at_zero(file: ParameterFile) -> frozenset[int]:
    """Places of parameters of value 0 that are held, or that connect otherwise unconnected sets and therefore remain 0."""
    coded = coded_file(file)
    edges = [_edges(coded, digits) for digits in coded.digits]
    acting = (edge for each, p in zip(edges, file.parameters, strict=True) if p.value for edge in each)
    parts = connected_parts(_SYMMETRIES * len(coded.states), acting)
    set_of_node = {node: number for number, part in enumerate(parts) for node in part}
    apart = [bool(each) and all(set_of_node[a] != set_of_node[b] for a, b in each) for each in edges]
    return frozenset(
        i for i, p in enumerate(file.parameters) if not p.value and (p.constrained or is_held(p) or apart[i])
    )


def stay_at_zero(file: ParameterFile) -> list[str]:
    """Labels of the free parameters that remain 0."""
    remaining = [file.parameters[i] for i in sorted(left_at_zero(file))]
    return [p.label or str(p.code) for p in remaining if not (p.constrained or is_held(p))]


def _edges(coded: CodedFile, digits: Digits) -> list[tuple[int, int]]:
    """The pairs of sets 4 v + symmetry that a code without spins connects between definite states; none for others."""
    both = digits.states
    if both is None or max(both) >= len(coded.states) or any(state.spins for state in coded.states) or coded.pairs:
        return []
    if digits.is_series or digits.is_constant or digits.kind is Kind.LEVEL:
        return []
    symmetry = ("", "a", "b", "c").index(digits.tensor.axis)
    low, high = (_SYMMETRIES * v for v in both)
    return [(low + species, high + (species ^ symmetry)) for species in range(_SYMMETRIES)]


_NO_REQUEST = IntensityFile("", Request(), ())


def groups_for_fit(file: ParameterFile) -> list[Group]:
    """Groups of connected states, with all parameter lines that a fit may move from 0; K is limited as in SPFIT."""
    left = left_at_zero(file)
    nonzero = tuple(p if i in left else replace(p, value=p.value or AT_ZERO_MHZ) for i, p in enumerate(file.parameters))
    return connected_groups(replace(file, parameters=nonzero), _NO_REQUEST)


def quanta_names(form: Format) -> tuple[str, ...]:
    """Names of the columns of quantum numbers in a .lin file: n, (k | ka, kc), (v), and sums with spins.

    >>> quanta_names(Format(3, True, 1)), quanta_names(Format(1, False, 2))
    (('n', 'ka', 'kc', 'v', 'f'), ('n', 'f1', 'f'))
    """
    rotation = {1: ("n",), 2: ("n", "k"), 3: ("n", "ka", "kc")}[form.rotation]
    spins = [f"f{i}" for i in range(1, form.spins)] + ["f"] if form.spins else []
    if form.equivalent and len(spins) > 1:
        spins[-2] = "i_tot"
    if form.equivalent == 3:
        spins[-3] = "i_sym"
    if form.aggregate:
        spins = ["pattern", "f"]
    names = (*rotation, *(["v"] if form.states else []), *spins)
    return names if spins else ("j", *names[1:])


@dataclass(frozen=True)
class FileLevels(LevelModel):
    """Energies of the labelled levels of a file; names: parameter lines as code#place.

    reduced: levels with F below 0. excluded: parameters whose contribution to them is subtracted.
    """

    names: tuple[str, ...]
    whole: TrackedLevels
    reduced: Ints
    excluded: Ints

    @classmethod
    def from_labels(cls, file: ParameterFile, labels: Ints) -> FileLevels:
        """The model for labels as the file lists them.

        Raises ValueError for labels without a level, with the first of them, and for unsupported parameters.
        """
        groups = groups_for_fit(file)
        form = quanta_format(file, groups)
        reduced = np.flatnonzero(labels[:, -1] < 0) if form.spins else np.zeros(0, dtype=np.int64)
        if len(reduced):
            refuse_far_f(labels, reduced, form, quanta_names(form), max(sum(group.spins) for group in groups))
        return cls(line_names(file), _searched(file, groups, form, labels, reduced), reduced, excluded_parameters(file))

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """Energies and derivatives, see `LevelModel`."""
        energies, slopes = self.whole.levels(values_mhz)
        if len(self.reduced):
            rows, columns = self.reduced[:, None], self.excluded
            energies[self.reduced] -= slopes[rows, columns] @ values_mhz[columns]
            slopes[rows, columns] = 0.0
        return energies, slopes


def _searched(file: ParameterFile, groups: Sequence[Group], form: Format, labels: Ints, reduced: Ints) -> TrackedLevels:
    """Assign the labels to the levels of the groups; `reduced` labels have F below 0."""
    positive = labels.copy()
    positive[reduced, -1] = -spelled_out(labels[reduced], form) if len(reduced) else 0
    names, values = line_names(file), np.array([p.value for p in file.parameters])
    while True:
        parts = [part for group in groups for part in _with_labels(group, form, positive, names, values)]
        levels = TrackedLevels.from_parts(names, parts, len(labels))
        lost = np.flatnonzero(levels.without_level)
        if not len(lost):
            return levels
        none = lost[~np.isin(lost, reduced) | (positive[lost, -1] >= HIGHEST_SEARCHED)]
        if len(none):
            raise _no_level(labels, none, f" ({', '.join(quanta_names(form))}) in this model")
        positive[lost, -1] += 1


def _no_level(labels: Ints, places: Ints, why: str) -> MissingLevelsError:
    """The error for labels at these places, which have no level."""
    return MissingLevelsError(f"there is no level {' '.join(map(str, labels[places[0]].tolist()))}{why}", places)


def levels_in_blocks(group: Group, angular: Sequence[int]) -> Levels:
    """The levels of the listed doubled F (or J), in blocks; without spins with the labels of DIAG."""
    if group.spins:
        return levels_of_f(group.top, (group.effect,), angular, None, None)
    j = [value // 2 for value in angular]
    return group.named(solve_rotation(group.top, (group.effect,), min(j), max(j), in_blocks=True))


def _with_labels(
    group: Group, form: Format, labels: Ints, names: Sequence[str], values: Floats
) -> list[AssignedLevels]:
    """Assign labels to the levels of a group by their quantum numbers, a few F at a time."""
    here = np.arange(len(labels))
    if form.states:
        here = np.flatnonzero(np.isin(labels[:, form.rotation], [state.number for state in group.states]))
    if not len(here):
        return []
    total = labels[here, -1] if form.spins else labels[here, 0]
    if (total < 0).any():  # a difference of F below 0 marks a level that does not exist
        raise _no_level(labels, here[total < 0], ": F or J is below 0")
    twice = 2 * total - sum(group.spins) % 2  # F is listed rounded up: doubled, less the half
    parameters = tuple(group.effect.parameters(group.top))
    columns = np.array([names.index(name) for name in parameters])
    # derivatives of a parameter at 0 need a small value to exist
    start = np.where(values == 0, AT_ZERO_MHZ, values)[columns]
    if group.diag >= 0 and _direct(group, form):
        return [AssignedLevels(here, columns, _assign_without_spins(group, form, labels[here], parameters, start))]
    assign = _assign_with_spins if group.diag >= 0 and group.spins else _assign_in_blocks
    assigned = assign(group, form, labels[here], twice, parameters, start)
    return [AssignedLevels(here[rows], columns, blocks) for rows, blocks in assigned]


def _direct(group: Group, form: Format) -> bool:
    """Whether the labels are J, Ka, Kc and the state, without spins and without unsigned K."""
    plain = not (group.spins or form.spins or group.effect.pairs) and form.rotation == 3 and group.top.kind != "linear"
    return plain and not any(state.is_e(np.arange(state.fold + 1)).any() for state in group.states)


def _assign_without_spins(
    group: Group, form: Format, labels: Ints, parameters: tuple[str, ...], start: Floats
) -> LevelBlocks:
    """Blocks of labels, for states without spins."""
    place = {state.number: v for v, state in enumerate(group.states)}
    v = [place[number] for number in labels[:, 3].tolist()] if form.states else np.zeros(len(labels), dtype=np.int64)
    requested = np.column_stack([labels[:, 0], v, labels[:, 1:3]])
    naming = naming_by(group.diag, group.oblate, group.diagonal(int(labels[:, 0].max())))
    return labelled_states(group.top, (group.effect,), parameters, requested, start, naming)


def _assign_with_spins(
    group: Group, form: Format, labels: Ints, twice: Ints, parameters: tuple[str, ...], start: Floats
) -> list[tuple[Ints, LevelBlocks]]:
    """Rows and blocks of labels with these doubled F, for states with spins."""
    diagonal, naming = group.diagonal(int(labels[:, 0].max())), None
    # three equivalent nuclei have names by sub-blocks, l-doubled states by l
    if not group.effect.pairs and group.states[0].equivalent < 3:
        highest = unmixed_levels(group.top, (group.effect,), [int(twice.max())])
        if has_other_names(highest, group.diag, diagonal):
            naming = partial(spin_naming_by, group.diag, group.oblate, diagonal)

    def rows_of(levels: Levels, chosen: Ints) -> Ints:
        if group.effect.pairs:
            levels = named_by_l(levels, group.effect.pairs, str(levels.representation))
        elif naming:
            levels = named_by(levels, group.diag, group.oblate, diagonal)
        return _label_rows(group, levels, form, labels[chosen])

    functions = partial(_label_functions, group) if group.effect.pairs else None
    assigned = assigned_with_spins(group.top, (group.effect,), parameters, start, twice, rows_of, functions, naming)
    return [(part.rows, part.blocks) for part in assigned]


def _label_rows(group: Group, levels: Levels, form: Format, labels: Ints) -> Ints:
    """The row of each label among the levels, -1 if it has none."""
    table = np.concatenate([listed_quanta(group, levels, form, negative) for negative in (True, False)])
    rows = matching_rows(list(table.T), list(labels.T))
    if form.rotation == 2:  # a label without a level is that of the opposite sign of K
        opposite = table * np.where(np.arange(table.shape[1]) == 1, -1, 1)
        rows = np.where(rows < 0, matching_rows(list(opposite.T), list(labels.T)), rows)
    return np.where(rows < 0, -1, rows % max(len(levels), 1))


def _assign_in_blocks(
    group: Group, form: Format, labels: Ints, twice: Ints, parameters: tuple[str, ...], start: Floats
) -> list[tuple[Ints, LevelBlocks]]:
    """Rows and blocks of labels with these doubled J, for states without spins.

    Where DIAG is below 0 each level is one function, with spins or without, and its energy linear in the parameters.
    """
    levels = levels_in_blocks(group, distinct(twice).tolist())
    if group.diag < 0 and group.spins:
        levels = group.named(levels)
    rows = _label_rows(group, levels, form, labels)
    has_level = np.flatnonzero(rows >= 0)
    if not len(has_level):
        return []
    if group.diag < 0:
        slopes = level_derivatives(group.top, levels, parameters, rows[has_level])
        return [(has_level, ClosedForm(parameters, slopes))]
    functions = _label_functions(group, levels) if group.effect.pairs else None
    named = functions is None and "kc" in levels.quanta
    naming = naming_by(group.diag, group.oblate, group.diagonal(levels.jmax)) if named else None
    return [(has_level, unit_levels(group.top, levels, rows[has_level], parameters, start, functions, naming))]


def _label_functions(group: Group, levels: Levels) -> Functions:
    """The functions, over the basis, that label levels of l-doubled states, and their labels."""

    def functions_of(block: SolvedBlock) -> tuple[Floats, Ints]:
        functions = functions_by_l(over_basis(block), group.effect.pairs, str(levels.representation))
        return functions.amplitudes, functions.names

    return functions_of


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
    """Raise MissingLevelsError for labels with F below 0, at the places `reduced`, whose |F| cannot result from N and the spins."""
    reduced_labels = labels[reduced]
    far = reduced[np.abs(-spelled_out(reduced_labels, form) - reduced_labels[:, 0]) > (twice_spins + 1) // 2]
    if len(far):
        raise _no_level(labels, far, f" ({', '.join(names)}): F and N differ by more than the spins")


def unmeasured_lines(file: ParameterFile, measured: Assignments) -> tuple[Ints, Ints]:
    """Labels (n, k) of both states of lines to measure next: not measured, with the same changes of quantum numbers as a measured line.

    The states are the same as the measured line's (v), N is at most the highest measured, the frequency within the measured range,
    where spins do not count.

    file: parameters near the fitted ones. measured: measured lines; F below 0 and energies are ignored.
    """
    groups = groups_for_fit(file)
    form = quanta_format(file, groups)
    plain = ~measured.from_zero & (
        measured.upper.min(axis=1) >= 0 if form.rotation != 2 else measured.upper[:, -1] >= 0
    )
    seen = measured.take(plain)
    (highest, _), (_, (low_mhz, high_mhz)) = measured_range(measured), measured_range(seen)
    energy_of: dict[tuple[int, ...], float] = {}
    for labels, energies in [_group_labels(group, form, highest) for group in groups]:
        energy_of |= dict(zip(map(tuple, labels.tolist()), energies.tolist(), strict=True))
    by_state: dict[int | None, list[tuple[int, ...]]] = {}
    for label in energy_of:
        by_state.setdefault(label[form.rotation] if form.states else None, []).append(label)
    state = seen.lower[:, form.rotation].tolist() if form.states else [None] * len(seen)
    changes = dict.fromkeys(zip(state, map(tuple, (seen.upper - seen.lower).tolist()), strict=True))
    pairs = [
        (upper, lower)
        for v, change in changes
        for lower in by_state.get(v, [])
        if (upper := tuple(map(add, lower, change))) in energy_of
        and low_mhz < energy_of[upper] - energy_of[lower] < high_mhz
    ]
    table = np.array(pairs, dtype=np.int64).reshape(-1, 2, seen.upper.shape[1])
    return without_measured(table[:, 0], table[:, 1], seen)


def _group_labels(group: Group, form: Format, highest: int) -> tuple[Ints, Floats]:
    """Labels (n, k) with N up to the highest, and energies of the levels without spins, MHz."""
    if group.spins:
        total = sum(group.spins)
        if group.states[0].equivalent == 3:
            raise ValueError("no line is suggested with a total spin of three nuclei; leave --suggest out")
        # F has the parity of the sum of the spins, doubled
        levels = unmixed_levels(group.top, (group.effect,), list(range(total % 2, 2 * highest + total + 1, 2)))
    else:
        levels = levels_in_blocks(group, range(0, 2 * highest + 1, 2))
    tables = [
        listed_quanta(group, levels, form, negative) for negative in ((False, True) if form.rotation == 2 else (False,))
    ]
    labels = np.concatenate(tables)
    inside = labels[:, 0] <= highest
    return labels[inside], np.tile(levels.energy_mhz, len(tables))[inside]
