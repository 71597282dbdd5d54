"""Observables of a wave packet: cosines as matrices over a block, and as sums of harmonics without fields.

Between pulses an expectation value is a sum of lines,

    ⟨O⟩(t) = Σ_i ρ_ii O_ii + 2 Re Σ_{i<j} ρ_ij* O_ij exp(i (E_i - E_j) (t - t0)/ħ),

with the coherences of all initial states of a gas summed once. Lines of different M belong to the same pairs of levels, so a trace
costs the same for a single state and for a gas. For equidistant times the sum is a product of two small matrices.

cos²θ_2D = cos²θ/(cos²θ + sin²θ sin²φ) is the projection of the axis on a detector plane through Z. It is not a tensor of finite rank;
its mean over φ, which suffices for a gas with symmetry about Z, is |cosθ| (`axis_functions`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.alignment.axis_functions import absolute_cosine, asymmetric_elements
from rotor.arrays import Floats, Ints
from rotor.quantum.fields.axial import AxialSpace
from rotor.quantum.fields.blocks import Contraction, FieldBlock
from rotor.quantum.fields.solved_space import SolvedSpace

if TYPE_CHECKING:
    from rotor.tops.top import Top

Complexes = NDArray[np.complex128]

_SPACE = "XYZ"
_EVEN_WITHIN = 1e-9  # of a step: times that differ less from an even grid are on it
_CHUNK = 1 << 21
FEW_LINES = 64  # below this number a search for repeated pairs costs more than it saves


@dataclass(frozen=True)
class Observable:
    """A cosine: name of its column, contraction (None for |cosθ| of `axis`), and value in an isotropic gas."""

    name: str
    contraction: Contraction | None
    isotropic: float
    axis: int = 0

    def matrix(self, block: FieldBlock) -> Any:
        """The matrix (n, n) over the states of a block."""
        if self.contraction is not None:
            return block.matrix(self.contraction)
        if isinstance(block.space, AxialSpace):
            return absolute_cosine(block)
        if isinstance(block.space, SolvedSpace) and block.space.m_is_good:
            return asymmetric_elements(block, self.axis)
        raise ValueError(f"{self.name} is made for fields with the symmetry of Z; use cos2theta")


def figure_axis(top: Top) -> int:
    """The axis whose angle with Z is θ: a (0), or c (2) for an oblate top; for an asymmetric top that of largest polarizability.

    Without a polarizability, the axis of the largest dipole component.
    """
    if top.kind != "asymmetric":
        return 2 if top.kind == "oblate" else 0
    if top.polarizability_abc_angstrom3 is not None:
        return int(np.argmax(np.diag(np.array(top.polarizability_abc_angstrom3))))
    return int(np.argmax(np.abs(top.dipole_abc_debye or (1.0, 0.0, 0.0))))


def observable(name: str, top: Top) -> Observable:
    """A cosine by name: cos2theta, costheta, cos2theta_2d of the figure axis, or cos2_aX ... cos2_cZ, cos_aX ... cos_cZ.

    Raises ValueError for any other name.

    >>> from rotor.tops.top import Top
    >>> observable("cos2theta", Top.from_constants("B=6000 MHz")).isotropic
    0.3333333333333333
    """
    axis, space = figure_axis(top), 2
    kind = name
    for power in ("cos2_", "cos_"):
        if name.startswith(power) and len(name) == len(power) + 2 and name[-2] in "abc" and name[-1] in _SPACE:
            axis, space, kind = "abc".index(name[-2]), _SPACE.index(name[-1]), power
    along, fixed = np.eye(3)[axis], np.eye(3)[space]
    if kind in ("cos2theta", "cos2_"):
        return Observable(name, Contraction(np.outer(along, along), np.outer(fixed, fixed)), 1 / 3)
    if kind in ("costheta", "cos_"):
        return Observable(name, Contraction(along, fixed), 0.0)
    if kind == "cos2theta_2d":
        return Observable(name, None, 0.5, axis)
    raise ValueError(
        f"observable {name!r}: known are cos2theta, costheta, cos2theta_2d, cos2_aX to cos2_cZ (squares) and cos_aX to cos_cZ"
    )


# Sums of harmonics


@dataclass(frozen=True)
class Harmonics:
    """A signal constant + 2 Re Σ amplitude exp(i ω t), t from the time of the coherences; amplitudes and ω (n,), rad/ps."""

    constant: float
    amplitudes: Complexes
    omegas: Floats

    def at(self, times_ps: Floats) -> Floats:
        """The signal at times (t,)."""
        if not len(self.omegas):
            return np.full(len(times_ps), self.constant)
        return self.constant + 2 * harmonic_sum(self.amplitudes, self.omegas, times_ps)


def harmonic_sum(amplitudes: Complexes, omegas: Floats, times: Floats) -> Floats:
    """Re Σ amplitude exp(i ω t) at times (t,).

    Equidistant times t0 + (p s + q) dt are split into p and q, so that only 2√t exponentials per line are needed.
    """
    count = len(times)
    step = (times[-1] - times[0]) / (count - 1) if count > 8 else 0.0
    # an even grid factors into √n times √n phases
    if step == 0 or np.abs(times - times[0] - step * np.arange(count)).max() > _EVEN_WITHIN * abs(step):
        return _plain_sum(amplitudes, omegas, times)
    side = int(np.ceil(np.sqrt(count)))  # two short tables of phases in place of one long one
    total = np.zeros((-(-count // side), side))
    chunk = max(1, _CHUNK // (2 * side))
    for first in range(0, len(omegas), chunk):
        w = omegas[first : first + chunk]
        coarse = np.exp(1j * np.multiply.outer(times[0] + side * step * np.arange(len(total)), w))
        fine = np.exp(1j * np.multiply.outer(w, step * np.arange(side)))
        total += ((coarse * amplitudes[first : first + chunk]) @ fine).real
    return np.asarray(total.ravel()[:count])


def _plain_sum(amplitudes: Complexes, omegas: Floats, times: Floats) -> Floats:
    out = np.zeros(len(times))
    chunk = max(1, _CHUNK // max(len(omegas), 1))
    for first in range(0, len(times), chunk):
        t = times[first : first + chunk]
        out[first : first + chunk] = (np.exp(1j * np.multiply.outer(t, omegas)) @ amplitudes).real
    return out


@dataclass(frozen=True)
class Coherences:
    """The lines of one observable in one block: rows (n,) of both levels, amplitudes (n,) and the constant part."""

    first: Ints
    second: Ints
    amplitudes: Complexes
    constant: float

    def less(self, other: Coherences) -> Coherences:
        """The difference from another state of the same block."""
        return Coherences(self.first, self.second, self.amplitudes - other.amplitudes, self.constant - other.constant)


class Pattern(NamedTuple):
    """Nonzero elements above the diagonal of a matrix: their places and rows of the levels (n,), values, and the diagonal."""

    i: Ints
    j: Ints
    first: Ints
    second: Ints
    elements: NDArray[Any]
    diagonal: Floats


def pattern(matrix: Any, rows: Ints) -> Pattern:
    """Nonzero elements of a dense or sparse matrix over states of the levels `rows`."""
    if isinstance(matrix, np.ndarray):
        i, j = np.nonzero(matrix)
        above = i < j
        i, j = i[above], j[above]
        return Pattern(i, j, rows[i], rows[j], matrix[i, j], np.diag(matrix).real)
    entries = matrix.tocoo()
    (i, j), values = entries.coords, entries.data
    above = i < j
    i, j = i[above].astype(np.int64), j[above].astype(np.int64)
    return Pattern(i, j, rows[i], rows[j], values[above], np.asarray(matrix.diagonal()))


def coherences(states: Complexes, weights: Floats, patterns: Sequence[Pattern]) -> tuple[Coherences, ...]:
    """Coherences for each observable of weighted states: columns (n, m) over the free states, weights (m,)."""
    weighted = states.conj() * weights
    few = len(states) * 8 > sum(len(pattern.i) for pattern in patterns)
    density = None if few else weighted @ states.T  # Σ w c_i* c_j
    population = (weighted * states).real.sum(axis=1)
    out = []
    for pattern in patterns:
        pairs = (
            density[pattern.i, pattern.j]
            if density is not None
            else (weighted[pattern.i] * states[pattern.j]).sum(axis=1)
        )
        out.append(
            Coherences(pattern.first, pattern.second, pairs * pattern.elements, float(population @ pattern.diagonal))
        )
    return tuple(out)


def harmonics(pieces: Sequence[Coherences], energies: Floats, remainder: float) -> Harmonics:
    """Sum over all blocks, with lines between the same levels added; energies (levels,) in rad/ps; remainder: of omitted states."""
    constant = remainder + sum(piece.constant for piece in pieces)
    if not pieces:
        return Harmonics(constant, np.zeros(0, dtype=np.complex128), np.zeros(0))
    size = len(energies)
    key = np.concatenate([piece.first * size + piece.second for piece in pieces])
    amplitude = np.concatenate([piece.amplitudes for piece in pieces])
    pairs, total = key, amplitude
    if len(key) > FEW_LINES:
        pairs, place = np.unique(key, return_inverse=True)
        total = np.bincount(place, amplitude.real, len(pairs)) + 1j * np.bincount(place, amplitude.imag, len(pairs))
    return Harmonics(constant, total, energies[pairs // size] - energies[pairs % size])


def expectation(states: Complexes, weights: Floats, matrix: Any) -> Floats:
    """Σ_m w_m ⟨m|O|m⟩ of snapshots (s, n, m), (s,); matrix dense or sparse."""
    if isinstance(matrix, np.ndarray):
        moved = matrix @ states
    else:
        moved = np.array([matrix @ snapshot for snapshot in states])
    return np.asarray((states.conj() * moved).real.sum(axis=1) @ weights)
