"""Labelled levels of a top with further states or spins, and their derivatives by its named constants.

The Hamiltonian is that of `rotor.quantum.effects.of_top`, as in predictions. Only the J or F with a level of a line are solved:
connected Wang blocks of states (`labels.tracking`), blocks of one F (`effect_units`), or, for uncoupled states of a symmetric top,
the exact sum E = Σ c ∂E/∂c.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Ints
from rotor.fitting.top_constants import ConstantSet, TopConstants
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.labels.labelled import AT_ZERO_MHZ, ClosedForm, LevelModel, MissingLevelsError, level_model
from rotor.quantum.labels.quanta import value_text
from rotor.quantum.levels import Levels
from rotor.quantum.solve import solve_levels


def top_levels(constants: TopConstants, labels: Ints) -> LevelModel:
    """The model for labels (levels, k) by `constants.quanta`, half-integers doubled.

    Raises MissingLevelsError for labels without a level; its message names the first.
    """
    names, form = tuple(constants.values), constants.quanta
    if labels.shape[1] != len(form):
        raise ValueError(f"{labels.shape[1]} quantum numbers for each state; these constants have {', '.join(form)}")
    begin = constants.replace(**{name: AT_ZERO_MHZ for name, value in constants.values.items() if value == 0})
    columns = {name: labels[:, i] for i, name in enumerate(form)}
    unsigned = [i for i, name in enumerate(form) if name not in ("k", "m", "field")]
    _refuse(constants, labels, np.asarray((labels[:, unsigned] < 0).any(axis=1)))
    if constants.in_field:
        from rotor.fitting.levels.stark_levels import stark_levels  # with all that fields need

        return stark_levels(begin, labels)
    if constants.top.internal_rotation is not None:
        from rotor.fitting.levels.torsion_levels import torsion_levels

        return torsion_levels(begin, labels)
    if constants.hyperfine:
        return _levels_with_spins(begin, columns, labels, names)
    if "kc" in form:
        return _state_levels(begin, columns, labels, names)
    return _in_closed_form(begin, columns, labels, names)


def label_model(constants: ConstantSet, labels: Ints, kmax: int | None = None) -> LevelModel:
    """The level model of named constants for labels (levels, k); `kmax` truncates the basis of a single asymmetric top."""
    if isinstance(constants, TopConstants):
        return top_levels(constants, labels)
    return level_model(constants, labels, kmax=kmax)


def _refuse(constants: TopConstants, labels: Ints, missing: NDArray[np.bool_]) -> None:
    if missing.any():
        places = np.flatnonzero(missing)
        raise MissingLevelsError(
            f"there is no level {_text(constants, labels[places[0]])} ({', '.join(constants.quanta)}) in this model",
            places,
        )


def _text(constants: TopConstants, label: Ints) -> str:
    pairs = zip(constants.quanta, label.tolist(), strict=True)
    return " ".join(value_text(value, name in constants.halves) for name, value in pairs)


def _state_levels(begin: TopConstants, columns: dict[str, Ints], labels: Ints, names: tuple[str, ...]) -> LevelModel:
    from rotor.quantum.labels.tracking import labelled_states

    labels_by_row = np.column_stack(
        [columns["j"], columns.get("v", np.zeros_like(columns["j"])), columns["ka"], columns["kc"]]
    )
    values = np.array(list(begin.values.values()))
    blocks = labelled_states(begin.top, begin.effects, names, labels_by_row, values)
    _refuse(begin, labels, blocks.without_level)
    return blocks


def _levels_with_spins(
    begin: TopConstants, columns: dict[str, Ints], labels: Ints, names: tuple[str, ...]
) -> LevelModel:
    from rotor.quantum.estimates.effect_units import assigned_with_spins  # with all that spins need
    from rotor.quantum.labels.tracking import TrackedLevels

    total = begin.quanta[-1]
    doubled = columns[total] if total in begin.halves else 2 * columns[total]
    quanta = {name: np.abs(column) if name == "k" else column for name, column in columns.items()}

    def rows_of(levels: Levels, chosen: Ints) -> Ints:
        return levels.rows_of(**{name: column[chosen] for name, column in quanta.items()})

    values = np.array(list(begin.values.values()))
    parts = assigned_with_spins(begin.top, begin.effects, names, values, doubled, rows_of)
    blocks = TrackedLevels.from_parts(names, parts, len(labels))
    _refuse(begin, labels, blocks.without_level)
    return blocks


def _in_closed_form(begin: TopConstants, columns: dict[str, Ints], labels: Ints, names: tuple[str, ...]) -> LevelModel:
    """The model of tops whose energies are linear in the constants."""
    quanta = {name: np.abs(column) if name == "k" else column for name, column in columns.items()}
    levels = solve_levels(begin.top, int(quanta["j"].max()), effects=begin.effects)
    rows = levels.rows_of(**quanta)
    _refuse(begin, labels, rows < 0)
    return ClosedForm(names, level_derivatives(begin.top, levels, names, rows))
