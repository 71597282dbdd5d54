"""The direct product |N k m⟩ |m1⟩ |m2⟩ ... at one M = m + m1 + m2 + ..., and what TYP of SPFIT's codes stands for in it: slow, independent.

No coupled basis and no reduced elements: an operator is a product of matrices of N_i (molecule-fixed), of direction cosines φ_Fi and of
spins S_F (F = x, y, z in space). Functions of one F are eigenvectors of F², found numerically.
"""

from __future__ import annotations

from functools import cache, reduce
from itertools import permutations, product
from math import pi, sqrt

import numpy as np
import qutip
from direct_product import rotor_matrix, space_cosines, states_up_to
from full_matrix import AXIS_KINDS, CROSS_KINDS, ladder_axes
from full_matrix_rotor import momenta
from scipy.linalg import expm

Letter = tuple[tuple[str, complex], ...]  # Σ c N_axis


@cache
def space_momenta(top: int) -> dict[str, np.ndarray]:
    """N_x, N_y, N_z in space on all |N k m⟩ with N ≤ top."""
    n, k, m = np.array(states_up_to(top)).T
    raised = (n[:, None] == n) & (k[:, None] == k) & (m[:, None] == m + 1)
    up = np.where(raised, np.sqrt(np.maximum(n * (n + 1) - m * (m + 1), 0.0)), 0.0)
    return {"x": (up + up.T) / 2, "y": (up - up.T) / 2j, "z": np.diag(m).astype(float)}


@cache
def spin_matrices(twice: int) -> dict[str, np.ndarray]:
    """S_x, S_y, S_z of one spin, m falling from S to -S."""
    return {f: qutip.jmat(twice / 2, f).full() for f in "xyz"}


def letters_of(typ: int, z: str) -> list[tuple[float, tuple[Letter, ...]]]:
    """TYP as a sum of products of components of N, each to be taken as the mean over all orders of its factors."""
    x, y = ladder_axes(z)
    if typ <= 3:
        return [(1.0, ((("abc"[typ - 1], 1.0),),) * 2)]
    if typ <= 11:
        return [(1.0, (((x, 1.0), (y, sign * 1j)),) * (2 * typ - 6)) for sign in (1, -1)]
    if typ in AXIS_KINDS:
        return [(1.0, (((AXIS_KINDS[typ], 1.0),),))]
    first, second = CROSS_KINDS[typ]
    return [(2.0, (((first, 1.0),), ((second, 1.0),)))]


@cache
def replaced(top: int, z: str, typ: int, space: tuple[str, ...]) -> np.ndarray:
    """TYP on N ≤ top with φ_F in place of as many N as `space` has, the mean over all orders and places."""
    states = states_up_to(top + len(space))
    inner = [i for i, (n, _, _) in enumerate(states) if n <= top]
    if typ == 0:
        return np.eye(len(inner))
    terms, total, count = letters_of(typ, z), 0.0, 0
    for coefficient, letters in terms:
        places = (*space, *[""] * (len(letters) - len(space)))
        orders = set(permutations(letters))
        for order, where in product(orders, set(permutations(places))):
            factors = [_factor(top + len(space), z, *pair) for pair in zip(order, where, strict=True)]
            total, count = total + coefficient * reduce(np.matmul, factors), count + 1
    return total[np.ix_(inner, inner)] * len(terms) / count


@cache
def _factor(top: int, z: str, letter: Letter, place: str) -> np.ndarray:
    """Σ c N_axis, or Σ c φ_F,axis."""
    return sum(c * (space_cosines(top, z)[place, axis] if place else rotor_matrix(axis, top, z)) for axis, c in letter)


class Product:
    """Functions |N k m⟩ |m1⟩ ... with N ≤ top and the given doubled M, and operators between them."""

    def __init__(self, spins2: tuple[int, ...], z: str, top: int, m2: int) -> None:
        self.spins2, self.z, self.top = spins2, z, top
        states = np.array(states_up_to(top))
        of_spins = np.array([sum(ms) for ms in product(*(range(s, -s - 1, -2) for s in spins2))])
        self.rotor, self.spin = np.argwhere(2 * states[:, 2, None] + of_spins == m2).T
        self.n, self.k, self.m = states[self.rotor].T
        self.unit = np.eye(len(states))

    def on_spins(self, acting: dict[int, np.ndarray]) -> np.ndarray:
        """A product of matrices of single spins, by number from 1, over the functions of all spins."""
        factors = [acting.get(i, np.eye(s + 1)) for i, s in enumerate(self.spins2, 1)]
        return reduce(np.kron, factors, np.eye(1))

    def both(self, rotor: np.ndarray, spin: np.ndarray) -> np.ndarray:
        """A product of an operator of the rotor and one of all spins."""
        return rotor[np.ix_(self.rotor, self.rotor)] * spin[np.ix_(self.spin, self.spin)]

    def vector(self, spin: int, f: str) -> np.ndarray:
        """S_F of one spin over the functions of all spins."""
        return self.on_spins({spin: spin_matrices(self.spins2[spin - 1])[f]})

    def dot(self, spin: int, other: int = 0) -> np.ndarray:
        """N·S of a spin, or S·S' of two."""
        if other:
            return sum(self.both(self.unit, self.vector(spin, f) @ self.vector(other, f)) for f in "xyz")
        return sum(self.both(space_momenta(self.top)[f], self.vector(spin, f)) for f in "xyz")

    def term(self, typ: int, spins: tuple[int, ...]) -> np.ndarray:
        """TYP with spins in place of N; one spin twice as (Ia² - I²/3)/(2I(2I-1)), two as the traceless tensor, I·I' with TYP 0."""
        if len(spins) < 2:
            if spins and not typ:
                return self.dot(*spins)
            if not spins:
                return self.both(replaced(self.top, self.z, typ, ()), self.on_spins({}))
            return sum(self.both(replaced(self.top, self.z, typ, (f,)), self.vector(*spins, f)) for f in "xyz")
        if typ == 0 or typ in AXIS_KINDS:
            return self.term(typ, ()) @ self.dot(*spins)
        first, second = spins
        total = -self.dot(*spins) / 3 if typ <= 3 else 0.0
        for f, g in product("xyz", repeat=2):
            total = total + self.both(
                replaced(self.top, self.z, typ, (f, g)), self.vector(first, f) @ self.vector(second, g)
            )
        size = self.spins2[first - 1] / 2
        return total / (2 * size * (2 * size - 1)) if first == second else total

    def square(self, spins: list[int], rotor: bool) -> np.ndarray:
        """(N + Σ S)², without N where rotor is False."""
        total = sum(self.dot(s, s) for s in spins)
        if rotor:
            total = total + np.diag(self.n * (self.n + 1.0)) + 2 * sum(self.dot(s) for s in spins)
        return total + 2 * sum(self.dot(s, t) for i, s in enumerate(spins) for t in spins[i + 1 :])

    def coupled(self, f2: int, total_of_last: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """Functions of one F as columns, and 2N, 2J, ..., 2F of each; total_of_last: how many last spins are added up first."""
        count = len(self.spins2)
        chains = [(list(range(1, spin + 1)), True) for spin in range(1, count - total_of_last + 1)]
        if total_of_last:
            chains += [(list(range(count - total_of_last + 1, count + 1)), False), (list(range(1, count + 1)), True)]
        squares = [self.square(*chain) for chain in chains]
        columns, labels = [np.zeros((len(self.n), 0))], []
        for n in range(self.top + 1):
            places = [np.flatnonzero((self.n == n) & (self.k == k)) for k in range(-n, n + 1)]
            inner = [square[np.ix_(places[0], places[0])] for square in squares]  # the same for each k
            weighted = (sqrt(weight) * square for weight, square in zip((2, 3, 5, 7), inner, strict=False))
            vectors = np.linalg.eigh(sum(weighted, np.eye(len(places[0]))))[1]
            sums = [np.rint(np.sqrt(1 + 4 * _expectation(vectors, square)) - 1).astype(int) for square in inner]
            sums = np.array([np.full(len(places[0]), 2 * n), *sums])
            chosen = sums[-1] == f2
            for at in places:
                columns.append(np.zeros((len(self.n), chosen.sum()), complex))
                columns[-1][at] = vectors[:, chosen]
                labels.append(sums[:, chosen].T)
        return np.concatenate(columns, axis=1), np.concatenate(labels)

    def exchange(self, axis: str) -> np.ndarray:
        """Half a turn of the molecule about an axis with the exchange of the last two spins."""
        size = self.spins2[-1] + 1
        rest, last = np.divmod(self.spin, size)
        rest, before = np.divmod(rest, size)
        swapped = (rest * size + last) * size + before
        turned = np.zeros((len(self.n),) * 2, complex)
        for n in range(self.top + 1):
            at = np.flatnonzero(self.n == n)
            turn = expm(1j * pi * momenta(n, self.z)[axis])
            same = (self.m[at][:, None] == self.m[at]) & (self.spin[at][:, None] == swapped[at])
            turned[np.ix_(at, at)] = turn[np.ix_(self.k[at] + n, self.k[at] + n)] * same
        return turned


@cache
def product_at(spins2: tuple[int, ...], z: str, top: int, m2: int) -> Product:
    """The product, kept for the next file."""
    return Product(spins2, z, top, m2)


@cache
def coded_matrix(basis: Product, typ: int, spins: tuple[int, ...]) -> np.ndarray:
    """`Product.term`, kept for the next file."""
    return basis.term(typ, spins)


@cache
def coupled_functions(basis: Product, f2: int, total_of_last: int) -> tuple[np.ndarray, np.ndarray]:
    """`Product.coupled`, kept for the next file."""
    return basis.coupled(f2, total_of_last)


def _expectation(vectors: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    return np.einsum("ij,ik,kj->j", vectors.conj(), matrix, vectors).real
