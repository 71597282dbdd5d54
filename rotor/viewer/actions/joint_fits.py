"""Refits of a session. Species whose lines share a measured frequency are fitted together, other species separately.

A blend of lines i of any species is one measured frequency ν with the error σ, and its weighted residual is

    r = (ν - Σ w_i ν_i) / σ,        Σ w_i = 1,

where ν_i is calculated from the constants of the line's species. Σ r² is minimised over the constants of all species at once: the
residual of a blend depends on several species, other residuals on a single species. Files of a species subtract the rest of a blend,
(ν - Σ_others w_j ν_j) / w with the error σ / w, w = Σ w_i of its lines: r stays the same, and so does the minimum.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import msgspec
import numpy as np

from rotor.arrays import Floats, Ints
from rotor.fitting.assignment import Assignments, assignments
from rotor.fitting.fit import FitOptions, fit_lines
from rotor.fitting.levels.top_levels import label_model
from rotor.fitting.parameters import Parameters, parameters, with_names
from rotor.fitting.result import Fit
from rotor.fitting.search.first_values import beside_zero
from rotor.fitting.top_constants import ConstantSet
from rotor.quantum.labels.labelled import LevelModel, MissingLevelsError
from rotor.viewer.actions.fits import POOR_RMS, WrongLines, fit_assignments, probably_wrong, refitted
from rotor.viewer.prediction import Model
from rotor.viewer.records import FitSummary, Line, Species, State

ModelOf = Callable[[Species], Model]


def shared_blends(state: State) -> dict[int, set[int]]:
    """Species of each blend that has lines of several species, by the number of the blend."""
    species: dict[int, set[int]] = {}
    for line in state.lines.values():
        if not line.rejected:
            species.setdefault(line.blend, set()).add(line.species)
    return {blend: numbers for blend, numbers in species.items() if len(numbers) > 1}


def together(state: State, number: int) -> tuple[int, ...]:
    """The species that are fitted together with a species: it and all species that blends connect with it."""
    links, group = list(shared_blends(state).values()), {number}
    while more := [link for link in links if link & group and not link <= group]:
        group |= set().union(*more)
    return tuple(sorted(group))


def refits(state: State, numbers: Collection[int], model: ModelOf) -> tuple[dict[int, Species], list[str]]:
    """Records of species after refits, and messages of the fits that failed."""
    records: dict[int, Species] = {}
    failures: list[str] = []
    waiting = set(numbers)
    while waiting:
        group = together(state, min(waiting))
        waiting -= set(group)
        try:
            if len(group) == 1:
                records[group[0]] = refitted(model(state.species[group[0]]), state.species_lines(group[0]))
            else:
                records |= refitted_together({number: model(state.species[number]) for number in group}, state)
        except ValueError as error:
            failures.append(str(error))
    return records, failures


@dataclass(frozen=True, eq=False)
class Part:
    """A species within a joint fit. labels: count of the quantum numbers of a level. lines: by number."""

    number: int
    model: Model
    lines: Mapping[int, Line]
    begin: ConstantSet
    free: Parameters

    @property
    def labels(self) -> int:
        return len(self.model.quanta)


class JointLevels(LevelModel):
    """Levels of several species: labels end in the number of the species, constants are ordered by species."""

    def __init__(self, parts: Sequence[Part], labels: Ints) -> None:
        self.names = tuple(name for part in parts for name in _prefixed(part, part.free.constant_names))
        self.rows = [np.flatnonzero(labels[:, -1] == part.number) for part in parts]
        self.models = list[LevelModel]()
        for part, rows in zip(parts, self.rows, strict=True):
            try:
                self.models.append(label_model(part.begin, labels[rows, : part.labels]))
            except MissingLevelsError as error:
                raise MissingLevelsError(f"{part.model.record.name}: {error}", rows[error.places]) from None
        self.ends = np.cumsum([len(model.names) for model in self.models]).tolist()
        self.count = len(labels)

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """Energies and derivatives; derivatives by the constants of other species are 0."""
        energies, slopes = np.empty(self.count), np.zeros((self.count, len(self.names)))
        for model, rows, end in zip(self.models, self.rows, self.ends, strict=True):
            columns = slice(end - len(model.names), end)
            energies[rows], slopes[rows, columns] = model.levels(values_mhz[columns])
        return energies, slopes

    def overlaps(self, before_mhz: Floats, after_mhz: Floats) -> Floats:
        values = np.ones(self.count)
        for model, rows, end in zip(self.models, self.rows, self.ends, strict=True):
            columns = slice(end - len(model.names), end)
            values[rows] = model.overlaps(before_mhz[columns], after_mhz[columns])
        return values


def refitted_together(models: Mapping[int, Model], state: State) -> dict[int, Species]:
    """The records of species after a fit of all their constants to all their lines.

    Raises ValueError as `rotor.viewer.actions.fits.refitted` does.
    """
    parts = [_part(number, model, state.species_lines(number)) for number, model in models.items()]
    names = " and ".join(part.model.record.name for part in parts)
    if not any(part.free.names for part in parts):
        raise ValueError(f"{names}: no constant is free; mark those that the lines should determine")
    lines = _joined_lines(parts, names)
    fit_of = partial(
        fit_lines,
        constants=None,
        parameters=_joined_parameters(parts),
        options=FitOptions(poor_rms=POOR_RMS),
        model=partial(JointLevels, parts),
    )
    fit = fit_of(lines)
    if not fit.converged:
        raise ValueError(f"{names}: the fit did not converge: {fit.reason}; the constants are unchanged")
    wrong = probably_wrong(fit, [number for part in parts for number in part.lines], fit_of)
    places = np.cumsum([0, *(len(part.free.names) for part in parts)]).tolist()
    return {
        part.number: _record(part, fit, slice(a, b), names, wrong)
        for part, a, b in zip(parts, places, places[1:], strict=False)
        if part.free.names
    }


def _part(number: int, model: Model, lines: Mapping[int, Line]) -> Part:
    """A species for the joint fit; free constants that act by their squares alone start beside 0."""
    free = list(model.record.free)
    begin = with_names(model.constants, free)
    if not free:
        none, values = np.zeros(0), begin.values
        held = Parameters((), none, none, tuple(values), np.array(list(values.values())), np.zeros((len(values), 0)))
        return Part(number, model, lines, begin, held)
    begin, _ = beside_zero(begin, free, fit_assignments(model, lines))
    return Part(number, model, lines, begin, parameters(begin, free))


def _prefixed(part: Part, names: Sequence[str]) -> tuple[str, ...]:
    """Names of constants with the species, such as `2:DeltaJ`."""
    return tuple(f"{part.number}:{name}" for name in names)


def _joined_parameters(parts: Sequence[Part]) -> Parameters:
    """The free constants of all species, ordered by species."""
    constants, free = ([len(getattr(part.free, name)) for part in parts] for name in ("constant_names", "names"))
    matrix = np.zeros((sum(constants), sum(free)))
    row = column = 0
    for part, rows, columns in zip(parts, constants, free, strict=True):
        matrix[row : row + rows, column : column + columns] = part.free.matrix
        row, column = row + rows, column + columns
    return Parameters(
        names=tuple(name for part in parts for name in _prefixed(part, part.free.names)),
        start=np.concatenate([part.free.start for part in parts]),
        prior=np.concatenate([part.free.prior for part in parts]),
        constant_names=tuple(name for part in parts for name in _prefixed(part, part.free.constant_names)),
        base=np.concatenate([part.free.base for part in parts]),
        matrix=matrix,
    )


def _joined_lines(parts: Sequence[Part], source: str) -> Assignments:
    """The lines of all species; labels are filled with zeros to equal length and end in the number of the species."""
    longest = max(part.labels for part in parts)
    owners = [(part, line) for part in parts for line in part.lines.values()]

    def labels(side: str) -> list[list[int]]:
        return [[*getattr(line, side), *[0] * (longest - part.labels), part.number] for part, line in owners]

    joined = assignments(
        [*(f"q{i}" for i in range(1, longest + 1)), "of"],
        labels("upper"),
        labels("lower"),
        [line.frequency_mhz for _, line in owners],
        [line.error_mhz for _, line in owners],
        weight=[line.weight for _, line in owners],
        blend=[line.blend for _, line in owners],
        wavenumber=[line.wavenumber for _, line in owners],
        source=f"lines of {source}",
    )
    return replace(joined, excluded=np.array([line.rejected for _, line in owners], dtype=bool))


def _record(part: Part, fit: Fit, columns: slice, names: str, wrong: WrongLines) -> Species:
    """The record of a species after the fit: constants, errors and the summary of the fit."""
    free, record = part.free, part.model.record
    values = dict(zip(free.constant_names, free.to_constants(fit.values[columns]).tolist(), strict=True))
    covariance = fit.statistics.covariance[columns, columns]
    errors = {name: value for name, value in part.begin.uncertainties.items() if name not in values}
    for name, row in zip(free.constant_names, free.matrix, strict=True):
        used = np.flatnonzero(row)
        if len(used) and np.isfinite(covariance[used, used]).all():
            errors[name] = float(np.sqrt(row[used] @ covariance[np.ix_(used, used)] @ row[used]))
    part.begin.replace(**values, uncertainties=errors)  # refuses what is no set of constants
    summary = msgspec.structs.replace(
        _summary(part, fit, names), suspect=wrong.numbers, rms_without=wrong.weighted_rms_without
    )
    return msgspec.structs.replace(
        record,
        constants={**dict(part.begin.values), **values},
        errors={name: error for name, error in errors.items() if math.isfinite(error)},
        fit=summary,
    )


def _summary(part: Part, fit: Fit, names: str) -> FitSummary:
    """Summary of the fit for the lines of a species."""
    lines, prefix = fit.lines, f"{part.number}:"
    used = fit.used & (lines.upper[:, -1] == part.number)
    measured = np.isin(lines.blend[fit.groups], lines.blend[used])
    frequencies = measured & ~lines.wavenumber[fit.groups]
    open_ = (combination.text for combination in fit.statistics.undetermined)
    return FitSummary(
        converged=True,
        reason=fit.reason,
        lines=int(used.sum()),
        rms_mhz=_rms(fit.difference_mhz[fit.groups[frequencies]]),
        weighted_rms=_rms(fit.residuals[: len(fit.groups)][measured]),
        before=dict(part.model.record.constants),
        open=tuple(text.replace(prefix, "") for text in open_ if prefix in text),
        notes=(f"fitted together: {names}", *fit.notes),
    )


def _rms(values: Floats) -> float | None:
    return float(np.sqrt(values @ values / len(values))) if len(values) else None


def line_residuals(models: Mapping[int, Model], state: State) -> dict[int, dict[str, Any]]:
    """Label, calculated frequency (MHz; the mean for a blend) and observed minus calculated for each line of a session.

    A rejected line is compared with its calculated frequency alone and does not enter the mean of a blend.
    """
    labels: dict[int, str] = {}
    calculated: dict[int, float] = {}
    for number, model in models.items():
        lines = state.species_lines(number)
        if lines:
            assigned = fit_assignments(model, lines)
            labels |= {n: assigned.text(i) for i, n in enumerate(lines)}
            calculated |= zip(lines, model.calculated_mhz(assigned.upper, assigned.lower).tolist(), strict=True)
    means = {n: calculated[n] for n in labels}
    for members in _blends(state).values():
        mean = sum(share * calculated[n] for n, share in members.items())
        means |= dict.fromkeys(members, mean)
    rows, session_lines = dict[int, dict[str, Any]](), state.lines
    for n, mean in means.items():
        exists = math.isfinite(mean)
        rows[n] = {
            "label": labels[n],
            "calculated_mhz": mean if exists else None,
            "difference_mhz": session_lines[n].frequency_mhz - mean if exists else None,
        }
    return rows


def _blends(state: State) -> dict[int, dict[int, float]]:
    """Shares of the lines of each blend, by the numbers of blends and lines; rejected lines are left out."""
    blends: dict[int, dict[int, float]] = {}
    for n, line in state.lines.items():
        if not line.rejected:
            blends.setdefault(line.blend, {})[n] = max(line.weight, 0.0)
    shares = {}
    for blend, weights in blends.items():
        if len(weights) > 1:
            total = sum(weights.values())
            shares[blend] = {n: weight / total if total > 0 else 1 / len(weights) for n, weight in weights.items()}
    return shares


def lines_alone(number: int, models: Mapping[int, Model], state: State) -> dict[int, Line]:
    """Lines of a species for its files; contributions of other species to a blend are subtracted, with a comment."""
    lines, shared = state.species_lines(number), shared_blends(state)
    blends, session_lines = _blends(state), state.lines
    for n, line in list(lines.items()):
        if line.rejected or number not in shared.get(line.blend, ()):
            continue
        members = blends[line.blend]
        part = sum(share for k, share in members.items() if session_lines[k].species == number)
        others = {k: share for k, share in members.items() if session_lines[k].species != number}
        if not part > 0:
            lines[n] = msgspec.structs.replace(line, rejected=True)
            continue
        rest = sum(
            share * _calculated(models[session_lines[k].species], session_lines[k]) for k, share in others.items()
        )
        names = sorted({models[session_lines[k].species].record.name for k in others})
        lines[n] = msgspec.structs.replace(
            line,
            frequency_mhz=(line.frequency_mhz - rest) / part,
            error_mhz=line.error_mhz / part,
            comment=f"{line.comment} measured {line.frequency_mhz:.4f} MHz, blend with {' and '.join(names)} taken out".strip(),
        )
    return lines


def _calculated(model: Model, line: Line) -> float:
    return float(model.calculated_mhz(np.array([line.upper]), np.array([line.lower]))[0])
