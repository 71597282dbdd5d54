"""Assigned lines in the order of a .lin file, where neighbours of one frequency and error are a blend.

The lines of a blend are neighbours in the file, followed by a line for the width of the blend. Separate lines of equal frequency
need another line between them; `rotor.formats.spcat.text.lin.LineList.blends` has the rule.
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
    """A blend: its number, frequency and error in the units of the file, number of lines, and whether it has a width."""

    number: int
    frequency: float
    error: float
    count: int
    wide: bool

    def runs_into(self, second: _Blend) -> bool:
        """Whether a blend that follows this one would be read as part of it or as its width; limits are doubled for round-off."""
        if self.wide or abs(self.frequency - second.frequency) > 2e-14 * abs(second.frequency) + 2e-8:
            return False
        as_width = self.count > 1 and second.error * self.error > 2 * self.error**2
        return as_width or abs(self.error - second.error) < 2e-7


def as_lin(lines: Assignments) -> LineList:
    """The lines as a .lin file, with excluded lines after a blank line.

    Half-integers are rounded up; wavenumbers have a negative error."""
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
    listed = line_list(upper, lower, ordered.frequency_mhz, ordered.error_mhz, ordered.weight)
    unit = np.where(ordered.wavenumber, 1 / MHZ_PER_CM, 1.0)
    sign = np.where(ordered.wavenumber, -1.0, 1.0)
    return replace(listed, frequency=ordered.frequency_mhz * unit, error=sign * ordered.error_mhz * unit)


def lin_notes(lines: Assignments) -> list[str]:
    """Notes on these lines in a .lin file, where neighbours of equal frequency become one blend."""
    pairs = _meetings(_in_order(lines.take(~lines.is_excluded)))
    if not pairs:
        return []
    them = "it is" if pairs == 1 else "them are"
    return [
        f"{counted(pairs, 'line')} of the same frequency as the line before {them} a blend with it in a .lin file, for want of "
        "others to put between them; a .csv file has them apart"
    ]


def with_excluded_lines(lines: Assignments, read: LineList) -> Assignments:
    """Assigned lines together with the excluded lines after the list of a .lin file."""
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
    """The blends of the lines."""
    numbers, first, counts = np.unique(lines.blend, return_index=True, return_counts=True)
    unit = np.where(lines.wavenumber, 1 / MHZ_PER_CM, 1.0)
    frequency, error = lines.frequency_mhz * unit, lines.error_mhz * unit * np.where(lines.wavenumber, -1.0, 1.0)
    columns = (numbers, frequency[first], error[first], counts)
    return [
        _Blend(n, f, e, count, n in lines.widths_mhz)
        for n, f, e, count in zip(*(column.tolist() for column in columns), strict=True)
    ]


def _in_order(lines: Assignments) -> list[_Blend]:
    """The blends in an order in which neighbours do not merge, as near to the order of their numbers as possible."""
    ordered, waiting = list[_Blend](), list[_Blend]()
    for blend in _blends(lines):
        if ordered and ordered[-1].runs_into(blend):
            waiting.append(blend)
            continue
        ordered.append(blend)
        ready = next((candidate for candidate in waiting if not blend.runs_into(candidate)), None)
        if ready is not None:
            waiting.remove(ready)
            ordered.append(ready)
    for blend in waiting:
        fits = (
            i
            for i in range(len(ordered) + 1)
            if not _meetings([*ordered[max(i - 1, 0) : i], blend, *ordered[i : i + 1]])
        )
        ordered.insert(next(fits, len(ordered)), blend)
    return ordered


def _meetings(order: Sequence[_Blend]) -> int:
    """Number of blends that would merge with the next one."""
    return sum(first.runs_into(second) for first, second in itertools.pairwise(order))


def _with_widths(lines: Assignments) -> Assignments:
    """Lines by blend, each blend of known width followed by a line whose error is the width."""
    last = np.flatnonzero(np.append(np.diff(lines.blend) != 0, True))
    wide = [i for i in last.tolist() if int(lines.blend[i]) in lines.widths_mhz]
    rows = np.sort(np.concatenate([np.arange(len(lines)), np.array(wide, dtype=np.int64)]), kind="stable")
    widened = lines.take(rows)
    second = np.flatnonzero(np.append(False, rows[1:] == rows[:-1]))
    widened.error_mhz[second] = [lines.widths_mhz[int(lines.blend[i])] for i in wide]
    return widened
