"""Unit matrices of one block: what a Hamiltonian that is linear in its parameters is made of, H = Σ c_i O_i.

The O_i are taken as their elements that are not zero, the same places for all parameters; see `unit_blocks`, which solves them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import Enum
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.wang.basis import WangBlock

Namer = Callable[[Floats, Floats, Floats], Ints]  # matrix, energies, vectors -> names (n, columns) of the states


class Follows(Enum):
    """From what it is known that a state still has its name, without making the names anew.

    MOSTLY : from the sub-block that has at least 0.8 of it, and its rank by energy in that
    GROUPS : names are given by sub-blocks, the largest shares first, each as many as it has functions, and by energy in these
    NOTHING : names are always made anew
    """

    MOSTLY = 1
    GROUPS = 2
    NOTHING = 3


class NamedFunctions(NamedTuple):
    """How states get names after functions: the number of the sub-block of every function (functions,), and by what rule."""

    sub_blocks: Ints
    namer: Namer
    follows: Follows


Naming = Callable[[Sequence[tuple[int, WangBlock]], str], NamedFunctions]  # states and Wang blocks, representation


class UnitBlock(NamedTuple):
    """One block: size, places (row, column, row ≥ column) of elements, their factors (elements, units), which parameters.

    mix (units, parameters) : how much of each unit matrix a parameter has
    members (sub-blocks, functions) : 1 where a function is in a sub-block
    namer : names of all states, where they must be made
    follows : what tells that names are as they were
    """

    size: int
    rows: Ints
    columns: Ints
    factors: Floats
    mix: Floats
    parameters: Ints
    members: Floats
    namer: Namer
    follows: Follows = Follows.MOSTLY


class Elements(NamedTuple):
    """Elements of a matrix that are not zero, of its lower triangle: places row * size + column, rising, and values."""

    places: Ints
    values: Floats


def elements_of(matrix: Floats) -> Elements:
    """Of a dense matrix (size, size).

    >>> elements_of(np.array([[1.0, 9.0], [0.0, 2.0]])).places.tolist()
    [0, 3]
    """
    places = np.flatnonzero(matrix)
    rows, columns = np.divmod(places, matrix.shape[1])
    places = places[rows >= columns]
    return Elements(places, matrix.ravel()[places])


class WeightedElements(NamedTuple):
    """Elements of many matrices at once: places as of `Elements`, in any order, and factors (elements, parameters), which add up."""

    places: Ints
    factors: Floats


def unit_block(
    units: dict[int, Elements],
    sub_blocks: Ints,
    namer: Namer,
    more: WeightedElements | None = None,
    follows: Follows = Follows.MOSTLY,
) -> UnitBlock:
    """From the unit matrix of every parameter that acts in the block.

    Parameters
    ----------
    units : dict
        Unit matrices by the number of the parameter.
    sub_blocks : (functions,) array
        The number of the sub-block of every function.
    namer : callable
    more : WeightedElements, optional
        Elements of other parameters, a column for every number.
    follows : Follows, optional

    Returns
    -------
    UnitBlock
    """
    size = len(sub_blocks)
    given = [np.arange(size) * (size + 1), *(one.places for one in units.values()), *([more.places] if more else [])]
    places, of_place = numbered(np.concatenate(given), size * size)
    bounds = np.cumsum([0, *map(len, given)]).tolist()
    count = more.factors.shape[1] if more else 1 + max(units, default=-1)
    factors = np.zeros((len(places), count))
    if more:
        np.add.at(factors, of_place[bounds[-2] :], more.factors)
    for column, start, stop in zip(units, bounds[1:], bounds[2:], strict=False):
        factors[of_place[start:stop], column] = units[column].values
    numbers = np.flatnonzero(factors.any(axis=0))
    rows, columns = np.divmod(places, size)
    mix, members = np.eye(len(numbers)), members_of(sub_blocks)
    return UnitBlock(size, rows, columns, factors[:, numbers], mix, numbers, members, namer, follows)


def numbered(values: Ints, count: int) -> tuple[Ints, Ints]:
    """The different ones of whole numbers from 0 to `count`, rising, and the place of each value among them.

    >>> [found.tolist() for found in numbered(np.array([3, 1, 3]), 4)]
    [[1, 3], [1, 0, 1]]
    """
    there = np.zeros(count, dtype=bool)
    there[values] = True
    found = np.flatnonzero(there)
    place = np.empty(count, dtype=np.int64)
    place[found] = np.arange(len(found))
    return found, place[values]


def members_of(sub_blocks: Ints) -> Floats:
    """1 where a function (columns) is in a sub-block (rows), from the number of the sub-block of every function."""
    return np.asarray(sub_blocks[None, :] == np.arange(sub_blocks.max(initial=0) + 1)[:, None], dtype=float)
