"""Measured lines with the states they are assigned to: frequencies, errors, shares in blends."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.labels.quanta import label_value
from rotor.table import Table, counted


@dataclass(frozen=True, eq=False, repr=False)
class Assignments(Table):
    """Assigned lines as columns of equal length n.

    names : quantum numbers of a state, such as ("j", "ka", "kc"). upper, lower (n, k) : labels of the two states. A lower label that
    begins with a negative number marks an energy above the zero of the Hamiltonian instead of a transition
    frequency_mhz, error_mhz (n,) : measured. `wavenumber` (n,) marks lines measured in cm⁻¹; they are stored in MHz too
    weight (n,) : share within the blend. blend (n,) : lines with the same number are one measured frequency, which is the
    weighted mean of their calculated frequencies
    source : origin of the lines. comments : text written beside each line
    widths_mhz : for each blend number, the expected rms spread of its components, used as a standard error about 0
    places (n,) : index of each line in its source (from 0), if lines were left out
    halves : names of half-integer quantum numbers, whose labels are stored doubled
    excluded (n,) : lines that do not count in a fit, such as those rejected by an earlier fit; None if all count
    """

    names: tuple[str, ...]
    upper: Ints
    lower: Ints
    frequency_mhz: Floats
    error_mhz: Floats
    weight: Floats
    blend: Ints
    wavenumber: NDArray[np.bool_]
    source: str = ""
    comments: tuple[str, ...] = ()
    widths_mhz: dict[int, float] = field(default_factory=dict)
    places: Ints | None = None
    halves: frozenset[str] = frozenset()
    excluded: NDArray[np.bool_] | None = None

    def __post_init__(self) -> None:
        n, k = len(self.frequency_mhz), len(self.names)
        shapes = {
            "upper": (n, k),
            "lower": (n, k),
            "error_mhz": (n,),
            "weight": (n,),
            "blend": (n,),
            "wavenumber": (n,),
        }
        for name, shape in shapes.items():
            if np.shape(getattr(self, name)) != shape:
                raise ValueError(f"{name} has shape {np.shape(getattr(self, name))}; {shape} is needed for {n} lines")
        _refuse_numbers(self)

    def __len__(self) -> int:
        return len(self.frequency_mhz)

    @classmethod
    def from_rows(cls, names: Sequence[str], rows: ArrayLike, source: str = "rows") -> Assignments:
        """Lines from rows of numbers: labels of the upper state, of the lower state, frequency and error (MHz).

        A missing error (NaN) is 0, as that of an empty cell in a file: such a line does not count in a fit.

        >>> Assignments.from_rows(["j"], [(1, 0, 115271.2018, 0.0005)]).columns["j_upper"].tolist()
        [1]
        """
        table, k = np.array(rows, dtype=np.float64), len(names)
        if table.ndim != 2 or table.shape[1] != 2 * k + 2:
            raise ValueError(
                f"rows of shape {table.shape}: expected {', '.join(names)} of the upper state, of the lower state, frequency and error"
            )
        labels = table[:, : 2 * k].astype(np.int64)
        if (labels != table[:, : 2 * k]).any():
            raise ValueError("rows: expected whole quantum numbers")
        n = len(table)
        return cls(
            tuple(names),
            labels[:, :k],
            labels[:, k:],
            table[:, -2],
            np.where(np.isnan(table[:, -1]), 0.0, table[:, -1]),
            np.ones(n),
            np.arange(n),
            np.zeros(n, dtype=bool),
            source,
        )

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Labels as j_upper, ka_upper, ..., then frequency_mhz, error_mhz, weight, blend."""
        labels = {
            f"{name}_{side}": getattr(self, side)[:, i]
            for side in ("upper", "lower")
            for i, name in enumerate(self.names)
        }
        return {**labels, **{name: getattr(self, name) for name in ("frequency_mhz", "error_mhz", "weight", "blend")}}

    @property
    def from_zero(self) -> NDArray[np.bool_]:
        """Which lines are energies from the zero of the Hamiltonian, (n,): their lower state begins with a number below 0."""
        return np.asarray(self.lower[:, 0] < 0) if self.names else np.zeros(len(self), dtype=bool)

    def take(self, index: NDArray[Any]) -> Assignments:
        """The lines selected by a mask or an array of positions."""
        picked = np.arange(len(self))[index]
        fields = ("upper", "lower", "frequency_mhz", "error_mhz", "weight", "blend", "wavenumber")
        changes: dict[str, Any] = {name: getattr(self, name)[picked] for name in fields}
        if self.comments:
            changes["comments"] = tuple(self.comments[i] for i in picked.tolist())
        if self.excluded is not None:
            changes["excluded"] = self.excluded[picked]
        return replace(self, **changes, places=picked if self.places is None else self.places[picked])

    @property
    def is_excluded(self) -> NDArray[np.bool_]:
        """Which lines do not count, (n,)."""
        return np.zeros(len(self), dtype=bool) if self.excluded is None else self.excluded

    @property
    def blended(self) -> NDArray[np.bool_]:
        """Which lines share their frequency with others, (n,)."""
        counts = np.bincount(self.blend, minlength=1)
        return np.asarray(counts[self.blend] > 1)

    def number(self, line: int) -> int:
        """The number of a line in its source, counted from 1."""
        return int(line if self.places is None else self.places[line]) + 1

    def text(self, line: int) -> str:
        """The labels of one line as `3 1 2 - 2 1 1`, half-integers as 5/2."""
        return " - ".join(self.label_text(side[line].tolist()) for side in (self.upper, self.lower))

    def label_text(self, label: Sequence[int]) -> str:
        """One label as text."""
        return " ".join(label_value(name, q, name in self.halves) for name, q in zip(self.names, label, strict=True))


def _refuse_numbers(lines: Assignments) -> None:
    for name in ("frequency_mhz", "error_mhz", "weight"):
        values = getattr(lines, name)
        bad = ~np.isfinite(values) | ((values < 0) if name != "frequency_mhz" else False)
        if bad.any():
            first = int(np.argmax(bad))
            raise ValueError(
                f"line {first + 1}, {lines.text(first)}: {name} is {values[first]:g}; a finite number"
                f"{' of 0 or more' if name != 'frequency_mhz' else ''} is needed"
            )


def assignments(
    names: Sequence[str],
    upper: ArrayLike,
    lower: ArrayLike,
    frequency_mhz: ArrayLike,
    error_mhz: ArrayLike,
    *,
    weight: ArrayLike = 1.0,
    blend: ArrayLike | None = None,
    wavenumber: ArrayLike = False,
    source: str = "",
    comments: Sequence[str] = (),
    widths_mhz: Mapping[int, float] | None = None,
    halves: Collection[str] = (),
) -> Assignments:
    """Assigned lines from labels (n, k) and numbers (n,), or one number for all.

    Parameters
    ----------
    names : sequence of str
        Quantum numbers in the columns of the labels.
    upper, lower : (n, k) arrays
    frequency_mhz, error_mhz : (n,) arrays, MHz
    weight : (n,) array
        Shares in blends.
    blend : (n,) array, optional
        Lines with the same number are one measured frequency. Default: no blends.
    wavenumber : (n,) array of bool
        Which lines were measured in cm⁻¹.
    source, comments : origin of the lines; text written beside each line
    widths_mhz : mapping, optional
        For each blend number, the expected rms spread of its components.
    halves : collection of str, optional
        Half-integer quantum numbers, whose labels are doubled.

    Returns
    -------
    Assignments
        (n,) lines.

    Raises
    ------
    ValueError
        For arrays of different lengths, numbers that are not finite, and negative errors or weights.

    Examples
    --------
    >>> lines = assignments(("j",), [[1], [2]], [[0], [1]], [115271.2018, 230538.0], 0.0005)
    >>> len(lines), lines.text(1), lines.blend.tolist()
    (2, '2 - 1', [0, 1])
    """
    frequency = np.asarray(frequency_mhz, dtype=float).reshape(-1)
    n = len(frequency)
    labels = [np.asarray(side, dtype=np.int64).reshape(n, -1) if n else np.zeros((0, len(names)), np.int64)
              for side in (upper, lower)]  # fmt: skip
    numbers, groups = np.unique(np.arange(n) if blend is None else np.asarray(blend), return_inverse=True)
    widths = (
        {place: widths_mhz[number] for place, number in enumerate(numbers.tolist()) if number in widths_mhz}
        if widths_mhz
        else {}
    )
    return Assignments(
        tuple(names), labels[0], labels[1], frequency,
        np.broadcast_to(np.asarray(error_mhz, dtype=float), (n,)).copy(),
        np.broadcast_to(np.asarray(weight, dtype=float), (n,)).copy(),
        groups.reshape(-1).astype(np.int64),
        np.broadcast_to(np.asarray(wavenumber, dtype=bool), (n,)).copy(),
        source, tuple(comments), widths, halves=frozenset(halves),
    )  # fmt: skip


def levels_in(lines: Assignments) -> tuple[Ints, Ints, Ints]:
    """The distinct levels (m, k), and for each line the indices of its upper and lower level; -1 is the zero of energy."""
    is_level = np.concatenate([np.ones(len(lines), dtype=bool), ~lines.from_zero])
    labels, places_among = _distinct_rows(np.concatenate([lines.upper, lines.lower])[is_level])
    places = np.full(2 * len(lines), -1, dtype=np.int64)
    places[is_level] = places_among.reshape(-1)
    return labels, places[: len(lines)], places[len(lines) :]


def _distinct_rows(rows: Ints) -> tuple[Ints, Ints]:
    """The distinct rows of an array, sorted, and the index of each original row among them."""
    # Rows of small integers are packed into one integer each: `np.unique` sorts these much faster than rows.
    spans = rows.max(axis=0, initial=0) - rows.min(axis=0, initial=0) + 1
    # keys of this table would overflow int64: rows are compared as they are
    if not len(rows) or np.prod(spans.astype(float)) > 2.0**62:
        return np.unique(rows, axis=0, return_inverse=True)
    keys = np.ravel_multi_index(tuple((rows - rows.min(axis=0, initial=0)).T), tuple(spans.tolist()))
    _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    return rows[first], inverse


def merged(first: Assignments, second: Assignments, *, same_within_mhz: float = 0.0) -> tuple[Assignments, list[str]]:
    """Merge two sets of assigned lines; also returns notes on lines that occur in both.

    If the frequencies of a line in both sets agree within `same_within_mhz`, the entry of `first` is used; otherwise both
    entries stay, with a note. Blends stay blends. Raises ValueError if the quantum numbers of the sets differ.
    """
    if first.names != second.names:
        raise ValueError(f"lines by {', '.join(first.names)} and by {', '.join(second.names)} cannot be merged")
    here = {_key(first, i): i for i in range(len(first))}
    chosen, notes, same, differing = [], list[str](), list[int](), list[tuple[float, int]]()
    for i in range(len(second)):
        twin = here.get(_key(second, i))
        if twin is None:
            chosen.append(i)
            continue
        apart = abs(first.frequency_mhz[twin] - second.frequency_mhz[i])
        if apart <= same_within_mhz:
            same.append(i)
        else:
            differing.append((apart, i))
            chosen.append(i)
    if differing:
        apart, i = max(differing)
        notes.append(
            f"{counted(len(differing), 'line is', 'lines are')} in both with different frequencies; both entries stay; the largest "
            f"difference is {apart:.4f} MHz, of {second.text(i)}"
        )
    if same:
        notes.insert(
            0,
            f"{counted(len(same), 'line is', 'lines are')} in both, once in the result, the first: {second.text(same[0])}",
        )
    return appended(first, second.take(np.array(chosen, dtype=np.int64))), notes


def appended(first: Assignments, second: Assignments) -> Assignments:
    """The lines of both sets, which have the same quantum numbers; blends stay blends."""
    shift = int(first.blend.max(initial=-1)) + 1  # blend numbers of the second list continue those of the first
    fields = ("upper", "lower", "frequency_mhz", "error_mhz", "weight", "wavenumber")
    joined: dict[str, Any] = {name: np.concatenate([getattr(first, name), getattr(second, name)]) for name in fields}
    return Assignments(
        first.names,
        **joined,
        blend=np.concatenate([first.blend, second.blend + shift]),
        source=" and ".join(dict.fromkeys(filter(None, (first.source, second.source)))),
        comments=tuple(text for lines in (first, second) for text in (lines.comments or ("",) * len(lines))),
        widths_mhz=first.widths_mhz | {number + shift: width for number, width in second.widths_mhz.items()},
        halves=first.halves,
        excluded=np.concatenate([first.is_excluded, second.is_excluded]),
    )


def _key(lines: Assignments, i: int) -> tuple[int, ...]:
    return (*lines.upper[i].tolist(), *lines.lower[i].tolist())


def duplicates(lines: Assignments) -> list[tuple[int, int]]:
    """Index pairs of lines with the same labels. Repeated measurements are allowed, but are reported."""
    seen: dict[tuple[int, ...], int] = {}
    out = []
    for i, key in enumerate(map(tuple, np.concatenate([lines.upper, lines.lower], axis=1).tolist())):
        if key in seen:
            out.append((seen[key], i))
        seen.setdefault(key, i)
    return out
