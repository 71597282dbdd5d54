"""Functions of cosθ (θ: angle between a molecular axis and Z) that are not tensors of finite rank, mainly |cosθ|.

In symmetric-top functions |J k M⟩ with k about that axis, f(cosθ) is diagonal in k and M, and Gauss-Legendre quadrature over cosθ
gives its elements exactly. A block of an asymmetric top is first transformed to such functions. If the axis is z of the representation,
no transformation is needed; for x and y

    f(Φ_Zx) = U† f(Φ_Zz) U,  U = exp(-i π/2 J_y);        f(Φ_Zy) = U† f(Φ_Zz) U,  U = exp(-i π/2 J_x)      (f even)

with the components of J along the molecule, [J_i, Φ_Zj] = -i ε_ijk Φ_Zk. For even f every matrix is real in the phases of the blocks.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.axial import cosine_bands
from rotor.quantum.fields.blocks import FieldBlock
from rotor.quantum.fields.solved_space import SolvedSpace
from rotor.quantum.operators.tensors import frame_of, phase_exponent

Complexes = NDArray[np.complex128]
EvenFunction = Callable[[Floats], Floats]

ROUND_OFF = 1e-9  # largest imaginary part of an element, relative to the largest value of f


def absolute_cosine(block: FieldBlock) -> Floats:
    """⟨J' k M| |cosθ| |J k M⟩ over a block (n, n) of a linear or symmetric top, θ of its figure axis; exact but for round-off.

    >>> from rotor.quantum.fields.blocks import Contraction
    >>> from rotor.quantum.fields.solved_space import field_space
    >>> from rotor.tops.top import Top
    >>> z2 = Contraction(np.diag([1.0, 0, 0]), np.diag([0, 0, 1.0]))
    >>> block = field_space(Top.from_constants("B=6000 MHz"), 2, [z2]).blocks(0)[0]
    >>> absolute_cosine(block).round(6).tolist()  # 1/2, √5/8; √5/8, 5/8
    [[0.5, 0.279508], [0.279508, 0.625]]
    """
    return _between_functions(block.j, block.members[0], int(block.m), np.abs)


def _between_functions(j: Ints, k: int, m: int, function: EvenFunction) -> Floats:
    """⟨J' k M|f(cosθ)|J k M⟩ (n, n) for the given J, which must be at least max(|k|, |M|).

    Gauss-Legendre points on each half of -1 < cosθ < 1, where |cosθ| times two functions is a polynomial.
    """
    points, weights = _half_points(int(j[-1]) + 2)
    x = np.concatenate([-points, points])
    functions = _symmetric_top_functions(int(j[-1]), k, m, x)[j - max(abs(k), abs(m))]
    return np.asarray((functions * (function(x) * np.concatenate([weights, weights]))) @ functions.T)


@lru_cache(maxsize=8)
def _half_points(count: int) -> tuple[Floats, Floats]:
    x, w = np.polynomial.legendre.leggauss(count)
    return (x + 1) / 2, w / 2


def _symmetric_top_functions(jmax: int, k: int, m: int, x: Floats) -> Floats:
    """√(J+½) d^J_Mk as functions of x = cosθ, normalised over -1 < x < 1, for J = max(|k|, |M|) ... jmax, (J, points).

    The lowest is N (1+x)^|k+M|/2 (1-x)^|k-M|/2; the others follow from x f_J = Σ ⟨J'|cosθ|J⟩ f_J', upwards, which is stable.
    """
    from scipy.special import gammaln

    first = max(abs(k), abs(m))
    plus, minus = abs(k + m), abs(k - m)
    # ln of the norm: factorials would overflow
    log_norm = gammaln(plus + minus + 2) - gammaln(plus + 1) - gammaln(minus + 1) - (plus + minus + 1) * np.log(2.0)
    with np.errstate(divide="ignore"):
        lowest = np.exp(0.5 * (log_norm + plus * np.log1p(x) + minus * np.log1p(-x)))
    out = np.zeros((jmax - first + 1, len(x)))
    out[0] = lowest
    diagonal, beside = cosine_bands(1, first, jmax, 1, k, m)
    for n in range(jmax - first):  # the three-term recurrence of Wigner functions in J
        before = beside[n - 1] * out[n - 1] if n else 0.0
        out[n + 1] = ((x - diagonal[n]) * out[n] - before) / beside[n]
    return out


def asymmetric_elements(block: FieldBlock, axis: int, function: EvenFunction = np.abs) -> Floats:
    """⟨a|f(cosθ)|b⟩ over a block (n, n) of an asymmetric top, θ between the axis a (0), b (1) or c (2) and Z, f even.

    Raises ValueError unless the block belongs to a field along Z with real phases.
    """
    space = block.space
    if not block.real or not isinstance(space, SolvedSpace):
        raise ValueError(f"M = {block.m}: functions of an axis are made over blocks with real phases")
    by_k: dict[int, list[tuple[int, int, Complexes]]] = {}
    start = 0
    for number, colour in zip(block.members, block.colours, strict=True):
        solved = space.elements.blocks[space.sectors[number].block]
        columns = 1j**colour * _turned(solved.basis, axis, space.elements.representation) @ solved.vectors
        for k, row in zip(range(-solved.basis.j, solved.basis.j + 1), columns, strict=True):
            if np.abs(row).max() > 0:  # K that symmetry excludes stays empty
                by_k.setdefault(k, []).append((solved.basis.j, start, row))
        start += solved.basis.size
    total = np.zeros((start, start), dtype=np.complex128)
    for k, rows in by_k.items():
        j = np.unique([entry[0] for entry in rows])
        amplitudes = np.zeros((len(j), start), dtype=np.complex128)
        for degree, first, row in rows:
            amplitudes[np.searchsorted(j, degree), first : first + len(row)] = row
        total += amplitudes.conj().T @ (_between_functions(j, k, int(block.m), function) @ amplitudes)
    if np.abs(total.imag).max() > ROUND_OFF * max(float(np.abs(total.real).max()), 1.0):
        raise ValueError("a function of an axis must be even in its angle; the elements of this one are complex")
    return np.ascontiguousarray(total.real)


def _turned(basis: Any, axis: int, representation: str) -> Complexes:
    """The Wang functions of a block as combinations of |J k⟩ with k about an axis, (2J+1, functions), k from -J to J."""
    j = basis.j
    functions = np.zeros((2 * j + 1, basis.size), dtype=np.complex128)
    for column, k in enumerate(basis.k.tolist()):
        functions[j + k, column] += 1.0 if k == 0 else np.sqrt(0.5)  # Wang functions are (|K⟩ ± |-K⟩)/√2
        if k:
            functions[j - k, column] += basis.sign * np.sqrt(0.5)
    functions *= 1j ** phase_exponent(basis)
    place = int(np.argmax(np.abs(frame_of(representation)[:, axis])))
    return functions if place == 2 else np.asarray(_quarter_turn(j, place) @ functions)


@lru_cache(maxsize=512)
def _quarter_turn(j: int, place: int) -> Complexes:
    """exp(-i π/2 J_y) (place 0) or exp(-i π/2 J_x) (place 1) in |J k⟩, k = -J to J; J_x - i J_y raises k in the molecular frame."""
    k = np.arange(-j, j)
    raising = np.diag(np.sqrt(j * (j + 1.0) - k * (k + 1.0)), -1).astype(np.complex128)
    component = (raising.T - raising) / 2j if place == 0 else (raising + raising.T) / 2
    values, vectors = np.linalg.eigh(component)
    return np.asarray((vectors * np.exp(-0.5j * np.pi * np.round(values))) @ vectors.conj().T)
