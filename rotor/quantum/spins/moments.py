"""Lines of levels with spins by any moments (`rotor.quantum.moments`): their elements between blocks of F.

An electric moment does not act on spins. The magnetic moment of a spin S contains T^0 or T² of the rotation in place of a vector; with L
the rank,

    ⟨p'‖[T^L x S]^1‖p⟩ = m(p', p) ⟨N'‖T^L‖N⟩,     Σ_q T²_pq S_q = -√(5/3) [T² x S]^1_p

(A. R. Edmonds, Angular Momentum in Quantum Mechanics, 1957, eq. 7.1.5; the factor as in `coupling`).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import sqrt

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.moments import Moment
from rotor.quantum.spins.blocks import Shared
from rotor.quantum.spins.many_f import Tables
from rotor.quantum.spins.many_f_lines import Acting, Moments
from rotor.quantum.spins.operators import AxialState, CosinesWithN, tensor_elements, tensor_of
from rotor.quantum.spins.written_moments import written_elements
from rotor.quantum.wang.basis import Part, WangBlock, character

_REACH = 2  # largest difference of N and of K that a moment connects


def spin_moments(shared: Shared, moments: Sequence[Moment]) -> Moments:
    """Moments between levels with spins; electric and magnetic, real and imaginary ones do not interfere."""
    kinds: dict[tuple[bool, bool], list[Acting]] = {}
    for moment in moments:
        plain = moment.tensor is None and moment.along_abc is None
        rank, spin = (0 if plain else 2, shared.scheme.place(moment.spin)) if moment.spin else (1, None)
        acting = Acting(_tables(moment, shared), rank, spin)
        kinds.setdefault((moment.electric, moment.imaginary), []).append(acting)
    return Moments(1, list(kinds.values()))


def _tables(moment: Moment, shared: Shared) -> Tables:
    """Elements of a moment between all rotational blocks, by row."""
    frame, out = shared.cache["frame"], dict[tuple[int, int, int], Floats]()
    numbered = [item for stack in shared.stacks for item in zip(stack.numbers.tolist(), stack.blocks, strict=True)]
    at_row: dict[int, list[tuple[int, SolvedBlock]]] = {}
    for number, block in numbered:
        at_row.setdefault(int(frame.rows[number]), []).append((number, block))
    rises_of_k = range(-_REACH, _REACH + 1) if shared.axial else range(1)
    for (number, low), rise, rise_of_k in product(numbered, range(-_REACH, _REACH + 1), rises_of_k):
        row, step = int(frame.rows[number]), rise + frame.count * rise_of_k
        for other, up in at_row.get(row + step, ()):
            element = _block_element(moment, up, low, shared.representation)
            if element is not None:
                key = frame.kinds[other], frame.kinds[number], step
                count, states = frame.energies_mhz[key[1]].shape
                table = out.setdefault(key, np.zeros((count, frame.energies_mhz[key[0]].shape[1], states)))
                table[row, : element.shape[0], : element.shape[1]] = element
    return out


def _block_element(moment: Moment, up: SolvedBlock, low: SolvedBlock, representation: str) -> Floats | None:
    """The element of a moment between the eigenstates of two rotational blocks, summed over both signs of K; None where it is zero."""

    def between(left: Part, right: Part) -> Floats | None:
        if (left.v, right.v) not in (moment.states, moment.states[::-1]):
            return None
        element = _between_parts(moment, left, right, representation)
        return None if element is None else moment.value_debye * _order(moment, left, right) * element

    total = up.elements(low, between)
    first, second = up.parts[0].basis, low.parts[0].basis
    if total is not None and isinstance(first, AxialState) and (first.axial_k or second.k[0]):
        return np.asarray(sqrt(2.0) * total)
    return total


def _between_parts(moment: Moment, left: Part, right: Part, representation: str) -> Floats | None:
    """The element of a moment between the functions of two parts; None where it is zero."""
    up, low = left.basis, right.basis
    if moment.written is not None:
        back = left.v != right.v and (left.v, right.v) != moment.states
        return written_elements(moment.written, up, low, back)
    if moment.along_abc is not None and moment.spin:
        element = tensor_elements(up, low, tensor_of(moment.along_abc, 1, representation))
        return None if element is None else element * _stretch(up.j, low.j)
    if moment.along_abc is not None:
        element = tensor_elements(up, low, tensor_of(moment.along_abc, 1, representation))
        if element is None:
            return None
        turned = character(up, moment.turned) if moment.turned and isinstance(up, WangBlock) else 1
        return element * (turned * _factor(moment.powers, left, right) * _cosine(moment, left, right))
    if moment.tensor is not None and not moment.spin:
        return CosinesWithN(moment.tensor).elements(up, low, representation)
    if moment.tensor is not None:
        element = tensor_elements(up, low, tensor_of(moment.tensor, 2, representation))
        back = moment.with_i and left.v != right.v and (left.v, right.v) != moment.states
        return -element if element is not None and back else element
    if up != low:
        return None
    n = low.j
    return np.asarray((1.0 if moment.spin else sqrt(n * (n + 1.0) * (2 * n + 1))) * np.eye(low.size))


def moments_of(
    levels: Levels, dipoles: dict[tuple[int, int], tuple[float, float, float]], moments: Sequence[Moment]
) -> Moments:
    """Dipoles by pairs of states and other moments, for levels with spins; ValueError for levels without."""
    if not levels.blocks or levels.blocks[0].spins is None:
        raise ValueError("moments besides plain dipoles need levels that were solved with spins")
    return spin_moments(levels.blocks[0].spins.shared, with_dipoles(dipoles, moments))


def with_dipoles(
    dipoles: dict[tuple[int, int], tuple[float, float, float]], moments: Sequence[Moment]
) -> tuple[Moment, ...]:
    """All moments: plain dipoles by pairs of states, then the others."""
    plain = [Moment(1.0, states, along) for states, along in dipoles.items() if any(along)]
    return (*plain, *(moment for moment in moments if moment.value_debye))


def _stretch(up: int, low: int) -> float:
    """Factor of the elements of φ in those of {φ, N} of rank 2; zero between N = 0 and 1."""
    return sqrt(max(0.375 * ((up + low + 1) ** 2 - 4) * (1 - (up - low) ** 2 / 4), 0.0))


def _factor(powers: str, left: Part, right: Part) -> Floats:
    """Factor of an element from powers of N² and Nz². A commutator changes sign with the order of states; the lower F is the bra."""
    m, n = left.basis.j * (left.basis.j + 1.0), right.basis.j * (right.basis.j + 1.0)
    if powers == "K":
        k, other = left.basis.k.astype(float) ** 2, right.basis.k.astype(float) ** 2
        return np.asarray((k[:, None] + other) / 2)
    return np.array(
        {"": 1.0, "J": (m + n) / 2, "JJ": (m**2 + n**2) / 2, "[J]": (n - m) / 2, "[[J]]": (m - n) ** 2 / 4}[powers]
    )


def _order(moment: Moment, left: Part, right: Part) -> int:
    """Sign of a moment that depends on the order of its states; with a half turn there is a further i · i = -1."""
    if not moment.by_order or left.v == right.v:
        return 1
    return -1 if (left.v < right.v) == bool(moment.turned) else 1


def _cosine(moment: Moment, left: Part, right: Part) -> Floats:
    """cos(α'K' + αK). It holds for functions of |K| too: with ΔK = 0 or 1 either both K have one sign or one of them is 0."""
    if moment.cosine is None:
        return np.ones(1)
    angle = dict(zip(moment.states, moment.cosine, strict=True))
    above, below = angle[left.v] * left.basis.k, angle[right.v] * right.basis.k
    return np.asarray(np.cos(above[:, None] + below))
