"""Lines of levels with spins by any moments (`rotor.quantum.moments`): their elements between blocks of F.

An electric moment does not act on spins. The magnetic moment of a spin S contains T^0 or T² of the rotation in place of a vector; with L
the rank,

    ⟨p'‖[T^L x S]^1‖p⟩ = m(p', p) ⟨N'‖T^L‖N⟩,     Σ_q T²_pq S_q = -√(5/3) [T² x S]^1_p

(A. R. Edmonds, Angular Momentum in Quantum Mechanics, 1957, eq. 7.1.5; the factor as in `coupling`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import sqrt
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.moments import Moment
from rotor.quantum.spins.blocks import SpinBlock
from rotor.quantum.spins.lines import Acting, between_states
from rotor.quantum.spins.operators import AxialState, CosinesWithN, tensor_elements
from rotor.quantum.spins.parts import SpinPart
from rotor.quantum.spins.pattern_tables import tensor_coefficients
from rotor.quantum.spins.scheme import Scheme
from rotor.quantum.spins.written_moments import written_elements
from rotor.quantum.tensors import BodyTensor, body_tensor
from rotor.quantum.wang.basis import Part, WangBlock, character


@dataclass(frozen=True)
class SpinMoments:
    """The moments of a calculation with the coupling scheme and representation of its levels."""

    moments: tuple[Moment, ...]
    scheme: Scheme
    representation: str
    _cache: dict[Any, Any] = field(default_factory=dict, repr=False, compare=False)

    def amplitudes(self, up: SpinBlock, low: SpinBlock) -> Floats:
        """Square roots of line strengths between all states of two blocks, (n_up, n_low)."""
        kinds = dict.fromkeys((moment.electric, moment.imaginary) for moment in self.moments)
        sums = [self._sum(up, low, kind) for kind in kinds]
        return np.asarray(sums[0] if len(sums) == 1 else np.sqrt(sum(each * each for each in sums)))

    def connected(self, up: SpinBlock, low: SpinBlock) -> bool:
        """Whether one of the moments has an element between two blocks."""
        if not abs(up.twice_f - low.twice_f) <= 2 <= up.twice_f + low.twice_f:
            return False
        return any(self._acting(place, up, low) for place in range(len(self.moments)))

    def _sum(self, up: SpinBlock, low: SpinBlock, kind: tuple[bool, bool]) -> Floats:
        """Sum over moments that interfere with each other: electric or magnetic, real or imaginary."""
        places = (k for k, moment in enumerate(self.moments) if (moment.electric, moment.imaginary) == kind)
        return between_states(up, low, [(self._coefficients(k, up, low), self._acting(k, up, low)) for k in places])

    def _acting(self, place: int, up: SpinBlock, low: SpinBlock) -> Acting:
        """Pairs of parts between which a moment acts, with its rotational element."""
        elements = ((left, right, self._element(place, left, right)) for left in up.parts for right in low.parts)
        return [(left, right, element) for left, right, element in elements if element is not None]

    def _coefficients(self, place: int, up: SpinBlock, low: SpinBlock) -> Floats:
        """m(p', p) of a moment between all patterns of two F."""
        moment = self.moments[place]
        plain = moment.tensor is None and moment.along_abc is None
        rank, acting = (0 if plain else 2, self.scheme.place(moment.spin)) if moment.spin else (1, None)
        key = (rank, acting, up.twice_f, low.twice_f)
        if key not in self._cache:
            self._cache[key] = tensor_coefficients(self.scheme, rank, up.patterns, low.patterns, acting)
        coefficients: Floats = self._cache[key]
        return coefficients

    def _element(self, place: int, target: SpinPart, source: SpinPart) -> Floats | None:
        """The rotational element of a moment, summed over both signs of K of axial states."""
        key = (place, target.number, source.number)
        if key not in self._cache:
            self._cache[key] = self._block_element(self.moments[place], target.rotor, source.rotor)
        element: Floats | None = self._cache[key]
        return element

    def _block_element(self, moment: Moment, up: SolvedBlock, low: SolvedBlock) -> Floats | None:
        """The element of a moment between the eigenstates of two rotational blocks; None where it is zero."""

        def between(left: Part, right: Part) -> Floats | None:
            if (left.v, right.v) not in (moment.states, moment.states[::-1]):
                return None
            element = self._between(moment, left, right)
            return None if element is None else moment.value_debye * _order(moment, left, right) * element

        total = up.elements(low, between)
        first, second = up.parts[0].basis, low.parts[0].basis
        if total is not None and isinstance(first, AxialState) and (first.axial_k or second.k[0]):
            return np.asarray(sqrt(2.0) * total)
        return total

    def _between(self, moment: Moment, left: Part, right: Part) -> Floats | None:
        """The element of a moment between the functions of two parts; None where it is zero."""
        up, low = left.basis, right.basis
        if moment.written is not None:
            back = left.v != right.v and (left.v, right.v) != moment.states
            element = written_elements(moment.written, up, low, self.representation, back)
            return element * _factor(moment.powers, left, right) if element is not None and moment.powers else element
        if moment.along_abc is not None and moment.spin:
            element = tensor_elements(up, low, self._tensor(moment.along_abc, 1))
            return None if element is None else element * _stretch(up.j, low.j)
        if moment.along_abc is not None:
            element = tensor_elements(up, low, self._tensor(moment.along_abc, 1))
            if element is None:
                return None
            turned = character(up, moment.turned) if moment.turned and isinstance(up, WangBlock) else 1
            return element * (turned * _factor(moment.powers, left, right) * _cosine(moment, left, right))
        if moment.tensor is not None and not moment.spin:
            return CosinesWithN(moment.tensor).elements(up, low, self.representation)
        if moment.tensor is not None:
            element = tensor_elements(up, low, self._tensor(moment.tensor, 2))
            back = moment.with_i and left.v != right.v and (left.v, right.v) != moment.states
            return -element if element is not None and back else element
        if up != low:
            return None
        n = low.j
        diagonal = np.full(low.size, 1.0 if moment.spin else sqrt(n * (n + 1.0) * (2 * n + 1)))
        if moment.powers == "3K-J":
            diagonal *= (3.0 * low.k.astype(float) ** 2 - n * (n + 1.0)) / 2
        return np.diag(diagonal)

    def _tensor(self, components: Any, rank: int) -> BodyTensor:
        """The spherical tensor of these components, computed once."""
        key = (rank, components)
        if key not in self._cache:
            self._cache[key] = body_tensor(components, rank, self.representation)
        tensor: BodyTensor = self._cache[key]
        return tensor


def moments_of(
    levels: Levels, dipoles: dict[tuple[int, int], tuple[float, float, float]], moments: Sequence[Moment]
) -> SpinMoments:
    """Dipoles by pairs of states and other moments, for levels with spins; ValueError for levels without."""
    if not levels.blocks or not isinstance(levels.blocks[0], SpinBlock):
        raise ValueError("moments besides plain dipoles need levels that were solved with spins")
    shared = levels.blocks[0].shared
    return SpinMoments(with_dipoles(dipoles, moments), shared.scheme, shared.representation)


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
