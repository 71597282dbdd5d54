"""Reduced matrix elements of molecule-fixed tensors: between Wang blocks and solved states.

A tensor T^K_q that is fixed in the molecule has, in space, the components T^K_p = Σ_q D^K*_pq T^K_q, and

    ⟨J'k'M'|T^K_p|J k M⟩ = (-1)^(J'-M') (J' K J; -M' p M) ⟨J'k'‖T^K‖J k⟩
    ⟨J'k'‖T^K‖J k⟩       = Σ_q T^K_q √((2J'+1)(2J+1)) (-1)^(J'-k') (J' K J; -k' q k)

with |J k M⟩ = √((2J+1)/8π²) D^J*_Mk, from the integral over three D functions (R. N. Zare, Angular Momentum, 1988, eq.
3.118). These functions have the phases of `basis` and `watson`: ⟨J,k±1|Jx ∓ iJy|J,k⟩ = √(J(J+1) - k(k±1)). Such ladders
belong to a right-handed frame. A left-handed representation has the same, so that its frame is (x, -y, z) here: in every
representation [Ja, T_b] = -i T_c of a vector, and in left-handed ones [Jx, Jy] = +i Jz (`frame_of`).

Real matrices. A tensor with real Cartesian components has T_-q = (-1)^q T_q*, hence elements M with M(-k',-k) =
(-1)^(J'+J+K+k'-k) M(k',k)*. Over the Wang functions with the phases

    |J K s))  =  i^J i^e |J K s⟩,      e = 0 where s (-1)^K = +1, else 1

every tensor of even rank is real, every one of odd rank i times real: "elements" below are the real matrices, without
that i. Energies and eigenvectors of a semi-rigid top are the same over |J K s)) and |J K s⟩, since a block has one phase.
The other triangle, J' → J, is (-1)^(J'-J+K) times the transpose. Between two blocks either Re T_q or Im T_q acts, and
either even q or odd, by the characters of the blocks under C2y and C2z: of a vector at most one of T_x, T_y, T_z.

Line strengths: Σ_{M' M p} |⟨J'τ'M'|T^K_p|J τ M⟩|² is the square of the reduced element.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats
from rotor.frozen import dataclass
from rotor.quantum.operators.symmetric_top_elements import coupling, sign_of, wang_coupling
from rotor.quantum.wang.basis import WangBlock
from rotor.tops.constants.operators import axis_order as axis_order

Complexes = NDArray[np.complex128]

_J_AT_ONCE = 32  # J of one table of couplings
ROUND_OFF = 1e-9  # of the largest component: how far T_-q may be from (-1)^q T_q*


# Components


def frame_of(representation: str) -> Floats:
    """The rotation (3, 3) from components along a, b, c to those along the right-handed frame of a representation.

    x, y, z of a right-handed representation, x, -y, z of a left-handed one.

    >>> frame_of("Il").tolist()
    [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]]
    """
    rows = np.eye(3)[["abc".index(axis) for axis in axis_order(representation)]]
    if axis_order(representation) not in ("abc", "bca", "cab"):
        rows[1] = -rows[1] + 0.0  # no -0.0
    return rows


def spherical_components(cartesian: ArrayLike, rank: int, representation: str) -> Complexes:
    """T^K_q, q = -K ... K, of a vector (3,) or a matrix (3, 3) along a, b, c, in the frame of a representation.

    Vector: T_0 = v_z, T_±1 = ∓(v_x ± i v_y)/√2. Matrix: T^K_q = Σ ⟨1 m 1 n|K q⟩ T_mn, that is

        T^0_0 = -(xx + yy + zz)/√3,        T^2_0 = (2zz - xx - yy)/√6
        T^1_0 = i(xy - yx)/√2,             T^1_±1 = [(zx - xz) ∓ i(yz - zy)]/2
        T^2_±1 = ∓[(xz + zx) ± i(yz + zy)]/2,    T^2_±2 = [(xx - yy) ± i(xy + yx)]/2.

    Raises ValueError for a rank that such an array does not have.

    >>> spherical_components([1.0, 0, 0], 1, "Ir")[1].item()  # a is z
    (1+0j)
    """
    array, turn = np.asarray(cartesian, dtype=float), frame_of(representation)
    if array.shape == (3,) and rank == 1:
        x, y, z = turn @ array
        return np.array([(x - 1j * y) / np.sqrt(2), z, -(x + 1j * y) / np.sqrt(2)])
    if array.shape == (3, 3) and rank in (0, 1, 2):
        return _components_of_matrix(turn @ array @ turn.T, rank)
    raise ValueError(
        f"rank {rank} of an array {array.shape}: a vector (3,) has rank 1, a matrix (3, 3) ranks 0, 1 and 2"
    )


def cartesian_of(components: ArrayLike, representation: str) -> Floats:
    """The vector (3,) or the symmetric matrix (3, 3) without a trace along a, b, c whose T^K_q these are.

    >>> cartesian_of(spherical_components([1.0, 2.0, 3.0], 1, "Il"), "Il").round(12).tolist()
    [1.0, 2.0, 3.0]
    """
    parts, turn = np.asarray(components, dtype=complex), frame_of(representation)
    if len(parts) == 3:
        vector = np.array([-np.sqrt(2) * parts[2].real, -np.sqrt(2) * parts[2].imag, parts[1].real])
        return np.asarray(turn.T @ vector)
    zero, one, two = parts[2].real / np.sqrt(6), -parts[3], parts[4]
    matrix = np.array([[two.real - zero, two.imag, one.real],
                       [two.imag, -two.real - zero, one.imag],
                       [one.real, one.imag, 2 * zero]])  # fmt: skip
    return np.asarray(turn.T @ matrix @ turn)


def _components_of_matrix(t: Floats, rank: int) -> Complexes:
    if rank == 0:
        return np.array([-np.trace(t) / np.sqrt(3)], dtype=complex)
    if rank == 1:
        (x, y, z) = t[1, 2] - t[2, 1], t[2, 0] - t[0, 2], t[0, 1] - t[1, 0]
        return np.array([(y + 1j * x) / 2, 1j * z / np.sqrt(2), (y - 1j * x) / 2])
    along = (2 * t[2, 2] - t[0, 0] - t[1, 1]) / np.sqrt(6)
    one = (t[0, 2] + t[2, 0] + 1j * (t[1, 2] + t[2, 1])) / 2
    two = (t[0, 0] - t[1, 1] + 1j * (t[0, 1] + t[1, 0])) / 2
    return np.array([two.conjugate(), one.conjugate(), along, -one, two])


@dataclass(frozen=True)
class BodyTensor:
    """A tensor fixed in the molecule whose Cartesian components are real: T^K_q, q = -K ... K, in one representation.

    `components` must be T_-q = (-1)^q T_q*; ValueError where they are not. The antisymmetric part of a matrix is i times
    such a tensor of rank 1, that of the vector (T_bc - T_cb, T_ca - T_ac, T_ab - T_ba)/√2.
    """

    rank: int
    components: tuple[complex, ...]

    def __post_init__(self) -> None:
        parts = np.array(self.components)
        if self.rank < 0 or len(parts) != 2 * self.rank + 1:
            raise ValueError(
                f"rank {self.rank}: 2K + 1 = {2 * self.rank + 1} components belong to it, found {len(parts)}"
            )
        mirrored = np.where(np.arange(-self.rank, self.rank + 1) % 2, -1, 1) * parts[::-1].conj()
        if not np.abs(parts - mirrored).max() <= ROUND_OFF * np.abs(parts).max():
            raise ValueError(
                f"components {self.components}: a tensor with real Cartesian components has T_-q = (-1)^q T_q*"
            )

    def is_real_between(self, up: WangBlock, low: WangBlock) -> bool:
        """Whether Re T_q acts from `low` to `up`: the product of their characters under C2y is (-1)^K. Else Im T_q does."""
        odd = (up.first_k + low.first_k + up.j + low.j + self.rank) % 2
        return up.sign * low.sign == (-1 if odd else 1)

    def connects(self, up: WangBlock, low: WangBlock) -> bool:
        """Whether it acts from `low` to `up`."""
        return abs(up.j - low.j) <= self.rank <= up.j + low.j and bool(self.signed_parts(up, low)[0])

    def signed_parts(self, up: WangBlock, low: WangBlock) -> tuple[list[int], list[float]]:
        """The q that act from `low` to `up`, and the part of each T_q, q = -K ... K, with the sign of the phases of both blocks."""
        key = (up.first_k, up.sign, up.j % 4, low.first_k, low.sign, low.j % 4)
        if key not in self._signed:
            self._signed[key] = self._with_sign(up, low)
        return self._signed[key]

    @cached_property
    def _signed(self) -> dict[tuple[int, ...], tuple[list[int], list[float]]]:
        """Signed parts by first K, sign and J modulo 4 of both blocks, of which a line list has thousands of pairs."""
        return {}

    def _with_sign(self, up: WangBlock, low: WangBlock) -> tuple[list[int], list[float]]:
        real, odd = self.is_real_between(up, low), (up.first_k + low.first_k) % 2
        sign = -1.0 if (phase_exponent(low) - phase_exponent(up) + (not real) - self.rank % 2) % 4 else 1.0
        parts = [sign * (part.real if real else part.imag) for part in self.components]
        steps = range(-self.rank + (self.rank + odd) % 2, self.rank + 1, 2)
        acts = any(parts[self.rank + q] for q in steps)
        return [q for q in steps if acts and (parts[self.rank + q] or self.rank > 1)], parts


def body_tensor(cartesian: ArrayLike, rank: int, representation: str) -> BodyTensor:
    """The part of one rank of a vector (3,) or a matrix (3, 3) along a, b, c, ready to act in a representation.

    Raises ValueError as `spherical_components` does, and for rank 1 of a matrix; give its antisymmetric part as a vector.
    """
    return BodyTensor(rank, tuple(spherical_components(cartesian, rank, representation).tolist()))


# Between Wang blocks


class Band(NamedTuple):
    """Elements along one diagonal: from the basis states `source` of the lower block to `target` of the upper one."""

    source: slice
    target: slice
    elements: Floats


def phase_exponent(block: WangBlock) -> int:
    """The n of i^n, by which a basis function |J K s)) differs from |J K s⟩: J + e modulo 4."""
    return (block.j + (block.sign != sign_of(block.first_k))) % 4


def bands_between(up: WangBlock, low: WangBlock, tensor: BodyTensor) -> list[Band]:
    """The real elements of a tensor from one Wang block to another; those of odd rank stand for i times themselves.

    ((K's'|T|K s)) = n' n [X(K', K) + s X(K', -K)], n = 1/√2 for K = 0 and else 1, X the real or the imaginary part of
    ⟨K'‖T‖K⟩ that acts between the blocks. The second term is the first again where K or K' is 0, and else needs
    K + K' ≤ rank.
    """
    if not tensor.connects(up, low):
        return []
    rank, (steps, parts) = tensor.rank, tensor.signed_parts(up, low)
    out, folded = [], folded_places(up.first_k, low.first_k, rank)
    for step in steps:
        source, target = overlap(up, low, step)
        if source.start >= source.stop:
            continue
        table = _coupling_table(low.j // _J_AT_ONCE, up.j - low.j, rank, step)
        k = slice(low.first_k + 2 * source.start, low.first_k + 2 * source.stop, 2)
        elements = table[low.j % _J_AT_ONCE, k] * parts[rank + step]
        for row, column, k_up, k_low in folded:
            if k_up - k_low == step and row < up.size and column < low.size:
                turned = float(coupling(low.j, up.j, rank, k_up + k_low, -k_low))
                elements[column - source.start] += low.sign * turned * parts[rank + k_up + k_low]
        out.append(Band(source, target, elements))
    return out


def overlap(up: WangBlock, low: WangBlock, step: int) -> tuple[slice, slice]:
    """Which K of `low` land on which K of `up` when K changes by `step`."""
    first = (up.first_k - step - low.first_k) // 2  # place in `low` that lands on place 0 of `up`
    start, stop = max(first, 0), min(low.size, first + up.size)
    return slice(start, stop), slice(start - first, stop - first)


@lru_cache(maxsize=256)  # some 24 MB at J = 1000; a dipole needs 6 tables for every J
def _coupling_table(number: int, rise: int, rank: int, step: int) -> Floats:
    """`wang_coupling` for the J of one table and K = 0, 1, ...: (J, K), shared and read-only."""
    j = np.arange(number * _J_AT_ONCE, (number + 1) * _J_AT_ONCE)
    out = wang_coupling(j[:, None], rise, rank, step, np.arange(j[-1] + 1))
    out.flags.writeable = False  # it is shared
    return out


@lru_cache(maxsize=256)
def folded_places(first_up: int, first_low: int, rank: int) -> tuple[tuple[int, int, int, int], ...]:
    """Row, column, K' and K of the elements that s X(K', -K) is added to, from the first K of both blocks: 1 ≤ K, K' and K + K' ≤ rank."""
    all_k = [(k_up, k) for k_up in range(first_up, rank, 2) for k in range(first_low, rank - k_up + 1, 2) if k_up and k]
    return tuple(((k_up - first_up) // 2, (k - first_low) // 2, k_up, k) for k_up, k in all_k)


def block_elements(up: WangBlock, low: WangBlock, tensor: BodyTensor) -> Floats:
    """The real elements of a tensor between two Wang blocks, (up.size, low.size)."""
    return acting_on(np.eye(low.size), up, low, tensor)


def acting_on(vectors: Floats, up: WangBlock, low: WangBlock, tensor: BodyTensor) -> Floats:
    """A tensor times columns (low.size, n) over the lower block: columns (up.size, n) over the upper one."""
    moved = np.zeros((vectors.shape[1], up.size))
    add_acting_on(moved, vectors, up, low, tensor)
    return moved.T


def add_acting_on(zeros: Floats, vectors: Floats, up: WangBlock, low: WangBlock, tensor: BodyTensor) -> None:
    """Write a tensor times columns (low.size, n), transposed, into an array of zeros (n, up.size)."""
    states = vectors.T
    for number, (source, target, elements) in enumerate(bands_between(up, low, tensor)):
        if number == 0:
            np.multiply(states[:, source], elements, out=zeros[:, target])
        else:
            zeros[:, target] += states[:, source] * elements


# One for each pair of states

Tensors = Mapping[tuple[int, int], BodyTensor]


def tensor_between(tensors: Tensors, up: int, low: int) -> BodyTensor | None:
    """The tensor that acts between two states, None where there is none."""
    return tensors.get((up, low)) or tensors.get((low, up))


def rank_of(tensors: Tensors) -> int:
    """The rank of the tensors; ValueError where they differ."""
    ranks = {tensor.rank for tensor in tensors.values()}
    if len(ranks) != 1:
        raise ValueError(f"tensors of ranks {sorted(ranks)}: one rank at a time")
    return ranks.pop()
