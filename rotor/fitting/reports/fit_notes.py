"""Notes on a finished fit: lines that do not count, levels that changed, unlikely labels, constants that are hardly determined."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotor.fitting.assignment import Assignments, duplicates
from rotor.fitting.result import Fit
from rotor.fitting.search.residuals import Search
from rotor.statistics.least_squares import BENT
from rotor.table import counted

APART = 100.0  # ratio of measured and calculated frequencies that a start in the same unit does not have
MUCH = 1e3  # times the median error: a line of a list of several methods is not so vague


def repeated_text(lines: Assignments, pairs: Sequence[tuple[int, int]]) -> str:
    """A note on lines that occur twice."""
    first, second = np.array(pairs).T
    apart = np.abs(lines.frequency_mhz[first] - lines.frequency_mhz[second])
    worst = int(np.argmax(apart))
    return (
        f"{counted(len(pairs), 'line stands', 'lines stand')} twice in the list, "
        f"the first: {lines.text(int(second[0]))}; the largest difference is "
        f"{apart[worst]:.4g} MHz, of {lines.text(int(second[worst]))}"
    )


def start_notes(search: Search) -> list[str]:
    """Notes on numbers in a unit that is hardly meant: frequencies far from those of the start, errors far above the others."""
    lines, used, calculated = search.lines, search.used, search.line_values(search.parameters.start).calculated
    notes = list[str]()
    compared = used & ~lines.from_zero & (calculated != 0)
    with np.errstate(over="ignore"):
        ratio = (
            float(np.median(np.abs(lines.frequency_mhz[compared] / calculated[compared]))) if compared.any() else 1.0
        )
    if not 1 / APART < ratio < APART:
        notes.append(
            f"the lines have {ratio:.3g} times the frequencies of the start; are both in the units that they state?"
        )
    usual = float(np.median(search.sigma[used]))
    vague = used & (search.sigma > MUCH * usual) & (search.sigma > 0.01 * np.abs(lines.frequency_mhz))
    for i in np.flatnonzero(vague).tolist()[:3]:
        at = f"{lines.text(i)} at {lines.frequency_mhz[i]:.4f} MHz"
        notes.append(
            f"line {lines.number(i)}, {at}, hardly counts: its error is {search.sigma[i]:.6g} MHz, "
            f"the median {usual:.3g}; is there a comma in a decimal number?"
        )
    return notes


def unlikely_lines(lines: Assignments) -> list[str]:
    """Notes on lines that break dipole selection rules (one state, no spins, no fields): ΔJ > 1, or ΔKa and ΔKc both even."""
    if lines.names[:1] != ("j",) or "v" in lines.names or lines.names[-1] in ("f", "field"):
        return []
    is_transition = ~lines.from_zero
    change = np.abs(lines.upper - lines.lower)
    far = is_transition & (change[:, 0] > 1)  # a dipole changes J by at most 1
    # every component of a dipole changes the parity of Ka or of Kc
    even = (
        is_transition & (change[:, 1:] % 2 == 0).all(axis=1) if lines.names == ("j", "ka", "kc") else np.zeros_like(far)
    )
    out = []
    for rows, why in ((far, "J changes by more than 1"), (even & ~far, "Ka and Kc both change by even numbers")):
        unlikely = np.flatnonzero(rows)
        if len(unlikely):
            first = f"line {lines.number(int(unlikely[0]))}, {lines.text(int(unlikely[0]))}"
            out.append(
                f"{counted(len(unlikely), 'line')} that no dipole moment makes, {first}: {why}; are the labels right?"
            )
    return out


def _bent(fit: Fit) -> list[str]:
    """Parameters with the largest steps left in the linear model, in units of the lengths of their columns."""
    statistics = fit.statistics
    moved = np.abs((fit.residuals @ statistics.left) @ statistics.inverse) * statistics.scale
    return [fit.parameters.names[i] for i in np.flatnonzero(moved > moved.max(initial=0.0) / 2)]


def fit_notes(fit: Fit) -> list[str]:
    """Notes for the user, in sentences."""
    lines, notes = fit.lines, list[str]()
    for i, why in fit.left_out.items():
        notes.append(
            f"line {lines.number(i)}, {lines.text(i)} at {lines.frequency_mhz[i]:.4f} MHz, does not count: {why}"
        )
    if fit.changed_states:
        changed = ", ".join(fit.changed_states[:5]) + (", ..." if len(fit.changed_states) > 5 else "")
        notes.append(
            f"{counted(len(fit.changed_states), 'level is', 'levels are')} mostly another state than at the start (by overlap): {changed}"
        )
    twice = duplicates(lines)
    if twice:
        notes.append(repeated_text(lines, twice))
    notes += unlikely_lines(lines)
    # within a fifth: a reversed line spoils the constants
    reversed_ = np.flatnonzero(
        fit.used & (np.abs(lines.frequency_mhz + fit.calculated_mhz) < 0.2 * np.abs(lines.frequency_mhz))
    )
    for i in reversed_.tolist():
        notes.append(
            f"line {lines.number(i)}, {lines.text(i)}: calculated with the opposite sign; are upper and lower exchanged?"
        )
    if fit.minimum.converged and fit.minimum.distance > BENT * max(1.0, fit.minimum.rms):
        notes.append(
            f"χ² is not quadratic within the standard errors, which are those of the linear model: {', '.join(_bent(fit))} may be "
            "known better or worse than they say; hold one of these, or add lines"
        )
    if np.isfinite(fit.statistics.condition) and fit.statistics.condition > 1e5:
        notes.append(f"condition number {fit.statistics.condition:.1e}: some constants are nearly interchangeable")
    return notes
