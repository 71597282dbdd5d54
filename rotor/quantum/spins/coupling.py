"""Angular momenta coupled one after another, N + S1 = J1, J1 + S2 = J2, ... = F: coupling patterns of an F and coefficients between them.

A coupling pattern is (N, J1, ..., F), stored doubled. A scalar operator T^K(N) · W^K(spins) has the element

    ⟨p'|T·W|p⟩ = c(p', p) ⟨N'‖T^K‖N⟩

whose coefficient c is a product over the steps of the chain, each with one symbol (A. R. Edmonds, Angular Momentum in Quantum
Mechanics, 1957): (7.1.7) where T^K does not act on the spin; (7.1.6) where a spin closes the scalar product; (7.1.5) where T^L and a
first spin form a tensor that a second spin closes. Reduced elements are defined as there and in `tensors`.

The last two spins, if equivalent, may be coupled to a total first, I_a + I_b = I_tot, F' + I_tot = F: patterns (N, ..., F', I_tot, F).

Three equivalent spins. The functions |((I_2 I_3)I_23, I_1) I_tot⟩ are even or odd under the exchange of spins 2 and 3 as 2I - I_23 is. The
cyclic exchange P, 1 → 2 → 3 → 1, has the elements

    ⟨I_23'|P|I_23⟩ = (-1)^I_23 √((2I_23'+1)(2I_23+1)) {I I I_23'; I I_tot I_23}

(6.1.5). ½(P + P⁻¹) is 1 in functions of species A1 (even) and A2 (odd) and -½ in E, of which one function x is even and its partner
y = (P - P⁻¹)x/√3 odd: P turns (x, y) by 120°. A pattern with a total is (N, ..., F', symmetry, I_tot, F), all doubled. symmetry: 0 for A1,
2 for A2, 4 for x, 8 for y, plus 12 for each further function of the same species and total; halved, 0, 1, 2, 4 are the numbers of H. M.
Pickett, J. Mol. Spectrosc. 228, 659 (2004).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.operators.wigner import nine_j, six_j


def patterns(spins: tuple[int, ...], f: int) -> Ints:
    """All coupling patterns of one F, (number, 1 + spins), doubled; N is an integer, and rows rise from the first column on.

    >>> patterns((2,), 2).tolist()  # I = 1, F = 1: N = 0, 1, 2
    [[0, 2], [2, 2], [4, 2]]
    """
    chains: list[tuple[int, ...]] = [(f,)]
    for spin in reversed(spins):
        chains = [(j, *rest) for rest in chains for j in range(abs(rest[0] - spin), rest[0] + spin + 1, 2)]
    whole = sorted(pattern for pattern in chains if pattern[0] % 2 == 0)
    return np.array(whole, dtype=np.int64).reshape(-1, 1 + len(spins))


def patterns_of_total(spins: tuple[int, ...], f: int) -> Ints:
    """All patterns of one F whose last two spins are coupled to a total, (number, 1 + spins), doubled.

    They are ordered by N, then even before odd I_a + I_b - I_tot.

    >>> patterns_of_total((1, 1), 2).tolist()  # I = 1/2 twice, F = 1
    [[0, 2, 2], [2, 2, 2], [2, 0, 2], [4, 2, 2]]
    """
    *others, a, b = spins
    rows = [
        (pattern[0], (a + b - total) // 2 % 2, *pattern[1:-1], total, f)
        for total in range(abs(a - b), a + b + 1, 2)
        for pattern in patterns((*others, total), f).tolist()
    ]
    table = np.array(sorted(rows), dtype=np.int64).reshape(-1, 2 + len(spins))
    return np.delete(table, 1, axis=1)


def recoupling(spins: tuple[int, ...], one_by_one: Ints, total: Ints) -> Floats:
    """⟨((F' I_a)F'' I_b)F|(F' (I_a I_b)I_tot)F⟩ between both kinds of patterns of one F, (one by one, total)."""
    left, right = one_by_one[:, None, :], total[None, :, :]
    alike = (left[..., :-2] == right[..., :-2]).all(axis=-1) & (left[..., -1] == right[..., -1])
    first, between, f = (left[..., column] for column in (-3, -2, -1))
    return np.where(alike, recoupled(first, spins[-2], between, spins[-1], f, right[..., -2]), 0.0)


def recoupled(j1: Ints, j2: int, j12: Ints, j3: int, j: Ints, j23: Ints | int) -> Floats:
    """⟨((j1 j2)j12 j3)j|(j1 (j2 j3)j23)j⟩, all doubled: Edmonds (6.1.5).

    (-1)^(j1+j2+j3+j) √((2j12+1)(2j23+1)) {j1 j2 j12; j3 j j23}
    """
    symbol = six_j(j1 / 2, j2 / 2, j12 / 2, j3 / 2, j / 2, j23 / 2)
    return np.asarray(_sign(j1 + j2 + j3 + j) * np.sqrt((j12 + 1.0) * (j23 + 1.0)) * symbol)


def reduced_spin(spin: int, rank: int) -> float:
    """⟨I‖W^K‖I⟩ of the spin vector (rank 1) or of T²(I, I)/(2I(2I-1)) (rank 2, the form of a quadrupole); `spin` is 2I.

    √(I(I+1)(2I+1)), and √((I+1)(2I+1)(2I+3)/(24 I(2I-1))) with T²_0(I, I) = (3Iz² - I²)/√6.

    >>> round(reduced_spin(1, 1) ** 2, 12), round(reduced_spin(2, 2) ** 2, 12)
    (1.5, 1.25)
    """
    i = spin / 2
    if rank == 1:
        return sqrt(i * (i + 1) * (2 * i + 1))
    if spin < 2:
        raise ValueError(f"a spin of {spin}/2 has no quadrupole moment; that needs a spin of 1 or more")
    return sqrt((i + 1) * (2 * i + 1) * (2 * i + 3) / (24 * i * (2 * i - 1)))


def _passed_on(bra: Ints, ket: Ints, spin: int, rank: int) -> Floats:
    """⟨(j' S)J'‖T^K‖(j S)J⟩ over ⟨j'‖T^K‖j⟩ where T does not act on S: bra and ket are pairs (..., 2) of doubled j, J.

    (-1)^(j'+S+J+K) √((2J'+1)(2J+1)) {j' J' S; J j K}
    """
    a, b, c, d = bra[..., 0], bra[..., 1], ket[..., 0], ket[..., 1]
    symbol = _symbols_once(lambda a, b, c, d: six_j(a / 2, b / 2, spin / 2, d / 2, c / 2, rank), a, b, c, d)
    return _sign(a + spin + d + 2 * rank) * np.sqrt((b + 1.0) * (d + 1.0)) * symbol


def _closed(bra: Ints, ket: Ints, spin: int, rank: int) -> Floats:
    """⟨(j' S)J'|T^K · W^K(S)|(j S)J⟩ over ⟨j'‖T‖j⟩⟨S‖W‖S⟩: (-1)^(j+S+J) {J S j'; K j S}, zero where J' ≠ J."""
    a, b, c, d = bra[..., 0], bra[..., 1], ket[..., 0], ket[..., 1]
    symbol = _symbols_once(lambda a, c, d: six_j(d / 2, spin / 2, a / 2, rank, c / 2, spin / 2), a, c, d)
    return np.where(b == d, _sign(c + spin + d) * symbol, 0.0)


def _symbols_once(symbol: Callable[..., Floats], *arguments: Ints) -> Floats:
    """A symbol of doubled arguments, computed for distinct ones only, since patterns share steps."""
    whole = np.broadcast_arrays(*arguments)
    code, scale = whole[0], 1 + max((int(argument.max(initial=0)) for argument in whole), default=0)
    for argument in whole[1:]:
        code = code * scale + argument
    _, first, place = np.unique(code, return_index=True, return_inverse=True)
    return np.asarray(symbol(*(argument.ravel()[first] for argument in whole))[place].reshape(code.shape))


def _opened(bra: Ints, ket: Ints, spin: int, rank: int) -> Floats:
    """⟨(j' S)J'‖[T^L x S]^1‖(j S)J⟩ over ⟨j'‖T^L‖j⟩⟨S‖S‖S⟩: √(3 (2J'+1)(2J+1)) {j' j L; S S 1; J' J 1}."""
    a, b, c, d = np.broadcast_arrays(bra[..., 0], bra[..., 1], ket[..., 0], ket[..., 1])
    rows = [[a, c, np.full_like(a, 2 * rank)], [spin + 0 * a, spin + 0 * a, 2 + 0 * a], [b, d, 2 + 0 * a]]
    table = np.moveaxis(np.array(rows, dtype=float) / 2, (0, 1), (-2, -1))
    return np.sqrt(3 * (b + 1.0) * (d + 1.0)) * nine_j(table)


def _sign(doubled: Ints) -> Floats:
    """(-1)^n for doubled n."""
    return np.where(doubled // 2 % 2, -1.0, 1.0)


_RECOUPLED = {0: 1.0, 2: -sqrt(5 / 3)}  # of T^L with the vector of a first spin, as the rank L demands


class ChainOperator(NamedTuple):
    """T^K(N), of which T^0 is a plain matrix and not a reduced one, with the spins in the places `spins`.

    A scalar acts on (i,) the vector of one spin (K = 1), (i, i) its quadrupole (K = 2), (i, j) the product of two, coupled to K = 0
    (S_i · S_j) or 2, () none. T² · [S_i x S_j]² is -√(5/3) [T² x S_i]¹ · S_j, by the recoupling of three tensors to a scalar. A moment is
    T^K without a spin, as for the dipole, or the vector of the spin in (i,): S for K = 0, and Σ_q T²_pq S_q for K = 2.
    """

    spins: tuple[int, ...]
    rank: int
    scalar: bool = True

    def connects(self, bra: Ints, ket: Ints) -> NDArray[np.bool_]:
        """Pairs of patterns (bra, ket) that it may connect: rank K changes no angular momentum by more than K, a scalar none at its end."""
        most = np.full(bra.shape[-1], 2 * max(self.rank, 1))
        most[0] = 2 * self.rank
        if self.scalar:
            most[max(self.spins, default=-1) + 1 :] = 0
        near = np.ones((len(bra), len(ket)), dtype=bool)
        for column, largest in enumerate(most.tolist()):
            near &= np.abs(bra[:, None, column] - ket[:, column]) <= largest
        return near

    def coefficients(self, spins: tuple[int, ...], bra: Ints, ket: Ints) -> Floats:
        """c(p', p) of pairs of patterns (..., columns) that broadcast, over ⟨N'‖T^K‖N⟩: the product over the chain of doubled spins.

        That of a moment without a spin is A. R. Edmonds (1957), eq. (7.1.7).
        """
        last, carried, total = max(self.spins, default=-1), self.rank, np.ones(1)
        if self.rank == 0:
            total = np.where(bra[..., 0] == ket[..., 0], np.sqrt(bra[..., 0] + 1.0) if self.spins else 1.0, 0.0)
        for place, spin in enumerate(spins):
            pair = bra[..., place : place + 2], ket[..., place : place + 2]
            if self.scalar and place > last:
                total = total * (pair[0][..., 1] == pair[1][..., 1])
            elif self.scalar and place == last:
                spin_rank = 2 if self.spins == (last, last) else 1
                total = total * _closed(*pair, spin, spin_rank) * reduced_spin(spin, spin_rank)
            elif place in self.spins:
                total = total * _opened(*pair, spin, carried) * (reduced_spin(spin, 1) * _RECOUPLED[self.rank])
                carried = 1
            else:
                total = total * _passed_on(*pair, spin, carried)
        return np.asarray(total)


def powers_of_n_dot_s(spin: int, powers: tuple[int, int], pattern: Ints) -> Floats:
    """(N·S)^r N^2p of the first spin by pattern, with `powers` r and p: N·S = ½[J(J+1) - N(N+1) - S(S+1)]."""
    n, j = pattern[..., 0], pattern[..., 1]
    n_dot_s = (j * (j + 2) - n * (n + 2) - spin * (spin + 2)) / 8
    return np.asarray((n * (n + 2) / 4) ** powers[1] * n_dot_s ** powers[0])


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
        place = {name: column for column, name in enumerate(functions.symmetry.tolist())}
        amplitudes = functions.amplitudes[:, [place[name] for name in right[0, :, -3].tolist()]]
        for pair, amplitude in zip(functions.pair_spins.tolist(), amplitudes, strict=True):
            first = recoupled(g, i, g2, i, f, pair)
            second = recoupled(start, i, g, pair, f, twice_total)
            order = -1.0 if (i + pair - twice_total) // 2 % 2 else 1.0
            out[:, columns] += np.where(alike, order * amplitude * first * second, 0.0)
    return out
