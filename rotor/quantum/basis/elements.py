"""Matrix elements of several operators on their common pattern: rows, columns, and one row of values for each operator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Ints

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

    def between(self, functions: NDArray[np.bool_]) -> Elements:
        """The elements between chosen functions (count,)."""
        here = functions[self.rows] & functions[self.columns]
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
