"""Elements of molecule-fixed tensors between levels with spins.

A dipole touches no spin: its element between two functions is that of the rotation times a product of 6j symbols,

    ⟨r' p'‖T^K‖r p⟩ = t(p', p) ⟨r'‖T^K‖r⟩,

see `coupling.tensor_coefficients`. Elements of the rotation are computed once for all F.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.spins.axial import contracted_tensors
from rotor.quantum.spins.blocks import Shared, SpinBlock, product
from rotor.quantum.spins.contraction import by_numbers
from rotor.quantum.spins.coupling import for_every_f, tensor_coefficients
from rotor.quantum.spins.parts import SpinPart
from rotor.quantum.spins.scheme import Scheme
from rotor.quantum.tensors import Tensors, rank_of

_FEW = 10_000  # elements between two F; where there are more, they are made when they are needed
ROUND_OFF = 1e-13  # of sums of products of a few coefficients of size 1


def amplitudes(up: SpinBlock, low: SpinBlock, tensors: Tensors) -> Floats:
    """Real reduced elements between all states of two blocks, (n_up, n_low); their squares are line strengths."""
    rank = rank_of(tensors)
    t, acting = _coefficients(up, low, rank), _acting(up, low, tensors, rank)
    rows, columns = up.vectors.shape[0], low.vectors.shape[0]
    if rows * columns <= _FEW:
        whole, of_single = np.zeros((rows, columns)), t.tolist() if up.single and low.single else None
        for target, source, element in acting:
            if of_single:
                factor = of_single[target.patterns.start][source.patterns.start]
                np.multiply(element, factor, out=whole[target.place, source.place])
            else:
                whole[target.place, source.place] = product(t[target.patterns, source.patterns], element)
        return np.asarray(up.vectors.T @ (whole @ low.vectors))
    moved = np.zeros((rows, low.vectors.shape[1]))
    for target, source, element in acting:
        moved[target.place] += acting_on(low.vectors[source.place], t[target.patterns, source.patterns], element)
    return np.asarray(up.vectors.T @ moved)


def acting_on(vectors: Floats, coefficients: Floats, element: Floats) -> Floats:
    """The Kronecker product of coefficients (p', p) and an element of the rotation (r', r) times columns (p r, n)."""
    (target, source), (up, low) = coefficients.shape, element.shape
    if source == 1:
        moved = element @ vectors
        return np.asarray(moved * coefficients[0, 0] if target == 1 else np.kron(coefficients, moved))
    each = np.matmul(element, vectors.reshape(source, low, -1)).reshape(source, -1)
    return np.asarray((coefficients @ each).reshape(target * up, -1))


def connected(up: SpinBlock, low: SpinBlock, tensors: Tensors) -> bool:
    """Whether the tensors have an element between two blocks."""
    return bool(_acting(up, low, tensors, rank_of(tensors)))


Acting = list[tuple[SpinPart, SpinPart, Floats]]


@dataclass(frozen=True)
class Elements:
    """Elements of some tensors between the blocks of the rotation, and between which parts of pairs of spin blocks they act.

    partners: of every block by its number those with an element.
    """

    partners: dict[int, list[tuple[int, Floats]]]
    pairs: dict[tuple[int, int], Acting] = field(default_factory=dict)
    reached: dict[int, set[int]] = field(default_factory=dict)

    def reached_from(self, up: SpinBlock) -> set[int]:
        """The numbers of all partners of the parts of a block."""
        if up.start not in self.reached:
            self.reached[up.start] = {number for own in up.by_number for number, _ in self.partners.get(own, ())}
        return self.reached[up.start]

    def acting(self, up: SpinBlock, low: SpinBlock) -> Acting:
        """Pairs of parts of two blocks with their elements."""
        sources = low.by_number
        return [
            (target, source, found)
            for target in up.parts
            for number, found in self.partners.get(target.number, ())
            if number in sources
            for source in sources[number]
        ]


def _elements(shared: Shared, tensors: Tensors) -> Elements:
    """All of them at once."""
    key = ("elements", *sorted(tensors.items(), key=lambda one: one[0]))
    if key not in shared.cache:
        partners: dict[int, list[tuple[int, Floats]]] = {}
        for (i, k), element in by_numbers(contracted_tensors(shared.stacks, tensors)).items():
            partners.setdefault(i, []).append((k, element))
        shared.cache[key] = Elements(partners)
    elements: Elements = shared.cache[key]
    return elements


def _acting(up: SpinBlock, low: SpinBlock, tensors: Tensors, rank: int) -> Acting:
    """Pairs of parts between which the tensors act, with the element of the rotation."""
    if not abs(up.twice_f - low.twice_f) <= 2 * rank <= up.twice_f + low.twice_f:
        return []
    elements, place = _elements(low.shared, tensors), (up.start, low.start)
    if place not in elements.pairs:
        if elements.reached_from(up).isdisjoint(low.by_number):
            return []
        found = elements.acting(up, low)
        if low.shared.scheme.equivalent:
            t = _coefficients(up, low, rank)
            found = [(target, source, x) for target, source, x in found if t[target.patterns, source.patterns].any()]
        elements.pairs[place] = found
    return elements.pairs[place]


def _coefficients(up: SpinBlock, low: SpinBlock, rank: int) -> Floats:
    """t(p', p) between all patterns of two F."""
    shared, key = low.shared, ("tensor", rank, up.twice_f, low.twice_f)
    if key not in shared.cache:
        shared.cache.update(_of_alike(shared, rank, up, low))
    found: Floats = shared.cache[key]
    return found


def _of_alike(shared: Shared, rank: int, up: SpinBlock, low: SpinBlock) -> dict[tuple[str, int, int, int], Floats]:
    """t(p', p) between these F and, where patterns are few, between all others of the same distance."""
    if shared.scheme.equivalent or "patterns" not in shared.cache or len(up.patterns) * len(low.patterns) > _FEW:
        only = _tensor_coefficients(shared.scheme, rank, up.patterns, low.patterns)
        return {("tensor", rank, up.twice_f, low.twice_f): only}
    step = up.twice_f - low.twice_f
    found = coefficients_of_step(shared.scheme, shared.cache["patterns"], rank, step)
    return {("tensor", rank, f + step, f): own for f, own in found.items()}


def coefficients_of_step(scheme: Scheme, every: dict[int, Ints], rank: int, step: int) -> dict[int, Floats]:
    """t(p', p) of all F' = F + step by F, where there are both.

    Parameters
    ----------
    scheme : Scheme
        Which spins are coupled.
    every : dict of int to (n, columns) array
        Coupling patterns by doubled F.
    rank, step : int
        Rank of the tensor, and by how much F changes, doubled.

    Returns
    -------
    dict of int to (n', n) array
        Pure numbers by doubled F.
    """
    tables = {f: (every[f + step], own) for f, own in every.items() if f + step in every}
    if scheme.equivalent:
        return {f: _tensor_coefficients(scheme, rank, *of_both) for f, of_both in tables.items()}
    return for_every_f(tables, lambda bra, ket: tensor_coefficients(scheme.twice, rank, bra, ket))


def _tensor_coefficients(scheme: Scheme, rank: int, bra: Ints, ket: Ints) -> Floats:
    if not scheme.equivalent:
        return tensor_coefficients(scheme.twice, rank, bra, ket)
    (up, left), (low, right) = (scheme.recoupling(int(own[0, -1])) for own in (bra, ket))
    found = left.T @ tensor_coefficients(scheme.twice, rank, up, low) @ right
    return np.where(np.abs(found) > ROUND_OFF, found, 0.0)
