"""The report of a fit: lines with calculated frequencies, parameters with errors, and diagnostics of both."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.fitting.assignment import Assignments
from rotor.fitting.choice.orders import j_order
from rotor.fitting.reports.publication import value_text
from rotor.fitting.result import Fit
from rotor.fitting.top_constants import unit_of_constant
from rotor.table import counted
from rotor.tops.constants.operators import distortion_terms

FAR_OFF = 3.0  # errors beyond which a line is listed as far off
_LISTED, _FEW_LISTED = 20, 5  # most lines that are listed as far off; and where most lines are
_OUTLIER = 0.1  # a line without which the weighted rms falls below this part of it is an outlier
_CORRELATED = 0.95  # correlation from which a pair is listed
_INFLUENTIAL = 10  # most influential lines that are listed
_MOVED = 3  # constants listed for each of them
_INFLUENCE = f"INFLUENCE: leverage, and what moves most without the line (DFBETAS), of {_INFLUENTIAL} lines"


def report_text(
    fit: Fit, title: str = "", *, notes: Sequence[str] = (), head: Sequence[str] = (), file_lines: Sequence[str] = ()
) -> str:
    """The whole report, in the order of SPFIT's .fit: parameters at the start, lines, parameters at the end, statistics.

    Parameters
    ----------
    fit : Fit
    title : str, optional
    notes : sequence of str, optional
        Remarks on how the lines were read.
    head : sequence of str, optional
        Text lines below the title, such as the names of input files.
    file_lines : sequence of str, optional
        A text line for each parameter of SPFIT's file, free or not.

    Returns
    -------
    str
    """
    parts = [
        [title or "fit of rotational constants", status_text(fit), *_hamiltonian(fit), *head, ""],
        [f"PARAMETERS AT THE START ({parameter_units(fit)}), A-PRIORI ERRORS", *_start(fit), ""],
        ["LINES", *_lines(fit), ""],
        [
            f"PARAMETERS ({parameter_units(fit)}): value(error), error from stated line errors, error from the scatter, change",
            *_end(fit),
            "",
        ],
        *([["PARAMETERS OF THE FILE: code, label, value(error)", *file_lines, ""]] if file_lines else []),
        ["STATISTICS", *statistics_text(fit), ""],
        [
            _INFLUENCE,
            *influence(fit),
            "",
        ],
        ["SEARCH: weighted rms before and after each step, damping", *_search(fit), ""],
        ["CORRELATIONS", *_correlations(fit), ""],
    ]
    said = [*notes, *fit.notes]
    if said:
        parts.append(["NOTES", *(f"- {text}" for text in said), ""])
    return "\n".join(line for part in parts for line in part).rstrip() + "\n"


def fit_facts(fit: Fit) -> dict[str, Any]:
    """The statistics of a fit, by the keys of its record."""
    return {
        "converged": fit.converged,
        "reason": fit.reason,
        "line_count": len(fit.lines),
        "lines_used": int(fit.used.sum()),
        "frequencies": len(fit.groups),
        "blends": blend_counts(fit)[0],
        "weighted_rms": fit.weighted_rms,
        "reduced_chi": fit.reduced_chi,
        "rms_mhz": fit.rms_mhz(),
        "rms_cm": fit.rms_mhz(wavenumber=True),
        "degrees_of_freedom": fit.degrees_of_freedom,
        "condition": fit.statistics.condition,
        "iterations": len(fit.minimum.iterations),
        "undetermined": [combination.text for combination in fit.statistics.undetermined],
        "changed_states": list(fit.changed_states),
        "notes": list(fit.notes),
    }


def status_text(fit: Fit) -> str:
    """One line: converged or not, and why."""
    return f"{'CONVERGED' if fit.converged else 'NOT CONVERGED'}: {fit.reason}"


def statistics_text(fit: Fit) -> list[str]:
    """The statistics of the fit, one text line each."""
    rms, infrared = fit.rms_mhz(), fit.rms_mhz(wavenumber=True)
    condition = fit.statistics.condition
    out = [
        f"lines {len(fit.lines)}, of which {int(fit.used.sum())} count in {len(fit.groups)} measured frequencies{_blends(fit)}",
        f"free parameters {len(fit.parameters.names)}, degrees of freedom {fit.degrees_of_freedom}",
        f"weighted rms {fit.weighted_rms:.5f}; sqrt(chi2/degrees of freedom) {scatter_text(fit.reduced_chi, '.5f')}",
        *_with_priors(fit),
        *([f"rms deviation {rms:.6f} MHz"] if math.isfinite(rms) else []),
        *([f"rms deviation {infrared:.6f} cm-1"] if math.isfinite(infrared) else []),
        f"condition number of the column-scaled Jacobian {f'{condition:.3e}' if math.isfinite(condition) else 'infinite'}",
    ]
    out += [
        f"not determined by these lines: {combination.text}" + (" (left at the start)" if fit.converged else "")
        for combination in fit.statistics.undetermined
    ]
    out += [f"outlier, {text}" for text in outlier(fit)]
    out += [f"far off, {text}" for text in far_off(fit)]
    out += [f"influential, {text}" for text in influential(fit)]
    return out + [f"decisive, {text}" for text in decisive(fit)]


def _blends(fit: Fit) -> str:
    """A text on how many measured frequencies are blends, and of how many lines."""
    counts = blend_counts(fit)
    return f", {counts[0]} of these are blends of {counts[1]} lines" if counts[0] else ""


def blend_counts(fit: Fit) -> tuple[int, int]:
    """The numbers of blends that count, and of lines in them."""
    lines_of_each = np.bincount(fit.lines.blend[fit.used], minlength=1)
    several = lines_of_each[lines_of_each > 1]
    return len(several), int(several.sum())


def scatter_text(value: float, form: str) -> str:
    """Text of a number derived from the scatter of the lines: "undefined" for nan (0 degrees of freedom), a dash if not determined.

    >>> scatter_text(1.25, ".3f"), scatter_text(float("nan"), ".3f"), scatter_text(float("inf"), ".3f")
    ('1.250', 'undefined', '-')
    """
    return "undefined" if math.isnan(value) else error_text(value, form)


def error_text(error: float, form: str) -> str:
    """An error, or a dash for a constant that is not determined or has no a-priori error."""
    return format(error, form) if math.isfinite(error) else "-"


def _with_priors(fit: Fit) -> list[str]:
    """SPFIT's weighted rms, if there are a-priori values: they count in χ², but not in the number of lines."""
    priors = fit.parameters.prior_count
    if not priors:
        return []
    lines = len(fit.residuals) - priors
    rms = math.sqrt(float(fit.residuals @ fit.residuals) / max(lines, 1))  # a fit may have a-priori values alone
    counts = f"{counted(priors, 'a-priori value')}, counted in the degrees of freedom"
    return [f"{counts}; with their part in chi2 the weighted rms is {rms:.5f} (RMS ERROR of SPFIT)"]


def far_off(fit: Fit, errors: float = FAR_OFF) -> list[str]:
    """Lines that count with residuals above `errors` standard errors, largest first, and how many more there are than are listed."""
    parts = np.abs(fit.residuals[: len(fit.groups)])
    order = [int(i) for i in np.argsort(-parts) if parts[i] > errors]
    most = _FEW_LISTED if mostly_off(fit, errors) else _LISTED
    more = [f"{counted(len(order) - most, 'further line')} of {len(parts)}"] if len(order) > most else []
    return [
        f"line {fit.lines.number(int(fit.groups[i]))}, {fit.lines.text(int(fit.groups[i]))}: {fit.residuals[i]:+.1f} errors"
        for i in order[:most]
    ] + more


def outlier(fit: Fit) -> list[str]:
    """The measured frequency that alone makes the fit poor, if there is one.

    Without it χ² is less by r²/(1 - h), r its weighted residual and h its leverage: exact for a linear model, by the Sherman-Morrison
    formula for JᵀJ without one row.
    """
    count = len(fit.groups)
    if count < 2 or fit.degrees_of_freedom < 2:
        return []
    checked = np.maximum(1.0 - fit.statistics.leverages[:count], 1e-3)  # nothing checks a line of leverage 1
    decrease = fit.residuals[:count] ** 2 / checked
    i = int(np.argmax(decrease))
    rms = math.sqrt(max(float(fit.residuals @ fit.residuals - decrease[i]), 0.0) / (count - 1))
    if rms > _OUTLIER * fit.weighted_rms or abs(fit.residuals[i]) < FAR_OFF:
        return []
    place = int(fit.groups[i])
    return [
        f"line {fit.lines.number(place)}, {fit.lines.text(place)}: without it the weighted rms is about {rms:.2g}; check its "
        "frequency and assignment"
    ]


def mostly_off(fit: Fit, errors: float = FAR_OFF) -> bool:
    """Whether more than half of the frequencies that count deviate by more than `errors` standard errors."""
    return bool((np.abs(fit.residuals[: len(fit.groups)]) > errors).sum() > len(fit.groups) / 2)


def quartics_not_free(fit: Fit) -> list[str]:
    """Quartic distortion constants of the top that are not free; none for SPFIT's codes, which are no named constants."""
    if fit.constants is None:
        return []
    named = fit.constants
    names = distortion_terms(named.kind, named.reduction)
    return [name for name in names if j_order(name, named) == 4 and name not in fit.parameters.names]


def decisive(fit: Fit, leverage: float = 0.9) -> list[str]:
    """Lines with leverage near 1: without them a combination of parameters would not be determined."""
    leverages = fit.statistics.leverages[: len(fit.groups)]
    return [
        f"line {fit.lines.number(int(fit.groups[i]))}, {fit.lines.text(int(fit.groups[i]))}: leverage {leverages[i]:.3f}; nothing checks it"
        for i in np.argsort(-leverages)[:10].tolist()
        if leverages[i] > leverage
    ]


def dfbetas(fit: Fit) -> Floats | None:
    """Shift of each parameter, in standard errors, if a measured frequency is left out (frequencies, n); see `Regression`.

    None with fewer than two degrees of freedom: without the frequency there would be no scatter to compare with.
    """
    if fit.degrees_of_freedom < 2:
        return None
    return fit.statistics.dfbetas(fit.minimum.residuals)[: len(fit.groups)]


def influential(fit: Fit, errors: float = 1.0) -> list[str]:
    """Lines without which a constant would move by more than `errors` standard errors, most influential first."""
    moved, out = dfbetas(fit), list[str]()
    if moved is None:
        return out
    size = np.where(np.isfinite(moved), np.abs(moved), 0.0)
    largest = size.max(axis=1, initial=0.0)
    for i in np.argsort(-largest, kind="stable")[:5].tolist():
        if largest[i] > errors:
            k, place = int(np.argmax(size[i])), int(fit.groups[i])
            out.append(
                f"line {fit.lines.number(place)}, {fit.lines.text(place)}: moves {fit.parameters.names[k]} by {moved[i, k]:+.1f} "
                "standard errors (DFBETAS)"
            )
    return out


def influence(fit: Fit) -> list[str]:
    """The most influential lines with leverages and DFBETAS (shifts in standard errors from the scatter without the line)."""
    moved = dfbetas(fit)
    if moved is None:
        return [f"undefined with {counted(fit.degrees_of_freedom, 'degree')} of freedom"]
    size = np.abs(moved).max(axis=1, initial=0.0)
    leverages, lines = fit.statistics.leverages, fit.lines
    out = []
    for i in np.argsort(-size, kind="stable")[:_INFLUENTIAL].tolist():
        place = int(fit.groups[i])
        text = f"line {lines.number(place)}, {lines.text(place)}: leverage {leverages[i]:.3f}"
        if not np.isfinite(size[i]):
            out.append(f"{text}; without it constants are not determined")
            continue
        most = np.argsort(-np.abs(moved[i]), kind="stable")[:_MOVED].tolist()
        out.append(f"{text}; " + ", ".join(f"{fit.parameters.names[k]} {moved[i, k]:+.2f}" for k in most))
    return out


def parameter_units(fit: Fit) -> str:
    """The units of the parameters: MHz, and those of dipole components and of angles and rho of internal rotors."""
    units = {name: unit_of_constant(name) for name in fit.parameters.names}
    others = {"mu": "D", **{name: unit for name, unit in units.items() if unit not in ("MHz", "D")}}
    if "D" not in units.values():
        others.pop("mu")
    return "; ".join(
        ["MHz", *(f"{name} in {unit}" if unit else f"{name} without unit" for name, unit in others.items())]
    )


def _hamiltonian(fit: Fit) -> list[str]:
    """Kind of top, reduction and representation of the constants."""
    if fit.constants is None:
        return []
    constants = fit.constants
    return [
        f"{constants.kind} top"
        + (f", {constants.reduction}-reduction, {constants.representation}" if constants.reduction else "")
    ]


def _start(fit: Fit) -> list[str]:
    rows = zip(fit.parameters.names, fit.parameters.start.tolist(), fit.parameters.prior.tolist(), strict=True)
    return [
        f"{i:5d}  {name:<16}{value:24.15E}  {error_text(prior, '12.4E'):>12}"
        for i, (name, value, prior) in enumerate(rows, 1)
    ]


def _lines(fit: Fit) -> list[str]:
    lines = fit.lines
    texts = _texts(lines)
    width = max(map(len, texts), default=0)
    head = f"{'':>6} {'upper - lower':<{width}} {'observed':>16} {'calculated':>16} {'obs-calc':>12} {'error':>10}"
    out = [f"{head} {'est.error':>10} {'/error':>8}  MHz, lines in cm-1 marked c"]
    blended = np.bincount(lines.blend[fit.used], minlength=int(lines.blend.max(initial=0)) + 1) > 1
    in_blend = (blended[lines.blend] & fit.used).tolist()
    leverages = dict(zip(fit.groups.tolist(), fit.statistics.leverages.tolist(), strict=False))
    unit = np.where(lines.wavenumber, 29979.2458, 1.0)
    difference, error = fit.difference_mhz, fit.line_errors_mhz
    numbers = (lines.frequency_mhz, fit.calculated_mhz, difference, error, fit.calculated_errors_mhz)
    columns = [(column / unit).tolist() for column in numbers]
    with np.errstate(divide="ignore", invalid="ignore"):  # lines without an error have no ratio
        ratios = np.where(error > 0, difference / error, np.nan).tolist()
    marks = np.where(lines.wavenumber, "c", " ").tolist()
    for i, (seen, calculated, off, stated, estimated) in enumerate(zip(*columns, strict=True)):
        ratio = f"{ratios[i]:8.2f}" if stated > 0 else f"{'-':>8}"
        text = (
            f"{lines.number(i):5d}: {texts[i]:<{width}} {seen:16.5f} {calculated:16.5f} {off:12.5f} {stated:10.5f} {estimated:10.5f} "
            f"{ratio} {marks[i]}"
        )
        if in_blend[i]:
            text += f" blend, mean {fit.blended_mhz[i] / unit[i]:.5f}, weight {lines.weight[i]:g}"
        if i in fit.left_out:
            text += f" DOES NOT COUNT: {fit.left_out[i]}"
        elif leverages.get(i, 0.0) > 0.9:  # such a line determines a parameter nearly alone
            text += f" leverage {leverages[i]:.2f}"
        out.append(text.rstrip())
    return out


def _texts(lines: Assignments) -> list[str]:
    """The labels of all lines, formatted as by `Assignments.text`."""
    if lines.halves:
        return [lines.text(i) for i in range(len(lines))]
    sides = ([" ".join(map(str, row)) for row in side.tolist()] for side in (lines.upper, lines.lower))
    return [" - ".join(pair) for pair in zip(*sides, strict=True)]


def _end(fit: Fit) -> list[str]:
    errors, scaled = fit.errors, fit.scaled_errors
    out = []
    for i, name in enumerate(fit.parameters.names):
        value, error = float(fit.values[i]), float(errors[i])
        shown = value_text(value, error) if math.isfinite(error) else f"{value!r} (not determined)"
        change = value - float(fit.parameters.start[i])
        out.append(
            f"{i + 1:5d}  {name:<16}{shown:>28}  {error_text(error, '12.4E'):>12}  "
            f"{scatter_text(float(scaled[i]), '12.4E'):>12}  {change:12.4E}"
        )
    return out


def _search(fit: Fit) -> list[str]:
    return [
        f"{step.number:5d}  {step.rms_before:14.6f} {step.rms_after:14.6f}  {step.damping:8.1e}{'' if step.taken else '  refused'}"
        for step in fit.minimum.iterations
    ] or ["    0  the start was the minimum"]


def _correlations(fit: Fit) -> list[str]:
    matrix, names = fit.statistics.correlations, fit.parameters.names
    out = []
    for i, row in enumerate(matrix):
        numbers = " ".join(f"{value:9.6f}" if np.isfinite(value) else "        -" for value in row[: i + 1])
        out.append(f"{i + 1:5d}  {names[i]:<16}{numbers}")
    # below the diagonal each pair stands once
    strong = np.argwhere(np.tril(np.abs(np.nan_to_num(matrix)), -1) > _CORRELATED)
    return out + [f"strong: {names[i]} and {names[j]} {matrix[i, j]:+.5f}" for i, j in strong.tolist()]
