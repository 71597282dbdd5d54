"""Angular momenta coupled one after another, N + S1 = J1, J1 + S2 = J2, ... = F: coupling patterns of an F and coefficients between them.

A coupling pattern is (N, J1, ..., F), stored doubled. A scalar operator T^K(N) · W^K(spins) has the element

    ⟨p'|T·W|p⟩ = c(p', p) ⟨N'‖T^K‖N⟩

whose coefficient c is a product over the steps of the chain, each with one symbol (A. R. Edmonds, Angular Momentum in Quantum
Mechanics, 1957): (7.1.7) where T^K does not act on the spin; (7.1.6) where a spin closes the scalar product; (7.1.5) where T^L and a
first spin form a tensor that a second spin closes. Reduced elements are defined as there and in `tensors`.

The last two spins, if equivalent, may be coupled to a total first, I_a + I_b = I_tot, F' + I_tot = F: patterns (N, ..., F', I_tot, F).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.wigner import nine_j, six_j


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
    rows = []
    for total in range(abs(a - b), a + b + 1, 2):
        for pattern in patterns((*others, total), f).tolist():
            rows.append((pattern[0], (a + b - total) // 2 % 2, *pattern[1:-1], total, pattern[-1]))
    table = np.array(sorted(rows), dtype=np.int64).reshape(-1, 2 + len(spins))
    return np.delete(table, 1, axis=1)


def recoupling(spins: tuple[int, ...], one_by_one: Ints, total: Ints) -> Floats:
    """⟨((F' I_a)F'' I_b)F|(F' (I_a I_b)I_tot)F⟩ between both kinds of patterns of one F, (one by one, total): Edmonds (6.1.5).

    (-1)^(F'+I_a+I_b+F) √((2F''+1)(2I_tot+1)) {F' I_a F''; I_b F I_tot}
    """
    a, b = spins[-2:]
    left, right = one_by_one[:, None, :], total[None, :, :]
    alike = (left[..., :-2] == right[..., :-2]).all(axis=-1) & (left[..., -1] == right[..., -1])
    first, between, pair_total, f = left[..., -3], left[..., -2], right[..., -2], left[..., -1]
    root = np.sqrt((between + 1.0) * (pair_total + 1.0))
    symbol = six_j(first / 2, a / 2, between / 2, b / 2, f / 2, pair_total / 2)
    return np.where(alike, _sign(first + a + b + f) * root * symbol, 0.0)


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
    root = np.sqrt((b + 1.0) * (d + 1.0))
    near = (np.abs(a - c) <= 2 * rank) & (np.abs(b - d) <= 2 * rank)
    symbol = _symbol_of_distinct(
        near, (a, b, c, d), lambda a, b, c, d: six_j(a / 2, b / 2, spin / 2, d / 2, c / 2, rank)
    )
    return _sign(a + spin + d + 2 * rank) * root * symbol


def _closed(bra: Ints, ket: Ints, spin: int, rank: int) -> Floats:
    """⟨(j' S)J'|T^K · W^K(S)|(j S)J⟩ over ⟨j'‖T‖j⟩⟨S‖W‖S⟩: (-1)^(j+S+J) {J S j'; K j S}, zero where J' ≠ J."""
    a, b, c, d = bra[..., 0], bra[..., 1], ket[..., 0], ket[..., 1]
    near = (np.abs(a - c) <= 2 * rank) & (b == d)
    symbol = _symbol_of_distinct(near, (a, c, d), lambda a, c, d: six_j(d / 2, spin / 2, a / 2, rank, c / 2, spin / 2))
    return np.where(b == d, _sign(c + spin + d) * symbol, 0.0)


def _symbol_of_distinct(chosen: NDArray[np.bool_], arguments: Sequence[Ints], symbol: Callable[..., Floats]) -> Floats:
    """A symbol of doubled arguments where `chosen`, 0 elsewhere; computed for distinct arguments only, since patterns share steps."""
    selected = [np.broadcast_to(argument, chosen.shape)[chosen] for argument in arguments]
    code, scale = selected[0], 1 + max((int(argument.max(initial=0)) for argument in selected), default=0)
    for argument in selected[1:]:
        code = code * scale + argument
    _, first, place = np.unique(code, return_index=True, return_inverse=True)
    out = np.zeros(chosen.shape)
    out[chosen] = symbol(*(argument[first] for argument in selected))[place]
    return out


def _opened(bra: Ints, ket: Ints, spin: int, rank: int) -> Floats:
    """⟨(j' S)J'‖[T^L x S]^1‖(j S)J⟩ over ⟨j'‖T^L‖j⟩⟨S‖S‖S⟩: √(3 (2J'+1)(2J+1)) {j' j L; S S 1; J' J 1}."""
    a, b, c, d = np.broadcast_arrays(bra[..., 0], bra[..., 1], ket[..., 0], ket[..., 1])
    rows = [[a, c, np.full_like(a, 2 * rank)], [spin + 0 * a, spin + 0 * a, 2 + 0 * a], [b, d, 2 + 0 * a]]
    table = np.moveaxis(np.array(rows, dtype=float) / 2, (0, 1), (-2, -1))
    return np.sqrt(3 * (b + 1.0) * (d + 1.0)) * nine_j(table)


def _sign(doubled: Ints) -> Floats:
    """(-1)^n for doubled n."""
    return np.where(doubled // 2 % 2, -1.0, 1.0)


_RECOUPLED = {0: 1.0, 2: -sqrt(5 / 3)}


def coefficients(spins: tuple[int, ...], acting: tuple[int, ...], rank: int, bra: Ints, ket: Ints) -> Floats:
    """c(p', p) (..., patterns of bra, patterns of ket) of T^K(N), of which T^0 is a plain matrix, with the spins in the places `acting`.

    acting: (i,) the vector of one spin (K = 1), (i, i) its quadrupole (K = 2), (i, j) the product of two, coupled to K = 0 (S_i · S_j) or
    2, () none. T² · [S_i x S_j]² is -√(5/3) [T² x S_i]¹ · S_j, by the recoupling of three tensors to a scalar.
    """
    left, right = bra[..., :, None, :], ket[..., None, :, :]
    if not acting:
        return np.asarray((left == right).all(axis=-1).astype(float))
    first, last = min(acting), max(acting)
    total = np.sqrt(left[..., 0] + 1.0) if rank == 0 else np.ones(1)
    carried = rank
    for place, spin in enumerate(spins):
        pair = left[..., place : place + 2], right[..., place : place + 2]
        if place > last:
            total = total * (pair[0][..., 1] == pair[1][..., 1])
        elif place == last:
            spin_rank = 2 if acting == (last, last) else 1
            total = total * _closed(*pair, spin, spin_rank) * reduced_spin(spin, spin_rank)
        elif place == first:
            total = total * _opened(*pair, spin, carried) * reduced_spin(spin, 1)
            carried = 1
        else:
            total = total * _passed_on(*pair, spin, carried)
    if first != last:
        total = total * _RECOUPLED[rank]
    return np.asarray(np.where((left[..., 0] == right[..., 0]), total, 0.0) if rank == 0 else total)


def moment_coefficients(spins: tuple[int, ...], rank: int, acting: int | None, bra: Ints, ket: Ints) -> Floats:
    """⟨p'‖V‖p⟩ over ⟨N'‖T^L‖N⟩, (..., bra patterns, ket patterns), of V = T^L, or of a vector V with the spin in the place `acting`.

    The vector is S for L = 0, where T^0 is a plain matrix and not a reduced one, and Σ_q T²_pq S_q for L = 2. Without a spin, as for the
    dipole, it is the product over the chain of A. R. Edmonds (1957), eq. (7.1.7).
    """
    left, right = np.broadcast_arrays(bra[..., :, None, :], ket[..., None, :, :])
    near = within_reach(rank, bra, ket)
    out = np.zeros(near.shape)
    out[near] = moment_products(spins, rank, acting, left[near], right[near])
    return out


def within_reach(rank: int, bra: Ints, ket: Ints) -> NDArray[np.bool_]:
    """Pairs of patterns (..., bra, ket) between which a moment acts: rank K changes no intermediate angular momentum by more than K."""
    near = np.ones((*bra.shape[:-1], ket.shape[-2]), dtype=bool)
    for column in range(bra.shape[-1]):
        near &= np.abs(bra[..., :, None, column] - ket[..., None, :, column]) <= 2 * max(rank, 1)
    return near


def moment_products(spins: tuple[int, ...], rank: int, acting: int | None, left: Ints, right: Ints) -> Floats:
    """The coefficients of pairs of patterns (pairs, columns)."""
    total = np.ones(len(left))
    if acting is not None:
        alike = left[:, 0] == right[:, 0]
        total = total * (np.where(alike, np.sqrt(left[:, 0] + 1.0), 0.0) if rank == 0 else _RECOUPLED[2])
    for place, spin in enumerate(spins):
        pair = left[:, place : place + 2], right[:, place : place + 2]
        if place == acting:
            total = total * _opened(*pair, spin, rank) * reduced_spin(spin, 1)
        else:
            total = total * _passed_on(*pair, spin, rank if acting is None or place < acting else 1)
    return total


_AT_ONCE = 200_000  # elements computed at a time; intermediate arrays then fit the processor's cache
_LARGE = 10_000  # a table with more elements is computed alone


def for_all_f(tables: Mapping[int, tuple[Ints, Ints]], compute: Callable[[Ints, Ints], Floats]) -> dict[int, Floats]:
    """Coefficients `of` (bra, ket) patterns by F; many small tables are computed in one call, pair by pair."""
    out = {f: compute(bra, ket) for f, (bra, ket) in tables.items() if len(bra) * len(ket) > _LARGE}
    batch: list[int] = []
    count = 0
    for f in (f for f in tables if f not in out):
        batch.append(f)
        count += len(tables[f][0]) * len(tables[f][1])
        if count > _AT_ONCE:
            out |= _pair_by_pair({f: tables[f] for f in batch}, compute)
            batch, count = [], 0
    return out | (_pair_by_pair({f: tables[f] for f in batch}, compute) if batch else {})


def _pair_by_pair(
    tables: Mapping[int, tuple[Ints, Ints]], compute: Callable[[Ints, Ints], Floats]
) -> dict[int, Floats]:
    """Coefficients of several tables as one list of pairs of patterns."""
    bra = np.concatenate([left.repeat(len(right), axis=0) for left, right in tables.values()])
    ket = np.concatenate([np.tile(right, (len(left), 1)) for left, right in tables.values()])
    values, start = compute(bra[:, None, :], ket[:, None, :]).ravel(), 0
    out: dict[int, Floats] = {}
    for f, (left, right) in tables.items():
        stop = start + len(left) * len(right)
        out[f] = values[start:stop].reshape(len(left), len(right))
        start = stop
    return out


def n_dot_s(pattern: Ints, spin: int) -> Floats:
    """N·S of the first spin by pattern: ½[J(J+1) - N(N+1) - S(S+1)]."""
    n, j = pattern[..., 0], pattern[..., 1]
    return np.asarray((j * (j + 2) - n * (n + 2) - spin * (spin + 2)) / 8)


def powers_between(spin: int, powers: tuple[int, int], bra: Ints, ket: Ints) -> Floats:
    """½(bra + ket) of (N·S)^r N^2p of the first spin (doubled), with `powers` r and p: (..., n', n)."""
    left, right = (_n_dot_s_power(spin, powers, patterns) for patterns in (bra, ket))
    return np.asarray((left[..., :, None] + right[..., None, :]) / 2)


def _n_dot_s_power(spin: int, powers: tuple[int, int], pattern: Ints) -> Floats:
    """(N·S)^r N^2p of the first spin by pattern."""
    n = pattern[..., 0] / 2.0
    return np.asarray((n * (n + 1)) ** powers[1] * n_dot_s(pattern, spin) ** powers[0])
