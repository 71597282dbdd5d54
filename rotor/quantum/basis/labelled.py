"""Functions labelled by columns of quantum numbers, and the elements of operators between them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Ints
from rotor.quantum.basis.elements import Elements, concatenated
from rotor.quantum.operators.algebra import Change, Factor, Operator


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
