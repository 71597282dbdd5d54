"""Fits of the assigned lines of a species, search for wrong lines, levels and combination differences."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import msgspec
import numpy as np

from rotor.fitting.assignment import Assignments, assignments
from rotor.fitting.fit import FitOptions, fit_lines
from rotor.fitting.parameters import parameters, with_names
from rotor.fitting.result import Fit
from rotor.fitting.search.first_values import beside_zero
from rotor.viewer.prediction import Model
from rotor.viewer.records import FitSummary, Line, Species

FitLines = Callable[[Assignments], Fit]
MOST_DIFFERENCES = 300
POOR_RMS = 1e9  # a poor fit is shown with its residuals, not refused
POOR = 3.0  # weighted rms above which a wrong assignment is searched for
BETTER = 0.3  # fraction of the weighted rms that remains without a wrong line, at most
TRIED = 3  # measured frequencies that are left out, one at a time


def fit_assignments(model: Model, lines: Mapping[int, Line]) -> Assignments:
    """Lines of a species for a fit, with rejected lines excluded; ValueError for labels of a wrong length."""
    names = model.quanta
    for number, line in lines.items():
        if not len(line.upper) == len(line.lower) == len(names):
            raise ValueError(
                f"line {number}: {len(line.upper)} and {len(line.lower)} quantum numbers; {model.record.name} has {', '.join(names)}"
            )
    records = list(lines.values())
    assigned = assignments(
        names,
        [line.upper for line in records],
        [line.lower for line in records],
        [line.frequency_mhz for line in records],
        [line.error_mhz for line in records],
        weight=[line.weight for line in records],
        blend=[line.blend for line in records],
        wavenumber=[line.wavenumber for line in records],
        source=f"lines of {model.record.name}",
        comments=[line.comment for line in records] if any(line.comment for line in records) else (),
        halves=model.halves,
    )
    rejected = np.array([line.rejected for line in records], dtype=bool)
    return replace(assigned, excluded=rejected) if rejected.any() else assigned


def lines_from(assigned: Assignments, species: int, blend_from: int, default_error_mhz: float = 0.0) -> list[Line]:
    """Records of assigned lines; blends are numbered from `blend_from`, lines without an error get the default error."""
    excluded = assigned.is_excluded.tolist()
    comments = assigned.comments or ("",) * len(assigned)
    return [
        Line(
            species=species,
            upper=tuple(assigned.upper[i].tolist()),
            lower=tuple(assigned.lower[i].tolist()),
            frequency_mhz=float(assigned.frequency_mhz[i]),
            error_mhz=float(assigned.error_mhz[i]) or default_error_mhz,
            weight=float(assigned.weight[i]),
            blend=blend_from + int(assigned.blend[i]),
            rejected=bool(excluded[i]),
            wavenumber=bool(assigned.wavenumber[i]),
            comment=comments[i],
        )
        for i in range(len(assigned))
    ]


def fit_species(model: Model, lines: Mapping[int, Line]) -> Fit:
    """The fit of a species to its lines, from its constants, with its free constants.

    Raises ValueError without lines or free constants, for more constants than lines, and for labels without a level.
    """
    assigned, fit = fit_problem(model, lines)
    return fit(assigned)


def fit_problem(model: Model, lines: Mapping[int, Line]) -> tuple[Assignments, FitLines]:
    """Lines of a species for a fit, and the fit as a function of lines."""
    name, free = model.record.name, list(model.record.free)
    if not lines:
        raise ValueError(f"{name}: no line is assigned to it; assign lines first")
    if not free:
        raise ValueError(f"{name}: no constant is free; mark those that the lines should determine")
    assigned = fit_assignments(model, lines)
    start, _ = beside_zero(with_names(model.constants, free), free, assigned)
    varied, options = parameters(start, free), FitOptions(poor_rms=POOR_RMS)
    return assigned, lambda chosen: fit_lines(chosen, start, varied, options)


@dataclass(frozen=True)
class WrongLines:
    """Lines of a measured frequency that are probably assigned wrongly, and the weighted rms of the fit without them."""

    numbers: tuple[int, ...] = ()
    weighted_rms_without: float | None = None


def probably_wrong(fit: Fit, numbers: Sequence[int], refit: FitLines) -> WrongLines:
    """The lines without which a poor fit becomes good; empty where no measured frequency has so much influence.

    To first order, χ² falls by r²/(1 - h) when a datum with the weighted residual r and the leverage h is left out. The data with
    the largest fall are left out one at a time, and the others are fitted again. numbers: of the lines of the fit.
    """
    if not fit.weighted_rms > POOR or fit.degrees_of_freedom < 2:
        return WrongLines()
    count = len(fit.groups)
    remaining = 1 - fit.statistics.leverages[:count]
    falls = np.where(remaining > 1e-9, fit.residuals[:count] ** 2 / np.maximum(remaining, 1e-9), 0.0)
    wrong, smallest = WrongLines(), BETTER * fit.weighted_rms
    for place in np.argsort(-falls)[:TRIED].tolist():
        members = fit.lines.blend == fit.lines.blend[fit.groups[place]]
        try:
            without = refit(replace(fit.lines, excluded=fit.lines.is_excluded | members))
        except ValueError:
            continue  # too few lines are left
        if without.converged and without.weighted_rms < smallest:
            smallest = without.weighted_rms
            wrong = WrongLines(tuple(numbers[i] for i in np.flatnonzero(members & fit.used).tolist()), smallest)
    return wrong


def refitted(model: Model, lines: Mapping[int, Line]) -> Species:
    """The record after a refit: constants with their errors, and the summary of the fit."""
    record = model.record
    assigned, fit_again = fit_problem(model, lines)
    fit = fit_again(assigned)
    if not fit.converged:
        raise ValueError(f"{record.name}: the fit did not converge: {fit.reason}; the constants are unchanged")
    rms, weighted = fit.rms_mhz(), fit.weighted_rms
    wrong = probably_wrong(fit, list(lines), fit_again)
    summary = FitSummary(
        converged=True,
        reason=fit.reason,
        lines=int(fit.used.sum()),
        rms_mhz=rms if math.isfinite(rms) else None,
        weighted_rms=weighted if math.isfinite(weighted) else None,
        before=dict(record.constants),
        open=tuple(combination.text for combination in fit.statistics.undetermined),
        notes=fit.notes,
        suspect=wrong.numbers,
        rms_without=wrong.weighted_rms_without,
    )
    errors = {name: error for name, error in fit.named.uncertainties.items() if math.isfinite(error)}
    return msgspec.structs.replace(record, constants=dict(fit.named.values), errors=errors, fit=summary)


def assigned_levels(model: Model, lines: Mapping[int, Line], levels: Any) -> dict[str, Any]:
    """Energies of the levels of assigned lines, and combination differences.

    Two lines with a common upper level measure the difference of their lower levels: ν₁ - ν₂ = E₂ - E₁. levels: solved levels,
    energies in MHz.
    """
    from rotor.units import MHZ_PER_CM
    from rotor.viewer.loomis_wood import label_rows

    if not lines:
        return {"levels": [], "differences": []}
    assigned = fit_assignments(model, lines)
    labels, places = np.unique(np.concatenate([assigned.upper, assigned.lower]), axis=0, return_inverse=True)
    places = places.reshape(-1)
    rows = label_rows(model, levels, labels)
    energy = np.where(rows >= 0, levels.energy_mhz[rows] - levels.ground_mhz, np.nan)
    counts = np.bincount(places, minlength=len(labels))
    table = [
        {
            "label": assigned.label_text(labels[i].tolist()),
            "energy_cm": float(energy[i] / MHZ_PER_CM) if math.isfinite(energy[i]) else None,
            "energy_mhz": float(energy[i]) if math.isfinite(energy[i]) else None,
            "lines": int(counts[i]),
        }
        for i in np.argsort(energy).tolist()
    ]
    n = len(assigned)
    return {"levels": table, "differences": _differences(assigned, places[:n], places[n:], labels, energy)}


def _differences(assigned: Assignments, upper: Any, lower: Any, labels: Any, energy: Any) -> list[dict[str, Any]]:
    """Combination differences from pairs of unblended lines with a common level: measured and calculated."""
    rows = list[dict[str, Any]]()
    counts, single = ~assigned.is_excluded, ~assigned.blended
    for shared, other, sign in ((upper, lower, -1.0), (lower, upper, 1.0)):
        groups: dict[int, list[int]] = {}
        for i in np.flatnonzero(counts & single).tolist():
            groups.setdefault(int(shared[i]), []).append(i)
        for level, members in groups.items():
            for i, j in combinations(members, 2):
                if len(rows) >= MOST_DIFFERENCES or other[i] == other[j]:
                    continue
                observed = sign * (assigned.frequency_mhz[i] - assigned.frequency_mhz[j])
                calculated = energy[other[i]] - energy[other[j]]
                rows.append(
                    {
                        "levels": [assigned.label_text(labels[other[k]].tolist()) for k in (i, j)],
                        "by": assigned.label_text(labels[level].tolist()),
                        "observed_mhz": float(observed),
                        "error_mhz": float(np.hypot(assigned.error_mhz[i], assigned.error_mhz[j])),
                        "difference_mhz": float(observed - calculated) if math.isfinite(calculated) else None,
                    }
                )
    return rows
