"""The array types of annotations: real numbers, whole numbers, and row numbers of long tables; memory used again; equality."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Indices = NDArray[np.int32]


class Workspace:
    """Memory for large arrays that come and go: taken from the system anew each time it would cost as much as what is done with it."""

    def __init__(self) -> None:
        self._taken = dict[str, Floats]()

    def array(self, name: str, *shape: int) -> Floats:
        """An array of that shape with anything in it, valid until the next one of that name."""
        size = math.prod(shape)
        if name not in self._taken or len(self._taken[name]) < size:
            self._taken[name] = np.empty(size)
        return self._taken[name][:size].reshape(shape)


def hold_freed_memory() -> None:
    """Lets the C library hold up to 32 MB of what calculations free, for those that come next, instead of giving it to the system.

    glibc returns free memory above twice the size of the largest array that was freed so far (mallopt(3), M_MMAP_THRESHOLD and
    M_TRIM_THRESHOLD), and the system clears each page that is taken anew. An array that is never touched is enough to raise that
    size, as any large calculation does. Elsewhere nothing changes.
    """
    np.empty(1 << 24, dtype=np.uint8)


def distinct(values: NDArray[Any]) -> NDArray[Any]:
    """The values of an array, each once, rising. `np.unique` does the same, but loads numpy.ma for it, 30 ms.

    >>> distinct(np.array([3, 1, 3])).tolist(), distinct(np.array([])).tolist()
    ([1, 3], [])
    """
    rising = np.sort(values, axis=None)
    first = np.concatenate([np.ones(min(len(rising), 1), dtype=bool), rising[1:] != rising[:-1]])
    return np.asarray(rising[first])


def rising_order(values: Floats) -> Ints:
    """The indices that sort numbers not below 0, of equal ones the first first, as a stable `argsort` gives them, in half the time.

    The bits of such a number, as a whole number, are in its order. Each with its index in place of the last bits is sorted by
    value, without looking anything up; the few that do not differ in the bits before are sorted once more.

    >>> rising_order(np.array([3.0, 1.0, 0.0, 1.0])).tolist()
    [2, 1, 3, 0]
    """
    if len(values) and not values.min() >= 0:
        raise ValueError("numbers to sort: expected none below 0 and no NaN")
    last_bits = (1 << max(len(values) - 1, 1).bit_length()) - 1
    keys = np.abs(values).view(np.int64) & ~np.int64(last_bits)  # abs: -0.0 has the bits of the lowest number
    keys |= np.arange(len(values))
    keys.sort()
    order = keys & last_bits
    keys &= ~np.int64(last_bits)
    like_next = keys[1:] == keys[:-1]
    alike = np.flatnonzero(np.append(like_next, False) | np.append(False, like_next))
    order[alike] = order[alike][np.argsort(values[order[alike]], kind="stable")]
    return np.asarray(order)


def whole_of_lower(lower: Floats) -> Floats:
    """Symmetric matrices (..., n, n) of their lower triangles, which have zeros above the diagonal.

    >>> whole_of_lower(np.array([[1.0, 0.0], [2.0, 3.0]])).tolist()
    [[1.0, 2.0], [2.0, 3.0]]
    """
    return np.asarray(lower + np.tril(lower, -1).swapaxes(-1, -2))


def end_to_end(columns: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Columns of several tables as one; that of a single table as it is."""
    return np.concatenate(columns) if len(columns) > 1 else columns[0]


def rows_of(table: NDArray[np.int16], rows: NDArray[Any]) -> NDArray[np.int16]:
    """Rows of a table of up to eight columns, each taken as one number of 16 bytes, in a fifth of the time.

    >>> rows_of(np.array([[1, 2], [3, 4]], dtype=np.int16), np.array([1, 1])).tolist()
    [[3, 4], [3, 4]]
    """
    count, width = table.shape
    if width > 8:
        return np.asarray(table[rows])
    wide = np.zeros((count, 8), dtype=np.int16)
    wide[:, :width] = table
    return np.asarray(wide.view(np.complex128)[:, 0][rows].view(np.int16).reshape(-1, 8)[:, :width])


def same(one: Any, other: Any) -> bool:
    """Whether two values are equal: arrays by shape and elements, dataclasses field by field, mappings and sequences likewise.

    Two NaN are equal, so that a copy is equal to what it was copied from.

    >>> same({"x": np.array([1.0, 2.0])}, {"x": np.array([1.0, 2.0])}), same(np.zeros(2), np.zeros(3))
    (True, False)
    """
    if one is other:
        return True
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return _same_arrays(one, other)
    if type(one) is not type(other):
        return bool(one == other)
    if is_dataclass(one):
        return all(same(getattr(one, each.name), getattr(other, each.name)) for each in fields(one) if each.compare)
    if isinstance(one, Mapping):
        return one.keys() == other.keys() and all(same(value, other[name]) for name, value in one.items())
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(one == other) or (one != one and other != other)


def _same_arrays(one: Any, other: Any) -> bool:
    if type(one) is not type(other) or one.shape != other.shape:
        return False
    return bool(np.array_equal(one, other, equal_nan=one.dtype.kind in "fc" and other.dtype.kind in "fc"))
