"""Spin terms above second order and spin terms of series, by their elements over |N k⟩.

The operator of a TYP is a tensor T^L_K made of N (`operators`, X, Y, Z as there). With a spin one N is replaced by it, with two spins
two are. With φ± = φ_x ± iφ_y of the direction cosines that are contracted with the spins,

    K = L        A = N₊^L,  φ₊ N₊^(L-1),  φ₊ φ₊ N₊^(L-2)       of no, one, two spins (φ₊ and N₊ commute)
    K = L - 1    ±[N₋, A]/L in place of {Z, N₊^(L-1)},  Z and φ_z where L = 1

since [N₋, N₊^L] = ±L {Z, N₊^(L-1)}, + where X, Y, Z are right-handed, and the other component of any such tensor follows likewise.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from rotor.arrays import Floats
from rotor.formats.spcat.hamiltonian.code_table import Tensor
from rotor.quantum.effects.interactions import with_powers
from rotor.quantum.effects.spin_effect import ParameterName
from rotor.quantum.spins.operators import ByElements, Cosines, CosinesWithN, Rotor, Scalar
from rotor.quantum.states import OperatorOfJ
from rotor.quantum.symmetric_top_elements import symmetric_top_elements
from rotor.quantum.tensors import Complexes, spherical_components
from rotor.quantum.wang.j_operators import JOperator, anticommutator, components, identity, lowering, raising
from rotor.tops.operators import Operators

FactorOfBoth = Callable[[int, int, Floats, Floats], Floats]  # function of N', N, K', K
OverK = Callable[[int, int, str], Complexes]  # function of N', N and the representation
Where = tuple[int, int, str]  # N', N, representation


@lru_cache(maxsize=256)
def tensor_with_spins(tensor: Tensor, spins: int, axes: str) -> ByElements:
    """A tensor with one or two different spins, or none, with a factor i (-i in an oblate basis) for odd rank."""
    rank = min(tensor.rank, spins)

    def matrix(m: int, n: int, representation: str) -> Complexes:
        if rank:
            return _tensor(tensor, rank, axes, (m, n, representation))
        return tensor_in_n(tensor, axes)(n, representation).matrix if m == n else _nothing(m, n)

    return ByElements(rank, matrix, tensor.odd)


@lru_cache(maxsize=256)
def tensor_in_n(tensor: Tensor, axes: str) -> OperatorOfJ:
    """A tensor of N alone, as an operator of one N; each N is computed once for the parameters of one TYP.

    With X, Y, Z = Nc, Nb, Na (prolate) or Na, Nb, Nc (oblate), E = (X + iY)^K and {A, B} = AB + BA,

        K = L:      ½ (E + E†), or (E - E†)/2i
        K = L - 1:  ¼ √(2L) {Z, E + E†}, or {Z, E - E†}/i in its place;  Z where L = 1;  twice that without an axis

    the tensor T^L_K(N) normalised as N^L times the spherical harmonic C^L_K, divided by C^L_L of its stretched component. The species
    decides between the two forms: operators along X have X, {Y, Z}, ...; along Y: Y, {X, Z}, ...; along Z: Z, {X, Y}, ...
    """
    x, y = ("c", "b") if axes[2] == "a" else ("a", "b")
    k, cosine = tensor.shape(axes[2])
    factor = imaginary(axes, tensor.odd)

    @lru_cache(maxsize=1024)
    def operator(n: int, representation: str) -> JOperator:
        n_abc = components(n, representation)
        along = n_abc[axes[2]]
        if k == 0:
            return factor * along
        raised, lowered = (n_abc[x] + 1j * n_abc[y]) ** k, (n_abc[x] - 1j * n_abc[y]) ** k
        pair = (
            raised + lowered if cosine else -1j * (raised - lowered)
        )  # i(raised - lowered) is Hermitian, as the sum is
        # symmetrized products with Nz where the rank exceeds the ladder
        return factor * (0.5 * pair if k == tensor.rank else tensor.factor_below() * anticommutator(along, pair))

    return operator


def imaginary(axes: str, odd: bool) -> complex:
    """1, or i (-i in an oblate basis) for odd L."""
    if not odd:
        return 1.0
    return 1j if axes[2] == "a" else -1j


def _tensor(tensor: Tensor, rank: int, axes: str, where: Where) -> Complexes:
    """The elements of `tensor_in_n` with as many spins in place of N as the rank after contraction says; φ_z for Z where L = 1."""
    order, k, cosine = tensor.rank, tensor.rank, True
    x, y, z, factor = axes[0], axes[1], axes[2], 1.0 + 0.0j
    if tensor.axis or tensor.odd:
        k, cosine = tensor.shape(z)
        x, y = ("c", "b") if z == "a" else ("a", "b")
        factor = (0.5 if k == order else tensor.factor_below()) * imaginary(axes, tensor.odd)
        if k == 0:
            return imaginary(axes, True) * _vector(z, where)
    right = 1.0 if x + y + z in ("abc", "bca", "cab") else -1.0
    up, down = (_stretched(order, rank, (x, y, z), sign, where) for sign in (1, -1))
    if k < order:
        up = right / order * _commutator((x, y, z), -1, up, where)
        down = -right / order * _commutator((x, y, z), 1, down, where)
    return np.asarray(factor * (up + down if cosine else -1j * (up - down)))


def _stretched(order: int, rank: int, frame: tuple[str, str, str], sign: int, where: Where) -> Complexes:
    """A of the head of this module, or the operator with - in place of +."""
    _, n, representation = where
    return np.asarray(_cosine_ladder(rank, frame, sign, where) @ _n(frame, sign, n, representation, order - rank))


def _cosine_ladder(rank: int, frame: tuple[str, str, str], sign: int, where: Where) -> Complexes:
    """φ± or φ± φ± over |N k⟩."""
    m, n, representation = where
    x, y, _ = frame
    if rank == 1:
        return _vector(x, where) + sign * 1j * _vector(y, where)
    i, k = "abc".index(x), "abc".index(y)
    tensors = np.zeros((2, 3, 3))
    tensors[0, i, i], tensors[0, k, k], tensors[1, i, k], tensors[1, k, i] = 1.0, -1.0, 1.0, 1.0
    real, imaginary = (
        symmetric_top_elements(m, n, spherical_components(tensor, 2, representation)) for tensor in tensors
    )
    return np.asarray(real + sign * 1j * imaginary)


def _vector(axis: str, where: Where) -> Complexes:
    """φ along an axis."""
    m, n, representation = where
    along = [float(axis == letter) for letter in "abc"]
    return symmetric_top_elements(m, n, spherical_components(along, 1, representation))


@lru_cache(maxsize=1024)
def _n(frame: tuple[str, str, str], sign: int, n: int, representation: str, power: int) -> Complexes:
    """(N_x ± iN_y) to a power."""
    n_abc = components(n, representation)
    return ((n_abc[frame[0]] + sign * 1j * n_abc[frame[1]]) ** power).matrix


def _commutator(frame: tuple[str, str, str], sign: int, operator: Complexes, where: Where) -> Complexes:
    """[N∓, operator]."""
    m, n, representation = where
    left, right = (_n(frame, sign, j, representation, 1) for j in (m, n))
    return np.asarray(left @ operator - operator @ right)


def _nothing(m: int, n: int) -> Complexes:
    """No elements between N' and N."""
    return np.zeros((2 * m + 1, 2 * n + 1), dtype=np.complex128)


def multiplied(rotor: Rotor, factor: FactorOfBoth, whole: complex, odd: bool) -> ByElements:
    """An operator times a number, its elements times a function.

    rotor: the operator. factor: function of N', N, K' and K. whole: the number. odd: whether time reversal changes the sign of the
    result.
    Returns: the operator by its elements over |N k⟩.
    """
    base = over_k(rotor)

    def matrix(m: int, n: int, representation: str) -> Complexes:
        above, below = np.arange(-m, m + 1.0)[:, None], np.arange(-n, n + 1.0)[None, :]
        return np.asarray(whole * factor(m, n, above, below) * base(m, n, representation))

    return ByElements(rotor.rank, lru_cache(maxsize=256)(matrix), odd)  # blocks of one N recur for every F


def over_k(rotor: Rotor) -> OverK:
    """The elements of an operator over |N k⟩."""
    if isinstance(rotor, ByElements):
        return rotor.matrix
    if isinstance(rotor, Scalar):
        return lambda m, n, representation: _power_elements(rotor, m, n)
    assert isinstance(rotor, Cosines | CosinesWithN)
    c = np.array(rotor.components, dtype=float)
    if isinstance(rotor, CosinesWithN):
        return lambda m, n, representation: _with_n(c, (m, n, representation))
    if rotor.rank == 2:
        c = (c + c.T) / 2 - np.eye(3) * np.trace(c) / 3
    factor = 1j if rotor.rank == 1 else 1.0
    return lambda m, n, rep: factor * symmetric_top_elements(m, n, spherical_components(c, rotor.rank, rep))


def single_j_operator(operators: Operators) -> OperatorOfJ:
    """Powers (p, q, n) as an operator of one J, for interactions of two states."""

    def operator(j: int, representation: str) -> JOperator:
        total = 0.0 * identity(j)
        for (p, q, n), factor in operators.items():
            ladder = raising(j) ** (2 * n) + lowering(j) ** (2 * n) if n else identity(j)
            total = total + factor * with_powers(ladder, ParameterName("", p, q))
        return total

    return operator


def _power_elements(rotor: Scalar, m: int, n: int) -> Complexes:
    """Elements of powers of N."""
    if m != n:
        return _nothing(m, n)
    return single_j_operator(dict(rotor.operators))(n, "").matrix


def _with_n(c: Floats, where: Where) -> Complexes:
    """Σ c_ij ½{φ_i, N_j}."""
    m, n, representation = where
    total = _nothing(m, n)
    up, low = components(m, representation), components(n, representation)
    for i, letter in enumerate("abc"):
        cosine = _vector(letter, where)
        for k, other in enumerate("abc"):
            if c[i, k]:
                total += c[i, k] / 2 * (cosine @ low[other].matrix + up[other].matrix @ cosine)
    return total
