"""Functions of three equivalent spins with one total spin, by symmetry species, and their coupling to the other spins.

The functions |((I_2 I_3)I_23, I_1) I_tot⟩ are even or odd under the exchange of spins 2 and 3 as 2I - I_23 is. The cyclic exchange P,
1 → 2 → 3 → 1, has the elements

    ⟨I_23'|P|I_23⟩ = (-1)^I_23 √((2I_23'+1)(2I_23+1)) {I I I_23'; I I_tot I_23}

(A. R. Edmonds, Angular Momentum in Quantum Mechanics, 1957, eq. 6.1.5). ½(P + P⁻¹) is 1 in functions of species A1 (even) and A2 (odd)
and -½ in E, of which one function x is even and its partner y = (P - P⁻¹)x/√3 odd: P turns (x, y) by 120°.

A pattern with a total is (N, ..., F', symmetry, I_tot, F), all doubled. symmetry: 0 for A1, 2 for A2, 4 for x, 8 for y, plus 12 for each
further function of the same species and total; halved, 0, 1, 2, 4 are the numbers of H. M. Pickett, J. Mol. Spectrosc. 228, 659 (2004).
"""

from __future__ import annotations

from functools import lru_cache
from math import sqrt
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.spins.coupling import patterns, recoupled
from rotor.quantum.wigner import six_j

A1, A2, EVEN_E, ODD_E = 0, 2, 4, 8
STEP = 12  # between the numbers of successive functions of one species


class SymmetricFunctions(NamedTuple):
    """Functions with one total spin: doubled I_23 (n,), symmetry of each function (m,), and amplitudes (n, m), n = m."""

    pair_spins: Ints
    symmetry: Ints
    amplitudes: Floats


class Allowed(NamedTuple):
    """Functions of a block that exchange allows, in columns over products of rotational function and pattern, (products, n).

    sub_block: number of the sub-block of each function, from 0, rising. names, sizes: labels of the sub-blocks, see
    `parts.names_of_parts`.
    """

    products: Floats
    sub_block: Ints
    names: Ints
    sizes: Ints


def cyclic_exchange(twice_i: int, twice_total: int) -> tuple[Ints, Floats]:
    """The doubled I_23 that couple with a third spin I to the total, and the matrix of P over them.

    >>> pairs, p = cyclic_exchange(1, 1)
    >>> pairs.tolist(), bool(abs(p @ p @ p - np.eye(2)).max() < 1e-15)
    ([0, 2], True)
    """
    sums = np.arange(0, 2 * twice_i + 1, 2)
    pairs = sums[(np.abs(sums - twice_i) <= twice_total) & (twice_total <= sums + twice_i)]
    a, b, i, total = pairs[:, None] / 2, pairs[None, :] / 2, twice_i / 2, twice_total / 2
    sign = np.where(pairs // 2 % 2, -1.0, 1.0)
    return pairs, np.asarray(sign * np.sqrt((2 * a + 1) * (2 * b + 1)) * six_j(i, i, a, i, total, b))


@lru_cache(maxsize=64)
def symmetric_functions(twice_i: int, twice_total: int) -> SymmetricFunctions:
    """Functions of three spins I with one total, by species: A1, A2, then pairs x, y of E."""
    pairs, p = cyclic_exchange(twice_i, twice_total)
    even = (twice_i - pairs // 2) % 2 == 0
    mean, turn = (p + p.T) / 2, (p - p.T) / sqrt(3.0)
    columns, names = [], []
    for chosen, alone in ((even, A1), (~even, A2)):
        rows = np.flatnonzero(chosen)
        values, vectors = np.linalg.eigh(mean[np.ix_(rows, rows)])
        functions = np.zeros((len(pairs), len(rows)))
        functions[rows] = vectors * np.where(vectors.sum(axis=0) < 0, -1.0, 1.0)  # fixes the sign of each function
        single = values > 0.25  # eigenvalue 1 of A1 and A2, not -½ of E
        columns += list(functions[:, single].T)
        names += [alone + STEP * m for m in range(int(single.sum()))]
        if alone == A1:
            even_e = list(functions[:, ~single].T)
    for m, x in enumerate(even_e):
        columns += [x, turn @ x]
        names += [EVEN_E + STEP * m, ODD_E + STEP * m]
    return SymmetricFunctions(pairs, np.array(names, dtype=np.int64), np.array(columns).reshape(-1, len(pairs)).T)


def patterns_of_three(spins: tuple[int, ...], f: int) -> Ints:
    """All patterns of one F whose last three spins are coupled to a total, (number, 1 + spins), doubled; N rises.

    >>> patterns_of_three((1, 1, 1), 1).tolist()  # three of spin 1/2, F = 1/2: x and y of 1/2, A1 of 3/2
    [[0, 4, 1, 1], [0, 8, 1, 1], [2, 0, 3, 1], [2, 4, 1, 1], [2, 8, 1, 1], [4, 0, 3, 1]]
    """
    *others, i = spins[:-2]
    rows = []
    for total in range(3 * i % 2, 3 * i + 1, 2):
        names = symmetric_functions(i, total).symmetry.tolist()
        for pattern in patterns((*others, total), f).tolist():
            rows += [(*pattern[:-1], name, total, pattern[-1]) for name in names]
    return np.array(sorted(rows), dtype=np.int64).reshape(-1, 1 + len(spins))


def recoupling_of_three(spins: tuple[int, ...], one_by_one: Ints, total: Ints) -> Floats:
    """⟨(((F' I_1)G I_2)G' I_3)F|(F' I_tot)F⟩ between patterns coupled one by one and those with a total, (one by one, total).

    The recoupling of ((G I_2)G' I_3)F to (G I_23)F, that of ((F' I_1)G I_23)F to (F' (I_1 I_23)I_tot)F, both by Edmonds (6.1.5),
    the exchange of I_1 and I_23 with (-1)^(I_1+I_23-I_tot), and the amplitudes of `symmetric_functions`.
    """
    i = spins[-1]
    left = one_by_one[:, None, :]
    out = np.zeros((len(one_by_one), len(total)))
    for twice_total in np.unique(total[:, -2]):
        functions = symmetric_functions(i, int(twice_total))
        columns = np.flatnonzero(total[:, -2] == twice_total)
        right = total[columns][None, :, :]
        alike = (left[..., :-3] == right[..., :-3]).all(axis=-1)
        start, g, g2, f = (left[..., k] for k in (-4, -3, -2, -1))
        place = np.searchsorted(functions.symmetry, right[0, :, -3], sorter=np.argsort(functions.symmetry))
        amplitudes = functions.amplitudes[:, np.argsort(functions.symmetry)[place]]
        for pair, amplitude in zip(functions.pair_spins.tolist(), amplitudes, strict=True):
            first = recoupled(g, i, g2, i, f, pair)
            second = recoupled(start, i, g, pair, f, twice_total)
            order = -1.0 if (i + pair - twice_total) // 2 % 2 else 1.0
            out[:, columns] += np.where(alike, order * amplitude * first * second, 0.0)
    return out
