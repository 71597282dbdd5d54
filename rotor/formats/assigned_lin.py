"""Assigned lines in the order of a .lin file, where neighbours of one frequency and error are a blend.

The lines of a blend stand together there, and the width of a blend as one more line behind them. Lines of one frequency that are no
blend need another line between them; see `rotor.formats.spcat.text.lin.LineList.blends` for the rule.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotor.fitting.assignment import Assignments, appended, assignments
from rotor.formats.spcat.text.lin import LineList, excluded_lines, line_list, with_defaults, with_excluded
from rotor.table import counted
from rotor.units import MHZ_PER_CM


@dataclass(frozen=True)
class _Blend:
    """A blend by its number, with frequency and error in the units of the file, how many lines it has, and whether it has a width."""

    number: int
    frequency: float
    error: float
    count: int
    wide: bool

    def runs_into(self, second: _Blend) -> bool:
        """Whether a blend behind this one is read as part of it, or as its width; twice the limits, for round-off in the text."""
        if self.wide or abs(self.frequency - second.frequency) > 2e-14 * abs(second.frequency) + 2e-8:
            return False
        as_width = self.count > 1 and second.error * self.error > 2 * self.error**2
        return as_width or abs(self.error - second.error) < 2e-7


def as_lin(lines: Assignments) -> LineList:
    """The lines as a .lin file has them, excluded ones behind a blank line; half-integers are rounded up, wavenumbers have a negative
    error."""
    excluded = lines.is_excluded
    counted_ones = _listed(lines.take(~excluded))
    return with_excluded(counted_ones, _listed(lines.take(excluded))) if excluded.any() else counted_ones


def _listed(lines: Assignments) -> LineList:
    """Lines in the order of a .lin file."""
    numbers, places = np.unique(lines.blend, return_inverse=True)
    order = np.array([line.number for line in _in_order(lines)], dtype=np.int64)
    rank = np.empty(len(numbers), dtype=np.int64)
    rank[np.searchsorted(numbers, order)] = np.arange(len(numbers))
    ordered = _with_widths(lines.take(np.argsort(rank[places.reshape(-1)], kind="stable")))
    halves = np.array([name in ordered.halves for name in ordered.names])
    upper, lower = (np.where(halves, (side + 1) // 2, side) for side in (ordered.upper, ordered.lower))
    made = line_list(upper, lower, ordered.frequency_mhz, ordered.error_mhz, ordered.weight)
    unit = np.where(ordered.wavenumber, 1 / MHZ_PER_CM, 1.0)
    sign = np.where(ordered.wavenumber, -1.0, 1.0)
    return replace(made, frequency=ordered.frequency_mhz * unit, error=sign * ordered.error_mhz * unit)


def note_of_lin(lines: Assignments) -> list[str]:
    """What is to be known of these lines in a .lin file: those of one frequency that no other line parts are one blend there."""
    pairs = _meetings(_in_order(lines.take(~lines.is_excluded)))
    if not pairs:
        return []
    them = "it is" if pairs == 1 else "them are"
    return [
        f"{counted(pairs, 'line')} of the same frequency as the line before {them} a blend with it in a .lin file, for want of "
        "others to put between them; a .csv file has them apart"
    ]


def with_excluded_lines(lines: Assignments, read: LineList) -> Assignments:
    """Assigned lines with those behind a .lin file's list that are marked as excluded."""
    names, marked = lines.names, excluded_lines(read, len(lines.names))
    if marked is None:
        return lines
    marked = with_defaults(marked, names)
    blends = marked.blends()
    upper, lower = (side[:, : len(names)] for side in marked.states())
    more = assignments(
        names, upper, lower, marked.frequency_mhz, marked.error_mhz,
        weight=marked.weight, blend=blends, wavenumber=marked.error < 0,
    )  # fmt: skip
    return appended(lines, replace(more.take(blends >= 0), excluded=np.ones(int((blends >= 0).sum()), dtype=bool)))


def _blends(lines: Assignments) -> list[_Blend]:
    numbers, first, counts = np.unique(lines.blend, return_index=True, return_counts=True)
    unit = np.where(lines.wavenumber, 1 / MHZ_PER_CM, 1.0)
    frequency, error = lines.frequency_mhz * unit, lines.error_mhz * unit * np.where(lines.wavenumber, -1.0, 1.0)
    columns = (numbers, frequency[first], error[first], counts)
    return [
        _Blend(n, f, e, count, n in lines.widths_mhz)
        for n, f, e, count in zip(*(column.tolist() for column in columns), strict=True)
    ]


def _in_order(lines: Assignments) -> list[_Blend]:
    """The blends by their numbers, but where one would run into the next this one stands behind the first that parts them, or before."""
    made, waiting = list[_Blend](), list[_Blend]()
    for blend in _blends(lines):
        if made and made[-1].runs_into(blend):
            waiting.append(blend)
            continue
        made.append(blend)
        ready = next((candidate for candidate in waiting if not blend.runs_into(candidate)), None)
        if ready is not None:
            waiting.remove(ready)
            made.append(ready)
    for blend in waiting:
        fits = (i for i in range(len(made) + 1) if not _meetings([*made[max(i - 1, 0) : i], blend, *made[i : i + 1]]))
        made.insert(next(fits, len(made)), blend)
    return made


def _meetings(order: Sequence[_Blend]) -> int:
    """How many blends run into the next one."""
    return sum(first.runs_into(second) for first, second in itertools.pairwise(order))


def _with_widths(lines: Assignments) -> Assignments:
    """Lines in order of their blends, and behind each blend of known width one more, whose error is the width."""
    last = np.flatnonzero(np.append(np.diff(lines.blend) != 0, True))
    wide = [i for i in last.tolist() if int(lines.blend[i]) in lines.widths_mhz]
    rows = np.sort(np.concatenate([np.arange(len(lines)), np.array(wide, dtype=np.int64)]), kind="stable")
    widened = lines.take(rows)
    second = np.flatnonzero(np.append(False, rows[1:] == rows[:-1]))
    widened.error_mhz[second] = [lines.widths_mhz[int(lines.blend[i])] for i in wide]
    return widened
