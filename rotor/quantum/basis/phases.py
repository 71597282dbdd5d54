"""Phases 1 and i of functions that make elements real."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Ints
from rotor.quantum.basis.elements import Elements

PURE = 1e-10  # share of the other part of an element up to which it counts as real, or as imaginary


class Phased(NamedTuple):
    """Elements in functions i^quarter |a⟩: real wherever a choice of phases makes them so."""

    elements: Elements
    quarters: Ints


def with_real_phases(elements: Elements) -> Phased:
    """The elements with phases 1 or i of the functions, real if any such choice makes all of them real, unchanged otherwise.

    A real element between two functions asks for equal phases, an imaginary one for different ones. Each function stands twice in a graph,
    once for either phase; a choice exists where no function is connected with its other self. E species without a plane of symmetry have
    none and stay complex.
    """
    unchanged = Phased(elements, np.zeros(elements.count, dtype=np.int64))
    if not np.iscomplexobj(elements.values):
        return unchanged
    real, imaginary = np.abs(elements.values.real), np.abs(elements.values.imag)
    scale = np.maximum(np.abs(elements.values).max(axis=1, initial=0.0), np.finfo(float).tiny)[:, None]
    real_share, imaginary_share = (real / scale).max(axis=0), (imaginary / scale).max(axis=0)
    if (np.minimum(real_share, imaginary_share) > PURE).any():
        return unchanged
    quarters = _quarters(elements, imaginary_share > real_share)
    if quarters is None:
        return unchanged
    turned = elements.values * 1j ** ((quarters[elements.columns] - quarters[elements.rows]) % 4)
    values = np.ascontiguousarray(turned.real)
    return Phased(Elements(elements.count, elements.rows, elements.columns, values), quarters)


def _quarters(elements: Elements, imaginary: NDArray[np.bool_]) -> Ints | None:
    """0 or 1 for each function so that `imaginary` elements connect unlike ones; None where there is no such choice."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    n, rows, columns = elements.count, elements.rows, elements.columns
    odd = np.where(imaginary, 1, 0)
    doubled_rows = np.concatenate([rows, rows + n])
    doubled_columns = np.concatenate([columns + n * odd, columns + n * (1 - odd)])
    graph = coo_array((np.ones(2 * len(rows), dtype=np.int8), (doubled_rows, doubled_columns)), shape=(2 * n, 2 * n))
    part = connected_components(graph, directed=False)[1]
    if (part[:n] == part[n:]).any():
        return None
    return np.asarray(part[:n] > part[n:], dtype=np.int64)
