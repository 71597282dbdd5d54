"""Operators of SPFIT's parameter codes: the table of supported codes.

| field | meaning here |
|---|---|
| TYP 0; 1, 2, 3; 3 + n | 1; Na², Nb², Nc²; N₊^2n + N₋^2n |
| TYP 20, 40, 60 | Na, Nb, Nc, between states with the factor i, in an oblate basis -i |
| TYP 21, 41, 61 | NbNc + NcNb, NaNc + NcNa, NaNb + NbNa |
| TYP 20 + n, 40 + n, 60 + n, 11 + n | tensors of rank L made of N alone, see below; of odd L between states with the factor i |
| TYP 80 + n | the energy of K = 10 n + KSQ alone, with N^2NSQ |
| I1 | one N is replaced by that spin: Σ c_ij ½{φ_pi, N_j} S_p; TYP 20, 40, 60: φ_a·S, between states |
| I1 = I2 | two N are: (Ia² - I²/3)/(2I(2I-1)), ... |
| I1 ≠ I2 | I1·I2 with TYP 0, else the traceless tensor I1a I2a - I1·I2/3, ... |
| KSQ, NSQ, NS | half anticommutators with Nz^2KSQ, then N^2NSQ (N·S1)^NS; NS > 4: NS - 5, and N_z S_z in place of the 1 of TYP 0 |

Terms of Fourier and Euler series (FF, EX, TYP 90 to 99) are in `series`.

(H. M. Pickett, documentation of SPFIT and SPCAT, and J. Mol. Spectrosc. 148, 371 (1991); each kind compared with the program's
own levels.) Any other code is refused with its meaning.

The operator of a TYP is a tensor T^L_K made of N. With X, Y, Z = Nc, Nb, Na (prolate) or Na, Nb, Nc (oblate) and {A, B} = AB + BA it is,
by its species,

    K = L:      ½ (E + E†), or (E - E†)/2i,                       E = (X + iY)^K
    K = L - 1:  ¼ √(2L) {Z, E + E†}, or {Z, E - E†}/i in its place;  Z where L = 1;  twice that without an axis

the tensor T^L_K(N) normalised as N^L times the spherical harmonic C^L_K, divided by C^L_L of its stretched component. Operators along X
have X, {Y, Z}, ...; along Y: Y, {X, Z}, ...; along Z: Z, {X, Y}, .... With a spin one N is replaced by it, with two spins two are. With
φ± = φ_x ± iφ_y of the direction cosines that are contracted with the spins,

    K = L        A = N₊^L,  φ₊ N₊^(L-1),  φ₊ φ₊ N₊^(L-2)       of no, one, two spins (φ₊ and N₊ commute)
    K = L - 1    ±[N₋, A]/L in place of {Z, N₊^(L-1)},  Z and φ_z where L = 1

since [N₋, N₊^L] = ±L {Z, N₊^(L-1)}, + where X, Y, Z are right-handed, and the other component of any such tensor follows likewise.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from rotor.arrays import Floats
from rotor.formats.spcat.hamiltonian.code_table import SPIN_ALONG_Z, Digits, Kind, Tensor, square_typ
from rotor.formats.spcat.hamiltonian.codes import NOT_YET, basis_of
from rotor.frozen import dataclass
from rotor.quantum.effects.spin_effect import matrix_of
from rotor.quantum.operators.algebra import UNIT, Operator, half_anticommutator
from rotor.quantum.operators.rotation import (
    body_tensor,
    components,
    direction_cosine,
    ladder,
    sum_of_powers,
    with_powers,
)
from rotor.quantum.operators.tensors import spherical_components
from rotor.quantum.spins.scheme import ByElements, Cosines, CosinesWithN, Matrix, Rotor, Scalar, Vector
from rotor.tops.constants.operators import Operators


@lru_cache(maxsize=256)
def tensor_operator(tensor: Tensor, spins: int, axes: str) -> Operator:
    """The part of a tensor that acts on N, with this number of spins in place of N, and a factor i (-i in an oblate basis) for odd rank."""
    order, rank, z = tensor.rank, min(tensor.rank, spins), axes[2]
    k, cosine, factor, frame = order, True, 1.0 + 0.0j, axes
    if tensor.axis or tensor.odd:
        k, cosine = tensor.shape(z)
        frame = "cba" if z == "a" else "abc"
        # ¼ √(2L) in front of {Z, N₊^(L-1)} with its conjugate, twice that without an axis
        below = np.sqrt(2 * order) * (0.25 if tensor.axis else 0.5)
        factor = (0.5 if k == order else below) * imaginary(axes, tensor.odd)
        if k == 0:
            return imaginary(axes, True) * (
                direction_cosine(z, basis_of(axes)) if rank else components(basis_of(axes))[z]
            )
    up, down = ((_stretched if k == order else _below)(order, rank, frame, sign, axes) for sign in (1, -1))
    return factor * (up + down if cosine else -1j * (up - down))  # i(E - E†) is Hermitian, as E + E† is


def imaginary(axes: str, odd: bool) -> complex:
    """1, or i (-i in an oblate basis) for odd L."""
    if not odd:
        return 1.0
    return 1j if axes[2] == "a" else -1j


def _stretched(order: int, rank: int, frame: str, sign: int, axes: str) -> Operator:
    """A of the head of this module, or the operator with - in place of +."""
    x, y = ("abc".index(axis) for axis in frame[:2])
    n = _circular(frame, sign, order - rank, axes)
    if not rank:
        return n
    if rank == 1:
        along_x, along_y = (direction_cosine(axis, basis_of(axes)) for axis in frame[:2])
        return (along_x + sign * 1j * along_y) @ n
    plane = np.zeros((2, 3, 3))
    plane[0, x, x], plane[0, y, y], plane[1, x, y], plane[1, y, x] = 1.0, -1.0, 1.0, 1.0
    real, imaginary_part = (spherical_components(matrix, 2, basis_of(axes)) for matrix in plane)
    return body_tensor(real + sign * 1j * imaginary_part) @ n


def _below(order: int, rank: int, frame: str, sign: int, axes: str) -> Operator:
    """The component K = L - 1 that belongs to A, or that with - in place of +."""
    if not rank:
        along = components(basis_of(axes))[frame[2]]
        return 2.0 * half_anticommutator(along, _circular(frame, sign, order - 1, axes))
    stretched, opposite = _stretched(order, rank, frame, sign, axes), _circular(frame, -sign, 1, axes)
    right = 1.0 if frame in ("abc", "bca", "cab") else -1.0
    return right * sign / order * (opposite @ stretched - stretched @ opposite)


def _circular(frame: str, sign: int, power: int, axes: str) -> Operator:
    """(N_x ± iN_y)^power: a ladder, times ±i for each factor where x, y are y, x of the basis."""
    if not power:
        return UNIT
    oblate, swapped = axes[2] == "c", frame[0] != axes[0]
    lowers = (sign < 0) if oblate else (sign > 0)  # N_x + iN_y lowers K in a right-handed basis, as that of c is not
    return (sign * 1j if swapped else 1.0) ** power * ladder(-power if lowers != swapped else power)


def as_matrix(c: Floats) -> Matrix:
    """A matrix (3, 3) as nested tuples, which can be hashed."""
    return tuple(map(tuple, c.tolist()))  # type: ignore[return-value]


def operator_of(rotor: Rotor, axes: str) -> Operator:
    """The operator on |N K⟩ of a term with spins."""
    if isinstance(rotor, ByElements):
        return rotor.operator
    if isinstance(rotor, Scalar):
        return sum_of_powers(dict(rotor.operators))
    assert isinstance(rotor, Cosines | CosinesWithN)
    c = np.array(rotor.components, dtype=float)
    if isinstance(rotor, Cosines):
        factor = 1j if rotor.rank == 1 else 1.0
        return factor * body_tensor(spherical_components(c, rotor.rank, basis_of(axes)))
    along, total = components(basis_of(axes)), Operator()
    for i, k in np.argwhere(c).tolist():
        total = total + c[i, k] * half_anticommutator(direction_cosine("abc"[i], basis_of(axes)), along["abc"[k]])
    return total


@dataclass(frozen=True)
class CodedOperator:
    """The operator of a code, without its states.

    plain: powers (p, q, n) of a term without spins. of_n: operator of a term without spins and without such powers. rotor, spins: of a
    spin term, with places of the spins from 1. odd: whether time reversal changes its sign.
    """

    plain: Operators | None = None
    of_n: Operator | None = None
    rotor: Rotor | None = None
    spins: tuple[int, ...] = ()
    odd: bool = False
    n2: int = 0
    nz2: int = 0
    ns: int = 0

    @property
    def alone(self) -> Operator:
        """The operator of a term without spins."""
        return self.of_n or sum_of_powers(self.plain or {})


def code_operator(digits: Digits, axes: str) -> CodedOperator:
    """The operator of a code; axes: the axes x, y, z (bca or bac).

    Raises ValueError, with the meaning of the code, if it is not supported.
    """
    _refuse(digits)
    if digits.projects_spin:  # N_z S_z of the first spin: the product of both projections on z
        digits = digits._replace(i1=1, typ=square_typ(axes[2]), ns=digits.ns - SPIN_ALONG_Z)
    if digits.has_spin:
        return _with_spins(digits, axes)
    if digits.kind is Kind.TENSOR:
        tensor = with_powers(tensor_operator(digits.tensor, 0, axes), digits.nsq, digits.ksq)
        return CodedOperator(of_n=tensor, odd=digits.tensor.odd)
    return CodedOperator(plain=_plain(digits, axes))


def _refuse(d: Digits) -> None:
    """Raise ValueError for codes that are not supported."""
    if d.i1 == 0 and d.i2 > 0:
        other = "the program's is not ½i[N², S], which C_ab-ba names here"
        raise ValueError(f"a commutator of a spin term with N² ({other}) {NOT_YET}")
    if d.projects_spin and (d.kind is not Kind.SCALAR or d.spins):
        raise ValueError(f"N_z S_z together with another operator {NOT_YET}")


def _plain(d: Digits, axes: str) -> Operators:
    """Scalars, ladders and squares by powers (p, q, n): Nx² = ½(N² - Nz²) + ¼(N₊² + N₋²), Ny² with -¼."""
    p, q = d.nsq, d.ksq
    if d.kind is not Kind.SQUARE:
        return {(p, q, d.ladder): 1.0}
    place = axes.index(d.square_axis)
    if place == 2:
        return {(p, q + 1, 0): 1.0}
    # Nx² and Ny² = ½(N² - Nz²) ± ¼(N₊² + N₋²)
    return {(p + 1, q, 0): 0.5, (p, q + 1, 0): -0.5, (p, q, 1): 0.25 if place == 0 else -0.25}


def _with_spins(d: Digits, axes: str) -> CodedOperator:
    """The operator of a code with spins."""
    spins, kind, along = d.spins, d.kind, d.tensor
    powered = CodedOperator(spins=spins, n2=d.nsq, nz2=d.ksq, ns=d.ns)
    twice = len(spins) == 2 and spins[0] == spins[1]
    vector = kind is Kind.TENSOR and along.rank == 1
    if not spins and kind is not Kind.TENSOR:
        plain = _plain(d._replace(nsq=0, ksq=0), axes)
        return replace(powered, rotor=Scalar(tuple(plain.items())))
    if twice and (kind is Kind.SCALAR or vector):
        times_n = " times N" if vector else ""
        raise ValueError(f"the square of one spin, a constant,{times_n} {NOT_YET}")
    if len(spins) == 2 and kind is Kind.SCALAR:
        return replace(powered, rotor=Scalar())
    if vector and len(spins) == 1:
        sign = 1.0 if axes[2] == "a" else -1.0  # as of Na, Nb, Nc between states
        components: Vector = tuple(sign * float(axis == along.axis) for axis in "abc")  # type: ignore[assignment]
        return replace(powered, rotor=Cosines(components), odd=True)
    if spins and along.rank <= 2 and not vector:
        matrix = _matrix(d, axes)
        return replace(powered, rotor=CosinesWithN(matrix) if len(spins) == 1 else Cosines(matrix))
    count = 0 if vector else len(spins)  # of rank 0: I1·I2 times N
    tensor = ByElements(min(along.rank, count), tensor_operator(along, count, axes), along.odd)
    return replace(powered, rotor=tensor, odd=tensor.odd)


def _matrix(d: Digits, axes: str) -> Matrix:
    """c_ij of scalars, squares, N₊² + N₋² and the products of two axes."""
    if d.kind is Kind.SCALAR:
        return matrix_of("iso")
    if d.kind is Kind.SQUARE:
        return matrix_of(d.square_axis * 2)
    if d.kind is Kind.LADDER:  # N₊² + N₋² = 2 (Nx² - Ny²)
        return as_matrix(2.0 * np.array(matrix_of(f"{axes[0] * 2}-{axes[1] * 2}")))
    return matrix_of("abc".replace(d.tensor.axis, ""))
