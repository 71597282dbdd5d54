"""Array types for annotations, reusable memory, and operations on tables that are faster than those of numpy."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Indices = NDArray[np.int32]


class Workspace:
    """Reusable memory for large temporary arrays: allocating it each time would cost as much as the work on it."""

    def __init__(self) -> None:
        self._arrays = dict[tuple[str, Any], NDArray[Any]]()

    def array(self, name: str, *shape: int, dtype: Any = np.float64) -> NDArray[Any]:
        """An uninitialised array of this shape, valid until the next request with the same name and type."""
        size, key = math.prod(shape), (name, dtype)
        if key not in self._arrays or len(self._arrays[key]) < size:
            self._arrays[key] = np.empty(size, dtype=dtype)
        return self._arrays[key][:size].reshape(shape)


@cache
def hold_freed_memory() -> None:
    """Let the C library reuse up to 32 MB of freed memory instead of returning it to the system.

    glibc returns free memory above twice the size of the largest array freed so far (mallopt(3), M_MMAP_THRESHOLD and
    M_TRIM_THRESHOLD), and the system clears each page that it hands out again. Freeing one array, even untouched, raises that size,
    as any large calculation does, for the rest of the process. Other systems are unaffected.
    """
    np.empty(1 << 24, dtype=np.uint8)


def writable(array: Any) -> Floats:
    """The array in C order, copied only if it is not writable: compiled loops have one signature more for each kind of array."""
    rows = np.ascontiguousarray(array, dtype=np.float64)
    return rows if rows.flags.writeable else rows.copy()


def with_components(values: ArrayLike, count: int, what: str) -> Floats:
    """Values as an array (..., count); a ValueError that begins with `what` for any other shape.

    >>> with_components([1, 2, 3], 3, "vectors")
    array([1., 2., 3.])
    """
    array = np.asarray(values, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != count:
        raise ValueError(f"{what} have shape (..., {count}); got shape {array.shape}")
    return array


def distinct(values: NDArray[Any]) -> NDArray[Any]:
    """The distinct values of an array in rising order, like `np.unique`, which would load numpy.ma (30 ms).

    >>> distinct(np.array([3, 1, 3])).tolist(), distinct(np.array([])).tolist()
    ([1, 3], [])
    """
    rising = np.sort(values, axis=None)
    first = np.concatenate([np.ones(min(len(rising), 1), dtype=bool), rising[1:] != rising[:-1]])
    return np.asarray(rising[first])


def rising_order(values: Floats) -> Ints:
    """The indices that sort nonnegative numbers stably, as `argsort(kind="stable")`, in half the time.

    The bits of a nonnegative double, read as a whole number, have its order. The last bits are replaced by the index and the keys sorted
    by value; the few numbers that agree in the remaining bits are sorted once more.

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
    equals_next = keys[1:] == keys[:-1]
    ties = np.flatnonzero(np.append(equals_next, False) | np.append(False, equals_next))
    order[ties] = order[ties][np.argsort(values[order[ties]], kind="stable")]
    return np.asarray(order)


def symmetric_from_lower(lower: Floats) -> Floats:
    """Symmetric matrices (..., n, n) from their lower triangles (zeros above the diagonal).

    >>> symmetric_from_lower(np.array([[1.0, 0.0], [2.0, 3.0]])).tolist()
    [[1.0, 2.0], [2.0, 3.0]]
    """
    return np.asarray(lower + np.tril(lower, -1).swapaxes(-1, -2))


def runs_of_similar_size(
    sizes: Sequence[int], ratio: float, small: int = 0, most: float = math.inf, costs: Sequence[int] | None = None
) -> Iterator[slice]:
    """Runs of successive matrices that share an array, padded to the largest of them.

    In a run, sizes differ by at most `ratio` or are all up to `small`, and the largest cost, by default the square of the size, times the
    number of matrices is at most `most`.

    >>> [(run.start, run.stop) for run in runs_of_similar_size([1, 3, 4, 9, 10, 11], 1.5, small=4, most=200)]
    [(0, 3), (3, 5), (5, 6)]
    """
    start, least, largest, cost = 0, math.inf, 0, 0
    for place, (size, cost_of_size) in enumerate(zip(sizes, costs or [size * size for size in sizes], strict=True)):
        least, largest = (size if size < least else least), (size if size > largest else largest)
        cost = cost_of_size if cost_of_size > cost else cost
        fits = (largest <= ratio * least or largest <= small) and (place + 1 - start) * cost <= most
        if not fits and place > start:
            yield slice(start, place)
            start, least, largest, cost = place, size, size, cost_of_size
    if len(sizes):
        yield slice(start, len(sizes))


def numbers_in_runs(counts: Ints, firsts: Ints | int = 0) -> tuple[Ints, Ints]:
    """The number of each run, and the whole numbers of the run from its first one, over runs of these counts.

    >>> [column.tolist() for column in numbers_in_runs(np.array([2, 1]), np.array([5, 0]))]
    [[0, 0, 1], [5, 6, 0]]
    """
    run = np.repeat(np.arange(len(counts)), counts)
    return run, np.arange(len(run)) + (firsts - np.cumsum(counts) + counts)[run]


def rows_of_keys(table: Ints, keys: Ints) -> Ints:
    """The rows (n,) of keys (n, k) in a table (m, k) of whole numbers, the last of equal ones, -1 where there is none.

    Quick for small tables; `matching_rows` is for large ones.

    >>> rows_of_keys(np.array([[1, 0], [2, 1]]), np.array([[2, 1], [3, 0]])).tolist()
    [1, -1]
    """
    row_of = {tuple(row): number for number, row in enumerate(table.tolist())}
    return np.array([row_of.get(tuple(key), -1) for key in keys.tolist()], dtype=np.int64)


LARGEST_CODE = 2**62  # of a row, the columns of which are digits


def matching_rows(table: Sequence[NDArray[Any]], keys: Sequence[NDArray[Any]]) -> Ints:
    """The first row (n,) of each key in a table, -1 where there is none; both by columns, of numbers or texts.

    >>> matching_rows([np.array([1, 2]), np.array(["a", "b"])], [np.array([2, 3]), np.array(["b", "a"])]).tolist()
    [1, -1]
    """
    count, codes = len(table[0]), 1
    code = np.zeros(count + len(keys[0]), dtype=np.int64)
    for both in zip(table, keys, strict=True):
        number, size = _numbers_from_zero(np.concatenate(both))
        if codes * size > LARGEST_CODE:
            code, codes = _numbers_from_zero(np.unique(code, return_inverse=True)[1])
        code, codes = code * size + number, codes * size
    order = np.argsort(code[:count], kind="stable")
    place = np.searchsorted(code[order], code[count:])
    row = np.append(order, -1)[place]
    return np.where((row >= 0) & (code[row] == code[count:]), row, -1)


def _numbers_from_zero(values: NDArray[Any]) -> tuple[Ints, int]:
    """Whole numbers from 0 that distinguish values, and the number after the largest."""
    if values.dtype.kind in "iu" and len(values):
        low = int(values.min())
        return np.asarray(values - low, dtype=np.int64), int(values.max()) - low + 1
    place = np.unique(values, return_inverse=True)[1]
    return place.astype(np.int64), int(place.max(initial=0)) + 1


def end_to_end(columns: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """One column of several tables, concatenated; that of a single table is not copied."""
    return np.concatenate(columns) if len(columns) > 1 else columns[0]


def copy_rows(table: NDArray[np.int16], rows: NDArray[Any]) -> NDArray[np.int16]:
    """Rows of a table of up to eight columns, in a fifth of the time: each row is copied as one number of 16 bytes.

    >>> copy_rows(np.array([[1, 2], [3, 4]], dtype=np.int16), np.array([1, 1])).tolist()
    [[3, 4], [3, 4]]
    """
    count, width = table.shape
    if width > 8:
        return np.asarray(table[rows])
    wide = np.zeros((count, 8), dtype=np.int16)
    wide[:, :width] = table
    return np.asarray(wide.view(np.complex128)[:, 0][rows].view(np.int16).reshape(-1, 8)[:, :width])


def same(value: Any, other: Any) -> bool:
    """Whether two values are equal: arrays by shape and elements; dataclasses, mappings and sequences item by item.

    NaN equals NaN, so that a copy equals its original.

    >>> same({"x": np.array([1.0, 2.0])}, {"x": np.array([1.0, 2.0])}), same(np.zeros(2), np.zeros(3))
    (True, False)
    """
    if value is other:
        return True
    if isinstance(value, np.ndarray) or isinstance(other, np.ndarray):
        return _same_arrays(value, other)
    if type(value) is not type(other):
        return bool(value == other)
    if is_dataclass(value):
        return all(same(getattr(value, f.name), getattr(other, f.name)) for f in fields(value) if f.compare)
    if isinstance(value, Mapping):
        return value.keys() == other.keys() and all(same(item, other[name]) for name, item in value.items())
    if isinstance(value, tuple | list):
        return len(value) == len(other) and all(map(same, value, other))
    return bool(value == other) or (value != value and other != other)


def _same_arrays(array: Any, other: Any) -> bool:
    if type(array) is not type(other) or array.shape != other.shape:
        return False
    return bool(np.array_equal(array, other, equal_nan=array.dtype.kind in "fc" and other.dtype.kind in "fc"))
