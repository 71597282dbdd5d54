"""Functions labelled by columns of quantum numbers, and the elements of operators between them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Ints
from rotor.quantum.operators.algebra import Change, Factor, Operator

ROUND_OFF = 1e-14  # of the largest element of an operator: smaller ones are zero


@dataclass(frozen=True)
class Elements:
    """⟨row|O_i|column⟩ = values[i] between `count` functions; each place stands once."""

    count: int
    rows: Ints
    columns: Ints
    values: NDArray[Any]

    def dense(self, operator: int = 0) -> NDArray[Any]:
        """The matrix (count, count) of one operator."""
        matrix = np.zeros((self.count, self.count), dtype=self.values.dtype)
        matrix[self.rows, self.columns] = self.values[operator]
        return matrix

    def where(self, here: NDArray[np.bool_]) -> Elements:
        """Some of the elements."""
        return Elements(self.count, self.rows[here], self.columns[here], self.values[:, here])


def merged(count: int, rows: Ints, columns: Ints, values: NDArray[Any]) -> Elements:
    """Elements with repeated places added, and places that are zero to round-off in every operator left out."""
    key = rows * count + columns
    order = np.argsort(key, kind="stable")
    key, values = key[order], values[:, order]
    starts = np.flatnonzero(np.diff(key, prepend=-1))
    if len(starts) < len(key):
        values = np.add.reduceat(values, starts, axis=1)
        key = key[starts]
    size = np.abs(values)
    retained = (size > ROUND_OFF * size.max(axis=1, keepdims=True, initial=0.0)).any(axis=0)
    values = values[:, retained]
    if np.iscomplexobj(values) and not values.imag.any():
        values = np.ascontiguousarray(values.real)
    return Elements(count, key[retained] // count, key[retained] % count, values)


def concatenated(count: int, operators: int, pieces: Sequence[tuple[Ints, Ints, NDArray[Any]]]) -> Elements:
    """One set of elements of several pieces (rows, columns, values)."""
    if not pieces:
        none = np.zeros(0, dtype=np.int64)
        return Elements(count, none, none, np.zeros((operators, 0)))
    rows, columns, values = zip(*pieces, strict=True)
    return merged(count, np.concatenate(rows), np.concatenate(columns), np.concatenate(values, axis=1))


@dataclass(frozen=True, eq=False)
class Basis:
    """Functions |a b c ...⟩: equally long columns of whole numbers by label, each row once.

    >>> from rotor.quantum.operators.rotation import ladder
    >>> basis = Basis({"J": np.array([1, 1, 1]), "K": np.array([-1, 0, 1])})
    >>> basis.elements([ladder(1)]).dense().round(3).tolist()
    [[0.0, 0.0, 0.0], [1.414, 0.0, 0.0], [0.0, 1.414, 0.0]]
    """

    labels: Mapping[str, Ints]
    _lowest: dict[str, int] = field(init=False, repr=False)
    _spans: dict[str, int] = field(init=False, repr=False)
    _rows: Ints = field(init=False, repr=False)

    def __post_init__(self) -> None:
        columns = {name: np.asarray(column, dtype=np.int64) for name, column in self.labels.items()}
        object.__setattr__(self, "labels", columns)
        object.__setattr__(self, "_lowest", {name: int(column.min()) for name, column in columns.items()})
        object.__setattr__(self, "_spans", {name: int(np.ptp(column)) + 1 for name, column in columns.items()})
        rows = np.full(int(np.prod(list(self._spans.values()))), -1, dtype=np.int64)
        rows[self._key(columns)] = np.arange(len(self))
        if np.count_nonzero(rows >= 0) != len(self):
            raise ValueError(f"basis labelled by {', '.join(columns)}: a function stands twice")
        object.__setattr__(self, "_rows", rows)

    def __len__(self) -> int:
        return len(next(iter(self.labels.values())))

    def rows(self, labels: Mapping[str, Ints]) -> Ints:
        """Rows of the functions with these labels, -1 where there is none."""
        inside = np.ones(len(next(iter(labels.values()))), dtype=bool)
        for name, low in self._lowest.items():
            inside &= (labels[name] >= low) & (labels[name] < low + self._spans[name])
        return np.where(inside, self._rows[np.where(inside, self._key(labels), 0)], -1)

    def elements(self, operators: Sequence[Operator]) -> Elements:
        """Elements of operators on their common pattern."""
        by_change: dict[Change, list[tuple[int, Factor]]] = defaultdict(list)
        for i, operator in enumerate(operators):
            for shift in operator.shifts:
                by_change[shift.change].append((i, shift.factor))
        pieces = [self._piece(change, len(operators), factors) for change, factors in by_change.items()]
        return concatenated(len(self), len(operators), pieces)

    def _piece(
        self, change: Change, count: int, factors: Sequence[tuple[int, Factor]]
    ) -> tuple[Ints, Ints, NDArray[Any]]:
        """Elements of all shifts by one change of labels."""
        target = self.rows({**self.labels, **{name: self.labels[name] + step for name, step in change}})
        columns = np.flatnonzero(target >= 0)
        labels = {name: column[columns] for name, column in self.labels.items()}
        evaluated = [(i, np.asarray(factor(labels))) for i, factor in factors]
        values = np.zeros((count, len(columns)), dtype=np.result_type(float, *[value.dtype for _, value in evaluated]))
        for i, value in evaluated:
            values[i] += value
        return target[columns], columns, values

    def _key(self, labels: Mapping[str, Ints]) -> Ints:
        key = np.zeros(len(next(iter(labels.values()))), dtype=np.int64)
        for name, low in self._lowest.items():
            key = key * self._spans[name] + (labels[name] - low)
        return key


def rotation_labels(jmax: int, jmin: int = 0) -> dict[str, Ints]:
    """J and K of all |J K⟩ with J from `jmin` to `jmax`, K rising."""
    all_j = np.arange(jmin, jmax + 1)
    return {
        "J": np.repeat(all_j, 2 * all_j + 1),
        "K": np.concatenate([np.arange(-j, j + 1) for j in all_j.tolist()]),
    }
