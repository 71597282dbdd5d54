"""Assigned lines of a session as the fit takes them, the fit, and what the page shows of it: levels, combination differences."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import msgspec
import numpy as np

from rotor.fitting.assignment import Assignments, assignments
from rotor.fitting.first_values import beside_zero
from rotor.fitting.fit import Fit, FitOptions, fit_lines
from rotor.fitting.parameters import parameters, with_names
from rotor.viewer.prediction import Model
from rotor.viewer.records import FitSummary, Line, Species

MOST_DIFFERENCES = 300
POOR_RMS = 1e9  # a poor fit is shown with its residuals, not refused
POOR = 3.0  # weighted rms above which a wrong assignment is looked for
BETTER = 0.3  # of the weighted rms, to which it falls without a wrong line
TRIED = 3  # lines that are left out in turn


def assignments_of(model: Model, lines: Mapping[int, Line]) -> Assignments:
    """The lines of a species, rejected ones marked as excluded; ValueError for labels of another length."""
    names = model.quanta
    for number, line in lines.items():
        if not len(line.upper) == len(line.lower) == len(names):
            raise ValueError(
                f"line {number}: {len(line.upper)} and {len(line.lower)} quantum numbers; {model.record.name} has {', '.join(names)}"
            )
    records = list(lines.values())
    made = assignments(
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
    return replace(made, excluded=rejected) if rejected.any() else made


def lines_from(assigned: Assignments, species: int, blend_from: int, default_error_mhz: float = 0.0) -> list[Line]:
    """Records of assigned lines, their blends numbered from `blend_from` on; lines without an error get the default one."""
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


def fit_of(model: Model, lines: Mapping[int, Line]) -> Fit:
    """The fit of a species to its lines, from its constants, with its free constants.

    Raises ValueError without lines or free constants, for more constants than lines, and for labels that no level has.
    """
    record = model.record
    if not lines:
        raise ValueError(f"{record.name}: no line is assigned to it; assign lines first")
    if not record.free:
        raise ValueError(f"{record.name}: no constant is free; mark those that the lines should determine")
    assigned = assignments_of(model, lines)
    begin = with_names(model.constants, list(record.free))
    begin, _ = beside_zero(begin, list(record.free), assigned)
    return fit_lines(assigned, begin, parameters(begin, list(record.free)), FitOptions(poor_rms=POOR_RMS))


def suspect(
    fit: Fit, numbers: Sequence[int], again: Callable[[Assignments], Fit]
) -> tuple[tuple[int, ...], float | None]:
    """The lines, by number, of one measured frequency without which a poor fit is good, and the weighted rms then; empty without such.

    To first order χ² falls by r²/(1 - h) when a datum of the weighted residual r and the leverage h is left out; the first few by
    that number are left out in turn, and fitted `again`. numbers: of the lines of the fit.
    """
    if not fit.weighted_rms > POOR or fit.degrees_of_freedom < 2:
        return (), None
    count = len(fit.groups)
    left = 1 - fit.statistics.leverages[:count]
    falls = np.where(left > 1e-9, fit.residuals[:count] ** 2 / np.maximum(left, 1e-9), 0.0)
    apart, least = tuple[int, ...](), BETTER * fit.weighted_rms
    for place in np.argsort(-falls)[:TRIED].tolist():
        members = fit.lines.blend == fit.lines.blend[fit.groups[place]]
        try:
            without = again(replace(fit.lines, excluded=fit.lines.is_excluded | members))
        except ValueError:
            continue  # too few lines are left
        if without.converged and without.weighted_rms < least:
            apart = tuple(numbers[i] for i in np.flatnonzero(members & fit.used).tolist())
            least = without.weighted_rms
    return (apart, least) if apart else ((), None)


def refitted(model: Model, lines: Mapping[int, Line]) -> Species:
    """The record after a refit: constants with their errors, and the summary of the fit."""
    record, fit = model.record, fit_of(model, lines)
    if not fit.converged:
        raise ValueError(f"{record.name}: the fit did not converge: {fit.reason}; the constants stay as they are")
    fitted = fit.named
    rms, weighted = fit.rms_mhz(), fit.weighted_rms
    lines_apart, rms_without = suspect(
        fit,
        list(lines),
        lambda chosen: fit_lines(
            chosen, with_names(model.constants, list(record.free)), fit.parameters, FitOptions(poor_rms=POOR_RMS)
        ),
    )
    summary = FitSummary(
        converged=True,
        reason=fit.reason,
        lines=int(fit.used.sum()),
        rms_mhz=rms if math.isfinite(rms) else None,
        weighted_rms=weighted if math.isfinite(weighted) else None,
        before=dict(record.constants),
        open=tuple(combination.text for combination in fit.statistics.undetermined),
        notes=fit.notes,
        suspect=lines_apart,
        rms_without=rms_without,
    )
    errors = {name: error for name, error in fitted.uncertainties.items() if math.isfinite(error)}
    return msgspec.structs.replace(record, constants=dict(fitted.values), errors=errors, fit=summary)


def levels_of(model: Model, lines: Mapping[int, Line], levels: Any) -> dict[str, Any]:
    """Energies of the levels of assigned lines, and combination differences.

    Two lines to one level measure the difference of their other levels: ν₁ - ν₂ = E₂ - E₁ of the lower ones. levels: solved, with
    energies in MHz.
    """
    from rotor.units import MHZ_PER_CM
    from rotor.viewer.loomis_wood import rows_of_labels

    if not lines:
        return {"levels": [], "differences": []}
    assigned = assignments_of(model, lines)
    labels, places = np.unique(np.concatenate([assigned.upper, assigned.lower]), axis=0, return_inverse=True)
    places = places.reshape(-1)
    rows = rows_of_labels(model, levels, labels)
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
    """Pairs of unblended lines with a level in common: measured and calculated values."""
    out = list[dict[str, Any]]()
    counts, single = ~assigned.is_excluded, ~assigned.blended
    for shared, other, sign in ((upper, lower, -1.0), (lower, upper, 1.0)):
        groups: dict[int, list[int]] = {}
        for i in np.flatnonzero(counts & single).tolist():
            groups.setdefault(int(shared[i]), []).append(i)
        for level, members in groups.items():
            for i, j in combinations(members, 2):
                if len(out) >= MOST_DIFFERENCES or other[i] == other[j]:
                    continue
                seen = sign * (assigned.frequency_mhz[i] - assigned.frequency_mhz[j])
                known = energy[other[i]] - energy[other[j]]
                out.append(
                    {
                        "levels": [assigned.label_text(labels[other[k]].tolist()) for k in (i, j)],
                        "by": assigned.label_text(labels[level].tolist()),
                        "observed_mhz": float(seen),
                        "error_mhz": float(np.hypot(assigned.error_mhz[i], assigned.error_mhz[j])),
                        "difference_mhz": float(seen - known) if math.isfinite(known) else None,
                    }
                )
    return out
