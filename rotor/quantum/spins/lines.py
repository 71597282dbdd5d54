"""Elements of molecule-fixed tensors between levels with spins.

A dipole does not act on spins: its element between two functions is that of the rotation times a product of 6j symbols,

    ⟨r' p'‖T^K‖r p⟩ = t(p', p) ⟨r'‖T^K‖r⟩,

see `coupling.moment_coefficients`. Elements of the rotation are computed once for all F.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.spins.axial import contracted_tensors
from rotor.quantum.spins.blocks import Shared, SpinBlock, product
from rotor.quantum.spins.contraction import by_numbers
from rotor.quantum.spins.parts import SpinPart
from rotor.quantum.spins.pattern_tables import coefficients_of_step, tensor_coefficients
from rotor.quantum.tensors import Tensors, rank_of

_FEW = 10_000  # with more elements between two F, they are computed one pair of F at a time


Acting = list[tuple[SpinPart, SpinPart, Floats]]
"""Pairs of parts of two blocks with the elements of the rotation between their states."""


def amplitudes(up: SpinBlock, low: SpinBlock, tensors: Tensors) -> Floats:
    """Real reduced elements between all states of two blocks, (n_up, n_low); their squares are line strengths."""
    rank = rank_of(tensors)
    return between_states(up, low, [(_coefficients(up, low, rank), _acting(up, low, tensors, rank))])


def between_states(up: SpinBlock, low: SpinBlock, operators: Sequence[tuple[Floats, Acting]]) -> Floats:
    """Σ t(p', p) ⟨r'|X|r⟩ of operators between all states of two blocks, (n_up, n_low); each with t of all patterns."""
    rows, columns = up.vectors.shape[0], low.vectors.shape[0]
    if rows * columns <= _FEW:
        whole = np.zeros((rows, columns))
        for t, acting in operators:
            single_factors = t.tolist() if up.single and low.single else None
            for target, source, element in acting:
                if single_factors:
                    factor = single_factors[target.patterns.start][source.patterns.start]
                    whole[target.place, source.place] += factor * element
                else:
                    whole[target.place, source.place] += product(t[target.patterns, source.patterns], element)
        return np.asarray(up.vectors.T @ (whole @ low.vectors))
    moved = np.zeros((rows, low.vectors.shape[1]))
    for t, acting in operators:
        for target, source, element in acting:
            moved[target.place] += acting_on(low.vectors[source.place], t[target.patterns, source.patterns], element)
    return np.asarray(up.vectors.T @ moved)


def acting_on(vectors: Floats, coefficients: Floats, element: Floats) -> Floats:
    """Apply the Kronecker product of coefficients (p', p) and a rotational matrix (r', r) to columns (p r, n)."""
    (target, source), (up, low) = coefficients.shape, element.shape
    if source == 1:
        moved = element @ vectors
        return np.asarray(moved * coefficients[0, 0] if target == 1 else np.kron(coefficients, moved))
    each = np.matmul(element, vectors.reshape(source, low, -1)).reshape(source, -1)
    return np.asarray((coefficients @ each).reshape(target * up, -1))


@dataclass(frozen=True)
class Elements:
    """Elements of tensors between rotational blocks, and the parts of spin blocks between which they act.

    partners: for each rotational block, the blocks with which it has an element, and the element.
    """

    partners: dict[int, list[tuple[int, Floats]]]
    pairs: dict[tuple[int, int], Acting] = field(default_factory=dict)
    reached: dict[int, set[int]] = field(default_factory=dict)

    def reached_from(self, up: SpinBlock) -> set[int]:
        """The numbers of all rotational blocks with which a spin block has an element."""
        if up.start not in self.reached:
            self.reached[up.start] = {
                number for part_number in up.by_number for number, _ in self.partners.get(part_number, ())
            }
        return self.reached[up.start]

    def acting(self, up: SpinBlock, low: SpinBlock) -> Acting:
        """Pairs of parts of two blocks with their elements."""
        sources = low.by_number
        return [
            (target, source, element)
            for target in up.parts
            for number, element in self.partners.get(target.number, ())
            if number in sources
            for source in sources[number]
        ]


def connected_blocks(blocks: Sequence[SpinBlock], tensors: Tensors) -> Iterator[tuple[SpinBlock, SpinBlock]]:
    """The pairs (up, low) of blocks with elements of the tensors, as `reduced.connected_pairs` lists them.

    Only blocks with a rotational block that the tensors reach from the other are tested: all pairs of two F are too many.
    """
    rank, elements = rank_of(tensors), _elements(blocks[0].shared, tensors)
    by_f: dict[int, list[SpinBlock]] = {}
    holders: dict[int, dict[int, list[int]]] = {}  # places of the blocks of an F that have a rotational block
    for block in blocks:
        blocks_of_f = by_f.setdefault(block.twice_f, [])
        for number in block.by_number:
            holders.setdefault(block.twice_f, {}).setdefault(number, []).append(len(blocks_of_f))
        blocks_of_f.append(block)
    for twice_f, lows in sorted(by_f.items()):
        for first, low in enumerate(lows):
            reached = elements.reached_from(low)
            for rise in range(rank + 1):
                ups, places_by_number = by_f.get(twice_f + 2 * rise, []), holders.get(twice_f + 2 * rise, {})
                places = {
                    place for number in reached for place in places_by_number.get(number, ()) if rise or place >= first
                }
                yield from ((ups[i], low) for i in sorted(places) if _acting(ups[i], low, tensors, rank))


def _elements(shared: Shared, tensors: Tensors) -> Elements:
    """Elements of the tensors between all rotational blocks, computed once."""
    key = ("elements", *sorted(tensors.items(), key=lambda pair: pair[0]))
    if key not in shared.cache:
        partners: dict[int, list[tuple[int, Floats]]] = {}
        for (i, k), element in by_numbers(contracted_tensors(shared.stacks, tensors)).items():
            partners.setdefault(i, []).append((k, element))
        shared.cache[key] = Elements(partners)
    elements: Elements = shared.cache[key]
    return elements


def _acting(up: SpinBlock, low: SpinBlock, tensors: Tensors, rank: int) -> Acting:
    """Pairs of parts between which the tensors act, with the rotational element."""
    if not abs(up.twice_f - low.twice_f) <= 2 * rank <= up.twice_f + low.twice_f:
        return []
    elements, place = _elements(low.shared, tensors), (up.start, low.start)
    if place not in elements.pairs:
        if elements.reached_from(up).isdisjoint(low.by_number):
            return []
        acting = elements.acting(up, low)
        if low.shared.scheme.equivalent:
            t = _coefficients(up, low, rank)
            acting = [(target, source, x) for target, source, x in acting if t[target.patterns, source.patterns].any()]
        elements.pairs[place] = acting
    return elements.pairs[place]


def _coefficients(up: SpinBlock, low: SpinBlock, rank: int) -> Floats:
    """t(p', p) between all patterns of two F."""
    shared, key = low.shared, ("tensor", rank, up.twice_f, low.twice_f)
    if key not in shared.cache:
        shared.cache.update(_coefficients_of_step(shared, rank, up, low))
    coefficients: Floats = shared.cache[key]
    return coefficients


def _coefficients_of_step(
    shared: Shared, rank: int, up: SpinBlock, low: SpinBlock
) -> dict[tuple[str, int, int, int], Floats]:
    """t(p', p) between these two F and, where patterns are few, between all F with this difference."""
    if shared.scheme.equivalent or "patterns" not in shared.cache or len(up.patterns) * len(low.patterns) > _FEW:
        only = tensor_coefficients(shared.scheme, rank, up.patterns, low.patterns)
        return {("tensor", rank, up.twice_f, low.twice_f): only}
    step = up.twice_f - low.twice_f
    by_f = coefficients_of_step(shared.scheme, shared.cache["patterns"], rank, step)
    return {("tensor", rank, f + step, f): coefficients for f, coefficients in by_f.items()}
